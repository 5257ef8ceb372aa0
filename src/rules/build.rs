//! Lists the shader rules: every file in a folder of `shader/rules` that is named after a domain is one.

use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

/// The domains' folders, in the order of evaluation.
const DOMAINS: [&str; 3] = ["vertex", "texel", "fragment"];

fn main() {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("shader/rules");
    println!("cargo:rerun-if-changed={}", root.display());
    let mut list = String::from("[\n");
    for domain in DOMAINS {
        let folder = root.join(domain);
        let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("a readable folder").path()).collect();
        files.retain(|path| path.extension().is_some_and(|ending| ending == "wgsl"));
        files.sort();
        for path in files {
            let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
            let path = path.to_string_lossy().into_owned();
            let _ = writeln!(list, "    ({domain:?}, {name:?}, include_str!({path:?})),");
        }
    }
    list.push(']');
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("rules.rs");
    fs::write(&out, list).unwrap_or_else(|error| panic!("{}: {error}", out.display()));
}

//! Makes one file of the page: its HTML with style, script, and the library as WebAssembly; the scene is put into it by
//! `skinfit page`.
//!
//! `skinfit-page-pack LIBRARY.wasm PAGE.html`

use std::error::Error;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use wasm_bindgen_cli_support::Bindgen;

/// The page's parts.
const PAGE: &str = include_str!("../page.html");
const SCRIPT: &str = concat!(
    include_str!("../script/workers.js"),
    include_str!("../script/state.js"),
    include_str!("../script/rows.js"),
    include_str!("../script/panes.js"),
    include_str!("../script/fit.js"),
    include_str!("../script/keys.js"),
    include_str!("../script/begin.js"),
);
const PARTS: [(&str, &str); 3] = [
    ("{{css}}", include_str!("../page.css")),
    ("{{worker}}", include_str!("../worker.js")),
    ("{{script}}", SCRIPT),
];

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(library), Some(page), None) = (arguments.next(), arguments.next(), arguments.next()) else {
        eprintln!("usage: skinfit-page-pack LIBRARY.wasm PAGE.html");
        return ExitCode::from(2);
    };
    match packed(&library, &page) {
        Ok(words) => {
            eprintln!("{words}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("skinfit-page-pack: {}: {error}", library.display());
            ExitCode::FAILURE
        }
    }
}

fn packed(library: &Path, page: &Path) -> Result<String, Box<dyn Error>> {
    let mut bindgen = Bindgen::new();
    bindgen.input_path(library).no_modules(true)?.typescript(false).remove_name_section(true);
    let mut output = bindgen.generate_output()?;
    let wasm = output.wasm_mut().emit_wasm();
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(&wasm)?;
    let packed = BASE64_STANDARD.encode(gzip.finish()?);
    // In a script element a text ends where the element does.
    let glue = output.js().replace("</script", "<\\/script");
    let html = PARTS.iter().fold(PAGE.to_owned(), |html, (mark, part)| html.replacen(mark, part, 1));
    let html = html.replacen("{{glue}}", &glue, 1).replacen("{{library}}", &packed, 1);
    // Beside its place first: nobody finds half of it. The folder may be of a build to come.
    let beside = page.with_extension("part");
    let put = || -> std::io::Result<()> {
        page.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        std::fs::write(&beside, &html)?;
        std::fs::rename(&beside, page)
    };
    put().map_err(|error| format!("{} cannot be written: {error}", page.display()))?;
    let mebibytes = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    let (whole, library) = (mebibytes(html.len()), mebibytes(wasm.len()));
    Ok(format!("wrote {}: {whole:.2} MiB, of which the library is {library:.2} MiB unpacked", page.display()))
}

//! How long builds take, and of what: experiments/builds.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::lab::{Lab, Result, csv};
use crate::studies::number;

/// The last commit of which everything was one package.
pub(crate) const ONE_PACKAGE: &str = "da7d59c";
/// Sources that nobody writes.
const PRINTED: [&str; 2] = ["engine/cpu/ahead/tapes.rs", "engine/loss/printed.rs"];
/// How many of the longest compilations are named.
const LONGEST: usize = 12;

/// experiments/builds: the last commit with a single package, and this one.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let head = git(lab, &["rev-parse", "--short", "HEAD"])?.join("");
    let pages = lab.scratch.path();
    let mut command = Command::new("experiments/builds/run");
    command.arg(pages).args([ONE_PACKAGE, &head]);
    let rows = csv(&lab.run("builds from nothing", command, false)?)?;
    let (then, now) = rows.split_at(rows.len() / 2);
    let seconds = |rows: &[Value], what: &str| -> Result<Value> {
        let row = rows.iter().find(|row| row["what"] == what);
        Ok(row.ok_or(format!("no row of {what}"))?["seconds"].clone())
    };
    let row = |(what, name): (&str, &str)| -> Result<Value> {
        Ok(json!({ "what": name, "then": seconds(then, what)?, "now": seconds(now, what)? }))
    };
    let built = [
        ("first", "the first command, from nothing"),
        ("command_line", "a new program after a line of the command line"),
        ("rule", "a new program after a rule"),
    ];
    let of = |commit: &str| -> Result<(Vec<Value>, f64)> {
        let mut units = units(&pages.join(format!("{commit}_first.html")))?;
        let sum = units.iter().map(|unit| number(&unit["seconds"])).sum();
        units.truncate(LONGEST);
        Ok((units, sum))
    };
    let ((longest_then, sum_then), (longest, sum)) = (of(ONE_PACKAGE)?, of(&head)?);
    // A parameter of the paper's effects, then and now.
    let paper = "side_specular\\|SideSpecular";
    Ok(json!({
        "rows": built.into_iter().map(row).collect::<Result<Vec<Value>>>()?,
        "sum": { "then": sum_then, "now": sum },
        "longest": { "then": longest_then, "now": longest },
        "packages": { "then": packages(lab, ONE_PACKAGE)?, "now": packages(lab, &head)? },
        "files": {
            "side_specular": { "then": files_of(lab, ONE_PACKAGE, paper)?, "now": files_of(lab, &head, paper)? },
        },
    }))
}

/// What git says of a commit, line by line.
fn git(lab: &Lab, arguments: &[&str]) -> Result<Vec<String>> {
    let mut command = Command::new("git");
    command.args(arguments);
    Ok(lab.run("the commit's files", command, false)?.lines().map(str::to_owned).collect())
}

/// How many files of the sources, tests aside, a parameter's name stands in.
fn files_of(lab: &Lab, commit: &str, name: &str) -> Result<usize> {
    let found = git(lab, &["grep", "-l", name, commit, "--", "src/*.rs", "src/*.wgsl"])?;
    Ok(found.iter().filter(|file| !file.contains("/tests")).count())
}

/// The packages whose sources lie beneath `src`, and their lines of Rust without what is printed from the rules, the
/// longest first.
fn packages(lab: &Lab, commit: &str) -> Result<Vec<Value>> {
    let mut lines = BTreeMap::<String, u64>::new();
    let manifests = git(lab, &["ls-tree", "-r", "--name-only", commit, "--", "src"])?;
    let members: Vec<&str> = manifests.iter().filter_map(|file| file.strip_suffix("/Cargo.toml")).collect();
    for counted in git(lab, &["grep", "-c", "", commit, "--", "src/*.rs"])? {
        let (file, count) = counted.rsplit_once(':').ok_or("a file and its lines")?;
        let (_, file) = file.split_once(':').ok_or("a commit and its file")?;
        if PRINTED.iter().any(|printed| file.ends_with(printed)) {
            continue;
        }
        let member = members.iter().find(|member| file.starts_with(&format!("{member}/")));
        *lines.entry(member.map_or("skinfit", |member| member).to_owned()).or_default() +=
            count.parse::<u64>()?;
    }
    let mut packages: Vec<Value> =
        lines.into_iter().map(|(name, lines)| json!({ "name": name, "lines": lines })).collect();
    packages.sort_by_key(|package| std::cmp::Reverse(package["lines"].as_u64()));
    Ok(packages)
}

/// What cargo's page of a build says of each compilation, the longest first.
fn units(page: &Path) -> Result<Vec<Value>> {
    let text = std::fs::read_to_string(page)?;
    let what = format!("{} holds no UNIT_DATA", page.display());
    let (_, data) = text.split_once("UNIT_DATA = ").ok_or(what)?;
    // What follows the array is the page's program.
    let data: Vec<Value> =
        serde_json::Deserializer::from_str(data).into_iter().next().ok_or("UNIT_DATA is empty")??;
    let mut units: Vec<Value> = data
        .iter()
        .map(|unit| {
            let name = unit["name"].as_str().unwrap_or_default();
            let target = unit["target"].as_str().unwrap_or_default().trim();
            let name = if target.is_empty() { name.to_owned() } else { format!("{name}, {target}") };
            json!({ "name": name, "seconds": unit["duration"] })
        })
        .collect();
    units.sort_by(|a, b| number(&b["seconds"]).total_cmp(&number(&a["seconds"])));
    Ok(units)
}

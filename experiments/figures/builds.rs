//! How long builds take, and what of them: experiments/builds.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::lab::{Lab, Result, csv};
use crate::studies::number;

/// The last commit of which everything was one package.
const ONE_PACKAGE: &str = "da7d59c";
/// How many of the longest compilations are named.
const LONGEST: usize = 12;

/// experiments/builds: the last commit with one package, and this one.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let mut head = Command::new("git");
    head.args(["rev-parse", "--short", "HEAD"]);
    let head = lab.run("the commit", head, false)?.trim().to_owned();
    let pages = lab.scratch.path();
    let mut command = Command::new("experiments/builds/run");
    command.arg(pages).args([ONE_PACKAGE, &head]);
    let rows = csv(&lab.run("builds from nothing", command, false)?)?;
    let mut raw = json!({});
    for (name, commit) in [("one_package", ONE_PACKAGE), ("members", &head)] {
        let seconds = |what: &str| {
            let row = rows.iter().find(|row| row["commit"] == *commit && row["what"] == what);
            row.map(|row| row["seconds"].clone()).ok_or(format!("no row of {commit}, {what}"))
        };
        let units = |what: &str| units(&pages.join(format!("{commit}_{what}.html")));
        let mut longest = units("first")?;
        let sum: f64 = longest.iter().map(|unit| number(&unit["seconds"])).sum();
        longest.truncate(LONGEST);
        raw[name] = json!({
            "commit": commit,
            "first": seconds("first")?,
            "command line": seconds("command_line")?,
            "rule": seconds("rule")?,
            "sum of units": sum,
            "longest": longest,
            "after a rule": units("rule")?.into_iter().filter(|unit| number(&unit["seconds"]) >= 1.0).collect::<Vec<_>>(),
        });
    }
    Ok(raw)
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

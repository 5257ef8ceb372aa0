//! `skinfit params`: the parameter table.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::columns::aligned;
use super::{Exit, Refusal, say};
use crate::model::params::{Owner, ParamInfo, Scale, TABLE};
use crate::scene::{interval, light_families, register_terms};
use crate::shader::term::library;

/// Print the parameter table: name, defaults, bounds, unit, kind, source
#[derive(clap::Args)]
#[command(
    after_help = "`corrected` and `listing` are the defaults of the two forms.\n\nEach light of a scene brings parameters of its name: in their place stand those of a directional light called beam and of a point or spot light called lamp, where no scene is named.\n\nExamples:\n  skinfit params\n  skinfit params scene.toml\n  skinfit params --format markdown > parameters.md"
)]
pub(super) struct Arguments {
    /// A scene file, whose terms' parameters are listed too.
    scene: Option<PathBuf>,
    /// How it is printed.
    #[arg(long, default_value = "text", value_parser = ["text", "markdown", "json"])]
    format: String,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let terms = match &arguments.scene {
        Some(scene) => register_terms(scene)?,
        // Without a scene nobody has named a light.
        None => light_families()?.to_vec(),
    };
    let added = terms.iter().flat_map(|term| &term.params).map(|param| param.info());
    let library = library::terms().iter().flat_map(|term| &term.params).map(|param| param.info());
    let rows: Vec<&ParamInfo> = TABLE.iter().chain(library).chain(added).collect();
    let text = match arguments.format.as_str() {
        "json" => json(&rows),
        "markdown" => markdown(&rows),
        _ => plain(&rows),
    };
    say(text.trim_end())?;
    Ok(Exit::Done)
}

fn kind(row: &ParamInfo) -> String {
    let channels = if row.rgb { "scalar or rgb" } else { "scalar" };
    let shape = match (row.linear, row.scale) {
        (true, _) => "linear",
        (false, Scale::Linear) => "non-linear",
        (false, Scale::Log) => "non-linear, by its logarithm",
    };
    let owner = if row.owner == Owner::Scene { ", each scene's own" } else { "" };
    let share = row.share.map_or(String::new(), |whole| format!(", a share of {whole}"));
    format!("{channels}, {shape}{owner}{share}")
}

/// A default, a channel each where they differ.
fn default(row: &ParamInfo, default: f64) -> String {
    match row.channels {
        None => default.to_string(),
        Some(channels) => format!("({})", channels.map(|channel| channel.to_string()).join(", ")),
    }
}

const HEAD: [&str; 8] = ["name", "corrected", "listing", "bounds", "unit", "kind", "source", "meaning"];

fn cells(row: &ParamInfo) -> [String; 8] {
    [
        row.name.to_owned(),
        default(row, row.corrected),
        default(row, row.listing),
        interval(row.lower, row.upper),
        row.unit.to_owned(),
        kind(row),
        row.source.to_owned(),
        row.meaning.to_owned(),
    ]
}

fn plain(rows: &[&ParamInfo]) -> String {
    let rows: Vec<[String; 8]> =
        std::iter::once(HEAD.map(str::to_owned)).chain(rows.iter().map(|row| cells(row))).collect();
    aligned(&rows)
}

/// The table as Markdown; docs/parameters.md holds exactly this.
#[must_use]
fn markdown(rows: &[&ParamInfo]) -> String {
    let mut text = format!("| {} |\n|{}\n", HEAD.join(" | "), " --- |".repeat(8));
    for row in rows {
        let cells = cells(row).map(|cell| cell.replace('|', "\\|"));
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    text
}

fn json_default(row: &ParamInfo, default: f64) -> serde_json::Value {
    row.channels.map_or_else(|| default.into(), |channels| serde_json::json!(channels))
}

fn json(rows: &[&ParamInfo]) -> String {
    // JSON knows no infinity: null is "no bound".
    let finite = |x: f64| if x.is_finite() { serde_json::json!(x) } else { serde_json::Value::Null };
    let rows: Vec<serde_json::Value> = rows
        .iter()
        .map(|row| {
            let effects: Vec<&str> = row.effects.iter().map(|effect| effect.name()).collect();
            serde_json::json!({
                "name": row.name, "default": {"corrected": json_default(row, row.corrected), "listing": json_default(row, row.listing)},
                "bounds": [finite(row.lower), finite(row.upper)], "unit": row.unit,
                "rgb": row.rgb, "linear": row.linear, "share": row.share, "owner": row.owner.name(), "effects": effects,
                "source": row.source, "meaning": row.meaning,
            })
        })
        .collect();
    format!("{:#}", serde_json::Value::Array(rows))
}

//! `skinfit shader`: the shader that a scene gets, and the plan behind it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::scene::{SceneArguments, parse_effects};
use super::{Exit, Refusal, tell_warnings, write_or_say};
use crate::fit::params_file::{Foreign, ParamsFile};
use crate::model::effects::Effects;
use crate::scene::Scene;
use crate::scene::load::LoadOptions;
use crate::shader::atlas::{Axis, Pass, PassKind};
use crate::shader::{Budget, Domain, Plan, cited, plan};

/// Print the shader that a scene gets, and the plan behind it
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  skinfit shader scene.toml\n  skinfit shader --effects diffuse,rim --accuracy paper --show plan\n  skinfit shader scene.toml --show wgsl -o skin.wgsl"
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Parameters of an earlier fit, instead of the scene's start values.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    /// Effects to switch on, comma-separated, instead of the scene's.
    #[arg(long, value_name = "LIST", value_parser = parse_effects)]
    effects: Option<Effects>,
    /// How far the output may be off: `exact`, `paper` (what the paper's programs did), or a number
    /// relative to white.
    #[arg(long, value_name = "BUDGET", default_value = "exact", value_parser = parse_budget)]
    accuracy: Budget,
    /// Let the shader compute in 16 bits where that is accurate enough.
    #[arg(long)]
    f16: bool,
    /// What to print.
    #[arg(long, default_value = "all", value_parser = ["all", "plan", "wgsl"])]
    show: String,
    /// A file to write instead of standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let (path, _scratch) = arguments.scene.path()?;
    let load = LoadOptions { effects: arguments.effects, targets: false, ..LoadOptions::default() };
    let (scene, warnings) = Scene::load(&path, &load)?;
    tell_warnings(&warnings.iter().map(ToString::to_string).collect::<Vec<_>>());
    let params = match &arguments.params {
        Some(path) => {
            let file = ParamsFile::read(path, scene.form, &scene.params)?.of_scene(&scene.path);
            tell_foreign(arguments, path, &file, &scene);
            file.params
        }
        None => scene.params.clone(),
    };
    let plan = plan(&scene.facts(&params, arguments.accuracy, arguments.f16))?;
    let text = match arguments.show.as_str() {
        "plan" => table(&plan, ""),
        "wgsl" => modules(&plan),
        _ => format!("{}\n{}", table(&plan, "// "), modules(&plan)),
    };
    write_or_say(arguments.output.as_deref(), &cited(&text))?;
    Ok(Exit::Done)
}

/// Say so where the parameters were fitted with other effects than the shader computes.
fn tell_foreign(arguments: &Arguments, path: &Path, file: &ParamsFile, scene: &Scene) {
    let foreign = Foreign {
        file: path,
        fitted: file.effects,
        scene: if arguments.effects.is_some() { Path::new("--effects") } else { &scene.path },
        effects: scene.effects,
        params: &file.params,
        chosen: &[],
    };
    let remedy =
        "To have that of what was fitted, name the scene that was fitted, or its effects with --effects.";
    let words = foreign.words("computed", remedy, arguments.effects.is_none());
    tell_warnings(&words.into_iter().collect::<Vec<_>>());
}

/// `exact`, `paper` or a number.
pub(super) fn parse_budget(text: &str) -> Result<Budget, String> {
    match text {
        "exact" => Ok(Budget::Exact),
        "paper" => Ok(Budget::Paper),
        number => match number.parse() {
            Ok(most) if (0.0..=1.0).contains(&most) => Ok(Budget::Within(most)),
            _ => Err("give `exact`, `paper` or a number from 0 to 1, such as 0.005".to_owned()),
        },
    }
}

/// The plan as a table, each line after `margin`.
fn table(plan: &Plan, margin: &str) -> String {
    let mut text = String::new();
    let mut line = |words: String| {
        let _ = writeln!(text, "{}", format!("{margin}{words}").trim_end());
    };
    line(format!(
        "{} rules, about {:.0} operations a fragment, error at most {:.1e}",
        plan.all_steps().len(),
        plan.cost,
        plan.error
    ));
    line(format!("vertex attributes: {}", list(plan.attributes.iter().map(|a| a.name()))));
    line(format!("interpolated: {}", list(plan.varyings.iter().map(|(name, _)| *name))));
    line(format!("bound: {}", list(plan.resources.iter().map(|r| r.name()))));
    line(format!("constants: {}", list(plan.constants.iter().map(|c| c.name()))));
    for (i, pass) in plan.passes.iter().enumerate() {
        line(format!("pass {} over the atlas: {}", i + 1, told(pass)));
    }
    line(String::new());
    line(format!("{:<10} {:<26} {:<28} {:>5} {:>8}", "where", "quantity", "rule", "cost", "error"));
    for step in plan.all_steps() {
        let domain = step.rule.domain.name();
        let gives = list(step.rule.gives.iter().map(|(quantity, _)| *quantity));
        let (name, cost, error) = (step.rule.name, step.cost, step.error);
        line(format!("{domain:<10} {gives:<26} {name:<28} {cost:>5.0} {error:>8.1e}"));
    }
    line(String::new());
    line("left out:".to_owned());
    for (rule, reason) in plan.left_out() {
        // A rule of several domains is left out of each by itself.
        let domain = if rule.domain == Domain::Texel { ", in texels" } else { "" };
        line(format!("  {:<28} {reason}{domain}", rule.name));
    }
    text
}

/// The image's module; those of passes over the atlas go before, each under a line of its own.
fn modules(plan: &Plan) -> String {
    let Some(_) = plan.passes.first() else { return plan.wgsl.clone() };
    let pass =
        |(i, pass): (usize, &Pass)| format!("// Pass {}: {}\n\n{}\n", i + 1, told(pass), pass.plan.wgsl);
    let passes: String = plan.passes.iter().enumerate().map(pass).collect();
    format!("{passes}// The image\n\n{}", plan.wgsl)
}

/// What a pass does, in words.
fn told(pass: &Pass) -> String {
    let leaves = list(pass.leaves.iter().map(|level| level.name.as_str()));
    match pass.kind {
        PassKind::Draw => format!("{leaves}, drawn"),
        PassKind::Neighbours => format!("{leaves}, from neighbour to neighbour"),
        PassKind::Surface => format!("{leaves}, summed up over the surface"),
        PassKind::Dilate => format!("{leaves}, its empty texels filled"),
        PassKind::Blur(Axis::U) => format!("{leaves}, blurred along u"),
        PassKind::Blur(Axis::V) => format!("{leaves}, blurred along v"),
    }
}

fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

//! What a job runs, and which settings that takes.

use toml::Value;

use crate::fit::SolverKind;
use crate::scene::suggestion;
use crate::tradeoff::axes;

/// What a job runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// A fit.
    Fit,
    /// Each part of the model left out in turn.
    Ablate,
    /// Each approximation swept.
    Tradeoff,
    /// A study of stability.
    Stability,
}

/// The scene file's tables that settings may reach into.
const TABLES: [&str; 7] = ["mesh", "maps", "environment", "model", "view", "fit", "quality"];

impl Command {
    /// Every command, by its name.
    pub const ALL: [(&'static str, Self); 4] = [
        ("fit", Self::Fit),
        ("ablate", Self::Ablate),
        ("tradeoff", Self::Tradeoff),
        ("stability", Self::Stability),
    ];

    /// The name in plans and results.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Ablate => "ablate",
            Self::Tradeoff => "tradeoff",
            Self::Stability => "stability",
        }
    }

    /// The command of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(own, _)| *own == name).map(|(_, command)| command)
    }

    /// The keys of settings that are the command's, not the scene's.
    #[must_use]
    pub const fn options(self) -> &'static [&'static str] {
        match self {
            Self::Fit => &["command", "scene", "solver", "starts", "seed", "max_iterations"],
            Self::Ablate => &["command", "scene", "params", "pairs", "refit"],
            Self::Tradeoff => &["command", "scene", "params", "axes"],
            Self::Stability => &["command", "scene", "seed", "cases", "pixels"],
        }
    }

    /// Whether a setting is one of the command's or of a scene's.
    #[must_use]
    pub fn takes(self, key: &str) -> bool {
        self.options().contains(&key) || of_scene(key)
    }
}

/// Whether a key is one of a scene file.
fn of_scene(key: &str) -> bool {
    key.split_once('.').is_some_and(|(table, _)| TABLES.contains(&table))
}

/// What is wrong with a setting in a plan that runs these commands, and what to do.
///
/// # Errors
/// The two, in words.
pub fn check_setting(commands: &[Command], key: &str, value: &Value) -> Result<(), (String, String)> {
    if !commands.iter().any(|command| command.takes(key)) {
        let mut known: Vec<&str> = Vec::new();
        for key in commands.iter().flat_map(|command| command.options()).chain(&TABLES) {
            if !known.contains(key) {
                known.push(key);
            }
        }
        let remedy = suggestion(key.split('.').next().unwrap_or_default(), &known);
        let what = format!("unknown setting `{key}`");
        return Err((what, format!("{remedy} (those of scenes with their key, as fit.loss)")));
    }
    if of_scene(key) {
        return Ok(());
    }
    let wrong = |kind: &str| Err((format!("{key} = {value}"), format!("Give {kind}")));
    match key {
        "command" => known("command", value, &Command::ALL.map(|(name, _)| name)),
        "solver" => known("solver", value, &SolverKind::ALL.map(SolverKind::name)),
        "axes" => {
            let names: Vec<&str> = axes::all().iter().map(|axis| axis.name()).collect();
            match value.as_array() {
                Some(list) => list.iter().try_for_each(|axis| known("axis", axis, &names)),
                None => wrong("a list of axes, as [\"rays\", \"samples\"]"),
            }
        }
        "scene" if value.as_str().is_none() => wrong("the path of a scene file, in quotes"),
        "params" if value.as_str().is_none() => wrong("the path of a fit's params.toml, in quotes"),
        "scene" | "params" => Ok(()),
        "pairs" | "refit" if value.as_bool().is_none() => wrong("true or false"),
        "pairs" | "refit" => Ok(()),
        "starts" | "max_iterations" | "pixels" if value.as_integer().is_none_or(|n| n < 1) => {
            wrong("a whole number from 1 on")
        }
        _ if value.as_integer().is_none_or(|n| n < 0 || u32::try_from(n).is_err()) => {
            wrong("a whole number from 0 on, of at most 32 bits")
        }
        _ => Ok(()),
    }
}

/// Whether the value is one of these names.
fn known(kind: &str, value: &Value, names: &[&str]) -> Result<(), (String, String)> {
    let name = value.as_str().unwrap_or_default();
    match names.contains(&name) {
        true => Ok(()),
        false => Err((format!("unknown {kind} {value}"), suggestion(name, names))),
    }
}

//! What a job is: its number, what it runs, its settings.

use toml::{Table, Value};

use super::command::Command;

/// A key with its value.
pub type Setting = (String, Value);

/// One job of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Its number, from 0.
    pub index: usize,
    /// What it runs.
    pub command: Command,
    /// Its settings in the plan's order: axes, then what is listed; what is the same for all comes last.
    pub settings: Vec<Setting>,
}

impl Job {
    /// A job with its own settings and what is said for all; what its command does not take of that is not for
    /// it.
    ///
    /// # Errors
    /// In words, when a setting of its own is none of its command's.
    pub(super) fn new(
        index: usize,
        command: Command,
        mut settings: Vec<Setting>,
        common: &[Setting],
    ) -> Result<Self, String> {
        let named = |settings: &[Setting]| {
            let (_, value) = settings.iter().find(|(key, _)| key == "command")?;
            Command::from_name(value.as_str()?)
        };
        let command = named(&settings).or_else(|| named(common)).unwrap_or(command);
        if let Some((key, _)) = settings.iter().find(|(key, _)| !command.takes(key)) {
            return Err(format!("job {index}: `{key}` is no setting of `{}`", command.name()));
        }
        // What a job says itself goes before what is said for all.
        let rest: Vec<Setting> = common
            .iter()
            .filter(|(key, _)| command.takes(key) && !settings.iter().any(|(own, _)| own == key))
            .cloned()
            .collect();
        settings.extend(rest);
        Ok(Self { index, command, settings })
    }

    /// The value of a setting.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&Value> {
        self.settings.iter().find(|(name, _)| name == key).map(|(_, value)| value)
    }

    /// A whole number among the settings.
    #[must_use]
    pub fn whole(&self, key: &str) -> Option<u64> {
        self.get(key).and_then(Value::as_integer).and_then(|value| u64::try_from(value).ok())
    }

    /// Whether a setting is there and true.
    #[must_use]
    pub fn is_set(&self, key: &str) -> bool {
        self.get(key).and_then(Value::as_bool).unwrap_or(false)
    }

    /// Its number, and a hash of what it computes from the texts of its scene and of its constants, if it is
    /// given some: `0003-1f2e3d4c`.
    #[must_use]
    pub fn identity(&self, scene: &str, constants: Option<&str>) -> String {
        let mut hash = blake3::Hasher::new();
        for part in [env!("CARGO_PKG_VERSION"), self.command.name(), scene].into_iter().chain(constants) {
            hash.update(part.as_bytes()).update(&[0]);
        }
        for (key, value) in &self.settings {
            hash.update(format!("{key}={value}").as_bytes()).update(&[0]);
        }
        format!("{:04}-{}", self.index, &hash.finalize().to_hex()[..8])
    }
}

/// Every combination of what is listed with the axes (a key and its values each), the last one fastest.
pub(super) fn combine(axes: &[(&str, &[Value])], lists: &[Vec<Setting>]) -> Vec<Vec<Setting>> {
    let mut all: Vec<Vec<Setting>> = lists.to_vec();
    for (key, values) in axes {
        let with = |settings: &Vec<Setting>| {
            let settings = settings.clone();
            let set = move |value: &Value| {
                settings.iter().cloned().chain([((*key).to_owned(), value.clone())]).collect()
            };
            values.iter().map(set).collect::<Vec<Vec<Setting>>>()
        };
        all = all.iter().flat_map(with).collect();
    }
    all
}

/// The settings of a table; tables within stand for dotted keys.
pub(super) fn flattened(table: &Table) -> Vec<Setting> {
    let mut settings = Vec::new();
    flatten("", table, &mut settings);
    settings
}

fn flatten(prefix: &str, table: &Table, into: &mut Vec<Setting>) {
    for (key, value) in table {
        let key = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            Value::Table(inner) => flatten(&key, inner, into),
            value => into.push((key, value.clone())),
        }
    }
}

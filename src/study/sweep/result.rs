//! The one file that a job leaves: its settings, its figures, or why it failed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::job::Job;
use super::plan::MOST;
use crate::output::{self, OutputError};

/// Numbers and words, by name.
pub type Figures = BTreeMap<String, Value>;

/// What a job found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// Of the job as a whole.
    pub figures: Figures,
    /// Of each of its cases, where it has several.
    pub rows: Vec<Figures>,
}

/// Whether a figure is a time: another one each time, so that it is collected on request alone.
#[must_use]
pub fn is_time(name: &str) -> bool {
    name == "seconds" || name.starts_with("seconds.")
}

/// A number; one that is not finite is null.
#[must_use]
pub fn number(x: f64) -> Value {
    Value::from(x)
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// It has figures.
    Done,
    /// It has none, for this reason.
    Failed(String),
}

/// The content of a result file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JobResult {
    /// The job's number.
    pub job: usize,
    /// Its identity.
    pub identity: String,
    /// What ran.
    pub command: String,
    /// How it ended.
    pub status: Status,
    /// Its settings.
    pub settings: BTreeMap<String, Value>,
    /// What it found.
    pub figures: Figures,
    /// What it found of each of its cases: the parts that were left out, the settings that were measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<Figures>,
    /// How long it took; no figure, as it is another one each time.
    pub seconds: f64,
}

impl JobResult {
    /// The result file of a job in the plan's folder of results.
    #[must_use]
    pub fn path(results: &Path, identity: &str) -> PathBuf {
        results.join(format!("job-{identity}.json"))
    }

    /// Read a result file; `None` when there is none, or it is damaged.
    #[must_use]
    pub fn read(path: &Path) -> Option<Self> {
        let result: Self = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
        // No plan has a job of a higher number; the gaps below one would be listed.
        (result.job < MOST).then_some(result)
    }

    /// Write it, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, results: &Path) -> Result<(), OutputError> {
        let path = Self::path(results, &self.identity);
        let text = serde_json::to_string_pretty(self).map_err(|error| OutputError::new(&path, &error))?;
        output::write(&path, (text + "\n").as_bytes())
    }

    /// Whether there is nothing left to do.
    #[must_use]
    pub fn done(&self) -> bool {
        self.status == Status::Done
    }
}

/// A job's settings as a result holds them.
#[must_use]
pub fn settings(job: &Job) -> BTreeMap<String, Value> {
    let value = |value: &toml::Value| serde_json::to_value(value).unwrap_or(Value::Null);
    job.settings.iter().map(|(key, setting)| (key.clone(), value(setting))).collect()
}

/// A constant's value and its standard error.
pub(super) fn add_constant(figures: &mut Figures, name: &str, value: f64, std_error: Option<f64>) {
    figures.insert(format!("value.{name}"), number(value));
    figures.insert(format!("error.{name}"), std_error.map_or(Value::Null, number));
}

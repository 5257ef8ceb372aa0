//! Every job's figures in one table, whatever order they came in.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use super::result::{Figures, JobResult, Status, is_time, number};
use crate::scene::error::SceneError;

/// The results that there are, and what is missing.
#[derive(Clone, Debug, Default)]
pub struct Collection {
    /// Finished jobs, by number.
    pub done: BTreeMap<usize, JobResult>,
    /// Jobs that failed, by number, with the reason.
    pub failed: BTreeMap<usize, String>,
    /// Jobs without a result, by number.
    pub missing: BTreeSet<usize>,
}

impl Collection {
    /// The results of jobs of these identities, in their order.
    #[must_use]
    pub fn of(results: &Path, identities: &[String]) -> Self {
        let mut collection = Self::default();
        for (index, identity) in identities.iter().enumerate() {
            match JobResult::read(&JobResult::path(results, identity)) {
                Some(result) if result.identity == *identity => collection.add(result),
                _ => {
                    collection.missing.insert(index);
                }
            }
        }
        collection
    }

    /// Every result file of a folder. Gaps in their numbers are missing; what comes after the last is not
    /// known here.
    ///
    /// # Errors
    /// When the folder cannot be read, holds no result, or two of one number, as after a change of the plan.
    pub fn of_folder(folder: &Path) -> Result<Self, SceneError> {
        let refuse = |what: String, remedy: &str| SceneError::new(folder, what, remedy);
        let entries = std::fs::read_dir(folder)
            .map_err(|e| refuse(format!("cannot be read: {e}"), "Name a plan, or its folder of results"))?;
        let named = |path: &Path| {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            name.starts_with("job-") && name.ends_with(".json")
        };
        let mut paths: Vec<_> = entries.flatten().map(|e| e.path()).filter(|p| named(p)).collect();
        paths.sort();
        let mut collection = Self::default();
        let mut seen = BTreeSet::new();
        for path in paths {
            let Some(result) = JobResult::read(&path) else {
                return Err(SceneError::new(&path, "is damaged", "Remove it and run its job again"));
            };
            if !seen.insert(result.job) {
                let what = format!("holds two results of job {}", result.job);
                return Err(refuse(what, "Name the plan instead: it knows which is its own"));
            }
            collection.add(result);
        }
        let Some(&last) = seen.last() else {
            return Err(refuse("holds no results".to_owned(), "Run the plan's jobs first"));
        };
        collection.missing = (0..last).filter(|index| !seen.contains(index)).collect();
        Ok(collection)
    }

    fn add(&mut self, result: JobResult) {
        match &result.status {
            Status::Done => {
                self.done.insert(result.job, result);
            }
            Status::Failed(reason) => {
                self.failed.insert(result.job, reason.clone());
            }
        }
    }

    /// Whether every job is there.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.missing.is_empty() && self.failed.is_empty()
    }

    /// The same without times, which are others each time.
    #[must_use]
    pub fn without_times(mut self) -> Self {
        for result in self.done.values_mut() {
            result.figures.retain(|name, _| !is_time(name));
            result.rows.iter_mut().for_each(|row| row.retain(|name, _| !is_time(name)));
        }
        self
    }

    /// The same with the seconds that each job took among its figures.
    #[must_use]
    pub fn with_times(mut self) -> Self {
        for result in self.done.values_mut() {
            result.figures.insert("seconds.job".to_owned(), number(result.seconds));
        }
        self
    }

    /// A row a finished job, or a case of it: its number, settings and figures. What a row has not is empty.
    #[must_use]
    pub fn csv(&self) -> String {
        let settings: BTreeSet<&String> = self.done.values().flat_map(|job| job.settings.keys()).collect();
        let figures: BTreeSet<&String> = self
            .done
            .values()
            .flat_map(|job| job.figures.keys().chain(job.rows.iter().flatten().map(|f| f.0)))
            .collect();
        // What a row is of stands before its figures.
        let (mut labels, figures): (Vec<_>, Vec<_>) =
            figures.into_iter().partition(|name| LABELS.contains(&name.as_str()));
        labels.sort_by_key(|name| LABELS.iter().position(|label| label == name));
        let mut text = "job".to_owned();
        for key in settings.iter().chain(&labels).chain(&figures) {
            let _ = write!(text, ",{}", cell(key));
        }
        text.push('\n');
        for (index, job) in &self.done {
            let none = [Figures::new()];
            for row in if job.rows.is_empty() { &none[..] } else { &job.rows } {
                let _ = write!(text, "{index}");
                let columns = settings.iter().map(|key| job.settings.get(*key));
                let found =
                    labels.iter().chain(&figures).map(|key| row.get(*key).or_else(|| job.figures.get(*key)));
                for value in columns.chain(found) {
                    let _ = write!(text, ",{}", value.map_or_else(String::new, word));
                }
                text.push('\n');
            }
        }
        text
    }

    /// The same as JSON, with what failed and what is missing.
    ///
    /// # Errors
    /// Never: the structures are plain.
    pub fn json(&self) -> serde_json::Result<String> {
        let job = |result: &JobResult| {
            json!({
                "job": result.job,
                "identity": result.identity,
                "command": result.command,
                "settings": result.settings,
                "figures": result.figures,
                "rows": result.rows,
            })
        };
        let failed = |(job, reason): (&usize, &String)| json!({"job": job, "reason": reason});
        let all = json!({
            "jobs": self.done.values().map(job).collect::<Vec<_>>(),
            "failed": self.failed.iter().map(failed).collect::<Vec<_>>(),
            "missing": self.missing,
        });
        serde_json::to_string_pretty(&all).map(|text| text + "\n")
    }
}

/// Figures that say what a row is of.
const LABELS: [&str; 3] = ["left_out", "axis", "setting"];

/// A value as a cell.
fn word(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => cell(text),
        other => cell(&other.to_string()),
    }
}

/// Quoted where CSV asks for it (RFC 4180).
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(job: usize, status: Status) -> JobResult {
        JobResult {
            job,
            identity: format!("{job:04}-0"),
            command: "fit".to_owned(),
            status,
            settings: BTreeMap::from([("effects".to_owned(), json!(["rim", "diffuse"]))]),
            figures: BTreeMap::from([("loss".to_owned(), json!(0.5)), ("error".to_owned(), Value::Null)]),
            rows: Vec::new(),
            seconds: job as f64,
        }
    }

    #[test]
    fn the_order_in_which_results_came_changes_nothing() {
        let collect = |order: [usize; 3]| {
            let folder = tempfile::tempdir().unwrap();
            for job in order {
                result(job, Status::Done).write(folder.path()).unwrap();
            }
            let collection = Collection::of_folder(folder.path()).unwrap();
            assert!(collection.complete());
            (collection.csv(), collection.json().unwrap())
        };
        assert_eq!(collect([0, 1, 2]), collect([2, 0, 1]));
        let (csv, _) = collect([1, 0, 2]);
        assert_eq!(csv.lines().nth(2), Some("1,\"[\"\"rim\"\",\"\"diffuse\"\"]\",,0.5"));
    }

    #[test]
    fn jobs_of_different_kinds_share_a_table_and_times_are_there_on_request() {
        let mut ablation = result(1, Status::Done);
        ablation.figures = BTreeMap::from([("reference".to_owned(), json!("targets"))]);
        let row = |name: &str, loss: f64| {
            Figures::from([
                ("left_out".to_owned(), json!(name)),
                ("loss".to_owned(), json!(loss)),
                ("seconds.pass".to_owned(), json!(0.25)),
            ])
        };
        ablation.rows = vec![row("nothing", 0.5), row("rim", 0.75)];
        let done = BTreeMap::from([(0, result(0, Status::Done)), (1, ablation)]);
        let collection = Collection { done, ..Collection::default() };
        let effects = "\"[\"\"rim\"\",\"\"diffuse\"\"]\"";
        let wanted = format!(
            "job,effects,left_out,error,loss,reference\n0,{effects},,,0.5,\n1,{effects},nothing,,0.5,targets\n\
             1,{effects},rim,,0.75,targets\n"
        );
        assert_eq!(collection.clone().without_times().csv(), wanted);
        let timed = collection.with_times().csv();
        assert!(
            timed.starts_with("job,effects,left_out,error,loss,reference,seconds.job,seconds.pass\n"),
            "{timed}"
        );
        assert!(timed.ends_with(",rim,,0.75,targets,1.0,0.25\n"), "{timed}");
    }

    #[test]
    fn what_is_missing_failed_or_damaged_is_named() {
        let folder = tempfile::tempdir().unwrap();
        result(0, Status::Done).write(folder.path()).unwrap();
        result(2, Status::Failed("no light".to_owned())).write(folder.path()).unwrap();
        std::fs::write(folder.path().join("job-0003-0.json"), "{").unwrap();
        let identities: Vec<String> = (0..4).map(|job| format!("{job:04}-0")).collect();
        let collection = Collection::of(folder.path(), &identities);
        assert!(!collection.complete());
        assert_eq!(collection.missing, BTreeSet::from([1, 3]));
        assert_eq!(collection.failed[&2], "no light");
        let told = Collection::of_folder(folder.path()).unwrap_err().to_string();
        assert!(told.contains("job-0003-0.json: is damaged"), "{told}");
        std::fs::remove_file(folder.path().join("job-0003-0.json")).unwrap();
        assert_eq!(Collection::of_folder(folder.path()).unwrap().missing, BTreeSet::from([1]));
    }
}

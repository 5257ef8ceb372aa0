//! The plan file: what each job runs, and with which settings.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::{Spanned, Table, Value};

use super::command::{Command, check_setting};
use super::scene_text::with_key;
use crate::scene::error::SceneError;
use crate::scene::{Source, check_text};

/// Most jobs of a plan.
const MOST: usize = 1_000_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    command: Spanned<String>,
    scene: Option<PathBuf>,
    results: Option<PathBuf>,
    settings: Option<Spanned<Table>>,
    #[serde(default)]
    axis: Vec<AxisTable>,
    #[serde(default)]
    job: Vec<Spanned<Table>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisTable {
    key: Spanned<String>,
    values: Spanned<Vec<Value>>,
}

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

/// A plan that was read and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The plan file.
    pub path: PathBuf,
    /// Where results go.
    pub results: PathBuf,
    /// The scene of jobs that name none; `None`: the built-in one.
    scene: Option<PathBuf>,
    /// The jobs, the last axis running fastest.
    pub jobs: Vec<Job>,
}

impl Plan {
    /// Read a plan. Paths in it are relative to it.
    ///
    /// # Errors
    /// When it cannot be read, or a key or value in it makes no sense.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let source = Source::read(path)?;
        let file: File = source.parse()?;
        let command = source.choose("command", &file.command, &Command::ALL)?;
        let commands = file.commands(command);
        let folder = path.parent().unwrap_or(Path::new(""));
        let results = file.results.unwrap_or_else(|| {
            let mut name = path.file_stem().unwrap_or_default().to_owned();
            name.push("-results");
            PathBuf::from(name)
        });
        let mut common = Vec::new();
        if let Some(settings) = &file.settings {
            common = checked(&source, &commands, settings)?;
        }
        let mut lists = Vec::new();
        for job in &file.job {
            lists.push(checked(&source, &commands, job)?);
        }
        if lists.is_empty() {
            lists.push(Vec::new());
        }
        for axis in &file.axis {
            if axis.values.get_ref().is_empty() {
                return Err(source.error(&axis.values, "an axis without values", "Give it at least one"));
            }
            for value in axis.values.get_ref() {
                check_setting(&commands, axis.key.get_ref(), value)
                    .map_err(|(what, remedy)| source.error(&axis.key, what, remedy))?;
            }
        }
        let count =
            file.axis.iter().try_fold(lists.len(), |n, axis| n.checked_mul(axis.values.get_ref().len()));
        if count.is_none_or(|count| count > MOST) {
            let what = format!("more than {MOST} jobs");
            return Err(SceneError::new(path, what, "Give the axes fewer values, or make several plans"));
        }
        let jobs = combine(&file.axis, &lists)
            .into_iter()
            .enumerate()
            .map(|(index, own)| Job::new(index, command, own, &common))
            .collect::<Result<_, _>>()
            .map_err(|what| SceneError::new(path, what, "Move it to the jobs that it is meant for"))?;
        Ok(Self {
            path: path.to_owned(),
            results: folder.join(results),
            scene: file.scene.map(|scene| folder.join(scene)),
            jobs,
        })
    }

    /// The scene file of a job; `None` for the built-in scene.
    #[must_use]
    pub fn scene(&self, job: &Job) -> Option<PathBuf> {
        self.file(job, "scene").or_else(|| self.scene.clone())
    }

    /// The constants of a job, where it takes them from a fit.
    #[must_use]
    pub fn constants(&self, job: &Job) -> Option<PathBuf> {
        self.file(job, "params")
    }

    fn file(&self, job: &Job, key: &str) -> Option<PathBuf> {
        let path = job.get(key).and_then(Value::as_str)?;
        Some(self.path.parent().unwrap_or(Path::new("")).join(path))
    }

    /// The text of a job's scene file, from that of the scene that it names: the scene's keys among its
    /// settings are set, paths in it are as they were.
    ///
    /// # Errors
    /// When a key is not one of a scene's, or its value is not of the kind that it takes.
    pub fn scene_text(&self, job: &Job, scene: &Path, text: &str) -> Result<String, SceneError> {
        let mut text = text.to_owned();
        for (key, value) in job.settings.iter().rev() {
            if job.command.options().contains(&key.as_str()) {
                continue;
            }
            let refuse = |what: String| {
                let what = format!("job {}: {key} = {value}: {what}", job.index);
                SceneError::new(
                    &self.path,
                    what,
                    "Correct the key or its value, or the scene that it is set in",
                )
            };
            text = with_key(&text, key, value).map_err(refuse)?;
            check_text(scene, &text).map_err(|error| refuse(error.what()))?;
        }
        Ok(text)
    }

    /// The job of that number, or of that identity's number.
    ///
    /// # Errors
    /// When there is none.
    pub fn job(&self, name: &str) -> Result<&Job, SceneError> {
        let number = name.split('-').next().unwrap_or_default();
        number.parse().ok().and_then(|index: usize| self.jobs.get(index)).ok_or_else(|| {
            let what = format!("there is no job `{name}`");
            let last = self.jobs.len() - 1;
            SceneError::new(&self.path, what, format!("Its jobs are 0 to {last}; --list shows them"))
        })
    }
}

impl File {
    /// What jobs may run: the plan's command, and those that axes and jobs name.
    fn commands(&self, own: Command) -> Vec<Command> {
        let axes = self.axis.iter().filter(|axis| axis.key.get_ref() == "command");
        let named = axes.flat_map(|axis| axis.values.get_ref());
        let named = named.chain(self.job.iter().filter_map(|job| job.get_ref().get("command")));
        let named = named.filter_map(|value| Command::from_name(value.as_str()?));
        std::iter::once(own).chain(named).collect()
    }
}

impl Job {
    /// A job with its own settings and what is said for all; what its command does not take of that is not for
    /// it.
    ///
    /// # Errors
    /// In words, when a setting of its own is none of its command's.
    fn new(
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

/// Every combination of what is listed with the axes, the last one fastest.
fn combine(axes: &[AxisTable], lists: &[Vec<Setting>]) -> Vec<Vec<Setting>> {
    let mut all: Vec<Vec<Setting>> = lists.to_vec();
    for axis in axes {
        let with = |settings: &Vec<Setting>| {
            let settings = settings.clone();
            let set = move |value: &Value| {
                settings.iter().cloned().chain([(axis.key.get_ref().clone(), value.clone())]).collect()
            };
            axis.values.get_ref().iter().map(set).collect::<Vec<Vec<Setting>>>()
        };
        all = all.iter().flat_map(with).collect();
    }
    all
}

/// The settings of a table, each checked; tables within stand for dotted keys.
fn checked(
    source: &Source,
    commands: &[Command],
    table: &Spanned<Table>,
) -> Result<Vec<Setting>, SceneError> {
    let mut settings = Vec::new();
    flatten("", table.get_ref(), &mut settings);
    for (key, value) in &settings {
        check_setting(commands, key, value).map_err(|(what, remedy)| source.error(table, what, remedy))?;
    }
    Ok(settings)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Plan, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plan.toml");
        std::fs::write(&path, text).unwrap();
        let name =
            |error: SceneError| error.to_string().replace(&format!("{}/", folder.path().display()), "");
        Plan::read(&path).map_err(name)
    }

    const PLAN: &str = "command = \"fit\"\nscene = \"a.toml\"\n[settings]\nsolver = \"lm\"\nfit.loss = \"l2\"\n\
        [[axis]]\nkey = \"seed\"\nvalues = [1, 2]\n[[axis]]\nkey = \"model.params.hilite\"\nvalues = [0.5, 1.0, 2.0]\n";

    #[test]
    fn axes_are_combined_with_the_last_one_fastest() {
        let plan = read(PLAN).unwrap();
        assert_eq!(plan.jobs.len(), 6);
        let values: Vec<_> =
            plan.jobs.iter().map(|j| (j.whole("seed"), j.get("model.params.hilite").cloned())).collect();
        assert_eq!(values[1], (Some(1), Some(Value::Float(1.0))));
        assert_eq!(values[3], (Some(2), Some(Value::Float(0.5))));
        assert!(plan.jobs.iter().all(|job| job.get("solver").unwrap().as_str() == Some("lm")));
        assert!(plan.results.ends_with("plan-results"));
        assert!(plan.job("5").is_ok() && plan.job("0005-abcdef01").is_ok());
        assert!(plan.job("6").unwrap_err().to_string().contains("Its jobs are 0 to 5"));
    }

    #[test]
    fn listed_jobs_multiply_with_axes_and_say_what_settings_say_for_all() {
        let list = "[[job]]\nsolver = \"varpro\"\n[[job]]\nquality.lobe_size = 8\n";
        let plan = read(&format!("{PLAN}{list}")).unwrap();
        assert_eq!(plan.jobs.len(), 12);
        assert_eq!(plan.jobs[0].get("solver").unwrap().as_str(), Some("varpro"));
        assert_eq!(plan.jobs[6].get("solver").unwrap().as_str(), Some("lm"));
        assert_eq!(plan.jobs[6].whole("quality.lobe_size"), Some(8));
    }

    #[test]
    fn an_identity_is_of_settings_scene_and_constants() {
        let plan = read(PLAN).unwrap();
        let identity = |index: usize, text: &str| plan.jobs[index].identity(text, None);
        assert_eq!(identity(1, "a"), identity(1, "a"));
        assert_ne!(identity(1, "a"), identity(1, "b"));
        assert_ne!(identity(1, "a")[4..], identity(2, "a")[4..]);
        assert_ne!(identity(1, "a"), plan.jobs[1].identity("a", Some("")));
    }

    #[test]
    fn jobs_of_several_commands_get_the_settings_that_are_theirs() {
        let text = "command = \"ablate\"\n[settings]\nrefit = true\nseed = 3\n[[job]]\n[[job]]\ncommand = \"fit\"\n\
            [[job]]\ncommand = \"tradeoff\"\naxes = [\"rays\"]\n";
        let plan = read(text).unwrap();
        let jobs: Vec<_> =
            plan.jobs.iter().map(|j| (j.command, j.is_set("refit"), j.whole("seed"))).collect();
        let wanted =
            [(Command::Ablate, true, None), (Command::Fit, false, Some(3)), (Command::Tradeoff, false, None)];
        assert_eq!(jobs, wanted);
        let told = read(&text.replacen("axes", "cases", 1)).unwrap_err();
        assert!(told.contains("unknown setting `cases`"), "{told}");
        let told = read(&text.replacen("\"fit\"\n", "\"fit\"\npairs = true\n", 1)).unwrap_err();
        let words = "job 1: `pairs` is no setting of `fit`. Move it to the jobs that it is meant for";
        assert!(told.contains(words), "{told}");
        let told = read(&text.replacen("rays", "rayz", 1)).unwrap_err();
        assert!(told.contains("unknown axis \"rayz\". Did you mean `rays`?"), "{told}");
        let told = read(&text.replacen("\"fit\"", "\"fitt\"", 1)).unwrap_err();
        assert!(told.contains("unknown command \"fitt\". Did you mean `fit`?"), "{told}");
    }

    #[test]
    fn mistakes_are_told_with_their_place_and_what_to_do() {
        for (from, to, words) in [
            (
                "command = \"fit\"",
                "command = \"fot\"",
                "plan.toml: line 1: unknown command `fot`. Did you mean `fit`?",
            ),
            ("scene =", "scenes =", "line 2: unknown key `scenes`. Did you mean `scene`?"),
            ("\"seed\"", "\"sed\"", "line 7: unknown setting `sed`. Did you mean `seed`?"),
            ("[1, 2]", "[1, -2]", "line 7: seed = -2. Give a whole number from 0 on"),
            ("[1, 2]", "[]", "line 8: an axis without values. Give it at least one"),
            ("\"lm\"", "\"ml\"", "unknown solver \"ml\". Did you mean `lm`?"),
            ("values = [1", "valeus = [1", "unknown key `valeus`. Did you mean `values`?"),
        ] {
            let told = read(&PLAN.replacen(from, to, 1)).unwrap_err();
            assert!(told.contains(words), "{told}");
        }
    }

    #[test]
    fn scene_keys_are_checked_against_the_scene() {
        let plan = read(&PLAN.replace("model.params.hilite", "fit.losss")).unwrap();
        let scene = "[mesh]\nfile = \"a.glb\"\n";
        let told = plan.scene_text(&plan.jobs[0], Path::new("a.toml"), scene).unwrap_err().to_string();
        assert!(told.contains("fit.losss = 0.5: unknown key `losss`"), "{told}");
        let plan = read(PLAN).unwrap();
        let text = plan.scene_text(&plan.jobs[4], Path::new("a.toml"), scene).unwrap();
        assert!(text.contains("hilite = 1.0") && text.contains("loss = \"l2\""), "{text}");
    }
}

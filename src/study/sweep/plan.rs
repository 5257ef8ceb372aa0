//! The plan file: what each job runs, and with which settings.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::{Spanned, Table, Value};

use super::command::{Command, check_setting};
use super::job::{Job, Setting, combine, flattened};
use super::scene_text::with_key;
use crate::scene::error::SceneError;
use crate::scene::{Source, check_text, check_values};

/// Most jobs of a plan.
pub(super) const MOST: usize = 1_000_000;

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
        let mut lists = Vec::new();
        for job in &file.job {
            lists.push(checked(&source, &commands, job)?);
        }
        if lists.is_empty() {
            lists.push(Vec::new());
        }
        for (i, axis) in file.axis.iter().enumerate() {
            let key = axis.key.get_ref();
            let before = file.axis[..i].iter().any(|other| other.key.get_ref() == key);
            if before || lists.iter().flatten().any(|(listed, _)| listed == key) {
                let what = format!("`{key}` is set by another axis or job, too");
                return Err(source.error(&axis.key, what, "Put all of its values into one axis"));
            }
            if axis.values.get_ref().is_empty() {
                return Err(source.error(&axis.values, "an axis without values", "Give it at least one"));
            }
            for value in axis.values.get_ref() {
                check_setting(&commands, axis.key.get_ref(), value)
                    .map_err(|(what, remedy)| source.error(&axis.key, what, remedy))?;
            }
        }
        let mut common = Vec::new();
        if let Some(settings) = &file.settings {
            common = checked(&source, &commands, settings)?;
        }
        let count =
            file.axis.iter().try_fold(lists.len(), |n, axis| n.checked_mul(axis.values.get_ref().len()));
        if count.is_none_or(|count| count > MOST) {
            let what = format!("more than {MOST} jobs");
            return Err(SceneError::new(path, what, "Give the axes fewer values, or make several plans"));
        }
        let axes: Vec<(&str, &[Value])> =
            file.axis.iter().map(|axis| (axis.key.get_ref().as_str(), &axis.values.get_ref()[..])).collect();
        let jobs = combine(&axes, &lists)
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
    /// When a key is not one of a scene's, or a value is none that a scene takes.
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
        // All at once: one setting may need another.
        check_values(scene, &text).map_err(|error| {
            let what = format!("job {}: {}", job.index, error.what());
            SceneError::new(&self.path, what, "Correct the plan's values for it, or the scene's own")
        })?;
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
            SceneError::new(&self.path, what, format!("Its jobs are 0 to {last}"))
        })
    }
}

impl File {
    /// What jobs may run: the plan's command, and those that axes and jobs name.
    fn commands(&self, own: Command) -> Vec<Command> {
        let axes = self.axis.iter().filter(|axis| axis.key.get_ref() == "command");
        let named = axes.flat_map(|axis| axis.values.get_ref());
        let tables = self.job.iter().chain(&self.settings);
        let named = named.chain(tables.filter_map(|table| table.get_ref().get("command")));
        let named = named.filter_map(|value| Command::from_name(value.as_str()?));
        std::iter::once(own).chain(named).collect()
    }
}

/// The settings of a table, each checked; tables within stand for dotted keys.
fn checked(
    source: &Source,
    commands: &[Command],
    table: &Spanned<Table>,
) -> Result<Vec<Setting>, SceneError> {
    let settings = flattened(table.get_ref());
    for (key, value) in &settings {
        check_setting(commands, key, value).map_err(|(what, remedy)| source.error(table, what, remedy))?;
    }
    Ok(settings)
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

    const SCENE: &str = "[mesh]\nfile = \"a.glb\"\n[[view]]\nname = \"front\"\nfov_y_degrees = 35.0\nwidth = 4\nheight = 4\n\
        world_to_camera = [1,0,0,0, 0,1,0,0, 0,0,1,-4, 0,0,0,1]\n";

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
            (
                "\"model.params.hilite\"",
                "\"seed\"",
                "line 10: `seed` is set by another axis or job, too. Put all of its values into one axis",
            ),
            ("values = [1", "valeus = [1", "unknown key `valeus`. Did you mean `values`?"),
        ] {
            let told = read(&PLAN.replacen(from, to, 1)).unwrap_err();
            assert!(told.contains(words), "{told}");
        }
    }

    #[test]
    fn values_of_scenes_are_checked_before_any_job_runs() {
        let told = |key: &str, value: &str| {
            let text = format!("command = \"fit\"\n[[axis]]\nkey = \"{key}\"\nvalues = [{value}]\n");
            let plan = read(&text).unwrap();
            plan.scene_text(&plan.jobs[0], Path::new("a.toml"), SCENE).map_err(|error| error.to_string())
        };
        for (key, value, words) in [
            ("fit.loss", "\"l3\"", "job 0: unknown loss `l3`. Did you mean `l2`?"),
            ("model.form", "\"listin\"", "unknown form `listin`"),
            ("model.silhouette", "\"vertx\"", "unknown silhouette `vertx`"),
            ("model.effects", "[\"rimm\"]", "unknown effect `rimm`"),
            ("model.params.hilite", "-1.0", "hilite = -1 is out of bounds"),
            ("fit.free", "[\"hilit\"]", "unknown parameter `hilit`"),
            ("quality.lobe_size", "0", "lobe_size = 0 is out of bounds"),
            ("maps.normal_y", "\"left\"", "unknown direction `left`"),
            (
                "mesh.time",
                "1e300",
                "time = 1e300 is out of bounds. Give seconds in [-1000000000, 1000000000]",
            ),
            (
                "mesh.morph_weights",
                "[1e300]",
                "morph_weights holds 1e300. Give weights in [-1000000, 1000000]",
            ),
        ] {
            let told = told(key, value).unwrap_err();
            assert!(told.contains(words), "{told}");
        }
        assert!(told("fit.loss", "\"huber\"").is_ok());
    }

    #[test]
    fn scene_keys_are_checked_against_the_scene() {
        let plan = read(&PLAN.replace("model.params.hilite", "fit.losss")).unwrap();
        let told = plan.scene_text(&plan.jobs[0], Path::new("a.toml"), SCENE).unwrap_err().to_string();
        assert!(told.contains("fit.losss = 0.5: unknown key `losss`"), "{told}");
        let plan = read(PLAN).unwrap();
        let text = plan.scene_text(&plan.jobs[4], Path::new("a.toml"), SCENE).unwrap();
        assert!(text.contains("hilite = 1.0") && text.contains("loss = \"l2\""), "{text}");
    }
}

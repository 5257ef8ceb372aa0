//! Where figures are made: the programs that are run, what they answered, and what is written down of the machine.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};
use toml_edit::{DocumentMut, Item};

/// What a step gave, or why it failed, in words.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// What is fitted: its row's name, and settings of the scene file.
pub(crate) type Choice = (&'static str, &'static [(&'static str, &'static str)]);

/// The programs, the data and a folder to work in.
pub(crate) struct Lab {
    /// The project's folder.
    pub(crate) root: PathBuf,
    /// The scanned head and its scenes.
    pub(crate) data: PathBuf,
    /// Removed at the end.
    pub(crate) scratch: tempfile::TempDir,
    /// The program, built for release.
    skinfit: PathBuf,
    /// The tests' program, where it is built already.
    pub(crate) suite: Option<PathBuf>,
    /// A copy of what runs the race of other frameworks, with its data and its rows.
    pub(crate) race: Option<PathBuf>,
    /// The program of the last commit with a single package, where it is built already.
    pub(crate) before: Option<PathBuf>,
    /// That program with `experiments/unchanged/as_today.patch`, where it is built already.
    pub(crate) patched: Option<PathBuf>,
    /// A Python that has numpy and embreex.
    pub(crate) python: Option<PathBuf>,
}

impl Lab {
    /// A lab that measures `skinfit`.
    ///
    /// # Errors
    /// Where there is no program, or no place to work in.
    pub(crate) fn new(root: &Path, data: &Path, skinfit: &Path) -> Result<Self> {
        let here = |path: &Path, what: &str| {
            let why = format!("{} is not there: {what}", path.display());
            std::path::absolute(path).ok().filter(|path| path.exists()).ok_or(why)
        };
        Ok(Self {
            root: here(root, "run this in the project's folder")?,
            data: here(data, "name the folder of the scanned head by --data")?,
            skinfit: here(skinfit, "build it by `cargo build --release`, or name it by --skinfit")?,
            scratch: tempfile::tempdir()?,
            suite: None,
            race: None,
            before: None,
            patched: None,
            python: None,
        })
    }

    /// The program that is measured.
    pub(crate) fn program(&self) -> &Path {
        &self.skinfit
    }

    /// What `skinfit` prints, run with `arguments`.
    ///
    /// # Errors
    /// When it ends with another exit code than 0; `1` is let pass where `may_fail`.
    pub(crate) fn skinfit(&self, what: &str, arguments: &[&str], may_fail: bool) -> Result<String> {
        let mut command = Command::new(&self.skinfit);
        command.args(arguments);
        self.run(what, command, may_fail)
    }

    /// What one of the examples prints.
    ///
    /// # Errors
    /// When it was not built, or fails.
    pub(crate) fn example(&self, name: &str, what: &str, arguments: &[&str]) -> Result<String> {
        let path = std::env::current_exe()?.with_file_name(name);
        if !path.exists() {
            return Err(format!(
                "{} is not there: build it by `cargo build --release --example {name}`",
                path.display()
            )
            .into());
        }
        let mut command = Command::new(path);
        command.args(arguments);
        self.run(what, command, false)
    }

    /// What `command` prints on standard output, with a line of progress.
    ///
    /// # Errors
    /// With the end of what it said, when it fails.
    pub(crate) fn run(&self, what: &str, mut command: Command, may_fail: bool) -> Result<String> {
        let start = Instant::now();
        let run = command.current_dir(&self.root).output().map_err(|e| format!("{command:?}: {e}"))?;
        eprintln!("figures: {what}, {:.1} s", start.elapsed().as_secs_f64());
        if run.status.success() || (may_fail && run.status.code() == Some(1)) {
            return Ok(String::from_utf8(run.stdout)?);
        }
        let said = String::from_utf8_lossy(&run.stderr);
        let end: Vec<&str> = said.lines().rev().take(12).collect();
        Err(format!("{command:?}: {}\n{}", run.status, end.into_iter().rev().collect::<Vec<_>>().join("\n"))
            .into())
    }

    /// The report of a fit of `scene`, and the folder that it left.
    ///
    /// # Errors
    /// When the fit is refused.
    pub(crate) fn fit(&self, what: &str, scene: Option<&Path>, options: &[&str]) -> Result<(Value, PathBuf)> {
        let folder = self.scratch.path().join(plain(what));
        let run = folder.display().to_string();
        let scene = scene.map(|scene| scene.display().to_string());
        let mut arguments = vec!["fit", "--engine", "cpu", "--json", "-o", &run];
        arguments.extend(scene.as_deref());
        arguments.extend(options);
        // A solver that runs out of iterations has a report too.
        let text = self.skinfit(what, &arguments, true)?;
        let report = serde_json::from_str(&text).map_err(|e| format!("{what}: {e}: {text}"))?;
        Ok((report, folder))
    }

    /// A scene file of the scanned head.
    pub(crate) fn head_scene(&self, scene: &str, file: &str) -> PathBuf {
        self.data.join(format!("lps_{scene}/{file}"))
    }

    /// A row for each choice: its name, and of each scene of the scanned head what `fitted` takes of its fit's report.
    pub(crate) fn choices(
        &self,
        choices: &[Choice],
        scenes: &[&str],
        file: &str,
        fitted: fn(&Value) -> Value,
    ) -> Result<Vec<Value>> {
        let mut rows = Vec::new();
        for &(name, settings) in choices {
            let mut row = Map::new();
            row.insert("name".to_owned(), name.into());
            for &scene in scenes {
                let what = format!("{scene}, {name}");
                let changed = self.scene(&what, &self.head_scene(scene, file), settings)?;
                row.insert(scene.to_owned(), fitted(&self.fit(&what, Some(&changed), &[])?.0));
            }
            rows.push(Value::Object(row));
        }
        Ok(rows)
    }

    /// A copy of a scene file with other `settings`: key by key, and the value as TOML.
    ///
    /// # Errors
    /// When it cannot be read or is no scene file.
    pub(crate) fn scene(&self, what: &str, scene: &Path, settings: &[(&str, &str)]) -> Result<PathBuf> {
        let mut document: DocumentMut = std::fs::read_to_string(scene)?.parse()?;
        let folder = std::path::absolute(scene)?.parent().map(Path::to_owned).unwrap_or_default();
        for key in ["mesh", "maps", "environment"] {
            document.get_mut(key).map_or(Ok(()), |table| from(&folder, table))?;
        }
        for view in document["view"].as_array_of_tables_mut().into_iter().flat_map(|views| views.iter_mut()) {
            for key in ["target", "mask"] {
                view.get_mut(key).map_or(Ok(()), |file| placed(&folder, file))?;
            }
        }
        for (key, value) in settings {
            let value: toml_edit::Value = value.parse()?;
            let mut item = document.as_item_mut();
            for key in key.split('.') {
                item = match key.parse::<usize>() {
                    Ok(index) => &mut item[index],
                    Err(_) => &mut item[key],
                };
            }
            *item = Item::Value(value);
        }
        let path = self.scratch.path().join(format!("{}.toml", plain(what)));
        std::fs::write(&path, document.to_string())?;
        Ok(path)
    }

    /// The head of a raw file that `figures NAME` writes.
    ///
    /// # Errors
    /// When git or skinfit do not answer.
    pub(crate) fn head(&self, name: &str) -> Result<Map<String, Value>> {
        let git = |arguments: &[&str]| -> Result<String> {
            let run = Command::new("git").current_dir(&self.root).args(arguments).output()?;
            Ok(String::from_utf8(run.stdout)?.trim().to_owned())
        };
        let mut commit = git(&["rev-parse", "--short", "HEAD"])?;
        // Raw files and pages change as they are written; what measures and is measured is everything else.
        let sources = ["src", "experiments", "Cargo.lock", ":!*.json", ":!*.md", ":!*.svg"];
        if !git(&[&["status", "--porcelain", "--"], &sources[..]].concat())?.is_empty() {
            let _ = write!(commit, " with changes");
        }
        let run = Command::new("date").args(["-u", "+%Y-%m-%d"]).output()?;
        let info: Value = serde_json::from_str(&self.skinfit("the machine", &["info", "--json"], false)?)?;
        // Only with them the network's example is built, and there is a window.
        let features = match name {
            _ if name.starts_with("experiments/network/") => "--features burn ",
            _ if name.starts_with("docs/window") => "--features view ",
            _ => "",
        };
        let head = json!({
            "command": format!("cargo run --release {features}--example figures -- {name}"),
            "commit": commit,
            "date": String::from_utf8(run.stdout)?.trim(),
            "machine": {
                "processor": info["cpu"]["processor"],
                "cores": info["cpu"]["threads"],
                "instructions": info["cpu"]["instructions"],
                "adapter": info["adapters"][0]["name"],
                // How many threads of others wanted to run when the measurement began.
                "load": others(),
            },
        });
        head.as_object().cloned().ok_or_else(|| "a head is an object".into())
    }
}

/// How many threads of others run or want to, the mean of a second; `None` where no file tells. The usual averages
/// would tell of what was measured before.
fn others() -> Option<f64> {
    let looks = 20;
    let mut sum = 0.0;
    for _ in 0..looks {
        std::thread::sleep(Duration::from_millis(50));
        // `0.52 0.48 0.40 2/512 4711`: two run, and one of them asks.
        let line = std::fs::read_to_string("/proc/loadavg").ok()?;
        sum += line.split([' ', '/']).nth(3)?.parse::<f64>().ok()? - 1.0;
    }
    Some(sum / f64::from(looks))
}

/// Files of a table from `folder`, wherever the scene file lies.
fn from(folder: &Path, table: &mut Item) -> Result<()> {
    for (_, value) in table.as_table_like_mut().into_iter().flat_map(|table| table.iter_mut()) {
        // What is no file of the scene's is a name or a number.
        if value.as_str().is_some_and(|name| folder.join(name).is_file()) {
            placed(folder, value)?;
        }
    }
    Ok(())
}

fn placed(folder: &Path, file: &mut Item) -> Result<()> {
    let name = file.as_str().ok_or("a file's name is a string")?;
    *file = toml_edit::value(folder.join(name).display().to_string());
    Ok(())
}

/// A name for a file.
fn plain(what: &str) -> String {
    what.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// The head of a table that was measured elsewhere: lines `# key: words` before its columns.
pub(crate) fn head_of(text: &str) -> Value {
    let lines = text.lines().map_while(|line| line.strip_prefix("# ")?.split_once(": "));
    lines.map(|(key, words)| (key.to_owned(), Value::from(words))).collect::<Map<_, _>>().into()
}

/// The rows of a table with a head line, by column; what reads as a number is one.
///
/// # Errors
/// When a row has more or fewer cells than the head.
pub(crate) fn csv(text: &str) -> Result<Vec<Value>> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let columns = cells(lines.next().ok_or("a table without a head line")?);
    let row = |line: &str| -> Result<Value> {
        let cells = cells(line);
        if cells.len() != columns.len() {
            return Err(format!("{} cells under {} columns: {line}", cells.len(), columns.len()).into());
        }
        let value = |cell: String| match cell.parse::<f64>() {
            Ok(number) => Value::from(number),
            Err(_) if cell.is_empty() => Value::Null,
            Err(_) => Value::from(cell),
        };
        Ok(columns.iter().cloned().zip(cells.into_iter().map(value)).collect::<Map<_, _>>().into())
    };
    lines.map(row).collect()
}

/// Cells between commas; within quotes, commas belong to a cell.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => cells.last_mut().map_or((), |cell| cell.push(c)),
        }
    }
    cells
}

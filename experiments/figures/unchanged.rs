//! experiments/unchanged: fits by the paper's model, by the last program that was one package and by today's.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Map, Value, json};
use toml_edit::DocumentMut;

use crate::builds::ONE_PACKAGE;
use crate::lab::{Lab, Result};
use crate::lobes::beside_brute_force;
use crate::studies::number;

/// The scenes by the paper's model: names, and folders of the data.
const SCENES: [(&str, Option<&str>); 6] = [
    ("built in", None),
    ("forest", Some("lps_forest")),
    ("sunrise", Some("lps_sunrise")),
    ("studio", Some("lps_studio")),
    ("studio, dry", Some("lps_studio_dry")),
    ("posed head", Some("mh_portrait")),
];

/// What a fit found, and the folder that it left.
struct Fit {
    report: Value,
    run: PathBuf,
}

/// How losses, constants and pictures differ, scene by scene, and term by term where the constants are the same.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let (before, patched) = (program_before(lab)?, program_patched(lab)?);
    let (mut rows, mut terms) = (Vec::new(), Vec::new());
    for (name, folder) in SCENES {
        let scenes = folder.map(|folder| plain(lab, folder)).transpose()?;
        let [scene, of_today] = [0, 1].map(|i| scenes.as_ref().map(|scenes| scenes[i].clone()));
        let fit = |program: &Path, when: &str, scene: &Option<PathBuf>| {
            fitted(lab, program, &format!("{name}, {when}"), scene.as_deref())
        };
        let then = fit(&before, "before", &scene)?;
        let between = fit(&patched, "as today", &scene)?;
        let now = fit(lab.program(), "now", &of_today)?;
        let off = differences(&then, &now)?;
        let picture = |off: &BTreeMap<String, Off>| off.get("").map_or(Value::Null, Off::told);
        let mut row = row(name, &then.report, &now.report);
        row["picture"] = picture(&off);
        row["patched"] = self::row(name, &between.report, &now.report);
        row["patched"]["picture"] = picture(&differences(&between, &now)?);
        let baked = |program: &Path, when: &str, scene: &Option<PathBuf>| {
            bake(lab, program, &format!("{name}, {when}"), scene.as_deref())
        };
        let bakes = [baked(&before, "before", &scene)?, baked(lab.program(), "now", &of_today)?];
        let as_today = [baked(&patched, "as today", &scene)?, bakes[1].clone()];
        let open_sky = |bakes: &[PathBuf; 2]| occlusion(bakes).ok_or(format!("{name}: other vertices"));
        row["occlusion"] = open_sky(&bakes)?;
        row["patched"]["occlusion"] = open_sky(&as_today)?;
        row["cubes"] = cubes(&bakes)?;
        let built_in = || skinfit::built_in_scene(&lab.scratch.path().join("built_in"));
        row["lobes"] = beside_brute_force(&bakes, &scene.map_or_else(built_in, Ok)?)?;
        rows.push(row);
        if folder.is_none() {
            for (term, off) in &off {
                let mut row = off.told();
                row["term"] = if term.is_empty() { "the picture".into() } else { term.as_str().into() };
                terms.push(row);
            }
        }
    }
    Ok(json!({ "before": ONE_PACKAGE, "rows": rows, "terms": terms }))
}

/// The program of the last commit with a single package, and the race's in `examples` beside it: built, where they are not.
pub(crate) fn program_before(lab: &Lab) -> Result<PathBuf> {
    if let Some(program) = &lab.before {
        return Ok(program.clone());
    }
    built(lab, "before", None, &["--example", "race"])
}

/// The same, what it bakes made as today's program makes it.
fn program_patched(lab: &Lab) -> Result<PathBuf> {
    match &lab.patched {
        Some(program) => Ok(program.clone()),
        None => built(lab, "patched", Some(&lab.root.join("experiments/unchanged/as_today.patch")), &[]),
    }
}

/// The program of that commit, built in a folder of its own, with a patch, and what is `beside` it.
fn built(lab: &Lab, folder: &str, patch: Option<&Path>, beside: &[&str]) -> Result<PathBuf> {
    let clone = lab.scratch.path().join(folder);
    let program = clone.join("target/release/skinfit");
    if program.exists() {
        return Ok(program);
    }
    let mut command = Command::new("git");
    command.args(["clone", "--quiet", "."]).arg(&clone);
    lab.run("the project as it was", command, false)?;
    let mut command = Command::new("git");
    command.arg("-C").arg(&clone).args(["checkout", "--quiet", "--detach", ONE_PACKAGE]);
    lab.run("its commit", command, false)?;
    if let Some(patch) = patch {
        let mut command = Command::new("git");
        command.arg("-C").arg(&clone).arg("apply").arg(patch);
        lab.run("its patch", command, false)?;
    }
    let target = clone.join("target");
    let mut command = Command::new("cargo");
    command.args(["build", "--release", "--bins"]).args(beside);
    command.arg("--manifest-path").arg(clone.join("Cargo.toml")).env("CARGO_TARGET_DIR", &target);
    lab.run("its programs", command, false)?;
    Ok(program)
}

/// A scene by the paper's model alone, for the program before and for today's: without lamps and materials, which the first
/// did not know.
fn plain(lab: &Lab, folder: &str) -> Result<[PathBuf; 2]> {
    let whole = lab.scene(folder, &lab.data.join(folder).join("scene.toml"), &[])?;
    let mut document: DocumentMut = std::fs::read_to_string(&whole)?.parse()?;
    document.remove("light");
    document["mesh"].as_table_mut().ok_or("a scene has a mesh")?.remove("skin");
    // What today's program poses by `time` alone, the first posed where the effects were named.
    if document["mesh"].get("time").is_some() {
        let effects = document["model"]["effects"].as_array_mut().ok_or("a scene names its effects")?;
        effects.extend(["morph", "skin"]);
    }
    let path = whole.with_extension("plain.toml");
    std::fs::write(&path, document.to_string())?;
    // Maps of the mesh file's own material, which it did not read.
    let maps = document.entry("maps").or_insert(toml_edit::table()).as_table_mut();
    maps.ok_or("maps are a table")?.insert("material", toml_edit::value(false));
    let of_today = whole.with_extension("plain_today.toml");
    std::fs::write(&of_today, document.to_string())?;
    Ok([path, of_today])
}

fn fitted(lab: &Lab, program: &Path, what: &str, scene: Option<&Path>) -> Result<Fit> {
    let run = lab.scratch.path().join(what.replace([' ', ','], "_"));
    let mut command = Command::new(program);
    command.arg("fit").args(scene).args(["--engine", "cpu", "--json", "--loss", "l2", "-o"]).arg(&run);
    // What one program has baked is not the other's.
    command.arg("--no-cache");
    let report = serde_json::from_str(&lab.run(what, command, false)?)?;
    Ok(Fit { report, run })
}

/// A scene's row: the losses before, how they differ as shares, the constant that has moved the most in standard errors as
/// if residuals were independent, and the most that one has moved in those that reports give.
fn row(name: &str, then: &Value, now: &Value) -> Value {
    let differs = |end: &str| number(&now["loss"][end]) / number(&then["loss"][end]) - 1.0;
    let (mut most, mut of_reported, mut which) = (0.0, 0.0_f64, String::new());
    for (param, was) in then["params"].as_object().into_iter().flatten() {
        let is = &now["params"][param];
        let open = |found: &Value| found["at_bound"] == false && !found["std_error"].is_null();
        if !open(was) || !open(is) {
            continue;
        }
        let values = channels(&was["value"]).into_iter().zip(channels(&is["value"]));
        let errors = channels(&is["noise_error"]).into_iter().zip(channels(&is["std_error"]));
        for ((was, is), (error, reported)) in values.zip(errors) {
            // f32 holds no more of a constant than this, whatever its error.
            let moved = ((was - is).abs() - 1e-7 * was.abs()).max(0.0);
            of_reported = of_reported.max(moved / reported);
            if moved / error > most {
                (most, which) = (moved / error, param.clone());
            }
        }
    }
    json!({
        "name": name, "start": then["loss"]["start"], "end": then["loss"]["end"],
        "start_differs": differs("start"), "end_differs": differs("end"),
        "constant": which, "errors": most, "reported_errors": of_reported,
    })
}

/// A number, or one a channel.
fn channels(value: &Value) -> Vec<f64> {
    value.as_array().map_or_else(|| vec![number(value)], |channels| channels.iter().map(number).collect())
}

/// How numbers differ of a picture, or of a term in it, as shares of the picture's mean.
#[derive(Default)]
struct Off {
    most: f64,
    beyond: usize,
    of: usize,
}

impl Off {
    /// Add what colours differ by in the planes that are `named`.
    fn add(&mut self, then: &Planes, now: &Planes, named: impl Fn(&str) -> bool) -> Result<()> {
        let picture: Vec<&f32> =
            ["R", "G", "B"].iter().filter_map(|name| then.get(*name)).flatten().collect();
        let mean = picture.iter().map(|&&x| f64::from(x)).sum::<f64>() / picture.len() as f64;
        let coloured = |name: &str| ["R", "G", "B"].contains(&name.rsplit('.').next().unwrap_or(name));
        for (name, then) in then.iter().filter(|(name, _)| coloured(name) && named(name)) {
            let same = now.get(name).filter(|now| now.len() == then.len());
            for (a, b) in then.iter().zip(same.ok_or(format!("{name} has no like"))?) {
                let by = f64::from((a - b).abs()) / mean;
                // NaN differs from all.
                self.most = if by <= self.most { self.most } else { by };
                self.beyond += usize::from(by.is_nan() || by > 1e-5);
            }
            self.of += then.len();
        }
        Ok(())
    }

    /// The share of numbers that differ by more than 1e-5, and the largest difference.
    fn told(&self) -> Value {
        json!({ "beyond": self.beyond as f64 / self.of.max(1) as f64, "most": self.most })
    }
}

/// How the pictures of all views differ: of the picture (`""`), and of each term.
fn differences(then: &Fit, now: &Fit) -> Result<BTreeMap<String, Off>> {
    let mut all = BTreeMap::<String, Off>::new();
    for view in then.report["views"].as_object().unwrap_or(&Map::new()).keys() {
        let of_view = |fit: &Fit| planes(&fit.run.join(format!("{view}_terms.exr")));
        let (then, now) = (of_view(then)?, of_view(now)?);
        let terms = then.keys().filter_map(|name| {
            let (term, channel) = name.rsplit_once('.').unwrap_or(("", name));
            (channel == "R").then(|| term.to_owned())
        });
        for term in terms {
            let of_term = |name: &str| name.rsplit_once('.').map_or("", |(term, _)| term) == term;
            all.entry(term.clone()).or_default().add(&then, &now, of_term)?;
        }
    }
    Ok(all)
}

/// What a program bakes, in a folder.
fn bake(lab: &Lab, program: &Path, what: &str, scene: Option<&Path>) -> Result<PathBuf> {
    let folder = lab.scratch.path().join(format!("bakes_{}", what.replace([' ', ','], "_")));
    let mut command = Command::new(program);
    command.args(["bake", "--no-cache"]).args(scene).arg("-o").arg(&folder);
    lab.run(&format!("bakes of {what}"), command, false)?;
    Ok(folder)
}

/// How many of the vertices' shares of open sky differ, and by how much at the most.
fn occlusion(bakes: &[PathBuf; 2]) -> Option<Value> {
    let table = |folder: &PathBuf| std::fs::read_to_string(folder.join("occlusion.csv")).ok();
    let (then, now) = (table(&bakes[0])?, table(&bakes[1])?);
    let open = |line: &str| line.split(',').nth(1).and_then(|open| open.parse::<f64>().ok());
    if then.lines().count() != now.lines().count() {
        return None;
    }
    let lines = then.lines().zip(now.lines()).skip(1);
    let off: Vec<f64> = lines.filter_map(|(a, b)| Some((open(a)? - open(b)?).abs())).collect();
    let most = off.iter().copied().fold(0.0, f64::max);
    let differ = off.iter().filter(|off| **off > 1e-6).count();
    Some(json!({ "vertices": off.len(), "differ": differ, "most": most }))
}

/// How the cubes differ, as shares of each one's mean: irradiance, hilite, and the lobe that stands in the stack.
fn cubes([then, now]: &[PathBuf; 2]) -> Result<Value> {
    let mut told = json!({});
    for entry in std::fs::read_dir(then)? {
        let file = entry?.file_name();
        let name = file.to_string_lossy();
        let Some(cube) = name.strip_suffix(".exr") else { continue };
        let mut off = Off::default();
        off.add(&planes(&then.join(&file))?, &planes(&now.join(&file))?, |_| true)?;
        told[cube.split('_').next().unwrap_or(cube)] = off.told();
    }
    Ok(told)
}

/// The planes of an image, by name.
pub(crate) type Planes = BTreeMap<String, Vec<f32>>;

/// Those of an EXR file.
pub(crate) fn planes(path: &Path) -> Result<Planes> {
    use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    let planes = image.layer_data.channel_data.list.iter();
    Ok(planes.map(|plane| (plane.name.to_string(), plane.sample_data.values_as_f32().collect())).collect())
}

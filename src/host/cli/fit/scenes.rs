//! The scenes of a fit: each read, baked, given an engine over the views that are fitted, and all of them made one
//! objective.

use std::path::{Path, PathBuf};

use super::Arguments;
use super::hold_out::marked;
use crate::cli::fit_engine::SelectedEngine;
use crate::cli::interrupt::Interrupt;
use crate::cli::maps::{MapRun, MapsFound};
use crate::cli::{Refusal, tell_warnings};
use crate::engine::joint::Joint;
use crate::engine::{Engine, Point};
use crate::model::params::{Param, Params};
use crate::prepare::{Baked, HeldOut, Loaded, Observed, PrepareOptions, StageSeconds, share_skin};
use crate::scene::Loss;
use crate::scene::names::names_apart;

/// The scenes, and what is minimised over all of them.
pub(super) struct Scenes {
    pub(super) parts: Vec<Part>,
    pub(super) joint: Joint,
}

/// One scene of a fit.
pub(super) struct Part {
    /// What it is called among several.
    pub(super) name: String,
    /// Its file.
    pub(super) path: PathBuf,
    /// The scene with the views that are fitted.
    pub(super) baked: Baked,
    /// The views that are not.
    pub(super) held: HeldOut,
    /// Its number among the scenes that are fitted; none where all of its views are held out.
    pub(super) number: Option<usize>,
    /// Why its engine was taken, where that was left to the program.
    pub(super) why: Option<String>,
}

/// The scenes as they are read, each with its name and file: of several they share one skin.
pub(super) fn read(arguments: &Arguments, folder: &Path) -> Result<Vec<(String, PathBuf, Loaded)>, Refusal> {
    let named: Vec<Option<&Path>> = match arguments.scenes.as_slice() {
        [] => vec![None],
        scenes => scenes.iter().map(|scene| Some(scene.as_path())).collect(),
    };
    let paths = named.into_iter().map(|scene| arguments.bakes.kept_path(scene, folder));
    let paths = paths.collect::<Result<Vec<_>, _>>()?;
    let names = names(&paths)?;
    let options = PrepareOptions {
        fit: true,
        params: arguments.params.clone(),
        set: arguments.set.values()?.to_vec(),
        cache: arguments.bakes.cache(),
        ..PrepareOptions::default()
    };
    let one = |path: &PathBuf| -> Result<Loaded, Refusal> {
        let mut loaded = Loaded::read(path, &options)?;
        if let Some(loss) = &arguments.loss {
            loaded.scene.fit.loss = Loss::ALL.into_iter().find(|l| l.name() == loss).unwrap_or_default();
        }
        if !arguments.free.is_empty() {
            loaded.set_free(&arguments.free);
        }
        let held = arguments.maps.hold_constants(&mut loaded.scene.fit);
        loaded.warnings.extend(held.map(|told| format!("{}: {told}", path.display())));
        Ok(loaded)
    };
    let mut loaded = paths.iter().map(one).collect::<Result<Vec<_>, _>>()?;
    share_skin(&mut loaded)?;
    Ok(names.into_iter().zip(paths).zip(loaded).map(|((name, path), loaded)| (name, path, loaded)).collect())
}

/// A name for each scene, of which no two are the same file.
fn names(paths: &[PathBuf]) -> Result<Vec<String>, Refusal> {
    let whole = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
    for (i, path) in paths.iter().enumerate() {
        if paths[..i].iter().any(|earlier| whole(earlier) == whole(path)) {
            return Err(Refusal::new(format!(
                "{}: this scene is named twice: its images would count as twice as many as there are. Name it once.",
                path.display()
            )));
        }
    }
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    names_apart(&paths).ok_or_else(|| {
        let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        Refusal::new(format!(
            "{}: two of these scenes are called the same by their files and folders. Rename one of them.",
            paths.join(", ")
        ))
    })
}

impl Scenes {
    /// Bake and sample all scenes, and choose an engine for each that has a view to be fitted.
    pub(super) fn ready(
        arguments: &Arguments,
        loaded: Vec<(String, PathBuf, Loaded)>,
        interrupt: &Interrupt,
    ) -> Result<(Self, Option<MapsFound>), Refusal> {
        let places: Vec<_> = loaded
            .iter()
            .map(|(name, path, loaded)| (name.as_str(), path.as_path(), loaded.scene.views.as_slice()))
            .collect();
        let marks = marked(&arguments.hold_out, &places)?;
        let (mut parts, mut engines, mut maps) = (Vec::new(), Vec::new(), None);
        for ((name, path, loaded), marks) in loaded.into_iter().zip(marks) {
            let Ready { baked, held, chosen, maps: found } =
                Ready::of(arguments, loaded.bake()?, &marks, interrupt)?;
            maps = maps.or(found);
            let number = chosen.is_some().then_some(engines.len());
            let why = chosen.as_ref().and_then(|chosen| chosen.why.clone());
            engines.extend(chosen.map(|chosen| chosen.engine));
            parts.push(Part { name, path, baked, held, number, why });
        }
        // What is free of the skin was seen to be the same.
        let joint = Joint::new(engines)?;
        Ok((Self { parts, joint }, maps))
    }

    /// Whether there are several scenes.
    pub(super) fn several(&self) -> bool {
        self.parts.len() > 1
    }

    /// The scenes that are fitted, in their order.
    pub(super) fn fitted(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().filter(|part| part.number.is_some())
    }

    /// The engine over a scene's views.
    pub(super) fn engine(&self, number: usize) -> Option<&dyn Engine> {
        self.joint.engines().nth(number)
    }

    /// Where the fit starts.
    pub(super) fn start(&self) -> Result<Point, Refusal> {
        let starts: Vec<Point> = self.fitted().map(|part| part.baked.start()).collect();
        Joint::start(&starts).ok_or_else(|| Refusal::new("there is no scene to fit. Name one."))
    }

    /// Pixels in a row of each fitted view's image.
    pub(super) fn widths(&self) -> Vec<usize> {
        self.fitted().flat_map(|part| part.baked.image_widths()).collect()
    }

    /// Where a scene stands at the end of a fit; where it had no part in that, the skin is in the scene's own light.
    pub(super) fn point_of(&self, part: &Part, end: &Point) -> Point {
        let fitted = part.number.and_then(|number| self.joint.point_in(number, end));
        fitted.unwrap_or_else(|| {
            let mut params: Params = part.baked.scene.params.clone();
            let skin = Param::all().filter(|param| !param.is_of_scene());
            skin.for_each(|param| params.set_rgb(param, end.params.rgb(param)));
            Point { params, gains: Vec::new() }
        })
    }

    /// What a view is called in the report: of several scenes after its scene.
    pub(super) fn view_name(&self, part: &Part, view: &str) -> String {
        if self.several() { format!("{}/{view}", part.name) } else { view.to_owned() }
    }

    /// The seconds of each stage, of all scenes together; of samples those of the engines that made their own.
    pub(super) fn seconds(&self) -> StageSeconds {
        let mut all = StageSeconds::default();
        for part in &self.parts {
            let own = part.number.and_then(|number| self.engine(number)?.own_sample_seconds());
            let seconds = part.baked.seconds;
            all.load += seconds.load;
            all.bake += seconds.bake;
            all.samples += own.unwrap_or_default() + seconds.samples;
            all.maps += seconds.maps;
        }
        all
    }
}

/// A scene, ready to be fitted.
struct Ready {
    baked: Baked,
    held: HeldOut,
    chosen: Option<SelectedEngine>,
    maps: Option<MapsFound>,
}

impl Ready {
    /// The views beside their targets but for those that are held out, and the engine over them; by the maps that are to
    /// be fitted.
    fn of(
        arguments: &Arguments,
        baked: Baked,
        marks: &[bool],
        interrupt: &Interrupt,
    ) -> Result<Self, Refusal> {
        if arguments.maps.any() {
            return Self::with_maps(arguments, baked, marks, interrupt);
        }
        let (baked, held) = baked.hold_out(marks)?;
        let left = baked.scene.views.iter().any(|view| view.target.is_some());
        if !left && !held.views.is_empty() {
            tell_of(arguments, &baked);
            return Ok(Self { baked, held, chosen: None, maps: None });
        }
        let (observed, chosen) = if arguments.engine.makes_samples() {
            let baked = baked.keep_targets()?;
            tell_of(arguments, &baked);
            arguments.engine.over_own_samples(baked)?
        } else {
            let observed = baked.sample()?.observe()?;
            tell_of(arguments, &observed);
            let chosen = arguments.engine.select(&observed)?;
            (observed, chosen)
        };
        Ok(Self { baked: observed.baked, held, chosen: Some(chosen), maps: None })
    }

    /// The same after a fit of maps, which leaves one view out itself: with its samples as the fitted maps show them, it
    /// is scored beside them.
    fn with_maps(
        arguments: &Arguments,
        baked: Baked,
        marks: &[bool],
        interrupt: &Interrupt,
    ) -> Result<Self, Refusal> {
        let views = baked.scene.views.iter().zip(marks);
        let named: Vec<String> =
            views.filter(|(_, mark)| **mark).map(|(view, _)| view.name.clone()).collect();
        if named.len() > 1 {
            return Err(Refusal::new(format!(
                "{}: --hold-out names several views, and a fit of --maps leaves one out. Leave the others in.",
                baked.scene.path.display()
            )));
        }
        let observed = baked.sample()?.observe()?;
        tell_of(arguments, &observed);
        let views = &observed.scene.views;
        let held_out = named.first().and_then(|name| views.iter().position(|view| view.name == *name));
        let (adapter, quiet) = (arguments.engine.adapter(), arguments.json);
        let run = MapRun { adapter, held_out, interrupt: interrupt.watch(), quiet };
        let (observed, maps) = arguments.maps.fit(observed, &run)?;
        let chosen = arguments.engine.select(&observed)?;
        let Observed { baked, .. } = observed;
        Ok(Self { baked, held: HeldOut::default(), chosen: Some(chosen), maps })
    }
}

/// What the user should know before the search.
fn tell_of(arguments: &Arguments, baked: &Baked) {
    tell_warnings(&baked.warnings);
    arguments.set.tell_idle(baked.scene.effects);
}

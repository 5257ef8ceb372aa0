//! The scenes of a fit: each read, baked, given an engine over the views that are fitted, and all of them made one
//! objective.

use std::ops::Deref;
use std::path::Path;

use super::Arguments;
use crate::cli::fit_engine::SelectedEngine;
use crate::cli::interrupt::Interrupt;
use crate::cli::maps::{MapRun, MapsFound};
use crate::cli::{Refusal, tell_warnings};
use crate::prepare::{
    Baked, HeldOut, JointScenes, Loaded, NamedScene, Observed, PrepareOptions, ReadyScene, read_one_skin,
};
use crate::scene::Loss;

/// The scenes, and what is minimised over all of them.
pub(super) struct Scenes {
    joint: JointScenes,
    /// Why each scene's engine was taken, where that was left to the program.
    pub(super) whys: Vec<Option<String>>,
}

impl Deref for Scenes {
    type Target = JointScenes;

    fn deref(&self) -> &JointScenes {
        &self.joint
    }
}

/// The scenes as they are read, each with its name: of several they share one skin.
pub(super) fn read(arguments: &Arguments, folder: &Path) -> Result<Vec<NamedScene>, Refusal> {
    let options = PrepareOptions {
        fit: true,
        params: arguments.params.clone(),
        set: arguments.set.values()?.to_vec(),
        cache: arguments.scenes.bakes.cache(),
        ..PrepareOptions::default()
    };
    let change = |loaded: &mut Loaded| {
        if let Some(loss) = &arguments.loss {
            loaded.scene.fit.loss = Loss::ALL.into_iter().find(|l| l.name() == loss).unwrap_or_default();
        }
        if !arguments.free.is_empty() {
            loaded.set_free(&arguments.free);
        }
        let held = arguments.maps.hold_constants(&mut loaded.scene.fit);
        let path = loaded.scene.path.display().to_string();
        loaded.warnings.extend(held.map(|told| format!("{path}: {told}")));
    };
    Ok(read_one_skin(&arguments.scenes.kept_paths(folder)?, &options, change)?)
}

impl Scenes {
    /// Bake and sample all scenes, and choose an engine for each that has a view to be fitted.
    pub(super) fn ready(
        arguments: &Arguments,
        scenes: Vec<NamedScene>,
        interrupt: &Interrupt,
    ) -> Result<(Self, Option<MapsFound>), Refusal> {
        let marks = NamedScene::marked(&scenes, &arguments.held.hold_out)?;
        let (mut ready, mut whys, mut maps) = (Vec::new(), Vec::new(), None);
        for (NamedScene { name, loaded }, marks) in scenes.into_iter().zip(marks) {
            let Ready { baked, held, chosen, maps: found } =
                Ready::of(arguments, loaded.bake()?, &marks, interrupt)?;
            maps = maps.or(found);
            let (engine, why) = chosen.map(|chosen| (chosen.engine, chosen.why)).unzip();
            ready.push(ReadyScene { name, baked, held, engine });
            whys.push(why.flatten());
        }
        Ok((Self { joint: JointScenes::new(ready)?, whys }, maps))
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
        if held.is_all_of(&baked.scene) {
            tell_of(arguments, &baked);
            return Ok(Self { baked, held, chosen: None, maps: None });
        }
        let (observed, chosen) = if arguments.engine.makes_samples() {
            let baked = baked.keep_targets()?;
            tell_of(arguments, &baked);
            let told = baked.warnings.len();
            let (observed, chosen) = arguments.engine.over_own_samples(baked)?;
            tell_warnings(&observed.warnings[told..]);
            (observed, chosen)
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

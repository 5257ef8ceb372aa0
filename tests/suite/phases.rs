//! The stages before a fit: what each leaves, and what they share.

use std::sync::Arc;

use skinfit::model::effects::{Effect, Effects};
use skinfit::model::params::Param;
use skinfit::prepare::{Loaded, Observed, PrepareError, PrepareOptions};

use crate::scene_folder::{SCENE, SceneFolder};

/// A lit quad, seen twice by the same camera.
fn quad() -> (SceneFolder, PrepareOptions) {
    let folder = SceneFolder::new();
    let (front, fit) = (SCENE.find("[[view]]").unwrap(), SCENE.find("[fit]").unwrap());
    let other = SCENE[front..fit].replacen("front", "other", 1);
    folder.write("scene.toml", format!("{}{other}{}", &SCENE[..fit], &SCENE[fit..]).as_bytes());
    let effects = Some(Effects::of(&[Effect::Diffuse]));
    (folder, PrepareOptions { effects, fit: true, ..PrepareOptions::default() })
}

#[test]
fn views_without_a_target_take_no_part_and_a_warning_names_each() {
    let (folder, options) = quad();
    let mut loaded = Loaded::read(&folder.path("scene.toml"), &options).unwrap();
    loaded.scene.views[0].target = None;
    loaded.gains[0] = 0.5.into();
    let sampled = loaded.bake().unwrap().sample().unwrap();
    assert_eq!(sampled.samples.len(), 2);
    let observed = sampled.clone().observe().unwrap();
    let [view] = &observed.scene.views[..] else { panic!("{} views", observed.scene.views.len()) };
    assert_eq!((view.name.as_str(), observed.views.len()), ("other", 1));
    assert_eq!(observed.gains, [1.0.into()]);
    let warning = observed.warnings.last().unwrap();
    assert!(warning.ends_with("view \"front\" has no target and takes no part in the fit."), "{warning}");
    // What it was made of is as it was.
    assert_eq!((sampled.scene.views.len(), sampled.gains.len()), (2, 2));
    let none = sampled.baked.with_scene(|scene| scene.views.iter_mut().for_each(|view| view.target = None));
    assert!(matches!(none.keep_targets(), Err(PrepareError::NoTarget { .. })));
}

#[test]
fn a_stage_shares_what_it_was_made_of_and_an_engine_what_it_fits() {
    let (folder, options) = quad();
    let baked = Loaded::read(&folder.path("scene.toml"), &options).unwrap().bake().unwrap();
    let observed = baked.clone().sample().unwrap().observe().unwrap();
    assert!(Arc::ptr_eq(&observed.scene, &baked.scene));
    assert!(Arc::ptr_eq(&observed.illumination, &baked.illumination));
    let engine = observed.engine().unwrap();
    assert!(Arc::ptr_eq(engine.views(), &observed.views));
    let start = baked.scene.params.scalar(Param::BaseWeight);
    let other = baked.clone().with_scene(|scene| scene.params.set(Param::BaseWeight, start + 1.0));
    assert_eq!(other.start().params.scalar(Param::BaseWeight), start + 1.0);
    assert_eq!(baked.start().params.scalar(Param::BaseWeight), start);
    assert!(Arc::ptr_eq(&other.illumination, &baked.illumination));
}

#[test]
fn whoever_observes_a_file_has_its_targets_read() {
    let (folder, options) = quad();
    let options = PrepareOptions { fit: false, ..options };
    assert_eq!(Observed::new(&folder.path("scene.toml"), &options).unwrap().views.len(), 2);
}

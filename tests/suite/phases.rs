//! The stages before a fit: what each leaves, and what they share.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::sync::Arc;

use skinfit::demo;
use skinfit::model::params::Param;
use skinfit::prepare::{Loaded, PrepareError, PrepareOptions};

/// The built-in scene, each of whose views has a target.
fn loaded() -> Loaded {
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics");
    let scene = demo::kept_scene(&cache, Some(&cache)).unwrap();
    let options = PrepareOptions { fit: true, cache: Some(cache), ..PrepareOptions::default() };
    Loaded::read(&scene, &options).unwrap()
}

#[test]
fn views_without_a_target_take_no_part_and_a_warning_names_each() {
    let mut loaded = loaded();
    loaded.scene.views[0].target = None;
    let (without, count) = (loaded.scene.views[0].name.clone(), loaded.scene.views.len());
    loaded.gains[0] = 0.5;
    let sampled = loaded.bake().unwrap().sample().unwrap();
    assert_eq!(sampled.samples.len(), count);
    let groups = sampled.samples[1].groups();
    let observed = sampled.clone().observe().unwrap();
    assert_eq!(
        (observed.scene.views.len(), observed.views.len(), observed.gains.len()),
        (count - 1, count - 1, count - 1)
    );
    assert_eq!(observed.views[0].samples.groups(), groups);
    assert_eq!(observed.gains[0], 1.0);
    let warning = observed.warnings.last().unwrap();
    assert!(warning.contains(&format!("view \"{without}\" has no target")), "{warning}");
    // What it was made of is as it was.
    assert_eq!((sampled.scene.views.len(), sampled.gains.len()), (count, count));
    let none = sampled.baked.with_scene(|scene| scene.views.iter_mut().for_each(|view| view.target = None));
    assert!(matches!(none.keep_targets(), Err(PrepareError::NoTarget { .. })));
}

#[test]
fn a_stage_shares_what_it_was_made_of_and_an_engine_what_it_fits() {
    let baked = loaded().bake().unwrap();
    let observed = baked.clone().sample().unwrap().observe().unwrap();
    assert!(Arc::ptr_eq(&observed.scene, &baked.scene));
    assert!(Arc::ptr_eq(&observed.illumination, &baked.illumination));
    let engine = observed.engine().unwrap();
    assert!(Arc::ptr_eq(engine.views(), &observed.views));
    let start = baked.scene.params.scalar(Param::RimExponent);
    let other = baked.clone().with_scene(|scene| scene.params.set(Param::RimExponent, start + 1.0));
    assert_eq!(other.start().params.scalar(Param::RimExponent), start + 1.0);
    assert_eq!(baked.start().params.scalar(Param::RimExponent), start);
    assert!(Arc::ptr_eq(&other.illumination, &baked.illumination));
}

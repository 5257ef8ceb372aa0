//! Sliders and effects.

use std::sync::Arc;

use egui_kittest::kittest::Queryable as _;
use skinfit_view::egui::{Key, Modifiers};
use skinfit_view::paint::Slot;

use super::{click, drag, left_out, node, open, settle, start, until, value};
use crate::model::params::Param;

#[test]
fn a_slider_moves_its_constant_and_its_image_and_one_drag_is_one_step() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    // Nobody looks at where the sliders began: it is not drawn.
    assert!(hand.state().session.image(Slot::Start).is_none());
    click(&mut hand, "pane start");
    settle(&mut hand);
    let before = value(&hand, Param::BaseWeight);
    let image = Arc::clone(&hand.state().session.image(Slot::Now).unwrap().image);
    drag(&mut hand, "base_weight", &[5.0, 15.0, 40.0]);
    let after = value(&hand, Param::BaseWeight);
    assert_ne!(before, after);
    settle(&mut hand);
    let moved = Arc::clone(&hand.state().session.image(Slot::Now).unwrap().image);
    assert_ne!(image.rgb, moved.rgb);
    // What the sliders began with stays as it was drawn.
    assert_eq!(hand.state().session.image(Slot::Start).unwrap().image.rgb, image.rgb);

    hand.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    hand.step();
    assert_eq!(value(&hand, Param::BaseWeight), before, "the whole drag is undone");
    settle(&mut hand);
    assert_eq!(hand.state().session.image(Slot::Now).unwrap().image.rgb, image.rgb);
    click(&mut hand, "redo");
    assert_eq!(value(&hand, Param::BaseWeight), after);
}

#[test]
fn an_effect_is_switched_and_what_it_brought_is_told() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    click(&mut hand, "Effects");
    hand.run_steps(20);
    let before = hand.state().session.values().unwrap().effects;
    click(&mut hand, "effect reflection");
    settle(&mut hand);
    let session = &hand.state().session;
    let effect = crate::model::effects::Effect::Reflection;
    assert!(before.has(effect) && !session.values().unwrap().effects.has(effect));
    assert!(!session.opened().unwrap().baked.scene.effects.has(effect));
    let change = session.change(effect).expect("it is weighed once its image is there");
    assert!(change.psnr.is_some(), "{change:?}");
    // What the scene's own weights ask for comes back, and nothing is read again and again.
    click(&mut hand, "effect morph");
    settle(&mut hand);
    let session = &hand.state().session;
    assert!(session.values().unwrap().effects.has(crate::model::effects::Effect::Morph));
    // Two that are switched while the scene is read are both.
    hand.state_mut().session.set_effect(crate::model::effects::Effect::Rim, false);
    hand.step();
    hand.state_mut().session.set_effect(crate::model::effects::Effect::Hilite, false);
    settle(&mut hand);
    let effects = hand.state().session.opened().unwrap().baked.scene.effects;
    assert!(
        !effects.has(crate::model::effects::Effect::Rim)
            && !effects.has(crate::model::effects::Effect::Hilite)
    );
    // So is one that is taken back while it is.
    click(&mut hand, "undo");
    click(&mut hand, "undo");
    settle(&mut hand);
    let effects = hand.state().session.opened().unwrap().baked.scene.effects;
    assert!(
        effects.has(crate::model::effects::Effect::Rim) && effects.has(crate::model::effects::Effect::Hilite)
    );
    // Its parameter is gone from the rows, and from what is free.
    assert!(hand.query_by_label("fit reflection").is_none());
    hand.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut hand);
    node(&hand, "fit reflection");
    assert_eq!(hand.state().session.opened().unwrap().baked.scene.effects, before);
}

#[test]
fn sliders_and_fits_stay_within_the_scenes_bounds() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut start = start(folder.path());
    let reading = &mut start.scenes[0];
    let text = std::fs::read_to_string(&reading.scene).unwrap();
    // It is 1 there at the start, and 0.85 in what the targets were made with.
    let bounded = text.replacen("[fit]\n", "[fit]\nbounds = { base_weight = [0.9, 1.05] }\n", 1);
    assert_ne!(text, bounded, "{text}");
    let name = format!("bounded-{}.toml", folder.path().file_name().unwrap().to_string_lossy());
    reading.scene = reading.scene.with_file_name(name);
    std::fs::write(&reading.scene, bounded).unwrap();
    let mut hand = open(&start);
    for (far, end) in [(4000.0, 1.05), (-4000.0, 0.9)] {
        drag(&mut hand, "base_weight", &[5.0, far]);
        assert_eq!(value(&hand, Param::BaseWeight), [end; 3]);
    }
    click(&mut hand, "undo");
    click(&mut hand, "undo");
    click(&mut hand, "fit");
    until(&mut hand, "the fit ends", |window| window.session.found().is_some());
    settle(&mut hand);
    assert_eq!(value(&hand, Param::BaseWeight), [0.9; 3]);
    let found = hand.state().session.found().unwrap();
    assert!(found.constant("base_weight").unwrap().at_bound);
}

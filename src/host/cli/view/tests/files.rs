//! Constants, scenes and runs as files.

use std::path::{Path, PathBuf};

use egui_kittest::kittest::Queryable as _;
use skinfit_view::egui::{Key, Modifiers};
use skinfit_view::look::Pane;
use skinfit_view::paint::Slot;

use super::{Hand, click, drag, left_out, node, open, settle, start, until, value};
use crate::model::params::Param;

#[test]
fn presets_go_out_and_come_back() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    drag(&mut hand, "base_weight", &[35.0]);
    let moved = value(&hand, Param::BaseWeight);
    let file: PathBuf = folder.path().join("preset.toml");
    hand.state_mut().session.save_params(&file);
    settle(&mut hand);
    click(&mut hand, "undo");
    assert_ne!(value(&hand, Param::BaseWeight), moved);
    hand.state_mut().session.load_params(&file);
    hand.step();
    assert_eq!(value(&hand, Param::BaseWeight), moved);
    hand.state_mut().session.load_params(&folder.path().join("missing.toml"));
    assert!(hand.state().session.told().last().unwrap().contains("missing.toml"));
    // The scene with these values is a scene.
    let scene = folder.path().join("kept.toml");
    hand.state_mut().session.save_scene(&scene);
    settle(&mut hand);
    let read = crate::prepare::Loaded::read(&scene, &crate::prepare::PrepareOptions::default()).unwrap();
    assert_eq!(read.scene.params.rgb(Param::BaseWeight), moved);
}

/// Write a path into the field for files.
fn name_file(hand: &mut Hand<'_>, path: &Path) {
    node(hand, "file").focus();
    hand.step();
    hand.key_press_modifiers(Modifiers::COMMAND, Key::A);
    hand.step();
    node(hand, "file").type_text(&path.display().to_string());
    hand.step();
}

#[test]
fn a_run_is_opened_beside_another_and_a_table_has_both() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    click(&mut hand, "Files");
    hand.run_steps(20);
    // Two runs: all that the scene leaves free, and without a term.
    click(&mut hand, "fit");
    until(&mut hand, "the fit ends", |window| window.session.found().is_some());
    let (whole, part) = (folder.path().join("run"), folder.path().join("part"));
    let found = hand.state().session.found().unwrap().clone();
    hand.state_mut().session.set_run_folder(part.clone());
    click(&mut hand, "undo");
    click(&mut hand, "fit hilite");
    click(&mut hand, "fit");
    until(&mut hand, "the fit ends", |window| {
        window.session.found().is_some() && window.session.fitting().is_none()
    });
    settle(&mut hand);

    name_file(&mut hand, &whole);
    click(&mut hand, "open");
    settle(&mut hand);
    let session = &hand.state().session;
    assert!(session.told().is_empty(), "{:?}", session.told());
    assert_eq!(session.fitted().unwrap(), session.values().map(|values| &values.params).unwrap());
    // What the report says of it is there as after the fit itself: to the digits that the files have.
    let read = session.found().unwrap();
    assert_eq!((&read.known, read.loss, &read.losses), (&found.known, found.loss, &found.losses));
    assert_eq!(session.scores().len(), session.opened().unwrap().views().len());

    name_file(&mut hand, &part);
    click(&mut hand, "compare");
    settle(&mut hand);
    assert!(hand.state().look.panes.contains(&Pane::Other));
    assert!(hand.state().session.image(Slot::Other).is_some());
    click(&mut hand, "table");
    hand.run_steps(4);
    node(&hand, "other run, dB");
    let other = hand.state().session.other_fit().unwrap();
    assert!(other.found.constant("hilite.r").is_none() && other.found.loss > read_loss(&hand), "{other:?}");
    let score = other.views[0].psnr;
    node(&hand, &format!("{score:.2}"));

    hand.key_press(Key::F2);
    hand.run_steps(4);
    assert!(hand.query_by_label("other run, dB").is_none(), "the table is closed");
    name_file(&mut hand, &folder.path().join("nothing.toml"));
    click(&mut hand, "compare");
    settle(&mut hand);
    assert!(hand.state().session.told().last().unwrap().contains("nothing.toml"));
    // What was there is there still, also where a scene cannot be opened.
    assert!(hand.state().session.other().is_some());
    click(&mut hand, "open");
    settle(&mut hand);
    assert!(hand.state().session.told().last().unwrap().contains("nothing.toml"));
    assert_eq!(hand.state().session.scores().len(), 3);
    assert!(hand.state().session.other().is_some());
}

fn read_loss(hand: &Hand<'_>) -> f64 {
    hand.state().session.found().unwrap().loss
}

//! Fits.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use skinfit_view::egui::{Key, Modifiers};
use skinfit_view::paint::Slot;
use skinfit_view::values::Freedom;

use super::{Hand, click, left_out, node, open, settle, start, until, value};
use crate::fit::outcome::Ending;
use crate::model::params::Param;

#[test]
fn a_fixed_constant_stays_and_the_fit_leaves_the_command_lines_run() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    click(&mut hand, "fit hilite");
    let fixed = value(&hand, Param::Hilite);
    let freedom = |hand: &Hand<'_>| hand.state().session.values().unwrap().freedom(Param::Hilite);
    assert_eq!(freedom(&hand), Freedom::Fixed);
    click(&mut hand, "fit");
    until(&mut hand, "the fit ends", |window| window.session.found().is_some());
    settle(&mut hand);
    assert_eq!(value(&hand, Param::Hilite), fixed, "it was fixed");
    let outcome = hand.state().session.found().unwrap().clone();
    assert_eq!(outcome.ending, Ending::Converged);
    assert!(outcome.constant("hilite.r").is_none() && outcome.constant("base_weight").is_some());

    // The same from the command line: the run folder's own scene.
    let run = folder.path().join("run");
    for name in ["report.html", "report.json", "params.toml", "scene.toml", "state.json", "front.png"] {
        assert!(run.join(name).is_file(), "{name}");
    }
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(run.join("report.json")).unwrap()).unwrap();
    let found = report["unknowns"].as_array().unwrap();
    assert!(found.iter().all(|row| !row["name"].as_str().unwrap().starts_with("hilite")), "{found:?}");
    // The sliders stand where the fit ended, and undo goes back to before it.
    assert_eq!(value(&hand, Param::BaseWeight), outcome.ends[0].params.rgb(Param::BaseWeight));
    click(&mut hand, "undo");
    assert_eq!(
        value(&hand, Param::BaseWeight),
        hand.state().session.first().unwrap().params.rgb(Param::BaseWeight)
    );

    // A pixel of the probe is the image's, which the report's EXR has, too; the renderer's 32 bits and the CPU's 64
    // differ by roundings and a sample at an edge.
    click(&mut hand, "redo");
    settle(&mut hand);
    let (exr, alpha) = read_exr(&run.join("front_terms.exr"));
    let image = Arc::clone(&hand.state().session.image(Slot::Now).unwrap().image);
    let inside: Vec<usize> = (0..alpha.len()).filter(|&i| alpha[i] == 1.0).step_by(97).collect();
    assert!(inside.len() > 100);
    for i in inside {
        for c in 0..3 {
            assert!((image.rgb[i][c] - exr[i][c]).abs() < 1e-4, "{i}: {:?} {:?}", image.rgb[i], exr[i]);
        }
    }
    let (x, y) = (image.width as u32 / 2, image.height as u32 / 2);
    hand.state_mut().point_at([x, y]);
    hand.step();
    let [r, g, b] = image.rgb[y as usize * image.width + x as usize];
    node(&hand, &format!("{r:.5} {g:.5} {b:.5}"));
}

/// The unnamed layer of an EXR, and its alpha.
fn read_exr(path: &Path) -> (Vec<[f32; 3]>, Vec<f32>) {
    let layer = exr::prelude::read_first_flat_layer_from_file(path).unwrap().layer_data;
    let plane = |name: &str| -> Vec<f32> {
        let channel = layer.channel_data.list.iter().find(|channel| channel.name.eq(name)).unwrap();
        channel.sample_data.values_as_f32().collect()
    };
    let [r, g, b] = ["R", "G", "B"].map(plane);
    ((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect(), plane("A"))
}

#[test]
fn a_window_that_is_closed_within_a_fit_leaves_a_run_that_resumes() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let start = start(folder.path());
    let mut hand = open(&start);
    hand.state_mut().session.begin_fit(false);
    hand.state_mut().session.toggle_pause();
    until(&mut hand, "the first step", |window| !window.session.path().is_empty());
    node(&hand, "go on");
    // It waits: nothing comes after what was told.
    let steps = hand.state().session.path().len();
    for _ in 0..20 {
        hand.step();
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(hand.state().session.path().len(), steps, "the fit is paused");
    drop(hand);
    assert!(folder.path().join("run/state.json").is_file());

    let mut hand = open(&start);
    // What the boxes say would not hold: the fit that goes on is another.
    click(&mut hand, "fit hilite");
    hand.key_press_modifiers(Modifiers::COMMAND, Key::R);
    hand.step();
    settle(&mut hand);
    let told = hand.state().session.told().last().unwrap().clone();
    assert!(told.contains("other free constants") && told.contains("scene.toml"), "{told}");
    assert!(hand.state().session.found().is_none());
    hand.state_mut().session.forget_told();
    click(&mut hand, "fit hilite");
    hand.key_press_modifiers(Modifiers::COMMAND, Key::R);
    hand.step();
    until(&mut hand, "the fit ends", |window| window.session.found().is_some());
    let resumed = hand.state().session.found().unwrap().clone();
    assert_eq!(resumed.ending, Ending::Converged, "{:?}", hand.state().session.told());

    // A fit that nobody stopped ends at the same constants, to the bit.
    hand.state_mut().session.set_run_folder(folder.path().join("whole"));
    click(&mut hand, "undo");
    hand.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    hand.step();
    until(&mut hand, "the fit ends", |window| window.session.found().is_some() && window.session.is_idle());
    let whole = hand.state().session.found().unwrap();
    assert_eq!(whole.ends, resumed.ends);
}

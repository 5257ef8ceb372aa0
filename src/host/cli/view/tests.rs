//! The window, used as a person does: by the names of its controls.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui_kittest::kittest::{NodeT as _, Queryable as _};
use egui_kittest::wgpu::WgpuTestRenderer;
use egui_kittest::{Harness, Node, SnapshotOptions, image_snapshot_options};
use image::imageops::crop_imm;
use skinfit_view::egui::accesskit::Role;
use skinfit_view::egui::{Context, Key, Modifiers, Pos2, Vec2};
use skinfit_view::look::{Layout, Pane};
use skinfit_view::opened::Reading;
use skinfit_view::paint::{Engine, Slot};
use skinfit_view::values::Freedom;
use skinfit_view::window::offscreen::render_state;
use skinfit_view::{Start, Window};

use super::fits::CommandLine;
use crate::fit::outcome::Ending;
use crate::model::params::Param;
use crate::render::tonemap::{Operator, ToneMap};

/// How long anything in the window is waited for: a fit of the built-in scene takes a second on two cores.
const PATIENCE: Duration = Duration::from_secs(240);

type Hand<'a> = Harness<'a, Window>;

/// Whether tests may do without an adapter, which is said.
fn left_out() -> bool {
    let out = std::env::var_os("SKINFIT_NO_GPU_TESTS").is_some_and(|value| !value.is_empty());
    if out {
        eprintln!("NOT CHECKED: the window; SKINFIT_NO_GPU_TESTS is set");
    }
    out
}

/// The built-in scene in a folder, with bakes that all tests share.
fn start(folder: &Path) -> Start {
    let cache = std::env::temp_dir().join(format!("skinfit-window-tests-{}", std::process::id()));
    let scene = crate::demo::kept_scene(&cache, Some(&cache)).unwrap();
    Start {
        reading: Reading { scene, cache: Some(cache), ..Reading::default() },
        run: folder.join("run"),
        engine: Engine::default(),
        ..Start::default()
    }
}

/// Words of the command line that name the same bakes.
fn host(start: &Start) -> Arc<CommandLine> {
    let cache = start.reading.cache.as_ref().unwrap().display().to_string();
    Arc::new(CommandLine { bakes: vec!["--cache".to_owned(), cache], cache: start.reading.cache.clone() })
}

/// A window over a scene, complete.
fn open<'a>(start: &Start) -> Hand<'a> {
    let state = render_state().expect("a Vulkan driver: tests/run installs one");
    let renderer = WgpuTestRenderer::from_render_state(state);
    let ctx = Context::default();
    // It wakes a context that nobody shows; these tests poll.
    let window = Window::new(host(start), start.clone(), &ctx);
    let mut hand = Harness::builder()
        .with_size(Vec2::new(1300.0, 900.0))
        .with_accessibility_check(true)
        .renderer(renderer)
        .build_ui_state(
            |ui, window: &mut Window| {
                window.session.poll();
                window.show(ui);
            },
            window,
        );
    settle(&mut hand);
    assert!(hand.state().session.opened().is_some(), "{:?}", hand.state().session.told());
    hand
}

/// Frames until `done`.
fn until(hand: &mut Hand<'_>, what: &str, done: impl Fn(&Window) -> bool) {
    let since = Instant::now();
    loop {
        hand.step();
        if done(hand.state()) {
            return;
        }
        assert!(since.elapsed() < PATIENCE, "{what}: {:?}", hand.state().session.told());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Frames until all that was asked for is there.
fn settle(hand: &mut Hand<'_>) {
    for _ in 0..3 {
        until(hand, "the window is complete", |window| window.session.is_idle());
    }
}

fn value(hand: &Hand<'_>, param: Param) -> [f64; 3] {
    hand.state().session.values().unwrap().params.rgb(param)
}

/// Press in the middle of a control, move, and let go there.
fn drag(hand: &mut Hand<'_>, name: &str, steps: &[f32]) {
    let middle = node(hand, name).rect().center();
    // The slider is the left part of its control.
    hand.drag_at(middle);
    hand.step();
    for step in steps {
        hand.hover_at(middle + Vec2::new(*step, 0.0));
        hand.step();
    }
    let end = middle + Vec2::new(steps.last().copied().unwrap_or(0.0), 0.0);
    hand.drop_at(end);
    hand.step();
    hand.step();
}

/// The control of that name, or else the words: of a slider the slider, not the words above it.
fn node<'a>(hand: &'a Hand<'_>, name: &'a str) -> Node<'a> {
    let words = |node: &Node<'_>| node.accesskit_node().role() == Role::Label;
    let mut found: Vec<Node<'a>> = hand.query_all_by_label(name).collect();
    found.sort_by_key(words);
    assert!(!found.is_empty(), "no control is called {name}");
    found.remove(0)
}

fn click(hand: &mut Hand<'_>, name: &str) {
    node(hand, name).click();
    hand.step();
    hand.step();
}

#[test]
fn a_slider_moves_its_constant_and_its_image_and_one_drag_is_one_step() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
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
    assert_eq!(value(&hand, Param::BaseWeight), outcome.end.params.rgb(Param::BaseWeight));
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
    hand.state_mut().session.fitting_mut().unwrap().set_paused(true);
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
    assert_eq!(whole.end, resumed.end);
}

#[test]
fn a_lost_device_is_told_and_the_window_goes_on() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    let before = Arc::clone(&hand.state().session.image(Slot::Now).unwrap().image);
    assert!(hand.state().session.engine().starts_with("gpu"), "{}", hand.state().session.engine());
    hand.state_mut().session.lose_device();
    settle(&mut hand);
    let session = &hand.state().session;
    assert!(
        session.told().iter().any(|words| words.contains("The CPU engine draws")),
        "{:?}",
        session.told()
    );
    assert_eq!(session.engine(), "cpu");
    let after = &session.image(Slot::Now).unwrap().image;
    let apart = before.rgb.iter().zip(&after.rgb).filter(|(a, b)| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-3));
    // Rays and the rasteriser part at edges.
    assert!(apart.count() * 100 < before.rgb.len(), "both engines draw the same");
    drag(&mut hand, "base_weight", &[30.0]);
    settle(&mut hand);
    assert_ne!(hand.state().session.image(Slot::Now).unwrap().image.rgb, before.rgb);
}

#[test]
fn panes_show_what_tone_mapping_says() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    let image = Arc::clone(hand.state().session.opened().unwrap().targets[0].as_ref().unwrap());
    hand.state_mut().look.panes = vec![Pane::Target];
    hand.state_mut().look.layout = Layout::Side;
    for operator in Operator::ALL {
        for exposure in [0.0, 1.5] {
            let look = &mut hand.state_mut().look;
            look.exposure = exposure;
            look.set_operator(operator);
            // Each pixel of the image is four across.
            look.zoom = Some(4.0);
            hand.step();
            let rect = hand.get_by_role_and_label(Role::Image, "target").rect();
            let shown = hand.render().unwrap();
            let tone = ToneMap { operator, exposure };
            let mut checked = 0;
            for (dx, dy) in [(-40, -60), (0, -30), (20, 10), (-12, 40), (30, 50)] {
                let (x, y) = (image.width as i32 / 2 + dx, image.height as i32 / 2 + dy);
                let i = y as usize * image.width + x as usize;
                if image.alpha[i] < 1.0 {
                    continue;
                }
                // The image's middle is the pane's.
                let at = rect.center() + Vec2::new(4.0 * (dx as f32 + 0.5), 4.0 * (dy as f32 + 0.5));
                let Pos2 { x: px, y: py } = at;
                let got = shown.get_pixel(px as u32, py as u32).0;
                let want = tone.encode_bytes(image.rgb[i]);
                // A rounding of powers in f32, and one to bytes.
                let near = (0..3).all(|c| got[c].abs_diff(want[c]) <= 1);
                assert!(near, "{operator:?} {exposure} at {dx}, {dy}: {got:?} {want:?}");
                checked += 1;
            }
            assert!(checked >= 3);
        }
    }
}

/// What the window looks like above the fit's panel, whose times differ from run to run. `UPDATE_SNAPSHOTS=1` draws it anew.
#[test]
fn the_window_looks_as_it_did() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    hand.state_mut().look.panes = vec![Pane::Target, Pane::Now, Pane::Error];
    hand.state_mut().point_at([160, 150]);
    settle(&mut hand);
    hand.run_steps(3);
    let below = hand.get_by_role_and_label(Role::Button, "fit").rect().min.y as u32 - 10;
    let shown = hand.render().unwrap();
    let top = crop_imm(&shown, 0, 0, shown.width(), below).to_image();
    // A software adapter of another version rounds a colour by a level or two, and takes other samples at the head's
    // edge, of which there are some thousand pixels in three panes.
    let options = SnapshotOptions::new().threshold(1.0).max_failed_pixels(600_usize);
    image_snapshot_options(&top, "window", &options.output_path("cli/view/snapshots"));
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
    // Its parameter is gone from the rows, and from what is free.
    assert!(hand.query_by_label("fit reflection").is_none());
    hand.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    settle(&mut hand);
    node(&hand, "fit reflection");
    assert_eq!(hand.state().session.opened().unwrap().baked.scene.effects, before);
}

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
}

fn read_loss(hand: &Hand<'_>) -> f64 {
    hand.state().session.found().unwrap().loss
}

#[test]
fn the_list_of_keys_names_them_all_and_keys_do_what_it_says() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    hand.key_press(Key::F1);
    hand.run_steps(4);
    node(&hand, "fit from where the sliders stand");
    hand.key_press(Key::F1);
    hand.run_steps(4);
    assert!(hand.query_by_label("fit from where the sliders stand").is_none());
    hand.key_press(Key::V);
    hand.step();
    assert_eq!(hand.state().session.view, 1);
    hand.key_press(Key::L);
    hand.step();
    assert_eq!(hand.state().look.layout, Layout::Wipe);
    // Letters that are written into a field are not keys of the window.
    node(&hand, "run folder").focus();
    hand.step();
    hand.key_press(Key::V);
    hand.step();
    assert_eq!(hand.state().session.view, 1);
}

//! The window, used as a person does: by the names of its controls.
//!
//! - `constants`: sliders and effects; `fits`; `files`: constants, scenes and runs; `several`: scenes that share one skin
//! - `looks`: what is seen of it, keys among it
//! - here: a window, and the hands that use it

mod constants;
mod files;
mod fits;
mod looks;
mod several;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui_kittest::kittest::{NodeT as _, Queryable as _};
use egui_kittest::wgpu::WgpuTestRenderer;
use egui_kittest::{Harness, Node};
use skinfit_view::egui::accesskit::Role;
use skinfit_view::egui::{Context, Vec2};
use skinfit_view::opened::Reading;
use skinfit_view::paint::Engine;
use skinfit_view::window::offscreen::render_state;
use skinfit_view::{Start, Window};

use crate::cli::CommandLine;
use crate::model::params::Param;

/// How long anything in the window is waited for: a fit of the built-in scene takes a second on two cores.
const PATIENCE: Duration = Duration::from_secs(240);

type Hand<'a> = Harness<'a, Window>;

/// Whether tests may do without an adapter, which is said.
fn left_out() -> bool {
    let out = std::env::var_os("SKINFIT_NO_GPU_TESTS").is_some_and(|value| !value.is_empty());
    if out {
        // The tests' runner takes what `eprintln` says.
        let said = writeln!(std::io::stderr(), "NOT CHECKED: the window; SKINFIT_NO_GPU_TESTS is set");
        said.expect("stderr is there");
    }
    out
}

/// The built-in scene in a folder, with bakes that all tests share.
fn start(folder: &Path) -> Start {
    let cache = std::env::temp_dir().join(format!("skinfit-window-tests-{}", std::process::id()));
    let scene = crate::demo::kept_scene(&cache, Some(&cache)).unwrap();
    Start {
        scenes: vec![Reading { scene, cache: Some(cache), ..Reading::default() }],
        run: folder.join("run"),
        engine: Engine::default(),
        ..Start::default()
    }
}

/// Words of the command line that name the same bakes.
fn host(start: &Start) -> Arc<CommandLine> {
    let cache = start.scenes[0].cache.as_ref().unwrap().display().to_string();
    Arc::new(CommandLine { words: vec!["--cache".to_owned(), cache], cache: start.scenes[0].cache.clone() })
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

/// Frames until every request is answered.
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

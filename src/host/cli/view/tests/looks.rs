//! What is seen of the window.

use std::sync::Arc;

use egui_kittest::kittest::Queryable as _;
use egui_kittest::{SnapshotOptions, image_snapshot_options};
use image::imageops::crop_imm;
use skinfit_view::egui::accesskit::Role;
use skinfit_view::egui::{Key, Modifiers, Pos2, Vec2};
use skinfit_view::look::{Layout, Pane};
use skinfit_view::paint::Slot;

use super::{drag, left_out, node, open, settle, start};
use crate::render::tonemap::{Operator, ToneMap};

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
    assert_eq!(hand.state().session.at(), 1);
    hand.key_press_modifiers(Modifiers::SHIFT, Key::E);
    settle(&mut hand);
    // There is no fit yet. The error of where the sliders began is there though that pane is not shown.
    assert_eq!(hand.state().look.error_of, Slot::Start);
    node(&hand, "error of start: FLIP, 0 to 1");
    assert!(hand.state().session.image(Slot::Start).unwrap().compared.is_some());
    hand.key_press(Key::L);
    hand.step();
    assert_eq!(hand.state().look.layout, Layout::Wipe);
    // Letters that are written into a field are not keys of the window.
    node(&hand, "run folder").focus();
    hand.step();
    hand.key_press(Key::V);
    hand.step();
    assert_eq!(hand.state().session.at(), 1);
}

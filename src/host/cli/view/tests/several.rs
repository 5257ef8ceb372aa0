//! Scenes that share one skin, and gains of views.

use std::path::Path;

use skinfit_view::Start;
use skinfit_view::egui::Vec2;
use skinfit_view::opened::Reading;

use super::{Hand, click, drag, left_out, node, open, settle, start, until, value};
use crate::fit::outcome::Ending;
use crate::model::params::{Channels, Param};

/// The built-in scene twice, the second time with its light turned and its views' gains free.
fn two(folder: &Path) -> Start {
    let one = start(folder);
    let Reading { scene, cache, .. } = one.scenes[0].clone();
    let home = scene.parent().unwrap();
    let text = std::fs::read_to_string(&scene).unwrap();
    let turned = text.replacen("[model.params]\n", "[model.params]\nenvironment_rotation = 20.0\n", 1);
    assert_ne!(text, turned, "{text}");
    let reading = |(name, text): (&str, String)| {
        let scene = home.join(format!("{name}-{}.toml", folder.file_name().unwrap().to_string_lossy()));
        std::fs::write(&scene, text).unwrap();
        Reading { scene, cache: cache.clone(), ..Reading::default() }
    };
    let scenes = [("noon", text.clone()), ("night", turned)].map(reading).to_vec();
    Start { scenes, ..one }
}

/// Each scene's value.
fn values(hand: &Hand<'_>, param: Param) -> [f64; 2] {
    [0, 1].map(|scene| {
        let session = &hand.state().session;
        let first = session.places().iter().position(|place| place.scene == scene).unwrap();
        assert!(first == 0 || scene == 1);
        session.values_of(scene).unwrap().params.scalar(param)
    })
}

#[test]
fn scenes_share_a_skin_and_each_has_its_own_light() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&two(folder.path()));
    let session = &hand.state().session;
    let places = session.places();
    assert_eq!(places.len(), 2 * session.opened().unwrap().views().len());
    let names: Vec<String> = session.scenes().iter().map(|opened| opened.name.clone()).collect();
    assert!(places[0].name.starts_with(&format!("{}/", names[0])), "{places:?}");

    // What is the skin's moves in both, what is a scene's in that alone.
    drag(&mut hand, "base_weight", &[25.0]);
    let [one, other] = values(&hand, Param::BaseWeight);
    assert_eq!(one, other);
    let second = places.iter().find(|place| place.scene == 1).unwrap().name.clone();
    click(&mut hand, &format!("view {second}"));
    settle(&mut hand);
    assert_eq!((hand.state().session.scene(), value(&hand, Param::BaseWeight)[0]), (1, one));
    assert_eq!(values(&hand, Param::EnvironmentRotation), [0.0, 20.0]);
    hand.state_mut().session.turn_light(15.0);
    hand.state_mut().session.settle();
    assert_eq!(values(&hand, Param::EnvironmentRotation), [0.0, 35.0]);
    click(&mut hand, "undo");
    assert_eq!(values(&hand, Param::EnvironmentRotation), [0.0, 20.0]);
    // Constants of both go out and come back.
    let file = folder.path().join("both.toml");
    hand.state_mut().session.save_params(&file);
    settle(&mut hand);
    click(&mut hand, "undo");
    assert_ne!(values(&hand, Param::BaseWeight), [one; 2]);
    hand.state_mut().session.load_params(&file);
    assert_eq!(values(&hand, Param::BaseWeight), [one; 2]);
    assert_eq!(values(&hand, Param::EnvironmentRotation), [0.0, 20.0]);
    click(&mut hand, "fit hilite");
    let fixed = values(&hand, Param::Hilite);
    // An effect of the skin's goes in both.
    let effects = |hand: &Hand<'_>| {
        hand.state().session.scenes().iter().map(|opened| opened.baked.scene.effects).collect::<Vec<_>>()
    };
    let before = effects(&hand);
    click(&mut hand, "Effects");
    hand.run_steps(20);
    click(&mut hand, "effect bloom");
    settle(&mut hand);
    let after = effects(&hand);
    assert!(before.iter().zip(&after).all(|(before, after)| before != after), "{before:?} {after:?}");
    click(&mut hand, "undo");
    settle(&mut hand);
    assert_eq!(effects(&hand), before);

    // A fit of both, without one view of the second.
    click(&mut hand, &format!("fit view {second}"));
    click(&mut hand, "fit");
    until(&mut hand, "the fit ends", |window| window.session.fitting().is_none() && window.session.is_idle());
    let session = &hand.state().session;
    let found = session.found().unwrap_or_else(|| panic!("{:?}", session.told()));
    assert_eq!((found.ending, found.ends.len()), (Ending::Converged, 2), "{:?}", session.told());
    let [one, other] = values(&hand, Param::BaseWeight);
    assert_eq!(one, other);
    assert_eq!(values(&hand, Param::Hilite), fixed, "it was fixed");
    let held: Vec<&str> =
        session.scores().iter().filter(|score| score.held_out).map(|score| score.view.as_str()).collect();
    assert_eq!(held, [second.as_str()]);
    // They stand in the order of the views.
    let told: Vec<&String> = session.scores().iter().map(|score| &score.view).collect();
    assert_eq!(told, places.iter().map(|place| &place.name).collect::<Vec<_>>());
    // The run folder is the command line's, and is opened as it was left.
    let run = folder.path().join("run");
    for name in &names {
        assert!(run.join("scenes").join(format!("{name}.toml")).is_file(), "{name}");
    }
    let ends = found.ends.clone();
    hand.state_mut().session.open(&run);
    settle(&mut hand);
    let session = &hand.state().session;
    let opened: Vec<String> = session.scenes().iter().map(|opened| opened.name.clone()).collect();
    assert_eq!(opened, names, "{:?}", session.told());
    for (scene, end) in ends.iter().enumerate() {
        assert_eq!(session.values_of(scene).unwrap().params, end.params, "{scene}");
    }
}

#[test]
fn a_views_gain_is_a_row_and_a_fit_starts_there() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut hand = open(&start(folder.path()));
    // They stand below all other rows.
    hand.set_size(Vec2::new(1300.0, 1500.0));
    click(&mut hand, "Gains of views");
    hand.run_steps(20);
    let first = hand.state().session.opened().unwrap().views()[0].name.clone();
    drag(&mut hand, &format!("gain {first}"), &[10.0, 20.0]);
    settle(&mut hand);
    let gain = hand.state().session.values().unwrap().gains[0].scalar().unwrap();
    assert!(gain > 1.05, "{gain}");
    // The image is drawn with it.
    assert_eq!(hand.state().session.image(skinfit_view::paint::Slot::Now).unwrap().job.gain, gain.into());
    click(&mut hand, "fit gains");
    click(&mut hand, "fit");
    until(&mut hand, "the fit ends", |window| window.session.fitting().is_none() && window.session.is_idle());
    let session = &hand.state().session;
    let found = session.found().unwrap_or_else(|| panic!("{:?}", session.told()));
    // The first view's is held where it was; the others follow it, as the light has no scale of its own.
    assert_eq!(found.ends[0].gains[0], gain.into());
    assert!(
        found.ends[0].gains[1..].iter().all(|other| (other.channel(1) / gain - 1.0).abs() < 0.05),
        "{:?}",
        found.ends[0].gains
    );
    let second = session.opened().unwrap().views()[1].name.clone();
    assert!(session.known_gain(&second, Channels::Tied).is_some_and(|known| known.std_error.is_some()));
    let text = std::fs::read_to_string(folder.path().join("run/scene.toml")).unwrap();
    assert!(text.contains("gains = true"), "{text}");
    // One step back is before the fit.
    click(&mut hand, "undo");
    assert_eq!(hand.state().session.values().unwrap().gains[1], 1.0.into());
    node(&hand, &format!("gain {second}"));
    // With its white balance free, a gain is a row a channel; held again, it is one value.
    click(&mut hand, "fit white balance");
    hand.run_steps(20);
    drag(&mut hand, &format!("gain {second}.b"), &[10.0, 20.0]);
    settle(&mut hand);
    let gain = |hand: &Hand<'_>| hand.state().session.values().unwrap().gains[1];
    let [red, green, blue] = gain(&hand).0;
    assert!(red == 1.0 && green == 1.0 && blue > 1.05, "{:?}", gain(&hand));
    click(&mut hand, "fit white balance");
    hand.run_steps(20);
    assert_eq!(gain(&hand), 1.0.into());
    click(&mut hand, "undo");
    assert_eq!(gain(&hand).0, [red, green, blue]);
}

#[test]
fn a_step_back_into_what_cannot_be_read_any_more_is_told_once() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let both = two(folder.path());
    let start = Start { scenes: both.scenes[..1].to_vec(), ..both };
    let mut hand = open(&start);
    click(&mut hand, "Effects");
    hand.run_steps(20);
    click(&mut hand, "effect bloom");
    settle(&mut hand);
    let effects = |hand: &Hand<'_>| hand.state().session.opened().unwrap().baked.scene.effects;
    let before = effects(&hand);
    std::fs::remove_file(&start.scenes[0].scene).unwrap();
    click(&mut hand, "undo");
    settle(&mut hand);
    let session = &hand.state().session;
    assert_eq!(session.told().len(), 1, "{:?}", session.told());
    // What is shown stays, and what is edited says so.
    assert_eq!((effects(&hand), session.values().unwrap().effects), (before, before));
}

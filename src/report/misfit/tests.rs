//! Misfits of views whose residuals are known.

use super::*;
use crate::render::files::Image;
use crate::render::places::Places;
use crate::scene::view::Clip;

/// Even pseudo-random numbers in [-1, 1] (Marsaglia's xorshift).
pub(crate) fn noise(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed.max(1);
    move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0) as f32
    }
}

const SIDE: usize = 128;

/// A fully covered view with light from above, folds in a disc of a fourteenth of its pixels, and a rim at its
/// left edge; `fit` tells the fit's radiance of a channel from the target's, by index and channel.
pub(crate) fn view(mut fit: impl FnMut(usize, usize, f32) -> f32) -> ViewEvidence {
    let (mut target, mut fitted) = (Image::new(SIDE, SIDE), Image::new(SIDE, SIDE));
    let mut places = Places {
        open: vec![0.9; SIDE * SIDE],
        facing: vec![0.6; SIDE * SIDE],
        lit: vec![0.0; SIDE * SIDE],
        mirrored: Vec::new(),
    };
    for at in 0..SIDE * SIDE {
        let (x, y) = (at % SIDE, at / SIDE);
        let light = 0.2 + 0.6 * (SIDE - y) as f32 / SIDE as f32;
        target.rgb[at] = [0.9, 0.6, 0.5].map(|c| c * light * (1.0 + 0.2 * (0.7 * x as f32).sin()));
        fitted.rgb[at] = [0, 1, 2].map(|c| fit(at, c, target.rgb[at][c]));
        (places.lit[at], target.alpha[at], fitted.alpha[at]) = (light, 1.0, 1.0);
        if (x as f32 - 64.0).hypot(y as f32 - 64.0) < 19.0 {
            places.open[at] = 0.4;
        }
        if x < 4 {
            places.facing[at] = 0.2;
        }
    }
    ViewEvidence {
        name: "front".to_owned(),
        target,
        coverage: vec![1.0; SIDE * SIDE],
        fit: fitted,
        terms: Vec::new(),
        haze: Vec::new(),
        places,
        clip: None,
        held_out: false,
    }
}

fn in_disc(at: usize) -> bool {
    ((at % SIDE) as f32 - 64.0).hypot((at / SIDE) as f32 - 64.0) < 19.0
}

#[test]
fn a_place_that_is_off_by_a_known_share_is_told_by_it() {
    let mut noise = noise(7);
    let misfit = Misfit::of(&[view(|at, _, target| {
        let share = if in_disc(at) { 0.88 } else { 1.0 };
        target * (share + 0.02 * noise())
    })]);
    let told: Vec<String> = misfit.told().map(PlaceMisfit::words).collect();
    // Elsewhere the mean is off by a fourteenth of this at most: less than 1% of the mean radiance.
    assert_eq!(told, ["too dark in creases by 12%"]);
    let creases = misfit.told().next().unwrap();
    // A disc of 1125 pixels of 16384, each off by 0.12 of what it is; noise adds 0.02^2 / 3 everywhere.
    assert!((creases.pixels - 0.069).abs() < 1e-3, "{creases:?}");
    let own = 0.12 * 0.12 + 0.02 * 0.02 / 3.0;
    let rest = (1.0 - creases.pixels) * 0.02 * 0.02 / 3.0;
    let share = creases.pixels * own / (creases.pixels * own + rest);
    // The target is about as bright in the disc as beside it; its square is not, by a tenth or so.
    assert!((creases.squared_error - share).abs() < 0.03, "{} {share}", creases.squared_error);
    assert!(
        creases.sentence().ends_with("6.9% of the pixels, 88% of the squared error)"),
        "{}",
        creases.sentence()
    );
    assert_eq!(misfit.largest_in_words().as_deref(), Some("largest misfit: too dark in creases by 12%"));
}

#[test]
fn symmetric_noise_says_nothing() {
    for seed in 1..20 {
        let mut noise = noise(seed);
        let misfit = Misfit::of(&[view(|_, _, target| target * (1.0 + 0.3 * noise()))]);
        assert_eq!(misfit.told().count(), 0, "{seed}: {:?}", misfit.told().collect::<Vec<_>>());
        let words = misfit.largest_in_words().unwrap();
        assert_eq!(words, "no place is too bright or too dark on average");
    }
}

#[test]
fn neighbours_that_err_alike_are_few_witnesses() {
    // Patches of 32 pixels, off by 30% to either side in turns.
    let patch = |at: usize| at / SIDE / 32 + at % SIDE / 32;
    let share = |at: usize| if patch(at) % 2 == 0 { 0.7 } else { 1.3 };
    let misfit = Misfit::of(&[view(|at, _, target| target * share(at))]);
    let overall = misfit.places.iter().find(|place| place.place == "overall").unwrap();
    // Independent pixels would have 0.3 of the mean radiance of 0.34 over the root of 16384; the blocks of 16 pixels,
    // of which there are 64, have sixteen times that.
    assert!(overall.std_error.unwrap() > 10.0 * 0.3 * 0.34 / 128.0, "{overall:?}");
    assert!(!overall.told);
}

#[test]
fn next_to_black_the_radiance_is_told_and_what_is_not_known_is_not() {
    let mut view = view(|at, _, target| if at % SIDE < 4 { 0.05 } else { target });
    (0..SIDE * SIDE).filter(|at| at % SIDE < 4).for_each(|at| view.target.rgb[at] = [0.0; 3]);
    (view.places.open, view.places.lit) = (Vec::new(), Vec::new());
    let misfit = Misfit::of(&[view]);
    let told: Vec<String> = misfit.told().map(PlaceMisfit::words).collect();
    assert_eq!(told[0], "too bright at the rim by a radiance of 0.050");
    let names: Vec<&str> = misfit.places.iter().map(|place| place.place.as_str()).collect();
    for missing in ["in creases", "on the light side", "on the shadow side", "in highlights", "in view front"]
    {
        assert!(!names.contains(&missing), "{names:?}");
    }
}

#[test]
fn a_view_and_a_channel_that_are_off_are_told() {
    let named = |name: &str, view: ViewEvidence| ViewEvidence { name: name.to_owned(), ..view };
    let left = named("left", view(|_, c, target| if c == 2 { 1.4 * target } else { target }));
    let misfit = Misfit::of(&[view(|_, _, target| target), left]);
    let told: Vec<String> = misfit.told().map(PlaceMisfit::words).collect();
    assert!(told.contains(&"too bright in blue by 20%".to_owned()), "{told:?}");
    // A quarter of the light is blue: 0.5 of 2.0.
    assert!(told.contains(&"too bright in view left by 10%".to_owned()), "{told:?}");
    let all: f64 =
        misfit.places.iter().filter(|p| p.place.starts_with("in view")).map(|p| p.squared_error).sum();
    assert!((all - 1.0).abs() < 1e-12, "{all}");
}

#[test]
fn how_much_is_explained_has_a_word() {
    let mean = {
        let view = view(|_, _, target| target);
        let sum = |c: usize| view.target.rgb.iter().map(|rgb| f64::from(rgb[c])).sum::<f64>();
        [0, 1, 2].map(|c| (sum(c) / (SIDE * SIDE) as f64) as f32)
    };
    // Residuals that are a share of what the target differs from its mean leave the square of it unexplained.
    for (share, matched, words) in [
        (0.0, Match::Close, "more than 99.9%"),
        (0.2, Match::Rough, "96.0%"),
        (0.5, Match::Poor, "75.0%"),
        (0.9, Match::None, "19.0%"),
        (1.5, Match::None, "none"),
    ] {
        let misfit = Misfit::of(&[view(|_, c, target| target + share * (mean[c] - target))]);
        assert_eq!(misfit.matched, Some(matched), "{share}");
        let told = misfit.explained_in_words().unwrap();
        assert!(told.starts_with(&format!("the model explains {words} of")), "{told}");
    }
}

#[test]
fn nothing_is_wrong_beyond_a_clip_and_nothing_is_said_of_nothing() {
    let mut bright = view(|_, _, target| 2.0 * target);
    bright.clip = Some(Clip { low: 0.0, high: 0.0 });
    assert_eq!(Misfit::of(&[bright]).told().count(), 0);
    let mut unseen = view(|_, _, _| f32::NAN);
    let (odd, none) = (Misfit::of(std::slice::from_ref(&unseen)), Misfit::of(&[]));
    assert_eq!((&odd, &none), (&Misfit::default(), &Misfit::default()));
    unseen.coverage.fill(0.5);
    assert_eq!(Misfit::of(&[unseen]).largest_in_words(), None);
    // Without variance nothing can be explained.
    let mut flat = view(|_, _, _| 0.5);
    flat.target.rgb.fill([0.5; 3]);
    let flat = Misfit::of(&[flat]);
    assert_eq!((flat.explained, flat.explained_in_words()), (None, None));
    assert!(flat.largest_in_words().is_some());
}

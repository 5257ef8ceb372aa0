//! States of fits, damaged: refused in a paragraph that names the file, or gone on from to an end that is finite and
//! within bounds.

use proptest::prelude::*;
use serde_json::Value;
use skinfit::fit::{FitOptions, SolverKind, fit};

use super::image::{Image, point, truth};
use crate::damage::tree::{json_text, tree_damage};
use crate::damage::{damage, throw};

#[test]
fn no_damage_to_a_state_makes_a_fit_panic_or_end_beyond_its_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.json");
    let image = Image::new(40, &truth()).with_noise(0.05, 3);
    let mut gone_on = 0;
    for solver in [SolverKind::Varpro, SolverKind::Lm, SolverKind::Lbfgs] {
        let short = FitOptions {
            solver,
            starts: 2,
            seed: 3,
            max_iterations: Some(2),
            state: Some(path.clone()),
            ..FitOptions::default()
        };
        fit(&image, &point(&[]), &short, &mut |_| {}).unwrap();
        let whole: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let resumed = FitOptions { resume: Some(path.clone()), max_iterations: Some(6), ..short };
        let passed = std::cell::Cell::new(0);
        let damages = (prop::collection::vec(tree_damage(), 0..3), prop::collection::vec(damage(), 0..2));
        throw(300, &damages, |(trees, letters)| {
            let tree = trees.iter().fold(whole.clone(), |tree, damage| damage.apply(tree));
            let text = json_text(&tree).into_bytes();
            std::fs::write(&path, letters.iter().fold(text, |bytes, damage| damage.apply(bytes))).unwrap();
            match fit(&image, &point(&[]), &resumed, &mut |_| {}) {
                Err(error) => {
                    let words = error.to_string();
                    prop_assert!(
                        !words.contains(['\n', '\u{1b}']) && words.contains("state.json"),
                        "{words:?}"
                    );
                }
                Ok(outcome) => {
                    passed.set(passed.get() + 1);
                    prop_assert!(
                        outcome.loss_start.is_finite() && outcome.loss_end.is_finite(),
                        "{outcome:?}"
                    );
                    for known in &outcome.unknowns {
                        let (low, high) = known.unknown.bounds();
                        let what = known.unknown.name();
                        prop_assert!((low..=high).contains(&known.value), "{what}: {}", known.value);
                        prop_assert!(known.std_error.is_none_or(|e| e.is_finite() && e >= 0.0), "{what}");
                    }
                }
            }
            Ok(())
        });
        gone_on += passed.get();
    }
    // Were every state refused, nothing would have been tried.
    assert!(gone_on > 30, "only {gone_on} states were gone on from");
}

#[test]
fn a_name_that_a_state_holds_does_not_break_the_paragraph() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.json");
    let image = Image::new(10, &truth());
    let short = FitOptions { max_iterations: Some(1), state: Some(path.clone()), ..FitOptions::default() };
    fit(&image, &point(&[]), &short, &mut |_| {}).unwrap();
    let mut state: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    state["unknowns"][0] = "a\nb\u{1b}[2J".into();
    std::fs::write(&path, state.to_string()).unwrap();
    let resumed = FitOptions { resume: Some(path), ..short };
    let words = fit(&image, &point(&[]), &resumed, &mut |_| {}).unwrap_err().to_string();
    assert!(words.contains("another fit") && words.contains("a b"), "{words:?}");
    assert!(!words.contains(char::is_control), "{words:?}");
}

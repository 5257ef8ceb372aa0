//! Hard cases on the adapter: the shader rules and the GPU engine.

use std::rc::Rc;

use skinfit::gpu::Choice;
use skinfit::study::stability::check::{check, check_frame};
use skinfit::study::stability::evaluate::Evaluator;
use skinfit::study::stability::hard::{cases, frames};
use skinfit::study::stability::kept::built_in;
use skinfit::study::stability::lights::LightBox;
use skinfit::study::stability::objectives::{EngineEvaluator, OnAdapter};
use skinfit::study::stability::random::batch;
use skinfit::study::stability::shader::{Adapter, Rules};

use super::bench;

/// Shaders are compiled for each case: on a software adapter the GPU engine's take most of a second.
const EVERY: usize = 6;

#[test]
fn hard_cases_stay_finite_and_agree_on_the_adapter() {
    if bench::gpu().is_none() {
        return;
    }
    let adapter = Rc::new(Adapter::open(Choice::default()).unwrap());
    let (rules, engine) = (Rules(Rc::clone(&adapter)), EngineEvaluator(OnAdapter(adapter)));
    let lights = LightBox::new(None);
    let passes = |evaluator: &dyn Evaluator, case: &skinfit::study::stability::hard::HardCase| {
        let verdict = check(evaluator, &lights, &case.batch, &case.holds);
        assert_eq!(verdict.failure, None, "{}: {}", evaluator.name(), case.name);
    };
    for (number, case) in cases().iter().enumerate() {
        passes(&rules, case);
        // The one that its derivatives failed before they were cut off, and a share of the others.
        if number.is_multiple_of(EVERY) || case.name == "normal that all but cancels" {
            passes(&engine, case);
        }
    }
    for frame in frames() {
        let verdict = check_frame(&rules, frame.vertex).unwrap();
        assert_eq!(verdict.failure, None, "{}", frame.name);
    }
    for kept in built_in().unwrap() {
        for evaluator in [&rules as &dyn Evaluator, &engine] {
            let verdict = check(evaluator, &lights, &kept.batch, &[]);
            assert_eq!(verdict.failure, None, "{}: {}", evaluator.name(), kept.name);
        }
    }
    for index in 0..8 {
        let random = batch(11, index, 64);
        for evaluator in [&rules as &dyn Evaluator, &engine] {
            let verdict = check(evaluator, &lights, &random, &[]);
            assert_eq!(verdict.failure, None, "{}: batch {index}", evaluator.name());
        }
    }
}

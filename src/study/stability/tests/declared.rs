//! Terms of files: those that are sound pass, and what breaks is found and named.

use std::sync::Arc;

use super::only;
use crate::engine::{NormalEquations, Objective, Point, Task, Unknown};
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::Params;
use crate::shader::term::register;
use crate::stability::case::FragmentInputs;
use crate::stability::engine_factory::EngineFactory;
use crate::stability::hard::cases;
use crate::stability::lit_case::LitFragment;
use crate::stability::*;

/// One ordinary fragment under diffuse light and the mirror, and the effect of a file.
fn declared(name: &str, text: &str) -> Declared {
    let effect = register(name, text).unwrap_or_else(|error| panic!("{error}")).effect;
    let effects = Effects::of(&[Effect::Diffuse, Effect::Reflection]).with(effect);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    Declared {
        setup,
        params: Params::defaults(setup.form),
        light: Arc::clone(LightBox::new(None).of(LightKind::Wavy)),
        atlas: None,
        samples: vec![LitFragment::new(setup, FragmentInputs::ORDINARY, Vec::new(), [0.0; 3])],
    }
}

/// The tally of an engine, of two random batches behind those of hard values.
fn searched(declared: &Declared, engine: impl EngineFactory + Sync + 'static) -> search::Tally {
    let asked = 2 * lit::CASES;
    let tallies = declared::search(&only(EngineEvaluator(engine)), declared, (1, asked), &|_| {});
    // The first batch has a fragment for each surface of the named cases.
    let surfaces: usize = cases().iter().map(|case| case.batch.fragments.len()).sum();
    assert_eq!(tallies[0].tried, surfaces + 64 * (declared.batches(asked) - 1));
    tallies[0].clone()
}

#[test]
fn a_declared_term_that_is_sound_passes() {
    let fresnel =
        declared("fresnel_reflection", include_str!("../../../../experiments/library/fresnel.wgsl"));
    // The weight at 0, its greatest, next to either; the reflectance at 0 and 0.2, next to either; the scene's values, and
    // two random batches.
    assert_eq!(fresnel.batches(2 * lit::CASES), 4 + 4 + 1 + 2);
    let tally = searched(&fresnel, Cpu);
    assert_eq!((tally.failed, &tally.worst.failure), (0, &None));
    // f32 is not f64: a deviation of exactly 0 would mean that nothing was compared.
    assert!(tally.worst.deviation > 0.0);
}

/// The CPU engine whose gradients are a hundredth too large.
struct Steep;

impl EngineFactory for Steep {
    fn name(&self) -> String {
        "steep".to_owned()
    }
    fn with(&self, task: &Task, point: &Point, then: &mut dyn FnMut(&dyn Objective)) -> Result<(), String> {
        Cpu.with(task, point, &mut |engine| then(&TooSteep(engine)))
    }
    fn image(&self, task: &Task, point: &Point) -> Result<Vec<Vec<f32>>, String> {
        Cpu.image(task, point)
    }
}

struct TooSteep<'a>(&'a dyn Objective);

impl Objective for TooSteep<'_> {
    fn unknowns(&self) -> &[Unknown] {
        self.0.unknowns()
    }
    fn normal_equations(&self, point: &Point) -> NormalEquations {
        self.0.normal_equations(point)
    }
    fn loss(&self, point: &Point) -> f64 {
        self.0.loss(point)
    }
    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        let (loss, gradient) = self.0.gradient(point);
        (loss, gradient.into_iter().map(|x| 1.01 * x).collect())
    }
}

#[test]
fn a_derivative_by_a_declared_parameter_is_held_against_f64() {
    let text = "// effect: stability_veil, even light\n\
                // parameter: stability_veil_weight = 0.5 in [0, 2], linear; how much of it; a test\n//\n\
                // gives: stability_veil_part\n// adds: stability_veil\n// cost: 3\n\
                fn stability_veil_light(albedo: vec3f, stability_veil_weight: f32) -> vec3f {\n    \
                return stability_veil_weight * albedo;\n}\n";
    let veil = declared("stability_veil", text);
    let tally = searched(&veil, Cpu);
    assert_eq!((tally.failed, tally.worst.failure), (0, None));
    let failure = searched(&veil, Steep).worst.failure.unwrap();
    assert!(failure.contains("the gradient by stability_veil_weight is "), "{failure}");
}

#[test]
fn a_parameter_at_which_a_declared_term_breaks_is_found_and_named() {
    // The root's derivative has no end at 0, which is what the parameter may be.
    let text = "// effect: stability_glow, light without a source\n\
                // parameter: stability_glow_tint = 0.5 in [0, 1], rgb; its colour; a test\n\
                // parameter: stability_glow_spread = 0.5 in [0, 4]; how far it goes; a test\n//\n\
                // gives: stability_glow_part\n// adds: stability_glow\n// cost: 6\n\
                fn stability_glow_light(albedo: vec3f, stability_glow_tint: vec3f, stability_glow_spread: f32) -> vec3f {\n    \
                return stability_glow_tint * (sqrt(stability_glow_spread) * albedo);\n}\n";
    let tally = searched(&declared("stability_glow", text), Cpu);
    let failure = tally.worst.failure.unwrap();
    // Of 64 fragments no engine answers for one: the gradient is one number. Effects that have no part in it are left out.
    assert!(tally.failed >= 64, "{}", tally.failed);
    for words in [
        "stability_glow_spread = 0 of stability_glow, Corrected, {\"stability_glow\"}, ",
        "in f64 the gradient by stability_glow_spread is ",
    ] {
        assert!(failure.contains(words), "{words}: {failure}");
    }
}

#[test]
fn a_declared_term_that_breaks_where_a_surface_is_seen_edge_on_is_found_and_named() {
    // 0 / 0 where n.V is 0, whatever the parameter.
    let text = "// effect: stability_halo, light along the outline\n\
                // parameter: stability_halo_weight = 0.5 in [0, 4], linear; how much of it; a test\n//\n\
                // gives: stability_halo_part\n// adds: stability_halo\n// cost: 6\n\
                fn stability_halo_light(n: vec3f, view: vec3f, stability_halo_weight: f32) -> vec3f {\n    \
                let facing: f32 = abs(dot(n, view));\n    \
                return vec3f(stability_halo_weight * (sin(facing) / facing));\n}\n";
    let failure = searched(&declared("stability_halo", text), Cpu).worst.failure.unwrap();
    let words = "the scene's own values, Corrected, {\"stability_halo\"}, ";
    assert!(failure.starts_with(words), "{failure}");
    assert!(failure.ends_with("in f64 a colour is not finite"), "{failure}");
}

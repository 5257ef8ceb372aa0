//! Random batches of what lights, their mirror images and the sky bring (MODEL 8 to 10), under random named choices:
//! each engine's image must be that of the model in f64, as near as rounding explains, and its loss and gradient
//! finite.
//!
//! The other search holds every derivative against f64; these are held so by finite differences in the tests.

use std::sync::Arc;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rayon::prelude::*;

use super::check::{Number, Verdict};
use super::engine_factory::EngineFactory;
use super::evaluate::{Evaluators, Rgba, TARGET};
use super::hard::HardLight;
use super::lights::LightBox;
use super::lit_case::{LitBatch, LitFragment, Probes};
use super::objectives::{targets, weights};
use super::reference::{FEW, MANY, Moves, SPREAD, SUMMED, TINY};
use super::search::Tally;
use crate::engine::reference::Reference;
use crate::engine::view::ObservedView;
use crate::engine::{Point, Task, Unknown};
use crate::model::choices::SpecularModel;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param, Params};
use crate::samples::ViewSamples;

/// Fragments in a batch: each takes a plan of its own, which is most of its time.
const BATCH: usize = 64;
/// So many of the other search's cases for each of these batches.
pub(super) const CASES: usize = 250;

/// What f32 leaves of the split sum's fits, as a share of what a mirroring surface shows, and as a share of their own: the
/// fits' tests hold the one, a tenth of their own error; the other is as large where the share changes the fastest.
const FITTED: f64 = 5e-5;
/// About twice as many roundings lie one behind the other as in the paper's model, for which the spread is.
const LONGER: f64 = 2.0;
/// At most so many: a long search of the other kind is not to take hours of this one.
const MOST: usize = 1024;

/// How many batches stand beside so many cases of the other search.
#[must_use]
pub fn batches(cases: usize) -> usize {
    cases.div_ceil(CASES).min(MOST)
}

/// Try random batches on every engine; `progress` is told after each. Tallies are in the order of the evaluators, empty
/// where one is no engine.
#[must_use]
pub fn search(
    evaluators: &Evaluators,
    lights: &LightBox,
    (seed, cases): (u64, usize),
    progress: &(dyn Fn(usize) + Sync),
) -> Vec<Tally> {
    let mut tallies = vec![Tally::default(); evaluators.count()];
    let probes = match Probes::new() {
        Ok(probes) => probes,
        Err(error) => {
            let failed = Tally { failed: 1, worst: Verdict::failed(error.to_string()), tried: 1 };
            return vec![failed; evaluators.count()];
        }
    };
    let engines: Vec<_> = evaluators.shared.iter().map(|shared| &**shared).collect();
    let ask = |index: usize| {
        let mut rng = StdRng::seed_from_u64(seed ^ 0x11 ^ (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let tried = Tried::new(
            format!("batch {index} of lights"),
            LitBatch::random(&probes, lights, &mut rng, BATCH),
        );
        let verdicts: Vec<_> =
            engines.iter().map(|shared| shared.engine().map(|engine| tried.verdict(engine))).collect();
        progress(1);
        (tried, verdicts)
    };
    let tried: Vec<_> = (0..batches(cases)).into_par_iter().map(ask).collect();
    for (tried, verdicts) in tried {
        let own = evaluators.own.iter().map(|own| own.engine().map(|engine| tried.verdict(engine)));
        for (tally, verdict) in tallies.iter_mut().zip(verdicts.into_iter().chain(own)) {
            let Some((verdict, failed)) = verdict else { continue };
            tally.tried += BATCH;
            tally.failed += failed;
            tally.worst.merge(verdict);
        }
    }
    tallies
}

/// How each engine does in a named case, in the order of the evaluators; `None` where one is no engine.
#[must_use]
pub fn hard(evaluators: &Evaluators, lights: &LightBox, case: &HardLight) -> Vec<Option<Verdict>> {
    let batches = || -> Result<Vec<LitBatch>, String> {
        let probes = Probes::new().map_err(|error| error.to_string())?;
        SpecularModel::ALL.iter().map(|&model| LitBatch::hard(&probes, lights, model, case)).collect()
    };
    let what = format!("{:?} environment, {:?}", case.sky, case.params);
    let tried = batches()
        .map(|batches| batches.into_iter().map(|batch| Tried::new(what.clone(), batch)).collect::<Vec<_>>());
    let verdict = |engine: &dyn EngineFactory| {
        let mut all = Verdict::default();
        match &tried {
            Ok(tried) => tried.iter().for_each(|tried| all.merge(tried.verdict(engine).0)),
            Err(words) => all = Verdict::failed(words.clone()),
        }
        all
    };
    evaluators.iter().map(|evaluator| evaluator.engine().map(verdict)).collect()
}

/// A batch, and what an engine may make of it.
struct Tried {
    /// What it is called where it fails.
    what: String,
    batch: LitBatch,
    /// Of each fragment: the value in f64, and how far an engine may be off.
    wanted: Result<Vec<(Rgba, Rgba)>, String>,
}

impl Tried {
    fn new(what: String, batch: LitBatch) -> Self {
        let wanted = wanted(&batch, FEW).and_then(|wanted| finite_slopes(&batch).map(|()| wanted));
        Self { what, batch, wanted }
    }

    /// How an engine does, and of how many fragments it fails: of all where it answers for none, and of one where only
    /// their sum is wrong.
    fn verdict(&self, engine: &dyn EngineFactory) -> (Verdict, usize) {
        let (verdict, failed) = self
            .compared(engine)
            .unwrap_or_else(|words| (Verdict::failed(words), self.batch.fragments.len()));
        let told = |words| format!("{}, {}: {words}", self.what, self.batch.words());
        let failed = failed.max(usize::from(verdict.failure.is_some()));
        (Verdict { failure: verdict.failure.map(told), ..verdict }, failed)
    }

    fn compared(&self, engine: &dyn EngineFactory) -> Result<(Verdict, usize), String> {
        let wanted = self.wanted.as_ref().map_err(Clone::clone)?;
        let (task, point) = task(&self.batch, None);
        let planes = engine.image(&task, &point)?;
        let (mut verdict, mut failed) = (Verdict::default(), 0);
        for (slot, wanted) in wanted.iter().enumerate() {
            let got = [0, 1, 2, 3].map(|c: usize| f64::from(planes[c][slot]));
            let mut own = one(&got, wanted, engine.slack(), slot);
            if own.failure.is_some() && got.iter().all(|x| x.is_finite()) {
                // Few moves may have missed the worst.
                let alone = self.batch.alone(slot);
                own = one(&got, &self::wanted(&alone, MANY)?[0], engine.slack(), slot);
            }
            failed += usize::from(own.failure.is_some());
            verdict.merge(own);
        }
        engine.with(&task, &point, &mut |engine| {
            let (loss, gradient) = engine.gradient(&point);
            let named = task.unknowns.iter().map(Unknown::name).zip(gradient);
            for (name, x) in [("loss".to_owned(), loss)].into_iter().chain(named) {
                if !x.is_finite() && verdict.failure.is_none() {
                    verdict.failure = Some(format!("{name}, or its derivative, is {x}"));
                }
            }
        })?;
        Ok((verdict, failed))
    }
}

/// A fragment's colour beside what is wanted.
fn one(got: &Rgba, (want, allowed): &(Rgba, Rgba), slack: f64, slot: usize) -> Verdict {
    let mut verdict = Verdict::default();
    for c in 0..4 {
        let number = Number { got: got[c], want: want[c], allowed: slack * allowed[c], size: 0.0 };
        verdict.note(number, Some(slot), || {
            format!("fragment {slot}, {}", ["red", "green", "blue", "alpha"][c])
        });
    }
    verdict
}

/// What an engine is asked: the batch as it is, or with every number moved.
fn task(batch: &LitBatch, moves: Option<&mut Moves<'_>>) -> (Task, Point) {
    let (fragments, params) = match moves {
        None => (batch.fragments.clone(), batch.params.clone()),
        Some(moves) => batch.moved(moves),
    };
    let task = Task {
        setup: batch.setup,
        illumination: Arc::clone(&batch.light),
        views: Arc::new([view(batch, &fragments)]),
        loss: batch.loss,
        unknowns: free(batch),
    };
    (task, Point { params, gains: vec![Gain::ONE] })
}

/// Every parameter that a fit may move, tied.
fn free(batch: &LitBatch) -> Vec<Unknown> {
    let moves = |param: &Param| !param.info().held && param.asked_for(batch.setup.effects);
    Param::all().filter(moves).map(|param| Unknown::Param(Column::tied(param))).collect()
}

fn view(batch: &LitBatch, fragments: &[LitFragment]) -> ObservedView {
    let groups = fragments.len().div_ceil(crate::samples::LANES);
    let (surface, pixel, coverage) = batch.records(fragments, groups);
    let weight = weights(&coverage);
    let group_start = (0..=groups as u32).collect();
    let samples = ViewSamples { group_start, surface, pixel, coverage, ..ViewSamples::default() };
    ObservedView { samples, target: targets(&TARGET, groups), weight, clip: None }
}

/// Each fragment in f64, and how far rounding may move it.
fn wanted(batch: &LitBatch, moves: usize) -> Result<Vec<(Rgba, Rgba)>, String> {
    let mut rng = StdRng::seed_from_u64(2);
    let moved = (0..moves).map(|number| task(batch, Some(&mut Moves::new(&mut rng, number))));
    let (all, points): (Vec<Task>, Vec<Point>) = std::iter::once(task(batch, None)).chain(moved).unzip();
    let views: Vec<ObservedView> = all.iter().flat_map(|task| task.views.iter().cloned()).collect();
    let exact = Reference::new(batch.setup, &batch.light, &views, batch.loss, &[]);
    let exact = exact.map_err(|error| error.to_string())?;
    // Of every move the blend of texels is rounded anew.
    let mut cubes: Vec<_> = points.iter().map(|point| exact.cubes(&point.params)).collect();
    for (number, cubes) in cubes.iter_mut().enumerate().skip(1) {
        let mut texels = Moves::new(&mut rng, number);
        *cubes = cubes.changed(|x| texels.texel(x));
    }
    let colour = |view: usize, slot, params: &Params| {
        exact.pixel_under(view, slot, params, &cubes[view]).map(|(value, _)| value)
    };
    // Where little is reflected that is the rest of a fit's sums which are as large as where much is: these are rounded.
    let mut mirroring = batch.params.clone();
    for (name, value) in [("f0", 0.2), ("f0_floor", 1.0)] {
        if let Some(param) = Param::from_identifier(name) {
            mirroring.set(param, value);
        }
    }
    // What is reflected does not enter: where hardly anything does, the share's rounding is much of it.
    let mut shared = batch.params.clone();
    if let Some(param) = Param::from_identifier("specular_weight") {
        shared.set_rgb(param, batch.params.rgb(param).map(|x| x * (1.0 + FITTED)));
    }
    let one = |slot: usize| {
        let [value, bright, other] = [&points[0].params, &mirroring, &shared].map(|at| colour(0, slot, at));
        let fitted = |c: usize| FITTED * bright[c].abs() + (other[c] - value[c]).abs();
        let summed: Rgba = std::array::from_fn(|c| SUMMED * value[c].abs() + fitted(c) + TINY);
        let mut allowed = summed;
        for (view, point) in points.iter().enumerate().skip(1) {
            let other = colour(view, slot, &point.params);
            for c in 0..4 {
                allowed[c] = allowed[c].max(LONGER * SPREAD * (other[c] - value[c]).abs() + summed[c]);
            }
        }
        (value, allowed)
    };
    let all: Vec<(Rgba, Rgba)> = (0..batch.fragments.len()).map(one).collect();
    let sound = all.iter().all(|(value, _)| value.iter().all(|x| x.is_finite()));
    if sound { Ok(all) } else { Err("in f64 a colour is not finite".to_owned()) }
}

/// That the model in f64 moves by finite numbers.
fn finite_slopes(batch: &LitBatch) -> Result<(), String> {
    let (task, point) = task(batch, None);
    let exact = Reference::new(task.setup, &task.illumination, &task.views, task.loss, &task.unknowns);
    let (_, gradient) =
        crate::engine::Objective::gradient(&exact.map_err(|error| error.to_string())?, &point);
    match gradient.iter().zip(&task.unknowns).find(|(x, _)| !x.is_finite()) {
        None => Ok(()),
        Some((x, unknown)) => Err(format!("in f64 the gradient by {} is {x}", unknown.name())),
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::FragmentInputs;
    use super::super::objectives::Cpu;
    use super::*;
    use crate::model::choices::SpecularMap;

    /// N.L and N.V below the smallest normal f32 are divided by what vanishes with them.
    #[test]
    fn light_and_eye_that_both_graze() {
        let (probes, lights) = (Probes::new().unwrap(), LightBox::new(None));
        let level = FragmentInputs {
            texel: [0.5, 0.5, 1.0],
            normal: [0.0, 1.0, f64::from(1e-40_f32)],
            view: [1.0, 0.0, -0.7628754377365112],
            ..FragmentInputs::ORDINARY
        };
        let toward = [-0.795_059_56, 0.0, 0.606_531_3];
        for model in SpecularModel::ALL {
            let batch = LitBatch::beside_lamps(&probes, &lights, (model, level, toward));
            let (verdict, failed) = Tried::new(String::new(), batch).verdict(&Cpu);
            assert_eq!((failed, verdict.failure), (0, None), "{model:?}");
        }
    }

    /// Where the light comes from beyond, H.V' is what rounding leaves; with f0 = 0 a dielectric's reflectance would rise
    /// to 1 as soon as f0 leaves 0.
    #[test]
    fn light_opposite_to_the_eye() {
        let (probes, lights) = (Probes::new().unwrap(), LightBox::new(None));
        let level = FragmentInputs {
            texel: [0.5, 0.5, 1.0],
            normal: [0.0, 1.0, 0.0],
            view: [0.6993556618690491, -8.835468179313466e-5, -0.7147738337516785],
            specular: 0.0,
            ..FragmentInputs::ORDINARY
        };
        let toward = [0.699_355_66, 8.835_468e-5, -0.714_773_83];
        for model in SpecularModel::ALL {
            let mut batch = LitBatch::beside_lamps(&probes, &lights, (model, level, toward));
            batch.setup.choices.specular_map = SpecularMap::F0;
            for (name, value) in [("f0_floor", 0.0), ("roughness", 0.05)] {
                batch.params.set(Param::from_identifier(name).unwrap(), value);
            }
            let (verdict, failed) = Tried::new(String::new(), batch).verdict(&Cpu);
            assert_eq!((failed, verdict.failure), (0, None), "{model:?}");
        }
    }
}

//! Random batches of what lights, their mirror images and the sky bring (MODEL 8 to 10), under random named choices:
//! each engine's image must be that of the model in f64, as near as rounding explains, and its loss and gradient
//! finite.
//!
//! The other search holds every derivative against f64; these are held so by finite differences in the tests. Batches of what
//! files declare ([`super::declared`]) have the derivatives of the files' parameters held against f64, too.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rayon::prelude::*;

use super::check::Verdict;
use super::engine_factory::EngineFactory;
use super::evaluate::Evaluators;
use super::hard::HardLight;
use super::lights::LightBox;
use super::lit_case::{LitBatch, Probes};
use super::search::Tally;
use super::tried::Tried;
use crate::model::choices::SpecularModel;

/// Fragments in a batch: each takes a plan of its own, which is most of its time.
const BATCH: usize = 64;
/// Cases of the other search for each of these batches.
pub(super) const CASES: usize = 250;

/// Most batches: a long search of the other kind is not to take hours of this one.
const MOST: usize = 1024;

/// How many batches stand beside `cases` cases of the other search.
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
    let probes = match Probes::new() {
        Ok(probes) => probes,
        Err(error) => {
            let failed = Tally { failed: 1, worst: Verdict::failed(error.to_string()), tried: 1 };
            return vec![failed; evaluators.count()];
        }
    };
    let batch = |index: usize| {
        let mut rng = StdRng::seed_from_u64(seed ^ 0x11 ^ (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let batch = LitBatch::random(&probes, lights, &mut rng, BATCH);
        Tried::new(format!("batch {index} of lights"), batch)
    };
    let tallies = tallied(evaluators, (batches(cases), usize::MAX), &batch, progress);
    tallies.into_iter().map(|(tally, _)| tally).collect()
}

/// `count` batches on every engine, at most `together` of them held at once; `progress` is told after each. Of each
/// evaluator how it did, and the first batch that failed.
pub(super) fn tallied(
    evaluators: &Evaluators,
    (count, together): (usize, usize),
    batch: &(dyn Fn(usize) -> Tried + Sync),
    progress: &(dyn Fn(usize) + Sync),
) -> Vec<(Tally, Option<usize>)> {
    let mut tallies = vec![(Tally::default(), None); evaluators.count()];
    let engines: Vec<_> = evaluators.shared.iter().map(|shared| &**shared).collect();
    let ask = |index: usize| {
        let tried = batch(index);
        let verdicts: Vec<_> =
            engines.iter().map(|shared| shared.engine().map(|engine| tried.verdict(engine))).collect();
        progress(1);
        (index, tried, verdicts)
    };
    for first in (0..count).step_by(together) {
        let all = first..count.min(first.saturating_add(together));
        let tried: Vec<_> = all.into_par_iter().map(ask).collect();
        for (index, tried, verdicts) in tried {
            let own = evaluators.own.iter().map(|own| own.engine().map(|engine| tried.verdict(engine)));
            for ((tally, broken), verdict) in tallies.iter_mut().zip(verdicts.into_iter().chain(own)) {
                let Some((verdict, failed)) = verdict else { continue };
                tally.tried += tried.batch.fragments.len();
                tally.failed += failed;
                *broken = broken.or(verdict.failure.is_some().then_some(index));
                tally.worst.merge(verdict);
            }
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

#[cfg(test)]
mod tests {
    use super::super::case::FragmentInputs;
    use super::super::objectives::Cpu;
    use super::*;
    use crate::model::choices::SpecularMap;
    use crate::model::params::Param;

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

//! The random search: batches on every evaluator, and what fails made as simple as it stays failing.

use rayon::prelude::*;

use super::case::{Batch, FragmentInputs, Setting};
use super::check::{Verdict, check, check_against};
use super::evaluate::{Evaluator, Evaluators};
use super::lights::{LightBox, LightKind};
use super::random::{BATCH, batch};
use super::reference::{FEW, Reference};
use crate::model::effects::{Form, Silhouette};
use crate::model::params::Param;
use crate::program::shading::ShadingError;
use crate::scene::Loss;

/// A new hard case.
#[derive(Clone, Debug)]
pub struct Found {
    /// The evaluator that fails it.
    pub evaluator: String,
    /// In what way.
    pub failure: String,
    /// The case, as simple as it could be made.
    pub batch: Batch,
}

/// How an evaluator did in a number of cases.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Fragments tried.
    pub tried: usize,
    /// Failed ones among them, at least: a batch counts as one where only its sum is wrong, and where enough is known
    /// of an evaluator already.
    pub failed: usize,
    /// The worst of all.
    pub worst: Verdict,
}

impl Tally {
    /// Both together.
    pub fn merge(&mut self, other: &Self) {
        self.tried += other.tried;
        self.failed += other.failed;
        self.worst.merge(other.worst.clone());
    }
}

/// Failing cases that are kept of each evaluator: more of them would mostly say the same.
const KEPT: usize = 10;

/// A search, and what it finds of each evaluator.
pub struct Hunt<'a> {
    evaluators: &'a Evaluators,
    lights: &'a LightBox,
    /// In the order of the evaluators.
    pub tallies: Vec<Tally>,
    /// What failed.
    pub found: Vec<Found>,
}

/// A batch that the shared evaluators have answered.
struct Tried {
    batch: Batch,
    reference: Result<Reference, ShadingError>,
    verdicts: Vec<Verdict>,
}

impl<'a> Hunt<'a> {
    /// Nothing tried yet.
    #[must_use]
    pub fn new(evaluators: &'a Evaluators, lights: &'a LightBox) -> Self {
        let tallies = vec![Tally::default(); evaluators.count()];
        Self { evaluators, lights, tallies, found: Vec::new() }
    }

    /// Try `cases` random fragments on every evaluator; `progress` is told how many more are done.
    pub fn random(&mut self, seed: u64, cases: usize, progress: &(dyn Fn(usize) + Sync)) {
        let (evaluators, lights) = (self.evaluators, self.lights);
        let shared = &evaluators.shared;
        let count = |index: usize| BATCH.min(cases - index * BATCH);
        // Others have all of their work still before them when the shared ones are done.
        let alone = evaluators.own.is_empty();
        let ask = |index: usize| {
            let tried = Tried::new(shared, lights, batch(seed, index as u64, count(index)));
            if alone {
                progress(count(index));
            }
            tried
        };
        // As many at a time as there are threads, so that there is a bound on what is held of them; then each in its
        // turn, as what is kept of a failing one depends on those before it.
        let (batches, threads) = (cases.div_ceil(BATCH), rayon::current_num_threads());
        for first in (0..batches).step_by(threads) {
            let together = first..batches.min(first + threads);
            let tried: Vec<Tried> = together.clone().into_par_iter().map(ask).collect();
            for (index, tried) in together.zip(tried) {
                self.note(tried);
                if !alone {
                    progress(count(index));
                }
            }
        }
    }

    /// Try a batch on every evaluator.
    pub fn batch(&mut self, batch: &Batch) {
        self.note(Tried::new(&self.evaluators.shared, self.lights, batch.clone()));
    }

    /// Ask the other evaluators, too, and take note of all.
    fn note(&mut self, Tried { batch, reference, verdicts }: Tried) {
        let (evaluators, lights) = (self.evaluators, self.lights);
        let ask = |own: &dyn Evaluator| check_against(own, lights, &batch, &[], &reference);
        let own = evaluators.own.iter().map(|own| ask(&**own));
        let verdicts: Vec<Verdict> = verdicts.into_iter().chain(own).collect();
        for (index, (evaluator, verdict)) in evaluators.iter().zip(verdicts).enumerate() {
            let failed = match verdict.failure {
                Some(_) => self.pick_apart(index, evaluator, &batch, &verdict),
                None => 0,
            };
            let tally = &mut self.tallies[index];
            tally.tried += batch.fragments.len();
            tally.failed += failed;
            tally.worst.merge(verdict);
        }
    }

    /// The failing fragments of a batch, each alone; how many there are.
    fn pick_apart(
        &mut self,
        index: usize,
        evaluator: &dyn Evaluator,
        batch: &Batch,
        verdict: &Verdict,
    ) -> usize {
        let lights = self.lights;
        let alone =
            |fragment: &FragmentInputs| Batch { setting: batch.setting.clone(), fragments: vec![*fragment] };
        let name = evaluator.name();
        let room = KEPT.saturating_sub(self.found.iter().filter(|found| found.evaluator == name).count());
        if room == 0 && self.tallies[index].failed > 0 {
            // Enough is known of it; the rest is only counted, a batch as one.
            return 1;
        }
        let mut failed = 0;
        for fragment in &batch.fragments {
            let single = alone(fragment);
            if check(evaluator, lights, &single, &[]).failure.is_none() {
                continue;
            }
            failed += 1;
            if failed <= room {
                let batch = simplify(evaluator, lights, single);
                let failure = check(evaluator, lights, &batch, &[]).failure.unwrap_or_default();
                self.found.push(Found { evaluator: name.clone(), failure, batch });
            }
        }
        if failed == 0 && room > 0 {
            // Only their sum is wrong.
            let failure = verdict.failure.clone().unwrap_or_default();
            self.found.push(Found { evaluator: name, failure, batch: batch.clone() });
        }
        failed.max(1)
    }
}

impl Tried {
    fn new(shared: &[Box<dyn Evaluator + Sync>], lights: &LightBox, batch: Batch) -> Self {
        let reference = Reference::new(lights, &batch, FEW);
        let ask = |evaluator: &dyn Evaluator| check_against(evaluator, lights, &batch, &[], &reference);
        let verdicts = shared.iter().map(|shared| ask(&**shared)).collect();
        Self { batch, reference, verdicts }
    }
}

/// Whatever can be replaced by something ordinary without the failure going away is replaced.
fn simplify(evaluator: &dyn Evaluator, lights: &LightBox, failing: Batch) -> Batch {
    let fails = |batch: &Batch| check(evaluator, lights, batch, &[]).failure.is_some();
    let mut best = failing;
    let attempt = |best: &mut Batch, change: &dyn Fn(&mut Setting, &mut FragmentInputs)| {
        let mut simpler = best.clone();
        change(&mut simpler.setting, &mut simpler.fragments[0]);
        // A NaN is never equal to itself, so that it is compared as text.
        if format!("{simpler:?}") != format!("{best:?}") && fails(&simpler) {
            *best = simpler;
        }
    };
    attempt(&mut best, &|s, _| s.setup.form = Form::Corrected);
    attempt(&mut best, &|s, _| s.setup.silhouette = Silhouette::Fragment);
    attempt(&mut best, &|s, _| s.lights = LightKind::Wavy);
    attempt(&mut best, &|s, _| s.loss = Loss::L2);
    for effect in best.setting.setup.effects.iter() {
        attempt(&mut best, &|s, _| s.setup.effects = s.setup.effects.without(effect));
    }
    for param in Param::built_in() {
        attempt(&mut best, &|s, _| s.params.set(param, param.default(Form::Corrected)));
    }
    type Part = fn(&mut FragmentInputs) -> &mut [f64];
    let parts: [Part; 11] = [
        |f| &mut f.texel,
        |f| &mut f.tangent,
        |f| &mut f.bitangent,
        |f| &mut f.normal,
        |f| &mut f.view,
        |f| std::slice::from_mut(&mut f.occlusion),
        |f| std::slice::from_mut(&mut f.silhouette),
        |f| std::slice::from_mut(&mut f.dapple),
        |f| &mut f.albedo,
        |f| std::slice::from_mut(&mut f.specular),
        |f| std::slice::from_mut(&mut f.attenuator),
    ];
    for part in parts {
        attempt(&mut best, &|_, f| {
            let mut ordinary = FragmentInputs::ORDINARY;
            part(f).copy_from_slice(part(&mut ordinary));
        });
    }
    best
}

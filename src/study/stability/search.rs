//! The random search: batches on every evaluator, and what fails made as simple as it stays failing.

use super::case::{Batch, FragmentInputs, Setting};
use super::check::{Verdict, check, check_against};
use super::evaluate::Evaluator;
use super::lights::{LightBox, LightKind};
use super::random::{BATCH, batch};
use super::reference::{FEW, Reference};
use crate::model::effects::{Form, Silhouette};
use crate::model::params::Param;
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
    /// Fragments (or batches, where only their sum is wrong) that failed.
    pub failed: usize,
    /// The worst of all.
    pub worst: Verdict,
}

/// Failing cases that are kept of each evaluator: more of them would mostly say the same.
const KEPT: usize = 10;

/// What a search finds of each evaluator.
#[derive(Clone, Debug, Default)]
pub struct Hunt {
    /// In the order of the evaluators.
    pub tallies: Vec<Tally>,
    /// What failed.
    pub found: Vec<Found>,
}

impl Hunt {
    /// Nothing tried yet, of that many evaluators.
    #[must_use]
    pub fn new(evaluators: usize) -> Self {
        Self { tallies: vec![Tally::default(); evaluators], found: Vec::new() }
    }

    /// Try `cases` random fragments on every evaluator; `progress` is told how many are done.
    pub fn random(
        &mut self,
        evaluators: &[Box<dyn Evaluator>],
        lights: &LightBox,
        seed: u64,
        cases: usize,
        progress: &mut dyn FnMut(usize),
    ) {
        for index in 0..cases.div_ceil(BATCH) {
            let count = BATCH.min(cases - index * BATCH);
            self.try_batch(evaluators, lights, &batch(seed, index as u64, count));
            progress(index * BATCH + count);
        }
    }

    /// Try a batch on every evaluator.
    pub fn try_batch(&mut self, evaluators: &[Box<dyn Evaluator>], lights: &LightBox, batch: &Batch) {
        let reference = Reference::new(lights, batch, FEW);
        for (index, evaluator) in evaluators.iter().enumerate() {
            let verdict = check_against(&**evaluator, lights, batch, &[], &reference);
            let failed = if verdict.failure.is_some() {
                self.pick_apart(index, &**evaluator, lights, batch, &verdict)
            } else {
                0
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
        lights: &LightBox,
        batch: &Batch,
        verdict: &Verdict,
    ) -> usize {
        let alone = |fragment: &FragmentInputs| Batch { setting: batch.setting, fragments: vec![*fragment] };
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
    for param in Param::all() {
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

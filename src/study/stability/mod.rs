//! Whether every evaluator stays finite and agrees with the model in f64 where that is hard.
//!
//! - [`case`]: the numbers that evaluators are given; [`lights`]: what they look up
//! - [`hard`]: the hard cases of MODEL 7, a declaration each; [`demands`]: those of engines and fits
//! - [`random`]: random cases; [`lit`]: those of lights, their mirror images and the sky; [`scene`]: a scene's own
//!   samples; [`declared`]: what files declare for its effects; [`kept`]: cases kept in files
//! - [`evaluate`]: what an evaluator is; [`plain`]: the model as one, by the [`rules`]; [`objectives`]: engines;
//!   `shader`: the renderer's rules on an adapter
//! - [`mod@reference`]: the model in f64, and how far rounding may move it; `lit_case`, `tried`: what engines alone are given,
//!   and what they may make of it
//! - [`check`]: an answer held against the reference; [`search`]: the search, and failures made simple
//! - [`report`]: what came of it
//!
//! Another engine is studied once it is a [`engine_factory::EngineFactory`] in the list of evaluators.

pub mod case;
pub mod check;
pub mod declared;
pub mod demands;
pub mod engine_factory;
pub mod evaluate;
pub mod hard;
pub mod kept;
pub mod lights;
pub mod lit;
mod lit_case;
pub mod objectives;
pub mod plain;
pub mod random;
pub mod reference;
pub mod report;
pub mod rules;
pub mod scene;
pub mod search;
pub mod shader;
mod tried;

use case::Batch;
use check::{Verdict, check_against, check_frame};
use declared::Declared;
use demands::{Circumstances, DEMANDS};
use evaluate::{Evaluator, Evaluators};
use kept::KeptCase;
use lights::{LightBox, LightKind};
use objectives::{Cpu, EngineEvaluator};
use plain::Plain;
use reference::{FEW, Reference};
use report::Report;
use scene::SweptScene;
use search::Hunt;

use crate::model::choices::SpecularModel;

/// What is studied.
#[derive(Debug)]
pub struct Study {
    /// The lights of cases that are of no scene.
    pub lights: LightBox,
    /// Cases from files.
    pub kept: Vec<KeptCase>,
    /// The scenes whose samples are tried, and in whose light kept cases are that say so.
    pub scenes: Vec<SweptScene>,
    /// What random cases are drawn from.
    pub seed: u64,
    /// How many of them.
    pub cases: usize,
    /// Pixels of the case that sums over many.
    pub pixels: usize,
}

/// The model itself, and the CPU engine.
#[must_use]
pub fn evaluators() -> Evaluators {
    let shared: Vec<Box<dyn Evaluator + Sync>> =
        vec![Box::new(Plain::<f64>::new()), Box::new(Plain::<f32>::new()), Box::new(EngineEvaluator(Cpu))];
    Evaluators { shared, own: Vec::new() }
}

impl Study {
    /// How many steps [`run`](Self::run) tells of.
    #[must_use]
    pub fn steps(&self) -> usize {
        hard::cases().len()
            + hard::frames().len()
            + hard::lights().len()
            + DEMANDS.len()
            + self.kept.iter().map(|case| self.lights_of(case).len()).sum::<usize>()
            + self.scenes.iter().map(|scene| scene.batches.len()).sum::<usize>()
            + self.declared().map(|(_, declared)| declared.batches(self.cases)).sum::<usize>()
            + self.cases
            + lit::batches(self.cases)
    }

    /// Every case on every evaluator; `progress` is told after each, by whichever thread, how many more are done.
    /// The report is the same for any number of threads.
    pub fn run(&self, evaluators: &Evaluators, progress: &(dyn Fn(usize) + Sync)) -> Report {
        let names = evaluators.iter().map(Evaluator::name).collect();
        let mut report = Report::new(names, self.seed);
        for case in hard::cases() {
            let verdicts = verdicts(evaluators, &self.lights, &case.batch, &case.holds);
            report.add((case.name, case.hard), case.batch.fragments.len(), verdicts);
            progress(1);
        }
        for frame in hard::frames() {
            let verdicts = evaluators.iter().map(|evaluator| check_frame(evaluator, frame.vertex)).collect();
            report.add((frame.name, "any unit frame, the same on every evaluator"), 1, verdicts);
            progress(1);
        }
        for case in hard::lights() {
            let verdicts = lit::hard(evaluators, &self.lights, &case);
            report.add((case.name, case.hard), case.places.len() * SpecularModel::ALL.len(), verdicts);
            progress(1);
        }
        let given = Circumstances { lights: &self.lights, pixels: self.pixels };
        for demand in &DEMANDS {
            let engines = evaluators.iter().map(Evaluator::engine);
            let check = |engine| demanded((demand.check)(engine, &given));
            report.add((demand.name, demand.hard), 1, engines.map(|engine| engine.map(check)).collect());
            progress(1);
        }
        for case in &self.kept {
            for (lights, scene) in self.lights_of(case) {
                let verdicts = verdicts(evaluators, lights, &case.batch, &[]);
                let place = scene.map_or_else(String::new, |scene| format!(" (in {scene})"));
                let name = format!("kept: {}{place}", case.name);
                report.add((&name, "found by a search"), case.batch.fragments.len(), verdicts);
                progress(1);
            }
        }
        for scene in &self.scenes {
            let mut swept = Hunt::new(evaluators, &scene.lights);
            for batch in &scene.batches {
                swept.batch(batch);
                progress(1);
            }
            report.add_scene(self.called(scene), swept);
        }
        for (scene, declared) in self.declared() {
            let tallies = declared::search(evaluators, declared, (self.seed, self.cases), progress);
            report.add_declared(self.called(scene), tallies);
        }
        let mut hunt = Hunt::new(evaluators, &self.lights);
        hunt.random(self.seed, self.cases, progress);
        report.lit = lit::search(evaluators, &self.lights, (self.seed, self.cases), progress);
        report.random = hunt.tallies;
        report.found.extend(hunt.found);
        report
    }

    /// The scenes for whose effects files declare parameters.
    fn declared(&self) -> impl Iterator<Item = (&SweptScene, &Declared)> {
        self.scenes.iter().filter_map(|scene| Some((scene, scene.declared.as_ref()?)))
    }

    /// A scene's name, where there are several.
    fn called<'a>(&self, scene: &'a SweptScene) -> Option<&'a str> {
        (self.scenes.len() > 1).then_some(scene.name.as_str())
    }

    /// The lights that a kept case is tried in, and of several scenes the one that they are of.
    fn lights_of(&self, case: &KeptCase) -> Vec<(&LightBox, Option<&str>)> {
        if case.batch.setting.lights != LightKind::Scene || self.scenes.is_empty() {
            return vec![(&self.lights, None)];
        }
        self.scenes.iter().map(|scene| (&scene.lights, self.called(scene))).collect()
    }
}

/// How each evaluator does in a batch.
fn verdicts(
    evaluators: &Evaluators,
    lights: &LightBox,
    batch: &Batch,
    holds: &[hard::Holds],
) -> Vec<Option<Verdict>> {
    let reference = Reference::new(lights, batch, FEW);
    let check = |evaluator: &dyn Evaluator| check_against(evaluator, lights, batch, holds, &reference);
    evaluators.iter().map(|evaluator| Some(check(evaluator))).collect()
}

/// How far an engine is from what is demanded, as a verdict.
fn demanded(met: demands::Met) -> Verdict {
    let (deviation, allowed) = match met {
        Ok(met) => met,
        Err(words) => return Verdict::failed(words),
    };
    let mut verdict = Verdict::default();
    let number = check::Number { got: deviation, want: 0.0, allowed, size: 1.0 };
    verdict.note(number, None, || "the deviation".to_owned());
    verdict
}

#[cfg(test)]
mod tests;

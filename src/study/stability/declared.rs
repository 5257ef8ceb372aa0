//! What files of rules declare for a scene's effects, the scene's own files and the library's: the scene's values over the
//! surfaces of the named hard cases, then each parameter at hard values and all at random ones, over the scene's samples and
//! random surfaces in their places.
//!
//! Which parameters there are, and what may be given for them, is the registry's: nothing is listed here.

use std::path::Path;
use std::sync::Arc;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::engine_factory::EngineFactory;
use super::evaluate::{Evaluator, Evaluators};
use super::hard;
use super::lit;
use super::lit_case::{LitBatch, LitFragment, number};
use super::random;
use super::scene::{fragment, spread};
use super::search::Tally;
use super::tried::Tried;
use crate::bake::Illumination;
use crate::model::effects::Effects;
use crate::model::evaluate::Setup;
use crate::model::fields::Field;
use crate::model::params::{Param, Params};
use crate::model::shares;
use crate::model::terms::TermName;
use crate::prepare::{PrepareError, PrepareOptions, Sampled};
use crate::samples::{Atlas, ViewSamples};
use crate::scene::{Loss, short};
use crate::shader::term::enabled;

/// Fragments in a batch, half of them the scene's.
const BATCH: usize = 64;
/// Nearer to a bound, or to 0, than any value that is meant; its square is nothing to an f32.
const SLIGHT: f64 = 1e-30;

/// A scene's own effects, where files declare parameters of them.
#[derive(Debug)]
pub struct Declared {
    pub(super) setup: Setup,
    /// The scene's.
    pub(super) params: Params,
    pub(super) light: Arc<Illumination>,
    pub(super) atlas: Option<Arc<Atlas>>,
    /// Of which batches are drawn.
    pub(super) samples: Vec<LitFragment>,
}

/// The parameters that files declare for `effects`, but for numbers that scenes give elsewhere.
fn parameters(effects: Effects) -> Vec<Param> {
    Param::of(effects).filter(|param| !param.is_built_in() && !param.info().held).collect()
}

/// Those of files that come with a scene or a program. The library's derivatives are held against f64 by its tests.
fn of_files(effects: Effects) -> Vec<Param> {
    enabled(effects).filter(|term| term.is_by_file()).flat_map(|term| term.params.iter().copied()).collect()
}

/// Whether any of a scene's effects has such parameters.
#[must_use]
pub fn declares(effects: Effects) -> bool {
    !parameters(effects).is_empty()
}

impl Declared {
    /// Bake and sample the scene at `path` under its own effects.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn read(path: &Path, cache: Option<&Path>) -> Result<Self, PrepareError> {
        let cache = cache.map(Path::to_owned);
        let Sampled { baked, samples } =
            Sampled::new(path, &PrepareOptions { cache, ..PrepareOptions::default() })?;
        let (scene, light) = (baked.scene, baked.illumination);
        // Of fragments alone: nothing is interpolated, and S.w is given.
        let setup = Setup {
            lookups: scene.lookups,
            choices: scene.setup().choices,
            ..Setup::new(scene.form, scene.silhouette, scene.effects)
        };
        let atlas = samples.iter().find_map(|view| view.atlas.clone());
        let samples = samples.iter().flat_map(|view| drawn(view, setup)).collect();
        Ok(Self { setup, params: scene.params.clone(), light, atlas, samples })
    }

    /// How many batches [`search`] tries beside `cases` cases of the other search.
    #[must_use]
    pub fn batches(&self, cases: usize) -> usize {
        1 + self.hard().len() + lit::batches(cases)
    }

    /// One parameter after the other at its hard values.
    fn hard(&self) -> Vec<(Param, f64)> {
        let of = |param: Param| hard_values(param).into_iter().map(move |value| (param, value));
        parameters(self.setup.effects).into_iter().flat_map(of).collect()
    }

    /// The parameters of batch `index`: the scene's, then one at a hard value, then random ones.
    fn params(&self, index: usize, rng: &mut StdRng) -> Params {
        let Some(at) = index.checked_sub(1) else { return self.params.clone() };
        let Some(&(param, value)) = self.hard().get(at) else { return self.random(rng) };
        let mut params = self.params.clone();
        params.set(param, value);
        params
    }

    /// Batch `index` of a search.
    fn batch(&self, seed: u64, index: usize) -> LitBatch {
        let mut rng =
            StdRng::seed_from_u64(seed ^ 0xdec ^ (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let params = self.params(index, &mut rng);
        let effects = self.setup.effects;
        let fragments = if index == 0 { self.hard_surfaces(&mut rng) } else { self.drawn(&mut rng) };
        LitBatch {
            setup: self.setup,
            params,
            light: Arc::clone(&self.light),
            // The others are the other search's.
            loss: Loss::L2,
            free: parameters(effects),
            compared: of_files(effects),
            fields: self.setup.needs().fields,
            atlas: self.atlas.clone(),
            fragments,
        }
    }

    /// The surface of each named hard case, in the place of a sample.
    fn hard_surfaces(&self, rng: &mut StdRng) -> Vec<LitFragment> {
        let surfaces = hard::cases().into_iter().flat_map(|case| case.batch.fragments);
        let placed = |surface| Some(self.sample(rng)?.with_surface(self.setup, surface));
        surfaces.filter_map(placed).collect()
    }

    /// Samples, each second one with a random surface.
    fn drawn(&self, rng: &mut StdRng) -> Vec<LitFragment> {
        let one = |k: usize| {
            let sample = self.sample(rng)?;
            let mut random = || sample.with_surface(self.setup, random::fragment(rng));
            Some(if k.is_multiple_of(2) { sample.clone() } else { random() })
        };
        (0..BATCH).filter_map(one).collect()
    }

    fn sample(&self, rng: &mut StdRng) -> Option<&LitFragment> {
        self.samples.get(rng.random_range(0..self.samples.len().max(1)))
    }

    /// Every declared parameter anywhere within its bounds.
    fn random(&self, rng: &mut StdRng) -> Params {
        let mut params = self.params.clone();
        for param in parameters(self.setup.effects) {
            let (lower, upper) = param.info().range();
            let mut draw = || number(param, self.setup.form, rng).clamp(lower, upper);
            let rgb = if param.info().rgb { [draw(), draw(), draw()] } else { [draw(); 3] };
            params.set_rgb(param, rgb);
        }
        shares::share_out(&mut params, self.setup.effects);
        params
    }

    fn tried(&self, batch: LitBatch) -> Tried {
        let moved = |param: &Param| batch.params.rgb(*param) != self.params.rgb(*param);
        let told = |param: Param| {
            let [r, g, b] = batch.params.rgb(param);
            let rgb = if r == g && g == b { short(r) } else { [r, g, b].map(short).join(" ") };
            let of = param.info().effects.iter().filter(|effect| batch.setup.effects.has(**effect));
            let of: Vec<&str> = of.map(|effect| effect.name()).collect();
            format!("{} = {rgb} of {}", param.name(), of.join(" and "))
        };
        let all: Vec<String> = parameters(batch.setup.effects).into_iter().filter(moved).map(told).collect();
        let what = if all.is_empty() { "the scene's own values".to_owned() } else { all.join(", ") };
        Tried::new(what, batch)
    }

    /// How an engine fails a batch that was made as simple as it stays failing: parameters are the scene's, and effects are
    /// left out.
    fn simplest(&self, engine: &dyn EngineFactory, failing: LitBatch) -> Option<String> {
        let failure = |batch: &LitBatch| self.tried(batch.clone()).verdict(engine).0.failure;
        let mut best = (failure(&failing), failing);
        let mut attempt = |change: &dyn Fn(&mut LitBatch)| {
            let mut simpler = best.1.clone();
            change(&mut simpler);
            let failed = failure(&simpler);
            if failed.is_some() {
                best = (failed, simpler);
            }
        };
        for param in parameters(self.setup.effects) {
            attempt(&|batch| batch.params.set_rgb(param, self.params.rgb(param)));
        }
        for effect in self.setup.effects.iter() {
            attempt(&|batch| {
                let effects = batch.setup.effects.without(effect);
                // What shows nothing is refused where rules are planned, which is another failure.
                if !TermName::of(effects).is_empty() {
                    batch.setup.effects = effects;
                }
            });
        }
        best.0
    }
}

/// Samples of a view, evenly drawn.
fn drawn(view: &ViewSamples, setup: Setup) -> Vec<LitFragment> {
    let surface = &view.surface;
    let places: Vec<(&str, usize, usize)> = surface.places().fields().collect();
    let field = |field: Field, slot: usize| {
        let neutral = field.info().neutral;
        let held = places.iter().find(|(name, ..)| *name == field.name());
        let component = |c: usize| match held {
            Some(&(_, at, count)) if c < count => surface.rows().number(at + c, slot),
            _ => neutral,
        };
        [0, 1, 2].map(component)
    };
    let one = |slot: usize| {
        let fields = setup.needs().fields.iter().map(|of| field(of, slot)).collect();
        let beside = surface.unmade(slot);
        let place = [beside.uv[0], beside.uv[1], beside.chart];
        LitFragment::new(setup, fragment(&surface.fragment(slot), setup.form), fields, place)
    };
    spread(view).map(one).collect()
}

/// 0, the bounds or what is largest where there are none, and what is next to nothing beside them.
fn hard_values(param: Param) -> Vec<f64> {
    let info = param.info();
    let (lower, upper) = info.range();
    let inside = |bound: f64, toward: f64| bound + toward * (SLIGHT + bound.abs() * f64::from(f32::EPSILON));
    let mut all = Vec::new();
    for value in [0.0, lower, upper, SLIGHT, -SLIGHT, inside(lower, 1.0), inside(upper, -1.0)] {
        if info.admits(value) && !all.contains(&value) {
            all.push(value);
        }
    }
    all
}

/// Every batch on every engine; `progress` is told after each. Tallies are in the order of the evaluators, empty where one
/// is no engine.
#[must_use]
pub fn search(
    evaluators: &Evaluators,
    declared: &Declared,
    (seed, cases): (u64, usize),
    progress: &(dyn Fn(usize) + Sync),
) -> Vec<Tally> {
    // Levels of an atlas are large: one batch's at a time.
    let together = if declared.atlas.is_some() { 1 } else { rayon::current_num_threads() };
    let batch = |index: usize| declared.tried(declared.batch(seed, index));
    let tallies = lit::tallied(evaluators, (declared.batches(cases), together), &batch, progress);
    let simple = |(evaluator, (mut tally, broken)): (&dyn Evaluator, (Tally, Option<usize>))| {
        if let (Some(engine), Some(index)) = (evaluator.engine(), broken) {
            tally.worst.failure = declared.simplest(engine, declared.batch(seed, index));
        }
        tally
    };
    evaluators.iter().zip(tallies).map(simple).collect()
}

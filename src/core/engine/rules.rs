//! The planned rules over stored samples in any kind of number: what engines and renderers are held against, and what
//! shows how number formats round.

use super::cubes_at::{CubesAt, Sixteen};
use super::levels::LevelMaker;
use crate::bake::Illumination;
use crate::model::batch::Batch;
use crate::model::effects::Effects;
use crate::model::evaluate::Setup;
use crate::model::params::Params;
use crate::model::real::Real;
use crate::program::graph::{Graph, Id, Input};
use crate::program::levels::LevelProgram;
use crate::program::shading::constant;
use crate::program::steps::{self, Rounding, Steps};
use crate::samples::rows::Row;
use crate::samples::surface_records::neutral;
use crate::samples::{LANES, SurfaceRecords, ViewSamples};
use crate::shader::PlanError;
use crate::shader::facts::Facts;

/// What rules for stored samples are planned from; `turned`: whether the environment is, or will be. Cubes that are not
/// there count as one dark texel a face.
#[must_use]
pub fn sample_facts(setup: Setup, illumination: &Illumination, turned: bool) -> Facts {
    let mut faces = super::face_sizes(illumination);
    for size in [&mut faces.irradiance, &mut faces.specular, &mut faces.hilite, &mut faces.reflected] {
        size.get_or_insert(1);
    }
    Facts::of_samples(setup, faces, turned)
}

/// Numbers that rules make of stored samples.
#[derive(Debug)]
pub struct SampleSteps {
    steps: Steps,
    levels: LevelMaker<f64>,
}

/// Where a field stands in a record, or what stands in for it.
#[derive(Clone, Copy, Debug)]
enum Load {
    Row(usize),
    /// A row of what was looked up.
    Level(usize),
    Neutral(f32),
}

/// Where a view's records hold what is read of them, and what its samples look up.
#[derive(Clone, Debug)]
pub struct Loads {
    loads: Vec<Load>,
    /// Rows of each record.
    looked_up: Vec<Sixteen<f64>>,
    stride: usize,
}

/// What is the same for all samples of an evaluation.
pub struct Setting<'a, R: Real> {
    shared: steps::Setting<'a, Sixteen<R>>,
    like: Sixteen<R>,
}

/// Memory to work in.
#[derive(Debug)]
pub struct Registers<R: Real>(Vec<Sixteen<R::Wide>>);

impl<R: Real> Default for Registers<R> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl SampleSteps {
    /// What computes `outputs` of a graph whose fields are those of samples, and what `levels` have them look up.
    #[must_use]
    pub fn new(
        graph: &Graph,
        outputs: &[Id],
        levels: LevelProgram,
        rounding: impl Fn(Id) -> Rounding,
    ) -> Self {
        Self { steps: Steps::new(graph, outputs, rounding), levels: LevelMaker::new(levels) }
    }

    /// Where a view's records hold the fields; what its samples look up at `params`, exactly whatever they are evaluated
    /// in.
    #[must_use]
    pub fn loads(&self, samples: &ViewSamples, params: &Params, cubes: &CubesAt<f64>) -> Loads {
        let places = samples.surface.places();
        let held = |input: &Input| places.fields().find(|(name, ..)| *name == input.name);
        let load = |input: &Input| match (held(input), self.levels.row(input)) {
            (Some((_, place, _)), _) => Load::Row(place + input.component),
            (None, Some(row)) => Load::Level(row),
            // Where no smooth normal is held, the base stands in.
            (None, None) if input.name == "normal" => Load::Row(places.base.unwrap_or(0) + input.component),
            (None, None) => Load::Neutral(neutral(&input.name).unwrap_or(0.0)),
        };
        let looked_up = self.levels.look_up(samples, params, || cubes.clone(), Batch);
        let loads = self.steps.fields().iter().map(load).collect();
        Loads { loads, looked_up, stride: self.levels.rows() }
    }

    /// Refuse samples without the texels that `effects` are computed in.
    ///
    /// # Errors
    /// When they lack them.
    pub fn check(&self, effects: Effects, samples: &ViewSamples) -> Result<(), PlanError> {
        self.levels.check(effects, samples)
    }

    /// The setting of an evaluation at `params` in numbers of `like`'s kind.
    #[must_use]
    pub fn setting<'a, R: Real>(
        &self,
        params: &Params,
        cubes: &'a CubesAt<R::Texel>,
        like: R,
    ) -> Setting<'a, R> {
        let like = Batch([like; LANES]);
        let value = |input: &Input| constant(input, params).unwrap_or(0.0);
        Setting { shared: self.steps.setting(like, value, |name| cubes.named(name)), like }
    }

    /// The outputs for the samples of a record.
    #[inline(always)]
    pub fn record<'o, R: Real>(
        &'o self,
        setting: &'o Setting<'_, R>,
        loads: &Loads,
        surface: &SurfaceRecords,
        record: usize,
        registers: &'o mut Registers<R>,
    ) -> impl Iterator<Item = Sixteen<R>> + 'o {
        let rows = surface.rows().record(record);
        let lit = |row: &Row| {
            let mut all = setting.like;
            all.0.iter_mut().zip(row.iter()).for_each(|(lane, &x)| *lane = lane.lit(x.into()));
            all
        };
        let looked_up = &loads.looked_up;
        let field = |at: usize| match loads.loads[at] {
            Load::Row(row) => lit(&rows[row]),
            Load::Level(row) => {
                let mut all = setting.like;
                let numbers = looked_up[record * loads.stride + row].0;
                all.0.iter_mut().zip(numbers).for_each(|(lane, x)| *lane = lane.lit(x));
                all
            }
            Load::Neutral(value) => setting.like.lit(value.into()),
        };
        self.steps.run(&setting.shared, setting.like, &mut registers.0, field);
        self.steps.outputs(&setting.shared, &registers.0)
    }
}

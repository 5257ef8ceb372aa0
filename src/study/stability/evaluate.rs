//! What an evaluator is to the study, and the numbers that the model is evaluated in.

use super::case::{Batch, VertexInputs};
use super::engine_factory::EngineFactory;
use super::lights::LightBox;
use crate::engine::NormalEquations;
use crate::model::params::Param;
use crate::model::real::Real;

/// Red, green, blue, and the haze in alpha.
pub type Rgba = [f64; 4];
/// How the four move with each parameter of the table (all of its channels together).
pub type Slopes = [Rgba; Param::COUNT];
/// N, T and B of a vertex.
pub type Frame = [f64; 9];

/// What an evaluator says of a batch; it leaves out what it does not compute.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// The colour of each fragment.
    pub values: Option<Vec<Rgba>>,
    /// Its derivatives.
    pub slopes: Option<Vec<Slopes>>,
    /// The sums over all fragments against [`TARGET`], for the unknowns of [`unknowns`](super::objectives::unknowns).
    pub sums: Option<Sums>,
}

/// What engines sum.
#[derive(Clone, Debug)]
pub struct Sums {
    /// Loss and normal equations in one pass.
    pub equations: NormalEquations,
    /// The loss of a pass that asks for nothing else.
    pub loss: f64,
    /// The gradient of a pass that asks for no more.
    pub gradient: Vec<f64>,
}

/// What engines compare every fragment with.
pub const TARGET: [f32; 4] = [0.5, 0.25, 0.75, 0.125];

/// Something that computes the model.
pub trait Evaluator {
    /// Its name in tables.
    fn name(&self) -> String;
    /// By how much more than f32's correctly rounded operations its own may be off.
    fn slack(&self) -> f64 {
        1.0
    }
    /// What it makes of a batch.
    ///
    /// # Errors
    /// When it could not run at all, in words.
    fn fragments(&self, lights: &LightBox, batch: &Batch) -> Result<Answer, String>;
    /// The frames of vertices; `None` when it has no vertex stage.
    ///
    /// # Errors
    /// As [`Self::fragments`].
    fn frames(&self, _vertices: &[VertexInputs]) -> Result<Option<Vec<Frame>>, String> {
        Ok(None)
    }
    /// The engine that sums over many pixels, if it is one.
    fn engine(&self) -> Option<&dyn EngineFactory> {
        None
    }
}

/// Evaluators, in the order of the tables: first those that all threads may ask at once.
#[derive(Default)]
pub struct Evaluators {
    /// Those of the CPU.
    pub shared: Vec<Box<dyn Evaluator + Sync>>,
    /// Those that only the thread that made them may ask, as what they run on is its own.
    pub own: Vec<Box<dyn Evaluator>>,
}

impl Evaluators {
    /// Every one.
    pub fn iter(&self) -> impl Iterator<Item = &dyn Evaluator> {
        let shared = self.shared.iter().map(|evaluator| &**evaluator as &dyn Evaluator);
        shared.chain(self.own.iter().map(|evaluator| &**evaluator))
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.shared.len() + self.own.len()
    }
}

/// A plain number that the model is evaluated in.
pub trait Scalar: Real + Send + Sync {
    /// Its name in tables.
    const NAME: &'static str;
    /// Zero, from which constants come.
    const ZERO: Self;
    /// A texel's channel.
    fn texel(x: f32) -> Self::Texel;
    /// The value.
    fn wide(self) -> f64;
}

impl Scalar for f32 {
    const NAME: &'static str = "model f32";
    const ZERO: Self = 0.0;
    fn texel(x: f32) -> f32 {
        x
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Scalar for f64 {
    const NAME: &'static str = "model f64";
    const ZERO: Self = 0.0;
    fn texel(x: f32) -> Self {
        Self::from(x)
    }
    fn wide(self) -> f64 {
        self
    }
}

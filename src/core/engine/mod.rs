//! Loss, gradient and normal equations over samples.
//!
//! - [`Objective`]: all that the solvers see of an engine; [`Engine`]: what else is asked of one, whatever it runs on
//! - [`Task`]: what an engine is to evaluate
//! - [`joint`]: scenes of different light as one objective
//! - [`cpu`]: the engine on the processor
//! - `gram`: columns to products; [`residual`]: the losses; [`pulls`]: where residuals stand in the images
//! - [`lanes`]: f32 lanes as one number; `real_lanes`: its functions; `corners`: its lookups in cubes; `part`: rows of
//!   them, or halves of rows
//! - [`levels`]: what is computed in texels of the UV atlas, and what samples look up of it
//! - [`rules`]: rules over samples in any kind of number; [`mod@reference`]: passes of them in f64, plainly
//! - [`view`]: samples beside what was observed

mod corners;
pub mod cpu;
pub mod cubes_at;
mod gram;
pub mod joint;
pub mod lanes;
pub mod levels;
mod part;
pub mod pulls;
mod real_lanes;
pub mod reference;
pub mod residual;
pub mod rules;
mod task;
pub mod view;

use std::sync::Arc;

pub use self::task::Task;
use self::view::ObservedView;
use crate::model::bounds::Bounds;
use crate::model::gain::Gain;
use crate::model::params::{Channels, Column, Params};

/// Groups of a block of pixels: a coarse pass reads every so-many-th block.
pub const BLOCK: usize = 16;

/// What one pass over the samples yields for a list of free columns at one point.
///
/// With residuals r_i (each weighted, over pixels and channels) the sums are over all i; `jtj` is
/// row-major and symmetric, in the order of the columns.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalEquations {
    /// The loss: mean of the weighted per-residual losses.
    pub loss: f64,
    /// Sum of weights times squared residuals (of a robust loss: its reweighted quadratic).
    pub residual: f64,
    /// Sum of the residuals' weights (the loss' denominator).
    pub weight: f64,
    /// How many residuals have a weight above 0.
    pub count: u64,
    /// J^T r.
    pub jtr: Vec<f64>,
    /// J^T J, K x K.
    pub jtj: Vec<f64>,
}

impl NormalEquations {
    /// The loss and its gradient: the loss is a mean of rho, and J^T r sums d rho / 2.
    #[must_use]
    pub fn loss_and_gradient(&self) -> (f64, Vec<f64>) {
        let factor = if self.weight > 0.0 { 2.0 / self.weight } else { 0.0 };
        (self.loss, self.jtr.iter().map(|x| factor * x).collect())
    }
}

/// Something that can be fitted: the solvers see no more of an engine than this.
pub trait Objective: Sync {
    /// The unknowns, in the order of every vector below: parameters' columns, then gains.
    fn unknowns(&self) -> &[Unknown];
    /// Whether the loss is exactly quadratic in the linear unknowns, as l2 is when no target pixel is clipped: a
    /// solver then knows the loss at other linear unknowns without a
    /// pass. `false` is always safe.
    fn is_quadratic(&self) -> bool {
        false
    }
    /// The sum of weighted squared residuals that the roundings of the engine's numbers may leave at
    /// the best of fits: `sum(w (e t)^2)` over targets t held to within a share e. 0 is for exact
    /// numbers.
    fn rounding(&self) -> f64 {
        0.0
    }
    /// Why passes cannot be made any more, as when a device is lost; what they yielded since is void.
    fn fault(&self) -> Option<String> {
        None
    }
    /// Where the residuals at `point` stand in the images, whose rows have `widths` pixels (a number a view), and how
    /// each tile of them pulls at the unknowns: a pass slower than others, as each tile's sums are
    /// kept apart. `None` where the engine cannot tell.
    fn pulls(&self, _point: &Point, _widths: &[usize]) -> Option<pulls::Pulls> {
        None
    }
    /// Loss and normal equations at `point` (parameters and gains), for all unknowns.
    fn normal_equations(&self, point: &Point) -> NormalEquations;
    /// The loss alone.
    fn loss(&self, point: &Point) -> f64;
    /// The loss and its gradient with respect to the unknowns.
    fn gradient(&self, point: &Point) -> (f64, Vec<f64>);
}

/// An engine over observed views, whatever it runs on.
pub trait Engine: Objective {
    /// `cpu` or `gpu`.
    fn name(&self) -> &'static str;
    /// What it runs on, for a report: names and their values.
    fn provenance(&self) -> Vec<(String, String)>;
    /// The views.
    fn views(&self) -> &Arc<[ObservedView]>;
    /// The views with what their samples show, wherever those were made.
    ///
    /// # Errors
    /// When they cannot be read from where they are: the engine's own error.
    fn surfaced_views(&self) -> Result<Arc<[ObservedView]>, EngineError>;
    /// Surface samples of positive weight, over all views.
    fn samples(&self) -> u64;
    /// Sum of the residuals' weights: what the loss is a mean over, whatever the point.
    fn weight(&self) -> f64;
    /// The seconds that making the samples took, where the engine made them itself.
    fn own_sample_seconds(&self) -> Option<f64> {
        None
    }
    /// Let each pass read only every `stride`-th block of pixels: a coarse fit on a fraction of them.
    fn set_stride(&mut self, stride: usize);
}

/// What went wrong where an engine runs.
pub type EngineError = Box<dyn std::error::Error + Send + Sync>;

/// Half a unit in the last place of an f32, as a share of the number.
const HALF_UNIT: f64 = 1.0 / (1 << 24) as f64;

/// [`Objective::rounding`] of an engine that computes in f32 and reads every `stride`-th block of each view.
pub fn rounding(views: &[ObservedView], loss: crate::scene::Loss, stride: usize) -> f64 {
    use rayon::prelude::*;
    // A fixed number of blocks a sum, so that it does not depend on threads.
    const BLOCKS: usize = 512;
    let residuals = residual::Residuals::new(loss);
    let power = |view: &ObservedView| {
        let groups = view.samples.groups();
        let read: Vec<usize> = (0..groups.div_ceil(BLOCK)).step_by(stride).collect();
        let sums = read.par_chunks(BLOCKS).map(|blocks| {
            let groups = blocks.iter().flat_map(|b| b * BLOCK..groups.min((b + 1) * BLOCK));
            view.power(groups, &residuals)
        });
        sums.collect::<Vec<f64>>().iter().sum::<f64>()
    };
    HALF_UNIT * HALF_UNIT * views.iter().map(power).sum::<f64>()
}

/// The sizes of the cubes that are looked up.
#[must_use]
pub fn face_sizes(illumination: &crate::bake::Illumination) -> crate::shader::facts::FaceSizes {
    use crate::model::cube::Cube;
    let crate::bake::Illumination { irradiance, lobes, hilite, reflected } = illumination;
    let specular = lobes.as_ref().and_then(|stack| stack.cubes.first());
    crate::shader::facts::FaceSizes {
        irradiance: irradiance.as_ref().map(Cube::size),
        specular: specular.map(Cube::size),
        hilite: hilite.as_ref().map(Cube::size),
        reflected: reflected.as_ref().and_then(|stack| stack.stack.cubes.first()).map(Cube::size),
    }
}

/// What a pass over the samples yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PassOutputs {
    /// The loss.
    Loss,
    /// The loss, J^T r and r^T r.
    Gradient,
    /// The loss, J^T J, J^T r and r^T r.
    Normal,
}

/// One unknown of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unknown {
    /// A parameter of the model (tied, or one channel of it).
    Param(Column),
    /// The same in one scene alone, by its number, of several that are fitted as one skin.
    Own(usize, Column),
    /// The gain of a view, by its index, or one channel of it.
    Gain(usize, Channels),
}

/// Where an objective is evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The model's parameters.
    pub params: Params,
    /// A factor on each view's image.
    pub gains: Vec<Gain>,
}

impl Unknown {
    /// The parameter and its channels that it moves; none of a gain.
    #[must_use]
    pub const fn column(&self) -> Option<Column> {
        match self {
            Self::Param(column) | Self::Own(_, column) => Some(*column),
            Self::Gain(..) => None,
        }
    }

    /// This unknown's value at `point`.
    #[must_use]
    pub fn get(&self, point: &Point) -> f64 {
        match self {
            Self::Param(column) => column.get(&point.params),
            Self::Own(scene, column) => column.get_in(*scene, &point.params),
            Self::Gain(view, channels) => channels.of(point.gains[*view].0),
        }
    }

    /// Set this unknown's value at `point`.
    pub fn set(&self, point: &mut Point, value: f64) {
        match self {
            Self::Param(column) => column.set(&mut point.params, value),
            Self::Own(scene, column) => column.set_in(*scene, &mut point.params, value),
            Self::Gain(view, channels) => {
                let Gain(rgb) = point.gains[*view];
                point.gains[*view] = Gain(channels.with(rgb, value));
            }
        }
    }

    /// Whether it moves the gain of a view's channel; what stands after the colours is exposed as green is.
    #[must_use]
    pub fn is_gain_of(&self, view: usize, channel: usize) -> bool {
        let channel = if channel < 3 { channel } else { 1 };
        matches!(self, Self::Gain(of, channels) if *of == view && channels.includes(channel))
    }

    /// Least and greatest allowed value.
    #[must_use]
    pub fn bounds(&self) -> (f64, f64) {
        match self {
            Self::Param(column) | Self::Own(_, column) => {
                (column.param.info().lower, column.param.info().upper)
            }
            // A gain of 0 would explain any image by darkness.
            Self::Gain(..) => (1e-3, 1e3),
        }
    }

    /// The same within what scenes set (one for each, or none); those of the first are the skin's.
    #[must_use]
    pub fn bounds_within(&self, scenes: &[Bounds]) -> (f64, f64) {
        let of = |scene: usize, column: &Column| scenes.get(scene).map(|bounds| bounds.of(column.param));
        let own = match self {
            Self::Param(column) => of(0, column),
            Self::Own(scene, column) => of(*scene, column),
            Self::Gain(..) => None,
        };
        own.unwrap_or_else(|| self.bounds())
    }

    /// Whether the model is linear in it once the non-linear unknowns are fixed.
    #[must_use]
    pub fn linear(&self) -> bool {
        match self {
            Self::Param(column) | Self::Own(_, column) => column.param.info().linear,
            Self::Gain(..) => false,
        }
    }

    /// The name in reports: scenes and views by their numbers, as `1/environment_rotation` and `gain.2`, of a channel `gain.2.r`.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Param(column) => column.name(),
            Self::Own(scene, column) => format!("{scene}/{}", column.name()),
            Self::Gain(view, channels) => format!("gain.{view}{}", channels.suffix()),
        }
    }
}

//! What is done with what a pass over stored texels computes of each.

use crate::shader::atlas::Axis;

/// What a pass does with what its steps yield of a texel.
#[derive(Clone, Debug)]
pub enum Then {
    /// It leaves that.
    Leave,
    /// One direction of a blur, whose taps the steps yield.
    Blur(BlurOf),
    /// One direction of a blur by a Gaussian, of several levels at once.
    Gaussian(GaussianOf),
    /// A sum over the surface; the steps yield the variance, and how that moves.
    Surface(SurfaceOf),
    /// It leaves that; how far each texel's neighbours lie apart, by what a level holds, is the steps' field
    /// `APART_FIELD`.
    Neighbours(String),
}

/// One direction of a blur by taps.
#[derive(Clone, Debug)]
pub struct BlurOf {
    /// Along which axis.
    pub axis: Axis,
    /// Taps to either side, each a place and a weight that the steps yield.
    pub reach: usize,
    /// The level that is blurred.
    pub source: String,
    /// Where the kernel moves: the level that holds how the source moves, if it does.
    pub moving: Option<Option<String>>,
}

/// A sum over the surface: levels by their names.
#[derive(Clone, Debug)]
pub struct SurfaceOf {
    /// What is summed up.
    pub source: String,
    /// Where texels lie, which way they face, and what area they have.
    pub texels: [String; 3],
    /// Where the variance moves: the level that holds how the source moves, if it does.
    pub moving: Option<Option<String>>,
}

/// One direction of a blur by a Gaussian: of a level, and of how that moves. The steps yield the deviation, in texels, and
/// then how it moves along each seed that moves it.
#[derive(Clone, Debug)]
pub struct GaussianOf {
    /// Along which axis.
    pub axis: Axis,
    /// Taps to either side, a deviation apart; `None` where every texel within six deviations counts.
    pub reach: Option<usize>,
    /// What each of the pass' leaves is of. The first is the level itself.
    pub columns: Vec<GaussianColumn>,
}

/// A level that a Gaussian blurs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GaussianColumn {
    /// The level; `None` of one that is 0 everywhere.
    pub source: Option<String>,
    /// Which of the steps' numbers after the deviation is how that moves along the leaf's seed.
    pub moved: Option<usize>,
}

//! What is shaded, and how its cubes' adjoints are added up.

use crate::bake::Illumination;
use crate::model::evaluate::Setup;
use crate::model::params::{Column, Params};

/// How the adjoints of lookups are added up to those of a cube's texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub enum Scatter {
    /// In whole numbers: the same bits every time.
    #[default]
    Exact,
    /// In floats, in the order in which threads come: about twice as fast where many samples share a texel, and the
    /// last bits vary.
    Fast,
}

/// What is shaded, and which parameters are free.
#[derive(Clone, Copy, Debug)]
pub struct Shaded<'a> {
    /// The switches of the model.
    pub setup: Setup,
    /// The values of the parameters that are not free, and where the free ones start.
    pub params: &'a Params,
    /// The free columns. Through cubes they do not act, which are inputs of their own: `specular_lobe` cannot be one, and
    /// `roughness` and `gloss` move what is not looked up.
    pub columns: &'a [Column],
    /// The cubes to start from.
    pub illumination: &'a Illumination,
}

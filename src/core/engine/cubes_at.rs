//! Cubes of a scene at its constants, as rules look them up, and the numbers of sixteen samples.

use crate::bake::Illumination;
use crate::model::batch::Batch;
use crate::model::cube::Cube;
use crate::model::params::{Param, Params};
use crate::samples::LANES;

/// A number of each of a record's samples.
pub type Sixteen<R> = Batch<R, LANES>;

/// The cubes of a scene at one `specular_lobe`, in texels of a kind.
#[derive(Clone, Debug)]
pub struct CubesAt<T> {
    irradiance: Option<Cube<T>>,
    specular: Option<Cube<T>>,
    specular_slope: Option<Cube<T>>,
    hilite: Option<Cube<T>>,
    dark: Cube<T>,
}

impl<T: Copy> CubesAt<T> {
    /// The cubes at `params`, each number converted.
    #[must_use]
    pub fn new(illumination: &Illumination, params: &Params, texel: impl Fn(f32) -> T) -> Self {
        let converted = |cube: &Cube<f32>| cube.map(|numbers| numbers.map(&texel));
        let stack = illumination.lobes.as_ref();
        let lobe = stack.map(|stack| stack.at(params.scalar(Param::SpecularLobe)));
        Self {
            irradiance: illumination.irradiance.as_ref().map(converted),
            specular: lobe.as_ref().map(|(cube, _)| converted(cube)),
            specular_slope: lobe.as_ref().map(|(_, slope)| converted(slope)),
            hilite: illumination.hilite.as_ref().map(converted),
            ..Self::dark(&texel)
        }
    }

    /// No light.
    #[must_use]
    pub fn dark(texel: impl Fn(f32) -> T) -> Self {
        let dark = Cube::from_fn(1, |_, _, _| [0.0_f32; 4]).map(|numbers| numbers.map(&texel));
        Self { irradiance: None, specular: None, specular_slope: None, hilite: None, dark }
    }

    /// The same cubes, each number changed.
    #[must_use]
    pub fn changed(&self, mut change: impl FnMut(T) -> T) -> Self {
        let change = std::cell::RefCell::new(&mut change);
        let changed = |cube: &Cube<T>| cube.map(|numbers| numbers.map(|x| change.borrow_mut()(x)));
        let of = |cube: &Option<Cube<T>>| cube.as_ref().map(changed);
        Self {
            irradiance: of(&self.irradiance),
            specular: of(&self.specular),
            specular_slope: of(&self.specular_slope),
            hilite: of(&self.hilite),
            dark: self.dark.clone(),
        }
    }

    /// The cube that rules read by that name; one that gives no light where there is none.
    #[must_use]
    pub fn named(&self, name: &str) -> &Cube<T> {
        let cube = match name {
            "irradiance_faces" => &self.irradiance,
            "specular_faces" => &self.specular,
            "specular_slope_faces" => &self.specular_slope,
            "hilite_faces" => &self.hilite,
            _ => &None,
        };
        cube.as_ref().unwrap_or(&self.dark)
    }
}

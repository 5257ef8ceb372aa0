//! Cubes of a scene at its constants, as rules look them up, and the numbers of sixteen samples.

use crate::bake::Illumination;
use crate::bake::stacks::{Content, Stack};
use crate::model::batch::Batch;
use crate::model::cube::Cube;
use crate::model::params::Params;
use crate::samples::LANES;

/// A number of each of a record's samples.
pub type Sixteen<R> = Batch<R, LANES>;

/// The cubes of a scene where its parameters look them up, in texels of a kind.
#[derive(Clone, Debug)]
pub struct CubesAt<T> {
    irradiance: Option<Cube<T>>,
    hilite: Option<Cube<T>>,
    /// A stack's cube, and how it moves.
    stacks: Vec<(Stack, Cube<T>, Cube<T>)>,
    dark: Cube<T>,
}

impl<T: Copy> CubesAt<T> {
    /// The cubes at `params`, each number converted.
    #[must_use]
    pub fn new(illumination: &Illumination, params: &Params, texel: impl Fn(f32) -> T) -> Self {
        let converted = |cube: &Cube<f32>| cube.map(|numbers| numbers.map(&texel));
        let at = |stack: Stack| {
            let (cube, slope) = stack.at(illumination, stack.place(params))?;
            Some((stack, converted(&cube), converted(&slope)))
        };
        Self {
            irradiance: illumination.irradiance.as_ref().map(converted),
            hilite: illumination.hilite.as_ref().map(converted),
            stacks: Stack::ALL.into_iter().filter_map(at).collect(),
            ..Self::dark(&texel)
        }
    }

    /// No light.
    #[must_use]
    pub fn dark(texel: impl Fn(f32) -> T) -> Self {
        let dark = Cube::from_fn(1, |_, _, _| [0.0_f32; 4]).map(|numbers| numbers.map(&texel));
        Self { irradiance: None, hilite: None, stacks: Vec::new(), dark }
    }

    /// The same cubes, each number changed.
    #[must_use]
    pub fn changed(&self, mut change: impl FnMut(T) -> T) -> Self {
        let change = std::cell::RefCell::new(&mut change);
        let changed = |cube: &Cube<T>| cube.map(|numbers| numbers.map(|x| change.borrow_mut()(x)));
        let stacks = self.stacks.iter().map(|(stack, cube, slope)| (*stack, changed(cube), changed(slope)));
        Self {
            irradiance: self.irradiance.as_ref().map(changed),
            hilite: self.hilite.as_ref().map(changed),
            stacks: stacks.collect(),
            dark: self.dark.clone(),
        }
    }

    /// The cube that rules read by that name; one that gives no light where there is none.
    #[must_use]
    pub fn named(&self, name: &str) -> &Cube<T> {
        let cube = match (name, Stack::named(name)) {
            ("irradiance_faces", _) => self.irradiance.as_ref(),
            ("hilite_faces", _) => self.hilite.as_ref(),
            (_, Some((stack, content))) => {
                let found = self.stacks.iter().find(|(of, ..)| *of == stack);
                found.map(|(_, cube, slope)| if content == Content::Light { cube } else { slope })
            }
            _ => None,
        };
        cube.unwrap_or(&self.dark)
    }
}

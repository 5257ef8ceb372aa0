//! The cubes of stacks where parameters last looked them up.

use std::sync::{Arc, Mutex, PoisonError};

use crate::bake::Illumination;
use crate::bake::stacks::{Content, Stack};
use crate::model::cube::Cube;
use crate::model::params::Params;

/// A stack's cube at a place, and how it moves with that.
#[derive(Debug)]
pub(super) struct Lobe {
    place: f64,
    cube: Cube<f32>,
    slope: Cube<f32>,
}

/// A cube of each stack that is baked.
#[derive(Clone, Debug, Default)]
pub(super) struct Lobes([Option<Arc<Lobe>>; Stack::ALL.len()]);

impl Lobes {
    /// Those at `params`; the last ones in `slot` where they stand there, else new ones, left there.
    pub(super) fn at(light: &Illumination, params: &Params, slot: &Mutex<Self>) -> Self {
        let lock = || slot.lock().unwrap_or_else(PoisonError::into_inner);
        // Not while the lock is held: all cores make a cube.
        let mut own = lock().clone();
        for (stack, last) in Stack::ALL.into_iter().zip(&mut own.0) {
            let place = stack.place(params);
            if last.as_ref().is_none_or(|lobe| lobe.place != place) {
                *last = stack.at(light, place).map(|(cube, slope)| Arc::new(Lobe { place, cube, slope }));
            }
        }
        lock().clone_from(&own);
        own
    }

    /// The cube that rules read by that name.
    pub(super) fn named(&self, name: &str) -> Option<&Cube<f32>> {
        let (stack, content) = Stack::named(name)?;
        let lobe = self.0[stack as usize].as_ref()?;
        Some(if content == Content::Light { &lobe.cube } else { &lobe.slope })
    }
}

//! The specular cube of the last exponent.

use std::sync::Arc;

use crate::bake::LobeStack;
use crate::model::cube::Cube;

/// The specular cube at an exponent, and how it moves with that.
#[derive(Debug)]
pub(super) struct Lobe {
    exponent: f64,
    pub(super) cube: Cube<f32>,
    pub(super) slope: Cube<f32>,
}

impl Lobe {
    /// The one in `slot` where its exponent is that; else a new one, left there.
    pub(super) fn at(stack: &LobeStack, exponent: f64, slot: &mut Option<Arc<Self>>) -> Option<Arc<Self>> {
        if let Some(lobe) = slot.as_ref().filter(|lobe| lobe.exponent == exponent) {
            return Some(Arc::clone(lobe));
        }
        let (cube, slope) = stack.at(exponent);
        let lobe = Arc::new(Self { exponent, cube, slope });
        *slot = Some(Arc::clone(&lobe));
        Some(lobe)
    }
}

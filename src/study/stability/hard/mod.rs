//! The hard cases of MODEL 7, a declaration each: what is hard, the numbers, and what must hold.
//!
//! Of fragments: `rims`, `normals`, `lookups`, `bounds`; of vertices: `frames`; of lights and the sky (MODEL 8 to 10): `lights`.

mod bounds;
mod frames;
mod lights;
mod lookups;
mod normals;
mod rims;

pub use frames::{HardFrame, frames};
pub use lights::{HardLight, lights};
pub(super) use lights::{Place, Sky};

use super::case::{Batch, FragmentInputs, Setting};
use crate::model::effects::{Effect, Effects};
use crate::model::params::Param;

/// What must hold beyond finite numbers that agree with f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Holds {
    /// Each fragment's colour is this.
    Value([f64; 4]),
    /// Each fragment's colour is 0 to the bit.
    Zero,
    /// No colour depends on this parameter: the derivative is 0 to the bit.
    Flat(Param),
    /// All fragments of a group of this size have the first one's colour.
    Alike(usize),
}

/// A named case of fragments.
pub struct HardCase {
    /// Its name in tables.
    pub name: &'static str,
    /// What is hard about it.
    pub hard: &'static str,
    /// The fragments.
    pub batch: Batch,
    /// What must hold.
    pub holds: Vec<Holds>,
}

const ORDINARY: FragmentInputs = FragmentInputs::ORDINARY;
/// The normal map says nothing: n is the smooth normal.
const FLAT: FragmentInputs = FragmentInputs { texel: [0.5, 0.5, 1.0], ..ORDINARY };

/// Looked at from the front, so that -V is (0, 0, 1).
const FACING: FragmentInputs = FragmentInputs { view: [0.0, 0.0, -1.0], ..FLAT };

fn with(change: impl FnOnce(&mut Setting)) -> Setting {
    let mut setting = Setting::ordinary();
    change(&mut setting);
    setting
}

fn only(effects: &[Effect]) -> Setting {
    with(|s| s.setup.effects = Effects::of(effects))
}

fn case(
    name: &'static str,
    hard: &'static str,
    setting: Setting,
    fragments: Vec<FragmentInputs>,
    holds: &[Holds],
) -> HardCase {
    HardCase { name, hard, batch: Batch { setting, fragments }, holds: holds.to_vec() }
}

/// Every case of fragments.
#[must_use]
pub fn cases() -> Vec<HardCase> {
    let mut all = rims::rims();
    all.extend(normals::normals());
    all.extend(lookups::lookups());
    all.extend(bounds::bounds());
    all
}

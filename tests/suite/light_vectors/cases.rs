//! Cases of a file as stored samples: a pixel each, of one sample, with parameters of its own.

use std::ops::Range;
use std::sync::Arc;

use skinfit::bake::Illumination;
use skinfit::bake::reflected::ReflectedStack;
use skinfit::model::choices::SpecularModel;
use skinfit::model::cube::{Channel, Cube};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::samples::surface_records::{Asked, NEUTRAL, Unmade, neutral};
use skinfit::samples::{Atlas, LANES, SurfaceRecords, ViewSamples};

/// Cases that one plan of rules shades.
pub(super) struct Cases {
    pub(super) setup: Setup,
    pub(super) environment: Environment,
    /// What the cases' parameters may differ in, and how their images move with it where slopes are wanted.
    pub(super) columns: Vec<Param>,
    /// Whether slopes are wanted.
    pub(super) slopes: bool,
    pub(super) each: Vec<Case>,
    /// Where samples look up what is computed in texels.
    pub(super) atlas: Option<Arc<Atlas>>,
}

/// Light that is the same from everywhere.
#[derive(Clone, Copy, Default)]
pub(super) struct Environment {
    /// E_d.
    pub(super) irradiance: Option<[f64; 3]>,
    /// Whose E_r is 1 at every roughness.
    pub(super) lobe: Option<SpecularModel>,
}

/// One of them.
pub(super) struct Case {
    /// Its number in the file.
    pub(super) at: usize,
    /// How near 32 bits come, where the file says so of the case.
    pub(super) f32_rel: Option<f64>,
    pub(super) params: Params,
    /// What its sample holds, by the rules' names; the rest is neutral.
    pub(super) fields: Vec<(&'static str, Vec<f64>)>,
}

/// What an evaluator makes of a case.
pub(super) struct Shown {
    pub(super) rgb: [f64; 3],
    /// How that moves with each column; what cannot be one there is `None`.
    pub(super) slopes: Vec<Option<[f64; 3]>>,
}

impl Environment {
    /// Texels along a face: two more than a lookup takes.
    const SIZE: usize = 4;

    /// Such a cube.
    pub(super) fn cube<T: Channel>(rgb: [f64; 3], texel: impl Fn(f64) -> T) -> Cube<T> {
        let [r, g, b] = rgb;
        Cube::from_fn(Self::SIZE, |_, _, _| [r, g, b, 0.0].map(&texel))
    }

    /// Its cubes, as they are baked.
    pub(super) fn illumination(&self) -> Illumination {
        let cube = |rgb| Self::cube(rgb, |x| x as f32);
        let reflected = |model| ReflectedStack::new(model, &(0.2..=1.0), 1, |_| cube([1.0; 3]));
        Illumination {
            irradiance: self.irradiance.map(cube),
            reflected: self.lobe.map(reflected),
            ..Illumination::default()
        }
    }
}

impl Case {
    /// A number that its sample holds.
    pub(super) fn number(&self, name: &str, component: usize) -> f64 {
        let held = |name: &str| self.fields.iter().find(|(known, _)| *known == name);
        // A smooth normal that is not given is the base.
        let found = held(name).or_else(|| held("base").filter(|_| name == "normal"));
        found.map(|(_, numbers)| numbers[component]).unwrap_or_else(|| {
            let neutral = neutral(name).unwrap_or_else(|| panic!("a sample has no {name}"));
            f64::from(neutral)
        })
    }
}

impl Cases {
    /// The cases of each view of a fit: where slopes are wanted, a view's gain picks its only one.
    pub(super) fn views(&self) -> Vec<Range<usize>> {
        let count = self.each.len();
        if self.slopes { (0..count).map(|i| i..i + 1).collect() } else { std::iter::once(0..count).collect() }
    }

    /// The view of a case, and its pixel there.
    pub(super) fn place(&self, i: usize) -> (usize, usize) {
        if self.slopes { (i, 0) } else { (0, i) }
    }

    /// Some of them as samples; beyond the last it is repeated, and counts nothing.
    pub(super) fn samples(&self, which: Range<usize>) -> ViewSamples {
        let cases = &self.each[which];
        let groups = cases.len().div_ceil(LANES);
        let slots = groups * LANES;
        let (fields, uv) = (self.setup.needs().fields, self.atlas.is_some());
        let asked = Asked { fields, uv, ..Asked::EVERYTHING };
        let mut surface = SurfaceRecords::new(asked, groups);
        for slot in 0..slots {
            let share = if slot < cases.len() { 1.0 } else { 0.0 };
            surface.set_all(slot, &(NEUTRAL, Unmade::default()), share);
        }
        let places: Vec<_> = surface.places().fields().collect();
        for (name, first, rows) in places {
            for component in 0..rows {
                for (slot, number) in surface.rows_mut().plane_mut(first + component).enumerate() {
                    *number = cases[slot.min(cases.len() - 1)].number(name, component) as f32;
                }
            }
        }
        ViewSamples {
            group_start: (0..=groups as u32).collect(),
            pixel: (0..slots as u32).collect(),
            coverage: vec![1.0; slots],
            surface,
            atlas: self.atlas.clone(),
            ..ViewSamples::default()
        }
    }
}

//! Normal equations in f64, one sample after another and without a shortcut: what the engines are held
//! against. Some hundred times slower than they are.

use rayon::prelude::*;

use super::residual::weighted_residual;
use super::view::ObservedView;
use super::{HALF_UNIT, NormalEquations, Objective, Point, Unknown};
use crate::bake::Illumination;
use crate::model::cube::Cube;
use crate::model::evaluate::{Setup, derivative, shade};
use crate::model::fragment::Fragment;
use crate::model::lights::{Cubes, Lights};
use crate::model::params::{Param, Params};
use crate::model::vector::V3;
use crate::samples::LANES;
use crate::scene::Loss;

/// Half units in the last place by which an engine's f32 value of a pixel may be off, of either sign: some ten
/// operations' roundings, which are independent, lie within their root.
const ROUNDINGS: f64 = 4.0;

/// Pixels of a unit of work; a fixed number, so that sums do not depend on threads.
const CHUNK: usize = 64 * LANES;

/// The plain f64 objective over views.
#[derive(Debug)]
pub struct Reference<'a> {
    setup: Setup,
    illumination: &'a Illumination,
    views: &'a [ObservedView],
    loss: Loss,
    unknowns: Vec<Unknown>,
}

/// Cubes in f64, at one exponent.
struct Wide {
    irradiance: Option<Cube<f64>>,
    specular: Option<Cube<f64>>,
    lobe_slope: Option<Cube<f64>>,
    hilite: Option<Cube<f64>>,
}

/// Value and columns of one pixel's four channels, the gain not applied.
pub type PixelColumns = [(f64, Vec<f64>); 4];

impl<'a> Reference<'a> {
    /// Of the views, for the unknowns.
    #[must_use]
    pub fn new(
        setup: Setup,
        illumination: &'a Illumination,
        views: &'a [ObservedView],
        loss: Loss,
        unknowns: &[Unknown],
    ) -> Self {
        Self { setup, illumination, views, loss, unknowns: unknowns.to_vec() }
    }

    fn cubes(&self, exponent: f64) -> Wide {
        let wide = |cube: &Cube<f32>| cube.map(|texel| texel.map(f64::from));
        let lobe = self.illumination.lobes.as_ref().map(|stack| stack.at(exponent));
        Wide {
            irradiance: self.illumination.irradiance.as_ref().map(wide),
            specular: lobe.as_ref().map(|(cube, _)| wide(cube)),
            lobe_slope: lobe.as_ref().map(|(_, slope)| wide(slope)),
            hilite: self.illumination.hilite.as_ref().map(wide),
        }
    }

    fn lights<'c>(&self, cubes: &'c Wide, params: &Params) -> Lights<'c, f64> {
        let Wide { irradiance, specular, lobe_slope, hilite } = cubes;
        let cubes = Cubes {
            irradiance: irradiance.as_ref(),
            specular: specular.as_ref(),
            lobe_slope: lobe_slope.as_ref(),
            hilite: hilite.as_ref(),
        };
        Lights::new(self.setup, params, cubes, true, 0.0)
    }

    /// Value and columns of one pixel slot of a view: the means over its samples.
    #[must_use]
    pub fn pixel(&self, view: usize, slot: usize, params: &Params) -> PixelColumns {
        let cubes = self.cubes(params.scalar(Param::SpecularLobe));
        self.pixel_in(&self.lights(&cubes, params), &self.views[view], slot, params)
    }

    fn pixel_in(
        &self,
        lights: &Lights<'_, f64>,
        view: &ObservedView,
        slot: usize,
        params: &Params,
    ) -> PixelColumns {
        let mut out: PixelColumns = std::array::from_fn(|_| (0.0, vec![0.0; self.unknowns.len()]));
        let starts = &view.samples.group_start;
        for record in starts[slot / LANES]..starts[slot / LANES + 1] {
            let at = record as usize * LANES + slot % LANES;
            let f = fragment(view, at);
            let share = f64::from(view.samples.surface.weight(at));
            let value = shade(self.setup, lights, &f, params);
            (0..4).for_each(|c| out[c].0 += share * value[c]);
            for (k, unknown) in self.unknowns.iter().enumerate() {
                let Unknown::Param(column) = unknown else { continue };
                if !column.param.asked_for(self.setup.effects) {
                    continue;
                }
                let slope = derivative(self.setup, lights, &f, params, column.param);
                for c in 0..4 {
                    if c == 3 || column.channels.includes(c) {
                        out[c].1[k] += share * slope[c];
                    }
                }
            }
        }
        out
    }

    /// The normal equations, and how far J^T J of an engine that computes in f32 may be from theirs because its
    /// residuals round: relative to the diagonal entries that share row and column.
    ///
    /// A robust loss' reweight w(r) moves with the residual r = model - target, and r rounds as the model's value does,
    /// however small it is. Where w moves by a share p of itself, an entry moves by the sum of p w J_a J_b, which is
    /// at most the root of the same for aa times that for bb (Cauchy and Schwarz): so the greatest of the diagonal's
    /// shares bounds all. J^T r, r^T r and the loss have no such term: w r and rho are as smooth in r as r^2 is.
    #[must_use]
    pub fn with_rounding(&self, point: &Point) -> (NormalEquations, f64) {
        let (sums, moved) = self.all_sums(point);
        let k = self.unknowns.len();
        let shares = (0..k).map(|a| moved[a] / sums.jtj[a * k + a]).filter(|share| share.is_finite());
        let most = shares.fold(0.0, f64::max);
        (sums, most)
    }

    fn all_sums(&self, point: &Point) -> (NormalEquations, Vec<f64>) {
        let cubes = self.cubes(point.params.scalar(Param::SpecularLobe));
        let lights = self.lights(&cubes, &point.params);
        let mut total = (empty(self.unknowns.len()), vec![0.0; self.unknowns.len()]);
        for (index, view) in self.views.iter().enumerate() {
            let slots = view.samples.groups() * LANES;
            let chunks: Vec<(NormalEquations, Vec<f64>)> = (0..slots.div_ceil(CHUNK))
                .into_par_iter()
                .map(|chunk| self.sums(index, chunk * CHUNK..slots.min((chunk + 1) * CHUNK), &lights, point))
                .collect();
            for (chunk, moved) in &chunks {
                add(&mut total.0, chunk);
                total.1.iter_mut().zip(moved).for_each(|(a, b)| *a += b);
            }
        }
        if total.0.weight > 0.0 {
            total.0.loss /= total.0.weight;
        }
        total
    }

    /// The sums over some of a view's pixels, the loss not yet divided by the weight; and for each unknown by how much
    /// its entry on the diagonal of J^T J may move with the residuals' roundings.
    fn sums(
        &self,
        view: usize,
        slots: std::ops::Range<usize>,
        lights: &Lights<'_, f64>,
        point: &Point,
    ) -> (NormalEquations, Vec<f64>) {
        let (k, observed, gain) = (self.unknowns.len(), &self.views[view], point.gains[view]);
        let (mut sums, mut moved) = (empty(k), vec![0.0; k]);
        for slot in slots {
            let pixel = self.pixel_in(lights, observed, slot, &point.params);
            let weight = f64::from(observed.pixel_weight(slot));
            for (c, (value, mut row)) in pixel.into_iter().enumerate().take(observed.target.stride()) {
                let target = f64::from(observed.target.number(c, slot));
                row.iter_mut().for_each(|x| *x *= gain);
                if let Some(g) = self.unknowns.iter().position(|u| *u == Unknown::Gain(view)) {
                    row[g] = value;
                }
                let at = |model: f64| weighted_residual(self.loss, observed.clip, model, target, weight);
                let (model, r) = (gain * value, at(gain * value));
                let off = ROUNDINGS * HALF_UNIT * model.abs();
                let by = |model: f64| (at(model).scale.powi(2) - r.scale.powi(2)).abs();
                let reweighted = by(model + off).max(by(model - off));
                sums.loss += r.loss;
                sums.residual += r.residual * r.residual;
                sums.weight += weight;
                sums.count += u64::from(weight > 0.0);
                for a in 0..k {
                    moved[a] += reweighted * row[a] * row[a];
                    sums.jtr[a] += r.scale * row[a] * r.residual;
                    for b in 0..k {
                        sums.jtj[a * k + b] += r.scale * row[a] * r.scale * row[b];
                    }
                }
            }
        }
        (sums, moved)
    }
}

impl Objective for Reference<'_> {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn normal_equations(&self, point: &Point) -> NormalEquations {
        self.all_sums(point).0
    }

    fn loss(&self, point: &Point) -> f64 {
        self.normal_equations(point).loss
    }

    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        let sums = self.normal_equations(point);
        (sums.loss, sums.jtr.iter().map(|x| 2.0 * x / sums.weight).collect())
    }
}

fn empty(k: usize) -> NormalEquations {
    NormalEquations {
        loss: 0.0,
        residual: 0.0,
        weight: 0.0,
        count: 0,
        jtr: vec![0.0; k],
        jtj: vec![0.0; k * k],
    }
}

fn add(total: &mut NormalEquations, part: &NormalEquations) {
    total.loss += part.loss;
    total.residual += part.residual;
    total.weight += part.weight;
    total.count += part.count;
    total.jtr.iter_mut().zip(&part.jtr).for_each(|(a, b)| *a += b);
    total.jtj.iter_mut().zip(&part.jtj).for_each(|(a, b)| *a += b);
}

/// The entry of normal equations that is furthest off.
#[derive(Clone, Debug)]
pub struct Deviation {
    /// Which one, in words.
    pub what: String,
    /// How far, relative to the geometric mean of the diagonal entries that share its row and column.
    pub size: f64,
}

/// How far normal equations are from others of the same unknowns; infinitely where a number is not finite.
#[must_use]
pub fn deviation(got: &NormalEquations, want: &NormalEquations, unknowns: &[Unknown]) -> Deviation {
    let k = unknowns.len();
    let mut worst = Deviation { what: "nothing".to_owned(), size: 0.0 };
    let mut see = |got: f64, want: f64, scale: f64, what: &dyn Fn() -> String| {
        // What is 0 by its nature has to be 0.
        let off = (got - want).abs() / scale.max(f64::MIN_POSITIVE);
        let off = if got == want {
            0.0
        } else if off.is_finite() {
            off
        } else {
            f64::INFINITY
        };
        if off > worst.size {
            worst = Deviation { what: what(), size: off };
        }
    };
    see(got.loss, want.loss, want.loss, &|| "the loss".to_owned());
    see(got.residual, want.residual, want.residual, &|| "r^T r".to_owned());
    for a in 0..k {
        let size = want.jtj[a * k + a].sqrt();
        let name = || format!("J^T r of {}", unknowns[a].name());
        see(got.jtr[a], want.jtr[a], size * want.residual.sqrt(), &name);
        for b in 0..=a {
            let name = || format!("J^T J of {} and {}", unknowns[a].name(), unknowns[b].name());
            let scale = size * want.jtj[b * k + b].sqrt();
            see(got.jtj[a * k + b], want.jtj[a * k + b], scale, &name);
        }
    }
    worst
}

/// A stored sample in f64.
fn fragment(view: &ObservedView, at: usize) -> Fragment<f64> {
    let f = view.samples.surface.fragment(at);
    let wide = |v: V3<f32>| -> V3<f64> { v.map(f64::from) };
    Fragment {
        base: wide(f.base),
        bump: wide(f.bump),
        normal: wide(f.normal),
        view: wide(f.view),
        occlusion: f.occlusion.into(),
        silhouette: f.silhouette.into(),
        dapple: f.dapple.into(),
        albedo: wide(f.albedo),
        specular: f.specular.into(),
        attenuator: f.attenuator.into(),
    }
}

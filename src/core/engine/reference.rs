//! Normal equations in f64, from the rules' own arithmetic: what the engines are held against. Some hundred times
//! slower than they are.

use rayon::prelude::*;

use super::cubes_at::CubesAt;
use super::residual::Residuals;
use super::rules::{Loads, Registers, SampleSteps, Setting, sample_facts};
use super::view::ObservedView;
use super::{HALF_UNIT, NormalEquations, Objective, Point, Unknown};
use crate::bake::Illumination;
use crate::model::batch::Batch;
use crate::model::evaluate::Setup;
use crate::model::gain::Gain;
use crate::model::params::{Param, Params};
use crate::program::lower::Natives;
use crate::program::shading::{Shading, ShadingError};
use crate::program::steps::Rounding;
use crate::samples::LANES;
use crate::scene::Loss;
use crate::shader::tangent::chain::Seed;

/// Half units in the last place by which an engine's f32 value of a pixel may be off, of either sign: some ten
/// operations' roundings, which are independent, lie within their root.
const ROUNDINGS: f64 = 4.0;

/// Groups of pixels of a unit of work; a fixed number, so that sums do not depend on threads.
const CHUNK: usize = 64;

/// The plain f64 objective over views.
#[derive(Debug)]
pub struct Reference<'a> {
    illumination: &'a Illumination,
    views: &'a [ObservedView],
    residuals: Residuals,
    unknowns: Vec<Unknown>,
    /// Yields the value, and how it moves with each of `free`.
    steps: SampleSteps,
    free: Vec<Param>,
}

/// Value and columns of one pixel's four channels, the gain not applied.
pub type PixelColumns = [(f64, Vec<f64>); 4];

/// A view at one point.
struct ViewAt<'a> {
    view: &'a ObservedView,
    setting: &'a Setting<'a, f64>,
    loads: Loads,
}

impl<'a> Reference<'a> {
    /// Of the views, for the unknowns.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn new(
        setup: Setup,
        illumination: &'a Illumination,
        views: &'a [ObservedView],
        loss: Loss,
        unknowns: &[Unknown],
    ) -> Result<Self, ShadingError> {
        let mut free = Vec::new();
        for unknown in unknowns {
            let Unknown::Param(column) = unknown else { continue };
            if column.param.asked_for(setup.effects) && !free.contains(&column.param) {
                free.push(column.param);
            }
        }
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let shading =
            Shading::new(&sample_facts(setup, illumination, true), &seeds, |_| None, Natives::Written)?;
        let outputs = [&[shading.value], &shading.tangents[..]].concat().concat();
        let steps = SampleSteps::new(&shading.graph, &outputs, shading.levels, |_| Rounding::Plain);
        for view in views {
            steps.check(setup.effects, &view.samples).map_err(ShadingError::Plan)?;
        }
        let residuals = Residuals::new(loss);
        Ok(Self { illumination, views, residuals, unknowns: unknowns.to_vec(), steps, free })
    }

    /// What is looked up at some parameters.
    #[must_use]
    pub fn cubes(&self, params: &Params) -> CubesAt<f64> {
        CubesAt::new(self.illumination, params, f64::from)
    }

    fn at<'s>(
        &'s self,
        view: usize,
        setting: &'s Setting<'s, f64>,
        (params, cubes): (&Params, &CubesAt<f64>),
    ) -> ViewAt<'s> {
        let view = &self.views[view];
        ViewAt { view, setting, loads: self.steps.loads(&view.samples, params, cubes) }
    }

    /// Value and columns of one pixel slot of a view: the means over its samples.
    #[must_use]
    pub fn pixel(&self, view: usize, slot: usize, params: &Params) -> PixelColumns {
        let cubes = self.cubes(params);
        let setting = self.steps.setting(params, &cubes, 0.0);
        let at = self.at(view, &setting, (params, &cubes));
        self.group(&at, slot / LANES, &mut Registers::default())[slot % LANES].clone()
    }

    /// Value and columns of every pixel slot of a view, those of padding among them. All cores.
    #[must_use]
    pub fn pixels(&self, view: usize, params: &Params) -> Vec<PixelColumns> {
        self.pixels_under(view, params, &self.cubes(params))
    }

    /// The same under cubes of the caller's, which may be rounded.
    #[must_use]
    pub fn pixels_under(&self, view: usize, params: &Params, cubes: &CubesAt<f64>) -> Vec<PixelColumns> {
        let setting = self.steps.setting(params, cubes, 0.0);
        let at = self.at(view, &setting, (params, cubes));
        let group = |registers: &mut Registers<f64>, group| self.group(&at, group, registers);
        (0..at.view.samples.groups())
            .into_par_iter()
            .map_init(Registers::default, group)
            .flatten_iter()
            .collect()
    }

    /// The pixels of a group.
    fn group(&self, at: &ViewAt<'_>, group: usize, registers: &mut Registers<f64>) -> [PixelColumns; LANES] {
        let nothing = || (0.0, vec![0.0; self.unknowns.len()]);
        let mut pixels: [PixelColumns; LANES] = std::array::from_fn(|_| std::array::from_fn(|_| nothing()));
        let samples = &at.view.samples;
        for record in samples.group_start[group]..samples.group_start[group + 1] {
            let record = record as usize;
            let found = self.steps.record(at.setting, &at.loads, &samples.surface, record, registers);
            let numbers: Vec<_> = found.collect();
            let tangent = |param: Param| self.free.iter().position(|&free| free == param);
            for (lane, pixel) in pixels.iter_mut().enumerate() {
                let share = f64::from(samples.surface.weight(record * LANES + lane));
                for (c, (value, columns)) in pixel.iter_mut().enumerate() {
                    *value += share * numbers[c].0[lane];
                    for (column, unknown) in columns.iter_mut().zip(&self.unknowns) {
                        let Unknown::Param(free) = unknown else { continue };
                        if let Some(k) = tangent(free.param)
                            && (c == 3 || free.channels.includes(c))
                        {
                            *column += share * numbers[4 * (1 + k) + c].0[lane];
                        }
                    }
                }
            }
        }
        pixels
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
        let cubes = self.cubes(&point.params);
        let setting = self.steps.setting(&point.params, &cubes, 0.0);
        let mut total = (empty(self.unknowns.len()), vec![0.0; self.unknowns.len()]);
        for index in 0..self.views.len() {
            let at = self.at(index, &setting, (&point.params, &cubes));
            let groups = at.view.samples.groups();
            let chunks: Vec<(NormalEquations, Vec<f64>)> = (0..groups.div_ceil(CHUNK))
                .into_par_iter()
                .map(|chunk| self.sums(index, &at, chunk * CHUNK..groups.min((chunk + 1) * CHUNK), point))
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

    /// The sums over some of a view's groups, the loss not yet divided by the weight; and for each unknown by how much
    /// its entry on the diagonal of J^T J may move with the residuals' roundings.
    fn sums(
        &self,
        view: usize,
        at: &ViewAt<'_>,
        groups: std::ops::Range<usize>,
        point: &Point,
    ) -> (NormalEquations, Vec<f64>) {
        let k = self.unknowns.len();
        let mut sums = (empty(k), vec![0.0; k]);
        let mut registers = Registers::default();
        for group in groups {
            for (lane, pixel) in self.group(at, group, &mut registers).into_iter().enumerate() {
                self.add_pixel((view, group * LANES + lane), pixel, point.gains[view], &mut sums);
            }
        }
        sums
    }

    /// Add what the pixel at a view's slot counts.
    fn add_pixel(
        &self,
        (view, slot): (usize, usize),
        pixel: PixelColumns,
        gain: Gain,
        (sums, moved): &mut (NormalEquations, Vec<f64>),
    ) {
        let (k, observed) = (self.unknowns.len(), &self.views[view]);
        let weight = f64::from(observed.pixel_weight(slot));
        for (c, (value, mut row)) in pixel.into_iter().enumerate().take(observed.target.stride()) {
            let target = f64::from(observed.target.number(c, slot));
            let gain = gain.channel(c);
            row.iter_mut().for_each(|x| *x *= gain);
            if let Some(g) = self.unknowns.iter().position(|unknown| unknown.is_gain_of(view, c)) {
                row[g] = value;
            }
            let model = gain * value;
            let off = ROUNDINGS * HALF_UNIT * model.abs();
            // As it is, and where its roundings may have put it.
            let [shown, wanted, counted] = [[model, model + off, model - off], [target; 3], [weight; 3]];
            let all = self.residuals.weigh(observed.clip, Batch(shown), Batch(wanted), Batch(counted));
            let (loss, scale, residual) = (all.loss.0[0], all.scale.0[0], all.residual.0[0]);
            let by = |k: usize| (all.scale.0[k].powi(2) - scale.powi(2)).abs();
            let reweighted = by(1).max(by(2));
            sums.loss += loss;
            sums.residual += residual * residual;
            sums.weight += weight;
            sums.count += u64::from(weight > 0.0);
            for a in 0..k {
                moved[a] += reweighted * row[a] * row[a];
                sums.jtr[a] += scale * row[a] * residual;
                for b in 0..k {
                    sums.jtj[a * k + b] += scale * row[a] * scale * row[b];
                }
            }
        }
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
        // Where the reference is exactly 0, so must be what is compared.
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

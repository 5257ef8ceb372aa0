//! A small image of the skin model's structure in f64, with its exact Jacobian: what the solvers are
//! tested on.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use skinfit::engine::pulls::{Pulls, ResidualImage, TILE, Tile};
use skinfit::engine::{NormalEquations, Objective, Point, Unknown};
use skinfit::model::effects::Form;
use skinfit::model::params::{Column, Param, Params};
use skinfit::scene::Loss;

/// What the image holds at one pixel.
#[derive(Clone)]
struct Pixel {
    view: usize,
    weight: f64,
    albedo: [f64; 3],
    irradiance: [f64; 3],
    /// How the irradiance turns with the environment.
    phase: f64,
    specular: f64,
    /// The specular cube's blurred part, and what a sharper lobe adds.
    lobe: [[f64; 3]; 2],
    lobe_middle: f64,
    hilite: [f64; 3],
    dapple: f64,
    silhouette: f64,
    occlusion: f64,
}

/// Pixels, their target, and what is free.
#[derive(Clone)]
pub(super) struct Image {
    pixels: Vec<Pixel>,
    target: Vec<[f64; 3]>,
    pub(super) unknowns: Vec<Unknown>,
    pub(super) loss: Loss,
    /// How much the environment's light looks like itself after a third of a turn.
    pub(super) ripple: f64,
    /// Whether to pass sums on as if they came from 32-bit floats.
    pub(super) single_precision: bool,
    /// Pixels in a row of each view, where they stand in one; pixels take turns between the two views.
    width: Option<usize>,
    passes: std::sync::Arc<AtomicU64>,
}

impl Image {
    /// `count` random pixels over two views; the target is the image at `truth`.
    pub(super) fn new(count: usize, truth: &Point) -> Self {
        let mut rng = StdRng::seed_from_u64(11);
        let pixels = (0..count).map(|i| Pixel::random(i % 2, &mut rng)).collect();
        let mut image = Self {
            pixels,
            target: Vec::new(),
            unknowns: nine(),
            loss: Loss::L2,
            ripple: 0.0,
            single_precision: false,
            width: None,
            passes: Default::default(),
        };
        image.target = image.render(truth);
        image
    }

    /// Two square views of `width` pixels a side, of squares of `side` pixels that are all alike.
    pub(super) fn patched(width: usize, side: usize, truth: &Point) -> Self {
        let across = width / side;
        let patches = Self::new(2 * across * across, truth);
        let of = |i: usize| {
            let (x, y) = (i / 2 % width, i / 2 / width);
            2 * (y / side * across + x / side) + i % 2
        };
        let pixels = (0..2 * width * width).map(|i| patches.pixels[of(i)].clone()).collect();
        let mut image = Self { pixels, width: Some(width), ..patches };
        image.target = image.render(truth);
        image
    }

    /// Independent Gaussian noise of one deviation for each square of `side` pixels, the same all over it.
    pub(super) fn with_patches_of_noise(&self, side: usize, deviation: f64, seed: u64) -> Self {
        let width = self.width.unwrap();
        let noisy = self.with_noise(deviation, seed);
        let first = |i: usize| {
            let (x, y) = (i / 2 % width, i / 2 / width);
            2 * (y / side * side * width + x / side * side) + i % 2
        };
        let moved =
            |i: usize, c: usize| self.target[i][c] + noisy.target[first(i)][c] - self.target[first(i)][c];
        let target = (0..self.target.len()).map(|i| [0, 1, 2].map(|c| moved(i, c))).collect();
        Self { target, ..noisy }
    }

    pub(super) fn with(&self, unknowns: &[Unknown]) -> Self {
        Self { unknowns: unknowns.to_vec(), passes: Default::default(), ..self.clone() }
    }

    pub(super) fn with_loss(&self, loss: Loss) -> Self {
        Self { loss, passes: Default::default(), ..self.clone() }
    }

    /// The same with a target at `truth`.
    pub(super) fn towards(&self, truth: &Point) -> Self {
        Self { target: self.render(truth), passes: Default::default(), ..self.clone() }
    }

    /// Independent Gaussian noise on the target, of variance `deviation^2 / weight`.
    pub(super) fn with_noise(&self, deviation: f64, seed: u64) -> Self {
        let mut noisy = Self { passes: Default::default(), ..self.clone() };
        let mut rng = StdRng::seed_from_u64(seed);
        for (pixel, target) in self.pixels.iter().zip(&mut noisy.target) {
            for value in target {
                // Box and Muller.
                let (u, v): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
                let normal = (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos();
                *value += deviation * normal / pixel.weight.sqrt();
            }
        }
        noisy
    }

    /// Independent Gaussian noise on the target, of deviation `share (value + 0.1) / sqrt(weight)`: as `relative_l2` takes
    /// it to be.
    pub(super) fn with_relative_noise(&self, share: f64, seed: u64) -> Self {
        let mut noisy = self.with_noise(share, seed);
        for (noisy, clean) in noisy.target.iter_mut().flatten().zip(self.target.iter().flatten()) {
            *noisy = clean + (*noisy - clean) * (clean + 0.1);
        }
        noisy
    }

    /// Every `stride`-th target pixel far off.
    pub(super) fn with_outliers(&self, stride: usize, offset: f64) -> Self {
        let mut spoilt = Self { passes: Default::default(), ..self.clone() };
        spoilt.target.iter_mut().step_by(stride).flatten().for_each(|value| *value += offset);
        spoilt
    }

    /// The side-specular map all black.
    pub(super) fn without_specular_map(&self) -> Self {
        let mut dull = Self { passes: Default::default(), ..self.clone() };
        dull.pixels.iter_mut().for_each(|pixel| pixel.specular = 0.0);
        dull
    }

    pub(super) fn passes(&self) -> u64 {
        self.passes.load(Ordering::SeqCst)
    }

    fn render(&self, point: &Point) -> Vec<[f64; 3]> {
        self.pixels.iter().map(|pixel| [0, 1, 2].map(|c| pixel.value(point, c, self.ripple))).collect()
    }

    /// Per residual: the loss, and the weight and residual of its reweighted square.
    fn residual(&self, model: f64, target: f64) -> (f64, f64, f64) {
        let r = model - target;
        match self.loss {
            Loss::L2 => (r * r, 1.0, r),
            Loss::RelativeL2 => {
                // docs/scene-files.md, in the form that does not cancel at small residuals; the images are bright.
                let (p, q) = (model.max(0.0) + 0.1, target.max(0.0) + 0.1);
                let share = (p - q) / (p + q);
                let bright = 2.0 * share * (p - q) / p + 4.0 * (share.atanh() - share);
                let [m, t] = [model, target].map(|x| x.min(0.0));
                let below = 100.0 * (m - t) * (m + t - 2.0 * target) - 2.0 * t * (p - q) / (p * q);
                (bright + below, 1.0 / (p * p), r)
            }
            Loss::Huber => {
                let (delta, size) = (0.05, r.abs());
                if size <= delta {
                    (r * r, 1.0, r)
                } else {
                    (2.0 * delta * size - delta * delta, delta / size, r)
                }
            }
            Loss::Smape => {
                let below = model.abs() + target.abs() + 0.01;
                // The derivative of the loss over 2 r, so that J'r is half the loss' gradient.
                let slope = (below - r * model.signum()) / (below * below);
                (r.abs() / below, 0.5 * slope / r.abs().max(1e-4), r)
            }
        }
    }

    fn sums(&self, point: &Point, unknowns: &[Unknown]) -> NormalEquations {
        self.passes.fetch_add(1, Ordering::SeqCst);
        let k = unknowns.len();
        let mut sums = NormalEquations {
            loss: 0.0,
            residual: 0.0,
            weight: 0.0,
            count: 0,
            jtr: vec![0.0; k],
            jtj: vec![0.0; k * k],
        };
        let round = |x: f64| if self.single_precision { f64::from(x as f32) } else { x };
        for (pixel, target) in self.pixels.iter().zip(&self.target) {
            for c in 0..3 {
                let model = round(pixel.value(point, c, self.ripple));
                let (loss, reweighted, r) = self.residual(model, target[c]);
                let w = pixel.weight * reweighted;
                sums.loss += pixel.weight * loss;
                sums.weight += pixel.weight;
                sums.count += u64::from(pixel.weight > 0.0);
                sums.residual += w * r * r;
                let row: Vec<f64> =
                    unknowns.iter().map(|u| round(pixel.derivative(point, c, u, self.ripple))).collect();
                for i in 0..k {
                    sums.jtr[i] += round(w * r * row[i]);
                    for j in 0..k {
                        sums.jtj[i * k + j] += round(w * row[i] * row[j]);
                    }
                }
            }
        }
        sums.loss /= sums.weight;
        sums
    }
}

impl Objective for Image {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }
    fn is_quadratic(&self) -> bool {
        self.loss == Loss::L2
    }
    fn normal_equations(&self, point: &Point) -> NormalEquations {
        self.sums(point, &self.unknowns)
    }
    fn loss(&self, point: &Point) -> f64 {
        self.sums(point, &[]).loss
    }
    fn pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        let width = self.width?;
        assert_eq!(widths, [width; 2]);
        let mut tiles: BTreeMap<(usize, u32, u32), Vec<f64>> = BTreeMap::new();
        let mut residuals = vec![ResidualImage { width, pixels: vec![None; width * width] }; 2];
        for (i, (pixel, target)) in self.pixels.iter().zip(&self.target).enumerate() {
            let (x, y) = (i / 2 % width, i / 2 / width);
            let place = (pixel.view, (y / TILE) as u32, (x / TILE) as u32);
            let pull = tiles.entry(place).or_insert_with(|| vec![0.0; self.unknowns.len()]);
            let mut shown = [0.0; 4];
            for c in 0..3 {
                let (_, reweighted, r) = self.residual(pixel.value(point, c, self.ripple), target[c]);
                let weight = pixel.weight * reweighted;
                shown[c] = (weight.sqrt() * r) as f32;
                for (sum, unknown) in pull.iter_mut().zip(&self.unknowns) {
                    *sum += weight * r * pixel.derivative(point, c, unknown, self.ripple);
                }
            }
            residuals[pixel.view].pixels[i / 2] = Some(shown);
        }
        let tile = |((view, row, column), pull)| Tile { view, column, row, pull };
        Some(Pulls { residuals, tiles: tiles.into_iter().map(tile).collect() })
    }
    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        let sums = self.sums(point, &self.unknowns);
        (sums.loss, sums.jtr.iter().map(|g| 2.0 * g / sums.weight).collect())
    }
}

/// An image of which a pass says something else: its sums are changed, by where it was made.
pub(super) struct Altered<F> {
    pub(super) image: Image,
    pub(super) alter: F,
}

impl<F: Fn(&Point, &mut NormalEquations) + Sync> Objective for Altered<F> {
    fn unknowns(&self) -> &[Unknown] {
        self.image.unknowns()
    }
    fn is_quadratic(&self) -> bool {
        self.image.is_quadratic()
    }
    fn normal_equations(&self, point: &Point) -> NormalEquations {
        let mut sums = self.image.normal_equations(point);
        (self.alter)(point, &mut sums);
        sums
    }
    fn loss(&self, point: &Point) -> f64 {
        self.normal_equations(point).loss
    }
    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        self.normal_equations(point).loss_and_gradient()
    }
}

impl Pixel {
    fn random(view: usize, rng: &mut StdRng) -> Self {
        let mut rgb = |low: f64, high: f64| [0, 1, 2].map(|_| rng.random_range(low..high));
        let (albedo, irradiance, hilite) = (rgb(0.1, 0.9), rgb(0.3, 1.2), rgb(0.0, 2.0));
        let lobe = [rgb(0.1, 1.0), rgb(-0.5, 3.0)];
        Self {
            view,
            weight: rng.random_range(0.2..1.0),
            albedo,
            irradiance,
            phase: rng.random_range(0.0..std::f64::consts::TAU),
            specular: rng.random_range(0.0..0.5),
            lobe,
            lobe_middle: rng.random_range(10.0..100.0),
            hilite,
            dapple: rng.random_range(0.0..1.0),
            // Most of a surface faces the eye; pixels at exactly 0 and 1 belong to the hard cases.
            silhouette: match rng.random_range(0..50) {
                0 => 0.0,
                1 => 1.0,
                _ => rng.random_range(0.0..1.0_f64),
            },
            occlusion: rng.random_range(0.2..1.0),
        }
    }

    fn rim(&self, point: &Point) -> f64 {
        self.silhouette.powf(point.params.scalar(Param::RimExponent))
    }

    fn open(&self, point: &Point) -> f64 {
        1.0 - point.params.scalar(Param::Occlusion) * (1.0 - self.occlusion)
    }

    fn angle(&self, point: &Point) -> f64 {
        point.params.scalar(Param::EnvironmentRotation).to_radians() + self.phase
    }

    fn diffuse(&self, point: &Point, c: usize, ripple: f64) -> f64 {
        let angle = self.angle(point);
        self.albedo[c] * self.irradiance[c] * (1.0 + 0.5 * angle.cos() + ripple * (3.0 * angle).cos())
    }

    fn lobe(&self, point: &Point, c: usize) -> f64 {
        let exponent = point.params.scalar(Param::SpecularLobe);
        self.lobe[0][c] + self.lobe[1][c] * exponent / (exponent + self.lobe_middle)
    }

    fn term(&self, point: &Point, c: usize, param: Param, ripple: f64) -> f64 {
        let (rim, open) = (self.rim(point), self.open(point));
        match param {
            Param::BaseWeight => self.diffuse(point, c, ripple) * open,
            Param::RimWeight => self.diffuse(point, c, ripple) * open * rim,
            Param::SideSpecular => self.specular * self.lobe(point, c),
            Param::Hilite => open * rim * self.hilite[c],
            Param::Reflection => self.dapple * self.lobe(point, c),
            _ => 0.0,
        }
    }

    fn value(&self, point: &Point, c: usize, ripple: f64) -> f64 {
        let linear =
            [Param::BaseWeight, Param::RimWeight, Param::SideSpecular, Param::Hilite, Param::Reflection];
        let terms = linear.map(|p| point.params.rgb(p)[c] * self.term(point, c, p, ripple));
        point.gains[self.view].channel(c) * terms.iter().sum::<f64>()
    }

    fn derivative(&self, point: &Point, c: usize, unknown: &Unknown, ripple: f64) -> f64 {
        let gain = point.gains[self.view].channel(c);
        let column = match unknown {
            Unknown::Gain(..) if unknown.is_gain_of(self.view, c) => {
                return self.value(point, c, ripple) / gain;
            }
            Unknown::Gain(..) => return 0.0,
            Unknown::Param(column) | Unknown::Own(_, column) => column,
        };
        if !column.channels.includes(c) {
            return 0.0;
        }
        let weight = |p: Param| point.params.rgb(p)[c];
        let diffuse = self.diffuse(point, c, ripple);
        let rims = weight(Param::RimWeight) * diffuse + weight(Param::Hilite) * self.hilite[c];
        let rim = self.rim(point);
        let slope = match column.param {
            Param::RimExponent if self.silhouette > 0.0 => {
                self.open(point) * rims * rim * self.silhouette.ln()
            }
            Param::Occlusion => (self.occlusion - 1.0) * (weight(Param::BaseWeight) * diffuse + rims * rim),
            Param::SpecularLobe => {
                let exponent = point.params.scalar(Param::SpecularLobe);
                let slope = self.lobe[1][c] * self.lobe_middle / (exponent + self.lobe_middle).powi(2);
                slope
                    * (weight(Param::SideSpecular) * self.specular + weight(Param::Reflection) * self.dapple)
            }
            Param::EnvironmentRotation => {
                let angle = self.angle(point);
                let sine = -(0.5 * angle.sin() + 3.0 * ripple * (3.0 * angle).sin()).to_radians();
                let shade = self.open(point) * (weight(Param::BaseWeight) + weight(Param::RimWeight) * rim);
                self.albedo[c] * self.irradiance[c] * sine * shade
            }
            param => self.term(point, c, param, ripple),
        };
        gain * slope
    }
}

pub(super) fn tied(param: Param) -> Unknown {
    Unknown::Param(Column::tied(param))
}

/// The paper's constants but the occlusion's bounds, tied: five linear and four non-linear unknowns.
pub(super) fn nine() -> Vec<Unknown> {
    use Param as P;
    [
        P::BaseWeight,
        P::RimWeight,
        P::RimExponent,
        P::Hilite,
        P::Reflection,
        P::SideSpecular,
        P::Occlusion,
        P::SpecularLobe,
        P::EnvironmentRotation,
    ]
    .map(tied)
    .to_vec()
}

/// The defaults, with `values` set.
pub(super) fn point(values: &[(Param, f64)]) -> Point {
    let mut params = Params::defaults(Form::Corrected);
    for &(param, value) in values {
        params.set(param, value);
    }
    Point { params, gains: vec![1.0.into(), 1.0.into()] }
}

/// Constants that are all away from the defaults and from every bound.
pub(super) fn truth() -> Point {
    point(&[
        (Param::BaseWeight, 0.8),
        (Param::RimWeight, 1.3),
        (Param::RimExponent, 3.2),
        (Param::Hilite, 0.45),
        (Param::Reflection, 0.11),
        (Param::SideSpecular, 0.6),
        (Param::Occlusion, 0.7),
        (Param::SpecularLobe, 70.0),
        (Param::EnvironmentRotation, 12.0),
    ])
}

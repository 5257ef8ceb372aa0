//! The steps that lay a drawn image over a target, at one size.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::Model;
use super::gradients::Gradients;
use super::image::{Picture, reduced_camera};
use super::motion::Motion;
use super::residual::{Colors, Differences, Residual, Weights};
use super::unknowns::{ALONG, COUNT, FOCAL, Pixels};
use crate::scene::view::Camera;

/// The most steps at one size.
const MOST: usize = 24;
/// A step that moves no unknown by more pixels is the last.
const SETTLED: f64 = 0.01;
/// And one further than this is cut short: beyond, images are no lines of the unknowns.
const FARTHEST: f64 = 4.0;
/// Steps that are taken by their slopes alone, once none lowers the loss: coverage counts whole samples, so that near its
/// minimum the loss is rougher than it is curved, while slopes are sums over thousands of borders. Cameras that are known end
/// nearer by them.
const POLISHING: usize = 12;
/// The loss may rise by this share of it in them.
const ROUGHNESS: f64 = 0.01;
/// The damping that is begun with, as a share of each unknown's curvature, and beyond which nothing is tried.
const DAMPING: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e3;
/// What holds the focal length and the distance where images do not tell them apart: a share of the mean curvature. With
/// ten times as much a focal length that is a percent off stays so; with a tenth nothing is nearer.
const HOLD: f64 = 1e-5;

type Curvature = SMatrix<f64, COUNT, COUNT>;
type Gradient = SVector<f64, COUNT>;

/// What was found.
pub(super) struct Found {
    pub(super) camera: Camera,
    /// Whether the last step was small, and not the last that is allowed.
    pub(super) settled: bool,
}

/// A drawn image, and what it and the target differ by.
struct Compared {
    camera: Camera,
    drawn: Picture,
    residual: Residual,
}

/// What cameras are compared by, at one size.
struct Comparison<'a> {
    model: &'a Model<'a>,
    target: &'a Picture,
    side: u32,
    colors: Colors,
}

impl Comparison<'_> {
    /// `None` where the camera sees nothing of the mesh.
    fn of(&self, camera: Camera) -> Option<Compared> {
        let drawn = self.model.draw(&reduced_camera(&camera, self.side))?;
        let residual = Residual::new(&drawn, self.target, self.colors);
        Some(Compared { camera, drawn, residual })
    }

    /// The unknowns of a camera in pixels of this size.
    fn pixels(&self, camera: &Camera) -> Option<Pixels> {
        Pixels::new(&reduced_camera(camera, self.side), self.model.mesh)
    }

    /// The curvature and the gradient of the loss, by how what is seen moves.
    fn normal_equations(&self, here: &Compared, pixels: &Pixels, weights: Weights) -> (Curvature, Gradient) {
        let camera = reduced_camera(&here.camera, self.side);
        let motion = Motion::new(&camera, &self.model.places(&camera), pixels);
        let gradients = Gradients::new(&here.residual, &here.drawn, self.target);
        let weighted = |of: &Differences| of.weighted(weights).collect::<Vec<[f64; 4]>>();
        let column = |unknown: usize| weighted(&gradients.along(|i| motion.at(i, unknown)));
        let columns: Vec<Vec<[f64; 4]>> = (0..COUNT).into_par_iter().map(column).collect();
        let own = weighted(&here.residual.differences);
        let product = |a: &[[f64; 4]], b: &[[f64; 4]]| -> f64 {
            a.iter().zip(b).map(|(a, b)| (0..4).map(|k| a[k] * b[k]).sum::<f64>()).sum()
        };
        let curvature = Curvature::from_fn(|i, j| product(&columns[i.min(j)], &columns[i.max(j)]));
        let gradient = Gradient::from_fn(|i, _| product(&columns[i], &own));
        (curvature, gradient)
    }
}

/// The camera near `start` whose image is nearest to `target`, whose pixels are squares of `side` of the camera's; `None`
/// where it sees nothing of the mesh.
pub(super) fn register(
    start: &Camera,
    target: &Picture,
    (side, colors): (u32, Colors),
    model: &Model<'_>,
) -> Option<Found> {
    let comparison = Comparison { model, target, side, colors };
    let mut here = comparison.of(*start)?;
    let mut damping = DAMPING;
    let mut settled = false;
    for _ in 0..MOST {
        let Some(pixels) = comparison.pixels(&here.camera) else { break };
        let differences = &here.residual.differences;
        let (weights, share) = (differences.weights(), differences.share());
        let (curvature, gradient) = comparison.normal_equations(&here, &pixels, weights);
        let before = differences.loss(weights, share);
        let mut moved = None;
        while damping <= MOST_DAMPING {
            let Some(by) = step(&curvature, &gradient, damping) else { break };
            let lower = |there: &Compared| there.residual.differences.loss(weights, share) < before;
            if let Some(there) = comparison.of(pixels.moved(&here.camera, &by)).filter(lower) {
                moved = Some((by, there));
                damping = (0.1 * damping).max(1e-9);
                break;
            }
            damping *= 10.0;
        }
        let Some((by, there)) = moved else {
            settled = damping > MOST_DAMPING;
            break;
        };
        here = there;
        settled = longest(&by) < SETTLED;
        if settled {
            break;
        }
    }
    if settled {
        here = polished(here, &comparison);
    }
    Some(Found { camera: here.camera, settled })
}

/// The camera after some steps by slopes alone, for as long as they shrink.
fn polished(start: Compared, comparison: &Comparison<'_>) -> Compared {
    let (mut here, mut last) = (start, f64::INFINITY);
    let differences = &here.residual.differences;
    let (weights, share) = (differences.weights(), differences.share());
    let bound = (1.0 + ROUGHNESS) * differences.loss(weights, share);
    for _ in 0..POLISHING {
        let Some(pixels) = comparison.pixels(&here.camera) else { break };
        let (curvature, gradient) = comparison.normal_equations(&here, &pixels, weights);
        let Some(by) = step(&curvature, &gradient, DAMPING) else { break };
        let near = |there: &Compared| there.residual.differences.loss(weights, share) <= bound;
        let Some(there) = comparison.of(pixels.moved(&here.camera, &by)).filter(near) else { break };
        let length = longest(&by);
        if length >= last {
            break;
        }
        (here, last) = (there, length);
        if length < SETTLED {
            break;
        }
    }
    here
}

/// By how many pixels the unknown moves that moves most.
fn longest(by: &[f64; COUNT]) -> f64 {
    by.iter().fold(0.0, |most, pixels| most.max(pixels.abs()))
}

/// The step that the normal equations ask for, damped; `None` where they are not finite.
fn step(curvature: &Curvature, gradient: &Gradient, damping: f64) -> Option<[f64; COUNT]> {
    let mean = curvature.trace() / COUNT as f64;
    let mut damped = *curvature;
    for i in 0..COUNT {
        // An unknown that moves nothing stays.
        damped[(i, i)] += damping * curvature[(i, i)] + 1e-12 * mean + f64::MIN_POSITIVE;
    }
    for i in [ALONG, FOCAL] {
        damped[(i, i)] += HOLD * mean;
    }
    let found = damped.cholesky()?.solve(&-gradient);
    if found.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let most = found.amax();
    let cut = if most > FARTHEST { FARTHEST / most } else { 1.0 };
    Some(std::array::from_fn(|i| cut * found[i]))
}

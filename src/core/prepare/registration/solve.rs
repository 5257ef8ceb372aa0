//! The steps that lay a drawn image over a target, at one size.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::image::{Picture, reduced_camera};
use super::residual::{Colors, Residual, Weights};
use super::unknowns::{ALONG, COUNT, FOCAL, Pixels};
use crate::scene::mesh::PosedMesh;
use crate::scene::view::Camera;

/// To either side of a camera, in pixels, where images are drawn for its derivatives: nearer, what a border covers does
/// not change in most of its pixels.
const STEP: f64 = 0.75;
/// The most steps at one size.
const MOST: usize = 12;
/// A step that moves no unknown by more pixels is the last.
const SETTLED: f64 = 0.01;
/// And one further than this is cut short: beyond, images are no lines of the unknowns.
const FARTHEST: f64 = 4.0;
/// Steps that are taken by their slopes alone, once none lowers the loss: coverage counts whole samples, so that near its
/// minimum the loss is rougher than it is curved, while slopes over some pixels are means over thousands of borders.
const POLISHING: usize = 4;
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

/// The camera near `start` whose image is nearest to `target`, whose pixels are squares of `side` of the camera's; `None`
/// where it sees nothing of the mesh.
pub(super) fn register(
    start: &Camera,
    mesh: &PosedMesh,
    target: &Picture,
    (side, colors): (u32, Colors),
    draw: &(impl Fn(&Camera) -> Option<Picture> + Sync),
) -> Option<Found> {
    let residual = |camera: &Camera| {
        draw(&reduced_camera(camera, side)).map(|drawn| Residual::new(&drawn, target, colors))
    };
    let mut camera = *start;
    let mut here = residual(&camera)?;
    let mut damping = DAMPING;
    let mut settled = false;
    for _ in 0..MOST {
        let weights = here.weights();
        // Steps are in pixels of this size.
        let Some(pixels) = Pixels::new(&reduced_camera(&camera, side), mesh) else { break };
        let (curvature, gradient) =
            normal_equations(&here, weights, &|by| residual(&pixels.moved(&camera, by)));
        let share = here.share();
        let before = here.loss(weights, share);
        let mut moved = None;
        while damping <= MOST_DAMPING {
            let Some(by) = step(&curvature, &gradient, damping) else { break };
            let trial = pixels.moved(&camera, &by);
            let reached = residual(&trial).map(|there| (there.loss(weights, share), there));
            if let Some((_, there)) = reached.filter(|(loss, _)| *loss < before) {
                moved = Some((by, trial, there));
                damping = (0.1 * damping).max(1e-9);
                break;
            }
            damping *= 10.0;
        }
        let Some((by, trial, there)) = moved else {
            settled = damping > MOST_DAMPING;
            break;
        };
        (camera, here) = (trial, there);
        settled = by.iter().all(|pixels| pixels.abs() < SETTLED);
        if settled {
            break;
        }
    }
    if settled {
        camera = polished(camera, here, mesh, side, &residual);
    }
    Some(Found { camera, settled })
}

/// The camera after some steps by slopes alone, for as long as they shrink.
fn polished(
    start: Camera,
    residual_there: Residual,
    mesh: &PosedMesh,
    side: u32,
    residual: &(impl Fn(&Camera) -> Option<Residual> + Sync),
) -> Camera {
    let (mut camera, mut here, mut last) = (start, residual_there, f64::INFINITY);
    let (weights, share) = (here.weights(), here.share());
    let bound = (1.0 + ROUGHNESS) * here.loss(weights, share);
    for _ in 0..POLISHING {
        let Some(pixels) = Pixels::new(&reduced_camera(&camera, side), mesh) else { break };
        let (curvature, gradient) =
            normal_equations(&here, weights, &|by| residual(&pixels.moved(&camera, by)));
        let Some(by) = step(&curvature, &gradient, DAMPING) else { break };
        let length = by.iter().fold(0.0_f64, |most, pixels| most.max(pixels.abs()));
        let trial = pixels.moved(&camera, &by);
        let Some(there) = residual(&trial).filter(|there| there.loss(weights, share) <= bound) else { break };
        if length >= last {
            break;
        }
        (camera, here, last) = (trial, there, length);
        if length < SETTLED {
            break;
        }
    }
    camera
}

/// The curvature and the gradient of the loss, by differences of images.
fn normal_equations(
    here: &Residual,
    weights: Weights,
    residual: &(impl Fn(&[f64; COUNT]) -> Option<Residual> + Sync),
) -> (Curvature, Gradient) {
    let slope = |unknown: usize| {
        let at = |pixels: f64| {
            let mut by = [0.0; COUNT];
            by[unknown] = pixels;
            residual(&by)
        };
        let (ahead, behind) = (at(STEP)?, at(-STEP)?);
        Some(Residual::slope(&ahead, &behind, STEP))
    };
    let slopes: Vec<Option<Residual>> = (0..COUNT).map(slope).collect();
    let weighted = |of: &Residual| of.weighted(weights).collect::<Vec<[f64; 4]>>();
    let columns: Vec<Vec<[f64; 4]>> =
        slopes.par_iter().map(|slope| slope.as_ref().map_or(Vec::new(), weighted)).collect();
    let own = weighted(here);
    let product = |a: &[[f64; 4]], b: &[[f64; 4]]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (0..4).map(|k| a[k] * b[k]).sum::<f64>()).sum()
    };
    let curvature = Curvature::from_fn(|i, j| product(&columns[i], &columns[j]));
    let gradient = Gradient::from_fn(|i, _| product(&columns[i], &own));
    (curvature, gradient)
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

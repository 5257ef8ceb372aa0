//! Terms that are computed in texels of a square's atlas, and samples that look them up.

mod engine;
mod fits;
mod made;
mod seams;

use std::sync::OnceLock;

use glam::{Vec2, Vec3};

use super::*;
use crate::bake::Illumination;
use crate::bake::rays::RayMesh;
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::engine::{Point, Task, Unknown};
use crate::model::effects::Effects;
use crate::model::effects::{Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::gain::Gain;
use crate::model::params::Param;
use crate::model::params::{Column, Params};
use crate::samples::rows::Rows;
use crate::samples::surface_records::{Asked, NEUTRAL, Unmade};
use crate::samples::{LANES, PosedSurface, SurfaceRecords};
use crate::scene::Loss;
use crate::scene::maps::Maps;
use crate::scene::mesh::PosedMesh;
use crate::shader::term::{Term, register};

/// What is added of hills over the atlas, blurred: it is linear in a weight and not in the radius.
const HILLS: &str = "
// gives: hills_part
// adds: hills
// cost: 6
fn hills_shown(hills_soft: vec3f, hills_weight: vec3f, base_weight: vec3f) -> vec3f {
    return hills_weight * hills_soft + 0.1 * base_weight;
}
";

/// Beside a blur that is as wide on the surface as its radius says, of what a parameter moves: a second draw, which reads
/// what was blurred.
const FURROWS: &str = "
// gives: furrows_again
// domain: texel
// sampled: 0
// cost: 3
fn furrows_lit_again(furrows_soft: vec3f, vertex_uv: vec2f) -> vec3f {
    return furrows_soft * furrows_soft * (1.0 + vertex_uv.y);
}

// gives: furrows_part
// adds: furrows
// cost: 1
fn furrows_shown(furrows_soft: vec3f, furrows_again: vec3f) -> vec3f {
    return furrows_soft + 0.5 * furrows_again;
}
";

/// A light map that cubes, their turn, the occlusion and the lobe's exponent move.
const DUNES: &str = "\
// effect: dunes, light of the environment under the surface
// parameter: dunes_radius = 1.3 in [0.1, 30], unit texels; how far it wandered; a test
//
// gives: dunes_light
// domain: texel
// cost: 12
fn dunes_light_map(albedo: vec3f, irradiance: vec3f, side_light: vec3f, occ: f32) -> vec3f {
    return occ * albedo * (irradiance + 0.3 * side_light);
}

// gives: dunes_soft
// domain: texel
// pass: dunes_light: vec3f, 3 taps
// sampled: 0
// cost: 8
fn dunes_kernel(tap: f32, dunes_radius: f32) -> vec2f {
    return vec2f(dunes_radius * tap, exp(-0.5 * tap * tap));
}

// gives: dunes_part
// adds: dunes
// cost: 6
fn dunes_shown(dunes_soft: vec3f, albedo: vec3f) -> vec3f {
    return albedo * dunes_soft;
}
";

fn dunes() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| register("dunes", DUNES).unwrap_or_else(|error| panic!("{error}")))
}

fn hills() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    let text = include_str!("../../../../rules/shader/atlas/tests/hills.wgsl");
    let text = text.replace("NAME", "hills").replace("HILLS", "5.0") + HILLS;
    TERM.get_or_init(|| register("hills", &text).unwrap_or_else(|error| panic!("{error}")))
}

fn furrows() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    let text = include_str!("../../../../rules/shader/atlas/tests/stretched.wgsl").replace("NAME", "furrows")
        + FURROWS;
    TERM.get_or_init(|| register("furrows", &text).unwrap_or_else(|error| panic!("{error}")))
}

fn setup(effects: &[&Term]) -> Setup {
    let effects: Vec<_> = effects.iter().map(|term| term.effect).collect();
    Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&effects))
}

/// Where the square lies in the atlas: no texel's centre is on an edge.
const LOW: f32 = 0.11;
const HIGH: f32 = 0.87;
/// Texels along a side of the atlas.
const SIZE: u32 = 48;

/// A square from -1 to 1, its texture coordinates between LOW and HIGH.
fn square() -> PosedMesh {
    PosedMesh {
        positions: [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
            .map(|[x, y]| Vec3::new(x, y, 0.0))
            .to_vec(),
        normals: [[-0.4, 0.5, 1.0], [0.3, 0.6, 1.0], [0.5, -0.3, 1.0], [-0.6, -0.2, 1.0]]
            .map(|normal| Vec3::from(normal).normalize())
            .to_vec(),
        uvs: [[LOW, LOW], [HIGH, LOW], [HIGH, HIGH], [LOW, HIGH]].map(Vec2::from).to_vec(),
        triangles: vec![[0, 3, 2], [0, 2, 1]],
        ..PosedMesh::default()
    }
}

fn atlas(setup: &Setup) -> Arc<Atlas> {
    let open = [0.2, 0.9, 0.6, 0.4];
    let (mesh, rays) = (square(), RayMesh::new(&[], &[]));
    let surface = PosedSurface::bare(&mesh, &rays, Some(open.to_vec()));
    Arc::new(Atlas::new(setup, &surface, &Maps::default(), SIZE).unwrap())
}

/// Sixteen times sixteen pixels over the square, one sample each, the first of them beyond the chart.
fn samples(atlas: Option<&Arc<Atlas>>) -> ViewSamples {
    let groups = LANES;
    let asked = Asked { uv: atlas.is_some(), ..Asked::default() };
    let mut surface = SurfaceRecords::new(asked, groups);
    for slot in 0..groups * LANES {
        let at = |i: usize| LOW + (HIGH - LOW) * (0.02 + 0.96 * i as f32 / 15.0);
        let uv = if slot == 0 { [0.01, 0.01] } else { [at(slot % LANES), at(slot / LANES)] };
        let facing =
            crate::model::fragment::Fragment { base: [0.0, 0.0, 1.0], view: [0.0, 0.0, -1.0], ..NEUTRAL };
        surface.set_all(slot, &(facing, Unmade { uv, chart: 1.0, ..Unmade::default() }), 1.0);
    }
    ViewSamples {
        group_start: (0..=groups as u32).collect(),
        pixel: (0..(groups * LANES) as u32).collect(),
        coverage: vec![1.0; groups * LANES],
        surface,
        atlas: atlas.cloned(),
        ..ViewSamples::default()
    }
}

fn dark() -> Arc<Illumination> {
    Arc::default()
}

fn start(set: &[(Param, f64)]) -> Point {
    let mut params = Params::defaults(Form::Corrected);
    set.iter().for_each(|&(param, value)| params.set(param, value));
    Point { params, gains: vec![Gain::ONE] }
}

fn free(columns: &[Column]) -> Vec<Unknown> {
    columns.iter().copied().map(Unknown::Param).collect()
}

fn task(setup: Setup, target: Rows, unknowns: Vec<Unknown>) -> Task {
    let view =
        ObservedView { samples: samples(Some(&atlas(&setup))), target, weight: Vec::new(), clip: None };
    Task { setup, illumination: dark(), views: Arc::from([view]), loss: Loss::L2, unknowns }
}

/// An engine whose targets are the model's own image at `truth`.
fn engine_for(setup: Setup, unknowns: Vec<Unknown>, truth: &Point) -> CpuEngine {
    let blank = CpuEngine::new(task(setup, Rows::new(3, LANES), Vec::new())).unwrap();
    let planes = blank.image(0, truth);
    let mut target = Rows::new(3, LANES);
    for (channel, plane) in planes.iter().enumerate() {
        target.plane_mut(channel).zip(plane).for_each(|(target, value)| *target = *value);
    }
    CpuEngine::new(task(setup, target, unknowns)).unwrap()
}

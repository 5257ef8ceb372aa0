use std::sync::OnceLock;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::*;
use crate::bake::rays::RayMesh;
use crate::bake::{Illumination, LobeStack};
use crate::engine::cpu::CpuEngine;
use crate::engine::reference::{Reference, deviation};
use crate::engine::view::ObservedView;
use crate::engine::{NormalEquations, Objective, Point, Task, Unknown};
use crate::fit::{FitOptions, fit};
use crate::model::cube::Cube;
use crate::model::effects::{Effect, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Column, Params};
use crate::program::lower::Natives;
use crate::program::shading::Shading;
use crate::samples::rows::Rows;
use crate::samples::surface_records::{Asked, NEUTRAL, Unmade};
use crate::samples::{PosedSurface, SurfaceRecords};
use crate::scene::Loss;
use crate::scene::maps::Maps;
use crate::scene::mesh::PosedMesh;
use crate::shader::Facts;
use crate::shader::facts::FaceSizes;
use crate::shader::tangent::chain::Seed;
use crate::shader::term::{Term, register};

/// Hills over the atlas, blurred; what is added is linear in a weight and not in the radius.
const HILLS: &str = "\
// effect: hills, light that wanders under the surface
// parameter: hills_weight = 0.5 in [0, inf), rgb, linear; weight of what wandered; a test
// parameter: hills_radius = 1.3 in [0.1, 30], unit texels; how far it wandered; a test
//
// gives: hills_light
// domain: texel
// cost: 12
fn hills_light_map(vertex_uv: vec2f) -> vec3f {
    let within: vec2f = fract(5.0 * vertex_uv);
    return vec3f(4.0 * within * (1.0 - within), vertex_uv.x * vertex_uv.y);
}

// gives: hills_soft
// domain: texel
// pass: hills_light: vec3f, 7 taps
// sampled: 0
// cost: 8
fn hills_kernel(tap: f32, hills_radius: f32) -> vec2f {
    return vec2f(hills_radius * tap, exp(-0.5 * tap * tap));
}

// gives: hills_part
// adds: hills
// cost: 6
fn hills_shown(hills_soft: vec3f, hills_weight: vec3f, base_weight: vec3f) -> vec3f {
    return hills_weight * hills_soft + 0.1 * base_weight;
}
";

/// A blur as wide on the surface as its radius says, of what a parameter moves; a second draw reads what was blurred.
const FURROWS: &str = "\
// effect: furrows, light under a stretched skin
// parameter: furrows_radius = 0.05 in [0.001, 30]; standard deviation, in the scene's unit; a test
// parameter: furrows_depth = 1.5 in [0.1, 10]; exponent of the light map; a test
//
// gives: furrows_light
// domain: texel
// cost: 12
fn furrows_map(vertex_uv: vec2f, furrows_depth: f32) -> vec3f {
    let power: f32 = exp(furrows_depth * log(0.1 + vertex_uv.x));
    return vec3f(power, power * vertex_uv.y, vertex_uv.y * vertex_uv.y);
}

// gives: furrows_stretch
// domain: texel
// cost: 20
fn furrows_stretch_map(vertex_position: vec3f) -> vec2f {
    let along: vec3f = dpdx(vertex_position);
    let down: vec3f = dpdy(vertex_position);
    return sqrt(vec2f(dot(along, along), dot(down, down)));
}

// gives: furrows_soft
// domain: texel
// pass: furrows_light: vec3f, 5 taps
// sampled: 0
// cost: 8
fn furrows_kernel(tap: f32, axis: vec2f, furrows_radius: f32, furrows_stretch: vec2f) -> vec2f {
    let step: f32 = dot(furrows_stretch, axis);
    return vec2f(tap * furrows_radius / max(step, 1e-6), exp(-0.5 * tap * tap));
}

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
    TERM.get_or_init(|| register("hills", HILLS).unwrap_or_else(|error| panic!("{error}")))
}

fn furrows() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| register("furrows", FURROWS).unwrap_or_else(|error| panic!("{error}")))
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
        surface.set_all(slot, &(facing, Unmade { uv, ..Unmade::default() }), 1.0);
    }
    ViewSamples {
        group_start: (0..=groups as u32).collect(),
        pixel: (0..(groups * LANES) as u32).collect(),
        coverage: vec![1.0; groups * LANES],
        surface,
        atlas: atlas.cloned(),
    }
}

fn dark() -> Arc<Illumination> {
    Arc::default()
}

fn start(set: &[(Param, f64)]) -> Point {
    let mut params = Params::defaults(Form::Corrected);
    set.iter().for_each(|&(param, value)| params.set(param, value));
    Point { params, gains: vec![1.0] }
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
fn engine(setup: Setup, unknowns: Vec<Unknown>, truth: &Point) -> CpuEngine {
    let blank = CpuEngine::new(task(setup, Rows::new(3, LANES), Vec::new())).unwrap();
    let planes = blank.image(0, truth);
    let mut target = Rows::new(3, LANES);
    for (channel, plane) in planes.iter().enumerate() {
        target.plane_mut(channel).zip(plane).for_each(|(target, value)| *target = *value);
    }
    CpuEngine::new(task(setup, target, unknowns)).unwrap()
}

fn maker<R: Number>(setup: &Setup, free: &[Param]) -> LevelMaker<R> {
    let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
    let facts = Facts::of_samples(*setup, FaceSizes::default(), false);
    let shading = Shading::new(&facts, &seeds, |_| None, Natives::Called).unwrap();
    LevelMaker::new(shading.levels)
}

type Dense = Vec<Option<DVec3>>;

fn at(texels: &Dense, x: i64, y: i64) -> Option<DVec3> {
    let size = i64::from(SIZE);
    let inside = (0..size).contains(&x) && (0..size).contains(&y);
    if inside { texels[(y * size + x) as usize] } else { None }
}

/// One direction of a blur, by its definition.
fn blurred_by_hand(texels: &Dense, radius: f64, [across, down]: [i64; 2]) -> Dense {
    let texel = |i: usize| {
        let (x, y) = ((i % SIZE as usize) as i64, (i / SIZE as usize) as i64);
        at(texels, x, y)?;
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for tap in -3..=3 {
            let (place, weight) = (radius * f64::from(tap), (-0.5 * f64::from(tap * tap)).exp());
            let low = place.floor();
            for (side, share) in [(0, 1.0 - (place - low)), (1, place - low)] {
                let step = low as i64 + side;
                if let Some(value) = at(texels, x + step * across, y + step * down) {
                    sum += weight * share * value;
                    weights += weight * share;
                }
            }
        }
        Some(sum / weights)
    };
    (0..texels.len()).map(texel).collect()
}

#[test]
fn levels_are_what_their_definition_says() {
    let setup = setup(&[hills()]);
    let (atlas, maker) = (atlas(&setup), maker::<f64>(&setup, &[]));
    let radius = 1.7;
    let params = start(&[(hills().params[1], radius)]).params;
    let levels = maker.make(&atlas, &params, &CubesAt::dark(f64::from));
    let light: Dense = (0..SIZE * SIZE)
        .map(|i| {
            let uv = (DVec2::new(f64::from(i % SIZE), f64::from(i / SIZE)) + 0.5) / f64::from(SIZE);
            let inside = uv.min_element() > f64::from(LOW) && uv.max_element() < f64::from(HIGH);
            let within = (5.0 * uv).fract();
            inside.then(|| (4.0 * within * (1.0 - within)).extend(uv.x * uv.y))
        })
        .collect();
    let soft = blurred_by_hand(&blurred_by_hand(&light, radius, [1, 0]), radius, [0, 1]);
    let covered = light.iter().flatten().count();
    assert!(atlas.covered() == covered && covered > 1000 && covered < light.len());
    for (place, got) in levels["hills_soft"].iter().enumerate() {
        let [x, y] = atlas.texel(place).map(i64::from);
        let off = (DVec3::from(*got) - at(&soft, x, y).unwrap()).abs().max_element();
        // Texels hold texture coordinates in f32, 6e-8 of 1, on which the hills rise by 20 at most.
        assert!(off < 3e-6, "texel ({x}, {y}): {off}");
    }
    // In f32: some tens of roundings beside.
    let single = self::maker::<f32>(&setup, &[]).make(&atlas, &params, &CubesAt::dark(|x| x));
    for (a, b) in single["hills_soft"].iter().flatten().zip(levels["hills_soft"].iter().flatten()) {
        assert!((f64::from(*a) - b).abs() < 3e-6, "{a} {b}");
    }
}

#[test]
fn levels_move_as_their_differences_do() {
    let setup = setup(&[furrows()]);
    let free = &furrows().params[..2];
    let (atlas, maker) = (atlas(&setup), maker::<f64>(&setup, free));
    let (base, step) = (Params::defaults(Form::Corrected), 1e-6);
    let make = |params: &Params| maker.make(&atlas, params, &CubesAt::dark(f64::from));
    let levels = make(&base);
    // The square's side over the texels that it covers.
    let side = 2.0 / (f64::from(SIZE) * f64::from(HIGH - LOW));
    for [u, v, _] in &levels["furrows_stretch"] {
        // Its steps are stored in f32.
        assert!((u - side).abs() < 1e-6 * side && (v - side).abs() < 1e-6 * side, "{u} {v} {side}");
    }
    for (k, &param) in free.iter().enumerate() {
        let moved = |by: f64| {
            let mut params = base.clone();
            params.set(param, base.scalar(param) + by);
            make(&params)
        };
        let (more, less) = (moved(step), moved(-step));
        for name in ["furrows_soft", "furrows_again"] {
            let tangents = levels[&format!("d{k}_{name}")].iter().flatten();
            let mut largest = 0.0_f64;
            for ((tangent, more), less) in
                tangents.zip(more[name].iter().flatten()).zip(less[name].iter().flatten())
            {
                let difference = (more - less) / (2.0 * step);
                largest = largest.max(tangent.abs());
                // Values near 1 round to 1e-16, over a step of 2e-6; no tap crosses a texel within it.
                assert!(
                    (tangent - difference).abs() < 1e-7,
                    "{name} by {}: {tangent} {difference}",
                    param.name()
                );
            }
            assert!(largest > 0.05, "{name}: {largest}");
        }
    }
}

/// Entries of normal equations within a share of the diagonal's that share row and column.
fn assert_alike(got: &NormalEquations, want: &NormalEquations, unknowns: &[Unknown], most: f64) {
    let off = deviation(got, want, unknowns);
    assert!(off.size < most, "{}: {}", off.what, off.size);
}

#[test]
fn the_engine_is_the_f64_model_and_its_gradient_the_losses_slope() {
    let setup = setup(&[hills(), furrows()]);
    let ([weight, radius], [width, depth]) =
        ([0, 1].map(|i| hills().params[i]), [0, 1].map(|i| furrows().params[i]));
    let unknowns = free(&[
        Column::per_channel(weight)[0],
        Column::per_channel(weight)[2],
        Column::tied(radius),
        Column::tied(width),
        Column::tied(depth),
    ]);
    let truth = start(&[(weight, 0.7), (radius, 1.9), (width, 0.08), (depth, 1.2)]);
    let here = start(&[(weight, 0.5), (radius, 1.4), (width, 0.06), (depth, 1.5)]);
    let engine = engine(setup, unknowns.clone(), &truth);
    let light = Illumination::default();
    let model = Reference::new(setup, &light, engine.views(), Loss::L2, &unknowns).unwrap();
    let reference = model.normal_equations(&here);
    let got = engine.normal_equations(&here);
    // Levels and what is made of them round to some 1e-7 of 1; residuals are a tenth of that 1.
    assert_alike(&got, &reference, &unknowns, 3e-5);
    let (_, gradient) = engine.gradient(&here);
    for (unknown, slope) in unknowns.iter().zip(&gradient) {
        let at = |by: f64| {
            let mut moved = here.clone();
            unknown.set(&mut moved, unknown.get(&here) + by);
            model.loss(&moved)
        };
        let step = 1e-6;
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // Losses near 0.01 round to 1e-18; the engine's sums to 1e-6 of themselves.
        assert!(
            (slope - difference).abs() < 1e-4 * (1e-3 + difference.abs()),
            "{}: {slope} {difference}",
            unknown.name()
        );
    }
    // Whatever the threads.
    let pools = [1, 3].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
    let [one, three] = pools.map(|pool| {
        pool.install(|| {
            let views = Arc::clone(engine.views());
            let task =
                Task { setup, illumination: dark(), views, loss: Loss::L2, unknowns: unknowns.clone() };
            CpuEngine::new(task).unwrap().normal_equations(&here)
        })
    });
    assert_eq!(one, three);
    assert_eq!(one, got);
}

#[test]
fn levels_move_with_the_light_as_the_losses_do() {
    // Smooth over the cube, so that differences tell its slope.
    let cube = |k: f64| {
        Cube::from_fn(16, |face, column, row| {
            let [s, t] = [column, row].map(|i| (i as f64 + 0.5) / 16.0);
            [1.0, 1.3, 1.7, 2.0].map(|c| (0.6 + 0.4 * (c * s + k * t + 0.5 * face as f64).sin()) as f32)
        })
    };
    let lobes = LobeStack { exponents: vec![8.0, 16.0], cubes: vec![cube(0.7), cube(1.9)] };
    let light = Illumination { irradiance: Some(cube(0.3)), lobes: Some(lobes), hilite: None };
    // Parameters of the light are free where a built-in effect asks for them.
    let effects = [dunes().effect, Effect::Occlusion, Effect::Diffuse, Effect::SideSpecular];
    let effects = Effects::of(&effects);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    let params = [Param::EnvironmentRotation, Param::SpecularLobe, Param::Occlusion, dunes().params[0]];
    let unknowns = free(&params.map(Column::tied));
    let mut target = Rows::new(3, LANES);
    (0..3).for_each(|channel| target.plane_mut(channel).for_each(|x| *x = 0.3));
    let task = Task { illumination: Arc::new(light.clone()), ..task(setup, target, unknowns.clone()) };
    let here = start(&[(params[0], 11.0), (params[1], 11.0), (params[2], 0.7), (params[3], 1.4)]);
    let model = Reference::new(setup, &light, &task.views, Loss::L2, &unknowns).unwrap();
    let engine = CpuEngine::new(task.clone()).unwrap();
    // As above; lookups round a little more.
    assert_alike(&engine.normal_equations(&here), &model.normal_equations(&here), &unknowns, 1e-4);
    let (_, gradient) = model.gradient(&here);
    for (unknown, slope) in unknowns.iter().zip(gradient) {
        let at = |by: f64| {
            let mut moved = here.clone();
            unknown.set(&mut moved, unknown.get(&here) + by);
            model.loss(&moved)
        };
        // The cube between two exponents is made in f32: a step over which it moves by more than that rounds.
        let step = if *unknown == unknowns[1] { 1e-2 } else { 1e-5 };
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // A lookup's slope changes from texel to texel: a few of the atlas' cross one within the step.
        let most = 1e-3;
        assert!(
            (slope - difference).abs() < most * (1e-3 + difference.abs()),
            "{}: {slope} {difference}",
            unknown.name()
        );
    }
    // What moves them has them made again, and nothing else.
    let made = engine.levels_made();
    let mut moved = here.clone();
    moved.params.set(Param::BaseWeight, 0.3);
    engine.loss(&moved);
    assert_eq!(engine.levels_made(), made);
    moved.params.set(Param::EnvironmentRotation, 12.0);
    engine.loss(&moved);
    assert_eq!(engine.levels_made(), made + 1);
}

#[test]
fn fits_recover_what_made_their_targets_and_make_levels_no_more_often_than_they_move() {
    let [weight, radius] = [0, 1].map(|i| hills().params[i]);
    let own = setup(&[hills()]);
    let mut truth = start(&[(radius, 1.9)]);
    truth.params.set_rgb(weight, [0.9, 0.6, 0.4]);
    let mut unknowns = free(&Column::per_channel(weight));
    // Weights alone: levels are made once, for the image of the targets apart.
    let mut begin = truth.clone();
    begin.params.set_rgb(weight, [0.2; 3]);
    let engine = engine(own, unknowns.clone(), &truth);
    assert_eq!(engine.levels_made(), 0);
    let outcome = fit(&engine, &begin, &FitOptions::default(), &mut |_| {}).unwrap();
    for (got, want) in outcome.end.params.rgb(weight).into_iter().zip([0.9, 0.6, 0.4]) {
        // Targets round to 6e-8.
        assert!((got - want).abs() < 1e-5, "{got} {want}");
    }
    assert_eq!(engine.levels_made(), 1);
    // And the radius, in which the model is not linear.
    unknowns.push(Unknown::Param(Column::tied(radius)));
    begin.params.set(radius, 1.2);
    let engine = self::engine(own, unknowns, &truth);
    let outcome = fit(&engine, &begin, &FitOptions::default(), &mut |_| {}).unwrap();
    let got = outcome.end.params.scalar(radius);
    // The blur has kinks where taps cross texels; the fit ends at roundings all the same.
    assert!((got - 1.9).abs() < 1e-3, "{got}");
    assert!(engine.levels_made() > 1);

    let [width, depth] = [0, 1].map(|i| furrows().params[i]);
    let truth = start(&[(width, 0.08), (depth, 1.2)]);
    let begin = start(&[(width, 0.05), (depth, 1.7)]);
    let unknowns = free(&[Column::tied(width), Column::tied(depth)]);
    let engine = self::engine(setup(&[furrows()]), unknowns, &truth);
    let outcome = fit(&engine, &begin, &FitOptions::default(), &mut |_| {}).unwrap();
    let got = [width, depth].map(|param| outcome.end.params.scalar(param));
    assert!((got[0] - 0.08).abs() < 1e-4 && (got[1] - 1.2).abs() < 1e-4, "{got:?}");
}

#[test]
fn what_has_no_texels_makes_none_and_samples_without_them_are_refused() {
    let plain = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&[Effect::KeyLight]));
    let view =
        ObservedView { samples: samples(None), target: Rows::new(3, LANES), weight: Vec::new(), clip: None };
    let task = |setup| {
        let views = Arc::from([view.clone()]);
        Task { setup, illumination: dark(), views, loss: Loss::L2, unknowns: Vec::new() }
    };
    let engine = CpuEngine::new(task(plain)).unwrap();
    engine.loss(&start(&[]));
    assert_eq!(engine.levels_made(), 0);
    let error = CpuEngine::new(task(setup(&[hills()]))).unwrap_err().to_string();
    assert!(error.contains("hills") && error.contains("Leave the effect out"), "{error}");
}

#[test]
fn the_levels_of_an_earlier_frame_go() {
    let setup = setup(&[hills()]);
    let maker = maker::<f64>(&setup, &[]);
    let params = start(&[(hills().params[1], 1.7)]).params;
    let made = |atlas: &Arc<Atlas>| maker.levels(atlas, &params, || CubesAt::dark(f64::from));
    for frame in 1..4 {
        let atlas = atlas(&setup);
        assert!(Arc::ptr_eq(&made(&atlas), &made(&atlas)));
        assert_eq!((maker.count(), maker.last.lock().unwrap().len()), (frame, 1));
    }
}

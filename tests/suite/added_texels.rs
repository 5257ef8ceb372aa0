//! A term that is computed in texels of the UV atlas and blurred there, through the door by which every term comes in:
//! planned, each of its passes valid, drawn by the renderer and held against the same passes written here, and fitted over
//! stored samples and texels by the engines.

use std::sync::Arc;
use std::sync::OnceLock;

use glam::{DMat4, DVec2, DVec3, Vec2, Vec3};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use skinfit::gpu::upload::Content;
use skinfit::gpu::{RenderOptions, Renderer};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::render::antialias::Antialias;
use skinfit::render::image::Image;
use skinfit::scene::Scene;
use skinfit::scene::mesh::Mesh;
use skinfit::scene::view::{Background, Camera, View};
use skinfit::shader::atlas::tangent::Along;
use skinfit::shader::atlas::{Axis, PassKind};
use skinfit::shader::tangent::chain::Seed;
use skinfit::shader::term::{Term, register};
use skinfit::shader::{Budget, Domain, Facts, Plan, Work, plan};

use crate::fixtures::bare_scene;
use crate::graphics::bench::{EXACT, gpu};

/// Beside a light map and a blur of it, what is added: the blurred map, and a detail that may be computed in either domain.
const GLOW: &str = "
// Slow, and smooth enough to be looked up.
//
// gives: glow_detail
// domain: texel, fragment
// sampled: 0.01
// cost: 300
fn glow_slow_detail(albedo: vec3f, base_weight: vec3f) -> vec3f {
    return albedo * base_weight;
}

// gives: glow_part
// adds: glow
// cost: 6
fn glow_light(glow_soft: vec3f, glow_detail: vec3f, glow_weight: vec3f) -> vec3f {
    return glow_weight * glow_soft + glow_detail;
}
";

/// What is added of a blur that is as wide on the surface as its radius says, of what a parameter moves.
const VEINED: &str = "
// gives: veins_part
// adds: veins
// cost: 1
fn veins_shown(veins_soft: vec3f) -> vec3f {
    return veins_soft;
}
";

/// The scene's light, blurred in the atlas.
const LIT: &str = "\
// effect: lit, the environment's light under the surface
// parameter: lit_radius = 1.5 in [0.1, 30], unit texels; how far it wandered; a test
//
// gives: lit_light
// domain: texel
// cost: 12
fn lit_map(albedo: vec3f, irradiance: vec3f, occ: f32) -> vec3f {
    return occ * albedo * irradiance;
}

// gives: lit_soft
// domain: texel
// pass: lit_light: vec3f, 5 taps
// sampled: 0
// cost: 8
fn lit_kernel(tap: f32, lit_radius: f32) -> vec2f {
    return vec2f(lit_radius * tap, exp(-0.5 * tap * tap));
}

// gives: lit_part
// adds: lit
// cost: 1
fn lit_shown(lit_soft: vec3f) -> vec3f {
    return lit_soft;
}
";

fn lit() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| register("lit", LIT).unwrap_or_else(|error| panic!("{error}")))
}

fn veined() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    let text =
        include_str!("../../src/rules/shader/atlas/tests/stretched.wgsl").replace("NAME", "veins") + VEINED;
    TERM.get_or_init(|| register("veins", &text).unwrap_or_else(|error| panic!("{error}")))
}

fn term() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    let text = include_str!("../../src/rules/shader/atlas/tests/hills.wgsl");
    let text = text.replace("NAME", "glow").replace("HILLS", "12.0") + GLOW;
    TERM.get_or_init(|| register("glow", &text).unwrap_or_else(|error| panic!("{error}")))
}

fn setup() -> Setup {
    Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&[term().effect]))
}

/// As a close look at a character is: a texel for every twenty fragments.
const CLOSE: Work = Work { vertices: 1e4, texels: 1e5, fragments: 2e6 };

fn planned(work: Work, budget: Budget) -> Plan {
    plan(&Facts { setup: setup(), work, budget, atlas: Some(512), ..Facts::default() }).unwrap()
}

fn validate(plan: &Plan) {
    let module = naga::front::wgsl::parse_str(&plan.wgsl)
        .unwrap_or_else(|error| panic!("{}\n{}", error.emit_to_string(&plan.wgsl), plan.wgsl));
    let valid = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
    valid.unwrap_or_else(|error| panic!("{}\n{}", error.emit_to_string(&plan.wgsl), plan.wgsl));
}

/// Where the plan computes a quantity of the term's.
fn domain_of(plan: &Plan, quantity: &str) -> Vec<Domain> {
    plan.all_steps()
        .into_iter()
        .map(|step| step.rule)
        .filter(|r| r.gives_quantity(quantity))
        .map(|r| r.domain)
        .collect()
}

#[test]
fn the_planner_decides_where_and_every_pass_is_valid() {
    let within = Budget::Within(0.02);
    let many = Work { texels: 1e7, ..CLOSE };
    for (work, budget, domain) in [
        (CLOSE, within, Domain::Texel),
        (many, within, Domain::Fragment),
        (CLOSE, Budget::Exact, Domain::Fragment),
        (CLOSE, Budget::Within(0.005), Domain::Fragment),
    ] {
        let plan = planned(work, budget);
        assert_eq!(domain_of(&plan, "glow_detail"), [domain], "{work:?} {budget:?}");
        // What is blurred is computed nowhere else.
        assert_eq!(domain_of(&plan, "glow_light"), [Domain::Texel]);
        let kinds: Vec<PassKind> = plan.passes.iter().map(|pass| pass.kind).collect();
        assert_eq!(kinds, [PassKind::Draw, PassKind::Blur(Axis::U), PassKind::Blur(Axis::V)]);
        let sampled: Vec<&str> = plan.levels.iter().map(|level| level.name.as_str()).collect();
        assert_eq!(sampled.contains(&"glow_detail"), domain == Domain::Texel);
        assert!(sampled.contains(&"glow_soft") && !sampled.contains(&"glow_light"));
        validate(&plan);
        plan.passes.iter().for_each(|pass| validate(&pass.plan));
    }
    assert!(planned(CLOSE, within).cost < planned(CLOSE, Budget::Exact).cost);
}

/// Texture coordinates of the square's corners: within the atlas, and between texels.
const LOW: f64 = 0.1;
const HIGH: f64 = 0.85;
/// Texels along a side of the atlas.
const SIZE: usize = 512;
/// Pixels along a side of the image.
const PIXELS: u32 = 96;
/// From the camera to the square.
const DISTANCE: f64 = 3.5;
/// The camera's field of view, radians.
const FOV: f64 = 0.6;

/// A square from -1 to 1 that faces the camera and fills most of the image.
fn scene() -> Scene {
    let (low, high) = (LOW as f32, HIGH as f32);
    let mesh = Mesh {
        positions: [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
            .map(|[x, y]| Vec3::new(x, y, 0.0))
            .to_vec(),
        normals: vec![Vec3::Z; 4],
        uvs: [[low, low], [high, low], [high, high], [low, high]].map(Vec2::from).to_vec(),
        triangles: vec![[0, 3, 2], [0, 2, 1]],
        ..Mesh::default()
    };
    let camera = Camera::pinhole(DMat4::from_translation(DVec3::new(0.0, 0.0, -DISTANCE)), FOV, [PIXELS; 2]);
    let view = View { name: "front".to_owned(), camera, target: None, background: Background::None };
    Scene { mesh, views: vec![view], ..bare_scene(Effects::of(&[term().effect])) }
}

type Texels = Vec<Option<DVec3>>;

/// The light map: what the mesh covers of the atlas.
fn light_map() -> Texels {
    let texel = |i: usize| {
        let uv = DVec2::new((i % SIZE) as f64 + 0.5, (i / SIZE) as f64 + 0.5) / SIZE as f64;
        let within = (12.0 * uv).fract();
        let inside = uv.min_element() > LOW && uv.max_element() < HIGH;
        inside.then(|| (4.0 * within * (1.0 - within)).extend(uv.x * uv.y))
    };
    (0..SIZE * SIZE).map(texel).collect()
}

fn at(texels: &Texels, x: i64, y: i64) -> Option<DVec3> {
    let size = SIZE as i64;
    let inside = (0..size).contains(&x) && (0..size).contains(&y);
    if inside { texels[(y * size + x) as usize] } else { None }
}

/// The mean of places with weights, of those that hold something.
fn mean(places: impl Iterator<Item = (f64, Option<DVec3>)>) -> Option<DVec3> {
    let sum = places.filter_map(|(weight, value)| Some((weight, value?)));
    let (weights, sum) =
        sum.fold((0.0, DVec3::ZERO), |(w, sum), (weight, value)| (w + weight, sum + weight * value));
    (weights > 0.0).then(|| sum / weights)
}

/// One direction of the blur, by its definition.
fn blurred(texels: &Texels, radius: f64, [across, down]: [i64; 2]) -> Texels {
    let texel = |i: usize| {
        let (x, y) = ((i % SIZE) as i64, (i / SIZE) as i64);
        at(texels, x, y)?;
        let taps = (-3..=3).flat_map(|tap| {
            let (place, weight) = (radius * f64::from(tap), (-0.5 * f64::from(tap * tap)).exp());
            let low = place.floor();
            [(0, 1.0 - (place - low)), (1, place - low)].map(|(side, share)| {
                let step = low as i64 + side;
                (weight * share, at(texels, x + step * across, y + step * down))
            })
        });
        mean(taps)
    };
    (0..SIZE * SIZE).map(texel).collect()
}

/// The bilinear value at texture coordinates.
fn looked_up(texels: &Texels, uv: DVec2) -> Option<DVec3> {
    let place = SIZE as f64 * uv - 0.5;
    let (low, f) = (place.floor(), place - place.floor());
    let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| {
        let share = |side: i64, f: f64| if side == 1 { f } else { 1.0 - f };
        (share(x, f.x) * share(y, f.y), at(texels, low.x as i64 + x, low.y as i64 + y))
    });
    mean(corners.into_iter())
}

/// Texels of a level that hold something.
fn held(level: &[f32]) -> Vec<[f64; 3]> {
    let texels = level.chunks_exact(4).filter(|texel| texel[3] > 0.0);
    texels.map(|texel| [0, 1, 2].map(|c| f64::from(texel[c]))).collect()
}

#[test]
fn levels_move_as_their_differences_do() {
    let Some(gpu) = gpu() else { return };
    let veined = veined();
    let mut scene = scene();
    scene.effects = Effects::of(&[veined.effect]);
    let facts = Facts { atlas: Some(64), ..scene.facts(&scene.params, Budget::Exact, false) };
    let planned = plan(&facts).unwrap();
    let levels = |plan: &Plan, scene: &Scene| skinfit::gpu::atlas::levels(gpu, plan, content(scene)).unwrap();
    // The square's side over the texels that it covers: rounded at most by what 1e-7 is of a texel's 1e-2.
    for [u, v, _] in held(&levels(&planned, &scene)["veins_stretch"]) {
        let step = 2.0 / (64.0 * (HIGH - LOW));
        assert!((u - step).abs() < 1e-4 * step && (v - step).abs() < 1e-4 * step, "{u} {v} {step}");
    }
    for &param in &veined.params[..2] {
        let along = Along::new(&planned, &Seed::of_param(param)).unwrap();
        assert!(along.moved.contains_key("veins_soft"), "{along:?}");
        let mut both = planned.clone();
        both.passes.extend(along.passes);
        let tangent = held(&levels(&both, &scene)["d_veins_soft"]);
        let at = |by: f64| {
            let mut moved = scene.clone();
            moved.params.set(param, scene.params.scalar(param) + by);
            held(&levels(&planned, &moved)["veins_soft"])
        };
        let step = 2e-3;
        let (more, less) = (at(step), at(-step));
        assert!(tangent.len() > 2000 && tangent.len() == more.len());
        let mut largest = 0.0_f64;
        for ((tangent, more), less) in
            tangent.iter().flatten().zip(more.iter().flatten()).zip(less.iter().flatten())
        {
            let difference = (more - less) / (2.0 * step);
            largest = largest.max(difference.abs());
            // Levels near 1 round to 1e-7, over a step of 4e-3; and where a tap passes from one texel to the next within
            // the step, its slope changes by a share of what neighbours differ.
            assert!((tangent - difference).abs() < 5e-3, "{}: {tangent} {difference}", param.name());
        }
        assert!(largest > 0.05, "{}: {largest}", param.name());
    }
}

/// The scene without any light.
fn content(scene: &Scene) -> Content {
    let (scene, params) = (Arc::new(scene.clone()), scene.params.clone());
    Content { scene, illumination: Arc::default(), occlusion: None, sky: None, thickness: None, params }
}

fn drawn(scene: &Scene, options: RenderOptions) -> Option<(Image, Plan)> {
    let mut renderer = Renderer::new(gpu()?, content(scene), options).unwrap();
    let image = renderer.render(&scene.views[0].camera, 1.0).unwrap().image;
    Some((image, renderer.plan().clone()))
}

#[test]
fn the_renderer_draws_its_passes() {
    let mut scene = scene();
    let (weight, radius) = ([0.9, 0.6, 0.4], 1.7);
    scene.params.set_rgb(term().params[0], weight);
    scene.params.set(term().params[1], radius);
    let options = RenderOptions { antialias: Antialias::Grid(1), ..EXACT };
    let Some((image, exact)) = drawn(&scene, options) else { return };
    assert_eq!(exact.passes.len(), 3);
    let soft = blurred(&blurred(&light_map(), radius, [1, 0]), radius, [0, 1]);
    let half = DISTANCE * (0.5 * FOV).tan();
    let base = scene.params.rgb(skinfit::model::params::Param::BaseWeight);
    let mut seen = 0;
    for (i, (rgb, alpha)) in image.rgb.iter().zip(&image.alpha).enumerate() {
        let at = |place: u32| f64::from(place) + 0.5;
        let pixel = DVec2::new(at(i as u32 % PIXELS), at(i as u32 / PIXELS));
        let on_square = (2.0 * pixel / f64::from(PIXELS) - 1.0) * half;
        let inside = on_square.abs().max_element() < 1.0;
        assert_eq!(*alpha, if inside { 1.0 } else { 0.0 }, "pixel {i}");
        if !inside {
            continue;
        }
        seen += 1;
        let uv = LOW + (on_square + 1.0) / 2.0 * (HIGH - LOW);
        let want = looked_up(&soft, uv).unwrap().to_array();
        for c in 0..3 {
            // The scene has no colour map: the detail is the base's weight.
            let want = weight[c] * want[c] + base[c];
            // Texture coordinates round to 1e-7, 5e-5 of a texel, over which the hills rise by a tenth of that at most;
            // some tens of roundings of f32 beside.
            assert!((f64::from(rgb[c]) - want).abs() < 2e-5, "pixel {i}, channel {c}: {} {want}", rgb[c]);
        }
    }
    assert!(seen > 5000 && seen < image.rgb.len(), "{seen}");

    // So close that there are more fragments than texels: the detail is looked up, and is off by no more than it says.
    let camera = &mut scene.views[0].camera;
    (camera.width, camera.height) = (1024, 1024);
    let (exact, _) = drawn(&scene, options).unwrap();
    let loose = RenderOptions { budget: Budget::Within(0.01), ..options };
    let (loose, plan) = drawn(&scene, loose).unwrap();
    assert_eq!(domain_of(&plan, "glow_detail"), [Domain::Texel]);
    for (a, b) in exact.rgb.iter().flatten().zip(loose.rgb.iter().flatten()) {
        // Such an image is kept in 16 bits, which round to 2^-11 of up to 2.
        assert!((a - b).abs() <= 0.01 + 1e-3, "{a} {b}");
    }
}

mod over_stored_texels {
    use skinfit::bake::VertexOcclusion;
    use skinfit::bake::rays::RayMesh;
    use skinfit::engine::cpu::CpuEngine;
    use skinfit::engine::cubes_at::CubesAt;
    use skinfit::engine::gpu::{GpuEngine, Memory};
    use skinfit::engine::levels::LevelMaker;
    use skinfit::engine::reference::{Reference, deviation};
    use skinfit::engine::view::ObservedView;
    use skinfit::engine::{Objective, Point, Task, Unknown};
    use skinfit::fit::{FitOptions, fit};
    use skinfit::model::params::{Column, Param};
    use skinfit::program::lower::Natives;
    use skinfit::program::shading::Shading;
    use skinfit::render::shade::Shader;
    use skinfit::samples::{
        Atlas, PosedSurface, SurfaceBakes, TargetRows, ViewSamples, atlas_of, sample_views,
    };
    use skinfit::scene::Loss;
    use skinfit::scene::view::Target;
    use skinfit::shader::facts::FaceSizes;

    use super::*;

    /// Texels along a side of the atlas.
    const TEXELS: usize = 128;

    /// The square with both terms, seen by its camera with one sample a pixel.
    fn both() -> Scene {
        let mut scene = scene();
        scene.effects = Effects::of(&[term().effect, veined().effect]);
        scene.quality.samples_per_axis = 1;
        scene.diffusion.light_map_size = TEXELS as u32;
        scene.views[0].camera.width = 64;
        scene.views[0].camera.height = 64;
        scene
    }

    fn samples(scene: &Scene) -> ViewSamples {
        sample_views(scene, &scene.mesh.pose(), SurfaceBakes::default()).unwrap().remove(0)
    }

    fn at(scene: &Scene, set: &[(Param, f64)]) -> Point {
        let mut params = scene.params.clone();
        set.iter().for_each(|&(param, value)| params.set(param, value));
        Point { params, gains: vec![1.0.into()] }
    }

    fn parameters() -> [Param; 4] {
        [term().params[0], term().params[1], veined().params[0], veined().params[1]]
    }

    fn truth(scene: &Scene) -> Point {
        let [weight, radius, width, depth] = parameters();
        at(scene, &[(weight, 0.7), (radius, 1.9), (width, 0.03), (depth, 1.2)])
    }

    fn start(scene: &Scene) -> Point {
        let [weight, radius, width, depth] = parameters();
        at(scene, &[(weight, 0.4), (radius, 1.4), (width, 0.022), (depth, 1.6)])
    }

    fn unknowns() -> Vec<Unknown> {
        let [weight, radius, width, depth] = parameters();
        let tied = [radius, width, depth].map(Column::tied);
        Column::per_channel(weight).into_iter().chain(tied).map(Unknown::Param).collect()
    }

    /// A task whose target is the image that the processor's renderer makes at the truth.
    fn task(scene: &Scene, unknowns: Vec<Unknown>) -> Task {
        let mut samples = vec![samples(scene)];
        let mut view = scene.views[0].clone();
        let shader =
            Shader::new(scene.setup(), &skinfit::bake::Illumination::default(), &truth(scene).params)
                .unwrap();
        let image = shader.shade(&samples[0], &view.camera, 1.0).image;
        view.target = Some(Target {
            rgb: image.rgb,
            alpha: Some(image.alpha),
            mask: None,
            haze: None,
            clipped_at: None,
        });
        let TargetRows { channels, weight, clip } = TargetRows::new(&view, &samples[0]).unwrap().unwrap();
        let observed = ObservedView { samples: samples.remove(0), target: channels, weight, clip };
        let (setup, views) = (scene.setup(), Arc::from([observed]));
        Task { setup, illumination: Arc::default(), views, loss: Loss::L2, unknowns }
    }

    /// A fit from elsewhere finds what made the target.
    fn assert_fit(engine: &dyn Objective, scene: &Scene, what: &str) {
        let outcome = fit(engine, &start(scene), &FitOptions::default(), &mut |_| {}).unwrap();
        for unknown in engine.unknowns() {
            let (got, want) = (unknown.get(&outcome.end), unknown.get(&truth(scene)));
            // Targets round to f32, and so do levels; a thousand times that for directions in which parameters trade.
            assert!((got - want).abs() <= 1e-3 * want, "{what}: {}: {got} {want}", unknown.name());
        }
    }

    #[test]
    fn engines_recover_what_made_the_target_and_agree() {
        let scene = both();
        let (task, here) = (task(&scene, unknowns()), start(&scene));
        let light = skinfit::bake::Illumination::default();
        let reference = Reference::new(task.setup, &light, &task.views, Loss::L2, &task.unknowns).unwrap();
        let want = reference.normal_equations(&here);
        let cpu = CpuEngine::new(task.clone()).unwrap();
        // Levels and what is made of them round to 1e-7 of 1, some tens of times.
        let off = deviation(&cpu.normal_equations(&here), &want, &task.unknowns);
        assert!(off.size < 1e-4, "cpu: {}: {}", off.what, off.size);
        assert_fit(&cpu, &scene, "cpu");
        #[cfg(feature = "burn")]
        if let Some(shared) = crate::tensors::bench::shared() {
            let columns: Vec<Column> = unknowns().iter().filter_map(Unknown::column).collect();
            crate::tensors::lit::agree_at(shared, (task.clone(), &here), &columns, "added texels");
        }
        let Some(gpu) = gpu() else { return };
        for part in [None, Some(1 << 17)] {
            let memory = Memory { part, resident: part };
            let engine = GpuEngine::new(gpu, task.clone(), &here, memory).unwrap();
            let off = deviation(&engine.normal_equations(&here), &want, &task.unknowns);
            assert!(off.size < 1e-4, "gpu, {part:?}: {}: {}", off.what, off.size);
            let planes = engine.image(0, &here).unwrap();
            for (a, b) in planes.iter().flatten().zip(cpu.image(0, &here).iter().flatten()) {
                // The same levels, in f32.
                assert!((a - b).abs() < 1e-6, "{a} {b}");
            }
            assert_fit(&engine, &scene, "gpu");
        }
    }

    #[test]
    fn an_adapters_engine_makes_levels_once_for_weights_alone() {
        let Some(gpu) = gpu() else { return };
        let scene = both();
        let free = Column::per_channel(term().params[0]).map(Unknown::Param).to_vec();
        let engine = GpuEngine::new(gpu, task(&scene, free), &start(&scene), Memory::default()).unwrap();
        for weight in [0.1, 0.5, 0.9] {
            let mut point = start(&scene);
            point.params.set(term().params[0], weight);
            assert!(engine.loss(&point).is_finite());
        }
        assert_eq!(engine.levels_made(), 1);
        let mut point = start(&scene);
        point.params.set(term().params[1], 1.5);
        assert!(engine.loss(&point).is_finite() && engine.levels_made() == 2);
    }

    fn atlas(scene: &Scene, occlusion: Option<&VertexOcclusion>) -> Arc<Atlas> {
        let posed = scene.mesh.pose();
        let rays = RayMesh::new(&posed.positions, &posed.triangles);
        let bakes = SurfaceBakes { occlusion, ..SurfaceBakes::default() };
        let surface = PosedSurface::new(scene, &posed, &rays, &scene.mesh.morphs, bakes).unwrap();
        atlas_of(scene, &surface).unwrap().unwrap()
    }

    #[test]
    fn the_processors_levels_and_image_are_the_renderers() {
        let Some(gpu) = gpu() else { return };
        let mut scene = both();
        scene.params = truth(&scene).params;
        let facts = scene.facts(&scene.params, Budget::Exact, false);
        let drawn_levels = skinfit::gpu::atlas::levels(gpu, &plan(&facts).unwrap(), content(&scene)).unwrap();
        let atlas = atlas(&scene, None);
        let facts = Facts::of_samples(scene.setup(), FaceSizes::default(), false);
        let shading = Shading::new(&facts, &[], |_| None, Natives::Written).unwrap();
        let levels =
            LevelMaker::<f32>::new(shading.levels).make(&atlas, &scene.params, &CubesAt::dark(|x| x)).all();
        for name in ["glow_soft", "veins_stretch", "veins_soft"] {
            let drawn: Vec<&[f32]> = drawn_levels[name].chunks_exact(4).collect();
            assert_eq!(drawn.len(), TEXELS * TEXELS);
            assert_eq!(drawn.iter().filter(|texel| texel[3] > 0.0).count(), atlas.covered(), "{name}");
            for (place, texel) in levels[name].iter().enumerate() {
                let [x, y] = atlas.texel(place).map(|x| x as usize);
                for (c, value) in texel.iter().enumerate() {
                    // Adapters interpolate to some 1e-6 of the square, on which hills rise by 48 at most; and a tap at a
                    // texel's border takes either neighbour's share.
                    let off = (value - drawn[y * TEXELS + x][c]).abs();
                    assert!(off < 1e-4, "{name} at ({x}, {y}): {value} {}", drawn[y * TEXELS + x][c]);
                }
            }
        }

        let options = RenderOptions { antialias: Antialias::Grid(1), ..EXACT };
        let (image, _) = drawn(&scene, options).unwrap();
        let shader =
            Shader::new(scene.setup(), &skinfit::bake::Illumination::default(), &scene.params).unwrap();
        let shaded = shader.shade(&samples(&scene), &scene.views[0].camera, 1.0);
        assert_eq!(image.alpha, shaded.image.alpha);
        let most = shaded.image.rgb.iter().flatten().fold(0.0_f32, |most, x| most.max(*x));
        assert!(most > 0.5, "{most}");
        for (a, b) in image.rgb.iter().flatten().zip(shaded.image.rgb.iter().flatten()) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
    }

    #[test]
    fn the_heads_texels_and_image_are_the_renderers() {
        use crate::graphics::bench::{baked, built_in, on_cpu, on_gpu};
        let Some(gpu) = gpu() else { return };
        let effects = Effects::of(&[lit().effect, Effect::NormalMap, Effect::Occlusion]);
        let head = baked(&built_in(), effects, 96);
        let (scene, params) = (Arc::clone(&head.scene), &head.scene.params);
        let facts = scene.facts(params, Budget::Exact, false);
        let drawn_levels =
            skinfit::gpu::atlas::levels(gpu, &plan(&facts).unwrap(), Content::of(&head)).unwrap();
        let atlas = atlas(&scene, head.occlusion.as_deref());
        let faces = skinfit::engine::face_sizes(&head.illumination);
        let facts = Facts::of_samples(scene.setup(), faces, params.scalar(Param::EnvironmentRotation) != 0.0);
        let shading = Shading::new(&facts, &[], |_| None, Natives::Written).unwrap();
        let cubes = CubesAt::new(&head.illumination, params, f64::from);
        let levels = LevelMaker::<f64>::new(shading.levels).make(&atlas, params, &cubes).all();
        let drawn: Vec<&[f32]> = drawn_levels["lit_light"].chunks_exact(4).collect();
        let covered = drawn.iter().filter(|texel| texel[3] > 0.0).count();
        let mut off: Vec<f64> = Vec::new();
        for (place, texel) in levels["lit_light"].iter().enumerate() {
            let [x, y] = atlas.texel(place).map(|x| x as usize);
            let there = drawn[y * SIZE + x];
            if there[3] > 0.0 {
                off.extend((0..3).map(|c| (texel[c] - f64::from(there[c])).abs()));
            }
        }
        // Adapters snap corners to 1/256 of a texel: along the charts' outlines one texel in five hundred may be
        // covered by one of the two alone.
        let both = off.len() / 3;
        assert!(both > 50_000, "{both}");
        for alone in [atlas.covered() - both, covered - both] {
            assert!(alone < both / 500, "{alone} of {both}");
        }
        off.sort_by(f64::total_cmp);
        // Cubes, maps and frames in f32; where corners are snapped, a texel takes a place off by 1/256 of it.
        let (usual, most) = (off[off.len() * 99 / 100], off[off.len() - 1]);
        assert!(usual < 1e-3 && most < 0.1, "{usual} {most}");

        let cpu = on_cpu(&head, 2);
        let difference = crate::graphics::bench::Difference::new(&cpu, &on_gpu(gpu, &head, EXACT), 4);
        let usual = difference.interior[difference.interior.len() * 99 / 100];
        // Relative to the image's mean: the same, and samples at the edges of triangles.
        assert!(difference.interior.len() > 1000 && usual < 2e-3, "{usual}");
    }
}

//! Light that comes through the skin (MODEL 11): the rules against the vectors of an independent float64 oracle, and what is
//! found of thickness and of lights' ways inside, on meshes whose answer is known.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3, vec3};
use skinfit::bake::rays::RayMesh;
use skinfit::bake::{BakeRow, Ranges, bake};
use skinfit::engine::Unknown;
use skinfit::engine::lanes::Lanes;
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::bearing::Bearing;
use skinfit::model::choices::Choices;
use skinfit::model::cube::Cube;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::fields::{Field, Fields};
use skinfit::model::params::{Column, Param, Params};
use skinfit::model::transmission::{FARTHEST, Method, NODES};
use skinfit::prepare::Baked;
use skinfit::render::image::Image;
use skinfit::samples::PosedSurface;
use skinfit::scene::light::{Beam, Lamp};
use skinfit::scene::mesh::{Mesh, PosedMesh};
use skinfit::scene::view::{Background, View};
use skinfit::scene::{Light, LightKind, Quality, Scene};
use skinfit::shader::facts::FaceSizes;
use skinfit::shader::tangent::chain::Seed;
use skinfit::shader::{Facts, Source};
use skinfit_core::export::vertices::fields_at_vertices;
use skinfit_core::program::graph::Input;
use skinfit_core::program::lower::Natives;
use skinfit_core::program::shading::{Shading, constant};
use skinfit_core::program::steps::{Rounding, Steps};

use crate::by_rules::Number;
use crate::common::vectors_light;
use crate::fixtures::{bare_scene, camera, quantile};
use crate::graphics::bench::{self, Difference, EXACT, gpu};
use crate::scene_folder::{SCENE, SceneFolder};
use crate::sky::{bakes, brighter, effect, gentle, head_changed, image, on_cpu, scene, shape};
use crate::slopes;
use crate::vectors::reader::{Node, Tolerance, Vectors};

fn param(name: &str) -> Param {
    Param::from_name(name).unwrap_or_else(|| panic!("there is no {name}"))
}

fn beam(name: &str, direction: DVec3) -> Light {
    let kind =
        LightKind::Directional(Beam { direction, irradiance: [1.0; 3], angular_diameter_degrees: 0.0 });
    Light { name: name.to_owned(), kind }
}

/// Along which way the vectors' lights shine: they face the far side.
const TOWARD: Bearing = Bearing { azimuth: 30.0, elevation: 20.0 };

/// The planned rules of the environment and two lights, and their slopes by weight and length.
struct Rules {
    steps: Steps,
    names: [&'static str; 2],
}

impl Rules {
    fn new() -> Self {
        let names = ["through_a", "through_b"];
        let lights = names.map(|name| beam(name, DVec3::NEG_Z).effect().unwrap());
        let effects = [Effect::Diffuse, Effect::Lights, Effect::Shadows, effect("transmission")];
        let effects = Effects::of(&[&effects[..], &lights].concat());
        let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
        let faces = FaceSizes { irradiance: Some(4), ..FaceSizes::default() };
        let facts = Facts { setup, source: Source::Samples, faces, ..Facts::default() };
        let seeds = ["transmission_weight", "transmission_length"].map(|name| Seed::of_param(param(name)));
        let shading = Shading::new(&facts, &seeds, |_| None, Natives::Written).unwrap();
        let mut outputs = shading.quantities["transmission_part"].clone();
        // No other term moves with these.
        outputs.extend(shading.tangents.iter().flat_map(|rgba| &rgba[..3]));
        Self { steps: Steps::new(&shading.graph, &outputs, |_| Rounding::Plain), names }
    }

    /// Value and slopes of a case.
    fn run<R: Number>(&self, case: &Node<'_>, like: R) -> [[f64; 3]; 3] {
        let mut params = Params::defaults(Form::Corrected);
        for name in ["transmission_weight", "transmission_length"] {
            params.set_rgb(param(name), case.at(name).three());
        }
        let lights = case.at("lights").items();
        for (name, light) in self.names.iter().zip((0..2).map(|i| lights.get(i))) {
            params.set(param(&format!("light.{name}.azimuth")), TOWARD.azimuth);
            params.set(param(&format!("light.{name}.elevation")), TOWARD.elevation);
            let irradiance = light.map_or([0.0; 3], |light| light.at("irradiance").three());
            params.set_rgb(param(&format!("light.{name}.irradiance")), irradiance);
        }
        let ambient = case.at("ambient").three();
        let cube = Cube::from_fn(4, |_, _, _| [ambient[0], ambient[1], ambient[2], 0.0].map(R::texel));
        let inward = TOWARD.direction();
        let field = |Input { name, component }: &Input| match name.as_str() {
            "normal" | "base" => -inward[*component],
            "albedo" => case.at("albedo").three()[*component],
            "thickness" => case.at("d").number(),
            name => {
                let number = self.names.iter().position(|own| name.starts_with(&format!("light_{own}_")));
                let light = number.and_then(|number| lights.get(number));
                match name.rsplit('_').next() {
                    Some("depth") => light.map_or(FARTHEST, |light| light.at("d").number()),
                    Some("far" | "open") => 1.0,
                    _ => panic!("a sample has no {name}"),
                }
            }
        };
        let setting = self.steps.setting(like, |input| constant(input, &params).unwrap(), |_| &cube);
        let mut registers = Vec::new();
        self.steps.run(&setting, like, &mut registers, |place| like.lit(field(&self.steps.fields()[place])));
        let numbers: Vec<f64> =
            self.steps.outputs(&setting, &registers).map(|number| number.unpack()[0]).collect();
        [0, 3, 6].map(|i| [numbers[i], numbers[i + 1], numbers[i + 2]])
    }
}

fn compare<R: Number>(root: &Node<'_>, like: R) {
    let tolerances = root.vector.tolerances();
    let near: Tolerance =
        if size_of::<R>() == size_of::<f64>() { tolerances.double } else { tolerances.single };
    let rules = Rules::new();
    let cases = root.at("inputs").at("cases").items();
    for (case, want) in cases.iter().zip(root.at("expected").at("cases").items()) {
        want.at("case").assert_text(case.at("case").text());
        let found = rules.run(case, like);
        let names = ["value", "d_transmission_weight", "d_transmission_length"];
        for (name, numbers) in names.into_iter().zip(found) {
            near.check(&format!("{}: {name}", case.at("case").text()), &numbers, &want.at(name));
        }
    }
}

/// The oracle's cases: nothing, the ordinary, huge and infinite depths, and lengths at their bounds.
#[test]
fn light_comes_through_as_the_vectors_say_in_every_kind_of_number() {
    let vectors = Vectors::read(&vectors_light());
    let root = vectors.files["transmission.json"].root();
    compare(&root, 0.0_f64);
    compare(&root, 0.0_f32);
    for level in skinfit::simd::levels() {
        skinfit_core::with_simd!(level, simd => compare(&root, Lanes::splat(simd, 0.0)));
    }
    root.at("name").assert_text("transmission");
    root.at("kind").assert_text("transmission");
    // Beyond `OPTICAL_MAX` lengths nothing is left: the longest that a parameter may be is what samples hold of no end.
    let lengths = root.at("constants").at("OPTICAL_MAX").number();
    assert_eq!(lengths * param("transmission_length").info().upper, FARTHEST);
    let unread: Vec<_> = root.vector.left().into_iter().filter(|path| *path != "note").collect();
    assert!(unread.is_empty(), "{unread:?}");
}

/// Two sheets of 20 x 20 across z, facing away from one another: the front at 0, the back that much below.
fn slab(thick: f32) -> PosedMesh {
    const CELLS: u32 = 8;
    let mut mesh = PosedMesh::default();
    for (z, normal) in [(0.0, Vec3::Z), (-thick, Vec3::NEG_Z)] {
        let first = mesh.positions.len() as u32;
        for i in 0..(CELLS + 1).pow(2) {
            let at = |k: u32| 20.0 * k as f32 / CELLS as f32 - 10.0;
            mesh.positions.push(vec3(at(i % (CELLS + 1)), at(i / (CELLS + 1)), z));
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::splat(0.5));
        }
        for cell in 0..CELLS.pow(2) {
            let a = first + cell / CELLS * (CELLS + 1) + cell % CELLS;
            mesh.triangles.extend([[a, a + 1, a + CELLS + 1], [a + 1, a + CELLS + 2, a + CELLS + 1]]);
        }
    }
    mesh
}

/// Millimetres in a unit of the slab's scene.
const UNIT: f64 = 4.0;
const THICK: f64 = 0.5;
const PIXELS: u32 = 24;

/// The slab from the front with a light; the skin is white, and shows nothing but what comes through.
fn lit_slab(light: Light, shadows: bool) -> Scene {
    let name = format!("light.{}", light.name);
    let mut effects = Effects::of(&[Effect::Lights, effect("transmission"), light.effect().unwrap()]);
    if shadows {
        effects = effects.with(Effect::Shadows);
    }
    let PosedMesh { positions, normals, uvs, triangles, .. } = slab(THICK as f32);
    let in_front = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., -4., 0., 0., 0., 1.];
    let view = View {
        name: "front".to_owned(),
        camera: camera(in_front, 30.0, PIXELS),
        target: None,
        background: Background::None,
    };
    let mut scene = Scene {
        mesh: Mesh { positions, normals, uvs, triangles, ..Mesh::default() },
        metres_per_unit: 1e-3 * UNIT,
        views: vec![view],
        quality: Quality { samples_per_axis: 1, ..Quality::default() },
        ..bare_scene(effects)
    };
    let params = &mut scene.params;
    params.set_rgb(param("transmission_weight"), WEIGHT);
    params.set(param("transmission_unit"), UNIT);
    params.set_rgb(param(&format!("{name}.irradiance")), light.strength());
    if let Some(bearing) = light.bearing() {
        params.set(param(&format!("{name}.azimuth")), bearing.azimuth);
        params.set(param(&format!("{name}.elevation")), bearing.elevation);
    } else if let LightKind::Point(lamp) = &light.kind {
        params.set_rgb(param(&format!("{name}.position")), lamp.position.to_array());
        params.set_rgb(param(&format!("{name}.cone")), [-1.0, -2.0, 0.0]);
    }
    scene.lights.push(light);
    scene
}

const WEIGHT: [f64; 3] = [0.5, 0.8, 1.0];
const LENGTH: [f64; 3] = [3.7, 1.4, 0.7];

/// Where a pixel sees the front, which is 4 away.
fn seen(pixel: usize) -> DVec3 {
    let half = 4.0 * 15.0_f64.to_radians().tan();
    let along = |i: usize| (2.0 * (i as f64 + 0.5) / f64::from(PIXELS) - 1.0) * half;
    DVec3::new(along(pixel % PIXELS as usize), -along(pixel / PIXELS as usize), 0.0)
}

/// Every pixel shows weight exp(-d / length) E / pi, of depth and irradiance at the place that it sees.
fn assert_through(image: &Image, what: &str, at: impl Fn(DVec3) -> (f64, f64)) {
    for (i, rgb) in image.rgb.iter().enumerate() {
        let (depth, irradiance) = at(seen(i));
        for c in 0..3 {
            let want = WEIGHT[c] * (-UNIT * depth / LENGTH[c]).exp() * irradiance / PI;
            // Rays end a hundred-thousandth of the mesh's diagonal of 28 below the surface: 0.0011 mm, of lengths from 0.7.
            let near = (f64::from(rgb[c]) - want).abs() <= 3e-3 * want;
            assert!(near, "{what}, pixel {i}, channel {c}: {} {want}", rgb[c]);
        }
    }
}

#[test]
fn a_light_behind_a_thin_sheet_lights_its_front() {
    for shadows in [false, true] {
        let behind = image_of(&lit_slab(beam("through_behind", DVec3::Z), shadows));
        assert_through(&behind, "straight", |_| (THICK, 1.0));
        let slanted = image_of(&lit_slab(beam("through_slanted", DVec3::new(0.6, 0.0, 0.8)), shadows));
        assert_through(&slanted, "slanted", |_| (THICK / 0.8, 0.8));
        let position = DVec3::new(0.3, -0.2, -3.0);
        let lamp = Lamp { position, intensity: [9.0; 3], range: None, radius: 0.0 };
        let lamp = Light { name: "through_lamp".to_owned(), kind: LightKind::Point(lamp) };
        assert_through(&image_of(&lit_slab(lamp, shadows)), "a lamp", |at| {
            let distance = at.distance(position);
            (THICK * distance / 3.0, 9.0 / distance.powi(2) * 3.0 / distance)
        });
        let before = image_of(&lit_slab(beam("through_before", DVec3::NEG_Z), shadows));
        let own = image_of(&lit_slab(beam("through_before", DVec3::NEG_Z), shadows).without_transmission());
        assert!(before == own, "a light in front has no far side here");
    }
}

/// A scene without the effect.
trait Without {
    fn without_transmission(self) -> Self;
}

impl Without for Scene {
    fn without_transmission(mut self) -> Self {
        self.effects = self.effects.without(effect("transmission"));
        self
    }
}

fn image_of(scene: &Scene) -> Image {
    image(scene, &bakes(scene))
}

#[test]
fn what_stands_before_the_far_side_makes_the_way_longer_and_a_hole_lets_nothing_through() {
    // A second slab behind the first, a gap of 1 between.
    let mut scene = lit_slab(beam("through_two", DVec3::Z), true);
    let PosedMesh { positions, normals, uvs, triangles, .. } = slab(THICK as f32);
    let first = scene.mesh.positions.len() as u32;
    scene.mesh.positions.extend(positions.into_iter().map(|p| p - 1.5 * Vec3::Z));
    scene.mesh.normals.extend(normals);
    scene.mesh.uvs.extend(uvs);
    scene.mesh.triangles.extend(triangles.into_iter().map(|t| t.map(|i| i + first)));
    assert_through(&image_of(&scene), "two", |_| (1.5 + THICK, 1.0));
    // The front alone.
    let mut sheet = lit_slab(beam("through_sheet", DVec3::Z), true);
    let half = sheet.mesh.triangles.len() / 2;
    sheet.mesh.triangles.truncate(half);
    assert!(image_of(&sheet).rgb.iter().all(|rgb| *rgb == [0.0; 3]));
}

/// What is found of the thickness at each vertex, in millimetres.
fn thickness(scene: &Scene) -> Vec<f32> {
    let posed = scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let field = Field::from_name("thickness").unwrap();
    let baked = bakes(scene);
    let bakes = (&baked).into();
    let surface = PosedSurface::with_fields(scene, &posed, &rays, &[], bakes, Fields::of([field])).unwrap();
    surface.field_of_vertices(field)
}

/// A mesh under an uneven sky, lit by that alone.
fn under_sky(mesh: &PosedMesh) -> Scene {
    let scene = scene(mesh, gentle, Choices::default());
    Scene { effects: Effects::of(&[Effect::Diffuse, effect("transmission")]), ..scene }
}

#[test]
fn a_sphere_is_as_thick_as_its_cone_says_for_any_number_of_threads_and_kept() {
    let mut ball = under_sky(&shape(0.0, true));
    ball.metres_per_unit = 0.002;
    let found = [1, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| thickness(&ball))
    });
    assert!(found[0] == found[1]);
    // A ray at an angle t from -N leaves 2 r cos^2 t below. The mean of 1 / cos^2 over a cone of 30 degrees, by the cosine, is
    // 2 ln(1 / cos 30) / sin^2 30.
    let want = 2.0 * 2.0 / (8.0 * (1.0 / 30.0_f64.to_radians().cos()).ln());
    let found: Vec<f64> = found[0].iter().map(|&d| f64::from(d)).collect();
    // Facets lie below the sphere, and 64 rays are noisy: 3%.
    assert!((quantile(&found, 0.5) - want).abs() < 0.03 * want, "{} {want}", quantile(&found, 0.5));
    let cache = tempfile::tempdir().unwrap();
    let pose = |weights: &[f32]| ball.mesh.pose_with_weights(weights);
    let kept = [false, true].map(|again| {
        let (baked, stats) = bake(&ball, &pose, &Ranges::of(&ball, false), Some(cache.path())).unwrap();
        let row = |row: &&BakeRow| row.name == "thickness";
        assert_eq!(stats.rows.iter().find(row).map(|row| row.cached), Some(again));
        baked.thickness
    });
    assert!(kept[0].is_some() && kept[0] == kept[1]);
}

#[test]
fn nothing_is_baked_that_is_not_asked_for() {
    let ball = under_sky(&shape(0.0, true));
    assert!(bakes(&ball).thickness.is_some());
    assert!(bakes(&ball.clone().without_transmission()).thickness.is_none());
    // Lights alone have ways of their own.
    let slab = lit_slab(beam("through_asked", DVec3::Z), true);
    assert!(bakes(&slab).thickness.is_none());
    let fields: Vec<&str> = slab.needs().fields.iter().map(Field::name).collect();
    let wanted = ["light_through_asked_depth", "light_through_asked_far"];
    assert!(wanted.iter().all(|name| fields.contains(name)), "{fields:?}");
}

/// The built-in head, so small that light comes through it, in `pixels` pixels a side.
fn head_by(method: Method, pixels: u32) -> Baked {
    let more = [Effect::NormalMap, Effect::Lights, Effect::Shadows, effect("transmission")];
    head_changed(&more, |scene| {
        scene.choices.transmission.method = method;
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (pixels, pixels);
        scene.metres_per_unit = 0.004;
        scene.params.set(param("transmission_unit"), 4.0);
        scene.params.set_rgb(param("transmission_weight"), [0.7, 0.5, 0.9]);
    })
}

/// From within a slab all rays leave by the other side, those at an angle t after d / cos t: of light that is even over that side
/// the share of exp(-d / (l cos t)), weighted by the cosine, comes through, which is 2 E_3(d / l).
#[test]
fn gathered_light_comes_through_a_slab_as_the_exponential_integral_says() {
    let mut scene = lit_slab(beam("through_gathered", DVec3::Z), true);
    scene.choices.transmission.method = Method::Gathered;
    scene.quality.occlusion_rays = 256;
    let names: Vec<&str> = scene.needs().fields.iter().map(Field::name).collect();
    let own = ["light_through_gathered_far_light_0", "light_through_gathered_far_light_3"];
    assert!(own.iter().all(|name| names.contains(name)), "{names:?}");
    assert!(names.iter().all(|name| !name.ends_with("_depth") && *name != "thickness"), "{names:?}");
    // 2 E_3, a sum over the square of the cosine.
    let through = |depth: f64| -> f64 {
        let steps = 20_000;
        let at = |i: i32| ((f64::from(i) + 0.5) / f64::from(steps)).sqrt();
        (0..steps).map(|i| (-depth / at(i)).exp() / f64::from(steps)).sum()
    };
    let image = image_of(&scene);
    for (i, rgb) in image.rgb.iter().enumerate() {
        for c in 0..3 {
            let want = WEIGHT[c] * through(UNIT * THICK / LENGTH[c]) / PI;
            // Of a cubic, as it says; of 256 stratified rays a hundredth.
            let most = WEIGHT[c] * 0.005 / PI + 0.01 * want;
            assert!((f64::from(rgb[c]) - want).abs() < most, "pixel {i}, channel {c}: {} {want}", rgb[c]);
        }
    }
    // A light in front comes in nowhere.
    let mut before = lit_slab(beam("through_gathered", DVec3::NEG_Z), true);
    let own = image_of(&before.clone().without_transmission());
    before.choices.transmission.method = Method::Gathered;
    assert!(image_of(&before) == own);
}

/// What an exported mesh hands to a rasteriser is the sum that samples are shaded by.
#[test]
fn vertices_have_gathered_light_told_apart_and_weakened() {
    let baked = head_by(Method::Gathered, 16);
    let scene = &baked.scene;
    let posed = scene.mesh.pose();
    let rays = RayMesh::of(&posed);
    let surface = PosedSurface::new(scene, &posed, &rays, &[], baked.surface_bakes()).unwrap();
    let handed: HashMap<&str, Vec<f32>> =
        fields_at_vertices(scene, &surface).into_iter().map(|(field, of)| (field.name(), of)).collect();
    assert!(handed.keys().all(|name| !name.contains("far_light_")), "{:?}", handed.keys());
    let fields = scene.needs().fields.iter().filter(|field| field.name().contains("far_light_"));
    let held: HashMap<&str, Vec<f32>> =
        fields.map(|field| (field.name(), surface.field_of_vertices(field))).collect();
    let length = scene.params.rgb(param("transmission_length"));
    let weakened = |c: usize, of: &dyn Fn(usize) -> f32| -> f64 {
        NODES.iter().enumerate().map(|(k, node)| (-node / length[c]).exp() * f64::from(of(k))).sum()
    };
    let mut brightest = [0.0_f64; 2];
    for (i, whole) in handed["far_light"].iter().enumerate() {
        let sky = weakened(i % 3, &|k| held[format!("far_light_{k}").as_str()][i]);
        let lamp =
            weakened(i % 3, &|k| held[format!("light_side_far_light_{}", k / 3).as_str()][i / 3 * 3 + k % 3]);
        // Sums of twelve in 32 bits, some of them below 0.
        assert!((f64::from(*whole) - sky).abs() < 1e-5, "{i}: {whole} {sky}");
        assert!((f64::from(handed["light_side_far_light"][i]) - lamp).abs() < 1e-5, "{i}: {lamp}");
        brightest = [brightest[0].max(sky), brightest[1].max(lamp)];
    }
    assert!(brightest.iter().all(|light| *light > 0.01), "nothing comes through: {brightest:?}");
}

#[test]
fn at_a_weight_of_0_an_image_is_what_it_is_without_the_effect() {
    for method in [Method::Thickness, Method::Gathered] {
        let with =
            head_by(method, 24).with_scene(|scene| scene.params.set(param("transmission_weight"), 0.0));
        let without = with.clone().with_scene(|scene| *scene = scene.clone().without_transmission());
        assert!(on_cpu(&with) == on_cpu(&without), "{method:?}");
    }
}

#[test]
fn slopes_are_finite_differences_on_every_engine() {
    for method in [Method::Thickness, Method::Gathered] {
        slopes_of(head_by(method, 16));
    }
}

fn slopes_of(baked: Baked) {
    let target = brighter(on_cpu(&baked));
    let baked = baked.with_scene(|scene| scene.views[0].target = Some(target));
    let mut columns = vec!["base_weight", "light.side.color", "environment_rotation"];
    columns.extend(["transmission_weight", "transmission_length"]);
    let tied = columns.into_iter().map(|name| Column::tied(param(name)));
    let each = Column::per_channel(param("transmission_length"));
    for (columns, alike) in [(tied.collect::<Vec<_>>(), true), (each.to_vec(), false)] {
        // A tied column moves all channels together from where red stands.
        let baked = baked.clone().with_scene(|scene| {
            if alike {
                scene.params.set(param("transmission_weight"), 0.7);
                scene.params.set(param("transmission_length"), 2.0);
            }
        });
        let observed = baked.sample().unwrap().observe().unwrap();
        let unknowns: Vec<Unknown> = columns.into_iter().map(Unknown::Param).collect();
        slopes::assert_slopes(&observed, &unknowns, &slopes::EXACT, "transmission");
    }
}

#[test]
fn the_renderer_draws_what_the_processor_does_by_every_method() {
    let Some(gpu) = gpu() else { return };
    let camera_of = |scene: &Scene| scene.views[0].camera;
    for method in Method::ALL {
        let baked = head_by(method, 32);
        let want = on_cpu(&baked);
        let camera = camera_of(&baked.scene);
        let got = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
        let Difference { interior, .. } = Difference::new(&want, &got, 4);
        // Half of the pixels face the light, and have its shadow at vertices there and at samples here.
        assert!(bench::quantile(&interior, 0.5) < 1e-4, "{method:?}: {}", bench::quantile(&interior, 0.5));
        // Where it comes through, ways are interpolated, or of a map's texels.
        assert!(bench::quantile(&interior, 0.9) < 0.02, "{method:?}: {}", bench::quantile(&interior, 0.9));
    }
}

/// What vertices hold is weakened by the lengths that are set, and shows.
#[test]
fn a_renderer_takes_gathered_light_of_other_lengths() {
    let Some(gpu) = gpu() else { return };
    let baked = head_by(Method::Gathered, 24);
    let camera = baked.scene.views[0].camera;
    let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
    let mut drawn = |baked: &Baked| {
        renderer.set_params(&baked.scene.params).unwrap();
        renderer.render(&camera, 1.0).unwrap().image
    };
    let longer =
        baked.clone().with_scene(|scene| scene.params.set_rgb(param("transmission_length"), [9.0, 5.0, 3.0]));
    let without = baked.clone().with_scene(|scene| scene.params.set(param("transmission_weight"), 0.0));
    let images = [&baked, &longer, &without].map(|baked| (drawn(baked), on_cpu(baked)));
    let interior = |a: &Image, b: &Image| Difference::new(a, b, 4).interior;
    for (got, want) in &images {
        // As above: half of the pixels face the light. Gathered light is of vertices on both sides.
        assert!(bench::quantile(&interior(want, got), 0.5) < 1e-4);
    }
    for other in [1, 2] {
        assert!(bench::quantile(&interior(&images[0].0, &images[other].0), 0.5) > 1e-3, "{other}");
    }
}

#[test]
fn the_table_is_read_and_what_it_lacks_is_told() {
    let folder = SceneFolder::new();
    let (scene, _) = folder.load().unwrap();
    assert_eq!(scene.choices.transmission.method, Method::Thickness);
    let with = |table: &str, effects: &str| {
        let text = SCENE.replace("[model]\n", &format!("[model]\neffects = [{effects}]\n"));
        folder.write("scene.toml", (text + table).as_bytes());
        folder.load()
    };
    let table = "[transmission]\nmethod = \"shadow_maps\"\n";
    let (scene, _) =
        with("[transmission]\nmethod = \"gathered\"\n", "\"diffuse\", \"transmission\"").unwrap();
    assert_eq!(scene.choices.transmission.method, Method::Gathered);
    let (scene, warnings) = with(table, "\"diffuse\", \"transmission\"").unwrap();
    assert_eq!(scene.choices.transmission.method, Method::ShadowMaps);
    assert_eq!(scene.params.scalar(param("transmission_unit")), 1000.0);
    assert!(warnings.iter().any(|warning| warning.to_string().contains("of which there are none")));
    let (_, warnings) = with("", "\"hilite\", \"transmission\"").unwrap();
    assert!(warnings.iter().any(|warning| warning.to_string().contains("does nothing without `diffuse`")));
    for (table, words) in [
        ("[transmission]\nmethod = \"shadow_map\"\n", "Did you mean `shadow_maps`?"),
        ("[transmission]\nmode = \"thickness\"\n", "mode"),
    ] {
        let error = with(table, "\"diffuse\"").unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

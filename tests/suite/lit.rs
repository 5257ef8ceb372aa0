//! Lights as effects: the path tracer's calibration scenes through both engines and the renderers, slopes against finite
//! differences, and lights that are taken out of a panorama.

use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::{Objective, Task, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::effects::{Effect, Effects};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::image::Image;
use skinfit::render::shade::Shader;
use skinfit::scene::Scene;
use skinfit::scene::view::Target;

use crate::common;
use crate::fixtures::quantile;
use crate::graphics::bench::cache;
use crate::graphics::bench::{EXACT, gpu};
use crate::scene_folder::{SCENE, SceneFolder, exr};
use crate::slopes;

/// Reflectance of sphere and plane.
const ALBEDO: f64 = 0.5;

pub(crate) fn param(name: &str) -> Param {
    // Those of the library are known to whoever asks first.
    skinfit::shader::term::library::register_all();
    Param::from_name(name).unwrap_or_else(|| panic!("no parameter {name}"))
}

/// A calibration scene with its lamp on: sphere and plane are white, and `base_weight` makes them grey.
pub(crate) fn calibration(name: &str) -> Option<Baked> {
    let path = common::data()?.join(format!("calib_lights/{name}.toml"));
    let effects = Some(Effects::of(&[Effect::Lights, Effect::Shadows]));
    let options = PrepareOptions { fit: true, effects, cache: Some(cache()), ..PrepareOptions::default() };
    let baked = Baked::new(&path, &options).unwrap();
    Some(baked.with_scene(|scene: &mut Scene| {
        scene.params.set(Param::BaseWeight, ALBEDO);
        scene.quality.shadow_rays = 4;
    }))
}

/// What the image shows beside the target, of the pixels that both cover and the lamp lights, in their order.
fn ratios(image: &Image, target: &Target) -> Vec<f64> {
    let lit = |i: usize| f64::from(target.rgb[i][1]);
    let brightest = (0..target.rgb.len()).map(lit).fold(0.0, f64::max);
    let covered = |i: usize| target.alpha.as_ref().is_none_or(|alpha| alpha[i] > 0.999);
    let whole = |i: &usize| image.alpha[*i] > 0.999 && covered(*i);
    let mut ratios: Vec<f64> = (0..image.rgb.len())
        .filter(whole)
        .filter(|&i| lit(i) > 0.1 * brightest)
        .map(|i| f64::from(image.rgb[i][1]) / lit(i))
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios
}

/// The image is the target but for its pixel filter, which shows at shadows' edges and silhouettes.
fn assert_calibrated(name: &str, image: &Image, target: &Target) {
    let ratios = ratios(image, target);
    assert!(ratios.len() > 5_000, "{name}: {} pixels", ratios.len());
    let at = |share: f64| quantile(&ratios, share);
    // The path tracer's own figures beside closed forms are 0.9996 to 1.0001 in the middle and 1% at the terminator.
    assert!((at(0.5) - 1.0).abs() < 1e-3, "{name}: median {}", at(0.5));
    assert!(at(0.05) > 0.98 && at(0.95) < 1.02, "{name}: {} {}", at(0.05), at(0.95));
}

#[test]
fn lamps_light_and_shade_as_the_path_tracer_has_it() {
    for name in ["directional", "point", "spot", "directional_soft", "point_soft"] {
        let Some(baked) = calibration(name) else { return };
        let sampled = baked.clone().sample().unwrap();
        let camera = &sampled.scene.views[0].camera;
        let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params).unwrap();
        let target = sampled.scene.views[0].target.as_ref().unwrap();
        assert_calibrated(name, &shader.shade(&sampled.samples[0], camera, 1.0).image, target);
    }
}

#[test]
fn a_lamps_colour_is_fitted_on_both_engines() {
    let Some(baked) = calibration("point") else { return };
    let observed = baked.sample().unwrap().observe().unwrap();
    let color = param("light.point.color");
    let unknowns: Vec<Unknown> = Column::per_channel(color).map(Unknown::Param).to_vec();
    let task = || Task { unknowns: unknowns.clone(), ..observed.task() };
    let mut start = observed.start();
    start.params.set(color, 0.3);
    let fitted = |engine: &dyn Objective| {
        fit(engine, &start, &FitOptions::default(), &mut |_| {}).unwrap().end.params.rgb(color)
    };
    let cpu = fitted(&CpuEngine::new(task()).unwrap());
    // The scene was rendered at 1; edges of shadows are filtered otherwise.
    assert!(cpu.iter().all(|x| (x - 1.0).abs() < 0.005), "{cpu:?}");
    let Some(gpu) = gpu() else { return };
    let gpu = fitted(&GpuEngine::new(gpu, task(), &start, Memory::default()).unwrap());
    // Sums of 10^5 numbers in f32.
    assert!((0..3).all(|c| (gpu[c] - cpu[c]).abs() < 1e-4), "{gpu:?} {cpu:?}");
}

/// A light from one direction.
pub(crate) const KEY: &str = "
[[light]]
name = \"key\"
type = \"directional\"
direction = [-0.5, -0.6, -0.6]
irradiance = [3.0, 2.9, 2.7]
";

/// A quad under a light from one direction, a spot, and the sun of a panorama.
pub(crate) fn quad(effects: &str, environment: &str) -> SceneFolder {
    let folder = SceneFolder::new();
    // A sky of 0.2 with a sun of a few texels.
    let sun = |i: usize| (20..23).contains(&(i / 256)) && (20..23).contains(&(i % 256));
    folder.write(
        "env.exr",
        &exr(256, 128, &["R", "G", "B"], |c, i| if sun(i) { 300.0 + c as f32 } else { 0.2 }),
    );
    let lights = "
[[light]]
name = \"Lamp\"
type = \"spot\"
position = [0.4, 0.3, 1.5]
direction = [-0.1, -0.2, -1.0]
intensity = [2.0, 3.0, 4.0]
inner_degrees = 10
outer_degrees = 25
";
    let scene = SCENE
        .replace("file = \"env.exr\"", &format!("file = \"env.exr\"\n{environment}"))
        .replace("[model]\n", &format!("[model]\neffects = [{effects}]\n"));
    folder.write("scene.toml", format!("{scene}{KEY}{lights}").as_bytes());
    folder
}

pub(crate) fn baked(folder: &SceneFolder) -> Baked {
    let options = PrepareOptions { fit: true, cache: Some(cache()), ..PrepareOptions::default() };
    Baked::new(&folder.path("scene.toml"), &options).unwrap()
}

pub(crate) fn image(baked: &Baked) -> Image {
    let sampled = baked.clone().sample().unwrap();
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params).unwrap();
    shader.shade(&sampled.samples[0], &sampled.scene.views[0].camera, 1.0).image
}

const ALL: &str = "\"normal_map\", \"rim\", \"lights\", \"shadows\"";

#[test]
fn slopes_along_a_lights_numbers_are_finite_differences_on_every_engine() {
    let observed = baked(&quad(ALL, "lights = 1")).sample().unwrap().observe().unwrap();
    let names = [
        "light.key.color",
        "light.key.azimuth",
        "light.key.elevation",
        "light.lamp.color",
        "light.sky_1.color",
        "light.sky_1.azimuth",
        "light.sky_1.elevation",
        "environment_rotation",
        "base_weight",
        "rim_weight",
        "rim_exponent",
        "normal_strength",
    ];
    let unknowns: Vec<Unknown> = names.map(|name| Unknown::Param(Column::tied(param(name)))).to_vec();
    slopes::assert_slopes(&observed, &unknowns, &slopes::EXACT, "lights");
}

/// Whatever of it is free: what moves lookups too, and what such plans hold although it could move them.
#[test]
fn lit_skin_is_compiled_ahead_and_moves_as_the_rules_say() {
    let effects = "\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"lights\", \"shadows\", \"light_specular\", \
                   \"fresnel\", \"directional_occlusion\"";
    let folder = quad(effects, "lights = 4");
    // Four suns in the place of one, and no lamps beside them.
    let sun = |i: usize| {
        let (x, y) = (i % 256, i / 256);
        [(20, 20), (60, 30), (100, 25), (140, 40)]
            .iter()
            .position(|&(left, top)| (left..left + 3).contains(&x) && (top..top + 3).contains(&y))
    };
    let light = |c: usize, i: usize| sun(i).map_or(0.2, |k| 300.0 + (20 * k + c) as f32);
    folder.write("env.exr", &exr(256, 128, &["R", "G", "B"], light));
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    let (scene, _lamps) = text.split_once("[[light]]").unwrap();
    let choices = "specular_model = \"ggx\"\nspecular_visibility = \"cone\"\nspecular_map = \"f0\"\n";
    assert!(scene.contains("[model]\n") && scene.contains("[model.params]\n"), "{scene}");
    let scene = scene
        .replace("[model]\n", &format!("[model]\n{choices}"))
        .replace("[model.params]\n", "[model.params]\ngloss = 0.3\n");
    folder.write("scene.toml", scene.as_bytes());
    let observed = baked(&folder).sample().unwrap().observe().unwrap();
    let weights = ["base_weight", "rim_weight", "rim_exponent", "specular_weight", "f0"];
    let free: [&[&str]; 3] =
        [&["normal_strength"], &["normal_strength", "roughness", "gloss"], &["roughness", "gloss"]];
    for moving in free {
        let names = weights.iter().chain(moving);
        let unknowns: Vec<Unknown> = names.map(|name| Unknown::Param(Column::tied(param(name)))).collect();
        let task = Task { unknowns: unknowns.clone(), ..observed.task() };
        assert!(CpuEngine::new(task).unwrap().is_compiled_ahead(&observed.start()), "{moving:?}");
        slopes::assert_slopes(&observed, &unknowns, &slopes::EXACT, "lit skin");
    }
}

#[test]
fn the_renderer_draws_what_the_processor_does() {
    let baked = baked(&quad(&format!("\"diffuse\", {ALL}"), "lights = 1"));
    let want = image(&baked);
    let Some(gpu) = gpu() else { return };
    let camera = baked.scene.views[0].camera;
    let got = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
    for (i, (got, want)) in got.rgb.iter().zip(&want.rgb).enumerate() {
        // The processor interpolates in f64, the adapter in f32, and the quad's tangents vary.
        assert!((0..3).all(|c| (got[c] - want[c]).abs() < 1e-4 * want[c] + 1e-5), "{i}: {got:?} {want:?}");
    }
}

#[test]
fn taking_the_sun_out_of_the_panorama_leaves_an_open_surface_as_bright() {
    let whole = image(&baked(&quad("\"diffuse\"", "")));
    let taken = image(&baked(&quad("\"diffuse\", \"light_sky_1\", \"lights\"", "lights = 1")));
    for (got, want) in taken.rgb.iter().zip(&whole.rgb) {
        for c in 0..3 {
            // The sun is a spot of four texels, and the cube's texels are wider than it.
            assert!((got[c] - want[c]).abs() < 0.01 * want[c] + 1e-6, "{got:?} {want:?}");
        }
    }
}

#[test]
fn a_light_of_the_panorama_turns_with_it() {
    let turned = image(&baked(&quad("\"diffuse\", \"lights\"", "lights = 1\nrotation_degrees = 40")));
    let baked = baked(&quad("\"diffuse\", \"lights\"", "lights = 1"))
        .with_scene(|scene| scene.params.set(Param::EnvironmentRotation, 40.0));
    for (got, want) in image(&baked).rgb.iter().zip(&turned.rgb) {
        for c in 0..3 {
            // The cubes are baked at another turn: their texels are two degrees wide, and the sky is even.
            assert!((got[c] - want[c]).abs() < 1e-3 * want[c] + 1e-6, "{got:?} {want:?}");
        }
    }
}

#[test]
fn lights_are_off_without_their_effect_and_their_numbers_are_the_scenes() {
    let folder = quad("\"diffuse\"", "lights = 1");
    let (scene, _) = folder.load().unwrap();
    assert!(scene.sky_lights.is_empty() && scene.effects == Effects::of(&[Effect::Diffuse]));
    let on = baked(&quad(ALL, "lights = 2"));
    let names: Vec<&str> = on.scene.effects.added().map(Effect::name).collect();
    assert_eq!(names.len(), 4, "{names:?}");
    // There is one sun: the second has nothing to give.
    assert_eq!(on.scene.params.rgb(param("light.sky_2.irradiance")), [0.0; 3]);
    assert_eq!(on.scene.params.rgb(param("light.key.irradiance")), [3.0, 2.9, 2.7]);
    assert_eq!(
        on.scene.effects.without(Effect::Lights),
        Effects::of(&[Effect::NormalMap, Effect::Rim, Effect::Shadows])
    );
    for (table, words) in [
        ("[fit]\nfree = [\"light.key.irradiance\"]", "no fit moves it"),
        ("[model.params]\n\"light.key.irradiance\" = 2", "follows from the scene's lights"),
    ] {
        let scene = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
        let (head, _) = table.split_once('\n').unwrap();
        folder.write("scene.toml", scene.replacen(head, table, 1).as_bytes());
        let error = folder.load().unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("line"), "{error}");
        folder.write("scene.toml", scene.as_bytes());
    }
}

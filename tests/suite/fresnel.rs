//! The effects `fresnel` and `light_specular`: closed forms, slopes against finite differences on every engine, the
//! renderer, exports, fits, and neutral values.

use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::{Objective, Point, Task, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::choices::{SpecularModel, SplitSum};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::Baked;
use skinfit::render::image::Image;
use skinfit::shader::Facts;
use skinfit::shader::facts::Budget;
use skinfit_core::specular::split_sum::{Quadrature, dielectric_sum, split_sum};

use crate::graphics::bench::{EXACT, gpu};
use crate::lit::{baked, image, param, quad};
use crate::scene_folder::{SCENE, SceneFolder, encode, exr};
use crate::slopes::{self, Nearness};

const EFFECTS: &str = "\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"lights\", \"shadows\", \"light_specular\", \
                       \"fresnel\"";

/// The choices that are told apart: a scene's lines of `[model]`.
const CHOICES: [&str; 6] = [
    "specular_model = \"kelemen\"",
    "specular_model = \"ggx\"\nspecular_map = \"f0\"\nnormal_filter = \"toksvig\"",
    "specular_model = \"ggx\"\nsplit_sum = \"exact\"\nspecular_map = \"f0\"",
    "specular_model = \"ggx\"\nspecular_visibility = \"none\"\nlobe_lookup = \"off_peak\"",
    "specular_visibility = \"cone\"\nspecular_map = \"f0\"\nnormal_filter = \"toksvig\"",
    "specular_visibility = \"cone\"\nlobe_lookup = \"off_peak\"",
];

/// Light by rays, which a rasteriser has not.
const TRACED: &str =
    "specular_visibility = \"rays\"\nspecular_model = \"ggx\"\nsplit_sum = \"exact\"\nspecular_map = \"f0\"";

/// The quad of the lights' tests with maps that vary, under those choices.
fn scene(choices: &str, params: &str) -> SceneFolder {
    let folder = quad(EFFECTS, "lights = 1");
    let gradient = |x: u32, y: u32| image::Rgb([(40 * x + 20 * y) as u8, 0, 0]);
    folder.write("data.png", &encode(image::RgbImage::from_fn(4, 4, gradient), image::ImageFormat::Png));
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    let text = text.replace("[model]\n", &format!("[model]\n{choices}\n"));
    let text = text.replace("[model.params]\n", &format!("[model.params]\n{params}\n"));
    folder.write("scene.toml", text.as_bytes());
    folder
}

const PARAMS: &str =
    "roughness = 0.4\ngloss = 0.3\nspecular_weight = [0.9, 0.7, 0.5]\nf0 = 0.06\nfresnel_loss = 0.7";

fn free() -> Vec<Unknown> {
    let names = [
        "roughness",
        "gloss",
        "f0",
        "f0_floor",
        "fresnel_loss",
        "normal_strength",
        "occlusion",
        "base_weight",
        "rim_exponent",
        "environment_rotation",
        "light.key.azimuth",
        "light.sky_1.color",
    ];
    let weights = Column::per_channel(param("specular_weight"));
    let tied = names.map(|name| Column::tied(param(name)));
    weights.into_iter().chain(tied).map(Unknown::Param).collect()
}

/// The columns that those choices ask for.
fn moving(choices: &str) -> Vec<Unknown> {
    let floor = param("f0_floor");
    let keeps = |unknown: &Unknown| match unknown {
        Unknown::Param(column) => column.param != floor || choices.contains("specular_map = \"f0\""),
        _ => true,
    };
    free().into_iter().filter(keeps).collect()
}

/// Cubes hold f32: a step leaves roundings of 1e-4 in what moves between them, and an error of its square. Sums of f32
/// cancel: some tens of roundings in each residual.
const NEAR: Nearness = Nearness { step: 1e-4, difference: 2e-4, loss: 3e-5, slope: [3e-4, 1e-5] };

#[test]
fn slopes_are_finite_differences_on_every_engine() {
    // A light's parameters are known once a scene was read.
    drop(baked(&scene(CHOICES[0], PARAMS)));
    for choices in CHOICES.into_iter().chain([TRACED]) {
        let unknowns = moving(choices);
        let columns: Vec<Column> = unknowns
            .iter()
            .filter_map(|unknown| match unknown {
                Unknown::Param(column) => Some(*column),
                _ => None,
            })
            .collect();
        let bake = free_in(&scene(choices, PARAMS), &columns);
        let observed = bake.sample().unwrap().observe().unwrap();
        slopes::assert_slopes(&observed, &unknowns, &NEAR, choices);
    }
}

/// The same scene baked with those columns free.
fn free_in(folder: &SceneFolder, columns: &[Column]) -> Baked {
    let mut names: Vec<String> = Vec::new();
    for column in columns {
        let name = format!("\"{}\"", column.param.name());
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    let text = text.replace("[fit]\n", &format!("[fit]\nfree = [{}]\n", names.join(", ")));
    folder.write("scene.toml", text.as_bytes());
    baked(folder)
}

/// A scene of nothing but the environment's lobe, under light of 1 from everywhere.
fn furnace(model: SpecularModel, sum: SplitSum, roughness: f64, f0: f64) -> (Image, Baked) {
    let folder = SceneFolder::new();
    folder.write("env.exr", &exr(8, 4, &["R", "G", "B"], |_, _| 1.0));
    let lines = format!(
        "[model]\neffects = [\"fresnel\"]\nspecular_model = \"{}\"\nsplit_sum = \"{}\"\nspecular_visibility = \"none\"\n",
        model.name(),
        sum.name()
    );
    let text = SCENE
        .replace("[model]\n", &lines)
        .replace("[model.params]\n", &format!("[model.params]\nroughness = {roughness}\nf0 = {f0}\n"));
    folder.write("scene.toml", text.replace("specular = \"data.png\"\n", "").as_bytes());
    let baked = baked(&folder);
    (image(&baked), baked)
}

#[test]
fn in_a_white_furnace_the_lobe_shows_the_split_sum() {
    let all = || SpecularModel::ALL.into_iter().flat_map(|model| SplitSum::ALL.map(|sum| (model, sum)));
    for (model, sum) in all() {
        for (roughness, f0) in [(0.05, 0.028), (0.35, 0.0), (0.35, 0.2), (1.0, 0.1)] {
            let (image, baked) = furnace(model, sum, roughness, f0);
            let camera = baked.scene.views[0].camera;
            let mut seen = 0;
            for (i, (rgb, alpha)) in image.rgb.iter().zip(&image.alpha).enumerate() {
                if *alpha < 1.0 {
                    continue;
                }
                // The quad faces the camera; the mean of a pixel's four samples is nearly that of its middle.
                let (x, y) =
                    (f64::from(i as u32 % camera.width) + 0.5, f64::from(i as u32 / camera.width) + 0.5);
                let tangent = (0.5 * camera.fov_y).tan() / (0.5 * f64::from(camera.height));
                let [u, v] = [x - 0.5 * f64::from(camera.width), y - 0.5 * f64::from(camera.height)]
                    .map(|offset| offset * tangent);
                let cosine = 1.0 / (1.0 + u * u + v * v).sqrt();
                // Kelemen's own factor is Schlick's.
                let want = match (model, sum) {
                    (SpecularModel::Ggx, SplitSum::Exact) => {
                        dielectric_sum(model, cosine, roughness, f0, Quadrature::FINE).0.value
                    }
                    _ => {
                        let [a, b] = split_sum(model, cosine, roughness, Quadrature::FINE).map(|x| x.value);
                        f0 * a + b
                    }
                };
                for c in 0..3 {
                    // The fits' 2e-4, and a pixel's curvature of cosines near 1.
                    assert!(
                        (f64::from(rgb[c]) - want).abs() < 4e-4,
                        "{model:?} {sum:?} {roughness} {f0}: {rgb:?} {want}"
                    );
                }
                seen += 1;
            }
            assert!(seen > 3, "{seen}");
        }
    }
}

#[test]
fn the_renderer_draws_what_the_processor_does() {
    let Some(gpu) = gpu() else { return };
    for choices in CHOICES {
        let baked = baked(&scene(choices, PARAMS));
        let want = image(&baked);
        let camera = baked.scene.views[0].camera;
        let got = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
        for (i, (got, want)) in got.rgb.iter().zip(&want.rgb).enumerate() {
            // The processor interpolates in f64, the adapter in f32; a lobe's peak sharpens that.
            let close = (0..3).all(|c| (got[c] - want[c]).abs() < 1e-3 * want[c] + 1e-4);
            assert!(close, "{choices}: {i}: {got:?} {want:?}");
        }
    }
}

#[test]
fn with_a_weight_of_nothing_the_image_is_that_without_the_effects() {
    let neutral = "specular_weight = 0";
    let with = image(&baked(&scene(CHOICES[0], neutral)));
    let folder = scene("", "");
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    folder.write("scene.toml", text.replace(", \"light_specular\", \"fresnel\"", "").as_bytes());
    let without = image(&baked(&folder));
    for (with, without) in with.rgb.iter().zip(&without.rgb) {
        // The same products in another order.
        assert!((0..3).all(|c| (with[c] - without[c]).abs() <= 1e-6 * without[c]), "{with:?} {without:?}");
    }
}

#[test]
fn hard_cases_are_finite_in_value_and_slope() {
    let hard = [
        "roughness = 0.05\nf0 = 0",
        "roughness = 1\nf0 = 0.2\ngloss = 0.9",
        "roughness = 0.05\ngloss = 0.9\nf0 = 0.2",
    ];
    for (i, choices) in CHOICES.into_iter().chain([TRACED]).enumerate() {
        // Two of them in turn.
        for params in [hard[i % 3], hard[(i + 1) % 3]] {
            // A light's parameters are known once its scene was read.
            let observed = baked(&scene(choices, params)).sample().unwrap().observe().unwrap();
            let unknowns = moving(choices);
            let task = Task { unknowns: unknowns.clone(), ..observed.task() };
            let point: Point = observed.start();
            let (loss, slopes) = CpuEngine::new(task).unwrap().gradient(&point);
            assert!(
                loss.is_finite() && slopes.iter().all(|slope| slope.is_finite()),
                "{choices} {params}: {slopes:?}"
            );
        }
    }
}

#[test]
fn both_engines_find_the_constants_that_made_the_target() {
    let folder = scene(CHOICES[1], PARAMS);
    let names = ["specular_weight", "roughness", "base_weight"].map(param);
    let columns = names.map(Column::tied);
    let bake = free_in(&folder, &columns);
    let made = image(&bake.clone().with_scene(|scene| {
        for (param, value) in names.into_iter().zip([0.8, 0.33, 0.9]) {
            scene.params.set(param, value);
        }
    }));
    folder.write(
        "target.exr",
        &exr(4, 4, &["R", "G", "B", "A"], |c, i| if c == 3 { made.alpha[i] } else { made.rgb[i][c] }),
    );
    let observed = baked(&folder).sample().unwrap().observe().unwrap();
    let unknowns = columns.map(Unknown::Param).to_vec();
    let task = || Task { unknowns: unknowns.clone(), ..observed.task() };
    let start = {
        let mut start = observed.start();
        start.params.set(names[0], 0.5);
        start.params.set(names[1], 0.45);
        start
    };
    let fitted = |engine: &dyn Objective| -> Vec<f64> {
        let end = fit(engine, &start, &FitOptions::default(), &mut |_| {}).unwrap().end;
        names.iter().map(|&param: &Param| end.params.scalar(param)).collect()
    };
    let check = |got: Vec<f64>, what: &str| {
        for (got, want) in got.iter().zip([0.8, 0.33, 0.9]) {
            // Twelve pixels in f32 tell roughness and weight apart to some 1e-3.
            assert!((got - want).abs() < 1e-2, "{what}: {got} {want}");
        }
    };
    check(fitted(&CpuEngine::new(task()).unwrap()), "cpu");
    let Some(gpu) = gpu() else { return };
    check(fitted(&GpuEngine::new(gpu, task(), &start, Memory::default()).unwrap()), "gpu");
}

#[test]
fn a_lobe_that_goes_by_an_occlusion_which_is_off_is_told() {
    let warned = |choices: &str, effects: (&str, &str)| {
        let folder = scene(choices, "");
        let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
        folder.write("scene.toml", text.replace(effects.0, effects.1).as_bytes());
        let said: Vec<String> = folder.load().unwrap().1.iter().map(ToString::to_string).collect();
        said.into_iter().filter(|said| said.contains("specular_visibility")).collect::<Vec<_>>()
    };
    let (as_it_is, off) = (("", ""), (" \"occlusion\",", ""));
    for way in ["lagarde", "cone"] {
        let named = format!("specular_visibility = \"{way}\"");
        assert_eq!(warned(&named, as_it_is), [""; 0]);
        let said = warned(&named, off).concat();
        assert!(
            said.contains("scene.toml") && said.contains(&named) && said.contains("Add \"occlusion\""),
            "{said}"
        );
    }
    assert_eq!(warned("", off), [""; 0]);
    assert_eq!(warned("", (" \"occlusion\",", " \"directional_occlusion\",")).len(), 1);
    for way in ["none", "lobe", "rays"] {
        assert_eq!(warned(&format!("specular_visibility = \"{way}\""), off), [""; 0]);
    }
}

#[test]
fn exports_hold_the_lobe() {
    for (choices, share) in [(CHOICES[1], "share_of_ggx"), (CHOICES[2], "dielectric_share_of_ggx")] {
        let scene = baked(&scene(choices, PARAMS)).scene;
        let facts = scene.facts(&scene.params, Budget::Paper, false);
        let facts = Facts { setup: facts.setup, ..crate::exports::engine_facts() };
        let text = crate::exports::compiled_glsl(share, &facts);
        assert!(text.contains(&format!("skinfit_{share}(")) && text.contains("ROUGHNESS"), "{text}");
    }
}

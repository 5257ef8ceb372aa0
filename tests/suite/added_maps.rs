//! A term with maps of its own, one of a number and one of a colour: through its file and the scene's to samples and stored
//! texels, both engines, the renderer with every filter, and an export.

use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::{Objective, Task, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::gpu::upload::Content;
use skinfit::gpu::{RenderOptions, Renderer};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::image::Image;
use skinfit::render::shade::Shader;
use skinfit::shader::facts::MapFacts;
use skinfit::shader::term::register;
use skinfit::shader::{Budget, Facts};

use crate::graphics::bench::cache;
use crate::graphics::bench::{EXACT, gpu};
use crate::scene_folder::{SCENE, SceneFolder, encode, exr};

/// Spots whose density and colour images give.
pub(crate) const FRECKLES: &str = "\
// Light that freckles keep.
//
// effect: freckles, light that freckles keep
// parameter: freckle_weight = 1 in [0, inf), rgb, linear; how much of it there is; a test
// map: freckle: f32 = 0.25; how dense they are
// map: freckle_tint: vec3f = 0.5; what they are tinted with
//
// gives: freckle_part
// adds: freckles
// cost: 6
fn freckle_light(albedo: vec3f, freckle: f32, freckle_tint: vec3f, freckle_weight: vec3f) -> vec3f {
    return freckle_weight * (freckle * freckle_tint * albedo);
}
";

/// The same by way of a level of the UV atlas.
const SPREAD: &str = "\
// effect: spread_spots, what spots show of themselves in texels
// map: spot: f32 = 0.25; how dense they are
// map: spot_tint: vec3f = 0.5; what they are tinted with
//
// gives: spot_light
// domain: texel
// sampled: 0
// cost: 6
fn spot_level(albedo: vec3f, spot: f32, spot_tint: vec3f) -> vec3f {
    return spot * spot_tint * albedo;
}

// gives: spot_part
// adds: spread_spots
// cost: 1
fn spot_shown(spot_light: vec3f) -> vec3f {
    return spot_light;
}
";

const WEIGHT: [f64; 3] = [0.75, 2.0, 1.0];
const MODEL: &str = "[model]\neffects = [\"freckles\"]\nterms = [\"freckles.wgsl\"]\n[model.params]";
const OWN: &str = "[maps.own]\nfreckle = \"dense.exr\"\nfreckle_tint = \"tint.png\"\n";

/// The scene in files: the density grows with u, from column to column of four texels; `own` stands for its maps.
fn folder(own: &str, model: &str, quality: &str) -> SceneFolder {
    let folder = SceneFolder::new();
    folder.write("freckles.wgsl", FRECKLES.as_bytes());
    folder.write("spread.wgsl", SPREAD.as_bytes());
    folder.write("dense.exr", &exr(4, 4, &["R", "G", "B"], |_, i| 0.25 * (i % 4) as f32));
    let tint = image::RgbImage::from_pixel(2, 2, image::Rgb([220, 120, 20]));
    folder.write("tint.png", &encode(tint, image::ImageFormat::Png));
    let scene = SCENE.replace("[environment]", &format!("{own}[environment]"));
    let scene = scene
        .replace("[model]\n[model.params]", model)
        .replace("[quality]", &format!("[quality]\n{quality}"));
    folder.write("scene.toml", scene.as_bytes());
    folder
}

fn weighted(own: &str, quality: &str) -> SceneFolder {
    folder(own, &format!("{MODEL}\nfreckle_weight = {WEIGHT:?}"), quality)
}

fn baked(folder: &SceneFolder) -> Baked {
    let options = PrepareOptions { fit: true, cache: Some(cache()), ..PrepareOptions::default() };
    Baked::new(&folder.path("scene.toml"), &options).unwrap()
}

/// The image by hand: the quad faces the camera from two units away, so that a pixel shows what is at its centre, where the
/// density is linear in u.
fn by_hand(weight: [f64; 3], mapped: bool) -> Vec<[f64; 3]> {
    let half = 2.0 * 15_f64.to_radians().tan();
    let linear = |byte: f64| ((byte / 255.0 + 0.055) / 1.055).powf(2.4);
    let albedo = [linear(200.0), linear(100.0), 0.0];
    let pixel = |i: usize| {
        let x = (((i % 4) as f64 + 0.5) / 2.0 - 1.0) * half;
        let (density, tint) = if mapped {
            (0.25 * (4.0 * (x + 1.0) / 2.0 - 0.5), [linear(220.0), linear(120.0), linear(20.0)])
        } else {
            (0.25, [0.5; 3])
        };
        std::array::from_fn(|c| weight[c] * albedo[c] * density * tint[c])
    };
    (0..16).map(pixel).collect()
}

fn assert_image(image: &Image, (weight, mapped): ([f64; 3], bool), tolerance: f64, what: &str) {
    for (i, (got, want)) in image.rgb.iter().zip(by_hand(weight, mapped)).enumerate() {
        for c in 0..3 {
            let off = (f64::from(got[c]) - want[c]).abs();
            assert!(off < tolerance, "{what}: pixel {i}: {got:?} {want:?}");
        }
    }
}

/// Texture coordinates and blends of texels in f32, a few roundings each.
const ROUNDED: f64 = 2e-6;

fn of_processor(baked: &Baked) -> Image {
    let sampled = baked.clone().sample().unwrap();
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params).unwrap();
    shader.shade(&sampled.samples[0], &sampled.scene.views[0].camera, 1.0).image
}

#[test]
fn a_scenes_maps_reach_the_image_and_what_stands_in_where_it_has_none() {
    for (own, mapped) in [(OWN, true), ("", false)] {
        for filter in ["bilinear", "trilinear", "anisotropic"] {
            let folder = weighted(own, &format!("texture_filter = \"{filter}\""));
            let baked = baked(&folder);
            assert_image(&of_processor(&baked), (WEIGHT, mapped), ROUNDED, filter);
            let Some(gpu) = gpu() else { return };
            let camera = baked.scene.views[0].camera;
            let draw = |options: RenderOptions| {
                Renderer::new(gpu, Content::of(&baked), options).unwrap().render(&camera, 1.0).unwrap().image
            };
            assert_image(&draw(EXACT), (WEIGHT, mapped), ROUNDED, &format!("{filter}, the adapter"));
            let paper = RenderOptions { budget: Budget::Paper, ..EXACT };
            // Images in 16 bits, and 8 bits of a fraction: what the rules say, twice.
            assert_image(&draw(paper), (WEIGHT, mapped), 0.008, &format!("{filter}, its hardware"));
        }
    }
}

#[test]
fn both_engines_find_the_weight_that_made_the_target() {
    let folder = folder(OWN, MODEL, "");
    let image = by_hand(WEIGHT, true);
    let plane = |c: usize, i: usize| image[i].get(c).map_or(1.0, |x| *x as f32);
    folder.write(
        "target.exr",
        &exr(4, 4, &["R", "G", "B", "A"], |c, i| if c == 3 { 1.0 } else { plane(c, i) }),
    );
    let observed = baked(&folder).sample().unwrap().observe().unwrap();
    let weight = Param::from_name("freckle_weight").unwrap();
    let unknowns: Vec<Unknown> = Column::per_channel(weight).map(Unknown::Param).to_vec();
    let task = || Task { unknowns: unknowns.clone(), ..observed.task() };
    let start = observed.start();
    let check = |engine: &dyn Objective, what: &str| {
        let end = fit(engine, &start, &FitOptions::default(), &mut |_| {}).unwrap().end;
        for c in 0..2 {
            // The target is rounded to f32, and of the third channel nothing shows.
            assert!(
                (end.params.rgb(weight)[c] - WEIGHT[c]).abs() < 1e-5,
                "{what}: {:?}",
                end.params.rgb(weight)
            );
        }
    };
    check(&CpuEngine::new(task()).unwrap(), "cpu");
    let Some(gpu) = gpu() else { return };
    check(&GpuEngine::new(gpu, task(), &start, Memory::default()).unwrap(), "gpu");
}

/// Texels of the atlas read them, too, stored ones and those that an adapter draws.
#[test]
fn levels_of_the_atlas_read_maps() {
    let own = OWN.replace("freckle_tint", "spot_tint").replace("freckle", "spot");
    let model = "[model]\neffects = [\"spread_spots\"]\nterms = [\"spread.wgsl\"]\n[model.params]";
    let baked = baked(&folder(&own, model, ""));
    // A level's texel holds the centre's, and between two of them a fragment finds what is linear between.
    let wanted = ([1.0; 3], true);
    assert_image(&of_processor(&baked), wanted, ROUNDED, "the processor");
    let Some(gpu) = gpu() else { return };
    let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
    let image = renderer.render(&baked.scene.views[0].camera, 1.0).unwrap().image;
    assert_image(&image, wanted, ROUNDED, "the adapter");
}

/// Maps are no colours of a screen: numbers beyond 1 and below 0 stay.
#[test]
fn numbers_of_any_size_reach_the_image_through_the_hardwares_filters_too() {
    let folder = weighted(OWN, "");
    folder.write("dense.exr", &exr(4, 4, &["R", "G", "B"], |_, _| 3.0));
    folder.write("tint.png", &exr(2, 2, &["R", "G", "B"], |c, _| [2.0, -1.5, 0.0][c]));
    let baked = baked(&folder);
    let want = of_processor(&baked);
    let largest = want.rgb.iter().flatten().fold(0.0_f32, |most, x| most.max(x.abs()));
    assert!(want.rgb[5][0] > 1.0 && want.rgb[5][1] < -0.5, "{:?}", want.rgb[5]);
    let Some(gpu) = gpu() else { return };
    let options = RenderOptions { budget: Budget::Paper, ..EXACT };
    let mut renderer = Renderer::new(gpu, Content::of(&baked), options).unwrap();
    let got = renderer.render(&baked.scene.views[0].camera, 1.0).unwrap().image;
    for (got, want) in got.rgb.iter().zip(&want.rgb) {
        // The albedo of the scene itself stands in 8 bits.
        assert!((0..3).all(|c| (got[c] - want[c]).abs() < 1e-2 * largest), "{got:?} {want:?}");
    }
}

#[test]
fn an_export_declares_them_and_says_what_they_are() {
    let baked = baked(&weighted(OWN, ""));
    let scene = baked.scene.facts(&baked.scene.params, Budget::Paper, false);
    let of_engine = Facts { setup: baked.setup(), ..crate::exports::engine_facts() };
    let facts = Facts { maps: MapFacts { own: scene.maps.own, ..of_engine.maps }, ..of_engine };
    let text = crate::exports::compiled_glsl("freckles", &facts);
    for part in [
        "uniform sampler2D skinfit_freckle_map;",
        "skinfit_freckle_map: the scene's map freckle, first channel, linear: how dense they are",
        "skinfit_freckle_tint_map: the scene's map freckle_tint, decoded from sRGB: what they are tinted with",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    // Where the scene has none, nothing is bound.
    let without = Facts { maps: MapFacts { own: Default::default(), ..facts.maps }, ..facts };
    assert!(!crate::exports::compiled_glsl("no freckles", &without).contains("freckle_map"));
}

#[test]
fn what_is_wrong_with_a_map_is_told() {
    let cases = [
        (
            OWN.replace("freckle =", "freckel ="),
            "[maps.own] has freckel, which no term of the scene declares",
        ),
        (OWN.replace("dense.exr", "missing.exr"), "missing.exr"),
    ];
    for (own, words) in cases {
        let error = weighted(&own, "").load().unwrap_err().to_string();
        assert!(error.contains(words), "{own}: {error}");
    }
    // What no enabled effect asks for is not read.
    let model = MODEL.replace("\"freckles\"", "\"diffuse\"");
    let (scene, _) = folder(&OWN.replace("dense.exr", "missing.exr"), &model, "").load().unwrap();
    assert!(scene.maps.own.is_empty());
    let odd = FRECKLES.replace("freckle", "odd");
    let cases = [
        (
            odd.replace("odd: f32", "odd: vec2f"),
            5,
            "`map: odd: vec2f = 0.25; how dense they are` cannot be read",
        ),
        (odd.replace("map: odd: f32", "map: color: f32"), 5, "`color` is there already"),
        (odd.replace("map: odd:", "map: odd"), 5, "cannot be read"),
        (odd.replace("map: odd_tint: vec3f", "map: odd_map: vec3f"), 6, "`odd_map` is there already"),
        (odd.replace("fn odd_light(", "fn odd_neutral("), 11, "`odd_neutral`"),
        (odd.replace("fn odd_light(", "fn odd_light_pass("), 11, "`odd_light_pass`"),
    ];
    for (text, line, words) in cases {
        let error = register("odd", &text).unwrap_err();
        assert!(error.line == line && error.to_string().contains(words), "{error}");
    }
}

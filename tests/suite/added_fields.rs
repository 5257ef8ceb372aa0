//! A family of terms, each with a field of the mesh's vertices of its own: through scene file and mesh file to samples,
//! both engines, the renderer and an export.

use serde_json::json;
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::{Objective, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::image::Image;
use skinfit::render::shade::Shader;
use skinfit::shader::term::register;
use skinfit::shader::{Facts, plan};

use crate::graphics::bench::cache;
use crate::graphics::bench::{EXACT, gpu};
use crate::scene_folder::{SceneFolder, exr, tampered};

/// A lamp whose light is given a vertex.
const LAMP: &str = "\
// Light of a lamp, as much of it as the mesh says.
//
// effect: lamp_NAME, light of the lamp NAME
// parameter: lamp.NAME.color = 1 in [0, inf), rgb, linear; its colour; a test
// field: NAME_share: f32 = 0.25; how much of it arrives
// field: NAME_tint: vec3f = 1; how the air between tints it
//
// gives: lamp_NAME_part
// adds: lamp_NAME
// cost: 6
fn lamp_NAME_light(albedo: vec3f, NAME_share: f32, NAME_tint: vec3f, lamp_NAME_color: vec3f) -> vec3f {
    return lamp_NAME_color * (NAME_share * NAME_tint * albedo);
}
";
const MODEL: &str = "[model]\neffects = [\"lamp_key\", \"lamp_fill\"]\nterms = [{ file = \"lamp.wgsl\", names = [\"key\", \"fill\"] }]";
const PARAMS: &str = "[model.params]\n\"lamp.key.color\" = [0.9, 0.5, 0.25]\n\"lamp.fill.color\" = 2";
/// `_KEY_SHARE` of the four vertices: it grows from the left to the right.
const SHARE: [f32; 4] = [0.0, 1.0, 1.0, 0.0];

/// The quad with the field `key_share`; it has none of the others.
fn mesh(share: [f32; 4]) -> Vec<u8> {
    tampered(|json, bin| {
        let offset = bin.len();
        share.iter().for_each(|x| bin.extend(x.to_le_bytes()));
        json["buffers"][0]["byteLength"] = json!(bin.len());
        let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": 16});
        json["bufferViews"].as_array_mut().unwrap().push(view);
        let accessor = json!({"bufferView": 7, "componentType": 5126, "count": 4, "type": "SCALAR"});
        json["accessors"].as_array_mut().unwrap().push(accessor);
        json["meshes"][0]["primitives"][0]["attributes"]["_KEY_SHARE"] = json!(7);
    })
}

/// The scene in files; `model` and `params` stand in the place of its own.
fn folder(model: &str, params: &str) -> SceneFolder {
    let folder = SceneFolder::new();
    folder.write("quad.glb", &mesh(SHARE));
    folder.write("lamp.wgsl", LAMP.as_bytes());
    let scene = crate::scene_folder::SCENE.replace("[model]\n[model.params]", &format!("{model}\n{params}"));
    folder.write("scene.toml", scene.as_bytes());
    folder
}

fn baked(folder: &SceneFolder) -> Baked {
    let options = PrepareOptions { fit: true, cache: Some(cache()), ..PrepareOptions::default() };
    Baked::new(&folder.path("scene.toml"), &options).unwrap()
}

/// The image by hand: the quad faces the camera from two units away, so a pixel's mean is that of its centre.
fn by_hand() -> Vec<[f64; 3]> {
    let half = 2.0 * 15_f64.to_radians().tan();
    let linear = |byte: f64| ((byte / 255.0 + 0.055) / 1.055).powf(2.4);
    let (albedo, key) = ([linear(200.0), linear(100.0), 0.0], [0.9, 0.5, 0.25]);
    let pixel = |i: usize| {
        let x = (((i % 4) as f64 + 0.5) / 2.0 - 1.0) * half;
        // The fill lamp's share and both tints are what stands in for them.
        std::array::from_fn(|c| albedo[c] * (key[c] * (x + 1.0) / 2.0 + 2.0 * 0.25))
    };
    (0..16).map(pixel).collect()
}

fn assert_image(image: &Image, what: &str) {
    for (i, (got, want)) in image.rgb.iter().zip(by_hand()).enumerate() {
        for c in 0..3 {
            // Places and interpolation in f32, a few roundings each.
            assert!((f64::from(got[c]) - want[c]).abs() < 2e-6, "{what}: pixel {i}: {got:?} {want:?}");
        }
    }
}

#[test]
fn members_have_parameters_and_fields_of_their_own_from_the_mesh_to_the_image() {
    let folder = folder(MODEL, PARAMS);
    let sampled = baked(&folder).sample().unwrap();
    let fields: Vec<_> = sampled.samples[0].surface.places().fields().map(|(name, ..)| name).collect();
    let own = ["key_share", "key_tint", "fill_share", "fill_tint"];
    assert!(own.iter().all(|name| fields.contains(name)), "{fields:?}");
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params).unwrap();
    let camera = &sampled.scene.views[0].camera;
    assert_image(&shader.shade(&sampled.samples[0], camera, 1.0).image, "the processor");
    let color = Param::from_name("lamp.key.color").unwrap();
    assert_eq!((color.identifier(), color.info().linear), ("lamp_key_color", true));
    // What no effect asks for is not read.
    let without = self::folder(&MODEL.replace("\"lamp_key\", ", ""), "[model.params]");
    let (scene, _) = without.load().unwrap();
    let read: Vec<_> = scene.mesh.fields.iter().map(|of| of.field.name()).collect();
    assert_eq!(read, ["fill_share", "fill_tint"]);
}

#[test]
fn both_engines_find_the_colours_that_made_the_target() {
    let folder = folder(MODEL, "[model.params]");
    let image = by_hand();
    let plane = |c: usize, i: usize| image[i].get(c).map_or(1.0, |x| *x as f32);
    folder.write(
        "target.exr",
        &exr(4, 4, &["R", "G", "B", "A"], |c, i| if c == 3 { 1.0 } else { plane(c, i) }),
    );
    let baked = baked(&folder);
    let observed = baked.clone().sample().unwrap().observe().unwrap();
    let colors = ["lamp.key.color", "lamp.fill.color"].map(|name| Param::from_name(name).unwrap());
    let unknowns: Vec<Unknown> =
        colors.into_iter().flat_map(Column::per_channel).map(Unknown::Param).collect();
    let task = || skinfit::engine::Task { unknowns: unknowns.clone(), ..observed.task() };
    let start = observed.start();
    let check = |engine: &dyn Objective, what: &str| {
        let end = fit(engine, &start, &FitOptions::default(), &mut |_| {}).unwrap().end;
        for (param, want) in colors.into_iter().zip([[0.9, 0.5], [2.0, 2.0]]) {
            for c in 0..2 {
                // The target is rounded to f32; sixteen pixels tell the two lamps apart within a factor of ten.
                assert!((end.params.rgb(param)[c] - want[c]).abs() < 1e-5, "{what}: {}", param.name());
            }
        }
    };
    check(&CpuEngine::new(task()).unwrap(), "cpu");
    let Some(gpu) = gpu() else { return };
    check(&GpuEngine::new(gpu, task(), &start, Memory::default()).unwrap(), "gpu");
}

#[test]
fn the_renderer_draws_them_and_an_export_names_them() {
    let baked = baked(&folder(MODEL, PARAMS));
    let facts = Facts { setup: baked.setup(), ..Facts::default() };
    let planned = plan(&facts).unwrap();
    assert!(planned.wgsl.contains("rest_key_share: f32"), "{}", planned.wgsl);
    let of_engine = Facts { setup: baked.setup(), ..crate::exports::engine_facts() };
    let text = crate::exports::compiled_glsl("lamps", &of_engine);
    assert!(text.contains("KEY_COLOR") && text.contains("key_share"), "{text}");
    let Some(gpu) = gpu() else { return };
    let camera = baked.scene.views[0].camera;
    let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
    assert_image(&renderer.render(&camera, 1.0).unwrap().image, "the adapter");
}

#[test]
fn what_is_wrong_with_a_family_or_a_field_is_told() {
    let cases = [
        ("terms = [\"lamp.wgsl\"]", "no member has a name"),
        ("terms = [{ file = \"lamp.wgsl\", names = [] }]", "names nobody"),
        ("terms = [{ file = \"lamp.wgsl\", names = [\"Key\"] }]", "`Key` is no name"),
        ("terms = [{ file = \"lamp.wgsl\", names = [\"a\", \"a\"] }]", "two of the name `a`"),
        ("terms = [{ file = \"lone.wgsl\", names = [\"a\"] }]", "is no family"),
        ("terms = [{ file = \"lamp.wgsl\", name = \"a\" }]", "expected a path or { file"),
    ];
    for (terms, words) in cases {
        let folder = folder(&format!("[model]\n{terms}"), "[model.params]");
        folder.write("lone.wgsl", LAMP.replace("NAME", "lone").as_bytes());
        let error = folder.load().unwrap_err().to_string();
        assert!(error.contains(words), "{terms}: {error}");
    }
    let folder = folder(MODEL, PARAMS);
    folder.write("quad.glb", &mesh([0.0, f32::NAN, 1.0, 0.0]));
    let error = folder.load().unwrap_err().to_string();
    assert!(error.contains("_KEY_SHARE") && error.contains("vertex 1"), "{error}");
    let lamp = LAMP.replace("NAME", "odd");
    let idle = lamp.replace("odd_share: f32, ", "").replace("odd_share * odd_tint", "odd_tint");
    let cases = [
        (lamp.replace("odd_share: f32 = 0.25", "odd_share: vec4f = 0.25"), "cannot be read"),
        (lamp.replace("odd_share: f32 = 0.25", "albedo: f32 = 0.25"), "`albedo` is there already"),
        (idle, "odd_share is declared, but used by no rule"),
    ];
    for (text, words) in cases {
        let error = register("odd", &text).unwrap_err();
        assert!(error.line == 5 && error.to_string().contains(words), "{error}");
    }
}

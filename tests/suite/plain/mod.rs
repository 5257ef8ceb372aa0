//! Parts of a mesh that are not skin: told apart by name, drawn by their own material, and left out of fits.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

mod cutouts;
mod drawn;
mod gloss;
mod pictures;
mod posed;
mod shapes;
pub(crate) mod wrapped;

use std::f64::consts::PI;

use serde_json::{Value, json};
use skinfit::prepare::{Baked, PrepareOptions, Sampled};
use skinfit::render::image::Image;
use skinfit::render::shade::Shader;

use crate::common;
use crate::graphics::bench::cache;
use crate::scene_folder::{SceneFolder, exr, glb, png, quad_parts};

pub(crate) const SCENE: &str = r#"
[mesh]
file = "quad.glb"
skin = ["Skin"]
[environment]
file = "env.exr"
[model]
effects = ["diffuse"]
[[view]]
name = "front"
eye = [0, 0, 4]
look_at = [0, 0, 0]
fov_y_degrees = 30
width = 16
height = 16
target = "target.exr"
[quality]
samples_per_axis = 2
"#;

/// A quad of skin, 2 wide, and in its middle before it another, 1 wide, of a material of its own.
fn folder(material: &Value, scene: &str) -> SceneFolder {
    edited(material, scene, |_, _| {})
}

/// The same with another glTF file, before it is written.
pub(crate) fn edited(
    material: &Value,
    scene: &str,
    edit: impl FnOnce(&mut Value, &mut Vec<u8>),
) -> SceneFolder {
    let folder = SceneFolder::new();
    let (mut mesh, mut bin) = quad_parts();
    mesh["nodes"] = json!([{"mesh": 0}, {"mesh": 1, "scale": [0.5, 0.5, 0.5], "translation": [0, 0, 0.5]}]);
    mesh["scenes"][0]["nodes"] = json!([0, 1]);
    let mut before = mesh["meshes"][0].clone();
    mesh["meshes"][0]["primitives"][0]["material"] = json!(0);
    before["name"] = json!("eye");
    before["primitives"][0]["material"] = json!(1);
    mesh["meshes"].as_array_mut().unwrap().push(before);
    mesh["materials"] = json!([{"name": "Skin"}, material]);
    mesh["images"] = json!([{"uri": "picture.png"}]);
    mesh["textures"] = json!([{"source": 0}]);
    edit(&mut mesh, &mut bin);
    folder.write("quad.glb", &glb(&mesh, &bin));
    folder.write("picture.png", &png(4, 4, [188, 188, 188]));
    folder.write("env.exr", &exr(8, 4, &["R", "G", "B"], |_, _| 1.0));
    folder.write("target.exr", &exr(16, 16, &["R", "G", "B", "A"], |c, _| if c == 3 { 1.0 } else { 0.25 }));
    folder.write("scene.toml", scene.as_bytes());
    folder
}

fn sampled(folder: &SceneFolder) -> Sampled {
    let options = PrepareOptions { fit: true, cache: Some(cache()), ..PrepareOptions::default() };
    Baked::new(&folder.path("scene.toml"), &options).unwrap().sample().unwrap()
}

/// What a scene's view shows.
fn image(sampled: &Sampled) -> Image {
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params).unwrap();
    shader.shade(&sampled.samples[0], &sampled.scene.views[0].camera, 1.0).image
}

/// The middle of the image of a scene whose eye has this material, and what the skin beside it shows.
fn middle_and_skin(material: &Value) -> ([f32; 3], [f32; 3]) {
    let image = image(&sampled(&folder(material, SCENE)));
    (image.rgb[8 * 16 + 8], image.rgb[8 * 16 + 2])
}

pub(crate) fn close(got: [f32; 3], want: [f32; 3], tolerance: f32) -> bool {
    got.iter().zip(want).all(|(got, want)| (got - want).abs() <= tolerance)
}

#[test]
fn a_material_is_drawn_as_gltf_has_it_under_a_sky_of_one() {
    // The skin is white: under a sky of 1 it shows 1.
    let mirror = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [0.9, 0.5, 0.2, 1]}});
    let (middle, skin) = middle_and_skin(&mirror);
    // Facing it shows its colour times the sky; a lobe of alpha 0.001 and cubes in f32 take off less than this.
    assert!(close(middle, [0.9, 0.5, 0.2], 2e-3), "{middle:?}");
    assert!(close(skin, [1.0; 3], 1e-4), "{skin:?}");
    // Rough and black, it has the 4% of a dielectric, less what a rough lobe sends below the surface.
    let black = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.5, "baseColorFactor": [0, 0, 0, 1]}});
    let (middle, _) = middle_and_skin(&black);
    assert!((0.035..0.045).contains(&middle[0]), "{middle:?}");
    // White, what does not enter is reflected: all but what the rough lobe sends below the surface.
    let white = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.5}});
    let (middle, _) = middle_and_skin(&white);
    assert!((0.98..1.002).contains(&middle[0]), "{middle:?}");
    // sRGB 188 is 0.502 of linear light.
    let mapped = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0, "baseColorTexture": {"index": 0}}});
    let (middle, _) = middle_and_skin(&mapped);
    assert!(close(middle, [0.5029; 3], 2e-3), "{middle:?}");
    let glowing = json!({"name": "Eye", "emissiveFactor": [0.25, 0.5, 1], "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 1}});
    let (middle, _) = middle_and_skin(&glowing);
    assert!((middle[2] - middle[0] - 0.75).abs() < 1e-3, "{middle:?}");
}

#[test]
fn alpha_cuts_holes_or_blends() {
    let of = |mode: &str, alpha: f64| json!({"name": "Eye", "alphaMode": mode, "pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [0, 0, 0, alpha]}});
    let red = |material: &Value| middle_and_skin(material).0[0];
    // Opaque whatever its alpha; a hole below the cutoff of a half shows the white skin.
    assert!(red(&of("OPAQUE", 0.2)) < 1e-3);
    assert!(red(&of("MASK", 0.6)) < 1e-3);
    assert!((red(&of("MASK", 0.4)) - 1.0).abs() < 1e-3);
    // Half of the four samples of each pixel see the skin, exactly.
    assert!((red(&of("BLEND", 0.5)) - 0.5).abs() < 1e-3);
}

#[test]
fn a_lamp_lights_it_and_it_shades_the_skin() {
    let lamp = "[[light]]\nname = \"key\"\ntype = \"directional\"\ndirection = [0, 0, -1]\nirradiance = [3.0, 3.0, 3.0]\n";
    let lit = SCENE
        .replace("\"diffuse\"", "\"lights\", \"shadows\"")
        .replace("[environment]\nfile = \"env.exr\"\n", lamp);
    let chalk = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1, "baseColorFactor": [0.5, 0.5, 0.5, 1]}});
    let image = image(&sampled(&folder(&chalk, &lit)));
    // A facing Lambert surface: albedo E / pi of the 96% that enter, and of the 4% lobe of alpha 1 a quarter of E / pi.
    let want = (0.96 * 0.5 * 3.0 / PI + 0.04 * 0.25 * 3.0 / PI) as f32;
    let middle = image.rgb[8 * 16 + 8];
    assert!(close(middle, [want; 3], 2e-3 * want), "{middle:?} is not {want}");
    // From beside, its shadow falls on the skin.
    let aside = lit.replace("direction = [0, 0, -1]", "direction = [1, 0, -0.7]");
    let image = self::image(&sampled(&folder(&chalk, &aside)));
    let row: Vec<f32> = (0..16).map(|x| image.rgb[8 * 16 + x][0]).collect();
    assert!(row[2] > 0.1 && row[13] < 1e-6, "{row:?}");
}

#[test]
fn a_fit_does_not_see_it() {
    let eye = json!({"name": "Eye"});
    let observed = sampled(&folder(&eye, SCENE)).observe().unwrap();
    let view = &observed.views[0];
    let samples = &view.samples;
    assert!(samples.plain.len() > 20, "{}", samples.plain.len());
    let hidden: Vec<u32> = samples.plain.iter().map(|part| part.pixel).collect();
    let mut counted = 0;
    for (slot, &pixel) in samples.pixel.iter().enumerate().filter(|(_, pixel)| **pixel != u32::MAX) {
        let weight = view.pixel_weight(slot);
        assert!(!hidden.contains(&pixel) || weight == 0.0, "pixel {pixel}");
        counted += usize::from(weight > 0.0);
    }
    assert!(counted > 60, "{counted}");
    // Named as skin, too, all of it counts again.
    let both = SCENE.replace("[\"Skin\"]", "[\"Skin\", \"eye\"]");
    let all = sampled(&folder(&eye, &both)).observe().unwrap();
    assert!(all.scene.mesh.plain.is_none() && all.views[0].samples.plain.is_empty());
}

#[test]
fn names_that_nothing_has_are_refused() {
    let eye = json!({"name": "Eye"});
    for (names, words) in [
        (
            "[\"Skim\"]",
            "has no material or mesh `Skim` in its scene, which [mesh] skin names. Did you mean `Skin`?",
        ),
        ("[]", "skin names nothing"),
        ("[\"Skin\", \"Hair\"]", "has no material or mesh `Hair`"),
    ] {
        let folder = folder(&eye, &SCENE.replace("[\"Skin\"]", names));
        let told = folder.load().unwrap_err().to_string();
        assert!(told.contains(words), "{told}");
    }
    let broken = json!({"name": "Eye", "pbrMetallicRoughness": {"baseColorTexture": {"index": 7}}});
    let told = folder(&broken, SCENE).load().unwrap_err().to_string();
    assert!(told.contains("refers to texture 7, but has 1"), "{told}");
}

#[test]
fn the_eyes_of_a_path_traced_head_are_not_skin() {
    let Some(data) = common::data() else { return };
    let options = PrepareOptions { fit: true, cache: Some(cache()), ..PrepareOptions::default() };
    let observed = Baked::new(&data.join("mh_portrait/scene.toml"), &options)
        .unwrap()
        .sample()
        .unwrap()
        .observe()
        .unwrap();
    let plain = observed.scene.mesh.plain.as_ref().unwrap();
    let skin = plain.of_triangle.iter().filter(|of| of.is_none()).count();
    assert!(skin > 1000 && skin < plain.of_triangle.len(), "{skin} of {}", plain.of_triangle.len());
    // The eyes are seen from the front, and are a small part of the head.
    let seen: f32 = observed.views[0].samples.plain.iter().map(|part| part.share).sum();
    let head: f32 = observed.views[0].samples.coverage.iter().sum();
    assert!(seen > 50.0 && seen < 0.05 * head, "{seen} of {head} pixels");
}

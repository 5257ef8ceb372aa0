//! Materials: a box with metallic-roughness factors, textured boxes whose pictures repeat, mirror and end, panels that are
//! opaque, have holes or blend, a box that glows by a picture, and panels that glow by strengths.

use glam::{DQuat, DVec3};
use image::{ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};
use serde_json::{Value, json};
use skinfit::render::tonemap::srgb_decode;

use super::file::{File, Shape};
use super::{CLAMP, MIRROR, Prop, REPEAT, SIZE, Sky, at, four, mirror, mirror_of, nearest, seen_at, texel};
use crate::plain::close;
use crate::scene_folder::{encode, png};

/// How the box of factors is turned: a corner comes forward, and three of its sides are seen.
fn turn() -> DQuat {
    DQuat::from_rotation_x(35.264_f64.to_radians()) * DQuat::from_rotation_y(-45_f64.to_radians())
}

/// Half the box' size.
const HALF: f32 = 0.5;
/// The metal's colour.
const COPPER: [f64; 3] = [0.9, 0.6, 0.3];

/// A box with sides of a rough metal, of a dark glaze and, above, of skin.
pub(super) fn box_of_factors() -> Prop {
    let mut file = File::new();
    let skin = file.material(json!({"name": "Skin"}));
    let metal = file.material(json!({"name": "Metal", "pbrMetallicRoughness": {
        "metallicFactor": 1, "roughnessFactor": 0.4, "baseColorFactor": [COPPER[0], COPPER[1], COPPER[2], 1]}}));
    let glaze = file.material(json!({"name": "Glaze", "pbrMetallicRoughness": {
        "metallicFactor": 0, "roughnessFactor": 0.7, "baseColorFactor": [0, 0.1, 0.4, 1]}}));
    let of_side = [glaze, glaze, metal, metal, skin, skin];
    let sides = Shape::sides([HALF; 3]);
    let primitives: Vec<Value> =
        sides.iter().zip(of_side).map(|(side, material)| file.primitive(side, material)).collect();
    let mesh = file.mesh("box", &primitives);
    file.root(json!({"mesh": mesh, "rotation": turn().to_array()}));
    Prop::new("box_of_factors", file)
}

/// What is seen of the middle of a side, and the cosine there between the side's normal and the view.
fn middle_of(prop: &Prop, out: DVec3) -> ([f32; 3], f64) {
    let normal = turn() * out;
    let place = f64::from(HALF) * normal;
    let eye = DVec3::new(0.0, 0.0, 4.0);
    let flat = 4.0 / (4.0 - place.z);
    let [x, y] = seen_at([flat * place.x, flat * place.y]);
    (at(&prop.image(), x, y), normal.dot((eye - place).normalize()))
}

#[test]
fn factors_of_polished_sides_are_schlicks_reflectance_at_the_view() {
    let mut prop = box_of_factors().under(Sky::Even);
    for material in [1, 2] {
        prop.file.json["materials"][material]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0);
    }
    // Black, the glaze has nothing but its polish.
    prop.file.json["materials"][2]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0, 0, 0, 1]);
    for (out, f0) in [(DVec3::X, COPPER), (DVec3::Z, [0.04; 3])] {
        let (got, cosine) = middle_of(&prop, out);
        let want = f0.map(|f0| (f0 + (1.0 - f0) * (1.0 - cosine).powi(5)) as f32);
        // Across the pixel the cosine differs by 0.02, and grazing light by 0.003.
        assert!(close(got, want, 6e-3), "{got:?} is not {want:?}");
    }
    // White skin under a sky of 1.
    let (skin, _) = middle_of(&prop, DVec3::Y);
    assert!(close(skin, [1.0; 3], 1e-3), "{skin:?}");
}

#[test]
fn a_factor_of_metal_lies_between_both() {
    let mut prop = box_of_factors().under(Sky::Even);
    let mut shown = [0.0, 0.5, 1.0].map(|metal| {
        prop.file.json["materials"][1]["pbrMetallicRoughness"] =
            json!({"metallicFactor": metal, "roughnessFactor": 0, "baseColorFactor": [0, 0, 0, 1]});
        middle_of(&prop, DVec3::X).0[0]
    });
    // Black metal has no reflectance when facing, black glaze 0.04: what is between is linear in the factor.
    let half = (shown[0] + shown[2]) / 2.0;
    assert!((shown[1] - half).abs() < 1e-3, "{shown:?}");
    shown.reverse();
    assert!(shown.is_sorted() && shown[2] - shown[0] > 0.03, "{shown:?}");
}

/// Of each textured box where it stands, how its picture repeats along u and v, and the texels that it is moved by.
const BOXES: [([f64; 2], [u32; 2], [i32; 2]); 4] = [
    ([-0.5, 0.5], [REPEAT, REPEAT], [0, 0]),
    ([0.5, 0.5], [MIRROR, CLAMP], [0, 0]),
    ([-0.5, -0.5], [CLAMP, MIRROR], [0, 1]),
    ([0.5, -0.5], [REPEAT, MIRROR], [-1, -2]),
];

/// Four boxes whose fronts show two pictures along each side.
pub(super) fn textured_boxes() -> Prop {
    let mut file = File::new();
    file.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    file.backdrop();
    for ([x, y], wrap, moved) in BOXES {
        let texture = file.texture(&four(), nearest(wrap));
        let offset = moved.map(|texels| 0.5 * f64::from(texels));
        let info = json!({"index": texture, "extensions": {"KHR_texture_transform": {"offset": offset, "scale": [2, 2]}}});
        let material = file.material(json!({"name": "Tiles", "pbrMetallicRoughness": mirror_of(&info)}));
        file.put(&Shape::cuboid([0.4, 0.4, 0.2]), material, [x, y, -0.2]);
    }
    Prop::new("textured_boxes", file)
}

/// The texel of a picture of two that stands `i` texels from its border (glTF 2.0, section 5.26).
fn wrapped(wrap: u32, i: i32) -> usize {
    match wrap {
        CLAMP => i.clamp(0, 1) as usize,
        MIRROR => [0, 1, 1, 0][i.rem_euclid(4) as usize],
        _ => i.rem_euclid(2) as usize,
    }
}

#[test]
fn pictures_repeat_mirror_and_end_as_their_samplers_say() {
    let image = textured_boxes().under(Sky::Even).image();
    for ([x, y], [wrap_u, wrap_v], [moved_u, moved_v]) in BOXES {
        // A front is 8 pixels wide, a texel 2; u runs to the right, v downwards.
        let [left, top] = seen_at([x - 0.399, y + 0.399]);
        for row in 0..8 {
            for column in 0..8 {
                let (u, v) = (column as i32 / 2 + moved_u, row as i32 / 2 + moved_v);
                let want = texel(wrapped(wrap_u, u), wrapped(wrap_v, v));
                let got = at(&image, left + column, top + row);
                // A lobe of alpha 0.001 and cubes in f32 take off less than this.
                assert!(
                    close(got, want, 3e-3),
                    "({x}, {y}), row {row}, column {column}: {got:?} is not {want:?}"
                );
            }
        }
    }
}

/// Alphas of the ramp's texels, top to bottom.
const RAMP: [u8; 8] = [0, 40, 80, 120, 160, 200, 240, 255];
/// Below this share of the factor's alpha there is a hole.
const CUTOFF: f64 = 0.45;
/// The factor on the ramp's alpha.
const FACTOR: f64 = 0.75;

/// Before white skin: black that is opaque whatever its alpha, black with holes, and red that blends before blue.
pub(super) fn alpha_modes() -> Prop {
    let mut file = File::new();
    file.backdrop();
    let picture = RgbaImage::from_fn(1, 8, |_, y| Rgba([0, 0, 0, RAMP[y as usize]]));
    let ramp = file.texture(&encode(picture, ImageFormat::Png), nearest([CLAMP, CLAMP]));
    let surface = json!({
        "metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [1, 1, 1, FACTOR], "baseColorTexture": {"index": ramp}
    });
    let opaque = file.material(json!({"name": "Opaque", "pbrMetallicRoughness": surface}));
    let mask =
        json!({"name": "Mask", "alphaMode": "MASK", "alphaCutoff": CUTOFF, "pbrMetallicRoughness": surface});
    let mask = file.material(mask);
    let panel = Shape::panel(0.2, 0.8);
    file.put(&panel, opaque, [-0.6, 0.0, 0.0]);
    file.put(&panel, mask, [-0.1, 0.0, 0.0]);
    // The nearer one comes first in the file: its place in the world counts, not its place there.
    for (color, z) in [([1.0, 0.0, 0.0, 0.5], 0.0), ([0.0, 0.0, 1.0, 0.5], -0.25)] {
        let glass =
            json!({"name": "Glass", "alphaMode": "BLEND", "pbrMetallicRoughness": mirror(&json!(color))});
        let glass = file.material(glass);
        file.put(&panel, glass, [0.5, 0.0, z]);
    }
    Prop::new("alpha_modes", file)
}

#[test]
fn a_mask_cuts_exactly_where_alpha_is_below_the_cutoff() {
    let image = alpha_modes().under(Sky::Even).image();
    let [opaque, masked] = [-0.6, -0.1].map(|x| seen_at([x, 0.0])[0]);
    let mut holes = 0;
    for (i, alpha) in RAMP.into_iter().enumerate() {
        let hole = FACTOR * f64::from(alpha) / 255.0 < CUTOFF;
        holes += usize::from(hole);
        // A texel is 2 pixels high.
        for y in [4 + 2 * i, 5 + 2 * i] {
            let want = if hole { 1.0 } else { 0.0 };
            let got = at(&image, masked, y);
            assert!(close(got, [want; 3], 2e-3), "alpha {alpha}, row {y}: {got:?}");
            assert!(close(at(&image, opaque, y), [0.0; 3], 2e-3), "row {y}");
        }
    }
    assert_eq!(holes, 4);
}

#[test]
fn layers_blend_by_their_distance() {
    let image = alpha_modes().under(Sky::Even).image();
    let [x, y] = seen_at([0.5, 0.05]);
    // Half red, half of the rest blue, and what is left the white skin behind both.
    let [r, g, b] = at(&image, x, y);
    assert!((r - 0.75).abs() < 2e-3 && (g - 0.25).abs() < 2e-3, "{r} {g} {b}");
    // Blue mirrors the sky through the red: of its 32 rays half. Two thirds of them go by places of their own: four standard
    // deviations of as many coins.
    let deviation = 0.25 * 0.5 / (32.0_f32 * 2.0 / 3.0).sqrt();
    assert!((b - 0.375).abs() < 4.0 * deviation, "{r} {g} {b}");
    assert!((image.alpha[y * SIZE + x] - 1.0).abs() < 1e-6);
}

/// Greens of the glow's four texels, left to right, by sRGB's curve.
const GLOW: [u8; 4] = [0, 90, 188, 255];
/// The factor on them.
const GLOW_FACTOR: [f32; 3] = [1.0, 0.5, 0.0];

/// A grey box whose front glows by a picture, which is smooth between its texels.
pub(super) fn glowing_box() -> Prop {
    let mut file = File::new();
    file.backdrop();
    let picture = RgbImage::from_fn(4, 1, |x, _| Rgb([GLOW[x as usize]; 3]));
    let texture = file.texture(&encode(picture, ImageFormat::Png), json!({}));
    let glow = file.material(json!({
        "name": "Glow", "emissiveFactor": GLOW_FACTOR, "emissiveTexture": {"index": texture},
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.8, "baseColorFactor": [0.3, 0.3, 0.3, 1]},
    }));
    file.put(&Shape::cuboid([0.8, 0.6, 0.2]), glow, [0.0, 0.0, -0.2]);
    Prop::new("glowing_box", file)
}

#[test]
fn a_glow_is_its_factor_times_its_picture_whatever_the_light() {
    let mut prop = glowing_box();
    let bright = prop.image();
    prop.file.json["materials"][1]["emissiveFactor"] = json!([0, 0, 0]);
    let dark = prop.image();
    let light = GLOW.map(|code| srgb_decode(f32::from(code) / 255.0));
    for column in 0..16 {
        // A texel is 4 pixels wide, and the picture repeats beyond its border.
        let place = (column as f32 + 0.5) / 4.0 - 0.5;
        let (first, share) = (place.floor(), place - place.floor());
        let texel = |i: f32| light[(i as i32).rem_euclid(4) as usize];
        let glow = texel(first) * (1.0 - share) + texel(first + 1.0) * share;
        let [x, y] = [4 + column, SIZE / 2];
        let (lit, unlit) = (at(&bright, x, y), at(&dark, x, y));
        let got = [0, 1, 2].map(|c| lit[c] - unlit[c]);
        let want = GLOW_FACTOR.map(|factor| factor * glow);
        // Both pictures have the same rays: what is left is f32 of texture coordinates and of sums.
        assert!(close(got, want, 1e-4), "column {column}: {got:?} is not {want:?}");
    }
}

/// Where panels that glow stand beside one another, what KHR_materials_emissive_strength says of each, and the strength that
/// this is: without a number it is 1.
fn strengths() -> [(f64, Value, f32); 4] {
    let named = |strength: Value| json!({"KHR_materials_emissive_strength": strength});
    [
        (-0.7, json!({}), 1.0),
        (-0.25, named(json!({"emissiveStrength": 5})), 5.0),
        (0.25, named(json!({"emissiveStrength": 0.25})), 0.25),
        (0.7, named(json!({})), 1.0),
    ]
}

/// Black panels that glow by a factor, a picture and a strength.
pub(super) fn strong_glows() -> Prop {
    let mut file = File::new();
    file.json["extensionsUsed"] = json!(["KHR_materials_emissive_strength"]);
    file.backdrop();
    let picture = file.texture(&png(4, 4, [GLOW[2]; 3]), json!({}));
    for (x, extensions, _) in strengths() {
        let glow = file.material(json!({
            "name": "Glow", "emissiveFactor": GLOW_FACTOR, "emissiveTexture": {"index": picture},
            "extensions": extensions, "pbrMetallicRoughness": mirror(&json!([0, 0, 0, 1])),
        }));
        file.put(&Shape::panel(0.2, 0.6), glow, [x, 0.0, 0.0]);
    }
    Prop::new("strong_glows", file)
}

#[test]
fn a_strength_multiplies_what_glows_beyond_one() {
    let image = strong_glows().under(Sky::Even).image();
    for (x, extensions, strength) in strengths() {
        let [column, row] = seen_at([x, 0.05]);
        let got = at(&image, column, row);
        let want = GLOW_FACTOR.map(|factor| strength * factor * srgb_decode(f32::from(GLOW[2]) / 255.0));
        // Facing it, a black mirror shows nothing of the sky; a picture of one colour is that colour, in f32.
        assert!(close(got, want, 1e-5), "{extensions}: {got:?} is not {want:?}");
    }
}

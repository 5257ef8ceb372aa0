//! What vertices hold: colours in three encodings, two sets of texture coordinates, and quantised numbers with a sparse
//! accessor below nodes that scale and mirror.

use std::f64::consts::FRAC_PI_2;

use glam::Vec3;
use serde_json::json;

use super::file::{File, Shape};
use super::{CLAMP, Prop, SIZE, Sky, at, four, mirror, mirror_of, nearest, seen_at, texel};
use crate::plain::close;

/// Where three panels stand beside one another, each 0.6 wide.
const BESIDE: [f64; 3] = [-0.7, 0.0, 0.7];

/// Colours of a panel's corners, linear over it: as bytes, the same as u16 and as floats to the last digit.
const CORNERS: [[u8; 3]; 4] = [[51, 51, 204], [204, 51, 51], [204, 204, 51], [51, 204, 204]];

/// Three panels of one colouring: normalised bytes, normalised u16 with an alpha, and floats.
pub(super) fn vertex_colours() -> Prop {
    let mut file = File::new();
    file.backdrop();
    let white = file.material(json!({"name": "White", "pbrMetallicRoughness": mirror(&json!([1, 1, 1, 1]))}));
    let colors = [
        file.shares(&CORNERS),
        // An opaque material does not look at the alpha.
        file.shares(&CORNERS.map(|[r, g, b]| [r, g, b, 25].map(|c| 257 * u16::from(c)))),
        file.numbers(&CORNERS.map(|color| color.map(|c| f32::from(c) / 255.0))),
    ];
    for (x, colors) in BESIDE.into_iter().zip(colors) {
        let mut primitive = file.primitive(&Shape::panel(0.3, 0.9), white);
        primitive["attributes"]["COLOR_0"] = json!(colors);
        let mesh = file.mesh("panel", &[primitive]);
        file.root(json!({"mesh": mesh, "translation": [x, 0.0, 0.0]}));
    }
    Prop::new("vertex_colours", file)
}

#[test]
fn colours_are_linear_between_vertices_in_every_encoding() {
    let image = vertex_colours().under(Sky::Even).image();
    for x in BESIDE {
        let [left, top] = seen_at([x - 0.299, 0.899]);
        for row in 0..18 {
            for column in 0..6 {
                // A panel is 6 pixels wide and 18 high.
                let right = (column as f32 + 0.5) / 6.0;
                let up = 1.0 - (row as f32 + 0.5) / 18.0;
                let want = [0.2 + 0.6 * right, 0.2 + 0.6 * up, 0.8 - 0.6 * right];
                let got = at(&image, left + column, top + row);
                // A lobe of alpha 0.001 and cubes in f32 take off less than this.
                assert!(close(got, want, 3e-3), "{x}, row {row}, column {column}: {got:?} is not {want:?}");
            }
        }
    }
}

/// Three panels with one picture: by the first set of texture coordinates, by the second, which turns it by a quarter, and
/// by the second as KHR_texture_transform names it and turns it once more.
pub(super) fn two_sets() -> Prop {
    let mut file = File::new();
    file.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    file.backdrop();
    let picture = file.texture(&four(), nearest([CLAMP, CLAMP]));
    // Counter-clockwise about the corner where both are 0: (u, v) is (v, -u), and brought back.
    let once_more = json!({"texCoord": 1, "rotation": FRAC_PI_2, "offset": [0, 1]});
    let infos = [
        json!({"index": picture}),
        json!({"index": picture, "texCoord": 1}),
        json!({"index": picture, "extensions": {"KHR_texture_transform": once_more}}),
    ];
    let panel = Shape::panel(0.3, 0.3);
    let turned: Vec<[u16; 2]> =
        panel.uvs.iter().map(|[u, v]| [*v, 1.0 - u].map(|x| if x > 0.5 { u16::MAX } else { 0 })).collect();
    for (x, info) in BESIDE.into_iter().zip(infos) {
        let material = file.material(json!({"name": "Tiles", "pbrMetallicRoughness": mirror_of(&info)}));
        let mut primitive = file.primitive(&panel, material);
        primitive["attributes"]["TEXCOORD_1"] = json!(file.shares(&turned));
        let mesh = file.mesh("panel", &[primitive]);
        file.root(json!({"mesh": mesh, "translation": [x, 0.0, 0.0]}));
    }
    Prop::new("two_sets", file)
}

#[test]
fn each_panel_shows_the_picture_by_its_own_set() {
    let image = two_sets().under(Sky::Even).image();
    for (panel, x) in BESIDE.into_iter().enumerate() {
        let [left, top] = seen_at([x - 0.299, 0.299]);
        for row in 0..6 {
            for column in 0..6 {
                // A texel is 3 pixels wide.
                let (u, v) = (column / 3, row / 3);
                let want = [texel(u, v), texel(v, 1 - u), texel(1 - u, 1 - v)][panel];
                let got = at(&image, left + column, top + row);
                assert!(
                    close(got, want, 3e-3),
                    "panel {panel}, row {row}, column {column}: {got:?} is not {want:?}"
                );
            }
        }
    }
}

/// The gable's corners, around it.
const GABLE: [[f32; 2]; 5] = [[-0.4, -0.4], [0.4, -0.4], [0.4, 0.13], [-0.12, 0.37], [-0.4, 0.21]];
/// Where both stand beside the middle.
const ASIDE: f32 = 0.55;
/// The size of what is quantised, by which a node scales it.
const RANGE: f32 = 0.5;

/// Its texture coordinates as bytes.
fn uvs() -> [[u8; 2]; 5] {
    GABLE.map(|[x, y]| [x + 0.4, 0.4 - y].map(|along| (along / 0.8 * 255.0).round() as u8))
}

/// To the right a fan of floats; to the left the same of normalised integers, whose fourth corner a sparse accessor puts
/// right, below a node that mirrors.
pub(super) fn packed_and_mirrored() -> Prop {
    let mut file = File::new();
    file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    file.backdrop();
    let picture = file.texture(&four(), nearest([CLAMP, CLAMP]));
    let surface = mirror_of(&json!({"index": picture}));
    let tiles = file.material(json!({"name": "Tiles", "pbrMetallicRoughness": surface}));

    let floats = json!({
        "POSITION": file.numbers(&GABLE.map(|[x, y]| [x, y, 0.0])),
        "NORMAL": file.numbers(&[[0.0_f32, 0.0, 1.0]; 5]),
        "TEXCOORD_0": file.numbers(&uvs().map(|uv| uv.map(|along| f32::from(along) / 255.0))),
    });
    // A fan without indices.
    let mesh = file.mesh("floats", &[json!({"mode": 6, "attributes": floats, "material": tiles})]);
    file.root(json!({"mesh": mesh, "translation": [ASIDE, 0, 0]}));

    let mut places = GABLE.map(|[x, y]| [x, y, 0.0].map(|c: f32| (c / RANGE * 32767.0).round() as i16));
    let fourth: Vec<u8> = places[3].iter().flat_map(|c| c.to_le_bytes()).collect();
    places[3] = [-32767, 32767, 100];
    let positions = file.shares(&places);
    let (indices, values) = (file.view(&[3]), file.view(&fourth));
    file.json["accessors"][positions]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": indices, "componentType": 5121},
        "values": {"bufferView": values},
    });
    let packed = json!({
        "POSITION": positions,
        "NORMAL": file.shares(&[[0_i8, 0, 127]; 5]),
        "TEXCOORD_0": file.shares(&uvs()),
    });
    let mesh = file.mesh("packed", &[json!({"mode": 6, "attributes": packed, "material": tiles})]);
    let scaled = file.add("nodes", json!({"mesh": mesh, "scale": [RANGE, RANGE, RANGE]}));
    let mirrored = file.add("nodes", json!({"scale": [-1, 1, 1], "children": [scaled]}));
    file.root(json!({"translation": [-ASIDE, 0, 0], "children": [mirrored]}));
    Prop::new("packed_and_mirrored", file)
}

#[test]
fn packed_numbers_are_the_floats_that_they_stand_for() {
    let posed = packed_and_mirrored().baked().scene.mesh.pose();
    // After the four vertices of the skin.
    let (floats, packed) = posed.positions[4..].split_at(GABLE.len());
    assert_eq!(packed.len(), GABLE.len());
    for ((float, packed), [x, y]) in floats.iter().zip(packed).zip(GABLE) {
        assert!((*float - Vec3::new(x + ASIDE, y, 0.0)).length() < 1e-6, "{float}");
        // Half a step of 16 bits in each component.
        let mirrored = Vec3::new(-float.x, float.y, float.z);
        assert!(
            (*packed - mirrored).abs().max_element() < 0.6 * RANGE / 32767.0,
            "{packed} is not {mirrored}"
        );
    }
    // A mirror turns triangles round, but no normal.
    assert!(posed.normals.iter().all(|normal| (*normal - Vec3::Z).length() < 1e-6), "{:?}", posed.normals);
}

#[test]
fn a_mirrored_node_shows_the_mirror_image() {
    let image = packed_and_mirrored().under(Sky::Even).image();
    for y in 0..SIZE {
        for x in 0..SIZE / 2 {
            let (got, other) = (at(&image, x, y), at(&image, SIZE - 1 - x, y));
            assert!(close(got, other, 3e-3), "({x}, {y}): {got:?} is not {other:?}");
        }
    }
    // The picture stands upright in the one of floats.
    for (x, y, want) in [(19, 10, texel(1, 0)), (15, 14, texel(0, 1)), (19, 14, texel(1, 1))] {
        let got = at(&image, x, y);
        assert!(close(got, want, 3e-3), "({x}, {y}): {got:?} is not {want:?}");
    }
}

//! How primitives list their triangles: strips and a fan, with indices and without.

use glam::Vec3;
use serde_json::{Value, json};

use super::file::File;
use super::{Prop, Sky, at, mirror, seen_at};
use crate::plain::close;

/// The two sides of a strip that narrows and widens, from below.
const STRIP: [[f32; 2]; 8] = [
    [-0.95, -0.8],
    [-0.45, -0.8],
    [-0.8, -0.3],
    [-0.6, -0.3],
    [-0.95, 0.3],
    [-0.45, 0.3],
    [-0.8, 0.8],
    [-0.6, 0.8],
];
/// Two squares, one above the other,
const SQUARES: [[f32; 2]; 8] =
    [[-0.2, -0.7], [0.2, -0.7], [-0.2, -0.3], [0.2, -0.3], [-0.2, 0.3], [0.2, 0.3], [-0.2, 0.7], [0.2, 0.7]];
/// and one strip of them: between them it has four triangles without an area.
const JOINED: [[u8; 1]; 10] = [[0], [1], [2], [3], [3], [4], [4], [5], [6], [7]];
/// A star of four points about its middle, counter-clockwise from the right,
const STAR: [[f32; 2]; 9] = [
    [0.7, 0.0],
    [0.95, 0.0],
    [0.8, 0.2],
    [0.7, 0.8],
    [0.6, 0.2],
    [0.45, 0.0],
    [0.6, -0.2],
    [0.7, -0.8],
    [0.8, -0.2],
];
/// and the fan that closes it.
const CLOSED: [[u8; 1]; 10] = [[0], [1], [2], [3], [4], [5], [6], [7], [8], [1]];

/// glTF's modes (glTF 2.0, section 5.24.4).
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// The colour of all three.
const COPPER: [f32; 3] = [0.9, 0.6, 0.3];

/// A strip without indices, the squares and the star, before white skin. They have no normals, which follow from the way that
/// triangles turn.
pub(super) fn strips_and_fans() -> Prop {
    let mut file = File::new();
    file.backdrop();
    let copper = json!({"name": "Copper", "pbrMetallicRoughness": mirror(&json!([0.9, 0.6, 0.3, 1]))});
    let copper = file.material(copper);
    let shapes = [(TRIANGLE_STRIP, &STRIP[..]), (TRIANGLE_STRIP, &SQUARES), (TRIANGLE_FAN, &STAR)];
    for ((mode, places), indices) in shapes.into_iter().zip([None, Some(JOINED), Some(CLOSED)]) {
        let places: Vec<[f32; 3]> = places.iter().map(|&[x, y]| [x, y, 0.0]).collect();
        let positions = file.numbers(&places);
        let mut primitive = json!({"mode": mode, "material": copper, "attributes": {"POSITION": positions}});
        if let Some(indices) = indices {
            primitive["indices"] = Value::from(file.numbers(&indices));
        }
        let mesh = file.mesh("shape", &[primitive]);
        file.root(json!({"mesh": mesh}));
    }
    Prop::new("strips_and_fans", file)
}

#[test]
fn strips_and_fans_are_the_triangles_that_gltf_makes_of_them() {
    let posed = strips_and_fans().baked().scene.mesh.pose();
    // Each turns counter-clockwise (glTF 2.0, section 3.7.2.1): its area is above 0.
    let area = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| posed.positions[i as usize]);
        0.5 * (b - a).cross(c - a).z
    };
    // After the two triangles of the skin.
    let areas: Vec<f32> = posed.triangles[2..].iter().map(area).collect();
    assert!(areas.len() == 6 + 4 + 8 && areas.iter().all(|area| *area > 0.0), "{areas:?}");
    // Two trapezoids of 0.175 and one of 0.21 between them; two squares of 0.16; four times 0.025 and 0.04 of each point.
    for (of, want) in [(0..6, 0.56), (6..10, 0.32), (10..18, 0.26)] {
        let whole: f32 = areas[of].iter().sum();
        // Roundings of f32.
        assert!((whole - want).abs() < 1e-6, "{whole} is not {want}");
    }
    assert!(posed.normals.iter().all(|normal| (*normal - Vec3::Z).length() < 1e-6), "{:?}", posed.normals);
}

#[test]
fn strips_and_fans_cover_what_is_in_them() {
    let image = strips_and_fans().under(Sky::Even).image();
    let within = [[-0.75, -0.25], [-0.75, 0.75], [0.05, -0.55], [0.05, 0.55], [0.75, 0.05]];
    // Beside the strip's waist, between the squares, and between two points of the star: the white skin.
    let beside = [[-0.45, -0.35], [0.05, 0.05], [0.55, 0.55]];
    for (places, want) in [(&within[..], COPPER), (&beside[..], [1.0; 3])] {
        for &place in places {
            let [x, y] = seen_at(place);
            // A lobe of alpha 0.001 and cubes in f32 take off less than this.
            assert!(close(at(&image, x, y), want, 3e-3), "{place:?}: {:?}", at(&image, x, y));
        }
    }
}

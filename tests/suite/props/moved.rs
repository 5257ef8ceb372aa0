//! A rod with a skin of three bones and a cube with morph targets, each at a time of its animation.

use glam::{DMat4, DQuat, DVec3, Vec3};
use serde_json::json;

use super::file::{File, Shape};
use super::{Prop, SIZE, Sky, at, mirror, seen_at};
use crate::plain::close;

/// Where the rod's rings stand; its bones stand at the first three.
const RINGS: [f32; 4] = [-0.9, -0.3, 0.3, 0.9];
/// Half the rod's width.
const WIDTH: f32 = 0.12;
/// Of each ring the bones that move it, and their weights as normalised u16.
const BONES: [([u8; 4], [u16; 4]); 4] = [
    ([0, 0, 0, 0], [65535, 0, 0, 0]),
    ([0, 1, 0, 0], [32768, 32767, 0, 0]),
    ([1, 2, 0, 0], [32768, 32767, 0, 0]),
    ([2, 0, 0, 0], [65535, 0, 0, 0]),
];
/// Where the first bone's animation holds it.
const FOOT: [f32; 3] = [0.1, -0.9, 0.0];

/// A turn about Z.
fn about_z(degrees: f64) -> DQuat {
    DQuat::from_rotation_z(degrees.to_radians())
}

fn rod_vertices() -> Vec<[f32; 3]> {
    let corners = [[-WIDTH, WIDTH], [WIDTH, WIDTH], [WIDTH, -WIDTH], [-WIDTH, -WIDTH]];
    RINGS.iter().flat_map(|y| corners.map(|[x, z]| [x, *y, z])).collect()
}

/// A rod of skin without normals, half way between the keys of its animation: the first bone's is a step, the second's
/// linear, the third's a spline.
pub(super) fn skinned_rod() -> Prop {
    let mut file = File::new();
    let mut indices: Vec<[u16; 1]> = Vec::new();
    for ring in 0..3 {
        for side in 0..4 {
            let [a, b] = [4 * ring + side, 4 * ring + (side + 1) % 4];
            indices.extend([a, b, b + 4, a, b + 4, a + 4].map(|i| [i]));
        }
    }
    indices.extend([12, 13, 14, 12, 14, 15].map(|i| [i]));
    let of_vertices = BONES.iter().flat_map(|bones| [bones; 4]);
    let (joints, weights): (Vec<_>, Vec<_>) = of_vertices.copied().unzip();
    let primitive = json!({
        "attributes": {
            "POSITION": file.numbers(&rod_vertices()), "JOINTS_0": file.numbers(&joints), "WEIGHTS_0": file.shares(&weights)
        },
        "indices": file.numbers(&indices),
    });
    let mesh = file.mesh("rod", &[primitive]);
    let third = file.add("nodes", json!({"translation": [0.0, 0.6, 0.0]}));
    let second = file.add("nodes", json!({"translation": [0.0, 0.6, 0.0], "children": [third]}));
    let first = file.root(json!({"translation": [0.0, -0.9, 0.0], "children": [second]}));
    let binds = [0, 1, 2].map(|bone| {
        DMat4::from_translation(DVec3::new(0.0, -f64::from(RINGS[bone]), 0.0)).as_mat4().to_cols_array()
    });
    let binds = file.numbers(&binds);
    let skin = file.add("skins", json!({"joints": [first, second, third], "inverseBindMatrices": binds}));
    file.root(json!({"mesh": mesh, "skin": skin}));

    let times = file.numbers(&[[0.0_f32], [1.0]]);
    let [rest, bent] = [0.0, 60.0].map(|degrees| about_z(degrees).as_quat().to_array());
    let none = [0.0_f32; 4];
    let outputs = [
        (first, "translation", "STEP", file.numbers(&[FOOT, [5.0; 3]])),
        (second, "rotation", "LINEAR", file.numbers(&[rest, bent])),
        // Of each key the tangent before, the value, and the tangent after.
        (third, "rotation", "CUBICSPLINE", file.numbers(&[none, rest, none, none, bent, none])),
    ];
    let samplers =
        outputs.map(|(_, _, how, output)| json!({"input": times, "output": output, "interpolation": how}));
    let channels =
        [0, 1, 2].map(|i| json!({"sampler": i, "target": {"node": outputs[i].0, "path": outputs[i].1}}));
    file.add("animations", json!({"name": "bend", "samplers": samplers, "channels": channels}));
    Prop { mesh: "time = 0.5", effects: "\"diffuse\", \"skin\"", ..Prop::new("skinned_rod", file) }
}

/// The bones' places in the world half way, multiplied by hand.
fn joints() -> [DMat4; 3] {
    let first = DMat4::from_translation(Vec3::from(FOOT).as_dvec3());
    let on = DMat4::from_rotation_translation(about_z(30.0), DVec3::new(0.0, 0.6, 0.0));
    [first, first * on, first * on * on]
}

#[test]
fn the_rod_stands_where_its_bones_put_it() {
    let prop = skinned_rod();
    let posed = prop.baked().scene.mesh.pose();
    let rest = rod_vertices();
    assert_eq!(posed.positions.len(), rest.len());
    let joints = joints();
    for (i, (got, rest)) in posed.positions.iter().zip(rest).enumerate() {
        let (bones, weights) = BONES[i / 4];
        let moved = |bone: u8| {
            let joint = usize::from(bone);
            let within = Vec3::from(rest).as_dvec3() - DVec3::new(0.0, f64::from(RINGS[joint]), 0.0);
            joints[joint].transform_point3(within)
        };
        let want: DVec3 = (0..4).map(|j| f64::from(weights[j]) / 65535.0 * moved(bones[j])).sum();
        // Some roundings of f32 of what is about 1 in size: rotations, binds, positions, weights.
        assert!((got.as_dvec3() - want).length() < 2e-6, "vertex {i}: {got} is not {want}");
    }
    // It is seen where its last part is bent to, and not where it stood.
    let image = prop.image();
    let cover = |place: [f64; 2]| {
        let [x, y] = seen_at(place);
        image.alpha[y * SIZE + x]
    };
    let last = joints[2].transform_point3(DVec3::new(0.0, 0.3, 0.0));
    assert!(cover([last.x, last.y]) > 0.5, "{last}");
    assert_eq!(cover([0.1, 0.8]), 0.0);
}

/// Half the cube's width and height.
const CUBE: f32 = 0.4;
/// What the first target adds to the height above, and the second to the width on either side.
const ADDED: [f32; 2] = [0.6, 0.4];

/// A red cube before skin, a quarter of the way to where its first target is whole and its second is half.
pub(super) fn morphed_cube() -> Prop {
    let mut file = File::new();
    file.backdrop();
    let red = file.material(json!({"name": "Red", "pbrMetallicRoughness": mirror(&json!([1, 0, 0, 1]))}));
    let cube = Shape::cuboid([CUBE, CUBE, 0.2]);
    let mut primitive = file.primitive(&cube, red);
    let taller: Vec<[f32; 3]> =
        cube.positions.iter().map(|[_, y, _]| [0.0, if *y > 0.0 { ADDED[0] } else { 0.0 }, 0.0]).collect();
    let wider: Vec<[f32; 3]> =
        cube.positions.iter().map(|[x, ..]| [ADDED[1].copysign(*x), 0.0, 0.0]).collect();
    primitive["targets"] = json!([{"POSITION": file.numbers(&taller)}, {"POSITION": file.numbers(&wider)}]);
    let mesh = file.mesh("cube", &[primitive]);
    // The animation goes before the mesh's own weights.
    file.json["meshes"][mesh]["weights"] = json!([1, 1]);
    let node = file.root(json!({"mesh": mesh, "translation": [0.0, 0.0, -0.2]}));
    let times = file.numbers(&[[0.0_f32], [1.0]]);
    let weights = file.numbers(&[[0.0_f32], [0.0], [1.0], [0.5]]);
    file.add(
        "animations",
        json!({
            "samplers": [{"input": times, "output": weights}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "weights"}}],
        }),
    );
    let mesh = "skin = [\"Skin\"]\ntime = 0.25";
    Prop { mesh, effects: "\"diffuse\", \"morph\"", ..Prop::new("morphed_cube", file) }
}

#[test]
fn the_cube_is_as_large_as_its_weights_make_it() {
    let prop = morphed_cube().under(Sky::Even);
    // The cube's vertices follow the four of the skin behind it.
    let posed = prop.baked().scene.mesh.pose();
    let most = posed.positions[4..].iter().fold(Vec3::MIN, |most, place| most.max(*place));
    let least = posed.positions[4..].iter().fold(Vec3::MAX, |least, place| least.min(*place));
    let (up, aside) = (CUBE + 0.25 * ADDED[0], CUBE + 0.125 * ADDED[1]);
    for (got, want) in [(most.x, aside), (least.x, -aside), (most.y, up), (least.y, -CUBE)] {
        assert!((got - want).abs() < 1e-6, "{least} to {most}: {got} is not {want}");
    }
    // Its upper border is at 6.5 pixels, its right one at 16.5: half of these pixels shows the white skin.
    let image = prop.image();
    for (x, y, green) in
        [(12, 6, 0.5), (16, 12, 0.5), (12, 7, 0.0), (15, 12, 0.0), (12, 5, 1.0), (17, 12, 1.0)]
    {
        let got = at(&image, x, y);
        assert!(close(got, [1.0, green, green], 3e-3), "({x}, {y}): {got:?}");
    }
}

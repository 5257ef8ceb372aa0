//! A small character: a head of skin with a colour map and a normal map on a bone, eye and hair that go with it, and a
//! coloured body; posed by an animation and seen by a camera that are named.

use glam::{DMat4, DQuat, DVec3};
use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};
use skinfit::render::tonemap::srgb_decode;

use super::file::{File, Shape};
use super::{Prop, SIZE, Sky, at, mirror, seen_at};
use crate::plain::close;
use crate::scene_folder::{encode, png};

/// Where the head turns.
const NECK: [f64; 3] = [0.0, -0.2, 0.0];
/// The middle of the head's front.
const HEAD: [f64; 2] = [0.0, 0.2];
/// The head's colours to the left and to the right, by sRGB's curve.
const CHEEKS: [[u8; 3]; 2] = [[224, 172, 150], [141, 85, 60]];
/// Where both are seen, the eye and the hair, before the head turns.
const LEFT: [f64; 2] = [-0.2, 0.0];
const RIGHT: [f64; 2] = [0.2, 0.0];
const EYE: [f64; 2] = [0.15, 0.35];
const HAIR: [f64; 2] = [0.0, 0.72];

/// The skin's own material.
fn skin_of(file: &mut File) -> Value {
    let cheeks = RgbImage::from_fn(8, 1, |x, _| Rgb(CHEEKS[x as usize / 4]));
    let color = file.texture(&encode(cheeks, ImageFormat::Png), json!({}));
    // Leaning to the right of the picture.
    let normals = file.texture(&png(4, 4, [200, 128, 230]), json!({}));
    json!({
        "name": "Skin", "normalTexture": {"index": normals},
        "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorTexture": {"index": color}},
    })
}

/// A part that goes with the neck: its node.
fn with_neck(file: &mut File, shape: &Shape, material: &Value, [x, y]: [f64; 2], z: f64) -> usize {
    let material = file.material(material.clone());
    let primitive = file.primitive(shape, material);
    let mesh = file.mesh("part", &[primitive]);
    let at = [x - NECK[0], y - NECK[1], z - NECK[2]];
    file.add("nodes", json!({"mesh": mesh, "translation": at}))
}

/// An animation that turns a node about Z, from rest to some degrees within a second.
fn turning(file: &mut File, name: &str, node: usize, degrees: f64) {
    let times = file.numbers(&[[0.0_f32], [1.0]]);
    let turns =
        [0.0, degrees].map(|degrees: f64| DQuat::from_rotation_z(degrees.to_radians()).as_quat().to_array());
    let turns = file.numbers(&turns);
    file.add(
        "animations",
        json!({
            "name": name,
            "samplers": [{"input": times, "output": turns}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "rotation"}}],
        }),
    );
}

/// The character, whose head is tilted half way.
pub(super) fn character() -> Prop {
    let mut file = File::new();
    let skin = skin_of(&mut file);
    let skin = file.material(skin);
    let dark = json!({"name": "Eye", "pbrMetallicRoughness": mirror(&json!([0, 0, 0, 1]))});
    let eye = with_neck(&mut file, &Shape::panel(0.15, 0.15), &dark, EYE, 0.01);
    let thin = json!({
        "name": "Hair", "alphaMode": "BLEND",
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.6, "baseColorFactor": [0.2, 0.1, 0.05, 0.5]},
    });
    let hair = with_neck(&mut file, &Shape::panel(0.4, 0.12), &thin, HAIR, 0.0);
    let neck = file.root(json!({"name": "Neck", "translation": NECK, "children": [eye, hair]}));

    // The head stands in the world where it is bound; its bone is the neck.
    let mut head = Shape::cuboid([0.4, 0.4, 0.2]);
    for place in &mut head.positions {
        *place = [place[0] + HEAD[0] as f32, place[1] + HEAD[1] as f32, place[2] - 0.2];
    }
    let mut primitive = file.primitive(&head, skin);
    primitive["attributes"]["JOINTS_0"] = json!(file.numbers(&[[0_u8; 4]; 24]));
    primitive["attributes"]["WEIGHTS_0"] = json!(file.numbers(&[[1.0_f32, 0.0, 0.0, 0.0]; 24]));
    let mesh = file.mesh("head", &[primitive]);
    let bind = DMat4::from_translation(-DVec3::from(NECK)).as_mat4().to_cols_array();
    let binds = file.numbers(&[bind]);
    let bones = file.add("skins", json!({"joints": [neck], "inverseBindMatrices": binds}));
    file.root(json!({"mesh": mesh, "skin": bones}));

    let cloth = file.material(json!({"name": "Cloth", "pbrMetallicRoughness": {"metallicFactor": 0}}));
    let mut primitive = file.primitive(&Shape::cuboid([0.6, 0.2, 0.2]), cloth);
    primitive["attributes"]["COLOR_0"] = json!(file.shares(&[[51_u8, 102, 204]; 24]));
    let mesh = file.mesh("body", &[primitive]);
    file.root(json!({"mesh": mesh, "translation": [0, -0.8, -0.2]}));

    let lens = json!({"yfov": 2.0 * 0.3_f64.atan(), "znear": 0.1, "aspectRatio": 1.0});
    let lens = file.add("cameras", json!({"type": "perspective", "perspective": lens}));
    file.root(json!({"name": "Portrait", "camera": lens, "translation": [0, 0, 4]}));
    turning(&mut file, "shake", neck, -50.0);
    turning(&mut file, "tilt", neck, 90.0);
    Prop {
        mesh: "skin = [\"Skin\"]\nanimation = \"tilt\"\ntime = 0.5",
        effects: "\"diffuse\", \"normal_map\", \"skin\"",
        camera: "camera = \"Portrait\"",
        ..Prop::new("character", file)
    }
}

/// The pixel where a place of the head's front is seen, tilted by 45 degrees about the neck.
fn tilted([x, y]: [f64; 2]) -> [usize; 2] {
    let neck = DVec3::from(NECK);
    let turn = DMat4::from_translation(neck)
        * DMat4::from_rotation_z(45_f64.to_radians())
        * DMat4::from_translation(-neck);
    let place = turn.transform_point3(DVec3::new(x, y, 0.0));
    seen_at([place.x, place.y])
}

#[test]
fn skin_and_what_goes_with_it_stand_where_the_named_animation_turns_them() {
    let image = character().under(Sky::Even).image();
    // Under a sky of 1 skin shows the picture of its material, wherever its normals point.
    for (place, color) in [LEFT, RIGHT].into_iter().zip(CHEEKS) {
        let [x, y] = tilted(place);
        let (got, want) = (at(&image, x, y), color.map(|code| srgb_decode(f32::from(code) / 255.0)));
        assert!(close(got, want, 1e-3), "({x}, {y}): {got:?} is not {want:?}");
    }
    let [x, y] = tilted(EYE);
    assert!(close(at(&image, x, y), [0.0; 3], 2e-3), "{:?}", at(&image, x, y));
    // Nothing stands behind the hair, which covers a half.
    let [x, y] = tilted(HAIR);
    let cover = image.alpha[y * SIZE + x];
    assert!((cover - 0.5).abs() < 1e-6, "{cover}");
}

#[test]
fn the_camera_is_the_files_and_the_normal_map_is_the_materials() {
    let mut prop = character();
    let baked = prop.baked();
    let camera = baked.scene.views[0].camera;
    assert!((camera.eye() - DVec3::new(0.0, 0.0, 4.0)).length() < 1e-6, "{}", camera.eye());
    // The file has its angle in f32.
    assert!((camera.fov_y - 2.0 * 0.3_f64.atan()).abs() < 1e-7, "{}", camera.fov_y);
    let bumped = prop.image();
    prop.file.json["materials"][0].as_object_mut().unwrap().remove("normalTexture");
    let smooth = prop.image();
    let [x, y] = tilted(LEFT);
    let (bumped, smooth) = (at(&bumped, x, y)[1], at(&smooth, x, y)[1]);
    // The normal leans by 35 degrees; up the picture's right side is up in the world, where the studio is brighter.
    assert!(bumped > 1.02 * smooth, "{bumped} and {smooth}");
}

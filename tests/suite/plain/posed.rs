//! Parts with holes and parts that blend in other poses: by rays and by shadow maps the light that passes them goes with them.

use serde_json::{Value, json};
use skinfit::gpu::upload::Content;
use skinfit::gpu::{RenderOptions, Renderer};
use skinfit::prepare::Baked;

use super::cutouts::{Alpha, at, beside_the_open, card, halves, lit_folder, tolerances, traced_and_drawn};
use crate::graphics::bench::{EXACT, gpu};

/// What moves the card.
#[derive(Clone, Copy, Debug)]
enum Mover {
    Target,
    Bone,
}

/// How far its animation raises it in one second from 0.5 above the skin. Light falls 1 to the side on 0.7 down, so the place
/// that is looked at, 0.87 right of the skin's middle, is seen past the card 0.16 right of its middle before and 0.16 left of
/// it afterwards: by a half of its picture, and then by the other.
const RAISED: f32 = 0.22;

impl Mover {
    /// Have it raise the card.
    fn put(self, mesh: &mut Value, bin: &mut Vec<u8>) {
        let primitive = &mut mesh["meshes"][1]["primitives"][0];
        let (path, node, kind, keys) = match self {
            Self::Target => {
                // One upward, of the card's own scale, which is a half.
                primitive["targets"] = json!([{"POSITION": 4}]);
                ("weights", 1, "SCALAR", vec![0.0, 2.0 * RAISED])
            }
            Self::Bone => {
                primitive["attributes"]["WEIGHTS_0"] = json!(3);
                primitive["attributes"]["JOINTS_0"] = json!(6);
                mesh["skins"] = json!([{"joints": [2]}]);
                let bone = json!({"scale": [0.5, 0.5, 0.5], "translation": [0, 0, 0.5]});
                mesh["nodes"] = json!([{"mesh": 0}, {"mesh": 1, "skin": 0}, bone]);
                mesh["scenes"][0]["nodes"] = json!([0, 1, 2]);
                ("translation", 2, "VEC3", vec![0.0, 0.0, 0.5, 0.0, 0.0, 0.5 + RAISED])
            }
        };
        let times = two_keys(mesh, bin, &[0.0, 1.0], "SCALAR");
        let keys = two_keys(mesh, bin, &keys, kind);
        mesh["buffers"][0]["byteLength"] = json!(bin.len());
        mesh["animations"] = json!([{
            "samplers": [{"input": times, "output": keys}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": path}}],
        }]);
    }
}

/// An accessor of these numbers, half of them a key.
fn two_keys(mesh: &mut Value, bin: &mut Vec<u8>, numbers: &[f32], kind: &str) -> usize {
    let offset = bin.len();
    bin.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    let views = mesh["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": 4 * numbers.len()}));
    let view = views.len() - 1;
    let accessors = mesh["accessors"].as_array_mut().unwrap();
    accessors.push(json!({"bufferView": view, "componentType": 5126, "count": 2, "type": kind}));
    accessors.len() - 1
}

/// The scene before the card is raised and afterwards, each with how bright the place is beside one that nothing shades;
/// by either mover, of a card whose right half is a hole, of one whose left half is, and of one whose right half blends.
fn cases() -> Vec<(Mover, [(Baked, f32); 2])> {
    // What blends with an alpha of 128 of 255 lets the rest through.
    let pictures: [(&str, Alpha, [f32; 2]); 3] = [
        ("MASK", halves, [1.0, 0.0]),
        ("MASK", |x, y| 255 - halves(x, y), [0.0, 1.0]),
        ("BLEND", |x, y| halves(x, y).max(128), [127.0 / 255.0, 0.0]),
    ];
    let of = |mover: Mover| {
        pictures.map(|(mode, alpha, bright)| {
            let folder = lit_folder(&card(mode), alpha, |mesh, bin| mover.put(mesh, bin));
            (mover, [(0.0, bright[0]), (1.0, bright[1])].map(|(time, want)| (at(&folder, Some(time)), want)))
        })
    };
    [Mover::Target, Mover::Bone].into_iter().flat_map(of).collect()
}

#[test]
fn light_passes_holes_and_what_blends_where_targets_and_bones_have_put_them() {
    for (mover, poses) in cases() {
        for (time, (baked, want)) in poses.iter().enumerate() {
            let found = traced_and_drawn(baked).into_iter().zip(tolerances(*want));
            for ((found, tolerance), how) in found.zip(["rays", "shadow map"]) {
                let Some(found) = found else { continue };
                assert!(
                    (found - want).abs() < tolerance,
                    "{mover:?}, {time} s, {how}: {found} is not {want}"
                );
            }
        }
    }
}

#[test]
fn a_renderer_that_is_given_another_pose_moves_holes_and_what_blends_in_its_shadow_maps() {
    let Some(gpu) = gpu() else { return };
    for (mover, poses) in cases() {
        let rest = &poses[0].0;
        let options = RenderOptions { animated: true, ..EXACT };
        let mut renderer = Renderer::new(gpu, Content::of(rest), options).unwrap();
        let camera = rest.scene.views[0].camera;
        // There and back.
        for (posed, want) in [&poses[0], &poses[1], &poses[0]] {
            let mesh = &posed.scene.mesh;
            let weights: Vec<f32> = mesh.morphs.iter().map(|morph| morph.weight).collect();
            renderer.set_pose(&mesh.bones, &weights).unwrap();
            let found = beside_the_open(&renderer.render(&camera, rest.gains[0]).unwrap().image);
            let [_, tolerance] = tolerances(*want);
            assert!((found - want).abs() < tolerance, "{mover:?}: {found} is not {want}");
        }
    }
}

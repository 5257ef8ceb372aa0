//! The vertex stage against the oracle's vectors, and mesh files against poses of another program.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3, DVec4, Vec3};
use serde_json::Value;
use skinfit::model::real::Real;
use skinfit::model::vertex::{Bone, Delta, Vertex, deform};
use skinfit::scene::mesh::Mesh;
use skinfit::scene::{LoadOptions, Scene, Warning};

use super::by_rules::Function;
use super::common;
use super::vectors::reader::{Node, Vectors};

/// What the rules see of a vertex: V, S.z, its square, and S.w.
const SIGHT: [&str; 5] = [
    include_str!("../../src/rules/shader/rules/lib/vector.wgsl"),
    include_str!("../../src/rules/shader/rules/vertex/vertex_view.wgsl"),
    include_str!("../../src/rules/shader/rules/vertex/vertex_silhouette.wgsl"),
    include_str!("../../src/rules/shader/rules/vertex/vertex_rim_squared.wgsl"),
    include_str!("../../src/rules/shader/rules/fragment/dapple_cosine.wgsl"),
];

/// Every output of listing 3-3 for a vector file's inputs, evaluated in `R`: the vertex as meshes are posed, and the
/// rules of what the eye sees of it.
fn vertex_stage<R: Real>(
    inputs: &Node<'_>,
    zero: R,
    wide: impl Fn(R) -> f64,
) -> [(&'static str, Vec<f64>); 7] {
    let lit = |numbers: &[f64]| -> Vec<R> { numbers.iter().map(|&x| zero.lit(x)).collect() };
    let list = |name: &str| lit(&inputs.at(name).numbers());
    let three = |v: &[R]| [v[0], v[1], v[2]];
    let (normal, tangent) = (list("normal"), list("tangent"));
    let vertex = Vertex {
        position: inputs.at("coord").three().map(|x| zero.lit(x)),
        normal: three(&normal),
        tangent: three(&tangent),
        handedness: tangent[3],
        occlusion: normal[3],
    };
    let (dx, dn) = (list("coordMorph"), list("normalMorph"));
    let deltas = list("morph_w").into_iter().enumerate().map(|(i, weight)| Delta {
        weight,
        position: three(&dx[3 * i..]),
        normal: three(&dn[4 * i..]),
        occlusion: dn[4 * i + 3],
    });
    let matrices = list("bones");
    let row = |m: &[R], i: usize| std::array::from_fn(|j| m[4 * i + j]);
    let bones: Vec<Bone<R>> =
        matrices.chunks(16).map(|m| Bone::new([row(m, 0), row(m, 1), row(m, 2)])).collect();
    let indices = inputs.at("boneIndex").numbers();
    let influences = list("boneWeight").into_iter().zip(indices.iter().map(|&i| &bones[i as usize]));
    let surface = deform(&vertex, deltas, influences);
    let dapple = inputs.at("dapple").item(2).three().map(|x| zero.lit(x));
    let [view_of, silhouette_of, square_of, dapple_of] = [
        ("view_at_vertex", &[3, 3][..]),
        ("silhouette_at_vertex", &[3, 3]),
        ("squared_rim_at_vertex", &[1]),
        ("dapple_along_axis", &[3, 3]),
    ]
    .map(|(name, arguments)| Function::new(&SIGHT, name, arguments));
    let view_from = |eye: [R; 3]| view_of.of(zero, &[&surface.position, &eye]);
    let view = view_from(inputs.at("cam_pos").three().map(|x| zero.lit(x)));
    // The vectors' view matrix stands elsewhere than their cam_pos, and the listing takes |N.V| there.
    let matrix = |name: &str| {
        DMat4::from_cols_array(&<[f64; 16]>::try_from(inputs.at(name).numbers()).unwrap()).transpose()
    };
    let w: f64 = inputs.at("boneWeight").numbers().iter().sum();
    // Weights that do not sum to 1 scale the listing's view translation by their sum.
    let eye = (matrix("view").inverse().w_axis.truncate() * w).to_array().map(|x| zero.lit(x));
    let silhouette = silhouette_of.of(zero, &[&surface.normal, &view_from(eye)])[0];
    let square = square_of.of(zero, &[&[silhouette]])[0];
    let leaves = dapple_of.of(zero, &[&surface.normal, &dapple])[0];
    let silhouette = [surface.occlusion, square, silhouette, leaves];
    let out = |v: &[R]| -> Vec<f64> { v.iter().map(|&x| wide(x)).collect() };
    let world = DVec3::from(surface.position.map(&wide)).extend(w);
    let tbn = |i: usize| out(&[surface.tangent[i], surface.bitangent[i], surface.normal[i]]);
    let place: DVec4 = matrix("proj") * (matrix("view") * world);
    [
        ("HPOS", place.to_array().to_vec()),
        ("WorldEyeDir", out(&view)),
        ("SkinSilhouetteVec", out(&silhouette)),
        ("WorldTanMatrixX", tbn(0)),
        ("WorldTanMatrixY", tbn(1)),
        ("WorldTanMatrixZ", tbn(2)),
        ("worldCoord", world.to_array().to_vec()),
    ]
}

pub(crate) fn vertex_vector(file: &Node<'_>) {
    // The vectors' own tolerances: roundings of each format through some fifty operations.
    let tolerances = file.vector.tolerances();
    let inputs = file.at("inputs");
    let runs = [
        (vertex_stage(&inputs, 0.0_f64, |x| x), tolerances.double),
        (vertex_stage(&inputs, 0.0_f32, f64::from), tolerances.single),
    ];
    for (outputs, tolerance) in runs {
        for (what, got) in outputs {
            tolerance.check(what, &got, &file.at("expected").at(what));
        }
    }
}

#[test]
fn the_vertex_stage_is_the_oracles() {
    Vectors::read(&common::vectors()).of_kind("vertex").iter().for_each(vertex_vector);
}

/// Load `mesh` through a scene without maps; `lines` stand in its `[mesh]` table.
fn load(mesh: &Path, lines: &str, effects: &str) -> (Mesh, Vec<Warning>) {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let text = format!(
        "[mesh]\nfile = {mesh:?}\n{lines}\n[model]\neffects = [{effects}]\n[[view]]\nname = \"a\"\n\
         world_to_camera = [1,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1]\nfov_y_degrees = 30\nwidth = 8\nheight = 8\n"
    );
    std::fs::write(&scene, text).unwrap();
    let (scene, warnings) = Scene::load(&scene, &LoadOptions::default()).unwrap();
    (scene.mesh, warnings)
}

fn rigged(name: &str) -> Option<PathBuf> {
    common::data().map(|data| data.join("rigged").join(name))
}

#[test]
fn poses_are_those_of_another_programs_importer() {
    let Some(folder) = rigged("") else { return };
    for file in ["mh_head", "RiggedSimple"] {
        let text = std::fs::read(folder.join(format!("golden_{file}.json"))).unwrap();
        let golden: Value = serde_json::from_slice(&text).unwrap();
        let poses = golden["poses"].as_array().unwrap();
        let mut times: Vec<f64> = poses.iter().map(|pose| pose["time"].as_f64().unwrap()).collect();
        times.dedup();
        times.sort_by(f64::total_cmp);
        times.dedup();
        for time in times {
            let (mesh, _) =
                load(&folder.join(format!("{file}.glb")), &format!("time = {time}"), r#""morph", "skin""#);
            let posed = mesh.pose();
            // The file's nodes in order: head, then eyes.
            let mut vertex = 0;
            for pose in poses.iter().filter(|pose| pose["time"].as_f64() == Some(time)) {
                let bytes = std::fs::read(folder.join(pose["file"].as_str().unwrap())).unwrap();
                let want: Vec<f32> =
                    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
                let size = want.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
                let mut worst = 0.0_f32;
                for want in want.chunks_exact(3).map(Vec3::from_slice) {
                    worst = worst.max((posed.positions[vertex] - want).abs().max_element() / size);
                    vertex += 1;
                }
                println!("{file} {} at {time}: {worst:e}", pose["node"]);
                crate::figures::measured("poses", worst);
                // The other program's own rounding, against a third, is 3e-7 of the model's size.
                assert!(worst < 1e-5, "{file} {} at {time}: {worst}", pose["node"]);
            }
            assert_eq!(vertex, posed.positions.len());
            for normal in &posed.normals {
                // One rounding of f32 in each component.
                assert!((normal.length() - 1.0).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn morph_weights_move_the_named_targets_and_nothing_else() {
    let Some(head) = rigged("mh_head.glb") else { return };
    let (rest, _) = load(&head, "", r#""morph", "skin""#);
    let names: Vec<&str> = rest.morphs.iter().map(|morph| morph.name.as_str()).collect();
    assert_eq!(names, ["mouthOpen", "smile", "blink", "browsUp", "pucker"]);
    let (smiling, _) = load(&head, "morph_weights = [0, 1, 0, 0, 0]", "");
    assert!(smiling.bones.is_empty(), "morph_weights asks for morphs alone");
    let (a, b) = (rest.pose_with_weights(&[0.0, 1.0]), smiling.pose());
    assert_ne!(a.positions, rest.pose().positions);
    for (a, b) in a.positions.iter().zip(&b.positions) {
        // At rest the bones are the identity but for the file's rounding of a head of 0.3 m.
        assert!((*a - *b).abs().max_element() < 1e-6);
    }
    let (plain, _) = load(&head, "", "");
    assert!(plain.morphs.is_empty() && plain.joints.is_empty() && plain.uvs.is_empty());
}

#[test]
fn a_clipped_animation_holds_its_last_pose() {
    let Some(head) = rigged("mh_head.glb") else { return };
    let at = |time: &str| load(&head, &format!("time = {time}"), "\"morph\"").0.pose().positions;
    assert_eq!(at("2.0"), at("1e9"));
    assert_eq!(at("0"), at("-3"));
    assert_ne!(at("0"), at("0.5"));
}

#[test]
fn a_node_scales_and_turns_its_mesh_and_the_morphs_with_it() {
    let Some(sphere) = rigged("AnimatedMorphSphere.gltf") else { return };
    let (mesh, warnings) = load(&sphere, "", r#""morph""#);
    assert_eq!(warnings, []);
    assert_eq!((mesh.morphs.len(), mesh.positions.len()), (2, 1876));
    // 0.01 in the file, scaled by 100 in the node.
    let radius = mesh.positions.iter().fold(0.0_f32, |m, p| m.max(p.length()));
    assert!((radius - 1.0).abs() < 1e-3, "{radius}");
    let reach = |morph: &skinfit::scene::mesh::Morph| {
        morph.positions.iter().fold(0.0_f32, |m, d| m.max(d.abs().max_element()))
    };
    // The file's greatest delta component is 0.0313; the node turns by quarter turns only.
    assert!((reach(&mesh.morphs[0]) - 3.13).abs() < 0.01, "{}", reach(&mesh.morphs[0]));
    let mut worst = 1.0_f32;
    for (normal, position) in mesh.normals.iter().zip(&mesh.positions) {
        worst = worst.min(normal.dot(position.normalize()));
    }
    // The coarse sphere's own normals lean from its radii: 0.99044 in the file.
    assert!((worst - 0.990_44).abs() < 1e-4, "{worst}");
}

#[test]
fn a_robot_of_many_skinned_and_rigid_parts_loads_with_its_weights_mended() {
    let Some(robot) = rigged("RobotExpressive.glb") else { return };
    let (mesh, warnings) = load(&robot, "", r#""morph", "skin""#);
    let said: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(said.iter().any(|w| w.contains("bone weights that do not sum to 1")), "{said:?}");
    let names: Vec<&str> = mesh.morphs.iter().map(|morph| morph.name.as_str()).collect();
    assert_eq!(names, ["Angry", "Surprised", "Sad"]);
    for weights in &mesh.weights {
        // Four roundings of f32.
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }
    let posed = mesh.pose();
    let (low, high) = bounds(&posed.positions);
    println!("robot: {low} to {high}, {} vertices, {said:?}", posed.positions.len());
    // A robot of some 4.5 units stands on the ground.
    assert!(low.y.abs() < 0.1 && (4.0..5.0).contains(&high.y), "{low} {high}");
    let (_, warnings) = load(&robot, "", "");
    assert!(warnings.iter().any(|w| w.message.contains("effect `skin` is off")), "{warnings:?}");
}

fn bounds(positions: &[Vec3]) -> (Vec3, Vec3) {
    let first = positions[0];
    positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)))
}

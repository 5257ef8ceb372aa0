//! The conformance vectors through the shader rules' WGSL, on a graphics adapter.

use glam::{Mat4, Vec2, Vec3, Vec4};
use serde_json::Value;
use skinfit::bake::Illumination;
use skinfit::bake::{LobeStack, VertexOcclusion};
use skinfit::gpu::Gpu;
use skinfit::gpu::probe::evaluate;
use skinfit::gpu::upload::Content;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::scene::mesh::{Mesh, Morph};
use skinfit::shader::facts::MapFacts;
use skinfit::shader::probe::Probe;
use skinfit::shader::rule::Stage;
use skinfit::shader::{Constant, Facts};

use super::bench;
use crate::common;
use crate::fixtures::bare_scene;
use crate::vectors::{Vectors, column_params, number, numbers, params, three};

const EFFECTS: Effects = Effects::SURFACE.with(Effect::Haze);

fn facts(form: Form, silhouette: Silhouette) -> Facts {
    let setup = Setup { form, silhouette, effects: EFFECTS };
    Facts { setup, maps: MapFacts { normal: true, ..MapFacts::default() }, ..Facts::default() }
}

/// A probe's uniform block: parameters as they are, the eye at the origin, weights of morph targets.
fn block(probe: &Probe, params: &Params, eye: [f32; 3], morph_weights: &[f32]) -> Vec<f32> {
    let mut block = Vec::new();
    for constant in &probe.plan.constants {
        match constant {
            Constant::Param(param) => block.extend(params.rgb(*param).map(|x| x as f32)),
            Constant::Eye => block.extend(eye),
            Constant::MorphWeights => {
                block.extend(morph_weights.iter().flat_map(|&w| [w, 0.0, 0.0, 0.0]));
                continue;
            }
            other => panic!("the vectors do not set {}", other.name()),
        }
        block.push(0.0);
    }
    block
}

/// As the vectors' rule says, with `slack` times their tolerance for f32: WGSL asks of exp2, log2, division
/// and square roots only a few units in the last place, where the CPU rounds correctly.
fn check(file: &Value, what: &str, got: &[f32], want: &Value) {
    let want = numbers(want);
    let slack = 4.0;
    let tolerance = |name: &str| slack * file["tolerance"][name].as_f64().unwrap();
    let largest = want.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    assert_eq!(got.len(), want.len(), "{} {what}", file["name"]);
    for (i, (&g, w)) in got.iter().zip(&want).enumerate() {
        let bound = tolerance("f32_abs") * largest + tolerance("f32_rel") * w.abs();
        assert!((f64::from(g) - w).abs() <= bound, "{} {what}[{i}]: {g} is not {w}", file["name"]);
    }
}

fn illumination(vectors: &Vectors, file: &Value) -> Illumination {
    let cube = |which: &str| vectors.cube::<f32>(file, which);
    Illumination {
        irradiance: Some(cube("diffuse")),
        lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![cube("spec")] }),
        hilite: Some(cube("hilite")),
    }
}

fn run(gpu: &Gpu, probe: &Probe, light: &Illumination, params: &Params, given: &[f64]) -> Vec<f32> {
    let scene = bare_scene(EFFECTS);
    let content = Content { scene: &scene, illumination: light, occlusion: None, params };
    let given: Vec<f32> = given.iter().map(|&x| x as f32).collect();
    evaluate(gpu, probe, content, &block(probe, params, [0.0; 3], &[]), &given).unwrap()
}

const PARTS: [(&str, &str); 8] = [
    ("n", "vec3f"),
    ("reflected", "vec3f"),
    ("rim", "f32"),
    ("diffuse_part", "vec3f"),
    ("side_part", "vec3f"),
    ("hilite_part", "vec3f"),
    ("mirror_part", "vec3f"),
    ("haze", "f32"),
];

/// One fragment file in one form.
fn fragment(gpu: &Gpu, vectors: &Vectors, file: &Value, form: Form) {
    let (name, silhouette) = match form {
        Form::Corrected => ("corrected", Silhouette::Bumped),
        Form::Listing => ("literal", Silhouette::Vertex),
    };
    let want = &file["expected"][name];
    if want.is_null() {
        return;
    }
    let params = match form {
        Form::Corrected => params(&file["constants"]["corrected"]),
        Form::Listing => {
            let mut params = Params::defaults(Form::Listing);
            for (name, param) in [("hilite", Param::Hilite), ("reflection", Param::Reflection)] {
                params.set(param, number(&file["constants"]["literal"][name]).unwrap());
            }
            params
        }
    };
    let given = [
        ("normal_texel", "vec3f"),
        ("vertex_tangent", "vec3f"),
        ("vertex_bitangent", "vec3f"),
        ("vertex_normal", "vec3f"),
        ("vertex_position", "vec3f"),
        ("vertex_view", "vec3f"),
        ("vertex_occlusion", "f32"),
        ("vertex_silhouette", "f32"),
        ("dapple", "f32"),
        ("albedo", "vec3f"),
        ("specular", "f32"),
        ("attenuator", "f32"),
    ];
    let probe = Probe::new(&facts(form, silhouette), Stage::Fragment, &given, &PARTS).unwrap();
    let inputs = &file["inputs"];
    let rows = ["X", "Y", "Z"].map(|row| three(&inputs[format!("WorldTanMatrix{row}")]));
    let column = |i: usize| [rows[0][i], rows[1][i], rows[2][i]];
    let texel = numbers(&inputs["normSideSpec"]);
    let s = numbers(&inputs["SkinSilhouetteVec"]);
    // The eye is at the origin, so that the position is the view vector.
    let view = three(&inputs["WorldEyeDir"]);
    let mut item = texel[..3].to_vec();
    for vector in [column(0), column(1), column(2), view, view] {
        item.extend(vector);
    }
    item.extend([s[0], s[2], if form == Form::Corrected { s[3].max(0.0) } else { s[3] }]);
    item.extend(three(&inputs["skinColor"]));
    item.extend([texel[3], number(&inputs["hiLightAttenuator"]).unwrap()]);
    let got = run(gpu, &probe, &illumination(vectors, file), &params, &item);
    check(file, &format!("{name} n"), &got[..3], &want["n"]);
    check(file, &format!("{name} reflection"), &got[3..6], &want["reflVect"]);
    if form == Form::Corrected {
        check(file, "corrected rim", &got[6..7], &want["rim"]);
    }
    let channel = |c: usize| got[7 + c] + got[10 + c] + got[13 + c] + got[16 + c];
    check(file, &format!("{name} rgba"), &[channel(0), channel(1), channel(2), got[19]], &want["rgba"]);
}

fn rim(gpu: &Gpu, file: &Value) {
    let given = [("silhouette", "f32")];
    let wanted = [("rim", "f32")];
    let facts = facts(Form::Corrected, Silhouette::Fragment);
    let probe = Probe::new(&facts, Stage::Fragment, &given, &wanted).unwrap();
    let z = numbers(&file["inputs"]["f"]);
    let mut got = vec![Vec::new(); z.len()];
    for exponent in numbers(&file["inputs"]["exponent"]) {
        let mut params = Params::defaults(Form::Corrected);
        params.set(Param::RimExponent, exponent);
        let column = run(gpu, &probe, &Illumination::default(), &params, &z);
        got.iter_mut().zip(column).for_each(|(row, x)| row.push(x));
    }
    check(file, "rim", &got.concat(), &file["expected"]["rim"]);
}

fn cube_sample(gpu: &Gpu, vectors: &Vectors, file: &Value) {
    let given = [("reflected", "vec3f")];
    let wanted = [("mirror_light", "vec4f")];
    let facts = facts(Form::Corrected, Silhouette::Fragment);
    let probe = Probe::new(&facts, Stage::Fragment, &given, &wanted).unwrap();
    let directions = numbers(&file["inputs"]["directions"]);
    let got = run(gpu, &probe, &illumination(vectors, file), &Params::defaults(Form::Corrected), &directions);
    check(file, "seamless lookups", &got, &file["expected"]["seamless"]);
}

/// The race's sixteen pixels: stored samples through the fragment rules.
fn bench(gpu: &Gpu, vectors: &Vectors, file: &Value) {
    let given = [
        ("base", "vec3f"),
        ("bump", "vec3f"),
        ("normal", "vec3f"),
        ("view", "vec3f"),
        ("open", "f32"),
        ("dapple", "f32"),
        ("albedo", "vec3f"),
        ("specular", "f32"),
        ("attenuator", "f32"),
    ];
    let probe =
        Probe::new(&facts(Form::Corrected, Silhouette::Bumped), Stage::Fragment, &given, &PARTS).unwrap();
    let params = column_params(&file["inputs"]["params"]);
    let g = &file["inputs"]["gbuffer"];
    let mut items = Vec::new();
    for i in 0..16 {
        for name in ["A", "B", "A", "E"] {
            items.extend(three(&g[name][i]));
        }
        items.extend([number(&g["o"][i]).unwrap(), 1.0]);
        items.extend(three(&g["c"][i]));
        items.extend([number(&g["p"][i]).unwrap(), number(&g["a"][i]).unwrap()]);
    }
    let got = run(gpu, &probe, &illumination(vectors, file), &params, &items);
    let rgba =
        got.chunks(PARTS.iter().map(|(_, kind)| if *kind == "f32" { 1 } else { 3 }).sum()).flat_map(|p| {
            let channel = |c: usize| p[7 + c] + p[10 + c] + p[13 + c] + p[16 + c];
            [channel(0), channel(1), channel(2), p[19]]
        });
    check(file, "forward", &rgba.collect::<Vec<_>>(), &file["expected"]["forward"]);
}

/// The vertex stage: five morph targets and four bones of eight.
fn vertex(gpu: &Gpu, file: &Value) {
    let inputs = &file["inputs"];
    let list = |name: &str| -> Vec<f32> { numbers(&inputs[name]).iter().map(|&x| x as f32).collect() };
    let (coord, normal, tangent) = (list("coord"), list("normal"), list("tangent"));
    let (dx, dn, weights) = (list("coordMorph"), list("normalMorph"), list("morph_w"));
    let bones = list("bones");
    let joints = list("boneIndex");
    let mesh = Mesh {
        positions: vec![Vec3::from_slice(&coord)],
        normals: vec![Vec3::from_slice(&normal)],
        tangents: vec![Vec4::from_slice(&tangent)],
        uvs: vec![Vec2::ZERO],
        morphs: weights
            .iter()
            .enumerate()
            .map(|(i, &weight)| Morph {
                name: i.to_string(),
                weight,
                positions: vec![Vec3::from_slice(&dx[3 * i..])],
                normals: vec![Vec3::from_slice(&dn[4 * i..])],
            })
            .collect(),
        joints: vec![[0, 1, 2, 3].map(|i: usize| joints[i] as u16)],
        weights: vec![list("boneWeight").try_into().unwrap()],
        bones: bones.chunks(16).map(|m| Mat4::from_cols_slice(m).transpose()).collect(),
        ..Mesh::default()
    };
    let occlusion = VertexOcclusion {
        base: vec![normal[3]],
        morphs: (0..weights.len()).map(|i| vec![dn[4 * i + 3]]).collect(),
    };
    let active: Vec<f32> = weights.iter().copied().filter(|&w| w != 0.0).collect();
    let facts =
        Facts { morphs: active.len() as u32, bones: true, ..facts(Form::Corrected, Silhouette::Vertex) };
    let wanted = [
        ("vertex_position", "vec3f"),
        ("vertex_normal", "vec3f"),
        ("vertex_tangent", "vec3f"),
        ("vertex_bitangent", "vec3f"),
        ("vertex_view", "vec3f"),
        ("vertex_occlusion", "f32"),
    ];
    let probe = Probe::new(&facts, Stage::Vertex, &[], &wanted).unwrap();
    let scene = skinfit::scene::Scene { mesh, ..bare_scene(EFFECTS) };
    let params = Params::defaults(Form::Corrected);
    let light = Illumination::default();
    let content =
        Content { scene: &scene, illumination: &light, occlusion: Some(&occlusion), params: &params };
    let mut given = Vec::new();
    for (name, _) in &probe.given {
        match *name {
            "rest_position" => given.extend(&coord[..3]),
            "rest_normal" => given.extend(&normal[..3]),
            "rest_tangent" => given.extend(&tangent),
            "rest_occlusion" => given.push(normal[3]),
            "joints" => given.extend(&joints),
            "joint_weights" => given.extend(list("boneWeight")),
            other => panic!("the vectors do not give {other}"),
        }
    }
    let eye: [f32; 3] = list("cam_pos")[..3].try_into().unwrap();
    let got = evaluate(gpu, &probe, content, &block(&probe, &params, eye, &active), &given).unwrap();
    let expected = &file["expected"];
    let three_of = |name: &str| Value::from(three(&expected[name]).to_vec());
    check(file, "position", &got[..3], &three_of("worldCoord"));
    for (i, row) in ["WorldTanMatrixX", "WorldTanMatrixY", "WorldTanMatrixZ"].into_iter().enumerate() {
        check(file, row, &[got[6 + i], got[9 + i], got[3 + i]], &expected[row]);
    }
    check(file, "view", &got[12..15], &expected["WorldEyeDir"]);
    check(file, "occlusion", &got[15..16], &Value::from(vec![numbers(&expected["SkinSilhouetteVec"])[0]]));
}

#[test]
fn vectors_hold_in_the_shaders() {
    let Some(folder) = common::shared("vectors", "SKINFIT_VECTORS") else { return };
    let vectors = Vectors::read(&folder);
    let Some(gpu) = bench::gpu() else { return };
    let mut checked = 0;
    for file in vectors.files.values() {
        checked += 1;
        match file["kind"].as_str().unwrap() {
            "fragment" => Form::ALL.into_iter().for_each(|form| fragment(gpu, &vectors, file, form)),
            "rim" => rim(gpu, file),
            "cube_sample" => cube_sample(gpu, &vectors, file),
            "bench" => bench(gpu, &vectors, file),
            "vertex" => vertex(gpu, file),
            // Baking is no shader's; the rest is held against the CPU (`vectors`), where an unknown kind fails.
            _ => checked -= 1,
        }
    }
    assert!(checked > 0, "{} holds nothing that shaders evaluate", folder.display());
}

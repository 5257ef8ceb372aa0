//! The conformance vectors through the shader rules' WGSL, on a graphics adapter.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use skinfit::bake::Illumination;
use skinfit::bake::{LobeStack, VertexOcclusion};
use skinfit::gpu::Gpu;
use skinfit::gpu::probe::evaluate;
use skinfit::gpu::upload::Content;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::scene::mesh::{Mesh, Morph};
use skinfit::shader::Domain;
use skinfit::shader::facts::MapFacts;
use skinfit::shader::probe::Probe;
use skinfit::shader::{Constant, Facts};

use super::bench;
use crate::common;
use crate::fixtures::bare_scene;
use crate::vectors::reader::{Node, Vectors};
use crate::vectors::{column_params, cube, params};

const EFFECTS: Effects = Effects::SURFACE.with(Effect::Haze);

fn facts(form: Form, silhouette: Silhouette) -> Facts {
    let setup = Setup::new(form, silhouette, EFFECTS);
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

/// As the vectors' rule says, with four times their tolerance for f32: WGSL asks of exp2, log2, division
/// and square roots only a few units in the last place, where the CPU rounds correctly.
fn check(what: &str, got: &[f32], want: &Node<'_>) {
    let got: Vec<f64> = got.iter().map(|&x| x.into()).collect();
    want.vector.tolerances().single.times(4.0).check(what, &got, want);
}

fn illumination(vectors: &Vectors, file: &Node<'_>) -> Arc<Illumination> {
    let cube = |which: &str| cube::<f32>(vectors, file, which);
    Arc::new(Illumination {
        irradiance: Some(cube("diffuse")),
        lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![cube("spec")] }),
        hilite: Some(cube("hilite")),
        reflected: None,
    })
}

fn run(gpu: &Gpu, probe: &Probe, light: Arc<Illumination>, params: &Params, given: &[f64]) -> Vec<f32> {
    let scene = Arc::new(bare_scene(EFFECTS));
    let content = Content {
        scene,
        illumination: light,
        occlusion: None,
        sky: None,
        thickness: None,
        params: params.clone(),
    };
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
fn fragment(gpu: &Gpu, vectors: &Vectors, file: &Node<'_>, form: Form) {
    let (name, silhouette) = match form {
        Form::Corrected => ("corrected", Silhouette::Bumped),
        Form::Listing => ("literal", Silhouette::Vertex),
    };
    let want = file.at("expected").at(name);
    if want.is_null() {
        return;
    }
    let params = params(form, &file.at("constants").at(name));
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
    let probe = Probe::new(&facts(form, silhouette), Domain::Fragment, &given, &PARTS).unwrap();
    let inputs = file.at("inputs");
    let rows = ["X", "Y", "Z"].map(|row| inputs.at(&format!("WorldTanMatrix{row}")).three());
    let column = |i: usize| [rows[0][i], rows[1][i], rows[2][i]];
    let texel = inputs.at("normSideSpec").numbers();
    let s = inputs.at("SkinSilhouetteVec").numbers();
    // The eye is at the origin, so that the position is the view vector.
    let view = inputs.at("WorldEyeDir").three();
    let mut item = texel[..3].to_vec();
    for vector in [column(0), column(1), column(2), view, view] {
        item.extend(vector);
    }
    item.extend([s[0], s[2], if form == Form::Corrected { s[3].max(0.0) } else { s[3] }]);
    item.extend(inputs.at("skinColor").three());
    item.extend([texel[3], inputs.at("hiLightAttenuator").number()]);
    let got = run(gpu, &probe, illumination(vectors, file), &params, &item);
    check("n", &got[..3], &want.at("n"));
    check("reflection", &got[3..6], &want.at("reflVect"));
    if form == Form::Corrected {
        check("rim", &got[6..7], &want.at("rim"));
    }
    let channel = |c: usize| got[7 + c] + got[10 + c] + got[13 + c] + got[16 + c];
    check("rgba", &[channel(0), channel(1), channel(2), got[19]], &want.at("rgba"));
}

fn rim(gpu: &Gpu, file: &Node<'_>) {
    let given = [("silhouette", "f32")];
    let wanted = [("rim", "f32")];
    let facts = facts(Form::Corrected, Silhouette::Fragment);
    let probe = Probe::new(&facts, Domain::Fragment, &given, &wanted).unwrap();
    let z = file.at("inputs").at("f").numbers();
    let mut got = vec![Vec::new(); z.len()];
    for exponent in file.at("inputs").at("exponent").numbers() {
        let mut params = Params::defaults(Form::Corrected);
        params.set(Param::RimExponent, exponent);
        let column = run(gpu, &probe, Arc::default(), &params, &z);
        got.iter_mut().zip(column).for_each(|(row, x)| row.push(x));
    }
    check("rim", &got.concat(), &file.at("expected").at("rim"));
}

fn cube_sample(gpu: &Gpu, vectors: &Vectors, file: &Node<'_>) {
    let given = [("reflected", "vec3f")];
    let wanted = [("mirror_light", "vec4f")];
    let facts = facts(Form::Corrected, Silhouette::Fragment);
    let probe = Probe::new(&facts, Domain::Fragment, &given, &wanted).unwrap();
    let directions = file.at("inputs").at("directions").numbers();
    let got = run(gpu, &probe, illumination(vectors, file), &Params::defaults(Form::Corrected), &directions);
    check("seamless lookups", &got, &file.at("expected").at("seamless"));
}

/// The race's sixteen pixels: stored samples through the fragment rules.
fn bench(gpu: &Gpu, vectors: &Vectors, file: &Node<'_>) {
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
        Probe::new(&facts(Form::Corrected, Silhouette::Bumped), Domain::Fragment, &given, &PARTS).unwrap();
    let params = column_params(&file.at("inputs").at("params"));
    let g = file.at("inputs").at("gbuffer");
    let mut items = Vec::new();
    for i in 0..16 {
        for name in ["A", "B", "A", "E"] {
            items.extend(g.at(name).item(i).three());
        }
        let one = |name: &str| g.at(name).item(i).number();
        items.extend([one("o"), 1.0]);
        items.extend(g.at("c").item(i).three());
        items.extend([one("p"), one("a")]);
    }
    let got = run(gpu, &probe, illumination(vectors, file), &params, &items);
    let rgba =
        got.chunks(PARTS.iter().map(|(_, kind)| if *kind == "f32" { 1 } else { 3 }).sum()).flat_map(|p| {
            let channel = |c: usize| p[7 + c] + p[10 + c] + p[13 + c] + p[16 + c];
            [channel(0), channel(1), channel(2), p[19]]
        });
    check("forward", &rgba.collect::<Vec<_>>(), &file.at("expected").at("forward"));
}

/// The vertex stage: five morph targets and four bones of eight.
fn vertex(gpu: &Gpu, file: &Node<'_>) {
    let inputs = file.at("inputs");
    let list = |name: &str| -> Vec<f32> { inputs.at(name).numbers().iter().map(|&x| x as f32).collect() };
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
                ..Morph::default()
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
    let probe = Probe::new(&facts, Domain::Vertex, &[], &wanted).unwrap();
    let scene = skinfit::scene::Scene { mesh, ..bare_scene(EFFECTS) };
    let params = Params::defaults(Form::Corrected);
    let content = Content {
        scene: Arc::new(scene),
        illumination: Arc::default(),
        occlusion: Some(Arc::new(occlusion)),
        sky: None,
        thickness: None,
        params: params.clone(),
    };
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
    let expected = file.at("expected");
    (0..3).for_each(|i| check("position", &got[i..=i], &expected.at("worldCoord").item(i)));
    for (i, row) in ["WorldTanMatrixX", "WorldTanMatrixY", "WorldTanMatrixZ"].into_iter().enumerate() {
        check(row, &[got[6 + i], got[9 + i], got[3 + i]], &expected.at(row));
    }
    check("view", &got[12..15], &expected.at("WorldEyeDir"));
    check("occlusion", &got[15..16], &expected.at("SkinSilhouetteVec").item(0));
}

#[test]
fn vectors_hold_in_the_shaders() {
    let Some(gpu) = bench::gpu() else { return };
    let vectors = Vectors::read(&common::vectors());
    for file in vectors.of_kind("fragment") {
        Form::ALL.into_iter().for_each(|form| fragment(gpu, &vectors, &file, form));
    }
    rim(gpu, &vectors.one("rim"));
    cube_sample(gpu, &vectors, &vectors.one("cube_sample"));
    bench(gpu, &vectors, &vectors.one("bench"));
    vectors.of_kind("vertex").iter().for_each(|file| vertex(gpu, file));
}

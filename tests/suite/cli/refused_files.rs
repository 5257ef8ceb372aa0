//! Images, meshes and parameter files that cannot be used.

use serde_json::json;

use super::refusals::{Case, FIT, check};
use super::sandbox::{Sandbox, mesh};

#[test]
fn images_that_cannot_be_used() {
    let case = |what, spoil, words| Case { what, arguments: FIT, spoil, words };
    let half = |sandbox: &Sandbox, name: &str| {
        let bytes = sandbox.read(name);
        sandbox.write(name, &bytes[..bytes.len() / 2]);
    };
    let holds = |value: f32, x: usize, y: usize| {
        move |i: usize, j: usize| if (i, j) == (x, y) { [0.5, value, 0.5] } else { [0.5; 3] }
    };
    let mask = |sandbox: &Sandbox, value: f32| {
        sandbox.write_exr("mask.exr", 32, 32, |_, _| [value; 3]);
        sandbox.edit("target = \"targets/front.exr\"", "target = \"targets/front.exr\"\nmask = \"mask.exr\"");
    };
    check(&[
        case(
            "not an EXR",
            &|d| d.write("env.exr", b"hello"),
            &["env.exr: is not an EXR file", "Use OpenEXR"],
        ),
        case("an empty EXR", &|d| d.write("env.exr", b""), &["env.exr: is not an EXR file"]),
        case(
            "half an EXR",
            &|d| half(d, "targets/front.exr"),
            &["targets/front.exr: cannot be read as an EXR file"],
        ),
        case("half a PNG", &|d| half(d, "color.png"), &["color.png: cannot be read as a PNG file"]),
        case(
            "another size",
            &|d| d.write_grey("targets/front.exr", 31, 32),
            &["targets/front.exr: is 31 x 32 pixels, but its view is 32 x 32"],
        ),
        case(
            "NaN in the target",
            &|d| d.write_exr("targets/front.exr", 32, 32, holds(f32::NAN, 3, 7)),
            &["targets/front.exr: pixel x = 3, y = 7, channel G: holds NaN"],
        ),
        case(
            "infinity in the environment",
            &|d| d.write_exr("env.exr", 32, 16, holds(f32::INFINITY, 31, 0)),
            &["env.exr: pixel x = 31, y = 0, channel G: holds inf"],
        ),
        case("an empty mask", &|d| mask(d, 0.0), &["mask.exr: is an empty mask"]),
        case(
            "a mask of another size",
            &|d| {
                mask(d, 1.0);
                d.write_grey("mask.exr", 8, 8);
            },
            &["mask.exr: is 8 x 8 pixels, but its view is 32 x 32"],
        ),
        case(
            "a mask beside the mesh",
            &|d| {
                mask(d, 0.0);
                d.write_exr("mask.exr", 32, 32, |x, _| [if x == 0 { 1.0 } else { 0.0 }; 3]);
            },
            &["scene.toml: view \"front\": the mask is empty", "belong together"],
        ),
    ]);
}

#[test]
fn meshes_that_cannot_be_used() {
    let write = |change: &dyn Fn(&mut serde_json::Value, &mut Vec<u8>)| {
        let bytes = mesh(change);
        move |sandbox: &Sandbox| sandbox.write("mesh.glb", &bytes)
    };
    let number =
        |at: usize, value: f32| write(&move |_, bin| bin[at..at + 4].copy_from_slice(&value.to_le_bytes()));
    let whole = mesh(|_, _| {});
    let noise: Vec<u8> = (0..4096_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let skinned = write(&|json, bin| {
        json["nodes"] = json!([{"mesh": 0, "skin": 0}, {}]);
        json["scenes"][0]["nodes"] = json!([0, 1]);
        json["skins"] = json!([{"joints": [1]}]);
        json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(3);
        json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(4);
        let joints = json["bufferViews"][3]["byteOffset"].as_u64().unwrap() as usize;
        bin[joints + 4 * 5] = 9;
    });
    let with_skin = |sandbox: &Sandbox| {
        skinned(sandbox);
        sandbox.edit("[\"diffuse\"", "[\"skin\", \"diffuse\"");
    };
    let case = |what, spoil, words| Case { what, arguments: FIT, spoil, words };
    check(&[
        case(
            "half a mesh",
            &|d| d.write("mesh.glb", &whole[..whole.len() / 2]),
            &["mesh.glb: cannot be read as glTF 2.0"],
        ),
        case(
            "random bytes",
            &|d| d.write("mesh.glb", &noise),
            &["mesh.glb: cannot be read as glTF 2.0", "export it anew"],
        ),
        case("no bytes", &|d| d.write("mesh.glb", b""), &["mesh.glb: cannot be read as glTF 2.0"]),
        case(
            "no texture coordinates",
            &write(&|json, _| {
                drop(
                    json["meshes"][0]["primitives"][0]["attributes"]
                        .as_object_mut()
                        .unwrap()
                        .remove("TEXCOORD_0"),
                );
            }),
            &["mesh.glb", "texture coordinates"],
        ),
        case("NaN", &number(12 * 7 + 4, f32::NAN), &["mesh.glb: mesh `ball`, primitive 0, vertex 7", "NaN"]),
        case("infinity", &number(0, f32::INFINITY), &["mesh.glb: mesh `ball`, primitive 0, vertex 0", "inf"]),
        case(
            "no mesh in the scene",
            &write(&|json, _| json["scenes"][0]["nodes"] = json!([])),
            &["mesh.glb", "the mesh is empty"],
        ),
        case(
            "no triangles",
            &write(&|json, _| json["accessors"][2]["count"] = json!(0)),
            &["mesh.glb", "the mesh is empty"],
        ),
        case(
            "triangles without an area",
            &write(&|json, bin| {
                let positions = json["bufferViews"][0]["byteLength"].as_u64().unwrap() as usize;
                bin[..positions].fill(0);
            }),
            &["mesh.glb", "no triangles (that have an area)"],
        ),
        case(
            "a bone that is not there",
            &with_skin,
            &["mesh.glb: mesh `ball`, primitive 0, vertex 5", "names bone 9, but the skin has 1"],
        ),
    ]);
}

#[test]
fn parameter_files_that_cannot_be_used() {
    const RENDER: &[&str] = &["render", "--engine", "cpu", "scene.toml", "--params", "p.toml", "-o", "a.exr"];
    const START: &[&str] = &["fit", "scene.toml", "--params", "p.toml", "-o", "run"];
    let rows: &[(&str, Option<&str>, &[&str])] = &[
        ("missing", None, &["p.toml: ", "cannot be read"]),
        ("damaged", Some("[params]\nhilite = 0."), &["p.toml, line 2: "]),
        (
            "of another form",
            Some("form = \"listing\"\n[params]\nhilite = 0.5\n"),
            &["p.toml, line 1: ", "`listing`", "`corrected`"],
        ),
        (
            "out of bounds",
            Some("[params]\n\nocclusion = 2.0\n"),
            &["p.toml, line 3: occlusion = 2", "0 to 1"],
        ),
        (
            "not finite",
            Some("[params]\nhilite = nan\n"),
            &["p.toml, line 2: hilite must be a finite decimal number"],
        ),
        (
            "unknown parameter",
            Some("[params]\nhilit = 0.5\n"),
            &["p.toml, line 2: unknown parameter `hilit`", "hilite"],
        ),
        ("no parameters", Some("hilite = 0.5\n"), &["p.toml, line 1: unknown key `hilite`", "[params]"]),
        ("wrong type", Some("[params]\nhilite = \"much\"\n"), &["p.toml, line 2: hilite must be"]),
    ];
    for &(what, text, words) in rows {
        for arguments in [RENDER, START] {
            let spoil = |sandbox: &Sandbox| {
                text.into_iter().for_each(|text| sandbox.write("p.toml", text.as_bytes()));
            };
            check(&[Case { what, arguments, spoil: &spoil, words }]);
        }
    }
}

/// The ball with its vertices on two bones, those from vertex `first` on on the second; the first is scaled to nothing.
fn with_a_bone_of_no_size(first: usize) -> Vec<u8> {
    mesh(|json, bin| {
        let attributes = &mut json["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = 3.into();
        attributes["WEIGHTS_0"] = 4.into();
        json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"scale": [0, 0, 0]}, {}]);
        json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
        json["skins"] = json!([{"joints": [1, 2]}]);
        let joints = json["bufferViews"][3]["byteOffset"].as_u64().unwrap() as usize;
        let count = json["accessors"][3]["count"].as_u64().unwrap() as usize;
        (first..count).for_each(|vertex| bin[joints + 4 * vertex] = 1);
    })
}

#[test]
fn a_mesh_that_its_bones_draw_together_is_refused_and_a_part_of_it_is_only_hidden() {
    let sandbox = Sandbox::new();
    sandbox.edit("[\"diffuse\", ", "[\"skin\", \"diffuse\", ");
    sandbox.write("mesh.glb", &with_a_bone_of_no_size(usize::MAX / 2));
    let words =
        ["scene.toml: no triangle of the mesh has an area once it is posed", "node scales, bones or morph"];
    sandbox.fit("run", &[]).refused(&words);
    sandbox.run(&["render", "scene.toml", "-o", "a.exr"]).refused(&words);
    sandbox.run(&["ablate", "scene.toml", "-o", "run"]).refused(&words);
    assert!(!sandbox.path("run").exists());
    sandbox.write("mesh.glb", &with_a_bone_of_no_size(200));
    sandbox.run(&["render", "scene.toml", "--engine", "cpu", "-o", "a.exr"]).done();
}

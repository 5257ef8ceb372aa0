//! Scattered light in another engine: the exported passes, compiled by their languages' compilers, and the GLSL ones run as an
//! engine would run them, beside the renderer's levels and its image.

use std::collections::HashMap;

use glam::{DMat4, DVec4, Vec2};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use skinfit::export::{self, Target};
use skinfit::gpu::RenderOptions;
use skinfit::gpu::upload::Content;
use skinfit::model::diffusion::{Combined, Lookup, Stretch, Taps};
use skinfit::model::effects::Effect;
use skinfit::prepare::Baked;
use skinfit::render::antialias::Antialias;
use skinfit::scene::Scene;
use skinfit::scene::charts::charts;
use skinfit::scene::maps::{Map, Maps};
use skinfit::shader::atlas::{Pass, PassKind, pass_function};
use skinfit::shader::{Budget, Facts, Plan, plan};

use crate::exports::{
    CG_IN_HLSL, compile_glsl, compile_hlsl, glsl_kind, godot_in_glsl, metal_in_hlsl, provenance,
};
use crate::graphics::bench::{Difference, EXACT, gpu, keep, on_gpu, quantile};
use crate::graphics::raw::{Drawn, Raw, Sampled};
use crate::lit::param;
use crate::own_atlas::mirrored;
use crate::sky::{effect, head_changed};
use crate::unreal::unreal_in_hlsl;

/// Texels along the light map's side, pixels along the image's: whole rows of 256 bytes.
const TEXELS: u32 = 96;
const PIXELS: u32 = 48;

/// The built-in head in scattered light of a lamp and the environment, without maps.
fn head(change: impl FnOnce(&mut Scene)) -> Baked {
    head_with(&[], change)
}

fn head_with(more: &[Effect], change: impl FnOnce(&mut Scene)) -> Baked {
    head_changed(&[&[Effect::Lights, effect("diffusion")][..], more].concat(), |scene| {
        scene.maps = Maps::default();
        // An engine hands over what has moved.
        scene.mesh.morphs.clear();
        scene.mesh.bones.clear();
        scene.mesh.joints.clear();
        scene.mesh.weights.clear();
        scene.diffusion.light_map_size = TEXELS;
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (PIXELS, PIXELS);
        let radii = [("diffusion_radius_1", 3.0), ("diffusion_radius_2", 6.0), ("diffusion_radius_3", 14.0)];
        for (name, value) in radii.into_iter().chain([("colour_mix", 0.4), ("light.side.azimuth", 40.0)]) {
            scene.params.set(param(name), value);
        }
        change(scene);
    })
}

/// A scene's change, by what it shows.
type Named = (&'static str, fn(&mut Scene));

/// Named choices that change the passes.
fn choices() -> [Named; 6] {
    [
        ("five taps", |_| ()),
        ("taps a texel apart", |scene| scene.choices.diffusion.taps = Taps::Full),
        ("stretch by neighbours", |scene| scene.choices.diffusion.stretch = Stretch::Derivative),
        ("filled for one fetch", |scene| scene.choices.diffusion.lookup = Lookup::Dilated),
        ("added up in texels", |scene| scene.choices.diffusion.combined = Combined::Map),
        ("coordinates of its own", mirrored),
    ]
}

/// What `skinfit export` calls for.
fn engine_facts(baked: &Baked) -> Facts {
    let facts = baked.scene.facts(&baked.scene.params, export::BUDGET, false);
    Facts { tessellation: 1.0, shadows: None, ..facts }
}

fn exported(target: Target, baked: &Baked) -> String {
    export::function(target, &engine_facts(baked), &baked.scene.params, &provenance()).unwrap()
}

/// GLSL that calls a pass' function, or the last one, with what a vertex stage hands over.
fn glsl_main(plan: &Plan, pass: Option<(&Pass, usize)>) -> String {
    let (fields, surface, call) = match pass {
        Some((pass, leaf)) if pass.kind == PassKind::Draw => {
            let function = pass_function(&pass.leaves[leaf]);
            (plan.texel_surface(), "SkinfitTexel", format!("skinfit_{function}(at, ivec2(gl_FragCoord.xy))"))
        }
        Some((pass, leaf)) => {
            let function = pass_function(&pass.leaves[leaf]);
            (Vec::new(), "", format!("skinfit_{function}(ivec2(gl_FragCoord.xy))"))
        }
        None => (plan.surface(), "SkinfitSurface", "skinfit_shade(at)".to_owned()),
    };
    let declared: String = (fields.iter().enumerate())
        .map(|(i, (name, kind))| format!("layout(location = {i}) in {} in_{name};\n", glsl_kind(kind)))
        .collect();
    let at = if fields.is_empty() { String::new() } else { format!("    {surface} at;\n") };
    let set: String = fields.iter().map(|(name, _)| format!("    at.{name} = in_{name};\n")).collect();
    format!(
        "{declared}layout(location = 0) out vec4 color;\nvoid main() {{\n{at}{set}    color = {call};\n}}\n"
    )
}

/// What Godot's language has before a shader, in GLSL ES.
const GODOT: &str = "#version 310 es\nprecision highp float;\nprecision highp int;";

/// HLSL that calls a pass' function, or the last one.
fn hlsl_main(part: Option<(&Pass, usize)>) -> String {
    let call = match part {
        Some((pass, leaf)) if pass.kind == PassKind::Draw => {
            let function = pass_function(&pass.leaves[leaf]);
            format!("SkinfitTexel at = (SkinfitTexel)0; return skinfit_{function}(at, int2(place.xy))")
        }
        Some((pass, leaf)) => {
            format!("return skinfit_{}(int2(place.xy))", pass_function(&pass.leaves[leaf]))
        }
        None => "SkinfitSurface at = (SkinfitSurface)0; return skinfit_shade(at)".to_owned(),
    };
    format!("float4 main(float4 place : SV_Position) : SV_Target {{\n    {call};\n}}\n")
}

/// Each of the passes' functions in turn, then the image's.
fn parts(plan: &Plan) -> Vec<Option<(&Pass, usize)>> {
    let passes =
        plan.passes.iter().flat_map(|pass| (0..pass.leaves.len()).map(move |leaf| Some((pass, leaf))));
    passes.chain([None]).collect()
}

#[test]
fn exported_passes_are_taken_by_the_compilers_of_their_languages() {
    let everything = ["directional_occlusion", "fresnel", "light_specular", "transmission", "diffusion_five"];
    let everything = everything.map(effect);
    let all = [
        Effect::NormalMap,
        Effect::Shadows,
        Effect::SideSpecular,
        Effect::Hilite,
        Effect::Reflection,
        Effect::Haze,
    ];
    let whole = head_with(&[&everything[..], &all].concat(), |scene| {
        // What has no weight is left out.
        for name in ["transmission_weight", "haze_weight"] {
            scene.params.set(param(name), 0.5);
        }
    });
    let two_sets = head(|scene| {
        mirrored(scene);
        scene.maps.color = Some(Map { width: 1, height: 1, texels: vec![[0.5; 3]] });
    });
    let heads = choices().map(|(name, change)| (name, head(change)));
    for (name, baked) in heads.into_iter().chain([("everything", whole), ("maps by another set", two_sets)]) {
        let plan = plan(&engine_facts(&baked)).unwrap();
        assert!(plan.passes.len() >= 7, "{name}");
        let glsl = exported(Target::Glsl, &baked);
        let hlsl = exported(Target::Hlsl, &baked);
        // Siblings of HLSL, by the few words in which they differ.
        let cg = format!("{CG_IN_HLSL}\n{}", exported(Target::Cg, &baked));
        let metal = metal_in_hlsl(&exported(Target::Msl, &baked));
        let unreal = unreal_in_hlsl(&exported(Target::Unreal, &baked));
        let godot = godot_in_glsl(&exported(Target::Godot, &baked));
        for part in parts(&plan) {
            let main = glsl_main(&plan, part);
            let text = format!("#version 450\n{glsl}\n{main}");
            compile_glsl(&text).unwrap_or_else(|error| panic!("{name}: {error}\n{text}"));
            let text = format!("{GODOT}\n{godot}\n{main}");
            compile_glsl(&text).unwrap_or_else(|error| panic!("{name}, Godot: {error}\n{text}"));
            // The compiler reads the whole text, whichever part is called: the siblings are as HLSL is in the others.
            let siblings = if part.is_none() { vec![&hlsl, &cg, &metal, &unreal] } else { vec![&hlsl] };
            for hlsl in siblings {
                let text = format!("{hlsl}\n{}", hlsl_main(part));
                compile_hlsl(&text).unwrap_or_else(|error| panic!("{name}: {error}\n{text}"));
            }
        }
        let wgsl = exported(Target::Wgsl, &baked);
        let module = naga::front::wgsl::parse_str(&wgsl)
            .unwrap_or_else(|error| panic!("{name}: {}\n{wgsl}", error.emit_to_string(&wgsl)));
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {}\n{wgsl}", error.emit_to_string(&wgsl)));
        assert!(!glsl.contains("as the rule of that name gives it"), "{name}: {glsl}");
        let own = !baked.scene.mesh.own_atlas_uvs.is_empty();
        let uv = if own { "vertex_atlas_uv" } else { "texture coordinates" };
        assert_eq!(glsl.contains("- vertex_atlas_uv: texture coordinates by which"), own, "{name}: {glsl}");
        // The head says what to do, in order, and what of.
        for words in [
            &*format!("each vertex at its {uv}: in clip space"),
            "Before the image come passes over the UV atlas, into textures of 96 x 96 texels",
            "1. draw the mesh: skinfit_diffusion_",
            "skinfit_diffusion_level_0_pass into skinfit_diffusion_level_0_level",
            "fill the image: skinfit_diffusion_level_1_pass into skinfit_diffusion_level_1_level",
            "- vertex_chart: number of the vertex' connected piece of the UV atlas",
        ] {
            assert!(glsl.contains(words), "{name}: {words}\n{glsl}");
        }
    }
}

/// What an engine has of each vertex, by the names of the functions' fields.
fn vertex_fields(baked: &Baked) -> HashMap<&'static str, Vec<Vec<f32>>> {
    let Scene { mesh, views, .. } = &*baked.scene;
    let eye = views[0].camera.eye().as_vec3();
    let numbers = |count: usize, of: &dyn Fn(usize) -> Vec<f32>| (0..count).map(of).collect::<Vec<_>>();
    let count = mesh.positions.len();
    let of_charts = charts(&mesh.positions, mesh.atlas_uvs(), &mesh.triangles);
    let open = baked.occlusion.as_ref().map(|occlusion| occlusion.base.clone());
    let silhouette = |i: usize| 1.0 - mesh.normals[i].dot((mesh.positions[i] - eye).normalize()).abs();
    HashMap::from([
        ("vertex_position", numbers(count, &|i| mesh.positions[i].to_array().to_vec())),
        ("vertex_normal", numbers(count, &|i| mesh.normals[i].to_array().to_vec())),
        ("vertex_uv", numbers(count, &|i| mesh.uvs[i].to_array().to_vec())),
        ("vertex_atlas_uv", numbers(count, &|i| mesh.atlas_uvs()[i].to_array().to_vec())),
        ("vertex_chart", numbers(count, &|i| vec![of_charts[i] as f32])),
        ("vertex_occlusion", numbers(count, &|i| vec![open.as_ref().map_or(1.0, |open| open[i])])),
        ("vertex_view", numbers(count, &|i| (mesh.positions[i] - eye).normalize().to_array().to_vec())),
        ("vertex_silhouette", numbers(count, &|i| vec![silhouette(i)])),
        ("eye", numbers(count, &|_| eye.to_array().to_vec())),
    ])
}

/// Where vertices are in texture space, and in the first view.
fn clips(scene: &Scene) -> [Vec<[f32; 4]>; 2] {
    let camera = &scene.views[0].camera;
    let aspect = f64::from(camera.width) / f64::from(camera.height);
    let (focal, near, far) = (1.0 / (0.5 * camera.fov_y).tan(), 0.01, 100.0);
    let columns = [
        DVec4::new(focal / aspect, 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal, 0.0, 0.0),
        DVec4::new(0.0, 0.0, far / (near - far), -1.0),
        DVec4::new(0.0, 0.0, near * far / (near - far), 0.0),
    ];
    let seen = DMat4::from_cols(columns[0], columns[1], columns[2], columns[3]) * camera.world_to_camera;
    let in_atlas = |uv: &Vec2| [2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.5, 1.0];
    let unwrapped = scene.mesh.atlas_uvs().iter().map(in_atlas).collect();
    let place = |p: &glam::Vec3| (seen * DVec4::from((p.as_dvec3(), 1.0))).as_vec4().to_array();
    [unwrapped, scene.mesh.positions.iter().map(place).collect()]
}

/// The exported GLSL as an engine of separate textures and samplers takes it in: its declarations are that engine's.
fn bound_apart(glsl: &str) -> (String, Vec<(u32, String)>) {
    let mut bindings = Vec::new();
    let line = |line: &str| {
        let Some(rest) = line.strip_prefix("layout(binding = ") else { return format!("{line}\n") };
        let (binding, rest) = rest.split_once(") uniform ").unwrap();
        let (kind, name) = rest.trim_end_matches(';').split_once(' ').unwrap();
        let binding: u32 = binding.parse().unwrap();
        bindings.push((binding, name.to_owned()));
        match kind {
            "samplerCube" => format!(
                "layout(set = 0, binding = {binding}) uniform textureCube {name}_faces;\nlayout(set = 0, binding = {}) uniform \
                 sampler {name}_sampler;\n#define {name} samplerCube({name}_faces, {name}_sampler)\n",
                binding + 100
            ),
            _ => format!("layout(set = 0, binding = {binding}) uniform texture2D {name};\n"),
        }
    };
    let text: String = glsl.lines().map(line).collect();
    (format!("#version 450\n#extension GL_EXT_samplerless_texture_functions : require\n{text}"), bindings)
}

#[test]
fn the_glsl_passes_make_the_renderers_levels_and_its_image() {
    let Some(gpu) = gpu() else { return };
    for (name, change) in choices() {
        let baked = head(change);
        let facts = engine_facts(&baked);
        let planned = plan(&facts).unwrap();
        let (glsl, bindings) = bound_apart(&exported(Target::Glsl, &baked));
        let fields = vertex_fields(&baked);
        let [unwrapped, seen] = clips(&baked.scene);
        let raw = Raw::new(gpu, &baked.scene.mesh.triangles);
        let mut levels = HashMap::new();
        let cube = raw.cube(baked.illumination.irradiance.as_ref().unwrap());
        let draw = |levels: &HashMap<String, wgpu::Texture>, part: Option<(&Pass, usize)>| {
            let text = format!("{glsl}\n{}", glsl_main(&planned, part));
            let given: &[(&str, &str)] = match part {
                Some((pass, _)) if pass.kind == PassKind::Draw => &planned.texel_surface(),
                Some(_) => &[],
                None => &planned.surface(),
            };
            let whole = part.is_some_and(|(pass, _)| pass.kind != PassKind::Draw);
            let vertices: Vec<&[Vec<f32>]> = given.iter().map(|(name, _)| &fields[name][..]).collect();
            let bound: Vec<(u32, Sampled<'_>)> = (bindings.iter())
                .filter_map(|(binding, name)| match name.strip_prefix("skinfit_") {
                    Some("irradiance_cube") => Some((*binding, Sampled::Cube(&cube))),
                    Some(level) => Some((*binding, Sampled::Texels(levels.get(level)?))),
                    None => None,
                })
                .collect();
            let clip = if part.is_some() { &unwrapped } else { &seen };
            let size = if part.is_some() { TEXELS } else { PIXELS };
            raw.draw(&Drawn {
                fragment: &text,
                vertices: &vertices,
                clip: (!whole).then_some(clip),
                bound: &bound,
                size,
            })
        };
        for pass in &planned.passes {
            for leaf in 0..pass.leaves.len() {
                let level = draw(&levels, Some((pass, leaf)));
                levels.insert(pass.leaves[leaf].bound(), level);
            }
        }
        let wanted = skinfit::gpu::atlas::levels(gpu, &planned, Content::of(&baked)).unwrap();
        for level in planned.passes.iter().flat_map(|pass| &pass.leaves) {
            let got = raw.read(&levels[&level.bound()], TEXELS);
            near(&format!("{name}: {}", level.name), &got, &wanted[&level.name]);
        }
        let image = raw.read(&draw(&levels, None), PIXELS);
        let options = RenderOptions { antialias: Antialias::Grid(1), budget: Budget::Within(0.05), ..EXACT };
        let drawn = on_gpu(gpu, &baked, options);
        let mut got = drawn.clone();
        for (i, rgb) in got.rgb.iter_mut().enumerate() {
            let covered = image[4 * i + 3] > 0.0;
            *rgb = if covered { [0, 1, 2].map(|c| image[4 * i + c]) } else { [0.0; 3] };
            got.alpha[i] = f32::from(u8::from(covered));
        }
        let Difference { interior, uncovered, .. } = Difference::new(&drawn, &got, 1);
        assert!(interior.len() > 300 && uncovered < 8, "{name}: {} {uncovered}", interior.len());
        let shares = [0.5, 0.9, 0.99].map(|share| quantile(&interior, share));
        println!("{name}: {shares:?}, greatest {:?}", interior.last());
        // The plan of the renderer's own is of its mesh, and filters the same; rims are exact in both.
        let fits = shares.iter().zip([1e-3, 3e-3, 1e-2]).all(|(found, most)| *found < most);
        assert!(fits, "{name}: {shares:?}; {}", keep("exported passes", &drawn, &got));
    }
}

/// Levels texel by texel: which are covered, and what they hold.
fn near(what: &str, got: &[f32], want: &[f32]) {
    let largest =
        want.iter().enumerate().filter(|(i, _)| i % 4 < 3).fold(0.0_f32, |most, (_, x)| most.max(x.abs()));
    let (mut apart, mut covered, mut off) = (0, 0, Vec::new());
    for (got, want) in got.chunks(4).zip(want.chunks(4)) {
        covered += usize::from(want[3] > 0.0);
        if got[3] == want[3] {
            off.extend((0..3).map(|c| (got[c] - want[c]).abs() / largest));
        } else {
            apart += 1;
        }
    }
    off.sort_by(f32::total_cmp);
    let [most, greatest] = [0.98, 1.0].map(|share| quantile(&off, share));
    println!("{what}: {covered} texels, {apart} apart, {most:e}, {greatest:e}");
    // A rasteriser may give the centres of outlines to the other side. Steps between fragments are differences of numbers that
    // it rounds, or of two triangles: a few texels are stretched otherwise, and blur otherwise.
    assert!(apart * 100 < covered && most < 1e-4, "{what}: {apart} of {covered}, {most:e}");
}

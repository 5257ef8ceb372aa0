//! Exported GLSL, and Unreal's node, in place of the renderer's own fragment stage: the same pixels.

use std::process::Command;

use skinfit::export::{self, Target};
use skinfit::gpu::{Gpu, RenderOptions, Renderer};
use skinfit::model::params::Params;
use skinfit::model::texture_filter::TextureFilter;
use skinfit::prepare::Baked;
use skinfit::render::antialias::Antialias;
use skinfit::render::shading::Shading;
use skinfit::shader::facts::MapFacts;
use skinfit::shader::quantity::Kind;
use skinfit::shader::{Budget, Facts, Plan, plan};

use super::bench::*;
use crate::exports::{glsl_kind, provenance};
use crate::unreal::Custom;

/// A fragment shader of exported GLSL for the renderer's bindings, which keep textures and samplers apart.
fn shader(plan: &Plan, params: &Params) -> String {
    let mut text =
        String::from("#version 450\nlayout(set = 0, binding = 0) uniform Frame { vec4 eye; } frame;\n");
    for (i, resource) in plan.resources.iter().enumerate() {
        let (name, binding) = (format!("skinfit_{}", resource.name()), i + 1);
        let declared =
            |kind: &str, name: &str| format!("layout(set = 0, binding = {binding}) uniform {kind} {name};\n");
        text += &match resource.kind() {
            Kind::Cube => {
                declared("textureCube", &format!("image_of_{name}"))
                    + &format!(
                        "#define {name} samplerCube(image_of_{name}, filter_of_skinfit_cube_sampler)\n"
                    )
            }
            Kind::Map => {
                declared("texture2D", &format!("image_of_{name}"))
                    + &format!("#define {name} sampler2D(image_of_{name}, filter_of_skinfit_map_sampler)\n")
            }
            Kind::Sampler => declared("sampler", &format!("filter_of_{name}")),
            // The vertex stage's.
            Kind::Storage => String::new(),
            other => panic!("{name} is {other:?}: no export reads that"),
        };
    }
    let exported = export::function(Target::Glsl, &plan.facts, params, &provenance()).unwrap();
    text.extend(exported.lines().filter(|line| !line.starts_with("layout(")).map(|line| format!("{line}\n")));
    let mut set = String::new();
    for (i, (name, wgsl)) in plan.varyings.iter().enumerate() {
        text += &format!("layout(location = {i}) in {} in_{name};\n", glsl_kind(wgsl));
        set += &format!("    at.{name} = in_{name};\n");
    }
    if plan.surface().iter().any(|(name, _)| *name == "eye") {
        set += "    at.eye = frame.eye.xyz;\n";
    }
    text + &format!(
        "layout(location = 0) out vec4 color;\nvoid main() {{\n    SkinfitSurface at;\n{set}    color = skinfit_shade(at);\n}}\n"
    )
}

/// A fragment shader of Unreal's node for the renderer's bindings. It is handed what Unreal's importer and nodes would make of
/// what the renderer's vertex stage hands over.
fn unreal_shader(plan: &Plan, params: &Params) -> String {
    let custom = Custom::of(&export::material(Target::Unreal, &plan.facts, params, "Skin").unwrap());
    let mut text = custom.function();
    text += "[[vk::binding(0, 0)]] cbuffer Frame { float4 eye; };\n";
    for (i, resource) in plan.resources.iter().enumerate() {
        let name = format!("skinfit_{}", resource.name());
        let (kind, sampler) = match resource.kind() {
            Kind::Cube => ("TextureCube", "skinfit_cube_sampler"),
            Kind::Map => ("Texture2D", "skinfit_map_sampler"),
            Kind::Sampler => ("SamplerState", ""),
            // The vertex stage's.
            Kind::Storage => continue,
            other => panic!("{name} is {other:?}: no export reads that"),
        };
        text += &format!("[[vk::binding({}, 0)]] {kind} bound_{name};\n", i + 1);
        if !sampler.is_empty() {
            text += &format!("#define bound_{name}Sampler bound_{sampler}\n");
        }
    }
    let kind = |wgsl: &str| match wgsl {
        "f32" => "float",
        "vec2f" => "float2",
        _ => "float3",
    };
    let fields = plan.varyings.iter().enumerate();
    let fields: Vec<String> = fields
        .map(|(i, (name, wgsl))| format!("[[vk::location({i})]] {} in_{name} : TEXCOORD{i}", kind(wgsl)))
        .collect();
    let given = |name: &str| match name {
        "vertex_position" => "100.0 * (in_vertex_position - eye.xyz).xzy".to_owned(),
        "vertex_bitangent" => "-in_vertex_bitangent.xzy".to_owned(),
        "vertex_normal" | "vertex_tangent" => format!("in_{name}.xzy"),
        "vertex_occlusion" => "float2(in_vertex_occlusion, 0.0)".to_owned(),
        name => format!("in_{name}"),
    };
    format!("{text}float4 main({}) : SV_Target0 {{\n{}}}\n", fields.join(", "), custom.call(given))
}

/// GLSL by way of glslang and SPIR-V as WGSL.
pub(crate) fn as_wgsl(glsl: &str) -> String {
    compiled(&["-V", "-S", "frag"], glsl)
}

/// What glslang takes with those arguments, by way of SPIR-V as WGSL.
fn compiled(arguments: &[&str], text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let (file, spirv) = (folder.path().join("shader.frag"), folder.path().join("shader.spv"));
    std::fs::write(&file, text).unwrap();
    let output = Command::new("glslangValidator").args(arguments).arg("-o").args([&spirv, &file]).output();
    let output = output.expect("glslangValidator (Debian: glslang-tools) cannot be run");
    assert!(output.status.success(), "{}\n{text}", String::from_utf8_lossy(&output.stdout));
    let options = naga::front::spv::Options::default();
    let module = naga::front::spv::parse_u8_slice(&std::fs::read(&spirv).unwrap(), &options).unwrap();
    let info =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap();
    naga::back::wgsl::write_string(&module, &info, naga::back::wgsl::WriterFlags::empty()).unwrap()
}

#[test]
fn exported_glsl_draws_the_pixels_of_the_renderers_own_shader() {
    let single = |facts: Facts| Facts { f16: false, ..facts };
    compare_filters(&single, &|plan, params| as_wgsl(&shader(plan, params)));
}

/// What the renderer's interpolation saves an engine's own mesh may be too coarse for, so that no export does it.
#[test]
fn unreals_node_draws_the_pixels_of_the_renderers_own_shader() {
    // A material names a picture for each map.
    let apart = |maps: MapFacts| MapFacts { color_specular: false, normal_attenuator: false, ..maps };
    let single = |facts: Facts| Facts { f16: false, tessellation: 1.0, maps: apart(facts.maps), ..facts };
    let hlsl = ["-D", "-V", "-S", "frag", "-e", "main"];
    compare_filters(&single, &|plan, params| compiled(&hlsl, &unreal_shader(plan, params)));
}

/// With each filter of maps: `single` are the facts that both plan with, as exports have no 16-bit arithmetic; `fragment` makes
/// the stage as WGSL.
fn compare_filters(single: &dyn Fn(Facts) -> Facts, fragment: &dyn Fn(&Plan, &Params) -> String) {
    let Some(gpu) = gpu() else { return };
    for filter in TextureFilter::ALL {
        let baked =
            baked(&built_in(), SURFACE, 128).with_scene(|scene| scene.quality.texture_filter = filter);
        compare(gpu, &baked, single, fragment);
    }
}

fn compare(
    gpu: &Gpu,
    baked: &Baked,
    single: &dyn Fn(Facts) -> Facts,
    fragment: &dyn Fn(&Plan, &Params) -> String,
) {
    let params = baked.scene.params.clone();
    let camera = baked.scene.views[0].camera;
    let options = RenderOptions {
        antialias: Antialias::Grid(1),
        shading: Shading::Forward,
        budget: Budget::Paper,
        ..EXACT
    };
    let draw = |change: &dyn Fn(&Plan) -> Plan| {
        let mut renderer = Renderer::with_shader(gpu, Content::of(baked), options, change).unwrap();
        renderer.render(&camera, 1.0).unwrap().image
    };
    let single = |planned: &Plan| plan(&single(planned.facts)).unwrap();
    let ours = draw(&single);
    let exported = draw(&|planned: &Plan| {
        let plan = single(planned);
        let vertex = plan.wgsl.split("\n@fragment\n").next().unwrap();
        let fragment = fragment(&plan, &params).replace("fn main(", "fn fs_main(");
        Plan { wgsl: format!("{vertex}\n{fragment}"), ..plan }
    });
    assert_eq!(ours.alpha, exported.alpha);
    assert!(ours.alpha.iter().filter(|a| **a > 0.0).count() > 1000, "the head is in the picture");
    let scale = ours.rgb.iter().flatten().fold(0.0_f32, |m, x| m.max(*x));
    for (i, (a, b)) in ours.rgb.iter().zip(&exported.rgb).enumerate() {
        for c in 0..3 {
            // Targets of 16 bits round to 2^-11 of each value; compilers may contract differently.
            let bound = 1e-3 * a[c].abs() + 1e-5 * scale;
            assert!((a[c] - b[c]).abs() <= bound, "pixel {i}: {a:?} {b:?}");
        }
    }
}

//! Exported GLSL in place of the renderer's own fragment stage: the same pixels.

use std::process::Command;

use skinfit::export::{self, Target};
use skinfit::gpu::{Gpu, RenderOptions, Renderer};
use skinfit::model::params::Params;
use skinfit::model::texture_filter::TextureFilter;
use skinfit::prepare::Baked;
use skinfit::render::antialias::Antialias;
use skinfit::render::shading::Shading;
use skinfit::shader::quantity::Kind;
use skinfit::shader::{Budget, Facts, Plan, plan};

use super::bench::*;
use crate::exports::{glsl_kind, provenance};

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

/// GLSL by way of glslang and SPIR-V as WGSL.
pub(crate) fn as_wgsl(glsl: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let (file, spirv) = (folder.path().join("shader.frag"), folder.path().join("shader.spv"));
    std::fs::write(&file, glsl).unwrap();
    let output =
        Command::new("glslangValidator").args(["-V", "-S", "frag", "-o"]).args([&spirv, &file]).output();
    let output = output.expect("glslangValidator (Debian: glslang-tools) cannot be run");
    assert!(output.status.success(), "{}\n{glsl}", String::from_utf8_lossy(&output.stdout));
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
    let Some(gpu) = gpu() else { return };
    for filter in TextureFilter::ALL {
        compare(
            gpu,
            &baked(&built_in(), SURFACE, 128).with_scene(|scene| scene.quality.texture_filter = filter),
        );
    }
}

fn compare(gpu: &Gpu, baked: &Baked) {
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
    // Exports have no 16-bit arithmetic.
    let single = |planned: &Plan| plan(&Facts { f16: false, ..planned.facts }).unwrap();
    let ours = draw(&single);
    let exported = draw(&|planned: &Plan| {
        let plan = single(planned);
        let vertex = plan.wgsl.split("\n@fragment\n").next().unwrap();
        let fragment = as_wgsl(&shader(&plan, &params)).replace("fn main(", "fn fs_main(");
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

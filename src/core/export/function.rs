//! The shader of a scene as one function, with what it reads.

use std::fmt::Write as _;

use super::dialect::{Dialect, Family};
use super::handed::{Handed, handed_over, parted};
use super::idle::idle;
use super::translate::translate;
use super::{ExportError, Provenance, Target, names, passes};
use crate::model::effects::{Effect, Effects};
use crate::model::evaluate::Setup;
use crate::model::fields::Field;
use crate::model::params::{Param, Params};
use crate::shader::Resource;
use crate::shader::atlas::Level;
use crate::shader::quantity::Kind;
use crate::shader::{Plan, cited, facts::Facts, plan};

/// The function `skinfit_shade`, its constants and declarations.
pub(super) fn text(
    target: Target,
    facts: &Facts,
    params: &Params,
    from: &Provenance,
) -> Result<String, ExportError> {
    let Some(dialect) = target.dialect() else {
        let languages: Vec<&str> =
            Target::ALL.into_iter().filter(|t| t.dialect().is_some()).map(Target::name).collect();
        return Err(ExportError::NoFunction { target: target.name(), languages: languages.join(", ") });
    };
    let (plan, resources, idle) = planned(facts, params)?;
    let mut text = header((&plan, &resources), idle, params, from);
    let code = code(dialect, &plan, &resources, params);
    let _ = write!(text, "\n{}{code}{}", dialect.prologue, dialect.epilogue);
    Ok(text)
}

/// Constants, declarations and functions.
pub(super) fn code(dialect: &Dialect, plan: &Plan, resources: &[Resource], params: &Params) -> String {
    let mut text = String::new();
    let literals = plan.literals(params);
    let [before, behind] = if literals.is_empty() { [""; 2] } else { dialect.around_constants };
    text.push_str(before);
    for (name, kind, value) in &literals {
        let _ = writeln!(text, "{}", dialect.definition(&names::constant(name), kind, value));
    }
    text.push_str(behind);
    let filter = plan.facts.maps.filter;
    let levels: Vec<String> = plan.all_levels().iter().map(Level::bound).collect();
    let declared = dialect.filtering(&declarations(dialect, resources, &levels), filter);
    let constants: Vec<String> = literals.into_iter().map(|(name, ..)| name).collect();
    let read: Vec<&str> =
        resources.iter().map(|resource| resource.name()).chain(levels.iter().map(String::as_str)).collect();
    let fields: Vec<&str> =
        plan.surface().iter().chain(&plan.texel_surface()).map(|(name, _)| *name).collect();
    let wgsl = names::prefixed(&plan.function(), &constants, &read, &fields);
    let functions = dialect.filtering(&translate(dialect, &cited(&wgsl)), filter);
    if dialect.family == Family::Msl {
        let body = indented(&format!("{declared}\n{functions}"));
        let _ = write!(
            text,
            "\n// Textures and samplers, and the functions that read them.\nstruct Skinfit {{\n{body}}};\n"
        );
    } else if dialect.hands_over() {
        let cubes = |resource: &Resource| resource.kind() == Kind::Cube;
        let sampled = resources.iter().filter(|resource| matches!(resource.kind(), Kind::Cube | Kind::Map));
        let sampled = sampled.map(|resource| dialect.handed(resource.name(), cubes(resource), true));
        let levels = levels.iter().map(|level| dialect.handed(level, false, false));
        let handed: Vec<Handed> = sampled.chain(levels).collect();
        let (structs, functions) = parted(&handed_over(&functions, &handed));
        let body = indented(&functions);
        let _ = write!(
            text,
            "\n{structs}\n// The functions, each with the textures and samplers that it reads behind its other arguments: `Skinfit skin;`,\n\
             // then `skin.skinfit_shade(at, ...)`.\nstruct Skinfit {{\n{body}}};\n"
        );
    } else {
        let _ = write!(text, "\n{declared}\n{functions}");
    }
    text
}

/// The plan of an export, what its passes and its image read together, and the effects that it leaves out.
pub(super) fn planned(facts: &Facts, params: &Params) -> Result<(Plan, Vec<Resource>, Effects), ExportError> {
    let idle = idle(facts.setup.effects, params);
    let effects = facts.setup.effects.iter().filter(|&effect| !idle.has(effect)).collect();
    // Not every language has 16-bit numbers, nor every engine's adapter; and an engine has shadow maps of its own, of which
    // the functions take what they leave of each light.
    let setup = Setup { effects, ..facts.setup };
    let atlas = facts.atlas.filter(|_| setup.needs().atlas);
    let plan = plan(&Facts { setup, f16: false, atlas, shadows: None, ..*facts })?;
    let resources = plan.merged().resources;
    let filtered = |resource: &&Resource| matches!(resource.kind(), Kind::Texels | Kind::Faces);
    if let Some(resource) = resources.iter().find(filtered) {
        return Err(ExportError::Filtered { resource: resource.name() });
    }
    Ok((plan, resources, idle))
}

/// What it is, what it is called with, and what it reads.
fn header(
    (plan, resources): (&Plan, &[Resource]),
    idle: Effects,
    params: &Params,
    from: &Provenance,
) -> String {
    let mut lines = from.lines();
    if idle != Effects::default() {
        let names: Vec<&str> = idle.iter().map(Effect::name).collect();
        lines.push(format!(
            "Left out, as their weight is 0: {}. With another weight they have to be exported again.",
            names.join(", ")
        ));
    }
    lines.extend([
        String::new(),
        "Comments cite the listings of GPU Gems, chapter 3, and sections of docs/model.md, a page of skinfit."
            .to_owned(),
        String::new(),
    ]);
    lines.extend(passes::wiring(plan));
    let what = "with what the vertex stage hands over, in world space:";
    lines.push(format!("{} skinfit_shade {what}", if plan.passes.is_empty() { "Call" } else { "Then call" }));
    lines.extend(plan.surface().iter().map(|(name, _)| match *name {
        // Of the vertex stage, and so no constant of the function.
        "vertex_rim" => {
            let exponent = params.scalar(Param::RimExponent);
            format!("- {name}: (1 - |N.V|) ^ {exponent:?} of the vertex, as interpolated")
        }
        name => format!("- {name}: {}", meaning(plan, name)),
    }));
    let bound = |resource: &Resource| {
        Some(format!("- {}: {}", names::function(resource.name()), what_to_bind(*resource, params)?))
    };
    let bound: Vec<String> = resources.iter().filter_map(bound).collect();
    if !bound.is_empty() {
        lines.extend([
            String::new(),
            "It reads what `skinfit bake --params` writes of the scene, seamless and without mip levels:"
                .to_owned(),
        ]);
        lines.extend(bound);
    }
    let filter = plan.facts.maps.filter;
    if filter.reads_levels() && resources.iter().any(|resource| resource.kind() == Kind::Map) {
        lines.extend([
            String::new(),
            format!("Maps are to have mip levels and a sampler that is {}, as where the constants were found. Which level a", filter.name()),
            "fragment reads follows from its neighbours: call skinfit_shade, and what draws the mesh in texture space, in a".to_owned(),
            "fragment stage, outside of any branch.".to_owned(),
        ]);
    }
    let comment = |line: String| if line.is_empty() { "//\n".to_owned() } else { format!("// {line}\n") };
    lines.into_iter().map(comment).collect()
}

fn declarations(dialect: &Dialect, resources: &[Resource], levels: &[String]) -> String {
    // Storage is the vertex stage's: an engine brings its own.
    let read: Vec<Resource> =
        resources.iter().copied().filter(|resource| resource.kind() != Kind::Storage).collect();
    let own = read.iter().zip(1..).map(|(&resource, binding)| dialect.declaration(resource, binding));
    let levels = levels.iter().zip(1 + read.len()..).map(|(level, binding)| dialect.level(level, binding));
    own.chain(levels).filter(|line| !line.is_empty()).map(|line| line + "\n").collect()
}

fn indented(text: &str) -> String {
    let line = |line: &str| if line.is_empty() { "\n".to_owned() } else { format!("    {line}\n") };
    text.lines().map(line).collect()
}

/// Whether a map holds colours, which are stored in sRGB.
pub(super) fn is_color(resource: Resource) -> bool {
    match resource {
        Resource::ColorMap => true,
        Resource::OwnMap(field) => field.info().numbers == 3,
        _ => false,
    }
}

/// What belongs in a cube or map.
pub(super) fn what_to_bind(resource: Resource, params: &Params) -> Option<String> {
    let words = match resource {
        Resource::IrradianceCube => "irradiance / pi of the environment (irradiance.exr)".to_owned(),
        Resource::SpecularCube => format!(
            "Phong lobe of exponent {:?}, luminance in alpha (specular.exr, or lobe_<exponent>.exr)",
            params.scalar(Param::SpecularLobe)
        ),
        Resource::HiliteCube => "the environment (hilite.exr)".to_owned(),
        Resource::ReflectedCube => {
            "the environment as the skin mirrors it where the specular map is black (reflected.exr)"
                .to_owned()
        }
        Resource::GlossyCube => {
            "the environment as the skin mirrors it where the specular map is white (glossy.exr)".to_owned()
        }
        Resource::ColorMap => "the scene's colour map, decoded from sRGB".to_owned(),
        Resource::NormalMap => "the scene's normal map as stored, +Y up".to_owned(),
        Resource::SpecularMap => "the scene's specular map, linear".to_owned(),
        Resource::AttenuatorMap => "the scene's attenuator map, linear".to_owned(),
        Resource::OwnMap(field) => {
            let stored =
                if field.info().numbers == 1 { "first channel, linear" } else { "decoded from sRGB" };
            format!("the scene's map {}, {stored}: {}", field.name(), field.info().meaning)
        }
        _ => return None,
    };
    Some(words)
}

/// What a field of a function's input is: of those that vertices find of lights and sky what their files say.
pub(super) fn meaning(plan: &Plan, field: &str) -> String {
    let known = match field {
        "vertex_position" => "position",
        "vertex_normal" => "normal, as interpolated",
        "vertex_tangent" => "tangent, as interpolated",
        "vertex_bitangent" => "bitangent w cross(N, T), as interpolated",
        "vertex_uv" => "texture coordinates, origin at the image's top left",
        "vertex_atlas_uv" => {
            "texture coordinates by which the mesh lies in the UV atlas: the set that `uv_set` in the scene's [diffusion] names"
        }
        "vertex_occlusion" => "open share of the hemisphere, 1 = unoccluded",
        "vertex_chart" => {
            "number of the vertex' connected piece of the UV atlas, counted from 1 (charts.csv of `skinfit bake --stages`)"
        }
        "vertex_view" => "unit vector from the eye to the vertex, as interpolated",
        "vertex_silhouette" => "1 - |N.V| of the vertex, as interpolated",
        "eye" => "position of the eye",
        other => {
            if let Some(field) = Field::from_name(other) {
                return field.info().meaning.to_owned();
            }
            let steps = plan.all_steps();
            let rule = steps.iter().map(|step| step.rule).find(|rule| rule.gives_quantity(other));
            let about = rule.map_or("", |rule| rule.about.trim_end_matches('.'));
            return if about.is_empty() { "as the rule of that name gives it" } else { about }.to_owned();
        }
    };
    known.to_owned()
}

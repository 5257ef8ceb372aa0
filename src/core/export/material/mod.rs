//! Materials of engines that use an exported shader: they fill what it is called with, and name the cubes and maps that it
//! reads.

mod godot;
pub mod unity;
mod unreal;

use super::function::{is_color, meaning, planned, what_to_bind};
use super::{ExportError, Target, names};
use crate::model::params::Params;
use crate::shader::quantity::Kind;
use crate::shader::{Facts, Plan, Resource};

/// The engines that there are materials for.
const ENGINES: [Target; 3] = [Target::Godot, Target::Unity, Target::Unreal];

/// A material for the shader that [`super::function`] makes of the same facts and constants; `shader` is the name that its
/// file has for the engine. Unreal finds files by paths from a root alone: without one, the shader stands in the material,
/// and the name is its title.
///
/// # Errors
/// When the target is no engine, or the shader asks for what a material cannot hand over; as of [`super::function`].
pub fn material(target: Target, facts: &Facts, params: &Params, shader: &str) -> Result<String, ExportError> {
    let engines = || {
        let [first, second, third] = ENGINES.map(Target::name);
        format!("{first}, {second} or {third}")
    };
    if !ENGINES.contains(&target) {
        return Err(ExportError::NoMaterial { target: target.name(), engines: engines() });
    }
    with_parts(facts, params, shader, |parts| match target {
        Target::Unity => unity::shader::text(parts, "Skin"),
        Target::Unreal => unreal::text(parts),
        _ => godot::text(parts),
    })
}

/// What `make` makes of a material's parts.
fn with_parts<T, E: From<ExportError>>(
    facts: &Facts,
    params: &Params,
    shader: &str,
    make: impl FnOnce(&Parts<'_>) -> Result<T, E>,
) -> Result<T, E> {
    let (plan, resources, _) = planned(facts, params)?;
    if !plan.passes.is_empty() {
        let what = "textures that passes over the UV atlas make".to_owned();
        return Err(ExportError::Unfilled { what }.into());
    }
    make(&Parts { plan: &plan, resources: &resources, params, shader })
}

/// What a material is made of.
struct Parts<'a> {
    plan: &'a Plan,
    resources: &'a [Resource],
    params: &'a Params,
    shader: &'a str,
}

/// A cube or map that the shader reads.
struct Bound {
    /// What the shader reads.
    resource: Resource,
    /// Its name in the shader.
    name: String,
    /// Whether it is a cube.
    cube: bool,
    /// Whether the engine has to decode it from sRGB.
    color: bool,
    /// What belongs there.
    words: String,
}

impl Bound {
    /// The name without what says whose and of which kind it is.
    fn short(&self) -> &str {
        self.name.trim_start_matches(names::PREFIX).trim_end_matches("_cube").trim_end_matches("_map")
    }
}

/// What an engine has of each member of the surface, in glTF's axes.
type Members = [(&'static str, &'static str); 7];

impl Parts<'_> {
    /// A line for each member of the surface.
    fn filled(&self, members: &Members, indent: &str) -> Result<String, ExportError> {
        let line = |(name, _): &(&'static str, &'static str)| {
            let known = members.iter().find(|(member, _)| member == name);
            let Some((_, value)) = known else {
                return Err(ExportError::Unfilled { what: format!("{name} ({})", meaning(self.plan, name)) });
            };
            Ok(format!("{indent}at.{name} = {value};\n"))
        };
        self.plan.surface().iter().map(line).collect()
    }

    /// The cubes and maps.
    fn bound(&self) -> impl Iterator<Item = Bound> {
        let bound = |&resource: &Resource| {
            let words = what_to_bind(resource, self.params)?;
            let name = names::function(resource.name());
            let (cube, color) = (resource.kind() == Kind::Cube, is_color(resource));
            Some(Bound { resource, name, cube, color, words })
        };
        self.resources.iter().filter_map(bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{BUDGET, Provenance, function};
    use crate::model::effects::{Effects, Form, Silhouette};
    use crate::model::evaluate::Setup;
    use crate::shader::facts::MapFacts;

    /// All maps, each by itself, on a mesh of which nothing is known.
    fn facts(setup: Setup) -> Facts {
        let maps =
            MapFacts { color: true, normal: true, specular: true, attenuator: true, ..MapFacts::default() };
        Facts { setup, maps, budget: BUDGET, tessellation: 1.0, ..Facts::default() }
    }

    fn surface() -> Facts {
        facts(Setup::new(Form::Corrected, Silhouette::Fragment, Effects::SURFACE))
    }

    /// The words of a text that begin with the prefix.
    fn words(text: &str) -> Vec<&str> {
        let word = |c: char| !(c.is_ascii_alphanumeric() || c == '_');
        text.split(word).filter(|word| word.starts_with(names::PREFIX)).collect()
    }

    #[test]
    fn a_material_fills_every_member_and_names_what_the_shader_declares() {
        let (facts, params) = (surface(), Params::defaults(Form::Corrected));
        let (plan, ..) = planned(&facts, &params).unwrap();
        for target in ENGINES {
            let shader = function(target, &facts, &params, &Provenance::default()).unwrap();
            let material = material(target, &facts, &params, "skin.inc").unwrap();
            assert!(
                material.contains("skin.inc") && !material.contains("SHADER") && !material.contains("FILLED")
            );
            for (member, _) in plan.surface() {
                assert_eq!(material.matches(&format!("at.{member} = ")).count(), 1, "{member}: {material}");
            }
            for word in words(&material).into_iter().filter(|word| *word != "skinfit_shade") {
                assert!(shader.contains(&format!(" {word}")), "{word} is not the shader's");
            }
            for bound in ["skinfit_irradiance_cube", "skinfit_hilite_cube", "skinfit_color_map"] {
                assert!(material.contains(bound), "{material}");
            }
            let count = |c: char| material.matches(c).count();
            assert_eq!((count('{'), count('(')), (count('}'), count(')')), "{material}");
        }
    }

    #[test]
    fn what_no_material_can_hand_over_is_refused() {
        let params = Params::defaults(Form::Corrected);
        let error = material(Target::C, &surface(), &params, "skin.h").unwrap_err().to_string();
        assert!(error.starts_with("c is no engine") && error.contains("godot, unity or unreal"), "{error}");
        // The listing's rim is made at vertices.
        let setup = Setup::new(Form::Listing, Silhouette::Vertex, Effects::SURFACE);
        let listing = Facts { square_rim: true, ..facts(Setup { interpolated_rim: true, ..setup }) };
        let params = Params::defaults(Form::Listing);
        let error = material(Target::Unity, &listing, &params, "skin.hlsl").unwrap_err().to_string();
        assert!(error.contains("vertex_") && error.contains("which no material file hands over"), "{error}");
    }
}

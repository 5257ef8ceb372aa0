//! The image of stored samples, and its vector-Jacobian product, as compute shaders over buffers of tensors.
//!
//! The forward module shades pixels from what a tensor may stand for: the maps' values at each sample, and the
//! cubes. The backward module takes an adjoint of the image (how a loss moves with each pixel) and yields the adjoint
//! of each requested input: the planner's rules tell how a sample's colour moves along a seed (their
//! [`tangents`](crate::shader::tangent)), and its dot product with the pixel's adjoint is what the seed gets. What a
//! sample reads alone is written where it stands; free columns are added up in a tree over each workgroup; the light of
//! a cube is left sample by sample with the place of its lookup, to be scattered to the texels.

mod backward;
mod constants;
mod input;
mod text;

pub use self::input::{INPUTS, Input};

use std::fmt::Write as _;

use self::text::{HEAD, Text};
use crate::model::evaluate::Setup;
use crate::model::params::{Column, Param};
use crate::shader::Domain;
use crate::shader::PlanError;
use crate::shader::emit::{Plan, plan, sample_fields, shown};
use crate::shader::facts::{Budget, Facts, MapFacts, Source};
use crate::shader::module::uniform;
use crate::shader::quantity::Constant;
use crate::shader::search::components;
use crate::shader::tangent::TangentError;

/// Threads of a workgroup.
pub const WORKGROUP: u32 = 64;

/// A lookup of a cube: the light that it yields, where, and the light's WGSL type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lookup {
    /// The cube.
    pub cube: Input,
    light: &'static str,
    place: &'static str,
    kind: &'static str,
}

const LOOKUPS: [Lookup; 6] = [
    Lookup { cube: Input::Irradiance, light: "irradiance", place: "n_place", kind: "vec3f" },
    Lookup { cube: Input::Lobe, light: "side_light", place: "n_place", kind: "vec3f" },
    Lookup { cube: Input::Lobe, light: "mirror_light", place: "reflected_place", kind: "vec4f" },
    Lookup { cube: Input::Hilite, light: "hilite_light", place: "view_place", kind: "vec3f" },
    Lookup { cube: Input::Reflected, light: "rough_light", place: "lobe_place", kind: "vec3f" },
    Lookup { cube: Input::Glossy, light: "glossy_light", place: "lobe_place", kind: "vec3f" },
];

/// What is bound in group 1; the binding is the place in a module's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binding {
    /// `Part`: how many pixel slots and samples there are, two `u32`.
    Part,
    /// What is no tensor of each sample: planes of `f32`, in the order of [`Adjoint::fixed`], the share last.
    Fixed,
    /// Where each group's records start.
    GroupStart,
    /// A tensor's numbers.
    Given(Input),
    /// The image, four numbers a pixel slot.
    Image,
    /// Its adjoint.
    ImageAdjoint,
    /// The adjoint of a sample's field.
    Gradient(Input),
    /// The columns' sums, of each workgroup.
    PartialSums,
    /// The adjoint of the light of the lookup of that number, four numbers a sample.
    LightAdjoint(usize),
    /// Where that lookup was: face, s and t of each sample.
    LightPlace(usize),
}

/// A compute module: entry point `cs_main`, a thread a pixel slot.
#[derive(Clone, Debug)]
pub struct Module {
    /// The text. Group 0 is the plan's.
    pub wgsl: String,
    /// What group 1 holds.
    pub bindings: Vec<Binding>,
}

/// The model over stored samples, in terms of tensors.
#[derive(Clone, Debug)]
pub struct Adjoint {
    /// The rules.
    pub plan: Plan,
    /// The free columns, in the order of their tensor.
    pub columns: Vec<Column>,
}

/// The model cannot be put in terms of those columns.
#[derive(Clone, Debug, thiserror::Error)]
pub enum AdjointError {
    /// No rules yield the image.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A rule has no derivative.
    #[error(transparent)]
    Tangent(#[from] TangentError),
    /// A column that acts through a cube.
    #[error(
        "{0} cannot be a free column here: it acts through cubes that are inputs of their own. Give the cubes of another \
         lobe instead."
    )]
    Lobe(&'static str),
}

/// Whether a parameter acts through cubes that are inputs of their own.
#[must_use]
pub fn is_sharpness(param: Param) -> bool {
    matches!(param.name(), "specular_lobe" | "roughness" | "gloss")
}

impl Adjoint {
    /// The model under those switches, with free columns; the environment is turned when `turned` says so or its
    /// rotation is free.
    ///
    /// # Errors
    /// When a lobe's sharpness is free, or the planner yields nothing.
    pub fn new(setup: Setup, columns: &[Column], turned: bool) -> Result<Self, AdjointError> {
        let free = |param: Param| columns.iter().any(|column| column.param == param);
        if let Some(param) = columns.iter().map(|column| column.param).find(|&param| is_sharpness(param)) {
            return Err(AdjointError::Lobe(param.name()));
        }
        let facts = Facts {
            setup,
            source: Source::Samples,
            maps: MapFacts::default(),
            turned: turned || free(Param::EnvironmentRotation),
            square_rim: false,
            budget: Budget::Exact,
            ..Facts::default()
        };
        let mut plan = plan(&facts)?;
        if plan.constants.contains(&Constant::KeyDirection) {
            for (param, slope) in
                [(Param::KeyAzimuth, Constant::KeyByAzimuth), (Param::KeyElevation, Constant::KeyByElevation)]
            {
                if free(param) {
                    plan.constants.push(slope);
                }
            }
        }
        Ok(Self { plan, columns: columns.to_vec() })
    }

    /// Whether the enabled effects read an input.
    #[must_use]
    pub fn reads(&self, input: Input) -> bool {
        match (input.width(), input.faces()) {
            (Some(_), _) => sample_fields(&self.plan.facts).iter().any(|(name, _)| *name == input.name()),
            (_, Some(faces)) => self.plan.resources.contains(&faces),
            _ => !self.columns.is_empty(),
        }
    }

    /// The fields of a sample that are no tensors, with how many numbers each has.
    #[must_use]
    pub fn fixed(&self) -> Vec<(&'static str, usize)> {
        let fields = sample_fields(&self.plan.facts).into_iter();
        fields
            .filter(|(name, _)| Input::of_field(name).is_none())
            .map(|(name, kind)| (name, components(kind)))
            .collect()
    }

    /// The lookups of a cube that the plan does.
    #[must_use]
    pub fn lookups(&self, cube: Input) -> Vec<(usize, Lookup)> {
        let looked_up = |lookup: &Lookup| {
            lookup.cube == cube
                && self.plan.steps.iter().any(|step| step.rule.gives.iter().any(|(q, _)| *q == lookup.light))
        };
        LOOKUPS.into_iter().enumerate().filter(|(_, lookup)| looked_up(lookup)).collect()
    }

    /// The module that shades.
    #[must_use]
    pub fn forward(&self) -> Module {
        let mut text = Text::new(self);
        text.bind(Binding::Image);
        let mut wgsl = text.declarations("");
        wgsl.push_str(HEAD);
        wgsl.push_str("    if (slot >= part.slots) {\n        return;\n    }\n    var shown = vec4f();\n");
        wgsl.push_str(&text.record());
        wgsl.push_str(&self.plan.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
        let _ = writeln!(wgsl, "        shown += share * {};", shown(&self.plan.facts));
        wgsl.push_str("    }\n");
        for c in 0..4 {
            let _ = writeln!(wgsl, "    image[4u * slot + {c}u] = shown[{c}];");
        }
        wgsl.push_str("}\n");
        Module { wgsl, bindings: text.bindings }
    }
}

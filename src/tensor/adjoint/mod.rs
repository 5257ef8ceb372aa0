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

pub(crate) use self::backward::of_column;
pub use self::constants::module_of;
pub use self::input::{INPUTS, Input};

use std::fmt::Write as _;

use self::text::{HEAD, Text};
use crate::model::evaluate::Setup;
use crate::model::params::{Column, Param};
use crate::shader::Domain;
use crate::shader::PlanError;
use crate::shader::atlas::stored;
use crate::shader::emit::{Plan, plan, sample_fields, shown};
use crate::shader::facts::{Budget, Facts, MapFacts, Source};
use crate::shader::module::uniform;
use crate::shader::quantity::{Constant, Resource};
use crate::shader::rule::Rule;
use crate::shader::search::components;
use crate::shader::tangent::TangentError;

/// Threads of a workgroup.
pub const WORKGROUP: u32 = 64;

/// A lookup of a cube: a step of the plan that reads its faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lookup {
    /// The cube.
    pub cube: Input,
    /// The quantity that it yields, and its WGSL type.
    light: (&'static str, &'static str),
    /// The quantity that says where on the faces; `None` where the rule itself finds the place.
    place: Option<&'static str>,
}

impl Lookup {
    /// The lookups of a rule. Where its one parameter is a place on faces, and is called so, the cube's texels get what the
    /// light gets, by the shares that the place gives them.
    fn of(rule: &Rule) -> impl Iterator<Item = Self> {
        let place = match (&rule.needs[..], rule.domain) {
            (&[(name, "vec3f")], Domain::Fragment) if name.ends_with("_place") => Some(name),
            _ => None,
        };
        let cubes =
            Input::ALL.into_iter().filter(|cube| cube.faces().is_some_and(|faces| reads(rule, faces)));
        cubes.flat_map(move |cube| {
            rule.gives.iter().map(move |&(light, _)| Self { cube, light: (light, rule.returns), place })
        })
    }

    /// The quantity that says where on the faces.
    fn placed(&self) -> Result<&'static str, AdjointError> {
        self.place.ok_or(AdjointError::Cube { cube: self.cube.name(), light: self.light.0 })
    }
}

fn reads(rule: &Rule, faces: Resource) -> bool {
    rule.reads.contains(&faces.name())
}

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
    /// The rules of samples.
    pub plan: Plan,
    /// The free columns, in the order of their tensor.
    pub columns: Vec<Column>,
    lookups: Vec<Lookup>,
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
    /// A column that acts through a cube alone.
    #[error(
        "{0} cannot be a free column here: it acts through a cube that is an input of its own. Give the cube of another \
         lobe instead."
    )]
    Lobe(&'static str),
    /// A cube that texels of an atlas look up.
    #[error(
        "No derivative by the cube `{cube}` of what is computed in the texels of an atlas: hold it there, or leave the effects \
         out whose light stands there."
    )]
    CubeOfTexels {
        /// The cube.
        cube: &'static str,
    },
    /// A cube whose texels have no derivative.
    #[error(
        "No derivative by the cube `{cube}`: what makes {light} of it finds the place of its lookup itself. Hold the cube, or give \
         the rule the place alone, as a quantity whose name ends in `_place`."
    )]
    Cube {
        /// The cube.
        cube: &'static str,
        /// What is looked up.
        light: &'static str,
    },
}

/// The rules of stored samples under those switches, and of the texels that they look up, with what columns that are free read
/// beside.
///
/// # Errors
/// When `specular_lobe` is free, or the planner yields nothing.
pub fn plan_of(setup: Setup, columns: &[Column], turned: bool) -> Result<Plan, AdjointError> {
    let free = |param: Param| columns.iter().any(|column| column.param == param);
    if free(Param::SpecularLobe) {
        return Err(AdjointError::Lobe(Param::SpecularLobe.name()));
    }
    let facts = Facts {
        setup,
        source: Source::Samples,
        maps: MapFacts::default(),
        turned: turned || free(Param::EnvironmentRotation),
        atlas: setup.needs().atlas.then_some(1),
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
    Ok(plan)
}

impl Adjoint {
    /// The model under those switches, with free columns; the environment is turned when `turned` says so or its
    /// rotation is free.
    ///
    /// # Errors
    /// When `specular_lobe` is free, or the planner yields nothing.
    pub fn new(setup: Setup, columns: &[Column], turned: bool) -> Result<Self, AdjointError> {
        let mut plan = plan_of(setup, columns, turned)?;
        // Levels are an input of their own.
        plan.passes.clear();
        let lookups = plan.steps.iter().flat_map(|step| Lookup::of(step.rule)).collect();
        Ok(Self { plan, columns: columns.to_vec(), lookups })
    }

    /// Whether the enabled effects read an input.
    #[must_use]
    pub fn reads(&self, input: Input) -> bool {
        match (input.width(), input.faces()) {
            (Some(_), _) => sample_fields(&self.plan.facts).iter().any(|(name, _)| *name == input.name()),
            (_, Some(faces)) => self.plan.resources.contains(&faces),
            _ if input == Input::Levels => !self.plan.levels.is_empty(),
            _ => !self.columns.is_empty(),
        }
    }

    /// How many numbers a sample has of an input, for those that are its fields.
    #[must_use]
    pub fn width(&self, input: Input) -> Option<usize> {
        let of_levels = || self.plan.levels.iter().map(|level| components(level.kind)).sum();
        if input == Input::Levels { Some(of_levels()) } else { input.width() }
    }

    /// The numbers of levels that a sample looks up, in the order of their tensor: each with the level's place among the plan's.
    fn looked_up(&self) -> impl Iterator<Item = (usize, usize)> {
        let levels = self.plan.levels.iter().enumerate();
        levels.flat_map(|(level, of)| (0..components(of.kind)).map(move |component| (level, component)))
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

    /// The lookups of a cube that the plan does, each with its number among all.
    pub fn lookups(&self, cube: Input) -> impl Iterator<Item = (usize, Lookup)> {
        self.lookups.iter().copied().enumerate().filter(move |(_, lookup)| lookup.cube == cube)
    }

    /// Whether there is a derivative by an input.
    ///
    /// # Errors
    /// When there is none by a cube.
    pub fn moves(&self, input: Input) -> Result<(), AdjointError> {
        self.lookups(input).try_for_each(|(_, lookup)| lookup.placed().map(|_| ()))
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
        wgsl.push_str(&stored(&self.plan.levels));
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

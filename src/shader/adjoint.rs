//! The image of stored samples, and its vector-Jacobian product, as compute shaders over buffers of tensors.
//!
//! The forward module shades pixels from what a tensor may stand for: the maps' values at each sample, and the
//! cubes. The backward module takes an adjoint of the image (how a loss moves with each pixel) and yields the
//! adjoint of whatever is asked for: the planner's rules tell how a sample's colour moves along a seed (their
//! [`tangents`](super::tangent)), and its dot product with the pixel's adjoint is what the seed gets. What a sample
//! reads alone is written where it stands; free columns are added up in a tree over each workgroup; the light of a
//! cube is left sample by sample with the place of its lookup, to be scattered to the texels.

use std::fmt::Write as _;

use super::emit::{Plan, hazy, parts, plan, sample_fields};
use super::facts::{Budget, Facts, MapFacts, Source};
use super::module::uniform;
use super::quantity::{Constant, Resource};
use super::rule::Stage;
use super::search::components;
use super::tangent::TangentError;
use super::tangent::chain::{Chain, Seed};
use crate::model::evaluate::Setup;
use crate::model::params::{Channels, Column, Param};
use crate::samples::LANES;
use crate::shader::PlanError;

/// Threads of a workgroup.
pub const WORKGROUP: u32 = 64;

/// What a tensor may stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Input {
    /// The free columns of the model's parameters.
    Columns,
    /// Albedo at each sample, three numbers.
    Albedo,
    /// Specular map at each sample.
    Specular,
    /// Attenuator map at each sample.
    Attenuator,
    /// Open share of the hemisphere at each sample.
    Open,
    /// The normal map's part along T and B at each sample, three numbers.
    Bump,
    /// E_d's texels with their border, RGBA.
    Irradiance,
    /// E_s's texels with their border, RGBA.
    Lobe,
    /// E_h's texels with their border, RGBA.
    Hilite,
}

impl Input {
    /// Every input.
    pub const ALL: [Self; 9] = [
        Self::Columns,
        Self::Albedo,
        Self::Specular,
        Self::Attenuator,
        Self::Open,
        Self::Bump,
        Self::Irradiance,
        Self::Lobe,
        Self::Hilite,
    ];

    /// The name in messages; of a sample's field, that of the quantity too.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Columns => "columns",
            Self::Albedo => "albedo",
            Self::Specular => "specular",
            Self::Attenuator => "attenuator",
            Self::Open => "open",
            Self::Bump => "bump",
            Self::Irradiance => "irradiance",
            Self::Lobe => "lobe",
            Self::Hilite => "hilite",
        }
    }

    /// The cube's faces, for those that are cubes.
    #[must_use]
    pub const fn faces(self) -> Option<Resource> {
        match self {
            Self::Irradiance => Some(Resource::IrradianceFaces),
            Self::Lobe => Some(Resource::SpecularFaces),
            Self::Hilite => Some(Resource::HiliteFaces),
            _ => None,
        }
    }

    /// How many numbers a sample has of it, for those that are a sample's fields.
    #[must_use]
    pub const fn width(self) -> Option<usize> {
        match self {
            Self::Albedo | Self::Bump => Some(3),
            Self::Specular | Self::Attenuator | Self::Open => Some(1),
            _ => None,
        }
    }

    fn of_field(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|input| input.width().is_some() && input.name() == name)
    }
}

/// A lookup of a cube: the light that it yields, where, and the light's WGSL type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lookup {
    /// The cube.
    pub cube: Input,
    light: &'static str,
    place: &'static str,
    kind: &'static str,
}

const LOOKUPS: [Lookup; 4] = [
    Lookup { cube: Input::Irradiance, light: "irradiance", place: "n_place", kind: "vec3f" },
    Lookup { cube: Input::Lobe, light: "side_light", place: "n_place", kind: "vec3f" },
    Lookup { cube: Input::Lobe, light: "mirror_light", place: "reflected_place", kind: "vec4f" },
    Lookup { cube: Input::Hilite, light: "hilite_light", place: "view_place", kind: "vec3f" },
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
        "specular_lobe cannot be a free column here: it acts through the specular cube, which is an input of its own. \
         Give the cube of another lobe instead."
    )]
    Lobe,
}

impl Adjoint {
    /// The model under those switches, with free columns; the environment is turned when `turned` says so or its
    /// rotation is free.
    ///
    /// # Errors
    /// When `specular_lobe` is free, or the planner yields nothing.
    pub fn new(setup: Setup, columns: &[Column], turned: bool) -> Result<Self, AdjointError> {
        let free = |param: Param| columns.iter().any(|column| column.param == param);
        if free(Param::SpecularLobe) {
            return Err(AdjointError::Lobe);
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
        wgsl.push_str(&self.plan.calls(Stage::Fragment, uniform, |name| format!("at.{name}")));
        let _ = writeln!(wgsl, "        shown += share * {};", self.shown());
        wgsl.push_str("    }\n");
        for c in 0..4 {
            let _ = writeln!(wgsl, "    image[4u * slot + {c}u] = shown[{c}];");
        }
        wgsl.push_str("}\n");
        Module { wgsl, bindings: text.bindings }
    }

    /// Radiance and haze of a sample.
    fn shown(&self) -> String {
        let parts = parts(&self.plan.facts);
        let radiance = if parts.is_empty() { "vec3f()".to_owned() } else { parts.join(" + ") };
        format!("vec4f({radiance}, {})", if hazy(&self.plan.facts) { "haze" } else { "0.0" })
    }

    /// The module that yields the adjoints of `wanted`, which the model reads.
    ///
    /// # Errors
    /// When a rule has no derivative.
    pub fn backward(&self, wanted: &[Input]) -> Result<Module, AdjointError> {
        let mut text = Text::new(self);
        text.bind(Binding::ImageAdjoint);
        let (seeds, gains): (Vec<Seed>, Vec<Vec<Gain>>) =
            wanted.iter().flat_map(|&input| self.seeds(input)).unzip();
        let chain = Chain::new(&self.plan, &seeds)?;
        for gain in gains.iter().flatten() {
            match *gain {
                Gain::Column(_) => text.bind(Binding::PartialSums),
                Gain::Field(input, _) => text.bind(Binding::Gradient(input)),
                Gain::Light(index) => {
                    text.bind(Binding::LightAdjoint(index));
                    text.bind(Binding::LightPlace(index));
                }
            }
        }
        let sums = if wanted.contains(&Input::Columns) { self.columns.len() } else { 0 };
        let mut wgsl = text.declarations(&chain.functions);
        if sums > 0 {
            let _ = write!(wgsl, "\nvar<workgroup> tree: array<f32, {WORKGROUP}>;\n");
        }
        wgsl.push_str(HEAD);
        (0..sums).for_each(|k| {
            let _ = writeln!(wgsl, "    var sum{k} = 0.0;");
        });
        wgsl.push_str("    if (slot < part.slots) {\n    let pixel = vec4f(image_adjoint[4u * slot], image_adjoint[4u * slot + 1u], image_adjoint[4u * slot + 2u], image_adjoint[4u * slot + 3u]);\n");
        wgsl.push_str(&text.record());
        wgsl.push_str("        let adjoint = share * pixel;\n");
        wgsl.push_str(&self.plan.calls(Stage::Fragment, uniform, |name| format!("at.{name}")));
        chain.lines.iter().for_each(|lines| wgsl.push_str(lines));
        for (k, gains) in gains.iter().enumerate() {
            for gain in gains {
                self.gain(&mut wgsl, *gain, chain.radiance[k].as_deref(), chain.haze[k].as_deref());
            }
        }
        wgsl.push_str("    }\n    }\n");
        (0..sums).for_each(|k| {
            let _ = write!(
                wgsl,
                "    tree[thread] = sum{k};\n    for (var half = {WORKGROUP}u / 2u; half > 0u; half /= 2u) {{\n        workgroupBarrier();\n        if (thread < half) {{\n            tree[thread] += tree[thread + half];\n        }}\n    }}\n    if (thread == 0u) {{\n        partial_sums[(workgroup.x + workgroup.y * workgroups.x) * {sums}u + {k}u] = tree[0];\n    }}\n    workgroupBarrier();\n"
            );
        });
        wgsl.push_str("}\n");
        Ok(Module { wgsl, bindings: text.bindings })
    }

    /// What moves for an input's sake, and what becomes of each tangent.
    fn seeds(&self, input: Input) -> Vec<(Seed, Vec<Gain>)> {
        let named = |name: &'static str, tangent: &str| Seed::Named { name, tangent: tangent.to_owned() };
        match input {
            Input::Columns => {
                let columns = || self.columns.iter().enumerate();
                let first =
                    |k: usize| columns().position(|(_, c)| c.param == self.columns[k].param) == Some(k);
                let of = |param: Param| {
                    columns().filter(move |(_, c)| c.param == param).map(|(k, _)| Gain::Column(k)).collect()
                };
                let params = columns().filter(|(k, _)| first(*k)).map(|(_, column)| column.param);
                params.map(|param| (Seed::of_param(param), of(param))).collect()
            }
            // Channels never mix: all three move at once.
            Input::Albedo => vec![(named("albedo", "vec3f(1.0)"), vec![Gain::Field(input, None)])],
            Input::Bump => ["vec3f(1.0, 0.0, 0.0)", "vec3f(0.0, 1.0, 0.0)", "vec3f(0.0, 0.0, 1.0)"]
                .into_iter()
                .enumerate()
                .map(|(k, unit)| (named("bump", unit), vec![Gain::Field(input, Some(k))]))
                .collect(),
            Input::Specular | Input::Attenuator | Input::Open => {
                vec![(named(input.name(), "1.0"), vec![Gain::Field(input, Some(0))])]
            }
            Input::Irradiance | Input::Lobe | Input::Hilite => self
                .lookups(input)
                .into_iter()
                .map(|(i, lookup)| {
                    (named(lookup.light, &format!("{}(1.0)", lookup.kind)), vec![Gain::Light(i)])
                })
                .collect(),
        }
    }

    /// The line that takes a tangent to where it is wanted.
    fn gain(&self, wgsl: &mut String, gain: Gain, radiance: Option<&str>, haze: Option<&str>) {
        let moved = format!("vec4f({}, {})", radiance.unwrap_or("vec3f()"), haze.unwrap_or("0.0"));
        let _ = match gain {
            Gain::Column(k) => match self.columns[k].channels {
                Channels::Tied => writeln!(wgsl, "        sum{k} += dot(adjoint, {moved});"),
                Channels::One(c) => writeln!(wgsl, "        sum{k} += (adjoint * {moved})[{c}];"),
            },
            Gain::Field(input, None) => {
                let name = input.name();
                let _ = writeln!(wgsl, "        let gained_{name} = adjoint * {moved};");
                (0..3).try_for_each(|c| {
                    writeln!(wgsl, "        {name}_gradient[3u * s + {c}u] = gained_{name}[{c}];")
                })
            }
            Gain::Field(input, Some(component)) => writeln!(
                wgsl,
                "        {}_gradient[{}u * s + {component}u] = dot(adjoint, {moved});",
                input.name(),
                input.width().unwrap_or(1)
            ),
            Gain::Light(index) => {
                let _ = writeln!(wgsl, "        let gained_light{index} = adjoint * {moved};");
                let _ = (0..4).try_for_each(|c| {
                    writeln!(wgsl, "        light{index}_adjoint[4u * s + {c}u] = gained_light{index}[{c}];")
                });
                let place = LOOKUPS[index].place;
                (0..3).try_for_each(|c| {
                    writeln!(wgsl, "        light{index}_place[3u * s + {c}u] = {place}[{c}];")
                })
            }
        };
    }

    /// The module that fills the plan's block of constants from the columns: entry point `cs_main`, one thread. In
    /// group 0: the columns, the parameters' values (a `vec4f` each), and the block.
    #[must_use]
    pub fn constants(&self) -> String {
        let mut wgsl = String::new();
        if !self.columns.is_empty() {
            wgsl.push_str("@group(0) @binding(0) var<storage, read_write> columns: array<f32>;\n");
        }
        wgsl.push_str(
            "@group(0) @binding(1) var<storage, read> values: array<vec4f>;\n\
            @group(0) @binding(2) var<storage, read_write> block: array<vec4f>;\n\n\
            @compute @workgroup_size(1)\nfn cs_main() {\n    const DEGREE = 0.017453292;\n",
        );
        for param in Param::all() {
            let _ = writeln!(wgsl, "    var {} = values[{}];", param.name(), param as usize);
        }
        for (k, column) in self.columns.iter().enumerate() {
            let name = column.param.name();
            let _ = match column.channels {
                Channels::Tied => writeln!(wgsl, "    {name} = vec4f(vec3f(columns[{k}]), 0.0);"),
                Channels::One(c) => writeln!(wgsl, "    {name}[{c}] = columns[{k}];"),
            };
        }
        wgsl.push_str(
            "    let turn = DEGREE * environment_rotation.x;\n    let azimuth = DEGREE * key_azimuth.x;\n    let elevation = DEGREE * key_elevation.x;\n",
        );
        for (i, constant) in self.plan.constants.iter().enumerate() {
            let value = match constant {
                Constant::Param(param) => param.name(),
                Constant::Turn => "vec4f(cos(turn), sin(turn), 0.0, 0.0)",
                Constant::KeyDirection => {
                    "vec4f(cos(elevation) * sin(azimuth), sin(elevation), cos(elevation) * cos(azimuth), 0.0)"
                }
                Constant::KeyByAzimuth => {
                    "DEGREE * vec4f(cos(elevation) * cos(azimuth), 0.0, -cos(elevation) * sin(azimuth), 0.0)"
                }
                Constant::KeyByElevation => {
                    "DEGREE * vec4f(-sin(elevation) * sin(azimuth), cos(elevation), -sin(elevation) * cos(azimuth), 0.0)"
                }
                // Of the vertex stage: no plan over samples has them.
                Constant::Eye | Constant::ViewProjection | Constant::MorphWeights => "vec4f()",
            };
            let _ = writeln!(wgsl, "    block[{i}] = {value};");
        }
        wgsl.push_str("}\n");
        wgsl
    }
}

/// What becomes of a seed's tangent.
#[derive(Clone, Copy, Debug)]
enum Gain {
    /// It is added to a column's sum.
    Column(usize),
    /// It is a sample's: of one component, or channel by channel.
    Field(Input, Option<usize>),
    /// It is that of a light.
    Light(usize),
}

/// A module as it is written.
struct Text<'a> {
    adjoint: &'a Adjoint,
    bindings: Vec<Binding>,
}

const HEAD: &str = "\n@compute @workgroup_size(64)\nfn cs_main(\n    @builtin(global_invocation_id) id: vec3u,\n    @builtin(local_invocation_index) thread: u32,\n    @builtin(workgroup_id) workgroup: vec3u,\n    @builtin(num_workgroups) workgroups: vec3u,\n) {\n    let slot = id.x + id.y * workgroups.x * 64u;\n";

impl<'a> Text<'a> {
    fn new(adjoint: &'a Adjoint) -> Self {
        let given = Input::ALL.into_iter().filter(|input| input.width().is_some() && adjoint.reads(*input));
        let bindings = [Binding::Part, Binding::Fixed, Binding::GroupStart];
        Self { adjoint, bindings: bindings.into_iter().chain(given.map(Binding::Given)).collect() }
    }

    fn bind(&mut self, binding: Binding) {
        if !self.bindings.contains(&binding) {
            self.bindings.push(binding);
        }
    }

    /// All but the entry point.
    fn declarations(&self, functions: &str) -> String {
        let mut wgsl = self.adjoint.plan.declarations(true);
        wgsl.push_str(functions);
        wgsl.push_str("\nstruct Sample {\n");
        for (name, kind) in sample_fields(&self.adjoint.plan.facts) {
            let _ = writeln!(wgsl, "    {name}: {kind},");
        }
        wgsl.push_str("}\n\nstruct Part {\n    slots: u32,\n    samples: u32,\n}\n\n");
        for (i, binding) in self.bindings.iter().enumerate() {
            let _ = write!(wgsl, "@group(1) @binding({i}) ");
            // Tensors share buffers, which a dispatch either reads or writes: all of them are declared as written.
            let tensor = |name: String| format!("var<storage, read_write> {name}: array<f32>;");
            let declared = match binding {
                Binding::Part => "var<uniform> part: Part;".to_owned(),
                Binding::Fixed => "var<storage, read> fixed_planes: array<f32>;".to_owned(),
                Binding::GroupStart => "var<storage, read> group_start: array<u32>;".to_owned(),
                Binding::Given(input) => tensor(format!("given_{}", input.name())),
                Binding::Image => tensor("image".to_owned()),
                Binding::ImageAdjoint => tensor("image_adjoint".to_owned()),
                Binding::Gradient(input) => tensor(format!("{}_gradient", input.name())),
                Binding::PartialSums => tensor("partial_sums".to_owned()),
                Binding::LightAdjoint(index) => tensor(format!("light{index}_adjoint")),
                Binding::LightPlace(index) => tensor(format!("light{index}_place")),
            };
            let _ = writeln!(wgsl, "{declared}");
        }
        wgsl
    }

    /// The loop over a pixel's samples, up to the sample `at` and its share; the caller closes it.
    fn record(&self) -> String {
        let mut wgsl = format!(
            "    let group = slot / {LANES}u;\n    for (var record = group_start[group]; record < group_start[group + 1u]; record++) {{\n        let s = record * {LANES}u + slot % {LANES}u;\n        var at: Sample;\n"
        );
        let mut plane = 0;
        for (name, kind) in sample_fields(&self.adjoint.plan.facts) {
            let count = components(kind);
            let number = |k: usize| match Input::of_field(name) {
                Some(input) => format!("given_{}[{count}u * s + {k}u]", input.name()),
                None => format!("fixed_planes[{}u * part.samples + s]", plane + k),
            };
            let numbers: Vec<String> = (0..count).map(number).collect();
            let _ = writeln!(wgsl, "        at.{name} = {kind}({});", numbers.join(", "));
            if Input::of_field(name).is_none() {
                plane += count;
            }
        }
        let _ = writeln!(wgsl, "        let share = fixed_planes[{plane}u * part.samples + s];");
        wgsl
    }
}

//! What both modules begin with: declarations, and the loop over a pixel's samples.

use std::fmt::Write as _;

use super::{Adjoint, Binding, Input};
use crate::samples::LANES;
use crate::shader::emit::sample_fields;
use crate::shader::search::components;

/// A module as it is written.
pub(super) struct Text<'a> {
    adjoint: &'a Adjoint,
    pub(super) bindings: Vec<Binding>,
}

pub(super) const HEAD: &str = "\n@compute @workgroup_size(64)\nfn cs_main(\n    @builtin(global_invocation_id) id: vec3u,\n    @builtin(local_invocation_index) thread: u32,\n    @builtin(workgroup_id) workgroup: vec3u,\n    @builtin(num_workgroups) workgroups: vec3u,\n) {\n    let slot = id.x + id.y * workgroups.x * 64u;\n";

impl<'a> Text<'a> {
    pub(super) fn new(adjoint: &'a Adjoint) -> Self {
        let given =
            Input::ALL.into_iter().filter(|&input| adjoint.width(input).is_some() && adjoint.reads(input));
        let bindings = [Binding::Part, Binding::Fixed, Binding::GroupStart];
        Self { adjoint, bindings: bindings.into_iter().chain(given.map(Binding::Given)).collect() }
    }

    pub(super) fn bind(&mut self, binding: Binding) {
        if !self.bindings.contains(&binding) {
            self.bindings.push(binding);
        }
    }

    /// All but the entry point.
    pub(super) fn declarations(&self, functions: &str) -> String {
        let mut wgsl = self.adjoint.plan.declarations(true);
        wgsl.push_str(functions);
        wgsl.push_str("\nstruct Sample {\n");
        for (name, kind) in sample_fields(&self.adjoint.plan.facts) {
            let _ = writeln!(wgsl, "    {name}: {kind},");
        }
        for level in &self.adjoint.plan.levels {
            let _ = writeln!(wgsl, "    {}: {},", level.name, level.kind);
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
    pub(super) fn record(&self) -> String {
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
        let width = self.adjoint.width(Input::Levels).unwrap_or(0);
        let mut first = 0;
        for level in &self.adjoint.plan.levels {
            let count = components(level.kind);
            let numbers: Vec<String> =
                (first..first + count).map(|k| format!("given_levels[{width}u * s + {k}u]")).collect();
            let _ = writeln!(wgsl, "        at.{} = {}({});", level.name, level.kind, numbers.join(", "));
            first += count;
        }
        let _ = writeln!(wgsl, "        let share = fixed_planes[{plane}u * part.samples + s];");
        wgsl
    }
}

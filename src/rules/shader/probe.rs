//! A plan's rules in a compute shader, for given quantities: how they are held against other evaluators.

use std::fmt::Write as _;

use super::domain::Domain;
use super::emit::Plan;
use super::facts::Facts;
use super::quantity::Attribute;
use super::search::{PlanError, components};

/// Rules that yield wanted quantities from given ones, item by item.
#[derive(Clone, Debug)]
pub struct Probe {
    /// The rules; its module's entry point is `cs_main`, in workgroups of [`WORKGROUP`] items.
    pub plan: Plan,
    /// What each item gives, with WGSL types: numbers one after the other in the buffer after the plan's
    /// resources.
    pub given: Vec<(&'static str, &'static str)>,
    /// What is yielded for each, likewise, in the buffer after that.
    pub wanted: Vec<(&'static str, &'static str)>,
}

/// Items of a workgroup.
pub const WORKGROUP: u32 = 64;

impl Probe {
    /// The rules that yield the quantities `wanted` of a domain. Of vertices attributes are given; of fragments the
    /// quantities `given` are.
    ///
    /// # Errors
    /// When no rules yield them.
    pub fn new(
        facts: &Facts,
        domain: Domain,
        given: &[(&'static str, &'static str)],
        wanted: &[(&'static str, &'static str)],
    ) -> Result<Self, PlanError> {
        let names =
            |list: &[(&'static str, &'static str)]| list.iter().map(|(name, _)| *name).collect::<Vec<_>>();
        let (goals, there) = (names(wanted), names(given));
        let plan = match domain {
            Domain::Vertex => Plan::search(facts, &goals, &[], &[])?,
            // No probe stands for an atlas.
            Domain::Texel => return Err(PlanError::NoPlan { goals: goals.join(", ") }),
            Domain::Fragment => Plan::search(facts, &[], &goals, &there)?,
        };
        let given = match domain {
            Domain::Vertex => plan.attributes.iter().map(|a: &Attribute| (a.name(), a.wgsl())).collect(),
            Domain::Texel | Domain::Fragment => given.to_vec(),
        };
        let mut probe = Self { plan, given, wanted: wanted.to_vec() };
        probe.plan.wgsl = probe.module(domain);
        Ok(probe)
    }

    /// Numbers that an item gives.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.given.iter().map(|(_, kind)| components(kind)).sum()
    }

    /// Numbers that are yielded for an item.
    #[must_use]
    pub fn width(&self) -> usize {
        self.wanted.iter().map(|(_, kind)| components(kind)).sum()
    }

    fn module(&self, domain: Domain) -> String {
        let mut wgsl = self.plan.declarations(true);
        let binding = self.plan.resources.len() + 1;
        let (stride, width) = (self.stride(), self.width());
        let _ = write!(
            wgsl,
            "\n@group(0) @binding({binding}) var<storage, read> given: array<f32>;\n@group(0) @binding({}) var<storage, read_write> wanted: array<f32>;\n\n@compute @workgroup_size({WORKGROUP})\nfn cs_main(@builtin(global_invocation_id) id: vec3u) {{\n    let vertex_index = id.x;\n    if (id.x * {width}u >= arrayLength(&wanted)) {{\n        return;\n    }}\n",
            binding + 1
        );
        let mut at = 0;
        for (name, kind) in &self.given {
            let number = |k: usize| format!("given[id.x * {stride}u + {}u]", at + k);
            let numbers: Vec<String> = (0..components(kind)).map(number).collect();
            // Indices of bones are given as numbers.
            let _ = match *kind {
                "f32" => writeln!(wgsl, "    let at_{name} = {};", numbers[0]),
                "vec4u" => writeln!(wgsl, "    let at_{name} = vec4u(vec4f({}));", numbers.join(", ")),
                kind => writeln!(wgsl, "    let at_{name} = {kind}({});", numbers.join(", ")),
            };
            at += numbers.len();
        }
        wgsl.push_str(&self.plan.calls(domain, super::module::uniform, |name| match name {
            "vertex_index" => name.to_owned(),
            given => format!("at_{given}"),
        }));
        let mut at = 0;
        for (name, kind) in &self.wanted {
            // What is given may be wanted too.
            let given = self.given.iter().any(|(given, _)| given == name);
            let value = if given { format!("at_{name}") } else { (*name).to_owned() };
            for k in 0..components(kind) {
                let component = if *kind == "f32" { String::new() } else { format!("[{k}]") };
                let _ = writeln!(wgsl, "    wanted[id.x * {width}u + {}u] = {value}{component};", at + k);
            }
            at += components(kind);
        }
        wgsl.push_str("}\n");
        wgsl
    }
}

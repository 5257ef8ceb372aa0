//! The text of the geometry pass: the planned vertex stage, and a planned fragment stage that leaves what is stored
//! of a sample instead of colour.
//!
//! An adapter draws into 32 bytes a sample at once, by WebGPU's defaults: two targets of four numbers. What a
//! sample holds beyond that is left by further [`Draw`]s, each planned by itself. A compute shader
//! ([`Draw::gather`]) then takes numbers from the targets to records.

use std::fmt::Write as _;

use crate::records::StoredRecords;
use crate::samples::LANES;
use crate::samples::surface_records::Places;
use crate::shader::Domain;
use crate::shader::module::uniform;
use crate::shader::{Facts, Plan, PlanError, Source};

/// Numbers of a target's texel.
const CHANNELS: usize = 4;
/// Numbers that a draw leaves of a sample.
const MOST_NUMBERS: usize = 2 * CHANNELS;
/// Threads of a workgroup of [`Draw::gather`].
pub(super) const WORKGROUP: u32 = 128;
/// In the place of a sample's texel: it is not in these targets.
pub(super) const ELSEWHERE: u32 = u32::MAX;

/// One draw of the mesh, and what it leaves.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    /// The rules; the module's entry points are `vs_main` and `fs_main`.
    pub(super) plan: Plan,
    fields: Vec<Field>,
}

/// A field of a stored sample.
#[derive(Clone, Copy, Debug)]
struct Field {
    name: &'static str,
    /// Its numbers.
    size: usize,
    /// The first row of a record that it takes.
    row: usize,
    /// The first of the draw's numbers that it takes.
    number: usize,
}

/// The vertex stage that places the mesh and does nothing else: for targets of depth alone.
///
/// # Errors
/// When no rules yield a position.
pub(crate) fn outline(facts: &Facts) -> Result<Plan, PlanError> {
    let plan = Plan::search(&raster(facts), &["clip"], &[], &[])?;
    Ok(Plan { wgsl: plan.vertex_module("@invariant "), ..plan })
}

/// The draws that leave the fields of `places`.
///
/// # Errors
/// When no rules yield one of them.
pub(super) fn draws(facts: &Facts, places: &Places) -> Result<Vec<Draw>, PlanError> {
    let facts = raster(facts);
    let mut sets: Vec<Vec<Field>> = Vec::new();
    for (name, row, size) in places.fields() {
        let used = |set: &Vec<Field>| set.iter().map(|field| field.size).sum::<usize>();
        let at = sets.iter().position(|set| used(set) + size <= MOST_NUMBERS).unwrap_or_else(|| {
            sets.push(Vec::new());
            sets.len() - 1
        });
        let number = used(&sets[at]);
        sets[at].push(Field { name, size, row, number });
    }
    sets.into_iter().map(|fields| Draw::new(&facts, fields)).collect()
}

/// Fragments of the rasteriser, filtered in the shader, and no atlas: what the CPU's samples are.
pub(crate) fn raster(facts: &Facts) -> Facts {
    Facts { source: Source::Raster, output: None, atlas: None, shadows: None, ..*facts }
}

impl Draw {
    fn new(facts: &Facts, fields: Vec<Field>) -> Result<Self, PlanError> {
        let goals: Vec<&'static str> = fields.iter().map(|field| quantity(field.name, facts)).collect();
        let plan = Plan::search(facts, &["clip"], &goals, &[])?;
        let mut wgsl = plan.vertex_module("@invariant ");
        let numbers: Vec<String> =
            fields.iter().zip(&goals).flat_map(|(field, goal)| parts(field, goal)).collect();
        let texels: Vec<String> = numbers
            .chunks(CHANNELS)
            .map(|texel| {
                let filled = texel.iter().map(String::as_str).chain(std::iter::repeat("0.0"));
                format!("vec4f({})", filled.take(CHANNELS).collect::<Vec<_>>().join(", "))
            })
            .collect();
        wgsl.push_str("\nstruct Surface {\n");
        for i in 0..texels.len() {
            let _ = writeln!(wgsl, "    @location({i}) texel{i}: vec4f,");
        }
        wgsl.push_str("}\n\n@fragment\nfn fs_main(at: Varyings) -> Surface {\n");
        wgsl.push_str(&plan.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
        let _ = write!(wgsl, "    return Surface({});\n}}\n", texels.join(", "));
        Ok(Self { plan: Plan { wgsl, ..plan }, fields })
    }

    /// Targets of four numbers that it draws into.
    pub(super) fn targets(&self) -> usize {
        self.fields.iter().map(|field| field.size).sum::<usize>().div_ceil(CHANNELS)
    }

    /// The shader that takes the targets' numbers to records of `rows` rows, a slot a thread; its entry point is
    /// `cs_main`, in workgroups of [`WORKGROUP`]. With `share`, it puts samples' shares in that row, too.
    ///
    /// Bindings of group 0: the count of slots and the targets' width (`vec4u`); for each slot its texel (row by
    /// row, or [`ELSEWHERE`]) and the bits of its share; the records; the targets.
    pub(super) fn gather(&self, rows: usize, share: Option<usize>) -> String {
        let mut wgsl = String::from(
            "@group(0) @binding(0) var<uniform> counts: vec4u;\n\
             @group(0) @binding(1) var<storage, read> sources: array<vec2u>;\n\
             @group(0) @binding(2) var<storage, read_write> records: array<f32>;\n",
        );
        for i in 0..self.targets() {
            let _ = writeln!(wgsl, "@group(0) @binding({}) var target{i}: texture_2d<f32>;", 3 + i);
        }
        let _ = write!(
            wgsl,
            "\n@compute @workgroup_size({WORKGROUP})\nfn cs_main(\n    @builtin(global_invocation_id) id: vec3u,\n    @builtin(num_workgroups) workgroups: vec3u,\n) {{\n\
             \x20   for (var i = id.x; i < counts.x; i += {WORKGROUP}u * workgroups.x) {{\n\
             \x20       let source = sources[i];\n        if (source.x == {ELSEWHERE}u) {{\n            continue;\n        }}\n\
             \x20       let place = vec2u(source.x % counts.y, source.x / counts.y);\n\
             \x20       let record = i / {LANES}u;\n        let lane = i % {LANES}u;\n"
        );
        let stored = StoredRecords { name: "records", rows };
        for i in 0..self.targets() {
            let _ = writeln!(wgsl, "        let texel{i} = textureLoad(target{i}, place, 0);");
        }
        for field in &self.fields {
            for k in 0..field.size {
                let (texel, channel) = ((field.number + k) / CHANNELS, (field.number + k) % CHANNELS);
                let _ = writeln!(
                    wgsl,
                    "        {} = texel{texel}[{channel}];",
                    stored.number("record", field.row + k)
                );
            }
        }
        if let Some(row) = share {
            let _ = writeln!(wgsl, "        {} = bitcast<f32>(source.y);", stored.number("record", row));
        }
        wgsl.push_str("    }\n}\n");
        wgsl
    }
}

/// The quantity that a field holds: where no normal map bends the shading normal, its base is the whole of it.
fn quantity(field: &'static str, facts: &Facts) -> &'static str {
    if field == "base" && facts.holds("bumped") != Some(true) { "n" } else { field }
}

/// The numbers of a quantity, one by one.
fn parts(field: &Field, goal: &str) -> Vec<String> {
    match field.size {
        1 => vec![goal.to_owned()],
        size => ["x", "y", "z"][..size].iter().map(|c| format!("{goal}.{c}")).collect(),
    }
}

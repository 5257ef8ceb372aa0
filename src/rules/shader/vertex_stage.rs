//! The vertex stage as a compute shader: what it hands over of each vertex stands in a buffer, number by number, and what a
//! point of a triangle is handed is a mean of its corners'.

use std::fmt::Write as _;

use super::domain::Domain;
use super::emit::Plan;
use super::module::uniform;
use super::quantity::Attribute;

/// Threads of a workgroup of `cs_vertices`.
pub const VERTICES: u32 = 64;

/// Where a triangle's numbers stand in the buffer `varyings`, [`Plan::stride`] of them a vertex, and means of these: the
/// triangles' vertices are in `corners`, and `STRIDE` is a constant.
pub(super) const CORNERS: &str = include_str!("corners.wgsl");

/// Whether a vertex' place in clip space is handed over, before all else.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Clip {
    /// It is.
    Handed,
    /// It is left out.
    Left,
}

impl Plan {
    /// Numbers that are handed over of a vertex.
    #[must_use]
    pub fn stride(&self, clip: Clip) -> usize {
        self.handed(clip).map(|(_, kind)| numbers(kind)).sum()
    }

    /// What is handed over, with WGSL types.
    fn handed(&self, clip: Clip) -> impl Iterator<Item = (&'static str, &'static str)> {
        let clip = (clip == Clip::Handed).then_some(("clip", "vec4f"));
        clip.into_iter().chain(self.varyings.iter().copied())
    }

    /// Of what is interpolated, each with its WGSL type and its first number's place.
    pub(super) fn places(&self, clip: Clip) -> Vec<(&'static str, &'static str, usize)> {
        let first = if clip == Clip::Handed { 4 } else { 0 };
        let places = self.varyings.iter().scan(first, |next, (name, kind)| {
            let place = *next;
            *next += numbers(kind);
            Some((*name, *kind, place))
        });
        places.collect()
    }

    /// The structure of what is handed over.
    pub(super) fn varyings_struct(&self, clip: Clip) -> String {
        let members: String =
            self.handed(clip).map(|(name, kind)| format!("    {name}: {kind},\n")).collect();
        format!("struct Varyings {{\n{members}}}\n")
    }

    /// `cs_vertices`, a thread for each vertex, after the plan's bindings and functions. Group 1 holds the attributes, one
    /// after another in the plan's order, and what is handed over of each vertex.
    pub(super) fn vertex_stage(&self, clip: Clip) -> String {
        let stride = self.stride(clip);
        let mut wgsl = String::from("\nstruct Vertex {\n    vertex_index: u32,\n");
        for attribute in &self.attributes {
            let _ = writeln!(wgsl, "    {}: {},", attribute.name(), attribute.wgsl());
        }
        let varyings = self.varyings_struct(clip);
        let calls = self.calls(Domain::Vertex, uniform, |name| format!("vertex.{name}"));
        let names = self.handed(clip).map(|(name, _)| name).collect::<Vec<_>>().join(", ");
        let _ = write!(
            wgsl,
            "}}\n\n{varyings}\nfn handed_over(vertex: Vertex) -> Varyings {{\n{calls}    return Varyings({names});\n}}\n\n\
             @group(1) @binding(0) var<storage, read> attributes: array<u32>;\n\
             @group(1) @binding(1) var<storage, read_write> varyings: array<f32>;\n\n\
             @compute @workgroup_size({VERTICES})\n\
             fn cs_vertices(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {{\n    \
             let count = arrayLength(&varyings) / {stride}u;\n    \
             let i = id.x + {VERTICES}u * groups.x * id.y;\n    if (i >= count) {{\n        return;\n    }}\n    \
             let at = handed_over(Vertex(i"
        );
        let mut first = 0;
        for attribute in &self.attributes {
            let _ = write!(wgsl, ", {}", read(*attribute, first));
            first += attribute.bytes() / 4;
        }
        let _ = write!(wgsl, "));\n    let first = {stride}u * i;\n");
        let mut place = 0;
        for (name, kind) in self.handed(clip) {
            for k in 0..numbers(kind) {
                let part = if numbers(kind) == 1 { String::new() } else { format!("[{k}]") };
                let _ = writeln!(wgsl, "    varyings[first + {place}u] = at.{name}{part};");
                place += 1;
            }
        }
        wgsl.push_str("}\n");
        wgsl
    }
}

/// A value of the corners' numbers from that place on, `shares` (a name) being what each corner counts.
pub(super) fn means(kind: &str, place: usize, shares: &str) -> String {
    let mean = |k| format!("mean_of_corners(first, {}u, {shares})", place + k);
    let parts = (0..numbers(kind)).map(mean).collect::<Vec<_>>().join(", ");
    if numbers(kind) == 1 { parts } else { format!("{kind}({parts})") }
}

/// An attribute of vertex `i`, where all vertices' numbers of those before it, `first` each, come first.
fn read(attribute: Attribute, first: u64) -> String {
    let kind = attribute.wgsl();
    let count = attribute.bytes() / 4;
    let number = |k| {
        let word = format!("attributes[{first}u * count + {count}u * i + {k}u]");
        if kind.ends_with('u') || kind == "u32" { word } else { format!("bitcast<f32>({word})") }
    };
    let parts = (0..count).map(number).collect::<Vec<_>>().join(", ");
    if count == 1 { parts } else { format!("{kind}({parts})") }
}

/// Numbers of a WGSL type.
fn numbers(kind: &str) -> usize {
    match kind {
        "f32" => 1,
        "vec2f" => 2,
        "vec3f" => 3,
        _ => 4,
    }
}

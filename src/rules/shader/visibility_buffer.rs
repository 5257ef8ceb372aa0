//! A plan's modules where a compute shader shades: the rasteriser leaves which triangle each sample shows, and what its
//! corners hand over is interpolated there (Burns and Hunt 2013, "The Visibility Buffer: A Cache-Friendly Approach to
//! Deferred Shading"). A sample is shaded once, whatever was drawn behind it and however small its triangle is.

use std::fmt::Write as _;

use super::domain::{Domain, UV};
use super::emit::{Plan, hazy};
use super::vertex_stage::{CORNERS, Clip, means};

/// Samples along the sides of a workgroup of `cs_shade`; `place_in_tile` knows of eight.
pub const TILE: u32 = 8;

/// What takes steps between neighbouring fragments, or leaves one out: a compute shader knows none.
pub(super) const BETWEEN_FRAGMENTS: [&str; 7] =
    ["dpdx", "dpdy", "fwidth", "textureSample(", "textureSampleBias(", "textureSampleCompare(", "discard"];
/// What fragments are handed of texture coordinates, in rules and out of them.
const COORDINATES: [&str; 2] = ["vertex_uv", "at.vertex_uv"];

/// The modules, in the order in which they run. Bindings of group 0 are the plan's.
#[derive(Clone, Debug)]
pub struct VisibilityBuffer {
    /// `cs_vertices`, a thread for each vertex: group 1 holds the attributes, one after another in the plan's order, and
    /// what is handed over of each vertex, [`stride`](Self::stride) numbers, its place in clip space first.
    pub vertices: String,
    /// `vs_main` and `fs_main`, over as many vertices as there are indices: group 0 holds what was handed over and the
    /// indices; the target takes each sample's triangle, counted from 1.
    pub triangles: String,
    /// `cs_shade`, a thread for each sample: group 1 holds what was handed over, the indices, the triangles, the size of
    /// what was drawn, and the targets: colour, and coverage where colour's alpha is the haze.
    pub shading: String,
    /// Numbers of a vertex.
    pub stride: usize,
}

impl Plan {
    /// The modules for a colour target of that format (`rgba16float`, say); `None` where a fragment takes other steps to
    /// its neighbours than those of texture coordinates.
    #[must_use]
    pub fn visibility_buffer(&self, color: &str) -> Option<VisibilityBuffer> {
        let fragments = without_neighbours(&self.functions(&[Domain::Fragment]));
        if BETWEEN_FRAGMENTS.iter().any(|function| fragments.contains(function)) {
            return None;
        }
        let stride = self.stride(Clip::Handed);
        Some(VisibilityBuffer {
            vertices: self.vertices_module(),
            triangles: triangles_module(stride),
            shading: self.shading_module(stride, color),
            stride,
        })
    }

    fn vertices_module(&self) -> String {
        self.bindings(true) + &self.functions(&[Domain::Vertex]) + &self.vertex_stage(Clip::Handed)
    }

    fn shading_module(&self, stride: usize, color: &str) -> String {
        let mut wgsl = self.bindings(true) + &self.functions(&[Domain::Fragment]);
        if self.takes_steps() {
            wgsl.push_str(
                "\n// How far the sample's texture coordinates go to the one on the right (xy) and to the one below (zw).\n\
                 var<private> uv_steps_here: vec4f;\n",
            );
        }
        let _ = write!(wgsl, "\n{}", self.varyings_struct(Clip::Handed));
        wgsl.push_str(&self.fragment_function("fn shaded", ["", ""]));
        let _ = write!(
            wgsl,
            "\nconst STRIDE = {stride}u;\n\
             @group(1) @binding(0) var<storage, read> varyings: array<f32>;\n\
             @group(1) @binding(1) var<storage, read> corners: array<u32>;\n\
             @group(1) @binding(2) var triangles: texture_2d<u32>;\n\
             // Samples across and down.\n\
             @group(1) @binding(3) var<uniform> drawn: vec4u;\n\
             @group(1) @binding(4) var colors: texture_storage_2d<{color}, write>;\n"
        );
        if hazy(&self.facts) {
            wgsl.push_str("@group(1) @binding(5) var coverages: texture_storage_2d<r32float, write>;\n");
        }
        wgsl.push_str(CORNERS);
        wgsl.push_str(include_str!("visibility_buffer.wgsl"));
        wgsl.push_str(&self.interpolation());
        let (empty, stores) = if hazy(&self.facts) {
            (
                "textureStore(coverages, place, vec4f(0.0));",
                "    textureStore(colors, place, fragment.color);\n    \
                 textureStore(coverages, place, vec4f(fragment.coverage));\n",
            )
        } else {
            ("", "    textureStore(colors, place, fragment);\n")
        };
        let _ = write!(
            wgsl,
            "\n@compute @workgroup_size({})\n\
             fn cs_shade(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) i: u32) {{\n    \
             let place = {TILE}u * tile.xy + place_in_tile(i);\n    \
             if (any(place >= drawn.xy)) {{\n        return;\n    }}\n    \
             let triangle = textureLoad(triangles, place, 0).r;\n    if (triangle == 0u) {{\n        \
             textureStore(colors, place, vec4f(0.0));\n        {empty}\n        return;\n    }}\n    \
             let fragment = shaded(interpolated(triangle - 1u, vec2f(place) + 0.5));\n{stores}}}\n",
            TILE * TILE
        );
        without_neighbours(&wgsl)
    }

    /// `interpolated(triangle, at)`: what a sample is handed.
    fn interpolation(&self) -> String {
        let mut wgsl = String::from(
            "\nfn interpolated(triangle: u32, at: vec2f) -> Varyings {\n    let first = first_numbers(triangle);\n    \
             let areas = areas_of_corners(first, at);\n    let shares = shares_of(areas);\n",
        );
        let places = self.places(Clip::Handed);
        let uv = places.iter().find(|(name, ..)| *name == UV).filter(|_| self.takes_steps());
        if let Some(&(_, kind, place)) = uv {
            let of = |shares: &str| means(kind, place, shares);
            let _ = write!(
                wgsl,
                "    let along = step_of(areas, areas_of_corners(first, at + vec2f(1.0, 0.0)));\n    \
                 let down = step_of(areas, areas_of_corners(first, at + vec2f(0.0, 1.0)));\n    \
                 uv_steps_here = vec4f({}, {});\n",
                of("along"),
                of("down")
            );
        }
        wgsl.push_str("    return Varyings(\n        vec4f(at, 0.0, 1.0),\n");
        for (_, kind, place) in places {
            let _ = writeln!(wgsl, "        {},", means(kind, place, "shares"));
        }
        wgsl.push_str("    );\n}\n");
        wgsl
    }

    /// Whether fragments take steps of their texture coordinates.
    fn takes_steps(&self) -> bool {
        let body = self.fragment_function("fn shaded", ["", ""]);
        takes_map_steps(&(self.functions(&[Domain::Fragment]) + &body))
    }
}

/// Whether a text takes steps of the texture coordinates that maps are looked up by.
pub(super) fn takes_map_steps(wgsl: &str) -> bool {
    without_neighbours(wgsl) != wgsl
}

/// A text of fragments that take the steps of texture coordinates from their triangle, not from their neighbours.
fn without_neighbours(wgsl: &str) -> String {
    with_steps(wgsl, ["uv_steps_here.xy", "uv_steps_here.zw"])
}

/// A text in which what is read by the steps of texture coordinates, along x and along y, is told these.
pub(super) fn with_steps(wgsl: &str, [along, down]: [&str; 2]) -> String {
    let mut calls = wgsl.split("textureSample(");
    let mut text = calls.next().unwrap_or_default().to_owned();
    for call in calls {
        let (arguments, rest) = call.split_at(call.find(')').unwrap_or(call.len()));
        if COORDINATES.iter().any(|uv| arguments.ends_with(&format!(", map_sampler, {uv}"))) {
            let _ = write!(text, "textureSampleGrad({arguments}, {along}, {down}{rest}");
        } else {
            let _ = write!(text, "textureSample({call}");
        }
    }
    for uv in COORDINATES {
        text = text.replace(&format!("dpdx({uv})"), along).replace(&format!("dpdy({uv})"), down);
    }
    text
}

/// The rasteriser's module.
fn triangles_module(stride: usize) -> String {
    format!(
        "@group(0) @binding(0) var<storage, read> varyings: array<f32>;\n\
         @group(0) @binding(1) var<storage, read> corners: array<u32>;\n\n\
         struct Corner {{\n    @builtin(position) clip: vec4f,\n    @location(0) @interpolate(flat) triangle: u32,\n}}\n\n\
         @vertex\nfn vs_main(@builtin(vertex_index) i: u32) -> Corner {{\n    let first = {stride}u * corners[i];\n    \
         let clip = vec4f(varyings[first], varyings[first + 1u], varyings[first + 2u], varyings[first + 3u]);\n    \
         return Corner(clip, i / 3u + 1u);\n}}\n\n\
         @fragment\nfn fs_main(at: Corner) -> @location(0) u32 {{\n    return at.triangle;\n}}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_texture_coordinates_are_the_triangles_and_others_are_left() {
        for (fragments, computed) in [
            ("dpdx(vertex_uv) + dpdy(at.vertex_uv)", "uv_steps_here.xy + uv_steps_here.zw"),
            (
                "textureSample(color_map, map_sampler, at.vertex_uv).rgb",
                "textureSampleGrad(color_map, map_sampler, at.vertex_uv, uv_steps_here.xy, uv_steps_here.zw).rgb",
            ),
            ("textureSampleLevel(color_map, map_sampler, vertex_uv, 0.0)", ""),
            ("textureSample(color_map, map_sampler, 2.0 * vertex_uv)", ""),
            ("dpdx(vertex_normal)", ""),
        ] {
            let want = if computed.is_empty() { fragments } else { computed };
            assert_eq!(without_neighbours(fragments), want);
        }
    }
}

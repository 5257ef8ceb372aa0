//! The WGSL of passes over the atlas, texel by texel: draws, what neighbours say, empty texels that are filled; and lookups.
//!
//! Beside the rasteriser's plans these are compute shaders, a thread for each texel that the mesh covers: group 1 holds the
//! list of these, before it what a draw takes of vertices and triangles, and after it the levels that are left.

use std::fmt::Write as _;

use super::kernel::{TAP, arguments, of_kernel};
use super::{APART, Axis, Level, TEXEL};
use crate::shader::domain::{CHART, Domain, UV};
use crate::shader::emit::Plan;
use crate::shader::facts::{Facts, Source};
use crate::shader::module::{sample_struct, uniform};
use crate::shader::rule::Rule;
use crate::shader::vertex_stage::{CORNERS, Clip, means};
use crate::shader::visibility_buffer::{BETWEEN_FRAGMENTS, takes_map_steps, with_steps};

/// The functions by which fragments look levels up that are textures.
pub(crate) fn sample_level(facts: &Facts) -> String {
    let by = if facts.dilates() { LOOK_UP_DILATED } else { LOOK_UP };
    format!("{}{by}", include_str!("level_texture.wgsl"))
}

/// The functions by which samples look levels up that stand in the buffer `levels`, `SIZE` texels a side.
#[must_use]
pub fn sample_buffered_level(dilated: bool) -> String {
    let by = if dilated { LOOK_UP_DILATED } else { LOOK_UP };
    format!("{}{by}", include_str!("level_buffer.wgsl"))
}

/// Lookups among the texels of a chart, and whatever these are of.
const LOOK_UP: &str = include_str!("level.wgsl");
const LOOK_UP_DILATED: &str = include_str!("level_dilated.wgsl");

/// The head of an entry point, up to a texel's place.
const EACH_TEXEL: &str = include_str!("each_texel.wgsl");
/// How far neighbours lie apart.
const NEIGHBOURS: &str = include_str!("neighbours.wgsl");
/// Empty texels that are filled.
const DILATE: &str = include_str!("dilate.wgsl");

/// How a draw's list says where a texel is, in which triangle, and what the second and third corner count there.
const LISTED: &str = "vec4u";

/// A draw of the mesh into the atlas.
pub(super) fn draw(plan: &Plan, leaves: &[Level]) -> String {
    let targets: Vec<(Level, String)> =
        leaves.iter().map(|level| (level.clone(), level.name.clone())).collect();
    draw_of(plan, "", "", &targets)
}

/// A draw of the mesh into levels, each with its value; `functions` and `lines` follow the plan's own.
pub(super) fn draw_of(plan: &Plan, functions: &str, lines: &str, targets: &[(Level, String)]) -> String {
    if plan.facts.source != Source::Raster {
        return texel_of(plan, functions, lines, targets);
    }
    let stated = plan.declarations(true) + functions;
    let mut wgsl = stated.clone();
    wgsl.push_str(&plan.vertex_stage(Clip::Left));
    let _ = write!(
        wgsl,
        "\nconst STRIDE = {}u;\n@group(1) @binding(2) var<storage, read> corners: array<u32>;\n",
        plan.stride(Clip::Left)
    );
    wgsl.push_str(&listed(3, LISTED, targets.len()));
    wgsl.push_str(CORNERS);
    let steps = steps(plan, &stated);
    for (name, kind) in steps.iter().flat_map(|step| step.names().map(|name| (name, step.kind))) {
        let _ = writeln!(wgsl, "var<private> {name}: {kind};");
    }
    if !steps.is_empty() {
        wgsl.push_str(&share_steps(plan));
    }
    let _ = write!(
        wgsl,
        "\n{EACH_TEXEL}    let first = first_numbers(listed.y);\n    \
         let second_and_third = vec2f(bitcast<f32>(listed.z), bitcast<f32>(listed.w));\n    \
         let shares = vec3f(1.0 - second_and_third.x - second_and_third.y, second_and_third);\n"
    );
    wgsl.push_str(&steps_set(&steps));
    let handed = plan.places(Clip::Left).into_iter().map(|(_, kind, place)| means(kind, place, "shares"));
    let _ = writeln!(wgsl, "    let at = Varyings({});", handed.collect::<Vec<_>>().join(", "));
    // A block of their own: what rules give may be called like anything before.
    wgsl.push_str("    {\n");
    wgsl.push_str(&reads(&plan.levels, "here"));
    wgsl.push_str(&plan.calls(Domain::Texel, uniform, |name| format!("at.{name}")));
    wgsl.push_str(lines);
    for (i, (level, value)) in targets.iter().enumerate() {
        let value = texel(level, value, &format!("round(at.{CHART})"));
        let _ = writeln!(wgsl, "    textureStore(left_{i}_level, here, {value});");
    }
    wgsl.push_str("    }\n}\n");
    with_triangles_steps(&wgsl, plan, &steps)
}

/// The list of texels and the levels that are left, from that binding of group 1 on.
fn listed(first: usize, kind: &str, leaves: usize) -> String {
    let mut wgsl = format!("@group(1) @binding({first}) var<storage, read> texels: array<{kind}>;\n");
    for i in 0..leaves {
        let _ = writeln!(
            wgsl,
            "@group(1) @binding({}) var left_{i}_level: texture_storage_2d<rgba32float, write>;",
            first + 1 + i
        );
    }
    wgsl
}

/// What rules take the steps of (`dpdx`, `dpdy`) that vertices hand over. A compute shader knows no neighbours, but what the
/// triangle's corners say; that is exact.
struct Steps {
    name: &'static str,
    kind: &'static str,
    /// Its first number's place.
    place: usize,
}

impl Steps {
    /// What holds the steps along u and along v.
    fn names(&self) -> [String; 2] {
        [format!("{}_along_u", self.name), format!("{}_along_v", self.name)]
    }
}

fn steps(plan: &Plan, wgsl: &str) -> Vec<Steps> {
    let taken = |name: &str| match name {
        // In the atlas that they lay out, texture coordinates go on by a texel.
        UV => plan.facts.atlas_uv() != UV && takes_map_steps(wgsl),
        name => ["dpdx", "dpdy"].iter().any(|call| wgsl.contains(&format!("{call}({name})"))),
    };
    let stepped = plan.places(Clip::Left).into_iter().filter(|(name, ..)| taken(name));
    stepped.map(|(name, kind, place)| Steps { name, kind, place }).collect()
}

/// Whether rules of texels take steps to neighbours, which follow from where the corners lie in the atlas.
pub(super) fn takes_steps(plan: &Plan) -> bool {
    let functions = plan.functions(&[Domain::Texel]);
    let of_maps = plan.facts.atlas_uv() != UV && takes_map_steps(&functions);
    of_maps || functions.contains("dpdx(") || functions.contains("dpdy(")
}

/// Whether a draw is left with steps that the triangle does not tell.
pub(super) fn is_between_texels(wgsl: &str) -> bool {
    BETWEEN_FRAGMENTS.iter().any(|function| wgsl.contains(function))
}

/// How the corners' shares go on to the next texel along u, and along v.
fn share_steps(plan: &Plan) -> String {
    let mut places = plan.places(Clip::Left).into_iter();
    let uv = places.find(|(name, ..)| *name == plan.facts.atlas_uv()).map_or(0, |(.., place)| place);
    format!(
        "\nfn corner_in_texels(first: u32) -> vec2f {{\n    \
         return {}.0 * vec2f(varyings[first + {uv}u], varyings[first + {uv}u + 1u]);\n}}\n\n\
         fn share_steps(first: vec3u) -> array<vec3f, 2> {{\n    \
         let a = corner_in_texels(first.x);\n    \
         let b = corner_in_texels(first.y) - a;\n    \
         let c = corner_in_texels(first.z) - a;\n    \
         let area = b.x * c.y - b.y * c.x;\n    \
         let along = vec2f(c.y, -b.y) / area;\n    \
         let down = vec2f(-c.x, b.x) / area;\n    \
         return array<vec3f, 2>(vec3f(-along.x - along.y, along), vec3f(-down.x - down.y, down));\n}}\n",
        size(plan)
    )
}

/// The lines that set what [`Steps`] are held in.
fn steps_set(steps: &[Steps]) -> String {
    let mut wgsl = String::new();
    if !steps.is_empty() {
        wgsl.push_str(
            "    let next = share_steps(first);\n    let along = next[0];\n    let down = next[1];\n",
        );
    }
    for step in steps {
        for (name, shares) in step.names().iter().zip(["along", "down"]) {
            let _ = writeln!(wgsl, "    {name} = {};", means(step.kind, step.place, shares));
        }
    }
    wgsl
}

/// A text that takes steps from what [`steps_set`] has set; those of texture coordinates that lay the atlas out are a
/// texel's.
fn with_triangles_steps(wgsl: &str, plan: &Plan, steps: &[Steps]) -> String {
    let one = format!("1.0 / {}.0", size(plan));
    let of_texel = || [format!("vec2f({one}, 0.0)"), format!("vec2f(0.0, {one})")];
    let of_maps = steps.iter().find(|step| step.name == UV);
    let [along, down] = of_maps.map_or_else(of_texel, Steps::names);
    let mut text = with_steps(wgsl, [&along, &down]);
    for step in steps {
        let [along, down] = step.names();
        text = text.replace(&format!("dpdx({})", step.name), &along);
        text = text.replace(&format!("dpdy({})", step.name), &down);
    }
    text
}

/// Texels along the atlas' side.
fn size(plan: &Plan) -> u32 {
    plan.facts.atlas.unwrap_or(1)
}

/// The same of a stored texel.
fn texel_of(plan: &Plan, functions: &str, lines: &str, targets: &[(Level, String)]) -> String {
    let varyings = plan.varyings.iter().map(|&(name, kind)| (name.to_owned(), kind));
    let levels = plan.levels.iter().map(|level| (level.name.clone(), level.kind));
    let fields: Vec<(String, &str)> = varyings.chain(levels).collect();
    let mut wgsl = format!("{}{functions}{}", plan.declarations(true), sample_struct(&fields));
    wgsl.push_str("\nstruct Texel {\n");
    for (level, _) in targets {
        let _ = writeln!(wgsl, "    {}: {},", level.name, level.kind);
    }
    let _ = writeln!(wgsl, "}}\n\nfn {TEXEL}(at: Sample) -> Texel {{");
    wgsl.push_str(&stored(&plan.levels));
    wgsl.push_str(&plan.calls(Domain::Texel, uniform, |name| format!("at.{name}")));
    wgsl.push_str(lines);
    let values: Vec<&str> = targets.iter().map(|(_, value)| value.as_str()).collect();
    let _ = write!(wgsl, "    return Texel({});\n}}\n", values.join(", "));
    wgsl
}

/// A texel of a chart that holds a value of a level's type.
pub(super) fn texel(level: &Level, value: &str, chart: &str) -> String {
    match level.kind {
        "f32" => format!("vec4f({value}, 0.0, 0.0, {chart})"),
        "vec2f" => format!("vec4f({value}, 0.0, {chart})"),
        _ => format!("vec4f({value}, {chart})"),
    }
}

/// Levels' quantities at a texel.
pub(super) fn reads(levels: &[Level], place: &str) -> String {
    let read = |level: &Level| {
        let (bound, swizzle) = (level.bound(), level.swizzle());
        format!("    let {}: {} = textureLoad({bound}, {place}, 0).{swizzle};\n", level.name, level.kind)
    };
    levels.iter().map(read).collect()
}

/// What fragments look up: which texels count is the same of all levels.
pub(crate) fn sampled(facts: &Facts, levels: &[Level]) -> String {
    let Some(first) = levels.first() else { return String::new() };
    let uv = facts.atlas_uv();
    let (before, by) = if facts.dilates() {
        (String::new(), format!("at.{uv}"))
    } else {
        let corners = format!("level_corners({}, at.{uv}, round(at.{CHART}))", first.bound());
        (format!("    let corners = {corners};\n"), "corners".to_owned())
    };
    let read = |level: &Level| {
        let (bound, swizzle, name) = (level.bound(), level.swizzle(), level.quantity());
        format!("    let {name}: {} = level_at({bound}, {by}).{swizzle};\n", level.kind)
    };
    std::iter::once(before).chain(levels.iter().map(read)).collect()
}

/// A level, its empty texels filled.
pub(super) fn dilate(plan: &Plan, source: &Level) -> String {
    let filled = DILATE.replace("{source}", &source.bound());
    format!(
        "{}{}{filled}\n{EACH_TEXEL}    textureStore(left_0_level, here, dilated(here));\n}}\n",
        plan.declarations(true),
        listed(0, LISTED, 1)
    )
}

/// The lines that read levels' quantities of the fields of a stored sample or texel, `at`.
#[must_use]
pub fn stored(levels: &[Level]) -> String {
    levels.iter().map(|Level { name, kind }| format!("    let {name}: {kind} = at.{name};\n")).collect()
}

/// A pass over neighbours.
pub(super) fn neighbours(plan: &Plan, rule: &Rule, source: &Level) -> String {
    let value = format!("{}({})", rule.function, arguments(rule, Axis::U, TAP, uniform).join(", "));
    if plan.facts.source == Source::Raster {
        let leaf = Level { name: rule.gives[0].0.to_owned(), kind: rule.returns };
        let body = NEIGHBOURS
            .replace("{source}", &source.bound())
            .replace("{reads}", &reads(&of_kernel(plan, rule), "here"))
            .replace("{value}", &texel(&leaf, &value, "middle.w"));
        let declared = plan.declarations(true) + &listed(0, LISTED, 1);
        return format!("{declared}\n{EACH_TEXEL}{body}");
    }
    let mut fields: Vec<(String, &str)> =
        of_kernel(plan, rule).iter().map(|level| (level.name.clone(), level.kind)).collect();
    fields.push(("apart".to_owned(), "vec2f"));
    let mut wgsl = format!("{}{}", plan.declarations(true), sample_struct(&fields));
    let _ = writeln!(wgsl, "\nfn {APART}(at: Sample) -> {} {{", rule.returns);
    wgsl.push_str(&stored(&of_kernel(plan, rule)));
    let _ = write!(wgsl, "    let apart: vec2f = at.apart;\n    return {value};\n}}\n");
    wgsl
}

//! Passes and lookups as functions of a texel's place, to be built into another engine: what it draws in texture space, what
//! it runs over a whole image, and what its last pass looks up.
//!
//! Beside the rasteriser's own compute shaders these are plain: no workgroup, no list of texels, a function for each level.
//! `near`, `lookup`: texels of a level; `blur`, `neighbours`, `dilate`: passes over one.

use std::fmt::Write as _;

use super::kernel::{Loop, TAP, arguments, of_kernel, taps};
use super::text::{reads, texel};
use super::{Axis, Level, Pass, PassKind};
use crate::shader::domain::{CHART, Domain};
use crate::shader::emit::Plan;
use crate::shader::module::literal_name;
use crate::shader::quantity::Constant;
use crate::shader::rule::Rule;

const NEAR: &str = include_str!("near.wgsl");
const LOOK_UP: &str = include_str!("lookup.wgsl");
const LOOK_UP_DILATED: &str = include_str!("lookup_dilated.wgsl");
const BLUR: &str = include_str!("blur.wgsl");
const NEIGHBOURS: &str = include_str!("neighbours.wgsl");
const DILATE: &str = include_str!("dilate.wgsl");

/// The name of the function that gives a level's texels.
#[must_use]
pub fn pass_function(level: &Level) -> String {
    format!("{}_pass", level.name)
}

impl Plan {
    /// Every level that a pass reads or leaves, each once, in the passes' order.
    #[must_use]
    pub fn all_levels(&self) -> Vec<Level> {
        let mut all: Vec<Level> = Vec::new();
        for level in self.passes.iter().flat_map(|pass| pass.plan.levels.iter().chain(&pass.leaves)) {
            if !all.contains(level) {
                all.push(level.clone());
            }
        }
        all
    }

    /// What a draw in texture space hands over: world space, interpolated.
    #[must_use]
    pub fn texel_surface(&self) -> Vec<(&'static str, &'static str)> {
        let mut fields: Vec<(&'static str, &'static str)> = Vec::new();
        let draws = self.passes.iter().filter(|pass| pass.kind == PassKind::Draw);
        for &field in draws.flat_map(|pass| &pass.plan.varyings) {
            if !fields.contains(&field) {
                fields.push(field);
            }
        }
        fields
    }

    /// The passes, and what they and fragments read of levels; nothing where nothing is computed in texels.
    pub(in crate::shader) fn pass_functions(&self) -> String {
        let mut wgsl = String::new();
        let fields = self.texel_surface();
        if !fields.is_empty() {
            wgsl.push_str(
                "\n// What a draw in texture space hands over: world space, interpolated.\nstruct Texel {\n",
            );
            for (name, kind) in fields {
                let _ = writeln!(wgsl, "    {name}: {kind},");
            }
            wgsl.push_str("}\n");
        }
        let size = self.facts.atlas.unwrap_or(1).to_string();
        let filled = |template: &str, level: &Level| {
            template.replace("{level}", &level.bound()).replace("{size}", &size)
        };
        let by_place = |pass: &Pass| pass.kind != PassKind::Draw;
        for level in self.all_levels() {
            let source = |pass: &Pass| by_place(pass) && pass.plan.levels.first() == Some(&level);
            if self.levels.contains(&level) || self.passes.iter().any(source) {
                let _ = write!(wgsl, "\n{}", filled(NEAR, &level));
            }
        }
        let look_up = if self.facts.dilates() { LOOK_UP_DILATED } else { LOOK_UP };
        for level in &self.levels {
            let _ = write!(wgsl, "\n{}", filled(look_up, level));
        }
        for pass in &self.passes {
            for level in &pass.leaves {
                let function = of_pass(pass, level).replace("{size}", &size);
                let _ = write!(wgsl, "\n{function}");
            }
        }
        wgsl
    }

    /// The lines that look levels up where a fragment is.
    pub(in crate::shader) fn looked_up_lines(&self) -> String {
        let chart = if self.facts.dilates() { String::new() } else { format!(", round(at.{CHART})") };
        let uv = self.facts.atlas_uv();
        let line = |level: &Level| {
            let (bound, swizzle, name) = (level.bound(), level.swizzle(), level.quantity());
            format!("    let {name}: {} = {bound}_at(at.{uv}{chart}).{swizzle};\n", level.kind)
        };
        self.levels.iter().map(line).collect()
    }
}

/// The function of a level that a pass leaves.
fn of_pass(pass: &Pass, level: &Level) -> String {
    let plan = &pass.plan;
    let rule = || plan.steps.iter().map(|step| step.rule).find(|rule| rule.blur.is_some());
    let source = plan.levels.first().map(Level::bound).unwrap_or_default();
    let template = match (pass.kind, rule()) {
        (PassKind::Draw, _) => return draw(plan, level),
        (PassKind::Blur(axis), Some(rule)) => blur(plan, rule, axis),
        (PassKind::Neighbours, Some(rule)) => {
            let value = format!("{}({})", rule.function, arguments(rule, Axis::U, TAP, literal).join(", "));
            NEIGHBOURS
                .replace("{reads}", &reads(&of_kernel(plan, rule), "here"))
                .replace("{value}", &texel(level, &value, "middle.w"))
        }
        _ => DILATE.to_owned(),
    };
    template.replace("{name}", &level.name).replace("{source}", &source)
}

/// The rules of texels of what the mesh's vertices hand over.
fn draw(plan: &Plan, level: &Level) -> String {
    let calls = plan.calls(Domain::Texel, literal, |name| format!("at.{name}"));
    format!(
        "// A texel of the mesh as it is drawn in texture space.\nfn {}(at: Texel, here: vec2i) -> vec4f {{\n{}{calls}    \
         return {};\n}}\n",
        pass_function(level),
        reads(&plan.levels, "here"),
        texel(level, &level.name, &format!("round(at.{CHART})"))
    )
}

fn blur(plan: &Plan, rule: &Rule, axis: Axis) -> String {
    let Loop { before, reach, sides, tap, .. } = taps(&plan.facts, rule, axis, literal);
    BLUR.replace("{reads}", &reads(&of_kernel(plan, rule), "here"))
        .replace("{before}", &before)
        .replace("{reach}", &reach)
        .replace("{sides}", &sides.to_string())
        .replace("{kernel}", &tap)
        .replace("{axis}", axis.step())
}

/// A constant stands for itself, and is no member of a block.
fn literal(constant: Constant, _: &str) -> String {
    literal_name(constant)
}

#[cfg(test)]
mod tests {
    use crate::model::effects::{Effects, Form, Silhouette};
    use crate::model::evaluate::Setup;
    use crate::shader::facts::Facts;
    use crate::shader::plan;
    use crate::shader::term::register;

    /// A kernel of constants of any type, of which one's name begins as another's.
    #[test]
    fn constants_of_kernels_stand_in_the_text_whatever_their_type_and_name() {
        let term = register(
            "hazy",
            "\
// effect: hazy, a blur
// parameter: hazy_spread = 1 in [0, 9]; how wide; a test
// parameter: hazy_spread_tint = 1 in [0, 9], rgb; how wide a channel; a test
//
// gives: hazy_light
// domain: texel
// cost: 1
fn hazy_map(albedo: vec3f) -> vec3f {
    return albedo;
}

// gives: hazy_soft
// domain: texel
// pass: hazy_light: vec3f, 3 taps
// sampled: 0
// cost: 4
fn hazy_kernel(tap: f32, hazy_spread: f32, hazy_spread_tint: vec3f) -> vec2f {
    return vec2f(hazy_spread * tap, hazy_spread_tint.y);
}

// gives: hazy_part
// adds: hazy
// cost: 1
fn hazy_shown(hazy_soft: vec3f) -> vec3f {
    return hazy_soft;
}
",
        );
        let setup = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&[term.unwrap().effect]));
        let planned = plan(&Facts { setup, atlas: Some(64), ..Facts::default() }).unwrap();
        let text = planned.function();
        assert!(text.contains("hazy_kernel(f32(i), HAZY_SPREAD, HAZY_SPREAD_TINT)"), "{text}");
        assert!(!text.contains("constants."), "{text}");
    }
}

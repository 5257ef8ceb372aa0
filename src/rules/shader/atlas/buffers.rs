//! Passes over stored texels as compute shaders, whose levels stand in one buffer.
//!
//! The engine on an adapter makes levels so, by the rules' own text: a draw is a function of a stored texel, a blur reads
//! texels of the atlas as the renderer's does, and what moves a level is blurred beside it: which texels count, and what each
//! weighs, is found once for a level and for how it moves along every seed.

use std::fmt::Write as _;

use super::columns::Columns;
use super::kernel::{Loop, TAP, lines_of, of_kernel, taps};
pub use super::layers::Layers;
use super::named::{Named, groups};
use super::{APART, Axis, Level, MovingKernel, PassKind, TEXEL};
use crate::model::diffusion::Lookup;
use crate::shader::emit::Plan;
use crate::shader::module::uniform;
use crate::shader::quantity::Kind;
use crate::shader::search::components;
use crate::shader::tangent::chain::Chain;

const HEAD: &str = include_str!("head_buffers.wgsl");
pub(super) const EACH_TEXEL: &str =
    concat!(include_str!("here_stored.wgsl"), include_str!("each_stored.wgsl"));
const NEIGHBOURS: &str = include_str!("neighbours_stored.wgsl");
const BLUR: &str = include_str!("blur_stored.wgsl");
/// What each texel that a blur reads weighs in its mean, and how that moves.
const WEIGH: &str = include_str!("weigh_stored.wgsl");
const FILL: &str = include_str!("fill_stored.wgsl");

/// What a shader's threads take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// A texel each that the mesh covers, in workgroups of [`TEXELS`](super::TEXELS).
    Texels,
    /// A [tile](super::TILE) of these a workgroup.
    Tiles(Axis),
    /// An empty texel each near those.
    Empty,
}

/// A pass as a compute shader, `cs_main`.
#[derive(Clone, Debug)]
pub struct LevelShader {
    /// Its constants and resources, group 0.
    pub plan: Plan,
    /// What its threads take.
    pub over: Over,
    /// Levels that it reads.
    pub reads: Vec<String>,
    /// Levels that it leaves.
    pub leaves: Vec<String>,
    /// The module. Group 1: levels, covered texels, their records, tiles.
    pub wgsl: String,
}

/// The atlas that shaders are written for: its size, and the records of its texels.
pub struct StoredTexels<'a> {
    /// Texels along a side.
    pub size: u32,
    /// Rows of a record.
    pub rows: usize,
    /// The row of a number; `None` of one that texels do not hold.
    pub row: &'a dyn Fn(&str, usize) -> Option<usize>,
}

/// The shaders that leave what samples look up of an atlas.
#[derive(Clone, Debug, Default)]
pub struct LevelShaders {
    /// In their order.
    pub shaders: Vec<LevelShader>,
    /// Where levels stand.
    pub layers: Layers,
}

impl LevelShaders {
    /// Of plans over stored samples along chains' seeds, the first one's passes and what others have beside; `None` where the
    /// processor alone does a pass.
    #[must_use]
    pub fn new(plans: &[(&Plan, &Chain)], texels: &StoredTexels<'_>) -> Option<Self> {
        let mut all: Vec<Vec<Named<'_>>> = Vec::new();
        let mut looked_up: Vec<String> = Vec::new();
        for (plan, chain) in plans {
            for group in groups(plan, chain) {
                let known =
                    |name: &String| all.iter().flatten().flat_map(Named::leaves).any(|(n, _)| n == *name);
                if !group.iter().flat_map(Named::leaves).all(|(name, _)| known(&name)) {
                    all.push(group);
                }
            }
            looked_up.extend(plan.levels.iter().map(|level| level.name.clone()));
            looked_up.extend(chain.looked_up(plan).into_iter().map(|(name, _)| name));
        }
        let on_adapters = |named: &Named<'_>| {
            let faces = named.pass.plan.resources.iter().all(|resource| resource.kind() == Kind::Faces);
            faces && named.pass.kind != PassKind::Surface
        };
        if !all.iter().flatten().all(on_adapters) {
            return None;
        }
        let layers = Layers::new(&all);
        let text = Text { layers: &layers, texels };
        let mut shaders: Vec<LevelShader> = all.iter().flat_map(|group| text.of_group(group)).collect();
        if plans.iter().any(|(plan, _)| plan.facts.setup.choices.diffusion.lookup == Lookup::Dilated) {
            looked_up.sort();
            looked_up.dedup();
            shaders.extend(plans.first().map(|(plan, _)| text.fill(plan, &looked_up)));
        }
        Some(Self { shaders, layers })
    }
}

/// What is written.
pub(super) struct Text<'a> {
    pub(super) layers: &'a Layers,
    pub(super) texels: &'a StoredTexels<'a>,
}

impl Text<'_> {
    /// The shaders of a pass and of how what it leaves moves.
    fn of_group(&self, group: &[Named<'_>]) -> Vec<LevelShader> {
        match group[0].pass.kind {
            PassKind::Blur(axis) => vec![self.blur(group, axis)],
            _ => group.iter().map(|named| self.each_texel(named)).collect(),
        }
    }

    pub(super) fn head(&self) -> String {
        HEAD.replace("{size}", &self.texels.size.to_string())
    }

    /// Where a level begins in the buffer.
    fn level(&self, name: &str) -> String {
        let place = self.layers.place(name).unwrap_or(0);
        format!("{}u", place * self.texels.size as usize * self.texels.size as usize)
    }

    /// The text of what rules make of a stored texel, and the lines that set what they read of it, `at`: the levels of the plan
    /// but for the first ones, each of which stands by the name that `named` gives it.
    pub(super) fn of_texel(
        &self,
        plan: &Plan,
        wgsl: &str,
        first: usize,
        named: &dyn Fn(&str) -> String,
    ) -> (String, String) {
        let (mut text, mut set) = (wgsl.to_owned(), String::new());
        for &(name, kind) in &plan.varyings {
            for (call, ending) in [("dpdx", "along_u"), ("dpdy", "along_v")] {
                let (taken, held) = (format!("{call}({name})"), format!("{name}_{ending}"));
                if text.contains(&taken) {
                    text = format!("var<private> {held}: {kind};\n") + &text.replace(&taken, &held);
                    let _ = writeln!(set, "    {held} = {};", self.held(&format!("{call}_{name}"), kind));
                }
            }
            let _ = writeln!(set, "    at.{name} = {};", self.held(name, kind));
        }
        let own = plan.levels.iter().skip(first);
        for level in own.filter(|level| text.contains(&format!("    {}: {},", level.name, level.kind))) {
            let _ = writeln!(
                set,
                "    at.{} = level_texel({}, here).{};",
                level.name,
                self.level(&named(&level.name)),
                level.swizzle()
            );
        }
        (text, set)
    }

    /// A draw, or what neighbours say.
    fn each_texel(&self, named: &Named<'_>) -> LevelShader {
        let (pass, plan) = (named.pass, &named.pass.plan);
        let neighbours = pass.kind == PassKind::Neighbours;
        // What is read of neighbours is no number of the texel.
        let (text, set) =
            self.of_texel(plan, &plan.wgsl, usize::from(neighbours), &|level| named.name(level));
        // Extensions are to stand before all else.
        let mut wgsl = text;
        wgsl.push_str(&self.head());
        wgsl.push_str(EACH_TEXEL);
        wgsl.push_str(&set);
        if neighbours {
            let source = self.level(&named.name(&plan.levels[0].name));
            wgsl.push_str(&NEIGHBOURS.replace("{source}", &source));
            let leaf = &pass.leaves[0];
            let value = format!("{APART}(at)");
            wgsl.push_str(&self.left(&named.name(&leaf.name), leaf.kind, &value));
        } else {
            let _ = writeln!(wgsl, "    let texel = {TEXEL}(at);");
            for (name, level) in named.leaves() {
                wgsl.push_str(&self.left(&name, level.kind, &format!("texel.{}", level.name)));
            }
        }
        wgsl.push_str("}\n");
        LevelShader {
            plan: plan.clone(),
            over: Over::Texels,
            reads: plan.levels.iter().map(|level| named.name(&level.name)).collect(),
            leaves: named.leaves().map(|(name, _)| name).collect(),
            wgsl,
        }
    }

    /// A quantity of the `i`-th covered texel; 0 where it is not held.
    fn held(&self, name: &str, kind: &str) -> String {
        let number = |component| match (self.texels.row)(name, component) {
            Some(row) => {
                format!("records[(i / 16u) * {}u + {}u + i % 16u]", 16 * self.texels.rows, 16 * row)
            }
            None => "0.0".to_owned(),
        };
        let numbers: Vec<String> = (0..components(kind)).map(number).collect();
        format!("{kind}({})", numbers.join(", "))
    }

    /// The line that leaves a value of a level's type.
    fn left(&self, name: &str, kind: &str, value: &str) -> String {
        let zeros = ["", "0.0, ", "0.0, 0.0, "][3 - components(kind).min(3)];
        format!("    leave({}, here, vec4f({value}, {zeros}chart));\n", self.level(name))
    }

    /// One direction of a blur of a level, and of how that moves along every seed.
    fn blur(&self, group: &[Named<'_>], axis: Axis) -> LevelShader {
        let (first, tangents) = (&group[0], &group[1..]);
        let plan = &first.pass.plan;
        let (rule, source) = (plan.steps[0].rule, &plan.levels[0]);
        let kernel = taps(&plan.facts, rule, axis, uniform);
        let by_deviation = &kernel.by_deviation;
        let mut columns = Columns { by_deviation: by_deviation.is_some(), ..Columns::default() };
        let mut functions: Vec<&str> = Vec::new();
        let mut reads = vec![source.name.clone()];
        reads.extend(of_kernel(plan, rule).iter().map(|level| level.name.clone()));
        let moves = tangents.iter().any(|named| named.pass.moving.is_some());
        by_deviation.iter().filter(|_| moves).for_each(|slope| columns.share(slope));
        for (k, named) in tangents.iter().enumerate() {
            let moved = match &named.pass.moving {
                Some(MovingKernel { blurred, slope }) => {
                    if !functions.contains(&slope.functions.as_str()) {
                        functions.push(&slope.functions);
                    }
                    reads.extend(slope.levels.iter().map(|level| named.name(&level.name)));
                    let read = |level: &Level| self.read(&named.name(&level.name), level);
                    let levels: String = slope.levels.iter().map(read).collect();
                    columns.mover(k, &levels, &slope.call(rule, axis, TAP));
                    blurred.as_ref()
                }
                None => Some(&named.pass.plan.levels[0]),
            };
            let moved = moved.map(|level| named.name(&level.name));
            if let Some(moved) = &moved {
                columns.blurred(k, &self.level(moved));
            }
            reads.extend(moved.clone());
            let leaf = self.level(&named.name(&named.pass.leaves[0].name));
            columns.left(k, &leaf, moved.is_some(), named.pass.moving.is_some());
        }
        let leaf = self.level(&first.pass.leaves[0].name);
        let value = format!("    leave({leaf}, here, vec4f(middle.xyz + mean, middle.w));\n");
        let [_, own] = lines_of(axis);
        let body = BLUR
            .replace("{own}", own)
            .replace("{across}", axis.across().step())
            .replace("{leaves}", &(value + &columns.leaves));
        let body = self.of_blur(&body, plan, axis, &kernel, &columns);
        let wgsl = plan.declarations(true) + &functions.concat() + &self.head() + &body;
        let leaves = group.iter().flat_map(Named::leaves).map(|(name, _)| name).collect();
        LevelShader { plan: plan.clone(), over: Over::Tiles(axis), reads, leaves, wgsl }
    }

    /// A blur's text with what its plan, its loop over taps and what moves say.
    pub(super) fn of_blur(
        &self,
        text: &str,
        plan: &Plan,
        axis: Axis,
        kernel: &Loop,
        columns: &Columns,
    ) -> String {
        let levels = of_kernel(plan, plan.steps[0].rule);
        let reads: String = levels.iter().map(|level| self.read(&level.name, level)).collect();
        text.replace("{weigh}", WEIGH)
            .replace("{axis}", axis.step())
            .replace("{source}", &self.level(&plan.levels[0].name))
            .replace("{reads}", &format!("    let size = vec2i(SIZE);\n{reads}"))
            .replace("{before}", &format!("{}{}", kernel.before, columns.before))
            .replace("{sums}", &columns.sums)
            .replace("{reach}", &kernel.reach)
            .replace("{kernel}", &kernel.tap)
            .replace("{slopes}", &columns.slopes)
            .replace("{sides}", &kernel.sides.to_string())
            .replace("{adds}", &columns.adds)
    }

    /// The line that reads a level's quantity at a texel.
    fn read(&self, name: &str, level: &Level) -> String {
        let (place, swizzle) = (self.level(name), level.swizzle());
        format!("    let {}: {} = level_texel({place}, here).{swizzle};\n", level.name, level.kind)
    }

    /// Empty texels of what lookups by one fetch read.
    fn fill(&self, plan: &Plan, levels: &[String]) -> LevelShader {
        let leave = |name: &String| {
            let level = self.level(name);
            format!("    leave({level}, here, filled({level}, here, shown));\n")
        };
        let body = FILL.replace("{leaves}", &levels.iter().map(leave).collect::<String>());
        let mut plan = plan.clone();
        (plan.constants, plan.resources) = (Vec::new(), Vec::new());
        let wgsl = self.head() + "\n" + &body;
        // What it leaves nobody but samples reads: covered texels stay.
        LevelShader { plan, over: Over::Empty, reads: levels.to_vec(), leaves: Vec::new(), wgsl }
    }
}

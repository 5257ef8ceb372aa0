//! The fused pass: stored samples in; loss, gradient and normal equations out, in one compute shader.
//!
//! A thread shades pixels of its own one after another (the planner's rules for stored samples, and their
//! [`tangents`](super::tangent)), weighs the residuals, and adds the products of the Jacobian's columns to
//! sums in registers. A workgroup adds up its threads' sums in a fixed tree and writes them; a second
//! shader adds up those of all workgroups to [`PARTS`] numbers a sum, which the CPU adds in f64. So the order
//! of additions is fixed, and the rounding error stays that of short sums however many samples there are.
//!
//! Only enabled effects and free parameters leave a trace in the text. Where there are more sums than
//! registers, they are cut into [`Slab`]s, each with a shader of its own.

use std::fmt::Write as _;

use super::emit::{Plan, hazy, parts, plan, plan_terms, sample_fields};
use super::facts::{Budget, Facts, MapFacts, Source};
use super::module::{sample_struct, uniform};
use super::quantity::Constant;
use super::rule::Stage;
use super::search::components;
use super::tangent::chain::{Chain, Seed};
use crate::engine::residual::{HUBER_THRESHOLD, RELATIVE_FLOOR, SMAPE_CORNER, SMAPE_FLOOR};
use crate::engine::{BLOCK, Unknown};
use crate::model::evaluate::Setup;
use crate::model::params::{Channels, Param};
use crate::samples::LANES;
use crate::samples::surface_records::Places;
use crate::scene::Loss;

/// Threads of a workgroup.
pub const WORKGROUP: u32 = 128;
/// Numbers that a sum is left in for the CPU.
pub const PARTS: usize = 16;
/// Pixels of a block: a coarse pass reads every so-many-th.
const BLOCK_PIXELS: usize = BLOCK * LANES;
/// Sums that a thread keeps: they and the columns should fit 255 registers.
const MOST_SUMS: usize = 112;

/// What a pass yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Wish {
    /// The loss.
    Loss,
    /// The loss, J^T r and r^T r.
    Gradient,
    /// The loss, J^T J, J^T r and r^T r.
    Normal,
}

/// What is the same for every view of a fit.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The switches of the model.
    pub setup: Setup,
    /// The unknowns.
    pub unknowns: Vec<Unknown>,
    /// What is minimised.
    pub loss: Loss,
    /// Whether the haze is compared with the targets' alpha.
    pub alpha: bool,
    /// Whether the environment is turned, or will be.
    pub turned: bool,
    /// What records hold.
    pub layout: Layout,
    /// Whether a pixel may have several samples.
    pub several: bool,
    /// Whether pixels count differently.
    pub weighted: bool,
    /// Whether targets are clipped.
    pub clipped: bool,
}

/// Where a record's numbers stand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Whether samples or their terms are stored.
    pub source: Source,
    /// Fields, by the planner's names, and the first row of each.
    fields: Vec<(&'static str, usize)>,
    /// The row of the sample's share of its pixel.
    share: Option<usize>,
    /// Rows of a record.
    pub rows: usize,
}

impl Layout {
    /// Of samples as the CPU stores them.
    #[must_use]
    pub fn of_samples(places: &Places, rows: usize) -> Self {
        let fields = [
            ("base", places.base),
            ("bump", places.bump),
            ("normal", places.normal),
            ("view", places.view),
            ("open", places.occlusion),
            ("silhouette", places.silhouette),
            ("dapple", places.dapple),
            ("albedo", places.albedo),
            ("specular", places.specular),
            ("attenuator", places.attenuator),
        ];
        let fields = fields.into_iter().filter_map(|(name, place)| Some((name, place?))).collect();
        Self { source: Source::Samples, fields, share: places.weight, rows }
    }

    /// Of the terms that `setup` asks for, with the samples' shares where those have them.
    #[must_use]
    pub fn of_terms(setup: Setup, samples: &Self) -> Self {
        let mut rows = 0;
        let mut fields = Vec::new();
        for (name, kind) in sample_fields(&Facts { setup, source: Source::Terms, ..Facts::default() }) {
            fields.push((name, rows));
            rows += components(kind);
        }
        let share = samples.share.map(|_| rows);
        Self { source: Source::Terms, fields, share, rows: rows + usize::from(share.is_some()) }
    }

    fn place(&self, field: &str) -> Option<usize> {
        self.fields.iter().find(|(name, _)| *name == field).map(|(_, place)| *place)
    }
}

/// One sum over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sum {
    /// Of the losses.
    Loss,
    /// Of the products of two columns; the residual is the column after the last.
    Product(usize, usize),
}

/// A column of the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColumnOf {
    /// The unknown's index; `None` for the view's gain.
    pub unknown: Option<usize>,
    /// The seed whose tangent it is.
    seed: Option<usize>,
    /// The one channel that it moves; `None`: all.
    channel: Option<usize>,
}

/// A part of the sums, and the shader that yields them.
#[derive(Clone, Debug)]
pub struct Slab {
    /// What it sums, in the order of its output.
    pub sums: Vec<Sum>,
    /// The module; its entry point is `cs_main`, in workgroups of [`WORKGROUP`].
    pub wgsl: String,
}

/// The shaders of a fit.
#[derive(Clone, Debug)]
pub struct Fused {
    /// The rules; its constants and resources are group 0.
    pub plan: Plan,
    /// The columns.
    pub columns: Vec<ColumnOf>,
    fitted: Fitted,
    chain: Chain,
}

impl Fused {
    /// Plan the rules and follow the free parameters through them.
    ///
    /// # Errors
    /// When no rules yield the output, or one has no derivative; in words.
    pub fn new(fitted: Fitted) -> Result<Self, String> {
        let facts = facts(&fitted);
        let mut plan = plan(&facts).map_err(|error| error.to_string())?;
        let (seeds, mut columns) = columns(&fitted.unknowns);
        for seed in &seeds {
            let Seed::Named { tangent, .. } = seed else { continue };
            for constant in [Constant::KeyByAzimuth, Constant::KeyByElevation] {
                if tangent.contains(constant.name()) && !plan.constants.contains(&constant) {
                    plan.constants.push(constant);
                }
            }
        }
        let chain = Chain::new(&plan, &seeds).map_err(|error| error.to_string())?;
        let moves =
            |seed: usize| chain.radiance[seed].is_some() || (fitted.alpha && chain.haze[seed].is_some());
        columns.retain(|column| column.seed.is_none_or(moves));
        plan.resources.extend(&chain.resources);
        Ok(Self { columns, fitted, chain, plan })
    }

    /// The shaders that yield a wish; most fits have one.
    #[must_use]
    pub fn slabs(&self, wish: Wish) -> Vec<Slab> {
        let sums = self.sums(wish);
        sums.chunks(MOST_SUMS).map(|sums| Slab { sums: sums.to_vec(), wgsl: self.module(sums) }).collect()
    }

    /// The fields of a stored sample, with their WGSL types.
    #[must_use]
    pub fn fields(&self) -> Vec<(&'static str, &'static str)> {
        sample_fields(&self.plan.facts)
    }

    /// The sums of a wish that are not 0 by their nature.
    fn sums(&self, wish: Wish) -> Vec<Sum> {
        let k = self.columns.len();
        let meet = |i: usize, j: usize| match (self.columns[i].channel, self.columns[j].channel) {
            (Some(a), Some(b)) => a == b,
            _ => true,
        };
        let mut sums = vec![Sum::Loss];
        if wish == Wish::Normal {
            for i in 0..k {
                sums.extend((i..k).filter(|&j| meet(i, j)).map(|j| Sum::Product(i, j)));
            }
        }
        if wish != Wish::Loss {
            sums.extend((0..=k).map(|i| Sum::Product(i, k)));
        }
        sums
    }

    /// Compared channels: three colours, and alpha where it is compared.
    #[must_use]
    pub const fn channels(&self) -> usize {
        if self.fitted.alpha { 4 } else { 3 }
    }

    /// The shader of the forward pass: the image, plane by plane, in the place of the sums.
    #[must_use]
    pub fn image_module(&self) -> String {
        let mut wgsl = self.declarations(false);
        wgsl.push_str(&self.head(&[]));
        wgsl.push_str("        var shown = vec4f();\n");
        wgsl.push_str(&self.samples(&[]));
        for c in 0..self.channels() {
            let _ =
                writeln!(wgsl, "        partial_sums[{c}u * part.slots + slot] = part.gain * shown[{c}];");
        }
        wgsl.push_str("    }\n}\n");
        wgsl
    }

    fn module(&self, sums: &[Sum]) -> String {
        let needed = |i: usize| sums.iter().any(|s| matches!(s, Sum::Product(a, b) if *a == i || *b == i));
        let columns: Vec<usize> = (0..self.columns.len()).filter(|&i| needed(i)).collect();
        let mut seeds: Vec<usize> = columns.iter().filter_map(|&i| self.columns[i].seed).collect();
        seeds.dedup();
        let mut wgsl = self.declarations(!seeds.is_empty());
        wgsl.push_str(&self.head(sums));
        for seed in &seeds {
            let _ = writeln!(wgsl, "        var d{seed} = vec4f();");
        }
        wgsl.push_str("        var shown = vec4f();\n");
        wgsl.push_str(&self.samples(&seeds));
        wgsl.push_str(&self.residuals());
        wgsl.push_str(&self.weighted_columns(&columns));
        for (s, sum) in sums.iter().enumerate() {
            let term = match *sum {
                Sum::Loss => "loss".to_owned(),
                Sum::Product(i, j) => self.product(i, j),
            };
            let _ = writeln!(wgsl, "        sum{s} += {term};");
        }
        wgsl.push_str("    }\n");
        wgsl.push_str(&reduction(sums.len()));
        wgsl
    }

    /// Everything outside the entry point, with or without the tangents' functions.
    fn declarations(&self, tangents: bool) -> String {
        let mut wgsl = self.plan.declarations(true);
        if tangents {
            wgsl.push_str(&self.chain.functions);
        }
        wgsl.push_str(&sample_struct(&self.fields()));
        let _ = write!(
            wgsl,
            "\n// Of one view, or of a part of it.\nstruct Part {{\n    // Pixels that are read, and all that there are.\n    read: u32,\n    slots: u32,\n    // Every so-many-th block is read.\n    stride: u32,\n    // Where the sums of the workgroups stand, each sum's together.\n    first_sum: u32,\n    gain: f32,\n    clip_low: f32,\n    clip_high: f32,\n}}\n\n\
             @group(1) @binding(0) var<uniform> part: Part;\n\
             @group(1) @binding(1) var<storage, read> samples: array<f32>;\n\
             @group(1) @binding(2) var<storage, read> group_start: array<u32>;\n\
             @group(1) @binding(3) var<storage, read> targets: array<f32>;\n\
             @group(1) @binding(4) var<storage, read_write> partial_sums: array<f32>;\n\n\
             const RELATIVE_FLOOR = {RELATIVE_FLOOR:?}f;\nconst HUBER_THRESHOLD = {HUBER_THRESHOLD:?}f;\n\
             const SMAPE_FLOOR = {SMAPE_FLOOR:?}f;\nconst SMAPE_CORNER = {SMAPE_CORNER:?}f;\n\n"
        );
        wgsl.push_str(loss_function(self.fitted.loss));
        wgsl.push('\n');
        wgsl.push_str(REDUCE);
        wgsl
    }

    /// The entry point up to a pixel's samples.
    fn head(&self, sums: &[Sum]) -> String {
        let mut wgsl = format!(
            "\n@compute @workgroup_size({WORKGROUP})\nfn cs_main(\n    @builtin(local_invocation_index) thread: u32,\n    @builtin(workgroup_id) workgroup: vec3u,\n    @builtin(num_workgroups) workgroups: vec3u,\n) {{\n"
        );
        for s in 0..sums.len() {
            let _ = writeln!(wgsl, "    var sum{s} = 0.0;");
        }
        let _ = write!(
            wgsl,
            "    let step = {WORKGROUP}u * workgroups.x;\n    for (var i = {WORKGROUP}u * workgroup.x + thread; i < part.read; i += step) {{\n\
             \x20       let slot = (i / {BLOCK_PIXELS}u) * {BLOCK_PIXELS}u * part.stride + i % {BLOCK_PIXELS}u;\n\
             \x20       if (slot >= part.slots) {{\n            continue;\n        }}\n"
        );
        wgsl
    }

    /// The value and the seeds' tangents of a pixel: over its samples.
    fn samples(&self, seeds: &[usize]) -> String {
        let mut wgsl = String::new();
        let _ = writeln!(wgsl, "        let group = slot / {LANES}u;\n        let lane = slot % {LANES}u;");
        if self.fitted.several {
            wgsl.push_str("        for (var record = group_start[group]; record < group_start[group + 1u]; record++) {\n");
        } else {
            wgsl.push_str("        {\n        let record = group;\n");
        }
        let _ = writeln!(wgsl, "        let s = record * {}u + lane;", self.fitted.layout.rows * LANES);
        let share = self.fitted.layout.share.map_or_else(|| "1.0".to_owned(), number);
        let _ = writeln!(wgsl, "        let share = {share};\n        var at: Sample;");
        wgsl.push_str(&fields_read(&self.fitted.layout, &self.fields()));
        wgsl.push_str(&self.plan.calls(Stage::Fragment, uniform, |name| format!("at.{name}")));
        seeds.iter().for_each(|&seed| wgsl.push_str(&self.chain.lines[seed]));
        let parts = parts(&self.plan.facts);
        let radiance = if parts.is_empty() { "vec3f()".to_owned() } else { parts.join(" + ") };
        let haze = if hazy(&self.plan.facts) { "haze" } else { "0.0" };
        let _ = writeln!(wgsl, "    shown += share * vec4f({radiance}, {haze});");
        for &seed in seeds {
            let radiance = self.chain.radiance[seed].as_deref().unwrap_or("vec3f()");
            let haze = self.chain.haze[seed].as_deref().unwrap_or("0.0");
            let _ = writeln!(wgsl, "    d{seed} += share * vec4f({radiance}, {haze});");
        }
        wgsl.push_str("        }\n");
        wgsl
    }

    /// Residuals and their weights, channel by channel.
    fn residuals(&self) -> String {
        let channels = self.channels();
        let mut wgsl = String::new();
        let weight = if self.fitted.weighted {
            format!("targets[{channels}u * part.slots + slot]")
        } else {
            "1.0".to_owned()
        };
        let _ = writeln!(
            wgsl,
            "        let weight = {weight};\n        var loss = 0.0;\n        var scale = vec4f();\n        var residual = vec4f();"
        );
        for c in 0..channels {
            let _ = writeln!(
                wgsl,
                "        {{\n            let observed = targets[{}u * group + {}u + lane];",
                channels * LANES,
                c * LANES
            );
            let _ = writeln!(wgsl, "            let value = part.gain * shown[{c}];");
            let counted = if self.fitted.clipped {
                // A clipped target only says "at least" or "at most" (MODEL 7).
                wgsl.push_str("            let beyond = (observed <= part.clip_low && value <= observed) || (observed >= part.clip_high && value >= observed);\n");
                "select(weight, 0.0, beyond)"
            } else {
                "weight"
            };
            let _ = writeln!(
                wgsl,
                "            let weighed = weighted_residual(value, observed, {counted});\n            loss += weighed.x;\n            scale[{c}] = weighed.y;\n            residual[{c}] = weighed.z;\n        }}"
            );
        }
        wgsl
    }

    fn weighted_columns(&self, columns: &[usize]) -> String {
        let mut wgsl = String::new();
        for &i in columns {
            let ColumnOf { seed, channel, .. } = self.columns[i];
            let whole = seed.map_or_else(|| "shown".to_owned(), |seed| format!("part.gain * d{seed}"));
            let _ = match channel {
                None => writeln!(wgsl, "        let c{i} = scale * ({whole});"),
                Some(c) => writeln!(wgsl, "        let c{i} = scale[{c}] * ({whole})[{c}];"),
            };
        }
        wgsl
    }

    /// The product of two columns, over the channels.
    fn product(&self, i: usize, j: usize) -> String {
        let k = self.columns.len();
        let side = |i: usize| {
            if i == k { ("residual".to_owned(), None) } else { (format!("c{i}"), self.columns[i].channel) }
        };
        match (side(i), side(j)) {
            ((a, None), (b, None)) if self.fitted.alpha => format!("dot({a}, {b})"),
            ((a, None), (b, None)) => format!("dot({a}.xyz, {b}.xyz)"),
            ((a, Some(_)), (b, Some(_))) => format!("{a} * {b}"),
            ((a, Some(c)), (b, None)) | ((b, None), (a, Some(c))) => format!("{a} * {b}[{c}]"),
        }
    }
}

const REDUCE: &str = include_str!("rules/lib/reduce.wgsl");

/// The shader that adds up the workgroups' sums, a workgroup for each: `partial_sums` in, `PARTS` numbers a sum
/// out. Bindings of group 0: the counts, what is read, what is written.
#[must_use]
pub fn gather_module() -> String {
    format!(
        "struct Gathered {{\n    // Workgroups that left sums, and where they start.\n    workgroups: u32,\n    first_sum: u32,\n    // Where the results go.\n    first_result: u32,\n}}\n\n\
         @group(0) @binding(0) var<uniform> gathered: Gathered;\n\
         @group(0) @binding(1) var<storage, read> partial_sums: array<f32>;\n\
         @group(0) @binding(2) var<storage, read_write> results: array<f32>;\n\n\
         @compute @workgroup_size({WORKGROUP})\nfn cs_main(@builtin(local_invocation_index) thread: u32, @builtin(workgroup_id) which: vec3u) {{\n\
         \x20   let first = gathered.first_sum + which.x * gathered.workgroups;\n    var sum = 0.0;\n\
         \x20   for (var i = thread; i < gathered.workgroups; i += {WORKGROUP}u) {{\n        sum += partial_sums[first + i];\n    }}\n\
         \x20   lanes[thread] = sum;\n    workgroupBarrier();\n    if (thread < {PARTS}u) {{\n        var total = 0.0;\n\
         \x20       for (var k = 0u; k < 8u; k++) {{\n            total += lanes[8u * thread + k];\n        }}\n\
         \x20       results[gathered.first_result + which.x * {PARTS}u + thread] = total;\n    }}\n}}\n\nvar<workgroup> lanes: array<f32, {WORKGROUP}>;\n"
    )
}

/// The number at a row of the record that starts at `s`.
fn number(place: usize) -> String {
    format!("samples[s + {}u]", place * LANES)
}

/// A record's fields into `at`.
fn fields_read(layout: &Layout, fields: &[(&'static str, &'static str)]) -> String {
    let mut wgsl = String::new();
    for (name, kind) in fields {
        if let Some(place) = layout.place(name) {
            let numbers: Vec<String> = (0..components(kind)).map(|k| number(place + k)).collect();
            let _ = writeln!(wgsl, "        at.{name} = {kind}({});", numbers.join(", "));
        } else if matches!(*name, "open" | "dapple" | "albedo" | "specular" | "attenuator") {
            // What the records lack has its neutral value, as `samples` has it.
            let _ = writeln!(wgsl, "        at.{name} = {kind}(1.0);");
        }
    }
    wgsl
}

/// The shader that makes records of terms from records of samples, one sample a thread; and its plan, whose
/// constants and resources are group 0. Bindings of group 1: the count of samples, samples, terms.
///
/// # Errors
/// When no rules yield the terms; in words.
pub fn terms_module(fitted: &Fitted, terms: &Layout) -> Result<(Plan, String), String> {
    let facts = facts(fitted);
    let (plan, wanted) = plan_terms(&facts).map_err(|error| error.to_string())?;
    let fields = sample_fields(&Facts { source: Source::Samples, ..facts });
    let mut wgsl = plan.declarations(true);
    wgsl.push_str(&sample_struct(&fields));
    let _ = write!(
        wgsl,
        "\n@group(1) @binding(0) var<uniform> count: vec4u;\n\
         @group(1) @binding(1) var<storage, read> samples: array<f32>;\n\
         @group(1) @binding(2) var<storage, read_write> terms: array<f32>;\n\n\
         @compute @workgroup_size({WORKGROUP})\nfn cs_main(\n    @builtin(global_invocation_id) id: vec3u,\n    @builtin(num_workgroups) workgroups: vec3u,\n) {{\n\
         \x20   for (var i = id.x; i < count.x; i += {WORKGROUP}u * workgroups.x) {{\n\
         \x20       let lane = i % {LANES}u;\n        let s = (i / {LANES}u) * {}u + lane;\n        let t = (i / {LANES}u) * {}u + lane;\n        var at: Sample;\n",
        fitted.layout.rows * LANES,
        terms.rows * LANES
    );
    wgsl.push_str(&fields_read(&fitted.layout, &fields));
    wgsl.push_str(&plan.calls(Stage::Fragment, uniform, |name| format!("at.{name}")));
    for (name, kind) in wanted {
        let Some(place) = terms.place(name) else { continue };
        let value = if fields.iter().any(|(field, _)| *field == name) {
            format!("at.{name}")
        } else {
            name.to_owned()
        };
        for k in 0..components(kind) {
            let component = if kind == "f32" { String::new() } else { format!("[{k}]") };
            let _ = writeln!(wgsl, "        terms[t + {}u] = {value}{component};", (place + k) * LANES);
        }
    }
    if let (Some(from), Some(to)) = (fitted.layout.share, terms.share) {
        let _ = writeln!(wgsl, "        terms[t + {}u] = {};", to * LANES, number(from));
    }
    wgsl.push_str("    }\n}\n");
    Ok((plan, wgsl))
}

/// The end of the entry point: a thread's sums to the workgroup's.
fn reduction(count: usize) -> String {
    let mut wgsl = String::new();
    for first in (0..count).step_by(16) {
        let here = (count - first).min(16);
        for e in 0..16 {
            let value = if e < here { format!("sum{}", first + e) } else { "0.0".to_owned() };
            let _ = writeln!(wgsl, "    lanes[{}u + thread] = {value};", 128 * e);
        }
        let _ = writeln!(
            wgsl,
            "    let total{first} = sums_of_lanes(thread);\n    if (thread < {here}u) {{\n        partial_sums[part.first_sum + ({first}u + thread) * workgroups.x + workgroup.x] = total{first};\n    }}"
        );
    }
    wgsl.push_str("}\n");
    wgsl
}

/// What the planner is told of stored samples.
fn facts(fitted: &Fitted) -> Facts {
    Facts {
        setup: fitted.setup,
        source: fitted.layout.source,
        maps: MapFacts::default(),
        turned: fitted.turned,
        square_rim: false,
        budget: Budget::Exact,
        ..Facts::default()
    }
}

/// The seeds of the unknowns, each once, and the columns that they give; the gains' comes last.
fn columns(unknowns: &[Unknown]) -> (Vec<Seed>, Vec<ColumnOf>) {
    let (mut params, mut columns): (Vec<Param>, Vec<ColumnOf>) = (Vec::new(), Vec::new());
    for (index, unknown) in unknowns.iter().enumerate() {
        let Unknown::Param(column) = unknown else { continue };
        let seed = params.iter().position(|&param| param == column.param).unwrap_or_else(|| {
            params.push(column.param);
            params.len() - 1
        });
        let channel = match column.channels {
            Channels::Tied => None,
            Channels::One(c) => Some(c),
        };
        columns.push(ColumnOf { unknown: Some(index), seed: Some(seed), channel });
    }
    if unknowns.iter().any(|unknown| matches!(unknown, Unknown::Gain(_))) {
        columns.push(ColumnOf { unknown: None, seed: None, channel: None });
    }
    (params.into_iter().map(Seed::of_param).collect(), columns)
}

const fn loss_function(loss: Loss) -> &'static str {
    match loss {
        Loss::L2 => include_str!("rules/loss/l2.wgsl"),
        Loss::RelativeL2 => include_str!("rules/loss/relative_l2.wgsl"),
        Loss::Huber => include_str!("rules/loss/huber.wgsl"),
        Loss::Smape => include_str!("rules/loss/smape.wgsl"),
    }
}

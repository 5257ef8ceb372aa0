//! The text of a pass: declarations, a pixel's samples, residuals, columns, sums.

use std::fmt::Write as _;

use super::reduce::{functions, reduction};
use super::{ChannelMask, ColumnOf, Fused, Sum, WORKGROUP};
use crate::shader::Domain;
use crate::shader::atlas::stored;
use crate::shader::emit::{shown, with_haze};
use crate::shader::module::{sample_struct, uniform};
use skinfit_core::engine::residual::loss_text;

impl Fused {
    /// The shader of the forward pass: the image, plane by plane, in the place of the sums.
    #[must_use]
    pub fn image_module(&self) -> String {
        let mut wgsl = self.declarations(false);
        wgsl.push_str(&self.head(&[], false));
        wgsl.push_str("        var shown = vec4f();\n");
        wgsl.push_str(&self.samples(&[], false));
        for c in 0..self.channels() {
            let gain = self.gain_of(c);
            let _ = writeln!(wgsl, "        partial_sums[{c}u * part.slots + slot] = {gain}shown[{c}];");
        }
        wgsl.push_str("    }\n}\n");
        wgsl
    }

    pub(super) fn module(&self, sums: &[Sum]) -> String {
        let needed = |i: usize| sums.iter().any(|s| matches!(s, Sum::Product(a, b) if *a == i || *b == i));
        let columns: Vec<usize> = (0..self.columns.len()).filter(|&i| needed(i)).collect();
        let mut seeds: Vec<usize> = columns.iter().filter_map(|&i| self.columns[i].seed).collect();
        seeds.dedup();
        let mut wgsl = self.declarations(!seeds.is_empty());
        wgsl.push_str(&self.pixel_functions());
        wgsl.push_str(&self.head(sums, true));
        for seed in &seeds {
            let _ = writeln!(wgsl, "        var d{seed} = vec4f();");
        }
        wgsl.push_str("        var shown = vec4f();\n");
        wgsl.push_str(&self.samples(&seeds, true));
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
            "\n// Of one view, or of a part of it.\nstruct Part {{\n    // How many pixels a pass reads, and how many the part has.\n    read: u32,\n    slots: u32,\n    // Pixels that are left out after each block.\n    left_out: u32,\n    // Where the sums of the workgroups stand, each sum's together.\n    first_sum: u32,\n    // A factor on each channel.\n    gain: vec4f,\n    clip_low: f32,\n    clip_high: f32,\n}}\n\n\
             @group(1) @binding(0) var<uniform> part: Part;\n\
             @group(1) @binding(1) var<storage, read> samples: array<f32>;\n\
             @group(1) @binding(2) var<storage, read> group_start: array<u32>;\n\
             @group(1) @binding(3) var<storage, read> targets: array<f32>;\n\
             @group(1) @binding(4) var<storage, read_write> partial_sums: array<f32>;\n\
             // The same buffers, four numbers at a time.\n\
             @group(1) @binding(5) var<storage, read> samples_quads: array<vec4f>;\n\
             @group(1) @binding(6) var<storage, read> targets_quads: array<vec4f>;\n\n"
        );
        wgsl.push_str(&self.fitted.layout.levels_declared());
        wgsl.push_str(&loss_text(self.fitted.loss));
        wgsl.push('\n');
        wgsl.push_str(&functions());
        wgsl
    }

    /// The entry point up to a pixel's samples, in a pass that compares with targets or in one that does not.
    fn head(&self, sums: &[Sum], compares: bool) -> String {
        let mut wgsl = format!(
            "\n@compute @workgroup_size({WORKGROUP})\nfn cs_main(\n    @builtin(local_invocation_index) thread: u32,\n    @builtin(workgroup_id) workgroup: vec3u,\n    @builtin(num_workgroups) workgroups: vec3u,\n) {{\n"
        );
        for s in 0..sums.len() {
            let _ = writeln!(wgsl, "    var sum{s} = 0.0;");
        }
        wgsl.push_str(&self.each_pixel(compares));
        wgsl
    }

    /// The value and the seeds' tangents of a pixel: over its samples.
    fn samples(&self, seeds: &[usize], compares: bool) -> String {
        let mut wgsl = String::new();
        wgsl.push_str(&self.each_sample(compares));
        wgsl.push_str(&stored(&self.plan.levels));
        wgsl.push_str(&self.plan.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
        if !seeds.is_empty() {
            wgsl.push_str(&self.chain.shared);
        }
        seeds.iter().for_each(|&seed| wgsl.push_str(&self.chain.lines[seed]));
        let add = match (self.fitted.several, self.fitted.layout.share) {
            (true, _) => "+= share *",
            (false, Some(_)) => "= share *",
            (false, None) => "=",
        };
        let _ = writeln!(wgsl, "    shown {add} {};", shown(&self.plan.facts));
        for &seed in seeds {
            let moved = with_haze(self.chain.radiance[seed].as_deref(), self.chain.haze[seed].as_deref());
            let _ = writeln!(wgsl, "    d{seed} {add} {moved};");
        }
        wgsl.push_str("        }\n");
        wgsl
    }

    /// Residuals and their weights, channel by channel.
    fn residuals(&self) -> String {
        let mut wgsl = self.observed();
        wgsl.push_str(
            "        var loss = 0.0;\n        var scale = vec4f();\n        var residual = vec4f();\n",
        );
        for c in 0..self.channels() {
            let _ = writeln!(
                wgsl,
                "        {{\n            let value = {}shown[{c}];\n            let wanted = observed[{c}];",
                self.gain_of(c)
            );
            let counted = if self.fitted.clipped {
                // A clipped target only says "at least" or "at most" (MODEL 7).
                wgsl.push_str("            let beyond = (wanted <= part.clip_low && value <= wanted) || (wanted >= part.clip_high && value >= wanted);\n");
                "select(weight, 0.0, beyond)"
            } else {
                "weight"
            };
            let _ = writeln!(
                wgsl,
                "            let weighed = weighted_residual(value, wanted, {counted});\n            loss += weighed.x;\n            scale[{c}] = weighed.y;\n            residual[{c}] = weighed.z;\n        }}"
            );
        }
        wgsl
    }

    /// The factors that a view's gain is, where there is one.
    const fn gain(&self) -> &'static str {
        if self.fitted.gained { "part.gain * " } else { "" }
    }

    /// The factor on one channel.
    fn gain_of(&self, channel: usize) -> String {
        if self.fitted.gained { format!("part.gain[{channel}] * ") } else { String::new() }
    }

    fn weighted_columns(&self, columns: &[usize]) -> String {
        let mut wgsl = String::new();
        for &i in columns {
            let ColumnOf { seed, channels, .. } = self.columns[i];
            let whole = seed.map_or_else(|| "shown".to_owned(), |seed| format!("{}d{seed}", self.gain()));
            let _ = match channels.only() {
                None => writeln!(wgsl, "        let c{i} = scale * ({whole});"),
                Some(c) => writeln!(wgsl, "        let c{i} = scale[{c}] * ({whole})[{c}];"),
            };
        }
        wgsl
    }

    /// The product of two columns (the residual is the one after the last), over the channels that both move.
    fn product(&self, i: usize, j: usize) -> String {
        let both = self.moved(i).and(self.moved(j));
        let side = |i: usize, c: Option<usize>| {
            let name = if i == self.columns.len() { "residual".to_owned() } else { format!("c{i}") };
            match c {
                // A column of one channel is a number.
                Some(_) if i < self.columns.len() && self.moved(i).only().is_some() => name,
                Some(c) => format!("{name}[{c}]"),
                None if both == ChannelMask::RADIANCE => format!("{name}.xyz"),
                None => name,
            }
        };
        let (a, b) = (side(i, both.only()), side(j, both.only()));
        if both.only().is_some() { format!("{a} * {b}") } else { format!("dot({a}, {b})") }
    }
}

//! How a pass reads a pixel: its samples, its target and its weight.
//!
//! Where each pixel has one sample, a thread asks for its next pixel before it shades the present one: a processor
//! holds so few threads beside so many sums that they would wait for memory together (a seventh of a pass, on an H200).

use std::fmt::Write as _;

use super::layout::{fields_read, number};
use super::{BLOCK_PIXELS, Fused, WORKGROUP};
use crate::samples::LANES;

impl Fused {
    const fn reads_ahead(&self) -> bool {
        !self.fitted.several
    }

    /// What [`Self::each_pixel`] calls, for passes that compare with targets.
    pub(super) fn pixel_functions(&self) -> String {
        if !self.reads_ahead() {
            return String::new();
        }
        let observed: Vec<String> = (0..4)
            .map(|c| if c < self.channels() { self.stored_target(c) } else { "0.0".to_owned() })
            .collect();
        format!(
            "\n// A pixel as it is stored.\nstruct Pixel {{\n    at: Sample,\n    share: f32,\n    observed: vec4f,\n    weight: f32,\n}}\n\n\
             // The slot of the i-th pixel that is read, or of the last.\nfn slot_of(i: u32) -> u32 {{\n\
             \x20   let pixel = min(i, part.read - 1u);\n\
             \x20   return min({}, part.slots - 1u);\n}}\n\n\
             fn pixel_at(slot: u32) -> Pixel {{\n{}{}\
             \x20   return Pixel(at, {}, vec4f({}), {});\n}}\n",
            slot_of("pixel"),
            group_and_lane(),
            self.read_sample("group"),
            self.share(),
            observed.join(", "),
            self.stored_weight(),
        )
    }

    /// The loop over a thread's pixels, up to a pixel's `slot`, `group` and `lane`; `now` is what is read ahead.
    pub(super) fn each_pixel(&self, compares: bool) -> String {
        let first = format!("{WORKGROUP}u * workgroup.x + thread");
        let mut wgsl = format!("    let step = {WORKGROUP}u * workgroups.x;\n");
        let ahead = compares && self.reads_ahead();
        if ahead {
            let _ = writeln!(wgsl, "    var next = pixel_at(slot_of({first}));");
        }
        let _ = writeln!(
            wgsl,
            "    for (var i = {first}; i < part.read; i += step) {{\n        let slot = {};",
            slot_of("i")
        );
        if ahead {
            wgsl.push_str("        let now = next;\n        next = pixel_at(slot_of(i + step));\n");
        }
        wgsl.push_str("        if (slot >= part.slots) {\n            continue;\n        }\n");
        wgsl.push_str(&group_and_lane());
        wgsl
    }

    /// The start of the block over a pixel's samples: `share` and `at`.
    pub(super) fn each_sample(&self, compares: bool) -> String {
        if self.fitted.several {
            return format!(
                "        for (var record = group_start[group]; record < group_start[group + 1u]; record++) {{\n{}    let share = {};\n",
                self.read_sample("record"),
                self.share()
            );
        }
        if compares {
            return "        {\n        let at = now.at;\n        let share = now.share;\n".to_owned();
        }
        format!("        {{\n{}    let share = {};\n", self.read_sample("group"), self.share())
    }

    /// The sample's share of its pixel; 0 in padding.
    fn share(&self) -> String {
        self.fitted.layout.share.map_or_else(|| "1.0".to_owned(), number)
    }

    /// What the target holds in a channel.
    pub(super) fn target(&self, channel: usize) -> String {
        if self.reads_ahead() { format!("now.observed[{channel}]") } else { self.stored_target(channel) }
    }

    /// How much a pixel counts.
    pub(super) fn weight(&self) -> String {
        if self.reads_ahead() { "now.weight".to_owned() } else { self.stored_weight() }
    }

    fn stored_target(&self, channel: usize) -> String {
        format!("targets[{}u * group + {}u + lane]", self.channels() * LANES, channel * LANES)
    }

    fn stored_weight(&self) -> String {
        if self.fitted.weighted {
            format!("targets[{}u * part.slots + slot]", self.channels())
        } else {
            "1.0".to_owned()
        }
    }

    /// A record's numbers into `at`.
    fn read_sample(&self, record: &str) -> String {
        format!(
            "    let s = {record} * {}u + lane;\n    var at: Sample;\n{}",
            self.fitted.layout.rows * LANES,
            fields_read(&self.fitted.layout, &self.fields())
        )
    }
}

fn group_and_lane() -> String {
    format!("    let group = slot / {LANES}u;\n    let lane = slot % {LANES}u;\n")
}

/// Pixels are read by blocks, every so-many-th.
fn slot_of(i: &str) -> String {
    format!("({i} / {BLOCK_PIXELS}u) * {BLOCK_PIXELS}u * part.stride + {i} % {BLOCK_PIXELS}u")
}

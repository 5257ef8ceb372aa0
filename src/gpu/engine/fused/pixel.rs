//! How a pass reads a pixel: its samples, its target and its weight.
//!
//! Where each pixel has one sample, a thread asks for its next pixel before it shades the present one: a processor
//! holds so few threads beside all the sums that they would wait for memory together (a thirtieth to a twentieth of
//! a pass, on an H200).

use std::fmt::Write as _;

use super::layout::{fields_read, quads_read};
use super::{BLOCK_PIXELS, Fused, WORKGROUP};
use crate::records::StoredRecords;
use crate::samples::LANES;

impl Fused {
    const fn reads_ahead(&self) -> bool {
        !self.fitted.several
    }

    /// What [`Self::each_pixel`] calls: in passes that compare with targets, where pixels are read ahead.
    pub(super) fn pixel_functions(&self) -> String {
        if !self.reads_ahead() {
            return String::new();
        }
        format!(
            "\n// A pixel as it is stored.\nstruct Pixel {{\n    at: Sample,\n    share: f32,\n    observed: vec4f,\n    weight: f32,\n}}\n\n\
             // The i-th pixel that is read, or the last.\nfn pixel_at(which: u32) -> Pixel {{\n    let i = min(which, part.read - 1u);\n{}{}{}\
             \x20   return Pixel(at, {}, {}, {});\n}}\n",
            slot_group_and_lane(),
            self.read_sample("group"),
            self.read_target(),
            self.share("group"),
            self.target(),
            self.stored_weight(),
        )
    }

    /// The loop over a thread's pixels, up to a pixel's `slot`, `group` and `lane` or, where it is read ahead, `now`.
    pub(super) fn each_pixel(&self, compares: bool) -> String {
        let first = format!("{WORKGROUP}u * workgroup.x + thread");
        let mut wgsl = format!("    let step = {WORKGROUP}u * workgroups.x;\n");
        let ahead = compares && self.reads_ahead();
        if ahead {
            let _ = writeln!(wgsl, "    var next = pixel_at({first});");
        }
        let _ = writeln!(wgsl, "    for (var i = {first}; i < part.read; i += step) {{");
        if ahead {
            wgsl.push_str("    let now = next;\n    next = pixel_at(i + step);\n");
        } else {
            wgsl.push_str(&slot_group_and_lane());
        }
        wgsl
    }

    /// The start of the block over a pixel's samples: `share` and `at`.
    pub(super) fn each_sample(&self, compares: bool) -> String {
        if self.fitted.several {
            return format!(
                "        for (var record = group_start[group]; record < group_start[group + 1u]; record++) {{\n{}    let share = {};\n",
                self.read_sample("record"),
                self.share("record")
            );
        }
        if compares {
            return "        {\n        let at = now.at;\n        let share = now.share;\n".to_owned();
        }
        format!("        {{\n{}    let share = {};\n", self.read_sample("group"), self.share("group"))
    }

    /// What the target holds, as `observed`, and how much the pixel counts, as `weight`.
    pub(super) fn observed(&self) -> String {
        if self.reads_ahead() {
            return "        let observed = now.observed;\n        let weight = now.weight;\n".to_owned();
        }
        format!(
            "{}        let observed = {};\n        let weight = {};\n",
            self.read_target(),
            self.target(),
            self.stored_weight()
        )
    }

    /// The sample's share of its pixel; 0 in padding.
    fn share(&self, record: &str) -> String {
        let layout = &self.fitted.layout;
        layout.share.map_or_else(|| "1.0".to_owned(), |place| layout.stored().read(record, place))
    }

    /// How targets stand in their buffer, a record a group.
    const fn targets(&self) -> StoredRecords {
        StoredRecords { name: "targets", rows: self.channels() }
    }

    /// The lines before [`Self::target`].
    fn read_target(&self) -> String {
        self.targets().quads_read("group", 0..self.channels())
    }

    /// A pixel's target; channels that are not compared are 0.
    fn target(&self) -> String {
        let number = |c| if c < self.channels() { self.targets().read("group", c) } else { "0.0".to_owned() };
        let numbers: Vec<String> = (0..4).map(number).collect();
        format!("vec4f({})", numbers.join(", "))
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
        let (layout, fields) = (&self.fitted.layout, self.fields());
        let read = |place| layout.stored().read(record, place);
        quads_read(layout, &fields, record) + &fields_read(layout, &fields, record, read)
    }
}

/// Where the i-th pixel that is read stands: pixels are read by blocks, every so-many-th.
fn slot_group_and_lane() -> String {
    format!(
        "    let slot = i + (i / {BLOCK_PIXELS}u) * part.left_out;\n    let group = slot / {LANES}u;\n    let lane = slot % {LANES}u;\n"
    )
}

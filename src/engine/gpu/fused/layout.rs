//! What records hold, and how a shader reads them.

use std::fmt::Write as _;

use crate::gpu::records::StoredRecords;
use crate::model::evaluate::Setup;
use crate::samples::surface_records::Places;
use crate::shader::emit::sample_fields;
use crate::shader::facts::{Facts, Source};
use crate::shader::search::components;

/// Where a record's numbers stand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Whether samples or their terms are stored.
    pub source: Source,
    /// Fields, by the planner's names, and the first row of each.
    fields: Vec<(&'static str, usize)>,
    /// The row of the sample's share of its pixel.
    pub(super) share: Option<usize>,
    /// Rows of a record.
    pub rows: usize,
}

impl Layout {
    /// Of samples as the CPU stores them.
    #[must_use]
    pub fn of_samples(places: &Places, rows: usize) -> Self {
        let fields = places.fields().map(|(name, row, _)| (name, row)).collect();
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

    /// How the records stand in the buffer `samples`.
    pub(super) const fn stored(&self) -> StoredRecords {
        StoredRecords { name: "samples", rows: self.rows }
    }

    pub(super) fn place(&self, field: &str) -> Option<usize> {
        self.fields.iter().find(|(name, _)| *name == field).map(|(_, place)| *place)
    }
}

/// The fields of `record` (a name) into `at`; the lines read the quad of the sample's share, too.
pub(super) fn fields_read(layout: &Layout, fields: &[(&'static str, &'static str)], record: &str) -> String {
    let stored = layout.stored();
    let placed = |(name, kind): &(&'static str, &'static str)| {
        layout.place(name).map(|place| place..place + components(kind))
    };
    let mut wgsl = stored.quads_read(record, fields.iter().filter_map(placed).flatten().chain(layout.share));
    wgsl.push_str("    var at: Sample;\n");
    for field @ (name, kind) in fields {
        if let Some(places) = placed(field) {
            let numbers: Vec<String> = places.map(|place| stored.read(record, place)).collect();
            let _ = writeln!(wgsl, "    at.{name} = {kind}({});", numbers.join(", "));
        } else if matches!(*name, "open" | "dapple" | "albedo" | "specular" | "attenuator") {
            // What the records lack has its neutral value, as `samples` has it.
            let _ = writeln!(wgsl, "    at.{name} = {kind}(1.0);");
        }
    }
    wgsl
}

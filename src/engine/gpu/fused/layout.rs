//! What records hold, and how a shader reads them.

use std::fmt::Write as _;

use crate::model::evaluate::Setup;
use crate::samples::LANES;
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

    pub(super) fn place(&self, field: &str) -> Option<usize> {
        self.fields.iter().find(|(name, _)| *name == field).map(|(_, place)| *place)
    }
}

/// The number at a row of the record that starts at `s`.
pub(super) fn number(place: usize) -> String {
    format!("samples[s + {}u]", place * LANES)
}

/// A record's fields into `at`.
pub(super) fn fields_read(layout: &Layout, fields: &[(&'static str, &'static str)]) -> String {
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

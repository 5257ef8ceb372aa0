//! What records hold, and how a shader reads them.

use std::fmt::Write as _;
use std::ops::Range;

use crate::model::evaluate::Setup;
use crate::records::StoredRecords;
use crate::samples::surface_records::{Places, neutral};
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
    /// What samples look up of the UV atlas, in records of its own.
    levels: Levels,
}

/// Where the numbers stand that samples look up.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Levels {
    /// Their names, and the first row of each.
    fields: Vec<(String, usize)>,
    /// Rows of a record; 0 where nothing is looked up.
    rows: usize,
}

impl Layout {
    /// Of samples as the CPU stores them.
    #[must_use]
    pub fn of_samples(places: &Places, rows: usize) -> Self {
        let fields = places.fields().map(|(name, row, _)| (name, row)).collect();
        Self { source: Source::Samples, fields, share: places.weight, rows, levels: Levels::default() }
    }

    /// Of the terms that `setup` asks for, with the samples' shares where those have them. Records are as long as the
    /// samples' at the least, so that terms can take their place.
    #[must_use]
    pub fn of_terms(setup: Setup, samples: &Self) -> Self {
        let mut rows = 0;
        let mut fields = Vec::new();
        for (name, kind) in sample_fields(&Facts { setup, source: Source::Terms, ..Facts::default() }) {
            fields.push((name, rows));
            rows += components(kind);
        }
        let share = samples.share.map(|_| rows);
        let rows = rows + usize::from(share.is_some());
        let rows = rows.max(samples.rows);
        Self { source: Source::Terms, fields, share, rows, levels: Levels::default() }
    }

    /// With what samples look up of the UV atlas, each with how many numbers it has, in records of `rows` rows.
    #[must_use]
    pub fn with_levels(self, looked_up: Vec<(String, usize)>, rows: usize) -> Self {
        let mut next = 0;
        let field = |(name, count): (String, usize)| {
            next += count;
            (name, next - count)
        };
        let fields = looked_up.into_iter().map(field).collect();
        Self { levels: Levels { fields, rows }, ..self }
    }

    /// Whether samples look something up.
    pub(super) const fn has_levels(&self) -> bool {
        self.levels.rows > 0
    }

    fn level(&self, field: &str) -> Option<usize> {
        self.levels.fields.iter().find(|(name, _)| name == field).map(|(_, place)| *place)
    }

    /// Whether records can stand where the samples stood, numbers of the same lane in the same places.
    #[must_use]
    pub const fn in_place_of(&self, samples: &Self) -> bool {
        self.rows == samples.rows
    }

    /// How the records stand in the buffer `samples`.
    pub(super) const fn stored(&self) -> StoredRecords {
        StoredRecords { name: "samples", rows: self.rows }
    }

    pub(super) fn place(&self, field: &str) -> Option<usize> {
        self.fields.iter().find(|(name, _)| *name == field).map(|(_, place)| *place)
    }

    fn places(&self, (field, kind): &Field) -> Option<Range<usize>> {
        self.place(field).map(|place| place..place + components(kind))
    }
}

/// A field's name in the planner's words, and its WGSL type.
type Field = (String, &'static str);

/// The lines that read the quads of `record` (a name) which hold the fields and the sample's share.
pub(super) fn quads_read(layout: &Layout, fields: &[Field], record: &str) -> String {
    let places = fields.iter().filter_map(|field| layout.places(field)).flatten();
    layout.stored().quads_read(record, places.chain(layout.share))
}

/// The fields of `record` (a name) into `at`; `read` is the number at a place.
pub(super) fn fields_read(
    layout: &Layout,
    fields: &[Field],
    record: &str,
    read: impl Fn(usize) -> String,
) -> String {
    let levels = StoredRecords { name: "levels", rows: layout.levels.rows };
    let mut wgsl = "    var at: Sample;\n".to_owned();
    for field @ (name, kind) in fields {
        if let Some(places) = layout.places(field) {
            let numbers: Vec<String> = places.map(&read).collect();
            let _ = writeln!(wgsl, "    at.{name} = {kind}({});", numbers.join(", "));
        } else if let Some(place) = layout.level(name) {
            let numbers = (place..place + components(kind)).map(|row| levels.number(record, row));
            let _ = writeln!(wgsl, "    at.{name} = {kind}({});", numbers.collect::<Vec<_>>().join(", "));
        } else if let Some(neutral) = neutral(name) {
            let _ = writeln!(wgsl, "    at.{name} = {kind}({neutral:?});");
        }
    }
    wgsl
}

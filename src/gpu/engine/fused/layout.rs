//! What records hold, and how a shader reads them.

use std::fmt::Write as _;
use std::ops::Range;

use crate::model::evaluate::Setup;
use crate::records::StoredRecords;
use crate::samples::surface_records::{Places, neutral};
use crate::shader::atlas::buffers::Layers;
use crate::shader::atlas::sample_buffered_level;
use crate::shader::domain::{CHART, UV};
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
    /// What samples look up of the UV atlas.
    levels: Looked,
}

/// How samples look up what stands in texels of the UV atlas.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Looked {
    /// Not at all.
    #[default]
    Nothing,
    /// It was found for each before, and stands in records of its own.
    Rows {
        /// What was found, each with how many numbers it has.
        fields: Vec<(String, usize)>,
        /// Rows of a record.
        rows: usize,
    },
    /// By their texture coordinates, in levels.
    Levels {
        /// Where these stand.
        layers: Layers,
        /// Texels along a side.
        size: u32,
        /// Whether by one fetch, whatever the chart.
        dilated: bool,
    },
}

impl Layout {
    /// Of samples as the CPU stores them.
    #[must_use]
    pub fn of_samples(places: &Places, rows: usize) -> Self {
        let fields = places.fields().map(|(name, row, _)| (name, row)).collect();
        Self { source: Source::Samples, fields, share: places.weight, rows, levels: Looked::Nothing }
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
        Self { source: Source::Terms, fields, share, rows, levels: Looked::Nothing }
    }

    /// With what samples look up of the UV atlas.
    #[must_use]
    pub fn with_levels(self, levels: Looked) -> Self {
        Self { levels, ..self }
    }

    /// What stands beside samples where they look something up: the buffer `levels`, and functions.
    pub(super) fn levels_declared(&self) -> String {
        let bound = "@group(1) @binding(7) var<storage, read> levels";
        match &self.levels {
            Looked::Nothing => String::new(),
            Looked::Rows { .. } => format!("{bound}: array<f32>;\n\n"),
            Looked::Levels { size, dilated, .. } => format!(
                "{bound}: array<vec4f>;\nconst SIZE = {size};\n\n{}\n",
                sample_buffered_level(*dilated)
            ),
        }
    }

    /// The lines that look the fields of those names up, into `at`; `read` is a number of the sample.
    fn looked_up(&self, fields: &[Field], record: &str, read: &impl Fn(usize) -> String) -> String {
        let mut wgsl = String::new();
        match &self.levels {
            Looked::Nothing => {}
            Looked::Rows { fields: found, rows } => {
                let levels = StoredRecords { name: "levels", rows: *rows };
                let mut place = 0;
                for (name, count) in found {
                    if let Some((_, kind)) = fields.iter().find(|(field, _)| field == name) {
                        let numbers = (place..place + count).map(|row| levels.number(record, row));
                        let numbers = numbers.collect::<Vec<_>>().join(", ");
                        let _ = writeln!(wgsl, "    at.{name} = {kind}({numbers});");
                    }
                    place += count;
                }
            }
            Looked::Levels { layers, size, dilated } => {
                let level = |name: &str| layers.place(name).map(|at| at * *size as usize * *size as usize);
                let looked: Vec<_> =
                    fields.iter().filter_map(|(name, kind)| Some((name, *kind, level(name)?))).collect();
                let (Some((.., first)), Some([u, v, chart])) = (looked.first(), self.coordinates()) else {
                    return wgsl;
                };
                let uv = format!("vec2f({}, {})", read(u), read(v));
                let by = if *dilated {
                    uv
                } else {
                    let _ = writeln!(
                        wgsl,
                        "    let corners = level_corners({first}u, {uv}, round({}));",
                        read(chart)
                    );
                    "corners".to_owned()
                };
                for (name, kind, at) in looked {
                    let swizzle = ["x", "xy", "xyz"][components(kind).clamp(1, 3) - 1];
                    let _ = writeln!(wgsl, "    at.{name} = level_at({at}u, {by}).{swizzle};");
                }
            }
        }
        wgsl
    }

    /// The rows of texture coordinates and of the chart.
    fn coordinates(&self) -> Option<[usize; 3]> {
        let uv = self.place(UV)?;
        Some([uv, uv + 1, self.place(CHART)?])
    }

    /// Rows that a sample's lookups read.
    fn coordinates_read(&self) -> Vec<usize> {
        let by = matches!(self.levels, Looked::Levels { .. });
        self.coordinates().filter(|_| by).map(Vec::from).unwrap_or_default()
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
    layout.stored().quads_read(record, places.chain(layout.share).chain(layout.coordinates_read()))
}

/// The fields of `record` (a name) into `at`; `read` is the number at a place.
pub(super) fn fields_read(
    layout: &Layout,
    fields: &[Field],
    record: &str,
    read: impl Fn(usize) -> String,
) -> String {
    let mut wgsl = "    var at: Sample;\n".to_owned();
    for field @ (name, kind) in fields {
        if let Some(places) = layout.places(field) {
            let numbers: Vec<String> = places.map(&read).collect();
            let _ = writeln!(wgsl, "    at.{name} = {kind}({});", numbers.join(", "));
        } else if let Some(neutral) = neutral(name) {
            let _ = writeln!(wgsl, "    at.{name} = {kind}({neutral:?});");
        }
    }
    wgsl + &layout.looked_up(fields, record, &read)
}

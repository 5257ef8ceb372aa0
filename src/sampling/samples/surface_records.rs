//! What the model reads of each sample, record by record.

use std::ops::Range;

use super::LANES;
use super::rows::{Row, Rows};
use crate::model::fields::{Field, Fields};
use crate::model::fragment::Fragment;

/// What stands in for a number that no enabled effect asks for. The smooth normal's stand-in is the
/// sample's own base.
pub const NEUTRAL: Fragment<f32> = Fragment {
    base: [0.0; 3],
    bump: [0.0; 3],
    normal: [0.0; 3],
    view: [0.0; 3],
    occlusion: 1.0,
    silhouette: 0.0,
    dapple: 1.0,
    albedo: [1.0; 3],
    specular: 1.0,
    attenuator: 1.0,
};

/// What stands in for each number of a field that records lack, by the planner's name; `None` for base, view and the
/// smooth normal.
pub fn neutral(field: &str) -> Option<f32> {
    Some(match field {
        "bump" => NEUTRAL.bump[0],
        "open" => NEUTRAL.occlusion,
        "silhouette" => NEUTRAL.silhouette,
        "dapple" => NEUTRAL.dapple,
        "albedo" => NEUTRAL.albedo[0],
        "specular" => NEUTRAL.specular,
        "attenuator" => NEUTRAL.attenuator,
        other => return Field::from_name(other).map(|field| field.info().neutral),
    })
}

/// What rules read of a sample beside its [`Fragment`], where a parameter moves what the fragment holds ready made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unmade {
    /// N as interpolated, from which S.w is made.
    pub dapple_normal: [f32; 3],
    /// S.z at the corners of the triangle, from which the rim is made.
    pub corner_silhouettes: [f32; 3],
    /// What each corner counts: barycentric coordinates.
    pub corner_shares: [f32; 3],
    /// Texture coordinates of the UV atlas, by which its levels are looked up.
    pub uv: [f32; 2],
    /// The chart of the atlas that they lie in.
    pub chart: f32,
}

/// Which numbers are kept of each sample, beside its base and its view vector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs, reason = "named as the fragment's fields")]
pub struct Asked {
    pub bump: bool,
    pub normal: bool,
    pub albedo: bool,
    pub occlusion: bool,
    pub silhouette: bool,
    pub dapple: bool,
    /// In the place of the dapple.
    pub dapple_normal: bool,
    /// In the place of the silhouette: what [`Unmade`] has of corners.
    pub corners: bool,
    pub specular: bool,
    pub attenuator: bool,
    /// Texture coordinates of the UV atlas, and their chart.
    pub uv: bool,
    /// Numbers of vertices that files of rules declare.
    pub fields: Fields,
    /// The sample's share of its pixel; without it, each counts 1.
    pub weight: bool,
}

impl Asked {
    /// Every number of a fragment.
    pub const EVERYTHING: Self = Self {
        bump: true,
        normal: true,
        albedo: true,
        occlusion: true,
        silhouette: true,
        dapple: true,
        dapple_normal: false,
        corners: false,
        specular: true,
        attenuator: true,
        uv: false,
        fields: Fields::NONE,
        weight: true,
    };
}

/// Where a record's numbers stand: of a vector, the first of its three rows. `None` where no enabled
/// effect asks for them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs, reason = "named as the fragment's fields")]
pub struct Places {
    pub base: Option<usize>,
    pub bump: Option<usize>,
    pub view: Option<usize>,
    pub normal: Option<usize>,
    pub albedo: Option<usize>,
    pub occlusion: Option<usize>,
    pub silhouette: Option<usize>,
    pub dapple: Option<usize>,
    pub dapple_normal: Option<usize>,
    pub corner_silhouettes: Option<usize>,
    pub corner_shares: Option<usize>,
    pub specular: Option<usize>,
    pub attenuator: Option<usize>,
    pub uv: Option<usize>,
    pub chart: Option<usize>,
    /// What files of rules declare, one after the other.
    pub fields: Fields,
    /// The first row of those.
    pub fields_at: usize,
    /// The sample's share of its pixel.
    pub weight: Option<usize>,
}

impl Places {
    /// The places of the requested fields, and how many rows a record has.
    fn new(asked: Asked) -> (Self, usize) {
        let mut rows = 0;
        let mut place = |wanted: bool, size: usize| {
            wanted.then(|| {
                rows += size;
                rows - size
            })
        };
        let places = Self {
            base: place(true, 3),
            bump: place(asked.bump, 3),
            view: place(true, 3),
            normal: place(asked.normal, 3),
            albedo: place(asked.albedo, 3),
            occlusion: place(asked.occlusion, 1),
            silhouette: place(asked.silhouette, 1),
            dapple: place(asked.dapple, 1),
            dapple_normal: place(asked.dapple_normal, 3),
            corner_silhouettes: place(asked.corners, 3),
            corner_shares: place(asked.corners, 3),
            specular: place(asked.specular, 1),
            attenuator: place(asked.attenuator, 1),
            uv: place(asked.uv, 2),
            chart: place(asked.uv, 1),
            fields: asked.fields,
            fields_at: place(true, asked.fields.numbers()).unwrap_or(0),
            weight: place(asked.weight, 1),
        };
        (places, rows)
    }

    /// The fields that are kept: name in the planner's words, first row, and how many rows.
    pub fn fields(&self) -> impl Iterator<Item = (&'static str, usize, usize)> {
        let fields = [
            ("base", self.base, 3),
            ("bump", self.bump, 3),
            ("normal", self.normal, 3),
            ("view", self.view, 3),
            ("open", self.occlusion, 1),
            ("silhouette", self.silhouette, 1),
            ("dapple", self.dapple, 1),
            ("dapple_normal", self.dapple_normal, 3),
            ("corner_silhouettes", self.corner_silhouettes, 3),
            ("corner_shares", self.corner_shares, 3),
            ("albedo", self.albedo, 3),
            ("specular", self.specular, 1),
            ("attenuator", self.attenuator, 1),
            ("vertex_uv", self.uv, 2),
            ("vertex_chart", self.chart, 1),
        ];
        let declared = self.declared().into_iter().map(|(field, at)| (field.name(), at.start, at.len()));
        fields.into_iter().filter_map(|(name, place, rows)| Some((name, place?, rows))).chain(declared)
    }

    /// Those that files of rules declare, and the rows of each.
    pub(super) fn declared(&self) -> Vec<(Field, Range<usize>)> {
        let mut next = self.fields_at;
        let rows = |field: Field| {
            let first = next;
            next += field.info().numbers;
            (field, first..next)
        };
        self.fields.iter().map(rows).collect()
    }

    fn vectors(&self, f: &Fragment<f32>) -> [(Option<usize>, [f32; 3]); 5] {
        [
            (self.base, f.base),
            (self.bump, f.bump),
            (self.view, f.view),
            (self.normal, f.normal),
            (self.albedo, f.albedo),
        ]
    }

    fn unmade(&self, unmade: &Unmade) -> [(Option<usize>, [f32; 3]); 3] {
        [
            (self.dapple_normal, unmade.dapple_normal),
            (self.corner_silhouettes, unmade.corner_silhouettes),
            (self.corner_shares, unmade.corner_shares),
        ]
    }

    fn scalars(&self, f: &Fragment<f32>) -> [(Option<usize>, f32); 5] {
        [
            (self.occlusion, f.occlusion),
            (self.silhouette, f.silhouette),
            (self.dapple, f.dapple),
            (self.specular, f.specular),
            (self.attenuator, f.attenuator),
        ]
    }

    /// Write one lane of a record.
    pub(super) fn put(
        &self,
        record: &mut [Row],
        lane: usize,
        (fragment, unmade): &(Fragment<f32>, Unmade),
        weight: f32,
    ) {
        for (place, value) in self.vectors(fragment).into_iter().chain(self.unmade(unmade)) {
            let Some(at) = place else { continue };
            for c in 0..3 {
                record[at + c][lane] = value[c];
            }
        }
        if let Some(at) = self.uv {
            (record[at][lane], record[at + 1][lane]) = (unmade.uv[0], unmade.uv[1]);
        }
        if let Some(at) = self.chart {
            record[at][lane] = unmade.chart;
        }
        for (place, value) in self.scalars(fragment).into_iter().chain([(self.weight, weight)]) {
            if let Some(at) = place {
                record[at][lane] = value;
            }
        }
    }
}

/// The samples of a view: a record holds one sample of each of a group's pixels.
///
/// The shading normal is the direction of `base + normal_strength * bump`. A sample is named by its
/// slot, `record * LANES + lane`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceRecords {
    places: Places,
    rows: Rows,
}

impl SurfaceRecords {
    /// `count` records of the requested fields, all zero.
    #[must_use]
    pub fn new(asked: Asked, count: usize) -> Self {
        let (places, stride) = Places::new(asked);
        Self { places, rows: Rows::new(stride, count) }
    }

    /// A range of records.
    #[must_use]
    pub(super) fn part(&self, records: Range<usize>) -> Self {
        Self { places: self.places, rows: self.rows.part(records) }
    }

    /// Where a record's numbers stand.
    #[must_use]
    #[inline]
    pub const fn places(&self) -> &Places {
        &self.places
    }

    /// The records' rows.
    #[must_use]
    #[inline]
    pub const fn rows(&self) -> &Rows {
        &self.rows
    }

    /// The records' rows.
    pub fn rows_mut(&mut self) -> &mut Rows {
        &mut self.rows
    }

    /// How many slots there are, padding included.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.rows.all().len() / self.rows.stride().max(1) * LANES
    }

    /// The sample at `slot`.
    #[must_use]
    pub fn fragment(&self, slot: usize) -> Fragment<f32> {
        let record = self.rows.record(slot / LANES);
        let scalar =
            |place: Option<usize>, neutral: f32| place.map_or(neutral, |at| record[at][slot % LANES]);
        let vector = |place: Option<usize>, neutral: [f32; 3]| {
            place.map_or(neutral, |at| [0, 1, 2].map(|c| record[at + c][slot % LANES]))
        };
        let at = &self.places;
        let base = vector(at.base, NEUTRAL.base);
        Fragment {
            base,
            bump: vector(at.bump, NEUTRAL.bump),
            normal: vector(at.normal, base),
            view: vector(at.view, NEUTRAL.view),
            occlusion: scalar(at.occlusion, NEUTRAL.occlusion),
            silhouette: scalar(at.silhouette, self.silhouette_of_corners(slot)),
            dapple: scalar(at.dapple, NEUTRAL.dapple),
            albedo: vector(at.albedo, NEUTRAL.albedo),
            specular: scalar(at.specular, NEUTRAL.specular),
            attenuator: scalar(at.attenuator, NEUTRAL.attenuator),
        }
    }

    /// S.z, interpolated from the corners where records hold them.
    fn silhouette_of_corners(&self, slot: usize) -> f32 {
        if self.places.corner_shares.is_none() {
            return NEUTRAL.silhouette;
        }
        let Unmade { corner_silhouettes, corner_shares, .. } = self.unmade(slot);
        corner_silhouettes.iter().zip(corner_shares).map(|(z, share)| z * share).sum()
    }

    /// The share that the sample at `slot` has of its pixel's covered area; padding has 0.
    #[must_use]
    #[inline]
    pub fn weight(&self, slot: usize) -> f32 {
        self.places.weight.map_or(1.0, |at| self.rows.number(at, slot))
    }

    /// Set the sample at `slot`; what is made of its fragment alone.
    pub fn set(&mut self, slot: usize, fragment: &Fragment<f32>, weight: f32) {
        self.set_all(slot, &(*fragment, Unmade::default()), weight);
    }

    /// Set the sample at `slot`.
    pub fn set_all(&mut self, slot: usize, sample: &(Fragment<f32>, Unmade), weight: f32) {
        self.places.put(self.rows.record_mut(slot / LANES), slot % LANES, sample, weight);
    }

    /// What the sample at `slot` holds beside its fragment; 0 where its records lack it.
    #[must_use]
    pub fn unmade(&self, slot: usize) -> Unmade {
        let vector = |place: Option<usize>| {
            place.map_or([0.0; 3], |at| [0, 1, 2].map(|c| self.rows.number(at + c, slot)))
        };
        Unmade {
            dapple_normal: vector(self.places.dapple_normal),
            corner_silhouettes: vector(self.places.corner_silhouettes),
            corner_shares: vector(self.places.corner_shares),
            uv: self.places.uv.map_or([0.0; 2], |at| [0, 1].map(|c| self.rows.number(at + c, slot))),
            chart: self.places.chart.map_or(0.0, |at| self.rows.number(at, slot)),
        }
    }
}

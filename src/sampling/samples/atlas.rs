//! Texels of the UV atlas as samples: the mesh rasterised with its texture coordinates as positions.
//!
//! Covered texels stand row by row, sixteen a record, each with what the effects' rules read of it and nothing else.
//! `texel_cover` says which these are, `texel_fields` what they hold.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::LANES;
use super::along::{Along, SixteenTexels, known};
use super::dilation::Dilation;
use super::posed::PosedSurface;
use super::rows::Rows;
use super::seams::{Margins, Texels};
use super::texel_cover::{EMPTY, Layout, centre, covered};
pub use super::texel_cover::{Listed, listed, overlap};
pub use super::texel_error::AtlasError;
use super::texel_fields::{Field, Textured};
use crate::model::diffusion::Seams;
use crate::model::evaluate::Setup;
use crate::program::graph::Input;
use crate::program::levels::texel_inputs;
use crate::scene::maps::Maps;
use crate::shader::Facts;
use crate::shader::atlas::Axis;
use crate::shader::facts::FaceSizes;

/// The texels that a mesh covers, and what rules read of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    size: u32,
    /// For each texel, row by row, its place among those that are covered, and its chart; [`EMPTY`] and 0.
    cells: Vec<[u32; 2]>,
    /// Which texel each covered one is.
    texels: Vec<u32>,
    /// The chart of each covered texel, counted from 1.
    charts: Vec<u32>,
    /// What records hold, row by row.
    inputs: Vec<Input>,
    rows: Rows,
    /// Made where it is asked for.
    dilation: OnceLock<Dilation>,
    /// Likewise, for blurs.
    known: OnceLock<Vec<SixteenTexels>>,
    margins: Margins,
}

impl Atlas {
    /// The texels of a mesh as it is posed, `size` a side, with what the effects of `setup` read. All cores; the same
    /// for any number of threads.
    ///
    /// # Errors
    /// When the mesh has no texture coordinates, or does not lie in the unit square; or the effects cannot be computed.
    pub fn new(setup: &Setup, posed: &PosedSurface<'_>, maps: &Maps, size: u32) -> Result<Self, AtlasError> {
        let triangles_of_skin = posed.mesh.skin_triangles();
        let layout = Layout::new(posed.mesh.atlas_uvs(), &triangles_of_skin, size)?;
        let any = FaceSizes { irradiance: Some(1), specular: Some(1), hilite: Some(1), reflected: Some(1) };
        // Turned or not, the same is read.
        let inputs = texel_inputs(&Facts::of_samples(*setup, any, true))?;
        let find = |field, hit, numbers: &mut [f32]| posed.field(field, hit, numbers);
        let (mesh, occlusion) = (posed.mesh, posed.open.as_deref());
        let mip_maps = posed.mip_maps.as_deref();
        let mesh = Textured { posed: mesh, occlusion, maps, mip_maps, find: &find, layout };
        let fields = inputs.iter().map(Field::of).collect::<Result<Vec<_>, _>>()?;
        let triangles = layout.shown()?;
        let chart_of = |&texel: &u32| {
            let corner = posed.mesh.triangles[triangles[texel as usize] as usize][0];
            posed.charts.get(corner as usize).copied().unwrap_or(1)
        };
        let (texels, places) = covered(&triangles);
        let charts: Vec<u32> = texels.iter().map(chart_of).collect();
        let mut rows = Rows::new(fields.len(), texels.len().div_ceil(LANES));
        if !fields.is_empty() {
            let records = rows.all_mut().par_chunks_mut(fields.len()).zip(texels.par_chunks(LANES));
            records.for_each(|(record, texels)| {
                for lane in 0..LANES {
                    // Lanes beyond the last texel repeat it.
                    let texel = texels[lane.min(texels.len() - 1)];
                    let triangle = layout.triangle(triangles[texel as usize]);
                    let weights = triangle.weights(centre(texel, size));
                    for (row, field) in record.iter_mut().zip(&fields) {
                        row[lane] = field.value(&mesh, &triangle, weights);
                    }
                }
            });
        }
        let covered = texels.len();
        let mut atlas = Self {
            size,
            cells: cells(&places, &charts),
            texels,
            charts,
            inputs,
            rows,
            dilation: OnceLock::new(),
            known: OnceLock::new(),
            margins: Margins::default(),
        };
        if setup.choices.diffusion.seams == Seams::Joined {
            atlas.margins = Margins::new(posed.mesh, &posed.charts, &atlas, covered);
        }
        Ok(atlas)
    }

    /// Texels of given `charts`, `size` a side and row by row, 0 where nothing is covered; `value` gives what each holds.
    #[must_use]
    pub fn of_charts(
        size: u32,
        charts: &[u32],
        inputs: Vec<Input>,
        value: impl Fn(&Input, usize) -> f32,
    ) -> Self {
        let shown: Vec<u32> = charts.iter().map(|&chart| if chart == 0 { EMPTY } else { chart }).collect();
        let (texels, places) = covered(&shown);
        let mut rows = Rows::new(inputs.len(), texels.len().div_ceil(LANES));
        for slot in 0..texels.len().div_ceil(LANES) * LANES {
            let texel = texels[slot.min(texels.len() - 1)] as usize;
            for (row, input) in inputs.iter().enumerate() {
                rows.record_mut(slot / LANES)[row][slot % LANES] = value(input, texel);
            }
        }
        let charts: Vec<u32> = texels.iter().map(|&texel| charts[texel as usize]).collect();
        let (dilation, known) = (OnceLock::new(), OnceLock::new());
        let cells = cells(&places, &charts);
        Self { size, cells, texels, charts, inputs, rows, dilation, known, margins: Margins::default() }
    }

    /// The same, but lookups by one fetch find in each empty texel what another shows, which is covered: pairs of texels,
    /// row by row.
    #[must_use]
    pub fn with_shown(mut self, shown: impl IntoIterator<Item = (u32, u32)>) -> Self {
        let place = |texel: u32| Some(self.cells[texel as usize][0]).filter(|&place| place != EMPTY);
        let shown = shown.into_iter().filter(|&(texel, _)| place(texel).is_none());
        let shown = shown.filter_map(|(texel, of)| Some((texel, place(of)?)));
        self.dilation = OnceLock::from(Dilation::of_copies(shown));
        self
    }

    /// The same texels, whose records hold other numbers of a quantity: of `numbers` each covered texel has `width` together.
    #[must_use]
    pub fn with_quantity(&self, name: &str, width: usize, numbers: &[f32]) -> Self {
        let mut made = self.clone();
        let held = |row: &usize| self.inputs[*row].name == name;
        let rows: Vec<usize> = (0..self.inputs.len()).filter(held).collect();
        for slot in 0..self.covered().div_ceil(LANES) * LANES {
            let texel = slot.min(self.covered() - 1);
            for &row in &rows {
                let number = numbers[texel * width + self.inputs[row].component];
                made.rows.record_mut(slot / LANES)[row][slot % LANES] = number;
            }
        }
        made
    }

    /// Texels along a side.
    #[must_use]
    #[inline]
    pub const fn size(&self) -> u32 {
        self.size
    }

    /// How many texels are covered.
    #[must_use]
    #[inline]
    pub const fn covered(&self) -> usize {
        self.texels.len()
    }

    /// Column and row of a covered texel.
    #[inline(always)]
    #[must_use]
    pub fn texel(&self, place: usize) -> [u32; 2] {
        [self.texels[place] % self.size, self.texels[place] / self.size]
    }

    /// The chart of a covered texel, counted from 1.
    #[inline(always)]
    #[must_use]
    pub fn chart(&self, place: usize) -> u32 {
        self.charts[place]
    }

    /// Of a chart's texels the nearest to a place between texels' centres, in texels; of those as near the first one, row
    /// by row. `None` where the chart has none.
    #[must_use]
    pub fn nearest(&self, chart: u32, [x, y]: [f64; 2]) -> Option<usize> {
        let distance = |place: usize| {
            let [column, row] = self.texel(place).map(f64::from);
            (column - x).powi(2) + (row - y).powi(2)
        };
        let own = (0..self.texels.len()).filter(|&place| self.charts[place] == chart);
        // Rings about the place hold it mostly: a fragment lies on its chart.
        let [column, row] = [x, y].map(|at| at.round() as i64);
        for ring in 1..=NEAR {
            let around = (-ring..=ring).flat_map(|down| (-ring..=ring).map(move |along| (along, down)));
            let around = around.filter_map(|(along, down)| self.place(column + along, row + down));
            let nearest = around
                .filter(|&place| self.charts[place] == chart)
                .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            // Beyond the ring nothing is nearer than its half width.
            if let Some(nearest) = nearest.filter(|&place| distance(place) <= (ring as f64).powi(2)) {
                return Some(nearest);
            }
        }
        own.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
    }

    /// The place of a texel among those that are covered; `None` for one that is not, or lies outside.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, column: i64, row: i64) -> Option<usize> {
        let inside = |at: i64| (0..i64::from(self.size)).contains(&at);
        if !inside(column) || !inside(row) {
            return None;
        }
        let [place, _] = self.cells[row as usize * self.size as usize + column as usize];
        (place != EMPTY).then_some(place as usize)
    }

    /// The texels that are filled beyond those that are covered, for lookups by one fetch.
    #[must_use]
    #[inline]
    pub fn dilation(&self) -> &Dilation {
        let number = |texel: u32| Some(self.cells[texel as usize][0]).filter(|&place| place != EMPTY);
        self.dilation.get_or_init(|| Dilation::new(self.size, self.covered(), number))
    }

    /// What stands beyond the charts' borders; nothing where these are cut.
    #[must_use]
    pub const fn margins(&self) -> &Margins {
        &self.margins
    }

    /// The texel of a chart at a place, of its [margin](Self::margins) beyond its border; `None` where there is neither.
    #[inline(always)]
    #[must_use]
    pub fn place_of_chart(&self, chart: u32, column: i64, row: i64) -> Option<usize> {
        let own = self.place(column, row).filter(|&place| self.charts[place] == chart);
        if own.is_some() || self.margins.is_empty() {
            return own;
        }
        let inside = |at: i64| (0..i64::from(self.size)).contains(&at);
        let texel = (inside(column) && inside(row)).then(|| row as u32 * self.size + column as u32)?;
        self.margins.number(chart, texel)
    }

    /// The atlas along an axis.
    #[must_use]
    pub fn along(&self, axis: Axis) -> Along<'_> {
        Along::new(self, axis, self.known.get_or_init(|| known(self)))
    }

    /// Which texel each covered one is, row by row.
    #[inline(always)]
    pub(super) fn texels(&self) -> &[u32] {
        &self.texels
    }

    /// For each texel, row by row, its place among those that are covered, and its chart; [`EMPTY`] and 0.
    #[inline(always)]
    pub(super) fn cells(&self) -> &[[u32; 2]] {
        &self.cells
    }

    /// The row of a record that holds a number; `None` where the records lack it.
    #[must_use]
    pub fn row(&self, input: &Input) -> Option<usize> {
        self.inputs.iter().position(|held| held == input)
    }

    /// The records: sixteen covered texels each, in their order.
    #[must_use]
    pub const fn rows(&self) -> &Rows {
        &self.rows
    }
}

impl Texels for Atlas {
    #[inline]
    fn size(&self) -> u32 {
        self.size
    }

    fn at(&self, column: i64, row: i64) -> Option<(u32, u32)> {
        self.place(column, row).map(|place| (place as u32, self.charts[place]))
    }
}

/// The places of texels with the charts of those that are covered, which count from 1: no empty texel is of a chart.
fn cells(places: &[u32], charts: &[u32]) -> Vec<[u32; 2]> {
    let chart = |place: u32| charts.get(place as usize).copied().unwrap_or(0);
    places.iter().map(|&place| [place, chart(place)]).collect()
}

/// Rings about a place in which a chart's nearest texel is looked for before all of them are.
const NEAR: i64 = 4;

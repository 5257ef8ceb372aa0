//! Texels of the UV atlas as samples: the mesh rasterised with its texture coordinates as positions.
//!
//! As a graphics adapter draws it: a texel is covered where its centre lies in a triangle, edges by the top-left rule
//! (Direct3D and Vulkan alike), both sides, without depth; where triangles overlap, the later one stays. Covered texels
//! stand row by row, sixteen a record, each with what the effects' rules read of it and nothing else.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use glam::{DVec2, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::LANES;
use super::dilation::Dilation;
use super::footprint::{Footprint, filtered};
use super::posed::PosedSurface;
use super::rows::Rows;
use super::seams::{Margins, Texels};
use super::trace::Hit;
use crate::model::diffusion::Seams;
use crate::model::evaluate::Setup;
use crate::model::fields;
use crate::program::graph::Input;
use crate::program::levels::texel_inputs;
use crate::program::lower::{STEP_ALONG_U, STEP_ALONG_V};
use crate::program::shading::ShadingError;
use crate::scene::maps::{Map, Maps};
use crate::scene::mesh::{PosedMesh, tile_outside_atlas};
use crate::scene::mip_maps::MipMaps;
use crate::shader::Facts;
use crate::shader::atlas::Axis;
use crate::shader::facts::FaceSizes;

/// A texel that the mesh does not cover.
const EMPTY: u32 = u32::MAX;

/// Texels that cannot be had.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum AtlasError {
    /// Nothing tells where the mesh lies.
    #[error(
        "the mesh has no texture coordinates, but the enabled effects are computed in texels of its UV atlas. Give a \
         mesh with TEXCOORD_0, or leave the effects out."
    )]
    NoUvs,
    /// A tiled mesh: several places would share a texel.
    #[error(
        "texture coordinates lie in the tile ({u}, {v}), but effects that are computed in the UV atlas need all of \
         them in the unit square. Lay the mesh out there, or leave those effects out."
    )]
    Outside {
        /// The tile's column.
        u: f32,
        /// The tile's row.
        v: f32,
    },
    /// Texels that are of two places of the surface.
    #[error(
        "{:.1}% of the texels that the mesh covers of its UV atlas are of two or more places of the surface (mirrored or \
         overlapping charts), and a texel cannot hold two lights. Unwrap the mesh so that its charts lie apart, or leave the effects out that are computed there.",
        100.0 * share
    )]
    Overlap {
        /// Their share of the covered texels.
        share: f64,
    },
    /// A quantity that texels do not hold, or whose step to the next texel is not known.
    #[error("`{quantity}` is not stored with texels: dpdx and dpdy are there for what vertices hold.")]
    NotStored {
        /// The quantity.
        quantity: String,
    },
    /// The effects cannot be computed.
    #[error(transparent)]
    Shading(#[from] ShadingError),
}

/// The texels that a mesh covers, and what rules read of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    size: u32,
    /// For each texel, row by row, its place among those that are covered.
    places: Vec<u32>,
    /// Which texel each covered one is.
    texels: Vec<u32>,
    /// The chart of each covered texel, counted from 1.
    charts: Vec<u32>,
    /// What records hold, row by row.
    inputs: Vec<Input>,
    rows: Rows,
    /// Made where it is asked for.
    dilation: OnceLock<Dilation>,
    /// Along u and v.
    room: OnceLock<[Vec<u8>; 2]>,
    margins: Margins,
}

impl Atlas {
    /// The texels of a mesh as it is posed, `size` a side, with what the effects of `setup` read. All cores; the same
    /// for any number of threads.
    ///
    /// # Errors
    /// When the mesh has no texture coordinates, or does not lie in the unit square; or the effects cannot be computed.
    pub fn new(setup: &Setup, posed: &PosedSurface<'_>, maps: &Maps, size: u32) -> Result<Self, AtlasError> {
        check(posed.mesh)?;
        let any = FaceSizes { irradiance: Some(1), specular: Some(1), hilite: Some(1), reflected: Some(1) };
        // Turned or not, the same is read.
        let inputs = texel_inputs(&Facts::of_samples(*setup, any, true))?;
        let find = |field, hit, numbers: &mut [f32]| posed.field(field, hit, numbers);
        let (mesh, occlusion) = (posed.mesh, posed.open.as_deref());
        let mip_maps = posed.mip_maps.as_deref();
        let mesh = Textured { posed: mesh, occlusion, maps, mip_maps, find: &find, size: f64::from(size) };
        let fields = inputs.iter().map(Field::of).collect::<Result<Vec<_>, _>>()?;
        let (triangles, share) = cover(&mesh, size);
        if share > OVERLAP {
            return Err(AtlasError::Overlap { share });
        }
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
                    let triangle = mesh.triangle(triangles[texel as usize]);
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
            places,
            texels,
            charts,
            inputs,
            rows,
            dilation: OnceLock::new(),
            room: OnceLock::new(),
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
        let charts = texels.iter().map(|&texel| charts[texel as usize]).collect();
        let (dilation, room) = (OnceLock::new(), OnceLock::new());
        Self { size, places, texels, charts, inputs, rows, dilation, room, margins: Margins::default() }
    }

    /// The same, but lookups by one fetch find in each empty texel what another shows, which is covered: pairs of texels,
    /// row by row.
    #[must_use]
    pub fn with_shown(mut self, shown: impl IntoIterator<Item = (u32, u32)>) -> Self {
        let place = |texel: u32| Some(self.places[texel as usize]).filter(|&place| place != EMPTY);
        let shown = shown.into_iter().filter(|&(texel, _)| place(texel).is_none());
        let shown = shown.filter_map(|(texel, of)| Some((texel, place(of)?)));
        self.dilation = OnceLock::from(Dilation::of_copies(shown));
        self
    }

    /// Texels along a side.
    #[must_use]
    pub const fn size(&self) -> u32 {
        self.size
    }

    /// How many texels are covered.
    #[must_use]
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
        let place = self.places[row as usize * self.size as usize + column as usize];
        (place != EMPTY).then_some(place as usize)
    }

    /// The texels that are filled beyond those that are covered, for lookups by one fetch.
    #[must_use]
    pub fn dilation(&self) -> &Dilation {
        let number = |texel: u32| Some(self.places[texel as usize]).filter(|&place| place != EMPTY);
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

    /// How many texels on either side of a covered one are of its chart, without a gap; 255 of more.
    #[inline(always)]
    #[must_use]
    pub fn room(&self, axis: Axis, place: usize) -> i32 {
        let [along_u, along_v] = self.room.get_or_init(|| [Axis::U, Axis::V].map(|axis| room(self, axis)));
        i32::from(match axis {
            Axis::U => along_u[place],
            Axis::V => along_v[place],
        })
    }

    /// The texel so many steps from a covered one, no further than it has [room](Self::room).
    #[inline(always)]
    #[must_use]
    pub fn place_within(&self, axis: Axis, place: usize, step: i32) -> u32 {
        match axis {
            // Row by row.
            Axis::U => (place as i32 + step) as u32,
            Axis::V => self.places[(self.texels[place] as i32 + step * self.size as i32) as usize],
        }
    }

    /// The texel of the same chart so many steps from a covered one, [`Self::place_of_chart`].
    #[inline(always)]
    #[must_use]
    pub fn place_along(&self, axis: Axis, place: usize, step: i64) -> Option<usize> {
        let [column, row] = self.texel(place).map(i64::from);
        let chart = self.charts[place];
        match axis {
            Axis::U => self.place_of_chart(chart, column.saturating_add(step), row),
            Axis::V => self.place_of_chart(chart, column, row.saturating_add(step)),
        }
    }

    /// The row of a record that holds a number; `None` where it was not asked for.
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
    fn size(&self) -> u32 {
        self.size
    }

    fn at(&self, column: i64, row: i64) -> Option<(u32, u32)> {
        self.place(column, row).map(|place| (place as u32, self.charts[place]))
    }
}

/// Each covered texel's room along an axis, as far as a byte goes.
fn room(atlas: &Atlas, axis: Axis) -> Vec<u8> {
    // In their order those before a texel are counted first, and against it those after.
    let mut sides = [-1, 1].map(|side| (side, vec![0_u8; atlas.covered()]));
    for (side, counts) in &mut sides {
        let count = |at: usize, counts: &[u8]| {
            let next = atlas.place_along(axis, at, *side).filter(|&next| next < counts.len());
            next.map_or(0, |next| counts[next].saturating_add(1))
        };
        for k in 0..counts.len() {
            let at = if *side < 0 { k } else { counts.len() - 1 - k };
            counts[at] = count(at, counts);
        }
    }
    let [(_, before), (_, after)] = sides;
    before.into_iter().zip(after).map(|(before, after)| before.min(after)).collect()
}

/// Rings about a place in which a chart's nearest texel is looked for before all of them are.
const NEAR: i64 = 4;

/// The share of covered texels that may be of two places: rounding at the borders of triangles makes a few.
const OVERLAP: f64 = 1e-3;

/// Which texels are not empty, and each texel's place among them.
fn covered(shown: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let texels: Vec<u32> = (0..shown.len() as u32).filter(|&texel| shown[texel as usize] != EMPTY).collect();
    let mut places = vec![EMPTY; shown.len()];
    texels.iter().enumerate().for_each(|(place, &texel)| places[texel as usize] = place as u32);
    (texels, places)
}

/// Whether light can stand in an atlas of `size` texels a side, laid out by these texture coordinates.
///
/// # Errors
/// When there are none, they do not lie in the unit square, or too many texels are of two places.
pub fn overlap(uvs: &[Vec2], triangles: &[[u32; 3]], size: u32) -> Result<(), AtlasError> {
    let posed = PosedMesh { uvs: uvs.to_vec(), triangles: triangles.to_vec(), ..PosedMesh::default() };
    check(&posed)?;
    let (maps, find) = (Maps::default(), |_: fields::Field, _: Hit, _: &mut [f32]| {});
    let mesh = Textured {
        posed: &posed,
        occlusion: None,
        maps: &maps,
        mip_maps: None,
        find: &find,
        size: f64::from(size),
    };
    let (_, share) = cover(&mesh, size);
    if share > OVERLAP { Err(AtlasError::Overlap { share }) } else { Ok(()) }
}

fn check(posed: &PosedMesh) -> Result<(), AtlasError> {
    if posed.uvs.is_empty() {
        return Err(AtlasError::NoUvs);
    }
    match tile_outside_atlas(&posed.uvs) {
        Some([u, v]) => Err(AtlasError::Outside { u, v }),
        None => Ok(()),
    }
}

/// Where a texel is sampled, in texels.
fn centre(texel: u32, size: u32) -> DVec2 {
    DVec2::new(f64::from(texel % size), f64::from(texel / size)) + 0.5
}

/// A mesh as it lies in an atlas of `size` texels a side.
struct Textured<'a> {
    posed: &'a PosedMesh,
    occlusion: Option<&'a [f32]>,
    maps: &'a Maps,
    /// Their coarser levels, where they are filtered over a texel.
    mip_maps: Option<&'a MipMaps>,
    /// What finds a field of samples at a point of the mesh.
    find: &'a (dyn Fn(fields::Field, Hit, &mut [f32]) + Sync),
    size: f64,
}

/// A triangle in the atlas, counter-clockwise as v runs downwards: its vertices, and their places in texels.
struct Triangle {
    index: u32,
    /// Whether its second and third vertex changed places.
    turned: bool,
    vertices: [usize; 3],
    corners: [DVec2; 3],
}

impl Textured<'_> {
    /// A map at texture coordinates, over a texel of the atlas; `neutral` where there is none.
    fn map<const C: usize>(
        &self,
        pick: impl Fn(&Maps) -> Option<&Map<C>>,
        neutral: [f32; C],
        uv: Vec2,
    ) -> [f32; C] {
        let Some(map) = pick(self.maps) else { return neutral };
        let step = 1.0 / self.size;
        match self.mip_maps {
            Some(mip_maps) => filtered(map, mip_maps, pick, uv, &Footprint::new([step, 0.0], [0.0, step])),
            None => map.sample(uv.x, uv.y),
        }
    }

    fn triangle(&self, index: u32) -> Triangle {
        let mut vertices = self.posed.triangles[index as usize].map(|i| i as usize);
        let corner = |i: usize| self.size * self.posed.uvs[i].as_dvec2();
        let [a, b, c] = vertices.map(corner);
        let turned = (b - a).perp_dot(c - a) < 0.0;
        if turned {
            vertices.swap(1, 2);
        }
        Triangle { index, turned, corners: vertices.map(corner), vertices }
    }
}

impl Triangle {
    /// Twice the area of the triangle between each edge and a place; the edge lies opposite to the vertex.
    fn areas(&self, at: DVec2) -> [f64; 3] {
        let [a, b, c] = self.corners;
        [[b, c], [c, a], [a, b]].map(|[from, to]| (to - from).perp_dot(at - from))
    }

    /// Whether a place is drawn: inside, or on an edge that is the triangle's top or on its left.
    fn covers(&self, at: DVec2) -> bool {
        let [a, b, c] = self.corners;
        let edges = [c - b, a - c, b - a];
        // The inside lies to the right of an edge that goes up, below one that goes right.
        let drawn = |edge: DVec2| edge.y < 0.0 || (edge.y == 0.0 && edge.x > 0.0);
        let areas = self.areas(at);
        edges.into_iter().zip(areas).all(|(edge, area)| area > 0.0 || (area == 0.0 && drawn(edge)))
    }

    /// The point of the mesh where its vertices count so much.
    fn hit(&self, [_, mut u, mut v]: [f64; 3]) -> Hit {
        if self.turned {
            std::mem::swap(&mut u, &mut v);
        }
        Hit { triangle: self.index, barycentric: [u as f32, v as f32] }
    }

    /// What each vertex counts at a place.
    fn weights(&self, at: DVec2) -> [f64; 3] {
        let areas = self.areas(at);
        let sum: f64 = areas.iter().sum();
        areas.map(|area| area / sum)
    }

    /// How the weights change from a texel to its right neighbour, and to the one below.
    fn steps(&self) -> [[f64; 3]; 2] {
        let [a, b, c] = self.corners;
        let area = (b - a).perp_dot(c - a);
        let edges = [c - b, a - c, b - a];
        [edges.map(|edge| -edge.y / area), edges.map(|edge| edge.x / area)]
    }
}

/// For each texel the triangle that it shows, and the share of those that are of several.
fn cover(mesh: &Textured<'_>, size: u32) -> (Vec<u32>, f64) {
    let texels = size as usize * size as usize;
    // The last triangle stays whatever thread comes last; 0 is none.
    let shown: Vec<AtomicU32> = (0..texels).map(|_| AtomicU32::new(0)).collect();
    let again = AtomicUsize::new(0);
    (0..mesh.posed.triangles.len() as u32).into_par_iter().for_each(|index| {
        let triangle = mesh.triangle(index);
        let [a, b, c] = triangle.corners;
        if (b - a).perp_dot(c - a) == 0.0 {
            return;
        }
        let most = f64::from(size);
        let low = (a.min(b).min(c) - 0.5).ceil().clamp(DVec2::ZERO, DVec2::splat(most));
        let high = (a.max(b).max(c) + 0.5).floor().clamp(DVec2::ZERO, DVec2::splat(most));
        for row in low.y as u32..high.y as u32 {
            for column in low.x as u32..high.x as u32 {
                let texel = row * size + column;
                if triangle.covers(centre(texel, size)) {
                    let before = shown[texel as usize].fetch_max(index + 1, Ordering::Relaxed);
                    again.fetch_add(usize::from(before > 0), Ordering::Relaxed);
                }
            }
        }
    });
    let shown: Vec<u32> =
        shown.into_iter().map(|shown| shown.into_inner().checked_sub(1).unwrap_or(EMPTY)).collect();
    let once = shown.iter().filter(|&&shown| shown != EMPTY).count();
    let share = again.into_inner().min(once) as f64 / once.max(1) as f64;
    (shown, share)
}

/// One number of a texel.
struct Field {
    of: Quantity,
    component: usize,
    step: Option<usize>,
}

/// What texels hold ([`crate::shader::emit::TEXEL`]).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Position,
    Normal,
    Tangent,
    Bitangent,
    Uv,
    Occlusion,
    Color,
    Specular,
    Attenuator,
    NormalMap,
    /// What files of rules declare.
    Declared(fields::Field),
    /// Of those, what is found at each texel by itself.
    Found(fields::Field),
}

impl Field {
    fn of(input: &Input) -> Result<Self, AtlasError> {
        let steps = [STEP_ALONG_U, STEP_ALONG_V];
        let step = steps.iter().position(|prefix| input.name.starts_with(prefix));
        let name = step.map_or(&*input.name, |axis| &input.name[steps[axis].len()..]);
        let of = match name {
            "vertex_position" => Quantity::Position,
            "vertex_normal" => Quantity::Normal,
            "vertex_tangent" => Quantity::Tangent,
            "vertex_bitangent" => Quantity::Bitangent,
            "vertex_uv" => Quantity::Uv,
            "vertex_occlusion" => Quantity::Occlusion,
            "albedo" if step.is_none() => Quantity::Color,
            "specular" if step.is_none() => Quantity::Specular,
            "attenuator" if step.is_none() => Quantity::Attenuator,
            "normal_texel" if step.is_none() => Quantity::NormalMap,
            other => match fields::Field::from_name(other) {
                Some(field) if field.is_of_vertices() => Quantity::Declared(field),
                Some(field) if step.is_none() => Quantity::Found(field),
                _ => return Err(AtlasError::NotStored { quantity: name.to_owned() }),
            },
        };
        Ok(Self { of, component: input.component, step })
    }

    fn value(&self, mesh: &Textured<'_>, triangle: &Triangle, weights: [f64; 3]) -> f32 {
        let uv = || {
            let corner = |i: usize| weights[i] * mesh.posed.uvs[triangle.vertices[i]].as_dvec2();
            (0..3).map(corner).sum::<DVec2>().as_vec2()
        };
        let c = self.component;
        match self.of {
            Quantity::Color => mesh.map(|maps| maps.color.as_ref(), [1.0; 3], uv())[c],
            Quantity::Specular => mesh.map(|maps| maps.specular.as_ref(), [1.0], uv())[0],
            Quantity::Attenuator => mesh.map(|maps| maps.attenuator.as_ref(), [1.0], uv())[0],
            Quantity::NormalMap => mesh.map(|maps| maps.normal.as_ref(), [0.5, 0.5, 1.0], uv())[c],
            Quantity::Found(field) => {
                let mut numbers = [0.0; fields::MOST_NUMBERS];
                (mesh.find)(field, triangle.hit(weights), &mut numbers[..field.info().numbers]);
                numbers[c]
            }
            _ => {
                let weights = self.step.map_or(weights, |axis| triangle.steps()[axis]);
                (0..3).map(|i| weights[i] * self.of_vertex(mesh, triangle.vertices[i])).sum::<f64>() as f32
            }
        }
    }

    /// Of a vertex; 0 where the mesh lacks it, but for the open share of the hemisphere.
    fn of_vertex(&self, mesh: &Textured<'_>, i: usize) -> f64 {
        let PosedMesh { positions, normals, tangents, uvs, .. } = mesh.posed;
        let vector = |of: &[Vec3]| of.get(i).map_or(0.0, |v| v[self.component]);
        let tangent = || tangents.get(i).copied().unwrap_or(Vec4::ZERO);
        f64::from(match self.of {
            Quantity::Position => vector(positions),
            Quantity::Normal => vector(normals),
            Quantity::Tangent => tangent()[self.component],
            Quantity::Bitangent => {
                let (n, t) = (normals.get(i).copied().unwrap_or_default(), tangent());
                (t.w * n.cross(t.truncate()).normalize_or_zero())[self.component]
            }
            Quantity::Uv => uvs[i][self.component],
            Quantity::Declared(field) => {
                let held = mesh.posed.fields.iter().find(|held| held.field == field);
                held.map_or(field.info().neutral, |held| held.of(i)[self.component])
            }
            _ => mesh.occlusion.and_then(|open| open.get(i).copied()).unwrap_or(1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::texture_filter::TextureFilter;

    fn mesh(uvs: &[[f32; 2]], triangles: &[[u32; 3]]) -> Textured<'static> {
        let posed = PosedMesh {
            positions: uvs.iter().map(|&[u, v]| Vec3::new(3.0 * u, v, 1.0)).collect(),
            uvs: uvs.iter().copied().map(Vec2::from).collect(),
            triangles: triangles.to_vec(),
            ..PosedMesh::default()
        };
        let maps = Box::leak(Box::<Maps>::default());
        let find = &|field: fields::Field, _, numbers: &mut [f32]| numbers.fill(field.info().neutral);
        Textured { posed: Box::leak(Box::new(posed)), occlusion: None, maps, mip_maps: None, find, size: 8.0 }
    }

    #[test]
    fn centres_on_shared_edges_belong_to_one_triangle_and_on_outer_ones_to_the_top_and_left() {
        // From centre to centre: a square whose edges and diagonal go through centres.
        let [low, high] = [1.5 / 8.0, 4.5 / 8.0];
        let corners = [[low, low], [high, low], [high, high], [low, high]];
        for triangles in [[[0, 1, 2], [0, 2, 3]], [[2, 1, 0], [3, 2, 0]]] {
            let (shown, again) = cover(&mesh(&corners, &triangles), 8);
            assert_eq!(again, 0.0);
            for (i, shown) in shown.iter().enumerate() {
                let inside = (1..4).contains(&(i % 8)) && (1..4).contains(&(i / 8));
                assert_eq!(*shown != EMPTY, inside, "{} {}", i % 8, i / 8);
            }
        }
    }

    #[test]
    fn of_triangles_that_overlap_the_later_one_stays_and_steps_are_exact() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let mesh = mesh(&corners, &[[0, 1, 2], [2, 1, 0], [0, 0, 1]]);
        let (shown, again) = cover(&mesh, 8);
        // Two lie on one another.
        assert_eq!(again, 1.0);
        assert!(shown.iter().all(|&triangle| triangle == 1 || triangle == EMPTY));
        assert!((27..=36).contains(&shown.iter().filter(|&&triangle| triangle == 1).count()));
        let triangle = mesh.triangle(1);
        let input = |name: &str, component| Input { name: name.to_owned(), component };
        let value = |name, component| {
            let field = Field::of(&input(name, component)).unwrap();
            field.value(&mesh, &triangle, triangle.weights(DVec2::new(2.5, 1.5)))
        };
        // All of these are sums of few halves.
        assert_eq!([value("vertex_position", 0), value("vertex_uv", 1)], [3.0 * 2.5 / 8.0, 1.5 / 8.0]);
        assert_eq!([value("dpdx_vertex_position", 0), value("dpdy_vertex_position", 0)], [3.0 / 8.0, 0.0]);
        assert_eq!(value("vertex_occlusion", 0), 1.0);
        let error = Field::of(&input("dpdx_albedo", 0)).err().unwrap();
        assert_eq!(error, AtlasError::NotStored { quantity: "albedo".to_owned() });
    }

    #[test]
    fn maps_are_read_over_a_texel_where_they_are_filtered() {
        // Checks of a texel, 64 texels a side, of which one of the atlas covers eight.
        let check = |i: usize| [((i % 64 + i / 64) % 2) as f32];
        let specular = Some(Map { width: 64, height: 64, texels: (0..64 * 64).map(check).collect() });
        let maps = Maps { specular, ..Maps::default() };
        let value = |mip_maps: Option<&MipMaps>| {
            let bare = mesh(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], &[[0, 1, 2]]);
            let mesh = Textured { maps: &maps, mip_maps, ..bare };
            let field = Field::of(&Input { name: "specular".to_owned(), component: 0 }).unwrap();
            let triangle = mesh.triangle(0);
            // At the centre of a texel of the map.
            field.value(&mesh, &triangle, triangle.weights(DVec2::splat(2.5 + 1.0 / 16.0)))
        };
        assert_eq!(value(None), 0.0);
        for filter in [TextureFilter::Trilinear, TextureFilter::Anisotropic] {
            assert_eq!(value(MipMaps::new(&maps, filter).as_ref()), 0.5);
        }
    }

    #[test]
    fn a_mesh_must_lie_in_the_atlas() {
        let uvs = vec![Vec2::new(0.5, 0.5), Vec2::new(1.5, -0.5)];
        let tiled = PosedMesh { uvs, ..PosedMesh::default() };
        assert_eq!(check(&tiled).unwrap_err(), AtlasError::Outside { u: 1.0, v: -1.0 });
        assert_eq!(check(&PosedMesh::default()).unwrap_err(), AtlasError::NoUvs);
    }
}

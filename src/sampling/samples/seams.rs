//! What lies across the seams of an atlas (MODEL 6.4, `seams = "joined"`): a margin beyond each chart's border.
//!
//! A mesh is cut open where its charts end. There two borders are one edge of the surface: the same two places, other
//! texture coordinates. A texel beyond such a border, within [`MARGIN`] texels of it, stands for the place that it would be
//! of, were the triangle across the edge unfolded into the plane of the one on this side; what is there is looked up
//! bilinearly among the texels of the chart across, so a margin is a fixed linear map of texels, and what moves goes through
//! the same. Beyond a border of the mesh itself there is nothing.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{DMat2, DVec2, Vec3};

use crate::model::real::Real;
use crate::scene::mesh::PosedMesh;

/// How many texels a margin is wide. Taps that go further find nothing there, as beyond a border that is cut.
const MARGIN: f64 = 16.0;

/// The texel numbers that one of a margin is made of, and what each counts.
type Shares = [(u32, f32); 4];

/// The margins of an atlas' charts; none where borders are cut.
///
/// Their texels are numbered on from the covered ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Margins {
    /// How many texels are covered.
    covered: usize,
    /// The number of each texel, by the chart whose margin it is in and its place in the atlas.
    numbers: HashMap<(u32, u32), u32>,
    shares: Vec<Shares>,
}

/// A border of a chart: an edge of a triangle that no other triangle has in the atlas.
struct Border {
    chart: u32,
    /// Where the edge runs from and to, and the triangle's third corner, in texels.
    texels: [DVec2; 3],
    /// How long the edge is on the surface, and where the third corner is: how far along, and how far from it.
    length: f64,
    third: DVec2,
}

/// The texels of an atlas by their places; which of them are covered, and by which chart.
pub(super) trait Texels {
    /// Texels a side.
    fn size(&self) -> u32;
    /// Number and chart of a covered texel.
    fn at(&self, column: i64, row: i64) -> Option<(u32, u32)>;
}

impl Margins {
    /// Of a mesh, `charts` being those of its vertices (without any all are 1), over `texels`, of which `covered` are.
    pub(super) fn new(mesh: &PosedMesh, charts: &[u32], texels: &impl Texels, covered: usize) -> Self {
        let size = texels.size();
        let (borders, across) = borders(mesh, charts, f64::from(size));
        // Of each chart's margin every texel belongs to the nearest border; of those as near to the first.
        let mut nearest: HashMap<(u32, u32), (f64, usize)> = HashMap::new();
        for (index, border) in borders.iter().enumerate() {
            for [column, row] in border.near(size) {
                let centre = DVec2::new(f64::from(column), f64::from(row)) + 0.5;
                let own = texels
                    .at(i64::from(column), i64::from(row))
                    .is_some_and(|(_, chart)| chart == border.chart);
                let distance = border.distance(centre);
                if own || distance > MARGIN || border.beyond(centre).y <= 0.0 {
                    continue;
                }
                let found =
                    nearest.entry((border.chart, row * size + column)).or_insert((f64::INFINITY, index));
                if distance < found.0 {
                    *found = (distance, index);
                }
            }
        }
        let mut order: Vec<((u32, u32), usize)> =
            nearest.into_iter().map(|(texel, (_, border))| (texel, border)).collect();
        order.sort_unstable();
        let mut margins = Self { covered, ..Self::default() };
        for ((chart, texel), border) in order {
            let Some(twin) = across[border].map(|twin| &borders[twin]) else { continue };
            let centre = DVec2::new(f64::from(texel % size), f64::from(texel / size)) + 0.5;
            let place = twin.within(borders[border].beyond(centre));
            let Some(shares) = shares(texels, twin.chart, place - 0.5) else { continue };
            margins.numbers.insert((chart, texel), (covered + margins.shares.len()) as u32);
            margins.shares.push(shares);
        }
        margins
    }

    /// The number of a texel, by its place in the atlas row by row, in a chart's margin.
    #[inline]
    #[must_use]
    pub fn number(&self, chart: u32, texel: u32) -> Option<usize> {
        self.numbers.get(&(chart, texel)).map(|&number| number as usize)
    }

    /// What each of their texels is made of, in the order of their numbers.
    #[must_use]
    pub fn shares(&self) -> &[[(u32, f32); 4]] {
        &self.shares
    }

    /// Whether there are none.
    #[must_use]
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.shares.is_empty()
    }

    /// A level of the covered texels, followed by those of the margins. Of differences to one texel: what is alike everywhere
    /// stays so to the bit.
    #[must_use]
    pub fn added<'a, R: Real + From<f32>>(&self, level: &'a [[R; 3]]) -> Cow<'a, [[R; 3]]> {
        if self.is_empty() {
            return Cow::Borrowed(level);
        }
        let texel = |shares: &Shares| -> [R; 3] {
            let first = level[shares[0].0 as usize];
            std::array::from_fn(|c| {
                shares.iter().fold(first[c], |sum, &(at, share)| {
                    sum + R::from(share) * (level[at as usize][c] - first[c])
                })
            })
        };
        Cow::Owned(level.iter().copied().chain(self.shares.iter().map(texel)).collect())
    }
}

impl Border {
    /// Where a place of the atlas lies, the triangle's plane going on: how far along the edge, and how far beyond it.
    fn beyond(&self, at: DVec2) -> DVec2 {
        let [from, to, third] = self.texels;
        let shares = DMat2::from_cols(to - from, third - from).inverse() * (at - from);
        DVec2::new(self.length * shares.x + self.third.x * shares.y, -self.third.y * shares.y)
    }

    /// The place of the atlas that lies so far along the edge, and so far within it.
    fn within(&self, at: DVec2) -> DVec2 {
        let [from, to, third] = self.texels;
        let share = at.y / self.third.y;
        from + (at.x - share * self.third.x) / self.length * (to - from) + share * (third - from)
    }

    /// How far a place is from the edge, in texels.
    fn distance(&self, at: DVec2) -> f64 {
        let [from, to, _] = self.texels;
        let along = to - from;
        let share = ((at - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        at.distance(from + share * along)
    }

    /// Texels that may be within a margin's width.
    fn near(&self, size: u32) -> impl Iterator<Item = [u32; 2]> {
        let [from, to, _] = self.texels;
        let most = DVec2::splat(f64::from(size));
        let low = (from.min(to) - MARGIN - 1.0).clamp(DVec2::ZERO, most);
        let high = (from.max(to) + MARGIN + 1.0).clamp(DVec2::ZERO, most);
        let columns = low.x as u32..high.x as u32;
        (low.y as u32..high.y as u32).flat_map(move |row| columns.clone().map(move |column| [column, row]))
    }
}

/// The charts' borders, and for each which of them is the same edge of the surface.
fn borders(mesh: &PosedMesh, charts: &[u32], size: f64) -> (Vec<Border>, Vec<Option<usize>>) {
    let PosedMesh { positions, triangles, .. } = mesh;
    let uvs = mesh.atlas_uvs();
    // Vertices that a file splits where normals jump are one: what counts is where they are. -0 and 0 are one place.
    let bits = |x: f32| (x + 0.0).to_bits();
    let place = |i: u32| positions[i as usize].to_array().map(bits);
    let corner = |i: u32| (place(i), uvs[i as usize].to_array().map(bits));
    let edges = || triangles.iter().flat_map(|&[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]]);
    let mut uses: HashMap<_, usize> = HashMap::new();
    for [a, b, _] in edges() {
        let (a, b) = (corner(a), corner(b));
        *uses.entry((a.min(b), a.max(b))).or_default() += 1;
    }
    let (mut borders, mut places) = (Vec::new(), Vec::new());
    for [a, b, c] in edges() {
        let [from, to] = [corner(a), corner(b)];
        if uses[&(from.min(to), from.max(to))] != 1 {
            continue;
        }
        // Each edge runs the same way on both its sides.
        let [a, b] = if place(a) <= place(b) { [a, b] } else { [b, a] };
        let [from, to, third] = [a, b, c].map(|i| positions[i as usize]);
        if let Some((length, third)) = laid_out(from, to, third) {
            let texels = [a, b, c].map(|i| size * uvs[i as usize].as_dvec2());
            // A triangle without an area in the atlas covers nothing there.
            if (texels[1] - texels[0]).perp_dot(texels[2] - texels[0]) != 0.0 {
                let chart = charts.get(a as usize).copied().unwrap_or(1);
                borders.push(Border { chart, texels, length, third });
                places.push((place(a), place(b)));
            }
        }
    }
    let mut of_place: HashMap<_, Vec<usize>> = HashMap::new();
    places.iter().enumerate().for_each(|(index, place)| of_place.entry(*place).or_default().push(index));
    // Of three or more sheets that meet nobody knows which goes on in which.
    let twin = |(index, place)| match of_place[place].as_slice() {
        &[a, b] => Some(if a == index { b } else { a }),
        _ => None,
    };
    let across = places.iter().enumerate().map(twin).collect();
    (borders, across)
}

/// A triangle in its plane: how long its edge is, and where its third corner lies along and from it; `None` without an area.
fn laid_out(from: Vec3, to: Vec3, third: Vec3) -> Option<(f64, DVec2)> {
    let [from, to, third] = [from, to, third].map(Vec3::as_dvec3);
    let length = from.distance(to);
    let along = (third - from).dot(to - from) / length;
    let height = (to - from).cross(third - from).length() / length;
    (length > 0.0 && height > 0.0).then_some((length, DVec2::new(along, height)))
}

/// What of a chart is found at a place between texels' centres, bilinearly. Where one of the four texels is not of the chart the
/// four beside them go on in a straight line, so that what is linear stays so up to the border; where these are not, the
/// chart's among the four count alone. `None` without any.
fn shares(texels: &impl Texels, chart: u32, at: DVec2) -> Option<Shares> {
    let low = at.floor();
    let (column, row) = (low.x as i64, low.y as i64);
    let found = |k: usize, [along, down]: [i64; 2]| {
        let (right, below) = ((k & 1) as i64, (k >> 1) as i64);
        let texel = texels.at(column + along + right, row + down + below).filter(|(_, of)| *of == chart);
        let f = at - low - DVec2::new(along as f64, down as f64);
        let share = |f: f64, side: i64| if side == 1 { f } else { 1.0 - f };
        texel.map(|(number, _)| (number, share(f.x, right) * share(f.y, below)))
    };
    let beside = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];
    for step in beside {
        let four = [0, 1, 2, 3].map(|k| found(k, step));
        if let [Some(a), Some(b), Some(c), Some(d)] = four {
            return Some([a, b, c, d].map(|(number, share)| (number, share as f32)));
        }
    }
    let own: Vec<(u32, f64)> = (0..4).filter_map(|k| found(k, [0, 0])).collect();
    let sum: f64 = own.iter().map(|(_, share)| share).sum();
    let first = own.first().filter(|_| sum > 0.0)?.0;
    Some(std::array::from_fn(|k| {
        own.get(k).map_or((first, 0.0), |&(number, share)| (number, (share / sum) as f32))
    }))
}

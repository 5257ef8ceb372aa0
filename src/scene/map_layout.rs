//! Maps laid out beyond their borders, where the file's samplers mirror or clamp them (glTF 2.0, section 5.26).
//!
//! The model has one lookup, which repeats. Where the skin comes within half a texel of such a border, or beyond it, all maps
//! are unrolled over what its texture coordinates cover, and these are moved to where they find the same there: engines,
//! adapters, coarser levels and exports then know of nothing but pictures that repeat.

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use super::maps::{Map, Maps, OwnMap};
use super::mesh::Mesh;
use super::plain::Wrap;

/// The largest side that every adapter takes (WebGPU, section 3.6.2: `maxTextureDimension2D`).
pub(super) const MOST_TEXELS: usize = 8192;
/// As many texels of all maps as four of the greatest sides that are usual have, 4096; of maps that have more, twice what they
/// have. A small file is not to take all memory.
pub(super) const MOST_OF_ALL: usize = 1 << 26;
/// From here on the numbers of an f32 are further apart than pictures.
const FARTHEST: f64 = 16_777_216.0;

/// What lies along u and v beyond the borders of those maps that are the material's; all others repeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wraps {
    pub(super) color: [Wrap; 2],
    pub(super) normal: [Wrap; 2],
}

/// The part of the plane of texture coordinates that laid out maps show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapLayout([Span; 2]);

/// Such a part along u or v, in cells that are whole texels of every map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Span {
    first: i64,
    cells: usize,
    /// How many cells a map had before.
    of_map: usize,
}

/// Maps would be larger than adapters take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TooFar;

impl MapLayout {
    /// How maps have to be laid out for a mesh; `None` where they may stay as they are.
    pub(super) fn of(maps: &Maps, wraps: &Wraps, mesh: &Mesh) -> Result<Option<Self>, TooFar> {
        let sides = sides(maps, wraps);
        let [least, most] = covered(mesh);
        let along = |axis: usize| {
            // A single texel looks the same whichever way it goes on.
            let of_axis = sides.iter().map(|(size, wrap)| (size[axis], wrap[axis]));
            let sides: Vec<(usize, Wrap)> = of_axis.filter(|(side, _)| *side > 1).collect();
            Span::over(&sides, [least[axis], most[axis]])
        };
        let layout = Self([along(0)?, along(1)?]);
        if layout.texels(&sides) > MOST_OF_ALL.max(sides.iter().map(|([u, v], _)| u * v).sum::<usize>() * 2) {
            return Err(TooFar);
        }
        Ok((layout != Self([Span::WHOLE; 2])).then_some(layout))
    }

    /// Texels of all maps, laid out.
    fn texels(self, sides: &[([usize; 2], [Wrap; 2])]) -> usize {
        let Self([u, v]) = self;
        let along = |span: Span, side: usize| if side == 1 { 1 } else { side / span.of_map * span.cells };
        sides.iter().map(|([width, height], _)| along(u, *width) * along(v, *height)).sum()
    }

    /// Lay the maps out.
    pub(super) fn lay_out(self, maps: &mut Maps, wraps: &Wraps) {
        let repeat = [Wrap::Repeat; 2];
        self.unroll(maps.color.as_mut(), wraps.color);
        self.unroll(maps.normal.as_mut(), wraps.normal);
        self.unroll(maps.specular.as_mut(), repeat);
        self.unroll(maps.attenuator.as_mut(), repeat);
        for (_, map) in &mut maps.own {
            match map {
                OwnMap::Scalar(map) => self.unroll(Some(map), repeat),
                OwnMap::Color(map) => self.unroll(Some(map), repeat),
            }
        }
        maps.layout = Some(self);
    }

    /// Move the skin's texture coordinates to where laid out maps show what was there.
    pub(super) fn place(self, mesh: &mut Mesh) {
        // Parts that are not skin have maps and vertices of their own.
        for (vertex, _) in skin_vertices(mesh).into_iter().enumerate().filter(|(_, skin)| *skin) {
            mesh.uvs[vertex] = self.moved(mesh.uvs[vertex]);
        }
    }

    /// Where these maps are looked up by the file's texture coordinates, in words.
    pub(super) fn told(self) -> String {
        let [u, v] = self.0.map(|span| (span.of_map as f64 / span.cells as f64, span.moved(0.0)));
        format!("the texture coordinates times ({}, {}) plus ({}, {})", u.0, v.0, u.1, v.1)
    }

    fn moved(self, uv: Vec2) -> Vec2 {
        let Self([u, v]) = self;
        DVec2::new(u.moved(f64::from(uv.x)), v.moved(f64::from(uv.y))).as_vec2()
    }

    fn unroll<const C: usize>(self, map: Option<&mut Map<C>>, wrap: [Wrap; 2]) {
        let Some(map) = map else { return };
        let Self([u, v]) = self;
        let (columns, rows) = (u.texels(map.width, wrap[0]), v.texels(map.height, wrap[1]));
        let Map { width, texels, .. } = &*map;
        let row = |&y: &usize| columns.iter().map(move |x| texels[y * width + x]);
        let texels = rows.par_iter().flat_map_iter(row).collect();
        *map = Map { width: columns.len(), height: rows.len(), texels };
    }
}

impl Span {
    /// A map as it is.
    const WHOLE: Self = Self { first: 0, cells: 1, of_map: 1 };

    /// Over what is covered of maps of those sides, each of more than a texel.
    fn over(sides: &[(usize, Wrap)], [least, most]: [f64; 2]) -> Result<Self, TooFar> {
        // The filter reads another texel from half a one before the border on.
        let stays = |&(side, wrap): &(usize, Wrap)| {
            let half = 0.5 / side as f64;
            wrap == Wrap::Repeat || (least >= half && most <= 1.0 - half)
        };
        if sides.iter().all(stays) {
            return Ok(Self::WHOLE);
        }
        let of_map = sides.iter().fold(0, |all, (side, _)| greatest_common_divisor(all, *side));
        let (coarsest, finest) = sides
            .iter()
            .fold((usize::MAX, 1), |(least, most), (side, _)| (least.min(*side), most.max(*side)));
        let cells = of_map as f64;
        // A texel: the filter reads up to half a one beyond, and coordinates are rounded where they are moved.
        let margin = cells / coarsest as f64;
        let (first, end) = ((least * cells - margin).floor(), (most * cells + margin).ceil());
        let far = least < -FARTHEST || most > FARTHEST;
        let ends = sides.iter().any(|(_, wrap)| *wrap == Wrap::Clamp);
        // What is mirrored repeats with its mirror image.
        let (first, count) = match !ends && (far || end - first >= 2.0 * cells) {
            true => (0.0, 2.0 * cells),
            false => (first, end - first),
        };
        if (ends && far) || count * finest as f64 / cells > MOST_TEXELS as f64 {
            return Err(TooFar);
        }
        Ok(Self { first: first as i64, cells: count as usize, of_map })
    }

    fn moved(self, x: f64) -> f64 {
        (x * self.of_map as f64 - self.first as f64) / self.cells as f64
    }

    /// The texels of a map along a side, as they follow one another.
    fn texels(self, side: usize, wrap: Wrap) -> Vec<usize> {
        if side == 1 {
            return vec![0];
        }
        let (cell, side) = ((side / self.of_map) as i64, side as i64);
        let first = self.first * cell;
        let texel = |i: i64| match wrap {
            Wrap::Repeat => i.rem_euclid(side),
            Wrap::Clamp => i.clamp(0, side - 1),
            Wrap::Mirror => {
                let within = i.rem_euclid(2 * side);
                within.min(2 * side - 1 - within)
            }
        };
        (first..first + self.cells as i64 * cell).map(|i| texel(i) as usize).collect()
    }
}

/// Each map's size, and what lies beyond its borders.
fn sides(maps: &Maps, wraps: &Wraps) -> Vec<([usize; 2], [Wrap; 2])> {
    fn size<const C: usize>(map: &Map<C>) -> [usize; 2] {
        [map.width, map.height]
    }
    let Maps { color, normal, specular, attenuator, own, .. } = maps;
    let of_material = [(color, wraps.color), (normal, wraps.normal)];
    let of_material = of_material.into_iter().filter_map(|(map, wrap)| Some((size(map.as_ref()?), wrap)));
    let scalars = [specular, attenuator].into_iter().flatten().map(size);
    let own = own.iter().map(|(_, map)| match map {
        OwnMap::Scalar(map) => size(map),
        OwnMap::Color(map) => size(map),
    });
    of_material.chain(scalars.chain(own).map(|size| (size, [Wrap::Repeat; 2]))).collect()
}

/// The least and the greatest texture coordinates of the skin; of none, more than any and less.
fn covered(mesh: &Mesh) -> [DVec2; 2] {
    let skin =
        mesh.uvs.iter().zip(skin_vertices(mesh)).filter_map(|(uv, skin)| skin.then_some(uv.as_dvec2()));
    skin.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[least, most], uv| [least.min(uv), most.max(uv)])
}

/// Which of the vertices that have texture coordinates are corners of skin.
fn skin_vertices(mesh: &Mesh) -> Vec<bool> {
    let mut skin = vec![false; mesh.uvs.len()];
    let plain = mesh.plain.as_ref().map_or(&[][..], |plain| &plain.of_triangle);
    let of = plain.iter().copied().chain(std::iter::repeat(None));
    for (triangle, _) in mesh.triangles.iter().zip(of).filter(|(_, of)| of.is_none()) {
        for &corner in triangle {
            if let Some(skin) = skin.get_mut(corner as usize) {
                *skin = true;
            }
        }
    }
    skin
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLAMPED: [(usize, Wrap); 2] = [(8, Wrap::Clamp), (4, Wrap::Repeat)];

    fn over(sides: &[(usize, Wrap)], covered: [f64; 2]) -> Result<(i64, usize, usize), TooFar> {
        Span::over(sides, covered).map(|span| (span.first, span.cells, span.of_map))
    }

    #[test]
    fn maps_stay_where_no_filter_reads_beyond_a_border_that_matters() {
        // Half a texel of 8 is a sixteenth.
        assert_eq!(over(&CLAMPED, [0.0625, 0.9375]), Ok((0, 1, 1)));
        assert_eq!(over(&[(8, Wrap::Repeat)], [-7.0, 1e30]), Ok((0, 1, 1)));
        assert_eq!(over(&[], [0.0, 1.0]), Ok((0, 1, 1)));
    }

    #[test]
    fn cells_are_whole_texels_of_all_maps_with_a_texel_of_the_coarsest_around_them() {
        assert_eq!(over(&CLAMPED, [0.0, 0.5]), Ok((-1, 4, 4)));
        assert_eq!(over(&CLAMPED, [0.3, 1.0]), Ok((0, 5, 4)));
        // Of 6 and 4 a cell is half a map; of 3 and 2 it is a whole one, and the coarser one's texel half of that.
        assert_eq!(over(&[(6, Wrap::Clamp), (4, Wrap::Mirror)], [0.0, 1.0]), Ok((-1, 4, 2)));
        assert_eq!(over(&[(3, Wrap::Clamp), (2, Wrap::Repeat)], [0.5, 1.0]), Ok((0, 2, 1)));
    }

    #[test]
    fn what_is_mirrored_is_never_more_than_a_map_and_its_mirror_image() {
        let mirrored = [(8, Wrap::Mirror), (4, Wrap::Repeat)];
        assert_eq!(over(&mirrored, [0.0, 1.0]), Ok((-1, 6, 4)));
        for covered in [[0.0, 2.0], [-7.0, 60_000.0], [1e30, 1e30]] {
            assert_eq!(over(&mirrored, covered), Ok((0, 8, 4)));
        }
        // With a border beside it that goes on for ever nothing repeats.
        assert_eq!(over(&[(8, Wrap::Mirror), (8, Wrap::Clamp)], [0.0, 4.0]), Ok((-1, 34, 8)));
    }

    #[test]
    fn maps_no_adapter_takes_are_refused() {
        for covered in [[0.0, 60_000.0], [-1e30, 0.5], [1e30, 1e30]] {
            assert_eq!(over(&CLAMPED, covered), Err(TooFar));
        }
        // With its margin, 8190 texels are the most.
        assert!(over(&[(8190, Wrap::Clamp)], [0.0, 1.0]).is_ok());
        assert_eq!(over(&[(8191, Wrap::Clamp)], [0.0, 1.0]), Err(TooFar));
    }

    #[test]
    fn small_maps_that_would_take_much_memory_are_refused() {
        let map = || Some(Map { width: 2, height: 2, texels: vec![[0.0; 3]; 4] });
        let maps = Maps { color: map(), normal: map(), ..Maps::default() };
        let clamped = [Wrap::Clamp; 2];
        let wraps = Wraps { color: clamped, normal: clamped };
        let over = |most: f32| {
            let mesh = Mesh {
                uvs: vec![Vec2::ZERO, Vec2::splat(most), Vec2::X],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            };
            MapLayout::of(&maps, &wraps, &mesh).map(|layout| layout.is_some())
        };
        assert_eq!([over(1000.0), over(4050.0)], [Ok(true), Err(TooFar)]);
    }

    #[test]
    fn texels_follow_one_another_as_the_sampler_says() {
        let span = Span { first: -2, cells: 6, of_map: 2 };
        assert_eq!(span.texels(4, Wrap::Repeat), [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3]);
        assert_eq!(span.texels(4, Wrap::Mirror), [3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0]);
        assert_eq!(span.texels(4, Wrap::Clamp), [0, 0, 0, 0, 0, 1, 2, 3, 3, 3, 3, 3]);
        assert_eq!(span.texels(1, Wrap::Clamp), [0]);
        // The map's own borders are a third and two thirds of the way.
        assert_eq!([-1.0, 0.5, 2.0].map(|x| span.moved(x)), [0.0, 0.5, 1.0]);
    }
}

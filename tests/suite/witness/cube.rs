//! Cube maps: faces +X -X +Y -Y +Z -Z, oriented as WebGPU's, bilinear across edges and corners (docs/model.md, 1).

use super::{V3, dot, scaled, sum};

/// The axis through each face, and the directions in which its columns and its rows (from the top) run.
const FACES: [[V3; 3]; 6] = [
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]],
    [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
    [[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
];

/// A cube map, RGBA.
#[derive(Clone, Debug)]
pub(crate) struct Cube {
    /// Texels along a face's side.
    pub(crate) size: usize,
    /// `[face][row][column]`
    texels: Vec<[f64; 4]>,
}

impl Cube {
    /// From all texels' numbers in order, as vectors hold them.
    pub(crate) fn of_numbers(size: usize, numbers: &[f64]) -> Self {
        let texels = numbers.as_chunks::<4>().0.to_vec();
        assert_eq!(texels.len(), 6 * size * size);
        Self { size, texels }
    }

    /// From a function of the unit direction through each texel's centre.
    pub(crate) fn of_directions(size: usize, light: impl Fn(V3) -> [f64; 4]) -> Self {
        let texel = |i: usize| {
            let (face, row, column) = (i / (size * size), i / size % size, i % size);
            let d = centre(face, column as f64, row as f64, size);
            light(scaled(1.0 / dot(d, d).sqrt(), d))
        };
        Self { size, texels: (0..6 * size * size).map(texel).collect() }
    }

    pub(crate) fn texel(&self, face: usize, column: usize, row: usize) -> [f64; 4] {
        self.texels[(face * self.size + row) * self.size + column]
    }

    /// The texel at a place that may lie one beyond the face: beyond an edge the neighbour's that is nearest, beyond a
    /// corner the mean of the three that meet there.
    fn fetch(&self, face: usize, column: f64, row: f64) -> [f64; 4] {
        let last = (self.size - 1) as f64;
        let (near_column, near_row) = (column.clamp(0.0, last), row.clamp(0.0, last));
        if column == near_column && row == near_row {
            return self.texel(face, column as usize, row as usize);
        }
        if column != near_column && row != near_row {
            let three = [
                self.fetch(face, near_column, near_row),
                self.fetch(face, column, near_row),
                self.fetch(face, near_column, row),
            ];
            return std::array::from_fn(|c| (three[0][c] + three[1][c] + three[2][c]) / 3.0);
        }
        let (face, s, t) = place(centre(face, column, row, self.size));
        let nearest = |u: f64| ((u * self.size as f64) as usize).min(self.size - 1);
        self.texel(face, nearest(s), nearest(t))
    }

    /// The light along a direction of any length; along +Z where it has none (docs/model.md, 7).
    pub(crate) fn along(&self, d: V3) -> [f64; 4] {
        let size: f64 = d.iter().map(|x| x.abs()).sum();
        let d = if size.is_finite() && size >= 1e-36 { d } else { [0.0, 0.0, 1.0] };
        let (face, s, t) = place(d);
        let texels = self.size as f64;
        let (x, y) = (s * texels - 0.5, t * texels - 0.5);
        let (column, row) = (x.floor(), y.floor());
        let (right, below) = (x - column, y - row);
        let mut light = [0.0; 4];
        for (dx, across) in [(0.0, 1.0 - right), (1.0, right)] {
            for (dy, down) in [(0.0, 1.0 - below), (1.0, below)] {
                // On the very edge the far texels weigh nothing.
                if across * down > 0.0 {
                    let texel = self.fetch(face, column + dx, row + dy);
                    (0..4).for_each(|c| light[c] += across * down * texel[c]);
                }
            }
        }
        light
    }
}

/// The direction, not normalised, through the centre of a texel.
fn centre(face: usize, column: f64, row: f64, size: usize) -> V3 {
    let [axis, right, down] = FACES[face];
    let across = |i: f64| (2.0 * i + 1.0) / size as f64 - 1.0;
    sum(axis, sum(scaled(across(column), right), scaled(across(row), down)))
}

/// The face that a direction meets, and where: from 0 to 1 along its columns and its rows.
fn place(d: V3) -> (usize, f64, f64) {
    let ahead = |face: usize| dot(FACES[face][0], d);
    let face = (1..6).fold(0, |best, face| if ahead(face) > ahead(best) { face } else { best });
    let [axis, right, down] = FACES[face];
    let along = |direction: V3| (dot(direction, d) / dot(axis, d) + 1.0) / 2.0;
    (face, along(right), along(down))
}

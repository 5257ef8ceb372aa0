//! Cube maps with a seamless border, and their bilinear lookup.
//!
//! Faces stand in the order +X -X +Y -Y +Z -Z with the face orientation of WebGPU, Vulkan and D3D.
//! Each face carries a border of one texel from its neighbours, so that four texels always suffice
//! and a lookup on an edge or a corner is the same from both sides.

use super::real::Real;
use super::vector::{V3, select};

/// This file, for caches of what is made of cubes.
#[doc(hidden)]
pub const SOURCE: &str = include_str!("cube.rs");

/// A cube map, RGBA, with a border of one texel around each face.
#[derive(Clone, Debug, PartialEq)]
pub struct Cube<T> {
    /// Texels along a face's side, without the border.
    size: usize,
    /// `[face][row][column]`, each `(size + 2) x (size + 2)`.
    padded: Vec<[T; 4]>,
}

/// The direction (not normalised) of the point (s, t) in [-1, 1] on a face; t runs downwards.
#[must_use]
#[inline]
pub fn face_direction(face: usize, s: f64, t: f64) -> [f64; 3] {
    match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    }
}

/// The unit direction through the centre of texel (column, row) of a face of `size` texels.
#[must_use]
#[inline]
pub fn texel_direction(face: usize, column: usize, row: usize, size: usize) -> [f64; 3] {
    let centre = |i: usize| (2 * i + 1) as f64 / size as f64 - 1.0;
    let d = face_direction(face, centre(column), centre(row));
    let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    d.map(|x| x / length)
}

/// The solid angle of texel (column, row) of a face of `size` texels, in steradians.
#[must_use]
#[inline]
pub fn texel_solid_angle(column: usize, row: usize, size: usize) -> f64 {
    let corner = |i: usize, j: usize| corner_solid_angle(column + i, row + j, size);
    corner(1, 1) - corner(0, 1) - corner(1, 0) + corner(0, 0)
}

/// The solid angle of the rectangle between a face's middle and the corner (column, row) of its `size` x `size` texels, in
/// steradians; negative in two of the four quarters. A texel's is what those of its four corners differ by.
#[must_use]
#[inline]
pub fn corner_solid_angle(column: usize, row: usize, size: usize) -> f64 {
    let edge = |i: usize| 2.0 * i as f64 / size as f64 - 1.0;
    let (x, y) = (edge(column), edge(row));
    (x * y).atan2((x * x + y * y + 1.0).sqrt())
}

/// Where a direction meets the cube: cubes of any size can be looked up there.
#[derive(Clone, Copy)]
pub struct CubePoint<R: Real> {
    /// 0 to 5.
    face: R,
    s: R,
    t: R,
    /// 1 / the major axis' length, at most 1e6; 0 where a direction has no face, so that nothing moves there.
    inverse_major: R,
    x_major: R::Mask,
    y_major: R::Mask,
    positive: R::Mask,
}

impl<R: Real> CubePoint<R> {
    /// Of a direction of any length from 1e-36 on. A shorter or non-finite direction has no face; +Z stands in.
    #[inline(always)]
    pub fn new(d: V3<R>) -> Self {
        let (zero, one) = (d[0].lit(0.0), d[0].lit(1.0));
        let sum = d[0].abs() + d[1].abs() + d[2].abs();
        let ok = R::and(sum.is_finite(), sum.ge(one.lit(1e-36)));
        if R::all(ok) {
            return Self::of_finite(d);
        }
        let point = Self::of_finite(select::<R>(ok, d, [zero, zero, one]));
        Self { inverse_major: R::select(ok, point.inverse_major, zero), ..point }
    }

    /// Of a unit vector, or of the zero vector, which meets the middle of a face.
    #[inline(always)]
    pub fn of_unit(d: V3<R>) -> Self {
        Self::of_finite(d)
    }

    /// The face, and the place on it in [0, 1]^2.
    #[inline(always)]
    pub fn place(&self) -> [R; 3] {
        [self.face, self.s, self.t]
    }

    /// Ties of the major axis go to x before y before z; seamlessness makes the choice immaterial.
    #[inline(always)]
    fn of_finite([x, y, z]: V3<R>) -> Self {
        let (zero, one, half) = (x.lit(0.0), x.lit(1.0), x.lit(0.5));
        let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
        let x_major = R::and(ax.ge(ay), ax.ge(az));
        let y_major = ay.ge(az);
        let positive = Self::pick(x_major, y_major, x, y, z).ge(zero);
        let point = Self { face: zero, s: zero, t: zero, inverse_major: one, x_major, y_major, positive };
        let (s, t) = point.across(x, y, z);
        let face = Self::pick(x_major, y_major, zero, x.lit(2.0), x.lit(4.0));
        // A direction of 0 meets the middle.
        let inverse_major = Self::pick(x_major, y_major, ax, ay, az).max(one.lit(1e-36)).recip();
        Self {
            face: face + R::select(positive, zero, one),
            s: (s * inverse_major).mul_add(half, half),
            t: (t * inverse_major).mul_add(half, half),
            // A shorter direction turns no faster, or squares of derivatives would overflow an f32.
            inverse_major: inverse_major.min(one.lit(1e6)),
            ..point
        }
    }

    #[inline(always)]
    fn pick(x_major: R::Mask, y_major: R::Mask, on_x: R, on_y: R, on_z: R) -> R {
        R::select(x_major, on_x, R::select(y_major, on_y, on_z))
    }

    /// The components of a vector that run along the face's s and t.
    #[inline(always)]
    fn across(&self, x: R, y: R, z: R) -> (R, R) {
        let signed = |v: R| R::select(self.positive, v, -v);
        let s = Self::pick(self.x_major, self.y_major, signed(-z), x, signed(x));
        let t = Self::pick(self.x_major, self.y_major, -y, signed(z), -y);
        (s, t)
    }

    /// How (s, t) move when the direction moves by `d` (the face held).
    #[inline(always)]
    pub fn tangent(&self, [x, y, z]: V3<R>) -> [R; 2] {
        let major = Self::pick(self.x_major, self.y_major, x, y, z);
        let d_major = R::select(self.positive, major, -major);
        let (ds, dt) = self.across(x, y, z);
        let half = x.lit(0.5);
        // s = (sc / |major| + 1) / 2, so that sc / |major| = 2 s - 1.
        let centred = d_major * half;
        let derivative = |du: R, u: R| self.inverse_major * (du * half - d_major * u + centred);
        [derivative(ds, self.s), derivative(dt, self.t)]
    }
}

/// Where a lookup falls in a cube.
#[derive(Clone, Copy)]
pub struct Footprint<R> {
    /// The first of the four texels.
    pub first: R,
    /// The place among them, in [0, 1]^2.
    pub place: [R; 2],
}

impl<T: Copy> Cube<T> {
    /// Texels along a face's side.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.size
    }

    /// Texels with their border, `[face][row][column]`, each side `size + 2`.
    #[must_use]
    pub fn padded(&self) -> &[[T; 4]] {
        &self.padded
    }

    /// The texel of a face, without the border.
    #[must_use]
    pub fn texel(&self, face: usize, column: usize, row: usize) -> [T; 4] {
        self.padded[self.index(face, column + 1, row + 1)]
    }

    /// Each texel (border included) converted.
    #[must_use]
    pub fn map<U>(&self, convert: impl Fn([T; 4]) -> [U; 4]) -> Cube<U> {
        Cube { size: self.size, padded: self.padded.iter().map(|&texel| convert(texel)).collect() }
    }

    const fn index(&self, face: usize, column: usize, row: usize) -> usize {
        let side = self.size + 2;
        (face * side + row) * side + column
    }

    /// The seamless bilinear lookup along `d`.
    #[inline(always)]
    pub fn sample<R: Real<Texel = T>>(&self, d: V3<R>) -> [R; 4] {
        self.sample_at(&self.footprint(&CubePoint::new(d)))
    }

    /// The lookup at a footprint.
    #[inline(always)]
    pub fn sample_at<R: Real<Texel = T>>(&self, at: &Footprint<R>) -> [R; 4] {
        let [fx, fy] = at.place;
        R::bilinear(&self.padded, self.size + 2, at.first, fx, fy)
    }

    /// The lookup at a footprint, and its derivative as the footprint moves along `tangent`, in
    /// texels.
    #[inline(always)]
    pub fn sample_with_slope<R: Real<Texel = T>>(
        &self,
        at: &Footprint<R>,
        tangent: [R; 2],
    ) -> ([R; 4], [R; 4]) {
        R::bilinear_with_slope(&self.padded, self.size + 2, at.first, at.place, tangent)
    }

    /// The texels around a point.
    #[inline(always)]
    pub fn footprint<R: Real>(&self, point: &CubePoint<R>) -> Footprint<R> {
        self.footprint_at(point.face, point.s, point.t)
    }

    /// The texels around (`s`, `t`) in [0, 1]^2 of a face.
    #[inline(always)]
    pub fn footprint_at<R: Real>(&self, face: R, s: R, t: R) -> Footprint<R> {
        let (zero, half) = (s.lit(0.0), s.lit(0.5));
        let (size, side) = (half.lit(self.size as f64), half.lit((self.size + 2) as f64));
        let (x, y) = (s.mul_add(size, half), t.mul_add(size, half));
        let (column, row) = (x.floor().max(zero).min(size), y.floor().max(zero).min(size));
        let first = face.mul_add(side, row).mul_add(side, column);
        Footprint { first, place: [x - column, y - row] }
    }

    /// The lookup at a footprint, and how it moves across and down, a texel.
    #[inline(always)]
    pub fn sample_with_gradient<R: Real<Texel = T>>(&self, at: &Footprint<R>) -> [[R; 4]; 3] {
        R::bilinear_with_gradient(&self.padded, self.size + 2, at.first, at.place)
    }

    /// How footprints move, in texels, when their point moves along `tangent`.
    #[inline(always)]
    pub fn texels<R: Real>(&self, tangent: [R; 2]) -> [R; 2] {
        let size = tangent[0].lit(self.size as f64);
        [tangent[0] * size, tangent[1] * size]
    }
}

/// What can stand in a texel while a cube is built: f32 or f64.
pub trait Channel: Copy {
    /// The mean of three.
    fn mean3(a: Self, b: Self, c: Self) -> Self;
}

impl Channel for f32 {
    fn mean3(a: Self, b: Self, c: Self) -> Self {
        (a + b + c) / 3.0
    }
}

impl Channel for f64 {
    fn mean3(a: Self, b: Self, c: Self) -> Self {
        (a + b + c) / 3.0
    }
}

impl<T: Channel> Cube<T> {
    /// A cube of `size` texels a side from `texel(face, column, row)`; the border is taken from the
    /// neighbouring faces, its corners are the mean of the three texels that meet there.
    ///
    /// # Panics
    /// When `size` is 0.
    #[must_use]
    pub fn from_fn(size: usize, mut texel: impl FnMut(usize, usize, usize) -> [T; 4]) -> Self {
        assert!(size > 0, "a cube needs at least one texel a face");
        let mut faces = Vec::with_capacity(6 * size * size);
        for face in 0..6 {
            for row in 0..size {
                for column in 0..size {
                    faces.push(texel(face, column, row));
                }
            }
        }
        Self::of_texels(size, &faces)
    }

    /// A cube of the texels of each face, row by row, as [`Self::from_fn`] asks for them.
    ///
    /// # Panics
    /// When there are fewer than 6 `size`² texels.
    #[must_use]
    pub fn of_texels(size: usize, faces: &[[T; 4]]) -> Self {
        let texel = |sources: Sources| match sources {
            Sources::One(a) => faces[a],
            Sources::Corner([a, b, c]) => {
                std::array::from_fn(|i| T::mean3(faces[a][i], faces[b][i], faces[c][i]))
            }
        };
        Self { size, padded: padding(size).map(texel).collect() }
    }
}

/// What a texel of a padded cube shows: texels without a border, by `(face * size + row) * size + column`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sources {
    /// A texel.
    One(usize),
    /// The mean of the three that meet at a corner.
    Corner([usize; 3]),
}

/// What each texel of a padded cube shows, in their order.
pub fn padding(size: usize) -> impl Iterator<Item = Sources> {
    let side = size + 2;
    let inner = move |i: usize| i.clamp(1, size);
    (0..6 * side * side).map(move |i| {
        let (face, row, column) = (i / (side * side), i / side % side, i % side);
        let (inner_row, inner_column) = (inner(row), inner(column));
        match (row == inner_row, column == inner_column) {
            (true, true) => return Sources::One((face * size + row - 1) * size + column - 1),
            (false, false) => {}
            _ => return Sources::One(neighbour(face, column, row, size)),
        }
        Sources::Corner([
            neighbour(face, inner_column, inner_row, size),
            neighbour(face, column, inner_row, size),
            neighbour(face, inner_column, row, size),
        ])
    })
}

/// The texel that the padded texel (column, row) of `face` shows: its own, or a neighbour's where
/// the border's centre falls on another face.
fn neighbour(face: usize, column: usize, row: usize, size: usize) -> usize {
    let centre = |i: usize| (2.0 * i as f64 - 1.0) / size as f64 - 1.0;
    let point = CubePoint::new(face_direction(face, centre(column), centre(row)));
    let clamp = |u: f64| ((u * size as f64) as usize).min(size - 1);
    (point.face as usize * size + clamp(point.t)) * size + clamp(point.s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy(size: usize) -> Cube<f64> {
        Cube::from_fn(size, |face, column, row| {
            let d = texel_direction(face, column, row, size);
            [d[0], d[1] * d[2], 1.0 + d[2] * d[0], d[1]]
        })
    }

    #[test]
    fn solid_angles_of_all_texels_sum_to_the_sphere() {
        let sum: f64 = (0..8).flat_map(|r| (0..8).map(move |c| texel_solid_angle(c, r, 8))).sum();
        // Summing 64 numbers in f64.
        assert!((6.0 * sum - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn edges_and_corners_read_the_same_from_every_side() {
        let cube = wavy(8);
        for (a, b) in [
            ([1.0, 1.0 - 1e-12, 0.3], [1.0 - 1e-12, 1.0, 0.3]),
            ([-1.0, 0.2, 1.0 - 1e-12], [-1.0 + 1e-12, 0.2, 1.0]),
            ([1.0, 1.0 - 1e-12, 1.0 - 1e-12], [1.0 - 1e-12, 1.0 - 1e-12, 1.0]),
        ] {
            let (left, right): ([f64; 4], [f64; 4]) = (cube.sample(a), cube.sample(b));
            for c in 0..4 {
                // The two directions differ by 1e-12, times a slope of about 1 a radian.
                assert!((left[c] - right[c]).abs() < 1e-10, "{a:?}: {left:?} {right:?}");
            }
        }
    }

    #[test]
    fn tangents_agree_with_central_differences() {
        let cube = wavy(8);
        for d in [[0.9, 0.2, -0.3], [0.13, -0.8, 0.33], [-0.2, 0.4, 0.7], [-0.9, 0.3, 0.2]] {
            for dd in [[0.3, 0.1, -0.2], [-0.1, 0.5, 0.4]] {
                let point = CubePoint::new(d);
                let (_, got) =
                    cube.sample_with_slope(&cube.footprint(&point), cube.texels(point.tangent(dd)));
                let h = 1e-7;
                let at = |h: f64| -> [f64; 4] { cube.sample(std::array::from_fn(|i| d[i] + h * dd[i])) };
                let (plus, minus) = (at(h), at(-h));
                for c in 0..4 {
                    let want: f64 = (plus[c] - minus[c]) / (2.0 * h);
                    // Rounding of 1e-16 over a step of 1e-7.
                    assert!((got[c] - want).abs() < 1e-7, "{d:?} {dd:?}: {} {want}", got[c]);
                }
            }
        }
    }

    #[test]
    fn zero_and_non_finite_directions_stay_in_range() {
        let cube = wavy(4);
        for bad in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            let point = CubePoint::new(bad);
            let (value, slope) =
                cube.sample_with_slope(&cube.footprint(&point), cube.texels(point.tangent([1.0, 0.0, 0.0])));
            assert!(value.iter().all(|x| x.is_finite()), "{bad:?}");
            assert_eq!(slope, [0.0; 4], "{bad:?}: what has no direction does not move");
        }
    }
}

//! Owen-scrambled Sobol points over disc and hemisphere (Burley, *Practical Hash-based Owen
//! Scrambling*, JCGT 2020): for a few hundred rays, far less noise than random ones.

use glam::{Vec3A, vec3a};

/// The first two dimensions of the Sobol sequence, bit-reversed and ready to be scrambled.
pub(crate) struct Sobol(Vec<[u32; 2]>);

impl Sobol {
    /// The first `count` points, cell by cell of the square: scrambling moves whole cells, so that points which follow
    /// one another are near one another with any seed.
    pub(crate) fn new(count: u32) -> Self {
        let mut points: Vec<[u32; 2]> = (0..count).map(|i| [i, second_dimension(i).reverse_bits()]).collect();
        // The lowest bits are the highest of the coordinates: Morton's order.
        let cell = |[x, y]: &[u32; 2]| (0..8).fold(0, |cell, k| cell << 2 | (x >> k & 1) << 1 | y >> k & 1);
        points.sort_by_key(cell);
        Self(points)
    }

    /// How many points there are.
    pub(crate) fn count(&self) -> u32 {
        self.0.len() as u32
    }

    /// Evenly distributed points of the unit disc, scrambled by `seed`: radius, then sine and cosine of the angle.
    pub(crate) fn disc(&self, seed: u32) -> impl Iterator<Item = (f32, [f32; 2])> {
        let (first, second) = (mix(seed), mix(seed ^ 0x9e37_79b9));
        self.0.iter().map(move |&[a, b]| concentric(scramble(a, first), scramble(b, second)))
    }

    /// Cosine-distributed unit directions about +Z, scrambled by `seed`: the disc lifted (Malley).
    pub(crate) fn hemisphere(&self, seed: u32) -> impl Iterator<Item = Vec3A> {
        self.cone(seed, 1.0)
    }

    /// The same within the cone whose half angle has that sine.
    pub(crate) fn cone(&self, seed: u32, widest: f32) -> impl Iterator<Item = Vec3A> {
        self.disc(seed).map(move |(radius, [sine, cosine])| {
            let radius = widest * radius;
            vec3a(radius * cosine, radius * sine, (1.0 - radius * radius).max(0.0).sqrt())
        })
    }
}

/// Dimension 2 of Sobol's sequence (the first is the bit reversal).
fn second_dimension(mut i: u32) -> u32 {
    let (mut point, mut direction) = (0, 1 << 31);
    while i != 0 {
        if i & 1 != 0 {
            point ^= direction;
        }
        direction ^= direction >> 1;
        i >>= 1;
    }
    point
}

/// An Owen scramble of bit-reversed `x`, in [0, 1): each bit flips by a hash of those above it.
fn scramble(mut x: u32, seed: u32) -> f32 {
    // Vegdahl's constants for the Laine-Karras permutation.
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    // 24 bits, as many as an f32 holds below 1.
    (x.reverse_bits() >> 8) as f32 / 16_777_216.0
}

/// A hash of 32 bits (the finaliser of MurmurHash 3).
pub(crate) fn mix(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

/// Shirley and Chiu's concentric map of the square to the disc: radius, then sine and cosine of the angle. A radius may
/// be negative.
fn concentric(u: f32, v: f32) -> (f32, [f32; 2]) {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (radius, angle) = if a * a > b * b {
        (a, FRAC_PI_4 * b / a)
    } else if b != 0.0 {
        (b, FRAC_PI_2 - FRAC_PI_4 * a / b)
    } else {
        (0.0, 0.0)
    };
    let (sine, cosine) = angle.sin_cos();
    (radius, [sine, cosine])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_stratified_in_every_elementary_box_for_any_seed() {
        for seed in [0, 1, 12345, u32::MAX] {
            let points: Vec<[u32; 2]> = (0..64)
                .map(|i| [scramble(i, mix(seed)), scramble(second_dimension(i).reverse_bits(), mix(!seed))])
                .map(|p| p.map(|x| (x * 64.0) as u32))
                .collect();
            // A (0, 6, 2)-net: one point in each box of 2^k x 2^(6-k).
            for k in 0..=6 {
                let mut seen = [0; 64];
                for [x, y] in &points {
                    seen[((x >> (6 - k)) << (6 - k) | y >> k) as usize] += 1;
                }
                assert!(seen.iter().all(|&n| n == 1), "seed {seed}, k {k}: {seen:?}");
            }
        }
    }

    #[test]
    fn the_order_takes_every_point_once_and_sixteen_in_a_row_are_of_one_cell() {
        for seed in [3, 77] {
            let sobol = Sobol::new(256);
            let mut indices: Vec<u32> = sobol.0.iter().map(|[first, _]| *first).collect();
            indices.sort_unstable();
            assert!(indices.into_iter().eq(0..256));
            let square: Vec<[f32; 2]> =
                sobol.0.iter().map(|&[a, b]| [scramble(a, mix(seed)), scramble(b, mix(!seed))]).collect();
            for sixteen in square.chunks(16) {
                let cell = |p: &[f32; 2]| p.map(|x| (4.0 * x) as u32);
                assert!(sixteen.iter().all(|p| cell(p) == cell(&sixteen[0])), "{sixteen:?}");
            }
        }
    }

    #[test]
    fn directions_have_the_moments_of_a_cosine_lobe() {
        let directions: Vec<Vec3A> = Sobol::new(4096).hemisphere(7).collect();
        let mean = directions.iter().copied().sum::<Vec3A>() / 4096.0;
        // E[z] = 2/3, E[x] = E[y] = 0; a net of 4096 points errs by about 1e-4 for smooth integrands.
        assert!(mean.abs_diff_eq(vec3a(0.0, 0.0, 2.0 / 3.0), 1e-3), "{mean}");
        assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-6 && d.z >= 0.0));
    }
}

//! Gradient noise from an integer hash: the same numbers on every machine and for any thread count.

use glam::{DVec3, IVec3};

/// A hash of a lattice point to 32 bits (the "lowbias32" finaliser of C. Wellons, applied to a
/// mix of the coordinates by odd constants).
pub(super) fn hash(cell: IVec3, seed: u32) -> u32 {
    let mut h = (cell.x as u32)
        .wrapping_mul(0x8da6_b343)
        .wrapping_add((cell.y as u32).wrapping_mul(0xd816_3841))
        .wrapping_add((cell.z as u32).wrapping_mul(0xcb1a_b31f))
        .wrapping_add(seed.wrapping_mul(0x9e37_79b9));
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// A uniform number in [0, 1) from a lattice point.
pub(super) fn uniform(cell: IVec3, seed: u32) -> f64 {
    f64::from(hash(cell, seed)) / 4_294_967_296.0
}

/// Perlin's twelve edge gradients (*Improving Noise*, 2002).
fn gradient(cell: IVec3, seed: u32, offset: DVec3) -> f64 {
    let (x, y, z) = (offset.x, offset.y, offset.z);
    match hash(cell, seed) % 12 {
        0 => x + y,
        1 => x - y,
        2 => -x + y,
        3 => -x - y,
        4 => x + z,
        5 => x - z,
        6 => -x + z,
        7 => -x - z,
        8 => y + z,
        9 => y - z,
        10 => -y + z,
        _ => -y - z,
    }
}

/// Gradient noise, about [-1, 1], with one feature a unit of `p`.
pub(super) fn gradient_noise(p: DVec3, seed: u32) -> f64 {
    let floor = p.floor();
    let cell = floor.as_ivec3();
    let f = p - floor;
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let corner = |x: i32, y: i32, z: i32| {
        let step = IVec3::new(x, y, z);
        gradient(cell + step, seed, f - step.as_dvec3())
    };
    let along_x = |y: i32, z: i32| lerp(corner(0, y, z), corner(1, y, z), fade.x);
    let along_y = |z: i32| lerp(along_x(0, z), along_x(1, z), fade.y);
    lerp(along_y(0), along_y(1), fade.z)
}

/// Sum of `octaves` of noise, each half as strong and twice as fine as the one before; about [-1, 1].
pub(super) fn fractal(p: DVec3, octaves: u32, seed: u32) -> f64 {
    let (mut sum, mut weight, mut scale) = (0.0, 1.0, 1.0);
    for octave in 0..octaves {
        sum += weight * gradient_noise(p * scale, seed.wrapping_add(octave));
        weight *= 0.5;
        scale *= 2.0;
    }
    sum / (2.0 - 2.0 * weight)
}

/// What [`nearest_feature`] finds.
pub(super) struct Feature {
    /// Distance to the nearest feature point.
    pub(super) distance: f64,
    /// Distance to the second nearest.
    pub(super) second: f64,
    /// A number of the nearest point's own, uniform in [0, 1).
    pub(super) number: f64,
}

/// The nearest of random points, one in each unit cell (Worley's cellular basis, 1996).
pub(super) fn nearest_feature(p: DVec3, seed: u32) -> Feature {
    let cell = p.floor().as_ivec3();
    let mut found = Feature { distance: f64::INFINITY, second: f64::INFINITY, number: 0.0 };
    for step in 0..27 {
        let at = cell + IVec3::new(step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1);
        let jitter = DVec3::new(uniform(at, seed), uniform(at, seed ^ 0x5bd1), uniform(at, seed ^ 0xe995));
        let distance = p.distance(at.as_dvec3() + jitter);
        if distance < found.distance {
            found.second = found.distance;
            found.distance = distance;
            found.number = uniform(at, seed ^ 0x1b87);
        } else if distance < found.second {
            found.second = distance;
        }
    }
    found
}

/// Linear blend.
pub(super) fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// The cubic step from 0 at `low` to 1 at `high` (either order).
pub(super) fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A bell that is 1 at 0 and has the standard deviation `sigma`.
pub(super) fn bell(x: f64, sigma: f64) -> f64 {
    let t = x / sigma;
    (-0.5 * t * t).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> impl Iterator<Item = DVec3> {
        (0..2000).map(|i| DVec3::new(0.37, 0.61, 0.83) * f64::from(i) - 500.0)
    }

    #[test]
    fn gradient_noise_is_bounded_balanced_and_continuous() {
        let mut sum = 0.0;
        for p in points() {
            let value = gradient_noise(p, 7);
            sum += value;
            assert!(value.abs() <= 1.1, "{value} at {p}");
            // Perlin's slope stays below 4 or so.
            assert!((gradient_noise(p + 1e-6, 7) - value).abs() < 2e-5);
        }
        // The mean of 2000 values with a deviation of about 0.25: six standard errors.
        assert!((sum / 2000.0).abs() < 0.04, "{sum}");
    }

    #[test]
    fn gradient_noise_is_zero_on_the_lattice() {
        assert_eq!(gradient_noise(DVec3::new(3.0, -2.0, 5.0), 1), 0.0);
    }

    #[test]
    fn features_are_found_in_the_right_order_and_numbered() {
        for p in points() {
            let found = nearest_feature(p, 3);
            // A cell's diagonal is the farthest that its own feature can be.
            assert!(found.distance <= 3.0_f64.sqrt() && found.distance <= found.second);
            assert!((0.0..1.0).contains(&found.number));
        }
    }
}

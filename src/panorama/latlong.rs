//! The panorama's directions, as skinfit-core reads them (MODEL 1; `skinfit_core::bake::panorama::direction_to_uv`):
//! u = 1/2 + atan2(x, -z) / 2 pi to the right, v = acos(y) / pi down.
//!
//! So the top row is +Y, the centre -Z, the right quarter +X; texel centres are at +0.5.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// The texture coordinates of a unit direction; at the poles, where u has no value, 1/2.
#[must_use]
pub fn direction_to_uv(d: DVec3) -> (f64, f64) {
    // atan2(0, -0) is pi.
    let u = if d.x == 0.0 && d.z == 0.0 { 0.5 } else { 0.5 + d.x.atan2(-d.z) / TAU };
    (u, d.y.clamp(-1.0, 1.0).acos() / PI)
}

/// The unit direction of texture coordinates.
#[must_use]
pub fn uv_to_direction(u: f64, v: f64) -> DVec3 {
    let ((sin, cos), (sin_v, cos_v)) = ((TAU * (u - 0.5)).sin_cos(), (PI * v).sin_cos());
    DVec3::new(sin_v * sin, cos_v, -sin_v * cos)
}

/// `count` directions, evenly spread over the sphere: the spherical Fibonacci lattice (Gonzalez 2010), direction `i`.
#[must_use]
pub(crate) fn lattice(i: usize, count: usize) -> DVec3 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let y = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
    let (sin, cos) = (TAU * (i as f64 * GOLDEN).fract()).sin_cos();
    let planar = (1.0 - y * y).max(0.0).sqrt();
    DVec3::new(planar * cos, y, planar * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centre_looks_ahead() {
        let near = |d: DVec3, x, y, z| assert!((d - DVec3::new(x, y, z)).length() < 1e-15);
        near(uv_to_direction(0.5, 0.5), 0.0, 0.0, -1.0);
        near(uv_to_direction(0.75, 0.5), 1.0, 0.0, 0.0);
        near(uv_to_direction(0.3, 0.0), 0.0, 1.0, 0.0);
    }

    #[test]
    fn texture_coordinates_come_back() {
        for i in 0..1000 {
            let (u, v) = direction_to_uv(lattice(i, 1000));
            // acos loses half of its digits at the poles, the nearest of which is 0.04 away here.
            assert!((uv_to_direction(u, v) - lattice(i, 1000)).length() < 1e-13);
        }
    }
}

//! Signed distances, negative inside, and their smooth blends. After I. Quilez, *Distance functions*
//! and *Smooth minimum* (iquilezles.org); ellipsoids and blends are bounds, not exact distances.

use glam::DVec3;

use super::noise::bell;

/// The smooth minimum with a cubic blend over `k`: twice differentiable, exact where the two differ
/// by more than `k`.
pub(super) fn union(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * h * k / 6.0
}

/// `a` without `b`, the edge rounded over `k`.
pub(super) fn carve(a: f64, b: f64, k: f64) -> f64 {
    -union(-a, b, k)
}

/// A smooth |x|, so that mirrored halves meet without a crease.
pub(super) fn smooth_abs(x: f64, width: f64) -> f64 {
    (x * x + width * width).sqrt()
}

/// An ellipsoid with its axes along x, y, z.
pub(super) fn ellipsoid(p: DVec3, centre: DVec3, radii: DVec3) -> f64 {
    let q = p - centre;
    let outer = (q / radii).length();
    let inner = (q / (radii * radii)).length();
    if inner < 1e-12 { -radii.min_element() } else { outer * (outer - 1.0) / inner }
}

/// A point on a curve, with the radius of a tube there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    pub(super) at: DVec3,
    pub(super) radius: f64,
}

/// A knot at (x, y, z).
pub(super) const fn knot(x: f64, y: f64, z: f64, radius: f64) -> Knot {
    Knot { at: DVec3::new(x, y, z), radius }
}

/// A capsule between two knots, its radius blending linearly.
pub(super) fn capsule(p: DVec3, a: Knot, b: Knot) -> f64 {
    let (along, from) = (b.at - a.at, p - a.at);
    let h = (from.dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (from - along * h).length() - (a.radius + (b.radius - a.radius) * h)
}

/// A smooth curve, as a fine polyline with a bounding ball.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    knots: Vec<Knot>,
    /// 1 / length^2 of each segment.
    inverse_squares: Vec<f64>,
    centre: DVec3,
    reach: f64,
}

/// Segments between two control points of a [`Curve`].
const STEPS: usize = 6;

impl Curve {
    /// The Catmull-Rom spline through `control` (at least two).
    pub(super) fn new(control: &[Knot]) -> Self {
        let at = |i: isize| control[i.clamp(0, control.len() as isize - 1) as usize];
        let mut knots = Vec::with_capacity(control.len() * STEPS);
        for i in 0..control.len() as isize - 1 {
            for step in 0..STEPS {
                let t = step as f64 / STEPS as f64;
                knots.push(catmull_rom([at(i - 1), at(i), at(i + 1), at(i + 2)], t));
            }
        }
        knots.push(control[control.len() - 1]);
        let centre = knots.iter().map(|k| k.at).sum::<DVec3>() / knots.len() as f64;
        let reach = knots.iter().map(|k| k.at.distance(centre) + k.radius).fold(0.0, f64::max);
        let inverse_squares = knots.windows(2).map(|k| k[0].at.distance_squared(k[1].at).recip()).collect();
        Self { knots, inverse_squares, centre, reach }
    }

    /// A distance that is never more than that to any of its tubes.
    pub(super) fn bound(&self, p: DVec3) -> f64 {
        p.distance(self.centre) - self.reach
    }

    /// `d` joined with the tube over `k`.
    pub(super) fn join(&self, d: f64, p: DVec3, k: f64) -> f64 {
        // Beyond `k` the blend leaves `d` as it is.
        if self.bound(p) > d + k { d } else { union(d, self.tube(p), k) }
    }

    /// A bell around the curve: 1 on it, of the standard deviation `sigma`.
    pub(super) fn bell(&self, p: DVec3, sigma: f64) -> f64 {
        // Beyond six deviations it is below 2e-8.
        if self.bound(p) > 6.0 * sigma { 0.0 } else { bell(self.tube(p), sigma) }
    }

    /// Distance to the tube around the curve.
    pub(super) fn tube(&self, p: DVec3) -> f64 {
        self.nearest(p).0
    }

    /// Distance to the tube, and how far along the curve the nearest point lies, in [0, 1].
    pub(super) fn nearest(&self, p: DVec3) -> (f64, f64) {
        let last = self.knots.len() - 2;
        let (mut best, mut best_squared, mut clamped) = (0, f64::INFINITY, 0.0);
        for i in 0..=last {
            let (a, b) = (self.knots[i].at, self.knots[i + 1].at);
            let (along, from) = (b - a, p - a);
            let h = (from.dot(along) * self.inverse_squares[i]).clamp(0.0, 1.0);
            let squared = (from - along * h).length_squared();
            if squared < best_squared {
                (best, best_squared, clamped) = (i, squared, h);
            }
        }
        // The nearest point on a polyline jumps at its bends, which shows as stripes in the normals;
        // measured between the planes that halve the bends, it runs evenly.
        let (a, b) = (self.knots[best], self.knots[best + 1]);
        let (before, after) = ((p - a.at).dot(self.tangent(best)), (b.at - p).dot(self.tangent(best + 1)));
        let inner = before > 0.0 && after > 0.0;
        let h = if inner { before / (before + after) } else { clamped };
        let knot = between(a, b, h);
        (p.distance(knot.at) - knot.radius, (best as f64 + h) / (last + 1) as f64)
    }

    fn tangent(&self, i: usize) -> DVec3 {
        let last = self.knots.len() - 1;
        (self.knots[(i + 1).min(last)].at - self.knots[i.saturating_sub(1)].at).normalize_or_zero()
    }
}

fn between(a: Knot, b: Knot, h: f64) -> Knot {
    Knot { at: a.at.lerp(b.at, h), radius: a.radius + (b.radius - a.radius) * h }
}

fn catmull_rom(k: [Knot; 4], t: f64) -> Knot {
    let w = [
        0.5 * (-t + 2.0 * t * t - t * t * t),
        0.5 * (2.0 - 5.0 * t * t + 3.0 * t * t * t),
        0.5 * (t + 4.0 * t * t - 3.0 * t * t * t),
        0.5 * (-t * t + t * t * t),
    ];
    let mut out = knot(0.0, 0.0, 0.0, 0.0);
    for (weight, knot) in w.into_iter().zip(k) {
        out.at += knot.at * weight;
        out.radius += knot.radius * weight;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blends_leave_what_is_far_and_round_what_is_near() {
        assert_eq!(union(1.0, 3.0, 1.5), 1.0);
        assert_eq!(carve(1.0, 3.0, 1.5), 1.0);
        // Equal distances: the cubic blend takes off k / 6.
        assert!((union(2.0, 2.0, 1.2) - 1.8).abs() < 1e-12);
        assert!((carve(-2.0, 2.0, 1.2) + 1.8).abs() < 1e-12);
    }

    #[test]
    fn a_round_ellipsoid_is_a_ball() {
        let p = DVec3::new(1.0, 2.0, -2.0);
        assert!((ellipsoid(p, DVec3::ZERO, DVec3::splat(2.0)) - 1.0).abs() < 1e-12);
        assert_eq!(ellipsoid(DVec3::ZERO, DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)), -1.0);
    }

    #[test]
    fn a_straight_curve_is_a_capsule_and_its_bounds_hold() {
        let ends = [knot(-1.0, 0.0, 0.0, 0.2), knot(1.0, 0.5, 0.0, 0.2)];
        let curve = Curve::new(&ends);
        for i in 0..500 {
            let p = DVec3::new(
                (f64::from(i) * 0.7).sin(),
                (f64::from(i) * 1.3).cos(),
                (f64::from(i) * 0.4).sin(),
            ) * 3.0;
            let exact = capsule(p, ends[0], ends[1]);
            assert!((curve.tube(p) - exact).abs() < 1e-9, "{p}");
            assert!(curve.bound(p) <= exact + 1e-9);
        }
    }
}

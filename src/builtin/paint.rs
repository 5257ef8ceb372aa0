//! Colour, specular intensity and translucency of the skin at a place.

use glam::DVec3;

use super::head::{Head, METRES};
use super::landmarks::{Spot, eyebrow};
use super::noise::{bell, fractal, gradient_noise, lerp, nearest_feature, smoothstep};
use super::sdf::Curve;

/// Moles: anatomical place and radius.
const MOLES: [(DVec3, f64); 6] = [
    (DVec3::new(2.6, -4.9, 9.2), 0.11),
    (DVec3::new(-4.4, -2.1, 7.2), 0.09),
    (DVec3::new(-1.9, -9.2, 8.9), 0.10),
    (DVec3::new(4.9, -7.0, 5.0), 0.07),
    (DVec3::new(-3.5, 4.4, 8.2), 0.08),
    (DVec3::new(3.2, -15.0, 4.2), 0.12),
];

/// The painter, its curves prepared.
pub(super) struct Painter<'a> {
    head: &'a Head,
    eyebrow: Curve,
}

impl<'a> Painter<'a> {
    pub(super) fn new(head: &'a Head) -> Self {
        Self { head, eyebrow: eyebrow() }
    }

    /// The skin's colour, sRGB-encoded, in [0, 1].
    pub(super) fn color(&self, metres: DVec3) -> [f64; 3] {
        let spot = Spot::new(self.head, metres);
        let p = spot.p;
        let mut c = DVec3::new(0.815, 0.605, 0.490);
        // Mottling: broad patches of blood, fine grain of pigment.
        let broad = fractal(p * 0.45, 3, 11);
        let fine = fractal(p * 4.0, 2, 23);
        c += DVec3::new(0.012, -0.018, -0.018) * broad + DVec3::splat(0.012) * fine;
        c += DVec3::new(0.008, 0.012, 0.0) * spot.near(1.5, 5.0, 9.0, 2.5);
        c += DVec3::new(0.008, -0.062, -0.056) * blush(&spot);
        c *= DVec3::ONE - DVec3::new(0.10, 0.17, 0.16) * spot.eye;
        c *= DVec3::ONE - DVec3::new(0.06, 0.10, 0.06) * spot.near(2.6, -1.5, 8.5, 0.6);
        c = shade(c, DVec3::new(0.60, 0.36, 0.31), 0.5 * spot.ear * spot.near(7.3, -1.9, -0.6, 0.9));
        c = self.freckles(c, &spot);
        c = stubble(c, &spot);
        c = lip_color(c, &spot);
        c = self.brows_and_lashes(c, &spot);
        // Nostrils and the seam of the lips lie in their own shadow, and are redder.
        c = shade(c, DVec3::new(0.30, 0.13, 0.11), 0.8 * spot.near(0.70, -4.55, 10.1, 0.30));
        c.clamp(DVec3::splat(0.02), DVec3::splat(0.98)).to_array()
    }

    fn freckles(&self, mut c: DVec3, spot: &Spot) -> DVec3 {
        let place = spot.near(2.6, -2.2, 8.4, 2.4).max(0.35 * smoothstep(-16.0, -20.0, spot.p.y));
        let found = nearest_feature(spot.p * 2.6, 41);
        let size = 0.10 + 0.25 * found.number;
        let dot = smoothstep(size, 0.4 * size, found.distance) * smoothstep(0.45, 0.35, found.number);
        c = shade(c, c * DVec3::new(0.86, 0.76, 0.70), 0.55 * dot * place);
        for (at, radius) in MOLES {
            let mole = smoothstep(radius, 0.5 * radius, spot.p.distance(at) - 0.10);
            c = shade(c, DVec3::new(0.36, 0.21, 0.16), 0.75 * mole);
        }
        c
    }

    fn brows_and_lashes(&self, mut c: DVec3, spot: &Spot) -> DVec3 {
        const HAIR: DVec3 = DVec3::new(0.215, 0.150, 0.110);
        if self.eyebrow.bound(spot.half) < 0.5 {
            let (distance, along) = self.eyebrow.nearest(spot.half);
            let body = smoothstep(0.24, -0.20, distance + 0.10 * gradient_noise(spot.p * 9.0, 70))
                * smoothstep(0.0, 0.06, along);
            // Strokes lean outwards: stretched noise across the brow.
            let lean = spot.half.y - 0.35 * spot.half.x;
            let strokes = gradient_noise(DVec3::new(12.0 * (along * 4.5 - 0.7 * lean), 2.2 * lean, 0.0), 71);
            c = shade(c, HAIR, 0.92 * body * (0.50 + 0.50 * smoothstep(-0.35, 0.3, strokes)));
        }
        let line = &self.head.face.lid_line;
        if line.bound(spot.half) < 0.5 {
            let (distance, along) = line.nearest(spot.half);
            let ends = smoothstep(0.0, 0.12, along) * smoothstep(1.0, 0.93, along);
            let below = smoothstep(0.05, -0.35, spot.half.y + 0.55);
            let strokes = 0.5 + 0.5 * gradient_noise(DVec3::new(along * 34.0, 0.4 * spot.half.y, 3.0), 73);
            let lashes = smoothstep(0.26, 0.05, distance) * strokes * below;
            c = shade(c, HAIR * 0.7, (0.85 * bell(distance, 0.055)).max(0.7 * lashes) * ends);
        }
        c
    }

    /// The side-specular intensity, in [0, 1]: oily down the middle of the face, wet on the lips.
    pub(super) fn specular(&self, metres: DVec3) -> f64 {
        let spot = Spot::new(self.head, metres);
        let mut s = 0.16 + 0.04 * fractal(spot.p * 0.9, 2, 51);
        s += 0.26 * spot.near(0.8, 4.0, 9.2, 2.3) + 0.28 * spot.near(0.0, -2.6, 11.0, 1.6);
        s += 0.14 * spot.near(0.0, -10.0, 9.4, 1.1) + 0.10 * spot.eye;
        s -= 0.05 * spot.near(4.6, -3.8, 6.5, 1.8) + 0.05 * spot.beard;
        s = lerp(s, 0.42, spot.lips);
        // Neither the seam of the lips nor the nostrils see the light.
        let seam = bell(spot.above_lip_line + 0.02, 0.11) * smoothstep(8.0, 8.6, spot.p.z);
        s *= 1.0 - 0.9 * seam.max(spot.near(0.70, -4.55, 10.1, 0.35));
        // Pores do not shine.
        let pore = nearest_feature(spot.p * 7.0, 61);
        s *= 1.0 - 0.25 * smoothstep(0.35, 0.1, pore.distance) + 0.10 * gradient_noise(spot.p * 9.0, 62);
        if self.eyebrow.bound(spot.half) < 0.3 {
            s = lerp(s, 0.12, smoothstep(0.1, -0.1, self.eyebrow.tube(spot.half)));
        }
        s.clamp(0.0, 1.0)
    }

    /// How much light from behind comes through, in [0, 1], by the flesh's thickness under the skin
    /// (`normal` unit, outward): a mean free path of 8 mm over a floor for the scattering at any edge.
    pub(super) fn translucency(&self, metres: DVec3, normal: DVec3) -> f64 {
        let step = 0.1 * METRES;
        let mut depth = step;
        while depth < 3.0 * METRES {
            let outside = self.head.distance(metres - normal * depth);
            if outside > 0.0 {
                break;
            }
            depth += step.max(0.8 * -outside);
        }
        0.22 + 0.78 * (-depth / (0.8 * METRES)).exp()
    }
}

fn shade(c: DVec3, to: DVec3, share: f64) -> DVec3 {
    c.lerp(to, share.clamp(0.0, 1.0))
}

/// Where the blood shows.
fn blush(spot: &Spot) -> f64 {
    let flush = 0.9 * spot.near(4.2, -3.2, 7.2, 1.7)
        + 1.0 * spot.near(0.0, -3.7, 11.6, 1.0)
        + 0.5 * spot.near(1.4, -4.0, 10.4, 0.7)
        + 0.5 * spot.near(0.0, -10.2, 9.4, 1.2)
        + 0.9 * spot.ear
        + 0.35 * spot.near(0.0, 2.2, 9.2, 1.2);
    flush * (1.0 + 0.35 * fractal(spot.p * 1.3, 3, 31))
}

fn lip_color(c: DVec3, spot: &Spot) -> DVec3 {
    let tone = 1.0 + 0.06 * gradient_noise(spot.p * DVec3::new(7.0, 1.2, 1.0), 81);
    let upper = if spot.above_lip_line > 0.0 { 0.90 } else { 1.0 };
    let c = shade(c, DVec3::new(0.720, 0.375, 0.345) * tone * upper, 0.80 * spot.lips);
    let seam = bell(spot.above_lip_line + 0.03, 0.085) * smoothstep(8.0, 8.6, spot.p.z);
    shade(c, DVec3::new(0.33, 0.13, 0.12), 0.85 * seam * smoothstep(2.62, 2.45, spot.p.x.abs()))
}

/// Shaven hair: a bluish shadow, and its dots.
fn stubble(mut c: DVec3, spot: &Spot) -> DVec3 {
    let density = (0.60 * spot.beard * (1.0 - spot.lips)).max(0.36 * spot.scalp);
    if density > 0.0 {
        let patchy = density * (1.0 + 0.25 * fractal(spot.p * 0.8, 2, 91));
        let dot = nearest_feature(spot.p * 9.0, 92);
        c *= DVec3::ONE - DVec3::new(0.19, 0.15, 0.12) * patchy;
        c *= 1.0 - 0.30 * patchy * smoothstep(0.42, 0.15, dot.distance);
    }
    c
}

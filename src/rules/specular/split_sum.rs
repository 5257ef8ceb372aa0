//! What the BRDFs reflect of a constant environment: the split sum's integrals over the hemisphere, in f64.
//!
//! The integral of f N.L over the light's direction is taken over the slopes (p, q) of H, where dL = 4 H.V' dH. With
//! mu = N.V', s = sqrt(1 - mu^2) and r^2 = p^2 + q^2, N.L is 0 on the circle of radius 1 / mu about (s / mu, 0), and within
//! it
//!
//! ```text
//! kelemen   exp(-r^2 / m^2) / (pi m^2) (2 - mu (1 + r^2) / (mu + p s))                          dp dq
//! ggx       alpha^2 / (pi (alpha^2 + r^2)^2) 4 H.V' / N.H  G / (4 N.L N.V') N.L                  dp dq
//! ```
//!
//! are smooth. Polar coordinates, panels graded about the direction across the view, where mu + p s is as small as mu.

use std::f64::consts::{FRAC_PI_2, PI};

use super::brdf::{dielectric, ggx_visibility};
use super::{SpecularModel, gauss};

/// No view grazes more: at 0 the integrals' slope is infinite.
pub const MOST_GRAZING: f64 = 1e-6;

/// An integral, and its derivative by the roughness.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Integral {
    /// Its value.
    pub value: f64,
    /// Its derivative by m.
    pub by_roughness: f64,
}

impl Integral {
    fn add(&mut self, weight: f64, by_roughness: f64) {
        self.value += weight;
        self.by_roughness += weight * by_roughness;
    }
}

/// How finely the integrals are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quadrature {
    /// Directions in each panel.
    pub directions: usize,
    /// Places along each direction.
    pub places: usize,
}

impl Quadrature {
    /// To 1e-10 or better.
    pub const FINE: Self = Self { directions: 24, places: 72 };
    /// To 1e-6 or better; fits are made with it.
    pub const COARSE: Self = Self { directions: 10, places: 32 };
}

/// a and b: with Schlick's Fresnel factor the environment's share is f0 a + b. `view` is N.V' in [0, 1], m the roughness.
#[must_use]
pub fn split_sum(model: SpecularModel, view: f64, m: f64, quadrature: Quadrature) -> [Integral; 2] {
    let mut sums = [Integral::default(); 2];
    over_half_vectors(model, view, m, quadrature, |cosine, weight, by_roughness| {
        let grazing = (1.0 - cosine).powi(5);
        sums[0].add(weight * (1.0 - grazing), by_roughness);
        sums[1].add(weight * grazing, by_roughness);
    });
    sums
}

/// The environment's share with the Fresnel factor of a dielectric, and its derivative by f0.
#[must_use]
pub fn dielectric_sum(
    model: SpecularModel,
    view: f64,
    m: f64,
    f0: f64,
    quadrature: Quadrature,
) -> (Integral, f64) {
    let (mut sum, mut by_f0) = (Integral::default(), 0.0);
    over_half_vectors(model, view, m, quadrature, |cosine, weight, by_roughness| {
        let [fresnel, slope] = dielectric(cosine, f0);
        sum.add(weight * fresnel, by_roughness);
        by_f0 += weight * slope;
    });
    (sum, by_f0)
}

/// Give `each` H.V', the weight of that half vector, and the weight's logarithmic derivative by m.
fn over_half_vectors(
    model: SpecularModel,
    view: f64,
    m: f64,
    quadrature: Quadrature,
    mut each: impl FnMut(f64, f64, f64),
) {
    let view = view.clamp(MOST_GRAZING, 1.0);
    let across = (1.0 - view * view).max(0.0).sqrt();
    let (directions, places) = (gauss::nodes(quadrature.directions), gauss::nodes(quadrature.places));
    let edges = panels(view);
    for pair in edges.windows(2) {
        for (x, weight) in &directions {
            let turn = pair[0] + x * (pair[1] - pair[0]);
            let (sine, cosine) = turn.sin_cos();
            let end = (across * cosine + cosine.hypot(view * sine)) / view;
            // Both halves of the plane.
            let weight = 2.0 * weight * (pair[1] - pair[0]);
            for (u, part) in &places {
                let (r, step) = place(model, m, end, *u);
                let half = 1.0 / (1.0 + r * r).sqrt();
                let along = view + r * cosine * across;
                let (density, by_roughness) = density(model, m, r, view, along, half);
                each(half * along, weight * part * step * r * density, by_roughness);
            }
        }
    }
}

/// The panels' edges from 0 to half a turn.
fn panels(view: f64) -> Vec<f64> {
    let mut edges = vec![0.0, PI / 6.0, FRAC_PI_2, 5.0 * PI / 6.0, PI];
    let mut aside = view / 3.0;
    while aside < FRAC_PI_2 {
        edges.extend([FRAC_PI_2 - aside, FRAC_PI_2 + aside]);
        aside *= 3.0;
    }
    edges.sort_by(f64::total_cmp);
    edges
}

/// The length of a slope, as u goes from 0 to 1 up to `end`, and its derivative.
fn place(model: SpecularModel, m: f64, end: f64, u: f64) -> (f64, f64) {
    match model {
        // exp(-6.5^2) is 5e-19; squares, as the weight turns over where the slope is as small as mu.
        SpecularModel::Kelemen => {
            let end = end.min(6.5 * m);
            (end * u * u, 2.0 * end * u)
        }
        // The tail is long.
        SpecularModel::Ggx => {
            let alpha = m * m;
            let reach = (end / alpha).asinh();
            (alpha * (u * reach).sinh(), alpha * reach * (u * reach).cosh())
        }
    }
}

/// The weight of a slope of length r, `along` = mu + p s, `half` = N.H; and its logarithmic derivative by m.
fn density(model: SpecularModel, m: f64, r: f64, view: f64, along: f64, half: f64) -> (f64, f64) {
    match model {
        SpecularModel::Kelemen => {
            let x = r * r / (m * m);
            let lit = 2.0 - view * (1.0 + r * r) / along;
            ((-x).exp() / (PI * m * m) * lit, 2.0 * (x - 1.0) / m)
        }
        SpecularModel::Ggx => {
            let alpha = m * m;
            let (a2, r2) = (alpha * alpha, r * r);
            let light = 2.0 * half * half * along - view;
            if light <= 0.0 {
                return (0.0, 0.0);
            }
            let visible = ggx_visibility(light, view, alpha);
            let root = |x: f64| (a2 + (1.0 - a2) * x * x).sqrt();
            let slope = |x: f64| alpha * (1.0 - x * x) / root(x);
            let masked = view * slope(light) + light * slope(view);
            let by_alpha = 2.0 / alpha - 4.0 * alpha / (a2 + r2) - 2.0 * visible * masked;
            let weight = a2 / (PI * (a2 + r2) * (a2 + r2)) * 4.0 * along * visible * light;
            (weight, 2.0 * m * by_alpha)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODELS: [SpecularModel; 2] = SpecularModel::ALL;

    #[test]
    fn closed_forms_are_met() {
        for m in [0.05, 0.2, 0.35, 1.0] {
            let [a, b] = split_sum(SpecularModel::Kelemen, 1.0, m, Quadrature::FINE);
            let want = 1.0 - m * m * (1.0 - (-1.0 / (m * m)).exp());
            assert!((a.value + b.value - want).abs() < 1e-12, "{m}");
        }
        let [a, b] = split_sum(SpecularModel::Ggx, 1.0, 1.0, Quadrature::FINE);
        // The quadrature's own error.
        assert!((a.value + b.value - (1.0 - std::f64::consts::LN_2)).abs() < 1e-9);
    }

    #[test]
    fn a_white_furnace_gives_back_no_more_than_it_has() {
        for model in MODELS {
            for view in [0.0, 1e-4, 0.01, 0.1, 0.4, 0.8, 1.0] {
                for m in [0.05, 0.1, 0.4, 1.0] {
                    let [a, b] = split_sum(model, view, m, Quadrature::FINE).map(|x| x.value);
                    assert!(a >= 0.0 && b >= 0.0 && a + b <= 1.0, "{model:?} {view} {m}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn the_coarse_quadrature_is_fine_enough_for_fits() {
        for model in MODELS {
            for view in [1e-4, 0.003, 0.03, 0.3, 0.9, 1.0] {
                for m in [0.05, 0.13, 0.5, 1.0] {
                    let fine = split_sum(model, view, m, Quadrature::FINE);
                    let coarse = split_sum(model, view, m, Quadrature::COARSE);
                    for (fine, coarse) in fine.iter().zip(&coarse) {
                        // A fiftieth of the fits' error.
                        let off = (fine.value - coarse.value).abs();
                        assert!(off < 4e-6, "{model:?} {view} {m}: {off:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_values() {
        for model in MODELS {
            let at = |m: f64, f0: f64| {
                let [a, b] = split_sum(model, 0.3, m, Quadrature::FINE);
                let (es, by_f0) = dielectric_sum(model, 0.3, m, f0, Quadrature::FINE);
                ([a, b, es], by_f0)
            };
            let h = 1e-4;
            let (own, by_f0) = at(0.4, 0.04);
            let (above, below) = (at(0.4 + h, 0.04).0, at(0.4 - h, 0.04).0);
            for i in 0..3 {
                let want = (above[i].value - below[i].value) / (2.0 * h);
                // Third derivatives of order 10 times h^2.
                assert!((own[i].by_roughness - want).abs() < 1e-6, "{model:?} {i}");
            }
            let want = (at(0.4, 0.04 + h).0[2].value - at(0.4, 0.04 - h).0[2].value) / (2.0 * h);
            assert!((by_f0 - want).abs() < 1e-4, "{model:?}: {by_f0} {want}");
        }
    }
}

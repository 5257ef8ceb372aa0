//! Weights about a direction that depend on the angle alone: what environments are filtered with.

use crate::specular::SpecularModel;

/// A weight k(r.w), any multiple of it; 0 behind the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Radial {
    /// max(r.w, 0)^e.
    Phong(f64),
    /// A BRDF at N = V' = r with F = 1, times max(r.w, 0), for a roughness (MODEL 9).
    Brdf(SpecularModel, f64),
}

/// The share of a lobe's weight that may be cut.
const CUT: f64 = 1e-9;

impl Radial {
    /// The weight where r.w is `cosine`, 1 at the peak.
    ///
    /// With t = (1 - c) / (1 + c) = tan^2 of half the angle, kelemen's is exp(-t / m^2) (1 - t) (1 + t)^2; ggx's is
    /// c / (c + sqrt(alpha^2 + (1 - alpha^2) c^2)) / (1 + (1 - c) (1 - alpha^2) / (2 alpha^2))^2, doubled.
    #[must_use]
    pub fn weight(self, cosine: f64) -> f64 {
        if cosine <= 0.0 {
            return 0.0;
        }
        match self {
            Self::Phong(exponent) => cosine.powf(exponent),
            Self::Brdf(SpecularModel::Kelemen, m) => {
                let t = (1.0 - cosine) / (1.0 + cosine);
                (-t / (m * m)).exp() * (1.0 - t) * (1.0 + t) * (1.0 + t)
            }
            Self::Brdf(SpecularModel::Ggx, m) => {
                let a2 = m.powi(4);
                let masked = cosine + (a2 + (1.0 - a2) * cosine * cosine).sqrt();
                let spread = 1.0 + (1.0 - cosine) * (1.0 - a2) / (2.0 * a2);
                2.0 * cosine / (masked * spread * spread)
            }
        }
    }

    /// The exponent of the Phong lobe that is as sharp about its peak.
    pub(super) fn exponent(self) -> f64 {
        match self {
            Self::Phong(exponent) => exponent,
            // t is a quarter of the angle's square, of which a Phong lobe's logarithm is e / 2.
            Self::Brdf(SpecularModel::Kelemen, m) => (0.5 / (m * m)).max(1.0),
            Self::Brdf(SpecularModel::Ggx, m) => m.powi(-4).max(1.0),
        }
    }

    /// The angle beyond which a share of 1e-9 of the weight lies at most.
    pub(super) fn reach(self) -> f64 {
        match self {
            // The share of max(cos, 0)^e beyond an angle is its cosine to the power e + 1.
            Self::Phong(exponent) => CUT.powf(1.0 / (exponent + 1.0)).acos(),
            // The weight of t is at most exp(-t / m^2).
            Self::Brdf(SpecularModel::Kelemen, m) => {
                (2.0 * (-CUT.ln() * m * m).sqrt().atan()).min(std::f64::consts::FRAC_PI_2)
            }
            // The tail reaches the horizon.
            Self::Brdf(SpecularModel::Ggx, _) => std::f64::consts::FRAC_PI_2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::specular::brdf::brdf;

    #[test]
    fn weights_are_the_brdfs_looked_at_along_the_normal() {
        for model in SpecularModel::ALL {
            for m in [0.05, 0.2, 0.35, 0.7, 1.0] {
                // f0 = 1 makes either Fresnel factor 1.
                let value = |c: f64| {
                    let toward = [(1.0 - c * c).sqrt(), 0.0, c];
                    c * brdf(model, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], toward, m, 1.0)
                };
                let peak = value(1.0);
                for c in [0.01, 0.2, 0.5, 0.9, 0.99, 0.9999, 1.0] {
                    let (got, want) = (Radial::Brdf(model, m).weight(c), value(c) / peak);
                    // Rounding of the cosine: its logarithm counts 1 / m^2 fold.
                    assert!((got - want).abs() < 1e-12 * (1.0 + want), "{model:?} {m} {c}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn little_lies_beyond_the_reach() {
        for radial in [
            Radial::Phong(1.0),
            Radial::Phong(300.0),
            Radial::Brdf(SpecularModel::Kelemen, 0.05),
            Radial::Brdf(SpecularModel::Kelemen, 0.3),
            Radial::Brdf(SpecularModel::Ggx, 0.3),
        ] {
            let sum = |from: f64, to: f64| {
                let middle = |i: usize| from + (to - from) * (i as f64 + 0.5) / 4000.0;
                (0..4000).map(|i| radial.weight(middle(i).cos()) * middle(i).sin()).sum::<f64>() * (to - from)
            };
            let (reach, end) = (radial.reach(), std::f64::consts::FRAC_PI_2);
            assert!(sum(reach, end) <= 1.01 * CUT * sum(0.0, end), "{radial:?}");
        }
    }
}

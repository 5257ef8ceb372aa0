//! The BRDFs for one light, in f64, with the guards of MODEL 7 and 9.
//!
//! With h = L + V', sin^2 of the angle between N and H is |N x h|^2 / |h|^2 and its cosine N.h / |h|: near the lobe's peak
//! 1 - (N.H)^2 would cancel.

use std::f64::consts::PI;

use super::SpecularModel;

/// |h|^2 at or below this is no direction: 0.
pub const SHORTEST_SQUARED: f64 = 1e-12;
/// Beckmann's distribution is 0 at or below this cosine.
pub const LEAST_COSINE: f64 = 1e-3;

/// What a dielectric's g + u is held at: at u = 0 its reflectance would rise to 1 as soon as f0 leaves 0. Above f0 = 6e-6
/// it is never met.
const LEAST_SUM: f64 = 0.1;

/// What the formulas take of three unit directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// N.L.
    pub light: f64,
    /// N.V'.
    pub view: f64,
    /// |L + V'|^2.
    pub half_squared: f64,
    /// Squared cosine of N and H.
    pub cosine_squared: f64,
    /// Squared sine of N and H.
    pub sine_squared: f64,
    /// H.V', |L + V'| / 2.
    pub half_view: f64,
}

impl Angles {
    /// Of the unit normal, the unit vector from the eye to the surface, and the unit vector towards the light; `None`
    /// where nothing is reflected: one of them is below the surface, or L is opposite to V'.
    #[must_use]
    pub fn new(n: [f64; 3], view: [f64; 3], toward: [f64; 3]) -> Option<Self> {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let h: [f64; 3] = std::array::from_fn(|i| toward[i] - view[i]);
        let across = [n[1] * h[2] - n[2] * h[1], n[2] * h[0] - n[0] * h[2], n[0] * h[1] - n[1] * h[0]];
        let (light, eye, half_squared) = (dot(n, toward), -dot(n, view), dot(h, h));
        (light > 0.0 && eye > 0.0 && half_squared > SHORTEST_SQUARED).then(|| Self {
            light,
            view: eye,
            half_squared,
            cosine_squared: dot(n, h).powi(2) / half_squared,
            sine_squared: dot(across, across) / half_squared,
            half_view: 0.5 * half_squared.sqrt(),
        })
    }
}

/// Beckmann's distribution times pi, PH = exp(-tan^2 / m^2) / (m^2 cos^4), from the squared sine and cosine of (N, H).
#[must_use]
#[inline]
pub fn beckmann(sine_squared: f64, cosine_squared: f64, m: f64) -> f64 {
    if cosine_squared <= LEAST_COSINE * LEAST_COSINE {
        return 0.0;
    }
    let m2 = m * m;
    (-sine_squared / (cosine_squared * m2)).exp() / (m2 * cosine_squared * cosine_squared)
}

/// The distribution of GGX, from the squared sine and cosine of (N, H).
#[must_use]
#[inline]
pub fn ggx_distribution(sine_squared: f64, cosine_squared: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let spread = a2.mul_add(cosine_squared, sine_squared);
    a2 / (PI * spread * spread)
}

/// Smith's height-correlated masking of GGX over 4 (N.L)(N.V').
#[must_use]
#[inline]
pub fn ggx_visibility(light: f64, view: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let root = |x: f64| (a2 + (1.0 - a2) * x * x).sqrt();
    0.5 / (view * root(light) + light * root(view))
}

/// Schlick's Fresnel factor at the cosine `u` of (H, V').
#[must_use]
#[inline]
pub fn schlick(u: f64, f0: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - u).powi(5)
}

/// The unpolarised Fresnel factor of a dielectric, eta = (1 + sqrt f0) / (1 - sqrt f0), at the cosine `u`, and its
/// derivative by f0; 1 from f0 = 1 on.
///
/// The factor f0 stands outside: with e = eta^2 - 1 = 4 q / (1 - q)^2, q = sqrt f0, and g = sqrt(u^2 + e), the usual g - u
/// is e / (g + u). So value and derivative hold at f0 = 0 too. g + u is held at 0.1.
#[must_use]
#[inline]
pub fn dielectric(u: f64, f0: f64) -> [f64; 2] {
    if f0 >= 1.0 {
        return [1.0, 0.0];
    }
    // Below it q stands for 0: value and derivative are those of the limit.
    let q = f0.max(1e-24).sqrt();
    let rest = 1.0 - q;
    let e = 4.0 * q / (rest * rest);
    let g = (u * u + e).sqrt();
    let held = g + u < LEAST_SUM;
    let sum = (g + u).max(LEAST_SUM);
    let difference = e / sum;
    let (above, below) = (u * sum - 1.0, u * difference + 1.0);
    let (scale, ratio) = (rest * sum, above / below);
    let factor = 8.0 / scale.powi(4) * (1.0 + ratio * ratio);
    // By q: of e, of g + u and of g - u.
    let e_slope = 4.0 * (1.0 + q) / (rest * rest * rest);
    let g_slope = e_slope / (2.0 * g);
    let (sum_slope, difference_slope) = if held { (0.0, e_slope / sum) } else { (g_slope, g_slope) };
    let scale_slope = rest * sum_slope - sum;
    let ratio_slope = u * (sum_slope * below - above * difference_slope) / (below * below);
    let factor_slope = -4.0 * factor * scale_slope / scale + 16.0 / scale.powi(4) * ratio * ratio_slope;
    [f0 * factor, factor + f0 * factor_slope / (2.0 * q)]
}

/// The BRDF f over `specular_weight` s, for roughness m; the reflected radiance is that times the light's irradiance.
/// 0 where [`Angles::new`] finds nothing.
#[must_use]
pub fn brdf(model: SpecularModel, n: [f64; 3], view: [f64; 3], toward: [f64; 3], m: f64, f0: f64) -> f64 {
    let Some(at) = Angles::new(n, view, toward) else { return 0.0 };
    match model {
        SpecularModel::Kelemen => {
            beckmann(at.sine_squared, at.cosine_squared, m) * schlick(at.half_view, f0)
                / (PI * at.half_squared)
        }
        SpecularModel::Ggx => {
            let alpha = m * m;
            ggx_distribution(at.sine_squared, at.cosine_squared, alpha)
                * ggx_visibility(at.light, at.view, alpha)
                * dielectric(at.half_view, f0)[0]
        }
    }
}

//! Specular light with Fresnel (MODEL 9): two BRDFs, what they reflect of a constant environment, and the fits of that
//! which the rules evaluate.
//!
//! - [`brdf`]: Kelemen and Szirmay-Kalos' BRDF and GGX, for one light, in f64
//! - [`split_sum`]: their integrals over the hemisphere, by quadrature (`gauss`)
//! - `fitted`, `fitted_dielectric`: the same as rational functions (`rational`), printed into
//!   `shader/rules/lib/split_sum_*.wgsl` and `dielectric_sum_ggx.wgsl`; the tests print them
//!
//! The rules have the same formulas in WGSL (`shader/rules/lib/specular.wgsl`); what stands here makes fits and
//! bakes, and is what the tests hold the rules against.

pub mod brdf;
#[cfg(test)]
mod fitted;
#[cfg(test)]
mod fitted_dielectric;
mod gauss;
#[cfg(test)]
mod rational;
#[cfg(test)]
mod rules;
pub mod split_sum;

pub use crate::model::choices::SpecularModel;
use crate::model::params::Params;

/// The least roughness that any formula takes.
pub const SMOOTHEST: f64 = 0.05;

/// The roughness m that every formula takes, from the parameters and a texel's specular intensity s.
#[must_use]
pub fn roughness_of(roughness: f64, gloss: f64, s: f64) -> f64 {
    (roughness * (1.0 - gloss * s)).max(SMOOTHEST)
}

/// How fast the roughness where the specular map is white moves with `roughness` and with `gloss`.
#[must_use]
pub fn glossy_paces(params: &Params) -> [f64; 2] {
    let [roughness, gloss] = ["roughness", "gloss"].map(|name| params.scalar_named(name));
    // At the bound the product moves it, as the rules have it.
    if roughness * (1.0 - gloss) >= SMOOTHEST { [1.0 - gloss, -roughness] } else { [0.0; 2] }
}

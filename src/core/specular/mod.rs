//! Specular light with Fresnel (MODEL 9): two BRDFs, what they reflect of a constant environment, and the fits of that
//! which the rules evaluate.
//!
//! - [`brdf`]: Kelemen and Szirmay-Kalos' BRDF and GGX, for one light, in f64
//! - [`split_sum`]: their integrals over the hemisphere, by quadrature (`gauss`)
//! - `fitted`: the same as rational functions, printed into `shader/rules/lib/split_sum_*.wgsl`; the tests print them
//!
//! The rules have the same formulas in WGSL (`shader/rules/lib/specular.wgsl`); what stands here makes fits and bakes, and
//! is what the tests hold the rules against.

pub mod brdf;
#[cfg(test)]
mod fitted;
mod gauss;
#[cfg(test)]
mod rules;
pub mod split_sum;

/// The least roughness that any formula takes.
pub const SMOOTHEST: f64 = 0.05;

/// A specular BRDF (the scene's `specular_model`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpecularModel {
    /// Beckmann's distribution over |h|^2 (Kelemen and Szirmay-Kalos 2001; GPU Gems 3, chapter 14).
    Kelemen,
    /// GGX with height-correlated masking (Walter et al. 2007, Heitz 2014), alpha the square of the roughness.
    Ggx,
}

impl SpecularModel {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Kelemen, Self::Ggx];

    /// Its name in scenes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kelemen => "kelemen",
            Self::Ggx => "ggx",
        }
    }
}

/// The roughness m that every formula takes, from the parameters and a texel's specular intensity s.
#[must_use]
pub fn roughness_of(roughness: f64, gloss: f64, s: f64) -> f64 {
    (roughness * (1.0 - gloss * s)).max(SMOOTHEST)
}

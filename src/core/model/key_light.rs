//! Where the key light stands.

use super::params::{Param, Params};

/// The key light's direction, and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct KeyLight {
    /// Unit vector towards the light.
    pub direction: [f64; 3],
    /// d direction / d key_azimuth, a degree.
    pub by_azimuth: [f64; 3],
    /// d direction / d key_elevation, a degree.
    pub by_elevation: [f64; 3],
}

impl KeyLight {
    /// The key light of `params`.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        let degree = std::f64::consts::PI / 180.0;
        let (sa, ca) = params.scalar(Param::KeyAzimuth).to_radians().sin_cos();
        let (se, ce) = params.scalar(Param::KeyElevation).to_radians().sin_cos();
        Self {
            direction: [ce * sa, se, ce * ca],
            by_azimuth: [degree * ce * ca, 0.0, -degree * ce * sa],
            by_elevation: [-degree * se * sa, degree * ce, -degree * se * ca],
        }
    }
}

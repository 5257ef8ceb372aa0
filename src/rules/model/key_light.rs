//! Where the key light stands.

use super::bearing::Bearing;
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
        let [azimuth, elevation] = [Param::KeyAzimuth, Param::KeyElevation].map(|angle| params.scalar(angle));
        let bearing = Bearing { azimuth, elevation };
        Self {
            direction: bearing.direction(),
            by_azimuth: bearing.by_azimuth(),
            by_elevation: bearing.by_elevation(),
        }
    }
}

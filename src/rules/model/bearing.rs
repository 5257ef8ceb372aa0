//! Directions towards a light as two angles (MODEL 8).

/// Where a light stands, as seen from the scene: degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bearing {
    /// From +Z towards +X.
    pub azimuth: f64,
    /// Above the horizon.
    pub elevation: f64,
}

impl Bearing {
    /// Of a direction of any length. Straight above and below the azimuth is 0; of no direction both are.
    #[must_use]
    pub fn of([x, y, z]: [f64; 3]) -> Self {
        // -0 lies half a turn from 0.
        let azimuth = (x + 0.0).atan2(z + 0.0).to_degrees();
        Self { azimuth, elevation: y.atan2(x.hypot(z)).to_degrees() }
    }

    /// Sines and cosines of azimuth and elevation.
    fn sines(self) -> ([f64; 2], [f64; 2]) {
        let (sa, ca) = self.azimuth.to_radians().sin_cos();
        let (se, ce) = self.elevation.to_radians().sin_cos();
        ([sa, se], [ca, ce])
    }

    /// The unit vector towards the light.
    #[must_use]
    pub fn direction(self) -> [f64; 3] {
        let ([sa, se], [ca, ce]) = self.sines();
        [ce * sa, se, ce * ca]
    }

    /// d direction / d azimuth, a degree.
    #[must_use]
    pub fn by_azimuth(self) -> [f64; 3] {
        let ([sa, _], [ca, ce]) = self.sines();
        [DEGREE * ce * ca, 0.0, -DEGREE * ce * sa]
    }

    /// d direction / d elevation, a degree.
    #[must_use]
    pub fn by_elevation(self) -> [f64; 3] {
        let ([sa, se], [ca, ce]) = self.sines();
        [-DEGREE * se * sa, DEGREE * ce, -DEGREE * se * ca]
    }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_directions_are_each_others_inverse() {
        for azimuth in [-179.0, -90.0, -12.5, 0.0, 45.0, 180.0] {
            for elevation in [-89.0, -30.0, 0.0, 60.0] {
                let bearing = Bearing { azimuth, elevation };
                let back = Bearing::of(bearing.direction().map(|x| 7.0 * x));
                // Roundings of f64, which a pole 1 degree away makes 60 times as large.
                assert!((back.azimuth - azimuth).abs() < 1e-11, "{back:?}");
                assert!((back.elevation - elevation).abs() < 1e-11, "{back:?}");
            }
        }
    }

    #[test]
    fn straight_above_and_below_the_azimuth_is_0_whatever_the_zeros_signs() {
        for (x, z) in [(0.0, 0.0), (0.0, -0.0), (-0.0, -0.0)] {
            assert_eq!(Bearing::of([x, 2.0, z]), Bearing { azimuth: 0.0, elevation: 90.0 });
            assert_eq!(Bearing::of([x, -2.0, z]), Bearing { azimuth: 0.0, elevation: -90.0 });
            assert_eq!(Bearing::of([x, 0.0, z]), Bearing { azimuth: 0.0, elevation: 0.0 });
        }
    }
}

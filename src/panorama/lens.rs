//! Lenses: from points of an image to directions in the camera, and back.
//!
//! A fisheye by its image circle (Kannala and Brandt 2006, section 2): equidistant, r = f theta, or equisolid,
//! r = 2 f sin(theta / 2). A mirror ball seen from far away, so that all view rays are parallel (Miller and Hoffman
//! 1984): the direction is the view's, reflected at the ball's normal.

use glam::{DVec2, DVec3};
use thiserror::Error;

/// What is wrong with a lens.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LensError {
    /// The centre or the radius is not one.
    #[error(
        "The image circle has its centre at ({x}, {y}) and a radius of {radius} pixels. Give finite numbers, the radius above 0."
    )]
    Circle {
        /// The centre's x.
        x: f64,
        /// The centre's y.
        y: f64,
        /// The radius.
        radius: f64,
    },
    /// The field of view is not one.
    #[error("The field of view is {0} degrees. Give the whole angle, above 0 and at most 360.")]
    FieldOfView(f64),
    /// The cone of the camera's reflection is not one.
    #[error(
        "The camera's reflection takes a cone of {0} degrees around the view. Give half its angle, from 0 to below 180."
    )]
    Cone(f64),
    /// The trusted share is not one.
    #[error("The ball is trusted up to {0} of its radius. Give a share above 0 and at most 1.")]
    Trusted(f64),
    /// The cone takes all that the ball's trusted part shows.
    #[error(
        "The camera's reflection takes all of the ball that is trusted. Give a narrower cone or trust more of the radius."
    )]
    NothingLeft,
}

/// How a fisheye maps the angle theta from its axis to the distance from the image's centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// r = f theta.
    Equidistant,
    /// r = 2 f sin(theta / 2): equal solid angles have equal areas.
    Equisolid,
}

/// A fisheye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fisheye {
    /// Angle to radius.
    pub projection: Projection,
    /// The image circle's centre, pixels.
    pub centre: DVec2,
    /// The image circle's radius, pixels.
    pub radius: f64,
    /// The angle across the whole image circle, degrees.
    pub field_of_view_degrees: f64,
}

/// A mirror ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorBall {
    /// The ball's centre in the image, pixels.
    pub centre: DVec2,
    /// The ball's radius in the image, pixels.
    pub radius: f64,
    /// The camera reflects itself within this angle of the direction back to it, degrees; 0 for none.
    pub camera_degrees: f64,
    /// The share of the radius up to which the ball is trusted: at the rim a pixel spans many degrees, and the ball's
    /// surroundings bleed in. 0.97 leaves a blind cone of 28 degrees to each side behind the ball.
    pub trusted: f64,
}

/// A lens. Its camera looks along -Z, with +Y up and +X to the right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// A fisheye.
    Fisheye(Fisheye),
    /// A mirror ball, photographed from far away.
    MirrorBall(MirrorBall),
}

impl Lens {
    /// Whether its numbers make a lens.
    ///
    /// # Errors
    /// What is wrong first.
    pub fn check(&self) -> Result<(), LensError> {
        let (centre, radius) = self.circle();
        // NaN is above nothing.
        if !(centre.is_finite() && radius.is_finite() && radius > 0.0) {
            return Err(LensError::Circle { x: centre.x, y: centre.y, radius });
        }
        match self {
            Self::Fisheye(Fisheye { field_of_view_degrees: angle, .. })
                if !(*angle > 0.0 && *angle <= 360.0) =>
            {
                Err(LensError::FieldOfView(*angle))
            }
            Self::Fisheye(_) => Ok(()),
            Self::MirrorBall(ball) if !(ball.camera_degrees >= 0.0 && ball.camera_degrees < 180.0) => {
                Err(LensError::Cone(ball.camera_degrees))
            }
            Self::MirrorBall(ball) if !(ball.trusted > 0.0 && ball.trusted <= 1.0) => {
                Err(LensError::Trusted(ball.trusted))
            }
            Self::MirrorBall(ball) if 2.0 * ball.trusted.asin() <= ball.camera_degrees.to_radians() => {
                Err(LensError::NothingLeft)
            }
            Self::MirrorBall(_) => Ok(()),
        }
    }

    /// The unit direction in the camera that a point of the image shows; `None` outside the image circle or the ball.
    #[must_use]
    pub fn direction(&self, point: DVec2) -> Option<DVec3> {
        let (centre, radius) = self.circle();
        // The image's y runs down.
        let at = (point - centre) / radius * DVec2::new(1.0, -1.0);
        let share = at.length();
        if share.is_nan() || share > 1.0 {
            return None;
        }
        let theta = self.angle(share);
        let (sin, cos) = theta.sin_cos();
        let outward = if share > 0.0 { at / share * sin } else { DVec2::ZERO };
        Some(outward.extend(-self.axis() * cos))
    }

    /// The point of the image that shows a unit direction in the camera; `None` where none does, and where the ball's
    /// whole rim does.
    #[must_use]
    pub fn point(&self, direction: DVec3) -> Option<DVec2> {
        let planar = direction.truncate().length();
        let theta = self.off_axis(direction, planar);
        let share = self.share(theta);
        if share.is_nan() || share > 1.0 || planar == 0.0 && theta != 0.0 {
            return None;
        }
        let (centre, radius) = self.circle();
        let outward = if planar > 0.0 { direction.truncate() / planar } else { DVec2::ZERO };
        Some(centre + radius * share * outward * DVec2::new(1.0, -1.0))
    }

    /// How far inside its border the lens sees a unit direction, radians; below 0 outside. A ball has two borders: its
    /// trusted rim and the camera's cone.
    #[must_use]
    pub fn depth(&self, direction: DVec3) -> f64 {
        let theta = self.off_axis(direction, direction.truncate().length());
        match self {
            Self::Fisheye(fisheye) => 0.5 * fisheye.field_of_view_degrees.to_radians() - theta,
            Self::MirrorBall(ball) => {
                let (rim, cone) =
                    (2.0 * ball.trusted.asin() - theta, theta - ball.camera_degrees.to_radians());
                if ball.camera_degrees > 0.0 { rim.min(cone) } else { rim }
            }
        }
    }

    /// Pixels that a radian takes from the centre of the image outward.
    #[must_use]
    pub fn pixels_per_radian(&self) -> f64 {
        let small = 1e-6;
        self.circle().1 * self.share(small) / small
    }

    /// The centre and the radius of what the image shows.
    fn circle(&self) -> (DVec2, f64) {
        match self {
            Self::Fisheye(fisheye) => (fisheye.centre, fisheye.radius),
            Self::MirrorBall(ball) => (ball.centre, ball.radius),
        }
    }

    /// -1 where the image's centre shows what lies behind the camera, as a ball's does.
    fn axis(&self) -> f64 {
        match self {
            Self::Fisheye(_) => 1.0,
            Self::MirrorBall(_) => -1.0,
        }
    }

    /// The angle between a direction and what the image's centre shows; atan2 is exact at both ends, acos at none.
    fn off_axis(&self, direction: DVec3, planar: f64) -> f64 {
        planar.atan2(-self.axis() * direction.z)
    }

    /// The angle from the axis at a share of the radius.
    fn angle(&self, share: f64) -> f64 {
        match self {
            Self::Fisheye(Fisheye { projection, field_of_view_degrees, .. }) => {
                let half = 0.5 * field_of_view_degrees.to_radians();
                match projection {
                    Projection::Equidistant => share * half,
                    Projection::Equisolid => 2.0 * (share * (0.5 * half).sin()).clamp(-1.0, 1.0).asin(),
                }
            }
            // The normal leans by asin(share), and a reflection turns twice as far.
            Self::MirrorBall(_) => 2.0 * share.min(1.0).asin(),
        }
    }

    /// The share of the radius at an angle from the axis; above 1 beyond the field of view.
    fn share(&self, theta: f64) -> f64 {
        match self {
            Self::Fisheye(Fisheye { projection, field_of_view_degrees, .. }) => {
                let half = 0.5 * field_of_view_degrees.to_radians();
                match projection {
                    Projection::Equidistant => theta / half,
                    Projection::Equisolid => (0.5 * theta).sin() / (0.5 * half).sin(),
                }
            }
            Self::MirrorBall(_) => (0.5 * theta).sin(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fisheye(projection: Projection, field_of_view_degrees: f64) -> Lens {
        Lens::Fisheye(Fisheye {
            projection,
            centre: DVec2::new(510.25, 498.5),
            radius: 480.0,
            field_of_view_degrees,
        })
    }

    fn ball() -> Lens {
        let centre = DVec2::new(510.25, 498.5);
        Lens::MirrorBall(MirrorBall { centre, radius: 480.0, camera_degrees: 5.0, trusted: 0.97 })
    }

    fn lenses() -> Vec<Lens> {
        let mut lenses = vec![ball()];
        for degrees in [90.0, 180.0, 220.0, 360.0] {
            lenses.push(fisheye(Projection::Equidistant, degrees));
            lenses.push(fisheye(Projection::Equisolid, degrees));
        }
        lenses
    }

    #[test]
    fn points_come_back() {
        for lens in lenses() {
            for i in 0..2000 {
                // Up to 0.9995 of the radius, beyond which a whole turn's rim is one direction.
                let (r, phi) = (480.0 * (f64::from(i) / 2001.0).sqrt(), f64::from(i) * 2.4);
                let point = DVec2::new(510.25 + r * phi.cos(), 498.5 + r * phi.sin());
                let direction = lens.direction(point).unwrap();
                assert!((direction.length() - 1.0).abs() < 1e-14);
                // 1e-12 of the radius: rounding, lost tenfold where the sine is near its top.
                assert!((lens.point(direction).unwrap() - point).length() < 480.0 * 1e-12, "{lens:?} {i}");
            }
        }
    }

    #[test]
    fn directions_come_back() {
        for lens in lenses() {
            for i in 0..2000 {
                let direction = crate::latlong::lattice(i, 2000);
                // At a whole turn's rim an angle moves the point by its square: it comes back with half of the digits.
                let Some(point) = lens.point(direction).filter(|_| direction.z.abs() < 0.99) else {
                    continue;
                };
                assert!((lens.direction(point).unwrap() - direction).length() < 1e-12, "{lens:?} {i}");
            }
        }
    }

    #[test]
    fn up_is_up_and_right_is_right() {
        let lens = fisheye(Projection::Equidistant, 180.0);
        let right = lens.direction(DVec2::new(510.25 + 480.0, 498.5)).unwrap();
        let up = lens.direction(DVec2::new(510.25, 498.5 - 240.0)).unwrap();
        assert!((right - DVec3::X).length() < 1e-15);
        assert!((up - DVec3::new(0.0, 1.0, -1.0).normalize()).length() < 1e-15);
    }

    #[test]
    fn a_ball_reflects() {
        let lens = ball();
        let (x, y) = (0.3, -0.55);
        let normal = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
        let reflected = DVec3::NEG_Z.reflect(normal);
        let direction = lens.direction(DVec2::new(510.25 + 480.0 * x, 498.5 - 480.0 * y)).unwrap();
        assert!((direction - reflected).length() < 1e-14);
        // The centre shows the camera, which its cone masks out, and the rim what is behind the ball.
        assert!(lens.depth(DVec3::Z) < 0.0 && lens.depth(DVec3::NEG_Z) < 0.0 && lens.depth(DVec3::X) > 0.0);
    }

    #[test]
    fn wrong_lenses_are_refused() {
        assert!(fisheye(Projection::Equidistant, f64::NAN).check().is_err());
        assert!(fisheye(Projection::Equisolid, 361.0).check().is_err());
        let (centre, radius) = (DVec2::ZERO, 1.0);
        let ball = |camera_degrees, trusted| MirrorBall { centre, radius, camera_degrees, trusted };
        for (wrong, error) in [
            (ball(-1.0, 1.0), LensError::Cone(-1.0)),
            (ball(0.0, 1.5), LensError::Trusted(1.5)),
            (ball(170.0, 0.9), LensError::NothingLeft),
        ] {
            assert_eq!(Lens::MirrorBall(wrong).check(), Err(error));
        }
        assert!(Lens::MirrorBall(MirrorBall { radius: 0.0, ..ball(0.0, 1.0) }).check().is_err());
    }
}

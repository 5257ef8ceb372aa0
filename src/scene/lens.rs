//! How a lens departs from a pinhole in the middle of its image: OpenCV's models, with its names.
//!
//! Places on the *image plane* are X / Z and Y / Z of a point in front of the camera: to the right, and down.

/// A lens; by default a pinhole's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Where its axis meets the image, in pixels to the right of and below the image's middle.
    pub centre: [f64; 2],
    /// The focal length across over the one along the image's height.
    pub ratio: f64,
    /// How it bends what is straight.
    pub distortion: Option<Distortion>,
}

/// A model of distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distortion {
    /// Brown 1966, as OpenCV has it: radial k1, k2, k3, and tangential p1, p2.
    Brown {
        /// Factors of r^2, r^4 and r^6.
        k: [f64; 3],
        /// Tangential.
        p: [f64; 2],
    },
    /// Kannala and Brandt 2006, as OpenCV has it: the angle from the axis is measured, and factors of its odd powers.
    Fisheye {
        /// Factors of its third, fifth, seventh and ninth power.
        k: [f64; 4],
    },
}

impl Default for Lens {
    fn default() -> Self {
        Self { centre: [0.0; 2], ratio: 1.0, distortion: None }
    }
}

/// Beyond this tangent of the angle from the axis (89 degrees) a place on the image plane is too far out to be found.
const WIDEST: f64 = 57.3;
/// Steps of Newton's method; from where the image is, five or six are enough.
const STEPS: usize = 50;

impl Lens {
    /// Where on the image plane the light comes from that meets this place; none where no place maps to it, or the model
    /// folds the image over.
    #[must_use]
    #[inline]
    pub fn undistorted(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        match self.distortion {
            None => Some(place),
            Some(Distortion::Brown { k, p }) => inverse_brown(k, p, place),
            Some(Distortion::Fisheye { k }) => inverse_fisheye(k, place),
        }
    }

    /// Where light from this place on the image plane goes, and how that moves along both of its coordinates: columns of
    /// the Jacobian.
    #[must_use]
    #[inline]
    pub fn distorted(&self, place: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        match self.distortion {
            None => (place, [[1.0, 0.0], [0.0, 1.0]]),
            Some(Distortion::Brown { k, p }) => brown(k, p, place),
            Some(Distortion::Fisheye { k }) => fisheye(k, place),
        }
    }
}

fn determinant([[a, b], [c, d]]: [[f64; 2]; 2]) -> f64 {
    a * d - b * c
}

/// OpenCV's documentation, "Camera Calibration and 3D Reconstruction".
fn brown([k1, k2, k3]: [f64; 3], [p1, p2]: [f64; 2], [x, y]: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    // By r2.
    let slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
    let to = [
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    ];
    let mixed = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
    let by_x = [radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, mixed];
    let by_y = [mixed, radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x];
    (to, [by_x, by_y])
}

fn inverse_brown(k: [f64; 3], p: [f64; 2], asked: [f64; 2]) -> Option<[f64; 2]> {
    let mut at = asked;
    for _ in 0..STEPS {
        let (to, columns) = brown(k, p, at);
        let error = [asked[0] - to[0], asked[1] - to[1]];
        let det = determinant(columns);
        if det <= 0.0 || !det.is_finite() {
            return None;
        }
        let [[a, b], [c, d]] = columns;
        let step = [(d * error[0] - c * error[1]) / det, (a * error[1] - b * error[0]) / det];
        at = [at[0] + step[0], at[1] + step[1]];
        // Roundings are all that is left.
        if step[0].hypot(step[1]) <= 1e-14 * (1.0 + at[0].hypot(at[1])) {
            let within = at[0].hypot(at[1]) < WIDEST && determinant(brown(k, p, at).1) > 0.0;
            return within.then_some(at);
        }
    }
    None
}

/// The distorted angle, and its slope by the angle.
fn bent([k1, k2, k3, k4]: [f64; 4], angle: f64) -> (f64, f64) {
    let a2 = angle * angle;
    let value = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
    let slope = 1.0 + a2 * (3.0 * k1 + a2 * (5.0 * k2 + a2 * (7.0 * k3 + a2 * 9.0 * k4)));
    (value, slope)
}

fn fisheye(k: [f64; 4], [x, y]: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
    let r = x.hypot(y);
    if r < 1e-8 {
        // The angle's tangent is the angle, to the last digit.
        return ([x, y], [[1.0, 0.0], [0.0, 1.0]]);
    }
    let (angle, slope) = bent(k, r.atan());
    let scale = angle / r;
    // By r: of the angle along the ray, and of the scale across.
    let along = slope / (1.0 + r * r);
    let [u, v] = [x / r, y / r];
    let by = |a: f64, b: f64, own: f64| along * a * b + scale * (own - a * b);
    ([scale * x, scale * y], [[by(u, u, 1.0), by(u, v, 0.0)], [by(u, v, 0.0), by(v, v, 1.0)]])
}

fn inverse_fisheye(k: [f64; 4], [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let asked = x.hypot(y);
    if asked < 1e-8 {
        return Some([x, y]);
    }
    let mut angle = asked;
    for _ in 0..STEPS {
        let (value, slope) = bent(k, angle);
        if slope <= 0.0 || !slope.is_finite() {
            return None;
        }
        let step = (asked - value) / slope;
        angle += step;
        if step.abs() <= 1e-15 * (1.0 + angle.abs()) {
            let r = angle.tan();
            let within = angle > 0.0 && angle < WIDEST.atan() && bent(k, angle).1 > 0.0;
            return within.then(|| [r * x / asked, r * y / asked]);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENSES: [Distortion; 4] = [
        // OpenCV's own samples have numbers of this size.
        Distortion::Brown { k: [-0.28, 0.11, -0.02], p: [0.0012, -0.0007] },
        Distortion::Brown { k: [0.1, 0.0, 0.0], p: [0.0; 2] },
        Distortion::Fisheye { k: [0.0; 4] },
        Distortion::Fisheye { k: [-0.02, 0.004, -0.001, 0.0002] },
    ];

    fn places() -> impl Iterator<Item = [f64; 2]> {
        (-6..=6).flat_map(|i| (-6..=6).map(move |j| [0.1 * f64::from(i), 0.1 * f64::from(j)]))
    }

    #[test]
    fn what_is_distorted_is_found_again() {
        for lens in LENSES.map(|distortion| Lens { distortion: Some(distortion), ..Lens::default() }) {
            for place in places() {
                let (to, _) = lens.distorted(place);
                let back = lens.undistorted(to).unwrap();
                // Roundings of a dozen operations of numbers below 1.
                let error = (back[0] - place[0]).hypot(back[1] - place[1]);
                assert!(error < 1e-13, "{lens:?}: {place:?} {back:?}");
            }
        }
    }

    #[test]
    fn slopes_are_those_of_finite_differences() {
        let step = 1e-6;
        for lens in LENSES.map(|distortion| Lens { distortion: Some(distortion), ..Lens::default() }) {
            for [x, y] in places() {
                let (_, columns) = lens.distorted([x, y]);
                let moved = |dx: f64, dy: f64| lens.distorted([x + dx, y + dy]).0;
                let central = |dx: f64, dy: f64| {
                    let (a, b) = (moved(dx, dy), moved(-dx, -dy));
                    [(a[0] - b[0]) / (2.0 * step), (a[1] - b[1]) / (2.0 * step)]
                };
                for (column, want) in columns.into_iter().zip([central(step, 0.0), central(0.0, step)]) {
                    // The square of the step, and roundings over it.
                    assert!((0..2).all(|i| (column[i] - want[i]).abs() < 1e-9), "{lens:?} {x} {y}");
                }
            }
        }
    }

    #[test]
    fn what_folds_over_is_not_found() {
        let barrel = Lens {
            distortion: Some(Distortion::Brown { k: [-0.5, 0.0, 0.0], p: [0.0; 2] }),
            ..Lens::default()
        };
        // r (1 - r^2 / 2) is largest, 0.544, where r^2 is 2/3.
        assert!(barrel.undistorted([0.54, 0.0]).is_some());
        assert_eq!(barrel.undistorted([0.55, 0.0]), None);
        let fisheye = Lens { distortion: Some(Distortion::Fisheye { k: [0.0; 4] }), ..Lens::default() };
        assert!(fisheye.undistorted([89.0_f64.to_radians() - 1e-3, 0.0]).is_some());
        assert_eq!(fisheye.undistorted([1.6, 0.0]), None);
    }
}

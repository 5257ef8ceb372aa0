//! A picture of radiance, and its value between pixels.

use glam::DVec2;
use thiserror::Error;

/// What is wrong with a picture.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum PictureError {
    /// A side is 0.
    #[error("The picture is {width} x {height} pixels. Give one of at least 1 x 1.")]
    Empty {
        /// Pixels to the right.
        width: usize,
        /// Pixels down.
        height: usize,
    },
    /// The array has another length than the sides tell.
    #[error("A picture of {width} x {height} pixels has {pixels} of them. Give width x height, row by row.")]
    Length {
        /// Pixels to the right.
        width: usize,
        /// Pixels down.
        height: usize,
        /// Pixels given.
        pixels: usize,
    },
    /// A pixel is NaN or infinite.
    #[error("Pixel ({x}, {y}) is not a finite number. Mend the picture, as what it would touch is unknown.")]
    NotFinite {
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
}

/// An image of radiance, linear, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels to the right.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// `height x width` pixels, rgb.
    pub texels: Vec<[f32; 3]>,
}

impl Picture {
    /// Whether the array fits its sides and all of it is finite.
    ///
    /// # Errors
    /// What is wrong first.
    pub fn check(&self) -> Result<(), PictureError> {
        check_sides(self.width, self.height, self.texels.len())?;
        match self.texels.iter().position(|rgb| !rgb.iter().all(|x| x.is_finite())) {
            Some(i) => Err(PictureError::NotFinite { x: i % self.width, y: i / self.width }),
            None => Ok(()),
        }
    }

    /// The bicubic value at a point (Catmull-Rom; Keys 1981), which repeats the border's pixels beyond the border.
    ///
    /// It stays within the 16 pixels that it is made of: beside a lamp, cubics alone swing below zero.
    #[must_use]
    pub fn bicubic(&self, point: DVec2) -> [f64; 3] {
        let (x, y) = (point.x - 0.5, point.y - 0.5);
        let (column, row) = (x.floor(), y.floor());
        let (across, down) = (cubic(x - column), cubic(y - row));
        let place =
            |low: f64, i: usize, size: usize| (low + i as f64 - 1.0).clamp(0.0, (size - 1) as f64) as usize;
        let columns: [usize; 4] = std::array::from_fn(|i| place(column, i, self.width));
        let (mut sum, mut least, mut most) = ([0.0; 3], [f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (j, wy) in down.into_iter().enumerate() {
            let start = place(row, j, self.height) * self.width;
            for (i, wx) in across.into_iter().enumerate() {
                let texel = self.texels[start + columns[i]].map(f64::from);
                for c in 0..3 {
                    sum[c] += wx * wy * texel[c];
                    least[c] = texel[c].min(least[c]);
                    most[c] = texel[c].max(most[c]);
                }
            }
        }
        std::array::from_fn(|c| sum[c].clamp(least[c], most[c]))
    }
}

/// Whether an image has pixels, and as many as its sides tell.
pub(crate) fn check_sides(width: usize, height: usize, pixels: usize) -> Result<(), PictureError> {
    if width == 0 || height == 0 {
        return Err(PictureError::Empty { width, height });
    }
    // A product beyond the machine's range is no length of an array either.
    if width.checked_mul(height) != Some(pixels) {
        return Err(PictureError::Length { width, height, pixels });
    }
    Ok(())
}

/// The weights of four neighbours at the share `t` of the way from the second to the third.
fn cubic(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

/// Rec.709 luminance.
#[must_use]
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Picture {
        let texels = (0..64).map(|i| [(i % 8) as f32, (i / 8) as f32, 1.0]).collect();
        Picture { width: 8, height: 8, texels }
    }

    #[test]
    fn bicubic_keeps_planes_and_pixels() {
        let [x, y, one] = ramp().bicubic(DVec2::new(3.7, 4.1));
        // Catmull-Rom gives back polynomials of the second degree; what is left is rounding.
        assert!((x - 3.2).abs() < 1e-12 && (y - 3.6).abs() < 1e-12 && (one - 1.0).abs() < 1e-12);
        assert_eq!(ramp().bicubic(DVec2::new(-100.0, 1e9)), [0.0, 7.0, 1.0]);
    }

    #[test]
    fn a_lamp_does_not_swing_below_zero() {
        let mut picture = Picture { width: 8, height: 8, texels: vec![[0.0; 3]; 64] };
        picture.texels[27] = [1e4; 3];
        for i in 0..800 {
            let value = picture.bicubic(DVec2::new(f64::from(i) * 0.01, 3.1));
            assert!(value.iter().all(|x| (0.0..=1e4).contains(x)));
        }
    }

    #[test]
    fn wrong_pictures_are_refused() {
        let mut picture = ramp();
        picture.texels[9][1] = f32::NAN;
        assert_eq!(picture.check(), Err(PictureError::NotFinite { x: 1, y: 1 }));
        picture.height = 0;
        assert!(matches!(picture.check(), Err(PictureError::Empty { .. })));
        picture.height = usize::MAX;
        assert!(matches!(picture.check(), Err(PictureError::Length { .. })));
    }
}

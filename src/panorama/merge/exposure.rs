//! One exposure: codes of a camera, and how long its shutter was open.

use thiserror::Error;

use crate::picture::{PictureError, check_sides};

/// What is wrong with exposures.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ExposureError {
    /// There are none.
    #[error("There are no exposures. Give at least one.")]
    None,
    /// There are more than counts hold.
    #[error("There are {0} exposures. Give at most 255.")]
    TooMany(usize),
    /// One is no picture.
    #[error("Exposure {exposure}: {error}")]
    Picture {
        /// Which.
        exposure: usize,
        /// What is wrong.
        error: PictureError,
    },
    /// They have different sides.
    #[error(
        "Exposure {exposure} is {width} x {height} pixels, and exposure 0 is {first_width} x {first_height}. Give pictures of one camera."
    )]
    Sides {
        /// Which.
        exposure: usize,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
        /// The first one's columns.
        first_width: usize,
        /// The first one's rows.
        first_height: usize,
    },
    /// The shutter time is not one.
    #[error("Exposure {exposure} has a shutter time of {seconds} s. Give one between 1e-9 and 1e9 seconds.")]
    Seconds {
        /// Which.
        exposure: usize,
        /// What was told.
        seconds: f64,
    },
    /// The highest code is not one.
    #[error(
        "Exposure {exposure} has {most} as its highest code. Give 255 for 8 bits, 65535 for 16, and at least 15."
    )]
    Most {
        /// Which.
        exposure: usize,
        /// What was told.
        most: u16,
    },
    /// A code is above the highest.
    #[error(
        "Exposure {exposure} has a code of {code} at pixel {pixel}, above the highest, {most}. Give the codes' depth."
    )]
    Code {
        /// Which.
        exposure: usize,
        /// Row x width + column.
        pixel: usize,
        /// What stands there.
        code: u16,
        /// What was told to be the highest.
        most: u16,
    },
}

impl ExposureError {
    /// Which exposure is wrong; `None` where it is how many there are.
    #[must_use]
    pub const fn exposure(&self) -> Option<usize> {
        match *self {
            Self::None | Self::TooMany(_) => None,
            Self::Picture { exposure, .. }
            | Self::Sides { exposure, .. }
            | Self::Seconds { exposure, .. }
            | Self::Most { exposure, .. }
            | Self::Code { exposure, .. } => Some(exposure),
        }
    }
}

/// A picture as the camera wrote it.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposure {
    /// Pixels to the right.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// `height x width` codes, rgb, row by row from the top.
    pub codes: Vec<[u16; 3]>,
    /// The highest code that there can be: 255 or 65535.
    pub most: u16,
    /// How long the shutter was open, seconds; with it go what the aperture and the sensitivity differ by: 1/100 s at
    /// ISO 400 is 4/100 s at ISO 100.
    pub seconds: f64,
}

impl Exposure {
    /// Codes from here on are clipped: within a step of 8 bits of the highest.
    #[must_use]
    pub fn clipped_from(&self) -> u16 {
        self.most - (self.most / 255).max(1)
    }

    /// Whether any channel of a pixel is clipped.
    #[must_use]
    pub fn clips(&self, pixel: usize) -> bool {
        let from = self.clipped_from();
        self.codes[pixel].iter().any(|code| *code >= from)
    }

    /// Whether a channel of a pixel is neither clipped nor dark, whatever the others are.
    #[must_use]
    pub fn open(&self, pixel: usize, channel: usize) -> bool {
        (1..self.clipped_from()).contains(&self.codes[pixel][channel])
    }

    /// Whether a channel of a pixel tells its radiance though channels mix: no channel is clipped, and it is not dark.
    #[must_use]
    pub fn sees(&self, pixel: usize, channel: usize) -> bool {
        self.codes[pixel][channel] > 0 && !self.clips(pixel)
    }
}

/// Whether exposures are pictures of one size, with codes within their range and shutter times.
///
/// # Errors
/// What is wrong first.
pub fn check_exposures(exposures: &[Exposure]) -> Result<(), ExposureError> {
    let first = exposures.first().ok_or(ExposureError::None)?;
    if exposures.len() > 255 {
        return Err(ExposureError::TooMany(exposures.len()));
    }
    for (exposure, given) in exposures.iter().enumerate() {
        let &Exposure { width, height, ref codes, most, seconds } = given;
        check_sides(width, height, codes.len())
            .map_err(|error| ExposureError::Picture { exposure, error })?;
        let (first_width, first_height) = (first.width, first.height);
        if (width, height) != (first_width, first_height) {
            return Err(ExposureError::Sides { exposure, width, height, first_width, first_height });
        }
        if !(1e-9..=1e9).contains(&seconds) {
            return Err(ExposureError::Seconds { exposure, seconds });
        }
        // Below 4 bits nothing is left between dark and clipped.
        if most < 15 {
            return Err(ExposureError::Most { exposure, most });
        }
        let above = |rgb: &[u16; 3]| rgb.iter().any(|code| *code > most);
        if let Some(pixel) = codes.iter().position(above) {
            let code = codes[pixel].into_iter().max().unwrap_or(0);
            return Err(ExposureError::Code { exposure, pixel, code, most });
        }
    }
    Ok(())
}

//! The camera's response: how much light a code stands for.
//!
//! - this file: the responses that can be given, and how they are checked and read
//! - [`recover`](recover()): the response recovered from bracketed pictures; `points`: which of their pixels are looked at
//!
//! The exposure X of a code is linear in the light that fell on the pixel while the shutter was open: radiance times
//! seconds, in the unit of the response. sRGB's is 1 at the highest code, so that radiance 1 fills it in a second.

mod points;
mod recover;

use thiserror::Error;

pub use recover::{Recovered, SMOOTHNESS, recover};

use crate::picture::PictureError;

/// What is wrong with a response, or with the pictures that it is to be recovered from.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ResponseError {
    /// The exponent is not one.
    #[error("The response's gamma is {0}. Give a finite number above 0.")]
    Gamma(f64),
    /// The table has no two rows.
    #[error("The response's table has {0} rows. Give at least 2, evenly from code 0 to the highest.")]
    Short(usize),
    /// The table has an exposure that is none.
    #[error(
        "Row {row} of the response's table is {value} in channel {channel}. Give finite exposures of at least 0."
    )]
    Value {
        /// Where.
        row: usize,
        /// 0 for red.
        channel: usize,
        /// What stands there.
        value: f64,
    },
    /// The table falls somewhere.
    #[error(
        "The response's table falls at row {row} in channel {channel}. More light must not have a lower code."
    )]
    Falls {
        /// The row that is below the one before it.
        row: usize,
        /// 0 for red.
        channel: usize,
    },
    /// The table is the same everywhere.
    #[error("Channel {0} of the response's table is one exposure for all codes. Give one that rises.")]
    Flat(usize),
    /// The pictures are not such.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The exposures do not belong together.
    #[error("{0}")]
    Exposures(#[from] crate::merge::ExposureError),
    /// All shutters were open for the same time.
    #[error("All {0} exposures have the same shutter time. A response needs two at least 20 % apart.")]
    EqualTimes(usize),
    /// Too few pixels are neither clipped nor dark in two exposures.
    #[error(
        "Only {found} pixels of channel {channel} are seen by two exposures; a response needs {needed}. Take exposures closer together, or give the response."
    )]
    TooFew {
        /// 0 for red.
        channel: usize,
        /// Pixels of use.
        found: usize,
        /// Pixels needed.
        needed: usize,
    },
    /// The pictures do not determine a response.
    #[error(
        "The exposures do not determine the response of channel {0}. Check that they are brackets of one view, or give the response."
    )]
    Undetermined(usize),
}

/// How a camera turns light into codes.
#[derive(Clone, Debug, PartialEq)]
pub enum Response {
    /// X is the sRGB EOTF of the code (IEC 61966-2-1): what cameras' JPEG files claim.
    Srgb,
    /// X = (code / most) ^ gamma; 1 for linear codes.
    Gamma(f64),
    /// X of codes evenly from 0 to the highest, rgb; between them it is linear. 256 rows are one for each 8-bit code.
    Table(Vec<[f64; 3]>),
}

impl Response {
    /// Whether it is one: finite, nowhere below 0, nowhere falling, and rising somewhere.
    ///
    /// # Errors
    /// What is wrong first.
    pub fn check(&self) -> Result<(), ResponseError> {
        let table = match self {
            Self::Srgb => return Ok(()),
            Self::Gamma(gamma) if gamma.is_finite() && *gamma > 0.0 => return Ok(()),
            Self::Gamma(gamma) => return Err(ResponseError::Gamma(*gamma)),
            Self::Table(table) => table,
        };
        if table.len() < 2 {
            return Err(ResponseError::Short(table.len()));
        }
        for channel in 0..3 {
            for (row, value) in table.iter().map(|rgb| rgb[channel]).enumerate() {
                if !(value.is_finite() && value >= 0.0) {
                    return Err(ResponseError::Value { row, channel, value });
                }
                if row > 0 && value < table[row - 1][channel] {
                    return Err(ResponseError::Falls { row, channel });
                }
            }
            if table[table.len() - 1][channel] <= table[0][channel] {
                return Err(ResponseError::Flat(channel));
            }
        }
        Ok(())
    }

    /// The exposure X of a code, which is a share of the highest in [0, 1], rgb.
    #[must_use]
    pub fn exposure(&self, share: f64) -> [f64; 3] {
        // Of NaN and 0, max takes 0.
        let share = share.max(0.0);
        let share = share.min(1.0);
        match self {
            Self::Srgb => [srgb(share); 3],
            Self::Gamma(gamma) => [share.powf(*gamma); 3],
            Self::Table(table) => {
                let Some(last) = table.len().checked_sub(1) else { return [0.0; 3] };
                let at = share * last as f64;
                let low = (at as usize).min(last.saturating_sub(1));
                let (a, b, t) = (table[low], table[(low + 1).min(last)], at - low as f64);
                std::array::from_fn(|c| a[c] + t * (b[c] - a[c]))
            }
        }
    }
}

/// The sRGB EOTF (IEC 61966-2-1).
pub(crate) fn srgb(code: f64) -> f64 {
    if code <= 0.040_45 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// A response of each code there is.
pub(crate) struct Curve {
    /// X, rgb.
    pub(crate) exposures: Vec<[f64; 3]>,
    /// Its derivative by the code, rgb.
    pub(crate) slopes: Vec<[f64; 3]>,
}

impl Curve {
    /// Of a response that was checked; `most` is the highest code, above 0.
    pub(crate) fn new(response: &Response, most: u16) -> Self {
        let last = usize::from(most);
        let exposures: Vec<[f64; 3]> =
            (0..=last).map(|code| response.exposure(code as f64 / last as f64)).collect();
        let slopes = (0..=last)
            .map(|code| {
                let (low, high) = (code.saturating_sub(1), (code + 1).min(last));
                std::array::from_fn(|c| (exposures[high][c] - exposures[low][c]) / (high - low) as f64)
            })
            .collect();
        Self { exposures, slopes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn given_responses() {
        // The standard's own pair of values: 0.5 of the code is 0.21404 of the light.
        assert!((Response::Srgb.exposure(0.5)[1] - 0.214_041_14).abs() < 1e-8);
        assert_eq!(Response::Srgb.exposure(1.0), [1.0; 3]);
        assert_eq!(Response::Gamma(2.0).exposure(0.5), [0.25; 3]);
        let table = Response::Table(vec![[0.0; 3], [0.5, 0.25, 0.1], [1.0, 1.0, 0.3]]);
        assert_eq!(table.check(), Ok(()));
        let [r, g, b] = table.exposure(0.75);
        assert!((r - 0.75).abs() < 1e-15 && (g - 0.625).abs() < 1e-15 && (b - 0.2).abs() < 1e-15);
    }

    #[test]
    fn wrong_responses_are_refused() {
        let table =
            |rows: &[f64]| Response::Table(rows.iter().map(|x| [*x; 3]).collect()).check().unwrap_err();
        assert!(matches!(Response::Gamma(f64::NAN).check(), Err(ResponseError::Gamma(_))));
        assert_eq!(table(&[1.0]), ResponseError::Short(1));
        assert_eq!(table(&[0.0, 1.0, 0.9]), ResponseError::Falls { row: 2, channel: 0 });
        assert_eq!(table(&[1.0, 1.0]), ResponseError::Flat(0));
        assert!(matches!(table(&[0.0, f64::INFINITY]), ResponseError::Value { row: 1, .. }));
        // What was not checked gives no panic either.
        assert_eq!(Response::Table(Vec::new()).exposure(f64::NAN), [0.0; 3]);
        assert_eq!(Response::Table(vec![[2.0; 3]]).exposure(1.0), [2.0; 3]);
    }
}

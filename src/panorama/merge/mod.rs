//! Exposures of one view merged to radiance.
//!
//! - this file: what goes in and comes out, and the merge as a whole
//! - [`exposure`]: one exposure, and whether several belong together
//! - `pixel`: the radiance of one pixel, under each weighting
//! - `pairs`: what two exposures show of the same light
//! - `clipping`: whether a clipped channel spoils the others of its pixel
//! - [`align`]: how far exposures are shifted against each other
//! - [`times`]: whether the shutter times fit the pictures

pub mod align;
mod clipping;
pub mod exposure;
mod pairs;
mod pixel;
pub mod times;

use rayon::prelude::*;
use thiserror::Error;

use self::align::Shift;
use self::pixel::{Merger, Place, Seen};
use self::times::ShutterTime;
use crate::picture::Picture;
use crate::response::{Curve, Response, ResponseError};

pub use self::exposure::{Exposure, ExposureError, check_exposures};

/// What a merge refuses.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MergeError {
    /// An exposure, or how they go together.
    #[error(transparent)]
    Exposures(#[from] ExposureError),
    /// The response.
    #[error(transparent)]
    Response(#[from] ResponseError),
    /// The noise model.
    #[error(
        "The sensor holds {full_well} electrons and is read with a noise of {read_noise}. Give a full well above 0 and a noise of at least 0."
    )]
    Noise {
        /// Electrons at the highest code.
        full_well: f64,
        /// Electrons.
        read_noise: f64,
    },
}

/// How much each exposure counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weighting {
    /// By the inverse of its variance: Poisson noise of the electrons, the readout's, and the rounding of the codes
    /// through the response's derivative (Granados et al. 2010; Hasinoff et al. 2010). The variance is that of the
    /// pooled estimate, found in three rounds: one by each exposure's own code would favour those that came out dark.
    Noise {
        /// Electrons at the highest code.
        full_well: f64,
        /// Electrons, standard deviation.
        read_noise: f64,
    },
    /// By a hat over the codes, means taken of ln radiance (Debevec and Malik 1997, equation 6).
    Hat,
}

impl Default for Weighting {
    fn default() -> Self {
        Self::Noise { full_well: 20_000.0, read_noise: 4.0 }
    }
}

/// How to merge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MergeOptions {
    /// How much each exposure counts.
    pub weighting: Weighting,
    /// Whether shifts that were found are taken back, by whole pixels. The picture is then framed as the exposure of
    /// the middle shutter time.
    pub align: bool,
}

/// Pixels of which something is not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Clipped in every exposure: the shortest one's value stands, as the least that it can be. Take a shorter one.
    pub clipped_everywhere: usize,
    /// With a channel that is 0 in every exposure: the longest one's value stands. Take a longer one.
    pub dark_everywhere: usize,
    /// With a channel that is 0 in the shorter exposures and clipped in the longer ones: the least that it can be
    /// stands. Take one between.
    pub between_exposures: usize,
    /// Of which two or more exposures see all channels.
    pub seen_by_two: usize,
}

/// What is doubtful about exposures; the merge went on.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Doubt {
    /// Two exposures are shifted by more than a pixel, and were not aligned.
    #[error("Exposure {} is shifted by ({}, {}) pixels against exposure {}. Align them, or take them from a tripod.", .0.to, .0.x, .0.y, .0.from)]
    Shifted(Shift),
    /// Two exposures' shift is at the end of what is searched.
    #[error("Exposure {} is shifted by ({}, {}) pixels or more against exposure {}. Take them from a tripod.", .0.to, .0.x, .0.y, .0.from)]
    ShiftedFar(Shift),
    /// A shutter time does not fit the pictures.
    #[error(
        "Exposure {exposure} has been open for {measured:.6} s by its pictures, not {told:.6} s. Correct its shutter time, or the response."
    )]
    ShutterTime {
        /// Which.
        exposure: usize,
        /// Seconds, as told.
        told: f64,
        /// Seconds, as the other exposures have it.
        measured: f64,
    },
}

/// What exposures merge to.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// Radiance, linear, in the unit of the response per second: under [`Response::Srgb`], 1 fills a pixel in a second.
    /// Its primaries are the codes'.
    pub picture: Picture,
    /// How many exposures see each pixel, in the channel that the fewest see; 0, too, where in each of them some channel
    /// clips.
    pub seen: Vec<u8>,
    /// Whether pixels with a clipped channel were left out as a whole.
    pub clipping_spoils: bool,
    /// How many pixels are not known.
    pub counts: Counts,
    /// The shifts between exposures next in shutter time.
    pub shifts: Vec<Shift>,
    /// The shutter times as told and as measured, in the order of the exposures.
    pub times: Vec<ShutterTime>,
    /// What the caller should be told.
    pub doubts: Vec<Doubt>,
}

/// A shutter time that is off by more than this share is doubted.
const TIME_DOUBT: f64 = 0.05;

/// Merges exposures of one view, in any order, to radiance.
///
/// A channel within a step of the highest code is clipped and left out, and with it the others of its pixel: demosaicing
/// and JPEG mix them. Only where the exposures show that theirs are not mixed do the others count. A channel of code 0
/// is dark, and left out by itself.
///
/// # Errors
/// Exposures that do not belong together, and a response or a noise model that is none.
pub fn merge(
    exposures: &[Exposure],
    response: &Response,
    options: MergeOptions,
) -> Result<Merged, MergeError> {
    check_exposures(exposures)?;
    response.check()?;
    if let Weighting::Noise { full_well, read_noise } = options.weighting
        && !(full_well > 0.0 && full_well.is_finite() && read_noise >= 0.0 && read_noise.is_finite())
    {
        return Err(MergeError::Noise { full_well, read_noise });
    }
    let shifts = align::shifts(exposures);
    let offsets =
        if options.align { align::offsets(exposures, &shifts) } else { vec![(0, 0); exposures.len()] };
    let curves = curves(exposures, response);
    let places: Vec<Place<'_>> = (0..exposures.len())
        .map(|i| Place { exposure: &exposures[i], curve: &curves[i].1, offset: offsets[i] })
        .collect();
    let times = times::measure(&places);
    let merger = Merger::new(places, options.weighting);
    let (width, height) = (exposures[0].width, exposures[0].height);
    let rows: Vec<(Row, Counts)> =
        (0..height).into_par_iter().map(|y| merge_row(&merger, width, y)).collect();
    let mut counts = Counts::default();
    let (mut texels, mut seen) = (Vec::with_capacity(width * height), Vec::with_capacity(width * height));
    for (row, of_row) in rows {
        counts.add(of_row);
        for (texel, by) in row {
            texels.push(texel);
            seen.push(by);
        }
    }
    let (picture, clipping_spoils) = (Picture { width, height, texels }, merger.spoils);
    let doubts = doubts(&shifts, &times, options.align);
    Ok(Merged { picture, seen, clipping_spoils, counts, shifts, times, doubts })
}

/// The response of each exposure's codes: those of one depth share it.
fn curves(exposures: &[Exposure], response: &Response) -> Vec<(u16, std::sync::Arc<Curve>)> {
    let mut curves: Vec<(u16, std::sync::Arc<Curve>)> = Vec::new();
    for exposure in exposures {
        let known = curves.iter().find(|(most, _)| *most == exposure.most).map(|(_, curve)| curve.clone());
        let curve = known.unwrap_or_else(|| Curve::new(response, exposure.most).into());
        curves.push((exposure.most, curve));
    }
    curves
}

/// A row's radiance, and how many exposures see each pixel.
type Row = Vec<([f32; 3], u8)>;

fn merge_row(merger: &Merger<'_>, width: usize, y: usize) -> (Row, Counts) {
    let mut counts = Counts::default();
    let pixels = (0..width).map(|x| {
        let pixel = merger.pixel(x, y);
        match pixel.seen {
            Seen::Clipped => counts.clipped_everywhere += 1,
            Seen::Dark => counts.dark_everywhere += 1,
            Seen::Between => counts.between_exposures += 1,
            Seen::By(count) if count >= 2 => counts.seen_by_two += 1,
            Seen::By(_) => {}
        }
        let by = if let Seen::By(count) = pixel.seen { count } else { 0 };
        (pixel.radiance.map(|x| x.min(f64::from(f32::MAX)) as f32), by)
    });
    (pixels.collect(), counts)
}

impl Counts {
    fn add(&mut self, other: Self) {
        self.clipped_everywhere += other.clipped_everywhere;
        self.dark_everywhere += other.dark_everywhere;
        self.between_exposures += other.between_exposures;
        self.seen_by_two += other.seen_by_two;
    }
}

fn doubts(shifts: &[Shift], times: &[ShutterTime], aligned: bool) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    for shift in shifts {
        if shift.at_the_end {
            doubts.push(Doubt::ShiftedFar(*shift));
        } else if shift.x.abs().max(shift.y.abs()) > 1 && !aligned {
            doubts.push(Doubt::Shifted(*shift));
        }
    }
    for (exposure, time) in times.iter().enumerate() {
        if let Some(measured) =
            time.measured.filter(|measured| (measured / time.told).ln().abs() > TIME_DOUBT)
        {
            doubts.push(Doubt::ShutterTime { exposure, told: time.told, measured });
        }
    }
    doubts
}

//! Shots of several directions stitched to one lat-long panorama.
//!
//! - this file: what goes in and comes out, and the stitch as a whole
//! - `view`: a shot, turned; `pyramid`: its ln luminance, coarse to fine
//! - `refine`: orientations from the overlap; `gains`: exposures from the overlap
//! - `blend`: the panorama's texels; `fill`: light where no shot sees
//!
//! The shots are of one place: what is near shifts between cameras apart (parallax), and nothing here takes that out.

mod blend;
mod fill;
mod gains;
mod pyramid;
mod refine;
mod view;

use glam::DQuat;
use thiserror::Error;

use self::view::View;
use crate::lens::{Lens, LensError};
use crate::picture::{Picture, PictureError};

/// What a stitch refuses.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StitchError {
    /// There are no shots.
    #[error("There are no shots. Give at least one.")]
    None,
    /// There are more than counts hold.
    #[error("There are {0} shots. Give at most 255.")]
    TooMany(usize),
    /// A shot's picture.
    #[error("Shot {shot}: {error}")]
    Picture {
        /// Which.
        shot: usize,
        /// What is wrong.
        error: PictureError,
    },
    /// A shot's lens.
    #[error("Shot {shot}: {error}")]
    Lens {
        /// Which.
        shot: usize,
        /// What is wrong.
        error: LensError,
    },
    /// A shot's orientation.
    #[error("Shot {0} has an orientation that is no rotation. Give a finite quaternion other than 0.")]
    Orientation(usize),
    /// A shot's gain.
    #[error("Shot {shot} has a gain of {gain}. Give one between 1e-12 and 1e12; 1 where none is known.")]
    Gain {
        /// Which.
        shot: usize,
        /// What was told.
        gain: f64,
    },
    /// The panorama's width.
    #[error("The panorama is to be {0} texels wide. Give an even width from 2 to 32768.")]
    Width(usize),
    /// The feather.
    #[error("Shots are to fade over {0} degrees. Give an angle above 0 and at most 180.")]
    Feather(f64),
    /// No shot shows anything.
    #[error("No shot shows anything of the panorama. Check the lenses' circles against the pictures.")]
    NothingSeen,
}

/// A picture of radiance, and where its camera looked.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Radiance, linear, as [`merge`](crate::merge::merge()) gives it.
    pub picture: Picture,
    /// How the picture maps to directions.
    pub lens: Lens,
    /// From the camera (looking along -Z, +Y up) to the world (+Y up; the panorama's centre is -Z). Right to about 5
    /// degrees, where it is to be refined.
    pub orientation: DQuat,
    /// What the picture is multiplied by, where it is known; else 1.
    pub gain: f64,
}

/// How to stitch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchOptions {
    /// The panorama's width, texels, even; its height is half of that.
    pub width: usize,
    /// Over how many degrees inside its border a shot fades in.
    pub feather_degrees: f64,
    /// Whether orientations are refined, the first shot's standing as told.
    pub refine: bool,
    /// Whether gains are found, the first shot's standing as told.
    pub gains: bool,
    /// Whether texels that no shot sees are filled from around them; else they are 0.
    pub fill: bool,
}

impl Default for StitchOptions {
    fn default() -> Self {
        Self { width: 2048, feather_degrees: 20.0, refine: true, gains: true, fill: true }
    }
}

/// What is doubtful about shots; the stitch went on.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StitchDoubt {
    /// A shot overlaps with the first neither directly nor through others.
    #[error(
        "Shot {0} overlaps with none that hangs together with shot 0, so its orientation and gain stand as told. Take shots that overlap."
    )]
    Unlinked(usize),
    /// A shot shows something else than those that it overlaps with.
    #[error(
        "Shot {shot} is like what it overlaps with by a correlation of {correlation:.2} only. Check its orientation and its lens, or stitch without refining."
    )]
    Unlike {
        /// Which.
        shot: usize,
        /// From -1 to 1.
        correlation: f64,
    },
    /// A shot was turned far.
    #[error(
        "Shot {shot} was turned by {degrees:.1} degrees. Check its orientation, which is to be right to about 5."
    )]
    TurnedFar {
        /// Which.
        shot: usize,
        /// How far.
        degrees: f64,
    },
    /// A shot's gain is far from the one told.
    #[error(
        "Shot {shot} differs from the others by a factor of {factor:.2}, where its gain tells of none. Check its exposures' times."
    )]
    GainFar {
        /// Which.
        shot: usize,
        /// The gain that was found over the one told, or its inverse: above 1.
        factor: f64,
    },
}

/// Shots that are less alike than this are doubted: a bright sky over dark ground alone is worth more than a half.
const LEAST_CORRELATION: f64 = 0.8;
/// Shots that are turned farther than this are doubted, degrees.
const FAR: f64 = 8.0;
/// Gains that change by more than this factor are doubted.
const GAIN_FAR: f64 = 4.0;

/// A panorama, and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Stitched {
    /// Lat-long radiance, linear, in the first shot's unit: [`latlong`](crate::latlong) has its directions.
    pub panorama: Picture,
    /// How many shots each texel is made of; 0 where none sees it.
    pub seen: Vec<u8>,
    /// The share of the sphere, by solid angle, that no shot sees.
    pub unseen: f64,
    /// The orientations that were used, from camera to world.
    pub orientations: Vec<DQuat>,
    /// How far each is from the one told, degrees.
    pub turned_degrees: Vec<f64>,
    /// The gains that were used.
    pub gains: Vec<f64>,
    /// How far overlapping shots differ after the refinement, in ln radiance (the deviation, by the median of
    /// distances); `None` without a refinement or an overlap.
    pub residual: Option<f64>,
    /// How what each shot shows is correlated with what those that it overlaps with show, from -1 to 1, robustly, in ln
    /// radiance; `None` without a refinement or an overlap.
    pub correlations: Vec<Option<f64>>,
    /// What the caller should be told.
    pub doubts: Vec<StitchDoubt>,
}

/// Stitches shots to a lat-long panorama.
///
/// Each texel blends the shots that see it, their weights falling smoothly to 0 at the borders of their lenses and
/// pictures; a shot finer than the panorama is averaged over the texel, one coarser is bicubic.
///
/// # Errors
/// A shot or an option that is none, and shots that show nothing.
pub fn stitch(shots: &[Shot], options: &StitchOptions) -> Result<Stitched, StitchError> {
    check(shots, options)?;
    let told: Vec<DQuat> = shots.iter().map(|shot| shot.orientation.normalize()).collect();
    let told_gains: Vec<f64> = shots.iter().map(|shot| shot.gain).collect();
    let views = |orientations: &[DQuat]| -> Vec<View<'_>> {
        shots.iter().zip(orientations).map(|(shot, orientation)| View::new(shot, *orientation)).collect()
    };
    let texel = std::f64::consts::TAU / options.width as f64;
    let (mut orientations, mut residual, mut correlations) = (told.clone(), None, vec![None; shots.len()]);
    if options.refine && shots.len() > 1 {
        let refined = refine::refine(shots, &told, &told_gains, texel);
        (orientations, residual, correlations) =
            (refined.orientations, refined.residual, refined.correlations);
    }
    let found = gains::solve(&views(&orientations), &told_gains);
    let linked = gains::linked(shots.len(), &found.pairs);
    let gains = if options.gains { found.gains } else { told_gains };
    let blended =
        blend::blend(&views(&orientations), &gains, options.width, options.feather_degrees.to_radians());
    if blended.seen.iter().all(|by| *by == 0) {
        return Err(StitchError::NothingSeen);
    }
    let mut panorama = Picture { width: options.width, height: options.width / 2, texels: blended.texels };
    let unseen = fill::unseen(&blended.seen, options.width);
    if options.fill && unseen > 0.0 {
        fill::fill(&mut panorama, &blended.seen);
    }
    let turned = |(now, told): (&DQuat, &DQuat)| refine::short(*now * told.conjugate()).length().to_degrees();
    let turned_degrees: Vec<f64> = orientations.iter().zip(&told).map(turned).collect();
    let mut doubts = Vec::new();
    for shot in 0..shots.len() {
        if !linked[shot] {
            doubts.push(StitchDoubt::Unlinked(shot));
        }
        if let Some(correlation) = correlations[shot].filter(|correlation| *correlation < LEAST_CORRELATION) {
            doubts.push(StitchDoubt::Unlike { shot, correlation });
        }
        if turned_degrees[shot] > FAR {
            doubts.push(StitchDoubt::TurnedFar { shot, degrees: turned_degrees[shot] });
        }
        let factor = (gains[shot] / shots[shot].gain).ln().abs().exp();
        if factor > GAIN_FAR {
            doubts.push(StitchDoubt::GainFar { shot, factor });
        }
    }
    Ok(Stitched {
        panorama,
        seen: blended.seen,
        unseen,
        turned_degrees,
        orientations,
        gains,
        residual,
        correlations,
        doubts,
    })
}

fn check(shots: &[Shot], options: &StitchOptions) -> Result<(), StitchError> {
    if shots.is_empty() {
        return Err(StitchError::None);
    }
    if shots.len() > 255 {
        return Err(StitchError::TooMany(shots.len()));
    }
    if !(2..=32_768).contains(&options.width) || !options.width.is_multiple_of(2) {
        return Err(StitchError::Width(options.width));
    }
    if !(options.feather_degrees > 0.0 && options.feather_degrees <= 180.0) {
        return Err(StitchError::Feather(options.feather_degrees));
    }
    for (shot, given) in shots.iter().enumerate() {
        given.picture.check().map_err(|error| StitchError::Picture { shot, error })?;
        given.lens.check().map_err(|error| StitchError::Lens { shot, error })?;
        let length = given.orientation.length();
        if !(length.is_finite() && length > 1e-6) {
            return Err(StitchError::Orientation(shot));
        }
        if !(1e-12..=1e12).contains(&given.gain) {
            return Err(StitchError::Gain { shot, gain: given.gain });
        }
    }
    Ok(())
}

/// How many directions over the sphere lie about `angle` radians apart, within reason: each may bring a residual of
/// every two of `shots`, and three million of those take 150 MB.
fn directions_of(angle: f64, shots: usize) -> usize {
    let most = (3_000_000 / (shots * (shots - 1) / 2).max(1)).clamp(2_000, 200_000);
    ((4.0 * std::f64::consts::PI / (angle * angle)) as usize).max(20_000).min(most)
}

//! Codes of other colour spaces than sRGB: a curve a channel, then a matrix to Rec.709.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::chromaticities::Chromaticities;
use super::srgb_decode;

/// From a share of the highest code to a share of the channel's light.
pub(super) type Curve = Box<dyn Fn(f64) -> f64 + Send + Sync>;

/// How codes become linear light of Rec.709, where sRGB's way is another.
pub(super) struct Space {
    curves: [Curve; 3],
    /// None where shares of Rec.709's primaries come out of the curves.
    to_rec709: Option<DMat3>,
    /// The most light that a curve gives.
    most: f64,
}

/// Why a claim is not followed.
#[derive(Debug, PartialEq)]
pub(super) enum Unheeded {
    /// The colours are near sRGB's, or nothing better is known: what the file has, for a warning.
    Told(String),
    /// Read as sRGB they would be of another scene: what the file has, for a refusal.
    Lost(String),
}

/// Half a code of eight bits. A curve that is nearer to sRGB's was made for it: tables of a thousand points and parameters
/// in 16 bits are off by a hundredth of a code, the shortest tables of small profiles by a few tenths, and the power of 2.2
/// that is often taken for sRGB by several codes.
const HALF_CODE: f64 = 0.5 / 255.0;
/// As chromaticities are compared: the colorants of sRGB profiles differ by a few ten-thousandths among one another.
const SAME_MATRIX: f64 = 1e-3;
/// What writers of sRGB give as `gAMA` (PNG, section 11.3.2.5), to half its last digit but one.
const GAMMA_OF_SRGB: [f64; 2] = [0.454_50, 0.454_60];

impl Space {
    /// `None` where codes mean what sRGB's mean.
    ///
    /// # Errors
    /// Where no light comes out of them.
    pub(super) fn new(curves: [Curve; 3], colours: Option<Chromaticities>) -> Result<Option<Self>, Unheeded> {
        let none = |what: &str| Unheeded::Told(format!("has a colour profile with {what}"));
        let matrix = colours.map(Chromaticities::to_rec709).transpose().map_err(none)?.flatten();
        let to_rec709 = matrix.filter(|matrix| !is_identity(matrix));
        if curves.iter().any(|curve| !is_light(curve)) {
            return Err(none("a tone curve that is none"));
        }
        if to_rec709.is_none() && curves.iter().all(is_srgb) {
            return Ok(None);
        }
        Ok(Some(Self { curves, to_rec709, most: 1.0 }))
    }

    /// Of PNG's `gAMA` and `cHRM`, one of which may be absent.
    pub(super) fn of_gamma(
        gamma: Option<f64>,
        colours: Option<Chromaticities>,
    ) -> Result<Option<Self>, Unheeded> {
        let [least, most] = GAMMA_OF_SRGB;
        let srgb = gamma.is_none_or(|gamma| (least..=most).contains(&gamma));
        let rec709 = colours.is_none_or(|colours| colours.to_rec709() == Ok(None));
        if srgb && rec709 {
            return Ok(None);
        }
        let curve = || -> Curve {
            match gamma {
                Some(gamma) => Box::new(move |code: f64| code.powf(1.0 / gamma)),
                None => Box::new(srgb_decode),
            }
        };
        if gamma.is_some_and(|gamma| gamma <= 0.0) {
            return Err(Unheeded::Told("has a `gAMA` of 0".to_owned()));
        }
        Self::new([curve(), curve(), curve()], colours)
    }

    /// These curves, of light in any unit, and what else is known of the colours.
    pub(super) fn with_curves(known: Option<Self>, curves: [Curve; 3]) -> Self {
        Self { curves, to_rec709: known.and_then(|space| space.to_rec709), most: f64::MAX }
    }

    /// How channels are mixed.
    pub(super) const fn to_rec709(&self) -> Option<DMat3> {
        self.to_rec709
    }

    /// Whether channels are mixed: of a mixture no channel tells whether its codes were clipped.
    pub(super) const fn mixes(&self) -> bool {
        self.to_rec709.is_some()
    }

    /// The light of each channel at this share of the highest code.
    pub(super) fn light(&self, code: f64) -> [f64; 3] {
        [0, 1, 2].map(|channel| self.curves[channel](code).clamp(0.0, self.most))
    }

    /// Codes in [0, 1], of which `most` is the highest, to linear Rec.709.
    pub(super) fn linearize(&self, rgb: &mut [[f32; 3]], most: u16) {
        let highest = f64::from(most);
        let table: Vec<[f64; 3]> =
            (0..=u32::from(most)).map(|code| self.light(f64::from(code) / highest)).collect();
        let light =
            |value: f32, channel: usize| table[(f64::from(value) * highest).round() as usize][channel];
        rgb.par_iter_mut().for_each(|rgb| {
            let shares = DVec3::from([0, 1, 2].map(|channel| light(rgb[channel], channel)));
            let mixed = self.to_rec709.map_or(shares, |matrix| matrix * shares);
            *rgb = mixed.as_vec3().to_array();
        });
    }
}

fn is_identity(matrix: &DMat3) -> bool {
    matrix.abs_diff_eq(DMat3::IDENTITY, SAME_MATRIX)
}

/// Whether a curve has a number at every code of eight bits, and goes up.
fn is_light(curve: &Curve) -> bool {
    (0..=255_u32).all(|code| curve(f64::from(code) / 255.0).is_finite()) && curve(1.0) > curve(0.0)
}

/// Whether a curve is sRGB's at all codes of eight bits, to half a code.
fn is_srgb(curve: &Curve) -> bool {
    (0..=255_u32).all(|code| {
        let code = f64::from(code) / 255.0;
        (srgb_decode(code - HALF_CODE)..=srgb_decode(code + HALF_CODE)).contains(&curve(code))
    })
}

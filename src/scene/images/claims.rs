//! What a PNG or JPEG file says of its colours, and which of that is followed.
//!
//! The order is that of the PNG specification, third edition (section 4.3, and 13.14 of decoders): `cICP`, `iCCP`, `sRGB`,
//! then `gAMA` with `cHRM`. A claim that cannot be followed is told, and the next one counts. Without any, codes are sRGB's.

use std::io::Cursor;
use std::path::Path;

use glam::DVec2;

use super::chromaticities::Chromaticities;
use super::space::{Space, Unheeded};
use super::{code_points, icc};
use crate::error::{SceneError, Warnings, guarded, warn};

/// The claims of a file, as they stand there.
#[derive(Default)]
pub(super) struct Claims {
    /// Primaries, transfer, matrix and range by ITU-T H.273.
    cicp: Option<[u8; 4]>,
    /// An ICC profile.
    profile: Option<Vec<u8>>,
    srgb: bool,
    /// The exponent that made codes of light.
    gamma: Option<f64>,
    chromaticities: Option<Chromaticities>,
    /// Chunks of colours that are there and cannot be read.
    damaged: Vec<&'static str>,
    /// Whether the image has no colours.
    grey: bool,
}

impl Claims {
    /// Those of a PNG file.
    pub(super) fn of_png(bytes: &[u8], grey: bool) -> Self {
        // A profile is some thousand bytes; one that unpacks to more than this is not looked at.
        let limits = png::Limits { bytes: 1 << 26 };
        let Ok(reader) = png::Decoder::new_with_limits(Cursor::new(bytes), limits).read_info() else {
            return Self { grey, ..Self::default() };
        };
        let info = reader.info();
        let cicp = info.coding_independent_code_points.map(|points| {
            let range = u8::from(points.is_video_full_range_image);
            [points.color_primaries, points.transfer_function, points.matrix_coefficients, range]
        });
        let profile = info.icc_profile.as_ref().map(|profile| profile.to_vec());
        let there = chunk_names(bytes);
        let lost = [("cICP", cicp.is_none()), ("iCCP", profile.is_none())];
        let lost = lost.into_iter().filter(|(name, lost)| *lost && there.contains(&name.as_bytes()));
        Self {
            cicp,
            srgb: info.srgb.is_some(),
            gamma: info.gama_chunk.map(share),
            chromaticities: info.chrm_chunk.map(xy),
            damaged: lost.map(|(name, _)| name).collect(),
            profile,
            grey,
        }
    }

    /// Those of a JPEG file, of which the decoder has found this profile.
    pub(super) fn of_jpeg(bytes: &[u8], profile: Option<Vec<u8>>, grey: bool) -> Self {
        // Segments that name themselves so (ICC.1:2022, annex B.4), of which the decoder made nothing.
        let named = || bytes.windows(12).any(|window| window == b"ICC_PROFILE\0");
        let lost = profile.is_none() && named();
        let damaged = if lost { vec!["APP2"] } else { Vec::new() };
        Self { profile, damaged, grey, ..Self::default() }
    }

    /// How the codes of the file at `path` are to be read; `None` as sRGB's.
    ///
    /// # Errors
    /// When they are of light without a white, of which sRGB would make something else altogether.
    pub(super) fn followed(&self, path: &Path, warnings: &mut Warnings) -> Result<Option<Space>, SceneError> {
        for name in &self.damaged {
            let message = format!("its colour profile ({name}) is damaged: its colours are read without it");
            warn(warnings, path, message);
        }
        let claims = [Self::by_code_points, Self::by_profile, Self::by_srgb, Self::by_gamma];
        for claim in claims.iter().filter_map(|claim| claim(self, path)) {
            match claim {
                Ok(space) => return Ok(space),
                Err(Unheeded::Told(what)) => {
                    let message = format!("{what}, which is not followed: its colours are read without it");
                    warn(warnings, path, message);
                }
                Err(Unheeded::Lost(what)) => {
                    let remedy = "Save the picture as linear OpenEXR, or convert it to sRGB";
                    return Err(SceneError::new(path, what, remedy));
                }
            }
        }
        Ok(None)
    }

    fn by_code_points(&self, _: &Path) -> Option<Result<Option<Space>, Unheeded>> {
        self.cicp.map(code_points::space)
    }

    fn by_profile(&self, path: &Path) -> Option<Result<Option<Space>, Unheeded>> {
        let profile = self.profile.as_deref()?;
        // A profile that the parser gives up on leaves an image that can be read.
        let given_up = |_| Err(Unheeded::Told("has a colour profile that is damaged".to_owned()));
        Some(guarded(path, || Ok(icc::space(profile, self.grey))).unwrap_or_else(given_up))
    }

    fn by_srgb(&self, _: &Path) -> Option<Result<Option<Space>, Unheeded>> {
        self.srgb.then_some(Ok(None))
    }

    fn by_gamma(&self, _: &Path) -> Option<Result<Option<Space>, Unheeded>> {
        if self.gamma.is_none() && self.chromaticities.is_none() {
            return None;
        }
        Some(Space::of_gamma(self.gamma, self.chromaticities))
    }
}

/// Names of a PNG file's chunks before its pixels.
fn chunk_names(bytes: &[u8]) -> Vec<&[u8]> {
    const SIGNATURE: usize = 8;
    let mut rest = bytes.get(SIGNATURE..).unwrap_or_default();
    let mut names = Vec::new();
    // A length, a name, the content and its check.
    while let Some((&[a, b, c, d], behind)) = rest.split_first_chunk::<4>() {
        let Some(name) = behind.get(..4).filter(|name| *name != b"IDAT") else { break };
        names.push(name);
        let whole = (u32::from_be_bytes([a, b, c, d]) as usize).saturating_add(8);
        rest = behind.get(whole..).unwrap_or_default();
    }
    names
}

/// PNG's fixed point numbers have five digits.
fn share(number: png::ScaledFloat) -> f64 {
    f64::from(number.into_scaled()) / 1e5
}

fn xy(given: png::SourceChromaticities) -> Chromaticities {
    let point = |(x, y): (png::ScaledFloat, png::ScaledFloat)| DVec2::new(share(x), share(y));
    Chromaticities {
        primaries: [point(given.red), point(given.green), point(given.blue)],
        white: point(given.white),
    }
}

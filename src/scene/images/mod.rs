//! Image files as linear numbers: OpenEXR, Radiance HDR, PNG and JPEG.
//!
//! - `open_exr`, `raster`: the decoders; `sampled`, `chroma` and `dwa` are parts of the former
//! - `chromaticities`: other primaries than Rec.709's
//! - `claims`: what PNG and JPEG files say of their colours; `code_points` and `icc` read it, `space` is what comes of it
//! - `codes`: a photograph's own, whatever light they stand for
//! - `response`: a camera's own curve, where a view has one
//! - `target`: images to be matched, and their masks
//!
//! Files are told apart by their content. Colours in 8 or 16 bits are sRGB's where the file says nothing else; data maps are
//! taken as they are; EXR and HDR are linear. Sizes are checked before anything is allocated.

mod chroma;
mod chromaticities;
mod claims;
mod code_points;
mod codes;
mod dwa;
mod icc;
#[cfg(test)]
mod luminance;
mod open_exr;
#[cfg(test)]
mod profiled;
mod raster;
mod response;
mod sampled;
mod space;
mod target;

use std::path::Path;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use self::chromaticities::Chromaticities;
use self::claims::Claims;
use self::space::Space;
pub use codes::{Codes, codes};
pub(super) use response::Response;
pub(super) use target::{Seen, haze, target};

use super::error::{SceneError, Warning, Warnings, guarded, read_bytes, warn};
use super::maps::Map;

/// No image above this many texels is read.
const MOST_TEXELS: u64 = 1 << 28;
/// No image file above this many bytes is read.
const MOST_BYTES: u64 = 1 << 32;

/// An image as decoded.
struct Image {
    width: usize,
    height: usize,
    /// Linear, or codes in [0, 1] when `code` says so.
    rgb: Vec<[f32; 3]>,
    alpha: Option<Vec<f32>>,
    /// The greatest code of an 8- or 16-bit file; `None` for floating point.
    code: Option<u16>,
    /// What its colours are shares of, where the file says; else of Rec.709's primaries.
    chromaticities: Option<Chromaticities>,
    /// What the file says of its codes.
    claims: Claims,
    /// How its codes are read where they are colours, and not sRGB's.
    space: Option<Space>,
}

/// What a reader needs to know of the file that it decodes.
#[derive(Clone, Copy)]
struct Opened<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// The only size that will do.
    size: Option<(u32, u32)>,
}

impl Opened<'_> {
    fn error(&self, what: impl Into<String>, remedy: &str) -> SceneError {
        SceneError::new(self.path, what, remedy)
    }

    /// A decoder's own complaint.
    fn damaged(&self, kind: &str, reason: impl std::fmt::Display) -> SceneError {
        let reason = reason.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        let reason = reason.trim_end_matches('.');
        self.error(
            format!("cannot be read as {kind}: {reason}"),
            "The file is cut short, damaged or of a rare kind: write it anew from its source",
        )
    }

    /// Refuse a size before anything is allocated: not the expected one, empty, beyond
    /// [`MOST_TEXELS`], or more texels than `per_byte` times the file's bytes could ever hold.
    fn check_size(&self, width: u64, height: u64, per_byte: u64) -> Result<(), SceneError> {
        let texels = width.saturating_mul(height);
        if texels == 0 {
            return Err(self.error("has no pixels", "Name another image"));
        }
        if let Some((w, h)) = self.size.filter(|&(w, h)| (u64::from(w), u64::from(h)) != (width, height)) {
            return Err(self.error(
                format!("is {width} x {height} pixels, but its view is {w} x {h}"),
                "Give the view the image's size, or the image the view's",
            ));
        }
        if texels > MOST_TEXELS {
            return Err(self.error(
                format!("is {width} x {height} pixels, more than the {MOST_TEXELS} that are read"),
                "Scale it down",
            ));
        }
        if texels > (self.bytes.len() as u64).saturating_mul(per_byte) {
            return Err(
                self.damaged("an image", format!("{width} x {height} pixels cannot be in so short a file"))
            );
        }
        Ok(())
    }
}

/// Decode any image; of size `size` when that is given. No pixel is NaN or infinite.
fn read(path: &Path, size: Option<(u32, u32)>) -> Result<Image, SceneError> {
    read_with(path, size, decode)
}

/// Decode an image by its first bytes.
fn decode(opened: Opened<'_>) -> Result<Image, SceneError> {
    match opened.bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => open_exr::decode(opened),
        [b'#', b'?', ..] => raster::decode_hdr(opened),
        [0x89, b'P', b'N', b'G', ..] => raster::decode(opened, image::ImageFormat::Png),
        [0xff, 0xd8, 0xff, ..] => raster::decode(opened, image::ImageFormat::Jpeg),
        _ => {
            let claims = opened.path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
            let what = match claims.as_str() {
                "exr" => "is not an EXR file, whatever its name says",
                "hdr" => "is not a Radiance HDR file, whatever its name says",
                "png" => "is not a PNG file, whatever its name says",
                "jpg" | "jpeg" => "is not a JPEG file, whatever its name says",
                _ => "is not an image that can be read",
            };
            Err(opened.error(what, "Use OpenEXR, Radiance HDR, PNG or JPEG"))
        }
    }
}

/// Decode an image of colours: in linear files Rec.709's shares, whatever primaries the file has; of codes is known how
/// they become such shares.
fn read_colors(path: &Path, size: Option<(u32, u32)>, warnings: &mut Warnings) -> Result<Image, SceneError> {
    let mut image = read(path, size)?;
    image.space = image.claims.followed(path, warnings)?;
    let Some(chromaticities) = image.chromaticities.take() else { return Ok(image) };
    let matrix = chromaticities.to_rec709().map_err(|what| {
        let what = format!("has {what} in its attribute `chromaticities`");
        SceneError::new(path, what, "Write the file anew with those of its colours, or without the attribute")
    })?;
    if let Some(matrix) = matrix {
        image.rgb.par_iter_mut().for_each(|rgb| {
            *rgb = (matrix * DVec3::from(rgb.map(f64::from))).as_vec3().to_array();
        });
        image.check_finite(path)?;
    }
    Ok(image)
}

/// Decode an image by `decode`; no pixel is NaN or infinite.
fn read_with(
    path: &Path,
    size: Option<(u32, u32)>,
    decode: impl Fn(Opened<'_>) -> Result<Image, SceneError>,
) -> Result<Image, SceneError> {
    let bytes = read_bytes(path, MOST_BYTES)?;
    let image = guarded(path, || decode(Opened { path, bytes: &bytes, size }))?;
    image.check_finite(path)?;
    Ok(image)
}

impl Image {
    fn check_finite(&self, path: &Path) -> Result<(), SceneError> {
        let refuse = |i: usize, channel: &str, value: f32| {
            let (x, y) = (i % self.width, i / self.width);
            SceneError::new(path, format!("holds {value}"), "Repair the pixel, or render the image anew")
                .at(format!("pixel x = {x}, y = {y}, channel {channel}"))
        };
        for (i, rgb) in self.rgb.iter().enumerate() {
            if let Some(c) = rgb.iter().position(|value| !value.is_finite()) {
                return Err(refuse(i, ["R", "G", "B"][c], rgb[c]));
            }
        }
        match self.alpha.iter().flatten().enumerate().find(|(_, a)| !a.is_finite()) {
            Some((i, &a)) => Err(refuse(i, "A", a)),
            None => Ok(()),
        }
    }

    /// Codes to linear radiance of Rec.709; linear images stay.
    fn linearize(&mut self) {
        let Some(code) = self.code else { return };
        if let Some(space) = &self.space {
            return space.linearize(&mut self.rgb, code);
        }
        let most = f64::from(code);
        let table: Vec<f32> =
            (0..=u32::from(code)).map(|i| srgb_decode(f64::from(i) / most) as f32).collect();
        let index = |value: f32| (f64::from(value) * most).round() as usize;
        for rgb in &mut self.rgb {
            *rgb = rgb.map(|value| table[index(value)]);
        }
    }

    /// The light of each channel at this share of the highest code.
    fn light(&self, code: f64) -> [f64; 3] {
        self.space.as_ref().map_or_else(|| [srgb_decode(code); 3], |space| space.light(code))
    }

    fn into_map(self) -> Map<3> {
        Map { width: self.width, height: self.height, texels: self.rgb }
    }
}

/// The sRGB transfer function, code in [0, 1] to linear (IEC 61966-2-1).
#[must_use]
pub fn srgb_decode(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// A colour map, or a picture of radiance: linear Rec.709. Codes of 8 or 16 bits are of the space that the file names, or
/// sRGB's.
///
/// # Errors
/// When it cannot be read as an image, or its colours have no white.
pub fn color_map(path: &Path, warnings: &mut Vec<Warning>) -> Result<Map<3>, SceneError> {
    let mut image = read_colors(path, None, warnings)?;
    image.linearize();
    Ok(image.into_map())
}

/// An image's width and height.
pub(super) fn size_of(path: &Path) -> Result<[u32; 2], SceneError> {
    let bytes = read_bytes(path, MOST_BYTES)?;
    guarded(path, || {
        let opened = Opened { path, bytes: &bytes, size: None };
        match raster::size(opened)? {
            Some(size) => Ok(size),
            None => decode(opened).map(|image| [image.width, image.height].map(|side| side as u32)),
        }
    })
}

/// From the primaries of the colours that a PNG or JPEG file holds to Rec.709's; `None` where they are the same. What the
/// file says of its curve is not looked at.
///
/// # Errors
/// When it cannot be read as an image, or its colours have no white.
pub fn to_rec709(path: &Path, warnings: &mut Vec<Warning>) -> Result<Option<DMat3>, SceneError> {
    let bytes = read_bytes(path, MOST_BYTES)?;
    let claims = guarded(path, || raster::claims(Opened { path, bytes: &bytes, size: None }))?;
    Ok(claims.followed(path, warnings)?.and_then(|space| space.to_rec709()))
}

/// A tangent-space normal map as stored, turned to +Y up when `flip` says that it is +Y down; and its alpha, where it
/// has one.
pub(super) fn normal_map(path: &Path, flip: bool) -> Result<(Map<3>, Option<Map<1>>), SceneError> {
    let mut image = read(path, None)?;
    let alpha = image.alpha.take().map(|alpha| Map {
        width: image.width,
        height: image.height,
        texels: alpha.into_iter().map(|a| [a]).collect(),
    });
    let mut map = image.into_map();
    if flip {
        map.texels.iter_mut().for_each(|t| t[1] = 1.0 - t[1]);
    }
    Ok((map, alpha))
}

/// A picture with its alpha, which is 1 without: colours are made linear, numbers are taken as they are. Its colours are
/// sRGB's whatever the file says: glTF 2.0 has profiles and gammas of its pictures ignored (section 3.8.3).
pub(super) fn picture(path: &Path, color: bool) -> Result<Map<4>, SceneError> {
    Ok(with_alpha(read(path, None)?, color))
}

/// The same of a file's bytes within another file.
pub(super) fn picture_of(path: &Path, bytes: &[u8], color: bool) -> Result<Map<4>, SceneError> {
    let image = guarded(path, || decode(Opened { path, bytes, size: None }))?;
    image.check_finite(path)?;
    Ok(with_alpha(image, color))
}

fn with_alpha(mut image: Image, color: bool) -> Map<4> {
    if color {
        image.linearize();
    }
    let alpha = image.alpha.unwrap_or_else(|| vec![1.0; image.rgb.len()]);
    let texels = image.rgb.iter().zip(alpha).map(|(&[r, g, b], a)| [r, g, b, a]).collect();
    Map { width: image.width, height: image.height, texels }
}

/// The first channel of a data map.
pub(super) fn scalar_map(path: &Path) -> Result<Map<1>, SceneError> {
    let image = read(path, None)?;
    let texels = image.rgb.iter().map(|rgb| [rgb[0]]).collect();
    Ok(Map { width: image.width, height: image.height, texels })
}

/// A lat-long panorama: linear radiance, never negative.
pub(super) fn panorama(path: &Path, warnings: &mut Warnings) -> Result<Map<3>, SceneError> {
    let mut image = read_colors(path, None, warnings)?;
    if let Some(code) = image.code {
        let bits = if code == 255 { 8 } else { 16 };
        let of = if image.space.is_some() { "by their profile" } else { "as sRGB" };
        let message = format!("holds {bits}-bit colours, read {of}: lights brighter than white are lost");
        warn(warnings, path, message);
        image.linearize();
    }
    if image.width != 2 * image.height {
        let message = format!(
            "is {} x {} texels; a lat-long panorama is twice as wide as high: stretched over the sphere as it is",
            image.width, image.height
        );
        warn(warnings, path, message);
    }
    let mut negative = 0_usize;
    for rgb in &mut image.rgb {
        if rgb.iter().any(|&value| value < 0.0) {
            negative += 1;
            *rgb = rgb.map(|value| value.max(0.0));
        }
    }
    if negative > 0 {
        warn(warnings, path, format!("{negative} texels have negative radiance: set to 0"));
    }
    Ok(image.into_map())
}

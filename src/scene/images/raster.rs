//! PNG, JPEG and Radiance HDR, through the `image` crate.

use std::io::Cursor;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::claims::Claims;
use super::{Image, Opened};
use crate::error::SceneError;

/// Texels a byte that no PNG exceeds: deflate reaches 1032 bytes a byte, of 8 one-bit texels each.
const PNG_TEXELS: u64 = 8 * 1032;
/// The same for JPEG: a bit or more for a block of 64.
const JPEG_TEXELS: u64 = 512;
/// And for Radiance HDR, whose old run lengths grow by a factor of 256.
const HDR_TEXELS: u64 = 1 << 14;

/// Decode PNG or JPEG of 8 or 16 bits, grey or coloured, with or without alpha.
pub(super) fn decode(opened: Opened<'_>, format: ImageFormat) -> Result<Image, SceneError> {
    let kind = if format == ImageFormat::Png { "a PNG file" } else { "a JPEG file" };
    if format == ImageFormat::Jpeg && !jpeg_is_whole(opened.bytes) {
        return Err(opened.damaged(kind, "it ends before its image does"));
    }
    let damaged = |e: image::ImageError| opened.damaged(kind, e);
    let mut reader = ImageReader::with_format(Cursor::new(opened.bytes), format);
    // The size is checked below, against more than a fixed number of bytes.
    reader.no_limits();
    let mut decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let densest = if format == ImageFormat::Png { PNG_TEXELS } else { JPEG_TEXELS };
    opened.check_size(width.into(), height.into(), densest)?;
    let has_alpha = decoder.color_type().has_alpha();
    let claims = claims_of(opened, format, &mut decoder);
    let deep = decoder.color_type().bytes_per_pixel() / decoder.color_type().channel_count() > 1;
    let decoded = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let code: u16 = if deep { u16::MAX } else { 255 };
    let scale = |value: u16| (f64::from(value) / f64::from(code)) as f32;
    let alpha = has_alpha.then(|| -> Vec<f32> {
        if deep {
            decoded.to_rgba16().pixels().map(|p| scale(p.0[3])).collect()
        } else {
            decoded.to_rgba8().pixels().map(|p| scale(p.0[3].into())).collect()
        }
    });
    let rgb = if deep {
        decoded.into_rgb16().pixels().map(|p| p.0.map(scale)).collect()
    } else {
        decoded.into_rgb8().pixels().map(|p| p.0.map(|v| scale(v.into()))).collect()
    };
    Ok(Image {
        width: width as usize,
        height: height as usize,
        rgb,
        alpha,
        code: Some(code),
        chromaticities: None,
        claims,
        space: None,
    })
}

/// What a PNG or JPEG file says of its colours, which are not decoded; nothing where it is of another kind.
pub(super) fn claims(opened: Opened<'_>) -> Result<Claims, SceneError> {
    let Some(format) = format_of(opened) else { return Ok(Claims::default()) };
    let mut decoder = ImageReader::with_format(Cursor::new(opened.bytes), format)
        .into_decoder()
        .map_err(|error| opened.damaged("an image", error))?;
    Ok(claims_of(opened, format, &mut decoder))
}

/// The width and height of a PNG or JPEG file, which is not decoded; nothing of another kind.
pub(super) fn size(opened: Opened<'_>) -> Result<Option<[u32; 2]>, SceneError> {
    let Some(format) = format_of(opened) else { return Ok(None) };
    let size = ImageReader::with_format(Cursor::new(opened.bytes), format).into_dimensions();
    let (width, height) = size.map_err(|error| opened.damaged("an image", error))?;
    Ok(Some([width, height]))
}

/// PNG or JPEG, by its first bytes.
fn format_of(opened: Opened<'_>) -> Option<ImageFormat> {
    match opened.bytes {
        [0x89, b'P', b'N', b'G', ..] => Some(ImageFormat::Png),
        [0xff, 0xd8, 0xff, ..] => Some(ImageFormat::Jpeg),
        _ => None,
    }
}

fn claims_of(opened: Opened<'_>, format: ImageFormat, decoder: &mut impl ImageDecoder) -> Claims {
    let grey = !decoder.color_type().has_color();
    match format {
        ImageFormat::Png => Claims::of_png(opened.bytes, grey),
        _ => Claims::of_jpeg(opened.bytes, decoder.icc_profile().ok().flatten(), grey),
    }
}

/// Whether an end-of-image marker follows the last start of a scan: the decoder would fill what is
/// missing with grey.
fn jpeg_is_whole(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    match (last(0xda), last(0xd9)) {
        (Some(scan), Some(end)) => end > scan,
        _ => false,
    }
}

/// Decode Radiance HDR; pixels are divided by the header's exposure.
pub(super) fn decode_hdr(opened: Opened<'_>) -> Result<Image, SceneError> {
    let kind = "a Radiance HDR file";
    let damaged = |e: image::ImageError| opened.damaged(kind, e);
    // Not strict: the signature may also be `#?RGBE`.
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(opened.bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    opened.check_size(width.into(), height.into(), HDR_TEXELS)?;
    let exposure = decoder.metadata().exposure.unwrap_or(1.0);
    if !(exposure.is_finite() && exposure > 0.0) {
        return Err(opened.damaged(kind, format!("its exposure is {exposure}")));
    }
    let decoded = DynamicImage::from_decoder(decoder).map_err(damaged)?.into_rgb32f();
    Ok(Image {
        width: width as usize,
        height: height as usize,
        rgb: decoded.pixels().map(|p| p.0.map(|v| v / exposure)).collect(),
        alpha: None,
        code: None,
        chromaticities: None,
        claims: Claims::default(),
        space: None,
    })
}

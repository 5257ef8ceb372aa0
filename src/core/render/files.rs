//! Images as files: OpenEXR (whole, or with a layer a term) and PNG.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Layer, LayerAttributes, SmallVec, Text,
    WritableImage, f16,
};

pub use super::error::ImageFileError;
pub use super::image::Image;
use super::tonemap::ToneMap;
use crate::output::{self, OutputError};

/// How an image file is written.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageOptions {
    /// EXR: 16-bit floats (clamped to +-65504) in place of 32-bit ones.
    pub half: bool,
    /// PNG: the tone operator.
    pub tone: ToneMap,
    /// PNG: linear radiance of the grey behind the image.
    pub background: f32,
    /// EXR: provenance as (name, text); `software`, `scene` and `parameters` are customary.
    pub attributes: Vec<(String, String)>,
}

impl Default for ImageOptions {
    fn default() -> Self {
        // A linear 0.05 is a dark grey on which both rim light and shadow stand out.
        Self { half: false, tone: ToneMap::default(), background: 0.05, attributes: Vec::new() }
    }
}

/// Write `image` in the format that the path's ending names: `.exr` or `.png`.
///
/// # Errors
/// [`ImageFileError`]; the old file, if any, then stays.
pub fn write_image(path: &Path, image: &Image, options: &ImageOptions) -> Result<(), ImageFileError> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("exr") => write_exr(path, image, options),
        Some("png") => write_png(path, image, options.tone, options.background),
        _ => {
            let ending = ending.map_or_else(|| "no ending".to_owned(), |e| format!(".{e}"));
            Err(ImageFileError::Extension { path: path.to_owned(), ending })
        }
    }
}

/// Write `image` as an EXR (RGBA, compressed without loss, premultiplied linear Rec.709).
///
/// # Errors
/// [`ImageFileError`]; the old file, if any, then stays.
pub fn write_exr(path: &Path, image: &Image, options: &ImageOptions) -> Result<(), ImageFileError> {
    write_exr_layers(path, image, &[], &[], options)
}

/// Write one EXR with the whole image as its unnamed layer (`R`, `G`, `B`, `A`: what ordinary
/// viewers show), a named layer for each of `layers` (`diffuse.R` and so on, premultiplied), and one of a single
/// channel for each of `planes` (`haze.Y`; one number a pixel).
///
/// # Errors
/// [`ImageFileError`]; the old file, if any, then stays.
pub fn write_exr_layers(
    path: &Path,
    whole: &Image,
    layers: &[(String, Image)],
    planes: &[(String, &[f32])],
    options: &ImageOptions,
) -> Result<(), ImageFileError> {
    whole.check(path)?;
    let samples = |values: Vec<f32>| match options.half {
        true => FlatSamples::F16(values.iter().map(|v| f16::from_f32(v.clamp(-65504.0, 65504.0))).collect()),
        false => FlatSamples::F32(values),
    };
    let mut channels = vec![AnyChannel::new("A", samples(whole.alpha.clone()))];
    let mut add = |prefix: &str, image: &Image| {
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let plane = image.rgb.iter().map(|rgb| rgb[c]).collect();
            channels.push(AnyChannel::new(latin1(&format!("{prefix}{name}")), samples(plane)));
        }
    };
    add("", whole);
    for (name, layer) in layers {
        layer.check(path)?;
        if (layer.width, layer.height) != (whole.width, whole.height) {
            let found = format!("the layer '{name}' of {} x {} pixels", layer.width, layer.height);
            let (width, height) = (whole.width, whole.height);
            return Err(ImageFileError::Shape { path: path.to_owned(), width, height, found });
        }
        add(&format!("{name}."), layer);
    }
    for (name, plane) in planes {
        check_plane(path, whole, name, plane)?;
        channels.push(AnyChannel::new(latin1(&format!("{name}.Y")), samples(plane.to_vec())));
    }
    let layer = Layer::new(
        (whole.width, whole.height),
        layer_attributes(&options.attributes),
        encoding(options.half),
        AnyChannels::sort(SmallVec::from_vec(channels)),
    );
    let exr = exr::image::Image::from_layer(layer);
    Ok(output::write_with(path, |file| exr.write().to_buffered(file))?)
}

/// Numbers of 32 bits hold so much noise that deflating them takes twenty times as long as run lengths and saves no more
/// than a twentieth; of halves it saves more.
fn encoding(half: bool) -> Encoding {
    let compression = if half { Compression::ZIP16 } else { Compression::RLE };
    Encoding { compression, ..Encoding::SMALL_LOSSLESS }
}

/// Refuse a plane that does not hold a finite number for each of the image's pixels.
fn check_plane(path: &Path, whole: &Image, name: &str, plane: &[f32]) -> Result<(), ImageFileError> {
    let (path, width, height) = (path.to_owned(), whole.width, whole.height);
    if plane.len() != width * height {
        let found = format!("the layer '{name}' of {} numbers", plane.len());
        return Err(ImageFileError::Shape { path, width, height, found });
    }
    match plane.iter().position(|x| !x.is_finite()) {
        Some(i) => Err(ImageFileError::NotFinite { path, x: i % width, y: i / width }),
        None => Ok(()),
    }
}

/// The provenance as EXR attributes; `software` is a standard one.
fn layer_attributes(attributes: &[(String, String)]) -> LayerAttributes {
    let mut header = LayerAttributes::default();
    for (name, text) in attributes {
        let value = latin1(text);
        if name == "software" {
            header.software_name = Some(value);
        } else {
            header.other.insert(latin1(name), exr::meta::attribute::AttributeValue::Text(value));
        }
    }
    header
}

/// EXR text holds one byte a character; others become `?`.
fn latin1(text: &str) -> Text {
    let kept: String = text.chars().map(|c| if u32::from(c) < 256 { c } else { '?' }).collect();
    Text::new_or_none(kept).unwrap_or_default()
}

/// Write `image` as an 8-bit sRGB PNG, tone-mapped, in front of a grey of linear radiance
/// `background`.
///
/// # Errors
/// [`ImageFileError`]; the old file, if any, then stays.
pub fn write_png(path: &Path, image: &Image, tone: ToneMap, background: f32) -> Result<(), ImageFileError> {
    image.check(path)?;
    write_png_bytes(path, image.width, image.height, &image.encoded(tone, background))
}

/// Write sRGB bytes (`height x width x 3`) as a PNG.
///
/// # Errors
/// [`ImageFileError`]; the old file, if any, then stays.
pub fn write_png_bytes(path: &Path, width: usize, height: usize, bytes: &[u8]) -> Result<(), ImageFileError> {
    let png = encode_png(width, height, bytes).map_err(|reason| OutputError::new(path, &reason))?;
    Ok(output::write(path, &png)?)
}

/// The bytes of a PNG file that holds sRGB bytes (`height x width x 3`).
///
/// # Errors
/// When the size does not agree with the bytes or is beyond PNG.
pub fn encode_png(width: usize, height: usize, bytes: &[u8]) -> Result<Vec<u8>, String> {
    use image::ImageEncoder as _;
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let side = |n: usize| u32::try_from(n).map_err(|_| format!("a side of {n} pixels is beyond PNG"));
    if bytes.len() != 3 * width * height {
        return Err(format!("{width} x {height} pixels cannot be made of {} bytes", bytes.len()));
    }
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Adaptive)
        .write_image(bytes, side(width)?, side(height)?, image::ExtendedColorType::Rgb8)
        .map_err(|e| e.to_string())?;
    Ok(png)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::image::MAX_SIDE;

    fn ramp() -> Image {
        let mut image = Image::new(5, 3);
        for i in 0..15 {
            image.rgb[i] = [i as f32 / 7.0, 0.25, -0.5 + i as f32];
            image.alpha[i] = i as f32 / 14.0;
        }
        image
    }

    fn options() -> ImageOptions {
        let text = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        let attributes =
            vec![text("software", "skinfit 9"), text("scene", "a/β.toml"), text("parameters", "")];
        ImageOptions { attributes, ..ImageOptions::default() }
    }

    #[test]
    fn an_exr_reads_back_bit_for_bit_with_its_layers_and_provenance() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/whole.exr");
        let (whole, mut rim) = (ramp(), ramp());
        rim.rgb.iter_mut().for_each(|rgb| *rgb = rgb.map(|c| 0.5 * c));
        let haze: Vec<f32> = (0..15).map(|i| i as f32 - 3.5).collect();
        let layers = [("rim".to_owned(), rim.clone())];
        write_exr_layers(&path, &whole, &layers, &[("haze".to_owned(), &haze)], &options()).unwrap();

        let read = exr::prelude::read_first_flat_layer_from_file(&path).unwrap().layer_data;
        let plane = |name: &str| -> Vec<f32> {
            let channel = read.channel_data.list.iter().find(|c| c.name == *name).unwrap();
            channel.sample_data.values_as_f32().collect()
        };
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            assert_eq!(plane(name), whole.rgb.iter().map(|p| p[c]).collect::<Vec<_>>());
            assert_eq!(plane(&format!("rim.{name}")), rim.rgb.iter().map(|p| p[c]).collect::<Vec<_>>());
        }
        assert_eq!(plane("A"), whole.alpha);
        assert_eq!(read.attributes.software_name, Some(Text::from("skinfit 9")));
        let scene = &read.attributes.other[&Text::from("scene")];
        assert_eq!(*scene, exr::meta::attribute::AttributeValue::Text(Text::from("a/?.toml")));

        // What an ordinary viewer does: the RGBA of the unnamed layer.
        let shown = exr::prelude::read_first_rgba_layer_from_file(
            &path,
            |size, _| vec![[0.0_f32; 4]; size.area()],
            |pixels, at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y() * 5 + at.x()] = [r, g, b, a],
        );
        let shown = shown.unwrap().layer_data.channel_data.pixels;
        assert!(shown.iter().zip(&whole.rgb).all(|(s, w)| s[..3] == w[..]));
    }

    #[test]
    fn a_half_exr_is_clamped_at_the_largest_half() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("half.exr");
        let mut image = Image::new(1, 1);
        image.rgb[0] = [1e6, 0.5, -1e6];
        write_image(&path, &image, &ImageOptions { half: true, ..options() }).unwrap();
        let read = exr::prelude::read_first_flat_layer_from_file(&path).unwrap().layer_data.channel_data;
        let values: Vec<f32> = read.list.iter().flat_map(|c| c.sample_data.values_as_f32()).collect();
        // A, B, G, R.
        assert_eq!(values, [0.0, -65504.0, 0.5, 65504.0]);
    }

    #[test]
    fn a_png_shows_the_background_where_nothing_covers_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small.PNG");
        let mut image = Image::new(2, 1);
        (image.rgb[0], image.alpha[0]) = ([0.5, 0.25, 2.0], 1.0);
        let background = super::super::tonemap::srgb_decode(0.2);
        write_image(&path, &image, &ImageOptions { background, ..options() }).unwrap();
        let bytes = image::open(&path).unwrap().to_rgb8().into_raw();
        // sRGB of 0.5 and 0.25 in f64: 187.516 and 136.96.
        assert_eq!(bytes, [188, 137, 255, 51, 51, 51]);
    }

    #[test]
    fn what_cannot_be_written_is_refused_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let refused =
            |name: &str, image: &Image| write_image(&at(name), image, &options()).unwrap_err().to_string();
        assert!(refused("a.tiff", &ramp()).contains("ends in .tiff"));
        assert!(refused("a", &ramp()).contains("no ending"));
        assert!(refused("a.exr", &Image::new(0, 4)).contains("0 x 4"));
        let wide = Image { width: MAX_SIDE + 1, height: 1, ..Image::default() };
        assert!(refused("a.png", &wide).contains("32769 x 1"));
        assert!(refused("a.png", &Image { width: 4, ..ramp() }).contains("15 colours"));
        let mut broken = ramp();
        broken.rgb[7][1] = f32::NAN;
        assert!(refused("a.exr", &broken).contains("pixel (2, 1)"));
        let layers = [("rim".to_owned(), Image::new(2, 2))];
        let error = write_exr_layers(&at("a.exr"), &ramp(), &layers, &[], &options()).unwrap_err();
        assert!(error.to_string().contains("layer 'rim' of 2 x 2"));
        std::fs::write(at("file"), b"").unwrap();
        assert!(refused("file/a.png", &ramp()).contains("cannot be written"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

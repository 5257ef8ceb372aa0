//! OpenEXR: the first layer that has colours, placed in the display window.
//!
//! Colours are R, G and B, or luminance and chroma (Y, RY, BY), or Y alone, which is grey.

use std::io::Cursor;

use exr::compression::Compression;
use exr::image::{FlatSamples, Layer};
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{AnyChannels, ReadChannels, ReadLayers, Vec2};
use glam::DVec2;

use super::chroma::{self, Chroma};
use super::chromaticities::{Chromaticities, REC709};
use super::claims::Claims;
use super::{Image, Opened, dwa, sampled};
use crate::error::SceneError;

const KIND: &str = "an EXR file";
const FULL: &str =
    "Save it as RGB with all channels at full resolution, or with chroma (RY, BY) for 2 x 2 pixels each";

/// Decode an EXR file of any compression; tiled files at their full resolution.
pub(super) fn decode(opened: Opened<'_>) -> Result<Image, SceneError> {
    let remedy = "Save colours under these names, in any layer";
    decode_by(opened, colours, "has no channels R, G and B, nor Y, RY and BY, nor Y", remedy)
}

/// The haze in an EXR file, as a grey image.
pub(super) fn decode_haze(opened: Opened<'_>) -> Result<Image, SceneError> {
    let remedy = "Save the haze under the name haze.Y";
    decode_by(opened, haze, "has no channel haze.Y, and is not an image of Y alone", remedy)
}

/// Of the attribute of that name.
fn xy(given: exr::meta::attribute::Chromaticities) -> Chromaticities {
    let point = |Vec2(x, y): Vec2<f32>| DVec2::new(f64::from(x), f64::from(y));
    Chromaticities { primaries: [given.red, given.green, given.blue].map(point), white: point(given.white) }
}

type Channels = AnyChannels<FlatSamples>;

/// Which channels of a layer are looked at, by their indices.
struct Found {
    /// R, G and B; or RY, Y and BY.
    colours: [usize; 3],
    alpha: Option<usize>,
    /// Whether they are luminance and chroma.
    chroma: bool,
}

impl Found {
    const fn grey(y: usize, alpha: Option<usize>) -> Self {
        Self { colours: [y; 3], alpha, chroma: false }
    }
}

/// Decode the first layer in which `find` finds something.
fn decode_by(
    opened: Opened<'_>,
    find: fn(&Layer<Channels>) -> Option<Found>,
    missing: &str,
    remedy: &str,
) -> Result<Image, SceneError> {
    let mut reader = Cursor::new(opened.bytes);
    let meta = MetaData::read_from_buffered(&mut reader, false).map_err(|e| opened.damaged(KIND, e))?;
    let behind = opened.bytes.get(reader.position() as usize..).unwrap_or_default();
    let Some(shared) = meta.headers.first().map(|header| &header.shared_attributes) else {
        return Err(opened.damaged(KIND, "it has no layer"));
    };
    let (window, chromaticities) = (shared.display_window, shared.chromaticities.map(xy));
    let layers = layers(opened, &meta, behind, window.size)?;
    for layer in &layers {
        if let Some(found) = find(layer) {
            check_full(opened, layer, &found)?;
            let planes = if found.chroma {
                colours_of_chroma(opened, layer, &found, chromaticities)?
            } else {
                found.colours.map(|i| samples(layer, i))
            };
            let placed = place(layer, &planes, found.alpha, window.position, window.size);
            return Ok(Image { chromaticities, ..placed });
        }
    }
    let all = layers.iter().flat_map(|layer| &layer.channel_data.list);
    let names: Vec<_> = all.map(|channel| channel.name.to_string()).collect();
    Err(opened.error(format!("{missing} (it has {})", names.join(", ")), remedy))
}

/// All layers, checked before anything is allocated.
fn layers(
    opened: Opened<'_>,
    meta: &MetaData,
    behind: &[u8],
    window: Vec2<usize>,
) -> Result<Vec<Layer<Channels>>, SceneError> {
    let sampled = sampled::any(&meta.headers);
    if sampled {
        sampled::check(&meta.headers).map_err(|what| opened.error(what, FULL))?;
    }
    check(opened, &meta.headers, window)?;
    if dwa::any(meta) {
        dwa::check(meta, behind).map_err(|what| opened.damaged(KIND, what))?;
    }
    let layers = if sampled {
        sampled::layers(meta, behind)
    } else {
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            // The parallel reader aborts the process should a codec panic on damaged bytes.
            .non_parallel()
            .from_buffered(Cursor::new(opened.bytes));
        image.map(|image| image.layer_data.into_vec())
    };
    layers.map_err(|e| opened.damaged(KIND, e))
}

/// Refuse channels of fewer samples than pixels that are not chroma: nothing says how to fill them up.
fn check_full(opened: Opened<'_>, layer: &Layer<Channels>, found: &Found) -> Result<(), SceneError> {
    let [first, y, last] = found.colours;
    let full = if found.chroma { vec![y] } else { vec![first, y, last] };
    for i in full.into_iter().chain(found.alpha) {
        let channel = &layer.channel_data.list[i];
        if channel.sampling != Vec2(1, 1) {
            return Err(opened.error(format!("has fewer pixels of {} than of its image", channel.name), FULL));
        }
    }
    Ok(())
}

/// R, G and B of a layer's Y, RY and BY.
fn colours_of_chroma(
    opened: Opened<'_>,
    layer: &Layer<Channels>,
    found: &Found,
    chromaticities: Option<Chromaticities>,
) -> Result<[Vec<f32>; 3], SceneError> {
    let shares = chromaticities.unwrap_or(REC709).luminance().map_err(|what| {
        let what = format!("has luminance and chroma, and {what} in its attribute `chromaticities`");
        opened.error(what, "Write the file anew with those of its colours, or save it as RGB")
    })?;
    let [ry, y, by] = found.colours;
    let chroma = [ry, by]
        .map(|i| Chroma { samples: samples(layer, i), sampling: layer.channel_data.list[i].sampling });
    let rgb = chroma::to_rgb(&samples(layer, y), chroma, layer.size.x(), shares.map(|share| share as f32));
    Ok([0, 1, 2].map(|c| rgb.iter().map(|rgb| rgb[c]).collect()))
}

fn samples(layer: &Layer<Channels>, i: usize) -> Vec<f32> {
    layer.channel_data.list[i].sample_data.values_as_f32().collect()
}

/// Refuse what cannot be read, before its pixels are allocated.
fn check(opened: Opened<'_>, headers: &[Header], window: Vec2<usize>) -> Result<(), SceneError> {
    let mut bytes = 0_u64;
    let mut data = 0_u64;
    for header in headers {
        if header.deep {
            return Err(opened.error("holds deep data, which is not read", "Flatten it"));
        }
        let texels = (header.layer_size.width() as u64).saturating_mul(header.layer_size.height() as u64);
        data = data.saturating_add(texels);
        let raw = sampled::bytes_of(&header.channels, header.layer_size, 0);
        bytes = bytes.saturating_add(raw / expansion(header.compression));
        // Every chunk has 8 bytes in the table and 8 of its own.
        bytes = bytes.saturating_add((header.chunk_count as u64).saturating_mul(16));
    }
    if data > super::MOST_TEXELS {
        return Err(opened.error(format!("has {data} pixels in all, too many to read"), "Scale it down"));
    }
    if bytes > opened.bytes.len() as u64 {
        return Err(opened.damaged(KIND, "the file is shorter than its pixels can be packed"));
    }
    let (width, height) = (window.width() as u64, window.height() as u64);
    // A cropped image may lie in a wide display window, but not in a boundless one.
    if width.saturating_mul(height) > data.saturating_mul(64).max(1 << 24) {
        return Err(opened.damaged(KIND, format!("its display window is {width} x {height}")));
    }
    opened.check_size(width, height, u64::MAX)
}

/// How many bytes of pixels a byte of the file can hold at most.
fn expansion(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        // A run of 128 in two bytes.
        Compression::RLE => 64,
        // Deflate's longest match is 258 bytes in 2 bits; PXR24 stores 3 bytes of 4.
        Compression::ZIP1 | Compression::ZIP16 | Compression::PXR24 => 1400,
        // A run of 255 values of 2 bytes in 9 bits.
        Compression::PIZ => 1024,
        // 16 values in 3 bytes.
        Compression::B44 | Compression::B44A => 16,
        // A block of 64 values as one symbol, then deflate.
        _ => 1 << 17,
    }
}

/// The names of a layer's channels in lower case.
fn names(layer: &Layer<Channels>) -> Vec<String> {
    layer.channel_data.list.iter().map(|channel| channel.name.to_string().to_lowercase()).collect()
}

/// The haze of a layer: the channel `haze.Y`, or the Y of an image that has no colours beside it.
fn haze(layer: &Layer<Channels>) -> Option<Found> {
    let names = names(layer);
    let find = |name: &str| names.iter().position(|n| n == name);
    let grey = || find("y").filter(|_| ["r", "g", "b", "ry", "by"].iter().all(|other| find(other).is_none()));
    let at = find("haze.y").or_else(grey)?;
    Some(Found::grey(at, None))
}

/// R, G, B and perhaps A of a layer: of the unnamed channel group if it has them, else of the first that has
/// (`beauty.R`, ...); else luminance and chroma by the same rule. A grey image's Y stands for all three.
fn colours(layer: &Layer<Channels>) -> Option<Found> {
    let names = names(layer);
    let mut groups: Vec<&str> =
        names.iter().map(|n| n.rsplit_once('.').map_or("", |(group, _)| group)).collect();
    groups.sort_by_key(|group| !group.is_empty());
    groups.dedup();
    let find = |group: &str, name: &str| {
        let full = if group.is_empty() { name.to_owned() } else { format!("{group}.{name}") };
        names.iter().position(|n| *n == full)
    };
    for (names, chroma) in [(["r", "g", "b"], false), (["ry", "y", "by"], true)] {
        for group in &groups {
            if let [Some(first), Some(second), Some(third)] = names.map(|name| find(group, name)) {
                return Some(Found { colours: [first, second, third], alpha: find(group, "a"), chroma });
            }
        }
    }
    // With RY or BY beside it, Y would lose the colour; beside an X it is a coordinate.
    groups.iter().find_map(|group| {
        let alone = ["ry", "by", "x"].iter().all(|other| find(group, other).is_none());
        find(group, "y").filter(|_| alone).map(|grey| Found::grey(grey, find(group, "a")))
    })
}

/// The layer in the display window; outside of the layer everything is 0.
fn place(
    layer: &Layer<Channels>,
    planes: &[Vec<f32>; 3],
    alpha: Option<usize>,
    origin: Vec2<i32>,
    size: Vec2<usize>,
) -> Image {
    let (width, height) = (size.width(), size.height());
    let offset = |layer: i32, window: i32| i64::from(layer) - i64::from(window);
    let position = layer.attributes.layer_position;
    let (dx, dy) = (offset(position.x(), origin.x()), offset(position.y(), origin.y()));
    let copy = |plane: &[f32], mut put: Box<dyn FnMut(usize, f32) + '_>| {
        for (i, &value) in plane.iter().enumerate() {
            let (x, y) = ((i % layer.size.width()) as i64 + dx, (i / layer.size.width()) as i64 + dy);
            if (0..width as i64).contains(&x) && (0..height as i64).contains(&y) {
                put(y as usize * width + x as usize, value);
            }
        }
    };
    let mut out = vec![[0.0; 3]; width * height];
    for (c, plane) in planes.iter().enumerate() {
        copy(plane, Box::new(|at, value| out[at][c] = value));
    }
    let alpha = alpha.map(|i| {
        let mut plane = vec![0.0; width * height];
        copy(&samples(layer, i), Box::new(|at, value| plane[at] = value));
        plane
    });
    Image {
        width,
        height,
        rgb: out,
        alpha,
        code: None,
        chromaticities: None,
        claims: Claims::default(),
        space: None,
    }
}

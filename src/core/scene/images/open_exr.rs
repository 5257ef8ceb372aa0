//! OpenEXR: the first layer that has colours, placed in the display window.

use std::io::Cursor;

use exr::block::chunk::CompressedBlock;
use exr::block::reader::ChunksReader;
use exr::compression::Compression;
use exr::image::{FlatSamples, Layer};
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{AnyChannels, ReadChannels, ReadLayers, Vec2};
use glam::DVec2;

use super::chromaticities::Chromaticities;
use super::claims::Claims;
use super::{Image, Opened};
use crate::scene::error::SceneError;

const KIND: &str = "an EXR file";

/// Decode an EXR file of any compression; tiled files at their full resolution.
pub(super) fn decode(opened: Opened<'_>) -> Result<Image, SceneError> {
    let remedy = "Save colours under these names, in any layer; luminance and chroma (Y, RY, BY) as RGB";
    decode_by(opened, colours, "has no channels R, G and B, nor Y", remedy)
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

/// The indices of a layer's R, G, B and perhaps A.
type Found = ([usize; 3], Option<usize>);

/// Decode the first layer in which `find` finds something.
fn decode_by(
    opened: Opened<'_>,
    find: fn(&Layer<AnyChannels<FlatSamples>>) -> Option<Found>,
    missing: &str,
    remedy: &str,
) -> Result<Image, SceneError> {
    let damaged = |e: exr::error::Error| opened.damaged(KIND, e);
    let meta = MetaData::read_from_buffered(Cursor::new(opened.bytes), false).map_err(damaged)?;
    check_sampling(opened, &meta.headers)?;
    let window = meta.headers.first().map(|header| header.shared_attributes.display_window);
    let Some(window) = window else { return Err(opened.damaged(KIND, "it has no layer")) };
    check(opened, &meta.headers, window.size)?;
    if meta.headers.iter().any(|header| is_dwa(header.compression)) {
        check_dwa(opened)?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        // The parallel reader aborts the process should a codec panic on damaged bytes.
        .non_parallel()
        .from_buffered(Cursor::new(opened.bytes))
        .map_err(damaged)?;
    let mut found = Vec::new();
    for layer in &image.layer_data {
        if let Some(channels) = find(layer) {
            let placed = place(layer, &channels, window.position, window.size);
            return Ok(Image { chromaticities: image.attributes.chromaticities.map(xy), ..placed });
        }
        found.extend(layer.channel_data.list.iter().map(|channel| channel.name.to_string()));
    }
    Err(opened.error(format!("{missing} (it has {})", found.join(", ")), remedy))
}

/// Refuse channels of fewer pixels than others, luminance and chroma (Y, RY, BY) above all: the decoder does not read them.
fn check_sampling(opened: Opened<'_>, headers: &[Header]) -> Result<(), SceneError> {
    let mut channels = headers.iter().flat_map(|header| &header.channels.list);
    if channels.all(|channel| channel.sampling == Vec2(1, 1)) {
        return Ok(());
    }
    Err(opened.error(
        "has channels of fewer pixels than its image, as luminance and chroma (Y, RY, BY) have",
        "Save it as RGB with all channels at full resolution",
    ))
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
        let per_texel = header.channels.bytes_per_pixel as u64;
        bytes = bytes.saturating_add(texels.saturating_mul(per_texel) / expansion(header.compression));
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

const fn is_dwa(compression: Compression) -> bool {
    matches!(compression, Compression::DWAA(_) | Compression::DWAB(_))
}

/// Refuse DWA chunks that promise more than they can hold: the decoder allocates what their headers
/// say, and memory that cannot be had ends the process.
fn check_dwa(opened: Opened<'_>) -> Result<(), SceneError> {
    let damaged = |e: exr::error::Error| opened.damaged(KIND, e);
    let chunks =
        exr::block::read(Cursor::new(opened.bytes), false).and_then(|reader| reader.all_chunks(false));
    let mut chunks = chunks.map_err(damaged)?;
    let headers = chunks.meta_data().headers.clone();
    let texels = |size: Vec2<usize>| (size.width() as u64).saturating_mul(size.height() as u64);
    let bytes_of =
        |header: &Header, texels: u64| texels.saturating_mul(header.channels.bytes_per_pixel as u64);
    let dwa = headers.iter().filter(|header| is_dwa(header.compression));
    let needed: u64 = dwa.map(|header| bytes_of(header, texels(header.layer_size))).sum();
    let mut held = 0_u64;
    // An error is left to the decoder, which meets it too.
    while let Some(Ok(chunk)) = chunks.next() {
        let bytes = match &chunk.compressed_block {
            CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
            CompressedBlock::Tile(block) => &block.compressed_pixels_le,
            _ => continue,
        };
        let Some(header) = headers.get(chunk.layer_index).filter(|header| is_dwa(header.compression)) else {
            continue;
        };
        let place = header.get_block_data_indices(&chunk.compressed_block);
        let Ok(place) = place.and_then(|tile| header.get_absolute_block_pixel_coordinates(tile)) else {
            break;
        };
        let raw = bytes_of(header, texels(place.size));
        let length = bytes.len() as u64;
        if length == 0 || length == raw {
            held = held.saturating_add(raw);
            continue;
        }
        // Eleven numbers (ImfDwaCompressor.cpp): 1 bytes of other channels, 6 run-length codes, 7 bytes
        // behind them, 8 and 9 numbers of AC and DC coefficients.
        let mut words =
            bytes.chunks_exact(8).map(|w| w.iter().rev().fold(0_u64, |n, &b| n << 8 | u64::from(b)));
        let words: [u64; 10] = std::array::from_fn(|_| words.next().unwrap_or(0));
        // Deflate packs 1032 to 1, the Huffman coder 255 values into 9 bits.
        let packed = length.saturating_mul(1032);
        if words[1].max(words[7]) > raw || words[6].max(words[8]).max(words[9]) > packed {
            return Err(opened.damaged(KIND, "a DWA chunk promises more than it can hold"));
        }
        // A DC coefficient stands for 64 samples of at most 4 bytes.
        held = held.saturating_add(words[1] + words[7] + 256 * words[9]);
    }
    if held < needed {
        return Err(opened.damaged(KIND, "its DWA chunks hold less than the image"));
    }
    Ok(())
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
fn names(layer: &Layer<AnyChannels<FlatSamples>>) -> Vec<String> {
    layer.channel_data.list.iter().map(|channel| channel.name.to_string().to_lowercase()).collect()
}

/// The haze of a layer: the channel `haze.Y`, or the Y of an image that has no colours beside it.
fn haze(layer: &Layer<AnyChannels<FlatSamples>>) -> Option<Found> {
    let names = names(layer);
    let find = |name: &str| names.iter().position(|n| n == name);
    let grey = || find("y").filter(|_| ["r", "g", "b", "ry", "by"].iter().all(|other| find(other).is_none()));
    let at = find("haze.y").or_else(grey)?;
    Some(([at; 3], None))
}

/// The indices of R, G, B and perhaps A in a layer: of the unnamed channel group if it has them, else
/// of the first that has (`beauty.R`, ...). A grey image's Y stands for all three.
fn colours(layer: &Layer<AnyChannels<FlatSamples>>) -> Option<Found> {
    let names = names(layer);
    let mut groups: Vec<&str> =
        names.iter().map(|n| n.rsplit_once('.').map_or("", |(group, _)| group)).collect();
    groups.sort_by_key(|group| !group.is_empty());
    groups.dedup();
    let find = |group: &str, name: &str| {
        let full = if group.is_empty() { name.to_owned() } else { format!("{group}.{name}") };
        names.iter().position(|n| *n == full)
    };
    for group in &groups {
        if let (Some(r), Some(g), Some(b)) = (find(group, "r"), find(group, "g"), find(group, "b")) {
            return Some(([r, g, b], find(group, "a")));
        }
    }
    // With RY and BY beside it, Y would lose the colour; beside an X it is a coordinate.
    groups.iter().find_map(|group| {
        let grey = find(group, "y").filter(|_| find(group, "ry").is_none() && find(group, "x").is_none())?;
        Some(([grey; 3], find(group, "a")))
    })
}

/// The layer in the display window; outside of the layer everything is 0.
fn place(
    layer: &Layer<AnyChannels<FlatSamples>>,
    (rgb, alpha): &Found,
    origin: Vec2<i32>,
    size: Vec2<usize>,
) -> Image {
    let channels = &layer.channel_data.list;
    let samples = |i: usize| -> Vec<f32> { channels[i].sample_data.values_as_f32().collect() };
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
    for (c, &i) in rgb.iter().enumerate() {
        copy(&samples(i), Box::new(|at, value| out[at][c] = value));
    }
    let alpha = alpha.map(|i| {
        let mut plane = vec![0.0; width * height];
        copy(&samples(i), Box::new(|at, value| plane[at] = value));
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

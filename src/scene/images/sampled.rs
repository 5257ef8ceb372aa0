//! EXR layers of which some channels have fewer samples than the layer has pixels, as chroma has.
//!
//! The codecs of `exr` know such channels and its readers do not: chunks are taken from the file and laid out here.

use std::borrow::Cow;
use std::collections::BTreeSet;

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::compression::Compression;
use exr::error::{Error, Result};
use exr::image::{Encoding, FlatSamples, Layer};
use exr::meta::attribute::{ChannelDescription, ChannelList, IntegerBounds, SampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{AnyChannel, AnyChannels, Vec2, f16};

/// Whether there are such channels.
pub(super) fn any(headers: &[Header]) -> bool {
    headers.iter().flat_map(|header| &header.channels.list).any(|channel| channel.sampling != Vec2(1, 1))
}

/// Check headers with such channels; `Err` says what they have that is not read.
pub(super) fn check(headers: &[Header]) -> std::result::Result<(), String> {
    headers.iter().filter(|&header| any(std::slice::from_ref(header))).try_for_each(check_layer)
}

fn check_layer(header: &Header) -> std::result::Result<(), String> {
    let size = header.layer_size;
    for channel in &header.channels.list {
        check_channel(channel, size, header.own_attributes.layer_position)?;
    }
    if header.deep || header.blocks != BlockDescription::ScanLines {
        return Err("has channels of fewer pixels than its image in tiles or deep data".to_owned());
    }
    // The codecs count by whole bytes a pixel, which one chroma channel of half floats alone has not.
    let block = Vec2(size.x(), header.compression.scan_lines_per_block().min(size.y()));
    if [0, 1].iter().any(|&y| bytes_a_pixel(&header.channels, block, y).is_none()) {
        return Err("has one channel of fewer pixels than its image".to_owned());
    }
    Ok(())
}

fn check_channel(
    channel: &ChannelDescription,
    Vec2(width, height): Vec2<usize>,
    Vec2(left, top): Vec2<i32>,
) -> std::result::Result<(), String> {
    let (Vec2(across, down), name) = (channel.sampling, &channel.name);
    if !(1..=2).contains(&across) || !(1..=2).contains(&down) {
        return Err(format!("has a sample of the channel {name} for {across} x {down} pixels"));
    }
    // OpenEXR writes no such file either (`Header::sanityCheck`).
    let fits = |start: i32, size: usize, step: usize| start % step as i32 == 0 && size.is_multiple_of(step);
    if fits(left, width, across) && fits(top, height, down) {
        return Ok(());
    }
    Err(format!(
        "has a sample of the channel {name} for {across} x {down} pixels, but {width} x {height} pixels that begin at \
         {left}, {top}"
    ))
}

/// The bytes of a block of that size from line `y` on, unpacked.
pub(super) fn bytes_of(channels: &ChannelList, size: Vec2<usize>, y: usize) -> u64 {
    let bytes = |channel: &ChannelDescription| {
        let samples = (size.x() / channel.sampling.x()) as u64;
        let lines = (y + size.y()).div_ceil(channel.sampling.y()) - y.div_ceil(channel.sampling.y());
        samples.saturating_mul(lines as u64).saturating_mul(channel.sample_type.bytes_per_sample() as u64)
    };
    channels.list.iter().map(bytes).fold(0, u64::saturating_add)
}

/// The same a pixel, where that is whole.
fn bytes_a_pixel(channels: &ChannelList, size: Vec2<usize>, y: usize) -> Option<usize> {
    let pixels = size.area() as u64;
    let bytes = bytes_of(channels, size, y);
    (pixels > 0 && bytes.is_multiple_of(pixels)).then(|| (bytes / pixels) as usize)
}

/// The chunks of a file, of which `behind` is what lies behind its headers.
pub(super) fn chunks<'a>(meta: &'a MetaData, behind: &'a [u8]) -> impl Iterator<Item = Result<Chunk>> + 'a {
    let count = meta.headers.iter().map(|header| header.chunk_count).fold(0, usize::saturating_add);
    // First the place of each, of 8 bytes; they lie one behind the other anyway.
    let mut rest = behind.get(count.saturating_mul(8)..).unwrap_or_default();
    (0..count).map(move |_| Chunk::read(&mut rest, meta))
}

/// All layers of a file that [`check`] has passed.
pub(super) fn layers(meta: &MetaData, behind: &[u8]) -> Result<Vec<Layer<AnyChannels<FlatSamples>>>> {
    let full: Vec<Header> = meta.headers.iter().cloned().map(at_full_resolution).collect();
    MetaData::validate(&full, false)?;
    let mut layers: Vec<Filling> = meta.headers.iter().cloned().map(Filling::new).collect();
    for chunk in chunks(meta, behind) {
        let chunk = chunk?;
        let layer = layers.get_mut(chunk.layer_index).ok_or_else(|| invalid("a chunk of no layer"))?;
        layer.take(chunk.compressed_block)?;
    }
    Ok(layers.into_iter().map(Filling::into_layer).collect())
}

/// As the validation of `exr`, which refuses fewer samples, passes it.
fn at_full_resolution(mut header: Header) -> Header {
    header.channels.list.iter_mut().for_each(|channel| channel.sampling = Vec2(1, 1));
    header
}

const fn invalid(what: &'static str) -> Error {
    Error::Invalid(Cow::Borrowed(what))
}

/// A layer that chunks come into.
struct Filling {
    header: Header,
    planes: Vec<Vec<f32>>,
    /// Where the chunks lie that have come.
    filled: BTreeSet<(i32, i32)>,
}

impl Filling {
    fn new(header: Header) -> Self {
        let plane = |channel: &ChannelDescription| vec![0.0; channel.subsampled_pixels(header.layer_size)];
        let planes = header.channels.list.iter().map(plane).collect();
        Self { header, planes, filled: BTreeSet::new() }
    }

    fn take(&mut self, block: CompressedBlock) -> Result<()> {
        let tile = self.header.get_block_data_indices(&block)?;
        if !tile.is_largest_resolution_level() {
            return Ok(());
        }
        let place = self.header.get_absolute_block_pixel_coordinates(tile)?;
        place.validate(Some(self.header.layer_size))?;
        if !self.filled.insert((place.position.x(), place.position.y())) {
            return Err(invalid("two chunks of one place"));
        }
        let packed = match block {
            CompressedBlock::ScanLine(block) => block.compressed_pixels_le,
            CompressedBlock::Tile(block) => block.compressed_pixels_le,
            _ => return Err(invalid("a chunk of deep data")),
        };
        let bytes = unpacked(&mut self.header, packed, place)?;
        self.lay_out(&bytes, place)
    }

    /// The samples of a block lie line by line, of each line channel by channel.
    fn lay_out(&mut self, mut bytes: &[u8], place: IntegerBounds) -> Result<()> {
        let Vec2(left, top) = place.position.to_usize("chunk position")?;
        let width = self.header.layer_size.x();
        for y in top..top + place.size.y() {
            for (channel, plane) in self.header.channels.list.iter().zip(&mut self.planes) {
                let Vec2(across, down) = channel.sampling;
                if !y.is_multiple_of(down) {
                    continue;
                }
                let start = y / down * (width / across) + left / across;
                let samples = plane.get_mut(start..start + place.size.x() / across);
                let samples = samples.ok_or_else(|| invalid("a chunk beyond its layer"))?;
                let length = samples.len() * channel.sample_type.bytes_per_sample();
                let line = bytes.split_off(..length).ok_or_else(|| invalid("a chunk of too few samples"))?;
                numbers(line, channel.sample_type, samples);
            }
        }
        Ok(())
    }

    fn into_layer(self) -> Layer<AnyChannels<FlatSamples>> {
        let channels = self.header.channels.list.into_iter().zip(self.planes);
        let channel = |(described, plane): (ChannelDescription, _)| AnyChannel {
            name: described.name,
            sample_data: FlatSamples::F32(plane),
            quantize_linearly: described.quantize_linearly,
            sampling: described.sampling,
        };
        Layer {
            channel_data: AnyChannels { list: channels.map(channel).collect() },
            attributes: self.header.own_attributes,
            size: self.header.layer_size,
            encoding: Encoding::UNCOMPRESSED,
        }
    }
}

/// The codecs give the machine's own order of bytes.
fn numbers(bytes: &[u8], kind: SampleType, out: &mut [f32]) {
    let words = bytes.chunks_exact(kind.bytes_per_sample());
    for (value, word) in out.iter_mut().zip(words) {
        *value = match (kind, word) {
            (SampleType::F16, &[a, b]) => f16::from_ne_bytes([a, b]).to_f32(),
            (SampleType::F32, &[a, b, c, d]) => f32::from_ne_bytes([a, b, c, d]),
            (_, &[a, b, c, d]) => u32::from_ne_bytes([a, b, c, d]) as f32,
            _ => 0.0,
        };
    }
}

/// The samples of a chunk.
fn unpacked(header: &mut Header, packed: Vec<u8>, place: IntegerBounds) -> Result<Vec<u8>> {
    let y = place.position.to_usize("chunk position")?.y();
    let bytes = bytes_of(&header.channels, place.size, y);
    let b44 = matches!(header.compression, Compression::B44 | Compression::B44A);
    if b44 && packed.len() as u64 != bytes && any(std::slice::from_ref(header)) {
        return unpacked_b44(header, &packed, place.size);
    }
    // Of this the codecs see how much a chunk holds; by the channels' list alone they would take all for full.
    let a_pixel =
        bytes_a_pixel(&header.channels, place.size, y).ok_or_else(|| invalid("a chunk of odd size"))?;
    if a_pixel == 0 {
        return Ok(Vec::new());
    }
    header.channels.bytes_per_pixel = a_pixel;
    header.compression.decompress_image_section_from_le(header, packed, place, false)
}

/// Of B44 chunks, in which the channels lie one behind the other: its codec takes only full ones, so each by itself.
fn unpacked_b44(header: &Header, mut packed: &[u8], size: Vec2<usize>) -> Result<Vec<u8>> {
    let short = || invalid("a B44 chunk that is too short");
    let mut planes = Vec::new();
    for channel in &header.channels.list {
        let samples = channel.subsampled_resolution(size);
        let length = b44_length(channel.sample_type, samples, packed).ok_or_else(short)?;
        let mut own = packed.split_off(..length).ok_or_else(short)?.to_vec();
        let full = ChannelDescription { sampling: Vec2(1, 1), ..channel.clone() };
        let bytes = samples.area() * full.sample_type.bytes_per_sample();
        if full.sample_type == SampleType::F16 && own.len() == bytes {
            // Of their full length samples are taken for unpacked ones; what lies behind them is not looked at.
            own.push(0);
        }
        let mut alone = Header::new(full.name.clone(), samples, std::iter::once(full).collect());
        alone.compression = header.compression;
        alone.blocks = BlockDescription::ScanLines;
        let place = IntegerBounds::from_dimensions(samples);
        planes.push(alone.compression.decompress_image_section_from_le(&alone, own, place, false)?);
    }
    interleaved(&header.channels, &planes, size).ok_or_else(short)
}

/// The lines of all channels in the order of the other codecs.
fn interleaved(channels: &ChannelList, planes: &[Vec<u8>], size: Vec2<usize>) -> Option<Vec<u8>> {
    let mut lines = Vec::new();
    for y in 0..size.y() {
        for (channel, plane) in channels.list.iter().zip(planes) {
            let Vec2(across, down) = channel.sampling;
            if y.is_multiple_of(down) {
                let length = size.x() / across * channel.sample_type.bytes_per_sample();
                let start = y / down * length;
                lines.extend_from_slice(plane.get(start..start + length)?);
            }
        }
    }
    Some(lines)
}

/// How many bytes of a B44 stream are the first channel's: halves by blocks of 4 x 4 of 14 bytes, or of 3 where all
/// are equal (`ImfB44Compressor.cpp`); other numbers as they are.
fn b44_length(kind: SampleType, samples: Vec2<usize>, stream: &[u8]) -> Option<usize> {
    if kind != SampleType::F16 {
        return Some(samples.area() * kind.bytes_per_sample());
    }
    let blocks = samples.x().div_ceil(4) * samples.y().div_ceil(4);
    (0..blocks).try_fold(0, |at: usize, _| Some(at + if *stream.get(at + 2)? >= 13 << 2 { 3 } else { 14 }))
}

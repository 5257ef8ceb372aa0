//! Tests of OpenEXR files of luminance and chroma.

use std::path::Path;

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::compression::Compression;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, IntegerBounds, SampleType, Text};
use exr::meta::header::Header;
use exr::prelude::{Vec2, f16};

use super::open_exr::decode;
use super::{Image, Opened};
use crate::error::{SceneError, guarded};

const REC709: [f32; 3] = [0.212_639, 0.715_169, 0.072_192];
/// Half of the distance of halves, of a number.
const HALF: f32 = 1.0 / 2048.0;

/// A file that no library at hand writes: halves, with chroma subsampled across and down.
#[derive(Clone)]
struct File {
    header: Header,
    shares: [f32; 3],
}

impl File {
    fn new(size: (usize, usize), compression: Compression, sampling: usize) -> Self {
        let channel = |(name, sampling)| ChannelDescription {
            sampling: Vec2(sampling, sampling),
            ..ChannelDescription::named(name, SampleType::F16)
        };
        let channels = [("A", 1), ("BY", sampling), ("RY", sampling), ("Y", 1)].into_iter().map(channel);
        let mut header = Header::new(Text::from("face"), size, channels.collect());
        header.compression = compression;
        header.blocks = BlockDescription::ScanLines;
        header.chunk_count = size.1.div_ceil(compression.scan_lines_per_block());
        Self { header, shares: REC709 }
    }

    /// With the file's own way from colours to luminance and chroma.
    fn written(&self, rgb: impl Fn(usize, usize) -> [f32; 3]) -> Vec<u8> {
        let value = |name: &Text, x: usize, y: usize| {
            let [r, g, b] = rgb(x, y);
            let luminance = r * self.shares[0] + g * self.shares[1] + b * self.shares[2];
            match name.to_string().as_str() {
                _ if r == g && g == b && name != &Text::from("A") => {
                    if name == &Text::from("Y") {
                        g
                    } else {
                        0.0
                    }
                }
                "RY" => (r - luminance) / luminance,
                "BY" => (b - luminance) / luminance,
                "Y" => luminance,
                _ => 0.25,
            }
        };
        let mut bytes = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
        Header::write_all(std::slice::from_ref(&self.header), &mut bytes, false).unwrap();
        let table = bytes.len();
        bytes.resize(table + 8 * self.header.chunk_count, 0);
        let (lines, height) = (self.header.compression.scan_lines_per_block(), self.header.layer_size.y());
        for (i, top) in (0..height).step_by(lines).enumerate() {
            let start = bytes.len() as u64;
            bytes[table + 8 * i..table + 8 * (i + 1)].copy_from_slice(&start.to_le_bytes());
            let packed = self.packed(top..(top + lines).min(height), &value);
            let y_coordinate = self.header.own_attributes.layer_position.y() + top as i32;
            let block = CompressedScanLineBlock { y_coordinate, compressed_pixels_le: packed };
            let chunk = Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(block) };
            chunk.write(&mut bytes, 1).unwrap();
        }
        bytes
    }

    fn packed(&self, lines: std::ops::Range<usize>, value: &impl Fn(&Text, usize, usize) -> f32) -> Vec<u8> {
        let width = self.header.layer_size.x();
        let line = |channel: &ChannelDescription, y: usize| -> Vec<u8> {
            let Vec2(across, down) = channel.sampling;
            let columns = if y.is_multiple_of(down) { width / across } else { 0 };
            let halves = (0..columns).map(|x| f16::from_f32(value(&channel.name, x * across, y)));
            halves.flat_map(f16::to_ne_bytes).collect()
        };
        let channels = &self.header.channels.list;
        if self.header.compression != Compression::B44 {
            let raw = lines.clone().flat_map(|y| channels.iter().flat_map(move |channel| line(channel, y)));
            let place = IntegerBounds::new((0, lines.start as i32), (width, lines.len()));
            return self
                .header
                .compression
                .compress_image_section_to_le(&self.header, raw.collect(), place)
                .unwrap();
        }
        // Channel by channel, as its codec has it.
        let alone = |channel: &ChannelDescription| {
            let Vec2(across, down) = channel.sampling;
            let columns = width / across;
            // Filled up to whole blocks, since the codec writes what does not shrink as it is.
            let size = Vec2(columns.next_multiple_of(4), lines.len() / down);
            let raw = lines.clone().map(|y| line(channel, y)).filter(|line| !line.is_empty()).flat_map(
                |mut line| {
                    let last = line[2 * columns - 2..].repeat(size.x() - columns);
                    line.extend(last);
                    line
                },
            );
            let full = ChannelDescription { sampling: Vec2(1, 1), ..channel.clone() };
            let mut header = Header::new(Text::from("alone"), size, std::iter::once(full).collect());
            header.compression = Compression::B44;
            header.blocks = BlockDescription::ScanLines;
            let place = IntegerBounds::from_dimensions(size);
            header.compression.compress_image_section_to_le(&header, raw.collect(), place).unwrap()
        };
        channels.iter().flat_map(alone).collect()
    }
}

fn decoded(bytes: &[u8]) -> Result<Image, SceneError> {
    let path = Path::new("face.exr");
    guarded(path, || decode(Opened { path, bytes, size: None }))
}

fn told(bytes: &[u8]) -> String {
    decoded(bytes).err().unwrap().to_string()
}

/// Waves of 32 pixels and longer, which are level at the edges of 64 x 48 pixels.
fn smooth(x: usize, y: usize) -> [f32; 3] {
    let wave = |n: f32, i: usize, of: f32| (n * std::f32::consts::PI * (i as f32 + 0.5) / of).cos();
    let (u, v) = (wave(4.0, x, 64.0), wave(2.0, y, 48.0));
    [0.6 + 0.2 * u, 0.4 + 0.1 * u * v, 0.3 + 0.1 * v]
}

/// The greatest error of a channel, of pixels that are so far from the edges.
fn error(image: &Image, margin: usize, rgb: impl Fn(usize, usize) -> [f32; 3]) -> f32 {
    let mut most = 0.0_f32;
    for y in margin..image.height - margin {
        for x in margin..image.width - margin {
            let got = image.rgb[y * image.width + x];
            let off = got.iter().zip(rgb(x, y)).map(|(got, want)| (got - want).abs());
            most = off.fold(most, f32::max);
        }
    }
    most
}

#[test]
fn smooth_colours_come_back_from_a_quarter_of_the_chroma() {
    use Compression::{B44, DWAA, PIZ, RLE, Uncompressed, ZIP1, ZIP16};
    let decoded = |compression, size, sampling| {
        decoded(&File::new(size, compression, sampling).written(smooth)).unwrap()
    };
    let first = decoded(Uncompressed, (64, 48), 2);
    assert_eq!((first.width, first.height), (64, 48));
    assert!(first.alpha.as_ref().unwrap().iter().all(|&alpha| alpha == 0.25));
    // The filter reaches 13 pixels. Within, only the rounding of Y and of chroma to halves is seen, which green has
    // of all three; at the edges the last sample goes on where the waves do not, by a pixel and a half at most.
    let off = [14, 0].map(|margin| error(&first, margin, smooth));
    assert!(off[0] < 2.0 * HALF && off[1] < 0.01, "{off:?}");
    for compression in [RLE, ZIP1, ZIP16, PIZ] {
        assert_eq!(decoded(compression, (64, 48), 2).rgb, first.rgb, "{compression}");
    }
    for compression in [B44, DWAA(None)] {
        let off = error(&decoded(compression, (64, 48), 2), 0, smooth);
        assert!(off < 0.03, "{compression}: {off}");
    }
    // With all chroma only halves remain, and any size will do.
    let off = error(&decoded(ZIP16, (63, 47), 1), 0, smooth);
    assert!(off < 2.0 * HALF, "{off}");
}

#[test]
fn even_colours_come_back_to_the_digits_of_halves_and_grey_exactly() {
    let file = File::new((14, 36), Compression::ZIP16, 2);
    let of = |file: &File, rgb: [f32; 3]| decoded(&file.written(|_, _| rgb)).unwrap().rgb;
    let full = File::new((14, 36), Compression::ZIP16, 1);
    for rgb in [[0.8, 0.4, 0.2], [0.02, 0.7, 0.05], [7.0, 3.0, 90.0]] {
        let (got, want) = (of(&file, rgb), of(&full, rgb)[0]);
        let most = want.into_iter().fold(0.0, f32::max);
        for got in got.iter().flat_map(|got| got.iter().zip(want)).map(|(got, want)| (got - want).abs()) {
            assert!(got < 0.1 * HALF * most, "{rgb:?}: {got}");
        }
    }
    for compression in [Compression::ZIP16, Compression::B44] {
        let grey = of(&File::new((14, 36), compression, 2), [0.5; 3]);
        assert!(grey.iter().all(|&rgb| rgb == [0.5; 3]), "{compression}");
    }
}

#[test]
fn shares_of_luminance_are_those_of_the_chromaticities() {
    let mut file = File::new((64, 48), Compression::ZIP16, 2);
    let xy = exr::meta::attribute::Chromaticities {
        red: Vec2(0.708, 0.292),
        green: Vec2(0.170, 0.797),
        blue: Vec2(0.131, 0.046),
        white: Vec2(0.3127, 0.3290),
    };
    file.shares = [0.262_7, 0.678_0, 0.059_3];
    assert!(error(&decoded(&file.written(smooth)).unwrap(), 14, smooth) > 0.01);
    file.header.shared_attributes.chromaticities = Some(xy);
    let image = decoded(&file.written(smooth)).unwrap();
    assert!(image.chromaticities.is_some() && error(&image, 14, smooth) < 2.0 * HALF);
    file.header.shared_attributes.chromaticities =
        Some(exr::meta::attribute::Chromaticities { white: Vec2(0.3, 0.0), ..xy });
    let told = told(&file.written(smooth));
    assert!(told.contains("a white that is none in its attribute `chromaticities`"), "{told}");
}

#[test]
fn no_radiance_is_negative_where_saturated_meets_dark() {
    let step = |x: usize, y: usize| if x < 33 && y < 21 { [4.0, 0.02, 0.02] } else { [0.01, 0.02, 0.05] };
    let image = decoded(&File::new((64, 48), Compression::ZIP16, 2).written(step)).unwrap();
    assert!(image.rgb.iter().flatten().all(|&value| value >= 0.0));
}

#[test]
fn an_odd_image_holds_an_even_layer() {
    let mut file = File::new((6, 4), Compression::ZIP1, 2);
    file.header.shared_attributes.display_window = IntegerBounds::new((1, 1), (9, 5));
    file.header.own_attributes.layer_position = Vec2(2, 2);
    let image = decoded(&file.written(|_, _| [0.5; 3])).unwrap();
    assert_eq!((image.width, image.height), (9, 5));
    for (i, rgb) in image.rgb.iter().enumerate() {
        let within = (1..7).contains(&(i % 9)) && i / 9 >= 1;
        assert_eq!(*rgb, if within { [0.5; 3] } else { [0.0; 3] }, "pixel {i}");
    }
}

type Change = dyn Fn(&mut Header);

#[test]
fn what_is_not_read_is_told() {
    let even = File::new((8, 8), Compression::ZIP1, 2);
    let with = |change: &Change| {
        let mut file = even.clone();
        change(&mut file.header);
        // Their pixels are not reached.
        file.written(|_, _| [0.5; 3])
    };
    let odd =
        "face.exr: has a sample of the channel BY for 2 x 2 pixels, but 7 x 8 pixels that begin at 0, 0";
    let cases: [(&Change, &str); 6] = [
        (&|header| header.layer_size = Vec2(7, 8), odd),
        (&|header| header.own_attributes.layer_position = Vec2(1, 0), "8 x 8 pixels that begin at 1, 0"),
        (
            &|header| header.channels.list[1].sampling = Vec2(4, 4),
            "a sample of the channel BY for 4 x 4 pixels",
        ),
        (&|header| header.channels.list[3].sampling = Vec2(2, 2), "has fewer pixels of Y than of its image"),
        (&|header| drop(header.channels.list.remove(1)), "(it has A, RY, Y)"),
        (
            &|header| header.channels.list[1].name = Text::from("BZ"),
            "has no channels R, G and B, nor Y, RY and BY",
        ),
    ];
    for (change, want) in cases {
        let told = told(&with(change));
        assert!(told.contains(want), "{told}");
    }
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    for compression in [Compression::Uncompressed, Compression::ZIP16, Compression::PIZ, Compression::B44] {
        let file = File::new((8, 4), compression, 2);
        let bytes = file.written(smooth);
        for length in (0..bytes.len()).step_by(3) {
            assert!(decoded(&bytes[..length]).is_err(), "{compression}, {length} of {} bytes", bytes.len());
        }
        for i in (4..bytes.len()).step_by(2) {
            let mut damaged = bytes.clone();
            damaged[i] ^= 0x55;
            // Read or refused, as it comes.
            drop(decoded(&damaged));
        }
    }
    let bytes = File::new((16, 8), Compression::Uncompressed, 2).written(smooth);
    // The last chunk, of an odd line: 4 bytes of place, 4 of length, 2 of each Y and A.
    let last = bytes.len() - 72;
    let mut twice = bytes.clone();
    twice[last..last + 4].copy_from_slice(&5_i32.to_le_bytes());
    let told = told(&twice);
    assert!(told.contains("face.exr: cannot be read as an EXR file"), "{told}");
    assert!(told.contains("two chunks of one place"), "{told}");
}

//! Tests of OpenEXR files of luminance and chroma.

use std::io::Cursor;
use std::path::Path;

use exr::image::FlatSamples;
use exr::prelude::{AnyChannel, AnyChannels, SmallVec, WritableImage};

use super::Opened;
use super::open_exr::decode;

/// Luminance and chroma, the chroma of half as many pixels a side where `halved` says so.
fn luminance_and_chroma(halved: bool) -> Vec<u8> {
    let channel = |name: &str| AnyChannel::new(name, FlatSamples::F32(vec![0.5; 16]));
    let channels: SmallVec<[_; 4]> = ["Y", "RY", "BY"].into_iter().map(channel).collect();
    let image = exr::image::Image::from_channels((4, 4), AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    let mut bytes = bytes.into_inner();
    for name in [b"RY\0", b"BY\0"] {
        // Behind the name: the kind of number, a flag with three bytes of nothing, and both samplings.
        let at = bytes.windows(3).position(|window| window == name).unwrap();
        if halved {
            bytes[at + 11..at + 15].copy_from_slice(&2_i32.to_le_bytes());
            bytes[at + 15..at + 19].copy_from_slice(&2_i32.to_le_bytes());
        }
    }
    bytes
}

fn told(bytes: &[u8]) -> String {
    decode(Opened { path: Path::new("face.exr"), bytes, size: None }).err().unwrap().to_string()
}

#[test]
fn luminance_and_chroma_are_refused_by_name() {
    let told_of = told(&luminance_and_chroma(true));
    assert!(told_of.contains("face.exr: has channels of fewer pixels than its image"), "{told_of}");
    assert!(told_of.contains("Save it as RGB with all channels at full resolution"), "{told_of}");
    let told_of = told(&luminance_and_chroma(false));
    assert!(told_of.contains("has no channels R, G and B, nor Y (it has BY, RY, Y)"), "{told_of}");
    assert!(told_of.contains("luminance and chroma (Y, RY, BY) as RGB"), "{told_of}");
}

//! DDS (Microsoft, *DDS - Direct3D 11*, "Programming Guide for DDS"): two headers, then the texels.

use super::{Halves, TEXEL};

/// `DDS_HEADER` and its `DDS_PIXELFORMAT` say how long they are.
const HEADER: u32 = 124;
const PIXEL_FORMAT: u32 = 32;
/// `DDSD_CAPS`, `DDSD_HEIGHT`, `DDSD_WIDTH`, `DDSD_PITCH` and `DDSD_PIXELFORMAT`: which of its members count.
const FLAGS: u32 = 0x1 | 0x2 | 0x4 | 0x8 | 0x1000;
/// `DDPF_FOURCC`: the pixel format is told by four letters, and these tell of a second header.
const FOUR_LETTERS: u32 = 0x4;
const SECOND_HEADER: u32 = u32::from_le_bytes(*b"DX10");
/// `DDSCAPS_TEXTURE` and `DDSCAPS_COMPLEX`, which more than one surface is.
const CAPS: u32 = 0x1000 | 0x8;
/// `DDSCAPS2_CUBEMAP` and each of the six faces.
const CAPS_2: u32 = 0x200 | 0xFC00;
/// `DXGI_FORMAT_R16G16B16A16_FLOAT`.
const FORMAT: u32 = 10;
/// `D3D10_RESOURCE_DIMENSION_TEXTURE2D`, which a face is.
const TEXTURE_2D: u32 = 3;
/// `D3D10_RESOURCE_MISC_TEXTURECUBE`.
const CUBE: u32 = 0x4;

/// The file's bytes.
pub(super) fn bytes(of: &Halves) -> Vec<u8> {
    let pitch = of.size * TEXEL as u32;
    // Depth counts for volumes alone; the cube as it is makes one mip level.
    let mut words = vec![HEADER, FLAGS, of.size, of.size, pitch, 0, 1];
    // Reserved.
    words.extend([0; 11]);
    // Bits and masks count for formats without letters alone.
    words.extend([PIXEL_FORMAT, FOUR_LETTERS, SECOND_HEADER, 0, 0, 0, 0, 0]);
    words.extend([CAPS, CAPS_2, 0, 0, 0]);
    // The array counts cubes, not faces. The last says nothing of alpha: older readers refuse a file that does.
    words.extend([FORMAT, TEXTURE_2D, CUBE, of.cubes, 0]);
    let mut file = b"DDS ".to_vec();
    file.extend(words.into_iter().flat_map(u32::to_le_bytes));
    file.extend(&of.bytes);
    file
}

//! KTX 2.0 (Khronos, *KTX File Format Specification*, version 2.0): a header, what its texels are, words about it, texels.
//!
//! All numbers are little-endian (section 1). Nothing is supercompressed, so that a reader copies the level as it is.

use super::{Halves, TEXEL};

/// Section 3.1.
const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";
/// `VK_FORMAT_R16G16B16A16_SFLOAT` (Vulkan 1.3, `VkFormat`).
const FORMAT: u32 = 97;
/// Bytes of a number of a texel (section 3.3).
const TYPE_SIZE: u32 = 2;
const FACES: u32 = 6;
const LEVELS: u32 = 1;
/// The header up to the level index, and one level's entry there (sections 3.1 to 3.9).
const HEADER: usize = 80;
const LEVEL: usize = 24;
/// A level begins at a multiple of its texels' bytes and of 4 (section 3.10, `mipPadding`): 8 is both.
const ALIGNMENT: usize = TEXEL;

/// The file's bytes.
pub(super) fn bytes(of: &Halves, notes: &[(&str, String)]) -> Vec<u8> {
    let (described, words) = (descriptor(), key_values(notes));
    let described_at = HEADER + LEVEL;
    let words_at = described_at + described.len();
    let texels_at = (words_at + words.len()).next_multiple_of(ALIGNMENT);
    let mut file = Vec::with_capacity(texels_at + of.bytes.len());
    file.extend(IDENTIFIER);
    // A layer count of 0 is a cube that is no array (section 3.6).
    let layers = if of.cubes == 1 { 0 } else { of.cubes };
    for number in [FORMAT, TYPE_SIZE, of.size, of.size, 0, layers, FACES, LEVELS, 0] {
        file.extend(number.to_le_bytes());
    }
    for number in [described_at, described.len(), words_at, words.len()] {
        // Some hundreds of bytes in all.
        file.extend((number as u32).to_le_bytes());
    }
    // Nothing is supercompressed: there are no global data of that, and a level is as long as it was.
    for number in [0, 0, texels_at, of.bytes.len(), of.bytes.len()] {
        file.extend((number as u64).to_le_bytes());
    }
    file.extend(described);
    file.extend(words);
    file.resize(texels_at, 0);
    file.extend(&of.bytes);
    file
}

/// What a texel is, as a basic descriptor block (Khronos Data Format Specification 1.3, section 5, "Basic descriptor").
fn descriptor() -> Vec<u8> {
    const CHANNELS: [u32; 4] = [0, 1, 2, 15];
    const BLOCK: u32 = 24 + 16 * CHANNELS.len() as u32;
    /// `KHR_DF_MODEL_RGBSDA`, `KHR_DF_PRIMARIES_BT709`, `KHR_DF_TRANSFER_LINEAR`, alpha that is not multiplied in.
    const COLOR: u32 = 1 | 1 << 8 | 1 << 16;
    /// `KHR_DF_SAMPLE_DATATYPE_FLOAT` and `_SIGNED`, above the channel's own four bits.
    const SIGNED_FLOAT: u32 = 0x80 | 0x40;
    let mut words = vec![4 + BLOCK];
    // The vendor and the kind are 0; version 2 is that of 1.3.
    words.extend([0, 2 | BLOCK << 16, COLOR]);
    // A block of 1 x 1 x 1 x 1 texels, each count less 1; the first plane has all of its bytes.
    words.extend([0, TEXEL as u32, 0]);
    for (place, channel) in (0..).zip(CHANNELS) {
        let (first_bit, bits_less_1) = (16 * place, 15);
        words.push(first_bit | bits_less_1 << 16 | (channel | SIGNED_FLOAT) << 24);
        // At the texel's own place; of floats the range is given as -1 and 1.
        words.extend([0, (-1.0_f32).to_bits(), 1.0_f32.to_bits()]);
    }
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// Words about the file by their names, in these' order (section 3.11, "Key/Value Data").
fn key_values(notes: &[(&str, String)]) -> Vec<u8> {
    let writer = format!("skinfit {}", env!("CARGO_PKG_VERSION"));
    // To the right and down, as faces are in every graphics interface.
    let mut all = vec![("KTXorientation", "rd".to_owned()), ("KTXwriter", writer)];
    all.extend(notes.iter().cloned());
    all.sort_by(|a, b| a.0.cmp(b.0));
    let mut bytes: Vec<u8> = Vec::new();
    for (name, text) in all {
        // Each ends in a 0 byte, which no name or text holds within.
        let pair = [name, &text].map(|word| word.replace('\0', " ") + "\0").concat();
        bytes.extend((pair.len() as u32).to_le_bytes());
        bytes.extend(pair.as_bytes());
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

//! DWA chunks of EXR files, before they are unpacked.

use exr::block::chunk::CompressedBlock;
use exr::compression::Compression;
use exr::meta::MetaData;

use super::sampled;

/// Whether the file's layers have such chunks.
pub(super) fn any(meta: &MetaData) -> bool {
    meta.headers.iter().any(|header| is_dwa(header.compression))
}

const fn is_dwa(compression: Compression) -> bool {
    matches!(compression, Compression::DWAA(_) | Compression::DWAB(_))
}

/// Find what is wrong with chunks that promise more than they can hold: the decoder allocates what their headers say, and
/// memory that cannot be had ends the process. `behind` is what lies behind the file's headers.
pub(super) fn check(meta: &MetaData, behind: &[u8]) -> Result<(), &'static str> {
    let headers = &meta.headers;
    let dwa = headers.iter().filter(|header| is_dwa(header.compression));
    let needed = dwa.map(|header| sampled::bytes_of(&header.channels, header.layer_size, 0));
    let needed = needed.fold(0, u64::saturating_add);
    let mut held = 0_u64;
    // An error is left to the decoder, which meets it too.
    for chunk in sampled::chunks(meta, behind).map_while(Result::ok) {
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
        let top = usize::try_from(place.position.y()).unwrap_or_default();
        let raw = sampled::bytes_of(&header.channels, place.size, top);
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
            return Err("a DWA chunk promises more than it can hold");
        }
        // A DC coefficient stands for 64 samples of at most 4 bytes.
        held = held.saturating_add(words[1] + words[7] + 256 * words[9]);
    }
    if held < needed { Err("its DWA chunks hold less than the image") } else { Ok(()) }
}

//! Baked cubes as texture files that engines and their tools take as they are: `ktx2`, `dds`.
//!
//! Both hold the faces +X -X +Y -Y +Z -Z, each row by row from its top, in the left-handed face coordinates that Vulkan
//! (1.3, "Cube Map Face Selection") and Direct3D 11 (functional specification, section 7.18.11) share and
//! [`face_direction`](crate::model::cube::face_direction) states: nothing is turned or mirrored on the way. Numbers are
//! halves, linear. Of a cube's four numbers all are kept: alpha is what the haze of a mirror lobe reads.
//!
//! Several cubes of one size are an array of cubes, in their order. There are no mip levels: the cubes are filtered
//! already, each for one lobe.

mod dds;
mod ktx2;

use std::path::{Path, PathBuf};

use exr::prelude::f16;

use crate::model::cube::Cube;
use crate::output::{self, OutputError};

/// The largest half. What is larger would become infinite, and what an engine filters of it too.
pub const LARGEST_HALF: f32 = 65504.0;

/// A kind of texture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CubeFormat {
    /// Khronos' KTX 2.0.
    Ktx2,
    /// Microsoft's DDS with a DX10 header.
    Dds,
}

impl CubeFormat {
    /// Every kind.
    pub const ALL: [Self; 2] = [Self::Ktx2, Self::Dds];

    /// Its name, which is the ending of its files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ktx2 => "ktx2",
            Self::Dds => "dds",
        }
    }

    /// The kind of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }
}

/// Cubes could not be written; nothing new stands at the file's path.
#[derive(Debug, thiserror::Error)]
pub enum CubeFileError {
    /// An array holds cubes of one size.
    #[error(
        "{}: cubes of {first} and {other} texels a side cannot stand in one file. Bake them at one size.",
        path.display()
    )]
    Sizes {
        /// The file.
        path: PathBuf,
        /// Texels along a side of the first.
        first: usize,
        /// And of one that differs.
        other: usize,
    },
    /// No cube, or more texels than the file's numbers can count.
    #[error(
        "{}: {cubes} cubes of {size} texels a side cannot be written. Give 1 cube or more, smaller ones if need be.",
        path.display()
    )]
    Extent {
        /// The file.
        path: PathBuf,
        /// How many.
        cubes: usize,
        /// Texels along a side.
        size: usize,
    },
    /// A texel is NaN or infinite.
    #[error(
        "{}: cube {cube}, face {face}: a texel is not a finite number. Look for infinite radiance in the environment.",
        path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Which cube, from 0.
        cube: usize,
        /// Which face, from 0.
        face: usize,
    },
    /// The file system.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Cubes as a file has them.
struct Halves {
    /// Texels along a side.
    size: u32,
    /// How many cubes.
    cubes: u32,
    /// Cube after cube, face after face, row after row: RGBA, each two bytes, the lower first.
    bytes: Vec<u8>,
    /// How many numbers were beyond the range of halves.
    clamped: usize,
}

/// Bytes of a texel.
const TEXEL: usize = 8;

/// Write cubes as one file; several are an array. `notes` are words with a name each, which a KTX2 file keeps and a DDS
/// file has no place for. Returns how many numbers were beyond the range of halves, and are as large as these get.
///
/// # Errors
/// [`CubeFileError`]; the old file, if any, then stays.
pub fn write_cubes(
    path: &Path,
    format: CubeFormat,
    cubes: &[&Cube<f32>],
    notes: &[(&str, String)],
) -> Result<usize, CubeFileError> {
    let halves = halves(path, cubes)?;
    let bytes = match format {
        CubeFormat::Ktx2 => ktx2::bytes(&halves, notes),
        CubeFormat::Dds => dds::bytes(&halves),
    };
    output::write(path, &bytes)?;
    Ok(halves.clamped)
}

fn halves(path: &Path, cubes: &[&Cube<f32>]) -> Result<Halves, CubeFileError> {
    let size = cubes.first().map_or(0, |cube| cube.size());
    if let Some(other) = cubes.iter().map(|cube| cube.size()).find(|&other| other != size) {
        return Err(CubeFileError::Sizes { path: path.to_owned(), first: size, other });
    }
    // Both formats count rows' bytes, cubes and sides in 32 bits.
    let counted = |n: usize| u32::try_from(n).ok().filter(|&n| n > 0 && n < u32::MAX / TEXEL as u32);
    let extent = || CubeFileError::Extent { path: path.to_owned(), cubes: cubes.len(), size };
    let (count, side) = counted(cubes.len()).zip(counted(size)).ok_or_else(extent)?;
    let mut halves = Halves {
        size: side,
        cubes: count,
        bytes: Vec::with_capacity(cubes.len() * 6 * size * size * TEXEL),
        clamped: 0,
    };
    for (cube, of) in cubes.iter().enumerate() {
        for texel in 0..6 * size * size {
            let (face, row, column) = (texel / (size * size), texel / size % size, texel % size);
            let numbers = of.texel(face, column, row);
            if numbers.iter().any(|x| !x.is_finite()) {
                return Err(CubeFileError::NotFinite { path: path.to_owned(), cube, face });
            }
            numbers.into_iter().for_each(|x| halves.put(x));
        }
    }
    Ok(halves)
}

impl Halves {
    fn put(&mut self, x: f32) {
        let held = x.clamp(-LARGEST_HALF, LARGEST_HALF);
        self.clamped += usize::from(held != x);
        self.bytes.extend(f16::from_f32(held).to_bits().to_le_bytes());
    }
}

#[cfg(test)]
mod tests;

//! Bakes kept between runs, found again by a hash of all that they depend on.
//!
//! One file a bake: magic, key, length, checksum, then little-endian f32. A file that is truncated,
//! damaged or not ours is noticed and made anew; a folder that cannot be written costs a warning.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::{files, output};

/// All that makes bakes of their inputs: another text may make others, so that old files are left alone.
const SOURCES: [&str; 34] = [
    include_str!("baker.rs"),
    include_str!("between.rs"),
    include_str!("cache.rs"),
    include_str!("coefficients.rs"),
    include_str!("cutouts.rs"),
    include_str!("gather_cache.rs"),
    include_str!("harmonics.rs"),
    include_str!("interreflection.rs"),
    include_str!("inward.rs"),
    include_str!("lobe_kernel.rs"),
    include_str!("lobe_sky.rs"),
    include_str!("lobes.rs"),
    include_str!("low_discrepancy.rs"),
    include_str!("mod.rs"),
    include_str!("occlusion.rs"),
    include_str!("packet.rs"),
    include_str!("panorama.rs"),
    include_str!("prefilter.rs"),
    include_str!("pyramid.rs"),
    include_str!("radial.rs"),
    include_str!("rays.rs"),
    include_str!("reflected.rs"),
    include_str!("shadowed.rs"),
    include_str!("sky.rs"),
    include_str!("stacks.rs"),
    include_str!("thickness.rs"),
    include_str!("transfer.rs"),
    include_str!("turning.rs"),
    include_str!("vertex_rays.rs"),
    include_str!("wide_bvh.rs"),
    crate::scene::maps::SOURCE,
    crate::scene::plain::SOURCE,
    crate::scene::sky_lights::SOURCE,
    crate::model::cube::SOURCE,
];
const MAGIC: &[u8; 8] = b"SKINBAKE";
const HEADER: usize = MAGIC.len() + 32 + 8 + 32;

/// The folder for bakes: `SKINFIT_CACHE`, else `$XDG_CACHE_HOME/skinfit`, else `~/.cache/skinfit`,
/// else one in the folder for temporary files.
#[must_use]
pub fn default_folder() -> PathBuf {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    variable("SKINFIT_CACHE")
        .or_else(|| variable("XDG_CACHE_HOME").map(|folder| folder.join("skinfit")))
        .or_else(|| variable("HOME").map(|folder| folder.join(".cache/skinfit")))
        .unwrap_or_else(|| std::env::temp_dir().join("skinfit"))
}

/// The hash of a bake's inputs, being fed.
#[derive(Clone)]
pub(super) struct Key(blake3::Hasher);

impl Key {
    /// The key of a kind of bake, without inputs yet.
    pub(super) fn new(kind: &str) -> Self {
        static VERSION: LazyLock<blake3::Hash> = LazyLock::new(|| {
            let mut hasher = blake3::Hasher::new();
            for source in SOURCES {
                hasher.update(source.as_bytes());
            }
            hasher.finalize()
        });
        let mut hasher = blake3::Hasher::new();
        hasher.update(VERSION.as_bytes()).update(kind.as_bytes());
        Self(hasher)
    }

    /// With the bytes of `values`, preceded by how many there are.
    pub(super) fn with<T: bytemuck::NoUninit>(mut self, values: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        self.0.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
        self
    }

    /// The hash of all that it was fed.
    pub(super) fn hash(&self) -> blake3::Hash {
        self.0.finalize()
    }
}

/// What was in the cache.
pub(super) enum Found {
    /// The bake.
    Floats(Vec<f32>),
    /// No file.
    Nothing,
    /// A file that cannot be used, and why.
    Unusable(String),
}

fn path(folder: &Path, kind: &str, key: &Key) -> PathBuf {
    folder.join(format!("{kind}-{}.bake", &key.hash().to_hex()[..32]))
}

/// Read the bake of `key`, which must hold `count` numbers, where that is known.
pub(super) fn read(folder: &Path, kind: &str, key: &Key, count: impl Into<Option<usize>>) -> Found {
    let path = path(folder, kind, key);
    let bytes = match files::read(&path) {
        Ok(bytes) => bytes,
        // A folder that is none will be said when the bake cannot be written there.
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Found::Nothing;
        }
        Err(error) => return Found::Unusable(format!("{}: {error}; baking anew.", path.display())),
    };
    match decode(&bytes, key, count.into()) {
        Ok(floats) => Found::Floats(floats),
        Err(reason) => Found::Unusable(format!("{}: {reason}; baking anew.", path.display())),
    }
}

/// Write the bake of `key`; what went wrong, if anything, is only worth a warning.
pub(super) fn write(folder: &Path, kind: &str, key: &Key, floats: &[f32]) -> Result<(), String> {
    let path = path(folder, kind, key);
    files::note(&path);
    output::write(&path, &encode(key, floats)).map_err(|error| format!("{error} The bake is not kept."))
}

fn encode(key: &Key, floats: &[f32]) -> Vec<u8> {
    let words: Vec<u32> = floats.iter().map(|x| x.to_bits().to_le()).collect();
    let payload: &[u8] = bytemuck::cast_slice(&words);
    let length = (payload.len() as u64).to_le_bytes();
    let checksum = blake3::hash(payload);
    [MAGIC, &key.hash().as_bytes()[..], &length, checksum.as_bytes(), payload].concat()
}

fn decode(bytes: &[u8], key: &Key, count: Option<usize>) -> Result<Vec<f32>, String> {
    let (header, payload) = bytes.split_at_checked(HEADER).ok_or("shorter than its header")?;
    let (magic, header) = header.split_at(MAGIC.len());
    let (stored_key, header) = header.split_at(32);
    let (length, checksum) = header.split_at(8);
    if magic != MAGIC {
        return Err("not a bake of this program".to_owned());
    }
    if stored_key != key.hash().as_bytes() {
        return Err("the bake of other inputs".to_owned());
    }
    let bytes = count.map_or(payload.len() / 4 * 4, |count| 4 * count);
    if length != (payload.len() as u64).to_le_bytes() || payload.len() != bytes {
        return Err(format!("{} bytes of numbers, not {bytes}", payload.len()));
    }
    if checksum != blake3::hash(payload).as_bytes() {
        return Err("damaged: the checksum differs".to_owned());
    }
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(payload);
    Ok(words.into_iter().map(|word| f32::from_bits(u32::from_le(word))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_and_anything_else_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let key = Key::new("cube").with(&[1.5_f32, -2.0]).with(&[7_u32]);
        let floats = [0.0, -1.25, 65504.0, f32::MIN_POSITIVE];
        assert!(matches!(read(folder.path(), "cube", &key, 4), Found::Nothing));
        write(folder.path(), "cube", &key, &floats).unwrap();
        assert!(matches!(read(folder.path(), "cube", &key, 4), Found::Floats(f) if f == floats));
        assert!(matches!(read(folder.path(), "cube", &key, 5), Found::Unusable(_)));
        let file = path(folder.path(), "cube", &key);
        let whole = std::fs::read(&file).unwrap();
        for cut in 0..whole.len() {
            std::fs::write(&file, &whole[..cut]).unwrap();
            assert!(matches!(read(folder.path(), "cube", &key, 4), Found::Unusable(_)), "cut at {cut}");
        }
        for i in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[i] ^= 0x10;
            std::fs::write(&file, &damaged).unwrap();
            assert!(matches!(read(folder.path(), "cube", &key, 4), Found::Unusable(_)), "byte {i}");
        }
    }

    #[test]
    fn keys_differ_with_kind_values_and_how_the_values_are_split() {
        let keys = [
            Key::new("a").with(&[1_u32, 2]),
            Key::new("b").with(&[1_u32, 2]),
            Key::new("a").with(&[1_u32]).with(&[2_u32]),
            Key::new("a").with(&[1_u32, 3]),
        ];
        for i in 0..keys.len() {
            assert!(keys[..i].iter().all(|other| other.hash() != keys[i].hash()));
        }
    }

    #[test]
    fn every_file_that_has_a_part_in_bakes_is_in_their_keys() {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let folder = package.join("bake");
        let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(files.len() > 9, "{files:?}");
        for file in files {
            let text = std::fs::read_to_string(&file).unwrap();
            assert!(SOURCES.contains(&text.as_str()), "{} is missing", file.display());
        }
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_a_warning() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, b"in the way").unwrap();
        let warning = write(&file.join("cache"), "cube", &Key::new("cube"), &[1.0]).unwrap_err();
        assert!(warning.contains("not kept"), "{warning}");
    }
}

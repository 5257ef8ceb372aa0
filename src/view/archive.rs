//! Files in one piece: the scene that a page holds.
//!
//! Of each file the length of its path, the path, the length of its content, the content; lengths are 64 bits, the
//! lowest byte first.

use std::path::{Path, PathBuf};

/// What an archive begins with.
const MAGIC: &[u8; 8] = b"SKINPAGE";

/// The folder of an archive's scenes, in their order; what these are read from lies below it.
pub const SCENES: &str = "/scene";
/// Where it has constants that were fitted, where they are.
pub const FITTED: &str = "/fitted/params.toml";
/// Where it has what a report says of them, where there is one.
pub const REPORT: &str = "/fitted/report.json";
/// Where it has those of a run that is compared.
pub const OTHER: &str = "/other/params.toml";
/// Where it has what a report says of these.
pub const OTHER_REPORT: &str = "/other/report.json";
/// The folder of its bakes.
pub const BAKES: &str = "/bakes";

/// These files in one piece.
#[must_use]
pub fn pack<'a>(files: impl IntoIterator<Item = (&'a Path, &'a [u8])>) -> Vec<u8> {
    let mut packed = MAGIC.to_vec();
    for (path, bytes) in files {
        // As the page's system has them.
        let path = path.to_string_lossy().replace('\\', "/");
        for part in [path.as_bytes(), bytes] {
            packed.extend((part.len() as u64).to_le_bytes());
            packed.extend(part);
        }
    }
    packed
}

/// The files of an archive; `None` of anything else.
#[must_use]
pub fn unpack(packed: &[u8]) -> Option<Vec<(PathBuf, Vec<u8>)>> {
    let mut rest = packed.strip_prefix(MAGIC)?;
    let mut files = Vec::new();
    while !rest.is_empty() {
        let path = std::str::from_utf8(part(&mut rest)?).ok()?;
        files.push((PathBuf::from(path), part(&mut rest)?.to_vec()));
    }
    Some(files)
}

/// The next part of `rest`, which then begins after it.
fn part<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, after) = rest.split_first_chunk::<8>()?;
    let (part, after) = after.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    *rest = after;
    Some(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_is_unpacked_and_nothing_else_is() {
        let files: [(&Path, &[u8]); 3] =
            [(Path::new("/a/b.exr"), b"one"), (Path::new("/c"), b""), (Path::new("/d"), b"\0\x01")];
        let packed = pack(files);
        let unpacked = unpack(&packed).unwrap();
        let same =
            unpacked.iter().zip(files).all(|((path, bytes), (own, content))| path == own && bytes == content);
        assert!(same && unpacked.len() == 3);
        // Whatever is cut off, damages it or ends it before a file.
        for cut in 0..packed.len() {
            assert!(unpack(&packed[..cut]).is_none_or(|files| files.len() < 3), "{cut}");
        }
        assert!(unpack(b"something else").is_none());
    }
}

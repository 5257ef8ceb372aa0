//! Files that are read: on disk, or in memory where a program has no disk, as in a browser. There what is written is kept
//! in memory, too.
//!
//! A program that takes a scene elsewhere asks which files it was read from: [`recorded`].

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Error, ErrorKind};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Files in memory, by their paths without `.` and `..`.
static HELD: Mutex<Option<BTreeMap<PathBuf, Arc<[u8]>>>> = Mutex::new(None);
/// Paths that were read, while somebody asks for them.
static READ: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(None);

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Hold these files in memory, beside those that are held already; from now on no file on disk is read or written.
pub fn hold(files: impl IntoIterator<Item = (PathBuf, Vec<u8>)>) {
    let mut held = locked(&HELD);
    let held = held.get_or_insert_default();
    held.extend(files.into_iter().map(|(path, bytes)| (plain(&path), bytes.into())));
}

/// The whole of a file.
///
/// # Errors
/// When it cannot be read, or is none.
pub fn read(path: &Path) -> Result<Vec<u8>, Error> {
    note(path);
    match &*locked(&HELD) {
        None => std::fs::read(path),
        Some(held) => held.get(&plain(path)).map(|bytes| bytes.to_vec()).ok_or_else(missing),
    }
}

/// The whole of a file of text.
///
/// # Errors
/// As of [`read`], and when it is not UTF-8.
pub fn read_to_string(path: &Path) -> Result<String, Error> {
    let unlike_text = |_| Error::new(ErrorKind::InvalidData, "stream did not contain valid UTF-8");
    String::from_utf8(read(path)?).map_err(unlike_text)
}

/// How many bytes a file has; `None` of what is not a file.
///
/// # Errors
/// When there is nothing of that name.
pub fn length(path: &Path) -> Result<Option<u64>, Error> {
    match &*locked(&HELD) {
        None => std::fs::metadata(path).map(|metadata| metadata.is_file().then_some(metadata.len())),
        Some(held) => held.get(&plain(path)).map(|bytes| Some(bytes.len() as u64)).ok_or_else(missing),
    }
}

/// Keep a file in memory where files are: whether they are.
pub(crate) fn keep(path: &Path, bytes: &[u8]) -> bool {
    let mut held = locked(&HELD);
    held.as_mut().is_some_and(|held| {
        held.insert(plain(path), bytes.into());
        true
    })
}

/// Note that a file was read, or written for a later reader: what is recorded belongs to the scene.
pub fn note(path: &Path) {
    if let Some(read) = &mut *locked(&READ) {
        read.insert(plain(path));
    }
}

/// Do something, and the files that were read for it: absolute paths without `.` and `..`. Of one caller at a time: what
/// other threads read in the meantime is among them.
pub fn recorded<T>(work: impl FnOnce() -> T) -> (T, Vec<PathBuf>) {
    *locked(&READ) = Some(BTreeSet::new());
    let done = work();
    let read = locked(&READ).take().unwrap_or_default();
    (done, read.into_iter().collect())
}

fn missing() -> Error {
    Error::new(ErrorKind::NotFound, "it is not among the files in memory")
}

/// An absolute path without `.` and `..`, by its words alone.
#[must_use]
pub fn plain(path: &Path) -> PathBuf {
    // A browser has no folder that it is in.
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut plain = PathBuf::new();
    for part in whole.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_told_by_its_words() {
        assert_eq!(plain(Path::new("/a/./b/../../c/d.exr")), Path::new("/c/d.exr"));
        assert!(plain(Path::new("x/y")).is_absolute());
    }

    #[test]
    fn what_is_read_is_recorded() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        std::fs::write(&file, "words").unwrap();
        std::fs::create_dir(folder.path().join("b")).unwrap();
        let around = folder.path().join("b/../a");
        let (text, read_from) = recorded(|| read_to_string(&around).unwrap());
        assert_eq!(text, "words");
        assert!(read_from.contains(&plain(&file)), "{read_from:?}");
        assert_eq!(length(&file).unwrap(), Some(5));
        assert_eq!(length(folder.path()).unwrap(), None);
    }
}

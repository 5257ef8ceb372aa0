//! Files that are written whole or not at all: beside their place first, then renamed.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock, RwLockWriteGuard, TryLockError};

use crate::files;

/// A file could not be written; nothing is left where it should have stood.
#[derive(Debug, thiserror::Error)]
#[error(
    "{path}: cannot be written: {reason}. Choose a folder that exists (or can be made), is writable and has room."
)]
pub struct OutputError {
    path: PathBufDisplay,
    reason: String,
}

#[derive(Debug)]
struct PathBufDisplay(PathBuf);

impl std::fmt::Display for PathBufDisplay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.display().fmt(f)
    }
}

impl OutputError {
    /// An error about `path`.
    #[must_use]
    pub fn new(path: &Path, reason: &(impl ToString + ?Sized)) -> Self {
        Self { path: PathBufDisplay(path.to_owned()), reason: reason.to_string() }
    }
}

/// Shared by those who write a file.
static WRITING: RwLock<()> = RwLock::new(());

/// For as long as the guard lives no file is begun: what is there can be removed before the program ends. Nothing while one
/// is being written: a writer may need another's file first, so nobody waits in line here.
#[must_use]
pub fn halt() -> Option<RwLockWriteGuard<'static, ()>> {
    match WRITING.try_write() {
        Ok(guard) => Some(guard),
        Err(TryLockError::Poisoned(guard)) => Some(guard.into_inner()),
        Err(TryLockError::WouldBlock) => None,
    }
}

/// Write a file through `fill`; folders on the way are made.
///
/// # Errors
/// When a folder or the file cannot be made, filled or renamed. The old file, if any, then stays.
pub fn write_with<E: ToString>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut std::fs::File>) -> Result<(), E>,
) -> Result<(), OutputError> {
    let _writing = WRITING.read().unwrap_or_else(PoisonError::into_inner);
    let error = |reason: String| OutputError::new(path, &reason);
    // Through links, so that what they lead to is replaced and not they; what is not there yet is no link.
    let resolved = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let path = resolved.as_path();
    if path.is_dir() {
        return Err(error("a folder stands there".to_owned()));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(folder).map_err(|e| error(e.to_string()))?;
    let beside = if is_special(path) { std::env::temp_dir() } else { folder.to_owned() };
    let mut file = tempfile::Builder::new()
        .prefix(".skinfit-")
        .permissions_like_new_file()
        .tempfile_in(beside)
        .map_err(|e| error(e.to_string()))?;
    let mut writer = BufWriter::new(file.as_file_mut());
    fill(&mut writer).map_err(|e| error(e.to_string()))?;
    writer.flush().map_err(|e| error(e.to_string()))?;
    drop(writer);
    if is_special(path) {
        let mut device =
            std::fs::OpenOptions::new().write(true).open(path).map_err(|e| error(e.to_string()))?;
        let mut filled = file.reopen().map_err(|e| error(e.to_string()))?;
        std::io::copy(&mut filled, &mut device).map_err(|e| error(e.to_string()))?;
        return Ok(());
    }
    file.persist(path).map_err(|e| error(e.error.to_string()))?;
    Ok(())
}

/// Whether `path` is a device, a pipe or the like: renaming onto it would put a file in its place.
fn is_special(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Write `bytes` as a file; folders on the way are made. In memory, where [`files`] are.
///
/// # Errors
/// As [`write_with`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    if files::keep(path, bytes) {
        return Ok(());
    }
    write_with(path, |file| file.write_all(bytes))
}

/// `tempfile` makes files that only their owner can read; a run folder is for others too.
trait PermissionsLikeNewFile {
    fn permissions_like_new_file(&mut self) -> &mut Self;
}

impl PermissionsLikeNewFile for tempfile::Builder<'_, '_> {
    #[cfg(unix)]
    fn permissions_like_new_file(&mut self) -> &mut Self {
        use std::os::unix::fs::PermissionsExt;
        // The process' umask still applies.
        self.permissions(std::fs::Permissions::from_mode(0o666))
    }
    #[cfg(not(unix))]
    fn permissions_like_new_file(&mut self) -> &mut Self {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_device_is_written_to_and_stays_a_device() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        // A pipe stands in for a device: making a device takes privileges.
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        write(&pipe, b"passed on").unwrap();
        assert_eq!(reader.join().unwrap(), b"passed on");
        assert!(std::fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_a_folder_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, to_folder] = ["file", "link", "to_folder"].map(|name| folder.path().join(name));
        write(&file, b"old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        std::os::unix::fs::symlink(folder.path(), &to_folder).unwrap();
        write(&link, b"new").unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), b"new");
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert!(write(&to_folder, b"new").unwrap_err().to_string().contains("a folder stands there"));
        assert!(std::fs::symlink_metadata(&to_folder).unwrap().is_symlink());
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/er/file.txt");
        write(&path, b"old").unwrap();
        let failed = write_with(&path, |file| {
            file.write_all(b"half").map_err(|e| e.to_string())?;
            Err("the disk is full".to_owned())
        });
        assert!(failed.unwrap_err().to_string().contains("the disk is full"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }
}

//! The files that an earlier run of a study left in its folder.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::output::OutputError;
use crate::report::SCENES;

/// What an earlier run says in its `results.json` that it left.
#[derive(Clone, Debug)]
pub struct Leftovers {
    folder: PathBuf,
    files: Vec<String>,
}

impl Leftovers {
    /// Those of `folder`; without a `results.json` of ours nothing there is known to be ours.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        #[derive(serde::Deserialize)]
        struct Earlier {
            files: Vec<String>,
        }
        let earlier = std::fs::read(folder.join("results.json")).ok();
        let earlier = earlier.and_then(|bytes| serde_json::from_slice::<Earlier>(&bytes).ok());
        let mut files = earlier.map(|earlier| earlier.files).unwrap_or_default();
        // A list that was tampered with must not reach beyond the folder, and that of scenes in it.
        let inner = format!("{SCENES}/");
        let own = |name: &str| Path::new(name).file_name().is_some_and(|file| file == name);
        files.retain(|name| own(name.strip_prefix(&inner).unwrap_or(name)));
        Self { folder: folder.to_owned(), files }
    }

    /// Remove what was not `written` anew.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn remove(&self, written: &[String]) -> Result<(), OutputError> {
        for name in self.files.iter().filter(|name| !written.contains(name)) {
            let path = self.folder.join(name);
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(OutputError::new(&path, &error));
                }
                _ => {}
            }
        }
        // Where none is left in it, the folder of scenes goes, too; with anything else in it, it stays.
        if self.files.iter().any(|name| name.starts_with(SCENES)) {
            let _ = std::fs::remove_dir(self.folder.join(SCENES));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_known_to_be_left_over_goes() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("run");
        std::fs::create_dir(&inner).unwrap();
        let names = ["run/old.png", "run/new.png", "run/own.png", "other.png"];
        names.iter().for_each(|name| std::fs::write(folder.path().join(name), b"x").unwrap());
        let list = br#"{"files": ["old.png", "new.png", "gone.png", "../other.png", "..", ""]}"#;
        std::fs::write(inner.join("results.json"), list).unwrap();
        Leftovers::of(&inner).remove(&["new.png".to_owned()]).unwrap();
        let there = names.map(|name| folder.path().join(name).exists());
        assert_eq!(there, [false, true, true, true]);
        assert!(Leftovers::of(folder.path()).files.is_empty());
    }
}

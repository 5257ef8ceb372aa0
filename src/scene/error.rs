//! What the readers refuse, what they mend, and the boundary that no decoder's panic crosses.

use std::cell::Cell;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Once;

use crate::files;

/// An input was refused: which file, where in it, what is wrong, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneError {
    path: PathBuf,
    place: Option<String>,
    what: String,
    remedy: String,
}

impl std::error::Error for SceneError {}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = self.place.as_ref().map_or_else(String::new, |place| format!("{place}: "));
        let Self { path, what, remedy, .. } = self;
        f.write_str(&one_line(&format!("{}: {place}{what}. {remedy}.", path.display())))
    }
}

/// Without line breaks and other control characters: words quote the file, whose own may hold anything, even what a
/// terminal obeys.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

impl SceneError {
    /// An error about the file `path` as a whole; `what` and `remedy` without their final stop.
    #[must_use]
    pub fn new(path: &Path, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { path: path.to_owned(), place: None, what: what.into(), remedy: remedy.into() }
    }

    /// The same error, about `place` in the file (a line, a pixel, a vertex).
    #[must_use]
    pub fn at(self, place: impl Into<String>) -> Self {
        Self { place: Some(place.into()), ..self }
    }

    /// What is wrong, and what to do.
    #[must_use]
    pub fn what(&self) -> String {
        format!("{}. {}", self.what, self.remedy)
    }

    /// The file that was refused.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Something in a file that was mended rather than refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub path: PathBuf,
    /// What was found, and what was done about it.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&one_line(&format!("{}: {}", self.path.display(), self.message)))
    }
}

/// The warnings of one load.
pub(super) type Warnings = Vec<Warning>;

/// Note that something in `path` was mended.
pub(super) fn warn(warnings: &mut Warnings, path: &Path, message: impl Into<String>) {
    warnings.push(Warning { path: path.to_owned(), message: message.into() });
}

/// Run a decoder; should it panic on damaged bytes, say so as an error about `path`.
///
/// Memory that a decoder asks for is bounded by its caller; a panic is all that is left to catch.
pub(super) fn guarded<T>(
    path: &Path,
    decode: impl FnOnce() -> Result<T, SceneError>,
) -> Result<T, SceneError> {
    thread_local!(static QUIET: Cell<bool> = const { Cell::new(false) });
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !QUIET.get() {
                previous(info);
            }
        }));
    });
    let before = QUIET.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(decode));
    QUIET.set(before);
    outcome.unwrap_or_else(|_| {
        Err(SceneError::new(
            path,
            "the decoder gave up on its content, which is damaged or of a rare kind",
            "Write the file anew from its source, or convert it with another program",
        ))
    })
}

/// The whole of a regular file, refused above `limit` bytes.
pub(super) fn read_bytes(path: &Path, limit: u64) -> Result<Vec<u8>, SceneError> {
    let refuse = |what: String, remedy: &str| SceneError::new(path, what, remedy);
    let length = files::length(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => refuse(
            "there is no such file".into(),
            "Correct the path (a path in a scene file is relative to that file)",
        ),
        _ => refuse(format!("cannot be read: {e}"), "Check the path and its permissions"),
    })?;
    let Some(size) = length else {
        return Err(refuse("is not a file".into(), "Name a file, not a folder or a device"));
    };
    if size > limit {
        return Err(refuse(
            format!("has {size} bytes, more than the {limit} that are read"),
            "Use a smaller file",
        ));
    }
    files::read(path)
        .map_err(|e| refuse(format!("cannot be read: {e}"), "Check the path and its permissions"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_a_file_neither_break_the_paragraph_nor_reach_the_terminal() {
        let error = SceneError::new(Path::new("a\tb.toml"), "unknown key `a\nb\u{1b}[2J`", "Leave it out")
            .at("line\r1");
        assert_eq!(error.to_string(), "a b.toml: line 1: unknown key `a b [2J`. Leave it out.");
        let warning = Warning { path: "a.glb".into(), message: "mesh `a\nb`".to_owned() };
        assert_eq!(warning.to_string(), "a.glb: mesh `a b`");
    }

    #[test]
    fn a_panicking_decoder_is_an_error_and_later_panics_are_heard_again() {
        let error = guarded::<()>(Path::new("a.exr"), || panic!("out of range")).unwrap_err();
        assert!(error.to_string().starts_with("a.exr: the decoder gave up"));
        assert_eq!(guarded(Path::new("a.exr"), || Ok(1)), Ok(1));
    }
}

//! Where the tests find the material that they compare with, and how they say that a test was left out.

use std::io::Write;
use std::path::{Path, PathBuf};

/// Say why the running test checks nothing, past the test runner, which keeps a passing test's output to itself.
pub(crate) fn not_checked(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    // Nothing can be done where standard error is closed.
    let _ = writeln!(std::io::stderr(), "NOT CHECKED: {test}: {why}");
}

/// The folder that an environment variable names.
fn named_by(variable: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(std::env::var_os(variable)?);
    assert!(folder.is_dir(), "{variable} is set to {}, which is not there", folder.display());
    Some(folder)
}

/// The conformance vectors of the independent oracle: the project's own, or those of `SKINFIT_VECTORS`.
pub(crate) fn vectors() -> PathBuf {
    named_by("SKINFIT_VECTORS").unwrap_or_else(own_vectors)
}

/// The project's own vectors.
pub(crate) fn own_vectors() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors")
}

/// Those of light, specular and diffusion: the project's own, or those of `SKINFIT_VECTORS_LIGHT`.
pub(crate) fn vectors_light() -> PathBuf {
    named_by("SKINFIT_VECTORS_LIGHT").unwrap_or_else(own_vectors_light)
}

/// The project's own.
pub(crate) fn own_vectors_light() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors_light")
}

/// The real scenes, environments and meshes: too large for the project, in `../shared/data` or where `SKINFIT_DATA`
/// says. `None`, and said so, where they are missing and `SKINFIT_NO_DATA_TESTS` allows it.
pub(crate) fn data() -> Option<PathBuf> {
    if let Some(folder) = named_by("SKINFIT_DATA") {
        return Some(folder);
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if folder.is_dir() {
        return Some(folder);
    }
    let missing = format!("the real scenes are not in {}", folder.display());
    assert!(
        std::env::var_os("SKINFIT_NO_DATA_TESTS").is_some(),
        "{missing}. SKINFIT_DATA names the folder that holds them; SKINFIT_NO_DATA_TESTS=1 leaves these tests out."
    );
    not_checked(&format!("{missing}, and SKINFIT_NO_DATA_TESTS is set"));
    None
}

//! Where the tests find material that is not part of the project, and how they say it is missing.

use std::path::{Path, PathBuf};

/// The folder `name` of the shared material beside the project (`../shared/<name>`), or wherever
/// the environment variable `variable` says; `None`, said on standard error, when it is not there.
pub(crate) fn shared(name: &str, variable: &str) -> Option<PathBuf> {
    let given = std::env::var_os(variable).map(PathBuf::from);
    if let Some(folder) = given {
        assert!(folder.is_dir(), "{variable} is set to {}, which is not there", folder.display());
        return Some(folder);
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("NOT CHECKED: {} is not there (set {variable} to a folder that holds it)", folder.display());
    None
}

/// The real scenes, environments and meshes.
pub(crate) fn data() -> Option<PathBuf> {
    shared("data", "SKINFIT_DATA")
}

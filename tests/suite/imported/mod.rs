//! Cameras of Metashape and calibrations of OpenCV: they project as their sources do.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

pub(crate) mod metashape;
pub(crate) mod opencv;

use std::path::PathBuf;

use glam::DVec3;

/// Points before a camera that looks along +Z.
fn points() -> impl Iterator<Item = DVec3> {
    (-4..=4).flat_map(|i| (-4..=4).map(move |j| DVec3::new(0.1 * f64::from(i), 0.08 * f64::from(j), 1.3)))
}

fn near([x, y]: [f64; 2], [wx, wy]: [f64; 2], what: &str) {
    // Roundings of f64 in numbers up to some thousands.
    crate::figures::measured("imported projection", (x - wx).hypot(y - wy));
    assert!((x - wx).hypot(y - wy) < 1e-9, "{what}: {x} {y}, not {wx} {wy}");
}

/// A file in a folder of its own.
struct File {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

impl File {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Self { _folder: folder, path }
    }
}

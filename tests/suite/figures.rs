//! Numbers that tests measure and pages quote.

use std::io::Write as _;

/// Write a measured number to the file that `SKINFIT_FIGURES` names, if it is set: `experiments/figures` makes
/// docs/accuracy.json of them, with the least and the greatest of those of one name.
pub(crate) fn measured(name: &str, value: impl Into<f64>) {
    let Some(path) = std::env::var_os("SKINFIT_FIGURES") else { return };
    let line = format!("{}\n", serde_json::json!({ "name": name, "value": value.into() }));
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(path).unwrap();
    // In one piece, as tests run beside each other.
    file.write_all(line.as_bytes()).unwrap();
}

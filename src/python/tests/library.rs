//! The library that Python loads is there, under the name that Python looks for. That this test asks for it makes
//! `cargo test --workspace` build it, beside everything else and of the same parts.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};

#[test]
fn the_library_has_the_entry_that_python_looks_for() {
    let program = std::env::current_exe().unwrap();
    let file = program.with_file_name(format!("{DLL_PREFIX}skinfit_python{DLL_SUFFIX}"));
    let library = std::fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let entry = b"PyInit__native";
    assert!(library.windows(entry.len()).any(|bytes| bytes == entry), "{}", file.display());
}

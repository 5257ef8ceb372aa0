//! The page's scene, as files in memory.

use std::path::PathBuf;

use js_sys::{Reflect, global};
use skinfit_core::files;
use skinfit_core::shader::term::library;
use skinfit_view::archive::{BAKES, FITTED, REPORT, SCENE, unpack};
use skinfit_view::opened::Reading;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    /// The browser's console, where a fault of skinfit's is told.
    #[wasm_bindgen(js_namespace = console)]
    fn error(words: &str);
}

/// What the page holds.
pub(crate) struct Held {
    /// Whether there are fitted constants.
    pub(crate) fitted: bool,
    /// Whether there is a report of them.
    pub(crate) report: bool,
}

/// Hold an archive's files.
///
/// # Errors
/// When it is none.
pub(crate) fn hold(archive: &[u8]) -> Result<Held, String> {
    library::register_all();
    std::panic::set_hook(Box::new(|panic| {
        let words = panic.to_string();
        error(&words);
        // For the worker's script, whose own error says that the library has ended, and no more.
        let _ = Reflect::set(&global(), &"fault".into(), &words.into());
    }));
    let files = unpack(archive).ok_or("the page's scene is damaged. Write the page anew.")?;
    let has = |name: &str| files.iter().any(|(path, _)| path.as_os_str() == name);
    let held = Held { fitted: has(FITTED), report: has(REPORT) };
    files::hold(files);
    Ok(held)
}

/// How the scene is read.
pub(crate) fn reading() -> Reading {
    Reading { scene: PathBuf::from(SCENE), cache: Some(PathBuf::from(BAKES)), ..Reading::default() }
}

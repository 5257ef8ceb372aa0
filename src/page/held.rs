//! The page's scenes, as files in memory.

use std::path::{Path, PathBuf};

use js_sys::{Reflect, global};
use skinfit_core::files;
use skinfit_core::shader::term::library;
use skinfit_view::Run;
use skinfit_view::archive::{BAKES, FITTED, OTHER, OTHER_REPORT, REPORT, SCENES, unpack};
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
    /// Its scenes, in their order.
    scenes: Vec<PathBuf>,
    /// What a fit of them has left, where it has.
    pub(crate) fitted: Option<Run>,
    /// The same of a run that is compared.
    pub(crate) other: Option<Run>,
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
    let run = |params: &str, report: &str| {
        let report = has(report).then(|| PathBuf::from(report));
        has(params).then(|| Run { params: PathBuf::from(params), report })
    };
    let is_scene = |path: &&PathBuf| {
        path.parent() == Some(Path::new(SCENES)) && path.extension().is_some_and(|ending| ending == "toml")
    };
    let scenes = files.iter().map(|(path, _)| path).filter(is_scene).cloned().collect();
    let held = Held { scenes, fitted: run(FITTED, REPORT), other: run(OTHER, OTHER_REPORT) };
    files::hold(files);
    Ok(held)
}

impl Held {
    /// How the scenes are read.
    pub(crate) fn readings(&self) -> Vec<Reading> {
        let cache = Some(PathBuf::from(BAKES));
        let reading =
            |scene: &PathBuf| Reading { scene: scene.clone(), cache: cache.clone(), ..Reading::default() };
        self.scenes.iter().map(reading).collect()
    }
}

//! Constants and scenes as files.

use std::path::Path;

use skinfit_core::output;

use super::Session;
use crate::fit::params_file::{Origin, ParamsFile};
use crate::scene::view::View;

impl Session {
    /// Take the constants of a `params.toml`: a step of the history.
    pub fn load_params(&mut self, file: &Path) {
        if let (Some(opened), Some(history), None) = (&self.opened, &mut self.values, &self.fitting) {
            let scene = &opened.baked.scene;
            match ParamsFile::read(file, scene.form, &history.now().params) {
                Ok(read) => {
                    let read = read.of_scene(&scene.path);
                    let views = opened.views();
                    history.edit(|values| {
                        take_gains(&read, views, &mut values.gains);
                        values.params = read.params;
                    });
                }
                Err(error) => self.told.push(error.to_string()),
            }
        }
    }

    /// The constants as a `params.toml` has them.
    #[must_use]
    pub fn params_text(&self) -> Option<String> {
        let (opened, values) = (self.opened.as_ref()?, self.values()?);
        let scene = &opened.baked.scene;
        let names = scene.views.iter().map(|view| view.name.clone());
        let saved = ParamsFile {
            form: scene.form,
            effects: Some(values.effects),
            loss: None,
            params: values.params.clone(),
            gains: names.zip(values.gains.iter().copied()).collect(),
            scenes: Vec::new(),
        };
        Some(saved.to_toml(Origin { scene: &scene.path, outcome: None, set: &[], numbers: &[] }))
    }

    /// Leave the constants as a `params.toml`.
    pub fn save_params(&mut self, file: &Path) {
        let Some(text) = self.params_text() else { return };
        self.told.push(match output::write(file, text.as_bytes()) {
            Ok(()) => format!("wrote {}", file.display()),
            Err(error) => error.to_string(),
        });
    }

    /// Leave the scene with the window's values as a scene file.
    pub fn save_scene(&mut self, file: &Path) {
        let (Some(opened), Some(values)) = (&self.opened, &self.values) else { return };
        let done = self.host.save_scene(opened.path(), values.now(), file);
        self.told.push(match done {
            Ok(()) => format!("wrote {}", file.display()),
            Err(error) => error,
        });
    }
}

/// Take a file's factors on views, by their names.
pub(super) fn take_gains(file: &ParamsFile, views: &[View], gains: &mut [f64]) {
    for (name, gain) in &file.gains {
        let place = views.iter().position(|view| view.name == *name);
        if let Some(own) = place.and_then(|place| gains.get_mut(place)) {
            *own = *gain;
        }
    }
}

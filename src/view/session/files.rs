//! Constants and scenes as files.

use std::path::Path;

use super::Session;
use crate::fit::params_file::{Origin, ParamsFile};

impl Session {
    /// Take the constants of a `params.toml`: a step of the history.
    pub fn load_params(&mut self, file: &Path) {
        if let (Some(opened), Some(history), None) = (&self.opened, &mut self.values, &self.fitting) {
            let scene = &opened.baked.scene;
            match ParamsFile::read(file, scene.form, &history.now().params) {
                Ok(read) => {
                    let read = read.of_scene(&scene.path);
                    let names: Vec<String> = opened.views().iter().map(|view| view.name.clone()).collect();
                    history.edit(|values| {
                        values.params = read.params;
                        for (name, gain) in &read.gains {
                            let place = names.iter().position(|other| other == name);
                            if let Some(own) = place.and_then(|place| values.gains.get_mut(place)) {
                                *own = *gain;
                            }
                        }
                    });
                }
                Err(error) => self.told.push(error.to_string()),
            }
        }
    }

    /// Leave the constants as a `params.toml`.
    pub fn save_params(&mut self, file: &Path) {
        let (Some(opened), Some(values)) = (&self.opened, self.values()) else { return };
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
        let origin = Origin { scene: &scene.path, outcome: None, set: &[], numbers: &[] };
        let done = saved.write(file, origin);
        self.told.push(match done {
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

//! Constants and scenes as files.

use std::path::Path;
use std::sync::Arc;

use skinfit_core::output;

use super::Session;
use crate::engine::Point;
use crate::fit::params_file::{Origin, ParamsFile, ParamsFileError, SceneValues};
use crate::model::params::Param;
use crate::opened::Opened;
use crate::scene::view::View;
use crate::values::Values;

impl Session {
    /// Take the constants of a `params.toml`: a step of the history.
    pub fn load_params(&mut self, file: &Path) {
        let Some(history) = self.values.as_mut().filter(|_| self.fitting.is_none()) else { return };
        let read = |(opened, values): (&Arc<Opened>, &Values)| {
            let scene = &opened.baked.scene;
            let read = ParamsFile::read(file, scene.form, &values.params)?.of_scene(&scene.path);
            let mut gains = values.gains.clone();
            take_gains(&read, opened.views(), &mut gains);
            Ok(Point { params: read.params, gains })
        };
        let points: Result<Vec<Point>, ParamsFileError> =
            self.scenes.iter().zip(history.now().scenes()).map(read).collect();
        match points {
            Ok(points) => history.edit(|values| values.set_points(&points)),
            Err(error) => self.told.push(error.to_string()),
        }
    }

    /// The constants as a `params.toml` has them.
    #[must_use]
    pub fn params_text(&self) -> Option<String> {
        let values = self.values.as_ref()?.now().scenes();
        let (first, several) = (values.first()?, values.len() > 1);
        let own = |(opened, own): (&Arc<Opened>, &Values)| SceneValues {
            name: opened.name.clone(),
            effects: Some(own.effects).filter(|effects| *effects != first.effects),
            params: own_params(own),
            gains: gains(opened, own),
        };
        let scenes = self.scenes.iter().zip(values);
        let saved = ParamsFile {
            form: first.form,
            effects: Some(first.effects),
            loss: None,
            params: first.params.clone(),
            gains: if several { Vec::new() } else { scenes.clone().flat_map(|(o, v)| gains(o, v)).collect() },
            scenes: if several { scenes.map(own).collect() } else { Vec::new() },
        };
        let paths: Vec<String> =
            self.scenes.iter().map(|opened| opened.path().display().to_string()).collect();
        let paths = paths.join(", ");
        let origin = Origin { scene: Path::new(&paths), outcome: None, set: &[], numbers: &[] };
        Some(saved.to_toml(origin))
    }

    /// Leave the constants as a `params.toml`.
    pub fn save_params(&mut self, file: &Path) {
        let Some(text) = self.params_text() else { return };
        let file = file.to_owned();
        self.aside(move || match output::write(&file, text.as_bytes()) {
            Ok(()) => format!("wrote {}", file.display()),
            Err(error) => error.to_string(),
        });
    }

    /// Leave the scene that is looked at with the window's values as a scene file.
    pub fn save_scene(&mut self, file: &Path) {
        let (Some(opened), Some(values)) = (self.opened(), self.values()) else { return };
        let (scene, values, file) = (opened.path().to_owned(), values.clone(), file.to_owned());
        let host = Arc::clone(&self.host);
        self.aside(move || match host.save_scene(&scene, &values, &file) {
            Ok(()) => format!("wrote {}", file.display()),
            Err(error) => error,
        });
    }
}

/// What a scene has of its own, as far as it is nobody's to give elsewhere.
fn own_params(values: &Values) -> Vec<(Param, [f64; 3])> {
    let free = |param: Param| values.free.iter().any(|column| column.param == param);
    let given = |param: Param| param.info().held || (param.info().found && !free(param));
    let own = Param::of(values.effects).filter(|param| param.is_of_scene() && !given(*param));
    own.map(|param| (param, values.params.rgb(param))).collect()
}

fn gains(opened: &Opened, values: &Values) -> Vec<(String, f64)> {
    let names = opened.views().iter().map(|view| view.name.clone());
    names.zip(values.gains.iter().copied()).collect()
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

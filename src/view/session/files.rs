//! Constants and scenes as files.

use std::path::Path;
use std::sync::Arc;

use skinfit_core::output;

use super::Session;
use crate::engine::Point;
use crate::fit::params_file::ParamsFileError;
use crate::opened::Opened;
use crate::skin::params_text;
use crate::values::Values;

impl Session {
    /// Take the constants of a `params.toml`: a step of the history.
    pub fn load_params(&mut self, file: &Path) {
        let Some(history) = self.values.as_mut().filter(|_| self.fitting.is_none()) else { return };
        let read = |(opened, values): (&Arc<Opened>, &Values)| opened.point_in(file, Some(values));
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
        let scenes: Vec<&Opened> = self.scenes.iter().map(|opened| &**opened).collect();
        let paths: Vec<String> = scenes.iter().map(|opened| opened.path().display().to_string()).collect();
        params_text(self.values.as_ref()?.now().scenes(), &scenes, &paths.join(", "), false)
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

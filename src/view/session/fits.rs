//! The fit that runs beside the window, and what it has found.

use std::sync::Arc;

use super::Session;
use crate::fit::outcome::Ending;
use crate::fitting::{Fitting, Message};
use crate::host::{FitRequest, FitScene, Fitted};

impl Session {
    /// Fit from where the sliders stand; `resume`: go on with the fit that was stopped.
    pub fn begin_fit(&mut self, resume: bool) {
        if self.is_opening() {
            self.told.push("the scene is being read: fit once it is there.".to_owned());
            return;
        }
        self.settle();
        let (Some(values), Some(start), None) = (&self.values, self.params_text(), &self.fitting) else {
            return;
        };
        let scenes = self.scenes.iter().zip(values.now().scenes());
        let scenes = scenes.map(|(opened, values)| FitScene {
            name: opened.name.clone(),
            path: opened.path().to_owned(),
            values: values.clone(),
        });
        let run = self.start.run.clone();
        let request = FitRequest { scenes: scenes.collect(), start, run, resume };
        if !resume || self.path_of != self.start.run {
            self.path.clear();
        }
        self.path_of.clone_from(&self.start.run);
        self.fitting = Some(Fitting::begin(&self.host, request, Arc::clone(&self.wake)));
    }

    /// Have the fit wait after the iteration that it is at, or go on.
    pub fn toggle_pause(&mut self) {
        if let Some(fitting) = &mut self.fitting {
            fitting.set_paused(!fitting.is_paused());
        }
    }

    /// Have it end soon, with what it has found.
    pub fn stop_fit(&mut self) {
        if let Some(fitting) = &mut self.fitting {
            fitting.stop();
        }
    }

    /// Take in what the fit has said.
    pub(super) fn follow_fit(&mut self) {
        let Some(fitting) = &self.fitting else { return };
        for message in fitting.messages() {
            match message {
                Message::Step(step) => {
                    let scenes = self.scenes.iter().map(|opened| &**opened);
                    if let Some(history) = &mut self.values {
                        history.drag(|values| values.take(&step.points, scenes));
                    }
                    // What was known was of another fit.
                    (self.found, self.scores) = (None, Vec::new());
                    self.path.push(*step);
                }
                Message::Done(done) => {
                    self.fitting = None;
                    match *done {
                        Ok(fitted) => self.fitted_to(fitted),
                        Err(error) => self.told.push(error),
                    }
                    if let Some(history) = &mut self.values {
                        history.settle();
                    }
                    return;
                }
            }
        }
    }

    fn fitted_to(&mut self, Fitted { found, views }: Fitted) {
        self.scores = self.in_order(views);
        let scenes = self.scenes.iter().map(|opened| &**opened);
        if let Some(history) = &mut self.values {
            history.drag(|values| values.take(&found.ends, scenes));
            self.fitted = Some(history.now().points());
        }
        if found.ending != Ending::Converged {
            self.told.push(format!(
                "the fit {}.",
                match found.ending {
                    Ending::Interrupted => "was stopped",
                    ending => ending.words(),
                }
            ));
        }
        self.found = Some(found);
    }
}

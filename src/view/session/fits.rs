//! The fit that runs beside the window, and what it has found.

use std::sync::Arc;

use super::Session;
use crate::fit::outcome::Ending;
use crate::fitting::{Fitting, Message};
use crate::host::{FitRequest, Fitted};

impl Session {
    /// Fit from where the sliders stand; `resume`: go on with the fit that was stopped.
    pub fn begin_fit(&mut self, resume: bool) {
        let (Some(opened), Some(values), None) = (&self.opened, &mut self.values, &self.fitting) else {
            return;
        };
        values.settle();
        let request = FitRequest {
            scene: opened.path().to_owned(),
            values: values.now().clone(),
            run: self.start.run.clone(),
            resume,
        };
        if !resume {
            self.path.clear();
        }
        self.fitting = Some(Fitting::begin(&self.host, request, Arc::clone(&self.wake)));
    }

    /// Take in what the fit has said.
    pub(super) fn follow_fit(&mut self) {
        let Some(fitting) = &self.fitting else { return };
        for message in fitting.messages() {
            match message {
                Message::Step(step) => {
                    if let (Some(history), Some(opened)) = (&mut self.values, &self.opened) {
                        history.drag(|values| values.take(&step.point, opened.views()));
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
        self.scores = views;
        if let (Some(history), Some(opened)) = (&mut self.values, &self.opened) {
            history.drag(|values| values.take(&found.end, opened.views()));
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
        self.fitted = Some(found.end.params.clone());
        self.found = Some(found);
    }
}

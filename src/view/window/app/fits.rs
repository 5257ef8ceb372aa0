//! The panel below: a fit's buttons, its run folder, the views that it sees, and how it goes.

use std::path::PathBuf;

use eframe::egui::{self, Ui};

use super::Window;
use crate::fitting::Fitting;
use crate::host::ViewScore;
use crate::window::curves;
use crate::window::keys::Action;

impl Window {
    pub(super) fn fit(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            let paused = self.session.fitting().map(Fitting::is_paused);
            let idle = paused.is_none() && self.session.opened().is_some() && !self.session.is_opening();
            for (enabled, words, action) in [
                (idle, "fit", Action::Fit),
                (idle, "resume", Action::Resume),
                (paused.is_some(), if paused == Some(true) { "go on" } else { "pause" }, Action::Pause),
                (paused.is_some(), "stop", Action::Stop),
            ] {
                if ui.add_enabled(enabled, egui::Button::new(words)).clicked() {
                    self.act(action, ui.ctx());
                }
            }
            ui.label("run folder");
            let field = egui::TextEdit::singleline(&mut self.run).desired_width(180.0);
            if ui.add_enabled(idle, field).accessible_name("run folder").changed() {
                self.session.set_run_folder(PathBuf::from(&self.run));
            }
            self.held_out(ui, idle);
            if let Some(found) = self.session.found() {
                ui.strong(found.ending.words());
                ui.label(format!(
                    "loss {:.6e}, {} iterations, {} passes, {:.2} s",
                    found.loss, found.iterations, found.evaluations, found.seconds
                ));
            } else if let Some(step) = self.session.path().last().filter(|_| !idle) {
                ui.label(format!("iteration {}, loss {:.6e}", step.iteration.iteration, step.iteration.loss));
            }
        });
        if !self.session.scores().is_empty() {
            ui.horizontal_wrapped(|ui| {
                for score in self.session.scores() {
                    let ViewScore { view, held_out, psnr, ssim, flip } = score;
                    let seen = if *held_out { " (held out)" } else { "" };
                    ui.label(format!("{view}{seen}: {psnr:.2} dB, SSIM {ssim:.4}, FLIP {flip:.4}"));
                    ui.separator();
                }
            });
        }
        let free = self.session.values().map(|values| values.free.clone()).unwrap_or_default();
        let height = (ui.available_height() - 4.0).max(60.0);
        let ways = curves::Ways { path: self.session.path(), scene: self.session.scene(), free: &free };
        curves::show(ui, &self.session.losses(), ways, height);
        // The panel stays as high as it was made.
        ui.take_available_space();
    }

    /// Which views a fit leaves out.
    fn held_out(&mut self, ui: &mut Ui, idle: bool) {
        ui.separator();
        ui.label("fitted views");
        let places = self.session.places().into_iter().enumerate();
        for (i, place) in places.filter(|(_, place)| place.target).collect::<Vec<_>>() {
            let mut fitted = place.fitted;
            let name = format!("fit view {}", place.name);
            let box_ = egui::Checkbox::new(&mut fitted, &place.name);
            if ui.add_enabled(idle, box_).accessible_name(name).changed() {
                self.session.set_fitted(i, fitted);
            }
        }
        ui.separator();
    }
}

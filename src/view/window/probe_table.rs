//! The probe's table.

use eframe::egui::{self, Ui};

use crate::paint::Slot;
use crate::probe::rows;
use crate::session::Session;

/// The table of a pixel.
pub(crate) fn show(ui: &mut Ui, session: &Session, error_of: Slot, pixel: Option<[u32; 2]>) {
    ui.strong("Probe");
    let Some(pixel) = pixel else {
        ui.weak("Point at an image: linear radiance of all panes, red, green and blue.");
        return;
    };
    egui::Grid::new("probe").num_columns(2).striped(true).show(ui, |ui| {
        for (name, value) in rows(session, error_of, pixel) {
            ui.label(name);
            ui.monospace(value);
            ui.end_row();
        }
    });
}

//! All constants and scores side by side.

use eframe::egui::{self, Ui};

use crate::session::Session;
use crate::table::{Table, constants, scores};

/// Both tables.
pub(crate) fn show(ui: &mut Ui, session: &Session) {
    grid(ui, "constants", &constants(session));
    ui.separator();
    grid(ui, "scores", &scores(session));
}

fn grid(ui: &mut Ui, name: &str, table: &Table) {
    egui::Grid::new(name).num_columns(table.heads.len()).striped(true).show(ui, |ui| {
        for head in &table.heads {
            ui.strong(*head);
        }
        ui.end_row();
        for row in &table.rows {
            for (i, words) in row.iter().enumerate() {
                if i == 0 {
                    ui.label(words)
                } else {
                    ui.monospace(words)
                };
            }
            ui.end_row();
        }
    });
}

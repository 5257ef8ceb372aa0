//! All constants side by side: where the sliders began, where they stand, the last fit's and the compared run's with their
//! errors; and how good these two are.

use eframe::egui::{self, Ui};

use crate::host::{Found, ViewScore};
use crate::model::params::{Column, Params};
use crate::session::Session;

/// The table.
pub(crate) fn show(ui: &mut Ui, session: &Session) {
    let (Some(values), Some(first)) = (session.values(), session.first()) else { return };
    let others =
        [(session.fitted(), session.found()), (session.other(), session.other_fit().map(|fit| &fit.found))];
    let columns = values.rows().into_iter().flat_map(|param| {
        let coloured = |params: &Params| {
            let rgb = params.rgb(param);
            rgb != [rgb[0]; 3]
        };
        let apart = values.by_channel(param) || others.iter().any(|(params, _)| params.is_some_and(coloured));
        if apart { Column::per_channel(param).to_vec() } else { vec![Column::tied(param)] }
    });
    egui::Grid::new("constants").num_columns(7).striped(true).show(ui, |ui| {
        for head in ["constant", "start", "now", "fit", "±", "other run", "±"] {
            ui.strong(head);
        }
        ui.end_row();
        for column in columns {
            ui.label(column.name());
            number(ui, Some(column.get(&first.params)));
            number(ui, Some(column.get(&values.params)));
            for (params, found) in others {
                number(ui, params.map(|params| column.get(params)));
                ui.weak(error(found, column).map_or_else(String::new, |error| format!("{error:.1e}")));
            }
            ui.end_row();
        }
    });
    let views = session.opened().map(|opened| opened.views()).unwrap_or_default();
    let other = session.other_fit().map_or(&[][..], |fit| &fit.views);
    ui.separator();
    egui::Grid::new("scores").num_columns(5).striped(true).show(ui, |ui| {
        for head in ["view", "fit, dB", "FLIP", "other run, dB", "FLIP"] {
            ui.strong(head);
        }
        ui.end_row();
        for view in views.iter().filter(|view| view.target.is_some()) {
            ui.label(&view.name);
            for scores in [session.scores(), other] {
                let score = scores.iter().find(|score| score.view == view.name);
                let words = |of: fn(&ViewScore) -> String| score.map_or_else(|| "-".to_owned(), of);
                ui.monospace(words(|score| format!("{:.2}", score.psnr)));
                ui.monospace(words(|score| format!("{:.4}", score.flip)));
            }
            ui.end_row();
        }
    });
}

fn number(ui: &mut Ui, value: Option<f64>) {
    ui.monospace(value.map_or_else(|| "-".to_owned(), |value| format!("{value:.5}")));
}

fn error(found: Option<&Found>, column: Column) -> Option<f64> {
    found?.constant(&column.name())?.std_error
}

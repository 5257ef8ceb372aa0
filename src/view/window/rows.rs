//! Parameters: a row each.

use eframe::egui::{self, Response, RichText, Slider, SliderClamping, Ui};

use crate::model::params::{Channels, Column, Param, Scale};
use crate::session::Session;
use crate::values::{Freedom, Values};

/// A change that a row asks for.
enum Edit {
    /// A value, as part of a drag.
    Value(Column, f64),
    /// All channels, as a step.
    Reset(Param, [f64; 3]),
    Freedom(Param, Freedom),
    /// A value for each channel, or one for all.
    Apart(Param, bool),
    /// A drag is over.
    Settled,
}

/// Every parameter that the enabled effects ask for.
pub(crate) fn show(ui: &mut Ui, session: &mut Session) {
    let (Some(values), Some(first)) = (session.values().cloned(), session.first().cloned()) else { return };
    let mut edits = Vec::new();
    ui.add_enabled_ui(session.fitting().is_none(), |ui| {
        for param in values.rows() {
            let row = Row { param, values: &values, first: &first, session };
            ui.push_id(param.name(), |ui| row.show(ui, &mut edits));
        }
    });
    let Some(history) = session.history() else { return };
    for edit in edits {
        match edit {
            Edit::Value(column, value) => history.drag(|values| column.set(&mut values.params, value)),
            Edit::Reset(param, rgb) => history.edit(|values| values.params.set_rgb(param, rgb)),
            Edit::Freedom(param, freedom) => history.edit(|values| values.set_freedom(param, freedom)),
            Edit::Apart(param, apart) => history.edit(|values| values.set_apart(param, apart)),
            Edit::Settled => history.settle(),
        }
    }
}

struct Row<'a> {
    param: Param,
    values: &'a Values,
    first: &'a Values,
    session: &'a Session,
}

impl Row<'_> {
    fn show(&self, ui: &mut Ui, edits: &mut Vec<Edit>) {
        let info = self.param.info();
        let freedom = self.values.freedom(self.param);
        ui.horizontal(|ui| {
            let mut free = freedom != Freedom::Fixed;
            let words = "Whether a fit moves it";
            let box_ =
                ui.checkbox(&mut free, "").on_hover_text(words).accessible_name(format!("fit {}", info.name));
            if box_.changed() {
                let by_channel = self.values.by_channel(self.param);
                edits.push(Edit::Freedom(
                    self.param,
                    match (free, by_channel) {
                        (false, _) => Freedom::Fixed,
                        (true, true) => Freedom::PerChannel,
                        (true, false) => Freedom::Tied,
                    },
                ));
            }
            let name = egui::Label::new(RichText::new(info.name).strong()).sense(egui::Sense::click());
            let name = ui.add(name).on_hover_ui(|ui| self.tell(ui));
            if name.double_clicked() {
                edits.push(Edit::Reset(self.param, self.first.params.rgb(self.param)));
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.menu_button("reset", |ui| self.resets(ui, edits))
                    .response
                    .accessible_name(format!("reset {}", info.name));
                if info.rgb {
                    self.channels(ui, edits);
                }
            });
        });
        let columns = match self.values.by_channel(self.param) {
            true => Column::per_channel(self.param).to_vec(),
            false => vec![Column::tied(self.param)],
        };
        for column in columns {
            self.slider(ui, column, edits);
        }
    }

    /// What it is.
    fn tell(&self, ui: &mut Ui) {
        let info = self.param.info();
        let unit = if info.unit.is_empty() { String::new() } else { format!(" {}", info.unit) };
        ui.label(info.meaning);
        ui.label(format!("bounds {} to {}{unit}", info.lower, info.upper));
        ui.weak(info.source);
    }

    fn resets(&self, ui: &mut Ui, edits: &mut Vec<Edit>) {
        for (words, rgb) in self.session.resets(self.param) {
            let words = format!("to the {words}");
            if ui.button(words).clicked() {
                edits.push(Edit::Reset(self.param, rgb));
                ui.close();
            }
        }
    }

    /// Whether its channels move together.
    fn channels(&self, ui: &mut Ui, edits: &mut Vec<Edit>) {
        let by_channel = self.values.by_channel(self.param);
        let mut apart = by_channel;
        let name = format!("channels of {}", self.param.name());
        let words = "A value for each channel, or one for all";
        if ui.toggle_value(&mut apart, "rgb").on_hover_text(words).accessible_name(name).changed() {
            edits.push(Edit::Apart(self.param, apart));
        }
    }

    fn slider(&self, ui: &mut Ui, column: Column, edits: &mut Vec<Edit>) {
        let (info, mut value) = (self.param.info(), column.get(&self.values.params));
        let before = value;
        let channel = match column.channels {
            Channels::Tied => "",
            Channels::One(c) => ["red ", "green ", "blue "][c],
        };
        ui.horizontal(|ui| {
            ui.spacing_mut().slider_width = (ui.available_width() - 150.0).max(60.0);
            let (lower, upper) = info.range();
            let slider = Slider::new(&mut value, self.session.range(column))
                .clamping(SliderClamping::Never)
                .logarithmic(info.scale == Scale::Log)
                .suffix(if info.unit == "degrees" { "°" } else { "" })
                // A typed number counts once it is there.
                .update_while_editing(false)
                .max_decimals(5);
            let response = ui.add(slider).accessible_name(format!("{channel}{}", info.name));
            value = value.clamp(lower, upper);
            if value != before && value.is_finite() {
                edits.push(Edit::Value(column, value));
            }
            if is_over(&response, value != before) {
                edits.push(Edit::Settled);
            }
            if let Some(error) = self.session.error_words(column) {
                ui.weak(error).on_hover_text("Standard error of the last fit");
            }
        });
    }
}

/// Whether a slider is at rest: a drag that ended, a field that was left, or a change by a key.
fn is_over(response: &Response, changed: bool) -> bool {
    response.drag_stopped()
        || response.lost_focus()
        || (changed && !response.dragged() && !response.is_pointer_button_down_on())
}

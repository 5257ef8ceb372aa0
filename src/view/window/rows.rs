//! Parameters: a row each.

use std::ops::RangeInclusive;

use eframe::egui::style::HandleShape;
use eframe::egui::{self, Pos2, Rect, Response, RichText, Slider, SliderClamping, Ui};

use crate::model::params::{Channels, Column, Param, Scale};
use crate::session::{GAINS, START, Session, least};
use crate::values::{Freedom, Values};

/// A change that a row asks for.
enum Edit {
    /// A value, as part of a drag.
    Value(Column, f64),
    /// To what is called so, as a step.
    Reset(Param, &'static str),
    /// Whether a fit moves it.
    Free(Param, bool),
    /// A value for each channel, or one for all.
    Apart(Param, bool),
    /// A view's gain, or a channel of it, as part of a drag.
    Gain(usize, Channels, f64),
    /// Whether a fit moves the gains.
    FreeGains(bool),
    /// Whether it moves each of their channels.
    WhiteBalance(bool),
    /// A drag is over.
    Settled,
}

/// Every parameter that the enabled effects ask for, and the gains where there is anything to say of them.
pub(crate) fn show(ui: &mut Ui, session: &mut Session) {
    let Some(values) = session.values().cloned() else { return };
    let mut edits = Vec::new();
    ui.add_enabled_ui(session.fitting().is_none(), |ui| {
        for param in values.rows() {
            let row = Row { param, values: &values, session };
            ui.push_id(param.name(), |ui| row.show(ui, &mut edits));
        }
        gains(ui, session, &values, &mut edits);
    });
    for edit in edits {
        match edit {
            Edit::Value(column, value) => session.slide(column, value),
            Edit::Reset(param, to) => session.reset(param, to),
            Edit::Free(param, free) => session.edit(|values| values.set_free(param, free)),
            Edit::Apart(param, apart) => session.edit(|values| values.set_apart(param, apart)),
            Edit::Gain(view, channels, gain) => session.slide_gain(view, channels, gain),
            Edit::FreeGains(free) => session.edit(|values| values.free_gains = free),
            Edit::WhiteBalance(free) => session.edit(|values| values.set_white_balance(free)),
            Edit::Settled => session.settle(),
        }
    }
}

/// The factor on each view's image.
fn gains(ui: &mut Ui, session: &Session, values: &Values, edits: &mut Vec<Edit>) {
    let Some(opened) = session.opened() else { return };
    egui::CollapsingHeader::new("Gains of views").default_open(values.has_gains()).show(ui, |ui| {
        let mut free = values.free_gains;
        let words = "Whether a fit moves each view's but the first's";
        if ui.checkbox(&mut free, "free").on_hover_text(words).accessible_name("fit gains").changed() {
            edits.push(Edit::FreeGains(free));
        }
        let mut balance = values.white_balance;
        let words = "Whether a fit moves each channel of them";
        let response = ui.checkbox(&mut balance, "white balance").on_hover_text(words);
        if response.accessible_name("fit white balance").changed() {
            edits.push(Edit::WhiteBalance(balance));
        }
        let rows = opened.views().iter().enumerate();
        let rows = rows.flat_map(|(i, view)| values.gain_rows(i).into_iter().map(move |row| (i, view, row)));
        for (i, view, (channels, gain)) in rows {
            let name = format!("{}{}", view.name, channels.suffix());
            ui.horizontal(|ui| {
                ui.spacing_mut().slider_width = (ui.available_width() - 190.0).max(60.0);
                let mut value = gain;
                let slider = Slider::new(&mut value, GAINS)
                    .clamping(SliderClamping::Never)
                    .logarithmic(true)
                    .update_while_editing(false)
                    .max_decimals(5);
                let response = ui.add(slider).accessible_name(format!("gain {name}"));
                if value != gain {
                    edits.push(Edit::Gain(i, channels, value));
                }
                if is_over(&response, value != gain) {
                    edits.push(Edit::Settled);
                }
                ui.label(&name);
                if let Some(known) = session.known_gain(&view.name, channels) {
                    ui.weak(known.words());
                }
            });
        }
    });
}

struct Row<'a> {
    param: Param,
    values: &'a Values,
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
                edits.push(Edit::Free(self.param, free));
            }
            let name = egui::Label::new(RichText::new(info.name).strong()).sense(egui::Sense::click());
            let name = ui.add(name).on_hover_ui(|ui| self.tell(ui));
            if name.double_clicked() {
                edits.push(Edit::Reset(self.param, START));
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
        let (lower, upper) = self.session.bounds(self.param);
        ui.label(format!("bounds {lower} to {upper}{unit}"));
        ui.weak(info.source);
    }

    fn resets(&self, ui: &mut Ui, edits: &mut Vec<Edit>) {
        for (name, _) in self.session.resets(self.param) {
            if ui.button(format!("to the {name}")).clicked() {
                edits.push(Edit::Reset(self.param, name));
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
            let range = self.session.range(column);
            let slider = Slider::new(&mut value, range.clone())
                .clamping(SliderClamping::Never)
                .logarithmic(info.scale == Scale::Log)
                .smallest_positive(least(&range))
                .suffix(if info.unit == "degrees" { "°" } else { "" })
                // A typed number counts once it is there.
                .update_while_editing(false)
                .max_decimals(5);
            let response = ui.add(slider).accessible_name(format!("{channel}{}", info.name));
            if value != before && value.is_finite() {
                edits.push(Edit::Value(column, value));
            }
            if is_over(&response, value != before) {
                edits.push(Edit::Settled);
            }
            if let Some(interval) = self.session.interval(column) {
                let shares = interval.map(|value| place(&range, info.scale, value));
                error_bar(ui, &response, shares);
            }
            if let Some(known) = self.session.known(column) {
                ui.weak(known.words()).on_hover_text("Standard error of the last fit");
            }
        });
    }
}

/// A value's place on a slider, from 0 to 1.
fn place(range: &RangeInclusive<f64>, scale: Scale, value: f64) -> f32 {
    let (lower, upper) = (*range.start(), *range.end());
    let share = match scale {
        Scale::Log if lower >= 0.0 => {
            let least = least(range);
            (value.max(least) / least).ln() / (upper / least).ln()
        }
        _ => (value - lower) / (upper - lower),
    };
    share.clamp(0.0, 1.0) as f32
}

/// A bar below a slider, between two of its places.
fn error_bar(ui: &Ui, slider: &Response, [from, to]: [f32; 2]) {
    let width = ui.spacing().slider_width;
    // The middle of its handle moves between half a handle from either end.
    let aspect = match ui.visuals().handle_shape {
        HandleShape::Circle => 1.0,
        HandleShape::Rect { aspect_ratio } => aspect_ratio,
    };
    let radius = slider.rect.height() / 2.5 * aspect;
    let at = |share: f32| slider.rect.left() + radius + share * (width - 2.0 * radius);
    // However small the error is, it is seen where it is.
    let (from, to) = (at(from), at(to).max(at(from) + 2.0));
    let y = slider.rect.bottom() - 1.5;
    let bar = Rect::from_min_max(Pos2::new(from, y), Pos2::new(to, y + 3.0));
    ui.painter().rect_filled(bar, 1.0, ui.visuals().warn_fg_color);
}

/// Whether a slider is at rest: a drag that ended, a field that was left, or a change by a key.
fn is_over(response: &Response, changed: bool) -> bool {
    response.drag_stopped()
        || response.lost_focus()
        || (changed && !response.dragged() && !response.is_pointer_button_down_on())
}

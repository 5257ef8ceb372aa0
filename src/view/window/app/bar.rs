//! The bar above the panes: steps back, views, panes, and how they are shown.

use eframe::egui::{self, ComboBox, Ui};

use super::Window;
use crate::look::{ErrorKind, Layout, Pane};
use crate::render::tonemap::Operator;
use crate::session::Orbit;
use crate::shown;
use crate::window::keys::Action;

impl Window {
    /// Views, panes, and how they are shown.
    pub(super) fn bar(&mut self, ui: &mut Ui) {
        self.keep_screenshot();
        ui.horizontal_wrapped(|ui| {
            let (can_undo, can_redo) = self.session.steps();
            for (can, words, action) in [(can_undo, "undo", Action::Undo), (can_redo, "redo", Action::Redo)] {
                if ui.add_enabled(can, egui::Button::new(words)).clicked() {
                    self.act(action, ui.ctx());
                }
            }
            ui.separator();
            self.views(ui);
            ui.separator();
            for pane in Pane::OFFERED {
                let lacks = pane == Pane::Other && self.session.other().is_none();
                if lacks && !self.look.panes.contains(&pane) {
                    continue;
                }
                let mut on = self.look.panes.contains(&pane);
                let name = format!("pane {}", shown::name(pane));
                if ui.toggle_value(&mut on, shown::name(pane)).accessible_name(name).changed() {
                    self.look.set_pane(pane, on);
                }
            }
            ui.toggle_value(&mut self.session.terms, "terms").accessible_name("pane terms");
            ui.separator();
            let look = &mut self.look;
            let layout =
                Layout::ALL.iter().find(|(layout, _)| *layout == look.layout).map_or("", |(_, name)| name);
            let combo = ComboBox::from_id_salt("layout").selected_text(layout).show_ui(ui, |ui| {
                for (layout, name) in Layout::ALL {
                    ui.selectable_value(&mut look.layout, layout, name);
                }
            });
            combo.response.accessible_name("layout");
            let combo = ComboBox::from_id_salt("error").selected_text(look.error.name()).width(70.0).show_ui(
                ui,
                |ui| {
                    for kind in ErrorKind::ALL {
                        ui.selectable_value(&mut look.error, kind, kind.name());
                    }
                },
            );
            combo.response.accessible_name("error");
            let of = shown::name_of(shown::error_of(&self.session, look));
            let combo = ComboBox::from_id_salt("error of").selected_text(format!("of {of}")).width(70.0);
            let combo = combo.show_ui(ui, |ui| {
                for slot in shown::errors_of(&self.session) {
                    ui.selectable_value(&mut look.error_of, slot, shown::name_of(slot));
                }
            });
            combo.response.accessible_name("error of");
            let drag =
                egui::DragValue::new(&mut look.exposure).speed(0.05).range(-16.0..=16.0).suffix(" stops");
            ui.add(drag).on_hover_text("Exposure of the images").accessible_name("exposure");
            let mut operator = look.operator();
            let combo =
                ComboBox::from_id_salt("tone").selected_text(operator.name()).width(70.0).show_ui(ui, |ui| {
                    for other in Operator::ALL {
                        ui.selectable_value(&mut operator, other, other.name());
                    }
                });
            combo.response.accessible_name("tone mapping");
            look.set_operator(operator);
            ui.toggle_value(&mut look.false_colour, "false colour");
            ui.separator();
            if ui.button("keys").on_hover_text("F1").clicked() {
                self.help = !self.help;
            }
            let dark = ui.visuals().dark_mode;
            if ui.button(if dark { "light" } else { "dark" }).on_hover_text("Dark or light window").clicked()
            {
                ui.ctx().set_theme(if dark { egui::Theme::Light } else { egui::Theme::Dark });
            }
        });
    }

    /// Which view is looked at.
    fn views(&mut self, ui: &mut Ui) {
        let at = self.session.at();
        for (i, place) in self.session.places().into_iter().enumerate() {
            let name = format!("view {}", place.name);
            if ui.selectable_label(at == i, place.name).accessible_name(name).clicked() {
                self.session.look_at(i);
            }
        }
        if self.session.orbit != Orbit::default()
            && ui.button("home").on_hover_text("The view's own camera").clicked()
        {
            self.session.orbit = Orbit::default();
        }
    }
}

//! Effects: on or off, with what that cost and brought.

use eframe::egui::Ui;

use crate::model::effects::Effect;
use crate::session::Session;

/// Every effect that may be asked for by name.
pub(crate) fn show(ui: &mut Ui, session: &mut Session) {
    let Some(values) = session.values() else { return };
    let effects = values.effects;
    let mut switch = None;
    ui.add_enabled_ui(session.fitting().is_none(), |ui| {
        for effect in Effect::offered() {
            let mut on = effects.has(effect);
            ui.horizontal(|ui| {
                let name = format!("effect {}", effect.name());
                let words = effect.info().meaning;
                if ui.checkbox(&mut on, effect.name()).on_hover_text(words).accessible_name(name).changed() {
                    switch = Some((effect, on));
                }
                if let Some(change) = session.change(effect) {
                    ui.weak(change.words()).on_hover_text(
                        "What switching it changed: time of a frame, bytes on the adapter, PSNR of this view",
                    );
                }
            });
        }
    });
    if let Some((effect, on)) = switch {
        session.set_effect(effect, on);
    }
}

//! The panes: images side by side, as a wipe, or one at a time; zoom, camera and light by the mouse.

use std::sync::Arc;

use eframe::egui::{self, Align2, Color32, FontId, PointerButton, Rect, Response, Sense, Ui, Vec2};

use crate::look::{ErrorKind, Layout, Look, Pane};
use crate::pixels;
use crate::render::files::{ImageOptions, write_image};
use crate::render::image::Image;
use crate::render::tonemap::ToneMap;
use crate::session::Session;
use crate::shown::{self, Kind};
use crate::window::picture::{self, Shown};

/// Show the panes; the pixel that is pointed at.
pub(crate) fn show(ui: &mut Ui, session: &mut Session, look: &mut Look) -> Option<[u32; 2]> {
    let mut panes = look.panes.clone();
    panes.extend(if session.terms { shown::terms(session) } else { Vec::new() }.into_iter().map(Pane::Term));
    match look.layout {
        Layout::Side => {}
        Layout::Wipe => panes.truncate(1),
        Layout::Flip => {
            let at = usize::from(look.flipped && panes.len() > 1);
            panes = panes.get(at).copied().into_iter().collect();
        }
    }
    let whole = ui.available_rect_before_wrap();
    if panes.is_empty() {
        ui.centered_and_justified(|ui| ui.weak("No pane is chosen: take one from the bar above."));
        return None;
    }
    let aspect = session.camera().map_or(1.0, |camera| camera.width as f32 / camera.height as f32);
    let columns = columns(panes.len(), whole.size(), aspect);
    let rows = panes.len().div_ceil(columns);
    let size = Vec2::new(whole.width() / columns as f32, whole.height() / rows as f32);
    let mut pointed = None;
    for (i, pane) in panes.into_iter().enumerate() {
        let corner = Vec2::new((i % columns) as f32 * size.x, (i / columns) as f32 * size.y);
        let rect = Rect::from_min_size(whole.min + corner, size).shrink(2.0);
        pointed = One { pane, rect }.show(ui, session, look).or(pointed);
    }
    pointed
}

/// How many panes stand beside one another so that images are as large as they can be.
fn columns(count: usize, size: Vec2, aspect: f32) -> usize {
    let height = |columns: usize| {
        let rows = count.div_ceil(columns) as f32;
        (size.y / rows).min(size.x / columns as f32 / aspect)
    };
    (1..=count).max_by(|&a, &b| height(a).total_cmp(&height(b)).then(b.cmp(&a))).unwrap_or(1)
}

/// What of a pane is saved: its image, or an error's map.
fn file_of(session: &Session, look: &Look, pane: Pane) -> Option<Arc<Image>> {
    match pane {
        Pane::Error => {
            let painted = session.image(shown::error_of(session, look))?;
            Some(Arc::clone(&painted.compared.as_ref()?.map))
        }
        pane => shown::image(session, pane),
    }
}

/// Leave a pane's image in the run folder.
pub(crate) fn save(session: &mut Session, look: &Look, pane: Pane, ending: &'static str) {
    let (Some(shown), Some(view)) = (file_of(session, look, pane), session.view()) else { return };
    // As the report of several scenes calls its pictures.
    let view = session.view_name(session.scene(), &view.name).replace('/', "_");
    let pane = shown::name(pane).replace(' ', "_");
    let path = session.run_folder().join(format!("{view}_{pane}.{ending}"));
    let tone = ToneMap { operator: look.operator(), exposure: look.exposure };
    session.aside(move || {
        match write_image(&path, &shown, &ImageOptions { tone, ..ImageOptions::default() }) {
            Ok(()) => format!("wrote {}", path.display()),
            Err(error) => error.to_string(),
        }
    });
}

struct One {
    pane: Pane,
    rect: Rect,
}

impl One {
    fn show(self, ui: &mut Ui, session: &mut Session, look: &mut Look) -> Option<[u32; 2]> {
        let id = ui.scope_id().with(("pane", self.pane));
        let response = ui.interact(self.rect, id, Sense::click_and_drag());
        let title = shown::title(session, look, self.pane);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &title));
        let size = session.camera().map(|camera| Vec2::new(camera.width as f32, camera.height as f32));
        let pointed = size.and_then(|size| {
            let points = look.zoom.unwrap_or_else(|| (self.rect.size() / size).min_elem());
            let span = self.rect.size() / points;
            let origin = size * Vec2::from(look.middle) - 0.5 * span;
            self.image(ui, id, session, look, (origin, span));
            self.moved(ui, &response, session, look, (size, points));
            let at = origin + (response.hover_pos()? - self.rect.min) / points;
            (at.x >= 0.0 && at.y >= 0.0 && at.x < size.x && at.y < size.y)
                .then_some([at.x as u32, at.y as u32])
        });
        self.offer_file(&response, session, look);
        let painter = ui.painter_at(self.rect);
        let font = FontId::proportional(13.0);
        let galley = painter.layout_no_wrap(title, font, Color32::WHITE);
        let place = Align2::LEFT_TOP.anchor_size(self.rect.min + Vec2::splat(4.0), galley.size());
        painter.rect_filled(place.expand(3.0), 3.0, Color32::from_black_alpha(170));
        painter.galley(place.min, galley, Color32::WHITE);
        self.colours(&painter, look, place.expand(3.0));
        pointed
    }

    /// The colours of its scale, below its title, from the least to the greatest.
    fn colours(&self, painter: &egui::Painter, look: &Look, title: Rect) {
        if self.pane != Pane::Error && !look.false_colour {
            return;
        }
        let signed = self.pane == Pane::Error && look.error == ErrorKind::Signed;
        let bar = Rect::from_min_size(title.left_bottom(), Vec2::new(title.width(), 6.0));
        let ramp = pixels::ramp(signed);
        let width = bar.width() / 64.0;
        for (i, color) in ramp.chunks_exact(4).step_by(4).enumerate() {
            let corner = bar.min + Vec2::new(i as f32 * width, 0.0);
            // A little wider than it is: no gap is rounded into being.
            let rect = Rect::from_min_size(corner, Vec2::new(width + 0.5, bar.height()));
            painter.rect_filled(rect.intersect(bar), 0.0, Color32::from_rgb(color[0], color[1], color[2]));
        }
    }

    /// Its image as a file in the run folder, on a click of the right button.
    fn offer_file(&self, response: &Response, session: &mut Session, look: &Look) {
        if file_of(session, look, self.pane).is_none() {
            return;
        }
        let mut chosen = None;
        response.context_menu(|ui| {
            // An error's colours are the window's; its numbers are kept.
            let endings: &[&str] = if self.pane == Pane::Error { &["exr"] } else { &["png", "exr"] };
            for ending in endings {
                if ui.button(format!("save as {ending}")).clicked() {
                    chosen = Some(*ending);
                    ui.close();
                }
            }
        });
        if let Some(ending) = chosen {
            save(session, look, self.pane, ending);
        }
    }

    fn image(&self, ui: &mut Ui, id: egui::Id, session: &Session, look: &Look, (origin, span): (Vec2, Vec2)) {
        let pair = match (self.pane, look.layout) {
            (pane, Layout::Wipe) if pane != Pane::Error => {
                let beside = look.panes.get(1).copied().unwrap_or(Pane::Now);
                shown::image(session, pane).zip(shown::image(session, beside)).map(<[_; 2]>::from)
            }
            (pane, _) => shown::pair(session, pane, look),
        };
        let side = ui.input(|input| input.max_texture_side);
        let too_large = |image: &Arc<Image>| image.width.max(image.height) > side;
        let images = match pair {
            Some(images) if images.iter().any(too_large) => {
                let words =
                    format!("too large to be shown: this window's adapter takes {side} pixels a side");
                return self.say(ui, &words);
            }
            Some(images) => images,
            None => return self.say(ui, shown::lacking(session, self.pane)),
        };
        let kind = match (self.pane, look.layout) {
            (Pane::Error, _) => Kind::Error(look.error),
            (_, Layout::Wipe) => Kind::Wipe(look.wipe),
            _ => Kind::Image,
        };
        let shown = Shown {
            kind,
            origin: origin.into(),
            span: span.into(),
            exposure: look.exposure,
            operator: look.operator(),
            false_colour: look.false_colour,
            scale: shown::scale(look.error),
        };
        picture::paint(&ui.painter_at(self.rect), self.rect, id, images, shown);
    }

    /// Words where there is no image.
    fn say(&self, ui: &Ui, words: &str) {
        let (font, color) = (FontId::proportional(14.0), ui.visuals().weak_text_color());
        ui.painter().text(self.rect.center(), Align2::CENTER_CENTER, words, font, color);
    }

    /// What the mouse does here.
    fn moved(
        &self,
        ui: &Ui,
        response: &Response,
        session: &mut Session,
        look: &mut Look,
        (size, points): (Vec2, f32),
    ) {
        let (shift, command) = ui.input(|input| (input.modifiers.shift, input.modifiers.command));
        let drag = response.drag_delta();
        let wiping = look.layout == Layout::Wipe && !shift;
        if response.dragged_by(PointerButton::Primary) && wiping {
            if let Some(at) = response.interact_pointer_pos() {
                look.wipe = ((at.x - self.rect.min.x) / self.rect.width()).clamp(0.0, 1.0);
            }
        } else if response.dragged_by(PointerButton::Primary) && shift {
            // Half a turn for the width of a pane.
            let turn = f64::from(180.0 * drag.x / self.rect.width());
            session.turn_light(turn);
        } else if response.dragged_by(PointerButton::Primary) {
            let turn = std::f32::consts::PI * drag / self.rect.size();
            session.orbit.turn(f64::from(turn.x), f64::from(turn.y), 1.0);
        } else if response.dragged_by(PointerButton::Secondary) || response.dragged_by(PointerButton::Middle)
        {
            let middle = Vec2::from(look.middle) - drag / (points * size);
            look.middle = middle.clamp(Vec2::ZERO, Vec2::splat(1.0)).into();
        }
        if response.drag_stopped() {
            session.settle();
        }
        if response.double_clicked() {
            look.reset_zoom();
            session.orbit = crate::session::Orbit::default();
        }
        let wheel = ui.input(|input| input.smooth_scroll_delta.y + 100.0 * (input.zoom_delta() - 1.0));
        if let Some(at) = response.hover_pos().filter(|_| wheel != 0.0) {
            let factor = (wheel / 200.0).exp();
            if command {
                session.orbit.turn(0.0, 0.0, 1.0 / f64::from(factor));
            } else {
                // The pixel under the pointer stays there.
                let zoomed = (points * factor).clamp(0.05, 64.0);
                let away = at - self.rect.center();
                let middle = Vec2::from(look.middle) + away * (1.0 / points - 1.0 / zoomed) / size;
                (look.zoom, look.middle) = (Some(zoomed), middle.clamp(Vec2::ZERO, Vec2::splat(1.0)).into());
            }
        }
    }
}

//! The panes: images side by side, as a wipe, or one at a time; zoom, camera and light by the mouse.

use std::sync::Arc;

use eframe::egui::{self, Align2, Color32, FontId, PointerButton, Rect, Response, Sense, Ui, Vec2};

use crate::look::{ErrorKind, Layout, Look, Pane};
use crate::model::params::Param;
use crate::model::terms::TermName;
use crate::paint::{Painted, Slot};
use crate::picture::{self, Kind, Shown};
use crate::render::files::{ImageOptions, write_image};
use crate::render::image::Image;
use crate::render::tonemap::ToneMap;
use crate::session::Session;

/// What the end of each error's scale stands for: FLIP's own, linear radiance, a share of the target.
const fn scale(kind: ErrorKind) -> f32 {
    match kind {
        ErrorKind::Flip => 1.0,
        ErrorKind::Signed => 0.1,
        ErrorKind::Relative => 0.5,
    }
}

/// A pane's name.
pub(crate) fn name(pane: Pane) -> &'static str {
    match pane {
        Pane::Target => "target",
        Pane::Now => "now",
        Pane::Start => "start",
        Pane::Fit => "fit",
        Pane::Other => "other run",
        Pane::Error => "error",
        Pane::Term(term) => term.name(),
    }
}

/// The slot whose image a pane shows.
const fn slot(pane: Pane) -> Slot {
    match pane {
        Pane::Start => Slot::Start,
        Pane::Fit => Slot::Fit,
        Pane::Other => Slot::Other,
        _ => Slot::Now,
    }
}

/// A pane's image, where there is one; of the error that of the sliders.
pub(crate) fn image(session: &Session, pane: Pane) -> Option<Arc<Image>> {
    match pane {
        Pane::Target => session.opened()?.targets.get(session.view)?.clone(),
        Pane::Term(wanted) => {
            let terms = &session.image(Slot::Now)?.terms;
            terms.iter().find(|(term, _)| *term == wanted).map(|(_, image)| Arc::clone(image))
        }
        pane => session.image(slot(pane)).map(|painted| Arc::clone(&painted.image)),
    }
}

/// The target that the image of the sliders may be compared with: from a view's own camera.
pub(crate) fn compared(session: &Session) -> Option<Arc<Image>> {
    session.is_at_home().then(|| image(session, Pane::Target)).flatten()
}

/// The terms that there are images of.
pub(crate) fn terms(session: &Session) -> Vec<TermName> {
    session.image(Slot::Now).map_or_else(Vec::new, |now| now.terms.iter().map(|(term, _)| *term).collect())
}

/// Show the panes; the pixel that is pointed at.
pub(crate) fn show(ui: &mut Ui, session: &mut Session, look: &mut Look) -> Option<[u32; 2]> {
    let mut panes = look.panes.clone();
    panes.extend(if session.terms { terms(session) } else { Vec::new() }.into_iter().map(Pane::Term));
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

struct One {
    pane: Pane,
    rect: Rect,
}

impl One {
    fn show(self, ui: &mut Ui, session: &mut Session, look: &mut Look) -> Option<[u32; 2]> {
        let id = ui.scope_id().with(("pane", self.pane));
        let response = ui.interact(self.rect, id, Sense::click_and_drag());
        let title = self.title(session, look);
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
        pointed
    }

    /// Its image as a file in the run folder, on a click of the right button.
    fn offer_file(&self, response: &Response, session: &mut Session, look: &Look) {
        let shown = match self.pane {
            Pane::Error => {
                session.image(Slot::Now).and_then(|now| Some(Arc::clone(&now.compared.as_ref()?.map)))
            }
            pane => image(session, pane),
        };
        let Some(shown) = shown else { return };
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
        let Some(ending) = chosen else { return };
        let view = session
            .opened()
            .and_then(|opened| opened.views().get(session.view))
            .map(|view| view.name.clone());
        let pane = name(self.pane).replace(' ', "_");
        let file = format!("{}_{pane}.{ending}", view.unwrap_or_default());
        let path = session.run_folder().join(file);
        let tone = ToneMap { operator: look.operator(), exposure: look.exposure };
        let done = write_image(&path, &shown, &ImageOptions { tone, ..ImageOptions::default() });
        session.tell(match done {
            Ok(()) => format!("wrote {}", path.display()),
            Err(error) => error.to_string(),
        });
    }

    /// What stands above it, with its score and the legend of its colours.
    fn title(&self, session: &Session, look: &Look) -> String {
        let scored = |painted: Option<&Painted>| {
            let compared = painted.and_then(|painted| painted.compared.as_ref());
            compared.map_or_else(String::new, |c| format!("  {:.2} dB, FLIP {:.4}", c.psnr, c.flip))
        };
        let colours = if look.false_colour { "  luminance, 2^-8 to 2^2" } else { "" };
        match (self.pane, look.layout) {
            (Pane::Error, _) => match look.error {
                ErrorKind::Flip => format!("error: FLIP, 0 to {}", scale(ErrorKind::Flip)),
                ErrorKind::Signed => {
                    let scale = scale(ErrorKind::Signed);
                    format!("error: now - target, blue -{scale} to red {scale}")
                }
                ErrorKind::Relative => {
                    format!("error: |now - target| / target, 0 to {}", scale(ErrorKind::Relative))
                }
            },
            (pane, Layout::Wipe) => {
                let beside = look.panes.get(1).copied().unwrap_or(Pane::Now);
                format!("{} | {}{colours}", name(pane), name(beside))
            }
            (pane @ (Pane::Target | Pane::Term(_)), _) => format!("{}{colours}", name(pane)),
            (pane, _) => format!("{}{}{colours}", name(pane), scored(session.image(slot(pane)))),
        }
    }

    fn image(&self, ui: &mut Ui, id: egui::Id, session: &Session, look: &Look, (origin, span): (Vec2, Vec2)) {
        let pair = match (self.pane, look.layout) {
            (Pane::Error, _) => match look.error {
                ErrorKind::Flip => {
                    let compared = session.image(Slot::Now).and_then(|now| now.compared.as_ref());
                    compared.map(|compared| [Arc::clone(&compared.map), Arc::clone(&compared.map)])
                }
                _ => image(session, Pane::Now).zip(compared(session)).map(<[_; 2]>::from),
            },
            (pane, Layout::Wipe) => {
                let beside = look.panes.get(1).copied().unwrap_or(Pane::Now);
                image(session, pane).zip(image(session, beside)).map(<[_; 2]>::from)
            }
            (pane, _) => image(session, pane).map(|image| [Arc::clone(&image), image]),
        };
        let Some(images) = pair else {
            let words = match self.pane {
                Pane::Target => "this view has no target",
                Pane::Fit => "no fit yet",
                Pane::Other => "no run is compared",
                Pane::Error => "nothing is compared",
                _ => "being drawn",
            };
            ui.painter().text(
                self.rect.center(),
                Align2::CENTER_CENTER,
                words,
                FontId::proportional(14.0),
                ui.visuals().weak_text_color(),
            );
            return;
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
            scale: scale(look.error),
        };
        picture::paint(&ui.painter_at(self.rect), self.rect, id, images, shown);
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
            if let Some(history) = session.history() {
                history.drag(|values| {
                    let at = values.params.scalar(Param::EnvironmentRotation) + turn;
                    values.params.set(Param::EnvironmentRotation, (at + 540.0).rem_euclid(360.0) - 180.0);
                });
            }
        } else if response.dragged_by(PointerButton::Primary) {
            session.orbit.yaw += f64::from(drag.x * std::f32::consts::PI / self.rect.width());
            session.orbit.pitch = (session.orbit.pitch
                + f64::from(drag.y * std::f32::consts::PI / self.rect.height()))
            .clamp(-1.5, 1.5);
        } else if response.dragged_by(PointerButton::Secondary) || response.dragged_by(PointerButton::Middle)
        {
            let middle = Vec2::from(look.middle) - drag / (points * size);
            look.middle = middle.clamp(Vec2::ZERO, Vec2::splat(1.0)).into();
        }
        if response.drag_stopped()
            && let Some(history) = session.history()
        {
            history.settle();
        }
        if response.double_clicked() {
            look.reset_zoom();
            session.orbit = crate::session::Orbit::default();
        }
        let wheel = ui.input(|input| input.smooth_scroll_delta.y + 100.0 * (input.zoom_delta() - 1.0));
        if let Some(at) = response.hover_pos().filter(|_| wheel != 0.0) {
            let factor = (wheel / 200.0).exp();
            if command {
                session.orbit.distance = (session.orbit.distance / f64::from(factor)).clamp(0.05, 20.0);
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

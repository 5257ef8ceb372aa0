//! The window: bars, lists and panes about a [`Session`].
//!
//! - `bar`: what is shown and how; `fits`: the panel of the fit

mod bar;
mod fits;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Receiver;

use eframe::egui::{self, CentralPanel, Panel, ScrollArea, Ui};

use super::keys::{self, Action};
use super::progress;
use super::{effects, offscreen, panes, picture, probe_table, rows, table};
use crate::host::{Host, ViewError};
use crate::look::{ErrorKind, Layout, Look, Pane};
use crate::paint::Slot;
use crate::session::{Orbit, Session};
use crate::shown;
use crate::start::Start;

/// Where the look is kept from window to window.
const LOOK: &str = "look";

/// The window's widgets, and what they are about.
#[derive(Debug)]
pub struct Window {
    /// What is looked at.
    pub session: Session,
    /// How it is shown.
    pub look: Look,
    help: bool,
    table: bool,
    pointed: Option<[u32; 2]>,
    /// What stands in the field for files.
    file: String,
    run: String,
    /// The session's.
    number: u64,
    /// A requested screenshot.
    screenshot: Option<Receiver<Arc<egui::ColorImage>>>,
}

/// Open a window, and return when it is closed. A fit that runs then is stopped, and can be resumed.
///
/// # Errors
/// When there is no display, or no adapter that draws a window.
pub fn open_window(host: Arc<dyn Host>, start: Start, title: &str) -> Result<(), ViewError> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title(title)
            .with_app_id("skinfit")
            .with_inner_size([1440.0, 900.0])
            .with_min_inner_size([640.0, 480.0]),
        renderer: eframe::Renderer::Wgpu,
        // It costs a software adapter a good part of a frame.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let made = eframe::run_native(
        "skinfit",
        options,
        Box::new(move |creation| {
            if let Some(state) = &creation.wgpu_render_state {
                picture::install(state);
            }
            let mut window = Window::new(host, start, &creation.egui_ctx);
            if let Some(look) = creation.storage.and_then(|storage| eframe::get_value::<Look>(storage, LOOK))
            {
                let panes = std::mem::take(&mut window.look.panes);
                window.look = look;
                window.look.panes = panes;
            }
            Ok(Box::new(window))
        }),
    );
    made.map_err(|error| match error {
        eframe::Error::Wgpu(error) => ViewError::NoAdapter(error.to_string()),
        error => {
            // Without the place in winit's sources that its words begin with.
            let words = error.to_string();
            let reason = words.rsplit(": ").next().unwrap_or(&words);
            ViewError::NoWindow(reason.trim_end_matches('.').to_owned())
        }
    })
}

impl eframe::App for Window {
    fn logic(&mut self, _: &egui::Context, _: &mut eframe::Frame) {
        self.session.poll();
    }

    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        self.show(ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, LOOK, &self.look);
    }
}

impl Window {
    /// Widgets in that context, about a scene that begins to be read.
    #[must_use]
    pub fn new(host: Arc<dyn Host>, start: Start, ctx: &egui::Context) -> Self {
        let waker = ctx.clone();
        let run = start.run.display().to_string();
        let mut look = Look::default();
        if start.other.is_some() {
            look.panes = vec![Pane::Target, Pane::Now, Pane::Other, Pane::Error];
        }
        let session = Session::new(host, start, Arc::new(move || waker.request_repaint()));
        Self {
            session,
            look,
            help: false,
            table: false,
            pointed: None,
            file: "params.toml".to_owned(),
            run,
            number: 0,
            screenshot: None,
        }
    }

    /// A frame of the window.
    pub fn show(&mut self, ui: &mut Ui) {
        for action in keys::asked(ui.ctx()) {
            self.act(action, ui.ctx());
        }
        self.session.look_for(shown::slots(&self.session, &self.look));
        self.follow_run();
        Panel::top("bar").show(ui, |ui| self.bar(ui));
        Panel::bottom("status").show(ui, |ui| self.status(ui));
        Panel::bottom("fit").resizable(true).default_size(190.0).show(ui, |ui| self.fit(ui));
        Panel::left("parameters").resizable(true).default_size(360.0).show(ui, |ui| self.parameters(ui));
        Panel::right("probe").resizable(true).default_size(250.0).show(ui, |ui| {
            ScrollArea::vertical().show(ui, |ui| {
                let error_of = shown::error_of(&self.session, &self.look);
                probe_table::show(ui, &self.session, error_of, self.pointed);
                ui.take_available_width();
            });
        });
        CentralPanel::default().show(ui, |ui| {
            if let Some(pointed) = panes::show(ui, &mut self.session, &mut self.look) {
                self.pointed = Some(pointed);
            }
        });
        if self.help {
            let open = &mut self.help;
            egui::Window::new("Keys").open(open).collapsible(false).show(ui.ctx(), keys::list);
        }
        if self.table {
            let (open, session) = (&mut self.table, &self.session);
            egui::Window::new("Constants")
                .open(open)
                // Beside the panel with the button that opens it.
                .default_pos([400.0, 80.0])
                .collapsible(false)
                .show(ui.ctx(), |ui| ScrollArea::vertical().show(ui, |ui| table::show(ui, session)));
        }
        if self.session.is_opening() || self.session.fitting().is_some() {
            // What the library says of its progress wakes nobody.
            ui.ctx().request_repaint_after(std::time::Duration::from_millis(100));
        }
    }

    /// Have the probe look at a pixel, as the pointer does.
    pub const fn point_at(&mut self, pixel: [u32; 2]) {
        self.pointed = Some(pixel);
    }

    fn act(&mut self, action: Action, ctx: &egui::Context) {
        let (session, look) = (&mut self.session, &mut self.look);
        match action {
            Action::Help => self.help = !self.help,
            Action::Table => self.table = !self.table,
            Action::Undo => session.undo(),
            Action::Redo => session.redo(),
            Action::Fit => session.begin_fit(false),
            Action::Resume => session.begin_fit(true),
            Action::Pause => session.toggle_pause(),
            // What stands over the window is closed first.
            Action::Stop if self.help || self.table => (self.help, self.table) = (false, false),
            Action::Stop => session.stop_fit(),
            Action::NextView => session.look_at_next(),
            Action::Layout => {
                let at = Layout::ALL.iter().position(|(layout, _)| *layout == look.layout).unwrap_or(0);
                look.layout = Layout::ALL[(at + 1) % Layout::ALL.len()].0;
            }
            Action::Flip => look.flipped = !look.flipped,
            Action::Error => {
                let at = ErrorKind::ALL.iter().position(|kind| *kind == look.error).unwrap_or(0);
                look.error = ErrorKind::ALL[(at + 1) % ErrorKind::ALL.len()];
            }
            Action::ErrorOf => look.error_of = shown::next_error_of(session, look),
            Action::Terms => session.terms = !session.terms,
            Action::Brighter => look.exposure += 0.5,
            Action::Darker => look.exposure -= 0.5,
            Action::FalseColour => look.false_colour = !look.false_colour,
            Action::WholeImage => look.reset_zoom(),
            Action::Home => session.orbit = Orbit::default(),
            // One that shows nothing can still be taken away.
            Action::Pane(Pane::Other) if session.other().is_none() => look.set_pane(Pane::Other, false),
            Action::Pane(pane) => look.set_pane(pane, !look.panes.contains(&pane)),
            Action::Turn(right, down) => {
                session.orbit.turn(0.1 * f64::from(right), 0.1 * f64::from(down), 1.0);
            }
            Action::Light(right) => {
                session.turn_light(5.0 * f64::from(right));
                session.settle();
            }
            Action::Wipe(right) => look.wipe = (look.wipe + 0.02 * f32::from(right)).clamp(0.0, 1.0),
            // From the whole image, which is about a point a pixel.
            Action::Zoom(larger) => {
                let zoomed = look.zoom.unwrap_or(1.0) * 1.25_f32.powi(i32::from(larger));
                look.zoom = Some(zoomed.clamp(0.05, 64.0));
            }
            Action::Near(nearer) => session.orbit.turn(0.0, 0.0, 0.9_f64.powi(i32::from(nearer))),
            Action::Move(right, down) => {
                let step = 0.1 / look.zoom.unwrap_or(1.0).max(1.0);
                let [x, y] = look.middle;
                look.middle =
                    [x + step * f32::from(right), y + step * f32::from(down)].map(|at| at.clamp(0.0, 1.0));
            }
            Action::Probe => {
                let [x, y] = look.middle;
                self.pointed = session.camera().map(|camera| {
                    let at =
                        |share: f32, size: u32| ((share * size as f32) as u32).min(size.saturating_sub(1));
                    [at(x, camera.width), at(y, camera.height)]
                });
            }
            Action::SavePane => {
                if let Some(pane) = look.panes.first().copied() {
                    panes::save(session, look, pane, if pane == Pane::Error { "exr" } else { "png" });
                }
            }
            Action::Screenshot => {
                let (send, told) = std::sync::mpsc::channel();
                self.screenshot = Some(told);
                // Of the next frame; the window may be gone by then.
                ctx.request_screenshot(move |image| drop(send.send(image)));
            }
        }
    }

    /// With another scene the field of the run folder says another, and nothing is pointed at.
    fn follow_run(&mut self) {
        if self.session.number() == self.number {
            return;
        }
        self.number = self.session.number();
        self.run = self.session.run_folder().display().to_string();
        self.pointed = None;
        self.look.reset_zoom();
        self.look.set_pane(Pane::Other, self.session.other().is_some());
    }

    fn parameters(&mut self, ui: &mut Ui) {
        ScrollArea::vertical().show(ui, |ui| {
            ui.collapsing("Effects", |ui| effects::show(ui, &mut self.session));
            egui::CollapsingHeader::new("Files").show(ui, |ui| self.files(ui));
            ui.separator();
            rows::show(ui, &mut self.session);
            ui.take_available_width();
        });
    }

    /// Presets, and the scene with what was changed.
    fn files(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.label("file");
            ui.text_edit_singleline(&mut self.file).accessible_name("file");
        });
        ui.horizontal_wrapped(|ui| {
            let file = PathBuf::from(&self.file);
            if ui.button("load constants").on_hover_text("From a params.toml").clicked() {
                self.session.load_params(&file);
            }
            if ui.button("save constants").on_hover_text("As a params.toml").clicked() {
                self.session.save_params(&file);
            }
            if ui
                .button("save scene")
                .on_hover_text("The scene's file with these values, what is free, and the effects")
                .clicked()
            {
                self.session.save_scene(&file);
            }
            if ui
                .button("open")
                .on_hover_text("A scene, or the run folder of a fit, in the place of this one")
                .clicked()
            {
                self.session.open(&file);
            }
            if ui
                .button("compare")
                .on_hover_text("Another run's folder, or a params.toml, beside this one")
                .clicked()
            {
                self.session.compare(&file);
                self.look.set_pane(Pane::Other, self.session.other().is_some());
            }
            if ui.button("table").on_hover_text("All constants, side by side").clicked() {
                self.table = !self.table;
            }
        });
    }

    /// What draws and how fast, what is under way, what the user should know.
    fn status(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            if self.session.is_opening() {
                ui.spinner();
                ui.label("reading the scene");
            }
            if let Some(words) = progress::words() {
                ui.label(words);
            }
            if let Some(now) = self.session.image(Slot::Now) {
                ui.weak(format!(
                    "{}: {:.1} ms an image, {:.1} MB",
                    self.session.engine(),
                    1e3 * now.seconds,
                    now.uploaded as f64 / 1e6
                ));
            }
            if let Some(words) = self.session.told().last() {
                ui.colored_label(ui.visuals().warn_fg_color, words)
                    .on_hover_text(self.session.told().join("\n"));
                if ui.small_button("×").accessible_name("dismiss").clicked() {
                    self.session.forget_told();
                }
            }
        });
    }

    /// Leave a screenshot that has arrived in the run folder.
    fn keep_screenshot(&mut self) {
        let arrived = self.screenshot.as_ref().and_then(|told| told.try_recv().ok());
        let Some(image) = arrived else { return };
        self.screenshot = None;
        let file = self.session.run_folder().join("window.png");
        self.session.aside(move || {
            let bytes: Vec<u8> = image.pixels.iter().flat_map(egui::Color32::to_array).collect();
            let [width, height] = image.size;
            match offscreen::write(&file, &bytes, [width as u32, height as u32]) {
                Ok(()) => format!("wrote {}", file.display()),
                Err(error) => error.to_string(),
            }
        });
    }
}

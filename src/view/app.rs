//! The window: bars, lists and panes about a [`Session`].

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Receiver;

use eframe::egui::{self, CentralPanel, ComboBox, Panel, ScrollArea, Ui};

use crate::host::{Host, ViewError, ViewScore};
use crate::keys::{self, Action};
use crate::look::{ErrorKind, Layout, Look, Pane};
use crate::paint::Slot;
use crate::render::tonemap::Operator;
use crate::session::{Orbit, Session, Start, progress_words};
use crate::{curves, effects, offscreen, panes, picture, probe, rows};

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
    pointed: Option<[u32; 2]>,
    /// What stands in the field for files.
    file: String,
    run: String,
    /// A screenshot that was asked for.
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
            pointed: None,
            file: "params.toml".to_owned(),
            run,
            screenshot: None,
        }
    }

    /// A frame of the window.
    pub fn show(&mut self, ui: &mut Ui) {
        for action in keys::asked(ui.ctx()) {
            self.act(action, ui.ctx());
        }
        Panel::top("bar").show(ui, |ui| self.bar(ui));
        Panel::bottom("status").show(ui, |ui| self.status(ui));
        Panel::bottom("fit").resizable(true).default_size(190.0).show(ui, |ui| self.fit(ui));
        Panel::left("parameters").resizable(true).default_size(360.0).show(ui, |ui| self.parameters(ui));
        Panel::right("probe").resizable(true).default_size(250.0).show(ui, |ui| {
            ScrollArea::vertical().show(ui, |ui| {
                probe::show(ui, &self.session, self.pointed);
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
            Action::Undo => {
                if let Some(history) = session.history() {
                    history.undo();
                }
            }
            Action::Redo => {
                if let Some(history) = session.history() {
                    history.redo();
                }
            }
            Action::Fit => session.begin_fit(false),
            Action::Resume => session.begin_fit(true),
            Action::Pause => {
                if let Some(fitting) = session.fitting() {
                    fitting.set_paused(!fitting.is_paused());
                }
            }
            Action::Stop => {
                if let Some(fitting) = session.fitting() {
                    fitting.stop();
                }
            }
            Action::NextView => {
                let count = session.opened().map_or(1, |opened| opened.views().len().max(1));
                session.view = (session.view + 1) % count;
            }
            Action::Layout => {
                let at = Layout::ALL.iter().position(|(layout, _)| *layout == look.layout).unwrap_or(0);
                look.layout = Layout::ALL[(at + 1) % Layout::ALL.len()].0;
            }
            Action::Flip => look.flipped = !look.flipped,
            Action::Error => {
                let at = ErrorKind::ALL.iter().position(|kind| *kind == look.error).unwrap_or(0);
                look.error = ErrorKind::ALL[(at + 1) % ErrorKind::ALL.len()];
            }
            Action::Terms => session.terms = !session.terms,
            Action::Brighter => look.exposure += 0.5,
            Action::Darker => look.exposure -= 0.5,
            Action::FalseColour => look.false_colour = !look.false_colour,
            Action::WholeImage => look.reset_zoom(),
            Action::Home => session.orbit = Orbit::default(),
            Action::Screenshot => {
                let (send, told) = std::sync::mpsc::channel();
                self.screenshot = Some(told);
                // Of the next frame; the window may be gone by then.
                ctx.request_screenshot(move |image| drop(send.send(image)));
            }
        }
    }

    /// Views, panes, and how they are shown.
    fn bar(&mut self, ui: &mut Ui) {
        self.keep_screenshot();
        ui.horizontal_wrapped(|ui| {
            let (can_undo, can_redo) = self
                .session
                .history()
                .map_or((false, false), |history| (history.can_undo(), history.can_redo()));
            for (can, words, action) in [(can_undo, "undo", Action::Undo), (can_redo, "redo", Action::Redo)] {
                if ui.add_enabled(can, egui::Button::new(words)).clicked() {
                    self.act(action, ui.ctx());
                }
            }
            ui.separator();
            self.views(ui);
            ui.separator();
            let shown = [Pane::Target, Pane::Now, Pane::Start, Pane::Fit, Pane::Other, Pane::Error];
            for pane in shown {
                if pane == Pane::Other && self.session.other().is_none() {
                    continue;
                }
                let mut on = self.look.panes.contains(&pane);
                let name = format!("pane {}", panes::name(pane));
                if ui.toggle_value(&mut on, panes::name(pane)).accessible_name(name).changed() {
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
        let Some(opened) = self.session.opened().cloned() else { return };
        for (i, view) in opened.views().iter().enumerate() {
            if ui
                .selectable_label(self.session.view == i, &view.name)
                .accessible_name(format!("view {}", view.name))
                .clicked()
            {
                self.session.view = i;
            }
        }
        if self.session.orbit != Orbit::default()
            && ui.button("home").on_hover_text("The view's own camera").clicked()
        {
            self.session.orbit = Orbit::default();
        }
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
        });
    }

    fn fit(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            let paused = self.session.fitting().map(crate::fitting::Fitting::is_paused);
            let idle = paused.is_none() && self.session.opened().is_some();
            for (enabled, words, action) in [
                (idle, "fit", Action::Fit),
                (idle, "resume", Action::Resume),
                (paused.is_some(), if paused == Some(true) { "go on" } else { "pause" }, Action::Pause),
                (paused.is_some(), "stop", Action::Stop),
            ] {
                if ui.add_enabled(enabled, egui::Button::new(words)).clicked() {
                    self.act(action, ui.ctx());
                }
            }
            ui.label("run folder");
            let field = egui::TextEdit::singleline(&mut self.run).desired_width(180.0);
            if ui.add_enabled(idle, field).accessible_name("run folder").changed() {
                self.session.set_run_folder(PathBuf::from(&self.run));
            }
            self.held_out(ui, idle);
            if let Some(outcome) = self.session.outcome() {
                ui.strong(outcome.ending.words());
                ui.label(format!(
                    "loss {:.6e}, {} iterations, {} passes, {:.2} s",
                    outcome.loss_end, outcome.iterations, outcome.evaluations, outcome.seconds
                ));
            } else if let Some(step) = self.session.path().last().filter(|_| !idle) {
                ui.label(format!("iteration {}, loss {:.6e}", step.iteration.iteration, step.iteration.loss));
            }
        });
        if !self.session.scores().is_empty() {
            ui.horizontal_wrapped(|ui| {
                for score in self.session.scores() {
                    let ViewScore { view, held_out, psnr, ssim, flip } = score;
                    let seen = if *held_out { " (held out)" } else { "" };
                    ui.label(format!("{view}{seen}: {psnr:.2} dB, SSIM {ssim:.4}, FLIP {flip:.4}"));
                    ui.separator();
                }
            });
        }
        let free = self.session.values().map(|values| values.free.clone()).unwrap_or_default();
        let height = (ui.available_height() - 4.0).max(60.0);
        curves::show(ui, self.session.path(), &free, height);
        // The panel stays as high as it was made.
        ui.take_available_space();
    }

    /// Which views a fit leaves out.
    fn held_out(&mut self, ui: &mut Ui, idle: bool) {
        let Some(opened) = self.session.opened().cloned() else { return };
        ui.separator();
        ui.label("fitted views");
        for view in opened.views().iter().filter(|view| view.target.is_some()) {
            let Some(values) = self.session.values() else { return };
            let mut fitted = !values.hold_out.contains(&view.name);
            let name = format!("fit view {}", view.name);
            if ui
                .add_enabled(idle, egui::Checkbox::new(&mut fitted, &view.name))
                .accessible_name(name)
                .changed()
                && let Some(history) = self.session.history()
            {
                history.edit(|values| values.set_held_out(&view.name, !fitted));
            }
        }
        ui.separator();
    }

    /// What draws and how fast, what is under way, what the user should know.
    fn status(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            if self.session.is_opening() {
                ui.spinner();
                ui.label("reading the scene");
            }
            if let Some(words) = progress_words() {
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
        let bytes: Vec<u8> = image.pixels.iter().flat_map(egui::Color32::to_array).collect();
        let [width, height] = image.size;
        let done = offscreen::write(&file, &bytes, [width as u32, height as u32]);
        self.session.tell(match done {
            Ok(()) => format!("wrote {}", file.display()),
            Err(error) => error.to_string(),
        });
    }
}

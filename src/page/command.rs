//! What one does on the page.

use std::path::Path;

use serde::Deserialize;
use skinfit_core::files;
use skinfit_view::Session;
use skinfit_view::look::{Look, Pane};
use skinfit_view::session::Orbit;
use skinfit_view::values::Freedom;

use crate::message::column;
use crate::model::effects::Effect;
use crate::model::params::Param;

/// Where constants are put to be read.
pub(crate) const LOADED: &str = "/page/params.toml";

/// What is done.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum Command {
    /// A slider is moved, as part of a drag.
    Slide {
        slider: String,
        value: f64,
    },
    /// A drag is over.
    Settle,
    /// All channels, as a step: to what is called so.
    Reset {
        param: String,
        to: String,
    },
    /// Whether a fit moves it.
    Free {
        param: String,
        on: bool,
    },
    /// A value for each channel, or one for all.
    Apart {
        param: String,
        on: bool,
    },
    Effect {
        name: String,
        on: bool,
    },
    /// Whether a fit sees a view.
    FitView {
        view: String,
        on: bool,
    },
    View {
        index: usize,
    },
    /// Turn the camera: radians, and a factor on the distance.
    Orbit {
        yaw: f64,
        pitch: f64,
        distance: f64,
    },
    /// Turn the environment's light: degrees.
    Light {
        degrees: f64,
    },
    Home,
    Undo,
    Redo,
    Fit,
    Resume,
    Pause,
    Stop,
    Terms {
        on: bool,
    },
    Look {
        look: Look,
    },
    /// Which panes are shown.
    Panes {
        names: Vec<String>,
    },
    /// That what was told is known.
    Forget,
    /// Constants of a file.
    Load {
        text: String,
    },
}

/// Do it.
pub(crate) fn run(session: &mut Session, look: &mut Look, command: Command) {
    match command {
        Command::Slide { slider, value } => {
            if let (Some(column), Some(history)) = (column(&slider), session.history()) {
                let (lower, upper) = column.param.info().range();
                if value.is_finite() {
                    history.drag(|values| column.set(&mut values.params, value.clamp(lower, upper)));
                }
            }
        }
        Command::Settle => {
            if let Some(history) = session.history() {
                history.settle();
            }
        }
        Command::Reset { param, to } => {
            let found = Param::from_name(&param).and_then(|param| {
                let (_, rgb) = session.resets(param).into_iter().find(|(name, _)| *name == to)?;
                Some((param, rgb))
            });
            if let (Some((param, rgb)), Some(history)) = (found, session.history()) {
                history.edit(|values| values.params.set_rgb(param, rgb));
            }
        }
        Command::Free { param, on } => {
            if let (Some(param), Some(history)) = (Param::from_name(&param), session.history()) {
                let freedom = match (on, history.now().by_channel(param)) {
                    (false, _) => Freedom::Fixed,
                    (true, true) => Freedom::PerChannel,
                    (true, false) => Freedom::Tied,
                };
                history.edit(|values| values.set_freedom(param, freedom));
            }
        }
        Command::Apart { param, on } => {
            if let (Some(param), Some(history)) = (Param::from_name(&param), session.history()) {
                history.edit(|values| values.set_apart(param, on));
            }
        }
        Command::Effect { name, on } => {
            if let Some(effect) = Effect::from_name(&name) {
                session.set_effect(effect, on);
            }
        }
        Command::FitView { view, on } => {
            if let Some(history) = session.history() {
                history.edit(|values| values.set_held_out(&view, !on));
            }
        }
        Command::View { index } => {
            let count = session.opened().map_or(1, |opened| opened.views().len().max(1));
            session.view = index.min(count - 1);
        }
        Command::Orbit { yaw, pitch, distance } => session.orbit.turn(yaw, pitch, distance),
        Command::Light { degrees } => session.turn_light(degrees),
        Command::Home => session.orbit = Orbit::default(),
        Command::Undo => {
            if let Some(history) = session.history() {
                history.undo();
            }
        }
        Command::Redo => {
            if let Some(history) = session.history() {
                history.redo();
            }
        }
        Command::Fit => session.begin_fit(false),
        Command::Resume => session.begin_fit(true),
        Command::Pause => {
            if let Some(fitting) = session.fitting_mut() {
                fitting.set_paused(!fitting.is_paused());
            }
        }
        Command::Stop => {
            if let Some(fitting) = session.fitting_mut() {
                fitting.stop();
            }
        }
        Command::Terms { on } => session.terms = on,
        Command::Look { look: other } => look.take(other),
        Command::Panes { names } => {
            look.panes = names.iter().filter_map(|name| pane(name)).collect();
        }
        Command::Forget => session.forget_told(),
        Command::Load { text } => {
            let file = Path::new(LOADED);
            files::hold([(file.to_owned(), text.into_bytes())]);
            session.load_params(file);
        }
    }
}

/// The pane of that name.
pub(crate) fn pane(name: &str) -> Option<Pane> {
    Pane::all().find(|pane| skinfit_view::shown::name(*pane) == name)
}

//! What one does on the page.

use std::path::Path;

use serde::Deserialize;
use skinfit_core::files;
use skinfit_view::Session;
use skinfit_view::look::{Look, Pane};
use skinfit_view::session::Orbit;
use skinfit_view::values::column;

use crate::model::effects::Effect;
use crate::model::params::{Channels, Param};

/// What is done.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum Command {
    /// A slider is moved, as part of a drag.
    Slide {
        slider: String,
        value: f64,
    },
    /// The slider of a view's gain, or of a channel of it, is moved, as part of a drag.
    SlideGain {
        view: usize,
        channel: Option<usize>,
        value: f64,
    },
    /// Whether a fit moves the gains.
    FreeGains {
        on: bool,
    },
    /// Whether it moves each of their channels.
    FreeWhiteBalance {
        on: bool,
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
    /// Whether a fit sees a view, by its place in the list.
    FitView {
        index: usize,
        on: bool,
    },
    View {
        index: usize,
    },
    NextView,
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
        name: String,
        text: String,
    },
}

/// Do it.
pub(crate) fn run(session: &mut Session, look: &mut Look, command: Command) {
    match command {
        Command::Slide { slider, value } => {
            if let Some(column) = column(&slider) {
                session.slide(column, value);
            }
        }
        Command::SlideGain { view, channel, value } => {
            let channels = channel.filter(|c| *c < 3).map_or(Channels::Tied, Channels::One);
            session.slide_gain(view, channels, value);
        }
        Command::FreeGains { on } => session.edit(|values| values.free_gains = on),
        Command::FreeWhiteBalance { on } => session.edit(|values| values.set_white_balance(on)),
        Command::Settle => session.settle(),
        Command::Reset { param, to } => {
            if let Some(param) = Param::from_name(&param) {
                session.reset(param, &to);
            }
        }
        Command::Free { param, on } => {
            if let Some(param) = Param::from_name(&param) {
                session.edit(|values| values.set_free(param, on));
            }
        }
        Command::Apart { param, on } => {
            if let Some(param) = Param::from_name(&param) {
                session.edit(|values| values.set_apart(param, on));
            }
        }
        Command::Effect { name, on } => {
            if let Some(effect) = Effect::from_name(&name) {
                session.set_effect(effect, on);
            }
        }
        Command::FitView { index, on } => session.set_fitted(index, on),
        Command::View { index } => session.look_at(index),
        Command::NextView => session.look_at_next(),
        Command::Orbit { yaw, pitch, distance } => session.orbit.turn(yaw, pitch, distance),
        Command::Light { degrees } => session.turn_light(degrees),
        Command::Home => session.orbit = Orbit::default(),
        Command::Undo => session.undo(),
        Command::Redo => session.redo(),
        Command::Fit => session.begin_fit(false),
        Command::Resume => session.begin_fit(true),
        Command::Pause => session.toggle_pause(),
        Command::Stop => session.stop_fit(),
        Command::Terms { on } => session.terms = on,
        Command::Look { look: other } => look.take(other),
        Command::Panes { names } => {
            look.panes = names.iter().filter_map(|name| pane(name)).collect();
        }
        Command::Forget => session.forget_told(),
        Command::Load { name, text } => {
            // What is wrong with it is told by its own name.
            let name = Path::new(&name).file_name().unwrap_or_default();
            let file = Path::new("/").join(name);
            files::hold([(file.clone(), text.into_bytes())]);
            session.load_params(&file);
        }
    }
}

/// The pane of that name.
pub(crate) fn pane(name: &str) -> Option<Pane> {
    Pane::all().find(|pane| skinfit_view::shown::name(*pane) == name)
}

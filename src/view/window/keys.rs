//! Everything that a key does: one table, which the window reads and the list on F1 shows.

use eframe::egui::{self, Key, KeyboardShortcut, Modifiers};

use crate::look::Pane;

/// What can be asked of the window by a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    Help,
    Table,
    Undo,
    Redo,
    Fit,
    Resume,
    Pause,
    Stop,
    NextView,
    Layout,
    Flip,
    Error,
    ErrorOf,
    Terms,
    Brighter,
    Darker,
    FalseColour,
    WholeImage,
    Home,
    Probe,
    Screenshot,
    SavePane,
    /// Move the image: steps to the right, and down.
    Move(i8, i8),
    /// Show a pane, or take it away.
    Pane(Pane),
    /// Turn the camera: steps to the right, and down.
    Turn(i8, i8),
    /// Turn the environment's light: steps to the right.
    Light(i8),
    /// Move the line of a wipe: steps to the right.
    Wipe(i8),
    /// Pixels of the image larger by a step, or smaller.
    Zoom(i8),
    /// Nearer by a step, or farther.
    Near(i8),
}

const NONE: Modifiers = Modifiers::NONE;
const COMMAND: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
const ALT: Modifiers = Modifiers::ALT;

/// The keys, what they do, and how the list says it.
pub(crate) const KEYS: [(Modifiers, Key, Action, &str); 45] = [
    (NONE, Key::F1, Action::Help, "this list"),
    (NONE, Key::F2, Action::Table, "all constants, side by side"),
    (COMMAND, Key::Z, Action::Undo, "undo"),
    (COMMAND.plus(Modifiers::SHIFT), Key::Z, Action::Redo, "redo"),
    (COMMAND, Key::Y, Action::Redo, "redo"),
    (COMMAND, Key::Enter, Action::Fit, "fit from where the sliders stand"),
    (COMMAND, Key::R, Action::Resume, "go on with the fit that was stopped"),
    (NONE, Key::P, Action::Pause, "pause the fit, or let it go on"),
    (NONE, Key::Escape, Action::Stop, "stop the fit; what it has found stays"),
    (NONE, Key::V, Action::NextView, "next view"),
    (NONE, Key::L, Action::Layout, "side by side, wipe, or flip"),
    (NONE, Key::F, Action::Flip, "flip between the first two panes"),
    (NONE, Key::E, Action::Error, "error: FLIP, signed, relative"),
    (SHIFT, Key::E, Action::ErrorOf, "error of now, the fit, the start, or the other run"),
    (NONE, Key::T, Action::Terms, "terms of the image, or none"),
    (NONE, Key::Plus, Action::Brighter, "half a stop brighter"),
    (NONE, Key::Minus, Action::Darker, "half a stop darker"),
    (NONE, Key::C, Action::FalseColour, "luminance as a colour"),
    (NONE, Key::W, Action::WholeImage, "whole image"),
    (NONE, Key::H, Action::Home, "the view's own camera"),
    (NONE, Key::Q, Action::Probe, "probe the pixel in the middle of the panes"),
    (
        COMMAND.plus(Modifiers::SHIFT),
        Key::S,
        Action::SavePane,
        "leave the first pane's image in the run folder",
    ),
    (COMMAND, Key::S, Action::Screenshot, "leave the window as an image in the run folder"),
    (NONE, Key::Num1, Action::Pane(Pane::Target), "pane target"),
    (NONE, Key::Num2, Action::Pane(Pane::Now), "pane now"),
    (NONE, Key::Num3, Action::Pane(Pane::Start), "pane start"),
    (NONE, Key::Num4, Action::Pane(Pane::Fit), "pane fit"),
    (NONE, Key::Num5, Action::Pane(Pane::Other), "pane other run"),
    (NONE, Key::Num6, Action::Pane(Pane::Error), "pane error"),
    (SHIFT, Key::ArrowLeft, Action::Turn(-1, 0), "turn the camera to the left"),
    (SHIFT, Key::ArrowRight, Action::Turn(1, 0), "turn the camera to the right"),
    (SHIFT, Key::ArrowUp, Action::Turn(0, -1), "turn the camera up"),
    (SHIFT, Key::ArrowDown, Action::Turn(0, 1), "turn the camera down"),
    (ALT, Key::ArrowLeft, Action::Light(-1), "turn the light to the left"),
    (ALT, Key::ArrowRight, Action::Light(1), "turn the light to the right"),
    (COMMAND, Key::ArrowLeft, Action::Move(-1, 0), "move what is shown of the image to the left"),
    (COMMAND, Key::ArrowRight, Action::Move(1, 0), "move what is shown of the image to the right"),
    (COMMAND, Key::ArrowUp, Action::Move(0, -1), "move what is shown of the image up"),
    (COMMAND, Key::ArrowDown, Action::Move(0, 1), "move what is shown of the image down"),
    (NONE, Key::OpenBracket, Action::Wipe(-1), "line of the wipe to the left"),
    (NONE, Key::CloseBracket, Action::Wipe(1), "line of the wipe to the right"),
    (NONE, Key::PageUp, Action::Zoom(1), "larger"),
    (NONE, Key::PageDown, Action::Zoom(-1), "smaller"),
    (COMMAND, Key::PageUp, Action::Near(1), "nearer"),
    (COMMAND, Key::PageDown, Action::Near(-1), "farther"),
];

/// What the mouse does, for the list.
pub(crate) const MOUSE: [(&str, &str); 7] = [
    ("drag", "turn the camera about the mesh"),
    ("Shift and drag", "turn the environment's light"),
    ("right button and drag", "move the image"),
    ("right button", "save a pane's image in the run folder"),
    ("wheel", "zoom to a pixel; with Ctrl nearer or farther"),
    ("double click", "whole image, the view's own camera"),
    ("double click on a name", "reset the parameter to where it began"),
];

/// Actions by keys since the last frame; but for a few, none is taken from a field that is being written in.
pub(crate) fn asked(ctx: &egui::Context) -> Vec<Action> {
    let writing = ctx.text_edit_focused();
    // A list that stands open is closed by Escape, and nothing else is.
    let listing = egui::Popup::is_any_open(ctx);
    ctx.input_mut(|input| {
        let pressed = |(modifiers, key, action, _): &(Modifiers, Key, Action, &str)| {
            let everywhere = matches!(action, Action::Help | Action::Fit);
            let theirs = listing && *action == Action::Stop;
            ((everywhere || !writing)
                && !theirs
                && input.consume_shortcut(&KeyboardShortcut::new(*modifiers, *key)))
            .then_some(*action)
        };
        // Those with more modifiers first: Ctrl+Z is part of Ctrl+Shift+Z.
        let mut keys = KEYS;
        keys.sort_by_key(|(modifiers, ..)| !modifiers.shift);
        keys.iter().filter_map(pressed).collect()
    })
}

/// The list of keys.
pub(crate) fn list(ui: &mut egui::Ui) {
    egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
        let keys = KEYS.iter().map(|(modifiers, key, _, words)| {
            (ui.ctx().format_shortcut(&KeyboardShortcut::new(*modifiers, *key)), *words)
        });
        let mouse = MOUSE.iter().map(|(what, words)| ((*what).to_owned(), *words));
        for (what, words) in keys.chain(mouse).collect::<Vec<_>>() {
            ui.strong(what);
            ui.label(words);
            ui.end_row();
        }
    });
}

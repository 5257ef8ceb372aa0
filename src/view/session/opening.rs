//! Scenes that are read, and runs that are compared.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use super::Session;
use crate::engine::Point;
use crate::fit::params_file::ParamsFileError;
use crate::history::History;
use crate::host::Fitted;
use crate::model::effects::Effects;
use crate::opened::{Opened, Reading};
use crate::reported::reported;
use crate::skin::Skin;
use crate::start::{Run, Start};

/// Scenes that are being read.
pub(super) struct Opening {
    scenes: Receiver<Result<Vec<Opened>, String>>,
    /// The requested effects of each, where not the file's own.
    effects: Vec<Option<Effects>>,
}

impl Session {
    /// Begin to read scenes.
    pub(super) fn read(&mut self, scenes: Vec<Reading>) {
        let (send, opened) = channel();
        let effects = scenes.iter().map(|reading| reading.effects).collect();
        let wake = Arc::clone(&self.wake);
        let work = move || {
            // The window may be gone.
            let _ = send.send(Opened::read_all(&scenes));
            wake();
        };
        if let Err(error) = aside(work) {
            self.told.push(format!("no thread can be had: {error}"));
        }
        self.opening = Some(Opening { scenes: opened, effects });
    }

    /// Look at another scene or run in the place of this one, once it is there; not while a fit runs.
    pub fn open(&mut self, path: &Path) {
        if self.fitting.is_some() {
            self.told.push("a fit is under way: stop it first.".to_owned());
            return;
        }
        match self.host.start(path) {
            Ok(start) => {
                let start = Start { engine: self.start.engine.clone(), ..start };
                let mut next = Self::new(Arc::clone(&self.host), start, Arc::clone(&self.wake));
                next.number = self.number + 1;
                self.next = Some(Box::new(next));
            }
            Err(error) => self.told.push(error),
        }
    }

    /// Go over to the requested scenes, once they are opened; what cannot be opened is told, and this stays.
    pub(super) fn follow_next(&mut self) {
        let Some(mut next) = self.next.take().filter(|_| self.fitting.is_none()) else { return };
        next.follow_opening();
        if next.opening.is_some() {
            self.next = Some(next);
        } else if next.scenes.is_empty() {
            self.told.append(&mut next.told);
        } else {
            std::mem::swap(self, &mut next);
            self.terms = next.terms;
            self.told.splice(0..0, next.told.drain(..));
            // What the one before is still writing is told here.
            std::mem::swap(&mut self.aside, &mut next.aside);
            // Its painter may be in the middle of an image.
            self.aside.begin_quietly(move || drop(next));
        }
    }

    /// Compare another run, or the constants of a file.
    pub fn compare(&mut self, path: &Path) {
        if self.scenes.is_empty() {
            return;
        }
        match self.host.run(path) {
            Ok(run) => {
                let (other, other_fit) = self.left_by(Some(&run));
                // What cannot be read was told, and leaves what there was.
                if other.is_some() {
                    (self.other, self.other_fit) = (other, other_fit);
                }
            }
            Err(error) => self.told.push(error),
        }
    }

    /// Take in scenes that were read.
    pub(super) fn follow_opening(&mut self) {
        let Some(opening) = &self.opening else { return };
        let opened = match opening.scenes.try_recv() {
            Ok(opened) => opened,
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => {
                Err("the scene could not be read by a fault of skinfit's, told on standard error. Please report it."
                    .to_owned())
            }
        };
        let asked = self.opening.take().map(|opening| opening.effects).unwrap_or_default();
        match opened {
            Ok(opened) => self.take(opened, &asked),
            Err(error) => {
                self.told.push(error);
                // What is shown stays, with its effects: the step to others is taken back.
                let scenes = self.scenes.iter().map(|opened| &**opened);
                if let Some(history) = self.values.as_mut().filter(|_| !self.scenes.is_empty()) {
                    history.refuse(|values| values.is_read(scenes.clone()));
                    // No step leads back where one was undone into what cannot be read any more.
                    history.amend(|values| values.set_effects(scenes));
                }
            }
        }
    }

    fn take(&mut self, opened: Vec<Opened>, asked: &[Option<Effects>]) {
        self.scenes = opened.into_iter().map(Arc::new).collect();
        for words in self.scenes.iter().flat_map(|opened| &opened.baked.warnings) {
            if !self.told.contains(words) {
                self.told.push(words.clone());
            }
        }
        if self.values.is_none() {
            self.begin();
        }
        // A scene may bring effects along: lights one each, morph targets with weights.
        if let Some(history) = &mut self.values {
            let brought = self.scenes.iter().map(|opened| opened.baked.scene.effects);
            history.amend(|values| values.bring_effects(asked, brought));
        }
        self.stay_within();
        self.asked.clear();
    }

    /// Where the sliders begin: of a run where its fit ended.
    fn begin(&mut self) {
        let first = Skin::of(self.scenes.iter().map(|opened| &**opened));
        let mut values = first.clone();
        let (fitted, known) = self.left_by(self.start.fitted.clone().as_ref());
        if let Some(points) = &fitted {
            values.set_points(points);
        }
        let (found, scores) = known.map(|Fitted { found, views }| (found, views)).unzip();
        (self.found, self.scores) = (found, self.in_order(scores.unwrap_or_default()));
        self.fitted = fitted;
        (self.other, self.other_fit) = self.left_by(self.start.other.clone().as_ref());
        (self.values, self.first) = (Some(History::new(values)), Some(first));
    }

    /// What a run has left: its constants in each scene, and what is known of them. What cannot be read is told.
    fn left_by(&mut self, run: Option<&Run>) -> (Option<Vec<Point>>, Option<Fitted>) {
        let Some(Run { params, report }) = run else { return (None, None) };
        let points: Result<Vec<Point>, ParamsFileError> =
            self.scenes.iter().map(|opened| opened.point_in(params, None)).collect();
        let known = points.map_err(|error| error.to_string()).and_then(|points| {
            let known = report.as_ref().map(|report| reported(report, points.clone())).transpose()?;
            // Of a fit of several, of which one is looked at alone.
            let alone = self.scenes.first().filter(|_| self.scenes.len() == 1);
            let known = known.map(|known| match alone {
                Some(scene) => known.of_scene(scene.path()),
                None => known,
            });
            Ok((points, known))
        });
        match known {
            Ok((points, known)) => (Some(points), known),
            Err(error) => {
                self.told.push(error);
                (None, None)
            }
        }
    }
}

/// Do long work on a thread of its own; in a browser's worker, which is one, at once.
fn aside(work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    #[cfg(target_family = "wasm")]
    work();
    #[cfg(not(target_family = "wasm"))]
    std::thread::Builder::new().name("open".to_owned()).spawn(work)?;
    Ok(())
}

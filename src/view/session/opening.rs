//! Scenes that are read, and runs that are compared.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{TryRecvError, channel};

use super::{Session, files};
use crate::engine::Point;
use crate::fit::params_file::ParamsFile;
use crate::history::History;
use crate::host::Fitted;
use crate::opened::{Opened, Reading};
use crate::reported::reported;
use crate::skin::Skin;
use crate::start::{Run, Start};

impl Session {
    /// Begin to read scenes.
    pub(super) fn read(&mut self, scenes: Vec<Reading>) {
        let (send, opening) = channel();
        let wake = Arc::clone(&self.wake);
        let work = move || {
            // The window may be gone.
            let _ = send.send(Opened::read_all(&scenes));
            wake();
        };
        if let Err(error) = aside(work) {
            self.told.push(format!("no thread can be had: {error}"));
        }
        self.opening = Some(opening);
    }

    /// Look at another scene or run in the place of this one; not while a fit runs.
    pub fn open(&mut self, path: &Path) {
        if self.fitting.is_some() {
            self.told.push("a fit is under way: stop it first.".to_owned());
            return;
        }
        match self.host.start(path) {
            Ok(start) => {
                let start = Start { engine: self.start.engine.clone(), ..start };
                *self = Self::new(Arc::clone(&self.host), start, Arc::clone(&self.wake));
            }
            Err(error) => self.told.push(error),
        }
    }

    /// Compare another run, or the constants of a file.
    pub fn compare(&mut self, path: &Path) {
        if self.scenes.is_empty() {
            return;
        }
        match self.host.run(path) {
            Ok(run) => (self.other, self.other_fit) = self.left_by(Some(&run)),
            Err(error) => self.told.push(error),
        }
    }

    /// Take in scenes that were read.
    pub(super) fn follow_opening(&mut self) {
        let Some(opening) = &self.opening else { return };
        let opened = match opening.try_recv() {
            Ok(opened) => opened,
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => {
                Err("the scene could not be read by a fault of skinfit's, told on standard error. Please report it."
                    .to_owned())
            }
        };
        self.opening = None;
        match opened {
            Ok(opened) => self.take(opened),
            Err(error) => {
                self.told.push(error);
                // What is shown stays, with its effects: the step to others is taken back.
                let scenes = self.scenes.iter().map(|opened| &**opened);
                if let Some(history) = self.values.as_mut().filter(|_| !self.scenes.is_empty()) {
                    history.refuse(|values| values.is_read(scenes.clone()));
                }
            }
        }
    }

    fn take(&mut self, opened: Vec<Opened>) {
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
            history.amend(|values| values.take_effects(self.scenes.iter().map(|opened| &**opened)));
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
        let points: Result<Vec<Point>, String> =
            self.scenes.iter().map(|opened| point_of(params, opened)).collect();
        let known = points.and_then(|points| {
            let known = report.as_ref().map(|report| reported(report, points.clone()));
            Ok((points, known.transpose()?))
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

/// Where a file of constants has a scene.
fn point_of(params: &Path, opened: &Opened) -> Result<Point, String> {
    let scene = &opened.baked.scene;
    let file = ParamsFile::read(params, scene.form, &scene.params).map_err(|error| error.to_string())?;
    let file = file.of_scene(&scene.path);
    let mut gains = opened.baked.gains.clone();
    files::take_gains(&file, opened.views(), &mut gains);
    Ok(Point { params: file.params, gains })
}

/// Do long work on a thread of its own; in a browser's worker, which is one, at once.
fn aside(work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    #[cfg(target_family = "wasm")]
    work();
    #[cfg(not(target_family = "wasm"))]
    std::thread::Builder::new().name("open".to_owned()).spawn(work)?;
    Ok(())
}

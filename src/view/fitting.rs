//! A fit that runs beside the window, and can be paused.
//!
//! - `thread`: one on a thread of this process

#[cfg(not(target_family = "wasm"))]
mod thread;

use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use crate::engine::Point;
use crate::fit::outcome::Iteration;
use crate::host::{FitRequest, Fitted, Host};
use crate::model::params::Column;
use crate::paint::Wake;
#[cfg(not(target_family = "wasm"))]
pub use thread::on_a_thread;

/// An iteration, and where it has led.
#[derive(Clone, Debug)]
pub struct Step {
    /// Its number and its loss.
    pub iteration: Iteration,
    /// Where it stands after it, in each scene.
    pub points: Vec<Point>,
}

/// What a fit says.
#[derive(Debug)]
pub enum Message {
    /// It has made a step.
    Step(Box<Step>),
    /// It is over; its run folder is written.
    Done(Box<Result<Fitted, String>>),
}

/// Where a fit says it.
#[derive(Clone)]
pub struct Tell {
    send: Sender<Message>,
    wake: Wake,
}

impl fmt::Debug for Tell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tell").finish_non_exhaustive()
    }
}

impl Tell {
    /// Say it, and wake whoever listens.
    pub fn say(&self, message: Message) {
        // The window may be gone.
        let _ = self.send.send(message);
        (self.wake)();
    }
}

/// A fit under way, from beside it. Dropped, it is stopped, and waited for where it leaves files.
pub trait FitControl: fmt::Debug + Send {
    /// Have it wait after the iteration that it is at, or go on.
    fn set_paused(&mut self, paused: bool);
    /// Whether it is to wait.
    fn is_paused(&self) -> bool;
    /// Have it end soon, with what it has found.
    fn stop(&mut self);
}

/// A fit under way.
#[derive(Debug)]
pub struct Fitting {
    /// The run folder.
    pub run: PathBuf,
    messages: Receiver<Message>,
    control: Box<dyn FitControl>,
}

impl Fitting {
    /// Begin.
    #[must_use]
    pub fn begin(host: &Arc<dyn Host>, request: FitRequest, wake: Wake) -> Self {
        let (send, messages) = channel();
        let run = request.run.clone();
        Self { run, messages, control: host.begin_fit(request, Tell { send, wake }) }
    }

    /// What it said since. One that ended without a word is told as a fit that failed.
    pub fn messages(&self) -> Vec<Message> {
        let mut messages: Vec<Message> = self.messages.try_iter().collect();
        let over = |message: &Message| matches!(message, Message::Done(_));
        let gone = match self.messages.try_recv() {
            Ok(message) => {
                messages.push(message);
                false
            }
            Err(error) => error == TryRecvError::Disconnected,
        };
        if gone && !messages.iter().any(over) {
            let words = "the fit ended by a fault of skinfit's, told on standard error. Please report it.";
            messages.push(Message::Done(Box::new(Err(words.to_owned()))));
        }
        messages
    }

    /// Have it wait after the iteration that it is at, or go on.
    pub fn set_paused(&mut self, paused: bool) {
        self.control.set_paused(paused);
    }

    /// Whether it is to wait.
    #[must_use]
    pub fn is_paused(&self) -> bool {
        self.control.is_paused()
    }

    /// Have it end soon, with what it has found.
    pub fn stop(&mut self) {
        self.control.stop();
    }
}

/// How far a scene's constant has come of its way from the first step to the last; all 0 where it did not move.
#[must_use]
pub fn shares(path: &[Step], scene: usize, column: Column) -> Vec<[f64; 2]> {
    let value = |step: &Step| step.points.get(scene).map_or(0.0, |point| column.get(&point.params));
    let (Some(first), Some(last)) = (path.first().map(value), path.last().map(value)) else {
        return Vec::new();
    };
    let way = if last == first { 1.0 } else { last - first };
    path.iter().enumerate().map(|(i, step)| [i as f64, (value(step) - first) / way]).collect()
}

//! A fit that runs beside the window, and can be paused.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::engine::Point;
use crate::fit::outcome::Iteration;
use crate::host::{FitRequest, Fitted, Host};
use crate::paint::Wake;

/// An iteration, and where it has led.
#[derive(Clone, Debug)]
pub struct Step {
    /// Its number and its loss.
    pub iteration: Iteration,
    /// The constants after it.
    pub point: Point,
}

/// What a fit says.
#[derive(Debug)]
pub enum Message {
    /// It has made a step.
    Step(Box<Step>),
    /// It is over; its run folder is written.
    Done(Box<Result<Fitted, String>>),
}

/// A fit under way. Dropped, it is interrupted and waited for: its run folder can be resumed.
#[derive(Debug)]
pub struct Fitting {
    /// The run folder.
    pub run: PathBuf,
    messages: Receiver<Message>,
    interrupt: Arc<AtomicBool>,
    pause: Arc<Pause>,
    thread: Option<JoinHandle<()>>,
}

/// Whether it is to wait, and who waits for that to change.
#[derive(Debug, Default)]
struct Pause {
    paused: Mutex<bool>,
    changed: Condvar,
}

impl Pause {
    fn set(&self, paused: bool) {
        *self.paused.lock().unwrap_or_else(PoisonError::into_inner) = paused;
        self.changed.notify_all();
    }

    fn get(&self) -> bool {
        *self.paused.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wait for as long as it is paused.
    fn wait(&self) {
        let paused = self.paused.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self.changed.wait_while(paused, |paused| *paused));
    }
}

impl Fitting {
    /// Begin.
    #[must_use]
    pub fn begin(host: Arc<dyn Host>, request: FitRequest, wake: Wake) -> Self {
        let (send, messages) = channel();
        let (interrupt, pause) = (Arc::new(AtomicBool::new(false)), Arc::new(Pause::default()));
        let run = request.run.clone();
        let (stop, theirs) = (Arc::clone(&interrupt), Arc::clone(&pause));
        let thread = std::thread::Builder::new().name("fit".to_owned());
        let work = move || {
            let mut watch = |iteration: &Iteration, point: &Point| {
                // The window may be gone.
                let _ =
                    send.send(Message::Step(Box::new(Step { iteration: *iteration, point: point.clone() })));
                wake();
                theirs.wait();
            };
            let done = host.fit(&request, &mut watch, &stop);
            let _ = send.send(Message::Done(Box::new(done)));
            wake();
        };
        Self { run, messages, interrupt, pause, thread: thread.spawn(work).ok() }
    }

    /// What it said since. A thread that ended without a word is told as a fit that failed.
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
    pub fn set_paused(&self, paused: bool) {
        self.pause.set(paused);
    }

    /// Whether it is to wait.
    #[must_use]
    pub fn is_paused(&self) -> bool {
        self.pause.get()
    }

    /// Have it end soon, with what it has found.
    pub fn stop(&self) {
        self.interrupt.store(true, Ordering::SeqCst);
        self.pause.set(false);
    }
}

impl Drop for Fitting {
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = self.thread.take() {
            // A panic of the fit's has been told on standard error.
            let _ = thread.join();
        }
    }
}

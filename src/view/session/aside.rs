//! What takes a while, beside the window: in a browser's worker, which is so itself, at once.

use std::sync::mpsc::{Receiver, Sender, channel};
#[cfg(not(target_family = "wasm"))]
use std::thread::JoinHandle;

use crate::paint::Wake;

/// Work under way, and what it says.
pub(super) struct Aside {
    wake: Wake,
    say: Sender<String>,
    told: Receiver<String>,
    #[cfg(not(target_family = "wasm"))]
    threads: Vec<JoinHandle<()>>,
}

impl Aside {
    pub(super) fn new(wake: Wake) -> Self {
        let (say, told) = channel();
        Self {
            wake,
            say,
            told,
            #[cfg(not(target_family = "wasm"))]
            threads: Vec::new(),
        }
    }

    /// Begin; what it ends with is told.
    pub(super) fn begin(&mut self, work: impl FnOnce() -> String + Send + 'static) {
        let (say, wake) = (self.say.clone(), self.wake.clone());
        let work = move || {
            // The window may be gone.
            let _ = say.send(work());
            wake();
        };
        #[cfg(target_family = "wasm")]
        work();
        #[cfg(not(target_family = "wasm"))]
        match std::thread::Builder::new().name("aside".to_owned()).spawn(work) {
            Ok(thread) => self.threads.push(thread),
            Err(error) => drop(self.say.send(format!("no thread can be had: {error}"))),
        }
    }

    /// What was said since.
    pub(super) fn told(&mut self) -> Vec<String> {
        #[cfg(not(target_family = "wasm"))]
        self.threads.retain(|thread| !thread.is_finished());
        self.told.try_iter().collect()
    }

    /// Whether nothing is under way.
    #[expect(clippy::unused_self, reason = "of threads alone there is some")]
    #[cfg(target_family = "wasm")]
    pub(super) const fn is_idle(&self) -> bool {
        true
    }

    /// Whether nothing is under way.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn is_idle(&self) -> bool {
        self.threads.iter().all(JoinHandle::is_finished)
    }
}

/// What was begun is brought to its end: a file that was to be saved is.
#[cfg(not(target_family = "wasm"))]
impl Drop for Aside {
    fn drop(&mut self) {
        for thread in self.threads.drain(..) {
            // A panic of its own has been told on standard error.
            let _ = thread.join();
        }
    }
}

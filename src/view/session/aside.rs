//! What takes a while, beside the window, one after the other: in a browser's worker, which is so itself, at once.

use std::sync::mpsc::{Receiver, Sender, channel};

use crate::paint::Wake;

/// What is to be done; some of it has words at its end.
type Work = Box<dyn FnOnce() -> Option<String> + Send>;

/// Work under way, and what it says.
pub(super) struct Aside {
    say: Sender<Option<String>>,
    told: Receiver<Option<String>>,
    wake: Wake,
    /// What was begun and has not said that it is over.
    under_way: usize,
    #[cfg(not(target_family = "wasm"))]
    thread: Option<(Sender<Work>, std::thread::JoinHandle<()>)>,
}

impl Aside {
    pub(super) fn new(wake: Wake) -> Self {
        let (say, told) = channel();
        Self {
            say,
            told,
            wake,
            under_way: 0,
            #[cfg(not(target_family = "wasm"))]
            thread: None,
        }
    }

    /// Begin; what it ends with is told.
    pub(super) fn begin(&mut self, work: impl FnOnce() -> String + Send + 'static) {
        self.queue(Box::new(move || Some(work())));
    }

    /// Begin something that says nothing.
    pub(super) fn begin_quietly(&mut self, work: impl FnOnce() + Send + 'static) {
        self.queue(Box::new(move || {
            work();
            None
        }));
    }

    #[cfg(target_family = "wasm")]
    fn queue(&mut self, work: Work) {
        self.under_way += 1;
        // The receiver is here.
        let _ = self.say.send(work());
        (self.wake)();
    }

    #[cfg(not(target_family = "wasm"))]
    fn queue(&mut self, work: Work) {
        self.under_way += 1;
        let (say, wake) = (self.say.clone(), self.wake.clone());
        if self.thread.is_none() {
            let (send, works) = channel::<Work>();
            let run = move || {
                for work in works {
                    let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
                    let fault = "a fault of skinfit's, told on standard error. Please report it.";
                    // The window may be gone.
                    let _ = say.send(done.unwrap_or_else(|_| Some(fault.to_owned())));
                    wake();
                }
            };
            let thread = std::thread::Builder::new().name("aside".to_owned()).spawn(run);
            self.thread = thread.ok().map(|thread| (send, thread));
        }
        if self.thread.as_ref().is_none_or(|(send, _)| send.send(work).is_err()) {
            // The receiver is here.
            let _ = self.say.send(Some("no thread can be had to write a file. Try again.".to_owned()));
        }
    }

    /// What was said since.
    pub(super) fn told(&mut self) -> Vec<String> {
        let said: Vec<Option<String>> = self.told.try_iter().collect();
        self.under_way = self.under_way.saturating_sub(said.len());
        said.into_iter().flatten().collect()
    }

    /// Whether nothing is under way.
    pub(super) const fn is_idle(&self) -> bool {
        self.under_way == 0
    }
}

/// What was begun is brought to its end: a file that was to be saved is.
#[cfg(not(target_family = "wasm"))]
impl Drop for Aside {
    fn drop(&mut self) {
        if let Some((send, thread)) = self.thread.take() {
            drop(send);
            // Panics of what it does are caught there.
            let _ = thread.join();
        }
    }
}

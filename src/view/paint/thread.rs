//! The worker on a thread.

use std::sync::{Arc, Condvar, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use super::work::{Piece, Work};
use super::{QUIET, Shared};

/// Who waits for a request.
#[derive(Default)]
pub(super) struct Changed(Condvar);

impl Changed {
    pub(super) fn tell(&self) {
        self.0.notify_one();
    }
}

/// The thread.
pub(super) struct Task(Option<JoinHandle<()>>);

impl Task {
    /// Do the `work` until it is over; it is made on the thread.
    pub(super) fn begin(shared: Arc<Shared>, work: impl FnOnce() -> Work + Send + 'static) -> Self {
        let thread = std::thread::Builder::new().name("paint".to_owned());
        let run = move || {
            let mut work = work();
            while let Some(piece) = next(&shared) {
                pollster::block_on(work.step(piece, &shared));
            }
        };
        Self(thread.spawn(run).ok())
    }

    pub(super) fn is_over(&self) -> bool {
        self.0.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Wait for its end.
    pub(super) fn end(&mut self) {
        if let Some(thread) = self.0.take() {
            // A panic of the worker's has been told on standard error.
            let _ = thread.join();
        }
    }
}

/// Wait for something to do; `None` when it is over.
fn next(shared: &Shared) -> Option<Piece> {
    let mut wanted = shared.wanted();
    let mut quiet = false;
    loop {
        if wanted.over {
            return None;
        }
        if let Some(piece) = wanted.next(quiet) {
            return Some(piece);
        }
        let Changed(changed) = &shared.changed;
        if wanted.follow.is_empty() {
            wanted = changed.wait(wanted).unwrap_or_else(PoisonError::into_inner);
        } else {
            let long = Duration::from_millis(u64::from(QUIET));
            let (woken, waited) = changed.wait_timeout(wanted, long).unwrap_or_else(PoisonError::into_inner);
            (wanted, quiet) = (woken, waited.timed_out());
        }
    }
}

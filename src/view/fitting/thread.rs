//! A fit on a thread.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;

use rayon::ThreadPoolBuilder;
use thread_priority::{ThreadPriority, set_current_thread_priority};

use super::{FitControl, Message, Step, Tell};
use crate::engine::Point;
use crate::fit::outcome::Iteration;
use crate::host::Fitted;

/// What is done at each iteration; the fit goes on when it returns.
type Watch<'a> = dyn FnMut(&Iteration, &[Point]) + 'a;

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

#[derive(Debug)]
struct Threaded {
    interrupt: Arc<AtomicBool>,
    pause: Arc<Pause>,
    thread: Option<JoinHandle<()>>,
}

/// Begin `fit` on a thread: it is given what it is to call at each iteration, and a flag; it ends soon after that is set,
/// with a state to be resumed.
pub fn on_a_thread(
    tell: Tell,
    fit: impl FnOnce(&mut Watch<'_>, &Arc<AtomicBool>) -> Result<Fitted, String> + Send + 'static,
) -> Box<dyn FitControl> {
    let (interrupt, pause) = (Arc::new(AtomicBool::new(false)), Arc::new(Pause::default()));
    let (stop, theirs) = (Arc::clone(&interrupt), Arc::clone(&pause));
    let thread = std::thread::Builder::new().name("fit".to_owned());
    let work = move || {
        let mut watch = |iteration: &Iteration, points: &[Point]| {
            let step = Step { iteration: *iteration, points: points.to_vec() };
            tell.say(Message::Step(Box::new(step)));
            theirs.wait();
        };
        let done = fit(&mut watch, &stop);
        tell.say(Message::Done(Box::new(done)));
    };
    // What it shares out among threads of its own gives way, too; there are as many as the program may have.
    let count = rayon::current_num_threads();
    let run = move || match ThreadPoolBuilder::new().num_threads(count).start_handler(|_| give_way()).build()
    {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    };
    Box::new(Threaded { interrupt, pause, thread: thread.spawn(run).ok() })
}

/// Have this thread give way to those that draw: a window that stutters while a fit runs is of less use than a fit that
/// takes a little longer.
fn give_way() {
    // Where the system does not let a thread do so, it competes as any other.
    let _ = set_current_thread_priority(ThreadPriority::Min);
}

impl FitControl for Threaded {
    fn set_paused(&mut self, paused: bool) {
        self.pause.set(paused);
    }

    fn is_paused(&self) -> bool {
        self.pause.get()
    }

    fn stop(&mut self) {
        self.interrupt.store(true, Ordering::SeqCst);
        self.pause.set(false);
    }
}

impl Drop for Threaded {
    fn drop(&mut self) {
        self.stop();
        if let Some(thread) = self.thread.take() {
            // A panic of the fit's has been told on standard error.
            let _ = thread.join();
        }
    }
}

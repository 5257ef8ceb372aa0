//! Long work beside Python: on a thread of its own, while the caller waits in slices, without Python's lock, and hears
//! Ctrl-C in between. The work never takes that lock, so threads that it shares itself out among cannot wait for it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use pyo3::{PyErr, PyResult, Python};

use crate::errors::{Fault, Refused};

/// How long Ctrl-C may go unheard.
pub(crate) const SLICE: Duration = Duration::from_millis(50);

/// What a lock holds: no thread leaves it half changed.
pub(crate) fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What becomes of work; a panic is a fault, and does not reach Python as one.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, Refused> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let words = panic.downcast_ref::<String>().cloned();
        let words = words.or_else(|| panic.downcast_ref::<&str>().map(|&words| words.to_owned()));
        Refused::Fault(words.unwrap_or_default())
    })
}

/// Do some work at once, where it is quick.
pub(crate) fn here<T, E: Into<PyErr>>(work: impl FnOnce() -> Result<T, E>) -> PyResult<T> {
    guarded(work)?.map_err(Into::into)
}

/// The process in which work has begun.
static PROCESS: OnceLock<u32> = OnceLock::new();

/// Refuse to wait for threads that a fork has left behind.
pub(crate) fn not_forked() -> Result<(), Refused> {
    let own = std::process::id();
    if *PROCESS.get_or_init(|| own) == own { Ok(()) } else { Err(Refused::Forked) }
}

/// Begin some work on a thread of its own.
pub(crate) fn begin(name: &str, work: impl FnOnce() + Send + 'static) -> PyResult<()> {
    not_forked()?;
    std::thread::Builder::new().name(name.to_owned()).spawn(work)?;
    Ok(())
}

/// The next that `messages` brings. Python goes on meanwhile.
///
/// # Errors
/// What a handler of a signal raises, as Ctrl-C does; nothing is lost then. A fault where nobody is left to send.
pub(crate) fn next<T: Send>(py: Python<'_>, messages: &Mutex<Receiver<T>>) -> PyResult<T> {
    loop {
        match py.detach(|| locked(messages).recv_timeout(SLICE)) {
            Ok(message) => return Ok(message),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Fault::new_err("the work ended without a word."));
            }
        }
    }
}

/// Do some work and wait for it. After Ctrl-C nobody waits for it any more: what it yields is dropped.
pub(crate) fn wait<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Refused> + Send + 'static,
) -> PyResult<T> {
    let (send, receive) = channel();
    let run = move || {
        // Who waited may be gone.
        let _ = send.send(guarded(work));
    };
    begin("skinfit", run)?;
    next(py, &Mutex::new(receive))?.flatten().map_err(PyErr::from)
}

//! How far long work is, for the window's status line.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use skinfit_core::progress::{Progress, Steps, watch};

/// A piece of work.
struct Piece {
    name: &'static str,
    steps: Option<u64>,
    done: AtomicU64,
}

static WORK: Mutex<BTreeMap<u64, Arc<Piece>>> = Mutex::new(BTreeMap::new());
static NUMBER: AtomicU64 = AtomicU64::new(0);
static WATCHED: OnceLock<()> = OnceLock::new();

struct Watcher;
struct Under(u64, Arc<Piece>);

impl Progress for Watcher {
    fn begin(&self, name: &'static str, steps: Option<u64>) -> Box<dyn Steps> {
        let piece = Arc::new(Piece { name, steps, done: AtomicU64::new(0) });
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        WORK.lock().unwrap_or_else(PoisonError::into_inner).insert(number, Arc::clone(&piece));
        Box::new(Under(number, piece))
    }
}

impl Steps for Under {
    fn advance(&self, steps: u64) {
        self.1.done.fetch_add(steps, Ordering::Relaxed);
    }
}

impl Drop for Under {
    fn drop(&mut self) {
        WORK.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.0);
    }
}

/// Watch the library's work from now on, for the status line; the first watcher of a process stays.
pub fn watch_progress() {
    WATCHED.get_or_init(|| {
        let _ = watch(Watcher);
    });
}

/// What is under way, as `occlusion 34%`.
#[must_use]
pub(crate) fn words() -> Option<String> {
    let work = WORK.lock().unwrap_or_else(PoisonError::into_inner);
    let words = work.values().map(|piece| match piece.steps {
        Some(steps) if steps > 0 => {
            format!("{} {}%", piece.name, 100 * piece.done.load(Ordering::Relaxed).min(steps) / steps)
        }
        _ => piece.name.to_owned(),
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| words.join(", "))
}

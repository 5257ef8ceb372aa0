//! How far long work is, told to the page while the worker is at it.

use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicU64, Ordering};

use js_sys::Function;
use wasm_bindgen::JsValue;
use web_time::Instant;

use crate::progress::{Progress, Steps, watch};

thread_local! {
    static TELL: RefCell<Option<Function>> = const { RefCell::new(None) };
    static LAST: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// Milliseconds between words.
const EVERY: u128 = 100;

/// Have `tell` called with words on long work, as `occlusion 34%`.
pub(crate) fn tell_progress(tell: Function) {
    TELL.set(Some(tell));
    let _ = watch(Watcher);
}

struct Watcher;

struct Piece {
    name: &'static str,
    steps: Option<u64>,
    done: AtomicU64,
}

impl Progress for Watcher {
    fn begin(&self, name: &'static str, steps: Option<u64>) -> Box<dyn Steps> {
        Box::new(Piece { name, steps, done: AtomicU64::new(0) })
    }
}

impl Steps for Piece {
    fn advance(&self, steps: u64) {
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        if LAST.get().is_some_and(|last| last.elapsed().as_millis() < EVERY) {
            return;
        }
        LAST.set(Some(Instant::now()));
        say(&match self.steps {
            Some(all) if all > 0 => format!("{} {}%", self.name, 100 * done.min(all) / all),
            _ => self.name.to_owned(),
        });
    }
}

impl Drop for Piece {
    fn drop(&mut self) {
        say("");
    }
}

fn say(words: &str) {
    TELL.with_borrow(|tell| {
        if let Some(tell) = tell {
            // A page that does not listen loses nothing but words.
            let _ = tell.call1(&JsValue::UNDEFINED, &words.into());
        }
    });
}

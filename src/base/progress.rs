//! How far long work is, told to whoever watches.
//!
//! The library draws nothing itself: a program that wants to show its progress gives [`watch`] a [`Progress`], once,
//! as it would give `log` a logger. Nobody watching costs nothing.

use std::sync::OnceLock;

/// Is told of all long work in the process.
pub trait Progress: Send + Sync {
    /// Work begins: a name of one word, and its steps where their number is known.
    fn begin(&self, name: &'static str, steps: Option<u64>) -> Box<dyn Steps>;
}

/// Is told of one piece of work, by any of its threads; dropped when the work ends.
pub trait Steps: Send + Sync {
    /// `steps` more steps are done.
    fn advance(&self, steps: u64);
    /// What is being done now, in a few words.
    fn describe(&self, _words: &str) {}
}

static WATCHER: OnceLock<Box<dyn Progress>> = OnceLock::new();

/// Let `watcher` be told of all work that begins from now on. The first one stays: `false` says that there was one.
pub fn watch(watcher: impl Progress + 'static) -> bool {
    WATCHER.set(Box::new(watcher)).is_ok()
}

/// A piece of work under way; it ends when this is dropped.
pub struct Work(Option<Box<dyn Steps>>);

impl std::fmt::Debug for Work {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Work").field("watched", &self.0.is_some()).finish()
    }
}

/// Begin work of `steps` steps, told of as `name`.
#[must_use]
pub fn bar(name: &'static str, steps: u64) -> Work {
    Work(WATCHER.get().map(|watcher| watcher.begin(name, Some(steps))))
}

impl Work {
    /// `steps` more steps are done.
    pub fn inc(&self, steps: u64) {
        if let Some(work) = &self.0 {
            work.advance(steps);
        }
    }

    /// What is being done now, in a few words.
    pub fn set_message(&self, words: impl AsRef<str>) {
        if let Some(work) = &self.0 {
            work.describe(words.as_ref());
        }
    }

    /// The work is done.
    pub fn finish_and_clear(self) {
        drop(self);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    static TOLD: Mutex<Vec<String>> = Mutex::new(Vec::new());

    fn tell(words: String) {
        TOLD.lock().unwrap().push(words);
    }

    struct Listener;

    impl Progress for Listener {
        fn begin(&self, name: &'static str, steps: Option<u64>) -> Box<dyn Steps> {
            // Other tests of this process work, too.
            if name == "listened" {
                tell(format!("{name} {steps:?}"));
            }
            Box::new(Heard(name))
        }
    }

    struct Heard(&'static str);

    impl Steps for Heard {
        fn advance(&self, steps: u64) {
            if self.0 == "listened" {
                tell(format!("+{steps}"));
            }
        }
        fn describe(&self, words: &str) {
            if self.0 == "listened" {
                tell(words.to_owned());
            }
        }
    }

    impl Drop for Heard {
        fn drop(&mut self) {
            if self.0 == "listened" {
                tell("end".to_owned());
            }
        }
    }

    #[test]
    fn a_watcher_hears_of_work_from_its_beginning_to_its_end_and_the_first_one_stays() {
        assert!(watch(Listener));
        assert!(!watch(Listener));
        let work = bar("listened", 3);
        work.inc(2);
        work.set_message("the last");
        work.inc(1);
        work.finish_and_clear();
        assert_eq!(*TOLD.lock().unwrap(), ["listened Some(3)", "+2", "the last", "+1", "end"]);
    }
}

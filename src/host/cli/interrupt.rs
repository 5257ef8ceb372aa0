//! Ctrl-C once a fit is under way: the first asks it to stop and to leave what it has, the second ends the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::unfinished;

/// Whether somebody pressed Ctrl-C since it is watched for.
#[derive(Default)]
pub(super) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// One that something else may set, too.
    pub(super) fn of(flag: &Arc<AtomicBool>) -> Self {
        Self(Arc::clone(flag))
    }

    /// Whether it was set.
    pub(super) fn is_set(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }

    /// Watch for Ctrl-C from now on: the flag that it sets.
    pub(super) fn watch(&self) -> Arc<AtomicBool> {
        unfinished::asked_through(&self.0);
        Arc::clone(&self.0)
    }
}

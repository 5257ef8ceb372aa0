//! Ctrl-C: the first asks a fit to stop and to leave what it has, the second ends the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether somebody pressed Ctrl-C since it is watched for.
#[derive(Default)]
pub(super) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Watch for Ctrl-C from now on, if nobody does so yet: the flag that it sets.
    pub(super) fn watch(&self) -> Arc<AtomicBool> {
        let flag = Arc::clone(&self.0);
        // Refused only if a handler is there already: this one, or else Ctrl-C ends the program as it always did.
        let _ = ctrlc::set_handler(move || {
            // Pressed twice, it is meant at once; a state is at most a second old.
            if flag.swap(true, Ordering::SeqCst) {
                std::process::exit(1);
            }
        });
        Arc::clone(&self.0)
    }
}

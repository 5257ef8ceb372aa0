//! Panics on purpose: a test sees by them what becomes of one on each way into the library.

use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::{PyResult, Python, pyfunction};

use crate::errors::Refused;
use crate::waiting::{here, wait};

/// Whether the next step of a fit panics.
static IN_A_FIT: AtomicBool = AtomicBool::new(false);

/// Panic where a test says: in a `call`, in `work` on a thread of its own, or in the next step of a `fit`.
#[pyfunction]
#[pyo3(name = "_panic")]
pub(crate) fn provoke(py: Python<'_>, place: &str) -> PyResult<()> {
    match place {
        "call" => here(panics),
        "work" => wait(py, panics),
        "fit" => {
            IN_A_FIT.store(true, Ordering::SeqCst);
            Ok(())
        }
        _ => Err(Refused::Array(format!("`{place}` is none of call, work and fit.")).into()),
    }
}

/// Panic where the next step of a fit is to.
pub(crate) fn provoked() {
    if IN_A_FIT.swap(false, Ordering::SeqCst) {
        let _ = panics();
    }
}

fn panics() -> Result<(), Refused> {
    std::panic::panic_any("a panic on purpose")
}

//! What is raised: a class a kind, with the paragraph that the command line prints. The classes are Python's
//! (`skinfit.errors`).

use pyo3::{PyErr, import_exception};
use skinfit_core::output::OutputError;
use skinfit_core::prepare::PrepareError;
use skinfit_core::program::shading::ShadingError;
use skinfit_core::samples::SampleError;
use skinfit_gpu::painter::PaintError;

import_exception!(skinfit.errors, ArrayError);
import_exception!(skinfit.errors, BakeError);
import_exception!(skinfit.errors, DeviceError);
import_exception!(skinfit.errors, Error);
import_exception!(skinfit.errors, Fault);
import_exception!(skinfit.errors, FileError);
import_exception!(skinfit.errors, FitError);
import_exception!(skinfit.errors, ParamError);
import_exception!(skinfit.errors, SceneError);
import_exception!(skinfit.errors, SkinError);
import_exception!(skinfit.errors, ViewError);

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refused {
    /// A stage before the fit.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// An image that is drawn.
    #[error(transparent)]
    Paint(#[from] PaintError),
    /// Samples of a view.
    #[error(transparent)]
    Samples(#[from] SampleError),
    /// Rules that the processor cannot compute.
    #[error("{0}.")]
    Shading(#[from] ShadingError),
    /// A file that cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A fit, in the command line's words as Python has them.
    #[error("{0}")]
    Fit(String),
    /// A scene's file that cannot be written.
    #[error("{0}")]
    File(String),
    /// Effects that there are not.
    #[error("{0}")]
    Scene(String),
    /// A name or a value of a parameter.
    #[error("{0}")]
    Param(String),
    /// A view that there is not.
    #[error("{0}")]
    View(String),
    /// An adapter that cannot, or a library without what runs on one.
    #[error("{0}")]
    Device(String),
    /// What an array has to be.
    #[error("{0}")]
    Array(String),
    /// Work in a child of the process that had begun it.
    #[error(
        "this process was forked from one in which skinfit had begun to work, and has none of its threads. Start \
         processes by `spawn`: multiprocessing.set_start_method(\"spawn\")."
    )]
    Forked,
    /// A panic.
    #[error("{0}. This is a fault of skinfit's: please report it.")]
    Fault(String),
}

impl From<Refused> for PyErr {
    fn from(refused: Refused) -> Self {
        refused.raised()
    }
}

impl Refused {
    /// What is raised; it may be so more than once.
    pub(crate) fn raised(&self) -> PyErr {
        let words = self.to_string();
        match self {
            Self::Prepare(error) => of_stage(error, words),
            Self::Paint(_) | Self::Samples(_) | Self::Shading(_) | Self::Scene(_) => {
                SceneError::new_err(words)
            }
            Self::Output(_) | Self::File(_) => FileError::new_err(words),
            Self::Fit(_) => FitError::new_err(words),
            Self::Param(_) => ParamError::new_err(words),
            Self::View(_) => ViewError::new_err(words),
            Self::Device(_) => DeviceError::new_err(words),
            Self::Array(_) => ArrayError::new_err(words),
            Self::Forked => Error::new_err(words),
            Self::Fault(_) => Fault::new_err(words),
        }
    }
}

/// The class of a stage's error.
fn of_stage(error: &PrepareError, words: String) -> PyErr {
    match error {
        PrepareError::Params(_) => ParamError::new_err(words),
        PrepareError::Bake(_) => BakeError::new_err(words),
        PrepareError::NoView { .. } | PrepareError::HoldOut(_) => ViewError::new_err(words),
        PrepareError::NotOneSkin(_)
        | PrepareError::NamedTwice { .. }
        | PrepareError::CalledTheSame { .. }
        | PrepareError::Joint(_)
        | PrepareError::NoScene => SkinError::new_err(words),
        PrepareError::Scene(_)
        | PrepareError::Samples(_)
        | PrepareError::Target { .. }
        | PrepareError::Collapsed { .. }
        | PrepareError::Shading { .. }
        | PrepareError::NoTarget { .. } => SceneError::new_err(words),
    }
}

//! How a study may fail.

use crate::fit::FitError;
use crate::gpu::GpuError;
use crate::output::OutputError;
use crate::prepare::PrepareError;
use crate::program::shading::ShadingError;
use crate::render::files::ImageFileError;
use crate::shader::PlanError;
use crate::shader::term::TermError;

/// A study cannot be done.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "most variants are the stage's own error")]
pub enum StudyError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A fit, and the scene that it was of.
    #[error("{scene}: {error}")]
    Fit { scene: String, error: FitError },
    #[error(transparent)]
    Shading(#[from] ShadingError),
    /// A light's effect could not be made.
    #[error("{scene}: {error}")]
    Light { scene: String, error: TermError },
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error("{0} Update its driver, or choose another adapter with WGPU_ADAPTER_NAME.")]
    Gpu(#[from] GpuError),
    /// An axis was named that the scene does not ask for.
    #[error("the axis {axis}: {why}. Leave it out, or name a scene that does.")]
    Idle { axis: &'static str, why: &'static str },
    /// An axis was named along which several scenes cannot be taken together.
    #[error("the axis {axis}: {why}. Leave it out, or study the scenes one by one.")]
    Apart { axis: &'static str, why: &'static str },
    /// Something is to be held out, and nothing is fitted.
    #[error(
        "views are to be held out, but of the axes to be swept ({swept}) none fits anything that a view could be left out of. \
         Sweep some of {fitting}, too, or hold none out."
    )]
    NothingFitted { swept: String, fitting: String },
    /// A goal, and no axis whose settings could meet it.
    #[error(
        "{goal}: of the axes to be swept ({swept}) none can be set in a scene file, so there is nothing to choose. \
         Sweep some of {settable}, too."
    )]
    NothingToSet { goal: &'static str, swept: String, settable: String },
    /// Nothing is left to be scored on.
    #[error(
        "{scene}: has {views} views with targets, but effects are judged on views that their fit did not see. Give it two \
         or more."
    )]
    FewViews { scene: String, views: usize },
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Image(#[from] ImageFileError),
}

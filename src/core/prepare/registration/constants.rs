//! The constants that images are drawn with.

use super::super::{Baked, PrepareError};
use crate::fit::{self, FitOptions};
use crate::model::params::Params;

/// Enough for constants that are near: what is left is far below what a camera's error does to them.
const ITERATIONS: u64 = 20;

/// The constants that are fitted under the cameras as they stand; `None` where nothing is free, or nothing can be fitted,
/// which the fit itself will tell.
///
/// # Errors
/// When the views cannot be sampled, or their rules not be computed.
pub(super) fn fitted(baked: &Baked) -> Result<Option<Params>, PrepareError> {
    if baked.unknowns().is_empty() {
        return Ok(None);
    }
    // One sample a pixel: constants are means over thousands of pixels.
    let observed =
        baked.clone().with_scene(|scene| scene.quality.samples_per_axis = 1).sample()?.observe()?;
    let options = FitOptions { max_iterations: Some(ITERATIONS), ..FitOptions::default() };
    let outcome = fit::fit(&observed.engine()?, &observed.start(), &options, &mut |_| {});
    Ok(outcome.ok().map(|outcome| outcome.end.params))
}

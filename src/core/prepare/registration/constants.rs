//! The constants that images are drawn with.

use super::super::{Baked, PrepareError};
use crate::fit::{self, FitOptions};
use crate::model::params::Params;

/// Enough for constants that are near: what is left is far below what a camera's error does to them.
const ITERATIONS: u64 = 20;

/// The constants that are fitted under the cameras as they stand, without the views that are `held_out`; `None` where
/// nothing is free, or nothing can be fitted, which the fit itself will tell.
///
/// # Errors
/// When the views cannot be sampled, or their rules not be computed.
pub(super) fn fitted(baked: &Baked, held_out: &[bool]) -> Result<Option<Params>, PrepareError> {
    let mut kept = baked.clone().with_scene(|scene| {
        scene.views = seen(std::mem::take(&mut scene.views), held_out);
        // Constants are means over thousands of pixels.
        scene.quality.samples_per_axis = 1;
    });
    kept.gains = seen(kept.gains, held_out);
    if kept.unknowns().is_empty() || kept.scene.views.iter().all(|view| view.target.is_none()) {
        return Ok(None);
    }
    let observed = kept.sample()?.observe()?;
    let options = FitOptions { max_iterations: Some(ITERATIONS), ..FitOptions::default() };
    let outcome = fit::fit(&observed.engine()?, &observed.start(), &options, &mut |_| {});
    Ok(outcome.ok().map(|outcome| outcome.end.params))
}

/// Those of a list, one a view, that are not held out.
fn seen<T>(list: Vec<T>, held_out: &[bool]) -> Vec<T> {
    let of_view = list.into_iter().enumerate();
    of_view.filter(|(i, _)| held_out.get(*i) != Some(&true)).map(|(_, item)| item).collect()
}

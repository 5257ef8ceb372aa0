//! Views that a fit does not see: it is scored on them.

use web_time::Instant;

use super::observed::beside;
use super::{Baked, PrepareError, StageSeconds, silhouettes};
use crate::engine::view::ObservedView;
use crate::model::gain::Gain;
use crate::samples;
use crate::scene::Scene;
use crate::scene::view::View;

/// Views of a scene that take no part in its fit, beside what was observed there.
#[derive(Clone, Debug, Default)]
pub struct HeldOut {
    /// The views; each has a target.
    pub views: Vec<View>,
    /// A factor on each view's image: as the fit found it, for nothing fits it.
    pub gains: Vec<Gain>,
    /// Their samples and targets.
    pub observed: Vec<ObservedView>,
}

impl HeldOut {
    /// Whether nothing is left of the scene to be fitted: all that it could be compared with is held out.
    #[must_use]
    pub fn is_all_of(&self, scene: &Scene) -> bool {
        !self.views.is_empty() && scene.views.iter().all(|view| view.target.is_none())
    }
}

impl Baked {
    /// Take the marked views out of the scene, and sample them here: the processor does it, whatever makes the others'
    /// samples. Nothing else of the scene is copied.
    ///
    /// # Errors
    /// When a marked view has no target or sees nothing of the mesh, or no pixel of its target counts.
    pub fn hold_out(mut self, marked: &[bool]) -> Result<(Self, HeldOut), PrepareError> {
        if !marked.contains(&true) {
            return Ok((self, HeldOut::default()));
        }
        let start = Instant::now();
        let mut held = HeldOut::default();
        let (mut gains, before) = (Vec::new(), std::mem::take(&mut self.gains));
        let own = |i: usize| before.get(i).copied().unwrap_or_default();
        let mut baked = self.with_scene(|scene| {
            for (i, view) in std::mem::take(&mut scene.views).into_iter().enumerate() {
                if marked.get(i) == Some(&true) {
                    held.views.push(view);
                    held.gains.push(own(i));
                } else {
                    scene.views.push(view);
                    gains.push(own(i));
                }
            }
        });
        baked.gains = gains;
        let posed = baked.scene.mesh.pose();
        let samples = samples::sample_these(&baked.scene, &held.views, &posed, baked.surface_bakes())?;
        let path = baked.scene.path.display().to_string();
        baked.warnings.extend(silhouettes::warnings(&path, &held.views, &samples));
        held.observed = beside(&baked.scene.path, &held.views, samples)?;
        baked.seconds = StageSeconds { samples: start.elapsed().as_secs_f64(), ..baked.seconds };
        Ok((baked, held))
    }
}

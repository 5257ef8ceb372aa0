//! How densely the stack of specular cubes must stand over the exponent.

use super::quality::Swept;
use crate::StudyError;
use crate::bake;
use crate::model::effects::{Effect, Effects};
use crate::model::params::Param;
use crate::prepare::PrepareError;
use crate::tradeoff::axis::{Axis, Knob, Sweep};
use crate::tradeoff::bench::Bench;

/// The number of specular cubes an octave.
pub(super) struct Density;

impl Axis for Density {
    fn name(&self) -> &'static str {
        "lobes"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.prepared.scene;
        let asked = scene.effects.needs(scene.silhouette).lobes;
        asked.then_some(()).ok_or("no effect looks the specular cube up")
    }

    fn settable(&self) -> bool {
        true
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let mut point = bench.point();
        let exponent = point.params.scalar(Param::SpecularLobe);
        // No stack has a cube there: a third of the way from one octave to the next is halfway at best.
        let between = (exponent.log2().floor() + 1.0 / 3.0).exp2().clamp(1.0, 2048.0);
        point.params.set(Param::SpecularLobe, between);
        let mut own = Bench::new(bench.path, bench.params, bench.cache())?;
        own.prepared.scene.params = point.params;
        let swept = Swept {
            axis: self.name(),
            title: "Specular cubes for each doubling of the exponent",
            method: format!(
                "Images at an exponent of {between:.1}, between the cubes of every stack. Seconds are those of baking the stack for \
                 exponents of 1 to 2048, as a fit of the exponent asks for; nothing cached."
            ),
            knob: Knob::LobesPerOctave,
            values: &[1, 2, 4, 8],
            count: ("cubes", &|density| f64::from(11 * density + 1)),
        };
        let whole = Param::SpecularLobe.info();
        swept.sweep(&own, &point, &|settings| {
            let mut scene = own.scene(settings);
            scene.effects = Effects::of(&[Effect::SideSpecular]);
            let pose = |weights: &[f32]| scene.mesh.pose_with_weights(weights);
            let stack = bake::bake(&scene, &pose, whole.lower..=whole.upper, None);
            let (_, stats) = stack.map_err(PrepareError::from)?;
            Ok(stats.rows.iter().filter(|row| row.name.starts_with("lobe")).map(|row| row.seconds).sum())
        })
    }
}

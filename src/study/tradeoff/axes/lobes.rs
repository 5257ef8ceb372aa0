//! How densely the stack of specular cubes must stand over the exponent.

use super::quality::Swept;
use crate::StudyError;
use crate::bake;
use crate::model::effects::{Effect, Effects};
use crate::model::params::Param;
use crate::prepare::PrepareError;
use crate::tradeoff::axis::{Knob, Rates, SceneAxis, Sweep};
use crate::tradeoff::bench::Bench;
use crate::tradeoff::settings::Settings;

/// The number of specular cubes an octave.
pub(super) struct Density;

impl SceneAxis for Density {
    fn name(&self) -> &'static str {
        "lobes"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.baked.scene;
        let asked = scene.needs().lobes;
        asked.then_some(()).ok_or("no effect looks the specular cube up")
    }

    fn settable(&self) -> bool {
        true
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        swept(between(bench)).seconds(bench, rates, &|_| 0.0, &|settings| bake(bench, settings))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let mut point = bench.point();
        let between = between(bench);
        point.params.set(Param::SpecularLobe, between);
        let own = bench.at(point.params.clone());
        swept(between).sweep(&own, &point, &|settings| bake(&own, settings))
    }
}

/// No stack has a cube there: a third of the way from one octave to the next is halfway at best.
fn between(bench: &Bench<'_>) -> f64 {
    let exponent = bench.point().params.scalar(Param::SpecularLobe);
    (exponent.log2().floor() + 1.0 / 3.0).exp2().clamp(1.0, 2048.0)
}

fn swept(between: f64) -> Swept<'static> {
    Swept {
        axis: Density.name(),
        title: "Specular cubes for each doubling of the exponent",
        method: format!(
            "Images at an exponent of {between:.1}, between the cubes of every stack. Seconds are those of baking the stack for \
             exponents of 1 to 2048, as a fit of the exponent asks for; nothing cached."
        ),
        knob: Knob::LobesPerOctave,
        values: &[1, 2, 4, 8],
        count: ("cubes", &|density| f64::from(11 * density + 1)),
        probe: 1,
    }
}

/// The seconds of the whole stack.
fn bake(bench: &Bench<'_>, settings: Settings) -> Result<f64, StudyError> {
    let whole = Param::SpecularLobe.info();
    let mut scene = bench.scene(settings);
    scene.effects = Effects::of(&[Effect::SideSpecular]);
    let pose = |weights: &[f32]| scene.mesh.pose_with_weights(weights);
    let stack = bake::bake(
        &scene,
        &pose,
        &bake::Ranges { exponents: whole.lower..=whole.upper, ..bake::Ranges::of(&scene, false) },
        None,
    );
    let (_, stats) = stack.map_err(PrepareError::from)?;
    Ok(stats.rows.iter().filter(|row| row.name.starts_with("lobe")).map(|row| row.seconds).sum())
}

//! How many texels a cube's face needs.

use super::quality::{Swept, bake_seconds};
use crate::StudyError;
use crate::model::effects::{Effect, Effects};
use crate::model::needs::Needs;
use crate::tradeoff::axis::{Knob, Rates, SceneAxis, Sweep};
use crate::tradeoff::bench::Bench;
use crate::tradeoff::settings::Settings;

/// The size of one kind of cube.
pub(super) struct CubeSize {
    name: &'static str,
    title: &'static str,
    knob: Knob,
    /// The effect that asks for this cube and no other.
    effect: Effect,
    /// How its bakes are called.
    bake: &'static str,
    values: &'static [u32],
    asked: fn(Needs) -> bool,
}

pub(super) const IRRADIANCE: CubeSize = CubeSize {
    name: "irradiance",
    title: "Texels a face of the irradiance cube",
    knob: Knob::IrradianceSize,
    effect: Effect::Diffuse,
    bake: "irradiance",
    values: &[4, 8, 16, 32, 64, 128],
    asked: |needs| needs.irradiance,
};

pub(super) const SPECULAR: CubeSize = CubeSize {
    name: "specular",
    title: "Texels a face of the specular cube",
    knob: Knob::LobeSize,
    effect: Effect::SideSpecular,
    bake: "lobe",
    values: &[4, 8, 16, 32, 64, 128, 256],
    asked: |needs| needs.lobes,
};

pub(super) const HILITE: CubeSize = CubeSize {
    name: "hilite",
    title: "Texels a face of the hilite cube",
    knob: Knob::HiliteSize,
    effect: Effect::Hilite,
    bake: "hilite",
    values: &[8, 16, 32, 64, 128, 256, 512],
    asked: |needs| needs.hilite,
};

impl SceneAxis for CubeSize {
    fn name(&self) -> &'static str {
        self.name
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.baked.scene;
        let asked = (self.asked)(scene.needs());
        asked.then_some(()).ok_or("no effect looks this cube up")
    }

    fn settable(&self) -> bool {
        true
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        self.swept().seconds(bench, rates, &|_| 0.0, &|settings| self.bake(bench, settings))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        self.swept().sweep(bench, &bench.point(), &|settings| self.bake(bench, settings))
    }
}

impl CubeSize {
    fn swept(&self) -> Swept<'_> {
        Swept {
            axis: self.name,
            title: self.title,
            method: "Images with the cube at each size, all else as the scene has it. Seconds are those of baking it, nothing cached."
                .to_owned(),
            knob: self.knob,
            values: self.values,
            count: ("KiB", &|size| 6.0 * f64::from((size + 2).pow(2)) * 16.0 / 1024.0),
            // Not one of so few texels that they are no measure of others.
            probe: 16,
        }
    }

    fn bake(&self, bench: &Bench<'_>, settings: Settings) -> Result<f64, StudyError> {
        let mut scene = bench.scene(settings);
        scene.effects = Effects::of(&[self.effect]);
        bake_seconds(bench, &scene, self.bake)
    }
}

//! What a fit of maps is to do.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::MapError;
use super::function::acts_through_cubes;
use crate::TensorError;
use crate::adjoint::plan_of;
use crate::bake::Illumination;
use crate::engine::view::ObservedView;
use crate::engine::{Point, Unknown};
use crate::levels::atlas_of;
use crate::model::effects::Effect;
use crate::prepare::Baked;
use crate::samples::ViewSamples;
use crate::scene::mesh::PosedMesh;
use crate::scene::{MapKind, Scene};
use crate::shader::term::of_texels;

/// What is to be fitted.
pub struct MapTask<'a> {
    /// The scene; its views are those of `observed`.
    pub scene: &'a Scene,
    /// Its mesh.
    pub posed: &'a PosedMesh,
    /// The cubes to start from.
    pub illumination: Illumination,
    /// Each vertex's open share of the hemisphere to start from.
    pub open: Option<Vec<f32>>,
    /// Samples and targets.
    pub observed: Vec<ObservedView>,
    /// A view that takes no part in the fit.
    pub held_out: Option<usize>,
    /// Which maps.
    pub kinds: Vec<MapKind>,
    /// The constants to start from, and which of them are free.
    pub start: Point,
    /// What is free of them.
    pub unknowns: Vec<Unknown>,
    /// Most samples that are shaded at once; else as many as the device's buffers hold.
    pub most_samples: Option<usize>,
    /// Set by somebody who wants the fit to stop after the present step.
    pub interrupt: Option<Arc<AtomicBool>>,
}

impl<'a> MapTask<'a> {
    /// Maps of these `kinds` and the scene's constants, from where the stages before leave them; every view counts. What
    /// the maps hold of the constants is not free there
    /// ([`FitSettings::hold_beside`](crate::scene::FitSettings::hold_beside)).
    #[must_use]
    pub fn new(
        baked: &'a Baked,
        posed: &'a PosedMesh,
        observed: Vec<ObservedView>,
        kinds: Vec<MapKind>,
    ) -> Self {
        let weights: Vec<f32> = baked.scene.mesh.morphs.iter().map(|morph| morph.weight).collect();
        Self {
            scene: &baked.scene,
            posed,
            illumination: Illumination::clone(&baked.illumination),
            open: baked.occlusion.as_ref().map(|occlusion| occlusion.posed(&weights)),
            observed,
            held_out: None,
            kinds,
            start: baked.start(),
            unknowns: baked.unknowns(),
            most_samples: None,
            interrupt: None,
        }
    }

    /// Whether what is computed in texels reads cubes.
    fn texels_look_up(&self) -> Result<bool, TensorError> {
        let plan = plan_of(self.scene.setup(), &[], true)?;
        Ok(plan.passes.iter().any(|pass| !pass.plan.resources.is_empty()))
    }

    /// That tensors make what the scene asks for, and that no constant is free which acts through a cube that is fitted.
    pub(super) fn check(&self) -> Result<(), MapError> {
        let views: Vec<&ViewSamples> = self.observed.iter().map(|view| &view.samples).collect();
        let in_texels = atlas_of(self.scene.setup(), &views)?.is_some() && self.texels_look_up()?;
        if in_texels && self.kinds.contains(&MapKind::Environment) {
            let effect = of_texels(self.scene.effects).map_or("", Effect::name);
            return Err(MapError::InTexels { map: MapKind::Environment.name(), effect });
        }
        let mut free = self.unknowns.iter().filter_map(Unknown::column).map(|column| column.param);
        match free.find(|&param| acts_through_cubes(param, &self.kinds)) {
            Some(param) => Err(MapError::Sharpness { param: param.name() }),
            None => Ok(()),
        }
    }
}

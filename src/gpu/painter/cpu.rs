//! The CPU engine: rays through the samples' positions, the model in f64.

use std::future::ready;
use std::sync::Arc;

use web_time::Instant;

use super::{BACKGROUND, Beside, Cut, PaintError, Painter, Painting, Picture};
use crate::bake::PoseBake;
use crate::bake::interreflection::VertexGather;
use crate::bake::inward::InwardRays;
use crate::bake::lobe_sky::LobeSky;
use crate::bake::rays::RayMesh;
use crate::bake::sky::traces_lobes;
use crate::model::effects::Effect;
use crate::model::gain::Gain;
use crate::model::params::Params;
use crate::prepare::Baked;
use crate::render::backdrop::Backdrop;
use crate::render::bloom::add_bloom;
use crate::render::image::Image;
use crate::render::shade::{PLAIN_LAYER, Shader};
use crate::samples::{Atlas, PosedSurface, SurfaceBakes, ViewSamples, atlas_of, gather_of, sample_view};
use crate::scene::Scene;
use crate::scene::mesh::{Mesh, Morph, PosedMesh};
use crate::scene::mip_maps::MipMaps;
use crate::scene::view::Camera;

/// The CPU engine: rays through the samples' positions, the model in f64.
pub struct CpuPainter {
    baked: Baked,
    params: Params,
    lobe_sky: Option<Arc<LobeSky>>,
    mip_maps: Option<Arc<MipMaps>>,
    shader: Shader,
    pose: Pose,
    atlas: Option<Arc<Atlas>>,
    /// What the last camera saw: other weights need no other samples.
    seen: Option<(Camera, ViewSamples)>,
    seconds: f64,
}

impl CpuPainter {
    /// Of a scene at its own pose.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or something was baked for another mesh.
    pub fn new(baked: &Baked) -> Result<Self, PaintError> {
        let shader = Shader::new(baked.setup(), &baked.illumination, &baked.scene.params)?;
        let scene = &*baked.scene;
        let pose = Pose::of(scene, &scene.mesh, None);
        let mip_maps = MipMaps::new(&scene.maps, scene.quality.texture_filter).map(Arc::new);
        let traced = traces_lobes(scene, scene.needs().fields);
        let lobe_sky = if traced { LobeSky::of_scene(scene).map(Arc::new) } else { None };
        let mut painter = Self {
            baked: baked.clone(),
            params: baked.scene.params.clone(),
            lobe_sky,
            mip_maps,
            shader,
            pose,
            atlas: None,
            seen: None,
            seconds: 0.0,
        };
        let atlas = atlas_of(&painter.baked.scene, &painter.surface()?)?;
        painter.atlas = atlas;
        Ok(painter)
    }

    /// The mesh as it is posed, with what is baked of it.
    fn surface(&self) -> Result<PosedSurface<'_>, PaintError> {
        let Pose { mesh, rays, morphs, own, gather, inward } = &self.pose;
        let bakes = SurfaceBakes {
            occlusion: own.occlusion.as_ref().or(self.baked.occlusion.as_deref()),
            sky: own.sky.as_ref().or(self.baked.sky.as_deref()),
            thickness: own.thickness.as_ref().or(self.baked.thickness.as_deref()),
            gather: gather.as_ref(),
            inward: inward.as_ref(),
            // A turn's frames would fill the folder with poses of their own.
            cache: None,
            lobe_sky: self.lobe_sky.as_ref(),
            mip_maps: self.mip_maps.as_ref(),
        };
        Ok(PosedSurface::new(&self.baked.scene, mesh, rays, morphs, bakes)?)
    }
}

/// The mesh in the world, as rays see it; its targets at their weights, and what is baked of this pose alone.
struct Pose {
    mesh: PosedMesh,
    rays: RayMesh,
    morphs: Vec<Morph>,
    own: PoseBake,
    gather: Option<VertexGather>,
    inward: Option<InwardRays>,
}

impl Pose {
    fn of(scene: &Scene, mesh: &Mesh, own: Option<PoseBake>) -> Self {
        let posed = mesh.pose();
        let rays = RayMesh::of(&posed);
        let (gather, inward) = (gather_of(scene, &posed), InwardRays::of_scene(scene, &posed));
        let (morphs, own) = (mesh.morphs.clone(), own.unwrap_or_default());
        Self { mesh: posed, rays, morphs, own, gather, inward }
    }
}

impl Painter for CpuPainter {
    fn name(&self) -> String {
        "cpu".to_owned()
    }

    fn set_mesh(&mut self, mesh: &Mesh, own: Option<PoseBake>) -> Result<(), PaintError> {
        self.pose = Pose::of(&self.baked.scene, mesh, own);
        let atlas = atlas_of(&self.baked.scene, &self.surface()?)?;
        (self.atlas, self.seen) = (atlas, None);
        Ok(())
    }

    fn set_params(&mut self, params: &Params) -> Result<(), PaintError> {
        if params.differ_in_weights_alone(&self.params) {
            self.shader = Shader::new(self.baked.setup(), &self.baked.illumination, params)?;
            self.params = params.clone();
        } else if *params != self.params {
            // What samples hold may go by it: where a light is, how the sky is turned, how rough the skin is.
            *self = Self::new(&self.baked.clone().with_scene(|scene| scene.params = params.clone()))?;
        }
        Ok(())
    }

    fn paint(&mut self, camera: &Camera, gain: Gain, beside: Beside) -> Result<Picture, PaintError> {
        let start = Instant::now();
        let samples = match self.seen.take() {
            Some((seen, samples)) if seen == *camera => samples,
            _ => {
                let mut samples = sample_view(&self.baked.scene, &self.surface()?, camera);
                samples.atlas.clone_from(&self.atlas);
                samples
            }
        };
        let mut shaded = self.shader.shade(&samples, camera, gain);
        self.seen = Some((*camera, samples));
        let scene = &*self.baked.scene;
        let mut layers: Vec<(String, Image)> =
            shaded.terms.into_iter().map(|(name, image)| (name.name().to_owned(), image)).collect();
        layers.extend(shaded.plain.map(|image| (PLAIN_LAYER.to_owned(), image)));
        let background = scene.views[0].background;
        let n = scene.quality.samples_per_axis;
        if let Some(backdrop) = Backdrop::new(scene, &self.params, background, camera, n) {
            layers.push((BACKGROUND.to_owned(), backdrop.layer(&shaded.image, gain)));
            backdrop.put_behind(&mut shaded.image, &mut shaded.glow, gain);
        }
        if scene.effects.has(Effect::Bloom) {
            add_bloom(&mut shaded.image, &shaded.glow, scene.bloom.sigma);
        }
        self.seconds = start.elapsed().as_secs_f64();
        let layers = if beside.layers { layers } else { Vec::new() };
        let haze = if beside.haze { shaded.haze } else { Vec::new() };
        Ok(Picture { image: shaded.image, layers, haze, cut: Cut::default() })
    }

    /// Computed at once: nothing is waited for.
    fn paint_async<'a>(&'a mut self, camera: &'a Camera, gain: Gain, beside: Beside) -> Painting<'a> {
        Box::pin(ready(self.paint(camera, gain, beside)))
    }

    fn stats(&self) -> Vec<String> {
        vec![format!("{:>16}  {:9.3} ms", "samples, shading", 1e3 * self.seconds)]
    }
}

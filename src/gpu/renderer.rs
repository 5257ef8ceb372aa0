//! From a scene and a camera to an image.

mod frames;
mod made;

use glam::Mat4;
use std::sync::Arc;
use wgpu::RenderPipeline;

use super::atlas::AtlasTraffic;
use super::device::Gpu;
use super::error::GpuError;
use super::plain::{Plain, Show};
use super::program::{Program, Shaded};
use super::stage::{End, Stage};
use super::timing::PassTime;
use super::upload::{Content, Uploads};
use crate::bake::PoseBake;
use crate::model::gain::Gain;
use crate::model::params::{Param, Params};
use crate::model::terms::TermName;
use crate::render::antialias::Antialias;
use crate::render::backdrop::Backdrop;
use crate::render::image::Image;
use crate::render::shading::Shading;
use crate::scene::mesh::Mesh;
use crate::scene::view::{Background, Camera};
use crate::shader::{Budget, Facts, Plan};

/// How images are made.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// Samples a pixel.
    pub antialias: Antialias,
    /// Where they are shaded.
    pub shading: Shading,
    /// The accuracy allowed.
    pub budget: Budget,
    /// Whether passes are timed.
    pub timed: bool,
    /// Whether the mesh will move between frames: then every morph target is kept.
    pub animated: bool,
}

/// An image, and what it took.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Radiance premultiplied by coverage, alpha being the coverage; or the whole picture and 1, where something
    /// stands behind the mesh.
    pub image: Image,
    /// Pixels that reached the end of 16-bit targets' range.
    pub clipped: usize,
    /// GPU time by pass; empty where it is not requested, or the adapter has no timestamps.
    pub times: Vec<PassTime>,
}

/// A scene on a device, ready to be seen from anywhere.
pub struct Renderer {
    gpu: Gpu,
    uploads: Uploads,
    options: RenderOptions,
    facts: Facts,
    /// Weights of the kept morph targets.
    morph_weights: Vec<f32>,
    /// The whole, and the requested parts of it.
    programs: Vec<Drawer>,
    /// What is not skin, where the mesh has such parts.
    plain: Option<Plain>,
    stages: Vec<Stage>,
    background: Background,
    /// What stands behind the mesh, as the camera of the last frame sees it.
    backdrop: Option<(Camera, Backdrop)>,
}

/// What an image shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layer {
    /// All of it.
    Whole,
    /// One term of the skin.
    Term(TermName),
    /// What is not skin.
    Plain,
}

/// What draws a layer.
struct Drawer {
    layer: Layer,
    /// The skin's.
    program: Program<Shaded>,
    /// That of what is not skin, where there is any.
    plain: Option<RenderPipeline>,
}

impl Layer {
    /// How what is not skin is drawn into it.
    const fn shows_plain(self) -> Show {
        match self {
            Self::Whole | Self::Plain => Show::Lit,
            Self::Term(_) => Show::Hidden,
        }
    }

    /// Whether the skin's alpha is the haze there.
    fn is_hazy(self, plan: &Plan) -> bool {
        self == Self::Whole && plan.facts.needs().haze
    }
}

impl Renderer {
    /// Plan the scene's shader, upload what it reads, and compile it.
    ///
    /// # Errors
    /// When no plan is within the budget, or the device does not take it.
    pub fn new(gpu: &Gpu, content: Content, options: RenderOptions) -> Result<Self, GpuError> {
        let morphs = &content.scene.mesh.morphs;
        let kept = |i: &usize| options.animated || morphs[*i].weight != 0.0;
        let targets: Vec<usize> = (0..morphs.len()).filter(kept).collect();
        let morph_weights = targets.iter().map(|&i| morphs[i].weight).collect();
        let facts = Facts {
            morphs: targets.len() as u32,
            ..content.scene.facts(&content.params, options.budget, gpu.f16())
        };
        let mut uploads = Uploads::new(gpu, content, targets)?;
        let plain = Plain::new(gpu, &facts, &mut uploads)?;
        let mut renderer = Self {
            gpu: gpu.clone(),
            uploads,
            options,
            facts,
            morph_weights,
            programs: Vec::new(),
            plain,
            stages: Vec::new(),
            background: Background::None,
            backdrop: None,
        };
        renderer.program(Layer::Whole)?;
        Ok(renderer)
    }

    /// As [`Self::new`], with the whole image's plan changed: to measure what a part of a shader costs, or to
    /// draw with another text of it, which [`Shading::Forward`] alone reads.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn with_shader(
        gpu: &Gpu,
        content: Content,
        options: RenderOptions,
        change: impl FnOnce(&Plan) -> Plan,
    ) -> Result<Self, GpuError> {
        let mut renderer = Self::new(gpu, content, options)?;
        let plan = change(renderer.plan());
        renderer.programs[0].program = renderer.compiled(Layer::Whole, plan)?;
        Ok(renderer)
    }

    /// The plan of the whole image.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        self.programs[0].program.plan()
    }

    /// Bytes of mesh, maps and cubes on the device.
    #[must_use]
    pub const fn uploaded_bytes(&self) -> u64 {
        self.uploads.bytes()
    }

    /// Directions along a pixel's side of which the backdrop is the mean.
    #[must_use]
    pub fn backdrop_samples(&self) -> u32 {
        self.options.antialias.grid().max(self.options.antialias.multisamples() / 2)
    }

    /// Texels of the cubes that are brighter than 65504, where the shader reads them in 16 bits: they were cut there.
    #[must_use]
    pub const fn clipped_texels(&self) -> usize {
        self.uploads.clipped()
    }

    /// How often a layer of the shadow maps was drawn: once each, and again where the mesh has moved.
    #[must_use]
    pub fn shadow_maps_drawn(&self) -> u64 {
        self.uploads.shadow_maps_drawn()
    }

    /// What the whole image's passes over the UV atlas take.
    #[must_use]
    pub fn atlas_traffic(&self) -> AtlasTraffic {
        self.programs[0].program.atlas_traffic()
    }

    /// How often the levels of the UV atlas were made for the whole image: once, and again where the mesh has moved.
    #[must_use]
    pub fn atlas_made(&self) -> u64 {
        self.programs[0].program.atlas_made()
    }

    /// Put something behind the mesh in the frames to come.
    pub fn set_background(&mut self, background: Background) {
        self.background = background;
        self.backdrop = None;
        self.stages.clear();
    }

    /// Move the mesh to another pose: the scene's at another time, with what is baked of that pose where it has bakes of
    /// its own. Only with [`RenderOptions::animated`].
    ///
    /// # Errors
    /// When something was baked for another mesh.
    pub fn set_mesh(&mut self, mesh: &Mesh, own: Option<&PoseBake>) -> Result<(), GpuError> {
        self.uploads.set_mesh(&self.gpu, mesh, own)?;
        if let Some(plain) = &self.plain {
            plain.set_mesh(&self.gpu, &self.uploads, mesh);
        }
        self.forget();
        let weights = mesh.morphs.iter().map(|morph| morph.weight);
        self.morph_weights.iter_mut().zip(weights).for_each(|(old, new)| *old = new);
        Ok(())
    }

    /// Move the bones of the scene's own mesh, and the weights of its targets: all that a clip changes of most meshes, and
    /// far less to write than [`set_mesh`](Self::set_mesh) does, but where shadow maps, parts that are not skin or what rays
    /// find of vertices go by the posed surface. Bones and targets that are not given stand as in the scene;
    /// occlusion is the scene's. Only with [`RenderOptions::animated`].
    ///
    /// # Errors
    /// As of [`set_mesh`](Self::set_mesh).
    pub fn set_pose(&mut self, bones: &[Mat4], weights: &[f32]) -> Result<(), GpuError> {
        match self.uploads.posed_whole(bones, weights) {
            Some(mesh) => return self.set_mesh(&mesh, None),
            None => self.uploads.set_pose(&self.gpu, bones),
        }
        self.forget();
        let own = &self.uploads.content().scene.mesh.morphs;
        for (i, (weight, own)) in self.morph_weights.iter_mut().zip(own).enumerate() {
            *weight = weights.get(i).copied().unwrap_or(own.weight);
        }
        Ok(())
    }

    /// Shade `per_axis` samples along a pixel's side in the images to come; not where the hardware multisamples.
    pub fn set_grid(&mut self, per_axis: u32) {
        if let Antialias::Grid(samples) = &mut self.options.antialias
            && *samples != per_axis
        {
            *samples = per_axis;
            self.backdrop = None;
        }
    }

    /// Take other constants, for images at the scene's own pose. Where they change neither the plan nor what it reads,
    /// the next frame reads them from the uniform block, and levels of the UV atlas are made anew; otherwise, as where
    /// the environment turns about parts that are not skin, a light moves or a lobe's exponent changes, the renderer is made anew, of a scene that has them.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn set_params(&mut self, params: &Params) -> Result<(), GpuError> {
        let before = &self.uploads.content().params;
        let turned = before.scalar(Param::EnvironmentRotation);
        // What is not skin is lit when it is made.
        let turns = params.scalar(Param::EnvironmentRotation) != turned;
        let lit = self.plain.is_none() || !turns;
        if lit && self.facts.at(params) == self.facts && self.uploads.set_params(params) {
            self.forget();
        } else {
            let (background, mut content) = (self.background, self.uploads.content().clone());
            Arc::make_mut(&mut content.scene).params = params.clone();
            content.params = params.clone();
            *self = Self::new(&self.gpu, content, self.options)?;
            self.background = background;
        }
        if turns {
            self.backdrop = None;
        }
        Ok(())
    }

    /// Have passes over the UV atlas run again.
    fn forget(&self) {
        self.programs.iter().for_each(|drawer| drawer.program.forget());
    }

    /// The image that `camera` sees, times `gain`.
    ///
    /// # Errors
    /// When the image is too large, or the device fails.
    pub fn render(&mut self, camera: &Camera, gain: impl Into<Gain>) -> Result<Frame, GpuError> {
        let gain = gain.into();
        self.show_behind(camera);
        let drawn = self.draw(Layer::Whole, camera, gain, End::Finished)?;
        let (image, clipped) = self.stages[drawn.stage].finished_image(&drawn.planes, gain);
        Ok(Frame { image, clipped, times: drawn.times })
    }

    /// As [`Self::render`], without waiting and without times, as a browser wants it.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub async fn render_async(&mut self, camera: &Camera, gain: impl Into<Gain>) -> Result<Frame, GpuError> {
        let gain = gain.into();
        self.show_behind(camera);
        let (stage, planes) = self.draw_async(Layer::Whole, camera, gain, End::Finished).await?;
        let (image, clipped) = self.stages[stage].finished_image(&planes, gain);
        Ok(Frame { image, clipped, times: Vec::new() })
    }

    /// As [`Self::render_term`], without waiting.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub async fn render_term_async(
        &mut self,
        term: TermName,
        camera: &Camera,
        gain: impl Into<Gain>,
    ) -> Result<Image, GpuError> {
        let gain = gain.into();
        let (stage, planes) = self.draw_async(Layer::Term(term), camera, gain, End::Parts).await?;
        Ok(self.stages[stage].image(&planes, gain).0)
    }

    /// As [`Self::render_haze`], without waiting.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub async fn render_haze_async(
        &mut self,
        camera: &Camera,
        gain: impl Into<Gain>,
    ) -> Result<Vec<f32>, GpuError> {
        let gain = gain.into();
        if !Layer::Whole.is_hazy(self.plan()) {
            return Ok(Vec::new());
        }
        let (stage, planes) = self.draw_async(Layer::Whole, camera, gain, End::Parts).await?;
        Ok(self.haze(stage, &planes, gain))
    }

    /// Submit, and the planes of the stage once they are there.
    async fn draw_async(
        &mut self,
        layer: Layer,
        camera: &Camera,
        gain: Gain,
        end: End,
    ) -> Result<(usize, Vec<Vec<f32>>), GpuError> {
        let (stage, copies) = self.submit(layer, camera, gain, end, None)?;
        let mut planes = Vec::with_capacity(copies.len());
        for copy in &copies {
            planes.push(copy.arrived(&self.gpu).await?);
        }
        Ok((stage, planes))
    }

    /// The haze that a stage's first plane holds as alpha.
    fn haze(&self, stage: usize, planes: &[Vec<f32>], gain: Gain) -> Vec<f32> {
        let gain = gain.channel(3) as f32;
        let largest = self.stages[stage].targets.key.precision.largest();
        let haze = planes[0].chunks_exact(4).map(|texel| texel[3].clamp(-largest, largest));
        haze.map(|haze| gain * haze).collect()
    }

    /// One term of the image alone, without bloom and backdrop; the terms add up to the image without them.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn render_term(
        &mut self,
        term: TermName,
        camera: &Camera,
        gain: impl Into<Gain>,
    ) -> Result<Image, GpuError> {
        let gain = gain.into();
        let drawn = self.draw(Layer::Term(term), camera, gain, End::Parts)?;
        Ok(self.stages[drawn.stage].image(&drawn.planes, gain).0)
    }

    /// What is not skin alone, without bloom and backdrop; `None` where all of the mesh is skin.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn render_plain(
        &mut self,
        camera: &Camera,
        gain: impl Into<Gain>,
    ) -> Result<Option<Image>, GpuError> {
        if self.plain.is_none() {
            return Ok(None);
        }
        let gain = gain.into();
        let drawn = self.draw(Layer::Plain, camera, gain, End::Parts)?;
        Ok(Some(self.stages[drawn.stage].image(&drawn.planes, gain).0))
    }

    /// As [`Self::render_plain`], without waiting.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub async fn render_plain_async(
        &mut self,
        camera: &Camera,
        gain: impl Into<Gain>,
    ) -> Result<Option<Image>, GpuError> {
        if self.plain.is_none() {
            return Ok(None);
        }
        let gain = gain.into();
        let (stage, planes) = self.draw_async(Layer::Plain, camera, gain, End::Parts).await?;
        Ok(Some(self.stages[stage].image(&planes, gain).0))
    }

    /// The haze of each pixel, premultiplied by its coverage and times the gain; empty where no effect makes one.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn render_haze(&mut self, camera: &Camera, gain: impl Into<Gain>) -> Result<Vec<f32>, GpuError> {
        let gain = gain.into();
        if !Layer::Whole.is_hazy(self.plan()) {
            return Ok(Vec::new());
        }
        let drawn = self.draw(Layer::Whole, camera, gain, End::Parts)?;
        Ok(self.haze(drawn.stage, &drawn.planes, gain))
    }

    /// What stands behind the mesh for `camera`, made anew when that has moved.
    fn show_behind(&mut self, camera: &Camera) {
        if self.background == Background::None
            || self.backdrop.as_ref().is_some_and(|(seen, _)| seen == camera)
        {
            return;
        }
        let (content, n) = (self.uploads.content(), self.backdrop_samples());
        let backdrop = Backdrop::new(&content.scene, &content.params, self.background, camera, n);
        if self.backdrop.is_none() {
            // Terms may have been drawn before, with nothing behind them.
            self.stages.clear();
        }
        self.backdrop = backdrop.map(|backdrop| (*camera, backdrop));
        let size = (camera.width, camera.height);
        for stage in &self.stages {
            let key = &stage.targets.key;
            if let (Some(finish), Some((_, backdrop))) = (&stage.finish, &self.backdrop)
                && (key.width, key.height) == size
            {
                finish.set_backdrop(&self.gpu, backdrop);
            }
        }
    }
}

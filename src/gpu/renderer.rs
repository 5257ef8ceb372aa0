//! From a scene and a camera to an image.

use wgpu::{
    Color, CommandEncoder, CommandEncoderDescriptor, LoadOp, Operations, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPassTimestampWrites, StoreOp, TextureView,
};

use super::bloom::Finish;
use super::constants::Values;
use super::device::Gpu;
use super::error::GpuError;
use super::program::Program;
use super::readback::Copy;
use super::resolve::Resolve;
use super::targets::{Key, Planes, Precision, Targets, Tile};
use super::timing::{PassTime, Timer};
use super::upload::{Content, Uploads};
use crate::bake::VertexOcclusion;
use crate::model::effects::Effect;
use crate::model::terms::TermName;
use crate::render::antialias::Antialias;
use crate::render::backdrop::Backdrop;
use crate::render::image::Image;
use crate::scene::mesh::Mesh;
use crate::scene::view::{Background, Camera};
use crate::shader::{Budget, Facts, Plan, plan};

/// A budget that is at least this is drawn into 16-bit targets, which round to 2^-11.
const HALF_ERROR: f64 = 1e-3;

/// How images are made.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// Samples a pixel.
    pub antialias: Antialias,
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
    /// GPU time by pass; empty where it is not asked for, or the adapter has no timestamps.
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
    /// The whole, and terms that were asked for.
    programs: Vec<Program>,
    stages: Vec<Stage>,
    background: Background,
    /// What stands behind the mesh, as the camera of the last frame sees it.
    backdrop: Option<(Camera, Backdrop)>,
}

/// Targets, and the passes after the mesh's.
struct Stage {
    targets: Targets,
    resolve: Option<Resolve>,
    finish: Option<Finish>,
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
            ..Facts::of_scene(&content.scene, &content.params, options.budget, gpu.f16())
        };
        let uploads = Uploads::new(gpu, content, targets)?;
        let mut renderer = Self {
            gpu: gpu.clone(),
            uploads,
            options,
            facts,
            morph_weights,
            programs: Vec::new(),
            stages: Vec::new(),
            background: Background::None,
            backdrop: None,
        };
        renderer.program(None)?;
        Ok(renderer)
    }

    /// As [`Self::new`], with the whole image's plan changed: to measure what a part of a shader costs, or to
    /// draw with another text of it.
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
        let formats = renderer.key(1, 1, hazy(&plan)).formats();
        let multisamples = options.antialias.multisamples();
        renderer.programs[0] = Program::new(gpu, plan, &mut renderer.uploads, &formats, multisamples)?;
        Ok(renderer)
    }

    /// The plan of the whole image.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.programs[0].plan
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

    /// Put something behind the mesh in the frames to come.
    pub fn set_background(&mut self, background: Background) {
        self.background = background;
        self.backdrop = None;
        self.stages.clear();
    }

    /// Move the mesh to another pose: the scene's at another time, with the occlusion of that pose where it has one of
    /// its own. Only with [`RenderOptions::animated`].
    pub fn set_mesh(&mut self, mesh: &Mesh, occlusion: Option<&VertexOcclusion>) {
        self.uploads.set_mesh(&self.gpu, mesh, occlusion);
        let weights = mesh.morphs.iter().map(|morph| morph.weight);
        self.morph_weights.iter_mut().zip(weights).for_each(|(old, new)| *old = new);
    }

    /// The image that `camera` sees, times `gain`.
    ///
    /// # Errors
    /// When the image is too large, or the device fails.
    pub fn render(&mut self, camera: &Camera, gain: f64) -> Result<Frame, GpuError> {
        self.show_behind(camera);
        let drawn = self.draw(None, camera, gain, true)?;
        let (image, clipped) = self.stages[drawn.stage].finished_image(&drawn.planes, gain);
        Ok(Frame { image, clipped, times: drawn.times })
    }

    /// As [`Self::render`], without waiting and without times, as a browser wants it.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub async fn render_async(&mut self, camera: &Camera, gain: f64) -> Result<Frame, GpuError> {
        self.show_behind(camera);
        let (stage, copies) = self.submit(None, camera, gain, true, None)?;
        let mut planes = Vec::with_capacity(copies.len());
        for copy in &copies {
            planes.push(copy.arrived(&self.gpu).await?);
        }
        let (image, clipped) = self.stages[stage].finished_image(&planes, gain);
        Ok(Frame { image, clipped, times: Vec::new() })
    }

    /// One term of the image alone, without bloom and backdrop; the terms add up to the image without them.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn render_term(&mut self, term: TermName, camera: &Camera, gain: f64) -> Result<Image, GpuError> {
        let drawn = self.draw(Some(term), camera, gain, false)?;
        Ok(self.stages[drawn.stage].image(&drawn.planes, gain as f32).0)
    }

    /// The haze of each pixel, premultiplied by its coverage and times the gain; empty where no effect makes one.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn render_haze(&mut self, camera: &Camera, gain: f64) -> Result<Vec<f32>, GpuError> {
        if !hazy(self.plan()) {
            return Ok(Vec::new());
        }
        let drawn = self.draw(None, camera, gain, false)?;
        let largest = self.stages[drawn.stage].targets.key.precision.largest();
        let haze = drawn.planes[0].chunks_exact(4).map(|texel| texel[3].clamp(-largest, largest));
        Ok(haze.map(|haze| gain as f32 * haze).collect())
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

    /// GPU milliseconds of each of so many frames, drawn one right after another with nothing read back: an
    /// adapter that waits for the CPU between frames lowers its clock. Empty where there are no timestamps.
    /// Without the bloom.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn frame_times(&mut self, camera: &Camera, frames: usize) -> Result<Vec<f64>, GpuError> {
        let program = self.program(None)?;
        let stage = self.stage(camera, hazy(&self.programs[program].plan))?;
        let (gpu, program, stage) = (&self.gpu, &self.programs[program], &self.stages[stage]);
        let mut timers = Vec::with_capacity(frames);
        for _ in 0..frames {
            for (i, &tile) in stage.targets.tiles.iter().enumerate() {
                let mut timer = Timer::new(gpu);
                let (params, morph_weights) = (&self.uploads.content().params, self.morph_weights.as_slice());
                program.set(gpu, &Values { params, camera, tile, morph_weights });
                let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
                stage.encode_tile(gpu, &mut encoder, program, tile, i == 0, Some(&mut timer));
                timer.finish(&mut encoder);
                gpu.queue.submit([encoder.finish()]);
                timers.push((i, timer));
            }
        }
        let mut times = Vec::with_capacity(frames);
        for (tile, mut timer) in timers {
            timer.collect(gpu)?;
            let milliseconds: f64 = timer.times.iter().map(|time| time.milliseconds).sum();
            match times.last_mut() {
                Some(last) if tile > 0 => *last += milliseconds,
                _ => times.push(milliseconds),
            }
        }
        Ok(if gpu.timestamps() { times } else { Vec::new() })
    }

    /// The place of the program that draws the whole, or a term; made if it is not there yet.
    fn program(&mut self, output: Option<TermName>) -> Result<usize, GpuError> {
        if let Some(i) = self.programs.iter().position(|program| program.plan.facts.output == output) {
            return Ok(i);
        }
        let plan =
            plan(&Facts { output, ..self.facts }).map_err(|error| GpuError::Plan(error.to_string()))?;
        let formats = self.key(1, 1, hazy(&plan)).formats();
        let multisamples = self.options.antialias.multisamples();
        self.programs.push(Program::new(&self.gpu, plan, &mut self.uploads, &formats, multisamples)?);
        Ok(self.programs.len() - 1)
    }

    fn key(&self, width: u32, height: u32, hazy: bool) -> Key {
        let antialias = self.options.antialias;
        // WebGPU multisamples no 32-bit targets.
        let half = antialias.multisamples() > 1
            || match self.options.budget {
                Budget::Exact => false,
                Budget::Paper => true,
                Budget::Within(error) => error >= HALF_ERROR,
            };
        let precision = if half { Precision::Half } else { Precision::Full };
        let blooms = hazy && self.facts.setup.effects.has(Effect::Bloom);
        Key { width, height, antialias, precision, hazy, blooms }
    }

    /// The place of the targets for such images; those of another size give way to them.
    fn stage(&mut self, camera: &Camera, hazy: bool) -> Result<usize, GpuError> {
        let key = self.key(camera.width, camera.height, hazy);
        self.stages
            .retain(|stage| (stage.targets.key.width, stage.targets.key.height) == (key.width, key.height));
        if let Some(i) = self.stages.iter().position(|stage| stage.targets.key == key) {
            return Ok(i);
        }
        let targets = Targets::new(&self.gpu, key)?;
        let resolve = targets.samples.as_ref().map(|samples| Resolve::new(&self.gpu, &targets, samples));
        let sigma = self.uploads.content().scene.bloom.sigma;
        let backdrop = self.backdrop.as_ref().map(|(_, backdrop)| backdrop);
        let finish = Finish::new(&self.gpu, &targets, sigma, backdrop);
        self.gpu.check()?;
        self.stages.push(Stage { targets, resolve, finish });
        Ok(self.stages.len() - 1)
    }

    /// Draw the whole or a term; what follows the mesh's passes where it is to be `finished`.
    fn draw(
        &mut self,
        output: Option<TermName>,
        camera: &Camera,
        gain: f64,
        finished: bool,
    ) -> Result<Drawn, GpuError> {
        let mut timer = self.options.timed.then(|| Timer::new(&self.gpu));
        let (stage, copies) = self.submit(output, camera, gain, finished, timer.as_mut())?;
        let planes = copies.iter().map(|copy| copy.read(&self.gpu)).collect::<Result<Vec<_>, _>>()?;
        Ok(Drawn { stage, planes, times: timer.map(|timer| timer.times).unwrap_or_default() })
    }

    /// Have an image drawn: the place of the targets that it is drawn into, and copies of what it is made of. Waits
    /// only where it is timed.
    fn submit(
        &mut self,
        output: Option<TermName>,
        camera: &Camera,
        gain: f64,
        finished: bool,
        mut timer: Option<&mut Timer>,
    ) -> Result<(usize, Vec<Copy>), GpuError> {
        let program = self.program(output)?;
        let place = self.stage(camera, hazy(&self.programs[program].plan))?;
        let (gpu, program, stage) = (&self.gpu, &self.programs[program], &self.stages[place]);
        let mut copies = Vec::new();
        let tiles = &stage.targets.tiles;
        for (i, &tile) in tiles.iter().enumerate() {
            let (params, morph_weights) = (&self.uploads.content().params, self.morph_weights.as_slice());
            program.set(gpu, &Values { params, camera, tile, morph_weights });
            let mut encoder =
                gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("frame") });
            stage.encode_tile(gpu, &mut encoder, program, tile, i == 0, timer.as_deref_mut());
            if i + 1 == tiles.len() {
                copies = stage.encode_end(gpu, &mut encoder, gain, finished, timer.as_deref_mut());
            }
            if let Some(timer) = &timer {
                timer.finish(&mut encoder);
            }
            gpu.queue.submit([encoder.finish()]);
            if let Some(timer) = &mut timer {
                timer.collect(gpu)?;
            }
            gpu.check()?;
        }
        Ok((place, copies))
    }
}

/// What was drawn and read back.
struct Drawn {
    /// The place of its targets.
    stage: usize,
    planes: Vec<Vec<f32>>,
    times: Vec<PassTime>,
}

/// Whether a plan's alpha is the haze.
fn hazy(plan: &Plan) -> bool {
    plan.facts.needs().haze && plan.facts.output.is_none()
}

impl Stage {
    /// The image of a frame that is finished: the last passes have the gain in them already.
    fn finished_image(&self, planes: &[Vec<f32>], gain: f64) -> (Image, usize) {
        self.image(planes, if self.finish.is_some() { 1.0 } else { gain as f32 })
    }

    /// Draw the mesh into a tile, and its samples into the image.
    fn encode_tile(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        program: &Program,
        tile: Tile,
        first: bool,
        mut timer: Option<&mut Timer>,
    ) {
        if first {
            program.prepare(encoder, timer.as_deref_mut());
        }
        let targets = &self.targets;
        let drawn = targets.samples.as_ref().unwrap_or(&targets.pixels);
        let attachments = match &targets.multisampled {
            Some(multisampled) => attached(multisampled, Some(drawn), true),
            None => attached(drawn, None, true),
        };
        let depth = RenderPassDepthStencilAttachment {
            view: &targets.depth,
            depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Discard }),
            stencil_ops: None,
        };
        {
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("raster"),
                color_attachments: &attachments,
                depth_stencil_attachment: Some(depth),
                timestamp_writes: timer.as_mut().and_then(|timer| timer.around("raster")),
                ..RenderPassDescriptor::default()
            });
            let n = targets.key.antialias.grid();
            let (width, height) = ((n * tile.width) as f32, (n * tile.height) as f32);
            pass.set_viewport(0.0, 0.0, width, height, 0.0, 1.0);
            program.draw(&mut pass);
        }
        if let Some(resolve) = &self.resolve {
            resolve.set(gpu, tile);
            let attachments = attached(&targets.pixels, None, first);
            let times = timer.as_mut().and_then(|timer| timer.around("resolve"));
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("resolve"),
                color_attachments: &attachments,
                timestamp_writes: times,
                ..RenderPassDescriptor::default()
            });
            resolve.draw(&mut pass, tile);
        }
        if let (Some(resolve), Some(glow)) = (&self.resolve, &targets.glow) {
            let times = timer.as_mut().and_then(|timer| timer.around("resolve, glow"));
            let load = if first { LoadOp::Clear(Color::TRANSPARENT) } else { LoadOp::Load };
            over(encoder, glow, load, times, |pass| resolve.draw_glow(pass, tile));
        }
    }

    /// After the last tile: what stands behind the mesh and the bloom, where it is to be `finished`, and copies of what
    /// the image is made of.
    fn encode_end(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        gain: f64,
        finished: bool,
        mut timer: Option<&mut Timer>,
    ) -> Vec<Copy> {
        let Some(finish) = self.finish.as_ref().filter(|_| finished) else {
            return self.targets.pixels.views().map(|view| Copy::new(gpu, encoder, view)).collect();
        };
        finish.set(gpu, gain);
        let clear = LoadOp::Clear(Color::TRANSPARENT);
        if let Some(blurred) = finish.blurred() {
            let times = timer.as_mut().and_then(|timer| timer.around("bloom, rows"));
            over(encoder, blurred, clear, times, |pass| finish.draw_across(pass));
        }
        let last = if finish.blurred().is_some() { "bloom, columns" } else { "backdrop" };
        let times = timer.as_mut().and_then(|timer| timer.around(last));
        over(encoder, &finish.whole, clear, times, |pass| finish.draw_last(pass));
        vec![Copy::new(gpu, encoder, &finish.whole)]
    }

    /// The image of those planes, and how many of its pixels reached the end of the targets' range.
    fn image(&self, planes: &[Vec<f32>], gain: f32) -> (Image, usize) {
        let key = &self.targets.key;
        let largest = key.precision.largest();
        let mut image = Image::new(key.width as usize, key.height as usize);
        let mut clipped = 0;
        let texels = planes[0].chunks_exact(4);
        for (i, texel) in texels.enumerate() {
            let rgb = [texel[0], texel[1], texel[2]].map(|x| x.clamp(-largest, largest));
            clipped += usize::from(rgb.iter().any(|x| x.abs() >= largest));
            image.rgb[i] = rgb.map(|x| gain * x);
            image.alpha[i] = planes.get(1).map_or(texel[3], |coverage| coverage[i]);
        }
        (image, clipped)
    }
}

/// Planes as a pass's attachments, resolved into others where those are given.
fn attached<'a>(
    planes: &'a Planes,
    resolved: Option<&'a Planes>,
    clear: bool,
) -> Vec<Option<RenderPassColorAttachment<'a>>> {
    let mut resolved = resolved.map(Planes::views);
    let attachment = |view: &'a TextureView| {
        let resolve_target = resolved.as_mut().and_then(Iterator::next);
        let load = if clear { LoadOp::Clear(Color::TRANSPARENT) } else { LoadOp::Load };
        let store = if resolve_target.is_some() { StoreOp::Discard } else { StoreOp::Store };
        Some(RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target,
            ops: Operations { load, store },
        })
    };
    planes.views().map(attachment).collect()
}

/// A pass over the whole of `view`.
fn over(
    encoder: &mut CommandEncoder,
    view: &TextureView,
    load: LoadOp<Color>,
    timestamp_writes: Option<RenderPassTimestampWrites<'_>>,
    draw: impl FnOnce(&mut wgpu::RenderPass<'_>),
) {
    let ops = Operations { load, store: StoreOp::Store };
    let attachment = RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops };
    let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
        color_attachments: &[Some(attachment)],
        timestamp_writes,
        ..RenderPassDescriptor::default()
    });
    draw(&mut pass);
}

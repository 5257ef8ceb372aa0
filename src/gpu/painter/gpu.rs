//! The production renderer.

use std::sync::Arc;

use super::{BACKGROUND, Beside, Cut, PaintError, Painter, Painting, Picture};
use crate::bake::PoseBake;
use crate::model::gain::Gain;
use crate::model::params::Params;
use crate::model::terms::TermName;
use crate::prepare::Baked;
use crate::render::backdrop::Backdrop;
use crate::render::image::Image;
use crate::render::shade::PLAIN_LAYER;
use crate::scene::Scene;
use crate::scene::mesh::Mesh;
use crate::scene::view::Camera;
use crate::timing::PassTime;
use crate::upload::Content;
use crate::{Gpu, GpuError, RenderOptions, Renderer};

/// The production renderer.
pub struct GpuPainter {
    gpu: Gpu,
    renderer: Renderer,
    scene: Arc<Scene>,
    params: Params,
    terms: Vec<TermName>,
    times: Vec<PassTime>,
    /// Whether what the user should know of the uploads was told.
    told: bool,
}

impl GpuPainter {
    /// Of a scene, on an adapter's device.
    ///
    /// # Errors
    /// As of [`Renderer::new`], and when the scene has what the CPU engine alone draws.
    pub fn new(gpu: Gpu, baked: &Baked, options: RenderOptions) -> Result<Self, GpuError> {
        GpuError::check_drawn(&baked.scene)?;
        let mut renderer = Renderer::new(&gpu, Content::of(baked), options)?;
        renderer.set_background(baked.scene.views[0].background);
        let terms = TermName::of(baked.scene.effects);
        let scene = Arc::clone(&baked.scene);
        let params = baked.scene.params.clone();
        Ok(Self { gpu, renderer, scene, params, terms, times: Vec::new(), told: false })
    }

    /// The layers of a frame: terms, what is not skin, and what stands behind the mesh.
    fn layers(&mut self, camera: &Camera, gain: Gain) -> Result<Vec<(String, Image)>, GpuError> {
        let mut terms = Vec::new();
        for &name in &self.terms {
            terms.push((name, self.renderer.render_term(name, camera, gain)?));
        }
        let plain = self.renderer.render_plain(camera, gain)?.filter(is_seen);
        Ok(self.with_background(terms, plain, camera, gain))
    }

    /// Terms by their names, what is not skin, and what stands behind them.
    fn with_background(
        &self,
        terms: Vec<(TermName, Image)>,
        plain: Option<Image>,
        camera: &Camera,
        gain: Gain,
    ) -> Vec<(String, Image)> {
        let (scene, n) = (&*self.scene, self.renderer.backdrop_samples());
        let background = scene.views[0].background;
        let mut covered = Image::new(camera.width as usize, camera.height as usize);
        for layer in terms.last().map(|(_, image)| image).into_iter().chain(&plain) {
            covered.alpha.iter_mut().zip(&layer.alpha).for_each(|(covered, part)| *covered += part);
        }
        let behind = Backdrop::new(scene, &self.params, background, camera, n)
            .map(|backdrop| (BACKGROUND.to_owned(), backdrop.layer(&covered, gain)));
        let named = terms.into_iter().map(|(name, image)| (name.name().to_owned(), image));
        let plain = plain.map(|image| (PLAIN_LAYER.to_owned(), image));
        named.chain(plain).chain(behind).collect()
    }

    /// What of a frame was cut; of texels once.
    fn cut(&mut self, pixels: usize) -> Cut {
        let told = std::mem::replace(&mut self.told, true);
        Cut { texels: if told { 0 } else { self.renderer.clipped_texels() }, pixels }
    }
}

/// Whether something of a layer is seen.
fn is_seen(layer: &Image) -> bool {
    layer.alpha.iter().any(|alpha| *alpha > 0.0)
}

impl Painter for GpuPainter {
    fn name(&self) -> String {
        let kind = if self.gpu.is_software() { " (software)" } else { "" };
        // A browser may keep it to itself.
        let name = if self.gpu.name().is_empty() { "WebGPU" } else { self.gpu.name() };
        format!("gpu: {name}{kind}")
    }

    fn set_mesh(&mut self, mesh: &Mesh, own: Option<PoseBake>) -> Result<(), PaintError> {
        Ok(self.renderer.set_mesh(mesh, own.as_ref())?)
    }

    fn set_params(&mut self, params: &Params) -> Result<(), PaintError> {
        self.renderer.set_params(params)?;
        self.params = params.clone();
        Ok(())
    }

    fn set_samples(&mut self, per_axis: u32) {
        self.renderer.set_grid(per_axis);
    }

    fn paint(&mut self, camera: &Camera, gain: Gain, beside: Beside) -> Result<Picture, PaintError> {
        let frame = self.renderer.render(camera, gain)?;
        self.times = frame.times;
        let layers = if beside.layers { self.layers(camera, gain)? } else { Vec::new() };
        let haze = match beside.haze {
            true => self.renderer.render_haze(camera, gain)?,
            false => Vec::new(),
        };
        Ok(Picture { image: frame.image, layers, haze, cut: self.cut(frame.clipped) })
    }

    fn paint_async<'a>(&'a mut self, camera: &'a Camera, gain: Gain, beside: Beside) -> Painting<'a> {
        Box::pin(async move {
            let frame = self.renderer.render_async(camera, gain).await?;
            let mut layers = Vec::new();
            if beside.layers {
                let mut terms = Vec::new();
                for name in self.terms.clone() {
                    terms.push((name, self.renderer.render_term_async(name, camera, gain).await?));
                }
                let plain = self.renderer.render_plain_async(camera, gain).await?.filter(is_seen);
                layers = self.with_background(terms, plain, camera, gain);
            }
            let haze = match beside.haze {
                true => self.renderer.render_haze_async(camera, gain).await?,
                false => Vec::new(),
            };
            self.times = Vec::new();
            Ok(Picture { image: frame.image, layers, haze, cut: self.cut(frame.clipped) })
        })
    }

    fn uploaded_bytes(&self) -> u64 {
        self.renderer.uploaded_bytes()
    }

    fn stats(&self) -> Vec<String> {
        let plan = self.renderer.plan();
        let mut lines: Vec<String> =
            self.times.iter().map(|t| format!("{:>16}  {:9.3} ms", t.pass, t.milliseconds)).collect();
        if !self.gpu.timestamps() {
            lines.push(format!("{:>16}  the adapter has no timestamps", "GPU time"));
        }
        let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let atlas = self.renderer.atlas_traffic();
        if atlas.passes > 0 {
            let (moved, passes) = (mebibytes(atlas.bytes), atlas.passes);
            lines.push(format!(
                "{:>16}  {passes:9} over the UV atlas, {moved:.3} MiB read and left",
                "passes"
            ));
        }
        let mebibytes = mebibytes(self.renderer.uploaded_bytes());
        lines.push(format!("{:>16}  {mebibytes:9.3} MiB", "uploaded"));
        lines.push(format!("{:>16}  {:9} of 16-bit cubes", "texels cut", self.renderer.clipped_texels()));
        let names = plan.resources.iter().map(|r| r.name()).collect::<Vec<_>>().join(", ");
        lines.push(format!("{:>16}  {:9} ({names})", "bindings", plan.resources.len()));
        let names = plan.attributes.iter().map(|a| a.name()).collect::<Vec<_>>().join(", ");
        lines.push(format!("{:>16}  {:9} ({names})", "vertex buffers", plan.attributes.len()));
        lines
    }
}

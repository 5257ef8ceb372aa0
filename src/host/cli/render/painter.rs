//! What draws frames: the CPU engine, or the GPU's renderer.

use std::sync::Arc;

use super::Refusal;
use crate::bake::interreflection::VertexGather;
use crate::bake::lobe_sky::LobeSky;
use crate::bake::rays::RayMesh;
use crate::bake::sky::traces_lobes;
use crate::bake::{PoseBake, SkyBake, VertexOcclusion, VertexThickness};
use crate::model::effects::Effect;
use crate::prepare::Baked;
use crate::render::backdrop::Backdrop;
use crate::render::bloom::add_bloom;
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::samples::{Atlas, PosedSurface, SurfaceBakes, atlas_of, gather_of, sample_view};
use crate::scene::Scene;
use crate::scene::mesh::{Mesh, Morph, PosedMesh};
use crate::scene::mip_maps::MipMaps;
use crate::scene::view::Camera;

/// What a frame shows.
pub(super) struct Picture {
    pub(super) image: Image,
    /// An image for each term and what stands behind the mesh, where layers are asked for.
    pub(super) layers: Vec<(String, Image)>,
    /// The haze of each pixel, where it is asked for and an effect makes one.
    pub(super) haze: Vec<f32>,
    /// What the user should know.
    pub(super) warnings: Vec<String>,
}

/// What a picture is to hold beside the image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// An image for each term and what stands behind the mesh.
    pub(super) layers: bool,
    /// The haze.
    pub(super) haze: bool,
}

/// An engine with a scene in it.
pub(super) trait Painter {
    /// The engine, in words.
    fn name(&self) -> String;
    /// Move the mesh to another pose, with what is baked of that pose where it has bakes of its own.
    fn set_mesh(&mut self, mesh: &Mesh, own: Option<PoseBake>) -> Result<(), Refusal>;
    /// The image that `camera` sees, times `gain`.
    fn paint(&mut self, camera: &Camera, gain: f64, beside: Beside) -> Result<Picture, Refusal>;
    /// What the last frame took, a line each.
    fn stats(&self) -> Vec<String>;
}

/// The layer of what stands behind the mesh.
const BACKGROUND: &str = "background";

/// The CPU engine: rays through the samples' positions, the model in f64.
pub(super) struct CpuPainter {
    scene: Arc<Scene>,
    occlusion: Option<Arc<VertexOcclusion>>,
    sky: Option<Arc<SkyBake>>,
    thickness: Option<Arc<VertexThickness>>,
    lobe_sky: Option<Arc<LobeSky>>,
    mip_maps: Option<Arc<MipMaps>>,
    shader: Shader,
    pose: Pose,
    atlas: Option<Arc<Atlas>>,
    seconds: f64,
}

impl CpuPainter {
    /// Of a scene at its own pose.
    pub(super) fn new(baked: &Baked) -> Result<Self, Refusal> {
        let shader = Shader::new(baked.setup(), &baked.illumination, &baked.scene.params)?;
        let (scene, occlusion) = (Arc::clone(&baked.scene), baked.occlusion.clone());
        let (pose, sky, thickness) =
            (Pose::of(&scene, &scene.mesh, None), baked.sky.clone(), baked.thickness.clone());
        let mip_maps = MipMaps::new(&scene.maps, scene.quality.texture_filter).map(Arc::new);
        let traced = traces_lobes(&scene, scene.needs().fields);
        let lobe_sky = if traced { LobeSky::of_scene(&scene).map(Arc::new) } else { None };
        let mut painter = Self {
            scene,
            occlusion,
            sky,
            thickness,
            lobe_sky,
            mip_maps,
            shader,
            pose,
            atlas: None,
            seconds: 0.0,
        };
        let atlas = atlas_of(&painter.scene, &painter.surface()?)?;
        painter.atlas = atlas;
        Ok(painter)
    }

    /// The mesh as it is posed, with what is baked of it.
    fn surface(&self) -> Result<PosedSurface<'_>, Refusal> {
        let Pose { mesh, rays, morphs, own, gather } = &self.pose;
        let bakes = SurfaceBakes {
            occlusion: own.occlusion.as_ref().or(self.occlusion.as_deref()),
            sky: own.sky.as_ref().or(self.sky.as_deref()),
            thickness: own.thickness.as_ref().or(self.thickness.as_deref()),
            gather: gather.as_ref(),
            lobe_sky: self.lobe_sky.as_ref(),
            mip_maps: self.mip_maps.as_ref(),
        };
        Ok(PosedSurface::new(&self.scene, mesh, rays, morphs, bakes)?)
    }
}

/// The mesh in the world, as rays see it; its targets at their weights, and what is baked of this pose alone.
struct Pose {
    mesh: PosedMesh,
    rays: RayMesh,
    morphs: Vec<Morph>,
    own: PoseBake,
    gather: Option<VertexGather>,
}

impl Pose {
    fn of(scene: &Scene, mesh: &Mesh, own: Option<PoseBake>) -> Self {
        let posed = mesh.pose();
        let rays = RayMesh::new(&posed.positions, &posed.triangles);
        let gather = gather_of(scene, &posed);
        let (morphs, own) = (mesh.morphs.clone(), own.unwrap_or_default());
        Self { mesh: posed, rays, morphs, own, gather }
    }
}

impl Painter for CpuPainter {
    fn name(&self) -> String {
        "cpu".to_owned()
    }

    fn set_mesh(&mut self, mesh: &Mesh, own: Option<PoseBake>) -> Result<(), Refusal> {
        self.pose = Pose::of(&self.scene, mesh, own);
        let atlas = atlas_of(&self.scene, &self.surface()?)?;
        self.atlas = atlas;
        Ok(())
    }

    fn paint(&mut self, camera: &Camera, gain: f64, beside: Beside) -> Result<Picture, Refusal> {
        let start = std::time::Instant::now();
        let scene = &*self.scene;
        let mut samples = sample_view(scene, &self.surface()?, camera);
        samples.atlas.clone_from(&self.atlas);
        let mut shaded = self.shader.shade(&samples, camera, gain);
        let mut layers: Vec<(String, Image)> =
            shaded.terms.into_iter().map(|(name, image)| (name.name().to_owned(), image)).collect();
        let background = scene.views[0].background;
        let n = scene.quality.samples_per_axis;
        if let Some(backdrop) = Backdrop::new(scene, &scene.params, background, camera, n) {
            layers.push((BACKGROUND.to_owned(), backdrop.layer(&shaded.image, gain)));
            backdrop.put_behind(&mut shaded.image, &mut shaded.glow, gain);
        }
        if scene.effects.has(Effect::Bloom) {
            add_bloom(&mut shaded.image, &shaded.glow, scene.bloom.sigma);
        }
        self.seconds = start.elapsed().as_secs_f64();
        let layers = if beside.layers { layers } else { Vec::new() };
        let haze = if beside.haze { shaded.haze } else { Vec::new() };
        Ok(Picture { image: shaded.image, layers, haze, warnings: Vec::new() })
    }

    fn stats(&self) -> Vec<String> {
        vec![format!("{:>16}  {:9.3} ms", "samples, shading", 1e3 * self.seconds)]
    }
}

pub(super) use gpu::GpuPainter;

mod gpu {
    use super::{
        Arc, BACKGROUND, Backdrop, Baked, Beside, Camera, Image, Mesh, Painter, Picture, PoseBake, Refusal,
        Scene,
    };
    use crate::cli::graphics::Task;
    use crate::gpu::timing::PassTime;
    use crate::gpu::upload::Content;
    use crate::gpu::{Gpu, GpuError, RenderOptions, Renderer};
    use crate::model::terms::TermName;

    /// The production renderer.
    pub(in crate::cli::render) struct GpuPainter {
        gpu: Gpu,
        renderer: Renderer,
        scene: Arc<Scene>,
        terms: Vec<TermName>,
        times: Vec<PassTime>,
        /// Whether what the user should know of the uploads was told.
        told: bool,
    }

    impl GpuPainter {
        /// Of a scene, on an adapter's device.
        pub(in crate::cli::render) fn new(
            gpu: Gpu,
            baked: &Baked,
            options: RenderOptions,
        ) -> Result<Self, GpuError> {
            let mut renderer = Renderer::new(&gpu, Content::of(baked), options)?;
            renderer.set_background(baked.scene.views[0].background);
            let terms = TermName::of(baked.scene.effects);
            let scene = Arc::clone(&baked.scene);
            Ok(Self { gpu, renderer, scene, terms, times: Vec::new(), told: false })
        }

        /// The layers of a frame: terms, and what stands behind the mesh.
        fn layers(&mut self, camera: &Camera, gain: f64) -> Result<Vec<(String, Image)>, GpuError> {
            let mut layers = Vec::new();
            let mut last = None;
            for &name in &self.terms {
                let image = self.renderer.render_term(name, camera, gain)?;
                last = Some(Image { rgb: Vec::new(), ..image.clone() });
                layers.push((name.name().to_owned(), image));
            }
            let (scene, n) = (&*self.scene, self.renderer.backdrop_samples());
            let background = scene.views[0].background;
            if let Some(coverage) = last
                && let Some(backdrop) = Backdrop::new(scene, &scene.params, background, camera, n)
            {
                layers.push((BACKGROUND.to_owned(), backdrop.layer(&coverage, gain)));
            }
            Ok(layers)
        }

        /// What the user should know of a frame.
        fn warnings(&mut self, clipped: usize) -> Vec<String> {
            let mut warnings = Vec::new();
            let texels = self.renderer.clipped_texels();
            if texels > 0 && !std::mem::replace(&mut self.told, true) {
                warnings.push(format!(
                    "{texels} texels of the environment's cubes are brighter than 65504, the end of 16-bit textures' \
                     range, and are cut there. Use --accuracy exact to have them whole."
                ));
            }
            if clipped > 0 {
                warnings.push(format!(
                    "{clipped} pixels are brighter than 65504, the end of the 16-bit targets' range, and were cut \
                     there. Use --accuracy exact and no msaa4 to have them whole."
                ));
            }
            warnings
        }
    }

    impl Painter for GpuPainter {
        fn name(&self) -> String {
            let kind = if self.gpu.is_software() { " (software)" } else { "" };
            format!("gpu: {}{kind}", self.gpu.name())
        }

        fn set_mesh(&mut self, mesh: &Mesh, own: Option<PoseBake>) -> Result<(), Refusal> {
            let refused = |error: GpuError| Task::Render.refusal(&error);
            self.renderer.set_mesh(mesh, own.as_ref()).map_err(refused)
        }

        fn paint(&mut self, camera: &Camera, gain: f64, beside: Beside) -> Result<Picture, Refusal> {
            let refused = |error: GpuError| Task::Render.refusal(&error);
            let frame = self.renderer.render(camera, gain).map_err(refused)?;
            self.times = frame.times;
            let layers = if beside.layers { self.layers(camera, gain).map_err(refused)? } else { Vec::new() };
            let haze = match beside.haze {
                true => self.renderer.render_haze(camera, gain).map_err(refused)?,
                false => Vec::new(),
            };
            Ok(Picture { image: frame.image, layers, haze, warnings: self.warnings(frame.clipped) })
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
}

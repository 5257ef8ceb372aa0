//! What draws frames: the CPU engine, or the GPU's renderer.

use super::Refusal;
use crate::bake::rays::RayMesh;
use crate::model::compose::TermName;
use crate::model::effects::Effect;
use crate::prepare::Prepared;
use crate::render::bloom::add_bloom;
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::samples::{self, sample_view};
use crate::scene::mesh::{Mesh, PosedMesh};
use crate::scene::view::Camera;

/// What a frame shows.
pub(super) struct Picture {
    pub(super) image: Image,
    /// An image for each term, where layers are asked for.
    pub(super) layers: Vec<(TermName, Image)>,
    /// What the user should know.
    pub(super) warnings: Vec<String>,
}

/// An engine with a scene in it.
pub(super) trait Painter {
    /// The engine, in words.
    fn name(&self) -> String;
    /// Move the mesh to another pose.
    fn set_mesh(&mut self, mesh: &Mesh) -> Result<(), Refusal>;
    /// The image that `camera` sees, times `gain`.
    fn paint(&mut self, camera: &Camera, gain: f64, layers: bool) -> Result<Picture, Refusal>;
    /// What the last frame took, a line each.
    fn stats(&self) -> Vec<String>;
}

/// The CPU engine: rays through the samples' positions, the model in f64.
pub(super) struct CpuPainter<'a> {
    prepared: &'a Prepared,
    shader: Shader,
    posed: PosedMesh,
    rays: RayMesh,
    /// Open share of each vertex' hemisphere.
    open: Option<Vec<f32>>,
    seconds: f64,
}

impl<'a> CpuPainter<'a> {
    /// Of a scene at its own pose.
    pub(super) fn new(prepared: &'a Prepared) -> Result<Self, Refusal> {
        let shader = Shader::new(prepared.setup(), &prepared.illumination, &prepared.scene.params);
        let (posed, rays, open) = pose(prepared, &prepared.scene.mesh)?;
        Ok(Self { prepared, shader, posed, rays, open, seconds: 0.0 })
    }
}

/// The mesh in the world, as rays see it, and its occlusion.
fn pose(prepared: &Prepared, mesh: &Mesh) -> Result<(PosedMesh, RayMesh, Option<Vec<f32>>), Refusal> {
    let posed = mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let open = samples::posed_occlusion(
        &prepared.scene,
        &mesh.morphs,
        mesh.positions.len(),
        prepared.occlusion.as_ref(),
    )?;
    Ok((posed, rays, open))
}

impl Painter for CpuPainter<'_> {
    fn name(&self) -> String {
        "cpu".to_owned()
    }

    fn set_mesh(&mut self, mesh: &Mesh) -> Result<(), Refusal> {
        (self.posed, self.rays, self.open) = pose(self.prepared, mesh)?;
        Ok(())
    }

    fn paint(&mut self, camera: &Camera, gain: f64, layers: bool) -> Result<Picture, Refusal> {
        let start = std::time::Instant::now();
        let scene = &self.prepared.scene;
        let samples = sample_view(scene, &self.posed, &self.rays, self.open.as_deref(), camera);
        let mut shaded = self.shader.shade(&samples, camera, gain);
        if scene.effects.has(Effect::Bloom) {
            add_bloom(&mut shaded.image, &shaded.haze);
        }
        self.seconds = start.elapsed().as_secs_f64();
        let layers = if layers { shaded.terms } else { Vec::new() };
        Ok(Picture { image: shaded.image, layers, warnings: Vec::new() })
    }

    fn stats(&self) -> Vec<String> {
        vec![format!("{:>16}  {:9.3} ms", "samples, shading", 1e3 * self.seconds)]
    }
}

#[cfg(feature = "gpu")]
pub(super) use gpu::GpuPainter;

#[cfg(feature = "gpu")]
mod gpu {
    use super::{Camera, Mesh, Painter, Picture, Prepared, Refusal, TermName};
    use crate::cli::graphics::Task;
    use crate::gpu::timing::PassTime;
    use crate::gpu::upload::Content;
    use crate::gpu::{Gpu, GpuError, RenderOptions, Renderer};

    /// The production renderer.
    pub(in crate::cli::render) struct GpuPainter<'a> {
        gpu: &'a Gpu,
        renderer: Renderer<'a>,
        terms: Vec<TermName>,
        times: Vec<PassTime>,
    }

    impl<'a> GpuPainter<'a> {
        /// Of a scene, on an adapter's device.
        pub(in crate::cli::render) fn new(
            gpu: &'a Gpu,
            prepared: &'a Prepared,
            options: RenderOptions,
        ) -> Result<Self, GpuError> {
            let content = Content {
                scene: &prepared.scene,
                illumination: &prepared.illumination,
                occlusion: prepared.occlusion.as_ref(),
                params: &prepared.scene.params,
            };
            let renderer = Renderer::new(gpu, content, options)?;
            let terms = TermName::of(prepared.scene.effects);
            Ok(Self { gpu, renderer, terms, times: Vec::new() })
        }
    }

    impl Painter for GpuPainter<'_> {
        fn name(&self) -> String {
            let kind = if self.gpu.is_software() { " (software)" } else { "" };
            format!("gpu: {}{kind}", self.gpu.name())
        }

        fn set_mesh(&mut self, mesh: &Mesh) -> Result<(), Refusal> {
            self.renderer.set_mesh(mesh);
            Ok(())
        }

        fn paint(&mut self, camera: &Camera, gain: f64, layers: bool) -> Result<Picture, Refusal> {
            let refused = |error: GpuError| Task::Render.refusal(&error);
            let frame = self.renderer.render(camera, gain).map_err(refused)?;
            self.times = frame.times;
            let wanted = if layers { self.terms.as_slice() } else { &[] };
            let term = |&name| Ok((name, self.renderer.render_term(name, camera, gain)?));
            let layers = wanted.iter().map(term).collect::<Result<_, GpuError>>().map_err(refused)?;
            let warning = format!(
                "{} pixels are brighter than 65504, the end of the 16-bit targets' range, and were cut there. \
                 Use --accuracy exact and no msaa4 to have them whole.",
                frame.clipped
            );
            let warnings = if frame.clipped > 0 { vec![warning] } else { Vec::new() };
            Ok(Picture { image: frame.image, layers, warnings })
        }

        fn stats(&self) -> Vec<String> {
            let plan = self.renderer.plan();
            let mut lines: Vec<String> =
                self.times.iter().map(|t| format!("{:>16}  {:9.3} ms", t.pass, t.milliseconds)).collect();
            if !self.gpu.timestamps() {
                lines.push(format!("{:>16}  the adapter has no timestamps", "GPU time"));
            }
            let mebibytes = self.renderer.uploaded_bytes() as f64 / f64::from(1 << 20);
            lines.push(format!("{:>16}  {mebibytes:9.3} MiB", "uploaded"));
            let names = plan.resources.iter().map(|r| r.name()).collect::<Vec<_>>().join(", ");
            lines.push(format!("{:>16}  {:9} ({names})", "bindings", plan.resources.len()));
            let names = plan.attributes.iter().map(|a| a.name()).collect::<Vec<_>>().join(", ");
            lines.push(format!("{:>16}  {:9} ({names})", "vertex buffers", plan.attributes.len()));
            lines
        }
    }
}

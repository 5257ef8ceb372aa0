//! Samples that the adapter makes itself: the production renderer's geometry pass, in the place of rays and uploads.

use std::sync::Arc;

use web_time::Instant;

use wgpu::{Buffer, BufferUsages, CommandEncoderDescriptor};

use super::part::Part;
use super::pipeline::buffer;
use crate::geometry::{Geometry, Wanted};
use crate::readback::read_floats;
use crate::records::unpacked;
use crate::samples::covered::Covered;
use crate::samples::{
    LANES, SampleError, SurfaceRecords, ViewSamples, asked_records, check_uvs, nothing_visible,
    posed_occlusion,
};
use crate::scene::Scene;
use crate::scene::view::Camera;
use crate::shader::PlanError;
use crate::upload::Content;
use crate::{Gpu, GpuError};

/// Samples cannot be made on the adapter.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant is the stage's own error")]
pub enum DeviceSampleError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Samples(#[from] SampleError),
}

/// The samples of a scene's views on an adapter: which there are is known, and what they show is drawn straight into
/// the engine's buffers.
///
/// The positions in the image, the groups and the shares are those of [`sample_views`](crate::samples::sample_views),
/// but for samples at edges that the rasteriser gives to the other side. What a sample shows is computed in f32 at
/// what the rasteriser interpolates.
pub struct DeviceSamples {
    gpu: Gpu,
    geometry: Geometry,
    views: Vec<(Camera, Covered)>,
    seconds: f64,
}

impl DeviceSamples {
    /// Draw which samples of each of the scene's views show its mesh, and group them. With them come the groups, view
    /// by view: [`ViewSamples`] that hold no surface.
    ///
    /// # Errors
    /// When a view sees nothing of the mesh, the mesh lacks what the effects ask for, or the device fails.
    pub fn new(gpu: &Gpu, content: Content) -> Result<(Self, Vec<ViewSamples>), DeviceSampleError> {
        let start = Instant::now();
        let scene = Arc::clone(&content.scene);
        let scene = &*scene;
        if let Some(field) = scene.needs().fields.iter().find(|field| !field.is_of_vertices()) {
            return Err(GpuError::Plan(PlanError::not_found_on_adapters(field.name()).to_string()).into());
        }
        GpuError::check_sampled(scene)?;
        if scene.needs().atlas {
            // Texels are the CPU's, as are the samples' places in them.
            return Err(GpuError::Plan(PlanError::no_atlas(scene.effects).to_string()).into());
        }
        check_uvs(scene, &scene.mesh.uvs)?;
        posed_occlusion(scene, &scene.mesh.morphs, scene.mesh.positions.len(), content.occlusion.as_deref())?;
        let records = asked_records(scene, 0);
        let geometry = Geometry::new(gpu, content, records.places(), records.rows().stride())?;
        let (mut views, mut samples) = (Vec::new(), Vec::new());
        for view in &scene.views {
            let mask = geometry.cover(&view.camera, axis(scene))?;
            let (covered, groups) = Covered::new(scene, &view.camera, &mask);
            if covered.count() == 0 {
                return Err(nothing_visible(scene, view).into());
            }
            views.push((view.camera, covered));
            samples.push(groups);
        }
        Ok((Self { gpu: gpu.clone(), geometry, views, seconds: start.elapsed().as_secs_f64() }, samples))
    }

    /// The device that they are on.
    #[must_use]
    pub const fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Whether these are the groups that came with the samples, all of them and in their order.
    pub fn came_with(&self, groups: &[&ViewSamples]) -> bool {
        let alike =
            |((_, covered), groups): (&(Camera, Covered), &&ViewSamples)| covered.groups() == groups.groups();
        self.views.len() == groups.len() && self.views.iter().zip(groups).all(alike)
    }

    /// How many samples there are, padding aside.
    #[must_use]
    pub fn count(&self) -> usize {
        self.views.iter().map(|(_, covered)| covered.count()).sum()
    }

    /// What it took to draw and group which samples there are.
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Draw the samples of the parts into their buffers.
    pub(super) fn fill(&self, parts: &[Part]) -> Result<(), GpuError> {
        for (index, (camera, covered)) in self.views.iter().enumerate() {
            let of_view = parts.iter().filter(|part| part.view == index);
            let wanted = |part: &'_ Part| Wanted {
                groups: part.groups.clone(),
                records: part.buffers.samples.clone(),
            };
            let wanted: Vec<Wanted> = of_view.map(wanted).collect();
            self.geometry.fill(camera, covered, &wanted)?;
        }
        self.gpu.check()
    }

    /// The surface of view `index`, drawn into a buffer, and records that have places for it.
    pub fn draw(&self, index: usize, groups: &ViewSamples) -> Result<(Buffer, SurfaceRecords), GpuError> {
        let (camera, covered) = &self.views[index];
        let surface = asked_records(&self.geometry.content().scene, groups.records());
        let bytes = 4 * LANES * surface.rows().all().len();
        let records = buffer(&self.gpu, "samples", bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        self.gpu.check()?;
        let wanted = Wanted { groups: 0..groups.groups(), records: records.clone() };
        self.geometry.fill(camera, covered, &[wanted])?;
        Ok((records, surface))
    }

    /// The surface of view `index`, drawn and read from the device: what the groups that came with it lack.
    ///
    /// # Errors
    /// When the device fails, or a buffer cannot hold them.
    pub fn read(&self, index: usize, groups: &ViewSamples) -> Result<SurfaceRecords, GpuError> {
        let (records, mut surface) = self.draw(index, groups)?;
        let encoder = self.gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
        let numbers = read_floats(&self.gpu, encoder, &records)?;
        let stride = surface.rows().stride();
        surface.rows_mut().fill(&unpacked(&numbers, stride));
        Ok(surface)
    }
}

/// Samples along a pixel's side.
fn axis(scene: &Scene) -> u32 {
    scene.quality.samples_per_axis.max(1)
}

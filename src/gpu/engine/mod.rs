//! The GPU engine: the fused pass ([`fused`]) over samples on a graphics adapter.
//!
//! - [`GpuEngine`]: the objective, and what it is made of; `build`: how it is made
//! - `equations`: how sums become normal equations; `objective`: what solvers see
//! - [`fused`]: the text of that pass
//! - `parts`: samples and targets on the device, each `part` of them within a binding; what does not fit the
//!   memory allowed is uploaded anew in each pass. `cuts`: where views are cut; `dispatch`: how a part is dispatched
//! - [`DeviceSamples`]: samples that the adapter makes itself, by the production renderer's geometry pass
//! - `terms`: samples replaced by their terms, where no free parameter needs a lookup
//! - `levels`: levels of the UV atlas, and what samples look up of them ([`StoredAtlas`]: what they are made of)
//! - `lights`: the cubes and the uniform block, as shaders are given them
//! - `program`: the shaders of a wish, and one run of them
//! - `images`: the forward pass: images, and how long they take
//! - `pipeline`: what both make pipelines and bindings with

mod build;
mod cuts;
mod dispatch;
mod equations;
pub mod fused;
mod images;
mod levels;
mod lights;
mod objective;
mod part;
mod parts;
mod pipeline;
mod program;
mod samples;
mod terms;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use self::equations::PassSums;
use self::fused::{Fitted, Fused, Layout, Looked};
use self::images::Images;
use self::levels::DeviceLevels;
pub use self::levels::StoredAtlas;
use self::lights::DeviceLights;
use self::parts::{Parts, ViewFormat};
use self::program::Program;
pub use self::samples::{DeviceSampleError, DeviceSamples};
use self::terms::replace_samples;
use crate::bake::Illumination;
use crate::model::evaluate::Setup;
use crate::model::gain::Gain;
use crate::model::params::Param;
use crate::model::terms::TermName;
use crate::scene::Loss;
use crate::shader::facts::FaceSizes;
use crate::{Gpu, GpuError};
use skinfit_core::engine::view::ObservedView;
use skinfit_core::engine::{BLOCK, PassOutputs, Point, Unknown};

/// How much of the device is used.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    /// Most bytes of a part: the adapter's limit for a binding, unless this is lower.
    pub part: Option<u64>,
    /// Most bytes that stay on the device; parts beyond it are uploaded in each pass. Without: all stay.
    pub resident: Option<u64>,
}

/// Loss, gradient and normal equations on a graphics adapter.
pub struct GpuEngine {
    gpu: Gpu,
    /// What makes the samples, where they are not uploaded.
    made: Option<Arc<DeviceSamples>>,
    /// What making them took.
    made_seconds: f64,
    setup: Setup,
    views: Arc<[ObservedView]>,
    /// For the one pass that the CPU makes: see `pulls`.
    illumination: Arc<Illumination>,
    loss: Loss,
    unknowns: Vec<Unknown>,
    stride: usize,
    /// Sum of weights over the pixels that a pass reads, and how many of them count.
    weight: (f64, u64),
    alpha: bool,
    format: ViewFormat,
    /// How samples look up what stands in the UV atlas: where the environment is not turned, and where it is.
    looked_up: [Looked; 2],
    /// The parameters that terms are made with, where terms stand in the place of samples.
    held: Option<Vec<Param>>,
    /// What changes between passes; a pass at a time.
    device: Mutex<OnDevice>,
    fault: Mutex<Option<GpuError>>,
}

/// What is on the device.
struct OnDevice {
    parts: Parts,
    lights: DeviceLights,
    /// Where something is computed in texels.
    levels: Option<DeviceLevels>,
    /// By wish, and by what is written into the text.
    programs: BTreeMap<(PassOutputs, Specialization), Program>,
    /// What the terms were made with that stand in the samples' place.
    terms: Option<Vec<[f64; 3]>>,
    /// Whether terms stand there, perhaps in some parts only.
    replaced: bool,
    /// The forward pass, and what is written into its text: with a term, that one alone.
    images: Option<((Specialization, Option<TermName>), Images)>,
}

/// What of a point is written into shaders' text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Specialization {
    /// Whether the environment is turned, or will be.
    turned: bool,
    /// Whether a view's gain is not 1, or will not be.
    gained: bool,
}

impl GpuEngine {
    /// Let each pass read only every `stride`-th block of pixels: a coarse fit on a fraction of them.
    pub fn set_stride(&mut self, stride: usize) {
        self.stride = stride.max(1);
        let device = self.device.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.weight = device.parts.set_stride(self.stride);
    }

    /// The views.
    #[must_use]
    pub const fn views(&self) -> &Arc<[ObservedView]> {
        &self.views
    }

    /// Bytes of the buffers that hold samples, targets and weights on the device, and bytes that each pass for the
    /// normal equations uploads: once for each of its shaders.
    #[must_use]
    pub fn bytes(&self) -> (u64, u64) {
        let device = self.lock();
        let (held, streamed) = device.parts.bytes();
        let normal = device.programs.iter().find(|((wish, _), _)| *wish == PassOutputs::Normal);
        (held, streamed * normal.map_or(1, |(_, program)| program.shaders()))
    }

    /// What made the samples where they were not uploaded, and the seconds that it took.
    #[must_use]
    pub fn device_samples(&self) -> Option<(&DeviceSamples, f64)> {
        Some((self.made.as_deref()?, self.made_seconds))
    }

    /// The adapter's name.
    #[must_use]
    pub fn adapter(&self) -> &str {
        self.gpu.name()
    }

    /// How many blocks of pixels there are in all views.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.views.iter().map(|view| view.samples.groups().div_ceil(BLOCK)).sum()
    }

    /// Why no pass can be made any more, if so.
    #[must_use]
    pub fn device_fault(&self) -> Option<GpuError> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn lock(&self) -> MutexGuard<'_, OnDevice> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn written(&self, point: &Point) -> Specialization {
        let turns = |u: &Unknown| matches!(u, Unknown::Param(c) if c.param == Param::EnvironmentRotation);
        let gains = |u: &Unknown| matches!(u, Unknown::Gain(..));
        Specialization {
            turned: point.params.scalar(Param::EnvironmentRotation) != 0.0 || self.unknowns.iter().any(turns),
            gained: point.gains.iter().any(|gain| *gain != Gain::ONE) || self.unknowns.iter().any(gains),
        }
    }

    /// What is the same for every view, over samples.
    fn fitted(&self, written: Specialization, faces: FaceSizes) -> Fitted {
        Fitted {
            setup: self.setup,
            output: None,
            unknowns: self.unknowns.clone(),
            loss: self.loss,
            alpha: self.alpha,
            turned: written.turned,
            gained: written.gained,
            faces,
            layout: Layout::of_samples(&self.format.places, self.format.rows)
                .with_levels(self.looked_up[usize::from(written.turned)].clone()),
            several: self.format.several,
            weighted: self.format.weighted,
            clipped: self.format.clipped,
        }
    }

    fn fused(
        &self,
        written: Specialization,
        faces: FaceSizes,
        output: Option<TermName>,
    ) -> Result<Fused, GpuError> {
        let mut fitted = Fitted { output, ..self.fitted(written, faces) };
        if self.held.is_some() {
            fitted.layout = Layout::of_terms(self.setup, &fitted.layout);
        }
        Fused::new(fitted).map_err(GpuError::Plan)
    }

    /// Have on the device what samples look up of the UV atlas at `point`.
    fn look_up(&self, point: &Point, device: &mut OnDevice) -> Result<(), GpuError> {
        let OnDevice { parts, lights, levels, .. } = device;
        let Some(levels) = levels else { return Ok(()) };
        let at = (self.written(point).turned, &point.params);
        levels.set(&self.gpu, at, (&self.illumination, lights), &self.views, parts)
    }

    /// How often levels of the UV atlas were made: once for as long as nothing changes that moves them.
    #[must_use]
    pub fn levels_made(&self) -> u64 {
        self.lock().levels.as_ref().map_or(0, DeviceLevels::count)
    }

    /// Have the terms at `point` in the place of the samples, where that is how passes are made.
    fn keep(&self, point: &Point, device: &mut OnDevice) -> Result<(), GpuError> {
        let Some(held) = &self.held else { return Ok(()) };
        let key: Vec<[f64; 3]> = held.iter().map(|&param| point.params.rgb(param)).collect();
        if device.terms.as_ref() == Some(&key) {
            return Ok(());
        }
        let OnDevice { parts, lights, programs, images, terms, replaced, .. } = device;
        *terms = None;
        if std::mem::replace(replaced, true) {
            parts.reload(&self.gpu, &self.views, self.made.as_deref())?;
        }
        // Their bindings are to the buffers before.
        programs.clear();
        *images = None;
        let fitted = self.fitted(self.written(point), lights.face_sizes());
        let layout = Layout::of_terms(self.setup, &fitted.layout);
        replace_samples(&self.gpu, &fitted, &layout, &point.params, lights, parts, &self.views)?;
        *terms = Some(key);
        Ok(())
    }

    /// One pass: for each part of each view its sums.
    fn sums(&self, point: &Point, wish: PassOutputs) -> Result<PassSums, GpuError> {
        let written = self.written(point);
        let mut device = self.lock();
        self.keep(point, &mut device)?;
        self.look_up(point, &mut device)?;
        let OnDevice { parts, lights, programs, .. } = &mut *device;
        let program = match programs.entry((wish, written)) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::btree_map::Entry::Vacant(entry) => {
                let fused = self.fused(written, lights.face_sizes(), None)?;
                entry.insert(Program::new(&self.gpu, fused, wish, parts)?)
            }
        };
        lights.set(&self.gpu, &point.params, &mut program.inputs)?;
        let sums = program.run(&self.gpu, parts, &self.views, &point.gains)?;
        Ok(PassSums { sums, columns: program.columns().to_vec(), view_of: parts.views() })
    }
}

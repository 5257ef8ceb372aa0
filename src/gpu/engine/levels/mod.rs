//! What samples look up of the UV atlas: levels that the adapter makes and passes look up by texture coordinates, or what the
//! processor has found of each sample.
//!
//! - this module: which of the two; `device`: the adapter's, `stored`: what these read; `processor`: the other

mod device;
mod processor;
mod stored;

pub use self::stored::StoredAtlas;

use self::device::MadeLevels;
use self::processor::UploadedLevels;
use super::fused::{Fitted, Fused, Looked};
use super::lights::DeviceLights;
use super::parts::Parts;
use crate::bake::Illumination;
use crate::model::params::Params;
use crate::model::terms::TermName;
use crate::{Gpu, GpuError};
use skinfit_core::engine::view::ObservedView;
use skinfit_core::program::levels::LevelProgram;

/// Levels beside samples.
pub(super) enum DeviceLevels {
    Made(MadeLevels),
    Uploaded(UploadedLevels),
}

impl DeviceLevels {
    /// Of a fit, whose environment is turned or not; `None` where nothing is computed in texels.
    ///
    /// # Errors
    /// When no rules yield it, it cannot be computed, or the samples have no texels.
    pub(super) fn new(
        gpu: &Gpu,
        fitted: impl Fn(bool) -> Fitted,
        views: &[ObservedView],
    ) -> Result<Option<Self>, GpuError> {
        let setup = fitted(true).setup;
        if !setup.needs().atlas {
            return Ok(None);
        }
        let told = |error: &dyn std::fmt::Display| GpuError::Plan(error.to_string());
        let fused = |turned: bool| -> Result<Vec<Fused>, GpuError> {
            // Images of one term alone look up no more than this.
            let terms = TermName::of(setup.effects).into_iter().map(Some);
            let outputs = std::iter::once(None).chain(terms);
            let fused = outputs.map(|output| Fused::new(Fitted { output, ..fitted(turned) }));
            fused.collect::<Result<_, String>>().map_err(GpuError::Plan)
        };
        let fused = [fused(false)?, fused(true)?];
        let program = |fused: &[Fused]| -> Result<LevelProgram, GpuError> {
            let mut program = LevelProgram::default();
            for fused in fused {
                program.extend(fused.levels().map_err(|error| told(&error))?);
            }
            Ok(program)
        };
        let uploaded = UploadedLevels::new([program(&fused[0])?, program(&fused[1])?]);
        uploaded.check(setup.effects, views)?;
        Ok(Some(match MadeLevels::new(gpu, &fused, views)? {
            Some(made) => Self::Made(made),
            None => Self::Uploaded(uploaded),
        }))
    }

    /// How samples look up.
    pub(super) fn looked(&self, turned: bool) -> Looked {
        match self {
            Self::Made(made) => made.looked(turned),
            Self::Uploaded(uploaded) => {
                Looked::Rows { fields: uploaded.fields(turned), rows: uploaded.rows() }
            }
        }
    }

    /// Rows beside each record of samples.
    pub(super) fn rows(&self) -> usize {
        match self {
            Self::Made(_) => 0,
            Self::Uploaded(uploaded) => uploaded.rows(),
        }
    }

    /// The buffer that all samples look levels up in.
    pub(super) const fn buffer(&self) -> Option<&wgpu::Buffer> {
        match self {
            Self::Made(made) => Some(made.buffer()),
            Self::Uploaded(_) => None,
        }
    }

    /// Have the levels of `params` on the device.
    pub(super) fn set(
        &mut self,
        gpu: &Gpu,
        at: (bool, &Params),
        (illumination, lights): (&Illumination, &mut DeviceLights),
        views: &[ObservedView],
        parts: &mut Parts,
    ) -> Result<(), GpuError> {
        match self {
            Self::Made(made) => made.set(gpu, at, lights),
            Self::Uploaded(uploaded) => uploaded.set(gpu, at, illumination, views, parts),
        }
    }

    /// How often levels were made.
    pub(super) fn count(&self) -> u64 {
        match self {
            Self::Made(made) => made.count(),
            Self::Uploaded(uploaded) => uploaded.count(),
        }
    }
}

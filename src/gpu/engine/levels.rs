//! What samples look up of the UV atlas: made by the processor ([`LevelMaker`]), and uploaded when it has changed.

use super::fused::{Fitted, Fused};
use super::parts::Parts;
use crate::bake::Illumination;
use crate::model::params::Params;
use crate::model::terms::TermName;
use crate::samples::rows::Row;
use crate::{Gpu, GpuError};
use skinfit_core::engine::cubes_at::CubesAt;
use skinfit_core::engine::levels::LevelMaker;
use skinfit_core::engine::view::ObservedView;
use skinfit_core::program::levels::LevelProgram;

/// Makes the rows beside samples.
pub(super) struct DeviceLevels {
    /// For an environment that is not turned, and for one that is.
    makers: [LevelMaker<f32>; 2],
    /// What the rows were made with that are on the device.
    made_with: Option<(bool, Vec<f64>)>,
}

impl DeviceLevels {
    /// Of a fit, whose environment is turned or not; `None` where nothing is computed in texels.
    ///
    /// # Errors
    /// When no rules yield it, the processor cannot compute them, or the samples have no texels.
    pub(super) fn new(
        fitted: impl Fn(bool) -> Fitted,
        views: &[ObservedView],
    ) -> Result<Option<Self>, GpuError> {
        let setup = fitted(true).setup;
        if !setup.needs().atlas {
            return Ok(None);
        }
        let maker = |turned: bool| -> Result<LevelMaker<f32>, GpuError> {
            let mut program = LevelProgram::default();
            // Images of one term alone look up no more than this.
            let terms = TermName::of(setup.effects).into_iter().map(Some);
            for output in std::iter::once(None).chain(terms) {
                let fused = Fused::new(Fitted { output, ..fitted(turned) }).map_err(GpuError::Plan)?;
                program.extend(fused.levels().map_err(|error| GpuError::Plan(error.to_string()))?);
            }
            Ok(LevelMaker::new(program))
        };
        let makers = [maker(false)?, maker(true)?];
        for (maker, view) in makers.iter().flat_map(|maker| views.iter().map(move |view| (maker, view))) {
            let checked = maker.check(setup.effects, &view.samples);
            checked.map_err(|error| GpuError::Plan(error.to_string()))?;
        }
        Ok(Some(Self { makers, made_with: None }))
    }

    /// Rows that there is room for, of each record.
    pub(super) fn rows(&self) -> usize {
        self.makers.iter().map(LevelMaker::rows).max().unwrap_or(0)
    }

    /// What the rows hold, each with how many numbers it has.
    pub(super) fn fields(&self, turned: bool) -> Vec<(String, usize)> {
        self.makers[usize::from(turned)].program().looked_up.clone()
    }

    /// Have the rows of `params` on the device.
    pub(super) fn set(
        &mut self,
        gpu: &Gpu,
        (turned, params): (bool, &Params),
        illumination: &Illumination,
        views: &[ObservedView],
        parts: &mut Parts,
    ) -> Result<(), GpuError> {
        let (rows, maker) = (self.rows(), &self.makers[usize::from(turned)]);
        let made_with = Some((turned, maker.made_with(params)));
        if self.made_with == made_with {
            return Ok(());
        }
        let cubes = || CubesAt::new(illumination, params, |x| x);
        let looked_up = |view: &ObservedView| {
            let found = maker.look_up(&view.samples, params, cubes, Row::of);
            padded(found, maker.rows(), rows, view.samples.records())
        };
        let all = views.iter().map(looked_up).collect();
        self.made_with = None;
        parts.set_levels(gpu, views, all)?;
        self.made_with = made_with;
        Ok(())
    }

    /// How often levels were made.
    pub(super) fn count(&self) -> u64 {
        self.makers.iter().map(LevelMaker::count).sum()
    }
}

/// So many records of `stride` rows, with rows of 0 up to `wanted`.
fn padded(rows: Vec<Row>, stride: usize, wanted: usize, records: usize) -> Vec<Row> {
    if stride == wanted {
        return rows;
    }
    let mut all = vec![Row::ZERO; wanted * records];
    if stride > 0 {
        let of_records = all.chunks_mut(wanted).zip(rows.chunks(stride));
        of_records.for_each(|(all, rows)| all[..stride].copy_from_slice(rows));
    }
    all
}

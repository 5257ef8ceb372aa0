//! What samples look up of the UV atlas, made by the processor ([`LevelMaker`]), and uploaded when it has changed: where an
//! adapter does not make levels itself.

use crate::bake::Illumination;
use crate::engine::parts::Parts;
use crate::model::effects::Effects;
use crate::model::params::Params;
use crate::samples::rows::Row;
use crate::{Gpu, GpuError};
use skinfit_core::engine::cubes_at::CubesAt;
use skinfit_core::engine::levels::LevelMaker;
use skinfit_core::engine::view::ObservedView;
use skinfit_core::program::levels::LevelProgram;

/// Makes the rows beside samples.
pub(in crate::engine) struct UploadedLevels {
    /// For an environment that is not turned, and for one that is.
    makers: [LevelMaker<f32>; 2],
    /// What the rows were made with that are on the device.
    made_with: Option<(bool, Vec<f64>)>,
}

impl UploadedLevels {
    /// Of the programs for an environment that is not turned, and for one that is.
    pub(super) fn new(programs: [LevelProgram; 2]) -> Self {
        Self { makers: programs.map(LevelMaker::new), made_with: None }
    }

    /// Refuse views without the texels that the effects are computed in.
    ///
    /// # Errors
    /// When one has none.
    pub(super) fn check(&self, effects: Effects, views: &[ObservedView]) -> Result<(), GpuError> {
        for (maker, view) in self.makers.iter().flat_map(|maker| views.iter().map(move |view| (maker, view)))
        {
            let checked = maker.check(effects, &view.samples);
            checked.map_err(|error| GpuError::Plan(error.to_string()))?;
        }
        Ok(())
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

/// `records` records of `stride` rows, with rows of 0 up to `wanted`.
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

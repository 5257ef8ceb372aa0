//! One approximation, swept from its cheapest setting to the one that the others are measured against.

use serde::Serialize;

use super::bench::Bench;
pub use super::bench::Rates;
use super::benches::Benches;
use super::pooled::pooled;
use crate::StudyError;
use crate::model::effects::Silhouette;
use crate::reference::Difference;
use crate::scene::Quality;
use crate::timing::Timed;

/// An approximation, swept over all scenes of a study.
pub trait Axis: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;
    /// Whether a scene asks for it at all, and several can be taken together.
    ///
    /// # Errors
    /// The reason why not, without a full stop.
    fn applies(&self, benches: &Benches<'_>) -> Result<(), Idle>;
    /// Whether a scene file can have its settings, so that some may be chosen.
    fn settable(&self) -> bool {
        false
    }
    /// Whether it is about fits, which may leave views out.
    fn fits(&self) -> bool {
        false
    }
    /// About how many seconds [`sweep`](Self::sweep) will take, from the `rates` of each scene and cheap settings tried.
    ///
    /// # Errors
    /// When a stage fails.
    fn seconds(&self, benches: &Benches<'_>, rates: &[Rates]) -> Result<f64, StudyError>;
    /// Measure each setting.
    ///
    /// # Errors
    /// When a stage fails.
    fn sweep(&self, benches: &Benches<'_>) -> Result<Sweep, StudyError>;
}

/// Why an axis is not swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Idle {
    /// No scene asks for it.
    Unasked(&'static str),
    /// The scenes cannot be taken together along it.
    Apart(&'static str),
}

/// An approximation that is swept in each scene by itself.
pub trait SceneAxis: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;
    /// Whether the scene asks for it at all; else why not, without a full stop.
    ///
    /// # Errors
    /// The reason.
    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str>;
    /// Whether two scenes have the same settings along it; else why not, without a full stop.
    ///
    /// # Errors
    /// The reason.
    fn alike(&self, _: &Bench<'_>, _: &Bench<'_>) -> Result<(), &'static str> {
        Ok(())
    }
    /// As of [`Axis::settable`].
    fn settable(&self) -> bool {
        false
    }
    /// About how many seconds [`sweep`](Self::sweep) will take, from `rates` and cheap settings tried.
    ///
    /// # Errors
    /// When a stage fails.
    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError>;
    /// Measure each setting.
    ///
    /// # Errors
    /// When a stage fails.
    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError>;
}

/// The scenes that ask for it are swept one after the other, and taken together.
impl<T: SceneAxis> Axis for T {
    fn name(&self) -> &'static str {
        SceneAxis::name(self)
    }

    fn applies(&self, benches: &Benches<'_>) -> Result<(), Idle> {
        let mut asked = benches.scenes.iter().filter(|bench| SceneAxis::applies(self, bench).is_ok());
        let Some(first) = asked.next() else {
            return SceneAxis::applies(self, benches.first()).map_err(Idle::Unasked);
        };
        asked.try_for_each(|other| self.alike(first, other).map_err(Idle::Apart))
    }

    fn settable(&self) -> bool {
        SceneAxis::settable(self)
    }

    fn seconds(&self, benches: &Benches<'_>, rates: &[Rates]) -> Result<f64, StudyError> {
        let asked = benches.scenes.iter().zip(rates);
        let asked = asked.filter(|(bench, _)| SceneAxis::applies(self, bench).is_ok());
        asked.map(|(bench, rates)| SceneAxis::seconds(self, bench, *rates)).sum()
    }

    fn sweep(&self, benches: &Benches<'_>) -> Result<Sweep, StudyError> {
        let asked = benches.scenes.iter().filter(|bench| SceneAxis::applies(self, bench).is_ok());
        let swept = asked.map(|bench| Ok((bench.name.as_str(), SceneAxis::sweep(self, bench)?)));
        pooled(&swept.collect::<Result<Vec<_>, StudyError>>()?)
    }
}

/// What was measured along an axis.
#[derive(Clone, Debug, Serialize)]
pub struct Sweep {
    /// The axis' name.
    pub axis: &'static str,
    /// What is asked, as a heading.
    pub title: &'static str,
    /// How it was measured: what the error is of, and what the cost.
    pub method: String,
    /// What `cost` counts: `seconds` of something, or another unit.
    pub cost: &'static str,
    /// The settings; one is the reference.
    pub settings: Vec<Setting>,
    /// Curves beside the settings: a loss along each solver's way.
    pub traces: Vec<Trace>,
}

/// One setting of an axis.
#[derive(Clone, Debug, Serialize)]
pub struct Setting {
    /// What it is called.
    pub name: String,
    /// What it sets in a scene file, where it can be set there.
    #[serde(skip)]
    pub choose: Option<Choose>,
    /// How far its images are from the reference's.
    pub error: Difference,
    /// What it costs, in the sweep's unit.
    pub cost: f64,
    /// The time behind it, with its spread, where the cost is a time.
    pub time: Option<Timed>,
    /// Counts beside it: a name and a number.
    pub counts: Vec<(&'static str, f64)>,
    /// Whether the others are measured against it.
    pub reference: bool,
    /// Whether it is what the scene has at present; of several, what any of them has.
    pub present: bool,
    /// Whether no other setting is both as cheap and as accurate.
    pub pareto: bool,
}

impl Setting {
    /// What is to be noted of it: whether the others are measured against it, and whether the scene has it.
    #[must_use]
    pub fn notes(&self) -> Vec<&'static str> {
        let notes = [(self.reference, "reference"), (self.present, "the scene's")];
        notes.into_iter().filter_map(|(holds, note)| holds.then_some(note)).collect()
    }
}

/// A curve.
#[derive(Clone, Debug, Serialize)]
pub struct Trace {
    /// What it is of.
    pub name: String,
    /// Passes over the samples, seconds, and the loss there.
    pub points: Vec<(u64, f64, f64)>,
}

/// What a setting puts into a scene file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choose {
    /// A number of the `[quality]` table.
    Quality(Knob, u32),
    /// `[model] silhouette`.
    Silhouette(Silhouette),
}

/// A key of the `[quality]` table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "named as the keys")]
pub enum Knob {
    SamplesPerAxis,
    IrradianceSize,
    LobeSize,
    HiliteSize,
    LobesPerOctave,
    OcclusionRays,
}

impl Knob {
    /// Its key.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::SamplesPerAxis => "samples_per_axis",
            Self::IrradianceSize => "irradiance_size",
            Self::LobeSize => "lobe_size",
            Self::HiliteSize => "hilite_size",
            Self::LobesPerOctave => "lobes_per_octave",
            Self::OcclusionRays => "occlusion_rays",
        }
    }

    /// Its place in the table.
    pub const fn of(self, quality: &mut Quality) -> &mut u32 {
        match self {
            Self::SamplesPerAxis => &mut quality.samples_per_axis,
            Self::IrradianceSize => &mut quality.irradiance_size,
            Self::LobeSize => &mut quality.lobe_size,
            Self::HiliteSize => &mut quality.hilite_size,
            Self::LobesPerOctave => &mut quality.lobes_per_octave,
            Self::OcclusionRays => &mut quality.occlusion_rays,
        }
    }
}

/// Mark the settings that no other one beats in both cost and error.
pub fn mark_pareto(settings: &mut [Setting]) {
    let of: Vec<(f64, f64)> = settings.iter().map(|s| (s.cost, s.error.relative)).collect();
    for (i, setting) in settings.iter_mut().enumerate() {
        let (cost, error) = of[i];
        let beats = |&(j, &(c, e)): &(usize, &(f64, f64))| {
            let as_good = c <= cost && e <= error;
            as_good && (c < cost || e < error || j < i)
        };
        setting.pareto = !of.iter().enumerate().any(|other| beats(&other));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(cost: f64, relative: f64) -> Setting {
        Setting {
            name: String::new(),
            choose: None,
            error: Difference { relative, ..Difference::default() },
            cost,
            time: None,
            counts: Vec::new(),
            reference: false,
            present: false,
            pareto: false,
        }
    }

    #[test]
    fn settings_that_nothing_beats_are_pareto_optimal() {
        let mut settings: Vec<Setting> =
            [(1.0, 0.5), (2.0, 0.6), (2.0, 0.1), (3.0, 0.1), (9.0, 0.0), (9.0, 0.0)]
                .map(|(c, e)| setting(c, e))
                .into();
        mark_pareto(&mut settings);
        let optimal: Vec<bool> = settings.iter().map(|s| s.pareto).collect();
        // Of two that are equal, the first.
        assert_eq!(optimal, [true, false, true, false, true, false]);
    }
}

//! What the axes of the `[quality]` table share: a number swept, the greatest being the reference.

use crate::StudyError;
use crate::engine::Point;
use crate::reference::Difference;
use crate::scene::Scene;
use crate::timing::{Job, Rounds, interleaved, seconds_of};
use crate::tradeoff::axis::{Choose, Knob, Rates, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::{Bench, baked};
use crate::tradeoff::settings::Settings;

/// How bakes, traces and fits are timed. What takes longer than a few seconds is run once: what disturbs it for a
/// moment does not show in it. Of the others three rounds are the fewest with a middle.
pub(super) const ROUNDS: Rounds = Rounds { long: 3.0, least: 3, most: 7, seconds: 1.0 };

/// A number of the `[quality]` table to be swept.
pub(super) struct Swept<'a> {
    pub(super) axis: &'static str,
    pub(super) title: &'static str,
    pub(super) method: String,
    pub(super) knob: Knob,
    /// Ascending; the scene's own comes among them, and the last is the reference.
    pub(super) values: &'a [u32],
    /// What is counted of a value, and what its seconds grow with.
    pub(super) count: (&'static str, &'a dyn Fn(u32) -> f64),
    /// The value whose seconds are measured to foretell those of the others.
    pub(super) probe: u32,
}

/// The work whose seconds are the cost of a setting.
pub(super) type Work<'a> = &'a dyn Fn(Settings) -> Result<f64, StudyError>;

/// What the work took at one value.
#[derive(Clone, Copy)]
struct Probe {
    /// All of it, seconds.
    whole: f64,
    /// Of these, the seconds that are the cost.
    counted: f64,
}

impl Swept<'_> {
    fn settings(&self, bench: &Bench<'_>, value: u32) -> Settings {
        let mut settings = bench.settings();
        *self.knob.of(&mut settings.quality) = value;
        settings
    }

    /// What the scene has.
    fn present(&self, bench: &Bench<'_>) -> u32 {
        *self.knob.of(&mut bench.settings().quality)
    }

    /// The values, the scenes' own among them.
    fn values(&self, bench: &Bench<'_>) -> Vec<u32> {
        let mut values = self.values.to_vec();
        values.extend(bench.all.iter().map(|settings| *self.knob.of(&mut { settings.quality })));
        values.sort_unstable();
        values.dedup();
        values
    }

    /// About how many seconds [`Self::sweep`] takes, where the samples of a value take `trace` of them.
    pub(super) fn seconds(
        &self,
        bench: &Bench<'_>,
        rates: Rates,
        trace: &dyn Fn(u32) -> f64,
        work: Work<'_>,
    ) -> Result<f64, StudyError> {
        let mut counted = Ok(0.0);
        let whole = seconds_of(|| counted = work(self.settings(bench, self.probe)));
        Ok(self.expected(&self.values(bench), Probe { whole, counted: counted? }, rates.images, trace))
    }

    /// The seconds of [`Self::sweep`] over `values`, from those of one of them: what is counted grows with the count,
    /// the rest of the work is the same for all. Images, and the samples for them, are made once of each.
    fn expected(&self, values: &[u32], probe: Probe, images: f64, trace: &dyn Fn(u32) -> f64) -> f64 {
        let of = |value: u32| {
            let share = (self.count.1)(value) / (self.count.1)(self.probe);
            (probe.whole - probe.counted).max(0.0) + probe.counted * share
        };
        let jobs: Vec<f64> = values.iter().map(|&value| of(value)).collect();
        // What is not in the cache yet is baked once more.
        let evaluated: f64 = values.iter().map(|&value| images + trace(value) + of(value)).sum();
        evaluated + ROUNDS.expected(&jobs)
    }

    /// The images at each value against the last one's, and the seconds of `work` there.
    pub(super) fn sweep(
        &self,
        bench: &Bench<'_>,
        point: &Point,
        work: Work<'_>,
    ) -> Result<Sweep, StudyError> {
        let (values, present) = (self.values(bench), self.present(bench));
        let mut images = Vec::new();
        for &value in &values {
            images.push(bench.evaluate(self.settings(bench, value))?.images(point)?);
        }
        let mut works: Vec<Box<dyn FnMut() -> Result<f64, StudyError> + '_>> = Vec::new();
        for &value in &values {
            let settings = self.settings(bench, value);
            works.push(Box::new(move || work(settings)));
        }
        let mut jobs: Vec<Job<'_, StudyError>> =
            works.iter_mut().map(|job| &mut **job as Job<'_, StudyError>).collect();
        let timed = interleaved(ROUNDS, &mut jobs)?;
        drop(jobs);
        let reference = images.len() - 1;
        let setting = |(i, &value): (usize, &u32)| Setting {
            name: value.to_string(),
            choose: Some(Choose::Quality(self.knob, value)),
            error: Difference::of_all(&images[reference], &images[i]),
            // The work is the same each time: what is more than the least was another program's.
            cost: timed[i].least,
            time: Some(timed[i]),
            counts: vec![(self.count.0, (self.count.1)(value))],
            reference: i == reference,
            present: value == present,
            pareto: false,
        };
        let mut settings: Vec<Setting> = values.iter().enumerate().map(setting).collect();
        mark_pareto(&mut settings);
        let Self { axis, title, method, .. } = self;
        Ok(Sweep { axis, title, method: method.clone(), cost: "seconds", settings, traces: Vec::new() })
    }
}

/// The seconds of those bakes of a scene whose name begins with `name`; nothing comes from a cache.
pub(super) fn bake_seconds(bench: &Bench<'_>, scene: &Scene, name: &str) -> Result<f64, StudyError> {
    let (_, stats) = baked(scene, &bench.baked.scene, None)?;
    Ok(stats.rows.iter().filter(|row| row.name.starts_with(name)).map(|row| row.seconds).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four values of 1, 2, 4 and 8 units; at 2 units the work counts 0.5 s and spends 0.1 s on what is not counted.
    #[test]
    fn the_seconds_of_a_sweep_are_foretold_from_one_of_its_values() {
        let swept = Swept {
            axis: "rays",
            title: "",
            method: String::new(),
            knob: Knob::OcclusionRays,
            values: &[1, 2, 4, 8],
            count: ("units", &f64::from),
            probe: 2,
        };
        let foretold = swept
            .expected(&[1, 2, 4, 8], Probe { whole: 0.6, counted: 0.5 }, 0.25, &|value| f64::from(value));
        // Works of 0.35, 0.6, 1.1 and 2.1 s: once for the images with 0.25 s and 1, 2, 4 or 8 s of samples each, once
        // to warm up, and three rounds, the least, as all are short and one round takes more than a second.
        let works = 0.35 + 0.6 + 1.1 + 2.1;
        // Sums of a few numbers, in another order.
        assert!((foretold - ((4.0 * 0.25 + 15.0 + works) + works + 3.0 * works)).abs() < 1e-9, "{foretold}");
    }
}

//! What the axes of the `[quality]` table share: a number swept, the greatest being the reference.

use crate::StudyError;
use crate::engine::Point;
use crate::reference::Difference;
use crate::scene::Scene;
use crate::timing::{Job, Rounds, interleaved};
use crate::tradeoff::axis::{Choose, Knob, Setting, Sweep, mark_front};
use crate::tradeoff::bench::{Bench, Settings, baked};

/// How bakes, traces and fits are timed. What takes longer than a few seconds is run once: what disturbs it for a
/// moment does not show in it. Of the others three rounds are the fewest with a middle.
pub(super) const ROUNDS: Rounds = Rounds { long: 3.0, least: 3, most: 7, seconds: 1.0 };

/// A number of the `[quality]` table to be swept.
pub(super) struct Swept<'a> {
    pub(super) axis: &'static str,
    pub(super) title: &'static str,
    pub(super) method: String,
    pub(super) knob: Knob,
    /// Ascending; the last is the reference.
    pub(super) values: &'a [u32],
    /// What is counted of a value.
    pub(super) count: (&'static str, &'a dyn Fn(u32) -> f64),
}

impl Swept<'_> {
    fn settings(&self, bench: &Bench<'_>, value: u32) -> Settings {
        let mut settings = bench.settings();
        *self.knob.of(&mut settings.quality) = value;
        settings
    }

    /// The images at each value against the last one's, and the seconds of `work` there.
    pub(super) fn sweep(
        &self,
        bench: &Bench<'_>,
        point: &Point,
        work: &dyn Fn(Settings) -> Result<f64, StudyError>,
    ) -> Result<Sweep, StudyError> {
        let mut images = Vec::new();
        for &value in self.values {
            images.push(bench.evaluate(self.settings(bench, value))?.images(point));
        }
        let mut works: Vec<Box<dyn FnMut() -> Result<f64, StudyError> + '_>> = Vec::new();
        for &value in self.values {
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
            front: false,
        };
        let mut settings: Vec<Setting> = self.values.iter().enumerate().map(setting).collect();
        mark_front(&mut settings);
        let Self { axis, title, method, .. } = self;
        Ok(Sweep { axis, title, method: method.clone(), cost: "seconds", settings, traces: Vec::new() })
    }
}

/// The seconds of those bakes of a scene whose name begins with `name`; nothing comes from a cache.
pub(super) fn bake_seconds(bench: &Bench<'_>, scene: &Scene, name: &str) -> Result<f64, StudyError> {
    let (_, stats) = baked(scene, &bench.prepared.scene, None)?;
    Ok(stats.rows.iter().filter(|row| row.name.starts_with(name)).map(|row| row.seconds).sum())
}

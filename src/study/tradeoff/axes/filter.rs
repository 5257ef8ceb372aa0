//! What coarser filtering of the cubes costs in accuracy.

use super::format::images_in;
use crate::StudyError;
use crate::model::formats::{Emulated, Format, HardwareFilter, NearestTexel};
use crate::reference::Difference;
use crate::tradeoff::axis::{Rates, SceneAxis, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::Bench;

/// Filters of cube lookups.
pub(super) struct Filters;

impl SceneAxis for Filters {
    fn name(&self) -> &'static str {
        "filter"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.baked.scene;
        let asked = scene.needs().environment();
        asked.then_some(()).ok_or("no effect looks a cube up")
    }

    fn seconds(&self, _: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        // Once as it stands, and with each filter.
        Ok(4.0 * rates.images)
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let evaluated = bench.evaluate(bench.settings())?;
        let shader = evaluated.format_shader(&bench.point())?;
        let exact = images_in(&evaluated, bench, |s, c, g| shader.shade(s, c, g, 0.0_f64));
        let hardware = images_in(&evaluated, bench, |s, c, g| {
            shader.shade(s, c, g, Emulated::<HardwareFilter>::new(0.0))
        });
        let nearest =
            images_in(&evaluated, bench, |s, c, g| shader.shade(s, c, g, Emulated::<NearestTexel>::new(0.0)));
        let setting = |name: &str, fetches: f64, images: &[crate::render::image::Image]| Setting {
            name: name.to_owned(),
            choose: None,
            error: Difference::of_all(&exact, images),
            cost: fetches,
            time: None,
            counts: Vec::new(),
            reference: fetches == 4.0,
            present: false,
            pareto: false,
        };
        let mut settings = vec![
            setting(NearestTexel::NAME, 1.0, &nearest),
            setting(HardwareFilter::NAME, 1.0, &hardware),
            setting("exact", 4.0, &exact),
        ];
        mark_pareto(&mut settings);
        Ok(Sweep {
            axis: self.name(),
            title: "Filter of the cubes",
            method: "Lookups that take the nearest texel, that blend four by weights of 8 bits (as graphics hardware does, in one fetch), \
                     and that blend four exactly (in the shader, four fetches)."
                .to_owned(),
            cost: "fetches",
            settings,
            traces: Vec::new(),
        })
    }
}

//! How texture maps are filtered, beside many samples a pixel.

use crate::StudyError;
use crate::engine::Objective;
use crate::model::texture_filter::TextureFilter;
use crate::reference::Difference;
use crate::render::image::Image;
use crate::scene::Quality;
use crate::timing::seconds_of;
use crate::tradeoff::axis::{Rates, SceneAxis, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::Bench;
use crate::tradeoff::settings::Settings;

/// Filters of texture maps.
pub(super) struct Textures;

/// Samples along a pixel's side of the reference, at the least: 64 of them take a texel each where a map is eight times
/// as fine as the image.
const REFERENCE: u32 = 8;

/// The scene with another filter, at its own samples; and what the others are measured against.
fn settings(own: Settings) -> Vec<(String, Settings, bool)> {
    let with = |quality: Quality| Settings { quality, ..own };
    let n = own.quality.samples_per_axis.max(REFERENCE);
    let filters = TextureFilter::ALL.map(|texture_filter| {
        (texture_filter.name().to_owned(), with(Quality { texture_filter, ..own.quality }), false)
    });
    let many = Quality { samples_per_axis: n, texture_filter: TextureFilter::Bilinear, ..own.quality };
    filters.into_iter().chain([(format!("bilinear, {n} × {n} samples"), with(many), true)]).collect()
}

impl SceneAxis for Textures {
    fn name(&self) -> &'static str {
        "texture_filter"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let maps = &bench.baked.scene.maps;
        let any = maps.color.is_some()
            || maps.normal.is_some()
            || maps.specular.is_some()
            || maps.attenuator.is_some();
        any.then_some(()).ok_or("no effect looks a texture map up")
    }

    fn alike(&self, one: &Bench<'_>, other: &Bench<'_>) -> Result<(), &'static str> {
        let most = |bench: &Bench<'_>| bench.settings().quality.samples_per_axis.max(REFERENCE);
        (most(one) == most(other)).then_some(()).ok_or("the scenes' samples_per_axis differ")
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        let own = bench.settings().quality.samples_per_axis;
        let share = f64::from(own.max(REFERENCE).pow(2)) / f64::from(own.pow(2));
        Ok((3.0 + share) * (rates.trace + rates.images + rates.pass))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let own = bench.settings();
        let point = bench.point();
        let mut found: Vec<(String, Settings, bool, f64, Vec<Image>)> = Vec::new();
        for (name, settings, reference) in settings(own) {
            let mut evaluated = None;
            let tracing = seconds_of(|| evaluated = Some(bench.evaluate_anew(settings)));
            let Some(evaluated) = evaluated.transpose()? else { continue };
            let engine = evaluated.live_engine()?;
            let seconds = tracing + seconds_of(|| engine.loss(&point));
            found.push((name, settings, reference, seconds, evaluated.images(&point)?));
        }
        let exact = found.last().map(|(.., images)| images.clone()).unwrap_or_default();
        let mut settings: Vec<Setting> = found
            .into_iter()
            .map(|(name, settings, reference, seconds, images)| Setting {
                name,
                choose: None,
                error: Difference::of_all(&exact, &images),
                cost: seconds,
                time: None,
                counts: Vec::new(),
                reference,
                present: settings == own && !reference,
                pareto: false,
            })
            .collect();
        mark_pareto(&mut settings);
        Ok(Sweep {
            axis: self.name(),
            title: "Filter of texture maps",
            method: "Images with the scene's own samples and texture maps filtered each way; many samples a pixel, each of the finest \
                     texels, are the reference. Errors hold what more samples change beside textures, at outlines, the same for every filter. \
                     Seconds are those of tracing the surface, filtered maps with it, and of one pass over it, all views."
                .to_owned(),
            cost: "seconds",
            settings,
            traces: Vec::new(),
        })
    }
}

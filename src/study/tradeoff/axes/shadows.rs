//! How the renderer finds shadows: rays at vertices, or shadow maps of some size and filter.

use std::sync::Arc;

use super::quality::ROUNDS;
use crate::StudyError;
use crate::gpu::upload::Content;
use crate::gpu::{Choice, Gpu, RenderOptions, Renderer};
use crate::model::effects::Effect;
use crate::model::gain::Gain;
use crate::model::shadow_filter::ShadowFilter;
use crate::reference::Difference;
use crate::render::antialias::Antialias;
use crate::render::image::Image;
use crate::render::shading::Shading;
use crate::scene::{Scene, ShadowMaps};
use crate::shader::Budget;
use crate::timing::{Job, interleaved, seconds_of};
use crate::tradeoff::axis::{Rates, SceneAxis, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::{Bench, Evaluated};
use crate::tradeoff::settings::Settings;

/// Filters and sizes of shadow maps.
pub(super) struct Shadows;

/// Sizes at which each filter is measured.
const SIZES: [u32; 3] = [512, 1024, 2048];
/// Rays a sample towards a light that has a size, at the least, of the images that are compared with.
const REFERENCE_RAYS: u32 = 16;
/// Samples along a pixel's side that the renderer takes at most.
const MOST_SAMPLES: u32 = 8;

impl SceneAxis for Shadows {
    fn name(&self) -> &'static str {
        "shadows"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.baked.scene;
        let shaded = [Effect::Lights, Effect::Shadows].into_iter().all(|effect| scene.effects.has(effect));
        let lit = !scene.lights.is_empty() || !scene.sky_lights.is_empty();
        if !shaded || !lit {
            return Err("no light has a shadow");
        }
        if scene.cpu_samples().is_some() {
            return Err("adapters draw other images of it than the processor whatever the shadows, or none");
        }
        Gpu::open(&Choice::default())
            .map(drop)
            .map_err(|_| "there is no graphics adapter, which draws shadow maps")
    }

    fn alike(&self, one: &Bench<'_>, other: &Bench<'_>) -> Result<(), &'static str> {
        let same = one.baked.scene.shadow_maps == other.baked.scene.shadow_maps;
        same.then_some(()).ok_or("the scenes' shadow maps differ")
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        let gpu = Gpu::open(&Choice::default())?;
        let evaluated = bench.evaluate(bench.settings())?;
        let mut frames = Ok(Vec::new());
        let cheapest = ShadowMaps { filter: ShadowFilter::Vertices, ..ShadowMaps::default() };
        let first = seconds_of(|| {
            frames = Drawn::new(&gpu, bench, &evaluated, cheapest).and_then(|mut d| d.frames());
        });
        frames?;
        let settings = settings(bench.baked.scene.shadow_maps).len() as f64;
        // Each is drawn in some rounds; several comparisons take a few times as long as what vertices have.
        Ok(3.0 * rates.trace + rates.images + settings * 4.0 * ROUNDS.least as f64 * first)
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let gpu = Gpu::open(&Choice::default())?;
        let mut finest = bench.settings();
        finest.quality.shadow_rays = finest.quality.shadow_rays.max(REFERENCE_RAYS);
        let (reference, by_rays) = by_rays(bench, finest)?;
        let own = bench.baked.scene.shadow_maps;
        let evaluated = bench.evaluate(bench.settings())?;
        let all = settings(own);
        let mut drawn = Vec::new();
        for &maps in &all {
            drawn.push(Drawn::new(&gpu, bench, &evaluated, maps)?);
        }
        let mut images = Vec::new();
        for one in &mut drawn {
            images.push(one.frames()?);
        }
        let mut works: Vec<Box<dyn FnMut() -> Result<f64, StudyError> + '_>> = Vec::new();
        for one in &mut drawn {
            works.push(Box::new(move || one.milliseconds().map(|milliseconds| 1e-3 * milliseconds)));
        }
        let mut jobs: Vec<Job<'_, StudyError>> =
            works.iter_mut().map(|job| &mut **job as Job<'_, StudyError>).collect();
        let timed = interleaved(ROUNDS, &mut jobs)?;
        drop(jobs);
        let setting = |(i, maps): (usize, &ShadowMaps)| Setting {
            name: name(maps),
            choose: None,
            error: Difference::of_all(&reference, &images[i]),
            cost: timed[i].least,
            time: Some(timed[i]),
            counts: vec![("million texels", 1e-6 * f64::from(texels(maps)))],
            reference: false,
            present: *maps == own,
            pareto: false,
        };
        let rays = Setting {
            name: "rays".to_owned(),
            choose: None,
            error: Difference::of_all(&reference, &reference),
            cost: by_rays,
            time: None,
            counts: vec![("million texels", 0.0)],
            reference: true,
            present: false,
            pareto: false,
        };
        let mut settings: Vec<Setting> = all.iter().enumerate().map(setting).chain([rays]).collect();
        mark_pareto(&mut settings);
        Ok(Sweep {
            axis: self.name(),
            title: "Shadows in the renderer",
            method: format!(
                "The renderer's images against the processor's, which finds shadows by rays (from samples, {REFERENCE_RAYS} or \
                 more towards a light that has a size). Seconds are those of a frame of all views on {} in which the \
                 mesh has moved, so that the maps are drawn, too; of rays, those of tracing the samples.",
                gpu.name()
            ),
            cost: "seconds",
            settings,
            traces: Vec::new(),
        })
    }
}

/// The processor's images, and the seconds of tracing what they show.
fn by_rays(bench: &Bench<'_>, settings: Settings) -> Result<(Vec<Image>, f64), StudyError> {
    let mut evaluated = None;
    let seconds = seconds_of(|| evaluated = Some(bench.evaluate_anew(settings)));
    let images = evaluated.transpose()?.map(|evaluated| evaluated.images(&bench.point())).transpose()?;
    Ok((images.unwrap_or_default(), seconds))
}

/// What is measured: vertices, and each filter at each size with the scene's other choices; the scene's own among them.
fn settings(own: ShadowMaps) -> Vec<ShadowMaps> {
    let filters = [ShadowFilter::Hardware, ShadowFilter::Pcf, ShadowFilter::Pcss];
    let mapped = filters.into_iter().flat_map(|filter| SIZES.map(|size| ShadowMaps { filter, size, ..own }));
    let mut all = vec![ShadowMaps { filter: ShadowFilter::Vertices, ..own }];
    all.extend(mapped);
    if !all.contains(&own) {
        all.push(own);
    }
    all
}

fn name(maps: &ShadowMaps) -> String {
    match maps.filter {
        ShadowFilter::Vertices => maps.filter.name().to_owned(),
        filter => format!("{} {}", filter.name(), maps.size),
    }
}

/// Texels of one map.
fn texels(maps: &ShadowMaps) -> u32 {
    if maps.filter == ShadowFilter::Vertices { 0 } else { maps.size * maps.size }
}

/// The scene on an adapter.
struct Drawn<'a> {
    renderer: Renderer,
    scene: Arc<Scene>,
    gains: &'a [Gain],
}

impl<'a> Drawn<'a> {
    fn new(
        gpu: &Gpu,
        bench: &'a Bench<'_>,
        evaluated: &Evaluated,
        maps: ShadowMaps,
    ) -> Result<Self, StudyError> {
        let mut scene = evaluated.scene.clone();
        scene.shadow_maps = maps;
        // The processor's images here are without it.
        scene.effects = scene.effects.without(Effect::Bloom);
        let scene = Arc::new(scene);
        let content = Content {
            scene: Arc::clone(&scene),
            illumination: Arc::clone(&evaluated.illumination),
            occlusion: bench.baked.occlusion.clone(),
            sky: bench.baked.sky.clone(),
            thickness: bench.baked.thickness.clone(),
            params: scene.params.clone(),
        };
        let n = scene.quality.samples_per_axis.min(MOST_SAMPLES);
        let (antialias, budget) = (Antialias::Grid(n), Budget::Exact);
        let options =
            RenderOptions { antialias, shading: Shading::default(), budget, timed: true, animated: false };
        Ok(Self { renderer: Renderer::new(gpu, content, options)?, scene, gains: &bench.baked.gains })
    }

    /// The image of each view.
    fn frames(&mut self) -> Result<Vec<Image>, StudyError> {
        let Self { renderer, scene, gains } = self;
        let frame = |(view, &gain): (&crate::scene::view::View, &Gain)| {
            Ok(renderer.render(&view.camera, gain)?.image)
        };
        scene.views.iter().zip(gains.iter()).map(frame).collect()
    }

    /// What all views take, the shadow maps drawn once among it; by the clock, where passes cannot be timed.
    fn milliseconds(&mut self) -> Result<f64, StudyError> {
        let Self { renderer, scene, gains } = self;
        renderer.set_mesh(&scene.mesh, None)?;
        let since = std::time::Instant::now();
        let mut sum = 0.0;
        for (view, &gain) in scene.views.iter().zip(gains.iter()) {
            sum +=
                renderer.render(&view.camera, gain)?.times.iter().map(|time| time.milliseconds).sum::<f64>();
        }
        Ok(if sum > 0.0 { sum } else { 1e3 * since.elapsed().as_secs_f64() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scenes_own_choice_is_among_the_settings_once() {
        let usual = settings(ShadowMaps::default());
        assert_eq!(usual.len(), 10);
        assert_eq!(usual.iter().filter(|maps| **maps == ShadowMaps::default()).count(), 1);
        let own = ShadowMaps { size: 640, ..ShadowMaps::default() };
        let all = settings(own);
        assert_eq!((all.len(), all.last()), (11, Some(&own)));
        assert_eq!((name(&own).as_str(), texels(&own)), ("pcf 640", 640 * 640));
        assert_eq!((name(&all[0]).as_str(), texels(&all[0])), ("vertices", 0));
    }
}

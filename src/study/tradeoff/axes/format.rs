//! What a number format costs in accuracy.

use crate::StudyError;
use crate::engine::Objective;
use crate::model::formats::{Declared, Emulated, Fixed, Format, Half, Single};
use crate::model::gain::Gain;
use crate::reference::Difference;
use crate::render::image::Image;
use crate::timing::{Rounds, interleaved, seconds_of};
use crate::tradeoff::axis::{Rates, SceneAxis, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::{Bench, Evaluated};

/// Number formats.
pub(super) struct Formats;

impl SceneAxis for Formats {
    fn name(&self) -> &'static str {
        "format"
    }

    fn applies(&self, _: &Bench<'_>) -> Result<(), &'static str> {
        Ok(())
    }

    fn seconds(&self, _: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        // Five formats, four of them emulated by some three operations each; then f64 and f32 in turns.
        let timed = Rounds::default().expected(&[rates.images, rates.pass]);
        Ok((2.0 + 4.0 * 3.0) * rates.images + timed)
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let evaluated = bench.evaluate(bench.settings())?;
        let point = bench.point();
        let shader = evaluated.format_shader(&point)?;
        let exact = images_in(&evaluated, bench, |samples, camera, gain| {
            shader.shade(samples, camera, gain, 0.0_f64)
        });
        let in_format = |format: &str| -> Vec<Image> {
            images_in(&evaluated, bench, |samples, camera, gain| match format {
                Single::NAME => shader.shade(samples, camera, gain, Emulated::<Single>::new(0.0)),
                Half::NAME => shader.shade(samples, camera, gain, Emulated::<Half>::new(0.0)),
                Declared::NAME => shader.shade(samples, camera, gain, Emulated::<Declared>::new(0.0)),
                _ => shader.shade(samples, camera, gain, Emulated::<Fixed>::new(0.0)),
            })
        };
        let engine = evaluated.live_engine()?;
        let mut wide = || {
            Ok::<f64, StudyError>(seconds_of(|| {
                images_in(&evaluated, bench, |s, c, g| shader.shade(s, c, g, 0.0_f64))
            }))
        };
        let mut single = || Ok(seconds_of(|| engine.loss(&point)));
        let timed = interleaved(Rounds::default(), &mut [&mut wide, &mut single])?;
        let setting = |name: &str, bits: f64, images: &[Image]| Setting {
            name: name.to_owned(),
            choose: None,
            error: Difference::of_all(&exact, images),
            cost: bits,
            time: None,
            counts: Vec::new(),
            reference: false,
            present: false,
            pareto: false,
        };
        let mut settings = vec![
            setting(Fixed::NAME, 12.0, &in_format(Fixed::NAME)),
            // Half textures and normals, fixed light.
            setting(Declared::NAME, 14.0, &in_format(Declared::NAME)),
            setting(Half::NAME, 16.0, &in_format(Half::NAME)),
            Setting { time: Some(timed[1]), ..setting(Single::NAME, 32.0, &in_format(Single::NAME)) },
            Setting { time: Some(timed[0]), reference: true, ..setting("f64", 64.0, &exact) },
        ];
        mark_pareto(&mut settings);
        Ok(Sweep {
            axis: self.name(),
            title: "Number format",
            method: "Every operation rounded to the format; `as listed` rounds only what listing 3-4 declares half (textures, the normal) \
                     and fixed (light; 12 bits from -2 to 2), which is 14 bits on the whole. Formats below f32 are emulated, so they have \
                     no time; that of f64 is of the rules step by step, sixteen samples at a time, that of f32 of the engine's SIMD lanes, \
                     a pass over all views."
                .to_owned(),
            cost: "bits",
            settings,
            traces: Vec::new(),
        })
    }
}

/// Each view through `shade`.
pub(super) fn images_in(
    evaluated: &Evaluated,
    bench: &Bench<'_>,
    shade: impl Fn(&crate::samples::ViewSamples, &crate::scene::view::Camera, Gain) -> Image,
) -> Vec<Image> {
    let views = evaluated.samples.iter().zip(&evaluated.scene.views).zip(&bench.baked.gains);
    views.map(|((samples, view), &gain)| shade(samples, &view.camera, gain)).collect()
}

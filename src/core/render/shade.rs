//! From samples to images: the rules in f64, with an image for each term.

use fearless_simd::Level;
use rayon::prelude::*;

use super::image::Image;
use crate::bake::Illumination;
use crate::engine::cubes_at::{CubesAt, Sixteen};
use crate::engine::rules::{Loads, Registers, SampleSteps, Setting, sample_facts};
use crate::model::effects::{Effect, Effects};
use crate::model::evaluate::Setup;
use crate::model::gain::Gain;
use crate::model::params::{Param, Params};
use crate::model::terms::TermName;
use crate::program::shading::{ShadingError, TermShading};
use crate::program::steps::Rounding;
use crate::samples::{LANES, ViewSamples};
use crate::scene::view::Camera;
use crate::with_simd;

/// What the layer of what is not skin is called.
pub const PLAIN_LAYER: &str = "plain";

/// A view's image and what it is made of.
#[derive(Clone, Debug)]
pub struct Shaded {
    /// The whole, alpha being the coverage.
    pub image: Image,
    /// An image for each enabled term; with `plain` they add up to the whole.
    pub terms: Vec<(TermName, Image)>,
    /// What is not skin; `None` where nothing is seen of it.
    pub plain: Option<Image>,
    /// The haze of each pixel, premultiplied by its coverage and times the gain, as radiance is; empty unless an
    /// effect asks for it.
    pub haze: Vec<f32>,
    /// What of each pixel blooms: the mean over its samples of radiance times haze, premultiplied by coverage and
    /// times the gain, both once; empty unless the effect `bloom` is on.
    pub glow: Vec<[f32; 3]>,
}

/// The rules of a scene's terms with its light in f64, at one set of parameters.
#[derive(Debug)]
pub struct Shader {
    effects: Effects,
    params: Params,
    cubes: CubesAt<f64>,
    names: Vec<TermName>,
    /// Yields three numbers a term, then the haze.
    steps: SampleSteps,
    level: Level,
}

impl Shader {
    /// Of a scene's cubes, at `params`.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn new(setup: Setup, illumination: &Illumination, params: &Params) -> Result<Self, ShadingError> {
        let turned = params.scalar(Param::EnvironmentRotation) != 0.0;
        let TermShading { graph, terms, haze, levels } =
            TermShading::new(&sample_facts(setup, illumination, turned))?;
        let outputs: Vec<_> = terms.iter().flat_map(|(_, numbers)| *numbers).chain([haze]).collect();
        Ok(Self {
            effects: setup.effects,
            params: params.clone(),
            cubes: CubesAt::new(illumination, params, f64::from),
            names: terms.iter().map(|(name, _)| *name).collect(),
            steps: SampleSteps::new(&graph, &outputs, levels, |_| Rounding::Plain),
            level: Level::new(),
        })
    }

    /// The image of a view, times `gain`; what is computed in texels is black where the samples have none. All cores;
    /// the same for any number of threads.
    #[must_use]
    pub fn shade(&self, samples: &ViewSamples, camera: &Camera, gain: impl Into<Gain>) -> Shaded {
        let gain = gain.into();
        let (width, height) = (camera.width as usize, camera.height as usize);
        let plane = |wanted: bool| if wanted { width * height } else { 0 };
        let mut shaded = Shaded {
            image: Image::new(width, height),
            terms: self.names.iter().map(|&name| (name, Image::new(width, height))).collect(),
            plain: None,
            haze: vec![0.0; plane(self.effects.has_any(&[Effect::Haze, Effect::Bloom]))],
            glow: vec![[0.0; 3]; plane(self.effects.has(Effect::Bloom))],
        };
        let setting = self.steps.setting(&self.params, &self.cubes, 0.0);
        let loads = self.steps.loads(samples, &self.params, &self.cubes);
        let numbers = self.numbers(samples, gain, (&setting, &loads));
        let stride = self.stride();
        let slots = || (0..samples.groups() * LANES).filter(|&slot| samples.pixel[slot] != u32::MAX);
        let fill = |image: &mut Image, first: usize| {
            for slot in slots() {
                let at = samples.pixel[slot] as usize;
                image.rgb[at] = [0, 1, 2].map(|c| numbers[slot * stride + first + c]);
                image.alpha[at] = samples.coverage[slot];
            }
        };
        let whole = 3 * self.names.len();
        let Shaded { image, terms, haze, glow, .. } = &mut shaded;
        let images = terms.iter_mut().map(|(_, image)| image).chain([image]).enumerate();
        images.collect::<Vec<_>>().into_par_iter().for_each(|(k, image)| fill(image, 3 * k));
        for slot in slots() {
            let (at, own) = (samples.pixel[slot] as usize, &numbers[slot * stride + whole + 3..]);
            if let Some(haze) = haze.get_mut(at) {
                *haze = own[0];
            }
            if let Some(glow) = glow.get_mut(at) {
                *glow = [own[1], own[2], own[3]];
            }
        }
        if !samples.plain.is_empty() {
            let mut plain = Image::new(width, height);
            for part in &samples.plain {
                let at = part.pixel as usize;
                let rgb = [0, 1, 2].map(|c| (gain.channel(c) * f64::from(part.rgb[c])) as f32);
                (plain.rgb[at], plain.alpha[at]) = (rgb, part.share);
                (0..3).for_each(|c| shaded.image.rgb[at][c] += rgb[c]);
                shaded.image.alpha[at] += part.share;
            }
            shaded.plain = Some(plain);
        }
        shaded
    }

    /// How many numbers a pixel has: of each term, of the whole, the haze and the glow.
    const fn stride(&self) -> usize {
        3 * self.names.len() + 7
    }

    /// What each pixel slot shows, [`Self::stride`] numbers a slot. All cores.
    fn numbers(
        &self,
        samples: &ViewSamples,
        gain: Gain,
        (setting, loads): (&Setting<'_, f64>, &Loads),
    ) -> Vec<f32> {
        let stride = LANES * self.stride();
        let mut numbers = vec![0.0; samples.groups() * stride];
        numbers.par_chunks_mut(stride).enumerate().for_each_init(
            || (Registers::default(), vec![0.0; stride], Vec::new()),
            |(registers, sums, shown), (group, numbers)| {
                sums.fill(0.0);
                self.group(samples, group, gain, (setting, loads), (registers, sums, shown));
                numbers.iter_mut().zip(sums).for_each(|(number, sum)| *number = *sum as f32);
            },
        );
        numbers
    }

    /// The pixels of a group: means over their samples, premultiplied by their coverage, added to `sums`.
    fn group(
        &self,
        samples: &ViewSamples,
        group: usize,
        gain: Gain,
        (setting, loads): (&Setting<'_, f64>, &Loads),
        (registers, sums, shown): (&mut Registers<f64>, &mut [f64], &mut Vec<Sixteen<f64>>),
    ) {
        let whole = 3 * self.names.len();
        for record in samples.group_start[group] as usize..samples.group_start[group + 1] as usize {
            shown.clear();
            // The same numbers with any instructions: nothing is fused, and lanes do not meet.
            with_simd!(self.level, simd => {
                let _ = simd;
                shown.extend(self.steps.record(setting, loads, &samples.surface, record, registers));
            });
            for (lane, own) in sums.chunks_mut(self.stride()).enumerate() {
                let weight = f64::from(samples.surface.weight(record * LANES + lane));
                let share = weight * f64::from(samples.coverage[group * LANES + lane]);
                // Padding holds no numbers that could be relied on.
                if share == 0.0 {
                    continue;
                }
                let haze = share * shown[whole].0[lane];
                let shares = gain.0.map(|gain| share * gain);
                for (term, value) in own.chunks_mut(3).zip(shown.chunks_exact(3)) {
                    for c in 0..3 {
                        term[c] += shares[c] * value[c].0[lane];
                    }
                }
                for value in shown.chunks_exact(3) {
                    for c in 0..3 {
                        own[whole + 4 + c] += gain.0[c] * haze * value[c].0[lane];
                    }
                }
                own[whole + 3] += gain.channel(3) * haze;
            }
        }
        for own in sums.chunks_mut(self.stride()) {
            for c in 0..3 {
                own[whole + c] = own[..whole].iter().skip(c).step_by(3).sum();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::model::effects::{Form, Silhouette};
    use crate::samples::SurfaceRecords;
    use crate::samples::surface_records::{Asked, NEUTRAL};

    /// The first of sixteen pixels in a row, of one sample each, all alike.
    fn first(effects: &[Effect], set: impl Fn(&mut Params)) -> Shaded {
        let mut samples = ViewSamples {
            group_start: vec![0, 1],
            pixel: (0..LANES as u32).collect(),
            coverage: vec![1.0; LANES],
            surface: SurfaceRecords::new(Asked::EVERYTHING, 1),
            ..ViewSamples::default()
        };
        let facing =
            crate::model::fragment::Fragment { base: [0.0, 0.0, 1.0], view: [0.0, 0.0, -1.0], ..NEUTRAL };
        (0..LANES).for_each(|slot| samples.surface.set(slot, &facing, 1.0));
        let setup = Setup::new(Form::Corrected, Silhouette::Bumped, Effects::of(effects));
        let camera = Camera::pinhole(DMat4::IDENTITY, 1.0, [LANES as u32, 1]);
        let dark = Illumination::default();
        let mut params = Params::defaults(Form::Corrected);
        set(&mut params);
        Shader::new(setup, &dark, &params).unwrap().shade(&samples, &camera, 2.0)
    }

    #[test]
    fn effects_that_show_nothing_alone_make_a_black_image() {
        let shaded = first(&[Effect::NormalMap, Effect::Rim], |_| {});
        assert!(shaded.terms.is_empty() && shaded.haze.is_empty());
        assert_eq!((shaded.image.rgb[0], shaded.image.alpha[0]), ([0.0; 3], 1.0));
    }

    #[test]
    fn cubes_that_are_not_there_give_no_light() {
        let shaded = first(&[Effect::Diffuse, Effect::Reflection, Effect::Haze], |_| {});
        assert_eq!((shaded.image.rgb[0], shaded.haze[0]), ([0.0; 3], 0.0));
        assert_eq!(shaded.terms.len(), 2);
    }

    #[test]
    fn the_key_light_counts_by_the_bump_alone() {
        // The normal that is stored is the zero vector, so that N.L is 0 and n.L is the sine of the elevation's
        // complement: the light stands along n.
        let shaded = first(&[Effect::KeyLight], |params| {
            params.set(Param::KeyElevation, 0.0);
            params.set(Param::KeyAzimuth, 0.0);
            params.set(Param::KeyColor, 0.25);
        });
        assert_eq!(shaded.image.rgb[0], [0.5; 3]);
        assert_eq!(shaded.terms[0].1.rgb[0], [0.5; 3]);
    }
}

//! Samples to images: the model in f64, with an image for each term.

use rayon::prelude::*;

use super::image::Image;
use crate::bake::Illumination;
use crate::model::compose::TermName;
use crate::model::cube::Cube;
use crate::model::effects::Effect;
use crate::model::evaluate::{Setup, compose, shade};
use crate::model::fragment::Fragment;
use crate::model::lights::{Cubes, Lights};
use crate::model::params::{Param, Params};
use crate::model::real::Real;
use crate::samples::{LANES, ViewSamples};
use crate::scene::view::Camera;

/// A view's image and what it is made of.
#[derive(Clone, Debug)]
pub struct Shaded {
    /// The whole, alpha being the coverage.
    pub image: Image,
    /// An image for each enabled term; they add up to the whole.
    pub terms: Vec<(TermName, Image)>,
    /// The haze of each pixel, premultiplied by its coverage and times the gain, as radiance is; empty unless an
    /// effect asks for it.
    pub haze: Vec<f32>,
    /// What of each pixel blooms: the mean over its samples of radiance times haze, premultiplied by coverage and
    /// times the gain, both once; empty unless the effect `bloom` is on.
    pub glow: Vec<[f32; 3]>,
}

/// The light of a scene in f64, at the lobe of one set of parameters.
pub struct Shader {
    setup: Setup,
    params: Params,
    irradiance: Option<Cube<f64>>,
    specular: Option<Cube<f64>>,
    hilite: Option<Cube<f64>>,
}

impl Shader {
    /// Of a scene's cubes, at `params`.
    #[must_use]
    pub fn new(setup: Setup, illumination: &Illumination, params: &Params) -> Self {
        let wide = |cube: &Cube<f32>| cube.map(|texel| texel.map(f64::from));
        let lobe = |stack: &crate::bake::LobeStack| stack.at(params.scalar(Param::SpecularLobe)).0;
        Self {
            setup,
            params: params.clone(),
            irradiance: illumination.irradiance.as_ref().map(wide),
            specular: illumination.lobes.as_ref().map(lobe).as_ref().map(wide),
            hilite: illumination.hilite.as_ref().map(wide),
        }
    }

    /// The image of a view in another number format: what `like` is a number of. No terms, no haze.
    #[must_use]
    pub fn shade_in<R>(&self, samples: &ViewSamples, camera: &Camera, gain: f64, like: R) -> Image
    where
        R: Real<Texel = f64> + Into<f64> + Sync,
    {
        let mut image = Image::new(camera.width as usize, camera.height as usize);
        let groups: Vec<Vec<(usize, f32, [f64; 3])>> = (0..samples.groups())
            .into_par_iter()
            .map(|group| self.group_in(samples, group, gain, like))
            .collect();
        for (at, coverage, rgb) in groups.into_iter().flatten() {
            image.rgb[at] = rgb.map(|x| x as f32);
            image.alpha[at] = coverage;
        }
        image
    }

    /// The pixels of a group, each sample in another number format; their mean is exact.
    fn group_in<R>(
        &self,
        samples: &ViewSamples,
        group: usize,
        gain: f64,
        like: R,
    ) -> Vec<(usize, f32, [f64; 3])>
    where
        R: Real<Texel = f64> + Into<f64>,
    {
        let lights = Lights::new(self.setup, &self.params, self.cubes(), false, like);
        let records = samples.group_start[group] as usize..samples.group_start[group + 1] as usize;
        let mut pixels = Vec::new();
        for lane in 0..LANES {
            let slot = group * LANES + lane;
            if samples.pixel[slot] == u32::MAX {
                continue;
            }
            let coverage = samples.coverage[slot];
            let mut sum = [0.0; 3];
            for at in records.clone().map(|record| record * LANES + lane) {
                let share = f64::from(samples.surface.weight(at)) * f64::from(coverage) * gain;
                if share != 0.0 {
                    let fragment = wide(&samples.surface.fragment(at)).in_format(like);
                    let rgba = shade(self.setup, &lights, &fragment, &self.params);
                    (0..3).for_each(|c| sum[c] += share * rgba[c].into());
                }
            }
            pixels.push((samples.pixel[slot] as usize, coverage, sum));
        }
        pixels
    }

    fn cubes(&self) -> Cubes<'_, f64> {
        Cubes {
            irradiance: self.irradiance.as_ref(),
            specular: self.specular.as_ref(),
            lobe_slope: None,
            hilite: self.hilite.as_ref(),
        }
    }

    /// The image of a view, times `gain`. All cores; the same for any number of threads.
    #[must_use]
    pub fn shade(&self, samples: &ViewSamples, camera: &Camera, gain: f64) -> Shaded {
        let names = TermName::of(self.setup.effects);
        let (width, height) = (camera.width as usize, camera.height as usize);
        let mut shaded = Shaded {
            image: Image::new(width, height),
            terms: names.iter().map(|&name| (name, Image::new(width, height))).collect(),
            haze: vec![0.0; if self.hazy() { width * height } else { 0 }],
            glow: vec![[0.0; 3]; if self.setup.effects.has(Effect::Bloom) { width * height } else { 0 }],
        };
        let groups: Vec<Vec<Pixel>> =
            (0..samples.groups()).into_par_iter().map(|group| self.group(samples, group, gain)).collect();
        for pixel in groups.into_iter().flatten() {
            let at = pixel.index;
            for (name, (_, image)) in names.iter().zip(&mut shaded.terms) {
                let term = pixel.terms[name.index()];
                image.rgb[at] = term.map(|x| x as f32);
                image.alpha[at] = pixel.coverage;
            }
            shaded.image.rgb[at] =
                [0, 1, 2].map(|c| names.iter().map(|n| pixel.terms[n.index()][c]).sum::<f64>() as f32);
            shaded.image.alpha[at] = pixel.coverage;
            if let Some(haze) = shaded.haze.get_mut(at) {
                *haze = pixel.haze as f32;
            }
            if let Some(glow) = shaded.glow.get_mut(at) {
                *glow = pixel.glow.map(|x| x as f32);
            }
        }
        shaded
    }

    fn hazy(&self) -> bool {
        self.setup.effects.has_any(&[Effect::Haze, Effect::Bloom])
    }

    /// The pixels of a group: means over their samples, premultiplied by their coverage.
    fn group(&self, samples: &ViewSamples, group: usize, gain: f64) -> Vec<Pixel> {
        let lights = Lights::new(self.setup, &self.params, self.cubes(), false, 0.0_f64);
        let records = samples.group_start[group] as usize..samples.group_start[group + 1] as usize;
        let lane = |lane: usize| {
            let slot = group * LANES + lane;
            let index = samples.pixel[slot];
            if index == u32::MAX {
                return None;
            }
            let coverage = samples.coverage[slot];
            let mut pixel = Pixel {
                index: index as usize,
                coverage,
                terms: [[0.0; 3]; TermName::BUILT_IN.len()],
                haze: 0.0,
                glow: [0.0; 3],
            };
            for record in records.clone() {
                let at = record * LANES + lane;
                let share = f64::from(samples.surface.weight(at)) * f64::from(coverage) * gain;
                if share == 0.0 {
                    continue;
                }
                let composition =
                    compose(self.setup, &lights, &wide(&samples.surface.fragment(at)), &self.params);
                let haze = share * composition.alpha();
                for c in 0..3 {
                    for (name, value) in composition.each_term(c) {
                        pixel.terms[name.index()][c] += share * value;
                        pixel.glow[c] += haze * value;
                    }
                }
                pixel.haze += haze;
            }
            Some(pixel)
        };
        (0..LANES).filter_map(lane).collect()
    }
}

/// The planes of a view (for each pixel slot the mean over its samples, times the gain) as an image.
#[must_use]
pub fn image_of_planes(samples: &ViewSamples, planes: &[Vec<f32>], camera: &Camera) -> Image {
    let mut image = Image::new(camera.width as usize, camera.height as usize);
    for (slot, &pixel) in samples.pixel.iter().enumerate().filter(|(_, pixel)| **pixel != u32::MAX) {
        let (at, coverage) = (pixel as usize, samples.coverage[slot]);
        image.rgb[at] = [0, 1, 2].map(|c| coverage * planes[c][slot]);
        image.alpha[at] = coverage;
    }
    image
}

struct Pixel {
    index: usize,
    coverage: f32,
    terms: [[f64; 3]; TermName::BUILT_IN.len()],
    haze: f64,
    glow: [f64; 3],
}

fn wide(f: &Fragment<f32>) -> Fragment<f64> {
    let v = |x: [f32; 3]| x.map(f64::from);
    Fragment {
        base: v(f.base),
        bump: v(f.bump),
        normal: v(f.normal),
        view: v(f.view),
        occlusion: f.occlusion.into(),
        silhouette: f.silhouette.into(),
        dapple: f.dapple.into(),
        albedo: v(f.albedo),
        specular: f.specular.into(),
        attenuator: f.attenuator.into(),
    }
}

//! Images in other number formats: the rules with every operation rounded.

use rayon::prelude::*;

use super::image::Image;
use crate::bake::Illumination;
use crate::engine::cubes_at::CubesAt;
use crate::engine::rules::{Loads, Registers, SampleSteps, Setting, sample_facts};
use crate::model::effects::Form;
use crate::model::evaluate::Setup;
use crate::model::gain::Gain;
use crate::model::params::{Param, Params};
use crate::model::real::Real;
use crate::program::graph::{Binary, Id};
use crate::program::lower::Natives;
use crate::program::shading::{Shading, ShadingError};
use crate::program::steps::Rounding;
use crate::samples::{LANES, ViewSamples};
use crate::scene::view::Camera;

/// What listing 3-4 declares `half` (textures, the normal) and `fixed` (all that is light), by the rules' names.
const DECLARED: [(&str, Rounding); 14] = [
    ("albedo", Rounding::Half),
    ("specular", Rounding::Half),
    ("n", Rounding::Half),
    ("attenuator", Rounding::Fixed),
    ("reflected", Rounding::Fixed),
    ("diffuse_term", Rounding::Fixed),
    ("side_term", Rounding::Fixed),
    ("mirror_term", Rounding::Fixed),
    ("reflection", Rounding::Fixed),
    ("hilite_part", Rounding::Fixed),
    ("mirror_part", Rounding::Fixed),
    ("key_part", Rounding::Fixed),
    ("haze_term", Rounding::Fixed),
    ("haze", Rounding::Fixed),
];

/// The rules of a scene with its light, at one set of parameters, in any number format.
#[derive(Debug)]
pub struct FormatShader {
    params: Params,
    cubes: CubesAt<f64>,
    steps: SampleSteps,
}

impl FormatShader {
    /// Of a scene's cubes, at `params`.
    ///
    /// # Errors
    /// When no rules yield what the effects call for, or one of them cannot be computed on the processor.
    pub fn new(setup: Setup, illumination: &Illumination, params: &Params) -> Result<Self, ShadingError> {
        let turned = params.scalar(Param::EnvironmentRotation) != 0.0;
        let mut shading =
            Shading::new(&sample_facts(setup, illumination, turned), &[], |_| None, Natives::Written)?;
        let declared = declared(&mut shading, setup.form);
        let addresses = shading.addresses();
        let rounding = |id: Id| match declared.iter().find(|(declared, _)| *declared == id) {
            _ if addresses.contains(&id) => Rounding::Address,
            Some((_, rounding)) => *rounding,
            None => Rounding::Plain,
        };
        Ok(Self {
            params: params.clone(),
            cubes: CubesAt::new(illumination, params, f64::from),
            steps: SampleSteps::new(&shading.graph, &shading.value, shading.levels, rounding),
        })
    }

    /// The image of a view in numbers of `like`'s kind, times `gain`; means over a pixel's samples are exact.
    #[must_use]
    pub fn shade<R>(&self, samples: &ViewSamples, camera: &Camera, gain: Gain, like: R) -> Image
    where
        R: Real<Texel = f64> + Into<f64> + Send + Sync,
        R::Wide: Send + Sync,
    {
        let mut image = Image::new(camera.width as usize, camera.height as usize);
        for (slot, sum) in self.pixels(samples, like).into_iter().enumerate() {
            let (at, coverage) = (samples.pixel[slot] as usize, samples.coverage[slot]);
            if samples.pixel[slot] != u32::MAX {
                image.rgb[at] = [0, 1, 2].map(|c| (f64::from(coverage) * gain.0[c] * sum[c]) as f32);
                image.alpha[at] = coverage;
            }
        }
        image
    }

    /// Colour and haze of each pixel slot in numbers of `like`'s kind: means over its samples.
    #[must_use]
    pub fn pixels<R>(&self, samples: &ViewSamples, like: R) -> Vec<[f64; 4]>
    where
        R: Real<Texel = f64> + Into<f64> + Send + Sync,
        R::Wide: Send + Sync,
    {
        let setting = self.steps.setting(&self.params, &self.cubes, like);
        let loads = self.steps.loads(samples, &self.params, &self.cubes);
        let groups: Vec<[[f64; 4]; LANES]> = (0..samples.groups())
            .into_par_iter()
            .map_init(Registers::default, |registers, group| {
                self.group(samples, group, (&setting, &loads), registers)
            })
            .collect();
        groups.concat()
    }

    /// The pixels of a group: means over their samples.
    fn group<R: Real<Texel = f64> + Into<f64>>(
        &self,
        samples: &ViewSamples,
        group: usize,
        (setting, loads): (&Setting<'_, R>, &Loads),
        registers: &mut Registers<R>,
    ) -> [[f64; 4]; LANES] {
        let mut pixels = [[0.0; 4]; LANES];
        for record in samples.group_start[group] as usize..samples.group_start[group + 1] as usize {
            let numbers = self.steps.record(setting, loads, &samples.surface, record, registers);
            for (c, channel) in numbers.enumerate() {
                for (lane, pixel) in pixels.iter_mut().enumerate() {
                    let share = f64::from(samples.surface.weight(record * LANES + lane));
                    // Padding holds no numbers that could be relied on.
                    if share != 0.0 {
                        pixel[c] += share * channel.0[lane].into();
                    }
                }
            }
        }
        pixels
    }
}

/// The numbers that the listing declares, and how.
fn declared(shading: &mut Shading, form: Form) -> Vec<(Id, Rounding)> {
    let mut declared = Vec::new();
    for (name, rounding) in DECLARED {
        let numbers = match shading.quantities.get(name) {
            Some(numbers) => numbers.clone(),
            None if Param::from_identifier(name).is_some() => {
                (0..3).map(|c| shading.graph.uniform(name, c)).collect()
            }
            None => continue,
        };
        declared.extend(numbers.into_iter().map(|id| (id, rounding)));
    }
    let of = |name: &str| shading.quantities.get(name).cloned();
    let (n, view, dapple, mirror) = (of("n"), of("view"), of("dapple"), of("mirror_light"));
    if let (Some(n), Form::Listing) = (&n, form) {
        // Its 2, too, is a `fixed`, which ends a step below; here it is whole, as cubes' faces are numbered by it.
        let two = shading.graph.constant(2.0);
        declared.extend(n.iter().map(|&n| (shading.graph.binary(Binary::Multiply, two, n), Rounding::Half)));
    }
    // n.V, and what of the mirror's alpha is left of the dapple.
    if let (Some(n), Some(view)) = (n, view) {
        let products: Vec<Id> =
            n.iter().zip(view).map(|(&a, b)| shading.graph.binary(Binary::Multiply, a, b)).collect();
        let across = shading.graph.binary(Binary::Add, products[0], products[1]);
        declared.push((shading.graph.binary(Binary::Add, across, products[2]), Rounding::Fixed));
    }
    if let (Some(dapple), Some(mirror)) = (dapple, mirror) {
        let dappled = shading.graph.binary(Binary::Multiply, dapple[0], mirror[3]);
        declared.push((dappled, Rounding::Fixed));
    }
    // Every sum of parts, and what is one part alone.
    let sums = shading.sums();
    declared.extend(sums.into_iter().chain(shading.value).map(|id| (id, Rounding::Fixed)));
    declared
}

//! A small network that looks at an image of 8 x 8 pixels and tells the constants of the shader that made it, trained
//! through the shader: `cargo run --release --features burn --example network`; see README.md beside this file.
//!
//! The network never sees the constants. Its loss is the difference between the image it was given and the image of
//! the constants that it tells, and the slope of that comes back through the shading operation.

use std::error::Error;

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::optim::{AdamConfig, GradientsParams};
use burn::tensor::activation::{relu, sigmoid};
use burn::tensor::{Device, Tensor, TensorData};
use clap::Parser;
use glam::DVec3;
use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use skinfit::bake::{Illumination, LobeStack};
use skinfit::gpu::Choice;
use skinfit::model::cube::{Cube, texel_direction};
use skinfit::model::effects::{Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::Fragment;
use skinfit::model::params::{Column, Param, Params};
use skinfit::samples::surface_records::{Asked, NEUTRAL};
use skinfit::samples::{LANES, SurfaceRecords, ViewSamples};
use skinfit::tensor::sparse::Entries;
use skinfit::tensor::{Inputs, Scatter, Shade, Shaded, SharedDevice, Sparse};

/// Pixels along a side of the images that are compared, and of those that the network sees.
const SIZE: usize = 64;
const SEEN: usize = 8;
/// What the network tells, with the range that it is drawn from.
const TOLD: [(Param, f64, f64); 5] = [
    (Param::BaseWeight, 0.2, 1.5),
    (Param::RimWeight, 0.0, 1.5),
    (Param::RimExponent, 1.0, 5.0),
    (Param::SideSpecular, 0.0, 1.5),
    (Param::Hilite, 0.0, 1.5),
];

#[derive(Parser)]
struct Arguments {
    /// Steps of training.
    #[arg(long, default_value_t = 300)]
    steps: usize,
    /// Images a step.
    #[arg(long, default_value_t = 8)]
    batch: usize,
    /// Images that are held out.
    #[arg(long, default_value_t = 32)]
    held_out: usize,
    /// The loss on images that were held out must fall by this factor, or the run fails.
    #[arg(long, default_value_t = 20.0)]
    factor: f64,
    /// What images, and the network's start, are drawn from.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Two layers; the answer lies within the constants' ranges.
#[derive(Module, Debug)]
struct Network {
    first: Linear,
    second: Linear,
}

impl Network {
    fn new(device: &Device) -> Self {
        Self {
            first: LinearConfig::new(3 * SEEN * SEEN, 64).init(device),
            second: LinearConfig::new(64, TOLD.len()).init(device),
        }
    }

    /// From images that it sees, \[images, 3 SEEN^2\], to constants, \[images, told\].
    fn tell(&self, seen: Tensor<2>) -> Tensor<2> {
        let hidden = relu(self.first.forward(seen));
        let share = sigmoid(self.second.forward(hidden));
        let row = |numbers: Vec<f64>, like: &Tensor<2>| {
            let data =
                TensorData::new(numbers.iter().map(|&x| x as f32).collect::<Vec<_>>(), [1, TOLD.len()]);
            let row = Tensor::<2>::from_data(data, &like.device().inner());
            if like.is_autodiff() { row.autodiff() } else { row }
        };
        let lower = row(TOLD.map(|(_, lower, _)| lower).to_vec(), &share);
        let range = row(TOLD.map(|(_, lower, upper)| upper - lower).to_vec(), &share);
        share * range + lower
    }
}

/// The shader, and how its images are made small.
struct Scene {
    shade: Shade,
    inputs: Inputs,
    small: Sparse,
    /// Mean and spread of what the network sees, each \[1, 3 SEEN^2\].
    usual: Option<(Tensor<2>, Tensor<2>)>,
}

impl Scene {
    fn new(shared: &SharedDevice) -> Result<Self, Box<dyn Error>> {
        let (samples, illumination) = (sphere(), light());
        let params = Params::defaults(Form::Corrected);
        let columns = TOLD.map(|(param, ..)| Column::tied(param));
        let setup = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::SURFACE);
        let shaded = Shaded { setup, params: &params, columns: &columns, illumination: &illumination };
        let (shade, inputs) = Shade::new(shared, &shaded, &[&samples], Scatter::Exact)?;
        Ok(Self { shade, inputs, small: Sparse::new(shared, &shrinking(&samples))?, usual: None })
    }

    /// The image of one row of constants: \[slots, 4\].
    fn image(&self, constants: Tensor<2>) -> Result<Tensor<2>, Box<dyn Error>> {
        let columns = constants.reshape([TOLD.len()]);
        Ok(self.shade.image(Inputs { columns, ..self.inputs.clone() })?)
    }

    /// What the network sees of some images: \[images, 3 SEEN^2\].
    fn seen(&self, images: &[Tensor<2>]) -> Result<Tensor<2>, Box<dyn Error>> {
        let small = |image: &Tensor<2>| {
            let all = self.small.apply(image.clone())?;
            Ok(all.slice([0..SEEN * SEEN, 0..3]).reshape([1, 3 * SEEN * SEEN]))
        };
        // Highlights are ten times as bright as the rest; what matters of them is their share.
        let seen =
            Tensor::cat(images.iter().map(small).collect::<Result<Vec<_>, Box<dyn Error>>>()?, 0).log1p();
        Ok(match &self.usual {
            Some((mean, spread)) => (seen - mean.clone()) / spread.clone(),
            None => seen,
        })
    }

    /// How far the images of what the network tells are from those that it was given: the mean squared difference.
    fn loss(
        &self,
        network: &Network,
        images: &[Tensor<2>],
        tracked: bool,
    ) -> Result<Tensor<1>, Box<dyn Error>> {
        let lift = |tensor: Tensor<2>| if tracked { tensor.autodiff() } else { tensor };
        let told = network.tell(lift(self.seen(images)?));
        let mut sum: Option<Tensor<1>> = None;
        for (i, image) in images.iter().enumerate() {
            let again = self.image(told.clone().slice([i..i + 1, 0..TOLD.len()]))?;
            let difference = (again - lift(image.clone())).square().mean();
            sum = Some(match sum {
                Some(sum) => sum + difference,
                None => difference,
            });
        }
        let sum = sum.ok_or("no images")?;
        Ok(sum / images.len() as f64)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let shared = SharedDevice::open(&Choice::default())?;
    let device = shared.device();
    device.seed(arguments.seed);
    let mut scene = Scene::new(&shared)?;
    let mut random = StdRng::seed_from_u64(arguments.seed);
    let mut draw = |scene: &Scene, count: usize| -> Result<Vec<Tensor<2>>, Box<dyn Error>> {
        (0..count)
            .map(|_| {
                let constants = TOLD.map(|(_, lower, upper)| random.random_range(lower..upper) as f32);
                let row = TensorData::new(constants.to_vec(), [1, TOLD.len()]);
                scene.image(Tensor::from_data(row, device))
            })
            .collect()
    };
    let seen = scene.seen(&draw(&scene, 64)?)?;
    let mean = seen.clone().mean_dim(0);
    let spread = (seen - mean.clone()).square().mean_dim(0).sqrt() + 1e-3;
    scene.usual = Some((mean, spread));
    let held_out = draw(&scene, arguments.held_out.max(1))?;
    let measure = |network: &Network| -> Result<f64, Box<dyn Error>> {
        let loss = scene.loss(&network.clone().valid(), &held_out, false)?;
        Ok(f64::from(loss.try_into_scalar::<f32>().map_err(|e| e.to_string())?))
    };
    let mut network = Network::new(&device.clone().autodiff());
    let mut optimiser = AdamConfig::new().init();
    let first = measure(&network)?;
    println!(
        "{} on {}: loss on {} held-out images {first:.3e}",
        scene.shade.slots(),
        shared.gpu().name(),
        held_out.len()
    );
    for step in 1..=arguments.steps {
        let images = draw(&scene, arguments.batch.max(1))?;
        let gradients = scene.loss(&network, &images, true)?.backward();
        let gradients = GradientsParams::from_grads(gradients, &network);
        // From long steps to short ones.
        let rate = 1e-2 * 0.05_f64.powf(step as f64 / arguments.steps as f64);
        network = optimiser.step(rate, network, gradients);
        if step % 50 == 0 {
            println!("step {step:>5}: {:.3e}", measure(&network)?);
        }
    }
    let last = measure(&network)?;
    println!("held-out loss {first:.3e} -> {last:.3e}: {:.0} times less", first / last);
    if last.is_finite() && first / last >= arguments.factor {
        return Ok(());
    }
    Err(format!("the network did not learn: its loss should fall {} times", arguments.factor).into())
}

/// A sphere that fills the image, with waves for maps: a sample a pixel.
fn sphere() -> ViewSamples {
    let asked = Asked { normal: false, ..Asked::EVERYTHING };
    let groups = SIZE * SIZE / LANES;
    let mut samples = ViewSamples {
        group_start: (0..=groups as u32).collect(),
        pixel: (0..(SIZE * SIZE) as u32).collect(),
        coverage: vec![1.0; SIZE * SIZE],
        surface: SurfaceRecords::new(asked, groups),
        ..ViewSamples::default()
    };
    for slot in 0..SIZE * SIZE {
        let at = |i: usize| 2.0 * (i as f64 + 0.5) / SIZE as f64 - 1.0;
        let (x, y) = (at(slot % SIZE), -at(slot / SIZE));
        let inside = x * x + y * y < 1.0;
        let n = DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()).normalize();
        let wave = |k: f64| (0.5 + 0.4 * (k * x + 1.7 * k * y).sin()) as f32;
        let fragment = Fragment {
            base: n.as_vec3().to_array(),
            bump: [0.1 * (wave(9.0) - 0.5), 0.1 * (wave(7.0) - 0.5), 0.0],
            view: [0.0, 0.0, -1.0],
            occlusion: 0.6 + 0.4 * wave(2.0),
            silhouette: (1.0 - n.z) as f32,
            dapple: n.z as f32,
            albedo: [0.8, 0.55 + 0.2 * wave(5.0), 0.45],
            specular: wave(4.0),
            attenuator: wave(3.0),
            ..NEUTRAL
        };
        samples.surface.set(slot, &fragment, if inside { 1.0 } else { 0.0 });
    }
    samples
}

/// Sky above, ground below, and a sun that the sharper cubes see smaller.
fn light() -> Illumination {
    let sun = DVec3::new(0.5, 0.6, 0.6).normalize();
    let cube = |size: usize, sharpness: f64| {
        Cube::from_fn(size, |face, column, row| {
            let d = DVec3::from(texel_direction(face, column, row, size));
            let glow = sharpness * d.dot(sun).max(0.0).powf(sharpness);
            let sky = 0.5 + 0.4 * d.y;
            [sky * 0.7 + glow, sky * 0.9 + 0.9 * glow, sky + 0.7 * glow, sky].map(|x| x as f32)
        })
    };
    Illumination {
        irradiance: Some(cube(16, 1.0)),
        lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![cube(32, 8.0)] }),
        hilite: Some(cube(32, 4.0)),
        reflected: None,
    }
}

/// From pixel slots to the means of squares of them.
fn shrinking(samples: &ViewSamples) -> Entries {
    let mut entries = Entries::new(samples.pixel.len());
    let side = SIZE / SEEN;
    for square in 0..SEEN * SEEN {
        let (left, top) = (square % SEEN * side, square / SEEN * side);
        let pixels = (0..side * side).map(|i| (top + i / side) * SIZE + left + i % side);
        entries.push_row(pixels.map(|pixel| (pixel as u32, 1.0 / (side * side) as f32)));
    }
    entries
}

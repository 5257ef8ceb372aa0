//! Gradients of an image on burn's tensors: `cargo run --release --features burn --example library_gradients`.
//!
//! The loss is the mean square of the built-in scene's images. Its slope by the constants and by the albedo of every
//! sample comes from one backward pass; the constants' slopes are checked against differences of the loss.

use std::error::Error;

use burn::tensor::{Tensor, TensorData};
use skinfit::gpu::Choice;
use skinfit::model::params::Column;
use skinfit::prepare::Sampled;
use skinfit::tensor::{Inputs, Scatter, Shade, Shaded, SharedDevice};
use skinfit::{Param, PrepareOptions, built_in_scene};

/// The free constants, and how far apart the loss is taken for a difference: the loss is a sum of f32, good to some
/// 1e-6 of itself, and the differences of what is linear or square in a constant have no other error.
const FREE: [Param; 3] = [Param::BaseWeight, Param::SideSpecular, Param::Hilite];
const STEP: f32 = 0.05;
/// Of the largest slope: roundings of the loss over twice the step.
const TOLERANCE: f32 = 1e-3;

fn main() -> Result<(), Box<dyn Error>> {
    let cache = std::env::temp_dir().join("skinfit-library");
    let scene = built_in_scene(&cache)?;
    let options = PrepareOptions { cache: Some(cache), ..PrepareOptions::default() };
    let sampled = Sampled::new(&scene, &options)?;

    let shared = SharedDevice::open(&Choice::default())?;
    let columns = FREE.map(Column::tied);
    let shaded = Shaded {
        setup: sampled.setup(),
        params: &sampled.scene.params,
        columns: &columns,
        illumination: &sampled.illumination,
    };
    let views: Vec<_> = sampled.samples.iter().collect();
    let (shade, inputs) = Shade::new(&shared, &shaded, &views, Scatter::Exact)?;

    // One backward pass: the slopes by three constants and by each sample's albedo.
    let constants = inputs.columns.clone().autodiff().require_grad();
    let albedo = inputs.albedo.clone().autodiff().require_grad();
    let tracked = Inputs { columns: constants.clone(), albedo: albedo.clone(), ..inputs.clone() };
    let gradients = mean_square(image(&shade, tracked)?).backward();
    let slopes = numbers(constants.grad(&gradients).ok_or("the loss does not depend on the constants")?)?;
    let of_albedo = albedo.grad(&gradients).ok_or("the loss does not depend on the albedo")?;
    println!(
        "{}: {} samples, gradient by their albedo {:?}",
        shared.gpu().name(),
        shade.samples(),
        of_albedo.dims()
    );

    let start = numbers(inputs.columns.clone())?;
    let loss = |at: Vec<f32>| -> Result<f32, Box<dyn Error>> {
        let columns = Tensor::<1>::from_data(TensorData::new(at, [FREE.len()]), shared.device());
        let image = image(&shade, Inputs { columns, ..inputs.clone() })?;
        Ok(mean_square(image).try_into_scalar::<f32>().map_err(|error| error.to_string())?)
    };
    let largest = slopes.iter().fold(0.0_f32, |most, slope| most.max(slope.abs()));
    for (i, param) in FREE.iter().enumerate() {
        let moved =
            |by: f32| start.iter().enumerate().map(|(j, x)| if i == j { x + by } else { *x }).collect();
        let difference = (loss(moved(STEP))? - loss(moved(-STEP))?) / (2.0 * STEP);
        println!("{:<14} slope {:.6}, by differences {difference:.6}", param.name(), slopes[i]);
        if (slopes[i] - difference).abs() > TOLERANCE * largest {
            return Err(format!("{}: the slope is wrong", param.name()).into());
        }
    }
    Ok(())
}

/// The image, with light that stands in the UV atlas where a scene has such effects: it is made of the same constants.
fn image(shade: &Shade, mut inputs: Inputs) -> Result<Tensor<2>, Box<dyn Error>> {
    if let Some((levels, texels)) = shade.levels() {
        inputs.levels = levels.make(Inputs { columns: inputs.columns.clone(), ..texels.clone() })?;
    }
    Ok(shade.image(inputs)?)
}

/// The sum over the count: burn's `mean` leaves out what is beyond some 262,000 numbers on adapters that allow 65,535
/// workgroups (0.22.1), its `sum` does not.
fn mean_square(image: Tensor<2>) -> Tensor<1> {
    let numbers = image.dims().iter().product::<usize>() as f32;
    image.square().sum() / numbers
}

/// A tensor's numbers on the host.
fn numbers(tensor: Tensor<1>) -> Result<Vec<f32>, Box<dyn Error>> {
    Ok(tensor.into_data().try_to_vec::<f32>().map_err(|error| format!("{error:?}"))?)
}

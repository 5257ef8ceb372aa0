//! The sums and their Jacobian on the engine of the processor, on that of an adapter, and on burn's tensors.
//!
//! Engines add residuals up: a view is made of each fragment and channel, whose target is 1 below in that channel and the
//! image in the others, so that with all other views' gains at 0 the gradient is a row of the Jacobian.

use skinfit::model::gain::Gain;
use std::sync::Arc;

use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::{Objective, Point, Task, Unknown};
use skinfit::gpu::Gpu;
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Column, Param};
use skinfit::scene::Loss;

use super::file::Composed;
use super::lacking::Lacking;
use super::stored::observed;
use super::terms::{DIFFUSION, PLAIN_SET, Set, of_slopes};
use crate::graphics::bench::gpu;
use crate::vectors::reader::{Tolerance, Vectors};

/// Radiance and haze of each fragment, and how they move with each column.
pub(super) struct Found {
    image: Vec<[f64; 4]>,
    /// By fragment and column; what is not free there is `None`.
    jacobian: Vec<Vec<Option<[f64; 4]>>>,
}

/// Which engine.
#[derive(Clone, Copy)]
enum On {
    Processor,
    Adapter(&'static Gpu),
}

impl On {
    fn name(self) -> &'static str {
        match self {
            Self::Processor => "cpu",
            Self::Adapter(_) => "gpu",
        }
    }

    fn image(self, task: Task, point: &Point) -> Vec<Vec<f32>> {
        match self {
            Self::Processor => CpuEngine::new(task).unwrap().image(0, point),
            Self::Adapter(gpu) => {
                GpuEngine::new(gpu, task, point, Memory::default()).unwrap().image(0, point).unwrap()
            }
        }
    }

    fn engine(self, task: Task, point: &Point) -> Box<dyn Objective> {
        match self {
            Self::Processor => Box::new(CpuEngine::new(task).unwrap()),
            Self::Adapter(gpu) => Box::new(GpuEngine::new(gpu, task, point, Memory::default()).unwrap()),
        }
    }

    fn found(self, own: &Composed<'_>, setup: Setup, columns: &[Param]) -> Found {
        let task = |views: Vec<_>, unknowns| Task {
            setup,
            illumination: Arc::new(own.illumination()),
            views: views.into(),
            loss: Loss::L2,
            unknowns,
        };
        let point = |gains: Vec<Gain>| Point { params: own.params.clone(), gains };
        let (count, samples) = (own.count(), own.samples(setup));
        let seen = observed(&samples, &vec![[0.0; 4]; count], 0..count);
        let planes = self.image(task(vec![seen], Vec::new()), &point(vec![Gain::ONE]));
        let image: Vec<[f64; 4]> =
            (0..count).map(|i| std::array::from_fn(|c| f64::from(planes[c][i]))).collect();
        let view = |i: usize, c: usize| {
            let mut targets = image.clone();
            targets[i][c] -= 1.0;
            observed(&samples, &targets, i..i + 1)
        };
        let views: Vec<_> = (0..count).flat_map(|i| (0..4).map(move |c| (i, c))).collect();
        let views: Vec<_> = views.into_iter().map(|(i, c)| view(i, c)).collect();
        let free: Vec<Param> =
            columns.iter().copied().filter(|param| param.asked_for(setup.effects)).collect();
        let unknowns = free.iter().map(|&param| Unknown::Param(Column::tied(param))).collect();
        let mut jacobian = vec![vec![None; columns.len()]; count];
        let count = views.len();
        let start = point(vec![Gain::ONE; count]);
        let engine = self.engine(task(views, unknowns), &start);
        let weight = engine.normal_equations(&start).weight;
        for view in 0..count {
            let gains = (0..count).map(|other| f64::from(u8::from(other == view)).into()).collect();
            let (_, gradient) = engine.gradient(&point(gains));
            for (param, slope) in free.iter().zip(gradient) {
                let k = columns.iter().position(|column| column == param).unwrap();
                let row: &mut [f64; 4] = jacobian[view / 4][k].get_or_insert([0.0; 4]);
                // Of the mean of squares.
                row[view % 4] = 0.5 * weight * slope;
            }
        }
        Found { image, jacobian }
    }
}

/// The oracle's numbers of a set.
fn check(own: &Composed<'_>, (set, lacking): (&Set, &Lacking), what: &str, near: Tolerance, found: &Found) {
    let expected = own.root.at("expected").at(set.name);
    let columns = own.columns();
    let of_slopes = of_slopes(near, !set.added.is_empty());
    for i in 0..own.count() {
        let name = |number: &str| format!("{what}: {number}");
        let result = [0, 1, 2].map(|c| found.image[i][c] + lacking.value[i][c]);
        near.check(&name("result"), &result, &expected.at("result").item(i));
        near.check(&name("haze"), &found.image[i][3..], &expected.at("haze").item(i));
        for (k, column) in columns.iter().enumerate() {
            // What is not asked for moves nothing but what the rules lack.
            let asked = column.asked_for(own.setup(set.choices, set.added).effects);
            let slopes = match found.jacobian[i][k] {
                Some(slopes) => slopes,
                None if asked => continue,
                None => [0.0; 4],
            };
            for (c, slope) in slopes.into_iter().enumerate() {
                let rest = if c < 3 { lacking.slopes[k][i][c] } else { 0.0 };
                let want = expected.at("J").item(i).item(c).item(k);
                of_slopes.check(&name(column.name()), &[slope + rest], &want);
            }
        }
    }
}

pub(super) fn compare(vectors: &Vectors) {
    let own = Composed::new(vectors);
    let columns = own.columns();
    let lacking = Lacking::lobe(&own, &columns);
    let near = own.root.vector.tolerances().single;
    let engines = [Some(On::Processor), gpu().map(On::Adapter)];
    for set in [&PLAIN_SET, &DIFFUSION] {
        let setup = own.setup(set.choices, set.added);
        for on in engines.into_iter().flatten() {
            let found = on.found(&own, setup, &columns);
            assert!(found.jacobian.iter().flatten().filter(|slopes| slopes.is_some()).count() > 12 * 20);
            // WGSL asks of exp2, log2, division and square roots a few units in the last place, where a processor rounds
            // correctly: four times what the file gives for f32.
            let near = if matches!(on, On::Adapter(_)) { near.times(4.0) } else { near };
            check(&own, (set, &lacking), on.name(), near, &found);
        }
    }
    #[cfg(feature = "burn")]
    if let Some(shared) = crate::tensors::bench::shared() {
        for set in [&PLAIN_SET, &DIFFUSION] {
            let found = tensors::found(shared, &own, set, &columns);
            check(&own, (set, &lacking), "burn", near.times(4.0), &found);
        }
    }
}

#[cfg(feature = "burn")]
mod tensors {
    use burn::tensor::{Tensor, TensorData};
    use skinfit::bake::stacks::Stack;
    use skinfit::samples::LANES;
    use skinfit::tensor::{Inputs, Scatter, Shade, Shaded, SharedDevice};

    use super::*;

    fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f64> {
        tensor.into_data().try_to_vec::<f32>().unwrap().into_iter().map(f64::from).collect()
    }

    /// The operation over all fragments.
    fn operation(
        shared: &SharedDevice,
        own: &Composed<'_>,
        set: &Set,
        columns: &[Column],
    ) -> (Shade, Inputs) {
        let setup = own.setup(set.choices, set.added);
        let samples = own.samples(setup);
        let illumination = own.illumination();
        let shaded = Shaded { setup, params: &own.params, columns, illumination: &illumination };
        Shade::new(shared, &shaded, &[&samples], Scatter::Exact).unwrap()
    }

    /// Each channel of a colour is a column, and moves no other channel. What acts through a cube alone cannot be one.
    pub(super) fn found(shared: &SharedDevice, own: &Composed<'_>, set: &Set, params: &[Param]) -> Found {
        let setup = own.setup(set.choices, set.added);
        let free = |param: &Param| param.asked_for(setup.effects) && *param != Param::SpecularLobe;
        let of = |(k, &param): (usize, &Param)| {
            let columns = match param.info().rgb {
                true => Column::per_channel(param).to_vec(),
                false => vec![Column::tied(param)],
            };
            columns.into_iter().enumerate().map(move |(channel, column)| (k, channel, column))
        };
        let columns: Vec<(usize, usize, Column)> =
            params.iter().enumerate().filter(|(_, param)| free(param)).flat_map(of).collect();
        let held: Vec<Column> = columns.iter().map(|(.., column)| *column).collect();
        let (shade, inputs) = operation(shared, own, set, &held);
        let image = numbers(shade.image(inputs.clone()).unwrap());
        let image = image.as_chunks::<4>().0[..own.count()].to_vec();
        let mut jacobian = vec![vec![None; params.len()]; own.count()];
        for pixel in 0..own.count() {
            for c in 0..4 {
                let slopes = row((shared, own), (&shade, &inputs), &held, 4 * pixel + c);
                for ((k, channel, column), slope) in columns.iter().zip(slopes) {
                    let row: &mut [f64; 4] = jacobian[pixel][*k].get_or_insert([0.0; 4]);
                    if column.param.info().rgb && c < 3 && *channel != c {
                        assert_eq!(
                            slope,
                            0.0,
                            "channel {channel} of {} moves channel {c}",
                            column.param.name()
                        );
                    } else {
                        row[c] += slope;
                    }
                }
            }
        }
        Found { image, jacobian }
    }

    /// How one number of the image moves with each column: by itself, and by the cubes that it chooses.
    fn row(
        (shared, own): (&SharedDevice, &Composed<'_>),
        (shade, inputs): (&Shade, &Inputs),
        held: &[Column],
        at: usize,
    ) -> Vec<f64> {
        let mut weights = vec![0.0_f32; 4 * LANES];
        weights[at] = 1.0;
        let weights = Tensor::<2>::from_data(TensorData::new(weights, [LANES, 4]), shared.device());
        let free = inputs.columns.clone().autodiff().require_grad();
        let [reflected, glossy] =
            [&inputs.reflected, &inputs.glossy].map(|cube| cube.clone().autodiff().require_grad());
        let (of_black, of_white) = (reflected.clone(), glossy.clone());
        let mut tracked = Inputs { columns: free.clone(), reflected, glossy, ..inputs.clone() };
        if let Some((levels, start)) = shade.levels() {
            tracked.levels = levels.make(Inputs { columns: free.clone(), ..start.clone() }).unwrap();
        }
        let gradients = (shade.image(tracked).unwrap() * weights.autodiff()).sum().backward();
        let mut slopes = numbers(free.grad(&gradients).unwrap());
        let illumination = own.illumination();
        for (stack, cube) in [(Stack::Reflected, of_black), (Stack::Glossy, of_white)] {
            let moved = stack.at(&illumination, stack.place(&own.params));
            let (Some((_, slope)), Some(gained)) = (moved, cube.grad(&gradients)) else { continue };
            let pairs = numbers(gained).into_iter().zip(slope.padded().as_flattened());
            let by_place: f64 = pairs.map(|(gained, &slope)| gained * f64::from(slope)).sum();
            for (name, pace) in stack.paces(&own.params) {
                let columns = held.iter().zip(&mut slopes).filter(|(column, _)| column.param.name() == name);
                columns.for_each(|(_, slope)| *slope += pace * by_place);
            }
        }
        slopes
    }
}

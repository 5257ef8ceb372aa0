//! Cases on burn's tensors: one operation over all of them, whose columns are set to each case's parameters in turn.

use burn::tensor::{Tensor, TensorData};
use skinfit::model::params::{Column, Param, Params};
use skinfit::samples::LANES;
use skinfit::tensor::{Inputs, Scatter, Shade, Shaded, SharedDevice};

use super::cases::{Case, Cases, Shown};

/// What they make of each case. What is no column is as in most cases; the others are not made.
pub(super) fn shown(shared: &SharedDevice, cases: &Cases) -> Vec<Option<Shown>> {
    let held: Vec<Param> =
        Param::of(cases.setup.effects).filter(|param| !cases.columns.contains(param)).collect();
    let alike = |a: &Case, b: &Case| held.iter().all(|&param| a.params.rgb(param) == b.params.rgb(param));
    let how_many = |case: &&Case| cases.each.iter().filter(|other| alike(case, other)).count();
    let most = cases.each.iter().max_by_key(how_many).unwrap();
    let operation = Operation::new(shared, cases, &most.params);
    let shown = |(i, case)| alike(case, most).then(|| operation.shown(cases, i));
    cases.each.iter().enumerate().map(shown).collect()
}

/// An operation, and the inputs that it starts from.
struct Operation<'s> {
    shared: &'s SharedDevice,
    shade: Shade,
    inputs: Inputs,
    /// Each with the place of its parameter among the cases' columns, and its channel where it has one alone.
    columns: Vec<(usize, Option<usize>, Column)>,
}

fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f64> {
    tensor.into_data().try_to_vec::<f32>().unwrap().into_iter().map(f64::from).collect()
}

impl<'s> Operation<'s> {
    fn new(shared: &'s SharedDevice, cases: &Cases, params: &Params) -> Self {
        let of = |(k, &param): (usize, &Param)| match param.info().rgb {
            true => Column::per_channel(param)
                .into_iter()
                .enumerate()
                .map(|(c, column)| (k, Some(c), column))
                .collect(),
            false => vec![(k, None, Column::tied(param))],
        };
        let columns: Vec<_> = cases.columns.iter().enumerate().flat_map(of).collect();
        let held: Vec<Column> = columns.iter().map(|(.., column)| *column).collect();
        let shaded = Shaded {
            setup: cases.setup,
            params,
            columns: &held,
            illumination: &cases.environment.illumination(),
        };
        let samples: Vec<_> = cases.views().into_iter().map(|which| cases.samples(which)).collect();
        let views: Vec<_> = samples.iter().collect();
        let (shade, inputs) = Shade::new(shared, &shaded, &views, Scatter::Exact).unwrap();
        Self { shared, shade, inputs, columns }
    }

    fn shown(&self, cases: &Cases, i: usize) -> Shown {
        let (view, slot) = cases.place(i);
        let slot = view * LANES + slot;
        let values: Vec<f32> =
            self.columns.iter().map(|(.., column)| column.get(&cases.each[i].params) as f32).collect();
        let values =
            Tensor::<1>::from_data(TensorData::new(values, [self.columns.len()]), self.shared.device());
        let image = self.image(&values);
        let rgb = numbers(image)[4 * slot..][..3].try_into().unwrap();
        let mut slopes = Vec::new();
        if cases.slopes {
            slopes.resize(cases.columns.len(), None);
            for c in 0..3 {
                for ((k, own, _), slope) in self.columns.iter().zip(self.row(&values, 4 * slot + c)) {
                    let slopes: &mut [f64; 3] = slopes[*k].get_or_insert([0.0; 3]);
                    match own {
                        Some(own) if *own != c => assert_eq!(slope, 0.0, "channel {own} moves channel {c}"),
                        _ => slopes[c] = slope,
                    }
                }
            }
        }
        Shown { rgb, slopes }
    }

    /// The image of all cases at those columns; cubes are the same at all of them.
    fn image(&self, columns: &Tensor<1>) -> Tensor<2> {
        let mut inputs = Inputs { columns: columns.clone(), ..self.inputs.clone() };
        if let Some((levels, start)) = self.shade.levels() {
            inputs.levels = levels.make(Inputs { columns: columns.clone(), ..start.clone() }).unwrap();
        }
        self.shade.image(inputs).unwrap()
    }

    /// How one number of the image moves with each column.
    fn row(&self, values: &Tensor<1>, at: usize) -> Vec<f64> {
        let mut weights = vec![0.0_f32; 4 * self.shade.slots()];
        weights[at] = 1.0;
        let weights = TensorData::new(weights, [self.shade.slots(), 4]);
        let weights = Tensor::<2>::from_data(weights, self.shared.device());
        let free = values.clone().autodiff().require_grad();
        let image = self.image(&free);
        let gradients = (image * weights.autodiff()).sum().backward();
        numbers(free.grad(&gradients).unwrap())
    }
}

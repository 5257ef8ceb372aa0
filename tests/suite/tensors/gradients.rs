//! The shading operation beside the CPU model in f64, and its adjoint beside finite differences of that.

use burn::tensor::{Tensor, TensorData};
use skinfit::bake::{Illumination, LobeStack};
use skinfit::model::cube::Cube;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::Fragment;
use skinfit::model::params::{Column, Param, Params};
use skinfit::samples::surface_records::{Asked, NEUTRAL};
use skinfit::samples::{LANES, SurfaceRecords, ViewSamples};
use skinfit::tensor::footprint::cube_border;
use skinfit::tensor::{Input, Inputs, Scatter, Shade, Shaded, Sparse};

use crate::evaluators::ByWitness;

use super::bench::{Random, assert_near, matrix, numbers, shared};

const SIZES: [usize; 3] = [3, 4, 6];
const GROUPS: usize = 3;
const N: usize = (1 + 2 + 4) * LANES;

/// What the paper's effects read of the operation's inputs: the first of [`Input::ALL`].
const READ: [Input; 9] = [
    Input::Columns,
    Input::Albedo,
    Input::Specular,
    Input::Attenuator,
    Input::Open,
    Input::Bump,
    Input::Irradiance,
    Input::Lobe,
    Input::Hilite,
];

/// All of that in f64, cubes without their borders.
type Numbers = [Vec<f64>; READ.len()];

struct Case {
    setup: Setup,
    params: Params,
    columns: Vec<Column>,
    samples: ViewSamples,
    numbers: Numbers,
}

fn f32s(list: &[f64]) -> Vec<f32> {
    list.iter().map(|&x| x as f32).collect()
}

impl Case {
    fn new(form: Form, silhouette: Silhouette, effects: Effects, columns: Vec<Column>) -> Self {
        let mut random = Random::new(11);
        let group_start = vec![0, 1, 3, 7];
        let mut samples = ViewSamples {
            group_start: group_start.clone(),
            pixel: (0..(GROUPS * LANES) as u32).collect(),
            coverage: vec![1.0; GROUPS * LANES],
            surface: SurfaceRecords::new(Asked::EVERYTHING, N / LANES),
            ..ViewSamples::default()
        };
        for group in 0..GROUPS {
            let records = group_start[group] as usize..group_start[group + 1] as usize;
            for slot in records.start * LANES..records.end * LANES {
                // The last lane of each group is padding.
                let share = if slot % LANES == LANES - 1 { 0.0 } else { 1.0 / records.len() as f32 };
                let mut unit = || random.unit().map(|x| x as f32);
                let (base, normal, view) = (unit(), unit(), unit());
                let silhouette = (0.05 + 0.9 * random.next()) as f32;
                let dapple = (0.1 + 0.9 * random.next()) as f32;
                let fragment = Fragment { base, normal, view, silhouette, dapple, ..NEUTRAL };
                samples.surface.set(slot, &fragment, share);
            }
        }
        let mut params = Params::defaults(form);
        params.set(Param::RimExponent, 1.7);
        params.set(Param::EnvironmentRotation, 23.0);
        params.set(Param::Occlusion, 0.8);
        params.set(Param::NormalStrength, 0.9);
        params.set_rgb(Param::RimWeight, [0.4, 0.5, 0.7]);
        let mut cube = |size: usize| random.list(6 * size * size * 4, 0.2, 1.5);
        let cubes = SIZES.map(&mut cube);
        let [irradiance, lobe, hilite] = cubes;
        let numbers = [
            columns.iter().map(|column| f64::from(column.get(&params) as f32)).collect(),
            random.list(3 * N, 0.1, 0.9),
            random.list(N, 0.1, 0.9),
            random.list(N, 0.1, 0.9),
            random.list(N, 0.1, 0.9),
            random.list(3 * N, -0.4, 0.4),
            irradiance,
            lobe,
            hilite,
        ];
        Self { setup: Setup::new(form, silhouette, effects), params, columns, samples, numbers }
    }

    /// The image in f64, by the witness.
    fn image(&self, numbers: &Numbers) -> Vec<f64> {
        let mut params = self.params.clone();
        for (column, &value) in self.columns.iter().zip(&numbers[0]) {
            column.set(&mut params, value);
        }
        let cube = |i: usize| {
            let size = SIZES[i];
            Cube::<f64>::from_fn(size, |face, column, row| {
                let at = 4 * ((face * size + row) * size + column);
                std::array::from_fn(|c| numbers[6 + i][at + c])
            })
        };
        let (irradiance, lobe, hilite) = (cube(0), cube(1), cube(2));
        let witness = ByWitness::new(self.setup, [&irradiance, &lobe, &hilite], &params);
        let mut image = vec![0.0; 4 * GROUPS * LANES];
        for slot in 0..GROUPS * LANES {
            let group = slot / LANES;
            for record in self.samples.group_start[group]..self.samples.group_start[group + 1] {
                let s = record as usize * LANES + slot % LANES;
                let at = self.samples.surface.fragment(s);
                let triple = |i: usize| std::array::from_fn(|c| numbers[i][3 * s + c]);
                let fragment = Fragment {
                    base: at.base.map(f64::from),
                    bump: triple(5),
                    normal: at.normal.map(f64::from),
                    view: at.view.map(f64::from),
                    occlusion: numbers[4][s],
                    silhouette: f64::from(at.silhouette),
                    dapple: f64::from(at.dapple),
                    albedo: triple(1),
                    specular: numbers[2][s],
                    attenuator: numbers[3][s],
                };
                let shown = witness.shade(&fragment);
                let share = f64::from(self.samples.surface.weight(s));
                (0..4).for_each(|c| image[4 * slot + c] += share * shown[c]);
            }
        }
        image
    }

    fn operation(&self, scatter: Scatter) -> (Shade, Inputs) {
        let cube = |i: usize| {
            let size = SIZES[i];
            Cube::<f32>::from_fn(size, |face, column, row| {
                let at = 4 * ((face * size + row) * size + column);
                std::array::from_fn(|c| self.numbers[6 + i][at + c] as f32)
            })
        };
        let illumination = Illumination {
            irradiance: Some(cube(0)),
            lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![cube(1)] }),
            hilite: Some(cube(2)),
            reflected: None,
        };
        let mut samples = self.samples.clone();
        for s in 0..N {
            let triple = |i: usize| std::array::from_fn(|c| self.numbers[i][3 * s + c] as f32);
            let fragment = Fragment {
                albedo: triple(1),
                specular: self.numbers[2][s] as f32,
                attenuator: self.numbers[3][s] as f32,
                occlusion: self.numbers[4][s] as f32,
                bump: triple(5),
                ..samples.surface.fragment(s)
            };
            let share = samples.surface.weight(s);
            samples.surface.set(s, &fragment, share);
        }
        let shaded = Shaded {
            setup: self.setup,
            params: &self.params,
            columns: &self.columns,
            illumination: &illumination,
        };
        Shade::new(shared().unwrap(), &shaded, &[&samples], scatter).unwrap()
    }

    /// The adjoint of every input, by the operation's backward pass.
    fn adjoints(&self, scatter: Scatter, weights: &[f64]) -> Vec<Option<Vec<f32>>> {
        let device = shared().unwrap().device().clone().autodiff();
        let (shade, _) = self.operation(scatter);
        let leaf = |i: usize, width: usize| matrix(&self.numbers[i], width, &device).require_grad();
        let columns: Tensor<1> =
            Tensor::from_data(TensorData::new(f32s(&self.numbers[0]), [self.columns.len()]), &device);
        let columns = columns.require_grad();
        let leaves =
            [leaf(1, 3), leaf(2, 1), leaf(3, 1), leaf(4, 1), leaf(5, 3), leaf(6, 4), leaf(7, 4), leaf(8, 4)];
        let padded = |i: usize| {
            let border = Sparse::new(shared().unwrap(), &cube_border(SIZES[i])).unwrap();
            border.apply(leaves[5 + i].clone()).unwrap()
        };
        let [albedo, specular, attenuator, open, bump, ..] = leaves.clone();
        let (irradiance, lobe, hilite) = (padded(0), padded(1), padded(2));
        let inputs = Inputs {
            columns: columns.clone(),
            albedo,
            specular,
            attenuator,
            open,
            bump,
            irradiance,
            lobe,
            hilite,
            // No effect here reads them.
            reflected: matrix(&[0.0], 1, &device),
            glossy: matrix(&[0.0], 1, &device),
            levels: matrix(&[0.0], 1, &device),
        };
        let image = shade.image(inputs).unwrap();
        let gradients = (image * matrix(weights, 4, &device)).sum().backward();
        let first = columns.grad(&gradients).map(numbers);
        std::iter::once(first).chain(leaves.iter().map(|leaf| leaf.grad(&gradients).map(numbers))).collect()
    }
}

/// Adjoints of pixels: padding's too, which must not count.
fn weights() -> Vec<f64> {
    Random::new(77).list(4 * GROUPS * LANES, -1.0, 1.0)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The slope of the weighted image by one number of an input.
fn slope(case: &Case, input: usize, at: usize, weights: &[f64]) -> f64 {
    // Central differences: h^2 of curvature, and 1e-16 / h of rounding, both some 1e-10.
    let h = 1e-6;
    let along = |h: f64| {
        let mut numbers = case.numbers.clone();
        numbers[input][at] += h;
        dot(&case.image(&numbers), weights)
    };
    (along(h) - along(-h)) / (2.0 * h)
}

fn cases() -> Vec<(&'static str, Case)> {
    let all: Effects = [
        Effect::Diffuse,
        Effect::NormalMap,
        Effect::Occlusion,
        Effect::Rim,
        Effect::SideSpecular,
        Effect::Hilite,
        Effect::Reflection,
        Effect::Haze,
        Effect::KeyLight,
    ]
    .into_iter()
    .collect();
    let free: Vec<Column> = Param::built_in()
        .filter(|param| *param != Param::SpecularLobe)
        .flat_map(|param| match param {
            Param::RimWeight | Param::Hilite => Column::per_channel(param).to_vec(),
            _ => vec![Column::tied(param)],
        })
        .collect();
    let surface: Vec<Column> =
        [Param::BaseWeight, Param::RimExponent, Param::Occlusion].map(Column::tied).to_vec();
    vec![
        ("corrected", Case::new(Form::Corrected, Silhouette::Fragment, all, free.clone())),
        ("bumped", Case::new(Form::Corrected, Silhouette::Bumped, all, free.clone())),
        ("listing", Case::new(Form::Listing, Silhouette::Vertex, all, free)),
        ("surface", Case::new(Form::Corrected, Silhouette::Fragment, Effects::SURFACE, surface)),
    ]
}

#[test]
fn the_image_is_the_cpu_models() {
    if shared().is_none() {
        return;
    }
    for (name, case) in cases() {
        let (shade, inputs) = case.operation(Scatter::Exact);
        assert_eq!((shade.slots(), shade.samples()), (GROUPS * LANES, N));
        let image = numbers(shade.image(inputs).unwrap());
        // Some fifty roundings of f32, of which those of the lookups' places meet texels that differ by 1 and are a
        // sixth of a face wide.
        assert_near(&image, &case.image(&case.numbers), 4e-6, name);
    }
}

#[test]
fn every_adjoint_is_what_finite_differences_say() {
    if shared().is_none() {
        return;
    }
    let weights = weights();
    for (name, case) in cases() {
        let got = case.adjoints(Scatter::Exact, &weights);
        for (i, input) in READ.into_iter().enumerate() {
            let what = format!("{name}, {}", input.name());
            let got = got[i].as_ref().unwrap_or_else(|| panic!("{what}: no gradient"));
            let want: Vec<f64> = (0..case.numbers[i].len()).map(|at| slope(&case, i, at, &weights)).collect();
            // As for the image; a column's sum is over some hundred samples, a slope of bilinear texels has the
            // rounding of a difference.
            assert_near(got, &want, 2e-5, &what);
        }
    }
}

#[test]
fn exact_sums_have_the_same_bits_and_fast_ones_the_same_value() {
    if shared().is_none() {
        return;
    }
    let weights = weights();
    let (_, case) = cases().swap_remove(0);
    let once = case.adjoints(Scatter::Exact, &weights);
    assert!((0..3).all(|_| case.adjoints(Scatter::Exact, &weights) == once));
    let fast = case.adjoints(Scatter::Fast, &weights);
    for (i, input) in READ.into_iter().enumerate() {
        let (exact, fast) = (once[i].as_ref().unwrap(), fast[i].as_ref().unwrap());
        let exact: Vec<f64> = exact.iter().map(|&x| f64::from(x)).collect();
        // Sums of some tens of floats, in another order.
        assert_near(fast, &exact, 2e-6, input.name());
    }
}

#[test]
fn exact_sums_hold_from_the_smallest_to_the_largest_adjoints() {
    if shared().is_none() {
        return;
    }
    let (_, case) = cases().swap_remove(0);
    let plain = case.adjoints(Scatter::Exact, &weights());
    for scale in [1e-20, 1e-6, 1e20] {
        let scaled: Vec<f64> = weights().iter().map(|w| w * scale).collect();
        let got = case.adjoints(Scatter::Exact, &scaled);
        for i in 6..9 {
            let want: Vec<f64> = plain[i].as_ref().unwrap().iter().map(|&x| f64::from(x) * scale).collect();
            // Rounding of the scale itself.
            assert_near(got[i].as_ref().unwrap(), &want, 2e-6, &format!("{scale}"));
        }
    }
}

#[test]
fn an_adjoint_of_zero_gives_zeros() {
    if shared().is_none() {
        return;
    }
    let (_, case) = cases().swap_remove(0);
    let got = case.adjoints(Scatter::Exact, &vec![0.0; 4 * GROUPS * LANES]);
    assert!(got.iter().flatten().flatten().all(|&x| x == 0.0));
}

#[test]
fn the_lobe_cannot_be_a_free_column_and_a_wrong_shape_is_told() {
    let Some(shared) = shared() else { return };
    let (_, case) = cases().swap_remove(3);
    let illumination = Illumination::default();
    let columns = [Column::tied(Param::SpecularLobe)];
    let shaded =
        Shaded { setup: case.setup, params: &case.params, columns: &columns, illumination: &illumination };
    let error = Shade::new(shared, &shaded, &[&case.samples], Scatter::Exact).unwrap_err();
    assert!(error.to_string().contains("specular_lobe"), "{error}");
    let (shade, inputs) = case.operation(Scatter::Exact);
    let wrong = Inputs { albedo: Tensor::zeros([5, 3], shared.device()), ..inputs };
    let error = shade.image(wrong).unwrap_err().to_string();
    assert!(error.contains("albedo") && error.contains("[5, 3]"), "{error}");
}

//! The device that the tests share, and numbers to try.

use std::sync::OnceLock;

use burn::tensor::{Tensor, TensorData};
use skinfit::gpu::Choice;
use skinfit::model::params::Column;
use skinfit::prepare::Observed;
use skinfit::samples::ViewSamples;
use skinfit::tensor::{Inputs, Scatter, Shade, Shaded, SharedDevice};

/// The device that all tests share; `None`, and each test says so, where `SKINFIT_NO_GPU_TESTS` allows it.
pub(crate) fn shared() -> Option<&'static SharedDevice> {
    static SHARED: OnceLock<Result<SharedDevice, String>> = OnceLock::new();
    let opened =
        SHARED.get_or_init(|| SharedDevice::open(&Choice::default()).map_err(|error| error.to_string()));
    let excused = |error: &String| {
        assert!(
            std::env::var_os("SKINFIT_NO_GPU_TESTS").is_some(),
            "{error}\nSKINFIT_NO_GPU_TESTS=1 leaves the tests out that need an adapter."
        );
        crate::common::not_checked(&format!("SKINFIT_NO_GPU_TESTS is set: {error}"));
    };
    opened.as_ref().map_err(excused).ok()
}

/// The slopes of the sum of an observed scene's image by each column, which are finite, as the image is; `None` without an
/// adapter.
pub(crate) fn finite_slopes(observed: &Observed, columns: &[Column], what: &str) -> Option<Vec<f32>> {
    let task = observed.task();
    let views: Vec<&ViewSamples> = task.views.iter().map(|view| &view.samples).collect();
    let params = observed.start().params;
    let shaded = Shaded { setup: task.setup, params: &params, columns, illumination: &task.illumination };
    let (shade, inputs) = Shade::new(shared()?, &shaded, &views, Scatter::Exact).unwrap();
    let free = inputs.columns.clone().autodiff().require_grad();
    let image = shade.image(Inputs { columns: free.clone(), ..inputs }).unwrap();
    let gradients = image.clone().sum().backward();
    let slopes = numbers(free.grad(&gradients).unwrap());
    let finite = |numbers: &[f32]| numbers.iter().all(|x| x.is_finite());
    assert!(finite(&numbers(image.inner())) && finite(&slopes), "{what}: on tensors: {slopes:?}");
    Some(slopes)
}

/// Numbers in [0, 1) that look random and are the same every time (xorshift).
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(super) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// `count` numbers of f32 between `low` and `high`.
    pub(super) fn list(&mut self, count: usize, low: f64, high: f64) -> Vec<f64> {
        (0..count).map(|_| f64::from((low + (high - low) * self.next()) as f32)).collect()
    }

    pub(super) fn unit(&mut self) -> [f64; 3] {
        loop {
            let v: [f64; 3] = std::array::from_fn(|_| 2.0 * self.next() - 1.0);
            let square: f64 = v.iter().map(|x| x * x).sum();
            if (0.1..1.0).contains(&square) {
                return v.map(|x| f64::from((x / square.sqrt()) as f32));
            }
        }
    }
}

/// A matrix on a device.
pub(super) fn matrix(numbers: &[f64], columns: usize, device: &burn::tensor::Device) -> Tensor<2> {
    let numbers: Vec<f32> = numbers.iter().map(|&x| x as f32).collect();
    let rows = numbers.len() / columns;
    Tensor::from_data(TensorData::new(numbers, [rows, columns]), device)
}

/// The numbers of a tensor.
pub(super) fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().unwrap()
}

/// |got - want| <= share of the largest of `want`.
pub(super) fn assert_near(got: &[f32], want: &[f64], share: f64, what: &str) {
    assert_eq!(got.len(), want.len(), "{what}");
    let largest = want.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    assert!(largest > 0.0, "{what}: there is nothing to compare");
    for (i, (&g, w)) in got.iter().zip(want).enumerate() {
        assert!(
            (f64::from(g) - w).abs() <= share * largest,
            "{what}[{i}]: {g} is not {w} (largest {largest})"
        );
    }
}

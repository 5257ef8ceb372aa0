//! LDR-FLIP: how strongly a person would see the difference when flipping between two images.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: *FLIP: A Difference Evaluator
//! for Alternating Images*, HPG 2020. Constants and colour matrices are those of the authors'
//! program, version 1.7, with whose numbers the test below agrees.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::filter::{Border, gaussian, separable};

/// Pixels in a degree of sight: a 0.7 m wide 4K screen seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

type V3 = [f64; 3];

/// Exponent of colour differences, q_c.
const COLOR_EXPONENT: f64 = 0.7;
/// The share of the greatest colour difference, p_c, that is mapped to p_t.
const KNEE_AT: f64 = 0.4;
/// The error, p_t, at the knee.
const KNEE: f64 = 0.95;
/// Width of the feature detectors in degrees, w.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of feature differences, q_f.
const FEATURE_EXPONENT: f64 = 0.5;
/// White under D65.
const WHITE: V3 = [0.950_428_545, 1.0, 1.088_900_371];

/// The FLIP error of each pixel, 0 (the same) to 1, between two images of `width` columns in linear
/// Rec.709 within [0, 1], row by row.
#[must_use]
pub fn flip(reference: &[V3], test: &[V3], width: usize) -> Vec<f32> {
    let images = [reference, test].map(|image| Seen::new(image, width));
    let [reference, test] = &images;
    let greatest = greatest_color_difference();
    (0..reference.lab.len())
        .into_par_iter()
        .map(|i| {
            let color = redistribute(color_difference(reference.lab[i], test.lab[i]), greatest);
            let edges = (reference.edge[i] - test.edge[i]).abs();
            let points = (reference.point[i] - test.point[i]).abs();
            let feature = (edges.max(points) / 2.0_f64.sqrt()).powf(FEATURE_EXPONENT).min(1.0);
            // 0^0 is 1, but where no colour differs there is no error.
            if color > 0.0 { color.powf(1.0 - feature) as f32 } else { 0.0 }
        })
        .collect()
}

/// One image as the eye sees it.
struct Seen {
    /// Hunt-adjusted L*a*b* after the contrast sensitivity filters.
    lab: Vec<V3>,
    /// Strength of edges in the achromatic channel.
    edge: Vec<f64>,
    /// Strength of points in the achromatic channel.
    point: Vec<f64>,
}

impl Seen {
    fn new(linear: &[V3], width: usize) -> Self {
        let opponent: Vec<V3> = linear.par_iter().map(|&rgb| to_opponent(rgb)).collect();
        let (edge, point) = features(&opponent, width);
        let lab = filter_by_contrast_sensitivity(&opponent, width)
            .par_iter()
            .map(|&ycc| hunt(to_lab(from_opponent(ycc).map(|c| c.clamp(0.0, 1.0)))))
            .collect();
        Self { lab, edge, point }
    }
}

/// Blur each opponent channel by what the eye does not resolve (section 4.1.1).
///
/// A channel's filter is a sum of Gaussians a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees: one
/// each for luminance and red-green, two for blue-yellow.
fn filter_by_contrast_sensitivity(opponent: &[V3], width: usize) -> Vec<V3> {
    const B: [f64; 4] = [0.0047, 0.0053, 0.04, 0.025];
    const BLUE_YELLOW: [f64; 2] = [34.1, 13.5];
    let radius = (3.0 * (B[2] / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as usize;
    let kernels = B.map(|b| gaussian((b / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE, radius));
    // A unit-sum kernel stands for a Gaussian whose taps sum, in one direction, to this:
    let sum = |b: f64| -> f64 {
        let tap = |k: usize| ((k as f64 - radius as f64) / PIXELS_PER_DEGREE).powi(2);
        (0..=2 * radius).map(|k| (-PI * PI * tap(k) / b).exp()).sum()
    };
    let share = |i: usize| BLUE_YELLOW[i] * (PI / B[2 + i]).sqrt() * sum(B[2 + i]).powi(2);
    let wide = share(0) / (share(0) + share(1));
    let planes: Vec<[f64; 4]> = opponent.iter().map(|&[y, cx, cz]| [y, cx, cz, cz]).collect();
    separable(&planes, width, Border::Repeat, &kernels, &kernels)
        .iter()
        .map(|&[y, cx, a, b]| [y, cx, wide * a + (1.0 - wide) * b])
        .collect()
}

/// Edges and points in the achromatic channel (section 4.2): lengths of the gradient and of the
/// unmixed second derivatives of a Gaussian-blurred image.
fn features(opponent: &[V3], width: usize) -> (Vec<f64>, Vec<f64>) {
    let sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as usize;
    let blur = gaussian(sigma, radius);
    let derivative = |weight: &dyn Fn(f64) -> f64| {
        let at = |k: usize| weight(k as f64 - radius as f64) * blur[k];
        unit_lobes((0..blur.len()).map(at).collect())
    };
    let first = derivative(&|x| -x);
    let second = derivative(&|x| x * x / (sigma * sigma) - 1.0);
    let across = [first.clone(), blur.clone(), second.clone(), blur.clone()];
    let down = [blur.clone(), first, blur, second];
    let planes: Vec<[f64; 4]> = opponent.iter().map(|&[y, ..]| [(y + 16.0) / 116.0; 4]).collect();
    let filtered = separable(&planes, width, Border::Repeat, &across, &down);
    filtered.iter().map(|&[dx, dy, ddx, ddy]| (dx.hypot(dy), ddx.hypot(ddy))).unzip()
}

/// Scale the positive weights to sum to 1, the negative ones to -1.
fn unit_lobes(weights: Vec<f64>) -> Vec<f64> {
    let positive: f64 = weights.iter().filter(|&&w| w > 0.0).sum();
    let negative: f64 = weights.iter().filter(|&&w| w < 0.0).map(|w| -w).sum();
    weights.into_iter().map(|w| if w > 0.0 { w / positive } else { w / negative }).collect()
}

/// HyAB distance (city block in L*, Euclidean in a*b*) to the power q_c.
fn color_difference(a: V3, b: V3) -> f64 {
    ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(COLOR_EXPONENT)
}

/// The difference of Hunt-adjusted green and blue, the greatest that there is.
fn greatest_color_difference() -> f64 {
    color_difference(hunt(to_lab([0.0, 1.0, 0.0])), hunt(to_lab([0.0, 0.0, 1.0])))
}

/// Spread small differences over [0, p_t] and squeeze the rest into [p_t, 1] (section 4.1.3).
fn redistribute(difference: f64, greatest: f64) -> f64 {
    let knee = KNEE_AT * greatest;
    if difference < knee {
        difference * KNEE / knee
    } else {
        KNEE + (difference - knee) / (greatest - knee) * (1.0 - KNEE)
    }
}

/// Colours look less saturated in the dark (Hunt's effect).
fn hunt([l, a, b]: V3) -> V3 {
    [l, 0.01 * l * a, 0.01 * l * b]
}

fn multiply(matrix: &[V3; 3], v: V3) -> V3 {
    std::array::from_fn(|i| matrix[i][0] * v[0] + matrix[i][1] * v[1] + matrix[i][2] * v[2])
}

/// Linear Rec.709 to XYZ, relative to white.
fn to_xyz(rgb: V3) -> V3 {
    const MATRIX: [V3; 3] = [
        [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
        [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
        [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
    ];
    let xyz = multiply(&MATRIX, rgb);
    std::array::from_fn(|i| xyz[i] / WHITE[i])
}

/// Linear Rec.709 to the linear opponent space YCxCz.
fn to_opponent(rgb: V3) -> V3 {
    let [x, y, z] = to_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The inverse of [`to_opponent`].
fn from_opponent([y, cx, cz]: V3) -> V3 {
    const MATRIX: [V3; 3] = [
        [3.241_003_275, -1.537_398_934, -0.498_615_861],
        [-0.969_224_334, 1.875_930_071, 0.041_554_224],
        [0.055_639_423, -0.204_011_202, 1.057_148_933],
    ];
    let y = (y + 16.0) / 116.0;
    multiply(&MATRIX, [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]])
}

/// Linear Rec.709 to CIE L*a*b* (1976).
fn to_lab(rgb: V3) -> V3 {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = to_xyz(rgb).map(|t| match t > DELTA * DELTA * DELTA {
        true => t.cbrt(),
        false => t / (3.0 * DELTA * DELTA) + 4.0 / 29.0,
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

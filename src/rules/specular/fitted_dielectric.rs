//! The split sum of GGX with its own Fresnel factor, a dielectric's, as a rational function for the rules: the
//! program that fits and prints it.
//!
//! Of the integral (`split_sum::dielectric_sum`) this is fitted:
//!
//! ```text
//! mean   1 - u, where (a + b) F(u, f0) is the integral      1 - H.V' in a mean that goes by the Fresnel factor
//! ```
//!
//! So the integral is never negative nor more than a white furnace gives, 0 at f0 = 0 and a + b at f0 = 1, and what is
//! fitted hardly moves with f0: the factor itself stands in the rules. x and y are those of `fitted`, z goes with the
//! fourth root of f0, as the cosine does below which nearly everything is reflected: u^2 = 4 sqrt f0.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::SpecularModel;
use super::brdf::dielectric;
use super::fitted::{FITS, ROUGHNESS, printed_view, roughness_variable};
use super::rational::{Origin, Point, Shape, terms};
use super::split_sum::{Quadrature, dielectric_sum, split_sum};

/// The largest error of the integral that the printed function may have from [`FULL`] on, over all views and
/// roughnesses.
const LARGEST_ERROR: f64 = 5e-4;
/// The same below it.
const LARGEST_ERROR_BELOW: f64 = 1e-2;
/// From this f0 on an error counts in full, below it as the root of f0: few surfaces reflect less, and the mean turns
/// over.
const FULL: f64 = 0.002;
/// Between these values of f0 the mean moves; beyond, the factor alone does. The parameter's bound, 0.2, lies within:
/// at an end the slope would be that of the other side; and below the smaller the factor is held where both graze.
const RANGE: [f64; 2] = [1e-5, 0.25];
/// l of the views' variable is this times m^2.
const LAYER: f64 = 2.0;
/// Where x, y and z are 0 in print, as `fitted` says.
const FROM: [Origin; 3] = [Origin::High, Origin::Low, Origin::Low];

/// The integral at one view, roughness and f0.
#[derive(Clone, Copy)]
struct Node {
    view: f64,
    m: f64,
    f0: f64,
    /// a + b.
    total: f64,
    value: f64,
}

impl Node {
    fn new(view: f64, m: f64, f0: f64) -> Self {
        let [a, b] = split_sum(SpecularModel::Ggx, view, m, Quadrature::COARSE).map(|x| x.value);
        let (sum, _) = dielectric_sum(SpecularModel::Ggx, view, m, f0, Quadrature::COARSE);
        Self { view, m, f0, total: a + b, value: sum.value }
    }

    fn variables(&self) -> [f64; 3] {
        let l = LAYER * self.m * self.m;
        let x = (self.view * (1.0 + l) / (self.view + l)).sqrt();
        let z = (self.f0 / RANGE[1]).sqrt().sqrt();
        [2.0 * x - 1.0, roughness_variable(self.m), 2.0 * z - 1.0]
    }

    /// The mean, and how the integral moves with it.
    fn point(&self) -> Point {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            // Below f0 = 1/3 the factor falls with the cosine all the way.
            let above = self.total * dielectric(middle, self.f0)[0] > self.value;
            *(if above { &mut low } else { &mut high }) = middle;
        }
        let slope = |u: f64| {
            let (above, below) = ((u + 1e-5).min(1.0), (u - 1e-5).max(0.0));
            (dielectric(below, self.f0)[0] - dielectric(above, self.f0)[0]) / (above - below)
        };
        // No smaller than where the square alone counts.
        let steep = (self.total * slope(low).max(slope(low.min(0.9)))).max(0.02);
        Point { at: self.variables(), target: 1.0 - low, counts: steep * (self.f0 / FULL).sqrt().min(1.0) }
    }
}

/// Views that lie densely towards both ends, roughnesses in equal ratios, and values of f0 by their fourth roots.
fn nodes([views, roughnesses, f0s]: [usize; 3]) -> Vec<Node> {
    let dense = |i: usize, count: usize| 0.5 - 0.5 * (std::f64::consts::PI * i as f64 / count as f64).cos();
    let at = |i: usize| {
        let view = dense(i / (roughnesses * f0s) + 1, views);
        let m = super::SMOOTHEST.powf(1.0 - (i / f0s % roughnesses) as f64 / (roughnesses - 1) as f64);
        let f0 = RANGE[1] * dense(i % f0s, f0s - 1).powi(4);
        Node::new(view * view, m, f0.max(RANGE[0]))
    };
    (0..views * roughnesses * f0s).into_par_iter().map(at).collect()
}

/// Which terms the printed function has.
fn shape() -> Shape {
    Shape { numerator: terms(6, 4), denominator: terms(6, 3) }
}

fn solve(shape: &Shape, nodes: &[Node]) -> [Vec<f64>; 2] {
    shape.solve(&nodes.par_iter().map(Node::point).collect::<Vec<_>>())
}

/// The whole file.
fn file() -> String {
    let found = solve(&shape(), &nodes([36, 16, 8]));
    let lost = FITS[1][0];
    let mut text = String::from("// 1 - H.V' in the mean that a dielectric's Fresnel factor takes.\n");
    text.push_str(&shape().print("ggx_dielectric_mean", &found, FROM));
    let _ = write!(
        text,
        "\n// The split sum of ggx with a dielectric's Fresnel factor (MODEL 9): what of a constant environment of 1 is reflected, at
// N.V', a roughness of [{:?}, 1] and an f0 of [0, {:?}], to {LARGEST_ERROR:e} from f0 = {FULL:?} on and to
// {LARGEST_ERROR_BELOW:e} below. At views that graze more than 1e-6 it stays: there its slope is infinite. Fitted to
// the exact integrals and printed by specular/fitted_dielectric.rs; nobody writes here.
fn dielectric_sum_ggx(view_cosine: f32, roughness: f32, f0: f32) -> f32 {{
    let view: f32 = max(view_cosine, 1e-6);
    let y: f32 = {:?} * roughness - {:?};
    let lost_layer: f32 = {:?} * roughness;
    let lost: f32 = ggx_lost({}, y);
    let layer: f32 = {LAYER:?} * roughness * roughness;
    let x: f32 = {};
    let z: f32 = sqrt(sqrt({:?} * min(max(f0, {:e}), {:?})));
    let mean: f32 = min(max(ggx_dielectric_mean(x, y, z), 0.0), 1.0);
    return (1.0 - lost * lost) * dielectric_fresnel(1.0 - mean, f0);
}}
",
        super::SMOOTHEST,
        RANGE[1],
        ROUGHNESS[0] as f32,
        ROUGHNESS[1] as f32,
        lost.layer,
        printed_view(lost.from, "lost_layer"),
        printed_view(FROM[0], "layer"),
        (1.0 / RANGE[1]) as f32,
        RANGE[0],
        RANGE[1],
    );
    text
}

#[cfg(test)]
mod tests {
    use super::super::rules::Function;
    use super::*;

    const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/shader/rules/lib/");

    /// The rules' function from the texts that it stands on.
    fn printed() -> Function {
        let names = ["specular", "split_sum_ggx", "dielectric_sum_ggx"];
        let read = |name| std::fs::read_to_string(format!("{FOLDER}{name}.wgsl")).unwrap();
        Function::new(&names.map(read).concat(), "dielectric_sum_ggx", 3)
    }

    #[test]
    fn the_printed_function_is_as_exact_as_it_says() {
        if std::env::var_os("SKINFIT_PRINT_SPLIT_SUMS").is_some() {
            std::fs::write(format!("{FOLDER}dielectric_sum_ggx.wgsl"), file()).unwrap();
        }
        let function = printed();
        // Between the fit's own nodes.
        let places = (0..30 * 11 * 8).map(|i| {
            let view = (f64::from(i / 88) + 0.5) / 30.0;
            let m = super::super::SMOOTHEST.powf(f64::from(i / 8 % 11) / 10.0);
            // The last is where the error is largest of those that count in full.
            let f0 = if i % 8 == 7 { FULL } else { RANGE[1] * (f64::from(i % 8) / 6.0).powi(4) };
            [view.powi(4), m, f0]
        });
        let nodes: Vec<Node> =
            places.collect::<Vec<_>>().into_par_iter().map(|[view, m, f0]| Node::new(view, m, f0)).collect();
        for node in nodes {
            let got = function.of(&[node.view, node.m, node.f0])[0];
            let most = if node.f0 >= FULL { LARGEST_ERROR } else { LARGEST_ERROR_BELOW };
            let (Node { view, m, f0, value, total }, error) = (node, (got - node.value).abs());
            assert!(error < most, "{view} {m} {f0}: {got} {value}");
            // `ggx_lost` has its own error.
            assert!(got >= 0.0 && got <= total + LARGEST_ERROR, "{view} {m} {f0}: {got} {total}");
        }
    }

    #[test]
    fn f32_holds_the_printed_function() {
        let function = printed();
        for i in 0..101_u16 * 21 * 9 {
            let view = (f32::from(i / 189) / 100.0).powi(2);
            let m = 20.0_f32.powf(-f32::from(i / 9 % 21) / 20.0);
            let f0 = 0.25 * (f32::from(i % 9) / 8.0).powi(4);
            let exact = function.of(&[f64::from(view), f64::from(m), f64::from(f0)])[0];
            let got = function.in_f32(&[view, m, f0])[0];
            // The mean is off by 5e-6, and the factor moves four times as fast; a tenth of the fit's error.
            assert!((exact - f64::from(got)).abs() < 5e-5, "{view} {m} {f0}: {got} in the place of {exact}");
        }
    }

    #[test]
    fn nothing_and_everything_are_reflected_at_the_ends_of_f0() {
        let function = printed();
        for view in [0.0, 1e-3, 0.3, 1.0] {
            for m in [0.05, 0.35, 1.0] {
                let [a, b] = split_sum(SpecularModel::Ggx, view, m, Quadrature::COARSE).map(|x| x.value);
                assert_eq!(function.of(&[view, m, 0.0])[0], 0.0);
                // `ggx_lost`'s error alone.
                let all = function.of(&[view, m, 1.0])[0];
                assert!((all - (a + b)).abs() < LARGEST_ERROR, "{view} {m}: {all}");
            }
        }
    }

    #[test]
    fn a_fit_of_few_terms_is_near_what_it_is_fitted_to() {
        let shape = Shape { numerator: terms(3, 2), denominator: terms(2, 1) };
        let nodes = nodes([12, 6, 5]);
        let found = solve(&shape, &nodes);
        let function = Function::new(&shape.print("mean", &found, FROM), "mean", 3);
        for node in &nodes {
            let Point { at, target, counts } = node.point();
            let value = shape.of(&found, at);
            // Coefficients are printed in f32.
            let printed: [f64; 3] = std::array::from_fn(|axis| FROM[axis].of(at[axis]));
            assert!((function.of(&printed)[0] - value).abs() < 1e-4, "{at:?}");
            // What 25 coefficients reach.
            assert!((value - target).abs() * counts < 0.03, "{at:?}: {value} {target}");
        }
    }
}

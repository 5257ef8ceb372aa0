//! The split sum as rational functions, for the rules: the program that fits and prints them.
//!
//! Of the integrals a and b (`split_sum`) these are fitted:
//!
//! ```text
//! lost   sqrt(1 - (a + b))           what a white furnace does not give back: so a + b never exceeds 1
//! mean   (b / (a + b))^(1/5)         1 - H.V' in the mean of Schlick's factor: so a and b are never negative
//! ```
//!
//! Each as the quotient of two polynomials in x and y, terms x^i y^j with i + j up to a degree. y goes with the
//! roughness and x with the square root of mu (1 + l) / (mu + l), mu = N.V': at grazing views the integrals turn over
//! within some l, which grows as the lobe's width does, like mu log mu. Both variables lie in [-1, 1]. In print y runs from
//! the sharpest lobe on, and x mostly from a view along the normal: in f32 a and b are off by 1e-5 at most, with
//! both from the middle on it were 1e-4.
//!
//! `rational` finds the coefficients. No exact text is asked of a fit: its last digits are the machine's.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::rational::{Origin, Point, Shape, terms};
use super::split_sum::{Quadrature, split_sum};
use super::{SMOOTHEST, SpecularModel};

/// The largest error of a and of b that the printed functions may have, over all views and roughnesses.
pub(super) const LARGEST_ERROR: f64 = 2e-4;

/// A fit.
#[derive(Clone, Copy)]
pub(super) struct Fit {
    model: SpecularModel,
    name: &'static str,
    /// l = `layer` m^`power`.
    pub(super) layer: f64,
    power: i32,
    degree: usize,
    /// Where x is 0 in print: where f32 leaves most.
    pub(super) from: Origin,
}

/// The name of the fits of what is lost; the others are of the mean.
const LOST: &str = "lost";

/// Of each model what is lost, and the mean.
pub(super) const FITS: [[Fit; 2]; 2] = [
    [
        Fit {
            model: SpecularModel::Kelemen,
            name: LOST,
            layer: 2.0,
            power: 1,
            degree: 6,
            from: Origin::High,
        },
        Fit {
            model: SpecularModel::Kelemen,
            name: "mean",
            layer: 2.0,
            power: 1,
            degree: 5,
            from: Origin::High,
        },
    ],
    [
        Fit { model: SpecularModel::Ggx, name: LOST, layer: 1.0, power: 1, degree: 6, from: Origin::Middle },
        Fit { model: SpecularModel::Ggx, name: "mean", layer: 2.0, power: 2, degree: 6, from: Origin::High },
    ],
];

/// The integrals at one view and roughness.
#[derive(Clone, Copy)]
struct Node {
    view: f64,
    m: f64,
    total: f64,
    /// b / (a + b).
    share: f64,
}

fn node(model: SpecularModel, view: f64, m: f64, quadrature: Quadrature) -> Node {
    let [a, b] = split_sum(model, view, m, quadrature).map(|x| x.value);
    Node { view, m, total: a + b, share: b / (a + b) }
}

/// What stands for a roughness in print: in [0, 1], this times it less the other.
pub(super) const ROUGHNESS: [f64; 2] = [1.0 / (1.0 - SMOOTHEST), SMOOTHEST / (1.0 - SMOOTHEST)];

/// What stands for it in the quotients: in [-1, 1].
pub(super) fn roughness_variable(m: f64) -> f64 {
    2.0 * (ROUGHNESS[0] * m - ROUGHNESS[1]) - 1.0
}

/// What is printed for x, the variable of views: `l` is the name of its layer.
pub(super) fn printed_view(from: Origin, l: &str) -> String {
    let root = format!("sqrt(view * (1.0 + {l}) / (view + {l}))");
    match from {
        Origin::Low => root,
        Origin::Middle => format!("2.0 * {root} - 1.0"),
        Origin::High => format!("1.0 - {root}"),
    }
}

/// Views that lie densely towards both ends, and roughnesses in equal ratios.
fn nodes(model: SpecularModel, views: usize, roughnesses: usize) -> Vec<Node> {
    let at = |i: usize| {
        let (view, m) = (i / roughnesses + 1, i % roughnesses);
        let place = 0.5 - 0.5 * (std::f64::consts::PI * view as f64 / views as f64).cos();
        let m = SMOOTHEST.powf(1.0 - m as f64 / (roughnesses - 1) as f64);
        node(model, place * place, m, Quadrature::COARSE)
    };
    (0..views * roughnesses).into_par_iter().map(at).collect()
}

impl Fit {
    fn variables(&self, node: &Node) -> [f64; 3] {
        let l = self.layer * node.m.powi(self.power);
        let x = (node.view * (1.0 + l) / (node.view + l)).sqrt();
        [2.0 * x - 1.0, roughness_variable(node.m), 0.0]
    }

    /// What is fitted, and how the integrals move with it.
    fn target(&self, node: &Node) -> (f64, f64) {
        if self.name == LOST {
            let lost = (1.0 - node.total).max(0.0).sqrt();
            // No smaller than where the square alone counts.
            (lost, 2.0 * lost.max(0.01))
        } else {
            let mean = node.share.max(0.0).powf(0.2);
            (mean, 5.0 * node.total * mean.max(0.15).powi(4))
        }
    }

    fn shape(&self) -> Shape {
        Shape { numerator: terms(self.degree, 0), denominator: terms(self.degree, 0) }
    }

    fn solve(&self, nodes: &[Node]) -> [Vec<f64>; 2] {
        let point = |node: &Node| {
            let (target, counts) = self.target(node);
            Point { at: self.variables(node), target, counts }
        };
        self.shape().solve(&nodes.iter().map(point).collect::<Vec<_>>())
    }

    fn print(&self, found: &[Vec<f64>; 2]) -> String {
        let from = [self.from, Origin::Low, Origin::Middle];
        self.shape().print(&format!("{}_{}", self.model.name(), self.name), found, from)
    }
}

/// The whole file of a model.
fn file(model: usize) -> String {
    let [lost, mean] = FITS[model];
    let name = lost.model.name();
    let nodes = nodes(lost.model, 56, 28);
    let x = |fit: &Fit| {
        let l = if fit.power == 1 { "roughness" } else { "roughness * roughness" };
        format!("{:?} * {l}", fit.layer)
    };
    // Languages that it is translated to know a function from its definition on.
    let mut text = String::from("// The root of what a white furnace does not give back.\n");
    text.push_str(&lost.print(&lost.solve(&nodes)));
    text.push_str("\n// 1 - H.V' in the mean of its fifth power.\n");
    text.push_str(&mean.print(&mean.solve(&nodes)));
    let _ = write!(
        text,
        "\n// The split sum of {name} (MODEL 9): a and b, with which a constant environment of 1 is reflected as f0 a + b, at
// N.V' and a roughness of [{SMOOTHEST}, 1], to {LARGEST_ERROR:e}. At views that graze more than 1e-6 it stays: there
// its slope is infinite. Fitted to the exact integrals and printed by specular/fitted.rs; nobody writes here.
fn split_sum_{name}(view_cosine: f32, roughness: f32) -> vec2f {{
    let view: f32 = max(view_cosine, 1e-6);
    let y: f32 = {:?} * roughness - {:?};
    let lost_layer: f32 = {};
    let lost: f32 = {name}_lost({}, y);
    let mean_layer: f32 = {};
    let mean: f32 = max({name}_mean({}, y), 0.0);
    let all: f32 = 1.0 - lost * lost;
    let square: f32 = mean * mean;
    let grazing: f32 = all * (square * square * mean);
    return vec2f(all - grazing, grazing);
}}
",
        ROUGHNESS[0] as f32,
        ROUGHNESS[1] as f32,
        x(&lost),
        printed_view(lost.from, "lost_layer"),
        x(&mean),
        printed_view(mean.from, "mean_layer"),
    );
    text
}

#[cfg(test)]
mod tests {
    use super::super::rules::Function;
    use super::*;

    const PATHS: [&str; 2] = [
        concat!(env!("CARGO_MANIFEST_DIR"), "/shader/rules/lib/split_sum_kelemen.wgsl"),
        concat!(env!("CARGO_MANIFEST_DIR"), "/shader/rules/lib/split_sum_ggx.wgsl"),
    ];

    /// The largest error of a and b at views and roughnesses between the fit's own, and where it is.
    fn worst(model: SpecularModel, text: &str) -> (f64, [f64; 2]) {
        let function = Function::new(text, &format!("split_sum_{}", model.name()), 2);
        let mut places: Vec<[f64; 2]> = Vec::new();
        for i in 0..40 {
            for j in 0..19 {
                let view = (f64::from(i) + 0.5) / 40.0;
                places.push([view.powi(4), SMOOTHEST.powf(f64::from(j) / 18.0)]);
            }
        }
        let exact: Vec<[f64; 2]> = places
            .par_iter()
            .map(|&[view, m]| split_sum(model, view, m, Quadrature::COARSE).map(|x| x.value))
            .collect();
        let mut worst = (0.0, [0.0; 2]);
        for (&[view, m], exact) in places.iter().zip(&exact) {
            let got = function.of(&[view, m]);
            let error = (0..2).map(|c| (got[c] - exact[c]).abs()).fold(0.0, f64::max);
            assert!(got[0] >= 0.0 && got[1] >= 0.0 && got[0] + got[1] <= 1.0, "{view} {m}: {got:?}");
            if error > worst.0 {
                worst = (error, [view, m]);
            }
        }
        worst
    }

    #[test]
    fn the_printed_functions_are_as_exact_as_they_say() {
        for (i, model) in SpecularModel::ALL.into_iter().enumerate() {
            if std::env::var_os("SKINFIT_PRINT_SPLIT_SUMS").is_some() {
                std::fs::write(PATHS[i], file(i)).unwrap();
            }
            let printed = worst(model, &std::fs::read_to_string(PATHS[i]).unwrap());
            assert!(printed.0 < LARGEST_ERROR, "{model:?}: {printed:?}");
        }
    }

    /// Quotients of sums that are small where the lobe is sharp: written from the wrong end they lose 1e-4.
    #[test]
    fn f32_holds_the_printed_functions() {
        for (model, path) in SpecularModel::ALL.into_iter().zip(PATHS) {
            let name = format!("split_sum_{}", model.name());
            let function = Function::new(&std::fs::read_to_string(path).unwrap(), &name, 2);
            let views = (0..=300_u16).map(|i| (f32::from(i) / 300.0).powi(2));
            for (view, m) in
                views.flat_map(|view| (0..=60_u16).map(move |j| (view, 20.0_f32.powf(-f32::from(j) / 60.0))))
            {
                let (exact, got) =
                    (function.of(&[f64::from(view), f64::from(m)]), function.in_f32(&[view, m]));
                for (exact, got) in exact.into_iter().zip(got) {
                    let off = (exact - f64::from(got)).abs();
                    // Of kelemen's loss 5e-6, which counts as often as the loss is large; a twentieth of a fit's error.
                    assert!(off < 1e-5, "{model:?} {view} {m}: {got} in the place of {exact}");
                }
            }
        }
    }

    #[test]
    fn a_fit_of_few_terms_is_near_what_it_is_fitted_to_and_prints_what_it_found() {
        for fit in FITS.concat() {
            let fit = Fit { degree: 3, ..fit };
            let nodes = nodes(fit.model, 16, 7);
            let found = fit.solve(&nodes);
            let name = format!("{}_{}", fit.model.name(), fit.name);
            let function = Function::new(&fit.print(&found), &name, 2);
            let mut most = 0.0_f64;
            for node in &nodes {
                let at = fit.variables(node);
                let (target, counts) = fit.target(node);
                let value = fit.shape().of(&found, at);
                // Coefficients are printed in f32, and quotients of few terms come near a denominator of 0.
                let off = (function.of(&[fit.from.of(at[0]), Origin::Low.of(at[1])])[0] - value).abs();
                assert!(off < 1e-4, "{name}: {off:e}");
                most = most.max((value - target).abs() * counts);
            }
            // What 19 coefficients reach.
            assert!(most < 0.02, "{name}: {most}");
        }
    }
}

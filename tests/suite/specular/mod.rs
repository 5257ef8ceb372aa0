//! Specular light with Fresnel against the vectors of an independent float64 oracle (tests/vectors_light), and its hard
//! cases: the exact integrals and filters, and the rules' functions with their derivatives.
//!
//! - `lights`: one light's term; `split_sums`, `environment`: what a lobe reflects of the environment; `hard`: hard cases

mod environment;
mod hard;
mod lights;
mod split_sums;

use skinfit::shader::rule::LIBRARY;
use skinfit_core::specular::SpecularModel;

use crate::by_rules::{Function, Kind};
use crate::common::vectors_light;
use crate::vectors::reader::{Node, Tolerance, Tolerances, Vectors};

const MODELS: [(SpecularModel, &str); 2] =
    [(SpecularModel::Kelemen, "specular_lights.json"), (SpecularModel::Ggx, "specular_lights_ggx.json")];

fn read() -> Vectors {
    Vectors::read(&vectors_light())
}

/// The rules' text of specular light.
fn library() -> Vec<&'static str> {
    let names = ["specular", "split_sum_kelemen", "split_sum_ggx", "dielectric_sum_ggx"];
    names.map(|name| LIBRARY.iter().find(|(known, _)| *known == name).unwrap().1).to_vec()
}

/// A function of the rules, and how it moves along each of the arguments `moved`.
struct Rule {
    value: Function,
    slopes: Vec<Function>,
}

impl Rule {
    fn new(name: &str, arguments: &[usize], moved: &[usize]) -> Self {
        let text = library();
        let slopes = moved.iter().map(|&at| Function::tangent(&text, name, arguments, at)).collect();
        Self { value: Function::new(&text, name, arguments), slopes }
    }

    /// The value, and then the slopes.
    fn of(&self, arguments: &[&[f64]]) -> Vec<Vec<f64>> {
        let one = [1.0];
        let with = [arguments, &[&one[..]]].concat();
        let slopes = self.slopes.iter().map(|slope| slope.of(0.0, &with));
        std::iter::once(self.value.of(0.0, arguments)).chain(slopes).collect()
    }

    /// The value in a kind of number.
    fn of_kind(&self, kind: Kind, arguments: &[&[f64]]) -> Vec<f64> {
        self.value.of_kind(kind, arguments)
    }

    /// Whether the value is finite in all numbers of 32 bits.
    fn is_finite(&self, arguments: &[&[f64]]) -> bool {
        Kind::narrow().into_iter().flat_map(|kind| self.of_kind(kind, arguments)).all(f64::is_finite)
    }
}

fn brdf_rule(model: SpecularModel) -> Rule {
    // m and f0 move.
    Rule::new(&format!("{}_brdf", model.name()), &[3, 3, 3, 1, 1], &[3, 4])
}

/// Nothing of a file is left unread but what `aside` begins.
fn all_read(vectors: &Vectors, name: &str, aside: &[&str]) {
    let root = vectors.files[name].root();
    root.at("name").assert_text(&root.vector.name);
    root.at("kind").assert_text("specular");
    let known = ["note", "tolerance", "constants", "cubes_file"];
    let left: Vec<_> = root
        .vector
        .left()
        .into_iter()
        .filter(|path| known.iter().chain(aside).all(|beginning| !path.starts_with(beginning)))
        .collect();
    assert!(left.is_empty(), "{name}: {left:?}");
}

/// f64's tolerance of a file: its `f64_abs` covers what cancels.
fn double(vector: &Node<'_>) -> Tolerance {
    let given = vector.vector.root().at("tolerance");
    Tolerance { abs: given.at("f64_abs").number(), rel: given.at("f64_rel").number() }
}

/// Tolerances of a case, whose `f32_rel` overrides the file's.
fn near(file: &Node<'_>, case: &Node<'_>) -> Tolerances {
    let single = file.vector.tolerances().single;
    let rel = case.get("f32_rel").map_or(single.rel, |rel| rel.number());
    Tolerances { double: double(file), single: Tolerance { rel, ..single } }
}

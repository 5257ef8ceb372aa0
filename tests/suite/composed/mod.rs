//! Everything at once (MODEL 12) against the vectors of an independent float64 oracle: each term, their sum, and how it moves
//! with every parameter that there is; the planned rules in f64, in f32 and in SIMD lanes, the engines on the processor and
//! on an adapter, burn's tensors, and a compute shader of the same rules.
//!
//! - `file`: the file as the library's own scene, parameters, cubes and fields; `stored`: as stored samples and texels
//! - `rules`: the planned rules over them in any kind of number; `lacking`: what the oracle has of tables of its own
//! - `terms`: all of it in every kind of number
//! - `engines`: sums and their Jacobian on engines and tensors; `shaders`: terms on an adapter

mod engines;
mod file;
mod lacking;
mod rules;
mod shaders;
mod stored;
mod terms;

use crate::common::vectors_light;
use crate::vectors::reader::{Node, Vectors};
use file::{OTHER, PLAIN, param};

/// What is compared with nothing, by what its path begins with.
const LEFT_OUT: [&str; 3] = [
    // A sentence for people.
    "note",
    // The rules have the skin in its own reflection where bounces are gathered; here their function is taken by itself.
    "constants.choices.skin_reflection",
    "constants.other_choices.skin_reflection",
];

fn read() -> Vectors {
    Vectors::read(&vectors_light())
}

#[test]
fn everything_at_once_is_as_the_vectors_say_in_every_kind_of_number() {
    let vectors = read();
    terms::compare(&vectors);
    let root = vectors.files["composed.json"].root();
    root.at("name").assert_text("composed");
    root.at("kind").assert_text("composed");
    // Names for people, and nodes of a table beyond those that the fragments lie between.
    root.at("inputs")
        .at("fragments")
        .at("case")
        .items()
        .iter()
        .for_each(|case| assert!(!case.text().is_empty()));
    assert!(root.at("inputs").at("resources").at("ab").numbers().iter().all(|x| (0.0..=1.0).contains(x)));
    choices(&root);
    let left = root.vector.left();
    let unread: Vec<_> =
        left.iter().filter(|path| !LEFT_OUT.iter().any(|begin| path.starts_with(begin))).collect();
    assert!(unread.is_empty(), "{unread:?}");
    let stale = LEFT_OUT.iter().filter(|begin| !left.iter().any(|path| path.starts_with(**begin)));
    assert_eq!(stale.collect::<Vec<_>>(), Vec::<&&str>::new(), "these are compared after all");
}

/// The choices that the file names are those that it is compared under.
fn choices(root: &Node<'_>) {
    for (key, choices) in [("choices", PLAIN), ("other_choices", OTHER)] {
        for (name, value) in choices.named() {
            if let Some(node) = root.at("constants").at(key).get(name).filter(|_| name != "skin_reflection") {
                node.assert_text(value);
            }
        }
    }
    for name in root.at("constants").at("rgb").items() {
        assert!(param(name.text()).info().rgb, "{}", name.text());
    }
    let floor = root.at("constants").at("other_choices").at("f0_floor").number();
    assert_eq!(floor, param("f0_floor").info().corrected);
}

#[test]
fn everything_at_once_is_as_the_vectors_say_on_engines_and_tensors() {
    engines::compare(&read());
}

#[test]
fn every_term_is_as_the_vectors_say_in_a_compute_shader() {
    shaders::compare(&read());
}

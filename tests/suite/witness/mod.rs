//! A witness: the whole fragment model, its losses and what a fit needs of them, by hand in f64.
//!
//! The formulas are those of docs/model.md (sections 3, 4 and 7; GPU Gems, chapter 3, listings 3-3 and 3-4) and of
//! docs/scene-files.md (losses). Nothing of the library is used, nothing is fast, and derivatives are central
//! differences: an algebra error in the library cannot be repeated here.
//!
//! - `cube`: cube maps, looked up without a stored border
//! - `fragment`: one fragment, in both forms
//! - `losses`: the four losses
//! - `scene`: pixels of several samples, views with gains; image, loss and normal equations
//! - `random`: scenes to try
//! - `tests`: the witness against the oracle's vectors, and every evaluator against the witness

pub(crate) mod cube;
pub(crate) mod fragment;
pub(crate) mod losses;
mod random;
pub(crate) mod scene;
mod tests;

pub(crate) use self::tests::{bench_on, fit_of_the_bench, fragments_on};

/// A vector of three.
pub(crate) type V3 = [f64; 3];

fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn scaled(factor: f64, a: V3) -> V3 {
    a.map(|x| factor * x)
}

fn sum(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The unit vector along `v`, without under- or overflow; `None` where `v` has no direction.
fn unit(v: V3) -> Option<V3> {
    let largest = v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    if !v.iter().all(|x| x.is_finite()) || largest == 0.0 {
        return None;
    }
    let v = v.map(|x| x / largest);
    Some(scaled(1.0 / dot(v, v).sqrt(), v))
}

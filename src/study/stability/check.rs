//! An evaluator's answer held against the reference.

use super::case::{Batch, VertexInputs};
use super::evaluate::{Answer, Evaluator, Frame, Sums};
use super::hard::Holds;
use super::lights::LightBox;
use super::plain::Plain;
use super::reference::{FEW, MANY, Reference, SumReference, pair};
use crate::model::params::Param;
use crate::program::shading::ShadingError;

/// How an evaluator did: the worst of what it was asked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// The greatest deviation from f64, as a share of the number (of what rounding makes of it, where that is
    /// more).
    pub deviation: f64,
    /// The greatest share of what is allowed that a deviation took up.
    pub share: f64,
    /// What went wrong first, in words.
    pub failure: Option<String>,
    /// The fragment that it went wrong in, where it is one.
    pub at: Option<usize>,
}

impl Verdict {
    /// Nothing but a failure.
    #[must_use]
    pub fn failed(words: impl Into<String>) -> Self {
        Self { failure: Some(words.into()), ..Self::default() }
    }

    /// The worse of both.
    pub fn merge(&mut self, other: Self) {
        self.deviation = self.deviation.max(other.deviation);
        self.share = self.share.max(other.share);
        if self.failure.is_none() {
            (self.failure, self.at) = (other.failure, other.at);
        }
    }

    /// Take note of one number: what it is, what it should be, what is allowed, and beside what size.
    pub fn note(&mut self, number: Number, at: Option<usize>, what: impl Fn() -> String) {
        let Number { got, want, allowed, size } = number;
        let failure = if !got.is_finite() {
            Some(format!("{} is {got}; in f64 {want:e}", what()))
        } else {
            let off = (got - want).abs();
            self.deviation = self.deviation.max(off / size.abs().max(want.abs()).max(allowed).max(1e-18));
            self.share = self.share.max(if off == 0.0 { 0.0 } else { off / allowed.max(f64::MIN_POSITIVE) });
            (off > allowed).then(|| {
                format!("{} is {got:e} instead of {want:e}; rounding explains {allowed:.1e}", what())
            })
        };
        if failure.is_some() && self.failure.is_none() {
            (self.failure, self.at) = (failure, at);
        }
    }
}

/// A number beside the one that is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// The evaluator's.
    pub got: f64,
    /// The reference's.
    pub want: f64,
    /// How far it may be off.
    pub allowed: f64,
    /// The size that its deviation is a share of, where that is more than its own.
    pub size: f64,
}

const CHANNELS: [&str; 4] = ["red", "green", "blue", "alpha"];

/// Hold an evaluator's answer for a batch against the model in f64. What is off is looked at again beside
/// more moves of its inputs before it counts.
#[must_use]
pub fn check(evaluator: &dyn Evaluator, lights: &LightBox, batch: &Batch, holds: &[Holds]) -> Verdict {
    check_against(evaluator, lights, batch, holds, &Reference::new(lights, batch, FEW))
}

/// As [`check`], beside a reference that was made already.
#[must_use]
pub fn check_against(
    evaluator: &dyn Evaluator,
    lights: &LightBox,
    batch: &Batch,
    holds: &[Holds],
    reference: &Result<Reference, ShadingError>,
) -> Verdict {
    let reference = match reference {
        Ok(reference) => reference,
        Err(error) => return Verdict::failed(error.to_string()),
    };
    let answer = match evaluator.fragments(lights, batch) {
        Ok(answer) => answer,
        Err(words) => return Verdict::failed(words),
    };
    let slack = evaluator.slack();
    let verdict = compare(&answer, reference, slack, holds);
    if verdict.failure.is_none() {
        return verdict;
    }
    match Reference::new(lights, batch, MANY) {
        Ok(reference) => compare(&answer, &reference, slack, holds),
        Err(error) => Verdict::failed(error.to_string()),
    }
}

fn compare(answer: &Answer, reference: &Reference, slack: f64, holds: &[Holds]) -> Verdict {
    let mut verdict = Verdict::default();
    if let Some(values) = &answer.values {
        for (at, (value, wanted)) in values.iter().zip(&reference.fragments).enumerate() {
            for c in 0..4 {
                let allowed = slack * wanted.value_tolerance[c];
                let size = wanted.value_size[c];
                let number = Number { got: value[c], want: wanted.value[c], allowed, size };
                verdict.note(number, Some(at), || CHANNELS[c].to_owned());
            }
        }
    }
    if let Some(slopes) = &answer.slopes {
        for (at, (slope, wanted)) in slopes.iter().zip(&reference.fragments).enumerate() {
            for param in Param::built_in() {
                let (got, want) = (slope[param.index()], wanted.slopes[param.index()]);
                let sizes = wanted.slope_size[param.index()];
                for c in 0..4 {
                    let size = sizes[c];
                    let allowed = slack * wanted.slope_tolerance[param.index()][c];
                    let number = Number { got: got[c], want: want[c], allowed, size };
                    verdict.note(number, Some(at), || format!("d {} / d {}", CHANNELS[c], param.name()));
                }
            }
        }
    }
    if let Some(sums) = &answer.sums {
        compare_sums(sums, &reference.sums(), slack, &mut verdict);
    }
    for hold in holds {
        verdict.merge(held(*hold, answer, reference, slack));
    }
    verdict
}

fn compare_sums(sums: &Sums, wanted: &SumReference, slack: f64, verdict: &mut Verdict) {
    let equations = &sums.equations;
    let weight = equations.weight;
    let mut note = |what: String, got: f64, (want, allowed): (f64, f64), size: f64| {
        verdict.note(Number { got, want, allowed: slack * allowed, size }, None, || what.clone());
    };
    note("loss".to_owned(), equations.loss * weight, wanted.loss, 0.0);
    note("loss alone".to_owned(), sums.loss * weight, wanted.loss, 0.0);
    note("residual".to_owned(), equations.residual, wanted.residual, 0.0);
    let k = Param::COUNT;
    let diagonal = |a: usize| wanted.jtj[pair(a, a)].0.abs().sqrt();
    let root = wanted.residual.0.abs().sqrt();
    for (a, param) in Param::built_in().enumerate() {
        let size = diagonal(a) * root;
        note(format!("J^T r of {}", param.name()), equations.jtr[a], wanted.jtr[a], size);
        let gradient = sums.gradient[a] * weight / 2.0;
        note(format!("gradient by {}", param.name()), gradient, wanted.jtr[a], size);
        for (b, other) in Param::built_in().enumerate().skip(a) {
            let size = diagonal(a) * diagonal(b);
            let what = format!("J^T J of {} and {}", param.name(), other.name());
            let (upper, lower) = (equations.jtj[a * k + b], equations.jtj[b * k + a]);
            note(what, upper, wanted.jtj[pair(a, b)], size);
            if upper.to_bits() != lower.to_bits() {
                let what = format!("J^T J of {} and {}", other.name(), param.name());
                note(what, lower, wanted.jtj[pair(a, b)], size);
            }
        }
    }
}

/// What a case demands beyond agreement.
fn held(hold: Holds, answer: &Answer, reference: &Reference, slack: f64) -> Verdict {
    let mut verdict = Verdict::default();
    let values = answer.values.as_deref().unwrap_or_default();
    let fragments = &reference.fragments;
    let mut exact = |at: usize, got: f64, want: f64, what: &str| {
        if got != want && verdict.failure.is_none() {
            verdict.failure = Some(format!("{what} is {got:e}, not {want} to the bit"));
            verdict.at = Some(at);
        }
    };
    match hold {
        Holds::Zero => {
            for (at, value) in values.iter().enumerate() {
                value.iter().for_each(|&x| exact(at, x, 0.0, "the colour"));
            }
        }
        Holds::Flat(param) => {
            for (at, slopes) in answer.slopes.iter().flatten().enumerate() {
                let what = format!("the derivative by {}", param.name());
                slopes[param.index()].iter().for_each(|&x| exact(at, x, 0.0, &what));
            }
        }
        Holds::Value(wanted) => {
            for (at, (value, reference)) in values.iter().zip(fragments).enumerate() {
                for c in 0..4 {
                    let allowed = slack * reference.value_tolerance[c];
                    let number = Number { got: value[c], want: wanted[c], allowed, size: 0.0 };
                    verdict.note(number, Some(at), || format!("{} (as demanded)", CHANNELS[c]));
                }
            }
        }
        Holds::Alike(count) => {
            for (at, (value, reference)) in values.iter().zip(fragments).enumerate() {
                let first = at / count * count;
                for c in 0..4 {
                    let both = reference.value_tolerance[c] + fragments[first].value_tolerance[c];
                    let (size, want) = (reference.value_size[c], values[first][c]);
                    let number = Number { got: value[c], want, allowed: slack * both, size };
                    verdict.note(number, Some(at), || format!("{} beside its like", CHANNELS[c]));
                }
            }
        }
    }
    verdict
}

/// Hold an evaluator's vertex frames against the model's in f64: finite, of unit length, the same.
/// `None` when it has no vertex stage.
#[must_use]
pub fn check_frame(evaluator: &dyn Evaluator, vertex: VertexInputs) -> Option<Verdict> {
    let frames = match evaluator.frames(&[vertex]) {
        Ok(None) => return None,
        Ok(Some(frames)) => frames,
        Err(words) => return Some(Verdict::failed(words)),
    };
    let wanted = Plain::<f64>::new().frames(&[vertex]);
    let (Some(got), Ok(Some(wanted))) = (frames.first(), wanted) else {
        return Some(Verdict::failed("no frame"));
    };
    Some(compare_frames(got, &wanted[0], evaluator.slack()))
}

/// Some eight roundings of an f32 lie between a vertex and its frame. A difference of two parallel vectors
/// is none of the cases: those are replaced.
const FRAME: f64 = 1e-6;

fn compare_frames(got: &Frame, wanted: &Frame, slack: f64) -> Verdict {
    let mut verdict = Verdict::default();
    for i in 0..9 {
        let number = Number { got: got[i], want: wanted[i], allowed: slack * FRAME, size: 1.0 };
        verdict.note(number, None, || format!("{} of {}", ["x", "y", "z"][i % 3], ["N", "T", "B"][i / 3]));
    }
    for (i, name) in ["N", "T", "B"].into_iter().enumerate() {
        let square: f64 = got[3 * i..][..3].iter().map(|x| x * x).sum();
        let number = Number { got: square, want: 1.0, allowed: slack * FRAME, size: 1.0 };
        verdict.note(number, None, || format!("{name}'s squared length"));
    }
    verdict
}

//! A tape run for one sample, in any kind of number: f64 is what engines are held against.

use super::graph::{Binary, Input, LOOKUP_PARTS, Unary};
use super::tape::{Instruction, Slot, Tape, Test};
use crate::model::cube::Cube;
use crate::model::real::Real;

/// What a tape reads beside a sample: numbers that all samples share, and cubes.
#[derive(Debug)]
pub struct Shared<'a, R: Real> {
    /// [`Tape::uniform_values`], as numbers of the evaluator.
    pub uniforms: Vec<R>,
    /// The cubes of [`Tape::resources`].
    pub cubes: Vec<&'a Cube<R::Texel>>,
}

impl Tape {
    /// The outputs for one sample.
    pub fn run<R: Real>(&self, shared: &Shared<'_, R>, like: R, field: impl Fn(&Input) -> R) -> Vec<R> {
        let (zero, one) = (like.lit(0.0), like.lit(1.0));
        let mut registers = vec![zero; self.registers];
        let get = |registers: &[R], slot: Slot| match slot {
            Slot::Register(at) => registers[at],
            Slot::Uniform(at) => shared.uniforms[at],
        };
        for instruction in &self.instructions {
            let of = |slot| get(&registers, slot);
            let (value, out) = match *instruction {
                Instruction::Load(at, out) => (field(&self.fields[at]), out),
                Instruction::Unary(op, a, out) => (unary(op, of(a)), out),
                Instruction::Binary(op, a, b, out) => (binary(op, of(a), of(b)), out),
                Instruction::MultiplyAdd([a, b, c], out) => (of(a).mul_add(of(b), of(c)), out),
                Instruction::SubtractProduct([a, b, c], out) => ((-of(a)).mul_add(of(b), of(c)), out),
                Instruction::Select(test, yes, no, out) => {
                    let mask = match test {
                        Test::Less(a, b) => of(a).lt(of(b)),
                        Test::GreaterEqual(a, b) => of(a).ge(of(b)),
                        Test::IsFinite(a) => of(a).is_finite(),
                        Test::Holds(a) => of(a).ge(one.lit(0.5)),
                    };
                    (R::select(mask, of(yes), of(no)), out)
                }
                Instruction::Lookup(resource, [face, s, t], parts) => {
                    let found = look_up(shared.cubes[resource], of(face), of(s), of(t));
                    for (part, register) in parts.iter().enumerate() {
                        if let Some(at) = register {
                            registers[*at] = found[part];
                        }
                    }
                    continue;
                }
            };
            registers[out] = value;
        }
        self.outputs.iter().map(|&slot| get(&registers, slot)).collect()
    }
}

/// A bilinear lookup: four channels, how they move with s and how with t, a texel.
#[inline(always)]
pub fn look_up<R: Real>(cube: &Cube<R::Texel>, face: R, s: R, t: R) -> [R; LOOKUP_PARTS] {
    let at = cube.footprint_at(face.widen(), s.widen(), t.widen());
    let [value, across, down] = cube.sample_with_gradient(&at);
    let mut parts = [face; LOOKUP_PARTS];
    for c in 0..4 {
        parts[c] = R::narrow(value[c]);
        parts[4 + c] = R::narrow(across[c]);
        parts[8 + c] = R::narrow(down[c]);
    }
    parts
}

/// An operation on one number.
#[inline(always)]
pub fn unary<R: Real>(op: Unary, a: R) -> R {
    match op {
        Unary::Negate => -a,
        Unary::Abs => a.abs(),
        Unary::Sqrt => a.sqrt(),
        Unary::Reciprocal => a.recip(),
        Unary::Floor => a.floor(),
        Unary::Exp2 => a.exp2(),
        Unary::Log2 => a.log2(),
        Unary::IsFinite => R::select(a.is_finite(), a.lit(1.0), a.lit(0.0)),
    }
}

/// An operation on two numbers.
#[inline(always)]
pub fn binary<R: Real>(op: Binary, a: R, b: R) -> R {
    match op {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => a / b,
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
        Binary::Less => R::select(a.lt(b), a.lit(1.0), a.lit(0.0)),
        Binary::GreaterEqual => R::select(a.ge(b), a.lit(1.0), a.lit(0.0)),
    }
}

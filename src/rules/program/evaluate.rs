//! A tape run for one sample, in any kind of number: f64 is what engines are held against.

use super::graph::{Binary, Input, Native, Unary};
use super::native;
use super::tape::{CallOf, Instruction, Slot, Tape, Test};
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
        let mut at = 0;
        while let Some(instruction) = self.instructions.get(at) {
            at += 1;
            let of = |slot: &Slot| get(&registers, *slot);
            let (value, out) = match instruction {
                Instruction::Load(at, out) => (field(&self.fields[*at]), *out),
                Instruction::Unary(op, a, out) => (unary(*op, of(a)), *out),
                Instruction::Binary(op, a, b, out) => (binary(*op, of(a), of(b)), *out),
                Instruction::MultiplyAdd([a, b, c], out) => (of(a).mul_add(of(b), of(c)), *out),
                Instruction::SubtractProduct([a, b, c], out) => ((-of(a)).mul_add(of(b), of(c)), *out),
                Instruction::Select(test, yes, no, out) => {
                    let mask = match test {
                        Test::Less(a, b) => of(a).lt(of(b)),
                        Test::GreaterEqual(a, b) => of(a).ge(of(b)),
                        Test::IsFinite(a) => of(a).is_finite(),
                        Test::Holds(a) => of(a).ge(one.lit(0.5)),
                    };
                    (R::select(mask, of(yes), of(no)), *out)
                }
                Instruction::Call(call) => {
                    self.called(call, shared, &mut registers);
                    continue;
                }
                Instruction::Unit(call, flag, skip) => {
                    if self.called(call, shared, &mut registers) {
                        at += skip;
                    }
                    registers[*flag] = zero;
                    continue;
                }
                Instruction::Mend(mend) => {
                    for (part, fallback) in mend.parts.iter().zip(&mend.fallback) {
                        if let Some(part) = *part {
                            registers[part] = get(&registers, *fallback);
                        }
                    }
                    continue;
                }
            };
            registers[out] = value;
        }
        self.outputs.iter().map(|&slot| get(&registers, slot)).collect()
    }

    /// Run a call; whether it has a value of its own.
    fn called<R: Real>(&self, call: &CallOf, shared: &Shared<'_, R>, registers: &mut [R]) -> bool {
        let of = |slot: &Slot| match *slot {
            Slot::Register(at) => registers[at],
            Slot::Uniform(at) => shared.uniforms[at],
        };
        let cube = match call.native {
            Native::Lookup(resource) => shared.cubes.get(resource as usize).copied(),
            _ => None,
        };
        let arguments: Vec<R> = call.arguments.iter().map(of).collect();
        let along: Vec<Vec<R>> = call.along.iter().map(|d| d.iter().map(of).collect()).collect();
        let (value, slopes, found) = native::call(call.native, cube, &arguments, &along);
        let parts = call.parts.iter().chain(call.slopes.iter().flatten());
        for (register, number) in parts.zip(value.into_iter().chain(slopes.into_iter().flatten())) {
            if let Some(at) = *register {
                registers[at] = number;
            }
        }
        found
    }
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

//! A tape as the code of a machine that has an accumulator.
//!
//! Many numbers are used once, by the instruction after theirs: they stay in the accumulator, which the processor
//! keeps in its registers, and are never written to memory. What is used later is stored.

use crate::program::graph::{Binary, Native, Unary};
use crate::program::tape::{Instruction, Slot, Tape, Test};

/// Where an operand stands that all samples share.
pub(super) type Uniform = usize;
/// Where a number of each sample stands.
pub(super) type Register = usize;

/// One operation. The accumulator is A; x and y stand in registers (`R`) or are the same for all samples (`U`).
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "told above each group")]
pub(super) enum Op {
    /// A field into a register; A stays.
    Load(usize, Register),
    /// A is stored in a register; A stays.
    Store(Register),
    /// A is an output; A stays.
    Put(usize),
    // A = x
    SetR(Register),
    SetU(Uniform),
    // A = op A
    Negate,
    Abs,
    Sqrt,
    Reciprocal,
    Floor,
    IsFinite,
    // A = A op x
    AddR(Register),
    AddU(Uniform),
    SubtractR(Register),
    SubtractU(Uniform),
    MultiplyR(Register),
    MultiplyU(Uniform),
    DivideR(Register),
    DivideU(Uniform),
    MinR(Register),
    MinU(Uniform),
    MaxR(Register),
    MaxU(Uniform),
    LessR(Register),
    LessU(Uniform),
    GreaterEqualR(Register),
    GreaterEqualU(Uniform),
    // A = x - A, and so on
    FromR(Register),
    FromU(Uniform),
    UnderR(Register),
    UnderU(Uniform),
    // A = x y
    ProductRR(Register, Register),
    ProductRU(Register, Uniform),
    // A = A x + y
    MultiplyAddRR(Register, Register),
    MultiplyAddRU(Register, Uniform),
    MultiplyAddUR(Uniform, Register),
    MultiplyAddUU(Uniform, Uniform),
    // A = A + x y
    AddProductRR(Register, Register),
    AddProductRU(Register, Uniform),
    // A = A - x y
    SubtractProductRR(Register, Register),
    SubtractProductRU(Register, Uniform),
    // A = y - A x
    FromProductRR(Register, Register),
    FromProductRU(Register, Uniform),
    FromProductUR(Uniform, Register),
    FromProductUU(Uniform, Uniform),
    /// What needs all of the processor's registers, from memory to memory; A is lost.
    Heavy(Box<Heavy>),
    /// Unit vectors; A is lost. Where every sample has one, the operations after it are skipped, as many as the number
    /// says.
    Unit(Box<CallOf>, Register, usize),
}

/// An operation of its own kind. All operands are registers.
#[derive(Clone, Debug)]
pub(super) enum Heavy {
    Log2(Register, Register),
    Exp2(Register, Register),
    Select(Choice, [Register; 3], Register),
    Compare([Register; 4], bool, Register),
    Call(CallOf),
    Mend { flag: Register, parts: Vec<Option<Register>>, fallback: Vec<Register> },
}

/// What one number is asked.
#[derive(Clone, Copy, Debug)]
pub(super) enum Choice {
    IsFinite,
    Holds,
}

/// A call, as [`crate::program::tape::CallOf`].
#[derive(Clone, Debug)]
pub(super) struct CallOf {
    pub(super) native: Native,
    pub(super) arguments: [Register; 3],
    pub(super) along: Vec<[Register; 3]>,
    pub(super) parts: Vec<Option<Register>>,
    pub(super) slopes: Vec<Vec<Option<Register>>>,
}

/// The code of a tape.
#[derive(Debug, Default)]
pub(super) struct Code {
    pub(super) ops: Vec<Op>,
    /// Registers that hold what is the same for all samples, and which.
    pub(super) filled: Vec<(Register, Uniform)>,
    /// How many registers there are.
    pub(super) registers: usize,
    /// What the accumulator holds.
    held: Option<Register>,
}

impl Code {
    pub(super) fn new(tape: &Tape) -> Self {
        let reads = Reads::new(tape);
        let last: Vec<Option<usize>> =
            tape.outputs.iter().map(|&slot| last_in_accumulator(tape, slot)).collect();
        let mut code = Self { registers: tape.registers, ..Self::default() };
        // Units whose operations to be left out are not all written, and the instruction at which they are.
        let mut open: Vec<(usize, usize)> = Vec::new();
        for (at, instruction) in tape.instructions.iter().enumerate() {
            code.close(&mut open, at);
            if let Instruction::Unit(_, _, skip) = instruction {
                open.push((at + 1 + skip, code.ops.len()));
            }
            if let Some(out) = code.write(instruction) {
                code.held = Some(out);
                for (output, _) in last.iter().enumerate().filter(|(_, last)| **last == Some(at)) {
                    code.ops.push(Op::Put(output));
                }
                if reads.after(tape, at, out) {
                    code.ops.push(Op::Store(out));
                }
            }
        }
        code.close(&mut open, tape.instructions.len());
        // Outputs that never were in the accumulator.
        for (output, slot) in tape.outputs.iter().enumerate().filter(|(output, _)| last[*output].is_none()) {
            code.set(*slot);
            code.held = None;
            code.ops.push(Op::Put(output));
        }
        code
    }

    /// The register of an operand; what is the same for all samples gets one.
    fn register(&mut self, slot: Slot) -> Register {
        match slot {
            Slot::Register(at) => at,
            Slot::Uniform(uniform) => {
                let known = self.filled.iter().find(|filled| filled.1 == uniform).map(|filled| filled.0);
                known.unwrap_or_else(|| {
                    self.registers += 1;
                    self.filled.push((self.registers - 1, uniform));
                    self.registers - 1
                })
            }
        }
    }

    /// Tell the units whose last operation to be left out was written how many there are.
    fn close(&mut self, open: &mut Vec<(usize, usize)>, at: usize) {
        let count = self.ops.len();
        open.retain(|&(end, unit)| {
            if end == at
                && let Op::Unit(_, _, skip) = &mut self.ops[unit]
            {
                *skip = count - unit - 1;
            }
            end > at
        });
    }

    /// An instruction's operations; the register that the accumulator's number is meant for.
    fn write(&mut self, instruction: &Instruction) -> Option<Register> {
        let out = match instruction {
            Instruction::Load(field, out) => {
                self.ops.push(Op::Load(*field, *out));
                self.held = self.held.filter(|register| register != out);
                return None;
            }
            Instruction::Unary(op, a, out) => match op {
                Unary::Log2 | Unary::Exp2 => {
                    let a = self.register(*a);
                    let heavy = if *op == Unary::Log2 { Heavy::Log2 } else { Heavy::Exp2 };
                    self.heavy(heavy(a, *out));
                    return None;
                }
                _ => {
                    self.set(*a);
                    self.ops.push(match op {
                        Unary::Negate => Op::Negate,
                        Unary::Abs => Op::Abs,
                        Unary::Sqrt => Op::Sqrt,
                        Unary::Reciprocal => Op::Reciprocal,
                        Unary::Floor => Op::Floor,
                        _ => Op::IsFinite,
                    });
                    *out
                }
            },
            Instruction::Binary(op, a, b, out) => {
                self.binary(*op, *a, *b);
                *out
            }
            Instruction::MultiplyAdd([a, b, c], out) => {
                match position(self.held, [*a, *b, *c]) {
                    Some(0) => self.ops.push(multiply_add(*b, *c)),
                    Some(1) => self.ops.push(multiply_add(*a, *c)),
                    found => {
                        if found.is_none() {
                            self.set(*c);
                        }
                        let (x, y) = self.register_first(*a, *b);
                        self.ops.push(match y {
                            Slot::Register(y) => Op::AddProductRR(x, y),
                            Slot::Uniform(y) => Op::AddProductRU(x, y),
                        });
                    }
                }
                *out
            }
            Instruction::SubtractProduct([a, b, c], out) => {
                match position(self.held, [*a, *b, *c]) {
                    Some(0) => self.ops.push(from_product(*b, *c)),
                    Some(1) => self.ops.push(from_product(*a, *c)),
                    found => {
                        if found.is_none() {
                            self.set(*c);
                        }
                        let (x, y) = self.register_first(*a, *b);
                        self.ops.push(match y {
                            Slot::Register(y) => Op::SubtractProductRR(x, y),
                            Slot::Uniform(y) => Op::SubtractProductRU(x, y),
                        });
                    }
                }
                *out
            }
            Instruction::Select(test, yes, no, out) => {
                let mut of = |slot: &Slot| self.register(*slot);
                let (yes, no) = (of(yes), of(no));
                let heavy = match test {
                    Test::Less(a, b) => Heavy::Compare([of(a), of(b), yes, no], false, *out),
                    Test::GreaterEqual(a, b) => Heavy::Compare([of(a), of(b), yes, no], true, *out),
                    Test::IsFinite(a) => Heavy::Select(Choice::IsFinite, [of(a), yes, no], *out),
                    Test::Holds(a) => Heavy::Select(Choice::Holds, [of(a), yes, no], *out),
                };
                self.heavy(heavy);
                return None;
            }
            Instruction::Call(call) => {
                let call = self.call(call);
                self.heavy(Heavy::Call(call));
                return None;
            }
            Instruction::Unit(call, flag, _) => {
                let call = self.call(call);
                self.ops.push(Op::Unit(Box::new(call), *flag, 0));
                self.held = None;
                return None;
            }
            Instruction::Mend(mend) => {
                let fallback = mend.fallback.iter().map(|slot| self.register(*slot)).collect();
                self.heavy(Heavy::Mend { flag: mend.flag, parts: mend.parts.clone(), fallback });
                return None;
            }
        };
        Some(out)
    }

    fn heavy(&mut self, heavy: Heavy) {
        self.ops.push(Op::Heavy(Box::new(heavy)));
        self.held = None;
    }

    fn call(&mut self, call: &crate::program::tape::CallOf) -> CallOf {
        let mut three = |slots: &[Slot]| {
            let mut registers = [0; 3];
            slots.iter().zip(&mut registers).for_each(|(slot, to)| *to = self.register(*slot));
            registers
        };
        CallOf {
            native: call.native,
            arguments: three(&call.arguments),
            along: call.along.iter().map(|along| three(along)).collect(),
            parts: call.parts.clone(),
            slopes: call.slopes.clone(),
        }
    }

    /// Have an operand in the accumulator.
    fn set(&mut self, slot: Slot) {
        match slot {
            Slot::Register(at) if self.held == Some(at) => {}
            Slot::Register(at) => self.ops.push(Op::SetR(at)),
            Slot::Uniform(at) => self.ops.push(Op::SetU(at)),
        }
    }

    /// Two factors, of which the first is a register.
    fn register_first(&mut self, a: Slot, b: Slot) -> (Register, Slot) {
        match (a, b) {
            (Slot::Register(a), b) => (a, b),
            (a, Slot::Register(b)) => (b, a),
            (a, b) => (self.register(a), b),
        }
    }

    fn binary(&mut self, op: Binary, a: Slot, b: Slot) {
        use Binary as B;
        let mut found = position(self.held, [a, b]);
        if matches!(op, B::Less | B::GreaterEqual) {
            // There is no comparison with the accumulator on the right.
            found = found.filter(|operand| *operand == 0);
        }
        if op == B::Multiply && found.is_none() {
            let (x, y) = self.register_first(a, b);
            self.ops.push(match y {
                Slot::Register(y) => Op::ProductRR(x, y),
                Slot::Uniform(y) => Op::ProductRU(x, y),
            });
            return;
        }
        let swapped = found == Some(1);
        if !swapped {
            self.set(a);
        }
        let x = if swapped { a } else { b };
        self.ops.push(match (op, swapped, x) {
            (B::Add, _, Slot::Register(x)) => Op::AddR(x),
            (B::Add, _, Slot::Uniform(x)) => Op::AddU(x),
            (B::Multiply, _, Slot::Register(x)) => Op::MultiplyR(x),
            (B::Multiply, _, Slot::Uniform(x)) => Op::MultiplyU(x),
            (B::Min, _, Slot::Register(x)) => Op::MinR(x),
            (B::Min, _, Slot::Uniform(x)) => Op::MinU(x),
            (B::Max, _, Slot::Register(x)) => Op::MaxR(x),
            (B::Max, _, Slot::Uniform(x)) => Op::MaxU(x),
            (B::Subtract, false, Slot::Register(x)) => Op::SubtractR(x),
            (B::Subtract, false, Slot::Uniform(x)) => Op::SubtractU(x),
            (B::Subtract, true, Slot::Register(x)) => Op::FromR(x),
            (B::Subtract, true, Slot::Uniform(x)) => Op::FromU(x),
            (B::Divide, false, Slot::Register(x)) => Op::DivideR(x),
            (B::Divide, false, Slot::Uniform(x)) => Op::DivideU(x),
            (B::Divide, true, Slot::Register(x)) => Op::UnderR(x),
            (B::Divide, true, Slot::Uniform(x)) => Op::UnderU(x),
            (B::Less, _, Slot::Register(x)) => Op::LessR(x),
            (B::Less, _, Slot::Uniform(x)) => Op::LessU(x),
            (B::GreaterEqual, _, Slot::Register(x)) => Op::GreaterEqualR(x),
            (B::GreaterEqual, _, Slot::Uniform(x)) => Op::GreaterEqualU(x),
        });
    }
}

const fn multiply_add(x: Slot, y: Slot) -> Op {
    match (x, y) {
        (Slot::Register(x), Slot::Register(y)) => Op::MultiplyAddRR(x, y),
        (Slot::Register(x), Slot::Uniform(y)) => Op::MultiplyAddRU(x, y),
        (Slot::Uniform(x), Slot::Register(y)) => Op::MultiplyAddUR(x, y),
        (Slot::Uniform(x), Slot::Uniform(y)) => Op::MultiplyAddUU(x, y),
    }
}

const fn from_product(x: Slot, y: Slot) -> Op {
    match (x, y) {
        (Slot::Register(x), Slot::Register(y)) => Op::FromProductRR(x, y),
        (Slot::Register(x), Slot::Uniform(y)) => Op::FromProductRU(x, y),
        (Slot::Uniform(x), Slot::Register(y)) => Op::FromProductUR(x, y),
        (Slot::Uniform(x), Slot::Uniform(y)) => Op::FromProductUU(x, y),
    }
}

/// The operand that the accumulator holds, where it is one operand alone.
fn position<const N: usize>(held: Option<Register>, operands: [Slot; N]) -> Option<usize> {
    let mut found = (0..N).filter(|&k| held.is_some_and(|register| operands[k] == Slot::Register(register)));
    let first = found.next()?;
    found.next().is_none().then_some(first)
}

/// Who reads what an instruction writes.
struct Reads {
    /// For each instruction, the registers that it reads where they stand in memory.
    stored: Vec<Vec<usize>>,
}

impl Reads {
    fn new(tape: &Tape) -> Self {
        Self { stored: tape.instructions.iter().map(registers_read).collect() }
    }

    /// Whether the number that `at` writes to `register` is read by more than the accumulator holds it for.
    fn after(&self, tape: &Tape, at: usize, register: usize) -> bool {
        let mut held = true;
        for (k, instruction) in tape.instructions.iter().enumerate().skip(at + 1) {
            let count = self.stored[k].iter().filter(|&&read| read == register).count();
            if count > 0 && !(held && count == 1 && takes_accumulator(instruction, register)) {
                return true;
            }
            held &= matches!(instruction, Instruction::Load(..));
            if writes(instruction, register) {
                return false;
            }
        }
        // An output that is put while the accumulator holds it need not be stored as well.
        let output = Slot::Register(register);
        tape.outputs.contains(&output) && last_in_accumulator(tape, output).is_none()
    }
}

/// The instruction that leaves an output in the accumulator; `None` where none does.
fn last_in_accumulator(tape: &Tape, output: Slot) -> Option<usize> {
    let Slot::Register(register) = output else { return None };
    let mends = |i: &Instruction| matches!(i, Instruction::Mend(m) if m.parts.contains(&Some(register)));
    let at = tape.instructions.iter().rposition(|i| writes(i, register) || mends(i))?;
    match &tape.instructions[at] {
        Instruction::Unary(Unary::Log2 | Unary::Exp2, ..) => None,
        Instruction::Unary(..)
        | Instruction::Binary(..)
        | Instruction::MultiplyAdd(..)
        | Instruction::SubtractProduct(..) => Some(at),
        _ => None,
    }
}

/// Whether an instruction can read an operand from the accumulator.
fn takes_accumulator(instruction: &Instruction, register: Register) -> bool {
    match instruction {
        Instruction::Unary(op, ..) => !matches!(op, Unary::Log2 | Unary::Exp2),
        Instruction::Binary(Binary::Less | Binary::GreaterEqual, a, ..) => *a == Slot::Register(register),
        Instruction::Binary(..) | Instruction::MultiplyAdd(..) | Instruction::SubtractProduct(..) => true,
        _ => false,
    }
}

fn writes(instruction: &Instruction, register: usize) -> bool {
    match instruction {
        Instruction::Load(_, out)
        | Instruction::Unary(_, _, out)
        | Instruction::Binary(_, _, _, out)
        | Instruction::MultiplyAdd(_, out)
        | Instruction::SubtractProduct(_, out)
        | Instruction::Select(_, _, _, out) => *out == register,
        Instruction::Call(call) | Instruction::Unit(call, ..) => {
            call.parts.iter().chain(call.slopes.iter().flatten()).any(|&part| part == Some(register))
        }
        // It changes a number and does not end it.
        Instruction::Mend(_) => false,
    }
}

fn registers_read(instruction: &Instruction) -> Vec<usize> {
    let register = |slot: &Slot| match *slot {
        Slot::Register(at) => Some(at),
        Slot::Uniform(_) => None,
    };
    match instruction {
        Instruction::Load(..) => Vec::new(),
        Instruction::Unary(_, a, _) => register(a).into_iter().collect(),
        Instruction::Binary(_, a, b, _) => [a, b].into_iter().filter_map(register).collect(),
        Instruction::MultiplyAdd(x, _) | Instruction::SubtractProduct(x, _) => {
            x.iter().filter_map(register).collect()
        }
        Instruction::Select(test, yes, no, _) => {
            let asked = match test {
                Test::Less(a, b) | Test::GreaterEqual(a, b) => vec![a, b],
                Test::IsFinite(a) | Test::Holds(a) => vec![a],
            };
            asked.into_iter().chain([yes, no]).filter_map(register).collect()
        }
        Instruction::Call(call) | Instruction::Unit(call, ..) => {
            call.arguments.iter().chain(call.along.iter().flatten()).filter_map(register).collect()
        }
        Instruction::Mend(mend) => {
            let read = mend.fallback.iter().filter_map(register);
            read.chain(mend.parts.iter().flatten().copied()).chain([mend.flag]).collect()
        }
    }
}

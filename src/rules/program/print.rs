//! Tapes as Rust: what the compiler makes instructions of, once, where a machine would read a list again and again.
//!
//! The text is generic over [`Real`](crate::model::real::Real). Around it stand `lit(x)`, a constant; `u(k)`, a number
//! that all samples share, by its place in [`Tape::uniform_values`]; `own(m, k)`, the k-th of those that are member m's own;
//! `samples(k)`, field k of the tape; `kept(k)`, the k-th number that is kept; and `cubes`, those that are looked up. An output is left as soon as it is there: held to the end it
//! would take a register from everything behind it. And texels are asked for only where all of them are known: a processor
//! that works ahead then waits for many at once.

use std::fmt::Write as _;

use super::cut::KEPT;
use super::graph::{Binary, Native, Node, Unary};
use super::tape::{CallOf, Instruction, Mend, Operand, Rolled, Slot, Tape, Test};
use crate::shader::quantity::Resource;

/// A tape's instructions as statements, each line indented by `indent`, in which `put` says how an output of that number is
/// left, by its expression; empty where it says nothing. Also the outputs' expressions.
#[must_use]
pub fn statements(tape: &Tape, indent: &str, put: fn(usize, &str) -> String) -> (String, Vec<String>) {
    let differs = tape.graph.made_of(|graph, id| matches!(graph.node(id), Node::Uniform(_)));
    let constant = |operand: &Operand| match *operand {
        Operand::Of(id) | Operand::ReciprocalOf(id) | Operand::FlagOf(id) => !differs[id.index()],
    };
    // What is made of no input has the same value whatever they are.
    let values = tape.uniform_values(|_| 0.0);
    let constants =
        tape.uniforms.iter().zip(values).map(|(operand, value)| constant(operand).then_some(value)).collect();
    let mut printer = Printer {
        tape,
        constants,
        text: String::new(),
        indent: indent.to_owned(),
        ends: Vec::new(),
        rolled: tape.rolled.as_ref(),
        in_loop: false,
    };
    let outputs: Vec<String> = tape.outputs.iter().map(|slot| printer.slot(slot)).collect();
    let last = last_written(tape);
    let mut left = vec![false; outputs.len()];
    let ahead = looked_up_ahead(tape);
    for (at, instruction) in tape.instructions.iter().enumerate() {
        printer.close(at);
        if ahead.first() == Some(&at) {
            ahead.iter().enumerate().for_each(|(k, &lookup)| printer.footprint(&ahead[..k], lookup));
        }
        match printer.rolled.as_ref().map(|rolled| (rolled.range(), rolled.start + rolled.length)) {
            Some((range, behind)) if range.contains(&at) => {
                if at < behind {
                    printer.of_loop(at, instruction);
                }
                if at + 1 < range.end {
                    continue;
                }
            }
            _ => printer.instruction(at, instruction, ahead.contains(&at)),
        }
        for (k, slot) in tape.outputs.iter().enumerate() {
            let there = matches!(*slot, Slot::Register(register) if last[register] <= at);
            if there && !left[k] && printer.ends.iter().all(|&end| end == at + 1) {
                printer.close(at + 1);
                printer.put(&put(k, &outputs[k]));
                left[k] = true;
            }
        }
    }
    printer.close(tape.instructions.len());
    (0..outputs.len()).filter(|&k| !left[k]).for_each(|k| printer.put(&put(k, &outputs[k])));
    (printer.text, outputs)
}

/// Of each register the last instruction that writes it.
fn last_written(tape: &Tape) -> Vec<usize> {
    let mut last = vec![0; tape.registers];
    for (at, instruction) in tape.instructions.iter().enumerate() {
        written(instruction).for_each(|register| last[register] = at);
    }
    last
}

/// How many numbers that all samples share are each member's own in a tape's loop, where it has one.
#[must_use]
pub const fn own(tape: &Tape) -> Option<usize> {
    match &tape.rolled {
        Some(rolled) => Some(rolled.own),
        None => None,
    }
}

/// The registers that an instruction writes.
fn written(instruction: &Instruction) -> Box<dyn Iterator<Item = usize> + '_> {
    let of_call = |call: &'_ CallOf| {
        let registers = call.parts.iter().chain(call.slopes.iter().flatten()).flatten().copied();
        registers.collect::<Vec<_>>().into_iter()
    };
    match instruction {
        Instruction::Load(_, out)
        | Instruction::Unary(.., out)
        | Instruction::Binary(.., out)
        | Instruction::MultiplyAdd(_, out)
        | Instruction::SubtractProduct(_, out)
        | Instruction::Select(.., out) => Box::new(std::iter::once(*out)),
        Instruction::Call(call) => Box::new(of_call(call)),
        Instruction::Unit(call, flag, _) => Box::new(of_call(call).chain([*flag])),
        Instruction::Mend(mend) => Box::new(mend.parts.iter().flatten().copied()),
    }
}

/// The lookups whose places are known where the first one stands.
fn looked_up_ahead(tape: &Tape) -> Vec<usize> {
    let lookup = |instruction: &Instruction| match instruction {
        Instruction::Call(call) if matches!(call.native, Native::Lookup(_)) => Some(call.arguments.clone()),
        _ => None,
    };
    let Some(first) = tape.instructions.iter().position(|instruction| lookup(instruction).is_some()) else {
        return Vec::new();
    };
    let mut written_since = vec![false; tape.registers];
    let mut ahead = Vec::new();
    for (at, instruction) in tape.instructions.iter().enumerate().skip(first) {
        let known = |slot: &Slot| !matches!(*slot, Slot::Register(register) if written_since[register]);
        if lookup(instruction).is_some_and(|place| place.iter().all(known)) {
            ahead.push(at);
        }
        written(instruction).for_each(|register| written_since[register] = true);
    }
    ahead
}

struct Printer<'a> {
    tape: &'a Tape,
    /// The values of numbers that all samples share and that no input changes.
    constants: Vec<Option<f64>>,
    text: String,
    indent: String,
    /// The instructions before which blocks end that are seldom run.
    ends: Vec<usize>,
    rolled: Option<&'a Rolled>,
    /// Whether it prints the loop.
    in_loop: bool,
}

impl Printer<'_> {
    fn line(&mut self, line: &str) {
        let _ = writeln!(self.text, "{}{line}", self.indent);
    }

    fn close(&mut self, at: usize) {
        while self.ends.last() == Some(&at) {
            self.ends.pop();
            self.indent.truncate(self.indent.len() - 4);
            self.line("}");
        }
    }

    /// An instruction of a loop's first member, for every member.
    fn of_loop(&mut self, at: usize, instruction: &Instruction) {
        let Some(rolled) = self.rolled else { return };
        let names = |registers: &[usize]| {
            registers.iter().map(|register| format!("r{register}")).collect::<Vec<_>>().join(", ")
        };
        if at == rolled.start {
            let members = rolled.left.len();
            self.line(&format!("let mut made = [[lit(0.0); {}]; {members}];", rolled.left[0].len()));
            self.line(&format!("for m in 0..{members} {{"));
            self.indent.push_str("    ");
            self.in_loop = true;
        }
        self.instruction(at, instruction, false);
        if at + 1 == rolled.start + rolled.length {
            self.line(&format!("made[m] = [{}];", names(&rolled.left[0])));
            self.indent.truncate(self.indent.len() - 4);
            self.line("}");
            self.in_loop = false;
            for (member, left) in rolled.left.iter().enumerate() {
                self.line(&format!("let [{}] = made[{member}];", names(left)));
            }
        }
    }

    /// What reads a field; in a loop that of a member.
    fn load(&self, at: usize, field: usize) -> String {
        let of = |field: usize| {
            let input = &self.tape.fields[field];
            if input.name == KEPT { ("kept", input.component) } else { ("samples", field) }
        };
        let (from, place) = of(field);
        let Some(rolled) = self.rolled.filter(|_| self.in_loop) else { return format!("{from}({place})") };
        let of_member = |member: usize| match self.tape.instructions[at + member * rolled.length] {
            Instruction::Load(field, _) => of(field).1,
            _ => unreachable!("members' instructions are alike"),
        };
        let places: Vec<usize> = (0..rolled.left.len()).map(of_member).collect();
        format!("{from}({places:?}[m])")
    }

    /// How an output is left.
    fn put(&mut self, words: &str) {
        if !words.is_empty() {
            self.line(words);
        }
    }

    /// The texels of a lookup that stands further down: those of one `before` at the same place of faces of the same size, if
    /// there is one.
    fn footprint(&mut self, before: &[usize], at: usize) {
        let Some((place, cube)) = self.looked_up(at) else { return };
        let alike = |&&other: &&usize| {
            let there = self.looked_up(other);
            there.is_some_and(|(other, faces)| other == place && self.sized_alike(faces, cube))
        };
        let texels = match before.iter().find(alike) {
            Some(same) => format!("texels{same}"),
            None => format!("cubes[{cube}].footprint_at({})", self.slots(place)),
        };
        self.line(&format!("let texels{at} = {texels};"));
    }

    /// The place of a lookup, and which cube it is in.
    fn looked_up(&self, at: usize) -> Option<(&[Slot], usize)> {
        let Instruction::Call(call) = &self.tape.instructions[at] else { return None };
        let Native::Lookup(cube) = call.native else { return None };
        Some((&call.arguments, cube as usize))
    }

    fn sized_alike(&self, a: usize, b: usize) -> bool {
        let faces = |cube: usize| {
            let name = &self.tape.resources[cube];
            let known = Resource::BUILT_IN.into_iter().find(|known| known.name() == name);
            known.map(Resource::sized_as)
        };
        a == b || faces(a).is_some() && faces(a) == faces(b)
    }

    fn slot(&self, slot: &Slot) -> String {
        match *slot {
            Slot::Register(at) => format!("r{at}"),
            Slot::Uniform(at) => match self.constants[at] {
                Some(value) => format!("lit({value:?})"),
                None if self.in_loop && self.rolled.is_some_and(|rolled| at < rolled.own) => {
                    format!("own(m, {at})")
                }
                None => format!("u({at})"),
            },
        }
    }

    fn slots(&self, slots: &[Slot]) -> String {
        slots.iter().map(|slot| self.slot(slot)).collect::<Vec<_>>().join(", ")
    }

    fn instruction(&mut self, at: usize, instruction: &Instruction, ahead: bool) {
        let of = |slot: &Slot| self.slot(slot);
        let (expression, out) = match instruction {
            Instruction::Load(field, out) => (self.load(at, *field), out),
            Instruction::Unary(op, a, out) => (unary(*op, &of(a)), out),
            Instruction::Binary(op, a, b, out) => (binary(*op, &of(a), &of(b)), out),
            Instruction::MultiplyAdd([a, b, c], out) => {
                (format!("{}.mul_add({}, {})", of(a), of(b), of(c)), out)
            }
            Instruction::SubtractProduct([a, b, c], out) => {
                (format!("(-{}).mul_add({}, {})", of(a), of(b), of(c)), out)
            }
            Instruction::Select(test, yes, no, out) => {
                (format!("select({}, {}, {})", self.test(test), of(yes), of(no)), out)
            }
            Instruction::Call(call) => {
                call_lines(self, call, false, ahead.then_some(at));
                return;
            }
            Instruction::Unit(call, flag, skip) => {
                call_lines(self, call, true, None);
                self.line(&format!("let r{flag} = unit.has_direction;"));
                self.line("if !unit.all {");
                self.indent.push_str("    ");
                self.ends.push(at + 1 + skip);
                return;
            }
            Instruction::Mend(mend) => {
                self.mend(mend);
                return;
            }
        };
        self.line(&format!("let r{out} = {expression};"));
    }

    fn test(&self, test: &Test) -> String {
        let of = |slot: &Slot| self.slot(slot);
        match test {
            Test::Less(a, b) => format!("{}.lt({})", of(a), of(b)),
            Test::GreaterEqual(a, b) => format!("{}.ge({})", of(a), of(b)),
            Test::IsFinite(a) => format!("{}.is_finite()", of(a)),
            Test::Holds(a) => format!("{}.ge(lit(0.5))", of(a)),
        }
    }

    fn mend(&mut self, mend: &Mend) {
        for (part, fallback) in mend.parts.iter().zip(&mend.fallback) {
            if let Some(part) = part {
                let fallback = self.slot(fallback);
                self.line(&format!("r{part} = select(r{}, r{part}, {fallback});", mend.flag));
            }
        }
    }
}

fn unary(op: Unary, a: &str) -> String {
    match op {
        Unary::Negate => format!("-{a}"),
        Unary::Abs => format!("{a}.abs()"),
        Unary::Sqrt => format!("{a}.sqrt()"),
        Unary::Log2 => format!("{a}.log2()"),
        Unary::Exp2 => format!("{a}.exp2()"),
        Unary::Floor => format!("{a}.floor()"),
        Unary::Reciprocal | Unary::IsFinite => format!("unary(Unary::{op:?}, {a})"),
    }
}

fn binary(op: Binary, a: &str, b: &str) -> String {
    match op {
        Binary::Add => format!("{a} + {b}"),
        Binary::Subtract => format!("{a} - {b}"),
        Binary::Multiply => format!("{a} * {b}"),
        Binary::Divide => format!("{a} / {b}"),
        Binary::Min => format!("{a}.min({b})"),
        Binary::Max => format!("{a}.max({b})"),
        Binary::Less | Binary::GreaterEqual => format!("binary(Binary::{op:?}, {a}, {b})"),
    }
}

/// The registers of a call's parts, as a pattern.
fn parts(parts: &[Option<usize>], count: usize, mended: bool) -> String {
    let part = |k: usize| match parts.get(k).copied().flatten() {
        Some(register) if mended => format!("mut r{register}"),
        Some(register) => format!("r{register}"),
        None => "_".to_owned(),
    };
    (0..count).map(part).collect::<Vec<_>>().join(", ")
}

/// A call; of a lookup whose texels are known already, which these are.
fn call_lines(printer: &mut Printer<'_>, call: &CallOf, mended: bool, ahead: Option<usize>) {
    let arguments = printer.slots(&call.arguments);
    let along: Vec<(String, &Vec<Option<usize>>)> =
        call.along.iter().map(|d| printer.slots(d)).zip(&call.slopes).collect();
    match call.native {
        Native::Unit => {
            printer.line(&format!("let unit = Unit::new([{arguments}]);"));
            printer.line(&format!("let [{}] = unit.direction;", parts(&call.parts, 3, mended)));
            for (d, slopes) in along {
                printer.line(&format!("let [{}] = unit.along([{d}]);", parts(slopes, 3, false)));
            }
        }
        Native::Place => {
            printer.line(&format!("let point = CubePoint::of_unit([{arguments}]);"));
            printer.line(&format!("let [{}] = point.place();", parts(&call.parts, 3, false)));
            for (d, slopes) in along {
                printer.line(&format!("let [{}] = point.tangent([{d}]);", parts(slopes, 2, false)));
            }
        }
        Native::Lookup(resource) => {
            let value = parts(&call.parts, 4, false);
            printer.line(&format!("let cube = cubes[{resource}];"));
            printer.line(&match ahead {
                Some(lookup) => format!("let at = texels{lookup};"),
                None => format!("let at = cube.footprint_at({arguments});"),
            });
            match &along[..] {
                [] => printer.line(&format!("let [{value}] = cube.sample_at(&at);")),
                [(d, slopes)] => printer.line(&format!(
                    "let ([{value}], [{}]) = cube.sample_with_slope(&at, cube.texels([{d}]));",
                    parts(slopes, 4, false)
                )),
                several => {
                    printer.line("let [value, across, down] = cube.sample_with_gradient(&at);");
                    printer.line(&format!("let [{value}] = value;"));
                    for (d, slopes) in several {
                        let slopes = parts(slopes, 4, false);
                        printer.line(&format!("let [{slopes}] = along(cube.texels([{d}]), across, down);"));
                    }
                }
            }
        }
    }
}

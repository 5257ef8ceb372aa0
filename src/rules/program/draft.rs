//! Instructions whose registers are not yet known.

use super::graph::{Binary, Native, Unary};
use super::tape::{CallOf, Instruction, Mend, Operand, Slot, Test};

/// An instruction with operands in the place of slots.
pub(super) struct Draft {
    pub(super) kind: Kind,
    pub(super) reads: Vec<Operand>,
    pub(super) writes: Vec<Operand>,
}

/// What it does.
pub(super) enum Kind {
    Load(usize),
    Unary(Unary),
    Binary(Binary),
    MultiplyAdd,
    SubtractProduct,
    SelectLess,
    SelectGreaterEqual,
    SelectFinite,
    SelectHolds,
    /// The parts of the value, then of the slopes, that are written.
    Call {
        native: Native,
        along: usize,
        parts: Vec<usize>,
        skip: Option<usize>,
    },
    /// The parts that are mended.
    Mend(Vec<usize>),
}

impl Kind {
    /// The instruction that reads and writes there.
    pub(super) fn instruction(&self, reads: &[Slot], writes: &[usize]) -> Instruction {
        let out = writes.first().copied().unwrap_or(0);
        match (self, reads) {
            (&Kind::Load(field), _) => Instruction::Load(field, out),
            (&Kind::Unary(op), &[a]) => Instruction::Unary(op, a, out),
            (&Kind::Binary(op), &[a, b]) => Instruction::Binary(op, a, b, out),
            (Kind::MultiplyAdd, &[a, b, c]) => Instruction::MultiplyAdd([a, b, c], out),
            (Kind::SubtractProduct, &[a, b, c]) => Instruction::SubtractProduct([a, b, c], out),
            (Kind::SelectLess, &[a, b, yes, no]) => Instruction::Select(Test::Less(a, b), yes, no, out),
            (Kind::SelectGreaterEqual, &[a, b, yes, no]) => {
                Instruction::Select(Test::GreaterEqual(a, b), yes, no, out)
            }
            (Kind::SelectFinite, &[a, yes, no]) => Instruction::Select(Test::IsFinite(a), yes, no, out),
            (Kind::SelectHolds, &[a, yes, no]) => Instruction::Select(Test::Holds(a), yes, no, out),
            (Kind::Call { native, along, parts, skip }, _) => {
                called(*native, *along, parts, *skip, reads, writes)
            }
            (Kind::Mend(parts), [Slot::Register(flag), rest @ ..]) => {
                let mut registers = vec![None; 3];
                for (part, slot) in parts.iter().zip(rest) {
                    if let Slot::Register(at) = slot {
                        registers[*part] = Some(*at);
                    }
                }
                let fallback = rest[parts.len()..].to_vec();
                Instruction::Mend(Box::new(Mend { flag: *flag, parts: registers, fallback }))
            }
            _ => unreachable!("every kind reads as many operands as it is given"),
        }
    }
}

fn called(
    native: Native,
    along: usize,
    parts: &[usize],
    skip: Option<usize>,
    reads: &[Slot],
    writes: &[usize],
) -> Instruction {
    let widths = native.widths();
    let mut all = vec![None; widths.parts + along * widths.slopes];
    parts.iter().zip(writes).for_each(|(&part, &register)| all[part] = Some(register));
    let slopes = all.split_off(widths.parts);
    let call = Box::new(CallOf {
        native,
        arguments: reads[..native.hot()].to_vec(),
        along: reads[native.hot()..].chunks(widths.moving).map(<[Slot]>::to_vec).collect(),
        parts: all,
        slopes: slopes.chunks(widths.slopes).map(<[_]>::to_vec).collect(),
    });
    match (skip, writes.last()) {
        (Some(skip), Some(&flag)) => Instruction::Unit(call, flag, skip),
        _ => Instruction::Call(call),
    }
}

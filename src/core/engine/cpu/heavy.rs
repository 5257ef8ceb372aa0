//! The machine's operations from memory to memory: powers, choices, unit vectors, places and lookups.
//!
//! A function of its own for each call, so that the accumulator stays in the processor's registers.

use super::code::{CallOf, Choice, Heavy, Register};
use super::file::{File, Rows, WIDTH};
use super::streams::{load, store};
use crate::engine::lanes::Lanes;
use crate::model::cube::{Cube, CubePoint};
use crate::model::real::Real;
use crate::program::graph::Native;
use crate::program::native::Unit;
use crate::simd::Simd;

/// An operation from memory to memory. A function of its own, so that the accumulator stays in the processor's registers.
#[inline(never)]
pub(super) fn run_heavy<S: Simd>(simd: S, heavy: &Heavy, cubes: &[&Cube<f32>], file: &File) {
    simd.vectorize(
        #[inline(always)]
        || heavy_each(simd, heavy, cubes, file),
    );
}

#[inline(always)]
fn heavy_each<S: Simd>(simd: S, heavy: &Heavy, cubes: &[&Cube<f32>], file: &File) {
    let rows = |register: Register| &file.registers[register];
    macro_rules! each {
        ($out:expr, $i:ident => $value:expr) => {{
            let out = rows($out);
            for $i in 0..WIDTH {
                store(&out[$i], $value);
            }
        }};
    }
    match heavy {
        Heavy::Log2(a, out) => {
            let a = rows(*a);
            each!(*out, i => load(simd, &a[i]).log2());
        }
        Heavy::Exp2(a, out) => {
            let a = rows(*a);
            each!(*out, i => load(simd, &a[i]).exp2());
        }
        Heavy::Select(choice, [a, yes, no], out) => {
            let (a, yes, no) = (rows(*a), rows(*yes), rows(*no));
            let half = Lanes::splat(simd, 0.5);
            match choice {
                Choice::IsFinite => each!(*out, i => {
                    Lanes::select(load(simd, &a[i]).is_finite(), load(simd, &yes[i]), load(simd, &no[i]))
                }),
                Choice::Holds => each!(*out, i => {
                    Lanes::select(load(simd, &a[i]).ge(half), load(simd, &yes[i]), load(simd, &no[i]))
                }),
            }
        }
        Heavy::Compare([a, b, yes, no], or_equal, out) => {
            let (a, b, yes, no) = (rows(*a), rows(*b), rows(*yes), rows(*no));
            if *or_equal {
                each!(*out, i => {
                    let mask = load(simd, &a[i]).ge(load(simd, &b[i]));
                    Lanes::select(mask, load(simd, &yes[i]), load(simd, &no[i]))
                });
            } else {
                each!(*out, i => {
                    let mask = load(simd, &a[i]).lt(load(simd, &b[i]));
                    Lanes::select(mask, load(simd, &yes[i]), load(simd, &no[i]))
                });
            }
        }
        Heavy::Call(call) => match call.native {
            Native::Place => place(simd, call, file),
            Native::Lookup(resource) => look_up(simd, call, cubes[resource as usize], file),
            Native::Unit => {
                units(simd, call, None, file);
            }
        },
        Heavy::Mend { flag, parts, fallback } => {
            let (flag, half) = (rows(*flag), Lanes::splat(simd, 0.5));
            for (part, fallback) in parts.iter().zip(fallback) {
                if let Some(part) = part {
                    let (part_rows, fallback) = (rows(*part), rows(*fallback));
                    each!(*part, i => {
                        let there = load(simd, &flag[i]).ge(half);
                        Lanes::select(there, load(simd, &part_rows[i]), load(simd, &fallback[i]))
                    });
                }
            }
        }
    }
}

#[inline(always)]
fn three<S: Simd>(simd: S, rows: [&Rows; 3], i: usize) -> [Lanes<S>; 3] {
    [load(simd, &rows[0][i]), load(simd, &rows[1][i]), load(simd, &rows[2][i])]
}

#[inline(always)]
fn put<S: Simd, const N: usize>(rows: &[&Rows; N], i: usize, values: [Lanes<S>; N]) {
    for k in 0..N {
        store(&rows[k][i], values[k]);
    }
}

impl File {
    #[inline(always)]
    fn three(&self, [x, y, z]: [Register; 3]) -> [&Rows; 3] {
        [&self.registers[x], &self.registers[y], &self.registers[z]]
    }

    /// The registers of a call's parts; what nobody reads has one, too.
    #[inline(always)]
    fn parts<const N: usize>(&self, parts: &[Option<Register>]) -> [&Rows; N] {
        let mut found = [&self.registers[self.nobody]; N];
        for k in 0..N.min(parts.len()) {
            if let Some(register) = parts[k] {
                found[k] = &self.registers[register];
            }
        }
        found
    }
}

/// Unit vectors. Whether every sample has one; the flag says which.
#[inline(never)]
pub(super) fn units<S: Simd>(simd: S, call: &CallOf, flag: Option<Register>, file: &File) -> bool {
    simd.vectorize(
        #[inline(always)]
        || {
            let (v, out) = (file.three(call.arguments), file.parts::<3>(&call.parts));
            let flag = &file.registers[flag.unwrap_or(file.nobody)];
            let along = call.along.first().map(|d| (file.three(*d), file.parts::<3>(&call.slopes[0])));
            let mut all = true;
            for i in 0..WIDTH {
                let unit = Unit::new(three(simd, v, i));
                put(&out, i, unit.direction);
                if let Some((d, out)) = &along {
                    put(out, i, unit.along(three(simd, *d, i)));
                }
                for (d, slopes) in call.along.iter().zip(&call.slopes).skip(1) {
                    put(&file.parts::<3>(slopes), i, unit.along(three(simd, file.three(*d), i)));
                }
                all &= unit.all;
                let (one, zero) = (Lanes::splat(simd, 1.0), Lanes::splat(simd, 0.0));
                store(&flag[i], Lanes::select(unit.has_direction, one, zero));
            }
            all
        },
    )
}

#[inline(always)]
fn place<S: Simd>(simd: S, call: &CallOf, file: &File) {
    let (d, out) = (file.three(call.arguments), file.parts::<3>(&call.parts));
    let along = call.along.first().map(|d| (file.three(*d), file.parts::<2>(&call.slopes[0])));
    for i in 0..WIDTH {
        let point = CubePoint::of_unit(three(simd, d, i));
        put(&out, i, point.place());
        if let Some((d, out)) = &along {
            put(out, i, point.tangent(three(simd, *d, i)));
        }
        for (d, slopes) in call.along.iter().zip(&call.slopes).skip(1) {
            put(&file.parts::<2>(slopes), i, point.tangent(three(simd, file.three(*d), i)));
        }
    }
}

#[inline(always)]
fn look_up<S: Simd>(simd: S, call: &CallOf, cube: &Cube<f32>, file: &File) {
    let (place, out) = (file.three(call.arguments), file.parts::<4>(&call.parts));
    let along = |d: [&Rows; 3], i: usize| cube.texels([load(simd, &d[0][i]), load(simd, &d[1][i])]);
    match &call.along[..] {
        [] => {
            for i in 0..WIDTH {
                let [face, s, t] = three(simd, place, i);
                put(&out, i, cube.sample_at(&cube.footprint_at(face, s, t)));
            }
        }
        [d] => {
            let (d, slopes) = (file.three(*d), file.parts::<4>(&call.slopes[0]));
            for i in 0..WIDTH {
                let [face, s, t] = three(simd, place, i);
                let (value, slope) = cube.sample_with_slope(&cube.footprint_at(face, s, t), along(d, i));
                put(&out, i, value);
                put(&slopes, i, slope);
            }
        }
        several => {
            for i in 0..WIDTH {
                let [face, s, t] = three(simd, place, i);
                let [value, across, down] = cube.sample_with_gradient(&cube.footprint_at(face, s, t));
                put(&out, i, value);
                for (d, slopes) in several.iter().zip(&call.slopes) {
                    let [ds, dt] = along(file.three(*d), i);
                    let mut slope = value;
                    for c in 0..4 {
                        slope[c] = ds.mul_add(across[c], dt * down[c]);
                    }
                    put(&file.parts::<4>(slopes), i, slope);
                }
            }
        }
    }
}

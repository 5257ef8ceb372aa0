// Printed from the WGSL beside it by a test of `residual`. Do not edit.
//
// Each function takes the model's value, what was observed and the weight; it yields the loss, and what scales the row of
// the value's derivative and stands for the residual in it.

use crate::model::real::{Real, select};
use crate::program::evaluate::unary;
use crate::program::graph::Unary;

#[inline(always)]
pub(super) fn l2<R: Real>(given: [R; 3]) -> [R; 3] {
    let lit = |x: f64| given[0].lit(x);
    let samples = |k: usize| given[k];
    let r0 = samples(2);
    let r0 = r0.sqrt();
    let r1 = samples(0);
    let r2 = samples(1);
    let r2 = r1 - r2;
    let r2 = r0 * r2;
    let r1 = r2 * r2;
    [r1, r0, r2]
}

#[inline(always)]
pub(super) fn relative_l2<R: Real>(given: [R; 3]) -> [R; 3] {
    let lit = |x: f64| given[0].lit(x);
    let samples = |k: usize| given[k];
    let r0 = samples(2);
    let r1 = samples(0);
    let r2 = r1.min(lit(0.0));
    let r3 = samples(1);
    let r4 = r3.min(lit(0.0));
    let r5 = r2 - r4;
    let r5 = r5 * lit(10.0);
    let r2 = r2 - r3;
    let r6 = r4 - r3;
    let r6 = r2 + r6;
    let r6 = r6 * lit(10.0);
    let r2 = select(r1.lt(lit(0.0)), lit(0.0), r1);
    let r7 = select(r3.lt(lit(0.0)), lit(0.0), r3);
    let r8 = r2 - r7;
    let r9 = r8 * lit(0.5);
    let r7 = lit(0.1) + r7;
    let r2 = r2 + lit(0.1);
    let r10 = r2 * lit(0.5);
    let r10 = r7.mul_add(lit(0.5), r10);
    let r10 = r9 / r10;
    let r9 = r10.abs();
    let r11 = r10 * r10;
    let r12 = r11.mul_add(lit(0.06666667), lit(0.07692308));
    let r12 = r11.mul_add(r12, lit(0.09090909));
    let r12 = r11.mul_add(r12, lit(0.11111111));
    let r12 = r11.mul_add(r12, lit(0.14285715));
    let r12 = r11.mul_add(r12, lit(0.2));
    let r12 = r11.mul_add(r12, lit(0.33333334));
    let r12 = r11 * r12;
    let r12 = r10 * r12;
    let r7 = unary(Unary::Reciprocal, r7);
    let r11 = r2 * r7;
    let r11 = r11.log2();
    let r11 = r11 * lit(0.6931471805599453);
    let r11 = lit(0.5) * r11;
    let r11 = r11 - r10;
    let r11 = select(lit(0.25).ge(r9), r12, r11);
    let r2 = unary(Unary::Reciprocal, r2);
    let r8 = r8 * r2;
    let r10 = r8 * r10;
    let r10 = r11.mul_add(lit(2.0), r10);
    let r10 = lit(2.0) * r10;
    let r4 = r4 * lit(2.0);
    let r4 = r8 * r4;
    let r7 = r4 * r7;
    let r7 = r10 - r7;
    let r7 = r5.mul_add(r6, r7);
    let r7 = r0 * r7;
    let r0 = r0.sqrt();
    let r2 = r0 * r2;
    let r3 = r1 - r3;
    let r3 = r2 * r3;
    [r7, r2, r3]
}

#[inline(always)]
pub(super) fn huber<R: Real>(given: [R; 3]) -> [R; 3] {
    let lit = |x: f64| given[0].lit(x);
    let samples = |k: usize| given[k];
    let r0 = samples(2);
    let r1 = samples(0);
    let r2 = samples(1);
    let r2 = r1 - r2;
    let r1 = r2.abs();
    let r3 = r2 * r2;
    let r4 = r1 + r1;
    let r4 = r4 - lit(0.05);
    let r4 = lit(0.05) * r4;
    let r4 = select(lit(0.05).ge(r1), r3, r4);
    let r4 = r0 * r4;
    let r3 = r1.max(lit(0.05));
    let r3 = lit(0.05) / r3;
    let r3 = select(lit(0.05).ge(r1), lit(1.0), r3);
    let r3 = r0 * r3;
    let r3 = r3.sqrt();
    let r2 = r2 * r3;
    [r4, r3, r2]
}

#[inline(always)]
pub(super) fn smape<R: Real>(given: [R; 3]) -> [R; 3] {
    let lit = |x: f64| given[0].lit(x);
    let samples = |k: usize| given[k];
    let r0 = samples(2);
    let r1 = samples(0);
    let r2 = r1.abs();
    let r3 = samples(1);
    let r4 = r3.abs();
    let r5 = r2 + r4;
    let r5 = r5 + lit(0.01);
    let r5 = unary(Unary::Reciprocal, r5);
    let r6 = r1 - r3;
    let r7 = r6.abs();
    let r8 = r6 * r6;
    let r8 = r8 * lit(10000.0);
    let r8 = lit(0.0001) + r8;
    let r8 = r8 * lit(0.5);
    let r8 = select(lit(0.0001).ge(r7), r8, r7);
    let r8 = r5 * r8;
    let r9 = r0 * r8;
    let r10 = r5 * lit(0.5);
    let r11 = r7.max(lit(0.0001));
    let r11 = r10 / r11;
    let r11 = r0 * r11;
    let r11 = r11.sqrt();
    let r0 = select(r1.ge(lit(0.0)), lit(1.0), lit(-1.0));
    let r8 = r8 * r0;
    let r8 = (-lit(0.0001)).mul_add(r8, r6);
    let r0 = r6 * r0;
    let r3 = r1 * r3;
    let r4 = r2.min(r4);
    let r4 = select(r3.ge(lit(0.0)), r4, lit(0.0));
    let r4 = r4.mul_add(lit(2.0), lit(0.01));
    let r4 = r5 * r4;
    let r5 = r7.mul_add(r5, lit(1.0));
    let r5 = select(r0.ge(lit(0.0)), r4, r5);
    let r5 = r6 * r5;
    let r5 = select(lit(0.0001).ge(r7), r8, r5);
    let r5 = r11 * r5;
    [r9, r11, r5]
}

//! The machine against the tape that it runs, of graphs drawn at random.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::engine::cpu::program::Program;
use crate::engine::cpu::streams::BATCH;
use crate::program::evaluate::Shared;
use crate::program::graph::{Binary, Graph, Id, Input, Native, Unary};
use crate::program::tape::Tape;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::simd::{levels, name};
use crate::with_simd;

const FIELDS: usize = 4;
/// Two blocks, the second not full.
const RECORDS: usize = BATCH + 3;
const UNIFORMS: [f64; 2] = [0.75, -1.5];

/// A graph of operations drawn at random, of numbers of moderate size.
fn drawn(rng: &mut StdRng) -> (Graph, Vec<Id>) {
    let mut graph = Graph::default();
    let mut pool: Vec<Id> = (0..FIELDS).map(|k| graph.field("x", k)).collect();
    pool.extend((0..UNIFORMS.len()).map(|k| graph.uniform("u", k)));
    let one = graph.constant(1.0);
    pool.push(one);
    for _ in 0..rng.random_range(5..60) {
        let mut pick = || pool[rng.random_range(0..pool.len())];
        let (a, b, c) = (pick(), pick(), pick());
        let size = graph.unary(Unary::Abs, b);
        let above = graph.binary(Binary::Add, size, one);
        let made = match rng.random_range(0..14) {
            0 => graph.binary(Binary::Add, a, b),
            1 => graph.binary(Binary::Subtract, a, b),
            2 => graph.binary(Binary::Multiply, a, b),
            3 => graph.binary(Binary::Divide, a, above),
            4 => graph.binary(Binary::Min, a, b),
            5 => graph.binary(Binary::Max, a, b),
            6 => graph.binary(Binary::Less, a, b),
            7 => graph.binary(Binary::GreaterEqual, a, b),
            8 => {
                let less = graph.binary(Binary::Less, a, c);
                graph.select(less, b, c)
            }
            9 => graph.unary(Unary::Sqrt, above),
            10 => graph.unary(Unary::Log2, above),
            11 => {
                let product = graph.binary(Binary::Multiply, a, b);
                graph.binary(Binary::Add, product, c)
            }
            12 => {
                let product = graph.binary(Binary::Multiply, a, b);
                graph.binary(Binary::Subtract, c, product)
            }
            _ => {
                // Some vectors are 0: the fallback stands in, which may be made of anything.
                let unit = graph.call(Native::Unit, vec![a, b, a, c, b, one], Vec::new());
                // Never along itself: of a 0 that is a matter of roundings there is no direction to compare.
                let moved = graph.call(Native::Unit, vec![a, b, a, c, b, one], vec![c, a, above]);
                let turned = graph.call(Native::Place, unit.clone(), moved);
                pool.extend(&unit);
                turned[0]
            }
        };
        // Products of products would leave f32's range.
        let (low, high) = (graph.constant(-4.0), graph.constant(4.0));
        let raised = graph.binary(Binary::Max, made, low);
        pool.push(graph.binary(Binary::Min, raised, high));
    }
    let outputs = (0..5).map(|_| pool[rng.random_range(0..pool.len())]).collect();
    (graph, outputs)
}

#[test]
fn the_machine_computes_what_the_tape_says_of_graphs_drawn_at_random() {
    let mut rng = StdRng::seed_from_u64(8);
    let (mut compared, mut skipped) = (0, 0);
    for draw in 0..300 {
        let (graph, outputs) = drawn(&mut rng);
        let tape = Tape::new(&graph, &outputs);
        // A tenth of the samples are all 0; of others, no comparison is a matter of roundings.
        let mut rows = vec![Row::ZERO; FIELDS * RECORDS];
        for lane in 0..RECORDS * LANES {
            for field in 0..FIELDS {
                let number = rng.random_range(-2.0..2.0);
                let there = lane % 10 != 0;
                rows[lane / LANES * FIELDS + field][lane % LANES] = if there { number } else { 0.0 };
            }
        }
        let uniform = |input: &Input| UNIFORMS[input.component];
        let uniforms: Vec<f64> = tape.uniform_values(uniform);
        let shared = Shared { uniforms: uniforms.clone(), cubes: Vec::new() };
        // In f32 with numbers a little beside these, each by another share.
        let nudged = [0.0, 1e-6, -2e-6, 3e-6].map(|share: f32| {
            let beside =
                |input: &Input| uniform(input) * f64::from(1.0 + share * (5 + input.component) as f32);
            let uniforms = tape.uniform_values(beside).into_iter().map(|x| x as f32).collect();
            (share, Shared { uniforms, cubes: Vec::new() })
        });
        let loads: Vec<(StreamOf, usize)> =
            tape.fields.iter().map(|input| (StreamOf::Samples, input.component)).collect();
        let program = Program::new(tape.clone(), false);
        let uniforms: Vec<f32> = uniforms.into_iter().map(|x| x as f32).collect();
        for level in levels() {
            let (cubes, uniforms) = (Vec::new(), uniforms.clone());
            let bound = Bound { program: &program, level, loads: &loads, cubes, uniforms };
            let mut file = File::default();
            file.prepare(&bound);
            for first in (0..RECORDS).step_by(BATCH) {
                let count = BATCH.min(RECORDS - first);
                let streams = [Stream { rows: &rows, stride: FIELDS, skipped: 0 }];
                with_simd!(level, simd => run(simd, &bound, &file, &streams, first, count));
                for i in 0..count {
                    for lane in 0..LANES {
                        let field = |input: &Input| rows[(first + i) * FIELDS + input.component][lane];
                        let wanted = tape.run(&shared, 0.0_f64, |input| f64::from(field(input)));
                        let single: Vec<Vec<f32>> = nudged
                            .iter()
                            .map(|(share, shared)| {
                                let at = |input: &Input| {
                                    field(input) * (1.0 + share * (1 + input.component) as f32)
                                };
                                tape.run(shared, 0.0_f32, at)
                            })
                            .collect();
                        for (k, want) in wanted.into_iter().enumerate() {
                            // The direction of what is 0 but for roundings, for instance, is nothing to compare.
                            let sure =
                                |x: &Vec<f32>| (f64::from(x[k]) - want).abs() < 1e-4 * (1.0 + want.abs());
                            if !single.iter().all(sure) {
                                skipped += 1;
                                continue;
                            }
                            let got = f64::from(file.columns()[k][i].get()[lane]);
                            // Roundings of f32 over some sixty operations of slopes up to 4.
                            let close = (got - want).abs() <= 1e-3 * (1.0 + want.abs());
                            assert!(close, "{} graph {draw}, output {k}: {got} {want}", name(level));
                            compared += 1;
                        }
                    }
                }
            }
        }
    }
    assert!(skipped * 20 < compared, "{skipped} were not compared, and {compared} were");
}

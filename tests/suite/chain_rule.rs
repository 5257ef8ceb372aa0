//! The chain rule of every operator and function that rules may be written with: tangents beside central differences, in
//! f64. Most of the built-in rules multiply and add; a term of one's own may divide by what moves.

use skinfit::shader::tangent::Tangents;

use crate::by_rules::Function;

/// Expressions of `a` and `b`, all of whose components are positive, far from kinks.
const EXPRESSIONS: [&str; 35] = [
    "a + b",
    "a.x + b",
    "a - b",
    "a - b.y",
    "a * b",
    "a.x * b",
    "a / b",
    "a / b.z",
    "a.y / b",
    "1.5 / (a * b)",
    "-a",
    "abs(a - b)",
    "min(a, b)",
    "max(a, b)",
    "clamp(a * b, vec3f(0.1), b * 9.0)",
    "clamp(a, b, b * 1.6)",
    "clamp(a * b, a, vec3f(9.0))",
    "mix(a, b, vec3f(0.3))",
    "mix(a, b, a.zxy)",
    "fma(a, b, a.yzx)",
    "sqrt(a * b)",
    "inverseSqrt(a + b)",
    "exp(a - b)",
    "exp2(a - b)",
    "log(a + b)",
    "log2(a * b)",
    "fract(a * b)",
    "floor(a) * b",
    "cross(a, b)",
    "vec3f(dot(a, b))",
    "select(a * a, b * b, a < b)",
    "vec3f(a.xy, b.z) * b.zyx",
    "a * a * a / (b * b)",
    "sign(a - b) * a",
    "step(a, b) * b",
];

const A: [f64; 3] = [0.7, 1.3, 2.1];
const B: [f64; 3] = [1.9, 0.6, 1.4];
/// How they move.
const ALONG: [[f64; 3]; 2] = [[0.3, -0.8, 0.5], [-0.4, 0.9, 0.2]];
const STEP: f64 = 1e-5;

/// How many of the ways to move a function's arguments move it; its tangent along each is its central difference. Also the
/// tangents' text for the last way, along both.
fn compared(text: &str, words: &str) -> (usize, String) {
    let value = Function::new(&[text], "f", &[3, 3]);
    let (mut moved, mut written) = (0, String::new());
    for moving in [[true, false], [false, true], [true, true]] {
        let at = |by: f64| {
            let moved = |x: [f64; 3], k: usize| {
                let by = if moving[k] { by } else { 0.0 };
                [0, 1, 2].map(|c| x[c] + by * ALONG[k][c])
            };
            value.of(0.0, &[&moved(A, 0), &moved(B, 1)])
        };
        let (more, less) = (at(STEP), at(-STEP));
        let differences = more.iter().zip(&less).map(|(more, less)| (more - less) / (2.0 * STEP));
        let mut tangents = Tangents::new(text).unwrap();
        let slopes = match tangents.of("f", &moving).unwrap() {
            None => vec![0.0; 3],
            Some(tangent) => {
                let along: Vec<&[f64]> = (0..2).filter(|&k| moving[k]).map(|k| &ALONG[k][..]).collect();
                let arguments = [&[&A[..], &B[..]], &along[..]].concat();
                let of =
                    Function::new(&[text, tangents.text()], &tangent.name, &[3, 3, 3, 3][..arguments.len()]);
                moved += 1;
                of.of(0.0, &arguments)
            }
        };
        for (slope, difference) in slopes.into_iter().zip(differences) {
            // Numbers of up to 30 round to 4e-15, over a step of 2e-5; third derivatives of 100 add 2e-9.
            let close = (slope - difference).abs() < 1e-8 * (1.0 + difference.abs());
            assert!(close, "{words} along {moving:?}: {slope} {difference}");
        }
        tangents.text().clone_into(&mut written);
    }
    (moved, written)
}

#[test]
fn every_operations_tangent_is_its_central_difference() {
    let mut moved = 0;
    for expression in EXPRESSIONS {
        let text = format!("fn f(a: vec3f, b: vec3f) -> vec3f {{\n    return {expression};\n}}\n");
        moved += compared(&text, expression).0;
    }
    // All move along one of their arguments at the least, and all but a few along either.
    assert!(moved > 2 * EXPRESSIONS.len(), "{moved}");
}

#[test]
fn a_long_function_of_numbers_moves_by_its_partial_derivatives() {
    // A polynomial of degree 40 in x whose coefficients are y, as Horner has it.
    let polynomial = (1..=40).rev().fold("y".to_owned(), |sum, k| format!("y / {k}.0 + 0.3 * x * ({sum})"));
    let text = format!(
        "fn long(x: f32, y: f32) -> f32 {{\n    return {polynomial};\n}}\n
fn f(a: vec3f, b: vec3f) -> vec3f {{\n    return vec3f(long(a.x, b.y), long(a.y * b.z, 0.5), long(1.5, b.x * a.x));\n}}\n"
    );
    let (moved, written) = compared(&text, "a polynomial");
    assert_eq!(moved, 3);
    // One of each, whatever moves both arguments or one.
    for (name, times) in [("fn long_dc(", 1), ("fn long_cd(", 1), ("fn long_dd(", 0)] {
        assert_eq!(written.matches(name).count(), times, "{name} {written}");
    }
}

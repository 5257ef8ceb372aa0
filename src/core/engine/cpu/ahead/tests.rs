//! Plans that are compiled ahead: that what is compiled is what the rules print, and that it computes what the machine does.

use std::fmt::Write as _;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::bake::stacks::Stack;
use crate::engine::cpu::file::File;
use crate::engine::cpu::machine;
use crate::engine::cpu::pass::Tapes;
use crate::engine::cpu::program::{Bound, Program};
use crate::engine::cpu::streams::{BATCH, Stream, StreamOf};
use crate::model::cube::Cube;
use crate::program::cut::KEPT;
use crate::program::evaluate::Shared;
use crate::program::graph::Input;
use crate::program::print::own;
use crate::program::shading::ShadingError;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::shader::quantity::Resource;
use crate::shader::term::{self, LightFamily};
use crate::simd::{levels, name};

const HEAD: &str = "\
// Printed from the rules by the test beside it. Do not edit.
//
// Each function runs one tape over a block of records, a record's sixteen samples at a time, or (`R`) a part of them: `samples`
// are fields of stored samples, `kept` numbers that no free parameter moves, `u` numbers that all samples share, `own` those of
// them that are a light's own.

use super::super::block::{Block, along};
use super::super::streams::BATCH;
use crate::engine::lanes::Lanes;
use crate::engine::part::Part;
use crate::model::cube::CubePoint;
use crate::model::real::select;
use crate::program::evaluate::{binary, unary};
use crate::program::graph::{Binary, Unary};
use crate::program::native::Unit;
use crate::simd::Simd;
";

/// A tape as a function.
fn function(name: &str, tape: &Tape) -> String {
    let (statements, outputs, _) = printed(tape);
    let outputs = outputs.len();
    let kept = tape.fields.iter().filter(|field| field.name == KEPT).map(|field| field.component + 1).max();
    let (fields, uniforms) = (tape.fields.len(), tape.uniform_values(|_| 0.0).len());
    let mut text =
        format!("\n#[inline(never)]\nfn {name}<S: Simd, R: Part<S>>(simd: S, block: Block<'_>) {{\n");
    text.push_str("    simd.vectorize(\n        #[inline(always)]\n        || {\n");
    let mut line = |line: &str| {
        let _ = writeln!(text, "        {line}");
    };
    line("let lit = |x: f64| R::splat(simd, x as f32);");
    line(&format!("let numbers: &[f32; {uniforms}] = block.uniforms();"));
    line("let u = |k: usize| R::splat(simd, numbers[k]);");
    if let Some(own) = own(tape).filter(|own| *own > 0) {
        line(&format!("let of_members = numbers.as_chunks::<{own}>().0;"));
        line("let own = |m: usize, k: usize| R::splat(simd, of_members[m][k]);");
    }
    line(&format!("let fields = block.fields::<{fields}>();"));
    line("let cubes = block.cubes;");
    line(&format!("let Some(columns) = block.columns::<{outputs}>() else {{ return }};"));
    line("for i in 0..block.count.min(BATCH) {");
    line("    let at = block.begin(i);");
    if let Some(kept) = kept {
        line(&format!("    let rows = block.kept::<{kept}>(i);"));
    }
    line("    for part in 0..R::PARTS {");
    line("    let samples = |k: usize| -> R { block.number(simd, fields[k], at, part) };");
    line("    let put = |k: usize, i: usize, value: R| value.put(&columns[k][i], part);");
    if kept.is_some() {
        line("    let kept = |k: usize| R::of_part(simd, &rows[k], part);");
    }
    text.push_str(&statements);
    text.push_str("            }\n        }\n        },\n    );\n}\n");
    text
}

/// What a tape's function computes with: a part of a row where it has a loop, and so is long. Short ones have registers enough, and do in one go what
/// is the same for all samples.
const fn part(tape: &Tape) -> &'static str {
    if own(tape).is_some() { "R" } else { "Lanes<S>" }
}

fn all_tapes() -> String {
    let mut functions: Vec<(u64, String, String, &str)> = Vec::new();
    for (name, tape) in every_tape() {
        let key = printed(&tape).2;
        // A plan that keeps nothing, or two that keep the same.
        if !tape.outputs.is_empty() && functions.iter().all(|known| known.0 != key) {
            functions.push((key, function(&name, &tape), name, part(&tape)));
        }
    }
    let mut text = HEAD.to_owned();
    let _ = write!(text, "\npub(super) const KEYS: [u64; {}] = [\n", functions.len());
    functions.iter().for_each(|(key, ..)| text.push_str(&format!("    {key:#018x},\n")));
    text.push_str("];\n\n#[inline(always)]\n");
    text.push_str("pub(super) fn run<S: Simd, R: Part<S>>(tape: usize, simd: S, block: Block<'_>) {\n    match tape {\n");
    for (k, (.., name, part)) in functions.iter().enumerate() {
        let _ = writeln!(text, "        {k} => {name}::<S, {part}>(simd, block),");
    }
    text.push_str("        _ => {}\n    }\n}\n");
    functions.iter().for_each(|(_, function, ..)| text.push_str(function));
    text
}

#[test]
fn what_is_compiled_is_what_the_rules_say_today() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/engine/cpu/ahead/tapes.rs");
    let text = all_tapes();
    if std::env::var_os("SKINFIT_PRINT_PLANS").is_some() {
        std::fs::write(path, &text).unwrap();
    }
    let stale =
        "the rules have changed since their plans were printed: docs/building.md says how to print them anew";
    assert!(include_str!("tapes.rs") == text || std::fs::read_to_string(path).unwrap() == text, "{stale}");
}

/// The tapes of all plans.
fn every_tape() -> impl Iterator<Item = (String, Tape)> {
    every_tape_by(Tapes::printed)
}

fn every_tape_by(
    make: fn(&Plan, &Facts) -> Result<Tapes, ShadingError>,
) -> impl Iterator<Item = (String, Tape)> {
    term::library::register_all();
    for number in 1..=4 {
        term::light(LightFamily::SkyBeam, &format!("sky_{number}")).unwrap();
    }
    PLANS.iter().flat_map(move |plan| {
        let facts = plan.facts().unwrap();
        let tapes = make(plan, &facts).unwrap();
        [("keep", tapes.keep), ("value", tapes.value), ("moved", tapes.moved)]
            .map(|(part, tape)| (format!("{}_{part}", plan.name), tape))
    })
}

/// A number between 0.4 and 0.8 for each input that all samples share; the turn's are of a circle.
fn uniform(input: &Input) -> f64 {
    match (input.name.as_str(), input.component) {
        ("turn", 0) => 0.8,
        ("turn", _) => 0.6,
        (name, component) => {
            let sum: usize = name.bytes().map(usize::from).sum::<usize>() + 7 * component;
            0.4 + 0.004 * (sum % 101) as f64
        }
    }
}

#[test]
fn the_order_of_few_registers_changes_no_number() {
    let mut rng = StdRng::seed_from_u64(5);
    for ((name, printed), (_, plain)) in every_tape().zip(every_tape_by(Tapes::in_order_of_outputs)) {
        assert_eq!(printed.instructions.len(), plain.instructions.len(), "{name}");
        // What a loop leaves waits for its end.
        let fewer = printed.registers <= plain.registers || own(&printed).is_some();
        assert!(fewer, "{name}: {} {}", printed.registers, plain.registers);
        let cube: Cube<f64> = Cube::from_fn(2, |_, _, _| std::array::from_fn(|_| rng.random_range(0.1..1.0)));
        // Now and then a sample has no normal, and what stands in for unit vectors is asked for.
        for zeros in [0.0, 0.3, 1.0] {
            let fields: Vec<f64> = plain
                .fields
                .iter()
                .map(|_| if rng.random_bool(zeros) { 0.0 } else { rng.random_range(-0.9..0.9) })
                .collect();
            let place = |input: &Input| plain.fields.iter().position(|field| field == input).unwrap();
            let run = |tape: &Tape| {
                let shared = Shared {
                    uniforms: tape.uniform_values(uniform),
                    cubes: vec![&cube; tape.resources.len()],
                };
                let numbers = tape.run(&shared, 0.0_f64, |input| fields[place(input)]);
                numbers.into_iter().map(f64::to_bits).collect::<Vec<_>>()
            };
            assert_eq!(run(&printed), run(&plain), "{name} {zeros}");
        }
    }
}

#[test]
fn what_is_kept_looks_no_stack_up_that_a_free_parameter_moves() {
    for (name, tape) in every_tape() {
        let stacks = Stack::read(&tape.looked_up());
        // The lobe moves in some plans, the roughness in the lit one.
        let moves = name.starts_with("lit") || name.contains("lobe") || name.contains("all");
        if name.ends_with("_keep") && moves {
            assert!(stacks.is_empty(), "{name}: {stacks:?}");
        } else if name.ends_with("_value") && moves {
            assert!(!stacks.is_empty(), "{name}");
        }
    }
}

#[test]
fn a_plan_moves_the_lookups_that_a_fit_moves() {
    let weights = vec![Param::BaseWeight, Param::Hilite, Param::RimExponent];
    let fitted = |effects| {
        let mut fitted = Fitted::new(Setup::new(Corrected, Fragment, effects), Vec::new(), &[]);
        fitted.keep = true;
        fitted
    };
    let name =
        |effects, free: &[Param], turned| plan_for(&fitted(effects), free, turned).map(|plan| plan.name);
    let with = |more: &[Param]| [&weights[..], more].concat();
    assert_eq!(name(Effects::SURFACE, &weights, false), Some("surface"));
    assert_eq!(
        name(Effects::SURFACE.with(Effect::Skin), &with(&[P::SpecularLobe]), false),
        Some("surface_lobe")
    );
    // A held turn moves nothing: the machine keeps what a plan that turns would look up again and again.
    assert_eq!(name(Effects::SURFACE, &weights, true), None);
    assert_eq!(name(Effects::SURFACE, &with(ALL_MOVE), true), Some("surface_all"));
    assert_eq!(name(Effects::SURFACE.with(Effect::KeyLight), &weights, false), None);
    assert!(every_tape().count() > 0);
    let lit = PLANS.iter().find(|plan| plan.name == "lit_strength").unwrap();
    let mut fitted = Fitted::new(lit.setup().unwrap(), Vec::new(), &[]);
    fitted.keep = true;
    let named = |name| Param::from_name(name).unwrap();
    let of_lobe = [named("roughness"), named("gloss"), named("f0"), P::NormalStrength, P::BaseWeight];
    assert_eq!(plan_for(&fitted, &of_lobe, false).map(|plan| plan.name), Some("lit_strength"));
    let but_strength = [&of_lobe[..3], &of_lobe[4..]].concat();
    assert_eq!(plan_for(&fitted, &but_strength, false).map(|plan| plan.name), Some("lit"));
    // What moves with a lamp's colour is not yielded.
    assert!(plan_for(&fitted, &[P::NormalStrength, named("light.sky_1.color")], false).is_none());
}

#[test]
fn what_is_compiled_computes_what_the_tape_says() {
    let mut rng = StdRng::seed_from_u64(21);
    // A block that is not full, behind some records that are not asked for.
    let (first, count) = (3, BATCH - 3);
    for (of, tape) in every_tape() {
        let (fields, kept) = (tape.fields.len(), 64);
        let mut drawn = |rows: usize| -> Vec<Row> {
            (0..rows).map(|_| Row::of(std::array::from_fn(|_| rng.random_range(0.05..0.95)))).collect()
        };
        let (samples, keeps) = (drawn((first + count) * fields), drawn((first + count) * kept));
        // Faces are of one size only where they always are.
        let size = |name: &String| {
            let place = |of: Resource| Resource::BUILT_IN.into_iter().position(|known| known == of);
            let faces = Resource::BUILT_IN.into_iter().find(|known| known.name() == name).unwrap();
            3 + place(faces.sized_as()).unwrap()
        };
        let cubes: Vec<Cube<f64>> = tape
            .resources
            .iter()
            .map(|name| {
                Cube::from_fn(size(name), |_, _, _| std::array::from_fn(|_| rng.random_range(0.1..1.0)))
            })
            .collect();
        let narrow: Vec<Cube<f32>> = cubes.iter().map(|cube| cube.map(|t| t.map(|x| x as f32))).collect();
        let uniforms = tape.uniform_values(uniform);
        let shared = Shared { uniforms: uniforms.clone(), cubes: cubes.iter().collect() };
        let place = |input: &Input| tape.fields.iter().position(|field| field == input).unwrap();
        let loads: Vec<(StreamOf, usize)> = tape
            .fields
            .iter()
            .map(|input| match input.name.as_str() {
                KEPT => (StreamOf::Kept, input.component),
                _ => (StreamOf::Samples, place(input)),
            })
            .collect();
        let program = Program::new(tape.clone(), true);
        let uniforms: Vec<f32> = uniforms.into_iter().map(|x| x as f32).collect();
        let streams = [(&samples[..], fields), (&keeps[..], kept), (&[], 0), (&[], 0)]
            .map(|(rows, stride)| Stream { rows, stride, skipped: 0 });
        for level in levels() {
            let compiled = program.is_compiled(level) || tape.outputs.is_empty();
            assert_eq!(compiled, compiled_for(level) || tape.outputs.is_empty(), "{of}");
            let (cubes, uniforms) = (narrow.iter().collect(), uniforms.clone());
            let bound = Bound { program: &program, level, loads: &loads, cubes, uniforms };
            let mut file = File::default();
            file.prepare(&bound);
            with_simd!(level, simd => machine::run(simd, &bound, &file, &streams, first, count));
            for i in 0..count {
                // Of each record another two, at any place of a register.
                for lane in [i % LANES, (i + 7) % LANES] {
                    let number = |input: &Input| {
                        let (stream, place) = loads[place(input)];
                        let Stream { rows, stride, .. } = streams[stream as usize];
                        f64::from(rows[(first + i) * stride + place][lane])
                    };
                    for (k, want) in tape.run(&shared, 0.0_f64, number).into_iter().enumerate() {
                        let got = f64::from(file.columns()[k][i].get()[lane]);
                        // Roundings of f32 over hundreds of operations on the longest way; slopes between texels of up to 7 times
                        // their difference.
                        let close = (got - want).abs() <= 2e-4 * (1.0 + want.abs());
                        assert!(close, "{} {of}, output {k}: {got} {want}", name(level));
                    }
                }
            }
        }
    }
}

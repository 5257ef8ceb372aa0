//! A broken evaluator is told, and the same seed finds the same.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::case::{FragmentInputs, Setting, VertexInputs};
use super::check::check;
use super::engine_factory::EngineFactory;
use super::evaluate::{Answer, Frame, Sums};
use super::hard::cases;
use super::*;
use crate::engine::{Objective, Point, Task};
use crate::model::params::Param;

mod declared;

fn study(seed: u64, cases: usize) -> Study {
    Study { lights: LightBox::new(None), kept: Vec::new(), scenes: Vec::new(), seed, cases, pixels: 10_000 }
}

/// The model in f32 with one of its guards taken out.
struct Broken(fn(&FragmentInputs, &mut [f64; 4], &mut evaluate::Slopes));

impl Evaluator for Broken {
    fn name(&self) -> String {
        "broken".to_owned()
    }
    fn fragments(&self, lights: &LightBox, batch: &Batch) -> Result<Answer, String> {
        let mut answer = Plain::<f32>::new().fragments(lights, batch)?;
        let (values, slopes) = (answer.values.iter_mut().flatten(), answer.slopes.iter_mut().flatten());
        for ((inputs, value), slopes) in batch.fragments.iter().zip(values).zip(slopes) {
            (self.0)(inputs, value, slopes);
        }
        Ok(answer)
    }
    fn frames(&self, vertices: &[VertexInputs]) -> Result<Option<Vec<Frame>>, String> {
        Plain::<f32>::new().frames(vertices)
    }
}

/// An evaluator alone.
fn only(evaluator: impl Evaluator + Sync + 'static) -> Evaluators {
    Evaluators { shared: vec![Box::new(evaluator)], own: Vec::new() }
}

#[test]
fn sound_evaluators_pass_every_case() {
    let report = study(1, 600).run(&evaluators(), &|_| {});
    assert!(report.failures().is_empty(), "{:#?}\n{:#?}", report.failures(), report.found);
    assert!(report.hard.iter().all(|&count| count > 100), "{:?}", report.hard);
    assert!(report.random.iter().all(|tally| tally.tried == 600));
    // Of lights, three batches of 64, for engines alone.
    assert_eq!(report.lit.iter().map(|tally| tally.tried).collect::<Vec<_>>(), [0, 0, 192]);
    assert!(report.lit[2].worst.deviation > 0.0);
    // f32 is not f64: a deviation of exactly 0 would mean that nothing was compared.
    assert!(report.random[1].worst.deviation > 0.0 && report.random[2].worst.deviation > 0.0);
}

/// The CPU engine with a hundredth less light.
struct Dim;

impl EngineFactory for Dim {
    fn name(&self) -> String {
        "dim".to_owned()
    }
    fn with(&self, task: &Task, point: &Point, then: &mut dyn FnMut(&dyn Objective)) -> Result<(), String> {
        Cpu.with(task, point, then)
    }
    fn image(&self, task: &Task, point: &Point) -> Result<Vec<Vec<f32>>, String> {
        let mut planes = Cpu.image(task, point)?;
        planes.iter_mut().flatten().for_each(|x| *x *= 0.99);
        Ok(planes)
    }
}

#[test]
fn an_engine_whose_lights_are_dim_is_told_and_the_same_seed_tells_the_same() {
    let search = |seed| {
        let tallies =
            lit::search(&only(EngineEvaluator(Dim)), &LightBox::new(None), (seed, 8 * lit::CASES), &|_| {});
        assert_eq!(tallies[0].tried, 8 * 64);
        // Of batches that hardly any light reaches, rounding explains the rest.
        assert!(tallies[0].failed >= 2, "{}", tallies[0].failed);
        tallies[0].worst.failure.clone().unwrap()
    };
    let failure = search(5);
    assert!(
        failure.starts_with("batch ")
            && failure.contains(" of lights, ")
            && failure.contains("rounding explains"),
        "{failure}"
    );
    assert_eq!(search(5), failure);
    assert_ne!(search(6), failure);
}

#[test]
fn dim_lights_and_parameters_that_there_are_not_fail_a_named_case() {
    let (dim, sound) = (only(EngineEvaluator(Dim)), only(EngineEvaluator(Cpu)));
    let lights = LightBox::new(None);
    let failure = |evaluators: &Evaluators, case: &hard::HardLight| {
        let [Some(verdict)] = &lit::hard(evaluators, &lights, case)[..] else { panic!("one engine") };
        verdict.failure.clone()
    };
    let named = |name: &str| hard::lights().into_iter().find(|case| case.name == name).unwrap();
    let mut case = named("light that grazes");
    assert_eq!(failure(&sound, &case), None);
    assert!(failure(&dim, &case).unwrap().contains("rounding explains"));
    case.params.push(("no_such_parameter", 1.0));
    assert_eq!(failure(&sound, &case).unwrap(), "there is no parameter no_such_parameter");
}

/// What of an answer is tampered with.
#[derive(Clone, Copy, Debug)]
enum Part {
    Value,
    Slope(Param),
    Loss,
    LossAlone,
    Residual,
    Jtr(Param),
    Jtj(Param, Param),
    Gradient(Param),
}

/// And how.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// A hundredth more: a factor that is not quite right.
    Share,
    Sign,
    Nan,
}

const FAULTS: [Fault; 3] = [Fault::Share, Fault::Sign, Fault::Nan];

impl Fault {
    fn apply(self, x: &mut f64) {
        *x = match self {
            Self::Share => *x * 1.01,
            Self::Sign => -*x,
            Self::Nan => f64::NAN,
        };
    }
}

/// An evaluator whose answers have a fault wherever the batch has many fragments or one, as every batch does.
struct Faulty<E>(E, Part, Fault);

impl<E: Evaluator> Evaluator for Faulty<E> {
    fn name(&self) -> String {
        "faulty".to_owned()
    }
    fn fragments(&self, lights: &LightBox, batch: &Batch) -> Result<Answer, String> {
        let mut answer = self.0.fragments(lights, batch)?;
        let Answer { values, slopes, sums } = &mut answer;
        let fault = |x: &mut f64| self.2.apply(x);
        let sum = |get: &dyn Fn(&mut Sums) -> &mut f64, sums: &mut Option<Sums>| {
            fault(get(sums.as_mut().expect("an engine sums")));
        };
        match self.1 {
            Part::Value => values.iter_mut().flatten().for_each(|value| fault(&mut value[1])),
            Part::Slope(param) => {
                slopes.iter_mut().flatten().for_each(|slopes| fault(&mut slopes[param.index()][1]));
            }
            Part::Loss => sum(&|sums| &mut sums.equations.loss, sums),
            Part::LossAlone => sum(&|sums| &mut sums.loss, sums),
            Part::Residual => sum(&|sums| &mut sums.equations.residual, sums),
            Part::Jtr(param) => sum(&|sums| &mut sums.equations.jtr[param.index()], sums),
            Part::Jtj(a, b) => {
                sum(&|sums| &mut sums.equations.jtj[a.index() * Param::COUNT + b.index()], sums);
            }
            Part::Gradient(param) => sum(&|sums| &mut sums.gradient[param.index()], sums),
        }
        Ok(answer)
    }
}

/// What the study says of a batch that every term shows in.
fn said_of(evaluator: &dyn Evaluator) -> Option<String> {
    let views = [[0.375, -0.5, -0.75], [0.25, 0.125, -1.0], [-0.75, 0.5, -0.5], [0.625, 0.75, -0.25]];
    let fragment = |view| FragmentInputs { view, ..FragmentInputs::ORDINARY };
    let batch = Batch { setting: Setting::ordinary(), fragments: views.map(fragment).to_vec() };
    check(evaluator, &LightBox::new(None), &batch, &[]).failure
}

#[test]
fn a_value_a_slope_and_a_sum_that_are_wrong_are_each_found_and_named() {
    assert_eq!(said_of(&Plain::<f32>::new()), None);
    assert_eq!(said_of(&EngineEvaluator(Cpu)), None);
    let found = |evaluator: &dyn Evaluator, (part, fault): (Part, Fault), name: &str| {
        let words = said_of(evaluator).unwrap_or_else(|| panic!("{part:?}, {fault:?}: nothing is found"));
        assert!(words.starts_with(name), "{part:?}, {fault:?}: {words}");
        let nan = matches!(fault, Fault::Nan);
        assert_eq!(words.contains("NaN"), nan, "{part:?}, {fault:?}: {words}");
    };
    for fault in FAULTS {
        let model = |part, name: &str| found(&Faulty(Plain::<f32>::new(), part, fault), (part, fault), name);
        let engine =
            |part, name: &str| found(&Faulty(EngineEvaluator(Cpu), part, fault), (part, fault), name);
        model(Part::Value, "green is ");
        engine(Part::Value, "green is ");
        // The batch shows every parameter, so that each one's slope and sums can be wrong. Haze is in alpha alone.
        for param in Param::built_in().filter(|&param| param != Param::HazeWeight) {
            model(Part::Slope(param), &format!("d green / d {} is ", param.name()));
        }
        for param in Param::built_in() {
            engine(Part::Jtr(param), &format!("J^T r of {} is ", param.name()));
            engine(Part::Gradient(param), &format!("gradient by {} is ", param.name()));
            engine(Part::Jtj(param, param), &format!("J^T J of {0} and {0} is ", param.name()));
        }
        let (base, open) = (Param::BaseWeight, Param::Occlusion);
        engine(Part::Jtj(base, open), "J^T J of base_weight and occlusion is ");
        engine(Part::Jtj(open, base), "J^T J of occlusion and base_weight is ");
        engine(Part::Residual, "residual is ");
        engine(Part::Loss, "loss is ");
        engine(Part::LossAlone, "loss alone is ");
    }
}

#[test]
fn a_wrong_slope_and_a_wrong_sum_turn_the_whole_study_red() {
    let exponent = Param::RimExponent;
    let wrong: [(Evaluators, &str); 4] = [
        (
            only(Faulty(Plain::<f32>::new(), Part::Slope(exponent), Fault::Sign)),
            "d green / d rim_exponent is ",
        ),
        (
            only(Faulty(Plain::<f32>::new(), Part::Slope(exponent), Fault::Share)),
            "d green / d rim_exponent is ",
        ),
        (only(Faulty(EngineEvaluator(Cpu), Part::Jtr(exponent), Fault::Sign)), "J^T r of rim_exponent is "),
        (only(Faulty(EngineEvaluator(Cpu), Part::Loss, Fault::Share)), "loss is "),
    ];
    for (evaluators, words) in wrong {
        let report = study(2, 256).run(&evaluators, &|_| {});
        let failures = report.failures().join("\n");
        // Of one evaluator a limited number of failures is told, which the hard cases use up before the random search.
        for place in ["nearly facing", "parameter at a bound"] {
            let told = |line: &str| line.starts_with(place) && line.contains(words);
            assert!(failures.lines().any(told), "{place}: {words} is not told:\n{failures}");
        }
        assert!(report.text().contains("FAILED"));
    }
}

#[test]
fn every_guard_that_is_taken_out_turns_the_study_red() {
    // 0 / 0 where a normal is normalised unguarded; 0 times minus infinity where the logarithm of 0 is taken;
    // a view of no length; a derivative that overflows; a colour off by a thousandth.
    let guards: [(Broken, &[&str]); 5] = [
        (
            Broken(|f, value, _| {
                if f.texel == [0.5; 3] {
                    *value = [f64::NAN; 4];
                }
            }),
            &["texel that decodes to nothing", "random search"],
        ),
        (
            Broken(|f, _, slopes| {
                if f.silhouette == 0.0 {
                    slopes[Param::RimExponent.index()] = [f64::NAN; 4];
                }
            }),
            &["facing", "random search"],
        ),
        (
            Broken(|f, value, _| {
                if f.view == [0.0; 3] {
                    value[1] = f64::INFINITY;
                }
            }),
            &["eye on the surface", "random search"],
        ),
        (
            Broken(|f, _, slopes| {
                if f.normal.iter().all(|x| x.abs() < 1e-19) {
                    slopes[Param::NormalStrength.index()][2] = f64::INFINITY;
                }
            }),
            &["nearly no tangent frame", "random search"],
        ),
        (Broken(|_, value, _| value[0] += 1e-3 * value[0].abs()), &["grazing", "random search"]),
    ];
    for (broken, where_told) in guards {
        let report = study(2, 512).run(&only(broken), &|_| {});
        let failures = report.failures().join("\n");
        for place in where_told {
            assert!(failures.contains(place), "{place} is not told:\n{failures}");
        }
        assert!(!report.found.is_empty() && report.text().contains("FAILED"));
    }
}

fn fails_where_nothing_is_attenuated() -> Broken {
    Broken(|f, value, _| {
        if f.attenuator == 1.0 {
            value[3] = f64::NAN;
        }
    })
}

#[test]
fn a_failing_case_is_made_simple_and_stays_failing_when_it_is_read_back() {
    let broken = || only(fails_where_nothing_is_attenuated());
    let report = study(3, 256).run(&broken(), &|_| {});
    let found = report.found.first().expect("a case");
    let [fragment] = &found.batch.fragments[..] else { panic!("not simple: {found:?}") };
    // All but the number that it needs is ordinary.
    assert_eq!(*fragment, FragmentInputs { attenuator: 1.0, ..FragmentInputs::ORDINARY });
    let text = kept::to_toml(&report.found).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new_cases.toml");
    std::fs::write(&path, text).unwrap();
    let kept = kept::read(&path).unwrap();
    assert!(cases().iter().all(|case| case.batch.fragments.iter().all(|f| f.attenuator != 1.0)));
    let replayed = Study { kept, ..study(3, 0) }.run(&broken(), &|_| {});
    assert!(replayed.failures().iter().any(|line| line.starts_with("kept: found 1: broken: alpha is NaN")));
    let sound = Study { kept: kept::read(&path).unwrap(), ..study(3, 0) }.run(&evaluators(), &|_| {});
    assert!(sound.failures().is_empty(), "{:#?}", sound.failures());
}

#[test]
fn the_same_seed_finds_the_same_and_another_one_something_else() {
    let report = |seed| study(seed, 300).run(&evaluators(), &|_| {}).json().unwrap();
    assert_eq!(report(5), report(5));
    assert_ne!(report(5), report(6));
}

#[test]
fn any_number_of_threads_finds_the_same_and_tells_of_every_case() {
    // Failures in every batch, more than are kept, of one that all threads ask and of one that is its thread's own.
    let all_ask = || Evaluators {
        shared: vec![Box::new(Plain::<f32>::new()), Box::new(fails_where_nothing_is_attenuated())],
        own: vec![Box::new(Plain::<f64>::new())],
    };
    let its_own = || Evaluators {
        shared: vec![Box::new(Plain::<f32>::new())],
        own: vec![Box::new(fails_where_nothing_is_attenuated())],
    };
    let study = study(4, 2_000);
    for evaluators in [all_ask as fn() -> Evaluators, its_own] {
        let found = |threads: usize| {
            let told = AtomicUsize::new(0);
            let tell = |more| _ = told.fetch_add(more, Ordering::Relaxed);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let report = pool.install(|| study.run(&evaluators(), &tell));
            assert_eq!(told.into_inner(), study.steps(), "{threads} threads");
            assert!(
                report.random.iter().any(|tally| tally.failed > report.found.len()),
                "{:?}",
                report.random
            );
            (report.json().unwrap(), report.text(), kept::to_toml(&report.found).unwrap())
        };
        assert!(found(1) == found(4), "the report depends on the number of threads");
    }
}

#[test]
fn every_row_of_the_models_table_of_hard_cases_has_a_case() {
    let mut names: Vec<&str> = cases().iter().map(|case| case.name).collect();
    names.extend(hard::frames().iter().map(|frame| frame.name));
    names.extend(hard::lights().iter().map(|case| case.name));
    names.extend(DEMANDS.iter().map(|demand| demand.name));
    for name in [
        "facing",
        "grazing",
        "seen edge-on",
        "texel that decodes to nothing",
        "no tangent frame",
        "vertex without N and T",
        "65504 beside 0",
        "texel that is not finite",
        "edge of a cube",
        "corner of a cube",
        "nothing open",
        "nothing open under a key light",
        "target clipped at white",
        "target clipped at black",
        "parameter without a pixel",
        "empty mask",
        "all-zero target",
        "one pixel",
        "many pixels",
        "light that grazes",
        "view that grazes",
        "lobes and reflectances at their bounds",
        "light on the surface",
        "light that brings nothing, or a glare",
        "an environment of one constant, of none, of a glare",
    ] {
        assert!(names.contains(&name), "{name}");
    }
}

//! The witness against the oracle's vectors, and every evaluator against the witness.

use std::f64::consts::LN_2;

use nalgebra::{DMatrix, DVector};

use super::cube::Cube;
use super::fragment::{
    Constants, Form, Inputs, Lights, NAMES, Shaded, Silhouette, Surface, Variant, power, shade,
};
use super::losses::Loss;
use super::random::{by_channel, point, scene, scene_as, tied};
use super::scene::{At, Equations, Pixel, Sample, Scene, Unknown, View};
use crate::common;
use crate::evaluators::{self, Evaluator, Found, Width};
use crate::vectors::reader::{Node, Tolerance, Vectors};

// The oracle's vectors, in the witness' words.

/// The oracle's names of constants.
const ORACLE: [(&str, &str); 9] = [
    ("base_weight", "base_weight"),
    ("rim_weight", "rim_weight"),
    ("rim_exponent", "rim_exponent"),
    ("hilite", "hilite"),
    ("reflection", "reflection"),
    ("occlusion", "occlusion"),
    ("side_spec", "side_specular"),
    ("bump", "normal_strength"),
    ("haze", "haze_weight"),
];

/// The ten columns of the oracle's Jacobians.
const COLUMNS: [(&str, Unknown); 10] = [
    ("rim_weight_r", Unknown::Channel("rim_weight", 0)),
    ("rim_weight_g", Unknown::Channel("rim_weight", 1)),
    ("rim_weight_b", Unknown::Channel("rim_weight", 2)),
    ("rim_exponent", Unknown::Tied("rim_exponent")),
    ("hilite", Unknown::Tied("hilite")),
    ("reflection", Unknown::Tied("reflection")),
    ("occlusion", Unknown::Tied("occlusion")),
    ("side_spec", Unknown::Tied("side_specular")),
    ("bump", Unknown::Tied("normal_strength")),
    ("haze", Unknown::Tied("haze_weight")),
];

fn unknowns() -> Vec<Unknown> {
    COLUMNS.map(|(_, unknown)| unknown).to_vec()
}

fn constants(form: Form, given: &Node<'_>) -> Constants {
    let mut constants = Constants::defaults(form);
    for (theirs, ours) in ORACLE {
        if let Some(value) = given.get(theirs) {
            *constants.of(ours) = if value.is_list() { value.three() } else { [value.number(); 3] };
        }
    }
    constants
}

/// A point that is given column by column.
fn at_columns(given: &Node<'_>) -> At {
    let start = At { constants: Constants::defaults(Form::Corrected), gains: vec![[1.0; 3]] };
    COLUMNS.iter().fold(start, |at, (name, unknown)| unknown.set(&at, given.at(name).number()))
}

fn lights(vectors: &Vectors, file: &Node<'_>) -> Lights {
    let inputs = vectors.cubes(file);
    let size = inputs.at("size").number() as usize;
    let cube = |which: &str| Cube::of_numbers(size, &inputs.at(which).numbers());
    Lights { irradiance: cube("diffuse"), lobes: vec![(32.0, cube("spec"))], hilite: cube("hilite") }
}

fn inputs(file: &Node<'_>) -> Inputs {
    let given = file.at("inputs");
    let rows = ["X", "Y", "Z"].map(|row| given.at(&format!("WorldTanMatrix{row}")).three());
    let texel = given.at("normSideSpec");
    let silhouette = given.at("SkinSilhouetteVec");
    Inputs {
        texel: texel.three(),
        frame: [0, 1, 2].map(|i| [rows[0][i], rows[1][i], rows[2][i]]),
        view: given.at("WorldEyeDir").three(),
        open: silhouette.item(0).number(),
        silhouette: silhouette.item(2).number(),
        dapple: silhouette.item(3).number(),
        albedo: given.at("skinColor").three(),
        specular: texel.item(3).number(),
        attenuator: given.at("hiLightAttenuator").number(),
    }
}

/// The two readings that the fragments' files hold: their names, forms and silhouettes.
const READINGS: [(&str, Form, Silhouette); 2] =
    [("literal", Form::Listing, Silhouette::Vertex), ("corrected", Form::Corrected, Silhouette::Bumped)];

/// A scene of one pixel that is a fragment's file, against a black target.
fn fragment_scene(vectors: &Vectors, file: &Node<'_>, form: Form, silhouette: Silhouette) -> Scene {
    let surface = inputs(file).surface(form);
    let pixel = Pixel { samples: vec![Sample { share: 1.0, surface }], target: [0.0; 4], weight: 1.0 };
    let views = vec![View { pixels: vec![pixel], clip: None }];
    let variant = Variant::default();
    Scene { form, silhouette, variant, loss: Loss::L2, lights: lights(vectors, file), views }
}

/// The sixteen pixels of the bench, against an image.
fn bench_scene(vectors: &Vectors, file: &Node<'_>, target: &[f64]) -> Scene {
    let g = file.at("inputs").at("gbuffer");
    let pixel = |i: usize| {
        let (three, one) =
            (|name: &str| g.at(name).item(i).three(), |name: &str| g.at(name).item(i).number());
        let surface = Surface {
            base: three("A"),
            bump: three("B"),
            normal: three("A"),
            view: three("E"),
            open: one("o"),
            silhouette: 0.0,
            corners: [[0.0; 3], [1.0, 0.0, 0.0]],
            dapple: 1.0,
            albedo: three("c"),
            specular: one("p"),
            attenuator: one("a"),
        };
        let target = std::array::from_fn(|c| target[4 * i + c]);
        Pixel { samples: vec![Sample { share: 1.0, surface }], target, weight: 1.0 }
    };
    let views = vec![View { pixels: (0..16).map(pixel).collect(), clip: None }];
    Scene {
        form: Form::Corrected,
        silhouette: Silhouette::Bumped,
        variant: Variant::default(),
        loss: Loss::L2,
        lights: lights(vectors, file),
        views,
    }
}

/// What the oracle says of the bench at its start.
fn bench_equations(file: &Node<'_>) -> Equations {
    let want = file.at("expected").at("at_init");
    let loss = want.at("loss").wanted()[0];
    // A mean over 16 pixels of 4 channels.
    let weight = 64.0;
    Equations {
        loss,
        weight,
        residual: weight * loss,
        gradient: want.at("gradient").wanted(),
        jtr: want.at("Jtr").wanted(),
        jtj: want.at("JtJ").wanted(),
    }
}

/// Central differences of f64: see [`Unknown::step`].
const DIFFERENCES: Tolerance = Tolerance { abs: 2e-9, rel: 2e-9 };

#[test]
fn the_witness_shades_as_the_oracle_does() {
    let vectors = Vectors::read(&common::vectors());
    for file in vectors.of_kind("fragment") {
        let tolerance = file.vector.tolerances().double;
        for (name, form, silhouette) in READINGS {
            let want = file.at("expected").at(name);
            if want.is_null() {
                continue;
            }
            let constants = constants(form, &file.at("constants").at(name));
            let surface = inputs(&file).surface(form);
            let light = lights(&vectors, &file);
            let got = shade(form, silhouette, Variant::default(), &surface, &light, &constants);
            let Shaded { rgba, n, n_dot_v, rim, reflection, lookups } = got;
            tolerance.check("rgba", &rgba, &want.at("rgba"));
            tolerance.check("n", &n, &want.at("n"));
            tolerance.check("n.V", &[n_dot_v], &want.at("nDotV"));
            tolerance.check("reflection", &reflection, &want.at("reflVect"));
            if let Some(want) = want.get("rim") {
                tolerance.check("rim", &[rim], &want);
            }
            for (name, light) in ["D", "S_n", "S_r", "H"].into_iter().zip(lookups) {
                tolerance.check(name, &light, &want.at(name));
            }
        }
        let scene = fragment_scene(&vectors, &file, Form::Corrected, Silhouette::Bumped);
        let constants = constants(Form::Corrected, &file.at("constants").at("corrected"));
        let at = At { constants, gains: vec![[1.0; 3]] };
        let columns: Vec<Vec<f64>> = unknowns().iter().map(|&unknown| scene.column(unknown, &at)).collect();
        let rows: Vec<f64> = (0..4).flat_map(|c| columns.iter().map(move |column| column[c])).collect();
        DIFFERENCES.check("Jacobian", &rows, &file.at("expected").at("corrected_jacobian").at("J"));
    }
    let file = vectors.one("rim");
    let list = |name: &str| file.at("inputs").at(name).numbers();
    let (z, exponents) = (list("f"), list("exponent"));
    let got: Vec<f64> = z.iter().flat_map(|&z| exponents.iter().map(move |&p| power(z, p))).collect();
    file.vector.tolerances().double.check("rim", &got, &file.at("expected").at("rim"));
    let file = vectors.one("cube_sample");
    let light = lights(&vectors, &file);
    let along = |d: Node<'_>| light.lobes[0].1.along(d.three());
    let got: Vec<f64> = file.at("inputs").at("directions").items().into_iter().flat_map(along).collect();
    file.vector.tolerances().double.check("lookups", &got, &file.at("expected").at("seamless"));
}

#[test]
fn the_witness_gives_the_oracles_loss_gradient_and_normal_equations() {
    let vectors = Vectors::read(&common::vectors());
    let file = vectors.one("bench");
    let target = file.at("expected").at("forward").wanted();
    let scene = bench_scene(&vectors, &file, &target);
    let [truth, start] = ["params", "params_init"].map(|name| at_columns(&file.at("inputs").at(name)));
    let tolerance = file.vector.tolerances().double;
    tolerance.check("forward", &scene.image(&truth).concat().concat(), &file.at("expected").at("forward"));
    let got = scene.equations(&start, &unknowns());
    let want = file.at("expected").at("at_init");
    tolerance.check("forward", &scene.image(&start).concat().concat(), &want.at("forward"));
    tolerance.check("loss", &[got.loss], &want.at("loss"));
    DIFFERENCES.check("gradient", &got.gradient, &want.at("gradient"));
    // Over 64 residuals.
    DIFFERENCES.times(64.0).check("J^T r", &got.jtr, &want.at("Jtr"));
    DIFFERENCES.times(64.0).check("J^T J", &got.jtj, &want.at("JtJ"));
}

/// The closed-form fit of the oracle's noisy image: constants, covariance, sum of squares and condition, from normal
/// equations at its truth. (The image is linear in these constants.)
struct LinearFit {
    x: Vec<f64>,
    covariance: Vec<f64>,
    squares: f64,
    condition: f64,
}

fn linear_unknowns(file: &Node<'_>) -> Vec<Unknown> {
    let names = file.at("expected").at("linear_fit_of_noisy").at("names").items();
    let linear = COLUMNS
        .iter()
        .filter(|(_, u)| !matches!(u, Unknown::Tied("rim_exponent" | "occlusion" | "normal_strength")));
    let (oracle, ours): (Vec<&str>, Vec<Unknown>) = linear.copied().unzip();
    assert_eq!(names.len(), oracle.len());
    names.iter().zip(oracle).for_each(|(name, want)| name.assert_text(want));
    ours
}

fn linear_fit(at: &At, unknowns: &[Unknown], jtj: &[f64], jtr: &[f64], residual: f64) -> LinearFit {
    let k = unknowns.len();
    let hessian = DMatrix::from_row_slice(k, k, jtj);
    let inverse = hessian.clone().try_inverse().unwrap();
    let slope = DVector::from_column_slice(jtr);
    let step = -(&inverse * &slope);
    let squares = residual + slope.dot(&step);
    let eigenvalues = hessian.symmetric_eigenvalues();
    LinearFit {
        x: unknowns.iter().zip(step.iter()).map(|(u, step)| u.value(at) + step).collect(),
        covariance: (inverse * (squares / (64.0 - k as f64))).iter().copied().collect(),
        squares,
        // Of J itself, whose singular values are the roots.
        condition: (eigenvalues.max() / eigenvalues.min()).sqrt(),
    }
}

/// `share` is of a standard error, and what the sums' rounding leaves of products of them.
fn assert_linear_fit(got: &LinearFit, file: &Node<'_>, share: f64, what: &str) {
    let want = file.at("expected").at("linear_fit_of_noisy");
    let (x, covariance) = (want.at("x").wanted(), want.at("cov").wanted());
    let k = x.len();
    let error = |i: usize| covariance[i * k + i].sqrt();
    for i in 0..k {
        assert!((got.x[i] - x[i]).abs() <= share * error(i), "{what}: x[{i}] {} is not {}", got.x[i], x[i]);
        for j in 0..k {
            let (g, w) = (got.covariance[i * k + j], covariance[i * k + j]);
            assert!(
                (g - w).abs() <= share * error(i) * error(j),
                "{what}: covariance [{i}][{j}]: {g} is not {w}"
            );
        }
    }
    for (name, got) in [("rss", got.squares), ("cond", got.condition)] {
        let want = want.at(name).wanted()[0];
        assert!((got / want - 1.0).abs() <= share, "{what}: {name} {got} is not {want}");
    }
}

#[test]
fn every_number_of_the_bench_is_what_the_evaluators_give() {
    let vectors = Vectors::read(&common::vectors());
    bench_on(&vectors, &evaluators::on_cpu());
    fit_of_the_bench(&vectors);
}

#[test]
fn every_number_of_the_bench_is_what_the_evaluators_on_an_adapter_give() {
    bench_on(&Vectors::read(&common::vectors()), &evaluators::on_adapter());
}

/// Forward, loss, gradient, J^T r and J^T J at the start, and the fit of the noisy image.
pub(crate) fn bench_on(vectors: &Vectors, evaluators: &[Box<dyn Evaluator>]) {
    let file = vectors.one("bench");
    let clean = file.at("expected").at("forward").wanted();
    let noisy = file.at("inputs").at("noisy_target").numbers();
    let [truth, start] = ["params", "params_init"].map(|name| at_columns(&file.at("inputs").at(name)));
    let want = bench_equations(&file);
    let linear = linear_unknowns(&file);
    for evaluator in evaluators {
        let exact = (evaluator.computes(), evaluator.stores()) == (Width::Double, Width::Double);
        let tolerances = file.vector.tolerances();
        let tolerance = if exact { tolerances.double } else { tolerances.single };
        let scene = bench_scene(vectors, &file, &clean);
        let name = evaluator.name();
        let image = |at: &At| evaluator.image(&scene, at).concat().concat();
        tolerance.check(&name, &image(&truth), &file.at("expected").at("forward"));
        tolerance.check(&name, &image(&start), &file.at("expected").at("at_init").at("forward"));
        // Roundings of f64 through some hundred terms; of f32 as in `agrees`.
        let near = if exact { Near { share: 1e-12, least: 0.0 } } else { SINGLE };
        agrees(&evaluator.equations(&scene, &start, &unknowns()), &want, &unknowns(), near, &name);
        let found = evaluator.equations(&bench_scene(vectors, &file, &noisy), &truth, &linear);
        if let Some(normal) = found.normal {
            let got = linear_fit(&truth, &linear, &normal.jtj, &normal.jtr, normal.residual);
            // The condition is 68: roundings of J^T J are multiplied by its square, some 5000.
            let share = if exact { 1e-9 } else { 2e-3 };
            assert_linear_fit(&got, &file, share, &name);
        }
    }
}

/// The same fit by the library's solver, with its standard errors and correlations.
pub(crate) fn fit_of_the_bench(vectors: &Vectors) {
    let file = vectors.one("bench");
    let noisy = file.at("inputs").at("noisy_target").numbers();
    let [truth, start] = ["params", "params_init"].map(|name| at_columns(&file.at("inputs").at(name)));
    let linear = linear_unknowns(&file);
    // From the other start, but with the three constants that are not fitted at their true values.
    let held = ["rim_exponent", "occlusion", "normal_strength"].map(Unknown::Tied);
    let start = held.iter().fold(start, |at, unknown| unknown.set(&at, unknown.value(&truth)));
    let found = evaluators::fitted(&bench_scene(vectors, &file, &noisy), &start, &linear);
    let k = linear.len();
    let covariance =
        (0..k * k).map(|i| found.correlations[i] * found.std_errors[i / k] * found.std_errors[i % k]);
    let want = file.at("expected").at("linear_fit_of_noisy");
    let got = LinearFit {
        x: found.values.clone(),
        covariance: covariance.collect(),
        squares: 64.0 * found.loss,
        // The solver tells none.
        condition: want.at("cond").wanted()[0],
    };
    assert_linear_fit(&got, &file, 2e-3, "the solver");
}

#[test]
fn fragments_are_what_the_evaluators_give() {
    fragments_on(&Vectors::read(&common::vectors()), &evaluators::on_cpu());
}

#[test]
fn fragments_are_what_the_evaluators_on_an_adapter_give() {
    fragments_on(&Vectors::read(&common::vectors()), &evaluators::on_adapter());
}

/// Each fragment's colour and haze; in the corrected form its Jacobian too, by the loss, gradient and normal equations of
/// one pixel against black.
pub(crate) fn fragments_on(vectors: &Vectors, evaluators: &[Box<dyn Evaluator>]) {
    for file in vectors.of_kind("fragment") {
        for (name, form, silhouette) in READINGS {
            let want = file.at("expected").at(name);
            if want.is_null() {
                continue;
            }
            let scene = fragment_scene(vectors, &file, form, silhouette);
            let constants = constants(form, &file.at("constants").at(name));
            let at = At { constants, gains: vec![[1.0; 3]] };
            for evaluator in evaluators {
                let exact = (evaluator.computes(), evaluator.stores()) == (Width::Double, Width::Double);
                let tolerances = file.vector.tolerances();
                // WGSL asks of exp2, log2, division and roots a few units in the last place; four times f32's figure.
                let tolerance = if exact { tolerances.double } else { tolerances.single.times(4.0) };
                let what = evaluator.name();
                tolerance.check(&what, &evaluator.image(&scene, &at).concat().concat(), &want.at("rgba"));
                if form == Form::Corrected {
                    let want = fragment_equations(&file);
                    let near = if exact { Near { share: 1e-11, least: 0.0 } } else { ONE_PIXEL };
                    let found = evaluator.equations(&scene, &at, &unknowns());
                    agrees(&found, &want, &unknowns(), near, &format!("{} {what}", file.vector.name));
                }
            }
        }
    }
}

/// What the oracle's Jacobian says of one pixel against black.
fn fragment_equations(file: &Node<'_>) -> Equations {
    let expected = file.at("expected");
    let (rgba, j) = (expected.at("corrected").at("rgba").wanted(), expected.at("corrected_jacobian"));
    j.at("rows").assert_text("rgba");
    j.at("columns").items().iter().zip(COLUMNS).for_each(|(name, (want, _))| name.assert_text(want));
    let j = j.at("J").wanted();
    let rows: Vec<&[f64]> = j.chunks(10).collect();
    let jtr: Vec<f64> = (0..10).map(|k| (0..4).map(|c| rows[c][k] * rgba[c]).sum()).collect();
    let jtj = (0..100).map(|ab| rows.iter().map(|row| row[ab / 10] * row[ab % 10]).sum());
    let residual: f64 = rgba.iter().map(|x| x * x).sum();
    Equations {
        loss: residual / 4.0,
        weight: 4.0,
        residual,
        gradient: jtr.iter().map(|x| x / 2.0).collect(),
        jtr,
        jtj: jtj.collect(),
    }
}

// Every evaluator against the witness.

/// How near sums have to be: within a share of the largest that they could be, where a column of the Jacobian counts as
/// no shorter than `least` of the longest, or of 1.
#[derive(Clone, Copy, Debug)]
struct Near {
    share: f64,
    least: f64,
}

/// Of an evaluator in f32: a few hundred roundings of either sign. As the engines are held to the f64 reference.
const SINGLE: Near = Near { share: 1e-5, least: 0.0 };
/// Of an evaluator in f64: the cubes that stand between the stack's are rounded to f32, some 1e-7; the witness' central
/// differences are a hundred times better.
const DOUBLE: Near = Near { share: 1e-6, least: 0.0 };
/// Of one pixel, whose roundings do not average out: the vectors' absolute figure for f32, four times as WGSL has it, is
/// 8e-6 of the largest number, also where it is lost in a difference (a rim of 1e-7, the logarithm of 0.999).
const ONE_PIXEL: Near = Near { share: 4e-5, least: 0.2 };

/// Losses and sums are as near as that to what is wanted. The largest that an entry could be is the geometric mean of the
/// diagonal entries that share its row and column (Cauchy and Schwarz).
fn agrees(found: &Found, want: &Equations, unknowns: &[Unknown], near: Near, what: &str) {
    let k = unknowns.len();
    let close = |got: f64, want: f64, scale: f64, name: &dyn Fn() -> String| {
        // Below the last term nothing is left of either.
        let bound = near.share * scale + 1e-14;
        assert!((got - want).abs() <= bound, "{what}: {}: {got} is not {want} (bound {bound:e})", name());
    };
    for loss in &found.losses {
        close(*loss, want.loss, want.loss, &|| "loss".to_owned());
    }
    let longest = (0..k).map(|a| want.jtj[a * k + a].sqrt()).fold(1.0, f64::max);
    let norm = |a: usize| want.jtj[a * k + a].sqrt().max(near.least * longest);
    let root = want.residual.sqrt();
    assert_eq!(found.gradient.len(), k, "{what}");
    for a in 0..k {
        let scale = 2.0 * norm(a) * root / want.weight;
        close(found.gradient[a], want.gradient[a], scale, &|| format!("gradient of {}", unknowns[a].name()));
    }
    let Some(normal) = &found.normal else { return };
    close(normal.weight, want.weight, want.weight, &|| "weight".to_owned());
    close(normal.residual, want.residual, want.residual, &|| "r^T r".to_owned());
    for a in 0..k {
        close(normal.jtr[a], want.jtr[a], norm(a) * root, &|| format!("J^T r of {}", unknowns[a].name()));
        for b in 0..k {
            let name = || format!("J^T J of {} and {}", unknowns[a].name(), unknowns[b].name());
            close(normal.jtj[a * k + b], want.jtj[a * k + b], norm(a) * norm(b), &name);
        }
    }
}

/// What an evaluator found, as what another has to find.
fn as_wanted(found: &Found) -> Equations {
    let normal = found.normal.clone().unwrap();
    Equations {
        loss: found.losses[0],
        weight: normal.weight,
        residual: normal.residual,
        gradient: found.gradient.clone(),
        jtr: normal.jtr,
        jtj: normal.jtj,
    }
}

/// Evaluators against central differences of the witness, and against the first of them, over a list of scenes with the
/// unknowns of each.
fn against_the_witness(
    evaluators: &[Box<dyn Evaluator>],
    scenes: impl Iterator<Item = (Scene, Vec<Vec<Unknown>>)>,
) {
    let at = point(2);
    for (scene, sets) in scenes {
        for unknowns in sets {
            let want = scene.equations(&at, &unknowns);
            let image = scene.image(&at).concat().concat();
            let mut first: Option<Equations> = None;
            for evaluator in evaluators {
                let what = format!(
                    "{} ({:?}, {:?}, {:?}, {:?}, {} unknowns)",
                    evaluator.name(),
                    scene.form,
                    scene.silhouette,
                    scene.variant,
                    scene.loss,
                    unknowns.len()
                );
                let near = if evaluator.computes() == Width::Double { DOUBLE } else { SINGLE };
                let found = evaluator.equations(&scene, &at, &unknowns);
                agrees(&found, &want, &unknowns, near, &what);
                match &first {
                    Some(first) => {
                        agrees(&found, first, &unknowns, near, &format!("{what} against the first"));
                    }
                    None => first = found.normal.is_some().then(|| as_wanted(&found)),
                }
                for (got, want) in evaluator.image(&scene, &at).concat().concat().iter().zip(&image) {
                    assert!(
                        (got - want).abs() <= near.share * (1.0 + want.abs()),
                        "{what}: image: {got} is not {want}"
                    );
                }
            }
        }
    }
}

/// Both forms, three silhouettes, four losses; one and up to three samples a pixel in turn.
fn scenes() -> impl Iterator<Item = Scene> {
    let all = Form::ALL.into_iter().flat_map(|form| Silhouette::ALL.map(|silhouette| (form, silhouette)));
    let all = all.flat_map(|(form, silhouette)| Loss::ALL.map(|loss| (form, silhouette, loss)));
    all.enumerate().map(|(i, (form, silhouette, loss))| {
        let most = if (i / 8 + i / 4 + i) % 2 == 0 { 3 } else { 1 };
        scene(form, silhouette, loss, most, 1 + i as u64)
    })
}

#[test]
fn every_evaluator_without_an_adapter_meets_central_differences_of_the_witness() {
    against_the_witness(&evaluators::on_cpu(), scenes().map(|scene| (scene, vec![tied(2), by_channel(2)])));
}

#[test]
fn every_evaluator_on_an_adapter_meets_central_differences_of_the_witness() {
    // Shaders are compiled for each scene and set, which a software adapter takes seconds for: every form and silhouette
    // with two losses, every loss with three of them, and four scenes with a value a channel.
    let by = |(i, scene): (usize, Scene)| match i {
        4 | 9 | 19 | 22 => Some((scene, vec![by_channel(2)])),
        _ if (i / 4 + i) % 2 == 0 => Some((scene, vec![tied(2)])),
        _ => None,
    };
    against_the_witness(&evaluators::on_adapter(), scenes().enumerate().filter_map(by));
}

/// What another reading of the paper changes, alone and together, over two samples a pixel.
fn other_readings() -> impl Iterator<Item = Scene> {
    // A rotation's third row; no two of its numbers are alike.
    let axis = [0.48, -0.36, 0.8];
    let first = Variant::default();
    let smooth = Variant { smooth_lookups: true, ..first };
    let dappled = Variant { dapple_axis: Some(axis), ..first };
    let rim = Variant { interpolated_rim: true, ..first };
    let all = Variant { smooth_lookups: true, dapple_axis: Some(axis), interpolated_rim: true };
    let ways = [
        (smooth, Form::Corrected, Silhouette::Fragment),
        (smooth, Form::Corrected, Silhouette::Bumped),
        (smooth, Form::Listing, Silhouette::Fragment),
        (dappled, Form::Corrected, Silhouette::Fragment),
        (dappled, Form::Listing, Silhouette::Bumped),
        (rim, Form::Listing, Silhouette::Vertex),
        (all, Form::Listing, Silhouette::Vertex),
    ];
    (60..).zip(ways).map(|(seed, (variant, form, silhouette))| {
        scene_as(variant, (form, silhouette), Loss::RelativeL2, 2, seed)
    })
}

#[test]
fn other_readings_of_the_paper_meet_central_differences_of_the_witness() {
    let scenes = other_readings().map(|scene| (scene, vec![tied(2), by_channel(2)]));
    against_the_witness(&evaluators::on_cpu(), scenes);
}

#[test]
fn other_readings_of_the_paper_meet_central_differences_of_the_witness_on_an_adapter() {
    against_the_witness(&evaluators::on_adapter(), other_readings().map(|scene| (scene, vec![tied(2)])));
}

#[test]
fn gradients_are_the_slopes_of_the_evaluators_own_losses() {
    let at = point(2);
    for evaluator in evaluators::on_cpu() {
        // Rounding of the loss over a step, 1e-16 / 1e-6 in f64 and 1e-7 / 1e-3 in f32, both relative to losses far below
        // 1; and some hundredths of the lookups, whose slope is another at the step's end.
        let (step, share) = if evaluator.computes() == Width::Double { (1e-6, 1e-6) } else { (1e-3, 4e-3) };
        for silhouette in Silhouette::ALL {
            let scene = scene(Form::Corrected, silhouette, Loss::L2, 3, 40);
            let unknowns = tied(2);
            let found = evaluator.equations(&scene, &at, &unknowns);
            let normal = found.normal.unwrap();
            for (k, unknown) in unknowns.iter().enumerate() {
                let value = unknown.value(&at);
                // Between the stack's cubes texels are rounded to f32, whatever the evaluator computes in.
                let (h, share) = match unknown {
                    Unknown::Tied("specular_lobe") => (0.1, 1e-3),
                    _ if value.abs() > 10.0 => (step * value / 2.0, share),
                    _ => (step, share),
                };
                let loss = |by: f64| evaluator.equations(&scene, &unknown.moved(&at, by), &[]).losses[0];
                let slope = (loss(h) - loss(-h)) / (2.0 * h);
                let norm = normal.jtj[k * unknowns.len() + k].sqrt();
                let most = 2.0 * norm * normal.residual.sqrt() / normal.weight;
                let got = found.gradient[k];
                let what = format!("{} {silhouette:?} {}", evaluator.name(), unknown.name());
                assert!((got - slope).abs() <= share * most, "{what}: {got} is not {slope} (at most {most})");
            }
        }
    }
}

#[test]
fn the_witness_has_every_parameter_of_the_papers_model() {
    assert_eq!(evaluators::parameters(), NAMES, "the witness has to know what the tables have");
}

/// Losses of a model's value at a target, as one works them out by hand from docs/scene-files.md.
const LOSSES: [(Loss, f64, f64, f64); 12] = [
    (Loss::L2, 0.7, 0.2, 0.25),
    (Loss::L2, -0.1, 0.2, 0.09),
    // 2 (ln(p / q) + q / p - 1) of p = model + 0.1 and q = target + 0.1; below 0, 2 int (x - target) / 0.01 dx
    (Loss::RelativeL2, 0.3, 0.0, 4.0 * LN_2 - 1.5),
    (Loss::RelativeL2, 0.1, 0.3, 2.0 - 2.0 * LN_2),
    (Loss::RelativeL2, -0.1, 0.1, 5.0 - 2.0 * LN_2),
    // r^2 to 0.05, then 0.05 (2 |r| - 0.05)
    (Loss::Huber, 0.34, 0.3, 0.0016),
    (Loss::Huber, 0.0, 0.3, 0.0275),
    (Loss::Huber, 1.3, 0.3, 0.0975),
    // |r| / (|model| + |target| + 0.01)
    (Loss::Smape, 0.09, 0.0, 0.9),
    (Loss::Smape, 0.3, 0.69, 0.39),
    (Loss::Smape, -0.2, 0.29, 0.98),
    // (r^2 / 1e-4 + 1e-4) / 2 in place of |r| below 1e-4
    (Loss::Smape, 0.0, 0.0, 0.005),
];

#[test]
fn losses_have_the_constants_of_the_documents() {
    for (loss, model, target, want) in LOSSES {
        let weight = 0.5;
        let what = format!("{loss:?} of {model} at {target}");
        // A few roundings.
        let close = |got: f64, share: f64| {
            assert!((got - want).abs() <= share * (1.0 + want), "{what}: {got} is not {want}");
        };
        close(loss.of(model, target), 1e-14);
        // The relative loss' series has the digits of f32, and ends where f32 does.
        let double = if loss == Loss::RelativeL2 { 1e-8 } else { 1e-14 };
        close(evaluators::residual(0.0_f64, loss, None, [model, target, weight])[0] / weight, double);
        close(evaluators::residual(0.0_f32, loss, None, [model, target, weight])[0] / weight, 1e-6);
    }
}

#[test]
fn losses_slopes_and_weights_are_the_witnesses_on_both_sides_of_every_corner() {
    // Numbers of f32, as ends of a clip are.
    let targets = [0.0, 0.03125, 0.25, 0.875];
    let offsets = [0.0, 3e-5, 9e-5, 1.1e-4, 1e-3, 0.049, 0.051, 0.4, 3.0];
    for loss in Loss::ALL {
        for target in targets {
            for offset in offsets.into_iter().chain(offsets.map(|x| -x)) {
                let (model, weight) = (target + offset, 0.5);
                let got = evaluators::residual(0.0_f64, loss, None, [model, target, weight]);
                let want = [
                    weight * loss.of(model, target),
                    weight * loss.slope(model, target),
                    weight * loss.reweight(model, target),
                ];
                for (i, (got, want)) in got.into_iter().zip(want).enumerate() {
                    let what = ["loss", "slope", "weight"][i];
                    // Differences over 1e-9 and more of numbers that are to 1e-16: of the parabola's a thousandth of it.
                    let bound = 2e-6 * (1.0 + want.abs());
                    assert!(
                        (got - want).abs() <= bound,
                        "{loss:?} {target} {offset}: {what} {got} is not {want}"
                    );
                }
                let [low, high] = [(target, 10.0), (-10.0, target)].map(|(low, high)| {
                    evaluators::residual(0.0_f64, loss, Some([low, high]), [model, target, weight])
                });
                // At the lower end only what is too bright counts, at the upper only what is too dark.
                assert_eq!(low, if offset <= 0.0 { [0.0; 3] } else { got }, "{loss:?} {target} {offset}");
                assert_eq!(high, if offset >= 0.0 { [0.0; 3] } else { got }, "{loss:?} {target} {offset}");
            }
        }
    }
}

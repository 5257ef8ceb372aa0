//! Joint fits by the library: engines of several scenes as one objective.

use std::path::Path;

use skinfit::engine::joint::Joint;
use skinfit::engine::{Engine, Objective, Point};
use skinfit::fit::outcome::{Ending, Outcome};
use skinfit::fit::{FitOptions, fit};
use skinfit::model::params::Param;
use skinfit::prepare::{Observed, PrepareOptions};

use crate::cli::sandbox::{SCENE, Sandbox};

/// A scene of a small folder whose light, targets and free parameters `change` may have changed.
fn observed(sandbox: &Sandbox, name: &str, change: impl Fn(&str) -> String) -> Observed {
    sandbox.write(name, change(SCENE).as_bytes());
    let cache = Some(Path::new(sandbox.cache()).to_owned());
    Observed::new(&sandbox.path(name), &PrepareOptions { cache, ..PrepareOptions::default() }).unwrap()
}

fn joint(scenes: &[&Observed]) -> (Joint, Point) {
    let engine = |scene: &&Observed| Box::new(scene.engine().unwrap()) as Box<dyn Engine>;
    let starts: Vec<Point> = scenes.iter().map(|scene| scene.start()).collect();
    let engines = scenes.iter().map(engine).collect();
    (Joint::new(engines).unwrap(), Joint::start(&starts).unwrap())
}

fn fitted(objective: &dyn Objective, start: &Point, widths: Vec<usize>) -> Outcome {
    let outcome =
        fit(objective, start, &FitOptions { widths, ..FitOptions::default() }, &mut |_| {}).unwrap();
    assert_eq!(outcome.ending, Ending::Converged);
    outcome
}

/// Held at a wrong value, so that residuals are more than roundings.
fn without_exponent(scene: &str) -> String {
    scene.replace("\"rim_exponent\", ", "")
}

#[test]
fn a_scene_with_itself_has_the_same_answer_and_errors_of_twice_as_many_pixels() {
    let sandbox = Sandbox::new();
    let scene = observed(&sandbox, "one.toml", without_exponent);
    let engine = scene.engine().unwrap();
    let alone = fitted(&engine, &scene.start(), scene.image_widths());
    let (both, start) = joint(&[&scene, &scene]);
    let both_widths = [scene.image_widths(), scene.image_widths()].concat();
    let together = fitted(&both, &start, both_widths);
    assert_eq!(alone.unknowns.len(), together.unknowns.len());
    assert!(
        (together.loss_end / alone.loss_end - 1.0).abs() < 1e-6,
        "{} {}",
        together.loss_end,
        alone.loss_end
    );
    // A variance of residuals is over as many as there are, less the unknowns.
    let (n, k) = (engine.normal_equations(&scene.start()).count as f64, alone.unknowns.len() as f64);
    let want = (2.0 * (2.0 * n - k) / (2.0 * n - 2.0 * k)).sqrt();
    let mut compared = 0;
    for (one, two) in alone.unknowns.iter().zip(&together.unknowns) {
        let name = one.unknown.name();
        assert_eq!((one.at_bound, one.identifiable), (two.at_bound, two.identifiable), "{name}");
        // At a bound there is no error.
        let Some(error) = one.noise_error else { continue };
        compared += 1;
        // A fit stops within 0.03 standard errors of its answer.
        assert!((one.value - two.value).abs() <= 0.03 * error, "{name}: {} {}", one.value, two.value);
        let ratio = error / two.noise_error.unwrap();
        // Both are taken that near to one point, and errors vary there by less than that share.
        assert!((ratio / want - 1.0).abs() < 1e-2, "{name}: {ratio} is not {want}");
        // Squares of pixels, too, are twice as many.
        let ratio = one.std_error.unwrap() / two.std_error.unwrap();
        assert!((1.3..1.5).contains(&ratio), "{name}: {ratio}");
    }
    assert!(compared >= 5, "only {compared} have errors");
}

#[test]
fn one_scene_is_what_its_engine_says_to_the_bit() {
    let sandbox = Sandbox::new();
    let scene = observed(&sandbox, "one.toml", |scene| scene.replace("[fit]", "[fit]\ngains = true"));
    let engine = scene.engine().unwrap();
    let (joint, start) = joint(&[&scene]);
    assert_eq!(start, scene.start());
    assert_eq!(joint.unknowns(), engine.unknowns());
    assert_eq!(joint.normal_equations(&start), engine.normal_equations(&start));
    assert_eq!((joint.loss(&start), joint.gradient(&start)), (engine.loss(&start), engine.gradient(&start)));
    assert_eq!(joint.rounding(), engine.rounding());
    let widths = scene.image_widths();
    assert_eq!(joint.pulls(&start, &widths), engine.pulls(&start, &widths));
}

#[test]
fn sums_over_scenes_are_those_of_all_their_residuals() {
    let sandbox = Sandbox::new();
    let free = |scene: &str| {
        scene.replace("\"specular_lobe\"]", "\"specular_lobe\", \"environment_rotation\"]\ngains = true")
    };
    let noon = observed(&sandbox, "noon.toml", free);
    // Of fewer pixels: what scenes weigh differs.
    let night = observed(&sandbox, "night.toml", |scene| {
        let (front, rest) = scene.split_once("[[view]]\nname = \"side\"").unwrap();
        let turned = front.replace("hilite = 0.7", "hilite = 0.7\nenvironment_rotation = 40.0");
        free(&format!("{turned}[fit]{}", rest.split_once("[fit]").unwrap().1))
    });
    let (joint, start) = joint(&[&noon, &night]);
    let names: Vec<String> = joint.unknowns().iter().map(skinfit::engine::Unknown::name).collect();
    let own = ["0/environment_rotation", "1/environment_rotation", "gain.1"];
    assert_eq!(names[8..], own, "{names:?}");
    assert_eq!(start.gains.len(), 3);
    assert_eq!(start.params.rgb_in(1, Param::EnvironmentRotation), [40.0; 3]);
    let parts = [&noon, &night].map(|scene| scene.engine().unwrap().normal_equations(&scene.start()));
    let all = joint.normal_equations(&start);
    let weight = parts[0].weight + parts[1].weight;
    // Sums of a few f64.
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
    assert!(near(all.weight, weight) && all.count == parts[0].count + parts[1].count);
    let loss = (parts[0].weight * parts[0].loss + parts[1].weight * parts[1].loss) / weight;
    assert!(near(all.loss, loss) && near(joint.loss(&start), loss), "{} {loss}", all.loss);
    // The first eight are the skin's; then each scene's turn, and the gain of noon's second view.
    assert!((0..8).all(|i| near(all.jtr[i], parts[0].jtr[i] + parts[1].jtr[i])));
    assert_eq!([all.jtr[8], all.jtr[9], all.jtr[10]], [parts[0].jtr[8], parts[1].jtr[8], parts[0].jtr[9]]);
    let k = names.len();
    // No residual knows of both turns.
    assert_eq!((all.jtj[8 * k + 9], all.jtj[9 * k + 10]), (0.0, 0.0));
    assert_eq!(all.jtj[8 * k + 10], parts[0].jtj[8 * 10 + 9]);
    let (loss, gradient) = joint.gradient(&start);
    let (wanted, slopes) = all.loss_and_gradient();
    // A pass of its own, with sums in another order: some roundings of f32.
    assert!((loss / wanted - 1.0).abs() < 1e-6);
    let size = slopes.iter().map(|g| g.abs()).fold(0.0, f64::max);
    assert!(
        gradient.iter().zip(&slopes).all(|(a, b)| (a - b).abs() <= 1e-5 * size),
        "{gradient:?} {slopes:?}"
    );
}

#[test]
fn scenes_that_leave_other_constants_of_the_skin_free_are_no_objective() {
    let sandbox = Sandbox::new();
    let one = observed(&sandbox, "one.toml", str::to_owned);
    let other = observed(&sandbox, "other.toml", without_exponent);
    let engine = |scene: &Observed| Box::new(scene.engine().unwrap()) as Box<dyn Engine>;
    for pair in [[&one, &other], [&other, &one]] {
        let error = Joint::new(pair.map(engine).into()).err().unwrap();
        assert_eq!((error.scene, error.unknown.as_str()), (1, "rim_exponent"));
    }
}

//! A term that only this test knows, through the door by which every term comes in: registered from its text, its
//! value and derivatives held against a formula written here, fitted, drawn and exported.
use std::sync::OnceLock;

use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::reference::Reference;
use skinfit::engine::view::ObservedView;
use skinfit::engine::{Objective, Point, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::model::cube::Cube;
use skinfit::model::effects::{Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::Fragment;
use skinfit::model::params::{Column, Param};
use skinfit::render::shade::Shader;
use skinfit::samples::LANES;
use skinfit::scene::Loss;
use skinfit::scene::view::Camera;
use skinfit::shader::term::{Problem, Term, register};
use skinfit::shader::{Facts, Resource, Source, plan};

use crate::engine::{EVERYTHING, illumination, params, single, task, view};
use crate::evaluators::ByWitness;
use crate::fixtures::camera;

/// Schlick's Fresnel factor on the mirrored environment.
pub(crate) const FRESNEL: &str = "\
// Schlick's Fresnel factor on the mirrored environment (Schlick 1994).
//
// effect: fresnel_reflection, the mirrored environment grows towards grazing angles
// parameter: fresnel_weight = 0.5 in [0, inf), rgb, linear; weight of the mirrored environment; Schlick 1994
// parameter: fresnel_f0 = 0.028 in [0, 0.2]; reflectance when facing; Schlick 1994
//
// The share that is reflected.
//
// gives: fresnel_share
// cost: 10
fn schlick(n: vec3f, view: vec3f, fresnel_f0: f32) -> f32 {
    let grazing: f32 = 1.0 - min(abs(dot(n, view)), 1.0);
    let square: f32 = grazing * grazing;
    return fresnel_f0 + (1.0 - fresnel_f0) * (square * square * grazing);
}

// The mirrored environment, as much of it as is reflected.
//
// gives: fresnel_part
// adds: fresnel_reflection
// cost: 6
fn fresnel_light(fresnel_share: f32, mirror_light: vec4f, fresnel_weight: vec3f) -> vec3f {
    return fresnel_weight * (fresnel_share * mirror_light.rgb);
}
";

/// The term, registered once.
pub(crate) fn term() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| register("fresnel", FRESNEL).unwrap_or_else(|error| panic!("{error}")))
}

fn weight() -> Param {
    term().params[0]
}

fn f0() -> Param {
    term().params[1]
}

fn setup(silhouette: Silhouette) -> Setup {
    Setup::new(Form::Corrected, silhouette, EVERYTHING.with(term().effect))
}

/// Where nothing is at its default, and gradients are not small.
fn point() -> Point {
    let mut params = params();
    params.set_rgb(weight(), [0.9, 0.6, 0.4]);
    params.set(f0(), 0.07);
    Point { params, gains: vec![1.0.into()] }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The term's light, written out: weight (f0 + (1 - f0) (1 - |n.V|)^5) E_s(R).
fn fresnel(f: &Fragment<f64>, specular: &Cube<f64>, point: &Point) -> [f64; 3] {
    let strength = point.params.scalar(Param::NormalStrength);
    let n: [f64; 3] = std::array::from_fn(|i| f.base[i] + strength * f.bump[i]);
    let length = dot(n, n).sqrt();
    let n = n.map(|x| x / length);
    let facing = dot(n, f.view);
    let r: [f64; 3] = std::array::from_fn(|i| f.view[i] - 2.0 * facing * n[i]);
    let (sin, cos) = point.params.scalar(Param::EnvironmentRotation).to_radians().sin_cos();
    let light = specular.sample([cos * r[0] - sin * r[2], r[1], sin * r[0] + cos * r[2]]);
    let f0 = point.params.scalar(f0());
    let share = f0 + (1.0 - f0) * (1.0 - facing.abs()).powi(5);
    let weight = point.params.rgb(weight());
    std::array::from_fn(|c| weight[c] * share * light[c])
}

fn wide(f: &Fragment<f32>) -> Fragment<f64> {
    let v = |x: [f32; 3]| x.map(f64::from);
    Fragment {
        base: v(f.base),
        bump: v(f.bump),
        normal: v(f.normal),
        view: v(f.view),
        occlusion: f.occlusion.into(),
        silhouette: f.silhouette.into(),
        dapple: f.dapple.into(),
        albedo: v(f.albedo),
        specular: f.specular.into(),
        attenuator: f.attenuator.into(),
    }
}

/// A view's image in f64, plane by plane: the built-in model by the witness, and the term on top.
fn formula(setup: Setup, view: &ObservedView, point: &Point) -> Vec<Vec<f64>> {
    let built_in = Setup { effects: setup.effects.without(term().effect), ..setup };
    let light = illumination();
    let double = |cube: &Cube<f32>| cube.map(|texel| texel.map(f64::from));
    let specular = double(&light.lobes.as_ref().unwrap().at(point.params.scalar(Param::SpecularLobe)).0);
    let (irradiance, hilite) =
        (double(light.irradiance.as_ref().unwrap()), double(light.hilite.as_ref().unwrap()));
    let witness = ByWitness::new(built_in, [&irradiance, &specular, &hilite], &point.params);
    let samples = &view.samples;
    let mut planes = vec![vec![0.0; samples.groups() * LANES]; 4];
    for slot in 0..samples.groups() * LANES {
        let records = samples.group_start[slot / LANES]..samples.group_start[slot / LANES + 1];
        for at in records.map(|record| record as usize * LANES + slot % LANES) {
            let fragment = wide(&samples.surface.fragment(at));
            let share = f64::from(samples.surface.weight(at));
            let rgba = witness.shade(&fragment);
            let added = fresnel(&fragment, &specular, point);
            for c in 0..4 {
                planes[c][slot] += share * (rgba[c] + added.get(c).copied().unwrap_or(0.0));
            }
        }
    }
    planes
}

/// The loss `l2` of those planes.
fn loss(setup: Setup, view: &ObservedView, point: &Point) -> f64 {
    let planes = formula(setup, view, point);
    let (mut sum, mut weights) = (0.0, 0.0);
    for slot in 0..planes[0].len() {
        let weight = f64::from(view.pixel_weight(slot));
        for (c, plane) in planes.iter().enumerate() {
            sum += weight * (plane[slot] - f64::from(view.target.number(c, slot))).powi(2);
            weights += weight;
        }
    }
    sum / weights
}

/// What is free: both of the term's parameters, the first a channel at a time, and some of the model's.
fn unknowns(lookups: bool) -> Vec<Unknown> {
    let mut columns = Column::per_channel(weight()).to_vec();
    columns.extend([f0(), Param::Hilite, Param::Reflection, Param::RimExponent].map(Column::tied));
    if lookups {
        columns.extend([Param::NormalStrength, Param::EnvironmentRotation].map(Column::tied));
    }
    columns.into_iter().map(Unknown::Param).collect()
}

fn assert_planes(got: &[Vec<f32>], setup: Setup, view: &ObservedView, what: &str) {
    let want = formula(setup, view, &point());
    for (c, (got, want)) in got.iter().zip(&want).enumerate() {
        let largest = want.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (slot, (got, want)) in got.iter().zip(want).enumerate() {
            // Some tens of roundings of f32.
            let off = (f64::from(*got) - want).abs();
            assert!(off <= 1e-5 * largest, "{what}: channel {c} of slot {slot}: {got} {want}");
        }
    }
}

/// An engine's loss and gradient against finite differences of the formula.
fn assert_gradient(engine: &dyn Objective, setup: Setup, view: &ObservedView, what: &str) {
    let (got, gradient) = engine.gradient(&point());
    let want = loss(setup, view, &point());
    // Residuals round alike at most: 1e-5 of the loss is a hundred roundings of f32.
    assert!((got - want).abs() <= 1e-5 * want, "{what}: loss {got} {want}");
    let differences: Vec<f64> = engine
        .unknowns()
        .iter()
        .map(|unknown| {
            // A step of f64: its square, and roundings over it, are below 1e-9 of the slope.
            let step = 1e-5;
            let at = |by: f64| {
                let mut moved = point();
                unknown.set(&mut moved, unknown.get(&point()) + by);
                loss(setup, view, &moved)
            };
            (at(step) - at(-step)) / (2.0 * step)
        })
        .collect();
    let normal = engine.normal_equations(&point());
    let k = differences.len();
    for (i, (got, want)) in gradient.iter().zip(&differences).enumerate() {
        // Some hundred roundings of f32, of the sum of the terms' sizes: at most the root of its square sums.
        let size = 2.0 * (normal.jtj[i * k + i] * normal.residual).sqrt() / normal.weight;
        let name = engine.unknowns()[i].name();
        assert!((got - want).abs() <= 2e-5 * size, "{what}: slope of {name}: {got} {want} of {size}");
    }
}

/// A view whose target is the formula's image at [`point`].
fn with_target(setup: Setup, mut view: ObservedView) -> ObservedView {
    let planes = formula(setup, &view, &point());
    for slot in 0..planes[0].len() {
        let record = view.target.record_mut(slot / LANES);
        for (row, plane) in record.iter_mut().zip(&planes) {
            row[slot % LANES] = plane[slot] as f32;
        }
    }
    view
}

/// A fit from the defaults finds the constants that made the targets.
fn assert_fit(engine: &dyn Objective, what: &str) {
    let mut start = point();
    for unknown in engine.unknowns() {
        if let Unknown::Param(column) = unknown {
            unknown.set(&mut start, column.param.default(Form::Corrected));
        }
    }
    let outcome = fit(engine, &start, &FitOptions::default(), &mut |_| {}).unwrap();
    for unknown in engine.unknowns() {
        let (got, want) = (unknown.get(&outcome.end), unknown.get(&point()));
        // Targets are rounded to f32, a few hundred of them: what is left of that after the fit, with a hundred
        // times as much for directions in which parameters trade.
        assert!((got - want).abs() <= 1e-4 * (1.0 + want), "{what}: {}: {got} {want}", unknown.name());
    }
}

fn cpu(setup: Setup, views: &[ObservedView], unknowns: &[Unknown]) -> CpuEngine {
    CpuEngine::new(task(setup, views, Loss::L2, unknowns)).unwrap()
}

#[test]
fn the_cpu_engine_shades_and_fits_an_added_term_or_refuses_it() {
    for silhouette in [Silhouette::Fragment, Silhouette::Bumped] {
        let setup = setup(silhouette);
        for (made, lookups) in [(view(7, 31), true), (single(7, 32), false)] {
            let views = [made];
            let engine = cpu(setup, &views, &unknowns(lookups));
            assert_planes(&engine.image(0, &point()), setup, &views[0], "cpu");
            assert_gradient(&engine, setup, &views[0], "cpu");
            assert_fit(&cpu(setup, &[with_target(setup, views[0].clone())], &unknowns(lookups)), "cpu");
        }
    }
}

/// The view's samples as an image one pixel high, a pixel slot each.
fn shown(mut view: ObservedView) -> (ObservedView, Camera) {
    let slots = view.samples.groups() * LANES;
    view.samples.pixel = (0..slots as u32).collect();
    view.samples.coverage = vec![1.0; slots];
    #[rustfmt::skip]
    let anywhere = [1.0, 0.0, 0.0, 0.0,  0.0, 1.0, 0.0, 0.0,  0.0, 0.0, 1.0, 0.0,  0.0, 0.0, 0.0, 1.0];
    let camera = Camera { width: slots as u32, height: 1, ..camera(anywhere, 40.0, 1) };
    (view, camera)
}

#[test]
fn the_reference_in_f64_and_the_renderer_on_the_processor_are_the_formula() {
    for silhouette in [Silhouette::Fragment, Silhouette::Bumped] {
        let (setup, light) = (setup(silhouette), illumination());
        let (view, camera) = shown(view(5, 37));
        let planes = formula(setup, &view, &point());
        let views = [view];
        let free = unknowns(true);
        let plain = Reference::new(setup, &light, &views, Loss::L2, &free).unwrap();
        let shader = Shader::new(setup, &light, &point().params).unwrap();
        let shaded = shader.shade(&views[0].samples, &camera, 1.0);
        assert_eq!(shaded.terms.len(), 7);
        for slot in 0..planes[0].len() {
            let pixel = plain.pixel(0, slot, &point().params);
            for c in 0..4 {
                // Both are in f64, but the library's cubes hold the mean of the texels at a corner in f32.
                assert!((pixel[c].0 - planes[c][slot]).abs() < 2e-7, "{silhouette:?}: channel {c} of {slot}");
            }
            for c in 0..3 {
                let (got, want) = (shaded.image.rgb[slot][c], planes[c][slot]);
                let sum: f32 = shaded.terms.iter().map(|(_, image)| image.rgb[slot][c]).sum();
                // Images hold f32: one rounding of the whole, seven of the terms.
                assert!((f64::from(got) - want).abs() <= 1e-7 * want.abs(), "{slot}: {got} {want}");
                assert!((sum - got).abs() <= 1e-6 * got.abs(), "{slot}: {sum} {got}");
            }
        }
        assert_gradient(&plain, setup, &views[0], "f64");
    }
}

mod on_an_adapter {
    use skinfit::engine::gpu::{GpuEngine, Memory};
    use skinfit::gpu::Renderer;
    use skinfit::model::terms::TermName;

    use super::*;
    use crate::graphics::bench::{Content, EXACT, SURFACE, baked, built_in, gpu};

    fn engine(setup: Setup, views: &[ObservedView], unknowns: &[Unknown]) -> Option<GpuEngine> {
        let task = task(setup, views, Loss::L2, unknowns);
        Some(GpuEngine::new(gpu()?, task, &point(), Memory::default()).unwrap())
    }

    #[test]
    fn its_values_and_slopes_are_those_of_the_formula_over_samples_and_over_kept_terms() {
        for silhouette in [Silhouette::Fragment, Silhouette::Bumped] {
            let setup = setup(silhouette);
            for (made, lookups) in [(view(7, 31), true), (view(7, 32), false), (single(7, 33), false)] {
                let views = [made];
                let Some(engine) = engine(setup, &views, &unknowns(lookups)) else { return };
                let what = format!("{silhouette:?}, lookups {lookups}");
                assert_planes(&engine.image(0, &point()).unwrap(), setup, &views[0], &what);
                assert_gradient(&engine, setup, &views[0], &what);
            }
        }
    }

    #[test]
    fn a_fit_finds_the_constants_that_made_its_targets() {
        let setup = setup(Silhouette::Fragment);
        for lookups in [false, true] {
            let views = [with_target(setup, view(23, 34)), with_target(setup, single(11, 35))];
            let Some(engine) = engine(setup, &views, &unknowns(lookups)) else { return };
            assert_fit(&engine, &format!("lookups {lookups}"));
        }
    }

    #[test]
    fn images_of_terms_add_up_to_the_whole() {
        let setup = setup(Silhouette::Fragment);
        for lookups in [false, true] {
            let views = [view(5, 36)];
            let Some(engine) = engine(setup, &views, &unknowns(lookups)) else { return };
            let whole = engine.image(0, &point()).unwrap();
            let terms: Vec<_> = TermName::of(setup.effects)
                .into_iter()
                .map(|term| engine.term_image(0, &point(), term).unwrap())
                .collect();
            assert_eq!(terms.len(), 7);
            for c in 0..3 {
                for slot in 0..whole[c].len() {
                    let sum: f32 = terms.iter().map(|term| term[c][slot]).sum();
                    // Sums of seven numbers, in another order.
                    assert!(
                        (sum - whole[c][slot]).abs() < 1e-5,
                        "{lookups} {c} {slot}: {sum} {}",
                        whole[c][slot]
                    );
                }
            }
        }
    }

    #[test]
    fn the_renderer_draws_it_and_its_layer() {
        let Some(gpu) = gpu() else { return };
        let baked = baked(&built_in(), SURFACE.with(term().effect), 64)
            .with_scene(|scene| scene.params.set_rgb(weight(), [0.9, 0.6, 0.4]));
        let camera = baked.scene.views[0].camera;
        let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
        let whole = renderer.render(&camera, 1.0).unwrap().image;
        let layer = renderer.render_term(term().layers[0], &camera, 1.0).unwrap();
        let baked = baked.with_scene(|scene| scene.effects = SURFACE);
        let without =
            Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
        let most = layer.rgb.iter().flatten().fold(0.0_f32, |most, x| most.max(*x));
        assert!(most > 0.01, "the term shows: {most}");
        for (i, added) in layer.rgb.iter().enumerate() {
            for c in 0..3 {
                let (with, without) = (whole.rgb[i][c], without.rgb[i][c]);
                // Roundings of f32 of radiance near 1.
                assert!((without + added[c] - with).abs() < 1e-5, "pixel {i}: {without} {added:?} {with}");
            }
        }
    }
}

#[test]
fn what_its_effect_asks_for_is_what_its_rules_read() {
    let needs = Effects::of(&[term().effect]).needs(Silhouette::Fragment);
    assert!(needs.lobes && needs.environment());
    assert!(!needs.maps() && !needs.irradiance && !needs.hilite && !needs.dapple && !needs.smooth_normal);
    let plan = plan(&Facts {
        setup: Setup { effects: Effects::of(&[term().effect]), ..setup(Silhouette::Fragment) },
        source: Source::Samples,
        ..Facts::default()
    })
    .unwrap();
    assert_eq!(plan.resources, [Resource::SpecularFaces]);
    assert!(plan.wgsl.contains("fn schlick(") && plan.wgsl.contains("fn fresnel_light("));
    // Where it is off, nothing of it is left.
    let off = skinfit::shader::plan(&Facts::default()).unwrap();
    assert!(
        !off.wgsl.contains("fresnel") && off.left_out().iter().all(|(rule, _)| rule.function != "schlick")
    );
}

#[test]
fn it_is_exported_to_glsl_that_glslang_takes() {
    let facts = Facts { setup: setup(Silhouette::Fragment), ..crate::exports::engine_facts() };
    let text = crate::exports::compiled_glsl("fresnel", &facts);
    assert!(text.contains("float skinfit_schlick(") && text.contains("FRESNEL_F0"), "{text}");
}

#[test]
fn the_same_text_is_the_same_term_and_another_under_its_name_is_refused() {
    let again = register("elsewhere", FRESNEL).unwrap();
    assert_eq!((again.effect, &again.params), (term().effect, &term().params));
    let other = register("other", &FRESNEL.replace("grows", "shrinks")).unwrap_err();
    assert!(matches!(other.problem, Problem::Taken { .. }), "{other}");
}

#[test]
fn what_does_not_fit_is_refused_with_its_line_and_a_remedy() {
    term();
    // Names of its own, so that nothing else is taken.
    let text = FRESNEL.replace("fresnel", "sheen").replace("schlick", "sheen_curve");
    let cases: &[(&str, &str, usize, &str)] = &[
        ("effect: sheen_reflection", "effect: hilite", 3, "`hilite` is there already"),
        ("effect: sheen_reflection", "effect: bumped", 3, "`bumped` is there already"),
        (
            "// effect: sheen_reflection, the mirrored environment grows towards grazing angles\n",
            "",
            1,
            "no effect",
        ),
        ("parameter: sheen_f0", "parameter: occlusion", 5, "`occlusion` is there already"),
        ("parameter: sheen_f0", "parameter: silhouette", 5, "`silhouette` is there already"),
        ("gives: sheen_share", "gives: weight", 11, "`weight` is no name"),
        ("gives: sheen_part", "gives: mirror_part", 22, "`mirror_part` is there already"),
        ("adds: sheen_reflection", "adds: diffuse", 22, "`diffuse` is there already"),
        ("// adds: sheen_reflection\n", "", 11, "no rule adds"),
        ("-> f32 {", "-> vec3f {", 22, "is of the type f32 here, but it is vec3f"),
        ("fn sheen_curve(n: vec3f,", "fn sheen_curve(m: vec3f,", 11, "nothing gives m"),
        ("fn sheen_curve(n: vec3f,", "fn sheen_curve(vertex_uv: vec2f,", 11, "rasterised fragments alone"),
        ("n: vec3f, view", "n: vec2f, view", 11, "n is of the type vec2f here, but it is vec3f"),
        (
            "view: vec3f, sheen_f0: f32",
            "view: vec3f, sheen_part: vec3f",
            11,
            "in a circle: sheen_share, sheen_part",
        ),
        ("let square: f32 = grazing", "let square: f32 = glazing", 13, "no valid WGSL"),
        ("square * square * grazing);", "square * square * grazing) + n;", 11, "no valid WGSL"),
        (
            "cost: 10",
            "cost: 10\n// reads: specular_map2",
            12,
            "names what is not there. Known: irradiance_faces",
        ),
        ("cost: 10", "cost: 10\n// uses: noise", 12, "names what is not there. Known: vector"),
        ("cost: 10", "cost: 10\n// when: wet", 12, "names what is not there. Known: diffuse"),
        (
            "let grazing: f32 = 1.0",
            "let grazing: f32 = determinant(mat2x2f(1.0, 0.0, 0.0, n.x))",
            11,
            "derivative",
        ),
        ("fn sheen_light(", "fn normalize_or(", 22, "`normalize_or` is there already"),
        ("fn sheen_light(", "fn sample_level(", 22, "`sample_level` is a name that the shaders give"),
        ("fn sheen_light(", "fn vs_main(", 22, "`vs_main` is a name that the shaders give"),
        ("fn sheen_curve(", "fn fs_main(", 11, "`fs_main` is a name that the shaders give"),
        ("parameter: sheen_f0", "parameter: sheen_level", 5, "Give it another name: those that begin with"),
        ("gives: sheen_share", "gives: sheen_along_u", 11, "`sheen_along_u` is a name that the shaders give"),
        ("gives: sheen_share", "gives: d_sheen", 11, "`d_sheen` is a name that the shaders give"),
    ];
    for &(old, new, line, words) in cases {
        assert!(text.contains(old), "{old}");
        let changed = text.replacen(old, new, 1);
        let error = register("sheen", &changed).map(|term| term.effect).unwrap_err();
        assert!(error.line == line && error.to_string().contains(words), "{new}: {error}");
    }
    let idle = text
        .replace(", sheen_weight: vec3f", "")
        .replace("sheen_weight * (sheen_share * mirror_light.rgb)", "sheen_share * mirror_light.rgb");
    let error = register("sheen", &idle).unwrap_err();
    assert_eq!((error.line, &error.problem), (4, &Problem::Idle("sheen_weight".to_owned())));
    // None of it has left a name behind.
    assert!(Param::from_name("sheen_f0").is_none());
}

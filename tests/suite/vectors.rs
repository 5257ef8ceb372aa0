//! The conformance vectors of an independent float64 oracle, run through every evaluator: the model
//! in f64, in f32 and in SIMD lanes.

use std::collections::BTreeMap;
use std::path::Path;

use fearless_simd::Level;
use serde_json::Value;
use skinfit::engine::lanes::Lanes;
use skinfit::model::cube::Cube;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::{self, Setup};
use skinfit::model::formats::{Declared, Emulated, Format, Half, to_fixed, to_half};
use skinfit::model::fragment::{self, Fragment, Shading, decode_normal, unit_view};
use skinfit::model::lights::Lights;
use skinfit::model::params::{Param, Params};
use skinfit::model::real::Real;
use skinfit::model::rim::rim;

use crate::common;

/// JSON doubles; non-finite ones are strings, null is "nothing to compare".
pub(crate) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(n) => n.as_f64(),
        Value::String(s) if s == "NaN" => Some(f64::NAN),
        Value::String(s) if s == "Infinity" => Some(f64::INFINITY),
        Value::String(s) if s == "-Infinity" => Some(f64::NEG_INFINITY),
        Value::Null => None,
        other => panic!("not a number: {other}"),
    }
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => number(other).into_iter().collect(),
    }
}

pub(crate) fn three(value: &Value) -> [f64; 3] {
    numbers(value)[..3].try_into().unwrap()
}

/// One evaluator: how it makes numbers, and the files' tolerance for it.
pub(crate) trait Evaluator: Real {
    fn texel(x: f64) -> Self::Texel;
    fn value(self) -> f64;
    fn tolerance(file: &Value) -> (f64, f64);
}

fn f32_tolerance(file: &Value) -> (f64, f64) {
    let t = &file["tolerance"];
    (t["f32_abs"].as_f64().unwrap(), t["f32_rel"].as_f64().unwrap())
}

impl Evaluator for f64 {
    fn texel(x: f64) -> f64 {
        x
    }
    fn value(self) -> f64 {
        self
    }
    fn tolerance(file: &Value) -> (f64, f64) {
        // The files give f64 a relative figure alone; the same, absolutely, where a sum cancels.
        let rel = file["tolerance"]["f64_rel"].as_f64().unwrap();
        (rel, rel)
    }
}

impl Evaluator for f32 {
    fn texel(x: f64) -> f32 {
        x as f32
    }
    fn value(self) -> f64 {
        f64::from(self)
    }
    fn tolerance(file: &Value) -> (f64, f64) {
        f32_tolerance(file)
    }
}

impl<S: fearless_simd::Simd> Evaluator for Lanes<S> {
    fn texel(x: f64) -> f32 {
        x as f32
    }
    fn value(self) -> f64 {
        let lanes = self.to_array();
        assert!(lanes.iter().all(|x| x.to_bits() == lanes[0].to_bits()), "lanes differ: {lanes:?}");
        f64::from(lanes[0])
    }
    fn tolerance(file: &Value) -> (f64, f64) {
        f32_tolerance(file)
    }
}

#[track_caller]
fn check<R: Evaluator>(file: &Value, what: &str, got: &[R], want: &Value) {
    let want: Vec<f64> = numbers(want);
    if want.is_empty() {
        return;
    }
    let got: Vec<f64> = got.iter().map(|x| x.value()).collect();
    assert_eq!(got.len(), want.len(), "{} {what}: lengths", file["name"]);
    let (abs, rel) = R::tolerance(file);
    let largest = want.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    for (i, (g, w)) in got.iter().zip(&want).enumerate() {
        let bound = abs * largest + rel * w.abs();
        assert!((g - w).abs() <= bound, "{} {what}[{i}]: got {g}, want {w}, bound {bound:e}", file["name"]);
    }
}

pub(crate) struct Vectors {
    pub(crate) files: BTreeMap<String, Value>,
}

impl Vectors {
    pub(crate) fn read(folder: &Path) -> Self {
        let mut files = BTreeMap::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "json") {
                let text = std::fs::read_to_string(&path).unwrap();
                let name = path.file_name().unwrap().to_string_lossy().into_owned();
                files.insert(name, serde_json::from_str(&text).unwrap());
            }
        }
        assert!(!files.is_empty(), "{} holds no vectors", folder.display());
        Self { files }
    }

    pub(crate) fn cube<R: Evaluator>(&self, file: &Value, which: &str) -> Cube<R::Texel>
    where
        R::Texel: skinfit::model::cube::Channel,
    {
        let inputs = &self.files[file["cubes_file"].as_str().unwrap()]["inputs"];
        let size = inputs["size"].as_u64().unwrap() as usize;
        Cube::from_fn(size, |face, column, row| {
            let texel = numbers(&inputs[which][face][row][column]);
            std::array::from_fn(|c| R::texel(texel[c]))
        })
    }
}

fn lights<'a, R: Real>(
    diffuse: &'a Cube<R::Texel>,
    spec: &'a Cube<R::Texel>,
    hilite: &'a Cube<R::Texel>,
) -> Lights<'a, R> {
    Lights {
        irradiance: Some(diffuse),
        side: Some(spec),
        mirror: Some(spec),
        lobe_slope: None,
        hilite: Some(hilite),
        turn: None,
        key: None,
    }
}

const ALL_TERMS: Effects = Effects::SURFACE.with(Effect::Haze);

/// The parameters of a vector, under the oracle's names.
pub(crate) fn params(constants: &Value) -> Params {
    let mut params = Params::defaults(Form::Corrected);
    for (name, param) in [
        ("base_weight", Param::BaseWeight),
        ("rim_weight", Param::RimWeight),
        ("rim_exponent", Param::RimExponent),
        ("hilite", Param::Hilite),
        ("reflection", Param::Reflection),
        ("occlusion", Param::Occlusion),
        ("side_spec", Param::SideSpecular),
        ("bump", Param::NormalStrength),
        ("haze", Param::HazeWeight),
    ] {
        match &constants[name] {
            Value::Null => {}
            Value::Array(_) => params.set_rgb(param, three(&constants[name])),
            value => params.set(param, number(value).unwrap()),
        }
    }
    params
}

/// The 10 columns of the oracle's Jacobians: parameter and channel (`None`: all of them).
const ORACLE_COLUMNS: [(&str, Param, Option<usize>); 10] = [
    ("rim_weight_r", Param::RimWeight, Some(0)),
    ("rim_weight_g", Param::RimWeight, Some(1)),
    ("rim_weight_b", Param::RimWeight, Some(2)),
    ("rim_exponent", Param::RimExponent, None),
    ("hilite", Param::Hilite, None),
    ("reflection", Param::Reflection, None),
    ("occlusion", Param::Occlusion, None),
    ("side_spec", Param::SideSpecular, None),
    ("bump", Param::NormalStrength, None),
    ("haze", Param::HazeWeight, None),
];

/// The parameters of a point that is given column by column, under the oracle's names.
pub(crate) fn column_params(values: &Value) -> Params {
    let mut params = Params::defaults(Form::Corrected);
    for (name, param, channel) in ORACLE_COLUMNS {
        let value = number(&values[name]).unwrap();
        match channel {
            None => params.set(param, value),
            Some(c) => {
                let mut rgb = params.rgb(param);
                rgb[c] = value;
                params.set_rgb(param, rgb);
            }
        }
    }
    params
}

// The model is inlined wherever it is called; here, where speed is nothing, once for each evaluator.

#[inline(never)]
fn shade<R: Real>(setup: Setup, lights: &Lights<'_, R>, f: &Fragment<R>, params: &Params) -> [R; 4] {
    evaluate::shade(setup, lights, f, params)
}

#[inline(never)]
fn rim_of<R: Real>(setup: Setup, lights: &Lights<'_, R>, f: &Fragment<R>, params: &Params) -> R {
    evaluate::compose(setup, lights, f, params).rim()
}

#[inline(never)]
fn derivative<R: Real>(
    setup: Setup,
    lights: &Lights<'_, R>,
    f: &Fragment<R>,
    params: &Params,
    param: Param,
) -> [R; 4] {
    evaluate::derivative(setup, lights, f, params, param)
}

#[inline(never)]
fn shading<R: Real>(setup: Setup, f: &Fragment<R>, strength: R) -> Shading<R> {
    fragment::shading(setup.form, setup.silhouette, f, strength)
}

/// `[rgba][column]`
fn jacobian<R: Real>(setup: Setup, lights: &Lights<'_, R>, f: &Fragment<R>, params: &Params) -> [[R; 10]; 4] {
    let zero = f.occlusion.lit(0.0);
    let mut rows = [[zero; 10]; 4];
    for (k, (_, param, channel)) in ORACLE_COLUMNS.into_iter().enumerate() {
        let column = derivative(setup, lights, f, params, param);
        for c in 0..4 {
            rows[c][k] = if channel.is_none_or(|own| own == c) { column[c] } else { zero };
        }
    }
    rows
}

fn fragment_at<R: Evaluator>(form: Form, inputs: &Value, like: R) -> Fragment<R> {
    let lit = |x: [f64; 3]| x.map(|x| like.lit(x));
    let rows = ["X", "Y", "Z"].map(|row| three(&inputs[format!("WorldTanMatrix{row}")]));
    let column = |i: usize| lit([rows[0][i], rows[1][i], rows[2][i]]);
    let (t, b, n) = (column(0), column(1), column(2));
    let texel = numbers(&inputs["normSideSpec"]);
    let (base, bump) = decode_normal(form, lit([texel[0], texel[1], texel[2]]), t, b, n);
    let silhouette = numbers(&inputs["SkinSilhouetteVec"]);
    let view = lit(three(&inputs["WorldEyeDir"]));
    let (view, dapple) = match form {
        Form::Listing => (view, silhouette[3]),
        Form::Corrected => (unit_view(view), silhouette[3].max(0.0)),
    };
    Fragment {
        base,
        bump,
        normal: n,
        view,
        occlusion: like.lit(silhouette[0]),
        silhouette: like.lit(silhouette[2]),
        dapple: like.lit(dapple),
        albedo: lit(three(&inputs["skinColor"])),
        specular: like.lit(texel[3]),
        attenuator: like.lit(number(&inputs["hiLightAttenuator"]).unwrap()),
    }
}

fn fragment_vector<R: Evaluator>(vectors: &Vectors, file: &Value, like: R)
where
    R::Texel: skinfit::model::cube::Channel,
{
    let cubes = ["diffuse", "spec", "hilite"].map(|which| vectors.cube::<R>(file, which));
    let lights = lights::<R>(&cubes[0], &cubes[1], &cubes[2]);
    let expected = &file["expected"];

    let setup = Setup { form: Form::Corrected, silhouette: Silhouette::Bumped, effects: ALL_TERMS };
    let p = params(&file["constants"]["corrected"]);
    let f = fragment_at(setup.form, &file["inputs"], like);
    let s = shading(setup, &f, like.lit(p.scalar(Param::NormalStrength)));
    let want = &expected["corrected"];
    check(file, "corrected n", &s.n, &want["n"]);
    check(file, "corrected n.V", &[s.n_dot_v], &want["nDotV"]);
    check(file, "corrected reflection", &s.reflection, &want["reflVect"]);
    check(file, "corrected rim", &[rim_of(setup, &lights, &f, &p)], &want["rim"]);
    check(file, "corrected rgba", &shade(setup, &lights, &f, &p), &want["rgba"]);
    let j = &expected["corrected_jacobian"];
    for (k, name) in j["columns"].as_array().unwrap().iter().enumerate() {
        assert_eq!(name, ORACLE_COLUMNS[k].0);
    }
    check(file, "corrected Jacobian", &jacobian(setup, &lights, &f, &p).concat(), &j["J"]);

    if !expected["literal"].is_null() {
        let setup = Setup { form: Form::Listing, silhouette: Silhouette::Vertex, effects: ALL_TERMS };
        let mut p = Params::defaults(Form::Listing);
        p.set(Param::Hilite, number(&file["constants"]["literal"]["hilite"]).unwrap());
        p.set(Param::Reflection, number(&file["constants"]["literal"]["reflection"]).unwrap());
        let f = fragment_at(setup.form, &file["inputs"], like);
        let s = shading(setup, &f, like.lit(1.0));
        let want = &expected["literal"];
        check(file, "listing n", &s.n, &want["n"]);
        check(file, "listing reflection", &s.reflection, &want["reflVect"]);
        check(file, "listing rgba", &shade(setup, &lights, &f, &p), &want["rgba"]);
    }
}

fn rim_vector<R: Evaluator>(file: &Value, like: R) {
    let (z, exponents) = (numbers(&file["inputs"]["f"]), numbers(&file["inputs"]["exponent"]));
    let table = |pick: fn(skinfit::model::rim::Rim<R>) -> R| -> Vec<R> {
        let each = |z: f64, e: f64| pick(rim(like.lit(z), like.lit(e)));
        z.iter().flat_map(|&z| exponents.iter().map(move |&e| each(z, e))).collect()
    };
    check(file, "rim", &table(|r| r.value), &file["expected"]["rim"]);
    check(file, "d rim / d exponent", &table(|r| r.by_exponent), &file["expected"]["d_exponent"]);
}

fn cube_sample_vector<R: Evaluator>(vectors: &Vectors, file: &Value, like: R)
where
    R::Texel: skinfit::model::cube::Channel,
{
    let cube = vectors.cube::<R>(file, "spec");
    let directions = file["inputs"]["directions"].as_array().unwrap();
    let got: Vec<R> =
        directions.iter().flat_map(|d| cube.sample::<R>(three(d).map(|x| like.lit(x)))).collect();
    check(file, "seamless lookups", &got, &file["expected"]["seamless"]);
}

fn bench_vector<R: Evaluator>(vectors: &Vectors, file: &Value, like: R)
where
    R::Texel: skinfit::model::cube::Channel,
{
    let cubes = ["diffuse", "spec", "hilite"].map(|which| vectors.cube::<R>(file, which));
    let lights = lights::<R>(&cubes[0], &cubes[1], &cubes[2]);
    let setup = Setup { form: Form::Corrected, silhouette: Silhouette::Bumped, effects: ALL_TERMS };
    let g = &file["inputs"]["gbuffer"];
    let [truth, start] = ["params", "params_init"].map(|which| column_params(&file["inputs"][which]));
    let (mut forward, mut at_start, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..16 {
        let v = |name: &str| three(&g[name][i]).map(|x| like.lit(x));
        let s = |name: &str| like.lit(number(&g[name][i]).unwrap());
        let f = Fragment {
            base: v("A"),
            bump: v("B"),
            normal: v("A"),
            view: v("E"),
            occlusion: s("o"),
            silhouette: like.lit(0.0),
            dapple: like.lit(1.0),
            albedo: v("c"),
            specular: s("p"),
            attenuator: s("a"),
        };
        forward.extend(shade(setup, &lights, &f, &truth));
        at_start.extend(shade(setup, &lights, &f, &start));
        rows.extend(jacobian(setup, &lights, &f, &start).concat());
    }
    check(file, "forward", &forward, &file["expected"]["forward"]);
    check(file, "forward at the start", &at_start, &file["expected"]["at_init"]["forward"]);
    check(file, "Jacobian at the start", &rows, &file["expected"]["at_init"]["jacobian"]);
}

/// Every file of the folder through one evaluator. A kind that nobody knows is a failure.
fn run<R: Evaluator>(like: R)
where
    R::Texel: skinfit::model::cube::Channel,
{
    let Some(folder) = common::shared("vectors", "SKINFIT_VECTORS") else { return };
    let vectors = Vectors::read(&folder);
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for (name, file) in &vectors.files {
        let kind = file["kind"].as_str().unwrap_or_else(|| panic!("{name} has no kind"));
        match kind {
            "fragment" => fragment_vector(&vectors, file, like),
            "rim" => rim_vector(file, like),
            "cube_sample" => cube_sample_vector(&vectors, file, like),
            "bench" => bench_vector(&vectors, file, like),
            // Read by the others.
            "cubes" => {}
            // Tested where the baking and the meshes are.
            "latlong" | "prefilter" | "vertex" => {}
            // Number formats have a test of their own; texture-space diffusion is not yet built.
            "formats" | "study" | "diffusion" => {}
            other => panic!("{name}: unknown kind of vector: {other}"),
        }
        *counts.entry(kind).or_default() += 1;
    }
    eprintln!("vectors: {counts:?}");
}

/// Fragments of form `listing` in a format that rounds, within what its roundings may do: `step` relative
/// to the greatest channel, and `floor`.
fn reduced<F: Format>(want: &str, step: f64, floor: f64) {
    let Some(folder) = common::shared("vectors", "SKINFIT_VECTORS") else { return };
    let vectors = Vectors::read(&folder);
    let (mut compared, mut exact) = (0, 0);
    for file in vectors.files.values().filter(|file| file["kind"] == "fragment") {
        let expected: Vec<f64> = numbers(&file["expected"][want]);
        let has_frame = file["name"] != "frag_09_tiny_frame";
        // Of a frame of 1e-20 nothing is left in 16 bits: the oracle's numbers there are noise, it says.
        if expected.is_empty() || !has_frame {
            continue;
        }
        let cubes = ["diffuse", "spec", "hilite"].map(|which| vectors.cube::<f64>(file, which));
        let lights = lights::<Emulated<F>>(&cubes[0], &cubes[1], &cubes[2]);
        let setup = Setup { form: Form::Listing, silhouette: Silhouette::Vertex, effects: ALL_TERMS };
        let f = fragment_at(setup.form, &file["inputs"], 0.0_f64).in_format(Emulated::<F>::new(0.0));
        let got = evaluate::shade(setup, &lights, &f, &Params::defaults(Form::Listing)).map(f64::from);
        let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (c, (got, want)) in got.iter().zip(&expected).enumerate() {
            let bound = step * scale + floor;
            assert!((got - want).abs() <= bound, "{} {}[{c}]: {got}, not {want}", file["name"], F::NAME);
            exact += usize::from(got == want);
            compared += 1;
        }
    }
    assert!(compared >= 40 && 2 * exact > compared, "{}: {exact} of {compared} are exact", F::NAME);
}

#[test]
fn the_listing_holds_in_its_declared_types_and_in_binary16() {
    // The hilite is attenuated before it is rounded, the sum has five roundings of half a step: 2 steps of 1/1024.
    reduced::<Declared>("literal_fx12_rgba", 0.0, 2.0 / 1024.0);
    // The sum is taken in another order: its handful of roundings, each half a unit of 2^-10 of what it rounds.
    reduced::<Half>("literal_half_rgba", 3.0 / 1024.0, 1e-4);
}

#[test]
fn number_formats_round_as_the_vectors_say() {
    let Some(folder) = common::shared("vectors", "SKINFIT_VECTORS") else { return };
    let vectors = Vectors::read(&folder);
    let file = &vectors.files["number_formats.json"];
    let x = numbers(&file["inputs"]["x"]);
    let rounded = |format: fn(f64) -> f64| x.iter().map(|&x| format(x)).collect::<Vec<_>>();
    assert_eq!(rounded(to_fixed), numbers(&file["expected"]["fx12"]));
    assert_eq!(rounded(to_half), numbers(&file["expected"]["half"]));
}

#[test]
fn vectors_hold_in_f64() {
    run(0.0_f64);
}

#[test]
fn vectors_hold_in_f32() {
    run(0.0_f32);
}

fn run_lanes(level: Level) {
    skinfit_core::with_simd!(level, simd => run(Lanes::splat(simd, 0.0)));
}

#[test]
fn vectors_hold_in_simd_lanes() {
    run_lanes(Level::new());
}

#[test]
fn vectors_hold_in_simd_lanes_without_instructions_beyond_the_baseline() {
    run_lanes(Level::baseline());
}

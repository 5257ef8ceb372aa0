//! The conformance vectors of an independent float64 oracle (tests/vectors), run through every evaluator: the rules
//! in f64, in f32 and in SIMD lanes here, the engines by way of the witness' scenes. Nothing in them may go unread.

pub(crate) mod reader;

use skinfit::bake::{Illumination, LobeStack};
use skinfit::engine::lanes::Lanes;
use skinfit::model::cube::Cube;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::formats::{Declared, Emulated, Format, Half, to_fixed, to_half};
use skinfit::model::fragment::{Fragment, decode_normal, unit_view};
use skinfit::model::params::{Param, Params};
use skinfit::model::real::Real;
use skinfit::model::vector::dot;
use skinfit::render::format::FormatShader;
use skinfit::samples::surface_records::Asked;
use skinfit::samples::{SurfaceRecords, ViewSamples};
use skinfit_core::program::graph::Input;

use self::reader::{Node, Tolerance, Vector, Vectors};
use crate::by_rules::{Cubes, Fragments, Function, Number, Shaded, Wanted};
use crate::{bakes, common, diffusion, evaluators, harmonics, lights, meshes, witness};

/// Numbers as the vectors are compared with: how each evaluator makes them, and the files' tolerance for it.
#[track_caller]
fn check<R: Number>(what: &str, got: &[R], want: &Node<'_>) {
    let got: Vec<f64> = got.iter().map(|&x| value(x)).collect();
    tolerance::<R>(want).check(what, &got, want);
}

fn tolerance<R: Number>(want: &Node<'_>) -> Tolerance {
    let tolerances = want.vector.tolerances();
    if size_of::<R>() == size_of::<f64>() { tolerances.double } else { tolerances.single }
}

/// The number; every lane of it the same.
fn value<R: Number>(x: R) -> f64 {
    let lanes = x.unpack();
    assert!(lanes.iter().all(|lane| lane.to_bits() == lanes[0].to_bits()), "lanes differ: {lanes:?}");
    lanes[0]
}

pub(crate) fn cube<R: Number>(vectors: &Vectors, file: &Node<'_>, which: &str) -> Cube<R::Texel> {
    let inputs = vectors.cubes(file);
    let (size, texels) = (inputs.at("size").number() as usize, inputs.at(which).numbers());
    Cube::from_fn(size, |face, column, row| {
        let at = ((face * size + row) * size + column) * 4;
        std::array::from_fn(|c| R::texel(texels[at + c]))
    })
}

/// The cubes of a file; nothing is fitted that acts through the slope of one.
fn cubes<R: Number>(vectors: &Vectors, file: &Node<'_>) -> Cubes<R::Texel> {
    let [irradiance, specular, hilite] =
        ["diffuse", "spec", "hilite"].map(|which| cube::<R>(vectors, file, which));
    let specular_slope = specular.map(|_| [R::texel(0.0); 4]);
    Cubes { irradiance, specular, specular_slope, hilite }
}

const ALL_TERMS: Effects = Effects::SURFACE.with(Effect::Haze);

/// The parameters of a vector, under the oracle's names.
pub(crate) fn params(form: Form, constants: &Node<'_>) -> Params {
    let mut params = Params::defaults(form);
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
        match constants.get(name) {
            None => {}
            Some(list) if list.is_list() => params.set_rgb(param, list.three()),
            Some(value) => params.set(param, value.number()),
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

/// The parameters of those columns.
fn oracle_params() -> Vec<Param> {
    let mut params = ORACLE_COLUMNS.map(|(_, param, _)| param).to_vec();
    params.dedup();
    params
}

/// The parameters of a point that is given column by column, under the oracle's names.
pub(crate) fn column_params(values: &Node<'_>) -> Params {
    let mut params = Params::defaults(Form::Corrected);
    for (name, param, channel) in ORACLE_COLUMNS {
        let value = values.at(name).number();
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

/// The rules' setup for a form. The key light's rules are what reads a sample's own N; it is dark.
fn setup(form: Form, silhouette: Silhouette) -> Setup {
    Setup::new(form, silhouette, ALL_TERMS.with(Effect::KeyLight))
}

/// The rules at `params`, with the oracle's ten columns.
fn fragments<'a, R: Number>(
    setup: Setup,
    cubes: &'a Cubes<R::Texel>,
    params: &Params,
    quantities: &[&'static str],
    like: R,
) -> Fragments<'a, R> {
    let mut params = params.clone();
    params.set(Param::KeyColor, 0.0);
    Fragments::new(
        setup,
        cubes,
        &params,
        &Wanted { free: oracle_params(), quantities: quantities.to_vec() },
        like,
    )
}

/// A number of a fragment by the rules' name.
fn field<R: Real>(f: &Fragment<R>, Input { name, component }: &Input) -> R {
    f.number(name, *component).unwrap_or_else(|| panic!("a fragment has no {name}"))
}

/// `[rgba][column]`, row after row.
fn jacobian<R: Number>(shaded: &Shaded<R>, like: R) -> Vec<R> {
    let free = oracle_params();
    let entry = |c: usize, (_, param, channel): (&str, Param, Option<usize>)| {
        let slope = shaded.slopes[free.iter().position(|free| *free == param).unwrap()];
        if channel.is_none_or(|own| own == c) { slope[c] } else { like.lit(0.0) }
    };
    (0..4).flat_map(|c| ORACLE_COLUMNS.map(|column| entry(c, column))).collect()
}

fn fragment_at<R: Real>(form: Form, inputs: &Node<'_>, like: R) -> Fragment<R> {
    let lit = |x: [f64; 3]| x.map(|x| like.lit(x));
    let rows = ["X", "Y", "Z"].map(|row| inputs.at(&format!("WorldTanMatrix{row}")).three());
    let column = |i: usize| lit([rows[0][i], rows[1][i], rows[2][i]]);
    let (t, b, n) = (column(0), column(1), column(2));
    let texel = inputs.at("normSideSpec");
    let (base, bump) = decode_normal(form, lit(texel.three()), t, b, n);
    let silhouette = |i: usize| inputs.at("SkinSilhouetteVec").item(i).number();
    let view = lit(inputs.at("WorldEyeDir").three());
    let (view, dapple) = match form {
        Form::Listing => (view, silhouette(3)),
        Form::Corrected => (unit_view(view), silhouette(3).max(0.0)),
    };
    Fragment {
        base,
        bump,
        normal: n,
        view,
        occlusion: like.lit(silhouette(0)),
        silhouette: like.lit(silhouette(2)),
        dapple: like.lit(dapple),
        albedo: lit(inputs.at("skinColor").three()),
        specular: like.lit(texel.item(3).number()),
        attenuator: like.lit(inputs.at("hiLightAttenuator").number()),
    }
}

/// The rules' power, and how it moves.
const RIM: [&str; 2] = [
    include_str!("../../src/rules/shader/rules/lib/rim.wgsl"),
    include_str!("../../src/rules/shader/rules/tangent/rim_power.wgsl"),
];

fn fragment_vector<R: Number>(vectors: &Vectors, file: &Node<'_>, like: R) {
    let cubes = cubes::<R>(vectors, file);
    let expected = file.at("expected");
    for (form, silhouette, name) in
        [(Form::Corrected, Silhouette::Bumped, "corrected"), (Form::Listing, Silhouette::Vertex, "literal")]
    {
        let want = expected.at(name);
        let p = params(form, &file.at("constants").at(name));
        if want.is_null() {
            continue;
        }
        let f = fragment_at(form, &file.at("inputs"), like);
        let rules = fragments(setup(form, silhouette), &cubes, &p, &["n", "reflected", "rim"], like);
        let shaded = rules.shade(|input| field(&f, input));
        let three = |first: usize| [0, 1, 2].map(|c| shaded.quantities[first + c]);
        let (n, reflection) = (three(0), three(3));
        check("n", &n, &want.at("n"));
        check("n.V", &[dot(n, f.view)], &want.at("nDotV"));
        check("reflection", &reflection, &want.at("reflVect"));
        let places = [
            ("D", &cubes.irradiance, n),
            ("S_n", &cubes.specular, n),
            ("S_r", &cubes.specular, reflection),
            ("H", &cubes.hilite, f.view),
        ];
        for (name, cube, along) in places {
            check(name, &look_up(cube, along), &want.at(name));
        }
        check("rgba", &shaded.rgba, &want.at("rgba"));
        if form == Form::Corrected {
            check("rim", &shaded.quantities[6..], &want.at("rim"));
            let j = expected.at("corrected_jacobian");
            j.at("rows").assert_text("rgba");
            let names = j.at("columns").items();
            names.iter().zip(ORACLE_COLUMNS).for_each(|(name, (want, ..))| name.assert_text(want));
            check("Jacobian", &jacobian(&shaded, like), &j.at("J"));
        }
    }
    // S.y is S.z to the power of 2, the listing's exponent.
    let silhouette = file.at("inputs").at("SkinSilhouetteVec");
    let rim = Function::new(&RIM, "rim_power", &[1, 1]);
    let squared = rim.of(like, &[&[like.lit(silhouette.item(2).number())], &[like.lit(2.0)]]);
    check("S.y", &squared, &silhouette.item(1));
}

#[inline(never)]
fn look_up<R: Real>(cube: &Cube<R::Texel>, along: [R; 3]) -> [R; 4] {
    cube.sample(along)
}

fn rim_vector<R: Number>(file: &Node<'_>, like: R) {
    let list = |name: &str| file.at("inputs").at(name).numbers();
    let (z, exponents) = (list("f"), list("exponent"));
    let [power, tangent] = [("rim_power", 2), ("rim_power_tangent", 4)]
        .map(|(name, count)| Function::new(&RIM, name, &vec![1; count]));
    let table = |of: &dyn Fn(R, R) -> Vec<R>| -> Vec<R> {
        let each = |z: f64, e: f64| of(like.lit(z), like.lit(e));
        z.iter().flat_map(|&z| exponents.iter().flat_map(move |&e| each(z, e))).collect()
    };
    let [zero, one] = [0.0, 1.0].map(|x| like.lit(x));
    let value = |z: R, e: R| power.of(like, &[&[z], &[e]]);
    let by_exponent = |z: R, e: R| tangent.of(like, &[&[z], &[e], &[zero], &[one]]);
    check("rim", &table(&value), &file.at("expected").at("rim"));
    check("d rim / d exponent", &table(&by_exponent), &file.at("expected").at("d_exponent"));
}

fn cube_sample_vector<R: Number>(vectors: &Vectors, file: &Node<'_>, like: R) {
    let cube = cube::<R>(vectors, file, "spec");
    let along = |d: Node<'_>| look_up(&cube, d.three().map(|x| like.lit(x)));
    let got: Vec<R> = file.at("inputs").at("directions").items().into_iter().flat_map(along).collect();
    check("seamless lookups", &got, &file.at("expected").at("seamless"));
}

/// A face with its border from the neighbours; in f64, as cubes are built of texels and not of lanes.
fn border_vector(vectors: &Vectors, file: &Node<'_>) {
    let cube = cube::<f64>(vectors, file, "spec");
    let face = cube.padded()[..(cube.size() + 2).pow(2)].concat();
    check("a face with its border", &face, &file.at("expected").at("padded_face0_seamless"));
}

fn bench_vector<R: Number>(vectors: &Vectors, file: &Node<'_>, like: R) {
    let cubes = cubes::<R>(vectors, file);
    let [truth, start] = ["params", "params_init"].map(|which| {
        let params = column_params(&file.at("inputs").at(which));
        fragments(setup(Form::Corrected, Silhouette::Bumped), &cubes, &params, &[], like)
    });
    let g = file.at("inputs").at("gbuffer");
    let (mut forward, mut at_start, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..16 {
        let v = |name: &str| g.at(name).item(i).three().map(|x| like.lit(x));
        let s = |name: &str| like.lit(g.at(name).item(i).number());
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
        let [true_image, image] = [&truth, &start].map(|rules| rules.shade(|input| field(&f, input)));
        forward.extend(true_image.rgba);
        at_start.extend(image.rgba);
        rows.extend(jacobian(&image, like));
    }
    let expected = file.at("expected");
    check("forward", &forward, &expected.at("forward"));
    check("forward at the start", &at_start, &expected.at("at_init").at("forward"));
    check("Jacobian at the start", &rows, &expected.at("at_init").at("jacobian"));
}

/// The vectors of the fragment stage through one kind of number.
fn run<R: Number>(vectors: &Vectors, like: R) {
    vectors.of_kind("fragment").iter().for_each(|file| fragment_vector(vectors, file, like));
    rim_vector(&vectors.one("rim"), like);
    cube_sample_vector(vectors, &vectors.one("cube_sample"), like);
    bench_vector(vectors, &vectors.one("bench"), like);
}

/// Fragments of form `listing` in a format that rounds, within what its roundings may do: `step` relative
/// to the greatest channel, and `floor`.
fn reduced<F: Format + Send + Sync>(vectors: &Vectors, want: &str, step: f64, floor: f64) {
    let (mut compared, mut exact) = (0, 0);
    for file in vectors.of_kind("fragment") {
        let want = file.at("expected").at(want);
        // Of a frame of 1e-20 nothing is left in 16 bits: the oracle's numbers there are noise, it says.
        if want.is_null() || file.vector.name == TINY {
            continue;
        }
        let expected = want.wanted();
        let [diffuse, spec, hilite] =
            ["diffuse", "spec", "hilite"].map(|which| cube::<f32>(vectors, &file, which));
        let light = Illumination {
            irradiance: Some(diffuse),
            lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![spec] }),
            hilite: Some(hilite),
            reflected: None,
        };
        let setup = Setup::new(Form::Listing, Silhouette::Vertex, ALL_TERMS);
        let mut samples = ViewSamples { group_start: vec![0, 1], ..ViewSamples::default() };
        samples.surface = SurfaceRecords::new(Asked::EVERYTHING, 1);
        samples.surface.set(0, &fragment_at(setup.form, &file.at("inputs"), 0.0_f32), 1.0);
        let shader = FormatShader::new(setup, &light, &Params::defaults(Form::Listing)).unwrap();
        let got = shader.pixels(&samples, Emulated::<F>::new(0.0))[0];
        let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (c, (got, want)) in got.iter().zip(&expected).enumerate() {
            let bound = step * scale + floor;
            let off = (got - want).abs();
            assert!(off <= bound, "{} {}[{c}]: {got}, not {want}", file.vector.name, F::NAME);
            exact += usize::from(got == want);
            compared += 1;
        }
    }
    assert!(compared >= 40 && 2 * exact > compared, "{}: {exact} of {compared} are exact", F::NAME);
}

fn formats(vectors: &Vectors) {
    // The hilite is attenuated before it is rounded, the sum has five roundings of half a step, and the reflection's 2
    // is a step more than a `fixed` can be: 3 steps of 1/1024.
    reduced::<Declared>(vectors, "literal_fx12_rgba", 0.0, 3.0 / 1024.0);
    // The sum is taken in another order: its handful of roundings, each half a unit of 2^-10 of what it rounds.
    reduced::<Half>(vectors, "literal_half_rgba", 3.0 / 1024.0, 1e-4);
}

fn formats_vector(file: &Node<'_>) {
    file.at("tolerance").at("rule").assert_text("exact");
    let x = file.at("inputs").at("x").numbers();
    let rounded = |format: fn(f64) -> f64| x.iter().map(|&x| format(x)).collect::<Vec<_>>();
    assert_eq!(rounded(to_fixed), file.at("expected").at("fx12").wanted());
    assert_eq!(rounded(to_half), file.at("expected").at("half").wanted());
}

#[test]
fn the_listing_holds_in_its_declared_types_and_in_binary16() {
    formats(&Vectors::read(&common::vectors()));
}

#[test]
fn number_formats_round_as_the_vectors_say() {
    formats_vector(&Vectors::read(&common::vectors()).one("formats"));
}

#[test]
fn vectors_hold_in_f64() {
    run(&Vectors::read(&common::vectors()), 0.0_f64);
}

#[test]
fn vectors_hold_in_f32() {
    run(&Vectors::read(&common::vectors()), 0.0_f32);
}

#[test]
fn vectors_hold_in_simd_lanes_with_every_instruction_set_that_there_is() {
    let vectors = Vectors::read(&common::vectors());
    let levels = skinfit::simd::levels();
    #[cfg(target_arch = "x86_64")]
    if levels.len() < 3 {
        common::not_checked(&format!("this machine runs no more than {levels:?}"));
    }
    for level in levels {
        skinfit_core::with_simd!(level, simd => run(&vectors, Lanes::splat(simd, 0.0)));
    }
}

const TINY: &str = "frag_09_tiny_frame";

/// What is compared with nothing: a vector's name or kind, what its paths begin with, and why.
type LeftOut = (&'static str, &'static str, &'static str);
const LEFT_OUT: [LeftOut; 12] = [
    ("", "note", "a sentence for people"),
    ("fragment", "inputs.skinColor[3]", "the colour map's alpha, which listing 3-4 does not read"),
    (
        "fragment",
        "expected.literal_scalar_reflVect_rgba",
        "the print's scalar reflection vector: it is read as three",
    ),
    (TINY, "expected.literal_fx12_rgba", "noise, the note says: a frame of 1e-20 in 12 bits"),
    (TINY, "expected.literal_half_rgba", "noise, the note says: a frame of 1e-20 in 16 bits"),
    ("cube_sample", "expected.clamp", "lookups clamped at each face's edge: the model's are seamless"),
    (
        "study",
        "expected",
        "errors of formats over pixels that are not in the file; experiments measure their own",
    ),
    ("vertex", "inputs.uv", "texture coordinates pass through the vertex stage as they are"),
    ("vertex", "expected.SkinUVST", "texture coordinates pass through the vertex stage as they are"),
    ("vertex", "inputs.cam_pos[3]", "the 1 of a point"),
    ("vertex", "inputs.coord[3]", "the 1 of a point"),
    ("vertex", "inputs.dapple", "S.w is the z of (DappleXf N): of the matrix a row of three"),
];

/// Of the lights' vectors.
const LEFT_OUT_OF_LIGHT: [LeftOut; 2] = [
    ("", "note", "a sentence for people"),
    (
        "light",
        "inputs.cases[25].f32_rel",
        "the tolerance of evaluators in f32: what is compared here is in f64",
    ),
];

/// Every comparison that there is, in f64 or on the CPU, and then what of the files was never looked at.
#[test]
fn every_number_of_every_vector_is_compared() {
    let folder = common::vectors();
    let vectors = Vectors::read(&folder);
    run(&vectors, 0.0_f64);
    border_vector(&vectors, &vectors.one("cube_sample"));
    formats(&vectors);
    formats_vector(&vectors.one("formats"));
    vectors.of_kind("latlong").iter().for_each(bakes::latlong_vector);
    vectors.of_kind("prefilter").iter().for_each(|file| bakes::prefilter_vector(&vectors, file));
    vectors.of_kind("vertex").iter().for_each(meshes::vertex_vector);
    for file in vectors.of_kind("diffusion") {
        diffusion::clamped_vector::<f64>(&file);
        diffusion::clamped_vector::<f32>(&file);
    }
    witness::bench_on(&vectors, &evaluators::on_cpu()[..2]);
    witness::fit_of_the_bench(&vectors);
    witness::fragments_on(&vectors, &evaluators::on_cpu()[..2]);

    assert_all_compared(vectors.files.values(), &LEFT_OUT, folder == common::own_vectors());
}

/// The same of the lights and of spherical harmonics.
#[test]
fn every_number_of_the_vectors_of_lights_and_harmonics_is_compared() {
    let folder = common::vectors_light();
    let vectors = Vectors::read(&folder);
    lights::light_vector(&vectors.one("light"));
    vectors.of_kind("sh").iter().for_each(|file| harmonics::sh_vector(&vectors, file));
    let these = vectors.files.values().filter(|vector| {
        let kind = vector.root().at("kind").text();
        ["light", "sh"].contains(&kind)
    });
    assert_all_compared(these, &LEFT_OUT_OF_LIGHT, folder == common::own_vectors_light());
}

/// Nothing of the files was left without a look but what the list names, and the list names nothing else where it is
/// the files' own.
fn assert_all_compared<'v>(vectors: impl Iterator<Item = &'v Vector>, left_out: &[LeftOut], own: bool) {
    let mut used = vec![false; left_out.len()];
    let mut left = Vec::new();
    for vector in vectors {
        let root = vector.root();
        root.at("name").assert_text(&vector.name);
        let kind = root.at("kind").text();
        for path in vector.left() {
            let reason = left_out.iter().position(|(of, beginning, _)| {
                (of.is_empty() || *of == kind || *of == vector.name) && path.starts_with(beginning)
            });
            match reason {
                Some(reason) => used[reason] = true,
                None => left.push(format!("{} ({kind}): {path}", vector.name)),
            }
        }
    }
    let (count, first) = (left.len(), left.iter().take(20).cloned().collect::<Vec<_>>().join("\n"));
    assert!(
        left.is_empty(),
        "{count} numbers of the vectors are compared with nothing, nor left out with a reason:\n{first}"
    );
    if own {
        let stale: Vec<_> = left_out.iter().zip(used).filter(|(_, used)| !used).collect();
        assert!(stale.is_empty(), "these are compared after all: {stale:?}");
    }
}

#[test]
fn a_number_that_nothing_is_compared_with_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"{"name": "a", "kind": "rim", "inputs": {"x": [1, [2, null]]}, "expected": {"y": [3, "NaN"], "z": 4}}"#;
    std::fs::write(folder.path().join("a.json"), text).unwrap();
    let vectors = Vectors::read(folder.path());
    let root = vectors.one("rim");
    let left = || root.vector.left().join(" ");
    assert_eq!(left(), "expected.y[0] expected.y[1] expected.z inputs.x[0] inputs.x[1][0] name");
    root.at("inputs").at("x").item(0).number();
    // To read what is expected is not to compare with it.
    root.at("expected").at("z").number();
    root.at("expected").at("y").wanted();
    root.at("name").assert_text("a");
    assert_eq!(left(), "expected.z inputs.x[1][0]");
    let of_its_kind = std::panic::catch_unwind(|| Vectors::read(folder.path()).one("bench").is_null());
    assert!(of_its_kind.is_err(), "a kind without a file is a failure");
}

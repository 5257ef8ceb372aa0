//! Specular light with Fresnel against the vectors of an independent float64 oracle (tests/vectors_light), and its hard
//! cases: the exact integrals and filters, and the rules' functions with their derivatives.

use fearless_simd::Level;
use skinfit::bake::radial::Radial;
use skinfit::engine::lanes::Lanes;
use skinfit::model::cube::{texel_direction, texel_solid_angle};
use skinfit::shader::rule::LIBRARY;
use skinfit::simd::levels;
use skinfit_core::specular::brdf::{self, beckmann};
use skinfit_core::specular::split_sum::{Quadrature, dielectric_sum, split_sum};
use skinfit_core::specular::{SpecularModel, roughness_of};

use crate::by_rules::{Function, Number};
use crate::common::vectors_light;
use crate::vectors;
use crate::vectors::reader::{Node, Tolerance, Vectors};

const MODELS: [(SpecularModel, &str); 2] =
    [(SpecularModel::Kelemen, "specular_lights.json"), (SpecularModel::Ggx, "specular_lights_ggx.json")];

fn read() -> Vectors {
    Vectors::read(&vectors_light())
}

/// The rules' text of specular light.
fn library() -> Vec<&'static str> {
    let names = ["specular", "split_sum_kelemen", "split_sum_ggx", "dielectric_sum_ggx"];
    names.map(|name| LIBRARY.iter().find(|(known, _)| *known == name).unwrap().1).to_vec()
}

/// Numbers of 32 bits: f32, or SIMD lanes of an instruction set.
#[derive(Clone, Copy, Debug)]
enum Narrow {
    Single,
    InLanes(Level),
}

impl Narrow {
    /// All that this machine runs.
    fn all() -> Vec<Self> {
        std::iter::once(Self::Single).chain(levels().into_iter().map(Self::InLanes)).collect()
    }

    /// What is near in them, of what is in f32: lanes have exp2 and log2 by polynomials of some units in the last place, and
    /// fuse products with sums, where f32 rounds each correctly.
    fn near(self, single: Tolerance) -> Tolerance {
        match self {
            Self::Single => single,
            Self::InLanes(_) => single.times(4.0),
        }
    }
}

/// A function of the rules, and how it moves along each of the arguments `moved`.
struct Rule {
    value: Function,
    slopes: Vec<Function>,
}

impl Rule {
    fn new(name: &str, arguments: &[usize], moved: &[usize]) -> Self {
        let text = library();
        let slopes = moved.iter().map(|&at| Function::tangent(&text, name, arguments, at)).collect();
        Self { value: Function::new(&text, name, arguments), slopes }
    }

    /// The value, and then the slopes.
    fn of(&self, arguments: &[&[f64]]) -> Vec<Vec<f64>> {
        let one = [1.0];
        let with = [arguments, &[&one[..]]].concat();
        let slopes = self.slopes.iter().map(|slope| slope.of(0.0, &with));
        std::iter::once(self.value.of(0.0, arguments)).chain(slopes).collect()
    }

    /// The value in numbers of 32 bits.
    fn narrow(&self, numbers: Narrow, arguments: &[&[f64]]) -> Vec<f64> {
        match numbers {
            Narrow::Single => self.value_in(0.0_f32, arguments),
            Narrow::InLanes(level) => {
                skinfit_core::with_simd!(level, simd => self.value_in(Lanes::splat(simd, 0.0), arguments))
            }
        }
    }

    fn value_in<R: Number>(&self, like: R, arguments: &[&[f64]]) -> Vec<f64> {
        let given: Vec<Vec<R>> =
            arguments.iter().map(|list| list.iter().map(|&x| like.lit(x)).collect()).collect();
        let given: Vec<&[R]> = given.iter().map(|list| &list[..]).collect();
        self.value.of(like, &given).into_iter().map(|x| x.unpack()[0]).collect()
    }

    /// Whether the value is finite in all numbers of 32 bits.
    fn is_finite(&self, arguments: &[&[f64]]) -> bool {
        Narrow::all().into_iter().flat_map(|numbers| self.narrow(numbers, arguments)).all(f64::is_finite)
    }
}

fn brdf_rule(model: SpecularModel) -> Rule {
    // m and f0 move.
    Rule::new(&format!("{}_brdf", model.name()), &[3, 3, 3, 1, 1], &[3, 4])
}

/// Nothing of a file is left unread but what `aside` begins.
fn all_read(vectors: &Vectors, name: &str, aside: &[&str]) {
    let root = vectors.files[name].root();
    root.at("name").assert_text(&root.vector.name);
    root.at("kind").assert_text("specular");
    let known = ["note", "tolerance", "constants", "cubes_file"];
    let left: Vec<_> = root
        .vector
        .left()
        .into_iter()
        .filter(|path| known.iter().chain(aside).all(|beginning| !path.starts_with(beginning)))
        .collect();
    assert!(left.is_empty(), "{name}: {left:?}");
}

/// f64's tolerance of a file: its `f64_abs` covers what cancels.
fn double(vector: &Node<'_>) -> Tolerance {
    let given = vector.vector.root().at("tolerance");
    Tolerance { abs: given.at("f64_abs").number(), rel: given.at("f64_rel").number() }
}

fn single(file: &Node<'_>, case: &Node<'_>) -> Tolerance {
    let given = file.vector.tolerances().single;
    case.get("f32_rel").map_or(given, |rel| Tolerance { rel: rel.number(), ..given })
}

#[test]
fn lights_are_those_of_the_vectors_with_their_derivatives() {
    let vectors = read();
    let roughness_rule = Rule::new("specular_roughness", &[1, 1, 1], &[0, 1]);
    for (model, name) in MODELS {
        let rule = brdf_rule(model);
        let file = vectors.files[name].root();
        let (cases, expected) = (file.at("inputs").at("cases"), file.at("expected").at("cases"));
        for (given, want) in cases.items().iter().zip(expected.items()) {
            want.at("case").assert_text(given.at("case").text());
            let [n, view, toward] = ["n", "V", "L"].map(|name| given.at(name).three());
            let [roughness, gloss, s, f0] =
                ["roughness", "gloss", "s", "f0"].map(|name| given.at(name).number());
            let (light, weight) = (given.at("E").three(), given.at("specular_weight").three());
            let tolerance = double(&file);
            let m = roughness_rule.of(&[&[roughness], &[gloss], &[s]]).concat();
            assert_eq!(m[0], roughness_of(roughness, gloss, s));
            tolerance.check("m", &m[..1], &want.at("m"));
            let arguments: [&[f64]; 5] = [&n, &view, &toward, &m[..1], &[f0]];
            let f = rule.of(&arguments).concat();
            tolerance.check("f", &f[..1], &want.at("f_over_weight_s"));
            tolerance.check(
                "f by hand",
                &[brdf::brdf(model, n, view, toward, m[0], f0)],
                &want.at("f_over_weight_s"),
            );
            let rgb = |factor: f64| [0, 1, 2].map(|c| weight[c] * s * factor * light[c]);
            tolerance.check("radiance", &rgb(f[0]), &want.at("radiance"));
            let by_weight = [0, 1, 2].map(|c| s * f[0] * light[c]);
            tolerance.check("by weight", &by_weight, &want.at("d_specular_weight"));
            tolerance.check("by roughness", &rgb(f[1] * m[1]), &want.at("d_roughness"));
            tolerance.check("by gloss", &rgb(f[1] * m[2]), &want.at("d_gloss"));
            // At f0 = 0 a root of 1e-12 stands for 0, which counts some twenty fold.
            tolerance.times(4.0).check("by f0", &rgb(f[2]), &want.at("d_f0"));
            // With the roundings of directions that a fragment has, too.
            for numbers in Narrow::all() {
                let radiance = rgb(rule.narrow(numbers, &arguments)[0]);
                let near = numbers.near(single(&file, given));
                near.check(&format!("radiance in {numbers:?}"), &radiance, &want.at("radiance"));
            }
            parts(model, &arguments, &want, tolerance);
        }
        if model == SpecularModel::Kelemen {
            distribution_table(&file);
        }
        all_read(&vectors, name, &[]);
    }
}

/// What the oracle gives of a case beside its value.
fn parts(model: SpecularModel, arguments: &[&[f64]; 5], want: &Node<'_>, tolerance: Tolerance) {
    let three = |at: usize| <[f64; 3]>::try_from(arguments[at]).unwrap();
    let Some(at) = brdf::Angles::new(three(0), three(1), three(2)) else {
        assert!(want.at("NH").is_null() && want.at("HV").is_null() && want.at("F").is_null());
        return;
    };
    let (m, f0) = (arguments[3][0], arguments[4][0]);
    tolerance.check("N.H", &[at.cosine_squared.sqrt()], &want.at("NH"));
    tolerance.check("H.V'", &[at.half_view], &want.at("HV"));
    match model {
        SpecularModel::Kelemen => {
            tolerance.check("PH", &[beckmann(at.sine_squared, at.cosine_squared, m)], &want.at("PH"));
            tolerance.check("F", &[brdf::schlick(at.half_view, f0)], &want.at("F"));
        }
        SpecularModel::Ggx => {
            let alpha = m * m;
            let d = brdf::ggx_distribution(at.sine_squared, at.cosine_squared, alpha);
            tolerance.check("D", &[d], &want.at("D"));
            tolerance.check("vis", &[brdf::ggx_visibility(at.light, at.view, alpha)], &want.at("vis"));
            tolerance.check("F", &[brdf::dielectric(at.half_view, f0)[0]], &want.at("F"));
        }
    }
}

/// PH over N.H and m.
fn distribution_table(file: &Node<'_>) {
    let rule = Rule::new("beckmann", &[1, 1, 1], &[2]);
    let table = file.at("inputs").at("ph_table");
    let (cosines, roughnesses) = (table.at("c").numbers(), table.at("m").numbers());
    let narrow = Tolerance { rel: table.at("f32_rel").number(), ..file.vector.tolerances().single };
    let all = |of: &dyn Fn(&[&[f64]]) -> f64| -> Vec<f64> {
        let at = |c: f64, m: f64| of(&[&[1.0 - c * c], &[c * c], &[m]]);
        cosines
            .iter()
            .flat_map(|&c| roughnesses.iter().map(move |&m| (c, m)))
            .map(|(c, m)| at(c, m))
            .collect()
    };
    let expected = file.at("expected");
    double(file).check("PH", &all(&|at| rule.of(at)[0][0]), &expected.at("ph_table"));
    double(file).check("PH by m", &all(&|at| rule.of(at)[1][0]), &expected.at("d_ph_table"));
    for numbers in Narrow::all() {
        let found = all(&|at| rule.narrow(numbers, at)[0]);
        numbers.near(narrow).check(&format!("PH in {numbers:?}"), &found, &expected.at("ph_table"));
    }
}

#[test]
fn split_sums_are_those_of_the_vectors_and_the_rules_fits_are_near_them() {
    let vectors = read();
    for (model, name) in [
        (SpecularModel::Kelemen, "specular_split_sum.json"),
        (SpecularModel::Ggx, "specular_split_sum_ggx.json"),
    ] {
        let file = vectors.files[name].root();
        let (inputs, expected, tolerance) = (file.at("inputs"), file.at("expected"), double(&file));
        let [views, roughnesses, f0s] = ["NV", "m", "f0"].map(|name| inputs.at(name).numbers());
        let places: Vec<(f64, f64)> =
            views.iter().flat_map(|&view| roughnesses.iter().map(move |&m| (view, m))).collect();
        let sums: Vec<_> = places.iter().map(|&(v, m)| split_sum(model, v, m, Quadrature::FINE)).collect();
        for (i, (value, slope)) in [("a", "da_dm"), ("b", "db_dm")].into_iter().enumerate() {
            let all = |of: &dyn Fn(usize) -> f64| (0..places.len()).map(of).collect::<Vec<_>>();
            tolerance.check(value, &all(&|k| sums[k][i].value), &expected.at(value));
            tolerance.check(slope, &all(&|k| sums[k][i].by_roughness), &expected.at(slope));
        }
        let fit = Rule::new(&format!("split_sum_{}", model.name()), &[1, 1], &[0, 1]);
        let fitted: Vec<Vec<Vec<f64>>> = places.iter().map(|&(v, m)| fit.of(&[&[v], &[m]])).collect();
        // The fits' stated error, and in 32 bits some roundings of sums of up to 5.
        let stated = Tolerance { abs: 2e-4, rel: 0.0 };
        let single = Tolerance { abs: 2.1e-4, rel: 0.0 };
        for (i, value) in ["a", "b"].into_iter().enumerate() {
            let column: Vec<f64> = fitted.iter().map(|of| of[0][i]).collect();
            stated.check("fit", &column, &expected.at(value));
            for numbers in Narrow::all() {
                let at = |&(v, m): &(f64, f64)| fit.narrow(numbers, &[&[v], &[m]])[i];
                let narrow: Vec<f64> = places.iter().map(at).collect();
                single.check(&format!("fit in {numbers:?}"), &narrow, &expected.at(value));
            }
        }
        // An error of 2e-4 that turns within a tenth of the range of m.
        let slopes = Tolerance { abs: 1e-2, rel: 0.0 };
        for (i, slope) in ["da_dm", "db_dm"].into_iter().enumerate() {
            let column: Vec<f64> = fitted.iter().map(|of| of[2][i]).collect();
            slopes.check("fit by m", &column, &expected.at(slope));
        }
        match model {
            SpecularModel::Kelemen => {
                let furnace = |f0: &f64| sums.iter().map(|[a, b]| f0 * a.value + b.value).collect::<Vec<_>>();
                let all: Vec<f64> = f0s.iter().flat_map(furnace).collect();
                tolerance.check("furnace", &all, &expected.at("furnace"));
            }
            SpecularModel::Ggx => {
                let all: Vec<_> = f0s
                    .iter()
                    .flat_map(|&f0| places.iter().map(move |&(v, m)| (f0, v, m)))
                    .map(|(f0, v, m)| dielectric_sum(model, v, m, f0, Quadrature::FINE))
                    .collect();
                let column = |of: &dyn Fn(usize) -> f64| (0..all.len()).map(of).collect::<Vec<_>>();
                tolerance.check("es", &column(&|k| all[k].0.value), &expected.at("es_dielectric"));
                tolerance.check("by m", &column(&|k| all[k].0.by_roughness), &expected.at("d_es_dm"));
                tolerance.check("by f0", &column(&|k| all[k].1), &expected.at("d_es_df0"));
                dielectric_fit(&f0s, &places, &expected);
            }
        }
        all_read(&vectors, name, &[]);
    }
}

/// The rules' split sum with a dielectric's Fresnel factor and its slopes beside the vectors'.
fn dielectric_fit(f0s: &[f64], places: &[(f64, f64)], expected: &Node<'_>) {
    let fit = Rule::new("dielectric_sum_ggx", &[1, 1, 1], &[1, 2]);
    let all: Vec<[[f64; 1]; 3]> =
        f0s.iter().flat_map(|&f0| places.iter().map(move |&(v, m)| [[v], [m], [f0]])).collect();
    let column = |of: &dyn Fn(&[&[f64]]) -> f64| -> Vec<f64> {
        all.iter().map(|at| of(&at.each_ref().map(|x| &x[..]))).collect()
    };
    // The fit's stated error, and in 32 bits some roundings of sums of up to 5.
    let [stated, single] = [3e-4, 3.2e-4].map(|abs| Tolerance { abs, rel: 0.0 });
    stated.check("dielectric", &column(&|at| fit.of(at)[0][0]), &expected.at("es_dielectric"));
    for numbers in Narrow::all() {
        let narrow = column(&|at| fit.narrow(numbers, at)[0]);
        single.check(&format!("dielectric in {numbers:?}"), &narrow, &expected.at("es_dielectric"));
    }
    // That error turns within a tenth of the range of m, and within about as much as f0 is.
    let [by_m, by_f0] = [2e-2, 3e-2].map(|abs| Tolerance { abs, rel: 0.0 });
    by_m.check("dielectric by m", &column(&|at| fit.of(at)[1][0]), &expected.at("d_es_dm"));
    by_f0.check("dielectric by f0", &column(&|at| fit.of(at)[2][0]), &expected.at("d_es_df0"));
}

/// The nodes of a quadrature of the sphere that a cube's texels are even in: directions with solid angles, and the
/// texel.
fn sphere(size: usize, splits: usize) -> Vec<([f64; 3], f64, [usize; 3])> {
    let fine = size * splits;
    let node = |i: usize| {
        let (face, row, column) = (i / (fine * fine), i / fine % fine, i % fine);
        let texel = [face, column / splits, row / splits];
        (texel_direction(face, column, row, fine), texel_solid_angle(column, row, fine), texel)
    };
    (0..6 * fine * fine).map(node).collect()
}

#[test]
fn the_environment_in_a_lobe_is_that_of_the_vectors() {
    let vectors = read();
    let file = vectors.files["specular_environment.json"].root();
    let (inputs, expected) = (file.at("inputs"), file.at("expected"));
    let cube = vectors::cube::<f64>(&vectors, &file, "spec");
    let directions: Vec<[f64; 3]> = inputs.at("directions").items().iter().map(Node::three).collect();
    let linear = inputs.at("linear_env");
    let (base, along) = (linear.at("a").number(), linear.at("b").three());
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let splits = 48;
    let nodes = sphere(4, splits);
    let filtered = |radial: Radial, r: [f64; 3]| -> [f64; 5] {
        let mut sums = [0.0; 6];
        for &(d, solid_angle, [face, column, row]) in &nodes {
            let weight = solid_angle * radial.weight(dot(r, d));
            if weight > 0.0 {
                let texel = cube.texel(face, column, row);
                (0..3).for_each(|c| sums[c] += weight * texel[c]);
                sums[3] += weight * dot(r, d);
                sums[4] += weight * (base + dot(along, d));
                sums[5] += weight;
            }
        }
        [0, 1, 2, 3, 4].map(|i| sums[i] / sums[5])
    };
    // The midpoint rule over cells of 0.008 radians: of the sharpest lobe's deviation, 0.14, the 18th part; its
    // square over 24, times what the light varies.
    let (near, steep) = (Tolerance { abs: 1e-4, rel: 0.0 }, Tolerance { abs: 1e-3, rel: 0.0 });
    for (model, name, value, slope) in [
        (SpecularModel::Kelemen, "m", "E_r", "dE_r_dm"),
        (SpecularModel::Ggx, "m_ggx", "E_r_ggx", "dE_r_ggx_dm"),
    ] {
        let (mut values, mut slopes, mut cosines, mut lights) = (vec![], vec![], vec![], vec![]);
        for m in inputs.at(name).numbers() {
            let h = 1e-4;
            for (i, &r) in directions.iter().enumerate() {
                let at = filtered(Radial::Brdf(model, m), r);
                let [above, below] = [m + h, m - h].map(|m| filtered(Radial::Brdf(model, m), r));
                values.extend(&at[..3]);
                slopes.extend((0..3).map(|c| (above[c] - below[c]) / (2.0 * h)));
                lights.push(at[4]);
                if i == 0 {
                    cosines.push(at[3]);
                }
            }
        }
        near.check("E_r", &values, &expected.at(value));
        steep.check("E_r by m", &slopes, &expected.at(slope));
        if model == SpecularModel::Kelemen {
            near.check("mean cosine", &cosines, &expected.at("mean_cosine"));
            near.check("linear", &lights, &expected.at("linear_env"));
        }
    }
    all_read(&vectors, "specular_environment.json", &[]);
}

#[test]
fn occlusion_and_off_peak_directions_are_those_of_the_vectors() {
    let vectors = read();
    let file = vectors.files["specular_choices.json"].root();
    let (inputs, expected, tolerance) = (file.at("inputs"), file.at("expected"), double(&file));
    let rule = Rule::new("lagarde_visibility", &[1, 1, 1], &[0, 1, 2]);
    let [views, opens, roughnesses] = ["NV", "occ", "m"].map(|name| inputs.at(name).numbers());
    let mut columns = [const { Vec::new() }; 4];
    let mut places = Vec::new();
    for &view in &views {
        for &open in &opens {
            for &m in &roughnesses {
                let all = rule.of(&[&[view], &[open], &[m]]).concat();
                columns.iter_mut().zip(all).for_each(|(column, x)| column.push(x));
                places.push([[view], [open], [m]]);
            }
        }
    }
    for (column, name) in columns.iter().zip(["value", "d_NV", "d_occ", "d_m"]) {
        tolerance.check(name, column, &expected.at("lagarde").at(name));
    }
    for numbers in Narrow::all() {
        let at = |place: &[[f64; 1]; 3]| rule.narrow(numbers, &place.each_ref().map(|x| &x[..]))[0];
        let found: Vec<f64> = places.iter().map(at).collect();
        let near = numbers.near(single(&file, &file));
        near.check(&format!("lagarde in {numbers:?}"), &found, &expected.at("lagarde").at("value"));
    }
    let rule = Rule::new("off_peak_direction", &[3, 3, 1], &[2]);
    let given = inputs.at("off_peak");
    let alphas = given.at("alpha").numbers();
    for (i, &alpha) in alphas.iter().enumerate() {
        let (n, r) = (given.at("n").item(i).three(), given.at("R").item(i).three());
        let got = rule.of(&[&n, &r, &[alpha]]);
        let off_peak = expected.at("off_peak");
        tolerance.check("off peak", &got[0], &off_peak.at("direction").item(i));
        for numbers in Narrow::all() {
            let found = rule.narrow(numbers, &[&n, &r, &[alpha]]);
            let near = numbers.near(single(&file, &file));
            near.check(&format!("off peak in {numbers:?}"), &found, &off_peak.at("direction").item(i));
        }
        let slope = off_peak.at("d_alpha").item(i);
        if slope.is_null() {
            assert!(got[1].iter().all(|x| x.is_finite()));
        } else {
            tolerance.check("off peak by alpha", &got[1], &slope);
        }
    }
    all_read(&vectors, "specular_choices.json", &[]);
}

/// The share of the cap about `a` of that cosine which lies in the cap about `b`, by points spread evenly over it.
fn shared(a: [f64; 3], a_cosine: f64, b: [f64; 3], b_cosine: f64) -> f64 {
    // `a` is the z axis.
    assert_eq!(a, [0.0, 0.0, 1.0]);
    let count = 4000;
    let inside = (0..count).filter(|&k| {
        let z = 1.0 - (1.0 - a_cosine) * (f64::from(k) + 0.5) / f64::from(count);
        // Golden angles.
        let (sine, cosine) = (f64::from(k) * 2.399_963_229_728_653).sin_cos();
        let across = (1.0 - z * z).sqrt();
        across * cosine * b[0] + across * sine * b[1] + z * b[2] >= b_cosine
    });
    inside.count() as f64 / f64::from(count)
}

#[test]
fn cones_overlap_as_caps_of_the_sphere_do() {
    let rule = Rule::new("cone_visibility", &[1, 1, 1], &[0, 1, 2]);
    let mut worst = 0.0_f64;
    for degrees in [0.0, 10.0, 30.0, 50.0, 80.0, 120.0, 180.0_f64] {
        for occ in [0.0, 0.05, 0.3, 0.6, 0.9, 1.0_f64] {
            for alpha in [0.0025, 0.05, 0.2, 0.5, 1.0_f64] {
                let (sine, cosine) = degrees.to_radians().sin_cos();
                let all = rule.of(&[&[cosine], &[occ], &[alpha]]).concat();
                assert!(all.iter().all(|x| x.is_finite()), "{degrees} {occ} {alpha}: {all:?}");
                assert!(rule.is_finite(&[&[cosine], &[occ], &[alpha]]), "{degrees} {occ} {alpha}");
                let (open, lobe) = ((1.0 - occ).sqrt(), 10_f64.powf(-alpha * alpha));
                let want = shared([0.0, 0.0, 1.0], lobe, [sine, 0.0, cosine], open);
                assert!((0.0..=1.0 + 1e-9).contains(&all[0]), "{degrees} {occ} {alpha}: {}", all[0]);
                worst = worst.max((all[0] - want).abs());
            }
        }
    }
    // A cubic in the place of the lens of two caps (Oat and Sander 2007).
    assert!(worst < 0.11, "{worst}");
}

#[test]
fn values_and_derivatives_are_finite_in_hard_cases() {
    let up = [0.0, 0.0, 1.0];
    // Angles from the normal, towards either side: facing, oblique, grazing, level, below.
    let right: f64 = std::f64::consts::FRAC_PI_2;
    let angles = [0.0, 0.7, 1.57, right - 3e-7, right, 1.6, -0.7, -1.57, 3e-8 - right];
    let along = |angle: f64| [angle.sin(), 0.0, angle.cos()];
    for (model, _) in MODELS {
        let rule = brdf_rule(model);
        for view in angles.map(along).map(|d| d.map(|x| -x)).into_iter().chain([[0.0; 3]]) {
            for toward in angles.map(along).into_iter().chain([[0.0; 3]]) {
                for m in [0.05, 0.35, 1.0] {
                    for f0 in [0.0, 1e-30, 1e-8, 0.028, 0.2, 1.0] {
                        let arguments: [&[f64]; 5] = [&up, &view, &toward, &[m], &[f0]];
                        let all = rule.of(&arguments).concat();
                        assert!(
                            all.iter().all(|x| x.is_finite()) && rule.is_finite(&arguments),
                            "{model:?} {view:?} {toward:?} {m} {f0}: {all:?}"
                        );
                    }
                }
            }
        }
        let fit = Rule::new(&format!("split_sum_{}", model.name()), &[1, 1], &[0, 1]);
        for view in [-1.0, 0.0, 1e-30, 1e-6, 1e-3, 0.5, 1.0, 1.0 + 1e-7] {
            for m in [0.05, 0.35, 1.0] {
                let arguments: [&[f64]; 2] = [&[view], &[m]];
                let all = fit.of(&arguments).concat();
                assert!(
                    all.iter().all(|x| x.is_finite()) && fit.is_finite(&arguments),
                    "{view} {m}: {all:?}"
                );
                // A white furnace yields at most what it has.
                assert!(all[0] >= 0.0 && all[1] >= 0.0 && all[0] + all[1] <= 1.0, "{view} {m}: {all:?}");
            }
        }
    }
    let fit = Rule::new("dielectric_sum_ggx", &[1, 1, 1], &[0, 1, 2]);
    for view in [-1.0, 0.0, 1e-30, 1e-6, 1e-3, 0.5, 1.0, 1.0 + 1e-7] {
        for m in [0.05, 0.35, 1.0] {
            for f0 in [0.0, 1e-30, 1e-8, 0.028, 0.2, 1.0] {
                let arguments: [&[f64]; 3] = [&[view], &[m], &[f0]];
                let all = fit.of(&arguments).concat();
                assert!(
                    all.iter().all(|x| x.is_finite()) && fit.is_finite(&arguments),
                    "{view} {m} {f0}: {all:?}"
                );
                assert!((0.0..=1.0).contains(&all[0]), "{view} {m} {f0}: {all:?}");
            }
        }
    }
}

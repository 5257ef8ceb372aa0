//! One light's term, its parts and its derivatives, and a table of the distribution of slopes.

use skinfit_core::specular::brdf::{self, beckmann};
use skinfit_core::specular::{SpecularModel, roughness_of};

use super::{MODELS, Rule, all_read, brdf_rule, double, near, read};
use crate::by_rules::Kind;
use crate::vectors::reader::{Node, Tolerance};

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
            for kind in Kind::narrow() {
                let radiance = rgb(rule.of_kind(kind, &arguments)[0]);
                let near = kind.near(near(&file, given));
                near.check(&format!("radiance in {kind:?}"), &radiance, &want.at("radiance"));
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
    for kind in Kind::narrow() {
        let found = all(&|at| rule.of_kind(kind, at)[0]);
        kind.near(near(file, &table)).check(&format!("PH in {kind:?}"), &found, &expected.at("ph_table"));
    }
}

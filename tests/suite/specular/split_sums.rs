//! The split sum: its integrals, and the rules' functions that stand for them.

use skinfit_core::specular::SpecularModel;
use skinfit_core::specular::split_sum::{Quadrature, dielectric_sum, split_sum};

use super::{Rule, all_read, double, read};
use crate::by_rules::Kind;
use crate::vectors::reader::{Node, Tolerance};

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
            for kind in Kind::narrow() {
                let at = |&(v, m): &(f64, f64)| fit.of_kind(kind, &[&[v], &[m]])[i];
                let narrow: Vec<f64> = places.iter().map(at).collect();
                single.check(&format!("fit in {kind:?}"), &narrow, &expected.at(value));
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
    for kind in Kind::narrow() {
        let narrow = column(&|at| fit.of_kind(kind, at)[0]);
        single.check(&format!("dielectric in {kind:?}"), &narrow, &expected.at("es_dielectric"));
    }
    // That error turns within a tenth of the range of m, and within about as much as f0 is.
    let [by_m, by_f0] = [2e-2, 3e-2].map(|abs| Tolerance { abs, rel: 0.0 });
    by_m.check("dielectric by m", &column(&|at| fit.of(at)[1][0]), &expected.at("d_es_dm"));
    by_f0.check("dielectric by f0", &column(&|at| fit.of(at)[2][0]), &expected.at("d_es_df0"));
}

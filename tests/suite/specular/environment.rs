//! The environment through a lobe, and how much of a lobe is open, where it is looked up.

use skinfit::bake::radial::Radial;
use skinfit::model::cube::{texel_direction, texel_solid_angle};
use skinfit_core::specular::SpecularModel;

use super::{Rule, all_read, double, near, read};
use crate::by_rules::Kind;
use crate::vectors;
use crate::vectors::reader::{Node, Tolerance};

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
    for kind in Kind::narrow() {
        let at = |place: &[[f64; 1]; 3]| rule.of_kind(kind, &place.each_ref().map(|x| &x[..]))[0];
        let found: Vec<f64> = places.iter().map(at).collect();
        let near = kind.near(near(&file, &file));
        near.check(&format!("lagarde in {kind:?}"), &found, &expected.at("lagarde").at("value"));
    }
    let rule = Rule::new("off_peak_direction", &[3, 3, 1], &[2]);
    let given = inputs.at("off_peak");
    let alphas = given.at("alpha").numbers();
    for (i, &alpha) in alphas.iter().enumerate() {
        let (n, r) = (given.at("n").item(i).three(), given.at("R").item(i).three());
        let got = rule.of(&[&n, &r, &[alpha]]);
        let off_peak = expected.at("off_peak");
        tolerance.check("off peak", &got[0], &off_peak.at("direction").item(i));
        for kind in Kind::narrow() {
            let found = rule.of_kind(kind, &[&n, &r, &[alpha]]);
            let near = kind.near(near(&file, &file));
            near.check(&format!("off peak in {kind:?}"), &found, &off_peak.at("direction").item(i));
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

//! Hard cases of the rules' functions, and cones beside the caps of the sphere that they stand for.

use super::{MODELS, Rule, brdf_rule};

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

//! Bakes against the vectors, the independent renderer, closed forms and a brute-force filter.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::RangeInclusive;
use std::time::Instant;

use glam::{DMat4, DVec3, Vec3};
use rayon::prelude::*;
use skinfit::bake::panorama::{Radiance, sample_latlong, to_cube};
use skinfit::bake::prefilter::{Prefilter, by_brute_force};
use skinfit::bake::{BakeStats, LobeStack, Ranges, bake};
use skinfit::model::cube::{Cube, texel_direction, texel_solid_angle};
use skinfit::model::effects::{Effect, Effects};
use skinfit::scene::Scene;
use skinfit::scene::maps::{Environment, Map, Spots};
use skinfit::scene::mesh::PosedMesh;
use skinfit::scene::view::Camera;

use crate::common;
use crate::fixtures::{bare_scene, correlation, environment, json, numbers, quantile, read_exr};
use crate::vectors;
use crate::vectors::reader::{Node, Tolerance, Vectors};

#[test]
fn latlong_lookup_and_resampling_meet_the_vectors() {
    Vectors::read(&common::vectors()).of_kind("latlong").iter().for_each(latlong_vector);
}

pub(crate) fn latlong_vector(file: &Node<'_>) {
    let tolerance = file.vector.tolerances().double;
    let (inputs, expected) = (file.at("inputs"), file.at("expected"));
    let height = inputs.at("image").items().len();
    let image = inputs.at("image").numbers();
    let width = image.len() / height / 3;
    let texel = |x: usize, y: usize| std::array::from_fn(|c| image[(y * width + x) * 3 + c]);
    let lookup = |d: [f64; 3]| sample_latlong::<3>(width, height, texel, d);
    let samples = inputs.at("directions").items().into_iter().flat_map(|d| lookup(d.three()));
    tolerance.check("samples", &samples.collect::<Vec<_>>(), &expected.at("samples"));
    for (name, sub) in [("cube_3", 1), ("cube_3_sub4", 4)] {
        let cube = to_cube(3, sub, lookup);
        let got: Vec<f64> = (0..54).flat_map(|i| cube.texel(i / 9, i % 3, i / 3 % 3)[..3].to_vec()).collect();
        tolerance.check(name, &got, &expected.at(name));
    }
}

#[test]
fn the_brute_force_filter_meets_the_vectors_and_the_fast_one_meets_it() {
    let vectors = Vectors::read(&common::vectors());
    vectors.of_kind("prefilter").iter().for_each(|file| prefilter_vector(&vectors, file));
}

pub(crate) fn prefilter_vector(vectors: &Vectors, file: &Node<'_>) {
    let cube = vectors::cube::<f64>(vectors, file, "spec");
    let directions: Vec<[f64; 3]> =
        file.at("inputs").at("directions").items().iter().map(Node::three).collect();
    let exponents = file.at("inputs").at("exponents").numbers();
    let filtered = |cube: &Cube<f64>, splits: usize| -> Vec<f64> {
        let by = |&exponent: &f64| {
            directions
                .iter()
                .flat_map(move |&d| by_brute_force(cube, d, exponent, splits))
                .collect::<Vec<_>>()
        };
        exponents.iter().flat_map(by).collect()
    };
    // Sums of 24576 terms may round in another order.
    let tolerance = file.vector.tolerances().double.times(100.0);
    for (name, splits) in [("texel_centres", 1), ("converged", 16)] {
        tolerance.check(name, &filtered(&cube, splits), &file.at("expected").at(name));
    }
    linear_vector(&file.at("expected").at("linear_env"), &filtered);
    // The fast filter takes the cells of a finer cube with the same light.
    let fine = Cube::from_fn(64, |face, column, row| cube.texel(face, column / 16, row / 16));
    let prefilter = Prefilter::new(&fine);
    for exponent in [1.0, 8.0, 32.0] {
        let got = prefilter.lobe(4, exponent, |_| {});
        for i in (0..96).step_by(7) {
            let (face, column, row) = (i / 16, i % 4, i / 4 % 4);
            let want = by_brute_force(&cube, texel_direction(face, column, row, 4), exponent, 32);
            for c in 0..3 {
                let error = (f64::from(got.texel(face, column, row)[c]) - want[c]).abs();
                // The cells' tolerance is 1e-4 of the mean radiance each; hundreds add up at random.
                assert!(error < 1e-3, "exponent {exponent}, {i}: {error}");
            }
        }
    }
}

/// Light that grows linearly along a direction: its texels, and its lobes in closed form.
fn linear_vector(file: &Node<'_>, filtered: &impl Fn(&Cube<f64>, usize) -> Vec<f64>) {
    let (a, b) = (file.at("a").wanted()[0], file.at("b").wanted());
    let light = |d: [f64; 3]| a + (0..3).map(|i| b[i] * d[i]).sum::<f64>();
    let cube = |size: usize| {
        Cube::from_fn(size, |face, column, row| {
            [light(texel_direction(face, column, row, size)), 0.0, 0.0, 0.0]
        })
    };
    let texels = cube(4);
    let red: Vec<f64> = (0..96).map(|i| texels.texel(i / 16, i % 4, i / 4 % 4)[0]).collect();
    file.vector.tolerances().double.check("texels", &red, &file.at("cube_texels_red"));
    let red: Vec<f64> = filtered(&cube(64), 1).into_iter().step_by(4).collect();
    // Texels of 1/64 of a face, each taken at its centre: (1/32)^2 / 24 of the light's slope and of the lobe's.
    Tolerance { abs: 2e-4, rel: 0.0 }.check("lobes", &red, &file.at("closed_form"));
}

#[test]
fn a_linear_environment_is_filtered_to_its_closed_form() {
    // a + b.w becomes a + (e+1)/(e+2) b.r; in the file's own numbers where it is at hand.
    let (a, b) = (2.0, [0.3, -0.8, 0.5]);
    let linear = |d: [f64; 3]| a + (0..3).map(|i| b[i] * d[i]).sum::<f64>();
    let prefilter = Prefilter::new(&to_cube(128, 2, |d| [linear(d), 1.0, 0.0]));
    for exponent in [1.0, 2.0, 8.0, 32.0, 300.0, 2048.0] {
        let cube = prefilter.lobe(9, exponent, |_| {});
        let mut worst = 0.0_f64;
        for i in 0..6 * 81 {
            let (face, column, row) = (i / 81, i % 9, i / 9 % 9);
            let d = texel_direction(face, column, row, 9);
            let want = a + (exponent + 1.0) / (exponent + 2.0) * (linear(d) - a);
            worst = worst.max((f64::from(cube.texel(face, column, row)[0]) - want).abs());
        }
        println!("exponent {exponent}: worst error {worst:.1e}");
        crate::figures::measured("bakes linear", worst);
        // Half a standard deviation a cell, corrected to second order; at exponents below 4 the
        // horizon cuts through cells.
        assert!(worst < 5e-4, "exponent {exponent}: {worst}");
    }
}

#[test]
fn a_constant_environment_bakes_to_exactly_that_constant() {
    for constant in [1.0, 0.37, 65504.0, 1e-3] {
        let constant = f64::from(constant as f32);
        let prefilter = Prefilter::new(&to_cube(32, 2, |_| [constant; 3]));
        for exponent in [1.0, 2.0, 5.7, 64.0, 2048.0] {
            let cube = prefilter.lobe(5, exponent, |_| {});
            assert!(cube.padded().iter().all(|t| *t == [constant as f32; 4]), "{constant} {exponent}");
        }
    }
}

#[test]
fn extremes_beside_black_stay_finite_and_within_range() {
    let light = |d: [f64; 3]| if d[0] > 0.999 { [65504.0, 0.0, 1e-30] } else { [0.0; 3] };
    let prefilter = Prefilter::new(&to_cube(64, 2, light));
    for exponent in [1.0, 3.0, 100.0, 2048.0] {
        let cube = prefilter.lobe(16, exponent, |_| {});
        assert!(cube.padded().iter().flatten().all(|x| (0.0..=65504.0).contains(x)), "{exponent}");
    }
    let dark = Prefilter::new(&to_cube(8, 2, |_| [0.0; 3])).lobe(4, 7.0, |_| {});
    assert!(dark.padded().iter().all(|t| *t == [0.0; 4]));
}

/// Root mean square and worst of |got - want| / (want + 1/2): relative where it is bright, and of
/// the environments' mean radiance (0.3 to 1.1) where it is dark.
fn errors(cube: &Cube<f32>, truth: &[[f64; 4]], texels: &[(usize, usize, usize)]) -> (f64, f64) {
    let (mut squares, mut worst) = (0.0, 0.0_f64);
    for (&(face, column, row), want) in texels.iter().zip(truth) {
        for c in 0..3 {
            let error = (f64::from(cube.texel(face, column, row)[c]) - want[c]).abs() / (want[c] + 0.5);
            squares += error * error;
            worst = worst.max(error);
        }
    }
    ((squares / (3 * truth.len()) as f64).sqrt(), worst)
}

#[test]
fn real_environments_are_filtered_close_to_convergence() {
    let Some(data) = common::data() else { return };
    for name in ["forest", "sunrise"] {
        let environment = environment(&data.join(format!("env/{name}.exr")), 0.0);
        let since = Instant::now();
        let radiance = Radiance::new(&environment);
        let prefilter = Prefilter::of(&radiance);
        println!("{name}: environment {:.2} s", since.elapsed().as_secs_f64());
        let source = radiance.to_cube(256);
        for exponent in [1.0, 4.0, 16.0, 64.0, 512.0, 2048.0] {
            let since = Instant::now();
            let cube = prefilter.lobe(64, exponent, |_| {});
            let seconds = since.elapsed().as_secs_f64();
            let texels: Vec<_> = (0..6).map(|i| (i, 8 + i * 37 % 50, 5 + i * 53 % 50)).collect();
            let splits = if exponent > 100.0 { 2 } else { 1 };
            let truth: Vec<_> = (texels.par_iter())
                .map(|&(f, c, r)| by_brute_force(&source, texel_direction(f, c, r, 64), exponent, splits))
                .collect();
            let (rms, worst) = errors(&cube, &truth, &texels);
            println!("  exponent {exponent}: {seconds:.3} s, error rms {rms:.1e}, worst {worst:.1e}");
            crate::figures::measured("bakes prefilter rms", rms);
            crate::figures::measured("bakes prefilter worst", worst);
            // A cell may err by 3e-5 of the mean radiance; a thousand cells add up at random.
            assert!(rms < 5e-4 && worst < 2e-3, "{name}, exponent {exponent}: {rms} {worst}");
        }
    }
}

/// Exponents of E_s; nothing else is looked up.
fn within(exponents: RangeInclusive<f64>) -> Ranges {
    Ranges { exponents, roughnesses: 1.0..=1.0 }
}

#[test]
fn bakes_are_the_same_for_any_number_of_threads() {
    let scene = small_scene();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        format!("{:?}", pool.install(|| bake(&scene, &triangle, &within(20.0..=20.0), None).unwrap().0))
    };
    let one = run(1);
    assert!((2..=4).all(|threads| run(threads) == one));
}

#[test]
fn the_cube_has_the_flux_of_the_panorama() {
    let Some(data) = common::data() else { return };
    for name in ["forest", "sunrise", "studio", "dawn"] {
        let environment = environment(&data.join(format!("env/{name}.exr")), 21.0);
        let map = &environment.panorama;
        let edge = |y: usize| (y as f64 / map.height as f64 * std::f64::consts::PI).cos();
        let mut want = [0.0; 3];
        for (i, texel) in map.texels.iter().enumerate() {
            let y = i / map.width;
            let solid_angle = (edge(y) - edge(y + 1)) * std::f64::consts::TAU / map.width as f64;
            (0..3).for_each(|c| want[c] += f64::from(texel[c]) * solid_angle);
        }
        for size in [32, 128, 256] {
            let cube = Radiance::new(&environment).to_cube(size);
            let mut got = [0.0; 3];
            for i in 0..6 * size * size {
                let (face, column, row) = (i / (size * size), i % size, i / size % size);
                let solid_angle = texel_solid_angle(column, row, size);
                (0..3).for_each(|c| got[c] += cube.texel(face, column, row)[c] * solid_angle);
            }
            let errors = [0, 1, 2].map(|c| got[c] / want[c] - 1.0);
            println!("{name}, cube of {size}: flux {errors:.5?}");
            for error in errors {
                crate::figures::measured(&format!("bakes flux {size}"), error.abs());
            }
            // Three samples a texel, bilinear: parts in a thousand where a sun holds half the flux.
            assert!(errors.iter().all(|e| e.abs() < 2e-3), "{name}, {size}: {errors:?}");
        }
    }
}

#[test]
fn between_its_cubes_the_stack_is_near_a_cube_baked_for_that_exponent() {
    let Some(data) = common::data() else { return };
    for (name, bounds) in [("forest", [0.01, 6e-4]), ("sunrise", [0.02, 1.5e-3])] {
        let light = environment(&data.join(format!("env/{name}.exr")), 0.0);
        let radiance = Radiance::new(&light);
        let prefilter = Prefilter::of(&radiance);
        let baked = [1.5, 6.0, 24.0, 45.0, 100.0, 400.0, 1500.0]
            .map(|exponent| (exponent, prefilter.lobe(16, exponent, |_| {})));
        for (per_octave, bound) in [(1, bounds[0]), (2, bounds[1])] {
            let exponents = skinfit::bake::lobes::knots(&(1.0..=2048.0), per_octave);
            let cubes = exponents.iter().map(|&e| prefilter.lobe(16, e, |_| {})).collect();
            let stack = LobeStack { exponents, cubes };
            for (exponent, want) in &baked {
                let got = stack.at(*exponent).0;
                let (mut squares, mut total) = (0.0, 0.0);
                for (g, w) in got.padded().iter().zip(want.padded()) {
                    squares += (0..3).map(|c| f64::from(g[c] - w[c]).powi(2)).sum::<f64>();
                    total += (0..3).map(|c| f64::from(w[c]).powi(2)).sum::<f64>();
                }
                let error = (squares / total).sqrt();
                println!(
                    "{name}, {per_octave} an octave, exponent {exponent}: {error:.1e} rms of the cube's"
                );
                crate::figures::measured(&format!("bakes between {name} {per_octave}"), error);
                // Around a sun the lobe's value is (e+1) cos^e, far from a cubic over an octave; over
                // half of one the error is 2^4 times smaller.
                assert!(error < bound, "{name} {per_octave} {exponent}: {error}");
            }
        }
    }
}

/// For each pixel within `inside` of the ball's radius, what `radiance(normal, view)` gives and
/// what the image holds.
fn ball(
    calib: &serde_json::Value,
    image: &[[f32; 3]],
    inside: f64,
    taps: &[(f64, f64, f64)],
    radiance: impl Fn(DVec3, DVec3) -> [f64; 3] + Sync,
) -> Vec<([f64; 3], [f32; 3])> {
    let rows: [f64; 16] = numbers(&calib["camera"]["world_to_camera"]).try_into().unwrap();
    let camera = Camera::pinhole(
        DMat4::from_cols_array(&rows).transpose(),
        calib["camera"]["yfov_rad"].as_f64().unwrap(),
        [384, 384],
    );
    let centre = DVec3::from_slice(&numbers(&calib["ball"]["center"]));
    let radius = calib["ball"]["radius"].as_f64().unwrap();
    let eye = camera.eye();
    let shade = |x: f64, y: f64| {
        let d = camera.direction(x, y);
        let along = (centre - eye).dot(d);
        let off = (centre - eye - along * d).length();
        let half = radius * radius - off * off;
        (half > 0.0).then(|| {
            let normal = (eye + (along - half.sqrt()) * d - centre) / radius;
            (off / radius, radiance(normal, d))
        })
    };
    (0..384 * 384)
        .into_par_iter()
        .filter_map(|i| {
            let (x, y) = (f64::from(i % 384) + 0.5, f64::from(i / 384) + 0.5);
            if shade(x, y)?.0 > inside {
                return None;
            }
            let (mut sum, mut weights) = ([0.0; 3], 0.0);
            for (dx, dy, weight) in taps {
                let (_, value) = shade(x + dx, y + dy)?;
                (0..3).for_each(|c| sum[c] += weight * value[c]);
                weights += weight;
            }
            Some((sum.map(|s| s / weights), image[i as usize]))
        })
        .collect()
}

#[test]
fn the_calibration_balls_look_as_the_independent_renderer_shows_them() {
    let Some(data) = common::data() else { return };
    let calib = json(&data.join("calib/calib.json"));
    // A bell about as wide as the renderer's pixel filter (Blackman-Harris, 1.5 pixels).
    let offsets = [-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6];
    let bell = |x: f64| (-0.5 * (x / 0.26).powi(2)).exp();
    let filter: Vec<_> = (0..49)
        .map(|i| (offsets[i % 7], offsets[i / 7]))
        .map(|(dx, dy)| (dx, dy, bell(dx) * bell(dy)))
        .collect();
    for (calib, (name, rotation)) in
        calib.as_array().unwrap().iter().zip([("forest", 170.0), ("sunrise", -4.0)])
    {
        let light = environment(&data.join(format!("env/{name}.exr")), rotation);
        let radiance = Radiance::new(&light);
        let read = |kind: &str| read_exr(&data.join(format!("calib/{kind}_{name}.exr"))).rgb(["R", "G", "B"]);
        // Towards the limb a pixel's footprint in the mirror grows without bound.
        let mirror = ball(calib, &read("mirror"), 0.9, &filter, |n, d| {
            radiance.along((d - 2.0 * n.dot(d) * n).to_array())
        });
        let irradiance = Prefilter::of(&radiance).lobe(32, 1.0, |_| {});
        let diffuse = ball(calib, &read("diffuse"), 0.97, &[(0.0, 0.0, 1.0)], |n, _| {
            let [r, g, b, _]: [f32; 4] = irradiance.sample(n.as_vec3().to_array());
            [r, g, b].map(f64::from)
        });
        for (kind, pairs) in [("mirror", mirror), ("diffuse", diffuse)] {
            let logs = |x: &[f64]| x.iter().map(|v| (v + 1e-3).ln()).collect::<Vec<_>>();
            let ours: Vec<f64> = pairs.iter().flat_map(|pair| pair.0).collect();
            let theirs: Vec<f64> = pairs.iter().flat_map(|pair| pair.1.map(f64::from)).collect();
            let ratios: Vec<f64> = ours.iter().zip(&theirs).map(|(a, b)| a / b).collect();
            let (median, correlation) = (quantile(&ratios, 0.5), correlation(&logs(&ours), &logs(&theirs)));
            let spread = quantile(&ratios.iter().map(|r| (r - median).abs()).collect::<Vec<_>>(), 0.5);
            println!(
                "{name} {kind}: median ratio {median:.4} +- {spread:.4}, correlation of logs {correlation:.4}"
            );
            crate::figures::measured(&format!("bakes {kind} ball {name} ratio"), median);
            crate::figures::measured(&format!("bakes {kind} ball {name} correlation"), correlation);
            // 64 and 128 rays a pixel in an HDR environment; leaves finer than a pixel in the forest.
            assert!((median - 1.0).abs() < 0.01, "{name} {kind}: {median}");
            assert!(correlation > 0.99, "{name} {kind}: {correlation}");
        }
    }
}

fn small_scene() -> Scene {
    let mut scene = bare_scene(Effects::SURFACE);
    let texels = (0..512).map(|i| [0.2 + (i % 7) as f32, 1.0, 0.01 * i as f32]).collect();
    let panorama = Map { width: 32, height: 16, texels };
    scene.environment =
        Some(Environment { panorama, rotation_degrees: 30.0, intensity: 0.5, spots: Spots::default() });
    scene.quality.irradiance_size = 4;
    scene.quality.lobe_size = 4;
    scene.quality.hilite_size = 8;
    scene.quality.occlusion_rays = 16;
    scene
}

#[test]
fn a_finer_hilite_cube_holds_what_a_halved_panorama_has_lost() {
    // One bright texel, straight ahead.
    let (width, height) = (4096, 2048);
    let mut texels = vec![[0.0; 3]; width * height];
    texels[height / 2 * width + width / 2] = [1.0; 3];
    let environment = Environment {
        panorama: Map { width, height, texels },
        rotation_degrees: 0.0,
        intensity: 1.0,
        spots: Spots::default(),
    };
    let effects = Effects::of(&[Effect::Hilite]);
    let mut scene = Scene { environment: Some(environment), ..bare_scene(effects) };
    let mut brightest = |size: u32| {
        scene.quality.hilite_size = size;
        let light = bake(&scene, &triangle, &within(32.0..=32.0), None).unwrap().0.illumination;
        let cube = light.hilite.unwrap();
        let size = size as usize;
        let texel = |i: usize| cube.texel(i / (size * size), i % size, i / size % size)[0];
        (0..6 * size * size).map(texel).fold(0.0, f32::max)
    };
    let (coarse, fine) = (brightest(512), brightest(896));
    // Half as wide, the panorama's brightest texel is a quarter, whatever is made of it.
    assert!(coarse <= 0.25 && fine > 0.3, "{coarse} at 512 texels a side, {fine} at 896");
}

fn triangle(_: &[f32]) -> PosedMesh {
    PosedMesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        normals: vec![Vec3::Z; 3],
        triangles: vec![[0, 1, 2]],
        ..PosedMesh::default()
    }
}

fn names(stats: &BakeStats) -> Vec<&str> {
    stats.rows.iter().map(|row| row.name.as_str()).filter(|&name| name != "environment").collect()
}

#[test]
fn turning_an_effect_off_removes_what_only_it_asked_for() {
    let run = |effects: Effects| {
        let scene = Scene { effects, ..small_scene() };
        bake(&scene, &triangle, &within(32.0..=32.0), None).unwrap()
    };
    let (all, stats) = run(Effects::SURFACE);
    assert_eq!(names(&stats), ["irradiance", "lobe 32.0000", "hilite", "occlusion"]);
    let light = &all.illumination;
    assert!(
        light.irradiance.is_some()
            && light.lobes.is_some()
            && light.hilite.is_some()
            && all.occlusion.is_some()
    );
    let without = |effect: Effect| run(Effects::SURFACE.without(effect));
    assert_eq!(names(&without(Effect::Diffuse).1), ["lobe 32.0000", "hilite", "occlusion"]);
    assert_eq!(names(&without(Effect::Hilite).1), ["irradiance", "lobe 32.0000", "occlusion"]);
    assert_eq!(names(&without(Effect::Occlusion).1), ["irradiance", "lobe 32.0000", "hilite"]);
    let neither = Effects::SURFACE.without(Effect::SideSpecular).without(Effect::Reflection);
    assert_eq!(names(&run(neither).1), ["irradiance", "hilite", "occlusion"]);
    let (nothing, stats) = run(Effects::of(&[Effect::KeyLight]));
    assert!(
        names(&stats).is_empty() && nothing.illumination.irradiance.is_none() && nothing.occlusion.is_none()
    );
    let scene = small_scene();
    let stack = bake(&scene, &triangle, &within(1.0..=2048.0), None).unwrap().0.illumination.lobes.unwrap();
    assert_eq!(stack.exponents.len(), 12);
}

#[test]
fn a_second_bake_comes_from_the_cache_and_a_damaged_file_is_made_anew() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small_scene();
    let run = |scene: &Scene| bake(scene, &triangle, &within(32.0..=32.0), Some(folder.path())).unwrap();
    let (first, stats) = run(&scene);
    assert!(stats.rows.iter().all(|row| !row.cached));
    let (second, stats) = run(&scene);
    assert!(stats.rows.len() == 4 && stats.rows.iter().all(|row| row.cached));
    assert_eq!(first.illumination.irradiance, second.illumination.irradiance);
    assert_eq!(first.illumination.hilite, second.illumination.hilite);
    assert_eq!(first.occlusion, second.occlusion);
    assert_eq!(first.illumination.lobes.as_ref().unwrap().cubes, second.illumination.lobes.unwrap().cubes);

    for file in std::fs::read_dir(folder.path()).unwrap() {
        let path = file.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 5]).unwrap();
    }
    let (third, stats) = run(&scene);
    assert!(stats.warnings.len() == 4 && stats.rows.iter().all(|row| !row.cached));
    assert!(stats.warnings.iter().all(|w| w.contains("baking anew")), "{:?}", stats.warnings);
    assert_eq!(first.illumination.irradiance, third.illumination.irradiance);
    assert!(run(&scene).1.rows.iter().all(|row| row.cached));

    // Each input that matters makes other bakes.
    let mut turned = scene.clone();
    turned.environment.as_mut().unwrap().rotation_degrees += 1.0;
    let cached: Vec<bool> = run(&turned).1.rows.iter().map(|row| row.cached).collect();
    assert_eq!(cached.iter().filter(|&&cached| cached).count(), 1, "only the occlusion is the same");
    let mut rays = scene.clone();
    rays.quality.occlusion_rays += 1;
    assert_eq!(run(&rays).1.rows.iter().filter(|row| !row.cached).count(), 1);
}

#[test]
fn a_cache_that_cannot_be_written_is_a_warning_and_a_missing_environment_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, b"in the way").unwrap();
    let mut scene = small_scene();
    let (baked, stats) = bake(&scene, &triangle, &within(32.0..=32.0), Some(&file.join("cache"))).unwrap();
    assert!(baked.illumination.irradiance.is_some());
    assert!(!stats.warnings.is_empty());
    scene.quality.lobe_size = 0;
    let error = bake(&scene, &triangle, &within(32.0..=32.0), None).unwrap_err().to_string();
    assert!(error.contains("lobe_size"), "{error}");
    scene.environment.as_mut().unwrap().panorama.texels.pop();
    assert!(
        bake(&scene, &triangle, &within(32.0..=32.0), None).unwrap_err().to_string().contains("511 texels")
    );
    scene.environment = None;
    let error = bake(&scene, &triangle, &within(32.0..=32.0), None).unwrap_err().to_string();
    assert!(error.contains("test/scene.toml") && error.contains("[environment]"), "{error}");
}

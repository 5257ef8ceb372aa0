//! Lights: their formulas against an independent oracle, their shadows against a path tracer's images, and those that
//! are taken out of real panoramas.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;
use skinfit::bake::rays::RayMesh;
use skinfit::model::bearing::Bearing;
use skinfit::model::effects::{Effect, Effects};
use skinfit::samples::PosedSurface;
use skinfit::samples::visibility::{Places, Shadows};
use skinfit::samples::{Hit, sample_hits, sample_view};
use skinfit::scene::light::{Beam, Cone, Lamp, NEAREST, THINNEST_EDGE};
use skinfit::scene::maps::Spots;
use skinfit::scene::sky_lights::sky_lights;
use skinfit::scene::{Light, LightKind, LoadOptions, Scene};
use skinfit::shader::term::library;

use crate::common;
use crate::figures::measured;
use crate::fixtures::{environment, quantile};
use crate::vectors::reader::{Node, Tolerance, Vectors};

/// The light of a vector, and the factor on its colour; directions may have length 0 there.
pub(crate) fn light_of(inputs: &Node<'_>) -> (Light, [f64; 3]) {
    let three = |key: &str| DVec3::from_array(inputs.at(key).three());
    let number = |key: &str| inputs.get(key).map(|node| node.number());
    let lamp = || Lamp {
        position: three("position"),
        intensity: inputs.at("intensity").three(),
        range: number("range"),
        radius: 0.0,
    };
    let kind = match inputs.at("type").text() {
        "directional" => {
            let direction = match (number("azimuth"), number("elevation")) {
                (Some(azimuth), Some(elevation)) => {
                    -DVec3::from_array(Bearing { azimuth, elevation }.direction())
                }
                _ => three("direction"),
            };
            let irradiance = inputs.at("irradiance").three();
            LightKind::Directional(Beam { direction, irradiance, angular_diameter_degrees: 0.0 })
        }
        "point" => LightKind::Point(lamp()),
        "spot" => {
            let [inner_degrees, outer_degrees] =
                ["inner_degrees", "outer_degrees"].map(|key| inputs.at(key).number());
            LightKind::Spot(lamp(), Cone { direction: three("direction"), inner_degrees, outer_degrees })
        }
        other => panic!("a light of type {other}"),
    };
    (Light { name: "light".to_owned(), kind }, inputs.at("color").three())
}

/// A light's effect, by its name.
pub(crate) fn known(name: &str, kind: LightKind) -> Effect {
    // A light's rules name effects of the library's own files.
    library::register_all();
    Light { name: name.to_owned(), kind }.effect().unwrap()
}

pub(crate) const LAMP: Lamp = Lamp { position: DVec3::ZERO, intensity: [1.0; 3], range: None, radius: 0.0 };

pub(crate) fn beam(name: &str) -> Effect {
    let beam = Beam { direction: DVec3::NEG_Z, irradiance: [1.0; 3], angular_diameter_degrees: 0.0 };
    known(name, LightKind::Directional(beam))
}

/// Every case of the oracle's lights.
pub(crate) fn light_vector(file: &Node<'_>) {
    let tolerance = file.vector.tolerances().double;
    let constants = file.at("constants");
    assert_eq!((constants.at("D_MIN").number(), constants.at("CONE_MIN").number()), (NEAREST, THINNEST_EDGE));
    let expected = file.at("expected").at("cases").items();
    let cases = file.at("inputs").at("cases").items();
    assert_eq!(cases.len(), expected.len());
    for (case, want) in cases.iter().zip(&expected) {
        want.at("case").assert_text(case.at("case").text());
        let (light, color) = light_of(&case.at("light"));
        let [x, n] = ["x", "n"].map(|key| DVec3::from_array(case.at(key).three()));
        // What samples hold of it; the rules over them are held against the same cases in `light_vectors`.
        let facing = light.attenuation(x) * n.dot(light.towards(x)).max(0.0);
        let by_color = light.strength().map(|strength| strength * facing);
        let irradiance: [f64; 3] = std::array::from_fn(|c| color[c] * by_color[c]);
        tolerance.check("E", &irradiance, &want.at("E"));
        tolerance.check("d E / d color", &by_color, &want.at("d_color"));
        let towards = light.towards(x);
        tolerance.check("L", &towards.to_array(), &want.at("L"));
        if want.get("azimuth").is_some() {
            angles(&case.at("light"), want, &light, color, n, tolerance);
        }
    }
}

/// The angles of a directional light, and how its irradiance moves with them.
fn angles(
    inputs: &Node<'_>,
    want: &Node<'_>,
    light: &Light,
    color: [f64; 3],
    n: DVec3,
    tolerance: Tolerance,
) {
    let mut bearing = light.bearing().unwrap();
    if bearing.elevation == 90.0 {
        // Straight above a direction has lost its azimuth: one that is given counts.
        bearing.azimuth = inputs.get("azimuth").map_or(bearing.azimuth, |azimuth| azimuth.number());
    }
    tolerance.check("azimuth", &[bearing.azimuth], &want.at("azimuth"));
    tolerance.check("elevation", &[bearing.elevation], &want.at("elevation"));
    let lit = n.dot(light.towards(DVec3::ZERO)) > 0.0;
    for (key, slope) in [("d_azimuth", bearing.by_azimuth()), ("d_elevation", bearing.by_elevation())] {
        let slope = if lit { n.dot(DVec3::from_array(slope)) } else { 0.0 };
        let strength = light.strength();
        let got: [f64; 3] = std::array::from_fn(|c| color[c] * strength[c] * slope);
        tolerance.check(key, &got, &want.at(key));
    }
}

#[test]
fn lights_are_as_bright_as_the_vectors_say() {
    light_vector(&Vectors::read(&common::vectors_light()).one("light"));
}

/// Cycles' pixel filter: Blackman-Harris, 3 pixels wide.
fn filter(off: f64) -> f64 {
    let v = 2.0 * PI * (off / 3.0 + 0.5);
    0.35875 - 0.48829 * v.cos() + 0.14128 * (2.0 * v).cos() - 0.01168 * (3.0 * v).cos()
}

/// Direct light on the calibration scenes' white-grey sphere and plane, in f64, filtered to pixels as the path tracer
/// does; where each pixel's places lie (their mean), and how much of it is lit.
struct Predicted {
    radiance: Vec<[f64; 3]>,
    /// Mean over what the pixel shows.
    height: Vec<f64>,
    lit: Vec<f64>,
    coverage: Vec<f64>,
}

const ALBEDO: f64 = 0.5;
/// Samples along a pixel's side.
const PER_AXIS: u32 = 4;
/// Rays towards lights that have a size.
const SOFT_RAYS: u32 = 16;

fn predict(scene: &Scene) -> Predicted {
    let posed = scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let shadows = Shadows::new(&posed, &rays, SOFT_RAYS);
    let camera = &scene.views[0].camera;
    let samples = sample_view(scene, &PosedSurface::bare(&posed, &rays, None), camera);
    let hits = sample_hits(scene, &posed, &rays, camera);
    let (width, height) = (i64::from(camera.width), i64::from(camera.height));
    let pixels = (width * height) as usize;
    let mut sums = Predicted {
        radiance: vec![[0.0; 3]; pixels],
        height: vec![0.0; pixels],
        lit: vec![0.0; pixels],
        coverage: vec![0.0; pixels],
    };
    // Strata are even, so that their filter weights sum to the filter's integral.
    let stratum = 1.0 / f64::from(PER_AXIS).powi(2);
    let whole = (3.0 * 0.35875_f64).powi(2);
    let lit = |hit: &Hit| {
        let weights = hit.weights().map(f64::from);
        let place = shadows.place(hit.triangle, weights);
        let corners = posed.triangles[hit.triangle as usize].map(|i| posed.normals[i as usize].as_dvec3());
        let normal = (0..3).map(|i| weights[i] * corners[i]).sum::<DVec3>().normalize();
        let (mut radiance, mut lit) = ([0.0; 3], 0.0);
        for light in &scene.lights {
            let cosine = normal.dot(light.towards(place.position)).max(0.0);
            let arriving = f64::from(shadows.arriving(&Places::new(&[place]), light)[0]) * cosine;
            (0..3).for_each(|c| radiance[c] += ALBEDO / PI * light.strength()[c] * arriving);
            let all = light.attenuation(place.position) * cosine;
            lit += if all > 0.0 { arriving / all } else { 0.0 };
        }
        (place.position, radiance, lit)
    };
    let shown: Vec<&Hit> =
        (0..hits.len()).filter(|&i| samples.surface.weight(i) > 0.0).map(|i| &hits[i]).collect();
    let lit: Vec<(DVec3, [f64; 3], f64)> = shown.into_par_iter().map(lit).collect();
    for (position, radiance, lit) in lit {
        let (x, y, _) = camera.project(position);
        for row in (y - 2.0).floor() as i64..=(y + 1.0).ceil() as i64 {
            for column in (x - 2.0).floor() as i64..=(x + 1.0).ceil() as i64 {
                let [dx, dy] = [x - column as f64 - 0.5, y - row as f64 - 0.5];
                let inside = (0..width).contains(&column) && (0..height).contains(&row);
                if !inside || dx.abs() >= 1.5 || dy.abs() >= 1.5 {
                    continue;
                }
                let weight = stratum * filter(dx) * filter(dy) / whole;
                let pixel = (row * width + column) as usize;
                (0..3).for_each(|c| sums.radiance[pixel][c] += weight * radiance[c]);
                sums.height[pixel] += weight * position.y;
                sums.lit[pixel] += weight * lit;
                sums.coverage[pixel] += weight;
            }
        }
    }
    sums
}

/// What the comparison of one image with the path tracer's found.
struct Compared {
    /// Relative L2 over all pixels.
    error: f64,
    /// The median of rendered / predicted where plane and sphere are wholly lit.
    medians: [f64; 2],
}

fn compare(data: &Path, name: &str) -> Compared {
    let path = data.join(format!("calib_lights/{name}.toml"));
    // Of all effects one that needs no environment.
    let options = LoadOptions { effects: Some(Effects::of(&[Effect::KeyLight])), ..LoadOptions::default() };
    let (mut scene, _) = Scene::load(&path, &options).unwrap();
    scene.quality.samples_per_axis = PER_AXIS;
    assert_eq!((scene.lights.len(), scene.lights[0].name.as_str()), (1, name));
    let found = predict(&scene);
    let target = &scene.views[0].target.as_ref().unwrap().rgb;
    let width = scene.views[0].camera.width as usize;
    let (mut square, mut all) = (0.0, 0.0);
    let mut ratios = [Vec::new(), Vec::new()];
    for (i, (want, got)) in target.iter().zip(&found.radiance).enumerate() {
        // The filter of pixels at the border reaches beyond the image.
        let inside = |at: usize| (2..width - 2).contains(&at);
        if !inside(i % width) || !inside(i / width) {
            continue;
        }
        for c in 0..3 {
            square += (f64::from(want[c]) - got[c]).powi(2);
            all += f64::from(want[c]).powi(2);
        }
        let (height, lit) = (found.height[i] / found.coverage[i], found.lit[i] / found.coverage[i]);
        if found.coverage[i] > 0.999 && lit > 0.999 && got[0] > 0.01 {
            // The plane lies at 0; the sphere begins at 0.6.
            ratios[usize::from(height > 0.6)].push(f64::from(want[0]) / got[0]);
        }
    }
    let medians = ratios.map(|ratios| {
        assert!(ratios.len() > 500, "{name}: {}", ratios.len());
        quantile(&ratios, 0.5)
    });
    Compared { error: (square / all).sqrt(), medians }
}

#[test]
fn direct_light_and_its_shadows_are_those_of_the_path_tracers_images() {
    let Some(data) = common::data() else { return };
    for name in ["directional", "point", "spot", "directional_soft", "point_soft"] {
        let Compared { error, medians: [plane, sphere] } = compare(&data, name);
        for (what, value) in [("error", error), ("plane", plane), ("sphere", sphere)] {
            measured(&format!("lights_{name}_{what}"), value);
        }
        // Half floats round by 2^-11, and the image is the mean of 256 noisy samples; the independent check that came
        // with it found medians within 0.0004.
        assert!((plane - 1.0).abs() < 1e-3 && (sphere - 1.0).abs() < 1e-3, "{name}: {plane} {sphere}");
        // That check, with the sphere's closed form and 16 samples a pixel, was off by 0.0012 to 0.0054, which is the
        // noise of both at the shadows' edges.
        assert!(error < 0.008, "{name}: {error}");
    }
}

#[test]
fn lights_that_are_taken_out_of_a_real_panorama_leave_the_sum_of_light_as_it_was() {
    let Some(data) = common::data() else { return };
    for name in ["forest", "sunrise", "studio", "dawn"] {
        let mut whole = environment(&data.join(format!("env/{name}.exr")), 33.0);
        whole.intensity = 0.7;
        let total = |texels: &[[f32; 3]]| -> [f64; 3] {
            let (width, height) = (whole.panorama.width, whole.panorama.height);
            let edge = |row: usize| (row as f64 / height as f64 * PI).cos();
            let mut sum = [0.0; 3];
            for (i, texel) in texels.iter().enumerate() {
                let solid_angle = 2.0 * PI / width as f64 * (edge(i / width) - edge(i / width + 1));
                (0..3).for_each(|c| sum[c] += 0.7 * solid_angle * f64::from(texel[c]));
            }
            sum
        };
        let before = total(&whole.panorama.texels);
        for count in [4, 64] {
            whole.spots = Spots { count, ..Spots::default() };
            let found = sky_lights(&whole);
            let mut after = total(&found.rest.panorama.texels);
            for light in &found.lights {
                (0..3).for_each(|c| after[c] += light.strength()[c]);
            }
            // Sums of 131072 numbers in f64, in another order.
            assert!(
                (0..3).all(|c| (after[c] / before[c] - 1.0).abs() < 1e-6),
                "{name}: {before:?} {after:?}"
            );
            assert!(found.lights.len() <= count as usize && !found.lights.is_empty());
            let shares: Vec<f64> = found.lights.iter().map(|light| light.strength()[1] / before[1]).collect();
            // The brightest four have twice the light that as many even spots would.
            let even = 2.0 * PI * (1.0 - 4.0_f64.to_radians().cos()) / (4.0 * PI);
            assert!(shares.len() >= 4 && shares[..4].iter().sum::<f64>() > 8.0 * even, "{name}: {shares:?}");
        }
    }
}

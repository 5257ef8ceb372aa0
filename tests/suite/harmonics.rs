//! Spherical harmonics, the environment's coefficients, transfer vectors and shadowed light against the vectors.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use skinfit::bake::coefficients::Coefficients;
use skinfit::bake::harmonics::{Order, basis, cosine_lobe, open_transfer};
use skinfit::bake::shadowed::{Turning, arriving, shadow_ratio, share_of_open};
use skinfit::bake::transfer::bake_transfer;
use skinfit::model::cube::{Cube, face_direction};
use skinfit::model::effects::{Effect, Effects};
use skinfit::scene::maps::{Environment, Map, Spots};
use skinfit::scene::mesh::PosedMesh;

use crate::by_rules::Function;
use crate::common;
use crate::sky::effect;
use crate::vectors;
use crate::vectors::reader::{Node, Tolerance, Vectors};

#[test]
fn harmonics_meet_the_vectors() {
    let vectors = Vectors::read(&common::vectors_light());
    vectors.of_kind("sh").iter().for_each(|file| sh_vector(&vectors, file));
}

pub(crate) fn sh_vector(vectors: &Vectors, file: &Node<'_>) {
    match file.at("name").text() {
        "sh_environment" => environment_vector(vectors, file),
        "sh_transfer" => transfer_vector(vectors, file),
        "sh_bounce" => bounce_vector(file),
        other => panic!("nothing is known of {other}"),
    }
}

pub(crate) fn orders() -> impl Iterator<Item = Order> {
    (2..=6).map(|bands| Order::new(bands).unwrap())
}

fn coefficients(numbers: &[f64]) -> Coefficients {
    Coefficients::new(Order::MOST, numbers.as_chunks().0.to_vec())
}

/// The cube that a file names, as a closure from directions to rgb, and its texels' polygons.
struct Light {
    cube: Cube<f64>,
}

impl Light {
    fn of(vectors: &Vectors, file: &Node<'_>) -> Self {
        Self { cube: vectors::cube::<f64>(vectors, file, "diffuse") }
    }

    /// As a panorama, each texel the mean over places within it of the cube's texel there.
    fn panorama(&self, height: usize, sub: usize) -> Environment {
        let width = 2 * height;
        let texel = |i: usize| {
            let mut sum = [0.0; 3];
            for k in 0..sub * sub {
                let at = |whole: usize, part: usize| whole as f64 + (part as f64 + 0.5) / sub as f64;
                let azimuth = PI - at(i % width, k % sub) / height as f64 * PI;
                let polar = at(i / width, k / sub) / height as f64 * PI;
                // u = 0 looks along +Z, and u grows towards -X: the azimuth from -Z towards +X is 2 pi u - pi.
                let d = [-polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos()];
                let texel = self.texel(d);
                (0..3).for_each(|c| sum[c] += texel[c]);
            }
            sum.map(|x| (x / (sub * sub) as f64) as f32)
        };
        let texels = (0..width * height).map(texel).collect();
        Environment {
            panorama: Map { width, height, texels },
            rotation_degrees: 0.0,
            intensity: 1.0,
            spots: Spots::default(),
        }
    }

    /// The texel along `d`: that whose place on its face is nearest, of the face whose axis is.
    fn texel(&self, d: [f64; 3]) -> [f64; 4] {
        let along = |face: usize| {
            let axis = face_direction(face, 0.0, 0.0);
            (0..3).map(|i| axis[i] * d[i]).sum::<f64>()
        };
        let face = (0..6).max_by(|&a, &b| along(a).total_cmp(&along(b))).unwrap();
        let middle = DVec3::from(face_direction(face, 0.0, 0.0));
        let [s, t] = [(1.0, 0.0), (0.0, 1.0)].map(|(s, t)| {
            let axis = DVec3::from(face_direction(face, s, t)) - middle;
            axis.dot(DVec3::from(d)) / along(face)
        });
        let size = self.cube.size();
        let index = |x: f64| ((x + 1.0) * 0.5 * size as f64).clamp(0.0, size as f64 - 1.0) as usize;
        self.cube.texel(face, index(s), index(t))
    }

    /// Irradiance over pi of a surface with that normal, of what lies on the side of a wall that it faces: each texel is
    /// a spherical polygon (Lambert's formula).
    fn irradiance(&self, normal: DVec3, wall: Option<DVec3>) -> [f64; 3] {
        let size = self.cube.size();
        let edge = |i: usize| 2.0 * i as f64 / size as f64 - 1.0;
        let mut sum = [0.0; 3];
        for i in 0..6 * size * size {
            let (face, row, column) = (i / (size * size), i / size % size, i % size);
            let corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
                .map(|(x, y)| DVec3::from(face_direction(face, edge(column + x), edge(row + y))).normalize());
            let seen = wall.map_or(corners.to_vec(), |wall| clipped(&corners, wall));
            let share = polygon(&clipped(&seen, normal), normal);
            let texel = self.cube.texel(face, column, row);
            (0..3).for_each(|c| sum[c] += share * texel[c]);
        }
        sum
    }
}

/// The part of a spherical polygon on the side of the plane through the origin that `axis` points to.
fn clipped(corners: &[DVec3], axis: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (above, next) = (a.dot(axis), b.dot(axis));
        if above > 0.0 {
            kept.push(a);
        }
        if (above > 0.0) != (next > 0.0) {
            kept.push(((a * next - b * above) * (next - above).signum()).normalize());
        }
    }
    kept
}

/// 1 / pi * integral of N.w over a spherical polygon above the horizon.
fn polygon(corners: &[DVec3], normal: DVec3) -> f64 {
    let mut sum = 0.0;
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let across = a.cross(b);
        let length = across.length();
        if length > 0.0 {
            sum += length.atan2(a.dot(b)) * across.dot(normal) / length;
        }
    }
    sum.abs() / (2.0 * PI)
}

fn environment_vector(vectors: &Vectors, file: &Node<'_>) {
    let exact = file.vector.tolerances().double;
    let (inputs, expected) = (file.at("inputs"), file.at("expected"));
    let directions: Vec<[f64; 3]> = inputs.at("directions").items().iter().map(Node::three).collect();
    let values: Vec<f64> = directions.iter().flat_map(|&d| basis(Order::MOST, d)).collect();
    exact.check("basis", &values, &expected.at("Y"));
    let lobe: Vec<f64> = (0..6).map(cosine_lobe).collect();
    exact.check("cosine lobe", &lobe, &expected.at("A_l_over_pi"));

    let light = coefficients(&expected.at("L_lm").numbers());
    let irradiance = |order: Order| {
        let light = light.truncated(order);
        directions.iter().flat_map(|&d| light.irradiance(d)).collect::<Vec<_>>()
    };
    let by_order: Vec<f64> = orders().flat_map(irradiance).collect();
    exact.check("irradiance", &by_order, &expected.at("E_d"));
    let cube = Light::of(vectors, file);
    let truth: Vec<f64> = directions.iter().flat_map(|&d| cube.irradiance(DVec3::from(d), None)).collect();
    exact.check("exact irradiance", &truth, &expected.at("E_d_exact"));
    // Of a cosine lobe the bands from 6 on hold 1e-4 of the square; the light's own noise there is below 1.
    Tolerance { abs: 0.01, rel: 0.0 }.check("order 6", &irradiance(Order::MOST), &expected.at("E_d_exact"));

    let radians = inputs.at("degrees").number().to_radians();
    exact.check("turned", light.turned(radians).rgb().as_flattened(), &expected.at("rotated"));
    let slope = light.turning(radians).times(PI / 180.0);
    exact.check("turning", slope.rgb().as_flattened(), &expected.at("d_rotated"));

    // Of a panorama of the same light: texels of 0.7 degrees, those on a border the mean of 36 places. So a border may be
    // off by 0.06 degrees, 1e-3, times its length and the contrast there, both about 1.
    let mut panorama = cube.panorama(256, 6);
    let projected = Coefficients::of(&panorama, Order::MOST);
    let near = Tolerance { abs: 1e-3, rel: 0.0 };
    near.check("projection", projected.rgb().as_flattened(), &expected.at("L_lm"));
    panorama.rotation_degrees = inputs.at("degrees").number();
    let projected = Coefficients::of(&panorama, Order::MOST);
    near.check("turned projection", projected.rgb().as_flattened(), &expected.at("rotated"));
}

/// The light of a case.
pub(crate) fn case_light(vectors: &Vectors, file: &Node<'_>, case: &Node<'_>) -> Coefficients {
    let environment = case.at("environment");
    if let Some(delta) = environment.get("delta") {
        let rgb = environment.at("rgb").three();
        let values = basis(Order::MOST, delta.three());
        return Coefficients::new(Order::MOST, values.iter().map(|y| rgb.map(|c| c * y)).collect());
    }
    if environment.text() == "black" {
        return Coefficients::new(Order::MOST, Vec::new());
    }
    environment.assert_text("cubes_ldr.diffuse");
    let named = file.at("inputs").at("L_lm_file").text();
    coefficients(&vectors.files[named].root().at("expected").at("L_lm").numbers())
}

fn transfer_vector(vectors: &Vectors, file: &Node<'_>) {
    let exact = file.vector.tolerances().double;
    assert_eq!(file.at("constants").at("U_MIN").number(), 1e-4);
    let cube = Light::of(vectors, file);
    let expected = file.at("expected").at("cases").items();
    for (case, want) in file.at("inputs").at("cases").items().iter().zip(expected) {
        want.at("case").assert_text(case.at("case").text());
        let normal = case.at("N").three();
        let light = case_light(vectors, file, case);
        let transfer = want.at("T").numbers();
        let open = open_transfer(Order::MOST, normal);
        let shadowed: Vec<f64> = orders()
            .flat_map(|order| light.truncated(order).through(&transfer[..order.functions()]))
            .collect();
        exact.check("shadowed", &shadowed, &want.at("shadowed"));
        let share = share_of_open(arriving(&transfer, &light), arriving(&open, &light), light.mean());
        exact.check("share of open light", &share, &want.at("ratio"));
        let [split, open] = [&transfer, &open].map(|transfer| Turning::of(transfer, &light));
        let degree = |slope: [f64; 3]| slope.map(|x| x * PI / 180.0);
        exact.check("d shadowed", &degree(split.slope(0.0)), &want.at("d_shadowed"));
        let ratio = shadow_ratio(&split, &open, light.mean(), 0.0);
        exact.check("ratio", &ratio.value, &want.at("ratio"));
        exact.check("d ratio", &degree(ratio.slope), &want.at("d_ratio"));

        let (mut mesh, wall) = occluder(case, normal);
        // Rays from the first vertex alone: those without a normal have none.
        mesh.normals[1..].fill(Vec3::ZERO);
        let baked = bake_transfer(&|_| mesh.clone(), 0, 65536, Order::MOST, None);
        let got: Vec<f64> = baked.base.direct[..36].iter().map(|&t| f64::from(t)).collect();
        // 65536 stratified rays, 0.3 / n^(3/4), and an occluder of a hundred sides.
        Tolerance { abs: 5e-4, rel: 0.0 }.check("baked", &got, &want.at("T"));
        let truth = want.at("shadowed_exact");
        if !truth.is_null() {
            let light = match case.at("case").text() {
                "hidden" => [0.0; 3],
                _ => cube.irradiance(DVec3::from(normal), wall),
            };
            exact.check("exact", &light, &truth);
            let got = Turning::of(&got, &case_light(vectors, file, case)).at(0.0);
            // Behind an edge, bands from 6 on hold a few hundredths of the light's contrast.
            Tolerance { abs: 0.03, rel: 0.0 }.check("order 6", &got, &truth);
        }
    }
}

/// A mesh around a vertex at the origin that hides what the case says; a wall's axis where it is one.
fn occluder(case: &Node<'_>, normal: [f64; 3]) -> (PosedMesh, Option<DVec3>) {
    let visibility = case.at("visibility");
    let mut mesh = PosedMesh {
        positions: vec![Vec3::ZERO],
        normals: vec![DVec3::from(normal).as_vec3()],
        ..PosedMesh::default()
    };
    if case.at("case").text() == "hidden" {
        add_band(&mut mesh, DVec3::from(normal), [0.0, 1.7]);
    }
    if let Some(side) = visibility.get("open_side") {
        let axis = DVec3::from(side.three());
        // All below the wall's horizon: a dome.
        add_band(&mut mesh, -axis, [0.0, 0.5 * PI]);
        return (mesh, Some(axis));
    }
    if let Some(axis) = visibility.get("axis") {
        let edge = visibility.at("half_angle_degrees").number().to_radians();
        let hidden = match visibility.at("inside").text() {
            "hidden" => [0.0, edge],
            _ => [edge, 1.7],
        };
        add_band(&mut mesh, DVec3::from(axis.three()), hidden);
    }
    (mesh, None)
}

/// The band of the unit sphere between two angles from an axis, as triangles.
pub(crate) fn add_band(mesh: &mut PosedMesh, axis: DVec3, [from, to]: [f64; 2]) {
    const SIDES: u32 = 240;
    const RINGS: u32 = 12;
    let first = mesh.positions.len() as u32;
    let (u, v) = axis.any_orthonormal_pair();
    for ring in 0..=RINGS {
        let angle = from + (to - from) * f64::from(ring) / f64::from(RINGS);
        for side in 0..SIDES {
            let (sine, cosine) = (f64::from(side) / f64::from(SIDES) * 2.0 * PI).sin_cos();
            let d = angle.cos() * axis + angle.sin() * (cosine * u + sine * v);
            mesh.positions.push(d.as_vec3());
            mesh.normals.push(-d.as_vec3());
        }
    }
    for ring in 0..RINGS {
        for side in 0..SIDES {
            let at = |ring: u32, side: u32| first + ring * SIDES + side % SIDES;
            let [a, b, c, d] =
                [at(ring, side), at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// By the rule and its tangents.
fn bounce_vector(file: &Node<'_>) {
    const RULE: &str = "open_to_sky_and_skin";
    let effects = Effects::of(&[Effect::Diffuse, effect("directional_occlusion")]);
    let value = Function::of_rule(effects, RULE, &[3, 3]);
    let along = |moved: usize| Function::tangent_of_rule(effects, RULE, &[3, 3], moved);
    let [by_open, by_albedo] = [0, 1].map(along);
    let [open, albedo] = ["occ", "albedo"].map(|name| file.at("inputs").at(name).numbers());
    let all = || open.iter().flat_map(|&open| albedo.iter().map(move |&albedo| (open, albedo)));
    let tolerance = file.vector.tolerances().double;
    let check = |name: &str, of: &dyn Fn([f64; 3], [f64; 3]) -> Vec<f64>| {
        let got: Vec<f64> = all().map(|(open, albedo)| of([open; 3], [albedo; 3])[0]).collect();
        tolerance.check(name, &got, &file.at("expected").at(name));
    };
    check("value", &|open, albedo| value.of(1.0, &[&open, &albedo]));
    // Where nothing is open both branches are 0; the vectors have the slope from above.
    let above = |open: [f64; 3]| open.map(|open| open.max(1e-15));
    check("d_occ", &|open, albedo| by_open.of(1.0, &[&above(open), &albedo, &[1.0; 3]]));
    check("d_albedo", &|open, albedo| by_albedo.of(1.0, &[&above(open), &albedo, &[1.0; 3]]));
}

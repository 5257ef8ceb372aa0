//! Spherical harmonics, the environment's coefficients and transfer vectors, against the vectors and closed forms.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use skinfit::bake::bake_scene_transfer;
use skinfit::bake::coefficients::Coefficients;
use skinfit::bake::harmonics::{CONSTANT, Order, basis, cosine_lobe, open_transfer, open_transfer_at};
use skinfit::bake::interreflection::Albedo;
use skinfit::bake::occlusion::bake_occlusion;
use skinfit::bake::shadowed::{Turning, bounce_polynomial, shadow_ratio, shadowed_irradiance};
use skinfit::bake::transfer::{VertexTransfer, bake_transfer};
use skinfit::model::cube::{Cube, face_direction};
use skinfit::model::effects::Effects;
use skinfit::scene::maps::{Environment, Map};
use skinfit::scene::mesh::{Morph, PosedMesh};

use crate::common;
use crate::fixtures::bare_scene;
use crate::vectors;
use crate::vectors::reader::{Node, Tolerance, Vectors};

#[test]
fn harmonics_meet_the_vectors() {
    let vectors = Vectors::read(&common::vectors());
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

fn orders() -> impl Iterator<Item = Order> {
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
        Environment { panorama: Map { width, height, texels }, rotation_degrees: 0.0, intensity: 1.0 }
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

    // Of a panorama of the same light: texels of 0.7 degrees, those on a border the mean of 36 places.
    let mut panorama = cube.panorama(256, 6);
    let projected = Coefficients::of(&panorama, Order::MOST);
    let near = Tolerance { abs: 3e-4, rel: 0.0 };
    near.check("projection", projected.rgb().as_flattened(), &expected.at("L_lm"));
    panorama.rotation_degrees = inputs.at("degrees").number();
    let projected = Coefficients::of(&panorama, Order::MOST);
    near.check("turned projection", projected.rgb().as_flattened(), &expected.at("rotated"));
}

/// The light of a case.
fn case_light(vectors: &Vectors, file: &Node<'_>, case: &Node<'_>) -> Coefficients {
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
        let [split, open] = [&transfer, &open].map(|transfer| Turning::of(transfer, &light));
        let degree = |slope: [f64; 3]| slope.map(|x| x * PI / 180.0);
        exact.check("d shadowed", &degree(split.slope(0.0)), &want.at("d_shadowed"));
        let ratio = shadow_ratio(&split, &open, light.mean(), 0.0);
        exact.check("ratio", &ratio.value, &want.at("ratio"));
        exact.check("d ratio", &degree(ratio.slope), &want.at("d_ratio"));

        let (mesh, wall) = occluder(case, normal);
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
fn add_band(mesh: &mut PosedMesh, axis: DVec3, [from, to]: [f64; 2]) {
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

fn bounce_vector(file: &Node<'_>) {
    let [open, albedo] = ["occ", "albedo"].map(|name| file.at("inputs").at(name).numbers());
    let all = || open.iter().flat_map(|&open| albedo.iter().map(move |&albedo| (open, albedo)));
    for (k, name) in ["value", "d_occ", "d_albedo"].into_iter().enumerate() {
        let got: Vec<f64> = all().map(|(open, albedo)| bounce_polynomial(open, albedo)[k]).collect();
        file.vector.tolerances().double.check(name, &got, &file.at("expected").at(name));
    }
}

fn bake(mesh: &PosedMesh, rays: u32, order: Order) -> VertexTransfer {
    bake_transfer(&|_| mesh.clone(), 0, rays, order, None)
}

const WHITE: Albedo<'static> = Albedo { map: None };

fn four() -> Order {
    Order::new(4).unwrap()
}

/// The inside of a sphere, open above an angle from +Y.
fn bowl(opening: f64) -> PosedMesh {
    let mut mesh = PosedMesh::default();
    add_band(&mut mesh, DVec3::Y, [opening, PI]);
    mesh
}

/// Two floors, one above the other, of so many vertices a side; the upper at `height`, looking down.
fn floors(side: u32, height: f32) -> PosedMesh {
    let mut mesh = PosedMesh::default();
    for (y, normal) in [(0.0, Vec3::Y), (height, Vec3::NEG_Y)] {
        let first = mesh.positions.len() as u32;
        let at = |i: u32| (i as f32 + 0.5) / side as f32 - 0.5;
        for i in 0..side * side {
            mesh.positions.push(Vec3::new(at(i % side), y, at(i / side)));
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(if y > 0.0 { 0.25 } else { 0.75 }, 0.5));
        }
        for i in 0..(side - 1) * (side - 1) {
            let a = first + i / (side - 1) * side + i % (side - 1);
            mesh.triangles.extend([[a, a + side, a + 1], [a + 1, a + side, a + side + 1]]);
        }
    }
    mesh
}

#[test]
fn a_convex_shape_has_the_transfer_of_its_normals_and_is_lit_as_in_the_open() {
    let mut mesh = bowl(0.0);
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    let light = Environment {
        panorama: Map { width: 4, height: 2, texels: vec![[1.0, 0.25, 4.0]; 8] },
        rotation_degrees: 10.0,
        intensity: 1.0,
    };
    for order in orders() {
        let baked = bake_transfer(&|_| mesh.clone(), 0, 64, order, Some(&WHITE));
        let functions = order.functions();
        for (normal, transfer) in mesh.normals.iter().zip(baked.base.direct.chunks_exact(functions)) {
            assert_eq!(transfer, open_transfer_at(order, *normal));
        }
        assert!(baked.base.bounced.as_flattened().iter().all(|&t| t == 0.0));
        let light = Coefficients::of(&light, order);
        for lit in shadowed_irradiance(&baked.base.direct, order, &light, 0.3) {
            // Y_00 in f32.
            assert!((0..3).all(|c| (lit[c] / [1.0, 0.25, 4.0][c] - 1.0).abs() < 1e-6), "{lit:?}");
        }
    }
}

#[test]
fn in_an_integrating_sphere_every_place_throws_back_its_share() {
    // From any place in a sphere any part of it is seen by its area: open a, covered 1 - a.
    let opening = 1.2_f64;
    let mesh = bowl(opening);
    let open = 0.5 * (1.0 - opening.cos());
    let rgb = [0.2_f32, 0.5, 1.0];
    let map = Map { width: 1, height: 1, texels: vec![rgb] };
    let mut coloured = mesh.clone();
    coloured.uvs = vec![Vec2::splat(0.5); mesh.positions.len()];
    let albedo = Albedo { map: Some(&map) };
    let baked = bake_transfer(&|_| coloured.clone(), 0, 256, four(), Some(&albedo));
    let shares: Vec<f64> = baked.base.direct.chunks_exact(16).map(|t| f64::from(t[0]) / CONSTANT).collect();
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    // 12 rings and 240 sides: chords cut an angle of 0.16, and its square over 24 of the area.
    assert!((mean - open).abs() < 0.01, "{mean} {open}");
    for c in 0..3 {
        let back = f64::from(rgb[c]) * (1.0 - mean);
        let want = (back + back * back) * mean;
        let got = baked.base.bounced.chunks_exact(16).map(|t| f64::from(t[0][c]) / CONSTANT).sum::<f64>()
            / shares.len() as f64;
        // The mean of products instead of the product of means, over the facets' small differences.
        assert!((got / want - 1.0).abs() < 0.02, "{c}: {got} {want}");
    }
    // Without a map all is white; the light from the open comes from above.
    let white = bake_transfer(&|_| mesh.clone(), 0, 256, four(), Some(&WHITE));
    assert!(white.base.bounced.iter().zip(&baked.base.bounced).all(|(a, b)| (a[1] - b[2]).abs() < 1e-6));
    assert!(white.base.bounced.chunks_exact(16).all(|t| t[2][0] > 0.0));
}

#[test]
fn a_ray_brings_the_colour_of_the_place_that_it_meets_and_backs_bring_nothing() {
    let mesh = floors(8, 0.3);
    // The upper floor is red, the lower green.
    let map = Map { width: 2, height: 1, texels: vec![[0.8, 0.0, 0.0], [0.0, 0.6, 0.0]] };
    let albedo = Albedo { map: Some(&map) };
    let pose = |_: &[f32]| mesh.clone();
    let baked = bake_transfer(&pose, 0, 256, four(), Some(&albedo)).base;
    let middle = 3 * 8 + 3;
    let (below, above) = (baked.bounced[16 * middle], baked.bounced[16 * (64 + middle)]);
    assert!(below[0] > 0.01 && above[1] > 0.01 && below[2] == 0.0, "{below:?} {above:?}");
    // What the lower floor sees is red, and has gone back and forth once.
    assert!(below[1] == 0.0 && above[0] == 0.0);
    // Turned inside out, both see each other's backs.
    let mut turned = mesh.clone();
    turned.normals.iter_mut().skip(64).for_each(|normal| *normal = -*normal);
    let baked = bake_transfer(&|_: &[f32]| turned.clone(), 0, 256, four(), Some(&albedo)).base;
    assert!(baked.bounced.as_flattened().iter().all(|&t| t == 0.0));
    assert!(baked.direct[16 * middle] < 0.2);
}

#[test]
fn transfer_and_occlusion_come_from_the_same_rays_and_targets_add_what_their_pose_has() {
    let pose = |weights: &[f32]| {
        let height = 0.3 + weights.first().copied().unwrap_or(0.0);
        let mut mesh = floors(6, height);
        // A floor that no target moves, and that does not see the others.
        let still = floors(3, 0.2);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(still.positions.iter().map(|&x| x + Vec3::new(0.0, -5.0, 0.0)));
        mesh.normals.extend(&still.normals);
        mesh.uvs.extend(&still.uvs);
        mesh.triangles.extend(still.triangles.iter().map(|t| t.map(|i| i + first)));
        mesh
    };
    let baked = bake_transfer(&pose, 2, 128, four(), Some(&WHITE));
    let direct = bake_transfer(&pose, 2, 128, four(), None);
    assert_eq!(baked.base.direct, direct.base.direct);
    assert!((0..2).all(|i| baked.morphs[i].direct == direct.morphs[i].direct));
    let (occlusion, shares) = (bake_occlusion(&pose, 2, 128), baked.occlusion());
    let sets =
        std::iter::once((&occlusion.base, &shares.base)).chain(occlusion.morphs.iter().zip(&shares.morphs));
    for (occlusion, shares) in sets {
        // T_00 and Y_00 round.
        assert!(occlusion.iter().zip(shares).all(|(a, b)| (a - b).abs() < 1e-6));
    }
    assert!(baked.morphs[1].direct.iter().chain(baked.morphs[1].bounced.as_flattened()).all(|&t| t == 0.0));
    let moved = bake_transfer(&|_| pose(&[1.0, 0.0]), 0, 128, four(), Some(&WHITE)).base;
    let posed = baked.posed(&[1.0, 0.0, 3.0]);
    // Rays are seeded by the place at rest: those of the upper floor differ, by 0.3 / 128^(3/4).
    let all = |a: &[f32], b: &[f32], bound: f32| a.iter().zip(b).all(|(a, b)| (a - b).abs() < bound);
    let lower = ..16 * 36;
    assert!(all(&moved.direct[lower], &posed.direct[lower], 1e-6), "the lower floor's rays are the same");
    assert!(all(&moved.direct, &posed.direct, 0.03));
    assert!(all(moved.bounced.as_flattened(), posed.bounced.as_flattened(), 0.03));
    assert!(baked.morphs[0].direct.iter().any(|t| t.abs() > 0.05));
    let unmoved = 16 * 72..;
    assert!(baked.morphs[0].direct[unmoved].iter().all(|&t| t == 0.0));
}

#[test]
fn transfer_is_the_same_for_any_number_of_threads() {
    let mesh = floors(7, 0.4);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake_transfer(&|_| mesh.clone(), 0, 100, four(), Some(&WHITE)))
    };
    let one = run(1);
    assert!((2..=4).all(|threads| run(threads) == one));
}

#[test]
fn vertices_without_a_normal_or_a_mesh_give_numbers() {
    let mut mesh = floors(2, 0.2);
    mesh.normals[0] = Vec3::ZERO;
    mesh.normals[1] = Vec3::NAN;
    mesh.positions[2] = Vec3::INFINITY;
    mesh.triangles.push([3, 3, 4]);
    let baked = bake_transfer(&|_| mesh.clone(), 1, 64, Order::MOST, Some(&WHITE));
    for set in [&baked.base, &baked.morphs[0], &baked.posed(&[0.5])] {
        assert!(set.direct.iter().chain(set.bounced.as_flattened()).all(|t| t.is_finite()));
    }
    // Without a direction all counts alike.
    let first = &baked.base.direct[..36];
    assert!(first[0] == CONSTANT as f32 && first[1..].iter().all(|&t| t == 0.0));
    let empty = bake_transfer(&|_| PosedMesh::default(), 1, 64, four(), Some(&WHITE));
    assert!(empty.base.direct.is_empty() && empty.morphs[0].bounced.is_empty());
    assert!(bake(&floors(2, 0.1), 0, four()).base.direct.iter().all(|t| t.is_finite()), "at least one ray");
}

#[test]
fn a_scenes_transfer_is_kept_with_all_that_it_depends_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = bare_scene(Effects::SURFACE);
    scene.quality.occlusion_rays = 32;
    let morph = |weight: f32| Morph { weight, ..Morph::default() };
    scene.mesh.morphs = vec![morph(0.0), morph(0.5)];
    let pose = |weights: &[f32]| floors(4, 0.3 + weights.get(1).copied().unwrap_or(0.0));
    let run = |scene: &skinfit::scene::Scene, order: usize, bounces: bool| {
        let order = Order::new(order).unwrap();
        bake_scene_transfer(scene, &pose, order, bounces, Some(folder.path()))
    };
    let (first, stats) = run(&scene, 4, true);
    assert!(stats.rows.len() == 1 && stats.rows[0].name == "transfer" && !stats.rows[0].cached);
    assert!(first.morphs[0].direct.is_empty() && !first.morphs[1].bounced.is_empty());
    let (second, stats) = run(&scene, 4, true);
    assert!(stats.rows[0].cached && first == second);
    assert!(!run(&scene, 4, false).1.rows[0].cached && !run(&scene, 3, true).1.rows[0].cached);
    let direct = run(&scene, 4, false).0;
    assert!(direct.base.direct == first.base.direct && direct.base.bounced.is_empty());
    scene.maps.color = Some(Map { width: 1, height: 1, texels: vec![[0.5; 3]] });
    assert!(!run(&scene, 4, true).1.rows[0].cached, "another albedo");
    assert!(run(&scene, 4, false).1.rows[0].cached, "no albedo is asked for");
    scene.quality.occlusion_rays = 33;
    assert!(!run(&scene, 4, true).1.rows[0].cached);
}

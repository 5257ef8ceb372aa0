//! Transfer vectors against closed forms: convex shapes, an integrating sphere, floors that face each other.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use skinfit::bake::bake_scene_transfer;
use skinfit::bake::coefficients::Coefficients;
use skinfit::bake::harmonics::{CONSTANT, Order, open_transfer_at};
use skinfit::bake::interreflection::Albedo;
use skinfit::bake::occlusion::bake_occlusion;
use skinfit::bake::shadowed::by_azimuth;
use skinfit::bake::transfer::{VertexTransfer, bake_transfer};
use skinfit::model::effects::Effects;
use skinfit::scene::maps::{Environment, Map, Spots};
use skinfit::scene::mesh::{Morph, PosedMesh};

use crate::fixtures::bare_scene;
use crate::harmonics::{add_band, orders};

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

/// Two floors, one above the other, of `side` vertices a side; the upper at `height`, looking down.
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
        spots: Spots::default(),
    };
    for order in orders() {
        let baked = bake_transfer(&|_| mesh.clone(), 0, 64, order, Some(&WHITE));
        let functions = order.functions();
        for (normal, transfer) in mesh.normals.iter().zip(baked.base.direct.chunks_exact(functions)) {
            assert_eq!(transfer, open_transfer_at(order, *normal));
        }
        assert!(baked.base.bounced.as_flattened().iter().all(|&t| t == 0.0));
        let light = Coefficients::of(&light, order);
        for turning in by_azimuth(&baked.base.direct, order, &light) {
            let lit = turning.at(0.3);
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
    // What the lower floor sees is red, whatever the upper sees; lookups round.
    assert!(below[1] < 1e-6 && above[0] < 1e-6);
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

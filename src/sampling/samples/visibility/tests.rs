//! How much of a light places see, of shapes for which that is known.

use std::f64::consts::PI;

use super::*;
use crate::scene::light::Cone;

/// A sphere of radius 1 with `n` rings and its own normals.
fn sphere(n: u32) -> PosedMesh {
    let mut mesh = PosedMesh::default();
    for i in 0..=n {
        for j in 0..=2 * n {
            let (theta, phi) = (PI * f64::from(i) / f64::from(n), PI * f64::from(j) / f64::from(n));
            let p = DVec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()).as_vec3();
            mesh.positions.push(p);
            mesh.normals.push(p);
            if i < n && j < 2 * n {
                let at = |di: u32, dj: u32| (i + di) * (2 * n + 1) + j + dj;
                mesh.triangles.extend([[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]);
            }
        }
    }
    mesh
}

/// A square across the y axis at height `y`, `half` wide to each side.
fn lid(y: f32, half: f32) -> PosedMesh {
    let corner = |x: f32, z: f32| Vec3::new(half * x, y, half * z);
    PosedMesh {
        positions: vec![corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)],
        normals: vec![Vec3::Y; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..PosedMesh::default()
    }
}

fn beam(direction: DVec3, angular_diameter_degrees: f64) -> Light {
    let beam = Beam { direction, irradiance: [1.0; 3], angular_diameter_degrees };
    Light::new("beam", LightKind::Directional(beam)).unwrap()
}

fn lamp(position: DVec3, radius: f64) -> Lamp {
    Lamp { position, intensity: [1.0; 3], range: None, radius }
}

fn at(position: DVec3) -> Place {
    Place { position, origin: position.as_vec3a() }
}

/// The places at the middles of all triangles, with their smooth normals.
fn middles<'a>(shadows: &'a Shadows<'_>) -> impl Iterator<Item = (Place, DVec3)> + 'a {
    let count = shadows.mesh.triangles.len() as u32;
    (0..count).map(|triangle| {
        let place = shadows.place(triangle, [1.0 / 3.0; 3]);
        let corners = shadows.mesh.triangles[triangle as usize];
        let normal: Vec3 = corners.iter().map(|&i| shadows.mesh.normals[i as usize]).sum();
        (place, normal.as_dvec3().normalize())
    })
}

#[test]
fn a_coarse_sphere_is_lit_wherever_its_smooth_normal_faces_the_light() {
    let mesh = sphere(8);
    let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
    let shadows = Shadows::new(&mesh, &rays, 1);
    let (mut turned_away, mut facing) = (0, 0);
    for light in [DVec3::new(0.3, -1.0, 0.2), DVec3::X, DVec3::new(-0.5, 0.4, 0.9)].map(|d| beam(d, 0.0)) {
        for (i, (place, normal)) in middles(&shadows).enumerate() {
            let towards = light.towards(place.position);
            let corners = mesh.triangles[i].map(|v| mesh.positions[v as usize].as_dvec3());
            let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            // At the poles half of the triangles are lines.
            if flat.length() < 1e-6 {
                continue;
            }
            let visible = shadows.visible(&Places::new(&[place]), &light)[0];
            if normal.dot(towards) > 0.0 {
                facing += 1;
                turned_away += u32::from(flat.dot(towards) < 0.0);
                assert_eq!(visible, 1.0, "{place:?} {normal}");
            } else if normal.dot(towards) < -0.4 {
                // Rays start up to 3% outside the sphere, and a ball of 0.96 fits into the triangles: 22 degrees below
                // the horizon every ray meets it.
                assert_eq!(visible, 0.0, "{place:?} {normal}");
            }
        }
    }
    // Without the raised origin, these would be dark.
    assert!(turned_away > 5 && facing > 300, "{turned_away} of {facing}");
}

#[test]
fn a_lamp_is_hidden_by_what_stands_before_it_and_not_by_what_stands_behind() {
    let mesh = lid(1.0, 0.5);
    let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
    let shadows = Shadows::new(&mesh, &rays, 64);
    let point =
        |height: f64, radius| Light::new("lamp", LightKind::Point(lamp(height * DVec3::Y, radius))).unwrap();
    let below = at(DVec3::ZERO);
    for radius in [0.0, 0.05] {
        assert_eq!(shadows.visible(&Places::new(&[below]), &point(2.0, radius))[0], 0.0);
        assert_eq!(shadows.visible(&Places::new(&[below]), &point(0.5, radius))[0], 1.0);
        assert_eq!(shadows.arriving(&Places::new(&[below]), &point(0.5, radius))[0], 4.0);
    }
    // Surface within the lamp, and at a punctual one.
    assert_eq!(shadows.visible(&Places::new(&[below]), &point(0.01, 0.05))[0], 1.0);
    assert_eq!(shadows.arriving(&Places::new(&[below]), &point(0.0, 0.0))[0], 0.0);
    let spot = |direction| {
        let cone = Cone { direction, inner_degrees: 10.0, outer_degrees: 20.0 };
        Light::new("spot", LightKind::Spot(lamp(0.5 * DVec3::Y, 0.0), cone)).unwrap()
    };
    assert_eq!(shadows.arriving(&Places::new(&[below]), &spot(DVec3::NEG_Y))[0], 4.0);
    assert_eq!(shadows.arriving(&Places::new(&[below]), &spot(DVec3::X))[0], 0.0);
}

#[test]
fn soft_lights_are_seen_in_proportion() {
    // A half plane whose edge lies above the origin, but for its far ends.
    let mut mesh = lid(1.0, 1000.0);
    mesh.positions.iter_mut().for_each(|p| p.x = p.x.max(0.0));
    let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
    let shadows = Shadows::new(&mesh, &rays, 4096);
    let place = at(DVec3::ZERO);
    for degrees in [0.5, 10.0, 90.0] {
        let half = shadows.visible(&Places::new(&[place]), &beam(DVec3::NEG_Y, degrees))[0];
        // A straight edge through a net of 4096 points crosses about 64 of its boxes, in which it errs by chance.
        assert!((half - 0.5).abs() < 0.004, "{degrees}: {half}");
    }
    // From the side: a disc of angular radius a whose middle stands e beside the edge shows the segment beyond it.
    let (a, e) = (5.0_f64.to_radians(), 2.0_f64.to_radians());
    let light = beam(DVec3::new(-e.sin(), -e.cos(), 0.0), 10.0);
    let x = e / a;
    let segment = (x.acos() - x * (1.0 - x * x).sqrt()) / PI;
    let visible = f64::from(shadows.visible(&Places::new(&[place]), &light)[0]);
    // As above; the disc is flat to a^2 / 3, 0.0025.
    assert!((visible - segment).abs() < 0.006, "{visible} {segment}");
    // A sphere is seen as a disc of that sine.
    let centre = 100.0 * DVec3::new(e.sin(), e.cos(), 0.0);
    let sphere = Light::new("lamp", LightKind::Point(lamp(centre, 100.0 * a.sin()))).unwrap();
    assert!((f64::from(shadows.visible(&Places::new(&[place]), &sphere)[0]) - segment).abs() < 0.006);
    assert_eq!(
        shadows.visible(&Places::new(&[place]), &sphere)[0],
        shadows.visible(&Places::new(&[place]), &sphere)[0]
    );
}

#[test]
fn degenerate_triangles_and_missing_normals_give_finite_places() {
    let mut mesh = lid(0.0, 1.0);
    mesh.triangles.push([0, 0, 1]);
    mesh.triangles.push([2, 1, 0]);
    for normals in [mesh.normals.clone(), vec![Vec3::ZERO; 4], Vec::new()] {
        mesh.normals = normals;
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        let shadows = Shadows::new(&mesh, &rays, 0);
        for triangle in 0..4 {
            let place = shadows.place(triangle, [0.25, 0.25, 0.5]);
            assert!(place.position.is_finite() && place.origin.is_finite(), "{place:?}");
        }
        // Wound the other way round, its side is still the normals'.
        if mesh.normals.first() == Some(&Vec3::Y) {
            assert!(shadows.place(3, [0.25, 0.25, 0.5]).origin.y > 0.0);
            assert_eq!(
                shadows.visible(&Places::new(&[shadows.place(0, [0.2, 0.3, 0.5])]), &beam(DVec3::NEG_Y, 0.5))
                    [0],
                1.0
            );
        }
    }
}

#[test]
fn sixteen_places_see_together_what_each_sees_alone() {
    let mesh = lid(1.0, 0.5);
    let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
    let shadows = Shadows::new(&mesh, &rays, 7);
    // Below the lid, beside it, above it, and within the lamps.
    let places: Vec<Place> = (0..16)
        .map(|i| {
            let i = f64::from(i);
            at(DVec3::new(0.17 * i - 1.2, [0.0, 1.5, 1.9, 0.5][i as usize % 4], 0.03 * i))
        })
        .collect();
    let cone = Cone { direction: DVec3::NEG_Y, inner_degrees: 10.0, outer_degrees: 35.0 };
    for radius in [0.0, 0.4] {
        let of = |kind| Light::new("light", kind).unwrap();
        let near = Lamp { range: Some(1.8), ..lamp(DVec3::new(0.1, 2.0, 0.2), radius) };
        let lights = [
            beam(DVec3::new(0.3, -1.0, 0.1), 20.0 * radius),
            of(LightKind::Point(near.clone())),
            of(LightKind::Spot(near, cone.clone())),
        ];
        for light in lights {
            for count in [1, 7, 15, 16] {
                let together = Places::new(&places[..count]);
                let (visible, arriving) =
                    (shadows.visible(&together, &light), shadows.arriving(&together, &light));
                for (k, place) in places[..count].iter().enumerate() {
                    let alone = Places::new(&[*place]);
                    assert_eq!(visible[k], shadows.visible(&alone, &light)[0], "{light:?} {k} of {count}");
                    assert_eq!(arriving[k], shadows.arriving(&alone, &light)[0], "{light:?} {k} of {count}");
                }
                assert!(visible[count..].iter().chain(&arriving[count..]).all(|&x| x == 0.0));
                let some = |of: &[f32]| of.contains(&0.0) && of.iter().any(|&x| x > 0.0);
                assert!(count < 15 || some(&visible) && some(&arriving), "{visible:?} {arriving:?}");
            }
        }
    }
}

#[test]
fn rays_from_a_triangle_that_is_thinner_than_rounding_start_above_its_smooth_normal() {
    // Two corners that f32 can hardly tell apart: the plane through all three stands upright.
    let mut mesh = lid(0.0, 1.0);
    mesh.positions[0] = Vec3::new(1e-17, -1.0, 0.0);
    mesh.positions[1] = Vec3::new(0.0, -1.0, 0.0);
    mesh.positions[2] = Vec3::new(0.16, -0.99, 0.0);
    mesh.triangles = vec![[0, 2, 1], [0, 1, 3]];
    let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
    let shadows = Shadows::new(&mesh, &rays, 1);
    for weights in [[1.0, 0.0, 0.0], [0.2, 0.3, 0.5]] {
        let place = shadows.place(0, weights);
        let off = place.origin.as_dvec3() - place.position;
        assert!(off.y > 0.5 * f64::from(shadows.lift), "{off}");
    }
}

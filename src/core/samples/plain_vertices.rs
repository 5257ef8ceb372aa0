//! What reaches the vertices of what is not skin, for a rasteriser: it traces no rays from fragments, as [`super::plain`]
//! does from samples.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::LANES;
use super::posed::hits_of_vertices;
use super::visibility::{Place, Places, Shadows};
use crate::bake::harmonics::{Order, basis};
use crate::bake::low_discrepancy::{Sobol, mix};
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::frame;
use crate::model::effects::Effect;
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::mesh::PosedMesh;

/// Rays from each vertex: a harmonic of a half-covered hemisphere has an error of a hundredth.
const RAYS: u32 = 128;
/// Bands of the harmonics: a lid over an eye, a brow beside it.
const BANDS: usize = 3;
/// Numbers of [`PlainVertices::blocked`] a vertex.
pub const HARMONICS: usize = BANDS * BANDS;

/// What reaches the vertices of what is not skin; vertices of skin have zeros.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlainVertices {
    /// Harmonics ([`crate::bake::harmonics`]) of what stands in the way: 1 in directions in which the mesh does, the
    /// hemisphere below the surface being the mirror of the one above. All 0 where nothing does: what looks them up then
    /// finds exactly that.
    pub blocked: Vec<[f32; HARMONICS]>,
    /// What arrives of each of [`lights`]' strengths, their numbers vertex by vertex.
    pub arriving: Vec<f32>,
}

/// The lights that shine on what is not skin, where the scene's parameters have them stand.
#[must_use]
pub fn lights(scene: &Scene) -> Vec<Light> {
    if scene.effects.has(Effect::Lights) { scene.lights_at(&scene.params) } else { Vec::new() }
}

impl PlainVertices {
    /// Of `mesh`, whose triangles are those of `rays`. All cores.
    #[must_use]
    pub fn new(scene: &Scene, mesh: &PosedMesh, rays: &RayMesh) -> Self {
        let shadows = Shadows::new(mesh, rays, scene.quality.shadow_rays);
        let places = places(mesh, &shadows);
        Self {
            blocked: blocked_of_each(mesh, rays, &places),
            arriving: arriving(&lights(scene), &shadows, &places, &mesh.normals),
        }
    }
}

/// Where each vertex of what is not skin may be reached; none of the others.
fn places(mesh: &PosedMesh, shadows: &Shadows<'_>) -> Vec<Option<Place>> {
    let plain = |triangle: u32| mesh.plain.as_ref().is_some_and(|plain| plain.material(triangle).is_some());
    let place = |hit: super::Hit| shadows.place(hit.triangle, hit.weights().map(f64::from));
    let hits = hits_of_vertices(mesh);
    hits.into_par_iter().map(|hit| hit.filter(|hit| plain(hit.triangle)).map(place)).collect()
}

/// The harmonics of what stands in the way of each vertex.
fn blocked_of_each(mesh: &PosedMesh, rays: &RayMesh, places: &[Option<Place>]) -> Vec<[f32; HARMONICS]> {
    let spread = Sobol::new(RAYS);
    let of = |(place, normal): (&Option<Place>, &Vec3)| {
        let known = place.filter(|_| normal.is_finite() && normal.length_squared() > 0.5);
        known.map_or([0.0; HARMONICS], |place| blocked(rays, &spread, &place, (*normal).into()))
    };
    places.par_iter().zip(&mesh.normals).map(of).collect()
}

/// The harmonics of what stands in the way of a place.
fn blocked(rays: &RayMesh, spread: &Sobol, place: &Place, normal: Vec3A) -> [f32; HARMONICS] {
    let Some(order) = Order::new(BANDS) else { return [0.0; HARMONICS] };
    let [x, y, z] = place.position.as_vec3().to_array().map(f32::to_bits);
    let frame = frame(normal.normalize());
    // Even over the hemisphere: the height of an even point is even.
    let even = |(radius, [sine, cosine]): (f32, [f32; 2])| {
        let below = radius * radius;
        let out = (below * (2.0 - below)).max(0.0).sqrt().copysign(radius);
        Vec3A::new(out * cosine, out * sine, 1.0 - below)
    };
    let above: Vec<Vec3A> = spread.disc(mix(x ^ mix(y ^ mix(z)))).map(even).collect();
    let directions: Vec<Vec3A> = above.iter().map(|&d| frame * d).collect();
    let met = rays.wide().hits(place.origin, &directions);
    let mut sums = [0.0_f64; HARMONICS];
    for (d, _) in above.iter().zip(met).filter(|(_, met)| *met) {
        for d in [*d, Vec3A::new(d.x, d.y, -d.z)] {
            let each = basis(order, (frame * d).to_array().map(f64::from));
            sums.iter_mut().zip(each).for_each(|(sum, value)| *sum += value);
        }
    }
    let solid_angle = std::f64::consts::TAU / f64::from(RAYS);
    sums.map(|sum| (solid_angle * sum) as f32)
}

/// What arrives at the vertices of each light, on the side that faces it: as that is drawn.
fn arriving(lights: &[Light], shadows: &Shadows<'_>, places: &[Option<Place>], normals: &[Vec3]) -> Vec<f32> {
    let mut arriving = vec![0.0; lights.len() * places.len()];
    if lights.is_empty() {
        return arriving;
    }
    let vertices = places.par_chunks(LANES).zip(normals.par_chunks(LANES));
    let blocks = arriving.par_chunks_mut(LANES * lights.len()).zip(vertices);
    blocks.for_each(|(arriving, (places, normals))| {
        let known: Vec<(usize, Place)> =
            places.iter().enumerate().filter_map(|(k, place)| Some((k, (*place)?))).collect();
        if known.is_empty() {
            return;
        }
        for (i, light) in lights.iter().enumerate() {
            let lit = |&(k, place): &(usize, Place)| {
                let behind = light.towards(place.position).dot(normals[k].as_dvec3()) < 0.0;
                if behind { place.other_side() } else { place }
            };
            let from = Places::new(&known.iter().map(lit).collect::<Vec<_>>());
            let found = shadows.arriving(&from, light);
            known.iter().zip(found).for_each(|((k, _), found)| arriving[k * lights.len() + i] = found);
        }
    });
    arriving
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::plain::{Alpha, PlainMaterial, PlainParts};

    /// Two squares about the Z axis, the lower one at z = 0 facing +Z, the other at that height above it.
    fn squares(height: f32) -> PosedMesh {
        let corners = |z: f32, half: f32| {
            [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]]
                .map(|[x, y]: [f32; 2]| Vec3::new(half * x, half * y, z))
        };
        let material = PlainMaterial {
            name: String::new(),
            base_color: [1.0; 4],
            color_map: None,
            metallic: 0.0,
            roughness: 1.0,
            roughness_map: None,
            alpha: Alpha::Opaque,
            emission: [0.0; 3],
            emission_map: None,
        };
        let plain = PlainParts {
            of_triangle: vec![Some(0), Some(0), None, None],
            materials: vec![material],
            corner_colors: Vec::new(),
        };
        PosedMesh {
            positions: corners(0.0, 0.01).into_iter().chain(corners(height, 1000.0)).collect(),
            normals: vec![Vec3::Z; 8],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            plain: Some(Arc::new(plain)),
            ..PosedMesh::default()
        }
    }

    fn along(blocked: &[f32; HARMONICS], d: Vec3) -> f64 {
        let each = basis(Order::new(BANDS).unwrap(), d.normalize().to_array().map(f64::from));
        each.iter().zip(blocked).map(|(value, weight)| value * f64::from(*weight)).sum()
    }

    #[test]
    fn below_a_wide_roof_every_direction_is_blocked_and_without_one_none() {
        let of = |mesh: &PosedMesh| {
            let rays = RayMesh::of(mesh);
            blocked_of_each(mesh, &rays, &places(mesh, &Shadows::new(mesh, &rays, 1)))
        };
        let below = of(&squares(1.0));
        // All but what is within a thousandth of the horizon: the constant function, both halves of it. 128 even
        // points leave a few hundredths in the other bands.
        for d in [Vec3::Z, Vec3::new(1.0, 0.5, 0.4), Vec3::new(-0.3, 0.2, -1.0)] {
            assert!((along(&below[0], d) - 1.0).abs() < 0.05, "{d}: {}", along(&below[0], d));
        }
        // Vertices of skin have nothing of it.
        assert!(below[4..].iter().all(|of| *of == [0.0; HARMONICS]));
        // With the roof below the floor nothing is in the way, exactly.
        assert!(of(&squares(-1.0)).iter().all(|of| *of == [0.0; HARMONICS]));
    }
}

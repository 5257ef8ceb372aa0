//! What reaches places that are spread over what is not skin, for a rasteriser: it traces no rays from fragments, as
//! `plain` does from samples.
//!
//! Each triangle has places of its own on an even grid, between which fragments interpolate (Yuksel et al. 2010, *Mesh
//! Colors*). Vertices alone would not do: those of an eye lie behind its lids, and where a few large triangles go on from
//! there to what is seen, all of it would be dark.

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;

use super::LANES;
use super::visibility::{Place, Places, Shadows, seed};
use crate::bake::harmonics::{Order, basis};
use crate::bake::low_discrepancy::Sobol;
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::frame;
use crate::model::effects::Effect;
use crate::model::params::Params;
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::mesh::PosedMesh;

/// Rays from each place and side: a harmonic of a half-covered hemisphere has an error of a hundredth.
const RAYS: u32 = 128;
/// Bands of the harmonics: a lid over an eye, a brow beside it.
const BANDS: usize = 3;
/// Numbers of the harmonics of one side.
pub const HARMONICS: usize = BANDS * BANDS;
/// Places lie so far apart, as a share of the mesh's diagonal: a millimetre or two of a head.
const SPACING: f32 = 1.0 / 256.0;
/// Steps along a triangle's side, at most.
const FINEST: u32 = 8;
/// Places in all, at most, unless corners alone are more.
const MOST: u32 = 1 << 15;

/// Places that are spread over triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Spread {
    /// Of each of the triangles: the number of its first place, and how many steps there are along a side. The place i
    /// steps towards the second corner and j towards the third has the number first + i (2 steps + 3 - i) / 2 + j.
    pub triangles: Vec<[u32; 2]>,
}

/// What reaches them in a pose of the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reaching {
    /// Harmonics ([`crate::bake::harmonics`]) of what stands in the way, of the side that the normal points to, and of the
    /// other: 1 in directions in which the mesh does, the hemisphere below the surface being the mirror of the one above.
    /// All 0 where nothing does: what looks them up then finds exactly that.
    pub blocked: Vec<[[f32; HARMONICS]; 2]>,
    /// What arrives of each of [`lights`]' strengths, their numbers place by place.
    pub arriving: Vec<f32>,
}

/// The lights that shine on what is not skin, where `params` have them stand.
#[must_use]
pub fn lights(scene: &Scene, params: &Params) -> Vec<Light> {
    if scene.effects.has(Effect::Lights) { scene.lights_at(params) } else { Vec::new() }
}

impl Spread {
    /// Over `triangles` of a mesh, by their places in it.
    #[must_use]
    pub fn new(mesh: &PosedMesh, triangles: &[u32]) -> Self {
        let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let longest = |&triangle: &u32| {
            let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.positions[i as usize]);
            a.distance(b).max(b.distance(c)).max(c.distance(a))
        };
        let longest: Vec<f32> = triangles.iter().map(longest).collect();
        let mut spacing = SPACING * (high - low).length();
        loop {
            // Of a side that is no number there is one step.
            let steps: Vec<u32> =
                longest.iter().map(|side| ((side / spacing).ceil() as u32).clamp(1, FINEST)).collect();
            let total: u64 = steps.iter().map(|&steps| u64::from(places_of(steps))).sum();
            if total <= u64::from(MOST) || steps.iter().all(|steps| *steps == 1) {
                let first = steps.iter().scan(0, |next, &steps| {
                    let first = *next;
                    *next += places_of(steps);
                    Some([first, steps])
                });
                return Self { triangles: first.collect() };
            }
            spacing *= 2.0;
        }
    }

    /// How many places there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.triangles.last().map_or(0, |&[first, steps]| (first + places_of(steps)) as usize)
    }

    /// The places one by one: their triangles, as they were given, and the weights of its corners.
    fn each(&self) -> impl Iterator<Item = (usize, [f64; 3])> {
        self.triangles.iter().enumerate().flat_map(|(triangle, &[_, steps])| {
            let share = move |k: u32| f64::from(k) / f64::from(steps);
            let rows = (0..=steps).flat_map(move |i| (0..=steps - i).map(move |j| (i, j)));
            rows.map(move |(i, j)| (triangle, [share(steps - i - j), share(i), share(j)]))
        })
    }
}

/// Places of a triangle.
const fn places_of(steps: u32) -> u32 {
    (steps + 1) * (steps + 2) / 2
}

impl Reaching {
    /// Of those places over `triangles` of `mesh`, whose triangles are those of `rays`. All cores.
    #[must_use]
    pub fn new(
        (scene, lights): (&Scene, &[Light]),
        (mesh, rays): (&PosedMesh, &RayMesh),
        triangles: &[u32],
        spread: &Spread,
    ) -> Self {
        let shadows = Shadows::new(mesh, rays, scene.quality.shadow_rays);
        let places = places(mesh, &shadows, triangles, spread);
        Self { blocked: blocked(rays, &places), arriving: arriving(lights, &shadows, &places) }
    }
}

/// The places with their smooth normals, of unit length or 0.
fn places(
    mesh: &PosedMesh,
    shadows: &Shadows<'_>,
    triangles: &[u32],
    spread: &Spread,
) -> Vec<(Place, DVec3)> {
    let each: Vec<_> = spread.each().collect();
    let place = |(triangle, weights): (usize, [f64; 3])| {
        let triangle = triangles[triangle];
        let corners = mesh.triangles[triangle as usize];
        let normal: DVec3 = (0..3).map(|i| weights[i] * mesh.normals[corners[i] as usize].as_dvec3()).sum();
        (shadows.place(triangle, weights), normal.normalize_or_zero())
    };
    each.into_par_iter().map(place).collect()
}

/// The harmonics of what stands in the way of each place, on both sides.
fn blocked(rays: &RayMesh, places: &[(Place, DVec3)]) -> Vec<[[f32; HARMONICS]; 2]> {
    let spread = Sobol::new(RAYS);
    let of = |&(place, normal): &(Place, DVec3)| {
        let normal = normal.as_vec3a();
        if normal == Vec3A::ZERO {
            return [[0.0; HARMONICS]; 2];
        }
        [
            blocked_above(rays, &spread, &place, normal),
            blocked_above(rays, &spread, &place.other_side(), -normal),
        ]
    };
    places.par_iter().map(of).collect()
}

/// The harmonics of what stands in the way of a place, above its side of that unit normal.
fn blocked_above(rays: &RayMesh, spread: &Sobol, place: &Place, normal: Vec3A) -> [f32; HARMONICS] {
    let Some(order) = Order::new(BANDS) else { return [0.0; HARMONICS] };
    let frame = frame(normal);
    // Even over the hemisphere: the height of an even point is even.
    let even = |(radius, [sine, cosine]): (f32, [f32; 2])| {
        let below = radius * radius;
        let out = (below * (2.0 - below)).max(0.0).sqrt().copysign(radius);
        Vec3A::new(out * cosine, out * sine, 1.0 - below)
    };
    let above: Vec<Vec3A> = spread.disc(seed(place)).map(even).collect();
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

/// What arrives at the places of each light, on the side that faces it: as that is drawn.
fn arriving(lights: &[Light], shadows: &Shadows<'_>, places: &[(Place, DVec3)]) -> Vec<f32> {
    let mut arriving = vec![0.0; lights.len() * places.len()];
    if lights.is_empty() {
        return arriving;
    }
    let blocks = arriving.par_chunks_mut(LANES * lights.len()).zip(places.par_chunks(LANES));
    blocks.for_each(|(arriving, places)| {
        for (i, light) in lights.iter().enumerate() {
            let lit = |&(place, normal): &(Place, DVec3)| {
                if light.towards(place.position).dot(normal) < 0.0 { place.other_side() } else { place }
            };
            let from = Places::new(&places.iter().map(lit).collect::<Vec<_>>());
            let found = shadows.arriving(&from, light);
            (0..places.len()).for_each(|k| arriving[k * lights.len() + i] = found[k]);
        }
    });
    arriving
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares about the Z axis, the lower one at z = 0 facing +Z, the other at that height above it.
    fn squares(height: f32) -> PosedMesh {
        let corners = |z: f32, half: f32| {
            [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]]
                .map(|[x, y]: [f32; 2]| Vec3::new(half * x, half * y, z))
        };
        PosedMesh {
            positions: corners(0.0, 0.01).into_iter().chain(corners(height, 1000.0)).collect(),
            normals: vec![Vec3::Z; 8],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
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
            let spread = Spread { triangles: vec![[0, 2], [6, 1]] };
            blocked(&rays, &places(mesh, &Shadows::new(mesh, &rays, 1), &[0, 1], &spread))
        };
        let below = of(&squares(1.0));
        assert_eq!(below.len(), 9);
        for [front, back] in &below {
            // All but what is within a thousandth of the horizon: the constant function, both halves of it. In the other bands
            // 128 random points would leave 0.2, even ones leave less.
            for d in [Vec3::Z, Vec3::new(1.0, 0.5, 0.4), Vec3::new(-0.3, 0.2, -1.0)] {
                assert!((along(front, d) - 1.0).abs() < 0.2, "{d}: {}", along(front, d));
            }
            // Nothing is below, exactly.
            assert_eq!(*back, [0.0; HARMONICS]);
        }
        // With the roof below the floor it is the other way round.
        assert!(of(&squares(-1.0)).iter().all(|[front, back]| *front == [0.0; HARMONICS] && back[0] > 3.0));
    }

    #[test]
    fn places_are_the_corners_and_what_lies_evenly_between_and_large_triangles_have_more() {
        let mesh = squares(0.0);
        let spread = Spread::new(&mesh, &[0, 2]);
        assert_eq!(spread.triangles, [[0, 1], [3, FINEST]]);
        assert_eq!(spread.count(), 3 + 45);
        let each: Vec<_> = spread.each().collect();
        assert_eq!(each.len(), spread.count());
        for (number, (triangle, weights)) in each.into_iter().enumerate() {
            let [first, steps] = spread.triangles[triangle];
            let [_, b, c] = weights.map(|weight| (weight * f64::from(steps)).round() as u32);
            assert_eq!(number as u32, first + b * (2 * steps + 3 - b) / 2 + c);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
        // Of many large ones each has fewer, and its corners however many there are.
        let many = Spread::new(&mesh, &[2; 2_000]);
        assert!(
            many.count() <= MOST as usize && many.triangles.iter().all(|[_, steps]| (2..8).contains(steps))
        );
        assert!(Spread::new(&mesh, &[2; 20_000]).triangles.iter().all(|[_, steps]| *steps == 1));
    }
}

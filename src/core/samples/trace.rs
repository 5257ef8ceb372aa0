//! Primary rays: which point of the mesh each stratified sample of each pixel sees.

use glam::{DVec3, Vec2, Vec3A};
use rayon::prelude::*;

use crate::bake::rays::RayMesh;
use crate::scene::mesh::PosedMesh;
use crate::scene::view::Camera;

/// A point of the mesh: a triangle, and the weights of its second and third vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The triangle.
    pub triangle: u32,
    /// The weights of its second and third vertex.
    pub barycentric: [f32; 2],
}

impl Hit {
    /// The weights of the three vertices.
    #[must_use]
    pub fn weights(&self) -> [f32; 3] {
        let [u, v] = self.barycentric;
        [1.0 - u - v, u, v]
    }

    /// The texture coordinates there; 0 where the mesh has none.
    #[must_use]
    pub fn uv(&self, mesh: &PosedMesh) -> Vec2 {
        if mesh.uvs.is_empty() {
            return Vec2::ZERO;
        }
        let corners = mesh.triangles[self.triangle as usize];
        self.weights().into_iter().zip(corners).map(|(weight, i)| weight * mesh.uvs[i as usize]).sum()
    }
}

/// What a view sees: the pixels that show the mesh, and their hits.
#[derive(Default)]
pub(super) struct Hits {
    /// For each pixel, row by row: its index in the image, and where its hits start and end.
    pub(super) pixels: Vec<(u32, std::ops::Range<u32>)>,
    pub(super) hits: Vec<Hit>,
}

/// A triangle as seen from the eye: rays from there hit it by three dot products.
///
/// With corners a, b, c relative to the eye, the ray d passes edge ab on the side that the sign of
/// d . (a x b) tells. Neighbours see exactly negated numbers, so no ray slips between them; the
/// three numbers are the barycentric weights up to their sum, which is d . N.
struct Seen {
    /// b x c, c x a, a x b.
    edges: [DVec3; 3],
    /// a . N with N = (b - a) x (c - a): the distance along d is this over d . N.
    volume: f64,
}

impl Seen {
    fn new(mesh: &PosedMesh, triangle: [u32; 3], eye: DVec3) -> Self {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3() - eye);
        Self { edges: [b.cross(c), c.cross(a), a.cross(b)], volume: (b - a).cross(c - a).dot(a) }
    }

    /// Distance along `d` (in its lengths) and the three weights, where the ray passes through.
    #[inline(always)]
    fn hit(&self, d: DVec3) -> Option<(f64, [f64; 3])> {
        let weights = self.edges.map(|edge| edge.dot(d));
        let [u, v, w] = weights;
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let sum = u + v + w;
        let distance = self.volume / sum;
        (inside && sum != 0.0 && distance > 0.0).then(|| (distance, weights.map(|x| x / sum)))
    }
}

/// Rays of a camera, as `Camera::direction` but for their length.
pub(super) struct Lens {
    pub(super) eye: DVec3,
    /// Unit vector along which depth is measured; every direction goes one unit along it.
    pub(super) forward: DVec3,
    /// Direction through the image's top left corner, and its steps for a pixel right and down.
    corner: DVec3,
    pub(super) right: DVec3,
    pub(super) down: DVec3,
}

impl Lens {
    pub(super) fn new(camera: &Camera) -> Self {
        let to_world = camera.world_to_camera.inverse();
        let tangent = (0.5 * camera.fov_y).tan();
        // Pixels are square: the field of view is the image's height.
        let pixel = 2.0 * tangent / f64::from(camera.height);
        let half = 0.5 * pixel * f64::from(camera.width);
        let local = |x: f64, y: f64, z: f64| to_world.transform_vector3(DVec3::new(x, y, z));
        Self {
            eye: to_world.w_axis.truncate(),
            forward: local(0.0, 0.0, -1.0),
            corner: local(-half, tangent, -1.0),
            right: local(pixel, 0.0, 0.0),
            down: local(0.0, -pixel, 0.0),
        }
    }

    pub(super) fn direction(&self, x: f64, y: f64) -> DVec3 {
        self.corner + x * self.right + y * self.down
    }
}

/// The hits of `n x n` samples a pixel, at the centres of its strata, row by row. Both sides of a
/// triangle are seen.
pub(super) fn trace(rays: &RayMesh, mesh: &PosedMesh, camera: &Camera, n: u32) -> Hits {
    let lens = Lens::new(camera);
    let seen: Vec<Seen> = mesh.triangles.par_iter().map(|&t| Seen::new(mesh, t, lens.eye)).collect();
    let [columns, rows] = bounds(mesh, camera);
    let n = n.max(1);
    let parts: Vec<Hits> = rows
        .into_par_iter()
        .map(|y| {
            let mut part = Hits::default();
            for x in columns.clone() {
                let start = part.hits.len() as u32;
                for i in 0..n * n {
                    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
                    let d = lens.direction(f64::from(x) + at(i % n), f64::from(y) + at(i / n));
                    part.hits
                        .extend(nearest(rays, lens.eye, d, |triangle, d| seen[triangle as usize].hit(d)));
                }
                let end = part.hits.len() as u32;
                if end > start {
                    part.pixels.push((y * camera.width + x, start..end));
                }
            }
            part
        })
        .collect();
    let mut all = Hits::default();
    for part in parts {
        let base = all.hits.len() as u32;
        let shifted =
            |(pixel, hits): (u32, std::ops::Range<u32>)| (pixel, base + hits.start..base + hits.end);
        all.pixels.extend(part.pixels.into_iter().map(shifted));
        all.hits.extend(part.hits);
    }
    all
}

/// What the point (x, y) of an image shows, in pixels from the upper left corner.
#[must_use]
pub fn hit_at(rays: &RayMesh, mesh: &PosedMesh, camera: &Camera, x: f64, y: f64) -> Option<Hit> {
    let lens = Lens::new(camera);
    nearest(rays, lens.eye, lens.direction(x, y), |triangle, d| {
        Seen::new(mesh, mesh.triangles[triangle as usize], lens.eye).hit(d)
    })
}

/// The nearest triangle from `eye` along `d`, by what `hit` says of a triangle and a unit direction.
fn nearest(
    rays: &RayMesh,
    eye: DVec3,
    d: DVec3,
    hit: impl Fn(u32, DVec3) -> Option<(f64, [f64; 3])>,
) -> Option<Hit> {
    let d = d.normalize();
    let (origin, direction) = (Vec3A::from(eye.as_vec3()), Vec3A::from(d.as_vec3()));
    let triangle = rays.nearest(origin, direction, |triangle| {
        hit(triangle, d).map_or(f32::INFINITY, |(distance, _)| distance as f32)
    })?;
    let (_, [_, u, v]) = hit(triangle, d)?;
    Some(Hit { triangle, barycentric: [u as f32, v as f32] })
}

/// The columns and rows in which the mesh can be seen: all, when some of it is beside or behind
/// the eye.
fn bounds(mesh: &PosedMesh, camera: &Camera) -> [std::ops::Range<u32>; 2] {
    let size = [camera.width, camera.height];
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for position in &mesh.positions {
        let (x, y, depth) = camera.project(position.as_dvec3());
        if depth <= 0.0 || !(x + y).is_finite() {
            return size.map(|size| 0..size);
        }
        for (i, value) in [x, y].into_iter().enumerate() {
            low[i] = low[i].min(value);
            high[i] = high[i].max(value);
        }
    }
    std::array::from_fn(|i| {
        let clamp = |value: f64| value.clamp(0.0, f64::from(size[i])) as u32;
        clamp(low[i].floor())..clamp(high[i].ceil())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat4, Vec3};

    fn camera(size: u32) -> Camera {
        let world_to_camera = DMat4::from_translation(DVec3::new(0.1, -0.2, -3.0));
        Camera { world_to_camera, fov_y: 0.7, width: size + 7, height: size }
    }

    /// A sphere of `n` rings.
    fn sphere(n: u32) -> PosedMesh {
        let mut mesh = PosedMesh::default();
        for i in 0..=n {
            for j in 0..2 * n {
                let (theta, phi) =
                    (std::f32::consts::PI * i as f32 / n as f32, std::f32::consts::PI * j as f32 / n as f32);
                let p = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
                mesh.positions.push(p);
                if i < n {
                    let at = |di: u32, dj: u32| (i + di) * 2 * n + (j + dj) % (2 * n);
                    mesh.triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
                    mesh.triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
                }
            }
        }
        mesh
    }

    #[test]
    fn a_lens_gives_the_cameras_directions() {
        let camera = camera(40);
        let lens = Lens::new(&camera);
        for (x, y) in [(0.0, 0.0), (12.5, 30.5), (46.5, 39.5)] {
            let error = lens.direction(x, y).normalize() - camera.direction(x, y);
            // A few roundings of f64.
            assert!(error.length() < 1e-15, "{error}");
        }
        assert!((lens.eye - camera.eye()).length() < 1e-15);
    }

    #[test]
    fn a_point_of_the_image_shows_what_its_sample_sees() {
        let (mesh, camera) = (sphere(20), camera(24));
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        let hits = trace(&rays, &mesh, &camera, 1);
        assert!(hits.pixels.len() > 100);
        for (pixel, range) in &hits.pixels {
            let (x, y) = (f64::from(pixel % camera.width) + 0.5, f64::from(pixel / camera.width) + 0.5);
            assert_eq!(hit_at(&rays, &mesh, &camera, x, y), Some(hits.hits[range.start as usize]));
        }
        assert_eq!(hit_at(&rays, &mesh, &camera, 0.5, 0.5), None);
    }

    #[test]
    fn hits_lie_on_their_rays_and_a_closed_surface_has_no_holes() {
        let (mesh, camera) = (sphere(30), camera(64));
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        let hits = trace(&rays, &mesh, &camera, 3);
        let n = f64::from(3);
        let mut inside = 0;
        for (pixel, range) in &hits.pixels {
            let (x, y) = (pixel % camera.width, pixel / camera.width);
            let centre = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
            // The distance from the sphere's centre to the ray tells whether the pixel is full.
            let to_centre = -camera.eye();
            let off = (to_centre - centre * to_centre.dot(centre)).length();
            if off < 0.95 {
                inside += 1;
                assert_eq!(range.len(), 9, "pixel ({x}, {y})");
            }
            for (k, hit) in hits.hits[range.start as usize..range.end as usize].iter().enumerate() {
                let [a, b, c] =
                    mesh.triangles[hit.triangle as usize].map(|i| mesh.positions[i as usize].as_dvec3());
                let [u, v] = hit.barycentric.map(f64::from);
                let (px, py, _) = camera.project(a + u * (b - a) + v * (c - a));
                if range.len() == 9 {
                    let at = |i: usize| (i as f64 + 0.5) / n;
                    let error = (px - f64::from(x) - at(k % 3)).hypot(py - f64::from(y) - at(k / 3));
                    // Weights in f32 on triangles of a few pixels.
                    assert!(error < 1e-5, "{error}");
                }
            }
        }
        assert!(inside > 1000, "{inside}");
    }

    #[test]
    fn the_nearest_of_several_surfaces_is_seen_from_inside_too() {
        let mesh = sphere(12);
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        let inside = Camera { world_to_camera: DMat4::IDENTITY, ..camera(16) };
        let hits = trace(&rays, &mesh, &inside, 1);
        assert_eq!(hits.pixels.len(), 16 * 23);
        let behind = DMat4::from_translation(DVec3::new(0.0, 0.0, 5.0));
        let away = Camera { world_to_camera: behind, ..camera(16) };
        assert!(trace(&rays, &mesh, &away, 1).pixels.is_empty());
    }
}

//! Primary rays: which point of the mesh each stratified sample of each pixel sees. Those of a pinhole that end at the first
//! surface find it triangle by triangle (`raster`), the others by a hierarchy.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

pub use super::hit::Hit;
use super::raster::{Raster, Scratch};
use crate::bake::low_discrepancy::mix;
use crate::bake::rays::RayMesh;
use crate::scene::mesh::PosedMesh;
use crate::scene::plain::{PlainMaterial, PlainParts};
use crate::scene::view::Camera;

/// What a view sees: the pixels that show the mesh, and their hits.
#[derive(Default)]
pub(super) struct Hits {
    /// For each pixel, row by row: its index in the image, and where its hits start and end.
    pub(super) pixels: Vec<(u32, std::ops::Range<u32>)>,
    pub(super) hits: Vec<Hit>,
    /// The samples that show what is not skin: their pixels' indices, and their hits.
    pub(super) plain: Vec<(u32, Hit)>,
}

/// What a ray sees.
enum Shown {
    Nothing,
    Skin(Hit),
    Plain(Hit),
}

/// Behind this number of layers that blend only what is opaque is seen.
const MOST_LAYERS: usize = 16;
/// And behind this number of triangles, those with holes there among them.
const MOST_HOLES: usize = 256;

/// A triangle as seen from the eye: rays from there hit it by three dot products.
///
/// With corners a, b, c relative to the eye, the ray d passes edge ab on the side that the sign of
/// d . (a x b) tells. Neighbours see exactly negated numbers, so no ray slips between them; the
/// three numbers are the barycentric weights up to their sum, which is d . N.
pub(super) struct Seen {
    /// b x c, c x a, a x b.
    edges: [DVec3; 3],
    /// a . N with N = (b - a) x (c - a): the distance along d is this over d . N.
    volume: f64,
}

impl Seen {
    pub(super) fn new(mesh: &PosedMesh, triangle: [u32; 3], eye: DVec3) -> Self {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3() - eye);
        Self { edges: [b.cross(c), c.cross(a), a.cross(b)], volume: (b - a).cross(c - a).dot(a) }
    }

    /// Distance along `d` (in its lengths) and the three weights, where the ray passes through.
    #[inline(always)]
    pub(super) fn hit(&self, d: DVec3) -> Option<(f64, [f64; 3])> {
        let [u, v, w] = self.edges.map(|edge| edge.dot(d));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let sum = u + v + w;
        if !inside || sum == 0.0 {
            return None;
        }
        let distance = self.volume / sum;
        (distance > 0.0).then(|| (distance, [u / sum, v / sum, w / sum]))
    }

    /// The distance of the eye from the plane that it lies in.
    pub(super) fn plane(&self) -> f64 {
        let [u, v, w] = self.edges;
        self.volume.abs() / (u + v + w).length()
    }
}

/// Rays of a camera, as `Camera::direction` but for their length.
pub(super) struct CameraRays {
    pub(super) eye: DVec3,
    /// Unit vector along which depth is measured; every direction goes one unit along it.
    pub(super) forward: DVec3,
    /// Direction through the image's top left corner, and its steps for a pixel right and down: of a pinhole.
    corner: DVec3,
    right: DVec3,
    down: DVec3,
    /// The camera, where its lens bends rays, and unit vectors to the right and down.
    bent: Option<(Camera, [DVec3; 2])>,
}

impl CameraRays {
    pub(super) fn new(camera: &Camera) -> Self {
        let to_world = camera.world_to_camera.inverse();
        let tangent = (0.5 * camera.fov_y).tan();
        let [cx, cy] = camera.lens.centre;
        let pixel = 2.0 * tangent / f64::from(camera.height);
        let across = pixel / camera.lens.ratio;
        let half = 0.5 * across * f64::from(camera.width);
        let local = |x: f64, y: f64, z: f64| to_world.transform_vector3(DVec3::new(x, y, z));
        let axes = [local(1.0, 0.0, 0.0), local(0.0, -1.0, 0.0)];
        Self {
            eye: to_world.w_axis.truncate(),
            forward: local(0.0, 0.0, -1.0),
            corner: local(-half - across * cx, tangent + pixel * cy, -1.0),
            right: local(across, 0.0, 0.0),
            down: local(0.0, -pixel, 0.0),
            bent: camera.lens.distortion.is_some().then_some((*camera, axes)),
        }
    }

    pub(super) fn direction(&self, x: f64, y: f64) -> DVec3 {
        match &self.bent {
            None => self.corner + x * self.right + y * self.down,
            Some((camera, [right, down])) => {
                let [across, below] = camera.image_plane(x, y).unwrap_or_else(|place| place);
                self.forward + across * right + below * down
            }
        }
    }

    /// The directions of a pixel's `n x n` samples, at the centres of its strata, row by row.
    pub(super) fn of_pixel(&self, [x, y]: [u32; 2], n: u32) -> impl Iterator<Item = DVec3> {
        let at = move |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        (0..n * n).map(move |i| self.direction(f64::from(x) + at(i % n), f64::from(y) + at(i / n)))
    }

    /// How the direction of a ray moves for a pixel right and down where it goes to `place`, from the eye: in its lengths
    /// of one unit along the camera's axis.
    pub(super) fn steps(&self, place: DVec3) -> [DVec3; 2] {
        let Some((camera, axes)) = &self.bent else { return [self.right, self.down] };
        let depth = place.dot(self.forward);
        let on_plane = axes.map(|axis| place.dot(axis) / depth);
        // The inverse of how the lens moves what it shows.
        let [[a, b], [c, d]] = camera.lens.distorted(on_plane).1;
        let det = a * d - b * c;
        let sizes = [self.right.length(), self.down.length()];
        let columns = [[d / det, -b / det], [-c / det, a / det]];
        std::array::from_fn(|i| sizes[i] * (columns[i][0] * axes[0] + columns[i][1] * axes[1]))
    }
}

/// The hits of `n x n` samples a pixel, at the centres of its strata, row by row. Both sides of a
/// triangle are seen.
pub(super) fn trace(rays: &RayMesh, mesh: &PosedMesh, camera: &Camera, n: u32) -> Hits {
    let camera_rays = CameraRays::new(camera);
    let seen: Vec<Seen> = mesh.triangles.par_iter().map(|&t| Seen::new(mesh, t, camera_rays.eye)).collect();
    let n = n.max(1);
    // Where all rays are straight and end at the first surface, triangles find their rays.
    if mesh.plain.is_none()
        && camera.lens.distortion.is_none()
        && let Some(raster) = Raster::new(rays, mesh, (camera, &camera_rays), n, &seen)
    {
        let rows = (0..camera.height).into_par_iter();
        let row = |scratch: &mut Scratch, y| raster.row(y, &camera_rays, &seen, scratch);
        return joined(rows.map_init(Scratch::default, row).collect());
    }
    by_hierarchy(rays, mesh, camera, n, (&camera_rays, &seen))
}

/// The hits of all rows by the hierarchy.
fn by_hierarchy(
    rays: &RayMesh,
    mesh: &PosedMesh,
    camera: &Camera,
    n: u32,
    (camera_rays, seen): (&CameraRays, &[Seen]),
) -> Hits {
    let [columns, rows] = bounds(mesh, camera);
    let row = |y| row_by_hierarchy(rays, mesh, (y, columns.clone(), camera.width), n, (camera_rays, seen));
    joined(rows.into_par_iter().map(row).collect())
}

/// As [`trace`], by the hierarchy whatever is seen.
#[cfg(test)]
pub(super) fn trace_by_hierarchy(rays: &RayMesh, mesh: &PosedMesh, camera: &Camera, n: u32) -> Hits {
    let camera_rays = CameraRays::new(camera);
    let seen: Vec<Seen> = mesh.triangles.iter().map(|&t| Seen::new(mesh, t, camera_rays.eye)).collect();
    by_hierarchy(rays, mesh, camera, n, (&camera_rays, &seen))
}

/// The hits of a row of pixels by the hierarchy.
fn row_by_hierarchy(
    rays: &RayMesh,
    mesh: &PosedMesh,
    (y, columns, width): (u32, std::ops::Range<u32>, u32),
    n: u32,
    (camera_rays, seen): (&CameraRays, &[Seen]),
) -> Hits {
    let mut row = Hits::default();
    let all = n * n;
    for x in columns {
        let (start, pixel) = (row.hits.len() as u32, y * width + x);
        let turn = mix(pixel) % all;
        for (i, d) in (0..).zip(camera_rays.of_pixel([x, y], n)) {
            let cut = || (f64::from((i + turn) % all) + 0.5) / f64::from(all);
            let hit = |triangle: u32, d| seen[triangle as usize].hit(d);
            match shown(rays, mesh, (camera_rays.eye, d), cut, hit) {
                Shown::Nothing => {}
                Shown::Skin(hit) => row.hits.push(hit),
                Shown::Plain(hit) => row.plain.push((pixel, hit)),
            }
        }
        let end = row.hits.len() as u32;
        if end > start {
            row.pixels.push((pixel, start..end));
        }
    }
    row
}

/// The hits of rows, one after the other.
fn joined(rows: Vec<Hits>) -> Hits {
    let mut all = Hits::default();
    all.hits.reserve(rows.iter().map(|row| row.hits.len()).sum());
    for row in rows {
        let base = all.hits.len() as u32;
        let shifted =
            |(pixel, hits): (u32, std::ops::Range<u32>)| (pixel, base + hits.start..base + hits.end);
        all.pixels.extend(row.pixels.into_iter().map(shifted));
        all.hits.extend(row.hits);
        all.plain.extend(row.plain);
    }
    all
}

/// The skin that the point (x, y) of an image shows, in pixels from the upper left corner.
#[must_use]
pub fn hit_at(rays: &RayMesh, mesh: &PosedMesh, camera: &Camera, x: f64, y: f64) -> Option<Hit> {
    let camera_rays = CameraRays::new(camera);
    let ray = (camera_rays.eye, camera_rays.direction(x, y));
    let hit =
        |triangle: u32, d: DVec3| Seen::new(mesh, mesh.triangles[triangle as usize], camera_rays.eye).hit(d);
    match shown(rays, mesh, ray, || 0.5, hit) {
        Shown::Skin(hit) => Some(hit),
        Shown::Plain(_) | Shown::Nothing => None,
    }
}

/// What is seen from `eye` along `d`. A layer that blends is seen by those rays whose `cut`, in (0, 1), lies below what
/// it and the layers before it cover, so that the mean over a pixel is blended in order (Enderton et al. 2010, *Stochastic
/// Transparency*, stratified).
fn shown(
    rays: &RayMesh,
    mesh: &PosedMesh,
    (eye, d): (DVec3, DVec3),
    cut: impl Fn() -> f64,
    hit: impl Fn(u32, DVec3) -> Option<(f64, [f64; 3])>,
) -> Shown {
    let Some(plain) = &mesh.plain else {
        return nearest(rays, eye, d, hit).map_or(Shown::Nothing, Shown::Skin);
    };
    let mut passed: Vec<u32> = Vec::new();
    // What goes through the layers so far, and how many hold back some of it: holes do not.
    let (mut through, mut layers) = (1.0, 0);
    while layers < MOST_LAYERS && passed.len() < MOST_HOLES {
        let beyond =
            |triangle: u32, d: DVec3| if passed.contains(&triangle) { None } else { hit(triangle, d) };
        let Some(found) = nearest(rays, eye, d, beyond) else { return Shown::Nothing };
        let Some(material) = plain.material(found.triangle) else { return Shown::Skin(found) };
        let seen = f64::from(material.seen(found.uv(mesh), plain.tint(found.triangle, found.weights())));
        through *= 1.0 - seen;
        layers += usize::from(seen > 0.0);
        if cut() < 1.0 - through {
            return Shown::Plain(found);
        }
        passed.push(found.triangle);
    }
    opaque(rays, mesh, plain, (eye, d), hit)
}

/// The first of what lets nothing through, from `eye` along `d`: what many layers hide most of is no hole in what is behind
/// them.
fn opaque(
    rays: &RayMesh,
    mesh: &PosedMesh,
    plain: &PlainParts,
    (eye, d): (DVec3, DVec3),
    hit: impl Fn(u32, DVec3) -> Option<(f64, [f64; 3])>,
) -> Shown {
    let whole = |triangle: u32, d: DVec3| {
        let (distance, weights) = hit(triangle, d)?;
        let [_, u, v] = weights.map(|weight| weight as f32);
        let at = Hit { triangle, barycentric: [u, v] };
        let seen = |material: &PlainMaterial| material.seen(at.uv(mesh), plain.tint(triangle, at.weights()));
        plain.material(triangle).is_none_or(|material| seen(material) >= 1.0).then_some((distance, weights))
    };
    match nearest(rays, eye, d, whole) {
        None => Shown::Nothing,
        Some(found) if plain.material(found.triangle).is_some() => Shown::Plain(found),
        Some(found) => Shown::Skin(found),
    }
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
    // What is straight bulges beyond its ends there.
    if camera.lens.distortion.is_some() {
        return size.map(|size| 0..size);
    }
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
    use crate::scene::lens::{Distortion, Lens};
    use glam::{DMat4, Vec3};

    fn camera(size: u32) -> Camera {
        let world_to_camera = DMat4::from_translation(DVec3::new(0.1, -0.2, -3.0));
        Camera::pinhole(world_to_camera, 0.7, [size + 7, size])
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
    fn rays_go_where_the_camera_says() {
        for lens in lenses() {
            let camera = Camera { lens, ..camera(40) };
            let rays = CameraRays::new(&camera);
            for (x, y) in [(0.0, 0.0), (12.5, 30.5), (46.5, 39.5)] {
                let error = rays.direction(x, y).normalize() - camera.direction(x, y);
                // A few roundings of f64.
                assert!(error.length() < 1e-15, "{error}");
                let (px, py, _) = camera.project(rays.eye + 3.0 * rays.direction(x, y));
                // Of numbers up to 50.
                assert!((px - x).hypot(py - y) < 1e-12, "{lens:?}: {px} {py}");
            }
            assert!((rays.eye - camera.eye()).length() < 1e-15);
        }
    }

    #[test]
    fn steps_are_those_from_pixel_to_pixel() {
        for lens in lenses() {
            let rays = CameraRays::new(&Camera { lens, ..camera(40) });
            for (x, y) in [(3.0, 5.0), (22.5, 18.5), (40.5, 35.5)] {
                let h = 1e-4;
                let differences = [(h, 0.0), (0.0, h)].map(|(dx, dy)| {
                    (rays.direction(x + dx, y + dy) - rays.direction(x - dx, y - dy)) / (2.0 * h)
                });
                for (step, want) in rays.steps(7.0 * rays.direction(x, y)).into_iter().zip(differences) {
                    // Roundings over the difference: 1e-16 over 1e-4, beside steps of 0.02.
                    assert!((step - want).length() < 1e-10, "{lens:?}: {step} {want}");
                }
            }
        }
    }

    /// A pinhole, one that is off the middle and not square, and lenses that bend.
    fn lenses() -> [Lens; 4] {
        let off = Lens { centre: [3.5, -2.0], ratio: 1.1, distortion: None };
        let brown = Distortion::Brown { k: [-0.28, 0.11, -0.02], p: [0.0012, -0.0007] };
        let fisheye = Distortion::Fisheye { k: [-0.02, 0.004, -0.001, 0.0002] };
        let with = |distortion: Distortion| Lens { distortion: Some(distortion), ..off };
        [Lens::default(), off, with(brown), with(fisheye)]
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

//! What the rays of a pinhole see, without a hierarchy: each triangle is tried with the rays that it can cover.
//!
//! All rays start at the eye, so that a triangle's corners in the image bound the samples whose rays can hit it: of each row of
//! samples, those between its edges. They are tried by the same products as by a hierarchy ([`super::trace`]): but for ties the
//! same is seen. Of triangles as far as each other to an f32 it is the first in the mesh.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::trace::{CameraRays, Hit, Hits, Seen};
use crate::bake::rays::RayMesh;
use crate::scene::mesh::PosedMesh;
use crate::scene::view::Camera;

/// What lies nearer to the eye, as a share of the largest coordinate, is clipped; with many samples a radian, more is: this
/// for each. So edges that leave the image far away are exact to far less than from a sample to the border of its stratum.
const NEAR: [f64; 2] = [1e-9, 1e-14];
/// Tries for each sample of the image beyond which a hierarchy is taken: a ray finds its triangle there in as much time.
const MOST_TRIES: u64 = 64;
/// Spans for each sample beyond which it is, too, as they would take as much memory as what samples hold; and how many may be at
/// least.
const MOST_SPANS: u64 = 4;
const SOME_SPANS: u64 = 1 << 22;

/// A triangle, and the columns of samples that it can cover in a row of them.
#[derive(Clone, Copy, Debug)]
struct Span {
    triangle: u32,
    columns: [u32; 2],
}

/// The triangles that can be seen in each row of an image's samples.
pub(super) struct Raster {
    width: u32,
    /// Samples along a side of a pixel.
    n: u32,
    /// Of all rows, one row's after the other's; of a row in the mesh's order.
    spans: Vec<Span>,
    /// Where each row's begin, and the last one's end.
    starts: Vec<usize>,
}

/// What a thread sees a row of pixels with.
#[derive(Default)]
pub(super) struct Scratch {
    /// The unit direction of each sample, and the nearest triangle there: a row of samples after the other.
    samples: Vec<(DVec3, f32, u32)>,
}

/// Where the samples of an image stand, `n x n` in each pixel.
#[derive(Clone, Copy)]
struct Grid {
    n: u32,
    columns: u32,
    rows: u32,
}

impl Raster {
    /// Of a camera whose lens does not bend rays; `seen` are all triangles of the mesh. `None` where a hierarchy is faster.
    pub(super) fn new(
        rays: &RayMesh,
        mesh: &PosedMesh,
        (camera, camera_rays): (&Camera, &CameraRays),
        n: u32,
        seen: &[Seen],
    ) -> Option<Self> {
        let grid = Grid { n, columns: camera.width.checked_mul(n)?, rows: camera.height.checked_mul(n)? };
        let clip = Clip::new(mesh, camera, camera_rays, n);
        let outlines: Vec<(u32, Outline)> = rays
            .triangles()
            .par_iter()
            .map(|&index| (index, clip.outline(mesh, index, &seen[index as usize])))
            .filter(|(_, outline)| !grid.rows_of(outline).is_empty())
            .collect();
        grid.affords(&outlines).then_some(())?;
        // In the mesh's order, and then row by row.
        let found: Vec<(u32, Span)> = outlines
            .par_iter()
            .flat_map_iter(|&(triangle, outline)| {
                let span = move |(row, Range { start, end })| (row, Span { triangle, columns: [start, end] });
                grid.spans_of(&outline).map(span).collect::<Vec<_>>()
            })
            .collect();
        let mut starts = vec![0; grid.rows as usize + 1];
        found.iter().for_each(|(row, _)| starts[*row as usize + 1] += 1);
        for row in 0..grid.rows as usize {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut spans = vec![Span { triangle: 0, columns: [0; 2] }; found.len()];
        for (row, span) in found {
            spans[next[row as usize]] = span;
            next[row as usize] += 1;
        }
        Some(Self { width: camera.width, n, spans, starts })
    }

    /// The hits of row `y` of pixels.
    pub(super) fn row(
        &self,
        y: u32,
        rays: &CameraRays,
        seen: &[Seen],
        Scratch { samples }: &mut Scratch,
    ) -> Hits {
        let n = self.n;
        let rows = (y * n..(y + 1) * n).map(|row| {
            let row = row as usize;
            &self.spans[self.starts[row]..self.starts[row + 1]]
        });
        let all = || rows.clone().flatten();
        let start = all().map(|span| span.columns[0] / n).min().unwrap_or(0);
        let end = all().map(|span| span.columns[1].div_ceil(n)).max().unwrap_or(0);
        let wide = ((end - start) * n) as usize;
        samples.clear();
        samples.resize(wide * n as usize, (DVec3::ZERO, f32::INFINITY, 0));
        let place = |x: u32, i: u32| (i / n) as usize * wide + ((x - start) * n + i % n) as usize;
        for x in start..end {
            for (i, d) in (0..).zip(rays.of_pixel([x, y], n)) {
                samples[place(x, i)].0 = d.normalize();
            }
        }
        for (row, spans) in rows.enumerate() {
            let row = &mut samples[row * wide..(row + 1) * wide];
            for &Span { triangle, columns } in spans {
                let [first, last] = columns.map(|column| (column - start * n) as usize);
                let of_triangle = &seen[triangle as usize];
                for (d, nearest, which) in &mut row[first..last] {
                    if let Some((distance, _)) = of_triangle.hit(*d)
                        && (distance as f32) < *nearest
                    {
                        (*nearest, *which) = (distance as f32, triangle);
                    }
                }
            }
        }
        let mut hits = Hits::default();
        for x in start..end {
            let first = hits.hits.len() as u32;
            for (d, nearest, triangle) in (0..n * n).map(|i| samples[place(x, i)]) {
                if nearest < f32::INFINITY
                    && let Some((_, [_, u, v])) = seen[triangle as usize].hit(d)
                {
                    hits.hits.push(Hit { triangle, barycentric: [u as f32, v as f32] });
                }
            }
            let last = hits.hits.len() as u32;
            if last > first {
                hits.pixels.push((y * self.width + x, first..last));
            }
        }
        hits
    }
}

/// What of a triangle is before the eye: the corners of a convex polygon in the image, in pixels.
#[derive(Clone, Copy)]
enum Outline {
    /// The first so many of these.
    Corners([[f64; 2]; 4], usize),
    /// It may cover every sample.
    Everything,
}

impl Outline {
    /// Where none of it can be seen.
    const NOTHING: Self = Self::Corners([[0.0; 2]; 4], 0);
}

/// What is clipped from triangles that reach behind the eye.
struct Clip<'a> {
    camera: &'a Camera,
    /// Where each vertex of the mesh stands in the image, and how deep.
    corners: Vec<(f64, f64, f64)>,
    /// The largest coordinate of the eye.
    eye: f64,
    /// The least depth that is left, as a share of the largest coordinate.
    near: f64,
    /// The length of the longest direction, which goes one unit deep.
    longest: f64,
}

impl<'a> Clip<'a> {
    fn new(mesh: &PosedMesh, camera: &'a Camera, camera_rays: &CameraRays, n: u32) -> Self {
        let corners = mesh.positions.par_iter().map(|position| camera.project(position.as_dvec3())).collect();
        let [width, height] = [camera.width, camera.height].map(f64::from);
        let ends = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
        let longest = ends.iter().map(|[x, y]| camera_rays.direction(*x, *y).length()).fold(0.0, f64::max);
        let focal = height / (2.0 * (0.5 * camera.fov_y).tan()) * camera.lens.ratio.max(1.0);
        let near = NEAR[0].max(NEAR[1] * f64::from(n) * focal);
        Self { camera, corners, eye: camera_rays.eye.abs().max_element(), near, longest }
    }

    /// What is left of a triangle.
    fn outline(&self, mesh: &PosedMesh, index: u32, seen: &Seen) -> Outline {
        let triangle = mesh.triangles[index as usize].map(|corner| corner as usize);
        let of = triangle.map(|corner| self.corners[corner]);
        let largest = |corner: usize| f64::from(mesh.positions[corner].abs().max_element());
        let near = self.near * triangle.into_iter().map(largest).fold(self.eye, f64::max);
        if of.iter().all(|corner| corner.2 >= near) {
            let [a, b, c] = of.map(|(x, y, _)| [x, y]);
            return finite([a, b, c, c], 3);
        }
        // From behind the eye, and from within its plane, it covers nothing.
        let plane = seen.plane();
        if of.iter().all(|corner| corner.2 < -near) || plane == 0.0 {
            return Outline::NOTHING;
        }
        // A ray that meets it less deep than `near` meets it no further from the eye than this, nor is its plane.
        if plane <= near * self.longest {
            return Outline::Everything;
        }
        let places = triangle.map(|corner| mesh.positions[corner].as_dvec3());
        let (mut left, mut count) = ([[0.0; 2]; 4], 0);
        let mut keep = |place: DVec3| {
            let (x, y, _) = self.camera.project(place);
            left[count] = [x, y];
            count += 1;
        };
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (depth, other) = (of[i].2 - near, of[j].2 - near);
            if depth >= 0.0 {
                keep(places[i]);
            }
            if (depth >= 0.0) != (other >= 0.0) {
                keep(places[i].lerp(places[j], depth / (depth - other)));
            }
        }
        finite(left, count)
    }
}

/// These corners; everything, where one of them has no place.
fn finite(corners: [[f64; 2]; 4], count: usize) -> Outline {
    let placed = corners[..count].iter().flatten().all(|x| x.is_finite());
    if placed { Outline::Corners(corners, count) } else { Outline::Everything }
}

impl Grid {
    /// The strata from one place to another of an axis, in pixels. A sample stands in the middle of its stratum, so that half
    /// of that is what places may be wrong by.
    fn strata(self, [low, high]: [f64; 2], count: u32) -> Range<u32> {
        let clamp = |value: f64| value.clamp(0.0, f64::from(count)) as u32;
        let n = f64::from(self.n);
        clamp((n * low).floor())..clamp((n * high).floor() + 1.0)
    }

    /// The rows of samples that an outline reaches; none where it is beside the image.
    fn rows_of(self, outline: &Outline) -> Range<u32> {
        let Outline::Corners(corners, count) = outline else { return 0..self.rows };
        let along = |axis: usize| bounds(corners[..*count].iter().map(|corner| corner[axis]));
        if *count == 0 || self.strata(along(0), self.columns).is_empty() {
            return 0..0;
        }
        self.strata(along(1), self.rows)
    }

    /// Those rows of which it reaches samples, with their columns.
    fn spans_of(self, outline: &Outline) -> impl Iterator<Item = (u32, Range<u32>)> {
        let spans = self.rows_of(outline).map(move |row| (row, self.columns_of(outline, row)));
        spans.filter(|(_, columns)| !columns.is_empty())
    }

    /// Whether a hierarchy would take longer than to try these, and they take little memory.
    fn affords(self, outlines: &[(u32, Outline)]) -> bool {
        let samples = u64::from(self.columns) * u64::from(self.rows);
        let most = [MOST_TRIES * samples, SOME_SPANS.max(MOST_SPANS * samples)];
        let [tries, spans] = [AtomicU64::new(0), AtomicU64::new(0)];
        let beyond = || tries.load(Ordering::Relaxed) > most[0] || spans.load(Ordering::Relaxed) > most[1];
        outlines.par_iter().for_each(|(_, outline)| {
            // Sums only grow: whoever counts first, they are beyond in the end or not.
            if beyond() {
                return;
            }
            let (rows, strata) = match outline {
                Outline::Everything => (u64::from(self.rows), samples),
                Outline::Corners(..) => self
                    .spans_of(outline)
                    .fold((0, 0), |(rows, strata), (_, columns)| (rows + 1, strata + columns.len() as u64)),
            };
            spans.fetch_add(rows, Ordering::Relaxed);
            tries.fetch_add(strata, Ordering::Relaxed);
        });
        !beyond()
    }

    /// The columns of samples that it reaches in one of these rows.
    fn columns_of(self, outline: &Outline, row: u32) -> Range<u32> {
        let Outline::Corners(corners, count) = outline else { return 0..self.columns };
        let corners = &corners[..*count];
        let [top, bottom] = [row, row + 1].map(|row| f64::from(row) / f64::from(self.n));
        let inside = |y: f64| (top..=bottom).contains(&y);
        let mut across = [f64::INFINITY, f64::NEG_INFINITY];
        let mut reach = |x: f64| across = [across[0].min(x), across[1].max(x)];
        for (i, &[x, y]) in corners.iter().enumerate() {
            let [other_x, other_y] = corners[(i + 1) % corners.len()];
            if inside(y) {
                reach(x);
            }
            for line in [top, bottom] {
                if (y < line) != (other_y < line) {
                    reach(x + (other_x - x) * ((line - y) / (other_y - y)).clamp(0.0, 1.0));
                }
            }
        }
        if across[0] > across[1] { 0..0 } else { self.strata(across, self.columns) }
    }
}

/// The least and the greatest.
fn bounds(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

#[cfg(test)]
mod tests {
    use super::super::trace::{trace, trace_by_hierarchy};
    use super::*;
    use crate::bake::low_discrepancy::mix;
    use glam::{DMat4, EulerRot, Vec3};

    /// Triangles of all sizes around a place.
    fn soup(seed: u32, count: usize, spread: f32) -> PosedMesh {
        let mut mesh = PosedMesh::default();
        let mut drawn = seed;
        let mut within_one = || {
            drawn = mix(drawn);
            2.0 * (drawn as f32 / u32::MAX as f32) - 1.0
        };
        for i in 0..count as u32 {
            let mut vector = |size: f32| Vec3::from([0; 3].map(|_| size * within_one()));
            let (middle, size) = (vector(spread), vector(1.0).x.powi(4) * spread);
            mesh.positions.extend([0; 3].map(|_| middle + vector(size)));
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        mesh
    }

    /// A turned camera, off the origin, whose pixels are no squares and whose middle is elsewhere.
    fn camera(away: f64, turn: f64) -> Camera {
        let place = DMat4::from_translation(DVec3::new(0.013, -0.021, -away));
        let turned = DMat4::from_euler(EulerRot::XYZ, 0.3 * turn, turn, 0.7 * turn);
        let mut camera = Camera::pinhole(place * turned, 1.2, [37, 23]);
        (camera.lens.centre, camera.lens.ratio) = ([4.5, -3.25], 1.1);
        camera
    }

    #[test]
    fn triangles_find_what_rays_find() {
        let mut found = 0;
        for (count, spread, away) in [
            (1, 1.0, 3.0),
            (400, 1.0, 3.0),
            (400, 1.0, 0.0),
            (60, 0.1, 0.05),
            (400, 5.0, 1.0),
            (3000, 1.0, 9.0),
        ] {
            let mesh = soup(7 + count as u32, count, spread);
            let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
            for (n, turn) in [(1, 0.0), (3, 0.4), (2, -2.0)] {
                let camera = camera(away, turn);
                let camera_rays = CameraRays::new(&camera);
                let seen: Vec<Seen> =
                    mesh.triangles.iter().map(|&t| Seen::new(&mesh, t, camera_rays.eye)).collect();
                assert!(Raster::new(&rays, &mesh, (&camera, &camera_rays), n, &seen).is_some());
                let [by_triangles, by_rays] =
                    [trace, trace_by_hierarchy].map(|trace| trace(&rays, &mesh, &camera, n));
                assert!(by_triangles.hits == by_rays.hits, "{count} {away} {n}");
                assert!(by_triangles.pixels == by_rays.pixels, "{count} {away} {n}");
                found += by_rays.hits.len();
            }
        }
        assert!(found > 10_000, "{found}");
    }

    #[test]
    fn many_layers_are_left_to_a_hierarchy_and_of_equal_ones_the_first_is_seen() {
        let layers = |count: u32, step: f32| {
            let mut mesh = PosedMesh::default();
            for i in 0..count {
                let z = -step * i as f32;
                mesh.positions.extend([[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]].map(Vec3::from));
                mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
            }
            mesh
        };
        let camera = camera(3.0, 0.0);
        let camera_rays = CameraRays::new(&camera);
        for (count, step) in [(500, 0.01), (3, 0.0), (0, 0.0)] {
            let mesh = layers(count, step);
            let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
            let seen: Vec<Seen> =
                mesh.triangles.iter().map(|&t| Seen::new(&mesh, t, camera_rays.eye)).collect();
            let raster = Raster::new(&rays, &mesh, (&camera, &camera_rays), 1, &seen);
            assert_eq!(raster.is_none(), count > MOST_TRIES as u32, "{count}");
            let hits = trace(&rays, &mesh, &camera, 1);
            assert_eq!(hits.hits.is_empty(), count == 0);
            assert!(hits.hits.iter().all(|hit| hit.triangle == 0), "{count}");
        }
    }

    #[test]
    fn a_mesh_is_seen_from_one_of_its_vertices_and_from_within_planes_of_it() {
        let mut mesh = soup(5, 50, 1.0);
        // The eye stands on a number of f32, so that a vertex can be there.
        let eye = Vec3::new(0.25, -0.5, 2.0);
        let camera = Camera::pinhole(DMat4::from_translation(-eye.as_dvec3()), 1.2, [37, 23]);
        for [b, c] in [[Vec3::new(0.5, 0.25, -1.0), Vec3::new(-0.5, 0.25, -1.0)], [Vec3::X, Vec3::Y]] {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([eye, eye + b, eye + c]);
            mesh.triangles.push([first, first + 1, first + 2]);
            // It goes through the eye's place, and on behind it.
            mesh.positions.extend([eye - b, eye + b, eye + c]);
            mesh.triangles.push([first + 3, first + 4, first + 5]);
        }
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        let [by_triangles, by_rays] =
            [trace, trace_by_hierarchy].map(|trace| trace(&rays, &mesh, &camera, 2));
        assert!(by_triangles.hits == by_rays.hits && by_rays.hits.len() > 100, "{}", by_rays.hits.len());
    }

    /// How many of a camera's rays hit a triangle of the mesh, each tried with all.
    fn rays_that_hit(mesh: &PosedMesh, camera: &Camera, n: u32) -> usize {
        let rays = CameraRays::new(camera);
        let seen: Vec<Seen> = mesh.triangles.iter().map(|&t| Seen::new(mesh, t, rays.eye)).collect();
        let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| [x, y]));
        let directions = pixels.flat_map(|at| rays.of_pixel(at, n)).map(DVec3::normalize);
        directions.filter(|d| seen.iter().any(|seen| seen.hit(*d).is_some())).count()
    }

    #[test]
    fn what_goes_on_behind_the_eye_is_seen_through_the_longest_lens() {
        let mut met = 0;
        for k in 0..60 {
            let (length, turn) = ([1.0, 30.0, 1000.0][k % 3], 0.1 * k as f32);
            let beside = |turn: f32, z: f32| Vec3::new(1.7 * turn.cos(), 1.7 * turn.sin(), z);
            // Two edges go from the middle of the image past the eye.
            let mut mesh = PosedMesh::default();
            mesh.positions.extend([
                Vec3::new(0.0, 0.0, -length),
                beside(turn, length),
                beside(turn + 1.0, 0.5 * length),
            ]);
            mesh.triangles.push([0, 1, 2]);
            let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
            let camera = Camera::pinhole(DMat4::IDENTITY, 1e-3_f64.to_radians(), [60, 80]);
            let wanted = rays_that_hit(&mesh, &camera, 4);
            assert_eq!(trace(&rays, &mesh, &camera, 4).hits.len(), wanted, "{k}");
            met += wanted;
        }
        assert!(met > 10_000, "{met}");
    }

    #[test]
    fn a_wall_that_the_eye_touches_is_seen_beside_it() {
        // It goes through the eye's plane, a millionth beside the eye, and on behind it.
        let mut mesh = PosedMesh::default();
        mesh.positions.extend([
            Vec3::new(1e-6, -9.0, 9.0),
            Vec3::new(1e-6, -9.0, -9.0),
            Vec3::new(1e-6, 9.0, 0.0),
        ]);
        mesh.triangles.push([0, 1, 2]);
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        for side in [1e-6, -1e-3, 1e-3, 0.0] {
            let world_to_camera = DMat4::from_translation(DVec3::new(side, 0.0, 0.0));
            let camera = Camera::pinhole(world_to_camera, 1.2, [16, 12]);
            let met = rays_that_hit(&mesh, &camera, 2);
            // Thinner than a hierarchy's boxes are exact, it is not looked for there.
            assert_eq!(trace(&rays, &mesh, &camera, 2).hits.len(), met, "{side}");
            assert!(met > 100, "{side}: {met}");
        }
    }
}

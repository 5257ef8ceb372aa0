//! How much of a map a sample covers, and the map's mean there.
//!
//! A sample stands for a cell of the image, as wide as samples lie apart. How far its texture coordinates go from one
//! sample to the next follows from the ray through it: ray differentials (Igehy 1999), here of a ray from the eye, whose
//! three weights in a triangle are quotients of dot products ([`Seen`](super::trace)).

use glam::{DVec3, Vec2};

use super::trace::{CameraRays, Hit};
use crate::scene::maps::{Map, Maps};
use crate::scene::mesh::PosedMesh;
use crate::scene::mip_maps::MipMaps;
use crate::scene::view::Camera;

/// How far texture coordinates go from a sample to its neighbours: one on the right, one below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Footprint {
    pub(super) right: Vec2,
    pub(super) below: Vec2,
}

/// Of more repeats of a map than that nothing but its mean is left.
const MOST_REPEATS: f64 = 65536.0;

impl Footprint {
    /// Bounded, and 0 where nothing is known.
    pub(super) fn new(right: [f64; 2], below: [f64; 2]) -> Self {
        let bounded = |x: f64| if x.is_nan() { 0.0 } else { x.clamp(-MOST_REPEATS, MOST_REPEATS) as f32 };
        let vector = |[u, v]: [f64; 2]| Vec2::new(bounded(u), bounded(v));
        Self { right: vector(right), below: vector(below) }
    }
}

/// The footprints of a camera's samples on a mesh.
pub(super) struct Footprints<'a> {
    mesh: &'a PosedMesh,
    rays: CameraRays,
    /// The samples along a pixel's side.
    axis: f64,
}

impl<'a> Footprints<'a> {
    /// Of `axis` samples along a pixel's side.
    pub(super) fn new(mesh: &'a PosedMesh, camera: &Camera, axis: u32) -> Self {
        Self { mesh, rays: CameraRays::new(camera), axis: f64::from(axis) }
    }

    /// Of the sample at `hit`.
    ///
    /// With corners p_i relative to the eye, a ray d has the weights w_i = e_i.d / sum(e_j.d), e_1 = p_2 x p_3 and so
    /// on. So they move by (e_i.s - w_i sum(e_j.s)) / sum(e_j.d) along a step s of the ray; and d being the hit's
    /// place over its depth, sum(e_j.d) is p_1.(p_2 x p_3) over that depth.
    pub(super) fn at(&self, hit: Hit) -> Footprint {
        let PosedMesh { positions, uvs, triangles, .. } = self.mesh;
        let vertices = triangles[hit.triangle as usize].map(|i| i as usize);
        let weights = hit.weights().map(f64::from);
        let [a, b, c] = vertices.map(|i| positions[i].as_dvec3() - self.rays.eye);
        let place = weights[0] * a + weights[1] * b + weights[2] * c;
        let pace = place.dot(self.rays.forward) / (a.dot(b.cross(c)) * self.axis);
        let edges = [b.cross(c), c.cross(a), a.cross(b)];
        let along = |step: DVec3| {
            let turned = edges.map(|edge| edge.dot(step));
            let sum: f64 = turned.iter().sum();
            let mut uv = [0.0; 2];
            for i in 0..3 {
                let moved = (turned[i] - weights[i] * sum) * pace;
                let corner = uvs.get(vertices[i]).copied().unwrap_or_default();
                uv[0] += moved * f64::from(corner.x);
                uv[1] += moved * f64::from(corner.y);
            }
            uv
        };
        let [right, down] = self.rays.steps(place);
        Footprint::new(along(right), along(down))
    }
}

/// A map filtered over `footprint` around texture coordinates: by the Vulkan specification's formulas (Vulkan 1.3, Image
/// Operations: "Scale Factor Operation", "LOD Operation", "Texel Anisotropic Filtering"), as `rules/lib/mip_texels.wgsl`
/// has them too. `pick` finds the map among its coarser levels. Finite for any footprint.
pub(super) fn filtered<const C: usize>(
    map: &Map<C>,
    mip_maps: &MipMaps,
    pick: impl Fn(&Maps) -> Option<&Map<C>>,
    uv: Vec2,
    footprint: &Footprint,
) -> [f32; C] {
    let Footprint { right, below } = *footprint;
    let size = Vec2::new(map.width as f32, map.height as f32);
    let [across, down] = [right, below].map(|step| (step * size).length());
    let longer = across.max(down);
    if longer <= 1.0 {
        return map.sample(uv.x, uv.y);
    }
    let along = if across > down { right } else { below };
    let most = f32::from(mip_maps.filter().most_taps());
    let share = across.min(down).max(longer / most);
    let taps = (longer / share).ceil().min(most);
    let coarsest = map.width.max(map.height).ilog2() as f32;
    let level = share.log2().clamp(0.0, coarsest);
    let fine = level.floor();
    let between = level - fine;
    let at = |level: usize| match level.checked_sub(1) {
        Some(coarser) => mip_maps.levels().get(coarser).and_then(&pick).unwrap_or(map),
        None => map,
    };
    let (finer, coarser) = (at(fine as usize), at((fine + 1.0).min(coarsest) as usize));
    let mut sum = [0.0; C];
    for tap in 1..=taps as u16 {
        let place = uv + (f32::from(tap) / (taps + 1.0) - 0.5) * along;
        let (a, b) = (finer.sample(place.x, place.y), coarser.sample(place.x, place.y));
        (0..C).for_each(|c| sum[c] += a[c] * (1.0 - between) + b[c] * between);
    }
    sum.map(|sum| sum / taps)
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, Vec3};

    use super::*;
    use crate::bake::rays::RayMesh;
    use crate::model::texture_filter::TextureFilter;
    use crate::samples::trace::trace;

    /// A slanted quad, whose texture coordinates are no map of its plane onto the map's, so that its triangles differ.
    fn slanted() -> PosedMesh {
        let positions = [[-2.0, -1.5, -1.0], [2.0, -1.5, 0.0], [2.0, 1.5, -2.5], [-2.0, 1.5, -3.0]];
        PosedMesh {
            positions: positions.map(Vec3::from).to_vec(),
            uvs: [[0.1, 0.9], [1.3, 0.8], [0.9, 0.1], [0.0, -0.4]].map(Vec2::from).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..PosedMesh::default()
        }
    }

    fn camera() -> Camera {
        let world_to_camera =
            DMat4::from_rotation_y(0.2) * DMat4::from_translation(DVec3::new(0.1, -0.2, -3.0));
        Camera::pinhole(world_to_camera, 0.6, [70, 60])
    }

    #[test]
    fn footprints_are_the_differences_of_neighbouring_rays() {
        let (mesh, camera, axis) = (slanted(), camera(), 3);
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        let hits = trace(&rays, &mesh, &camera, axis);
        let footprints = Footprints::new(&mesh, &camera, axis);
        let mut compared = 0;
        for (_, range) in hits.pixels.iter().filter(|(_, range)| range.len() == 9) {
            let pixel = &hits.hits[range.start as usize..range.end as usize];
            // The middle sample, and those around it.
            let [middle, left, right, above, below] = [4, 3, 5, 1, 7].map(|i: usize| pixel[i]);
            if [left, right, above, below].iter().any(|hit| hit.triangle != middle.triangle) {
                continue;
            }
            let half = |a: Hit, b: Hit| 0.5 * (b.uv(&mesh) - a.uv(&mesh));
            let want = Footprint { right: half(left, right), below: half(above, below) };
            let got = footprints.at(middle);
            let longest = want.right.length().max(want.below.length());
            // Steps are 1/180 of the image: central differences are off by the square of that, and coordinates'
            // roundings of 1e-7 are a share of 5e-5 of steps of 3e-3.
            let off = (got.right - want.right).length().max((got.below - want.below).length());
            assert!(off < 2e-4 * longest, "{got:?} {want:?}");
            compared += 1;
        }
        assert!(compared > 1000, "{compared}");
    }

    #[test]
    fn footprints_are_finite_whatever_the_triangle() {
        let at = |mesh: &PosedMesh, triangle| {
            Footprints::new(mesh, &camera(), 1).at(Hit { triangle, barycentric: [0.25, 0.25] })
        };
        let finite = |Footprint { right, below }: Footprint| right.is_finite() && below.is_finite();
        let eye = camera().eye().as_vec3();
        // A point, a line, one through the eye, one that is seen from its edge, and one behind the eye.
        let forward = CameraRays::new(&camera()).forward.as_vec3();
        let mut mesh = slanted();
        mesh.positions.extend([
            eye,
            eye + forward,
            eye + 2.0 * forward,
            eye + 2.0 * forward + Vec3::X,
            eye - forward,
        ]);
        mesh.uvs.extend([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [5e7, -5e7]].map(Vec2::from));
        mesh.triangles.extend([[0, 0, 0], [0, 0, 1], [4, 5, 7], [5, 6, 7], [5, 6, 6], [8, 1, 2]]);
        for triangle in 0..mesh.triangles.len() as u32 {
            assert!(finite(at(&mesh, triangle)), "{triangle}: {:?}", at(&mesh, triangle));
        }
        // Without texture coordinates all is at one place.
        mesh.uvs.clear();
        assert_eq!(at(&mesh, 0), Footprint { right: Vec2::ZERO, below: Vec2::ZERO });
        let unbounded = Footprint::new([f64::INFINITY, f64::NAN], [-1e300, 0.0]);
        assert_eq!(unbounded.right, Vec2::new(65536.0, 0.0));
        assert_eq!(unbounded.below, Vec2::new(-65536.0, 0.0));
    }

    /// A map of `size` texels a side; each by its column and row.
    fn map(size: usize, texel: impl Fn(usize, usize) -> f32) -> Maps {
        let texels = (0..size * size).map(|i| [texel(i % size, i / size)]).collect();
        Maps { specular: Some(Map { width: size, height: size, texels }), ..Maps::default() }
    }

    /// A map of 64 texels a side over a footprint in texels.
    fn read(maps: &Maps, filter: TextureFilter, uv: [f32; 2], [right, below]: [[f64; 2]; 2]) -> f32 {
        let mip_maps = MipMaps::new(maps, filter).unwrap();
        let texels = |[u, v]: [f64; 2]| [u / 64.0, v / 64.0];
        let footprint = Footprint::new(texels(right), texels(below));
        let specular = maps.specular.as_ref().unwrap();
        filtered(specular, &mip_maps, |maps| maps.specular.as_ref(), uv.into(), &footprint)[0]
    }

    const BOTH: [TextureFilter; 2] = [TextureFilter::Trilinear, TextureFilter::Anisotropic];

    #[test]
    fn levels_are_those_of_the_footprints_length() {
        let maps = map(64, |x, y| ((x * 31 + y * 17) % 23) as f32 / 23.0);
        let levels = MipMaps::new(&maps, TextureFilter::Trilinear).unwrap();
        let uv = [0.37, 0.81];
        for filter in BOTH {
            for level in 0..=6 {
                let of = |level: usize| {
                    let level = level.checked_sub(1).map_or(&maps, |i| &levels.levels()[i]);
                    level.specular.as_ref().unwrap().sample(uv[0], uv[1])[0]
                };
                // 2^level texels in both directions, turned or not, are that level's own.
                let side = f64::from(1 << level);
                let square = [[side, 0.0], [0.0, side]];
                assert_eq!(read(&maps, filter, uv, square), of(level));
                assert_eq!(read(&maps, filter, uv, [[0.0, -side], [side, 0.0]]), of(level));
                // Half way in the exponent is half way between levels; roundings of a blend.
                if level < 6 {
                    let between = side * std::f64::consts::SQRT_2;
                    let got = read(&maps, filter, uv, [[between, 0.0], [0.0, between]]);
                    assert!((got - 0.5 * (of(level) + of(level + 1))).abs() < 1e-6, "{got}");
                }
            }
            // No smaller texel is there, and no larger one.
            let finest = maps.specular.as_ref().unwrap().sample(uv[0], uv[1])[0];
            assert_eq!(read(&maps, filter, uv, [[0.0; 2]; 2]), finest);
            assert_eq!(read(&maps, filter, uv, [[0.3, 0.0], [0.0, 0.9]]), finest);
            let mean = levels.levels()[5].specular.as_ref().unwrap().texels[0][0];
            for huge in [1e5, 1e30, f64::INFINITY] {
                let got = read(&maps, filter, uv, [[huge, huge], [-huge, huge]]);
                // Sums of up to sixteen equal numbers.
                assert!((got - mean).abs() < 1e-6, "{got} {mean}");
            }
        }
    }

    #[test]
    fn along_a_grazing_footprint_stripes_stay_apart() {
        // Stripes of two texels across the footprint, which is 24 texels long and one wide.
        let maps = map(64, |_, y| ((y / 2) % 2) as f32);
        let grazing = [[24.0, 0.0], [0.0, 1.0]];
        let on_stripe = [0.4, 3.0 / 64.0];
        let isotropic = read(&maps, TextureFilter::Trilinear, on_stripe, grazing);
        // Levels above the second hold nothing but the mean.
        assert!((isotropic - 0.5).abs() < 1e-6, "{isotropic}");
        // Sixteen places of 1.5 texels each: between the finest level, where this is 1, and the next, where it is the
        // mean of half a stripe and its neighbour.
        let anisotropic = read(&maps, TextureFilter::Anisotropic, on_stripe, grazing);
        assert!(anisotropic > 0.8, "{anisotropic}");
        // What varies along it is averaged.
        let along = map(64, |x, _| ((x / 2) % 2) as f32);
        let mean = read(&along, TextureFilter::Anisotropic, on_stripe, grazing);
        assert!((mean - 0.5).abs() < 0.05, "{mean}");
        // And a constant is that constant, to roundings of its sum.
        let grey = read(&map(64, |_, _| 0.3), TextureFilter::Anisotropic, on_stripe, grazing);
        assert!((grey - 0.3).abs() < 1e-6, "{grey}");
    }
}

//! Light that the mesh throws back, as transfer vectors (MODEL 10, `gathered`).
//!
//! A ray that meets the mesh brings the albedo there times the light there: T'_lm = sum over such rays of their share
//! times albedo times T_lm of the place, in two rounds: K (T + K T), K the gather over all vertices.

use glam::Vec3A;
use rayon::prelude::*;

use super::cache::Key;
use super::vertex_rays::{Found, Rays, VertexRays};
use super::wide_bvh::{NOTHING, WideBvh};
use crate::progress;
use crate::scene::maps::Map;
use crate::scene::mesh::PosedMesh;
use crate::scene::plain::{PlainMap, PlainParts};

/// What share of light the surface throws back.
#[derive(Clone, Copy, Debug)]
pub struct Albedo<'a> {
    /// The skin's colour map, linear; without one all skin is white. What is not skin has its own material.
    pub map: Option<&'a Map<3>>,
}

/// The nearest triangle along a ray, by its index in the mesh, or [`NOTHING`].
pub(super) type Nearest = u32;

impl Found for Nearest {
    fn along(mesh: &WideBvh, rays: &Rays) -> Vec<Self> {
        mesh.first(rays.origin, &rays.directions)
    }
}

/// What a vertex gathers: of which vertices (by slot) what share of their light, rgb.
pub(super) struct Gather {
    pub(super) shares: Vec<(u32, [f32; 3])>,
    /// The share of its rays that met a lit side of the mesh.
    pub(super) met: f32,
}

impl Gather {
    /// By the triangles that its rays found. Those that are met from behind bring nothing: no light is known there.
    pub(super) fn of(
        vertices: &VertexRays,
        pose: &PosedMesh,
        rays: &Rays,
        found: &[Nearest],
        albedo: &Albedo<'_>,
    ) -> Self {
        let share = 1.0 / found.len().max(1) as f32;
        let (mut gathered, mut met): (Vec<(u32, [f32; 3])>, u32) = (Vec::new(), 0);
        for (&d, &triangle) in rays.directions.iter().zip(found).filter(|(_, found)| **found != NOTHING) {
            let Some(Met { corners, weights, albedo }) = albedo.met(pose, triangle, rays.origin, d) else {
                continue;
            };
            met += 1;
            for (corner, weight) in corners.into_iter().zip(weights) {
                gathered.push((vertices.slot(corner), albedo.map(|albedo| albedo * weight * share)));
            }
        }
        // Stable, so that sums have one order.
        gathered.sort_by_key(|&(slot, _)| slot);
        gathered.dedup_by(|next, sum| {
            let same = next.0 == sum.0;
            if same {
                (0..3).for_each(|c| sum.1[c] += next.1[c]);
            }
            same
        });
        gathered.shrink_to_fit();
        Self { shares: gathered, met: met as f32 * share }
    }

    /// Two rounds of every vertex' gather, from `direct` of `width` numbers a slot. All cores.
    pub(super) fn twice(gathers: &[Self], direct: &[f32], width: usize) -> Vec<[f32; 3]> {
        let source: Vec<f32> =
            direct.chunks_exact(width).flat_map(|t| [t, t, t]).flatten().copied().collect();
        let first = Self::once(gathers, &source, width);
        let both: Vec<f32> = source.iter().zip(&first).map(|(source, first)| source + first).collect();
        let bounced = Self::once(gathers, &both, width);
        let rgb = |planes: &[f32]| -> Vec<[f32; 3]> {
            (0..width).map(|i| [0, 1, 2].map(|c| planes[c * width + i])).collect()
        };
        bounced.chunks_exact(3 * width).flat_map(rgb).collect()
    }

    /// One round: a slot's numbers are those of red, of green, of blue.
    fn once(gathers: &[Self], source: &[f32], width: usize) -> Vec<f32> {
        let mut sums = vec![0.0; gathers.len() * 3 * width];
        sums.par_chunks_exact_mut(3 * width).zip(gathers).for_each(|(sum, gather)| {
            for &(slot, share) in &gather.shares {
                let source = &source[slot as usize * 3 * width..][..3 * width];
                for ((sum, source), share) in
                    sum.chunks_exact_mut(width).zip(source.chunks_exact(width)).zip(share)
                {
                    sum.iter_mut().zip(source).for_each(|(sum, source)| *sum += share * source);
                }
            }
        });
        sums
    }
}

/// What each vertex of a mesh gathers of the others' light, whatever that is.
pub struct VertexGather {
    pub(super) vertices: VertexRays,
    pub(super) gathers: Vec<Gather>,
}

impl std::fmt::Debug for VertexGather {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VertexGather").field("vertices", &self.gathers.len()).finish_non_exhaustive()
    }
}

impl VertexGather {
    /// Of a mesh as it is posed, by `rays` rays a vertex. All cores.
    #[must_use]
    pub fn new(mesh: &PosedMesh, rays: u32, albedo: &Albedo<'_>) -> Self {
        let vertices = VertexRays::new(&|_| mesh.clone(), 0, rays);
        let bar = progress::bar("bounces", vertices.len() as u64);
        let gathers = vertices.at_rest(|_, rays, found: Vec<Nearest>| {
            bar.inc(1);
            Gather::of(&vertices, mesh, rays, &found, albedo)
        });
        bar.finish_and_clear();
        Self { vertices, gathers }
    }

    /// What is thrown back to each vertex of the light that `direct` has at each, in two rounds, rgb.
    #[must_use]
    pub fn bounced(&self, direct: impl Fn(usize) -> [f32; 3] + Sync) -> Vec<[f32; 3]> {
        self.of_vertices(&Gather::once(&self.gathers, &self.lit_once(direct), 1))
    }

    /// The share of each vertex' hemisphere, weighted by the cosine, in which it sees the mesh from outside.
    #[must_use]
    pub fn met(&self) -> Vec<f32> {
        let met: Vec<[f32; 3]> = self.gathers.iter().map(|gather| [gather.met; 3]).collect();
        self.vertices.spread(&met, 1).into_iter().map(|[met, ..]| met).collect()
    }

    /// The light that `direct` has at each vertex, and what is thrown back to it in one round, rgb.
    #[must_use]
    pub fn lit(&self, direct: impl Fn(usize) -> [f32; 3] + Sync) -> Vec<[f32; 3]> {
        self.of_vertices(&self.lit_once(direct))
    }

    /// Of each vertex that rays start from, red, green and blue.
    fn lit_once(&self, direct: impl Fn(usize) -> [f32; 3] + Sync) -> Vec<f32> {
        let slots = (0..self.vertices.len()).into_par_iter();
        let source: Vec<[f32; 3]> = slots.map(|i| direct(self.vertices.vertex(i))).collect();
        let source = source.into_flattened();
        let first = Gather::once(&self.gathers, &source, 1);
        source.iter().zip(&first).map(|(source, first)| source + first).collect()
    }

    fn of_vertices(&self, slots: &[f32]) -> Vec<[f32; 3]> {
        self.vertices.spread(slots.as_chunks::<3>().0, 1)
    }
}

/// Where a ray meets a mesh: a triangle's corners with how much each counts, and the albedo there.
pub(crate) struct Met {
    pub(crate) corners: [u32; 3],
    pub(crate) weights: [f32; 3],
    pub(crate) albedo: [f32; 3],
}

impl Albedo<'_> {
    /// Where the ray from `origin` along `d` meets a triangle of the mesh; `None` where that is from behind, or rounding
    /// leaves no area.
    pub(crate) fn met(&self, pose: &PosedMesh, triangle: u32, origin: Vec3A, d: Vec3A) -> Option<Met> {
        let corners = pose.triangles[triangle as usize];
        let weights = weights(origin, d, corners.map(|i| pose.positions[i as usize].into()))?;
        let normals = corners.map(|i| Vec3A::from(pose.normals[i as usize]));
        let faces_away = (0..3).map(|k| weights[k] * normals[k]).sum::<Vec3A>().dot(d) >= 0.0;
        (!faces_away).then(|| Met { corners, weights, albedo: self.at(pose, triangle, weights) })
    }

    /// At a place of a triangle, by its corners' weights.
    fn at(&self, pose: &PosedMesh, triangle: u32, weights: [f32; 3]) -> [f32; 3] {
        let corners = pose.triangles[triangle as usize];
        let corner = |k: usize| pose.uvs.get(corners[k] as usize).copied().unwrap_or_default();
        let uv = || (0..3).map(|k| weights[k] * corner(k)).sum::<glam::Vec2>();
        if let Some((plain, material)) = pose.plain.as_ref().and_then(|p| Some((p, p.material(triangle)?))) {
            let surface = material.at(uv(), plain.tint(triangle, weights));
            return surface.thrown_back().map(|share| share as f32);
        }
        match self.map {
            Some(map) if !map.texels.is_empty() && !pose.uvs.is_empty() => {
                let uv = uv();
                map.sample(uv.x, uv.y)
            }
            _ => [1.0; 3],
        }
    }

    /// A key with all that decides it.
    pub(super) fn key(&self, mut key: Key, pose: &PosedMesh) -> Key {
        key = key.with(&pose.uvs);
        if let Some(map) = self.map {
            key = key.with(&[map.width as u64, map.height as u64]).with(map.texels.as_flattened());
        }
        pose.plain.iter().fold(key, |key, plain| plain_key(key, plain))
    }
}

/// A key with what decides the shares of light that parts throw back which are not skin.
fn plain_key(key: Key, plain: &PlainParts) -> Key {
    let materials: Vec<u16> = plain.of_triangle.iter().map(|of| of.unwrap_or(u16::MAX)).collect();
    let colors = plain.corner_colors.as_flattened().as_flattened();
    plain.materials.iter().fold(key.with(&materials).with(colors), |key, material| {
        let key = key.with(&material.base_color).with(&[material.metallic]);
        [&material.color_map, &material.roughness_map].into_iter().fold(key, |key, picture| {
            let Some(PlainMap { map, wrap, nearest }) = picture else { return key.with(&[0_u64]) };
            let [u, v] = wrap.map(|wrap| wrap as u64);
            key.with(&[1, map.width as u64, map.height as u64, u, v, u64::from(*nearest)])
                .with(map.texels.as_flattened())
        })
    })
}

/// How much each corner counts where a ray meets a triangle; none where rounding leaves no area.
pub(super) fn weights(origin: Vec3A, d: Vec3A, corners: [Vec3A; 3]) -> Option<[f32; 3]> {
    let [a, b, c] = corners.map(|corner| corner - origin);
    let parts = [b.cross(c), c.cross(a), a.cross(b)].map(|edge| d.dot(edge));
    let whole = parts[0] + parts[1] + parts[2];
    let weights = parts.map(|part| (part / whole).clamp(0.0, 1.0));
    weights.iter().all(|weight| weight.is_finite()).then_some(weights)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::scene::plain::{Alpha, PlainMaterial, Wrap};

    /// White skin under a ceiling of a material that is not skin.
    fn below_ceiling(base_color: [f32; 4], metallic: f32) -> PosedMesh {
        let ceiling = PlainMaterial {
            name: "ceiling".to_owned(),
            base_color,
            color_map: None,
            metallic,
            roughness: 1.0,
            roughness_map: None,
            alpha: Alpha::Opaque,
            emission: [0.0; 3],
            emission_map: None,
        };
        let at = |y: f32| [Vec3::new(-1.0, y, -1.0), Vec3::new(1.0, y, -1.0), Vec3::new(0.0, y, 1.0)];
        let plain = PlainParts {
            of_triangle: vec![None, Some(0)],
            materials: vec![ceiling],
            corner_colors: Vec::new(),
        };
        PosedMesh {
            positions: [at(0.0), at(0.5)].concat(),
            normals: [[Vec3::Y; 3], [Vec3::NEG_Y; 3]].concat(),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            plain: Some(Arc::new(plain)),
            ..PosedMesh::default()
        }
    }

    fn bounced(mesh: &PosedMesh) -> [f32; 3] {
        VertexGather::new(mesh, 64, &Albedo { map: None }).bounced(|_| [1.0; 3])[0]
    }

    #[test]
    fn what_is_not_skin_throws_its_own_colour_back() {
        let white = bounced(&PosedMesh { plain: None, ..below_ceiling([0.0; 4], 0.0) });
        assert!(white[0] > 0.1, "{white:?}");
        assert_eq!(
            bounced(&below_ceiling([1.0; 4], 1.0)),
            white,
            "a white mirror throws back what white skin does"
        );
        // What the skin throws back to the ceiling is the same for all: what comes from there is the material's share.
        let shares = |mesh: &PosedMesh| {
            let found = bounced(mesh);
            [0, 1, 2].map(|c| found[c] / white[c])
        };
        let near = |found: [f32; 3], wanted: [f32; 3]| (0..3).all(|c| (found[c] - wanted[c]).abs() < 1e-5);
        // 4% of what is no metal is reflected, and of the rest its colour comes back (glTF 2.0, appendix B.2).
        let painted = shares(&below_ceiling([0.5, 0.25, 0.0, 1.0], 0.0));
        assert!(near(painted, [0.52, 0.28, 0.04]), "{painted:?}");
        let metal = shares(&below_ceiling([0.8, 0.4, 0.2, 1.0], 1.0));
        assert!(near(metal, [0.8, 0.4, 0.2]), "{metal:?}");
        // A picture and colours of corners are factors.
        let mut pictured = below_ceiling([0.8, 0.4, 0.2, 1.0], 1.0);
        let mut plain = PlainParts::clone(pictured.plain.as_ref().unwrap());
        let map = Map { width: 1, height: 1, texels: vec![[0.5, 1.0, 1.0, 1.0]] };
        let map = PlainMap { map: Arc::new(map), wrap: [Wrap::Repeat; 2], nearest: false };
        plain.materials[0].color_map = Some(map);
        plain.corner_colors = vec![[[1.0; 4]; 3], [[1.0, 0.5, 1.0, 1.0]; 3]];
        pictured.plain = Some(Arc::new(plain));
        assert!(near(shares(&pictured), [0.4, 0.2, 0.2]), "{:?}", shares(&pictured));
    }

    #[test]
    fn bakes_are_of_the_materials_that_throw_light_back() {
        let key = |mesh: &PosedMesh| Albedo { map: None }.key(Key::new("test"), mesh).hash();
        let one = below_ceiling([0.8, 0.4, 0.2, 1.0], 1.0);
        assert_eq!(key(&one), key(&one.clone()));
        assert_ne!(key(&one), key(&below_ceiling([0.8, 0.4, 0.1, 1.0], 1.0)));
        assert_ne!(key(&one), key(&below_ceiling([0.8, 0.4, 0.2, 1.0], 0.5)));
        assert_ne!(key(&one), key(&PosedMesh { plain: None, ..one.clone() }));
    }
}

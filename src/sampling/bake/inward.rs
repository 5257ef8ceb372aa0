//! What light that leaves the mesh somewhere brings to its vertices from inside: rays inward, cosine-distributed about -N, each
//! of which comes out where another side of the mesh is lit (MODEL 11, gathered).
//!
//! A ray that meets a side which faces it comes from no inside and brings nothing, as does one that leaves by a hole. Cards of
//! hair and lashes do not count: their roots lie below the skin.

use glam::Vec3A;
use rayon::prelude::*;

use super::interreflection::{Nearest, weights};
use super::thickness::distance;
use super::vertex_rays::{Rays, VertexRays};
use super::wide_bvh::NOTHING;
use crate::model::transmission::{Method, NODES, shares};
use crate::progress;
use crate::scene::Scene;
use crate::scene::mesh::PosedMesh;
use crate::shader::term::library;

/// The field of light that is gathered inside the mesh, of a light behind its name; those of its nodes begin so.
pub const FAR_LIGHT: &str = "far_light";

/// Whether a scene's light that comes through thin parts is gathered inside the mesh.
#[must_use]
pub fn gathers_inside(scene: &Scene) -> bool {
    library::transmits(scene.effects) && scene.choices.transmission.method == Method::Gathered
}

/// Of which field, that a rasteriser takes, a field of a node's light is a summand.
#[must_use]
pub fn sum_of_nodes(field: &str) -> Option<&str> {
    let (sum, node) = field.rsplit_once('_')?;
    (sum.ends_with(FAR_LIGHT) && node.bytes().all(|digit| digit.is_ascii_digit())).then_some(sum)
}

/// Where a ray leaves the mesh.
struct Exit {
    triangle: u32,
    /// How much its second and third corner count.
    weights: [f32; 2],
    /// After how many millimetres.
    millimetres: f32,
}

/// Where rays from the vertices of a mesh leave it.
pub struct InwardRays {
    vertices: VertexRays,
    exits: Vec<Box<[Exit]>>,
    /// What a ray counts.
    share: f64,
}

/// What arrives from each of the [`NODES`], `C` numbers each.
pub(crate) type OfNodes<const C: usize> = [[f32; C]; NODES.len()];

impl std::fmt::Debug for InwardRays {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("InwardRays").field("vertices", &self.exits.len()).finish_non_exhaustive()
    }
}

impl InwardRays {
    /// Of a scene's mesh as it is posed, where light is gathered inside it: whoever makes samples of one pose again and again
    /// keeps it. All cores.
    #[must_use]
    pub fn of_scene(scene: &Scene, mesh: &PosedMesh) -> Option<Self> {
        let unit = 1e3 * scene.metres_per_unit;
        gathers_inside(scene).then(|| Self::new(mesh, scene.quality.occlusion_rays, unit))
    }

    /// Of a mesh as it is posed, by `rays` rays a vertex; `unit` millimetres are a unit of it. All cores.
    fn new(mesh: &PosedMesh, rays: u32, unit: f64) -> Self {
        let vertices = VertexRays::inward(&|_| mesh.clone().without_open(), 0, rays, 1.0);
        let bar = progress::bar("light inside", vertices.len() as u64);
        let exits = vertices.at_rest(|_, rays, found: Vec<Nearest>| {
            bar.inc(1);
            exits(&vertices.rest, rays, &found, unit)
        });
        bar.finish_and_clear();
        Self { vertices, exits, share: 1.0 / f64::from(rays.max(1)) }
    }

    /// What arrives at each vertex, told apart by distance, of the light that `direct` has at each. All cores.
    pub(crate) fn gathered<const C: usize>(
        &self,
        direct: impl Fn(usize) -> [f32; C] + Sync,
    ) -> Vec<OfNodes<C>> {
        let own = (0..self.vertices.len()).into_par_iter().map(|i| direct(self.vertices.vertex(i)));
        let light: Vec<[f32; C]> = own.collect();
        let of_vertex = |exits: &[Exit]| {
            let mut sum = [[0.0; C]; NODES.len()];
            for Exit { triangle, weights: [u, v], millimetres } in exits {
                let corners = self.vertices.rest.triangles[*triangle as usize];
                let corners = corners.map(|corner| &light[self.vertices.slot(corner) as usize]);
                let arriving: [f64; C] = std::array::from_fn(|c| {
                    let [first, second, third] = corners.map(|light| light[c]);
                    f64::from(first + (u * (second - first) + v * (third - first)))
                });
                let of_node = shares(f64::from(*millimetres));
                for (sum, of_node) in sum.iter_mut().zip(of_node).filter(|(_, share)| *share != 0.0) {
                    sum.iter_mut().zip(arriving).for_each(|(sum, light)| *sum += of_node * light);
                }
            }
            sum.map(|node| node.map(|sum| (self.share * sum) as f32))
        };
        let gathered: Vec<_> = self.exits.par_iter().map(|exits| of_vertex(exits)).collect();
        self.vertices.spread(&gathered, 1)
    }
}

fn exits(mesh: &PosedMesh, rays: &Rays, found: &[Nearest], unit: f64) -> Box<[Exit]> {
    let exit = |(&d, &triangle): (&Vec3A, &Nearest)| {
        let corners = mesh.triangles[triangle as usize];
        let [a, b, c] = corners.map(|i| Vec3A::from(mesh.positions[i as usize]));
        let [_, u, v] = weights(rays.origin, d, [a, b, c])?;
        // The triangle's own side, not that of its smooth normal: beside a vertex rays leave at once by the facets around it.
        let plane = (b - a).cross(c - a);
        let smooth: Vec3A = corners.iter().map(|&i| Vec3A::from(mesh.normals[i as usize])).sum();
        let leaves = plane.dot(d) * plane.dot(smooth) > 0.0;
        let along = distance(mesh, triangle, rays.origin.as_dvec3(), d.as_dvec3()).filter(|_| leaves)?;
        Some(Exit { triangle, weights: [u, v], millimetres: (along * unit) as f32 })
    };
    let met = rays.directions.iter().zip(found).filter(|(_, found)| **found != NOTHING);
    met.filter_map(exit).collect()
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;

    /// A sphere about the origin, of quads cut in two.
    fn ball(radius: f32) -> PosedMesh {
        let (rings, around) = (24_u32, 48_u32);
        let mut mesh = PosedMesh::default();
        for ring in 0..=rings {
            for side in 0..around {
                let polar = std::f32::consts::PI * ring as f32 / rings as f32;
                let azimuth = std::f32::consts::TAU * side as f32 / around as f32;
                let normal = vec3(polar.sin() * azimuth.sin(), polar.cos(), polar.sin() * azimuth.cos());
                mesh.positions.push(radius * normal);
                mesh.normals.push(normal);
            }
        }
        for ring in 0..rings {
            for side in 0..around {
                let [a, b] = [ring * around + side, ring * around + (side + 1) % around];
                let [c, d] = [a + around, b + around];
                mesh.triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        mesh
    }

    /// Through a ball a ray at an angle to the inward normal comes 2 R cos(angle) far: of a light that is the same everywhere
    /// exp(-d / l) is, weighted by the cosine, the integral of 2 x exp(-2 R x / l).
    #[test]
    fn through_a_ball_comes_what_the_integral_says() {
        let (radius, length) = (4.0_f64, 3.7);
        // Positions in metres.
        let rays = InwardRays::new(&ball(radius as f32 * 1e-3), 256, 1e3);
        let gathered = rays.gathered(|_| [1.0, 0.5]);
        let k = 2.0 * radius / length;
        let exact = 2.0 * (1.0 - (1.0 + k) * (-k).exp()) / (k * k);
        // Not at the poles, whose quads have no area.
        let vertex = 12 * 48 + 5;
        let sum = |c: usize| -> f64 {
            NODES.iter().zip(gathered[vertex]).map(|(d, node)| (-d / length).exp() * f64::from(node[c])).sum()
        };
        // 256 stratified rays, facets of seven degrees, and shares of a cubic.
        assert!((sum(0) - exact).abs() < 0.02 * exact, "{} {exact}", sum(0));
        assert!((sum(1) - 0.5 * sum(0)).abs() < 1e-6);
        // Rays from any place of a ball leave it evenly all over: what shines on a cap, half a ring beyond whose corners it ends,
        // comes everywhere as its share of the ball; from the other side it comes farther.
        let lit = rays.gathered(|vertex| [f32::from(u8::from(vertex / 48 < 12))]);
        let cap = 0.5 * (1.0 - (std::f32::consts::PI * 11.5 / 24.0).cos());
        for at in [4 * 48, 12 * 48 + 5, 20 * 48] {
            let all: f32 = lit[at].iter().flatten().sum();
            assert!((all - cap).abs() < 0.02, "{all} {cap}");
        }
        let far = |at: usize| -> f32 { lit[at][8..].iter().flatten().sum() };
        assert!(far(20 * 48) > 2.0 * far(4 * 48));
    }

    #[test]
    fn sheets_without_an_inside_bring_nothing() {
        let mut mesh = PosedMesh::default();
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)] {
            mesh.positions.push(vec3(x, y, 0.0));
            mesh.normals.push(Vec3::Z);
        }
        mesh.triangles = vec![[0, 1, 2]];
        let none = |mesh: &PosedMesh| {
            let gathered = InwardRays::new(mesh, 16, 1.0).gathered(|_| [1.0]);
            gathered.as_flattened().as_flattened().iter().all(|x| *x == 0.0)
        };
        assert!(none(&mesh));
        // Another below that faces upwards, too.
        for k in 0..3 {
            mesh.positions.push(mesh.positions[k] - Vec3::Z);
            mesh.normals.push(Vec3::Z);
        }
        mesh.triangles.push([3, 4, 5]);
        assert!(none(&mesh) && none(&PosedMesh::default()));
        // A vertex without a normal has no inside.
        mesh.normals.fill(Vec3::ZERO);
        assert!(none(&mesh));
    }
}

//! What each vertex sees of the sky, as fields of samples: found at the vertices, and interpolated between them (MODEL
//! 10).

use glam::Vec3;
use rayon::prelude::*;

use super::SampleError;
use super::lit_mesh::LitMesh;
use super::sky_rays::ByRays;
use super::supply::{Supplies, Supply};
use super::trace::Hit;
use super::visibility::Shadows;
use crate::bake::coefficients::Coefficients;
use crate::bake::harmonics::{CONSTANT, Order, basis, open_transfer_at};
use crate::bake::interreflection::{Albedo, VertexGather};
use crate::bake::panorama::Radiance;
use crate::bake::rays::RayMesh;
use crate::bake::shadowed::{
    Ratio, Turning, arriving, shadow_ratio, share_of_open, thrown_ratio, thrown_share,
};
use crate::bake::sky::{BENT_NORMAL, SKY_RATIO, SKY_TURNS};
use crate::bake::transfer::TransferSet;
use crate::bake::{SkyBake, SkyLight};
use crate::model::choices::{Bounces, Visibility};
use crate::model::fields::Fields;
use crate::model::params::Param;
use crate::scene::Scene;
use crate::scene::maps::Environment;
use crate::scene::mesh::{Morph, PosedMesh};

/// Numbers of each vertex, interpolated over a triangle.
pub(super) struct OfVertices<'a> {
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) numbers: Vec<[f32; 3]>,
}

impl Supply for OfVertices<'_> {
    fn find(&self, hit: Hit, numbers: &mut [f32]) {
        let corners = self.triangles[hit.triangle as usize].map(|corner| self.numbers[corner as usize]);
        let weights = hit.weights();
        for (k, number) in numbers.iter_mut().enumerate() {
            // From the first corner on, so that what is the same at all three stays that.
            let [first, second, third] = corners.map(|corner| corner[k]);
            *number = first + (weights[1] * (second - first) + weights[2] * (third - first));
        }
    }
}

/// The transfer of a scene's mesh as it is posed, and its light as it is turned.
pub(super) struct Sky<'a> {
    mesh: &'a PosedMesh,
    order: Order,
    set: TransferSet,
    rest: Coefficients,
    whole: Coefficients,
    /// How far both are turned about +Y, radians.
    turn: f64,
}

/// What finds those of `fields` that are of the sky.
pub(super) fn supplies<'a>(
    scene: &'a Scene,
    rays: &'a RayMesh,
    sky: &Sky<'a>,
    (bake, gather): (&'a SkyBake, Option<&VertexGather>),
    fields: Fields,
) -> Supplies<'a> {
    let asked = |name| fields.named(name);
    let [ratio, bent] = [SKY_RATIO, BENT_NORMAL].map(asked);
    let of_vertices = |numbers: Vec<[f32; 3]>| -> Box<dyn Supply + 'a> {
        Box::new(OfVertices { triangles: &sky.mesh.triangles, numbers })
    };
    let mut supplies: Supplies<'a> = Vec::new();
    if let Some(field) = bent {
        supplies.push((field, of_vertices(sky.each(|vertex| sky.bent_normal(vertex).to_array()))));
    }
    let turns = SKY_TURNS.map(asked);
    let ratios: Vec<Ratio> = match turns {
        [None, None, None] => Vec::new(),
        _ => sky.each(|vertex| sky.turning(scene.choices.visibility, vertex)),
    };
    let (sin, cos) = sky.turn.sin_cos();
    // ratio' sin(r - r0) + ratio'' (1 - cos(r - r0)) by the cosine and the sine of r.
    for (field, [of_slope, of_curve]) in turns.into_iter().zip([[-sin, -cos], [cos, -sin], [0.0, 1.0]]) {
        let turning =
            |ratio: &Ratio| [0, 1, 2].map(|c| (of_slope * ratio.slope[c] + of_curve * ratio.curve[c]) as f32);
        supplies.extend(field.map(|field| (field, of_vertices(ratios.iter().map(turning).collect()))));
    }
    if let (Some(field), Some(light)) = (ratio, &bake.light) {
        let visibility = scene.choices.visibility;
        let by_rays = light.panorama.as_ref().map(|panorama| sky.by_rays(scene, rays, gather, panorama));
        supplies.push(match by_rays {
            Some(by_rays) => (field, Box::new(by_rays)),
            None => (field, of_vertices(sky.each(|vertex| sky.ratio(visibility, vertex)))),
        });
    }
    supplies
}

impl<'a> Sky<'a> {
    /// As a scene's mesh is posed; `morphs` are its targets at their weights.
    ///
    /// # Errors
    /// When the transfer is that of another mesh.
    pub(super) fn new(
        scene: &Scene,
        mesh: &'a PosedMesh,
        morphs: &[Morph],
        bake: &SkyBake,
    ) -> Result<Self, SampleError> {
        let order = bake.transfer.order;
        let weights: Vec<f32> = morphs.iter().map(|morph| morph.weight).collect();
        let set = bake.transfer.posed(&weights);
        let (found, vertices) = (set.direct.len() / order.functions(), mesh.positions.len());
        if found != vertices {
            return Err(SampleError::TransferLength {
                scene: scene.path.display().to_string(),
                found,
                vertices,
            });
        }
        let turn = scene.params.scalar(Param::EnvironmentRotation).to_radians();
        let dark = || Coefficients::new(Order::MOST, Vec::new());
        let light = |of: fn(&SkyLight) -> &Coefficients| {
            bake.light.as_ref().map_or_else(dark, |l| of(l).turned(turn))
        };
        Ok(Self {
            mesh,
            order,
            set,
            rest: light(|light| &light.rest),
            whole: light(|light| &light.whole),
            turn,
        })
    }

    /// What `of` finds at each vertex. All cores.
    pub(super) fn each<T: Send>(&self, of: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
        (0..self.mesh.positions.len()).into_par_iter().map(of).collect()
    }

    fn direct(&self, vertex: usize) -> &[f32] {
        let functions = self.order.functions();
        &self.set.direct[vertex * functions..][..functions]
    }

    /// What arrives at a vertex straight from the environment without its lights, over pi, rgb; below 0 where its
    /// harmonics ring.
    pub(super) fn light(&self, vertex: usize) -> [f64; 3] {
        arriving(self.direct(vertex), &self.rest)
    }

    /// The mean direction of the open sky, as long as its share of the hemisphere; 0 where nothing is open.
    fn bent_normal(&self, vertex: usize) -> Vec3 {
        // The first band is the direction's x, y and z, but for a factor.
        let [share, x, y, z, ..] = *self.direct(vertex) else { return Vec3::ZERO };
        let share = (f64::from(share) / CONSTANT) as f32;
        share.clamp(0.0, 1.0) * Vec3::new(x, y, z).normalize_or_zero()
    }

    /// The share of what an open vertex receives that arrives here, with what the mesh throws back where that is baked;
    /// 0 in a channel without light.
    fn ratio(&self, visibility: Visibility, vertex: usize) -> [f32; 3] {
        let functions = self.order.functions();
        let thrown = match self.set.bounced.get(vertex * functions..(vertex + 1) * functions) {
            Some(bounced) => arriving(bounced, &self.whole),
            None => [0.0; 3],
        };
        let transfer = self.direct(vertex);
        let normal = self.mesh.normals[vertex];
        let order = if visibility.bands().is_some() { self.order } else { Order::MOST };
        let open = open_transfer_at(order, normal);
        let lit = arriving(&open, &self.rest);
        let mean = self.rest.mean();
        if visibility == Visibility::Scalar {
            // Whatever light comes from there, and so also where its harmonics ring.
            let open = f64::from(transfer[0]) / CONSTANT;
            let thrown = thrown_share(thrown, lit, mean);
            return [0, 1, 2].map(|c| if mean[c] > 0.0 { (open + thrown[c]) as f32 } else { 0.0 });
        }
        let shadowed = match visibility {
            Visibility::Cone => self.through_cone(vertex, lit),
            _ => arriving(transfer, &self.rest),
        };
        let arrived = [0, 1, 2].map(|c| shadowed[c] + thrown[c]);
        share_of_open(arrived, lit, mean).map(|share| share as f32)
    }

    /// How that moves as the environment turns, by radians; not at all where it is at 0. The value is that of light that
    /// harmonics hold alone.
    fn turning(&self, visibility: Visibility, vertex: usize) -> Ratio {
        let functions = self.order.functions();
        let bounced = self.set.bounced.get(vertex * functions..(vertex + 1) * functions);
        let thrown = bounced.map(|bounced| Turning::of(bounced, &self.whole)).unwrap_or_default();
        let order = if visibility.bands().is_some() { self.order } else { Order::MOST };
        let open = Turning::of(&open_transfer_at(order, self.mesh.normals[vertex]), &self.rest);
        let mean = self.rest.mean();
        let arriving = match visibility {
            // The open share itself stays.
            Visibility::Scalar => return thrown_ratio(&thrown, &open, mean, 0.0),
            Visibility::Cone => {
                thrown.with(&self.cone(vertex).map_or(open, |cone| Turning::of(&cone, &self.rest)))
            }
            _ => thrown.with(&Turning::of(self.direct(vertex), &self.rest)),
        };
        shadow_ratio(&arriving, &open, mean, 0.0)
    }

    /// The same by rays from each sample; `panorama` is the environment without its lights.
    fn by_rays(
        &self,
        scene: &'a Scene,
        rays: &'a RayMesh,
        gather: Option<&VertexGather>,
        panorama: &'a Environment,
    ) -> ByRays<'a> {
        let (mesh, albedo) = (self.mesh, Albedo { map: scene.maps.color.as_ref() });
        let lit = |vertex| arriving(self.direct(vertex), &self.whole).map(|light| light.max(0.0) as f32);
        let light = gather.filter(|_| scene.choices.bounces == Bounces::Gathered);
        let light = light.map_or_else(Vec::new, |gather| gather.lit(lit));
        let turn = panorama.rotation_degrees + scene.params.scalar(Param::EnvironmentRotation);
        ByRays {
            rays,
            shadows: Shadows::new(mesh, rays, scene.quality.sky_rays),
            radiance: Radiance::turned(panorama, turn),
            mean: self.rest.mean(),
            skin: LitMesh { mesh, albedo, light },
        }
    }

    /// What arrives through a cone about the bent normal that is as open as the vertex; `lit` where it is open.
    fn through_cone(&self, vertex: usize, lit: [f64; 3]) -> [f64; 3] {
        self.cone(vertex).map_or(lit, |cone| arriving(&cone, &self.rest))
    }

    /// What each function of the environment brings through that cone; none where the vertex is open.
    fn cone(&self, vertex: usize) -> Option<Vec<f64>> {
        let share = self.direct(vertex)[0];
        if share >= CONSTANT as f32 {
            return None;
        }
        let bent = self.bent_normal(vertex);
        let along =
            if bent == Vec3::ZERO { self.mesh.normals[vertex].normalize_or_zero() } else { bent.normalize() };
        let cap = cap(1.0 - f64::from(share) / CONSTANT);
        let mut through = basis(Order::MOST, along.to_array().map(f64::from));
        through.iter_mut().zip(Order::MOST.of_each()).for_each(|(value, (l, _))| *value *= cap[l]);
        Some(through)
    }
}

/// What light counts by band that comes through a cone about a surface's own normal, as the cosine: c_l = 2 times the
/// integral of x P_l(x) from the cosine of the cone's angle to 1. `square` is that cosine's square, the closed share of
/// the hemisphere; of a whole hemisphere these are the factors of the cosine lobe.
fn cap(square: f64) -> [f64; 6] {
    let square = square.clamp(0.0, 1.0);
    let x = square.sqrt();
    let beyond = |n: i32| 1.0 - x.powi(n);
    [
        beyond(2),
        2.0 / 3.0 * beyond(3),
        0.75 * beyond(4) - 0.5 * beyond(2),
        beyond(5) - beyond(3),
        (35.0 * beyond(6) - 45.0 * beyond(4) + 9.0 * beyond(2)) / 24.0,
        (9.0 * beyond(7) - 14.0 * beyond(5) + 5.0 * beyond(3)) / 4.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::harmonics::cosine_lobe;

    #[test]
    fn a_cone_of_a_whole_hemisphere_is_the_cosine_lobe_and_the_first_number_is_its_share() {
        for (l, factor) in cap(0.0).into_iter().enumerate() {
            // Roundings of a few sums of numbers up to 2.
            assert!((factor - cosine_lobe(l)).abs() < 1e-14, "{l}: {factor}");
        }
        for closed in [0.0, 0.25, 0.7, 1.0] {
            assert!((cap(closed)[0] - (1.0 - closed)).abs() < 1e-15);
        }
        assert_eq!(cap(1.0), [0.0; 6]);
    }

    #[test]
    fn a_cones_factors_are_the_integrals_of_legendre_polynomials() {
        let legendre = |l: usize, x: f64| {
            let (mut before, mut own) = (1.0, x);
            for k in 2..=l {
                let k = k as f64;
                (before, own) = (own, ((2.0 * k - 1.0) * x * own - (k - 1.0) * before) / k);
            }
            if l == 0 { 1.0 } else { own }
        };
        let (from, steps) = (0.6, 10_000);
        for (l, factor) in cap(from * from).into_iter().enumerate() {
            let at = |i: usize| from + (1.0 - from) * (i as f64 + 0.5) / steps as f64;
            let sum: f64 = (0..steps).map(|i| 2.0 * at(i) * legendre(l, at(i))).sum();
            let want = sum * (1.0 - from) / steps as f64;
            // The midpoint rule's step squared, 2e-9, times curvatures of up to 100.
            assert!((factor - want).abs() < 1e-7, "{l}: {factor} {want}");
        }
    }
}

//! Light that comes through the mesh, as fields of samples: how thick it is below them, how far each light travels inside, and
//! what arrives of it where it enters (MODEL 11).
//!
//! A light's way inside is that of a translucent shadow map (Dachsbacher and Stamminger 2003): from the point to the surface
//! that is first met from the light, gaps between with it. Gaps make it longer, not shorter: what stands between a thin part
//! and the light darkens it. Before that surface nothing stands, and a light without a size arrives there whole.
//!
//! Rays go to a point just below the surface. In a closed mesh each of them meets something: where the surface itself faces
//! the light that is the surface, and the way is 0. What meets nothing sees the light through a hole, from a side that has no
//! inside, and nothing comes through there.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::LANES;
use super::SampleError;
use super::rows::Row;
use super::sky::OfVertices;
use super::supply::{Points, Supplies, Supply};
use super::trace::Hit;
use super::visibility::{Place, Places, Shadows};
use crate::bake::packet::Segment;
use crate::bake::rays::RayMesh;
use crate::bake::thickness::{THICKNESS, VertexThickness, bake_thickness, distance};
use crate::bake::vertex_rays::offset;
use crate::bake::wide_bvh::NOTHING;
use crate::model::effects::Effect;
use crate::model::fields::Fields;
use crate::model::transmission::FARTHEST;
use crate::scene::Scene;
use crate::scene::light::{Light, LightKind};
use crate::scene::mesh::{Morph, PosedMesh};

/// A vertex of an edge is moved this much of the way into its triangle: on the edge rays graze the triangles around it.
const INTO_TRIANGLE: f64 = 1e-3;

/// One field of one light.
struct Through<'a> {
    inside: Arc<Inside<'a>>,
    light: Light,
    what: What,
}

#[derive(Clone, Copy)]
enum What {
    /// Millimetres that it travels inside.
    Depth,
    /// The share of it that arrives where it enters.
    Far,
    /// The same with what distance and cone leave of it; with `shadows` what stands before that place.
    Beyond { shadows: bool },
}

/// The inside of a mesh.
struct Inside<'a> {
    mesh: &'a PosedMesh,
    rays: &'a RayMesh,
    shadows: Shadows<'a>,
    /// How far below the surface rays end.
    lift: f64,
    /// Longer than the mesh is in any direction.
    reach: f64,
    /// Millimetres in a unit of the scene.
    unit: f64,
}

/// A light's way to a point.
#[derive(Clone, Copy)]
struct Way {
    /// How far it travels inside, in units of the scene.
    inside: f64,
    /// Where it enters.
    far: Place,
}

impl Supply for Through<'_> {
    fn find(&self, hit: Hit, numbers: &mut [f32]) {
        numbers.fill(self.found(&[hit])[0]);
    }

    fn find_each(&self, points: &Points, rows: &mut [Row]) {
        rows[0] = Row::of(self.found(&points.hits));
    }
}

impl Through<'_> {
    /// The field's number at each of at most [`LANES`] points.
    fn found(&self, hits: &[Hit]) -> [f32; LANES] {
        let attenuation = |hit: &Hit| self.light.attenuation(self.inside.position(*hit)) as f32;
        let each = |of: &dyn Fn(usize) -> f32| {
            let mut found = [0.0; LANES];
            found.iter_mut().zip(0..hits.len()).for_each(|(found, k)| *found = of(k));
            found
        };
        if let What::Beyond { shadows: false } = self.what {
            return each(&|k| attenuation(&hits[k]));
        }
        let ways = self.inside.ways(hits, &self.light);
        if let What::Depth = self.what {
            let depth = |way: Way| (way.inside * self.inside.unit).min(FARTHEST) as f32;
            return each(&|k| ways[k].map_or(FARTHEST as f32, depth));
        }
        let far: Vec<Place> =
            ways.iter().take(hits.len()).map(|way| way.map_or(Place::default(), |w| w.far)).collect();
        let visible = self.inside.shadows.visible(&Places::new(&far), &self.light);
        let open = |k: usize| if ways[k].is_some() { visible[k] } else { 1.0 };
        match self.what {
            What::Beyond { .. } => each(&|k| open(k) * attenuation(&hits[k])),
            _ => each(&open),
        }
    }
}

impl<'a> Inside<'a> {
    fn new(scene: &Scene, mesh: &'a PosedMesh, rays: &'a RayMesh) -> Self {
        let places = || mesh.positions.iter().filter(|place| place.is_finite()).map(|place| place.as_dvec3());
        let low = places().fold(DVec3::INFINITY, DVec3::min);
        let size = (places().fold(DVec3::NEG_INFINITY, DVec3::max) - low).length();
        Self {
            mesh,
            rays,
            shadows: Shadows::new(mesh, rays, scene.quality.shadow_rays),
            lift: f64::from(offset(&mesh.positions)),
            // A rounding more, so that rays begin outside.
            reach: 1.001 * if size.is_finite() { size } else { 0.0 },
            unit: 1e3 * scene.metres_per_unit,
        }
    }

    fn position(&self, hit: Hit) -> DVec3 {
        self.shadows.place(hit.triangle, hit.weights().map(f64::from)).position
    }

    /// The point below the surface at which rays end.
    fn below(&self, hit: Hit) -> DVec3 {
        let inner = hit.weights().map(|weight| f64::from(weight).max(INTO_TRIANGLE));
        let sum: f64 = inner.iter().sum();
        let corners = self.mesh.triangles[hit.triangle as usize].map(|i| i as usize);
        let of = |of: &[Vec3]| -> DVec3 { (0..3).map(|i| inner[i] / sum * of[corners[i]].as_dvec3()).sum() };
        of(&self.mesh.positions) - self.lift * of(&self.mesh.normals).normalize_or_zero()
    }

    /// The light's way to each of at most [`LANES`] points; none where nothing lies between.
    fn ways(&self, hits: &[Hit], light: &Light) -> [Option<Way>; LANES] {
        // Rays that are not to be traced have no length.
        let mut rays = [Segment { origin: glam::Vec3A::ZERO, direction: glam::Vec3A::Z, t_max: -1.0 }; LANES];
        let mut from = [(DVec3::ZERO, DVec3::ZERO, 0.0); LANES];
        for (k, &hit) in hits.iter().enumerate() {
            let below = self.below(hit);
            let toward = light.towards(below);
            let length = match &light.kind {
                LightKind::Directional(_) => self.reach,
                LightKind::Point(lamp) | LightKind::Spot(lamp, _) => lamp.position.distance(below),
            };
            from[k] = (below + length * toward, -toward, length);
            if toward != DVec3::ZERO {
                rays[k] = Segment {
                    origin: from[k].0.as_vec3a(),
                    direction: (-toward).as_vec3a(),
                    t_max: length as f32,
                };
            }
        }
        let met = self.rays.wide().first_of_each(&rays[..hits.len()]);
        std::array::from_fn(|k| {
            let (origin, along, length) = from[k];
            let triangle = Some(met[k]).filter(|&triangle| triangle != NOTHING)?;
            let outside = distance(self.mesh, triangle, origin, along)?;
            let weights = weights(self.mesh, triangle, origin + outside * along)?;
            Some(Way { inside: (length - outside).max(0.0), far: self.shadows.place(triangle, weights) })
        })
    }
}

/// How much each corner of a triangle counts at a place in its plane; none where it has no area.
fn weights(mesh: &PosedMesh, triangle: u32, place: DVec3) -> Option<[f64; 3]> {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.positions[i as usize].as_dvec3());
    let normal = (b - a).cross(c - a);
    let part = |p: DVec3, q: DVec3| {
        ((p - place).cross(q - place).dot(normal) / normal.length_squared()).clamp(0.0, 1.0)
    };
    let parts = [part(b, c), part(c, a), part(a, b)];
    let sum: f64 = parts.iter().sum();
    (sum.is_finite() && sum > 0.0).then(|| parts.map(|part| part / sum))
}

/// What finds those of `fields` that are of light which comes through; `morphs` are the scene's targets at their weights. What
/// is not baked yet is baked of this pose. A light that a parameter has moved stands there; what is found is held while the
/// parameter moves.
///
/// # Errors
/// When the thickness was baked for another mesh.
pub(super) fn supplies<'a>(
    scene: &Scene,
    mesh: &'a PosedMesh,
    rays: &'a RayMesh,
    morphs: &[Morph],
    (baked, fields): (Option<&VertexThickness>, Fields),
) -> Result<Supplies<'a>, SampleError> {
    let mut supplies: Supplies<'a> = Vec::new();
    if let Some(field) = fields.named(THICKNESS) {
        let thick = match baked {
            Some(baked) => baked.posed(&morphs.iter().map(|morph| morph.weight).collect::<Vec<_>>()),
            None => bake_thickness(&|_| mesh.clone(), 0).posed(&[]),
        };
        let vertices = mesh.positions.len();
        if thick.len() != vertices {
            let (scene, found) = (scene.path.display().to_string(), thick.len());
            return Err(SampleError::ThicknessLength { scene, found, vertices });
        }
        let unit = 1e3 * scene.metres_per_unit;
        let millimetres = |thick: f32| [(f64::from(thick) * unit).min(FARTHEST) as f32, 0.0, 0.0];
        let numbers = thick.into_iter().map(millimetres).collect();
        supplies.push((field, Box::new(OfVertices { triangles: &mesh.triangles, numbers })));
    }
    let shadows = scene.effects.has(Effect::Shadows);
    let mut inside = None;
    for light in scene.lights_at(&scene.params) {
        let each = [("depth", What::Depth), ("far", What::Far), ("found_beyond", What::Beyond { shadows })];
        for (name, what) in each {
            let Some(field) = fields.named(&format!("light_{}_{name}", light.member())) else { continue };
            let inside = inside.get_or_insert_with(|| Arc::new(Inside::new(scene, mesh, rays)));
            supplies
                .push((field, Box::new(Through { inside: Arc::clone(inside), light: light.clone(), what })));
        }
    }
    Ok(supplies)
}

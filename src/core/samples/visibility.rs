//! How much of a light reaches a place of the mesh: rays, the reference of all shadows (MODEL 8).
//!
//! Parallel and punctual lights take one ray. A light that has a size takes several, spread evenly over the solid angle
//! of its disc or sphere, and its visibility is the share of them that nothing stops. The rays are scrambled by the place
//! alone, so that the same place has the same shadow on any thread.
//!
//! A smooth normal faces lights that the flat triangle below it turns away from. Rays from the triangle would leave
//! whole triangles dark there (the shadow terminator). They start where the vertices' tangent planes put the surface
//! instead: Hanika, *Hacking the Shadow Terminator*, Ray Tracing Gems II (2021), chapter 4.

use glam::{DVec3, Vec3, Vec3A};

use crate::bake::low_discrepancy::{Sobol, mix};
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::{frame, offset};
use crate::scene::light::{Beam, Lamp, Light, LightKind};
use crate::scene::mesh::PosedMesh;

/// A place of a mesh that light may reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where it lies on its triangle.
    pub position: DVec3,
    /// Where rays to lights start.
    pub origin: Vec3A,
}

/// The shadows of a mesh as it is posed.
pub struct Shadows<'a> {
    mesh: &'a PosedMesh,
    rays: &'a RayMesh,
    /// A ray each towards a light that has a size.
    spread: Sobol,
    /// How far above the surface rays start.
    lift: f32,
}

impl<'a> Shadows<'a> {
    /// Of `mesh`, whose triangles are those of `rays`; `soft_rays` rays a place towards each light that has a size.
    #[must_use]
    pub fn new(mesh: &'a PosedMesh, rays: &'a RayMesh, soft_rays: u32) -> Self {
        Self { mesh, rays, spread: Sobol::new(soft_rays.max(1)), lift: offset(&mesh.positions) }
    }

    /// The place in a triangle at which its vertices have those weights, which sum to 1.
    ///
    /// Its side is the one that the smooth normal points to, whichever way round the triangle is.
    #[must_use]
    pub fn place(&self, triangle: u32, weights: [f64; 3]) -> Place {
        let vertices = self.mesh.triangles[triangle as usize].map(|i| i as usize);
        let corners = vertices.map(|i| self.mesh.positions[i].as_dvec3());
        let normals = vertices.map(|i| self.mesh.normals.get(i).copied().unwrap_or(Vec3::ZERO).as_dvec3());
        let sum = |of: [DVec3; 3]| -> DVec3 { (0..3).map(|i| weights[i] * of[i]).sum() };
        let (position, smooth) = (sum(corners), sum(normals));
        let [a, b, c] = corners;
        let flat = (b - a).cross(c - a).try_normalize();
        let flat = flat.or(smooth.try_normalize()).unwrap_or(DVec3::ZERO);
        let up = if flat.dot(smooth) < 0.0 { -flat } else { flat };
        // To each vertex' tangent plane where that lies above; a hollow stays as it is.
        let raised: DVec3 =
            (0..3).map(|i| weights[i] * (position - corners[i]).dot(normals[i]).min(0.0) * -normals[i]).sum();
        let origin = position + raised + f64::from(self.lift) * up;
        Place { position, origin: origin.as_vec3a() }
    }

    /// What of a light's strength arrives at a place: attenuation by distance, range and cone, times the share of the
    /// light that is visible from there. Times strength and max(0, n.L) it is the irradiance.
    #[must_use]
    pub fn arriving(&self, place: &Place, light: &Light) -> f32 {
        let attenuation = light.attenuation(place.position) as f32;
        // No ray has to be traced for what is out of reach.
        if attenuation > 0.0 { attenuation * self.visible(place, light) } else { 0.0 }
    }

    /// The share of a light that is visible from a place, in [0, 1].
    #[must_use]
    pub fn visible(&self, place: &Place, light: &Light) -> f32 {
        match &light.kind {
            LightKind::Directional(beam) => self.beam(place, beam, light.towards(place.position)),
            LightKind::Point(lamp) | LightKind::Spot(lamp, _) => self.lamp(place, lamp),
        }
    }

    /// Unit vectors distributed as the cosine over the hemisphere about the unit vector `normal`, as many as there are
    /// rays a place.
    pub(super) fn hemisphere(&self, place: &Place, normal: Vec3A) -> impl Iterator<Item = Vec3A> {
        let frame = frame(normal);
        self.spread.hemisphere(seed(place)).map(move |d| frame * d)
    }

    fn beam(&self, place: &Place, beam: &Beam, towards: DVec3) -> f32 {
        if towards == DVec3::ZERO {
            return 0.0;
        }
        let open = |along: Vec3A| !self.rays.hits(place.origin, along, 0.0);
        if beam.angular_diameter_degrees <= 0.0 {
            return share([open(towards.as_vec3a())].into_iter());
        }
        let sine = (0.5 * beam.angular_diameter_degrees.to_radians()).sin();
        share(self.cap(place, towards, sine).map(|(along, _)| open(along)))
    }

    fn lamp(&self, place: &Place, lamp: &Lamp) -> f32 {
        let to = lamp.position - place.origin.as_dvec3();
        let distance = to.length();
        // Within the lamp nothing is between.
        if distance <= lamp.radius {
            return 1.0;
        }
        let open = |end: Vec3A| !self.rays.between(place.origin, end);
        if lamp.radius <= 0.0 {
            return share([open(lamp.position.as_vec3a())].into_iter());
        }
        let sine = lamp.radius / distance;
        let nearest = |off: f32| {
            // Where a ray that leaves the middle by an angle of sine `off` meets the sphere.
            let off = f64::from(off);
            let inside = (lamp.radius.powi(2) - (distance * off).powi(2)).max(0.0).sqrt();
            (distance * (1.0 - off * off).sqrt() - inside) as f32
        };
        share(
            self.cap(place, to / distance, sine)
                .map(|(along, off)| open(place.origin + nearest(off) * along)),
        )
    }

    /// Unit vectors spread evenly over the solid angle within an angle of that sine about `middle`, and the sine of each
    /// one's angle from the middle.
    fn cap(&self, place: &Place, middle: DVec3, sine: f64) -> impl Iterator<Item = (Vec3A, f32)> {
        let frame = frame(middle.as_vec3a());
        // 1 - cos of the cap, without its cancellation.
        let height = (sine * sine / (1.0 + (1.0 - sine * sine).max(0.0).sqrt())) as f32;
        self.spread.disc(seed(place)).map(move |(radius, [sin, cos])| {
            // 1 - cos, and the sine, of a ray's angle: even in the cap where `radius` is even in the disc.
            let below = radius * radius * height;
            let off = (below * (2.0 - below)).max(0.0).sqrt();
            let side = off.copysign(radius);
            (frame * Vec3A::new(side * cos, side * sin, 1.0 - below), off)
        })
    }
}

/// A place's own number.
pub(super) fn seed(place: &Place) -> u32 {
    // 0 and -0 are one place.
    let [x, y, z] = place.position.as_vec3().to_array().map(|x| (x + 0.0).to_bits());
    mix(x ^ mix(y ^ mix(z)))
}

/// The share of rays that are open.
fn share(open: impl Iterator<Item = bool>) -> f32 {
    let (mut count, mut through) = (0_u32, 0_u32);
    for open in open {
        count += 1;
        through += u32::from(open);
    }
    through as f32 / count.max(1) as f32
}

#[cfg(test)]
mod tests;

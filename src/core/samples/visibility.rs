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

use super::LANES;
use crate::bake::low_discrepancy::{Sobol, mix};
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::{frame, offset};
use crate::bake::wide_bvh::Segment;
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

/// What is found of a light from a place.
enum Found {
    /// The share that is visible.
    Known(f32),
    /// Rays towards it, as many from every place.
    Along(Vec<Segment>),
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

    /// What of a light's strength arrives at each place, of at most [`LANES`]: attenuation by distance, range and cone,
    /// times the share of the light that is visible from there. Times strength and max(0, n.L) it is the irradiance.
    #[must_use]
    pub fn arriving(&self, places: &[Place], light: &Light) -> [f32; LANES] {
        let mut arriving = [0.0; LANES];
        for (arriving, place) in arriving.iter_mut().zip(places) {
            *arriving = light.attenuation(place.position) as f32;
        }
        // No ray has to be traced for what is out of reach.
        if arriving.iter().any(|&attenuation| attenuation > 0.0) {
            let visible = self.visible(places, light);
            arriving.iter_mut().zip(visible).for_each(|(arriving, visible)| *arriving *= visible);
        }
        arriving
    }

    /// The share of a light that is visible from each place, of at most [`LANES`], in [0, 1].
    ///
    /// Places that are near one another take less time.
    #[must_use]
    pub fn visible(&self, places: &[Place], light: &Light) -> [f32; LANES] {
        let (mut shares, mut traced) = ([0.0; LANES], [0_usize; LANES]);
        let (mut rays, mut count) = (Vec::new(), 0);
        for (lane, place) in places.iter().enumerate().take(LANES) {
            let found = match &light.kind {
                LightKind::Directional(beam) => self.beam(place, beam, light.towards(place.position)),
                LightKind::Point(lamp) | LightKind::Spot(lamp, _) => self.lamp(place, lamp),
            };
            match found {
                Found::Known(share) => shares[lane] = share,
                Found::Along(own) => {
                    traced[count] = lane;
                    count += 1;
                    rays.push(own);
                }
            }
        }
        // One ray of each place at a time.
        let each = rays.first().map_or(0, Vec::len);
        for i in 0..each {
            let mut packet = [Segment { origin: Vec3A::ZERO, direction: Vec3A::Z, length: -1.0 }; LANES];
            packet.iter_mut().zip(&rays).for_each(|(ray, own)| *ray = own[i]);
            let blocked = self.rays.wide().blocked(&packet[..count]);
            for k in 0..count {
                shares[traced[k]] += f32::from(u8::from(!blocked[k]));
            }
        }
        traced[..count].iter().for_each(|&lane| shares[lane] /= each as f32);
        shares
    }

    /// Unit vectors distributed as the cosine over the hemisphere about the unit vector `normal`, as many as there are
    /// rays a place.
    pub(super) fn hemisphere(&self, place: &Place, normal: Vec3A) -> impl Iterator<Item = Vec3A> {
        let frame = frame(normal);
        self.spread.hemisphere(seed(place)).map(move |d| frame * d)
    }

    fn beam(&self, place: &Place, beam: &Beam, towards: DVec3) -> Found {
        if towards == DVec3::ZERO {
            return Found::Known(0.0);
        }
        let ray = |direction| Segment { origin: place.origin, direction, length: f32::INFINITY };
        if beam.angular_diameter_degrees <= 0.0 {
            return Found::Along(vec![ray(towards.as_vec3a())]);
        }
        let sine = (0.5 * beam.angular_diameter_degrees.to_radians()).sin();
        Found::Along(self.cap(place, towards, sine).map(|(along, _)| ray(along)).collect())
    }

    fn lamp(&self, place: &Place, lamp: &Lamp) -> Found {
        let to = lamp.position - place.origin.as_dvec3();
        let distance = to.length();
        // Within the lamp nothing is between.
        if distance <= lamp.radius {
            return Found::Known(1.0);
        }
        let ray = |direction, length| Segment { origin: place.origin, direction, length };
        if lamp.radius <= 0.0 {
            return Found::Along(vec![ray((to / distance).as_vec3a(), distance as f32)]);
        }
        let sine = lamp.radius / distance;
        let nearest = |off: f32| {
            // Where a ray that leaves the middle by an angle of sine `off` meets the sphere.
            let off = f64::from(off);
            let inside = (lamp.radius.powi(2) - (distance * off).powi(2)).max(0.0).sqrt();
            (distance * (1.0 - off * off).sqrt() - inside) as f32
        };
        let cap = self.cap(place, to / distance, sine);
        Found::Along(cap.map(|(along, off)| ray(along, nearest(off))).collect())
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

#[cfg(test)]
mod tests;

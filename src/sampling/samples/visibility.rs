//! How much of a light reaches a place of the mesh: rays, the reference of all shadows (MODEL 8).
//!
//! Parallel and punctual lights take one ray. A light that has a size takes several, spread evenly over the solid angle
//! of its disc or sphere, and its visibility is the share of them that nothing stops. The rays are scrambled by the place
//! alone, so that the same place has the same shadow on any thread.
//!
//! A smooth normal faces lights that the flat triangle below it turns away from. Rays from the triangle would leave
//! whole triangles dark there (the shadow terminator). They start where the vertices' tangent planes put the surface
//! instead: Hanika, *Hacking the Shadow Terminator*, Ray Tracing Gems II (2021), chapter 4.

use std::cell::OnceCell;

use glam::{DVec3, Mat3A, Vec3, Vec3A};

use super::LANES;
use crate::bake::low_discrepancy::{Sobol, mix};
use crate::bake::packet::Segment;
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::{frame, offset};

use crate::scene::light::{Beam, Lamp, Light, LightKind};
use crate::scene::mesh::PosedMesh;

/// A place of a mesh that light may reach.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Where it lies on its triangle.
    pub position: DVec3,
    /// Where rays to lights start.
    pub origin: Vec3A,
}

impl Place {
    /// The same on the other side of the surface.
    pub(super) fn other_side(self) -> Self {
        Self { origin: 2.0 * self.position.as_vec3a() - self.origin, ..self }
    }
}

/// A point of the unit disc: radius, which may be negative, then sine and cosine of the angle.
type Disc = (f32, [f32; 2]);

/// Places from which lights are looked at together.
#[derive(Debug)]
pub struct Places {
    all: [Place; LANES],
    count: usize,
    /// Where rays to lights that have a size go, once one asks.
    discs: OnceCell<Vec<[Disc; LANES]>>,
}

/// How the visible share of a light is found from a place.
#[derive(Clone, Copy)]
enum Aim {
    /// The share that is visible.
    Known(f32),
    /// A ray to it.
    Ray { direction: Vec3A, length: f32 },
    /// Rays spread evenly over its solid angle.
    Cap(Cap),
}

/// A circular cone of directions, which ends at infinity or at a sphere.
#[derive(Clone, Copy)]
struct Cap {
    /// Its axis is Z's image.
    frame: Mat3A,
    /// 1 - cos of its half angle.
    height: f32,
    /// Distance and radius of the sphere.
    sphere: Option<(f64, f64)>,
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
        let flat = plane(corners).or(smooth.try_normalize()).unwrap_or(DVec3::ZERO);
        let up = if flat.dot(smooth) < 0.0 { -flat } else { flat };
        // To each vertex' tangent plane where that lies above; a hollow stays as it is.
        let raised: DVec3 =
            (0..3).map(|i| weights[i] * (position - corners[i]).dot(normals[i]).min(0.0) * -normals[i]).sum();
        let origin = position + raised + f64::from(self.lift) * up;
        Place { position, origin: origin.as_vec3a() }
    }

    /// What of a light's strength arrives at each place: attenuation by distance, range and cone, times the share of the
    /// light that is visible from there. Times strength and max(0, n.L) it is the irradiance.
    #[must_use]
    pub fn arriving(&self, from: &Places, light: &Light) -> [f32; LANES] {
        let mut arriving = [0.0; LANES];
        for (arriving, place) in arriving.iter_mut().zip(from.places()) {
            *arriving = light.attenuation(place.position) as f32;
        }
        // No ray has to be traced for what is out of reach.
        let visible = self.visible_where(from, light, |k| arriving[k] > 0.0);
        std::array::from_fn(|k| arriving[k] * visible[k])
    }

    /// The share of a light that is visible from each place, in [0, 1].
    #[must_use]
    pub fn visible(&self, from: &Places, light: &Light) -> [f32; LANES] {
        self.visible_where(from, light, |_| true)
    }

    /// The same of those places that are `asked` for, 0 of the others.
    fn visible_where(&self, from: &Places, light: &Light, asked: impl Fn(usize) -> bool) -> [f32; LANES] {
        let mut aims = [Aim::Known(0.0); LANES];
        for (k, place) in from.places().iter().enumerate().filter(|&(k, _)| asked(k)) {
            aims[k] = match &light.kind {
                LightKind::Directional(beam) => beam_from(beam, light.towards(place.position)),
                LightKind::Point(lamp) | LightKind::Spot(lamp, _) => lamp_from(lamp, place),
            };
        }
        let mut shares = aims.map(|aim| if let Aim::Known(share) = aim { share } else { 0.0 });
        if aims.iter().any(|aim| matches!(aim, Aim::Ray { .. })) {
            let packet = self.packet(from, |k| match aims[k] {
                Aim::Ray { direction, length } => Some((direction, length)),
                _ => None,
            });
            shares.iter_mut().zip(packet).for_each(|(share, open)| *share += f32::from(u8::from(open)));
        }
        if aims.iter().any(|aim| matches!(aim, Aim::Cap(_))) {
            let discs = from.discs.get_or_init(|| self.discs(from));
            let each = discs.len() as f32;
            let mut open = [0_u32; LANES];
            for disc in discs {
                let packet = self.packet(from, |k| match aims[k] {
                    Aim::Cap(cap) => Some(cap.ray(disc[k])),
                    _ => None,
                });
                open.iter_mut().zip(packet).for_each(|(sum, open)| *sum += u32::from(open));
            }
            shares.iter_mut().zip(open).for_each(|(share, open)| *share += open as f32 / each);
        }
        shares
    }

    /// Which of the rays that are given for places nothing stands in the way of: unit directions and lengths.
    fn packet(&self, from: &Places, ray: impl Fn(usize) -> Option<(Vec3A, f32)>) -> [bool; LANES] {
        let mut open = [false; LANES];
        // Rays that are not to be traced have no length.
        let mut rays = [Segment { origin: Vec3A::ZERO, direction: Vec3A::Z, t_max: -1.0 }; LANES];
        for (k, place) in from.places().iter().enumerate() {
            rays[k].origin = place.origin;
            if let Some((direction, length)) = ray(k) {
                (rays[k].direction, rays[k].t_max) = (direction, length);
                open[k] = true;
            } else if k > 0 {
                // A direction of a neighbour's keeps the packet narrow.
                rays[k].direction = rays[k - 1].direction;
            }
        }
        let occluded = self.rays.wide().occluded(&rays[..from.places().len()]);
        std::array::from_fn(|k| open[k] && !occluded[k])
    }

    /// A point of the unit disc for each ray of each place.
    fn discs(&self, from: &Places) -> Vec<[Disc; LANES]> {
        let mut discs = vec![[(0.0, [0.0, 1.0]); LANES]; self.spread.count() as usize];
        for (k, place) in from.places().iter().enumerate() {
            for (disc, point) in discs.iter_mut().zip(self.spread.disc(seed(place))) {
                disc[k] = point;
            }
        }
        discs
    }

    /// Unit vectors distributed as the cosine over the hemisphere about the unit vector `normal`, as many as there are
    /// rays a place.
    pub(super) fn hemisphere(&self, place: &Place, normal: Vec3A) -> impl Iterator<Item = Vec3A> {
        let frame = frame(normal);
        self.spread.hemisphere(seed(place)).map(move |d| frame * d)
    }
}

impl Places {
    /// Of at most [`LANES`], which had best be near one another.
    #[must_use]
    pub fn new(places: &[Place]) -> Self {
        let count = places.len().min(LANES);
        let all = std::array::from_fn(|k| places.get(k).copied().unwrap_or_default());
        Self { all, count, discs: OnceCell::new() }
    }

    fn places(&self) -> &[Place] {
        &self.all[..self.count]
    }
}

impl Cap {
    /// Unit direction and length of the ray through a point of the disc; even in the cap where that is even in the disc.
    fn ray(&self, (radius, [sin, cos]): Disc) -> (Vec3A, f32) {
        // 1 - cos, and the sine, of a ray's angle.
        let below = radius * radius * self.height;
        let off = (below * (2.0 - below)).max(0.0).sqrt();
        let side = off.copysign(radius);
        let along = self.frame * Vec3A::new(side * cos, side * sin, 1.0 - below);
        let Some((distance, radius)) = self.sphere else { return (along, f32::INFINITY) };
        // Where a ray that leaves the middle by that angle meets the sphere.
        let off = f64::from(off);
        let inside = (radius.powi(2) - (distance * off).powi(2)).max(0.0).sqrt();
        (along, (distance * (1.0 - off * off).sqrt() - inside) as f32)
    }
}

/// The cap about the unit vector `middle` within an angle of that sine.
fn cap(middle: DVec3, sine: f64, sphere: Option<(f64, f64)>) -> Aim {
    // 1 - cos of the cap, without its cancellation.
    let height = (sine * sine / (1.0 + (1.0 - sine * sine).max(0.0).sqrt())) as f32;
    Aim::Cap(Cap { frame: frame(middle.as_vec3a()), height, sphere })
}

fn beam_from(beam: &Beam, towards: DVec3) -> Aim {
    if towards == DVec3::ZERO {
        return Aim::Known(0.0);
    }
    if beam.angular_diameter_degrees <= 0.0 {
        return Aim::Ray { direction: towards.as_vec3a(), length: f32::INFINITY };
    }
    cap(towards, (0.5 * beam.angular_diameter_degrees.to_radians()).sin(), None)
}

fn lamp_from(lamp: &Lamp, place: &Place) -> Aim {
    let to = lamp.position - place.origin.as_dvec3();
    let distance = to.length();
    // Within the lamp nothing is between.
    if distance <= lamp.radius {
        return Aim::Known(1.0);
    }
    if lamp.radius <= 0.0 {
        return Aim::Ray { direction: (to / distance).as_vec3a(), length: distance as f32 };
    }
    cap(to / distance, lamp.radius / distance, Some((distance, lamp.radius)))
}

/// The unit normal of a triangle; none of one that is so thin that rounding its corners to f32 turns it.
fn plane([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let normal = (b - a).cross(c - a);
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let farthest = [a, b, c].into_iter().map(DVec3::length).fold(0.0, f64::max);
    // Its height is the normal's length over the longest edge; 16 roundings of a corner.
    let told = normal.length() > 16.0 * f64::from(f32::EPSILON) * farthest * longest;
    told.then(|| normal.try_normalize()).flatten()
}

/// A place's own number.
pub(super) fn seed(place: &Place) -> u32 {
    // 0 and -0 are one place.
    let [x, y, z] = place.position.as_vec3().to_array().map(|x| (x + 0.0).to_bits());
    mix(x ^ mix(y ^ mix(z)))
}

#[cfg(test)]
mod tests;

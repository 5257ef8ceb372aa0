//! What is not skin, drawn plainly: by its own glTF material (metallic-roughness) under the scene's light, with rays.
//!
//! No parameter moves it and no fit sees it; it is there so that a picture is whole. Its pixels are left out of what is
//! compared. Light that the mesh throws back is not among what it receives.

use std::f64::consts::PI;

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::trace::Hit;
use super::visibility::{Place, Places, Shadows};
use super::{PosedSurface, plain_spread};
use crate::bake::lobe_sky::LobeSky;
use crate::bake::low_discrepancy::{Sobol, mix};
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::frame;
use crate::bake::wide_bvh::NOTHING;
use crate::scene::Scene;
use crate::scene::light::{Light, LightKind};
use crate::scene::plain::{PlainMaterial, PlainSurface};
use crate::scene::view::Camera;
use crate::specular::brdf::{ggx_distribution, ggx_visibility};

/// Rays into the environment of each sample, for the diffuse light and for the lobe each: with several samples a pixel its
/// noise is below what one sees in an eye.
const RAYS: u32 = 32;
/// Samples that one task shades.
const CHUNK: usize = 64;
/// A cosine; a normal that faces away is turned until it has this one with the view.
const LEAST_FACING: f64 = 1e-4;

/// The part of a pixel that shows what is not skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlainPixel {
    /// The pixel's index in the image.
    pub pixel: u32,
    /// The share of its area.
    pub share: f32,
    /// Linear radiance, premultiplied by that share.
    pub rgb: [f32; 3],
}

/// The scene's light on what is not skin.
struct PlainLight<'a> {
    rays: &'a RayMesh,
    shadows: Shadows<'a>,
    sky: Option<LobeSky>,
    lights: Vec<Light>,
    spread: Sobol,
}

/// The pixels of the samples that show what is not skin, in the order of `hits`, whose pixels follow one another; each
/// sample is one of `per_pixel`.
pub(super) fn pixels(
    scene: &Scene,
    posed: &PosedSurface<'_>,
    camera: &Camera,
    hits: &[(u32, Hit)],
    per_pixel: u32,
) -> Vec<PlainPixel> {
    if hits.is_empty() {
        return Vec::new();
    }
    let light = PlainLight {
        rays: posed.rays,
        shadows: Shadows::new(posed.mesh, posed.rays, scene.quality.shadow_rays),
        sky: LobeSky::of_scene(scene),
        lights: plain_spread::lights(scene, &scene.params),
        spread: Sobol::new(RAYS),
    };
    let eye = camera.eye();
    let share = 1.0 / per_pixel as f32;
    let radiance = |(i, &(pixel, hit)): (usize, &(u32, Hit))| {
        let material = posed.mesh.plain.as_ref().and_then(|plain| plain.material(hit.triangle));
        let rgb = material.map_or([0.0; 3], |material| light.leaving(posed, hit, material, (eye, i as u32)));
        PlainPixel { pixel, share, rgb: rgb.map(|c| share * c as f32) }
    };
    let each: Vec<PlainPixel> = hits.par_iter().enumerate().with_min_len(CHUNK).map(radiance).collect();
    by_pixel(each)
}

/// The shares of pixels alone, black.
pub(super) fn shares(hits: &[(u32, Hit)], per_pixel: u32) -> Vec<PlainPixel> {
    let share = 1.0 / per_pixel as f32;
    by_pixel(hits.iter().map(|&(pixel, _)| PlainPixel { pixel, share, rgb: [0.0; 3] }).collect())
}

/// Samples whose pixels follow one another, added up.
fn by_pixel(each: Vec<PlainPixel>) -> Vec<PlainPixel> {
    let mut pixels: Vec<PlainPixel> = Vec::new();
    for one in each {
        match pixels.last_mut().filter(|last| last.pixel == one.pixel) {
            Some(last) => {
                last.share += one.share;
                (0..3).for_each(|c| last.rgb[c] += one.rgb[c]);
            }
            None => pixels.push(one),
        }
    }
    pixels
}

/// The normal, turned towards the view until it faces it.
fn facing(normal: DVec3, view: DVec3) -> DVec3 {
    let cosine = normal.dot(view);
    if cosine >= LEAST_FACING {
        return normal;
    }
    (normal + (LEAST_FACING - cosine) * view).normalize_or_zero()
}

impl PlainLight<'_> {
    /// The radiance that leaves a place of a material towards the eye.
    fn leaving(
        &self,
        posed: &PosedSurface<'_>,
        hit: Hit,
        material: &PlainMaterial,
        (eye, seed): (DVec3, u32),
    ) -> [f64; 3] {
        let weights = hit.weights().map(f64::from);
        let place = self.shadows.place(hit.triangle, weights);
        let corners = posed.mesh.triangles[hit.triangle as usize].map(|i| i as usize);
        let smooth: DVec3 = (0..3).map(|i| weights[i] * posed.mesh.normals[corners[i]].as_dvec3()).sum();
        let view = (eye - place.position).normalize_or_zero();
        let normal = smooth.normalize_or_zero();
        // Both sides are drawn, each as the front. The triangle says which one is seen: near the silhouette of a coarse
        // mesh the smooth normal may face away.
        let [a, b, c] = corners.map(|i| posed.mesh.positions[i].as_dvec3());
        let plane = (b - a).cross(c - a);
        let seen_from_behind = plane.dot(normal) * plane.dot(view) < 0.0;
        let (normal, place) = if seen_from_behind { (-normal, place.other_side()) } else { (normal, place) };
        let normal = if normal == DVec3::ZERO { normal } else { facing(normal, view) };
        let tint =
            posed.mesh.plain.as_ref().map_or([1.0; 4], |plain| plain.tint(hit.triangle, hit.weights()));
        let surface = material.at(hit.uv(posed.mesh), tint);
        let mut rgb = surface.emission;
        if normal == DVec3::ZERO || view == DVec3::ZERO {
            return rgb;
        }
        let facing = normal.dot(view).max(LEAST_FACING);
        if let Some(sky) = &self.sky {
            let found = self.of_sky(sky, &place, (normal, view, facing), &surface, seed);
            (0..3).for_each(|c| rgb[c] += found[c]);
        }
        for light in &self.lights {
            let found = self.of_light(light, &place, (normal, view, facing), &surface);
            (0..3).for_each(|c| rgb[c] += found[c]);
        }
        rgb.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 })
    }

    /// Reflected light of the environment, where rays meet nothing: filtered importance sampling (Křivánek and Colbert
    /// 2008), by the cosine and by GGX's distribution of half vectors.
    fn of_sky(
        &self,
        sky: &LobeSky,
        place: &Place,
        (normal, view, facing): (DVec3, DVec3, f64),
        surface: &PlainSurface,
        seed: u32,
    ) -> [f64; 3] {
        let frame = frame(normal.as_vec3a());
        let each = f64::from(RAYS);
        let mut rays: Vec<(Vec3A, f64, [f64; 3])> = Vec::with_capacity(2 * RAYS as usize);
        for d in self.spread.hemisphere(mix(seed)) {
            let cosine = f64::from(d.z.max(1e-3));
            let toward = (frame * d).as_dvec3();
            let v_h = view.dot((toward + view).normalize_or_zero());
            rays.push((frame * d, PI / (each * cosine), surface.diffuse_towards(v_h).map(|c| c / each)));
        }
        for (radius, [sine, cosine]) in self.spread.disc(mix(seed ^ 0x5bd1_e995)) {
            // tan^2 of the half vector's angle is alpha^2 u / (1 - u).
            let u = f64::from(radius * radius).min(0.999_999);
            let below = 1.0 + surface.alpha * surface.alpha * u / (1.0 - u);
            let (up, out) = (below.sqrt().recip(), (1.0 - 1.0 / below).max(0.0).sqrt());
            let out = out.copysign(f64::from(radius));
            let local =
                Vec3A::new((out * f64::from(cosine)) as f32, (out * f64::from(sine)) as f32, up as f32);
            let half = (frame * local).as_dvec3().normalize();
            let toward = 2.0 * view.dot(half) * half - view;
            let (n_l, v_h) = (normal.dot(toward), view.dot(half));
            if n_l <= 0.0 || v_h <= 0.0 {
                continue;
            }
            let density = ggx_distribution(1.0 - up * up, up * up, surface.alpha) * up / (4.0 * v_h);
            let masked = ggx_visibility(n_l, facing, surface.alpha) * 4.0 * n_l * facing;
            let weight = masked * v_h / (facing * up * each);
            let fresnel = surface.fresnel(v_h).map(|f| weight * f);
            rays.push((toward.as_vec3a(), 1.0 / (each * density), fresnel));
        }
        let directions: Vec<Vec3A> = rays.iter().map(|(along, ..)| *along).collect();
        let met = self.rays.wide().first(place.origin, &directions);
        let mut rgb = [0.0; 3];
        for ((along, solid_angle, weight), _) in rays.iter().zip(met).filter(|(_, met)| *met == NOTHING) {
            let light = sky.along(*along, solid_angle.clamp(1e-6, 4.0 * PI));
            (0..3).for_each(|c| rgb[c] += weight[c] * light[c]);
        }
        rgb
    }

    /// Reflected light of one of the scene's lights.
    fn of_light(
        &self,
        light: &Light,
        place: &Place,
        (normal, view, facing): (DVec3, DVec3, f64),
        surface: &PlainSurface,
    ) -> [f64; 3] {
        let toward = light.towards(place.position);
        let n_l = normal.dot(toward);
        if n_l.is_nan() || n_l <= 0.0 {
            return [0.0; 3];
        }
        let arriving = f64::from(self.shadows.arriving(&Places::new(&[*place]), light)[0]);
        let strength = match &light.kind {
            LightKind::Directional(beam) => beam.irradiance,
            LightKind::Point(lamp) | LightKind::Spot(lamp, _) => lamp.intensity,
        };
        let half = (toward + view).normalize_or_zero();
        let (n_h, v_h) = (normal.dot(half), view.dot(half).max(0.0));
        let lobe = ggx_distribution(1.0 - n_h * n_h, n_h * n_h, surface.alpha)
            * ggx_visibility(n_l, facing, surface.alpha);
        let (fresnel, diffuse) = (surface.fresnel(v_h), surface.diffuse_towards(v_h));
        std::array::from_fn(|c| (diffuse[c] / PI + fresnel[c] * lobe) * strength[c] * arriving * n_l)
    }
}

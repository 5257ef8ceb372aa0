//! What reaches samples of each light: fields of their own, by rays against the mesh.

use std::sync::Arc;

use glam::DVec3;

use super::rows::Row;
use super::supply::{Points, Supplies, Supply, one_by_one};
use super::trace::Hit;
use super::visibility::{Place, Places, Shadows};
use crate::bake::rays::RayMesh;
use crate::model::effects::Effect;
use crate::model::fields::Field;
use crate::scene::Scene;
use crate::scene::light::{Light, LightKind};
use crate::scene::mesh::PosedMesh;

/// One field of one light.
struct Reaching<'a> {
    shadows: Arc<Shadows<'a>>,
    light: Light,
    what: What,
}

#[derive(Clone, Copy)]
enum What {
    /// The share of it that nothing stops.
    Open,
    /// The unit vector towards it.
    Toward,
    /// What distance and cone leave of it, and with `shadows` what stands between.
    Arriving { shadows: bool },
}

impl Supply for Reaching<'_> {
    fn find(&self, hit: Hit, numbers: &mut [f32]) {
        let place = self.place(hit);
        let places = || Places::new(&[place]);
        match self.what {
            What::Open => numbers[0] = self.shadows.visible(&places(), &self.light)[0],
            What::Arriving { shadows: true } => numbers[0] = self.shadows.arriving(&places(), &self.light)[0],
            What::Arriving { shadows: false } => numbers[0] = self.light.attenuation(place.position) as f32,
            What::Toward => {
                let toward: DVec3 = self.light.towards(place.position);
                numbers.copy_from_slice(&toward.as_vec3().to_array()[..numbers.len()]);
            }
        }
    }

    fn find_each(&self, points: &Points, rows: &mut [Row]) {
        // All lights are looked at from the same places.
        let places = || points.places.get_or_init(|| Places::new(&points.hits.map(|hit| self.place(hit))));
        match self.what {
            What::Open => rows[0] = Row::of(self.shadows.visible(places(), &self.light)),
            What::Arriving { shadows: true } => {
                rows[0] = Row::of(self.shadows.arriving(places(), &self.light));
            }
            What::Arriving { shadows: false } | What::Toward => one_by_one(self, points, rows),
        }
    }
}

impl Reaching<'_> {
    fn place(&self, hit: Hit) -> Place {
        self.shadows.place(hit.triangle, hit.weights().map(f64::from))
    }
}

/// What finds the fields of a scene's lights at samples of its mesh. A light that a parameter has moved stands there;
/// what is found is held while the parameter moves.
pub(super) fn supplies<'a>(scene: &Scene, mesh: &'a PosedMesh, rays: &'a RayMesh) -> Supplies<'a> {
    if !scene.effects.has(Effect::Lights) {
        return Vec::new();
    }
    let shadows = Arc::new(Shadows::new(mesh, rays, scene.quality.shadow_rays));
    let shadowed = scene.effects.has(Effect::Shadows);
    let mut supplies: Supplies<'a> = Vec::new();
    for light in scene.lights_at(&scene.params) {
        let fields = match light.kind {
            LightKind::Directional(_) => vec![("open", What::Open)],
            LightKind::Point(_) | LightKind::Spot(..) => {
                let arriving = What::Arriving { shadows: shadowed };
                vec![("found_toward", What::Toward), ("found_arriving", arriving), ("open", What::Open)]
            }
        };
        for (name, what) in fields {
            let Some(field) = Field::from_name(&format!("light_{}_{name}", light.member())) else { continue };
            let (shadows, light) = (Arc::clone(&shadows), light.clone());
            supplies.push((field, Box::new(Reaching { shadows, light, what })));
        }
    }
    supplies
}

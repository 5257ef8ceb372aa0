//! What a scene calls for: the input of the planner.

use crate::model::compose::TermName;
use crate::model::effects::{Effect, Effects, Form, Needs, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Param, Params};
use crate::scene::Scene;
use crate::shader::quantity::Resource;

/// How far the output may be off, relative to white diffuse light of unit irradiance.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Budget {
    /// Rounding alone: f32 throughout, filtering in the shader.
    #[default]
    Exact,
    /// What the paper's own programs did: interpolated silhouettes, the hardware's filtering.
    Paper,
    /// The chosen rules' errors may add up to this.
    Within(f64),
}

/// Where fragments come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub enum Source {
    /// A vertex shader and the rasteriser.
    #[default]
    Raster,
    /// Stored samples: what `model::fragment::Fragment` holds, read in a compute shader.
    Samples,
    /// Stored terms: what `model::terms::Terms` holds, and S.x. That is all that shading reads where
    /// nothing changes that needs a lookup.
    Terms,
}

/// Which maps a scene has, and which are of one size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub struct MapFacts {
    /// There is a colour map.
    pub color: bool,
    /// There is a normal map.
    pub normal: bool,
    /// There is a specular map.
    pub specular: bool,
    /// There is an attenuator map.
    pub attenuator: bool,
    /// Colour and specular map are of one size.
    pub color_specular: bool,
    /// Normal and attenuator map are of one size.
    pub normal_attenuator: bool,
}

/// Texels along a side of the cubes' faces, where they are known when the shader is written: they stand in its text
/// then. A shader that asks the texture in every lookup takes a tenth longer over a fit's pass (on an H200).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub struct FaceSizes {
    /// Of E_d.
    pub irradiance: Option<usize>,
    /// Of E_s, at every exponent.
    pub specular: Option<usize>,
    /// Of E_h.
    pub hilite: Option<usize>,
}

impl FaceSizes {
    /// Of a resource's faces.
    #[must_use]
    pub const fn of(&self, resource: Resource) -> Option<usize> {
        match resource {
            Resource::IrradianceFaces => self.irradiance,
            Resource::SpecularFaces | Resource::SpecularSlopeFaces => self.specular,
            Resource::HiliteFaces => self.hilite,
            _ => None,
        }
    }
}

/// What a scene calls for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// The switches of the model.
    pub setup: Setup,
    /// Where fragments come from.
    pub source: Source,
    /// Maps that the scene has and an effect asks for.
    pub maps: MapFacts,
    /// The cubes' sizes.
    pub faces: FaceSizes,
    /// Morph targets whose weight is not 0, or all when weights will change.
    pub morphs: u32,
    /// Whether bones move the mesh.
    pub bones: bool,
    /// Whether `environment_rotation` is not 0.
    pub turned: bool,
    /// Whether `rim_exponent` is 2, as listed.
    pub square_rim: bool,
    /// Whether the adapter computes in 16 bits.
    pub f16: bool,
    /// How far 1 - |N.V| is off inside a triangle when it is interpolated: the 99th percentile over
    /// the mesh.
    pub tessellation: f64,
    /// The accuracy allowed.
    pub budget: Budget,
    /// One term alone, instead of the whole.
    pub output: Option<TermName>,
}

impl Default for Facts {
    /// The paper's fragment program, with every map, of a mesh that does not move; exact.
    fn default() -> Self {
        let one_size = MapFacts {
            color: true,
            normal: true,
            specular: true,
            attenuator: true,
            color_specular: true,
            normal_attenuator: true,
        };
        Self {
            setup: Setup {
                form: Form::Corrected,
                silhouette: Silhouette::Fragment,
                effects: Effects::SURFACE,
            },
            source: Source::Raster,
            maps: one_size,
            faces: FaceSizes::default(),
            morphs: 0,
            bones: false,
            turned: false,
            square_rim: false,
            f16: false,
            tessellation: 0.0,
            budget: Budget::Exact,
            output: None,
        }
    }
}

impl Facts {
    /// Of a scene at `params`, within `budget`, on an adapter with or without 16-bit arithmetic.
    #[must_use]
    pub fn of_scene(scene: &Scene, params: &Params, budget: Budget, f16: bool) -> Self {
        let Scene { form, silhouette, effects, maps, mesh, .. } = scene;
        let same = |a: Option<(usize, usize)>, b: Option<(usize, usize)>| a.is_some() && a == b;
        let color = maps.color.as_ref().map(|map| (map.width, map.height));
        let normal = maps.normal.as_ref().map(|map| (map.width, map.height));
        let specular = maps.specular.as_ref().map(|map| (map.width, map.height));
        let attenuator = maps.attenuator.as_ref().map(|map| (map.width, map.height));
        Self {
            setup: Setup { form: *form, silhouette: *silhouette, effects: *effects },
            source: Source::Raster,
            maps: MapFacts {
                color: color.is_some(),
                normal: normal.is_some(),
                specular: specular.is_some(),
                attenuator: attenuator.is_some(),
                color_specular: same(color, specular),
                normal_attenuator: same(normal, attenuator),
            },
            faces: FaceSizes::default(),
            morphs: mesh.morphs.iter().filter(|morph| morph.weight != 0.0).count() as u32,
            bones: !mesh.bones.is_empty() && !mesh.joints.is_empty(),
            turned: params.scalar(Param::EnvironmentRotation) != 0.0,
            square_rim: params.scalar(Param::RimExponent) == 2.0,
            f16,
            tessellation: tessellation_error(scene),
            budget,
            output: None,
        }
    }

    /// What the enabled effects ask for.
    #[must_use]
    pub fn needs(&self) -> Needs {
        self.setup.effects.needs(self.setup.silhouette)
    }

    /// Whether a condition of a rule's `when` line holds; `None` for one that is not known.
    #[must_use]
    pub fn holds(&self, condition: &str) -> Option<bool> {
        if let Some(condition) = condition.strip_prefix('!') {
            return self.holds(condition).map(|holds| !holds);
        }
        let setup = self.setup;
        if let Some(effect) = Effect::from_name(condition) {
            return Some(setup.effects.has(effect));
        }
        if let Some(form) = Form::ALL.into_iter().find(|form| form.name() == condition) {
            return Some(setup.form == form);
        }
        let silhouette = condition.strip_suffix("_silhouette");
        if let Some(at) = silhouette.and_then(|name| Silhouette::ALL.into_iter().find(|s| s.name() == name)) {
            return Some(setup.silhouette == at);
        }
        Some(match condition {
            "raster" => self.source == Source::Raster,
            "terms" => self.source == Source::Terms,
            "bumped" => self.bumped(),
            "has_color_map" => self.maps.color,
            "has_normal_map" => self.maps.normal,
            "has_specular_map" => self.maps.specular,
            "has_attenuator_map" => self.maps.attenuator,
            "color_specular_one_size" => self.maps.color_specular,
            "normal_attenuator_one_size" => self.maps.normal_attenuator,
            "morphs" => self.morphs > 0,
            "bones" => self.bones,
            "turned" => self.turned,
            "square_rim" => self.square_rim,
            "f16" => self.f16,
            _ => return None,
        })
    }

    /// Whether the shading normal has a part along T and B. Of a missing map, the listing still reads
    /// its neutral value, which it does not decode.
    fn bumped(&self) -> bool {
        let normal_map = self.needs().normal_map;
        normal_map && (self.source != Source::Raster || self.maps.normal || self.setup.form == Form::Listing)
    }
}

/// The 99th percentile over a mesh's triangles of how far an interpolated 1 - |N.V| is off: where the
/// normals of a triangle differ by an angle a, a cosine between two vertices sags by up to a^2 / 8.
#[must_use]
pub fn tessellation_error(scene: &Scene) -> f64 {
    let normals = &scene.mesh.normals;
    let sag = |a: u32, b: u32| {
        let (a, b) = (normals[a as usize].as_dvec3(), normals[b as usize].as_dvec3());
        let angle = a.cross(b).length().atan2(a.dot(b));
        angle * angle / 8.0
    };
    let mut sags: Vec<f64> =
        scene.mesh.triangles.iter().map(|&[a, b, c]| sag(a, b).max(sag(b, c)).max(sag(c, a))).collect();
    if sags.is_empty() {
        return 0.0;
    }
    let at = (sags.len() - 1) * 99 / 100;
    *sags.select_nth_unstable_by(at, f64::total_cmp).1
}

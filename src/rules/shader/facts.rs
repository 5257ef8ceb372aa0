//! What a scene calls for: the input of the planner.

use crate::model::choices::{Bounces, Choices, SkinReflection, SpecularVisibility, Visibility};
use crate::model::dapple::Dapple;
use crate::model::diffusion::Lookup;
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::fields::{Field, Fields};
use crate::model::needs::Needs;
use crate::model::params::{Param, Params};
use crate::model::shadow_filter::ShadowFilter;
use crate::model::terms::TermName;
use crate::model::texture_filter::TextureFilter;
use crate::model::transmission;
use crate::shader::domain::{ATLAS_UV, UV, Work};
use crate::shader::quantity::Resource;
use crate::shader::term::library;

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
    /// Stored terms: each light's before its weight, S.z and S.x. That is all that shading reads where
    /// nothing changes that needs a lookup.
    Terms,
}

/// Which maps a scene has, which are of one size, and how they are filtered.
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
    /// How they are filtered.
    pub filter: TextureFilter,
    /// Fields of files of rules that have a map.
    pub own: Fields,
}

/// Texels along a side of the cubes' faces, where they are known when the shader is written: they stand in its text
/// then. A shader that asks the texture in every lookup takes a tenth longer over a fit's pass (on an H200).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub struct FaceSizes {
    /// Of the irradiance E_d.
    pub irradiance: Option<usize>,
    /// Of the specular cubes E_s, at every exponent.
    pub specular: Option<usize>,
    /// Of the hilite cube E_h.
    pub hilite: Option<usize>,
    /// Of the rough reflection's cubes E_r, at every roughness.
    pub reflected: Option<usize>,
}

impl FaceSizes {
    /// Of a resource's faces.
    #[must_use]
    pub const fn of(&self, resource: Resource) -> Option<usize> {
        match resource.sized_as() {
            Resource::IrradianceFaces => self.irradiance,
            Resource::SpecularFaces => self.specular,
            Resource::HiliteFaces => self.hilite,
            Resource::ReflectedFaces => self.reflected,
            _ => None,
        }
    }
}

/// Whether the skin throws light back at itself.
fn gathers(setup: &Setup) -> bool {
    library::sees_sky(setup.effects) && setup.choices.bounces == Bounces::Gathered
}

/// Whether the skin shows in its own specular lobe.
#[must_use]
pub fn reflects_skin(setup: &Setup) -> bool {
    gathers(setup)
        && setup.choices.skin_reflection == SkinReflection::Gathered
        && library::reflects(setup.effects)
}

/// Shadow maps that fragments compare themselves with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShadowFacts {
    /// How they are compared.
    pub filter: ShadowFilter,
    /// Comparisons a fragment and light, where the filter takes several.
    pub taps: u32,
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
    /// Texels along a side of the UV atlas; without one nothing is computed in texels. Of stored samples it only counts
    /// whether there is one.
    pub atlas: Option<u32>,
    /// Whether the mesh lies in it by other texture coordinates than the maps'. Stored samples hold no others, and do not
    /// count it.
    pub own_atlas_uvs: bool,
    /// Whether texels are stored beside samples: what was found there stays while a fit moves what it was found with.
    pub stored_texels: bool,
    /// Shadow maps, where lights have them.
    pub shadows: Option<ShadowFacts>,
    /// How often each domain is evaluated.
    pub work: Work,
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
            filter: TextureFilter::Bilinear,
            own: Fields::NONE,
        };
        Self {
            setup: Setup::new(Form::Corrected, Silhouette::Fragment, Effects::SURFACE),
            source: Source::Raster,
            maps: one_size,
            faces: FaceSizes::default(),
            morphs: 0,
            bones: false,
            turned: false,
            square_rim: false,
            f16: false,
            tessellation: 0.0,
            atlas: None,
            own_atlas_uvs: false,
            stored_texels: false,
            shadows: None,
            work: Work::default(),
            budget: Budget::Exact,
            output: None,
        }
    }
}

impl Facts {
    /// What stored samples call for, whatever maps they were made with; `turned`: whether the environment is, or will be.
    /// Beside them stand stored texels, where an effect is computed there.
    #[must_use]
    pub fn of_samples(setup: Setup, faces: FaceSizes, turned: bool) -> Self {
        // How many texels there are is told by the texels themselves.
        let atlas = setup.needs().atlas.then_some(1);
        let (source, maps) = (Source::Samples, MapFacts::default());
        Self { setup, source, maps, faces, turned, atlas, ..Self::default() }
    }

    /// The same at other constants; all else that is known of a scene stays.
    #[must_use]
    pub fn at(self, params: &Params) -> Self {
        Self {
            turned: params.scalar(Param::EnvironmentRotation) != 0.0,
            square_rim: params.scalar(Param::RimExponent) == 2.0,
            ..self
        }
    }

    /// What rules of texels are chosen by: stored texels have been rasterised, and hold what the maps give.
    pub(super) fn of_texels(&self) -> Self {
        match self.source {
            Source::Raster => *self,
            Source::Samples | Source::Terms => {
                Self { source: Source::Raster, stored_texels: true, maps: Self::default().maps, ..*self }
            }
        }
    }

    /// What the enabled effects ask for.
    #[must_use]
    pub fn needs(&self) -> Needs {
        self.setup.needs()
    }

    /// Conditions of a rule's `when` line that are neither effects nor forms.
    pub const CONDITIONS: [&'static str; 37] = [
        "layered",
        "lights_bounce",
        "traced_lobe",
        "turning_sky",
        "skin_reflected",
        "vertex_silhouette",
        "fragment_silhouette",
        "bumped_silhouette",
        "raster",
        "terms",
        "bumped",
        "smooth_lookups",
        "dapple_ahead",
        "dapple_turned",
        "interpolated_rim",
        "has_color_map",
        "has_normal_map",
        "has_specular_map",
        "has_attenuator_map",
        "color_specular_one_size",
        "normal_attenuator_one_size",
        "bilinear",
        "trilinear",
        "anisotropic",
        "morphs",
        "bones",
        "turned",
        "square_rim",
        "f16",
        "atlas",
        "own_atlas_uvs",
        "shadow_maps",
        "shadow_hardware",
        "shadow_pcf",
        "shadow_pcss",
        "translucent_maps",
        "gathered_through",
    ];

    /// Whether a condition of a rule's `when` line holds; `None` for one that is not known.
    #[must_use]
    pub fn holds(&self, condition: &str) -> Option<bool> {
        if let Some(condition) = condition.strip_prefix('!') {
            return self.holds(condition).map(|holds| !holds);
        }
        let setup = self.setup;
        if let Some(form) = Form::ALL.into_iter().find(|form| form.name() == condition) {
            return Some(setup.form == form);
        }
        let silhouette = condition.strip_suffix("_silhouette");
        if let Some(at) = silhouette.and_then(|name| Silhouette::ALL.into_iter().find(|s| s.name() == name)) {
            return Some(setup.silhouette == at);
        }
        if let Some(holds) = setup.choices.holds(condition) {
            return Some(holds);
        }
        Some(match condition {
            "layered" => setup.effects.share_light(),
            "lights_bounce" => gathers(&setup),
            "gathered_through" => self.gathers_through(),
            "raster" => self.source == Source::Raster,
            "traced_lobe" => self.traces_lobes(),
            "turning_sky" => self.turns_sky(),
            "skin_reflected" => reflects_skin(&setup) && !self.traces_lobes(),
            "terms" => self.source == Source::Terms,
            "bumped" => self.bumped(),
            "smooth_lookups" => self.setup.smooth_lookups(),
            "interpolated_rim" => self.setup.rim_of_corners(),
            "dapple_ahead" => self.setup.dapple.axis() == Dapple::LEAVES_AHEAD.axis(),
            "has_color_map" => self.maps.color,
            "has_normal_map" => self.maps.normal,
            "has_specular_map" => self.maps.specular,
            "has_attenuator_map" => self.maps.attenuator,
            "color_specular_one_size" => self.maps.color_specular,
            "normal_attenuator_one_size" => self.maps.normal_attenuator,
            "bilinear" => self.maps.filter == TextureFilter::Bilinear,
            "trilinear" => self.maps.filter == TextureFilter::Trilinear,
            "anisotropic" => self.maps.filter == TextureFilter::Anisotropic,
            "morphs" => self.morphs > 0,
            "bones" => self.bones,
            "dapple_turned" => self.turned && !self.setup.dapple.is_in_world(),
            "turned" => self.turned,
            "square_rim" => self.square_rim,
            "f16" => self.f16,
            "shadow_maps" => self.shadow_filter().is_some(),
            "shadow_hardware" => self.shadow_filter() == Some(ShadowFilter::Hardware),
            "shadow_pcf" => self.shadow_filter() == Some(ShadowFilter::Pcf),
            "shadow_pcss" => self.shadow_filter() == Some(ShadowFilter::Pcss),
            "translucent_maps" => self.maps_depth(),
            own if own.starts_with("has_") && own.ends_with("_map") => {
                let field = own.strip_prefix("has_").and_then(|own| own.strip_suffix("_map"));
                return field.and_then(Field::from_name).map(|field| self.maps.own.has(field));
            }
            "own_atlas_uvs" => self.own_atlas_uvs && self.source == Source::Raster,
            "atlas" => self.source != Source::Terms && self.atlas.is_some_and(|size| size > 0),
            // Last, as many may have been added.
            effect => return Effect::from_name(effect).map(|effect| setup.effects.has(effect)),
        })
    }

    /// The texture coordinates, by their name in rules, by which the mesh lies in the UV atlas.
    #[must_use]
    pub fn atlas_uv(&self) -> &'static str {
        if self.holds("own_atlas_uvs") == Some(true) { ATLAS_UV } else { UV }
    }

    /// How shadow maps are compared, where there are any.
    fn shadow_filter(&self) -> Option<ShadowFilter> {
        let mapped = |shadows: &ShadowFacts| shadows.filter != ShadowFilter::Vertices;
        self.shadows.filter(mapped).map(|shadows| shadows.filter)
    }

    /// Whether fragments look levels of the atlas up by one fetch, for which passes fill empty texels. Of stored samples the
    /// processor looks them up, and fills what it finds empty.
    #[must_use]
    pub fn dilates(&self) -> bool {
        self.source == Source::Raster && self.setup.choices.diffusion.lookup == Lookup::Dilated
    }

    /// Whether shadow maps tell how far light travels inside.
    fn maps_depth(&self) -> bool {
        let wanted = self.setup.choices.transmission.method == transmission::Method::ShadowMaps;
        wanted && self.source == Source::Raster && self.shadow_filter().is_some()
    }

    /// Whether what comes through is gathered by rays inward.
    fn gathers_through(&self) -> bool {
        self.setup.choices.transmission.method == transmission::Method::Gathered
    }

    /// Whether what vertices found of the sky moves as a fit turns it. A rasteriser has it found anew.
    fn turns_sky(&self) -> bool {
        let Choices { turning, visibility, .. } = self.setup.choices;
        let stored = self.source != Source::Raster || self.stored_texels;
        turning && visibility != Visibility::Rays && stored
    }

    /// Whether light of the specular lobe is that along rays into it: a rasteriser has none.
    fn traces_lobes(&self) -> bool {
        self.setup.choices.specular_visibility == SpecularVisibility::Rays && self.source != Source::Raster
    }

    /// Whether the shading normal has a part along T and B. Of a missing map, the listing still reads
    /// its neutral value, which it does not decode.
    fn bumped(&self) -> bool {
        self.setup.bumps()
            && (self.source != Source::Raster || self.maps.normal || self.setup.form == Form::Listing)
    }
}

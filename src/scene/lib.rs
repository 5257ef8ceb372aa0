//! Everything that is read: scene files, meshes, maps, environments, cameras, targets.
//!
//! - [`mesh`]: the mesh as loaded, and posed; [`plain`]: what of it is not skin
//! - [`view`]: cameras and targets; [`lens`]: what bends their images
//! - [`maps`]: texture maps and the panorama, and `map_files` that they are read of; `skin_material`: those of the mesh file;
//!   [`map_layout`]: maps beyond their borders; [`mip_maps`]: their coarser levels
//! - [`light`]: lights beside it, and the irradiance that they bring
//! - [`load`]: a scene file and everything that it names; its tables are in `file`, their meaning in
//!   `settings`, `cameras`, `lights` and `dapple`, within the bounds of `numbers`
//! - [`shadow_maps`]: how the renderer finds shadows
//! - [`sky_lights`]: the panorama's brightest spots as lights; `lit`: the effect that each light is
//! - [`diffusion`], `transmission`: how light is found that wanders within the skin, and that comes through it
//! - `terms`: files of shader rules that a scene brings with it
//! - [`map_fit`]: how whole maps are fitted; [`assignment`]: a parameter's value, as a command line gives it
//! - [`names`]: what a scene is called among several; `offers`: what it has for effects that may be off
//! - [`images`], `gltf`: image and mesh files; what those leave out is made in `normals` and `tangents`
//! - [`streams`]: numbers of vertices, as attributes of the mesh file
//! - [`inspect`]: what a mesh file holds, before there is a scene of it; [`draft`]: a first scene file for it
//! - [`import`]: cameras that other programs solved or placed
//! - [`facts`]: what a scene calls for of the shader planner
//! - [`animation`]: how the mesh is to be posed, and its animation; [`pose`]: morphing and skinning
//! - [`error`]: what is refused, and what is mended with a warning
//!
//! [`Scene`] is what the later stages see: validated, in memory, and holding only what the enabled
//! effects ask for.

pub mod animation;
pub mod assignment;
mod cameras;
pub mod charts;
mod dapple;
pub mod diffusion;
pub mod draft;
pub mod error;
pub mod facts;
mod file;
mod gltf;
pub mod images;
pub mod import;
pub mod inspect;
pub mod lens;
pub mod light;
mod lights;
mod lit;
pub mod load;
mod map_files;
pub mod map_fit;
pub mod map_layout;
pub mod maps;
pub mod mesh;
pub mod mip_maps;
pub mod names;
mod normals;
mod numbers;
mod offers;
pub mod plain;
pub mod pose;
mod settings;
pub mod shadow_maps;
mod skin_material;
pub mod sky_lights;
pub mod streams;
mod tangents;
mod terms;
mod transmission;
pub mod view;

pub use assignment::Assignment;
pub use error::{SceneError, Warning};
pub use file::suggestion;
pub use file::{Source, check_text};
pub use gltf::container;
pub use light::{Light, LightKind};
pub use lit::families as light_families;
pub use load::LoadOptions;
pub use load::check_values;
pub use map_fit::{MapKind, MapPrior, MapSettings, MapSolver};
pub use numbers::{digits, interval, short};
pub use offers::Offers;
pub use settings::check_bounds;
pub use shadow_maps::ShadowMaps;
pub use terms::register_terms;

use std::path::PathBuf;

use self::diffusion::Diffusion;
use skinfit_base::{files, progress};
use skinfit_rules::{model, shader};

use crate::model::bounds::Bounds;
use crate::model::choices::Choices;
use crate::model::dapple::Dapple;
use crate::model::effects::{Effects, Form, Lookups, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::needs::Needs;
use crate::model::params::{Column, Param, Params};
use crate::model::texture_filter::TextureFilter;
use crate::shader::facts::reflects_skin;

/// A scene that was read and checked.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The scene file, for messages and provenance.
    pub path: PathBuf,
    /// The mesh, not yet posed; targets and bones only when `morph` or `skin` is enabled.
    pub mesh: mesh::Mesh,
    /// Metres in one unit of the mesh.
    pub metres_per_unit: f64,
    /// The maps that the effects ask for.
    pub maps: maps::Maps,
    /// The environment; absent when no effect asks for it.
    pub environment: Option<maps::Environment>,
    /// The lights that the scene file and, where it says so, the mesh file name, in the world; those of the panorama
    /// are not among them.
    pub lights: Vec<Light>,
    /// Those that were taken out of the panorama, where the scene's own turn has them; `environment_rotation` turns them
    /// with it.
    pub sky_lights: Vec<Light>,
    /// Which reading of the listings.
    pub form: Form,
    /// Where S.z is evaluated.
    pub silhouette: Silhouette,
    /// Along which normal the cubes are looked up.
    pub lookups: Lookups,
    /// Where light falls through leaves from, before `environment_rotation`.
    pub dapple: Dapple,
    /// Which ways are taken where there are several.
    pub choices: Choices,
    /// What is switched on.
    pub effects: Effects,
    /// Start values.
    pub params: Params,
    /// The cameras, with their targets where the scene names them.
    pub views: Vec<view::View>,
    /// How the fit is to be done.
    pub fit: FitSettings,
    /// How finely bakes and samples are made.
    pub quality: Quality,
    /// How the renderer finds what stands in a light's way.
    pub shadow_maps: ShadowMaps,
    /// How far the bloom reaches.
    pub bloom: Bloom,
    /// How finely texels of the UV atlas are made, where an effect is computed there.
    pub diffusion: Diffusion,
}

impl Scene {
    /// Whether the skin shows in its own specular lobe.
    #[must_use]
    pub fn reflects_skin(&self) -> bool {
        reflects_skin(&self.setup())
    }

    /// What the CPU engine alone draws of the scene, in words; `None` where adapters draw all of it.
    #[must_use]
    pub fn cpu_alone(&self) -> Option<String> {
        // A rasteriser draws straight edges straight.
        let bent = self.views.iter().find(|view| view.camera.lens.distortion.is_some());
        bent.map(|view| {
            format!(
                "view \"{}\" has a lens that bends what is straight, which adapters do not draw",
                view.name
            )
        })
    }

    /// Why the CPU alone makes samples of the scene, in words; `None` where adapters make them, too.
    #[must_use]
    pub fn cpu_samples(&self) -> Option<String> {
        let parts = "the mesh has parts that are not skin, of which adapters make no samples";
        self.cpu_alone().or_else(|| self.mesh.plain.as_ref().map(|_| parts.to_owned()))
    }

    /// The switches of the model.
    #[must_use]
    pub fn setup(&self) -> Setup {
        let Self { form, silhouette, effects, lookups, dapple, .. } = *self;
        let rotation = Param::EnvironmentRotation;
        let turns = self.fit.free.iter().any(|column| column.param == rotation);
        let interpolated_rim = form == Form::Listing;
        let choices = Choices { glossy: self.is_glossy(), turning: turns, ..self.choices };
        Setup { form, silhouette, effects, lookups, dapple: dapple.turning(turns), interpolated_rim, choices }
    }

    /// Whether the specular map lowers the roughness, or will.
    fn is_glossy(&self) -> bool {
        Param::from_name("gloss").is_some_and(|gloss| {
            self.params.scalar(gloss) != 0.0 || self.fit.free.iter().any(|column| column.param == gloss)
        })
    }

    /// What its effects ask for.
    #[must_use]
    pub fn needs(&self) -> Needs {
        self.setup().needs()
    }

    /// Every light where `params` have it stand, those of the panorama turned with it.
    #[must_use]
    pub fn lights_at(&self, params: &Params) -> Vec<Light> {
        let rotation = params.scalar(Param::EnvironmentRotation);
        let of_sky = self.sky_lights.iter().map(|light| light.moved(params).turned(rotation));
        self.lights.iter().map(|light| light.moved(params)).chain(of_sky).collect()
    }
}

/// The scene's `[bloom]` table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bloom {
    /// The blur's standard deviation, as a share of the image's height.
    pub sigma: f64,
}

impl Default for Bloom {
    fn default() -> Self {
        // About the softness of the paper's pictures.
        Self { sigma: 0.02 }
    }
}

/// The scene's `[fit]` table.
#[derive(Clone, Debug, PartialEq)]
pub struct FitSettings {
    /// The unknowns: one tied column a parameter, or three when its start value has three channels
    /// or the scene's `per_channel` list names it.
    pub free: Vec<Column>,
    /// What they stay within, where that is less than the table's.
    pub bounds: Bounds,
    /// What is minimised.
    pub loss: Loss,
    /// Whether each view has a gain of its own (the first view's is held at 1).
    pub free_gains: bool,
    /// Whether each view has such a gain in each channel.
    pub white_balance: bool,
    /// Whether cameras are moved first to where the targets show the mesh.
    pub cameras: bool,
    /// How whole maps are fitted, when they are asked for.
    pub maps: MapSettings,
}

/// What a fit minimises, over the residual r = model - target of each pixel and channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Loss {
    /// r^2
    L2,
    /// About r^2 / (model + 0.1)^2, by reweighting: errors count in proportion, down to a tenth of unit radiance.
    #[default]
    RelativeL2,
    /// r^2 within 0.05, then linear (Huber): outliers count less.
    Huber,
    /// |r| / (|model| + |target| + 0.01), by reweighting.
    Smape,
}

impl Loss {
    /// Every loss, in the order of documentation.
    pub const ALL: [Self; 4] = [Self::L2, Self::RelativeL2, Self::Huber, Self::Smape];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::L2 => "l2",
            Self::RelativeL2 => "relative_l2",
            Self::Huber => "huber",
            Self::Smape => "smape",
        }
    }
}

/// The scene's `[quality]` table: accuracy against time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Quality {
    /// Samples along a pixel's side: n x n samples a pixel.
    pub samples_per_axis: u32,
    /// Texels along a face of the irradiance cube.
    pub irradiance_size: u32,
    /// Texels along a face of each specular cube.
    pub lobe_size: u32,
    /// Texels along a face of the hilite cube.
    pub hilite_size: u32,
    /// Specular cubes for each doubling of the exponent.
    pub lobes_per_octave: u32,
    /// Rays a vertex for ambient occlusion.
    pub occlusion_rays: u32,
    /// Rays a sample towards each light that has a size; those of a pixel's samples differ.
    pub shadow_rays: u32,
    /// Rays a sample over its hemisphere, where the sky that it sees is found by rays.
    pub sky_rays: u32,
    /// Rays a sample into the specular lobe, where its visibility is found by rays.
    pub lobe_rays: u32,
    /// How samples and fragments look texture maps up.
    pub texture_filter: TextureFilter,
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            samples_per_axis: 2,
            irradiance_size: 32,
            lobe_size: 64,
            hilite_size: 128,
            lobes_per_octave: 1,
            occlusion_rays: 256,
            shadow_rays: 1,
            sky_rays: 256,
            lobe_rays: 64,
            texture_filter: TextureFilter::Bilinear,
        }
    }
}

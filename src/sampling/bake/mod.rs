//! What is computed once for a scene: environment to cube maps, ambient occlusion, transfer vectors, and the cache
//! of all. Nothing is baked that no enabled effect asks for.
//!
//! - [`panorama`]: the lat-long lookup, and panorama to cube
//! - [`prefilter`]: the filter by lobes ([`radial`]: their weights, `pyramid`: the cells that it sums over,
//!   `lobe_kernel`: the sum)
//! - [`lobes`]: the stack of specular cubes over the exponent; [`reflected`]: over a BRDF's roughness
//! - [`stacks`]: which cube of which stack is looked up
//! - [`lobe_sky`]: as rays into a lobe look it up
//! - [`occlusion`]: per-vertex ambient occlusion (`vertex_rays`: its rays; `low_discrepancy`: their directions;
//!   `turning`: the frames that these are in)
//! - [`harmonics`]: spherical harmonics; [`coefficients`]: the environment's light by them
//! - [`transfer`]: which of that light arrives at each vertex, past the mesh ([`interreflection`]: and by way of it);
//!   [`shadowed`]: how much; [`sky`]: which of both a scene asks for
//! - [`thickness`]: how far below each vertex the mesh's far side lies; [`inward`]: the light that arrives there
//! - [`rays`]: the mesh as rays see it; `wide_bvh`: as many rays do, `packet` by packet; `cutouts`: where they go through
//! - `between`: bakes of poses between two
//! - [`cache`]: bakes kept between runs (`baker`: each bake through it; `gather_cache`: what vertices gather of one another)

mod baker;
mod between;
pub mod cache;
pub mod coefficients;
mod cutouts;
mod gather_cache;
pub mod harmonics;
pub mod interreflection;
pub mod inward;
mod lobe_kernel;
pub mod lobe_sky;
pub mod lobes;
pub(crate) mod low_discrepancy;
pub mod occlusion;
pub(crate) mod packet;
pub mod panorama;
pub mod prefilter;
mod pyramid;
pub mod radial;
pub mod rays;
pub mod reflected;
pub mod shadowed;
pub mod sky;
pub mod stacks;
pub mod thickness;
pub mod transfer;
mod turning;
pub(crate) mod vertex_rays;
pub(crate) mod wide_bvh;

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use crate::model::cube::Cube;
use crate::model::params::Param;
use crate::scene::Scene;
use crate::scene::maps::Environment;
use crate::scene::mesh::PosedMesh;
use crate::scene::sky_lights::sky_lights;
use crate::specular::SMOOTHEST;
use baker::{Baker, EnvironmentBaker};
use harmonics::Order;
pub use lobes::LobeStack;
pub use reflected::ReflectedStack;
pub use sky::{SkyBake, SkyLight};
use stacks::Stack;
use thickness::THICKNESS;
pub use thickness::VertexThickness;
use transfer::VertexTransfer;

/// Everything that was baked for a scene.
#[derive(Clone, Debug, Default)]
pub struct Bake {
    /// The environment's light.
    pub illumination: Illumination,
    /// Ambient occlusion of each vertex.
    pub occlusion: Option<VertexOcclusion>,
    /// The sky that each vertex sees.
    pub sky: Option<SkyBake>,
    /// How thick the mesh is below each vertex.
    pub thickness: Option<VertexThickness>,
}

/// What is baked of one pose of a mesh, for that pose alone.
#[derive(Clone, Debug, Default)]
pub struct PoseBake {
    /// Ambient occlusion of each vertex.
    pub occlusion: Option<VertexOcclusion>,
    /// The sky that each vertex sees.
    pub sky: Option<SkyBake>,
    /// How thick the mesh is below each vertex.
    pub thickness: Option<VertexThickness>,
}

/// The environment's light: the cubes that the enabled effects ask for.
#[derive(Clone, Debug, Default)]
pub struct Illumination {
    /// E_d: the cosine-weighted mean of the incoming light (alpha: its luminance, unused).
    pub irradiance: Option<Cube<f32>>,
    /// E_s for a stack of exponents.
    pub lobes: Option<LobeStack>,
    /// E_h: the environment, lightly filtered for its resolution (alpha: its luminance, unused).
    pub hilite: Option<Cube<f32>>,
    /// E_r for a stack of roughnesses.
    pub reflected: Option<ReflectedStack>,
}

/// The open share of the hemisphere, 1 = unoccluded.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexOcclusion {
    /// At rest, one a vertex.
    pub base: Vec<f32>,
    /// What each morph target at weight 1 adds, as many as the mesh has targets; empty for one that
    /// neither the scene nor its animation gives a weight.
    pub morphs: Vec<Vec<f32>>,
}

impl VertexOcclusion {
    /// The occlusion with the morph targets at `weights` (listing 3-3: not clamped, the model takes
    /// it as it is); targets beyond the list count nothing.
    #[must_use]
    pub fn posed(&self, weights: &[f32]) -> Vec<f32> {
        let mut open = self.base.clone();
        for (delta, &weight) in self.morphs.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            open.iter_mut().zip(delta).for_each(|(open, delta)| *open += weight * delta);
        }
        open
    }
}

/// What was baked, and what came from the cache.
#[derive(Clone, Debug, Default)]
pub struct BakeStats {
    /// A row for each bake, in the order in which they were made.
    pub rows: Vec<BakeRow>,
    /// Cache files that were damaged or could not be written; light that is not fit for what is asked of it.
    pub warnings: Vec<String>,
}

/// One bake.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeRow {
    /// `irradiance`, `lobe 32`, `kelemen 0.3536`, `hilite`, `occlusion`, `transfer`, `thickness`; `environment` for what these share.
    pub name: String,
    /// Whether it came from the cache.
    pub cached: bool,
    /// Seconds that it took.
    pub seconds: f64,
}

impl BakeStats {
    /// Seconds altogether.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.rows.iter().map(|row| row.seconds).sum()
    }

    fn row(&mut self, name: impl Into<String>, cached: bool, seconds: f64) {
        self.rows.push(BakeRow { name: name.into(), cached, seconds });
    }
}

/// A scene that cannot be baked.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// An effect looks up cubes, but there is nothing to make them of.
    #[error(
        "{scene}: the enabled effects look up the environment, but the scene has none. Add \
         [environment] file = \"...\", or leave out diffuse, side_specular, hilite and reflection."
    )]
    NoEnvironment {
        /// The scene file.
        scene: String,
    },
    /// The panorama has no texels, or not as many as its size says.
    #[error(
        "{scene}: the environment's panorama has {texels} texels, not {width} x {height}. Give a \
         lat-long image of at least 1 x 1 texels."
    )]
    BadPanorama {
        /// The scene file.
        scene: String,
        /// Texels that are there.
        texels: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A cube of no texels.
    #[error("{scene}: [quality] {key} is 0. Give the number of texels along a cube's face, 1 or more.")]
    NoTexels {
        /// The scene file.
        scene: String,
        /// The key.
        key: &'static str,
    },
}

/// The morph targets that the scene or its animation gives a weight.
fn used_morphs(scene: &Scene) -> Vec<usize> {
    let morphs = &scene.mesh.morphs;
    (0..morphs.len()).filter(|&i| morphs[i].weight != 0.0 || morphs[i].animated).collect()
}

/// All targets' weights from those of the `used` ones.
fn all_weights(scene: &Scene, used: &[usize], weights: &[f32]) -> Vec<f32> {
    let mut all = vec![0.0; scene.mesh.morphs.len()];
    used.iter().zip(weights).for_each(|(&target, &weight)| all[target] = weight);
    all
}

/// A set for each morph target from those of the `used` ones; the others' are empty.
fn all_sets<T: Clone + Default>(scene: &Scene, used: &[usize], baked: Vec<T>) -> Vec<T> {
    let mut sets = vec![T::default(); scene.mesh.morphs.len()];
    used.iter().zip(baked).for_each(|(&target, set)| sets[target] = set);
    sets
}

/// The poses that `pose` gives, which know where the scene's mesh is at rest: rays are drawn by that.
fn resting(
    scene: &Scene,
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
) -> impl Fn(&[f32]) -> PosedMesh + Sync {
    let rest = Arc::new(scene.mesh.rest());
    move |weights| PosedMesh { rest: Some(Arc::clone(&rest)), ..pose(weights) }
}

/// Ambient occlusion, with a set for each of the morph targets `used`.
fn occlusion_of_used(
    scene: &Scene,
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    used: &[usize],
    baker: &mut Baker<'_>,
) -> VertexOcclusion {
    let pose_used = |weights: &[f32]| pose(&all_weights(scene, used, weights));
    let baked = baker.occlusion(&pose_used, used.len(), scene.quality.occlusion_rays);
    VertexOcclusion { base: baked.base, morphs: all_sets(scene, used, baked.morphs) }
}

/// Transfer vectors of the scene's mesh, with a set for each morph target that the scene or its animation gives a
/// weight, by as many rays a vertex as occlusion takes. With `bounces` also those of the light that the mesh throws
/// back, for which `pose` has to give texture coordinates where there is a colour map.
///
/// The bake is looked for and kept in the folder `cache`.
#[must_use]
pub fn bake_scene_transfer(
    scene: &Scene,
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    order: Order,
    bounces: bool,
    cache: Option<&Path>,
) -> (VertexTransfer, BakeStats) {
    let mut baker = Baker { cache, stats: BakeStats::default() };
    let pose = &resting(scene, pose);
    (sky::transfer_of_used(scene, pose, &used_morphs(scene), order, bounces, &mut baker), baker.stats)
}

/// Where stacks of cubes will be looked up: at one place each, unless a fit moves it.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranges {
    /// Exponents of E_s.
    pub exponents: RangeInclusive<f64>,
    /// Roughnesses of E_r.
    pub roughnesses: RangeInclusive<f64>,
}

impl Ranges {
    /// Those of a scene as it stands; with `fit` all that its free parameters may reach.
    #[must_use]
    pub fn of(scene: &Scene, fit: bool) -> Self {
        let free = |name: &str| fit && scene.fit.free.iter().any(|column| column.param.name() == name);
        let [exponent, rough, glossy] = Stack::ALL.map(|stack| stack.place(&scene.params));
        let (lower, upper) = scene.fit.bounds.of(Param::SpecularLobe);
        let exponents = if free(Param::SpecularLobe.name()) {
            lower.min(exponent)..=upper.max(exponent)
        } else {
            exponent..=exponent
        };
        let widest = match Param::from_identifier("roughness") {
            Some(roughness) if free("roughness") => scene.fit.bounds.of(roughness).1.max(rough),
            _ => rough,
        };
        let sharpest = match scene.setup().choices.glossy {
            _ if free("roughness") || free("gloss") => SMOOTHEST,
            true => glossy,
            false => rough,
        };
        Self { exponents, roughnesses: sharpest..=widest }
    }
}

/// Bake what the scene's effects ask for, and no more.
///
/// `pose` gives the scene's mesh with its morph targets at the listed weights. Of the stacks of
/// cubes, those are made that are needed within `ranges`. Bakes are looked for and kept in the folder `cache`.
///
/// # Errors
/// When the scene lacks what its effects ask for. A cache that cannot be used is a warning in the
/// stats, not an error.
pub fn bake(
    scene: &Scene,
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    ranges: &Ranges,
    cache: Option<&Path>,
) -> Result<(Bake, BakeStats), BakeError> {
    let (illumination, stats) = bake_light(scene, ranges, cache)?;
    let mut baker = Baker { cache, stats };
    let used = used_morphs(scene);
    let surface = surface(scene, pose, &used, SkyLight::of_scene, &mut baker);
    let PoseBake { occlusion, sky, thickness } = surface;
    baker.stats.warnings.extend(sky.as_ref().and_then(|sky| sky::ringing(scene, sky)));
    Ok((Bake { illumination, occlusion, sky, thickness }, baker.stats))
}

/// What is baked of a scene's mesh, with a set for each of the morph targets `used`; `light` gives the environment's,
/// where it is asked for.
fn surface(
    scene: &Scene,
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    used: &[usize],
    light: impl FnOnce(&Scene) -> Option<SkyLight>,
    baker: &mut Baker<'_>,
) -> PoseBake {
    let pose = &resting(scene, pose);
    let sky = sky::Wanted::of(scene).map(|wanted| SkyBake {
        transfer: sky::transfer_of_used(scene, pose, used, wanted.order, wanted.bounces, baker),
        light: wanted.light.then(|| light(scene)).flatten(),
    });
    // The open share is the transfer's first number, so rays are cast once.
    let occlusion = scene.needs().occlusion.then(|| match &sky {
        Some(sky) => sky.transfer.occlusion(),
        None => occlusion_of_used(scene, pose, used, baker),
    });
    let thick = scene.needs().fields.named(THICKNESS).is_some();
    let thickness = thick.then(|| {
        let pose_used = |weights: &[f32]| pose(&all_weights(scene, used, weights));
        let baked = baker.thickness(&pose_used, used.len());
        VertexThickness { base: baked.base, morphs: all_sets(scene, used, baked.morphs) }
    });
    PoseBake { occlusion, sky, thickness }
}

/// The environment's part of [`bake`].
///
/// # Errors
/// As of [`bake`].
pub fn bake_light(
    scene: &Scene,
    ranges: &Ranges,
    cache: Option<&Path>,
) -> Result<(Illumination, BakeStats), BakeError> {
    let needs = scene.needs();
    let mut baker = Baker { cache, stats: BakeStats::default() };
    let mut light = Illumination::default();
    if needs.environment() {
        let whole = checked_environment(scene)?;
        // What became lights shines as such, with shadows.
        let rest = (!scene.sky_lights.is_empty()).then(|| sky_lights(whole).rest);
        let mut cubes = EnvironmentBaker::new(rest.as_ref().unwrap_or(whole));
        let quality = &scene.quality;
        if needs.irradiance {
            let size = quality.irradiance_size as usize;
            light.irradiance = Some(cubes.lobe(&mut baker, "irradiance".to_owned(), size, 1.0));
        }
        if needs.lobes {
            let exponents = lobes::knots(&ranges.exponents, quality.lobes_per_octave);
            let size = quality.lobe_size as usize;
            let cube = |&e: &f64| cubes.lobe(&mut baker, format!("lobe {e:.4}"), size, e);
            let stack = exponents.iter().map(cube).collect();
            light.lobes = Some(LobeStack { exponents, cubes: stack });
        }
        if needs.hilite {
            light.hilite = Some(cubes.hilite(&mut baker, quality.hilite_size as usize));
        }
        if needs.reflected {
            let (model, size) = (scene.choices.specular_model, quality.lobe_size as usize);
            let cube = |m: f64| cubes.reflected(&mut baker, model, size, m);
            let stack = ReflectedStack::new(model, &ranges.roughnesses, quality.lobes_per_octave, cube);
            light.reflected = Some(stack);
        }
    }
    Ok((light, baker.stats))
}

/// What the scene's effects ask for of one pose of its mesh, morphed and skinned, for that pose alone: what an animation
/// has per frame where sums over morph targets are not enough. `light` is the environment's, where it is known already.
/// Kept in the folder `cache` too.
#[must_use]
pub fn bake_pose(
    scene: &Scene,
    posed: &PosedMesh,
    light: Option<&SkyLight>,
    cache: Option<&Path>,
) -> (PoseBake, BakeStats) {
    let mut baker = Baker { cache, stats: BakeStats::default() };
    // Of a pose no target is used: it is the mesh.
    let known = |scene: &Scene| light.cloned().or_else(|| SkyLight::of_scene(scene));
    let baked = surface(scene, &|_| posed.clone(), &[], known, &mut baker);
    // Whoever knows the light was told before.
    let told = baked.sky.as_ref().filter(|_| light.is_none());
    baker.stats.warnings.extend(told.and_then(|sky| sky::ringing(scene, sky)));
    (baked, baker.stats)
}

fn checked_environment(scene: &Scene) -> Result<&Environment, BakeError> {
    let name = || scene.path.display().to_string();
    let environment = scene.environment.as_ref().ok_or_else(|| BakeError::NoEnvironment { scene: name() })?;
    let map = &environment.panorama;
    let texels = map.texels.len();
    if texels == 0 || texels != map.width * map.height {
        let (width, height) = (map.width, map.height);
        return Err(BakeError::BadPanorama { scene: name(), texels, width, height });
    }
    let quality = &scene.quality;
    for (key, size) in [
        ("irradiance_size", quality.irradiance_size),
        ("lobe_size", quality.lobe_size),
        ("hilite_size", quality.hilite_size),
    ] {
        if size == 0 {
            return Err(BakeError::NoTexels { scene: name(), key });
        }
    }
    Ok(environment)
}

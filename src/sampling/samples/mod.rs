//! The visible surface of each view, as records that the engine streams through.
//!
//! Pixels are taken [`LANES`] at a time: a *group*. A group has as many *records* as the most
//! densely covered of its pixels has samples; record r of lane l is the r-th sample of that lane's
//! pixel, or padding of weight 0. A sample's slot is `record * LANES + lane`, a pixel's
//! `group * LANES + lane`. Groups with equally many records stand together, so that silhouettes (few
//! samples) cost no padding inside.
//!
//! - `trace`: primary rays, and what they hit (`hit`); `raster`: the same of a pinhole and skin alone, triangle by triangle
//! - `posed`: the mesh in a pose with what is baked of it; `supply`: what finds fields of samples, `lit`: what reaches
//!   them of lights, `bounced`: what the skin throws back of these, `sky`: what they see of the sky, `sky_rays`: by
//!   rays; `lit_mesh`: the mesh as a source of light, `skin`: what it sees of itself; `surface`: frames, silhouette and
//!   maps at a hit; `footprint`: how much of a map a sample covers; `lobe`: rays into a specular lobe there,
//!   `lobe_light`: the light that they bring; `through`: what comes through the mesh, `far_light`: as
//!   rays inside gather it
//! - `group`: samples packed into groups
//! - `plain`: what is not skin, as pictures show it; [`plain_spread`]: what reaches places on it, for a rasteriser
//! - [`covered`]: the same groups of samples that a rasteriser found
//! - [`rows`]: sixteen numbers side by side, the unit of all that is streamed
//! - [`surface_records`]: what the model reads of each sample, in rows
//! - [`targets`]: what each pixel of a target asks
//! - [`visibility`]: how much of a light reaches a place of the mesh
//! - [`atlas`]: texels of the UV atlas, samples of the mesh as well; [`along`]: along one of its axes; `texel_cover`: which
//!   are covered;
//!   `texel_fields`: what they hold; `texel_error`: why there are none; `dilation`: empty ones that are filled;
//!   `seams`: what lies beyond the borders of its charts

pub mod along;
pub mod atlas;
mod bounced;
pub mod covered;
mod dilation;
mod far_light;
mod footprint;
mod group;
mod hit;
mod lit;
mod lit_mesh;
mod lobe;
mod lobe_light;
mod plain;
pub mod plain_spread;
mod posed;
mod raster;
pub mod rows;
mod seams;
mod skin;
mod sky;
mod sky_rays;
mod supply;
mod surface;
pub mod surface_records;
pub mod targets;
mod texel_cover;
mod texel_error;
mod texel_fields;
mod through;
mod trace;
pub mod visibility;

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use crate::bake::VertexOcclusion;
use crate::bake::rays::RayMesh;
use crate::progress;
use crate::scene::mesh::{Morph, PosedMesh};
use crate::scene::view::{Camera, View};
use crate::scene::{Scene, digits};
pub use atlas::Atlas;
pub use bounced::gather_of;
pub use dilation::Dilation;
pub use group::z_order;
pub use plain::PlainPixel;
pub use posed::{PosedSurface, SurfaceBakes};
pub use surface_records::SurfaceRecords;
pub use targets::TargetRows;
pub use trace::{Hit, hit_at};

/// Pixels in a group: the widest vector of 32-bit floats on today's processors.
pub const LANES: usize = 16;

/// The visible surface of one view.
#[derive(Clone, Debug, Default)]
pub struct ViewSamples {
    /// Where each group's records start, and the end of the last: `groups + 1` entries.
    pub group_start: Vec<u32>,
    /// For each pixel slot: the pixel's index in the image (row by row), or `u32::MAX` for padding.
    pub pixel: Vec<u32>,
    /// For each pixel slot: the covered share of the pixel's area.
    pub coverage: Vec<f32>,
    /// What the model reads of each sample, and its share of the pixel's covered area; the shares of
    /// a pixel's samples sum to 1.
    pub surface: SurfaceRecords,
    /// The texels of the mesh that an effect is computed in; views of one pose share them.
    pub atlas: Option<Arc<Atlas>>,
    /// The parts of pixels that show what is not skin.
    pub plain: Vec<PlainPixel>,
}

impl ViewSamples {
    /// How many groups of [`LANES`] pixels there are.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.group_start.len().saturating_sub(1)
    }

    /// How many records of [`LANES`] samples there are.
    #[must_use]
    pub fn records(&self) -> usize {
        self.group_start.last().map_or(0, |&end| end as usize)
    }

    /// A range of its groups, as a view of their own.
    #[must_use]
    pub fn part(&self, groups: Range<usize>) -> Self {
        let starts = &self.group_start[groups.start..=groups.end];
        let first = starts[0];
        let pixels = groups.start * LANES..groups.end * LANES;
        Self {
            group_start: starts.iter().map(|start| start - first).collect(),
            pixel: self.pixel[pixels.clone()].to_vec(),
            coverage: self.coverage[pixels].to_vec(),
            surface: self.surface.part(first as usize..starts[starts.len() - 1] as usize),
            atlas: self.atlas.clone(),
            plain: Vec::new(),
        }
    }

    /// Samples of positive weight: all but the padding.
    #[must_use]
    pub fn count(&self) -> usize {
        (0..self.surface.slots()).filter(|&slot| self.surface.weight(slot) > 0.0).count()
    }
}

/// A view that cannot be sampled.
#[derive(Debug, thiserror::Error)]
pub enum SampleError {
    /// The camera looks past the mesh.
    #[error(
        "{scene}: view \"{view}\": no pixel shows the mesh, {places}. Give eye and look_at, or check world_to_camera (row by \
         row, translation last; the camera looks down its own -Z) and fov_y_degrees."
    )]
    NothingVisible {
        /// The scene file.
        scene: String,
        /// The view.
        view: String,
        /// Where the mesh is, and where the camera looks.
        places: String,
    },
    /// A map is asked for, but the mesh cannot be textured.
    #[error(
        "{scene}: the mesh has no texture coordinates, but the enabled effects sample a map. Give a \
         mesh with TEXCOORD_0, or leave the effects out that read maps."
    )]
    NoUvs {
        /// The scene file.
        scene: String,
    },
    /// Occlusion of another mesh.
    #[error(
        "{scene}: occlusion was baked for {found} vertices, but the mesh has {vertices}. Bake the \
         scene anew."
    )]
    OcclusionLength {
        /// The scene file.
        scene: String,
        /// Vertices that were baked.
        found: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// Transfer vectors of another mesh.
    #[error(
        "{scene}: the sky was baked for {found} vertices, but the mesh has {vertices}. Bake the scene anew."
    )]
    TransferLength {
        /// The scene file.
        scene: String,
        /// Vertices that were baked.
        found: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// Thickness of another mesh.
    #[error(
        "{scene}: the thickness was baked for {found} vertices, but the mesh has {vertices}. Bake the scene anew."
    )]
    ThicknessLength {
        /// The scene file.
        scene: String,
        /// Vertices that were baked.
        found: usize,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// Texels that cannot be had.
    #[error("{scene}: {error}")]
    Atlas {
        /// The scene file.
        scene: String,
        /// Why.
        error: atlas::AtlasError,
    },
    /// A target of another size than its view.
    #[error(
        "view \"{view}\": the target has {found} pixels, but the view {pixels}. Give width and \
         height as they are in the target's file."
    )]
    TargetSize {
        /// The view.
        view: String,
        /// Pixels of the target.
        found: usize,
        /// Pixels of the view.
        pixels: usize,
    },
    /// No pixel counts.
    #[error(
        "view \"{view}\": the mask is empty: no pixel that shows the mesh has both a mask and a \
         target's alpha above 0. Check that target, mask and camera belong together."
    )]
    EmptyMask {
        /// The view.
        view: String,
    },
}

/// The visible surface of each view of `scene`, with its mesh posed as `posed`.
///
/// Of what was baked, morph targets add theirs by the scene's weights.
///
/// # Errors
/// When a view sees nothing of the mesh, or the mesh lacks what the effects ask for.
pub fn sample_views(
    scene: &Scene,
    posed: &PosedMesh,
    bakes: SurfaceBakes<'_>,
) -> Result<Vec<ViewSamples>, SampleError> {
    sample_these(scene, &scene.views, posed, bakes)
}

/// As [`sample_views`], of other views than the scene's own.
///
/// # Errors
/// As of [`sample_views`].
pub fn sample_these(
    scene: &Scene,
    views: &[View],
    posed: &PosedMesh,
    bakes: SurfaceBakes<'_>,
) -> Result<Vec<ViewSamples>, SampleError> {
    check_uvs(scene, &posed.uvs)?;
    let rays = RayMesh::of(posed);
    let posed = PosedSurface::new(scene, posed, &rays, &scene.mesh.morphs, bakes)?;
    let atlas = atlas_of(scene, &posed)?;
    let pixels = |view: &View| u64::from(view.camera.width) * u64::from(view.camera.height);
    let bar = progress::bar("samples", views.iter().map(pixels).sum());
    let views = views.iter().map(|view| {
        let mut samples = sampled(scene, &posed, &view.camera, |pixels| bar.inc(pixels));
        samples.atlas.clone_from(&atlas);
        let covered = samples.pixel.iter().filter(|&&pixel| pixel != u32::MAX).count();
        bar.inc(pixels(view) - covered as u64);
        if samples.pixel.is_empty() { Err(nothing_visible(scene, view)) } else { Ok(samples) }
    });
    let views = views.collect();
    bar.finish_and_clear();
    views
}

/// That a view of `scene` shows nothing of the mesh.
#[must_use]
pub fn nothing_visible(scene: &Scene, view: &View) -> SampleError {
    let positions = scene.mesh.pose().positions;
    let least = positions.iter().copied().reduce(Vec3::min).unwrap_or_default().as_dvec3();
    let most = positions.iter().copied().reduce(Vec3::max).unwrap_or_default().as_dvec3();
    let Camera { world_to_camera, .. } = view.camera;
    let along = -world_to_camera.row(2).truncate();
    let told = |v: DVec3, between: &str| v.to_array().map(|x| digits(x, 3)).join(between);
    let places = format!(
        "which is {} units large around ({}); the camera stands at ({}) and looks along ({})",
        told(most - least, " x "),
        told(0.5 * (least + most), ", "),
        told(view.camera.eye(), ", "),
        told(along, ", ")
    );
    SampleError::NothingVisible { scene: scene.path.display().to_string(), view: view.name.clone(), places }
}

/// Refuse a mesh of those texture coordinates where the effects sample a map and it has none.
///
/// # Errors
/// [`SampleError::NoUvs`]
pub fn check_uvs(scene: &Scene, uvs: &[Vec2]) -> Result<(), SampleError> {
    if scene.needs().maps() && uvs.is_empty() {
        return Err(SampleError::NoUvs { scene: scene.path.display().to_string() });
    }
    Ok(())
}

/// The occlusion of each of `vertices` vertices of a scene's mesh, with `morphs` at their weights.
///
/// # Errors
/// When it was baked for another mesh.
pub fn posed_occlusion(
    scene: &Scene,
    morphs: &[Morph],
    vertices: usize,
    occlusion: Option<&VertexOcclusion>,
) -> Result<Option<Vec<f32>>, SampleError> {
    let weights: Vec<f32> = morphs.iter().map(|morph| morph.weight).collect();
    let open = occlusion.map(|occlusion| occlusion.posed(&weights));
    match &open {
        Some(open) if open.len() != vertices => {
            let found = open.len();
            Err(SampleError::OcclusionLength { scene: scene.path.display().to_string(), found, vertices })
        }
        _ => Ok(open),
    }
}

/// The texels of `posed` that the effects of `scene` are computed in; `None` where none is.
///
/// # Errors
/// When the mesh has no texture coordinates, or does not lie in the atlas; or an effect's rules cannot be computed.
pub fn atlas_of(scene: &Scene, posed: &PosedSurface<'_>) -> Result<Option<Arc<Atlas>>, SampleError> {
    if !scene.needs().atlas {
        return Ok(None);
    }
    let made = Atlas::new(&scene.setup(), posed, &scene.maps, scene.diffusion.light_map_size);
    let named = |error| SampleError::Atlas { scene: scene.path.display().to_string(), error };
    Ok(Some(Arc::new(made.map_err(named)?)))
}

/// The visible surface from one camera, without an atlas; empty when it sees nothing. Deterministic for any number of
/// threads.
#[must_use]
pub fn sample_view(scene: &Scene, posed: &PosedSurface<'_>, camera: &Camera) -> ViewSamples {
    sampled(scene, posed, camera, |_| {})
}

/// As [`sample_view`]; `done` is told how many more covered pixels are sampled.
fn sampled(
    scene: &Scene,
    posed: &PosedSurface<'_>,
    camera: &Camera,
    done: impl Fn(u64) + Sync,
) -> ViewSamples {
    let (mut samples, plain) = of_skin(scene, posed, camera, done);
    let per_pixel = scene.quality.samples_per_axis.max(1).pow(2);
    samples.plain = plain::pixels(scene, posed, camera, &plain, per_pixel);
    samples
}

/// As [`sample_view`], but that parts which are not skin are black: who compares what is covered needs no more.
#[must_use]
pub fn sample_silhouettes(scene: &Scene, posed: &PosedSurface<'_>, camera: &Camera) -> ViewSamples {
    let (mut samples, plain) = of_skin(scene, posed, camera, |_| {});
    samples.plain = plain::shares(&plain, scene.quality.samples_per_axis.max(1).pow(2));
    samples
}

/// The samples of skin, and the pixels and hits of those that show something else.
fn of_skin(
    scene: &Scene,
    posed: &PosedSurface<'_>,
    camera: &Camera,
    done: impl Fn(u64) + Sync,
) -> (ViewSamples, Vec<(u32, Hit)>) {
    let n = scene.quality.samples_per_axis.max(1);
    let hits = trace::trace(posed.rays, posed.mesh, camera, n);
    let surface = surface::Surface::new(scene, posed, camera);
    let samples = group::pack(&hits, &surface, (camera.width, n * n), done);
    (samples, hits.plain)
}

/// The place of the mesh that a ray through each pixel shows, skin or not; `None` beside it.
#[must_use]
pub fn pixel_places(posed: &PosedSurface<'_>, camera: &Camera) -> Vec<Option<Vec3>> {
    let hits = trace::trace(posed.rays, posed.mesh, camera, 1);
    let mut places = vec![None; camera.width as usize * camera.height as usize];
    let skin = hits.pixels.iter().map(|(pixel, of)| (*pixel, hits.hits[of.start as usize]));
    for (pixel, hit) in skin.chain(hits.plain.iter().copied()) {
        places[pixel as usize] = Some(hit.place(posed.mesh));
    }
    places
}

/// `count` records of what the effects of `scene` ask for, all zero.
#[must_use]
pub fn asked_records(scene: &Scene, count: usize) -> SurfaceRecords {
    SurfaceRecords::new(surface::asked_of(scene), count)
}

/// The point of the mesh that each sample slot of [`sample_view`] shows, traced anew; padding repeats others.
#[must_use]
pub fn sample_hits(scene: &Scene, posed: &PosedMesh, rays: &RayMesh, camera: &Camera) -> Vec<Hit> {
    let n = scene.quality.samples_per_axis.max(1);
    let hits = trace::trace(rays, posed, camera, n);
    group::slots(&hits, camera.width)
}

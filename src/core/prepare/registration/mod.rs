//! Cameras moved until the mesh lies where the targets show it: before a fit, as a wrong camera bends constants.
//!
//! Each view's camera has seven unknowns: a turn about the mesh's middle, a shift, and the focal length. They are found by
//! Gauss and Newton's steps (Levenberg's, damped) on what a drawn image and the target differ by, at a reduced size first.
//! Derivatives are those of Lucas and Kanade: what is seen moves with the mesh, silhouettes and colours alike.
//!
//! - `image`: images at a reduced size, with their cameras
//! - `residual`: what a drawn image and a target differ by
//! - `motion`: how what is seen moves; `gradients`: and so what is compared
//! - `unknowns`: a camera and its seven unknowns, in pixels
//! - `solve`: the steps

mod gradients;
mod image;
mod motion;
mod residual;
mod solve;
mod unknowns;

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Baked, PrepareError};
use crate::bake::rays::RayMesh;
use crate::progress;
use crate::render::shade::Shader;
use crate::samples::{self, Atlas, PosedSurface};
use crate::scene::mesh::PosedMesh;
use crate::scene::view::{Camera, View};
use crate::scene::{Scene, digits};

use image::Picture;
use residual::Colors;
use solve::Found;

/// Most pixels along the longer side at which images are compared, which bounds what a step costs.
const FINEST: u32 = 512;
/// The first size: a camera that is off by a tenth of the image is a few pixels off there.
const COARSEST: u32 = 64;

/// How a view's camera was moved.
#[derive(Clone, Debug, PartialEq)]
pub struct MovedCamera {
    /// The view's name.
    pub view: String,
    /// As the scene file has it.
    pub before: Camera,
    /// As it is fitted with.
    pub after: Camera,
    /// By how many pixels places of the mesh lie elsewhere in the image: median and largest.
    pub pixels: [f64; 2],
    /// Whether the steps ended because none brought more, and not because there were enough of them.
    pub settled: bool,
}

/// Move the camera of each view that has a target. Other cameras stay.
///
/// # Errors
/// When a view sees nothing of the mesh, or its rules cannot be computed.
pub(super) fn register(baked: &mut Baked) -> Result<Vec<MovedCamera>, PrepareError> {
    let scene = Arc::clone(&baked.scene);
    let posed = scene.mesh.pose();
    samples::check_uvs(&scene, &posed.uvs)?;
    let rays = RayMesh::of(&posed);
    let surface = PosedSurface::new(&scene, &posed, &rays, &scene.mesh.morphs, baked.surface_bakes())?;
    let atlas = samples::atlas_of(&scene, &surface)?;
    let shader = Shader::new(baked.setup(), &baked.illumination, &scene.params)
        .map_err(|error| PrepareError::Shading { scene: scene.path.display().to_string(), error })?;
    let model = Model { scene: &scene, surface, atlas, shader, mesh: &posed };
    let wanted: Vec<usize> = (0..scene.views.len()).filter(|&i| scene.views[i].target.is_some()).collect();
    let bar = progress::bar("cameras", wanted.len() as u64);
    let mut moved = Vec::new();
    for i in wanted {
        let view = &scene.views[i];
        let (camera, settled) = one(view, &model).ok_or_else(|| samples::nothing_visible(&scene, view))?;
        let pixels = displacement(&posed, &view.camera, &camera);
        moved.push(MovedCamera {
            view: view.name.clone(),
            before: view.camera,
            after: camera,
            pixels,
            settled,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    drop(model);
    let scene = Arc::make_mut(&mut baked.scene);
    for camera in &moved {
        let of_view = scene.views.iter_mut().filter(|view| view.name == camera.view);
        of_view.for_each(|view| view.camera = camera.after);
    }
    Ok(moved)
}

/// What cameras see.
struct Model<'a> {
    scene: &'a Scene,
    surface: PosedSurface<'a>,
    atlas: Option<Arc<Atlas>>,
    shader: Shader,
    mesh: &'a PosedMesh,
}

impl Model<'_> {
    /// The image; `None` where nothing of the mesh is in it.
    fn draw(&self, camera: &Camera) -> Option<Picture> {
        let mut seen = samples::sample_silhouettes(self.scene, &self.surface, camera);
        if seen.pixel.is_empty() && seen.plain.is_empty() {
            return None;
        }
        seen.atlas.clone_from(&self.atlas);
        Some(Picture::of(self.shader.shade(&seen, camera, 1.0)))
    }

    /// The place that each pixel shows.
    fn places(&self, camera: &Camera) -> Vec<Option<Vec3>> {
        samples::pixel_places(&self.surface, camera)
    }
}

/// The camera of one view, from coarse images to fine ones; `None` where it sees nothing.
fn one(view: &View, model: &Model<'_>) -> Option<(Camera, bool)> {
    let target = Picture::of_target(view)?;
    let longest = view.camera.width.max(view.camera.height);
    let least = longest.div_ceil(FINEST).max(1);
    let mut side = longest.div_ceil(COARSEST).max(least);
    let at = |camera: &Camera, side: u32, colors: Colors| {
        solve::register(camera, &target.reduced(side as usize), (side, colors), model)
    };
    let mut camera = at(&view.camera, side, Colors::Whole)?.camera;
    while side / 2 > least {
        side /= 2;
        camera = at(&camera, side, Colors::Whole)?.camera;
    }
    let Found { camera, settled } = at(&camera, least, Colors::Detail)?;
    Some((camera, settled))
}

/// By how many pixels the mesh's vertices lie elsewhere in the image of another camera: median and largest of those that
/// both have in front and in their images.
fn displacement(mesh: &PosedMesh, before: &Camera, after: &Camera) -> [f64; 2] {
    let within = |camera: &Camera, (x, y, depth): (f64, f64, f64)| {
        depth > 0.0
            && (0.0..f64::from(camera.width)).contains(&x)
            && (0.0..f64::from(camera.height)).contains(&y)
    };
    let moved = |position: DVec3| {
        let places = [before, after].map(|camera| (camera, camera.project(position)));
        let [(_, a), (_, b)] = places;
        places.iter().all(|&(camera, place)| within(camera, place)).then(|| (a.0 - b.0).hypot(a.1 - b.1))
    };
    let mut all: Vec<f64> = mesh.positions.par_iter().filter_map(|p| moved(p.as_dvec3())).collect();
    all.sort_by(f64::total_cmp);
    [all.get(all.len() / 2), all.last()].map(|found| found.copied().unwrap_or(0.0))
}

impl MovedCamera {
    /// What the user is told of it; `scene` is the file.
    #[must_use]
    pub fn told(&self, scene: &str) -> String {
        let Self { view, before, after, pixels: [median, most], settled } = self;
        let [median, most] = [median, most].map(|pixels| digits(*pixels, 2));
        let [from, to] = [before.fov_y, after.fov_y].map(|radians| digits(radians.to_degrees(), 4));
        let unsettled = match settled {
            true => "",
            false => " It was still moving: look at the error images, and start nearer if they show edges.",
        };
        format!(
            "{scene}: view \"{view}\": its camera was moved to where the target shows the mesh, by {median} pixels \
             (median; {most} at most), and its field of view from {from} to {to} degrees.{unsettled}"
        )
    }
}

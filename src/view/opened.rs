//! A scene that is looked at.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::bake::rays::RayMesh;
use crate::bake::stacks::Stack;
use crate::engine::Point;
use crate::fit::params_file::{ParamsFile, ParamsFileError};
use crate::model::effects::Effects;
use crate::model::params::{Column, Param, Params};
use crate::prepare::{Baked, Loaded, NamedScene, PrepareError, PrepareOptions, read_one_skin_each};
use crate::render::image::Image;
use crate::samples::hit_at;
use crate::scene::mesh::PosedMesh;
use crate::scene::view::{Background, Camera, View};
use crate::values::Values;

/// How a scene is read.
#[derive(Clone, Debug, Default)]
pub struct Reading {
    /// Its file.
    pub scene: PathBuf,
    /// Instead of its effects.
    pub effects: Option<Effects>,
    /// Constants instead of its start values.
    pub params: Option<PathBuf>,
    /// Where bakes are kept.
    pub cache: Option<PathBuf>,
}

impl Reading {
    fn options(&self) -> PrepareOptions {
        PrepareOptions {
            effects: self.effects,
            fit: true,
            params: self.params.clone(),
            cache: self.cache.clone(),
            // Targets show nothing behind the mesh.
            background: Some(Background::None),
            ..PrepareOptions::default()
        }
    }
}

/// A scene with its bakes, and what a probe asks of it.
pub struct Opened {
    /// What it is called among others.
    pub name: String,
    /// The scene and its bakes.
    pub baked: Baked,
    /// The targets of its views, in front of nothing.
    pub targets: Vec<Option<Arc<Image>>>,
    /// The centre of the mesh, and the radius of a sphere about it.
    pub extent: (DVec3, f64),
    mesh: PosedMesh,
    rays: RayMesh,
}

impl std::fmt::Debug for Opened {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Opened").field("scene", &self.path()).finish_non_exhaustive()
    }
}

/// A place on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// In the world, scene units.
    pub position: Vec3,
    /// Of the mesh, unit.
    pub normal: Vec3,
    /// Texture coordinates, where the mesh has some.
    pub uv: Option<[f32; 2]>,
}

impl Opened {
    /// Read and bake a scene.
    ///
    /// # Errors
    /// What is wrong with it, as the command line says it.
    pub fn read(reading: &Reading) -> Result<Self, String> {
        let mut scenes = Self::read_all(std::slice::from_ref(reading))?;
        scenes.pop().ok_or_else(|| "no scene is named.".to_owned())
    }

    /// Read and bake scenes that share one skin.
    ///
    /// # Errors
    /// What is wrong with them, as the command line says it.
    pub fn read_all(readings: &[Reading]) -> Result<Vec<Self>, String> {
        let scenes: Vec<_> =
            readings.iter().map(|reading| (reading.scene.clone(), reading.options())).collect();
        let opened = read_one_skin_each(&scenes, |_, _| {}).and_then(|scenes| {
            scenes.into_iter().map(|NamedScene { name, loaded }| Self::of(name, loaded)).collect()
        });
        opened.map_err(|error| error.to_string())
    }

    fn of(name: String, loaded: Loaded) -> Result<Self, PrepareError> {
        let baked = baked(loaded)?;
        let mesh = baked.scene.mesh.pose();
        let rays = RayMesh::new(&mesh.positions, &mesh.triangles);
        let targets = baked.scene.views.iter().map(|view| target(view).map(Arc::new)).collect();
        let extent = extent(&mesh);
        Ok(Self { name, baked, targets, extent, mesh, rays })
    }

    /// Where a file of constants has the scene; what it does not name is as in `values`, or as the scene has it.
    ///
    /// # Errors
    /// When it cannot be read, or is of another form.
    pub fn point_in(&self, params: &Path, values: Option<&Values>) -> Result<Point, ParamsFileError> {
        let scene = &self.baked.scene;
        let base = values.map_or(&scene.params, |values| &values.params);
        let file = ParamsFile::read(params, scene.form, base)?.of_scene(&scene.path);
        let mut gains = values.map_or(&self.baked.gains, |values| &values.gains).clone();
        for (name, gain) in &file.gains {
            let place = self.views().iter().position(|view| view.name == *name);
            if let Some(own) = place.and_then(|place| gains.get_mut(place)) {
                *own = *gain;
            }
        }
        Ok(Point { params: file.params, gains })
    }

    /// The scene's file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.baked.scene.path
    }

    /// Its views.
    #[must_use]
    pub fn views(&self) -> &[View] {
        &self.baked.scene.views
    }

    /// What the middle of a pixel shows.
    #[must_use]
    pub fn place(&self, camera: &Camera, x: u32, y: u32) -> Option<Place> {
        let Self { mesh, rays, .. } = self;
        let hit = hit_at(rays, mesh, camera, f64::from(x) + 0.5, f64::from(y) + 0.5)?;
        let corners = mesh.triangles[hit.triangle as usize];
        let mean = |of: &[Vec3]| -> Vec3 {
            hit.weights().into_iter().zip(corners).map(|(weight, i)| weight * of[i as usize]).sum()
        };
        let uv = (!mesh.uvs.is_empty()).then(|| hit.uv(mesh).to_array());
        let (position, normal) = (mean(&mesh.positions), mean(&mesh.normals).normalize_or_zero());
        Some(Place { position, normal, uv })
    }
}

/// A scene with lobes of every sharpness and roughness that a slider may ask for.
fn baked(mut loaded: Loaded) -> Result<Baked, PrepareError> {
    let free = loaded.scene.fit.free.clone();
    let (params, effects) = (&loaded.scene.params, loaded.scene.effects);
    let places = |params: &Params| Stack::ALL.map(|stack| stack.place(params));
    let looked_up = |param: &Param| {
        let mut moved = params.clone();
        let (lower, upper) = param.info().range();
        moved.set(
            *param,
            0.5 * (params.scalar(*param) + if params.scalar(*param) == lower { upper } else { lower }),
        );
        param.asked_for(effects) && places(&moved) != places(params)
    };
    let slid: Vec<Column> = Param::all().filter(looked_up).map(Column::tied).collect();
    let fixed = slid.into_iter().filter(|slid| free.iter().all(|column| column.param != slid.param));
    loaded.scene.fit.free.extend(fixed.collect::<Vec<_>>());
    // What is free is the scene's own again: nobody shares it yet.
    // To look at a scene moves no camera; a fit does.
    let cameras = std::mem::take(&mut loaded.scene.fit.cameras);
    let baked = loaded.bake()?.with_scene(|scene| scene.fit.cameras = cameras);
    Ok(baked.with_scene(|scene| scene.fit.free = free))
}

fn extent(mesh: &PosedMesh) -> (DVec3, f64) {
    let (low, high) = mesh
        .positions
        .iter()
        .fold((Vec3::splat(f32::INFINITY), Vec3::splat(f32::NEG_INFINITY)), |(low, high), &p| {
            (low.min(p), high.max(p))
        });
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    (0.5 * (low + high), (0.5 * (high - low).length()).max(1e-6))
}

/// A view's target as an image.
fn target(view: &View) -> Option<Image> {
    let target = view.target.as_ref()?;
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let alpha = target.alpha.clone().unwrap_or_else(|| vec![1.0; width * height]);
    Some(Image { width, height, rgb: target.rgb.clone(), alpha })
}

//! The layers that a fit of maps begins with, and what they show, for the fit of the constants.

use std::sync::Arc;

use super::MapError;
use super::layer::{Grid, Layer, LayerParts};
use super::parts::Cut;
use super::problem::{Problem, read};
use super::task::MapTask;
use crate::bake::rays::RayMesh;
use crate::bake::{Illumination, LobeStack};
use crate::engine::Point;
use crate::engine::view::ObservedView;
use crate::footprint::{cube_border, cube_pairs, edges, texel_pairs, texels, vertices};
use crate::levels::HELD;
use crate::model::cube::Cube;
use crate::model::params::Param;
use crate::samples::atlas::listed;
use crate::samples::{Hit, sample_hits};
use crate::scene::MapKind;
use crate::{Input, Levels, SharedDevice, TensorError};

/// Texels along a side of a map that the scene leaves out, where there is no other to go by.
const MADE_SIZE: usize = 512;

/// The layers of a task: those of its maps that the enabled effects read.
///
/// # Errors
/// When no effect reads a map, or one sees it by other means, the mesh has no texture coordinates for it, or the
/// device does not take it.
pub fn layers(
    shared: &SharedDevice,
    task: &MapTask<'_>,
    cuts: &[Cut],
    reads: &dyn Fn(Input) -> bool,
    (lobe, levels): (f64, Option<&Levels>),
) -> Result<Vec<Layer>, MapError> {
    let scene = task.scene;
    let rays = RayMesh::new(&task.posed.positions, &task.posed.triangles);
    let hits: Vec<Hit> =
        scene.views.iter().flat_map(|view| sample_hits(scene, task.posed, &rays, &view.camera)).collect();
    let mut layers = Vec::new();
    // Its bakes are no layers, and layers are looked up along the model's own directions.
    let beside = scene.effects.iter().find(|effect| effect.info().bakes_environment);
    if let Some(effect) = beside.filter(|_| task.kinds.contains(&MapKind::Environment)) {
        return Err(MapError::Beside { map: MapKind::Environment.name(), effect: effect.name() });
    }
    let in_texels = |input: Input| levels.is_some_and(|levels| levels.reads(input));
    let in_atlas = levels.map_or_else(|| Ok(Vec::new()), |_| atlas_hits(task))?;
    for &kind in &task.kinds {
        let parts = parts(task, kind, (&hits, &in_atlas), lobe).into_iter();
        let read = parts.filter(|parts| reads(parts.input) || in_texels(parts.input));
        let mut read: Vec<LayerParts> = read.collect();
        for parts in &mut read {
            parts.in_atlas = parts.in_atlas.take().filter(|_| in_texels(parts.input));
        }
        if read.is_empty() {
            return Err(MapError::Unread { map: kind.name(), effects: kind.effects() });
        }
        for parts in read {
            if matches!(parts.grid, Grid::Texels { .. }) {
                if !task.posed.is_unwrapped() {
                    return Err(MapError::NotUnwrapped { map: kind.name() });
                }
                if scene.maps.layout.is_some() {
                    return Err(MapError::LaidOut { map: kind.name() });
                }
                let filter = scene.quality.texture_filter;
                if filter.reads_levels() {
                    return Err(MapError::Filtered { map: kind.name(), filter: filter.name() });
                }
            }
            layers.push(Layer::new(shared, parts, cuts)?);
        }
    }
    Ok(layers)
}

/// The points of the mesh at the texels of the UV atlas that it covers.
fn atlas_hits(task: &MapTask<'_>) -> Result<Vec<Hit>, MapError> {
    let MapTask { scene, posed, .. } = task;
    let listed = listed(posed.atlas_uvs(), &posed.skin_triangles(), scene.diffusion.light_map_size);
    let listed = listed.map_err(|_| TensorError::no_atlas(scene.effects))?;
    Ok(listed.into_iter().map(|at| Hit { triangle: at.triangle, barycentric: at.shares }).collect())
}

/// What the layers of a kind are made of; samples show those points of the mesh, and the UV atlas' texels these.
fn parts(
    task: &MapTask<'_>,
    kind: MapKind,
    (hits, in_atlas): (&[Hit], &[Hit]),
    lobe: f64,
) -> Vec<LayerParts> {
    let maps = &task.scene.maps;
    let prior = task.scene.fit.maps.prior(kind);
    let colour_size = maps.color.as_ref().map_or((MADE_SIZE, MADE_SIZE), |map| (map.width, map.height));
    let texture = |input: Input, size: Option<(usize, usize)>, start: Option<Vec<f32>>| {
        let (width, height) = size.unwrap_or(colour_size);
        let channels = input.width().unwrap_or(1);
        let at = |hits: &[Hit]| texels(width, height, hits.iter().map(|hit| hit.uv(task.posed)));
        LayerParts {
            name: kind.name(),
            input,
            grid: Grid::Texels { width, height },
            footprint: at(hits),
            in_atlas: Some(at(in_atlas)),
            pairs: texel_pairs(width, height),
            // The neutral value of a map that the scene leaves out.
            start: start.unwrap_or_else(|| vec![1.0; width * height * channels]),
            prior,
        }
    };
    let single = |input: Input, map: &Option<crate::scene::maps::Map<1>>| {
        let size = map.as_ref().map(|map| (map.width, map.height));
        vec![texture(input, size, map.as_ref().map(|map| map.texels.as_flattened().to_vec()))]
    };
    let cube = |name: &'static str, input: Input, cube: Option<&Cube<f32>>| {
        let cube = cube?;
        let size = cube.size();
        Some(LayerParts {
            name,
            input,
            grid: Grid::Cube(size),
            footprint: cube_border(size),
            in_atlas: None,
            pairs: cube_pairs(size),
            start: cube_texels(cube),
            prior,
        })
    };
    match kind {
        MapKind::Color => {
            let start = maps.color.as_ref().map(|map| map.texels.as_flattened().to_vec());
            vec![texture(Input::Albedo, None, start)]
        }
        MapKind::Specular => single(Input::Specular, &maps.specular),
        MapKind::Attenuator => single(Input::Attenuator, &maps.attenuator),
        MapKind::Occlusion => {
            let count = task.posed.positions.len();
            vec![LayerParts {
                name: kind.name(),
                input: Input::Open,
                grid: Grid::Vertices(count),
                footprint: vertices(count, &task.posed.triangles, hits),
                in_atlas: Some(vertices(count, &task.posed.triangles, in_atlas)),
                pairs: edges(&task.posed.triangles),
                start: task.open.clone().unwrap_or_else(|| vec![1.0; count]),
                prior,
            }]
        }
        MapKind::Environment => {
            let Illumination { irradiance, lobes, hilite, .. } = &task.illumination;
            let lobe = lobes.as_ref().map(|stack| stack.at(lobe).0);
            [
                cube("irradiance", Input::Irradiance, irradiance.as_ref()),
                cube("lobe", Input::Lobe, lobe.as_ref()),
                cube("hilite", Input::Hilite, hilite.as_ref()),
            ]
            .into_iter()
            .flatten()
            .collect()
        }
    }
}

/// A cube's texels without the border, by `(face * size + row) * size + column`.
fn cube_texels(cube: &Cube<f32>) -> Vec<f32> {
    let size = cube.size();
    let places = (0..6 * size * size).map(|i| (i / (size * size), i % size, i / size % size));
    places.flat_map(|(face, column, row)| cube.texel(face, column, row)).collect()
}

/// Take what a layer shows to the texels of the UV atlas back to the one that the views share.
fn take_back_to_atlas(layer: &Layer, observed: &mut [ObservedView]) -> Result<(), MapError> {
    let Some(in_atlas) = &layer.in_atlas else { return Ok(()) };
    let held = HELD.iter().find(|(input, _)| *input == layer.input);
    let atlas = observed.iter().find_map(|view| view.samples.atlas.as_ref());
    if let (Some((_, name)), Some(atlas)) = (held, atlas) {
        let numbers = read(in_atlas.apply(layer.value.clone())?)?;
        let width = layer.input.width().unwrap_or(1);
        let atlas = Arc::new(atlas.with_quantity(name, width, &numbers));
        observed.iter_mut().for_each(|view| view.samples.atlas = Some(Arc::clone(&atlas)));
    }
    Ok(())
}

/// Take what the layers show back to the samples and cubes that the constants are fitted with.
///
/// # Errors
/// When the device does not give it.
pub fn take_back(
    problem: &Problem,
    observed: &mut [ObservedView],
    illumination: &mut Illumination,
    constants: &Point,
) -> Result<(), MapError> {
    for layer in &problem.layers {
        if let Grid::Cube(size) = layer.grid {
            let texels = read(layer.value.clone())?;
            let cube = Cube::from_fn(size, |face, column, row| {
                let at = 4 * ((face * size + row) * size + column);
                std::array::from_fn(|c| texels[at + c])
            });
            match layer.input {
                Input::Irradiance => illumination.irradiance = Some(cube),
                Input::Hilite => illumination.hilite = Some(cube),
                _ => {
                    let exponent = constants.params.scalar(Param::SpecularLobe);
                    illumination.lobes = Some(LobeStack { exponents: vec![exponent], cubes: vec![cube] });
                }
            }
            continue;
        }
        take_back_to_atlas(layer, observed)?;
        let mut numbers = Vec::new();
        for footprint in &layer.footprints {
            numbers.extend(read(footprint.apply(layer.value.clone())?)?);
        }
        let width = layer.input.width().unwrap_or(1);
        let mut first = 0;
        for view in observed.iter_mut() {
            let surface = &mut view.samples.surface;
            let (slots, places) = (surface.slots(), *surface.places());
            let place = match layer.input {
                Input::Albedo => places.albedo,
                Input::Specular => places.specular,
                Input::Attenuator => places.attenuator,
                _ => places.occlusion,
            };
            for (c, at) in place.into_iter().flat_map(|at| (0..width).map(move |c| (c, at + c))) {
                let plane = surface.rows_mut().plane_mut(at);
                plane.enumerate().for_each(|(slot, number)| *number = numbers[(first + slot) * width + c]);
            }
            first += slots;
        }
    }
    Ok(())
}

//! The rounds over maps and constants.

use std::time::Instant;

use burn::tensor::{Tensor, TensorData};

use super::layer::{Grid, Layer, LayerParts};
use super::problem::{Observed, Problem, read};
use super::{MapError, adam, cg};
use crate::bake::rays::RayMesh;
use crate::bake::{Illumination, LobeStack};
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::engine::{Point, Unknown};
use crate::fit::{self, FitOptions};
use crate::model::cube::Cube;
use crate::model::evaluate::Setup;
use crate::model::params::{Column, Param};
use crate::samples::rows::Row;
use crate::samples::{Hit, ViewSamples, sample_hits};
use crate::scene::mesh::PosedMesh;
use crate::scene::{MapKind, MapSolver, Scene};
use crate::tensor::footprint::{cube_border, cube_pairs, edges, texel_pairs, texels, vertices};
use crate::tensor::{Input, Scatter, Shade, Shaded, SharedDevice};

/// Texels along a side of a map that the scene leaves out, where there is no other to go by.
const MADE_SIZE: usize = 512;

/// What is to be fitted.
pub struct MapTask<'a> {
    /// The scene; its views are those of `observed`.
    pub scene: &'a Scene,
    /// Its mesh.
    pub posed: &'a PosedMesh,
    /// The cubes to start from.
    pub illumination: Illumination,
    /// Each vertex's open share of the hemisphere to start from.
    pub open: Option<Vec<f32>>,
    /// Samples and targets.
    pub observed: Vec<ObservedView>,
    /// A view that takes no part in the fit.
    pub held_out: Option<usize>,
    /// Which maps.
    pub kinds: Vec<MapKind>,
    /// The constants to start from, and which of them are free.
    pub start: Point,
    /// What is free of them.
    pub unknowns: Vec<Unknown>,
}

/// What was found.
pub struct FittedMaps {
    /// The maps: where they started and where they are.
    pub layers: Vec<Layer>,
    /// The constants that the maps of the start ask for.
    pub initial: Point,
    /// The constants.
    pub constants: Point,
    /// The cubes.
    pub illumination: Illumination,
    /// The views, their samples as the fitted maps show them.
    pub observed: Vec<ObservedView>,
    /// How it went: for each round each layer and then the constants.
    pub history: Vec<MapStep>,
}

/// One step of a round.
#[derive(Clone, Debug, PartialEq)]
pub struct MapStep {
    /// The round, from 1.
    pub round: u32,
    /// The map, or `constants`.
    pub what: &'static str,
    /// The loss before it, priors of that map included.
    pub before: f64,
    /// The loss after it.
    pub after: f64,
    /// Seconds since the start.
    pub seconds: f64,
}

/// The free columns that a fit of maps leaves: a fitted environment holds what turns and blurs it.
#[must_use]
pub fn columns_beside(kinds: &[MapKind], free: &[Column]) -> Vec<Column> {
    let environment = kinds.contains(&MapKind::Environment);
    let of_light = |column: &Column| matches!(column.param, Param::SpecularLobe | Param::EnvironmentRotation);
    free.iter().copied().filter(|column| !(environment && of_light(column))).collect()
}

/// Fit maps and constants by turns. `told` hears of each step.
///
/// # Errors
/// When no effect reads a map, the device fails, or the constants cannot be fitted.
pub fn fit_maps(
    shared: &SharedDevice,
    task: MapTask<'_>,
    told: &mut dyn FnMut(&MapStep),
) -> Result<FittedMaps, MapError> {
    let clock = Instant::now();
    let Scene { form, silhouette, effects, fit: settings, .. } = task.scene;
    let setup = Setup { form: *form, silhouette: *silhouette, effects: *effects };
    let columns = all_columns();
    let (initial, _) = solve_constants(
        &task.unknowns,
        setup,
        &task.illumination,
        &task.observed,
        task.held_out,
        &task.start,
        settings.loss,
    )?;
    let mut constants = initial.clone();
    let shaded =
        Shaded { setup, params: &constants.params, columns: &columns, illumination: &task.illumination };
    let views: Vec<&ViewSamples> = task.observed.iter().map(|view| &view.samples).collect();
    let (shade, inputs) = Shade::new(shared, &shaded, &views, Scatter::Exact)?;
    let layers = layers(shared, &task, &shade, constants.params.scalar(Param::SpecularLobe))?;
    let mut problem = Problem::new(shared, shade, inputs, layers)?;
    let (mut illumination, mut observed) = (task.illumination, task.observed);
    let mut history: Vec<MapStep> = Vec::new();
    for round in 1..=settings.maps.rounds {
        let mut step = |what, (before, after)| {
            let seconds = clock.elapsed().as_secs_f64();
            history.push(MapStep { round, what, before, after, seconds });
            history.iter().last().into_iter().for_each(&mut *told);
        };
        for index in 0..problem.layers.len() {
            let seen = seen(&observed, &constants, task.held_out);
            problem.reweight(shared, &seen, settings.loss)?;
            let steps = settings.maps.steps as usize;
            let losses = match settings.maps.solver {
                MapSolver::ConjugateGradients => cg::solve(&mut problem, index, steps)?,
                MapSolver::Adam => adam::solve(&mut problem, index, steps, settings.maps.rate)?,
            };
            shared.gpu().check().map_err(crate::tensor::TensorError::from)?;
            step(problem.layers[index].name, losses);
        }
        take_back(&problem, &mut observed, &mut illumination, &constants)?;
        let (next, losses) = solve_constants(
            &task.unknowns,
            setup,
            &illumination,
            &observed,
            task.held_out,
            &constants,
            settings.loss,
        )?;
        constants = next;
        problem.inputs.columns = column_tensor(shared, &columns, &constants);
        step("constants", losses);
    }
    Ok(FittedMaps { layers: problem.layers, initial, constants, illumination, observed, history })
}

/// Every parameter but the lobe, each channel its own.
fn all_columns() -> Vec<Column> {
    let of = |param: Param| {
        if param.info().rgb { Column::per_channel(param).to_vec() } else { vec![Column::tied(param)] }
    };
    Param::all().filter(|&param| param != Param::SpecularLobe).flat_map(of).collect()
}

fn column_tensor(shared: &SharedDevice, columns: &[Column], point: &Point) -> Tensor<1> {
    let values: Vec<f32> = columns.iter().map(|column| column.get(&point.params) as f32).collect();
    let count = values.len();
    Tensor::from_data(TensorData::new(values, [count]), shared.device())
}

fn seen<'a>(observed: &'a [ObservedView], constants: &Point, held_out: Option<usize>) -> Vec<Observed<'a>> {
    let of = |(i, view)| Observed { view, gain: constants.gains[i], counts: held_out != Some(i) };
    observed.iter().enumerate().map(of).collect()
}

/// The layers of a task.
fn layers(
    shared: &SharedDevice,
    task: &MapTask<'_>,
    shade: &Shade,
    lobe: f64,
) -> Result<Vec<Layer>, MapError> {
    let scene = task.scene;
    let rays = RayMesh::new(&task.posed.positions, &task.posed.triangles);
    let hits: Vec<Hit> =
        scene.views.iter().flat_map(|view| sample_hits(scene, task.posed, &rays, &view.camera)).collect();
    let mut layers = Vec::new();
    for &kind in &task.kinds {
        let parts = parts(task, kind, &hits, lobe);
        let read: Vec<LayerParts> = parts.into_iter().filter(|parts| shade.reads(parts.input)).collect();
        if read.is_empty() {
            return Err(MapError::Unread { map: kind.name(), effects: kind.effects() });
        }
        for parts in read {
            layers.push(Layer::new(shared, parts)?);
        }
    }
    Ok(layers)
}

/// What the layers of a kind are made of.
fn parts(task: &MapTask<'_>, kind: MapKind, hits: &[Hit], lobe: f64) -> Vec<LayerParts> {
    let maps = &task.scene.maps;
    let prior = task.scene.fit.maps.prior(kind);
    let colour_size = maps.color.as_ref().map_or((MADE_SIZE, MADE_SIZE), |map| (map.width, map.height));
    let texture = |input: Input, size: Option<(usize, usize)>, start: Option<Vec<f32>>| {
        let (width, height) = size.unwrap_or(colour_size);
        let channels = input.width().unwrap_or(1);
        LayerParts {
            name: kind.name(),
            input,
            grid: Grid::Texels { width, height },
            footprint: texels(width, height, hits.iter().map(|hit| hit.uv(task.posed))),
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
                pairs: edges(&task.posed.triangles),
                start: task.open.clone().unwrap_or_else(|| vec![1.0; count]),
                prior,
            }]
        }
        MapKind::Environment => {
            let Illumination { irradiance, lobes, hilite } = &task.illumination;
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

/// Take what the layers show back to the samples and cubes that the constants are fitted with.
fn take_back(
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
        let numbers = read(layer.footprint.apply(layer.value.clone())?)?;
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

/// The best constants for the maps as they are.
fn solve_constants(
    unknowns: &[Unknown],
    setup: Setup,
    illumination: &Illumination,
    observed: &[ObservedView],
    held_out: Option<usize>,
    start: &Point,
    loss: crate::scene::Loss,
) -> Result<(Point, (f64, f64)), MapError> {
    let mut views = observed.to_vec();
    if let Some(view) = held_out {
        // It stays in its place, for the gains' sake, and counts nothing.
        let groups = views[view].samples.groups();
        views[view].weight = vec![Row::ZERO; groups];
    }
    let engine = CpuEngine::new(setup, illumination.clone(), views, loss, unknowns.to_vec());
    let outcome = fit::fit(&engine, start, &FitOptions::default(), &mut |_| {})?;
    Ok((outcome.end, (outcome.loss_start, outcome.loss_end)))
}

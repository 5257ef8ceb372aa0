//! The race of texture-space diffusion: light maps, blurs and lookups with how they move, passes and whole fits, on the data
//! of the program that times the other frameworks (its FORMAT.md).
//!
//! - `data`: the folder as texels and samples of the engine's own; `window`: a part of it
//! - this module: passes; `fits`: whole fits, `secant`: their steps

mod data;
mod fits;
mod secant;
mod window;

use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};
use skinfit::bake::Illumination;
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::view::ObservedView;
use skinfit::engine::{Point, Task};
use skinfit::gpu::Gpu;
use skinfit::scene::Loss;

use self::data::{Data, Manifest};
use crate::data::Result;
use crate::measure::{peak_rss_mb, timed};
use crate::racer::Racer;

/// What the race is run with.
pub(crate) struct Options<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) reps: usize,
    pub(crate) passes_only: bool,
    /// What makes the passes, where it is not the processor.
    pub(crate) gpu: Option<Gpu>,
}

/// An engine over a view, with the race's unknowns or with none: for images.
fn engine(gpu: Option<&Gpu>, view: ObservedView, fits: bool, start: &Point) -> Result<Box<dyn Racer>> {
    let task = Task {
        setup: data::setup()?,
        illumination: Arc::new(Illumination::default()),
        views: Arc::new([view]),
        loss: Loss::L2,
        unknowns: if fits { data::unknowns()? } else { Vec::new() },
    };
    match gpu {
        None => Ok(Box::new(CpuEngine::new(task).map_err(|error| error.to_string())?)),
        Some(gpu) => {
            let engine = GpuEngine::new(gpu, task, start, Memory::default());
            Ok(Box::new(engine.map_err(|error| error.to_string())?))
        }
    }
}

fn point(values: &[f64]) -> Result<Point> {
    Ok(Point { params: data::params(values)?, gains: vec![1.0.into()] })
}

/// Points so near one another that nothing changes but what is kept: no pass may find what the one before has left. In 32
/// bits they differ, too.
struct Points {
    values: Vec<f64>,
    turn: Cell<u32>,
}

impl Points {
    fn next(&self) -> Result<Point> {
        self.turn.set(self.turn.get() + 1);
        let near = 1.0 + 1e-6 * f64::from(self.turn.get());
        point(&self.values.iter().map(|value| value * near).collect::<Vec<_>>())
    }
}

/// A row of the comparison.
pub(crate) fn run(options: &Options<'_>) -> Result<Value> {
    let before = peak_rss_mb();
    let manifest = Manifest::read(options.folder)?;
    let data = Data::read(options.folder, &manifest)?;
    let truth = point(&manifest.params_true)?;
    let points = Points { values: manifest.params_init.clone(), turn: Cell::new(0) };
    let timed_at = |pass: &dyn Fn(&Point)| -> Result<Value> {
        let mut fault = Ok(());
        let row = timed(options.reps, || match points.next() {
            Ok(point) => pass(&point),
            Err(error) => fault = Err(error),
        });
        fault.map(|()| row)
    };

    let gpu = options.gpu.as_ref();
    let images = engine(gpu, data.view("clean", None)?, false, &truth)?;
    let inputs = peak_rss_mb();
    let first = Instant::now();
    let image = images.image_planes(&truth);
    let first_forward = first.elapsed().as_secs_f64();
    let max_error = max_error(&images.views()[0], &image, manifest.pixels);
    let planes = std::cell::RefCell::new(image);
    let forward = timed_at(&|point| {
        images.forward(point, &mut planes.borrow_mut());
        std::hint::black_box(&*planes.borrow());
    })?;
    drop((images, planes));

    let engine = engine(gpu, data.view("clean", None)?, true, &truth)?;
    let first = Instant::now();
    engine.gradient(&points.next()?);
    let first_grad = first.elapsed().as_secs_f64();
    let grad = timed_at(&|point| drop(std::hint::black_box(engine.gradient(point))))?;
    let first = Instant::now();
    engine.normal_equations(&points.next()?);
    let first_normal = first.elapsed().as_secs_f64();
    let normal = timed_at(&|point| drop(std::hint::black_box(engine.normal_equations(point))))?;
    engine.fault().map_or(Ok(()), Err)?;
    let (device, version) = (engine.name(), engine.version());
    drop(engine);
    let passes = peak_rss_mb();
    let fits = if options.passes_only { json!({}) } else { fits::fits(&data, &manifest, options)? };
    Ok(json!({
        "peer": "skinfit", "version": format!("skinfit {} ({version})", env!("CARGO_PKG_VERSION")),
        "texels": manifest.texels, "pixels": manifest.pixels, "device": device,
        "threads": rayon::current_num_threads(),
        "forward": forward, "grad": grad, "normal": normal, "fits": fits,
        "first_forward_s": first_forward, "first_grad_s": first_grad, "first_normal_s": first_normal,
        "forward_max_err": max_error, "other_cpu": 0,
        "rss_import_mb": before, "rss_data_mb": inputs, "rss_before_fits_mb": passes, "peak_rss_mb": peak_rss_mb(),
    }))
}

/// The greatest error of an image against the view's target, relative to 1 more than that.
fn max_error(view: &ObservedView, image: &[Vec<f32>], pixels: usize) -> f64 {
    let error = |c: usize, i: usize| {
        let want = view.target.number(c, i);
        f64::from((image[c][i] - want).abs() / (1.0 + want.abs()))
    };
    let all = (0..3).flat_map(|c| (0..pixels).map(move |i| (c, i)));
    all.map(|(c, i)| error(c, i)).fold(0.0, f64::max)
}

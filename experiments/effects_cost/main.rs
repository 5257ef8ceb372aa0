//! What each effect costs in the production renderer: rules, bindings, bytes, instructions, GPU time.
//! `cargo run --release --example effects_cost -- SCENE -o table.csv`; see README.md beside this file.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Parser;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use skinfit::engine::gpu::{DeviceSampleError, DeviceSamples, GpuEngine, Memory};
use skinfit::engine::view::ObservedView;
use skinfit::engine::{Task, Unknown};
use skinfit::gpu::atlas::AtlasTraffic;
use skinfit::gpu::bandwidth::copied_bytes_a_second;
use skinfit::gpu::upload::Content;
use skinfit::gpu::{Choice, Gpu, GpuError, RenderOptions, Renderer};
use skinfit::model::effects::{Effect, Effects};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, Loaded, PrepareOptions, Views};
use skinfit::render::antialias::Antialias;
use skinfit::render::shading::Shading;
use skinfit::samples::ViewSamples;
use skinfit::samples::rows::Rows;
use skinfit::scene::view::Camera;
use skinfit::shader::{Budget, Plan};

#[derive(Parser)]
struct Arguments {
    /// The scene file.
    scene: PathBuf,
    /// The table, as CSV.
    #[arg(short, long)]
    output: PathBuf,
    /// Image size.
    #[arg(long, default_value_t = 1920)]
    width: u32,
    /// Image size.
    #[arg(long, default_value_t = 1080)]
    height: u32,
    /// Frames of which the median time is taken.
    #[arg(long, default_value_t = 200)]
    frames: usize,
    /// Only the full model and its floor.
    #[arg(long)]
    full: bool,
    /// Filter in the shader, in f32, instead of by the hardware.
    #[arg(long)]
    exact: bool,
}

/// One line of the table.
struct Row {
    name: String,
    rules: usize,
    attributes: usize,
    bindings: usize,
    constants: usize,
    uploaded: u64,
    instructions: usize,
    operations: f64,
    /// Of the frame with its fragments shaded where they are drawn: median and spread.
    forward: Option<(f64, f64)>,
    /// Likewise, by way of a visibility buffer.
    buffered: Option<(f64, f64)>,
    /// Of a compute pass over the stored samples of the same image, likewise; none where nothing is shown, or what
    /// is drawn is not the effects' image.
    compute: Option<(f64, f64)>,
    /// Of the passes over the UV atlas, where the effects have some: how many, their bytes, and their time, likewise.
    atlas: (AtlasTraffic, Option<(f64, f64)>),
}

/// Rounds in which frames and compute passes take turns.
const ROUNDS: usize = 4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = Arguments::parse();
    let gpu = Gpu::open(&Choice::default())?;
    let full = Loaded::read(&arguments.scene, &options(None))?.scene.effects;
    let mut rows = Vec::new();
    if !arguments.full {
        for effect in Effect::BUILT_IN.into_iter().filter(|effect| *effect != Effect::Bloom) {
            rows.push(measure(&arguments, &gpu, effect.name(), Effects::of(&[effect]), Plan::clone)?);
        }
        for effect in full.iter() {
            let name = format!("all but {}", effect.name());
            rows.push(measure(&arguments, &gpu, &name, full.without(effect), Plan::clone)?);
        }
    }
    rows.push(measure(&arguments, &gpu, "the scene's effects", full, Plan::clone)?);
    rows.push(measure(&arguments, &gpu, "the same fetches alone", full, Plan::fetches_alone)?);
    let mut text = String::from(
        "effects,rules,attributes,bindings,constants,uploaded bytes,SPIR-V instructions,planned operations,forward median ms,forward spread ms,median ms,spread ms,compute median ms,compute spread ms,atlas passes,atlas bytes,atlas median ms,atlas spread ms,copied bytes a second\n",
    );
    let copied = copied_bytes_a_second(&gpu)?;
    for row in &rows {
        let time = |times: Option<(f64, f64)>| {
            times.map_or(",".to_owned(), |(median, spread)| format!("{median:.4},{spread:.4}"))
        };
        text += &format!(
            "{},{},{},{},{},{},{},{:.0},{},{},{},{},{},{},{}\n",
            row.name,
            row.rules,
            row.attributes,
            row.bindings,
            row.constants,
            row.uploaded,
            row.instructions,
            row.operations,
            time(row.forward),
            time(row.buffered),
            time(row.compute),
            row.atlas.0.passes,
            row.atlas.0.bytes,
            time(row.atlas.1),
            copied.map_or_else(String::new, |bytes| format!("{bytes:.4e}"))
        );
    }
    skinfit::output::write(&arguments.output, text.as_bytes())?;
    print!("{text}");
    println!("{} at {} x {}", gpu.name(), arguments.width, arguments.height);
    Ok(())
}

fn options(effects: Option<Effects>) -> PrepareOptions {
    PrepareOptions {
        effects,
        fit: false,
        views: Views::First,
        params: None,
        cache: Some(skinfit::bake::cache::default_folder()),
        ..PrepareOptions::default()
    }
}

fn measure(
    arguments: &Arguments,
    gpu: &Gpu,
    name: &str,
    effects: Effects,
    change: fn(&Plan) -> Plan,
) -> Result<Row, Box<dyn std::error::Error>> {
    let mut loaded = Loaded::read(&arguments.scene, &options(Some(effects)))?;
    let camera = Camera { width: arguments.width, height: arguments.height, ..loaded.scene.views[0].camera };
    // As many samples as the renderer draws fragments.
    loaded.scene.views[0].camera = camera;
    loaded.scene.quality.samples_per_axis = 1;
    let baked = loaded.bake()?;
    let content = Content::of(&baked);
    let budget = if arguments.exact { Budget::Exact } else { Budget::Paper };
    let render = RenderOptions {
        antialias: Antialias::Grid(1),
        shading: Shading::Forward,
        budget,
        timed: true,
        animated: false,
    };
    let renderer =
        |shading| Renderer::with_shader(gpu, content.clone(), RenderOptions { shading, ..render }, change);
    let (mut forward, mut buffered) = (renderer(Shading::Forward)?, renderer(Shading::VisibilityBuffer)?);
    let whole = !forward.plan().only_fetches;
    let engine = match DeviceSamples::new(gpu, content.clone()) {
        Ok(made) if whole => over_samples(made, &baked)?,
        // What is found by rays, samples made there have none of.
        Ok(_) | Err(DeviceSampleError::Gpu(GpuError::Plan(_))) => None,
        Err(error) => return Err(error.into()),
    };
    let start = baked.start();
    // The first frames wake the adapter up.
    forward.frame_times(&camera, arguments.frames)?;
    let mut times = [Vec::new(), Vec::new(), Vec::new()];
    for round in 0..=ROUNDS {
        let frames = arguments.frames.div_ceil(ROUNDS);
        let taken = [
            forward.frame_times(&camera, frames)?,
            buffered.frame_times(&camera, frames)?,
            engine.as_ref().map_or(Ok(Vec::new()), |engine| engine.shade_times(&start, frames))?,
        ];
        // Nor does the round count in which the compute pass is compiled.
        if round > 0 {
            times.iter_mut().zip(taken).for_each(|(times, taken)| times.extend(taken));
        }
    }
    let [drawn, shaded, computed] = times.map(median_and_spread);
    let traffic = buffered.atlas_traffic();
    let over_atlas =
        if traffic.passes > 0 { buffered.atlas_times(&camera, arguments.frames)? } else { Vec::new() };
    let plan = forward.plan();
    Ok(Row {
        name: name.to_owned(),
        rules: plan.steps.len(),
        attributes: plan.attributes.len(),
        bindings: plan.resources.len() + usize::from(!plan.constants.is_empty()),
        constants: plan.constants.len(),
        uploaded: forward.uploaded_bytes(),
        instructions: instructions(plan)?,
        operations: plan.cost,
        forward: drawn,
        buffered: shaded,
        compute: computed,
        atlas: (traffic, median_and_spread(over_atlas)),
    })
}

/// The fused engine over the samples of the image, its lookups live; `None` where the effects show nothing.
fn over_samples(
    (made, groups): (DeviceSamples, Vec<ViewSamples>),
    baked: &Baked,
) -> Result<Option<GpuEngine>, GpuError> {
    let views = groups.into_iter().map(|samples| {
        // With alpha where the image has the haze there.
        let hazy = baked.scene.needs().haze;
        let target = Rows::new(if hazy { 4 } else { 3 }, samples.groups());
        ObservedView { samples, target, ..ObservedView::default() }
    });
    let views: Vec<ObservedView> = views.collect();
    let task = Task {
        // What moves normals forbids to keep what they look up.
        unknowns: vec![Unknown::Param(Column::tied(Param::NormalStrength))],
        ..baked.task_over(views)
    };
    match GpuEngine::over_device_samples(Arc::new(made), task, &baked.start(), Memory::default()) {
        Ok(engine) => Ok(Some(engine)),
        Err(GpuError::NothingShown) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The median and the distance of the quartiles; `None` of nothing.
fn median_and_spread(mut times: Vec<f64>) -> Option<(f64, f64)> {
    times.sort_by(f64::total_cmp);
    let median = times.get(times.len() / 2)?;
    Some((*median, times[times.len() * 3 / 4] - times[times.len() / 4]))
}

/// SPIR-V instructions in the functions of both stages, as naga writes them (nothing is optimised yet).
fn instructions(plan: &Plan) -> Result<usize, Box<dyn std::error::Error>> {
    let module = naga::front::wgsl::parse_str(&plan.wgsl)?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module)?;
    let options = naga::back::spv::Options::default();
    let words = naga::back::spv::write_vec(&module, &info, &options, None)?;
    // A module: five words of header, then instructions whose first word holds length and opcode.
    let (mut at, mut inside, mut count) = (5, false, 0);
    while at < words.len() {
        let (length, opcode) = (words[at] >> 16, words[at] & 0xffff);
        // OpFunction and OpFunctionEnd.
        match opcode {
            54 => inside = true,
            56 => inside = false,
            _ => count += usize::from(inside),
        }
        at += length.max(1) as usize;
    }
    Ok(count)
}

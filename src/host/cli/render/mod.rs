//! `skinfit render`: a view as an image, or as a sequence of images.
//!
//! - `engine`: which engine draws, and its options
//! - `frames`: which frames a sequence has, and their files
//! - `clip`: what is baked of an animation's frames

mod clip;
mod engine;
mod frames;

use std::path::{Path, PathBuf};

use super::graphics::Task;
use super::scene::{SceneArguments, parse_effects};
use super::set::SetArguments;
use super::{Exit, Refusal, quieten_graphics, say, tell_warnings};
use crate::fit::params_file::Foreign;
use crate::gpu::painter::{Beside, Cut, PaintError, Painter, Picture};
use crate::model::effects::{Effect, Effects};
use crate::model::params::{LARGEST, Param, Params};
use crate::prepare::{Baked, ClipOcclusion, Loaded, PrepareOptions, Views};
use crate::progress;
use crate::render::files::{ImageOptions, write_exr_layers, write_image};
use crate::render::image::{MAX_PIXELS, MAX_SIDE};
use crate::render::tonemap::{Operator, ToneMap};
use crate::samples;
use crate::scene::animation::Animation;
use crate::scene::view::Background;
use frames::{Frame, Pace};

/// Render a view of a scene with the model
#[derive(clap::Args)]
#[command(
    group(clap::ArgGroup::new("length").args(["frames", "fps"]).multiple(true)),
    after_help = "Examples:\n  skinfit render scene.toml --params runs/a/params.toml --view front -o front.exr\n  skinfit render --effects diffuse,occlusion --tone aces -o clay.png\n  skinfit render scene.toml --frames 120 --size 1920x1080 --accuracy paper --antialias msaa4 -o turn.png\n  skinfit render scene.toml --animate --fps 24 --loops 2 --occlusion frames --occlusion-rate 6 -o walk.png"
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Parameters of an earlier fit, instead of the scene's start values. Drawn are the scene's effects, or
    /// those of --effects: where the fit had others, a warning names the values that were not fitted.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    #[command(flatten)]
    set: SetArguments,
    /// Which view [default: the scene's first].
    #[arg(long, value_name = "NAME")]
    view: Option<String>,
    /// Effects to switch on, comma-separated, instead of the scene's.
    #[arg(long, value_name = "LIST", value_parser = parse_effects)]
    effects: Option<Effects>,
    /// The image: .exr (linear, 32-bit float) or .png (sRGB). With --frames, each frame's number goes before
    /// the ending.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Pixels across and down, instead of the view's; its vertical field of view stays.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Write a layer for each term into the EXR, and one for the background; they add up to the whole without its
    /// bloom. The haze, where an effect makes one, stands beside them.
    #[arg(long)]
    layers: bool,
    /// What stands behind the mesh, instead of the view's own: none, environment, or R,G,B (linear radiance).
    #[arg(long, value_name = "WHAT", value_parser = parse_background)]
    background: Option<Background>,
    /// How radiance becomes a PNG's colours.
    #[arg(long, default_value = "clip", value_parser = ["clip", "reinhard", "aces"])]
    tone: String,
    /// Exposure of a PNG, in stops.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_stops)]
    exposure: f32,
    #[command(flatten)]
    engine: engine::EngineArguments,
    /// Render N frames: a whole turn of the camera about the mesh's vertical axis.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(frames::MOST)), help_heading = "Sequences")]
    frames: Option<u32>,
    /// Let the frames go through the mesh's animation instead, the camera standing still: --frames of them from its
    /// first key to its last, or with --fps at its own speed.
    #[arg(long, requires = "length", help_heading = "Sequences")]
    animate: bool,
    /// Frames a second of the animation: all of it once, or --frames of them, which begin again where it ends.
    #[arg(long, value_name = "RATE", value_parser = parse_rate, requires = "animate", help_heading = "Sequences")]
    fps: Option<f64>,
    /// Go through the animation so often, each round ending where the next begins.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000), requires = "fps", conflicts_with = "frames", help_heading = "Sequences")]
    loops: Option<u32>,
    /// How ambient occlusion follows the animation: `targets`, by what is baked once for each morph target that it
    /// moves, or `frames`, by a bake of each frame.
    #[arg(long, value_name = "HOW", default_value = "targets", value_parser = ["targets", "frames"], requires = "animate", help_heading = "Sequences")]
    occlusion: String,
    /// Of --occlusion frames: bake RATE poses a second of the animation, and interpolate linearly between them.
    #[arg(long, value_name = "RATE", value_parser = parse_rate, requires = "animate", help_heading = "Sequences")]
    occlusion_rate: Option<f64>,
    /// Print what a frame took: GPU time by pass, uploaded bytes, bindings.
    #[arg(long)]
    stats: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let is_exr = check_output(&arguments.output, arguments.layers)?;
    if arguments.engine.may_be_gpu() {
        quieten_graphics();
    }
    let (path, _scratch) = arguments.scene.path()?;
    let options = PrepareOptions {
        effects: arguments.effects,
        fit: false,
        views: arguments.view.clone().map_or(Views::First, Views::Named),
        params: arguments.params.clone(),
        set: arguments.set.values()?.to_vec(),
        cache: arguments.scene.cache(),
        time: arguments.animate.then_some(0.0),
        clip: arguments.animate.then_some(arguments.follows()),
        background: arguments.background,
    };
    if arguments.occlusion_rate.is_some() && arguments.follows() == ClipOcclusion::Targets {
        return Err(Refusal::new(
            "--occlusion-rate says how often poses are baked: give --occlusion frames with it.".to_owned(),
        ));
    }
    let mut loaded = Loaded::read(&path, &options)?;
    if let Some((width, height)) = arguments.size {
        let camera = &mut loaded.scene.views[0].camera;
        (camera.width, camera.height) = (width, height);
    }
    if let Some(n) = arguments.engine.samples_per_axis() {
        loaded.scene.quality.samples_per_axis = n;
    }
    let baked = loaded.bake()?;
    samples::check_uvs(&baked.scene, &baked.scene.mesh.uvs)?;
    let animation = if arguments.animate { Some(animation(&baked)?) } else { None };
    tell_warnings(&baked.warnings);
    tell_warnings(&foreign(arguments, &path, &baked).into_iter().collect::<Vec<_>>());
    arguments.set.tell_idle(baked.scene.effects);
    let frames = frames(arguments, &baked, animation.as_ref())?;
    let sequence = arguments.frames.is_some() || animation.is_some();
    // The effect `haze` is asked for by name, and has no other place to go.
    let layers = is_exr && arguments.layers;
    let beside = Beside { layers, haze: layers || is_exr && baked.scene.effects.has(Effect::Haze) };
    let painting = engine::Painting { animated: animation.is_some(), timed: arguments.stats };
    let mut painter = arguments.engine.painter(&baked, painting)?;
    let bar = progress::bar("frames", frames.len() as u64);
    let cache = arguments.scene.cache();
    let mut bakes = match (&animation, arguments.follows()) {
        (Some(animation), ClipOcclusion::Frames) => {
            Some(clip::ClipBakes::new(animation, arguments.occlusion_rate, cache.as_deref()))
        }
        _ => None,
    };
    for frame in &frames {
        if let (Some(animation), Some(time)) = (&animation, frame.time) {
            let mesh = animation.mesh(time)?;
            let own = bakes.as_mut().map(|bakes| bakes.at(&baked.scene, &mesh, time)).transpose()?;
            painter.set_mesh(&mesh, own).map_err(refused)?;
        }
        let picture = painter.paint(&frame.camera, baked.gains[0], beside).map_err(refused)?;
        if !sequence && picture.image.alpha.iter().all(|&alpha| alpha == 0.0) {
            return Err(samples::nothing_visible(&baked.scene, &baked.scene.views[0]).into());
        }
        bar.suspend(|| tell_warnings(&cut_words(picture.cut)));
        write(arguments, &path, frame, &picture, &baked.scene.params)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    tell_done(arguments, &baked, &frames, &*painter)?;
    Ok(Exit::Done)
}

/// What is drawn with constants that were fitted with other effects, in words.
fn foreign(arguments: &Arguments, path: &Path, baked: &Baked) -> Option<String> {
    let foreign = Foreign {
        file: arguments.params.as_deref()?,
        fitted: baked.fitted,
        scene: if arguments.effects.is_some() { Path::new("--effects") } else { path },
        effects: baked.scene.effects,
        params: &baked.scene.params,
        chosen: &arguments.set.params(),
    };
    let names = baked.fitted?.iter().map(Effect::name).collect::<Vec<_>>().join(",");
    let remedy = format!("To draw what was fitted, name the scene that was fitted, or --effects {names}.");
    // Whoever names effects has left out what is left out.
    foreign.words("drawn", &remedy, arguments.effects.is_none())
}

/// The requested frames.
fn frames(
    arguments: &Arguments,
    baked: &Baked,
    animation: Option<&Animation>,
) -> Result<Vec<Frame>, Refusal> {
    let (camera, output) = (&baked.scene.views[0].camera, &arguments.output);
    let pace = match (arguments.fps, arguments.loops, arguments.frames) {
        (Some(rate), Some(rounds), _) => Pace::Rounds(rate, rounds),
        (Some(rate), None, count) => Pace::Rate(rate, count),
        (None, _, Some(count)) => Pace::Even(count),
        (None, _, None) => return Ok(frames::still(*camera, output)),
    };
    match (animation, arguments.frames) {
        (Some(animation), _) => frames::animation(camera, animation.seconds, pace, output).ok_or_else(|| {
            let seconds = animation.seconds.1 - animation.seconds.0;
            Refusal::new(format!(
                "{}: its animation of {seconds} s, {} times, has more than {} frames at --fps {}. Give a lower rate, or \
                 fewer --loops.",
                baked.scene.path.display(),
                arguments.loops.unwrap_or(1),
                frames::MOST,
                arguments.fps.unwrap_or_default()
            ))
        }),
        (None, Some(count)) => Ok(frames::turntable(camera, &baked.scene.mesh, count, output)),
        (None, None) => Ok(frames::still(*camera, output)),
    }
}

/// A number of times a second.
fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (1e-3..=1e4).contains(&rate) => Ok(rate),
        _ => Err("give a number of times a second from 0.001 to 10000, such as 24".to_owned()),
    }
}

fn animation(baked: &Baked) -> Result<Animation, Refusal> {
    Animation::open(&baked.scene)?.ok_or_else(|| {
        Refusal::new(format!(
            "{}: its mesh file has no animation with keys. Leave out --animate, or name a mesh that moves.",
            baked.scene.path.display()
        ))
    })
}

fn write(
    arguments: &Arguments,
    scene: &Path,
    frame: &Frame,
    picture: &Picture,
    params: &Params,
) -> Result<(), Refusal> {
    let options = ImageOptions {
        tone: ToneMap {
            operator: Operator::from_name(&arguments.tone).unwrap_or_default(),
            exposure: arguments.exposure,
        },
        attributes: vec![
            ("software".to_owned(), format!("skinfit {}", env!("CARGO_PKG_VERSION"))),
            ("scene".to_owned(), scene.display().to_string()),
            ("parameters".to_owned(), parameters(params)),
        ],
        ..ImageOptions::default()
    };
    let haze = ("haze".to_owned(), picture.haze.as_slice());
    let planes = if picture.haze.is_empty() { &[][..] } else { std::slice::from_ref(&haze) };
    if picture.layers.is_empty() && planes.is_empty() {
        write_image(&frame.path, &picture.image, &options)?;
    } else {
        write_exr_layers(&frame.path, &picture.image, &picture.layers, planes, &options)?;
    }
    Ok(())
}

impl Arguments {
    /// How occlusion follows an animation.
    fn follows(&self) -> ClipOcclusion {
        if self.occlusion == "frames" { ClipOcclusion::Frames } else { ClipOcclusion::Targets }
    }
}

/// What was cut, and what to do about it.
fn cut_words(Cut { texels, pixels }: Cut) -> Vec<String> {
    let mut words = Vec::new();
    if texels > 0 {
        words.push(format!(
            "{texels} texels of the environment's cubes are brighter than 65504, the end of 16-bit textures' range, and \
             are cut there. Use --accuracy exact to have them whole."
        ));
    }
    if pixels > 0 {
        words.push(format!(
            "{pixels} pixels are brighter than 65504, the end of the 16-bit targets' range, and were cut there. Use \
             --accuracy exact and no msaa4 to have them whole."
        ));
    }
    words
}

/// Why an image could not be drawn; of an adapter, with what to do about it.
fn refused(error: PaintError) -> Refusal {
    match error {
        PaintError::Gpu(error) => Task::Render.refusal(&error),
        error => error.into(),
    }
}

fn tell_done(
    arguments: &Arguments,
    baked: &Baked,
    frames: &[Frame],
    painter: &dyn Painter,
) -> Result<(), Refusal> {
    let (view, engine) = (&baked.scene.views[0].name, painter.name());
    if let [first, .., last] = frames {
        let (first, last) = (first.path.display(), last.path.display());
        say(&format!("wrote {} frames, {first} to {last} (view {view}; {engine})", frames.len()))?;
    } else if let [only] = frames {
        say(&format!("wrote {} (view {view}; {engine})", only.path.display()))?;
    }
    if arguments.stats {
        painter.stats().iter().try_for_each(|line| say(line))?;
    }
    Ok(())
}

fn parse_stops(text: &str) -> Result<f32, String> {
    let stops = text.parse().map_err(|_| "give a number of stops, such as -1.5")?;
    // Beyond that, every image is black or white.
    if (-64.0..=64.0).contains(&stops) { Ok(stops) } else { Err("give stops in [-64, 64]".to_owned()) }
}

/// `none`, `environment` or `0.1,0.2,0.3`
fn parse_background(text: &str) -> Result<Background, String> {
    match text {
        "none" => return Ok(Background::None),
        "environment" => return Ok(Background::Environment),
        _ => {}
    }
    let rgb: Vec<f64> = text.split(',').map_while(|c| c.trim().parse().ok()).collect();
    match <[f64; 3]>::try_from(rgb) {
        Ok(rgb) if text.matches(',').count() == 2 && rgb.iter().all(|c| (0.0..=LARGEST).contains(c)) => {
            Ok(Background::Color(rgb))
        }
        _ => Err(format!(
            "give none, environment, or three linear radiances from 0 to {LARGEST:e}, such as 0.1,0.2,0.3"
        )),
    }
}

/// `1920x1080`
pub(super) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']).map(|(width, height)| (width.parse(), height.parse()));
    let Some((Ok(width), Ok(height))) = sides else {
        return Err("give pixels across and down, such as 1920x1080".to_owned());
    };
    let within = |side: u32| (1..=MAX_SIDE).contains(&(side as usize));
    if !within(width) || !within(height) || width as usize * height as usize > MAX_PIXELS {
        return Err(format!("give 1 to {MAX_SIDE} pixels a side, with at most {MAX_PIXELS} in all"));
    }
    Ok((width, height))
}

/// Refuse an ending before any work is done; whether it is EXR.
fn check_output(path: &Path, layers: bool) -> Result<bool, Refusal> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("exr") => Ok(true),
        Some("png") if layers => Err(Refusal::new(format!(
            "{}: a PNG holds no layers. Write an .exr, or leave out --layers.",
            path.display()
        ))),
        Some("png") => Ok(false),
        _ => Err(Refusal::new(format!(
            "{}: unknown kind of image. Give a path that ends in .exr or .png.",
            path.display()
        ))),
    }
}

/// The parameters on one line, as provenance.
fn parameters(params: &Params) -> String {
    let value = |param: Param| match params.rgb(param) {
        [r, g, b] if r == g && g == b => format!("{} = {r}", param.name()),
        rgb => format!("{} = {rgb:?}", param.name()),
    };
    Param::all().map(value).collect::<Vec<_>>().join("; ")
}

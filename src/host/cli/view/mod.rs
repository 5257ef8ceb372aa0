//! `skinfit view`: a window in which a fit is seen and touched.
//!
//! - `absent`: what stands in where the program is built without it
//! - `window`: the window, for the command's arguments

#[cfg(not(feature = "view"))]
mod absent;
#[cfg(test)]
#[cfg(feature = "view")]
mod tests;
#[cfg(feature = "view")]
mod window;

use std::path::PathBuf;

use super::scene::BakeArguments;
#[cfg(not(feature = "view"))]
pub(super) use absent::run;
#[cfg(feature = "view")]
pub(super) use window::run;

/// See a scene or a run in a window, move its constants, watch a fit find them
#[derive(clap::Args)]
#[command(
    after_help = super::with_exit_codes("The window needs a build of its own: `cargo run --release --features view -- view`. F1 lists its keys. A run's sliders stand where its fit ended. Fits of the window are the command line's, from where the sliders stand; their run folders hold what those of `skinfit fit` do, and one that was stopped is resumed by either.\n\nExamples:\n  skinfit view                              the built-in scene\n  skinfit view scene.toml\n  skinfit view noon.toml night.toml         one skin in two lights, as `skinfit fit` fits it\n  skinfit view runs/a                       a run: its scene, its constants, its start\n  skinfit view runs/a --compare runs/b      beside those of another\n  skinfit view scene.toml --screenshot window.png    the window as an image, without a display\n  skinfit view scene.toml --bench           how fast sliders and frames are, as JSON after the fit's own words")
)]
#[cfg_attr(not(feature = "view"), allow(dead_code, reason = "there is no window"))]
pub(super) struct Arguments {
    /// The scene file, several that share one skin, or the run folder of a fit; the built-in scene when left out.
    #[arg(value_name = "SCENE|RUN")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    bakes: BakeArguments,
    /// Begin with these constants, instead of the scene's start values.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    /// Constants of another run beside them.
    #[arg(long, value_name = "RUN")]
    compare: Option<PathBuf>,
    /// Where fits of the window are left [default: that of `skinfit fit`, with `.window` after it].
    #[arg(short, long, value_name = "RUN")]
    output: Option<PathBuf>,
    /// What draws the images: `auto`, a graphics adapter where there is one, or the `cpu`.
    #[arg(long, value_name = "ENGINE", default_value = "auto", value_parser = ["auto", "cpu"])]
    engine: String,
    /// Part of the name of the graphics adapter that draws them [default: $WGPU_ADAPTER_NAME, or the fastest kind].
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Leave the window as a PNG, once it is complete, in the place of opening it; no display is needed.
    #[arg(long, value_name = "FILE", help_heading = "Without a display")]
    screenshot: Option<PathBuf>,
    /// Print how long a slider and frames take, as JSON after what the fit says that it makes.
    #[arg(long, conflicts_with = "screenshot", help_heading = "Without a display")]
    bench: bool,
    /// Size of the window in pixels.
    #[arg(long, value_name = "WxH", value_parser = super::render::parse_size, default_value = "1440x900", help_heading = "Without a display")]
    size: (u32, u32),
    /// Pixels a point: 2 makes everything twice as large.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = parse_scale, help_heading = "Without a display")]
    scale: f32,
    /// Show the terms of the image, too.
    #[arg(long, requires = "screenshot", help_heading = "Without a display")]
    terms: bool,
    /// Have the probe look at this pixel.
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel, requires = "screenshot", help_heading = "Without a display")]
    probe: Option<[u32; 2]>,
    /// Fit before the screenshot is taken.
    #[arg(long, requires = "screenshot", help_heading = "Without a display")]
    fit: bool,
}

fn parse_scale(text: &str) -> Result<f32, String> {
    let scale = text.parse().map_err(|_| "give a number, such as 2")?;
    if (0.25..=8.0).contains(&scale) { Ok(scale) } else { Err("give a factor in [0.25, 8]".to_owned()) }
}

fn parse_pixel(text: &str) -> Result<[u32; 2], String> {
    let pixel = text.split_once(',').map(|(x, y)| (x.trim().parse(), y.trim().parse()));
    let Some((Ok(x), Ok(y))) = pixel else {
        return Err("give a column and a row, such as 160,140".to_owned());
    };
    Ok([x, y])
}

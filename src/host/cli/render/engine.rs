//! Which engine draws, and its options.

use super::Refusal;
use crate::cli::graphics::Task;
use crate::cli::shader::parse_budget;
use crate::cli::tell;
use crate::gpu::error::SOFTWARE_DRIVER;
use crate::gpu::painter::{CpuPainter, GpuPainter, Painter};
use crate::gpu::{Choice, Gpu, GpuError, RenderOptions};
use crate::prepare::Baked;
use crate::render::antialias::Antialias;
use crate::render::shading::Shading;
use crate::scene::suggestion;
use crate::shader::Budget;

/// How frames are drawn.
#[derive(clap::Args)]
#[command(next_help_heading = "Engine")]
pub(super) struct EngineArguments {
    /// What draws: the GPU's renderer, the CPU engine, or `auto`: the GPU where there is an adapter.
    #[arg(long, value_name = "ENGINE", default_value = "auto", value_parser = ["auto", "gpu", "cpu"])]
    engine: String,
    /// Part of the name of the graphics adapter to use [default: $WGPU_ADAPTER_NAME, or the fastest kind].
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Samples a pixel: `none`, `1x1` to `8x8` shaded ones, or `msaa4` (on the GPU) [default: the scene's
    /// samples_per_axis].
    #[arg(long, value_name = "SAMPLES", value_parser = parse_antialias)]
    antialias: Option<Antialias>,
    /// Where the GPU's renderer shades: `visibility_buffer`, in a compute shader once the rasteriser has found which
    /// triangle each sample shows, or `forward`, in the fragment stage, as with msaa4 all the same.
    #[arg(long, value_name = "SHADING", default_value = Shading::default().name(), value_parser = parse_shading)]
    shading: Shading,
    /// How far the GPU's shader may be off: `exact`, `paper` (what the paper's programs did), or a number
    /// relative to white.
    #[arg(long, value_name = "BUDGET", default_value = "exact", value_parser = parse_budget)]
    accuracy: Budget,
}

fn parse_antialias(name: &str) -> Result<Antialias, String> {
    Antialias::from_name(name).ok_or_else(|| "give none, msaa4, or 1x1 to 8x8".to_owned())
}

fn parse_shading(name: &str) -> Result<Shading, String> {
    let known = Shading::ALL.map(Shading::name);
    Shading::from_name(name).ok_or_else(|| format!("unknown shading. {}.", suggestion(name, &known)))
}

/// What an engine is to do with a scene; the CPU's does not ask.
#[derive(Clone, Copy)]
pub(super) struct Painting {
    /// Whether the mesh will move.
    pub(super) animated: bool,
    /// Whether GPU time is measured.
    pub(super) timed: bool,
}

impl EngineArguments {
    /// Whether an adapter may be opened.
    pub(super) fn may_be_gpu(&self) -> bool {
        self.engine != "cpu"
    }

    /// Samples along a pixel's side, where they are not the scene's.
    pub(super) const fn samples_per_axis(&self) -> Option<u32> {
        match self.antialias {
            Some(Antialias::Grid(n)) => Some(n),
            _ => None,
        }
    }

    /// The requested engine with the scene in it.
    pub(super) fn painter(&self, baked: &Baked, painting: Painting) -> Result<Box<dyn Painter>, Refusal> {
        let antialias = self.antialias.unwrap_or(Antialias::Grid(baked.scene.quality.samples_per_axis));
        let auto = self.engine == "auto" && self.adapter.is_none();
        let alone = baked.scene.cpu_alone().filter(|_| auto);
        if let Some(what) = &alone {
            tell(&format!("{what}: the CPU engine renders."));
        }
        if self.may_be_gpu()
            && alone.is_none()
            && let Some(gpu) = self.open()?
        {
            let Painting { animated, timed } = painting;
            let options =
                RenderOptions { antialias, shading: self.shading, budget: self.accuracy, timed, animated };
            let painter = GpuPainter::new(gpu, baked, options);
            return Ok(Box::new(painter.map_err(|error| Task::Render.refusal(&error))?));
        }
        let Antialias::Grid(_) = antialias else {
            return Err(Refusal::new(
                "--antialias msaa4 is a graphics adapter's; the CPU engine shades every sample. Give 2x2, or \
                 render on an adapter.",
            ));
        };
        Ok(Box::new(CpuPainter::new(baked).map_err(super::refused)?))
    }

    /// The adapter's device; none where `auto` finds no adapter that works, which it says.
    fn open(&self) -> Result<Option<Gpu>, Refusal> {
        let choice = Choice { name: self.adapter.clone(), ..Choice::default() };
        match Gpu::open(&choice) {
            Ok(gpu) => Ok(Some(gpu)),
            Err(error) if self.engine == "gpu" || self.adapter.is_some() => Err(Task::Render.refusal(&error)),
            Err(GpuError::NoAdapter) => {
                tell(&format!("no graphics adapter was found: the CPU engine renders. {SOFTWARE_DRIVER}."));
                Ok(None)
            }
            Err(error) => {
                tell(&format!("{error} The CPU engine renders."));
                Ok(None)
            }
        }
    }
}

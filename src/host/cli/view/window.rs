//! The window, for the command's arguments.

use std::path::Path;
use std::sync::Arc;

use skinfit_view::opened::Reading;
use skinfit_view::paint::Engine;
use skinfit_view::window::bench::measure;
use skinfit_view::window::offscreen::Offscreen;
use skinfit_view::window::watch_progress;
use skinfit_view::{Start, ViewError, open_window};

use super::Arguments;
use crate::cli::opened::{SceneOrRun, run_of};
use crate::cli::{CommandLine, Exit, Refusal, quieten_graphics, say, unfinished};

/// Open the window, or leave what it shows.
pub(in crate::cli) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    quieten_graphics();
    watch_progress();
    // Without a cache the built-in scene lives in a folder of its own that goes with the window.
    let homeless = arguments.scenes.is_empty() && arguments.bakes.cache().is_none();
    let scratch = homeless.then(unfinished::scratch).transpose()?;
    let start = start(arguments, scratch.as_ref().map_or(Path::new(""), |scratch| scratch.path()))?;
    let host = Arc::new(CommandLine { words: arguments.bakes.words(), cache: arguments.bakes.cache() });
    let names: Vec<String> = arguments.scenes.iter().map(|path| path.display().to_string()).collect();
    let name = if names.is_empty() { "the built-in scene".to_owned() } else { names.join(", ") };
    let (width, height) = arguments.size;
    let size = [width, height];
    if let Some(file) = &arguments.screenshot {
        let mut window = Offscreen::new(host, start, size, arguments.scale)?;
        window.window.session.terms = arguments.terms;
        if let Some(pixel) = arguments.probe {
            window.window.point_at(pixel);
        }
        if arguments.fit {
            window.settle()?;
            window.window.session.begin_fit(false);
        }
        window.screenshot(file)?;
        say(&format!("wrote {}", file.display()))?;
    } else if arguments.bench {
        let mut window = Offscreen::new(host, start, size, arguments.scale)?;
        let speed = measure(&mut window, size)?;
        say(&serde_json::to_string_pretty(&speed)?)?;
    } else {
        open_window(host, start, &format!("skinfit: {name}")).map_err(without_a_display)?;
    }
    Ok(Exit::Done)
}

/// Why no window was opened, and what shows it all the same.
fn without_a_display(error: ViewError) -> Refusal {
    match error {
        ViewError::NoWindow(_) => Refusal::new(format!(
            "{error} Without one, --screenshot FILE leaves what the window would show as an image."
        )),
        error => error.into(),
    }
}

fn start(arguments: &Arguments, scratch: &Path) -> Result<Start, Refusal> {
    let of = SceneOrRun::of(&arguments.scenes)?;
    let paths = arguments.bakes.kept_paths(&of.scenes, scratch)?;
    let start = of.start(paths, arguments.bakes.cache().as_deref());
    let reading = |reading: Reading| Reading { params: arguments.params.clone(), ..reading };
    Ok(Start {
        scenes: start.scenes.into_iter().map(reading).collect(),
        other: arguments.compare.as_deref().map(run_of).transpose()?,
        run: arguments.output.clone().unwrap_or(start.run),
        engine: Engine { cpu: arguments.engine == "cpu", adapter: arguments.adapter.clone() },
        ..start
    })
}

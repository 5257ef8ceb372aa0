//! What the window asks of the command line: fits, and scene files with what was changed in them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use skinfit_view::fitting::{FitControl, Tell, on_a_thread};
use skinfit_view::host::Fitted;
use skinfit_view::reported::reported;
use skinfit_view::values::Values;
use skinfit_view::{FitRequest, Host, Run, Start as View};

use crate::cli::fit;
use crate::cli::fitted_scene::{Changes, Start};
use crate::cli::interrupt::Interrupt;
use crate::cli::opened::{REPORT, SCENE, SceneOrRun, run_of};
use crate::cli::run_folder::{RunFolder, scene_text};
use crate::engine::Point;
use crate::fit::outcome::Iteration;
use crate::output;
use crate::study::suggest::names;

/// Fits as `skinfit fit` does.
#[derive(Clone)]
pub(super) struct CommandLine {
    /// Words of the command line that say where bakes are kept.
    pub(super) bakes: Vec<String>,
    /// Where they are kept.
    pub(super) cache: Option<PathBuf>,
}

/// The command line of a fit.
#[derive(Parser)]
struct Line {
    #[command(flatten)]
    arguments: fit::Arguments,
}

impl CommandLine {
    /// Fit, and leave the run folder that `skinfit fit` leaves. `watch` is told of each iteration, and the fit goes on when
    /// it returns; it ends soon after `interrupt` is set, with a state to be resumed.
    fn fit(
        &self,
        request: &FitRequest,
        watch: &mut dyn FnMut(&Iteration, &Point),
        interrupt: &Arc<AtomicBool>,
    ) -> Result<Fitted, String> {
        let scene = request.run.join(SCENE);
        let mut words = vec!["fit".to_owned(), scene.display().to_string()];
        words.extend(["-o".to_owned(), request.run.display().to_string()]);
        if request.resume {
            words.push("--resume".to_owned());
        } else {
            // Only a folder that no other run writes to is changed.
            RunFolder::check_free(&request.run).map_err(|refusal| refusal.words)?;
            self.save_scene(&request.scene, &request.values, &scene)?;
        }
        words.extend(request.values.hold_out.iter().map(|view| format!("--hold-out={view}")));
        words.extend(self.bakes.iter().cloned());
        let line = Line::try_parse_from(words).map_err(|error| error.to_string())?;
        let done = fit::run_watched(&line.arguments, &Interrupt::of(interrupt), watch);
        let (_, outcome) = done.map_err(|refusal| refusal.words)?;
        reported(&request.run.join(REPORT), outcome.end)
    }
}

impl Host for CommandLine {
    fn begin_fit(&self, request: FitRequest, tell: Tell) -> Box<dyn FitControl> {
        let host = self.clone();
        on_a_thread(tell, move |watch, interrupt| host.fit(&request, watch, interrupt))
    }

    fn start(&self, path: &Path) -> Result<View, String> {
        let of = SceneOrRun::of(Some(path)).map_err(|refusal| refusal.words)?;
        let scene = of.scene.clone().unwrap_or_else(|| path.to_owned());
        Ok(of.start(scene, self.cache.clone()))
    }

    fn run(&self, path: &Path) -> Result<Run, String> {
        run_of(path).map_err(|refusal| refusal.words)
    }

    fn save_scene(&self, scene: &Path, values: &Values, file: &Path) -> Result<(), String> {
        let effects = names(values.effects);
        let changes = Changes {
            effects: Some(&effects),
            free: Some(&values.free),
            start: Some(Start { form: values.form, params: &values.params, free: &values.free }),
            ..Changes::default()
        };
        let text = scene_text(scene, changes).map_err(|refusal| refusal.words)?;
        output::write(file, text.as_bytes()).map_err(|error| error.to_string())
    }
}

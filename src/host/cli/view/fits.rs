//! What the window asks of the command line: fits, and scene files with what was changed in them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use skinfit_view::fitting::{FitControl, Tell, on_a_thread};
use skinfit_view::host::{FitScene, Fitted};
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
use crate::prepare::view_of;
use crate::report::SCENES;
use crate::study::suggest::names;

/// Where a fit of the window starts, in its run folder.
const START: &str = "start.toml";

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
        watch: &mut dyn FnMut(&Iteration, &[Point]),
        interrupt: &Arc<AtomicBool>,
    ) -> Result<Fitted, String> {
        let FitRequest { scenes, run, resume, .. } = request;
        if !resume {
            // Only a folder that no other run writes to is changed.
            RunFolder::check_free(run).map_err(|refusal| refusal.words)?;
        }
        let mut words = vec!["fit".to_owned()];
        for scene in scenes {
            let file = match scenes.len() {
                1 => run.join(SCENE),
                _ => run.join(SCENES).join(format!("{}.toml", scene.name)),
            };
            words.push(file.display().to_string());
            if !resume {
                self.save_scene(&scene.path, &scene.values, &file)?;
            }
        }
        words.extend(["-o".to_owned(), run.display().to_string()]);
        words.extend(resume.then(|| "--resume".to_owned()));
        words.extend(Self::start_of(request)?);
        words.extend(scenes.iter().flat_map(|scene| held_out(scene, scenes.len() > 1)));
        words.extend(self.bakes.iter().cloned());
        let line = Line::try_parse_from(words).map_err(|error| error.to_string())?;
        let done = fit::run_watched(&line.arguments, &Interrupt::of(interrupt), watch);
        let (_, ends) = done.map_err(|refusal| refusal.words)?;
        reported(&run.join(REPORT), ends)
    }

    /// Where it starts is in the scenes' files, but for gains, which have no place there.
    fn start_of(request: &FitRequest) -> Result<Vec<String>, String> {
        let file = request.run.join(START);
        let gained = request.scenes.iter().any(|scene| scene.values.gains.iter().any(|&gain| gain != 1.0));
        if !request.resume {
            match gained.then_some(&request.start) {
                Some(start) => output::write(&file, start.as_bytes()).map_err(|error| error.to_string())?,
                // Of an earlier fit in this folder.
                None => drop(std::fs::remove_file(&file)),
            }
        }
        let words = ["--params".to_owned(), file.display().to_string()];
        Ok(if file.is_file() { words.to_vec() } else { Vec::new() })
    }
}

/// Which views of a scene are held out, as the command line says it.
fn held_out(scene: &FitScene, several: bool) -> Vec<String> {
    let name = |view: &String| if several { view_of(&scene.name, view) } else { view.clone() };
    scene.values.hold_out.iter().map(|view| format!("--hold-out={}", name(view))).collect()
}

impl Host for CommandLine {
    fn begin_fit(&self, request: FitRequest, tell: Tell) -> Box<dyn FitControl> {
        let host = self.clone();
        on_a_thread(tell, move |watch, interrupt| host.fit(&request, watch, interrupt))
    }

    fn start(&self, path: &Path) -> Result<View, String> {
        let of = SceneOrRun::of(std::slice::from_ref(&path.to_owned())).map_err(|refusal| refusal.words)?;
        let scenes = if of.scenes.is_empty() { vec![path.to_owned()] } else { of.scenes.clone() };
        Ok(of.start(scenes, self.cache.as_deref()))
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
            free_gains: Some(values.free_gains),
            ..Changes::default()
        };
        let text = scene_text(scene, changes).map_err(|refusal| refusal.words)?;
        output::write(file, text.as_bytes()).map_err(|error| error.to_string())
    }
}

//! What a window, or a program that contains this one, asks of the command line: fits, and scene files with what was
//! changed in them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use skinfit_view::fitting::{FitControl, Tell, on_a_thread};
use skinfit_view::host::{FitScene, Fitted};
use skinfit_view::reported::reported;
use skinfit_view::values::Values;
use skinfit_view::{FitRequest, Host, Run, Start as View};

use crate::cli::fitted_scene::{Changes, Start};
use crate::cli::interrupt::Interrupt;
use crate::cli::opened::{REPORT, START, SceneOrRun, run_of, scene_file};
use crate::cli::run_folder::{RunFolder, scene_text};
use crate::cli::{Refusal, fit};
use crate::engine::Point;
use crate::fit::outcome::Iteration;
use crate::model::gain::Gain;
use crate::model::params::Column;
use crate::output;
use crate::prepare::{Loaded, PrepareOptions, untied};
use crate::study::suggest::names;

/// Fits as `skinfit fit` does.
#[derive(Clone)]
pub struct CommandLine {
    /// Further words of its command line: where bakes are kept, and how the solver goes about it.
    pub words: Vec<String>,
    /// Where bakes are kept.
    pub cache: Option<PathBuf>,
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
    ///
    /// # Errors
    /// As the program tells them.
    pub fn fit(
        &self,
        request: &FitRequest,
        watch: &mut dyn FnMut(&Iteration, &[Point]),
        interrupt: &Arc<AtomicBool>,
    ) -> Result<Fitted, Refusal> {
        let FitRequest { scenes, run, resume, .. } = request;
        let files: Vec<PathBuf> =
            scenes.iter().map(|scene| run.join(scene_file(&scene.name, scenes.len() > 1))).collect();
        if *resume {
            scenes.iter().zip(&files).try_for_each(|(scene, file)| goes_on(scene, file))?;
        } else {
            // Only a folder that no other run writes to is changed.
            RunFolder::check_free(run)?;
            for (scene, file) in scenes.iter().zip(&files) {
                save(&scene.path, &scene.values, file)?;
            }
        }
        let mut words = vec!["fit".to_owned()];
        words.extend(files.iter().map(|file| file.display().to_string()));
        words.extend(["-o".to_owned(), run.display().to_string()]);
        words.extend(resume.then(|| "--resume".to_owned()));
        words.extend(Self::start_of(request)?);
        words.extend(request.hold_out().iter().map(|view| format!("--hold-out={view}")));
        words.extend(self.words.iter().cloned());
        let line = Line::try_parse_from(words)?;
        let (_, ends) = fit::run_watched(&line.arguments, &Interrupt::of(interrupt), watch)?;
        reported(&run.join(REPORT), ends).map_err(Refusal::new)
    }

    /// Where it starts is in the scenes' files, but for gains, which have no place there.
    fn start_of(request: &FitRequest) -> Result<Vec<String>, Refusal> {
        let file = request.run.join(START);
        let gained =
            request.scenes.iter().any(|scene| scene.values.gains.iter().any(|&gain| gain != Gain::ONE));
        if !request.resume {
            match gained.then_some(&request.start) {
                Some(start) => output::write(&file, start.as_bytes())?,
                // Of an earlier fit in this folder.
                None => drop(std::fs::remove_file(&file)),
            }
        }
        let words = ["--params".to_owned(), file.display().to_string()];
        Ok(if file.is_file() { words.to_vec() } else { Vec::new() })
    }
}

/// Refuse to go on with a fit of another scene than this, or of other effects or constants: what the boxes say would not
/// hold.
fn goes_on(scene: &FitScene, file: &Path) -> Result<(), Refusal> {
    let other = |what: &str| {
        let file = file.display();
        let words = format!("{file}: the fit that was stopped there was of {what}. Put these back, or fit.");
        Refusal::new(words)
    };
    let kept = Loaded::read(file, &PrepareOptions::default())?;
    let (kept, values) = (&kept.scene, &scene.values);
    let columns = |free: &[Column]| free.iter().map(Column::name).collect::<BTreeSet<_>>();
    if kept.effects != values.effects {
        return Err(other("other effects"));
    }
    if columns(&kept.fit.free) != columns(&untied(&values.free, &values.params, &[]))
        || (kept.fit.free_gains, kept.fit.white_balance) != (values.free_gains, values.white_balance)
    {
        return Err(other("other free constants"));
    }
    if kept.fit.bounds != values.bounds {
        return Err(other("other bounds"));
    }
    let text = scene_text(&scene.path, changes(values, &names(values.effects)))?;
    let unreadable = |error| Refusal::new(format!("{}: {error}", file.display()));
    let of_file = std::fs::read_to_string(file).map_err(unreadable)?;
    let moves: bool = text.parse::<toml::Table>().ok().is_some_and(|scene| {
        scene.get("fit").and_then(|fit| fit.get("cameras")).and_then(toml::Value::as_bool) == Some(true)
    });
    match [&of_file, &text].map(|text| bare(text, moves)) {
        [kept, own] if kept == own => Ok(()),
        _ => Err(other("another scene")),
    }
}

/// A scene's file without what a fit changes in it.
fn bare(text: &str, moves_cameras: bool) -> toml::Table {
    let mut scene: toml::Table = text.parse().unwrap_or_default();
    scene.remove("fit");
    if let Some(views) = scene.get_mut("view").and_then(toml::Value::as_array_mut).filter(|_| moves_cameras) {
        let keys = ["world_to_camera", "eye", "look_at", "up", "camera", "fov_y_degrees", "lens"];
        views.iter_mut().filter_map(toml::Value::as_table_mut).for_each(|view| {
            keys.iter().for_each(|key| drop(view.remove(*key)));
        });
    }
    if let Some(model) = scene.get_mut("model").and_then(toml::Value::as_table_mut) {
        model.remove("params");
        model.remove("effects");
    }
    // A table that a fit has made where there was none.
    scene.retain(|_, value| value.as_table().is_none_or(|table| !table.is_empty()));
    scene
}

/// The text of a scene file with the values that were changed, and absolute paths, in a file of its own.
///
/// # Errors
/// When the scene's file cannot be read any more, or the other not be written.
pub fn save(scene: &Path, values: &Values, file: &Path) -> Result<(), Refusal> {
    let text = scene_text(scene, changes(values, &names(values.effects)))?;
    Ok(output::write(file, text.as_bytes())?)
}

/// What was changed in a scene's file.
fn changes<'a>(values: &'a Values, effects: &'a [&'static str]) -> Changes<'a> {
    Changes {
        effects: Some(effects),
        free: Some(&values.free),
        bounds: Some(&values.bounds),
        start: Some(Start { form: values.form, params: &values.params, free: &values.free }),
        free_gains: Some(values.free_gains),
        white_balance: Some(values.white_balance),
        ..Changes::default()
    }
}

impl Host for CommandLine {
    fn begin_fit(&self, request: FitRequest, tell: Tell) -> Box<dyn FitControl> {
        let host = self.clone();
        on_a_thread(tell, move |watch, interrupt| {
            host.fit(&request, watch, interrupt).map_err(|refusal| refusal.words)
        })
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
        save(scene, values, file).map_err(|refusal| refusal.words)
    }
}

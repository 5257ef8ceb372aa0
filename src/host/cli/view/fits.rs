//! What the window asks of the command line: fits, and scene files with what was changed in them.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use serde_json::Value;
use skinfit_view::host::{Fitted, ViewScore};
use skinfit_view::values::Values;
use skinfit_view::{FitRequest, Host};

use crate::cli::fit;
use crate::cli::fitted_scene::{Changes, Start};
use crate::cli::interrupt::Interrupt;
use crate::cli::run_folder::{RunFolder, scene_text};
use crate::engine::Point;
use crate::fit::outcome::Iteration;
use crate::output;
use crate::study::suggest::names;

/// The scene's file as it is fitted, in the run folder: what `skinfit fit` leaves there, too.
pub(super) const SCENE: &str = "scene.toml";

/// The report's numbers.
const REPORT: &str = "report.json";

/// Fits as `skinfit fit` does.
pub(super) struct CommandLine {
    /// Words of the command line that say where bakes are kept.
    pub(super) bakes: Vec<String>,
}

/// The command line of a fit.
#[derive(Parser)]
struct Line {
    #[command(flatten)]
    arguments: fit::Arguments,
}

impl Host for CommandLine {
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
        Ok(Fitted { outcome, views: scores(&request.run.join(REPORT))? })
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

/// How good each view is, as a report says.
fn scores(report: &Path) -> Result<Vec<ViewScore>, String> {
    let unreadable = |reason: String| format!("{}: {reason}. Fit again.", report.display());
    let bytes = std::fs::read(report).map_err(|error| unreadable(error.to_string()))?;
    let report: Value = serde_json::from_slice(&bytes).map_err(|error| unreadable(error.to_string()))?;
    let views = report["views"].as_object().ok_or_else(|| unreadable("it lists no views".to_owned()))?;
    let number = |view: &Value, key: &str| view[key].as_f64().unwrap_or(f64::NAN);
    let score = |(name, view): (&String, &Value)| ViewScore {
        view: name.clone(),
        held_out: view["held_out"].as_bool().unwrap_or(false),
        psnr: number(view, "psnr"),
        ssim: number(view, "ssim"),
        flip: number(view, "flip"),
    };
    Ok(views.iter().map(score).collect())
}

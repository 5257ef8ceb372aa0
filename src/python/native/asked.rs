//! A fit that Python asks for, as the command line takes it.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use skinfit_core::engine::Point;
use skinfit_core::fit::outcome::Iteration;
use skinfit_core::model::params::Param;
use skinfit_core::prepare::{NamedScene, PrepareError, scene_names};
use skinfit_host::cli::CommandLine;
use skinfit_view::FitRequest;
use skinfit_view::host::FitScene;

use crate::errors::Refused;
use crate::scene::Read;
use crate::words::in_python;

/// A requested fit.
pub(crate) struct Asked {
    reads: Vec<Arc<Read>>,
    hold_out: Vec<String>,
    line: CommandLine,
    request: FitRequest,
}

impl Asked {
    /// A fit of these scenes as they stand, as one skin into the folder `run`, by further words of the command line.
    pub(crate) fn new(
        reads: Vec<Arc<Read>>,
        run: PathBuf,
        words: Vec<String>,
        hold_out: Vec<String>,
        resume: bool,
    ) -> Result<Self, Refused> {
        let Some(first) = reads.first() else {
            // The command line would take the built-in scene.
            return Err(Refused::Fit("no scene is given. Name at least one.".to_owned()));
        };
        let kept = match &first.cache {
            Some(cache) => vec!["--cache".to_owned(), cache.display().to_string()],
            None => vec!["--no-cache".to_owned()],
        };
        let held = hold_out.iter().map(|name| format!("--hold-out={name}")).collect();
        let line = CommandLine { words: [kept, held, words].concat(), cache: first.cache.clone() };
        let paths: Vec<PathBuf> = reads.iter().map(|read| read.path.clone()).collect();
        let asked = |(name, read): (String, &Arc<Read>)| FitScene {
            name,
            path: read.path.clone(),
            values: read.values(),
        };
        let scenes = scene_names(&paths)?.into_iter().zip(&reads).map(asked).collect();
        let request = FitRequest { scenes, start: String::new(), run, resume };
        Ok(Self { reads, hold_out, line, request })
    }

    /// The constants that are told of each scene.
    pub(crate) fn shown(&self) -> Vec<Vec<Param>> {
        self.request.scenes.iter().map(|scene| scene.values.rows()).collect()
    }

    /// Fit, as [`CommandLine::fit`] does.
    pub(crate) fn fit(
        &self,
        watch: &mut dyn FnMut(&Iteration, &[Point]),
        interrupt: &Arc<AtomicBool>,
    ) -> Result<(), Refused> {
        self.check_held_out()?;
        let fitted = self.line.fit(&self.request, watch, interrupt);
        fitted.map(drop).map_err(|refusal| Refused::Fit(in_python(refusal.words())))
    }

    /// Refuse names of no view before the command line does, as an error about views.
    fn check_held_out(&self) -> Result<(), Refused> {
        if self.hold_out.is_empty() {
            return Ok(());
        }
        let named = self.request.scenes.iter().zip(&self.reads);
        let named: Vec<NamedScene> = named
            .map(|(scene, read)| NamedScene { name: scene.name.clone(), loaded: read.loaded.clone() })
            .collect();
        NamedScene::marked(&named, &self.hold_out).map_err(PrepareError::from)?;
        Ok(())
    }
}

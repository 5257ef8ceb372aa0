//! Ablation: each effect and each term left out in turn, what the images lose and what is saved.
//!
//! - [`case`]: what is left out; [`mod@refit`]: what is left, fitted again
//! - `study`: a case evaluated; [`row`]: its errors beside the whole model's
//! - [`measure`]: the time of a case beside the whole model's
//! - [`files`]: the table, `results.csv`, `results.json`, pictures; [`page`]: `report.html`, `tables` and [`mod@pairs`]
//!   in it
//!
//! Images are compared with the scene's targets, or with the whole model where there are none. Several scenes are one skin:
//! a part is left out of all of them at once. Views that are held out are scored, and no fit sees them.

pub mod case;
pub mod files;
pub mod measure;
pub mod page;
pub mod pairs;
pub mod refit;
pub mod row;
mod study;
mod tables;
mod units;

use std::path::PathBuf;

use super::StudyError;
use super::reference::{ReferenceView, Source};
use super::subject::{SampledScene, Subject};
use crate::fit::outcome::Ending;
use crate::model::effects::Effects;
use crate::model::evaluate::Setup;
use crate::prepare::{NamedScene, PrepareError, PrepareOptions, read_one_skin};
use crate::progress;
use crate::scene::Loss;
use case::Case;
use measure::Clocks;
use refit::{errors_of, refit};
pub use row::{Constant, HeldOutRow, Row, ViewRow};
use study::{Evaluated, Place, Study, references};

/// What is to be ablated, and how.
#[derive(Clone, Debug, Default)]
pub struct AblationOptions {
    /// Leave two parts out at a time, too.
    pub pairs: bool,
    /// Fit what is left again in each case.
    pub refit: bool,
    /// A parameter file to take constants from, instead of a fit of the whole model.
    pub params: Option<PathBuf>,
    /// What no fit sees and all are scored on: views, scenes, or `SCENE/VIEW`.
    pub hold_out: Vec<String>,
    /// Where bakes are kept.
    pub cache: Option<PathBuf>,
    /// Whether the renderer is timed on a graphics adapter.
    pub gpu: GpuTiming,
}

/// Whether the renderer is timed on a graphics adapter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GpuTiming {
    /// Where there is an adapter of hardware; on one of software the time would be the CPU's.
    #[default]
    Auto,
    /// On whatever adapter there is.
    Always,
    /// Not at all.
    Never,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Ablation {
    /// What images were compared with.
    pub source: Source,
    /// The scenes' names, where there are several.
    pub scenes: Vec<String>,
    /// Where the constants come from, in words.
    pub constants: String,
    /// Whether what was left was fitted again.
    pub refitted: bool,
    /// The switches of the whole model, with what any of the scenes has on.
    pub setup: Setup,
    /// The loss that the scene names.
    pub loss: Loss,
    /// The reference images.
    pub references: Vec<ReferenceView>,
    /// Those of the views that are held out.
    pub held_out: Vec<ReferenceView>,
    /// The whole model, then each case.
    pub rows: Vec<Row>,
    /// What the renderer was timed on; none where it was not.
    pub adapter: Option<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Ablation {
    /// The cases whose fit did not converge.
    #[must_use]
    pub fn unconverged(&self) -> Vec<String> {
        let failed = |row: &&Row| row.ending.is_some_and(|ending| ending != Ending::Converged);
        self.rows.iter().filter(failed).map(|row| row.left_out.name()).collect()
    }
}

/// Leave each part of the model out in turn, of all `scenes` at once: several are one skin.
///
/// # Errors
/// When a stage refuses its input, or a fit cannot be done.
pub fn ablate(scenes: &[PathBuf], options: &AblationOptions) -> Result<Ablation, StudyError> {
    let prepare = PrepareOptions {
        fit: true,
        params: options.params.clone(),
        cache: options.cache.clone(),
        ..PrepareOptions::default()
    };
    let (places, whole) = read(scenes, &prepare, options)?;
    let source = whole.source;
    // Beside itself, the whole model has nothing to be fitted to.
    let fit = source == Source::Targets && (options.refit || options.params.is_none());
    let own = whole.scenes.start.clone();
    let (outcome, starts) = match (fit, options.refit) {
        (false, _) => (None, None),
        (true, false) => (Some(whole.fit(&errors_of(&whole))?), None),
        // From the starts that its parts have, but the one that is its own end.
        (true, true) => Some(refit(&whole, None, &own)?).unzip(),
    };
    let point = outcome.as_ref().map_or_else(|| own.clone(), |outcome| outcome.end.clone());
    // Without targets, the whole model at its constants is what the others should look like.
    let made = (source == Source::Model).then(|| whole.images(&point)).transpose()?;
    let points = whole.scenes.parts.iter().map(|part| whole.scenes.point_of(part, &point)).collect();
    let [references, held_out] = references(&whole);
    let setup = union(&places, &whole);
    let loss = whole.scenes.first().baked.scene.fit.loss;
    let study = Study {
        places,
        prepare,
        options,
        loss,
        references,
        held_out,
        made,
        point: &point,
        points,
        own: &own,
    };
    let clocks = Clocks::new(&whole, &point, options.gpu)?;
    let mut warnings: Vec<String> =
        whole.scenes.parts.iter().flat_map(|part| part.baked.warnings.iter().cloned()).collect();
    warnings.extend(clocks.warning.clone());

    let compared = study.compare(&whole, &point)?;
    let before = study.before(&whole, &compared);
    let full = Evaluated { case: Case::default(), compared, point: point.clone(), outcome, starts };
    let cases = Case::all(setup.effects, options.pairs);
    let mut held = Vec::new();
    let bar = progress::bar("cases", 1 + cases.len() as u64);
    let mut rows = vec![full.row(&whole, &clocks, &before, None)?];
    let psnr = rows[0].held_out.as_ref().and_then(|held| held.psnr);
    bar.inc(1);
    for case in cases {
        bar.set_message(case.name());
        match study.evaluate(case.clone())? {
            Some((subject, evaluated)) => rows.push(evaluated.row(&subject, &clocks, &before, psnr)?),
            // A mesh that the scene poses stays posed; a pair says nothing new.
            None => {
                held.extend((case.left_out.len() == 1).then(|| case.name()));
                continue;
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if !held.is_empty() {
        let held = held.join(", ");
        warnings.push(format!("Not left out, as the scene's own morph_weights or time ask for it: {held}."));
    }
    let several = whole.scenes.several();
    Ok(Ablation {
        source,
        scenes: whole.scenes.parts.iter().filter(|_| several).map(|part| part.name.clone()).collect(),
        constants: words(options, source, &whole),
        refitted: options.refit,
        setup,
        loss,
        adapter: clocks.adapter(),
        references: study.references,
        held_out: study.held_out,
        rows,
        warnings,
    })
}

/// The whole model of all scenes, but for the views that are held out.
fn read(
    paths: &[PathBuf],
    prepare: &PrepareOptions,
    options: &AblationOptions,
) -> Result<(Vec<Place>, Subject), StudyError> {
    let scenes = read_one_skin(paths, prepare, |_| {})?;
    let marks = NamedScene::marked(&scenes, &options.hold_out).map_err(PrepareError::from)?;
    let places: Vec<Place> =
        scenes.iter().zip(&marks).map(|(scene, marked)| Place::of(scene, marked.clone())).collect();
    let sampled = scenes.into_iter().zip(&marks);
    let sampled =
        sampled.map(|(NamedScene { name, loaded }, marked)| SampledScene::new(name, loaded, marked));
    let whole = Subject::of(sampled.collect::<Result<_, _>>()?, None)?;
    Ok((places, whole))
}

/// The switches of the whole model, with what any of the scenes has on.
fn union(places: &[Place], whole: &Subject) -> Setup {
    let effects = places.iter().flat_map(|place| place.effects.iter());
    let setup = whole.scenes.first().baked.setup();
    Setup { effects: effects.fold(setup.effects, Effects::with), ..setup }
}

/// Where the constants come from.
fn words(options: &AblationOptions, source: Source, whole: &Subject) -> String {
    let what = match whole.scenes.several() {
        true => "one fit of the whole model to the targets of all scenes",
        false => "a fit of the whole model to the targets",
    };
    match (&options.params, source) {
        (Some(path), _) => path.display().to_string(),
        (None, Source::Targets) if options.hold_out.is_empty() => what.to_owned(),
        (None, Source::Targets) => format!("{what}, without what is held out"),
        (None, Source::Model) => "the scene's start values".to_owned(),
    }
}

//! Ablation: each effect and each term left out in turn, what the images lose and what is saved.
//!
//! - [`case`]: what is left out; [`mod@refit`]: what is left, fitted again
//! - [`measure`]: the time of a case beside the whole model's
//! - [`files`]: the table, `results.csv`, `results.json`, pictures; [`page`]: `report.html`, [`mod@pairs`]
//!   in it
//!
//! Images are compared with the scene's targets, or with the whole model where there are none.

pub mod case;
pub mod files;
pub mod measure;
pub mod page;
pub mod pairs;
pub mod refit;
mod units;

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::StudyError;
use super::cost::Counts;
use super::reference::{ReferenceView, Source, ViewErrors, mean_loss};
use super::significance::{Change, LossMap, change};
use super::subject::Subject;
use super::timing::Timed;
use crate::engine::{Objective, Point, Unknown};
use crate::fit::outcome::{Ending, Outcome};
use crate::model::effects::Effects;
use crate::model::evaluate::Setup;
use crate::prepare::PrepareOptions;
use crate::progress;
use crate::render::image::Image;
use crate::report::pictures::Picture;
use crate::scene::Loss;
use case::Case;
use measure::Clocks;
use refit::{Starts, errors_of, refit};

/// What is to be ablated, and how.
#[derive(Clone, Debug, Default)]
pub struct AblationOptions {
    /// Leave two parts out at a time, too.
    pub pairs: bool,
    /// Fit what is left again in each case.
    pub refit: bool,
    /// A parameter file to take constants from, instead of a fit of the whole model.
    pub params: Option<PathBuf>,
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
    /// Where the constants come from, in words.
    pub constants: String,
    /// Whether what was left was fitted again.
    pub refitted: bool,
    /// The switches of the whole model.
    pub setup: Setup,
    /// The loss that the scene names.
    pub loss: Loss,
    /// The reference images.
    pub references: Vec<ReferenceView>,
    /// The whole model, then each case.
    pub rows: Vec<Row>,
    /// What the renderer was timed on; none where it was not.
    pub adapter: Option<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// One case.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is left out.
    pub left_out: Case,
    /// The mean loss over all views.
    pub loss: f64,
    /// Its change from the whole model's, with its sampling error.
    pub change: Change,
    /// Each view's errors.
    pub views: Vec<ViewRow>,
    /// What it costs, in counts.
    pub counts: Counts,
    /// A pass of the CPU engine over all samples, every lookup live; the ratio is to the whole model's.
    pub cpu: Option<Timed>,
    /// A frame of the renderer, the first view.
    pub gpu: Option<Timed>,
    /// The constants, and their standard errors where they were fitted.
    pub constants: Vec<Constant>,
    /// How the fit ended, where there was one.
    pub ending: Option<Ending>,
    /// Where the fits of what is left began, where it was fitted again.
    pub starts: Option<Starts>,
}

/// One view of a case.
#[derive(Clone, Debug, Serialize)]
pub struct ViewRow {
    /// Its name.
    pub view: String,
    /// Its mean loss.
    pub loss: f64,
    /// Root mean square difference, linear radiance.
    pub linear_rms: f64,
    /// The same over the reference's root mean square.
    pub relative_rms: f64,
    /// dB.
    pub psnr: Option<f64>,
    /// Structural similarity.
    pub ssim: Option<f64>,
    /// Mean FLIP error.
    pub flip: Option<f64>,
    /// The image and its FLIP map, for cases of one part.
    #[serde(skip)]
    pub pictures: Option<(Picture, Picture)>,
}

/// A constant of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// One standard error.
    pub std_error: Option<f64>,
}

impl Ablation {
    /// The cases whose fit did not converge.
    #[must_use]
    pub fn unconverged(&self) -> Vec<String> {
        let failed = |row: &&Row| row.ending.is_some_and(|ending| ending != Ending::Converged);
        self.rows.iter().filter(failed).map(|row| row.left_out.name()).collect()
    }
}

/// Leave each part of the model out in turn.
///
/// # Errors
/// When a stage refuses its input, or a fit cannot be done.
pub fn ablate(scene: &Path, options: &AblationOptions) -> Result<Ablation, StudyError> {
    let prepare = PrepareOptions {
        fit: true,
        params: options.params.clone(),
        cache: options.cache.clone(),
        ..PrepareOptions::default()
    };
    let whole = Subject::new(scene, &prepare, None, |_| {})?;
    let source = whole.source;
    // Beside itself, the whole model has nothing to be fitted to.
    let fit = source == Source::Targets && (options.refit || options.params.is_none());
    let own = whole.observed.start();
    let (outcome, starts) = match (fit, options.refit) {
        (false, _) => (None, None),
        (true, false) => (Some(whole.fit(&errors_of(&whole))?), None),
        // From the starts that its parts have, but the one that is its own end.
        (true, true) => Some(refit(&whole, None, &own)?).unzip(),
    };
    let point = outcome.as_ref().map_or_else(|| own.clone(), |outcome| outcome.end.clone());
    let images = whole.images(&point)?;
    // Without targets, the whole model at its constants is what the others should look like.
    let made = (source == Source::Model).then(|| images.clone());
    let references = references(&whole);
    let study = Study { scene, prepare, options, references, made, point: &point, own: &own };
    let clocks = Clocks::new(&whole, &point, options.gpu)?;
    let mut warnings = whole.observed.warnings.clone();
    warnings.extend(clocks.warning.clone());

    let loss = whole.observed.scene.fit.loss;
    let errors = study.errors(&images, loss);
    let full = Evaluated { case: Case::default(), images, errors, point: point.clone(), outcome, starts };
    let before: Vec<LossMap> = full.errors.iter().map(|errors| errors.map.clone()).collect();
    let cases = Case::all(whole.observed.scene.effects, options.pairs);
    let mut held = Vec::new();
    let bar = progress::bar("cases", 1 + cases.len() as u64);
    let mut rows = vec![full.row(&whole, &clocks, &before)?];
    bar.inc(1);
    for case in cases {
        bar.set_message(case.name());
        let (subject, evaluated) = study.evaluate(case, whole.observed.scene.effects)?;
        // A mesh that the scene poses stays posed.
        if subject.observed.scene.effects != evaluated.case.effects(whole.observed.scene.effects) {
            // A pair says nothing new.
            held.extend((evaluated.case.left_out.len() == 1).then(|| evaluated.case.name()));
            continue;
        }
        rows.push(evaluated.row(&subject, &clocks, &before)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if !held.is_empty() {
        let held = held.join(", ");
        warnings.push(format!("Not left out, as the scene's own morph_weights or time ask for it: {held}."));
    }
    Ok(Ablation {
        source,
        constants: words(options, source),
        refitted: options.refit,
        setup: whole.observed.setup(),
        loss,
        adapter: clocks.adapter(),
        references: study.references.clone(),
        rows,
        warnings,
    })
}

/// Where the constants come from.
fn words(options: &AblationOptions, source: Source) -> String {
    match (&options.params, source) {
        (Some(path), _) => path.display().to_string(),
        (None, Source::Targets) => "a fit of the whole model to the targets".to_owned(),
        (None, Source::Model) => "the scene's start values".to_owned(),
    }
}

fn references(whole: &Subject) -> Vec<ReferenceView> {
    let views = whole.observed.scene.views.iter().zip(whole.engine.views().iter());
    views.map(|(view, observed)| ReferenceView::new(view, observed)).collect()
}

/// What all cases share.
struct Study<'a> {
    scene: &'a Path,
    prepare: PrepareOptions,
    options: &'a AblationOptions,
    references: Vec<ReferenceView>,
    /// The whole model's images, where they are the reference.
    made: Option<Vec<Image>>,
    /// The whole model's constants.
    point: &'a Point,
    /// Where a fit of the scene starts.
    own: &'a Point,
}

impl Study<'_> {
    fn errors(&self, images: &[Image], loss: Loss) -> Vec<ViewErrors> {
        self.references.iter().zip(images).map(|(reference, image)| reference.errors(image, loss)).collect()
    }

    fn evaluate(&self, case: Case, full: Effects) -> Result<(Subject, Evaluated), StudyError> {
        let effects = case.effects(full);
        let prepare = PrepareOptions { effects: Some(effects), ..self.prepare.clone() };
        let subject = Subject::new(self.scene, &prepare, self.made.as_deref(), |loaded| {
            let scene = &mut loaded.scene;
            // What is fitted starts where the whole model ended.
            scene.params = self.point.params.clone();
            case.apply(effects, &mut scene.params, &mut scene.fit.free);
            let compared = scene.views.iter().map(|view| self.made.is_some() || view.target.is_some());
            let gains = loaded.gains.iter_mut().zip(compared).filter(|(_, compared)| *compared);
            gains.zip(&self.point.gains).for_each(|((own, _), gain)| *own = *gain);
        })?;
        let from_whole =
            Point { params: subject.observed.scene.params.clone(), gains: self.point.gains.clone() };
        let (outcome, starts) = if self.options.refit {
            let mut own = self.own.clone();
            case.apply(effects, &mut own.params, &mut Vec::new());
            Some(refit(&subject, Some(&from_whole), &own)?).unzip()
        } else {
            (None, None)
        };
        let point = outcome.as_ref().map_or(from_whole, |outcome| outcome.end.clone());
        let images = subject.images(&point)?;
        let errors = self.errors(&images, subject.observed.scene.fit.loss);
        Ok((subject, Evaluated { case, images, errors, point, outcome, starts }))
    }
}

/// A case's images and how far they are off.
struct Evaluated {
    case: Case,
    images: Vec<Image>,
    errors: Vec<ViewErrors>,
    point: Point,
    outcome: Option<Outcome>,
    starts: Option<Starts>,
}

impl Evaluated {
    fn row(self, subject: &Subject, clocks: &Clocks, before: &[LossMap]) -> Result<Row, StudyError> {
        let (cpu, gpu) = clocks.time(subject, &self.point)?;
        let maps: Vec<LossMap> = self.errors.iter().map(|errors| errors.map.clone()).collect();
        let keep = self.case.left_out.len() < 2;
        let names = subject.observed.scene.views.iter().map(|view| view.name.clone());
        let view = |(view, (errors, image)): (String, (&ViewErrors, &Image))| ViewRow {
            view,
            loss: mean_loss([&errors.map]),
            linear_rms: errors.linear,
            relative_rms: errors.relative,
            psnr: errors.scores.map(|scores| scores.psnr),
            ssim: errors.scores.map(|scores| scores.ssim),
            flip: errors.scores.map(|scores| scores.flip),
            pictures: keep.then(|| (Picture::of_image(image), errors.flip.clone())),
        };
        Ok(Row {
            loss: mean_loss(&maps),
            change: change_of(subject, before, &maps),
            views: names.zip(self.errors.iter().zip(&self.images)).map(view).collect(),
            counts: Counts::new(subject, &self.point.params)?,
            cpu: Some(cpu),
            gpu,
            constants: constants(subject, &self.point, self.outcome.as_ref()),
            ending: self.outcome.map(|outcome| outcome.ending),
            starts: self.starts,
            left_out: self.case,
        })
    }
}

/// How the loss changes. Where the whole model leaves nothing but rounding, there is no misfit that a change could be
/// mistaken for.
fn change_of(subject: &Subject, before: &[LossMap], after: &[LossMap]) -> Change {
    let (found, rounding) = (change(before, after), rounding(subject, before));
    let t = found.t.filter(|_| rounding == 0.0 || mean_loss(before) > rounding);
    Change { t, rounding, ..found }
}

/// What roundings may do to the mean loss, of either of two fits and in either direction.
fn rounding(subject: &Subject, before: &[LossMap]) -> f64 {
    let weight: f64 = before.iter().flat_map(|map| &map.weight).sum();
    if weight > 0.0 { 4.0 * subject.engine.rounding() / weight } else { 0.0 }
}

/// What is free, its value and its error.
fn constants(subject: &Subject, point: &Point, outcome: Option<&Outcome>) -> Vec<Constant> {
    let error = |name: &str| {
        let known = outcome?.unknowns.iter().find(|unknown| unknown.unknown.name() == name)?;
        known.std_error
    };
    let unknowns = subject.observed.unknowns();
    let constant = |unknown: &Unknown| {
        let name = unknown.name();
        Constant { value: unknown.get(point), std_error: error(&name), name }
    };
    unknowns.iter().map(constant).collect()
}

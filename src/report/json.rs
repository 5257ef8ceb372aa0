//! `report.json`: what a run found, for programs.
//!
//! Keys stand in the order of the format's description; `null` stands for a number that does not
//! exist (a standard error at a bound, a score of a view without covered pixels, an infinite bound).

use serde::ser::{Serialize, Serializer};

use super::maps::{MapEvidence, MapSummary};
use super::metrics::Scores;
use super::misfit::Misfit;
use super::{RunInfo, StageSeconds};
use crate::engine::{Point, Unknown};
use crate::fit::outcome::{Ending, Iteration, Outcome, UnknownOutcome};
use crate::fit::profile::Profile;
use crate::fit::statistics::ErrorBasis;
use crate::model::params::{Channels, Column, Param};

/// The whole of `report.json`.
///
/// Numbers that are not finite are written as `null`, as `serde_json` does with every `f64`.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Summary {
    /// The loss before and after.
    pub loss: StartEnd,
    /// Each parameter that was free, by its name.
    pub params: Ordered<ParamSummary>,
    /// Each view's scores, by its name.
    pub views: Ordered<ViewSummary>,
    /// The means of these, of the views that were fitted and of those that were held out.
    pub scores: MeanScores,
    /// Which solver ran.
    pub solver: &'static str,
    /// Which engine evaluated the model: `cpu` or `gpu`.
    pub engine: String,
    /// Iterations done.
    pub iterations: u64,
    /// Passes over the samples.
    pub evaluations: u64,
    /// Seconds spent in each stage.
    pub seconds: StageSeconds,
    /// Surface samples over all views.
    pub samples: u64,
    /// How the fit ended.
    pub ending: Ending,
    /// What was minimised.
    pub loss_name: &'static str,
    /// Each unknown: a tied parameter, one channel of a parameter, or a view's gain.
    pub unknowns: Vec<UnknownSummary>,
    /// What the standard errors rest on.
    pub errors: Errors,
    /// How far the loss lets the weakest unknown go, where there is a weak one.
    pub profile: Option<Profile>,
    /// How the unknowns' errors hang together.
    pub correlations: Correlations,
    /// Combinations that the images do not determine, each a unit vector (unknown: component).
    pub undetermined: Vec<Ordered<f64>>,
    /// The loss after each iteration.
    pub history: Vec<Iteration>,
    /// What the fit gets wrong as a whole, and where.
    pub misfit: Misfit,
    /// The views' pictures and terms, and the files of fitted maps, beside this file.
    pub files: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Where the numbers come from.
    pub provenance: Ordered<String>,
    /// What whole maps gained, where they were fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maps: Option<MapSummary>,
}

/// What standard errors rest on.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Errors {
    /// Independent residuals, roundings, or squares of pixels, and how large these are.
    #[serde(flatten)]
    pub basis: ErrorBasis,
    /// By how many times the most they exceed those of independent residuals.
    pub most_over_noise: Option<f64>,
}

/// A number before and after the fit.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StartEnd {
    /// Before.
    pub start: f64,
    /// After.
    pub end: f64,
}

/// What is known of one parameter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ParamSummary {
    /// Where the fit began.
    pub start: Value<f64>,
    /// Where it ended.
    pub value: Value<f64>,
    /// One standard error; `null` where there is none.
    pub std_error: Option<Value<Option<f64>>>,
    /// What it were if residuals were independent.
    pub noise_error: Option<Value<Option<f64>>>,
    /// Whether the images determine it (each of its channels).
    pub identifiable: bool,
    /// Whether it (or a channel of it) ended on a bound.
    pub at_bound: bool,
}

/// A number, or one a channel.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Value<T> {
    /// One for all channels.
    Tied(T),
    /// Red, green, blue.
    Rgb([T; 3]),
}

/// How well one view is matched; `null` when no pixel of it is covered.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ViewSummary {
    /// dB; 200 stands for equal images.
    pub psnr: Option<f64>,
    /// 1 for equal images.
    pub ssim: Option<f64>,
    /// 0 for equal images.
    pub flip: Option<f64>,
    /// How many pixels were compared.
    pub pixels: usize,
    /// Whether it took no part in the fit.
    pub held_out: bool,
}

impl ViewSummary {
    /// The scores over `pixels` compared pixels of a view that took part in the fit, or was held out of it.
    #[must_use]
    pub fn new(scores: Option<Scores>, pixels: usize, held_out: bool) -> Self {
        let of = |score: fn(&Scores) -> f64| scores.as_ref().map(score);
        Self { psnr: of(|s| s.psnr), ssim: of(|s| s.ssim), flip: of(|s| s.flip), pixels, held_out }
    }
}

/// How well the fit matches what it has seen, and what it has not.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MeanScores {
    /// The views that were fitted; `null` without any.
    pub fitted: Option<ViewMeans>,
    /// The views that were held out; `null` without any.
    pub held_out: Option<ViewMeans>,
}

/// The mean scores of some views; `null` when no pixel of them is covered.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ViewMeans {
    /// How many views.
    pub views: usize,
    /// dB.
    pub psnr: Option<f64>,
    /// 1 for equal images.
    pub ssim: Option<f64>,
    /// 0 for equal images.
    pub flip: Option<f64>,
}

impl MeanScores {
    fn of(views: &[ViewSummary]) -> Self {
        let part = |held_out: bool| ViewMeans::of(views.iter().filter(|view| view.held_out == held_out));
        Self { fitted: part(false), held_out: part(true) }
    }
}

impl ViewMeans {
    /// A view without covered pixels has no part in a mean.
    fn of<'a>(views: impl Iterator<Item = &'a ViewSummary>) -> Option<Self> {
        let views: Vec<&ViewSummary> = views.collect();
        let mean = |score: fn(&ViewSummary) -> Option<f64>| {
            let scores: Vec<f64> = views.iter().filter_map(|view| score(view)).collect();
            (!scores.is_empty()).then(|| scores.iter().sum::<f64>() / scores.len() as f64)
        };
        (!views.is_empty()).then(|| Self {
            views: views.len(),
            psnr: mean(|view| view.psnr),
            ssim: mean(|view| view.ssim),
            flip: mean(|view| view.flip),
        })
    }
}

/// What is known of one unknown.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct UnknownSummary {
    /// `hilite`, `hilite.g`, `gain.<view>`.
    pub name: String,
    /// Where the fit began.
    pub start: f64,
    /// Where it ended.
    pub value: f64,
    /// One standard error.
    pub std_error: Option<f64>,
    /// What it were if residuals were independent.
    pub noise_error: Option<f64>,
    /// Whether the images determine it.
    pub identifiable: bool,
    /// Whether it ended on a bound.
    pub at_bound: bool,
    /// Least and greatest allowed value; `null` for an infinite one.
    pub bounds: [f64; 2],
    /// Root mean square change of the weighted image for a change by 1, at the start.
    pub sensitivity: f64,
}

/// The correlation matrix.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Correlations {
    /// The unknowns, in the order of rows and columns.
    pub names: Vec<String>,
    /// Rows; `null` beside an unknown without a standard error.
    pub matrix: Vec<Vec<Option<f64>>>,
}

/// A JSON object whose keys keep their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Ordered<T>(pub Vec<(String, T)>);

impl<T: Serialize> Serialize for Ordered<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

impl Summary {
    /// The summary of a run whose views have the scores `views`, in their order, and of what it gets wrong.
    #[must_use]
    pub fn new(
        run: &RunInfo,
        outcome: &Outcome,
        views: &[ViewSummary],
        files: Vec<String>,
        warnings: Vec<String>,
        misfit: Misfit,
    ) -> Self {
        let names: Vec<String> = outcome.unknowns.iter().map(|u| run.label(&u.unknown.name())).collect();
        let order = names.len().max(1);
        Self {
            loss: StartEnd { start: outcome.loss_start, end: outcome.loss_end },
            params: Ordered(params(run, outcome)),
            views: Ordered(run.views.iter().map(|v| v.name.clone()).zip(views.iter().copied()).collect()),
            scores: MeanScores::of(views),
            solver: outcome.solver,
            engine: run.engine.clone(),
            iterations: outcome.iterations,
            evaluations: outcome.evaluations,
            seconds: run.seconds,
            samples: run.samples,
            ending: outcome.ending,
            loss_name: run.loss.name(),
            unknowns: outcome.unknowns.iter().zip(&names).map(|(u, name)| unknown(u, name)).collect(),
            errors: Errors {
                basis: outcome.errors,
                most_over_noise: outcome.most_over_noise().filter(|x| x.is_finite()),
            },
            profile: outcome
                .profile
                .clone()
                .map(|profile| Profile { name: run.label(&profile.name), ..profile }),
            correlations: Correlations {
                names,
                matrix: outcome
                    .correlations
                    .chunks(order)
                    .take(outcome.unknowns.len())
                    .enumerate()
                    .map(|(i, row)| row.iter().enumerate().map(|(j, &r)| known(outcome, i, j, r)).collect())
                    .collect(),
            },
            undetermined: outcome
                .undetermined
                .iter()
                .map(|d| Ordered(d.components.iter().map(|(name, x)| (run.label(name), *x)).collect()))
                .collect(),
            history: outcome.history.clone(),
            misfit,
            files,
            warnings,
            provenance: Ordered(run.origin()),
            maps: run.maps.as_ref().map(MapEvidence::summary),
        }
    }

    /// The text of `report.json`.
    ///
    /// # Errors
    /// None that these types can cause.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}

/// A correlation of unknowns that both have an error.
fn known(outcome: &Outcome, i: usize, j: usize, r: f64) -> Option<f64> {
    let has = |k: usize| outcome.unknowns.get(k).is_some_and(|u| u.std_error.is_some());
    (has(i) && has(j) && r.is_finite()).then_some(r)
}

fn unknown(outcome: &UnknownOutcome, name: &str) -> UnknownSummary {
    let (lower, upper) = outcome.unknown.bounds();
    UnknownSummary {
        name: name.to_owned(),
        start: outcome.start,
        value: outcome.value,
        std_error: outcome.std_error,
        noise_error: outcome.noise_error,
        identifiable: outcome.identifiable,
        at_bound: outcome.at_bound,
        bounds: [lower, upper],
        sensitivity: outcome.sensitivity,
    }
}

/// The unknowns gathered by parameter (and by scene, of what each has of its own), in the order of the unknowns.
fn params(run: &RunInfo, outcome: &Outcome) -> Vec<(String, ParamSummary)> {
    let mut free: Vec<(Option<usize>, Param)> = Vec::new();
    for unknown in &outcome.unknowns {
        if let Some(whose) = whose(&unknown.unknown).filter(|whose| !free.contains(whose)) {
            free.push(whose);
        }
    }
    let named = |(scene, param): (Option<usize>, Param)| {
        let unknown = match scene {
            Some(scene) => Unknown::Own(scene, Column::tied(param)),
            None => Unknown::Param(Column::tied(param)),
        };
        (run.label(&unknown.name()), summarise((scene, param), outcome))
    };
    free.into_iter().map(named).collect()
}

/// The parameter of an unknown, and the scene that it is free in alone.
fn whose(unknown: &Unknown) -> Option<(Option<usize>, Param)> {
    match unknown {
        Unknown::Param(column) => Some((None, column.param)),
        Unknown::Own(scene, column) => Some((Some(*scene), column.param)),
        Unknown::Gain(_) => None,
    }
}

fn summarise((scene, param): (Option<usize>, Param), outcome: &Outcome) -> ParamSummary {
    let (mut errors, mut noise) = ([None; 3], [None; 3]);
    let (mut tied, mut identifiable, mut at_bound) = (true, true, false);
    for known in &outcome.unknowns {
        let Some(column) = known.unknown.column() else { continue };
        if whose(&known.unknown) == Some((scene, param)) {
            tied &= column.channels == Channels::Tied;
            identifiable &= known.identifiable;
            at_bound |= known.at_bound;
            for c in (0..3).filter(|&c| column.channels.includes(c)) {
                errors[c] = known.std_error.filter(|e| e.is_finite());
                noise[c] = known.noise_error.filter(|e| e.is_finite());
            }
        }
    }
    let rgb = |point: &Point| match scene {
        Some(scene) => point.params.rgb_in(scene, param),
        None => point.params.rgb(param),
    };
    let value = |point: &Point| match tied {
        true => Value::Tied(rgb(point)[0]),
        false => Value::Rgb(rgb(point)),
    };
    let gathered = |errors: [Option<f64>; 3]| {
        errors.iter().any(Option::is_some).then_some(match tied {
            true => Value::Tied(errors[0]),
            false => Value::Rgb(errors),
        })
    };
    ParamSummary {
        start: value(&outcome.start),
        value: value(&outcome.end),
        std_error: gathered(errors),
        noise_error: gathered(noise),
        identifiable,
        at_bound,
    }
}

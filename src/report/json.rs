//! `report.json`: what a run found, for programs.
//!
//! Keys stand in the order of the format's description; `null` stands for a number that does not
//! exist (a standard error at a bound, a score of a view without covered pixels, an infinite bound).

use super::maps::{MapEvidence, MapSummary};
use super::misfit::Misfit;
pub use super::ordered::Ordered;
pub use super::view_summary::{MeanScores, ViewMeans, ViewSummary};
use super::{RunInfo, StageSeconds};
use crate::engine::{Point, Unknown};
use crate::fit::error_basis::ErrorBasis;
use crate::fit::outcome::{Ending, Iteration, Outcome, UnknownOutcome};
use crate::fit::profile::Profile;
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
    /// Each unknown: a tied parameter, one channel of a parameter, a view's gain, or one channel of it.
    pub unknowns: Vec<UnknownSummary>,
    /// What the standard errors rest on.
    pub errors: Errors,
    /// How far the loss lets the weakest unknown go, where there is a weak one.
    pub profile: Option<Profile>,
    /// How the unknowns' errors hang together.
    pub correlations: Correlations,
    /// Combinations that the images do not determine, each a unit vector (unknown: component).
    pub undetermined: Vec<Ordered<f64>>,
    /// Unknowns that are shares of a whole and add up to all that there is, those of each whole together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub full_shares: Vec<Vec<String>>,
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

/// What is known of one unknown.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct UnknownSummary {
    /// `hilite`, `hilite.g`, `gain.<view>`, `gain.<view>.g`.
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
            full_shares: outcome.full_shares.clone(),
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
    let (lower, upper) = outcome.bounds;
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
        Unknown::Gain(..) => None,
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

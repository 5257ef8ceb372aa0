//! What the workers tell each other of a fit.

use serde::{Deserialize, Serialize};
use skinfit_view::FitRequest;
use skinfit_view::fitting::{Message, Step};
use skinfit_view::host::{Fitted, Found, Known, ViewScore};

use crate::engine::Point;
use crate::fit::outcome::{Ending, Iteration};
use crate::model::effects::{Effect, Effects};
use crate::model::params::{Column, Param, Params};

/// What the worker that fits is asked.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum Ask {
    /// Fit from there.
    Fit(Request),
    /// Go on with the fit that was stopped, if it was of the same.
    Resume(Request),
    /// Wait after the iteration that it is at, or go on.
    Pause { on: bool },
    /// End.
    Stop,
}

/// A fit: where it starts, what is free, which effects are on, what is left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    params: Vec<(String, [f64; 3])>,
    free: Vec<String>,
    effects: Vec<String>,
    pub(crate) hold_out: Vec<String>,
}

impl Request {
    pub(crate) fn of(request: &FitRequest) -> Self {
        let values = &request.values;
        Self {
            params: named(&values.params),
            free: values.free.iter().map(Column::name).collect(),
            effects: values.effects.iter().map(|effect| effect.name().to_owned()).collect(),
            hold_out: values.hold_out.clone(),
        }
    }

    /// Once the scene was read, which makes its lights and its own terms known.
    pub(crate) fn effects(&self) -> Result<Effects, String> {
        self.effects.iter().try_fold(Effects::of(&[]), |effects, name| {
            let effect = Effect::from_name(name).ok_or_else(|| format!("the effect {name} is not known."))?;
            Ok(effects.with(effect))
        })
    }

    /// Whether a fit of the one can go on as a fit of the other.
    pub(crate) fn goes_on_as(&self, other: &Self) -> bool {
        (&self.free, &self.effects, &self.hold_out) == (&other.free, &other.effects, &other.hold_out)
    }

    pub(crate) fn set_params(&self, params: &mut Params) {
        set(params, &self.params);
    }

    /// Once the scene was read.
    pub(crate) fn free(&self) -> Result<Vec<Column>, String> {
        let known = |name: &String| column(name).ok_or_else(|| format!("the constant {name} is not known."));
        self.free.iter().map(known).collect()
    }
}

/// The column of that name, as reports have it: `hilite.r`.
pub(crate) fn column(name: &str) -> Option<Column> {
    let columns = |param: Param| std::iter::once(Column::tied(param)).chain(Column::per_channel(param));
    Param::all().flat_map(columns).find(|column| column.name() == name)
}

fn named(params: &Params) -> Vec<(String, [f64; 3])> {
    Param::all().map(|param| (param.name().to_owned(), params.rgb(param))).collect()
}

fn set(params: &mut Params, values: &[(String, [f64; 3])]) {
    for (name, rgb) in values {
        if let Some(param) = Param::from_name(name) {
            params.set_rgb(param, *rgb);
        }
    }
}

/// What the worker that fits has to say.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "is", rename_all = "snake_case")]
pub(crate) enum Say {
    /// It has made a step.
    Step { iteration: Iteration, at: At },
    /// It is over.
    Done { found: Told, views: Vec<ViewScore> },
    /// It failed.
    Failed { words: String },
}

/// A point, by names.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct At {
    params: Vec<(String, [f64; 3])>,
    gains: Vec<f64>,
}

impl At {
    pub(crate) fn of(point: &Point) -> Self {
        Self { params: named(&point.params), gains: point.gains.clone() }
    }

    fn point(self, like: &Params) -> Point {
        let mut params = like.clone();
        set(&mut params, &self.params);
        Point { params, gains: self.gains }
    }
}

/// What was found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Told {
    end: At,
    known: Vec<Known>,
    ending: Ending,
    loss: f64,
    losses: Vec<f64>,
    iterations: u64,
    evaluations: u64,
    seconds: f64,
}

impl Told {
    pub(crate) fn of(found: &Found) -> Self {
        Self {
            end: At::of(&found.end),
            known: found.known.clone(),
            ending: found.ending,
            loss: found.loss,
            losses: found.losses.clone(),
            iterations: found.iterations,
            evaluations: found.evaluations,
            seconds: found.seconds,
        }
    }
}

impl Say {
    /// As the session takes it; what it does not name is as in `like`.
    pub(crate) fn message(self, like: &Params) -> Message {
        match self {
            Self::Step { iteration, at } => {
                Message::Step(Box::new(Step { iteration, point: at.point(like) }))
            }
            Self::Done { found, views } => {
                let Told { end, known, ending, loss, losses, iterations, evaluations, seconds } = found;
                let end = end.point(like);
                let found = Found { end, known, ending, loss, losses, iterations, evaluations, seconds };
                Message::Done(Box::new(Ok(Fitted { found, views })))
            }
            Self::Failed { words } => Message::Done(Box::new(Err(words))),
        }
    }
}

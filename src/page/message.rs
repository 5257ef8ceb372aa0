//! What the workers tell each other of a fit.

use std::collections::BTreeSet;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use skinfit_view::FitRequest;
use skinfit_view::fitting::{Message, Step};
use skinfit_view::host::{FitScene, Fitted, Found, Known, ViewScore};
use skinfit_view::opened::Opened;
use skinfit_view::values::column;

use crate::engine::Point;
use crate::fit::outcome::{Ending, Iteration};
use crate::model::effects::{Effect, Effects};
use crate::model::gain::Gain;
use crate::model::params::{Column, Param, Params};
use crate::prepare::Loaded;

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

/// A fit of the page's scenes, in their order.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    pub(crate) scenes: Vec<OfScene>,
    /// Which views are held out, as the command line names them.
    pub(crate) hold_out: Vec<String>,
}

/// What is fitted of a scene: where it starts, what is free, which effects are on, what is left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct OfScene {
    at: At,
    free: Vec<String>,
    free_gains: bool,
    white_balance: bool,
    effects: Vec<String>,
}

impl Request {
    pub(crate) fn of(request: &FitRequest) -> Self {
        Self { scenes: request.scenes.iter().map(OfScene::of).collect(), hold_out: request.hold_out() }
    }

    /// Whether a fit of the one can go on as a fit of the other.
    pub(crate) fn goes_on_as(&self, other: &Self) -> bool {
        let sorted = |names: &[String]| names.iter().cloned().collect::<BTreeSet<_>>();
        let same = |(one, other): (&OfScene, &OfScene)| {
            (one.free_gains, one.white_balance) == (other.free_gains, other.white_balance)
                && sorted(&one.free) == sorted(&other.free)
                && sorted(&one.effects) == sorted(&other.effects)
        };
        self.scenes.len() == other.scenes.len()
            && self.scenes.iter().zip(&other.scenes).all(same)
            && sorted(&self.hold_out) == sorted(&other.hold_out)
    }
}

impl OfScene {
    fn of(scene: &FitScene) -> Self {
        let values = &scene.values;
        Self {
            at: At { params: named(&values.params), gains: values.gains.iter().map(|gain| gain.0).collect() },
            free: values.free.iter().map(Column::name).collect(),
            free_gains: values.free_gains,
            white_balance: values.white_balance,
            effects: values.effects.iter().map(|effect| effect.name().to_owned()).collect(),
        }
    }

    /// Once the scene was read, which makes its lights and its own terms known.
    pub(crate) fn effects(&self) -> Result<Effects, String> {
        self.effects.iter().try_fold(Effects::of(&[]), |effects, name| {
            let effect = Effect::from_name(name).ok_or_else(|| format!("the effect {name} is not known."))?;
            Ok(effects.with(effect))
        })
    }

    /// As of [`effects`](Self::effects).
    pub(crate) fn free(&self) -> Result<Vec<Column>, String> {
        let known = |name: &String| column(name).ok_or_else(|| format!("the parameter {name} is not known."));
        self.free.iter().map(known).collect()
    }

    /// Begin there, with that free.
    pub(crate) fn set(&self, loaded: &mut Loaded, free: Vec<Column>) {
        set(&mut loaded.scene.params, &self.at.params);
        loaded.gains = self.at.gains.iter().copied().map(Gain).collect();
        let fit = &mut loaded.scene.fit;
        (fit.free, fit.free_gains, fit.white_balance) = (free, self.free_gains, self.white_balance);
    }
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
    Step { iteration: Iteration, at: Vec<At> },
    /// It is over.
    Done { found: Told, views: Vec<ViewScore> },
    /// It failed.
    Failed { words: String },
}

/// A point, by names.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct At {
    params: Vec<(String, [f64; 3])>,
    gains: Vec<[f64; 3]>,
}

impl At {
    pub(crate) fn of(point: &Point) -> Self {
        Self { params: named(&point.params), gains: point.gains.iter().map(|gain| gain.0).collect() }
    }

    fn point(self, scene: &Opened) -> Point {
        let mut params = scene.baked.scene.params.clone();
        set(&mut params, &self.params);
        Point { params, gains: self.gains.into_iter().map(Gain).collect() }
    }
}

/// What was found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Told {
    ends: Vec<At>,
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
            ends: found.ends.iter().map(At::of).collect(),
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
    /// As the session takes it, of its scenes.
    pub(crate) fn message(self, scenes: &[Arc<Opened>]) -> Message {
        let points = |at: Vec<At>| at.into_iter().zip(scenes).map(|(at, scene)| at.point(scene)).collect();
        match self {
            Self::Step { iteration, at } => Message::Step(Box::new(Step { iteration, points: points(at) })),
            Self::Done { found, views } => {
                let Told { ends, known, ending, loss, losses, iterations, evaluations, seconds } = found;
                let ends = points(ends);
                let found = Found { ends, known, ending, loss, losses, iterations, evaluations, seconds };
                Message::Done(Box::new(Ok(Fitted { found, views })))
            }
            Self::Failed { words } => Message::Done(Box::new(Err(words))),
        }
    }
}

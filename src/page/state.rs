//! What the page is told: all that it shows but the images.

use serde::Serialize;
use skinfit_view::Session;
use skinfit_view::fitting::shares;
use skinfit_view::host::{Known, ViewScore};
use skinfit_view::look::{ErrorKind, Layout, Look, Pane};
use skinfit_view::paint::Slot;
use skinfit_view::session::{GAINS, Place, least};
use skinfit_view::shown;
use skinfit_view::values::{Freedom, Values};

use crate::fit::outcome::Ending;
use crate::model::effects::Effect;
use crate::model::params::{Channels, Column, Param, Scale};
use crate::render::tonemap::Operator;
use crate::scene::view::View;

/// All of it.
#[derive(Serialize)]
pub(crate) struct State<'a> {
    opening: bool,
    idle: bool,
    engine: &'a str,
    told: &'a [String],
    size: Option<[u32; 2]>,
    image: Option<ImageWords>,
    views: Vec<ViewRow>,
    view: usize,
    /// Whose errors can be shown.
    error_of: Vec<(Slot, &'static str)>,
    /// Whose error is shown.
    error_shown: Slot,
    gains: Option<Gains>,
    home: bool,
    can_undo: bool,
    can_redo: bool,
    can_resume: bool,
    rows: Vec<Row>,
    effects: Vec<EffectRow>,
    /// Panes that are of no term, by their keys.
    offered: [&'static str; Pane::OFFERED.len()],
    panes: Vec<PaneRow>,
    look: &'a Look,
    tones: Vec<&'static str>,
    errors: Vec<(ErrorKind, &'static str)>,
    layouts: Vec<(Layout, &'static str)>,
    terms: bool,
    fitting: Option<FittingWords>,
    found: Option<String>,
    scores: &'a [ViewScore],
    /// Nothing where they are as they were told.
    losses: Option<Vec<f64>>,
    ways: Option<Vec<Way>>,
}

/// The image of the sliders.
#[derive(Serialize)]
struct ImageWords {
    milliseconds: f64,
    bytes: u64,
    psnr: Option<f64>,
    flip: Option<f64>,
}

#[derive(Serialize)]
struct ViewRow {
    name: String,
    target: bool,
    fitted: bool,
}

/// The factors on the images of the scene that is looked at.
#[derive(Serialize)]
struct Gains {
    free: bool,
    /// Whether each channel of them is.
    white_balance: bool,
    /// Whether the pane lists them.
    shown: bool,
    /// What their sliders span.
    lower: f64,
    upper: f64,
    rows: Vec<GainRow>,
}

#[derive(Serialize)]
struct GainRow {
    /// The view's, and after it the channel.
    name: String,
    view: usize,
    /// `None` of one value for all channels.
    channel: Option<usize>,
    value: f64,
    error: Option<String>,
}

/// A parameter.
#[derive(Serialize)]
struct Row {
    name: &'static str,
    meaning: &'static str,
    source: &'static str,
    unit: &'static str,
    bounds: String,
    rgb: bool,
    free: bool,
    apart: bool,
    sliders: Vec<SliderRow>,
    resets: Vec<&'static str>,
}

/// One of its values.
#[derive(Serialize)]
struct SliderRow {
    name: String,
    channel: &'static str,
    value: f64,
    lower: f64,
    upper: f64,
    /// Of a slider of decades the least value that it tells from 0.
    least: f64,
    log: bool,
    error: Option<String>,
    /// From one standard error below to one above.
    interval: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct EffectRow {
    name: &'static str,
    meaning: &'static str,
    on: bool,
    change: Option<String>,
}

#[derive(Serialize)]
struct PaneRow {
    name: &'static str,
    /// Whether it is one of the terms.
    term: bool,
    title: String,
    /// Why it shows nothing, where it does.
    lacking: Option<&'static str>,
}

#[derive(Serialize)]
struct FittingWords {
    paused: bool,
    iteration: Option<u64>,
    loss: Option<f64>,
}

/// How far a constant has come, from 0 to 1.
#[derive(Serialize)]
struct Way {
    name: String,
    at: Vec<f64>,
}

impl<'a> State<'a> {
    /// `grown`: with what a fit has gone through.
    pub(crate) fn of(session: &'a Session, look: &'a Look, grown: bool) -> Self {
        let values = session.values();
        let last = session.path().last();
        let now = session.image(Slot::Now);
        Self {
            opening: session.is_opening(),
            idle: session.is_idle(),
            engine: session.engine(),
            told: session.told(),
            size: session.camera().map(|camera| [camera.width, camera.height]),
            image: now.map(|now| ImageWords {
                milliseconds: 1e3 * now.seconds,
                bytes: now.uploaded,
                psnr: now.compared.as_ref().map(|compared| compared.psnr),
                flip: now.compared.as_ref().map(|compared| compared.flip),
            }),
            views: views(session),
            view: session.at(),
            error_of: shown::errors_of(session).map(|slot| (slot, shown::name_of(slot))).collect(),
            error_shown: shown::error_of(session, look),
            gains: gains(session),
            home: session.is_at_home(),
            can_undo: session.steps().0,
            can_redo: session.steps().1,
            // Of a fit of this page.
            can_resume: session.found().is_some_and(|found| found.ending != Ending::Converged)
                && last.is_some(),
            rows: values.map_or_else(Vec::new, |values| {
                values.rows().into_iter().map(|param| row(session, values, param)).collect()
            }),
            effects: values.map_or_else(Vec::new, |values| effects(session, values)),
            offered: Pane::OFFERED.map(shown::name),
            panes: panes(session, look),
            look,
            tones: Operator::ALL.iter().map(|operator| operator.name()).collect(),
            errors: ErrorKind::ALL.iter().map(|kind| (*kind, kind.name())).collect(),
            layouts: Layout::ALL.to_vec(),
            terms: session.terms,
            fitting: session.fitting().map(|fitting| FittingWords {
                paused: fitting.is_paused(),
                iteration: last.map(|step| step.iteration.iteration),
                loss: last.map(|step| step.iteration.loss),
            }),
            found: session.found().map(|found| {
                let (ending, loss) = (found.ending.words(), found.loss);
                let (iterations, seconds) = (found.iterations, found.seconds);
                format!("{ending}: loss {loss:.6e}, {iterations} iterations, {seconds:.2} s")
            }),
            scores: session.scores(),
            losses: grown.then(|| session.losses()),
            ways: values.filter(|_| grown).map(|values| ways(session, values)),
        }
    }
}

fn views(session: &Session) -> Vec<ViewRow> {
    let row = |Place { name, target, fitted, .. }: Place| ViewRow { name, target, fitted };
    session.places().into_iter().map(row).collect()
}

fn gains(session: &Session) -> Option<Gains> {
    let (opened, values) = (session.opened()?, session.values()?);
    let row = |(number, view): (usize, &View)| {
        let of = |(channels, value): (Channels, f64)| GainRow {
            name: format!("{}{}", view.name, channels.suffix()),
            view: number,
            channel: match channels {
                Channels::Tied => None,
                Channels::One(c) => Some(c),
            },
            value,
            error: session.known_gain(&view.name, channels).map(Known::words),
        };
        values.gain_rows(number).into_iter().map(of).collect::<Vec<_>>()
    };
    let rows = opened.views().iter().enumerate().flat_map(row).collect();
    let (lower, upper) = GAINS.into_inner();
    let (free, white_balance) = (values.free_gains, values.white_balance);
    Some(Gains { free, white_balance, shown: values.has_gains(), lower, upper, rows })
}

fn row(session: &Session, values: &Values, param: Param) -> Row {
    let info = param.info();
    let (apart, (lower, upper)) = (values.by_channel(param), values.bounds.of(param));
    let columns = if apart { Column::per_channel(param).to_vec() } else { vec![Column::tied(param)] };
    let slider = |column: Column| {
        let range = session.range(column);
        SliderRow {
            name: column.name(),
            channel: match column.channels {
                Channels::Tied => "",
                Channels::One(c) => ["red", "green", "blue"][c],
            },
            value: column.get(&values.params),
            lower: *range.start(),
            upper: *range.end(),
            least: least(&range),
            log: info.scale == Scale::Log,
            error: session.known(column).map(Known::words),
            interval: session.interval(column),
        }
    };
    Row {
        name: info.name,
        meaning: info.meaning,
        source: info.source,
        unit: info.unit,
        bounds: format!("{lower} to {upper}"),
        rgb: info.rgb,
        free: values.freedom(param) != Freedom::Fixed,
        apart,
        sliders: columns.into_iter().map(slider).collect(),
        resets: session.resets(param).into_iter().map(|(name, _)| name).collect(),
    }
}

fn effects(session: &Session, values: &Values) -> Vec<EffectRow> {
    let row = |effect: Effect| EffectRow {
        name: effect.name(),
        meaning: effect.info().meaning,
        on: values.effects.has(effect),
        change: session.change(effect).map(|change| change.words()),
    };
    Effect::offered().map(row).collect()
}

fn panes(session: &Session, look: &Look) -> Vec<PaneRow> {
    let terms = if session.terms { shown::terms(session) } else { Vec::new() };
    let offered = Pane::OFFERED.into_iter().filter(|pane| *pane != Pane::Other || session.other().is_some());
    let row = |pane: Pane| PaneRow {
        name: shown::name(pane),
        term: matches!(pane, Pane::Term(_)),
        title: shown::title(session, look, pane),
        lacking: shown::pair(session, pane, look).is_none().then_some(shown::lacking(session, pane)),
    };
    offered.chain(terms.into_iter().map(Pane::Term)).map(row).collect()
}

fn ways(session: &Session, values: &Values) -> Vec<Way> {
    let way = |column: &Column| Way {
        name: column.name(),
        at: shares(session.path(), session.scene(), *column).into_iter().map(|[_, at]| at).collect(),
    };
    values.free.iter().map(way).collect()
}

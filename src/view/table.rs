//! All constants side by side: where the sliders began, where they stand, the last fit's and the compared run's with their
//! errors; and how good these two are in each view.

use serde::Serialize;

use crate::host::{Found, ViewScore};
use crate::model::params::{Column, Params};
use crate::session::Session;

/// A table in words; of each row the first is its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Table {
    /// What stands above each column.
    pub heads: Vec<&'static str>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
}

/// What stands where there is nothing.
const NONE: &str = "-";

/// The constants of the scene that is looked at.
#[must_use]
pub fn constants(session: &Session) -> Table {
    let heads = vec!["constant", "start", "now", "fit", "±", "other run", "±"];
    let (Some(values), Some(first)) = (session.values(), session.first()) else {
        return Table { heads, rows: Vec::new() };
    };
    let other = session.other_fit().map(|fit| (&fit.found, &fit.views[..]));
    let others = [
        (session.fitted(), session.found().map(|found| (found, session.scores()))),
        (session.other(), other),
    ];
    let columns = values.rows().into_iter().flat_map(|param| {
        let coloured = |params: &Params| {
            let rgb = params.rgb(param);
            rgb != [rgb[0]; 3]
        };
        let apart = values.by_channel(param) || others.iter().any(|(params, _)| params.is_some_and(coloured));
        if apart { Column::per_channel(param).to_vec() } else { vec![Column::tied(param)] }
    });
    let number = |params: &Params, column: Column| format!("{:.5}", column.get(params));
    let error = |(found, scores): (&Found, &[ViewScore]), column: Column| {
        let error = session.known_of(found, scores, column)?.std_error?;
        Some(format!("{error:.1e}"))
    };
    let row = |column: Column| {
        let own = [column.name(), number(&first.params, column), number(&values.params, column)];
        let found = others.iter().flat_map(|(params, found)| {
            let params = params.map_or_else(|| NONE.to_owned(), |params| number(params, column));
            [params, found.and_then(|found| error(found, column)).unwrap_or_default()]
        });
        own.into_iter().chain(found).collect()
    };
    Table { heads, rows: columns.map(row).collect() }
}

/// How good each view with a target is.
#[must_use]
pub fn scores(session: &Session) -> Table {
    let heads = vec!["view", "fit, dB", "FLIP", "other run, dB", "FLIP"];
    let other = session.other_fit().map_or(&[][..], |fit| &fit.views);
    let row = |name: String| {
        let of = |scores: &[ViewScore]| {
            let score = scores.iter().find(|score| score.view == name);
            let words = |of: fn(&ViewScore) -> String| score.map_or_else(|| NONE.to_owned(), of);
            [words(|score| format!("{:.2}", score.psnr)), words(|score| format!("{:.4}", score.flip))]
        };
        let scores = [of(session.scores()), of(other)].concat();
        std::iter::once(name).chain(scores).collect()
    };
    let views = session.places().into_iter().filter(|place| place.target);
    Table { heads, rows: views.map(|place| row(place.name)).collect() }
}

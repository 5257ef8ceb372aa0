//! What is known of a parameter beside its value: what a slider spans, other values to go back to, its error.

use std::ops::RangeInclusive;

use super::Session;
use crate::host::{Found, GAIN, Known, ViewScore};
use crate::model::params::{Channels, Column, Param};
use crate::prepare::view_of;

/// The name of where the sliders began, among what they can be reset to.
pub const START: &str = "start";

/// The least value that a slider of decades tells from 0: where its lower end is 0, four decades below the upper one.
#[must_use]
pub fn least(range: &RangeInclusive<f64>) -> f64 {
    if *range.start() > 0.0 { *range.start() } else { 1e-4 * range.end() }
}

impl Session {
    /// What a slider's ends stand for: the bounds, where they are finite, else four times what it may well be.
    #[must_use]
    pub fn range(&self, column: Column) -> RangeInclusive<f64> {
        let info = column.param.info();
        let first = self.first().map(|first| (column.get(&first.params), column.param.default(first.form)));
        let known = first.map_or([0.0; 2], <[_; 2]>::from);
        let fitted = self.fitted().map_or(0.0, |params| column.get(params));
        let most = known.into_iter().chain([fitted]).fold(0.25, |most: f64, value| most.max(value.abs()));
        let most = if info.unit == "degrees" { 180.0 } else { 4.0 * most };
        let (lower, upper) = self.bounds(column.param);
        let lower = if lower.is_finite() { lower } else { -most };
        let upper = if upper.is_finite() { upper } else { most };
        lower..=upper
    }

    /// What a fit keeps a parameter within: the scene's bounds, or the table's.
    #[must_use]
    pub fn bounds(&self, param: Param) -> (f64, f64) {
        self.first().map_or((param.info().lower, param.info().upper), |first| first.bounds.of(param))
    }

    /// Values that a parameter can be reset to, by the names of what has them.
    #[must_use]
    pub fn resets(&self, param: Param) -> Vec<(&'static str, [f64; 3])> {
        let first = self.first();
        let values = [
            (START, first.map(|first| first.params.rgb(param))),
            ("default", first.map(|first| param.default_rgb(first.form))),
            ("fit", self.fitted().map(|params| params.rgb(param))),
            ("compared run", self.other().map(|params| params.rgb(param))),
        ];
        values.into_iter().filter_map(|(name, rgb)| Some((name, rgb?))).collect()
    }

    /// What the last fit says of a constant, where it moved that.
    #[must_use]
    pub fn known(&self, column: Column) -> Option<&Known> {
        self.known_of(self.found()?, self.scores(), column)
    }

    /// What a fit with these scores says of a constant of the scene that is looked at.
    #[must_use]
    pub fn known_of<'a>(&self, found: &'a Found, scores: &[ViewScore], column: Column) -> Option<&'a Known> {
        let name = column.name();
        let own = self.opened().filter(|_| column.param.is_of_scene() && self.scenes.len() > 1);
        let Some(opened) = own else { return found.constant(&name) };
        // Where one scene alone was fitted, and others were held out, its own stand as the skin's do.
        let before = view_of(&opened.name, "");
        let fitted = scores.iter().any(|score| !score.held_out && score.view.starts_with(&before));
        let alone = found.constant(&name).filter(|_| fitted);
        found.constant(&format!("{before}{name}")).or(alone)
    }

    /// What the last fit says of a view's gain, or of a channel of it, where it moved that.
    #[must_use]
    pub fn known_gain(&self, view: &str, channels: Channels) -> Option<&Known> {
        let view = self.view_name(self.scene(), view);
        self.found()?.constant(&format!("{GAIN}{view}{}", channels.suffix()))
    }

    /// Where the last fit has a constant for sure: from one standard error below what it found to one above.
    #[must_use]
    pub fn interval(&self, column: Column) -> Option<[f64; 2]> {
        let (at, error) = (column.get(self.fitted()?), self.known(column)?.std_error?);
        Some([at - error, at + error])
    }
}

impl Known {
    /// Its error in words.
    #[must_use]
    pub fn words(&self) -> String {
        let Self { std_error, at_bound, .. } = self;
        std_error.map_or_else(
            || (if *at_bound { "at its bound" } else { "?" }).to_owned(),
            |error| format!("± {error:.2e}"),
        )
    }
}

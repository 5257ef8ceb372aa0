//! What is known of a parameter beside its value: what a slider spans, other values to go back to, its error.

use std::ops::RangeInclusive;

use super::Session;
use crate::host::Known;
use crate::model::params::{Column, Param};

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
        let lower = if info.lower.is_finite() { info.lower } else { -most };
        let upper = if info.upper.is_finite() { info.upper } else { most };
        lower..=upper
    }

    /// Values that a parameter can be reset to, by the names of what has them.
    #[must_use]
    pub fn resets(&self, param: Param) -> Vec<(&'static str, [f64; 3])> {
        let first = self.first();
        let values = [
            ("start", first.map(|first| first.params.rgb(param))),
            ("default", first.map(|first| param.default_rgb(first.form))),
            ("fit", self.fitted().map(|params| params.rgb(param))),
            ("compared run", self.other().map(|params| params.rgb(param))),
        ];
        values.into_iter().filter_map(|(name, rgb)| Some((name, rgb?))).collect()
    }

    /// What the last fit says of a constant's error, where it moved that.
    #[must_use]
    pub fn error_words(&self, column: Column) -> Option<String> {
        let Known { std_error, at_bound, .. } = self.found()?.constant(&column.name())?;
        Some(std_error.map_or_else(
            || (if *at_bound { "at its bound" } else { "?" }).to_owned(),
            |error| format!("± {error:.2e}"),
        ))
    }
}

//! What a fit is of, item by item: a state is gone on from by a fit of the same alone.

use serde::{Deserialize, Serialize};

/// What identifies an objective: named items, each with its value in words or a hash of it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Fingerprint(Vec<(String, String)>);

/// An item that two fingerprints do not share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its name.
    pub what: String,
    /// What it was.
    pub was: String,
    /// What it is.
    pub is: String,
}

impl Fingerprint {
    /// The same with one more item.
    #[must_use]
    pub fn with(mut self, what: impl Into<String>, value: impl Into<String>) -> Self {
        self.0.push((what.into(), value.into()));
        self
    }

    /// The same with all items of another one, which are those of `whose`.
    #[must_use]
    pub fn with_all(mut self, other: &Self, whose: &str) -> Self {
        self.0.extend(other.0.iter().map(|(what, value)| (format!("{what} ({whose})"), value.clone())));
        self
    }

    /// The first item that another one has not, or has otherwise, or has besides.
    #[must_use]
    pub fn difference(&self, now: &Self) -> Option<Difference> {
        let both = self.0.iter().chain(&now.0);
        both.map(|(what, _)| Difference { what: what.clone(), was: self.value(what), is: now.value(what) })
            .find(|item| item.was != item.is)
    }

    fn value(&self, what: &str) -> String {
        let item = self.0.iter().find(|(name, _)| name == what);
        item.map_or_else(|| "none".to_owned(), |(_, value)| value.clone())
    }
}

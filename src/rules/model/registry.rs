//! Tables that grow while the process runs: rows are added, never changed or taken away.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError, RwLock};

/// A row cannot be added.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub enum RegistryError {
    /// Another row has its name.
    #[error("there is another {kind} `{name}`")]
    Taken {
        /// What kind of row.
        kind: &'static str,
        /// Its name.
        name: String,
    },
    /// The table holds no more.
    #[error("there may be {most} {kind}s, no more")]
    Full {
        /// What kind of row.
        kind: &'static str,
        /// How many it holds.
        most: usize,
    },
}

/// The rows that were added to a table.
#[derive(Debug)]
pub(crate) struct Added<T: 'static>(RwLock<Vec<&'static T>>);

impl<T> Added<T> {
    pub(crate) const fn new() -> Self {
        Self(RwLock::new(Vec::new()))
    }

    /// Every row, in the order in which they were added.
    pub(crate) fn rows(&self) -> Vec<&'static T> {
        self.0.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.0.read().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// The place of the first row that `is` what is looked for.
    pub(crate) fn position(&self, is: impl Fn(&T) -> bool) -> Option<usize> {
        self.0.read().unwrap_or_else(PoisonError::into_inner).iter().position(|row| is(row))
    }

    /// The row at `place`, which must have been added.
    pub(crate) fn row(&self, place: usize) -> &'static T {
        self.0.read().unwrap_or_else(PoisonError::into_inner)[place]
    }

    /// Add the row that `make` makes of its place, or find the one that is the `same`. Where a row is `taken` and not
    /// the same, the `refusal`.
    pub(crate) fn add<E>(
        &self,
        taken: impl Fn(&T) -> bool,
        same: impl Fn(&T) -> bool,
        make: impl FnOnce(usize) -> Result<T, E>,
        refusal: impl FnOnce() -> E,
    ) -> Result<&'static T, E> {
        let mut rows = self.0.write().unwrap_or_else(PoisonError::into_inner);
        match rows.iter().find(|row| taken(row)) {
            Some(row) if same(row) => Ok(row),
            Some(_) => Err(refusal()),
            None => {
                let row: &'static T = Box::leak(Box::new(make(rows.len())?));
                rows.push(row);
                Ok(row)
            }
        }
    }
}

/// A text that lives as long as the process; equal texts are kept once.
#[must_use]
pub fn leaked(text: &str) -> &'static str {
    static TEXTS: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut texts = TEXTS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = texts.get(text) {
        return known;
    }
    let kept: &'static str = Box::leak(text.to_owned().into_boxed_str());
    texts.insert(kept);
    kept
}

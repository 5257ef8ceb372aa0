//! Where levels stand in a buffer that holds them all.

use std::collections::BTreeMap;

use super::Level;
use super::named::Named;

/// Where levels stand in the buffer, counted in levels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    places: BTreeMap<String, usize>,
    /// How many there are.
    pub count: usize,
}

impl Layers {
    /// Where a level stands.
    #[must_use]
    pub fn place(&self, name: &str) -> Option<usize> {
        self.places.get(name).copied()
    }

    /// Of all that passes leave. What a blur leaves along u nobody reads but its second direction: these take turns.
    pub(super) fn new(groups: &[Vec<Named<'_>>]) -> Self {
        let mut layers = Self::default();
        for (name, _) in groups.iter().flatten().flat_map(Named::leaves) {
            if !Level::is_half(&name) && !layers.places.contains_key(&name) {
                layers.places.insert(name, layers.count);
                layers.count += 1;
            }
        }
        let lasting = layers.count;
        for group in groups {
            let halves = group.iter().flat_map(Named::leaves).filter(|(name, _)| Level::is_half(name));
            for (k, (name, _)) in halves.enumerate() {
                layers.places.insert(name, lasting + k);
                layers.count = layers.count.max(lasting + k + 1);
            }
        }
        layers
    }
}

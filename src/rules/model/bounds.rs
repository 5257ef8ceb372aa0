//! Bounds that a scene sets for what a fit moves, within those of the table.

use super::params::Param;

/// Least and greatest value of some parameters, by their names; all others have the table's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds(Vec<(Param, [f64; 2])>);

impl Bounds {
    /// Have a parameter stay within `[lower, upper]`, in every channel.
    pub fn set(&mut self, param: Param, bounds: [f64; 2]) {
        self.reset(param);
        self.0.push((param, bounds));
        self.0.sort_by_key(|(param, _)| param.name());
    }

    /// Have it stay within the table's again.
    pub fn reset(&mut self, param: Param) {
        self.0.retain(|(other, _)| *other != param);
    }

    /// Least and greatest value of a parameter.
    #[must_use]
    pub fn of(&self, param: Param) -> (f64, f64) {
        self.own(param).unwrap_or((param.info().lower, param.info().upper))
    }

    /// The same, where they are set.
    #[must_use]
    pub fn own(&self, param: Param) -> Option<(f64, f64)> {
        let own = self.0.iter().find(|(other, _)| *other == param);
        own.map(|(_, [lower, upper])| (*lower, *upper))
    }

    /// Those that are set.
    pub fn iter(&self) -> impl Iterator<Item = (Param, [f64; 2])> {
        self.0.iter().copied()
    }

    /// Whether none is set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_set_last_holds_and_what_is_reset_is_the_tables() {
        let mut bounds = Bounds::default();
        bounds.set(Param::Hilite, [0.1, 0.2]);
        bounds.set(Param::Hilite, [0.3, 0.4]);
        assert_eq!(bounds.of(Param::Hilite), (0.3, 0.4));
        assert_eq!(bounds.iter().collect::<Vec<_>>(), [(Param::Hilite, [0.3, 0.4])]);
        let mut other = Bounds::default();
        for (param, interval) in [(Param::Hilite, [0.3, 0.4]), (Param::BaseWeight, [0.0, 1.0])] {
            other.set(param, interval);
        }
        bounds.set(Param::BaseWeight, [0.0, 1.0]);
        bounds.set(Param::Hilite, [0.3, 0.4]);
        assert_eq!(bounds, other, "whatever the order");
        bounds.reset(Param::BaseWeight);
        let table = Param::RimExponent.info();
        assert_eq!(bounds.of(Param::RimExponent), (table.lower, table.upper));
        bounds.reset(Param::Hilite);
        assert!(bounds.is_empty() && bounds == Bounds::default());
    }
}

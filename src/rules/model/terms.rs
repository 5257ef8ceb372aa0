//! The terms of the light's sum: parts of the result, each an image layer of its own.

use std::fmt;

use super::effects::{Effect, Effects};
use super::registry::{Added, RegistryError};

/// A part of the result, an image layer of its own: the place of its row among the built-in ones, which stand first in
/// the order of the sum, and those that [`register`](TermName::register) has added.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TermName(u16);

/// One row of the table of terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TermInfo {
    /// The name of the term's layer in image files.
    pub name: &'static str,
    /// It is there when all of these effects are enabled.
    pub effects: &'static [Effect],
    /// And none of these.
    pub without: &'static [Effect],
}

/// The built-in terms, named as the effects that they belong to.
#[allow(missing_docs, reason = "named as the effects")]
#[allow(non_upper_case_globals, reason = "they are the values that a term may have, as variants would be")]
impl TermName {
    pub const Diffuse: Self = Self(0);
    pub const Rim: Self = Self(1);
    pub const SideSpecular: Self = Self(2);
    pub const Hilite: Self = Self(3);
    pub const Reflection: Self = Self(4);
    pub const KeyLight: Self = Self(5);
}

static TABLE: [TermInfo; TermName::BUILT_IN.len()] = [
    TermInfo { name: "diffuse", effects: &[Effect::Diffuse], without: &[] },
    TermInfo { name: "rim", effects: &[Effect::Diffuse, Effect::Rim], without: &[] },
    TermInfo { name: "side_specular", effects: &[Effect::SideSpecular], without: &[] },
    TermInfo { name: "hilite", effects: &[Effect::Hilite], without: &[] },
    TermInfo { name: "reflection", effects: &[Effect::Reflection], without: &[] },
    TermInfo { name: "key_light", effects: &[Effect::KeyLight], without: &[] },
];

/// A built-in term, and effects with which it is there, too.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Also {
    name: &'static str,
    effects: &'static [Effect],
}

/// What has been said of built-in terms.
static ALSO: Added<Also> = Added::new();

/// What was added to the table.
static ADDED: Added<TermInfo> = Added::new();

impl TermName {
    /// The built-in terms, in the order of the sum.
    pub const BUILT_IN: [Self; 6] =
        [Self::Diffuse, Self::Rim, Self::SideSpecular, Self::Hilite, Self::Reflection, Self::KeyLight];

    /// Add a row. A row that is there already is not added again.
    ///
    /// # Errors
    /// When another term has its name.
    pub fn register(row: TermInfo) -> Result<Self, RegistryError> {
        let taken = || RegistryError::Taken { kind: "term", name: row.name.to_owned() };
        if TABLE.iter().any(|other| other.name == row.name) {
            return Err(taken());
        }
        let full = |_| RegistryError::Full { kind: "term", most: 1 << 16 };
        let make = |place: usize| u16::try_from(TABLE.len() + place).map(|_| row).map_err(full);
        ADDED.add(|other| other.name == row.name, |other| *other == row, make, taken)?;
        Self::from_name(row.name).ok_or_else(taken)
    }

    /// Have a term be there when all of `effects` are enabled, too.
    pub fn also_with(self, effects: &'static [Effect]) {
        let row = Also { name: self.name(), effects };
        let same = |other: &Also| *other == row;
        // No row is refused.
        let added: Result<_, RegistryError> = ALSO.add(
            same,
            same,
            |_| Ok(row),
            || RegistryError::Taken { kind: "term", name: row.name.to_owned() },
        );
        debug_assert!(added.is_ok(), "{row:?}");
    }

    /// Every term: the built-in ones, then what was added.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..TABLE.len() + ADDED.len()).map(|place| Self(place as u16))
    }

    /// The terms that `effects` have.
    #[must_use]
    pub fn of(effects: Effects) -> Vec<Self> {
        let all = |of: &[Effect]| of.iter().all(|&effect| effects.has(effect));
        let also = ALSO.rows();
        let too = |name: &str| also.iter().any(|row| row.name == name && all(row.effects));
        let on = |info: &TermInfo| all(info.effects) && !effects.has_any(info.without) || too(info.name);
        let added = ADDED.rows();
        let rows = TABLE.iter().chain(added);
        (0..).map(Self).zip(rows).filter(|(_, info)| on(info)).map(|(term, _)| term).collect()
    }

    /// The term of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let own = TABLE.iter().position(|row| row.name == name);
        let place = own.or_else(|| Some(TABLE.len() + ADDED.position(|row| row.name == name)?));
        place.map(|place| Self(place as u16))
    }

    /// Whether its row is built in.
    #[must_use]
    pub const fn is_built_in(self) -> bool {
        self.index() < Self::BUILT_IN.len()
    }

    /// Its place in the table.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    fn info(self) -> &'static TermInfo {
        TABLE.get(self.index()).unwrap_or_else(|| ADDED.row(self.index() - TABLE.len()))
    }

    /// The name of the term's layer in image files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.info().name
    }
}

impl fmt::Debug for TermName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

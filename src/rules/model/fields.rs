//! Fields: numbers beside position, frame and maps that rules read by name.
//!
//! Those of vertices are interpolated where a fragment, a stored sample or a texel reads them; those of maps are looked up
//! by its texture coordinates; those of samples are found at each stored sample or texel by itself, as what reaches it of
//! a light. Rows are added by files of rules.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Mutex, PoisonError};

use super::registry::{Added, RegistryError, leaked};

/// The most numbers that a field has.
pub const MOST_NUMBERS: usize = 3;

/// One row of the table of fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldInfo {
    /// The name in rules.
    pub name: &'static str,
    /// The name of the vertex attribute that holds it, where vertices do.
    pub attribute: &'static str,
    /// Where its numbers are found.
    pub of: Found,
    /// How many numbers it has, 1 to 3.
    pub numbers: usize,
    /// What each of them is where a mesh, or the scene's maps, lack the field.
    pub neutral: f32,
    /// What it is, in one line.
    pub meaning: &'static str,
}

/// Where the numbers of a field are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// At vertices.
    Vertices,
    /// At each stored sample or texel by itself. A rasteriser interpolates what is found so at the vertices.
    Samples,
    /// In a map of the scene's.
    Map(MapNames),
}

/// What shaders call the texels of a field's map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapNames {
    /// As 32-bit floats, which shaders filter.
    pub texels: &'static str,
    /// In 16-bit floats, which the hardware filters.
    pub filtered: &'static str,
}

impl MapNames {
    /// Those of the field of that name.
    #[must_use]
    pub fn of(field: &str) -> Self {
        Self { texels: leaked(&format!("{field}_texels")), filtered: leaked(&format!("{field}_map")) }
    }
}

/// A field: the place of its row.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Field(u16);

static ADDED: Added<FieldInfo> = Added::new();

impl Field {
    /// Add a row. A row that is there already is not added again.
    ///
    /// # Errors
    /// When another field has its name.
    pub fn register(row: FieldInfo) -> Result<Self, RegistryError> {
        let taken = || RegistryError::Taken { kind: "field", name: row.name.to_owned() };
        let make = |place: usize| {
            let full = RegistryError::Full { kind: "field", most: usize::from(u16::MAX) };
            u16::try_from(place).map(|_| row).map_err(|_| full)
        };
        ADDED.add(|other| other.name == row.name, |other| *other == row, make, taken)?;
        Self::from_name(row.name).ok_or_else(taken)
    }

    /// Its row.
    #[must_use]
    pub fn info(self) -> &'static FieldInfo {
        ADDED.row(usize::from(self.0))
    }

    /// The name in rules.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.info().name
    }

    /// The field of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let place = ADDED.position(|row| row.name == name)?;
        u16::try_from(place).ok().map(Self)
    }

    /// Every field that was added.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..ADDED.len()).filter_map(|place| u16::try_from(place).ok().map(Self))
    }

    /// What shaders call its map, where it has one.
    #[must_use]
    pub fn map(self) -> Option<MapNames> {
        match self.info().of {
            Found::Map(names) => Some(names),
            Found::Vertices | Found::Samples => None,
        }
    }

    /// Whether vertices have it.
    #[must_use]
    pub fn is_of_vertices(self) -> bool {
        self.info().of == Found::Vertices
    }

    /// The WGSL type.
    #[must_use]
    pub fn wgsl(self) -> &'static str {
        match self.info().numbers {
            1 => "f32",
            2 => "vec2f",
            _ => "vec3f",
        }
    }
}

impl fmt::Debug for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A set of fields, in the order of their rows. Equal sets are kept once for as long as the process runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Fields(&'static [Field]);

impl Fields {
    /// The set of these.
    #[must_use]
    pub fn of(fields: impl IntoIterator<Item = Field>) -> Self {
        static SETS: Mutex<BTreeSet<&'static [Field]>> = Mutex::new(BTreeSet::new());
        let set: BTreeSet<Field> = fields.into_iter().collect();
        if set.is_empty() {
            return Self::default();
        }
        let set: Vec<Field> = set.into_iter().collect();
        let mut sets = SETS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = sets.get(set.as_slice()) {
            return Self(known);
        }
        let kept: &'static [Field] = Box::leak(set.into_boxed_slice());
        sets.insert(kept);
        Self(kept)
    }

    /// No fields.
    pub const NONE: Self = Self(&[]);

    /// What either holds.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        match (self.0, other.0) {
            (_, []) => self,
            ([], _) => other,
            _ => Self::of(self.iter().chain(other.iter())),
        }
    }

    /// Whether it holds none.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    /// Each of them.
    pub fn iter(self) -> impl Iterator<Item = Field> {
        self.0.iter().copied()
    }

    /// The field of that name, where it is one of them.
    #[must_use]
    pub fn named(self, name: &str) -> Option<Field> {
        Field::from_name(name).filter(|field| self.0.contains(field))
    }

    /// Whether it is one of them.
    #[must_use]
    pub fn has(self, field: Field) -> bool {
        self.0.contains(&field)
    }

    /// Those that are looked up in maps.
    #[must_use]
    pub fn of_maps(self) -> Self {
        Self::of(self.iter().filter(|field| field.map().is_some()))
    }

    /// How many numbers they have altogether.
    #[must_use]
    pub fn numbers(self) -> usize {
        self.iter().map(|field| field.info().numbers).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_added_once_and_sets_are_kept_once() {
        let row = |name, numbers| FieldInfo {
            name,
            attribute: name,
            of: Found::Vertices,
            numbers,
            neutral: 0.5,
            meaning: "a test's own",
        };
        let bend = Field::register(row("test_bend", 1)).unwrap();
        let lean = Field::register(row("test_lean", 3)).unwrap();
        assert_eq!(Field::register(row("test_bend", 1)), Ok(bend));
        assert!(Field::register(row("test_bend", 2)).is_err());
        assert_eq!((bend.wgsl(), lean.wgsl(), Field::from_name("test_lean")), ("f32", "vec3f", Some(lean)));
        let both = Fields::of([lean, bend, lean]);
        assert_eq!(both.iter().collect::<Vec<_>>(), [bend, lean]);
        assert_eq!(both, Fields::of([bend]).or(Fields::of([lean])));
        assert_eq!((both.numbers(), both.or(Fields::default())), (4, both));
    }
}

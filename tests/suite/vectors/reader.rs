//! Vector files, read so that what was never looked at is known.
//!
//! A number counts as read once its value was taken, and as compared once it was handed to [`Node::wanted`].

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde_json::Value;

/// All files of a folder.
pub(crate) struct Vectors {
    /// By file name.
    pub(crate) files: BTreeMap<String, Vector>,
}

/// One file.
pub(crate) struct Vector {
    /// The file's name without its ending.
    pub(crate) name: String,
    value: Value,
    seen: RefCell<BTreeMap<String, Seen>>,
}

/// What became of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Seen {
    /// Its value was taken.
    Read,
    /// Something was compared with it.
    Compared,
}

/// A place in a file.
#[derive(Clone)]
pub(crate) struct Node<'v> {
    pub(crate) vector: &'v Vector,
    value: &'v Value,
    path: String,
}

/// How far an evaluator may be off: `|got - want| <= abs max(1, max |want|) + rel |want|`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerance {
    pub(crate) abs: f64,
    pub(crate) rel: f64,
}

/// A file's tolerances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerances {
    pub(crate) double: Tolerance,
    pub(crate) single: Tolerance,
}

impl Vectors {
    pub(crate) fn read(folder: &Path) -> Self {
        let mut files = BTreeMap::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "json") {
                let value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
                let name = path.file_stem().unwrap().to_string_lossy().into_owned();
                let file = format!("{name}.json");
                files.insert(file, Vector { name, value, seen: RefCell::default() });
            }
        }
        assert!(!files.is_empty(), "{} holds no vectors", folder.display());
        Self { files }
    }

    /// Every vector of that kind, in the order of their files' names; none is a failure.
    pub(crate) fn of_kind(&self, kind: &str) -> Vec<Node<'_>> {
        let found: Vec<Node<'_>> =
            self.files.values().map(Vector::root).filter(|root| root.at("kind").text() == kind).collect();
        assert!(!found.is_empty(), "there is no vector of kind {kind}");
        found
    }

    /// The only vector of a kind.
    pub(crate) fn one(&self, kind: &str) -> Node<'_> {
        let mut found = self.of_kind(kind);
        assert_eq!(found.len(), 1, "vectors of kind {kind}");
        found.remove(0)
    }

    /// The inputs of the cubes that a vector names.
    pub(crate) fn cubes(&self, vector: &Node<'_>) -> Node<'_> {
        let file = vector.at("cubes_file").text();
        self.files.get(file).unwrap_or_else(|| panic!("there is no {file}")).root().at("inputs")
    }
}

impl Vector {
    pub(crate) fn root(&self) -> Node<'_> {
        Node { vector: self, value: &self.value, path: String::new() }
    }

    fn see(&self, path: &str, how: Seen) {
        let mut seen = self.seen.borrow_mut();
        let entry = seen.entry(path.to_owned()).or_insert(how);
        *entry = (*entry).max(how);
    }

    /// The leaves that were not even read, and of what is expected those that nothing was compared with.
    pub(crate) fn left(&self) -> Vec<String> {
        let mut leaves = BTreeSet::new();
        walk(&self.value, "", &mut |path, value| {
            if !value.is_null() {
                leaves.insert(path.to_owned());
            }
        });
        let seen = self.seen.borrow();
        leaves.retain(|path| {
            let needed = if path.starts_with("expected") { Seen::Compared } else { Seen::Read };
            seen.get(path).is_none_or(|&seen| seen < needed)
        });
        leaves.into_iter().collect()
    }
}

/// Every leaf beneath a value, with its path.
fn walk(value: &Value, path: &str, leaf: &mut dyn FnMut(&str, &Value)) {
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| walk(item, &format!("{path}[{i}]"), leaf));
        }
        Value::Object(map) => map.iter().for_each(|(key, item)| walk(item, &joined(path, key), leaf)),
        _ => leaf(path, value),
    }
}

fn joined(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

/// JSON doubles; non-finite ones are strings, null is "nothing to compare".
fn double(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::String(word) if word == "NaN" => Some(f64::NAN),
        Value::String(word) if word == "Infinity" => Some(f64::INFINITY),
        Value::String(word) if word == "-Infinity" => Some(f64::NEG_INFINITY),
        Value::Null => None,
        other => panic!("not a number: {other}"),
    }
}

impl<'v> Node<'v> {
    /// File and path, for messages.
    pub(crate) fn place(&self) -> String {
        format!("{} {}", self.vector.name, self.path)
    }

    pub(crate) fn get(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key)?;
        Some(Self { vector: self.vector, value, path: joined(&self.path, key) })
    }

    pub(crate) fn at(&self, key: &str) -> Self {
        self.get(key).unwrap_or_else(|| panic!("{} has no {key}", self.place()))
    }

    pub(crate) fn items(&self) -> Vec<Self> {
        let items = self.value.as_array().unwrap_or_else(|| panic!("{} is no list", self.place()));
        let item = |(i, value)| Self { vector: self.vector, value, path: format!("{}[{i}]", self.path) };
        items.iter().enumerate().map(item).collect()
    }

    pub(crate) fn item(&self, i: usize) -> Self {
        self.items().swap_remove(i)
    }

    /// Nothing to compare.
    pub(crate) fn is_null(&self) -> bool {
        self.value.is_null()
    }

    pub(crate) fn is_text(&self) -> bool {
        self.value.is_string()
    }

    pub(crate) fn is_list(&self) -> bool {
        self.value.is_array()
    }

    pub(crate) fn text(&self) -> &'v str {
        self.vector.see(&self.path, Seen::Read);
        self.value.as_str().unwrap_or_else(|| panic!("{} is no text", self.place()))
    }

    pub(crate) fn number(&self) -> f64 {
        self.vector.see(&self.path, Seen::Read);
        double(self.value).unwrap_or_else(|| panic!("{} is no number", self.place()))
    }

    /// Every number beneath, in order.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        self.take(Seen::Read)
    }

    /// Every number beneath, to be compared with.
    pub(crate) fn wanted(&self) -> Vec<f64> {
        self.take(Seen::Compared)
    }

    fn take(&self, how: Seen) -> Vec<f64> {
        let mut found = Vec::new();
        walk(self.value, &self.path, &mut |path, value| {
            self.vector.see(path, how);
            found.extend(double(value));
        });
        found
    }

    /// The first three numbers of a list; a fourth is not read.
    pub(crate) fn three(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.item(i).number())
    }

    /// A text that has to be this one.
    #[track_caller]
    pub(crate) fn assert_text(&self, want: &str) {
        self.vector.see(&self.path, Seen::Compared);
        assert_eq!(self.value.as_str(), Some(want), "{}", self.place());
    }
}

impl Vector {
    /// The tolerances that the file gives.
    pub(crate) fn tolerances(&self) -> Tolerances {
        let given = self.root().at("tolerance");
        given.at("rule").assert_text("|got-want| <= abs*max(1,max|want|) + rel*|want|");
        let [abs, rel, double] = ["f32_abs", "f32_rel", "f64_rel"].map(|name| given.at(name).number());
        // Some files give f64 a relative figure alone; the same, absolutely, where a sum cancels.
        let double = Tolerance { abs: given.get("f64_abs").map_or(double, |abs| abs.number()), rel: double };
        Tolerances { double, single: Tolerance { abs, rel } }
    }
}

impl Tolerance {
    /// The tolerance, a number of times as large.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self { abs: factor * self.abs, rel: factor * self.rel }
    }

    /// `got` against all numbers beneath `want`.
    #[track_caller]
    pub(crate) fn check(self, what: &str, got: &[f64], want: &Node<'_>) {
        let place = want.place();
        let want = want.wanted();
        assert_eq!(got.len(), want.len(), "{place}: {what}: how many");
        let largest = want.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for (i, (g, w)) in got.iter().zip(&want).enumerate() {
            let bound = self.abs * largest + self.rel * w.abs();
            assert!((g - w).abs() <= bound, "{place}: {what} [{i}]: got {g}, want {w}, bound {bound:e}");
        }
    }
}

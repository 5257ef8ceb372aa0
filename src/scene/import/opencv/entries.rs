//! What a calibration's file holds: texts by their names, those within another as `camera_matrix.data`.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::damaged;
use crate::error::SceneError;

/// The entries of a file.
pub(super) struct Entries<'a> {
    pub(super) path: &'a Path,
    /// Line and text.
    by_name: BTreeMap<String, (usize, String)>,
}

/// What was found, and where.
type Found<T> = Result<Option<(String, T)>, SceneError>;

impl<'a> Entries<'a> {
    pub(super) fn new(path: &'a Path) -> Self {
        Self { path, by_name: BTreeMap::new() }
    }

    /// Keep an entry; of two of one name the first, as OpenCV does.
    pub(super) fn keep(&mut self, name: String, line: usize, text: &str) {
        self.by_name.entry(name).or_insert_with(|| (line, text.to_owned()));
    }

    /// The first of the names that is there.
    fn first(&self, names: &[&str]) -> Option<(String, &str)> {
        names.iter().find_map(|name| {
            let (line, text) = self.by_name.get(*name)?;
            Some((format!("line {line}, {name}"), text.as_str()))
        })
    }

    /// Where one of the names, or a part of it, is there at all.
    pub(super) fn announced(&self, names: &[&str]) -> Option<String> {
        let of = |entry: &&String| {
            names.iter().any(|name| entry.strip_prefix(*name).is_some_and(|rest| rest.starts_with('.')))
        };
        let name = self.by_name.keys().find(of)?;
        Some(format!("line {}, {name}", self.by_name[name].0))
    }

    /// A word, with or without quotes.
    pub(super) fn word(&self, name: &str) -> Option<(String, &str)> {
        self.first(&[name]).map(|(place, text)| (place, text.trim().trim_matches(['"', '\''])))
    }

    /// All numbers of an entry.
    pub(super) fn numbers(&self, names: &[&str]) -> Found<Vec<f64>> {
        let Some((place, text)) = self.first(names) else { return Ok(None) };
        let list = text.trim();
        let list = list.strip_prefix('[').and_then(|list| list.strip_suffix(']')).unwrap_or(list);
        let words = list.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
        let numbers: Option<Vec<f64>> =
            words.map(|word| word.parse().ok().filter(|number: &f64| number.is_finite())).collect();
        match numbers {
            Some(numbers) => Ok(Some((place, numbers))),
            None => Err(damaged(self.path, place, "holds something else than finite numbers")),
        }
    }

    /// A number alone.
    pub(super) fn number(&self, names: &[&str]) -> Found<f64> {
        match self.numbers(names)? {
            None => Ok(None),
            Some((place, numbers)) => match *numbers {
                [number] => Ok(Some((place, number))),
                _ => Err(damaged(self.path, place, "is not one number")),
            },
        }
    }

    /// The numbers of a matrix row by row, or of a list.
    pub(super) fn matrix(&self, names: &[&str]) -> Found<Vec<f64>> {
        for name in names {
            let part = |part: &str| format!("{name}.{part}");
            let Some((place, numbers)) = self.numbers(&[&part("data")])? else { continue };
            let sides = (self.number(&[&part("rows")])?, self.number(&[&part("cols")])?);
            let (Some((_, rows)), Some((_, columns))) = sides else {
                return Err(damaged(self.path, place, "has no rows and cols"));
            };
            if rows * columns != numbers.len() as f64 {
                let what = format!("holds {} numbers, and not {rows} x {columns}", numbers.len());
                return Err(damaged(self.path, place, what));
            }
            return Ok(Some((place, numbers)));
        }
        self.numbers(names)
    }
}

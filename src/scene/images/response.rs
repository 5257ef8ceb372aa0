//! A camera's response: how much light a code stands for, where a view says so of its target.

use std::path::Path;

use super::space::Curve;
use crate::error::{SceneError, read_bytes};
use crate::model::params::LARGEST;

/// A table of every code of sixteen bits, written out, is shorter.
const MOST_BYTES: u64 = 1 << 24;

/// How much light a code stands for, in each channel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Response {
    /// The code, as a share of the highest, to this power; 1 of linear codes.
    Gamma(f64),
    /// Light at codes evenly from 0 to the highest; linear between them.
    Table(Vec<[f64; 3]>),
}

impl Response {
    /// The table of a file: a row a code, evenly from 0 to the highest, each of one number or three (red, green, blue),
    /// with commas between them.
    ///
    /// # Errors
    /// When it cannot be read, or is no response: fewer than two rows, light below 0 or beyond what images hold, or less light
    /// for a higher code.
    pub(crate) fn read(path: &Path) -> Result<Self, SceneError> {
        let bytes = read_bytes(path, MOST_BYTES)?;
        // Spreadsheets begin a file with a mark of its encoding.
        let text = String::from_utf8_lossy(&bytes);
        let text = text.trim_start_matches('\u{feff}');
        let rows = "Give a row a code, evenly from 0 to the highest: one number, or red,green,blue";
        let wrong = |line: usize, what: String| SceneError::new(path, what, rows).at(format!("line {line}"));
        let mut table: Vec<[f64; 3]> = Vec::new();
        for (line, row) in (1..).zip(text.lines()).filter(|(_, row)| !row.trim().is_empty()) {
            let numbers: Option<Vec<f64>> = row.split(',').map(|number| number.trim().parse().ok()).collect();
            let light = match numbers.as_deref() {
                Some(&[grey]) => [grey; 3],
                Some(&[r, g, b]) => [r, g, b],
                _ => return Err(wrong(line, format!("`{}` is no light of a code", row.trim()))),
            };
            if let Some(number) = light.into_iter().find(|x| !(0.0..=LARGEST).contains(x)) {
                return Err(wrong(line, format!("{number} is no light")));
            }
            if table.last().is_some_and(|before| (0..3).any(|c| light[c] < before[c])) {
                return Err(wrong(
                    line,
                    "a higher code stands for less light than the one before".to_owned(),
                ));
            }
            table.push(light);
        }
        let (first, last) = match table.as_slice() {
            [first, .., last] => (*first, *last),
            few => return Err(SceneError::new(path, format!("has {} rows of a response", few.len()), rows)),
        };
        if (0..3).any(|c| last[c] <= first[c]) {
            return Err(SceneError::new(path, "is a response that is the same for all codes", rows));
        }
        Ok(Self::Table(table))
    }

    /// A curve a channel.
    pub(super) fn curves(&self) -> [Curve; 3] {
        [0, 1, 2].map(|c| -> Curve {
            match self {
                &Self::Gamma(gamma) => Box::new(move |code: f64| code.powf(gamma)),
                Self::Table(table) => {
                    let column: Vec<f64> = table.iter().map(|light| light[c]).collect();
                    Box::new(move |code: f64| interpolated(&column, code))
                }
            }
        })
    }
}

/// A column's value at this share of its length, which is at least two.
fn interpolated(column: &[f64], at: f64) -> f64 {
    let along = at.clamp(0.0, 1.0) * (column.len() - 1) as f64;
    let below = (along as usize).min(column.len() - 2);
    let share = along - below as f64;
    (1.0 - share) * column[below] + share * column[below + 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Response, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("response.csv");
        std::fs::write(&path, text).unwrap();
        Response::read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn a_table_is_linear_between_its_rows() {
        let [red, green, _] = read("\u{feff}0\n0.5, 1, 1\n\n1,4,2\n").unwrap().curves();
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0].map(&red), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!([0.0, 0.5, 1.0, 2.0].map(&green), [0.0, 1.0, 4.0, 4.0]);
        let [power, ..] = Response::Gamma(2.0).curves();
        assert_eq!(power(0.5), 0.25);
    }

    #[test]
    fn what_is_no_response_is_refused_with_its_line() {
        for (text, what) in [
            ("", "has 0 rows of a response"),
            ("1", "has 1 rows of a response"),
            ("0\nred,green,blue\n1", "line 2: `red,green,blue` is no light of a code"),
            ("0\n1,2", "line 2: `1,2` is no light of a code"),
            ("0\n-1", "line 2: -1 is no light"),
            ("0\ninf", "line 2: inf is no light"),
            ("0\n1e10", "line 2: 10000000000 is no light"),
            ("0\n1\n1,0.9,1", "line 3: a higher code stands for less light"),
            ("1\n1", "is the same for all codes"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(what) && error.contains("Give a row a code"), "{text}: {error}");
        }
    }
}

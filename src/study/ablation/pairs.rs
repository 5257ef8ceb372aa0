//! What pairs say that single parts do not: which parts stand in for each other.

use super::{Ablation, Row};
use crate::report::number;
use crate::report::page::{Cell, Table};

/// Two parts left out together, beside each of them alone.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// Both left out.
    pub both: &'a Row,
    /// How much more loss that adds than the two alone do, summed, as a multiple of the sum.
    pub ratio: f64,
    /// The sum.
    pub apart: f64,
}

/// Every pair whose parts are missed alone, too; those first that are missed most beyond the sum of the two.
#[must_use]
pub fn pairs(ablation: &Ablation) -> Vec<Pair<'_>> {
    let alone = |part| {
        let row = ablation.rows.iter().find(|row| row.left_out.left_out == [part])?;
        Some(row.change.loss.max(0.0))
    };
    let pair = |both| {
        let [a, b] = both_parts(both)?;
        let apart = alone(a)? + alone(b)?;
        (apart > 0.0).then(|| Pair { both, apart, ratio: both.change.loss / apart })
    };
    let mut pairs: Vec<Pair<'_>> = ablation.rows.iter().filter_map(pair).collect();
    pairs.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    pairs
}

fn both_parts(row: &Row) -> Option<[super::case::Part; 2]> {
    row.left_out.left_out.as_slice().try_into().ok()
}

/// The table of the page; nothing without pairs.
pub(super) fn table(ablation: &Ablation) -> Option<String> {
    let pairs = pairs(ablation);
    let mut table = Table::new(&[
        ("left out", "two parts together"),
        ("loss added", "by leaving out both"),
        ("one by one", "the sum of what leaving out each alone adds"),
        ("ratio", "above 1, each makes up for some of the other's absence"),
    ]);
    for Pair { both, apart, ratio } in &pairs {
        table.row(
            "",
            &[
                Cell::text(&both.left_out.name()),
                Cell::value(number(both.change.loss, 3), both.change.loss),
                Cell::value(number(*apart, 3), *apart),
                Cell::value(number(*ratio, 3), *ratio),
            ],
        );
    }
    let words = "<p class=\"quiet\">Far above 1: while one of the two is there, it makes up for some of the other's absence, so that what each is \
                 worth alone says too little. About 1: the two have nothing to do with each other. Below 1: one is of little use without \
                 the other.</p>";
    (!pairs.is_empty()).then(|| format!("{words}{}", table.html("by-pair")))
}

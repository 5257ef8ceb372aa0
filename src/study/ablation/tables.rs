//! The tables of an ablation's page.

use super::units::{self, signed};
use super::{Ablation, Row};
use crate::report::number;
use crate::report::page::{Cell, Table, escape};
use crate::significance::Change;
use crate::timing::Timed;

/// Where the GPU's time stands in the table, when it was measured.
const GPU_COLUMN: usize = 9;

/// Each case's errors and cost beside the whole model's.
pub(super) fn summary(ablation: &Ablation, full: &Row) -> String {
    let mut columns = vec![
        ("left out", "which effects or terms"),
        ("loss", "mean loss over all views"),
        ("change", "of the loss, with one standard error"),
        (
            "t",
            "the change over its standard error; 3 and more is beyond chance; exact: the whole model left no misfit, so any change is real",
        ),
        ("linear RMS, %", "difference of linear radiance, relative to the reference's root mean square"),
        ("PSNR, dB", "mean of the views"),
        ("SSIM", "mean of the views"),
        ("FLIP", "mean of the views"),
        ("CPU saved, %", "of a pass over all samples, every lookup live, with the quartiles of the rounds"),
        ("GPU saved, %", "of a frame of the first view"),
        ("ops saved, %", "planned operations a fragment"),
        ("bytes saved, %", "attributes and texels that a sample reads"),
        ("bakes saved.", "what need not be baked"),
    ];
    let untimed = ablation.adapter.is_none();
    if untimed {
        columns.remove(GPU_COLUMN);
    }
    let mut table = Table::new(&columns);
    for row in &ablation.rows {
        let class = if row.left_out.left_out.is_empty() { "reference" } else { "" };
        let mut cells = cells(row, full);
        if untimed {
            cells.remove(GPU_COLUMN);
        }
        table.row(class, &cells);
    }
    let note = "<p class=\"quiet\">Click a heading to sort. The first row is the whole model, timed \
                in turns with a second copy of itself: the time that it seems to save is the noise of the clock.</p>";
    format!("{note}{}", table.html("cases"))
}

fn cells(row: &Row, full: &Row) -> Vec<Cell> {
    let mean = row.mean();
    let saved = |own: f64, whole: f64| {
        let percent = units::saved(own, whole);
        Cell::value(minus(&signed(percent, 1)), percent)
    };
    let time = |time: Option<Timed>| {
        time.map_or_else(Cell::none, |time| {
            let [percent, half] = units::time_saved(time);
            let html = format!("{} <span class=\"pm inline\">± {half:.1}</span>", minus(&signed(percent, 1)));
            Cell::value(html, percent)
        })
    };
    vec![
        Cell::text(&row.left_out.name()),
        Cell::value(number(row.loss, 4), row.loss),
        change(&row.change, full.loss),
        t(&row.change),
        Cell::value(number(100.0 * mean.relative_rms, 3), mean.relative_rms),
        Cell::psnr(mean.psnr),
        Cell::score(mean.ssim, 4),
        Cell::score(mean.flip, 4),
        time(row.cpu),
        time(row.gpu),
        saved(row.counts.operations, full.counts.operations),
        saved(row.counts.bytes_a_sample as f64, full.counts.bytes_a_sample as f64),
        Cell::text(&full.counts.bakes_saved(&row.counts).join(", ")),
    ]
}

/// A minus sign as long as a plus.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

/// A change of the loss, as a share of the whole model's where that says something.
fn change(change: &Change, whole: f64) -> Cell {
    match (change.loss, units::loss_percent(change.loss, whole)) {
        (0.0, _) => Cell::value("0", 0.0),
        (loss, None) => Cell::value(format!("+{}", number(loss, 3)), loss),
        (loss, Some(percent)) => {
            let error = number(100.0 * change.std_error / whole, 2);
            let html = format!("{}% <span class=\"pm inline\">± {error}</span>", minus(&signed(percent, 2)));
            Cell::value(html, loss)
        }
    }
}

/// The change over its standard error.
fn t(change: &Change) -> Cell {
    match change.t {
        _ if change.is_nothing() => Cell::none(),
        // Sorted before every number.
        None => Cell::value("exact", f64::MAX),
        Some(t) => Cell::value(minus(&change.t_in_words()), t),
    }
}

/// What each part is worth to what no fit has seen, beside what it is worth to what was fitted; nothing where nothing is held
/// out.
pub(super) fn held_out(ablation: &Ablation) -> Option<String> {
    let whole = ablation.rows.first()?.held_out.as_ref()?;
    let fitted = ablation.rows.first()?.loss;
    let mut table = Table::new(&[
        ("left out", "which effects or terms"),
        ("fitted", "change of the loss of what was fitted, with one standard error"),
        ("t", "that change over its standard error"),
        ("held out", "change of the loss of what was held out, with one standard error"),
        ("t", "that change over its standard error"),
        ("PSNR, dB", "mean of the views that are held out"),
        ("its change, dB", "from the whole model's"),
        ("note.", "what is fitted worse without it, while what is held out is not, only overfits"),
    ]);
    for row in &ablation.rows {
        let Some(held) = &row.held_out else { continue };
        let class = if row.left_out.left_out.is_empty() { "reference" } else { "" };
        let psnr = held.psnr_change.map_or_else(Cell::none, |x| Cell::value(minus(&signed(x, 2)), x));
        table.row(
            class,
            &[
                Cell::text(&row.left_out.name()),
                change(&row.change, fitted),
                t(&row.change),
                change(&held.change, whole.loss),
                t(&held.change),
                Cell::psnr(held.psnr),
                psnr,
                Cell::text(if row.only_overfits() { "only overfits" } else { "" }),
            ],
        );
    }
    let names: Vec<&str> = ablation.held_out.iter().map(|reference| reference.name.as_str()).collect();
    Some(format!(
        "<p class=\"quiet\">Held out: {}. No fit has seen that: what a part is worth there is what it is worth beyond the images \
         that were fitted.</p>{}",
        escape(&names.join(", ")),
        table.html("by-held-out")
    ))
}

/// The errors of each view, of those that are held out after the others.
pub(super) fn views(ablation: &Ablation) -> String {
    let mut table = Table::new(&[
        ("left out", "which effects or terms"),
        ("view.", "the scene's view"),
        ("loss", "the view's mean loss"),
        ("linear RMS", "difference of linear radiance"),
        ("linear RMS, %", "the same, relative to the reference's root mean square"),
        ("PSNR, dB", ""),
        ("SSIM", ""),
        ("FLIP", ""),
    ]);
    for row in &ablation.rows {
        let class = if row.left_out.left_out.is_empty() { "reference" } else { "" };
        let held = row.held_out.iter().flat_map(|held| &held.views).map(|view| (view, " (held out)"));
        for (view, note) in row.views.iter().map(|view| (view, "")).chain(held) {
            table.row(
                class,
                &[
                    Cell::text(&row.left_out.name()),
                    Cell::text(&format!("{}{note}", view.view)),
                    Cell::value(number(view.loss, 4), view.loss),
                    Cell::value(number(view.linear_rms, 3), view.linear_rms),
                    Cell::value(number(100.0 * view.relative_rms, 3), view.relative_rms),
                    Cell::psnr(view.psnr),
                    Cell::score(view.ssim, 4),
                    Cell::score(view.flip, 4),
                ],
            );
        }
    }
    table.html("by-view")
}

/// The constants of each case: how those that are left make up for what is missing.
pub(super) fn constants(ablation: &Ablation) -> String {
    let names: Vec<&str> = ablation
        .rows
        .first()
        .map(|row| row.constants.iter().map(|c| c.name.as_str()).collect())
        .unwrap_or_default();
    let columns: Vec<(&str, &str)> = std::iter::once(("left out", "which effects or terms"))
        .chain(names.iter().map(|name| (*name, "its fitted value")))
        .chain([("best start.", "which start's end was kept, and of how many")])
        .collect();
    let mut table = Table::new(&columns);
    for row in &ablation.rows {
        let class = if row.left_out.left_out.is_empty() { "reference" } else { "" };
        let cell = |name: &&str| match row.constants.iter().find(|constant| constant.name == **name) {
            None => Cell::none(),
            Some(constant) => {
                let error =
                    constant.std_error.map_or_else(String::new, |error| format!(" ± {}", number(error, 2)));
                let html = format!("{}<span class=\"pm\">{error}</span>", number(constant.value, 4));
                Cell::value(html, constant.value)
            }
        };
        let best = row.starts.as_ref().map_or_else(Cell::none, |starts| Cell::text(&starts.words()));
        let cells: Vec<Cell> = std::iter::once(Cell::text(&row.left_out.name()))
            .chain(names.iter().map(cell))
            .chain([best])
            .collect();
        table.row(class, &cells);
    }
    table.html("by-constant")
}

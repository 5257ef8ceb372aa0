//! The page of an ablation.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::units::{self, signed};
use super::{Ablation, Row};
use crate::model::effects::Effect;
use crate::reference::{Source, psnr_in_words};
use crate::report::figures::triple;
use crate::report::page::{Cell, Page, Table, escape, facts, section, tile};
use crate::report::pictures::Picture;
use crate::report::plot::{Dot, Joined, Plot};
use crate::report::{number, seconds};
use crate::timing::Timed;
use crate::titles::title;

/// `report.html` of an ablation of the scene of that name.
///
/// # Errors
/// When a picture cannot be encoded, with the reason.
pub fn page(scene: &str, ablation: &Ablation) -> Result<String, String> {
    let Some((full, cases)) = ablation.rows.split_first() else { return Err("there is no row".to_owned()) };
    let mut main = warnings(&ablation.warnings);
    main += &section("summary", "What each part is worth, and what it costs", &summary(ablation, full));
    main += &section("tradeoff", "Worth against cost", &tradeoff(ablation, full, cases));
    if let Some(table) = super::pairs::table(ablation) {
        main += &section("pairs", "Which parts stand in for each other", &table);
    }
    let views = format!("<details><summary>Errors of each view</summary>{}</details>", views(ablation));
    main += &section("views", "View by view", &views);
    if ablation.refitted {
        main += &section("constants", "What the others made of it", &constants(ablation));
    }
    main += &section("pictures", "Pictures", &pictures(ablation, cases)?);
    main += &section("method", "How it was measured", &method(scene, ablation, full));
    let page = Page {
        kind: "ablation",
        title: &title(scene),
        lead: lead(ablation, cases),
        tiles: tiles(full, cases),
        main,
    };
    Ok(page.html())
}

fn warnings(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let items: String = warnings.iter().map(|w| format!("<li>{}</li>", escape(w))).collect();
    format!("<section class=\"warnings\" id=\"warnings\"><h2>Warnings</h2><ul>{items}</ul></section>")
}

/// The findings in sentences: what matters most, and what nobody would miss.
fn lead(ablation: &Ablation, cases: &[Row]) -> String {
    let single: Vec<&Row> = cases.iter().filter(|row| row.left_out.left_out.len() == 1).collect();
    let against = match ablation.source {
        Source::Targets => "the target images",
        Source::Model => "the whole model's own images",
    };
    let refit = if ablation.refitted { ", what is left fitted again" } else { "" };
    let mut text = format!("Each part of the model left out in turn{refit}, and compared with {against}.");
    let most = single.iter().filter(|row| row.change.is_significant() && row.change.loss > 0.0);
    if let Some(row) = most.max_by(|a, b| a.change.loss.total_cmp(&b.change.loss)) {
        let _ = write!(text, " Nothing is missed as much as <b>{}</b>.", escape(&row.left_out.name()));
    }
    let list = |rows: Vec<&&Row>| -> String {
        let names: Vec<String> =
            rows.iter().map(|row| format!("<b>{}</b>", escape(&row.left_out.name()))).collect();
        names.join(", ")
    };
    let nothing: Vec<_> = single.iter().filter(|row| row.change.is_nothing()).collect();
    let chance: Vec<_> =
        single.iter().filter(|row| !row.change.is_nothing() && !row.change.is_significant()).collect();
    let better: Vec<_> =
        single.iter().filter(|row| row.change.loss < 0.0 && row.change.is_significant()).collect();
    for (rows, words) in [
        (nothing, "Without a trace go"),
        (chance, "Within chance of making no difference:"),
        (better, "The images are matched better without"),
    ] {
        if !rows.is_empty() {
            let _ = write!(text, " {words} {}.", list(rows));
        }
    }
    text
}

fn tiles(full: &Row, cases: &[Row]) -> String {
    let mean = full.mean();
    let score = |x: Option<f64>, digits: usize| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.digits$}"));
    let single = cases.iter().filter(|row| row.left_out.left_out.len() == 1).count();
    let pass = full.cpu.map_or_else(|| "–".to_owned(), |t| seconds(t.seconds.median));
    let tiles = [
        ("loss, whole model", number(full.loss, 3), String::new()),
        ("PSNR", psnr_in_words(mean.psnr), "dB, mean of the views".to_owned()),
        ("SSIM", score(mean.ssim, 3), String::new()),
        ("FLIP", score(mean.flip, 3), String::new()),
        ("parts", single.to_string(), format!("{} cases", cases.len())),
        ("CPU pass", pass, "every lookup live".to_owned()),
    ];
    tiles.iter().map(|(name, value, note)| tile(name, value, note)).collect()
}

/// Where the GPU's time stands in the table, when it was measured.
const GPU_COLUMN: usize = 9;

fn summary(ablation: &Ablation, full: &Row) -> String {
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
    let minus = |text: String| text.replace('-', "−");
    let saved = |own: f64, whole: f64| {
        let percent = units::saved(own, whole);
        Cell::value(minus(signed(percent, 1)), percent)
    };
    let time = |time: Option<Timed>| {
        time.map_or_else(Cell::none, |time| {
            let [percent, half] = units::time_saved(time);
            let html = format!("{} <span class=\"pm inline\">± {half:.1}</span>", minus(signed(percent, 1)));
            Cell::value(html, percent)
        })
    };
    let change = match (row.change.loss, units::loss_percent(row.change.loss, full)) {
        (0.0, _) => Cell::value("0", 0.0),
        (change, None) => Cell::value(format!("+{}", number(change, 3)), change),
        (change, Some(percent)) => {
            let error = number(100.0 * row.change.std_error / full.loss, 2);
            let html = format!("{}% <span class=\"pm inline\">± {error}</span>", minus(signed(percent, 2)));
            Cell::value(html, change)
        }
    };
    let t = match row.change.t {
        _ if row.change.is_nothing() => Cell::none(),
        // Sorted before every number.
        None => Cell::value("exact", f64::MAX),
        Some(t) => Cell::value(row.change.t_in_words().replace('-', "−"), t),
    };
    vec![
        Cell::text(&row.left_out.name()),
        Cell::value(number(row.loss, 4), row.loss),
        change,
        t,
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

fn tradeoff(ablation: &Ablation, full: &Row, cases: &[Row]) -> String {
    let many = cases.len() > 24;
    let dot = |row: &Row| {
        let saved = 100.0 * (1.0 - row.counts.operations / full.counts.operations.max(1.0));
        let two = row.left_out.left_out.len() > 1;
        let name = row.left_out.name();
        Dot {
            x: saved.max(0.0),
            y: row.change.loss.max(0.0),
            label: if many && two { String::new() } else { name.clone() },
            title: format!(
                "without {name}: loss {} more, {saved:.1}% of the operations saved",
                number(row.change.loss, 3)
            ),
            series: usize::from(two),
            front: row.change.is_significant(),
        }
    };
    let plot = Plot {
        x: "operations saved, % of the whole model's",
        y: "loss added (0 and below: at the foot)",
        log_x: false,
        dots: cases.iter().map(dot).collect(),
        series: if ablation.rows.iter().any(|row| row.left_out.left_out.len() > 1) {
            vec!["one left out".to_owned(), "two left out".to_owned()]
        } else {
            Vec::new()
        },
        joined: Joined::No,
    };
    format!(
        "<p class=\"quiet\">Low and to the right: what saves much and is hardly missed. Filled where the change is beyond chance \
         (t of 3, or exact). Point at a dot for its values.</p>{}{}",
        plot.svg(),
        plot.legend()
    )
}

fn views(ablation: &Ablation) -> String {
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
        for view in &row.views {
            table.row(
                class,
                &[
                    Cell::text(&row.left_out.name()),
                    Cell::text(&view.view),
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
fn constants(ablation: &Ablation) -> String {
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

/// Each part's views, those that matter most first.
fn pictures(ablation: &Ablation, cases: &[Row]) -> Result<String, String> {
    let mut single: Vec<&Row> = cases.iter().filter(|row| row.left_out.left_out.len() == 1).collect();
    single.sort_by(|a, b| b.change.loss.total_cmp(&a.change.loss));
    let before: Vec<Picture> =
        ablation.references.iter().map(|reference| Picture::of_image(&reference.image)).collect();
    let case = |(i, row): (usize, &&Row)| -> Result<String, String> {
        let name = row.left_out.name();
        let without = format!("without {name}");
        let mut views = String::new();
        for (view, before) in row.views.iter().zip(&before) {
            let Some((image, flip)) = &view.pictures else { continue };
            let words = ["reference", without.as_str(), "wipe in the reference"];
            let triple = triple(&view.view, before, image, flip, words)?;
            let _ = write!(
                views,
                "<article class=\"view\"><header><h3>{}</h3></header>{triple}</article>",
                escape(&view.view)
            );
        }
        // The first few are seen at once, also without scripts.
        let open = if i < 2 { " open" } else { "" };
        Ok(format!(
            "<details class=\"case\"{open}><summary>{} <small>loss {} · FLIP {}</small></summary>{views}</details>",
            escape(&without),
            if row.change.loss == 0.0 {
                "unchanged".to_owned()
            } else {
                format!("{} more", number(row.change.loss, 3))
            },
            row.mean().flip.map_or_else(|| "–".to_owned(), |flip| format!("{flip:.4}")),
        ))
    };
    Ok(single.par_iter().enumerate().map(case).collect::<Result<Vec<_>, _>>()?.concat())
}

fn method(scene: &str, ablation: &Ablation, full: &Row) -> String {
    let reference = match ablation.source {
        Source::Targets => "the scene's target images",
        Source::Model => "the whole model's images: the scene names no target",
    };
    let effects: Vec<&str> = ablation.setup.effects.iter().map(Effect::name).collect();
    let rows = [
        ("software", format!("skinfit {}", env!("CARGO_PKG_VERSION"))),
        ("scene", scene.to_owned()),
        ("reference", reference.to_owned()),
        ("constants", ablation.constants.clone()),
        ("form", ablation.setup.form.name().to_owned()),
        ("silhouette", ablation.setup.silhouette.name().to_owned()),
        ("effects", effects.join(", ")),
        ("loss", ablation.loss.name().to_owned()),
        ("samples", full.counts.samples.to_string()),
        ("GPU", ablation.adapter.clone().unwrap_or_else(|| "not measured".to_owned())),
        ("threads", rayon::current_num_threads().to_string()),
        ("instructions", crate::simd::instructions()),
    ];
    let rows: Vec<(String, String)> = rows.into_iter().map(|(name, text)| (name.to_owned(), text)).collect();
    format!(
        "<p>A case and the whole model are compared on the same pixels. The standard error of the loss's change is that of sums over \
         blocks of pixels (sides of 8, 16, 32, … pixels; the greatest error counts), as neighbouring pixels err alike. It tells chance \
         in these images from a change that other images of the kind would show too. Times are medians of rounds in which the case and \
         the whole model take turns; ± is half the distance of the quartiles. Operations are the shader planner's, of the exact \
         shader; bytes are a sample's attributes and the texels of its lookups.</p>{}",
        facts(&rows)
    )
}

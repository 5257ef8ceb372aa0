//! The page of an ablation.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::{Ablation, Row, tables};
use crate::model::effects::Effect;
use crate::reference::{Source, psnr_in_words};
use crate::report::figures::triple;
use crate::report::page::{Page, escape, facts, section, tile};
use crate::report::pictures::Picture;
use crate::report::plot::{Dot, Joined, Plot};
use crate::report::{number, seconds};
use crate::titles::{title, title_of_several};

/// `report.html` of an ablation of the scene of that name.
///
/// # Errors
/// When a picture cannot be encoded, with the reason.
pub fn page(scene: &str, ablation: &Ablation) -> Result<String, String> {
    let Some((full, cases)) = ablation.rows.split_first() else { return Err("there is no row".to_owned()) };
    let mut main = warnings(&ablation.warnings);
    main +=
        &section("summary", "What each part is worth, and what it costs", &tables::summary(ablation, full));
    if let Some(table) = tables::held_out(ablation) {
        main += &section("held-out", "What each part is worth to what no fit has seen", &table);
    }
    main += &section("tradeoff", "Worth against cost", &tradeoff(ablation, full, cases));
    if let Some(table) = super::pairs::table(ablation) {
        main += &section("pairs", "Which parts stand in for each other", &table);
    }
    let views =
        format!("<details><summary>Errors of each view</summary>{}</details>", tables::views(ablation));
    main += &section("views", "View by view", &views);
    if ablation.refitted {
        main += &section("constants", "What the others made of it", &tables::constants(ablation));
    }
    main += &section("pictures", "Pictures", &pictures(ablation, cases)?);
    main += &section("method", "How it was measured", &method(scene, ablation, full));
    let page = Page {
        kind: "ablation",
        title: &if ablation.scenes.is_empty() { title(scene) } else { title_of_several(&ablation.scenes) },
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
    let scenes = match ablation.scenes.len() {
        0 => String::new(),
        several => format!(" of {several} scenes of one skin at once"),
    };
    let mut text =
        format!("Each part of the model left out in turn{scenes}{refit}, and compared with {against}.");
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
    let overfits: Vec<_> = single.iter().filter(|row| row.only_overfits()).collect();
    for (rows, words) in [
        (nothing, "Without a trace go"),
        (chance, "Within chance of making no difference:"),
        (better, "The images are matched better without"),
        (overfits, "What is held out is matched no worse without"),
    ] {
        if !rows.is_empty() {
            let _ = write!(text, " {words} {}.", list(rows));
        }
    }
    text
}

fn plural(views: usize) -> &'static str {
    if views == 1 { "view" } else { "views" }
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
    let held = full.held_out.as_ref().map(|held| {
        let views = held.views.len();
        ("PSNR, held out", psnr_in_words(held.psnr), format!("dB, mean of {views} {}", plural(views)))
    });
    tiles.iter().chain(&held).map(|(name, value, note)| tile(name, value, note)).collect()
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

/// Each part's views, those that matter most first.
fn pictures(ablation: &Ablation, cases: &[Row]) -> Result<String, String> {
    let mut single: Vec<&Row> = cases.iter().filter(|row| row.left_out.left_out.len() == 1).collect();
    single.sort_by(|a, b| b.change.loss.total_cmp(&a.change.loss));
    let all = ablation.references.iter().chain(&ablation.held_out);
    let before: Vec<Picture> = all.map(|reference| Picture::of_image(&reference.image)).collect();
    let case = |(i, row): (usize, &&Row)| -> Result<String, String> {
        let name = row.left_out.name();
        let without = format!("without {name}");
        let mut views = String::new();
        let held = row.held_out.iter().flat_map(|held| &held.views).map(|view| (view, " (held out)"));
        let all = row.views.iter().map(|view| (view, "")).chain(held);
        for ((view, note), before) in all.zip(&before) {
            let Some((image, flip)) = &view.pictures else { continue };
            let words = ["reference", without.as_str(), "wipe in the reference"];
            let triple = triple(&view.view, before, image, flip, words)?;
            let _ = write!(
                views,
                "<article class=\"view\"><header><h3>{}{note}</h3></header>{triple}</article>",
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

/// How several scenes are taken together.
const SEVERAL: &str = " A part is left out of all scenes at once, and losses are means over the weighted pixels and channels of all. \
                       Samples and bakes are added up; what a sample or a fragment costs is the mean over all samples; the \
                       renderer draws the first scene.";
/// What held-out views are for.
const HELD_OUT: &str = " What is held out is in no fit, and no score or change but its own is of it.";

fn method(scene: &str, ablation: &Ablation, full: &Row) -> String {
    let reference = match ablation.source {
        Source::Targets => "the scene's target images",
        Source::Model => "the whole model's images: the scene names no target",
    };
    let held_out: Vec<&str> = ablation.held_out.iter().map(|reference| reference.name.as_str()).collect();
    let effects: Vec<&str> = ablation.setup.effects.iter().map(Effect::name).collect();
    let rows = [
        ("software", format!("skinfit {}", env!("CARGO_PKG_VERSION"))),
        ("scene", scene.to_owned()),
        ("held out", held_out.join(", ")),
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
    let told = rows.into_iter().filter(|(name, _)| *name != "held out" || !held_out.is_empty());
    let rows: Vec<(String, String)> = told.map(|(name, text)| (name.to_owned(), text)).collect();
    let note = if held_out.is_empty() { "" } else { HELD_OUT };
    let several = if ablation.scenes.is_empty() { "" } else { SEVERAL };
    format!(
        "<p>A case and the whole model are compared on the same pixels. The standard error of the loss's change is that of sums over \
         blocks of pixels (sides of 8, 16, 32, … pixels; the greatest error counts), as neighbouring pixels err alike. It tells chance \
         in these images from a change that other images of the kind would show too. Times are medians of rounds in which the case and \
         the whole model take turns; ± is half the distance of the quartiles. Operations are the shader planner's, of the exact \
         shader; bytes are a sample's attributes and the texels of its lookups.{several}{note}</p>{}",
        facts(&rows)
    )
}

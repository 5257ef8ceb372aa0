//! What an ablation leaves in its folder, and what it prints.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::units::{self, signed};
use super::{Ablation, Row, ViewRow, page};
use crate::StudyError;
use crate::leftovers::Leftovers;
use crate::output::{self, OutputError};
use crate::reference::{psnr_in_csv, psnr_in_words};
use crate::render::files::write_png_bytes;
use crate::render::image::Image;
use crate::report::file_stem;
use crate::report::metrics::PSNR_OF_EQUALS;
use crate::report::pictures::{Picture, strip};
use crate::significance::Change;
use crate::timing::Timed;

/// Write `results.csv`, `results.json`, `report.html` and, for each part and view, `<view>_without_<part>.png`
/// (reference, what is left, FLIP error); what an earlier ablation left there and this one does not write anew goes.
/// What was written.
///
/// # Errors
/// When a file cannot be written; each is whole or not there.
pub fn write(folder: &Path, scene: &str, ablation: &Ablation) -> Result<Vec<PathBuf>, StudyError> {
    let earlier = Leftovers::of(folder);
    let pictures = pictures(ablation);
    let mut names = vec!["results.csv".to_owned(), "report.html".to_owned()];
    names.extend(pictures.iter().map(|picture| picture.name.clone()));
    let mut written = Vec::new();
    let mut add = |name: &str, bytes: &[u8]| -> Result<(), StudyError> {
        written.push(folder.join(name));
        Ok(output::write(&folder.join(name), bytes)?)
    };
    add("results.csv", csv(ablation).as_bytes())?;
    let html = page::page(scene, ablation).map_err(|e| OutputError::new(folder, &e))?;
    add("report.html", html.as_bytes())?;
    let json = json(scene, ablation, &names).map_err(|e| OutputError::new(folder, &e))?;
    add("results.json", json.as_bytes())?;
    for StripOf { name, left_out, view, reference } in &pictures {
        let Some((image, flip)) = &view.pictures else { continue };
        let before = Picture::of_image(reference);
        let words = ["reference".to_owned(), format!("without {left_out}"), "FLIP error".to_owned()];
        let sheet = strip(&view.view, &[before, image.clone(), flip.clone()], &words, &scores(view));
        let path = folder.join(name);
        write_png_bytes(&path, sheet.width, sheet.height, &sheet.bytes)?;
        written.push(path);
    }
    earlier.remove(&names)?;
    Ok(written)
}

/// A picture of a part and a view.
struct StripOf<'a> {
    /// Its file.
    name: String,
    left_out: String,
    view: &'a ViewRow,
    reference: &'a Image,
}

/// The pictures of each single part.
fn pictures(ablation: &Ablation) -> Vec<StripOf<'_>> {
    let mut pictures = Vec::new();
    for row in ablation.rows.iter().filter(|row| row.left_out.left_out.len() == 1) {
        let left_out = row.left_out.name();
        let held = row.held_out.iter().flat_map(|held| &held.views).zip(&ablation.held_out);
        for (view, reference) in row.views.iter().zip(&ablation.references).chain(held) {
            if view.pictures.is_some() {
                let name = format!("{}_without_{left_out}.png", file_stem(&view.view));
                pictures.push(StripOf {
                    name,
                    left_out: left_out.clone(),
                    view,
                    reference: &reference.image,
                });
            }
        }
    }
    pictures
}

fn scores(view: &ViewRow) -> String {
    match (view.psnr, view.ssim, view.flip) {
        (Some(psnr), ..) if psnr >= PSNR_OF_EQUALS => "equal".to_owned(),
        (Some(psnr), Some(ssim), Some(flip)) => {
            format!("PSNR {psnr:.2} dB    SSIM {ssim:.4}    FLIP {flip:.4}")
        }
        _ => "no pixel is fully covered".to_owned(),
    }
}

/// A row a case for all views together, then one for each view; where some are held out, another for all of these, then
/// one for each.
fn csv(ablation: &Ablation) -> String {
    let holds = !ablation.held_out.is_empty();
    let mut text = String::from(
        "left_out,view,loss,loss_change,std_error,t,linear_rms,relative_rms,psnr_db,ssim,flip,cpu_ms,cpu_ratio,\
         gpu_ms,gpu_ratio,operations,bytes_a_sample,samples,baked_bytes,bakes,starts,best_start",
    );
    text += if holds { ",held_out,psnr_change_db\n" } else { "\n" };
    for row in &ablation.rows {
        let name = row.left_out.name();
        let Row { loss, change, counts, starts, .. } = row;
        let _ = write!(
            text,
            "{name},all,{loss:e},{},{},{},{},{:.1},{},{},{},{},{}",
            change_columns(change),
            view_columns(&row.mean()),
            timed(row.cpu),
            timed(row.gpu),
            counts.operations,
            counts.bytes_a_sample,
            counts.samples,
            counts.baked_bytes,
            counts.bakes.join(" "),
            starts.as_ref().map_or_else(|| ",".to_owned(), |s| format!("{},{}", s.tried.len(), s.best)),
        );
        text += if holds { ",false,\n" } else { "\n" };
        for view in &row.views {
            text += &view_line(&name, view, "");
            text += if holds { ",false,\n" } else { "\n" };
        }
        let Some(held) = &row.held_out else { continue };
        text += &view_line(&name, &held.mean(), &change_columns(&held.change));
        let _ = writeln!(text, ",true,{}", held.psnr_change.map_or_else(String::new, |x| format!("{x:.5}")));
        for view in &held.views {
            text += &view_line(&name, view, "");
            text += ",true,\n";
        }
    }
    text
}

fn change_columns(change: &Change) -> String {
    let t = change.t.map_or_else(String::new, |t| format!("{t:.2}"));
    format!("{:e},{:e},{t}", change.loss, change.std_error)
}

/// A line without what a case costs.
fn view_line(left_out: &str, view: &ViewRow, change: &str) -> String {
    let change = if change.is_empty() { ",," } else { change };
    let name = view.view.replace([',', '"', '\n'], "_");
    format!("{left_out},{name},{:e},{change},{},,,,,,,,,,,", view.loss, view_columns(view))
}

fn view_columns(view: &ViewRow) -> String {
    let score = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.5}"));
    let (psnr, ssim, flip) = (psnr_in_csv(view.psnr), score(view.ssim), score(view.flip));
    format!("{:e},{:e},{psnr},{ssim},{flip}", view.linear_rms, view.relative_rms)
}

fn timed(time: Option<Timed>) -> String {
    time.map_or_else(|| ",".to_owned(), |t| format!("{:.4},{:.4}", 1e3 * t.seconds.median, t.ratio.median))
}

fn json(scene: &str, ablation: &Ablation, files: &[String]) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct File<'a> {
        scene: &'a str,
        #[serde(skip_serializing_if = "<[String]>::is_empty")]
        scenes: &'a [String],
        reference: crate::reference::Source,
        constants: &'a str,
        refitted: bool,
        loss: &'static str,
        adapter: &'a Option<String>,
        rows: &'a [Row],
        warnings: &'a [String],
        files: &'a [String],
    }
    let Ablation { source, scenes, constants, refitted, loss, adapter, rows, warnings, .. } = ablation;
    let (reference, refitted, loss) = (*source, *refitted, loss.name());
    let file = File { scene, scenes, reference, constants, refitted, loss, adapter, rows, warnings, files };
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

impl Change {
    /// `t` in a table of text: `-` where nothing changes, `exact` where there was no misfit to compare with.
    #[must_use]
    pub fn t_in_words(&self) -> String {
        match self.t {
            _ if self.is_nothing() => "-".to_owned(),
            None => "exact".to_owned(),
            // Blocks that all change alike leave next to no error.
            Some(t) if t.abs() >= 1e4 => format!("{t:+.0e}"),
            Some(t) => format!("{t:+.1}"),
        }
    }
}

/// The table on standard output, in the units of the page.
#[must_use]
pub fn table(ablation: &Ablation) -> String {
    let holds = !ablation.held_out.is_empty();
    let width = ablation.rows.iter().map(|row| row.left_out.name().len()).max().unwrap_or(0).max(8);
    let held =
        if holds { format!("{:>10} {:>7} {:>8}  ", "held out", "t", "PSNR, dB") } else { String::new() };
    let mut text = format!(
        "{:width$}  {:>10} {:>10} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>8}  {held}{}\n",
        "left out",
        "loss",
        "change",
        "t",
        "PSNR",
        "SSIM",
        "FLIP",
        "CPU, %",
        "GPU, %",
        "ops, %",
        "bytes, %",
        "bakes saved"
    );
    let Some(full) = ablation.rows.first() else { return text };
    for row in &ablation.rows {
        let mean = row.mean();
        let score =
            |x: Option<f64>, digits: usize| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.digits$}"));
        let time =
            |x: Option<Timed>| x.map_or_else(|| "-".to_owned(), |x| signed(units::time_saved(x)[0], 1));
        let (own, whole) = (&row.counts, &full.counts);
        let bytes = units::saved(own.bytes_a_sample as f64, whole.bytes_a_sample as f64);
        let _ = writeln!(
            text,
            "{:width$}  {:>10.3e} {:>10} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>8}  {}{}",
            row.left_out.name(),
            row.loss,
            change_in_words(&row.change, full.loss),
            row.change.t_in_words(),
            psnr_in_words(mean.psnr),
            score(mean.ssim, 4),
            score(mean.flip, 4),
            time(row.cpu),
            time(row.gpu),
            signed(units::saved(own.operations, whole.operations), 1),
            signed(bytes, 1),
            held_out_in_words(row, full),
            whole.bakes_saved(own).join(" "),
        );
    }
    text
}

/// A change as a share of the whole model's loss, or as it is.
fn change_in_words(change: &Change, whole: f64) -> String {
    match units::loss_percent(change.loss, whole) {
        _ if change.loss == 0.0 => "0".to_owned(),
        Some(percent) => format!("{}%", signed(percent, 2)),
        None => format!("{:+.2e}", change.loss),
    }
}

/// How what is held out changes; nothing where nothing is.
fn held_out_in_words(row: &Row, full: &Row) -> String {
    let Some((held, whole)) = row.held_out.as_ref().zip(full.held_out.as_ref()) else { return String::new() };
    let change = change_in_words(&held.change, whole.loss);
    let psnr = held.psnr_change.map_or_else(|| "-".to_owned(), |change| signed(change, 2));
    format!("{change:>10} {:>7} {psnr:>8}  ", held.change.t_in_words())
}

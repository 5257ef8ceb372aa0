//! What an ablation leaves in its folder, and what it prints.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Ablation, Row, ViewRow, page};
use crate::output;
use crate::render::files::write_png_bytes;
use crate::report::file_stem;
use crate::report::pictures::{Picture, strip};
use crate::study::StudyError;
use crate::study::timing::Timed;

/// Write `results.csv`, `results.json`, `report.html` and, for each part and view, `<view>_without_<part>.png`
/// (reference, what is left, FLIP error). What was written.
///
/// # Errors
/// When a file cannot be written; each is whole or not there.
pub fn write(folder: &Path, scene: &str, ablation: &Ablation) -> Result<Vec<PathBuf>, StudyError> {
    let mut written = Vec::new();
    let mut add = |name: &str, bytes: &[u8]| -> Result<(), StudyError> {
        written.push(folder.join(name));
        Ok(output::write(&folder.join(name), bytes)?)
    };
    add("results.csv", csv(ablation).as_bytes())?;
    add("results.json", json(scene, ablation).map_err(|e| output::OutputError::new(folder, &e))?.as_bytes())?;
    let html = page::page(scene, ablation).map_err(|e| output::OutputError::new(folder, &e))?;
    add("report.html", html.as_bytes())?;
    for row in ablation.rows.iter().filter(|row| row.left_out.left_out.len() == 1) {
        for (view, reference) in row.views.iter().zip(&ablation.references) {
            let Some((image, flip)) = &view.pictures else { continue };
            let name = row.left_out.name();
            let before = Picture::of_image(&reference.image);
            let words = ["reference".to_owned(), format!("without {name}"), "FLIP error".to_owned()];
            let sheet = strip(&view.view, &[before, image.clone(), flip.clone()], &words, &scores(view));
            let path = folder.join(format!("{}_without_{name}.png", file_stem(&view.view)));
            write_png_bytes(&path, sheet.width, sheet.height, &sheet.bytes)?;
            written.push(path);
        }
    }
    Ok(written)
}

fn scores(view: &ViewRow) -> String {
    match (view.psnr, view.ssim, view.flip) {
        (Some(psnr), Some(ssim), Some(flip)) => {
            format!("PSNR {psnr:.2} dB    SSIM {ssim:.4}    FLIP {flip:.4}")
        }
        _ => "no pixel is fully covered".to_owned(),
    }
}

/// A row a case for all views together, then one for each view.
fn csv(ablation: &Ablation) -> String {
    let mut text = String::from(
        "left_out,view,loss,loss_change,std_error,t,linear_rms,relative_rms,psnr_db,ssim,flip,cpu_ms,cpu_ratio,\
         gpu_ms,gpu_ratio,operations,bytes_a_sample,samples,baked_bytes,bakes\n",
    );
    for row in &ablation.rows {
        let (name, mean) = (row.left_out.name(), row.mean());
        let Row { loss, change, counts, .. } = row;
        let _ = writeln!(
            text,
            "{name},all,{loss:e},{:e},{:e},{:.2},{},{},{},{:.1},{},{},{},{}",
            change.loss,
            change.std_error,
            change.t,
            view_columns(&mean),
            timed(row.cpu),
            timed(row.gpu),
            counts.operations,
            counts.bytes_a_sample,
            counts.samples,
            counts.baked_bytes,
            counts.bakes.join(" "),
        );
        for view in &row.views {
            let name_of_view = view.view.replace([',', '"', '\n'], "_");
            let _ =
                writeln!(text, "{name},{name_of_view},{:e},,,,{},,,,,,,,,", view.loss, view_columns(view));
        }
    }
    text
}

fn view_columns(view: &ViewRow) -> String {
    let score = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.5}"));
    let scores = [view.psnr, view.ssim, view.flip].map(score).join(",");
    format!("{:e},{:e},{scores}", view.linear_rms, view.relative_rms)
}

fn timed(time: Option<Timed>) -> String {
    time.map_or_else(|| ",".to_owned(), |t| format!("{:.4},{:.4}", 1e3 * t.seconds.median, t.ratio.median))
}

fn json(scene: &str, ablation: &Ablation) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct File<'a> {
        scene: &'a str,
        reference: crate::study::reference::Source,
        constants: &'a str,
        refitted: bool,
        loss: &'static str,
        adapter: &'a Option<String>,
        rows: &'a [Row],
        warnings: &'a [String],
    }
    let Ablation { source, constants, refitted, loss, adapter, rows, warnings, .. } = ablation;
    let (reference, refitted, loss) = (*source, *refitted, loss.name());
    let file = File { scene, reference, constants, refitted, loss, adapter, rows, warnings };
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

impl Row {
    /// The means over the views.
    #[must_use]
    pub fn mean(&self) -> ViewRow {
        let all = |value: &dyn Fn(&ViewRow) -> Option<f64>| {
            let values: Vec<f64> = self.views.iter().filter_map(value).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        ViewRow {
            view: "all".to_owned(),
            loss: self.loss,
            linear_rms: all(&|v| Some(v.linear_rms)).unwrap_or(0.0),
            relative_rms: all(&|v| Some(v.relative_rms)).unwrap_or(0.0),
            psnr: all(&|v| v.psnr),
            ssim: all(&|v| v.ssim),
            flip: all(&|v| v.flip),
            pictures: None,
        }
    }
}

/// The table on standard output.
#[must_use]
pub fn table(ablation: &Ablation) -> String {
    let width = ablation.rows.iter().map(|row| row.left_out.name().len()).max().unwrap_or(0).max(8);
    let mut text = format!(
        "{:width$}  {:>10} {:>10} {:>7} {:>7} {:>7} {:>7} {:>6} {:>6} {:>5} {:>8}  {}\n",
        "left out",
        "loss",
        "change",
        "t",
        "PSNR",
        "SSIM",
        "FLIP",
        "CPU",
        "GPU",
        "ops",
        "B/sample",
        "bakes saved"
    );
    let full = ablation.rows.first();
    for row in &ablation.rows {
        let mean = row.mean();
        let score =
            |x: Option<f64>, digits: usize| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.digits$}"));
        let ratio =
            |x: Option<Timed>| x.map_or_else(|| "-".to_owned(), |x| format!("x{:.2}", x.ratio.median));
        let saved = full.map(|full| full.counts.bakes_saved(&row.counts)).unwrap_or_default();
        let _ = writeln!(
            text,
            "{:width$}  {:>10.3e} {:>10} {:>7} {:>7} {:>7} {:>7} {:>6} {:>6} {:>5.0} {:>8}  {}",
            row.left_out.name(),
            row.loss,
            if row.change.loss == 0.0 { "0".to_owned() } else { format!("{:+.2e}", row.change.loss) },
            if row.change.is_nothing() { "-".to_owned() } else { format!("{:+.1}", row.change.t) },
            score(mean.psnr, 2),
            score(mean.ssim, 4),
            score(mean.flip, 4),
            ratio(row.cpu),
            ratio(row.gpu),
            row.counts.operations,
            row.counts.bytes_a_sample,
            saved.join(" "),
        );
    }
    text
}

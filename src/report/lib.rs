//! Metrics, pictures and pages that show how good a fit is.
//!
//! - [`compared`]: what of a view is compared; [`metrics`], [`flip`]: PSNR, SSIM and FLIP of a view
//! - [`json`]: the file `report.json`; [`errors`]: what its standard errors rest on
//! - [`misfit`]: what a fit gets wrong as a whole, and where; [`signed`]: its signed error as a picture
//! - [`pictures`]: target | fit | error side by side
//! - [`page`], [`plot`]: what all pages share: sortable tables, scatter plots, pictures that wipe
//! - [`maps`]: what whole maps gained, where they were fitted
//! - [`diffusion`]: what texture-space diffusion makes in texels
//! - [`html`]: the page `report.html`, with its `figures`, `charts`, `tables`, `verdict` and `words`
//!
//! [`write_run`] leaves all of it in a run's folder, with an EXR of the terms for each view.

mod charts;
pub mod compared;
pub mod diffusion;
pub mod errors;
pub mod figures;
mod filter;
pub mod flip;
pub mod html;
pub mod json;
mod lettering;
pub mod maps;
pub mod metrics;
pub mod misfit;
mod ordered;
pub mod page;
pub mod pictures;
pub mod plot;
pub mod signed;
mod tables;
mod verdict;
mod view_summary;
mod words;

pub use verdict::held_out;
pub use words::{count, number, seconds};

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{engine, fit, model, output, prepare, progress, render, scene};

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;

use crate::engine::joint::label;
use crate::fit::outcome::Outcome;
use crate::output::OutputError;
pub use crate::prepare::StageSeconds;
use crate::render::files::{self, Image, ImageFileError, ImageOptions};
use crate::render::places::Places;
use crate::scene::Loss;
use crate::scene::view::Clip;
use diffusion::DiffusedScene;
use json::{Summary, ViewSummary};
use maps::MapEvidence;
use metrics::Comparison;
use misfit::Misfit;
use pictures::Picture;

/// The folder of the scenes' files in the run folder of a fit of several.
pub const SCENES: &str = scene::names::RUN_SCENES;
/// The folder of fitted maps in a run folder.
pub const MAPS: &str = "maps";
/// What was found of fitted maps, in numbers.
pub const MAPS_JSON: &str = "maps.json";

/// What a report says of a run beside the fit's outcome.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// The scene's file, or what the built-in scene is called.
    pub scene: String,
    /// Of several scenes that were fitted as one skin their names, in the order of the unknowns' numbers; empty of one.
    pub scenes: Vec<String>,
    /// What was minimised.
    pub loss: Loss,
    /// Which engine evaluated the model: `cpu` or `gpu`.
    pub engine: String,
    /// Surface samples over all views.
    pub samples: u64,
    /// Seconds spent in each stage.
    pub seconds: StageSeconds,
    /// The images, in the order of the scene's views; those of views that were held out come last.
    pub views: Vec<ViewEvidence>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Further (name, text) to tell where the numbers come from: effects, seed, threads.
    pub provenance: Vec<(String, String)>,
    /// Who made it when, and on what, as further (name, text): told by the report alone, so that the images of equal
    /// runs are equal.
    pub made: Vec<(String, String)>,
    /// What whole maps gained, where they were fitted.
    pub maps: Option<MapEvidence>,
    /// What texture-space diffusion has made in each scene that has it.
    pub diffused: Vec<DiffusedScene>,
    /// Files that the run's scene names: where one is what an earlier run left, it stays.
    pub named: Vec<PathBuf>,
    /// Other files that the run has left in its folder, by their paths from there.
    pub files: Vec<String>,
}

/// The images of one view; all of one size.
#[derive(Clone, Debug)]
pub struct ViewEvidence {
    /// The view's name.
    pub name: String,
    /// What was to be matched.
    pub target: Image,
    /// The model's image at the end of the fit, the view's gain included.
    pub fit: Image,
    /// What share of each pixel the mesh covers (and target and mask let count), in [0, 1]; scores
    /// are taken where it is at least [`metrics::COVERED`].
    pub coverage: Vec<f32>,
    /// The model's terms by name, the gain included; they add up to `fit`.
    pub terms: Vec<(String, Image)>,
    /// The haze of each pixel, premultiplied by coverage, the gain included; empty where no effect makes one.
    pub haze: Vec<f32>,
    /// Where the surface behind each pixel lies; what is not known of it is left empty.
    pub places: Places,
    /// Where an 8-bit target is clipped.
    pub clip: Option<Clip>,
    /// Whether it took no part in the fit, which is only scored on it.
    pub held_out: bool,
}

/// What [`write_run`] wrote.
#[derive(Clone, Debug)]
pub struct Report {
    /// The content of `report.json`.
    pub summary: Summary,
    /// Its text.
    pub json: String,
    /// Every file written.
    pub files: Vec<PathBuf>,
}

/// A report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// An image.
    #[error(transparent)]
    Image(#[from] ImageFileError),
    /// Another file.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The images of a view are not of one size.
    #[error(
        "view '{view}': {what} does not have the {width} x {height} pixels of the fitted image. Give the target, the coverage and every term the view's size."
    )]
    Sizes {
        /// The view.
        view: String,
        /// What differs.
        what: String,
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
    },
}

/// Write `report.json`, `report.html` and, for each view, `<view>.png` and `<view>_terms.exr` into
/// `folder`, which is made if need be; pictures that an earlier run of other views left there go, and its fitted maps,
/// unless the scene names them.
/// Characters of a view's name that a file name should not hold become `_`.
///
/// # Errors
/// When sizes differ or a file cannot be written; each file is whole or not there.
pub fn write_run(folder: &Path, run: &RunInfo, outcome: &Outcome) -> Result<Report, ReportError> {
    let since = Instant::now();
    for view in &run.views {
        view.check()?;
    }
    // What the fit gets wrong of what it was to match; on the rest it is only scored.
    let misfit = Misfit::of(run.fitted());
    let mut warnings = run.warnings.clone();
    let mut written = Vec::new();
    let (mut views, mut shown) = (Vec::new(), Vec::new());
    let options = ImageOptions { attributes: run.attributes(outcome), ..ImageOptions::default() };
    let bar = progress::bar("report", run.views.len() as u64);
    let stems = file_stems(&run.views);
    let told = run.views.par_iter().zip(&stems).map(|(view, stem)| {
        let told = view.tell(folder, stem, &options);
        bar.inc(1);
        told
    });
    // Of the views whose files could not be written the first one is told.
    for told in told.collect::<Vec<_>>() {
        let Told { files, warnings: own, summary, error } = told?;
        warnings.extend(own);
        written.extend(files);
        views.push(summary);
        shown.push(error);
    }
    bar.finish_and_clear();

    let path = folder.join("report.json");
    let mut left = file_names(&written);
    left.extend(run.maps.iter().flat_map(|maps| maps.files.iter().cloned()).chain(run.files.iter().cloned()));
    let kept = remove_stale(folder, &path, &left, &run.named)?;
    left.extend(kept);
    let scale = signed::scale(&run.views, misfit.threshold);
    let mut summary = Summary::new(run, outcome, &views, left, warnings, misfit);
    summary.seconds.report = since.elapsed().as_secs_f64();
    let json = summary.to_json().map_err(|e| OutputError::new(&path, &e))?;
    output::write(&path, json.as_bytes())?;
    written.push(path);
    let path = folder.join("report.html");
    let page =
        html::page(&title(folder), run, &summary, &shown, scale).map_err(|e| OutputError::new(&path, &e))?;
    output::write(&path, page.as_bytes())?;
    written.push(path);
    Ok(Report { summary, json, files: written })
}

/// What [`write_run`] says of a view.
struct Told {
    files: [PathBuf; 2],
    warnings: Vec<String>,
    summary: ViewSummary,
    error: Picture,
}

/// A run's name: its folder's.
fn title(folder: &Path) -> String {
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    absolute.file_name().unwrap_or(absolute.as_os_str()).to_string_lossy().into_owned()
}

fn file_names(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().filter_map(|path| Some(path.file_name()?.to_str()?.to_owned())).collect()
}

/// Remove the pictures and maps that an earlier run says in its `report.json` that it left in `folder`, and that this
/// one has not written anew. Returns those that stay as they are `named` by the scene.
fn remove_stale(
    folder: &Path,
    report: &Path,
    written: &[String],
    named: &[PathBuf],
) -> Result<Vec<String>, OutputError> {
    #[derive(serde::Deserialize)]
    struct Earlier {
        files: Vec<String>,
    }
    // Without a report, or with one that is not ours, nothing in the folder is known to be ours.
    let earlier = std::fs::read(report).ok().and_then(|bytes| serde_json::from_slice::<Earlier>(&bytes).ok());
    let named: Vec<PathBuf> = named.iter().filter_map(|path| path.canonicalize().ok()).collect();
    let (mut kept, mut folders) = (Vec::new(), BTreeSet::new());
    for name in earlier.map(|earlier| earlier.files).unwrap_or_default() {
        if !is_ours(&name) || written.contains(&name) {
            continue;
        }
        let path = folder.join(&name);
        if path.canonicalize().is_ok_and(|path| named.contains(&path)) {
            kept.push(name);
            continue;
        }
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(OutputError::new(&path, &error)),
            _ => folders.extend(name.split_once('/').map(|(own, _)| folder.join(own))),
        }
    }
    for own in folders {
        // A folder that still holds something stays.
        let _ = std::fs::remove_dir(own);
    }
    Ok(kept)
}

/// Whether a run could have left a file of that name, by its path from the run folder: one that leads elsewhere is
/// never removed.
fn is_ours(name: &str) -> bool {
    if let Some(scene) = name.strip_prefix(SCENES).and_then(|name| name.strip_prefix('/')) {
        return scene.ends_with(".toml") && !scene.contains(['/', '\\']);
    }
    let stem = match name.strip_prefix(MAPS).and_then(|name| name.strip_prefix('/')) {
        Some(map) => [".png", ".exr", ".csv"].iter().find_map(|ending| map.strip_suffix(ending)),
        None if name == MAPS_JSON => return true,
        None => name.strip_suffix("_terms.exr").or(name.strip_suffix(".png")),
    };
    stem.is_some_and(is_file_stem)
}

impl RunInfo {
    /// An unknown's name for people.
    #[must_use]
    pub fn label(&self, name: &str) -> String {
        let view = |number: usize| Some(self.views.get(number)?.name.clone());
        label(name, |number| self.scenes.get(number).cloned(), view)
    }

    /// The views that took part in the fit.
    fn fitted(&self) -> &[ViewEvidence] {
        let end = self.views.iter().position(|view| view.held_out).unwrap_or(self.views.len());
        &self.views[..end]
    }

    /// Where the numbers come from, as (name, text).
    fn provenance(&self) -> Vec<(String, String)> {
        let own = [("software", software()), ("scene", self.scene.clone())];
        own.into_iter().map(|(name, text)| (name.to_owned(), text)).chain(self.provenance.clone()).collect()
    }

    /// The same, and who made it when.
    fn origin(&self) -> Vec<(String, String)> {
        let mut origin = self.provenance();
        origin.splice(1..1, self.made.iter().cloned());
        origin
    }

    /// The provenance that image files carry: as the report's, and the fitted parameters.
    fn attributes(&self, outcome: &Outcome) -> Vec<(String, String)> {
        let values: Vec<String> = outcome
            .unknowns
            .iter()
            .map(|u| format!("{} = {}", self.label(&u.unknown.name()), u.value))
            .collect();
        let mut attributes = self.provenance();
        attributes.push(("parameters".to_owned(), values.join("; ")));
        attributes
    }
}

/// The program's name and version.
fn software() -> String {
    format!("skinfit {}", env!("CARGO_PKG_VERSION"))
}

impl ViewEvidence {
    /// Write its pictures into `folder`.
    fn tell(&self, folder: &Path, stem: &str, options: &ImageOptions) -> Result<Told, ReportError> {
        let comparison = Comparison::new(&self.target, &self.fit, &self.coverage);
        let scores = comparison.scores();
        let png = folder.join(format!("{stem}.png"));
        let sheet = pictures::side_by_side(&self.title(), &self.target, &self.fit, &comparison, scores);
        files::write_png_bytes(&png, sheet.width, sheet.height, &sheet.bytes)?;
        let exr = folder.join(format!("{stem}_terms.exr"));
        let haze = ("haze".to_owned(), self.haze.as_slice());
        let planes = if self.haze.is_empty() { &[][..] } else { std::slice::from_ref(&haze) };
        files::write_exr_layers(&exr, &self.fit, &self.terms, planes, options)?;
        Ok(Told {
            files: [png, exr],
            warnings: self.warnings(scores.is_some()),
            summary: ViewSummary::new(scores, comparison.pixels(), self.held_out),
            error: Picture::of_error(&comparison, self.fit.width),
        })
    }

    /// Its name, and whether it was held out.
    fn title(&self) -> String {
        let name = &self.name;
        if self.held_out { format!("{name} (held out)") } else { name.clone() }
    }

    fn check(&self) -> Result<(), ReportError> {
        let (width, height) = (self.fit.width, self.fit.height);
        let fits = |image: &Image| {
            let planes = [image.rgb.len(), image.alpha.len()];
            (image.width, image.height) == (width, height) && planes == [width * height; 2]
        };
        let wrong = |what: &str| {
            let (view, what) = (self.name.clone(), what.to_owned());
            Err(ReportError::Sizes { view, what, width, height })
        };
        match () {
            () if !fits(&self.fit) => wrong("the fitted image"),
            () if !fits(&self.target) => wrong("the target"),
            () if self.coverage.len() != width * height => wrong("the coverage"),
            () => match self.terms.iter().find(|(_, image)| !fits(image)) {
                Some((name, _)) => wrong(&format!("the term '{name}'")),
                None => Ok(()),
            },
        }
    }

    fn warnings(&self, compared: bool) -> Vec<String> {
        let mut warnings = Vec::new();
        if !compared {
            let name = &self.name;
            warnings.push(format!("View '{name}': no pixel is fully covered, so there are no scores."));
        }
        let apart = self.terms_apart();
        // f32 sums of a handful of terms agree to a few 1e-7 of their size.
        if apart > 1e-4 {
            let name = &self.name;
            warnings.push(format!("View '{name}': its terms differ from the whole by up to {apart:.2e}."));
        }
        warnings
    }

    /// The greatest difference of the terms' sum from the whole, relative to 1 + the terms' size.
    fn terms_apart(&self) -> f32 {
        if self.terms.is_empty() {
            return 0.0;
        }
        let apart = |i: usize, c: usize| {
            let terms = self.terms.iter().map(|(_, image)| image.rgb[i][c]);
            let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), t| (sum + t, size + t.abs()));
            (sum - self.fit.rgb[i][c]).abs() / (1.0 + size)
        };
        (0..3 * self.fit.rgb.len()).map(|k| apart(k / 3, k % 3)).fold(0.0, f32::max)
    }
}

fn is_safe(c: char) -> bool {
    c.is_alphanumeric() || c == '-' || c == '_'
}

/// Whether [`file_stems`] could have made it; in particular it leads to no other folder.
fn is_file_stem(stem: &str) -> bool {
    !stem.is_empty() && stem.chars().all(is_safe)
}

/// A file name's stem for a view: safe characters alone.
#[must_use]
pub fn file_stem(view: &str) -> String {
    // File names have room for 255 bytes, of which a letter may take four.
    let stem: String = view.chars().take(50).map(|c| if is_safe(c) { c } else { '_' }).collect();
    if stem.is_empty() { "view".to_owned() } else { stem }
}

/// A file name's stem for each view, no two the same.
fn file_stems(views: &[ViewEvidence]) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for view in views {
        let base = file_stem(&view.name);
        let numbered = (2..).map(|n| format!("{base}_{n}"));
        let taken = |stem: &String| stems.iter().any(|s| s.to_lowercase() == stem.to_lowercase());
        let stem = std::iter::once(base.clone()).chain(numbered).find(|stem| !taken(stem));
        stems.push(stem.unwrap_or(base));
    }
    stems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_safe_and_no_two_views_share_one() {
        let view = |name: &str| ViewEvidence {
            name: name.to_owned(),
            target: Image::default(),
            fit: Image::default(),
            coverage: Vec::new(),
            terms: Vec::new(),
            haze: Vec::new(),
            places: Places::default(),
            clip: None,
            held_out: false,
        };
        let views = ["front", "Front", "../up", "", "a/b", "a:b", "größe"].map(view);
        let stems = file_stems(&views);
        assert!(stems.iter().all(|stem| is_file_stem(stem)));
        assert!(!["", "..", "a/b", "a.b"].into_iter().any(is_file_stem));
        assert_eq!(stems, ["front", "Front_2", "___up", "view", "a_b", "a_b_2", "größe"]);
    }
}

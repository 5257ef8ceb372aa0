//! Fitted maps in the report: what they gained in each view, and how they look.

use super::figures::triple_of;
use super::metrics::Scores;
use super::ordered::Ordered;
use super::page::{Cell, Table, escape, section};
use super::pictures::Picture;
use super::words::number;

/// What a fit of whole maps found, beside the constants.
#[derive(Clone, Debug, Default)]
pub struct MapEvidence {
    /// Each view with the maps of the start and with the fitted ones, each with their best constants.
    pub views: Vec<MapView>,
    /// The maps.
    pub maps: Vec<FittedMap>,
    /// Whether the fit of the maps was stopped.
    pub interrupted: bool,
    /// The files of the maps, by their paths from the run folder.
    pub files: Vec<String>,
}

/// A view before and after.
#[derive(Clone, Debug)]
pub struct MapView {
    /// Its name.
    pub name: String,
    /// Whether it took no part in the fit.
    pub held_out: bool,
    /// With the maps of the start; nothing where no pixel is covered.
    pub before: Option<Scores>,
    /// With the fitted maps.
    pub after: Option<Scores>,
}

/// A map before and after.
#[derive(Clone, Debug)]
pub struct FittedMap {
    /// Its name.
    pub name: String,
    /// The largest change of one of its numbers.
    pub largest_change: f32,
    /// Where it started, where it is, and the change; of what cannot be unwrapped there are none.
    pub pictures: Option<[Picture; 3]>,
}

/// The part of `report.json` that tells of maps.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MapSummary {
    /// Whether the fit of the maps was stopped.
    pub interrupted: bool,
    /// The largest change of each map.
    pub largest_change: Ordered<f32>,
    /// Each view before and after.
    pub views: Ordered<MapViewSummary>,
}

/// A view before and after, in `report.json`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MapViewSummary {
    /// Whether it took no part in the fit.
    pub held_out: bool,
    /// With the maps of the start.
    pub before: Option<Scores>,
    /// With the fitted maps.
    pub after: Option<Scores>,
}

impl MapEvidence {
    /// What `report.json` tells of it.
    #[must_use]
    pub fn summary(&self) -> MapSummary {
        let change = |map: &FittedMap| (map.name.clone(), map.largest_change);
        let view = |view: &MapView| {
            let MapView { held_out, before, after, .. } = *view;
            (view.name.clone(), MapViewSummary { held_out, before, after })
        };
        MapSummary {
            interrupted: self.interrupted,
            largest_change: Ordered(self.maps.iter().map(change).collect()),
            views: Ordered(self.views.iter().map(view).collect()),
        }
    }
}

/// What error bars and start values mean where maps are fitted.
pub(super) const HELD: &str = "Whole maps were fitted beside these constants. Start, loss and standard errors are those \
    of the last solve, which holds the maps: they leave out what maps and constants could trade for each other.";

/// The page's section.
///
/// # Errors
/// When a picture cannot be encoded.
pub(super) fn shown(evidence: &MapEvidence) -> Result<String, String> {
    let mut html = String::new();
    if evidence.interrupted {
        html += "<p>The fit of the maps was interrupted: this is how far they came.</p>";
    }
    html += "<p class=\"quiet\">Each view with the maps of the start and with the fitted ones, each with their best \
             constants. A view that is held out counts nothing in the fit: its scores tell whether the maps hold from \
             other sides too.</p>";
    html += &table(&evidence.views);
    for map in &evidence.maps {
        html += &figure(map)?;
    }
    Ok(section("maps", "Fitted maps", &html))
}

fn table(views: &[MapView]) -> String {
    let mut table = Table::new(&[
        ("view", "its name"),
        ("part.", "whether it was fitted"),
        ("PSNR before", "dB, with the maps of the start"),
        ("PSNR after", "dB, with the fitted maps"),
        ("SSIM before", "1 for equal images"),
        ("SSIM after", "1 for equal images"),
        ("FLIP before", "0 for equal images"),
        ("FLIP after", "0 for equal images"),
    ]);
    for view in views {
        let of = |score: fn(&Scores) -> f64| [&view.before, &view.after].map(|s| s.as_ref().map(score));
        let psnr = of(|s| s.psnr).map(Cell::psnr);
        let [ssim, flip] = [of(|s| s.ssim), of(|s| s.flip)].map(|pair| pair.map(|s| Cell::score(s, 4)));
        let part = if view.held_out { "held out" } else { "fitted" };
        let cells = [Cell::text(&view.name), Cell::text(part)].into_iter().chain(psnr).chain(ssim);
        table.row("", &cells.chain(flip).collect::<Vec<_>>());
    }
    table.html("gained")
}

fn figure(map: &FittedMap) -> Result<String, String> {
    let name = escape(&map.name);
    let change = number(f64::from(map.largest_change), 3);
    let pictures = match &map.pictures {
        Some([initial, fitted, change]) => triple_of(
            &format!("map {}", map.name),
            [initial, fitted, change],
            ["initial", "fitted", "wipe in the initial one"],
            ["change", "change: brighter where it grew, mid grey where it did not"],
        )?,
        None => "<p class=\"quiet\">The mesh has no texture coordinates, so there is no picture of it.</p>"
            .to_owned(),
    };
    Ok(format!(
        "<article class=\"view\"><header><h3>{name}</h3><dl class=\"scores\"><dt>largest change</dt>\
         <dd>{change}</dd></dl></header>{pictures}</article>"
    ))
}

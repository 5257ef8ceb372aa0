//! `skinfit fit --maps`: whole maps beside the constants, and the evidence of what that gained.
//!
//! - `absent`: what stands in where the program is built without the fit of maps
//! - `fit`: the fit, for the command's arguments; `found`: what it leaves in the run folder; `pictures`: its images

#[cfg(not(feature = "burn"))]
mod absent;
#[cfg(feature = "burn")]
mod fit;
#[cfg(feature = "burn")]
mod found;
#[cfg(feature = "burn")]
mod pictures;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::Refusal;
use crate::model::params::Param;
use crate::report::maps::MapEvidence;
use crate::scene::{FitSettings, MapKind};
#[cfg(not(feature = "burn"))]
pub(super) use absent::MapsFound;
#[cfg(feature = "burn")]
pub(super) use found::MapsFound;

/// How to build the program so that it fits maps.
const BUILD: &str = "cargo build --release --features burn";

/// Which maps.
#[derive(clap::Args)]
#[command(next_help_heading = "Maps")]
pub(super) struct MapArguments {
    /// Besides the constants, fit every texel of these maps (comma-separated): color, specular, attenuator,
    /// occlusion (every vertex), environment (every texel of the cubes). The scene's [fit.maps] says how.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = ["color", "specular", "attenuator", "occlusion", "environment"], conflicts_with = "resume")]
    maps: Vec<String>,
}

/// How a fit of maps goes about it, beside what is fitted.
#[cfg_attr(not(feature = "burn"), allow(dead_code, reason = "nothing fits maps"))]
pub(super) struct MapRun<'a> {
    /// Part of the name of the adapter to take.
    pub(super) adapter: Option<&'a str>,
    /// The view that takes no part in it, by its number.
    pub(super) held_out: Option<usize>,
    /// Set when somebody presses Ctrl-C.
    pub(super) interrupt: Arc<AtomicBool>,
    /// Whether nothing is said on standard output.
    pub(super) quiet: bool,
}

/// What a fit of maps has left in the run folder.
pub(super) struct MapsLeft {
    /// The maps that a scene file can name: key in `[maps]` and path.
    pub(super) named: Vec<(&'static str, String)>,
    /// For the report.
    pub(super) evidence: MapEvidence,
    /// For the report, too: names and texts.
    pub(super) provenance: Vec<(String, String)>,
    /// What the user should know.
    pub(super) warnings: Vec<String>,
}

impl MapArguments {
    /// Whether maps are fitted.
    pub(super) fn any(&self) -> bool {
        !self.maps.is_empty()
    }

    /// The maps to be fitted.
    fn kinds(&self) -> Vec<MapKind> {
        let named = |kind: &MapKind| self.maps.iter().any(|name| name == kind.name());
        MapKind::ALL.into_iter().filter(named).collect()
    }

    /// Hold the constants that the maps leave nothing to, before anything is made that depends on what is free; what the
    /// user should know of that.
    pub(super) fn hold_constants(&self, fit: &mut FitSettings) -> Option<String> {
        let held: Vec<&str> = fit.hold_beside(&self.kinds()).into_iter().map(Param::name).collect();
        let (maps, held) = (self.maps.join(","), held.join(", "));
        let told = format!("--maps {maps}: held at the start values, though free in the scene: {held}.");
        (!held.is_empty()).then_some(told)
    }

    /// Refuse maps in a program that was built without them.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if cfg!(feature = "burn") || self.maps.is_empty() {
            return Ok(());
        }
        Err(Refusal::new(format!(
            "--maps: this program was built without the fit of maps. Build it with `{BUILD}`, or leave --maps out."
        )))
    }

    /// What to do after Ctrl-C, which left maps in `folder`, of a fit without the views `held_out`.
    pub(super) fn advice(&self, folder: &Path, held_out: &[String]) -> String {
        let (folder, maps) = (folder.display(), self.maps.join(","));
        let held_out: String = held_out.iter().map(|view| format!(" --hold-out {view}")).collect();
        format!(
            "Its scene.toml names the maps so far and begins with the constants that belong to them. Go on from there \
             with `skinfit fit {folder}/scene.toml --maps {maps}{held_out}`; what is held of the maps \
             beforehand is then held of these."
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::bounds::Bounds;
    use crate::model::params::Column;
    use crate::scene::{Loss, MapSettings};

    #[test]
    fn the_named_maps_hold_what_acts_through_them_alone() {
        let held = |maps: &[&str]| {
            let maps = maps.iter().map(|&name| name.to_owned()).collect();
            let free = [Param::EnvironmentRotation, Param::Hilite].map(Column::tied).to_vec();
            let (loss, settings) = (Loss::default(), MapSettings::default());
            let mut fit = FitSettings {
                free,
                loss,
                bounds: Bounds::default(),
                free_gains: false,
                white_balance: false,
                cameras: false,
                maps: settings,
            };
            let told = MapArguments { maps }.hold_constants(&mut fit);
            assert!(told.is_none_or(|told| told.contains("environment_rotation") && fit.free.len() == 1));
            fit.free.len()
        };
        assert_eq!([held(&[]), held(&["color"]), held(&["color", "environment"])], [2, 2, 1]);
    }
}

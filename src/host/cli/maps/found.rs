//! What a fit of maps leaves in the run folder: the maps, `maps.json`, and what the report says of them.

use std::path::Path;

use serde_json::{Value, json};

use super::MapsLeft;
use super::pictures::MapPictures;
use crate::cli::{Refusal, say};
use crate::maps::Grid;
use crate::maps::fit::MapStep;
use crate::output;
use crate::report::maps::{MapEvidence, MapView};
use crate::report::{MAPS, MAPS_JSON};
use crate::scene::{MapSettings, MapSolver};

/// What a fit of maps found.
pub(in crate::cli) struct MapsFound {
    pub(super) views: Vec<MapView>,
    pub(super) maps: Vec<MapPictures>,
    pub(super) history: Vec<MapStep>,
    pub(super) adapter: String,
    pub(super) settings: MapSettings,
    pub(super) interrupted: bool,
}

impl MapsFound {
    /// Write the maps, their changes, and `maps.json`; tell of them, unless `quiet`.
    pub(in crate::cli) fn conclude(&self, run: &Path, quiet: bool) -> Result<MapsLeft, Refusal> {
        let folder =
            std::path::absolute(run.join(MAPS)).map_err(|error| output::OutputError::new(run, &error))?;
        std::fs::create_dir_all(&folder).map_err(|error| output::OutputError::new(&folder, &error))?;
        let mut files = vec![MAPS_JSON.to_owned()];
        for map in &self.maps {
            files.extend(map.write(&folder)?.into_iter().map(|name| format!("{MAPS}/{name}")));
        }
        let mut text = serde_json::to_string_pretty(&self.json())?;
        text.push('\n');
        output::write(&run.join(MAPS_JSON), text.as_bytes())?;
        if !quiet {
            self.tell()?;
        }
        let textures = self.maps.iter().filter(|map| matches!(map.grid, Grid::Texels { .. }));
        let path = |map: &MapPictures| folder.join(map.fitted_file()).display().to_string();
        Ok(MapsLeft {
            named: textures.map(|map| (map.name, path(map))).collect(),
            evidence: MapEvidence {
                views: self.views.clone(),
                maps: self.maps.iter().map(MapPictures::evidence).collect(),
                interrupted: self.interrupted,
                files,
            },
            provenance: self.provenance(),
            warnings: self.warnings(run),
        })
    }

    /// How well each view is met, before and after.
    fn tell(&self) -> Result<(), Refusal> {
        for MapView { name, held_out, before, after } in &self.views {
            if let (Some(before), Some(after)) = (before, after) {
                let held = if *held_out { " (held out)" } else { "" };
                say(&format!("{name:>22} {:>7.2} dB -> {:.2} dB{held}", before.psnr, after.psnr))?;
            }
        }
        Ok(())
    }

    fn json(&self) -> Value {
        let maps =
            self.maps.iter().map(|map| json!({ "name": map.name, "largest_change": map.largest_change }));
        let views = self.views.iter().map(|view| {
            let MapView { name, held_out, before, after } = view;
            json!({ "name": name, "held_out": held_out, "before": before, "after": after })
        });
        let steps = self.history.iter().map(|step| {
            let MapStep { round, what, before, after, prior, seconds } = step;
            json!({ "round": round, "what": what, "before": before, "after": after, "prior": prior, "seconds": seconds })
        });
        json!({
            "adapter": self.adapter,
            "interrupted": self.interrupted,
            "maps": maps.collect::<Vec<_>>(),
            "views": views.collect::<Vec<_>>(),
            "steps": steps.collect::<Vec<_>>(),
        })
    }

    fn provenance(&self) -> Vec<(String, String)> {
        let list = |names: Vec<&str>| names.join(", ");
        let maps = list(self.maps.iter().map(|map| map.name).collect());
        let held_out: Vec<&str> =
            self.views.iter().filter(|view| view.held_out).map(|view| view.name.as_str()).collect();
        let MapSettings { rounds, steps, solver, .. } = self.settings;
        let solver =
            MapSolver::ALL.into_iter().find(|(_, known)| *known == solver).map_or("", |(name, _)| name);
        let mut facts = vec![
            ("fitted maps".to_owned(), maps),
            (
                "fit of maps".to_owned(),
                format!("{solver}, {rounds} rounds of {steps} steps, on {}", self.adapter),
            ),
        ];
        if !held_out.is_empty() {
            facts.push(("held out".to_owned(), list(held_out)));
        }
        facts
    }

    /// What a scene file has no key for does not reach what is rendered from it.
    fn warnings(&self, run: &Path) -> Vec<String> {
        let unnamed = self.maps.iter().filter(|map| !matches!(map.grid, Grid::Texels { .. }));
        let unnamed: Vec<String> =
            unnamed.map(|map| format!("{} ({MAPS}/{})", map.name, map.exact_file())).collect();
        if unnamed.is_empty() {
            return Vec::new();
        }
        vec![format!(
            "{}: a scene file has no key for what was fitted of {}: what is rendered or fitted from the scene.toml there \
             takes what is baked instead.",
            run.display(),
            unnamed.join(", ")
        )]
    }
}

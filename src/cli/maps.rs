//! `skinfit fit --maps`: whole maps beside the constants, and the evidence of what that gained.

use super::Refusal;
use crate::scene::MapKind;

/// How to build the program so that it fits maps.
const BUILD: &str = "cargo build --release --features burn";

/// Which maps, and what is held out of their fit.
#[derive(clap::Args)]
#[command(next_help_heading = "Maps")]
pub(super) struct MapArguments {
    /// Besides the constants, fit every texel of these maps (comma-separated): color, specular, attenuator,
    /// occlusion (every vertex), environment (every texel of the cubes). The scene's [fit.maps] says how.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = ["color", "specular", "attenuator", "occlusion", "environment"], conflicts_with = "resume")]
    maps: Vec<String>,
    /// Leave a view out of the fit of maps, and tell how well it is met all the same.
    #[arg(long, value_name = "VIEW", requires = "maps")]
    hold_out: Option<String>,
}

impl MapArguments {
    /// Whether maps are fitted.
    pub(super) fn any(&self) -> bool {
        !self.maps.is_empty()
    }

    /// The maps that are fitted and the view that is held out, in words; `None`: no maps.
    pub(super) fn words(&self) -> Option<String> {
        let named = |kind: &&str| self.maps.iter().any(|name| name == kind);
        let kinds: Vec<&str> = MapKind::ALL.into_iter().map(MapKind::name).filter(named).collect();
        let held_out = self.hold_out.as_ref().map(|view| format!(", view {view} held out"));
        self.any().then(|| kinds.join(" ") + held_out.as_deref().unwrap_or_default())
    }

    /// Refuse maps in a program that was built without them.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        if cfg!(feature = "burn") || (self.maps.is_empty() && self.hold_out.is_none()) {
            return Ok(());
        }
        Err(Refusal::new(format!(
            "--maps: this program was built without the fit of maps. Build it with `{BUILD}`, or leave --maps out."
        )))
    }
}

/// What stands in where the program is built without the fit of maps.
#[cfg(not(feature = "burn"))]
mod absent {
    use std::path::Path;

    use super::{MapArguments, Refusal};
    use crate::engine::view::ObservedView;
    use crate::prepare::Prepared;

    /// Nothing finds any.
    pub(in crate::cli) enum MapsFound {}

    impl MapArguments {
        /// The views as they are: [`MapArguments::check`] has refused to fit maps.
        #[allow(clippy::unused_self, clippy::unnecessary_wraps, reason = "as where maps are fitted")]
        pub(in crate::cli) fn fit(
            &self,
            _: &mut Prepared,
            observed: Vec<ObservedView>,
            _: Option<&str>,
        ) -> Result<(Vec<ObservedView>, Option<MapsFound>), Refusal> {
            Ok((observed, None))
        }
    }

    impl MapsFound {
        pub(in crate::cli) fn conclude(
            &self,
            _: &Path,
            _: bool,
        ) -> Result<Vec<(&'static str, String)>, Refusal> {
            match *self {}
        }
    }
}

#[cfg(feature = "burn")]
mod burn {
    use serde_json::{Value, json};

    use std::path::Path;

    use super::super::fit::compared;
    use super::super::graphics::tensor_words;
    use super::super::{Refusal, say};
    use super::MapArguments;
    use crate::engine::view::ObservedView;
    use crate::gpu::Choice;
    use crate::maps::fit::{MapStep, columns_beside};
    use crate::maps::pictures::{change, picture};
    use crate::maps::problem::read;
    use crate::maps::{FittedMaps, Grid, Layer, MapError, MapTask, fit_maps};
    use crate::output;
    use crate::prepare::Prepared;
    use crate::progress;
    use crate::render::files::{ImageOptions, write_exr, write_png, write_png_bytes};
    use crate::render::image::Image;
    use crate::render::shade::Shader;
    use crate::report::metrics::{Comparison, Scores};
    use crate::scene::MapKind;
    use crate::scene::view::View;
    use crate::tensor::SharedDevice;

    /// What a fit of maps found.
    pub(in crate::cli) struct MapsFound {
        gained: Vec<Gained>,
        pictures: Vec<Pictures>,
        history: Vec<MapStep>,
        adapter: String,
    }

    /// A view before and after.
    struct Gained {
        name: String,
        held_out: bool,
        before: Option<Scores>,
        after: Option<Scores>,
    }

    /// A map before and after.
    struct Pictures {
        name: &'static str,
        grid: Grid,
        initial: Image,
        fitted: Image,
        /// Whether its numbers are a colour to be shown, and not a share.
        shown: bool,
    }

    impl MapArguments {
        /// Fit the maps that are asked for: samples, cubes and free columns are then those of the fitted maps, and
        /// a view that was held out is gone.
        pub(in crate::cli) fn fit(
            &self,
            prepared: &mut Prepared,
            observed: Vec<ObservedView>,
            adapter: Option<&str>,
        ) -> Result<(Vec<ObservedView>, Option<MapsFound>), Refusal> {
            if self.maps.is_empty() {
                return Ok((observed, None));
            }
            let named = |kind: &MapKind| self.maps.iter().any(|name| name == kind.name());
            let kinds: Vec<MapKind> = MapKind::ALL.into_iter().filter(named).collect();
            let held_out = self.held_out(&prepared.scene.views, &prepared.scene.path)?;
            let choice = Choice { name: adapter.map(str::to_owned), ..Choice::default() };
            let shared = SharedDevice::open(&choice).map_err(|error| Refusal::new(tensor_words(&error)))?;
            prepared.scene.fit.free = columns_beside(&kinds, &prepared.scene.fit.free);
            let posed = prepared.scene.mesh.pose();
            let weights: Vec<f32> = prepared.scene.mesh.morphs.iter().map(|morph| morph.weight).collect();
            let task = MapTask {
                scene: &prepared.scene,
                posed: &posed,
                illumination: prepared.illumination.clone(),
                open: prepared.occlusion.as_ref().map(|occlusion| occlusion.posed(&weights)),
                observed: observed.clone(),
                held_out,
                kinds,
                start: prepared.start(),
                unknowns: prepared.unknowns(),
            };
            let bar = progress::spinner("maps");
            let found = fit_maps(&shared, task, &mut |step| {
                bar.inc(1);
                bar.set_message(format!("round {} {}: loss {:.6e}", step.round, step.what, step.after));
            });
            bar.finish_and_clear();
            let found = found.map_err(|error| {
                let what = match &error {
                    MapError::Tensor(error) => tensor_words(error),
                    error => error.to_string(),
                };
                let words = format!("{}: {what}", prepared.scene.path.display());
                match error {
                    MapError::Tensor(_) | MapError::NotFinite { .. } => Refusal::failure(words),
                    MapError::Constants(_) | MapError::Unread { .. } => Refusal::new(words),
                }
            })?;
            let gained = gained(prepared, &observed, &found, held_out);
            let pictures = found
                .layers
                .iter()
                .map(|layer| Pictures::new(layer, &posed))
                .collect::<Result<Vec<_>, _>>()?;
            let FittedMaps { illumination, mut observed, history, .. } = found;
            prepared.illumination = illumination;
            if let Some(view) = held_out {
                observed.remove(view);
                prepared.scene.views.remove(view);
                prepared.gains.remove(view);
            }
            let adapter = shared.gpu().name().to_owned();
            Ok((observed, Some(MapsFound { gained, pictures, history, adapter })))
        }

        fn held_out(&self, views: &[View], scene: &Path) -> Result<Option<usize>, Refusal> {
            let Some(name) = &self.hold_out else { return Ok(None) };
            let names: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
            let path = scene.display();
            match names.iter().position(|found| found == name) {
                None => Err(Refusal::new(format!(
                    "{path}: --hold-out: there is no view `{name}` with a target. {}.",
                    crate::scene::suggestion(name, &names)
                ))),
                Some(_) if names.len() == 1 => Err(Refusal::new(format!(
                    "{path}: --hold-out {name}: it is the only view with a target, so nothing is left to fit. Leave \
                     --hold-out out, or add a [[view]]."
                ))),
                found => Ok(found),
            }
        }
    }

    /// How well each view is met by the maps of the start and by the fitted ones, each with their best constants.
    fn gained(
        prepared: &Prepared,
        before: &[ObservedView],
        found: &FittedMaps,
        held_out: Option<usize>,
    ) -> Vec<Gained> {
        let initial = Shader::new(prepared.setup(), &prepared.illumination, &found.initial.params);
        let fitted = Shader::new(prepared.setup(), &found.illumination, &found.constants.params);
        let views = prepared.scene.views.iter().enumerate();
        views
            .map(|(i, view)| {
                let scores = |shader: &Shader, observed: &ObservedView, gain: f64| {
                    let image = shader.shade(&observed.samples, &view.camera, gain).image;
                    let (target, coverage) = compared(view, observed, &image);
                    Comparison::new(&target, &image, &coverage).scores()
                };
                Gained {
                    name: view.name.clone(),
                    held_out: held_out == Some(i),
                    before: scores(&initial, &before[i], found.initial.gains[i]),
                    after: scores(&fitted, &found.observed[i], found.constants.gains[i]),
                }
            })
            .collect()
    }

    impl Pictures {
        fn new(layer: &Layer, mesh: &crate::scene::mesh::PosedMesh) -> Result<Self, Refusal> {
            let [_, channels] = layer.start.dims();
            let of = |texels| Ok::<_, Refusal>(picture(layer.grid, &read(texels)?, channels, mesh));
            Ok(Self {
                name: layer.name,
                grid: layer.grid,
                initial: of(layer.start.clone())?,
                fitted: of(layer.value.clone())?,
                shown: channels > 1,
            })
        }

        /// `maps/<name>_initial.png` and so on; returns what the largest change is.
        fn write(&self, folder: &Path) -> Result<f32, Refusal> {
            let (change, largest) = change(&self.initial, &self.fitted);
            let options = ImageOptions::default();
            for (what, image) in [("initial", &self.initial), ("fitted", &self.fitted)] {
                write_exr(&folder.join(format!("{}_{what}.exr", self.name)), image, &options)?;
                let png = folder.join(format!("{}_{what}.png", self.name));
                if self.shown {
                    write_png(&png, image, options.tone, 0.0)?;
                } else {
                    write_share(&png, image)?;
                }
            }
            write_share(&folder.join(format!("{}_change.png", self.name)), &change)?;
            let difference = |i: usize| [0, 1, 2].map(|c| self.fitted.rgb[i][c] - self.initial.rgb[i][c]);
            let rgb = (0..self.fitted.rgb.len()).map(difference).collect();
            let exact = Image { rgb, ..self.fitted.clone() };
            write_exr(&folder.join(format!("{}_change.exr", self.name)), &exact, &options)?;
            Ok(largest)
        }
    }

    /// Numbers from 0 to 1 as they are, black to white.
    fn write_share(path: &Path, image: &Image) -> Result<(), Refusal> {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let bytes: Vec<u8> = image.rgb.iter().flat_map(|rgb| rgb.map(byte)).collect();
        Ok(write_png_bytes(path, image.width, image.height, &bytes)?)
    }

    impl MapsFound {
        /// Write the maps, their changes, and `maps.json`; tell of them, unless `quiet`. Returns the maps that a
        /// scene file can name: key in `[maps]` and path.
        pub(in crate::cli) fn conclude(
            &self,
            run: &Path,
            quiet: bool,
        ) -> Result<Vec<(&'static str, String)>, Refusal> {
            let files = self.write(run)?;
            if !quiet {
                self.tell()?;
            }
            Ok(files)
        }

        /// How well each view is met, before and after.
        fn tell(&self) -> Result<(), Refusal> {
            for Gained { name, held_out, before, after } in &self.gained {
                if let (Some(before), Some(after)) = (before, after) {
                    let held = if *held_out { " (held out)" } else { "" };
                    say(&format!("{name:>22} {:>7.2} dB -> {:.2} dB{held}", before.psnr, after.psnr))?;
                }
            }
            Ok(())
        }

        fn write(&self, run: &Path) -> Result<Vec<(&'static str, String)>, Refusal> {
            let folder = std::path::absolute(run.join("maps"))
                .map_err(|error| output::OutputError::new(run, &error))?;
            std::fs::create_dir_all(&folder).map_err(|error| output::OutputError::new(&folder, &error))?;
            let (mut files, mut maps) = (Vec::new(), Vec::new());
            for pictures in &self.pictures {
                let largest = pictures.write(&folder)?;
                maps.push(json!({ "name": pictures.name, "largest_change": largest }));
                if matches!(pictures.grid, Grid::Texels { .. }) {
                    let file = folder.join(format!("{}_fitted.exr", pictures.name));
                    files.push((pictures.name, file.display().to_string()));
                }
            }
            let steps = self.history.iter().map(|step| {
                json!({ "round": step.round, "what": step.what, "before": step.before, "after": step.after, "seconds": step.seconds })
            });
            let report = json!({
                "adapter": self.adapter,
                "maps": maps,
                "views": self.gained.iter().map(Gained::json).collect::<Vec<_>>(),
                "steps": steps.collect::<Vec<_>>(),
            });
            let mut text = serde_json::to_string_pretty(&report)?;
            text.push('\n');
            output::write(&run.join("maps.json"), text.as_bytes())?;
            Ok(files)
        }
    }

    impl Gained {
        fn json(&self) -> Value {
            let scores = |scores: &Option<Scores>| match scores {
                Some(Scores { psnr, ssim, flip }) => json!({ "psnr": psnr, "ssim": ssim, "flip": flip }),
                None => Value::Null,
            };
            json!({
                "name": self.name,
                "held_out": self.held_out,
                "before": scores(&self.before),
                "after": scores(&self.after),
            })
        }
    }
}

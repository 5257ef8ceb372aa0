//! The `[fit.maps]` table: how whole maps are fitted, and what is held of them beforehand.

use toml::Spanned;

use super::FitSettings;
use super::error::SceneError;
use super::file::{MapFitTable, MapPriorTable, Source};
use super::numbers::{number, short, whole};
use crate::model::params::Param;

/// A map that can be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MapKind {
    /// Every texel of the colour map: albedo, linear.
    Color,
    /// Every texel of the specular map.
    Specular,
    /// Every texel of the attenuator map.
    Attenuator,
    /// The open share of the hemisphere of every vertex.
    Occlusion,
    /// Every texel of the cubes that the model looks up: irradiance, specular at its lobe, hilite.
    Environment,
}

impl MapKind {
    /// Every kind, in the order in which they are fitted and documented.
    pub const ALL: [Self; 5] =
        [Self::Color, Self::Specular, Self::Attenuator, Self::Occlusion, Self::Environment];

    /// The name on the command line and in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Specular => "specular",
            Self::Attenuator => "attenuator",
            Self::Occlusion => "occlusion",
            Self::Environment => "environment",
        }
    }

    /// The effects that read it, in words.
    #[must_use]
    pub const fn effects(self) -> &'static str {
        match self {
            Self::Color => "diffuse",
            Self::Specular => "side_specular",
            Self::Attenuator => "hilite or haze",
            Self::Occlusion => "occlusion",
            Self::Environment => "diffuse, side_specular, hilite or reflection",
        }
    }
}

impl FitSettings {
    /// Hold what a fit of these maps leaves to the maps: a fitted environment has in its texels what turns and blurs it.
    ///
    /// To be done before bakes and samples are made, as what they hold depends on what is free. Returns what is not free any
    /// more, in the order of the columns.
    pub fn hold_beside(&mut self, kinds: &[MapKind]) -> Vec<Param> {
        let environment = kinds.contains(&MapKind::Environment);
        let of_light = |param| matches!(param, Param::SpecularLobe | Param::EnvironmentRotation);
        let held = |param| environment && of_light(param);
        let mut found: Vec<Param> =
            self.free.iter().map(|column| column.param).filter(|&p| held(p)).collect();
        found.dedup();
        self.free.retain(|column| !held(column.param));
        found
    }
}

/// What is held of a map beforehand. The weights stand beside the loss, which is a mean over pixels; they multiply
/// means over texels, so that neither depends on a resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPrior {
    /// The weight of the mean squared difference of neighbouring texels' changes from the start.
    pub smoothness: f64,
    /// The weight of the mean squared change from the start.
    pub closeness: f64,
    /// The least value.
    pub lower: f64,
    /// The greatest value.
    pub upper: f64,
}

/// How a layer's texels are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum MapSolver {
    /// Projected, preconditioned conjugate gradients.
    #[default]
    ConjugateGradients,
    /// burn's Adam, for comparison.
    Adam,
}

impl MapSolver {
    /// Every solver, with its name in scene files.
    pub const ALL: [(&'static str, Self); 2] = [("cg", Self::ConjugateGradients), ("adam", Self::Adam)];
}

/// The scene's `[fit.maps]` table.
#[derive(Clone, Debug, PartialEq)]
pub struct MapSettings {
    /// How often maps and constants are taken by turns.
    pub rounds: u32,
    /// Steps of the solver for each map in each round.
    pub steps: u32,
    /// Which solver.
    pub solver: MapSolver,
    /// Adam's step, in the map's own numbers.
    pub rate: f64,
    /// By the order of [`MapKind::ALL`].
    priors: [MapPrior; 5],
}

impl MapSettings {
    /// What is held of a kind of map.
    #[must_use]
    pub const fn prior(&self, kind: MapKind) -> MapPrior {
        self.priors[kind as usize]
    }

    /// Hold something else of a kind of map.
    pub const fn set_prior(&mut self, kind: MapKind, prior: MapPrior) {
        self.priors[kind as usize] = prior;
    }
}

impl Default for MapSettings {
    fn default() -> Self {
        let share = MapPrior { smoothness: 0.1, closeness: 1e-3, lower: 0.0, upper: 1.0 };
        // Radiance up to the largest number of 16 bits, as the renderer stores it.
        let light = MapPrior { upper: 65504.0, ..share };
        let priors = [share, share, share, share, light];
        Self { rounds: 4, steps: 8, solver: MapSolver::default(), rate: 0.01, priors }
    }
}

/// The table over the defaults.
pub(super) fn settings(source: &Source, table: &MapFitTable) -> Result<MapSettings, SceneError> {
    let default = MapSettings::default();
    let solver = match &table.solver {
        Some(name) => source.choose("solver", name, &MapSolver::ALL)?,
        None => default.solver,
    };
    let tables = [&table.color, &table.specular, &table.attenuator, &table.occlusion, &table.environment];
    let mut priors = default.priors;
    for (prior, table) in priors.iter_mut().zip(tables) {
        *prior = read(source, table, *prior)?;
    }
    let positive = |x: f64| x > 0.0;
    Ok(MapSettings {
        rounds: whole(source, table.rounds.as_ref(), "rounds", [1, 1000], default.rounds)?,
        steps: whole(source, table.steps.as_ref(), "steps", [1, 10_000], default.steps)?,
        solver,
        rate: number(source, table.rate.as_ref(), default.rate, "rate", "a number above 0", positive)?,
        priors,
    })
}

fn read(source: &Source, table: &MapPriorTable, default: MapPrior) -> Result<MapPrior, SceneError> {
    let at_least_0 = |value: &Option<Spanned<f64>>, default: f64, name: &str| {
        number(source, value.as_ref(), default, name, "a number of 0 or more", |x| x >= 0.0)
    };
    let lower = at_least_0(&table.lower, default.lower, "lower")?;
    let above = |x: f64| x > lower;
    if let (Some(given), None) = (&table.lower, &table.upper)
        && !above(default.upper)
    {
        let what = format!(
            "lower = {} is not below upper, which is {} by default",
            short(lower),
            short(default.upper)
        );
        return Err(source.error(given, what, "Give a lesser number, or name upper too"));
    }
    Ok(MapPrior {
        smoothness: at_least_0(&table.smoothness, default.smoothness, "smoothness")?,
        closeness: at_least_0(&table.closeness, default.closeness, "closeness")?,
        lower,
        upper: number(source, table.upper.as_ref(), default.upper, "upper", "a number above lower", above)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Loss;
    use crate::model::bounds::Bounds;
    use crate::model::params::Column;

    #[test]
    fn a_fitted_environment_holds_what_turns_and_blurs_it_and_other_maps_hold_nothing() {
        let free =
            [Param::Hilite, Param::SpecularLobe, Param::EnvironmentRotation].map(Column::tied).to_vec();
        let maps = MapSettings::default();
        let fit = FitSettings {
            free: free.clone(),
            loss: Loss::default(),
            bounds: Bounds::default(),
            free_gains: false,
            white_balance: false,
            cameras: false,
            maps,
        };
        let held = |kinds: &[MapKind]| {
            let mut fit = fit.clone();
            let told = fit.hold_beside(kinds);
            (fit.free, told)
        };
        let light = vec![Param::SpecularLobe, Param::EnvironmentRotation];
        assert_eq!(held(&[MapKind::Color, MapKind::Environment]), (vec![Column::tied(Param::Hilite)], light));
        assert_eq!(held(&[MapKind::Color, MapKind::Occlusion]), (free, Vec::new()));
    }
}

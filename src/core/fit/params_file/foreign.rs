//! Constants that are used with other effects than those that they were fitted with.

use std::path::Path;

use crate::model::effects::{Effect, Effects};
use crate::model::params::{Param, Params};
use crate::scene::short;

/// What moves the mesh and shades nothing: no constant is fitted for it.
const POSES: [Effect; 2] = [Effect::Morph, Effect::Skin];

/// Where constants come from, and what they are used with.
#[derive(Clone, Copy, Debug)]
pub struct Foreign<'a> {
    /// Their file.
    pub file: &'a Path,
    /// The effects that they were fitted with, where the file says.
    pub fitted: Option<Effects>,
    /// The scene that they are used with.
    pub scene: &'a Path,
    /// Its effects, or those that stand in their place.
    pub effects: Effects,
    /// The values that are used.
    pub params: &'a Params,
    /// Parameters whose values somebody chose: they are meant.
    pub chosen: &'a [Param],
}

impl Foreign<'_> {
    /// What should be said where effects are used that the constants were not fitted with: which values nothing has
    /// fitted, and that they are `used` (drawn, exported); then `remedy`. With `fewer`, what was fitted and is not used
    /// is told, too.
    #[must_use]
    pub fn words(&self, used: &str, remedy: &str, fewer: bool) -> Option<String> {
        let bare = |effects: Effects| POSES.into_iter().fold(effects, Effects::without);
        let (fitted, effects) = (bare(self.fitted?), bare(self.effects));
        let more = effects.iter().any(|effect| !fitted.has(effect));
        let less = fitted.iter().any(|effect| !effects.has(effect));
        if !more && (!less || !fewer) {
            return None;
        }
        let names = |effects: Effects| effects.iter().map(Effect::name).collect::<Vec<_>>().join(", ");
        let unfitted: Vec<String> = Param::all()
            .filter(|param| param.asked_for(effects) && !param.asked_for(fitted))
            .filter(|param| !self.chosen.contains(param))
            .map(|param| format!("{} = {}", param.name(), value(self.params.rgb(param))))
            .collect();
        let values = if unfitted.is_empty() {
            "with constants that were not tuned for it".to_owned()
        } else {
            format!("with {}, which was not fitted", unfitted.join(", "))
        };
        Some(format!(
            "{}: was fitted with the effects {}, but {} has {}. What is {used} is the latter's, {values}. {remedy}",
            self.file.display(),
            names(fitted),
            self.scene.display(),
            names(effects),
        ))
    }
}

fn value(rgb: [f64; 3]) -> String {
    if rgb == [rgb[0]; 3] { short(rgb[0]) } else { format!("{rgb:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Form;

    #[test]
    fn what_was_not_fitted_is_named_with_its_value() {
        let without_rim = Effects::SURFACE.without(Effect::Rim);
        let mut params = Params::defaults(Form::Corrected);
        params.set_rgb(Param::KeyColor, [1.0, 0.5, 0.25]);
        let foreign = Foreign {
            file: Path::new("params.toml"),
            fitted: Some(without_rim),
            scene: Path::new("scene.toml"),
            effects: Effects::SURFACE,
            params: &params,
            chosen: &[],
        };
        let words = |foreign: Foreign<'_>, fewer| foreign.words("drawn", "Do this.", fewer);
        let told = words(foreign, false).unwrap();
        // rim_exponent was fitted, for the hilite.
        assert!(told.contains(
            "What is drawn is the latter's, with rim_weight = 0.5, which was not fitted. Do this."
        ));
        let key = Foreign { effects: Effects::SURFACE.with(Effect::KeyLight), ..foreign };
        let told = words(key, false).unwrap();
        for value in ["key_azimuth = 0,", "key_elevation = 45,", "key_color = [1.0, 0.5, 0.25]"] {
            assert!(told.contains(value), "{told}");
        }
        // What was chosen is meant.
        let chosen = Foreign { chosen: &[Param::RimWeight], ..foreign };
        assert!(words(chosen, false).unwrap().contains("not tuned for it"));
        // Fewer effects are worth a word where nobody asked for them.
        let fewer = Foreign { fitted: Some(Effects::SURFACE), effects: without_rim, ..foreign };
        assert_eq!((words(fewer, false), words(fewer, true).is_some()), (None, true));
        // A pose is no shading, and who does not know does not say.
        let posed = Foreign {
            fitted: Some(Effects::SURFACE),
            effects: Effects::SURFACE.with(Effect::Skin),
            ..foreign
        };
        assert_eq!((words(posed, true), words(Foreign { fitted: None, ..foreign }, true)), (None, None));
    }
}

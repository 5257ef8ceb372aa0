//! The scene's `[transmission]` table: how light that comes through the skin is found.

use super::error::{SceneError, Warnings, warn};
use super::file::{Source, TransmissionTable};
use super::shadow_maps::ShadowMaps;
use crate::model::effects::{Effect, Effects};
use crate::model::params::{Param, Params};
use crate::model::shadow_filter::ShadowFilter;
use crate::model::transmission::{Method, TransmissionChoices};
use crate::shader::term::library;

/// The table's choices; of a key that is not there the default.
pub(super) fn read(source: &Source, table: &TransmissionTable) -> Result<TransmissionChoices, SceneError> {
    let default = TransmissionChoices::default();
    let known = Method::ALL.map(|method| (method.name(), method));
    let method =
        table.method.as_ref().map_or(Ok(default.method), |name| source.choose("method", name, &known));
    Ok(TransmissionChoices { method: method? })
}

/// Set what the scene gives of the parameters: how many millimetres its unit has.
pub(super) fn set(params: &mut Params, metres_per_unit: f64) {
    if let Some(unit) = Param::from_name("transmission_unit") {
        params.set(unit, 1e3 * metres_per_unit);
    }
}

/// Say so where the effect shows nothing, or a choice is without what it goes by.
pub(super) fn idle(
    source: &Source,
    effects: Effects,
    (choices, maps): (TransmissionChoices, &ShadowMaps),
    warnings: &mut Warnings,
) {
    if !library::transmits(effects) {
        return;
    }
    if !effects.has_any(&[Effect::Diffuse, Effect::Lights]) {
        let message = "the effect `transmission` does nothing without `diffuse`, which brings the environment's light, or \
                       `lights`";
        warn(warnings, &source.path, message);
    }
    let mapped =
        effects.has(Effect::Lights) && effects.has(Effect::Shadows) && maps.filter != ShadowFilter::Vertices;
    if choices.method == Method::ShadowMaps && !mapped {
        let message = "method = \"shadow_maps\" in [transmission] goes by shadow maps, of which there are none without the \
                       effects `lights` and `shadows` and a shadow_filter other than \"vertices\" in [quality]: rays from \
                       the vertices take their place";
        warn(warnings, &source.path, message);
    }
}

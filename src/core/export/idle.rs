//! What a shader need not compute with the constants that it is exported with.

use crate::model::effects::{Effect, Effects};
use crate::model::params::{Param, Params};
use crate::shader::term::terms;

/// Those of `effects` whose terms have a weight of 0 in every channel: without them the image is the same. The haze
/// stays: an alpha of 0 is not one of 1.
pub(super) fn idle(effects: Effects, params: &Params) -> Effects {
    let zero = |param: Param| params.rgb(param) == [0.0; 3];
    let weights: Vec<_> = terms().into_iter().flat_map(|term| term.weighed.iter().copied()).collect();
    let rim = !effects.has(Effect::Rim) || zero(Param::RimWeight);
    let weightless = |effect: Effect| match effect {
        Effect::Diffuse => zero(Param::BaseWeight) && rim,
        Effect::Rim => rim,
        Effect::Occlusion => zero(Param::Occlusion),
        Effect::SideSpecular => zero(Param::SideSpecular),
        Effect::Hilite => zero(Param::Hilite),
        Effect::Reflection => zero(Param::Reflection),
        Effect::KeyLight => zero(Param::KeyColor),
        // What its file says of it.
        added => weights.iter().any(|&(effect, weight)| effect == added && zero(weight)),
    };
    let idle: Effects = effects.iter().filter(|&effect| weightless(effect)).collect();
    // A shader of nothing at all reads nothing, which no language has a struct for.
    let light = [Effect::Diffuse, Effect::SideSpecular, Effect::Hilite, Effect::Reflection, Effect::KeyLight];
    let left = light.into_iter().any(|effect| effects.has(effect) && !idle.has(effect));
    if left { idle } else { Effects::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Form;

    #[test]
    fn an_effect_is_idle_where_all_that_weighs_it_is_nothing() {
        let mut params = Params::defaults(Form::Corrected);
        assert_eq!(idle(Effects::SURFACE, &params), Effects::default());
        params.set_rgb(Param::Hilite, [0.0, 0.0, 0.1]);
        params.set(Param::Reflection, 0.0);
        params.set(Param::BaseWeight, 0.0);
        // The rim still shows what is diffuse.
        assert_eq!(idle(Effects::SURFACE, &params), Effects::of(&[Effect::Reflection]));
        params.set(Param::RimWeight, 0.0);
        let diffuse = Effects::of(&[Effect::Reflection, Effect::Diffuse, Effect::Rim]);
        assert_eq!(idle(Effects::SURFACE, &params), diffuse);
        assert_eq!(idle(Effects::of(&[Effect::Diffuse, Effect::Haze]), &params), Effects::default());
    }

    #[test]
    fn an_effect_of_a_file_is_idle_where_the_parameter_that_weighs_it_is_nothing() {
        let text = "// effect: idle_sheen, light of fine hair\n\
            // parameter: idle_sheen_weight = 0.5 in [0, 1], rgb, linear, weighs idle_sheen; how much\n//\n\
            // gives: idle_sheen_part\n// adds: idle_sheen\n// cost: 1\n\
            fn idle_sheen(idle_sheen_weight: vec3f) -> vec3f {\n    return idle_sheen_weight;\n}\n";
        let term = crate::shader::term::register("idle_sheen", text).unwrap();
        let effects = Effects::SURFACE.with(term.effect);
        let mut params = Params::defaults(Form::Corrected);
        assert_eq!(idle(effects, &params), Effects::default());
        params.set_rgb(term.params[0], [0.0, 0.0, 0.1]);
        assert_eq!(idle(effects, &params), Effects::default());
        params.set(term.params[0], 0.0);
        assert_eq!(idle(effects, &params), Effects::of(&[term.effect]));
        let other = text.replace("idle_sheen", "idle_other").replace("weighs idle_other", "weighs rim");
        assert!(
            crate::shader::term::register("idle_other", &other).is_err(),
            "the rim is no effect of the file"
        );
    }
}

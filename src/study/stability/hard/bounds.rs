//! Parameters at their bounds, and occlusion at its.

use super::{FACING, HardCase, Holds, ORDINARY, case, only, with};
use crate::model::effects::{Effect, Silhouette};
use crate::model::params::Param;
use crate::stability::case::FragmentInputs;

pub(super) fn bounds() -> Vec<HardCase> {
    let closed = FragmentInputs { occlusion: 0.0, silhouette: 0.75, ..ORDINARY };
    let mut all = vec![
        case(
            "nothing open",
            "o = 0 at full occlusion: diffuse light, rim and hilite are 0 to the bit",
            only(&[Effect::Diffuse, Effect::NormalMap, Effect::Rim, Effect::Occlusion, Effect::Hilite]),
            vec![closed],
            &[Holds::Zero],
        ),
        case(
            "nothing open under a key light",
            "the key light goes by its own formula",
            only(&[Effect::Diffuse, Effect::NormalMap, Effect::Occlusion, Effect::Hilite, Effect::KeyLight]),
            vec![closed, FragmentInputs { occlusion: -0.0, ..closed }],
            &[],
        ),
    ];
    for param in Param::built_in() {
        let info = param.info();
        let bounds = [(info.lower, -1e3), (info.upper, 1e3)];
        for value in bounds.map(|(bound, far)| if bound.is_finite() { bound } else { far }) {
            for silhouette in [Silhouette::Fragment, Silhouette::Bumped] {
                all.push(case(
                    "parameter at a bound",
                    "each parameter at either bound (or far out, where there is none)",
                    with(|s| {
                        s.params.set(param, value);
                        s.setup.silhouette = silhouette;
                    }),
                    vec![ORDINARY, FACING, closed, FragmentInputs { silhouette: 0.0, ..ORDINARY }],
                    &[],
                ));
            }
        }
    }
    all
}

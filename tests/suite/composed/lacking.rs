//! What the oracle's sums have that the rules do otherwise: E_r and the split sum are tables of its own, coarser than what
//! the rules fit. It is put together here of the rules' directions, roughness and shares, and of single rules, with those
//! tables; how it moves, by differences.

use skinfit::model::params::{Param, Params};

use super::file::{Composed, OTHER, param};
use super::rules::{LookedUp, Rules, Shaded};

/// What the rules lack of each fragment, and how that moves with each column.
pub(super) struct Lacking {
    pub(super) value: Vec<[f64; 3]>,
    pub(super) slopes: Vec<Vec<[f64; 3]>>,
}

/// Angles are in degrees, lengths in millimetres.
const STEP: f64 = 1e-4;

impl Lacking {
    fn new(own: &Composed<'_>, columns: &[Param], of: impl Fn(&Params) -> Vec<[f64; 3]>) -> Self {
        let slope = |&column: &Param| {
            let moved = |by: f64| {
                let mut params = own.params.clone();
                params.set_rgb(column, own.params.rgb(column).map(|x| x + by));
                of(&params)
            };
            let (above, below) = (moved(STEP), moved(-STEP));
            let difference = |(above, below): (&[f64; 3], &[f64; 3])| {
                [0, 1, 2].map(|c| (above[c] - below[c]) / (2.0 * STEP))
            };
            above.iter().zip(&below).map(difference).collect()
        };
        Self { value: of(&own.params), slopes: columns.iter().map(slope).collect() }
    }

    /// The environment in the specular lobe, which the rules are asked to leave out.
    pub(super) fn lobe(own: &Composed<'_>, columns: &[Param]) -> Self {
        let rules = Rules::new(own, own.setup(super::file::PLAIN, &["fresnel"]), &[]);
        Self::new(own, columns, |params| {
            let found = rules.look_up::<f64>(own, params);
            let shown = |i| in_lobe(own, &rules.shade(own, params, [1.0; 3], (i, &found), 0.0), params);
            (0..own.count()).map(shown).collect()
        })
    }

    /// That, the skin in the lobe, and what of the diffuse light does not enter.
    pub(super) fn choices(own: &Composed<'_>, columns: &[Param]) -> Self {
        let by_hand = Choices::new(own);
        Self::new(own, columns, |params| {
            by_hand.each(own, params).into_iter().map(|terms| terms.lacking()).collect()
        })
    }
}

/// What the environment's lobe shows, of what the rules found on the way and the oracle's tables.
pub(super) fn in_lobe(own: &Composed<'_>, at: &Shaded, params: &Params) -> [f64; 3] {
    let along = at.three("lobe_direction");
    let light = own.lobe(along, at.of("lobe_roughness")[0]);
    let weight = params.rgb(param("specular_weight"));
    let share = at.of("lobe_weight")[0] * at.of("lobe_open")[0] * table_share(own, at);
    [0, 1, 2].map(|c| weight[c] * share * light[c])
}

/// f0 a + b of the oracle's table.
fn table_share(own: &Composed<'_>, at: &Shaded) -> f64 {
    let one = |name: &str| at.of(name)[0];
    let [a, b] = own.split_sum(one("view_cosine"), one("lobe_roughness"));
    one("lobe_f0") * a + b
}

/// The terms of the file's other choices that its split sum is in.
pub(super) struct Choices {
    rules: Rules,
}

/// Those of a fragment.
pub(super) struct ByHand {
    pub(super) diffuse: [f64; 3],
    pub(super) fresnel: [f64; 3],
    pub(super) skin_reflection: [f64; 3],
    /// The diffuse light where all of it enters.
    whole: [f64; 3],
}

impl ByHand {
    fn lacking(&self) -> [f64; 3] {
        let Self { diffuse, fresnel, skin_reflection, whole } = self;
        [0, 1, 2].map(|c| diffuse[c] - whole[c] + fresnel[c] + skin_reflection[c])
    }
}

impl Choices {
    pub(super) fn new(own: &Composed<'_>) -> Self {
        Self { rules: Rules::new(own, own.setup(OTHER, &["fresnel", "diffusion"]), &[]) }
    }

    pub(super) fn each(&self, own: &Composed<'_>, params: &Params) -> Vec<ByHand> {
        let found = self.rules.look_up::<f64>(own, params);
        (0..own.count()).map(|i| self.one(own, params, (i, &found))).collect()
    }

    fn one(&self, own: &Composed<'_>, params: &Params, (i, found): (usize, &LookedUp)) -> ByHand {
        let at = self.rules.shade(own, params, [1.0; 3], (i, found), 0.0);
        let rgb = |name: &str| params.rgb(param(name));
        let rule = |name: &str, arguments: &[&[f64]]| self.rules.rule(name, arguments);
        let share = [table_share(own, &at)];
        let (weight, open, diffused) = (at.of("lobe_weight"), at.of("lobe_open"), at.of("diffused"));
        let reflected = rule("share_reflected", &[&rgb("specular_weight"), weight, &share]);
        let seen = |loss: f64| {
            let entering = rule("share_entering", &[&reflected, &[loss]]);
            let base = rule("base_light_scattered", &[diffused, &entering, &rgb("base_weight")]);
            let rim = rule("rim_light_scattered", &[diffused, &entering, at.of("rim"), &rgb("rim_weight")]);
            [0, 1, 2].map(|c| base[c] + rim[c])
        };
        let widest = found.three(i, "diffusion_level_3");
        let skin = [&[0.0; 3][..], &widest, at.of("color_after"), weight, open, &share];
        let skin = rule("lobe_with_scattered_skin", &skin);
        ByHand {
            diffuse: seen(params.scalar(param("fresnel_loss"))),
            fresnel: in_lobe(own, &at, params),
            skin_reflection: rule("environment_in_lobe", &[&skin, &rgb("specular_weight")]),
            whole: seen(0.0),
        }
    }
}

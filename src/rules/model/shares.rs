//! Parameters that are shares of one whole: in each channel they add up to no more than 1.

use super::effects::Effects;
use super::params::{Param, Params};

/// By how much a sum may exceed 1: what decimal digits of shares that add up to 1 leave.
const ROUNDING: f64 = 1e-9;

/// The parameters of each whole, and its name, in the order of the table; of effects that are not enabled none counts,
/// where it is said which are.
#[must_use]
pub fn wholes(effects: Option<Effects>) -> Vec<(&'static str, Vec<Param>)> {
    let mut wholes: Vec<(&'static str, Vec<Param>)> = Vec::new();
    for param in Param::all().filter(|param| effects.is_none_or(|effects| param.asked_for(effects))) {
        let Some(whole) = param.info().share else { continue };
        match wholes.iter_mut().find(|(name, _)| *name == whole) {
            Some((_, params)) => params.push(param),
            None => wholes.push((whole, vec![param])),
        }
    }
    wholes
}

/// What is wrong with shares that add up to more than 1, in words, each whole and channel a sentence without its end.
#[must_use]
pub fn overfull(params: &Params, effects: Effects) -> Vec<String> {
    let mut told = Vec::new();
    for (whole, shares) in wholes(Some(effects)) {
        let names: Vec<&str> = shares.iter().map(|share| share.name()).collect();
        let total = totals(params, &shares);
        let channels = match total {
            [red, green, blue] if red == green && green == blue => vec![(red, "")],
            [red, green, blue] => vec![(red, " in red"), (green, " in green"), (blue, " in blue")],
        };
        for (total, channel) in channels.into_iter().filter(|(total, _)| *total > 1.0 + ROUNDING) {
            told.push(format!(
                "{} add up to {total:.4}{channel}, more than the whole of {whole}: lower them to 1 or less together",
                names.join(", ")
            ));
        }
    }
    told
}

/// Lower shares that add up to more than 1, those of a whole's channel alike.
pub fn share_out(params: &mut Params, effects: Effects) {
    for (_, shares) in wholes(Some(effects)) {
        let total = totals(params, &shares);
        for share in shares {
            let rgb = params.rgb(share);
            params.set_rgb(share, [0, 1, 2].map(|c| rgb[c] / total[c].max(1.0)));
        }
    }
}

/// What shares add up to in each channel.
fn totals(params: &Params, shares: &[Param]) -> [f64; 3] {
    [0, 1, 2].map(|c| shares.iter().map(|share| params.rgb(*share)[c]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::{Effect, Form};
    use crate::shader::term::library;

    #[test]
    fn shares_of_enabled_effects_count_and_sums_above_one_are_told() {
        library::register_all();
        let [diffusion, five] = ["diffusion", "diffusion_five"].map(|name| Effect::from_name(name).unwrap());
        let three = Effects::of(&[]).with(diffusion);
        let counted =
            |effects: Effects| wholes(Some(effects)).iter().map(|(_, shares)| shares.len()).sum::<usize>();
        assert_eq!([counted(Effects::of(&[])), counted(three), counted(three.with(five))], [0, 3, 5]);
        let [first, last] =
            ["diffusion_weight_1", "diffusion_weight_5"].map(|name| Param::from_name(name).unwrap());
        let mut params = Params::defaults(Form::Corrected);
        assert!(overfull(&params, three).is_empty());
        params.set_rgb(last, [0.0, 0.9, 0.0]);
        assert!(overfull(&params, three).is_empty(), "of an effect that is off");
        let told = overfull(&params, three.with(five));
        assert!(told.len() == 1 && told[0].contains("add up to 1.1100 in green"), "{told:?}");
        // 0.23 is the default's red, which leaves 0.77 beside 0.36 and 0.08.
        params.set_rgb(first, [0.56, 0.0, 1.0]);
        assert!(overfull(&params, three).is_empty(), "as many digits as add up to 1");
        params.set_rgb(first, [0.57, 0.0, 1.0]);
        assert!(overfull(&params, three)[0].contains("1.0100 in red"));
        share_out(&mut params, three);
        assert!(overfull(&params, three).is_empty());
        assert_eq!(params.rgb(last), [0.0, 0.9, 0.0], "of an effect that is off");
        for number in 1..4 {
            let share = Param::from_name(&format!("diffusion_weight_{number}")).unwrap();
            params.set_rgb(share, [0.5; 3]);
        }
        let told = overfull(&params, three);
        assert!(told.len() == 1 && told[0].contains("add up to 1.5000, more than"), "{told:?}");
    }
}

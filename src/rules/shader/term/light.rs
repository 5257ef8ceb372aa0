//! The term that a light is: a family's files, `rules/family`, of which each light is a member.

use super::{Origin, Term, TermError, library, register_from, stamped};
use crate::model::registry::leaked;

/// Light from one direction: [`IN_WORLD`] where it stays, or [`IN_SKY`] where it turns with the environment.
const BEAM: &str = include_str!("../rules/family/beam.wgsl");
const IN_WORLD: &str = include_str!("../rules/family/in_world.wgsl");
const IN_SKY: &str = include_str!("../rules/family/in_sky.wgsl");
/// Light from one place.
const LAMP: &str = include_str!("../rules/family/lamp.wgsl");
/// What any light shows.
const LIT: &str = include_str!("../rules/family/lit.wgsl");
/// What it is of, but for light that the skin throws back; of the panorama's lights that is in the sky's.
const UNBOUNCED: &str = include_str!("../rules/family/unbounced.wgsl");
/// The same with it: a declaration, and rules.
const BOUNCED: &str = include_str!("../rules/family/bounced.wgsl");
/// What shadow maps leave of it.
const SHADOW: &str = include_str!("../rules/family/shadow.wgsl");

/// Where a light's light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightFamily {
    /// From one direction of the world.
    Beam,
    /// From one direction of the panorama, with which it turns.
    SkyBeam,
    /// From one place.
    Lamp,
}

/// The term of a light, known to this process from then on; `member` is the light's name as parameters have it
/// (`light.NAME`). Lights of one name and family are one term: their numbers are parameters.
///
/// # Errors
/// When a file of rules, or a light of another family, has taken its names.
pub fn light(family: LightFamily, member: &str) -> Result<&'static Term, TermError> {
    library::register_all();
    let text = match family {
        LightFamily::SkyBeam => [BEAM, IN_SKY, UNBOUNCED, LIT, SHADOW].concat(),
        LightFamily::Beam => [&bounced(BEAM), IN_WORLD, LIT, SHADOW].concat(),
        LightFamily::Lamp => [&bounced(LAMP), LIT, SHADOW].concat(),
    };
    let stamped = stamped(&text, member).unwrap_or(text);
    register_from(Origin::Library, leaked(member), &stamped)
}

/// A light's rules with those of what the skin throws back of it: declarations stand before all rules.
fn bounced(rules: &str) -> String {
    let (declared, rules) = rules.split_once("\n\n").unwrap_or((rules, ""));
    [declared, "\n", BOUNCED, "\n", rules].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A test's build checks the functions of the library's own terms, too: that they are valid and have derivatives.
    #[test]
    fn lights_of_each_family_are_valid_and_another_family_cannot_take_their_names() {
        for (family, name) in [
            (LightFamily::Beam, "a_beam"),
            (LightFamily::SkyBeam, "a_sky_beam"),
            (LightFamily::Lamp, "a_lamp"),
        ] {
            let term = light(family, name).unwrap();
            assert!(std::ptr::eq(term, light(family, name).unwrap()));
        }
        assert!(light(LightFamily::Lamp, "a_beam").is_err());
    }
}

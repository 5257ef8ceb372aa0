//! Terms that come with the library: effects beyond the paper's, each declared by a file as a user's term is.
//!
//! They may give in another way what the built-in rules give, and read fields that the library finds at samples.

use std::sync::OnceLock;

use super::{Origin, Term, register_from};
use crate::model::effects::{Effect, Effects};

/// Files, by name, in the order of documentation.
const FILES: [(&str, &str); 4] = [
    ("sky", include_str!("../rules/term/sky.wgsl")),
    ("diffusion", include_str!("../rules/term/diffusion.wgsl")),
    ("specular", include_str!("../rules/term/specular.wgsl")),
    ("transmission", include_str!("../rules/term/transmission.wgsl")),
];

static TERMS: OnceLock<Vec<&'static Term>> = OnceLock::new();

/// The library's terms, made known to this process.
///
/// # Panics
/// When one of its own files does not fit its own rules, which every use would show.
pub fn terms() -> &'static [&'static Term] {
    TERMS.get_or_init(|| {
        let register = |(name, text): (&str, &str)| {
            let term = register_from(Origin::Library, name, text);
            term.unwrap_or_else(|error| panic!("rules/term/{name}.wgsl, line {}: {error}", error.line))
        };
        FILES.into_iter().map(register).collect()
    })
}

/// Make the library's terms known to this process.
pub fn register_all() {
    let _ = terms();
}

/// Whether an effect is of one of them.
#[must_use]
pub fn is_own(effect: Effect) -> bool {
    terms().iter().any(|term| term.effects.contains(&effect))
}

/// Whether one of a set knows what a point sees of the sky.
pub fn sees_sky(effects: Effects) -> bool {
    static EFFECT: OnceLock<Option<Effect>> = OnceLock::new();
    has(effects, &EFFECT, "directional_occlusion")
}

/// Whether the environment shows in the specular lobe by one of a set.
pub fn reflects(effects: Effects) -> bool {
    static EFFECT: OnceLock<Option<Effect>> = OnceLock::new();
    has(effects, &EFFECT, "fresnel")
}

/// Whether light scatters within the skin by one of a set.
pub fn scatters(effects: Effects) -> bool {
    static EFFECT: OnceLock<Option<Effect>> = OnceLock::new();
    has(effects, &EFFECT, "diffusion")
}

/// Whether light comes through the skin by one of a set.
pub fn transmits(effects: Effects) -> bool {
    static EFFECT: OnceLock<Option<Effect>> = OnceLock::new();
    has(effects, &EFFECT, "transmission")
}

/// Whether the effect of a name is in a set; before it is known, it is not.
fn has(effects: Effects, known: &OnceLock<Option<Effect>>, name: &str) -> bool {
    // Conditions of rules are asked thousands of times: names are looked up once.
    TERMS.get().is_some()
        && known.get_or_init(|| Effect::from_name(name)).is_some_and(|effect| effects.has(effect))
}

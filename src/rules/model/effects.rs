//! What can be switched on, and what each effect asks for: nothing else is loaded or baked.

use std::fmt;

use super::evaluate::Setup;
use super::fields::Fields;
use super::needs::Needs;
pub use super::readings::{Form, Lookups, Silhouette};
use super::registry::{Added, RegistryError};

/// One switchable part of the model: the place of its row among the built-in ones, which stand first, and those that
/// [`register`](Effect::register) has added.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Effect(u16);

/// The built-in effects.
#[allow(non_upper_case_globals, reason = "they are the values that an effect may have, as variants would be")]
impl Effect {
    /// Albedo times irradiance.
    pub const Diffuse: Self = Self(0);
    /// Tangent-space normal map; without it n is the smooth normal.
    pub const NormalMap: Self = Self(1);
    /// Ambient occlusion; without it everything is open.
    pub const Occlusion: Self = Self(2);
    /// The diffuse rim weight; without it only `base_weight` is left of the diffuse factor.
    pub const Rim: Self = Self(3);
    /// Specular map times the specular cube along the normal.
    pub const SideSpecular: Self = Self(4);
    /// Back light seen through the rim: the hilite cube along the view vector.
    pub const Hilite: Self = Self(5);
    /// The specular cube along the reflection vector, dappled.
    pub const Reflection: Self = Self(6);
    /// The reflection's alpha to the output alpha.
    pub const Haze: Self = Self(7);
    /// A blur pass over alpha-weighted colour, driven by the haze.
    pub const Bloom: Self = Self(8);
    /// The paper's second version: one key light gives the bump map's contribution.
    pub const KeyLight: Self = Self(9);
    /// Morph targets.
    pub const Morph: Self = Self(10);
    /// Skinning by bones.
    pub const Skin: Self = Self(11);
    /// Lights beside the environment.
    pub const Lights: Self = Self(12);
    /// What stands in the lights' way.
    pub const Shadows: Self = Self(13);
}

/// What a scene must have for an effect to show anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prerequisite {
    /// A normal map.
    NormalMap,
    /// Light of an environment.
    Environment,
    /// Lights beside it, or a panorama that they can be taken out of.
    Lights,
    /// A UV atlas that light can stand in.
    Atlas,
    /// Nothing: but what it shows is for the user to say, and nothing tries it by itself.
    Hand,
}

impl Prerequisite {
    /// Every one, by the name that files of rules write.
    pub const NAMED: [(&'static str, Self); 5] = [
        ("normal_map", Self::NormalMap),
        ("environment", Self::Environment),
        ("lights", Self::Lights),
        ("atlas", Self::Atlas),
        ("hand", Self::Hand),
    ];
}

/// One row of the table of effects.
#[derive(Clone, Copy, Debug)]
pub struct EffectInfo {
    /// The name in scene files and on the command line.
    pub name: &'static str,
    /// What it shows, in one line.
    pub meaning: &'static str,
    /// What it asks of the stages before the model beside what the built-in effects do, when it is one of a set;
    /// `None` of a built-in one, whose needs [`Setup::needs`] knows.
    pub needs: Option<fn(Effect, &Setup) -> Needs>,
    /// The effect that switches it on and off with others of its kind.
    pub within: Option<Effect>,
    /// The effect without which it does nothing.
    pub upon: Option<Effect>,
    /// What a scene must have for it.
    pub asks: Option<Prerequisite>,
    /// Whether it shares light out before it is diffuse.
    pub shares_light: bool,
    /// Whether the environment reaches it by what is baked of it, or along directions of its own.
    pub bakes_environment: bool,
}

impl EffectInfo {
    /// A row that says no more of itself.
    #[must_use]
    pub const fn new(name: &'static str, meaning: &'static str) -> Self {
        Self {
            name,
            meaning,
            needs: None,
            within: None,
            upon: None,
            asks: None,
            shares_light: false,
            bakes_environment: false,
        }
    }

    const fn asks(self, asked: Prerequisite) -> Self {
        Self { asks: Some(asked), ..self }
    }

    const fn upon(self, effect: Effect) -> Self {
        Self { upon: Some(effect), ..self }
    }
}

const TABLE: [EffectInfo; Effect::BUILT_IN.len()] = [
    EffectInfo::new("diffuse", "Albedo times irradiance").asks(Prerequisite::Environment),
    EffectInfo::new("normal_map", "Tangent-space normal map; without it n is the smooth normal")
        .asks(Prerequisite::NormalMap),
    EffectInfo::new("occlusion", "Ambient occlusion; without it everything is open"),
    EffectInfo::new(
        "rim",
        "The diffuse rim weight; without it only `base_weight` is left of the diffuse factor",
    ),
    EffectInfo::new("side_specular", "Specular map times the specular cube along the normal")
        .asks(Prerequisite::Environment),
    EffectInfo::new("hilite", "Back light seen through the rim: the hilite cube along the view vector")
        .asks(Prerequisite::Environment),
    EffectInfo::new("reflection", "The specular cube along the reflection vector, dappled")
        .asks(Prerequisite::Environment),
    EffectInfo::new("haze", "The reflection's alpha to the output alpha"),
    EffectInfo::new("bloom", "A blur pass over alpha-weighted colour, driven by the haze"),
    EffectInfo::new(
        "key_light",
        "The paper's second version: one key light gives the bump map's contribution",
    )
    .asks(Prerequisite::Hand),
    EffectInfo::new("morph", "Morph targets"),
    EffectInfo::new("skin", "Skinning by bones"),
    EffectInfo::new(
        "lights",
        "Lights beside the environment: the scene's own, and those that are taken out of it",
    )
    .asks(Prerequisite::Lights),
    EffectInfo::new("shadows", "What stands in the lights' way")
        .asks(Prerequisite::Lights)
        .upon(Effect::Lights),
];

/// What was added to the table.
static ADDED: Added<EffectInfo> = Added::new();

impl Effect {
    /// The built-in effects, in the order of documentation.
    pub const BUILT_IN: [Self; 14] = [
        Self::Diffuse,
        Self::NormalMap,
        Self::Occlusion,
        Self::Rim,
        Self::SideSpecular,
        Self::Hilite,
        Self::Reflection,
        Self::Haze,
        Self::Bloom,
        Self::KeyLight,
        Self::Morph,
        Self::Skin,
        Self::Lights,
        Self::Shadows,
    ];

    /// Every effect: the built-in ones, then what was added.
    pub fn all() -> impl Iterator<Item = Self> {
        let most = Self::BUILT_IN.len() + ADDED.len();
        (0..most).map(|place| Self(place as u16))
    }

    /// Those that lists of effects offer: one within another is switched by a key of its own.
    pub fn offered() -> impl Iterator<Item = Self> {
        Self::all().filter(|effect| effect.info().within.is_none())
    }

    /// The effect that this one is part of and that a set lacks.
    #[must_use]
    pub fn lacks(self, effects: Effects) -> Option<Self> {
        self.info().within.filter(|&whole| !effects.has(whole))
    }

    /// Whether it belongs to each of several scenes that are fitted as one skin, and not to the skin: poses shade nothing,
    /// and lights are each scene's own.
    #[must_use]
    pub fn is_of_scene(self) -> bool {
        let own = [Self::Morph, Self::Skin, Self::KeyLight, Self::Lights, Self::Shadows];
        own.contains(&self) || self.info().within.is_some_and(Self::is_of_scene)
    }

    /// Add a row. A row of the same name and meaning is not added again.
    ///
    /// # Errors
    /// When another effect has its name, or a set holds no more.
    pub fn register(row: EffectInfo) -> Result<Self, RegistryError> {
        let taken = || RegistryError::Taken { kind: "effect", name: row.name.to_owned() };
        if TABLE.iter().any(|other| other.name == row.name) {
            return Err(taken());
        }
        let make = |place: usize| {
            if Self::BUILT_IN.len() + place < Effects::MOST {
                Ok(row)
            } else {
                Err(RegistryError::Full { kind: "effect", most: Effects::MOST })
            }
        };
        let same = |other: &EffectInfo| other.meaning == row.meaning;
        ADDED.add(|other| other.name == row.name, same, make, taken)?;
        Self::from_name(row.name).ok_or_else(taken)
    }

    /// Its row.
    #[must_use]
    pub fn info(self) -> &'static EffectInfo {
        static ROWS: [EffectInfo; Effect::BUILT_IN.len()] = TABLE;
        let place = usize::from(self.0);
        ROWS.get(place).unwrap_or_else(|| ADDED.row(place - ROWS.len()))
    }

    /// Whether its row is built in.
    #[must_use]
    pub const fn is_built_in(self) -> bool {
        (self.0 as usize) < Self::BUILT_IN.len()
    }

    /// The name in scene files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.info().name
    }

    /// The effect of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let own = TABLE.iter().position(|row| row.name == name);
        let place = own.or_else(|| Some(TABLE.len() + ADDED.position(|row| row.name == name)?));
        place.map(|place| Self(place as u16))
    }
}

impl fmt::Debug for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A set of enabled effects.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Effects([u64; Self::WORDS]);

impl Effects {
    const WORDS: usize = 16;
    /// How many effects a process tells apart: each of a scene's lights is one.
    pub const MOST: usize = 64 * Self::WORDS;

    /// What a scene gets when it names no effects: the paper's fragment program.
    pub const SURFACE: Self = Self::of(&[
        Effect::Diffuse,
        Effect::NormalMap,
        Effect::Occlusion,
        Effect::Rim,
        Effect::SideSpecular,
        Effect::Hilite,
        Effect::Reflection,
    ]);

    /// The set of the listed effects.
    #[must_use]
    pub const fn of(effects: &[Effect]) -> Self {
        let mut set = Self([0; Self::WORDS]);
        let mut i = 0;
        while i < effects.len() {
            set = set.with(effects[i]);
            i += 1;
        }
        set
    }

    /// Whether `effect` is enabled.
    #[must_use]
    pub const fn has(self, effect: Effect) -> bool {
        self.0[effect.0 as usize / 64] & (1 << (effect.0 % 64)) != 0
    }

    /// Whether any of `effects` is enabled.
    #[must_use]
    pub fn has_any(self, effects: &[Effect]) -> bool {
        effects.iter().any(|&effect| self.has(effect))
    }

    /// This set and `effect`.
    #[must_use]
    pub const fn with(self, effect: Effect) -> Self {
        let mut bits = self.0;
        bits[effect.0 as usize / 64] |= 1 << (effect.0 % 64);
        Self(bits)
    }

    /// This set without `effect`, and without those that it switches.
    #[must_use]
    pub fn without(self, effect: Effect) -> Self {
        let within = |other: &Effect| other.info().within == Some(effect);
        self.added().filter(within).fold(self, Self::alone_without).alone_without(effect)
    }

    const fn alone_without(self, effect: Effect) -> Self {
        let mut bits = self.0;
        bits[effect.0 as usize / 64] &= !(1 << (effect.0 % 64));
        Self(bits)
    }

    /// The enabled effects in the order of documentation.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        self.0.into_iter().enumerate().flat_map(|(i, mut word)| {
            std::iter::from_fn(move || {
                let bit = word.trailing_zeros();
                word &= word.checked_sub(1)?;
                Some(Effect(64 * i as u16 + bit as u16))
            })
        })
    }

    /// Those of them that files have added.
    pub fn added(self) -> impl Iterator<Item = Effect> {
        self.iter().filter(|effect| !effect.is_built_in())
    }

    /// Whether one of them shares light out before it is diffuse.
    #[must_use]
    pub fn share_light(self) -> bool {
        self.iter().any(|effect| effect.info().shares_light)
    }

    /// Those that do nothing for want of another one, and that.
    pub fn idle(self) -> impl Iterator<Item = (Effect, Effect)> {
        let lacking = move |effect: Effect| effect.info().upon.filter(|&other| !self.has(other));
        self.iter().filter_map(move |effect| Some((effect, lacking(effect)?)))
    }

    /// What the enabled effects ask for, with the silhouette evaluated as `silhouette` says, in the paper's first
    /// version.
    #[must_use]
    pub fn needs(self, silhouette: Silhouette) -> Needs {
        Setup::new(Form::Corrected, silhouette, self).needs()
    }

    /// Whether a cube is looked up along n, or what is mirrored at it.
    #[must_use]
    pub fn looks_up_n(self) -> bool {
        self.has_any(&[Effect::Diffuse, Effect::SideSpecular]) || self.mirrors()
    }

    fn mirrors(self) -> bool {
        self.has_any(&[Effect::Reflection, Effect::Haze, Effect::Bloom])
    }
}

impl Setup {
    /// What the enabled effects ask for.
    #[must_use]
    pub fn needs(&self) -> Needs {
        use Effect as E;
        let effects = self.effects;
        let reflection = effects.mirrors();
        // The silhouette S.z is only asked for by what it multiplies.
        let rim = effects.has(E::Hilite) || (effects.has(E::Diffuse) && effects.has(E::Rim));
        let looked_up = effects.looks_up_n();
        let shaded_by_n = effects.has(E::KeyLight)
            || (looked_up && !self.smooth_lookups())
            || (rim && self.silhouette == Silhouette::Bumped);
        let normal_map = self.bumps() && shaded_by_n;
        let attenuator = effects.has_any(&[E::Hilite, E::Haze, E::Bloom]);
        let built_in = Needs {
            color_map: effects.has_any(&[E::Diffuse, E::KeyLight]),
            normal_map,
            specular_map: effects.has(E::SideSpecular),
            attenuator_map: attenuator,
            tangents: normal_map,
            irradiance: effects.has(E::Diffuse),
            lobes: effects.has(E::SideSpecular) || reflection,
            hilite: effects.has(E::Hilite),
            reflected: false,
            occlusion: effects.has(E::Occlusion) && effects.has_any(&[E::Diffuse, E::Hilite]),
            rim,
            dapple: reflection,
            haze: effects.has_any(&[E::Haze, E::Bloom]),
            smooth_normal: effects.has(E::KeyLight) || (looked_up && self.smooth_lookups()),
            key_light: effects.has(E::KeyLight),
            atlas: false,
            fields: Fields::default(),
        };
        let added = effects.added().filter_map(|effect| Some(effect.info().needs?(effect, self)));
        added.fold(built_in, Needs::or)
    }
}

impl fmt::Debug for Effects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter().map(Effect::name)).finish()
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(iter: I) -> Self {
        iter.into_iter().fold(Self::default(), Self::with)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every 37th of all subsets of the built-in effects: 37 divides no power of two, so each effect is met beside
    /// each other one, switched on and off.
    fn sampled() -> impl Iterator<Item = Effects> {
        (0..1_u32 << Effect::BUILT_IN.len()).step_by(37).map(|bits| {
            Effect::BUILT_IN
                .into_iter()
                .enumerate()
                .filter(|(i, _)| bits & (1 << i) != 0)
                .map(|(_, e)| e)
                .collect()
        })
    }

    #[test]
    fn turning_an_effect_off_never_asks_for_more() {
        let count = |needs: Needs| format!("{needs:?}").matches("true").count();
        for set in sampled() {
            for silhouette in Silhouette::ALL {
                let all = count(set.needs(silhouette));
                for effect in set.iter() {
                    assert!(count(set.without(effect).needs(silhouette)) <= all);
                }
            }
        }
    }

    #[test]
    fn names_are_unique_and_found_again() {
        for effect in Effect::BUILT_IN {
            assert_eq!(Effect::from_name(effect.name()), Some(effect));
        }
    }

    #[test]
    fn a_set_keeps_every_effect_that_there_may_be_apart() {
        for place in 0..Effects::MOST as u16 {
            let set = Effects::default().with(Effect(place));
            assert_eq!(set.iter().map(|effect| effect.0).collect::<Vec<_>>(), [place]);
            assert_eq!(set.alone_without(Effect(place)), Effects::default());
        }
    }
}

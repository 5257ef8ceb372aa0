//! The one table of the model's parameters. Command line, documents, solvers and exporters
//! derive from it; what a parameter does to the image is the rules'.
//!
//! Its first rows are built in ([`TABLE`]); terms and scenes add others ([`Param::register`]), which stay for as long
//! as the process runs.

use std::collections::BTreeMap;
use std::fmt;

pub use super::columns::{Channels, Column};
use super::effects::{Effect, Effects, Form};
use super::registry::{Added, RegistryError};

/// A parameter of the model: the place of its row among the built-in ones, which stand first, and those that
/// [`register`](Param::register) has added.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Param(u16);

/// The built-in parameters, each documented by its row in [`TABLE`].
#[allow(missing_docs, reason = "each is documented by its row in TABLE")]
#[allow(
    non_upper_case_globals,
    reason = "they are the values that a parameter may have, as variants would be"
)]
impl Param {
    pub const BaseWeight: Self = Self(0);
    pub const RimWeight: Self = Self(1);
    pub const RimExponent: Self = Self(2);
    pub const Hilite: Self = Self(3);
    pub const Reflection: Self = Self(4);
    pub const SideSpecular: Self = Self(5);
    pub const Occlusion: Self = Self(6);
    pub const NormalStrength: Self = Self(7);
    pub const SpecularLobe: Self = Self(8);
    pub const EnvironmentRotation: Self = Self(9);
    pub const HazeWeight: Self = Self(10);
    pub const KeyAzimuth: Self = Self(11);
    pub const KeyElevation: Self = Self(12);
    pub const KeyColor: Self = Self(13);
}

/// How a solver steps through a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// By its value.
    Linear,
    /// By its logarithm: what matters is the ratio (exponents of lobes).
    Log,
}

/// Whose a parameter is, where several scenes are fitted as one skin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The skin's: one value holds in all scenes.
    Skin,
    /// The scene's, as its light: each scene has a value of its own.
    Scene,
}

impl Owner {
    /// The name in the table as JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Skin => "skin",
            Self::Scene => "scene",
        }
    }
}

/// One row of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamInfo {
    /// Which parameter.
    pub param: Param,
    /// The name in scene files, on the command line and in reports: a word, or several with dots between them.
    pub name: &'static str,
    /// The name in shaders and exports: the same with `_` for each dot.
    pub identifier: &'static str,
    /// The value that reproduces the printed listing.
    pub listing: f64,
    /// The default of the corrected form.
    pub corrected: f64,
    /// The default of both forms in each channel, where channels differ; that of red stands above, too.
    pub channels: Option<[f64; 3]>,
    /// Least allowed value (may be infinite).
    pub lower: f64,
    /// Greatest allowed value (may be infinite).
    pub upper: f64,
    /// The unit, empty for a pure number.
    pub unit: &'static str,
    /// Whether it may take one value a colour channel.
    pub rgb: bool,
    /// Whether the result is linear in it, once the non-linear ones are fixed.
    pub linear: bool,
    /// How a solver steps through it.
    pub scale: Scale,
    /// Whose it is, where several scenes are fitted as one skin.
    pub owner: Owner,
    /// Whether it is a number that its scene gives elsewhere, which no fit moves and no file of constants holds.
    pub held: bool,
    /// Whether its start is what its scene gives elsewhere: files hold it only where it was free.
    pub found: bool,
    /// The whole that it is a share of: with the other shares of the same it adds up to no more than 1, in each channel.
    pub share: Option<&'static str>,
    /// It is asked for when one of these effects is enabled.
    pub effects: &'static [Effect],
    /// Where it comes from.
    pub source: &'static str,
    /// What it does, in one line.
    pub meaning: &'static str,
}

/// Greater numbers leave the range in which images and their squares are finite in f32.
pub const LARGEST: f64 = 1e9;

impl ParamInfo {
    /// The least and the greatest number that may be given for it: its bounds, where they are finite.
    #[must_use]
    pub const fn range(&self) -> (f64, f64) {
        (self.lower.max(-LARGEST), self.upper.min(LARGEST))
    }

    /// Whether `value` may be given for it.
    #[must_use]
    pub fn admits(&self, value: f64) -> bool {
        let (lower, upper) = self.range();
        (lower..=upper).contains(&value)
    }
}

const INF: f64 = f64::INFINITY;

macro_rules! row {
    (scene: $($row:tt)*) => {
        ParamInfo { owner: Owner::Scene, ..row!($($row)*) }
    };
    ($param:ident $name:literal, $listing:expr, $corrected:expr, [$lower:expr, $upper:expr], $unit:literal,
     $rgb:literal, $linear:literal, $scale:ident, [$($effect:ident),*], $source:literal, $meaning:literal) => {
        ParamInfo {
            param: Param::$param, name: $name, identifier: $name, listing: $listing, corrected: $corrected, channels: None, lower: $lower, upper: $upper,
            unit: $unit, rgb: $rgb, linear: $linear, scale: Scale::$scale, owner: Owner::Skin, held: false, found: false, share: None, effects: &[$(Effect::$effect),*],
            source: $source, meaning: $meaning,
        }
    };
}

/// The built-in parameters, in their order.
#[rustfmt::skip]
pub static TABLE: [ParamInfo; Param::COUNT] = [
    //  param               name                   listing corrected  bounds        unit  rgb   linear scale  asked for by
    row!(BaseWeight          "base_weight",          0.0,  1.0,  [0.0, INF],       "",        true,  true,  Linear, [Diffuse, Lights],
         "model.md 3 (corrected form)", "share of the diffuse light seen from any angle"),
    row!(RimWeight           "rim_weight",           1.0,  0.5,  [-INF, INF],      "",        true,  true,  Linear, [Diffuse, Lights],
         "listing 3-4, SkinSilhouetteVec.y", "diffuse light added towards the silhouette"),
    row!(RimExponent         "rim_exponent",         2.0,  2.0,  [0.25, 16.0],     "",        false, false, Linear, [Lights, Diffuse, Hilite],
         "listing 3-3, (1-|N.V|)^2", "power of the silhouette term 1-|N.V|"),
    row!(Hilite              "hilite",               0.7,  0.7,  [0.0, INF],       "",        true,  true,  Linear, [Hilite],
         "listing 3-4, 0.7", "weight of the back light that shines past the rim"),
    row!(Reflection          "reflection",           0.02, 0.02, [0.0, INF],       "",        true,  true,  Linear, [Reflection],
         "listing 3-4, 0.02", "weight of the mirrored environment"),
    row!(SideSpecular        "side_specular",        1.0,  1.0,  [0.0, INF],       "",        true,  true,  Linear, [SideSpecular],
         "listing 3-4, sideSpec", "weight of the specular map times the specular cube"),
    row!(Occlusion           "occlusion",            1.0,  1.0,  [0.0, 1.0],       "",        false, false, Linear, [Occlusion],
         "listing 3-4, SkinSilhouetteVec.x", "how much ambient occlusion darkens (0 none, 1 as baked)"),
    row!(NormalStrength      "normal_strength",      1.0,  1.0,  [0.0, 4.0],       "",        false, false, Linear, [NormalMap],
         "model.md 3 (corrected form)", "scale of the normal map's slopes"),
    row!(SpecularLobe        "specular_lobe",        32.0, 32.0, [1.0, 2048.0],    "Phong exponent", false, false, Log, [SideSpecular, Reflection, Haze, Bloom],
         "model.md 4", "sharpness of the specular cube"),
    row!(scene: EnvironmentRotation "environment_rotation", 0.0,  0.0,  [-INF, INF],      "degrees", false, false, Linear, [Diffuse, Lights, SideSpecular, Hilite, Reflection, Haze, Bloom],
         "model.md 1", "turn of the environment about +Y, on top of the scene's own"),
    row!(HazeWeight          "haze_weight",          1.0,  1.0,  [0.0, INF],       "",        false, true,  Linear, [Haze, Bloom],
         "listing 3-4, alpha", "weight of the haze written to alpha"),
    row!(scene: KeyAzimuth          "key_azimuth",          0.0,  0.0,  [-INF, INF],      "degrees", false, false, Linear, [KeyLight],
         "GPU Gems ch. 3, last page", "key light's direction, from +Z towards +X"),
    row!(scene: KeyElevation        "key_elevation",        45.0, 45.0, [-90.0, 90.0],    "degrees", false, false, Linear, [KeyLight],
         "GPU Gems ch. 3, last page", "key light's direction above the horizon"),
    row!(scene: KeyColor            "key_color",            1.0,  1.0,  [0.0, INF],       "radiance", true, true,  Linear, [KeyLight],
         "GPU Gems ch. 3, last page", "key light's colour"),
];

/// What was added to the table.
static ADDED: Added<ParamInfo> = Added::new();

impl Param {
    /// How many parameters are built in.
    pub const COUNT: usize = 14;

    /// The built-in parameters, in their order.
    pub fn built_in() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.param)
    }

    /// Every parameter: the built-in ones, then what was added, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::built_in().chain(ADDED.rows().into_iter().map(|row| row.param))
    }

    /// The parameters that a scene with these effects has: the built-in ones, and what is added by its effects.
    pub fn of(effects: Effects) -> impl Iterator<Item = Self> {
        Self::all().filter(move |param| param.is_built_in() || param.asked_for(effects))
    }

    /// Add a row, whose `param` is set here. A row that is there already is not added again.
    ///
    /// # Errors
    /// When another parameter has its name.
    pub fn register(row: ParamInfo) -> Result<Self, RegistryError> {
        let taken = |other: &ParamInfo| other.name == row.name || other.identifier == row.identifier;
        if TABLE.iter().any(taken) {
            return Err(RegistryError::Taken { kind: "parameter", name: row.name.to_owned() });
        }
        let make = |place: usize| {
            let place = u16::try_from(Self::COUNT + place);
            let place = place.map_err(|_| RegistryError::Full { kind: "parameter", most: 1 << 16 })?;
            Ok(ParamInfo { param: Self(place), ..row })
        };
        let same = |other: &ParamInfo| ParamInfo { param: other.param, ..row } == *other;
        ADDED
            .add(taken, same, make, || RegistryError::Taken { kind: "parameter", name: row.name.to_owned() })
            .map(|row| row.param)
    }

    /// Its place in the table.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// Whether its row is built in.
    #[must_use]
    pub const fn is_built_in(self) -> bool {
        self.index() < Self::COUNT
    }

    /// This parameter's row.
    #[must_use]
    pub fn info(self) -> &'static ParamInfo {
        TABLE.get(self.index()).unwrap_or_else(|| ADDED.row(self.index() - Self::COUNT))
    }

    /// The name in scene files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.info().name
    }

    /// The name in shaders and exports.
    #[must_use]
    pub fn identifier(self) -> &'static str {
        self.info().identifier
    }

    /// The parameter of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::found(|row| row.name == name)
    }

    /// The parameter of that name in shaders.
    #[must_use]
    pub fn from_identifier(name: &str) -> Option<Self> {
        Self::found(|row| row.identifier == name)
    }

    fn found(is: impl Fn(&ParamInfo) -> bool) -> Option<Self> {
        let own = TABLE.iter().position(&is);
        let place = own.or_else(|| Some(Self::COUNT + ADDED.position(&is)?));
        place.map(|place| Self(place as u16))
    }

    /// Whether each of several scenes that are fitted as one skin has a value of its own.
    #[must_use]
    pub fn is_of_scene(self) -> bool {
        self.info().owner == Owner::Scene
    }

    /// The default in `form`.
    #[must_use]
    pub fn default(self, form: Form) -> f64 {
        match form {
            Form::Listing => self.info().listing,
            Form::Corrected => self.info().corrected,
        }
    }

    /// The default in `form`, in each channel.
    #[must_use]
    pub fn default_rgb(self, form: Form) -> [f64; 3] {
        self.info().channels.unwrap_or([self.default(form); 3])
    }

    /// Whether any enabled effect reads this parameter.
    #[must_use]
    pub fn asked_for(self, effects: Effects) -> bool {
        effects.has_any(self.info().effects)
            && (self != Self::RimWeight || effects.has(Effect::Rim))
            && (self != Self::RimExponent || effects.has(Effect::Hilite) || effects.has(Effect::Rim))
    }
}

impl fmt::Debug for Param {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One value a parameter and channel. A parameter that is not `rgb` holds three equal values; one that was added
/// to the table later has its default. Of scenes that are fitted as one skin, some values may hold in one scene alone.
#[derive(Clone, Debug)]
pub struct Params {
    form: Form,
    values: Vec<[f64; 3]>,
    /// By the scene's number, and the parameter.
    own: BTreeMap<(usize, Param), [f64; 3]>,
}

impl Params {
    /// The defaults of `form`.
    #[must_use]
    pub fn defaults(form: Form) -> Self {
        let values = Param::all().map(|param| param.default_rgb(form)).collect();
        Self { form, values, own: BTreeMap::new() }
    }

    /// The value of a scalar parameter (the red value of a coloured one).
    #[must_use]
    pub fn scalar(&self, param: Param) -> f64 {
        self.rgb(param)[0]
    }

    /// The value of the scalar parameter that shaders call so; 0 where none is known.
    #[must_use]
    pub fn scalar_named(&self, identifier: &str) -> f64 {
        Param::from_identifier(identifier).map_or(0.0, |param| self.scalar(param))
    }

    /// The three channels' values.
    #[must_use]
    pub fn rgb(&self, param: Param) -> [f64; 3] {
        self.values.get(param.index()).copied().unwrap_or_else(|| param.default_rgb(self.form))
    }

    /// Set all channels to `value`.
    pub fn set(&mut self, param: Param, value: f64) {
        self.set_rgb(param, [value; 3]);
    }

    /// Set each channel.
    pub fn set_rgb(&mut self, param: Param, value: [f64; 3]) {
        while self.values.len() <= param.index() {
            let next = Param(self.values.len() as u16);
            self.values.push(next.default_rgb(self.form));
        }
        self.values[param.index()] = value;
    }

    /// The three channels' values in a scene: its own, or else those of all scenes.
    #[must_use]
    pub fn rgb_in(&self, scene: usize, param: Param) -> [f64; 3] {
        self.own.get(&(scene, param)).copied().unwrap_or_else(|| self.rgb(param))
    }

    /// Set each channel in one scene alone.
    pub fn set_rgb_in(&mut self, scene: usize, param: Param, value: [f64; 3]) {
        self.own.insert((scene, param), value);
    }

    /// The values that hold in a scene, as if there were no other.
    #[must_use]
    pub fn in_scene(&self, scene: usize) -> Self {
        let mut params = Self { form: self.form, values: self.values.clone(), own: BTreeMap::new() };
        let own = self.own.range((scene, Param(0))..=(scene, Param(u16::MAX)));
        own.for_each(|(&(_, param), &value)| params.set_rgb(param, value));
        params
    }

    /// Whether all that differs are weights of the skin's: numbers that the image is linear in, and that no light, no
    /// bake and no ray depends on.
    #[must_use]
    pub fn differ_in_weights_alone(&self, other: &Self) -> bool {
        let weight = |param: Param| param.info().linear && param.info().owner == Owner::Skin;
        self.own == other.own
            && Param::all().all(|param| weight(param) || self.rgb(param) == other.rgb(param))
    }

    /// What scenes have of their own, in their order.
    pub fn own(&self) -> impl Iterator<Item = (usize, Param, [f64; 3])> {
        self.own.iter().map(|(&(scene, param), &value)| (scene, param, value))
    }
}

impl PartialEq for Params {
    fn eq(&self, other: &Self) -> bool {
        let most = self.values.len().max(other.values.len());
        (0..most as u16).map(Param).all(|param| self.rgb(param) == other.rgb(param)) && self.own == other.own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_rows_stand_in_the_order_of_the_enum_with_defaults_within_bounds() {
        for (i, row) in TABLE.iter().enumerate() {
            assert_eq!(row.param.index(), i, "{}", row.name);
            for value in [row.listing, row.corrected] {
                assert!((row.lower..=row.upper).contains(&value), "{}", row.name);
            }
            assert_eq!(Param::from_name(row.name), Some(row.param));
        }
    }

    #[test]
    fn columns_read_back_what_they_set() {
        let mut params = Params::defaults(Form::Corrected);
        for column in Param::built_in().map(Column::tied).chain(Column::per_channel(Param::Hilite)) {
            column.set(&mut params, 0.375);
            assert_eq!(column.get(&params), 0.375, "{}", column.name());
        }
    }

    #[test]
    fn a_scenes_own_value_holds_there_alone() {
        let mut params = Params::defaults(Form::Corrected);
        let turn = Column::tied(Param::EnvironmentRotation);
        turn.set(&mut params, 5.0);
        turn.set_in(1, &mut params, 30.0);
        let [_, green, _] = Column::per_channel(Param::KeyColor);
        green.set_in(2, &mut params, 0.5);
        assert_eq!([0, 1, 2].map(|scene| turn.get_in(scene, &params)), [5.0, 30.0, 5.0]);
        assert_eq!(params.rgb_in(2, Param::KeyColor), [1.0, 0.5, 1.0]);
        let mut alone = Params::defaults(Form::Corrected);
        turn.set(&mut alone, 30.0);
        assert!(params.in_scene(1) == alone && params != alone);
        assert_eq!(params.own().count(), 2);
    }
}

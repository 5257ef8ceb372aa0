//! `scene.toml` as it stands in the file: tables, keys and where they are. What the values mean is
//! checked in [`super::settings`].

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};
use toml::Spanned;

use super::error::{SceneError, read_bytes};

/// A scene file.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub mesh: MeshTable,
    #[serde(default)]
    pub maps: MapsTable,
    pub environment: Option<EnvironmentTable>,
    #[serde(default)]
    pub model: ModelTable,
    #[serde(default)]
    pub light: Vec<Spanned<LightTable>>,
    #[serde(default)]
    pub view: Vec<Spanned<ViewTable>>,
    #[serde(default)]
    pub fit: FitTable,
    #[serde(default)]
    pub quality: QualityTable,
    #[serde(default)]
    pub bloom: BloomTable,
    #[serde(default)]
    pub diffusion: DiffusionTable,
    #[serde(default)]
    pub transmission: TransmissionTable,
}

/// `[mesh]`
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshTable {
    pub file: PathBuf,
    pub morph_weights: Option<Spanned<Vec<f64>>>,
    pub time: Option<Spanned<f64>>,
    pub animation: Option<Spanned<String>>,
    pub skin: Option<Spanned<Vec<String>>>,
    pub metres_per_unit: Option<Spanned<f64>>,
    #[serde(default)]
    pub lights: bool,
}

/// `[maps]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MapsTable {
    pub color: Option<PathBuf>,
    pub normal: Option<PathBuf>,
    pub specular: Option<PathBuf>,
    pub attenuator: Option<PathBuf>,
    pub normal_y: Option<Spanned<String>>,
    /// Whether the skin's own material gives the maps where none is named here.
    pub material: Option<bool>,
    /// Those that files of rules declare.
    #[serde(default)]
    pub own: BTreeMap<Spanned<String>, PathBuf>,
}

impl MapsTable {
    /// Whether maps that are not named are those of the skin's own material.
    pub(super) fn takes_material(&self) -> bool {
        let named = [&self.color, &self.normal, &self.specular, &self.attenuator];
        self.material.unwrap_or(named.into_iter().all(Option::is_none))
    }
}

/// `[environment]`
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EnvironmentTable {
    pub file: PathBuf,
    pub rotation_degrees: Option<Spanned<f64>>,
    pub intensity: Option<Spanned<f64>>,
    pub dapple: Option<Spanned<Vec<f64>>>,
    pub lights: Option<Spanned<i64>>,
    pub light_spot_degrees: Option<Spanned<f64>>,
}

/// `[[light]]`
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightTable {
    pub name: Spanned<String>,
    #[serde(rename = "type")]
    pub kind: Spanned<String>,
    pub direction: Option<Spanned<[f64; 3]>>,
    pub irradiance: Option<Spanned<ParamValue>>,
    pub angular_diameter_degrees: Option<Spanned<f64>>,
    pub position: Option<Spanned<[f64; 3]>>,
    pub intensity: Option<Spanned<ParamValue>>,
    pub range: Option<Spanned<f64>>,
    pub radius: Option<Spanned<f64>>,
    pub inner_degrees: Option<Spanned<f64>>,
    pub outer_degrees: Option<Spanned<f64>>,
}

/// `[model]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModelTable {
    pub form: Option<Spanned<String>>,
    pub silhouette: Option<Spanned<String>>,
    pub lookups: Option<Spanned<String>>,
    pub specular_model: Option<Spanned<String>>,
    pub split_sum: Option<Spanned<String>>,
    pub specular_visibility: Option<Spanned<String>>,
    pub lobe_lookup: Option<Spanned<String>>,
    pub specular_map: Option<Spanned<String>>,
    pub normal_filter: Option<Spanned<String>>,
    pub visibility: Option<Spanned<String>>,
    pub bounces: Option<Spanned<String>>,
    pub skin_reflection: Option<Spanned<String>>,
    pub effects: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    pub terms: Vec<Spanned<TermValue>>,
    #[serde(default)]
    pub params: ParamsTable,
}

/// A file of shader rules; of a family's, the names of those that there are.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(untagged, expecting = "invalid type: expected a path or { file = \"...\", names = [\"...\"] }")]
pub(super) enum TermValue {
    Alone(PathBuf),
    Family(FamilyTable),
}

/// `{ file = "...", names = ["...", ...] }`
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FamilyTable {
    pub file: PathBuf,
    pub names: Vec<String>,
}

/// `[model.params]`
pub(super) type ParamsTable = BTreeMap<Spanned<String>, Spanned<ParamValue>>;

/// `[fit.bounds]`
pub(super) type BoundsTable = BTreeMap<Spanned<String>, Spanned<[f64; 2]>>;

/// `[[view]]`
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ViewTable {
    pub name: Spanned<String>,
    pub world_to_camera: Option<Spanned<Vec<f64>>>,
    pub eye: Option<Spanned<[f64; 3]>>,
    pub look_at: Option<Spanned<[f64; 3]>>,
    pub up: Option<Spanned<[f64; 3]>>,
    pub camera: Option<Spanned<String>>,
    pub lens: Option<Spanned<LensTable>>,
    pub fov_y_degrees: Option<Spanned<f64>>,
    pub width: Spanned<i64>,
    pub height: Spanned<i64>,
    pub target: Option<PathBuf>,
    pub mask: Option<PathBuf>,
    pub haze: Option<PathBuf>,
    pub response: Option<Spanned<ResponseValue>>,
    pub background: Option<Spanned<BackgroundValue>>,
}

/// `lens = { ... }` of a view
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LensTable {
    pub model: Option<Spanned<String>>,
    pub fx: Option<Spanned<f64>>,
    pub cx: Option<Spanned<f64>>,
    pub cy: Option<Spanned<f64>>,
    pub k1: Option<Spanned<f64>>,
    pub k2: Option<Spanned<f64>>,
    pub k3: Option<Spanned<f64>>,
    pub k4: Option<Spanned<f64>>,
    pub p1: Option<Spanned<f64>>,
    pub p2: Option<Spanned<f64>>,
}

/// A camera's response: a power, or a table's file.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(
    untagged,
    expecting = "invalid type: expected a number (the power of a code that light is) or the path of a table"
)]
pub(super) enum ResponseValue {
    Gamma(f64),
    Table(PathBuf),
}

/// What stands behind the mesh: a name, or a colour.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(untagged, expecting = "invalid type: expected \"none\", \"environment\" or [r, g, b]")]
pub(super) enum BackgroundValue {
    Name(String),
    Color([f64; 3]),
}

/// `[bloom]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BloomTable {
    pub sigma: Option<Spanned<f64>>,
}

/// `[diffusion]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DiffusionTable {
    pub uv_set: Option<Spanned<i64>>,
    pub light_map_size: Option<Spanned<i64>>,
    pub preset: Option<Spanned<String>>,
    pub method: Option<Spanned<String>>,
    pub taps: Option<Spanned<TapsValue>>,
    pub ambient_normal: Option<Spanned<String>>,
    pub stretch: Option<Spanned<String>>,
    pub seams: Option<Spanned<String>>,
    pub lookup: Option<Spanned<String>>,
    pub unblurred: Option<Spanned<String>>,
    pub combined: Option<Spanned<String>>,
}

/// `[transmission]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TransmissionTable {
    pub method: Option<Spanned<String>>,
}

/// `5`, or `"full"`.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(untagged, expecting = "invalid type: expected 5, 7, 9 or \"full\"")]
pub(super) enum TapsValue {
    Count(i64),
    Name(String),
}

/// `[fit]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FitTable {
    pub free: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    pub per_channel: Vec<Spanned<String>>,
    #[serde(default)]
    pub bounds: BoundsTable,
    pub loss: Option<Spanned<String>>,
    #[serde(default)]
    pub gains: bool,
    #[serde(default)]
    pub white_balance: bool,
    #[serde(default)]
    pub cameras: bool,
    #[serde(default)]
    pub maps: MapFitTable,
}

/// `[fit.maps]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MapFitTable {
    pub rounds: Option<Spanned<i64>>,
    pub steps: Option<Spanned<i64>>,
    pub solver: Option<Spanned<String>>,
    pub rate: Option<Spanned<f64>>,
    #[serde(default)]
    pub color: MapPriorTable,
    #[serde(default)]
    pub specular: MapPriorTable,
    #[serde(default)]
    pub attenuator: MapPriorTable,
    #[serde(default)]
    pub occlusion: MapPriorTable,
    #[serde(default)]
    pub environment: MapPriorTable,
}

/// `[fit.maps.color]` and the others
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MapPriorTable {
    pub smoothness: Option<Spanned<f64>>,
    pub closeness: Option<Spanned<f64>>,
    pub lower: Option<Spanned<f64>>,
    pub upper: Option<Spanned<f64>>,
}

/// `[quality]`
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct QualityTable {
    pub samples_per_axis: Option<Spanned<i64>>,
    pub irradiance_size: Option<Spanned<i64>>,
    pub lobe_size: Option<Spanned<i64>>,
    pub hilite_size: Option<Spanned<i64>>,
    pub lobes_per_octave: Option<Spanned<i64>>,
    pub occlusion_rays: Option<Spanned<i64>>,
    pub shadow_rays: Option<Spanned<i64>>,
    pub sky_rays: Option<Spanned<i64>>,
    pub lobe_rays: Option<Spanned<i64>>,
    pub texture_filter: Option<Spanned<String>>,
    pub shadow_filter: Option<Spanned<String>>,
    pub shadow_map_size: Option<Spanned<i64>>,
    pub shadow_bias: Option<Spanned<f64>>,
    pub shadow_radius: Option<Spanned<f64>>,
    pub shadow_taps: Option<Spanned<i64>>,
}

/// A number, or one for each channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ParamValue {
    Scalar(f64),
    Rgb([f64; 3]),
}

impl ParamValue {
    /// The three channels' values.
    pub(super) fn channels(self) -> [f64; 3] {
        match self {
            Self::Scalar(value) => [value; 3],
            Self::Rgb(values) => values,
        }
    }
}

impl<'de> Deserialize<'de> for ParamValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrTriple;
        impl<'de> Visitor<'de> for NumberOrTriple {
            type Value = ParamValue;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or [r, g, b]")
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<ParamValue, E> {
                Ok(ParamValue::Scalar(value))
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<ParamValue, E> {
                Ok(ParamValue::Scalar(value as f64))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<ParamValue, A::Error> {
                let mut rgb = [0.0; 3];
                for (i, channel) in rgb.iter_mut().enumerate() {
                    *channel = values.next_element()?.ok_or_else(|| de::Error::invalid_length(i, &self))?;
                }
                match values.next_element::<f64>()? {
                    Some(_) => Err(de::Error::invalid_length(4, &self)),
                    None => Ok(ParamValue::Rgb(rgb)),
                }
            }
        }
        deserializer.deserialize_any(NumberOrTriple)
    }
}

/// The text of a TOML file and where it is: turns spans into lines.
pub struct Source {
    /// The file.
    pub path: PathBuf,
    text: String,
}

impl Source {
    /// Read a text file of at most 16 MB.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let inside = path.join("scene.toml");
        if inside.is_file() {
            let remedy = format!("Name the scene file in it, {}", inside.display());
            return Err(SceneError::new(path, "is a folder", remedy));
        }
        let bytes = read_bytes(path, 1 << 24)?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let line =
                1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
            SceneError::new(path, "is not text in UTF-8", "Name a scene file, or save it as UTF-8")
                .at(format!("line {line}"))
        })?;
        Ok(Self { path: path.to_owned(), text })
    }

    /// A text that stands at `path`, or comes with the program.
    pub fn of(path: &Path, text: String) -> Self {
        Self { path: path.to_owned(), text }
    }

    /// Parse the text.
    pub fn parse<'de, T: Deserialize<'de>>(&'de self) -> Result<T, SceneError> {
        toml::from_str(&self.text).map_err(|e| {
            let (what, remedy) = explain(e.message());
            let error = SceneError::new(&self.path, what, remedy);
            match e.span() {
                Some(span) => error.at(self.line(span.start)),
                None => error,
            }
        })
    }

    /// "line N" of a place in the text.
    fn line(&self, offset: usize) -> String {
        let before = self.text.as_bytes().iter().take(offset).filter(|&&b| b == b'\n').count();
        format!("line {}", before + 1)
    }

    /// An error about the value (or key) `at`.
    pub fn error<T>(
        &self,
        at: &Spanned<T>,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> SceneError {
        SceneError::new(&self.path, what, remedy).at(self.line(at.span().start))
    }

    /// The value of that `name` in `all`; an unknown name is refused with the nearest known one.
    pub fn choose<T: Copy>(
        &self,
        kind: &str,
        name: &Spanned<String>,
        all: &[(&str, T)],
    ) -> Result<T, SceneError> {
        let given = name.get_ref();
        all.iter().find(|(known, _)| known == given).map(|&(_, value)| value).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|&(known, _)| known).collect();
            self.error(name, format!("unknown {kind} `{given}`"), suggestion(given, &names))
        })
    }
}

/// Refuse a text that is not a scene file's by its keys and the kinds of its values; what they mean is
/// checked when the scene is loaded.
pub fn check_text(path: &Path, text: &str) -> Result<(), SceneError> {
    Source::of(path, text.to_owned()).parse::<SceneFile>().map(drop)
}

/// "Did you mean ...? Known: ...", for a name that is none of `known`.
#[must_use]
pub fn suggestion(given: &str, known: &[&str]) -> String {
    let nearest = known
        .iter()
        .map(|name| (strsim::damerau_levenshtein(given, name), name))
        .min()
        // Further off than that, it is another word.
        .filter(|&(distance, name)| distance <= 1 + name.len() / 3);
    let list = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    match nearest {
        Some((_, name)) => format!("Did you mean `{name}`? Known: {list}"),
        None => format!("Known: {list}"),
    }
}

/// serde's message in our form: what is wrong, and what to do.
fn explain(message: &str) -> (String, String) {
    let message = message.trim().replace('\n', " ");
    if let Some(rest) = message.strip_prefix("unknown field ") {
        // unknown field `a`, expected one of `b`, `c`
        let mut names = rest.split('`').skip(1).step_by(2);
        let given = names.next().unwrap_or_default().to_owned();
        let known: Vec<&str> = names.collect();
        return (format!("unknown key `{given}`"), suggestion(&given, &known));
    }
    if let Some(rest) = message.strip_prefix("missing field ") {
        return (format!("the key {rest} is missing"), format!("Add {rest}"));
    }
    let remedy = if message.starts_with("invalid type") || message.starts_with("invalid length") {
        "Give a value of the kind that is expected"
    } else {
        "Correct the line (see toml.io for the syntax)"
    };
    let message = message
        .replace("expected i64", "expected a whole number")
        .replace("expected f64", "expected a number");
    (message, remedy.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_name_is_met_with_the_nearest_and_a_foreign_one_with_the_list() {
        assert_eq!(
            suggestion("hilit", &["diffuse", "hilite"]),
            "Did you mean `hilite`? Known: diffuse, hilite"
        );
        assert_eq!(suggestion("subsurface", &["rim", "hilite"]), "Known: rim, hilite");
    }
}

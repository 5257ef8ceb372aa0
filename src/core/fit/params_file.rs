//! `params.toml`: what was fitted, for `render` and the next fit.
//!
//! ```toml
//! # Fitted by skinfit 0.1.0 with varpro to scenes/forest.toml.
//! # Loss 3.1e-2 at the start, 4.2e-3 at the end.
//! form = "corrected"
//! effects = ["diffuse", "hilite"]
//! loss = "relative_l2"
//!
//! [params]
//! base_weight = 0.95              # +- 0.002
//! hilite = [0.7, 0.6, 0.5]        # +- 0.01, 0.01, 0.02
//!
//! [gains]
//! front = 1.0
//! left = [1.1, 1.0, 0.9]          # of each channel: its white balance too
//! ```
//!
//! Of several scenes that were fitted as one skin, `[params]` holds the skin's values alone, and what each scene has of its
//! own stands under its name:
//!
//! ```toml
//! [scenes.noon.params]
//! environment_rotation = 12.5     # +- 0.1
//!
//! [scenes.noon.gains]
//! front = 1.0
//! ```
//!
//! Reading is strict: an unknown name, a value outside its parameter's bounds or another form than the
//! scene's is refused with its line. A parameter that the file does not name keeps the scene's value.
//!
//! `foreign`: what is said of constants that were fitted with other effects

use std::fmt::Write;
use std::path::{Path, PathBuf};

mod foreign;
mod parse;

pub use foreign::Foreign;
use parse::{Problem, parse};

use crate::engine::Unknown;
use crate::files;
use crate::fit::outcome::{Outcome, UnknownOutcome};
use crate::model::effects::{Effect, Effects, Form};
use crate::model::gain::Gain;
use crate::model::params::{Channels, Param, Params};
use crate::output::{self, OutputError};
use crate::scene::names::names_of;
use crate::scene::{Assignment, Loss};
use crate::shader::term;

/// What a `params.toml` holds.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamsFile {
    /// The form that the parameters are of.
    pub form: Form,
    /// The effects that they were fitted with, where the file says.
    pub effects: Option<Effects>,
    /// The loss that they minimise, where the file says.
    pub loss: Option<Loss>,
    /// The parameters.
    pub params: Params,
    /// A gain for each view, by its name, in the file's order.
    pub gains: Vec<(String, Gain)>,
    /// What each of several scenes has of its own, in the order of their names.
    pub scenes: Vec<SceneValues>,
}

/// What one of several scenes that were fitted as one skin has of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneValues {
    /// What it is called ([`names_of`]).
    pub name: String,
    /// Its effects, where they differ from the file's: by those of its light and its pose.
    pub effects: Option<Effects>,
    /// Its parameters' values.
    pub params: Vec<(Param, [f64; 3])>,
    /// A gain for each of its views.
    pub gains: Vec<(String, Gain)>,
}

/// Where the values of a `params.toml` come from, for its comments.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// The scene's file.
    pub scene: &'a Path,
    /// How the fit ended; none where nothing was fitted.
    pub outcome: Option<&'a Outcome>,
    /// What was set instead of the scene's values.
    pub set: &'a [Assignment],
    /// Where nothing was fitted: what is free all the same, and so is no scene's to give elsewhere.
    pub free: &'a [Param],
    /// Of several scenes that were fitted as one skin their numbers in the outcome, and those of their first views; by the
    /// order of [`ParamsFile::scenes`]. A scene that was not fitted has none.
    pub numbers: &'a [Option<(usize, usize)>],
}

/// A `params.toml` cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {problem}", path.display(), line.map(|n| format!(", line {n}")).unwrap_or_default())]
pub struct ParamsFileError {
    path: PathBuf,
    line: Option<usize>,
    problem: String,
}

impl ParamsFile {
    /// The values for one scene by itself, with what it has of its own where the file knows it by name.
    #[must_use]
    pub fn of_scene(mut self, scene: &Path) -> Self {
        let own =
            names_of(scene).into_iter().find_map(|name| self.scenes.iter().find(|own| own.name == name));
        if let Some(own) = own {
            own.params.iter().for_each(|(param, rgb)| self.params.set_rgb(*param, *rgb));
            self.gains.clone_from(&own.gains);
            self.effects = own.effects.or(self.effects);
        }
        self
    }

    /// The file's text, with comments that tell what it comes from.
    #[must_use]
    pub fn to_toml(&self, origin: Origin<'_>) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_text(&mut text, origin);
        text
    }

    fn write_text(&self, text: &mut String, origin: Origin<'_>) -> std::fmt::Result {
        let Origin { scene, outcome, set, free, numbers } = origin;
        // A line break in a path must not end the comment.
        let scene: String =
            scene.display().to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let version = env!("CARGO_PKG_VERSION");
        match outcome {
            None => writeln!(text, "# Written by skinfit {version}; scene {scene}.")?,
            Some(outcome) => {
                writeln!(text, "# Fitted by skinfit {version} with {} to {scene}.", outcome.solver)?;
                let (start, end) = (outcome.loss_start, outcome.loss_end);
                writeln!(text, "# Loss {start:.6e} at the start, {end:.6e} at the end.")?;
            }
        }
        if !set.is_empty() {
            let set: Vec<String> = set.iter().map(ToString::to_string).collect();
            writeln!(text, "# Set on the command line before the fit: {}.", set.join(", "))?;
        }
        writeln!(text, "form = \"{}\"", self.form.name())?;
        write_effects(text, self.effects)?;
        write_terms(text, self.effects.unwrap_or_default())?;
        if let Some(loss) = self.loss {
            writeln!(text, "loss = \"{}\"", loss.name())?;
        }
        writeln!(text, "\n[params]")?;
        let known = outcome.map_or(&[][..], |outcome| &outcome.unknowns);
        let shared = |param: &Param| self.scenes.is_empty() || !param.is_of_scene();
        let was_free = |param: Param| {
            free.contains(&param)
                || known
                    .iter()
                    .any(|known| known.unknown.column().is_some_and(|column| column.param == param))
        };
        let of_scene = |param: Param| param.info().held || (param.info().found && !was_free(param));
        let written = |param: &Param| shared(param) && !of_scene(*param);
        for param in Param::of(self.effects.unwrap_or_default()).filter(written) {
            let line = format!("{} = {}", key(param), value(self.params.rgb(param)));
            line_with_comment(text, &line, &comment(known, |unknown| param_channel(unknown, param)))?;
        }
        if !self.gains.is_empty() {
            writeln!(text, "\n[gains]")?;
        }
        for (view, (name, Gain(rgb))) in self.gains.iter().enumerate() {
            let line = format!("{} = {}", quoted(name), value(*rgb));
            line_with_comment(text, &line, &comment(known, |unknown| gain_channel(unknown, view)))?;
        }
        for (place, own) in self.scenes.iter().enumerate() {
            own.write_text(text, known, numbers.get(place).copied().flatten())?;
        }
        Ok(())
    }

    /// Write the file, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path, origin: Origin<'_>) -> Result<(), OutputError> {
        output::write(path, self.to_toml(origin).as_bytes())
    }

    /// Read a file for a scene of `form`; what it does not name is as in `base`.
    ///
    /// # Errors
    /// When it cannot be read, is no TOML, names something unknown, has values of the wrong kind or
    /// outside their bounds, or is of another form.
    pub fn read(path: &Path, form: Form, base: &Params) -> Result<Self, ParamsFileError> {
        Self::parsed(path, Some((form, base)))
    }

    /// Read a file for itself: it is of the form that it says, or corrected, and what it does not name is that form's
    /// default.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub fn read_alone(path: &Path) -> Result<Self, ParamsFileError> {
        Self::parsed(path, None)
    }

    fn parsed(path: &Path, scene: Option<(Form, &Params)>) -> Result<Self, ParamsFileError> {
        let error = |line, problem| ParamsFileError { path: path.to_owned(), line, problem };
        let text = files::read_to_string(path).map_err(|e| {
            error(
                None,
                format!("the parameters cannot be read: {e}. Name a params.toml that a fit has left."),
            )
        })?;
        parse(&text, scene).map_err(|Problem { place, problem }| {
            // What is said quotes the file, whose words may hold anything: one paragraph it stays.
            let problem = problem.replace(char::is_control, " ");
            let breaks = |at: usize| text.bytes().take(at).filter(|&byte| byte == b'\n').count();
            let line = place.map(|at| breaks(at.start) + 1);
            error(line, problem)
        })
    }
}

fn write_effects(text: &mut String, effects: Option<Effects>) -> std::fmt::Result {
    let Some(effects) = effects else { return Ok(()) };
    let names: Vec<&str> = effects.iter().map(Effect::name).collect();
    writeln!(text, "effects = {names:?}")
}

/// The names that terms by files of the scene's own declare: whoever does not know them passes over them.
fn write_terms(text: &mut String, effects: Effects) -> std::fmt::Result {
    let own = term::enabled(effects).filter(|term| term.is_by_file());
    let names = own.flat_map(|term| {
        let effects = term.effects.iter().map(|effect| effect.name());
        effects.chain(term.params.iter().map(|param| param.name()))
    });
    let names: Vec<&str> = names.collect();
    if names.is_empty() { Ok(()) } else { writeln!(text, "terms = {names:?}") }
}

impl SceneValues {
    /// The scene's tables; `numbers` are its own and its first view's among the unknowns.
    fn write_text(
        &self,
        text: &mut String,
        known: &[UnknownOutcome],
        numbers: Option<(usize, usize)>,
    ) -> std::fmt::Result {
        let name = quoted(&self.name);
        if self.effects.is_some() {
            writeln!(text, "\n[scenes.{name}]")?;
            write_effects(text, self.effects)?;
        }
        writeln!(text, "\n[scenes.{name}.params]")?;
        for (param, rgb) in &self.params {
            let own = |unknown: &Unknown| match unknown {
                Unknown::Own(scene, column) if numbers.is_some_and(|(number, _)| number == *scene) => {
                    param_channel(&Unknown::Param(*column), *param)
                }
                // Where one scene alone was fitted, and others were held out.
                Unknown::Param(_) if numbers.is_some() => param_channel(unknown, *param),
                _ => None,
            };
            let line = format!("{} = {}", key(*param), value(*rgb));
            line_with_comment(text, &line, &comment(known, own))?;
        }
        writeln!(text, "\n[scenes.{name}.gains]")?;
        for (view, (name, Gain(rgb))) in self.gains.iter().enumerate() {
            let line = format!("{} = {}", quoted(name), value(*rgb));
            let of_view = |unknown: &Unknown| gain_channel(unknown, numbers?.1 + view);
            line_with_comment(text, &line, &comment(known, of_view))?;
        }
        Ok(())
    }
}

pub(crate) fn value(rgb: [f64; 3]) -> String {
    // `{:?}` writes the shortest decimal that reads back to the bit, and always as a float.
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] { format!("{:?}", rgb[0]) } else { format!("{rgb:?}") }
}

/// A parameter's name as a key: quoted where it has dots.
fn key(param: Param) -> String {
    if param.name().contains('.') { quoted(param.name()) } else { param.name().to_owned() }
}

/// A basic string: JSON's escapes are TOML's too, but for DEL, which JSON leaves bare.
pub(crate) fn quoted(name: &str) -> String {
    serde_json::Value::from(name).to_string().replace('\u{7f}', "\\u007f")
}

fn line_with_comment(text: &mut String, line: &str, comment: &str) -> std::fmt::Result {
    if comment.is_empty() { writeln!(text, "{line}") } else { writeln!(text, "{line:<40} # {comment}") }
}

/// The channel of `param` that an unknown moves; 0 for all of them.
fn param_channel(unknown: &Unknown, param: Param) -> Option<usize> {
    match unknown {
        Unknown::Param(column) if column.param == param => Some(first(column.channels)),
        _ => None,
    }
}

/// The channel of a view's gain that an unknown moves.
fn gain_channel(unknown: &Unknown, view: usize) -> Option<usize> {
    match unknown {
        Unknown::Gain(of, channels) if *of == view => Some(first(*channels)),
        _ => None,
    }
}

/// The first channel that is moved.
const fn first(channels: Channels) -> usize {
    match channels {
        Channels::Tied => 0,
        Channels::One(c) => c,
    }
}

/// What is known of the unknowns that `channel` picks, in the order of channels.
fn comment(known: &[UnknownOutcome], channel: impl Fn(&Unknown) -> Option<usize>) -> String {
    let mut picked: Vec<_> = known.iter().filter_map(|u| Some((channel(&u.unknown)?, u))).collect();
    picked.sort_by_key(|&(channel, _)| channel);
    let words = picked.iter().map(|(_, u)| match u.std_error {
        _ if u.at_bound => "at its bound".to_owned(),
        _ if !u.identifiable => "not determined by the images".to_owned(),
        Some(error) => match u.noise_error.filter(|noise| error > 1.05 * noise) {
            Some(noise) => format!("+- {error:.2e} (noise_error {noise:.2e})"),
            None => format!("+- {error:.2e}"),
        },
        None => "of unknown error".to_owned(),
    });
    words.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, form: Form) -> Result<ParamsFile, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("params.toml");
        std::fs::write(&path, text).unwrap();
        ParamsFile::read(&path, form, &Params::defaults(form)).map_err(|e| e.to_string())
    }

    #[test]
    fn what_is_written_reads_back_to_the_bit() {
        for form in Form::ALL {
            let mut params = Params::defaults(form);
            for (i, param) in Param::built_in().enumerate() {
                // Values with long decimals, within all bounds.
                params.set(
                    param,
                    1.0 - 1.0 / (3.0 + i as f64) * if param == Param::SpecularLobe { 0.0 } else { 1.0 },
                );
            }
            params.set_rgb(Param::Hilite, [0.1 + 0.2, 1e-17, 3e8]);
            let gains = vec![
                ("front \"left\"".to_owned(), 0.7.into()),
                ("b\nc\u{7f}\u{1}".to_owned(), Gain([1.0 / 3.0, 1.0, 1e-3])),
            ];
            let effects = Some(Effects::SURFACE);
            let loss = Some(Loss::Huber);
            let file = ParamsFile { form, effects, loss, params, gains, scenes: Vec::new() };
            let set = ["hilite=1,2,3".parse().unwrap()];
            let scene = Path::new("a\nform = 1");
            let text = file.to_toml(Origin { scene, outcome: None, set: &set, free: &[], numbers: &[] });
            assert_eq!(read(&text, form).unwrap(), file, "{text}");
            assert!(text.contains("\n# Set on the command line before the fit: hilite=1,2,3.\n"), "{text}");
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("params.toml");
            std::fs::write(&path, &text).unwrap();
            assert_eq!(ParamsFile::read_alone(&path).unwrap(), file, "{text}");
        }
    }

    #[test]
    fn what_scenes_have_of_their_own_reads_back_and_is_found_by_their_names() {
        let form = Form::Corrected;
        let own = |name: &str, turn: f64, gain: f64| SceneValues {
            name: name.to_owned(),
            effects: (gain < 1.0).then_some(Effects::SURFACE.with(Effect::KeyLight)),
            params: vec![(Param::EnvironmentRotation, [turn; 3]), (Param::KeyColor, [0.1, 0.2, 0.3])],
            gains: vec![("front".to_owned(), gain.into())],
        };
        let mut params = Params::defaults(form);
        params.set(Param::RimExponent, 3.3);
        let scenes = vec![own("a b", 12.5, 1.0), own("noon", -1.0 / 3.0, 0.7)];
        let (effects, loss, gains) = (Some(Effects::SURFACE), Some(Loss::L2), Vec::new());
        let file = ParamsFile { form, effects, loss, params, gains, scenes };
        let scene = Path::new("noon.toml");
        let text = file.to_toml(Origin { scene, outcome: None, set: &[], free: &[], numbers: &[] });
        assert_eq!(read(&text, form).unwrap(), file, "{text}");
        // The skin's alone stand for all.
        let shared = text.split("[scenes.").next().unwrap();
        assert!(shared.contains("rim_exponent") && !shared.contains("environment_rotation"), "{text}");
        let turn = |path: &str| {
            let file = read(&text, form).unwrap().of_scene(Path::new(path));
            (
                file.params.scalar(Param::EnvironmentRotation),
                file.gains.first().and_then(|(_, gain)| gain.scalar()),
            )
        };
        assert_eq!(turn("/d/noon.toml"), (-1.0 / 3.0, Some(0.7)));
        assert_eq!(turn("/noon/scene.toml"), (-1.0 / 3.0, Some(0.7)));
        assert_eq!(turn("/run/scenes/a b.toml"), (12.5, Some(1.0)));
        assert_eq!(turn("/d/dusk.toml"), (0.0, None));
        let effects = |path: &str| read(&text, form).unwrap().of_scene(Path::new(path)).effects;
        assert_eq!(effects("/d/noon.toml"), Some(Effects::SURFACE.with(Effect::KeyLight)));
        assert_eq!(
            (effects("/d/a b.toml"), effects("/d/dusk.toml")),
            (Some(Effects::SURFACE), Some(Effects::SURFACE))
        );
    }

    #[test]
    fn what_a_file_does_not_name_keeps_its_value() {
        let file = read("[params]\nrim_exponent = 3", Form::Corrected).unwrap();
        let mut expected = Params::defaults(Form::Corrected);
        expected.set(Param::RimExponent, 3.0);
        assert_eq!((file.params, file.loss, file.gains), (expected, None, vec![]));
    }

    #[test]
    fn what_is_wrong_is_refused_with_its_line() {
        #[rustfmt::skip]
        let cases = [
            ("[params]\nhilight = 1.0", "line 2", "unknown parameter `hilight`"),
            ("[params]\n\nocclusion = 1.5", "line 3", "outside its bounds 0 to 1"),
            ("[params]\nhilite = [0.1, -0.1, 0.1]", "line 2", "outside its bounds"),
            ("[params]\nhilite = [0.1, 0.1]", "line 2", "[r, g, b]"),
            ("[params]\nrim_exponent = [1.0, 1.0, 1.0]", "line 2", "one number"),
            ("[params]\nhilite = nan", "line 2", "finite"),
            ("[params]\nrim_weight = inf", "line 2", "finite"),
            ("[params]\nrim_weight = \"1\"", "line 2", "number"),
            ("form = \"listing\"", "line 1", "form `listing`, but the scene's form is `corrected`"),
            ("form = \"printed\"", "line 1", "unknown form"),
            ("form = 1", "line 1", "wrong kind"),
            ("\nloss = \"l3\"", "line 2", "unknown loss"),
            ("colour = 1", "line 1", "unknown key `colour`"),
            ("[params]\nhilite = 1\nhilite = 2", "line 3", "not TOML"),
            ("[gains]\nfront = 0.0", "line 2", "outside its bounds"),
            ("[gains]\nfront = [1.0, 0.0, 1.0]", "line 2", "outside its bounds"),
            ("[gains]\nfront = [1.0, 1.0]", "line 2", "front takes a number or three: [r, g, b]"),
            ("params = 3", "line 1", "wrong kind"),
            ("[scenes]\nnoon = 3", "line 2", "wrong kind"),
            ("[scenes.noon]\nparam = 3", "line 2", "unknown key `param`"),
            ("[scenes.noon.params]\nhilite = 0.5", "line 2", "hilite is the skin's"),
            ("[scenes.noon.gains]\nfront = 0.0", "line 2", "outside its bounds"),
        ];
        for (text, line, what) in cases {
            let error = read(text, Form::Corrected).unwrap_err();
            assert!(error.contains(line) && error.contains(what), "{text}: {error}");
        }
        let missing = Path::new("no/such/params.toml");
        let error =
            ParamsFile::read(missing, Form::Corrected, &Params::defaults(Form::Corrected)).unwrap_err();
        assert!(error.to_string().contains("no/such/params.toml: the parameters cannot be read"));
    }
}

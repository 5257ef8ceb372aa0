//! The terms that a scene brings with it: files of shader rules, made known to the planner.

use std::path::Path;

use toml::Spanned;

use super::error::{SceneError, read_bytes};
use super::file::{FamilyTable, ModelTable, SceneFile, Source, TermValue};
use super::lit::Lights;
use crate::model::registry::leaked;
use crate::shader::term::{Term, library, register, stamped};

/// Rules are short; more is another kind of file.
const MOST_BYTES: u64 = 1 << 20;

/// Register the terms that a scene file names, its lights' first, and read no more of it: after that its effects and
/// parameters have names.
///
/// # Errors
/// When the scene file or one of its terms cannot be read.
pub fn register_terms(path: &Path) -> Result<Vec<&'static Term>, SceneError> {
    let source = Source::read(path)?;
    let file: SceneFile = source.parse()?;
    library::register_all();
    let mut all = Lights::of_file(&source, &file)?.terms;
    all.extend(terms(&source, &file.model, path.parent().unwrap_or(Path::new("")))?);
    Ok(all)
}

/// The terms of the `[model]` table; paths are relative to `folder`.
pub(super) fn terms(
    source: &Source,
    model: &ModelTable,
    folder: &Path,
) -> Result<Vec<&'static Term>, SceneError> {
    let mut terms = Vec::new();
    for value in &model.terms {
        match value.get_ref() {
            TermValue::Alone(path) => terms.push(read(&folder.join(path), None)?),
            TermValue::Family(family) => terms.extend(members(source, value, family, folder)?),
        }
    }
    Ok(terms)
}

/// A file's terms, one a name.
fn members(
    source: &Source,
    value: &Spanned<TermValue>,
    FamilyTable { file, names }: &FamilyTable,
    folder: &Path,
) -> Result<Vec<&'static Term>, SceneError> {
    let refused = |wrong: String, remedy: &str| Err(source.error(value, wrong, remedy));
    if names.is_empty() {
        return refused("names nobody".to_owned(), "Give `names` one name or more, or leave the file out");
    }
    for (i, name) in names.iter().enumerate() {
        let word = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit();
        if name.is_empty() || !name.split('_').all(|part| !part.is_empty() && part.bytes().all(word)) {
            let remedy =
                "Use lower-case letters, digits and single `_`: it becomes a part of parameters' names";
            return refused(format!("`{name}` is no name"), remedy);
        }
        if names[..i].contains(name) {
            return refused(format!("there are two of the name `{name}`"), "Give each a name of its own");
        }
    }
    names.iter().map(|name| read(&folder.join(file), Some(name))).collect()
}

/// The term of a file; of a family's file, that of one member.
fn read(path: &Path, member: Option<&str>) -> Result<&'static Term, SceneError> {
    let text = String::from_utf8(read_bytes(path, MOST_BYTES)?)
        .map_err(|_| SceneError::new(path, "is not text in UTF-8", "Name a file of shader rules in WGSL"))?;
    let refused = |wrong: &str, remedy: &str| Err(SceneError::new(path, wrong, remedy));
    let text = match (stamped(&text, member.unwrap_or_default()), member) {
        (Some(_), None) => {
            let remedy = "Name them in the scene file: { file = \"...\", names = [\"...\"] }";
            return refused(
                "declares a family (NAME stands for its members), but no member has a name",
                remedy,
            );
        }
        (None, Some(_)) => {
            let remedy = "Write NAME where the names of its parameters, quantities and functions differ, or name the \
                          file alone";
            return refused("is given several names, but is no family: NAME does not stand in it", remedy);
        }
        (stamped, _) => stamped.unwrap_or(text),
    };
    let name = path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
    let name = member.map_or_else(|| name.to_string(), |member| format!("{name}_{member}"));
    register(leaked(&name), &text).map_err(|error| {
        let place = format!("line {}", error.line);
        SceneError::new(path, error.problem.to_string(), error.problem.remedy()).at(place)
    })
}

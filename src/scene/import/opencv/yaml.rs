//! The YAML of `FileStorage` and of ROS: as much of it as those write.
//!
//! Lines of `name: value`, and below a name without a value, further in, such lines again. A value is a word, a list in
//! brackets that may go on over lines, or below its name a line `- number` each. What stands deeper, or in another
//! way, is passed over: a file holds more than its calibration. `%YAML:1.0` is no YAML (a directive has a space), and its
//! tags are OpenCV's own, so that crates for YAML 1.2 would have to be fed a changed text.

use std::path::Path;

use super::super::damaged;
use super::entries::Entries;
use crate::error::SceneError;

/// Where a reader is among names.
#[derive(Default)]
struct Place {
    /// The last name at the left border.
    top: String,
    /// How far the first name below it stands in.
    inner: Option<usize>,
    /// The name whose list of lines goes on, and what of it there is.
    listed: Option<(String, usize, String)>,
}

pub(super) fn entries<'a>(path: &'a Path, text: &str) -> Result<Entries<'a>, SceneError> {
    let mut entries = Entries::new(path);
    let mut place = Place::default();
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, uncommented(line)));
    while let Some((number, line)) = lines.next() {
        let content = line.trim();
        if content.is_empty() || content.starts_with('%') || content == "---" || content == "..." {
            continue;
        }
        if let Some(item) = content.strip_prefix('-').filter(|item| item.starts_with(' ')) {
            if let Some((_, _, items)) = &mut place.listed {
                items.push_str(item);
                items.push(' ');
            }
            continue;
        }
        place.finish(&mut entries);
        let indent = line.len() - line.trim_start().len();
        let named = named(content);
        let Some((name, value)) = named.and_then(|(name, value)| Some((place.name(indent, name)?, value)))
        else {
            continue;
        };
        let mut value = untagged(value).to_owned();
        while value.starts_with('[') && !value.contains(']') {
            let Some((_, more)) = lines.next() else {
                return Err(damaged(path, format!("line {number}, {name}"), "has a list without an end"));
            };
            value.push(' ');
            value.push_str(more.trim());
        }
        match value.is_empty() {
            true => place.listed = Some((name, number, String::new())),
            false => entries.keep(name, number, &value),
        }
    }
    place.finish(&mut entries);
    Ok(entries)
}

impl Place {
    /// The whole name of one that stands so far in; none where it is deeper than names are kept.
    fn name(&mut self, indent: usize, name: &str) -> Option<String> {
        if indent == 0 {
            self.top = name.to_owned();
            self.inner = None;
            return Some(self.top.clone());
        }
        (indent <= *self.inner.get_or_insert(indent)).then(|| format!("{}.{name}", self.top))
    }

    /// Keep the list of lines that has come to its end.
    fn finish(&mut self, entries: &mut Entries<'_>) {
        if let Some((name, line, items)) = self.listed.take().filter(|(_, _, items)| !items.is_empty()) {
            entries.keep(name, line, &items);
        }
    }
}

/// A value without the tag that says what it is, such as `!!opencv-matrix`.
fn untagged(value: &str) -> &str {
    match value.strip_prefix("!!") {
        Some(tagged) => tagged.split_once(' ').map_or("", |(_, value)| value.trim()),
        None => value,
    }
}

/// A line without what is behind its #.
fn uncommented(line: &str) -> &str {
    let behind =
        line.match_indices('#').find(|(at, _)| *at == 0 || line[..*at].ends_with(char::is_whitespace));
    behind.map_or(line, |(at, _)| &line[..at])
}

/// Name and value about the first colon that a space or the line's end follows.
fn named(content: &str) -> Option<(&str, &str)> {
    let (at, _) = content.match_indices(':').find(|(at, _)| {
        let behind = &content[at + 1..];
        behind.is_empty() || behind.starts_with(char::is_whitespace)
    })?;
    let name = content[..at].trim_end().trim_matches(['"', '\'']);
    (!name.is_empty()).then(|| (name, content[at + 1..].trim()))
}

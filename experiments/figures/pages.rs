//! How a page quotes its raw file, and how what it quotes is brought up to date.
//!
//! A raw file is JSON beside the page. The page quotes it in two ways:
//!
//! - **in a sentence, by a link** whose text is the figure: `[27.7](results.json#scenes.forest.psnr)`. The page shows
//!   as many digits as it likes, the raw file has them all.
//! - **in a table, by rows between two comments.** The first comment says how a row is made, with a name of the raw
//!   file in each pair of braces; the table's two head lines are the page's own:
//!
//! ```text
//! <!-- figures: results.json#scenes | {name} | {loss:4} | {psnr:.2} dB | -->
//! | scene | loss | score |
//! | --- | --- | --- |
//! | forest | 0.01665 | 27.73 dB |
//! <!-- end -->
//! ```
//!
//! `{x}` shows `x` as it stands, `{x:4}` four significant digits, `{x:.2}` two decimals, `{x:+.1}` its sign too.
//! A name leads from key to key by dots; in a list, to the entry with that `name` or number. What is no letter and no
//! digit in a key may be written `_`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

/// What a page says of a figure, and what its raw file says.
pub(crate) type Result<T> = std::result::Result<T, String>;

/// The text of `page` with each quoted figure as its raw file has it.
///
/// # Errors
/// When a raw file is missing or has no such figure, or a comment is not closed.
pub(crate) fn filled(page: &Path, text: &str) -> Result<String> {
    let mut raw = RawFiles { folder: page.parent().unwrap_or(Path::new("")), read: BTreeMap::new() };
    let with_rows = rows(&mut raw, text)?;
    links(&mut raw, &with_rows)
}

/// `text` without what it quotes from raw files: the page's own words are left.
///
/// # Errors
/// When a comment is not closed.
pub(crate) fn without_figures(text: &str) -> Result<String> {
    let mut left = String::new();
    let mut rest = text;
    while let Some(table) = Table::first(rest)? {
        left.push_str(&rest[..table.start]);
        left.push('\n');
        rest = &rest[table.end..];
    }
    left.push_str(rest);
    let mut own = String::new();
    let mut rest = left.as_str();
    while let Some(link) = Link::first(rest) {
        own.push_str(&rest[..link.start]);
        own.push_str("[quoted](");
        rest = &rest[link.end..];
    }
    own.push_str(rest);
    Ok(own)
}

/// The raw files that `text` quotes, as the page names them.
///
/// # Errors
/// When a comment is not closed.
pub(crate) fn quoted(text: &str) -> Result<Vec<String>> {
    let mut files = Vec::new();
    let mut rest = text;
    while let Some(table) = Table::first(rest)? {
        files.push(table.file.to_owned());
        rest = &rest[table.end..];
    }
    let mut rest = text;
    while let Some(link) = Link::first(rest) {
        files.push(link.file.to_owned());
        rest = &rest[link.end..];
    }
    files.sort();
    files.dedup();
    Ok(files)
}

/// The first thing that the head of a raw file lacks.
pub(crate) fn head_lacks(raw: &Value) -> Option<&'static str> {
    let there = |value: &Value| match value {
        Value::String(words) => !words.is_empty(),
        Value::Object(entries) => !entries.is_empty(),
        _ => false,
    };
    ["command", "commit", "date", "machine"].into_iter().find(|key| !there(&raw["head"][key]))
}

/// The raw files beside a page, each read once.
struct RawFiles<'p> {
    folder: &'p Path,
    read: BTreeMap<PathBuf, Value>,
}

impl RawFiles<'_> {
    fn figure(&mut self, file: &str, name: &str) -> Result<Value> {
        let path = self.folder.join(file);
        if !self.read.contains_key(&path) {
            let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            let value = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
            self.read.insert(path.clone(), value);
        }
        let found = at(&self.read[&path], name).cloned();
        found.ok_or_else(|| format!("{}: there is no `{name}`", path.display()))
    }
}

/// The value that `name` leads to.
fn at<'v>(mut value: &'v Value, name: &str) -> Option<&'v Value> {
    for key in name.split('.').filter(|key| !key.is_empty()) {
        value = match value {
            Value::Object(entries) => {
                entries.get(key).or_else(|| Some(entries.iter().find(|(k, _)| plain(k) == key)?.1))?
            }
            Value::Array(entries) => match key.parse::<usize>() {
                Ok(index) => entries.get(index)?,
                Err(_) => entries.iter().find(|e| e["name"].as_str().is_some_and(|n| plain(n) == key))?,
            },
            _ => return None,
        };
    }
    Some(value)
}

/// A key as links write it.
fn plain(key: &str) -> String {
    key.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

/// A figure in a sentence.
struct Link<'t> {
    start: usize,
    end: usize,
    words: &'t str,
    file: &'t str,
    name: &'t str,
}

impl<'t> Link<'t> {
    /// The first one of `text`.
    fn first(text: &'t str) -> Option<Self> {
        let mut from = 0;
        while let Some(middle) = text[from..].find("](").map(|i| from + i) {
            from = middle + 2;
            let (start, end) = (text[..middle].rfind('[')?, middle + 2 + text[from..].find(')')?);
            if let Some((file, name)) = text[from..end].split_once('#')
                && Path::new(file).extension().is_some_and(|ending| ending == "json")
            {
                return Some(Self { start, end: end + 1, words: &text[start + 1..middle], file, name });
            }
        }
        None
    }
}

fn links(raw: &mut RawFiles<'_>, text: &str) -> Result<String> {
    let (mut made, mut rest) = (String::new(), text);
    while let Some(link) = Link::first(rest) {
        let value = raw.figure(link.file, link.name)?;
        let shown = match value.as_f64() {
            Some(number) => Style::of(link.words).show(number),
            None => {
                value.as_str().ok_or_else(|| format!("{}#{} is no figure", link.file, link.name))?.to_owned()
            }
        };
        made.push_str(&rest[..link.start]);
        made.push_str(&format!("[{shown}]({}#{})", link.file, link.name));
        rest = &rest[link.end..];
    }
    Ok(made + rest)
}

const OPENS: &str = "<!-- figures: ";
const CLOSES: &str = "<!-- end -->";

/// A table whose rows are figures.
struct Table<'t> {
    start: usize,
    end: usize,
    /// The opening comment and the table's two head lines.
    head: &'t str,
    file: &'t str,
    name: &'t str,
    row: String,
}

impl<'t> Table<'t> {
    /// The first one of `text`.
    fn first(text: &'t str) -> Result<Option<Self>> {
        let Some(start) = text.find(OPENS) else { return Ok(None) };
        let line = text[start..].lines().next().unwrap_or_default();
        let wrong = || format!("`{line}` wants: file.json#name | cells | --> two head lines {CLOSES}");
        let body = start + OPENS.len();
        let after = body + text[body..].find("-->\n").ok_or_else(wrong)?;
        let (place, row) = text[body..after].split_once('|').ok_or_else(wrong)?;
        let (file, name) = place.trim().split_once('#').ok_or_else(wrong)?;
        let mut head = after + "-->\n".len();
        for _ in 0..2 {
            head += text[head..].find('\n').ok_or_else(wrong)? + 1;
        }
        let close = head + text[head..].find(CLOSES).ok_or_else(wrong)?;
        let row = format!("|{row}").split_whitespace().collect::<Vec<_>>().join(" ");
        Ok(Some(Self { start, end: close + CLOSES.len(), head: &text[start..head], file, name, row }))
    }
}

fn rows(raw: &mut RawFiles<'_>, text: &str) -> Result<String> {
    let (mut made, mut rest) = (String::new(), text);
    while let Some(table) = Table::first(rest)? {
        made.push_str(&rest[..table.start]);
        made.push_str(table.head);
        let entries = raw.figure(table.file, table.name)?;
        for entry in entries.as_array().ok_or_else(|| format!("{}#{} is no list", table.file, table.name))? {
            made.push_str(&row(&table.row, entry)?);
            made.push('\n');
        }
        made.push_str(CLOSES);
        rest = &rest[table.end..];
    }
    Ok(made + rest)
}

/// A row, with what stands in braces filled in.
fn row(cells: &str, entry: &Value) -> Result<String> {
    let (mut made, mut rest) = (String::new(), cells);
    while let Some((before, after)) = rest.split_once('{') {
        let (name, after) = after.split_once('}').ok_or_else(|| format!("a brace is not closed: {cells}"))?;
        let (name, style) = name.split_once(':').unwrap_or((name, ""));
        let value = at(entry, name).ok_or_else(|| format!("there is no `{name}` in {entry}"))?;
        made.push_str(before);
        made.push_str(&match (value, value.as_f64()) {
            (Value::Null, _) => String::new(),
            (Value::String(words), _) => words.clone(),
            (_, Some(number)) if style.is_empty() => Style::of(&number.to_string()).show(number),
            (_, Some(number)) => Style::named(style)?.show(number),
            _ => return Err(format!("`{name}` is no figure: {value}")),
        });
        rest = after;
    }
    Ok(made + rest)
}

/// How a number is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Style {
    digits: Digits,
    /// Whether a positive number has its sign.
    sign: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Digits {
    /// Digits after the point.
    Decimals(usize),
    /// Significant digits; by powers of ten where the number is very small or very large.
    Significant(usize),
}

impl Style {
    /// The style that `shown` is in.
    fn of(shown: &str) -> Self {
        let sign = shown.starts_with('+');
        let mantissa = shown.split('·').next().unwrap_or_default().trim_start_matches(['+', '-']);
        let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        let below_one = mantissa.starts_with("0.");
        let figures = mantissa.chars().filter(char::is_ascii_digit).count();
        let significant =
            mantissa.trim_start_matches(['0', '.']).chars().filter(char::is_ascii_digit).count();
        let digits = match (shown.contains('·'), below_one && significant > 0) {
            (true, _) => Digits::Significant(figures),
            (_, true) => Digits::Significant(significant),
            _ => Digits::Decimals(decimals),
        };
        Self { digits, sign }
    }

    /// The style of a table's cell.
    fn named(style: &str) -> Result<Self> {
        let (sign, digits) = style.strip_prefix('+').map_or((false, style), |rest| (true, rest));
        let count = |digits: &str| digits.parse().map_err(|_| format!("`{style}` is no style"));
        let digits = match digits.strip_prefix('.') {
            Some(decimals) => Digits::Decimals(count(decimals)?),
            None => Digits::Significant(count(digits)?),
        };
        Ok(Self { digits, sign })
    }

    fn show(self, number: f64) -> String {
        let text = match self.digits {
            Digits::Decimals(decimals) => thousands(&format!("{number:.decimals$}")),
            Digits::Significant(_) if number == 0.0 => "0".to_owned(),
            Digits::Significant(digits) => significant(number, digits.max(1)),
        };
        // What rounds to nothing has no sign.
        let nothing = !text.contains(|c: char| ('1'..='9').contains(&c));
        let text = if nothing { text.trim_start_matches('-').to_owned() } else { text };
        if self.sign && !nothing && number > 0.0 { format!("+{text}") } else { text }
    }
}

/// `digits` significant digits of a number.
pub(crate) fn significant(number: f64, digits: usize) -> String {
    let scientific = format!("{number:.*e}", digits - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = exponent.parse().unwrap_or(0);
    if !(-4..=9).contains(&power) {
        let raised = exponent.chars().map(|c| match c {
            '-' => '⁻',
            _ => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c.to_digit(10).unwrap_or(0) as usize],
        });
        return format!("{mantissa}·10{}", raised.collect::<String>());
    }
    // Rounded to its digits first: 1,234 to two of them is 1,200.
    let rounded: f64 = scientific.parse().unwrap_or(number);
    let decimals = (digits as i32 - 1 - power).max(0) as usize;
    thousands(&format!("{rounded:.decimals$}"))
}

/// With commas between thousands, from 10,000 on.
fn thousands(number: &str) -> String {
    let (whole, decimals) = number.split_once('.').map_or((number, None), |(w, d)| (w, Some(d)));
    let (sign, whole) = whole.strip_prefix('-').map_or(("", whole), |whole| ("-", whole));
    let mut grouped = String::new();
    for (i, digit) in whole.chars().enumerate() {
        if whole.len() > 4 && i > 0 && (whole.len() - i) % 3 == 0 {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    let decimals = decimals.map_or(String::new(), |decimals| format!(".{decimals}"));
    format!("{sign}{grouped}{decimals}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_shown_with_the_digits_that_the_page_has() {
        for (shown, number, again) in [
            ("27.7", 28.349, "28.3"),
            ("0.0070", 0.006_951, "0.0070"),
            ("0.01665", 0.016_648_07, "0.01665"),
            ("2.3·10⁻¹⁵", 1.0699e-15, "1.1·10⁻¹⁵"),
            ("4·10⁻⁷", 3.6e-7, "4·10⁻⁷"),
            ("1,048,576", 65_536.0, "65,536"),
            ("9", 12.0, "12"),
            ("+935", 934.6, "+935"),
            ("-2.5", 2.71, "2.7"),
            ("0", 0.0, "0"),
        ] {
            let made = Style::of(shown).show(number);
            assert_eq!(made, again, "{shown}");
            assert_eq!(Style::of(&made).show(number), made, "filled once more, {shown} changes");
        }
    }

    #[test]
    fn cells_have_the_style_that_their_row_names() {
        let show = |style, number| Style::named(style).unwrap().show(number);
        assert_eq!(show("4", 0.016_648_07), "0.01665");
        assert_eq!(show("2", 0.000_012_3), "1.2·10⁻⁵");
        assert_eq!(show("2", 1234.0), "1200");
        assert_eq!(show(".1", 12_345.67), "12,345.7");
        assert_eq!(show("+.1", -0.04), "0.0");
        assert!(Style::named("x").is_err());
    }

    #[test]
    fn a_page_is_filled_from_the_file_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join("page.md");
        let raw = r#"{"fits": [{"name": "a b", "loss": 0.12345, "note": null}, {"name": "c", "loss": 2, "note": "x"}]}"#;
        std::fs::write(folder.path().join("raw.json"), raw).unwrap();
        let text = "It is [0.2](raw.json#fits.a_b.loss), see [there](other.md).\n\
                    <!-- figures: raw.json#fits\n| {name} | {loss:.2}{note} | -->\n| name | loss |\n| --- | --- |\n\
                    | old | 7 |\n<!-- end -->\nEnd.\n";
        let made = filled(&page, text).unwrap();
        assert!(made.contains("It is [0.1](raw.json#fits.a_b.loss), see [there](other.md)."), "{made}");
        assert!(made.contains("| --- | --- |\n| a b | 0.12 |\n| c | 2.00x |\n<!-- end -->\nEnd."), "{made}");
        assert_eq!(filled(&page, &made).unwrap(), made);
        assert_eq!(quoted(text).unwrap(), ["raw.json"]);
        let own = without_figures(&made).unwrap();
        assert!(!own.contains("0.1") && !own.contains("2.00") && own.contains("[there](other.md)"), "{own}");
        assert!(filled(&page, "[1](raw.json#fits.d)").unwrap_err().contains("there is no `fits.d`"));
        assert!(filled(&page, "<!-- figures: raw.json#fits | {name} | -->\n").is_err());
    }
}

//! What all pages share: one that needs nothing else, in light and dark, with or without scripts. Scripts
//! make tables sortable and wipe one picture over another; without them tables and pictures stay.

use std::fmt::Write as _;

use super::metrics::PSNR_OF_EQUALS;

/// A page: its head, a row of tiles, and sections.
#[derive(Clone, Debug, Default)]
pub struct Page<'a> {
    /// What kind of report, after the program's name.
    pub kind: &'a str,
    /// The heading; plain text.
    pub title: &'a str,
    /// The verdict under it, in HTML.
    pub lead: String,
    /// [`tile`]s.
    pub tiles: String,
    /// [`section`]s.
    pub main: String,
}

impl Page<'_> {
    /// The page's text.
    #[must_use]
    pub fn html(&self) -> String {
        filled(include_str!("page.html"), |key| match key {
            "kind" => escape(self.kind),
            "title" => escape(self.title),
            "style" => include_str!("page.css").to_owned(),
            "script" => include_str!("page.js").to_owned(),
            "lead" => self.lead.clone(),
            "tiles" => self.tiles.clone(),
            "main" => self.main.clone(),
            _ => String::new(),
        })
    }
}

/// A part of a page under its heading; `html` is its content.
#[must_use]
pub fn section(id: &str, heading: &str, html: &str) -> String {
    format!("<section id=\"{id}\"><h2>{}</h2>\n{html}</section>\n", escape(heading))
}

/// A number with its name and a remark (all HTML).
#[must_use]
pub fn tile(name: &str, value: &str, note: &str) -> String {
    format!("<div class=\"tile\"><span>{name}</span><b>{value}</b><small>{note}</small></div>")
}

/// Names with their texts, as a list; both plain text.
#[must_use]
pub fn facts(rows: &[(String, String)]) -> String {
    let row = |(name, text): &(String, String)| format!("<dt>{}</dt><dd>{}</dd>", escape(name), escape(text));
    format!("<dl>{}</dl>", rows.iter().map(row).collect::<String>())
}

/// A table that scripts let sort by a click on a heading.
#[derive(Clone, Debug, Default)]
pub struct Table {
    columns: Vec<Column>,
    rows: String,
}

/// A column of a [`Table`].
#[derive(Clone, Debug)]
struct Column {
    heading: String,
    /// What it means, shown when pointed at.
    meaning: String,
    numeric: bool,
}

/// A cell of a [`Table`].
#[derive(Clone, Debug)]
pub struct Cell {
    html: String,
    /// What it is sorted by; text by its letters, numbers that are not there last.
    sort: Option<f64>,
}

impl Cell {
    /// A cell of plain text.
    #[must_use]
    pub fn text(text: &str) -> Self {
        Self { html: escape(text), sort: None }
    }

    /// A cell of HTML, sorted by `value`.
    #[must_use]
    pub fn value(html: impl Into<String>, value: f64) -> Self {
        Self { html: html.into(), sort: value.is_finite().then_some(value) }
    }

    /// A score with `digits` decimals, where it is known.
    #[must_use]
    pub fn score(score: Option<f64>, digits: usize) -> Self {
        score.map_or_else(Self::none, |x| Self::value(format!("{x:.digits$}"), x))
    }

    /// A PSNR in dB, where it is known; of equal images it has no end.
    #[must_use]
    pub fn psnr(psnr: Option<f64>) -> Self {
        match psnr {
            Some(x) if x >= PSNR_OF_EQUALS => Self::value("equal", x),
            other => Self::score(other, 2),
        }
    }

    /// A number that is not known.
    #[must_use]
    pub fn none() -> Self {
        Self { html: "<span class=\"quiet\">–</span>".to_owned(), sort: None }
    }
}

impl Table {
    /// A table without rows; columns are headings with their meanings, the first of text and the others
    /// of numbers unless a heading ends in a full stop.
    #[must_use]
    pub fn new(columns: &[(&str, &str)]) -> Self {
        let column = |(i, (heading, meaning)): (usize, &(&str, &str))| Column {
            heading: heading.trim_end_matches('.').to_owned(),
            meaning: (*meaning).to_owned(),
            numeric: i > 0 && !heading.ends_with('.'),
        };
        Self { columns: columns.iter().enumerate().map(column).collect(), rows: String::new() }
    }

    /// Add a row: a heading and the other cells.
    pub fn row(&mut self, class: &str, cells: &[Cell]) {
        let _ = write!(
            self.rows,
            "<tr{}>",
            if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") }
        );
        for (i, (cell, column)) in cells.iter().zip(&self.columns).enumerate() {
            let tag = if i == 0 { "th scope=\"row\"" } else { "td" };
            let class = if column.numeric { " class=\"n\"" } else { "" };
            let sort = cell.sort.map_or_else(String::new, |value| format!(" data-sort=\"{value:e}\""));
            let _ = write!(self.rows, "<{tag}{class}{sort}>{}</{}>", cell.html, &tag[..2]);
        }
        self.rows += "</tr>\n";
    }

    /// The table's HTML, with the id that links and tests know it by.
    #[must_use]
    pub fn html(&self, id: &str) -> String {
        let heading = |column: &Column| {
            let class = if column.numeric { " class=\"n\"" } else { "" };
            format!(
                "<th scope=\"col\"{class} title=\"{}\">{}</th>",
                escape(&column.meaning),
                escape(&column.heading)
            )
        };
        let head: String = self.columns.iter().map(heading).collect();
        format!(
            "<div class=\"scroll\"><table class=\"params sortable\" id=\"{id}\"><thead><tr>{head}</tr></thead>\n\
             <tbody>{}</tbody></table></div>\n",
            self.rows
        )
    }
}

/// `template` with each `{{key}}` replaced, in one pass: what is filled in is not looked at again.
pub(super) fn filled(template: &str, fill: impl Fn(&str) -> String) -> String {
    let mut parts = template.split("{{");
    let mut page = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (key, text) = part.split_once("}}").unwrap_or(("", part));
        page += &fill(key);
        page += text;
    }
    page
}

/// `text` as HTML shows it, between tags and in attributes.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // Control characters are not allowed in HTML.
            c if c.is_control() && !c.is_ascii_whitespace() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_are_filled_once() {
        let fill = |key: &str| if key == "a" { "{{b}}".to_owned() } else { "!".to_owned() };
        assert_eq!(filled("x {{a}} y {{b}}", fill), "x {{b}} y !");
    }

    #[test]
    fn escaping_leaves_nothing_that_html_reads() {
        assert_eq!(escape("<a href=\"x\">'&\u{7}"), "&lt;a href=&quot;x&quot;&gt;&#39;&amp;\u{fffd}");
    }

    #[test]
    fn a_table_says_what_each_cell_is_sorted_by() {
        let mut table = Table::new(&[("left out", "what"), ("loss", "a number"), ("bakes.", "words")]);
        table.row("", &[Cell::text("a<b"), Cell::value("1.5", 1.5), Cell::text("hilite")]);
        table.row("full", &[Cell::text("none"), Cell::none(), Cell::value("x", f64::NAN)]);
        let html = table.html("t");
        assert!(html.contains(
            "<th scope=\"row\">a&lt;b</th><td class=\"n\" data-sort=\"1.5e0\">1.5</td><td>hilite</td>"
        ));
        // What is no finite number is sorted as none.
        assert_eq!(html.matches("data-sort").count(), 1, "{html}");
        assert!(html.contains("title=\"a number\">loss</th>") && html.contains("title=\"words\">bakes</th>"));
    }
}

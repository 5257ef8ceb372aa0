//! Citations of the shader rules as the reader of a printed shader finds them.

/// What rules cite as `MODEL 3` is a section of the page that describes the model.
const CITED: &str = "MODEL ";

/// `text` with its citations as somebody reads them who has the shader alone.
#[must_use]
pub fn cited(text: &str) -> String {
    let mut parts = text.split(CITED);
    let mut cited = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let number = |text: &str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let first = number(part);
        let second = part[first..].strip_prefix(" and ").map_or(0, number);
        cited += match (first, second) {
            (0, _) => CITED,
            (_, 0) => "docs/model.md section ",
            _ => "docs/model.md sections ",
        };
        cited += part;
    }
    cited
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_cited_by_the_page_that_has_them() {
        assert_eq!(cited("a (MODEL 3, corrected form)"), "a (docs/model.md section 3, corrected form)");
        assert_eq!(
            cited("MODEL 3 and 7; MODEL 12."),
            "docs/model.md sections 3 and 7; docs/model.md section 12."
        );
        assert_eq!(cited("a MODEL of x"), "a MODEL of x");
    }
}

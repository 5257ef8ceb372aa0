//! Numbers and findings in words.

use crate::fit::outcome::Ending;

/// `x` to `digits` significant digits: plain between 0.001 and 10^6, else times a power of ten.
#[must_use]
pub fn number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return if x.is_nan() {
            "–"
        } else if x > 0.0 {
            "∞"
        } else {
            "−∞"
        }
        .to_owned();
    }
    let scientific = format!("{x:.*e}", digits.saturating_sub(1));
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = exponent.parse().unwrap_or(0);
    let text = match power {
        _ if x == 0.0 => "0".to_owned(),
        -3..6 => format!("{x:.*}", usize::try_from(digits as i32 - 1 - power).unwrap_or(0)),
        _ => format!("{mantissa}×10{}", superscript(power)),
    };
    text.replace('-', "−")
}

fn superscript(power: i32) -> String {
    let raise = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        _ => char::from_u32('⁰' as u32 + (c as u32 - '0' as u32)).unwrap_or(c),
    };
    power.to_string().chars().map(raise).collect()
}

/// A value with as many decimals as its standard error deserves, and the error (two digits).
pub(super) fn with_error(value: f64, error: f64) -> (String, String) {
    let place = error.log10().floor();
    let decimals = (1.0 - place).clamp(0.0, 8.0);
    if !(error > 0.0 && place > -8.0 && value.abs() < 1e6) {
        return (number(value, 6), number(error, 2));
    }
    (format!("{value:.*}", decimals as usize).replace('-', "−"), format!("{error:.*}", decimals as usize))
}

/// Seconds, in the unit that reads best.
#[must_use]
pub fn seconds(s: f64) -> String {
    match s {
        _ if !s.is_finite() => "–".to_owned(),
        _ if s >= 120.0 => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor()),
        _ if s >= 0.9995 || s <= 0.0 => format!("{} s", number(s, 3)),
        _ if s >= 0.0005 => format!("{} ms", number(1e3 * s, 3)),
        _ => format!("{} µs", number(1e6 * s, 2)),
    }
}

/// A count with thin spaces between thousands.
#[must_use]
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let parted =
        digits.chars().enumerate().map(|(i, c)| match i > 0 && (digits.len() - i).is_multiple_of(3) {
            true => format!("\u{202f}{c}"),
            false => c.to_string(),
        });
    parted.collect()
}

/// `3 iterations`, `1 iteration`.
pub(super) fn counted(n: u64, thing: &str) -> String {
    let plural = match thing.strip_suffix("ss") {
        _ if n == 1 => thing.to_owned(),
        Some(_) => format!("{thing}es"),
        None => format!("{thing}s"),
    };
    format!("{} {plural}", count(n))
}

/// `a, b and c`.
pub(super) fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

/// How the fit ended, with a capital.
pub(super) fn ending(ending: Ending) -> String {
    capital(ending.words())
}

/// `words`, which begin with a letter of ASCII, with a capital.
pub(super) fn capital(words: &str) -> String {
    let (first, rest) = words.split_at(1);
    first.to_uppercase() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (x, digits, want) in [
            (0.0, 4, "0"),
            (0.712_345, 4, "0.7123"),
            (-12.5, 3, "−12.5"),
            (123_456.0, 4, "123456"),
            (0.000_012_3, 2, "1.2×10⁻⁵"),
            (-4.5e12, 2, "−4.5×10¹²"),
            (999.96, 4, "1000"),
            (f64::NEG_INFINITY, 3, "−∞"),
            (f64::NAN, 3, "–"),
        ] {
            assert_eq!(number(x, digits), want);
        }
        assert_eq!(with_error(0.712_345, 0.000_43), ("0.71235".to_owned(), "0.00043".to_owned()));
        assert_eq!(with_error(-31.7, 2.34), ("−31.7".to_owned(), "2.3".to_owned()));
        assert_eq!(with_error(5.0, 123.0), ("5".to_owned(), "123".to_owned()));
        assert_eq!(with_error(0.5, 0.0), ("0.500000".to_owned(), "0".to_owned()));
        assert_eq!((count(1_234_567), count(12)), ("1\u{202f}234\u{202f}567".to_owned(), "12".to_owned()));
        assert_eq!((counted(1, "pass"), counted(2, "pass")), ("1 pass".to_owned(), "2 passes".to_owned()));
        assert_eq!(seconds(0.0123), "12.3 ms");
        assert_eq!(seconds(754.0), "12 min 34 s");
        assert_eq!(list(&["a", "b", "c"].map(str::to_owned)), "a, b and c");
    }
}

//! Figures that stand in a page without a raw file: numbers with a unit of measure, decimals, and numbers times a power of
//! ten (a power alone is an order of magnitude, as tolerances are given); and the usual measures in words.

use std::path::Path;

use super::pages::without_figures;

/// Numbers with one of these behind them were measured somewhere, or are defined in [`DEFINITIONS`].
const UNITS: [&str; 28] = [
    "%", "°", "times", "dB", "million", "ns", "µs", "ms", "s", "second", "seconds", "minute", "minutes",
    "hour", "hours", "mm", "fps", "kB", "KB", "MB", "GB", "TB", "KiB", "MiB", "GiB", "MB/s", "GB/s", "TB/s",
];

/// Pages that are looked at otherwise, or whose numbers are ranges, defaults and limits of their own.
const REFERENCE: [(&str, &str); 5] = [
    ("CHANGELOG.md", "what was true of each version when it was made"),
    ("experiments/stability/README.md", "a test of its own compares its tables with its raw files"),
    ("docs/scene-files.md", "keys with their defaults and ranges"),
    ("docs/parameters.md", "the program's own table, which a test compares"),
    ("docs/model.md", "formulas, limits of hard cases"),
];

/// The figures of `page` (its path in the project) that no raw file gives: each with the words around it.
///
/// # Errors
/// When a comment is not closed, or words that are called a definition are no longer there.
pub(crate) fn strays(page: &Path, text: &str) -> Result<Vec<String>, String> {
    let name = page.to_string_lossy();
    if REFERENCE.iter().any(|(reference, _)| name == *reference) {
        return Ok(Vec::new());
    }
    let own = without_code(&without_figures(text)?);
    let mut found = Vec::new();
    // A unit in the next cell of a table is another column's; a definition may go over two lines.
    let mut own = own.replace('|', " | ").split_whitespace().collect::<Vec<_>>().join(" ");
    for (_, words, _) in DEFINITIONS.iter().filter(|(page, ..)| name == *page) {
        if !own.contains(words) {
            return Err(format!("`{words}` is called a definition, and is not there"));
        }
        own = own.replace(words, "");
    }
    let words: Vec<&str> = own.split(|c: char| c.is_whitespace() || "()[]/".contains(c)).collect();
    let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
    for (i, word) in words.iter().enumerate() {
        let next = words.get(i + 1).copied().unwrap_or_default();
        let after = words.get(i + 2).copied().unwrap_or_default();
        if measured(word, next) || measured_in_words([word, next, after]) {
            let around = &words[i.saturating_sub(4)..(i + 4).min(words.len())];
            found.push(around.join(" "));
        }
    }
    Ok(found)
}

/// Whether a word is a number with a unit, its own or the next word; a decimal; or a number times a power of ten.
fn measured(word: &str, next: &str) -> bool {
    let word = word.trim_start_matches(['-', '+', '±', '~', '<', '>', '*', '"']);
    let number = word.trim_end_matches(|c: char| !c.is_ascii_digit());
    if !word.starts_with(|c: char| c.is_ascii_digit()) {
        return false;
    }
    if word.contains("·10") {
        return true;
    }
    let decimal = number.split_once('.').is_some_and(|(whole, part)| {
        [whole, part].iter().all(|digits| !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit()))
    });
    let ends = |c: char| ".,;:*\"%×".contains(c);
    if decimal && word[number.len()..].chars().all(ends) {
        return true;
    }
    let is_number = number.chars().all(|c| c.is_ascii_digit() || ".,e-".contains(c));
    let unit = |word: &str| UNITS.contains(&word.trim_end_matches(['.', ',', ';', ':', '*', '"']));
    let behind = &word[number.len()..];
    is_number && (unit(behind) || (behind.is_empty() && unit(next)))
}

/// Numbers that "times as", "thirds", "minutes" and the like stand behind.
const COUNTS: [&str; 18] = [
    "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve", "fifteen",
    "sixteen", "twenty", "thirty", "forty", "fifty", "hundred",
];
/// Parts of a whole.
const PARTS: [&str; 18] = [
    "third",
    "quarter",
    "fifth",
    "sixth",
    "seventh",
    "eighth",
    "ninth",
    "tenth",
    "twelfth",
    "sixteenth",
    "twentieth",
    "thirtieth",
    "fortieth",
    "fiftieth",
    "sixtieth",
    "hundredth",
    "thousandth",
    "millionth",
];

/// Whether words begin one of the usual measures: "three times as", "ten times faster", "twice as", "half the time", "half of",
/// "a third", "two thirds", "six minutes", "half a second".
fn measured_in_words(words: [&str; 3]) -> bool {
    let words =
        words.map(|word| word.trim_matches(|c: char| !c.is_alphanumeric() && c != '-').to_lowercase());
    match words.each_ref().map(String::as_str) {
        [count, "times", "as" | "faster" | "slower" | "less" | "more"] => COUNTS.contains(&count),
        [count, "thirds" | "quarters", _] => COUNTS.contains(&count),
        ["twice" | "half", "as", _] | ["half", "of", _] | ["half", "the", "time" | "cost"] => true,
        [count, "second" | "seconds" | "minutes" | "hours", _] => COUNTS.contains(&count),
        ["half", "a" | "an", "second" | "minute" | "hour"] => true,
        ["a", part, _] => PARTS.contains(&part),
        _ => false,
    }
}

/// Without code in fences, in backquotes and indented, and without comments.
fn without_code(text: &str) -> String {
    let text: String = text.split("```").step_by(2).collect();
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with("    ")).collect();
    let text: String = lines.join("\n").split('`').step_by(2).collect();
    let mut parts = text.split("<!--");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |own, part| own + part.split_once("-->").map_or("", |(_, after)| after))
}

/// Numbers with a unit, and measures in words, that are no measurement: the page, its words, and why.
pub(crate) const DEFINITIONS: &[(&str, &str, &str)] = &[
    ("docs/gpu-engine.md", "beyond 8 million", "a limit of the program"),
    ("docs/gpu-engine.md", "from 2 million samples a thread", "a threshold of the program"),
    ("docs/maps.md", "allows 128 MiB", "WebGPU's limit"),
    ("docs/rendering.md", "more than 16 million samples", "a limit of the program"),
    ("experiments/race/README.md", "with 2% noise", "what was added"),
    ("docs/studies.md", "more than 3 s is run once", "a rule of the program"),
    ("README.md", "Rust 1.95", "a version"),
    ("README.md", "Apache 2.0", "a version"),
    ("docs/accuracy.md", "within 0.0002 of the integrals", "a bound that tests hold"),
    ("docs/accuracy.md", "every roughness from 0.05 on", "where the bound holds"),
    ("docs/accuracy.md", "within 0.0005 from f0 = 0.002 on", "a bound that tests hold, and where"),
    ("docs/accuracy.md", "A pixel is 0.018 units", "of the scene"),
    ("docs/accuracy.md", "over 1.5 pixels", "the path tracer's pixel filter"),
    ("docs/accuracy.md", "5 beyond 2, and 0.3 beyond 3", "the normal distribution"),
    ("docs/dependencies.md", "glTF 2.0", "a version"),
    ("docs/dependencies.md", "(0.22.1: ", "a version"),
    ("docs/rendering.md", "Vulkan specification (1.3,", "a version"),
    ("docs/rendering.md", "below 0.003, 0.0015 and 0.001", "bounds that a test holds"),
    ("docs/results.md", "CC-BY 3.0", "a licence"),
    ("docs/results.md", "(it is 0.52)", "the target's material"),
    ("docs/results.md", "(0.056)", "the target's material"),
    ("docs/shaders.md", "OpenGL 4.3, OpenGL ES 3.1", "versions"),
    ("docs/accuracy.md", "to four times as much", "a bound that tests hold"),
    ("docs/accuracy.md", "is off by a twentieth", "the mistake that is made"),
    ("docs/gpu-engine.md", "less than a thirtieth of their standard errors", "a rule of the solvers"),
    ("docs/gpu-engine.md", "or a twentieth of a standard error", "a bound that a test holds"),
    ("docs/page.md", "slices of a fifth of a second", "a rule of the program"),
    ("docs/panorama.md", "contradict by more than a twentieth", "a rule of the program"),
    ("docs/panorama.md", "to a hundredth of it", "a bound that a test holds"),
    ("docs/report.md", "less than a millionth", "a rule of the program"),
    ("docs/studies.md", "less than a millionth of the loss", "a rule of the program"),
    ("docs/studies.md", "to a sixteenth, then all", "what is varied"),
    ("docs/studies.md", "less than a sixteenth of a step", "a rule of the program"),
    ("docs/window.md", "In ten minutes", "a heading"),
    ("experiments/animated/README.md", "for all but a twentieth", "what is measured"),
    ("experiments/race/README.md", "within a thousandth of the truth", "the race's criterion"),
    ("experiments/race/README.md", "below a millionth (noisy)", "the race's criterion"),
    ("docs/building.md", "half as many again", "a third beside two"),
    ("docs/gpu-engine.md", "half as much is tried", "a rule of the program"),
    ("docs/panorama.md", "more than a tenth is clipped", "a rule of the program"),
    ("docs/python.md", "beside it in a third", "the number of a virtual environment"),
    ("docs/rendering.md", "a third of the maps' memory again", "1/4 + 1/16 + 1/64 + ..."),
    (
        "docs/results.md",
        "from a quarter of the way between shadow and light to three quarters",
        "what is measured",
    ),
    ("docs/shaders.md", "counts a quarter of a fragment", "a default of the program"),
    ("docs/studies.md", "from eight times as long to a quarter", "what is varied"),
    ("experiments/accuracy_vs_time/README.md", "a quarter of the pixels gives", "what is varied"),
    ("experiments/ablation/README.md", "less than a tenth of the loss", "what the list is of"),
    ("experiments/race/README.md", "of which half as many numbers", "what was changed"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_without_a_raw_file_is_found() {
        let found = |text: &str| strays(Path::new("docs/nowhere.md"), text).unwrap().len();
        for text in [
            "It takes 12 ms.",
            "It takes (1.5\ns).",
            "off by 0.3%",
            "5.2 times as fast",
            "at most 3.0·10⁻⁴ of it",
            "a share of 0.07,",
            "28 to 30.1 dB",
            "| a | 0.899 |",
            "**1,024 MB**",
            "Three times as long,",
            "ten times\nslower.",
            "it is twice as fast",
            "(half the time)",
            "by a tenth",
            "within a\nthird of it",
            "about two thirds,",
            "up to a quarter.",
            "less than half of that",
            "half as much",
            "some eleven\nminutes",
            "half a second",
            "redder by a sixteenth",
            "to a hundredth of it",
        ] {
            assert_eq!(found(text), 1, "{text}");
        }
        for text in [
            "2 x 2 samples, a 16-bit target, 13 unknowns",
            "`12 ms` and\n\n    takes 12 ms\n",
            "```\n12 ms\n```",
            "[12](page.json#a) ms, [1.2·10⁻⁴](page.json#b), at 3840 x 2160 [1.2](page.json#c) times",
            "| 8 | seconds of baking |",
            "<!-- figures: page.json#a | {x} | -->\n| a |\n| --- |\n| 0.5 |\n<!-- end -->",
            "| 3 | of 4 passes |",
            "[5](page.json#a) times as fast, two times, half the texels, a tenth-order term, the third of four",
            "to 10⁻⁶, by burn 0.22.1, as in figure 3.",
        ] {
            assert_eq!(found(text), 0, "{text}");
        }
        assert_eq!(strays(Path::new("docs/model.md"), "2%").unwrap().len(), 0);
    }
}

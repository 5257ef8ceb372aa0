//! The command line's words as Python has them: its options are arguments there, and nobody is sent to `--help`.

use pyo3::pyfunction;

/// Options, and what they are in Python.
const ARGUMENTS: [(&str, &str); 30] = [
    ("-o", "run"),
    ("--adapter", "adapter"),
    ("--axis", "axes"),
    ("--budget", "budget"),
    ("--cache", "cache"),
    ("--cases", "cases"),
    ("--constants", "constants"),
    ("--device-memory", "device_memory"),
    ("--engine", "engine"),
    ("--gpu", "gpu"),
    ("--hold-out", "hold_out"),
    ("--loss", "loss"),
    ("--material", "material"),
    ("--max-iterations", "max_iterations"),
    ("--no-cache", "cache=False"),
    ("--no-gpu", "gpu=False"),
    ("--pairs", "pairs"),
    ("--params", "params"),
    ("--pixels", "pixels"),
    ("--player", "player"),
    ("--refit", "refit"),
    ("--replay", "replay"),
    ("--resume", "resume"),
    ("--samples", "samples"),
    ("--seed", "seed"),
    ("--solver", "solver"),
    ("--starts", "starts"),
    ("--title", "title"),
    ("--verify", "verify"),
    ("--within", "within"),
];

/// A refusal of the command line's in Python's words. Whole commands within backticks stay.
#[pyfunction]
pub(crate) fn in_python(words: &str) -> String {
    let words = words.trim_end();
    let words = words.strip_suffix("For more information, try '--help'.").unwrap_or(words).trim_end();
    let words = words.strip_prefix("error: ").unwrap_or(words);
    let parts = words
        .split('`')
        .map(|part| if part.starts_with("skinfit ") { part.to_owned() } else { translated(part.to_owned()) });
    parts.collect::<Vec<_>>().join("`")
}

fn translated(words: String) -> String {
    ARGUMENTS.iter().fold(words, |words, (option, argument)| replaced(&words, option, argument))
}

/// With the argument in the option's place, where that is a word of its own; what a usage has after it goes.
fn replaced(words: &str, option: &str, argument: &str) -> String {
    let (mut all, mut rest) = (String::new(), words);
    while let Some(place) = rest.find(option) {
        let (before, after) = (&rest[..place], &rest[place + option.len()..]);
        let begins = !(before.ends_with(is_of_word) || before.is_empty() && all.ends_with(is_of_word));
        let whole = begins && !after.starts_with(is_of_word);
        all.push_str(before);
        all.push_str(if whole { argument } else { option });
        rest = if whole { after_usage(after) } else { after };
    }
    all + rest
}

fn is_of_word(character: char) -> bool {
    character.is_alphanumeric() || "-_/".contains(character)
}

/// What comes after the `<N>` of an option in a usage.
fn after_usage(after: &str) -> &str {
    let usage = after.strip_prefix(" <").and_then(|usage| usage.split_once('>'));
    usage.map_or(after, |(_, after)| after)
}

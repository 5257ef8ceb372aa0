//! Who ran the program when, and on what: the command line, the date, the processor.

use std::ffi::OsString;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::contained::is_contained;

/// What a report tells of its making, as (name, text).
pub(super) fn made() -> Vec<(String, String)> {
    let made = [("command", command(std::env::args_os(), is_contained())), ("date", now())];
    let processor = ("processor", processor());
    made.into_iter().chain([processor]).map(|(name, text)| (name.to_owned(), text)).collect()
}

/// The name that the processor gives itself, or else its kind.
pub(super) fn processor() -> String {
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = told.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

/// The command line as a shell takes it, the program by its name: this one's, or that of the one which contains it.
fn command(mut arguments: impl Iterator<Item = OsString>, contained: bool) -> String {
    let program = arguments.next().unwrap_or_default();
    let name = Path::new(&program).file_name().filter(|_| contained);
    let name = name.map_or_else(|| "skinfit".to_owned(), |name| quoted(&name.to_string_lossy()));
    let words = arguments.map(|word| quoted(&word.to_string_lossy()));
    std::iter::once(name).chain(words).collect::<Vec<_>>().join(" ")
}

/// A word of a command line, in quotes where a shell would take it apart.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// The date and time in UTC, to the second.
fn now() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    // A clock before 1970 is not set.
    since.map_or_else(|_| "unknown".to_owned(), |since| utc(since.as_secs()))
}

/// Seconds since 1970 as a date of ISO 8601, in UTC (days to civil: Howard Hinnant, chrono-Compatible Low-Level Date
/// Algorithms).
fn utc(seconds: u64) -> String {
    let (days, time) = (seconds / 86_400 + 719_468, seconds % 86_400);
    // Years begin in March, so that the day that may be missing is their last.
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    let (hour, minute, second) = (time / 3600, time / 60 % 60, time % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        // As `date -u -d @SECONDS +%FT%TZ` prints them: leap days of 4, 100 and 400 years, and days beside them.
        for (seconds, date) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_799, "2000-02-29T23:59:59Z"),
            (1_709_210_096, "2024-02-29T12:34:56Z"),
            (1_709_251_200, "2024-03-01T00:00:00Z"),
            (1_798_761_599, "2026-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
            (4_107_542_399, "2100-02-28T23:59:59Z"),
        ] {
            assert_eq!(utc(seconds), date);
        }
    }

    #[test]
    fn a_command_can_be_given_to_a_shell_again() {
        let words = [
            "target/release/skinfit",
            "fit",
            "my scene.toml",
            "-o",
            "it's",
            "--set",
            "hilite=0.7,0.6,0.5",
            "",
        ];
        let given = |contained| command(words.map(OsString::from).into_iter(), contained);
        assert_eq!(given(false), r"skinfit fit 'my scene.toml' -o 'it'\''s' --set hilite=0.7,0.6,0.5 ''");
        let python = ["/usr/bin/python3", "rep.py"].map(OsString::from);
        assert_eq!(command(python.into_iter(), true), "python3 rep.py");
    }
}

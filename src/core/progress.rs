//! Progress bars: shown on a terminal, silent everywhere else.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar over `length` steps, labelled `label`; hidden when standard error is not a terminal.
///
/// The bar is safe to advance from any thread (`bar.inc(1)`); call `finish_and_clear` at the end.
#[must_use]
pub fn bar(label: &'static str, length: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{prefix:>12} [{bar:32}] {pos}/{len} {elapsed} {msg}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.with_prefix(label)
}

/// A counter without an end, for work whose length nobody knows; hidden when standard error is not a
/// terminal.
#[must_use]
pub fn spinner(label: &'static str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{prefix:>12} {spinner} step {pos} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.with_prefix(label)
}

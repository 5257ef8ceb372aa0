//! Progress bars: shown on a terminal, silent everywhere else.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use skinfit_core::progress::{Progress, Steps, watch};

use crate::contained::is_contained;

/// A bar over `length` steps, labelled `label`; hidden when standard error is not a terminal,
/// or not ours.
///
/// The bar is safe to advance from any thread (`bar.inc(1)`); call `finish_and_clear` at the end.
pub(crate) fn bar(label: &'static str, length: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), target());
    if let Ok(style) = ProgressStyle::with_template("{prefix:>12} [{bar:32}] {pos}/{len} {elapsed} {msg}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.with_prefix(label)
}

/// A counter without an end, for work whose length nobody knows; hidden when standard error is not a
/// terminal, or not ours.
pub(crate) fn spinner(label: &'static str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, target());
    if let Ok(style) = ProgressStyle::with_template("{prefix:>12} {spinner} step {pos} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.with_prefix(label)
}

/// Where bars are drawn.
fn target() -> ProgressDrawTarget {
    if is_contained() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

/// Shows the library's work as bars.
struct Bars;

struct Shown(ProgressBar);

impl Progress for Bars {
    fn begin(&self, name: &'static str, steps: Option<u64>) -> Box<dyn Steps> {
        Box::new(Shown(steps.map_or_else(|| spinner(name), |steps| bar(name, steps))))
    }
}

impl Steps for Shown {
    fn advance(&self, steps: u64) {
        self.0.inc(steps);
    }
    fn describe(&self, words: &str) {
        self.0.set_message(words.to_owned());
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Show the library's work from now on.
pub(crate) fn show() {
    // Where a program that contains this one watches already, it goes on to.
    let _ = watch(Bars);
}

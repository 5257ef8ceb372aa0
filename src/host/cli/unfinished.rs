//! Ctrl-C while a command has nothing to go on from: what is unfinished goes, and one line says what stays.

use std::borrow::Cow;
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::{Refusal, tell};
use crate::contained::is_contained;
use crate::output;

/// What goes when the command is interrupted.
struct Unfinished {
    /// Folders that were made for this run alone: they go with all that is in them.
    folders: Vec<PathBuf>,
    /// Files, and folders that go if they are empty; in this order.
    places: Vec<PathBuf>,
    /// What is written into, where the results are being written.
    writing: Option<PathBuf>,
    /// Whether it was asked for once while they are.
    asked: bool,
    /// What is said when it is interrupted before that.
    words: Cow<'static, str>,
    /// What asks a fit to stop, once it has something to keep.
    fit: Option<Arc<AtomicBool>>,
    /// Processes that work for this one.
    children: Vec<Child>,
}

static UNFINISHED: Mutex<Unfinished> = Mutex::new(Unfinished {
    folders: Vec::new(),
    places: Vec::new(),
    writing: None,
    asked: false,
    words: Cow::Borrowed("interrupted: no results were written; only bakes in the cache were kept."),
    fit: None,
    children: Vec::new(),
});

/// Change what goes; a thread that panicked has left it whole.
fn change<T>(change: impl FnOnce(&mut Unfinished) -> T) -> T {
    change(&mut UNFINISHED.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
}

/// From now on Ctrl-C ends the program by [`interrupted`], with the exit code of an interrupted fit; a program that
/// contains this one handles it itself.
pub(super) fn install() {
    if is_contained() {
        return;
    }
    // Refused only if a handler is there already; then Ctrl-C ends the program as it always did.
    let _ = ctrlc::set_handler(|| change(interrupted));
}

/// As [`install`], of a command that has left some results before it is interrupted: `words` say so.
pub(super) fn install_saying(words: String) {
    change(|unfinished| unfinished.words = words.into());
    install();
}

/// From now on Ctrl-C sets `flag`, and a second time ends the program at once: the state of a fit that keeps one is at
/// most a second old.
pub(super) fn asked_through(flag: &Arc<AtomicBool>) {
    change(|unfinished| unfinished.fit = Some(Arc::clone(flag)));
    install();
}

/// Run another process to its end. It is interrupted together with this one, and none is begun afterwards.
pub(super) fn run(command: &mut Command) -> std::io::Result<ExitStatus> {
    // Who interrupts the program never gives back what is waited for here.
    let id = change(|unfinished| {
        let child = command.spawn()?;
        let id = child.id();
        unfinished.children.push(child);
        Ok::<_, std::io::Error>(id)
    })?;
    loop {
        // Its number is another's once it has ended and was waited for: both at once.
        let ended = change(|unfinished| {
            let at = unfinished.children.iter().position(|child| child.id() == id)?;
            let runs = matches!(unfinished.children[at].try_wait(), Ok(None));
            (!runs).then(|| unfinished.children.swap_remove(at).wait())
        });
        if let Some(status) = ended {
            return status;
        }
        std::thread::sleep(POLL);
    }
}

/// How often it is asked whether a process has ended.
const POLL: Duration = Duration::from_millis(10);
/// How long files that are being written are waited for.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long processes that were interrupted are waited for: they wait for a disk as long as this one does, and more.
const LAST_WORDS: Duration = Duration::from_secs(6);

/// Interrupt another process. At a terminal Ctrl-C is for that one, too; a signal by its number is not.
#[cfg(unix)]
fn interrupt(process: u32) {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;
    if let Ok(process) = i32::try_from(process) {
        // It may have ended.
        let _ = kill(Pid::from_raw(process), Signal::SIGINT);
    }
}

/// Elsewhere only a terminal interrupts, and that is for all of its processes.
#[cfg(not(unix))]
const fn interrupt(_: u32) {}

/// Whoever wants to begin writing waits for this to end, and with it the program.
fn interrupted(unfinished: &mut Unfinished) {
    if let Some(fit) = &unfinished.fit {
        if fit.swap(true, Ordering::SeqCst) {
            std::process::exit(1);
        }
        return;
    }
    if std::io::stderr().is_terminal() {
        // Off the line of the progress bar.
        let _ = writeln!(std::io::stderr());
    }
    if let (Some(folder), false) = (&unfinished.writing, unfinished.asked) {
        tell(&format!(
            "{}: the results are being written and will be whole in a moment. Press Ctrl-C again to stop at once.",
            folder.display()
        ));
        unfinished.asked = true;
        return;
    }
    unfinished.children.iter().for_each(|child| interrupt(child.id()));
    // A bake that is being kept would bring its folder back; a disk that does not answer is not waited for.
    let since = Instant::now();
    let mut halted = output::halt();
    while halted.is_none() && since.elapsed() < PATIENCE {
        std::thread::sleep(POLL);
        halted = output::halt();
    }
    let since = Instant::now();
    while unfinished.children.iter_mut().any(|child| matches!(child.try_wait(), Ok(None)))
        && since.elapsed() < LAST_WORDS
    {
        std::thread::sleep(POLL);
    }
    for folder in &unfinished.folders {
        let _ = std::fs::remove_dir_all(folder);
    }
    for place in &unfinished.places {
        // Whatever is in the way is not ours to remove.
        let _ = if place.is_dir() { std::fs::remove_dir(place) } else { std::fs::remove_file(place) };
    }
    match &unfinished.writing {
        Some(folder) => tell(&format!(
            "{}: interrupted while the results were written: each file is whole, but they may be of two runs.",
            folder.display()
        )),
        None => tell(&unfinished.words),
    }
    std::process::exit(1);
}

/// `folder` is being worked for: `own` if it was made for it, and `made`, what else was made for it, innermost first.
pub(super) fn working(folder: &Path, own: bool, made: &[PathBuf]) {
    change(|unfinished| {
        unfinished.folders.extend(own.then(|| folder.to_owned()));
        unfinished.places.extend(made.iter().cloned());
    });
}

/// The results are about to be written into `folder`: what was made for them stays.
pub(super) fn writing(folder: &Path) {
    change(|unfinished| {
        unfinished.folders.retain(|own| !folder.starts_with(own));
        unfinished.places.clear();
        unfinished.writing = Some(folder.to_owned());
    });
}

/// Results are written for now, and the command goes on: from here, `words` are said when it is interrupted. If that
/// was asked for meanwhile, it ends here.
pub(super) fn written(words: String) {
    change(|unfinished| {
        unfinished.words = words.into();
        unfinished.writing = None;
        if std::mem::take(&mut unfinished.asked) {
            interrupted(unfinished);
        }
    });
}

/// A folder for what is needed only as long as the command runs; it goes when the command ends or is interrupted.
pub(super) fn scratch() -> Result<TempDir, Refusal> {
    // Made and noted at once: an interruption comes before both, or after.
    let made = change(|unfinished| {
        let scratch = tempfile::tempdir()?;
        unfinished.folders.push(scratch.path().to_owned());
        Ok(scratch)
    });
    made.map_err(|error: std::io::Error| {
        let folder = std::env::temp_dir();
        Refusal::new(format!(
            "{}: a scratch folder cannot be made there: {error}. Make room, or set TMPDIR.",
            folder.display()
        ))
    })
}

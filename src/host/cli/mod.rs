//! The command line: a file or folder a command. Every command ends with an [`Exit`].
//!
//! - `inspect`, `import`, `panorama`, `fit`, `render`, `bake`, `demo`, `params`, `shader`, `export`, `info`, `ablate`, `tradeoff`, `suggest`,
//!   `stability`, `view`, `page`, `sweep`, `collect`: the commands
//! - `fit_engine`: what evaluates the passes of a fit; `fingerprint`: what its state belongs to
//! - `columns`: tables in a terminal; `first_scene`: a scene file for a mesh
//! - `graphics`: what to do about an adapter that cannot; `machine`: what a report says of its making
//! - `opened`: a scene or a run folder, to be looked at
//! - `scene`: how a command finds its scene and its cache; `set`: values of parameters on the command line
//! - `maps`: fits of whole maps, where the program is built with them
//! - `interrupt`: Ctrl-C once a fit is under way; `unfinished`: what goes with it before, and in the other commands
//! - `stages`: what diffusion makes in texels, as files and in reports
//! - `requested`: fits that a window, or another program, asks for
//! - `run_folder`, `fitted_scene`, `fitted_cameras`: where a fit leaves what it found, and what it was made from

mod ablate;
mod bake;
mod columns;
mod demo;
mod export;
mod fingerprint;
mod first_scene;
mod fit;
mod fit_engine;
mod fitted_cameras;
mod fitted_scene;
mod graphics;
mod import;
mod info;
mod inspect;
mod interrupt;
mod machine;
mod maps;
mod opened;
mod page;
mod panorama;
mod params;
mod render;
mod requested;
mod run_folder;
mod scene;
mod set;
mod shader;
mod stability;
mod stages;
mod suggest;
mod sweep;
mod tradeoff;
mod unfinished;
mod view;

use std::ffi::OsString;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[cfg(feature = "burn")]
pub use self::graphics::tensor_words;
pub use self::requested::{CommandLine, save as save_scene};
pub use self::scene::parse_effects;
use crate::contained::{hear, is_contained};
use crate::scene::register_terms;
use crate::shader::term::library;
use crate::{output, progress};

/// How a command ended, as an exit code; `EXIT_CODES` says what each means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "EXIT_CODES documents them")]
pub enum Exit {
    Done,
    Failed,
}

/// What the exit codes 0, 1 and 2 mean: for every help page, and docs/scene-files.md.
const EXIT_CODES: [&str; 3] = [
    "done",
    "the fit failed: it stalled, ran out of iterations, was interrupted or lost its device",
    "the input was refused",
];

/// A help page's end.
fn with_exit_codes(text: &str) -> String {
    with_failure(text, EXIT_CODES[1])
}

/// A help page's end, of a command whose exit code 1 means something of its own.
fn with_failure(text: &str, failed: &str) -> String {
    let [done, _, refused] = EXIT_CODES;
    format!("{text}\n\nExit codes:\n  0  {done}\n  1  {failed}\n  2  {refused}")
}

/// Why a command was refused, or failed: one paragraph that says file, place, what is wrong, and what to do.
#[derive(Debug)]
pub struct Refusal {
    words: String,
    /// Whether the input was good and the work failed.
    failed: bool,
}

impl<E: std::error::Error> From<E> for Refusal {
    fn from(error: E) -> Self {
        Self::new(error.to_string())
    }
}

impl Refusal {
    /// A refusal in these words.
    pub fn new(words: impl Into<String>) -> Self {
        Self { words: words.into(), failed: false }
    }

    /// A failure of the work, not of its input, in these words.
    pub fn failure(words: impl Into<String>) -> Self {
        Self { words: words.into(), failed: true }
    }

    /// The paragraph that the program prints.
    #[must_use]
    pub fn words(&self) -> &str {
        &self.words
    }

    /// Whether the input was good and the work failed.
    #[must_use]
    pub const fn is_failure(&self) -> bool {
        self.failed
    }
}

#[derive(Parser)]
#[command(
    name = "skinfit",
    version,
    about = "Fit the constants of a real-time skin shader to images",
    long_about = "skinfit fits the constants of a real-time skin shader to images.\n\nThe model is the \
        one of NVIDIA's Dawn demo (GPU Gems, chapter 3): diffuse, specular and hilite cube maps, ambient \
        occlusion and a rim weight. A scene file names mesh, maps, environment and target images; a fit \
        leaves the constants, their error bars and pictures in a run folder.",
    after_help = with_exit_codes("Start with:\n  skinfit fit                        fit the built-in scene\n  skinfit demo my-scene              write the built-in scene as files to copy from\n  skinfit fit my-scene/scene.toml    fit those files"),
    arg_required_else_help = true
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Inspect(inspect::Arguments),
    Import(import::Arguments),
    Panorama(panorama::Arguments),
    Fit(fit::Arguments),
    Ablate(ablate::Arguments),
    Tradeoff(tradeoff::Arguments),
    Suggest(suggest::Arguments),
    Render(render::Arguments),
    Bake(bake::Arguments),
    Demo(demo::Arguments),
    Params(params::Arguments),
    Shader(shader::Arguments),
    Export(export::Arguments),
    Info(info::Arguments),
    Stability(stability::Arguments),
    View(view::Arguments),
    Page(page::Arguments),
    Sweep(sweep::SweepArguments),
    Collect(sweep::CollectArguments),
}

/// Run the program on the process' arguments.
#[must_use]
pub fn main() -> ExitCode {
    ExitCode::from(main_of(&std::env::args_os().collect::<Vec<_>>()))
}

/// Run the program on these words, the first of which is its own name: its exit code. The process is the program's while
/// it runs: a word that is not understood ends it, and Ctrl-C is the program's to handle.
#[must_use]
pub fn main_of(words: &[OsString]) -> u8 {
    know_terms(words);
    // A word that is not understood ends here, with exit code 2.
    let arguments = Arguments::parse_from(words);
    // A window shows progress itself.
    if !matches!(arguments.command, Command::View(_)) {
        progress::show();
    }
    let done = match arguments.command {
        Command::Inspect(arguments) => inspect::run(&arguments),
        Command::Import(arguments) => import::run(&arguments),
        Command::Panorama(arguments) => panorama::run(&arguments),
        Command::Fit(arguments) => fit::run(&arguments),
        Command::Ablate(arguments) => ablate::run(&arguments),
        Command::Tradeoff(arguments) => tradeoff::run(&arguments),
        Command::Suggest(arguments) => suggest::run(&arguments),
        Command::Render(arguments) => render::run(&arguments),
        Command::Bake(arguments) => bake::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Params(arguments) => params::run(&arguments),
        Command::Shader(arguments) => shader::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Stability(arguments) => stability::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        Command::Page(arguments) => page::run(&arguments),
        Command::Sweep(arguments) => sweep::run(&arguments),
        Command::Collect(arguments) => sweep::run_collect(&arguments),
    };
    match done {
        Ok(Exit::Done) => 0,
        Ok(Exit::Failed) => 1,
        Err(Refusal { words, failed }) => {
            tell(&words);
            if failed { 1 } else { 2 }
        }
    }
}

/// Know the effects of the scenes that the command line names before it is understood, as options name them. What is
/// wrong with a scene is told when it is read.
fn know_terms(words: &[OsString]) {
    library::register_all();
    for argument in words.iter().skip(1) {
        let path = Path::new(argument);
        if path.extension().is_some_and(|ending| ending == "toml") && path.is_file() {
            let _ = register_terms(path);
        }
    }
}

/// Print a line on standard output. A reader that has gone away (`| head -1`) is no failure; a full
/// disk is.
fn say(line: &str) -> Result<(), Refusal> {
    if hear(|heard| heard.said.push(line.to_owned())) {
        return Ok(());
    }
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Refusal::new(format!(
            "standard output cannot be written: {error}. Send it to a file or a terminal that takes it."
        ))),
        _ => Ok(()),
    }
}

/// Write a text to a file and say so, or print it.
fn write_or_say(file: Option<&Path>, text: &str) -> Result<(), Refusal> {
    match file {
        Some(file) => {
            output::write(file, text.as_bytes())?;
            say(&format!("wrote {}", file.display()))
        }
        None => say(text.trim_end()),
    }
}

/// Print a line on standard error, after the program's name; there is nobody to tell that it failed. At once, as
/// processes of one sweep share it.
fn tell(line: &str) {
    if hear(|heard| heard.told.push(line.to_owned())) {
        return;
    }
    let _ = std::io::stderr().write_all(format!("skinfit: {line}\n").as_bytes());
}

/// Print what was mended or left out.
fn tell_warnings(warnings: &[String]) {
    for warning in warnings {
        tell(&format!("warning: {warning}"));
    }
}

/// See to it that opening a graphics adapter says nothing on standard error where no desktop session runs:
/// there, a Vulkan layer of Mesa's asks a Wayland compositor in vain and complains. It heeds an environment
/// variable, which a process can only have from its start; so the program starts anew with it, in the same
/// process.
fn quieten_graphics() {
    if is_contained() {
        return;
    }
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt as _;
        const VARIABLE: &str = "NODEVICE_SELECT";
        let session = std::env::var_os("XDG_RUNTIME_DIR").is_some_and(|folder| !folder.is_empty());
        if session || std::env::var_os(VARIABLE).is_some() {
            return;
        }
        if let Ok(program) = std::env::current_exe() {
            let mut arguments = std::env::args_os();
            let name = arguments.next().unwrap_or_else(|| "skinfit".into());
            // It only returns when it fails; then the complaint is heard, and nothing else is lost.
            let _ = std::process::Command::new(program).arg0(name).args(arguments).env(VARIABLE, "1").exec();
        }
    }
}

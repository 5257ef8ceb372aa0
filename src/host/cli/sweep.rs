//! `skinfit sweep`: the jobs of a plan, one after the other or one by one; `skinfit collect`: their results.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::fitted_scene::{Changes, as_fitted};
use super::scene::BakeArguments;
use super::{Exit, Refusal, say, tell, unfinished};
use crate::output;
use crate::progress;
use crate::study::sweep::collect::Collection;
use crate::study::sweep::inputs::Inputs;
use crate::study::sweep::job::Job;
use crate::study::sweep::plan::Plan;
use crate::study::sweep::result::{Findings, JobResult, Status, settings};
use crate::study::sweep::run;

/// Run the jobs of a plan: many scenes and settings, here or on many machines
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("A plan is a TOML file:\n\n  command = \"fit\"                      # or \"ablate\", \"tradeoff\", \"stability\"\n  scene = \"scene.toml\"                 # left out: the built-in scene\n  [settings]                           # for every job\n  solver = \"varpro\"\n  [[axis]]                             # every combination of the axes\n  key = \"fit.loss\"                     # a scene file's key, or scene, command, solver ...\n  values = [\"l2\", \"huber\"]\n\nEach job leaves one file in the plan's folder of results (results = \"...\", by default beside the plan). A job that has left one is not run again.\n\nExamples:\n  skinfit sweep plan.toml               run what is not done yet\n  skinfit sweep plan.toml --list        a command a job, for a scheduler (docs/sweeps.md)\n  skinfit sweep plan.toml --run 3       one job\n\nskinfit collect merges the results.", "a job failed, or the command was interrupted")
)]
pub(super) struct SweepArguments {
    /// The plan file.
    plan: PathBuf,
    /// Print a command a job, and run nothing.
    #[arg(long, conflicts_with_all = ["run", "workers"])]
    list: bool,
    /// Run one job: its number, from 0, or its identity.
    #[arg(long, value_name = "JOB", conflicts_with = "workers")]
    run: Option<String>,
    /// Jobs at a time, each in a process of its own.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    workers: u16,
    #[command(flatten)]
    bakes: BakeArguments,
}

/// Merge the results of a plan's jobs into one table
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("The table is the same whatever order the jobs were done in. Ablations and tradeoffs have a row for each part left out, each setting. Jobs that are missing or failed are named; then the exit code is 1, and the table holds the others.\n\nExamples:\n  skinfit collect plan.toml -o all.csv\n  skinfit collect plan-results -o all.json", "a job is missing or failed")
)]
pub(super) struct CollectArguments {
    /// The plan file, or the folder of its results.
    plan: PathBuf,
    /// The table: .csv or .json.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// With the seconds that were measured: another table each time, unlike one without.
    #[arg(long)]
    seconds: bool,
    #[command(flatten)]
    bakes: BakeArguments,
}

/// A job with the scene that it runs on.
struct Ready<'a> {
    job: &'a Job,
    identity: String,
    scene_text: String,
    constants: Option<PathBuf>,
}

pub(super) fn run(arguments: &SweepArguments) -> Result<Exit, Refusal> {
    let plan = Plan::read(&arguments.plan)?;
    unfinished::install_saying(words_of_interruption(arguments));
    if let Some(name) = &arguments.run {
        let ready = ready(&plan, plan.job(name)?, &arguments.bakes)?;
        return run_one(&plan, &ready, &arguments.bakes, true);
    }
    let all = ready_all(&plan, &arguments.bakes)?;
    if arguments.list {
        let program = command_line(arguments, &plan)?;
        for ready in &all {
            say(&format!("{program} --run {}", ready.identity))?;
        }
        return Ok(Exit::Done);
    }
    let open: Vec<&Ready<'_>> = all.iter().filter(|ready| !is_done(&plan, &ready.identity)).collect();
    let bar = progress::bar("jobs", open.len() as u64);
    let failed = if arguments.workers > 1 {
        run_workers(arguments, &plan, &open, &bar)?
    } else {
        let mut failed = 0;
        for ready in &open {
            failed += usize::from(run_one(&plan, ready, &arguments.bakes, false)? == Exit::Failed);
            bar.inc(1);
        }
        failed
    };
    bar.finish_and_clear();
    let before = all.len() - open.len();
    say(&format!(
        "{}: {} jobs, {before} done before, {} now, {failed} failed; results in {}",
        plan.path.display(),
        all.len(),
        open.len() - failed,
        plan.results.display()
    ))?;
    Ok(if failed == 0 { Exit::Done } else { Exit::Failed })
}

/// What stays of an interrupted sweep.
fn words_of_interruption(SweepArguments { plan, run, .. }: &SweepArguments) -> String {
    let plan = plan.display();
    match run {
        Some(job) => format!("{plan}: interrupted: job {job} has left a whole result or none. Run it again."),
        None => format!(
            "{plan}: interrupted: jobs that were done have left their results. Go on with the others by the same command."
        ),
    }
}

pub(super) fn run_collect(arguments: &CollectArguments) -> Result<Exit, Refusal> {
    let collection = if arguments.plan.is_dir() {
        Collection::of_folder(&arguments.plan)?
    } else {
        let plan = Plan::read(&arguments.plan)?;
        let all = ready_all(&plan, &arguments.bakes)?;
        let identities: Vec<String> = all.into_iter().map(|ready| ready.identity).collect();
        Collection::of(&plan.results, &identities)
    };
    let collection = if arguments.seconds { collection.with_times() } else { collection.without_times() };
    let text = match arguments.output.extension().and_then(|ending| ending.to_str()) {
        Some("csv") => collection.csv(),
        Some("json") => collection.json().map_err(|error| Refusal::new(error.to_string()))?,
        _ => {
            let path = arguments.output.display();
            return Err(Refusal::new(format!("{path}: a table is .csv or .json. Name the file so.")));
        }
    };
    output::write(&arguments.output, text.as_bytes())?;
    say(&format!("wrote {}: {} jobs", arguments.output.display(), collection.done.len()))?;
    let path = arguments.plan.display();
    for (index, reason) in &collection.failed {
        tell(&format!("{path}: job {index} failed: {reason}"));
    }
    if !collection.missing.is_empty() {
        let missing: Vec<String> = collection.missing.iter().map(ToString::to_string).collect();
        tell(&format!(
            "{path}: jobs without a result, by number: {}. Run them with skinfit sweep.",
            missing.join(", ")
        ));
    }
    Ok(if collection.complete() { Exit::Done } else { Exit::Failed })
}

/// Every job with its scene; each scene file is read once.
fn ready_all<'a>(plan: &'a Plan, bakes: &BakeArguments) -> Result<Vec<Ready<'a>>, Refusal> {
    plan.jobs.iter().map(|job| ready(plan, job, bakes)).collect()
}

fn ready<'a>(plan: &Plan, job: &'a Job, bakes: &BakeArguments) -> Result<Ready<'a>, Refusal> {
    let scene = bakes.kept_path(plan.scene(job).as_deref(), &plan.results)?;
    let refused = |reason: String| Refusal::new(format!("{}: {reason}. Correct the scene.", scene.display()));
    let text = std::fs::read_to_string(&scene).map_err(|error| {
        Refusal::new(format!(
            "{}: the scene of job {} cannot be read: {error}. Correct its path in {}.",
            scene.display(),
            job.index,
            plan.path.display()
        ))
    })?;
    let text = plan.scene_text(job, &scene, &text)?;
    let absolute = std::path::absolute(&scene).map_err(|error| refused(error.to_string()))?;
    let folder = absolute.parent().unwrap_or(Path::new("/"));
    let absolute =
        as_fitted(&text, folder, Changes::default()).map_err(|error| refused(error.message().to_owned()))?;
    let constants = plan.constants(job);
    let read = |path: &PathBuf| {
        std::fs::read_to_string(path).map_err(|error| {
            Refusal::new(format!(
                "{}: the constants of job {} cannot be read: {error}. Correct `params` in {}.",
                path.display(),
                job.index,
                plan.path.display()
            ))
        })
    };
    let constants_text = constants.as_ref().map(read).transpose()?;
    // Where the scene stands is nothing that the job computes.
    let identity = job.identity(&text, constants_text.as_deref());
    Ok(Ready { job, identity, scene_text: absolute, constants })
}

fn is_done(plan: &Plan, identity: &str) -> bool {
    let result = JobResult::read(&JobResult::path(&plan.results, identity));
    result.is_some_and(|result| result.identity == identity && result.done())
}

/// Run a job, unless it is done. What it finds, or why it fails, is in its result file.
fn run_one(plan: &Plan, ready: &Ready<'_>, bakes: &BakeArguments, tells: bool) -> Result<Exit, Refusal> {
    let identity = &ready.identity;
    let place = JobResult::path(&plan.results, identity);
    if is_done(plan, identity) {
        if tells {
            say(&format!("{}: done before", place.display()))?;
        }
        return Ok(Exit::Done);
    }
    let scene = plan.results.join("scenes").join(format!("{identity}.toml"));
    output::write(&scene, ready.scene_text.as_bytes())?;
    let clock = Instant::now();
    let cache = bakes.cache();
    let scratch = if cache.is_none() { Some(unfinished::scratch()?) } else { None };
    let inputs = Inputs {
        scene: &scene,
        constants: ready.constants.as_deref(),
        cache: cache.as_deref(),
        scratch: scratch.as_ref().map(TempDir::path),
    };
    let (status, Findings { figures, rows }) = match run::run(ready.job, inputs) {
        Ok(found) => (Status::Done, found),
        Err(error) => (Status::Failed(error.to_string()), Findings::default()),
    };
    let result = JobResult {
        job: ready.job.index,
        identity: identity.clone(),
        command: ready.job.command.name().to_owned(),
        status,
        settings: settings(ready.job),
        figures,
        rows,
        seconds: clock.elapsed().as_secs_f64(),
    };
    result.write(&plan.results)?;
    if let Status::Failed(reason) = &result.status {
        tell(&format!("{}: job {identity} failed: {reason}", plan.path.display()));
        return Ok(Exit::Failed);
    }
    if tells {
        say(&format!("wrote {}", place.display()))?;
    }
    Ok(Exit::Done)
}

/// This program with the plan, ready for a shell; it stands on its own, wherever it is run from.
fn command_line(arguments: &SweepArguments, plan: &Plan) -> Result<String, Refusal> {
    Ok(words(arguments, plan)?.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" "))
}

fn words(arguments: &SweepArguments, plan: &Plan) -> Result<Vec<String>, Refusal> {
    let refused = |error: std::io::Error| Refusal::new(format!("{}: {error}.", plan.path.display()));
    let program = std::env::current_exe().map_err(refused)?;
    let path = std::path::absolute(&plan.path).map_err(refused)?;
    let mut words = vec![program.display().to_string(), "sweep".to_owned(), path.display().to_string()];
    words.extend(arguments.bakes.words());
    Ok(words)
}

/// A word as a POSIX shell reads it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// How much later than its jobs a sweep may hear of a Ctrl-C that was for all of them, at the most.
const HEARSAY: Duration = Duration::from_millis(500);

/// Jobs in processes of their own, a few at a time; how many failed.
fn run_workers(
    arguments: &SweepArguments,
    plan: &Plan,
    open: &[&Ready<'_>],
    bar: &indicatif::ProgressBar,
) -> Result<usize, Refusal> {
    let words = words(arguments, plan)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (cores / usize::from(arguments.workers)).max(1);
    let (next, failed) = (AtomicUsize::new(0), AtomicUsize::new(0));
    std::thread::scope(|scope| {
        for _ in 0..arguments.workers {
            scope.spawn(|| {
                while let Some(ready) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut command = Command::new(&words[0]);
                    command.args(&words[1..]).args(["--run", &ready.identity]).stdout(Stdio::null());
                    if arguments.bakes.threads.is_none() {
                        command.args(["--threads", &threads.to_string()]);
                    }
                    let done =
                        unfinished::run(command.stdin(Stdio::null())).is_ok_and(|status| status.success());
                    failed.fetch_add(usize::from(!done), Ordering::Relaxed);
                    if !done && JobResult::read(&JobResult::path(&plan.results, &ready.identity)).is_none() {
                        // Perhaps it was interrupted, and this process hears of that a moment later.
                        std::thread::sleep(HEARSAY);
                    }
                    bar.inc(1);
                }
            });
        }
    });
    Ok(failed.into_inner())
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("/a/b-1.toml"), "/a/b-1.toml");
        assert_eq!(quoted("/a b/it's"), r"'/a b/it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}

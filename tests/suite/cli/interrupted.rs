//! Fits that end early, go on later, or meet each other.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::sandbox::{Ran, Sandbox, png};

/// Enough starts to last for seconds.
const LONG: [&str; 6] = ["--solver", "lm", "--starts", "300", "--seed", "7"];

/// Ends the child when a test fails half-way.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program on `arguments`, once it has `begun`; its scratch goes to `tmp`.
fn started(sandbox: &Sandbox, arguments: &[&str], begun: impl Fn() -> bool) -> Running {
    std::fs::create_dir_all(sandbox.path("tmp")).unwrap();
    let mut command = sandbox.command(arguments);
    command.env("TMPDIR", sandbox.path("tmp")).stdout(Stdio::piped()).stderr(Stdio::piped());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = Running(command.spawn().unwrap());
    let since = Instant::now();
    while !begun() {
        assert!(child.0.try_wait().unwrap().is_none(), "it ended before it began");
        assert!(since.elapsed() < Duration::from_secs(60), "it has not begun after a minute");
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

/// A long fit into `run`, once its state is there.
fn long_fit(sandbox: &Sandbox) -> Running {
    let arguments = [&["fit", "scene.toml", "-o", "run"], &LONG[..]].concat();
    started(sandbox, &arguments, || sandbox.path("run/state.json").exists())
}

/// Ctrl-C, for the child and what it has started, as a terminal does it.
#[cfg(unix)]
fn interrupt(child: Running) -> Ran {
    interrupt_at(&format!("-{}", child.0.id()), child)
}

/// For the child alone, as `kill` does it.
#[cfg(unix)]
fn interrupt_alone(child: Running) -> Ran {
    interrupt_at(&child.0.id().to_string(), child)
}

#[cfg(unix)]
fn interrupt_at(target: &str, child: Running) -> Ran {
    assert!(Command::new("kill").args(["-INT", "--", target]).status().unwrap().success());
    finish(child)
}

fn finish(mut child: Running) -> Ran {
    use std::io::Read;
    let (mut out, mut err) = (String::new(), String::new());
    child.0.stdout.take().unwrap().read_to_string(&mut out).unwrap();
    child.0.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    let code = child.0.wait().unwrap().code();
    assert!(!err.contains("panicked"), "{err}");
    Ran { code, out, err }
}

#[test]
fn a_fit_that_ran_out_goes_on_to_the_same_end() {
    let sandbox = Sandbox::new();
    sandbox.fit("whole", &[]).done();
    let ran = sandbox.fit("run", &["--max-iterations", "1"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(
        ran.err.contains("run: the fit ran out after 1 iteration") && ran.err.contains("--resume"),
        "{ran:?}"
    );
    assert!(ran.out.contains("ran out of iterations after 1 iteration and"), "{ran:?}");
    assert_eq!(sandbox.json("run/report.json")["ending"], "ran-out");
    // As if it had taken its time.
    let mut state = sandbox.json("run/state.json");
    state["seconds"] = 1000.0.into();
    sandbox.write("run/state.json", state.to_string().as_bytes());
    sandbox.fit("run", &["--resume"]).done();
    let seconds = sandbox.json("run/report.json")["seconds"]["fit"].as_f64().unwrap();
    assert!((1000.0..2000.0).contains(&seconds), "not the time of both processes together: {seconds}");
    assert_eq!(sandbox.text("run/params.toml"), sandbox.text("whole/params.toml"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_fit_keeps_its_state_and_goes_on_to_the_same_end() {
    let sandbox = Sandbox::new();
    sandbox.run(&[&["fit", "scene.toml", "-o", "whole"], &LONG[..]].concat()).done();
    let ran = interrupt(long_fit(&sandbox));
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.err.contains("run: the fit was interrupted") && ran.err.contains("--resume"), "{ran:?}");
    assert!(ran.out.lines().last().unwrap().starts_with("run: final loss "), "{ran:?}");
    assert_eq!(sandbox.json("run/report.json")["ending"], "interrupted");
    // Solver, starts and seed are remembered.
    sandbox.run(&["fit", "scene.toml", "-o", "run", "--resume"]).done();
    assert_eq!(sandbox.text("run/params.toml"), sandbox.text("whole/params.toml"));
    let evaluations = |run: &str| sandbox.json(&format!("{run}/report.json"))["evaluations"].clone();
    assert_eq!(evaluations("run"), evaluations("whole"));
}

/// A sandbox whose scene has rays enough for tracing them to last for seconds.
#[cfg(unix)]
fn slow_bakes() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.edit("occlusion_rays = 32", "occlusion_rays = 65536");
    sandbox
}

/// The program on `arguments`, once it has locked `folder` and begun to bake.
#[cfg(unix)]
fn locked(sandbox: &Sandbox, arguments: &[&str], folder: &str) -> Running {
    let child = started(sandbox, arguments, || sandbox.path(folder).join(".lock").exists());
    // The lock's file is there a moment before it is locked.
    std::thread::sleep(Duration::from_millis(50));
    child
}

#[cfg(unix)]
#[test]
fn a_fit_interrupted_before_it_is_under_way_says_so_and_leaves_nothing() {
    let sandbox = slow_bakes();
    let fit = ["fit", "scene.toml", "--no-cache", "-o", "made/run"];
    let ran = interrupt(locked(&sandbox, &fit, "made/run"));
    assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""), "{ran:?}");
    let words = "skinfit: interrupted before the search began: the run folder is as it was; ";
    assert!(ran.err.starts_with(words), "{ran:?}");
    assert!(!sandbox.path("made").exists(), "its folder is left");
}

/// What is left of the scratch.
#[cfg(unix)]
fn scratch(sandbox: &Sandbox) -> usize {
    std::fs::read_dir(sandbox.path("tmp")).unwrap().count()
}

/// A command that bakes without a cache, interrupted once its scratch is there.
#[cfg(unix)]
fn interrupted_in_its_bakes(sandbox: &Sandbox, arguments: &[&str]) -> Ran {
    interrupt(in_its_bakes(sandbox, arguments))
}

#[cfg(unix)]
fn in_its_bakes(sandbox: &Sandbox, arguments: &[&str]) -> Running {
    let child = started(sandbox, arguments, || scratch(sandbox) > 0);
    // Into the first of them.
    std::thread::sleep(Duration::from_millis(50));
    child
}

#[cfg(unix)]
#[test]
fn an_interrupted_study_says_so_and_leaves_nothing() {
    let sandbox = slow_bakes();
    for (command, more) in [("ablate", &["--gpu", "never"][..]), ("tradeoff", &["--axis", "samples"])] {
        let study = [&[command, "scene.toml", "-o", "made/study", "--no-cache"], more].concat();
        let ran = interrupted_in_its_bakes(&sandbox, &study);
        assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""), "{ran:?}");
        let words = "skinfit: interrupted: no results were written; only bakes in the cache were kept.\n";
        assert_eq!(ran.err, words, "{ran:?}");
        assert!(!sandbox.path("made").exists(), "{command}: its folder is left");
        assert_eq!(scratch(&sandbox), 0, "{command}: scratch is left");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_tradeoff_leaves_the_axes_that_are_done() {
    let sandbox = Sandbox::new();
    // What an earlier run left is replaced as soon as there is something in its place.
    let study = |axes: &[&'static str]| {
        let axes = axes.iter().flat_map(|axis| ["--axis", axis]);
        ["tradeoff", "scene.toml", "-o", "cost", "--no-cache"].into_iter().chain(axes).collect::<Vec<_>>()
    };
    assert_eq!(sandbox.run(&study(&["silhouette"])).code, Some(0));
    // The densest stack of specular cubes lasts for seconds.
    sandbox.edit("lobe_size = 8", "lobe_size = 64");
    let done = || sandbox.path("cost/format.svg").exists() && !sandbox.path("cost/silhouette.svg").exists();
    let child = started(&sandbox, &study(&["lobes", "format"]), done);
    let ran = interrupt(child);
    assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""), "{ran:?}");
    let words = "skinfit: cost: interrupted: the results of format are there, not those of lobes.";
    assert_eq!(ran.err.lines().last(), Some(words), "{ran:?}");
    let results = sandbox.json("cost/results.json");
    assert_eq!(results["pending"], serde_json::json!(["lobes"]));
    assert_eq!(results["axes"].as_array().unwrap().len(), 1);
    assert!(sandbox.text("cost/report.html").contains("Not measured: lobes."));
    assert!(sandbox.text("cost/results.csv").lines().all(|line| !line.starts_with("lobes")));
    assert_eq!(scratch(&sandbox), 0, "scratch is left");
    // The same command again does it all.
    let ran = sandbox.run(&study(&["filter", "format"]));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert_eq!(sandbox.json("cost/results.json")["pending"], serde_json::json!([]));
}

#[cfg(unix)]
#[test]
fn an_interrupted_sweep_keeps_the_results_of_its_jobs_and_leaves_no_scratch() {
    let sandbox = slow_bakes();
    let ablation = "command = \"ablate\"\nscene = \"scene.toml\"\nresults = \"out\"\n";
    sandbox.write(
        "plan.toml",
        format!("{ablation}[[job]]\nrefit = true\n[[job]]\n[[job]]\npairs = true\n").as_bytes(),
    );
    let go_on = "skinfit: plan.toml: interrupted: jobs that were done have left their results.";
    // With two workers the jobs are processes of their own; what is interrupted alone ends those that work for it.
    for (workers, interrupt) in [
        ("1", interrupt as fn(Running) -> Ran),
        ("2", interrupt),
        ("1", interrupt_alone),
        ("2", interrupt_alone),
    ] {
        let sweep = ["sweep", "plan.toml", "--no-cache", "--workers", workers];
        let ran = interrupt(in_its_bakes(&sandbox, &sweep));
        assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""), "{ran:?}");
        assert!(ran.err.lines().any(|line| line.starts_with(go_on)), "{ran:?}");
        assert_eq!(scratch(&sandbox), 0, "{workers} workers: scratch is left");
        let left = std::fs::read_dir(sandbox.path("out")).unwrap();
        let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, ["scenes"], "{workers} workers");
    }
    let ran = interrupted_in_its_bakes(&sandbox, &["sweep", "plan.toml", "--no-cache", "--run", "1"]);
    assert_eq!(
        ran.err, "skinfit: plan.toml: interrupted: job 1 has left a whole result or none. Run it again.\n",
        "{ran:?}"
    );
    assert_eq!((ran.code, scratch(&sandbox)), (Some(1), 0), "{ran:?}");
}

#[test]
fn two_runs_into_one_folder_are_one_too_many() {
    let sandbox = Sandbox::new();
    let first = long_fit(&sandbox);
    sandbox
        .fit("run", &[])
        .refused(&["run: another run is writing to this folder", "choose another with -o"]);
    sandbox
        .run(&["stability", "scene.toml", "--no-gpu", "-o", "run"])
        .refused(&["run: another run is writing to this folder"]);
    sandbox
        .run(&["bake", "scene.toml", "-o", "run"])
        .refused(&["run: another run is writing to this folder"]);
    assert_eq!(finish(first).code, Some(0));
    sandbox.fit("run", &[]).done();
}

#[cfg(unix)]
#[test]
fn two_bakes_into_one_folder_are_one_too_many() {
    let sandbox = slow_bakes();
    let bake = ["bake", "scene.toml", "--no-cache", "-o", "made/baked"];
    let first = locked(&sandbox, &bake, "made/baked");
    let words = ["made/baked: another run is writing to this folder", "choose another with -o"];
    sandbox.run(&bake).refused(&words);
    sandbox.fit("made/baked", &[]).refused(&words);
    let ran = interrupt(first);
    assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""), "{ran:?}");
    assert!(ran.err.starts_with("skinfit: interrupted: no results were written"), "{ran:?}");
    assert!(!sandbox.path("made").exists(), "its folder is left");
}

#[test]
fn states_that_cannot_be_gone_on_from() {
    let sandbox = Sandbox::new();
    let resume = |words: &[&str]| sandbox.fit("run", &["--resume"]).refused(words);
    resume(&["run/state.json: the state of the interrupted fit cannot be read", "afresh"]);
    assert!(!sandbox.path("run").exists(), "a refused run left its folder");

    sandbox.fit("run", &["--max-iterations", "1"]);
    let state = sandbox.read("run/state.json");
    let report = sandbox.read("run/report.json");
    for (what, bytes) in
        [("empty", &b""[..]), ("half", &state[..state.len() / 2]), ("another kind", b"{\"a\": 1}")]
    {
        eprintln!("{what}");
        sandbox.write("run/state.json", bytes);
        resume(&["run/state.json: this is not a state that a fit has left", "afresh"]);
        assert_eq!(sandbox.read("run/state.json"), bytes, "{what}");
    }
    sandbox.write("run/state.json", &state);
    let other = |arguments: &[&str], words: &[&str]| {
        let words = [&["run/state.json: this state belongs to another fit"], words].concat();
        sandbox.fit("run", &[&["--resume"], arguments].concat()).refused(&words);
    };
    other(&["--solver", "lm"], &["its solver differs (varpro; now lm)"]);
    other(&["--seed", "1"], &["its seed differs (0; now 1)"]);
    other(&["--params", "truth.toml"], &["its start differs"]);
    sandbox.write_grey("targets/side.exr", 32, 24);
    other(&[], &["its target of view side differs"]);
    assert!(sandbox.read("run/state.json") == state && sandbox.read("run/report.json") == report);
}

#[test]
fn a_state_is_refused_where_the_model_is_made_from_something_else() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &["--max-iterations", "1"]);
    let before = sandbox.files();
    let restore = |name: &str| sandbox.write(name, &before[&sandbox.path(name)]);
    let refused = |what: &str| {
        let words = ["run/state.json: this state belongs to another fit: its ", what, "another run folder"];
        sandbox.fit("run", &["--resume"]).refused(&words);
        assert!(sandbox.read("run/state.json") == before[&sandbox.path("run/state.json")], "{what}");
    };
    let edits = [
        ("color = \"color.png\"\n", "", "color map differs ("),
        ("specular = \"specular.png\"", "specular = \"attenuator.png\"", "specular map differs ("),
        ("file = \"env.exr\"", "file = \"env.exr\"\nintensity = 1.5", "environment differs ("),
        ("occlusion_rays = 32", "occlusion_rays = 64", "quality differs ("),
        ("form = \"corrected\"", "form = \"listing\"", "form differs (corrected; now listing)"),
        ("silhouette = \"fragment\"", "silhouette = \"bumped\"", "silhouette differs (fragment; now bumped)"),
        ("fov_y_degrees = 35.0", "fov_y_degrees = 35.5", "camera of view front differs ("),
    ];
    for (from, to, what) in edits {
        sandbox.edit(from, to);
        refused(what);
        restore("scene.toml");
    }
    sandbox.write("normal.png", &png(|_, _| [0.5, 0.5, 1.0]));
    refused("normal map differs (");
    restore("normal.png");
    sandbox.fit("run", &["--resume"]).done();
}

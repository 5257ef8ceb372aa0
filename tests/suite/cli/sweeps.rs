//! Plans, their jobs, and what is collected of them.

use super::sandbox::{Ran, Sandbox};
use super::tradeoffs::done;

const PLAN: &str = "command = \"fit\"\nscene = \"scene.toml\"\nresults = \"out\"\n[[axis]]\nkey = \"fit.loss\"\n\
    values = [\"l2\", \"huber\"]\n[[axis]]\nkey = \"model.effects\"\nvalues = [[\"diffuse\", \"rim\"], [\"diffuse\"]]\n";

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.edit(", \"specular_lobe\"]", "]");
    sandbox.write("plan.toml", PLAN.as_bytes());
    sandbox
}

fn collect(sandbox: &Sandbox, output: &str) -> Ran {
    sandbox.run(&["collect", "plan.toml", "-o", output])
}

/// The names of the result files.
fn results(sandbox: &Sandbox) -> Vec<String> {
    let entries = std::fs::read_dir(sandbox.path("out")).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".json")).collect();
    names.sort();
    names
}

#[test]
fn each_listed_command_runs_its_job_from_anywhere_and_any_order_gives_the_same_table() {
    let (forward, backward) = (sandbox(), sandbox());
    forward.run(&["sweep", "plan.toml"]).done();
    let ran = forward.run(&["sweep", "plan.toml"]).done();
    assert!(ran.out.contains("4 jobs, 4 done before, 0 now, 0 failed; results in out"), "{ran:?}");
    let list = backward.run(&["sweep", "plan.toml", "--list"]).done().out;
    for line in list.lines().rev() {
        let elsewhere = tempfile::tempdir().unwrap();
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", line]).current_dir(elsewhere.path()).env("SKINFIT_CACHE", backward.cache());
        Ran::of(&mut shell).done();
    }
    for name in ["all.csv", "all.json"] {
        collect(&forward, name).done();
        collect(&backward, name).done();
        assert_eq!(forward.text(name), backward.text(name));
    }
    let table = forward.text("all.csv");
    let header = table.lines().next().unwrap();
    assert!(header.starts_with("job,fit.loss,model.effects,ending,"), "{header}");
    assert!(header.contains("loss_end") && header.contains("rmse") && header.contains("value.base_weight"));
    assert_eq!(table.lines().count(), 5);
    // Without the rim the fit is worse.
    let all = forward.json("all.json");
    let rmse = |job: usize| all["jobs"][job]["figures"]["rmse"].as_f64().unwrap();
    assert!(rmse(1) > rmse(0) && rmse(0) > 0.0, "{} {}", rmse(0), rmse(1));
    // A job's scene stands there for whoever wants to look at its fit.
    let scene = format!("out/scenes/{}", results(&forward)[0].replace("job-", "").replace(".json", ".toml"));
    assert_eq!(forward.run(&["fit", &scene, "-o", "again", "--engine", "cpu"]).code, Some(0));
    let again = forward.json("again/report.json")["loss"]["end"].as_f64().unwrap();
    let loss = all["jobs"][0]["figures"]["loss_end"].as_f64().unwrap();
    assert_eq!(again, loss);
}

#[test]
fn a_folder_is_collected_as_its_plan_is_and_workers_give_the_same() {
    let sandbox = sandbox();
    sandbox.run(&["sweep", "plan.toml", "--workers", "2"]).done();
    collect(&sandbox, "plan.csv").done();
    sandbox.run(&["collect", "out", "-o", "folder.csv"]).done();
    assert_eq!(sandbox.text("plan.csv"), sandbox.text("folder.csv"));
}

#[test]
fn a_job_that_is_done_is_left_alone_and_one_whose_result_is_damaged_is_done_again() {
    let sandbox = sandbox();
    sandbox.run(&["sweep", "plan.toml", "--run", "2"]).done();
    let [name] = &results(&sandbox)[..] else { panic!("{:?}", results(&sandbox)) };
    let path = format!("out/{name}");
    assert!(name.starts_with("job-0002-"), "{name}");
    let first = sandbox.read(&path);
    let ran = sandbox.run(&["sweep", "plan.toml", "--run", "2"]).done();
    assert!(ran.out.ends_with("done before\n") && sandbox.read(&path) == first, "{ran:?}");
    sandbox.write(&path, &first[..first.len() / 2]);
    let ran = collect(&sandbox, "some.csv");
    assert_eq!(ran.code, Some(1));
    assert!(ran.err.contains("plan.toml: jobs without a result, by number: 0, 1, 2, 3."), "{ran:?}");
    let identity = name.replace("job-", "").replace(".json", "");
    sandbox.run(&["sweep", "plan.toml", "--run", &identity]).done();
    let figures =
        |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap()["figures"].clone();
    assert_eq!(figures(&sandbox.read(&path)), figures(&first));
    // Another scene is another job.
    sandbox.edit("hilite = 0.7", "hilite = 0.6");
    sandbox.run(&["sweep", "plan.toml", "--run", "2"]).done();
    assert_eq!(results(&sandbox).len(), 2);
    sandbox
        .run(&["collect", "out", "-o", "x.csv"])
        .refused(&["out: holds two results of job 2", "Name the plan"]);
}

/// An ablation, a sweep of two axes at a fit's constants, and a fit, in one plan.
const STUDIES: &str = "command = \"ablate\"\nscene = \"scene.toml\"\nresults = \"out\"\n[settings]\nrefit = true\nsolver = \"lm\"\n\
    [[job]]\n[[job]]\ncommand = \"tradeoff\"\naxes = [\"filter\", \"irradiance\"]\nparams = \"truth.toml\"\n[[job]]\ncommand = \"fit\"\n";

#[test]
fn studies_are_jobs_too_and_their_table_has_a_row_a_case_of_the_command_s_own_figures() {
    let sandbox = sandbox();
    sandbox.write("plan.toml", STUDIES.as_bytes());
    let list = sandbox.run(&["sweep", "plan.toml", "--list"]).done().out;
    assert_eq!(list.lines().count(), 3);
    for line in list.lines().rev() {
        let mut shell = std::process::Command::new("sh");
        Ran::of(shell.args(["-c", line]).env("SKINFIT_CACHE", sandbox.cache())).done();
    }
    let first: Vec<_> = results(&sandbox).iter().map(|name| sandbox.read(&format!("out/{name}"))).collect();
    let ran = sandbox.run(&["sweep", "plan.toml"]).done();
    assert!(ran.out.contains("3 jobs, 3 done before, 0 now"), "{ran:?}");
    let again: Vec<_> = results(&sandbox).iter().map(|name| sandbox.read(&format!("out/{name}"))).collect();
    assert!(first == again && first.len() == 3);
    collect(&sandbox, "all.json").done();
    let all = sandbox.json("all.json");
    let rows = |job: usize| all["jobs"][job]["rows"].as_array().unwrap().clone();
    // What the commands themselves find on the same scene.
    sandbox.run(&["ablate", "scene.toml", "-o", "parts", "--refit", "--gpu", "never"]);
    let parts = sandbox.json("parts/results.json");
    let wanted: Vec<f64> =
        parts["rows"].as_array().unwrap().iter().map(|row| row["loss"].as_f64().unwrap()).collect();
    let got: Vec<f64> = rows(0).iter().map(|row| row["loss"].as_f64().unwrap()).collect();
    assert!(got == wanted && got.len() > 5, "{got:?} {wanted:?}");
    assert_eq!((&rows(0)[0]["left_out"], &rows(0)[1]["left_out"]), (&"nothing".into(), &"diffuse".into()));
    let options = ["--params", "truth.toml", "--axis", "filter", "--axis", "irradiance"];
    done(sandbox.run(&[&["tradeoff", "scene.toml", "-o", "cost"][..], &options].concat()));
    let cost = sandbox.json("cost/results.json");
    let wanted: Vec<f64> = cost["axes"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|axis| axis["settings"].as_array().unwrap().clone())
        .map(|setting| setting["error"]["relative"].as_f64().unwrap())
        .collect();
    let got: Vec<f64> = rows(1).iter().map(|row| row["relative_rms"].as_f64().unwrap()).collect();
    assert!(got == wanted && got.len() > 5, "{got:?} {wanted:?}");
    // One table of all; times are there when they are asked for.
    collect(&sandbox, "all.csv").done();
    let table = sandbox.text("all.csv");
    let header = table.lines().next().unwrap();
    let wanted = "job,axes,command,params,refit,solver,left_out,axis,setting,";
    assert!(header.starts_with(wanted) && !header.contains("seconds"), "{header}");
    assert_eq!(table.lines().count(), 1 + rows(0).len() + rows(1).len() + 1);
    assert!(table.lines().last().unwrap().starts_with("2,,fit,,,lm,,,,"), "{table}");
    sandbox.run(&["collect", "plan.toml", "-o", "times.csv", "--seconds"]).done();
    assert!(
        sandbox.text("times.csv").lines().next().unwrap().contains(",seconds,seconds.job,seconds.lower,")
    );
    // Other constants are another job.
    let truth = sandbox.text("truth.toml");
    sandbox.write("truth.toml", format!("{truth}\n").as_bytes());
    let ran = collect(&sandbox, "some.csv");
    assert!(ran.code == Some(1) && ran.err.contains("jobs without a result, by number: 1."), "{ran:?}");
    sandbox.remove("truth.toml");
    sandbox
        .run(&["sweep", "plan.toml", "--list"])
        .refused(&["truth.toml: the constants of job 1 cannot be read"]);
}

#[test]
fn a_job_that_fails_is_named_and_tried_again() {
    let sandbox = sandbox();
    sandbox.remove("targets/front.exr");
    let ran = sandbox.run(&["sweep", "plan.toml"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.err.contains("targets/front.exr: there is no such file"), "{ran:?}");
    assert!(ran.out.contains("0 now, 4 failed"), "{ran:?}");
    let ran = collect(&sandbox, "none.csv");
    assert_eq!(ran.code, Some(1));
    assert!(ran.err.contains("plan.toml: job 3 failed: "), "{ran:?}");
    sandbox.write("targets/front.exr", &Sandbox::new().read("targets/front.exr"));
    sandbox.run(&["sweep", "plan.toml"]).done();
    collect(&sandbox, "all.csv").done();
}

#[test]
fn plans_and_tables_that_make_no_sense_are_refused() {
    let sandbox = sandbox();
    let plan = |from: &str, to: &str| {
        sandbox.write("plan.toml", PLAN.replacen(from, to, 1).as_bytes());
        sandbox.run(&["sweep", "plan.toml", "--list"])
    };
    plan("\"fit\"", "\"fits\"").refused(&["plan.toml: line 1: unknown command `fits`. Did you mean `fit`?"]);
    plan("fit.loss", "fit.los").refused(&["plan.toml: job 0: fit.los = \"l2\": unknown key `los`"]);
    plan("\"scene.toml\"", "\"none.toml\"").refused(&["none.toml", "cannot be read"]);
    sandbox.write("plan.toml", PLAN.as_bytes());
    sandbox.run(&["sweep", "plan.toml", "--run", "4"]).refused(&["there is no job `4`", "0 to 3"]);
    collect(&sandbox, "all.txt").refused(&["all.txt: a table is .csv or .json"]);
    assert!(!sandbox.path("out").exists());
}

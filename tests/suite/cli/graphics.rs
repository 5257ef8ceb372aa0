//! Rendering on a graphics adapter, and without one.

use serde_json::Value;

use super::sandbox::{Ran, Sandbox};
use crate::fixtures::read_exr;

/// Whether there is an adapter; where there is none, `SKINFIT_NO_GPU_TESTS` must say that it is no mistake.
fn adapter(sandbox: &Sandbox) -> bool {
    let info: Value = serde_json::from_str(&sandbox.run(&["info", "--json"]).done().out).unwrap();
    if info["engine"] == "gpu" {
        return true;
    }
    let excused = std::env::var_os("SKINFIT_NO_GPU_TESTS").is_some();
    assert!(excused, "{}\nThese tests need an adapter: tests/run installs a software one.", info["why"]);
    eprintln!("NOT CHECKED, as SKINFIT_NO_GPU_TESTS is set: {}", info["why"]);
    false
}

/// The program where no driver answers.
fn without_adapter(sandbox: &Sandbox, arguments: &[&str]) -> Ran {
    let mut command = sandbox.command(arguments);
    for variable in ["VK_ICD_FILENAMES", "VK_DRIVER_FILES"] {
        command.env(variable, sandbox.path("no_such_driver.json"));
    }
    Ran::of(&mut command)
}

#[test]
fn an_image_is_the_same_from_both_engines_and_says_where_it_was_drawn() {
    let sandbox = Sandbox::new();
    if !adapter(&sandbox) {
        return;
    }
    let render = |engine: &str, output: &str| {
        let more = ["--engine", engine, "--params", "truth.toml", "--layers", "--size", "40x24"];
        sandbox.run(&[&["render", "scene.toml", "-o", output], &more[..]].concat()).done().out
    };
    assert_eq!(render("cpu", "cpu.exr"), "wrote cpu.exr (view front; cpu)\n");
    assert!(render("gpu", "gpu.exr").starts_with("wrote gpu.exr (view front; gpu: "));
    assert!(render("auto", "auto.exr").starts_with("wrote auto.exr (view front; gpu: "));
    let [cpu, gpu, auto] = ["cpu.exr", "gpu.exr", "auto.exr"].map(|name| read_exr(&sandbox.path(name)));
    assert!(gpu.planes == auto.planes);
    assert_eq!((gpu.width, gpu.height), (40, 24));
    assert_eq!(cpu.planes.keys().collect::<Vec<_>>(), gpu.planes.keys().collect::<Vec<_>>());
    for (name, plane) in &cpu.planes {
        let mut errors: Vec<f32> = plane.iter().zip(&gpu.planes[name]).map(|(a, b)| (a - b).abs()).collect();
        errors.sort_by(f32::total_cmp);
        // f32 against f64; the sun's edge in a cube of 8 texels is steep. Pixels at the outline may differ by a
        // sample.
        let nine_tenths = errors[errors.len() * 9 / 10];
        assert!(nine_tenths < 1e-3, "{name}: {nine_tenths}");
    }
}

#[test]
fn a_sequence_is_numbered_and_its_first_frame_is_the_still() {
    let sandbox = Sandbox::new();
    for engine in ["cpu", "auto"] {
        if engine == "auto" && !adapter(&sandbox) {
            continue;
        }
        let render = |more: &[&str]| {
            sandbox
                .run(&[&["render", "scene.toml", "--engine", engine, "--antialias", "1x1"], more].concat())
                .done()
                .out
        };
        render(&["-o", "still.png"]);
        let out = render(&["-o", "turn/a.png", "--frames", "3"]);
        assert!(out.starts_with("wrote 3 frames, turn/a.0000.png to turn/a.0002.png (view front; "), "{out}");
        assert_eq!(sandbox.read("turn/a.0000.png"), sandbox.read("still.png"), "{engine}");
        assert_ne!(sandbox.read("turn/a.0001.png"), sandbox.read("turn/a.0002.png"), "{engine}");
        assert!(!sandbox.path("turn/a.png").exists() && !sandbox.path("turn/a.0003.png").exists());
    }
}

#[test]
fn statistics_tell_what_a_frame_took() {
    let sandbox = Sandbox::new();
    let render = |engine: &str| {
        let more = ["--engine", engine, "--stats", "--accuracy", "paper", "-o", "a.png"];
        sandbox.run(&[&["render", "scene.toml"], &more[..]].concat()).done().out
    };
    assert!(render("cpu").contains("shading"));
    if adapter(&sandbox) {
        let out = render("gpu");
        for word in ["uploaded", "MiB", "bindings", "vertex buffers", "rest_position"] {
            assert!(out.contains(word), "{word}: {out}");
        }
    }
}

#[test]
fn adapters_are_told_with_what_will_be_used_and_why() {
    let sandbox = Sandbox::new();
    let text = sandbox.run(&["info"]).done().out;
    assert!(text.contains("render uses: the ") && text.contains("CPU: "), "{text}");
    if adapter(&sandbox) {
        let info: Value = serde_json::from_str(&sandbox.run(&["info", "--json"]).done().out).unwrap();
        let first = &info["adapters"][0];
        assert_eq!(info["adapter"], first["name"]);
        assert!(first["max_texture_side"].as_u64().unwrap() >= 2048, "{info:#}");
        assert_eq!(first["features"].as_array().unwrap().len(), 2, "{info:#}");
    }
}

#[test]
fn without_an_adapter_the_cpu_engine_renders_and_says_which_package_brings_one() {
    let sandbox = Sandbox::new();
    let ran = without_adapter(&sandbox, &["render", "scene.toml", "-o", "a.png"]);
    assert_eq!((ran.code, ran.out.as_str()), (Some(0), "wrote a.png (view front; cpu)\n"), "{ran:?}");
    let package = if cfg!(target_os = "linux") { "mesa-vulkan-drivers" } else { "driver" };
    assert!(ran.err.contains("no graphics adapter") && ran.err.contains(package), "{ran:?}");
    assert_eq!(ran.err.lines().count(), 1, "{ran:?}");
    let arguments = ["render", "scene.toml", "--engine", "gpu", "-o", "b.png"];
    without_adapter(&sandbox, &arguments).refused(&["no graphics adapter", package, "--engine cpu"]);
    assert!(!sandbox.path("b.png").exists());
    let info = without_adapter(&sandbox, &["info"]).done().out;
    assert!(info.contains("the CPU engine") && info.contains(package), "{info}");
}

#[test]
fn what_the_engines_cannot_do_is_refused_before_a_file_is_written() {
    let sandbox = Sandbox::new();
    let gpu = adapter(&sandbox);
    for (more, words) in [
        (&["--size", "40"][..], &["1920x1080"][..]),
        (&["--size", "0x40"], &["1 to 32768 pixels"]),
        (&["--size", "32768x32768"], &["268435456 in all"]),
        (&["--antialias", "3x2"], &["1x1 to 8x8"]),
        (&["--accuracy", "good"], &["`exact`, `paper`"]),
        (&["--frames", "0"], &["0 is not in 1..=100000"]),
        (&["--animate"], &["--frames"]),
    ] {
        let ran = sandbox.run(&[&["render", "scene.toml", "-o", "a.png"], more].concat());
        assert_eq!(ran.code, Some(2), "{ran:?}");
        assert!(words.iter().all(|word| ran.err.contains(word)), "{ran:?}");
    }
    let refused = |more: &[&str], words: &[&str]| {
        sandbox.run(&[&["render", "scene.toml", "-o", "a.png"], more].concat()).refused(words);
    };
    refused(&["--engine", "cpu", "--antialias", "msaa4"], &["msaa4", "2x2"]);
    refused(&["--engine", "cpu", "--frames", "2", "--animate"], &["no animation", "--animate"]);
    if gpu {
        refused(&["--engine", "gpu", "--adapter", "Voodoo"], &["Voodoo", "There is: "]);
        let info: Value = serde_json::from_str(&sandbox.run(&["info", "--json"]).done().out).unwrap();
        // A card whose images may have the longest side that there is has none to refuse.
        let adapters = info["adapters"].as_array().unwrap();
        let ours = adapters.iter().find(|adapter| adapter["name"] == info["adapter"]).unwrap();
        if ours["max_texture_side"].as_u64().unwrap() < 32768 {
            refused(&["--engine", "gpu", "--size", "32768x16"], &["a side may have", "--size"]);
        }
    }
    assert!(!sandbox.path("a.png").exists());
}

#[test]
fn an_ablation_times_the_renderer_where_it_is_asked_to() {
    let sandbox = Sandbox::new();
    if !adapter(&sandbox) {
        return;
    }
    let ablate = |to: &str, when: &str| {
        sandbox.run(&["ablate", "scene.toml", "-o", to, "--gpu", when, "--params", "truth.toml"]).done();
        let results: Value = sandbox.json(&format!("{to}/results.json"));
        let rows = results["rows"].as_array().unwrap().clone();
        (
            results["adapter"].clone(),
            rows.iter().map(|row| row["gpu"]["seconds"]["median"].clone()).collect::<Vec<_>>(),
        )
    };
    let (name, times) = ablate("timed", "always");
    assert!(name.as_str().is_some_and(|name| !name.is_empty()));
    assert!(
        times.len() == 9 && times.iter().all(|time| time.as_f64().is_some_and(|time| time > 0.0)),
        "{times:?}"
    );
    let (name, times) = ablate("untimed", "never");
    assert!(name.is_null() && times.iter().all(Value::is_null), "{times:?}");
}

#[test]
fn a_fit_over_the_adapters_own_samples_says_so_and_ends_where_the_others_do() {
    let sandbox = Sandbox::new();
    let refused = |arguments: &[&str], words: &[&str]| {
        sandbox.run(&[&["fit", "scene.toml", "--samples", "gpu"], arguments].concat()).refused(words);
    };
    refused(&["--engine", "cpu"], &["--samples gpu", "--engine cpu"]);
    if !adapter(&sandbox) {
        return;
    }
    let fit = |run: &str, more: &[&str]| {
        let ran = sandbox.run(&[&["fit", "scene.toml", "-o", run, "--verify"], more].concat());
        assert_eq!(ran.code, Some(0), "{ran:?}");
        (ran, sandbox.json(&format!("{run}/report.json")))
    };
    let (cpu, uploaded) = fit("cpu", &["--engine", "gpu"]);
    assert!(cpu.out.contains("samples made by the CPU in"), "{}", cpu.out);
    let (gpu, own) = fit("gpu", &["--samples", "gpu"]);
    assert!(gpu.out.contains("samples made by the GPU in"), "{}", gpu.out);
    assert!(gpu.err.contains("verified against the model in f64"), "{}", gpu.err);
    // Where they may not stay, the CPU makes them after all.
    let (little, streamed) = fit("little", &["--samples", "gpu", "--device-memory", "0"]);
    assert!(little.err.contains("The CPU makes the samples."), "{}", little.err);
    assert!(little.out.contains("samples made by the CPU in"), "{}", little.out);
    let seconds = streamed["seconds"]["samples"].as_f64().unwrap();
    assert!(seconds > 0.0, "tracing is not timed");
    // The targets are the CPU's own images: what is left are samples at outlines, a few in a hundred of these small
    // images' pixels.
    let left = |report: &Value| {
        let loss = |key: &str| report["loss"][key].as_f64().unwrap();
        loss("end") / loss("start")
    };
    println!("left: {} uploaded, {} streamed, {} own", left(&uploaded), left(&streamed), left(&own));
    assert!(left(&uploaded) < 1e-6 && left(&streamed) < 1e-6, "{uploaded} {streamed}");
    assert!(left(&own) < 1e-3, "{own}");
    let samples = |report: &Value| report["samples"].as_f64().unwrap();
    assert!(
        (samples(&own) / samples(&uploaded) - 1.0).abs() < 0.01,
        "{} {}",
        samples(&own),
        samples(&uploaded)
    );
}

#[test]
fn a_fit_goes_on_where_another_engine_or_other_samples_left_it() {
    let sandbox = Sandbox::new();
    if !adapter(&sandbox) {
        return;
    }
    let made: [&[&str]; 3] = [&["--engine", "cpu"], &["--engine", "gpu"], &["--samples", "gpu"]];
    for (from, to) in [(0, 1), (1, 0), (2, 0), (1, 2)] {
        let ran = sandbox.fit("run", &[made[from], &["--max-iterations", "1"]].concat());
        assert_eq!(ran.code, Some(1), "{ran:?}");
        let loss = |key: &str| sandbox.json("run/report.json")["loss"][key].as_f64().unwrap();
        let before = loss("end");
        let ran = sandbox.fit("run", &[made[to], &["--resume"]].concat());
        assert_eq!(ran.code, Some(0), "{:?} {:?}: {ran:?}", made[from], made[to]);
        assert!(loss("end") < before, "{:?} {:?}", made[from], made[to]);
    }
}

#[cfg(feature = "burn")]
#[test]
fn a_fit_with_maps_is_not_gone_on_from_without_them() {
    let sandbox = Sandbox::new();
    if !adapter(&sandbox) {
        return;
    }
    sandbox.edit("[quality]", "[fit.maps]\nrounds = 1\nsteps = 1\n[quality]");
    let ran = sandbox.fit("run", &["--maps", "specular,color", "--max-iterations", "1"]);
    assert!(ran.code.is_some_and(|code| code < 2), "{ran:?}");
    // Its constants belong to maps that no state holds.
    sandbox.fit("run", &["--resume"]).refused(&["run/state.json", "without --resume"]);
}

#[test]
fn every_loss_is_verified_on_both_engines() {
    let sandbox = Sandbox::new();
    let gpu = adapter(&sandbox);
    for engine in if gpu { &["cpu", "gpu"][..] } else { &["cpu"] } {
        for loss in ["l2", "huber", "smape"] {
            let ran = sandbox
                .fit("run", &["--engine", engine, "--verify", "--loss", loss, "--max-iterations", "1"]);
            assert!(ran.err.contains("verified against the model in f64"), "{engine} {loss}: {ran:?}");
        }
    }
}

#[test]
fn options_of_an_adapter_are_refused_where_none_is_used() {
    let sandbox = Sandbox::new();
    for (option, value) in [("--adapter", "llvmpipe"), ("--device-memory", "10")] {
        sandbox.fit("run", &["--engine", "cpu", option, value]).refused(&[option, "--engine cpu"]);
    }
    if !adapter(&sandbox) {
        return;
    }
    // More than any number of bytes is as much as there is.
    sandbox.fit("run", &["--engine", "gpu", "--device-memory", "18446744073710"]).done();
    sandbox.edit(
        "\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"side_specular\", \"hilite\", \"reflection\"",
        "\"normal_map\"",
    );
    sandbox.edit("free = [", "free = [] #");
    let ran = sandbox.fit("nothing", &["--engine", "gpu"]);
    ran.refused(&["none of the enabled effects shows anything", "diffuse", "--engine cpu"]);
}

#[test]
fn without_an_adapter_each_command_says_how_it_does_without() {
    let sandbox = Sandbox::new();
    let fit =
        |more: &[&str]| without_adapter(&sandbox, &[&["fit", "scene.toml", "-o", "run"], more].concat());
    fit(&["--engine", "gpu"]).refused(&["no graphics adapter was found", "--engine cpu"]);
    if cfg!(feature = "burn") {
        fit(&["--maps", "color"]).refused(&["no graphics adapter was found", "leave --maps out"]);
    }
}

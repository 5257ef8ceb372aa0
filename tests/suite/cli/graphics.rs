//! Rendering on a graphics adapter, and without one.

use serde_json::Value;
use skinfit::scene::Loss;

use super::sandbox::{Ran, Sandbox};
use crate::fixtures::read_exr;

/// Whether there is an adapter; where there is none, `SKINFIT_NO_GPU_TESTS` must say that it is no mistake.
pub(super) fn adapter(sandbox: &Sandbox) -> bool {
    let info: Value = serde_json::from_str(&sandbox.run(&["info", "--json"]).done().out).unwrap();
    if info["engine"] == "gpu" {
        return true;
    }
    let excused = std::env::var_os("SKINFIT_NO_GPU_TESTS").is_some();
    assert!(excused, "{}\nThese tests need an adapter: tests/run installs a software one.", info["why"]);
    crate::common::not_checked(&format!("SKINFIT_NO_GPU_TESTS is set: {}", info["why"]));
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
        let more = [
            "--engine",
            engine,
            "--params",
            "truth.toml",
            "--layers",
            "--size",
            "40x24",
            "--antialias",
            "2x2",
        ];
        sandbox.run(&[&["render", "scene.toml", "-o", output], &more[..]].concat()).done().out
    };
    assert_eq!(render("cpu", "cpu.exr"), "wrote cpu.exr (view front; cpu)\n");
    let said = render("gpu", "gpu.exr");
    assert!(said.starts_with("wrote gpu.exr (view front; gpu: "));
    let software = said.contains("(software)");
    assert!(render("auto", "auto.exr").starts_with("wrote auto.exr (view front; gpu: "));
    let [cpu, gpu, auto] = ["cpu.exr", "gpu.exr", "auto.exr"].map(|name| read_exr(&sandbox.path(name)));
    assert!(gpu.planes == auto.planes);
    assert_eq!((gpu.width, gpu.height), (40, 24));
    assert_eq!(cpu.planes.keys().collect::<Vec<_>>(), gpu.planes.keys().collect::<Vec<_>>());
    // Pixels that both cover wholly, and those that both cover in part: the background says nothing.
    let (of_cpu, of_gpu) = (&cpu.planes["A"], &gpu.planes["A"]);
    let pixels = |wanted: &dyn Fn(f32) -> bool| -> Vec<usize> {
        (0..of_cpu.len()).filter(|&i| wanted(of_cpu[i]) && wanted(of_gpu[i])).collect()
    };
    let inside = pixels(&|alpha| alpha == 1.0);
    let outline = pixels(&|alpha| alpha > 0.0 && alpha < 1.0);
    assert!(inside.len() > 150 && outline.len() > 10, "{} and {}", inside.len(), outline.len());
    // A rasteriser that snaps corners to 1/256 of a sample covers one pixel of a hundred otherwise.
    let covered = inside.len() + outline.len();
    let other = (0..of_cpu.len()).filter(|&i| of_cpu[i] != of_gpu[i]).count();
    assert!(100 * other <= covered, "{other} of {covered} pixels are covered otherwise");
    // On software f32 against f64, some dozens of roundings of 6e-8: 4e-6 was found, of the layer that holds a sun's edge.
    // Hardware reads the surface up to 1/256 of a sample beside where the ray hits: 2e-3 of what changes from pixel to
    // pixel, which on these maps of 16 texels is all there is, and several times that at a slant.
    let most = if software { 1e-5 } else { 2e-2 };
    for (name, plane) in &cpu.planes {
        let brightest = plane.iter().fold(0.0_f32, |most, x| most.max(x.abs())).max(1e-6);
        let same = inside.iter().chain(outline.iter().filter(|&&i| of_cpu[i] == of_gpu[i]));
        let worst = same.map(|&i| (plane[i] - gpu.planes[name][i]).abs() / brightest).fold(0.0, f32::max);
        println!("{name}: off by at most {worst:.1e} of {brightest}");
        assert!(worst <= most, "{name}: {worst}");
    }
}

#[test]
fn haze_is_rendered_as_a_layer_of_its_own_and_its_weight_fitted_to_it() {
    let sandbox = Sandbox::new();
    sandbox.edit("\"reflection\"]", "\"reflection\", \"haze\"]");
    let truth = sandbox.text("truth.toml") + "haze_weight = 0.37\n";
    sandbox.write("truth.toml", truth.as_bytes());
    let render = |view: &str, more: &[&str]| {
        let path = format!("hazy/{view}.exr");
        let render = [
            "render",
            "scene.toml",
            "--engine",
            "cpu",
            "--params",
            "truth.toml",
            "--view",
            view,
            "-o",
            &path,
        ];
        sandbox.run(&[&render[..], more].concat()).done();
        read_exr(&sandbox.path(&path))
    };
    // The effect is asked for by name: it shows with and without other layers, and alpha stays coverage.
    let plain = render("front", &[]);
    assert!(plain.planes["haze.Y"].iter().any(|&haze| haze > 0.01));
    assert!(
        plain.planes["A"].iter().all(|alpha| [0.0, 1.0].contains(alpha))
            && !plain.planes.contains_key("diffuse.R")
    );
    let layers = render("front", &["--layers"]);
    assert!(layers.planes["haze.Y"] == plain.planes["haze.Y"] && layers.planes.contains_key("diffuse.R"));
    render("side", &[]);
    for view in ["front", "side"] {
        let file = format!("hazy/{view}.exr");
        sandbox.edit(&format!("\"targets/{view}.exr\""), &format!("\"{file}\"\nhaze = \"{file}\""));
    }
    sandbox.edit("free = [", "free = [\"haze_weight\", ");
    let mut engines = vec!["cpu"];
    if adapter(&sandbox) {
        engines.push("gpu");
    }
    for engine in engines {
        sandbox.fit(engine, &["--engine", engine]).done();
        let report = sandbox.json(&format!("{engine}/report.json"));
        let haze = &report["params"]["haze_weight"];
        assert_eq!(
            (haze["start"].as_f64(), haze["identifiable"].as_bool()),
            (Some(1.0), Some(true)),
            "{engine}"
        );
        let value = haze["value"].as_f64().unwrap();
        // As the other constants: targets are f32, and the GPU's sums too.
        assert!((value - 0.37).abs() < 1e-4 * 0.37, "{engine}: {value}");
        let terms = read_exr(&sandbox.path(&format!("{engine}/front_terms.exr")));
        let apart = terms.planes["haze.Y"].iter().zip(&plain.planes["haze.Y"]).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f32::max) < 1e-3, "{engine}");
    }
}

#[test]
fn a_background_stands_behind_the_mesh_and_is_a_layer_of_its_own() {
    let sandbox = Sandbox::new();
    let render = |engine: &str, what: &str| {
        let more = ["--engine", engine, "--background", what, "--layers", "--size", "40x24", "-o", "a.exr"];
        sandbox.run(&[&["render", "scene.toml"], &more[..]].concat()).done();
        read_exr(&sandbox.path("a.exr"))
    };
    for engine in ["cpu", "gpu"] {
        if engine == "gpu" && !adapter(&sandbox) {
            continue;
        }
        for what in ["environment", "0.5,0.25,0"] {
            let seen = render(engine, what);
            assert!(seen.planes["A"].iter().all(|&alpha| alpha == 1.0), "{engine} {what}");
            for channel in ["R", "G", "B"] {
                let layers: Vec<&Vec<f32>> = (seen.planes.iter())
                    .filter(|(name, _)| name.ends_with(&format!(".{channel}")))
                    .map(|(_, plane)| plane)
                    .collect();
                assert_eq!(layers.len(), 6, "{:?}", seen.planes.keys());
                for (i, whole) in seen.planes[channel].iter().enumerate() {
                    let sum: f32 = layers.iter().map(|plane| plane[i]).sum();
                    assert!((sum - whole).abs() < 1e-5 * (1.0 + whole), "{engine} {what}: {sum} {whole}");
                }
            }
        }
        // The corner is the colour itself.
        assert_eq!(render(engine, "0.5,0.25,0").planes["G"][0], 0.25);
        assert!(render(engine, "none").planes["A"][0] == 0.0);
    }
    let refused = |what: &str| {
        let ran = sandbox.run(&["render", "scene.toml", "-o", "b.exr", "--background", what]);
        assert!(ran.code == Some(2) && ran.err.contains("none, environment, or three"), "{ran:?}");
    };
    ["sky", "1,2", "1,2,3,4", "1,-2,3", "nan,0,0", "1,2,x"].into_iter().for_each(refused);
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
        (&["--fps", "24"], &["--animate"]),
        (&["--animate", "--fps", "0"], &["such as 24"]),
        (&["--animate", "--frames", "2", "--loops", "2"], &["--fps"]),
        (&["--animate", "--fps", "24", "--occlusion-rate", "4"], &["--occlusion frames"]),
        (&["--frames", "2", "--occlusion", "frames"], &["--animate"]),
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
    // The targets are without noise: what is left of the loss are roundings, whoever made the samples.
    for report in [&own, &uploaded, &streamed] {
        assert_eq!(report["errors"]["basis"], "rounding", "{report}");
    }
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
    sandbox.fit("run", &["--resume"]).refused(&["run/state.json", "afresh"]);
}

#[test]
fn every_loss_is_verified_on_both_engines() {
    let sandbox = Sandbox::new();
    let gpu = adapter(&sandbox);
    // The scene's own loss, the default's, which no option names, and each that there is.
    sandbox.edit("loss = \"relative_l2\"\n", "");
    for engine in if gpu { &["cpu", "gpu"][..] } else { &["cpu"] } {
        for loss in [None].into_iter().chain(Loss::ALL.map(|loss| Some(loss.name()))) {
            let named: Vec<&str> = loss.map_or_else(Vec::new, |loss| vec!["--loss", loss]);
            let more = [&["--engine", engine, "--verify", "--max-iterations", "1"], &named[..]].concat();
            let ran = sandbox.fit("run", &more);
            assert!(ran.err.contains("verified against the model in f64"), "{engine} {loss:?}: {ran:?}");
            let report = sandbox.json("run/report.json");
            assert_eq!(report["loss_name"], loss.unwrap_or("relative_l2"), "{engine}");
            assert_eq!(report["engine"], *engine);
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

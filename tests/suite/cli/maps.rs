//! `fit --maps`: maps beside the constants, a view held out, and what is refused.

#[cfg(feature = "burn")]
use super::sandbox::{Ran, files, mesh};
use super::sandbox::{SCENE, Sandbox};
#[cfg(feature = "burn")]
use crate::fixtures::read_exr;

#[cfg(not(feature = "burn"))]
#[test]
fn a_program_without_the_fit_of_maps_says_how_to_build_it() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &["--maps", "color"]).refused(&["--maps", "cargo build --release --features burn"]);
    assert!(!sandbox.path("run").exists());
}

#[cfg(feature = "burn")]
#[test]
fn a_fit_of_maps_leaves_them_as_images_and_in_the_scene_file() {
    let sandbox = Sandbox::new();
    // The map is gone: white is where the fit starts.
    sandbox.edit("color = \"color.png\"\n", "");
    sandbox.edit("loss = ", "maps = { rounds = 2, steps = 4, color = { smoothness = 0.0 } }\nloss = ");
    let ran = sandbox.fit("run", &["--maps", "color,occlusion", "--hold-out", "side"]);
    let ran = warned(ran, &["run: a scene file has no key for", "occlusion (maps/occlusion_fitted.csv)"]);
    assert!(ran.out.contains("front") && ran.out.contains("dB (held out)"), "{}", ran.out);
    assert!(ran.out.contains("maps, round 1 of 2: loss ") && ran.out.contains("maps, round 2 of 2: loss "));
    let report = sandbox.json("run/maps.json");
    let views = report["views"].as_array().unwrap();
    let psnr = |view: usize, when: &str| views[view][when]["psnr"].as_f64().unwrap();
    assert_eq!((views[0]["held_out"].as_bool(), views[1]["held_out"].as_bool()), (Some(false), Some(true)));
    assert!(psnr(0, "after") > psnr(0, "before") + 3.0, "{report}");
    // Two maps and the constants in each of two rounds, and no step makes it worse by more than rounding.
    let steps = report["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 6);
    for step in steps {
        let (before, after) = (step["before"].as_f64().unwrap(), step["after"].as_f64().unwrap());
        assert!(after <= before * (1.0 + 1e-5), "{step}");
    }
    for name in ["color", "occlusion"] {
        for what in ["initial", "fitted", "change"] {
            for ending in ["png", "exr"] {
                assert!(
                    sandbox.path(&format!("run/maps/{name}_{what}.{ending}")).exists(),
                    "{name}_{what}.{ending}"
                );
            }
        }
    }
    // Every vertex' number stands in the table.
    let table = sandbox.text("run/maps/occlusion_fitted.csv");
    assert_eq!((table.lines().next(), table.lines().count()), (Some("vertex,open"), 1 + 17 * 25));
    check_change(&sandbox, "color");
    check_report(&sandbox);
    // The view that was held out is no part of the fit that is reported.
    assert!(sandbox.json("run/report.json")["views"].get("side").is_none());
    assert!(sandbox.text("run/scene.toml").contains("maps/color_fitted.exr"));
    sandbox
        .run(&[
            "render",
            "run/scene.toml",
            "--params",
            "run/params.toml",
            "--engine",
            "cpu",
            "-o",
            "again.exr",
        ])
        .done();
    assert!(sandbox.path("again.exr").exists());
}

#[cfg(feature = "burn")]
#[test]
fn a_fit_of_the_light_holds_what_turns_and_blurs_it() {
    let sandbox = Sandbox::new();
    sandbox.edit("loss = ", "maps = { rounds = 1, steps = 2 }\nloss = ");
    let ran = sandbox.fit("run", &["--maps", "environment"]);
    let told: Vec<&str> = ran.err.lines().collect();
    assert!(ran.code == Some(0) && told.len() == 2, "{ran:?}");
    assert!(told.iter().all(|line| line.starts_with("skinfit: warning: ")), "{ran:?}");
    assert!(told[0].contains("scene.toml") && told[0].contains("held at the start values"), "{ran:?}");
    assert!(told[0].ends_with(": specular_lobe."), "{ran:?}");
    assert!(told[1].contains("irradiance (maps/irradiance_fitted.exr)") && told[1].contains("hilite"));
    assert!(sandbox.json("run/report.json")["params"].get("specular_lobe").is_none());
    for cube in ["irradiance", "lobe", "hilite"] {
        assert!(sandbox.path(&format!("run/maps/{cube}_fitted.exr")).exists(), "{cube}");
    }
}

#[cfg(feature = "burn")]
#[test]
fn the_roughness_of_a_lobe_is_fitted_beside_maps() {
    let sandbox = Sandbox::new();
    sandbox.edit("\"reflection\"]", "\"reflection\", \"fresnel\"]");
    sandbox.edit("free = [", "free = [\"roughness\", \"gloss\", ");
    sandbox.edit("loss = ", "maps = { rounds = 1, steps = 2 }\nloss = ");
    sandbox.edit("hilite = 0.7\n", "hilite = 0.7\nroughness = 0.4\ngloss = 0.2\n");
    sandbox.fit("run", &["--maps", "color"]).done();
    let report = sandbox.json("run/report.json");
    let moved = |(name, start): (&str, f64)| {
        let value = report["params"][name]["value"].as_f64().unwrap_or_else(|| panic!("{name}: {report}"));
        (value - start).abs() > 1e-3
    };
    assert!([("roughness", 0.4), ("gloss", 0.2)].into_iter().any(moved), "{}", report["params"]);
}

#[cfg(feature = "burn")]
#[test]
fn what_cannot_be_held_out_or_fitted_is_refused_and_leaves_nothing() {
    let refused = |scene: &str, arguments: &[&str], words: &[&str]| {
        let sandbox = Sandbox::new();
        sandbox.write("scene.toml", scene.as_bytes());
        let before = files(&sandbox.path("")).len();
        sandbox.fit("deep/run", arguments).refused(words);
        assert_eq!(files(&sandbox.path("")).len(), before, "files were left");
    };
    let maps = ["--maps", "color", "--hold-out"];
    refused(SCENE, &[&maps[..], &["sid"]].concat(), &["no view `sid`", "side"]);
    let (one, _) = SCENE.split_once("[[view]]\nname = \"side\"").unwrap();
    let (_, fit) = SCENE.split_once("[fit]").unwrap();
    refused(&format!("{one}[fit]{fit}"), &[&maps[..], &["front"]].concat(), &["nothing is left to fit"]);
    let without = SCENE.replace("\"side_specular\", ", "");
    refused(&without, &["--maps", "specular"], &["specular", "side_specular"]);
    let glossy = SCENE.replace("\"reflection\"]", "\"reflection\", \"fresnel\"]");
    let glossy = glossy.replace(", \"specular_lobe\"]", "]");
    refused(&glossy, &["--maps", "environment"], &["environment cannot be fitted beside the effect fresnel"]);
}

/// Ended well, with a warning that holds all of `words`.
#[cfg(feature = "burn")]
fn warned(ran: Ran, words: &[&str]) -> Ran {
    assert!(ran.code == Some(0) && ran.err.starts_with("skinfit: warning: "), "{ran:?}");
    assert_eq!(ran.err.lines().count(), 1, "{ran:?}");
    assert!(words.iter().all(|word| ran.err.contains(word)), "{ran:?}");
    ran
}

/// The change of a map is what it is now less what it was.
#[cfg(feature = "burn")]
fn check_change(sandbox: &Sandbox, name: &str) {
    let texels = |what: &str| {
        let planes = read_exr(&sandbox.path(&format!("run/maps/{name}_{what}.exr")));
        planes.rgb(["R", "G", "B"]).concat()
    };
    let [initial, fitted, change] = ["initial", "fitted", "change"].map(texels);
    let mut largest = 0.0_f32;
    for i in 0..change.len() {
        assert_eq!(change[i], fitted[i] - initial[i], "{i}");
        largest = largest.max(change[i].abs());
    }
    let report = sandbox.json("run/maps.json");
    let told = report["maps"].as_array().unwrap().iter().find(|map| map["name"] == name).unwrap();
    assert!(largest > 0.01 && told["largest_change"].as_f64() == Some(largest.into()), "{told}");
}

/// The report tells that maps were fitted, and how well they do.
#[cfg(feature = "burn")]
fn check_report(sandbox: &Sandbox) {
    let report = sandbox.json("run/report.json");
    let gained = &report["maps"]["views"];
    let psnr = |view: &str, when: &str| gained[view][when]["psnr"].as_f64().unwrap();
    assert!(psnr("front", "after") > psnr("front", "before") + 3.0, "{gained}");
    assert_eq!(gained["side"]["held_out"], true);
    assert_eq!(report["maps"]["interrupted"], false);
    assert!(report["maps"]["largest_change"]["color"].as_f64().unwrap() > 0.01);
    assert!(report["seconds"]["maps"].as_f64().unwrap() > 0.0);
    assert_eq!(report["provenance"]["fitted maps"], "color, occlusion");
    assert_eq!(report["provenance"]["held out"], "side");
    let files: Vec<_> = report["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    for name in ["maps.json", "maps/color_fitted.exr", "maps/occlusion_fitted.csv", "maps/color_change.png"] {
        assert!(files.contains(&name), "{name}: {files:?}");
    }
    assert!(files.iter().all(|name| sandbox.path(&format!("run/{name}")).exists()));
    assert!(report["warnings"][0].as_str().unwrap().contains("occlusion"));
    let page = sandbox.text("run/report.html");
    for part in [
        "<section id=\"maps\">",
        "held out",
        "fitted of map color",
        "change of map occlusion",
        "holds the maps",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

/// Two rounds of little smoothness: priors leave the loss to the images.
#[cfg(feature = "burn")]
const FREE: &str = "{ smoothness = 0.0, closeness = 0.0 }";

#[cfg(feature = "burn")]
#[test]
fn each_step_begins_where_the_last_one_ended_and_so_does_the_final_solve() {
    let sandbox = Sandbox::new();
    // Far from the truth, and free: the specular cube is another one after each solve of the constants.
    sandbox.edit("hilite = 0.7\n", "hilite = 0.7\nspecular_lobe = 40.0\n");
    let maps = format!("maps = {{ rounds = 3, steps = 2, color = {FREE}, specular = {FREE} }}\nloss = ");
    sandbox.edit("loss = ", &maps);
    sandbox.edit("color = \"color.png\"\n", "");
    sandbox.fit("run", &["--maps", "color,specular"]).done();
    let report = sandbox.json("run/maps.json");
    let steps = report["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 9);
    let number = |step: &serde_json::Value, key: &str| step[key].as_f64().unwrap();
    // What differs is f32 on the adapter against sums in f64 on the CPU.
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * a;
    for pair in steps.windows(2) {
        let (after, before) = (number(&pair[0], "after"), number(&pair[1], "before"));
        assert!(near(after, before), "{pair:?}");
        assert_eq!(number(&pair[0], "prior"), 0.0);
    }
    let loss = &sandbox.json("run/report.json")["loss"];
    assert!(near(number(&steps[8], "after"), number(loss, "start")), "{} {loss}", steps[8]);
    // The scene that is left starts there too: a fit of it has next to nothing to do.
    sandbox.run(&["fit", "run/scene.toml", "-o", "again"]).done();
    let again = &sandbox.json("again/report.json")["loss"];
    assert!(near(number(loss, "start"), number(again, "start")), "{loss} {again}");
}

#[cfg(feature = "burn")]
#[test]
fn a_later_fit_removes_the_maps_of_an_earlier_one_unless_its_scene_names_them() {
    let sandbox = Sandbox::new();
    sandbox.edit("loss = ", "maps = { rounds = 1, steps = 1 }\nloss = ");
    let exists = |name: &str| sandbox.path(&format!("run/{name}")).exists();
    let maps = ["--maps", "color,specular"];
    sandbox.fit("run", &[]).done();
    assert!(exists("state.json"));
    sandbox.fit("run", &maps).done();
    assert!(!exists("state.json"), "a state of another fit was left");
    // The scene in the folder names the maps there.
    sandbox.run(&["fit", "run/scene.toml", "-o", "run"]).done();
    for name in ["maps/color_fitted.exr", "maps/specular_fitted.exr"] {
        assert!(exists(name), "{name} was removed");
    }
    for name in ["maps.json", "maps/color_initial.png", "maps/specular_change.exr"] {
        assert!(!exists(name), "{name} was left");
    }
    sandbox.write("run/maps/mine.txt", b"mine");
    sandbox.fit("run", &["--maps", "color"]).done();
    assert!(exists("maps/color_fitted.exr") && !exists("maps/specular_fitted.exr"));
    sandbox.fit("run", &[]).done();
    assert!(!exists("maps/color_fitted.exr") && exists("maps/mine.txt"));
    std::fs::remove_file(sandbox.path("run/maps/mine.txt")).unwrap();
    sandbox.fit("run", &maps).done();
    sandbox.fit("run", &[]).done();
    assert!(!exists("maps"), "an empty folder was left");
}

#[cfg(all(unix, feature = "burn"))]
#[test]
fn ctrl_c_leaves_the_maps_so_far_and_says_how_to_go_on() {
    use std::io::{BufRead as _, BufReader, Read as _};
    use std::process::{Command, Stdio};

    let sandbox = Sandbox::new();
    // Without its map, the scene is far from what the constants alone could meet.
    sandbox.edit("color = \"color.png\"\n", "");
    // A step is all that a round needs to come nearer; 1000 rounds do not end by themselves.
    sandbox.edit("loss = ", "maps = { rounds = 1000, steps = 1 }\nloss = ");
    let mut command = sandbox.command(&["fit", "scene.toml", "-o", "run", "--maps", "color"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    out.read_line(&mut line).unwrap();
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    out.read_to_string(&mut line).unwrap();
    let mut err = String::new();
    child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    let code = child.wait().unwrap().code();
    assert!(interrupted.unwrap().success() && line.starts_with("maps, round 1 of 1000: "), "{line} {err}");
    assert_eq!(code, Some(1), "{err}");
    let command = "skinfit fit run/scene.toml --maps color";
    assert!(err.contains("run: the fit of the maps was interrupted") && err.contains(command), "{err}");
    assert!(!err.contains("--resume"), "{err}");
    assert!(line.lines().last().unwrap().starts_with("run: final loss "), "{line}");
    let report = sandbox.json("run/report.json");
    assert_eq!((&report["ending"], &report["maps"]["interrupted"]), (&"interrupted".into(), &true.into()));
    assert_eq!(sandbox.json("run/maps.json")["interrupted"], true);
    assert!(sandbox.text("run/report.html").contains("The fit of the maps was interrupted"));
    // What is advised goes on from the maps that are there, into the same folder or another: a fit that began with
    // white again would be as far off as this one was.
    let begins_with = || sandbox.json("run/maps.json")["steps"][0]["before"].as_f64().unwrap();
    let (white, fitted) = (begins_with(), report["loss"]["end"].as_f64().unwrap());
    assert!(fitted < 0.5 * white, "{fitted} is too near to {white} to tell");
    let text = sandbox.text("run/scene.toml");
    assert!(text.contains("maps/color_fitted.exr"));
    let once = text.replace("rounds = 1000", "rounds = 1");
    assert_ne!(once, text);
    sandbox.write("run/scene.toml", once.as_bytes());
    sandbox.run(&["fit", "run/scene.toml", "--maps", "color", "-o", "run"]).done();
    let again = begins_with();
    assert!(again <= fitted * 1.01, "{again} after {fitted}");
}

#[cfg(feature = "burn")]
#[test]
fn without_texture_coordinates_textures_are_refused_and_vertices_are_fitted() {
    let sandbox = Sandbox::new();
    let bare = mesh(|json, _| {
        json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    });
    sandbox.write("mesh.glb", &bare);
    for map in ["color", "normal", "specular", "attenuator"] {
        sandbox.edit(&format!("{map} = \"{map}.png\"\n"), "");
    }
    sandbox.edit("loss = ", "maps = { rounds = 1, steps = 2 }\nloss = ");
    // Held, so that there is an occlusion to be seen.
    sandbox.edit("hilite = 0.7\n", "hilite = 0.7\nocclusion = 0.7\n");
    sandbox.edit("\"reflection\", \"occlusion\", \"specular_lobe\"]", "\"reflection\"]");
    for map in ["color", "specular", "attenuator"] {
        sandbox.fit("run", &["--maps", map]).refused(&["no texture coordinates", map, "Unwrap the mesh"]);
        assert!(!sandbox.path("run").exists());
    }
    warned(sandbox.fit("run", &["--maps", "occlusion"]), &["maps/occlusion_fitted.csv"]);
    let change = sandbox.json("run/maps.json")["maps"][0]["largest_change"].as_f64().unwrap();
    assert!(change > 0.0, "{change}");
    assert!(!sandbox.path("run/maps/occlusion_fitted.png").exists(), "a picture of nothing");
    assert!(sandbox.text("run/report.html").contains("there is no picture of it"));
}

#[test]
fn the_table_of_map_fits_is_strict() {
    for (table, words) in [
        ("maps = { steps = 0 }", &["steps = 0", "[1, 10000]"][..]),
        ("maps = { solver = \"sgd\" }", &["sgd", "cg"]),
        ("maps = { colour = {} }", &["colour"]),
        ("maps = { color = { smoothness = -1.0 } }", &["smoothness = -1", "0 or more"]),
        ("maps = { color = { lower = 0.5, upper = 0.5 } }", &["upper = 0.5", "above lower"]),
        ("maps = { environment = { closeness = nan } }", &["closeness"]),
        ("maps = { rate = 0.0 }", &["rate = 0", "above 0"]),
    ] {
        let sandbox = Sandbox::new();
        sandbox.edit("loss = ", &format!("{table}\nloss = "));
        sandbox.fit("run", &[]).refused(&[&["scene.toml: line "], words].concat());
    }
    assert!(SCENE.contains("loss = "));
}

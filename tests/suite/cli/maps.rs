//! `fit --maps`: maps beside the constants, a view held out, and what is refused.

#[cfg(feature = "burn")]
use super::sandbox::files;
use super::sandbox::{SCENE, Sandbox};

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
    let ran = sandbox.fit("run", &["--maps", "color,occlusion", "--hold-out", "side"]).done();
    assert!(ran.out.contains("front") && ran.out.contains("dB (held out)"), "{}", ran.out);
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
    sandbox.fit("run", &["--maps", "environment"]).done();
    assert!(sandbox.json("run/report.json")["params"].get("specular_lobe").is_none());
    for cube in ["irradiance", "lobe", "hilite"] {
        assert!(sandbox.path(&format!("run/maps/{cube}_fitted.exr")).exists(), "{cube}");
    }
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
    refused(&format!("{one}[fit]{fit}"), &[&maps[..], &["front"]].concat(), &["only view"]);
    let without = SCENE.replace("\"side_specular\", ", "");
    refused(&without, &["--maps", "specular"], &["specular", "side_specular"]);
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

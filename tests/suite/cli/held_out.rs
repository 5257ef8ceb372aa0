//! `fit --hold-out`: views that a fit does not see, and is scored on.

use serde_json::Value;

use super::runs::SHARE;
use super::sandbox::{Sandbox, TRUTH};

#[test]
fn of_an_exact_model_a_view_that_is_held_out_changes_nothing_and_is_matched_as_well() {
    let sandbox = Sandbox::new();
    let ran = sandbox.fit("run", &["--hold-out", "side"]).done();
    let fitted: toml::Table = sandbox.text("run/params.toml").parse().unwrap();
    let truth: toml::Table = TRUTH.parse().unwrap();
    for (name, truth) in truth["params"].as_table().unwrap() {
        let (value, truth) = (fitted["params"][name].as_float().unwrap(), truth.as_float().unwrap());
        // One view of half of the pixels has errors larger by a half; the share is half of the widest.
        assert!((value - truth).abs() <= 3.0 * SHARE * truth, "{name}: {value} is not {truth}");
    }
    let report = sandbox.json("run/report.json");
    let (front, side) = (&report["views"]["front"], &report["views"]["side"]);
    assert_eq!((front["held_out"].as_bool(), side["held_out"].as_bool()), (Some(false), Some(true)));
    for score in ["psnr", "ssim", "flip"] {
        assert!(side[score].is_number(), "{side}");
        assert_eq!(report["scores"]["fitted"][score], front[score]);
        assert_eq!(report["scores"]["held_out"][score], side[score]);
    }
    assert_eq!(report["scores"]["held_out"]["views"], 1);
    // Beyond 80 dB the images differ by less than 1 code in 10 000.
    assert!(side["psnr"].as_f64().unwrap() > 80.0, "{side}");
    assert_eq!(report["provenance"]["held out"], "side");
    assert!(sandbox.path("run/side.png").exists() && sandbox.path("run/side_terms.exr").exists());
    let told = ran.out.lines().find(|line| line.starts_with("held out: side with a PSNR of "));
    assert!(told.is_some_and(|line| line.contains(", where the view that was fitted has ")), "{}", ran.out);
    let page = sandbox.text("run/report.html");
    assert!(page.contains("<h3>side <span class=\"pill\">held out</span></h3>"));
    assert!(page.contains("Held out: side with a PSNR of ") && page.contains("took no part in the fit"));
    // What the fit gets wrong is told of what it was to match.
    let places: Vec<&str> = report["misfit"]["places"]
        .as_array()
        .unwrap()
        .iter()
        .map(|place| place["place"].as_str().unwrap())
        .collect();
    assert!(!places.is_empty() && !places.iter().any(|place| place.contains("view")), "{places:?}");
}

#[test]
fn what_is_held_out_counts_nothing() {
    let sandbox = Sandbox::new();
    sandbox.edit("[fit]", "[fit]\ngains = true");
    let fit = |run: &str| {
        sandbox.fit(run, &["--hold-out", "side"]).done();
        (sandbox.text(&format!("{run}/params.toml")), sandbox.json(&format!("{run}/report.json")))
    };
    let (whole, _) = fit("whole");
    sandbox.write_grey("targets/side.exr", 32, 24);
    let (spoilt, report) = fit("spoilt");
    assert_eq!(whole, spoilt);
    // A grey picture is no ball.
    assert!(report["views"]["side"]["psnr"].as_f64().unwrap() < 40.0, "{report:#}");
    assert!(report["loss"]["end"].as_f64().unwrap() < 1e-6, "{report:#}");
    // Nothing fits its gain: it stays, and no unknown is its.
    let fitted: toml::Table = whole.parse().unwrap();
    assert_eq!(fitted["gains"]["side"].as_float(), Some(1.0));
    let unknowns = report["unknowns"].as_array().unwrap();
    assert!(!unknowns.iter().any(|unknown| unknown["name"].as_str().unwrap().starts_with("gain.")));
    // The first view of the scene may be held out, too: the gain of the other one is then held.
    sandbox.fit("first", &["--hold-out", "front"]).done();
    assert_eq!(sandbox.json("first/report.json")["views"]["front"]["held_out"], Value::Bool(true));
}

#[test]
fn a_fit_goes_on_without_the_views_that_it_was_begun_without() {
    let sandbox = Sandbox::new();
    let without = ["--hold-out", "side"];
    sandbox.fit("whole", &without).done();
    sandbox.fit("run", &[&without[..], &["--max-iterations", "1"]].concat());
    let differs = |more: &[&str], what: &str| {
        sandbox.fit("run", &[&["--resume"], more].concat()).refused(&["run/state.json", what]);
    };
    differs(&[], "its list of held-out views differs (side; now none)");
    differs(&["--hold-out", "front"], "its list of held-out views differs (side; now front)");
    sandbox.fit("run", &[&without[..], &["--resume"]].concat()).done();
    assert_eq!(sandbox.text("run/params.toml"), sandbox.text("whole/params.toml"));
}

#[test]
fn what_cannot_be_held_out_is_refused_and_leaves_nothing() {
    let sandbox = Sandbox::new();
    let before = sandbox.files();
    let refused = |names: &[&str], words: &[&str]| {
        let options: Vec<&str> = names.iter().flat_map(|name| ["--hold-out", name]).collect();
        sandbox.fit("deep/run", &options).refused(words);
    };
    refused(&["sid"], &["scene.toml: held out: there is no view `sid`", "Did you mean `side`?"]);
    refused(&["front", "side"], &["scene.toml: held out front, side", "nothing is left to fit"]);
    assert!(sandbox.files() == before, "files were left");
}

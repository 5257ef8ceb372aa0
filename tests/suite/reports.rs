//! What a run leaves behind: report.json, report.html, pictures, and the terms of each view.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};

use serde_json::Value;
use skinfit::engine::{Point, Unknown};
use skinfit::fit::error_basis::ErrorBasis;
use skinfit::fit::outcome::{Direction, Ending, Iteration, Outcome, UnknownOutcome};
use skinfit::fit::profile::{Profile, ProfilePoint};
use skinfit::fit::sandwich::Blocks;
use skinfit::model::effects::Form;
use skinfit::model::params::{Channels, Column, Param, Params};
use skinfit::render::files::Image;
use skinfit::render::places::Places;
use skinfit::report::diffusion::{DiffusedScene, Stage};
use skinfit::report::{ReportError, RunInfo, StageSeconds, ViewEvidence, write_run};
use skinfit::scene::Loss;

const ODD_NAME: &str = "profile <b>\"&' {{title}}/../x";

/// A folder under target/, emptied, where the run can be looked at afterwards.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("reports").join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    folder
}

/// A lit ball: what its terms add up to is the fit; the target has a stronger rim and some grain.
fn ball(name: &str, side: usize, light: [f32; 3]) -> ViewEvidence {
    let names = ["diffuse", "rim", "side_specular", "hilite", "reflection"];
    let mut terms = names.map(|name| (name.to_owned(), Image::new(side, side)));
    let (mut fit, mut target) = (Image::new(side, side), Image::new(side, side));
    for i in 0..side * side {
        let at = |k: usize| 2.2 * ((k as f32 + 0.5) / side as f32 - 0.5);
        let (x, y) = (at(i % side), -at(i / side));
        let r2 = x * x + y * y;
        let alpha = ((1.0 - r2.sqrt()) * side as f32 / 2.2 + 0.5).clamp(0.0, 1.0);
        let z = (1.0 - r2).max(0.0).sqrt();
        let lambert = (x * light[0] + y * light[1] + z * light[2]).max(0.0);
        let rim = (1.0 - z) * (1.0 - z);
        let pores = (40.0 * x).sin() * (37.0 * y + 3.0 * x).sin();
        let skin = [0.62, 0.36, 0.27].map(|c| c * (1.0 + 0.08 * pores));
        let gloss = lambert.powi(40) * (1.0 + 0.3 * pores);
        let values = [
            skin.map(|c| c * (0.15 + 0.8 * lambert)),
            skin.map(|c| 0.5 * c * rim),
            [0.25 * gloss; 3],
            [0.9, 0.8, 0.6].map(|c| 0.35 * c * rim * rim),
            [0.02 * (1.0 - y); 3],
        ];
        for (term, value) in terms.iter_mut().zip(values) {
            term.1.rgb[i] = value.map(|c| c * alpha);
            term.1.alpha[i] = alpha;
            (0..3).for_each(|c| fit.rgb[i][c] += value[c] * alpha);
        }
        let grain = ((i * 2_654_435_761) % 1000) as f32 / 1000.0 - 0.5;
        target.rgb[i] = fit.rgb[i].map(|c| (c * (1.0 + 0.5 * rim) + 0.02 * grain * alpha).max(0.0));
        (fit.alpha[i], target.alpha[i]) = (alpha, alpha);
    }
    let coverage = fit.alpha.clone();
    let facing = (0..side * side).map(|i| {
        let at = |k: usize| 2.2 * ((k as f32 + 0.5) / side as f32 - 0.5);
        (1.0 - at(i % side).powi(2) - at(i / side).powi(2)).max(0.0).sqrt()
    });
    let places = Places { facing: facing.collect(), ..Places::default() };
    let (name, terms) = (name.to_owned(), terms.to_vec());
    ViewEvidence { name, target, fit, coverage, terms, haze: Vec::new(), places, clip: None, held_out: false }
}

fn run() -> RunInfo {
    run_of(96)
}

/// Two views of about `side` pixels a side.
fn run_of(side: usize) -> RunInfo {
    RunInfo {
        scene: "scenes/<script>alert('forest')</script>/scene.toml".to_owned(),
        scenes: Vec::new(),
        loss: Loss::RelativeL2,
        engine: "cpu".to_owned(),
        samples: 1_234_567,
        seconds: StageSeconds {
            load: 0.61,
            bake: 3.2,
            samples: 0.45,
            maps: 0.0,
            fit: 0.083,
            render: 0.2,
            report: 0.0,
        },
        views: vec![ball("front", side, [0.5, 0.6, 0.62]), ball(ODD_NAME, side - 16, [-0.8, 0.3, -0.1])],
        warnings: vec!["head.glb: weights of 3 vertices did not sum to 1 & were <scaled>.".to_owned()],
        provenance: vec![("effects".to_owned(), "diffuse, rim, hilite".to_owned())],
        made: vec![
            ("command".to_owned(), "skinfit fit 'a <b>.toml' -o run".to_owned()),
            ("date".to_owned(), "2026-11-23T01:02:03Z".to_owned()),
            ("processor".to_owned(), "an AMD EPYC".to_owned()),
        ],
        maps: None,
        diffused: Vec::new(),
        named: Vec::new(),
        files: Vec::new(),
    }
}

/// A fit with every kind of unknown: tied, per channel, logarithmic, at a bound, undetermined, gain.
fn outcome() -> Outcome {
    let start = Point { params: Params::defaults(Form::Corrected), gains: vec![1.0.into(); 2] };
    let mut end = start.clone();
    let [red, green, blue] = Column::per_channel(Param::BaseWeight).map(Unknown::Param);
    let tied = |param| Unknown::Param(Column::tied(param));
    let known = [
        (red, 0.9312, Some(0.0021)),
        (green, 0.8421, Some(0.0019)),
        (blue, 0.7019, Some(0.0023)),
        (tied(Param::RimWeight), -0.1234, Some(0.0312)),
        (tied(Param::RimExponent), 5.72, Some(0.61)),
        (tied(Param::Hilite), 0.0, None),
        (tied(Param::Reflection), 0.02, None),
        (tied(Param::Occlusion), 0.811, Some(0.012)),
        (tied(Param::SpecularLobe), 210.0, Some(31.0)),
        (Unknown::Gain(1, Channels::Tied), 1.07, Some(0.004)),
    ];
    let unknowns: Vec<UnknownOutcome> = known
        .into_iter()
        .map(|(unknown, value, std_error)| {
            unknown.set(&mut end, value);
            UnknownOutcome {
                unknown,
                start: unknown.get(&start),
                value,
                bounds: unknown.bounds(),
                std_error,
                // Independent residuals would say half.
                noise_error: std_error.map(|error| 0.5 * error),
                identifiable: unknown != tied(Param::Reflection),
                at_bound: unknown == tied(Param::Hilite),
                sensitivity: 0.3 / (1.0 + value.abs()),
            }
        })
        .collect();
    let k = unknowns.len();
    let correlations = (0..k * k)
        .map(|i| match (i / k, i % k) {
            (a, b) if a == b => 1.0,
            (3, 4) | (4, 3) => -0.973,
            (a, b) if [a, b].iter().any(|&j| j == 5 || j == 6) => 0.0,
            (a, b) => 0.9 * (-(a.abs_diff(b) as f64) / 2.5).exp() * if (a + b) % 3 == 0 { -1.0 } else { 1.0 },
        })
        .collect();
    let losses = [0.1234, 0.041, 0.0123, 0.005_21, 0.004_72, 0.004_698, 0.004_697_9];
    let history = losses.iter().enumerate().map(|(i, &loss)| {
        let evaluations = if i == 0 { 1 } else { 2 * i as u64 };
        Iteration { iteration: i as u64, evaluations, loss, seconds: 0.012 * evaluations as f64 }
    });
    Outcome {
        solver: "varpro",
        start,
        end,
        loss_start: losses[0],
        loss_end: losses[6],
        unknowns,
        correlations,
        errors: ErrorBasis::Blocks(Blocks { alike: 12, side: 40, count: 80, next: 0.9 }),
        profile: Some(profile()),
        full_shares: vec![vec!["diffusion_weight_1".to_owned(), "diffusion_weight_2".to_owned()]],
        undetermined: vec![
            Direction { components: vec![("reflection".to_owned(), 1.0)] },
            Direction { components: vec![("gain.1".to_owned(), 0.81), ("base_weight.r".to_owned(), -0.58)] },
        ],
        history: history.collect(),
        iterations: 6,
        evaluations: 12,
        seconds: 0.083,
        ending: Ending::Converged,
        starts: Vec::new(),
    }
}

/// A valley towards sharper lobes.
fn profile() -> Profile {
    let point = |(value, loss)| ProfilePoint { value, loss };
    Profile {
        name: "specular_lobe".to_owned(),
        value: 210.0,
        std_error: 31.0,
        rise: 1e-6,
        interval: [180.2, 760.0],
        closed: [true, false],
        points: [(180.0, 0.004_7), (210.0, 0.004_697_9), (241.0, 0.004_697_8), (760.0, 0.004_698_2)]
            .map(point)
            .to_vec(),
        passes: 7,
    }
}

fn read_json(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("report.json")).unwrap()).unwrap()
}

#[test]
fn a_run_leaves_the_files_that_the_format_names() {
    // At the size of real views, so that pictures and page can be looked at.
    let folder = folder("whole");
    let report = write_run(&folder, &run_of(384), &outcome()).unwrap();
    let mut found: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    found.sort();
    let odd = "profile__b_______title______x";
    let expected = [
        "front.png".to_owned(),
        "front_terms.exr".to_owned(),
        format!("{odd}.png"),
        format!("{odd}_terms.exr"),
        "report.html".to_owned(),
        "report.json".to_owned(),
    ];
    assert_eq!(found, expected);
    assert_eq!(report.files.len(), found.len());
    assert_eq!(std::fs::read_to_string(folder.join("report.json")).unwrap(), report.json);
    let picture = image::open(folder.join("front.png")).unwrap();
    assert!(picture.width() > 3 * 384 && picture.height() > 384);
}

#[test]
fn the_json_holds_what_the_format_promises() {
    let folder = folder("json");
    write_run(&folder, &run(), &outcome()).unwrap();
    let json = read_json(&folder);
    let number = |pointer: &str| json.pointer(pointer).and_then(Value::as_f64).unwrap();
    assert_eq!(number("/loss/start"), 0.1234);
    assert_eq!(number("/loss/end"), 0.004_697_9);
    assert_eq!(
        json.pointer("/params/base_weight/value").unwrap(),
        &serde_json::json!([0.9312, 0.8421, 0.7019])
    );
    assert_eq!(json.pointer("/params/base_weight/start").unwrap(), &serde_json::json!([1.0, 1.0, 1.0]));
    assert_eq!(number("/params/base_weight/std_error/1"), 0.0019);
    assert_eq!(number("/params/base_weight/noise_error/1"), 0.000_95);
    assert_eq!(number("/params/rim_weight/value"), -0.1234);
    assert_eq!(number("/params/rim_weight/std_error"), 0.0312);
    assert_eq!(json["params"]["hilite"]["std_error"], Value::Null);
    assert_eq!(json["params"]["hilite"]["at_bound"], true);
    assert_eq!(json["params"]["hilite"]["identifiable"], true);
    assert_eq!(json["params"]["reflection"]["identifiable"], false);
    for view in ["front", ODD_NAME] {
        let scores = &json["views"][view];
        assert!((20.0..45.0).contains(&scores["psnr"].as_f64().unwrap()), "{scores}");
        assert!((0.5..1.0).contains(&scores["ssim"].as_f64().unwrap()), "{scores}");
        assert!((0.0..0.3).contains(&scores["flip"].as_f64().unwrap()), "{scores}");
    }
    assert_eq!((json["solver"].as_str(), json["engine"].as_str()), (Some("varpro"), Some("cpu")));
    assert_eq!((number("/iterations"), number("/evaluations")), (6.0, 12.0));
    assert_eq!(number("/samples"), 1_234_567.0);
    for stage in ["load", "bake", "samples", "fit"] {
        assert!(json["seconds"][stage].is_number(), "{stage}");
    }
    // What goes beyond the format's minimum.
    assert_eq!(json["ending"], "converged");
    assert_eq!(json["unknowns"][9]["name"], format!("gain.{ODD_NAME}"));
    assert_eq!(json["unknowns"][0]["bounds"], serde_json::json!([0.0, null]));
    assert_eq!(number("/correlations/matrix/3/4"), -0.973);
    // hilite is at its bound, reflection undetermined: neither has an error that could be correlated.
    for other in [0, 4, 5, 6] {
        assert!(
            json["correlations"]["matrix"][5][other].is_null()
                && json["correlations"]["matrix"][other][6].is_null()
        );
    }
    assert_eq!((json["errors"]["basis"].as_str(), number("/errors/alike")), (Some("blocks"), 12.0));
    assert_eq!((number("/errors/side"), number("/errors/count")), (40.0, 80.0));
    assert_eq!(number("/errors/most_over_noise"), 2.0);
    assert_eq!(number("/unknowns/3/noise_error"), 0.0156);
    assert_eq!((number("/profile/interval/1"), json["profile"]["closed"][1].as_bool()), (760.0, Some(false)));
    assert_eq!(json["undetermined"][1]["base_weight.r"], -0.58);
    assert_eq!(json["full_shares"][0][1], "diffusion_weight_2");
    assert_eq!(json["history"].as_array().unwrap().len(), 7);
    assert_eq!(json["provenance"]["software"], concat!("skinfit ", env!("CARGO_PKG_VERSION")));
    assert_eq!(json["provenance"]["command"], "skinfit fit 'a <b>.toml' -o run");
    assert_eq!(json["provenance"]["date"], "2026-11-23T01:02:03Z");
    assert_eq!(json["provenance"]["processor"], "an AMD EPYC");
    assert!(number("/seconds/report") > 0.0);
}

/// The target's rim is half as strong again: of the light there, a known part is missing.
#[test]
fn what_is_wrong_is_told_with_its_place_in_words_and_numbers() {
    let folder = folder("misfit");
    let run = run();
    write_run(&folder, &run, &outcome()).unwrap();
    let json = read_json(&folder);
    let misfit = &json["misfit"];
    let first = &misfit["places"][0];
    assert_eq!(
        (first["place"].as_str(), first["told"].as_bool()),
        (Some("at the rim"), Some(true)),
        "{misfit:#}"
    );
    // By hand: over the covered pixels whose normal is more than 70 degrees from the eye.
    let (mut residual, mut target, mut pixels) = (0.0, 0.0, 0.0);
    for view in &run.views {
        for i in
            (0..view.coverage.len()).filter(|&i| view.coverage[i] >= 0.999 && view.places.facing[i] < 0.342)
        {
            let mean = |rgb: [f32; 3]| rgb.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
            residual += mean(view.fit.rgb[i]) - mean(view.target.rgb[i]);
            target += mean(view.target.rgb[i]);
            pixels += 1.0;
        }
    }
    let near = |key: &str, want: f64| (first[key].as_f64().unwrap() / want - 1.0).abs() < 1e-6;
    assert!(
        near("mean", residual / pixels) && near("relative", residual / target),
        "{first:#} {residual} {pixels}"
    );
    assert!(
        residual < 0.0 && first["std_error"].as_f64().unwrap() < 0.3 * (residual / pixels).abs(),
        "{first:#}"
    );
    // What is known of creases and of the light is nothing.
    let places: Vec<&str> =
        misfit["places"].as_array().unwrap().iter().map(|place| place["place"].as_str().unwrap()).collect();
    assert!(!places.iter().any(|place| place.contains("crease") || place.contains("side")), "{places:?}");
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let sentence =
        format!("<li>Too dark at the rim by {:.0}% (mean radiance off by ", -100.0 * residual / target);
    assert!(page.contains(&sentence), "{sentence}");
    // Beside the ending, and in the lead.
    let matched = misfit["match"].as_str().unwrap();
    assert!(["close", "rough", "poor"].contains(&matched), "{matched}");
    assert!(page.contains(&format!(
        ">Converged</span><span class=\"pill {}\">A {matched} match</span>",
        match matched {
            "close" => "good",
            "rough" => "warn",
            _ => "bad",
        }
    )));
    assert!(page.contains("diffusion_weight_1 and diffusion_weight_2 leave nothing beside them"), "{page}");
    assert!(page.contains("The model explains ") && page.contains("Largest misfit: too dark at the rim by "));
}

#[test]
fn the_page_shows_the_signed_error_and_says_who_made_it_when() {
    let folder = folder("signed");
    write_run(&folder, &run(), &outcome()).unwrap();
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    for view in ["front", "profile &lt;b&gt;&quot;&amp;&#39; {{title}}/../x"] {
        assert_eq!(page.matches(&format!("alt=\"signed error of view {view}\"")).count(), 1, "{view}");
        assert_eq!(page.matches(&format!("alt=\"FLIP error of view {view}\"")).count(), 1, "{view}");
    }
    // Colours and both ends of the scale, which is the same for all views.
    let legends: Vec<&str> = page.split("<span class=\"bar signed\"><i>−").skip(1).collect();
    let ends: Vec<&str> = legends.iter().filter_map(|legend| legend.split('<').next()).collect();
    assert!(ends.len() == 2 && ends[0] == ends[1], "{ends:?}");
    assert!(legends[0].starts_with(&format!("{0}</i><b></b><i>+{0}</i>", ends[0])), "{}", &legends[0][..60]);
    assert!(page.contains("blue where the fit is too dark, red where it is too bright"));
    for (name, text) in [
        ("command", "skinfit fit &#39;a &lt;b&gt;.toml&#39; -o run"),
        ("date", "2026-11-23T01:02:03Z"),
        ("processor", "an AMD EPYC"),
    ] {
        assert!(page.contains(&format!("<dt>{name}</dt><dd>{text}</dd>")), "{name}");
    }
    // Images of equal runs are equal, whenever they are made.
    let terms = std::fs::read(folder.join("front_terms.exr")).unwrap();
    assert!(!terms.windows(10).any(|bytes| bytes == b"2026-11-23"));
}

#[test]
fn keys_of_the_json_stand_in_the_order_of_the_format() {
    let folder = folder("order");
    let text = write_run(&folder, &run(), &outcome()).unwrap().json;
    let keys =
        ["loss", "params", "views", "solver", "engine", "iterations", "evaluations", "seconds", "samples"];
    let places = keys.map(|key| text.find(&format!("\n  \"{key}\":")).unwrap());
    assert!(places.is_sorted(), "{places:?}");
    let places = ["base_weight", "rim_weight", "rim_exponent", "hilite"].map(|key| text.find(key).unwrap());
    assert!(places.is_sorted(), "{places:?}");
}

#[test]
fn numbers_that_do_not_exist_are_null_and_never_nan() {
    let folder = folder("odd-numbers");
    let mut odd = outcome();
    (odd.loss_start, odd.loss_end) = (f64::INFINITY, f64::NAN);
    odd.unknowns[0].std_error = Some(f64::NAN);
    odd.unknowns[1].value = f64::NEG_INFINITY;
    (odd.unknowns[3].start, odd.unknowns[3].value) = (f64::NAN, f64::NAN);
    odd.unknowns[7].value = 40.0;
    odd.correlations.extend([0.5; 30]);
    odd.correlations[1] = f64::NAN;
    odd.history[2].loss = f64::NAN;
    odd.history[3].loss = 0.0;
    let mut run = run();
    run.views[0].coverage.fill(0.5);
    run.views[0].target.rgb[4_000] = [f32::NAN, f32::INFINITY, -1.0];
    let report = write_run(&folder, &run, &odd).unwrap();
    let json = read_json(&folder);
    assert!(json["loss"]["start"].is_null() && json["loss"]["end"].is_null());
    assert_eq!(json["params"]["base_weight"]["std_error"], serde_json::json!([null, 0.0019, 0.0023]));
    assert!(json["views"]["front"]["psnr"].is_null());
    assert_eq!(json["views"]["front"]["pixels"], 0);
    assert!(report.summary.warnings.iter().any(|w| w.contains("'front': no pixel is fully covered")));
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(!beside_pictures(&page).contains("NaN") && !page.contains(">inf"));
    assert_well_formed(&page);
}

#[test]
fn a_fit_without_unknowns_views_or_history_still_reports() {
    let folder = folder("empty");
    let mut nothing = outcome();
    nothing.unknowns.clear();
    nothing.correlations.clear();
    nothing.undetermined.clear();
    nothing.history.truncate(1);
    write_run(&folder, &RunInfo { views: Vec::new(), ..run() }, &nothing).unwrap();
    assert_eq!(read_json(&folder)["params"], serde_json::json!({}));
    assert_well_formed(&std::fs::read_to_string(folder.join("report.html")).unwrap());
}

#[test]
fn the_page_says_what_errors_rest_on_and_which_unknowns_their_bounds_hold() {
    let folder = folder("errors");
    let mut outcome = outcome();
    let reflection = outcome.unknowns.iter().position(|u| !u.identifiable).unwrap();
    outcome.unknowns[reflection].identifiable = true;
    outcome.undetermined.clear();
    write_run(&folder, &run(), &outcome).unwrap();
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    for words in [
        "The images determine every free parameter but hilite, held by its bound.",
        "Residuals are alike over about 12 pixels: errors are up to 2.0 times those of independent ones.",
        "specular_lobe lies in a valley: from 180 to 760 or more the loss is as good as at 210.0.",
        "Held by its bound, and so not determined from inside: hilite.",
        "id=\"profile\"",
        "hilite and occlusion: no errors to correlate",
        "by independent residuals 0.016",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(!page.contains("determine every free parameter."));
    assert_well_formed(&page);
    // Without correlated residuals, a valley or bounds nothing of the kind is said.
    let plain = Outcome { errors: ErrorBasis::Rounding, profile: None, ..outcome };
    let mut plain = plain;
    plain.unknowns.iter_mut().for_each(|u| (u.noise_error, u.at_bound) = (u.std_error, false));
    write_run(&folder, &run(), &plain).unwrap();
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("The images determine every free parameter."));
    for words in ["Residuals are alike", "valley", "not determined from inside", "by independent residuals"] {
        assert!(!page.contains(words), "{words}");
    }
}

#[test]
fn the_page_is_well_formed_and_asks_for_nothing_from_outside() {
    let folder = folder("page");
    write_run(&folder, &run(), &outcome()).unwrap();
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert_well_formed(&page);
    for asks in ["http:", "https:", "//", "@import", "srcset"] {
        // Base 64 has slashes of its own.
        let beside_pictures: String =
            page.split('"').filter(|part| !part.starts_with("data:image")).collect();
        let scripts_comments = beside_pictures.replace("// Dragging", "");
        assert!(!scripts_comments.contains(asks), "{asks}");
    }
    for source in page.split("src=\"").skip(1).chain(page.split("href=\"").skip(1)) {
        assert!(source.starts_with("data:"), "{}", &source[..40]);
    }
    // Two views of four pictures and five terms each.
    assert_eq!(page.matches("<img src=\"data:image/png;base64,").count(), 2 * (4 + 5));
    // Against passes and against seconds, from where the fit began.
    assert_eq!(page.matches("<title>start: loss ").count(), 2);
}

#[test]
fn strings_from_files_are_escaped_in_the_page() {
    let folder = folder("escaped");
    write_run(&folder, &run(), &outcome()).unwrap();
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(!page.contains("<script>alert") && !page.contains("profile <b>") && !page.contains("<scaled>"));
    assert!(page.contains("&lt;script&gt;alert(&#39;forest&#39;)&lt;/script&gt;"));
    assert!(page.contains("profile &lt;b&gt;&quot;&amp;&#39; {{title}}/../x"));
}

#[test]
fn the_layers_of_the_terms_add_up_to_the_whole() {
    let folder = folder("terms");
    write_run(&folder, &run(), &outcome()).unwrap();
    let layer =
        exr::prelude::read_first_flat_layer_from_file(folder.join("front_terms.exr")).unwrap().layer_data;
    let plane = |name: &str| -> Vec<f32> {
        let channel = layer.channel_data.list.iter().find(|c| c.name == *name).unwrap();
        channel.sample_data.values_as_f32().collect()
    };
    for channel in ["R", "G", "B"] {
        let terms = ["diffuse", "rim", "side_specular", "hilite", "reflection"];
        let planes = terms.map(|term| plane(&format!("{term}.{channel}")));
        for (i, whole) in plane(channel).into_iter().enumerate() {
            let sum: f32 = planes.iter().map(|p| p[i]).sum();
            // Five f32 additions of numbers below 2.
            assert!((sum - whole).abs() < 1e-6, "{channel} {i}: {sum} {whole}");
        }
    }
    let parameters = &layer.attributes.other[&exr::prelude::Text::from("parameters")];
    assert!(format!("{parameters:?}").contains("rim_weight = -0.1234"));
}

#[test]
fn terms_that_do_not_add_up_are_said_so() {
    let mut run = run();
    run.views[0].terms[0].1.rgb[4_656][1] += 0.01;
    let report = write_run(&folder("apart"), &run, &outcome()).unwrap();
    assert_eq!(report.summary.warnings.len(), 2);
    assert!(report.summary.warnings[1].contains("'front': its terms differ"));
}

#[test]
fn images_of_another_size_and_folders_that_cannot_be_made_are_refused() {
    let mut run = run();
    run.views[1].coverage.pop();
    let folder = folder("refused");
    let error = write_run(&folder, &run, &outcome()).unwrap_err();
    assert!(matches!(&error, ReportError::Sizes { what, .. } if what == "the coverage"));
    assert!(!folder.exists());
    std::fs::create_dir_all(folder.parent().unwrap()).unwrap();
    std::fs::write(&folder, b"a file").unwrap();
    let error = write_run(&folder, &self::run(), &outcome()).unwrap_err();
    assert!(error.to_string().contains("cannot be written"), "{error}");
    std::fs::remove_file(&folder).unwrap();
}

#[test]
fn stages_of_diffusion_are_shown_scene_by_scene_where_there_are_any() {
    let folder = folder("diffusion");
    let page = |diffused: Vec<DiffusedScene>| {
        write_run(&folder, &RunInfo { diffused, ..run() }, &outcome()).unwrap();
        std::fs::read_to_string(folder.join("report.html")).unwrap()
    };
    assert!(!page(Vec::new()).contains("id=\"diffusion\""));
    // Larger than what the page shows: every second texel of a side.
    let image = Image { alpha: vec![1.0; 1024 * 1024], ..Image::new(1024, 1024) };
    let stage = Stage { name: "light_map".to_owned(), caption: "a <light> map".to_owned(), image };
    let scene = |name: &str| DiffusedScene { name: name.to_owned(), stages: vec![stage.clone()] };
    let page = page(vec![scene("noon"), scene("<night>")]);
    assert_well_formed(&page);
    let place = |part: &str| page.find(part).unwrap_or_else(|| panic!("{part} is not there"));
    assert!(place("<section id=\"views\">") < place("<section id=\"diffusion\">"));
    assert!(place("<h3>noon</h3>") < place("<h3>&lt;night&gt;</h3>"));
    let figure =
        "width=\"512\" height=\"512\" alt=\"stage light_map\"><figcaption>a &lt;light&gt; map</figcaption>";
    assert_eq!(page.matches(figure).count(), 2);
}

/// The page without its pictures, whose base 64 may spell anything.
fn beside_pictures(page: &str) -> String {
    page.split('"').filter(|part| !part.starts_with("data:image")).collect()
}

/// Every tag is closed in its order, and attributes are quoted.
fn assert_well_formed(page: &str) {
    const VOID: [&str; 4] = ["meta", "link", "img", "!DOCTYPE"];
    let mut open: Vec<&str> = Vec::new();
    let mut rest = page;
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        let end = rest.find('>').expect("a tag ends");
        let tag = &rest[..end];
        rest = &rest[end + 1..];
        assert_eq!(tag.matches('"').count() % 2, 0, "<{tag}>");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap();
        match (tag.starts_with('/'), tag.ends_with('/') || VOID.contains(&name)) {
            (true, _) => assert_eq!(open.pop(), Some(name), "</{name}>"),
            (false, false) => open.push(name),
            (false, true) => {}
        }
        if !tag.starts_with('/') && (name == "script" || name == "style") {
            rest = &rest[rest.find(&format!("</{name}")).expect("it ends")..];
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

//! `skinfit ablate`: what it measures where the answer is known.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;
use skinfit::FitOptions;
use skinfit::model::effects::{Effect, Effects};
use skinfit::model::params::Param;
use skinfit::prepare::PrepareOptions;
use skinfit::study::ablation::refit::{DRAWN, refit};
use skinfit::study::subject::Subject;

use super::pinned::scene_text;
use super::sandbox::Sandbox;
use crate::common;

/// The scene without its targets.
fn without_targets(sandbox: &Sandbox) {
    for view in ["front", "side"] {
        sandbox.edit(&format!("target = \"targets/{view}.exr\"\n"), "");
    }
}

/// The rows of `results.json` by what is left out.
fn rows(sandbox: &Sandbox, folder: &str) -> BTreeMap<String, Value> {
    let name = |row: &Value| {
        let parts = row["left_out"].as_array().unwrap().iter().map(|part| part.as_str().unwrap());
        parts.collect::<Vec<_>>().join("+")
    };
    let file = sandbox.json(&format!("{folder}/results.json"));
    file["rows"].as_array().unwrap().iter().map(|row| (name(row), row.clone())).collect()
}

fn loss(row: &Value) -> f64 {
    row["loss"].as_f64().unwrap()
}

#[test]
fn what_contributes_nothing_is_missed_by_nothing_at_all() {
    let sandbox = Sandbox::new();
    without_targets(&sandbox);
    sandbox.edit("hilite = 0.7", "hilite = 0.0");
    let ran = sandbox.run(&["ablate", "scene.toml", "-o", "parts", "--gpu", "never"]).done();
    let rows = rows(&sandbox, "parts");
    // The whole, seven effects, and the one term that is no effect.
    assert_eq!(rows.len(), 9, "{ran:?}");
    for unmissed in ["", "hilite"] {
        let row = &rows[unmissed];
        assert_eq!((loss(row), row["change"]["loss"].as_f64()), (0.0, Some(0.0)), "{unmissed}");
        for view in row["views"].as_array().unwrap() {
            assert_eq!(view["linear_rms"].as_f64(), Some(0.0));
            assert_eq!((view["psnr"].as_f64(), view["flip"].as_f64()), (Some(200.0), Some(0.0)));
        }
    }
    for missed in ["diffuse", "base_weight", "rim", "side_specular", "reflection", "occlusion", "normal_map"]
    {
        assert!(loss(&rows[missed]) > 0.0, "{missed}");
    }
    // Without the effect its cube is not baked, and less is read and computed.
    let counts = |name: &str| rows[name]["counts"].clone();
    let (whole, without) = (counts(""), counts("hilite"));
    let bakes = |counts: &Value| counts["bakes"].as_array().unwrap().len();
    assert_eq!(bakes(&whole), bakes(&without) + 1);
    for count in ["bytes_a_sample", "operations", "baked_bytes"] {
        assert!(whole[count].as_f64() > without[count].as_f64(), "{count}");
    }
    assert!(ran.out.contains("\nhilite") && ran.out.contains("  hilite\n"), "{ran:?}");
    // Beside nothing at all, a change is no multiple of chance: it is real.
    let lines =
        |word: &str| ran.out.lines().filter(|line| line.split_whitespace().any(|w| w == word)).count();
    assert_eq!((lines("exact"), lines("equal")), (7, 2), "{ran:?}");
    // Columns stand below their headings.
    let headings = ran.out.lines().next().unwrap();
    let end = headings.find("PSNR").unwrap() + 4;
    assert!(ran.out.lines().skip(1).take(9).all(|line| line.as_bytes()[end] == b' '), "{ran:?}");
    assert!(rows["rim"]["change"]["t"].is_null());
    let csv = sandbox.text("parts/results.csv");
    let cell = |name: &str, column: &str| -> String {
        let at = csv.lines().next().unwrap().split(',').position(|heading| heading == column).unwrap();
        let line = csv.lines().find(|line| line.starts_with(&format!("{name},all,"))).unwrap();
        line.split(',').nth(at).unwrap().to_owned()
    };
    assert_eq!((cell("rim", "t"), cell("hilite", "psnr_db")), (String::new(), "inf".to_owned()));
    let page = sandbox.text("parts/report.html");
    assert!(page.contains(">exact</td>") && !page.contains("200.00"));
}

/// The text of each cell of the page's table of cases, by its row's heading.
fn page_cells(page: &str) -> BTreeMap<String, Vec<String>> {
    let table = page.split("id=\"cases\"").nth(1).unwrap().split("</table>").next().unwrap();
    let body = table.split("<tbody>").nth(1).unwrap();
    let text = |cell: &str| -> String {
        let plain: String = cell.split('<').map(|part| part.split('>').nth(1).unwrap_or_default()).collect();
        plain.replace('−', "-")
    };
    let rows = body.split("<tr").skip(1).map(|row| row.split("<t").skip(1).map(text).collect::<Vec<_>>());
    rows.map(|cells| (cells[0].clone(), cells)).collect()
}

#[test]
fn page_and_terminal_tell_the_same_in_the_same_units() {
    let sandbox = Sandbox::new();
    // Held at a wrong value: there is a misfit that a change is a share of.
    sandbox.edit("\"rim_exponent\", ", "");
    let ran = sandbox.run(&["ablate", "scene.toml", "-o", "parts", "--gpu", "never"]).done();
    let page = page_cells(&sandbox.text("parts/report.html"));
    let lines: Vec<Vec<&str>> = ran.out.lines().map(|line| line.split_whitespace().collect()).collect();
    // Whole words of a heading; its last of two stand apart.
    assert!(lines[0].join(" ").contains("change t PSNR SSIM FLIP CPU, % GPU, % ops, % bytes, %"), "{ran:?}");
    let mut compared = 0;
    for (name, cells) in &page {
        let line = lines.iter().find(|line| line.first().is_some_and(|word| word == name));
        let Some(line) = line else { continue };
        // Name, loss, change, t, PSNR, SSIM, FLIP, CPU, GPU, operations, bytes.
        let first = |cell: &str| cell.split(" ±").next().unwrap().trim().to_owned();
        // The page has linear RMS, too, and without an adapter no column of GPU times.
        for (column, on_page) in [(2, 2), (7, 8), (9, 9), (10, 10)] {
            let (told, shown) = (line[column], first(&cells[on_page]));
            // A change that is no share of anything is a number, which a table writes with an exponent.
            let number = |text: &str| text.parse::<f64>().ok();
            let same = told == shown || number(told).is_some_and(|x| number(&shown) == Some(x));
            assert!(same, "{name}: {line:?} {cells:?}");
            compared += 1;
        }
    }
    assert!(compared >= 4 * 8, "{page:?} {ran:?}");
    assert!(ran.out.contains('%') && page["rim"][2].contains('%'), "{ran:?}");
}

/// The scene with two effects and no targets: an ablation of a second or two.
fn small() -> Sandbox {
    let sandbox = Sandbox::new();
    without_targets(&sandbox);
    sandbox.edit(
        "[\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"side_specular\", \"hilite\", \"reflection\"]",
        "[\"diffuse\", \"hilite\"]",
    );
    let free =
        sandbox.text("scene.toml").lines().find(|line| line.starts_with("free = ")).unwrap().to_owned();
    sandbox.edit(&free, "free = [\"base_weight\"]");
    sandbox
}

#[test]
fn a_second_ablation_leaves_nothing_of_the_first_and_no_other_command_s_results_are_mixed_in() {
    let sandbox = small();
    let ablate = ["ablate", "scene.toml", "-o", "parts", "--gpu", "never"];
    sandbox.run(&ablate).done();
    sandbox.write("parts/mine_without_rim.png", b"not the program's");
    let there = |name: &str| sandbox.path(&format!("parts/{name}")).exists();
    assert!(there("front_without_hilite.png") && there("side_without_diffuse.png"));
    sandbox.edit("\"diffuse\", \"hilite\"", "\"diffuse\"");
    sandbox.run(&ablate).done();
    assert!(!there("front_without_hilite.png") && !there("side_without_hilite.png"));
    assert!(there("side_without_diffuse.png") && there("mine_without_rim.png"));
    let before = sandbox.files();
    let words = ["parts: this folder holds results of skinfit ablate", "Choose another with -o"];
    for command in ["fit", "tradeoff", "stability"] {
        sandbox.run(&[command, "scene.toml", "-o", "parts"]).refused(&words);
        assert!(sandbox.files() == before, "{command}: something changed");
    }
    let full = Sandbox::new();
    full.fit("run", &["--max-iterations", "1"]);
    full.run(&["ablate", "scene.toml", "-o", "run"])
        .refused(&["run: this folder holds results of skinfit fit"]);
}

#[test]
fn what_is_held_out_tells_a_part_that_only_overfits() {
    let sandbox = Sandbox::new();
    // Of two views one shows the hilite, and the other does not.
    let render = ["render", "scene.toml", "--engine", "cpu", "--params", "truth.toml", "--set", "hilite=0"];
    sandbox.run(&[&render[..], &["--view", "side", "-o", "targets/side.exr"]].concat()).done();
    let ablate = ["ablate", "scene.toml", "--gpu", "never", "-o"];
    let ran = sandbox.run(&[&ablate[..], &["held", "--hold-out", "side"]].concat()).done();
    let rows = rows(&sandbox, "held");
    let views = |row: &Value| -> Vec<String> {
        row["views"]
            .as_array()
            .unwrap()
            .iter()
            .map(|view| view["view"].as_str().unwrap().to_owned())
            .collect()
    };
    for row in rows.values() {
        assert_eq!((views(row), views(&row["held_out"])), (vec!["front".into()], vec!["side".into()]));
    }
    // The view that is fitted is the model's own; what its fit finds is wrong for the other by the hilite, and by that alone.
    assert!(loss(&rows[""]) < 1e-9 && loss(&rows[""]["held_out"]) > 1e-4, "{}", rows[""]);
    let change = |row: &Value| row["change"]["loss"].as_f64().unwrap();
    let hilite = &rows["hilite"];
    assert!(change(hilite) > 0.0 && change(&hilite["held_out"]) < 0.0, "{hilite}");
    assert!(hilite["held_out"]["psnr_change"].as_f64().unwrap() > 0.0, "{hilite}");
    assert_eq!(rows[""]["held_out"]["psnr_change"].as_f64(), Some(0.0));
    let head = ran.out.lines().next().unwrap();
    assert!(head.contains("bytes, %    held out       t PSNR, dB  bakes saved"), "{head}");
    let csv = sandbox.text("held/results.csv");
    let (head, lines) = csv.split_once('\n').unwrap();
    assert!(head.ends_with(",best_start,held_out,psnr_change_db"), "{head}");
    assert!(lines.lines().all(|line| line.matches(',').count() == head.matches(',').count()), "{csv}");
    let of = |start: &str| lines.lines().filter(|line| line.starts_with(start)).collect::<Vec<_>>();
    let names: Vec<&str> = of("hilite,").iter().map(|line| line.split(',').nth(1).unwrap()).collect();
    assert_eq!(names, ["all", "front", "held out", "side"]);
    assert!(of("hilite,held out,")[0].contains(",true,") && of("hilite,front,")[0].ends_with(",false,"));
    let page = sandbox.text("held/report.html");
    assert!(page.contains(">only overfits</td>") && page.contains("matched no worse without <b>"), "{page}");
    assert!(sandbox.path("held/side_without_hilite.png").exists());
    // Nothing of this is there unless it is asked for.
    sandbox.run(&[&ablate[..], &["whole"]].concat()).done();
    assert!(self::rows(&sandbox, "whole")[""].get("held_out").is_none());
    assert!(sandbox.text("whole/results.csv").lines().next().unwrap().ends_with(",best_start"));
    assert!(!sandbox.text("whole/report.html").contains("held out"));
}

#[test]
fn a_page_is_called_by_the_scenes_folder() {
    let sandbox = small();
    sandbox.run(&["ablate", "scene.toml", "-o", "parts", "--gpu", "never"]).done();
    let folder = sandbox.path("").file_name().unwrap().to_string_lossy().into_owned();
    assert!(sandbox.text("parts/report.html").contains(&format!("<h1>{folder}</h1>")));
}

#[test]
fn fitting_again_never_makes_it_worse_and_pairs_are_all_there() {
    let sandbox = Sandbox::new();
    let options = ["ablate", "scene.toml", "--gpu", "never", "--pairs", "-o"];
    sandbox.run(&[&options[..], &["held"]].concat()).done();
    sandbox.run(&[&options[..], &["again", "--refit"]].concat());
    let (held, again) = (rows(&sandbox, "held"), rows(&sandbox, "again"));
    // 8 parts: 28 pairs, less diffuse with its two terms.
    assert_eq!((held.len(), again.len()), (1 + 8 + 26, 1 + 8 + 26));
    for (name, row) in &held {
        // Both begin from one fit of the whole model; f32 sums of a fit and f64 images differ by 1e-7.
        let (held, again) = (loss(row), loss(&again[name]));
        assert!(again <= held * (1.0 + 1e-4) + 1e-9, "{name}: {again} > {held}");
    }
    // The targets are the model's own.
    assert!(loss(&held[""]) < 1e-9 && loss(&held["rim"]) > 1e-3);
    // Where the whole model leaves a misfit, `t` tells how much more the change is than that.
    assert!(held["rim"]["change"]["t"].as_f64().is_none_or(|t| t > 3.0));
    // Nothing of the diffuse light is left without both base and rim: each makes up for some of the other.
    let change = |row: &Value| row["change"]["loss"].as_f64().unwrap();
    let ratio = change(&held["base_weight+rim"]) / (change(&held["base_weight"]) + change(&held["rim"]));
    let page = sandbox.text("held/report.html");
    let cells = page
        .split("id=\"by-pair\"")
        .nth(1)
        .unwrap()
        .split("<tr")
        .find(|row| row.contains("base_weight + rim"));
    let sorted = cells.unwrap().split("data-sort=\"").last().unwrap().split('"').next().unwrap();
    assert!((sorted.parse::<f64>().unwrap() / ratio - 1.0).abs() < 1e-9 && ratio > 1.0, "{sorted} {ratio}");
    // From the whole fit's end, the scene's own start and two that are drawn; the whole model from all but the first.
    for (name, row) in &again {
        let tried: Vec<&str> =
            row["starts"]["tried"].as_array().unwrap().iter().map(|t| t["from"].as_str().unwrap()).collect();
        let all = ["whole", "scene", "drawn 1", "drawn 2"];
        assert_eq!(tried, all[usize::from(name.is_empty())..], "{name}");
        assert!(tried.contains(&row["starts"]["best"].as_str().unwrap()), "{name}: {row}");
        assert!(held[name]["starts"].is_null());
    }
    let csv = sandbox.text("again/results.csv");
    let (head, first) = (csv.lines().next().unwrap(), csv.lines().nth(1).unwrap());
    assert!(head.ends_with(",starts,best_start"), "{head}");
    let best = again[""]["starts"]["best"].as_str().unwrap();
    assert!(first.ends_with(&format!(",3,{best}")), "{first}");
    assert!(csv.lines().all(|line| line.matches(',').count() == head.matches(',').count()), "{csv}");
    assert!(sandbox.text("again/report.html").contains(", of 4</td>"));
    // What is missing is no longer among the constants.
    let names = |row: &Value| -> Vec<String> {
        row["constants"].as_array().unwrap().iter().map(|c| c["name"].as_str().unwrap().to_owned()).collect()
    };
    assert!(names(&again[""]).contains(&"hilite".to_owned()));
    assert!(!names(&again["hilite"]).contains(&"hilite".to_owned()));
    assert!(!names(&again["base_weight+hilite"]).contains(&"base_weight".to_owned()));
    // A line a case for all views and for each, and a picture for each part and view.
    assert_eq!(sandbox.text("held/results.csv").lines().count(), 1 + 35 * 3);
    let pictures = sandbox.files().into_keys().filter(|path| {
        path.to_string_lossy().contains("held/") && path.extension().is_some_and(|e| e == "png")
    });
    assert_eq!(pictures.count(), 8 * 2);
}

#[test]
fn a_part_that_was_left_out_is_missed_no_more_than_by_a_plain_fit_without_it() {
    let sandbox = Sandbox::new();
    // Held at a wrong value: there is a misfit that others make up for, each in a way of its own.
    sandbox.edit("\"rim_exponent\", ", "");
    sandbox.run(&["ablate", "scene.toml", "--refit", "--gpu", "never", "-o", "parts"]);
    let rows = rows(&sandbox, "parts");
    let text = sandbox.text("scene.toml");
    let line = |key: &str| text.lines().find(|line| line.starts_with(key)).unwrap().to_owned();
    let names = |line: &str| -> Vec<String> {
        let list = line.split('[').nth(1).unwrap().trim_end_matches(']');
        list.split(", ").map(|name| name.trim_matches('"').to_owned()).collect()
    };
    let listed =
        |names: Vec<&String>| names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let (effects, free) = (names(&line("effects = ")), names(&line("free = ")));
    for left_out in &effects {
        let kept: Vec<&String> = effects.iter().filter(|name| *name != left_out).collect();
        let of: Vec<Effect> = kept.iter().map(|name| Effect::from_name(name).unwrap()).collect();
        let of = Effects::of(&of);
        let asked = |name: &&String| Param::from_name(name).unwrap().asked_for(of);
        let without = text
            .replace(&line("effects = "), &format!("effects = [{}]", listed(kept)))
            .replace(&line("free = "), &format!("free = [{}]", listed(free.iter().filter(asked).collect())));
        sandbox.write("without.toml", without.as_bytes());
        sandbox.run(&["fit", "without.toml", "--engine", "cpu", "-o", left_out]);
        let plain = sandbox.json(&format!("{left_out}/report.json"))["loss"]["end"].as_f64().unwrap();
        let refitted = loss(&rows[left_out.as_str()]);
        println!("{left_out}: {refitted:e}, by a plain fit {plain:e}");
        // A fit stops where a step would gain less than 1e-6 of the loss of these small images, and takes it in f32;
        // an ablation's images are f64.
        assert!(refitted <= plain * (1.0 + 1e-5) + 1e-9, "{left_out}: {refitted:e} > {plain:e}");
    }
}

#[test]
fn the_sunrise_is_fitted_again_as_well_as_from_its_own_start() {
    let Some(data) = common::data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, scene_text(&data.canonicalize().unwrap(), "lps_sunrise")).unwrap();
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics");
    let options = PrepareOptions { fit: true, cache: Some(cache), ..PrepareOptions::default() };
    let whole = Subject::new(&scene, &options, |_| {}).unwrap();
    let end = whole.fit(&FitOptions::default()).unwrap().end;
    // Without it, the valley that the whole fit's end lies in was the higher one.
    let effects = whole.scenes.first().baked.scene.effects.without(Effect::SideSpecular);
    let options = PrepareOptions { effects: Some(effects), ..options };
    let subject = Subject::new(&scene, &options, |loaded| {
        loaded.scene.fit.free.retain(|column| column.param.asked_for(effects));
    })
    .unwrap();
    let own = subject.scenes.start.clone();
    let plain = subject.fit(&FitOptions::default()).unwrap().loss_end;
    let (refitted, starts) = refit(&subject, Some(&end), &own).unwrap();
    println!("by a plain fit {plain:e}, again {:e}: {starts:?}", refitted.loss_end);
    // The same fit is among them; the first of two ends that differ by less than this is kept.
    assert!(refitted.loss_end <= plain * (1.0 + 1e-6), "{:e} > {plain:e}: {starts:?}", refitted.loss_end);
    assert_eq!(starts.tried.len(), 2 + DRAWN as usize);
    let least = starts.tried.iter().map(|tried| tried.loss).fold(f64::MAX, f64::min);
    assert!(refitted.loss_end <= least * (1.0 + 1e-6), "{starts:?}");
    // From where it starts already, there is no need to begin twice.
    let (_, once) = refit(&subject, Some(&own), &own).unwrap();
    assert_eq!(once.tried.len(), 1 + DRAWN as usize);
}

#[test]
fn numbers_do_not_depend_on_threads_and_constants_may_be_given() {
    let sandbox = Sandbox::new();
    let measured = |folder: &str, threads: &str| {
        let options =
            ["ablate", "scene.toml", "--params", "truth.toml", "--gpu", "never", "--threads", threads, "-o"];
        sandbox.run(&[&options[..], &[folder]].concat()).done();
        let without_times = |mut row: Value| {
            row["cpu"].take();
            row
        };
        rows(&sandbox, folder).into_iter().map(|(name, row)| (name, without_times(row))).collect::<Vec<_>>()
    };
    assert_eq!(measured("one", "1"), measured("two", "2"));
    // The constants that the targets were rendered with leave nothing but rounding.
    assert!(loss(&rows(&sandbox, "one")[""]) < 1e-9);
}

#[test]
fn a_scene_of_one_effect_is_black_without_it() {
    let sandbox = Sandbox::new();
    without_targets(&sandbox);
    sandbox.edit(
        "[\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"side_specular\", \"hilite\", \"reflection\"]",
        "[\"diffuse\"]",
    );
    sandbox.run(&["ablate", "scene.toml", "-o", "parts", "--gpu", "never"]);
    let rows = rows(&sandbox, "parts");
    assert_eq!(rows.keys().collect::<Vec<_>>(), ["", "diffuse"]);
    let relative = rows["diffuse"]["views"][0]["relative_rms"].as_f64().unwrap();
    // The difference is the image itself.
    assert_eq!(relative, 1.0);
}

#[test]
fn what_is_refused_leaves_no_folder() {
    let sandbox = Sandbox::new();
    let before = sandbox.files();
    sandbox.run(&["ablate", "none.toml", "-o", "parts"]).refused(&["none.toml: there is no such file"]);
    sandbox.run(&["ablate", "scene.toml", "-o", "parts", "--params", "none.toml"]).refused(&["none.toml"]);
    let ablate = ["ablate", "scene.toml", "-o", "parts", "--hold-out"];
    sandbox
        .run(&[&ablate[..], &["sid"]].concat())
        .refused(&["no view `sid` with a target", "Did you mean `side`?"]);
    let both = [&ablate[..], &["front", "--hold-out", "side"]].concat();
    sandbox.run(&both).refused(&["nothing is left to fit", "Leave one of them in"]);
    sandbox.write("file", b"in the way");
    sandbox.run(&["ablate", "scene.toml", "-o", "file"]).refused(&["file: cannot be written"]);
    sandbox.remove("file");
    assert!(sandbox.files() == before, "something was left");
    // The folder must be named.
    assert_eq!(sandbox.run(&["ablate", "scene.toml"]).code, Some(2));
}

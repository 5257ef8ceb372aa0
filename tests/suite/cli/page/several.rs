//! A page of scenes that share one skin, and of a run beside another.

use serde_json::{Value, json};

use super::visit::{With, visit};
use crate::cli::browser::browser;
use crate::cli::joint::lit;

/// A scene's constants in a page, by their names.
fn constant(constants: &Value, name: &str) -> f64 {
    let found = constants.as_array().unwrap().iter().find(|constant| constant[0] == name);
    found.unwrap_or_else(|| panic!("{name}: {constants}"))[1].as_f64().unwrap()
}

#[test]
fn a_page_fits_scenes_as_one_skin_as_the_program_does() {
    if browser().is_none() {
        return;
    }
    let sandbox = lit();
    let scenes = ["noon.toml", "night.toml", "dusk.toml"];
    sandbox.run(&[&["page"][..], &scenes, &["-o", "page.html"]].concat()).done();
    let script = r##"
        await complete();
        const found = { views: skinfit.state().views.map((view) => view.name) };
        // What is the skin's moves in every scene.
        slide("base_weight", [0.4]);
        await until("the slider", () => skinfit.state().can_undo);
        const moved = value("base_weight");
        press("view night/side");
        await until("the view", () => skinfit.state().view === 3);
        await complete();
        found.moved = [moved, value("base_weight")];
        found.rows = skinfit.state().rows.map((row) => row.name);
        press("undo");
        await until("it is undone", () => !skinfit.state().can_undo);
        for (const name of ["fit view dusk/front", "fit view dusk/side"]) press(name);
        await until("they are left out", () => skinfit.state().views.filter((view) => !view.fitted).length === 2);
        press("fit");
        await until("it fits", () => skinfit.state().fitting);
        await until("the fit ends", () => skinfit.state().found && !skinfit.state().fitting);
        await complete();
        found.ending = skinfit.state().found;
        found.night = await skinfit.constants();
        found.errors = skinfit.state().rows.flatMap((row) => row.sliders).filter((slider) => slider.interval).length;
        press("view noon/front");
        await until("the first view", () => skinfit.state().view === 0);
        found.noon = await skinfit.constants();
        found.scores = skinfit.state().scores.map((score) => [score.view, score.held_out]);
        found.told = skinfit.told();
        return found;
    "##;
    let page = sandbox.path("page.html");
    let Some(found) = visit(&page, With::NoAdapter, script, Some("page_several.png")) else { return };
    let names = ["noon/front", "noon/side", "night/front", "night/side", "dusk/front", "dusk/side"];
    assert_eq!(found["views"], json!(names));
    assert_eq!(found["moved"][0], found["moved"][1]);
    let rows = found["rows"].as_array().unwrap();
    assert!(rows.contains(&json!("key_azimuth")), "the second scene has a light of its own: {rows:?}");
    assert_eq!(found["told"], json!([]), "{found}");
    assert_eq!(found["scores"], json!(names.map(|name| (name, name.starts_with("dusk")))));

    let fit = [&["fit"][..], &scenes, &["--hold-out", "dusk", "--engine", "cpu", "-o", "run"]].concat();
    sandbox.run(&fit).done();
    let report = sandbox.json("run/report.json");
    for unknown in report["unknowns"].as_array().unwrap() {
        let (name, want) = (unknown["name"].as_str().unwrap(), unknown["value"].as_f64().unwrap());
        let (scene, own) = name.split_once('/').unwrap_or(("noon", name));
        let got = constant(&found[scene], own);
        // Both end where the same objective is least, by sums in another order.
        assert!((got - want).abs() <= 1e-4 * want.abs().max(0.1), "{name}: {got} for {want}");
        if !name.contains('/') {
            assert_eq!(got, constant(&found["night"], own), "{name} is the skin's");
        }
    }
    assert!(found["ending"].as_str().unwrap().starts_with("converged"), "{}", found["ending"]);
    assert!(found["errors"].as_u64().unwrap() > 8, "{}", found["errors"]);

    // A page of one of them alone with these constants, beside constants that name no scene's own.
    sandbox.write("preset.toml", b"[params]\nhilite = 0.25\n");
    sandbox
        .run(&["page", "night.toml", "--params", "run", "--compare", "preset.toml", "-o", "one.html"])
        .done();
    let script = r##"
        await complete();
        return { constants: await skinfit.constants(), told: skinfit.told(), scores: skinfit.state().scores.map((score) => score.view),
          rotation: skinfit.state().rows.find((row) => row.name === "environment_rotation").sliders[0],
          other: skinfit.state().panes.some((pane) => pane.name === "other run") };
    "##;
    let Some(found) = visit(&sandbox.path("one.html"), With::NoAdapter, script, None) else { return };
    assert_eq!(found["told"], json!([]), "{found}");
    let unknowns = report["unknowns"].as_array().unwrap();
    let own = unknowns.iter().find(|unknown| unknown["name"] == "night/environment_rotation").unwrap();
    let turned = found["rotation"]["value"].as_f64().unwrap();
    assert!((turned - own["value"].as_f64().unwrap()).abs() < 1e-9, "{turned} for {own}");
    assert!(found["rotation"]["interval"].is_array(), "{}", found["rotation"]);
    assert_eq!(found["scores"], json!(["front", "side"]));
    assert_eq!(found["other"], true);

    // The run as a page: each scene stands where the fit has left it.
    sandbox.run(&["page", "run"]).done();
    let script = r##"
        await complete();
        const found = { views: skinfit.state().views.map((view) => view.name), noon: await skinfit.constants() };
        press("view night/front");
        await until("the view", () => skinfit.state().view === 2);
        found.night = await skinfit.constants();
        found.told = skinfit.told();
        return found;
    "##;
    let Some(found) = visit(&sandbox.path("run/page.html"), With::NoAdapter, script, None) else { return };
    assert_eq!((&found["views"], &found["told"]), (&json!(names), &json!([])));
    for unknown in report["unknowns"].as_array().unwrap() {
        let (name, want) = (unknown["name"].as_str().unwrap(), unknown["value"].as_f64().unwrap());
        let (scene, own) = name.split_once('/').unwrap_or(("noon", name));
        // As params.toml writes it.
        assert!((constant(&found[scene], own) - want).abs() <= 1e-12 * want.abs(), "{name}");
    }
}

#[test]
fn a_page_has_a_run_beside_another_gains_and_the_error_of_any_image() {
    if browser().is_none() {
        return;
    }
    let sandbox = crate::cli::sandbox::Sandbox::new();
    sandbox.fit("run", &["--engine", "cpu"]).done();
    sandbox.fit("other", &["--engine", "cpu", "--free", "base_weight"]).done();
    sandbox.run(&["page", "run", "--compare", "other"]).done();
    let script = r##"
        await complete();
        const found = { told: skinfit.told() };
        // Nothing is drawn that no pane shows.
        found.hidden = skinfit.state().panes.find((pane) => pane.name === "other run").lacking;
        press("pane other run");
        await until("the other run", () => skinfit.pixels("other run"));
        const now = skinfit.pixels("error").number;
        key("o"); key("o"); key("o");
        await until("the error of the other run", () => skinfit.state().look.error_of === "Other" && (skinfit.pixels("error")?.number ?? now) !== now);
        found.title = skinfit.state().panes.find((pane) => pane.name === "error").title;
        key("F2");
        await until("the table", () => document.querySelector("#tables-shown td"));
        found.heads = [...document.querySelectorAll("#tables-shown thead th")].map((head) => head.textContent);
        found.table = [...document.querySelectorAll("#tables-shown tbody tr")].map((row) => [...row.children].map((cell) => cell.textContent));
        key("F2");
        found.closed = !document.getElementById("tables").open;
        const gain = () => skinfit.state().gains.rows[0].value;
        const psnr = skinfit.state().image.psnr;
        slide("gain front", [0.6, 0.7]);
        await until("the gain", () => gain() > 1.5 && skinfit.state().idle && skinfit.state().image.psnr !== psnr);
        found.gain = [gain(), psnr - skinfit.state().image.psnr];
        press("undo");
        await until("it is undone", () => gain() === 1);
        return found;
    "##;
    let Some(found) = visit(&sandbox.path("run/page.html"), With::NoAdapter, script, None) else { return };
    assert_eq!(found["told"], json!([]), "{found}");
    assert_eq!(found["hidden"], "being drawn");
    assert_eq!(found["title"], "error of other run: FLIP, 0 to 1");
    assert!(found["heads"].as_array().unwrap().contains(&json!("other run, dB")), "{}", found["heads"]);
    let [run, other] = ["run", "other"].map(|name| sandbox.json(&format!("{name}/report.json")));
    let table = found["table"].as_array().unwrap();
    let row =
        |name: &str| table.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("{name}: {table:?}"));
    let value = |report: &Value| {
        let unknowns = report["unknowns"].as_array().unwrap();
        let unknown = unknowns.iter().find(|unknown| unknown["name"] == "base_weight").unwrap();
        format!("{:.5}", unknown["value"].as_f64().unwrap())
    };
    assert_eq!(
        (row("base_weight")[3].as_str(), row("base_weight")[5].as_str()),
        (Some(&*value(&run)), Some(&*value(&other)))
    );
    let psnr = |report: &Value| format!("{:.2}", report["views"]["front"]["psnr"].as_f64().unwrap());
    assert_eq!(
        (row("front")[1].as_str(), row("front")[3].as_str()),
        (Some(&*psnr(&run)), Some(&*psnr(&other)))
    );
    assert_eq!(found["closed"], true);
    // The ends of its slider are a tenth and ten times.
    let gain = found["gain"][0].as_f64().unwrap();
    assert!(
        (gain - 10.0_f64.powf(0.4)).abs() < 1e-9 && found["gain"][1].as_f64().unwrap() > 3.0,
        "{}",
        found["gain"]
    );
}

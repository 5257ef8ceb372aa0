//! The pages in a real browser: headless Chromium opens them as a user would, from the disk.
//!
//! Screenshots go to target/screenshots, to be looked at.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use super::sandbox::Sandbox;
use super::tradeoffs::done;

/// The browser; none, said loudly, where it is left out on purpose.
pub(super) fn browser() -> Option<&'static str> {
    if std::env::var_os("SKINFIT_NO_BROWSER_TESTS").is_some() {
        crate::common::not_checked("SKINFIT_NO_BROWSER_TESTS is set, so no page was opened in a browser");
        return None;
    }
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let there = |name: &&str| Command::new(name).arg("--version").output().is_ok();
    let found = names.into_iter().find(|name| there(name));
    assert!(
        found.is_some(),
        "no browser was found: install Debian's `chromium` (tests/run does), or set SKINFIT_NO_BROWSER_TESTS=1"
    );
    found
}

/// Run the browser on a page; what it printed.
fn open(browser: &str, page: &Path, more: &[&str]) -> String {
    let profile = tempfile::tempdir().unwrap();
    let output = Command::new(browser)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--disable-dev-shm-usage",
        ])
        // The fonts of a machine, its time zone and its theme are its own; the rest is the page's.
        .args(["--force-color-profile=srgb", "--virtual-time-budget=5000"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(more)
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Look at a page as its user sees it: the file in target/screenshots, and how many colours it has.
fn screenshot(browser: &str, page: &Path, name: &str, width: u32) -> usize {
    let folder = Path::new(env!("CARGO_BIN_EXE_skinfit")).ancestors().nth(2).unwrap().join("screenshots");
    std::fs::create_dir_all(&folder).unwrap();
    let file: PathBuf = folder.join(name);
    let _ = std::fs::remove_file(&file);
    let size = format!("--window-size={width},2400");
    let shot = format!("--screenshot={}", file.display());
    open(browser, page, &[size.as_str(), shot.as_str()]);
    let image = image::open(&file).unwrap().to_rgb8();
    assert_eq!(image.width(), width, "{name}");
    image.pixels().map(|pixel| pixel.0).collect::<std::collections::BTreeSet<_>>().len()
}

/// What a script finds when it is run in the page.
fn inspect(browser: &str, page: &Path, script: &str) -> Value {
    let html = std::fs::read_to_string(page).unwrap();
    let probe = format!(
        "<script>addEventListener('load', () => {{ const found = (() => {{ {script} }})(); \
         document.body.setAttribute('data-found', encodeURIComponent(JSON.stringify(found))); }});</script></body>"
    );
    let probed = page.with_extension("probed.html");
    std::fs::write(&probed, html.replacen("</body>", &probe, 1)).unwrap();
    let dom = open(browser, &probed, &["--dump-dom"]);
    let found = dom.split("data-found=\"").nth(1).and_then(|rest| rest.split('"').next());
    let found = found.unwrap_or_else(|| panic!("the script did not run: {}", &dom[..dom.len().min(2000)]));
    let found = percent_encoding::percent_decode_str(found).decode_utf8().unwrap();
    serde_json::from_str(&found).unwrap()
}

/// Sorts a table by each of its columns, both ways; moves each slider; and lists what the page fetched.
const PROBE: &str = r#"
const column = (table, i) => [...table.tBodies[0].rows].map((row) => ({
  sort: row.cells[i].dataset.sort ?? null, text: row.cells[i].textContent,
}));
const tables = [...document.querySelectorAll("table.sortable")].map((table) => {
  const headings = [...table.tHead.rows[0].cells];
  return { id: table.id, rows: table.tBodies[0].rows.length, columns: headings.map((heading, i) => {
    heading.click();
    const first = { order: heading.ariaSort, cells: column(table, i) };
    heading.click();
    const second = { order: heading.ariaSort, cells: column(table, i) };
    return { numeric: heading.classList.contains("n"), first, second };
  }) };
});
const sliders = [...document.querySelectorAll(".triple")].map((triple) => {
  const [before, after] = [...triple.querySelectorAll(".frame")];
  const slider = after.querySelector("input[type=range]");
  slider.value = 40;
  slider.dispatchEvent(new Event("input"));
  const over = after.querySelector("img.over");
  return {
    at: after.style.getPropertyValue("--at"),
    same: over.src === before.querySelector("img").src,
    clip: getComputedStyle(over).clipPath,
  };
});
const dots = [...document.querySelectorAll("svg.plot circle")];
return {
  tables, sliders,
  hover: dots.length > 0 && dots.every((dot) => dot.querySelector("title").textContent.length > 10),
  fetched: performance.getEntriesByType("resource").map((entry) => entry.name).filter((name) => !name.startsWith("data:")),
  wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
  broken: [...document.images].filter((image) => !image.complete || image.naturalWidth === 0).length,
};
"#;

/// Cells in an order: numbers one way with those that are none at the end, words by the alphabet.
fn assert_sorted(column: &Value, which: &str, at: &str) {
    let sorted = &column[which];
    let down = sorted["order"] == "descending";
    let cells = sorted["cells"].as_array().unwrap();
    if column["numeric"].as_bool().unwrap() {
        let numbers: Vec<Option<f64>> =
            cells.iter().map(|cell| cell["sort"].as_str().map(|x| x.parse().unwrap())).collect();
        let known: Vec<f64> = numbers.iter().copied().flatten().collect();
        assert!(numbers[..known.len()].iter().all(Option::is_some), "{at}: {numbers:?}");
        assert!(known.windows(2).all(|p| if down { p[0] >= p[1] } else { p[0] <= p[1] }), "{at}: {known:?}");
    } else {
        let words: Vec<String> =
            cells.iter().map(|cell| cell["text"].as_str().unwrap().to_lowercase()).collect();
        // Numbers that begin a word come by their size, then letters; the browser passes over blanks and signs.
        let key = |word: &String| -> (bool, u64) {
            let letters: String = word.chars().filter(|c| c.is_alphanumeric()).collect();
            let number: String = word.chars().take_while(char::is_ascii_digit).collect();
            number.parse().map_or_else(
                |_| (true, letters.chars().next().map_or(0, u64::from)),
                |number| (false, number),
            )
        };
        let keys: Vec<(bool, u64)> = words.iter().map(key).collect();
        // A value that is not there is a dash, which has neither.
        let keys: Vec<(bool, u64)> = keys.into_iter().filter(|key| *key != (true, 0)).collect();
        assert!(keys.windows(2).all(|p| if down { p[0] >= p[1] } else { p[0] <= p[1] }), "{at}: {words:?}");
    }
}

/// A page works: it fetches nothing, its tables sort, its sliders wipe, its plots tell their values.
fn check(browser: &str, page: &Path, tables: &[&str], pictures: bool, plots: bool) {
    let html = std::fs::read_to_string(page).unwrap();
    // Nothing to fetch is even named: addresses stand in the name of SVG's vocabulary alone.
    let addresses = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!addresses.contains("http://") && !addresses.contains("https://"), "an address is named");
    let found = inspect(browser, page, PROBE);
    assert_eq!(found["fetched"].as_array().unwrap().len(), 0, "{}", found["fetched"]);
    assert_eq!((found["broken"].as_u64(), found["wide"].as_i64()), (Some(0), Some(0)), "pictures, width");
    assert_eq!(found["hover"].as_bool().unwrap(), plots, "values at dots");
    let ids: Vec<&str> =
        found["tables"].as_array().unwrap().iter().map(|t| t["id"].as_str().unwrap()).collect();
    assert_eq!(ids, tables);
    for table in found["tables"].as_array().unwrap() {
        // A small scene has one setting of an axis; there is nothing to sort then.
        if table["rows"].as_u64().unwrap() == 1 {
            continue;
        }
        assert!(table["rows"].as_u64().unwrap() > 1, "{}", table["id"]);
        for (i, column) in table["columns"].as_array().unwrap().iter().enumerate() {
            let orders = [&column["first"]["order"], &column["second"]["order"]];
            assert_ne!(orders[0], orders[1], "a second click turns round");
            for which in ["first", "second"] {
                assert_sorted(column, which, &format!("{} column {i} {which}", table["id"]));
            }
        }
    }
    let sliders = found["sliders"].as_array().unwrap();
    assert_eq!(!sliders.is_empty(), pictures);
    for slider in sliders {
        assert_eq!((slider["at"].as_str(), slider["same"].as_bool()), (Some("40%"), Some(true)), "{slider}");
        assert!(slider["clip"].as_str().unwrap().contains("60%"), "{slider}");
    }
}

#[test]
fn pages_work_in_a_browser() {
    let Some(browser) = browser() else { return };
    let sandbox = Sandbox::new();
    sandbox.run(&["ablate", "scene.toml", "-o", "parts", "--gpu", "never", "--refit"]);
    sandbox.fit("run", &["--engine", "cpu"]).done();
    // Of settings and of none, with times, bits and operations.
    let axes = ["format", "irradiance", "rays", "samples", "solver"];
    let options = axes.iter().flat_map(|axis| ["--axis", axis]).collect::<Vec<_>>();
    let goal = ["tradeoff", "scene.toml", "-o", "cost", "--params", "truth.toml", "--within", "1%"];
    done(sandbox.run(&[&goal[..], &options].concat()));
    let cost = sandbox.path("cost/report.html");
    let tables: Vec<String> = axes.iter().map(|axis| format!("axis-{axis}")).collect();
    let tables: Vec<&str> = std::iter::once("cheapest").chain(tables.iter().map(String::as_str)).collect();
    check(browser, &cost, &tables, false, true);
    let colours = screenshot(browser, &cost, "tradeoff_1100.png", 1100);
    assert!(colours > 100, "{colours} colours");
    let parts = sandbox.path("parts/report.html");
    check(browser, &parts, &["cases", "by-view", "by-constant"], true, true);
    check(browser, &sandbox.path("run/report.html"), &[], true, false);
    for width in [900, 1200] {
        // A page of text, plots and pictures has thousands of colours; an empty one has one.
        let colours = screenshot(browser, &parts, &format!("ablation_{width}.png"), width);
        assert!(colours > 300, "{colours} colours");
    }
    let held = ["ablate", "scene.toml", "-o", "held", "--gpu", "never", "--refit", "--hold-out", "side"];
    sandbox.run(&held);
    let held = sandbox.path("held/report.html");
    check(browser, &held, &["cases", "by-held-out", "by-view", "by-constant"], true, true);
    let colours = screenshot(browser, &held, "ablation_held_out.png", 1200);
    assert!(colours > 300, "{colours} colours");
    // Without scripts tables, plots and pictures stay. (The browser takes no screenshot with scripts off, so
    // they are taken out.)
    let html = sandbox.text("parts/report.html");
    let (before, rest) = html.split_once("<script>").unwrap();
    let bare = sandbox.path("parts/bare.html");
    std::fs::write(&bare, [before, rest.split_once("</script>").unwrap().1].concat()).unwrap();
    let colours = screenshot(browser, &bare, "ablation_without_scripts.png", 1100);
    assert!(colours > 300, "{colours} colours");
    assert!(
        html.matches("<tr").count() > 9 * 4 && html.matches("<img src=\"data:image/png").count() >= 8 * 2 * 3
    );
}

//! The page of a tradeoff.

use std::fmt::Write as _;

use super::Tradeoff;
use super::axis::{Setting, Sweep};
use super::choose::Choice;
use crate::report::page::{Cell, Page, Table, escape, facts, section, tile};
use crate::report::plot::{Dot, Joined, Plot};
use crate::report::{count, number, seconds};
use crate::timing::Timed;
use crate::titles::{title, title_of_several};

/// Errors of so much of the image's root mean square are told of each axis.
const TOLD: [f64; 2] = [0.01, 0.001];

/// How several scenes are taken together.
const TOGETHER: &str =
    " Several scenes are taken together: errors are those of all of their views, seconds are added up.";

/// `report.html` of a tradeoff of the scene of that name.
#[must_use]
pub fn page(scene: &str, tradeoff: &Tradeoff) -> String {
    let mut main = String::new();
    for warning in &tradeoff.warnings {
        let _ = write!(main, "<p class=\"quiet\">{}</p>", escape(warning));
    }
    if !tradeoff.pending.is_empty() {
        let words = format!(
            "Not measured: {}. The study was interrupted, or is not done yet.",
            tradeoff.pending.join(", ")
        );
        let _ = write!(main, "<p id=\"pending\">{words}</p>");
    }
    if let Some(missed) = tradeoff.missed() {
        let words = format!("<p>No settings are {}: {}.</p>", escape(&missed.goal), escape(&missed.least));
        main += &section("choice", &format!("No settings {}", missed.goal), &words);
    }
    if let Some(choice) = tradeoff.choice() {
        main += &section("choice", &format!("Settings {}", choice.goal), &chosen(choice));
    }
    main += &section("summary", "The cheapest setting of each axis", &summary(&tradeoff.sweeps));
    for sweep in &tradeoff.sweeps {
        main += &section(sweep.axis, sweep.title, &axis(sweep));
    }
    main += &section("method", "How it was measured", &method(scene, tradeoff));
    let together = if tradeoff.scenes.is_empty() { "" } else { TOGETHER };
    let lead = format!(
        "Each approximation swept by itself, all else as the scene has it. The error is the root mean square difference of the \
                images in linear radiance, relative to the reference's own root mean square, over all views; the cost is beside it.{together}"
    );
    let title = match tradeoff.scenes.as_slice() {
        [] => title(scene),
        scenes => title_of_several(scenes),
    };
    Page { kind: "tradeoff", title: &title, lead, tiles: tiles(tradeoff), main }.html()
}

fn tiles(tradeoff: &Tradeoff) -> String {
    let settings: usize = tradeoff.sweeps.iter().map(|sweep| sweep.settings.len()).sum();
    let pareto: usize =
        tradeoff.sweeps.iter().flat_map(|sweep| &sweep.settings).filter(|setting| setting.pareto).count();
    let tiles = [
        ("axes", tradeoff.sweeps.len().to_string()),
        ("settings", settings.to_string()),
        ("Pareto-optimal", pareto.to_string()),
    ];
    let mut html: String = tiles.iter().map(|(name, value)| tile(name, value, "")).collect();
    if let Some(choice) = tradeoff.choice() {
        html +=
            &tile("error", &format!("{}%", number(100.0 * choice.error.relative, 3)), &escape(&choice.goal));
        html += &tile(
            "time",
            &seconds(choice.seconds),
            &format!("reference {}", seconds(choice.reference_seconds)),
        );
    }
    html
}

fn chosen(choice: &Choice) -> String {
    let rows: Vec<(String, String)> =
        choice.settings.iter().map(|(axis, name)| ((*axis).to_owned(), name.clone())).collect();
    format!(
        "<p>All together they were measured to be {}% off the reference of every axis (their errors' squares summed to {}%), and take {} \
         beside the reference's {}. The scene file beside this page has them.</p>{}",
        number(100.0 * choice.error.relative, 3),
        number(100.0 * choice.foretold, 3),
        seconds(choice.seconds),
        seconds(choice.reference_seconds),
        facts(&rows)
    )
}

/// The cost of a setting in words.
fn cost(sweep: &Sweep, setting: &Setting) -> String {
    if sweep.cost == "seconds" {
        seconds(setting.cost)
    } else {
        format!("{} {}", amount(setting.cost), sweep.cost)
    }
}

/// A count: without decimals where it is whole.
fn amount(x: f64) -> String {
    if x.fract() == 0.0 && (0.0..1e15).contains(&x) { count(x as u64) } else { number(x, 4) }
}

/// Words with `names` among them.
fn with_code(words: &str) -> String {
    let part = |(i, text): (usize, &str)| {
        if i % 2 == 1 { format!("<code>{}</code>", escape(text)) } else { escape(text) }
    };
    words.split('`').enumerate().map(part).collect()
}

/// For each axis the cheapest setting within some errors, and its reference.
fn summary(sweeps: &[Sweep]) -> String {
    let headings: Vec<String> = TOLD.iter().map(|error| format!("within {}%.", 100.0 * error)).collect();
    let mut columns = vec![("axis", "what is swept")];
    columns
        .extend(headings.iter().map(|heading| (heading.as_str(), "the cheapest setting with such an error")));
    columns.push(("reference.", "what errors are measured against"));
    let mut table = Table::new(&columns);
    for sweep in sweeps {
        let within = |error: f64| {
            let near = sweep.settings.iter().filter(|setting| setting.error.relative <= error);
            near.min_by(|a, b| a.cost.total_cmp(&b.cost))
        };
        let cell = |setting: Option<&Setting>| {
            setting.map_or_else(Cell::none, |s| Cell::text(&format!("{} ({})", s.name, cost(sweep, s))))
        };
        let mut cells = vec![Cell::text(sweep.title)];
        cells.extend(TOLD.iter().map(|&error| cell(within(error))));
        cells.push(cell(sweep.settings.iter().find(|setting| setting.reference)));
        table.row("", &cells);
    }
    table.html("cheapest")
}

fn axis(sweep: &Sweep) -> String {
    let counts: Vec<&str> =
        sweep.settings.first().map(|s| s.counts.iter().map(|(name, _)| *name).collect()).unwrap_or_default();
    let cost_heading = if sweep.cost == "seconds" { "seconds" } else { sweep.cost };
    let mut columns = vec![
        ("setting", "of the approximation"),
        ("error, %", "root mean square difference over the reference's root mean square"),
        ("PSNR, dB", "mean of the views"),
        ("FLIP", "mean of the views"),
        (cost_heading, "what it costs"),
    ];
    let timed = sweep.cost != "seconds" && sweep.settings.iter().any(|setting| setting.time.is_some());
    if timed {
        columns.push(("time", "of a pass, where it was measured"));
    }
    columns.extend(counts.iter().map(|name| (*name, "a count: the same on every machine")));
    columns.extend([
        ("pareto.", "whether nothing is both as cheap and as accurate"),
        ("note.", "what the others are measured against, and what the scene has at present"),
    ]);
    let mut table = Table::new(&columns);
    for setting in &sweep.settings {
        let time = setting.time.map_or_else(Cell::none, |time| {
            // What it costs is a median, or of bakes the least; operations and bits are no times.
            let own = if sweep.cost == "seconds" { setting.cost } else { time.seconds.median };
            Cell::value(format!("{} <span class=\"pm inline\">{}</span>", seconds(own), spread(time)), own)
        });
        let mut cells = vec![
            Cell::text(&setting.name),
            Cell::value(number(100.0 * setting.error.relative, 3), setting.error.relative),
            Cell::psnr(setting.error.psnr),
            Cell::score(setting.error.flip, 5),
        ];
        if sweep.cost == "seconds" {
            cells.push(time.clone());
        } else {
            cells.push(Cell::value(amount(setting.cost), setting.cost));
        }
        if timed {
            cells.push(time);
        }
        cells.extend(setting.counts.iter().map(|&(_, n)| Cell::value(amount(n), n)));
        cells.push(Cell::text(if setting.pareto { "pareto" } else { "" }));
        cells.push(Cell::text(&setting.notes().join(", ")));
        table.row(if setting.reference { "reference" } else { "" }, &cells);
    }
    let plot = plot(sweep);
    let traces = if sweep.traces.is_empty() { String::new() } else { traces(sweep) };
    format!(
        "<p class=\"quiet\">{}</p>{}{}{traces}{}",
        with_code(&sweep.method),
        plot.svg(),
        plot.legend(),
        table.html(&format!("axis-{}", sweep.axis))
    )
}

/// The quartiles of a time.
fn spread(time: Timed) -> String {
    match time.quartiles() {
        Some([lower, upper]) => format!("{} to {}", seconds(lower), seconds(upper)),
        // What was run once has no spread to tell of.
        None => "once".to_owned(),
    }
}

/// A setting's name in a plot, which tells the scene's own from the others.
fn named(setting: &Setting) -> String {
    if setting.present { format!("{} (the scene's)", setting.name) } else { setting.name.clone() }
}

/// Error against cost.
#[must_use]
pub fn plot(sweep: &Sweep) -> Plot<'_> {
    let dot = |setting: &Setting| Dot {
        x: setting.cost,
        y: 100.0 * setting.error.relative,
        label: named(setting),
        title: format!(
            "{}: {}% off, {}",
            named(setting),
            number(100.0 * setting.error.relative, 3),
            cost(sweep, setting)
        ),
        series: 0,
        front: setting.pareto,
    };
    Plot {
        x: sweep.cost,
        y: "error, %",
        log_x: true,
        dots: sweep.settings.iter().map(dot).collect(),
        series: Vec::new(),
        joined: Joined::Front,
    }
}

/// How far above the best loss each run was, by seconds.
fn traces(sweep: &Sweep) -> String {
    let all = || sweep.traces.iter().flat_map(|trace| &trace.points);
    let best = all().map(|point| point.2).fold(f64::INFINITY, f64::min);
    let mut dots = Vec::new();
    for (series, trace) in sweep.traces.iter().enumerate() {
        // Beyond some points a curve is as clear.
        let every = trace.points.len().div_ceil(120).max(1);
        for (i, (passes, took, loss)) in trace.points.iter().enumerate() {
            let last = i + 1 == trace.points.len();
            if i % every == 0 || last {
                dots.push(Dot {
                    x: *took,
                    y: (loss - best).max(0.0),
                    label: if last { trace.name.clone() } else { String::new() },
                    title: format!(
                        "{}: loss {} after {}, {passes} passes",
                        trace.name,
                        number(*loss, 5),
                        seconds(*took)
                    ),
                    series,
                    front: true,
                });
            }
        }
    }
    let plot = Plot {
        x: "seconds",
        y: "loss above the best",
        log_x: true,
        dots,
        series: sweep.traces.iter().map(|trace| trace.name.clone()).collect(),
        joined: Joined::Series,
    };
    format!("<h3>The loss on the way</h3>{}{}", plot.svg(), plot.legend())
}

fn method(scene: &str, tradeoff: &Tradeoff) -> String {
    let held_out = tradeoff.held_out.join(", ");
    let rows = [
        ("software", format!("skinfit {}", env!("CARGO_PKG_VERSION"))),
        ("scene", scene.to_owned()),
        ("left out of fits", held_out.clone()),
        ("threads", rayon::current_num_threads().to_string()),
        ("instructions", crate::simd::instructions()),
    ];
    let told = rows.into_iter().filter(|(_, text)| !text.is_empty());
    let rows: Vec<(String, String)> = told.map(|(name, text)| (name.to_owned(), text)).collect();
    format!(
        "<p>Times are of rounds in which all settings of an axis take turns, after one that warms up: of bakes, traces and passes the \
         least, of fits the median, with the rounds' quartiles beside them; what takes more than 3 s is run once. Counts \
         stand beside them, as they are the same on every machine. Filled dots are Pareto-optimal: nothing is both as cheap and as \
         accurate; the dashed line joins them. Dots on the line marked 0 have no error at all.</p>{}",
        facts(&rows)
    )
}

//! What a study of stability found: for people, and as JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;

use super::check::Verdict;
use super::search::{Found, Hunt, Tally};

/// One case on every evaluator.
#[derive(Clone, Debug)]
pub struct CaseRow {
    /// Its name; cases of one name are told as one.
    pub name: String,
    /// What is hard about it.
    pub hard: String,
    /// How each evaluator did; `None` where it has no such stage.
    pub verdicts: Vec<Option<Verdict>>,
}

/// What a study found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The evaluators' names.
    pub evaluators: Vec<String>,
    /// Hard cases and kept ones.
    pub rows: Vec<CaseRow>,
    /// For each evaluator, how many hard cases it was given.
    pub hard: Vec<usize>,
    /// For each evaluator, the random search.
    pub random: Vec<Tally>,
    /// For each evaluator that is an engine, the random search of lights.
    pub lit: Vec<Tally>,
    /// For each evaluator, the samples of all scenes.
    pub swept: Vec<Tally>,
    /// For each evaluator that is an engine, what files declare for the effects of all scenes.
    pub declared: Vec<Tally>,
    /// The same of each scene, by its name, where there are several.
    pub scenes: Vec<(String, Vec<Tally>)>,
    /// New hard cases.
    pub found: Vec<Found>,
    /// What the search was drawn from.
    pub seed: u64,
    /// What is missing, loudly.
    pub missing: Vec<String>,
}

/// What was tried beside hard cases.
struct Search<'a> {
    /// What it is called where it failed.
    what: String,
    /// What its row is called.
    row: String,
    /// How each evaluator did.
    tallies: &'a [Tally],
}

impl Report {
    /// Nothing yet, of these evaluators.
    #[must_use]
    pub fn new(evaluators: Vec<String>, seed: u64) -> Self {
        let count = evaluators.len();
        let tallies = vec![Tally::default(); count];
        Self {
            evaluators,
            hard: vec![0; count],
            random: tallies.clone(),
            lit: tallies.clone(),
            declared: tallies.clone(),
            swept: tallies,
            seed,
            ..Self::default()
        }
    }

    /// Take note of a case of `count` fragments; those of one name become one row.
    pub fn add(&mut self, (name, hard): (&str, &str), count: usize, verdicts: Vec<Option<Verdict>>) {
        for (sum, verdict) in self.hard.iter_mut().zip(&verdicts) {
            *sum += if verdict.is_some() { count } else { 0 };
        }
        match self.rows.iter_mut().find(|row| row.name == name) {
            None => self.rows.push(CaseRow { name: name.to_owned(), hard: hard.to_owned(), verdicts }),
            Some(row) => {
                for (old, new) in row.verdicts.iter_mut().zip(verdicts) {
                    match (old, new) {
                        (Some(old), Some(new)) => old.merge(new),
                        (old, new) => *old = old.take().or(new),
                    }
                }
            }
        }
    }

    /// Take note of what became of a scene's samples; `name` where there are several scenes.
    pub fn add_scene(&mut self, name: Option<&str>, hunt: Hunt<'_>) {
        for (all, own) in self.swept.iter_mut().zip(&hunt.tallies) {
            all.merge(own);
        }
        self.found.extend(
            hunt.found.into_iter().map(|found| Found { failure: placed(name, &found.failure), ..found }),
        );
        self.scenes.extend(name.map(|name| (name.to_owned(), hunt.tallies)));
    }

    /// Take note of what became of the parameters that files declare for a scene's effects.
    pub fn add_declared(&mut self, name: Option<&str>, tallies: Vec<Tally>) {
        for (all, mut own) in self.declared.iter_mut().zip(tallies) {
            own.worst.failure = own.worst.failure.map(|failure| placed(name, &failure));
            all.merge(&own);
        }
    }

    /// The searches; of several scenes each one's samples by themselves.
    fn searches(&self) -> Vec<Search<'_>> {
        let of =
            |what: &str, row: &str, tallies| Search { what: what.to_owned(), row: row.to_owned(), tallies };
        let mut all = vec![
            of("random search", "random search", self.random.as_slice()),
            of("random lights", "random lights", &self.lit),
        ];
        if self.declared.iter().any(|tally| tally.tried > 0) {
            all.push(of("declared parameters", "declared parameters", &self.declared));
        }
        if self.scenes.is_empty() {
            all.push(of("scene", "the scene's samples", &self.swept));
        }
        for (name, tallies) in &self.scenes {
            all.push(of(&format!("scene {name}"), &format!("samples of {name}"), tallies));
        }
        all
    }

    /// Everything that is not finite or out of tolerance, a line each.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for row in &self.rows {
            for (verdict, evaluator) in row.verdicts.iter().zip(&self.evaluators) {
                if let Some(failure) = verdict.as_ref().and_then(|v| v.failure.as_ref()) {
                    lines.push(format!("{}: {evaluator}: {failure}", row.name));
                }
            }
        }
        for Search { what, tallies, .. } in self.searches() {
            for (tally, evaluator) in tallies.iter().zip(&self.evaluators) {
                if let Some(failure) = &tally.worst.failure {
                    let Tally { failed, tried, .. } = tally;
                    lines.push(format!(
                        "{what}: {evaluator}: at least {failed} of {tried} fragments failed: {failure}"
                    ));
                }
            }
        }
        lines
    }

    /// The tables for a terminal: a row a case, a column an evaluator.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        let searches = self.searches();
        let names = self.rows.iter().map(|row| row.name.len());
        let names = names.chain(searches.iter().map(|search| search.row.len()));
        let width = names.max().unwrap_or(0).max(24);
        let _ = writeln!(
            text,
            "Worst deviation from the model in f64, as a share of the number (and of what rounding explains):\n"
        );
        let columns: Vec<usize> = self.evaluators.iter().map(|name| name.len().max(14)).collect();
        let _ = write!(text, "{:<width$}", "");
        for (name, column) in self.evaluators.iter().zip(&columns) {
            let _ = write!(text, "  {name:>column$}");
        }
        text.push('\n');
        let mut row = |name: &str, cells: Vec<String>| {
            let _ = write!(text, "{name:<width$}");
            for (cell, column) in cells.iter().zip(&columns) {
                let _ = write!(text, "  {cell:>column$}");
            }
            text.push('\n');
        };
        for case in &self.rows {
            row(&case.name, case.verdicts.iter().map(|v| v.as_ref().map_or("-".into(), cell)).collect());
        }
        for Search { row: name, tallies, .. } in searches {
            let cell = |tally: &Tally| if tally.tried == 0 { "-".to_owned() } else { cell(&tally.worst) };
            row(&name, tallies.iter().map(cell).collect());
        }
        text.push('\n');
        for (index, name) in self.evaluators.iter().enumerate() {
            let all = [&self.random, &self.lit, &self.declared, &self.swept];
            let [random, lit, declared, swept] = all.map(|tallies| &tallies[index]);
            let _ = writeln!(
                text,
                "{name}: {} hard cases, {} random ones, {} of lights, {} of declared parameters, {} samples of the {}; {}",
                self.hard[index],
                random.tried,
                lit.tried,
                declared.tried,
                swept.tried,
                if self.scenes.is_empty() { "scene" } else { "scenes" },
                match self.failed(index) {
                    0 => "none failed".to_owned(),
                    failed => format!("at least {failed} failed"),
                }
            );
        }
        text
    }

    /// How many cases an evaluator failed at the least.
    fn failed(&self, index: usize) -> usize {
        let failed = |row: &&CaseRow| row.verdicts[index].as_ref().is_some_and(|v| v.failure.is_some());
        self.rows.iter().filter(failed).count()
            + self.random[index].failed
            + self.lit[index].failed
            + self.declared[index].failed
            + self.swept[index].failed
    }

    /// Everything as JSON.
    ///
    /// # Errors
    /// Never: the structures are plain.
    pub fn json(&self) -> serde_json::Result<String> {
        let number = |verdict: &Verdict| OutVerdict {
            deviation: verdict.deviation,
            share_of_tolerance: verdict.share,
            failure: verdict.failure.clone(),
        };
        let tally = |tally: &Tally| OutTally {
            tried: tally.tried,
            failed: tally.failed,
            worst: number(&tally.worst),
        };
        let engines = self.evaluators.iter().enumerate().map(|(i, name)| OutEngine {
            name,
            hard: self.hard[i],
            random: tally(&self.random[i]),
            lights: tally(&self.lit[i]),
            declared: tally(&self.declared[i]),
            scene: tally(&self.swept[i]),
            scenes: self.scenes.iter().map(|(name, tallies)| (name.as_str(), tally(&tallies[i]))).collect(),
            cases: self
                .rows
                .iter()
                .filter_map(|row| {
                    let verdict = number(row.verdicts[i].as_ref()?);
                    Some(OutCase { name: &row.name, hard: &row.hard, verdict })
                })
                .collect(),
        });
        let out = Out {
            version: env!("CARGO_PKG_VERSION"),
            seed: self.seed,
            failed: self.failures().len(),
            new_cases: self.found.len(),
            missing: &self.missing,
            engines: engines.collect(),
        };
        serde_json::to_string_pretty(&out).map(|text| text + "\n")
    }
}

/// A failure with the scene that it is of, where there are several.
fn placed(scene: Option<&str>, failure: &str) -> String {
    scene.map_or_else(|| failure.to_owned(), |scene| format!("in {scene}: {failure}"))
}

/// A deviation, its share of the tolerance, and that it failed.
fn cell(verdict: &Verdict) -> String {
    match &verdict.failure {
        Some(_) => "FAILED".to_owned(),
        None if verdict.deviation == 0.0 => "0".to_owned(),
        None => format!("{:.1e} ({:.0}%)", verdict.deviation, 100.0 * verdict.share),
    }
}

#[derive(Serialize)]
struct Out<'a> {
    version: &'a str,
    seed: u64,
    failed: usize,
    new_cases: usize,
    missing: &'a [String],
    engines: Vec<OutEngine<'a>>,
}

#[derive(Serialize)]
struct OutEngine<'a> {
    name: &'a str,
    hard: usize,
    random: OutTally,
    lights: OutTally,
    declared: OutTally,
    /// Of all scenes.
    scene: OutTally,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    scenes: BTreeMap<&'a str, OutTally>,
    cases: Vec<OutCase<'a>>,
}

#[derive(Serialize)]
struct OutTally {
    tried: usize,
    failed: usize,
    worst: OutVerdict,
}

#[derive(Serialize)]
struct OutVerdict {
    deviation: f64,
    share_of_tolerance: f64,
    failure: Option<String>,
}

#[derive(Serialize)]
struct OutCase<'a> {
    name: &'a str,
    hard: &'a str,
    #[serde(flatten)]
    verdict: OutVerdict,
}

//! Which effects a scene calls for: sets of effects, each fitted and scored on views that its fit did not see, from the
//! cheapest on.
//!
//! - [`moves`]: what may be added to a set at once; [`score`]: how good a set is on views held out
//! - [`files`]: the table, `results.csv`, `results.json`, and the front as a picture
//!
//! Effects depend on each other: gloss that nothing shades hides what a shadow is worth, so sets are judged, never an
//! effect by itself. A set grows by the move that gains most among those that earn their cost, then loses whatever is
//! not worth its cost beside the others.

pub mod files;
pub mod moves;
pub mod score;

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::StudyError;
use super::ablation::GpuTiming;
use super::ablation::measure::Clocks;
use super::cost::Counts;
use super::timing::Timed;
use crate::engine::Point;
use crate::model::effects::{Effect, Effects, Form};
use crate::model::params::Column;
use crate::prepare::{Loaded, PrepareError, PrepareOptions};
use crate::progress::{self, Work};
use crate::scene::Offers;
use moves::Move;
use score::{Fitted, Judge};

/// What is asked.
#[derive(Clone, Debug)]
pub struct SuggestOptions {
    /// The least gain in dB that a move is worth.
    pub least: f64,
    /// The least gain in dB for each time that what a set costs already is added to it.
    pub worth: f64,
    /// Where bakes are kept.
    pub cache: Option<PathBuf>,
    /// Whether the renderer is timed on a graphics adapter.
    pub gpu: GpuTiming,
}

impl Default for SuggestOptions {
    fn default() -> Self {
        Self { least: 0.1, worth: 0.2, cache: None, gpu: GpuTiming::Auto }
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Suggestion {
    /// Every set that was judged, in the order in which it was.
    pub sets: Vec<Set>,
    /// The sets on the way to the chosen one, from the cheapest on: places in `sets`.
    pub steps: Vec<Step>,
    /// The chosen set's place.
    pub chosen: usize,
    /// Its constants, fitted to all views.
    pub point: Point,
    /// What was free in that fit.
    pub free: Vec<Column>,
    /// Which reading of the listings the scene takes.
    pub form: Form,
    /// What the renderer was timed on; none where it was not.
    pub adapter: Option<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A set of effects, judged.
#[derive(Clone, Debug, Serialize)]
pub struct Set {
    /// What is on.
    #[serde(skip)]
    pub effects: Effects,
    /// Mean PSNR in dB over the views, each scored by a fit of the others.
    pub held_out: f64,
    /// Operations a fragment in the renderer, as its planner counts them.
    pub operations: f64,
}

/// A step from a set to the next.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// What was added, or taken out: `lights + shadows`, `without rim`.
    pub what: String,
    /// The set that it led to.
    pub set: usize,
    /// What the set costs, in counts.
    pub counts: Counts,
    /// A pass of the CPU engine over all samples, every lookup live, beside the first set's.
    pub cpu: Timed,
    /// A frame of the renderer beside the first set's.
    pub gpu: Option<Timed>,
}

/// Find the effects that a scene calls for.
///
/// # Errors
/// When a stage refuses its input, a fit cannot be done, or there are fewer than two views with targets.
pub fn suggest(scene: &Path, options: &SuggestOptions) -> Result<Suggestion, StudyError> {
    let prepare = PrepareOptions { fit: true, cache: options.cache.clone(), ..PrepareOptions::default() };
    let loaded = Loaded::read(scene, &prepare)?;
    let views = loaded.scene.views.iter().filter(|view| view.target.is_some()).count();
    if views < 2 {
        return Err(StudyError::FewViews { scene: scene.display().to_string(), views });
    }
    let offers = Offers::read(scene).map_err(PrepareError::from)?;
    let (moves, start) = (Move::all(&loaded.scene, offers), Move::start(&loaded.scene, offers));
    drop(loaded);
    let judge = Judge { scene, prepare };

    let bar = progress::bar("sets of effects", (moves.len() * 3) as u64);
    let mut search = Search { judge: &judge, options, sets: Vec::new(), bar };
    let mut path = vec![("start".to_owned(), search.judged(start)?)];
    while let Some(next) = search.best_addition(path[path.len() - 1].1, &moves)? {
        path.push(next);
    }
    while let Some(next) = search.best_removal(path[path.len() - 1].1)? {
        path.push(next);
    }
    search.bar.finish_and_clear();
    let sets = search.sets;
    conclude(&judge, options, sets, &path)
}

/// Measure the sets on the way, and fit the chosen one to all views.
fn conclude(
    judge: &Judge<'_>,
    options: &SuggestOptions,
    sets: Vec<Set>,
    path: &[(String, usize)],
) -> Result<Suggestion, StudyError> {
    let first = judge.whole(sets[path[0].1].effects)?;
    let (at, form) = (first.scenes.start.clone(), first.scenes.first().baked.scene.form);
    let clocks = Clocks::new(&first, &at, options.gpu)?;
    let mut warnings: Vec<String> = clocks.warning.clone().into_iter().collect();
    let (mut steps, mut last) = (Vec::new(), None);
    for (what, set) in path {
        let subject = judge.whole(sets[*set].effects)?;
        let Fitted { point, .. } = judge.fit(&subject)?;
        let (cpu, gpu) = clocks.time(&subject, &point)?;
        let counts = Counts::new(&subject, &point)?;
        steps.push(Step { what: what.clone(), set: *set, counts, cpu, gpu });
        warnings.extend(subject.scenes.first().baked.warnings.iter().cloned());
        last = Some((point, subject.scenes.first().baked.scene.fit.free.clone()));
    }
    warnings.sort();
    warnings.dedup();
    let (point, free) = last.unwrap_or((at, Vec::new()));
    let chosen = path.last().map_or(0, |(_, set)| *set);
    Ok(Suggestion { sets, steps, chosen, point, free, form, adapter: clocks.adapter(), warnings })
}

/// A search under way.
struct Search<'a> {
    judge: &'a Judge<'a>,
    options: &'a SuggestOptions,
    sets: Vec<Set>,
    bar: Work,
}

impl Search<'_> {
    /// The place of a set, which is judged where it was not before.
    fn judged(&mut self, effects: Effects) -> Result<usize, StudyError> {
        if let Some(place) = self.sets.iter().position(|set| set.effects == effects) {
            return Ok(place);
        }
        self.bar.set_message(words(effects));
        let (held_out, operations) = self.judge.score(effects)?;
        self.sets.push(Set { effects, held_out, operations });
        self.bar.inc(1);
        Ok(self.sets.len() - 1)
    }

    /// The move that gains most among those that earn their cost; `None` where none does.
    fn best_addition(&mut self, from: usize, moves: &[Move]) -> Result<Option<(String, usize)>, StudyError> {
        let mut best: Option<(f64, String, usize)> = None;
        for step in moves {
            let own = self.sets[from].effects;
            let Some(effects) = step.onto(own) else { continue };
            let place = self.judged(effects)?;
            let (before, after) = (&self.sets[from], &self.sets[place]);
            let gain = after.held_out - before.held_out;
            let share = (after.operations - before.operations) / before.operations.max(1.0);
            let earns = gain >= self.options.least && gain >= self.options.worth * share;
            if earns && best.as_ref().is_none_or(|(most, ..)| gain > *most) {
                best = Some((gain, step.words(), place));
            }
        }
        Ok(best.map(|(_, what, place)| (what, place)))
    }

    /// The effect without which the set is best, where it is not worth its cost beside the others.
    fn best_removal(&mut self, from: usize) -> Result<Option<(String, usize)>, StudyError> {
        let mut best: Option<(f64, String, usize)> = None;
        let own = self.sets[from].effects;
        for effect in own.iter().filter(|effect| moves::can_go(own, *effect)) {
            let place = self.judged(own.without(effect))?;
            let (before, after) = (&self.sets[from], &self.sets[place]);
            let loss = before.held_out - after.held_out;
            let share = (before.operations - after.operations) / after.operations.max(1.0);
            let idle = loss < self.options.least || loss < self.options.worth * share;
            if idle && best.as_ref().is_none_or(|(least, ..)| loss < *least) {
                best = Some((loss, format!("without {}", effect.name()), place));
            }
        }
        Ok(best.map(|(_, what, place)| (what, place)))
    }
}

/// The names of a set's effects; what a scene's lights are called is left to `lights`.
#[must_use]
pub fn words(effects: Effects) -> String {
    names(effects).join(", ")
}

/// The effects that a scene file names for this set.
#[must_use]
pub fn names(effects: Effects) -> Vec<&'static str> {
    effects.iter().filter(|effect| effect.info().within.is_none()).map(Effect::name).collect()
}

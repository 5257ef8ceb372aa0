//! A batch of [`super::lit_case`], and what an engine may make of it: each fragment in f64, how far rounding may move it, and
//! the same of the derivatives that are compared.

use std::sync::Arc;

use rand::SeedableRng;
use rand::rngs::StdRng;

use super::check::{Number, Verdict};
use super::engine_factory::EngineFactory;
use super::evaluate::{Rgba, TARGET};
use super::lit_case::{LitBatch, LitFragment};
use super::objectives::{targets, weights};
use super::reference::{FEW, MANY, Moves, SPREAD, SUMMED, TINY};
use crate::engine::reference::{PixelColumns, Reference};
use crate::engine::residual::{Residuals, Weighted};
use crate::engine::view::ObservedView;
use crate::engine::{Point, Task, Unknown};
use crate::model::batch::Batch as Several;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param, Params};
use crate::samples::ViewSamples;

/// What f32 leaves of the split sum's fits, as a share of what a mirroring surface shows, and as a share of their own: the
/// fits' tests hold the one, a tenth of their own error; the other is as large where the share changes the fastest.
const FITTED: f64 = 5e-5;
/// About twice as many roundings lie one behind the other as in the paper's model, for which the spread is.
const LONGER: f64 = 2.0;
/// Fragments of a batch that were looked at again and stay wrong: more of them would say the same.
const KEPT: usize = 4;
/// How often the fragments of a batch are moved where a sum over them is looked at again: what few moves miss of one evens
/// out among many.
const SUMS: usize = 4 * FEW;

/// What is wanted of a fragment: the model in f64, and how far an engine may be off.
struct Wanted {
    value: Rgba,
    allowed: Rgba,
    /// What it adds to J^T r of each parameter whose derivative is compared, and how far that may be off.
    pulls: Vec<(f64, f64)>,
}

/// A batch, and what an engine may make of it.
pub(super) struct Tried {
    /// What it is called where it fails.
    what: String,
    pub(super) batch: LitBatch,
    wanted: Result<Vec<Wanted>, String>,
}

impl Tried {
    /// A batch beside the model in f64.
    pub(super) fn new(what: String, batch: LitBatch) -> Self {
        let wanted = wanted(&batch, FEW).and_then(|wanted| finite_slopes(&batch).map(|()| wanted));
        Self { what, batch, wanted }
    }

    /// How an engine does, and of how many fragments it fails: of all where it answers for none, and of one where only
    /// their sum is wrong.
    pub(super) fn verdict(&self, engine: &dyn EngineFactory) -> (Verdict, usize) {
        let (verdict, failed) = self
            .compared(engine)
            .unwrap_or_else(|words| (Verdict::failed(words), self.batch.fragments.len()));
        let told = |words| format!("{}, {}: {words}", self.what, self.batch.words());
        let failed = failed.max(usize::from(verdict.failure.is_some()));
        (Verdict { failure: verdict.failure.map(told), ..verdict }, failed)
    }

    fn compared(&self, engine: &dyn EngineFactory) -> Result<(Verdict, usize), String> {
        let wanted = self.wanted.as_ref().map_err(Clone::clone)?;
        let (task, point) = task(&self.batch, None);
        let planes = engine.image(&task, &point)?;
        let (mut verdict, mut failed) = (Verdict::default(), 0);
        for (slot, wanted) in wanted.iter().enumerate() {
            let got = [0, 1, 2, 3].map(|c: usize| f64::from(planes[c][slot]));
            let mut own = one(&got, wanted, engine.slack(), slot);
            if own.failure.is_some() && got.iter().all(|x| x.is_finite()) {
                if failed >= KEPT {
                    continue;
                }
                // Few moves may have missed the worst.
                let alone = self.batch.alone(slot);
                own = one(&got, &self::wanted(&alone, MANY)?[0], engine.slack(), slot);
            }
            failed += usize::from(own.failure.is_some());
            verdict.merge(own);
        }
        let mut pass = None;
        engine.with(&task, &point, &mut |engine| pass = Some(engine.gradient(&point)))?;
        let (loss, gradient) = pass.ok_or_else(|| "no engine was made".to_owned())?;
        let named = task.unknowns.iter().map(Unknown::name).zip(gradient.iter().copied());
        let odd =
            |(name, x): (String, f64)| (!x.is_finite()).then(|| format!("{name}, or its derivative, is {x}"));
        match std::iter::once(("loss".to_owned(), loss)).chain(named).find_map(odd) {
            Some(words) => verdict.merge(Verdict::failed(words)),
            None => verdict.merge(self.pulled(&gradient, wanted, engine.slack())?),
        }
        Ok((verdict, failed))
    }

    /// A gradient beside the sum of what each fragment adds to it.
    fn pulled(&self, gradient: &[f64], wanted: &[Wanted], slack: f64) -> Result<Verdict, String> {
        let beside = |wanted: &[Wanted]| {
            let mut verdict = Verdict::default();
            for (k, param) in self.batch.compared.iter().enumerate() {
                let place = self.batch.free.iter().position(|free| free == param);
                let Some(&slope) = place.and_then(|place| gradient.get(place)) else { continue };
                let pulls = || wanted.iter().map(|fragment| fragment.pulls[k]);
                let number = Number {
                    // The loss is a mean over every channel.
                    got: slope * (TARGET.len() * wanted.len()) as f64 / 2.0,
                    want: pulls().map(|(pull, _)| pull).sum(),
                    allowed: slack * pulls().map(|(_, allowed)| allowed).sum::<f64>(),
                    size: pulls().map(|(pull, _)| pull.abs()).sum(),
                };
                verdict.note(number, None, || format!("the gradient by {}", param.name()));
            }
            verdict
        };
        let verdict = beside(wanted);
        // Few moves may have missed the worst.
        if verdict.failure.is_some() { Ok(beside(&self::wanted(&self.batch, SUMS)?)) } else { Ok(verdict) }
    }
}

/// A fragment's colour beside what is wanted.
fn one(got: &Rgba, wanted: &Wanted, slack: f64, slot: usize) -> Verdict {
    let mut verdict = Verdict::default();
    for c in 0..4 {
        let (want, allowed) = (wanted.value[c], slack * wanted.allowed[c]);
        let number = Number { got: got[c], want, allowed, size: 0.0 };
        verdict.note(number, Some(slot), || {
            format!("fragment {slot}, {}", ["red", "green", "blue", "alpha"][c])
        });
    }
    verdict
}

/// What an engine is asked: the batch as it is, or with every number moved.
fn task(batch: &LitBatch, moves: Option<&mut Moves<'_>>) -> (Task, Point) {
    let (fragments, params) = match moves {
        None => (batch.fragments.clone(), batch.params.clone()),
        Some(moves) => batch.moved(moves),
    };
    let task = Task {
        setup: batch.setup,
        illumination: Arc::clone(&batch.light),
        views: Arc::new([view(batch, &fragments)]),
        loss: batch.loss,
        unknowns: tied(&batch.free),
    };
    (task, Point { params, gains: vec![Gain::ONE] })
}

/// Parameters as unknowns of all channels together.
fn tied(params: &[Param]) -> Vec<Unknown> {
    params.iter().map(|&param| Unknown::Param(Column::tied(param))).collect()
}

fn view(batch: &LitBatch, fragments: &[LitFragment]) -> ObservedView {
    let groups = fragments.len().div_ceil(crate::samples::LANES);
    let (surface, pixel, coverage) = batch.records(fragments, groups);
    let weight = weights(&coverage);
    let group_start = (0..=groups as u32).collect();
    let atlas = batch.atlas.clone();
    let samples = ViewSamples { group_start, surface, pixel, coverage, atlas, ..ViewSamples::default() };
    ObservedView { samples, target: targets(&TARGET, groups), weight, clip: None }
}

/// Each fragment in f64, and how far rounding may move it.
fn wanted(batch: &LitBatch, moves: usize) -> Result<Vec<Wanted>, String> {
    let mut rng = StdRng::seed_from_u64(2);
    let moved = (0..moves).map(|number| task(batch, Some(&mut Moves::new(&mut rng, number))));
    let (all, points): (Vec<Task>, Vec<Point>) = std::iter::once(task(batch, None)).chain(moved).unzip();
    let views: Vec<ObservedView> = all.iter().flat_map(|task| task.views.iter().cloned()).collect();
    let exact = Reference::new(batch.setup, &batch.light, &views, batch.loss, &tied(&batch.compared));
    let exact = exact.map_err(|error| error.to_string())?;
    // Of every move the blend of texels is rounded anew.
    let mut cubes: Vec<_> = points.iter().map(|point| exact.cubes(&point.params)).collect();
    for (number, cubes) in cubes.iter_mut().enumerate().skip(1) {
        let mut texels = Moves::new(&mut rng, number);
        *cubes = cubes.changed(|x| texels.texel(x));
    }
    let seen = |view: usize, params: &Params| exact.pixels_under(view, params, &cubes[view]);
    let moved: Vec<Vec<PixelColumns>> =
        points.iter().enumerate().map(|(view, point)| seen(view, &point.params)).collect();
    // Where little is reflected that is the rest of a fit's sums which are as large as where much is: these are rounded.
    let mut mirroring = batch.params.clone();
    for (name, value) in [("f0", 0.2), ("f0_floor", 1.0)] {
        if let Some(param) = Param::from_identifier(name) {
            mirroring.set(param, value);
        }
    }
    // What is reflected does not enter: where hardly anything does, the share's rounding is much of it.
    let mut shared = batch.params.clone();
    if let Some(param) = Param::from_identifier("specular_weight") {
        shared.set_rgb(param, batch.params.rgb(param).map(|x| x * (1.0 + FITTED)));
    }
    let [bright, other] = [&mirroring, &shared].map(|params| seen(0, params));
    let residuals = Residuals::new(batch.loss);
    let one = |slot: usize| {
        let [value, bright, other] = [&moved[0], &bright, &other].map(|pixels| colour(&pixels[slot]));
        let fitted = |c: usize| FITTED * bright[c].abs() + (other[c] - value[c]).abs();
        let summed: Rgba = std::array::from_fn(|c| SUMMED * value[c].abs() + fitted(c) + TINY);
        let mut allowed = summed;
        for pixels in &moved[1..] {
            let other = colour(&pixels[slot]);
            for c in 0..4 {
                allowed[c] = allowed[c].max(LONGER * SPREAD * (other[c] - value[c]).abs() + summed[c]);
            }
        }
        let pulls = pulls(&residuals, moved.iter().map(|pixels| &pixels[slot]), &allowed);
        Wanted { value, allowed, pulls }
    };
    let all: Vec<Wanted> = (0..batch.fragments.len()).map(one).collect();
    let sound = |x: &f64| x.is_finite();
    match all.iter().all(|fragment| fragment.value.iter().all(sound)) {
        true => Ok(all),
        false => Err("in f64 a colour is not finite".to_owned()),
    }
}

fn colour(pixel: &PixelColumns) -> Rgba {
    pixel.each_ref().map(|(value, _)| *value)
}

/// What a pixel adds to J^T r of each unknown, and how far that may be off: by what moves change of it, by what sums round,
/// and by what is `allowed` of the colour. The pixel as it is comes first, then what moves make of it.
fn pulls<'a>(
    residuals: &Residuals,
    mut pixels: impl Iterator<Item = &'a PixelColumns>,
    allowed: &Rgba,
) -> Vec<(f64, f64)> {
    let target = TARGET.map(f64::from);
    let weighed = |pixel: &PixelColumns| {
        residuals.weigh(None, Several(colour(pixel)), Several(target), Several([1.0; 4]))
    };
    let of = |pixel: &PixelColumns, k: usize| -> f64 {
        let all = weighed(pixel);
        all.each().zip(pixel).map(|(w, (_, columns))| w.scale * columns[k] * w.residual).sum()
    };
    let Some(pixel) = pixels.next() else { return Vec::new() };
    let rounded = |k: usize| -> f64 {
        let channel = |(c, weighed): (usize, Weighted<f64>)| {
            let (value, columns) = &pixel[c];
            let scale = weighed.scale.abs();
            let off = SUMMED * (weighed.residual.abs() + scale * value.abs()) + scale * allowed[c];
            scale * columns[k].abs() * off
        };
        weighed(pixel).each().enumerate().map(channel).sum()
    };
    let unknowns = pixel[0].1.len();
    let mut all: Vec<(f64, f64)> = (0..unknowns).map(|k| (of(pixel, k), 0.0)).collect();
    for other in pixels {
        for (k, (pull, off)) in all.iter_mut().enumerate() {
            *off = off.max(LONGER * SPREAD * (of(other, k) - *pull).abs());
        }
    }
    all.iter_mut().enumerate().for_each(|(k, (_, off))| *off += rounded(k) + TINY);
    all
}

/// That the model in f64 moves by finite numbers.
fn finite_slopes(batch: &LitBatch) -> Result<(), String> {
    let (task, point) = task(batch, None);
    let exact = Reference::new(task.setup, &task.illumination, &task.views, task.loss, &task.unknowns);
    let (_, gradient) =
        crate::engine::Objective::gradient(&exact.map_err(|error| error.to_string())?, &point);
    match gradient.iter().zip(&task.unknowns).find(|(x, _)| !x.is_finite()) {
        None => Ok(()),
        Some((x, unknown)) => Err(format!("in f64 the gradient by {} is {x}", unknown.name())),
    }
}

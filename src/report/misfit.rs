//! What a fit gets wrong as a whole, and where: residuals grouped by where they lie, told as sentences.
//!
//! A residual is the fit less the target in linear radiance, over the pixels that scores are taken of; a pixel's is the
//! mean of its three channels. A place is told when the signed mean of its residuals is at least [`LEAST`] of the
//! targets' mean radiance and [`SIGMAS`] of its standard errors, over at least [`LEAST_PIXELS`] of the pixels.
//!
//! Neighbouring pixels err alike, so blocks of pixels are the witnesses: the standard error is that of sums over blocks,
//! the greatest of those of blocks of 8, 16, 32, ... pixels a side, as long as there are `BLOCKS` of them.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Serialize;

use super::ViewEvidence;
use super::metrics::COVERED;
use super::words::number;

/// Targets of less mean radiance are black: what is off by a share of it is a matter of roundings.
const DARK: f64 = 1e-6;
/// The least signed mean that is told, as a share of the targets' mean radiance.
pub const LEAST: f64 = 0.01;
/// The least signed mean that is told, in standard errors.
pub const SIGMAS: f64 = 3.0;
/// The least share of the pixels that a place must have.
pub const LEAST_PIXELS: f64 = 0.005;
/// The most places that are told.
pub const MOST: usize = 5;

/// Blocks that are needed of a greater size than the smallest.
const BLOCKS: usize = 30;
/// Blocks without which there is no standard error.
const FEWEST_BLOCKS: usize = 5;
/// Side of the smallest blocks, in pixels.
const BLOCK: usize = 8;

/// In a crease less than this share of the hemisphere is open.
const CREASED: f32 = 0.6;
/// |N.V| at the rim is less: normals more than 70 degrees from the eye.
const RIM: f32 = 0.342;
/// |N.V| of what faces the camera is greater: normals within 30 degrees.
const FACING: f32 = 0.866;
/// The light has sides where the diffuse light of the third that has most of it is this many times that of the third
/// that has least.
const SIDED: f32 = 1.25;
/// Highlights are the tenth of the pixels that mirrors the most light, where that is this many times the median's.
const BRIGHT: f32 = 2.0;

/// What a fit gets wrong as a whole, and where.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Misfit {
    /// The share of the variance of the targets' radiance (over all compared pixels and channels) that the fit explains;
    /// none where there is no variance. It is below 0 where the targets' own mean would be nearer.
    pub explained: Option<f64>,
    /// The same in a word.
    #[serde(rename = "match")]
    pub matched: Option<Match>,
    /// The mean radiance of the targets.
    pub mean_radiance: f64,
    /// The least signed mean that is told.
    pub threshold: f64,
    /// Each place, the one first that adds the most to the squared error by its mean alone.
    pub places: Vec<PlaceMisfit>,
}

/// How well the fit matches the targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Match {
    /// It explains 99% of their variance or more.
    Close,
    /// 90% or more.
    Rough,
    /// 50% or more.
    Poor,
    /// Less.
    None,
}

impl Match {
    const fn of(explained: f64) -> Self {
        match explained {
            _ if explained >= 0.99 => Self::Close,
            _ if explained >= 0.9 => Self::Rough,
            _ if explained >= 0.5 => Self::Poor,
            _ => Self::None,
        }
    }

    /// In two words or three.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Close => "a close match",
            Self::Rough => "a rough match",
            Self::Poor => "a poor match",
            Self::None => "no match",
        }
    }
}

/// The misfit of a place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaceMisfit {
    /// `in creases`, `at the rim`, `in view front`.
    pub place: String,
    /// The mean residual: positive where the fit is too bright.
    pub mean: f64,
    /// One standard error of it; none where there are too few blocks of pixels.
    pub std_error: Option<f64>,
    /// It as a share of the mean radiance that the targets have there; none where they are next to black.
    pub relative: Option<f64>,
    /// Share of the compared pixels.
    pub pixels: f64,
    /// Share of the squared error.
    pub squared_error: f64,
    /// Whether it is told.
    pub told: bool,
    /// Share of the squared error that the mean alone makes.
    #[serde(skip)]
    systematic: f64,
}

impl PlaceMisfit {
    /// `too dark in creases by 12%`.
    #[must_use]
    pub fn words(&self) -> String {
        let side = if self.mean < 0.0 { "dark" } else { "bright" };
        let by = self.relative.map_or_else(
            || format!("a radiance of {}", number(self.mean.abs(), 2)),
            |relative| percent(relative.abs()),
        );
        format!("too {side} {} by {by}", self.place)
    }

    /// The same with what of the pixels and of the squared error the place has.
    #[must_use]
    pub fn sentence(&self) -> String {
        let radiance = number(self.mean.abs(), 2);
        let (pixels, squares) = (percent(self.pixels), percent(self.squared_error));
        format!(
            "{} (mean radiance off by {radiance}; {pixels} of the pixels, {squares} of the squared error)",
            self.words()
        )
    }
}

impl Misfit {
    /// Of the views' targets and fits; images of one view are of one size.
    #[must_use]
    pub fn of(views: &[ViewEvidence]) -> Self {
        let bounds = Bounds::of(views);
        let names = if views.len() > 1 { views.len() } else { 0 };
        let places = [Place::Everywhere, Place::Creases, Place::Rim, Place::Facing]
            .into_iter()
            .chain([Place::LightSide, Place::ShadowSide, Place::Highlights])
            .chain((0..names).map(Place::View))
            .chain((0..3).map(Place::Channel));
        let blocks = Blocks::of(views);
        let mut sums: Vec<(Place, Sums)> = places.map(|place| (place, Sums::over(&blocks))).collect();
        let (mut count, mut target_sum, mut target_squares) = (0.0, [0.0; 3], [0.0; 3]);
        for (index, view) in views.iter().enumerate() {
            for at in 0..view.fit.rgb.len() {
                let Some((residual, target)) = residual(view, at) else { continue };
                count += 1.0;
                for c in 0..3 {
                    target_sum[c] += target[c];
                    target_squares[c] += target[c] * target[c];
                }
                let block = blocks.at(index, view, at);
                for (place, sums) in
                    sums.iter_mut().filter(|(place, _)| place.holds(&bounds, index, view, at))
                {
                    sums.add(place.channels(), block, residual, target);
                }
            }
        }
        if count == 0.0 {
            return Self::default();
        }
        // The first place is everywhere.
        let total: f64 = sums.first().map_or(0.0, |(_, sums)| sums.squares);
        let mean_radiance = target_sum.iter().sum::<f64>() / (3.0 * count);
        let squares: f64 = target_squares.iter().sum();
        let variance = squares - target_sum.iter().map(|sum| sum * sum / count).sum::<f64>();
        // Of a flat target nothing but the rounding of the sums is left.
        let explained = (variance > 1e-12 * squares).then(|| 1.0 - total / variance);
        let threshold = LEAST * mean_radiance.abs().max(DARK);
        let seen = sums.into_iter().filter(|(_, sums)| sums.pixels > 0.0);
        let told = |(place, sums): (Place, Sums)| {
            let std_error = sums.std_error(&blocks);
            sums.told((place, place.words(views)), std_error, [count, total, threshold])
        };
        let mut places: Vec<PlaceMisfit> = seen.map(told).collect();
        places.sort_by(|a, b| b.systematic.total_cmp(&a.systematic));
        Self { explained, matched: explained.map(Match::of), mean_radiance, threshold, places }
    }

    /// The places that are told, the largest misfit first.
    pub fn told(&self) -> impl Iterator<Item = &PlaceMisfit> {
        self.places.iter().filter(|place| place.told).take(MOST)
    }

    /// How much the model explains, in a sentence without its end; none where there is nothing to explain.
    #[must_use]
    pub fn explained_in_words(&self) -> Option<String> {
        let (explained, matched) = (self.explained?, self.matched?);
        let share = match explained {
            _ if explained <= 0.0 => "none".to_owned(),
            _ if explained > 0.999 => "more than 99.9%".to_owned(),
            _ => format!("{:.1}%", 100.0 * explained),
        };
        Some(format!("the model explains {share} of the targets' variance: {}", matched.words()))
    }

    /// The largest misfit, in a sentence without its end; none where nothing was compared.
    #[must_use]
    pub fn largest_in_words(&self) -> Option<String> {
        match self.told().next() {
            Some(place) => Some(format!("largest misfit: {}", place.words())),
            None if self.places.is_empty() => None,
            None => Some("no place is too bright or too dark on average".to_owned()),
        }
    }
}

/// Residual and target of a pixel in linear radiance; none where it is not compared. Beyond where an 8-bit target is
/// clipped, nothing is known to be wrong.
pub(super) fn residual(view: &ViewEvidence, at: usize) -> Option<([f64; 3], [f64; 3])> {
    if view.coverage[at] < COVERED {
        return None;
    }
    let (fit, target) = (view.fit.rgb[at].map(f64::from), view.target.rgb[at].map(f64::from));
    let channel = |c: usize| {
        let (fit, target) = (fit[c], target[c]);
        let beyond = view.clip.is_some_and(|clip| {
            (target >= f64::from(clip.high) && fit >= target)
                || (target <= f64::from(clip.low) && fit <= target)
        });
        if beyond { 0.0 } else { fit - target }
    };
    let residual = [0, 1, 2].map(channel);
    residual.iter().chain(&target).all(|x| x.is_finite()).then_some((residual, target))
}

pub(super) fn mean(rgb: [f64; 3]) -> f64 {
    rgb.iter().sum::<f64>() / 3.0
}

/// Where residuals lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Everywhere,
    Creases,
    Rim,
    Facing,
    LightSide,
    ShadowSide,
    Highlights,
    /// The view of that number.
    View(usize),
    /// The channel of that number, everywhere.
    Channel(usize),
}

impl Place {
    /// Whether a pixel of view `index` is there.
    fn holds(self, bounds: &Bounds, index: usize, view: &ViewEvidence, at: usize) -> bool {
        let below = |plane: &[f32], most: f32| plane.get(at).is_some_and(|&x| x < most);
        let above = |plane: &[f32], least: f32| plane.get(at).is_some_and(|&x| x > least);
        let places = &view.places;
        match self {
            Self::Everywhere | Self::Channel(_) => true,
            Self::View(own) => own == index,
            Self::Creases => below(&places.open, CREASED),
            Self::Rim => below(&places.facing, RIM),
            Self::Facing => above(&places.facing, FACING),
            Self::ShadowSide => bounds.sides.is_some_and(|[shadow, _]| below(&places.lit, shadow)),
            Self::LightSide => bounds.sides.is_some_and(|[_, light]| above(&places.lit, light)),
            Self::Highlights => bounds.bright.is_some_and(|bright| above(&places.mirrored, bright)),
        }
    }

    fn channels(self) -> Range<usize> {
        match self {
            Self::Channel(c) => c..c + 1,
            _ => 0..3,
        }
    }

    fn words(self, views: &[ViewEvidence]) -> String {
        match self {
            Self::Everywhere => "overall".to_owned(),
            Self::Creases => "in creases".to_owned(),
            Self::Rim => "at the rim".to_owned(),
            Self::Facing => "where it faces the camera".to_owned(),
            Self::LightSide => "on the light side".to_owned(),
            Self::ShadowSide => "on the shadow side".to_owned(),
            Self::Highlights => "in highlights".to_owned(),
            Self::View(index) => format!("in view {}", views[index].name),
            Self::Channel(c) => format!("in {}", ["red", "green", "blue"][c]),
        }
    }
}

/// Where sides and highlights begin, over all views.
#[derive(Debug)]
struct Bounds {
    /// Diffuse light that the third has at most that has least of it, and at least the third that has most.
    sides: Option<[f32; 2]>,
    /// The least mirrored light of a highlight.
    bright: Option<f32>,
}

impl Bounds {
    fn of(views: &[ViewEvidence]) -> Self {
        let sorted = |plane: fn(&ViewEvidence) -> &[f32]| -> Vec<f32> {
            let compared = views.iter().flat_map(|view| plane(view).iter().zip(&view.coverage));
            let mut values: Vec<f32> =
                compared.filter(|(x, c)| **c >= COVERED && x.is_finite()).map(|(x, _)| *x).collect();
            values.sort_unstable_by(f32::total_cmp);
            values
        };
        // The number that `share` of the sorted ones lie below.
        let quantile =
            |sorted: &[f32], share: f64| sorted.get((share * sorted.len() as f64) as usize).copied();
        let lit = sorted(|view| &view.places.lit);
        let sides = quantile(&lit, 1.0 / 3.0).zip(quantile(&lit, 2.0 / 3.0));
        let mirrored = sorted(|view| &view.places.mirrored);
        let bright = quantile(&mirrored, 0.9).zip(quantile(&mirrored, 0.5));
        Self {
            sides: sides
                .filter(|(shadow, light)| *light >= SIDED * shadow)
                .map(|(shadow, light)| [shadow, light]),
            bright: bright.filter(|(bright, median)| *bright >= BRIGHT * median).map(|(bright, _)| bright),
        }
    }
}

/// The smallest blocks of pixels of all views: view, column and row of each.
struct Blocks {
    keys: Vec<[usize; 3]>,
    /// The first block of each view.
    first: Vec<usize>,
}

impl Blocks {
    fn of(views: &[ViewEvidence]) -> Self {
        let (mut keys, mut first) = (Vec::new(), Vec::new());
        for (index, view) in views.iter().enumerate() {
            first.push(keys.len());
            let [columns, rows] = [view.fit.width, view.fit.height].map(|side| side.div_ceil(BLOCK));
            keys.extend((0..rows).flat_map(|row| (0..columns).map(move |column| [index, column, row])));
        }
        Self { keys, first }
    }

    /// The block of a pixel.
    fn at(&self, index: usize, view: &ViewEvidence, at: usize) -> usize {
        let width = view.fit.width;
        self.first[index] + at / width / BLOCK * width.div_ceil(BLOCK) + at % width / BLOCK
    }
}

/// Sums over the pixels of a place.
#[derive(Debug)]
struct Sums {
    pixels: f64,
    residual: f64,
    target: f64,
    squares: f64,
    /// Pixels and the sum of their residuals, by block.
    blocks: Vec<[f64; 2]>,
}

impl Sums {
    fn over(blocks: &Blocks) -> Self {
        Self {
            pixels: 0.0,
            residual: 0.0,
            target: 0.0,
            squares: 0.0,
            blocks: vec![[0.0; 2]; blocks.keys.len()],
        }
    }

    fn add(&mut self, channels: Range<usize>, block: usize, residual: [f64; 3], target: [f64; 3]) {
        let of = |rgb: [f64; 3]| rgb[channels.clone()].iter().sum::<f64>() / channels.len() as f64;
        let own = of(residual);
        self.pixels += 1.0;
        self.residual += own;
        self.target += of(target);
        self.squares += residual[channels.clone()].iter().map(|r| r * r).sum::<f64>();
        let [pixels, sum] = &mut self.blocks[block];
        (*pixels, *sum) = (*pixels + 1.0, *sum + own);
    }

    fn mean(&self) -> f64 {
        self.residual / self.pixels
    }

    /// Of `count` pixels with a squared error of `total`.
    fn told(
        &self,
        (place, words): (Place, String),
        std_error: Option<f64>,
        [count, total, threshold]: [f64; 3],
    ) -> PlaceMisfit {
        let (mean, target) = (self.mean(), self.target / self.pixels);
        let share = |squares: f64| if total > 0.0 { squares / total } else { 0.0 };
        let pixels = self.pixels / count;
        let significant = std_error.is_some_and(|error| mean.abs() >= SIGMAS * error);
        PlaceMisfit {
            place: words,
            mean,
            std_error,
            // A share of next to black says nothing: of less than a twentieth of the mean radiance.
            relative: (target > 5.0 * threshold).then(|| mean / target),
            pixels,
            squared_error: share(self.squares),
            told: mean != 0.0 && mean.abs() >= threshold && significant && pixels >= LEAST_PIXELS,
            systematic: share(self.pixels * place.channels().len() as f64 * mean * mean),
        }
    }

    /// The standard error of the mean, from the sums over blocks.
    fn std_error(&self, blocks: &Blocks) -> Option<f64> {
        let there = blocks.keys.iter().zip(&self.blocks).filter(|(_, [pixels, _])| *pixels > 0.0);
        let mut sums: BTreeMap<[usize; 3], [f64; 2]> = there.map(|(key, sums)| (*key, *sums)).collect();
        let (mean, mut greatest) = (self.mean(), None);
        while sums.len() >= if greatest.is_none() { FEWEST_BLOCKS } else { BLOCKS } {
            let count = sums.len() as f64;
            // A block's sum beside what the mean makes of its pixels.
            let squares: f64 = sums.values().map(|[pixels, sum]| (sum - mean * pixels).powi(2)).sum();
            let error = (count / (count - 1.0) * squares).sqrt() / self.pixels;
            greatest = Some(greatest.map_or(error, |before: f64| before.max(error)));
            let mut greater = BTreeMap::new();
            for ([view, column, row], [pixels, sum]) in &sums {
                let own: &mut [f64; 2] = greater.entry([*view, column / 2, row / 2]).or_default();
                *own = [own[0] + pixels, own[1] + sum];
            }
            // No two of one view are left.
            if greater.len() == sums.len() {
                break;
            }
            sums = greater;
        }
        greatest
    }
}

/// A share in percent.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent >= 9.95 { format!("{percent:.0}%") } else { format!("{percent:.1}%") }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::render::files::Image;
    use crate::render::places::Places;
    use crate::scene::view::Clip;

    /// Even pseudo-random numbers in [-1, 1] (Marsaglia's xorshift).
    pub(crate) fn noise(seed: u32) -> impl FnMut() -> f32 {
        let mut state = seed.max(1);
        move || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            (f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0) as f32
        }
    }

    const SIDE: usize = 128;

    /// A fully covered view with light from above, folds in a disc of a fourteenth of its pixels, and a rim at its
    /// left edge; `fit` tells the fit's radiance of a channel from the target's, by index and channel.
    pub(crate) fn view(mut fit: impl FnMut(usize, usize, f32) -> f32) -> ViewEvidence {
        let (mut target, mut fitted) = (Image::new(SIDE, SIDE), Image::new(SIDE, SIDE));
        let mut places = Places {
            open: vec![0.9; SIDE * SIDE],
            facing: vec![0.6; SIDE * SIDE],
            lit: vec![0.0; SIDE * SIDE],
            mirrored: Vec::new(),
        };
        for at in 0..SIDE * SIDE {
            let (x, y) = (at % SIDE, at / SIDE);
            let light = 0.2 + 0.6 * (SIDE - y) as f32 / SIDE as f32;
            target.rgb[at] = [0.9, 0.6, 0.5].map(|c| c * light * (1.0 + 0.2 * (0.7 * x as f32).sin()));
            fitted.rgb[at] = [0, 1, 2].map(|c| fit(at, c, target.rgb[at][c]));
            (places.lit[at], target.alpha[at], fitted.alpha[at]) = (light, 1.0, 1.0);
            if (x as f32 - 64.0).hypot(y as f32 - 64.0) < 19.0 {
                places.open[at] = 0.4;
            }
            if x < 4 {
                places.facing[at] = 0.2;
            }
        }
        ViewEvidence {
            name: "front".to_owned(),
            target,
            coverage: vec![1.0; SIDE * SIDE],
            fit: fitted,
            terms: Vec::new(),
            haze: Vec::new(),
            places,
            clip: None,
            held_out: false,
        }
    }

    fn in_disc(at: usize) -> bool {
        ((at % SIDE) as f32 - 64.0).hypot((at / SIDE) as f32 - 64.0) < 19.0
    }

    #[test]
    fn a_place_that_is_off_by_a_known_share_is_told_by_it() {
        let mut noise = noise(7);
        let misfit = Misfit::of(&[view(|at, _, target| {
            let share = if in_disc(at) { 0.88 } else { 1.0 };
            target * (share + 0.02 * noise())
        })]);
        let told: Vec<String> = misfit.told().map(PlaceMisfit::words).collect();
        // Elsewhere the mean is off by a fourteenth of this at most: less than 1% of the mean radiance.
        assert_eq!(told, ["too dark in creases by 12%"]);
        let creases = misfit.told().next().unwrap();
        // A disc of 1125 pixels of 16384, each off by 0.12 of what it is; noise adds 0.02^2 / 3 everywhere.
        assert!((creases.pixels - 0.069).abs() < 1e-3, "{creases:?}");
        let own = 0.12 * 0.12 + 0.02 * 0.02 / 3.0;
        let rest = (1.0 - creases.pixels) * 0.02 * 0.02 / 3.0;
        let share = creases.pixels * own / (creases.pixels * own + rest);
        // The target is about as bright in the disc as beside it; its square is not, by a tenth or so.
        assert!((creases.squared_error - share).abs() < 0.03, "{} {share}", creases.squared_error);
        assert!(
            creases.sentence().ends_with("6.9% of the pixels, 88% of the squared error)"),
            "{}",
            creases.sentence()
        );
        assert_eq!(misfit.largest_in_words().as_deref(), Some("largest misfit: too dark in creases by 12%"));
    }

    #[test]
    fn symmetric_noise_says_nothing() {
        for seed in 1..20 {
            let mut noise = noise(seed);
            let misfit = Misfit::of(&[view(|_, _, target| target * (1.0 + 0.3 * noise()))]);
            assert_eq!(misfit.told().count(), 0, "{seed}: {:?}", misfit.told().collect::<Vec<_>>());
            let words = misfit.largest_in_words().unwrap();
            assert_eq!(words, "no place is too bright or too dark on average");
        }
    }

    #[test]
    fn neighbours_that_err_alike_are_few_witnesses() {
        // Patches of 32 pixels, off by 30% to either side in turns.
        let patch = |at: usize| at / SIDE / 32 + at % SIDE / 32;
        let share = |at: usize| if patch(at) % 2 == 0 { 0.7 } else { 1.3 };
        let misfit = Misfit::of(&[view(|at, _, target| target * share(at))]);
        let overall = misfit.places.iter().find(|place| place.place == "overall").unwrap();
        // Independent pixels would have 0.3 of the mean radiance of 0.34 over the root of 16384; the blocks of 16 pixels,
        // of which there are 64, have sixteen times that.
        assert!(overall.std_error.unwrap() > 10.0 * 0.3 * 0.34 / 128.0, "{overall:?}");
        assert!(!overall.told);
    }

    #[test]
    fn next_to_black_the_radiance_is_told_and_what_is_not_known_is_not() {
        let mut view = view(|at, _, target| if at % SIDE < 4 { 0.05 } else { target });
        (0..SIDE * SIDE).filter(|at| at % SIDE < 4).for_each(|at| view.target.rgb[at] = [0.0; 3]);
        (view.places.open, view.places.lit) = (Vec::new(), Vec::new());
        let misfit = Misfit::of(&[view]);
        let told: Vec<String> = misfit.told().map(PlaceMisfit::words).collect();
        assert_eq!(told[0], "too bright at the rim by a radiance of 0.050");
        let names: Vec<&str> = misfit.places.iter().map(|place| place.place.as_str()).collect();
        for missing in
            ["in creases", "on the light side", "on the shadow side", "in highlights", "in view front"]
        {
            assert!(!names.contains(&missing), "{names:?}");
        }
    }

    #[test]
    fn a_view_and_a_channel_that_are_off_are_told() {
        let named = |name: &str, view: ViewEvidence| ViewEvidence { name: name.to_owned(), ..view };
        let left = named("left", view(|_, c, target| if c == 2 { 1.4 * target } else { target }));
        let misfit = Misfit::of(&[view(|_, _, target| target), left]);
        let told: Vec<String> = misfit.told().map(PlaceMisfit::words).collect();
        assert!(told.contains(&"too bright in blue by 20%".to_owned()), "{told:?}");
        // A quarter of the light is blue: 0.5 of 2.0.
        assert!(told.contains(&"too bright in view left by 10%".to_owned()), "{told:?}");
        let all: f64 =
            misfit.places.iter().filter(|p| p.place.starts_with("in view")).map(|p| p.squared_error).sum();
        assert!((all - 1.0).abs() < 1e-12, "{all}");
    }

    #[test]
    fn how_much_is_explained_has_a_word() {
        let mean = {
            let view = view(|_, _, target| target);
            let sum = |c: usize| view.target.rgb.iter().map(|rgb| f64::from(rgb[c])).sum::<f64>();
            [0, 1, 2].map(|c| (sum(c) / (SIDE * SIDE) as f64) as f32)
        };
        // Residuals that are a share of what the target differs from its mean leave the square of it unexplained.
        for (share, matched, words) in [
            (0.0, Match::Close, "more than 99.9%"),
            (0.2, Match::Rough, "96.0%"),
            (0.5, Match::Poor, "75.0%"),
            (0.9, Match::None, "19.0%"),
            (1.5, Match::None, "none"),
        ] {
            let misfit = Misfit::of(&[view(|_, c, target| target + share * (mean[c] - target))]);
            assert_eq!(misfit.matched, Some(matched), "{share}");
            let told = misfit.explained_in_words().unwrap();
            assert!(told.starts_with(&format!("the model explains {words} of")), "{told}");
        }
    }

    #[test]
    fn nothing_is_wrong_beyond_a_clip_and_nothing_is_said_of_nothing() {
        let mut bright = view(|_, _, target| 2.0 * target);
        bright.clip = Some(Clip { low: 0.0, high: 0.0 });
        assert_eq!(Misfit::of(&[bright]).told().count(), 0);
        let mut unseen = view(|_, _, _| f32::NAN);
        let (odd, none) = (Misfit::of(std::slice::from_ref(&unseen)), Misfit::of(&[]));
        assert_eq!((&odd, &none), (&Misfit::default(), &Misfit::default()));
        unseen.coverage.fill(0.5);
        assert_eq!(Misfit::of(&[unseen]).largest_in_words(), None);
        // Without variance nothing can be explained.
        let mut flat = view(|_, _, _| 0.5);
        flat.target.rgb.fill([0.5; 3]);
        let flat = Misfit::of(&[flat]);
        assert_eq!((flat.explained, flat.explained_in_words()), (None, None));
        assert!(flat.largest_in_words().is_some());
    }
}

//! What a drawn image and a target differ by: in coverage, and in colour where both are covered wholly.
//!
//! The constants are not fitted yet, so that colours are compared but for a factor on each of the model's terms and a
//! constant, in each channel, which are the best for that image. Each kind of difference weighs by how large it is where
//! nothing moves it any more.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::image::Picture;

/// Covered by more is covered wholly; of less, what shows is of the border.
const WHOLE: f32 = 0.999;
/// Least root mean squares by which differences are weighed: a coverage of 16 samples is off by so much at a border, and
/// so are colours of what is hardly textured.
const LEAST: f64 = 0.02;
/// Colours that differ do so over whole regions: of each kind's weight the colours' is lessened by this, as so many
/// pixels side by side say the same.
const ALIKE: f64 = 0.25;

/// Pixels whose colours are compared, at the least, for each factor that is the best for them.
const ENOUGH: usize = 8;

/// Weights of the two kinds of differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weights {
    cover: f64,
    color: f64,
}

/// The differences of an image and a target; 0 where nothing is compared.
#[derive(Clone, Debug)]
pub(super) struct Residual {
    /// Of the coverage of each pixel.
    cover: Vec<f64>,
    /// Of the colours of each pixel, and whether they are compared.
    color: Vec<Option<[f64; 3]>>,
}

impl Residual {
    pub(super) fn new(drawn: &Picture, target: &Picture) -> Self {
        let weight = |i: usize| f64::from(target.mask.get(i).copied().unwrap_or(1.0));
        let covered = |picture: &Picture, i: usize| picture.alpha.as_ref().map_or(1.0, |alpha| alpha[i]);
        let count = target.rgb.len();
        let cover = match &target.alpha {
            Some(alpha) => {
                let difference = |i: usize| weight(i) * f64::from(covered(drawn, i) - alpha[i]);
                (0..count).map(difference).collect()
            }
            None => vec![0.0; count],
        };
        let skin = |i: usize| drawn.plain.get(i).is_none_or(|share| *share == 0.0);
        let both =
            |i: usize| skin(i) && weight(i) >= 1.0 && covered(drawn, i) > WHOLE && covered(target, i) > WHOLE;
        let mut compared: Vec<bool> = (0..count).map(both).collect();
        // A mixture lies through any few pixels.
        if compared.iter().filter(|&&both| both).count() < ENOUGH * (drawn.terms.len() + 1) {
            compared.fill(false);
        }
        let fitted = [0, 1, 2].map(|c| Mixture::nearest(drawn, target, &compared, c));
        let color = |i: usize| {
            let difference = |c: usize| fitted[c].difference(drawn, i, c, f64::from(target.rgb[i][c]));
            compared[i].then(|| std::array::from_fn(difference))
        };
        Self { cover, color: (0..count).map(color).collect() }
    }

    /// The weights by which these differences are as large as each other.
    pub(super) fn weights(&self) -> Weights {
        let edges = self.cover.iter().filter(|d| **d != 0.0);
        let (sum, count) = edges.fold((0.0, 0.0), |(sum, count), d| (sum + d * d, count + 1.0));
        let cover = (sum / f64::max(count, 1.0)).sqrt().max(LEAST).recip();
        let colors = self.color.iter().flatten().flatten();
        let (sum, count) = colors.fold((0.0, 0.0), |(sum, count), d| (sum + d * d, count + 1.0));
        let color = ALIKE * (sum / f64::max(count, 1.0)).sqrt().max(LEAST).recip();
        Weights { cover, color }
    }

    /// Half the weighted sum of squares, of which colours count as that `share` of the pixels: to look away from some
    /// brings nothing.
    pub(super) fn loss(&self, weights: Weights, share: f64) -> f64 {
        let cover: f64 = self.cover.iter().map(|d| d * d).sum();
        let colors = self.color.iter().flatten();
        let (sum, count) = colors
            .fold((0.0, 0.0), |(sum, count), d| (sum + d.iter().map(|x| x * x).sum::<f64>(), count + 1.0));
        let pixels = self.color.len() as f64;
        // Where none is left to compare, each channel is as far off as its standard deviation.
        let mean = if count > 0.0 { sum / count } else { 3.0 };
        0.5 * (weights.cover.powi(2) * cover / pixels + weights.color.powi(2) * mean * share)
    }

    /// The share of pixels whose colours are compared.
    pub(super) fn share(&self) -> f64 {
        self.color.iter().flatten().count() as f64 / self.color.len().max(1) as f64
    }

    /// The weighted differences, one after the other: of coverage, then of colours, with 0 where they are not compared.
    pub(super) fn weighted(&self, weights: Weights) -> impl Iterator<Item = [f64; 4]> + '_ {
        self.cover.iter().zip(&self.color).map(move |(cover, color)| {
            let [r, g, b] = color.unwrap_or_default();
            [weights.cover * cover, weights.color * r, weights.color * g, weights.color * b]
        })
    }

    /// Half the difference of two others, where both are compared: how this one changes a step.
    pub(super) fn slope(ahead: &Self, behind: &Self, step: f64) -> Self {
        let cover = ahead.cover.iter().zip(&behind.cover).map(|(a, b)| (a - b) / (2.0 * step)).collect();
        let color = ahead.color.iter().zip(&behind.color).map(|(a, b)| match (a, b) {
            (Some(a), Some(b)) => Some(std::array::from_fn(|c| (a[c] - b[c]) / (2.0 * step))),
            _ => None,
        });
        Self { cover, color: color.collect() }
    }
}

/// Pixels whose products are added up at a time.
const CHUNK: usize = 4096;
/// How firmly factors of terms are held to one for all of them, as a share of what images say of each: terms that look alike
/// are not told apart by noise.
const HELD: f64 = 1e-3;

/// The factors on terms, and the constant, that take a channel's drawn values nearest to the target's; differences are in
/// standard deviations of the target's.
#[derive(Clone, Debug, Default)]
struct Mixture {
    factors: Vec<f64>,
    constant: f64,
    /// One over the target's standard deviation; 0 where it has none.
    scale: f64,
}

impl Mixture {
    fn nearest(drawn: &Picture, target: &Picture, compared: &[bool], channel: usize) -> Self {
        let terms = drawn.terms.len();
        // Each term, the target, and 1.
        let width = terms + 2;
        let row = |i: usize, row: &mut Vec<f64>| {
            row.clear();
            row.extend(drawn.terms.iter().map(|term| f64::from(term[i][channel])));
            row.extend([f64::from(target.rgb[i][channel]), 1.0]);
        };
        let sums = |first: usize| {
            let mut sums = DMatrix::<f64>::zeros(width, width);
            let mut numbers = Vec::with_capacity(width);
            for i in (first..compared.len().min(first + CHUNK)).filter(|&i| compared[i]) {
                row(i, &mut numbers);
                for a in 0..width {
                    for b in a..width {
                        sums[(a, b)] += numbers[a] * numbers[b];
                    }
                }
            }
            sums
        };
        let firsts: Vec<usize> = (0..compared.len()).step_by(CHUNK).collect();
        // In order, so that they are the same for any number of threads.
        let parts: Vec<DMatrix<f64>> = firsts.into_par_iter().map(sums).collect();
        let sums = parts.into_iter().fold(DMatrix::zeros(width, width), |all, part| all + part);
        let count = sums[(width - 1, width - 1)];
        if count == 0.0 {
            return Self { factors: vec![0.0; terms], ..Self::default() };
        }
        let mean = |k: usize| sums[(k, width - 1)] / count;
        let covariance = |a: usize, b: usize| sums[(a.min(b), a.max(b))] / count - mean(a) * mean(b);
        let between = DMatrix::from_fn(terms, terms, covariance);
        let towards = DVector::from_fn(terms, |k, _| covariance(k, terms));
        let factors = factors(&between, &towards);
        let constant = mean(terms) - (0..terms).map(|k| factors[k] * mean(k)).sum::<f64>();
        let deviation = covariance(terms, terms).max(0.0).sqrt();
        let scale = if deviation > 0.0 { deviation.recip() } else { 0.0 };
        Self { factors, constant, scale }
    }

    fn difference(&self, drawn: &Picture, i: usize, channel: usize, target: f64) -> f64 {
        let terms = drawn.terms.iter().zip(&self.factors);
        let shown: f64 = terms.map(|(term, factor)| factor * f64::from(term[i][channel])).sum();
        self.scale * (shown + self.constant - target)
    }
}

/// The factors of terms, none below 0, that come nearest by these covariances of terms with each other and with the target.
/// Colours that go the other way are not the same surface's.
fn factors(between: &DMatrix<f64>, towards: &DVector<f64>) -> Vec<f64> {
    let mut factors = vec![0.0; towards.len()];
    let mut kept: Vec<usize> = (0..towards.len()).collect();
    while !kept.is_empty() {
        let own = between.select_rows(&kept).select_columns(&kept);
        let wanted = towards.select_rows(&kept);
        let alike = if own.sum() > 0.0 { (wanted.sum() / own.sum()).max(0.0) } else { 0.0 };
        let alike = DVector::from_element(kept.len(), alike);
        let mut held = own.clone();
        for k in 0..kept.len() {
            held[(k, k)] += HELD * own[(k, k)] + 1e-9 * own.trace() + f64::MIN_POSITIVE;
        }
        let apart = held.cholesky().map(|held| held.solve(&(&wanted - &own * &alike)));
        let found = apart.map_or_else(|| alike.clone(), |apart| &alike + apart);
        let found = if found.iter().all(|x| x.is_finite()) { found } else { alike };
        let (least, value) = found.argmin();
        if value >= 0.0 {
            kept.iter().zip(&found).for_each(|(&k, &factor)| factors[k] = factor);
            break;
        }
        kept.remove(least);
    }
    factors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_other_constants_do_not_differ() {
        let count = 400;
        let plane =
            |f: &dyn Fn(usize) -> f32| (0..count).map(|i| [f(i), 2.0 * f(i), 0.0]).collect::<Vec<_>>();
        let terms =
            vec![plane(&|i| (i as f32 * 0.37).sin() + 1.5), plane(&|i| (i as f32 * 0.11).cos() + 1.1)];
        let mixed = |weights: [f32; 2], constant: f32| -> Vec<[f32; 3]> {
            let at =
                |i: usize, c: usize| weights[0] * terms[0][i][c] + weights[1] * terms[1][i][c] + constant;
            (0..count).map(|i| [0, 1, 2].map(|c| at(i, c))).collect()
        };
        let picture = |rgb, terms| Picture {
            width: count,
            height: 1,
            rgb,
            terms,
            alpha: Some(vec![1.0; count]),
            mask: Vec::new(),
            plain: Vec::new(),
        };
        let drawn = picture(mixed([1.0, 1.0], 0.0), terms.clone());
        let worst = |target: &Picture| {
            let residual = Residual::new(&drawn, target);
            assert_eq!(residual.share(), 1.0);
            residual.color.iter().flatten().flatten().fold(0.0_f64, |most, x| most.max(x.abs()))
        };
        // Factors are held to one another by a thousandth of what images say.
        assert!(worst(&picture(mixed([0.7, 1.4], 0.2), Vec::new())) < 3e-3);
        // A third pattern is none of the terms'.
        let mut other = mixed([0.7, 1.4], 0.2);
        other.iter_mut().enumerate().for_each(|(i, rgb)| rgb[0] += (i as f32 * 0.9).sin());
        assert!(worst(&picture(other, Vec::new())) > 0.5);
        // Nor is what goes the other way: no factor makes it one of theirs.
        let away: Vec<[f32; 3]> = drawn.rgb.iter().map(|rgb| rgb.map(|x| 9.0 - x)).collect();
        assert!(worst(&picture(away, Vec::new())) > 1.0);
    }

    #[test]
    fn few_pixels_say_nothing_of_colours() {
        let picture = |count: usize, terms: usize| Picture {
            width: count,
            height: 1,
            rgb: (0..count).map(|i| [(i as f32).sin() + 2.0; 3]).collect(),
            terms: (1..=terms)
                .map(|k| (0..count).map(|i| [(k as f32 * i as f32).cos() + 2.0; 3]).collect())
                .collect(),
            alpha: Some(vec![1.0; count]),
            mask: Vec::new(),
            plain: Vec::new(),
        };
        let loss = |count: usize| {
            let residual = Residual::new(&picture(count, 6), &picture(count, 0));
            residual.loss(Weights { cover: 1.0, color: 1.0 }, 1.0)
        };
        // Three channels, each as far off as its standard deviation.
        assert_eq!(loss(20), 1.5);
        assert!(loss(400) > 0.0 && loss(400) < 1.5);
    }
}

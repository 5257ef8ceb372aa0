//! What a drawn image and a target differ by: in coverage, and in colour where both are covered wholly.
//!
//! The constants are not fitted yet, so that colours are compared but for a weight of each term's and a constant a channel,
//! which are the best for that image: of most terms the constants are such weights. What the model's light is off by still
//! pulls at a camera: over whole regions it is what a turn would change. So at last the mean around each pixel is left out,
//! and what is finer tells: texture, and creases.
//! Each kind of difference weighs by how large it is where nothing moves it any more.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::image::Picture;
use crate::fit::bounded;
use crate::fit::room::Room;

/// Covered by more is covered wholly; of less, what shows is of the border.
const WHOLE: f32 = 0.999;
/// Least root mean squares by which differences are weighed: a coverage of 16 samples is off by so much at a border, and
/// so are colours of what is hardly textured.
const LEAST: f64 = 0.02;
/// Colours that differ do so over whole regions: of each kind's weight the colours' is lessened by this, because
/// many pixels side by side say the same.
const ALIKE: f64 = 0.25;

/// Pixels to each side over which the mean is left out: wider, it is the shading's mistakes that are compared, which a
/// turn would change, too.
const AROUND: usize = 2;

/// What of colours is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Colors {
    /// All, which shows the way from far off.
    Whole,
    /// What differs from the mean around it.
    Detail,
}

/// Weights of the two kinds of differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weights {
    cover: f64,
    color: f64,
}

/// The differences of an image and a target, or how they move; 0 where nothing is compared.
#[derive(Clone, Debug)]
pub(super) struct Differences {
    /// Of the coverage of each pixel.
    pub(super) cover: Vec<f64>,
    /// Of the colours of each pixel, and whether they are compared.
    pub(super) color: Vec<Option<[f64; 3]>>,
}

/// What a drawn image and a target differ by.
#[derive(Clone, Debug)]
pub(super) struct Residual {
    pub(super) differences: Differences,
    /// What takes each channel of the drawn layers to the target's.
    pub(super) fitted: Vec<Fitted>,
    pub(super) colors: Colors,
}

impl Residual {
    pub(super) fn new(drawn: &Picture, target: &Picture, colors: Colors) -> Self {
        let weight = |i: usize| target.weight(i);
        let covered = |picture: &Picture, i: usize| picture.alpha.as_ref().map_or(1.0, |alpha| alpha[i]);
        let count = target.width * target.height;
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
        let compared: Vec<bool> = (0..count).map(both).collect();
        let fitted: Vec<Fitted> =
            (0..3).into_par_iter().map(|c| Fitted::to(drawn, target, &compared, c)).collect();
        let color = |i: usize| {
            compared[i].then(|| std::array::from_fn(|c| fitted[c].difference(drawn, target, i, c)))
        };
        let color: Vec<Option<[f64; 3]>> = (0..count).into_par_iter().map(color).collect();
        Self { differences: Differences { cover, color: colors.of(color, target.width) }, fitted, colors }
    }
}

impl Differences {
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
}

impl Colors {
    /// What is compared of the colours of an image of this width.
    pub(super) fn of(self, color: Vec<Option<[f64; 3]>>, width: usize) -> Vec<Option<[f64; 3]>> {
        match self {
            Self::Whole => color,
            Self::Detail => detail(&color, width),
        }
    }
}

/// The colours of an image of this width less their means around them, of those that are compared.
fn detail(color: &[Option<[f64; 3]>], width: usize) -> Vec<Option<[f64; 3]>> {
    let counted = |color: &Option<[f64; 3]>| color.map_or([0.0; 4], |[r, g, b]| [r, g, b, 1.0]);
    let own: Vec<[f64; 4]> = color.iter().map(counted).collect();
    let add = |mut sum: [f64; 4], other: &[f64; 4]| {
        (0..4).for_each(|k| sum[k] += other[k]);
        sum
    };
    let near = |at: usize, most: usize| at.saturating_sub(AROUND)..(at + AROUND + 1).min(most);
    let along_row = |i: usize| {
        let (row, column) = (i / width * width, i % width);
        near(column, width).map(|x| &own[row + x]).fold([0.0; 4], add)
    };
    let rows: Vec<[f64; 4]> = (0..own.len()).map(along_row).collect();
    let height = own.len() / width.max(1);
    let less_mean = |(i, color): (usize, &Option<[f64; 3]>)| {
        color.map(|color| {
            let sum = near(i / width, height).map(|y| &rows[y * width + i % width]).fold([0.0; 4], add);
            std::array::from_fn(|c| color[c] - sum[c] / sum[3])
        })
    };
    color.iter().enumerate().map(less_mean).collect()
}

/// What takes a channel of the drawn layers nearest to the target's; differences are in standard deviations of the target's.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    /// What each layer counts, none less than nothing.
    weights: Vec<f64>,
    constant: f64,
    /// One over the target's standard deviation; 0 where it has none.
    pub(super) scale: f64,
}

impl Fitted {
    fn to(drawn: &Picture, target: &Picture, compared: &[bool], channel: usize) -> Self {
        let count = drawn.layers.len();
        // The target stands last.
        let columns: Vec<&[[f32; 3]]> =
            drawn.layers.iter().chain(&target.layers).map(Vec::as_slice).collect();
        let places = || (0..compared.len()).filter(|&i| compared[i]);
        let values = |i: usize| columns.iter().map(move |column| f64::from(column[i][channel]));
        let pixels = places().count().max(1) as f64;
        let mut means = DVector::<f64>::zeros(count + 1);
        for i in places() {
            means.iter_mut().zip(values(i)).for_each(|(mean, value)| *mean += value / pixels);
        }
        let mut covariance = DMatrix::<f64>::zeros(count + 1, count + 1);
        let mut off = vec![0.0; count + 1];
        for i in places() {
            off.iter_mut().zip(values(i)).zip(&means).for_each(|((off, value), mean)| *off = value - mean);
            for k in 0..=count {
                (0..=k).for_each(|j| covariance[(j, k)] += off[j] * off[k] / pixels);
            }
        }
        let weights = least_squares(&covariance);
        let made: f64 = weights.iter().zip(&means).map(|(weight, mean)| weight * mean).sum();
        let deviation = f64::sqrt(covariance[(count, count)]);
        let scale = if deviation > 0.0 { deviation.recip() } else { 0.0 };
        Self { weights, constant: means[count] - made, scale }
    }

    fn difference(&self, drawn: &Picture, target: &Picture, i: usize, channel: usize) -> f64 {
        let made = self.made(drawn, i, channel);
        self.scale * (made + self.constant - f64::from(target.layers[0][i][channel]))
    }

    /// What the layers make of a pixel, but for the constant.
    pub(super) fn made(&self, drawn: &Picture, i: usize, channel: usize) -> f64 {
        let layers = self.weights.iter().zip(&drawn.layers);
        layers.map(|(weight, layer)| weight * f64::from(layer[i][channel])).sum()
    }
}

/// The weights, none negative, by which all but the last are nearest to the last, by the upper half of their covariances:
/// colours that go the other way are not the same surface's. What cannot be told apart shares.
fn least_squares(covariance: &DMatrix<f64>) -> Vec<f64> {
    let count = covariance.ncols() - 1;
    if !covariance.iter().all(|x| x.is_finite()) {
        return vec![0.0; count];
    }
    let normal: Vec<f64> =
        (0..count).flat_map(|j| (0..count).map(move |k| covariance[(j.min(k), j.max(k))])).collect();
    let downhill: Vec<f64> = (0..count).map(|k| -covariance[(k, count)]).collect();
    bounded::minimise(&normal, &downhill, &Room::within(&vec![0.0; count], &vec![f64::INFINITY; count]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_least_squares_without_negative_ones() {
        let near = |found: &[f64], wanted: &[f64]| {
            // Roundings of small systems.
            found.len() == wanted.len() && found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        // Of two layers that are uncorrelated, their sum by 2 and 0.5; then by 2 and one that goes the other way.
        let covariance =
            |sign: f64| DMatrix::from_row_slice(3, 3, &[4.0, 0.0, 8.0, 0.0, 1.0, 0.5 * sign, 0.0, 0.0, 17.0]);
        assert!(near(&least_squares(&covariance(1.0)), &[2.0, 0.5]));
        assert!(near(&least_squares(&covariance(-1.0)), &[2.0, 0.0]));
        // Alike ones share; one that is the same everywhere counts nothing.
        let alike = DMatrix::from_row_slice(
            4,
            4,
            &[1.0, 1.0, 0.0, 3.0, 0.0, 1.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 9.0],
        );
        assert!(near(&least_squares(&alike), &[1.5, 1.5, 0.0]));
        assert_eq!(least_squares(&DMatrix::zeros(2, 2)), [0.0]);
        assert_eq!(least_squares(&DMatrix::from_element(2, 2, f64::NAN)), [0.0]);
    }

    #[test]
    fn terms_that_count_otherwise_leave_no_difference() {
        let layer = |seed: usize| -> Vec<[f32; 3]> {
            (0..64).map(|i| [0, 1, 2].map(|c| ((i * (7 + seed) + 5 * c) % (11 + 2 * seed)) as f32)).collect()
        };
        let layers = vec![layer(0), layer(1)];
        let target = (0..64)
            .map(|i| std::array::from_fn(|c| 0.5 * layers[0][i][c] + 3.0 * layers[1][i][c] + 0.25))
            .collect();
        let picture = |layers| Picture {
            width: 8,
            height: 8,
            layers,
            alpha: Some(vec![1.0; 64]),
            mask: Vec::new(),
            plain: Vec::new(),
        };
        let residual = Residual::new(&picture(layers), &picture(vec![target]), Colors::Whole);
        // Shares of the target's deviation: sums of 64 products in f64, of a well-conditioned system.
        assert!(residual.differences.color.iter().all(|d| d.unwrap().iter().all(|d| d.abs() < 1e-11)));
    }

    #[test]
    fn few_pixels_and_black_ones_have_finite_differences() {
        let picture = |layers: Vec<Vec<[f32; 3]>>| Picture {
            width: 2,
            height: 1,
            layers,
            alpha: Some(vec![1.0; 2]),
            mask: Vec::new(),
            plain: Vec::new(),
        };
        // Two pixels, of three terms.
        let drawn = picture(vec![vec![[0.1; 3], [0.2; 3]], vec![[0.3; 3]; 2], vec![[0.5; 3], [0.1; 3]]]);
        for target in [[[0.0; 3]; 2], [[0.4; 3]; 2], [[0.1; 3], [0.7; 3]]] {
            let residual = Residual::new(&drawn, &picture(vec![target.to_vec()]), Colors::Whole);
            // Two values lie on a line; what has no deviation differs by none.
            assert!(
                residual.differences.color.iter().all(|d| d.unwrap().iter().all(|d| d.abs() < 1e-6)),
                "{target:?}"
            );
        }
    }

    #[test]
    fn detail_is_what_differs_from_the_compared_around_it() {
        let (width, height) = (9, 7);
        let grey = |value: f64| Some([value, 2.0 * value, -value]);
        let mut color: Vec<Option<[f64; 3]>> = (0..width * height).map(|_| grey(0.25)).collect();
        color[3 * width + 4] = grey(1.25);
        color[0] = None;
        let found = detail(&color, width);
        assert_eq!(found[0], None);
        let at = |x: usize, y: usize| found[y * width + x].unwrap();
        // One of the 25 around it is greater by 1; where it is not among them, all are alike.
        let near = |found: [f64; 3], value: f64| {
            found.iter().zip([value, 2.0 * value, -value]).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        assert!(near(at(4, 3), 1.0 - 1.0 / 25.0), "{:?}", at(4, 3));
        assert!(near(at(6, 4), -1.0 / 25.0), "{:?}", at(6, 4));
        assert!(near(at(7, 3), 0.0) && near(at(1, 0), 0.0));
        // Beside the border a row of the five is not there.
        assert!(near(at(4, 1), -1.0 / 20.0), "{:?}", at(4, 1));
    }
}

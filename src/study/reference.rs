//! What a study's images are compared with, and how far they are off.

use rayon::prelude::*;
use serde::Serialize;

use super::significance::LossMap;
use crate::engine::residual::Residuals;
use crate::engine::view::ObservedView;
use crate::model::batch::Batch;
use crate::render::image::Image;
use crate::report::metrics::{COVERED, Comparison, PSNR_OF_EQUALS, Scores};
use crate::report::pictures::Picture;
use crate::scene::Loss;
use crate::scene::view::{Clip, View};

/// Where the reference comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The scene's target images.
    Targets,
    /// The model with everything on: the scene has no targets.
    Model,
}

/// What a view's images are compared with.
#[derive(Clone, Debug)]
pub struct ReferenceView {
    /// The view's name.
    pub name: String,
    /// The reference.
    pub image: Image,
    /// What share of each pixel is compared; scores are taken where it is full.
    coverage: Vec<f32>,
    /// What each pixel counts in the loss.
    weight: Vec<f32>,
    clip: Option<Clip>,
}

/// How far images are from their references, over the fully covered pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// Root of the mean squared difference of linear radiance, over pixels and channels.
    pub linear: f64,
    /// The same over the reference's root mean square.
    pub relative: f64,
    /// dB, the mean of the views; none where no pixel is fully covered.
    pub psnr: Option<f64>,
    /// Mean FLIP error, of the views; none where no pixel is fully covered.
    pub flip: Option<f64>,
    /// What these are made of.
    #[serde(skip)]
    pub(crate) sums: Sums,
}

/// What a [`Difference`] is a mean of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// Of squared differences, over pixels and channels.
    squares: f64,
    /// Of the references' squares.
    size: f64,
    /// How many of either.
    values: usize,
    /// Of the views' PSNR and FLIP.
    psnr: f64,
    flip: f64,
    /// Views with a fully covered pixel.
    views: usize,
}

impl Difference {
    /// Of all views of a scene; what the references cover fully counts.
    #[must_use]
    pub fn of_all(references: &[Image], images: &[Image]) -> Self {
        let mut all = Sums::default();
        for (reference, image) in references.iter().zip(images) {
            let (squares, size, count) = sums(reference, image, &reference.alpha);
            let scores = Comparison::new(reference, image, &reference.alpha).scores();
            let (psnr, flip) = scores.map_or((0.0, 0.0), |scores| (scores.psnr, scores.flip));
            let views = usize::from(scores.is_some());
            all = all.plus(Sums { squares, size, values: count, psnr, flip, views });
        }
        Self::of_sums(all)
    }

    /// Of all views of several scenes: every pixel counts as much as every other, and every view's score.
    #[must_use]
    pub fn pooled(scenes: impl IntoIterator<Item = Self>) -> Self {
        Self::of_sums(scenes.into_iter().fold(Sums::default(), |all, scene| all.plus(scene.sums)))
    }

    fn of_sums(sums: Sums) -> Self {
        let Sums { squares, size, values, psnr, flip, views } = sums;
        let mean = |sum: f64| (views > 0).then(|| sum / views as f64);
        Self {
            linear: (squares / values.max(1) as f64).sqrt(),
            relative: relative(squares, size),
            psnr: mean(psnr),
            flip: mean(flip),
            sums,
        }
    }
}

impl Sums {
    fn plus(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            size: self.size + other.size,
            values: self.values + other.values,
            psnr: self.psnr + other.psnr,
            flip: self.flip + other.flip,
            views: self.views + other.views,
        }
    }
}

/// Sums over covered pixels and channels: of squared differences, of the reference's squares, and how many.
fn sums(reference: &Image, image: &Image, coverage: &[f32]) -> (f64, f64, usize) {
    let covered = (0..coverage.len()).filter(|&i| coverage[i] >= COVERED);
    covered.flat_map(|i| (0..3).map(move |c| (i, c))).fold((0.0, 0.0, 0), |(squares, size, count), (i, c)| {
        let (is, want) = (f64::from(image.rgb[i][c]), f64::from(reference.rgb[i][c]));
        (squares + (is - want).powi(2), size + want * want, count + 1)
    })
}

/// The root of a share; nothing is no error, whatever the size.
fn relative(squares: f64, size: f64) -> f64 {
    if squares == 0.0 { 0.0 } else { (squares / size.max(f64::MIN_POSITIVE)).sqrt() }
}

/// How far an image is from its reference.
#[derive(Clone, Debug)]
pub struct ViewErrors {
    /// Root of the mean squared difference of linear radiance, over fully covered pixels and channels.
    pub linear: f64,
    /// The same over the reference's root mean square.
    pub relative: f64,
    /// PSNR, SSIM and FLIP; none where no pixel is fully covered.
    pub scores: Option<Scores>,
    /// The scene's loss, pixel by pixel.
    pub map: LossMap,
    /// FLIP's error map.
    pub flip: Picture,
}

impl ReferenceView {
    /// The target of `view`, where the samples of the whole model and the target's mask let it count.
    #[must_use]
    pub fn new(view: &View, observed: &ObservedView) -> Self {
        let (width, height) = (view.camera.width as usize, view.camera.height as usize);
        let mut image = Image::new(width, height);
        if let Some(target) = &view.target {
            image.rgb.clone_from(&target.rgb);
            // Without an alpha of its own, the target is opaque.
            image.alpha = target.alpha.clone().unwrap_or_else(|| vec![1.0; width * height]);
        }
        let (mut coverage, mut weight) = (vec![0.0; width * height], vec![0.0; width * height]);
        for (slot, &pixel) in observed.samples.pixel.iter().enumerate() {
            if pixel != u32::MAX && observed.pixel_weight(slot) > 0.0 {
                let at = pixel as usize;
                coverage[at] = observed.samples.coverage[slot].min(image.alpha[at]);
                weight[at] = observed.pixel_weight(slot);
            }
        }
        Self { name: view.name.clone(), image, coverage, weight, clip: observed.clip }
    }

    /// How far `image` is off.
    #[must_use]
    pub fn errors(&self, image: &Image, loss: Loss) -> ViewErrors {
        let comparison = Comparison::new(&self.image, image, &self.coverage);
        let (squares, size, count) = sums(&self.image, image, &self.coverage);
        ViewErrors {
            linear: (squares / count.max(1) as f64).sqrt(),
            relative: relative(squares, size),
            scores: comparison.scores(),
            map: self.losses(image, &Residuals::new(loss)),
            flip: Picture::of_error(&comparison, image.width),
        }
    }

    /// The loss of each pixel. As in a fit, colours are those of the covered share of a pixel.
    fn losses(&self, image: &Image, residuals: &Residuals) -> LossMap {
        let colour = |image: &Image, i: usize, c: usize| match f64::from(image.alpha[i]) {
            alpha if alpha > 0.0 => f64::from(image.rgb[i][c]) / alpha,
            _ => 0.0,
        };
        let of = |i: usize| {
            let weight = f64::from(self.weight[i]);
            if weight == 0.0 {
                return 0.0;
            }
            let [model, target] = [image, &self.image].map(|of| Batch([0, 1, 2].map(|c| colour(of, i, c))));
            residuals.weigh(self.clip, model, target, Batch([weight; 3])).loss.0.iter().sum()
        };
        LossMap {
            width: image.width,
            loss: (0..self.weight.len()).into_par_iter().map(of).collect(),
            weight: self.weight.iter().map(|&w| 3.0 * f64::from(w)).collect(),
        }
    }
}

/// A PSNR in a table of text, where it is known; of equal images it has no end.
#[must_use]
pub fn psnr_in_words(psnr: Option<f64>) -> String {
    match psnr {
        Some(psnr) if psnr >= PSNR_OF_EQUALS => "equal".to_owned(),
        Some(psnr) => format!("{psnr:.2}"),
        None => "-".to_owned(),
    }
}

/// A PSNR as a cell of CSV: empty where it is not known, `inf` of equal images.
#[must_use]
pub fn psnr_in_csv(psnr: Option<f64>) -> String {
    match psnr {
        Some(psnr) if psnr >= PSNR_OF_EQUALS => "inf".to_owned(),
        Some(psnr) => format!("{psnr:.5}"),
        None => String::new(),
    }
}

/// The mean loss over some views.
#[must_use]
pub fn mean_loss<'a>(maps: impl IntoIterator<Item = &'a LossMap>) -> f64 {
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let total = maps.into_iter().fold((0.0, 0.0), |t, map| (t.0 + sum(&map.loss), t.1 + sum(&map.weight)));
    if total.1 > 0.0 { total.0 / total.1 } else { 0.0 }
}

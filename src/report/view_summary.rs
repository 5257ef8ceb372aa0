//! What `report.json` tells of a view.

use super::metrics::Scores;

/// How well one view is matched; `null` when no pixel of it is covered.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ViewSummary {
    /// dB; 200 stands for equal images.
    pub psnr: Option<f64>,
    /// 1 for equal images.
    pub ssim: Option<f64>,
    /// 0 for equal images.
    pub flip: Option<f64>,
    /// How many pixels were compared.
    pub pixels: usize,
    /// Whether it took no part in the fit.
    pub held_out: bool,
}

impl ViewSummary {
    /// The scores over `pixels` compared pixels of a view that took part in the fit, or was held out of it.
    #[must_use]
    pub fn new(scores: Option<Scores>, pixels: usize, held_out: bool) -> Self {
        let of = |score: fn(&Scores) -> f64| scores.as_ref().map(score);
        Self { psnr: of(|s| s.psnr), ssim: of(|s| s.ssim), flip: of(|s| s.flip), pixels, held_out }
    }
}

/// How well the fit matches what it has seen, and what it has not.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MeanScores {
    /// The views that were fitted; `null` without any.
    pub fitted: Option<ViewMeans>,
    /// The views that were held out; `null` without any.
    pub held_out: Option<ViewMeans>,
}

/// The mean scores of some views; `null` when no pixel of them is covered.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ViewMeans {
    /// How many views.
    pub views: usize,
    /// dB.
    pub psnr: Option<f64>,
    /// 1 for equal images.
    pub ssim: Option<f64>,
    /// 0 for equal images.
    pub flip: Option<f64>,
}

impl MeanScores {
    pub(super) fn of(views: &[ViewSummary]) -> Self {
        let part = |held_out: bool| ViewMeans::of(views.iter().filter(|view| view.held_out == held_out));
        Self { fitted: part(false), held_out: part(true) }
    }
}

impl ViewMeans {
    /// A view without covered pixels has no part in a mean.
    fn of<'a>(views: impl Iterator<Item = &'a ViewSummary>) -> Option<Self> {
        let views: Vec<&ViewSummary> = views.collect();
        let mean = |score: fn(&ViewSummary) -> Option<f64>| {
            let scores: Vec<f64> = views.iter().filter_map(|view| score(view)).collect();
            (!scores.is_empty()).then(|| scores.iter().sum::<f64>() / scores.len() as f64)
        };
        (!views.is_empty()).then(|| Self {
            views: views.len(),
            psnr: mean(|view| view.psnr),
            ssim: mean(|view| view.ssim),
            flip: mean(|view| view.flip),
        })
    }
}

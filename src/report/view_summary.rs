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
}

impl ViewSummary {
    /// The scores over `pixels` compared pixels.
    #[must_use]
    pub fn new(scores: Option<Scores>, pixels: usize) -> Self {
        let of = |score: fn(&Scores) -> f64| scores.as_ref().map(score);
        Self { psnr: of(|s| s.psnr), ssim: of(|s| s.ssim), flip: of(|s| s.flip), pixels }
    }
}

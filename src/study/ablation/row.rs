//! The rows of an ablation: a case each, its errors beside the whole model's.

use serde::Serialize;

use super::case::Case;
use super::refit::Starts;
use crate::cost::Counts;
use crate::fit::outcome::Ending;
use crate::reference::{ViewErrors, mean_loss};
use crate::render::image::Image;
use crate::report::pictures::Picture;
use crate::significance::{Change, LossMap, change};
use crate::timing::Timed;

/// One case.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is left out.
    pub left_out: Case,
    /// The mean loss over all views.
    pub loss: f64,
    /// Its change from the whole model's, with its sampling error.
    pub change: Change,
    /// Each view's errors.
    pub views: Vec<ViewRow>,
    /// The same of what is held out, which no fit has seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOutRow>,
    /// What it costs, in counts.
    pub counts: Counts,
    /// A pass of the CPU engine over all samples, every lookup live; the ratio is to the whole model's.
    pub cpu: Option<Timed>,
    /// A frame of the renderer, the first view.
    pub gpu: Option<Timed>,
    /// The constants, and their standard errors where they were fitted.
    pub constants: Vec<Constant>,
    /// How the fit ended, where there was one.
    pub ending: Option<Ending>,
    /// Where the fits of what is left began, where it was fitted again.
    pub starts: Option<Starts>,
}

/// What a case makes of the views that are held out.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOutRow {
    /// The mean loss over them.
    pub loss: f64,
    /// Its change from the whole model's, with its sampling error.
    pub change: Change,
    /// dB, the mean of the views.
    pub psnr: Option<f64>,
    /// Its change from the whole model's.
    pub psnr_change: Option<f64>,
    /// Each view's errors.
    pub views: Vec<ViewRow>,
}

/// One view of a case.
#[derive(Clone, Debug, Serialize)]
pub struct ViewRow {
    /// Its name.
    pub view: String,
    /// Its mean loss.
    pub loss: f64,
    /// Root mean square difference, linear radiance.
    pub linear_rms: f64,
    /// The same over the reference's root mean square.
    pub relative_rms: f64,
    /// dB.
    pub psnr: Option<f64>,
    /// Structural similarity.
    pub ssim: Option<f64>,
    /// Mean FLIP error.
    pub flip: Option<f64>,
    /// The image and its FLIP map, for cases of one part.
    #[serde(skip)]
    pub pictures: Option<(Picture, Picture)>,
}

/// A constant of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// One standard error.
    pub std_error: Option<f64>,
}

impl Row {
    /// The means over the views that are fitted.
    #[must_use]
    pub fn mean(&self) -> ViewRow {
        mean("all", self.loss, &self.views)
    }

    /// Whether it tells a part that only helps to match what the fit has seen: that is matched worse without it, what is
    /// held out is not.
    #[must_use]
    pub fn only_overfits(&self) -> bool {
        let worse = |change: &Change| change.is_significant() && change.loss > 0.0;
        self.held_out.as_ref().is_some_and(|held| worse(&self.change) && !worse(&held.change))
    }
}

impl HeldOutRow {
    /// The means over the views.
    #[must_use]
    pub fn mean(&self) -> ViewRow {
        mean("held out", self.loss, &self.views)
    }
}

/// The means of some views' scores.
fn mean(name: &str, loss: f64, views: &[ViewRow]) -> ViewRow {
    let all = |value: &dyn Fn(&ViewRow) -> Option<f64>| {
        let values: Vec<f64> = views.iter().filter_map(value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    ViewRow {
        view: name.to_owned(),
        loss,
        linear_rms: all(&|v| Some(v.linear_rms)).unwrap_or(0.0),
        relative_rms: all(&|v| Some(v.relative_rms)).unwrap_or(0.0),
        psnr: all(&|v| v.psnr),
        ssim: all(&|v| v.ssim),
        flip: all(&|v| v.flip),
        pictures: None,
    }
}

/// Some views of a case: images and how far they are off.
pub(super) struct Compared {
    pub(super) images: Vec<Image>,
    pub(super) errors: Vec<ViewErrors>,
}

/// The whole model on the same views.
pub(super) struct Before {
    /// What the views are called.
    pub(super) names: Vec<String>,
    /// Its losses.
    pub(super) maps: Vec<LossMap>,
    /// What roundings may do to its mean loss, of either of two fits and in either direction.
    pub(super) rounding: f64,
}

impl Before {
    /// Of views whose sums of squares have roundings of `rounding`.
    pub(super) fn new(names: Vec<String>, errors: &[ViewErrors], rounding: f64) -> Self {
        let maps: Vec<LossMap> = errors.iter().map(|errors| errors.map.clone()).collect();
        let weight: f64 = maps.iter().flat_map(|map| &map.weight).sum();
        Self { names, maps, rounding: if weight > 0.0 { 4.0 * rounding / weight } else { 0.0 } }
    }
}

impl Compared {
    /// The loss, its change from the whole model's, and each view's errors; with pictures where they are to be kept. Where
    /// the whole model leaves nothing but rounding, there is no misfit that a change could be mistaken for.
    pub(super) fn beside(&self, before: &Before, keep: bool) -> (f64, Change, Vec<ViewRow>) {
        let maps: Vec<LossMap> = self.errors.iter().map(|errors| errors.map.clone()).collect();
        let (found, rounding) = (change(&before.maps, &maps), before.rounding);
        let t = found.t.filter(|_| rounding == 0.0 || mean_loss(&before.maps) > rounding);
        let view = |(view, (errors, image)): (&String, (&ViewErrors, &Image))| ViewRow {
            view: view.clone(),
            loss: mean_loss([&errors.map]),
            linear_rms: errors.linear,
            relative_rms: errors.relative,
            psnr: errors.scores.map(|scores| scores.psnr),
            ssim: errors.scores.map(|scores| scores.ssim),
            flip: errors.scores.map(|scores| scores.flip),
            pictures: keep.then(|| (Picture::of_image(image), errors.flip.clone())),
        };
        let views = before.names.iter().zip(self.errors.iter().zip(&self.images)).map(view).collect();
        (mean_loss(&maps), Change { t, rounding, ..found }, views)
    }
}

//! The signed error of a view as a picture: blue where the fit is too dark, red where it is too bright.

use super::ViewEvidence;
use super::misfit::{mean, residual};
use super::pictures::{BACKGROUND, Picture};
use super::words::number;
use crate::render::tonemap::ToneMap;

/// The class colours of RdBu, from blue to red (Brewer's, ColorBrewer 2.0).
const STOPS: [[u8; 3]; 5] = [[5, 113, 176], [146, 197, 222], [247, 247, 247], [244, 165, 130], [202, 0, 32]];

/// The share of the pixels whose error is within the scale.
const WITHIN: f64 = 0.98;

/// The diverging colour map on [-1, 1]: blue, white at 0, red.
#[must_use]
pub fn diverging(t: f64) -> [u8; 3] {
    let t = if t.is_nan() { 0.0 } else { t.clamp(-1.0, 1.0) };
    let place = (t + 1.0) / 2.0 * (STOPS.len() - 1) as f64;
    let i = (place as usize).min(STOPS.len() - 2);
    let share = place - i as f64;
    let channel = |c: usize| {
        let [from, to] = [STOPS[i][c], STOPS[i + 1][c]].map(f64::from);
        (from + share * (to - from) + 0.5) as u8
    };
    [0, 1, 2].map(channel)
}

/// The error that the ends of the scale stand for, in linear radiance: one for all views, with 98% of the pixels within
/// it, at least `least`, rounded up to 1, 2 or 5 times a power of ten.
#[must_use]
pub fn scale(views: &[ViewEvidence], least: f64) -> f64 {
    let of = |view: &ViewEvidence| -> Vec<f64> {
        let errors = (0..view.fit.rgb.len()).filter_map(|at| residual(view, at));
        errors.map(|(residual, _)| mean(residual).abs()).collect()
    };
    let mut errors: Vec<f64> = views.iter().flat_map(of).collect();
    let within = ((WITHIN * errors.len() as f64) as usize).min(errors.len().saturating_sub(1));
    let most = if errors.is_empty() { 0.0 } else { *errors.select_nth_unstable_by(within, f64::total_cmp).1 };
    rounded_up(most.max(least))
}

fn rounded_up(x: f64) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return 1.0;
    }
    let power = 10.0_f64.powf(x.log10().floor());
    // A difference of f32 numbers that is such a multiple itself may be rounded a little above it.
    let steps = [1.0, 2.0, 5.0].map(|step| step * power);
    steps.into_iter().find(|step| x <= step * (1.0 + 1e-5)).unwrap_or(10.0 * power)
}

/// The error of each pixel of a view (the mean of its channels), `scale` being the ends of the colours; grey where
/// nothing is compared.
#[must_use]
pub fn picture(view: &ViewEvidence, scale: f64) -> Picture {
    let grey = ToneMap::default().encode_bytes([BACKGROUND; 3]);
    let pixel =
        |at: usize| residual(view, at).map_or(grey, |(residual, _)| diverging(mean(residual) / scale));
    let bytes = (0..view.fit.rgb.len()).flat_map(pixel).collect();
    Picture { width: view.fit.width, height: view.fit.height, bytes }
}

/// The caption of the picture, in HTML, with the colours from end to end.
#[must_use]
pub fn legend(scale: f64) -> String {
    let end = number(scale, 1);
    format!("signed error <span class=\"bar signed\"><i>−{end}</i><b></b><i>+{end}</i></span>")
}

#[cfg(test)]
mod tests {
    use super::super::misfit::tests::view;
    use super::*;

    #[test]
    fn blue_is_too_dark_red_is_too_bright_and_white_is_right() {
        let [dark, right, bright] = [-1.0, 0.0, 1.0].map(diverging);
        assert!(dark[2] > 2 * dark[0].max(20) && bright[0] > 2 * bright[2].max(20), "{dark:?} {bright:?}");
        assert_eq!(right, [247; 3]);
        assert_eq!((diverging(-9.0), diverging(f64::INFINITY), diverging(f64::NAN)), (dark, bright, right));
        // Lightness falls to both sides, and alike.
        let sum = |t: f64| diverging(t).iter().map(|c| u32::from(*c)).sum::<u32>();
        let falls = |sign: f64| {
            (0..100).all(|i| sum(sign * f64::from(i) / 100.0) >= sum(sign * f64::from(i + 1) / 100.0))
        };
        assert!(falls(1.0) && falls(-1.0));
    }

    #[test]
    fn a_picture_shows_the_sign_of_each_pixel_and_grey_where_nothing_is_compared() {
        let side = 128;
        let mut view = view(|at, _, target| match at % side {
            0..40 => target - 0.1,
            40..80 => target,
            _ => target + 0.05,
        });
        view.coverage[5] = 0.5;
        let scale = scale(std::slice::from_ref(&view), 0.001);
        // More than 2% of the pixels are off by 0.1.
        assert_eq!(scale, 0.1);
        let picture = picture(&view, scale);
        let at = |i: usize| [0, 1, 2].map(|c| picture.bytes[3 * i + c]);
        // f32 differences of numbers below 1, a hundred-thousandth of a step between two colours.
        let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1);
        assert!(
            near(at(0), diverging(-1.0)) && near(at(60), diverging(0.0)) && near(at(100), diverging(0.5))
        );
        assert_eq!(at(5), ToneMap::default().encode_bytes([BACKGROUND; 3]));
        assert_eq!(legend(scale).matches("0.1<").count(), 2);
    }

    #[test]
    fn a_scale_is_a_round_number_and_never_nothing() {
        for (x, want) in
            [(0.1, 0.1), (0.011, 0.02), (0.3, 0.5), (0.6, 1.0), (7e-5, 1e-4), (0.0, 1.0), (f64::NAN, 1.0)]
        {
            assert!((rounded_up(x) / want - 1.0).abs() < 1e-9, "{x}: {}", rounded_up(x));
        }
        // The least counts where the fit is nearer.
        assert_eq!(scale(&[view(|_, _, target| target)], 0.003), 0.005);
        assert_eq!(scale(&[], 0.0), 1.0);
    }
}

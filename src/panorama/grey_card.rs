//! Exposure and white balance from a patch of known reflectance.
//!
//! A Lambert card of reflectance rho that faces the light has the radiance L = rho E / pi (E: irradiance). So
//! rho / L, a factor for each channel, makes E / pi = 1 of the light there: a white card would have radiance 1, as it
//! has under an environment of constant 1. Only the white balance is Y / L, where Y is the card's Rec.709 luminance:
//! the card turns grey, and its luminance stays.

use thiserror::Error;

use crate::picture::{Picture, PictureError, luminance};
use crate::robust::deviation;

/// Reflectance of the usual grey card.
pub const REFLECTANCE: f64 = 0.18;

/// The share of a card's pixels that may be unseen: of a clipped border or a lamp's gloss.
const MOST_UNSEEN: f64 = 0.1;

/// What is wrong with a card.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CardError {
    /// The picture is none.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The rectangle is not inside the picture.
    #[error(
        "The card's rectangle at ({x}, {y}), {width} x {height}, is empty or leaves the picture of {picture_width} x {picture_height} pixels. Give one inside it."
    )]
    Outside {
        /// Its left column.
        x: usize,
        /// Its top row.
        y: usize,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
        /// The picture's columns.
        picture_width: usize,
        /// The picture's rows.
        picture_height: usize,
    },
    /// The reflectance is not one.
    #[error("The card's reflectance is {0}. Give one above 0 and at most 1.")]
    Reflectance(f64),
    /// Nothing is known of much of it.
    #[error(
        "No exposure sees {unseen} of the card's {pixels} pixels: they are clipped, or black, in all of them. Take one that sees the card, or give a rectangle that is seen."
    )]
    Unseen {
        /// Pixels that no exposure sees.
        unseen: usize,
        /// Pixels of the rectangle.
        pixels: usize,
    },
    /// The card is black.
    #[error(
        "The card's radiance is {mean} in channel {channel}. Give a rectangle that is lit in all channels."
    )]
    Dark {
        /// 0 for red.
        channel: usize,
        /// What was measured.
        mean: f64,
    },
}

/// Pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    /// The left column.
    pub x: usize,
    /// The top row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// What a card tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Card {
    /// Its radiance, rgb: the mean of the middle half of its pixels.
    pub radiance: [f64; 3],
    /// The deviation of its pixels as a share of that (by the median of distances), the largest channel's. Above 0.1
    /// or so the rectangle is not one evenly lit card.
    pub unevenness: f64,
    /// What takes the card to its reflectance, rgb.
    pub exposure: [f64; 3],
    /// What takes the card to grey of its luminance, rgb.
    pub white_balance: [f64; 3],
}

/// What [`normalise`] changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Normalise {
    /// Only the white balance.
    #[default]
    WhiteBalance,
    /// Exposure and white balance.
    Exposure,
}

/// Measures the card in `rectangle` of a picture of radiance; `reflectance` in (0, 1], usually [`REFLECTANCE`].
///
/// A clipped card tells nothing, and radiance does not show it: `seen` says how many exposures see each pixel, as
/// [`Merged::seen`](crate::merge::Merged::seen) has it, and pixels that none sees are left out. Without it all count.
///
/// # Errors
/// A picture, a rectangle or a reflectance that is none, a card of which a tenth is not seen, and one without light in a
/// channel.
pub fn measure(
    picture: &Picture,
    seen: Option<&[u8]>,
    rectangle: Rectangle,
    reflectance: f64,
) -> Result<Card, CardError> {
    picture.check()?;
    let Rectangle { x, y, width, height } = rectangle;
    let inside = |at: usize, size: usize, whole: usize| size > 0 && at < whole && size <= whole - at;
    if !(inside(x, width, picture.width) && inside(y, height, picture.height)) {
        let (picture_width, picture_height) = (picture.width, picture.height);
        return Err(CardError::Outside { x, y, width, height, picture_width, picture_height });
    }
    if !(reflectance > 0.0 && reflectance <= 1.0) {
        return Err(CardError::Reflectance(reflectance));
    }
    let pixels = seen_pixels(picture, seen, rectangle)?;
    let (mut radiance, mut unevenness) = ([0.0; 3], 0f64);
    for c in 0..3 {
        let mut values: Vec<f64> = pixels.iter().map(|rgb| f64::from(rgb[c])).collect();
        values.sort_unstable_by(f64::total_cmp);
        // A letter or a finger on the card is in neither middle quarter.
        let middle = &values[values.len() / 4..values.len() - values.len() / 4];
        let mean = middle.iter().sum::<f64>() / middle.len() as f64;
        let factor = reflectance / mean;
        // Radiance so low that the factor overflows is dark as well.
        if !(mean > 0.0 && factor.is_finite()) {
            return Err(CardError::Dark { channel: c, mean });
        }
        radiance[c] = mean;
        unevenness = unevenness.max(deviation(&values, mean) / mean);
    }
    let grey = luminance(radiance);
    Ok(Card {
        radiance,
        unevenness,
        exposure: radiance.map(|l| reflectance / l),
        white_balance: radiance.map(|l| grey / l),
    })
}

/// The pixels of a rectangle inside the picture that an exposure sees.
fn seen_pixels(
    picture: &Picture,
    seen: Option<&[u8]>,
    Rectangle { x, y, width, height }: Rectangle,
) -> Result<Vec<[f32; 3]>, CardError> {
    let places = (y..y + height).flat_map(|row| row * picture.width + x..row * picture.width + x + width);
    let known = |i: &usize| seen.is_none_or(|seen| seen.get(*i).is_some_and(|count| *count > 0));
    let known: Vec<[f32; 3]> = places.filter(known).map(|i| picture.texels[i]).collect();
    let pixels = width * height;
    let unseen = pixels - known.len();
    if unseen as f64 > MOST_UNSEEN * pixels as f64 {
        return Err(CardError::Unseen { unseen, pixels });
    }
    Ok(known)
}

/// Applies what a card tells. Radiance beyond f32 stays at its largest number.
pub fn normalise(picture: &mut Picture, card: &Card, what: Normalise) {
    let factors = match what {
        Normalise::WhiteBalance => card.white_balance,
        Normalise::Exposure => card.exposure,
    };
    for texel in &mut picture.texels {
        for c in 0..3 {
            let scaled = f64::from(texel[c]) * factors[c];
            texel[c] = scaled.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A card of (0.4, 0.5, 0.2) in a dark room, with noise of 2 % and a tenth of it written on.
    fn room() -> (Picture, Rectangle) {
        let mut texels = vec![[0.01f32; 3]; 40 * 30];
        for i in 0..100usize {
            let noise = 1.0 + 0.02 * ((i as f32 * 1.7).sin());
            let card = if i % 10 == 0 { [0.0; 3] } else { [0.4 * noise, 0.5 * noise, 0.2 * noise] };
            texels[(12 + i / 10) * 40 + 20 + i % 10] = card;
        }
        (Picture { width: 40, height: 30, texels }, Rectangle { x: 20, y: 12, width: 10, height: 10 })
    }

    #[test]
    fn a_card_becomes_its_reflectance() {
        let (mut picture, rectangle) = room();
        let card = measure(&picture, None, rectangle, REFLECTANCE).unwrap();
        for (got, truth) in card.radiance.into_iter().zip([0.4, 0.5, 0.2]) {
            // The letters pull the middle half down by a tenth of the noise's width.
            assert!((got / truth - 1.0).abs() < 0.005, "{got}");
        }
        let mut balanced = picture.clone();
        normalise(&mut balanced, &card, Normalise::WhiteBalance);
        let [r, g, b] = measure(&balanced, None, rectangle, REFLECTANCE).unwrap().radiance;
        let luminance = luminance(card.radiance);
        // Pixels are f32, each off by up to 3e-8 of itself.
        assert!((r - luminance).abs() < 1e-6 && (g - luminance).abs() < 1e-6 && (b - luminance).abs() < 1e-6);
        normalise(&mut picture, &card, Normalise::Exposure);
        let exposed = measure(&picture, None, rectangle, REFLECTANCE).unwrap();
        assert!(exposed.radiance.iter().all(|l| (l - REFLECTANCE).abs() < 1e-6));
    }

    #[test]
    fn what_no_exposure_sees_is_left_out_or_refused() {
        let (mut picture, rectangle) = room();
        let whole = measure(&picture, None, rectangle, REFLECTANCE).unwrap();
        let mut seen = vec![2; picture.texels.len()];
        let at = |i: usize| (12 + i / 10) * 40 + 20 + i % 10;
        // Pixels that are clipped have the least radiance that they can be of, here none.
        for i in 0..10 {
            picture.texels[at(i)] = [0.0; 3];
            seen[at(i)] = 0;
        }
        let card = measure(&picture, Some(&seen), rectangle, REFLECTANCE).unwrap();
        for (got, want) in card.radiance.into_iter().zip(whole.radiance) {
            // A tenth of the noise's width.
            assert!((got / want - 1.0).abs() < 0.002, "{got} {want}");
        }
        seen[at(10)] = 0;
        assert_eq!(
            measure(&picture, Some(&seen), rectangle, REFLECTANCE),
            Err(CardError::Unseen { unseen: 11, pixels: 100 })
        );
    }

    #[test]
    fn wrong_cards_are_refused() {
        let (mut picture, rectangle) = room();
        let wrong =
            |rectangle| matches!(measure(&room().0, None, rectangle, 0.18), Err(CardError::Outside { .. }));
        assert!(wrong(Rectangle { width: 0, ..rectangle }) && wrong(Rectangle { x: 31, ..rectangle }));
        assert!(wrong(Rectangle { y: usize::MAX, height: usize::MAX, ..rectangle }));
        assert!(matches!(measure(&picture, None, rectangle, f64::NAN), Err(CardError::Reflectance(_))));
        picture.texels.fill([0.5, 0.0, 0.5]);
        assert_eq!(measure(&picture, None, rectangle, 0.18), Err(CardError::Dark { channel: 1, mean: 0.0 }));
        picture.texels[0] = [f32::NAN; 3];
        assert!(matches!(measure(&picture, None, rectangle, 0.18), Err(CardError::Picture(_))));
    }
}

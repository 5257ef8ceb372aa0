//! A pane in 8 bits a channel, a pixel for each of its image's: what the window's `picture.wgsl` shows, on the CPU.

use crate::look::{ErrorKind, Look};
use crate::render::image::Image;
use crate::render::tonemap::{ToneMap, srgb_encode};
use crate::report::pictures::{BACKGROUND, magma};
use crate::report::signed::diverging;
use crate::scene::maps::luminance;
use crate::shown::{Kind, scale};

/// From 8 stops below white to 2 above it.
const STOPS: (f32, f32) = (-8.0, 2.0);

/// Red, green, blue and 255 of each pixel, row by row; a wipe is its caller's to make of two.
#[must_use]
pub fn pixels([first, second]: [&Image; 2], kind: Kind, look: &Look) -> Vec<u8> {
    let tone = ToneMap { operator: look.operator(), exposure: look.exposure };
    let shown = |i: usize| {
        let (rgb, alpha) = (first.rgb[i], first.alpha[i]);
        let radiance = rgb.map(|c| c + (1.0 - alpha) * BACKGROUND);
        if look.false_colour {
            let exposed = luminance(radiance) * look.exposure.exp2();
            let (low, high) = STOPS;
            return magma((exposed.max(1e-10).log2() - low) / (high - low));
        }
        tone.encode_bytes(radiance)
    };
    let grey = [(255.0 * srgb_encode(BACKGROUND)).round() as u8; 3];
    let error = |kind: ErrorKind, i: usize| {
        // What is not compared is grey.
        if first.alpha[i] < 0.5 {
            return grey;
        }
        let (a, b, scale) = (first.rgb[i], second.rgb[i], scale(kind));
        let apart = mean([0, 1, 2].map(|c| a[c] - b[c]));
        match kind {
            ErrorKind::Signed => diverging(f64::from(apart / scale)),
            ErrorKind::Relative => magma(apart.abs() / (mean(b).max(1e-3) * scale)),
            ErrorKind::Flip => magma(a[0] / scale),
        }
    };
    let pixel = |i: usize| match kind {
        Kind::Error(kind) => error(kind, i),
        Kind::Image | Kind::Wipe(_) => shown(i),
    };
    (0..first.alpha.len())
        .flat_map(|i| {
            let [r, g, b] = pixel(i);
            [r, g, b, 255]
        })
        .collect()
}

/// The 256 colours of an error's scale, red, green, blue and 255 of each: from 0 to 1, or `signed` from -1 to 1.
#[must_use]
pub fn ramp(signed: bool) -> Vec<u8> {
    let color = |i: u16| match signed {
        true => diverging(2.0 * f64::from(i) / 255.0 - 1.0),
        false => magma(f32::from(i) / 255.0),
    };
    (0..256).map(color).flat_map(|[r, g, b]| [r, g, b, 255]).collect()
}

fn mean(rgb: [f32; 3]) -> f32 {
    rgb.iter().sum::<f32>() / 3.0
}

//! Pictures for people: target | fit | FLIP error side by side, with captions and a colour bar.

use super::lettering::Line;
use super::metrics::{Comparison, Scores};
use crate::render::files::Image;
use crate::render::tonemap::ToneMap;

/// Linear radiance of the grey behind images.
pub const BACKGROUND: f32 = 0.05;

const PAPER: [u8; 3] = [24, 25, 28];
const INK: [u8; 3] = [232, 230, 227];
const FAINT: [u8; 3] = [150, 150, 155];

/// An 8-bit sRGB picture that can be drawn on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// sRGB bytes, row by row.
    pub bytes: Vec<u8>,
}

/// The colour map magma on [0, 1], sRGB-encoded (van der Walt and Smith's, by Zucker's polynomial).
#[must_use]
pub fn magma(t: f32) -> [u8; 3] {
    const COEFFICIENTS: [[f32; 3]; 7] = [
        [-0.002_136_485, -0.000_749_655, -0.005_386_128],
        [0.251_660_54, 0.677_523_26, 2.494_026_6],
        [8.353_717, -3.577_719_5, 0.314_467_9],
        [-27.668_733, 14.264_731, -13.649_213],
        [52.176_14, -27.943_606, 12.944_17],
        [-50.768_525, 29.046_583, 4.234_153],
        [18.655_705, -11.489_774, -5.601_961_6],
    ];
    let t = t.clamp(0.0, 1.0);
    let value = |c: usize| COEFFICIENTS.iter().rev().fold(0.0, |sum, row| sum * t + row[c]);
    [0, 1, 2].map(|c| (value(c) * 255.0 + 0.5) as u8)
}

impl Picture {
    fn filled(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self { width, height, bytes: color.repeat(width * height) }
    }

    /// `image` clipped and sRGB-encoded, in front of grey.
    #[must_use]
    pub fn of_image(image: &Image) -> Self {
        let tone = ToneMap::default();
        let bytes = image.encoded(tone, BACKGROUND);
        Self { width: image.width, height: image.height, bytes }
    }

    /// FLIP's error in magma; grey where nothing was compared.
    #[must_use]
    pub fn of_error(comparison: &Comparison, width: usize) -> Self {
        let grey = ToneMap::default().encode_bytes([BACKGROUND; 3]);
        let pixel = |(&error, &covered): (&f32, &bool)| if covered { magma(error) } else { grey };
        let pixels = comparison.flip_map().iter().zip(comparison.covered());
        let bytes: Vec<u8> = pixels.flat_map(pixel).collect();
        Self { width, height: bytes.len() / 3 / width.max(1), bytes }
    }

    fn put(&mut self, x: usize, y: usize, color: [u8; 3]) {
        let at = 3 * (y * self.width + x);
        self.bytes[at..at + 3].copy_from_slice(&color);
    }

    /// Copy `other` with its top left corner at (x, y), each of its pixels `factor` x `factor`.
    fn paste(&mut self, other: &Self, x: usize, y: usize, factor: usize) {
        for row in 0..other.height * factor {
            for column in 0..other.width * factor {
                let from = 3 * (row / factor * other.width + column / factor);
                let color = [other.bytes[from], other.bytes[from + 1], other.bytes[from + 2]];
                self.put(x + column, y + row, color);
            }
        }
    }

    /// Write `text` with the top left corner of its capitals at (x, y); what does not fit is cut.
    fn write(&mut self, text: &Line, x: usize, y: usize, size: f32, color: [u8; 3]) {
        let (margin, foot) = ((size / 3.0).ceil(), 1.7 * size);
        let across = (text.width(size) + 2.0 * margin) as usize;
        for row in 0..(foot + margin) as usize {
            for column in 0..across {
                let (px, py) = (column as f32 - margin, row as f32 - margin);
                let ink = text.ink(px + 0.5, py + 0.5, size);
                let place = (x as f32 + px, y as f32 + py);
                if ink > 0.0 && place.0 >= 0.0 && place.1 >= 0.0 {
                    self.blend(place.0 as usize, place.1 as usize, color, ink);
                }
            }
        }
    }

    fn blend(&mut self, x: usize, y: usize, color: [u8; 3], share: f32) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            for c in 0..3 {
                let (old, new) = (f32::from(self.bytes[at + c]), f32::from(color[c]));
                self.bytes[at + c] = (old + share * (new - old) + 0.5) as u8;
            }
        }
    }
}

/// target | fit | error of one view, with captions and the error's colour bar.
#[must_use]
pub fn side_by_side(
    name: &str,
    target: &Image,
    fit: &Image,
    comparison: &Comparison,
    scores: Option<Scores>,
) -> Picture {
    let panels =
        [Picture::of_image(target), Picture::of_image(fit), Picture::of_error(comparison, fit.width)];
    let text = scores.map_or_else(
        || "no pixel is fully covered".to_owned(),
        |s| format!("PSNR {:.2} dB    SSIM {:.4}    FLIP {:.4}", s.psnr, s.ssim, s.flip),
    );
    strip(name, &panels, &["target", "fit", "FLIP error"].map(str::to_owned), &text)
}

/// Three pictures of one size in a row, the last an error in magma: a name and a remark above, captions
/// and the error's colour bar below.
#[must_use]
pub fn strip(name: &str, panels: &[Picture; 3], captions: &[String; 3], remark: &str) -> Picture {
    // Tiny images are enlarged so that their pixels can be seen and their captions fit.
    let factor = (224 / panels[0].width.max(1)).clamp(1, 64);
    let (width, height) = (panels[0].width * factor, panels[0].height * factor);
    let panel = width.max(224);
    let size = (panel as f32 / 40.0).clamp(9.0, 22.0);
    let (margin, line) = (size as usize + 4, 3 * size as usize);
    let mut sheet = Picture::filled(3 * panel + 4 * margin, height + 2 * line + margin, PAPER);

    let text = Line::new(remark);
    let (top, right) = (margin, sheet.width - margin - text.width(size) as usize);
    let room = right.saturating_sub(3 * margin) as f32;
    sheet.write(&shortened(name, room, size), margin, top, size, INK);
    sheet.write(&text, right, top, size, FAINT);

    let (above, below) = (line + margin / 2, line + margin / 2 + height + margin / 2);
    for (i, (picture, caption)) in panels.iter().zip(captions).enumerate() {
        let x = margin + i * (panel + margin);
        sheet.paste(picture, x + (panel - width) / 2, above, factor);
        sheet.write(&Line::new(caption), x, below + size as usize / 2, size, INK);
    }
    color_bar(&mut sheet, margin + 2 * (panel + margin), below, panel, size);
    sheet
}

/// The legend of the error: magma from 0 to 1 in the right part of a panel.
fn color_bar(sheet: &mut Picture, x: usize, y: usize, panel: usize, size: f32) {
    let (zero, one, caption) = (Line::new("0"), Line::new("1"), Line::new("FLIP error  "));
    let gap = size as usize / 2;
    let left = x + caption.width(size) as usize + 2 * gap;
    let start = left + zero.width(size) as usize + 2 * gap;
    let end = x + panel - one.width(size) as usize - 2 * gap;
    for column in start..end {
        let color = magma((column - start) as f32 / (end - start - 1).max(1) as f32);
        for row in 0..size as usize {
            sheet.put(column, y + gap + row, color);
        }
    }
    sheet.write(&zero, left, y + gap, size, FAINT);
    sheet.write(&one, end + 2 * gap, y + gap, size, FAINT);
}

/// `text` in a line, cut with dots when it is wider than `room` pixels.
fn shortened(text: &str, room: f32, size: f32) -> Line {
    let whole = Line::new(text);
    let mut kept: Vec<char> = text.chars().take(400).collect();
    if whole.width(size) <= room {
        return whole;
    }
    loop {
        let line = Line::new(&(kept.iter().collect::<String>() + "..."));
        if line.width(size) <= room || kept.pop().is_none() {
            return line;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magma_agrees_with_matplotlib() {
        // Matplotlib's table at 0, 64, 128, 192 and 255 of 255. Over the whole table the polynomial
        // is off by at most 0.0193, and half a byte is 0.002.
        for (index, want) in [
            (0.0, [0.001_462, 0.000_466, 0.013_866]),
            (64.0, [0.316_654, 0.071_690, 0.485_380]),
            (128.0, [0.716_387, 0.214_982, 0.475_290]),
            (192.0, [0.986_700, 0.535_582, 0.382_210]),
            (255.0, [0.987_053, 0.991_438, 0.749_504]),
        ] {
            let got = magma(index / 255.0);
            for c in 0..3 {
                let difference = f32::from(got[c]) / 255.0 - want[c];
                assert!(difference.abs() < 0.0213, "{index}: {got:?}");
            }
        }
    }

    #[test]
    fn any_size_and_any_name_give_a_picture() {
        for (width, height) in [(1, 1), (3, 700), (700, 2), (300, 200)] {
            let image = Image { alpha: vec![1.0; width * height], ..Image::new(width, height) };
            let comparison = Comparison::new(&image, &image, &image.alpha);
            for name in ["", "front", &"long ".repeat(400), "\u{0}\n/ä"] {
                let picture = side_by_side(name, &image, &image, &comparison, comparison.scores());
                assert_eq!(picture.bytes.len(), 3 * picture.width * picture.height);
                assert!(picture.width > 3 * width && picture.height > height);
            }
        }
    }
}

//! Captions in pictures: a small alphabet of strokes, drawn smooth at any size.

/// Strokes of the printable ASCII characters from the space on. A stroke is a run of points `xy`,
/// strokes are parted by `|`; x is 0 to 4, y is 0 (top of capitals) over 2 (top of small letters)
/// and 6 (base line) to 8 (foot of descenders). A dot is a stroke of one point.
#[rustfmt::skip]
const GLYPHS: [&str; 95] = [
    "", "00 04|06", "00 02|20 22", "10 16|30 36|02 42|04 44",
    "41 30 10 01 02 13 33 44 45 36 16 05|20 26", "40 06|00 10 11 01 00|35 45 46 36 35",
    "46 12 11 20 31 32 04 05 16 26 44", "00 02",
    "10 01 05 16", "00 11 15 06", "20 24|01 43|41 03", "21 25|03 43", "15 16 07", "03 33", "06", "40 06",
    "10 30 41 45 36 16 05 01 10", "01 20 26|06 46", "01 10 30 41 42 06 46",
    "01 10 30 41 42 33 13|33 44 45 36 16 05", "36 30 04 44", "40 00 02 32 43 45 36 16 05",
    "41 30 10 01 05 16 36 45 44 33 13 04", "00 40 41 16",
    "10 30 41 42 33 13 02 01 10|13 04 05 16 36 45 44 33", "05 16 36 45 41 30 10 01 02 13 33 42",
    "02|05", "12|15 16 07", "31 03 35", "02 42|04 44", "01 33 05", "01 10 30 41 42 23 24|26",
    "34 32 22 13 14 24 34 45 43 41 30 10 01 05 16 36", "06 02 20 42 46|04 44",
    "00 06 36 45 44 33 03|33 42 41 30 00", "41 30 10 01 05 16 36 45", "00 06 36 45 41 30 00",
    "40 00 06 46|03 33", "40 00 06|03 33", "41 30 10 01 05 16 36 45 43 23", "00 06|40 46|03 43",
    "00 20|10 16|06 26", "30 35 26 16 05", "00 06|40 03 46", "00 06 36", "06 00 23 40 46", "06 00 46 40",
    "10 30 41 45 36 16 05 01 10", "06 00 30 41 42 33 03", "10 30 41 45 36 16 05 01 10|34 46",
    "06 00 30 41 42 33 03|23 46", "41 30 10 01 02 13 33 44 45 36 16 05", "00 40|20 26",
    "00 05 16 36 45 40", "00 26 40", "00 16 23 36 40", "00 46|40 06", "00 23 40|23 26", "00 40 06 46",
    "20 00 06 26", "00 46", "00 20 26 06", "02 20 42", "07 47", "00 11",
    "36 32|33 22 12 03 05 16 26 35", "00 06|03 12 22 33 35 26 16 05", "33 22 12 03 05 16 26 35",
    "30 36|33 22 12 03 05 16 26 35", "04 34 33 22 12 03 05 16 36", "30 20 11 16|02 22",
    "32 37 28 18 07|33 22 12 03 05 16 26 35", "00 06|03 12 22 33 36", "02 06|00", "12 17 08|10",
    "00 06|32 04 36", "00 05 16", "06 02|03 12 23 26|23 32 43 46", "06 02|03 12 22 33 36",
    "12 22 33 35 26 16 05 03 12", "02 08|03 12 22 33 35 26 16 05", "32 38|33 22 12 03 05 16 26 35",
    "02 06|03 12 22", "33 22 12 03 14 24 35 26 16 05", "10 15 26 36|02 32", "02 05 16 26 35|32 36",
    "02 26 42", "02 16 23 36 42", "02 36|32 06", "02 05 16 26 35|32 37 28 18 07", "02 32 06 36",
    "20 11 12 03 14 15 26", "00 07", "00 11 12 23 14 15 06", "03 12 33 42",
];

/// A line segment in a glyph's units.
type Segment = [[f32; 2]; 2];

/// The strokes of a text laid out in a line, in units of a sixth of a capital's height; the origin
/// is the top left corner of the first capital.
pub(super) struct Line {
    segments: Vec<Segment>,
    /// Width in units.
    width: f32,
}

impl Line {
    /// Lay out `text`; characters beyond ASCII show as `?`.
    pub(super) fn new(text: &str) -> Self {
        let (mut segments, mut pen) = (Vec::new(), 0.0_f32);
        for character in text.chars() {
            let index = (u32::from(character).wrapping_sub(32)) as usize;
            let glyph = GLYPHS.get(index).copied().unwrap_or("01 10 30 41 42 23 24|26");
            let mut right = if glyph.is_empty() { 1.0 } else { 0.0_f32 };
            for stroke in glyph.split('|').filter(|s| !s.is_empty()) {
                let points: Vec<[f32; 2]> = stroke
                    .split(' ')
                    .map(|p| [0, 1].map(|i| f32::from(p.as_bytes()[i] - b'0')))
                    .inspect(|p| right = right.max(p[0]))
                    .map(|[x, y]| [pen + x, y])
                    .collect();
                let pairs = points.iter().zip(points.iter().skip(1).chain(points.last()));
                segments.extend(pairs.map(|(&a, &b)| [a, b]));
            }
            pen += right + 2.0;
        }
        Self { segments, width: (pen - 2.0).max(0.0) }
    }

    /// Width in pixels when capitals are `size` pixels high.
    pub(super) fn width(&self, size: f32) -> f32 {
        self.width * size / 6.0
    }

    /// How much ink covers the pixel whose centre is (x, y) pixels from the origin, in [0, 1].
    pub(super) fn ink(&self, x: f32, y: f32, size: f32) -> f32 {
        let unit = size / 6.0;
        let reach = 0.42 * unit.max(1.0) + 0.5;
        let point = [x / unit, y / unit];
        let near =
            |s: &&Segment| (s[0][0].min(s[1][0]) - point[0]).max(point[0] - s[0][0].max(s[1][0])) < 2.0;
        let distance = self.segments.iter().filter(near).map(|s| distance(point, s)).fold(f32::MAX, f32::min);
        (reach - distance * unit).clamp(0.0, 1.0)
    }
}

/// The distance of a point from a segment.
fn distance(p: [f32; 2], [a, b]: &Segment) -> f32 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length = along[0] * along[0] + along[1] * along[1];
    let t = if length > 0.0 { ((along[0] * to[0] + along[1] * to[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - t * along[0]).hypot(to[1] - t * along[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_has_strokes_within_the_grid() {
        for character in ' '..='~' {
            let line = Line::new(&character.to_string());
            assert_eq!(line.segments.is_empty(), character == ' ', "{character:?}");
            for [x, y] in line.segments.iter().flatten() {
                assert!((0.0..=4.0).contains(x) && (0.0..=8.0).contains(y), "{character:?}");
            }
        }
        assert_eq!(Line::new("é\n").segments.len(), 2 * Line::new("?").segments.len());
    }
}

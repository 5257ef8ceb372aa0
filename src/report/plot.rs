//! Scatter plots as inline SVG: one measure against another, and the front of the best.

use std::fmt::Write as _;

use super::charts::{linear_ticks, log_range, log_ticks, tick_label};
use super::page::escape;

/// A point of a [`Plot`].
#[derive(Clone, Debug)]
pub struct Dot {
    /// Along x.
    pub x: f64,
    /// Along y; drawn on a line of its own at the foot where a logarithmic axis has no place for 0.
    pub y: f64,
    /// Written beside it; may be empty.
    pub label: String,
    /// Shown when pointed at: the values in words.
    pub title: String,
    /// Which colour, from 0.
    pub series: usize,
    /// Whether it is on the front of the best: drawn full.
    pub front: bool,
}

/// A scatter plot.
#[derive(Clone, Debug)]
pub struct Plot<'a> {
    /// What is drawn along x.
    pub x: &'a str,
    /// What is drawn along y.
    pub y: &'a str,
    /// Whether x is logarithmic; y always is.
    pub log_x: bool,
    /// The points.
    pub dots: Vec<Dot>,
    /// The names of the colours; none for a single one.
    pub series: Vec<String>,
    /// Which points are joined.
    pub joined: Joined,
}

/// Which points of a [`Plot`] are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joined {
    /// None.
    No,
    /// The front's: what is reached at a given x stays reached beyond it.
    Front,
    /// Those of a colour, in their order: its curve.
    Series,
}

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 430.0;
const LEFT: f64 = 84.0;
const TOP: f64 = 18.0;
const RIGHT: f64 = WIDTH - 28.0;
const BOTTOM: f64 = HEIGHT - 52.0;
/// Colours that the style sheet knows.
const COLOURS: usize = 10;

/// From values to places, with round ticks.
struct Axis {
    ticks: Vec<f64>,
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    fn new(values: &[f64], log: bool) -> Self {
        if log {
            let (low, high) = log_range(values);
            return Self { ticks: log_ticks(low, high), low, high, log };
        }
        let (ticks, high) =
            linear_ticks(values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max));
        Self { ticks, low: 0.0, high, log }
    }

    /// The share of the axis' length, 0 to 1; what a logarithmic axis does not hold is at its foot.
    fn share(&self, value: f64) -> f64 {
        let at = match self.log {
            true if value > 0.0 => value.log10(),
            true => self.low,
            false => value,
        };
        ((at - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }
}

impl Plot<'_> {
    /// The plot as SVG, as it stands in a page (colours by the page's style sheet).
    #[must_use]
    pub fn svg(&self) -> String {
        self.drawn("")
    }

    /// The plot as an SVG file of its own, with its colours in it.
    #[must_use]
    pub fn file(&self) -> String {
        let style = concat!("<style>", include_str!("plot.css"), "</style>");
        let back = format!("<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" class=\"paper\"/>");
        self.drawn(&format!("{style}{back}"))
    }

    fn drawn(&self, before: &str) -> String {
        let zeros = self.dots.iter().any(|dot| dot.y <= 0.0);
        // Points of 0 have a line of their own below a logarithmic axis.
        let foot = if zeros { BOTTOM - 26.0 } else { BOTTOM };
        let xs = Axis::new(&self.dots.iter().map(|dot| dot.x).collect::<Vec<_>>(), self.log_x);
        let ys = Axis::new(&self.dots.iter().map(|dot| dot.y).collect::<Vec<_>>(), true);
        let x_at = |x: f64| LEFT + (RIGHT - LEFT) * xs.share(x);
        let y_at = |y: f64| if y > 0.0 { foot - (foot - TOP) * ys.share(y) } else { BOTTOM - 10.0 };
        let mut svg = format!(
            "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{} against {}\">{before}",
            escape(self.y),
            escape(self.x)
        );
        for &tick in &ys.ticks {
            let y = y_at(tick);
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 8.0,
                y + 4.0,
                tick_label(tick)
            );
        }
        if zeros {
            let y = BOTTOM - 10.0;
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">0</text>",
                LEFT - 8.0,
                y + 4.0
            );
        }
        for &tick in &xs.ticks {
            let x = x_at(tick);
            let _ = write!(
                svg,
                "<path class=\"axis\" d=\"M{x:.1} {BOTTOM}v5\"/><text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                BOTTOM + 20.0,
                tick_label(tick)
            );
        }
        let _ = write!(svg, "<path class=\"axis\" d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\"/>");
        let _ = write!(
            svg,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            0.5 * (LEFT + RIGHT),
            HEIGHT - 8.0,
            escape(self.x)
        );
        let _ = write!(
            svg,
            "<text transform=\"translate(15 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            0.5 * (TOP + BOTTOM),
            escape(self.y)
        );
        match self.joined {
            Joined::No => {}
            Joined::Front => self.draw_front(&mut svg, &x_at, &y_at),
            Joined::Series => self.draw_curves(&mut svg, &x_at, &y_at),
        }
        self.draw_dots(&mut svg, &x_at, &y_at);
        svg + "</svg>"
    }

    /// A curve for each colour.
    fn draw_curves(&self, svg: &mut String, x_at: &dyn Fn(f64) -> f64, y_at: &dyn Fn(f64) -> f64) {
        for series in 0..self.series.len() {
            let of = self.dots.iter().filter(|dot| dot.series == series);
            let points: Vec<String> =
                of.map(|dot| format!("{:.1} {:.1}", x_at(dot.x), y_at(dot.y))).collect();
            if points.len() > 1 {
                let colour = series % COLOURS;
                let _ = write!(svg, "<path class=\"trace c{colour}\" d=\"M{}\"/>", points.join("L"));
            }
        }
    }

    /// The front as a staircase.
    fn draw_front(&self, svg: &mut String, x_at: &dyn Fn(f64) -> f64, y_at: &dyn Fn(f64) -> f64) {
        let mut front: Vec<&Dot> = self.dots.iter().filter(|dot| dot.front).collect();
        front.sort_by(|a, b| a.x.total_cmp(&b.x));
        let mut path = String::new();
        for (i, dot) in front.iter().enumerate() {
            let (x, y) = (x_at(dot.x), y_at(dot.y));
            let _ = if i == 0 { write!(path, "M{x:.1} {y:.1}") } else { write!(path, "H{x:.1}V{y:.1}") };
        }
        if front.len() > 1 {
            let _ = write!(svg, "<path class=\"front\" d=\"{path}\"/>");
        }
    }

    /// What labels should not cover: dots, and points along curves.
    fn marks(&self, x_at: &dyn Fn(f64) -> f64, y_at: &dyn Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let at = |dot: &Dot| (x_at(dot.x), y_at(dot.y));
        let mut marks: Vec<(f64, f64)> = self.dots.iter().map(at).collect();
        if self.joined == Joined::Series {
            for pair in self.dots.windows(2).filter(|pair| pair[0].series == pair[1].series) {
                let (a, b) = (at(&pair[0]), at(&pair[1]));
                // Closer together than a letter is high.
                let steps = ((b.0 - a.0).hypot(b.1 - a.1) / 8.0).ceil().clamp(1.0, 200.0);
                let along = |k: usize| {
                    let share = k as f64 / steps;
                    (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
                };
                marks.extend((1..steps as usize).map(along));
            }
        }
        marks
    }

    fn draw_dots(&self, svg: &mut String, x_at: &dyn Fn(f64) -> f64, y_at: &dyn Fn(f64) -> f64) {
        let mut written: Vec<(f64, f64, f64)> = Vec::new();
        let marks = self.marks(x_at, y_at);
        // On a curve dots are there to be pointed at.
        let (kind, radius) = if self.joined == Joined::Series { ("point", 1.5) } else { ("dot", 5.0) };
        for dot in &self.dots {
            let (x, y) = (x_at(dot.x), y_at(dot.y));
            let full = if dot.front { " on" } else { "" };
            let _ = write!(
                svg,
                "<circle class=\"{kind} c{}{full}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"><title>{}</title></circle>",
                dot.series % COLOURS,
                escape(&dot.title)
            );
            if let Some((tx, ty, anchor)) = place(&mut written, &marks, x, y, dot.label.chars().count()) {
                let _ = write!(
                    svg,
                    "<text class=\"label\" x=\"{tx:.1}\" y=\"{ty:.1}\" text-anchor=\"{anchor}\">{}</text>",
                    escape(&dot.label)
                );
            }
        }
    }

    /// The names of the colours, to stand below the plot.
    #[must_use]
    pub fn legend(&self) -> String {
        let entry = |(i, name): (usize, &String)| {
            format!("<li><i class=\"c{}\"></i>{}</li>", i % COLOURS, escape(name))
        };
        match self.series.len() {
            0 | 1 => String::new(),
            _ => format!(
                "<ul class=\"legend\">{}</ul>",
                self.series.iter().enumerate().map(entry).collect::<String>()
            ),
        }
    }
}

/// A place for a label of `letters` letters beside (x, y) that covers no label before it and, if there is one, none of
/// the `marks`; none if there is no such place.
fn place(
    written: &mut Vec<(f64, f64, f64)>,
    marks: &[(f64, f64)],
    x: f64,
    y: f64,
    letters: usize,
) -> Option<(f64, f64, &'static str)> {
    // A letter of the style sheet's size is about 6.4 wide, a line 14 high.
    let width = 6.4 * letters as f64;
    // Above first: the front's line leaves a dot to the right and meets it from above.
    let places = [
        (8.0, -8.0, "start"),
        (8.0, 4.0, "start"),
        (-8.0, 4.0, "end"),
        (0.0, -9.0, "middle"),
        (0.0, 18.0, "middle"),
        (8.0, 16.0, "start"),
        (-8.0, -8.0, "end"),
        (-8.0, 16.0, "end"),
    ];
    let free = |&(dx, dy, anchor): &(f64, f64, &'static str)| {
        let left = match anchor {
            "start" => x + dx,
            "end" => x + dx - width,
            _ => x - 0.5 * width,
        };
        let line = y + dy;
        let apart =
            |&(l, t, w): &(f64, f64, f64)| left + width < l || l + w < left || (line - t).abs() > 13.0;
        let inside = left > LEFT && left + width < WIDTH && line > 10.0 && line < BOTTOM;
        let covered = |&&(mx, my): &&(f64, f64)| {
            (left - 2.0..left + width + 2.0).contains(&mx) && (line - 12.0..line + 4.0).contains(&my)
        };
        let hidden = marks.iter().filter(covered).count();
        (inside && written.iter().all(apart)).then_some((hidden, left, (x + dx, line, anchor)))
    };
    if letters == 0 {
        return None;
    }
    // The first of those that cover least.
    let (_, left, place) = places.iter().filter_map(free).min_by_key(|(hidden, ..)| *hidden)?;
    written.push((left, place.1, width));
    Some(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(x: f64, y: f64, front: bool) -> Dot {
        Dot { x, y, label: "a&b".to_owned(), title: format!("{x} {y}"), series: 0, front }
    }

    #[test]
    fn curves_are_lines_whose_labels_cover_neither_each_other_nor_the_curves() {
        let curve = |series: usize| {
            let dot = move |i: u32| Dot {
                x: f64::from(i),
                y: f64::from(10 - i) * (1.0 + 0.01 * series as f64),
                label: if i == 5 { "solver".to_owned() } else { String::new() },
                title: String::new(),
                series,
                front: true,
            };
            (1..=5).map(dot)
        };
        let series = vec!["a".to_owned(), "b".to_owned()];
        let dots: Vec<Dot> = (0..2).flat_map(curve).collect();
        let plot = Plot { x: "s", y: "loss", log_x: true, dots, series, joined: Joined::Series };
        let svg = plot.svg();
        assert_eq!(svg.matches("<path class=\"trace c").count(), 2);
        let labels: Vec<&str> = svg.split("<text class=\"label\"").skip(1).collect();
        assert_eq!(labels.len(), 2, "{svg}");
        let line = |label: &str| {
            let y = label.split("y=\"").nth(1).unwrap().split('"').next().unwrap();
            y.parse::<f64>().unwrap()
        };
        let right = |label: &str| label.contains("\"start\"");
        assert!(right(labels[0]) != right(labels[1]) || (line(labels[0]) - line(labels[1])).abs() > 13.0);
    }

    #[test]
    fn every_point_is_drawn_with_its_values_and_nothing_is_nan() {
        for dots in [
            vec![],
            vec![dot(0.0, 0.0, true)],
            vec![dot(1.0, 1e-9, true), dot(2.0, 0.0, true), dot(f64::NAN, 3.0, false)],
        ] {
            let plot = Plot {
                x: "ms",
                y: "error",
                log_x: true,
                dots,
                series: vec!["a".to_owned(), "b".to_owned()],
                joined: Joined::Front,
            };
            for svg in [plot.svg(), plot.file()] {
                assert_eq!(svg.matches("<circle").count(), plot.dots.len());
                assert_eq!(svg.matches("<title>").count(), plot.dots.len());
                assert!(!svg.replace("<title>NaN 3</title>", "").contains("NaN"), "{svg}");
            }
            assert_eq!(plot.legend().matches("<li>").count(), 2);
        }
    }
}

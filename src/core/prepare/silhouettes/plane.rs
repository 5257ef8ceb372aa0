//! How much of each pixel of an image is covered.

use crate::samples::ViewSamples;
use crate::scene::view::View;

/// Coverage of an image's pixels, each in [0, 1], row by row from the top. Pixels that a mask leaves out are covered
/// nowhere.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) cover: Vec<f32>,
}

/// How an image may have been turned by mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turned {
    Mirrored,
    UpsideDown,
    HalfTurn,
}

impl Turned {
    pub(super) const ALL: [Self; 3] = [Self::Mirrored, Self::UpsideDown, Self::HalfTurn];

    /// The words after "the target".
    pub(super) fn told(self) -> &'static str {
        match self {
            Self::Mirrored => "mirrored",
            Self::UpsideDown => "upside down",
            Self::HalfTurn => "turned by 180 degrees",
        }
    }
}

impl Plane {
    /// Where the samples of a view found the mesh.
    pub(super) fn of_mesh(view: &View, samples: &ViewSamples) -> Self {
        let mut plane = Self::empty(view.camera.width as usize, view.camera.height as usize);
        for (&pixel, &coverage) in samples.pixel.iter().zip(&samples.coverage) {
            if let Some(cover) = plane.cover.get_mut(pixel as usize) {
                *cover = coverage;
            }
        }
        for part in &samples.plain {
            if let Some(cover) = plane.cover.get_mut(part.pixel as usize) {
                *cover += part.share;
            }
        }
        plane.masked(view)
    }

    /// A target's alpha; `None` where it has none, or one that is the same everywhere.
    pub(super) fn of_target(view: &View) -> Option<Self> {
        let alpha = view.target.as_ref()?.alpha.as_ref()?;
        let first = *alpha.first()?;
        if alpha.iter().all(|&a| a == first) {
            return None;
        }
        let mut plane = Self::empty(view.camera.width as usize, view.camera.height as usize);
        if alpha.len() != plane.cover.len() {
            return None;
        }
        plane.cover.copy_from_slice(alpha);
        Some(plane.masked(view))
    }

    fn empty(width: usize, height: usize) -> Self {
        Self { width, height, cover: vec![0.0; width * height] }
    }

    fn masked(mut self, view: &View) -> Self {
        if let Some(mask) = view.target.as_ref().and_then(|target| target.mask.as_ref()) {
            self.cover.iter_mut().zip(mask).for_each(|(cover, mask)| *cover *= mask);
        }
        self
    }

    /// What both cover over what either covers; of planes of one size. 1 where neither covers anything.
    pub(super) fn overlap(&self, other: &Self) -> f64 {
        let (mut both, mut either) = (0.0, 0.0);
        for (&a, &b) in self.cover.iter().zip(&other.cover) {
            both += f64::from(a.min(b));
            either += f64::from(a.max(b));
        }
        if either > 0.0 { both / either } else { 1.0 }
    }

    /// How many pixels lie beside its edge, for each that it covers; 0 where it covers none.
    pub(super) fn edge(&self) -> f64 {
        let inside = |x: usize, y: usize| self.cover[y * self.width + x] >= 0.5;
        let mut crossed = 0_usize;
        for (x, y) in (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y))) {
            crossed += usize::from(x > 0 && inside(x, y) != inside(x - 1, y));
            crossed += usize::from(y > 0 && inside(x, y) != inside(x, y - 1));
        }
        let area: f64 = self.cover.iter().map(|&cover| f64::from(cover)).sum();
        if area > 0.0 { crossed as f64 / area } else { 0.0 }
    }

    /// The same, turned.
    pub(super) fn turned(&self, how: Turned) -> Self {
        let mut turned = self.clone();
        if matches!(how, Turned::UpsideDown | Turned::HalfTurn) {
            let rows = self.cover.chunks_exact(self.width).rev();
            turned.cover = rows.flatten().copied().collect();
        }
        if matches!(how, Turned::Mirrored | Turned::HalfTurn) {
            turned.cover.chunks_exact_mut(self.width).for_each(<[f32]>::reverse);
        }
        turned
    }

    /// The mean of blocks of `side` pixels; what is left over at the right and below belongs to smaller ones.
    pub(super) fn reduced(&self, side: usize) -> Self {
        let (width, height) = (self.width.div_ceil(side), self.height.div_ceil(side));
        let mut reduced = Self::empty(width, height);
        for (y, row) in self.cover.chunks_exact(self.width).enumerate() {
            for (x, &cover) in row.iter().enumerate() {
                reduced.cover[y / side * width + x / side] += cover / (side * side) as f32;
            }
        }
        reduced
    }

    /// Area, in pixels, and centre, in pixels from the top left corner; `None` where nothing is covered.
    pub(super) fn moments(&self) -> Option<(f64, [f64; 2])> {
        let (mut area, mut x_sum, mut y_sum) = (0.0, 0.0, 0.0);
        for (y, row) in self.cover.chunks_exact(self.width).enumerate() {
            for (x, &cover) in row.iter().enumerate() {
                let cover = f64::from(cover);
                area += cover;
                x_sum += cover * (x as f64 + 0.5);
                y_sum += cover * (y as f64 + 0.5);
            }
        }
        (area > 0.0).then(|| (area, [x_sum / area, y_sum / area]))
    }

    /// Coverage at a point, in pixels from the top left corner: bilinear between the pixels' centres, none outside.
    pub(super) fn at(&self, x: f64, y: f64) -> f32 {
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = ((x - left) as f32, (y - top) as f32);
        let pixel = |dx: f64, dy: f64| {
            let (x, y) = (left + dx, top + dy);
            let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
            if inside { self.cover[y as usize * self.width + x as usize] } else { 0.0 }
        };
        let upper = pixel(0.0, 0.0) * (1.0 - fx) + pixel(1.0, 0.0) * fx;
        let lower = pixel(0.0, 1.0) * (1.0 - fx) + pixel(1.0, 1.0) * fx;
        upper * (1.0 - fy) + lower * fy
    }
}

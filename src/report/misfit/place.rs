//! Places of the images: by how the surface lies there, by view, by channel.

use std::ops::Range;

use crate::ViewEvidence;
use crate::metrics::COVERED;

/// In a crease less than this share of the hemisphere is open.
const CREASED: f32 = 0.6;
/// |N.V| at the rim is less: normals more than 70 degrees from the eye.
const RIM: f32 = 0.342;
/// |N.V| of what faces the camera is greater: normals within 30 degrees.
const FACING: f32 = 0.866;
/// The light has sides where the diffuse light of the third that has most of it is this many times that of the third
/// that has least.
const SIDED: f32 = 1.25;
/// Highlights are the tenth of the pixels that mirrors the most light, where that is this many times the median's.
const BRIGHT: f32 = 2.0;

/// Where residuals lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Everywhere,
    Creases,
    Rim,
    Facing,
    LightSide,
    ShadowSide,
    Highlights,
    /// The view of that number.
    View(usize),
    /// The channel of that number, everywhere.
    Channel(usize),
}

impl Place {
    /// Whether a pixel of view `index` is there.
    pub(super) fn holds(self, bounds: &Bounds, index: usize, view: &ViewEvidence, at: usize) -> bool {
        let below = |plane: &[f32], most: f32| plane.get(at).is_some_and(|&x| x < most);
        let above = |plane: &[f32], least: f32| plane.get(at).is_some_and(|&x| x > least);
        let places = &view.places;
        match self {
            Self::Everywhere | Self::Channel(_) => true,
            Self::View(own) => own == index,
            Self::Creases => below(&places.open, CREASED),
            Self::Rim => below(&places.facing, RIM),
            Self::Facing => above(&places.facing, FACING),
            Self::ShadowSide => bounds.sides.is_some_and(|[shadow, _]| below(&places.lit, shadow)),
            Self::LightSide => bounds.sides.is_some_and(|[_, light]| above(&places.lit, light)),
            Self::Highlights => bounds.bright.is_some_and(|bright| above(&places.mirrored, bright)),
        }
    }

    pub(super) fn channels(self) -> Range<usize> {
        match self {
            Self::Channel(c) => c..c + 1,
            _ => 0..3,
        }
    }

    pub(super) fn words(self, views: &[ViewEvidence]) -> String {
        match self {
            Self::Everywhere => "overall".to_owned(),
            Self::Creases => "in creases".to_owned(),
            Self::Rim => "at the rim".to_owned(),
            Self::Facing => "where it faces the camera".to_owned(),
            Self::LightSide => "on the light side".to_owned(),
            Self::ShadowSide => "on the shadow side".to_owned(),
            Self::Highlights => "in highlights".to_owned(),
            Self::View(index) => format!("in view {}", views[index].name),
            Self::Channel(c) => format!("in {}", ["red", "green", "blue"][c]),
        }
    }
}

/// Where sides and highlights begin, over all views.
#[derive(Debug)]
pub(super) struct Bounds {
    /// Diffuse light that the third has at most that has least of it, and at least the third that has most.
    sides: Option<[f32; 2]>,
    /// The least mirrored light of a highlight.
    bright: Option<f32>,
}

impl Bounds {
    pub(super) fn of(views: &[ViewEvidence]) -> Self {
        let sorted = |plane: fn(&ViewEvidence) -> &[f32]| -> Vec<f32> {
            let compared = views.iter().flat_map(|view| plane(view).iter().zip(&view.coverage));
            let mut values: Vec<f32> =
                compared.filter(|(x, c)| **c >= COVERED && x.is_finite()).map(|(x, _)| *x).collect();
            values.sort_unstable_by(f32::total_cmp);
            values
        };
        // The number that `share` of the sorted ones lie below.
        let quantile =
            |sorted: &[f32], share: f64| sorted.get((share * sorted.len() as f64) as usize).copied();
        let lit = sorted(|view| &view.places.lit);
        let sides = quantile(&lit, 1.0 / 3.0).zip(quantile(&lit, 2.0 / 3.0));
        let mirrored = sorted(|view| &view.places.mirrored);
        let bright = quantile(&mirrored, 0.9).zip(quantile(&mirrored, 0.5));
        Self {
            sides: sides
                .filter(|(shadow, light)| *light >= SIDED * shadow)
                .map(|(shadow, light)| [shadow, light]),
            bright: bright.filter(|(bright, median)| *bright >= BRIGHT * median).map(|(bright, _)| bright),
        }
    }
}

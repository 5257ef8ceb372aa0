//! How images are shown: which panes, side by side or one over another, how bright, how large.

use serde::{Deserialize, Serialize};

use crate::model::terms::TermName;
use crate::paint::Slot;
use crate::render::tonemap::Operator;

/// What a pane shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pane {
    /// What the fit is to match.
    Target,
    /// The image of the sliders.
    Now,
    /// The image that the sliders began with.
    Start,
    /// The image of the last fit.
    Fit,
    /// The image of the run that is compared.
    Other,
    /// How far an image is from the target.
    Error,
    /// One term of the image of the sliders.
    Term(TermName),
}

impl Pane {
    /// Those that are of no term.
    pub const OFFERED: [Self; 6] =
        [Self::Target, Self::Now, Self::Start, Self::Fit, Self::Other, Self::Error];

    /// Every pane.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::OFFERED.into_iter().chain(TermName::all().map(Self::Term))
    }
}

/// How errors are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ErrorKind {
    /// What an eye notices (Andersson et al. 2020).
    #[default]
    Flip,
    /// Mean of the channels, the image less the target.
    Signed,
    /// The size of that as a share of the target.
    Relative,
}

impl ErrorKind {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Flip, Self::Signed, Self::Relative];

    /// The name in the window.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flip => "FLIP",
            Self::Signed => "signed",
            Self::Relative => "relative",
        }
    }
}

/// How panes share the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Layout {
    /// Beside one another.
    #[default]
    Side,
    /// The first to the left of a line, the second to its right.
    Wipe,
    /// One at a time: the first, or the second.
    Flip,
}

impl Layout {
    /// Every layout, with its name in the window.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Side, "side by side"), (Self::Wipe, "wipe"), (Self::Flip, "flip")];
}

/// How it is all shown; kept from window to window but for the panes.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Look {
    /// In stops.
    pub exposure: f32,
    /// By its name.
    operator: String,
    /// Luminance as a colour.
    pub false_colour: bool,
    /// Which error.
    pub error: ErrorKind,
    /// Of which image.
    pub error_of: Slot,
    /// How panes share the window.
    pub layout: Layout,
    /// Where the line of a wipe is, from 0 to 1.
    pub wipe: f32,
    /// Which panes, in their order.
    #[serde(skip)]
    pub panes: Vec<Pane>,
    /// In the layout `Flip`: whether the second is shown.
    #[serde(skip)]
    pub flipped: bool,
    /// Points a pixel; `None`: as large as fits.
    #[serde(skip)]
    pub zoom: Option<f32>,
    /// The place of the image in the middle of a pane, as shares of its sides.
    #[serde(skip)]
    pub middle: [f32; 2],
}

impl Default for Look {
    fn default() -> Self {
        Self {
            exposure: 0.0,
            operator: Operator::default().name().to_owned(),
            false_colour: false,
            error: ErrorKind::default(),
            error_of: Slot::default(),
            layout: Layout::default(),
            wipe: 0.5,
            panes: vec![Pane::Target, Pane::Now, Pane::Error],
            flipped: false,
            zoom: None,
            middle: [0.5; 2],
        }
    }
}

impl Look {
    /// The tone operator.
    #[must_use]
    pub fn operator(&self) -> Operator {
        Operator::from_name(&self.operator).unwrap_or_default()
    }

    /// Choose another.
    pub fn set_operator(&mut self, operator: Operator) {
        operator.name().clone_into(&mut self.operator);
    }

    /// Take all of another look but its panes.
    pub fn take(&mut self, other: Self) {
        let panes = std::mem::take(&mut self.panes);
        *self = Self { panes, ..other };
    }

    /// Show a pane after the others, or take it away.
    pub fn set_pane(&mut self, pane: Pane, shown: bool) {
        self.panes.retain(|other| *other != pane);
        if shown {
            self.panes.push(pane);
        }
    }

    /// The whole image again.
    pub fn reset_zoom(&mut self) {
        (self.zoom, self.middle) = (None, [0.5; 2]);
    }
}

//! What is the same for every view of a fit.

use crate::engine::Unknown;
use crate::engine::view::ObservedView;
use crate::model::evaluate::Setup;
use crate::model::params::Param;
use crate::samples::surface_records::Places;
use crate::shader::facts::FaceSizes;

/// What is the same for every view of a fit.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) setup: Setup,
    pub(super) unknowns: Vec<Unknown>,
    /// Colours, and the haze where it is compared.
    pub(super) channels: usize,
    pub(super) faces: FaceSizes,
    /// Where a sample's numbers stand.
    pub(super) places: Places,
    /// Whether what no free parameter moves is kept.
    pub(super) keep: bool,
}

impl Fitted {
    /// Of views whose samples have the same layout.
    pub(super) fn new(setup: Setup, unknowns: Vec<Unknown>, views: &[ObservedView]) -> Self {
        let channels = if views.iter().any(ObservedView::compares_alpha) { 4 } else { 3 };
        let places = views
            .iter()
            // One that holds nothing says nothing of where numbers stand.
            .find(|view| view.samples.groups() > 0)
            .map(|view| *view.samples.surface.places())
            .unwrap_or_default();
        Self { setup, unknowns, channels, faces: FaceSizes::default(), places, keep: true }
    }

    /// The parameters that are free and that an effect asks for, each once.
    pub(super) fn free(&self) -> Vec<Param> {
        let mut free = Vec::new();
        for unknown in &self.unknowns {
            let Unknown::Param(column) = unknown else { continue };
            if column.param.asked_for(self.setup.effects) && !free.contains(&column.param) {
                free.push(column.param);
            }
        }
        free
    }

    pub(super) fn gains(&self) -> bool {
        self.unknowns.iter().any(|unknown| matches!(unknown, Unknown::Gain(..)))
    }
}

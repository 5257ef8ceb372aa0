//! What an engine is to evaluate.

use std::sync::Arc;

use super::Unknown;
use super::view::ObservedView;
use crate::bake::Illumination;
use crate::model::evaluate::Setup;
use crate::scene::Loss;

/// What is fitted. Cubes and views are shared with whoever has them: a clone copies neither.
#[derive(Clone, Debug)]
pub struct Task {
    /// The switches of the model.
    pub setup: Setup,
    /// The cubes that its effects ask for.
    pub illumination: Arc<Illumination>,
    /// Samples and targets.
    pub views: Arc<[ObservedView]>,
    /// What is minimised.
    pub loss: Loss,
    /// What is free.
    pub unknowns: Vec<Unknown>,
}

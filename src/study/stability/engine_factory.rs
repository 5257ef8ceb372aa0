//! What an engine is to the study.

use crate::engine::{Objective, Point, Task};

/// Something that makes engines. An engine that has one is studied like every other.
pub trait EngineFactory {
    /// The engine's name in tables.
    fn name(&self) -> String;
    /// By how much more than f32's correctly rounded operations its own may be off.
    fn slack(&self) -> f64 {
        1.0
    }
    /// Make an engine for passes at `point`, and do something with it.
    ///
    /// # Errors
    /// When it cannot be made, in words.
    fn with(&self, task: &Task, point: &Point, then: &mut dyn FnMut(&dyn Objective)) -> Result<(), String>;
    /// The image of each slot of the first view, where the engine can show it.
    ///
    /// # Errors
    /// As [`Self::with`].
    fn image(&self, task: &Task, point: &Point) -> Result<Vec<Vec<f32>>, String>;
}

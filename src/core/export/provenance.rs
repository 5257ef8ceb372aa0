//! Where exported constants come from.

use crate::model::params::Param;

/// Where constants come from, as an export tells it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// The scene's file, where it is known.
    pub scene: Option<String>,
    /// The parameter file.
    pub params: String,
    /// The loss that was minimised, and its value at the end.
    pub loss: Option<(String, f64)>,
    /// What was set instead of the file's values: a name and a value each.
    pub set: Vec<String>,
    /// Standard errors of fitted parameters, one or three of each.
    pub std_errors: Vec<(Param, Vec<f64>)>,
}

impl Provenance {
    /// One fact a line.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "Skin shading constants, exported by skinfit {} from {}.",
            env!("CARGO_PKG_VERSION"),
            one_line(&self.params)
        )];
        lines.extend(self.scene.as_ref().map(|scene| format!("Scene: {}", one_line(scene))));
        if let Some((name, value)) = &self.loss {
            lines.push(format!("Loss: {name}, {value:.6e} at the end of the fit"));
        }
        if !self.set.is_empty() {
            lines.push(format!("Set for this export: {}", self.set.join(", ")));
        }
        for (param, errors) in &self.std_errors {
            let errors: Vec<String> = errors.iter().map(|e| format!("{e:.2e}")).collect();
            lines.push(format!("Standard error of {}: {}", param.name(), errors.join(", ")));
        }
        lines
    }
}

/// A line break in a path must not end a comment.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

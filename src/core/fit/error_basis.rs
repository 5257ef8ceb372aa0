//! What standard errors rest on.

use super::sandwich::Blocks;

/// What standard errors rest on.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case", tag = "basis")]
pub enum ErrorBasis {
    /// Residuals are taken to be independent: nobody knows which of them are neighbours.
    Independent,
    /// Roundings are all that is left of the residuals.
    Rounding,
    /// Squares of pixels are.
    Blocks(Blocks),
}

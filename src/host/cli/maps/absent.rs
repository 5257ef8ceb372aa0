//! What stands in where the program is built without the fit of maps.

use std::path::Path;

use super::{MapArguments, MapRun, MapsLeft, Refusal};
use crate::prepare::Observed;

/// Nothing finds any.
pub(in crate::cli) enum MapsFound {}

impl MapArguments {
    /// The views as they are: [`MapArguments::check`] has refused to fit maps.
    #[allow(clippy::unused_self, clippy::unnecessary_wraps, reason = "as where maps are fitted")]
    pub(in crate::cli) fn fit(
        &self,
        observed: Observed,
        _: &MapRun<'_>,
    ) -> Result<(Observed, Option<MapsFound>), Refusal> {
        Ok((observed, None))
    }
}

impl MapsFound {
    pub(in crate::cli) fn conclude(&self, _: &Path, _: bool) -> Result<MapsLeft, Refusal> {
        match *self {}
    }
}

//! What stands in for the GPU engine in a program that was built without it.

use super::{Chosen, FitEngineArguments, ObservedView, Prepared, Reasons, Refusal};

impl FitEngineArguments {
    pub(super) fn wants_gpu(&self, _observed: &[ObservedView]) -> (bool, Option<String>) {
        let asked = self.engine == "gpu" || self.adapter.is_some() || self.device_memory.is_some();
        (asked, (!asked).then(|| "this skinfit was built without its GPU engine".to_owned()))
    }

    pub(super) fn with_gpu<T>(
        &self,
        _prepared: &Prepared,
        _observed: Vec<ObservedView>,
        _reasons: Reasons,
        _then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        Err(without())
    }

    pub(super) fn with_own_samples<T>(
        &self,
        _prepared: &Prepared,
        _then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        Err(without())
    }
}

fn without() -> Refusal {
    Refusal::new(
        "this skinfit was built without its GPU engine. Build it with the feature `gpu` (a default one), or fit \
         with --engine cpu.",
    )
}

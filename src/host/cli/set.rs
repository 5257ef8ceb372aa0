//! `--set NAME=VALUE`: a parameter's value, over what the scene and a parameter file say.

use super::{Refusal, tell};
use crate::model::effects::Effects;
use crate::model::params::{Param, Params};
use crate::scene::Assignment;

/// Values of parameters.
#[derive(clap::Args)]
pub(super) struct SetArguments {
    /// Set a parameter, over what scene and parameter file say: rim_exponent=3, or by channel
    /// hilite=0.7,0.6,0.5. May be given several times; `skinfit params` lists names and bounds.
    #[arg(long, value_name = "NAME=VALUE", allow_hyphen_values = true)]
    set: Vec<Assignment>,
}

impl SetArguments {
    /// The values, each parameter's once.
    pub(super) fn values(&self) -> Result<&[Assignment], Refusal> {
        for (i, Assignment { param, .. }) in self.set.iter().enumerate() {
            if self.set[..i].iter().any(|earlier| earlier.param == *param) {
                let name = param.name();
                return Err(Refusal::new(format!("--set gives {name} twice. Give it once.")));
            }
        }
        Ok(&self.set)
    }

    /// The values where they are not checked any more.
    pub(super) fn checked(&self) -> &[Assignment] {
        &self.set
    }

    /// Set them.
    pub(super) fn apply(&self, params: &mut Params) {
        self.set.iter().for_each(|assignment| assignment.apply(params));
    }

    /// The parameters that are set.
    pub(super) fn params(&self) -> Vec<Param> {
        self.set.iter().map(|assignment| assignment.param).collect()
    }

    /// The values in words.
    pub(super) fn words(&self) -> Vec<String> {
        self.set.iter().map(ToString::to_string).collect()
    }

    /// Say which of them no effect asks for.
    pub(super) fn tell_idle(&self, effects: Effects) {
        for assignment in self.set.iter().filter(|assignment| !assignment.param.asked_for(effects)) {
            tell(&format!(
                "warning: --set {assignment}: no enabled effect asks for it, so it changes nothing."
            ));
        }
    }
}

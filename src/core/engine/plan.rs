//! What a pass computes: worked out once from the effects and the unknowns, so that the kernel
//! touches only enabled terms and only the columns of free parameters.

use super::{Unknown, window};
use crate::model::effects::{Effect, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Channels, Column, Param, TABLE};
use crate::model::terms::{LookupParam, Wanted};

/// The columns of one output channel.
#[derive(Clone, Debug)]
pub(super) struct ChannelPlan {
    /// The rows of the columns in a group's window, and after them the residual's.
    pub rows: Vec<usize>,
    /// For each column: its unknown's index; `None` for the gain, whose unknown is the view's.
    pub unknowns: Vec<Option<usize>>,
    /// How many columns there are, the residual not counted.
    pub columns: usize,
}

impl ChannelPlan {
    /// Entries of the upper triangle of the Gram matrix of columns and residual.
    pub(super) const fn pairs(&self) -> usize {
        (self.columns + 1) * (self.columns + 2) / 2
    }
}

/// The rows of a record's kept terms: those that no free parameter changes.
#[derive(Clone, Debug, Default)]
pub(super) struct KeptPlan {
    pub diffuse: Option<usize>,
    pub side: Option<usize>,
    pub hilite: Option<usize>,
    pub mirror: Option<usize>,
    pub key: Option<usize>,
    pub haze: Option<usize>,
    pub silhouette: Option<usize>,
    /// S.x, when nothing else of the sample is read.
    pub open: Option<usize>,
    /// How many rows a record has.
    pub rows: usize,
}

impl KeptPlan {
    fn new(enabled: Wanted, live: Wanted, alpha: bool, silhouette: bool, open: bool) -> Self {
        let mut rows = 0;
        let mut place = |keep: bool, size: usize| {
            keep.then(|| {
                rows += size;
                rows - size
            })
        };
        let mut kept = Self {
            diffuse: place(enabled.diffuse && !live.diffuse, 3),
            side: place(enabled.side && !live.side, 3),
            hilite: place(enabled.hilite && !live.hilite, 3),
            mirror: place(enabled.mirror && !live.mirror, 3),
            key: place(enabled.key && !live.key, 3),
            haze: place(alpha && enabled.mirror && !live.mirror, 1),
            silhouette: place(silhouette, 1),
            open: place(open, 1),
            rows: 0,
        };
        kept.rows = rows;
        kept
    }
}

/// What a pass computes.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// The switches of the model.
    pub setup: Setup,
    /// Three colours, and alpha when the haze is compared too.
    pub channels: Vec<ChannelPlan>,
    /// Which parameters are free, in the order of the table.
    pub free: [bool; Param::COUNT],
    /// Whether each view's gain is free.
    pub gains: bool,
    /// Terms that are looked up anew in each pass; the other enabled ones are kept.
    pub live: Wanted,
    /// Terms that some enabled effect asks for.
    pub enabled: Wanted,
    /// Whether anything is looked up anew; otherwise the kept rows are all that a pass reads of a sample.
    pub any_live: bool,
    /// Where the kept terms stand.
    pub kept: KeptPlan,
    /// Free parameters whose columns need lookups.
    pub lookups: Vec<LookupParam>,
}

impl Plan {
    pub(super) fn new(setup: Setup, unknowns: &[Unknown], compare_alpha: bool, keep: bool) -> Self {
        let needs = setup.needs();
        let enabled = Wanted {
            diffuse: needs.irradiance,
            side: setup.effects.has(Effect::SideSpecular),
            hilite: needs.hilite,
            mirror: needs.dapple,
            key: needs.key_light,
        };
        let mut lookups: Vec<LookupParam> = Vec::new();
        let mut channels = Vec::new();
        let is_free = |param: Param| {
            unknowns.iter().any(|u| matches!(u, Unknown::Param(column) if column.param == param))
        };
        let gains = unknowns.iter().any(|u| matches!(u, Unknown::Gain(_)));
        for c in 0..if compare_alpha { 4 } else { 3 } {
            let mut channel = ChannelPlan { rows: Vec::new(), unknowns: Vec::new(), columns: 0 };
            for (index, unknown) in unknowns.iter().enumerate() {
                let Unknown::Param(column) = unknown else { continue };
                if !moves(column, c, enabled, setup) {
                    continue;
                }
                channel.rows.push(window::column(c, column.param));
                channel.unknowns.push(Some(index));
                if let Some(lookup) = LookupParam::from_param(column.param)
                    && !lookups.contains(&lookup)
                {
                    lookups.push(lookup);
                }
            }
            if gains {
                channel.rows.push(window::gain(c));
                channel.unknowns.push(None);
            }
            channel.columns = channel.unknowns.len();
            channel.rows.push(window::residual(c));
            channels.push(channel);
        }
        let moved = |lookup: LookupParam| lookups.contains(&lookup) || !keep;
        let (strength, turned) =
            (moved(LookupParam::NormalStrength), moved(LookupParam::EnvironmentRotation));
        let lobe = moved(LookupParam::SpecularLobe);
        let key = strength || moved(LookupParam::KeyAzimuth) || moved(LookupParam::KeyElevation);
        let live = Wanted {
            diffuse: enabled.diffuse && (strength || turned),
            side: enabled.side && (strength || turned || lobe),
            hilite: enabled.hilite && turned,
            mirror: enabled.mirror && (strength || turned || lobe),
            key: enabled.key && key,
        };
        let live_silhouette = needs.rim && setup.silhouette == Silhouette::Bumped && strength;
        // A silhouette of the smooth normal is among the samples already.
        let keep_silhouette = needs.rim && setup.silhouette == Silhouette::Bumped && !live_silhouette;
        let any_live = live != Wanted::NONE || live_silhouette;
        let kept = KeptPlan::new(enabled, live, compare_alpha, keep_silhouette, !any_live);
        let free = TABLE.each_ref().map(|info| is_free(info.param));
        Self { setup, channels, free, gains, live, enabled, any_live, kept, lookups }
    }
}

/// Whether the unknown moves output channel `c` at all.
fn moves(column: &Column, c: usize, enabled: Wanted, setup: Setup) -> bool {
    // What was added has no row in a window.
    if !column.param.asked_for(setup.effects) || !column.param.is_built_in() {
        return false;
    }
    let alpha = c == 3;
    match column.param {
        Param::HazeWeight => alpha,
        // Alpha holds the haze alone: what moves the reflection's lookup moves it.
        Param::NormalStrength | Param::SpecularLobe | Param::EnvironmentRotation if alpha => enabled.mirror,
        _ if alpha => false,
        _ => match column.channels {
            Channels::Tied => true,
            Channels::One(own) => own == c,
        },
    }
}

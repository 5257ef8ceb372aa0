//! What a pass computes: worked out once from the effects and the unknowns, so that the kernel
//! touches only enabled terms and only the columns of free parameters.

use super::Unknown;
use crate::model::effects::{Effect, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Channels, Column, Param};
use crate::model::terms::{LookupParam, Wanted};

/// Rows of a group's window in the scratch: the columns of all channels fit. Windows overlap: a group's
/// own columns are fewer, and the next group writes later.
pub(super) const WINDOW: usize = 64;
/// The window's last row takes what nobody reads: writing it costs less than asking.
const UNUSED: u8 = (WINDOW - 1) as u8;
// Alpha: the haze's weight, three lookups, gain and residual; a colour: all but the haze's weight.
const _: () = assert!(6 + 3 * (Param::COUNT + 1) < WINDOW);

/// The columns of one output channel. The residual takes the place after the last column.
#[derive(Clone, Debug)]
pub(super) struct ChannelPlan {
    /// For each parameter of the table: the row of its column in a group's window; [`UNUSED`] when it
    /// is held or does not move the channel.
    pub places: [u8; Param::COUNT],
    /// The row of the residual.
    pub residual: u8,
    /// For each column: its unknown's index; `None` for the gain, whose unknown is the view's.
    pub unknowns: Vec<Option<usize>>,
    /// The gain's column, when gains are free.
    pub gain: Option<usize>,
    /// How many columns there are, the residual not counted.
    pub columns: usize,
    /// Where the channel's columns start in the scratch.
    pub start: usize,
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
        let needs = setup.effects.needs(setup.silhouette);
        let enabled = Wanted {
            diffuse: needs.irradiance,
            side: setup.effects.has(Effect::SideSpecular),
            hilite: needs.hilite,
            mirror: needs.dapple,
            key: needs.key_light,
        };
        let mut lookups: Vec<LookupParam> = Vec::new();
        let mut channels = Vec::new();
        let mut start = 0;
        for c in 0..if compare_alpha { 4 } else { 3 } {
            let mut channel = ChannelPlan {
                places: [UNUSED; Param::COUNT],
                residual: UNUSED,
                unknowns: Vec::new(),
                gain: None,
                columns: 0,
                start,
            };
            for (index, unknown) in unknowns.iter().enumerate() {
                let Unknown::Param(column) = unknown else { continue };
                if !moves(column, c, enabled, setup) {
                    continue;
                }
                channel.places[column.param as usize] = (start + channel.unknowns.len()) as u8;
                channel.unknowns.push(Some(index));
                if let Some(lookup) = LookupParam::from_param(column.param)
                    && !lookups.contains(&lookup)
                {
                    lookups.push(lookup);
                }
            }
            if unknowns.iter().any(|u| matches!(u, Unknown::Gain(_))) {
                channel.gain = Some(channel.unknowns.len());
                channel.unknowns.push(None);
            }
            channel.columns = channel.unknowns.len();
            channel.residual = (start + channel.columns) as u8;
            start += channel.columns + 1;
            channels.push(channel);
        }
        let free = |lookup: LookupParam| lookups.contains(&lookup) || !keep;
        let (strength, turned) = (free(LookupParam::NormalStrength), free(LookupParam::EnvironmentRotation));
        let lobe = free(LookupParam::SpecularLobe);
        let key = strength || free(LookupParam::KeyAzimuth) || free(LookupParam::KeyElevation);
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
        Self { setup, channels, live, enabled, any_live, kept, lookups }
    }

    /// Columns and residuals of all channels.
    pub(super) fn all_columns(&self) -> usize {
        self.channels.iter().map(|c| c.columns + 1).sum()
    }
}

/// Whether the unknown moves output channel `c` at all.
fn moves(column: &Column, c: usize, enabled: Wanted, setup: Setup) -> bool {
    if !column.param.asked_for(setup.effects) {
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

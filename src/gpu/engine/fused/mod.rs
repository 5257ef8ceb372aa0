//! The fused pass: stored samples in; loss, gradient and normal equations out, in one compute shader.
//!
//! A thread shades pixels of its own one after another (the planner's rules for stored samples, and their
//! [`tangents`](crate::shader::tangent)), weighs the residuals, and adds the products of the Jacobian's columns to
//! sums in registers. A workgroup adds up its threads' sums in a fixed tree and writes them; a second
//! shader adds up those of all workgroups to [`PARTS`] numbers a sum, which the CPU adds in f64. So the order
//! of additions is fixed, and the rounding error stays that of short sums however many samples there are.
//!
//! Only enabled effects and free parameters leave a trace in the text. Where there are more sums than
//! registers, they are cut into [`Slab`]s, each with a shader of its own.
//!
//! - `layout`: where a record's numbers stand; `pixel`: how a pixel is read
//! - `text`: the pass, line by line; `loss/*.wgsl`: the losses
//! - `reduce`: sums of threads and workgroups; `terms`: the shader that keeps terms

mod layout;
mod pixel;
mod reduce;
mod terms;
mod text;

pub use self::layout::{Layout, Looked};
pub use self::reduce::gather_module;
pub use self::terms::{held_parameters, terms_module};

use crate::model::evaluate::Setup;
use crate::model::params::{Channels, Param};
use crate::model::terms::TermName;
use crate::samples::LANES;
use crate::scene::Loss;
use crate::shader::emit::{Plan, plan};
use crate::shader::facts::{FaceSizes, Facts};
use crate::shader::tangent::chain::{Chain, Seed};
use skinfit_core::engine::{BLOCK, PassOutputs, Unknown};
use skinfit_core::program::levels::LevelProgram;
use skinfit_core::program::lower::LowerError;

/// Threads of a workgroup.
pub const WORKGROUP: u32 = 128;
/// Numbers that a sum is left in for the CPU.
pub const PARTS: usize = 16;
/// Pixels of a block: a coarse pass reads every so-many-th.
const BLOCK_PIXELS: usize = BLOCK * LANES;
/// Sums that a thread keeps: they and the columns should fit 255 registers.
const MOST_SUMS: usize = 112;

/// What is the same for every view of a fit.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The switches of the model.
    pub setup: Setup,
    /// One term alone, instead of the whole.
    pub output: Option<TermName>,
    /// The unknowns.
    pub unknowns: Vec<Unknown>,
    /// What is minimised.
    pub loss: Loss,
    /// Whether the haze is compared with the targets' alpha.
    pub alpha: bool,
    /// Whether the environment is turned, or will be.
    pub turned: bool,
    /// What records hold.
    pub layout: Layout,
    /// Whether a pixel may have several samples.
    pub several: bool,
    /// Whether pixels count differently.
    pub weighted: bool,
    /// Whether targets are clipped.
    pub clipped: bool,
    /// Whether views have gains other than 1, or will.
    pub gained: bool,
    /// The cubes' sizes.
    pub faces: FaceSizes,
}

/// One sum over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sum {
    /// Of the losses.
    Loss,
    /// Of the products of two columns; the residual is the column after the last.
    Product(usize, usize),
}

/// A column of the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColumnOf {
    /// The unknown's index; `None` for the view's gain of these channels.
    pub unknown: Option<usize>,
    /// The seed whose tangent it is.
    seed: Option<usize>,
    /// The channels that it moves.
    channels: ChannelMask,
}

impl ColumnOf {
    /// The channel that it moves, where that is one alone.
    pub(super) const fn channel(&self) -> Option<usize> {
        self.channels.only()
    }
}

/// Channels that a column moves, a bit each: three colours, and alpha where it is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ChannelMask(u8);

impl ChannelMask {
    const RADIANCE: Self = Self(0b0111);
    const ALPHA: Self = Self(0b1000);
    const ALL: Self = Self(0b1111);
    const NONE: Self = Self(0);

    const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The channel, where it is one alone.
    const fn only(self) -> Option<usize> {
        if self.0.is_power_of_two() { Some(self.0.trailing_zeros() as usize) } else { None }
    }
}

/// A part of the sums, and the shader that yields them.
#[derive(Clone, Debug)]
pub struct Slab {
    /// What it sums, in the order of its output.
    pub sums: Vec<Sum>,
    /// The module; its entry point is `cs_main`, in workgroups of [`WORKGROUP`].
    pub wgsl: String,
}

/// The shaders of a fit.
#[derive(Clone, Debug)]
pub struct Fused {
    /// The rules; its constants and resources are group 0.
    pub plan: Plan,
    /// The columns.
    pub columns: Vec<ColumnOf>,
    fitted: Fitted,
    chain: Chain,
}

impl Fused {
    /// Plan the rules and follow the free parameters through them.
    ///
    /// # Errors
    /// When no rules yield the output, or one has no derivative; in words.
    pub fn new(fitted: Fitted) -> Result<Self, String> {
        let facts = facts(&fitted);
        let mut plan = plan(&facts).map_err(|error| error.to_string())?;
        let (seeds, mut columns) = columns(&fitted.unknowns);
        let chain = Chain::new(&plan, &seeds).map_err(|error| error.to_string())?;
        for column in &mut columns {
            let moved = column.seed.map_or(ChannelMask::ALL, |seed| {
                let radiance =
                    if chain.radiance[seed].is_some() { ChannelMask::RADIANCE } else { ChannelMask::NONE };
                radiance.or(if chain.haze[seed].is_some() { ChannelMask::ALPHA } else { ChannelMask::NONE })
            });
            column.channels = column.channels.and(moved).and(compared(&fitted));
        }
        columns.retain(|column| column.channels != ChannelMask::NONE);
        plan.resources.extend(&chain.resources);
        plan.constants.extend(&chain.constants);
        Ok(Self { columns, fitted, chain, plan })
    }

    /// The shaders that yield a wish; most fits have one.
    #[must_use]
    pub fn slabs(&self, wish: PassOutputs) -> Vec<Slab> {
        let sums = self.sums(wish);
        sums.chunks(MOST_SUMS).map(|sums| Slab { sums: sums.to_vec(), wgsl: self.module(sums) }).collect()
    }

    /// The fields of a stored sample, with their WGSL types.
    #[must_use]
    pub fn fields(&self) -> Vec<(String, &'static str)> {
        self.plan.sample_inputs(&self.chain)
    }

    /// How it moves along the free parameters.
    pub(super) const fn chain(&self) -> &Chain {
        &self.chain
    }

    /// What makes that of a sample which it looks up of the UV atlas.
    ///
    /// # Errors
    /// When the processor cannot compute it.
    pub fn levels(&self) -> Result<LevelProgram, LowerError> {
        LevelProgram::new(&self.plan, &self.chain)
    }

    /// The sums of a wish; products of two columns that share no colour channel are 0 and left out.
    fn sums(&self, wish: PassOutputs) -> Vec<Sum> {
        let k = self.columns.len();
        let meet = |i: usize, j: usize| self.moved(i).and(self.moved(j)) != ChannelMask::NONE;
        let mut sums = vec![Sum::Loss];
        if wish == PassOutputs::Normal {
            for i in 0..k {
                sums.extend((i..k).filter(|&j| meet(i, j)).map(|j| Sum::Product(i, j)));
            }
        }
        if wish != PassOutputs::Loss {
            sums.extend((0..=k).map(|i| Sum::Product(i, k)));
        }
        sums
    }

    /// The channels that a column moves; the residual, after the last column, has all that are compared.
    fn moved(&self, i: usize) -> ChannelMask {
        self.columns.get(i).map_or_else(|| compared(&self.fitted), |column| column.channels)
    }

    /// Compared channels: three colours, and alpha where it is compared.
    #[must_use]
    pub const fn channels(&self) -> usize {
        if self.fitted.alpha { 4 } else { 3 }
    }
}

const fn compared(fitted: &Fitted) -> ChannelMask {
    if fitted.alpha { ChannelMask::ALL } else { ChannelMask::RADIANCE }
}

/// What the planner is told of stored samples.
fn facts(fitted: &Fitted) -> Facts {
    Facts {
        output: fitted.output,
        source: fitted.layout.source,
        ..Facts::of_samples(fitted.setup, fitted.faces, fitted.turned)
    }
}

/// The seeds of the unknowns, each once, and the columns that they give; the gains' comes last.
fn columns(unknowns: &[Unknown]) -> (Vec<Seed>, Vec<ColumnOf>) {
    let (mut params, mut columns): (Vec<Param>, Vec<ColumnOf>) = (Vec::new(), Vec::new());
    for (index, unknown) in unknowns.iter().enumerate() {
        let Unknown::Param(column) = unknown else { continue };
        let seed = params.iter().position(|&param| param == column.param).unwrap_or_else(|| {
            params.push(column.param);
            params.len() - 1
        });
        let channels = match column.channels {
            Channels::Tied => ChannelMask::ALL,
            Channels::One(c) => ChannelMask(1 << c),
        };
        columns.push(ColumnOf { unknown: Some(index), seed: Some(seed), channels });
    }
    // Where a channel has a gain of its own, each has a column, which says of whichever gain is its channel's.
    let by_channel = unknowns.iter().any(|unknown| matches!(unknown, Unknown::Gain(_, Channels::One(_))));
    let gained = unknowns.iter().any(|unknown| matches!(unknown, Unknown::Gain(..)));
    let gains = match (gained, by_channel) {
        (false, _) => vec![],
        (true, false) => vec![ChannelMask::ALL],
        (true, true) => (0..4).map(|c| ChannelMask(1 << c)).collect(),
    };
    columns.extend(gains.into_iter().map(|channels| ColumnOf { unknown: None, seed: None, channels }));
    (params.into_iter().map(Seed::of_param).collect(), columns)
}

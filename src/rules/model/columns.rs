//! Free columns of the parameters: which channels move together.

use super::params::{Param, Params};

/// Which channels of a parameter one free column moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channels {
    /// All three together: the parameter is tied to a scalar.
    Tied,
    /// One channel, 0 to 2.
    One(usize),
}

impl Channels {
    /// Whether channel `c` is moved.
    #[must_use]
    pub const fn includes(self, c: usize) -> bool {
        match self {
            Self::Tied => true,
            Self::One(channel) => channel == c,
        }
    }

    /// What names end with: nothing, or `.r`, `.g` or `.b` of a channel by itself.
    #[must_use]
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Tied => "",
            Self::One(c) => [".r", ".g", ".b"][c],
        }
    }

    /// Of three channels the value that is moved.
    #[must_use]
    pub const fn of(self, rgb: [f64; 3]) -> f64 {
        match self {
            Self::Tied => rgb[0],
            Self::One(c) => rgb[c],
        }
    }

    /// Three channels, with `value` where they are moved.
    #[must_use]
    pub const fn with(self, mut rgb: [f64; 3], value: f64) -> [f64; 3] {
        match self {
            Self::Tied => return [value; 3],
            Self::One(c) => rgb[c] = value,
        }
        rgb
    }
}

/// One free unknown of a fit: one column of the Jacobian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Column {
    /// The parameter.
    pub param: Param,
    /// The channels of it that move together.
    pub channels: Channels,
}

impl Column {
    /// A parameter tied to a scalar.
    #[must_use]
    pub const fn tied(param: Param) -> Self {
        Self { param, channels: Channels::Tied }
    }

    /// A parameter free in each channel: three columns.
    #[must_use]
    pub fn per_channel(param: Param) -> [Self; 3] {
        [0, 1, 2].map(|c| Self { param, channels: Channels::One(c) })
    }

    /// The name in reports: the parameter's, with `.r`, `.g` or `.b` when the channel is its own.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}{}", self.param.name(), self.channels.suffix())
    }

    /// This column's value in `params`.
    #[must_use]
    pub fn get(&self, params: &Params) -> f64 {
        self.channels.of(params.rgb(self.param))
    }

    /// Set this column's value in `params`.
    pub fn set(&self, params: &mut Params, value: f64) {
        params.set_rgb(self.param, self.channels.with(params.rgb(self.param), value));
    }

    /// This column's value in one scene of several.
    #[must_use]
    pub fn get_in(&self, scene: usize, params: &Params) -> f64 {
        self.channels.of(params.rgb_in(scene, self.param))
    }

    /// Set this column's value in one scene of several alone.
    pub fn set_in(&self, scene: usize, params: &mut Params, value: f64) {
        params.set_rgb_in(scene, self.param, self.channels.with(params.rgb_in(scene, self.param), value));
    }
}

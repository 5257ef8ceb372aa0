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
        match self.channels {
            Channels::Tied => self.param.name().to_owned(),
            Channels::One(c) => format!("{}.{}", self.param.name(), ["r", "g", "b"][c]),
        }
    }

    /// This column's value in `params`.
    #[must_use]
    pub fn get(&self, params: &Params) -> f64 {
        self.of(params.rgb(self.param))
    }

    /// Set this column's value in `params`.
    pub fn set(&self, params: &mut Params, value: f64) {
        params.set_rgb(self.param, self.with(params.rgb(self.param), value));
    }

    /// This column's value in one scene of several.
    #[must_use]
    pub fn get_in(&self, scene: usize, params: &Params) -> f64 {
        self.of(params.rgb_in(scene, self.param))
    }

    /// Set this column's value in one scene of several alone.
    pub fn set_in(&self, scene: usize, params: &mut Params, value: f64) {
        params.set_rgb_in(scene, self.param, self.with(params.rgb_in(scene, self.param), value));
    }

    /// Of a parameter's channels the value that it moves.
    fn of(&self, rgb: [f64; 3]) -> f64 {
        match self.channels {
            Channels::Tied => rgb[0],
            Channels::One(c) => rgb[c],
        }
    }

    /// A parameter's channels, with `value` where it moves them.
    fn with(&self, mut rgb: [f64; 3], value: f64) -> [f64; 3] {
        match self.channels {
            Channels::Tied => rgb = [value; 3],
            Channels::One(c) => rgb[c] = value,
        }
        rgb
    }
}

//! A window into the atlas: its pixels are exactly those of the whole, at a share of the cost.
//!
//! Texels within [`Window::halo`] of it are computed, too: so far light comes from, at the radii where a fit ends, through
//! all blurs. Pixels see what the whole atlas would show them.

/// A rectangle of texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    /// First column and row.
    pub low: [usize; 2],
    /// The ones after the last.
    pub high: [usize; 2],
    /// How many texels more are computed about it.
    pub halo: usize,
}

impl Window {
    /// Whether a texel is computed.
    pub(crate) fn holds(&self, column: usize, row: usize) -> bool {
        let within = |at: usize, c: usize| at + self.halo >= self.low[c] && at < self.high[c] + self.halo;
        within(column, 0) && within(row, 1)
    }

    /// Whether pixels in a texel are taken.
    pub(crate) fn shows(&self, column: usize, row: usize) -> bool {
        let within = |at: usize, c: usize| (self.low[c]..self.high[c]).contains(&at);
        within(column, 0) && within(row, 1)
    }
}

//! What a view's image is multiplied by.

/// A factor on each channel of a view's image: its exposure and its white balance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain(pub [f64; 3]);

impl Gain {
    /// The image as it is.
    pub const ONE: Self = Self([1.0; 3]);

    /// The factor on channel `c`; what stands after the colours (a haze) is exposed as green is, by which cameras meter.
    #[must_use]
    pub const fn channel(self, c: usize) -> f64 {
        self.0[if c < 3 { c } else { 1 }]
    }

    /// The factors on the colours and on what stands after them.
    #[must_use]
    pub fn channels(self) -> [f64; 4] {
        [0, 1, 2, 3].map(|c| self.channel(c))
    }

    /// The one factor, where all channels have the same.
    #[must_use]
    pub fn scalar(self) -> Option<f64> {
        let [r, g, b] = self.0;
        (r == g && g == b).then_some(g)
    }
}

impl Default for Gain {
    fn default() -> Self {
        Self::ONE
    }
}

impl From<f64> for Gain {
    fn from(factor: f64) -> Self {
        Self([factor; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_haze_is_exposed_as_green_is() {
        assert_eq!(Gain([0.5, 2.0, 3.0]).channels(), [0.5, 2.0, 3.0, 2.0]);
        assert_eq!((Gain([0.5, 2.0, 3.0]).scalar(), Gain::from(0.7).scalar()), (None, Some(0.7)));
        assert_eq!(Gain::default(), Gain::from(1.0));
    }
}

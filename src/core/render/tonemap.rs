//! From linear radiance to what a screen shows: sRGB, and tone operators selectable by name.

use std::sync::LazyLock;

/// Linear [0, 1] to sRGB-encoded [0, 1] (IEC 61966-2-1, exact piecewise form); odd below 0.
#[must_use]
pub fn srgb_encode(linear: f32) -> f32 {
    if linear.abs() <= 0.003_130_8 {
        12.92 * linear
    } else {
        (1.055 * linear.abs().powf(1.0 / 2.4) - 0.055).copysign(linear)
    }
}

/// sRGB-encoded [0, 1] to linear [0, 1]: the inverse of [`srgb_encode`].
#[must_use]
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded.abs() <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded.abs() + 0.055) / 1.055).powf(2.4).copysign(encoded)
    }
}

/// The linear value of each of the 256 sRGB-encoded bytes.
pub static SRGB_BYTES: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| srgb_decode(byte as f32 / 255.0)));

/// How radiance is brought into [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Operator {
    /// Values are cut at 0 and 1: what metrics compare, and true below 1.
    #[default]
    Clip,
    /// c / (1 + luminance): keeps hue, never quite reaches white (Reinhard et al. 2002, eq. 3).
    Reinhard,
    /// A filmic curve on each channel: Narkowicz' 2015 fit of the ACES output transform.
    Aces,
}

impl Operator {
    /// Every operator, in the order of documentation.
    pub const ALL: [Self; 3] = [Self::Clip, Self::Reinhard, Self::Aces];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Clip => "clip",
            Self::Reinhard => "reinhard",
            Self::Aces => "aces",
        }
    }

    /// The operator of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|operator| operator.name() == name)
    }

    /// Linear radiance to linear display values in [0, 1]; negative radiance and NaN show as 0.
    #[must_use]
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        // 1e6 is far above what any curve can tell from white; it keeps infinities out of quotients.
        let rgb = rgb.map(|c| if c > 0.0 { c.min(1e6) } else { 0.0 });
        let curve = match self {
            Self::Clip => rgb,
            Self::Reinhard => {
                let luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
                rgb.map(|c| c / (1.0 + luminance))
            }
            Self::Aces => rgb.map(|c| (c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14)),
        };
        curve.map(|c| c.clamp(0.0, 1.0))
    }
}

/// A tone operator behind an exposure.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ToneMap {
    /// The operator.
    pub operator: Operator,
    /// Exposure in stops: radiance is multiplied by 2^exposure first.
    pub exposure: f32,
}

impl ToneMap {
    /// Linear radiance to sRGB-encoded values in [0, 1].
    #[must_use]
    pub fn encode(self, rgb: [f32; 3]) -> [f32; 3] {
        let factor = self.exposure.exp2();
        self.operator.apply(rgb.map(|c| c * factor)).map(srgb_encode)
    }

    /// Linear radiance to sRGB bytes.
    #[must_use]
    pub fn encode_bytes(self, rgb: [f32; 3]) -> [u8; 3] {
        self.encode(rgb).map(|c| (c * 255.0 + 0.5) as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_agrees_with_the_standard_and_inverts_itself() {
        // Values of IEC 61966-2-1's formulas, evaluated in f64.
        for (linear, encoded) in
            [(0.0, 0.0), (0.001, 0.01292), (0.18, 0.461_356_1), (0.5, 0.735_357), (1.0, 1.0)]
        {
            // powf in f32 is good to a few units in the last place of a value below 1.
            assert!((srgb_encode(linear) - encoded).abs() < 3e-7, "{linear}");
        }
        for byte in 0..=255_u8 {
            let linear = SRGB_BYTES[usize::from(byte)];
            assert_eq!(ToneMap::default().encode_bytes([linear; 3]), [byte; 3]);
        }
    }

    #[test]
    fn operators_rise_stay_in_range_and_are_found_by_name() {
        for operator in Operator::ALL {
            assert_eq!(Operator::from_name(operator.name()), Some(operator));
            let mut last = 0.0;
            for step in 0..200 {
                let [value, ..] = operator.apply([1e-4 * 1.1_f32.powi(step); 3]);
                assert!((last..=1.0).contains(&value), "{operator:?} at step {step}");
                last = value;
            }
            // Every operator ends near white for radiance of 1e4, and shows darkness as black.
            assert!(last > 0.99, "{operator:?}");
            assert_eq!(operator.apply([-1.0, 0.0, -0.0]), [0.0; 3]);
            for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let bytes = ToneMap { operator, exposure: 3.0 }.encode_bytes([odd, 0.0, 0.0]);
                assert_eq!(&bytes[1..], [0, 0], "{operator:?} {odd}: {bytes:?}");
            }
        }
        assert_eq!(Operator::from_name("filmic"), None);
    }

    #[test]
    fn a_stop_of_exposure_doubles_the_light() {
        let bright = ToneMap { operator: Operator::Clip, exposure: 1.0 };
        assert_eq!(bright.encode([0.2, 0.1, 0.3]), ToneMap::default().encode([0.4, 0.2, 0.6]));
    }
}

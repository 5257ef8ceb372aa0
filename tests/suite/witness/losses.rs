//! The four losses of a residual, as docs/scene-files.md writes them.

/// Which loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Loss {
    L2,
    RelativeL2,
    Huber,
    Smape,
}

impl Loss {
    pub(crate) const ALL: [Self; 4] = [Self::L2, Self::RelativeL2, Self::Huber, Self::Smape];

    /// The loss of one number of an image.
    pub(crate) fn of(self, model: f64, target: f64) -> f64 {
        let r = (model - target).abs();
        match self {
            Self::L2 => r * r,
            Self::RelativeL2 => r * r / (target * target + 0.01),
            Self::Huber if r <= 0.05 => r * r,
            Self::Huber => 0.05 * (2.0 * r - 0.05),
            Self::Smape => {
                // Rounded off below 1e-4: a parabola that meets the line in value and slope.
                let size = if r < 1e-4 { (r * r / 1e-4 + 1e-4) / 2.0 } else { r };
                size / (model.abs() + target.abs() + 0.01)
            }
        }
    }

    /// What its squared residual counts in the Gauss-Newton matrix: of a loss that is not a square the weight of
    /// iteratively reweighted least squares, rho'(r) / 2r, the denominator held.
    pub(crate) fn reweight(self, model: f64, target: f64) -> f64 {
        let r = (model - target).abs();
        match self {
            Self::L2 => 1.0,
            Self::RelativeL2 => 1.0 / (target * target + 0.01),
            Self::Huber => 0.05 / r.max(0.05),
            Self::Smape => 0.5 / (r.max(1e-4) * (model.abs() + target.abs() + 0.01)),
        }
    }

    /// d loss / d model, by a central difference; at the corner of SMAPE's |model| towards more light.
    pub(crate) fn slope(self, model: f64, target: f64) -> f64 {
        // Some 1e-16 / h of rounding, and h^2 of curvature.
        let h = 1e-7 * model.abs().max(1e-2);
        let at = |steps: f64| self.of(model + steps * h, target);
        if self == Self::Smape && model == 0.0 {
            return (4.0 * at(1.0) - at(2.0) - 3.0 * at(0.0)) / (2.0 * h);
        }
        (at(1.0) - at(-1.0)) / (2.0 * h)
    }
}

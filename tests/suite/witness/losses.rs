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
            Self::RelativeL2 => relative(model, target),
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
            Self::RelativeL2 => (model.max(0.0) + 0.1).powi(-2),
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

/// 2 int (x - target) / (max(x, 0) + 0.1)^2 dx from the target to the model: at 0 the integrand's two formulas meet.
fn relative(model: f64, target: f64) -> f64 {
    // An antiderivative of either side, both 0 at 0.
    let bright = |x: f64| (1.0 + x / 0.1).ln() - (0.1 + target) * (1.0 / 0.1 - 1.0 / (x + 0.1));
    let dark = |x: f64| x * (0.5 * x - target) / 0.01;
    let whole = |x: f64| 2.0 * if x > 0.0 { bright(x) } else { dark(x) };
    whole(model) - whole(target)
}

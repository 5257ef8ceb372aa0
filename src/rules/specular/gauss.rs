//! Gauss-Legendre quadrature.

/// The nodes and weights of `count` points on [0, 1]: exact for polynomials of degree 2 count - 1.
pub(super) fn nodes(count: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        // Tricomi's estimate of the root; Newton's steps double its digits.
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..6 {
            let (value, derivative) = legendre(count, x);
            x -= value / derivative;
            slope = derivative;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

/// The Legendre polynomial of a degree of at least 1, and its derivative, inside (-1, 1).
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut before, mut own) = (1.0, x);
    for k in 2..=degree {
        let k = k as f64;
        (before, own) = (own, ((2.0 * k - 1.0) * x * own - (k - 1.0) * before) / k);
    }
    (own, degree as f64 * (x * own - before) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        for count in [1, 2, 7, 24, 72] {
            let nodes = nodes(count);
            for power in [0, 1, 2 * count as i32 - 1] {
                let sum: f64 = nodes.iter().map(|(x, w)| w * x.powi(power)).sum();
                // Rounding of some dozens of terms.
                assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-12, "{count} {power}: {sum}");
            }
        }
    }
}

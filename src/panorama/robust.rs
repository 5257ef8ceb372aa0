//! Medians, and means that a few wrong numbers do not move.

/// What turns the median of absolute deviations of a normal distribution into its standard deviation.
pub(crate) const MAD_TO_DEVIATION: f64 = 1.482_602_218_505_602;

/// The median; `None` of nothing. Orders `numbers`.
pub(crate) fn median(numbers: &mut [f64]) -> Option<f64> {
    let count = numbers.len();
    if count == 0 {
        return None;
    }
    let (lower, middle, _) = numbers.select_nth_unstable_by(count / 2, f64::total_cmp);
    let middle = *middle;
    if count % 2 == 1 {
        return Some(middle);
    }
    let below = lower.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some(0.5 * (below + middle))
}

/// The deviation of numbers from `middle`, by the median of their distances from it; 0 of nothing.
pub(crate) fn deviation(numbers: &[f64], middle: f64) -> f64 {
    let mut distances: Vec<f64> = numbers.iter().map(|x| (x - middle).abs()).collect();
    MAD_TO_DEVIATION * median(&mut distances).unwrap_or(0.0)
}

/// Tukey's biweight (Beaton and Tukey 1974) at `distance` deviations; 0 beyond 4.685, where it has 95 % of the mean's
/// efficiency on normal noise.
pub(crate) fn biweight(distance: f64) -> f64 {
    let share = distance / 4.685;
    let rest = (1.0 - share * share).max(0.0);
    rest * rest
}

/// Where numbers lie: their mean by [`biweight`] around the median. Orders `numbers`.
pub(crate) fn location(numbers: &mut [f64]) -> Option<f64> {
    let mut middle = median(numbers)?;
    let scale = deviation(numbers, middle);
    if scale <= 0.0 {
        return Some(middle);
    }
    // The median's order depends on nothing but the numbers, and so does this sum.
    numbers.sort_unstable_by(f64::total_cmp);
    for _ in 0..5 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for x in numbers.iter() {
            let weight = biweight((x - middle) / scale);
            sum += weight * x;
            weights += weight;
        }
        if weights > 0.0 {
            middle = sum / weights;
        }
    }
    Some(middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }

    #[test]
    fn a_tenth_of_wrong_numbers_does_not_move_a_location() {
        let mut numbers: Vec<f64> = (0..90).map(|i| f64::from(i - 45) * 0.01).chain([1e6; 10]).collect();
        // The mean of the right numbers is -0.005; the wrong ones shift only the deviation.
        assert!((location(&mut numbers).unwrap() + 0.005).abs() < 0.02);
    }
}

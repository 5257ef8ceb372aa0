//! A set of small numbers.

/// Numbers below [`Bits::MOST`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Bits([u64; Self::WORDS]);

impl Bits {
    const WORDS: usize = 8;
    /// How many numbers a set tells apart.
    pub(super) const MOST: usize = 64 * Self::WORDS;

    /// The set of one number.
    pub(super) const fn one(number: usize) -> Self {
        let mut words = [0; Self::WORDS];
        words[number / 64] = 1 << (number % 64);
        Self(words)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0 == [0; Self::WORDS]
    }

    pub(super) fn or(mut self, other: Self) -> Self {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a |= b);
        self
    }

    /// What is in this set and not in `other`.
    pub(super) fn without(mut self, other: Self) -> Self {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a &= !b);
        self
    }

    /// What is in this set and less than `number`.
    pub(super) fn below(mut self, number: usize) -> Self {
        for (i, word) in self.0.iter_mut().enumerate() {
            if i > number / 64 {
                *word = 0;
            } else if i == number / 64 {
                *word &= (1 << (number % 64)) - 1;
            }
        }
        self
    }

    pub(super) fn count(&self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    /// The greatest number in it.
    pub(super) fn greatest(&self) -> Option<usize> {
        let (i, word) = self.0.iter().enumerate().rfind(|(_, word)| **word != 0)?;
        Some(64 * i + 63 - word.leading_zeros() as usize)
    }

    /// Its numbers, the least first.
    pub(super) fn iter(&self) -> impl Iterator<Item = usize> {
        self.0.into_iter().enumerate().flat_map(|(i, mut word)| {
            std::iter::from_fn(move || {
                let bit = word.trailing_zeros() as usize;
                word &= word.checked_sub(1)?;
                Some(64 * i + bit)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_hold_what_was_put_in_across_words() {
        let numbers = [0, 1, 63, 64, 200, Bits::MOST - 1];
        let set = numbers.iter().fold(Bits::default(), |set, &n| set.or(Bits::one(n)));
        assert_eq!(set.iter().collect::<Vec<_>>(), numbers);
        assert_eq!((set.count(), set.greatest()), (6, Some(Bits::MOST - 1)));
        assert_eq!(set.below(64).iter().collect::<Vec<_>>(), [0, 1, 63]);
        assert_eq!(set.below(65).iter().collect::<Vec<_>>(), [0, 1, 63, 64]);
        assert_eq!(set.without(set.below(200)).iter().collect::<Vec<_>>(), [200, Bits::MOST - 1]);
        assert!(!set.is_empty() && Bits::default().is_empty());
        assert_eq!(Bits::default().greatest(), None);
    }
}

//! A set of small numbers.

/// Any numbers, in as many words as the greatest takes: equal sets are equal word by word.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Bits(Vec<u64>);

impl Bits {
    /// The set of one number.
    pub(super) fn one(number: usize) -> Self {
        let mut words = vec![0; number / 64 + 1];
        words[number / 64] = 1 << (number % 64);
        Self(words)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn or(mut self, other: &Self) -> Self {
        if self.0.len() < other.0.len() {
            self.0.resize(other.0.len(), 0);
        }
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a |= b);
        self
    }

    /// What is in this set and not in `other`.
    pub(super) fn without(mut self, other: &Self) -> Self {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a &= !b);
        self.trimmed()
    }

    /// What is in both sets.
    pub(super) fn and(mut self, other: &Self) -> Self {
        self.0.truncate(other.0.len());
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a &= b);
        self.trimmed()
    }

    /// What is in this set and less than `number`.
    pub(super) fn below(mut self, number: usize) -> Self {
        self.0.truncate(number / 64 + 1);
        if let Some(word) = self.0.get_mut(number / 64) {
            *word &= (1 << (number % 64)) - 1;
        }
        self.trimmed()
    }

    pub(super) fn count(&self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    /// The greatest number in it.
    pub(super) fn greatest(&self) -> Option<usize> {
        let word = self.0.last()?;
        Some(64 * self.0.len() - 1 - word.leading_zeros() as usize)
    }

    /// Its numbers, the least first.
    pub(super) fn iter(&self) -> impl Iterator<Item = usize> {
        self.0.iter().enumerate().flat_map(|(i, &word)| {
            let mut word = word;
            std::iter::from_fn(move || {
                let bit = word.trailing_zeros() as usize;
                word &= word.checked_sub(1)?;
                Some(64 * i + bit)
            })
        })
    }

    /// Without words at its end that hold nothing.
    fn trimmed(mut self) -> Self {
        while self.0.last() == Some(&0) {
            self.0.pop();
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_hold_what_was_put_in_across_words() {
        let numbers = [0, 1, 63, 64, 200, 5000];
        let set = || numbers.iter().fold(Bits::default(), |set, &n| set.or(&Bits::one(n)));
        let listed = |set: Bits| set.iter().collect::<Vec<_>>();
        assert_eq!(listed(set()), numbers);
        assert_eq!((set().count(), set().greatest()), (6, Some(5000)));
        assert_eq!(listed(set().below(64)), [0, 1, 63]);
        assert_eq!(listed(set().below(65)), [0, 1, 63, 64]);
        assert_eq!(listed(set().without(&set().below(200))), [200, 5000]);
        assert_eq!(listed(set().and(&set().below(200))), [0, 1, 63, 64]);
        assert_eq!(set().without(&Bits::one(5000)), set().below(5000), "equal sets are equal word by word");
        assert!(!set().is_empty() && Bits::default().is_empty() && set().without(&set()).is_empty());
        assert_eq!((Bits::default().greatest(), set().below(0)), (None, Bits::default()));
    }
}

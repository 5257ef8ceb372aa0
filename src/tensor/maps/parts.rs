//! Views cut into parts, where all their samples are more than a buffer takes.

use std::borrow::Cow;
use std::ops::Range;

use crate::model::fields::Fields;
use crate::samples::{LANES, ViewSamples};
use crate::{Inputs, Levels, Scatter, Shade, Shaded, SharedDevice, TensorError};

/// Bytes that a sample takes in the largest buffer: base, view, normal, three corners' silhouettes and shares, a normal
/// for the dapple, and the sample's share, 19 numbers of 32 bits at most, beside what files of rules declare.
const SAMPLE_BYTES: u64 = 76;

/// Whole groups of one view or of several, one after the other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cut {
    /// Views, and which of their groups.
    pieces: Vec<(usize, Range<usize>)>,
    /// Which of all views' samples these are.
    pub samples: Range<usize>,
}

/// The most samples that a buffer of the device has room for, where rules read these fields of them, too.
#[must_use]
pub fn most_samples(shared: &SharedDevice, fields: Fields) -> usize {
    let limits = shared.gpu().device.limits();
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    (bytes / (SAMPLE_BYTES + 4 * fields.numbers() as u64)) as usize
}

/// The groups of all views in their order, in parts of at most `most` samples; a group is never cut.
#[must_use]
pub fn cuts(views: &[&ViewSamples], most: usize) -> Vec<Cut> {
    cut(views, most, |_| true)
}

/// The same, in parts of one view each.
#[must_use]
pub fn cuts_of_one_view(views: &[&ViewSamples], most: usize) -> Vec<Cut> {
    cut(views, most, |[last, next]| last == next)
}

/// Parts that groups of two views may share where `together` says so.
fn cut(views: &[&ViewSamples], most: usize, together: impl Fn([usize; 2]) -> bool) -> Vec<Cut> {
    let mut cuts = vec![Cut::default()];
    for (index, view) in views.iter().enumerate() {
        for group in 0..view.groups() {
            let size = (view.group_start[group + 1] - view.group_start[group]) as usize * LANES;
            let end = cuts.last().map_or(0, |cut| cut.samples.end);
            let has_room = |cut: &&mut Cut| cut.samples.is_empty() || cut.samples.len() + size <= most;
            let takes = |cut: &&mut Cut| cut.pieces.last().is_none_or(|(last, _)| together([*last, index]));
            match cuts.last_mut().filter(|cut| has_room(cut) && takes(cut)) {
                Some(cut) => cut.push(index, group, size),
                None => {
                    let mut cut = Cut { pieces: Vec::new(), samples: end..end };
                    cut.push(index, group, size);
                    cuts.push(cut);
                }
            }
        }
    }
    cuts
}

/// The shading operation over each part of the samples, and inputs to start from.
///
/// # Errors
/// When the device does not take the samples.
pub fn shades(
    shared: &SharedDevice,
    shaded: &Shaded<'_>,
    views: &[&ViewSamples],
    cuts: &[Cut],
) -> Result<Vec<(Shade, Inputs)>, TensorError> {
    let levels = Levels::of_views(shared, shaded, views, Scatter::Exact)?;
    let shade = |cut: &Cut| {
        let part = cut.views(views);
        let part: Vec<&ViewSamples> = part.iter().map(AsRef::as_ref).collect();
        Shade::build(shared, shaded, &part, (None, levels.as_ref()), Scatter::Exact)
    };
    cuts.iter().map(shade).collect()
}

impl Cut {
    /// The view and the groups of it, where all are of one.
    #[must_use]
    pub fn one_view(&self) -> Option<(usize, Range<usize>)> {
        match self.pieces.as_slice() {
            [one] => Some(one.clone()),
            _ => None,
        }
    }

    fn push(&mut self, view: usize, group: usize, size: usize) {
        self.samples.end += size;
        match self.pieces.last_mut() {
            Some((last, groups)) if *last == view => groups.end = group + 1,
            _ => self.pieces.push((view, group..group + 1)),
        }
    }

    /// Its samples, as views of their own.
    #[must_use]
    pub fn views<'v>(&self, views: &[&'v ViewSamples]) -> Vec<Cow<'v, ViewSamples>> {
        let of = |(view, groups): &(usize, Range<usize>)| {
            let view = views[*view];
            if *groups == (0..view.groups()) {
                Cow::Borrowed(view)
            } else {
                Cow::Owned(view.part(groups.clone()))
            }
        };
        self.pieces.iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::SurfaceRecords;
    use crate::samples::surface_records::Asked;

    /// A view of groups with that number of records each.
    fn view(records: &[u32]) -> ViewSamples {
        let ends = records.iter().scan(0, |end, records| {
            *end += records;
            Some(*end)
        });
        let group_start: Vec<u32> = std::iter::once(0).chain(ends).collect();
        let pixels = records.len() * LANES;
        let count = group_start[records.len()] as usize;
        let mut surface = SurfaceRecords::new(Asked::EVERYTHING, count);
        let numbers: Vec<f32> = (0..count * surface.rows().stride() * LANES).map(|i| i as f32).collect();
        surface.rows_mut().fill(&numbers);
        ViewSamples {
            group_start,
            pixel: (0..pixels as u32).collect(),
            coverage: (0..pixels).map(|i| i as f32).collect(),
            surface,
            ..ViewSamples::default()
        }
    }

    #[test]
    fn parts_hold_every_group_once_in_order_and_no_more_samples_than_allowed() {
        let views = [view(&[1, 4, 4, 2]), view(&[3]), view(&[4, 4])];
        let views: Vec<&ViewSamples> = views.iter().collect();
        assert_eq!((cuts(&views, usize::MAX).len(), cuts_of_one_view(&views, usize::MAX).len()), (1, 3));
        let most = [1, 4, 5, 9, 100].map(|records| records * LANES);
        for (most, apart) in most.into_iter().flat_map(|most| [(most, false), (most, true)]) {
            let cuts = if apart { cuts_of_one_view(&views, most) } else { cuts(&views, most) };
            assert!(!apart || cuts.iter().all(|cut| cut.one_view().is_some()));
            let mut end = 0;
            let (mut pixels, mut numbers) = (Vec::new(), Vec::new());
            for cut in &cuts {
                assert_eq!(cut.samples.start, end);
                end = cut.samples.end;
                let parts = cut.views(&views);
                let groups: usize = parts.iter().map(|view| view.groups()).sum();
                assert!(cut.samples.len() <= most || groups == 1, "{cut:?}");
                assert_eq!(parts.iter().map(|view| view.surface.slots()).sum::<usize>(), cut.samples.len());
                for part in parts {
                    assert_eq!((part.group_start[0], part.records() * LANES), (0, part.surface.slots()));
                    pixels.extend_from_slice(&part.pixel);
                    numbers.extend_from_slice(part.surface.rows().all());
                }
            }
            let whole = |of: fn(&ViewSamples) -> Vec<u32>| -> Vec<u32> {
                views.iter().flat_map(|view| of(view)).collect()
            };
            assert_eq!(pixels, whole(|view| view.pixel.clone()));
            let rows: Vec<_> = views.iter().flat_map(|view| view.surface.rows().all()).copied().collect();
            assert!(numbers == rows, "the samples of {most} differ");
        }
    }
}

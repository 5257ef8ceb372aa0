//! Covered texels along an axis of the atlas: which stand a number of steps from one, as blurs ask for millions of
//! times.

use super::LANES;
use super::atlas::Atlas;
use crate::shader::atlas::Axis;

/// An atlas along one of its axes.
#[derive(Clone, Copy, Debug)]
pub struct Along<'a> {
    atlas: &'a Atlas,
    axis: Axis,
    /// From a texel to the next one, in texels row by row.
    pitch: i32,
    known: &'a [SixteenTexels],
}

/// Sixteen covered texels one after another, as they stand in the atlas. Behind the last one stands that one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SixteenTexels {
    /// Their places among the covered ones.
    pub places: [u32; LANES],
    /// Where they stand along u, and along v.
    at: [[u32; LANES]; 2],
    texels: [u32; LANES],
    charts: [u32; LANES],
    /// How many texels on either side of each are of its chart along u and along v, without a gap; 255 of more.
    room: [i32; 2],
}

impl<'a> Along<'a> {
    pub(super) const fn new(atlas: &'a Atlas, axis: Axis, known: &'a [SixteenTexels]) -> Self {
        let pitch = match axis {
            Axis::U => 1,
            Axis::V => atlas.size() as i32,
        };
        Self { atlas, axis, pitch, known }
    }

    /// Texels along the axis.
    #[must_use]
    pub const fn size(&self) -> u32 {
        self.atlas.size()
    }

    /// The covered texels from `first` on, a multiple of sixteen.
    #[inline(always)]
    #[must_use]
    pub fn sixteen(&self, first: usize) -> &'a SixteenTexels {
        &self.known[first / LANES]
    }

    /// Whether sixteen texels have more than `steps` texels of their charts on either side; of steps backwards, no.
    #[inline(always)]
    #[must_use]
    pub fn have_room(&self, of: &SixteenTexels, steps: &[i32; LANES]) -> bool {
        let (mut least, mut most) = (steps[0], steps[0]);
        for lane in 1..LANES {
            (least, most) = (least.min(steps[lane]), most.max(steps[lane]));
        }
        0 <= least && most < of.room[self.axis as usize]
    }

    /// The texels `steps` and `more` from sixteen, no further than these [have room](Self::have_room).
    #[inline(always)]
    #[must_use]
    pub fn within(&self, of: &SixteenTexels, steps: &[i32; LANES], more: i32) -> [u32; LANES] {
        let mut to = [0; LANES];
        match self.axis {
            // Row by row.
            Axis::U => {
                for lane in 0..LANES {
                    to[lane] = of.places[lane].wrapping_add_signed(steps[lane].wrapping_add(more));
                }
            }
            Axis::V => {
                for lane in 0..LANES {
                    let off = steps[lane].wrapping_add(more).wrapping_mul(self.pitch);
                    to[lane] = of.texels[lane].wrapping_add_signed(off);
                }
                let cells = self.atlas.cells();
                for to in &mut to {
                    [*to, _] = cells[*to as usize];
                }
            }
        }
        to
    }

    /// The texels of the same charts, or of their margins, `steps` and `more` from sixteen, and 1 of those that there
    /// are, as [`Atlas::place_of_chart`] has it; in the place of what is not there the texels themselves, and 0. Without
    /// margins there are no branches, which near borders could not be foretold.
    #[inline(always)]
    #[must_use]
    pub fn near(&self, of: &SixteenTexels, steps: &[i32; LANES], more: i32) -> [[u32; LANES]; 2] {
        let (size, at) = (self.size(), &of.at[self.axis as usize]);
        let (mut to, mut charts) = ([0_u32; LANES], [0_u32; LANES]);
        for lane in 0..LANES {
            let step = steps[lane].wrapping_add(more);
            // Beyond the atlas, too, where the sum wraps.
            let inside = at[lane].wrapping_add_signed(step) < size;
            let off = if inside { step.wrapping_mul(self.pitch) } else { 0 };
            to[lane] = of.texels[lane].wrapping_add_signed(off);
            // Of no texel.
            charts[lane] = if inside { of.charts[lane] } else { u32::MAX };
        }
        let (mut near, mut found) = ([0_u32; LANES], [0_u32; LANES]);
        let cells = self.atlas.cells();
        for lane in 0..LANES {
            let [place, chart] = cells[to[lane] as usize];
            (near[lane], found[lane]) = (place, chart);
        }
        for lane in 0..LANES {
            let there = found[lane] == charts[lane];
            near[lane] = if there { near[lane] } else { of.places[lane] };
            found[lane] = u32::from(there);
        }
        if !self.atlas.margins().is_empty() {
            for lane in 0..LANES {
                let step = steps[lane].saturating_add(more);
                if found[lane] == 0
                    && let Some(place) = self.of_margin(of.places[lane], step)
                {
                    (near[lane], found[lane]) = (place, 1);
                }
            }
        }
        [near, found]
    }

    /// The texel `step` steps from a covered one, of its chart or of that one's margin.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, place: u32, step: i32) -> Option<u32> {
        let texel = self.texel(place, step)?;
        let ([near, chart], own) = (self.atlas.cells()[texel as usize], self.atlas.chart(place as usize));
        if chart == own { Some(near) } else { self.of_margin(place, step) }
    }

    /// The texel of the chart's [margin](Atlas::margins) `step` steps from a covered one, if there is one.
    fn of_margin(&self, place: u32, step: i32) -> Option<u32> {
        let texel = self.texel(place, step)?;
        let number = self.atlas.margins().number(self.atlas.chart(place as usize), texel)?;
        Some(number as u32)
    }

    /// The texel `step` steps from a covered one, whatever it is of; `None` beyond the atlas.
    #[inline(always)]
    fn texel(&self, place: u32, step: i32) -> Option<u32> {
        let at = self.atlas.texel(place as usize)[self.axis as usize];
        let to = at.checked_add_signed(step).filter(|&to| to < self.size());
        to.map(|_| self.atlas.texels()[place as usize].wrapping_add_signed(step * self.pitch))
    }
}

/// An atlas' covered texels, sixteen by sixteen.
pub(super) fn known(atlas: &Atlas) -> Vec<SixteenTexels> {
    let room = [Axis::U, Axis::V].map(|axis| room(&Along::new(atlas, axis, &[])));
    let sixteen = |first: usize| {
        let places = std::array::from_fn(|lane| (first + lane).min(atlas.covered() - 1));
        let least = |room: &[u8]| places.iter().map(|&place| i32::from(room[place])).min().unwrap_or(0);
        SixteenTexels {
            places: places.map(|place| place as u32),
            at: [0, 1].map(|axis| places.map(|place| atlas.texel(place)[axis])),
            texels: places.map(|place| atlas.texels()[place]),
            charts: places.map(|place| atlas.chart(place)),
            room: room.each_ref().map(|room| least(room)),
        }
    };
    (0..atlas.covered()).step_by(LANES).map(sixteen).collect()
}

/// Each covered texel's room, as far as a byte goes.
fn room(along: &Along<'_>) -> Vec<u8> {
    // In their order those before a texel are counted first, and against it those after.
    let mut sides = [-1, 1].map(|side| (side, vec![0_u8; along.atlas.covered()]));
    for (side, counts) in &mut sides {
        for k in 0..counts.len() {
            let at = if *side < 0 { k } else { counts.len() - 1 - k };
            let near = along.place(at as u32, *side).and_then(|near| counts.get(near as usize));
            counts[at] = near.map_or(0, |count| count.saturating_add(1));
        }
    }
    let [(_, before), (_, after)] = sides;
    before.into_iter().zip(after).map(|(before, after)| before.min(after)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Charts of an odd size: two that touch, one with a hole, one of a single texel; `covered` of the texels are
    /// covered.
    fn atlas(covered: usize) -> Atlas {
        const SIZE: usize = 9;
        let chart = |texel: usize| match (texel % SIZE, texel / SIZE) {
            (4, 4) => 0,
            (8, 8) => 3,
            (0..=3, _) => 1,
            _ => 2,
        };
        let mut left = covered;
        let charts: Vec<u32> = (0..SIZE * SIZE)
            .map(|texel| {
                let chart = if left > 0 { chart(texel) } else { 0 };
                left -= usize::from(chart > 0);
                chart
            })
            .collect();
        Atlas::of_charts(SIZE as u32, &charts, Vec::new(), |_, _| 0.0)
    }

    #[test]
    fn texels_near_one_are_those_of_its_chart() {
        for (covered, axis) in [1, 15, 16, 17, 65, 80].into_iter().flat_map(|n| [(n, Axis::U), (n, Axis::V)])
        {
            let atlas = atlas(covered);
            assert_eq!(atlas.covered(), covered);
            let along = atlas.along(axis);
            let far = [i32::MIN, i32::MIN + 1, i32::MAX - 1, i32::MAX];
            for (step, more) in (-12..=12).chain(far).flat_map(|step| [(step, 0), (step, 1)]) {
                for first in (0..covered).step_by(LANES) {
                    let (of, steps) = (along.sixteen(first), [step; LANES]);
                    let [near, found] = along.near(of, &steps, more);
                    let room = along.have_room(of, &steps);
                    let within = room.then(|| along.within(of, &steps, more));
                    assert!(!room || step >= 0, "no room for {step}");
                    for lane in 0..LANES {
                        let place = (first + lane).min(covered - 1);
                        assert_eq!(of.places[lane] as usize, place);
                        let [column, row] = atlas.texel(place).map(i64::from);
                        let by = i64::from(step) + i64::from(more);
                        let [column, row] =
                            if axis == Axis::U { [column + by, row] } else { [column, row + by] };
                        let want = atlas.place_of_chart(atlas.chart(place), column, row);
                        let got = (found[lane] == 1).then_some(near[lane] as usize);
                        assert_eq!(got, want, "{covered} {axis:?} {place} {step} {more}");
                        assert!(want.is_some() || near[lane] as usize == place);
                        assert!(within.is_none_or(|within| Some(within[lane] as usize) == want));
                        let single = i32::try_from(by).ok().and_then(|by| along.place(place as u32, by));
                        assert_eq!(single.map(|place| place as usize), want);
                    }
                }
            }
        }
    }
}

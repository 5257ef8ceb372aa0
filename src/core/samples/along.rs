//! Covered texels along an axis of the atlas: which stand so many steps from one, as blurs ask for millions of times.

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
    known: &'a [Sixteen],
}

/// Sixteen covered texels one after another, as they stand along an axis. Behind the last one stands that one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sixteen {
    /// Their places among the covered ones.
    pub places: [u32; LANES],
    at: [u32; LANES],
    texels: [u32; LANES],
    charts: [u32; LANES],
    /// How many texels on either side of each are of its chart, without a gap; 255 of more.
    room: i32,
}

impl<'a> Along<'a> {
    pub(super) const fn new(atlas: &'a Atlas, axis: Axis, known: &'a [Sixteen]) -> Self {
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
    pub fn sixteen(&self, first: usize) -> &'a Sixteen {
        &self.known[first / LANES]
    }

    /// Whether sixteen texels have more than so many steps of their charts on either side.
    #[inline(always)]
    #[must_use]
    pub fn have_room(&self, of: &Sixteen, steps: &[i32; LANES]) -> bool {
        let mut most = steps[0];
        for lane in 1..LANES {
            most = most.max(steps[lane]);
        }
        most < of.room
    }

    /// The texels so many `steps` and `more` from sixteen, no further than these [have room](Self::have_room).
    #[inline(always)]
    #[must_use]
    pub fn within(&self, of: &Sixteen, steps: &[i32; LANES], more: i32) -> [u32; LANES] {
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

    /// The texels of the same charts, or of their margins, so many `steps` and `more` from sixteen, and 1 of those that there
    /// are, as [`Atlas::place_of_chart`] has it; in the place of what is not there the texels themselves, and 0. No branches,
    /// which near borders could not be foretold.
    #[inline(always)]
    #[must_use]
    pub fn near(&self, of: &Sixteen, steps: &[i32; LANES], more: i32) -> [[u32; LANES]; 2] {
        let size = self.size();
        let (mut to, mut charts) = ([0_u32; LANES], [0_u32; LANES]);
        for lane in 0..LANES {
            let step = steps[lane].wrapping_add(more);
            // Beyond the atlas, too, where the sum wraps.
            let inside = of.at[lane].wrapping_add_signed(step) < size;
            let off = if inside { step.wrapping_mul(self.pitch) } else { 0 };
            to[lane] = of.texels[lane].wrapping_add_signed(off);
            // Of no texel.
            charts[lane] = if inside { of.charts[lane] } else { u32::MAX };
        }
        let (mut near, mut found) = ([0_u32; LANES], [0_u32; LANES]);
        let cells = self.atlas.cells();
        for lane in 0..LANES {
            [near[lane], found[lane]] = cells[to[lane] as usize];
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

    /// The texel so many steps from a covered one, of its chart or of that one's margin.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, place: u32, step: i32) -> Option<u32> {
        let texel = self.texel(place, step)?;
        let ([near, chart], own) = (self.atlas.cells()[texel as usize], self.atlas.chart(place as usize));
        if chart == own { Some(near) } else { self.of_margin(place, step) }
    }

    /// The texel of the chart's [margin](Atlas::margins) so many steps from a covered one, if there is one.
    fn of_margin(&self, place: u32, step: i32) -> Option<u32> {
        let texel = self.texel(place, step)?;
        let number = self.atlas.margins().number(self.atlas.chart(place as usize), texel)?;
        Some(number as u32)
    }

    /// The texel so many steps from a covered one, whatever it is of; `None` beyond the atlas.
    #[inline(always)]
    fn texel(&self, place: u32, step: i32) -> Option<u32> {
        let at = |place: usize| self.atlas.texel(place)[usize::from(self.axis == Axis::V)];
        let to = at(place as usize).checked_add_signed(step).filter(|&to| to < self.size());
        to.map(|_| self.atlas.texels()[place as usize].wrapping_add_signed(step * self.pitch))
    }
}

/// What is known of an atlas' covered texels along an axis.
pub(super) fn known(atlas: &Atlas, axis: Axis) -> Vec<Sixteen> {
    let along = Along::new(atlas, axis, &[]);
    let room = room(&along);
    let sixteen = |first: usize| {
        let places = std::array::from_fn(|lane| (first + lane).min(atlas.covered() - 1));
        Sixteen {
            places: places.map(|place| place as u32),
            at: places.map(|place| atlas.texel(place)[usize::from(axis == Axis::V)]),
            texels: places.map(|place| atlas.texels()[place]),
            charts: places.map(|place| atlas.chart(place)),
            room: places.into_iter().map(|place| i32::from(room[place])).min().unwrap_or(0),
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

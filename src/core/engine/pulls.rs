//! Where residuals stand in the images, and how each small square of them pulls at the unknowns.
//!
//! Sums over all pixels cannot say whether neighbouring residuals are alike. One pass of its own keeps what can: each
//! pixel's weighted residuals, and J^T r tile by tile ([`TILE`] pixels a side), which add up to those of any larger square.

use std::collections::BTreeMap;

use super::view::ObservedView;
use crate::samples::LANES;
use crate::samples::rows::Row;

/// Pixels along the side of a tile.
pub const TILE: usize = 8;

/// What the residuals of one point are like, pixel by pixel and tile by tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pulls {
    /// The residuals of each view.
    pub residuals: Vec<ResidualImage>,
    /// The tiles in which a pixel counts, view by view, row by row.
    pub tiles: Vec<Tile>,
}

/// A view's weighted residuals, as they stand in the normal equations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResidualImage {
    /// Pixels in a row.
    pub width: usize,
    /// Row by row, a number a channel; `None` where a pixel does not count.
    pub pixels: Vec<Option<[f32; 4]>>,
}

/// A square of [`TILE`] pixels a side.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Of which view.
    pub view: usize,
    /// Its place among the view's tiles, from the left.
    pub column: u32,
    /// From the top.
    pub row: u32,
    /// J^T r over its pixels, in the order of the unknowns.
    pub pull: Vec<f64>,
}

/// What a run of groups of one view adds.
pub(super) struct Gathered<'a> {
    view: &'a ObservedView,
    width: usize,
    /// For each channel its columns' unknowns.
    columns: &'a [Vec<Option<usize>>],
    unknowns: usize,
    tiles: BTreeMap<(u32, u32), Vec<f64>>,
    pixels: Vec<(u32, [f32; 4])>,
}

impl<'a> Gathered<'a> {
    /// Nothing yet, of a view whose image has `width` pixels in a row.
    pub(super) fn new(
        view: &'a ObservedView,
        width: usize,
        columns: &'a [Vec<Option<usize>>],
        unknowns: usize,
    ) -> Self {
        Self { view, width: width.max(1), columns, unknowns, tiles: BTreeMap::new(), pixels: Vec::new() }
    }

    /// Add a group, whose columns (after them the residual) `rows` has by channel and column.
    pub(super) fn add(&mut self, group: usize, rows: impl Fn(usize, usize) -> Row) {
        let slots = group * LANES..(group + 1) * LANES;
        let counts =
            |slot: usize| self.view.samples.pixel[slot] != u32::MAX && self.view.pixel_weight(slot) > 0.0;
        let lanes: Vec<usize> = slots.clone().filter(|&slot| counts(slot)).map(|slot| slot % LANES).collect();
        let mut residuals = [[0.0; 4]; LANES];
        for (channel, unknowns) in self.columns.iter().enumerate() {
            let residual = rows(channel, unknowns.len());
            lanes.iter().for_each(|&lane| residuals[lane][channel] = residual[lane]);
            for (column, unknown) in unknowns.iter().enumerate() {
                let Some(unknown) = unknown else { continue };
                let numbers = rows(channel, column);
                for &lane in &lanes {
                    let place = self.place(group * LANES + lane);
                    let pull = self.tiles.entry(place).or_insert_with(|| vec![0.0; self.unknowns]);
                    pull[*unknown] += f64::from(numbers[lane]) * f64::from(residual[lane]);
                }
            }
        }
        let pixel = |lane: usize| self.view.samples.pixel[group * LANES + lane];
        self.pixels.extend(lanes.iter().map(|&lane| (pixel(lane), residuals[lane])));
    }

    fn place(&self, slot: usize) -> (u32, u32) {
        let pixel = self.view.samples.pixel[slot] as usize;
        ((pixel / self.width / TILE) as u32, (pixel % self.width / TILE) as u32)
    }
}

impl Pulls {
    /// Add a view's parts, in their order.
    pub(super) fn add_view(&mut self, view: usize, width: usize, parts: Vec<Gathered<'_>>) {
        let width = width.max(1);
        let mut tiles: BTreeMap<(u32, u32), Vec<f64>> = BTreeMap::new();
        let last = parts.iter().flat_map(|part| &part.pixels).map(|(pixel, _)| *pixel as usize).max();
        let rows = last.map_or(0, |last| last / width + 1);
        let mut image = ResidualImage { width, pixels: vec![None; rows * width] };
        for part in parts {
            for (pixel, residuals) in part.pixels {
                image.pixels[pixel as usize] = Some(residuals);
            }
            for (place, pull) in part.tiles {
                match tiles.get_mut(&place) {
                    Some(sum) => sum.iter_mut().zip(pull).for_each(|(sum, x)| *sum += x),
                    None => drop(tiles.insert(place, pull)),
                }
            }
        }
        self.residuals.push(image);
        let tile = |((row, column), pull)| Tile { view, column, row, pull };
        self.tiles.extend(tiles.into_iter().map(tile));
    }
}

//! A pass' sums as normal equations.

use std::sync::PoisonError;

use super::GpuEngine;
use super::fused::{ColumnOf, Sum};
use skinfit_core::engine::{Engine, NormalEquations, PassOutputs, Point, Unknown};

impl GpuEngine {
    /// A pass as normal equations; after a fault, numbers that no solver takes.
    pub(super) fn pass(&self, point: &Point, wish: PassOutputs) -> NormalEquations {
        let channels: u32 = if self.alpha { 4 } else { 3 };
        let k = self.unknowns.len();
        let mut total = NormalEquations {
            loss: 0.0,
            residual: 0.0,
            weight: Engine::weight(self),
            count: self.weight.1 * u64::from(channels),
            jtr: vec![0.0; k],
            jtj: vec![0.0; k * k],
        };
        match self.sums(point, wish) {
            Ok(passed) => passed.add_to(&mut total, &self.unknowns),
            Err(error) => {
                self.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                total.loss = f64::NAN;
            }
        }
        if total.weight > 0.0 {
            total.loss /= total.weight;
        }
        total
    }
}

/// What a pass yielded.
pub(super) struct PassSums {
    /// For each part, its sums.
    pub(super) sums: Vec<Vec<(Sum, f64)>>,
    pub(super) columns: Vec<ColumnOf>,
    /// For each part, its view.
    pub(super) view_of: Vec<usize>,
}

impl PassSums {
    /// Add the parts' sums, in their order.
    fn add_to(&self, total: &mut NormalEquations, unknowns: &[Unknown]) {
        let k = unknowns.len();
        for (sums, &view) in self.sums.iter().zip(&self.view_of) {
            let gain = |column: &ColumnOf| {
                let channel = column.channel().unwrap_or(0);
                unknowns.iter().position(|unknown| unknown.is_gain_of(view, channel))
            };
            let unknowns: Vec<Option<usize>> =
                self.columns.iter().map(|column| column.unknown.or_else(|| gain(column))).collect();
            let unknown = |i: usize| unknowns[i];
            let last = self.columns.len();
            for &(sum, value) in sums {
                match sum {
                    Sum::Loss => total.loss += value,
                    Sum::Product(i, j) if i == last && j == last => total.residual += value,
                    Sum::Product(i, j) if j == last => {
                        if let Some(a) = unknown(i) {
                            total.jtr[a] += value;
                        }
                    }
                    Sum::Product(i, j) => {
                        let (Some(a), Some(b)) = (unknown(i), unknown(j)) else { continue };
                        total.jtj[a * k + b] += value;
                        if a != b {
                            total.jtj[b * k + a] += value;
                        }
                    }
                }
            }
        }
    }
}

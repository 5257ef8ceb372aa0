//! What the kernel reads of a record: the sample's numbers, and the terms that are kept.

use super::Kernel;
use crate::engine::lanes::Lanes;
use crate::model::fragment::{Fragment, shading};
use crate::model::terms::{Terms, terms};
use crate::model::vector::V3;
use crate::samples::rows::Row;
use crate::samples::surface_records::NEUTRAL;
use crate::simd::Simd;

impl<S: Simd> Kernel<'_, S> {
    #[inline(always)]
    pub(super) fn lit(&self, value: f32) -> Lanes<S> {
        Lanes::splat(self.simd, value)
    }

    /// The record's row at `place`, or `neutral` when no enabled effect asked for it.
    #[inline(always)]
    pub(super) fn load(&self, record: &[Row], place: Option<usize>, neutral: f32) -> Lanes<S> {
        match place {
            Some(at) => Lanes::of_row(self.simd, &record[at]),
            None => self.lit(neutral),
        }
    }

    #[inline(always)]
    fn load3(&self, record: &[Row], place: Option<usize>, neutral: [f32; 3]) -> V3<Lanes<S>> {
        match place {
            Some(at) => {
                let rows = &record[at..][..3];
                [
                    Lanes::of_row(self.simd, &rows[0]),
                    Lanes::of_row(self.simd, &rows[1]),
                    Lanes::of_row(self.simd, &rows[2]),
                ]
            }
            None => [self.lit(neutral[0]), self.lit(neutral[1]), self.lit(neutral[2])],
        }
    }

    #[inline(always)]
    pub(super) fn fragment(&self, record: usize) -> Fragment<Lanes<S>> {
        let (at, rows) = (self.view.places, self.view.record(record));
        let base = self.load3(rows, at.base, NEUTRAL.base);
        Fragment {
            base,
            bump: self.load3(rows, at.bump, NEUTRAL.bump),
            normal: if at.normal.is_none() { base } else { self.load3(rows, at.normal, NEUTRAL.normal) },
            view: self.load3(rows, at.view, NEUTRAL.view),
            occlusion: self.load(rows, at.occlusion, NEUTRAL.occlusion),
            silhouette: self.load(rows, at.silhouette, NEUTRAL.silhouette),
            dapple: self.load(rows, at.dapple, NEUTRAL.dapple),
            albedo: self.load3(rows, at.albedo, NEUTRAL.albedo),
            specular: self.load(rows, at.specular, NEUTRAL.specular),
            attenuator: self.load(rows, at.attenuator, NEUTRAL.attenuator),
        }
    }

    #[inline(always)]
    pub(super) fn kept_rows(&self, record: usize) -> &[Row] {
        let count = self.plan.kept.rows;
        &self.kept[record * count..][..count]
    }

    /// Kept terms in the places that are not live.
    #[inline(always)]
    pub(super) fn fill_kept(&self, terms: &mut Terms<Lanes<S>>, record: usize) {
        let plan = &self.plan.kept;
        let rows = self.kept_rows(record);
        let simd = self.simd;
        macro_rules! fill {
            ($($term:ident)*) => {$(
                if let Some(at) = plan.$term {
                    terms.$term = [
                        Lanes::of_row(simd, &rows[at]),
                        Lanes::of_row(simd, &rows[at + 1]),
                        Lanes::of_row(simd, &rows[at + 2]),
                    ];
                }
            )*};
        }
        fill!(diffuse side hilite mirror key);
        if let Some(at) = plan.haze {
            terms.haze = Lanes::of_row(simd, &rows[at]);
        }
        if let Some(at) = plan.silhouette {
            terms.silhouette = Lanes::of_row(simd, &rows[at]);
        }
    }

    /// The kept terms of one record, into its rows.
    #[inline(always)]
    pub(in crate::engine) fn keep(&self, record: usize, rows: &mut [Row]) {
        let plan = &self.plan.kept;
        let f = self.fragment(record);
        let s = shading(self.plan.setup.form, self.plan.setup.silhouette, &f, self.lit(self.strength));
        let terms = terms(&self.lights, &f, &s, self.plan.enabled);
        macro_rules! keep {
            ($($term:ident)*) => {$(
                if let Some(at) = plan.$term {
                    for c in 0..3 {
                        terms.$term[c].store(&mut rows[at + c]);
                    }
                }
            )*};
        }
        keep!(diffuse side hilite mirror key);
        if let Some(at) = plan.haze {
            terms.haze.store(&mut rows[at]);
        }
        if let Some(at) = plan.silhouette {
            terms.silhouette.store(&mut rows[at]);
        }
        if let Some(at) = plan.open {
            f.occlusion.store(&mut rows[at]);
        }
    }
}

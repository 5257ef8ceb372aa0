//! The kernel: groups of pixels to values and Jacobian columns, sixteen pixels at a time.
//!
//! For each record (one sample of each of the group's pixels) the planes are loaded, the live terms
//! looked up and the kept ones read, and value and columns are added into the pixel's scratch with
//! the sample's weight: the residual of a pixel is that of the *mean* over its visible samples, as
//! the target's pixel is.

use super::lanes::Lanes;
use super::plan::Plan;
use super::plan::WINDOW;
use super::records::{AHEAD, Records};
use super::residual::{Weighted, weighted_residual};
use crate::model::compose::{Composition, Weights};
use crate::model::effects::Silhouette;
use crate::model::fragment::{Fragment, Shading, shading};
use crate::model::lights::Lights;
use crate::model::params::Param;
use crate::model::real::Real;
use crate::model::terms::{LookupParam, Terms, terms, terms_tangent, terms_with_strength_tangent};
use crate::model::vector::V3;
use crate::samples::rows::{Row, prefetch_rows};
use crate::samples::surface_records::NEUTRAL;
use crate::scene::Loss;
use crate::simd::Simd;

/// Everything that is the same for the groups of one view in one pass.
pub(super) struct Kernel<'a, S: Simd> {
    pub simd: S,
    pub plan: &'a Plan,
    pub view: Records<'a>,
    /// The kept terms, `plan.kept.rows` rows a record.
    pub kept: &'a [Row],
    pub lights: Lights<'a, Lanes<S>>,
    pub weights: Weights<Lanes<S>>,
    pub strength: f32,
    pub gain: f32,
    pub loss: Loss,
}

impl<S: Simd> Kernel<'_, S> {
    #[inline(always)]
    fn lit(&self, value: f32) -> Lanes<S> {
        Lanes::splat(self.simd, value)
    }

    /// The record's row at `place`, or `neutral` when no enabled effect asked for it.
    #[inline(always)]
    fn load(&self, record: &[Row], place: Option<usize>, neutral: f32) -> Lanes<S> {
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
    fn fragment(&self, record: usize) -> Fragment<Lanes<S>> {
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
    fn kept_rows(&self, record: usize) -> &[Row] {
        let count = self.plan.kept.rows;
        &self.kept[record * count..][..count]
    }

    /// Kept terms in the places that are not live.
    #[inline(always)]
    fn fill_kept(&self, terms: &mut Terms<Lanes<S>>, record: usize) {
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
    pub(super) fn keep(&self, record: usize, rows: &mut [Row]) {
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

    /// Value (and columns) of the group's pixels into `rows`: for each channel its columns, then its
    /// residual; a row holds one number for each of the pixels.
    #[inline(always)]
    pub(super) fn group<const COLUMNS: bool>(&self, group: usize, rows: &mut [Row; WINDOW]) {
        let starts = &self.view.group_start;
        let (first, end) = (starts[group] as usize, starts[group + 1] as usize);
        let setup = self.plan.setup;
        let live = self.plan.live;
        self.view.prefetch_target(group);
        for record in first..end {
            let mut sink = Sink {
                rows: &mut *rows,
                add: record > first,
                weight: self
                    .view
                    .places
                    .weight
                    .map(|at| Lanes::of_row(self.simd, &self.view.record(record)[at])),
            };
            prefetch_rows(self.kept, (record + AHEAD) * self.plan.kept.rows, self.plan.kept.rows);
            if !self.plan.any_live {
                let mut terms = self.no_terms(record);
                self.fill_kept(&mut terms, record);
                let open = self.load(self.kept_rows(record), self.plan.kept.open, 1.0);
                let composition = Composition::new(terms, open, self.weights);
                self.put_value_and_direct::<COLUMNS>(&composition, &mut sink);
                continue;
            }
            self.view.prefetch_record(record);
            let f = self.fragment(record);
            let s = shading(setup.form, setup.silhouette, &f, self.lit(self.strength));
            let strength_free = COLUMNS && self.plan.lookups.contains(&LookupParam::NormalStrength);
            if strength_free {
                let (mut terms, slope) = terms_with_strength_tangent(&self.lights, &f, &s, live);
                self.fill_kept(&mut terms, record);
                let composition = Composition::new(terms, f.occlusion, self.weights);
                self.put_value_and_direct::<COLUMNS>(&composition, &mut sink);
                self.put_slope(Param::NormalStrength, &composition, &slope, &mut sink);
                self.put_other_slopes(&composition, &f, &s, &mut sink);
            } else {
                let mut terms = terms(&self.lights, &f, &s, live);
                self.fill_kept(&mut terms, record);
                let composition = Composition::new(terms, f.occlusion, self.weights);
                self.put_value_and_direct::<COLUMNS>(&composition, &mut sink);
                if COLUMNS {
                    self.put_other_slopes(&composition, &f, &s, &mut sink);
                }
            }
        }
    }

    #[inline(always)]
    fn no_terms(&self, record: usize) -> Terms<Lanes<S>> {
        let silhouette = match self.plan.setup.silhouette {
            Silhouette::Bumped => self.lit(0.0),
            _ => self.load(self.view.record(record), self.view.places.silhouette, 0.0),
        };
        Terms::none(silhouette)
    }

    #[inline(always)]
    fn put_value_and_direct<const COLUMNS: bool>(
        &self,
        composition: &Composition<Lanes<S>>,
        sink: &mut Sink<'_, S>,
    ) {
        for (c, channel) in self.plan.channels.iter().enumerate() {
            if c == 3 {
                sink.put(channel.residual, composition.alpha());
                if COLUMNS {
                    sink.put(channel.places[Param::HazeWeight as usize], composition.terms.haze);
                }
                continue;
            }
            sink.put(channel.residual, composition.result(c));
            if !COLUMNS {
                continue;
            }
            // By name, so that the match in `derivative` is resolved while compiling.
            macro_rules! put {
                ($($param:ident)*) => {$(
                    sink.put(channel.places[Param::$param as usize], composition.derivative(Param::$param, c));
                )*};
            }
            put!(BaseWeight RimWeight RimExponent Hilite Reflection SideSpecular Occlusion KeyColor);
        }
    }

    #[inline(always)]
    fn put_slope(
        &self,
        param: Param,
        composition: &Composition<Lanes<S>>,
        slope: &Terms<Lanes<S>>,
        sink: &mut Sink<'_, S>,
    ) {
        for (c, channel) in self.plan.channels.iter().enumerate() {
            let column = if c < 3 { composition.along(slope, c) } else { composition.alpha_along(slope) };
            sink.put(channel.places[param as usize], column);
        }
    }

    #[inline(always)]
    fn put_other_slopes(
        &self,
        composition: &Composition<Lanes<S>>,
        f: &Fragment<Lanes<S>>,
        s: &Shading<Lanes<S>>,
        sink: &mut Sink<'_, S>,
    ) {
        macro_rules! put {
            ($($param:ident)*) => {$(
                if self.plan.lookups.contains(&LookupParam::$param) {
                    let slope = terms_tangent(&self.lights, f, s, LookupParam::$param);
                    self.put_slope(Param::$param, composition, &slope, sink);
                }
            )*};
        }
        put!(SpecularLobe EnvironmentRotation KeyAzimuth KeyElevation);
    }

    /// Values to residuals: weights, gain, loss. Returns the group's loss, lane by lane.
    #[inline(always)]
    pub(super) fn weigh<const COLUMNS: bool>(&self, group: usize, rows: &mut [Row; WINDOW]) -> Lanes<S> {
        let simd = self.simd;
        let pixel_weight = self.view.pixel_weight(group);
        let weight = match pixel_weight {
            Some(row) => Lanes::of_row(simd, row),
            None => self.lit(1.0),
        };
        let targets = self.view.target(group);
        let gain = self.lit(self.gain);
        // With unit weights and the plain loss the columns stay as they are.
        let plain =
            pixel_weight.is_none() && self.loss == Loss::L2 && self.gain == 1.0 && self.view.clip.is_none();
        let mut loss = self.lit(0.0);
        for (c, channel) in self.plan.channels.iter().enumerate() {
            let rows = &mut rows[channel.start..];
            let value = Lanes::of_row(simd, &rows[channel.columns]);
            let target = self.load(targets, (c < targets.len()).then_some(c), 0.0);
            let weighted = if plain {
                let r = value - target;
                Weighted { loss: r * r, scale: self.lit(1.0), residual: r }
            } else {
                weighted_residual(self.loss, self.view.clip, gain * value, target, weight)
            };
            loss = loss + weighted.loss;
            weighted.residual.store(&mut rows[channel.columns]);
            if COLUMNS && !plain {
                let factor = weighted.scale * gain;
                for column in &mut rows[..channel.columns] {
                    (factor * Lanes::of_row(simd, column)).store(column);
                }
            }
            if COLUMNS && let Some(k) = channel.gain {
                (weighted.scale * value).store(&mut rows[k]);
            }
        }
        loss
    }
}

/// Where a record's numbers go: stored by the pixel's first record, added by the others.
struct Sink<'a, S: Simd> {
    rows: &'a mut [Row; WINDOW],
    add: bool,
    weight: Option<Lanes<S>>,
}

impl<S: Simd> Sink<'_, S> {
    #[inline(always)]
    fn put(&mut self, place: u8, value: Lanes<S>) {
        // Always within the window, and so that the compiler sees it.
        let row = &mut self.rows[usize::from(place) % WINDOW];
        match self.weight {
            None => value.store(row),
            Some(weight) if self.add => weight.mul_add(value, Lanes::of_row(weight.0.simd, row)).store(row),
            Some(weight) => (weight * value).store(row),
        }
    }
}

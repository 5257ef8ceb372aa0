//! The kernel: groups of pixels to values and Jacobian columns, sixteen pixels at a time.
//!
//! For each record (one sample of each of the group's pixels) the planes are loaded, the live terms
//! looked up and the kept ones read, and value and columns go into the group's window of the scratch,
//! added up with the samples' weights where a pixel has several: the residual of a pixel is that of the
//! *mean* over its visible samples, as the target's pixel is.
//!
//! - `rows`: what is read of a record
//! - `rims`: the rims of many records at once
//! - `residuals`: targets, weights, gain, loss

mod residuals;
mod rims;
mod rows;

pub(super) use self::rims::Rims;
use super::lanes::Lanes;
use super::plan::Plan;
use super::records::{AHEAD, Records};
use super::window::{self, Window};
use crate::model::compose::{Composition, Weights};
use crate::model::effects::Silhouette;
use crate::model::fragment::{Fragment, Shading, shading};
use crate::model::lights::Lights;
use crate::model::params::Param;
use crate::model::real::Real;
use crate::model::rim::rim;
use crate::model::terms::{LookupParam, Terms, terms, terms_tangent, terms_with_strength_tangent};
use crate::samples::rows::{Row, prefetch_rows};
use crate::scene::Loss;
use crate::simd::Simd;

/// The haze's channel.
const ALPHA: usize = 3;

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
    /// Value (and columns) of the group's pixels into its window. The group is one of those that
    /// [`Self::begin`] was told of.
    #[inline(always)]
    pub(super) fn group<const COLUMNS: bool>(&self, group: usize, rims: &Rims, sum: &mut Window) {
        let starts = &self.view.group_start;
        let (first, end) = (starts[group] as usize, starts[group + 1] as usize);
        self.view.prefetch_target(group);
        let Some(weight) = self.view.places.weight else {
            // One sample a pixel.
            for record in first..end {
                self.sample::<COLUMNS>(
                    record,
                    rims,
                    &mut Sink { window: &mut *sum, weight: None, add: false },
                );
            }
            return;
        };
        for record in first..end {
            let weight = Lanes::of_row(self.simd, &self.view.record(record)[weight]);
            let mut sink = Sink { window: &mut *sum, weight: Some(weight), add: record > first };
            self.sample::<COLUMNS>(record, rims, &mut sink);
        }
    }

    /// Value (and columns) of one sample of each pixel.
    #[inline(always)]
    fn sample<const COLUMNS: bool>(&self, record: usize, rims: &Rims, sink: &mut Sink<'_, S>) {
        let setup = self.plan.setup;
        let live = self.plan.live;
        prefetch_rows(self.kept, (record + AHEAD) * self.plan.kept.rows, self.plan.kept.rows);
        if !self.plan.any_live {
            let mut terms = self.no_terms(record);
            self.fill_kept(&mut terms, record);
            let open = self.load(self.kept_rows(record), self.plan.kept.open, 1.0);
            let rim = rims.of(self.simd, record);
            let composition = Composition::with_rim(terms, rim, open, self.weights);
            self.put_value_and_direct::<COLUMNS>(&composition, sink);
            return;
        }
        self.view.prefetch_record(record);
        let f = self.fragment(record);
        let s = shading(setup.form, setup.silhouette, &f, self.lit(self.strength));
        // Before the lookups, which take the time that the power does.
        let rim = match self.plan.kept.silhouette {
            Some(at) => rim(Lanes::of_row(self.simd, &self.kept_rows(record)[at]), self.weights.rim_exponent),
            None => rim(s.silhouette, self.weights.rim_exponent),
        };
        let strength_free = COLUMNS && self.plan.lookups.contains(&LookupParam::NormalStrength);
        if strength_free {
            let (mut terms, slope) = terms_with_strength_tangent(&self.lights, &f, &s, live);
            self.fill_kept(&mut terms, record);
            let composition = Composition::with_rim(terms, rim, f.occlusion, self.weights);
            self.put_value_and_direct::<COLUMNS>(&composition, sink);
            self.put_slope(Param::NormalStrength, &composition, &slope, sink);
            self.put_other_slopes(&composition, &f, &s, sink);
        } else {
            let mut terms = terms(&self.lights, &f, &s, live);
            self.fill_kept(&mut terms, record);
            let composition = Composition::with_rim(terms, rim, f.occlusion, self.weights);
            self.put_value_and_direct::<COLUMNS>(&composition, sink);
            if COLUMNS {
                self.put_other_slopes(&composition, &f, &s, sink);
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

    /// The value, and the columns that need no lookup.
    #[inline(always)]
    fn put_value_and_direct<const COLUMNS: bool>(
        &self,
        composition: &Composition<Lanes<S>>,
        sink: &mut Sink<'_, S>,
    ) {
        for c in 0..3 {
            sink.put(window::residual(c), composition.result(c));
        }
        if COLUMNS {
            // By name, so that the match in `derivative` is resolved while compiling.
            macro_rules! put {
                ($($param:ident)*) => {$(
                    if self.plan.free[Param::$param.index()] {
                        for c in 0..3 {
                            let column = composition.derivative(Param::$param, c);
                            sink.put(window::column(c, Param::$param), column);
                        }
                    }
                )*};
            }
            put!(BaseWeight RimWeight RimExponent Hilite Reflection SideSpecular Occlusion KeyColor);
        }
        if self.compares_alpha() {
            sink.put(window::residual(ALPHA), composition.alpha());
            if COLUMNS {
                sink.put(window::column(ALPHA, Param::HazeWeight), composition.terms.haze);
            }
        }
    }

    /// The column of a parameter that moves lookups.
    #[inline(always)]
    fn put_slope(
        &self,
        param: Param,
        composition: &Composition<Lanes<S>>,
        slope: &Terms<Lanes<S>>,
        sink: &mut Sink<'_, S>,
    ) {
        for c in 0..3 {
            sink.put(window::column(c, param), composition.along(slope, c));
        }
        if self.compares_alpha() {
            sink.put(window::column(ALPHA, param), composition.alpha_along(slope));
        }
    }

    #[inline(always)]
    fn compares_alpha(&self) -> bool {
        self.plan.channels.len() > ALPHA
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
}

/// Where a sample's numbers go: stored, or (where a pixel has several samples) stored by the pixel's first
/// sample and added by the others, with their weights.
struct Sink<'a, S: Simd> {
    window: &'a mut Window,
    weight: Option<Lanes<S>>,
    add: bool,
}

impl<S: Simd> Sink<'_, S> {
    /// `place` is known when this is compiled.
    #[inline(always)]
    fn put(&mut self, place: usize, value: Lanes<S>) {
        let row = &mut self.window[place];
        match self.weight {
            None => value.store(row),
            Some(weight) if self.add => weight.mul_add(value, Lanes::of_row(value.0.simd, row)).store(row),
            Some(weight) => (weight * value).store(row),
        }
    }
}

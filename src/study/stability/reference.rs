//! The reference: the model in f64, and how far rounding may move it.
//!
//! A tolerance that is one number for every input would be too wide for most and too narrow for a few: next
//! to a texel of 65504 a direction's last bit moves the light by a hundredth of it. So each fragment is
//! evaluated in f64 as given, and again with every number moved by a few units in the last place of an f32:
//! what it is given, texels of lights, and what an f32 must round on the way, where later steps cancel (the
//! shading normal, the reflection, their derivatives, S.z). What that does to the result, an evaluator in
//! f32 may do as well.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use super::case::{Batch, FragmentInputs, Setting};
use super::evaluate::{Rgba, Slopes, TARGET};
use super::lights::LightBox;
use super::rules::{Rules, Shading};
use crate::engine::cubes_at::CubesAt;
use crate::engine::residual::{Residuals, Weighted};
use crate::model::batch::Batch as Several;
use crate::model::effects::Silhouette;
use crate::model::fragment::Fragment;
use crate::model::params::{Param, Params};
use crate::model::vector::dot;
use crate::program::shading::ShadingError;

/// By how much each number is moved, as a share of itself (of the largest component of its vector): eight
/// roundings of 2^-24 either way, as many as lie one behind the other between an input and what a lookup or
/// a power makes of it.
const RADIUS: f64 = 8.0 / (1 << 24) as f64;
/// By how much texels are moved, as a share of themselves: one rounding of a blend.
const ROUNDED: f64 = 1.0 / (1 << 23) as f64;
/// A component below the smallest normal f32 may be flushed to 0 (WGSL permits it).
const FLUSHED: f64 = 1.2e-38;
/// What the greatest change among random moves is multiplied with: the worst roundings are rarely among them,
/// and those of several steps add up.
pub(super) const SPREAD: f64 = 4.0;
/// What roundings of sums add, as a share of the summands: some fifty of 2^-24, of either sign.
pub(super) const SUMMED: f64 = 5e-6;
/// Nothing below is told apart from 0: products of two factors above it do not vanish in an f32.
pub(super) const TINY: f64 = 1e-18;
/// How often each fragment is moved: first, and again where that was too few to be sure.
pub const FEW: usize = 6;
/// See [`FEW`]: near a corner of the function there are many sides to fall on.
pub const MANY: usize = 400;
/// How many times all texels are rounded at most.
const MOST_CUBES: usize = 24;

/// Entries of the packed upper triangle of J^T J.
pub const PAIRS: usize = Param::COUNT * (Param::COUNT + 1) / 2;

/// One fragment in f64.
#[derive(Clone, Debug)]
pub struct FragmentReference {
    /// As given.
    pub value: Rgba,
    /// Its derivatives as given.
    pub slopes: Slopes,
    /// How far the colour may be off.
    pub value_tolerance: Rgba,
    /// How far the derivatives may be off.
    pub slope_tolerance: Slopes,
    /// The largest that rounding makes of each channel.
    pub value_size: Rgba,
    /// The largest that rounding makes of each derivative.
    pub slope_size: Slopes,
    /// What it adds to the sums, and how far that may be off.
    contribution: Contribution,
    contribution_tolerance: Contribution,
}

/// What a fragment adds to the sums of engines.
#[derive(Clone, Debug)]
struct Contribution {
    loss: f64,
    residual: f64,
    jtr: [f64; Param::COUNT],
    jtj: [f64; PAIRS],
}

impl Contribution {
    const NOTHING: Self = Self { loss: 0.0, residual: 0.0, jtr: [0.0; Param::COUNT], jtj: [0.0; PAIRS] };

    fn of(residuals: &Residuals, value: &Rgba, slopes: &Slopes) -> Self {
        let mut sum = Self::NOTHING;
        let target = TARGET.map(f64::from);
        let all = residuals.weigh(None, Several(*value), Several(target), Several([1.0; 4]));
        for (c, Weighted { loss, scale, residual }) in all.each().enumerate() {
            sum.loss += loss;
            sum.residual += residual * residual;
            let mut at = 0;
            for a in 0..Param::COUNT {
                let row = scale * slopes[a][c];
                sum.jtr[a] += row * residual;
                for b in a..Param::COUNT {
                    sum.jtj[at] += row * scale * slopes[b][c];
                    at += 1;
                }
            }
        }
        sum
    }

    fn combine(&mut self, other: &Self, with: impl Fn(&mut f64, f64)) {
        with(&mut self.loss, other.loss);
        with(&mut self.residual, other.residual);
        self.jtr.iter_mut().zip(other.jtr).for_each(|(a, b)| with(a, b));
        self.jtj.iter_mut().zip(other.jtj).for_each(|(a, b)| with(a, b));
    }
}

/// The sums over a batch, and how far they may be off.
#[derive(Clone, Debug)]
pub struct SumReference {
    /// (value, tolerance) of the summed loss.
    pub loss: (f64, f64),
    /// Of the weighted squared residuals.
    pub residual: (f64, f64),
    /// Of J^T r.
    pub jtr: Vec<(f64, f64)>,
    /// Of J^T J, the upper triangle row by row.
    pub jtj: Vec<(f64, f64)>,
}

/// A batch in f64.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Each fragment.
    pub fragments: Vec<FragmentReference>,
}

impl Reference {
    /// The batch in f64, each fragment moved `moves` times.
    ///
    /// # Errors
    /// When the rules cannot be computed on the processor.
    pub fn new(lights: &LightBox, batch: &Batch, moves: usize) -> Result<Self, ShadingError> {
        let setting = &batch.setting;
        let light = lights.of(setting.lights);
        let rules = Rules::of(setting.setup, light)?;
        let residuals = Residuals::new(setting.loss);
        let cubes = CubesAt::new(light, &setting.params, f64::from);
        let mut rng = StdRng::seed_from_u64(0);
        let mut rounded = || {
            let mut texels = Moves::new(&mut rng, 0);
            cubes.changed(|x| texels.texel(x))
        };
        // With few of them the worst rounding of a difference of texels may not be among them.
        let others: Vec<_> = (0..(moves / 2).clamp(3, MOST_CUBES)).map(|_| rounded()).collect();
        // The same moves for each, so that a fragment fares alike alone and among others.
        let each = |inputs| {
            one(
                setting,
                (&rules, &residuals),
                (&cubes, &others),
                inputs,
                moves,
                &mut StdRng::seed_from_u64(1),
            )
        };
        Ok(Self { fragments: batch.fragments.par_iter().map(each).collect() })
    }

    /// The sums over all fragments.
    #[must_use]
    pub fn sums(&self) -> SumReference {
        let (mut sum, mut wide) = (Contribution::NOTHING, Contribution::NOTHING);
        for fragment in &self.fragments {
            sum.combine(&fragment.contribution, |a, b| *a += b);
            wide.combine(&fragment.contribution_tolerance, |a, b| *a += b);
        }
        // Products of f32 are rounded as shares of what Cauchy-Schwarz bounds them by.
        let diagonal: Vec<f64> = (0..Param::COUNT).map(|a| sum.jtj[pair(a, a)].sqrt()).collect();
        let root = sum.residual.sqrt();
        let jtr = (0..Param::COUNT)
            .map(|a| (sum.jtr[a], wide.jtr[a] + SUMMED * diagonal[a] * root + TINY))
            .collect();
        let pairs = (0..Param::COUNT).flat_map(|a| (a..Param::COUNT).map(move |b| (a, b)));
        let jtj = pairs
            .map(|(a, b)| {
                let at = pair(a, b);
                (sum.jtj[at], wide.jtj[at] + SUMMED * diagonal[a] * diagonal[b] + TINY)
            })
            .collect();
        SumReference {
            loss: (sum.loss, wide.loss + SUMMED * sum.loss + TINY),
            residual: (sum.residual, wide.residual + SUMMED * sum.residual + TINY),
            jtr,
            jtj,
        }
    }
}

/// Where (a, b), a <= b, stands in the packed triangle.
#[must_use]
pub const fn pair(a: usize, b: usize) -> usize {
    a * Param::COUNT - a * (a + 1) / 2 + b
}

fn one(
    setting: &Setting,
    (rules, residuals): (&Rules, &Residuals),
    (cubes, others): (&CubesAt<f64>, &[CubesAt<f64>]),
    inputs: &FragmentInputs,
    moves: usize,
    rng: &mut StdRng,
) -> FragmentReference {
    let setup = setting.setup;
    let evaluate =
        |cubes: &CubesAt<f64>, inputs: &FragmentInputs, params: &Params, moves: Option<&mut Moves<'_>>| {
            let f = inputs.fragment(setup, 0.0_f64);
            let at = rules.at(params, cubes);
            let mut s = rules.shading(&at, &f);
            if let Some(moves) = moves {
                round_shading(&mut s, &f, (setup.silhouette, params.scalar(Param::NormalStrength)), moves);
            }
            let shaded = rules.shaded(&at, &f, &s);
            (shaded.rgba, shaded.slopes, shaded.summands)
        };
    let (value, slopes, summands) = evaluate(cubes, inputs, &setting.params, None);
    // The key light's term is a difference of two Lambert terms, each as large as this.
    let key = |c: usize| if c < 3 { inputs.albedo[c].abs() } else { 0.0 };
    let mut value_tolerance: Rgba = std::array::from_fn(|c| {
        let light = key(c) * setting.params.rgb(Param::KeyColor)[c % 3].abs();
        SUMMED * (summands[c] + value[c].abs() + light) + TINY
    });
    let mut slope_tolerance: Slopes = std::array::from_fn(|p| {
        std::array::from_fn(|c| {
            let color = setting.params.rgb(Param::KeyColor)[c % 3].abs();
            let parts = match Param::built_in().nth(p) {
                Some(Param::KeyColor) => key(c),
                Some(Param::KeyAzimuth | Param::KeyElevation) => key(c) * color,
                _ => 0.0,
            };
            SUMMED * (2.0 * slopes[p][c].abs() + parts) + TINY
        })
    });
    let contribution = Contribution::of(residuals, &value, &slopes);
    let mut contribution_tolerance = Contribution::NOTHING;
    let (mut value_size, mut slope_size) = (value.map(f64::abs), slopes.map(|slope| slope.map(f64::abs)));
    for number in 0..moves {
        let mut moves = Moves::new(rng, number);
        let (moved, params) = (moved(inputs, &mut moves), moved_params(&setting.params, &mut moves));
        let cubes = &others[number % others.len()];
        let (other, other_slopes, _) = evaluate(cubes, &moved, &params, Some(&mut moves));
        // SMAPE turns where the model changes its sign: one that is nothing to an f32 may have either.
        let other = other.map(|x| x + TINY * moves.step());
        let widen = |tolerance: &mut f64, a: f64, b: f64| *tolerance = tolerance.max(SPREAD * (a - b).abs());
        for c in 0..4 {
            widen(&mut value_tolerance[c], other[c], value[c]);
            value_size[c] = value_size[c].max(other[c].abs());
            for p in 0..Param::COUNT {
                widen(&mut slope_tolerance[p][c], other_slopes[p][c], slopes[p][c]);
                slope_size[p][c] = slope_size[p][c].max(other_slopes[p][c].abs());
            }
        }
        let mut difference = Contribution::of(residuals, &other, &other_slopes);
        difference.combine(&contribution, |a, b| *a = SPREAD * (*a - b).abs());
        contribution_tolerance.combine(&difference, |a, b| *a = a.max(b));
    }
    FragmentReference {
        value,
        slopes,
        value_tolerance,
        slope_tolerance,
        value_size,
        slope_size,
        contribution,
        contribution_tolerance,
    }
}

/// What an f32 rounds off the shading normal and what follows from it. Only differences of their like feel
/// it: 1 - |n.V| near 1, what is left of the bump across n, light along n less that along N.
fn round_shading(
    s: &mut Shading<f64>,
    f: &Fragment<f64>,
    (at, strength): (Silhouette, f64),
    moves: &mut Moves<'_>,
) {
    let size = |v: [f64; 3]| v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let mut round = |v: &mut [f64; 3], size: f64| {
        v.iter_mut().for_each(|x| *x += RADIUS * size * moves.step());
    };
    let length = size(std::array::from_fn(|i| f.base[i] + strength * f.bump[i]));
    // At 1e6 the model itself cuts the derivative off.
    let turning = (size(f.bump) / length.max(f64::MIN_POSITIVE)).min(1e6 / RADIUS);
    let n = size(s.n);
    round(&mut s.n, n);
    let reflection = size(s.reflection).max(2.0 * n);
    round(&mut s.reflection, reflection);
    if s.n_tangent != [0.0; 3] {
        round(&mut s.n_tangent, turning);
        round(&mut s.reflection_tangent, 4.0 * turning);
    }
    // Where it is given (not found from n) its own roundings are among the inputs'.
    if at == Silhouette::Bumped {
        let turned = dot(s.n_tangent, f.view);
        if s.silhouette < RADIUS {
            // In an f32 |n.V| may be 1 already, or not yet.
            s.silhouette_tangent = turned * moves.step();
        } else if s.silhouette_tangent != 0.0 {
            s.silhouette_tangent += RADIUS * turning * moves.step();
        }
        s.silhouette = (s.silhouette + RADIUS * moves.step()).max(0.0);
    }
}

pub(super) fn moved(inputs: &FragmentInputs, moves: &mut Moves<'_>) -> FragmentInputs {
    let mut moved = *inputs;
    for vector in
        [&mut moved.texel, &mut moved.tangent, &mut moved.bitangent, &mut moved.normal, &mut moved.view]
    {
        let size = vector.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        // A vector of nothing but zeros stays: every evaluator sees that.
        if size > 0.0 && size.is_finite() {
            vector.iter_mut().for_each(|x| *x += (RADIUS * size + FLUSHED) * moves.step());
        }
    }
    let FragmentInputs { occlusion, silhouette, dapple, albedo, specular, attenuator, .. } = &mut moved;
    for x in [occlusion, silhouette, dapple, specular, attenuator].into_iter().chain(albedo) {
        let flushed = if *x == 0.0 { 0.0 } else { FLUSHED };
        *x += (RADIUS * x.abs() + flushed) * moves.step();
    }
    moved
}

/// The parameters that evaluators round to f32; angles they turn into sines and cosines in f64.
pub(super) fn moved_params(params: &Params, moves: &mut Moves<'_>) -> Params {
    let mut moved = params.clone();
    for param in Param::built_in() {
        let fixed = [Param::SpecularLobe, Param::EnvironmentRotation, Param::KeyAzimuth, Param::KeyElevation];
        if !fixed.contains(&param) {
            let factor = 1.0 + RADIUS * moves.step();
            moved.set_rgb(param, params.rgb(param).map(|x| x * factor));
        }
    }
    moved
}

/// How numbers are moved, and how far at most, as a share of what is allowed.
pub(super) struct Moves<'a> {
    rng: &'a mut StdRng,
    reach: f64,
}

impl<'a> Moves<'a> {
    /// Move `number`: the first few on the edge of what is allowed, as most is moved there; then every other one
    /// somewhere inside, where a sum that cancels on the edge may not.
    pub(super) fn new(rng: &'a mut StdRng, number: usize) -> Self {
        let reach = if number < FEW || number.is_multiple_of(2) { 1.0 } else { rng.random_range(0.0..1.0) };
        Self { rng, reach }
    }

    /// A number moved by what f32 rounds.
    pub(super) fn number(&mut self, x: f64) -> f64 {
        x * (1.0 + RADIUS * self.step())
    }

    /// A number moved by what f32 rounds of it where it is added to 1.
    pub(super) fn beside_one(&mut self, x: f64) -> f64 {
        x + RADIUS * x.abs().max(1.0) * self.step()
    }

    /// A texel moved by what a blend rounds.
    pub(super) fn texel(&mut self, x: f64) -> f64 {
        x * (1.0 + ROUNDED * self.step())
    }

    /// A vector's numbers moved by what f32 rounds of the largest; of nothing but zeros none.
    pub(super) fn vector(&mut self, v: [f32; 3]) -> [f32; 3] {
        let size = v.iter().fold(0.0_f64, |most, x| most.max(f64::from(x.abs())));
        v.map(|x| (f64::from(x) + RADIUS * size * self.step()) as f32)
    }

    /// Down, not at all, or up.
    fn step(&mut self) -> f64 {
        self.reach * f64::from(self.rng.random_range(-1_i32..=1))
    }
}

//! Every evaluator of the model behind one face: the only file here that knows how the library is called.
//!
//! A scene of the [witness](crate::witness) goes in; out come images, losses, gradients and normal equations.
//!
//! - `Plain`: the f64 reference that `--verify` compares with
//! - `Single`: the rules over single fragments, in f64, f32 and sixteen SIMD lanes of each instruction set
//! - `Cpu`: the CPU engine at each of them
//! - `OnAdapter`: the engine on a graphics adapter
//! - `Tensors`: the model on burn's tensors, with reverse-mode derivatives

use skinfit::model::gain::Gain;
use std::sync::Arc;

use fearless_simd::Level;
use skinfit::bake::{Illumination, LobeStack};
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::lanes::Lanes;
use skinfit::engine::reference::Reference;
use skinfit::engine::residual::Residuals;
use skinfit::engine::view::ObservedView;
use skinfit::engine::{self, Objective, Point, Task};
use skinfit::fit::{self, FitOptions, Tolerances};
use skinfit::model::cube::{Channel, Cube};
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{self, Effect, Effects};
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::{Fragment, guarded};
use skinfit::model::params::{Channels, Column, Param, Params};
use skinfit::samples::rows::{Row, Rows};
use skinfit::samples::surface_records::{Asked, Unmade};
use skinfit::samples::{LANES, SurfaceRecords, ViewSamples};
use skinfit::scene;
use skinfit::scene::view::Clip;
use skinfit::simd::levels;
use skinfit_core::program::graph::Input;

use crate::by_rules::{Cubes, Fragments, Number, Wanted};
use crate::witness::cube::Cube as WitnessCube;
use crate::witness::fragment::{
    Constants, Form, Lights as WitnessLights, Silhouette, Surface, Variant, shade,
};
use crate::witness::losses::Loss;
use crate::witness::scene::{At, Pixel, Scene, Unknown, View, gained};

/// What an evaluator gives; what it has no means for is `None`.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// The loss, once by each pass that tells it.
    pub(crate) losses: Vec<f64>,
    pub(crate) gradient: Vec<f64>,
    pub(crate) normal: Option<Normal>,
}

/// Normal equations.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub(crate) weight: f64,
    pub(crate) residual: f64,
    pub(crate) jtr: Vec<f64>,
    pub(crate) jtj: Vec<f64>,
}

/// How many bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Width {
    Single,
    Double,
}

/// One evaluator.
pub(crate) trait Evaluator {
    fn name(&self) -> String;
    /// In which numbers it computes.
    fn computes(&self) -> Width;
    /// In which numbers surfaces and cubes are stored.
    fn stores(&self) -> Width;
    /// Each view's image, gains applied.
    fn image(&self, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>>;
    /// Loss, gradient and normal equations.
    fn equations(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found;
}

/// Those that need no graphics adapter.
pub(crate) fn on_cpu() -> Vec<Box<dyn Evaluator>> {
    let mut all: Vec<Box<dyn Evaluator>> =
        vec![Box::new(Plain), Box::new(Single(0.0_f64)), Box::new(Single(0.0_f32))];
    for level in levels() {
        all.push(Box::new(AtLevel(level)));
        all.push(Box::new(Cpu(level)));
    }
    all
}

/// Those that need one; none, and said so, where `SKINFIT_NO_GPU_TESTS` allows it.
pub(crate) fn on_adapter() -> Vec<Box<dyn Evaluator>> {
    let mut all: Vec<Box<dyn Evaluator>> = Vec::new();
    if let Some(gpu) = crate::graphics::bench::gpu() {
        all.push(Box::new(adapter::OnAdapter(gpu)));
    }
    #[cfg(feature = "burn")]
    if let Some(shared) = crate::tensors::bench::shared() {
        all.push(Box::new(tensors::Tensors(shared)));
    }
    all
}

/// The names of the library's parameters, and whether each may have a value a channel.
pub(crate) fn parameters() -> Vec<(&'static str, bool)> {
    Param::built_in().map(|param| (param.name(), param.info().rgb)).collect()
}

/// One residual: its loss, d loss / d model, and what its square counts in J^T J.
pub(crate) fn residual<R: Number>(like: R, loss: Loss, clip: Option<[f64; 2]>, given: [f64; 3]) -> [f64; 3] {
    let [model, target, weight] = given.map(|x| like.lit(x));
    let row = residuals(loss).weigh(clip.map(clip_of), model, target, weight);
    let first = |x: R| x.unpack()[0];
    let scale = first(row.scale);
    [first(row.loss), 2.0 * scale * first(row.residual), scale * scale]
}

/// What a fit says of its unknowns.
pub(crate) struct Fitted {
    pub(crate) values: Vec<f64>,
    pub(crate) std_errors: Vec<f64>,
    /// Row-major.
    pub(crate) correlations: Vec<f64>,
    pub(crate) loss: f64,
}

/// A fit on the CPU engine, on to where roundings are all that is left.
pub(crate) fn fitted(scene: &Scene, start: &At, unknowns: &[Unknown]) -> Fitted {
    let engine = cpu_engine(scene, unknowns, Level::new());
    let tolerances = Tolerances { gain: 1e-13, error: 1e-4, ..Tolerances::default() };
    let options = FitOptions { tolerances, ..FitOptions::default() };
    let outcome = fit::fit(&engine, &point(start), &options, &mut |_| {}).unwrap();
    Fitted {
        values: outcome.unknowns.iter().map(|u| u.value).collect(),
        std_errors: outcome.unknowns.iter().map(|u| u.std_error.unwrap()).collect(),
        correlations: outcome.correlations,
        loss: outcome.loss_end,
    }
}

// From the witness' words to the library's.

const EFFECTS: Effects = Effects::SURFACE.with(Effect::Haze).with(Effect::KeyLight);

fn setup(scene: &Scene) -> Setup {
    let form = match scene.form {
        Form::Listing => effects::Form::Listing,
        Form::Corrected => effects::Form::Corrected,
    };
    let silhouette = match scene.silhouette {
        Silhouette::Vertex => effects::Silhouette::Vertex,
        Silhouette::Fragment => effects::Silhouette::Fragment,
        Silhouette::Bumped => effects::Silhouette::Bumped,
    };
    let Variant { smooth_lookups, dapple_axis, interpolated_rim } = scene.variant;
    Setup {
        lookups: if smooth_lookups { effects::Lookups::Smooth } else { effects::Lookups::Bumped },
        dapple: dapple_axis.map_or(Dapple::default(), |axis| Dapple::new(axis, 0.0, true)),
        interpolated_rim,
        ..Setup::new(form, silhouette, EFFECTS)
    }
}

fn loss_of(loss: Loss) -> scene::Loss {
    match loss {
        Loss::L2 => scene::Loss::L2,
        Loss::RelativeL2 => scene::Loss::RelativeL2,
        Loss::Huber => scene::Loss::Huber,
        Loss::Smape => scene::Loss::Smape,
    }
}

fn residuals(loss: Loss) -> Residuals {
    Residuals::new(loss_of(loss))
}

fn clip_of([low, high]: [f64; 2]) -> Clip {
    Clip { low: low as f32, high: high as f32 }
}

fn params(constants: &Constants) -> Params {
    let (mut params, mut constants) = (Params::defaults(effects::Form::Corrected), *constants);
    for param in Param::built_in() {
        params.set_rgb(param, *constants.of(param.name()));
    }
    params
}

fn point(at: &At) -> Point {
    Point { params: params(&at.constants), gains: at.gains.iter().copied().map(Gain).collect() }
}

fn column(unknown: Unknown) -> Option<Column> {
    let (name, channels) = match unknown {
        Unknown::Tied(name) => (name, Channels::Tied),
        Unknown::Channel(name, c) => (name, Channels::One(c)),
        Unknown::Gain(_) | Unknown::ChannelGain(..) => return None,
    };
    Some(Column { param: Param::from_name(name).unwrap(), channels })
}

/// The channel whose gain a channel has: alpha has green's.
const fn alike(c: usize) -> usize {
    if c < 3 { c } else { 1 }
}

fn unknowns_of(unknowns: &[Unknown]) -> Vec<engine::Unknown> {
    let of = |&unknown: &Unknown| match unknown {
        Unknown::Gain(view) => engine::Unknown::Gain(view, Channels::Tied),
        Unknown::ChannelGain(view, c) => engine::Unknown::Gain(view, Channels::One(c)),
        other => engine::Unknown::Param(column(other).unwrap()),
    };
    unknowns.iter().map(of).collect()
}

fn cube<T: Channel>(cube: &WitnessCube, to: impl Fn(f64) -> T) -> Cube<T> {
    Cube::from_fn(cube.size, |face, column, row| cube.texel(face, column, row).map(&to))
}

fn illumination(scene: &Scene) -> Arc<Illumination> {
    let single = |of: &WitnessCube| cube(of, |x| x as f32);
    Arc::new(Illumination {
        irradiance: Some(single(&scene.lights.irradiance)),
        lobes: Some(LobeStack {
            exponents: scene.lights.lobes.iter().map(|(exponent, _)| *exponent).collect(),
            cubes: scene.lights.lobes.iter().map(|(_, cube)| single(cube)).collect(),
        }),
        hilite: Some(single(&scene.lights.hilite)),
        reflected: None,
    })
}

/// The witness' formulas in the library's words: all built-in terms.
pub(crate) struct ByWitness {
    form: Form,
    silhouette: Silhouette,
    lights: WitnessLights,
    constants: Constants,
}

impl ByWitness {
    /// At `params`, in the light of E_d, of E_s at their exponent and of E_h; what is off among a setup's effects has a
    /// weight of 0.
    pub(crate) fn new(
        setup: Setup,
        [irradiance, specular, hilite]: [&Cube<f64>; 3],
        params: &Params,
    ) -> Self {
        let form = match setup.form {
            effects::Form::Listing => Form::Listing,
            effects::Form::Corrected => Form::Corrected,
        };
        let silhouette = match setup.silhouette {
            effects::Silhouette::Vertex => Silhouette::Vertex,
            effects::Silhouette::Fragment => Silhouette::Fragment,
            effects::Silhouette::Bumped => Silhouette::Bumped,
        };
        let mut constants = Constants::defaults(form);
        for param in Param::built_in() {
            let asked_for = param.asked_for(setup.effects);
            *constants.of(param.name()) = if asked_for { params.rgb(param) } else { [0.0; 3] };
        }
        let cube = |cube: &Cube<f64>| {
            let size = cube.size();
            let texel = |i: usize| cube.texel(i / (size * size), i % size, i / size % size);
            WitnessCube::of_numbers(size, &(0..6 * size * size).flat_map(texel).collect::<Vec<_>>())
        };
        let lights = WitnessLights {
            irradiance: cube(irradiance),
            lobes: vec![(params.scalar(Param::SpecularLobe), cube(specular))],
            hilite: cube(hilite),
        };
        Self { form, silhouette, lights, constants }
    }

    /// Radiance and haze of a fragment.
    pub(crate) fn shade(&self, f: &Fragment<f64>) -> [f64; 4] {
        let surface = Surface {
            base: f.base,
            bump: f.bump,
            normal: f.normal,
            view: f.view,
            open: f.occlusion,
            silhouette: f.silhouette,
            corners: [[f.silhouette; 3], [1.0, 0.0, 0.0]],
            dapple: f.dapple,
            albedo: f.albedo,
            specular: f.specular,
            attenuator: f.attenuator,
        };
        let Self { form, silhouette, lights, constants } = self;
        shade(*form, *silhouette, Variant::default(), &surface, lights, constants).rgba
    }
}

/// A surface as samples hold it.
fn stored(f: &Surface) -> (Fragment<f32>, Unmade) {
    let three = |v: [f64; 3]| v.map(|x| x as f32);
    let (base, bump) = guarded(three(f.base), three(f.bump), three(f.view));
    let fragment = Fragment {
        base,
        bump,
        normal: three(f.normal),
        view: three(f.view),
        occlusion: f.open as f32,
        silhouette: f.silhouette as f32,
        dapple: f.dapple as f32,
        albedo: three(f.albedo),
        specular: f.specular as f32,
        attenuator: f.attenuator as f32,
    };
    let [corner_silhouettes, corner_shares] = f.corners.map(three);
    (
        fragment,
        Unmade {
            dapple_normal: fragment.normal,
            corner_silhouettes,
            corner_shares,
            uv: [0.0; 2],
            chart: 0.0,
        },
    )
}

/// A view as engines read it: groups of sixteen pixels, with as many records as one of them has samples. Pixels that
/// fill the last group up count nothing.
fn observed(view: &View) -> ObservedView {
    let groups: Vec<&[Pixel]> = view.pixels.chunks(LANES).collect();
    let records = |group: &[Pixel]| group.iter().map(|pixel| pixel.samples.len()).max().unwrap_or(1);
    let count = groups.iter().map(|group| records(group)).sum();
    let asked = Asked { dapple_normal: true, corners: true, ..Asked::EVERYTHING };
    let mut samples = ViewSamples { group_start: vec![0], ..ViewSamples::default() };
    samples.surface = SurfaceRecords::new(asked, count);
    samples.pixel = (0..(LANES * groups.len()) as u32).collect();
    samples.coverage = vec![1.0; LANES * groups.len()];
    let (mut target, mut weight) = (Rows::new(4, groups.len()), vec![Row::ZERO; groups.len()]);
    for (g, group) in groups.iter().enumerate() {
        let first = samples.group_start[g];
        for lane in 0..LANES {
            let pixel = &group[lane.min(group.len() - 1)];
            for record in 0..records(group) {
                let sample = &pixel.samples[record.min(pixel.samples.len() - 1)];
                let there = lane < group.len() && record < pixel.samples.len();
                let share = if there { sample.share as f32 } else { 0.0 };
                let slot = (first as usize + record) * LANES + lane;
                samples.surface.set_all(slot, &stored(&sample.surface), share);
            }
            if lane < group.len() {
                (0..4).for_each(|c| target.record_mut(g)[c][lane] = pixel.target[c] as f32);
                weight[g][lane] = pixel.weight as f32;
            }
        }
        samples.group_start.push(first + records(group) as u32);
    }
    ObservedView { samples, target, weight, clip: view.clip.map(clip_of) }
}

fn all_observed(scene: &Scene) -> Vec<ObservedView> {
    scene.views.iter().map(observed).collect()
}

/// What all passes of an objective say.
fn of_objective(objective: &dyn Objective, at: &At) -> Found {
    let point = point(at);
    let (normal, (loss, gradient)) = (objective.normal_equations(&point), objective.gradient(&point));
    Found {
        losses: vec![objective.loss(&point), loss, normal.loss],
        gradient,
        normal: Some(Normal {
            weight: normal.weight,
            residual: normal.residual,
            jtr: normal.jtr,
            jtj: normal.jtj,
        }),
    }
}

/// An engine's planes as the scene's pixels.
fn pixels(view: &View, planes: &[Vec<f32>]) -> Vec<[f64; 4]> {
    (0..view.pixels.len()).map(|i| std::array::from_fn(|c| f64::from(planes[c][i]))).collect()
}

struct Plain;

impl Evaluator for Plain {
    fn name(&self) -> String {
        "engine::reference".to_owned()
    }
    fn computes(&self) -> Width {
        Width::Double
    }
    fn stores(&self) -> Width {
        Width::Single
    }
    fn image(&self, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>> {
        let (light, views, point) = (illumination(scene), all_observed(scene), point(at));
        let plain = Reference::new(setup(scene), &light, &views, scene::Loss::L2, &[]).unwrap();
        let pixel = |view: usize, slot: usize| {
            gained(plain.pixel(view, slot, &point.params).map(|(value, _)| value), point.gains[view].0)
        };
        let image = |(v, view): (usize, &View)| (0..view.pixels.len()).map(|slot| pixel(v, slot)).collect();
        scene.views.iter().enumerate().map(image).collect()
    }
    fn equations(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found {
        let (light, views) = (illumination(scene), all_observed(scene));
        let plain = Reference::new(setup(scene), &light, &views, loss_of(scene.loss), &unknowns_of(unknowns))
            .unwrap();
        of_objective(&plain, at)
    }
}

/// A fit of a scene.
fn task(scene: &Scene, unknowns: &[Unknown]) -> Task {
    Task {
        setup: setup(scene),
        illumination: illumination(scene),
        views: all_observed(scene).into(),
        loss: loss_of(scene.loss),
        unknowns: unknowns_of(unknowns),
    }
}

fn cpu_engine(scene: &Scene, unknowns: &[Unknown], level: Level) -> CpuEngine {
    let mut engine = CpuEngine::new(task(scene, unknowns)).unwrap();
    engine.set_level(level);
    engine
}

/// The CPU engine with the instructions of a level.
struct Cpu(Level);

impl Evaluator for Cpu {
    fn name(&self) -> String {
        format!("engine::cpu at {:?}", self.0)
    }
    fn computes(&self) -> Width {
        Width::Single
    }
    fn stores(&self) -> Width {
        Width::Single
    }
    fn image(&self, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>> {
        let (engine, point) = (cpu_engine(scene, &[], self.0), point(at));
        let image = |(v, view): (usize, &View)| pixels(view, &engine.image(v, &point));
        scene.views.iter().enumerate().map(image).collect()
    }
    fn equations(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found {
        of_objective(&cpu_engine(scene, unknowns, self.0), at)
    }
}

/// The rules over single fragments, in the numbers that one of them stands for.
struct Single<R>(R);

/// The cubes of a scene in the texels of a kind of number.
fn number_cubes<R: Number>(scene: &Scene, at: &At) -> Cubes<R::Texel> {
    let own = |of: &WitnessCube| cube(of, R::texel);
    // A single cube is taken as it is; between cubes stands what the library puts there, in f32.
    let (specular, specular_slope) = match &scene.lights.lobes[..] {
        [(_, only)] => (own(only), own(only).map(|_| [R::texel(0.0); 4])),
        _ => {
            let (value, slope) =
                illumination(scene).lobes.as_ref().unwrap().at(at.constants.specular_lobe[0]);
            let wide = |cube: &Cube<f32>| cube.map(|texel| texel.map(|x| R::texel(x.into())));
            (wide(&value), wide(&slope))
        }
    };
    Cubes {
        irradiance: own(&scene.lights.irradiance),
        specular,
        specular_slope,
        hilite: own(&scene.lights.hilite),
    }
}

/// A number of a sample by the rules' name.
fn field(f: &Surface, Input { name, component }: &Input) -> f64 {
    match name.as_str() {
        "base" => f.base[*component],
        "bump" => f.bump[*component],
        "normal" | "dapple_normal" => f.normal[*component],
        "view" => f.view[*component],
        "albedo" => f.albedo[*component],
        "open" => f.open,
        "silhouette" => f.silhouette,
        "corner_silhouettes" => f.corners[0][*component],
        "corner_shares" => f.corners[1][*component],
        "dapple" => f.dapple,
        "specular" => f.specular,
        "attenuator" => f.attenuator,
        other => panic!("a sample has no {other}"),
    }
}

/// Means over the samples of as many pixels as a number holds: of radiance and haze, and of how they move.
fn means<R: Number>(fragments: &Fragments<'_, R>, like: R, pixels: &[Pixel]) -> Vec<[R; 4]> {
    let most = pixels.iter().map(|pixel| pixel.samples.len()).max().unwrap_or(0);
    let mut means: Vec<[R; 4]> = Vec::new();
    for k in 0..most {
        // A pixel without sample `k` has no share of it.
        let lane = |i: usize| {
            let pixel = &pixels[i.min(pixels.len() - 1)];
            let sample = &pixel.samples[k.min(pixel.samples.len() - 1)];
            (&sample.surface, if k < pixel.samples.len() { sample.share } else { 0.0 })
        };
        let lanes: Vec<(&Surface, f64)> = (0..R::COUNT).map(lane).collect();
        let pack =
            |of: &dyn Fn(&(&Surface, f64)) -> f64| like.pack(&lanes.iter().map(of).collect::<Vec<_>>());
        let shaded = fragments.shade(|input| pack(&|(surface, _)| field(surface, input)));
        let share = pack(&|(_, share)| *share);
        means.resize(1 + shaded.slopes.len(), [like.lit(0.0); 4]);
        for (mean, numbers) in means.iter_mut().zip([shaded.rgba].into_iter().chain(shaded.slopes)) {
            (0..4).for_each(|c| mean[c] = share.mul_add(numbers[c], mean[c]));
        }
    }
    means
}

fn image_in<R: Number>(like: R, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>> {
    let cubes = number_cubes::<R>(scene, at);
    let fragments = Fragments::new(setup(scene), &cubes, &params(&at.constants), &Wanted::default(), like);
    let view = |(view, gain): (&View, &[f64; 3])| {
        let gain = gained([1.0; 4], *gain);
        let chunk = |pixels: &[Pixel]| {
            let means = means(&fragments, like, pixels)[0];
            let light = [0, 1, 2, 3].map(|c| (like.lit(gain[c]) * means[c]).unpack());
            (0..pixels.len()).map(|i| [0, 1, 2, 3].map(|c| light[c][i])).collect::<Vec<_>>()
        };
        view.pixels.chunks(R::COUNT).flat_map(chunk).collect()
    };
    scene.views.iter().zip(&at.gains).map(view).collect()
}

/// Normal equations from single fragments' values and derivatives; only the sums over residuals are in f64.
fn equations_in<R: Number>(like: R, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found {
    let mut wanted = Wanted::default();
    for Column { param, .. } in unknowns.iter().filter_map(|&unknown| column(unknown)) {
        if !wanted.free.contains(&param) {
            wanted.free.push(param);
        }
    }
    let cubes = number_cubes::<R>(scene, at);
    let fragments = Fragments::new(setup(scene), &cubes, &params(&at.constants), &wanted, like);
    let residuals = residuals(scene.loss);
    let k = unknowns.len();
    let (mut loss, mut weights, mut square) = (0.0, 0.0, 0.0);
    let (mut jtr, mut jtj) = (vec![0.0; k], vec![0.0; k * k]);
    for (v, view) in scene.views.iter().enumerate() {
        let gain = gained([1.0; 4], at.gains[v]).map(|factor| like.lit(factor));
        for pixels in view.pixels.chunks(R::COUNT) {
            let means = means(&fragments, like, pixels);
            let (value, moved) = (means[0], &means[1..]);
            let slopes: Vec<[R; 4]> = unknowns
                .iter()
                .map(|&unknown| match unknown {
                    Unknown::Gain(of) if of == v => value,
                    Unknown::ChannelGain(of, own) if of == v => {
                        std::array::from_fn(|c| if alike(c) == own { value[c] } else { like.lit(0.0) })
                    }
                    Unknown::Gain(_) | Unknown::ChannelGain(..) => [like.lit(0.0); 4],
                    other => {
                        let Column { param, channels } = column(other).unwrap();
                        let all = moved[wanted.free.iter().position(|&free| free == param).unwrap()];
                        // Alpha has no channels of its own.
                        let own = |c: usize| c == 3 || channels.includes(c);
                        std::array::from_fn(|c| if own(c) { gain[c] * all[c] } else { like.lit(0.0) })
                    }
                })
                .collect();
            let lanes = |of: &dyn Fn(&Pixel) -> f64| {
                like.pack(&(0..R::COUNT).map(|i| pixels.get(i).map_or(0.0, of)).collect::<Vec<_>>())
            };
            let weight = lanes(&|pixel| pixel.weight);
            for c in 0..4 {
                let target = lanes(&|pixel| pixel.target[c]);
                let clip = view.clip.map(clip_of);
                let row = residuals.weigh(clip, gain[c] * value[c], target, weight);
                let (scale, residual) = (row.scale.unpack(), row.residual.unpack());
                let slopes: Vec<Vec<f64>> = slopes.iter().map(|slope| slope[c].unpack()).collect();
                loss += row.loss.unpack().iter().sum::<f64>();
                weights += weight.unpack().iter().sum::<f64>();
                for i in 0..R::COUNT {
                    square += residual[i] * residual[i];
                    for a in 0..k {
                        jtr[a] += scale[i] * slopes[a][i] * residual[i];
                        for b in 0..k {
                            jtj[a * k + b] += scale[i] * slopes[a][i] * scale[i] * slopes[b][i];
                        }
                    }
                }
            }
        }
    }
    Found {
        losses: vec![loss / weights],
        gradient: jtr.iter().map(|x| 2.0 * x / weights).collect(),
        normal: Some(Normal { weight: weights, residual: square, jtr, jtj }),
    }
}

impl<R: Number> Evaluator for Single<R> {
    fn name(&self) -> String {
        format!("rules over single fragments, {}", std::any::type_name::<R>())
    }
    fn computes(&self) -> Width {
        if size_of::<R>() == size_of::<f64>() { Width::Double } else { Width::Single }
    }
    fn stores(&self) -> Width {
        self.computes()
    }
    fn image(&self, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>> {
        image_in(self.0, scene, at)
    }
    fn equations(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found {
        equations_in(self.0, scene, at, unknowns)
    }
}

/// The rules over single fragments in SIMD lanes, with the instructions of a level.
struct AtLevel(Level);

impl Evaluator for AtLevel {
    fn name(&self) -> String {
        format!("rules in sixteen lanes at {:?}", self.0)
    }
    fn computes(&self) -> Width {
        Width::Single
    }
    fn stores(&self) -> Width {
        Width::Single
    }
    fn image(&self, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>> {
        skinfit_core::with_simd!(self.0, simd => image_in(Lanes::splat(simd, 0.0), scene, at))
    }
    fn equations(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found {
        skinfit_core::with_simd!(self.0, simd => equations_in(Lanes::splat(simd, 0.0), scene, at, unknowns))
    }
}

mod adapter {
    use skinfit::engine::gpu::{GpuEngine, Memory};
    use skinfit::gpu::Gpu;

    use super::{At, Evaluator, Found, Scene, Unknown, View, Width, of_objective, pixels, point, task};

    /// The engine on a graphics adapter.
    pub(super) struct OnAdapter(pub(super) &'static Gpu);

    impl OnAdapter {
        fn engine(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> GpuEngine {
            GpuEngine::new(self.0, task(scene, unknowns), &point(at), Memory::default()).unwrap()
        }
    }

    impl Evaluator for OnAdapter {
        fn name(&self) -> String {
            "engine::gpu".to_owned()
        }
        fn computes(&self) -> Width {
            Width::Single
        }
        fn stores(&self) -> Width {
            Width::Single
        }
        fn image(&self, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>> {
            let engine = self.engine(scene, at, &[]);
            let image = |(v, view): (usize, &View)| pixels(view, &engine.image(v, &point(at)).unwrap());
            scene.views.iter().enumerate().map(image).collect()
        }
        fn equations(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found {
            of_objective(&self.engine(scene, at, unknowns), at)
        }
    }
}

#[cfg(feature = "burn")]
mod tensors {
    use burn::tensor::{Tensor, TensorData};
    use skinfit::model::params::{Channels, Column, Param};
    use skinfit::samples::{LANES, ViewSamples};
    use skinfit::tensor::{Inputs, Scatter, Shade, Shaded, SharedDevice};

    use super::{
        At, Evaluator, Found, Scene, Unknown, Width, all_observed, clip_of, column, illumination, params,
        residuals, setup,
    };
    use super::{alike, gained};

    /// The model on burn's tensors: reverse mode, so that there is no J^T J.
    pub(super) struct Tensors(pub(super) &'static SharedDevice);

    fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f64> {
        tensor.into_data().try_to_vec::<f32>().unwrap().into_iter().map(f64::from).collect()
    }

    /// The columns of the operation and the unknown that each is of: all but the gains, which are factors on its image,
    /// and the lobe, which acts through its cube. A tied column holds its three channels at one value; the colours of
    /// these points have three, so each channel is a column, and their slopes add up.
    fn columns(unknowns: &[Unknown]) -> (Vec<Column>, Vec<usize>) {
        let of = |(i, &unknown): (usize, &Unknown)| {
            let channels = match column(unknown) {
                Some(Column { param: Param::SpecularLobe, .. }) | None => Vec::new(),
                Some(Column { param, channels: Channels::Tied }) if param.info().rgb => {
                    Column::per_channel(param).to_vec()
                }
                Some(column) => vec![column],
            };
            channels.into_iter().map(move |column| (column, i))
        };
        unknowns.iter().enumerate().flat_map(of).unzip()
    }

    impl Tensors {
        fn operation(&self, scene: &Scene, at: &At, columns: &[Column]) -> (Shade, Inputs) {
            let views = all_observed(scene);
            let samples: Vec<&ViewSamples> = views.iter().map(|view| &view.samples).collect();
            let (params, illumination) = (params(&at.constants), illumination(scene));
            let shaded =
                Shaded { setup: setup(scene), params: &params, columns, illumination: &illumination };
            Shade::new(self.0, &shaded, &samples, Scatter::Exact).unwrap()
        }

        /// Each view's image without its gain.
        fn unscaled(scene: &Scene, shade: &Shade, inputs: &Inputs) -> Vec<Vec<[f64; 4]>> {
            let image = numbers(shade.image(inputs.clone()).unwrap());
            let mut first = 0;
            let mut view = |pixels: usize| {
                let slots = &image[4 * first..];
                first += pixels.next_multiple_of(LANES);
                slots.as_chunks::<4>().0[..pixels].to_vec()
            };
            scene.views.iter().map(|v| view(v.pixels.len())).collect()
        }
    }

    impl Evaluator for Tensors {
        fn name(&self) -> String {
            "burn".to_owned()
        }
        fn computes(&self) -> Width {
            Width::Single
        }
        fn stores(&self) -> Width {
            Width::Single
        }
        fn image(&self, scene: &Scene, at: &At) -> Vec<Vec<[f64; 4]>> {
            // An operation has at least one column.
            let (shade, inputs) = self.operation(scene, at, &[Column::tied(Param::RimExponent)]);
            let mut image = Self::unscaled(scene, &shade, &inputs);
            image
                .iter_mut()
                .zip(&at.gains)
                .for_each(|(view, &gain)| view.iter_mut().for_each(|pixel| *pixel = gained(*pixel, gain)));
            image
        }

        /// The loss' slope by the image goes back through the operation: to its columns, and to the lobe's cube.
        fn equations(&self, scene: &Scene, at: &At, unknowns: &[Unknown]) -> Found {
            let (columns, of) = columns(unknowns);
            let (shade, inputs) = self.operation(scene, at, &columns);
            let image = Self::unscaled(scene, &shade, &inputs);
            let residuals = residuals(scene.loss);
            let (mut loss, mut weights, mut adjoint) = (0.0, 0.0, Vec::new());
            let mut by_gain = vec![[0.0; 3]; scene.views.len()];
            for (v, view) in scene.views.iter().enumerate() {
                let gain = gained([1.0; 4], at.gains[v]);
                for (pixel, shown) in view.pixels.iter().zip(&image[v]) {
                    for c in 0..4 {
                        let (model, target) = (gain[c] * shown[c], pixel.target[c]);
                        let clip = view.clip.map(clip_of);
                        let row = residuals.weigh(clip, model, target, pixel.weight);
                        let slope = 2.0 * row.scale * row.residual;
                        loss += row.loss;
                        weights += pixel.weight;
                        by_gain[v][alike(c)] += slope * shown[c];
                        adjoint.push(slope * gain[c]);
                    }
                }
                adjoint.resize(adjoint.len().next_multiple_of(4 * LANES), 0.0);
            }
            let adjoint: Vec<f32> = adjoint.iter().map(|x| (x / weights) as f32).collect();
            let shape = [shade.slots(), 4];
            let adjoint = Tensor::<2>::from_data(TensorData::new(adjoint, shape), self.0.device());
            let free = inputs.columns.clone().autodiff().require_grad();
            let lobe = inputs.lobe.clone().autodiff().require_grad();
            let tracked = Inputs { columns: free.clone(), lobe: lobe.clone(), ..inputs };
            let weighted = shade.image(tracked).unwrap() * adjoint.autodiff();
            let gradients = weighted.sum().backward();
            let by_column = free.grad(&gradients).map(numbers).unwrap_or_default();
            let by_texel = lobe.grad(&gradients).map(numbers).unwrap();
            let slope = illumination(scene).lobes.as_ref().unwrap().at(at.constants.specular_lobe[0]).1;
            let moving = slope.padded().as_flattened().iter().map(|&x| f64::from(x));
            let by_lobe: f64 = by_texel.iter().zip(moving).map(|(a, b)| a * b).sum();
            assert_eq!(by_column.len(), columns.len());
            let gradient = unknowns.iter().enumerate().map(|(i, &unknown)| match unknown {
                Unknown::Gain(view) => by_gain[view].iter().sum::<f64>() / weights,
                Unknown::ChannelGain(view, c) => by_gain[view][c] / weights,
                Unknown::Tied("specular_lobe") => by_lobe,
                _ => of
                    .iter()
                    .zip(&by_column)
                    .filter(|(unknown, _)| **unknown == i)
                    .map(|(_, slope)| slope)
                    .sum(),
            });
            Found { losses: vec![loss / weights], gradient: gradient.collect(), normal: None }
        }
    }
}

//! What engines alone are given: fragments with the fields that samples hold of lights, of the sky and of effects that files
//! declare. The search of lights draws them, with named choices and parameters.

use std::sync::Arc;

use glam::DVec3;
use rand::RngExt;
use rand::rngs::StdRng;

use super::case::{EVERYTHING, FragmentInputs};
use super::hard::{HardLight, Place, Sky};
use super::lights::{LightBox, LightKind};
use super::random::{fragment, one_of, parameter, share, unit};
use super::reference::{Moves, moved, moved_params};
use crate::bake::inward::FAR_LIGHT;
use crate::bake::reflected::ReflectedStack;
use crate::bake::{Illumination, LobeStack};
use crate::model::choices::{
    Bounces, Choices, LobeLookup, NormalFilter, SkinReflection, SpecularMap, SpecularModel,
    SpecularVisibility, SplitSum,
};
use crate::model::cube::Cube;
use crate::model::effects::{Effect, Effects, Form, Prerequisite, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::fields::Fields;
use crate::model::fragment::Fragment;
use crate::model::params::{Param, Params};
use crate::model::transmission::{FARTHEST, Method, TransmissionChoices};
use crate::model::vector::dot;
use crate::samples::surface_records::{Asked, Unmade};
use crate::samples::{Atlas, LANES, SurfaceRecords};
use crate::scene::light::{Beam, Cone, Lamp};
use crate::scene::{Light, LightKind as SceneLight, Loss};
use crate::shader::term::{TermError, library};

/// The effects of two lights that only this study has: one from a direction, one that stands somewhere.
pub(super) struct Probes(Effects);

impl Probes {
    /// The two, known from then on.
    ///
    /// # Errors
    /// When a scene's lights have taken their names.
    pub(super) fn new() -> Result<Self, TermError> {
        library::register_all();
        let beam = Beam { direction: DVec3::NEG_Z, irradiance: [1.0; 3], angular_diameter_degrees: 0.0 };
        let lamp = Lamp { position: DVec3::Z, intensity: [1.0; 3], range: None, radius: 0.0 };
        let cone = Cone { direction: DVec3::NEG_Z, inner_degrees: 10.0, outer_degrees: 20.0 };
        let lights = [
            ("stability_beam", SceneLight::Directional(beam)),
            ("stability_lamp", SceneLight::Spot(lamp, cone)),
        ];
        let mut effects = Effects::default();
        for (name, kind) in lights {
            effects = effects.with(Light { name: name.to_owned(), kind }.effect()?);
        }
        Ok(Self(effects))
    }
}

/// A fragment, and the numbers of each of the batch's fields.
#[derive(Clone, Debug)]
pub(super) struct LitFragment {
    inputs: FragmentInputs,
    /// What samples hold of it.
    held: Fragment<f32>,
    fields: Vec<[f32; 3]>,
    /// Texture coordinates and chart, where it looks texels of the UV atlas up.
    place: [f32; 3],
}

impl LitFragment {
    /// A fragment under the switches of `setup`.
    pub(super) fn new(setup: Setup, inputs: FragmentInputs, fields: Vec<[f32; 3]>, place: [f32; 3]) -> Self {
        Self { inputs, held: inputs.fragment(setup, 0.0), fields, place }
    }

    /// Another surface with what samples hold beside it.
    pub(super) fn with_surface(&self, setup: Setup, inputs: FragmentInputs) -> Self {
        Self::new(setup, inputs, self.fields.clone(), self.place)
    }
}

/// Fragments under one setting.
#[derive(Clone)]
pub(super) struct LitBatch {
    /// The switches of the model.
    pub(super) setup: Setup,
    /// Its parameters.
    pub(super) params: Params,
    /// Cubes.
    pub(super) light: Arc<Illumination>,
    /// What engines minimise.
    pub(super) loss: Loss,
    /// What engines move: the parameters whose derivatives must be finite.
    pub(super) free: Vec<Param>,
    /// Those of them whose derivatives must be as near to f64 as the colours.
    pub(super) compared: Vec<Param>,
    /// What fragments hold beside their surface.
    pub(super) fields: Fields,
    /// The texels that they look up.
    pub(super) atlas: Option<Arc<Atlas>>,
    /// The fragments.
    pub(super) fragments: Vec<LitFragment>,
}

/// Every parameter that a fit may move.
fn movable(effects: Effects) -> Vec<Param> {
    Param::all().filter(|param| !param.info().held && param.asked_for(effects)).collect()
}

impl LitBatch {
    /// A random one.
    #[must_use]
    pub(super) fn random(probes: &Probes, lights: &LightBox, rng: &mut StdRng, count: usize) -> Self {
        let setup = setup(probes, rng);
        let mut params = Params::defaults(setup.form);
        for param in Param::all().filter(|param| param.asked_for(setup.effects)) {
            let mut draw = || number(param, setup.form, rng);
            let rgb = if param.info().rgb { [draw(), draw(), draw()] } else { [draw(); 3] };
            params.set_rgb(param, rgb);
        }
        let light = light(lights, setup.choices.specular_model, rng);
        let fields = setup.needs().fields;
        let draw = |rng: &mut StdRng| {
            let inputs = fragment(rng);
            let fields = fields.iter().map(|field| found(field.name(), &inputs, rng)).collect();
            LitFragment::new(setup, inputs, fields, [0.0; 3])
        };
        let fragments = (0..count).map(|_| draw(rng)).collect();
        Self { loss: one_of(rng, &Loss::ALL), fragments, ..Self::bare(setup, params, light) }
    }

    /// No fragment yet.
    fn bare(setup: Setup, params: Params, light: Arc<Illumination>) -> Self {
        Self {
            setup,
            params,
            light,
            loss: Loss::L2,
            free: movable(setup.effects),
            compared: Vec::new(),
            fields: setup.needs().fields,
            atlas: None,
            fragments: Vec::new(),
        }
    }

    /// One of its fragments alone.
    #[must_use]
    pub(super) fn alone(&self, slot: usize) -> Self {
        Self { fragments: vec![self.fragments[slot].clone()], ..self.clone() }
    }

    /// Its switches in words.
    #[must_use]
    pub(super) fn words(&self) -> String {
        let named = self.setup.choices.named().map(|(key, value)| format!("{key} = {value}"));
        format!("{:?}, {:?}, {}", self.setup.form, self.setup.effects, named.join(", "))
    }

    /// Every number moved as roundings may move it: what is given, and what samples hold of that. 1 - |n.V| feels the
    /// last digit of n's length and of V's, which no move of what they are made from need change.
    pub(super) fn moved(&self, moves: &mut Moves<'_>) -> (Vec<LitFragment>, Params) {
        let each = |fragment: &LitFragment, moves: &mut Moves<'_>| {
            let inputs = moved(&fragment.inputs, moves);
            let mut held = inputs.fragment(self.setup, 0.0);
            for vector in [&mut held.base, &mut held.bump, &mut held.normal, &mut held.view] {
                *vector = moves.vector(*vector);
            }
            let fields = fragment.fields.iter().map(|numbers| moves.vector(*numbers)).collect();
            LitFragment { inputs, held, fields, ..*fragment }
        };
        let fragments = self.fragments.iter().map(|fragment| each(fragment, moves)).collect();
        if self.atlas.is_some() {
            // Each move of a parameter would make every level anew, to change it less than sums of texels round.
            return (fragments, self.params.clone());
        }
        let mut params = moved_params(&self.params, moves);
        for param in Param::all().filter(|param| !param.is_built_in() && param.asked_for(self.setup.effects))
        {
            params.set_rgb(param, self.params.rgb(param).map(|x| moves.number(x)));
        }
        // Beside 1 a small part of what is not open is rounded as 1 is: 1 - occlusion (1 - O).
        params.set(Param::Occlusion, moves.beside_one(params.scalar(Param::Occlusion)));
        (fragments, params)
    }

    /// The records of `groups` groups, the pixel of each slot, and its coverage; what fills the last group has none.
    #[must_use]
    pub(super) fn records(
        &self,
        fragments: &[LitFragment],
        groups: usize,
    ) -> (SurfaceRecords, Vec<u32>, Vec<f32>) {
        let (fields, uv) = (self.fields, self.atlas.is_some());
        let mut surface = SurfaceRecords::new(Asked { fields, uv, ..Asked::EVERYTHING }, groups);
        let of_slot = |slot: usize| match fragments.get(slot) {
            Some(fragment) => (fragment, slot as u32, 1.0),
            None => (&fragments[slot / LANES * LANES], u32::MAX, 0.0),
        };
        let (mut pixel, mut coverage) = (Vec::new(), Vec::new());
        for slot in 0..groups * LANES {
            let (fragment, number, share) = of_slot(slot);
            let [u, v, chart] = fragment.place;
            surface.set_all(slot, &(fragment.held, Unmade { uv: [u, v], chart, ..Unmade::default() }), share);
            pixel.push(number);
            coverage.push(share);
        }
        let places: Vec<_> = surface.places().fields().map(|(name, at, _)| (name, at)).collect();
        for (k, field) in fields.iter().enumerate() {
            let Some((_, at)) = places.iter().find(|(name, _)| *name == field.name()) else { continue };
            for component in 0..field.info().numbers {
                for (slot, number) in surface.rows_mut().plane_mut(at + component).enumerate() {
                    *number = of_slot(slot).0.fields[k][component];
                }
            }
        }
        (surface, pixel, coverage)
    }
}

/// Most effects of light, under any of the named choices.
fn setup(probes: &Probes, rng: &mut StdRng) -> Setup {
    let form = if rng.random_range(0..4) == 0 { Form::Listing } else { Form::Corrected };
    // The key light is a difference of two terms, and haze and reflection have their own search.
    let mut effects = EVERYTHING.without(Effect::KeyLight);
    for effect in EVERYTHING.iter() {
        if effect != Effect::Diffuse && rng.random_range(0..3) == 0 {
            effects = effects.without(effect);
        }
    }
    let drawn = |rng: &mut StdRng| rng.random_range(0..4) > 0;
    if drawn(rng) {
        effects = probes.0.iter().fold(effects.with(Effect::Lights), Effects::with);
        let of_lights = Effect::offered().filter(|effect| effect.info().upon == Some(Effect::Lights));
        effects = of_lights.filter(|_| drawn(rng)).fold(effects, Effects::with);
    }
    effects = alone().filter(|_| drawn(rng)).fold(effects, Effects::with);
    let setup = Setup::new(form, one_of(rng, &Silhouette::ALL), effects);
    let choices = Choices {
        specular_model: one_of(rng, &SpecularModel::ALL),
        split_sum: one_of(rng, &SplitSum::ALL),
        specular_visibility: one_of(rng, &SpecularVisibility::ALL),
        lobe_lookup: one_of(rng, &LobeLookup::ALL),
        specular_map: one_of(rng, &SpecularMap::ALL),
        normal_filter: one_of(rng, &NormalFilter::ALL),
        bounces: one_of(rng, &Bounces::ALL),
        skin_reflection: one_of(rng, &SkinReflection::ALL),
        transmission: TransmissionChoices { method: one_of(rng, &Method::ALL) },
        // What may be free is.
        glossy: true,
        turning: rng.random(),
        ..setup.choices
    };
    Setup { choices, ..setup }
}

/// The library's effects that are no other's. A fragment alone has no texels for light to scatter in.
fn alone() -> impl Iterator<Item = Effect> {
    let alone = |effect: &Effect| {
        let row = effect.info();
        row.upon.is_none() && row.within.is_none() && row.asks != Some(Prerequisite::Atlas)
    };
    library::terms().iter().flat_map(|term| term.effects).copied().filter(alone)
}

/// Products of four of these, squared, stay below f32's 3.4e38.
const BRIGHTEST: f64 = 100.0;

/// As the search draws it.
pub(super) fn number(param: Param, form: Form, rng: &mut StdRng) -> f64 {
    parameter(param, form, rng).clamp(-BRIGHTEST, BRIGHTEST.max(param.info().corrected))
}

/// An ordinary light or darkness.
fn light(lights: &LightBox, model: SpecularModel, rng: &mut StdRng) -> Arc<Illumination> {
    let own = lights.of(one_of(rng, &[LightKind::Wavy, LightKind::Wavy, LightKind::Dark]));
    Arc::new(mirrored(own, model))
}

/// A light with cubes of the specular lobe.
fn mirrored(own: &Illumination, model: SpecularModel) -> Illumination {
    let mut light = own.clone();
    let of = light.lobes.as_ref().map(|lobes| lobes.cubes[1].clone());
    // Brighter as it is sharper, so that the stack has a slope.
    let cube = |cube: &Cube<f32>, m: f64| cube.map(|texel| texel.map(|x| x * (1.5 - m) as f32));
    light.reflected = of.map(|of| ReflectedStack::new(model, &(0.25..=1.0), 1, |m| cube(&of, m)));
    light
}

/// The same with texels of 1.
fn constant(own: &Illumination, model: SpecularModel) -> Illumination {
    let even = |cube: &Cube<f32>| cube.map(|texel| texel.map(|_| 1.0));
    let lobes = own.lobes.as_ref().map(|lobes| LobeStack {
        exponents: lobes.exponents.clone(),
        cubes: lobes.cubes.iter().map(even).collect(),
    });
    let of = lobes.as_ref().map(|lobes| lobes.cubes[1].clone());
    Illumination {
        irradiance: own.irradiance.as_ref().map(even),
        hilite: own.hilite.as_ref().map(even),
        reflected: of.map(|of| ReflectedStack::new(model, &(0.25..=1.0), 1, |_| of.clone())),
        lobes,
    }
}

/// What a sample may hold of a field, by its name.
fn found(name: &str, at: &FragmentInputs, rng: &mut StdRng) -> [f32; 3] {
    let bright = |rng: &mut StdRng| match rng.random_range(0..6) {
        0 => 0.0,
        1 => 10_f64.powf(rng.random_range(-30.0..=2.0)),
        _ => 4.0 * share(rng).abs(),
    };
    let three = |x: f64| [x; 3];
    let numbers = match name {
        name if name.ends_with("_toward") => direction(at, rng),
        "bent_normal" => direction(at, rng).map(|x| share(rng).abs() * x),
        name if ["_open", "_far"].iter().any(|end| name.ends_with(end)) || name == "lobe_seen" => {
            three(share(rng).abs())
        }
        "sky_cosine" | "sky_sine" | "sky_curve" => std::array::from_fn(|_| rng.random_range(-2.0..=2.0)),
        // None where a sample stands for nothing.
        "lobe_nodes" if rng.random_range(0..6) == 0 => [0.0; 3],
        "lobe_nodes" => [0.2, 0.4, 0.8],
        name if name == "thickness" || name.ends_with("_depth") => three(depth(rng)),
        // Shares of a cubic may be below 0.
        name if name.contains(FAR_LIGHT) => std::array::from_fn(|_| share(rng).signum() * bright(rng)),
        // Distances, radiance, shares of light.
        _ => std::array::from_fn(|_| bright(rng)),
    };
    numbers.map(|x| x as f32)
}

/// How far light travels inside, in millimetres: not at all, without end, or any way between.
fn depth(rng: &mut StdRng) -> f64 {
    match rng.random_range(0..8) {
        0 => 0.0,
        1 => f64::INFINITY,
        2 => 1e30,
        // What samples hold of no end.
        3 => FARTHEST,
        4 => 10_f64.powf(rng.random_range(-30.0..=3.0)),
        _ => 10.0 * share(rng).abs(),
    }
}

/// A unit vector, or none: anywhere, along the normal, level with the surface, along the view or mirrored.
fn direction(at: &FragmentInputs, rng: &mut StdRng) -> [f64; 3] {
    let (n, view) = (at.normal, at.view);
    let along = dot(n, view);
    let d = match rng.random_range(0..12) {
        0 => [0.0; 3],
        1 => n,
        2 => view,
        3 => view.map(|x| -x),
        4 => std::array::from_fn(|i| view[i] - 2.0 * along * n[i]),
        5 => at.tangent,
        6 => n.map(|x| -x),
        _ => unit(rng),
    };
    let length = dot(d, d).sqrt();
    if length > 1e-6 { d.map(|x| x / length) } else { [0.0; 3] }
}

impl LitBatch {
    /// A hard case under a specular model, everything on that a fragment alone can have.
    pub(super) fn hard(
        probes: &Probes,
        lights: &LightBox,
        model: SpecularModel,
        case: &HardLight,
    ) -> Result<Self, String> {
        library::register_all();
        let of_lights = Effect::offered().filter(|effect| effect.info().upon == Some(Effect::Lights));
        let effects = probes
            .0
            .iter()
            .chain(of_lights)
            .chain(alone())
            .fold(EVERYTHING.with(Effect::Lights), Effects::with);
        let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects.without(Effect::KeyLight));
        let choices = Choices {
            specular_model: model,
            specular_map: SpecularMap::F0,
            specular_visibility: SpecularVisibility::Cone,
            glossy: true,
            ..setup.choices
        };
        let setup = Setup { choices, ..setup };
        let mut params = Params::defaults(setup.form);
        for &(name, value) in &case.params {
            let param =
                Param::from_identifier(name).ok_or_else(|| format!("there is no parameter {name}"))?;
            params.set(param, value);
        }
        let own = lights.of(match case.sky {
            Sky::Wavy | Sky::Constant => LightKind::Wavy,
            Sky::Dark => LightKind::Dark,
            Sky::Glaring => LightKind::Glaring,
        });
        let light = if case.sky == Sky::Constant { constant(own, model) } else { mirrored(own, model) };
        let shaded = |place: &Place| {
            let fields = setup.needs().fields.iter().map(|field| place.field(field.name())).collect();
            LitFragment::new(setup, place.surface, fields, [0.0; 3])
        };
        let fragments = case.places.iter().map(shaded).collect();
        Ok(Self { fragments, ..Self::bare(setup, params, Arc::new(light)) })
    }
}

#[cfg(test)]
impl LitBatch {
    /// The fragment alone, lamps of white light along `toward`.
    pub(super) fn beside_lamps(
        probes: &Probes,
        lights: &LightBox,
        (model, inputs, toward): (SpecularModel, FragmentInputs, [f32; 3]),
    ) -> Self {
        let specular = Effect::from_name("light_specular").into_iter();
        let effects = probes.0.iter().chain(specular).fold(EVERYTHING.with(Effect::Lights), Effects::with);
        let setup = Setup::new(Form::Corrected, Silhouette::Bumped, effects.without(Effect::KeyLight));
        let setup = Setup { choices: Choices { specular_model: model, ..setup.choices }, ..setup };
        let numbers = |name: &str| if name.ends_with("_toward") { toward } else { [1.0; 3] };
        let fields = setup.needs().fields.iter().map(|field| numbers(field.name())).collect();
        let fragments = vec![LitFragment::new(setup, inputs, fields, [0.0; 3])];
        let (params, light) = (Params::defaults(setup.form), Arc::clone(lights.of(LightKind::Dark)));
        Self { fragments, ..Self::bare(setup, params, light) }
    }
}

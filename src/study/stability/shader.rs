//! The renderer's rules as an evaluator: planned for a batch's setting, run on a graphics adapter.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use super::case::{Batch, EVERYTHING, FragmentInputs, VertexInputs};
use super::evaluate::{Answer, Evaluator, Frame, Rgba};
use super::lights::LightBox;
use crate::bake::Illumination;
use crate::gpu::probe::{constants, evaluate};
use crate::gpu::upload::Content;
use crate::gpu::{Choice, Gpu, GpuError};
use crate::model::bounds::Bounds;
use crate::model::dapple::Dapple;
use crate::model::effects::{Effect, Effects, Form, Lookups, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Param, Params};
use crate::scene::diffusion::Diffusion;
use crate::scene::{Bloom, FitSettings, Loss, MapSettings, Quality, Scene, ShadowMaps, maps, mesh};
use crate::shader::Domain;
use crate::shader::Facts;
use crate::shader::facts::MapFacts;
use crate::shader::probe::Probe;

/// An adapter whose device is opened anew when it was lost: software drivers do lose one now and then, and
/// the case at hand is then not to blame. A case that loses it twice is.
pub struct Adapter {
    choice: Choice,
    device: RefCell<Gpu>,
}

impl Adapter {
    /// An adapter's device.
    ///
    /// # Errors
    /// When there is no such adapter.
    pub fn open(choice: Choice) -> Result<Self, GpuError> {
        let gpu = Gpu::open(&choice)?;
        Ok(Self { choice, device: RefCell::new(gpu) })
    }

    /// Do some work on the device.
    ///
    /// # Errors
    /// Those of the work, in words.
    pub fn run<T>(&self, mut work: impl FnMut(&Gpu) -> Result<T, String>) -> Result<T, String> {
        let gpu = self.device.borrow().clone();
        match work(&gpu) {
            Err(_) if matches!(gpu.check(), Err(GpuError::Lost { .. })) => {
                let gpu = Gpu::open(&self.choice).map_err(|error| error.to_string())?;
                *self.device.borrow_mut() = gpu.clone();
                work(&gpu)
            }
            done => done,
        }
    }

    /// The adapter's name.
    #[must_use]
    pub fn name(&self) -> String {
        self.device.borrow().name().to_owned()
    }
}

/// The exact rules of the renderer.
pub struct Rules(pub Rc<Adapter>);

/// What a fragment gives: as a rasteriser interpolates it, and texels as they are read.
const GIVEN: [(&str, &str); 12] = [
    ("normal_texel", "vec3f"),
    ("vertex_tangent", "vec3f"),
    ("vertex_bitangent", "vec3f"),
    ("vertex_normal", "vec3f"),
    ("vertex_position", "vec3f"),
    ("vertex_view", "vec3f"),
    ("vertex_occlusion", "f32"),
    ("dapple", "f32"),
    ("albedo", "vec3f"),
    ("specular", "f32"),
    ("attenuator", "f32"),
    ("silhouette", "f32"),
];

/// The parts that add up to a colour, each wanted where its effect is on.
const PARTS: [(Effect, &str); 5] = [
    (Effect::Diffuse, "diffuse_part"),
    (Effect::SideSpecular, "side_part"),
    (Effect::Hilite, "hilite_part"),
    (Effect::Reflection, "mirror_part"),
    (Effect::KeyLight, "key_part"),
];

impl Rules {
    fn run(
        &self,
        probe: &Probe,
        lights: &Arc<Illumination>,
        params: &Params,
        given: &[f32],
    ) -> Result<Vec<f32>, String> {
        let content = Content {
            scene: Arc::new(scene()),
            illumination: Arc::clone(lights),
            occlusion: None,
            sky: None,
            thickness: None,
            params: params.clone(),
        };
        let block = constants(probe, params);
        self.0.run(|gpu| {
            evaluate(gpu, probe, content.clone(), &block, given).map_err(|error| error.to_string())
        })
    }
}

impl Evaluator for Rules {
    fn name(&self) -> String {
        "shader rules".to_owned()
    }

    /// WGSL asks of exp2, log2, division and square roots a few units in the last place only.
    fn slack(&self) -> f64 {
        4.0
    }

    fn fragments(&self, lights: &LightBox, batch: &Batch) -> Result<Answer, String> {
        let setting = &batch.setting;
        let Setup { effects, silhouette, form, .. } = setting.setup;
        let facts = Facts {
            setup: setting.setup,
            maps: MapFacts { normal: true, ..MapFacts::default() },
            turned: setting.params.scalar(Param::EnvironmentRotation) != 0.0,
            square_rim: setting.params.scalar(Param::RimExponent) == 2.0,
            ..Facts::default()
        };
        // From the bumped normal it is the shader's to find.
        let given = if silhouette == Silhouette::Bumped { &GIVEN[..11] } else { &GIVEN };
        let parts = PARTS.iter().filter(|(effect, _)| effects.has(*effect)).map(|(_, name)| (*name, "vec3f"));
        let haze = effects.has(Effect::Haze);
        let wanted: Vec<_> = parts.chain(haze.then_some(("haze", "f32"))).collect();
        if wanted.is_empty() {
            return Ok(Answer { values: Some(vec![[0.0; 4]; batch.fragments.len()]), ..Answer::default() });
        }
        let probe =
            Probe::new(&facts, Domain::Fragment, given, &wanted).map_err(|error| error.to_string())?;
        let numbers: Vec<f32> =
            batch.fragments.iter().flat_map(|f| numbers(f, form).into_iter().take(probe.stride())).collect();
        let got = self.run(&probe, lights.of(setting.lights), &setting.params, &numbers)?;
        let value = |parts: &[f32]| -> Rgba {
            let colours = parts.as_chunks::<3>().0;
            let channel = |c: usize| colours.iter().map(|part| f64::from(part[c])).sum();
            let alpha = if haze { f64::from(parts[parts.len() - 1]) } else { 0.0 };
            [channel(0), channel(1), channel(2), alpha]
        };
        Ok(Answer { values: Some(got.chunks(probe.width()).map(value).collect()), ..Answer::default() })
    }

    fn frames(&self, vertices: &[VertexInputs]) -> Result<Option<Vec<Frame>>, String> {
        let setup = Setup::new(Form::Corrected, Silhouette::Vertex, EVERYTHING);
        let facts =
            Facts { setup, maps: MapFacts { normal: true, ..MapFacts::default() }, ..Facts::default() };
        let wanted = [("vertex_normal", "vec3f"), ("vertex_tangent", "vec3f"), ("vertex_bitangent", "vec3f")];
        let probe = Probe::new(&facts, Domain::Vertex, &[], &wanted).map_err(|error| error.to_string())?;
        let mut given = Vec::new();
        for VertexInputs { normal, tangent, handedness } in vertices {
            for (name, _) in &probe.given {
                match *name {
                    "rest_normal" => given.extend(normal),
                    "rest_tangent" => given.extend(tangent.iter().chain([handedness])),
                    "rest_position" => given.extend([0.0; 3]),
                    other => return Err(format!("the vertex stage asks for {other}")),
                }
            }
        }
        let given: Vec<f32> = given.into_iter().map(|x: f64| x as f32).collect();
        let params = Params::defaults(Form::Corrected);
        let got = self.run(&probe, &Arc::default(), &params, &given)?;
        let frame = |numbers: &[f32; 9]| numbers.map(f64::from);
        Ok(Some(got.as_chunks::<9>().0.iter().map(frame).collect()))
    }
}

/// The numbers of a fragment in the order of [`GIVEN`]. The eye is at the origin, so that the position is
/// the vector from the eye.
fn numbers(f: &FragmentInputs, form: Form) -> Vec<f32> {
    let vectors = [f.texel, f.tangent, f.bitangent, f.normal, f.view, f.view];
    let first = vectors.into_iter().flatten().chain([f.occlusion, f.dapple(form)]);
    let all = first.chain(f.albedo).chain([f.specular, f.attenuator, f.silhouette]);
    all.map(|x| x as f32).collect()
}

/// A scene of nothing but its switches: the batch's numbers stand for all that it would hold.
fn scene() -> Scene {
    Scene {
        path: "stability".into(),
        mesh: mesh::Mesh::default(),
        metres_per_unit: 1.0,
        maps: maps::Maps::default(),
        environment: None,
        form: Form::Corrected,
        silhouette: Silhouette::Fragment,
        lookups: Lookups::default(),
        choices: crate::model::choices::Choices::default(),
        dapple: Dapple::default(),
        effects: Effects::default(),
        params: Params::defaults(Form::Corrected),
        views: Vec::new(),
        fit: FitSettings {
            free: Vec::new(),
            loss: Loss::L2,
            bounds: Bounds::default(),
            free_gains: false,
            white_balance: false,
            cameras: false,
            maps: MapSettings::default(),
        },
        quality: Quality::default(),
        shadow_maps: ShadowMaps::default(),
        bloom: Bloom::default(),
        lights: Vec::new(),
        sky_lights: Vec::new(),
        diffusion: Diffusion::default(),
    }
}

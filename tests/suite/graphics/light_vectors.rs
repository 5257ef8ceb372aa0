//! The vectors of lights, specular light and transmission through the shader rules' WGSL, on a graphics adapter: the renderer's
//! rules, each from what the oracle gives. (How they move is compared where everything is on: `composed`.)

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use skinfit::gpu::Gpu;
use skinfit::gpu::probe::{constants, evaluate};
use skinfit::gpu::upload::Content;
use skinfit::model::choices::{LobeLookup, SpecularModel, SpecularVisibility, SplitSum};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::Params;
use skinfit::model::transmission::FARTHEST;
use skinfit::scene::light::Cone;
use skinfit::scene::{Light, LightKind};
use skinfit::shader::probe::Probe;
use skinfit::shader::{Domain, Facts};

use super::bench;
use crate::common::vectors_light;
use crate::fixtures::bare_scene;
use crate::lights::{LAMP, beam, known, light_of};
use crate::lit::param;
use crate::sky::effect;
use crate::vectors::reader::{Node, Tolerance, Vectors};

type Quantity = (&'static str, &'static str);

/// Rules on the adapter that make some quantities of others.
struct Rules {
    gpu: &'static Gpu,
    probe: Probe,
    effects: Effects,
}

impl Rules {
    fn new(
        gpu: &'static Gpu,
        effects: &[Effect],
        choose: impl FnOnce(&mut Setup),
        given: &[Quantity],
        wanted: &[Quantity],
    ) -> Self {
        let effects = Effects::of(effects);
        let mut setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
        choose(&mut setup);
        let facts = Facts { setup, ..Facts::default() };
        let probe = Probe::new(&facts, Domain::Fragment, given, wanted).unwrap();
        Self { gpu, probe, effects }
    }

    /// What they make of each item's numbers.
    fn of(&self, params: &Params, items: &[f64]) -> Vec<f64> {
        let content = Content {
            scene: Arc::new(bare_scene(self.effects)),
            illumination: Arc::default(),
            occlusion: None,
            sky: None,
            thickness: None,
            params: params.clone(),
        };
        let items: Vec<f32> = items.iter().map(|&x| x as f32).collect();
        let got = evaluate(self.gpu, &self.probe, content, &constants(&self.probe, params), &items).unwrap();
        got.into_iter().map(f64::from).collect()
    }
}

/// What a file gives f32, four times over: WGSL asks of exp2, log2, division and square roots a few units in the last place,
/// where a processor rounds correctly.
fn single(file: &Node<'_>, case: &Node<'_>) -> Tolerance {
    let given = file.vector.tolerances().single;
    let rel = case.get("f32_rel").map_or(given.rel, |rel| rel.number());
    Tolerance { rel, ..given }.times(4.0)
}

fn read() -> Vectors {
    Vectors::read(&vectors_light())
}

/// The parameters that a light's numbers are, as a scene's light has them.
fn params_of(light: &Light) -> Params {
    let mut params = Params::defaults(Form::Corrected);
    let mut set =
        |key: &str, values: [f64; 3]| params.set_rgb(param(&format!("light.{}.{key}", light.name)), values);
    set("irradiance", light.strength());
    if let Some(bearing) = light.bearing() {
        set("azimuth", [bearing.azimuth; 3]);
        set("elevation", [bearing.elevation; 3]);
    }
    if let LightKind::Point(lamp) | LightKind::Spot(lamp, _) = &light.kind {
        set("position", lamp.position.to_array());
        set("range", [lamp.range.unwrap_or(0.0); 3]);
        set("cone", [-1.0, -2.0, 0.0]);
    }
    if let LightKind::Spot(_, cone) = &light.kind {
        let cosine = |degrees: f64| degrees.to_radians().cos();
        set("axis", cone.direction.to_array());
        set("cone", [cosine(cone.inner_degrees), cosine(cone.outer_degrees), 0.0]);
    }
    params
}

#[test]
fn lights_are_as_bright_in_shaders_as_the_vectors_say() {
    let Some(gpu) = bench::gpu() else { return };
    let cone = Cone { direction: DVec3::NEG_Z, inner_degrees: 1.0, outer_degrees: 2.0 };
    let spot = known("vector_spot", LightKind::Spot(LAMP, cone));
    let given = [("n", "vec3f"), ("vertex_position", "vec3f"), ("albedo", "vec3f")];
    let rules = |light: Effect, term: &'static str| {
        Rules::new(gpu, &[Effect::Lights, light], |_| (), &given, &[(term, "vec3f")])
    };
    let kinds = [
        ("vector_beam", rules(beam("vector_beam"), "light_vector_beam_term")),
        ("vector_lamp", rules(known("vector_lamp", LightKind::Point(LAMP)), "light_vector_lamp_term")),
        ("vector_spot", rules(spot, "light_vector_spot_term")),
    ];
    let vectors = read();
    let file = vectors.one("light");
    let (cases, expected) = (file.at("inputs").at("cases").items(), file.at("expected").at("cases").items());
    let mut refused = 0;
    for (case, want) in cases.iter().zip(&expected) {
        let (light, color) = light_of(&case.at("light"));
        let place = match light.kind {
            LightKind::Directional(_) => 0,
            LightKind::Point(_) => 1,
            LightKind::Spot(..) => 2,
        };
        let (name, rules) = &kinds[place];
        // A direction without length is no scene's.
        let Ok(light) = Light::new(name, light.kind) else {
            assert_eq!(want.at("E").numbers(), [0.0; 3]);
            refused += 1;
            continue;
        };
        let item = [case.at("n").three(), case.at("x").three(), [1.0; 3]].concat();
        let term = rules.of(&params_of(&light), &item);
        // albedo / pi times what arrives.
        let irradiance: Vec<f64> = term.iter().zip(color).map(|(term, color)| PI * term * color).collect();
        single(&file, case).check(case.at("case").text(), &irradiance, &want.at("E"));
    }
    assert_eq!(refused, 2);
}

#[test]
fn lobes_of_lights_are_those_of_the_vectors_in_shaders() {
    let Some(gpu) = bench::gpu() else { return };
    let light = beam("vector_beam");
    let given = [
        ("n", "vec3f"),
        ("view", "vec3f"),
        ("light_vector_beam_toward", "vec3f"),
        ("lobe_roughness", "f32"),
        ("lobe_f0", "f32"),
    ];
    let vectors = read();
    for (model, name) in
        [(SpecularModel::Kelemen, "specular_lights.json"), (SpecularModel::Ggx, "specular_lights_ggx.json")]
    {
        let effects = [Effect::Lights, light, effect("light_specular")];
        let wanted = [("light_vector_beam_brdf", "f32")];
        let choose = |setup: &mut Setup| setup.choices.specular_model = model;
        let rules = Rules::new(gpu, &effects, choose, &given, &wanted);
        let file = vectors.files[name].root();
        let cases = file.at("inputs").at("cases").items();
        let expected = file.at("expected").at("cases").items();
        let item = |(case, want): (&Node<'_>, &Node<'_>)| {
            let vectors = ["n", "V", "L"].map(|key| case.at(key).three()).concat();
            [vectors, vec![want.at("m").number(), case.at("f0").number()]].concat()
        };
        let items: Vec<f64> = cases.iter().zip(&expected).flat_map(item).collect();
        let lobes = rules.of(&Params::defaults(Form::Corrected), &items);
        for ((case, want), lobe) in cases.iter().zip(&expected).zip(lobes) {
            let (light, weight, s) =
                (case.at("E").three(), case.at("specular_weight").three(), case.at("s").number());
            let radiance = [0, 1, 2].map(|c| weight[c] * s * lobe * light[c]);
            single(&file, case).check(case.at("case").text(), &radiance, &want.at("radiance"));
        }
    }
}

#[test]
fn shares_of_the_environment_are_those_of_the_vectors_in_shaders() {
    let Some(gpu) = bench::gpu() else { return };
    let vectors = read();
    let given = [("view_cosine", "f32"), ("lobe_roughness", "f32"), ("lobe_f0", "f32")];
    let share = |model, sum| {
        let choose = |setup: &mut Setup| {
            (setup.choices.specular_model, setup.choices.split_sum) = (model, sum);
        };
        Rules::new(gpu, &[effect("fresnel")], choose, &given, &[("environment_share", "f32")])
    };
    for (model, sum, name, values) in [
        (SpecularModel::Kelemen, SplitSum::Schlick, "specular_split_sum.json", "furnace"),
        (SpecularModel::Ggx, SplitSum::Exact, "specular_split_sum_ggx.json", "es_dielectric"),
    ] {
        let file = vectors.files[name].root();
        let [views, roughnesses, f0s] = ["NV", "m", "f0"].map(|key| file.at("inputs").at(key).numbers());
        let places = f0s.iter().flat_map(|&f0| {
            let roughnesses = &roughnesses;
            views.iter().flat_map(move |&view| roughnesses.iter().flat_map(move |&m| [view, m, f0]))
        });
        let got = share(model, sum).of(&Params::defaults(Form::Corrected), &places.collect::<Vec<f64>>());
        // The fits' stated error, of two sums for Schlick's factor at f0 = 1, and in f32 some roundings of sums of up to 5.
        let stated = if sum == SplitSum::Exact { 3.2e-4 } else { 2.0 * 2.1e-4 };
        Tolerance { abs: stated, rel: 0.0 }.check(name, &got, &file.at("expected").at(values));
    }
}

#[test]
fn occlusion_of_lobes_and_their_directions_are_those_of_the_vectors_in_shaders() {
    let Some(gpu) = bench::gpu() else { return };
    let vectors = read();
    let file = vectors.files["specular_choices.json"].root();
    let (inputs, expected) = (file.at("inputs"), file.at("expected"));
    let near = single(&file, &file);
    let defaults = Params::defaults(Form::Corrected);
    let open = Rules::new(
        gpu,
        &[effect("fresnel")],
        |setup| setup.choices.specular_visibility = SpecularVisibility::Lagarde,
        &[("view_cosine", "f32"), ("occ", "f32"), ("lobe_roughness", "f32")],
        &[("lobe_open", "f32")],
    );
    let [views, opens, roughnesses] = ["NV", "occ", "m"].map(|key| inputs.at(key).numbers());
    let mut items = Vec::new();
    for &view in &views {
        for &open in &opens {
            roughnesses.iter().for_each(|&m| items.extend([view, open, m]));
        }
    }
    near.check("lagarde", &open.of(&defaults, &items), &expected.at("lagarde").at("value"));
    let off_peak = Rules::new(
        gpu,
        &[effect("fresnel")],
        |setup| setup.choices.lobe_lookup = LobeLookup::OffPeak,
        &[("n", "vec3f"), ("reflected", "vec3f"), ("lobe_width", "f32")],
        &[("lobe_mean", "vec3f")],
    );
    let given = inputs.at("off_peak");
    let item = |(i, alpha): (usize, f64)| {
        [&given.at("n").item(i).three()[..], &given.at("R").item(i).three(), &[alpha]].concat()
    };
    let items: Vec<f64> = given.at("alpha").numbers().into_iter().enumerate().flat_map(item).collect();
    near.check("off peak", &off_peak.of(&defaults, &items), &expected.at("off_peak").at("direction"));
}

#[test]
fn light_comes_through_in_shaders_as_the_vectors_say() {
    let Some(gpu) = bench::gpu() else { return };
    let names = ["vector_beam", "vector_beam_2"];
    let [first, second] = names.map(beam);
    let rules = Rules::new(
        gpu,
        &[Effect::Diffuse, Effect::Lights, first, second, effect("transmission")],
        |_| (),
        &[
            ("normal", "vec3f"),
            ("albedo", "vec3f"),
            ("far_irradiance", "vec3f"),
            ("thickness", "f32"),
            ("light_vector_beam_depth", "f32"),
            ("light_vector_beam_2_depth", "f32"),
        ],
        &[("transmission_part", "vec3f")],
    );
    let vectors = read();
    let file = vectors.one("transmission");
    let cases = file.at("inputs").at("cases").items();
    for (case, want) in cases.iter().zip(file.at("expected").at("cases").items()) {
        let mut params = Params::defaults(Form::Corrected);
        for name in ["transmission_weight", "transmission_length"] {
            params.set_rgb(param(name), case.at(name).three());
        }
        let lights = case.at("lights").items();
        for (name, light) in names.iter().zip((0..2).map(|i| lights.get(i))) {
            let own = |key: &str| param(&format!("light.{name}.{key}"));
            // They face the far side.
            params.set(own("azimuth"), 0.0);
            params.set(own("elevation"), 0.0);
            params.set_rgb(own("irradiance"), light.map_or([0.0; 3], |light| light.at("irradiance").three()));
        }
        // What samples hold of no end.
        let depth = |d: &Node<'_>| if d.number().is_finite() { d.number() } else { FARTHEST };
        let own = |i: usize| lights.get(i).map_or(FARTHEST, |light| depth(&light.at("d")));
        let item = [
            &[0.0, 0.0, -1.0][..],
            &case.at("albedo").three(),
            &case.at("ambient").three(),
            &[depth(&case.at("d")), own(0), own(1)],
        ];
        let got = rules.of(&params, &item.concat());
        single(&file, case).check(case.at("case").text(), &got, &want.at("value"));
    }
}

//! Everything at once (MODEL 12) against the vectors of an independent float64 oracle: each term, their sum, and how
//! it moves with every parameter that there is; the planned rules in f64, in f32 and in SIMD lanes.
//!
//! The oracle's fragments also have texture-space diffusion, which replaces the diffuse light, so that its sums are left
//! out ([`LEFT_OUT`]). E_r and the split sum are tables of the oracle's own there, coarser than what the rules fit: the
//! environment's lobe is put together here of the rules' directions, roughness and shares with those tables.

use glam::DVec3;
use skinfit::bake::coefficients::Coefficients;
use skinfit::bake::harmonics::{Order, open_transfer};
use skinfit::bake::shadowed::{Turning, shadow_ratio};
use skinfit::engine::lanes::Lanes;
use skinfit::model::choices::{
    Choices, LobeLookup, SkinReflection, SpecularMap, SpecularModel, SpecularVisibility,
};
use skinfit::model::cube::Cube;
use skinfit::model::effects::{Effect, Effects, Form};
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::{decode_normal, guarded, unit_view};
use skinfit::model::params::{Param, Params};
use skinfit::model::vector::{cross, normalize_or};
use skinfit::scene::{Light, Scene};
use skinfit::shader::facts::FaceSizes;
use skinfit::shader::tangent::chain::Seed;
use skinfit::shader::{Facts, Source};
use skinfit_core::program::graph::Input;
use skinfit_core::program::lower::Natives;
use skinfit_core::program::shading::{Shading, constant};
use skinfit_core::program::steps::{Rounding, Steps};

use crate::by_rules::Number;
use crate::common::vectors_light;
use crate::scene_folder::{SCENE, SceneFolder};
use crate::vectors;
use crate::vectors::reader::{Node, Tolerance, Vectors};

const EFFECTS: &str = "\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"side_specular\", \"hilite\", \"reflection\", \
                       \"haze\", \"key_light\", \"lights\", \"shadows\", \"light_specular\", \"directional_occlusion\", \
                       \"transmission\"";

/// What is compared with nothing, by what its path begins with.
const LEFT_OUT: [&str; 17] = [
    // Texture-space diffusion, which is not built: what only it reads,
    "inputs.atlas",
    "inputs.texels",
    "inputs.fragments.chart",
    "inputs.fragments.uv",
    // what it makes of diffuse light, and sums with that in them,
    "expected.diffusion.terms.diffuse",
    "expected.diffusion.result",
    "expected.diffusion.looked_up.scattered",
    "expected.diffusion.J",
    "expected.diffusion_full",
    "expected.choices.terms.diffuse",
    "expected.choices.result",
    "expected.choices.J",
    // and the skin in the skin's reflection by its light map: the model has the light that vertices gather.
    "expected.choices.terms.skin_reflection",
    "constants.choices.skin_reflection",
    "constants.other_choices.skin_reflection",
    "constants.other_choices.fresnel_loss",
    "note",
];

/// The terms of the rules that each of the oracle's is.
const TERMS: [(&str, &[&str]); 6] = [
    ("side_specular", &["side_part"]),
    ("hilite", &["hilite_part"]),
    ("reflection", &["mirror_part"]),
    ("key_light", &["key_part"]),
    ("light_specular", &LAMPS_MIRRORED),
    ("transmission", &["transmission_part"]),
];
const LAMPS_MIRRORED: [&str; 3] =
    ["light_sun_specular_part", "light_lamp_specular_part", "light_spot_specular_part"];
const LIGHT: [&str; 4] = ["diffuse_part", "light_sun_part", "light_lamp_part", "light_spot_part"];

/// The file, with what it is of.
struct Composed<'v> {
    root: Node<'v>,
    /// The lights, the switches, and the parameters that there are.
    scene: Scene,
    params: Params,
    sky: Coefficients,
    cubes: [Cube<f64>; 3],
    /// E_r at each of some roughnesses.
    lobes: Vec<(f64, Cube<f64>)>,
}

/// A table's places about `x`, and how far on from the first it lies.
fn between(places: &[f64], x: f64) -> (usize, f64) {
    let i = places[1..places.len() - 1].iter().filter(|&&place| place <= x).count();
    (i, (x - places[i]) / (places[i + 1] - places[i]))
}

impl<'v> Composed<'v> {
    fn new(vectors: &'v Vectors) -> Self {
        let root = vectors.files["composed.json"].root();
        let inputs = root.at("inputs");
        let scene = scene(&inputs.at("lights"));
        let mut params = scene.params.clone();
        for name in root.at("constants").at("columns").items() {
            let value = inputs.at("params").at(name.text());
            let values = if value.is_list() { value.three() } else { [value.number(); 3] };
            if let Some(param) = Param::from_name(name.text()) {
                params.set_rgb(param, values);
            }
        }
        params.set(Param::from_name("fresnel_loss").unwrap(), 0.0);
        let resources = inputs.at("resources");
        let sky = resources.at("L_lm").items().iter().map(Node::three).collect();
        let cubes = ["diffuse", "spec", "hilite"].map(|which| vectors::cube::<f64>(vectors, &root, which));
        let lobe = |(m, node): (f64, Node<'_>)| {
            let size = node.item(0).items().len();
            let texel = |face, column, row| {
                let [r, g, b] = node.item(face).item(row).item(column).three();
                [r, g, b, 0.0]
            };
            (m, Cube::from_fn(size, texel))
        };
        let roughnesses = resources.at("er_roughness").numbers();
        let lobes = roughnesses.into_iter().zip(resources.at("er_cubes").items()).map(lobe).collect();
        Self { sky: Coefficients::new(Order::new(3).unwrap(), sky), cubes, lobes, scene, params, root }
    }

    fn fragments(&self) -> Node<'v> {
        self.root.at("inputs").at("fragments")
    }

    fn count(&self) -> usize {
        self.fragments().at("case").items().len()
    }

    /// With those choices, and with `fresnel` or without.
    fn setup(&self, choices: Choices, fresnel: bool) -> Setup {
        let setup = self.scene.setup();
        let Choices { visibility, bounces, .. } = setup.choices;
        let choices = Choices { visibility, bounces, glossy: true, turning: true, ..choices };
        let added = Effect::from_name("fresnel").filter(|_| fresnel);
        let effects = added.into_iter().fold(setup.effects, Effects::with);
        Setup { choices, effects, ..setup }
    }

    /// The scene's lights where `params` have them.
    fn lights(&self, params: &Params) -> Vec<Light> {
        self.scene.lights.iter().map(|light| light.moved(params)).collect()
    }

    /// What a stored sample holds of a fragment.
    fn field(&self, i: usize, Input { name, component }: &Input) -> f64 {
        let at = self.fragments();
        let three = |key: &str| at.at(key).item(i).three();
        let one = |key: &str| at.at(key).item(i).number();
        let (n, t) = (three("N"), three("T"));
        let b = cross(n, t).map(|x| one("w") * x);
        let view = unit_view(three("V"));
        let (base, bump) = decode_normal(Form::Corrected, three("normal_texel"), t, b, n);
        let (base, bump) = guarded(base, bump, view);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        match name.as_str() {
            "base" => base[*component],
            "bump" => bump[*component],
            "normal" => normalize_or(n, view.map(|x| -x)).0[*component],
            "view" => view[*component],
            "albedo" => three("c")[*component],
            "open" => one("o"),
            "silhouette" => 1.0 - dot(n, view).abs().min(1.0),
            "dapple" => one("dapple").max(0.0),
            "specular" => one("s"),
            "attenuator" => one("a"),
            "thickness" => one("thickness"),
            name if name.starts_with("sky_") => self.sky(i, name)[*component],
            name => self.of_light(i, name)[*component],
        }
    }

    /// The ratio of the sky and its turn: the shared turn moves it about where the sample was made.
    fn sky(&self, i: usize, name: &str) -> [f64; 3] {
        let transfer = self.fragments().at("Tlm").item(i).numbers();
        let open = open_transfer(self.sky.order(), self.fragments().at("N").item(i).three());
        let turn = self.params.scalar(Param::EnvironmentRotation).to_radians();
        let [shadowed, open] = [&transfer, &open].map(|transfer| Turning::of(transfer, &self.sky));
        let ratio = shadow_ratio(&shadowed, &open, self.sky.mean(), turn);
        match name {
            "sky_ratio" => ratio.value,
            "sky_cosine" => ratio.slope.map(|slope| -turn.sin() * slope),
            "sky_sine" => ratio.slope.map(|slope| turn.cos() * slope),
            other => panic!("a sample has no {other}"),
        }
    }

    fn of_light(&self, i: usize, name: &str) -> [f64; 3] {
        let x = DVec3::from_array(self.fragments().at("x").item(i).three());
        let lights = self.lights(&self.params);
        let own = |light: &&(usize, Light)| name.starts_with(&format!("light_{}_", light.1.member()));
        let lights: Vec<(usize, Light)> = lights.into_iter().enumerate().collect();
        let (number, light) = lights.iter().find(own).unwrap_or_else(|| panic!("a sample has no {name}"));
        let each = |key: &str| self.fragments().at(key).item(i).item(*number).number();
        let (open, far) = (each("visibility"), each("far_visibility"));
        match name.rsplit('_').next() {
            Some("open") => [open; 3],
            Some("far") => [far; 3],
            Some("depth") => [each("light_thickness"); 3],
            Some("toward") => light.towards(x).to_array(),
            Some("arriving") => [open * light.attenuation(x); 3],
            Some("beyond") => [far * light.attenuation(x); 3],
            _ => panic!("a sample has no {name}"),
        }
    }

    /// a and b of the oracle's table.
    fn split_sum(&self, view_cosine: f64, m: f64) -> [f64; 2] {
        let resources = self.root.at("inputs").at("resources");
        let [(i, u), (j, v)] =
            [("NV", view_cosine), ("m", m)].map(|(name, x)| between(&resources.at(name).numbers(), x));
        let entry = |i: usize, j: usize, k: usize| resources.at("ab").item(i).item(j).item(k).number();
        [0, 1].map(|k| {
            let along = |j: usize| entry(i, j, k) * (1.0 - u) + entry(i + 1, j, k) * u;
            along(j) * (1.0 - v) + along(j + 1) * v
        })
    }

    /// E_r of the oracle's cubes, `along` a direction in the environment.
    fn lobe(&self, along: [f64; 3], m: f64) -> [f64; 3] {
        let places: Vec<f64> = self.lobes.iter().map(|(m, _)| *m).collect();
        let (i, u) = between(&places, m);
        let [one, two] = [i, i + 1].map(|i| self.lobes[i].1.sample(along));
        [0, 1, 2].map(|c| one[c] * (1.0 - u) + two[c] * u)
    }
}

/// A scene with those lights and all effects; nothing of its files is looked at.
fn scene(lights: &Node<'_>) -> Scene {
    let folder = SceneFolder::new();
    let mut text = SCENE.replace(
        "[model]\n",
        &format!("[model]\neffects = [{EFFECTS}]\nvisibility = \"sh3\"\nbounces = \"polynomial\"\n"),
    );
    let list = |node: Node<'_>| format!("{:?}", node.three());
    for name in ["sun", "lamp", "spot"] {
        let light = lights.at(name);
        text += &format!("[[light]]\nname = \"{name}\"\ntype = \"{}\"\n", light.at("type").text());
        for key in ["irradiance", "position", "intensity", "direction"] {
            text += &light.get(key).map_or(String::new(), |value| format!("{key} = {}\n", list(value)));
        }
        for key in ["inner_degrees", "outer_degrees"] {
            text += &light.get(key).map_or(String::new(), |value| format!("{key} = {:?}\n", value.number()));
        }
        if name == "sun" {
            // Its angles are parameters.
            text += "direction = [0.0, -1.0, 0.0]\n";
        }
    }
    folder.write("scene.toml", text.as_bytes());
    folder.load().unwrap().0
}

/// The planned rules of a setup, the sum's derivatives by some parameters, and quantities on the way.
struct Rules {
    steps: Steps,
    slopes: usize,
    /// How many numbers each quantity has.
    widths: Vec<(&'static str, usize)>,
}

/// What the rules make of a fragment.
struct Shaded {
    /// Radiance and haze, and then how they move.
    rgba: Vec<[f64; 4]>,
    quantities: Vec<(&'static str, Vec<f64>)>,
}

impl Shaded {
    fn of(&self, name: &str) -> &[f64] {
        &self.quantities.iter().find(|(known, _)| *known == name).unwrap_or_else(|| panic!("no {name}")).1
    }

    /// The sum of some terms.
    fn sum(&self, names: &[&str]) -> [f64; 3] {
        [0, 1, 2].map(|c| names.iter().map(|name| self.of(name)[c]).sum())
    }
}

impl Rules {
    fn new(setup: Setup, free: &[Param]) -> Self {
        let size = Some(4);
        let faces = FaceSizes { irradiance: size, specular: size, hilite: size, reflected: size };
        let facts = Facts { setup, source: Source::Samples, faces, turned: true, ..Facts::default() };
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let shading = Shading::new(&facts, &seeds, |_| None, Natives::Written).unwrap();
        let mut outputs = [&[shading.value], &shading.tangents[..]].concat().concat();
        outputs.extend(shading.quantities.values().flatten());
        let widths = shading.quantities.iter().map(|(&name, ids)| (name, ids.len())).collect();
        Self { steps: Steps::new(&shading.graph, &outputs, |_| Rounding::Plain), slopes: free.len(), widths }
    }

    /// A fragment in numbers of `like`'s kind; every lane has the same. `light` is E_r.
    fn shade<R: Number>(
        &self,
        own: &Composed<'_>,
        params: &Params,
        light: [f64; 3],
        i: usize,
        like: R,
    ) -> Shaded {
        let cubes = own.cubes.each_ref().map(|cube| cube.map(|texel| texel.map(R::texel)));
        let even = own.cubes[0].map(|_| [light[0], light[1], light[2], 0.0].map(R::texel));
        let cube = |name: &str| match name {
            "irradiance_faces" => &cubes[0],
            "specular_faces" => &cubes[1],
            "hilite_faces" => &cubes[2],
            "reflected_faces" | "glossy_faces" => &even,
            other => panic!("there is no cube {other}"),
        };
        let setting = self.steps.setting(like, |input| constant(input, params).unwrap(), cube);
        let mut registers = Vec::new();
        self.steps
            .run(&setting, like, &mut registers, |place| like.lit(own.field(i, &self.steps.fields()[place])));
        let numbers: Vec<f64> =
            self.steps.outputs(&setting, &registers).map(|number| number.unpack()[0]).collect();
        let (light, mut rest) = numbers.split_at(4 * (1 + self.slopes));
        let mut quantities = Vec::new();
        for &(name, width) in &self.widths {
            quantities.push((name, rest[..width].to_vec()));
            rest = &rest[width..];
        }
        let rgba = light.chunks(4).map(|four| [four[0], four[1], four[2], four[3]]).collect();
        Shaded { rgba, quantities }
    }
}

fn read() -> Vectors {
    Vectors::read(&vectors_light())
}

const PLAIN: Choices = Choices {
    specular_visibility: SpecularVisibility::None,
    skin_reflection: SkinReflection::None,
    ..DEFAULT
};
const OTHER: Choices = Choices {
    specular_model: SpecularModel::Ggx,
    specular_visibility: SpecularVisibility::Lagarde,
    lobe_lookup: LobeLookup::OffPeak,
    specular_map: SpecularMap::F0,
    ..PLAIN
};
const DEFAULT: Choices =
    Setup::new(Form::Corrected, Form::Corrected.default_silhouette(), Effects::SURFACE).choices;

/// The file's tolerance for numbers of a kind.
fn tolerance<R: Number>(root: &Node<'_>) -> Tolerance {
    let tolerances = root.vector.tolerances();
    if size_of::<R>() == size_of::<f64>() { tolerances.double } else { tolerances.single }
}

/// What the environment's lobe shows, of what the rules found on the way and the oracle's tables.
fn in_lobe(own: &Composed<'_>, at: &Shaded, params: &Params) -> [f64; 3] {
    let one = |name: &str| at.of(name)[0];
    let along = <[f64; 3]>::try_from(at.of("lobe_direction")).unwrap();
    let [a, b] = own.split_sum(one("view_cosine"), one("lobe_roughness"));
    let light = own.lobe(along, one("lobe_roughness"));
    let weight = params.rgb(Param::from_name("specular_weight").unwrap());
    let share = one("lobe_weight") * one("lobe_open") * (one("lobe_f0") * a + b);
    [0, 1, 2].map(|c| weight[c] * share * light[c])
}

/// Terms, their sum and its Jacobian, in one kind of number.
fn run<R: Number>(vectors: &Vectors, like: R) {
    let own = Composed::new(vectors);
    let (root, expected) = (own.root.clone(), own.root.at("expected"));
    let near = tolerance::<R>(&root);
    let columns: Vec<(usize, Param)> = root
        .at("constants")
        .at("columns")
        .items()
        .iter()
        .enumerate()
        .filter_map(|(k, name)| Some((k, Param::from_name(name.text())?)))
        .collect();
    let free: Vec<Param> = columns.iter().map(|&(_, param)| param).collect();
    let plain = Rules::new(own.setup(PLAIN, false), &free);
    let lobe = Rules::new(own.setup(PLAIN, true), &[]);
    // In f64: what the rules lack is not theirs to round.
    let rest = |params: &Params, i: usize| {
        let at = lobe.shade(&own, params, [1.0; 3], i, 0.0_f64);
        in_lobe(&own, &at, params)
    };
    for i in 0..own.count() {
        let shaded = plain.shade(&own, &own.params, [0.0; 3], i, like);
        let terms = expected.at("diffusion").at("terms");
        for (name, parts) in TERMS {
            near.check(name, &shaded.sum(parts), &terms.at(name).item(i));
        }
        near.check("diffuse", &shaded.sum(&LIGHT), &expected.at("plain").at("terms").at("diffuse").item(i));
        for set in ["plain", "diffusion"] {
            near.check("haze", &shaded.rgba[0][3..], &expected.at(set).at("haze").item(i));
        }
        let mirrored = rest(&own.params, i);
        let double = tolerance::<f64>(&root);
        double.check("fresnel", &mirrored, &terms.at("fresnel").item(i));
        let result = [0, 1, 2].map(|c| shaded.rgba[0][c] + mirrored[c]);
        near.check("result", &result, &expected.at("plain").at("result").item(i));
        jacobian(&own, &columns, &shaded, (i, near), |params| rest(params, i));
    }
}

/// The rules' derivatives and, by differences, those of what they lack, beside the oracle's.
fn jacobian(
    own: &Composed<'_>,
    columns: &[(usize, Param)],
    shaded: &Shaded,
    (i, near): (usize, Tolerance),
    rest: impl Fn(&Params) -> [f64; 3],
) {
    // Differences leave the square of a step of 1e-4 and roundings of 1e-16 over it; angles are in degrees.
    let near = Tolerance { abs: near.abs.max(1e-7), rel: near.rel.max(1e-7) };
    let want = own.root.at("expected").at("plain").at("J").item(i);
    for (slopes, &(k, param)) in shaded.rgba[1..].iter().zip(columns) {
        let moved = |by: f64| {
            let mut params = own.params.clone();
            params.set_rgb(param, own.params.rgb(param).map(|x| x + by));
            rest(&params)
        };
        let (above, below) = (moved(1e-4), moved(-1e-4));
        for c in 0..4 {
            let lacking = if c < 3 { (above[c] - below[c]) / 2e-4 } else { 0.0 };
            near.check(param.name(), &[slopes[c] + lacking], &want.item(c).item(k));
        }
    }
    // Those of diffusion move nothing here.
    let lacking = |name: &str| name.starts_with("diffusion_") || name == "colour_mix";
    let names = own.root.at("constants").at("columns").items();
    for (k, name) in names.iter().enumerate().filter(|(_, name)| lacking(name.text())) {
        (0..4).for_each(|c| near.check(name.text(), &[0.0], &want.item(c).item(k)));
    }
}

/// The quantities on the way, and the terms of the other named choices.
fn on_the_way<R: Number>(vectors: &Vectors, like: R) {
    let own = Composed::new(vectors);
    let expected = own.root.at("expected");
    let near = tolerance::<R>(&own.root);
    let double = tolerance::<f64>(&own.root);
    let [plain, other] = [PLAIN, OTHER].map(|choices| Rules::new(own.setup(choices, true), &[]));
    for i in 0..own.count() {
        let (at, exact) = (
            plain.shade(&own, &own.params, [1.0; 3], i, like),
            plain.shade(&own, &own.params, [1.0; 3], i, 0.0),
        );
        let looked_up = expected.at("diffusion").at("looked_up");
        for (name, quantity) in [
            ("n", "n"),
            ("R", "reflected"),
            ("rim", "rim"),
            ("occ", "occ"),
            ("m", "lobe_roughness"),
            ("NV", "view_cosine"),
            ("f0", "lobe_f0"),
            ("SO", "lobe_open"),
        ] {
            near.check(name, at.of(quantity), &looked_up.at(name).item(i));
        }
        let one = |name: &str| exact.of(name)[0];
        let [a, b] = own.split_sum(one("view_cosine"), one("lobe_roughness"));
        double.check("a", &[a], &looked_up.at("a").item(i));
        double.check("b", &[b], &looked_up.at("b").item(i));
        let along = <[f64; 3]>::try_from(exact.of("lobe_direction")).unwrap();
        double.check("E_r", &own.lobe(along, one("lobe_roughness")), &looked_up.at("E_r").item(i));
        assert_shown(&own, &at, near);

        let (at, exact) = (
            other.shade(&own, &own.params, [1.0; 3], i, like),
            other.shade(&own, &own.params, [1.0; 3], i, 0.0),
        );
        let (terms, looked_up) = (expected.at("choices").at("terms"), expected.at("choices").at("looked_up"));
        near.check("light_specular", &at.sum(&LAMPS_MIRRORED), &terms.at("light_specular").item(i));
        near.check("haze", &at.rgba[0][3..], &expected.at("choices").at("haze").item(i));
        near.check("f0", at.of("lobe_f0"), &looked_up.at("f0").item(i));
        near.check("SO", at.of("lobe_open"), &looked_up.at("SO").item(i));
        double.check("fresnel", &in_lobe(&own, &exact, &own.params), &terms.at("fresnel").item(i));
        let along = <[f64; 3]>::try_from(exact.of("lobe_direction")).unwrap();
        let light = own.lobe(along, exact.of("lobe_roughness")[0]);
        double.check("E_r", &light, &looked_up.at("E_r").item(i));
        assert_shown(&own, &at, near);
    }
}

/// Where E_r is 1 the environment's lobe shows specular_weight s SO es.
fn assert_shown(own: &Composed<'_>, at: &Shaded, near: Tolerance) {
    let one = |name: &str| at.of(name)[0];
    let weight = own.params.rgb(Param::from_name("specular_weight").unwrap());
    for (shown, weight) in at.of("fresnel_environment").iter().zip(weight) {
        let want = weight * one("lobe_weight") * one("lobe_open") * one("environment_share");
        assert!((shown - want).abs() <= near.abs + near.rel * want, "{shown} {want}");
    }
}

#[test]
fn everything_at_once_is_as_the_vectors_say_in_every_kind_of_number() {
    let vectors = read();
    run(&vectors, 0.0_f64);
    run(&vectors, 0.0_f32);
    on_the_way(&vectors, 0.0_f64);
    on_the_way(&vectors, 0.0_f32);
    for level in skinfit::simd::levels() {
        skinfit_core::with_simd!(level, simd => run(&vectors, Lanes::splat(simd, 0.0)));
    }
    let root = vectors.files["composed.json"].root();
    root.at("name").assert_text("composed");
    root.at("kind").assert_text("composed");
    // Names for people, and nodes of a table beyond those that the fragments lie between.
    root.at("inputs")
        .at("fragments")
        .at("case")
        .items()
        .iter()
        .for_each(|case| assert!(!case.text().is_empty()));
    assert!(root.at("inputs").at("resources").at("ab").numbers().iter().all(|x| (0.0..=1.0).contains(x)));
    choices(&root);
    let left = root.vector.left();
    let unread: Vec<_> =
        left.iter().filter(|path| !LEFT_OUT.iter().any(|begin| path.starts_with(begin))).collect();
    assert!(unread.is_empty(), "{unread:?}");
    let stale = LEFT_OUT.iter().filter(|begin| !left.iter().any(|path| path.starts_with(**begin)));
    assert_eq!(stale.collect::<Vec<_>>(), Vec::<&&str>::new(), "these are compared after all");
}

/// The choices that the file names are those that it is compared under.
fn choices(root: &Node<'_>) {
    for (key, choices) in [("choices", PLAIN), ("other_choices", OTHER)] {
        for (name, value) in choices.named() {
            if let Some(node) = root.at("constants").at(key).get(name).filter(|_| name != "skin_reflection") {
                node.assert_text(value);
            }
        }
    }
    let rgb = root.at("constants").at("rgb").items();
    for name in rgb {
        let known = Param::from_name(name.text());
        assert!(known.is_none_or(|param| param.info().rgb), "{}", name.text());
    }
    let floor = Param::from_name("f0_floor").unwrap();
    assert_eq!(root.at("constants").at("other_choices").at("f0_floor").number(), floor.info().corrected);
}

//! The file: what stands in it, as the library's own scene, parameters, cubes and fields of samples.

use std::cell::RefCell;
use std::collections::HashMap;

use glam::DVec3;
use skinfit::bake::coefficients::Coefficients;
use skinfit::bake::harmonics::{Order, open_transfer};
use skinfit::bake::shadowed::{Turning, shadow_ratio};
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
use skinfit_core::program::graph::Input;

use crate::scene_folder::{SCENE, SceneFolder};
use crate::vectors;
use crate::vectors::reader::{Node, Vectors};

const EFFECTS: &str = "\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"side_specular\", \"hilite\", \"reflection\", \
                       \"haze\", \"key_light\", \"lights\", \"shadows\", \"light_specular\", \"directional_occlusion\", \
                       \"transmission\"";

const DEFAULT: Choices =
    Setup::new(Form::Corrected, Form::Corrected.default_silhouette(), Effects::SURFACE).choices;
/// The choices of most of the file.
pub(super) const PLAIN: Choices = Choices {
    specular_visibility: SpecularVisibility::None,
    skin_reflection: SkinReflection::None,
    ..DEFAULT
};
/// Those of its `choices`.
pub(super) const OTHER: Choices = Choices {
    specular_model: SpecularModel::Ggx,
    specular_visibility: SpecularVisibility::Lagarde,
    lobe_lookup: LobeLookup::OffPeak,
    specular_map: SpecularMap::F0,
    ..PLAIN
};

pub(super) fn param(name: &str) -> Param {
    Param::from_name(name).unwrap_or_else(|| panic!("there is no parameter {name}"))
}

/// The file, with what it is of.
pub(super) struct Composed<'v> {
    pub(super) root: Node<'v>,
    /// The lights, the switches, and the parameters that there are.
    scene: Scene,
    pub(super) params: Params,
    sky: Coefficients,
    /// E_d, E_s and E_h.
    pub(super) cubes: [Cube<f64>; 3],
    /// E_r at each of some roughnesses.
    lobes: Vec<(f64, Cube<f64>)>,
    /// Cosines and roughnesses, and a and b there.
    sums: ([Vec<f64>; 2], Vec<f64>),
    /// What was read of fragments' fields.
    read: RefCell<HashMap<(usize, Input), f64>>,
}

/// A table's places about `x`, and how far on from the first it lies.
fn between(places: &[f64], x: f64) -> (usize, f64) {
    let i = places[1..places.len() - 1].iter().filter(|&&place| place <= x).count();
    (i, (x - places[i]) / (places[i + 1] - places[i]))
}

impl<'v> Composed<'v> {
    pub(super) fn new(vectors: &'v Vectors) -> Self {
        let root = vectors.files["composed.json"].root();
        let inputs = root.at("inputs");
        let scene = scene(&inputs.at("lights"));
        let mut params = scene.params.clone();
        for name in root.at("constants").at("columns").items() {
            let value = inputs.at("params").at(name.text());
            let values = if value.is_list() { value.three() } else { [value.number(); 3] };
            params.set_rgb(param(name.text()), values);
        }
        params.set(param("fresnel_loss"), 0.0);
        // The atlas' stretch is in millimetres.
        params.set(param("diffusion_unit"), 1.0);
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
        let sums = (["NV", "m"].map(|name| resources.at(name).numbers()), resources.at("ab").numbers());
        let read = RefCell::default();
        Self {
            sums,
            read,
            sky: Coefficients::new(Order::new(3).unwrap(), sky),
            cubes,
            lobes,
            scene,
            params,
            root,
        }
    }

    pub(super) fn inputs(&self, what: &str) -> Node<'v> {
        self.root.at("inputs").at(what)
    }

    fn fragments(&self) -> Node<'v> {
        self.inputs("fragments")
    }

    pub(super) fn count(&self) -> usize {
        self.fragments().at("case").items().len()
    }

    /// The parameters that the file has derivatives by, in its order.
    pub(super) fn columns(&self) -> Vec<Param> {
        self.root.at("constants").at("columns").items().iter().map(|name| param(name.text())).collect()
    }

    /// With those choices, and some effects more.
    pub(super) fn setup(&self, choices: Choices, added: &[&str]) -> Setup {
        let setup = self.scene.setup();
        let Choices { visibility, bounces, .. } = setup.choices;
        let choices = Choices { visibility, bounces, glossy: true, turning: true, ..choices };
        let added = added.iter().map(|name| Effect::from_name(name).unwrap());
        Setup { choices, effects: added.fold(setup.effects, Effects::with), ..setup }
    }

    /// What a stored sample holds of a fragment.
    pub(super) fn field(&self, i: usize, input: &Input) -> f64 {
        let known = self.read.borrow().get(&(i, input.clone())).copied();
        known.unwrap_or_else(|| {
            let number = self.field_of(i, input);
            self.read.borrow_mut().insert((i, input.clone()), number);
            number
        })
    }

    fn field_of(&self, i: usize, Input { name, component }: &Input) -> f64 {
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
            name if name.starts_with("sky_") => self.sky(&at, i, name)[*component],
            name => self.of_light(&at, i, name)[*component],
        }
    }

    /// What a stored texel holds: the `i`-th of those that are covered, whose steps to the next are the stretch.
    pub(super) fn texel(
        &self,
        i: usize,
        [step_u, step_v]: [f64; 2],
        Input { name, component }: &Input,
    ) -> f64 {
        let at = self.inputs("texels");
        let three = |key: &str| at.at(key).item(i).three();
        let numbers = match name.as_str() {
            "vertex_position" => three("x"),
            "vertex_normal" => three("N"),
            "vertex_tangent" => three("T"),
            "vertex_bitangent" => cross(three("N"), three("T")).map(|x| at.at("w").item(i).number() * x),
            "normal_texel" => three("normal_texel"),
            "albedo" => three("c"),
            "dpdx_vertex_position" => [step_u, 0.0, 0.0],
            "dpdy_vertex_position" => [0.0, step_v, 0.0],
            name if name.starts_with("sky_") => self.sky(&at, i, name),
            name => self.of_light(&at, i, name),
        };
        numbers[*component]
    }

    /// The ratio of the sky and its turn: the shared turn moves it about where the sample was made.
    fn sky(&self, at: &Node<'_>, i: usize, name: &str) -> [f64; 3] {
        let transfer = at.at("Tlm").item(i).numbers();
        let open = open_transfer(self.sky.order(), at.at("N").item(i).three());
        let turn = self.params.scalar(Param::EnvironmentRotation).to_radians();
        let [shadowed, open] = [&transfer, &open].map(|transfer| Turning::of(transfer, &self.sky));
        let ratio = shadow_ratio(&shadowed, &open, self.sky.mean(), turn);
        match name {
            "sky_ratio" => ratio.value,
            "sky_cosine" => ratio.slope.map(|slope| -turn.sin() * slope),
            "sky_sine" => ratio.slope.map(|slope| turn.cos() * slope),
            "sky_curve" => [0.0; 3],
            other => panic!("a sample has no {other}"),
        }
    }

    fn of_light(&self, at: &Node<'_>, i: usize, name: &str) -> [f64; 3] {
        let x = DVec3::from_array(at.at("x").item(i).three());
        let lights = self.scene.lights.iter().map(|light| light.moved(&self.params)).enumerate();
        let own = |(_, light): &(usize, Light)| name.starts_with(&format!("light_{}_", light.member()));
        let (number, light) =
            lights.into_iter().find(own).unwrap_or_else(|| panic!("a sample has no {name}"));
        let each = |key: &str| at.at(key).item(i).item(number).number();
        let arriving = |open: f64| [open * light.attenuation(x); 3];
        match name.rsplit('_').next() {
            Some("open") => [each("visibility"); 3],
            Some("far") => [each("far_visibility"); 3],
            Some("depth") => [each("light_thickness"); 3],
            Some("toward") => light.towards(x).to_array(),
            Some("arriving") => arriving(each("visibility")),
            Some("beyond") => arriving(each("far_visibility")),
            _ => panic!("a sample has no {name}"),
        }
    }

    /// a and b of the oracle's table.
    pub(super) fn split_sum(&self, view_cosine: f64, m: f64) -> [f64; 2] {
        let ([cosines, roughnesses], sums) = &self.sums;
        let [(i, u), (j, v)] =
            [(cosines, view_cosine), (roughnesses, m)].map(|(places, x)| between(places, x));
        let entry = |i: usize, j: usize, k: usize| sums[2 * (i * roughnesses.len() + j) + k];
        [0, 1].map(|k| {
            let along = |j: usize| entry(i, j, k) * (1.0 - u) + entry(i + 1, j, k) * u;
            along(j) * (1.0 - v) + along(j + 1) * v
        })
    }

    /// E_r of the oracle's cubes, `along` a direction in the environment.
    pub(super) fn lobe(&self, along: [f64; 3], m: f64) -> [f64; 3] {
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

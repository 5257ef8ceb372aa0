//! Hard cases of lights, of their mirror images and of the sky that a point sees (MODEL 7 and 8): image, loss and
//! gradient are finite in the f64 reference, on both engines, on tensors and in the renderer.

use serde_json::json;
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::reference::Reference;
use skinfit::engine::{Objective, Task, Unknown};
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::params::{Column, Param};
use skinfit::prepare::Baked;

use crate::graphics::bench::{EXACT, gpu};
use crate::lit::{baked, image, quad};
use crate::scene_folder::{SceneFolder, exr, glb, png, tampered};

const EFFECTS: &str = "\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"lights\", \"shadows\", \"light_specular\", \
                       \"fresnel\", \"directional_occlusion\", \"transmission\"";

/// Lines of `[model]` and start values.
const WAYS: [(&str, &str); 4] = [
    ("normal_filter = \"toksvig\"", "gloss = 0.3"),
    (
        "specular_model = \"ggx\"\nsplit_sum = \"exact\"\nspecular_visibility = \"cone\"\nspecular_map = \"f0\"",
        "roughness = 0.05\nf0 = 0\nf0_floor = 0",
    ),
    (
        "specular_model = \"ggx\"\nlobe_lookup = \"off_peak\"\nvisibility = \"scalar\"\nnormal_filter = \"toksvig\"",
        "roughness = 1\nf0 = 0.2\ngloss = 0.9",
    ),
    (
        "specular_visibility = \"lobe\"\nvisibility = \"cone\"\nbounces = \"polynomial\"",
        "roughness = 0.05\ngloss = 0.9",
    ),
];

/// What a fit may move of any scene here.
const FREE: [&str; 22] = [
    "roughness",
    "gloss",
    "f0",
    "f0_floor",
    "fresnel_loss",
    "specular_weight",
    "normal_strength",
    "occlusion",
    "base_weight",
    "rim_weight",
    "rim_exponent",
    "environment_rotation",
    "light.key.color",
    "light.key.azimuth",
    "light.key.elevation",
    "light.lamp.color",
    "light.sky_1.color",
    "light.sky_1.azimuth",
    "light.sky_1.elevation",
    "light.sky_8.color",
    "transmission_weight",
    "transmission_length",
];

/// The quad of the lights' tests under a way, its file edited.
fn scene((choices, params): (&str, &str), edits: &[(&str, &str)]) -> SceneFolder {
    let folder = quad(EFFECTS, "lights = 1");
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    let text = text
        .replace("[model]\n", &format!("[model]\n{choices}\n"))
        .replace("[model.params]\n", &format!("[model.params]\ntransmission_weight = 0.5\n{params}\n"))
        // Closed meshes are some millimetres thick.
        .replace("[mesh]\n", "[mesh]\nmetres_per_unit = 0.005\n");
    let edit = |text: String, (from, to): &(&str, &str)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    };
    folder.write("scene.toml", edits.iter().fold(text, edit).as_bytes());
    folder
}

fn assert_finite(baked: &Baked, what: &str, on_adapter: bool) {
    let finite = |rgb: &[[f32; 3]]| rgb.iter().flatten().all(|x| x.is_finite());
    assert!(finite(&image(baked).rgb), "{what}: image");
    let observed = baked.clone().sample().unwrap().observe().unwrap();
    let effects = baked.scene.effects;
    let known = FREE.iter().filter_map(|name| Param::from_name(name));
    let asked = known.filter(|param| param.asked_for(effects)).map(Column::tied);
    let unknowns: Vec<Unknown> = asked.clone().map(Unknown::Param).collect();
    assert!(unknowns.len() > 12, "{what}: {unknowns:?}");
    let point = observed.start();
    let task = || Task { unknowns: unknowns.clone(), ..observed.task() };
    let check = |engine: &dyn Objective, name: &str| {
        let (loss, slopes) = engine.gradient(&point);
        assert!(loss.is_finite(), "{what}: {name}: {loss}");
        for (slope, unknown) in slopes.iter().zip(&unknowns) {
            assert!(slope.is_finite(), "{what}: {name}: {}: {slope}", unknown.name());
        }
    };
    let own = task();
    let exact = Reference::new(own.setup, &own.illumination, &own.views, own.loss, &unknowns).unwrap();
    let (loss, slopes) = exact.gradient(&point);
    assert!(loss.is_finite() && slopes.iter().all(|x| x.is_finite()), "{what}: in f64: {loss} {slopes:?}");
    check(&CpuEngine::new(task()).unwrap(), "cpu");
    let Some(gpu) = gpu().filter(|_| on_adapter) else { return };
    check(&GpuEngine::new(gpu, task(), &point, Memory::default()).unwrap(), "gpu");
    #[cfg(feature = "burn")]
    {
        // No tensor moves the lobe's width.
        let moved = |column: &Column| !["roughness", "gloss"].contains(&column.param.name());
        let columns: Vec<Column> = asked.filter(moved).collect();
        crate::tensors::bench::finite_slopes(&observed, &columns, what);
    }
    let camera = baked.scene.views[0].camera;
    let drawn = Renderer::new(gpu, Content::of(baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
    assert!(finite(&drawn.rgb), "{what}: drawn");
}

/// Those edits and what `change` makes of the folder, under one way. Ways are taken in turn, and an adapter with every other one,
/// as its driver takes seconds over the shaders of each.
fn one_way(number: usize, what: &str, edits: &[(&str, &str)], change: impl Fn(&SceneFolder)) {
    under(number, number.is_multiple_of(2), what, edits, change);
}

/// The same, on an adapter or not.
fn under(number: usize, on_adapter: bool, what: &str, edits: &[(&str, &str)], change: impl Fn(&SceneFolder)) {
    let way = WAYS[number % WAYS.len()];
    let folder = scene(way, edits);
    change(&folder);
    let what = format!("{what}: {}", way.0.replace('\n', ", "));
    assert_finite(&baked(&folder), &what, on_adapter);
}

const CAMERA: &str = "[1,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1]";
const LAMP: &str = "position = [0.4, 0.3, 1.5]";

#[test]
fn light_and_view_that_graze() {
    let directions = ["[1.0, 0.0, 0.0]", "[1.0, 0.0, -1e-7]", "[0.0, 0.0, 1.0]", "[0.0, 0.0, -1.0]"];
    for (way, direction) in directions.into_iter().enumerate() {
        let edit = ("direction = [-0.5, -0.6, -0.6]", &*format!("direction = {direction}"));
        one_way(way, direction, &[edit], |_| {});
    }
    // From the quad's side, a thousandth of a radian above it.
    let aside = "[0,0,-1,0.0022, 0,1,0,0, 1,0,0,-2, 0,0,0,1]";
    let edits = [(CAMERA, aside), ("fov_y_degrees = 30", "fov_y_degrees = 1")];
    for way in [1, 3] {
        under(way, true, "view", &edits, |folder| folder.write("normal.png", &png(4, 4, [128, 128, 255])));
    }
}

#[test]
fn lamps_on_the_surface_behind_it_and_of_thin_cones() {
    let positions = ["[-1.0, -1.0, 0.0]", "[0.0, 0.0, 0.0]", "[0.1, 0.1, 1e-6]", "[0.0, 0.0, -1.0]"];
    for (way, position) in positions.into_iter().enumerate() {
        let edit = (LAMP, &*format!("position = {position}"));
        one_way(way, position, &[edit], |_| {});
        let point = [edit, ("type = \"spot\"", "type = \"point\""), SPOT_ALONE];
        one_way(way + 1, &format!("{position}, a point"), &point, |_| {});
    }
    let cones = ["inner_degrees = 25\nouter_degrees = 25", "inner_degrees = 0\nouter_degrees = 0.001"];
    for (way, cones) in cones.into_iter().enumerate() {
        one_way(way, cones, &[("inner_degrees = 10\nouter_degrees = 25", cones)], |_| {});
    }
}

/// What a point has not.
const SPOT_ALONE: (&str, &str) = (
    "direction = [-0.1, -0.2, -1.0]\nintensity = [2.0, 3.0, 4.0]\ninner_degrees = 10\nouter_degrees = 25\n",
    "intensity = [2.0, 3.0, 4.0]\n",
);

#[test]
fn lights_that_bring_nothing_and_panoramas_without_bright_places() {
    let black = [
        ("irradiance = [3.0, 2.9, 2.7]", "irradiance = [0.0, 0.0, 0.0]"),
        ("intensity = [2.0, 3.0, 4.0]", "intensity = [0.0, 0.0, 0.0]"),
    ];
    under(1, true, "black", &black, |_| {});
    let many = ("lights = 1", "lights = 8");
    one_way(0, "one sun for eight", &[many], |_| {});
    for (way, level) in [0.0, 0.2, 65504.0].into_iter().enumerate() {
        let even = exr(8, 4, &["R", "G", "B"], |_, _| level);
        one_way(way, &format!("all of it {level}"), &[many], |folder| folder.write("env.exr", &even));
    }
    // Nothing shines at all.
    let dark = exr(8, 4, &["R", "G", "B"], |_, _| 0.0);
    for way in [0, 2] {
        one_way(way, "darkness", &black, |folder| folder.write("env.exr", &dark));
    }
}

#[test]
fn normals_that_are_bent_below_the_horizon() {
    let texels = [[255, 128, 0], [0, 0, 0], [128, 255, 128], [128, 128, 0], [128, 128, 128]];
    for (way, texel) in texels.into_iter().enumerate() {
        one_way(way, &format!("{texel:?}"), &[], |folder| folder.write("normal.png", &png(4, 4, texel)));
    }
}

#[test]
fn meshes_of_one_triangle_and_lights_within_closed_ones() {
    let one = tampered(|json, _| json["accessors"][5]["count"] = json!(3));
    one_way(0, "a triangle", &[], |folder| folder.write("quad.glb", &one));
    let closed = octahedron();
    let positions = ["[0.0, 0.0, 0.0]", "[0.0, 0.0, 0.5]", "[0.5, 0.0, 0.0]", "[0.1, 0.1, 0.1]"];
    for (way, position) in positions.into_iter().enumerate() {
        let edit = (LAMP, &*format!("position = {position}"));
        one_way(way, &format!("closed: {position}"), &[edit], |folder| folder.write("quad.glb", &closed));
    }
    // The camera inside, too: everything is seen from behind.
    let inside = (CAMERA, "[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]");
    let edits = [(LAMP, "position = [0.0, 0.0, 0.0]"), inside];
    under(3, true, "inside", &edits, |folder| folder.write("quad.glb", &closed));
}

/// A closed mesh about the origin, half a unit wide to each side.
pub(crate) fn octahedron() -> Vec<u8> {
    let corners: [[f32; 3]; 6] =
        [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
    let mut bin = Vec::new();
    let mut put = |values: &[f32]| values.iter().for_each(|v| bin.extend(v.to_le_bytes()));
    corners.iter().for_each(|corner| put(&corner.map(|x| 0.5 * x)));
    corners.iter().for_each(|corner| put(corner));
    corners.iter().for_each(|[x, y, z]| put(&[0.5 + 0.4 * x + 0.1 * z, 0.5 + 0.4 * y - 0.1 * z]));
    let faces: [[u16; 3]; 8] =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    faces.iter().flatten().for_each(|index| bin.extend(index.to_le_bytes()));
    let view =
        |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let floats = |view: usize, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": 6, "type": kind});
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3,
        }]}],
        "buffers": [{"byteLength": bin.len()}],
        "bufferViews": [view(0, 72), view(72, 72), view(144, 48), view(192, 48)],
        "accessors": [
            floats(0, "VEC3"), floats(1, "VEC3"), floats(2, "VEC2"),
            {"bufferView": 3, "componentType": 5123, "count": 24, "type": "SCALAR"},
        ],
    });
    glb(&document, &bin)
}

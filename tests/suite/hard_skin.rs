//! Hard cases of light that scatters within the skin and of light that comes through it (MODEL 6, 7 and 11): what must hold of
//! image, loss and slopes, which are finite in the f64 reference, on both engines, in the renderer and on tensors.

use serde_json::json;
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::reference::Reference;
use skinfit::engine::{Objective, Point, Task, Unknown};
use skinfit::gpu::RenderOptions;
use skinfit::model::params::Column;
#[cfg(feature = "burn")]
use skinfit::model::{params::Param, transmission::FARTHEST};
use skinfit::prepare::Observed;
use skinfit::render::shading::Shading;

use crate::graphics::bench::{EXACT, gpu, on_gpu};
use crate::hard_lights::octahedron;
use crate::lit::{baked, image, param, quad};
use crate::props::file::{File, Shape};
use crate::scene_folder::SceneFolder;

const LIT: &str =
    "\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \"lights\", \"shadows\", \"directional_occlusion\"";

/// Those effects of the quad of the lights' tests, or of a closed mesh in its place.
fn scene(effect: &str, (table, params): (&str, &str), closed: bool) -> SceneFolder {
    let folder = quad(&format!("{LIT}, \"{effect}\""), "lights = 1");
    if closed {
        folder.write("quad.glb", &octahedron());
    }
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    let text = text
        .replace("[model.params]\n", &format!("[model.params]\n{params}\n"))
        .replace("[mesh]\n", "[mesh]\nmetres_per_unit = 0.005\n");
    folder.write("scene.toml", (text + table).as_bytes());
    folder
}

/// Both engines and the f64 reference of one task, to be asked at any constants.
struct Engines<'a> {
    unknowns: Vec<Unknown>,
    exact: Reference<'a>,
    engines: Vec<(&'static str, Box<dyn Objective>)>,
}

impl<'a> Engines<'a> {
    fn new(observed: &'a Observed, columns: &[Column]) -> Self {
        let unknowns: Vec<Unknown> = columns.iter().copied().map(Unknown::Param).collect();
        let task = || Task { unknowns: unknowns.clone(), ..observed.task() };
        let (light, views) = (&observed.illumination, &observed.views);
        let exact = Reference::new(observed.setup(), light, views, task().loss, &unknowns).unwrap();
        let cpu: Box<dyn Objective> = Box::new(CpuEngine::new(task()).unwrap());
        let mut engines = vec![("cpu", cpu)];
        if let Some(gpu) = gpu() {
            let engine = GpuEngine::new(gpu, task(), &observed.start(), Memory::default()).unwrap();
            engines.push(("gpu", Box::new(engine)));
        }
        Self { unknowns, exact, engines }
    }

    /// Loss and slopes are finite, and the engines' are the reference's. Returns these.
    fn check(&self, point: &Point, what: &str) -> (f64, Vec<f64>) {
        let (loss, slopes) = self.exact.gradient(point);
        let finite = |loss: f64, slopes: &[f64]| loss.is_finite() && slopes.iter().all(|x| x.is_finite());
        assert!(finite(loss, &slopes), "{what}: in f64: {loss} {slopes:?}");
        let most = slopes.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
        for (name, engine) in &self.engines {
            let (got, gradient) = engine.gradient(point);
            assert!(finite(got, &gradient), "{what}: {name}: {got} {gradient:?}");
            // Some tens of roundings of f32 in each residual, of levels some tens more; residuals cancel a hundred times at most.
            assert!((got - loss).abs() <= 1e-4 * loss, "{what}: {name}: {got} {loss}");
            for ((unknown, got), want) in self.unknowns.iter().zip(&gradient).zip(&slopes) {
                let close = (got - want).abs() <= 2e-3 * want.abs() + 1e-4 * most;
                assert!(close, "{what}: {name}: {}: {got} {want}", unknown.name());
            }
        }
        (loss, slopes)
    }

    fn slope(&self, slopes: &[f64], name: &str) -> f64 {
        let of = |unknown: &Unknown| matches!(unknown, Unknown::Param(column) if column.param == param(name));
        slopes[self.unknowns.iter().position(of).unwrap()]
    }
}

/// The start with other values.
fn at(observed: &Observed, set: &[(&str, f64)]) -> Point {
    let mut point = observed.start();
    set.iter().for_each(|(name, value)| point.params.set(param(name), *value));
    point
}

fn tied(names: &[&str]) -> Vec<Column> {
    names.iter().map(|name| Column::tied(param(name))).collect()
}

/// The image at constants as the processor has it, and what both ways of shading show of it.
fn drawn(folder: &SceneFolder, set: &[(&str, f64)], what: &str) -> (Vec<[f32; 3]>, Vec<Vec<[f32; 3]>>) {
    let baked = baked(folder)
        .with_scene(|scene| set.iter().for_each(|(name, value)| scene.params.set(param(name), *value)));
    let want = image(&baked).rgb;
    let shown = |gpu, shading| on_gpu(gpu, &baked, RenderOptions { shading, ..EXACT }).rgb;
    let drawn: Vec<_> =
        gpu().into_iter().flat_map(|gpu| Shading::ALL.map(|shading| shown(gpu, shading))).collect();
    let finite = |rgb: &[[f32; 3]]| rgb.iter().flatten().all(|x| x.is_finite());
    assert!(finite(&want) && drawn.iter().all(|rgb| finite(rgb)), "{what}");
    (want, drawn)
}

/// The same, which both ways of shading show alike.
fn drawn_alike(folder: &SceneFolder, set: &[(&str, f64)], what: &str) -> Vec<[f32; 3]> {
    let (want, drawn) = drawn(folder, set, what);
    let most = want.iter().flatten().fold(0.0_f32, |most, x| most.max(x.abs()));
    for got in drawn {
        for (got, want) in got.iter().flatten().zip(want.iter().flatten()) {
            // Rounding of texture coordinates in f32, and texels at the border of the mesh that one of the two does not cover.
            assert!((got - want).abs() <= 2e-2 * most, "{what}: {got} {want}");
        }
    }
    want
}

const RADII: [&str; 3] = ["diffusion_radius_1", "diffusion_radius_2", "diffusion_radius_3"];
const WEIGHTS: [&str; 3] = ["diffusion_weight_1", "diffusion_weight_2", "diffusion_weight_3"];

/// All radii, and all weights.
fn blurs(radius: f64, weights: [f64; 3]) -> Vec<(&'static str, f64)> {
    let radii = RADII.into_iter().map(|name| (name, radius));
    radii.chain(WEIGHTS.into_iter().zip(weights)).collect()
}

#[test]
fn blurs_of_nothing_and_of_everything_and_weights_on_one_level() {
    // The quad's colour has no blue.
    let folder = scene("diffusion", ("[diffusion]\nlight_map_size = 64\n", ""), false);
    let observed = baked(&folder).sample().unwrap().observe().unwrap();
    let names =
        [&RADII[..], &WEIGHTS, &["colour_mix", "base_weight", "occlusion", "light.key.color"]].concat();
    let engines = Engines::new(&observed, &tied(&names));
    let one = |k: usize| -> [f64; 3] { std::array::from_fn(|i| f64::from(u8::from(i == k))) };
    let all = [[0.0; 3], one(0), one(1), one(2), [0.3; 3]];
    // Below and beyond what a fit may reach, at those bounds, and between.
    for radius in [0.0, 0.02, 2.0, 30.0, 1e6] {
        for weights in all {
            for mix in [0.0, 1.0] {
                let set = [blurs(radius, weights), vec![("colour_mix", mix)]].concat();
                let what = format!("radius {radius}, weights {weights:?}, colour_mix {mix}");
                let (loss, slopes) = engines.check(&at(&observed, &set), &what);
                // A level that weighs nothing, and that nothing is made of which does, moves nothing with its radius.
                if weights == [0.0; 3] {
                    RADII
                        .iter()
                        .for_each(|name| assert_eq!(engines.slope(&slopes, name), 0.0, "{what}: {name}"));
                }
                // What is not blurred is every level.
                if radius == 0.0 {
                    let bare = [blurs(2.0, [0.0; 3]), vec![("colour_mix", mix)]].concat();
                    let bare = engines.exact.loss(&at(&observed, &bare));
                    assert!((loss - bare).abs() <= 1e-9 * bare, "{what}: {loss} {bare}");
                }
            }
        }
    }
    let bare = drawn_alike(&folder, &blurs(2.0, [0.0; 3]), "no weight");
    let none = drawn_alike(&folder, &blurs(0.0, [0.3; 3]), "radius 0");
    // The same light, by way of the levels.
    let pairs = bare.iter().flatten().zip(none.iter().flatten());
    pairs.for_each(|(bare, none)| assert!((bare - none).abs() <= 1e-5 * bare.abs(), "{bare} {none}"));
    drawn_alike(&folder, &blurs(1e6, one(2)), "radius 1e6");
}

/// A square of two triangles, each a chart of its own: the first over a good part of the atlas, the second within one texel
/// of 64 x 64, around that texel's middle or beside it.
fn charts_of_one_triangle(around: bool) -> Vec<u8> {
    let corners = [[-1., -1.], [1., -1.], [1., 1.], [-1., -1.], [1., 1.], [-1., 1.]];
    let middle = [54.5 / 64.0, 9.5 / 64.0];
    let (size, aside) = if around { (0.005, 0.0) } else { (0.001, 0.004) };
    let small = |x: f32, y: f32| [middle[0] + size * x + aside, middle[1] + size * y + aside];
    let uvs = [[0.05, 0.7], [0.7, 0.7], [0.7, 0.05], small(-1., 1.), small(1., -1.), small(-1., -1.)];
    let shape = Shape {
        positions: corners.map(|[x, y]| [x, y, 0.0]).to_vec(),
        normals: vec![[0.0, 0.0, 1.0]; corners.len()],
        uvs: uvs.to_vec(),
        triangles: vec![[0, 1, 2], [3, 4, 5]],
    };
    let mut file = File::new();
    let skin = file.material(json!({"name": "Skin"}));
    file.put(&shape, skin, [0.0; 3]);
    file.glb()
}

#[test]
fn charts_of_one_triangle_and_of_one_texel_scatter_finite_light() {
    for around in [true, false] {
        let folder = scene("diffusion", ("[diffusion]\nlight_map_size = 64\n", ""), false);
        folder.write("quad.glb", &charts_of_one_triangle(around));
        let what = format!("a chart within a texel, around its middle: {around}");
        let observed = baked(&folder).sample().unwrap().observe().unwrap();
        let names = [&RADII[..], &WEIGHTS, &["base_weight", "light.key.color"]].concat();
        let engines = Engines::new(&observed, &tied(&names));
        for radius in [0.05, 2.0, 30.0] {
            engines.check(&at(&observed, &blurs(radius, [0.3; 3])), &what);
        }
        drawn(&folder, &blurs(2.0, [0.3; 3]), &what);
    }
}

#[test]
fn texels_of_hardly_any_size_and_of_a_huge_one_scatter_finite_light() {
    for (what, table, edits) in [
        ("huge", "", ("metres_per_unit = 0.005", "metres_per_unit = 1e6")),
        ("tiny", "", ("metres_per_unit = 0.005", "metres_per_unit = 1e-9")),
        ("neighbours", "stretch = \"derivative\"\nlookup = \"dilated\"\ntaps = \"full\"\n", ("", "")),
    ] {
        let table = format!("[diffusion]\nlight_map_size = 64\n{table}");
        let folder = scene("diffusion", (&table, ""), false);
        let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
        folder.write("scene.toml", text.replace(edits.0, edits.1).as_bytes());
        let observed = baked(&folder).sample().unwrap().observe().unwrap();
        let names = [&RADII[..], &WEIGHTS, &["colour_mix", "base_weight", "normal_strength"]].concat();
        let engines = Engines::new(&observed, &tied(&names));
        for radius in [0.02, 30.0] {
            engines.check(&at(&observed, &blurs(radius, [0.3; 3])), &format!("{what}, radius {radius}"));
        }
    }
}

/// What samples hold of thickness and of lights' ways inside, replaced.
fn through(observed: &Observed, depth: f32) -> Observed {
    let Observed { baked, views } = observed.clone();
    let mut views = views.to_vec();
    let surface = &mut views[0].samples.surface;
    let places: Vec<_> = surface.places().fields().map(|(name, at, _)| (name, at)).collect();
    let depths = places.iter().filter(|(name, _)| *name == "thickness" || name.ends_with("_depth"));
    let mut found = 0;
    for (_, at) in depths {
        surface.rows_mut().plane_mut(*at).for_each(|number| *number = depth);
        found += 1;
    }
    // The sky's, and one of each light.
    assert_eq!(found, 4);
    Observed { baked, views: views.into() }
}

#[test]
fn parts_of_no_thickness_and_of_no_end_and_lengths_at_their_bounds() {
    let folder = scene("transmission", ("", "transmission_weight = 0.5"), true);
    let observed = baked(&folder).sample().unwrap().observe().unwrap();
    let (weight, length) = ("transmission_weight", "transmission_length");
    let info = param(length).info();
    let columns = tied(&[weight, length, "base_weight", "light.key.color"]);
    for depth in [-1e3, 0.0, 1e-30, 79.0, f32::INFINITY] {
        let held = through(&observed, depth);
        let engines = Engines::new(&held, &columns);
        for at_length in [info.lower, 1.0, info.upper] {
            for by in [0.0, 0.5, 1e3] {
                let what = format!("depth {depth}, length {at_length}, weight {by}");
                let point = at(&held, &[(length, at_length), (weight, by)]);
                let (loss, slopes) = engines.check(&point, &what);
                let none = engines.exact.loss(&at(&held, &[(length, at_length), (weight, 0.0)]));
                let ended = f64::from(depth) / at_length >= 80.0;
                if ended || by == 0.0 {
                    assert_eq!(loss, none, "{what}");
                } else if f64::from(depth) / at_length < 10.0 {
                    // What is left beyond that is below a rounding of the loss.
                    assert_ne!(loss, none, "{what}");
                }
                // Where nothing is left nothing moves; where there is no way nothing is lost on it.
                if ended || depth <= 0.0 {
                    assert_eq!(engines.slope(&slopes, length), 0.0, "{what}");
                }
                assert_eq!(engines.slope(&slopes, weight) == 0.0, ended, "{what}");
            }
        }
        #[cfg(feature = "burn")]
        tensors::check(&held, &columns, &engines, depth);
    }
    // All of it comes through, and nothing: what a mesh has no thickness beside a length of.
    for (unit, what) in [("1e-12", "thin"), ("1e6", "thick")] {
        let folder = scene("transmission", ("", "transmission_weight = 0.5"), true);
        let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
        let text = text.replace("metres_per_unit = 0.005", &format!("metres_per_unit = {unit}"));
        folder.write("scene.toml", text.as_bytes());
        // Six vertices have the shadows that samples find for themselves: what is drawn is finite.
        let (shown, _) = drawn(&folder, &[], what);
        let (without, _) = drawn(&folder, &[(weight, 0.0)], what);
        assert_eq!(shown == without, what == "thick", "{what}");
    }
}

#[cfg(feature = "burn")]
mod tensors {
    use super::*;
    use crate::tensors::bench::finite_slopes;

    /// Image and slopes of its sum are finite on tensors, too.
    pub(super) fn check(observed: &Observed, columns: &[Column], engines: &Engines<'_>, depth: f32) {
        let Some(slopes) = finite_slopes(observed, columns, &depth.to_string()) else { return };
        // The second column is the length.
        assert_eq!(
            engines.unknowns[1],
            Unknown::Param(Column::tied(Param::from_name("transmission_length").unwrap()))
        );
        if depth <= 0.0 || f64::from(depth) >= FARTHEST {
            assert_eq!(slopes[1], 0.0, "{depth}");
        }
    }
}

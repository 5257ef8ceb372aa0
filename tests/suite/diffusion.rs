//! Texture-space diffusion against the vectors of an independent float64 oracle: stretch, light map, levels, what fragments
//! look up and how it moves, in f64 and in f32.

use std::sync::{Arc, OnceLock};

use skinfit::engine::cubes_at::CubesAt;
use skinfit::engine::levels::{LevelMaker, Number};
use skinfit::model::diffusion::{DiffusionChoices, Lookup, Method, Stretch, Taps};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::samples::surface_records::{Asked, NEUTRAL, Unmade};
use skinfit::samples::{Atlas, LANES, SurfaceRecords, ViewSamples};
use skinfit::shader::Facts;
use skinfit::shader::facts::FaceSizes;
use skinfit::shader::tangent::chain::Seed;
use skinfit::shader::term::{Term, library, register};
use skinfit_core::program::graph::Input;
use skinfit_core::program::levels::texel_inputs;
use skinfit_core::program::lower::Natives;
use skinfit_core::program::shading::{Shading, constant};
use skinfit_core::program::steps::{Rounding, Steps};

use crate::by_rules::Function;
use crate::common::vectors_light;
use crate::vectors::reader::{Node, Tolerance, Vectors};

/// Light that each texel holds, in the place of lamps and sky.
const GIVEN: &str = "\
// effect: given_light, light that texels hold
// parameter: given_color = 1 in [0, inf), rgb, linear; scale of a part of it; a test
// field: given_ambient: vec3f = 0; what the parameter does not scale
// field: given_key: vec3f = 0; what it does
//
// gives: given_lit
// domain: texel
// joins: diffusion_lit
// cost: 3
fn light_that_is_given(given_ambient: vec3f, given_key: vec3f, given_color: vec3f) -> vec3f {
    return given_ambient + given_color * given_key;
}

// gives: given_part
// adds: given_light
// cost: 1
fn nothing_more(given_color: vec3f) -> vec3f {
    return 0.0 * given_color;
}
";

pub(crate) fn given() -> &'static Term {
    static TERM: OnceLock<&'static Term> = OnceLock::new();
    TERM.get_or_init(|| register("given", GIVEN).unwrap_or_else(|error| panic!("{error}")))
}

pub(crate) fn setup(choices: DiffusionChoices) -> Setup {
    library::register_all();
    let diffusion = Effect::from_name("diffusion").unwrap();
    let mut setup =
        Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&[diffusion, given().effect]));
    setup.choices.diffusion = choices;
    setup
}

fn facts(setup: Setup) -> Facts {
    Facts::of_samples(setup, FaceSizes::default(), false)
}

/// Inputs round to f32 where texels and samples hold them, which levels and lookups pass on some times.
const HELD: f64 = 2e-6;

/// What a kind of number may be off.
fn near<R: Number>(file: &Node<'_>) -> Tolerance {
    let tolerances = file.vector.tolerances();
    if size_of::<R>() == 4 { tolerances.single } else { Tolerance { abs: HELD, rel: HELD } }
}

fn param(name: &str) -> Param {
    Param::from_name(name).unwrap_or_else(|| panic!("there is no {name}"))
}

/// Rows of texels, one after another.
pub(crate) struct Texels {
    pub(crate) size: usize,
    pub(crate) charts: Vec<u32>,
    /// Of each texel of the square: by the field's name.
    pub(crate) fields: Vec<(&'static str, Vec<[f64; 3]>)>,
}

impl Texels {
    pub(crate) fn atlas(&self, setup: &Setup) -> Arc<Atlas> {
        let inputs = texel_inputs(&facts(*setup)).unwrap();
        let value = |input: &Input, texel: usize| {
            let of = |name: &str| {
                self.fields.iter().find(|(known, _)| *known == name).map(|(_, texels)| texels[texel])
            };
            let neutral = if input.name == "albedo" { 1.0 } else { 0.0 };
            of(&input.name).map_or(neutral, |number| number[input.component]) as f32
        };
        Arc::new(Atlas::of_charts(self.size as u32, &self.charts, inputs, value))
    }

    /// A list of the file over its atlas' texels, `columns` a row, in the square.
    fn list(&self, rows: &[Vec<[f64; 3]>]) -> Vec<[f64; 3]> {
        let at = |i: usize| rows.get(i / self.size).and_then(|row| row.get(i % self.size));
        (0..self.size * self.size).map(|i| at(i).copied().unwrap_or([0.0; 3])).collect()
    }
}

/// The texels' numbers, row by row; fewer than three are followed by 0.
fn rows(node: &Node<'_>) -> Vec<Vec<[f64; 3]>> {
    let three = |item: Node<'_>| {
        let mut numbers = item.numbers();
        numbers.resize(3, 0.0);
        [numbers[0], numbers[1], numbers[2]]
    };
    node.items().iter().map(|row| row.items().into_iter().map(three).collect()).collect()
}

/// The atlas of the vectors, in a square, its light scaled as `diffusion2_atlas` says.
pub(crate) struct GivenLight<'v> {
    file: Node<'v>,
    pub(crate) texels: Texels,
    pub(crate) params: Params,
}

/// Where a sample looks it up.
pub(crate) struct Looking {
    pub(crate) uv: [f64; 2],
    pub(crate) chart: u32,
    pub(crate) albedo: [f64; 3],
}

impl<'v> GivenLight<'v> {
    fn new(vectors: &'v Vectors) -> Self {
        let file = vectors.files["diffusion2_atlas.json"].root();
        let inputs = file.at("inputs");
        let [width, height] = ["width", "height"].map(|name| inputs.at(name).number() as usize);
        let size = width.max(height);
        let mut texels = Texels { size, charts: Vec::new(), fields: Vec::new() };
        texels.charts =
            texels.list(&rows_of_numbers(&inputs.at("chart"))).iter().map(|c| c[0] as u32).collect();
        let list = |name: &str| texels.list(&rows(&inputs.at(name)));
        let sum = |a: &[[f64; 3]], b: &[[f64; 3]], by: f64| -> Vec<[f64; 3]> {
            a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|c| a[c] + by * b[c])).collect()
        };
        let over_pi = 1.0 / std::f64::consts::PI;
        let none = vec![[0.0; 3]; size * size];
        let ambient = sum(&list("ambient"), &list("irradiance_2"), over_pi);
        let key = sum(&none, &list("irradiance_1"), over_pi);
        let stretch = list("stretch");
        let fields = vec![
            ("albedo", list("colour")),
            ("given_ambient", ambient),
            ("given_key", key),
            ("dpdx_vertex_position", stretch.iter().map(|s| [s[0], 0.0, 0.0]).collect()),
            ("dpdy_vertex_position", stretch.iter().map(|s| [0.0, s[1], 0.0]).collect()),
        ];
        texels.fields = fields;
        let mut params = Params::defaults(Form::Corrected);
        params.set_rgb(given().params[0], inputs.at("light_color").three());
        params.set(param("diffusion_unit"), 1.0);
        for (k, weight) in (1..).zip(inputs.at("weights_1_to_3").items()) {
            params.set_rgb(param(&format!("diffusion_weight_{k}")), weight.three());
        }
        for (k, radius) in (1..).zip(inputs.at("radii").items()) {
            params.set(param(&format!("diffusion_radius_{k}")), radius.number());
        }
        Self { file, texels, params }
    }

    /// As one of the files has it that mix colours before and after.
    pub(crate) fn mixed(vectors: &'v Vectors, file: &Node<'_>) -> Self {
        let mut light = Self::new(vectors);
        let constants = file.at("constants");
        file.at("atlas_file").assert_text("diffusion2_atlas.json");
        light.params.set(param("colour_mix"), constants.at("colour_mix").number());
        let radii = constants.at("radii").numbers();
        (1..).zip(&radii).for_each(|(k, &radius)| {
            assert_eq!(light.params.scalar(param(&format!("diffusion_radius_{k}"))), radius);
        });
        light
    }

    /// The file's lookups.
    pub(crate) fn lookups(&self) -> Vec<Looking> {
        let inputs = self.file.at("inputs");
        let squeeze = inputs.at("height").number() / self.texels.size as f64;
        let looking = |lookup: Node<'_>| {
            lookup.at("case").text();
            let [u, v] = [0, 1].map(|c| lookup.at("uv").item(c).number());
            let chart = lookup.at("chart").number() as u32;
            Looking { uv: [u, v * squeeze], chart, albedo: lookup.at("albedo").three() }
        };
        inputs.at("lookups").items().into_iter().map(looking).collect()
    }

    /// Samples there.
    pub(crate) fn samples(&self, atlas: &Arc<Atlas>) -> ViewSamples {
        let lookups = self.lookups();
        let asked = Asked { uv: true, albedo: true, ..Asked::default() };
        let mut surface = SurfaceRecords::new(asked, 1);
        for slot in 0..LANES {
            let Looking { uv, chart, albedo } = &lookups[slot.min(lookups.len() - 1)];
            let fragment = skinfit::model::fragment::Fragment {
                base: [0.0, 0.0, 1.0],
                view: [0.0, 0.0, -1.0],
                albedo: albedo.map(|x| x as f32),
                ..NEUTRAL
            };
            let (uv, chart) = (uv.map(|x| x as f32), *chart as f32);
            surface.set_all(slot, &(fragment, Unmade { uv, chart, ..Unmade::default() }), 1.0);
        }
        ViewSamples {
            group_start: vec![0, 1],
            pixel: (0..LANES as u32).collect(),
            coverage: vec![1.0; LANES],
            surface,
            atlas: Some(Arc::clone(atlas)),
            ..ViewSamples::default()
        }
    }
}

/// The taps of a file's blurs.
pub(crate) fn taps_of(file: &Node<'_>) -> Taps {
    match file.at("constants").at("taps") {
        name if name.is_text() => {
            name.assert_text(Taps::Full.name());
            Taps::Full
        }
        count => *Taps::ALL.iter().find(|taps| taps.count() == Some(count.number() as u32)).unwrap(),
    }
}

fn rows_of_numbers(node: &Node<'_>) -> Vec<Vec<[f64; 3]>> {
    node.items().iter().map(|row| row.numbers().into_iter().map(|x| [x, 0.0, 0.0]).collect()).collect()
}

/// What of the files is compared with nothing, and why.
const LEFT_OUT: [(&str, &str); 1] = [("note", "a sentence for people")];

/// Nothing of a file is left unread but what [`LEFT_OUT`] lists.
fn all_read(vectors: &Vectors, name: &str) {
    let root = vectors.files[name].root();
    root.at("name").assert_text(&root.vector.name);
    root.at("kind").assert_text("diffusion2");
    root.vector.tolerances();
    let mut left = root.vector.left();
    left.retain(|path| !LEFT_OUT.iter().any(|(known, _)| path.starts_with(known)));
    assert!(left.is_empty(), "{name}: {left:?}");
}

fn read() -> Vectors {
    Vectors::read(&vectors_light())
}

/// The levels of an atlas.
fn levels<R: Number>(
    setup: &Setup,
    atlas: &Atlas,
    params: &Params,
) -> std::collections::BTreeMap<String, Vec<[R; 3]>> {
    let shading = Shading::new(&facts(*setup), &[], |_| None, Natives::Written).unwrap();
    LevelMaker::<R>::new(shading.levels).make(atlas, params, &CubesAt::dark(|x| R::from(x))).all()
}

fn numbers<R: Number>(texels: &[[R; 3]]) -> Vec<f64> {
    texels.iter().flatten().map(|&x| x.into()).collect()
}

/// What samples look up and show: quantities by name, and how the sum moves along each seed.
struct Shown {
    quantities: Vec<(&'static str, Vec<[f64; 3]>)>,
    slopes: Vec<Vec<[f64; 3]>>,
}

fn shown<R: Number>(
    case: &GivenLight<'_>,
    setup: &Setup,
    params: &Params,
    seeds: &[Param],
    names: &[&'static str],
) -> Shown {
    let samples = case.samples(&case.texels.atlas(setup));
    let along: Vec<Seed> = seeds.iter().map(|&param| Seed::of_param(param)).collect();
    let shading = Shading::new(&facts(*setup), &along, |_| None, Natives::Written).unwrap();
    let mut outputs: Vec<_> = shading.tangents.iter().flat_map(|tangent| tangent[..3].to_vec()).collect();
    let by_rules = names.iter().filter_map(|name| shading.quantities.get(name));
    outputs.extend(by_rules.flatten());
    let steps = Steps::new(&shading.graph, &outputs, |_| Rounding::Plain);
    let maker = LevelMaker::<R>::new(shading.levels);
    let found = maker.look_up(&samples, params, || CubesAt::dark(|x| R::from(x)), |row| row);
    let mut shown = Shown {
        quantities: names.iter().map(|&name| (name, Vec::new())).collect(),
        slopes: seeds.iter().map(|_| Vec::new()).collect(),
    };
    let fragments = (0..case.lookups().len()).map(|slot| samples.surface.fragment(slot));
    for (slot, fragment) in fragments.enumerate() {
        let setting =
            steps.setting(0.0_f64, |input| constant(input, params).unwrap(), |name| panic!("no cube {name}"));
        let mut registers = Vec::new();
        steps.run(&setting, 0.0, &mut registers, |place| {
            let input = &steps.fields()[place];
            match (maker.row(input), input.name.as_str()) {
                (Some(row), _) => found[row][slot].into(),
                (None, "albedo") => f64::from(fragment.albedo[input.component]),
                (None, other) => panic!("a sample has no {other}"),
            }
        });
        let mut given = steps.outputs(&setting, &registers);
        let mut three = || [0; 3].map(|_| given.next().unwrap());
        shown.slopes.iter_mut().for_each(|slopes| slopes.push(three()));
        for (name, values) in &mut shown.quantities {
            let looked_up = |component| maker.row(&Input { name: (*name).to_owned(), component });
            values.push(match looked_up(0) {
                Some(row) => [0, 1, 2].map(|c| found[row + c][slot].into()),
                None => three(),
            });
        }
    }
    shown
}

impl Shown {
    fn of(&self, name: &str) -> Vec<f64> {
        let found = self.quantities.iter().find(|(known, _)| *known == name).unwrap();
        found.1.iter().flatten().copied().collect()
    }
}

const LEVELS: [&str; 4] =
    ["diffusion_level_0", "diffusion_level_1", "diffusion_level_2", "diffusion_level_3"];

/// Light map, levels, what fragments show of them and how it moves.
fn mixed<R: Number>(vectors: &Vectors, file: &Node<'_>) {
    let case = GivenLight::mixed(vectors, file);
    let expected = file.at("expected");
    let setup = setup(DiffusionChoices { taps: taps_of(file), ..DiffusionChoices::DEFAULT });
    let near = near::<R>(file);
    let made = levels::<R>(&setup, &case.texels.atlas(&setup), &case.params);
    if let Some(want) = expected.get("light_map") {
        near.check("light map", &numbers(&made[LEVELS[0]]), &want);
        for (k, want) in expected.at("levels").items().iter().enumerate() {
            near.check("level", &numbers(&made[LEVELS[k + 1]]), want);
        }
        let weights = [1, 2, 3].map(|k| case.params.rgb(param(&format!("diffusion_weight_{k}"))));
        let mixed = |i: usize| -> [f64; 3] {
            let level = |k: usize, c: usize| -> f64 { made[LEVELS[k]][i][c].into() };
            [0, 1, 2].map(|c| {
                level(0, c) + (1..4).map(|k| weights[k - 1][c] * (level(k, c) - level(0, c))).sum::<f64>()
            })
        };
        let all: Vec<f64> = (0..made[LEVELS[0]].len()).flat_map(mixed).collect();
        near.check("scattered", &all, &expected.at("scattered"));
        if size_of::<R>() == size_of::<f64>() {
            adjoint(&case, &setup, file);
        }
    }
    let jacobian = expected.at("jacobian");
    let columns: Vec<Param> = jacobian
        .at("columns")
        .items()
        .iter()
        .map(|name| {
            let column = name.text();
            let param = if column == "light_color" { given().params[0] } else { param(column) };
            name.assert_text(if param == given().params[0] { "light_color" } else { param.name() });
            param
        })
        .collect();
    let names = [&LEVELS[..], &["scattered_light", "diffuse_part"]].concat();
    let shown = shown::<R>(&case, &setup, &case.params, &columns, &names);
    let looked_up: Vec<Vec<f64>> = LEVELS.iter().map(|name| shown.of(name)).collect();
    let order = (0..case.lookups().len())
        .flat_map(|i| looked_up.iter().flat_map(move |level| level[3 * i..3 * i + 3].to_vec()));
    near.check("levels looked up", &order.collect::<Vec<f64>>(), &expected.at("levels_at_lookups"));
    near.check("scattered, looked up", &shown.of("scattered_light"), &expected.at("scattered_at_lookups"));
    near.check("final", &shown.of("diffuse_part"), &expected.at("final"));
    let choices = DiffusionChoices { lookup: Lookup::Dilated, ..setup.choices.diffusion };
    let mut by_one_fetch = setup;
    by_one_fetch.choices.diffusion = choices;
    let found = self::shown::<R>(&case, &by_one_fetch, &case.params, &[], &["scattered_light"]);
    let want = expected.at("dilated").at("scattered_at_lookups");
    near.check("scattered, looked up by one fetch", &found.of("scattered_light"), &want);
    // Where a deviation is many texels, taps move by as many for a millimetre: what rounds counts tenfold.
    let slopes = (0..case.lookups().len()).flat_map(|i| (0..3).map(move |c| (i, c)));
    let slopes = slopes.flat_map(|(i, c)| shown.slopes.iter().map(move |slope| slope[i][c]));
    near.times(10.0).check("Jacobian", &slopes.collect::<Vec<f64>>(), &jacobian.at("J"));
}

/// The adjoint of the blurs, made of their forward passes: what the scattered light weighed by the cotangent is of a light map
/// of one texel alone is the gradient by that texel.
fn adjoint(case: &GivenLight<'_>, setup: &Setup, file: &Node<'_>) {
    let expected = file.at("expected").at("adjoint");
    let cotangent = expected.at("cotangent").wanted();
    let shading = Shading::new(&facts(*setup), &[], |_| None, Natives::Written).unwrap();
    let maker = LevelMaker::<f64>::new(shading.levels);
    let weights = [1, 2, 3].map(|k| case.params.rgb(param(&format!("diffusion_weight_{k}"))));
    let size = case.texels.size;
    let covered = (0..size * size).filter(|&i| case.texels.charts[i] > 0);
    let mut gradient = Vec::new();
    for texel in covered {
        let mut lit = vec![[0.0; 3]; size * size];
        lit[texel] = [1.0; 3];
        let mut fields = case.texels.fields.clone();
        fields.retain(|(name, _)| name.starts_with("dpd"));
        fields.push(("given_ambient", lit));
        let texels = Texels { size, charts: case.texels.charts.clone(), fields };
        let made = maker.make(&texels.atlas(setup), &case.params, &CubesAt::dark(f64::from)).all();
        let [light, levels @ ..] = LEVELS.map(|name| &made[name]);
        gradient.extend([0, 1, 2].map(|c| {
            let scattered = |i: usize| {
                let scatters = |k: usize| weights[k][c] * (levels[k][i][c] - light[i][c]);
                light[i][c] + (0..3).map(scatters).sum::<f64>()
            };
            (0..light.len()).map(|i| cotangent[3 * i + c] * scattered(i)).sum::<f64>()
        }));
    }
    near::<f64>(file).check("gradient by the light map", &gradient, &expected.at("light_map_gradient"));
}

#[test]
fn light_maps_levels_and_lookups_are_those_of_the_vectors_and_move_as_they_do() {
    let vectors = read();
    let mut files = 0;
    for file in vectors.of_kind("diffusion2") {
        if file.get("constants").and_then(|constants| constants.get("taps")).is_some() {
            mixed::<f64>(&vectors, &file);
            mixed::<f32>(&vectors, &file);
            all_read(&vectors, &format!("{}.json", file.vector.name));
            files += 1;
        }
    }
    assert_eq!(files, 8);
}

/// What each lookup weighs of the light map, texel by texel.
fn lookup_weights(vectors: &Vectors, lookup: Lookup, want: &Node<'_>) {
    let case = GivenLight::new(vectors);
    let setup = setup(DiffusionChoices { lookup, ..DiffusionChoices::DEFAULT });
    let size = case.texels.size;
    let covered: Vec<usize> = (0..size * size).filter(|&i| case.texels.charts[i] > 0).collect();
    let mut weights = vec![Vec::new(); case.lookups().len()];
    let mut one = GivenLight::new(vectors);
    // A texel a channel is lit at a time: what a lookup finds is what it weighs.
    for three in covered.chunks(3) {
        let mut lit = vec![[0.0; 3]; size * size];
        three.iter().enumerate().for_each(|(c, &texel)| lit[texel][c] = 1.0);
        one.texels.fields.retain(|(name, _)| name.starts_with("dpd"));
        one.texels.fields.push(("given_ambient", lit));
        let found = shown::<f64>(&one, &setup, &one.params, &[], &LEVELS[..1]);
        for (weights, level) in weights.iter_mut().zip(found.of(LEVELS[0]).chunks(3)) {
            weights.extend(three.iter().zip(level).map(|(&texel, &weight)| (texel, weight)));
        }
    }
    let near = near::<f64>(&case.file);
    for (found, want) in weights.iter().zip(want.items()) {
        let mut found: Vec<(usize, f64)> =
            found.iter().copied().filter(|(_, weight)| *weight > 1e-6).collect();
        found.sort_unstable_by_key(|(texel, _)| *texel);
        let mut want = want.items();
        // Texture coordinates round to f32: a texel may weigh 1e-7.
        want.retain(|entry| entry.item(2).wanted()[0] > 1e-6);
        assert_eq!(found.len(), want.len(), "{found:?}");
        for ((texel, weight), want) in found.iter().zip(want) {
            let at = [(texel % size) as f64, (texel / size) as f64, *weight];
            near.check("weight", &at, &want);
        }
    }
}

#[test]
fn lookups_weigh_the_texels_of_their_own_chart_or_those_that_one_fetch_finds() {
    let vectors = read();
    let expected = vectors.files["diffusion2_atlas.json"].root().at("expected");
    lookup_weights(&vectors, Lookup::Chart, &expected.at("lookup_weights"));
    lookup_weights(&vectors, Lookup::Dilated, &expected.at("dilated_weights"));
    constant_levels(&vectors);
    all_read(&vectors, "diffusion2_atlas.json");
}

/// A light map of one constant has levels of that constant, to the bit.
fn constant_levels(vectors: &Vectors) {
    let mut case = GivenLight::new(vectors);
    let constant = case.file.at("expected").at("constant");
    let light = constant.at("light").wanted()[0];
    let every = constant.at("every_level").wanted()[0];
    case.texels.fields.retain(|(name, _)| name.starts_with("dpd"));
    case.texels.fields.push(("given_ambient", vec![[light; 3]; case.texels.size * case.texels.size]));
    for &taps in Taps::ALL {
        let setup = setup(DiffusionChoices { taps, ..DiffusionChoices::DEFAULT });
        // Radius 0 is below the least that may be given, and that of a head beyond the greatest.
        for radius in [0.0, 0.02, 1.0, 30.0, 150.0] {
            (1..4).for_each(|k| case.params.set(param(&format!("diffusion_radius_{k}")), radius));
            let atlas = case.texels.atlas(&setup);
            let made = levels::<f64>(&setup, &atlas, &case.params);
            LEVELS.iter().for_each(|name| assert!(made[*name].iter().flatten().all(|&x| x == every)));
            let made = levels::<f32>(&setup, &atlas, &case.params);
            LEVELS
                .iter()
                .for_each(|name| assert!(made[*name].iter().flatten().all(|&x| f64::from(x) == every)));
        }
    }
}

#[test]
fn stretch_from_neighbour_to_neighbour_is_that_of_the_vectors() {
    let vectors = read();
    let file = vectors.files["diffusion2_stretch.json"].root();
    file.at("atlas_file").assert_text("diffusion2_atlas.json");
    let mut case = GivenLight::new(&vectors);
    let position = case.texels.list(&rows(&file.at("inputs").at("position_mm")));
    case.texels.fields.push(("vertex_position", position));
    let setup = setup(DiffusionChoices { stretch: Stretch::Derivative, ..DiffusionChoices::DEFAULT });
    let atlas = case.texels.atlas(&setup);
    fn check<R: Number>(case: &GivenLight<'_>, setup: &Setup, atlas: &Atlas, want: &Node<'_>) {
        let made = levels::<R>(setup, atlas, &case.params);
        let stretch = &made["diffusion_stretch"];
        let size = case.texels.size;
        for (row, want) in want.items().iter().enumerate() {
            for (column, want) in want.items().iter().enumerate() {
                let place = atlas.place(column as i64, row as i64);
                let found = place.map_or([0.0; 2], |place| [0, 1].map(|c| stretch[place][c].into()));
                assert_eq!(place.is_some(), case.texels.charts[row * size + column] > 0);
                near::<R>(&case.file).check("stretch", &found, want);
            }
        }
    }
    let want = file.at("expected").at("stretch");
    check::<f64>(&case, &setup, &atlas, &want);
    check::<f32>(&case, &setup, &atlas, &want);
    all_read(&vectors, "diffusion2_stretch.json");
}

/// Levels by distance over the surface, and how they move along the radii and through the light map.
fn over_the_surface<R: Number>(file: &Node<'_>) {
    let (inputs, expected, near) = (file.at("inputs"), file.at("expected"), near::<R>(file));
    let list = |name: &str| -> Vec<[f64; 3]> { inputs.at(name).items().iter().map(Node::three).collect() };
    let (places, light, areas) = (list("position_mm"), list("light_map"), inputs.at("area").numbers());
    // In a square, as they come: nothing depends on where in the atlas a texel is.
    let size = (1..).find(|size| size * size >= places.len()).unwrap();
    let padded = |list: &[[f64; 3]]| -> Vec<[f64; 3]> {
        (0..size * size).map(|i| list.get(i).copied().unwrap_or_default()).collect()
    };
    let along = |axis: usize, of: &dyn Fn(f64) -> f64| -> Vec<[f64; 3]> {
        let step = |&area: &f64| [0, 1, 2].map(|c| if c == axis { of(area) } else { 0.0 });
        padded(&areas.iter().map(step).collect::<Vec<_>>())
    };
    let fields = vec![
        ("vertex_position", padded(&places)),
        ("vertex_normal", padded(&list("normal"))),
        // The part that the parameter scales, by 1: so a level is also how it moves along that.
        ("given_key", padded(&light)),
        ("dpdx_vertex_position", along(0, &|area| area)),
        ("dpdy_vertex_position", along(1, &|_| 1.0)),
    ];
    let charts = (0..size * size).map(|i| u32::from(i < places.len())).collect();
    let texels = Texels { size, charts, fields };
    let setup = setup(DiffusionChoices { method: Method::Surface, ..DiffusionChoices::DEFAULT });
    let mut params = Params::defaults(Form::Corrected);
    params.set(param("diffusion_unit"), 1.0);
    for (k, radius) in (1..).zip(inputs.at("radii").numbers()) {
        params.set(param(&format!("diffusion_radius_{k}")), radius);
    }
    let radii = [1, 2, 3].map(|k| param(&format!("diffusion_radius_{k}")));
    let seeds: Vec<Seed> = radii.into_iter().chain([given().params[0]]).map(Seed::of_param).collect();
    let shading = Shading::new(&facts(setup), &seeds, |_| None, Natives::Written).unwrap();
    let maker = LevelMaker::<R>::new(shading.levels);
    let made = maker.make(&texels.atlas(&setup), &params, &CubesAt::dark(|x| R::from(x))).all();
    let at: Vec<usize> = inputs.at("at").numbers().into_iter().map(|i| i as usize).collect();
    for (k, name) in LEVELS[1..].iter().enumerate() {
        // Six deviations leave out 1.5e-8 of the weight over a plane.
        near.check("level", &numbers(&made[*name]), &expected.at("levels").item(k));
        near.check(
            "through the light map",
            &numbers(&made[&format!("d3_{name}")]),
            &expected.at("levels").item(k),
        );
        let moved = |r: usize, i: usize, c: usize| {
            made.get(&format!("d{r}_{name}")).map_or(0.0, |level| level[i][c].into())
        };
        let slopes = at.iter().flat_map(|&i| (0..3).flat_map(move |c| (0..3).map(move |r| moved(r, i, c))));
        near.check("by the radii", &slopes.collect::<Vec<f64>>(), &expected.at("d_levels").item(k));
    }
    // A constant stays that constant, to the bit.
    let mut constant = texels;
    constant.fields.retain(|(name, _)| *name != "given_key");
    constant.fields.push(("given_key", vec![[2.5; 3]; size * size]));
    let made = maker.make(&constant.atlas(&setup), &params, &CubesAt::dark(|x| R::from(x))).all();
    LEVELS.iter().for_each(|name| assert!(numbers(&made[*name]).iter().all(|&x| x == 2.5), "{name}"));
}

#[test]
fn levels_by_distance_over_the_surface_are_those_of_the_vectors_and_move_as_they_do() {
    let vectors = read();
    let file = vectors.files["diffusion2_surface.json"].root();
    over_the_surface::<f64>(&file);
    over_the_surface::<f32>(&file);
    all_read(&vectors, "diffusion2_surface.json");
}

/// Levels by blurs that clamp at the border of a map: of a chart that goes on beyond it with the border's own texels, as far
/// as a blur reaches. Each of the level before as the file has it, so that errors do not add up.
pub(crate) fn clamped_vector<R: Number>(file: &Node<'_>) {
    let inputs = file.at("inputs");
    let (light, stretch) = (rows(&inputs.at("light")), rows(&inputs.at("stretch")));
    let (sigmas, weights) = (inputs.at("sigmas").numbers(), rows_of_weights(&inputs.at("weights")));
    let least = stretch.iter().flatten().flat_map(|step| step[..2].to_vec()).fold(f64::INFINITY, f64::min);
    let widest = sigmas.iter().copied().fold(0.0, f64::max);
    // Six deviations, and the second texel of a fetch.
    let margin = (6.0 * widest / least).ceil() as usize + 1;
    let (side, near) = (light.len(), near::<R>(file));
    let size = side + 2 * margin;
    let within = |at: usize| at.saturating_sub(margin).min(side - 1);
    let spread = |rows: &[Vec<[f64; 3]>]| -> Vec<[f64; 3]> {
        (0..size * size).map(|i| rows[within(i / size)][within(i % size)]).collect()
    };
    for (taps, name) in [(Taps::Five, "5"), (Taps::Full, "full")] {
        let expected = file.at("expected").at(name);
        let levels = expected.at("levels").items();
        let known: Vec<Vec<Vec<[f64; 3]>>> = levels.iter().map(rows).collect();
        let setup = setup(DiffusionChoices { taps, ..DiffusionChoices::DEFAULT });
        let mut params = Params::defaults(Form::Corrected);
        params.set(param("diffusion_unit"), 1.0);
        for (k, &sigma) in sigmas.iter().enumerate() {
            params.set(param("diffusion_radius_1"), sigma);
            let steps = spread(&stretch);
            let fields = vec![
                ("given_ambient", spread(if k == 0 { &light } else { &known[k] })),
                ("dpdx_vertex_position", steps.iter().map(|s| [s[0], 0.0, 0.0]).collect()),
                ("dpdy_vertex_position", steps.iter().map(|s| [0.0, s[1], 0.0]).collect()),
            ];
            let texels = Texels { size, charts: vec![1; size * size], fields };
            let made = self::levels::<R>(&setup, &texels.atlas(&setup), &params);
            let inner = |level: &[[R; 3]]| -> Vec<f64> {
                let places = (0..side * side).map(|i| (i / side + margin) * size + i % side + margin);
                places.flat_map(|i| level[i].map(Into::into)).collect()
            };
            if k == 0 {
                near.check("light map", &inner(&made[LEVELS[0]]), &levels[0]);
            }
            near.check("level", &inner(&made[LEVELS[1]]), &levels[k + 1]);
        }
        near.check("result", &mixed_by_rule(&known, &weights), &expected.at("result"));
    }
}

/// The levels as the rules mix them, which have the first one's weight as what the others leave.
fn mixed_by_rule(levels: &[Vec<Vec<[f64; 3]>>], weights: &[[f64; 3]]) -> Vec<f64> {
    let effects = setup(DiffusionChoices::DEFAULT).effects;
    let mixing = Function::of_rule(effects, "scattered_of_three", &[3; 7]);
    for c in 0..3 {
        assert!((weights.iter().map(|weight| weight[c]).sum::<f64>() - 1.0).abs() < 1e-12);
    }
    let texels = levels[0].iter().enumerate().flat_map(|(y, row)| (0..row.len()).map(move |x| (y, x)));
    let mixed = |(y, x): (usize, usize)| {
        let found = levels.iter().map(|level| &level[y][x][..]);
        let arguments: Vec<&[f64]> = found.chain(weights[1..].iter().map(|weight| &weight[..])).collect();
        mixing.of(0.0, &arguments)
    };
    texels.flat_map(mixed).collect()
}

fn rows_of_weights(node: &Node<'_>) -> Vec<[f64; 3]> {
    node.items().iter().map(Node::three).collect()
}

//! The diffusion race's data folder as the engine's own texels and samples: an atlas of charts, and pixels that look levels
//! up there.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use serde::Deserialize;
use skinfit::engine::Unknown;
use skinfit::engine::view::ObservedView;
use skinfit::model::diffusion::{Combined, DiffusionChoices, Lookup, Method, Stretch, Taps};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Column, Param, Params};
use skinfit::program::graph::Input;
use skinfit::program::levels::texel_inputs;
use skinfit::samples::rows::{Row, Rows};
use skinfit::samples::surface_records::Asked;
use skinfit::samples::{Atlas, LANES, SurfaceRecords, ViewSamples, z_order};
use skinfit::shader::Facts;
use skinfit::shader::facts::FaceSizes;
use skinfit::shader::term::{Term, register};

use super::window::Window;
use crate::data::{Result, numbers, parse};

/// What the data folder says of itself.
#[derive(Debug, Deserialize)]
pub(crate) struct Manifest {
    pub format: String,
    pub texels: usize,
    pub pixels: usize,
    pub param_names: Vec<String>,
    pub params_true: Vec<f64>,
    pub params_init: Vec<f64>,
    pub params_opt_noisy: Vec<f64>,
    pub loss_opt_noisy: f64,
    pub hessian_half_noisy: Vec<Vec<f64>>,
}

/// The race's unknowns: its names, ours, and whether each channel has its own.
const UNKNOWNS: [(&str, &str, bool); 8] = [
    ("diffusion_weight_1", "diffusion_weight_1", true),
    ("diffusion_weight_2", "diffusion_weight_2", true),
    ("diffusion_weight_3", "diffusion_weight_3", true),
    ("diffusion_radius_1", "diffusion_radius_1", false),
    ("diffusion_radius_2", "diffusion_radius_2", false),
    ("diffusion_radius_3", "diffusion_radius_3", false),
    ("colour_mix", "colour_mix", false),
    ("key", "given_key", true),
];

/// The light that texels hold, as a term of a file.
fn given() -> Result<&'static Term> {
    static TERM: OnceLock<Result<&'static Term>> = OnceLock::new();
    let made = || register("given", include_str!("given.wgsl")).map_err(|error| error.to_string());
    TERM.get_or_init(made).clone()
}

/// A parameter of ours; those of terms are known once they are registered.
fn param(name: &str) -> Result<Param> {
    given()?;
    Param::from_name(name).ok_or_else(|| format!("there is no parameter {name}"))
}

/// The effects: diffusion of the given light, and a rim of exponent 1 for the race's factor.
pub(crate) fn setup() -> Result<Setup> {
    let given = given()?;
    let diffusion = Effect::from_name("diffusion").ok_or("there is no diffusion")?;
    let effects = Effects::of(&[diffusion, Effect::Rim, given.effect]);
    let mut setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    setup.choices.diffusion = DiffusionChoices {
        taps: Taps::Five,
        stretch: Stretch::Exact,
        lookup: Lookup::Dilated,
        method: Method::Separable,
        combined: Combined::Map,
        ..DiffusionChoices::DEFAULT
    };
    Ok(setup)
}

/// The unknowns in the race's order.
pub(crate) fn columns() -> Result<Vec<Column>> {
    let mut columns = Vec::new();
    for (_, name, rgb) in UNKNOWNS {
        let param = param(name)?;
        if rgb { columns.extend(Column::per_channel(param)) } else { columns.push(Column::tied(param)) }
    }
    Ok(columns)
}

/// The race's parameter vector as the model's.
pub(crate) fn params(values: &[f64]) -> Result<Params> {
    let mut params = Params::defaults(Form::Corrected);
    // Light is weighed by the rim alone, which is the race's factor; its stretch is in millimetres.
    for (name, value) in
        [("base_weight", 0.0), ("rim_weight", 1.0), ("rim_exponent", 1.0), ("diffusion_unit", 1.0)]
    {
        params.set(param(name)?, value);
    }
    columns()?.iter().zip(values).for_each(|(column, &value)| column.set(&mut params, value));
    Ok(params)
}

/// The model's parameters as the race's vector.
pub(crate) fn vector(params: &Params) -> Result<Vec<f64>> {
    Ok(columns()?.iter().map(|column| column.get(params)).collect())
}

/// The free columns of an engine.
pub(crate) fn unknowns() -> Result<Vec<Unknown>> {
    Ok(columns()?.into_iter().map(Unknown::Param).collect())
}

impl Manifest {
    pub(crate) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("manifest.json");
        let told = |words: String| format!("{}: {words}", path.display());
        let text = std::fs::read_to_string(&path).map_err(|e| told(e.to_string()))?;
        let manifest: Self = serde_json::from_str(&text).map_err(|e| told(e.to_string()))?;
        let mut known = Vec::new();
        for (name, _, rgb) in UNKNOWNS {
            if rgb {
                known.extend(["r", "g", "b"].map(|channel| format!("{name}_{channel}")));
            } else {
                known.push(name.to_owned());
            }
        }
        if manifest.format != "dawn-diffusion-race-1" || manifest.param_names != known {
            return Err(told("not the race's format dawn-diffusion-race-1".to_owned()));
        }
        Ok(manifest)
    }
}

/// The folder's planes.
pub(crate) struct Data {
    size: usize,
    pixels: usize,
    planes: BTreeMap<&'static str, Vec<f32>>,
}

impl Data {
    pub(crate) fn read(folder: &Path, manifest: &Manifest) -> Result<Self> {
        let (texels, pixels) = (manifest.texels * manifest.texels, manifest.pixels);
        let files = [
            ("ambient", 3 * texels),
            ("key", 3 * texels),
            ("colour", 3 * texels),
            ("stretch", 2 * texels),
            ("chart", texels),
            ("fill", texels),
            ("uv", 2 * pixels),
            ("colour_uv", 3 * pixels),
            ("factor", pixels),
            ("target_clean", 3 * pixels),
            ("target_noisy", 3 * pixels),
        ];
        let mut planes = BTreeMap::new();
        for (name, count) in files {
            let plane: Vec<f32> = parse(&numbers(folder, name)?).collect();
            if plane.len() != count {
                let found = plane.len();
                return Err(format!("{name}.f32 in {} has {found} numbers, not {count}", folder.display()));
            }
            planes.insert(name, plane);
        }
        Ok(Self { size: manifest.texels, pixels, planes })
    }

    /// The charts' texels, of a window alone where there is one.
    pub(crate) fn atlas(&self, window: Option<&Window>) -> Result<Atlas> {
        let texels = self.size * self.size;
        let chart = |texel: usize| {
            let [column, row] = [texel % self.size, texel / self.size];
            let held = window.is_none_or(|window| window.holds(column, row));
            if held { self.planes["chart"][texel] as u32 } else { 0 }
        };
        let charts: Vec<u32> = (0..texels).map(chart).collect();
        let facts = Facts::of_samples(setup()?, FaceSizes::default(), false);
        let inputs = texel_inputs(&facts).map_err(|error| error.to_string())?;
        let value = |input: &Input, texel: usize| {
            let at = |name: &str, component: usize| self.planes[name][component * texels + texel];
            match (input.name.as_str(), input.component) {
                ("albedo", c) => at("colour", c),
                ("given_ambient", c) => at("ambient", c),
                ("given_irradiance", c) => at("key", c),
                ("dpdx_vertex_position", 0) => at("stretch", 0),
                ("dpdy_vertex_position", 1) => at("stretch", 1),
                _ => 0.0,
            }
        };
        let atlas = Atlas::of_charts(self.size as u32, &charts, inputs, value);
        let shown = self.planes["fill"].iter().enumerate().map(|(texel, &of)| (texel as u32, of as u32));
        Ok(atlas.with_shown(shown))
    }

    /// The texel that a pixel lies in.
    pub(crate) fn texel_of(&self, pixel: usize) -> [usize; 2] {
        [0, 1].map(|c| (self.planes["uv"][c * self.pixels + pixel] * self.size as f32) as usize)
    }

    /// Pixels beside the target `target_<which>`, those of a window alone where there is one, along a Z-order curve of the
    /// texels that they lie in.
    pub(crate) fn view(&self, which: &str, window: Option<&Window>) -> Result<ObservedView> {
        let inner = |pixel: &usize| {
            let [column, row] = self.texel_of(*pixel);
            window.is_none_or(|window| window.shows(column, row))
        };
        let mut order: Vec<usize> = (0..self.pixels).filter(inner).collect();
        order.sort_by_cached_key(|&pixel| {
            let [column, row] = self.texel_of(pixel);
            z_order(column as u32, row as u32)
        });
        let (count, groups) = (order.len(), order.len().div_ceil(LANES));
        let asked = Asked { uv: true, albedo: true, silhouette: true, ..Asked::default() };
        let mut surface = SurfaceRecords::new(asked, groups);
        let places = *surface.places();
        let files = [("uv", places.uv, 2), ("colour_uv", places.albedo, 3), ("factor", places.silhouette, 1)];
        for (name, place, planes) in files {
            let Some(place) = place else { continue };
            self.fill(surface.rows_mut(), (place, planes), &order, name);
        }
        let mut target = Rows::new(3, groups);
        self.fill(&mut target, (0, 3), &order, &format!("target_{which}"));
        let weight = |slot: usize| if slot < count { 1.0 } else { 0.0 };
        let weights =
            (0..groups).map(|group| Row::of(std::array::from_fn(|lane| weight(group * LANES + lane))));
        let weight = if count.is_multiple_of(LANES) { Vec::new() } else { weights.collect() };
        let samples = ViewSamples {
            group_start: (0..=groups as u32).collect(),
            surface,
            atlas: Some(Arc::new(self.atlas(window)?)),
            ..ViewSamples::default()
        };
        Ok(ObservedView { samples, target, weight, clip: None })
    }

    /// Planes of numbers into rows, in the pixels' order; the last one's again where a group is not full.
    fn fill(&self, rows: &mut Rows, (place, planes): (usize, usize), order: &[usize], name: &str) {
        let numbers = &self.planes[name];
        for c in 0..planes {
            let padding = order.last().into_iter().cycle();
            for (number, &pixel) in rows.plane_mut(place + c).zip(order.iter().chain(padding)) {
                *number = numbers[c * self.pixels + pixel];
            }
        }
    }
}

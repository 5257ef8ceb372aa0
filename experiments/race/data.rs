//! The race's data folder: manifest.json and raw little-endian float32 planes.

use std::path::Path;

use serde::Deserialize;
use skinfit::bake::{Illumination, LobeStack};
use skinfit::engine::view::ObservedView;
use skinfit::model::cube::Cube;
use skinfit::model::effects::Form;
use skinfit::model::params::{Channels, Column, Param, Params};
use skinfit::samples::rows::{Row, Rows};
use skinfit::samples::surface_records::Asked;
use skinfit::samples::{LANES, SurfaceRecords, ViewSamples, z_order};

/// What the data folder says of itself.
#[derive(Debug, Deserialize)]
pub(crate) struct Manifest {
    pub format: String,
    pub pixels: usize,
    /// Pixels along a row.
    pub side: usize,
    pub param_names: Vec<String>,
    pub params_true: Vec<f64>,
    pub params_init: Vec<f64>,
    pub params_opt_noisy: Vec<f64>,
    pub loss_opt_noisy: f64,
    pub hessian_half_noisy: Vec<Vec<f64>>,
    pub cube_size: usize,
}

/// The race's unknowns, under its names.
const UNKNOWNS: [(&str, Param, Channels); 10] = [
    ("rim_weight_r", Param::RimWeight, Channels::One(0)),
    ("rim_weight_g", Param::RimWeight, Channels::One(1)),
    ("rim_weight_b", Param::RimWeight, Channels::One(2)),
    ("rim_exponent", Param::RimExponent, Channels::Tied),
    ("hilite", Param::Hilite, Channels::Tied),
    ("reflection", Param::Reflection, Channels::Tied),
    ("occlusion", Param::Occlusion, Channels::Tied),
    ("side_spec", Param::SideSpecular, Channels::Tied),
    ("bump", Param::NormalStrength, Channels::Tied),
    ("haze", Param::HazeWeight, Channels::Tied),
];

/// Any failure, told with what was being read.
pub(crate) type Result<T> = std::result::Result<T, String>;

impl Manifest {
    pub(crate) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("manifest.json");
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let manifest: Self = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
        let known = UNKNOWNS.iter().map(|(name, ..)| *name);
        if manifest.format != "dawn-race-1" || !manifest.param_names.iter().map(String::as_str).eq(known) {
            return Err(format!("{}: not the race's format dawn-race-1", path.display()));
        }
        Ok(manifest)
    }

    /// The race's unknowns in its order; `bump` is left out of mode `pre`.
    pub(crate) fn columns(bump_free: bool) -> Vec<Column> {
        UNKNOWNS
            .iter()
            .filter(|(_, param, _)| bump_free || *param != Param::NormalStrength)
            .map(|&(_, param, channels)| Column { param, channels })
            .collect()
    }

    /// The race's parameter vector as the model's.
    pub(crate) fn params(values: &[f64]) -> Params {
        let mut params = Params::defaults(Form::Corrected);
        params.set(Param::BaseWeight, 1.0);
        for ((_, param, channels), &value) in UNKNOWNS.iter().zip(values) {
            Column { param: *param, channels: *channels }.set(&mut params, value);
        }
        params
    }

    /// The model's parameters as the race's vector.
    pub(crate) fn vector(params: &Params) -> Vec<f64> {
        Self::columns(true).iter().map(|column| column.get(params)).collect()
    }
}

pub(crate) fn numbers(folder: &Path, name: &str) -> Result<Vec<u8>> {
    let path = folder.join(format!("{name}.f32"));
    std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))
}

pub(crate) fn parse(bytes: &[u8]) -> impl Iterator<Item = f32> {
    bytes.as_chunks().0.iter().map(|&four| f32::from_le_bytes(four))
}

/// The pixels as they are packed: along a Z-order curve, as those of a scene are.
fn order(manifest: &Manifest) -> Vec<u32> {
    let side = manifest.side.max(1) as u32;
    let mut order: Vec<u32> = (0..manifest.pixels as u32).collect();
    order.sort_unstable_by_key(|&pixel| z_order(pixel % side, pixel / side));
    order
}

/// `count` planes of numbers, in the order of the pixels, into the rows from `place` on; each padded to
/// whole groups by repeating its last number.
fn fill(rows: &mut Rows, place: usize, count: usize, order: &[u32], folder: &Path, name: &str) -> Result<()> {
    let pixels = order.len();
    let bytes = numbers(folder, name)?;
    if bytes.len() != 4 * count * pixels {
        let found = bytes.len() / 4;
        return Err(format!(
            "{name}.f32 in {} has {found} numbers, not {count} x {pixels}",
            folder.display()
        ));
    }
    for (c, plane) in bytes.chunks_exact(4 * pixels).enumerate() {
        let (plane, _) = plane.as_chunks();
        // The last one again and again, where there is one.
        let padding = order.last().into_iter().cycle();
        for (number, &pixel) in rows.plane_mut(place + c).zip(order.iter().chain(padding)) {
            *number = f32::from_le_bytes(plane[pixel as usize]);
        }
    }
    Ok(())
}

/// The samples, one a pixel, beside the target `target_<which>`.
pub(crate) fn view(folder: &Path, manifest: &Manifest, which: &str) -> Result<ObservedView> {
    let n = manifest.pixels;
    let groups = n.div_ceil(LANES);
    let order = order(manifest);
    let asked = Asked {
        bump: true,
        albedo: true,
        occlusion: true,
        specular: true,
        attenuator: true,
        ..Asked::default()
    };
    let mut surface = SurfaceRecords::new(asked, groups);
    let at = *surface.places();
    let files = [
        ("base", at.base, 3),
        ("bump", at.bump, 3),
        ("view", at.view, 3),
        ("occ", at.occlusion, 1),
        ("albedo", at.albedo, 3),
        ("spec", at.specular, 1),
        ("atten", at.attenuator, 1),
    ];
    for (name, place, count) in files {
        if let Some(place) = place {
            fill(surface.rows_mut(), place, count, &order, folder, name)?;
        }
    }
    let mut target = Rows::new(4, groups);
    fill(&mut target, 0, 4, &order, folder, &format!("target_{which}"))?;
    let one = |i: usize| if i < n { 1.0 } else { 0.0 };
    let weight = if n.is_multiple_of(LANES) {
        Vec::new()
    } else {
        (0..groups).map(|group| Row::of(std::array::from_fn(|lane| one(group * LANES + lane)))).collect()
    };
    let samples =
        ViewSamples { group_start: (0..=groups as u32).collect(), surface, ..ViewSamples::default() };
    Ok(ObservedView { samples, target, weight, clip: None })
}

fn cube(folder: &Path, name: &str, size: usize) -> Result<Cube<f32>> {
    let texels: Vec<f32> = parse(&numbers(folder, name)?).collect();
    if texels.len() != 6 * size * size * 4 {
        return Err(format!("{name}.f32 in {} is not a cube of {size} texels a side", folder.display()));
    }
    Ok(Cube::from_fn(size, |face, column, row| {
        let at = ((face * size + row) * size + column) * 4;
        [texels[at], texels[at + 1], texels[at + 2], texels[at + 3]]
    }))
}

/// The three cube maps.
pub(crate) fn illumination(folder: &Path, manifest: &Manifest) -> Result<Illumination> {
    let size = manifest.cube_size;
    Ok(Illumination {
        irradiance: Some(cube(folder, "cube_diffuse", size)?),
        lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![cube(folder, "cube_spec", size)?] }),
        hilite: Some(cube(folder, "cube_hilite", size)?),
        reflected: None,
    })
}

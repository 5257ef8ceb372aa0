//! experiments/unchanged: the lobes that both programs bake, beside the filter by brute force.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::{Value, json};
use skinfit::bake::panorama::Radiance;
use skinfit::bake::prefilter::by_brute_force;
use skinfit::model::cube::{Cube, texel_direction};
use skinfit::prepare::{Loaded, PrepareOptions};

use crate::lab::Result;
use crate::unchanged::{Planes, planes};

/// Of this number of texels one is compared: a prime, so that all columns and rows have their turn.
const EVERY: usize = 211;
/// Texels along the face of the panorama's cube, as both programs filter it.
const SOURCE: usize = 256;
/// Cells along either side of each of its texels: of 0.18 degrees, a seventh of the sharpest lobe's deviation.
const SPLITS: usize = 2;

/// For each program how far the lobes that it baked lie from brute force, as shares of a lobe's mean: the root of the mean
/// square over the texels compared, and the most.
pub(crate) fn beside_brute_force([then, now]: &[PathBuf; 2], scene: &Path) -> Result<Value> {
    let loaded = Loaded::read(scene, &PrepareOptions::default())?;
    let environment = loaded.scene.environment.as_ref().ok_or("the scene has an environment")?;
    let radiance = Radiance::new(environment);
    let source = radiance.to_cube((radiance.width() / 2).next_power_of_two().clamp(16, SOURCE));
    let (mut before, mut after) = (Errors::default(), Errors::default());
    let mut files: Vec<OsString> =
        std::fs::read_dir(then)?.map(|entry| Ok(entry?.file_name())).collect::<Result<_>>()?;
    files.sort();
    for file in files {
        let name = file.to_string_lossy();
        let of_lobe = name.strip_prefix("lobe_").and_then(|name| name.strip_suffix(".exr"));
        let Some(exponent) = of_lobe else { continue };
        let cubes = [planes(&then.join(&file))?, planes(&now.join(&file))?];
        let texels = exact(&source, exponent.parse()?, cubes[0]["R"].len());
        before.add(&cubes[0], &texels);
        after.add(&cubes[1], &texels);
    }
    if before.of == 0 {
        return Err(format!("{}: no lobe was baked", then.display()).into());
    }
    Ok(json!({ "before": before.told(), "now": after.told() }))
}

/// The lobe along each texel that is compared, of a cube of `texels` texels.
fn exact(source: &Cube<f64>, exponent: f64, texels: usize) -> Vec<(usize, [f64; 4])> {
    let size = (texels / 6).isqrt();
    let compared: Vec<usize> = (0..texels).step_by(EVERY).collect();
    let along = |&at: &usize| {
        let direction = texel_direction(at / (size * size), at % size, at / size % size, size);
        (at, by_brute_force(source, direction, exponent, SPLITS))
    };
    compared.par_iter().map(along).collect()
}

/// How far baked texels lie from exact ones.
#[derive(Default)]
struct Errors {
    squares: f64,
    most: f64,
    of: usize,
}

impl Errors {
    fn add(&mut self, baked: &Planes, exact: &[(usize, [f64; 4])]) {
        let planes = ["R", "G", "B"].map(|name| &baked[name]);
        let all = planes.iter().flat_map(|plane| plane.iter());
        let mean = all.map(|&x| f64::from(x)).sum::<f64>() / (3 * planes[0].len()) as f64;
        for (at, exact) in exact {
            for (plane, exact) in planes.iter().zip(exact) {
                let off = (f64::from(plane[*at]) - exact).abs() / mean;
                self.squares += off * off;
                // NaN is further off than all.
                self.most = if off <= self.most { self.most } else { off };
                self.of += 1;
            }
        }
    }

    fn told(&self) -> Value {
        json!({ "rms": (self.squares / self.of as f64).sqrt(), "most": self.most })
    }
}

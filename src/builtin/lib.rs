//! The scene that the program makes by itself: a head in a woodland, as ordinary files.
//!
//! Everything is computed from formulas and an integer hash: no clock, no random source, the same
//! bytes every time and for any number of threads.
//!
//! - `noise`, `sdf`: gradient noise; signed distances and their blends
//! - `head`, `face`, `ear`, `bust`: the anatomy, as one signed distance
//! - `grid`, `surface`: the mesh on it
//! - `charts`, `unwrap`, `atlas`, `texels`, `tangents`: the atlas: seams, charts, packing, texels
//! - `expressions`, `rig`: morph targets; bones, weights and the nod
//! - `landmarks`, `paint`, `relief`: the skin maps
//! - `woodland`: the environment
//! - `glb`, `scene_file`: the files
//!
//! The targets are not written here: the caller renders the views with [`true_params`].

mod atlas;
mod bust;
mod charts;
mod ear;
mod expressions;
mod face;
mod glb;
mod grid;
mod head;
mod landmarks;
mod noise;
mod paint;
mod relief;
mod rig;
mod scene_file;
mod sdf;
mod surface;
mod tangents;
mod texels;
mod unwrap;
mod woodland;

use std::io::Cursor;
use std::path::Path;
use std::sync::LazyLock;

use exr::prelude::WritableImage;
use glam::DVec3;
use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;

use skinfit_base::output::{self, OutputError};
use skinfit_base::progress;
use skinfit_rules::model;
use skinfit_scene as scene;

use atlas::Atlas;
use head::Head;
use surface::Surface;
use texels::Texels;

pub use scene_file::{true_params, truth};

/// Texels along a side of the skin maps.
const MAP_SIZE: usize = 1024;
/// The value of texels that no chart reaches: mid grey, and for normals straight up.
const FLAT: [f64; 3] = [0.5, 0.5, 1.0];

/// The built-in scene could not be written.
#[derive(Debug, thiserror::Error)]
pub enum BuiltinError {
    /// A file could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// An image could not be encoded.
    #[error(
        "{file}: the built-in scene's image cannot be encoded: {reason}. This is a fault of the program, not of its input; please report it."
    )]
    Encode {
        /// Which file.
        file: &'static str,
        /// What the encoder said.
        reason: String,
    },
}

/// A name for what [`write()`] writes, for caches: a hash of the sources that make it.
#[must_use]
pub fn version() -> &'static str {
    static VERSION: LazyLock<String> = LazyLock::new(|| {
        let mut hasher = blake3::Hasher::new();
        for source in SOURCES {
            hasher.update(source.as_bytes());
        }
        format!("builtin-{}", &hasher.finalize().to_hex()[..16])
    });
    &VERSION
}

/// Every file that has a part in the scene.
const SOURCES: [&str; 22] = [
    include_str!("atlas.rs"),
    include_str!("bust.rs"),
    include_str!("charts.rs"),
    include_str!("ear.rs"),
    include_str!("expressions.rs"),
    include_str!("face.rs"),
    include_str!("glb.rs"),
    include_str!("grid.rs"),
    include_str!("head.rs"),
    include_str!("landmarks.rs"),
    include_str!("lib.rs"),
    include_str!("noise.rs"),
    include_str!("paint.rs"),
    include_str!("relief.rs"),
    include_str!("rig.rs"),
    include_str!("scene_file.rs"),
    include_str!("sdf.rs"),
    include_str!("surface.rs"),
    include_str!("tangents.rs"),
    include_str!("texels.rs"),
    include_str!("unwrap.rs"),
    include_str!("woodland.rs"),
];

/// Write the scene's files into `folder`, which is made when it is missing: `scene.toml`,
/// `head.glb`, `color.png`, `normal.png`, `specular.png`, `attenuator.png`, `environment.exr`.
///
/// The scene file names targets, `targets/<view>.exr`, that the caller renders.
///
/// # Errors
/// When a file cannot be written.
pub fn write(folder: &Path) -> Result<(), BuiltinError> {
    let bar = progress::bar("built-in", 4 + 3 * MAP_SIZE as u64);
    let head = Head::new();
    bar.set_message("mesh");
    let surface = Surface::extract(&head);
    bar.inc(1);
    bar.set_message("atlas");
    let mut atlas = Atlas::new(&head, &surface);
    atlas.tangents = tangents::tangents(&atlas);
    bar.inc(1);
    output::write(&folder.join("head.glb"), &glb::encode(&atlas))?;
    bar.inc(1);
    bar.set_message("maps");
    for (file, bytes) in maps(&head, &atlas, || bar.inc(1))? {
        output::write(&folder.join(file), &bytes)?;
    }
    bar.set_message("environment");
    output::write(&folder.join("environment.exr"), &environment()?)?;
    bar.inc(1);
    output::write(&folder.join("scene.toml"), scene_file::text().as_bytes())?;
    bar.finish_and_clear();
    Ok(())
}

/// The four skin maps as PNG files; `done` is called three times a row.
fn maps(
    head: &Head,
    atlas: &Atlas,
    done: impl Fn() + Sync,
) -> Result<Vec<(&'static str, Vec<u8>)>, BuiltinError> {
    let texels = Texels::new(atlas, MAP_SIZE);
    let painter = paint::Painter::new(head);
    // Thickness varies slowly: once a vertex is enough.
    let translucency: Vec<f64> = (0..atlas.positions.len())
        .into_par_iter()
        .map(|i| painter.translucency(atlas.positions[i], atlas.normals[i]))
        .collect();
    let color = texels.map(atlas, [0.5; 3], |place| painter.color(place.position), &done);
    let normal = texels.map(atlas, FLAT, |place| relief::normal(head, atlas, place), &done);
    let scalars = texels.map(
        atlas,
        [0.5; 2],
        |place| {
            let corners = DVec3::from(atlas.triangles[place.triangle].map(|v| translucency[v as usize]));
            [painter.specular(place.position), corners.dot(place.weights)]
        },
        &done,
    );
    let channel = |c: usize| scalars.iter().map(|s| [s[c]]).collect::<Vec<_>>();
    Ok(vec![
        ("color.png", png("color.png", &color)?),
        ("normal.png", png("normal.png", &normal)?),
        ("specular.png", png("specular.png", &channel(0))?),
        ("attenuator.png", png("attenuator.png", &channel(1))?),
    ])
}

/// An 8-bit PNG of one or three channels in [0, 1].
fn png<const C: usize>(file: &'static str, texels: &[[f64; C]]) -> Result<Vec<u8>, BuiltinError> {
    let bytes: Vec<u8> = texels.iter().flatten().map(|x| (x * 255.0).round() as u8).collect();
    let kind = if C == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(&bytes, MAP_SIZE as u32, MAP_SIZE as u32, kind)
        .map_err(|e| BuiltinError::Encode { file, reason: e.to_string() })?;
    Ok(out)
}

/// The environment as a half-float EXR file.
fn environment() -> Result<Vec<u8>, BuiltinError> {
    let texels = woodland::panorama();
    let pixel = |at: exr::math::Vec2<usize>| {
        let [r, g, b] = texels[at.y() * woodland::WIDTH + at.x()].map(exr::prelude::f16::from_f32);
        (r, g, b)
    };
    let size = (woodland::WIDTH, woodland::WIDTH / 2);
    let layer = exr::prelude::Layer::new(
        size,
        exr::prelude::LayerAttributes::default(),
        exr::prelude::Encoding::SMALL_LOSSLESS,
        exr::prelude::SpecificChannels::rgb(pixel),
    );
    let mut out = Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(layer)
        .write()
        .to_buffered(&mut out)
        .map_err(|e| BuiltinError::Encode { file: "environment.exr", reason: e.to_string() })?;
    Ok(out.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn version_counts_every_source_file() {
        let files = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).unwrap().map(|entry| entry.unwrap().path());
        assert_eq!(files.filter(|path| path.extension().is_some_and(|e| e == "rs")).count(), SOURCES.len());
        assert_eq!(version(), version());
    }
}

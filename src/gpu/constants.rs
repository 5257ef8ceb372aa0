//! The uniform block: parameters, camera, lights and morph weights, each member a `vec4f` or several.

use glam::{DMat4, DVec4};

use super::targets::Tile;
use crate::model::params::Params;
use crate::scene::view::Camera;
use crate::shader::Constant;
use skinfit_core::program::shading::numbers;

/// Where the near plane lies. Depth is near / distance in floating point, which resolves it equally well at
/// any distance: the plane may be as near as this whatever a scene's unit.
const NEAR: f64 = 1e-6;

/// What the constants are taken from.
pub(super) struct Values<'a> {
    pub(super) params: &'a Params,
    pub(super) camera: &'a Camera,
    pub(super) tile: Tile,
    /// Of the active targets.
    pub(super) morph_weights: &'a [f32],
}

/// The block of `constants`, in their order.
pub(super) fn block(constants: &[Constant], values: &Values<'_>) -> Vec<f32> {
    let mut block = Vec::new();
    for &constant in constants {
        match constant {
            Constant::Eye => push(&mut block, &values.camera.eye().to_array()),
            Constant::ViewProjection => {
                let matrix = view_projection(values.camera, values.tile).to_cols_array();
                matrix.chunks(4).for_each(|column| push(&mut block, column));
            }
            Constant::MorphWeights => {
                values.morph_weights.iter().for_each(|&weight| push(&mut block, &[f64::from(weight)]));
            }
            of_model => push(&mut block, &of_params(of_model, values.params)),
        }
    }
    block
}

/// The block of a plan that places the mesh and does nothing else, by another matrix than a camera's.
pub(super) fn outline_block(constants: &[Constant], to_clip: &DMat4, morph_weights: &[f32]) -> Vec<f32> {
    let mut block = Vec::new();
    for &constant in constants {
        match constant {
            Constant::ViewProjection => {
                to_clip.to_cols_array().chunks(4).for_each(|column| push(&mut block, column));
            }
            Constant::MorphWeights => {
                morph_weights.iter().for_each(|&weight| push(&mut block, &[f64::from(weight)]));
            }
            _ => push(&mut block, &[]),
        }
    }
    block
}

/// The block of constants that the parameters alone give, as those of stored samples are.
pub(crate) fn model_block(constants: &[Constant], params: &Params) -> Vec<f32> {
    let mut block = Vec::new();
    constants.iter().for_each(|&constant| push(&mut block, &of_params(constant, params)));
    block
}

/// A constant that the parameters give; a camera's or a mesh's is 0.
fn of_params(constant: Constant, params: &Params) -> [f64; 3] {
    numbers(constant, params).unwrap_or_default()
}

/// The block's bytes, with that many morph weights.
pub(super) fn block_bytes(constants: &[Constant], morphs: u32) -> usize {
    let bytes = |constant: &Constant| match constant {
        Constant::ViewProjection => 64,
        Constant::MorphWeights => 16 * morphs as usize,
        _ => 16,
    };
    constants.iter().map(bytes).sum()
}

/// Append up to four numbers as one `vec4f`.
fn push(block: &mut Vec<f32>, numbers: &[f64]) {
    block.extend((0..4).map(|i| numbers.get(i).map_or(0.0, |&x| x as f32)));
}

/// World to the clip space of a tile: x and y in [-1, 1] over its pixels, z = near, w = distance along the
/// axis (depth runs from 1 at the near plane to 0 at infinity).
fn view_projection(camera: &Camera, tile: Tile) -> DMat4 {
    let tangent = (0.5 * camera.fov_y).tan();
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    // From the whole image's range to the tile's.
    let scale = [width / f64::from(tile.width), height / f64::from(tile.height)];
    // What bends rays is refused before: `Lens::distortion`.
    let [cx, cy] = camera.lens.centre;
    let shift = [
        scale[0] - 2.0 * (f64::from(tile.x) - cx) / f64::from(tile.width) - 1.0,
        1.0 - scale[1] + 2.0 * (f64::from(tile.y) - cy) / f64::from(tile.height),
    ];
    let projection = DMat4::from_cols(
        DVec4::new(scale[0] * height * camera.lens.ratio / (width * tangent), 0.0, 0.0, 0.0),
        DVec4::new(0.0, scale[1] / tangent, 0.0, 0.0),
        DVec4::new(-shift[0], -shift[1], 0.0, -1.0),
        DVec4::new(0.0, 0.0, NEAR, 0.0),
    );
    projection * camera.world_to_camera
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::lens::Lens;
    use glam::DVec3;

    #[test]
    fn clip_space_agrees_with_the_cameras_projection_in_every_tile() {
        let world_to_camera =
            DMat4::from_rotation_y(0.3) * DMat4::from_translation(DVec3::new(0.1, -0.2, -3.0));
        let lens = Lens { centre: [7.5, -4.0], ratio: 1.1, distortion: None };
        let camera = Camera { world_to_camera, fov_y: 0.7, width: 90, height: 64, lens };
        for tile in [Tile { x: 0, y: 0, width: 90, height: 64 }, Tile { x: 30, y: 48, width: 20, height: 16 }]
        {
            let matrix = view_projection(&camera, tile);
            for point in [DVec3::ZERO, DVec3::new(0.4, -0.3, 0.9)] {
                let (x, y, depth) = camera.project(point);
                let clip = matrix * point.extend(1.0);
                let px = f64::from(tile.x) + 0.5 * (clip.x / clip.w + 1.0) * f64::from(tile.width);
                let py = f64::from(tile.y) + 0.5 * (1.0 - clip.y / clip.w) * f64::from(tile.height);
                // A few roundings of f64 of numbers up to 100.
                assert!((px - x).abs() < 1e-12 && (py - y).abs() < 1e-12, "{px} {x} {py} {y}");
                assert!((clip.z / clip.w - NEAR / depth).abs() < 1e-18);
            }
        }
    }
}

//! Gloss on skin below parts that are not skin: what stands in a specular lobe's way takes its light, as it takes a lamp's.

use std::f64::consts::FRAC_PI_4;

use glam::{DMat4, DVec3};
use skinfit::render::image::Image;
use skinfit::scene::view::Camera;

use super::cutouts::{Alpha, at, card, halves, picture};
use super::{SCENE, edited};
use crate::graphics::bench::on_cpu;

/// Pixels a side.
const SIDE: usize = 48;

/// What shows of gloss alone on skin below the card, half a unit above it and half as wide, under a sky of 1. From the left, at
/// 45 degrees: the skin's left half is seen past the card, and mirrors it between [`LEFT`] and [`RIGHT`].
fn shown(visibility: &str, mode: &str, alpha: Alpha) -> Image {
    let model = format!(
        "effects = [\"fresnel\"]\nspecular_visibility = \"{visibility}\"\n[model.params]\nroughness = 0.05"
    );
    let scene = SCENE
        .replace("effects = [\"diffuse\"]", &model)
        .replace("eye = [0, 0, 4]", "eye = [-4, 0, 4]")
        .replace("width = 16", &format!("width = {SIDE}"))
        .replace("height = 16", &format!("height = {SIDE}"));
    let folder = edited(&card(mode), &(scene + "lobe_rays = 512\n"), |_, _| {});
    folder.write("picture.png", &picture(alpha));
    on_cpu(&at(&folder, None), 2)
}

/// From here a mirror shows the middle of the card's left half, by way of (4 + x) / 4 to the right for 1 up.
const LEFT: [f64; 2] = [-2.0 / 3.0, 0.0];
/// And from here of its right half.
const RIGHT: [f64; 2] = [-2.0 / 9.0, 0.0];
/// From here the sky beside it.
const OPEN: [f64; 2] = [-0.45, 0.8];

/// The sum over the nine pixels about the one that shows a place of the skin.
fn about(image: &Image, [x, y]: [f64; 2]) -> f32 {
    let world_to_camera =
        DMat4::from_rotation_y(FRAC_PI_4) * DMat4::from_translation(DVec3::new(4.0, 0.0, -4.0));
    let camera = Camera::pinhole(world_to_camera, 30_f64.to_radians(), [SIDE as u32; 2]);
    let (column, row, _) = camera.project(DVec3::new(x, y, 0.0));
    let (column, row) = (column as usize, row as usize);
    let pixels = (row - 1..=row + 1).flat_map(|row| (column - 1..=column + 1).map(move |x| SIDE * row + x));
    pixels.map(|pixel| image.rgb[pixel][0]).sum()
}

#[test]
fn gloss_on_skin_is_shadowed_by_what_is_not_skin() {
    let clear: Alpha = |_, _| 0;
    let open = shown("none", "OPAQUE", clear);
    assert!(about(&open, LEFT) > 0.1, "{}", about(&open, LEFT));
    // 128 of 255 leaves 0.498 of the light.
    let cases: [(&str, Alpha, [f32; 2]); 5] = [
        ("OPAQUE", clear, [0.0, 0.0]),
        ("MASK", clear, [1.0, 1.0]),
        ("MASK", halves, [0.0, 1.0]),
        ("MASK", |x, y| 255 - halves(x, y), [1.0, 0.0]),
        ("BLEND", |_, _| 128, [0.498, 0.498]),
    ];
    for visibility in ["lobe", "rays"] {
        for (mode, alpha, want) in cases {
            let image = shown(visibility, mode, alpha);
            for (place, want) in [LEFT, RIGHT].into_iter().zip(want) {
                let found = about(&image, place) / about(&open, place);
                // The nearest edge lies 12 degrees from the mirrored view, where half vectors lean by 6: of Beckmann's
                // distribution exp(-(tan 6 degrees / 0.05)^2) = 1.2% do, and more of the pixels beside. What blends tosses
                // 9 x 4 x 512 coins, whose mean is off by four standard deviations of 0.4%.
                assert!(
                    (found - want).abs() < 0.03,
                    "{visibility}, {mode}, {place:?}: {found} is not {want}"
                );
            }
            let beside = about(&image, OPEN) / about(&open, OPEN);
            // Weighted means of one number: roundings.
            assert!((beside - 1.0).abs() < 1e-4, "{visibility}, {mode}: {beside}");
        }
    }
}

//! The lens of a view, as its table has it.

use toml::Spanned;

use crate::error::SceneError;
use crate::file::{LensTable, Source, ViewTable};
use crate::lens::{Distortion, Lens};
use crate::numbers::{number, short};
use crate::view::Camera;

/// Focal lengths across and down that differ by more are of no camera.
pub(crate) const MOST_RATIO: f64 = 10.0;
/// No lens of a camera has coefficients as large.
pub(crate) const LARGEST_COEFFICIENT: f64 = 1e3;
/// Between places of the image, along a side, where a lens is tried.
const STEPS: u32 = 64;

/// The camera with the lens of its table, of which every place of the image is lit.
pub(super) fn with_lens(source: &Source, table: &ViewTable, camera: Camera) -> Result<Camera, SceneError> {
    let Some(spanned) = &table.lens else { return Ok(camera) };
    let lens = spanned.get_ref();
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let focal = 0.5 * height / (0.5 * camera.fov_y).tan();
    let within = |value: &Option<Spanned<f64>>, default: f64, name: &str, [least, most]: [f64; 2]| {
        let wanted = format!("a number in [{}, {}]", short(least), short(most));
        number(source, value.as_ref(), default, name, &wanted, |x| (least..=most).contains(&x))
    };
    // A shifted lens may have its axis beside the image.
    let cx = within(&lens.cx, 0.5 * width, "cx", [-2.0 * width, 3.0 * width])?;
    let cy = within(&lens.cy, 0.5 * height, "cy", [-2.0 * height, 3.0 * height])?;
    let fx = within(&lens.fx, focal, "fx", [focal / MOST_RATIO, focal * MOST_RATIO])?;
    let centre = [cx - 0.5 * width, cy - 0.5 * height];
    let camera =
        Camera { lens: Lens { centre, ratio: fx / focal, distortion: distortion(source, lens)? }, ..camera };
    if let Some((x, y)) = first_unlit(&camera) {
        let what =
            format!("the lens folds its image over, or sees 89 degrees from its axis, at pixel ({x}, {y})");
        return Err(source.error(
            spanned,
            what,
            "Check the coefficients, fov_y_degrees and the image's size, or crop it",
        ));
    }
    Ok(camera)
}

/// Refuse a distortion that is none.
pub(super) fn check_coefficients(source: &Source, table: &ViewTable) -> Result<(), SceneError> {
    table.lens.as_ref().map_or(Ok(()), |lens| distortion(source, lens.get_ref()).map(drop))
}

fn distortion(source: &Source, lens: &LensTable) -> Result<Option<Distortion>, SceneError> {
    let fisheye = match &lens.model {
        None => false,
        Some(name) => source.choose("lens model", name, &[("brown", false), ("fisheye", true)])?,
    };
    let named = [
        ("k1", &lens.k1),
        ("k2", &lens.k2),
        ("k3", &lens.k3),
        ("k4", &lens.k4),
        ("p1", &lens.p1),
        ("p2", &lens.p2),
    ];
    let foreign: &[&str] = if fisheye { &["p1", "p2"] } else { &["k4"] };
    let mut numbers = [0.0; 6];
    for (place, (name, value)) in named.into_iter().enumerate() {
        let wanted = format!("a coefficient, at most {} in size", short(LARGEST_COEFFICIENT));
        numbers[place] =
            number(source, value.as_ref(), 0.0, name, &wanted, |x| x.abs() <= LARGEST_COEFFICIENT)?;
        if let Some(value) = value.as_ref().filter(|_| foreign.contains(&name)) {
            let (model, other) = if fisheye { ("fisheye", "brown") } else { ("brown", "fisheye") };
            let what = format!("the lens model `{model}` has no {name}");
            return Err(source.error(value, what, format!("Leave it out, or give model = \"{other}\"")));
        }
    }
    let [k1, k2, k3, k4, p1, p2] = numbers;
    Ok(match fisheye {
        true => Some(Distortion::Fisheye { k: [k1, k2, k3, k4] }),
        // Without coefficients it is a pinhole, which everything can show.
        false if numbers == [0.0; 6] => None,
        false => Some(Distortion::Brown { k: [k1, k2, k3], p: [p1, p2] }),
    })
}

/// A place of the image, in whole pixels, that no light meets: tried on a grid that has the borders.
pub(crate) fn first_unlit(camera: &Camera) -> Option<(u32, u32)> {
    let at = |step: u32, pixels: u32| f64::from(step) / f64::from(STEPS) * f64::from(pixels);
    let places = (0..=STEPS).flat_map(|j| (0..=STEPS).map(move |i| (i, j)));
    let mut unlit = places.map(|(i, j)| (at(i, camera.width), at(j, camera.height)));
    unlit.find(|&(x, y)| camera.image_plane(x, y).is_err()).map(|(x, y)| (x as u32, y as u32))
}

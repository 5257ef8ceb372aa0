//! Maps as images: texels as they lie, vertices unwrapped by their texture coordinates, the faces of a cube side by
//! side.

use glam::Vec2;

use super::layer::Grid;
use crate::render::image::Image;
use crate::scene::mesh::PosedMesh;

/// Texels along a side of the picture of a map that is one number a vertex.
const UNWRAPPED: usize = 512;

/// The picture of a map's numbers, `channels` a texel; what no texel reaches is transparent.
#[must_use]
pub fn picture(grid: Grid, numbers: &[f32], channels: usize, mesh: &PosedMesh) -> Image {
    let colour = |texel: usize| {
        let number = |c: usize| numbers[texel * channels + c.min(channels - 1)];
        if channels == 1 { [number(0); 3] } else { [number(0), number(1), number(2)] }
    };
    match grid {
        Grid::Texels { width, height } => {
            let texels = width * height;
            Image { width, height, rgb: (0..texels).map(colour).collect(), alpha: vec![1.0; texels] }
        }
        Grid::Cube(size) => {
            let (width, height) = (6 * size, size);
            let texel = |i: usize| (i % width / size * size + i / width) * size + i % size;
            let texels = width * height;
            Image {
                width,
                height,
                rgb: (0..texels).map(|i| colour(texel(i))).collect(),
                alpha: vec![1.0; texels],
            }
        }
        Grid::Vertices(_) => unwrapped(numbers, mesh),
    }
}

/// One number a vertex, interpolated over the triangles in the plane of their texture coordinates.
fn unwrapped(numbers: &[f32], mesh: &PosedMesh) -> Image {
    let mut image = Image::new(UNWRAPPED, UNWRAPPED);
    if mesh.uvs.is_empty() {
        return image;
    }
    let size = UNWRAPPED as f32;
    for triangle in mesh.skin_triangles().iter() {
        let [a, b, c] = triangle.map(|i| mesh.uvs[i as usize] * size - 0.5);
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        let low = a.min(b).min(c).ceil().max(Vec2::ZERO);
        let high = a.max(b).max(c).floor().min(Vec2::splat(size - 1.0));
        for y in low.y as usize..=high.y.max(-1.0) as usize {
            for x in low.x as usize..=high.x.max(-1.0) as usize {
                let p = Vec2::new(x as f32, y as f32);
                let weights = [(c - b).perp_dot(p - b), (a - c).perp_dot(p - c), (b - a).perp_dot(p - a)];
                let weights = weights.map(|w| w / area);
                if weights.iter().all(|&w| w >= 0.0) {
                    let value: f32 =
                        weights.iter().zip(triangle).map(|(w, &i)| w * numbers[i as usize]).sum();
                    image.rgb[y * UNWRAPPED + x] = [value; 3];
                    image.alpha[y * UNWRAPPED + x] = 1.0;
                }
            }
        }
    }
    image
}

/// The largest change of a colour, or of a map's only number, over all texels.
#[must_use]
pub fn largest_change(before: &[f32], after: &[f32], channels: usize) -> f32 {
    // Of a cube's four numbers, pictures show three.
    let shown = before.iter().zip(after).enumerate().filter(|(i, _)| i % channels < 3);
    shown.fold(0.0, |most, (_, (b, a))| most.max((a - b).abs()))
}

/// A map's change: positive where it grew.
#[must_use]
pub fn change(before: &Image, after: &Image) -> Image {
    let differences = before.rgb.iter().zip(&after.rgb).map(|(b, a)| [0, 1, 2].map(|c| a[c] - b[c]));
    Image { rgb: differences.collect(), ..after.clone() }
}

/// A change as something to look at: mid grey where there is none, brighter where the map grew, black or white at the
/// `largest`.
#[must_use]
pub fn change_to_see(change: &Image, largest: f32) -> Image {
    let scale = if largest > 0.0 { 0.5 / largest } else { 0.0 };
    let rgb = change.rgb.iter().map(|d| d.map(|d| 0.5 + scale * d)).collect();
    Image { rgb, ..change.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_grew_is_positive_and_bright() {
        let grid = Grid::Texels { width: 3, height: 1 };
        let mesh = PosedMesh::default();
        let (before, after) = ([0.5, 0.5, 0.5], [0.7, 0.4, 0.5]);
        let change = change(&picture(grid, &before, 1, &mesh), &picture(grid, &after, 1, &mesh));
        let near = |found: [f32; 3], wanted: f32| found.iter().all(|x| (x - wanted).abs() < 1e-6);
        assert!(near(change.rgb[0], 0.2) && near(change.rgb[1], -0.1) && near(change.rgb[2], 0.0));
        let largest = largest_change(&before, &after, 1);
        assert!((largest - 0.2).abs() < 1e-6);
        let seen = change_to_see(&change, largest);
        assert!(near(seen.rgb[0], 1.0) && near(seen.rgb[1], 0.25) && near(seen.rgb[2], 0.5));
    }

    #[test]
    fn the_fourth_number_of_a_cube_is_no_change_of_its_colour() {
        assert!(
            (largest_change(&[0.0; 8], &[0.1, 0.0, 0.0, 5.0, 0.0, -0.3, 0.0, 7.0], 4) - 0.3).abs() < 1e-6
        );
    }
}

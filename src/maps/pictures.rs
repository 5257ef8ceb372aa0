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
    for triangle in &mesh.triangles {
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

/// A map's change, as something to look at: mid grey where there is none, brighter where it grew; the largest change
/// reaches black or white. With the change that this stands for.
#[must_use]
pub fn change(before: &Image, after: &Image) -> (Image, f32) {
    let differences = || before.rgb.iter().zip(&after.rgb).map(|(b, a)| [0, 1, 2].map(|c| a[c] - b[c]));
    let largest = differences().flatten().fold(0.0_f32, |most, d| most.max(d.abs()));
    let scale = if largest > 0.0 { 0.5 / largest } else { 0.0 };
    let rgb = differences().map(|d| d.map(|d| 0.5 + scale * d)).collect();
    (Image { rgb, ..after.clone() }, largest)
}

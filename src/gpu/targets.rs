//! What is drawn into. An image whose samples are too many for one texture is drawn in tiles.

use wgpu::{
    Extent3d, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
    TextureViewDescriptor,
};

use super::device::Gpu;
use super::error::{GpuError, Oversized};
use crate::render::antialias::Antialias;

/// The most samples of a tile: 256 MiB of 32-bit RGBA.
const MOST_SAMPLES: u64 = 1 << 24;

/// Depth's format; see `constants` for what it holds.
pub(super) const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// The format of a visibility buffer: each sample's triangle.
pub(super) const TRIANGLES: TextureFormat = TextureFormat::R32Uint;

/// A rectangle of an image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) width: u32,
    pub(super) height: u32,
}

/// How numbers are held in the targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Precision {
    /// 32-bit floating point.
    Full,
    /// 16-bit floating point, up to 65504.
    Half,
}

impl Precision {
    pub(super) const fn color(self) -> TextureFormat {
        match self {
            Self::Full => TextureFormat::Rgba32Float,
            Self::Half => TextureFormat::Rgba16Float,
        }
    }

    /// The name of colour's format in WGSL.
    pub(super) const fn wgsl(self) -> &'static str {
        match self {
            Self::Full => "rgba32float",
            Self::Half => "rgba16float",
        }
    }

    /// The largest number.
    pub(super) const fn largest(self) -> f32 {
        match self {
            Self::Full => f32::MAX,
            Self::Half => 65504.0,
        }
    }
}

/// What an image of one size, precision and antialiasing is drawn into.
pub(super) struct Targets {
    pub(super) key: Key,
    /// The image's parts, each drawn by itself.
    pub(super) tiles: Vec<Tile>,
    /// Colour (and coverage) of a tile's samples; absent where samples are pixels and there is one tile.
    pub(super) samples: Option<Planes>,
    /// The multisampled targets, which are resolved into `samples` or `pixels`.
    pub(super) multisampled: Option<Planes>,
    pub(super) depth: TextureView,
    /// Which triangle each sample shows, where a compute shader shades them.
    pub(super) triangles: Option<TextureView>,
    /// Colour (and coverage) of the image's pixels.
    pub(super) pixels: Planes,
    /// The mean over each pixel's samples of radiance times haze; absent where a pixel is one sample.
    pub(super) glow: Option<TextureView>,
}

/// What targets are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Key {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) antialias: Antialias,
    pub(super) precision: Precision,
    /// Whether alpha is the haze, and coverage stands in a plane of its own.
    pub(super) hazy: bool,
    /// Whether the image blooms.
    pub(super) blooms: bool,
    /// Whether a compute shader shades.
    pub(super) computed: bool,
}

/// Colour, and coverage where colour's alpha holds something else.
pub(super) struct Planes {
    pub(super) color: TextureView,
    pub(super) coverage: Option<TextureView>,
}

impl Planes {
    /// The views, colour first.
    pub(super) fn views(&self) -> impl Iterator<Item = &TextureView> {
        std::iter::once(&self.color).chain(&self.coverage)
    }
}

impl Key {
    /// The formats of the planes, colour first.
    pub(super) fn formats(&self) -> Vec<TextureFormat> {
        std::iter::once(self.precision.color()).chain(self.coverage()).collect()
    }

    /// The format of coverage, where it has a plane of its own. Compute shaders write no single 16 bits.
    fn coverage(&self) -> Option<TextureFormat> {
        let full = self.computed || self.precision == Precision::Full;
        self.hazy.then_some(if full { TextureFormat::R32Float } else { TextureFormat::R16Float })
    }

    /// Whether samples have to be averaged, or carried from a tile, to pixels.
    fn resolves(&self, tiles: usize) -> bool {
        self.antialias.grid() > 1 || tiles > 1
    }
}

impl Targets {
    /// The targets of `key`.
    pub(super) fn new(gpu: &Gpu, key: Key) -> Result<Self, GpuError> {
        let limit = gpu.max_side();
        if key.width.max(key.height) > limit {
            return Err(GpuError::TextureSize {
                adapter: gpu.name().to_owned(),
                what: "image".to_owned(),
                width: key.width as usize,
                height: key.height as usize,
                limit,
                of: Oversized::Image,
            });
        }
        let n = key.antialias.grid();
        let tiles = tiles(key.width, key.height, tile_sides(key.width, key.height, n, limit, MOST_SAMPLES));
        let (width, height) = (n * tiles[0].width, n * tiles[0].height);
        let planes = |width, height, multisamples| planes(gpu, &key, width, height, multisamples);
        let multisamples = key.antialias.multisamples();
        let glow = || texture(gpu, "glow", key.width, key.height, key.precision.color(), 1);
        let targets = Self {
            glow: (key.blooms && n > 1).then(glow),
            samples: key.resolves(tiles.len()).then(|| planes(width, height, 1)),
            multisampled: (multisamples > 1).then(|| planes(width, height, multisamples)),
            depth: texture(gpu, "depth", width, height, DEPTH, multisamples),
            triangles: key.computed.then(|| texture(gpu, "triangles", width, height, TRIANGLES, 1)),
            pixels: planes(key.width, key.height, 1),
            tiles,
            key,
        };
        gpu.check()?;
        Ok(targets)
    }
}

/// A tile's sides in pixels, of n x n samples each: no longer than `limit` samples, and `most` in all.
pub(super) fn tile_sides(width: u32, height: u32, n: u32, limit: u32, most: u64) -> [u32; 2] {
    let mut sides = [width.min(limit / n).max(1), height.min(limit / n).max(1)];
    while u64::from(sides[0] * n) * u64::from(sides[1] * n) > most {
        let longer = usize::from(sides[1] > sides[0]);
        sides[longer] = sides[longer].div_ceil(2);
    }
    sides
}

/// Tiles of those sides; those at the right and lower border are narrower.
pub(super) fn tiles(width: u32, height: u32, [across, down]: [u32; 2]) -> Vec<Tile> {
    let rows = (0..height).step_by(down as usize);
    rows.flat_map(|y| {
        let columns = (0..width).step_by(across as usize);
        columns.map(move |x| Tile { x, y, width: across.min(width - x), height: down.min(height - y) })
    })
    .collect()
}

fn planes(gpu: &Gpu, key: &Key, width: u32, height: u32, multisamples: u32) -> Planes {
    let extra = if key.computed { TextureUsages::STORAGE_BINDING } else { TextureUsages::empty() };
    let plane = |label, format| texture_for(gpu, label, [width, height], format, multisamples, extra);
    Planes {
        color: plane("color", key.precision.color()),
        coverage: key.coverage().map(|format| plane("coverage", format)),
    }
}

/// A texture to draw into, and to read and write where it has one sample a texel.
pub(super) fn texture(
    gpu: &Gpu,
    label: &str,
    width: u32,
    height: u32,
    format: TextureFormat,
    multisamples: u32,
) -> TextureView {
    texture_for(gpu, label, [width, height], format, multisamples, TextureUsages::empty())
}

/// As [`texture`], for `usage` beside.
pub(super) fn texture_for(
    gpu: &Gpu,
    label: &str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    multisamples: u32,
    usage: TextureUsages,
) -> TextureView {
    let read = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC | TextureUsages::COPY_DST;
    let extra = if multisamples == 1 && format != DEPTH { read } else { TextureUsages::empty() };
    let texture = gpu.device.create_texture(&TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: multisamples,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | extra | usage,
        view_formats: &[],
    });
    texture.create_view(&TextureViewDescriptor::default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once_within_the_limits() {
        for (width, height, n, limit) in
            [(7, 5, 2, 6), (300, 10, 8, 64), (9000, 9000, 1, 16384), (1, 1, 8, 8)]
        {
            let sides = tile_sides(width, height, n, limit, MOST_SAMPLES);
            assert!(sides.into_iter().all(|side| side * n <= limit));
            assert!(u64::from(sides[0] * n) * u64::from(sides[1] * n) <= MOST_SAMPLES);
            let mut seen = vec![0_u8; (width * height) as usize];
            for tile in tiles(width, height, sides) {
                assert!(tile.width <= sides[0] && tile.height <= sides[1]);
                for y in tile.y..tile.y + tile.height {
                    (tile.x..tile.x + tile.width).for_each(|x| seen[(y * width + x) as usize] += 1);
                }
            }
            assert!(seen.into_iter().all(|times| times == 1), "{width} x {height}");
        }
    }
}

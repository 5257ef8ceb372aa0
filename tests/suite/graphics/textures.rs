//! Texture maps filtered over what a sample covers: the CPU's samples beside many of them a pixel, and the renderer, exact
//! and by the adapter's samplers, beside the CPU's.

use skinfit::engine::gpu::DeviceSamples;
use skinfit::gpu::{Gpu, RenderOptions};
use skinfit::model::texture_filter::TextureFilter;
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::antialias::Antialias;
use skinfit::samples::{LANES, ViewSamples};
use skinfit::scene::maps::{Map, Maps};
use skinfit::shader::Budget;

use super::bench::*;
use crate::scene_folder::{SCENE, SceneFolder};

/// Texels along a side of the maps. A pixel of the quad that is seen from straight ahead covers 17 of them.
const TEXELS: usize = 1024;
const FILTERED: [TextureFilter; 2] = [TextureFilter::Trilinear, TextureFilter::Anisotropic];

/// A quad in even light, seen from above at an angle to its normal (radians), `size` pixels a side.
fn quad(angle: f64, size: u32, texel: impl Fn(usize, usize) -> f32) -> Baked {
    let folder = SceneFolder::new();
    let (sin, cos) = angle.sin_cos();
    let camera = format!("[1,0,0,0, 0,{cos},{},0, 0,{sin},{cos},-2, 0,0,0,1]", -sin);
    let scene = SCENE
        .replace("[1,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1]", &camera)
        .replace("width = 4\nheight = 4\n", &format!("width = {size}\nheight = {size}\n"))
        .replace("target = \"target.exr\"\n", "")
        .replace("[model]\n", "[model]\neffects = [\"diffuse\"]\n");
    folder.write("scene.toml", scene.as_bytes());
    let texels = (0..TEXELS * TEXELS).map(|i| [texel(i % TEXELS, i / TEXELS); 3]).collect();
    let color = Some(Map { width: TEXELS, height: TEXELS, texels });
    Baked::new(
        &folder.path("scene.toml"),
        &PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() },
    )
    .unwrap()
    .with_scene(|scene| {
        scene.maps = Maps { color, ..Maps::default() };
        scene.quality.samples_per_axis = 1;
    })
}

fn checkerboard() -> Baked {
    quad(0.0, 32, |x, y| ((x / 4 + y / 4) % 2) as f32)
}

/// Seen at 80 degrees: wide stripes away from the eye, which are to stay apart, over narrow ones across, of which a pixel
/// covers a dozen.
fn grazing() -> Baked {
    quad(-1.4, 64, |x, y| 0.5 * ((x / 64 % 2) + (y / 4 % 2)) as f32)
}

fn with(baked: &Baked, filter: TextureFilter) -> Baked {
    baked.clone().with_scene(|scene| scene.quality.texture_filter = filter)
}

#[test]
fn one_filtered_sample_shows_what_many_show() {
    let baked = checkerboard();
    let many = on_cpu(&baked, 16);
    let one = |filter| error(&many, &on_cpu(&with(&baked, filter), 1));
    // The mean of four whole checks and a part, in both directions, is within 0.5% of that of all; one texel is black or
    // white.
    assert!(one(TextureFilter::Bilinear) > 0.5, "{}", one(TextureFilter::Bilinear));
    for filter in FILTERED {
        assert!(one(filter) < 0.01, "{}: {}", filter.name(), one(filter));
    }
}

#[test]
fn only_the_anisotropic_filter_keeps_what_is_wide_enough_at_grazing_angles() {
    let baked = grazing();
    let many = on_cpu(&baked, 16);
    let [bilinear, trilinear, anisotropic] =
        TextureFilter::ALL.map(|filter| error(&many, &on_cpu(&with(&baked, filter), 1)));
    // One sample of narrow stripes is off by their contrast, 0.25 of a mean of 0.5. Trilinear texels are as wide as a pixel
    // is long, which is nearly a wide stripe.
    assert!(bilinear > 0.3, "{bilinear}");
    assert!(trilinear > 0.1 && anisotropic < 0.5 * trilinear, "{trilinear} {anisotropic}");
}

#[test]
fn more_samples_cover_less_each() {
    // With samples as dense as texels no filter has anything to do: coarser levels are not read where a texel covers a
    // sample.
    let baked = checkerboard();
    let dense = |filter| on_cpu(&with(&baked, filter), 32);
    let bilinear = dense(TextureFilter::Bilinear);
    for filter in FILTERED {
        assert_eq!(dense(filter).rgb, bilinear.rgb, "{}", filter.name());
    }
}

/// How far 99 of 100 wholly covered pixels are off the CPU's image, relative to the mean.
fn beside_cpu(gpu: &Gpu, baked: &Baked, n: u32, budget: Budget) -> (f32, f32) {
    let options = RenderOptions { antialias: Antialias::Grid(n), budget, ..EXACT };
    let difference = Difference::new(&on_cpu(baked, n), &on_gpu(gpu, baked, options), n * n);
    assert!(difference.interior.len() > 500, "{}", difference.interior.len());
    (quantile(&difference.interior, 0.5), quantile(&difference.interior, 0.99))
}

#[test]
fn the_renderer_filters_as_the_samples_do() {
    let Some(gpu) = gpu() else { return };
    let head = baked(&built_in(), SURFACE, 128);
    for filter in FILTERED {
        for (name, baked, n, median, most) in [
            // Seen from straight ahead steps are the same everywhere: what is left is rounding.
            ("checkerboard", checkerboard(), 1, 1e-5, 1e-4),
            // The adapter takes steps to a neighbour, the CPU at the sample itself; lengths change by some hundredths from
            // pixel to pixel, and with them the level and, now and then, the number of places.
            ("grazing", grazing(), 2, 5e-3, 3e-2),
            ("head", head.clone(), 2, 1e-3, 2e-2),
        ] {
            let found = beside_cpu(gpu, &with(&baked, filter), n, Budget::Exact);
            assert!(found.0 < median && found.1 < most, "{} {name}: {found:?}", filter.name());
        }
        // Maps are of 8 bits there, and the adapter's own samplers approximate the level, and of a long footprint the
        // places: of checks of black and white that is most where a few of them are seen. What the rules declare is what
        // 99 of 100 pixels of a scanned head stay within, whose texels are less apart.
        let most = if filter == TextureFilter::Anisotropic { 0.25 } else { 0.05 };
        for (name, baked, n, most) in
            [("checkerboard", checkerboard(), 1, 2e-2), ("grazing", grazing(), 2, most)]
        {
            let found = beside_cpu(gpu, &with(&baked, filter), n, Budget::Paper);
            assert!(found.1 < most, "{} {name}, hardware: {found:?}", filter.name());
        }
    }
}

fn albedos(samples: &ViewSamples) -> Vec<f32> {
    (0..samples.records() * LANES).map(|slot| samples.surface.fragment(slot).albedo[1]).collect()
}

#[test]
fn samples_that_the_adapter_makes_are_filtered_too() {
    let Some(gpu) = gpu() else { return };
    for filter in TextureFilter::ALL {
        let baked = with(&checkerboard(), filter);
        let traced = baked.clone().sample().unwrap().samples.remove(0);
        let (made, groups) = DeviceSamples::new(gpu, Content::of(&baked)).unwrap();
        let drawn = ViewSamples { surface: made.read(0, &groups[0]).unwrap(), ..groups[0].clone() };
        assert_eq!(traced.pixel, drawn.pixel);
        let off =
            albedos(&traced).iter().zip(albedos(&drawn)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // Hardware snaps corners to 1/256 of a sample: of a check of a quarter of a sample that is a hundredth and a
        // half. Of the mean of checks nothing is left.
        let most = if filter.reads_levels() { 1e-4 } else { 0.05 };
        assert!(off < most, "{}: {off}", filter.name());
        let grey = albedos(&drawn).iter().filter(|a| (**a - 0.5).abs() < 0.05).count();
        assert_eq!(grey == traced.records() * LANES, filter.reads_levels(), "{}", filter.name());
    }
}

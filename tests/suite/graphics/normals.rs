//! Bumps that are smaller than a sample: specular lobes that are widened by them, beside many samples a pixel and on the
//! renderer.

use skinfit::gpu::RenderOptions;
use skinfit::model::choices::{NormalFilter, SpecularModel};
use skinfit::model::fragment::normal_spread;
use skinfit::model::params::Param;
use skinfit::model::texture_filter::TextureFilter;
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::antialias::Antialias;
use skinfit::scene::maps::{Map, Maps};

use super::bench::*;
use crate::scene_folder::{SCENE, SceneFolder, png};

/// Texels along a side of the normal map; a pixel of the quad covers 17 of them.
const TEXELS: usize = 1024;
const LAMP: &str = "
[[light]]
name = \"Raking\"
type = \"directional\"
direction = [-0.5, -0.3, -1.0]
irradiance = 3.0
";

/// A quad under a lamp, all of whose light is mirrored; `slopes` gives the bumps of its texels.
fn quad(model: SpecularModel, slopes: impl Fn(usize, usize) -> [f64; 2]) -> Baked {
    let folder = SceneFolder::new();
    let scene = SCENE
        .replace("width = 4\nheight = 4\n", "width = 32\nheight = 32\n")
        .replace("target = \"target.exr\"\n", "")
        .replace("[model]\n", "[model]\neffects = [\"normal_map\", \"lights\", \"light_specular\"]\n");
    folder.write("scene.toml", format!("{scene}{LAMP}").as_bytes());
    let texel = |i: usize| {
        let [x, y] = slopes(i % TEXELS, i / TEXELS);
        let length = (1.0 + x * x + y * y).sqrt();
        [-x / length, -y / length, 1.0 / length].map(|n| (0.5 * n + 0.5) as f32)
    };
    let normal =
        Some(Map { width: TEXELS, height: TEXELS, texels: (0..TEXELS * TEXELS).map(texel).collect() });
    Baked::new(
        &folder.path("scene.toml"),
        &PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() },
    )
    .unwrap()
    .with_scene(|scene| {
        scene.maps = Maps { normal, ..Maps::default() };
        scene.quality.samples_per_axis = 1;
        scene.choices.specular_model = model;
        scene.params.set(Param::BaseWeight, 0.0);
        scene.params.set(
            Param::from_identifier("roughness").unwrap(),
            if model == SpecularModel::Ggx { 0.5 } else { 0.25 },
        );
    })
}

/// Slopes of a normal distribution, as many texels wide: a hash of their place.
fn bumps(deviation: f64, wide: usize) -> impl Fn(usize, usize) -> [f64; 2] {
    let hash = |mut x: u64| {
        x = (x ^ (x >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        ((x ^ (x >> 33)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    move |x, y| {
        let place = 2 * ((y / wide) * TEXELS + x / wide) as u64 + 1;
        // Box and Muller's.
        let (radius, angle) =
            ((-2.0 * hash(place).max(1e-12).ln()).sqrt(), std::f64::consts::TAU * hash(place + 1_000_003));
        [deviation * radius * angle.cos(), deviation * radius * angle.sin()]
    }
}

fn with(baked: &Baked, textures: TextureFilter, normals: NormalFilter) -> Baked {
    baked.clone().with_scene(|scene| {
        scene.quality.texture_filter = textures;
        scene.choices.normal_filter = normals;
    })
}

#[test]
fn one_sample_over_bumps_shows_the_highlight_of_many() {
    for model in SpecularModel::ALL {
        let baked = quad(model, bumps(0.15, 2));
        let many = on_cpu(&baked, 16);
        let one = |normals| error(&many, &on_cpu(&with(&baked, TextureFilter::Trilinear, normals), 1));
        let (narrow, wide) = (one(NormalFilter::None), one(NormalFilter::Toksvig));
        // Slopes of 0.15 beside a lobe of 0.25 move its peak by a third; what is left is that sixty bumps are no whole
        // distribution, and that the lobe's other factors stay those of the mean normal. That of ggx is no bell, of which
        // the sum with bumps would be one again.
        let left = if model == SpecularModel::Ggx { 0.7 } else { 0.5 };
        assert!(narrow > 0.15 && wide < left * narrow, "{model:?}: {narrow} {wide}");
    }
}

#[test]
fn a_smooth_map_widens_nothing() {
    let baked = quad(SpecularModel::Kelemen, |_, _| [0.2, -0.1]);
    let of = |normals| on_cpu(&with(&baked, TextureFilter::Trilinear, normals), 1);
    // A unit normal in f32 is short by some roundings, 1e-7 of a variance of 0.03.
    assert!(error(&of(NormalFilter::None), &of(NormalFilter::Toksvig)) < 1e-4);
}

#[test]
fn texels_that_are_short_themselves_widen_nothing() {
    // As of a map that was kept as a JPEG: one direction everywhere, 0.8 long.
    let texel = [0.2_f64, -0.1, 1.0].map(|x| (127.5 * (0.8 * x / 1.05_f64.sqrt() + 1.0)).round() as u8);
    let of = |normals: NormalFilter| {
        let folder = SceneFolder::new();
        folder.write("normal.png", &png(4, 4, texel));
        let scene = SCENE
            .replace("width = 4\nheight = 4\n", "width = 32\nheight = 32\n")
            .replace("target = \"target.exr\"\n", "")
            .replace(
                "[model]\n",
                &format!(
                    "[model]\neffects = [\"normal_map\", \"lights\", \"light_specular\"]\nnormal_filter = \"{}\"\n",
                    normals.name()
                ),
            )
            .replace("[quality]\n", "[quality]\ntexture_filter = \"trilinear\"\n");
        folder.write("scene.toml", format!("{scene}{LAMP}").as_bytes());
        on_cpu(
            &Baked::new(
                &folder.path("scene.toml"),
                &PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() },
            )
            .unwrap(),
            1,
        )
    };
    // A unit normal in f32 is short by some roundings, 1e-7 of a variance of 0.06.
    assert!(error(&of(NormalFilter::None), &of(NormalFilter::Toksvig)) < 1e-4);
}

#[test]
fn the_spread_is_the_variance_of_slopes() {
    // The mean of unit normals with slopes of so little variance is as long as 1 / (1 + variance) to its square.
    for deviation in [0.02_f64, 0.05, 0.1] {
        let slopes = bumps(deviation, 1);
        let mut mean = [0.0_f64; 3];
        for i in 0..100_000 {
            let [x, y] = slopes(i % TEXELS, i / TEXELS);
            let length = (1.0 + x * x + y * y).sqrt();
            [-x, -y, 1.0].iter().zip(&mut mean).for_each(|(n, sum)| *sum += n / length / 1e5);
        }
        let spread = f64::from(normal_spread(mean.map(|n| (0.5 * n + 0.5) as f32)));
        // A hundred thousand draws tell a variance to half a percent.
        let variance = deviation * deviation;
        assert!((spread / variance - 1.0).abs() < 0.015 + 2.0 * variance, "{spread} {variance}");
    }
    assert_eq!(normal_spread([0.5; 3]), 0.0);
    assert_eq!(normal_spread([f32::NAN; 3]), 0.0);
    assert_eq!(normal_spread([0.5, 0.5, 1.0]), 0.0);
}

#[test]
fn the_renderer_widens_lobes_as_samples_do() {
    let Some(gpu) = gpu() else { return };
    for model in SpecularModel::ALL {
        let baked = with(&quad(model, bumps(0.15, 2)), TextureFilter::Trilinear, NormalFilter::Toksvig);
        let options = RenderOptions { antialias: Antialias::Grid(1), ..EXACT };
        let difference = Difference::new(&on_cpu(&baked, 1), &on_gpu(gpu, &baked, options), 1);
        // Rounding, of a highlight that a variance of some roundings more or less makes no other.
        assert!(
            quantile(&difference.interior, 0.99) < 1e-4,
            "{model:?}: {}",
            quantile(&difference.interior, 0.99)
        );
    }
}

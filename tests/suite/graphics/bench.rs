//! An adapter, scenes, and images of both engines.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use skinfit::demo;
pub(crate) use skinfit::gpu::upload::Content;
use skinfit::gpu::{Choice, Gpu, RenderOptions, Renderer};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::prepare::{Baked, Loaded, PrepareOptions, Sampled, Views};
use skinfit::render::antialias::Antialias;
use skinfit::render::backdrop::Backdrop;
use skinfit::render::bloom::add_bloom;
use skinfit::render::files::{ImageOptions, write_exr};
use skinfit::render::image::Image;
use skinfit::render::shade::Shader;
use skinfit::render::shading::Shading;
use skinfit::shader::Budget;

use crate::common::not_checked;

/// The adapter's device that most tests share; `None`, and each test says so, where `SKINFIT_NO_GPU_TESTS` allows it.
pub(crate) fn gpu() -> Option<&'static Gpu> {
    static GPU: OnceLock<Result<Gpu, String>> = OnceLock::new();
    let opened = GPU.get_or_init(|| Gpu::open(&Choice::default()).map_err(|error| error.to_string()));
    opened.as_ref().map_err(|error| excused(error)).ok()
}

/// A device of its own.
pub(super) fn open(choice: &Choice) -> Option<Gpu> {
    Gpu::open(choice).map_err(|error| excused(&error.to_string())).ok()
}

/// Without a device a test fails, unless the variable says to leave it out.
fn excused(error: &str) {
    assert!(
        std::env::var_os("SKINFIT_NO_GPU_TESTS").is_some(),
        "{error}\nThe renderer's tests need an adapter: tests/run installs a software one where it can. \
         SKINFIT_NO_GPU_TESTS=1 leaves them out."
    );
    not_checked(&format!("SKINFIT_NO_GPU_TESTS is set: {error}"));
}

/// What both engines draw with, unless a test says otherwise.
pub(crate) const EXACT: RenderOptions = RenderOptions {
    antialias: Antialias::Grid(2),
    shading: Shading::VisibilityBuffer,
    budget: Budget::Exact,
    timed: false,
    animated: false,
};

/// The paper's fragment program.
pub(crate) const SURFACE: Effects = Effects::SURFACE;

/// Every effect of the tables.
pub(crate) fn everything() -> Effects {
    Effect::BUILT_IN.into_iter().collect()
}

pub(crate) fn cache() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics")
}

/// The built-in scene's file, made once.
pub(crate) fn built_in() -> PathBuf {
    static SCENE: OnceLock<PathBuf> = OnceLock::new();
    SCENE.get_or_init(|| demo::kept_scene(&cache(), Some(&cache())).unwrap()).clone()
}

/// The first view of a scene at `size` x `size` pixels.
pub(crate) fn baked(scene: &Path, effects: Effects, size: u32) -> Baked {
    let options = PrepareOptions {
        effects: Some(effects),
        views: Views::First,
        cache: Some(cache()),
        ..PrepareOptions::default()
    };
    let mut loaded = Loaded::read(scene, &options).unwrap();
    let camera = &mut loaded.scene.views[0].camera;
    (camera.width, camera.height) = (size, size);
    loaded.bake().unwrap()
}

/// The scene read another way.
pub(crate) fn read_as(baked: Baked, form: Form, silhouette: Silhouette) -> Baked {
    baked.with_scene(|scene| (scene.form, scene.silhouette) = (form, silhouette))
}

/// What the CPU's rays see, with `n` x `n` samples a pixel.
pub(crate) fn sampled(baked: &Baked, n: u32) -> Sampled {
    baked.clone().with_scene(|scene| scene.quality.samples_per_axis = n).sample().unwrap()
}

/// The CPU engine's image, with `n` x `n` samples a pixel.
pub(crate) fn on_cpu(baked: &Baked, n: u32) -> Image {
    let baked = sampled(baked, n);
    let shader = Shader::new(baked.setup(), &baked.illumination, &baked.scene.params).unwrap();
    let mut shaded = shader.shade(&baked.samples[0], &baked.scene.views[0].camera, baked.gains[0]);
    let (scene, view) = (&baked.scene, &baked.scene.views[0]);
    if let Some(backdrop) = Backdrop::new(scene, &scene.params, view.background, &view.camera, n) {
        backdrop.put_behind(&mut shaded.image, &mut shaded.glow, baked.gains[0]);
    }
    if baked.scene.effects.has(Effect::Bloom) {
        add_bloom(&mut shaded.image, &shaded.glow, baked.scene.bloom.sigma);
    }
    shaded.image
}

/// The adapter's image.
pub(crate) fn on_gpu(gpu: &Gpu, baked: &Baked, options: RenderOptions) -> Image {
    let mut renderer = Renderer::new(gpu, Content::of(baked), options).unwrap();
    renderer.set_background(baked.scene.views[0].background);
    renderer.render(&baked.scene.views[0].camera, baked.gains[0]).unwrap().image
}

/// How two images differ, by pixel: interior ones, which both cover wholly, and edge ones, which only part
/// of the samples cover. Errors are the greatest of the channels, relative to the image's mean radiance.
pub(crate) struct Difference {
    /// Sorted.
    pub(crate) interior: Vec<f32>,
    /// Sorted: of edge pixels that both cover equally.
    pub(crate) edge: Vec<f32>,
    /// Pixels whose coverage differs.
    pub(crate) uncovered: usize,
    /// The greatest error of pixels whose coverage differs, beyond what one sample is worth.
    pub(crate) beyond_a_sample: f32,
}

impl Difference {
    /// Of `test` from `reference`, with `samples` samples a pixel.
    pub(crate) fn new(reference: &Image, test: &Image, samples: u32) -> Self {
        let covered: Vec<usize> = (0..reference.rgb.len()).filter(|&i| reference.alpha[i] > 0.0).collect();
        let sum: f32 =
            covered.iter().map(|&i| reference.rgb[i].iter().map(|x| x.abs()).sum::<f32>() / 3.0).sum();
        let mean = sum / covered.len() as f32;
        let brightest = reference.rgb.iter().flatten().fold(0.0_f32, |most, x| most.max(x.abs()));
        let (mut interior, mut edge) = (Vec::new(), Vec::new());
        let (mut uncovered, mut beyond_a_sample) = (0, 0.0_f32);
        for i in 0..reference.rgb.len() {
            let (a, b) = (reference.alpha[i], test.alpha[i]);
            let error = (0..3).map(|c| (reference.rgb[i][c] - test.rgb[i][c]).abs()).fold(0.0, f32::max);
            assert!(error.is_finite(), "pixel {i}: {:?} is not {:?}", test.rgb[i], reference.rgb[i]);
            if a == 1.0 && b == 1.0 {
                interior.push(error / mean);
            } else if (a - b).abs() > 0.5 / samples as f32 {
                uncovered += 1;
                let worth = (a - b).abs() * brightest;
                beyond_a_sample = beyond_a_sample.max((error - worth) / mean);
            } else if a > 0.0 {
                edge.push(error / mean);
            }
        }
        interior.sort_by(f32::total_cmp);
        edge.sort_by(f32::total_cmp);
        Self { interior, edge, uncovered, beyond_a_sample }
    }
}

/// The root mean square of how far wholly covered pixels are off, relative to their mean.
pub(crate) fn error(reference: &Image, image: &Image) -> f64 {
    let whole = |i: &usize| reference.alpha[*i] == 1.0 && image.alpha[*i] == 1.0;
    let pixels: Vec<usize> = (0..reference.rgb.len()).filter(whole).collect();
    assert!(pixels.len() > 500, "{}", pixels.len());
    let of = |image: &Image, i: usize| f64::from(image.rgb[i][1]);
    let square: f64 = pixels.iter().map(|&i| (of(image, i) - of(reference, i)).powi(2)).sum();
    let mean = pixels.iter().map(|&i| of(reference, i)).sum::<f64>() / pixels.len() as f64;
    (square / pixels.len() as f64).sqrt() / mean
}

/// The error that a share of the pixels stays below.
pub(crate) fn quantile(sorted: &[f32], share: f64) -> f32 {
    let at = ((sorted.len() as f64 * share) as usize).min(sorted.len().saturating_sub(1));
    sorted.get(at).copied().unwrap_or(0.0)
}

/// Leave both images and a FLIP map of a failed comparison under `target/parity`; returns where.
pub(crate) fn keep(name: &str, reference: &Image, test: &Image) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../parity");
    let seen = |image: &Image| -> Vec<[f64; 3]> {
        let encoded = |x: f32| skinfit::render::tonemap::srgb_encode(x.clamp(0.0, 1.0)).into();
        let over = |(rgb, alpha): (&[f32; 3], &f32)| rgb.map(|x| encoded(x + (1.0 - alpha) * 0.05));
        image.rgb.iter().zip(&image.alpha).map(over).collect()
    };
    let map = skinfit::report::flip::flip(&seen(reference), &seen(test), reference.width);
    let map = Image {
        rgb: map.iter().map(|&x| [x; 3]).collect(),
        alpha: vec![1.0; map.len()],
        ..reference.clone()
    };
    for (what, image) in [("cpu", reference), ("gpu", test), ("flip", &map)] {
        write_exr(&folder.join(format!("{name}_{what}.exr")), image, &ImageOptions::default()).unwrap();
    }
    format!("see {} in {}", format_args!("{name}_*.exr"), folder.display())
}

//! A rendering by the library, on a graphics adapter where there is one and on the CPU:
//! `cargo run --release --example library_render -- [SCENE]`. Leaves `library_<engine>.exr` in the working folder.

use std::error::Error;
use std::path::{Path, PathBuf};

use skinfit::gpu::Choice;
use skinfit::gpu::RenderOptions;
use skinfit::gpu::upload::Content;
use skinfit::prepare::Sampled;
use skinfit::render::antialias::Antialias;
use skinfit::render::shading::Shading;
use skinfit::shader::Budget;
use skinfit::{Gpu, PrepareOptions, Renderer, Shader, built_in_scene, write_exr};

fn main() -> Result<(), Box<dyn Error>> {
    let cache = std::env::temp_dir().join("skinfit-library");
    let scene = match std::env::args_os().nth(1) {
        Some(path) => PathBuf::from(path),
        None => built_in_scene(&cache)?,
    };
    let options = PrepareOptions { cache: Some(cache), ..PrepareOptions::default() };
    let sampled = Sampled::new(&scene, &options)?;
    let view = sampled.scene.views.first().ok_or("the scene has no view")?;

    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params)?;
    let on_cpu = shader.shade(&sampled.samples[0], &view.camera, 1.0).image;
    write_exr(Path::new("library_cpu.exr"), &on_cpu, &Default::default())?;

    let gpu = match Gpu::open(&Choice::default()) {
        Ok(gpu) => gpu,
        Err(error) => {
            println!("library_cpu.exr; on no adapter: {error}");
            return Ok(());
        }
    };
    let antialias = Antialias::Grid(sampled.scene.quality.samples_per_axis);
    let options = RenderOptions {
        antialias,
        shading: Shading::default(),
        budget: Budget::Exact,
        timed: false,
        animated: false,
    };
    let on_gpu = Renderer::new(&gpu, Content::of(&sampled), options)?.render(&view.camera, 1.0)?.image;
    write_exr(Path::new("library_gpu.exr"), &on_gpu, &Default::default())?;

    // Silhouettes are where the rasteriser and rays may differ by a pixel: the share of pixels that differ tells.
    let differs = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-3);
    let apart = on_cpu.rgb.iter().zip(&on_gpu.rgb).filter(|pair| differs(*pair)).count();
    println!(
        "{}: {apart} of {} pixels differ from the CPU's by more than 0.001",
        gpu.name(),
        on_cpu.rgb.len()
    );
    Ok(())
}

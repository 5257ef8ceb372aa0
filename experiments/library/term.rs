//! A term of one's own: `cargo run --release --example library_term`.
//!
//! `fresnel.wgsl` beside this file declares an effect, two parameters and a formula. The built-in head is drawn with it
//! at constants chosen here, these images are fitted from the parameters' defaults, and the fitted model is written as
//! GLSL. Nothing but that file knows of the term; a scene file would name it by `[model] terms = ["fresnel.wgsl"]`.

use std::error::Error;

use skinfit::export;
use skinfit::export::Provenance;
use skinfit::model::params::Column;
use skinfit::prepare::Loaded;
use skinfit::samples::ViewSamples;
use skinfit::scene::view::{Target, View};
use skinfit::shader::Budget;
use skinfit::{FitOptions, PrepareOptions, Shader, built_in_scene, fit, register_term};

/// What the images are made with.
const WEIGHT: [f64; 3] = [0.9, 0.6, 0.4];
const F0: f64 = 0.07;

fn main() -> Result<(), Box<dyn Error>> {
    let term = register_term("fresnel.wgsl", include_str!("fresnel.wgsl"))?;
    let [weight, f0] = term.params[..] else { return Err("fresnel.wgsl declares two parameters".into()) };

    let cache = std::env::temp_dir().join("skinfit-library");
    let scene = built_in_scene(&cache)?;
    let options = PrepareOptions { cache: Some(cache), ..PrepareOptions::default() };
    let mut loaded = Loaded::read(&scene, &options)?;
    loaded.scene.effects = loaded.scene.effects.with(term.effect);
    loaded.scene.fit.free.extend(Column::per_channel(weight));
    loaded.scene.fit.free.push(Column::tied(f0));

    let mut truth = loaded.scene.params.clone();
    truth.set_rgb(weight, WEIGHT);
    truth.set(f0, F0);
    let mut sampled = loaded.bake()?.sample()?;
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &truth)?;
    let drawn = |(view, samples): (&View, &ViewSamples)| {
        let image = shader.shade(samples, &view.camera, 1.0).image;
        Target { rgb: image.rgb, alpha: Some(image.alpha), haze: None, mask: None, clipped_at: None }
    };
    let targets: Vec<Target> = sampled.scene.views.iter().zip(&sampled.samples).map(drawn).collect();
    sampled.baked = sampled.baked.with_scene(|scene| {
        for (view, target) in scene.views.iter_mut().zip(targets) {
            view.target = Some(target);
        }
    });

    let observed = sampled.observe()?;
    let outcome = fit(&observed.engine()?, &observed.start(), &FitOptions::default(), &mut |_| {})?;
    let found = (outcome.end.params.rgb(weight), outcome.end.params.scalar(f0));
    println!("{}: {:.4?} of {WEIGHT:?}", weight.name(), found.0);
    println!("{}: {:.4} of {F0}", f0.name(), found.1);

    let facts = observed.scene.facts(&outcome.end.params, Budget::Within(0.05), false);
    let text = export::function(export::Target::Glsl, &facts, &outcome.end.params, &Provenance::default())?;
    std::fs::write("library_term.glsl", text)?;
    println!("the shader: library_term.glsl");

    // Images are rounded to 32 bits; what a fit makes of that is far smaller.
    let off = (0..3).map(|c| (found.0[c] - WEIGHT[c]).abs()).fold((found.1 - F0).abs(), f64::max);
    if off < 1e-4 { Ok(()) } else { Err(format!("off by {off:.1e}").into()) }
}

//! A fit by the library: `cargo run --release --example library_fit -- [SCENE]`; without a scene, of the built-in one.

use std::error::Error;
use std::path::PathBuf;

use skinfit::{FitOptions, Observed, PrepareOptions, built_in_scene, fit};

fn main() -> Result<(), Box<dyn Error>> {
    let cache = std::env::temp_dir().join("skinfit-library");
    let scene = match std::env::args_os().nth(1) {
        Some(path) => PathBuf::from(path),
        None => built_in_scene(&cache)?,
    };
    let options = PrepareOptions { cache: Some(cache), ..PrepareOptions::default() };
    let observed = Observed::new(&scene, &options)?;
    let engine = observed.engine()?;
    observed.warnings.iter().for_each(|warning| eprintln!("{warning}"));

    let outcome = fit(&engine, &observed.start(), &FitOptions::default(), &mut |iteration| {
        println!("iteration {:>2}: loss {:.6e}", iteration.iteration, iteration.loss);
    })?;
    println!("{} after {} passes", outcome.ending.words(), outcome.evaluations);
    for found in &outcome.unknowns {
        let error = found.std_error.map_or("none".to_owned(), |error| format!("{error:.1e}"));
        println!("{:<18} {:>10.6}  standard error {error}", found.unknown.name(), found.value);
    }
    Ok(())
}

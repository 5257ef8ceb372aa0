//! The rate at which transfer vectors are baked, beside Embree: `cargo run --release --example rays -- SCENE -o row.json
//! [--python PYTHON]`.
//!
//! Every vertex of the scene's mesh sends 256 rays. The bake of the transfer vectors of four bands is timed whole: the tree
//! over the triangles, rays, visibility (or, with light that is thrown back, the nearest triangle), projection. With
//! a Python that has `embreex`, `embree.py` beside this file then shoots as many rays from the same vertices, on as many
//! processes as this program has threads, with the tree built beforehand.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use clap::Parser;
use serde_json::{Value, json};
use skinfit::PrepareOptions;
use skinfit::bake::harmonics::Order;
use skinfit::bake::interreflection::Albedo;
use skinfit::bake::transfer::bake_transfer;
use skinfit::prepare::Loaded;
use skinfit::scene::mesh::PosedMesh;

const RAYS: u32 = 256;
const ROUNDS: usize = 5;

#[derive(Parser)]
struct Arguments {
    /// The scene, of which the mesh and its colour map are taken.
    scene: PathBuf,
    /// The file to write.
    #[arg(short, long)]
    output: PathBuf,
    /// A Python that has numpy and embreex.
    #[arg(long)]
    python: Option<PathBuf>,
    /// Threads, and Embree's processes [default: as many as there are].
    #[arg(long)]
    threads: Option<usize>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let threads = arguments.threads.map_or_else(std::thread::available_parallelism, |count| {
        count.try_into().map_err(std::io::Error::other)
    })?;
    rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global()?;
    let scene = Loaded::read(&arguments.scene, &PrepareOptions::default())?.scene;
    let posed = scene.mesh.pose();
    let albedo = Albedo { map: scene.maps.color.as_ref() };
    let points = distinct(&posed);
    let shot = points.len() as f64 * f64::from(RAYS);
    let rate = |albedo: Option<&Albedo<'_>>| shot / seconds(&posed, albedo);
    let mut row = json!({
        "vertices": posed.positions.len(),
        "distinct": points.len(),
        "triangles": posed.triangles.len(),
        "rays": shot,
        "threads": threads.get(),
        "any": { "skinfit": rate(None) },
        "nearest": { "skinfit": rate(Some(&albedo)) },
    });
    if let Some(python) = &arguments.python {
        for (query, seconds) in embree(python, &posed, &points, threads.get())? {
            let embree = shot / seconds;
            let ratio = row[&query]["skinfit"].as_f64().map(|rate| rate / embree);
            row[&query]["embree"] = embree.into();
            row[&query]["ratio"] = ratio.map_or(Value::Null, Value::from);
        }
    }
    fs::write(&arguments.output, serde_json::to_string_pretty(&row)? + "\n")?;
    println!("{}", serde_json::to_string_pretty(&row)?);
    Ok(())
}

/// A vertex of each place and normal: those that coincide are baked once.
fn distinct(posed: &PosedMesh) -> Vec<usize> {
    let mut seen = std::collections::HashSet::new();
    let key = |i: usize| [posed.positions[i], posed.normals[i]].map(|v| v.to_array().map(f32::to_bits));
    (0..posed.positions.len()).filter(|&i| seen.insert(key(i))).collect()
}

/// The least of some bakes.
fn seconds(posed: &PosedMesh, albedo: Option<&Albedo<'_>>) -> f64 {
    let bake = |_| {
        let start = Instant::now();
        std::hint::black_box(bake_transfer(&|_: &[f32]| posed.clone(), 0, RAYS, Order::FOUR, albedo));
        start.elapsed().as_secs_f64()
    };
    (0..ROUNDS).map(bake).fold(f64::INFINITY, f64::min)
}

/// What `embree.py` says of the same vertices: `any` and `nearest`, and their seconds.
fn embree(
    python: &Path,
    posed: &PosedMesh,
    points: &[usize],
    processes: usize,
) -> Result<Vec<(String, f64)>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes);
    let of = |numbers: &[glam::Vec3]| -> Vec<[f32; 3]> { numbers.iter().map(glam::Vec3::to_array).collect() };
    let at =
        |numbers: &[glam::Vec3]| -> Vec<[f32; 3]> { points.iter().map(|&i| numbers[i].to_array()).collect() };
    write("positions.f32", bytemuck::cast_slice(&of(&posed.positions)))?;
    write("triangles.u32", bytemuck::cast_slice(&posed.triangles))?;
    write("normals.f32", bytemuck::cast_slice(&at(&posed.normals)))?;
    // A little off the surface, as the bake's own rays.
    let off = 1e-4 * posed.positions.iter().fold(0.0_f32, |most, p| most.max(p.abs().max_element()));
    let origins: Vec<[f32; 3]> =
        points.iter().map(|&i| (posed.positions[i] + off * posed.normals[i]).to_array()).collect();
    write("origins.f32", bytemuck::cast_slice(&origins))?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/rays/embree.py");
    let run = Command::new(python).arg(script).arg(folder.path()).arg(processes.to_string()).output()?;
    if !run.status.success() {
        return Err(format!("embree.py: {}", String::from_utf8_lossy(&run.stderr)).into());
    }
    let line = |line: &str| -> Result<(String, f64), Box<dyn Error>> {
        let (name, seconds) = line.split_once(' ').ok_or("a name and seconds")?;
        Ok((name.to_owned(), seconds.parse()?))
    };
    String::from_utf8(run.stdout)?.lines().map(line).collect()
}

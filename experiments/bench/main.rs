//! Benchmarks: shading a sample, the engine's passes, a prefilter, occlusion rays, surface samples.
//!
//! `cargo bench` runs all; `cargo bench -- pass` those whose name holds `pass`.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use skinfit::bake::occlusion::bake_occlusion;
use skinfit::bake::panorama::Radiance;
use skinfit::bake::prefilter::Prefilter;
use skinfit::bake::rays::RayMesh;
use skinfit::engine::{Objective, Point};
use skinfit::prepare::{PrepareOptions, Sampled};
use skinfit::render::shade::Shader;
use skinfit::samples::{PosedSurface, sample_view};

/// The built-in scene, written once below target/.
fn sampled() -> Sampled {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/bench-scene");
    let scene = skinfit::demo::kept_scene(&folder, Some(&folder)).expect("the built-in scene can be written");
    let options = PrepareOptions { fit: true, cache: Some(folder), ..PrepareOptions::default() };
    Sampled::new(&scene, &options).expect("the built-in scene can be prepared")
}

fn passes(c: &mut Criterion) {
    let observed = sampled().observe().expect("the built-in scene has targets");
    let start: Point = observed.start();
    let engine = observed.engine().expect("the built-in scene can be fitted");
    let mut group = c.benchmark_group("pass");
    group.throughput(Throughput::Elements(engine.samples()));
    group.bench_function("image", |b| b.iter(|| black_box(engine.image(0, &start))));
    group.bench_function("loss", |b| b.iter(|| black_box(engine.loss(&start))));
    group.bench_function("gradient", |b| b.iter(|| black_box(engine.gradient(&start))));
    group.bench_function("normal equations", |b| b.iter(|| black_box(engine.normal_equations(&start))));
    group.finish();
}

fn sample(c: &mut Criterion) {
    let sampled = sampled();
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params)
        .expect("the built-in rules can be computed");
    let (samples, camera) = (&sampled.samples[0], &sampled.scene.views[0].camera);
    let mut group = c.benchmark_group("sample");
    group.throughput(Throughput::Elements(samples.count() as u64));
    group.bench_function("the rules in f64, with every term", |b| {
        b.iter(|| black_box(shader.shade(samples, camera, 1.0)));
    });
    group.finish();
}

fn bakes(c: &mut Criterion) {
    let sampled = sampled();
    let environment = sampled.scene.environment.as_ref().expect("the built-in scene has an environment");
    let filter = Prefilter::of(&Radiance::new(environment));
    let mut group = c.benchmark_group("bake");
    group.sample_size(10);
    group.throughput(Throughput::Elements(6 * 64 * 64));
    for exponent in [1.0, 32.0, 512.0] {
        group.bench_function(format!("prefilter 64, exponent {exponent}"), |b| {
            b.iter(|| black_box(filter.lobe(64, exponent, |_| {})));
        });
    }
    let posed = sampled.scene.mesh.pose();
    let rays = 32;
    group.throughput(Throughput::Elements(rays * posed.positions.len() as u64));
    group.bench_function("occlusion rays", |b| {
        b.iter(|| black_box(bake_occlusion(&|_: &[f32]| posed.clone(), 0, rays as u32)));
    });
    group.finish();
}

fn surface(c: &mut Criterion) {
    let sampled = sampled();
    let posed = sampled.scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let camera = &sampled.scene.views[0].camera;
    let surface = PosedSurface::bare(&posed, &rays, None);
    let mut group = c.benchmark_group("samples");
    group.sample_size(20);
    let count = sampled.samples[0].count();
    group.throughput(Throughput::Elements(count as u64));
    group.bench_function("one view", |b| {
        b.iter(|| black_box(sample_view(&sampled.scene, &surface, camera)));
    });
    group.finish();
}

criterion_group!(benches, passes, sample, bakes, surface);
criterion_main!(benches);

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
use skinfit::model::evaluate::{compose, shade};
use skinfit::model::fragment::Fragment;
use skinfit::model::lights::{Cubes, Lights};
use skinfit::prepare::{PrepareOptions, Prepared};
use skinfit::samples::sample_view;

/// The built-in scene, written once below target/.
fn prepared() -> Prepared {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/bench-scene");
    let scene = skinfit::demo::kept_scene(&folder, Some(&folder)).expect("the built-in scene can be written");
    let options = PrepareOptions { fit: true, cache: Some(folder), ..PrepareOptions::default() };
    Prepared::new(&scene, &options).expect("the built-in scene can be prepared")
}

fn passes(c: &mut Criterion) {
    let mut prepared = prepared();
    let start: Point = prepared.start();
    let engine = prepared.engine().expect("the built-in scene has targets");
    let mut group = c.benchmark_group("pass");
    group.throughput(Throughput::Elements(engine.samples()));
    group.bench_function("image", |b| b.iter(|| black_box(engine.image(0, &start))));
    group.bench_function("loss", |b| b.iter(|| black_box(engine.loss(&start))));
    group.bench_function("gradient", |b| b.iter(|| black_box(engine.gradient(&start))));
    group.bench_function("normal equations", |b| b.iter(|| black_box(engine.normal_equations(&start))));
    group.finish();
}

fn sample(c: &mut Criterion) {
    let prepared = prepared();
    let like = 0.0_f32;
    let lobes = prepared.illumination.lobes.as_ref().expect("the built-in scene reflects");
    let (specular, slope) = lobes.at(32.0);
    let cubes = Cubes {
        irradiance: prepared.illumination.irradiance.as_ref(),
        specular: Some(&specular),
        lobe_slope: Some(&slope),
        hilite: prepared.illumination.hilite.as_ref(),
    };
    let (setup, params) = (prepared.setup(), prepared.scene.params.clone());
    let lights = Lights::new(setup, &params, cubes, false, like);
    let fragment = Fragment {
        base: [0.1, 0.2, 0.9],
        bump: [0.1, -0.1, 0.0],
        normal: [0.1, 0.2, 0.9],
        view: [0.0, 0.0, -1.0],
        occlusion: 0.8,
        silhouette: 0.2,
        dapple: 0.9,
        albedo: [0.8, 0.6, 0.5],
        specular: 0.3,
        attenuator: 0.4,
    };
    let mut group = c.benchmark_group("sample");
    group.bench_function("value, scalar f32", |b| {
        b.iter(|| shade(setup, &lights, &black_box(fragment), &params));
    });
    group.bench_function("terms, scalar f32", |b| {
        b.iter(|| compose(setup, &lights, &black_box(fragment), &params).each_term(0));
    });
    group.finish();
}

fn bakes(c: &mut Criterion) {
    let prepared = prepared();
    let environment = prepared.scene.environment.as_ref().expect("the built-in scene has an environment");
    let filter = Prefilter::of(&Radiance::new(environment));
    let mut group = c.benchmark_group("bake");
    group.sample_size(10);
    group.throughput(Throughput::Elements(6 * 64 * 64));
    for exponent in [1.0, 32.0, 512.0] {
        group.bench_function(format!("prefilter 64, exponent {exponent}"), |b| {
            b.iter(|| black_box(filter.lobe(64, exponent, |_| {})));
        });
    }
    let posed = prepared.scene.mesh.pose();
    let rays = 32;
    group.throughput(Throughput::Elements(rays * posed.positions.len() as u64));
    group.bench_function("occlusion rays", |b| {
        b.iter(|| black_box(bake_occlusion(&|_: &[f32]| posed.clone(), 0, rays as u32)));
    });
    group.finish();
}

fn surface(c: &mut Criterion) {
    let prepared = prepared();
    let posed = prepared.scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let camera = &prepared.scene.views[0].camera;
    let mut group = c.benchmark_group("samples");
    group.sample_size(20);
    let count = prepared.samples[0].count();
    group.throughput(Throughput::Elements(count as u64));
    group.bench_function("one view", |b| {
        b.iter(|| black_box(sample_view(&prepared.scene, &posed, &rays, None, camera)));
    });
    group.finish();
}

criterion_group!(benches, passes, sample, bakes, surface);
criterion_main!(benches);

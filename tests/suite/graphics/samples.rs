//! Samples that the adapter makes, beside the CPU's.

use std::collections::BTreeMap;

use skinfit::engine::gpu::DeviceSamples;
use skinfit::gpu::Gpu;
use skinfit::model::effects::{Effect, Form, Silhouette};
use skinfit::prepare::Prepared;
use skinfit::samples::{LANES, SurfaceRecords, ViewSamples, sample_views};

use super::bench::*;
use super::parity::{pose, turn};

const SIZE: u32 = 96;

/// The samples of a view by the pixel that they are of, in the order of its samples.
fn by_pixel(samples: &ViewSamples) -> BTreeMap<u32, Vec<usize>> {
    let mut pixels: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for group in 0..samples.groups() {
        let records = samples.group_start[group] as usize..samples.group_start[group + 1] as usize;
        for slot in records.flat_map(|record| record * LANES..(record + 1) * LANES) {
            let pixel = samples.pixel[group * LANES + slot % LANES];
            if pixel != u32::MAX {
                pixels.entry(pixel).or_default().push(slot);
            }
        }
    }
    pixels
}

fn explore(name: &str, gpu: &Gpu, prepared: &Prepared) {
    let posed = prepared.scene.mesh.pose();
    let want = sample_views(&prepared.scene, &posed, prepared.occlusion.as_ref()).unwrap().remove(0);
    let (made, mut got) = DeviceSamples::new(gpu, content(prepared)).unwrap();
    let mut got = got.remove(0);
    got.surface = made.read(0, &got).unwrap();
    assert_eq!(got.surface.places(), want.surface.places());
    println!("{name}: {} {} samples", made.count(), want.count());
    let (a, b) = (by_pixel(&want), by_pixel(&got));
    let count = |s: &SurfaceRecords, slots: &[usize]| slots.iter().filter(|&&slot| s.weight(slot) > 0.0).count();
    let mut other = 0;
    let mut errors: BTreeMap<&str, Vec<f32>> = BTreeMap::new();
    for (pixel, slots) in &a {
        let Some(theirs) = b.get(pixel) else { other += 1; continue };
        let n = count(&want.surface, slots);
        if n != count(&got.surface, theirs) { other += 1; continue; }
        for (&i, &j) in slots.iter().zip(theirs).take(n) {
            assert_eq!(want.surface.weight(i), got.surface.weight(j));
            for (field, row, size) in want.surface.places().fields() {
                let error = (row..row + size).map(|r| (want.surface.rows().number(r, i) - got.surface.rows().number(r, j)).abs()).fold(0.0, f32::max);
                errors.entry(field).or_default().push(error);
            }
        }
    }
    println!("  pixels {} {}, other {other}", a.len(), b.len());
    for (field, mut e) in errors {
        e.sort_by(f32::total_cmp);
        let q = |s: f64| quantile(&e, s);
        println!("  {field:12} median {:.1e} 99% {:.1e} 99.7% {:.1e} most {:.1e}", q(0.5), q(0.99), q(0.997), e.last().unwrap());
    }
}

#[test]
fn explored() {
    let Some(gpu) = gpu() else { return };
    for form in Form::ALL {
        for silhouette in Silhouette::ALL {
            let mut prepared = read_as(prepared(&built_in(), everything(), SIZE), form, silhouette);
            pose(&mut prepared);
            turn(&mut prepared);
            explore(&format!("all {} {}", form.name(), silhouette.name()), gpu, &prepared);
        }
    }
    let mut prepared = prepared(&built_in(), skinfit::model::effects::Effects::of(&[Effect::Diffuse]), SIZE);
    explore("diffuse", gpu, &prepared);
    prepared.scene.form = Form::Listing;
    explore("diffuse listing", gpu, &prepared);
}

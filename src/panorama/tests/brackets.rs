//! Brackets of a known panorama, with a sensor's noise: merged under a given response and under the recovered one.

mod common;

use std::path::Path;

use common::{data, panorama};
use skinfit_panorama::merge::{Doubt, Exposure, MergeOptions, Merged, Weighting, merge};
use skinfit_panorama::picture::Picture;
use skinfit_panorama::response::{Response, SMOOTHNESS, recover};

/// The exposures, and the radiance that they are of, in their unit.
fn brackets(data: &Path) -> (Vec<Exposure>, Picture) {
    let text = std::fs::read_to_string(data.join("brackets/brackets.json")).expect("brackets.json");
    let told: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let exposure = |told: &serde_json::Value| {
        let file = data.join("brackets").join(told["file"].as_str().expect("a name"));
        let image = image::open(file).expect("a PNG").to_rgb8();
        let (width, height) = (image.width() as usize, image.height() as usize);
        let codes = image.pixels().map(|pixel| pixel.0.map(u16::from)).collect();
        Exposure { width, height, codes, most: 255, seconds: told["shutter_s"].as_f64().expect("seconds") }
    };
    let exposures = told["images"].as_array().expect("images").iter().map(exposure).collect();
    let mut truth = panorama(&data.join("env/studio.exr"));
    let scale = told["scale_K"].as_f64().expect("K");
    for texel in &mut truth.texels {
        *texel = texel.map(|x| (f64::from(x) * scale) as f32);
    }
    (exposures, truth)
}

/// The value that a share of numbers is below.
fn percentile(numbers: &mut [f64], share: f64) -> f64 {
    numbers.sort_unstable_by(f64::total_cmp);
    numbers[((numbers.len() - 1) as f64 * share).round() as usize]
}

/// Relative errors of radiance, all channels together, where two exposures see the pixel: the median, the 95th
/// percentile, and the median with its sign.
fn errors(merged: &Merged, truth: &Picture) -> [f64; 3] {
    let mut signed = Vec::new();
    for (i, by) in merged.seen.iter().enumerate() {
        for c in 0..3 {
            if *by >= 2 && truth.texels[i][c] > 0.0 {
                signed.push(f64::from(merged.picture.texels[i][c] / truth.texels[i][c]) - 1.0);
            }
        }
    }
    let mut sizes: Vec<f64> = signed.iter().map(|x| x.abs()).collect();
    [percentile(&mut sizes, 0.5), percentile(&mut sizes, 0.95), percentile(&mut signed, 0.5)]
}

#[test]
fn merged_radiance_is_the_truth() {
    let Some(data) = data() else { return };
    let (exposures, truth) = brackets(&data);
    let recovered = recover(&exposures, SMOOTHNESS).unwrap();
    println!("residual {:?}, pixels {:?}, codes {:?}", recovered.residual, recovered.pixels, recovered.codes);
    let mut worst = [0f64; 3];
    for code in 20..=235 {
        let (got, right) = (
            recovered.response.exposure(f64::from(code) / 255.0),
            Response::Srgb.exposure(f64::from(code) / 255.0),
        );
        for c in 0..3 {
            worst[c] = worst[c].max((got[c] / right[c] - 1.0).abs());
        }
    }
    println!("recovered response against sRGB over codes 20 to 235: {worst:?}");
    let mut medians = Vec::new();
    for (name, response) in [("given", &Response::Srgb), ("recovered", &recovered.response)] {
        for weighting in [Weighting::default(), Weighting::Hat] {
            let merged = merge(&exposures, response, MergeOptions { weighting, align: false }).unwrap();
            let [median, high, bias] = errors(&merged, &truth);
            println!(
                "{name}, {weighting:?}: median {median:.5}, 95 % {high:.5}, bias {bias:+.5}, {:?}",
                merged.counts
            );
            println!("{:?} {:?}", merged.times, merged.doubts);
            // 2 %: a pixel seen at half of a full well of 20000 electrons has 1 % of noise.
            assert!(median < 0.02, "{median}");
            assert!(merged.doubts.is_empty(), "{:?}", merged.doubts);
            assert!(merged.shifts.iter().all(|shift| (shift.x, shift.y) == (0, 0)), "{:?}", merged.shifts);
            assert!(merged.counts.seen_by_two > exposures[0].codes.len() / 2);
            medians.push(median);
        }
    }
    // What the sensor's noise is known to be makes the better weight.
    assert!(medians[0] < medians[1]);
}

#[test]
fn a_wrong_shutter_time_is_noticed() {
    let Some(data) = data() else { return };
    let (mut exposures, _) = brackets(&data);
    for wrong in 0..5 {
        let right = exposures[wrong].seconds;
        exposures[wrong].seconds = right * 1.2;
        let merged = merge(&exposures, &Response::Srgb, MergeOptions::default()).unwrap();
        let [Doubt::ShutterTime { exposure, measured, .. }] = merged.doubts[..] else {
            panic!("{:?}", merged.doubts)
        };
        println!("exposure {wrong}: {:+.4}", measured / right - 1.0);
        // 2 %: half of the doubt's threshold and less; rounding of dark codes is the most of it.
        assert!(exposure == wrong && (measured / right - 1.0).abs() < 0.02, "{measured} of {right}");
        exposures[wrong].seconds = right;
    }
}

#[test]
fn a_shifted_exposure_is_noticed_and_taken_back() {
    let Some(data) = data() else { return };
    let (mut exposures, truth) = brackets(&data);
    // The panorama's columns go around, so nothing leaves the picture.
    let Exposure { width, height, .. } = exposures[3];
    let codes = exposures[3].codes.clone();
    for (i, code) in exposures[3].codes.iter_mut().enumerate() {
        *code = codes[(i / width + height - 4) % height * width + (i % width + 6) % width];
    }
    let merged = merge(&exposures, &Response::Srgb, MergeOptions::default()).unwrap();
    let moved: Vec<_> = merged.shifts.iter().map(|shift| (shift.x, shift.y)).collect();
    assert_eq!(moved, [(0, 0), (0, 0), (-6, 4), (6, -4)]);
    assert_eq!(merged.doubts.iter().filter(|doubt| matches!(doubt, Doubt::Shifted(_))).count(), 2);
    let aligned =
        merge(&exposures, &Response::Srgb, MergeOptions { align: true, ..Default::default() }).unwrap();
    assert!(aligned.doubts.is_empty(), "{:?}", aligned.doubts);
    let [[median, ..], [wrong, ..]] = [errors(&aligned, &truth), errors(&merged, &truth)];
    println!("aligned {median:.5}, not aligned {wrong:.5}");
    assert!(median < 0.02 && median < wrong);
}

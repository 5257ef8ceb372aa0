//! Brackets of a known panorama, with a sensor's noise: merged under a given response and under the recovered one.

mod common;

use std::path::Path;

use common::{data, panorama, srgb_code};
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

/// Errors over the least standard error that they can have: that of Cramér and Rao, which information bounds. An exposure
/// of radiance E has of it t^2 over the variance that the shots were made with (a full well of 20000 electrons, a
/// readout noise of 4, codes rounded), if the channel is neither clipped nor dark.
fn errors_over_least(merged: &Merged, exposures: &[Exposure], truth: &Picture) -> Vec<f64> {
    let light = |code: u16| Response::Srgb.exposure(f64::from(code) / 255.0)[0];
    let mut errors = Vec::new();
    for (i, _) in merged.seen.iter().enumerate().filter(|(_, by)| **by >= 2) {
        for c in 0..3 {
            let right = f64::from(truth.texels[i][c]);
            let information = |exposure: &Exposure| {
                let code = exposure.codes[i][c];
                let step = 0.5 * (light(code + 1) - light(code - 1));
                let variance = right * exposure.seconds / 2e4 + (4.0f64 / 2e4).powi(2) + step * step / 12.0;
                exposure.seconds.powi(2) / variance
            };
            let open = exposures.iter().filter(|exposure| exposure.open(i, c));
            let least = open.map(information).sum::<f64>().powf(-0.5);
            errors.push((f64::from(merged.picture.texels[i][c]) - right) / least);
        }
    }
    errors
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
            // The noise leaves 0.62 % and 1.91 % (see below), to which a recovered response adds up to 1.3 % at single
            // codes; a hat weighs down the bright codes that have the least noise, by half as much again.
            let (most_median, most_high) =
                if weighting == Weighting::Hat { (0.013, 0.034) } else { (0.009, 0.024) };
            assert!(median < most_median && high < most_high, "{median} {high}");
            // No channel of these shots is mixed into another.
            assert!(!merged.clipping_spoils);
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
fn what_is_off_of_merged_radiance_is_noise() {
    let Some(data) = data() else { return };
    let (exposures, truth) = brackets(&data);
    let merged = merge(&exposures, &Response::Srgb, MergeOptions::default()).unwrap();
    let [median, high, bias] = errors(&merged, &truth);
    let over_least = errors_over_least(&merged, &exposures, &truth);
    let size = (over_least.iter().map(|error| error * error).sum::<f64>() / over_least.len() as f64).sqrt();
    let most = over_least.iter().fold(0f64, |most, error| most.max(error.abs()));
    println!("median {median:.5}, 95 % {high:.5}, bias {bias:+.5}; over the least {size:.4}, most {most:.2}");
    // 2 %, as is asked for; the least standard error that these shots allow makes it 1.91 %, and 0.62 % in the median.
    assert!(high < 0.02 && median < 0.0065, "{high} {median}");
    // Of 290000 errors, the size is known to 0.0013. Without what is beside clipped channels it would be 1.20.
    assert!((size - 1.0).abs() < 0.01, "{size}");
    // Beyond six is one normal error in five hundred million.
    assert!(most < 6.0, "{most}");
    // A fiftieth of a standard error: near clipping, a code that noise takes up is left out, and one that it takes down
    // is not.
    assert!(bias.abs() < 2e-4, "{bias}");
}

/// The same shots from a camera whose colour matrix takes some of green off red and blue: where green is clipped, they
/// turn too bright.
#[test]
fn channels_that_a_matrix_mixed_are_left_out_beside_clipped_ones() {
    let Some(data) = data() else { return };
    let (mut exposures, _) = brackets(&data);
    for exposure in &mut exposures {
        for rgb in &mut exposure.codes {
            let [r, g, b] = rgb.map(|code| Response::Srgb.exposure(f64::from(code) / 255.0)[0]);
            // Of the channels as they are clipped, so that what was taken off is too little.
            let mixed = [1.2 * r - 0.2 * g, g, 1.2 * b - 0.2 * g];
            *rgb = mixed.map(srgb_code);
        }
    }
    let merged = merge(&exposures, &Response::Srgb, MergeOptions::default()).unwrap();
    assert!(merged.clipping_spoils);
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

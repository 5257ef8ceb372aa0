//! What a camera, or a hand at a keyboard, brings at worst: an error that says so, or finite numbers.

use glam::{DQuat, DVec2};
use skinfit_panorama::lens::{Fisheye, Lens, Projection};
use skinfit_panorama::merge::{Exposure, ExposureError, MergeError, MergeOptions, Merged, Weighting, merge};
use skinfit_panorama::picture::Picture;
use skinfit_panorama::response::{Response, SMOOTHNESS, recover};
use skinfit_panorama::stitch::{Shot, StitchDoubt, StitchError, StitchOptions, stitch};

const SIZE: usize = 48;

/// Codes of a view exposed for `seconds`, under a linear response.
fn exposure(seconds: f64) -> Exposure {
    let code = |i: usize| {
        let light = (0.3 + (i % SIZE) as f64 / 50.0) * (0.2 + (i / SIZE) as f64 / 30.0);
        [1.0, 0.8, 1.3].map(|colour| ((colour * light * seconds).min(1.0) * 255.0).round() as u16)
    };
    Exposure { width: SIZE, height: SIZE, codes: (0..SIZE * SIZE).map(code).collect(), most: 255, seconds }
}

fn merged(exposures: &[Exposure]) -> Merged {
    let mut last = None;
    for weighting in
        [Weighting::default(), Weighting::Hat, Weighting::Noise { full_well: 1e5, read_noise: 0.0 }]
    {
        for align in [false, true] {
            let options = MergeOptions { weighting, align };
            // Of these, the extremes have rows of 0, and radiance beyond f32.
            let table = |x| Response::Table(vec![[0.0; 3], [0.0; 3], [x; 3]]);
            for response in [table(1e-300), table(1e300), Response::Srgb, Response::Gamma(1.0)] {
                let merged = merge(exposures, &response, options).expect("a merge");
                assert!(
                    merged.picture.texels.iter().all(|rgb| rgb.iter().all(|x| x.is_finite() && *x >= 0.0))
                );
                last = Some(merged);
            }
        }
    }
    last.expect("several")
}

#[test]
fn one_exposure() {
    let one = merged(&[exposure(0.5)]);
    assert!(one.shifts.is_empty() && one.doubts.is_empty() && one.times[0].measured.is_none());
    // Codes are linear there, and rounded by half a step.
    let light = (0.3 + 10.0 / 50.0) * (0.2 + 10.0 / 30.0);
    assert!((f64::from(one.picture.texels[10 * SIZE + 10][0]) - light).abs() < 0.5 / 255.0 / 0.5 + 1e-6);
}

#[test]
fn all_clipped_and_all_black() {
    let filled =
        |code: u16, seconds: f64| Exposure { codes: vec![[code; 3]; SIZE * SIZE], ..exposure(seconds) };
    let clipped = merged(&[filled(255, 1.0), filled(255, 0.125)]);
    assert_eq!(clipped.counts.clipped_everywhere, SIZE * SIZE);
    // The shortest's bound: 1 in an eighth of a second.
    assert_eq!(clipped.picture.texels[0], [8.0; 3]);
    let black = merged(&[filled(0, 1.0), filled(0, 0.125)]);
    assert_eq!(black.counts.dark_everywhere, SIZE * SIZE);
    assert_eq!(black.picture.texels[0], [0.0; 3]);
    let between = merged(&[filled(255, 1.0), filled(0, 0.125)]);
    assert_eq!((between.counts.between_exposures, between.picture.texels[0]), (SIZE * SIZE, [1.0; 3]));
}

#[test]
fn a_table_s_unit_is_the_radiance_s() {
    let exposures = [exposure(0.25), exposure(1.0)];
    for weighting in [Weighting::default(), Weighting::Hat] {
        let options = MergeOptions { weighting, align: false };
        // A unit for each channel.
        let units = [2.0, 0.5, 3.0];
        let table: Vec<[f64; 3]> =
            (0..256).map(|code| Response::Srgb.exposure(f64::from(code) / 255.0)).collect();
        let scaled = table.iter().map(|rgb| std::array::from_fn(|c| rgb[c] * units[c])).collect();
        let one = merge(&exposures, &Response::Srgb, options).unwrap();
        let other = merge(&exposures, &Response::Table(scaled), options).unwrap();
        for (one, other) in one.picture.texels.iter().zip(&other.picture.texels) {
            for c in 0..3 {
                // Pixels are f32.
                assert!(
                    (f64::from(other[c]) - units[c] * f64::from(one[c])).abs() <= 1e-6 * f64::from(other[c])
                );
            }
        }
    }
}

#[test]
fn two_equal_times() {
    let two = merged(&[exposure(0.5), exposure(0.5)]);
    assert!(two.doubts.is_empty() && two.counts.seen_by_two > 0);
    assert!(recover(&[exposure(0.5), exposure(0.5)], SMOOTHNESS).is_err());
}

#[test]
fn exposures_that_are_none() {
    let error = |exposures: &[Exposure]| match merge(exposures, &Response::Srgb, MergeOptions::default()) {
        Err(MergeError::Exposures(error)) => error,
        other => panic!("{other:?}"),
    };
    assert_eq!(error(&[]), ExposureError::None);
    let empty = Exposure { width: 0, height: 0, codes: Vec::new(), ..exposure(1.0) };
    assert!(matches!(error(&[empty]), ExposureError::Picture { exposure: 0, .. }));
    let narrow = Exposure { width: 24, height: 96, ..exposure(1.0) };
    assert!(matches!(error(&[exposure(1.0), narrow]), ExposureError::Sides { exposure: 1, .. }));
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(error(&[Exposure { seconds, ..exposure(1.0) }]), ExposureError::Seconds { .. }));
    }
    assert!(matches!(error(&[Exposure { most: 0, ..exposure(1.0) }]), ExposureError::Most { .. }));
    assert!(matches!(error(&[Exposure { most: 20, ..exposure(1.0) }]), ExposureError::Code { most: 20, .. }));
    let options =
        MergeOptions { weighting: Weighting::Noise { full_well: 0.0, read_noise: 1.0 }, align: false };
    assert!(matches!(merge(&[exposure(1.0)], &Response::Srgb, options), Err(MergeError::Noise { .. })));
    assert!(merge(&[exposure(1.0)], &Response::Gamma(-1.0), MergeOptions::default()).is_err());
    assert!(matches!(error(&vec![exposure(1.0); 256]), ExposureError::TooMany(256)));
}

fn shot(field_of_view_degrees: f64, orientation: DQuat) -> Shot {
    let (width, height) = (SIZE, SIZE);
    let texels = (0..SIZE * SIZE).map(|i| [0.1 + (i % 7) as f32, 1.0 + (i / SIZE) as f32, 2.0]).collect();
    let lens = Lens::Fisheye(Fisheye {
        projection: Projection::Equidistant,
        centre: DVec2::splat(24.0),
        radius: 23.0,
        field_of_view_degrees,
    });
    Shot { picture: Picture { width, height, texels }, lens, orientation, gain: 1.0 }
}

const SMALL: StitchOptions =
    StitchOptions { width: 64, feather_degrees: 20.0, refine: true, gains: true, fill: true };

#[test]
fn shots_that_do_not_overlap() {
    let back = DQuat::from_rotation_y(std::f64::consts::PI);
    let shots = [shot(100.0, DQuat::IDENTITY), Shot { gain: 2.5, ..shot(100.0, back) }];
    let stitched = stitch(&shots, &SMALL).unwrap();
    assert_eq!((&stitched.doubts[..], stitched.residual), (&[StitchDoubt::Unlinked(1)][..], None));
    // What was told stands.
    assert!(stitched.gains == [1.0, 2.5] && stitched.turned_degrees[1] < 1e-6);
    assert!(stitched.unseen > 0.3);
    assert!(stitched.panorama.texels.iter().all(|rgb| rgb.iter().all(|x| x.is_finite() && *x > 0.0)));
    let holes = stitch(&shots, &StitchOptions { fill: false, ..SMALL }).unwrap();
    assert!(holes.panorama.texels.iter().zip(&holes.seen).all(|(rgb, by)| (*by == 0) == (*rgb == [0.0; 3])));
}

#[test]
fn shots_without_features() {
    for value in [0.0, 1.0, f32::MAX] {
        let flat = |orientation| {
            let mut flat = shot(200.0, orientation);
            flat.picture.texels.fill([value; 3]);
            flat
        };
        let shots = [flat(DQuat::IDENTITY), flat(DQuat::from_rotation_y(2.5))];
        let stitched = stitch(&shots, &SMALL).unwrap();
        assert!(stitched.turned_degrees[1] < 0.01, "{:?}", stitched.turned_degrees);
        assert!(stitched.panorama.texels.iter().all(|rgb| rgb.iter().all(|x| x.is_finite())));
    }
}

#[test]
fn shots_that_are_none() {
    let good = || shot(200.0, DQuat::IDENTITY);
    let error = |shot: Shot| stitch(&[good(), shot], &SMALL).unwrap_err();
    assert_eq!(stitch(&[], &SMALL), Err(StitchError::None));
    let mut wrong = good();
    wrong.picture.texels[5][2] = f32::NAN;
    assert!(matches!(error(wrong), StitchError::Picture { shot: 1, .. }));
    let empty = Picture { width: 0, height: 0, texels: Vec::new() };
    assert!(matches!(error(Shot { picture: empty, ..good() }), StitchError::Picture { .. }));
    assert_eq!(
        error(Shot { orientation: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good() }),
        StitchError::Orientation(1)
    );
    assert!(matches!(error(Shot { gain: f64::NAN, ..good() }), StitchError::Gain { .. }));
    assert!(matches!(error(shot(f64::NAN, DQuat::IDENTITY)), StitchError::Lens { .. }));
    for width in [0, 3, usize::MAX - 1] {
        assert_eq!(stitch(&[good()], &StitchOptions { width, ..SMALL }), Err(StitchError::Width(width)));
    }
    assert!(stitch(&[good()], &StitchOptions { feather_degrees: f64::NAN, ..SMALL }).is_err());
    let mut aside = good();
    if let Lens::Fisheye(fisheye) = &mut aside.lens {
        fisheye.centre = DVec2::splat(-1e4);
    }
    assert_eq!(stitch(&[aside], &SMALL), Err(StitchError::NothingSeen));
    // One pixel is not much of a shot, but no trouble either.
    let pixel = Picture { width: 1, height: 1, texels: vec![[1.0; 3]] };
    assert!(stitch(&[good(), Shot { picture: pixel, ..good() }], &SMALL).is_ok());
}

#[test]
fn threads_change_nothing() {
    let shots = [shot(200.0, DQuat::IDENTITY), shot(220.0, DQuat::from_rotation_y(2.8))];
    let exposures = [exposure(0.125), exposure(0.5), exposure(2.0)];
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let merged = merge(&exposures, &Response::Srgb, MergeOptions::default()).unwrap();
            (stitch(&shots, &SMALL).unwrap(), merged, recover(&exposures, SMOOTHNESS).unwrap())
        })
    };
    assert!(with(1) == with(3));
}

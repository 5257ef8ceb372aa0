//! Shots of a known world stitched back to it.

mod common;
#[path = "common/rendered.rs"]
mod rendered;

use common::{data, panorama, srgb_code};
use glam::{DQuat, DVec2, DVec3};
use rand::{RngExt, SeedableRng};
use rendered::{error, shot, truth};
use skinfit_panorama::latlong::{direction_to_uv, uv_to_direction};
use skinfit_panorama::lens::{Fisheye, Lens, MirrorBall, Projection};
use skinfit_panorama::merge::{Exposure, MergeOptions, merge};
use skinfit_panorama::picture::Picture;
use skinfit_panorama::response::Response;
use skinfit_panorama::stitch::{Shot, StitchDoubt, StitchOptions, Stitched, stitch};

const SIZE: usize = 1000;
/// A texel of a panorama of 1024, degrees.
const TEXEL: f64 = 360.0 / 1024.0;

fn fisheye(projection: Projection, size: usize) -> Lens {
    let half = 0.5 * size as f64;
    let (centre, radius) = (DVec2::new(half + 1.3, half - 2.4), half - 6.0);
    Lens::Fisheye(Fisheye { projection, centre, radius, field_of_view_degrees: 200.0 })
}

fn forest() -> Option<Picture> {
    Some(panorama(&data()?.join("env/forest.exr")))
}

/// A world's radiance in a direction: a panorama's texels as the weights of cubic B-splines over its lat-long grid, which
/// holds next to nothing above half of the grid's Nyquist frequency, so that no shot's pixel is too wide for it.
fn radiance(world: &Picture, direction: DVec3) -> [f64; 3] {
    let (u, v) = direction_to_uv(direction);
    let (x, y) = (u * world.width as f64 - 0.5, v * world.height as f64 - 0.5);
    let weights = |t: f64| {
        let s = 1.0 - t;
        let side = |t: f64| (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0;
        [s * s * s / 6.0, side(t), side(s), t * t * t / 6.0]
    };
    let (across, down) = (weights(x - x.floor()), weights(y - y.floor()));
    let mut sum = [0.0; 3];
    for (j, wy) in down.into_iter().enumerate() {
        // Beyond a pole, the sphere goes on half a turn around.
        let row = y.floor() as i64 + j as i64 - 1;
        let height = world.height as i64;
        let (row, turn) = match row {
            row if row < 0 => (-1 - row, world.width / 2),
            row if row >= height => (2 * height - 1 - row, world.width / 2),
            row => (row, 0),
        };
        for (i, wx) in across.into_iter().enumerate() {
            let column = (x.floor() as i64 + i as i64 - 1 + turn as i64).rem_euclid(world.width as i64);
            let texel = world.texels[row as usize * world.width + column as usize];
            for c in 0..3 {
                sum[c] += wx * wy * f64::from(texel[c]);
            }
        }
    }
    sum
}

/// A shot as it is told, `off` from where it was rendered and `brighter` than the world.
fn told(world: &Picture, lens: Lens, real: DQuat, off: DQuat, brighter: f32, size: usize) -> Shot {
    let mut picture = shot(|d| radiance(world, d), &lens, real, size);
    for texel in &mut picture.texels {
        *texel = texel.map(|x| x * brighter);
    }
    Shot { picture, lens, orientation: off * real, gain: 1.0 }
}

fn off_degrees(stitched: &Stitched, shot: usize, real: DQuat) -> f64 {
    stitched.orientations[shot].angle_between(real).to_degrees()
}

#[test]
fn two_fisheyes_back_to_back() {
    let Some(world) = forest() else { return };
    let first = DQuat::from_rotation_x(0.1) * DQuat::from_rotation_y(0.4);
    let second = first * DQuat::from_rotation_y(std::f64::consts::PI);
    let off = DQuat::from_axis_angle(DVec3::new(0.5, 0.7, -0.3).normalize(), 3f64.to_radians());
    let right = truth(|d| radiance(&world, d), 1024);
    for projection in [Projection::Equidistant, Projection::Equisolid] {
        let lens = fisheye(projection, SIZE);
        let mut shots = [
            told(&world, lens, first, DQuat::IDENTITY, 1.0, SIZE),
            told(&world, lens, second, off, 1.07, SIZE),
        ];
        let options = StitchOptions { width: 1024, ..Default::default() };
        let start = std::time::Instant::now();
        let stitched = stitch(&shots, &options).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let angle = off_degrees(&stitched, 1, second);
        let gain = stitched.gains[1] * 1.07 - 1.0;
        let (size, signed) = error(&stitched.panorama, &right, |_| true);
        // The same with all known, for what sampling alone costs; and with what was told.
        shots[1].orientation = second;
        shots[1].gain = 1.0 / 1.07;
        let known = StitchOptions { refine: false, gains: false, ..options };
        let (least, _) = error(&stitch(&shots, &known).unwrap().panorama, &right, |_| true);
        println!("correlations {:?}", stitched.correlations);
        println!(
            "{projection:?}: off by {:.4} texels, gain by {gain:+.5}, radiance by {size:.5} ({signed:+.5}; \
             with all known {least:.5}); residual {:?}, turned {:.3}, {seconds:.1} s",
            angle / TEXEL,
            stitched.residual,
            stitched.turned_degrees[1]
        );
        assert!(stitched.unseen == 0.0 && stitched.doubts.is_empty(), "{:?}", stitched.doubts);
        // A fifth of a texel blurs an overlap by less than the blend's own samples do.
        assert!(angle < 0.2 * TEXEL, "{angle}");
        // The told gain was 7 % off; a tenth of the radiance's 1 % is what may be left.
        assert!(gain.abs() < 1e-3, "{gain}");
        assert!(size < 0.01, "{size}");
    }
}

/// What a camera with an sRGB response, a full well of 20000 electrons and a noise of 4 has of light.
fn exposed(light: &Picture, seconds: f64, random: &mut rand::rngs::StdRng) -> Exposure {
    let mut code = |radiance: f32| {
        let x = f64::from(radiance) * seconds;
        // Two even numbers make a normal one (Box and Muller 1958); many electrons are as good as normal.
        let (a, b) = (1.0 - random.random::<f64>(), random.random::<f64>());
        let normal = (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos();
        srgb_code(x + normal * (x / 2e4 + (4.0f64 / 2e4).powi(2)).sqrt())
    };
    let codes = light.texels.iter().map(|rgb| rgb.map(&mut code)).collect();
    Exposure { width: light.width, height: light.height, codes, most: 255, seconds }
}

#[test]
fn from_codes_to_a_panorama() {
    let Some(world) = forest() else { return };
    let mut random = rand::rngs::StdRng::seed_from_u64(5);
    let lens = fisheye(Projection::Equidistant, SIZE);
    let second = DQuat::from_rotation_y(3.1) * DQuat::from_rotation_z(-0.2);
    let off = DQuat::from_axis_angle(DVec3::new(-0.6, 0.2, 0.5).normalize(), 3f64.to_radians());
    let shots =
        [(DQuat::IDENTITY, DQuat::IDENTITY, 1.0), (second, off, 1.07)].map(|(real, off, brighter)| {
            let shot = told(&world, lens, real, off, brighter, SIZE);
            let exposures =
                [0.002, 0.016, 0.125, 1.0].map(|seconds| exposed(&shot.picture, seconds, &mut random));
            let merged = merge(&exposures, &Response::Srgb, MergeOptions::default()).unwrap();
            assert!(merged.doubts.is_empty(), "{:?}", merged.doubts);
            Shot { picture: merged.picture, ..shot }
        });
    let stitched = stitch(&shots, &StitchOptions { width: 1024, ..Default::default() }).unwrap();
    assert!(stitched.doubts.is_empty(), "{:?}", stitched.doubts);
    let (angle, gain) = (off_degrees(&stitched, 1, second), stitched.gains[1] * 1.07 - 1.0);
    let (size, signed) = error(&stitched.panorama, &truth(|d| radiance(&world, d), 1024), |_| true);
    println!(
        "from codes: off by {:.4} texels, gain by {gain:+.5}, radiance by {size:.5} ({signed:+.5})",
        angle / TEXEL
    );
    assert!(angle < 0.2 * TEXEL && gain.abs() < 2e-3, "{angle} {gain}");
    // 2 %: what the brackets' merge may have; two or three pixels of each shot go into a texel.
    assert!(size < 0.02, "{size}");
}

#[test]
fn orientations_up_to_five_degrees_off_come_back() {
    let Some(world) = forest() else { return };
    let size = 400;
    let lens = fisheye(Projection::Equidistant, size);
    let second = DQuat::from_rotation_y(3.0) * DQuat::from_rotation_z(0.3);
    let shots = [
        told(&world, lens, DQuat::IDENTITY, DQuat::IDENTITY, 1.0, size),
        told(&world, lens, second, DQuat::IDENTITY, 0.8, size),
    ];
    let mut worst = 0f64;
    for i in 0..6 {
        let axis = DVec3::new(
            (f64::from(i) * 2.1).sin(),
            (f64::from(i) * 1.3).cos(),
            (f64::from(i) * 0.7 + 1.0).sin(),
        );
        let off = DQuat::from_axis_angle(axis.normalize(), 5f64.to_radians());
        let moved = [shots[0].clone(), Shot { orientation: off * second, ..shots[1].clone() }];
        let options = StitchOptions { width: 512, ..Default::default() };
        worst = worst.max(off_degrees(&stitch(&moved, &options).unwrap(), 1, second));
    }
    println!("worst of 6: {:.4} texels of 512", worst / (2.0 * TEXEL));
    // As above, of this panorama's texels.
    assert!(worst < 0.2 * 2.0 * TEXEL, "{worst}");
}

#[test]
fn three_shots_settle_together() {
    let Some(world) = forest() else { return };
    let size = 500;
    let lens = fisheye(Projection::Equidistant, size);
    let real: Vec<DQuat> = (0..3).map(|i| DQuat::from_rotation_y(f64::from(i) * 2.094)).collect();
    let off =
        |degrees: f64| DQuat::from_axis_angle(DVec3::new(0.3, -0.5, 0.8).normalize(), degrees.to_radians());
    let shots: Vec<Shot> = [(0.0, 1.0), (2.5, 1.2), (-2.0, 0.7)]
        .into_iter()
        .zip(&real)
        .map(|((degrees, brighter), real)| told(&world, lens, *real, off(degrees), brighter, size))
        .collect();
    let stitched = stitch(&shots, &StitchOptions { width: 1024, ..Default::default() }).unwrap();
    for (i, brighter) in [1.0, 1.2, 0.7].into_iter().enumerate() {
        let (angle, gain) = (off_degrees(&stitched, i, real[i]), stitched.gains[i] * brighter - 1.0);
        println!("shot {i}: off by {:.4} texels, gain by {gain:+.5}", angle / TEXEL);
        // These shots' pixels are 1.2 texels wide.
        assert!(angle < 0.2 * TEXEL && gain.abs() < 2e-3);
    }
}

#[test]
fn shots_of_other_places_are_doubted() {
    let Some(world) = forest() else { return };
    let size = 400;
    let lens = fisheye(Projection::Equidistant, size);
    let turn = DQuat::from_rotation_y(std::f64::consts::PI);
    // Told to look back, it looked aside.
    let aside = DQuat::from_rotation_y(1.0) * DQuat::from_rotation_x(1.0);
    let shots = [
        told(&world, lens, DQuat::IDENTITY, DQuat::IDENTITY, 1.0, size),
        Shot { orientation: turn, ..told(&world, lens, aside, DQuat::IDENTITY, 1.0, size) },
    ];
    let stitched = stitch(&shots, &StitchOptions { width: 256, ..Default::default() }).unwrap();
    println!("other places: {:?} {:?}", stitched.doubts, stitched.correlations);
    assert!(stitched.doubts.iter().any(|doubt| matches!(doubt, StitchDoubt::Unlike { .. })));
}

#[test]
fn mirror_balls_unwrap() {
    let Some(world) = forest() else { return };
    let half = 0.5 * SIZE as f64;
    let ball =
        MirrorBall { centre: DVec2::splat(half), radius: half - 3.0, camera_degrees: 8.0, trusted: 0.97 };
    let lens = Lens::MirrorBall(ball);
    let right = truth(|d| radiance(&world, d), 1024);
    let looking = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-0.1);
    let one = told(&world, lens, looking, DQuat::IDENTITY, 1.0, SIZE);
    let options = StitchOptions { width: 1024, ..Default::default() };
    let stitched = stitch(std::slice::from_ref(&one), &options).unwrap();
    // 40 degrees around what the ball hides, and 12 around the camera.
    let open = |d: DVec3| {
        let in_camera = looking.conjugate() * d;
        in_camera.z > -40f64.to_radians().cos() && in_camera.z < 12f64.to_radians().cos()
    };
    let (size, signed) = error(&stitched.panorama, &right, open);
    println!("one ball: {size:.5} ({signed:+.5}), unseen {:.5}", stitched.unseen);
    // The ball's pixels grow from 0.23 degrees in its middle to 0.7 at the cut, two texels, which blurs.
    assert!(size < 0.03 && signed.abs() < 0.005, "{size} {signed}");
    // The cones' caps are (1 - cos) / 2 of the sphere: 28.1 and 8 degrees, and two pixels of the cubic's reach each.
    assert!(stitched.unseen > 0.063 && stitched.unseen < 0.072, "{}", stitched.unseen);
    assert!(stitched.panorama.texels.iter().all(|rgb| rgb.iter().all(|x| *x > 0.0)));

    let aside = looking * DQuat::from_rotation_y(2.0);
    let off = DQuat::from_axis_angle(DVec3::new(-0.2, 0.9, 0.4).normalize(), 3f64.to_radians());
    let two = [one, told(&world, lens, aside, off, 0.9, SIZE)];
    let stitched = stitch(&two, &options).unwrap();
    let (size, signed) = error(&stitched.panorama, &right, |_| true);
    let angle = off_degrees(&stitched, 1, aside);
    println!(
        "two balls: {size:.5} ({signed:+.5}), off by {:.4} texels, gains {:?}",
        angle / TEXEL,
        stitched.gains
    );
    assert!(stitched.unseen == 0.0 && size < 0.03 && angle < 0.2 * TEXEL, "{size} {angle}");
}

#[test]
fn a_shot_finer_than_the_panorama_is_averaged() {
    let Some(world) = forest() else { return };
    let (width, size) = (64, 800);
    let lens = Lens::Fisheye(Fisheye {
        projection: Projection::Equidistant,
        centre: DVec2::splat(400.0),
        radius: 396.0,
        field_of_view_degrees: 300.0,
    });
    let shots = [told(&world, lens, DQuat::IDENTITY, DQuat::IDENTITY, 1.0, size)];
    let stitched = stitch(&shots, &StitchOptions { width, ..Default::default() }).unwrap();
    // The light of a hemisphere is kept, sun and all.
    let (mut got, mut right) = (0.0, 0.0);
    for (i, texel) in stitched.panorama.texels.iter().enumerate() {
        let (x, y) = (i % width, i / width);
        if (16..48).contains(&x) {
            got += f64::from(texel[1]) * (std::f64::consts::PI * (y as f64 + 0.5) / 32.0).sin();
        }
    }
    for i in 0..1024 * 512 {
        let (u, v) = (0.25 + 0.5 * (f64::from(i % 1024) + 0.5) / 1024.0, (f64::from(i / 1024) + 0.5) / 512.0);
        let direction = uv_to_direction(u, v);
        right += radiance(&world, direction)[1] * (std::f64::consts::PI * v).sin() / 512.0;
    }
    println!("light of a hemisphere: {:+.5}", got / right - 1.0);
    // 0.5 %: texels of 5.6 degrees take their mean of about 170 pixels each, whose borders do not fall on theirs.
    assert!((got / right - 1.0).abs() < 0.005);
}

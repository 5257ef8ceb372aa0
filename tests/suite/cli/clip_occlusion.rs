//! Occlusion that is baked of each frame of an animation, or of fewer poses: it moves as what stands in the way does, without a
//! jump where one bake follows another, and without coming and going.

use std::ops::Range;

use serde_json::json;

use super::clip::frames;
use super::sandbox::Sandbox;
use crate::props::file::{File, Shape};

/// How far above the skin a card moves.
const HEIGHT: f32 = 0.5;
/// Rays a vertex.
const RAYS: u32 = 4096;
/// Frames a second, and frames of a round of two seconds.
const RATE: usize = 30;
const ROUND: usize = 2 * RATE;

/// A square of skin, 1 wide, whose right edge stands in the middle.
fn skin() -> Shape {
    let row = |j: u8| (0..5_u8).map(move |i| [0.25 * f32::from(i) - 1.0, 0.25 * f32::from(j) - 0.5, 0.0]);
    let positions: Vec<[f32; 3]> = (0..5).flat_map(row).collect();
    let corner = |k: u16| k / 4 * 5 + k % 4;
    let square = |a: u16| [[a, a + 1, a + 6], [a, a + 6, a + 5]];
    Shape {
        normals: vec![[0.0, 0.0, 1.0]; positions.len()],
        uvs: positions.iter().map(|&[x, y, _]| [x + 1.0, y + 0.5]).collect(),
        triangles: (0..16).flat_map(|k| square(corner(k))).collect(),
        positions,
    }
}

/// The skin, and beside it a card of the same size that goes away from it to the right for a second, and comes back.
fn write_clip(sandbox: &Sandbox) {
    let mut file = File::new();
    let white = file.material(json!({"name": "Skin"}));
    file.put(&skin(), white, [0.0; 3]);
    let card = file.material(json!({"name": "Card"}));
    let card = file.put(&Shape::panel(0.5, 0.5), card, [0.6, 0.0, f64::from(HEIGHT)]);
    let times = file.numbers(&[[0.0_f32], [1.0], [2.0]]);
    let places = file.numbers(&[0.6_f32, 1.6, 0.6].map(|x| [x, 0.0, HEIGHT]));
    file.add(
        "animations",
        json!({
            "samplers": [{"input": times, "output": places}],
            "channels": [{"sampler": 0, "target": {"node": card, "path": "translation"}}],
        }),
    );
    sandbox.write("clip.glb", &file.glb());
    sandbox.write_exr("even.exr", 8, 4, |_, _| [1.0; 3]);
    // White under light of 1, skin shows its open share. The card stays beside the picture.
    let scene = format!(
        "[mesh]\nfile = \"clip.glb\"\nskin = [\"Skin\"]\n[environment]\nfile = \"even.exr\"\n[model]\n\
         effects = [\"diffuse\", \"occlusion\", \"skin\"]\n[[view]]\nname = \"above\"\neye = [-0.5, 0, 10]\n\
         look_at = [-0.5, 0, 0]\nfov_y_degrees = 5\nwidth = 8\nheight = 8\n[quality]\nsamples_per_axis = 1\n\
         occlusion_rays = {RAYS}\n"
    );
    sandbox.write("clip.toml", scene.as_bytes());
}

/// Open shares that each frame shows of two rounds, as its own bake or poses at that rate have them.
fn shown(sandbox: &Sandbox, poses: Option<&str>) -> Vec<Vec<f32>> {
    let (rate, stem) = (RATE.to_string(), format!("at_{}", poses.unwrap_or("each")));
    let output = format!("{stem}.exr");
    let clip = ["render", "clip.toml", "--engine", "cpu", "--animate", "--fps", &rate, "--loops", "2"];
    let bakes = ["--occlusion", "frames", "-o", &output];
    let at = poses.map_or(Vec::new(), |poses| vec!["--occlusion-rate", poses]);
    sandbox.run(&[&clip[..], &bakes, &at].concat()).done();
    frames(sandbox, &stem).into_iter().map(|frame| frame.into_iter().map(|rgb| rgb[0]).collect()).collect()
}

/// The sizes of what one pixel changes by from frame to frame, added up.
fn travelled(frames: &[Vec<f32>], pixel: usize, way: Range<usize>) -> f32 {
    way.map(|i| (frames[i + 1][pixel] - frames[i][pixel]).abs()).sum()
}

#[test]
fn occlusion_moves_as_what_stands_in_the_way_and_does_not_flicker() {
    let sandbox = Sandbox::new();
    write_clip(&sandbox);
    let each = shown(&sandbox, None);
    // Poses at every fifth frame, and at times of their own.
    let (lines, odd) = (shown(&sandbox, Some("6")), shown(&sandbox, Some("7")));
    let ray = 1.0 / RAYS as f32;
    for (name, frames) in [("each", &each), ("6 a second", &lines), ("7 a second", &odd)] {
        assert_eq!(frames.len(), 2 * ROUND, "{name}");
        // It comes again to the bit, so that the loop is closed as one frame follows another.
        assert!(frames[..ROUND] == frames[ROUND..], "{name}");
        for pixel in 0..frames[0].len() {
            // A long edge at the height h that moves by d uncovers at most d / 2h: its strip's form factor, the integral of
            // h^2 / (pi r^4). How many of the rays this is may be one off.
            let most = 1.0 / RATE as f32 / (2.0 * HEIGHT) + ray;
            for (i, pair) in frames[..=ROUND].windows(2).enumerate() {
                let change = (pair[1][pixel] - pair[0][pixel]).abs();
                assert!(change < most, "{name}, frame {i}, pixel {pixel}: {change}");
            }
            for way in [0..RATE, RATE..ROUND] {
                // All of a way goes one way, but for at most a ray a frame.
                let straight = (frames[way.end][pixel] - frames[way.start][pixel]).abs();
                let detour = travelled(frames, pixel, way) - straight;
                assert!(detour < RATE as f32 * ray, "{name}, pixel {pixel}: {detour} beside {straight}");
            }
        }
        // Beside the card a tenth and more of the light comes and goes.
        let most =
            (0..frames[0].len()).map(|pixel| frames[RATE][pixel] - frames[0][pixel]).fold(0.0, f32::max);
        assert!(most > 0.1, "{name}: {most}");
    }
    for (i, frame) in lines.iter().enumerate() {
        let (from, share) = (i / 5 * 5, (i % 5) as f32 / 5.0);
        let to = (from + 5) % ROUND;
        for (pixel, &found) in frame.iter().enumerate() {
            let want = each[from][pixel] + share * (each[to][pixel] - each[from][pixel]);
            // Roundings of f32.
            assert!((found - want).abs() < 1e-6, "frame {i}, pixel {pixel}: {found} is not {want}");
        }
    }
}

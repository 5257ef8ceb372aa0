//! What was captured, damaged: models of COLMAP's, bracketed photographs, and shots of a panorama with their list. What is
//! refused names the file and the place in it, and leaves everything as it was; what is taken leaves whole files.

use std::ops::Range;

use image::{ImageFormat, Rgb, RgbImage};

use super::damaged::check_named;
use super::sandbox::Sandbox;
use crate::cameras::{write_binary, write_text};
use crate::scene_folder::encode;

/// As many places of a file, evenly through it.
const PLACES: usize = 16;

fn places(length: usize) -> impl Iterator<Item = usize> {
    (0..PLACES).map(move |k| k * length / PLACES)
}

/// A file that ends at each of the places.
fn cut(whole: &[u8]) -> Vec<Vec<u8>> {
    places(whole.len()).map(|at| whole[..at].to_vec()).collect()
}

/// A file of which one bit is another at each of the places.
fn flipped(whole: &[u8]) -> Vec<Vec<u8>> {
    let flip = |(k, at): (usize, usize)| {
        let mut bytes = whole.to_vec();
        bytes[at] ^= 1 << (k % 8);
        bytes
    };
    places(whole.len()).enumerate().map(flip).collect()
}

/// Try both of a file; refusals have to say `named`. Those of a file that was cut are as many as `cuts` allows.
fn check(sandbox: &Sandbox, file: &str, named: &str, arguments: &[&str], output: &str, cuts: Range<usize>) {
    let whole = sandbox.read(file);
    let refused = check_named(sandbox, file, named, &cut(&whole), arguments, output);
    assert!(cuts.contains(&refused), "{file}: {refused} of {PLACES} that were cut are refused");
    check_named(sandbox, file, named, &flipped(&whole), arguments, output);
}

/// Whatever is cut short is refused.
const ALL: Range<usize> = PLACES..PLACES + 1;

#[test]
fn models_of_colmaps() {
    let sandbox = Sandbox::new();
    let folder = sandbox.path("sparse");
    std::fs::create_dir(&folder).unwrap();
    let import =
        ["import", "colmap", "sparse", "--mesh", "mesh.glb", "--environment", "env.exr", "-o", "made.toml"];
    // What a camera lacks may show in what refers to it. Text that ends with a line's name or numbers says the same of
    // less: nothing counts its lines.
    write_text(&folder);
    check(&sandbox, "sparse/cameras.txt", "sparse/", &import, "made.toml", ALL);
    check(&sandbox, "sparse/images.txt", "sparse", &import, "made.toml", 2..PLACES + 1);
    sandbox.remove("sparse/cameras.txt");
    sandbox.remove("sparse/images.txt");
    write_binary(&folder);
    check(&sandbox, "sparse/cameras.bin", "sparse/", &import, "made.toml", ALL);
    check(&sandbox, "sparse/images.bin", "sparse/images.bin: ", &import, "made.toml", ALL);
}

#[test]
fn one_shot_of_a_bracket() {
    let sandbox = Sandbox::new();
    for (ending, format) in [("png", ImageFormat::Png), ("jpg", ImageFormat::Jpeg)] {
        // A ramp, which three shutter times shift by their ratio of 4.
        for (name, brighter) in [("a", 1.0), ("b", 4.0), ("c", 16.0)] {
            let code = |x: u32, y: u32| {
                let light = 0.004 * brighter * 1.045_f64.powi((x + 3 * y) as i32);
                (255.0 * light.min(1.0).powf(1.0 / 2.2)).round() as u8
            };
            let picture = RgbImage::from_fn(64, 32, |x, y| Rgb([code(x, y); 3]));
            sandbox.write(&format!("{name}.{ending}"), &encode(picture, format));
        }
        let [a, b, c] = ["a", "b", "c"].map(|name| format!("{name}.{ending}"));
        let merge = ["panorama", "merge", &a, &b, &c, "--seconds", "0.25,1,4", "-o", "merged.exr"];
        check(&sandbox, &b, &format!("{b}: "), &merge, "merged.exr", ALL);
    }
}

/// A table of a list of shots, 32 pixels a side.
fn shot(file: &str, lens: &str, towards: &str) -> String {
    format!(
        "[[shot]]\nfile = \"{file}\"\nlens = \"{lens}\"\ncentre = [16, 16]\nradius = 15.5\n\
         towards = {towards}\nup = [0, 1, 0]\n"
    )
}

#[test]
fn shots_of_a_panorama_and_of_a_mirror_ball() {
    let sandbox = Sandbox::new();
    for name in ["a.exr", "b.exr"] {
        sandbox.write_exr(name, 32, 32, |x, y| [0.5 + 0.01 * x as f32, 0.5, 0.5 + 0.01 * y as f32]);
    }
    let wide = "field_of_view_degrees = 200\n";
    let fisheyes = [("a.exr", "[0, 0, -1]"), ("b.exr", "[0, 0, 1]")];
    let fisheyes = fisheyes.map(|(file, towards)| shot(file, "equidistant", towards) + wide).concat();
    sandbox.write("fisheyes.toml", fisheyes.as_bytes());
    let balls = [("a.exr", "[0, 0, -1]"), ("b.exr", "[1, 0, 0]")];
    let balls = balls.map(|(file, towards)| shot(file, "mirror_ball", towards)).concat();
    sandbox.write("balls.toml", balls.as_bytes());
    for list in ["fisheyes.toml", "balls.toml"] {
        let stitch = ["panorama", "stitch", list, "-o", "sky.exr", "--width", "32"];
        let named = format!("{list}: ");
        check(&sandbox, "b.exr", &named, &stitch, "sky.exr", ALL);
        // A list of one shot is a list.
        check(&sandbox, list, &named, &stitch, "sky.exr", 2..PLACES + 1);
    }
}

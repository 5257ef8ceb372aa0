//! Arbitrary scene files and damaged bytes are thrown at the readers: nothing panics.
//!
//! - [`tree`]: damage to what a file says; [`tables`]: constants, plans, results, cases; [`meshes`]: buffers beside a
//!   glTF file, morph targets, animations, cameras, masks; [`materials`]: what parts are drawn by, and the skin's own maps;
//!   [`cameras`]: what other programs say of theirs, responses
//!
//! What the program makes of damaged files, and what it leaves behind, is in `cli::damaged` and `cli::damaged_captures`; states
//! of fits are in `fits::damaged`.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

mod cameras;
mod materials;
mod meshes;
mod tables;
pub(crate) mod tree;

use std::fmt::Write as _;

use exr::prelude::Encoding;
use image::{ImageFormat, Rgb, RgbImage};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use serde_json::json;
use skinfit::scene::{Scene, SceneError, Warning};

use super::scene_folder::{SCENE, SceneFolder, base64, encode, exr_with, quad, quad_parts, skinned};

/// What may happen to a file on its way.
#[derive(Clone, Debug)]
pub(crate) enum Damage {
    Cut(usize),
    Flip(Vec<(usize, u8)>),
    Overwrite(usize, Vec<u8>),
    Insert(usize, Vec<u8>),
    Replace(Vec<u8>),
}

impl Damage {
    pub(crate) fn apply(&self, mut bytes: Vec<u8>) -> Vec<u8> {
        let size = bytes.len().max(1);
        match self {
            Self::Cut(at) => bytes.truncate(at % size),
            Self::Flip(flips) if !bytes.is_empty() => {
                flips.iter().for_each(|(at, bit)| bytes[at % size] ^= 1 << (bit % 8));
            }
            Self::Overwrite(at, with) => {
                let at = at % size;
                let end = (at + with.len()).min(bytes.len());
                bytes[at..end].copy_from_slice(&with[..end - at]);
            }
            Self::Insert(at, with) => drop(bytes.splice(at % size..at % size, with.iter().copied())),
            Self::Replace(with) => bytes.clone_from(with),
            Self::Flip(_) => {}
        }
        bytes
    }
}

pub(crate) fn damage() -> impl Strategy<Value = Damage> {
    // Headers are where sizes stand: half of all damage is done to the first 400 bytes.
    let place = || prop_oneof![0..400_usize, any::<usize>()];
    let bytes = |most: usize| prop::collection::vec(any::<u8>(), 0..most);
    prop_oneof![
        2 => place().prop_map(Damage::Cut),
        6 => prop::collection::vec((place(), any::<u8>()), 1..4).prop_map(Damage::Flip),
        4 => (place(), bytes(8)).prop_map(|(at, with)| Damage::Overwrite(at, with)),
        2 => (place(), bytes(8)).prop_map(|(at, with)| Damage::Insert(at, with)),
        1 => bytes(200).prop_map(Damage::Replace),
    ]
}

/// Files of every kind, by the name that the small scene knows them under.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    use exr::prelude::{Blocks, Compression, Encoding, LineOrder};
    let noise = |c: usize, i: usize| ((i * 7919 + c * 104_729) % 1013) as f32 / 97.0;
    let mut files =
        vec![("quad.glb", quad()), ("quad.glb", skinned(|_, _| ())), ("scene.toml", SCENE.into())];
    let (mut json, bin) = quad_parts();
    json["buffers"][0]["uri"] = json!(format!("data:a;base64,{}", base64(&bin)));
    files.push(("quad.glb", json.to_string().into_bytes()));
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::DWAB(None),
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles((4, 4).into())] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            files.push(("env.exr", exr_with(16, 8, &["R", "G", "B"], encoding, noise)));
        }
    }
    let picture = RgbImage::from_fn(24, 16, |x, y| Rgb([(x * 10) as u8, (y * 15) as u8, (x * y) as u8]));
    files.push(("color.png", encode(picture.clone(), ImageFormat::Png)));
    files.push(("color.png", encode(picture.clone(), ImageFormat::Jpeg)));
    let bright = image::DynamicImage::from(picture).into_rgb32f();
    files.push(("env.exr", encode(bright, ImageFormat::Hdr)));
    files
}

/// A table of a scene file with values of any kind.
fn arbitrary_scene() -> impl Strategy<Value = String> {
    let value = prop_oneof![
        any::<f64>().prop_map(|x| format!("{x:?}").replace("NaN", "nan")),
        any::<i64>().prop_map(|x| x.to_string()),
        "[a-z_]{0,8}".prop_map(|s| format!("{s:?}")),
        prop::collection::vec(any::<f32>(), 0..18).prop_map(|v| format!("{v:?}").replace("NaN", "nan")),
        Just("true".to_owned()),
        Just("{}".to_owned()),
        Just("1979-05-27".to_owned()),
    ];
    let lines: Vec<&'static str> = SCENE.lines().collect();
    (0..lines.len(), value, "\\PC{0,40}", 0..4_u8).prop_map(move |(at, value, noise, how)| {
        let mut out = String::new();
        for (i, line) in lines.iter().enumerate() {
            match (i == at, how) {
                (false, _) | (true, 0) => out += line,
                (true, 1) => out += &noise,
                (true, _) => {
                    let key = line.split_once('=').map_or("time", |(key, _)| key);
                    writeln!(out, "{key} = {value}").unwrap();
                }
            }
            out.push('\n');
        }
        if how == 0 { out + &noise } else { out }
    })
}

/// Whatever `Scene::load` makes of it, it must say it in one paragraph, or hold finite numbers.
fn check_outcome(outcome: Result<(Scene, Vec<Warning>), SceneError>) -> Result<(), TestCaseError> {
    match outcome {
        Err(error) => {
            let message = error.to_string();
            prop_assert!(!message.contains('\n'), "{message}");
        }
        Ok((scene, _)) => {
            let posed = scene.mesh.pose();
            prop_assert!(posed.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
            prop_assert!(posed.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-5));
            let panorama = scene.environment.map(|e| e.panorama);
            let texels = panorama.iter().flat_map(|map| map.texels.iter().flatten());
            prop_assert!(texels.into_iter().all(|v| v.is_finite() && *v >= 0.0));
        }
    }
    Ok(())
}

#[test]
fn every_kind_of_file_is_read_when_it_is_whole() {
    use exr::prelude::{Blocks, Compression, LineOrder};
    let scene_folder = SceneFolder::new();
    // Noise of 300 lines: a DWAB block of 256, and a last one of 44 that may be stored as it is.
    let noise = |c: usize, i: usize| {
        f32::from_bits(0x3f80_0000 | ((i * 3 + c).wrapping_mul(2_654_435_761) & 0x7f_ffff) as u32)
    };
    let encoding = Encoding {
        compression: Compression::DWAB(None),
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut files = files();
    files.push(("env.exr", exr_with(3, 300, &["R", "G", "B", "id"], encoding, noise)));
    for (name, bytes) in files {
        let whole = std::fs::read(scene_folder.path(name)).unwrap();
        scene_folder.write(name, &bytes);
        scene_folder.load().unwrap_or_else(|error| panic!("{error}"));
        scene_folder.write(name, &whole);
    }
}

/// Run `check` on `cases` arbitrary values.
pub(crate) fn throw<S: Strategy>(
    cases: u32,
    values: &S,
    check: impl Fn(S::Value) -> Result<(), TestCaseError>,
) {
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    TestRunner::new(config).run(values, check).unwrap();
}

#[test]
fn no_scene_file_makes_the_reader_panic() {
    let scene_folder = SceneFolder::new();
    throw(1000, &arbitrary_scene(), |text| {
        scene_folder.write("scene.toml", text.as_bytes());
        check_outcome(scene_folder.load())
    });
}

#[test]
fn no_damage_to_any_file_makes_its_reader_panic() {
    let scene_folder = SceneFolder::new();
    let files = files();
    let which = any::<prop::sample::Index>();
    throw(2500, &(which, prop::collection::vec(damage(), 1..3)), |(which, damages)| {
        let (name, bytes) = which.get(&files);
        let whole = std::fs::read(scene_folder.path(name)).unwrap();
        scene_folder.write(name, &damages.iter().fold(bytes.clone(), |bytes, damage| damage.apply(bytes)));
        let outcome = scene_folder.load();
        scene_folder.write(name, &whole);
        check_outcome(outcome)
    });
}

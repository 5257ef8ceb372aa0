//! COLMAP's sparse models: `cameras` and `images`, as .txt or .bin (COLMAP's documentation, "Output Format").

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat4, DQuat, DVec3};

use super::{ImportedView, Intrinsics, Names, brown, damaged, turned_over};
use crate::error::{SceneError, read_bytes};
use crate::files;
use crate::lens::Distortion;

/// No file of a model above this many bytes is read.
const MOST_BYTES: u64 = 1 << 32;
/// Names of the models, by their numbers in binary files, and how many parameters each has.
const MODELS: [(&str, usize); 11] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
];

/// An image of the model: its quaternion (w, x, y, z) and translation take the world to the camera.
struct Posed {
    quaternion: [f64; 4],
    translation: [f64; 3],
    camera: u32,
    name: String,
}

/// The views of the model in `folder`, in the order of their pictures' names.
///
/// # Errors
/// When there is no model, it is damaged, or a camera has distortion of a kind that scenes do not know.
pub fn read(folder: &Path) -> Result<Vec<ImportedView>, SceneError> {
    let file = |name: &str| {
        let [binary, text] = ["bin", "txt"].map(|ending| folder.join(format!("{name}.{ending}")));
        let there = |path: &PathBuf| matches!(files::length(path), Ok(Some(_)));
        [binary, text].into_iter().find(there).ok_or_else(|| {
            let what = format!("has neither {name}.bin nor {name}.txt");
            SceneError::new(folder, what, "Name the folder of a sparse model, such as sparse/0")
        })
    };
    let (of_cameras, of_images) = (file("cameras")?, file("images")?);
    let bytes = read_bytes(&of_cameras, MOST_BYTES)?;
    let cameras = if is_binary(&of_cameras) {
        binary_cameras(&of_cameras, &bytes)?
    } else {
        text_cameras(&of_cameras, &bytes)?
    };
    let bytes = read_bytes(&of_images, MOST_BYTES)?;
    let mut images = if is_binary(&of_images) {
        binary_images(&of_images, &bytes)?
    } else {
        text_images(&of_images, &bytes)?
    };
    images.sort_by(|a, b| a.name.cmp(&b.name));
    let mut names = Names::new();
    let view = |image: Posed| {
        let picture = PathBuf::from(&image.name);
        let intrinsics = cameras.get(&image.camera).ok_or_else(|| {
            let what =
                format!("refers to camera {}, which {} does not hold", image.camera, of_cameras.display());
            damaged(&of_images, format!("image {}", image.name), what)
        })?;
        let [w, x, y, z] = image.quaternion;
        let rotation = DQuat::from_xyzw(x, y, z, w);
        let moved = rotation.is_finite() && DVec3::from(image.translation).is_finite();
        if !moved || rotation.length() <= 0.5 {
            return Err(damaged(&of_images, format!("image {}", image.name), "has a pose that is no motion"));
        }
        let pose = DMat4::from_rotation_translation(rotation.normalize(), image.translation.into());
        Ok(ImportedView { name: names.of(&picture), camera: intrinsics.placed(turned_over(pose)), picture })
    };
    images.into_iter().map(view).collect()
}

fn is_binary(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "bin")
}

/// The numbers of a camera of this model.
fn intrinsics(
    path: &Path,
    place: &str,
    model: &str,
    size: [u64; 2],
    p: &[f64],
) -> Result<Intrinsics, SceneError> {
    let known = MODELS.iter().find(|(name, _)| *name == model);
    let Some(&(_, count)) = known else {
        return Err(damaged(path, place, format!("has the unknown camera model {model}")));
    };
    if p.len() != count {
        return Err(damaged(path, place, format!("has {} parameters, and {model} has {count}", p.len())));
    }
    if p.iter().any(|x| !x.is_finite()) {
        return Err(damaged(path, place, "has a parameter that is not finite"));
    }
    let none = |k: &[f64]| k.iter().all(|x| *x == 0.0);
    let fisheye = |k: [f64; 4]| Some(Distortion::Fisheye { k });
    let (focal, centre, distortion) = match model {
        "SIMPLE_PINHOLE" => ([p[0]; 2], [p[1], p[2]], None),
        "PINHOLE" => ([p[0], p[1]], [p[2], p[3]], None),
        "SIMPLE_RADIAL" => ([p[0]; 2], [p[1], p[2]], brown([p[3], 0.0, 0.0], [0.0; 2])),
        "RADIAL" => ([p[0]; 2], [p[1], p[2]], brown([p[3], p[4], 0.0], [0.0; 2])),
        "OPENCV" => ([p[0], p[1]], [p[2], p[3]], brown([p[4], p[5], 0.0], [p[6], p[7]])),
        "OPENCV_FISHEYE" => ([p[0], p[1]], [p[2], p[3]], fisheye([p[4], p[5], p[6], p[7]])),
        "SIMPLE_RADIAL_FISHEYE" => ([p[0]; 2], [p[1], p[2]], fisheye([p[3], 0.0, 0.0, 0.0])),
        "RADIAL_FISHEYE" => ([p[0]; 2], [p[1], p[2]], fisheye([p[3], p[4], 0.0, 0.0])),
        "FULL_OPENCV" if none(&p[9..]) => {
            ([p[0], p[1]], [p[2], p[3]], brown([p[4], p[5], p[8]], [p[6], p[7]]))
        }
        _ => {
            let what = format!("has the camera model {model}, whose distortion no scene knows");
            let remedy = "Undistort the images (colmap image_undistorter), or solve again with OPENCV";
            return Err(SceneError::new(path, what, remedy).at(place));
        }
    };
    let side = |pixels: u64| u32::try_from(pixels).unwrap_or(0);
    Intrinsics { size: size.map(side), focal, centre, distortion }.checked(path, place)
}

/// Lines that hold something, with their numbers.
fn lines<'a>(path: &Path, bytes: &'a [u8]) -> Result<Vec<(usize, &'a str)>, SceneError> {
    let text = std::str::from_utf8(bytes).map_err(|_| damaged(path, "its text", "is not UTF-8"))?;
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line));
    Ok(numbered.filter(|(_, line)| !line.trim_start().starts_with('#')).collect())
}

fn text_cameras(path: &Path, bytes: &[u8]) -> Result<BTreeMap<u32, Intrinsics>, SceneError> {
    let mut cameras = BTreeMap::new();
    for (number, line) in lines(path, bytes)?.into_iter().filter(|(_, line)| !line.trim().is_empty()) {
        let place = format!("line {number}");
        let mut words = line.split_whitespace();
        let whole = |word: Option<&str>| word.and_then(|word| word.parse::<u64>().ok());
        let (id, model) = (whole(words.next()), words.next());
        let (width, height) = (whole(words.next()), whole(words.next()));
        let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
        let (Some(id), Some(model), Some(width), Some(height), Some(numbers)) =
            (id, model, width, height, numbers)
        else {
            return Err(damaged(
                path,
                place,
                "is no camera: its number, model, width, height and parameters",
            ));
        };
        let id = u32::try_from(id).map_err(|_| damaged(path, &place, "has a number beyond 32 bits"))?;
        let camera = intrinsics(path, &place, model, [width, height], &numbers)?;
        add(&mut cameras, (id, camera), path, &place)?;
    }
    Ok(cameras)
}

/// Add a camera, whose number no other has.
fn add(
    cameras: &mut BTreeMap<u32, Intrinsics>,
    (id, camera): (u32, Intrinsics),
    path: &Path,
    place: &str,
) -> Result<(), SceneError> {
    match cameras.insert(id, camera) {
        None => Ok(()),
        Some(_) => Err(damaged(path, place, format!("has the number {id}, as a camera before it"))),
    }
}

fn text_images(path: &Path, bytes: &[u8]) -> Result<Vec<Posed>, SceneError> {
    let mut images = Vec::new();
    // Every second line has an image's points, and may be empty.
    let lines = lines(path, bytes)?;
    let mut lines = lines.into_iter();
    while let Some((number, line)) = lines.next() {
        if line.trim().is_empty() {
            continue;
        }
        let refuse = || {
            damaged(
                path,
                format!("line {number}"),
                "is no image: its number, QW QX QY QZ, TX TY TZ, camera and name",
            )
        };
        let mut rest = line.trim_start();
        let mut words = Vec::new();
        for _ in 0..9 {
            let (word, behind) = rest.split_once(char::is_whitespace).ok_or_else(refuse)?;
            words.push(word);
            rest = behind.trim_start();
        }
        let number = |i: usize| words[i].parse::<f64>().map_err(|_| refuse());
        let camera = words[8].parse::<u32>().map_err(|_| refuse())?;
        let name = rest.trim_end().to_owned();
        if name.is_empty() {
            return Err(refuse());
        }
        let quaternion = [number(1)?, number(2)?, number(3)?, number(4)?];
        let translation = [number(5)?, number(6)?, number(7)?];
        images.push(Posed { quaternion, translation, camera, name });
        lines.next();
    }
    Ok(images)
}

/// Numbers out of bytes, little-endian.
struct Bytes<'a> {
    path: &'a Path,
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], SceneError> {
        let end = || damaged(self.path, "its end", "is cut short");
        let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(end)?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], SceneError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// Refuse what is left: a count that is too small hides all that is behind it.
    fn end(&self) -> Result<(), SceneError> {
        match self.rest.len() {
            0 => Ok(()),
            left => Err(damaged(self.path, "its end", format!("has {left} bytes more than it counts"))),
        }
    }

    fn u32(&mut self) -> Result<u32, SceneError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, SceneError> {
        self.array().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, SceneError> {
        self.array().map(f64::from_le_bytes)
    }
}

fn binary_cameras(path: &Path, bytes: &[u8]) -> Result<BTreeMap<u32, Intrinsics>, SceneError> {
    let mut bytes = Bytes { path, rest: bytes };
    let mut cameras = BTreeMap::new();
    for i in 0..bytes.u64()? {
        let place = format!("camera {i}");
        let (id, model) = (bytes.u32()?, bytes.u32()?);
        let size = [bytes.u64()?, bytes.u64()?];
        let Some(&(name, count)) = MODELS.get(model as usize) else {
            return Err(damaged(path, place, format!("has the unknown camera model {model}")));
        };
        let numbers: Vec<f64> = (0..count).map(|_| bytes.f64()).collect::<Result<_, _>>()?;
        let camera = intrinsics(path, &place, name, size, &numbers)?;
        add(&mut cameras, (id, camera), path, &place)?;
    }
    bytes.end()?;
    Ok(cameras)
}

fn binary_images(path: &Path, bytes: &[u8]) -> Result<Vec<Posed>, SceneError> {
    /// Two coordinates and the number of a point.
    const POINT: u64 = 24;
    let mut bytes = Bytes { path, rest: bytes };
    let mut images = Vec::new();
    for i in 0..bytes.u64()? {
        bytes.u32()?;
        let quaternion = [bytes.f64()?, bytes.f64()?, bytes.f64()?, bytes.f64()?];
        let translation = [bytes.f64()?, bytes.f64()?, bytes.f64()?];
        let camera = bytes.u32()?;
        let length = bytes.rest.iter().position(|byte| *byte == 0);
        let length =
            length.ok_or_else(|| damaged(path, format!("image {i}"), "has a name without an end"))?;
        let name = String::from_utf8_lossy(bytes.take(length)?).into_owned();
        bytes.take(1)?;
        let points = bytes.u64()?.checked_mul(POINT).and_then(|size| usize::try_from(size).ok());
        bytes.take(points.ok_or_else(|| damaged(path, format!("image {i}"), "is cut short"))?)?;
        images.push(Posed { quaternion, translation, camera, name });
    }
    bytes.end()?;
    Ok(images)
}

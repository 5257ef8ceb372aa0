//! A folder with a small but complete scene in it, and makers of the files that it is of.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

use std::io::Cursor;
use std::path::PathBuf;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
};
use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};
use skinfit::scene::{LoadOptions, Scene, SceneError, Warning};

/// A folder with a small but complete scene in it.
pub(crate) struct SceneFolder {
    folder: tempfile::TempDir,
}

pub(crate) const SCENE: &str = r#"
[mesh]
file = "quad.glb"
[maps]
color = "color.png"
normal = "normal.png"
specular = "data.png"
attenuator = "data.png"
[environment]
file = "env.exr"
[model]
[model.params]
[[view]]
name = "front"
world_to_camera = [1,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1]
fov_y_degrees = 30
width = 4
height = 4
target = "target.exr"
[fit]
[quality]
"#;

impl SceneFolder {
    pub(crate) fn new() -> Self {
        let scene_folder = Self { folder: tempfile::tempdir().unwrap() };
        scene_folder.write("quad.glb", &quad());
        scene_folder.write("color.png", &png(4, 4, [200, 100, 0]));
        scene_folder.write("normal.png", &png(4, 4, [128, 64, 255]));
        scene_folder.write("data.png", &png(4, 4, [51, 0, 0]));
        scene_folder.write("mask.png", &png(4, 4, [255, 0, 0]));
        scene_folder.write("env.exr", &exr(8, 4, &["R", "G", "B"], |_, _| 0.5));
        scene_folder.write("target.exr", &exr(4, 4, &["R", "G", "B", "A"], |_, _| 0.25));
        scene_folder.write("scene.toml", SCENE.as_bytes());
        scene_folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    /// Load the scene with the first `from` replaced by `to`.
    pub(crate) fn edited(&self, from: &str, to: &str) -> Result<(Scene, Vec<Warning>), SceneError> {
        assert!(SCENE.contains(from), "{from}");
        self.write("scene.toml", SCENE.replacen(from, to, 1).as_bytes());
        self.load()
    }

    pub(crate) fn load(&self) -> Result<(Scene, Vec<Warning>), SceneError> {
        Scene::load(&self.path("scene.toml"), &LoadOptions::default())
    }
}

pub(crate) fn png(width: u32, height: u32, color: [u8; 3]) -> Vec<u8> {
    encode(RgbImage::from_pixel(width, height, Rgb(color)), ImageFormat::Png)
}

pub(crate) fn encode(image: impl Into<image::DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

pub(crate) fn exr(
    width: usize,
    height: usize,
    names: &[&str],
    value: impl Fn(usize, usize) -> f32,
) -> Vec<u8> {
    exr_with(width, height, names, Encoding::SMALL_LOSSLESS, value)
}

/// An EXR file whose channel `c` is `value(c, pixel)`.
pub(crate) fn exr_with(
    width: usize,
    height: usize,
    names: &[&str],
    encoding: Encoding,
    value: impl Fn(usize, usize) -> f32,
) -> Vec<u8> {
    let channel = |(c, name): (usize, &&str)| {
        let plane = (0..width * height).map(|i| value(c, i)).collect();
        AnyChannel::new(*name, FlatSamples::F32(plane))
    };
    let channels = AnyChannels::sort(names.iter().enumerate().map(channel).collect());
    let layer = Layer::new((width, height), LayerAttributes::named("layer"), encoding, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// The JSON and the binary chunk of a unit quad.
pub(crate) fn quad_parts() -> (Value, Vec<u8>) {
    let mut bin = Vec::new();
    let mut put = |values: &[f32]| values.iter().for_each(|v| bin.extend(v.to_le_bytes()));
    put(&[-1., -1., 0., 1., -1., 0., 1., 1., 0., -1., 1., 0.]);
    put(&[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    put(&[0., 1., 1., 1., 1., 0., 0., 0.]);
    // Bone weights that sum to 0.5, and a morph target.
    put(&[0.5, 0., 0., 0., 0.5, 0., 0., 0., 0.5, 0., 0., 0., 0.5, 0., 0., 0.]);
    put(&[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    for index in [0_u16, 1, 2, 0, 2, 3] {
        bin.extend(index.to_le_bytes());
    }
    bin.extend([0_u8; 16]);
    let view =
        |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let floats = |view: usize, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": 4, "type": kind});
    let json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"name": "quad", "primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 5,
        }]}],
        "buffers": [{"byteLength": bin.len()}],
        "bufferViews": [view(0, 48), view(48, 48), view(96, 32), view(128, 64), view(192, 48), view(240, 12), view(252, 16)],
        "accessors": [
            floats(0, "VEC3"), floats(1, "VEC3"), floats(2, "VEC2"), floats(3, "VEC4"), floats(4, "VEC3"),
            {"bufferView": 5, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 6, "componentType": 5121, "count": 4, "type": "VEC4"},
        ],
    });
    (json, bin)
}

pub(crate) fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF".to_vec();
    let word = |out: &mut Vec<u8>, n: usize| out.extend((n as u32).to_le_bytes());
    word(&mut out, 2);
    word(&mut out, 12 + 8 + text.len() + 8 + bin.len());
    word(&mut out, text.len());
    out.extend(b"JSON");
    out.extend(&text);
    word(&mut out, bin.len());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

pub(crate) fn quad() -> Vec<u8> {
    let (json, bin) = quad_parts();
    glb(&json, &bin)
}

/// A quad whose JSON and bytes were tampered with.
pub(crate) fn tampered(change: impl Fn(&mut Value, &mut Vec<u8>)) -> Vec<u8> {
    let (mut json, mut bin) = quad_parts();
    change(&mut json, &mut bin);
    glb(&json, &bin)
}

/// A quad with two bones.
pub(crate) fn skinned(change: impl Fn(&mut Value, &mut Vec<u8>)) -> Vec<u8> {
    tampered(|json, bin| {
        json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"translation": [0, 3, 0]}, {}]);
        json["scenes"][0]["nodes"] = json!([0, 1, 2]);
        json["skins"] = json!([{"joints": [1, 2]}]);
        let attributes = json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap();
        attributes.insert("WEIGHTS_0".into(), json!(3));
        attributes.insert("JOINTS_0".into(), json!(6));
        change(json, bin);
    })
}

pub(crate) fn base64(bytes: &[u8]) -> String {
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digit = |n: u32, shift: u32| digits[(n >> shift & 63) as usize] as char;
    let group = |g: &[u8]| {
        let n = g.iter().fold(0, |n, &b| n << 8 | u32::from(b)) << (8 * (3 - g.len()));
        let all: String = [18, 12, 6, 0].map(|shift| digit(n, shift)).iter().take(g.len() + 1).collect();
        format!("{all:=<4}")
    };
    bytes.chunks(3).map(group).collect()
}

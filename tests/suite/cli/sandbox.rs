//! A small scene in a folder of its own, and the program run on it.

use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};
use skinfit::render::files::{Image, ImageOptions, write_exr};
use tempfile::TempDir;

/// The scene file. Cubes are small and rays few: a run takes some hundredths of a second.
pub(crate) const SCENE: &str = r#"# a comment
[mesh]
file = "mesh.glb"
[maps]
color = "color.png"
normal = "normal.png"
specular = "specular.png"
attenuator = "attenuator.png"
[environment]
file = "env.exr"
[model]
form = "corrected"
silhouette = "fragment"
effects = ["diffuse", "normal_map", "occlusion", "rim", "side_specular", "hilite", "reflection"]
[model.params]
hilite = 0.7
[[view]]
name = "front"
world_to_camera = [1,0,0,0, 0,1,0,0, 0,0,1,-4, 0,0,0,1]
fov_y_degrees = 35.0
width = 32
height = 32
target = "targets/front.exr"
[[view]]
name = "side"
world_to_camera = [0,0,-1,0, 0,1,0,0, 1,0,0,-4, 0,0,0,1]
fov_y_degrees = 35.0
width = 32
height = 24
target = "targets/side.exr"
[fit]
free = ["base_weight", "rim_weight", "rim_exponent", "side_specular", "hilite", "reflection", "occlusion", "specular_lobe"]
loss = "relative_l2"
[quality]
samples_per_axis = 1
irradiance_size = 8
lobe_size = 8
hilite_size = 16
occlusion_rays = 32
"#;

/// The parameters that the targets are rendered with.
pub(crate) const TRUTH: &str = r#"form = "corrected"
[params]
base_weight = 0.8
rim_weight = 0.9
rim_exponent = 3.0
side_specular = 0.4
hilite = 0.5
reflection = 0.1
occlusion = 0.7
specular_lobe = 12.0
"#;

/// A folder with the scene, and one for its bakes.
pub(crate) struct Sandbox {
    folder: TempDir,
    cache: PathBuf,
    /// The cache's folder, where it is of this sandbox alone.
    _own: Option<TempDir>,
}

/// What the program said, and how it ended.
#[derive(Debug)]
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Sandbox {
    /// The scene with its targets, which the program itself renders once for all tests.
    pub(crate) fn new() -> Self {
        static TARGETS: OnceLock<Vec<(String, Vec<u8>)>> = OnceLock::new();
        let sandbox = Self::without_targets();
        let targets = TARGETS.get_or_init(|| {
            let sandbox = Self::without_targets();
            let render = |view: &str| {
                let path = format!("targets/{view}.exr");
                let render = ["render", "scene.toml", "--engine", "cpu", "--params", "truth.toml"];
                sandbox.run(&[&render[..], &["--view", view, "-o", &path]].concat()).done();
                (path.clone(), sandbox.read(&path))
            };
            vec![render("front"), render("side")]
        });
        targets.iter().for_each(|(name, bytes)| sandbox.write(name, bytes));
        sandbox
    }

    /// The same, with the bakes that all tests share: of scenes that others bake, too.
    pub(crate) fn with_shared_bakes() -> Self {
        Self { cache: crate::graphics::bench::cache(), _own: None, ..Self::new() }
    }

    fn without_targets() -> Self {
        let (folder, own) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let sandbox = Self { folder, cache: own.path().to_owned(), _own: Some(own) };
        sandbox.write("scene.toml", SCENE.as_bytes());
        sandbox.write("truth.toml", TRUTH.as_bytes());
        sandbox.write("mesh.glb", &mesh(|_, _| {}));
        let wave = |x: u32, k: f32| 0.5 + 0.4 * (k * x as f32).sin();
        sandbox.write("color.png", &png(|x, y| [0.8, wave(x, 0.7), wave(y, 1.1)]));
        sandbox.write("normal.png", &png(|x, y| [0.4 + 0.2 * wave(x, 1.3), 0.4 + 0.2 * wave(y, 0.9), 0.97]));
        sandbox.write("specular.png", &png(|x, y| [wave(x + y, 0.5); 3]));
        sandbox.write("attenuator.png", &png(|x, y| [wave(x + 2 * y, 0.8); 3]));
        let sky = |x: usize, y: usize| {
            let sun = if (20..22).contains(&x) && (4..6).contains(&y) { 20.0 } else { 0.0 };
            [0.3 + sun + 0.02 * x as f32, 0.4 + 0.5 * sun, 1.0 - 0.05 * y as f32 + 0.2 * sun]
        };
        sandbox.write_exr("env.exr", 32, 16, sky);
        sandbox
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub(crate) fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).unwrap()
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap()
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    pub(crate) fn remove(&self, name: &str) {
        std::fs::remove_file(self.path(name)).unwrap();
    }

    /// The scene with the first `from` replaced by `to`.
    pub(crate) fn edit(&self, from: &str, to: &str) {
        let text = self.text("scene.toml");
        assert!(text.contains(from), "{from} is not in the scene");
        self.write("scene.toml", text.replacen(from, to, 1).as_bytes());
    }

    /// An EXR that [`render::files`](skinfit::render::files) would refuse to write may hold NaN.
    pub(crate) fn write_exr(
        &self,
        name: &str,
        width: usize,
        height: usize,
        rgb: impl Fn(usize, usize) -> [f32; 3] + Sync,
    ) {
        use exr::prelude::{Encoding, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};
        let pixel = |Vec2(x, y): Vec2<usize>| {
            let [r, g, b] = rgb(x, y);
            (r, g, b)
        };
        let channels = SpecificChannels::rgb(pixel);
        let layer =
            Layer::new((width, height), LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
        let mut bytes = Cursor::new(Vec::new());
        exr::prelude::Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
        self.write(name, bytes.get_ref());
    }

    /// An image of one grey with full coverage.
    pub(crate) fn write_grey(&self, name: &str, width: usize, height: usize) {
        let mut image = Image::new(width, height);
        image.rgb.fill([0.5; 3]);
        image.alpha.fill(1.0);
        write_exr(&self.path(name), &image, &ImageOptions::default()).unwrap();
    }

    /// Every file below the folder, with its content.
    pub(crate) fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        files(self.folder.path())
    }

    pub(crate) fn cache(&self) -> &Path {
        &self.cache
    }

    /// The program on `arguments`, in the scene's folder.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = program(&self.cache);
        command.args(arguments).current_dir(self.folder.path());
        command
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Ran {
        Ran::of(&mut self.command(arguments))
    }

    /// Fit the scene into `run`.
    pub(crate) fn fit(&self, run: &str, more: &[&str]) -> Ran {
        self.run(&[&["fit", "scene.toml", "-o", run], more].concat())
    }
}

/// The program, with its bakes in `cache`.
pub(crate) fn program(cache: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_skinfit"));
    command.env("SKINFIT_CACHE", cache).stdin(Stdio::null());
    command
}

impl Ran {
    pub(crate) fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        let ran = Self { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) };
        assert!(!ran.err.contains("panicked"), "{ran:?}");
        ran
    }

    /// Ended well, and without a warning.
    pub(crate) fn done(self) -> Self {
        assert_eq!((self.code, self.err.as_str()), (Some(0), ""), "{self:?}");
        self
    }

    /// Refused in one paragraph that holds all of `words`.
    pub(crate) fn refused(self, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(2), "{self:?}");
        assert_eq!(self.out, "", "{self:?}");
        assert!(self.err.starts_with("skinfit: ") && self.err.ends_with(".\n"), "{self:?}");
        assert_eq!(self.err.lines().count(), 1, "not one paragraph: {self:?}");
        assert!(!self.err.contains("..\n") && !self.err.contains("  "), "untidy: {self:?}");
        for word in words {
            assert!(self.err.contains(word), "{word:?} is not said: {self:?}");
        }
        self
    }
}

/// Every file below `folder`, with its content; folders as well, as nothing.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
            found.insert(path, Vec::new());
        } else {
            found.insert(path.clone(), std::fs::read(path).unwrap());
        }
    }
    found
}

/// A picture of 16 x 16 pixels.
pub(crate) fn png(color: impl Fn(u32, u32) -> [f32; 3]) -> Vec<u8> {
    let pixel = |x, y| Rgb(color(x, y).map(|c| (255.0 * c) as u8));
    let mut bytes = Cursor::new(Vec::new());
    RgbImage::from_fn(16, 16, pixel).write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const AROUND: usize = 24;
const DOWN: usize = 16;

/// A ball with three grooves, so that occlusion varies: positions and texture coordinates.
fn ball() -> (Vec<[f32; 3]>, Vec<[f32; 2]>) {
    let mut vertices = (Vec::new(), Vec::new());
    for row in 0..=DOWN {
        for column in 0..=AROUND {
            let (u, v) = (column as f32 / AROUND as f32, row as f32 / DOWN as f32);
            // The seam's two sides stand at one place to the bit.
            let (azimuth, polar) = (2.0 * PI * (column % AROUND) as f32 / AROUND as f32, PI * v);
            let radius = 0.8 + 0.2 * (3.0 * azimuth).cos() * polar.sin().powi(2);
            let (x, z) = (polar.sin() * azimuth.sin(), polar.sin() * azimuth.cos());
            vertices.0.push([radius * x, radius * polar.cos(), radius * z]);
            vertices.1.push([u, v]);
        }
    }
    vertices
}

/// The ball as a .glb, its JSON and its bytes tampered with by `change`. Accessors: 0 positions,
/// 1 texture coordinates, 2 indices, 3 joints, 4 weights (the latter two unused).
pub(crate) fn mesh(change: impl Fn(&mut Value, &mut Vec<u8>)) -> Vec<u8> {
    let (positions, uvs) = ball();
    let count = positions.len();
    let mut indices: Vec<u16> = Vec::new();
    for row in 0..DOWN {
        for column in 0..AROUND {
            let a = (row * (AROUND + 1) + column) as u16;
            let b = a + AROUND as u16 + 1;
            // At the poles, one of the two triangles has no area.
            if row + 1 < DOWN {
                indices.extend([a, b, b + 1]);
            }
            if row > 0 {
                indices.extend([a, b + 1, a + 1]);
            }
        }
    }
    let mut bin: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut put = |bytes: &[u8]| {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len()}));
        bin.extend(bytes);
    };
    put(bytemuck::cast_slice(&positions));
    put(bytemuck::cast_slice(&uvs));
    put(bytemuck::cast_slice(&indices));
    put(&[0_u8; 4].repeat(count));
    put(bytemuck::cast_slice(&[[1.0_f32, 0.0, 0.0, 0.0]].repeat(count)));
    let accessor = |view: usize, component: u32, count: usize, kind: &str| json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
    let mut json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"name": "ball", "primitives": [{
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2,
        }]}],
        "buffers": [{"byteLength": bin.len()}], "bufferViews": views,
        "accessors": [
            accessor(0, 5126, count, "VEC3"), accessor(1, 5126, count, "VEC2"),
            accessor(2, 5123, indices.len(), "SCALAR"),
            accessor(3, 5121, count, "VEC4"), accessor(4, 5126, count, "VEC4"),
        ],
    });
    change(&mut json, &mut bin);
    glb(&json, bin)
}

fn glb(json: &Value, mut bin: Vec<u8>) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = word(12 + 8 + text.len() + 8 + bin.len());
    [b"glTF", &word(2)[..], &length, &word(text.len()), b"JSON", &text, &word(bin.len()), b"BIN\0", &bin]
        .concat()
}

//! Small readers of the shared material, independent of the program's own, and scenes by hand.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::path::Path;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DMat4, Vec2, Vec3, Vec4};
use serde_json::Value;
use skinfit::model::bounds::Bounds;
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{Effects, Form, Lookups, Silhouette};
use skinfit::model::params::Params;
use skinfit::scene::diffusion::Diffusion;
use skinfit::scene::maps::{Environment, Map, Maps, Spots};
use skinfit::scene::mesh::{Mesh, PosedMesh};
use skinfit::scene::view::{Background, Camera, View};
use skinfit::scene::{Bloom, FitSettings, Loss, MapSettings, Quality, Scene, ShadowMaps};

/// The named planes of an EXR file, and its width and height.
pub(crate) struct Planes {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) planes: BTreeMap<String, Vec<f32>>,
}

pub(crate) fn read_exr(path: &Path) -> Planes {
    use exr::prelude::*;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .unwrap();
    let layer = image.layer_data;
    let planes = (layer.channel_data.list.iter())
        .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()))
        .collect();
    Planes { width: layer.size.width(), height: layer.size.height(), planes }
}

impl Planes {
    /// Three planes as an image.
    pub(crate) fn rgb(&self, names: [&str; 3]) -> Vec<[f32; 3]> {
        let planes = names.map(|name| &self.planes[name]);
        (0..planes[0].len()).map(|i| planes.map(|plane| plane[i])).collect()
    }
}

pub(crate) fn environment(path: &Path, rotation_degrees: f64) -> Environment {
    let planes = read_exr(path);
    let texels = planes.rgb(["R", "G", "B"]);
    let panorama = Map { width: planes.width, height: planes.height, texels };
    Environment { panorama, rotation_degrees, intensity: 1.0, spots: Spots::default() }
}

pub(crate) fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// Nested arrays of numbers, flattened.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// The first primitive of a .glb, node transforms left out (the head's is the identity to 1e-7),
/// with MikkTSpace tangents where vertices of one place agree.
pub(crate) fn head(folder: &Path) -> PosedMesh {
    let gltf = gltf::Gltf::open(folder.join("head/head.glb")).unwrap();
    let blob = gltf.blob.as_deref().unwrap();
    let primitive = gltf.document.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(blob));
    let positions: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from).collect();
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    let mut mesh = PosedMesh {
        tangents: vec![Vec4::ZERO; positions.len()],
        positions,
        normals: reader.read_normals().unwrap().map(Vec3::from).collect(),
        uvs: reader.read_tex_coords(0).unwrap().into_f32().map(Vec2::from).collect(),
        triangles: indices.as_chunks::<3>().0.to_vec(),
        ..PosedMesh::default()
    };
    generate_tangents(&mut Corners(&mut mesh)).unwrap();
    for i in 0..mesh.normals.len() {
        // Orthogonal to the normal, as the vertex stage leaves it.
        let (n, t) = (mesh.normals[i].normalize(), mesh.tangents[i]);
        mesh.normals[i] = n;
        mesh.tangents[i] = (t.truncate() - n * n.dot(t.truncate())).normalize().extend(t.w);
    }
    mesh
}

struct Corners<'a>(&'a mut PosedMesh);

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.0.triangles[face][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.0.triangles.len()
    }
    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }
    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.0.positions[self.vertex(face, vert)].to_array()
    }
    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.0.normals[self.vertex(face, vert)].to_array()
    }
    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        // glTF's v runs downwards; the bitangent runs up the image.
        let uv = self.0.uvs[self.vertex(face, vert)];
        [uv.x, 1.0 - uv.y]
    }
    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        let tangent = Vec4::from(space.unwrap_or_default().tangent_encoded());
        let vertex = self.vertex(face, vert);
        self.0.tangents[vertex] = tangent;
    }
}

/// A camera as scene files write it.
pub(crate) fn camera(rows: [f64; 16], fov_y_degrees: f64, size: u32) -> Camera {
    let world_to_camera = DMat4::from_cols_array(&rows).transpose();
    Camera::pinhole(world_to_camera, fov_y_degrees.to_radians(), [size, size])
}

/// The three cameras of the scanned head's scenes, read from the scene file.
pub(crate) fn head_views(folder: &Path) -> Vec<View> {
    let text = std::fs::read_to_string(folder.join("lps_forest/scene.toml")).unwrap();
    let table: toml::Table = text.parse().unwrap();
    let number = |value: &toml::Value| value.as_float().unwrap_or_else(|| value.as_integer().unwrap() as f64);
    (table["view"].as_array().unwrap().iter())
        .map(|view| {
            let rows: Vec<f64> = view["world_to_camera"].as_array().unwrap().iter().map(number).collect();
            let size = view["width"].as_integer().unwrap() as u32;
            View {
                name: view["name"].as_str().unwrap().to_owned(),
                camera: camera(rows.try_into().unwrap(), number(&view["fov_y_degrees"]), size),
                target: None,
                background: Background::None,
            }
        })
        .collect()
}

/// A scene of nothing but its switches.
pub(crate) fn bare_scene(effects: Effects) -> Scene {
    Scene {
        path: "test/scene.toml".into(),
        mesh: Mesh::default(),
        metres_per_unit: 1.0,
        maps: Maps::default(),
        environment: None,
        form: Form::Corrected,
        silhouette: Silhouette::Fragment,
        lookups: Lookups::default(),
        choices: skinfit::model::choices::Choices::default(),
        dapple: Dapple::default(),
        effects,
        params: Params::defaults(Form::Corrected),
        views: Vec::new(),
        fit: FitSettings {
            white_balance: false,
            free: Vec::new(),
            bounds: Bounds::default(),
            loss: Loss::L2,
            free_gains: false,
            cameras: false,
            maps: MapSettings::default(),
        },
        quality: Quality::default(),
        shadow_maps: ShadowMaps::default(),
        bloom: Bloom::default(),
        lights: Vec::new(),
        sky_lights: Vec::new(),
        diffusion: Diffusion::default(),
    }
}

/// Pearson's correlation.
pub(crate) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 { a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum() };
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

/// The value below which a share `q` of `values` lies.
pub(crate) fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

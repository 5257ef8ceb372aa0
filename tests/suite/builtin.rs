//! The built-in scene, through its files.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use glam::{Vec2, Vec3, Vec4};
use skinfit::builtin;

const FILES: [&str; 7] = [
    "scene.toml",
    "head.glb",
    "color.png",
    "normal.png",
    "specular.png",
    "attenuator.png",
    "environment.exr",
];

/// The scene, written once for all tests.
static SCENE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    builtin::write(folder.path()).unwrap();
    folder
});

fn bytes(folder: &Path) -> BTreeMap<&'static str, Vec<u8>> {
    FILES.into_iter().map(|file| (file, std::fs::read(folder.join(file)).unwrap())).collect()
}

struct Head {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tangents: Vec<Vec4>,
    uvs: Vec<Vec2>,
    weights: Vec<[f32; 4]>,
    joints: Vec<[u16; 4]>,
    triangles: Vec<[u32; 3]>,
    morphs: Vec<(Vec<Vec3>, Vec<Vec3>)>,
    document: gltf::Document,
}

static HEAD: LazyLock<Head> = LazyLock::new(|| {
    // `from_slice` validates the document.
    let gltf = gltf::Gltf::from_slice(&std::fs::read(SCENE.path().join("head.glb")).unwrap()).unwrap();
    let blob = gltf.blob.unwrap();
    let primitive = gltf.document.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(&blob));
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    let morphs = reader.read_morph_targets().map(|(positions, normals, _)| {
        let collect = |deltas: Option<gltf::mesh::util::ReadPositions<'_>>| {
            deltas.unwrap().map(Vec3::from).collect::<Vec<_>>()
        };
        (collect(positions), normals.unwrap().map(Vec3::from).collect())
    });
    Head {
        positions: reader.read_positions().unwrap().map(Vec3::from).collect(),
        normals: reader.read_normals().unwrap().map(Vec3::from).collect(),
        tangents: reader.read_tangents().unwrap().map(Vec4::from).collect(),
        uvs: reader.read_tex_coords(0).unwrap().into_f32().map(Vec2::from).collect(),
        weights: reader.read_weights(0).unwrap().into_f32().collect(),
        joints: reader.read_joints(0).unwrap().into_u16().collect(),
        triangles: indices.chunks(3).map(|c| [c[0], c[1], c[2]]).collect(),
        morphs: morphs.collect(),
        document: gltf.document.clone(),
    }
});

#[test]
fn builtin_bytes_are_the_same_again_and_for_any_thread_count() {
    // Written by as many threads as there are processors.
    let once = bytes(SCENE.path());
    let folder = tempfile::tempdir().unwrap();
    let threads = if rayon::current_num_threads() == 1 { 2 } else { 1 };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| builtin::write(folder.path())).unwrap();
    for (file, again) in bytes(folder.path()) {
        assert!(once[file] == again, "{file} differs with {threads} threads");
    }
}

#[test]
fn builtin_files_are_below_10_megabytes_and_nothing_else_is_written() {
    let total: usize = bytes(SCENE.path()).values().map(Vec::len).sum();
    assert!(total < 10_000_000, "{total} bytes");
    assert_eq!(std::fs::read_dir(SCENE.path()).unwrap().count(), FILES.len());
}

#[test]
fn builtin_head_is_finite_unit_and_has_its_morphs_and_bones() {
    let head = &*HEAD;
    assert!(head.positions.len() >= 20_000, "{} vertices", head.positions.len());
    assert!(head.positions.iter().all(|p| p.is_finite() && p.length() < 0.5));
    // f32 rounding of unit vectors.
    assert!(head.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    for (tangent, normal) in head.tangents.iter().zip(&head.normals) {
        assert!((tangent.truncate().length() - 1.0).abs() < 1e-5 && tangent.w.abs() == 1.0);
        // MikkTSpace projects each corner's tangent into the plane of the normal.
        assert!(tangent.truncate().dot(*normal).abs() < 1e-4);
    }
    assert_eq!(head.morphs.len(), 5);
    for (positions, normals) in &head.morphs {
        let moved = positions.iter().filter(|d| **d != Vec3::ZERO).count();
        // A local field: some of the face, and no more than half of the bust.
        assert!(moved > 500 && moved < head.positions.len() / 2, "{moved} moved");
        assert!(positions.iter().all(|d| d.is_finite() && d.length() < 0.03));
        for (delta, normal) in normals.iter().zip(&head.normals) {
            // The sum is unit by construction; twice the rounding of f32.
            assert!(((*delta + *normal).length() - 1.0).abs() < 1e-5);
        }
    }
    let mesh = head.document.meshes().next().unwrap();
    assert!(mesh.extras().as_ref().unwrap().get().contains("\"targetNames\":[\"smile\",\"mouth_open\""));
    let skin = head.document.skins().next().unwrap();
    let names: Vec<_> = skin.joints().map(|joint| joint.name().unwrap().to_owned()).collect();
    assert_eq!(names, ["root", "neck", "skull"]);
    let nod = head.document.animations().next().unwrap();
    assert_eq!((nod.name(), nod.channels().count()), (Some("nod"), 3));
    for (weights, joints) in head.weights.iter().zip(&head.joints) {
        // Three f32 additions.
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6 && weights.iter().all(|w| *w >= 0.0));
        assert!(joints.iter().all(|&j| j < 3));
    }
    // Somewhere each bone rules, and between them the weights are shared.
    for joint in 0..3 {
        assert!(head.weights.iter().any(|w| w[joint] > 0.95), "joint {joint}");
    }
}

#[test]
fn builtin_head_is_closed_and_faces_outwards() {
    let head = &*HEAD;
    // Seams split vertices: welded by position, each edge has a triangle on either side.
    let key = |i: u32| head.positions[i as usize].to_array().map(f32::to_bits);
    let mut edges: BTreeMap<_, i32> = BTreeMap::new();
    let (mut volume, mut inwards) = (0.0, 0);
    for t in &head.triangles {
        let [a, b, c] = t.map(|i| head.positions[i as usize].as_dvec3());
        let facing = (b - a).cross(c - a);
        // A square micrometre: a thousandth of the finest cell's edge, squared.
        assert!(facing.length() > 1e-12, "degenerate triangle at {a}");
        volume += a.dot(b.cross(c)) / 6.0;
        let normal = t.iter().map(|&i| head.normals[i as usize].as_dvec3()).sum::<glam::DVec3>();
        inwards += u32::from(facing.dot(normal) <= 0.0);
        for k in 0..3 {
            let (from, to) = (key(t[k]), key(t[(k + 1) % 3]));
            *edges.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    assert_eq!(edges.values().filter(|&&sum| sum != 0).count(), 0, "edges without a partner");
    // A head of 4 to 5 litres, and as much again of neck and cut-off chest.
    assert!(volume > 0.006 && volume < 0.020, "{volume} cubic metres");
    // In creases finer than the grid (between the lips, in the ear's folds) a few fold over.
    assert!(inwards * 1000 < head.triangles.len() as u32, "{inwards} triangles face inwards");
}

#[test]
fn builtin_head_has_the_measures_of_a_head() {
    let top = HEAD.positions.iter().map(|p| p.y).fold(f32::MIN, f32::max);
    let in_head = || HEAD.positions.iter().filter(|p| p.y > -0.02);
    let width = in_head().map(|p| p.x.abs()).fold(0.0, f32::max) * 2.0;
    let length = in_head().map(|p| p.z).fold(0.0, f32::max) - in_head().map(|p| p.z).fold(0.0, f32::min);
    // Eyes at y = 0: half a head of 0.23 m above them; 0.18 m across the ears; 0.2 m long.
    assert!((top - 0.115).abs() < 0.006, "{top}");
    assert!((width - 0.18).abs() < 0.02, "{width}");
    assert!((length - 0.20).abs() < 0.02, "{length}");
}

#[test]
fn builtin_atlas_has_margins_and_charts_that_do_not_overlap() {
    const SIZE: usize = 1024;
    let head = &*HEAD;
    // Half the margin of 6 texels, for what is interpolated and filtered.
    let margin = 3.0 / SIZE as f32;
    assert!(head.uvs.iter().all(|uv| uv.min_element() > margin && uv.max_element() < 1.0 - margin));
    let mut count = vec![0_u8; SIZE * SIZE];
    let mut mirrored = 0;
    for t in &head.triangles {
        let [a, b, c] = t.map(|i| head.uvs[i as usize].as_dvec2() * SIZE as f64);
        // v runs downwards, so a chart that is not mirrored turns the other way round.
        let area = (b - a).perp_dot(c - a);
        mirrored += u32::from(area >= 0.0);
        let (low, high) = (a.min(b).min(c).floor(), a.max(b).max(c).ceil());
        for y in low.y as usize..high.y as usize {
            for x in low.x as usize..high.x as usize {
                let p = glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let side = |a: glam::DVec2, b: glam::DVec2| (b - a).perp_dot(p - a) * area.signum();
                if side(a, b).min(side(b, c)).min(side(c, a)) > 1e-9 {
                    count[y * SIZE + x] += 1;
                }
            }
        }
    }
    let covered = count.iter().filter(|&&n| n > 0).count();
    let twice = count.iter().filter(|&&n| n > 1).count();
    assert!(covered * 100 > 45 * count.len(), "only {covered} texels are used");
    // One in 5000: folds of a texel or two in the ears.
    assert!(twice * 5000 < covered, "{twice} of {covered} texels are covered twice");
    assert!(mirrored * 1000 < head.triangles.len() as u32, "{mirrored} triangles are mirrored");
    // Cut into charts: some positions have more than one place in the atlas, most have one.
    let mut places: BTreeMap<_, u32> = BTreeMap::new();
    for position in &head.positions {
        *places.entry(position.to_array().map(f32::to_bits)).or_default() += 1;
    }
    let split = places.values().filter(|&&n| n > 1).count();
    assert!(split > 300 && split * 10 < places.len(), "{split} vertices on seams");
}

#[test]
fn builtin_maps_hold_skin() {
    let map = |file: &str| image::open(SCENE.path().join(file)).unwrap();
    let mean = |pixels: &mut dyn Iterator<Item = u8>| {
        let (sum, count) = pixels.fold((0.0, 0.0), |(s, n), x| (s + f64::from(x), n + 1.0));
        sum / count / 255.0
    };
    let color = map("color.png").to_rgb8();
    let rgb = [0, 1, 2].map(|c| mean(&mut color.pixels().map(|p| p[c])));
    // Skin is reddest, then green, then blue, whatever its shade.
    assert!(rgb[0] > rgb[1] + 0.05 && rgb[1] > rgb[2] + 0.02, "{rgb:?}");
    let normal = map("normal.png").to_rgb8();
    for p in normal.pixels() {
        let n = Vec3::from(p.0.map(|x| f32::from(x) / 255.0 * 2.0 - 1.0));
        // Three channels rounded to 1/255 of a length of 2.
        assert!((n.length() - 1.0).abs() < 0.02 && n.z > 0.0, "{n}");
    }
    let slopes = mean(&mut normal.pixels().map(|p| p[0].abs_diff(128)));
    assert!(slopes > 0.005, "the normal map is flat: {slopes}");
    for (file, low, high) in [("specular.png", 0.05, 0.6), ("attenuator.png", 0.2, 0.7)] {
        let map = map(file).to_luma8();
        let mean = mean(&mut map.pixels().map(|p| p[0]));
        assert!(mean > low && mean < high, "{file}: mean {mean}");
    }
}

#[test]
fn builtin_environment_has_its_sun_behind_the_head() {
    let path = SCENE.path().join("environment.exr");
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![[0.0_f32; 3]; size.area()]),
        |(width, texels), at, (r, g, b, _): (f32, f32, f32, f32)| {
            texels[at.y() * *width + at.x()] = [r, g, b];
        },
    )
    .unwrap();
    let (width, texels) = image.layer_data.channel_data.pixels;
    assert_eq!(texels.len(), width * width / 2);
    assert!(texels.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
    let brightest = (0..texels.len()).max_by(|&a, &b| texels[a][1].total_cmp(&texels[b][1])).unwrap();
    let (u, v) = (brightest % width, brightest / width);
    // -Z is the middle column: within a quarter turn of it, above the horizon.
    assert!(u.abs_diff(width / 2) < width / 8 && v < width / 4, "column {u}, row {v}");
    assert!(texels[brightest][0] > 100.0 && texels[brightest][0] < 1000.0);
    let (mut sum, mut weight) = (0.0, 0.0);
    for (i, texel) in texels.iter().enumerate() {
        let solid = ((i / width) as f64 + 0.5).mul_add(std::f64::consts::TAU / width as f64, 0.0).sin();
        sum += solid * f64::from(texel[1]);
        weight += solid;
    }
    assert!((0.4..1.1).contains(&(sum / weight)), "mean {}", sum / weight);
}

#[test]
fn builtin_truth_differs_from_the_start_and_lies_within_bounds() {
    let text = std::fs::read_to_string(SCENE.path().join("scene.toml")).unwrap();
    let scene: toml::Table = text.parse().unwrap();
    let free = scene["fit"]["free"].as_array().unwrap();
    assert_eq!(free.len(), builtin::truth().len());
    for (param, value) in builtin::truth() {
        assert!(free.iter().any(|name| name.as_str() == Some(param.name())));
        let start = &scene["model"]["params"][param.name()];
        let start = start.as_array().map_or(start, |channels| &channels[0]).as_float().unwrap();
        for &x in value {
            assert!((x - start).abs() > 0.05 * start.abs(), "{}", param.name());
            assert!((param.info().lower..=param.info().upper).contains(&x), "{}", param.name());
        }
        assert_eq!(builtin::true_params().rgb(*param), *value);
    }
}

#[test]
fn builtin_views_are_rigid_and_see_the_whole_head() {
    let text = std::fs::read_to_string(SCENE.path().join("scene.toml")).unwrap();
    let scene: toml::Table = text.parse().unwrap();
    let views = scene["view"].as_array().unwrap();
    assert_eq!(views.len(), 3);
    for view in views {
        let rows: Vec<f64> =
            view["world_to_camera"].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect();
        let matrix = glam::DMat4::from_cols_array(&rows.try_into().unwrap()).transpose();
        let turn = glam::DMat3::from_mat4(matrix);
        // Twelve decimals are written.
        assert!((turn * turn.transpose()).abs_diff_eq(glam::DMat3::IDENTITY, 1e-10));
        assert!((turn.determinant() - 1.0).abs() < 1e-10);
        let slope = (view["fov_y_degrees"].as_float().unwrap() / 2.0).to_radians().tan();
        for p in HEAD.positions.iter().filter(|p| p.y > -0.13 && p.x.abs() < 0.1) {
            let q = matrix.transform_point3(p.as_dvec3());
            assert!(q.z < -0.3 && q.x.abs() < -q.z * slope && q.y.abs() < -q.z * slope, "{p} is out of view");
        }
    }
}

//! Cameras: where they stand, their lenses, and those that other programs solved.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use serde_json::{Value, json};
use skinfit::bake::rays::RayMesh;
use skinfit::samples::hit_at;
use skinfit::scene::import::{ImportedView, colmap, transforms};
use skinfit::scene::lens::{Distortion, Lens};
use skinfit::scene::view::Camera;
use skinfit::scene::{LoadOptions, Scene};

use crate::scene_folder::{SceneFolder, png, tampered};

const MATRIX: &str = "world_to_camera = [1,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1]";
const FOV: &str = "fov_y_degrees = 30\n";

fn view(folder: &SceneFolder, camera: &str) -> Camera {
    folder.edited(MATRIX, camera).unwrap().0.views[0].camera
}

fn refusal(folder: &SceneFolder, camera: &str) -> String {
    folder.edited(MATRIX, camera).unwrap_err().to_string()
}

#[test]
fn a_camera_that_looks_at_a_place_is_the_matrix_of_the_same() {
    let folder = SceneFolder::new();
    let by_matrix = folder.load().unwrap().0.views[0].camera;
    let by_place = view(&folder, "eye = [0, 0, 2]\nlook_at = [0, 0, 0]");
    assert_eq!(by_place.world_to_camera, by_matrix.world_to_camera);
    // From the side, upside down: what it looks at is in the middle, and the world's -Y upright.
    let turned = view(&folder, "eye = [3, 1, 1]\nlook_at = [0.5, 1, 1]\nup = [0, -2, 0]");
    let (x, y, depth) = turned.project(DVec3::new(0.5, 1.0, 1.0));
    assert!((x - 2.0).abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && (depth - 2.5).abs() < 1e-12);
    assert!(turned.project(DVec3::new(0.5, 1.5, 1.0)).1 > 2.0);
}

#[test]
fn cameras_that_stand_nowhere_are_refused_by_name() {
    let folder = SceneFolder::new();
    for (camera, words) in [
        ("", "the view `front` has no camera. Give world_to_camera, or eye and look_at, or camera"),
        ("eye = [0, 0, 2]", "has no look_at"),
        ("look_at = [0, 0, 2]", "has no eye"),
        ("eye = [0, 0, 2]\nlook_at = [0, 0, 2]", "the same place"),
        ("eye = [0, 2, 0]\nlook_at = [0, 0, 0]", "up has no length, or lies along"),
        ("eye = [0, 0, 2]\nlook_at = [0, 0, 0]\nup = [0, 0, 0]", "up has no length, or lies along"),
        ("eye = [0, nan, 2]\nlook_at = [0, 0, 0]", "eye holds NaN"),
        ("eye = [0, 0, 2]\nlook_at = [0, 0, 0]\ncamera = \"c\"", "has look_at and camera"),
        ("camera = \"Camera\"", "has no camera `Camera`"),
    ] {
        let told = refusal(&folder, camera);
        assert!(told.contains(words), "{told}");
        assert!(told.contains("scene.toml: line "), "{told}");
    }
    let told = folder.edited(FOV, "").unwrap_err().to_string();
    assert!(told.contains("the key `fov_y_degrees` is missing in the view `front`"), "{told}");
}

/// A quad and cameras.
fn with_cameras(change: impl Fn(&mut Value)) -> SceneFolder {
    let folder = SceneFolder::new();
    let quad = tampered(|json, _| {
        json["cameras"] = json!([
            {"type": "perspective", "name": "lens", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 1.0}},
            {"type": "orthographic", "name": "flat", "orthographic": {"xmag": 1, "ymag": 1, "zfar": 9, "znear": 1}},
        ]);
        // Looks along -X from 4 on the X axis; its parent is twice as large.
        json["nodes"] = json!([
            {"mesh": 0},
            {"scale": [2, 2, 2], "children": [2]},
            {"name": "Camera.001", "camera": 0, "translation": [2, 0, 0], "rotation": [0, 0.5_f64.sqrt(), 0, 0.5_f64.sqrt()]},
            {"name": "Flat", "camera": 1},
        ]);
        json["scenes"][0]["nodes"] = json!([0, 1, 3]);
        change(json);
    });
    folder.write("quad.glb", &quad);
    folder
}

#[test]
fn cameras_of_the_mesh_file_are_taken_by_name() {
    let folder = with_cameras(|_| ());
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    folder.write("scene.toml", text.replace(MATRIX, "camera = \"Camera.001\"").replace(FOV, "").as_bytes());
    let (scene, warnings) = folder.load().unwrap();
    let camera = scene.views[0].camera;
    assert!(warnings.iter().all(|warning| !warning.message.contains("wide")), "{warnings:?}");
    assert!((camera.fov_y - 0.5).abs() < 1e-7, "{}", camera.fov_y);
    assert!((camera.eye() - DVec3::new(4.0, 0.0, 0.0)).length() < 1e-6);
    assert!((camera.direction(2.0, 2.0) - DVec3::NEG_X).length() < 1e-6);
    // A field of view of the scene's own goes before the file's.
    folder.write("scene.toml", text.replace(MATRIX, "camera = \"Camera.001\"").as_bytes());
    assert!((folder.load().unwrap().0.views[0].camera.fov_y.to_degrees() - 30.0).abs() < 1e-12);
    // Another shape than the file's is told.
    let wide = text.replace(MATRIX, "camera = \"Camera.001\"").replace("width = 4", "width = 8");
    let wide = wide.replace("target = \"target.exr\"\n", "");
    folder.write("scene.toml", wide.as_bytes());
    let (_, warnings) = folder.load().unwrap();
    assert!(
        warnings.iter().any(|warning| warning.message.contains("2.000 times as wide as high")),
        "{warnings:?}"
    );
}

#[test]
fn cameras_that_the_mesh_file_lacks_are_refused() {
    let folder = with_cameras(|_| ());
    let told = refusal(&folder, "camera = \"Camera.01\"");
    assert!(told.contains("has no camera `Camera.01`. Did you mean `Camera.001`?"), "{told}");
    let told = refusal(&folder, "camera = \"Flat\"");
    assert!(told.contains("has no camera `Flat`"), "{told}");
    let twice = with_cameras(|json| json["nodes"][3] = json!({"name": "Camera.001", "camera": 0}));
    let told = refusal(&twice, "camera = \"Camera.001\"");
    assert!(told.contains("has 2 cameras `Camera.001`. Give each a name of its own there"), "{told}");
    let mirrored = with_cameras(|json| json["nodes"][1]["scale"] = json!([-2, 2, 2]));
    let told = refusal(&mirrored, "camera = \"Camera.001\"");
    assert!(told.contains("mirrors, shears or has no size"), "{told}");
    let absent = with_cameras(|json| json["nodes"][2]["camera"] = json!(7));
    let told = refusal(&absent, "camera = \"Camera.001\"");
    assert!(told.contains("refers to camera 7, but has 2"), "{told}");
}

/// OpenCV's projection, written by its documentation: pixels of a point in a camera that looks along +Z, +Y down.
fn opencv(point: DVec3, [fx, fy, cx, cy]: [f64; 4], distortion: Option<Distortion>) -> [f64; 2] {
    let (x, y) = (point.x / point.z, point.y / point.z);
    let (u, v) = match distortion {
        None => (x, y),
        Some(Distortion::Brown { k: [k1, k2, k3], p: [p1, p2] }) => {
            let r = (x * x + y * y).sqrt();
            let radial = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6);
            (
                x * radial + 2.0 * p1 * x * y + p2 * (r.powi(2) + 2.0 * x * x),
                y * radial + p1 * (r.powi(2) + 2.0 * y * y) + 2.0 * p2 * x * y,
            )
        }
        Some(Distortion::Fisheye { k: [k1, k2, k3, k4] }) => {
            let r = (x * x + y * y).sqrt();
            let t = r.atan();
            let bent = t * (1.0 + k1 * t.powi(2) + k2 * t.powi(4) + k3 * t.powi(6) + k4 * t.powi(8));
            if r == 0.0 { (0.0, 0.0) } else { (bent / r * x, bent / r * y) }
        }
    };
    [fx * u + cx, fy * v + cy]
}

/// Points before a camera that looks along +Z.
fn points() -> impl Iterator<Item = DVec3> {
    (-4..=4).flat_map(|i| (-4..=4).map(move |j| DVec3::new(0.1 * f64::from(i), 0.08 * f64::from(j), 1.3)))
}

#[test]
fn a_view_sees_through_its_lens_what_opencv_projects_there() {
    let folder = SceneFolder::new();
    // 40 pixels high under 60 degrees: a focal length of 34.64 down.
    let sized = |lens: &str| {
        let sized = MATRIX.replace("-2,", "-1.5,") + "\nlens = " + lens;
        let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
        let text = text
            .replace(MATRIX, &sized)
            .replace("width = 4", "width = 48")
            .replace("height = 4", "height = 40");
        let text = text.replace("= 30\n", "= 60\n").replace("target = \"target.exr\"\n", "");
        folder.write("lens.toml", text.as_bytes());
        Scene::load(&folder.path("lens.toml"), &LoadOptions::default()).unwrap().0
    };
    let brown = Distortion::Brown { k: [-0.2, 0.05, 0.01], p: [0.003, -0.002] };
    let fisheye = Distortion::Fisheye { k: [-0.02, 0.004, 0.0, 0.0] };
    for (lens, centre, fx, distortion) in [
        ("{ cx = 26.5, cy = 18.25, fx = 36.0 }", [26.5, 18.25], Some(36.0), None),
        ("{ k1 = -0.2, k2 = 0.05, k3 = 0.01, p1 = 0.003, p2 = -0.002 }", [24.0, 20.0], None, Some(brown)),
        ("{ model = \"fisheye\", cy = 21.0, k1 = -0.02, k2 = 0.004 }", [24.0, 21.0], None, Some(fisheye)),
    ] {
        let scene = sized(lens);
        let camera = scene.views[0].camera;
        let posed = scene.mesh.pose();
        let rays = RayMesh::new(&posed.positions, &posed.triangles);
        let focal = 20.0 / 30.0_f64.to_radians().tan();
        let numbers = [fx.unwrap_or(focal), focal, centre[0], centre[1]];
        let mut seen = 0;
        for (x, y) in (0..48).flat_map(|x| (0..40).map(move |y| (f64::from(x) + 0.5, f64::from(y) + 0.5))) {
            let Some(hit) = hit_at(&rays, &posed, &camera, x, y) else { continue };
            let corners =
                posed.triangles[hit.triangle as usize].map(|i| posed.positions[i as usize].as_dvec3());
            let weights = hit.weights().map(f64::from);
            let place =
                camera.world_to_camera.transform_point3((0..3).map(|i| weights[i] * corners[i]).sum());
            let [px, py] = opencv(DVec3::new(place.x, -place.y, -place.z), numbers, distortion);
            // Weights in f32, of a quad that is some 50 pixels wide.
            assert!((px - x).hypot(py - y) < 1e-4, "{lens}: ({x}, {y}) is ({px}, {py})");
            seen += 1;
        }
        assert!(seen > 1000, "{lens}: {seen}");
    }
}

#[test]
fn lenses_that_make_no_image_are_refused() {
    let folder = SceneFolder::new();
    for (lens, words) in [
        ("{ k1 = -9.0 }", "folds its image over"),
        ("{ fx = 0.5 }", "fx = 0.5 is out of bounds"),
        ("{ model = \"fisheye\", cx = 12.0, fx = 1.0 }", "89 degrees"),
        ("{ model = \"fish\" }", "Did you mean `fisheye`?"),
        ("{ k4 = 0.1 }", "the lens model `brown` has no k4. Leave it out, or give model = \"fisheye\""),
        ("{ model = \"fisheye\", p1 = 0.1 }", "the lens model `fisheye` has no p1"),
        ("{ cx = inf }", "cx = inf is out of bounds"),
        ("{ k1 = 1e300 }", "k1 = 1e300 is out of bounds"),
        ("{ f = 1 }", "unknown key `f`"),
    ] {
        let told = refusal(&folder, &format!("{MATRIX}\nlens = {lens}"));
        assert!(told.contains(words), "{told}");
    }
}

/// A camera of a model, as a line of COLMAP's: its numbers there, and OpenCV's.
type ModelCase = (&'static str, &'static [f64], [f64; 4], Option<Distortion>);

const MODELS: [ModelCase; 8] = [
    ("SIMPLE_PINHOLE", &[500.0, 321.0, 239.0], [500.0, 500.0, 321.0, 239.0], None),
    ("PINHOLE", &[500.0, 505.0, 321.0, 239.0], [500.0, 505.0, 321.0, 239.0], None),
    (
        "SIMPLE_RADIAL",
        &[500.0, 321.0, 239.0, -0.1],
        [500.0, 500.0, 321.0, 239.0],
        Some(Distortion::Brown { k: [-0.1, 0.0, 0.0], p: [0.0; 2] }),
    ),
    (
        "RADIAL",
        &[500.0, 321.0, 239.0, -0.1, 0.02],
        [500.0, 500.0, 321.0, 239.0],
        Some(Distortion::Brown { k: [-0.1, 0.02, 0.0], p: [0.0; 2] }),
    ),
    (
        "OPENCV",
        &[500.0, 505.0, 321.0, 239.0, -0.1, 0.02, 0.001, -0.002],
        [500.0, 505.0, 321.0, 239.0],
        Some(Distortion::Brown { k: [-0.1, 0.02, 0.0], p: [0.001, -0.002] }),
    ),
    (
        "OPENCV_FISHEYE",
        &[500.0, 505.0, 321.0, 239.0, -0.02, 0.004, -0.001, 0.0002],
        [500.0, 505.0, 321.0, 239.0],
        Some(Distortion::Fisheye { k: [-0.02, 0.004, -0.001, 0.0002] }),
    ),
    (
        "FULL_OPENCV",
        &[500.0, 505.0, 321.0, 239.0, -0.1, 0.02, 0.001, -0.002, 0.005, 0.0, 0.0, 0.0],
        [500.0, 505.0, 321.0, 239.0],
        Some(Distortion::Brown { k: [-0.1, 0.02, 0.005], p: [0.001, -0.002] }),
    ),
    (
        "RADIAL_FISHEYE",
        &[500.0, 321.0, 239.0, -0.02, 0.004],
        [500.0, 500.0, 321.0, 239.0],
        Some(Distortion::Fisheye { k: [-0.02, 0.004, 0.0, 0.0] }),
    ),
];
/// COLMAP's numbers of these models.
const NUMBERS: [u32; 8] = [0, 1, 2, 3, 4, 5, 6, 9];
const QUATERNION: [f64; 4] = [0.9, 0.1, -0.3, 0.2];
const TRANSLATION: [f64; 3] = [0.2, -0.1, 3.0];

/// World to camera, in COLMAP's axes.
fn pose() -> DMat4 {
    let [w, x, y, z] = QUATERNION;
    DMat4::from_rotation_translation(DQuat::from_xyzw(x, y, z, w).normalize(), TRANSLATION.into())
}

pub(crate) fn write_text(folder: &Path) {
    let joined = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let mut cameras = "# Camera list with one line of data per camera:\n".to_owned();
    let mut images = "# Image list with two lines of data per image:\n".to_owned();
    for (i, (model, numbers, ..)) in MODELS.iter().enumerate() {
        cameras += &format!("{} {model} 640 480 {}\n", i + 1, joined(numbers));
        // The first image has no points: an empty line.
        let points = if i == 0 { "" } else { "10.5 20.5 -1 30.0 40.0 7" };
        let (q, t) = (joined(&QUATERNION), joined(&TRANSLATION));
        images += &format!("{} {q} {t} {} left side/img {i}.png\n{points}\n", 9 - i, i + 1);
    }
    std::fs::write(folder.join("cameras.txt"), cameras).unwrap();
    std::fs::write(folder.join("images.txt"), images).unwrap();
}

pub(crate) fn write_binary(folder: &Path) {
    let (mut cameras, mut images) = (Vec::new(), Vec::new());
    let count = (MODELS.len() as u64).to_le_bytes();
    cameras.extend(count);
    images.extend(count);
    for (i, ((_, numbers, ..), model)) in MODELS.iter().zip(NUMBERS).enumerate() {
        let i = i as u32;
        cameras.extend((i + 1).to_le_bytes());
        cameras.extend(model.to_le_bytes());
        cameras.extend([640_u64, 480].into_iter().flat_map(u64::to_le_bytes));
        cameras.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
        images.extend((9 - i).to_le_bytes());
        images.extend(QUATERNION.iter().chain(&TRANSLATION).flat_map(|x| x.to_le_bytes()));
        images.extend((i + 1).to_le_bytes());
        images.extend(format!("left side/img {i}.png\0").into_bytes());
        images.extend(u64::from(i).to_le_bytes());
        images.extend(vec![1_u8; 24 * i as usize]);
    }
    std::fs::write(folder.join("cameras.bin"), cameras).unwrap();
    std::fs::write(folder.join("images.bin"), images).unwrap();
}

/// The views see each point where their source's own projection has it.
fn check(views: &[ImportedView]) {
    assert_eq!(views.len(), MODELS.len());
    for (i, (view, (model, _, numbers, distortion))) in views.iter().zip(MODELS).enumerate() {
        assert_eq!(view.name, format!("img_{i}"));
        assert_eq!(view.picture, Path::new(&format!("left side/img {i}.png")));
        assert_eq!([view.camera.width, view.camera.height], [640, 480]);
        for point in points() {
            let [x, y] = opencv(point, numbers, distortion);
            let (px, py, depth) = view.camera.project(pose().inverse().transform_point3(point));
            // Roundings of f64 in numbers up to 1000; 0.05 pixels are asked for.
            crate::figures::measured("imported projection", (px - x).hypot(py - y));
            assert!((px - x).hypot(py - y) < 1e-9, "{model}: {px} {py}, not {x} {y}");
            assert!((depth - point.z).abs() < 1e-12);
        }
    }
}

#[test]
fn colmaps_cameras_project_as_colmap_does() {
    let folder = tempfile::tempdir().unwrap();
    write_text(folder.path());
    check(&colmap::read(folder.path()).unwrap());
    // The binary files of a folder that has both are read.
    std::fs::write(folder.path().join("cameras.txt"), "no camera").unwrap();
    write_binary(folder.path());
    check(&colmap::read(folder.path()).unwrap());
}

#[test]
fn models_that_are_damaged_or_unknown_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let read = || colmap::read(folder.path()).unwrap_err().to_string();
    assert!(read().contains("has neither cameras.bin nor cameras.txt"), "{}", read());
    write_text(folder.path());
    for (cameras, words) in [
        ("1 FOV 640 480 1 2 3 4 5\n", "line 1: has the camera model FOV, whose distortion no scene knows"),
        ("1 FULL_OPENCV 640 480 1 1 2 3 0 0 0 0 0 0.1 0 0\n", "FULL_OPENCV, whose distortion no scene knows"),
        ("1 HOLE 640 480 1\n", "has the unknown camera model HOLE"),
        ("1 PINHOLE 640 480 1 2\n", "has 2 parameters, and PINHOLE has 4"),
        ("1 PINHOLE 640 480 0 1 2 3\n", "has the focal lengths 0 and 1"),
        ("1 PINHOLE 640 480 nan 1 2 3\n", "not finite"),
        ("1 PINHOLE 0 480 1 1 2 3\n", "has an image of 0 x 480 pixels"),
        ("1 PINHOLE\n", "line 1: is no camera"),
        ("1 PINHOLE 8 8 1 1 2 3\n1 PINHOLE 8 8 1 1 2 3\n", "line 2: has the number 1, as a camera before it"),
        ("# nothing\n", "cameras.txt does not hold"),
    ] {
        std::fs::write(folder.path().join("cameras.txt"), cameras).unwrap();
        assert!(read().contains(words), "{}", read());
    }
    write_text(folder.path());
    for (images, words) in [
        ("1 0 0 0 0 0 0 0 1 a.png\n\n", "has a pose that is no motion"),
        ("1 1 0 0 0 0 0 inf 1 a.png\n\n", "has a pose that is no motion"),
        ("1 1 0 0 0 0 0 0 1\n\n", "line 1: is no image"),
        ("1 1 0 0 0 0 0 0 one a.png\n\n", "line 1: is no image"),
    ] {
        std::fs::write(folder.path().join("images.txt"), images).unwrap();
        assert!(read().contains(words), "{}", read());
    }
    // Cut short anywhere, or with more than it counts, a binary model is refused.
    write_binary(folder.path());
    for name in ["cameras.bin", "images.bin"] {
        let whole = std::fs::read(folder.path().join(name)).unwrap();
        for length in (0..whole.len()).step_by(7) {
            std::fs::write(folder.path().join(name), &whole[..length]).unwrap();
            assert!(colmap::read(folder.path()).is_err(), "{name} of {length} bytes");
        }
        let fewer = [&[whole[0] - 1], &whole[1..]].concat();
        std::fs::write(folder.path().join(name), fewer).unwrap();
        assert!(read().contains("bytes more than it counts"), "{name}: {}", read());
        std::fs::write(folder.path().join(name), whole).unwrap();
    }
    // A count that promises more than there is asks for no memory.
    let mut cameras = std::fs::read(folder.path().join("cameras.bin")).unwrap();
    cameras[..8].copy_from_slice(&u64::MAX.to_le_bytes());
    std::fs::write(folder.path().join("cameras.bin"), cameras).unwrap();
    assert!(read().contains("is cut short") || read().contains("unknown camera model"), "{}", read());
}

#[test]
fn transforms_project_as_their_axes_have_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("transforms.json");
    // Camera to world, looking along -Z with +Y up.
    let over = DMat4::from_scale(DVec3::new(1.0, -1.0, -1.0));
    let to_world = (over * pose()).inverse();
    let matrix: Vec<[f64; 4]> = (0..4).map(|row| to_world.row(row).to_array()).collect();
    let whole = json!({
        "w": 640, "h": 480, "fl_x": 500.0, "fl_y": 505.0, "cx": 321.0, "cy": 239.0, "k1": -0.1, "k2": 0.02,
        "p1": 0.001, "p2": -0.002, "aabb_scale": 4,
        "frames": [
            {"file_path": "images/a.png", "sharpness": 3.0, "transform_matrix": matrix},
            {"file_path": "other/a.png", "transform_matrix": matrix, "camera_model": "OPENCV_FISHEYE", "k1": -0.02, "k2": 0.004, "k3": -0.001, "k4": 0.0002},
        ],
    });
    std::fs::write(&path, whole.to_string()).unwrap();
    let views = transforms::read(&path, None).unwrap();
    assert_eq!([&views[0].name, &views[1].name], ["a", "a_2"]);
    for (view, case) in views.iter().zip([MODELS[4], MODELS[5]]) {
        for point in points() {
            let [x, y] = opencv(point, case.2, case.3);
            let (px, py, _) = view.camera.project(pose().inverse().transform_point3(point));
            crate::figures::measured("imported projection", (px - x).hypot(py - y));
            assert!((px - x).hypot(py - y) < 1e-9, "{px} {py}, not {x} {y}");
        }
    }
    // Exporters for Blender give an angle across.
    let plain = json!({"camera_angle_x": 0.8, "w": 640, "h": 480, "frames": [{"file_path": "./r_0", "transform_matrix": matrix}]});
    std::fs::write(&path, plain.to_string()).unwrap();
    let camera = transforms::read(&path, None).unwrap()[0].camera;
    assert_eq!(camera.lens, Lens::default());
    assert!((320.0 / (0.5 * camera.fov_y).tan() * 0.75 - 320.0 / 0.4_f64.tan()).abs() < 1e-9);
    // Blender's NeRF files give no more than that: the pictures have the size.
    let bare = json!({"camera_angle_x": 0.8, "frames": [{"file_path": "./r_0", "transform_matrix": matrix}]});
    std::fs::write(&path, bare.to_string()).unwrap();
    let told = transforms::read(&path, None).unwrap_err().to_string();
    assert!(
        told.contains("frame 0: has no w and h, and its picture ./r_0 is not there either. Add the width"),
        "{told}"
    );
    for (name, images) in [("r_0.png", None), ("pictures/r_0.png", Some(folder.path().join("pictures")))] {
        let file = folder.path().join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(&file, png(64, 48, [188; 3])).unwrap();
        let sized = transforms::read(&path, images.as_deref()).unwrap()[0].camera;
        assert_eq!([sized.width, sized.height], [64, 48]);
        assert!((sized.fov_y - camera.fov_y).abs() < 1e-12);
        std::fs::remove_file(file).unwrap();
    }
    for (pointer, value, words) in [
        ("/frames/0/transform_matrix/0/0", json!(9.0), "has a transform_matrix that scales or shears"),
        ("/w", json!(640.5), "has an image of 0 x 480 pixels"),
        ("/camera_angle_x", Value::Null, "has no fl_x and no camera_angle_x"),
        ("/frames", json!(3), "is no transforms.json"),
    ] {
        let mut harmed = plain.clone();
        *harmed.pointer_mut(pointer).unwrap() = value;
        std::fs::write(&path, harmed.to_string()).unwrap();
        let told = transforms::read(&path, None).unwrap_err().to_string();
        assert!(told.contains(words), "{told}");
    }
}

//! Calibrations by OpenCV and ROS, by OpenCV's formulas.

use glam::DVec3;
use skinfit::scene::import::opencv;
use skinfit::scene::view::Camera;

use super::{File, near, points};

/// A calibration: fx, fy, cx, cy and OpenCV's coefficients.
const MATRIX: [f64; 4] = [1012.5, 1008.25, 640.75, 355.5];
const COEFFICIENTS: [f64; 5] = [-0.12, 0.08, 0.0011, -0.0006, -0.01];

/// OpenCV's documentation, "Camera Calibration and 3D Reconstruction", and "Fisheye camera model".
fn opencv_project(point: DVec3, fisheye: bool) -> [f64; 2] {
    let (x, y) = (point.x / point.z, point.y / point.z);
    let r = (x * x + y * y).sqrt();
    let [k1, k2, p1, p2, k3] = COEFFICIENTS;
    let (u, v) = if fisheye {
        let t = r.atan();
        let bent = t * (1.0 + k1 * t.powi(2) + k2 * t.powi(4) + p1 * t.powi(6) + p2 * t.powi(8));
        if r == 0.0 { (0.0, 0.0) } else { (bent / r * x, bent / r * y) }
    } else {
        let radial = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6);
        (
            x * radial + 2.0 * p1 * x * y + p2 * (r.powi(2) + 2.0 * x * x),
            y * radial + p1 * (r.powi(2) + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    };
    let [fx, fy, cx, cy] = MATRIX;
    // Its pixel (0, 0) is the middle of what a scene has at (0.5, 0.5).
    [fx * u + cx + 0.5, fy * v + cy + 0.5]
}

fn read_opencv(text: &str) -> Result<Camera, String> {
    let file = File::new("camera.yml", text.as_bytes());
    opencv::read(&file.path).map_err(|error| error.to_string())
}

fn check_opencv(text: &str, fisheye: bool) {
    let camera = read_opencv(text).unwrap();
    assert_eq!([camera.width, camera.height], [1280, 720]);
    for point in points() {
        // A scene's camera looks along -Z with +Y up.
        let (x, y, _) = camera.project(DVec3::new(point.x, -point.y, -point.z));
        near([x, y], opencv_project(point, fisheye), text);
    }
}

/// As OpenCV's sample of camera calibration writes it.
pub(crate) const STORED: &str = "%YAML:1.0
---
calibration_time: \"Thu 01 Jan 2026 10:00:00 AM UTC\"
nr_of_frames: 25
image_width: 1280
image_height: 720
board_width: 9
square_size: 5.0000000000000000e+01
fix_aspect_ratio: 0.
# flags:  +fix_principal_point
flags: 0
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1.0125e+03, 0., 6.4075000000000000e+02, 0.,
       1.00825e+03, 3.555e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -1.2e-01, 8.0000000000000002e-02, .0011,
       -6.0e-04, -0.01 ]
avg_reprojection_error: 1.9518376941051125e-01
per_view_reprojection_errors: !!opencv-matrix
   rows: 2
   cols: 1
   dt: f
   data: [ 1.9e-01, 2.0e-01 ]
extrinsic_parameters:
   - !!opencv-matrix
      rows: 1
      cols: 6
      dt: d
      data: [ 1., 2., 3., 4.,
          5., 6. ]
";
pub(crate) const ROS: &str = "image_width: 1280
image_height: 720
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [1012.5, 0, 640.75, 0, 1008.25, 355.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.12, 0.08, 0.0011, -0.0006, -0.01]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
";
/// A message of `camera_info`, printed.
const MESSAGE: &str = "header:
  stamp:
    sec: 1
  frame_id: head
height: 720
width: 1280
distortion_model: plumb_bob
d:
- -0.12
- 0.08
- 0.0011
- -0.0006
- -0.01
k:
- 1012.5
- 0.0
- 640.75
- 0.0
- 1008.25
- 355.5
- 0.0
- 0.0
- 1.0
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
---
";
pub(crate) const XML: &str = "<?xml version=\"1.0\"?>
<opencv_storage>
<calibration_time>\"Thu 01 Jan 2026\"</calibration_time>
<!-- of the head's camera -->
<image_size>
  1280 720</image_size>
<Camera_Matrix type_id=\"opencv-matrix\">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    1.0125e+03 0. 640.75 0. 1.00825e+03 355.5 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id=\"opencv-matrix\">
  <rows>8</rows>
  <cols>1</cols>
  <dt>d</dt>
  <data>
    -0.12 0.08 0.0011 -0.0006 -0.01 0. 0. 0.</data></Distortion_Coefficients>
</opencv_storage>
";

#[test]
fn calibrations_project_as_opencv_does() {
    [STORED, ROS, MESSAGE, XML].into_iter().for_each(|text| check_opencv(text, false));
    check_opencv(&STORED.replace('\n', "\r\n"), false);
    check_opencv(
        &MESSAGE.replace(
            "d:\n- -0.12\n- 0.08\n- 0.0011\n- -0.0006\n- -0.01",
            "D: [-0.12, 0.08, 0.0011, -0.0006, -0.01]",
        ),
        false,
    );
    let four = STORED.replace("rows: 5", "rows: 4").replace("-6.0e-04, -0.01 ]", "-6.0e-04 ]");
    check_opencv(&four.replace("fisheye_model: 0", "fisheye_model: 1"), true);
    let ros = ROS.replace("plumb_bob", "equidistant").replace("cols: 5", "cols: 4").replace(", -0.01]", "]");
    check_opencv(&ros, true);
    // Without coefficients it is a pinhole beside its image's middle.
    let plain = ROS.split("distortion_model").next().unwrap();
    assert_eq!(read_opencv(plain).unwrap().lens.distortion, None);
}

#[test]
fn calibrations_that_are_damaged_or_unknown_are_refused() {
    for (text, from, to, words) in [
        (ROS, "camera_matrix:", "matrix:", "has no camera_matrix, so it is no calibration by OpenCV"),
        (ROS, "1012.5, 0,", "1012.5, 0.25,", "has skew between its axes"),
        (ROS, "0, 0, 1]", "0, 0, 2]", "is no camera matrix of 3 x 3 numbers"),
        (ROS, "rows: 3", "rows: 2", "line 7, camera_matrix.data: holds 9 numbers, and not 2 x 3"),
        (ROS, "  rows: 3\n", "", "line 6, camera_matrix.data: has no rows and cols"),
        (
            ROS,
            "-0.12,",
            "x,",
            "line 12, distortion_coefficients.data: holds something else than finite numbers",
        ),
        (ROS, "-0.12,", "nan,", "holds something else than finite numbers"),
        (ROS, "-0.12,", ".Inf,", "holds something else than finite numbers"),
        (ROS, "1012.5,", "1e999,", "holds something else than finite numbers"),
        (ROS, "-0.12,", "1e300,", "has the coefficient 1e300"),
        (ROS, "640.75,", "1e9,", "has its axis at pixel (1000000000.5, 356)"),
        (ROS, "1008.25,", "1e300,", "has the focal lengths 1012.5 and 1"),
        (ROS, "1012.5,", "-1,", "has the focal lengths -1 and"),
        (ROS, "-0.01]", "-0.01, 1]", "holds 6 numbers, and not 1 x 5"),
        (ROS, "plumb_bob", "division", "has the distortion model \"division\", which no scene knows"),
        (ROS, "plumb_bob", "equidistant", "has no four coefficients"),
        (ROS, "image_width: 1280\n", "", "does not say how large its images are"),
        (ROS, "1280", "40000", "has an image of 40000 x 720 pixels. A view has at most 16384"),
        (ROS, "1280", "1280.5", "line 1, image_width: has an image of 0 x 720 pixels"),
        (ROS, "1280", "-1e308", "has an image of 0 x 720 pixels"),
        (ROS, "1280", "[1280, 1]", "line 1, image_width: is not one number"),
        (MESSAGE, "binning_x: 0", "binning_x: 2", "cuts or bins the image"),
        (MESSAGE, "x_offset: 0", "x_offset: 100", "cuts or bins the image"),
        (MESSAGE, "- -0.01\n", "", "projects"),
        (XML, "opencv_storage>", "storage>", "so it is no XML of OpenCV"),
        (
            XML,
            "0. 0. 0.</data></Dist",
            "0. 0. 0.5</data></Dist",
            "has 8 coefficients, and scenes' lenses have five",
        ),
        (XML, "<rows>8", "<rows>x", "holds something else than finite numbers"),
        (XML, "1280 720", "1280 720 3", "is no width and height"),
    ] {
        let harmed = text.replace(from, to);
        assert_ne!(harmed, text, "{from}");
        let read = read_opencv(&harmed);
        // Four coefficients are as many as OpenCV's model may have.
        if words == "projects" {
            assert!(read.is_ok(), "{read:?}");
            continue;
        }
        let told = read.unwrap_err();
        assert!(told.contains("camera.yml: ") && told.contains(words), "{words}: {told}");
    }
}

#[test]
fn calibrations_that_are_cut_short_never_panic() {
    for text in [STORED, ROS, MESSAGE] {
        let list = text.find("1012.5").or(text.find("1.0125e+03")).unwrap();
        for length in 0..text.len() {
            let read = read_opencv(&text[..length]);
            // YAML has no end of its own; but there is no camera before its matrix.
            assert!(length > list || read.is_err(), "{length} bytes: {read:?}");
        }
    }
    for length in 0..XML.trim_end().len() {
        let told = read_opencv(&XML[..length]).unwrap_err();
        assert!(told.contains("camera.yml: "), "{told}");
    }
    for text in [
        "[".repeat(100_000),
        "a:\n".repeat(1000),
        "- \n- - -".to_owned(),
        "a: [1,\n".to_owned(),
        "<a>".repeat(50_000),
    ] {
        assert!(read_opencv(&text).is_err());
    }
}

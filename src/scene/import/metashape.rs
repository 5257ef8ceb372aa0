//! Cameras as Agisoft Metashape exports them (File, Export, Export Cameras: its own XML).
//!
//! - Axes of a camera: X to the right, Y down, Z forward. Its `transform` takes the camera to the chunk, row by row; the
//!   transform of its component (of the chunk, in older files) takes that to the world, with a scale.
//! - Places of the image are pixels from its upper left corner, whose pixel has its middle at (0.5, 0.5).
//!
//! Metashape's manual, appendix "Camera models": with x = X / Z, y = Y / Z and r² = x² + y²,
//!
//! ```text
//! x' = x (1 + K1 r² + K2 r⁴ + K3 r⁶ + K4 r⁸) + P1 (r² + 2 x²) + 2 P2 x y
//! y' = y (1 + K1 r² + K2 r⁴ + K3 r⁶ + K4 r⁸) + P2 (r² + 2 y²) + 2 P1 x y
//! u = w / 2 + cx + x' f + x' B1 + y' B2
//! v = h / 2 + cy + y' f
//! ```
//!
//! So its P1 is OpenCV's p2 and its P2 is OpenCV's p1, of the same signs, and B1 is how much longer the focal length across
//! is. A fisheye's x and y are first scaled by the angle from the axis over its tangent, and r is that angle: OpenCV's, where
//! P1 and P2 are 0.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};
use roxmltree::{Document, Node};

use super::{ImportedView, Intrinsics, Names, brown, damaged, side, turned_over};
use crate::cameras::turns_alone;
use crate::error::{SceneError, read_bytes};
use crate::lens::Distortion;

/// No such file above this many bytes is read.
const MOST_BYTES: u64 = 1 << 30;
/// Bounds of a component's scale: beyond them lengths of metres are lost among f64's digits.
const SCALES: [f64; 2] = [1e-9, 1e9];
/// Numbers that the scenes' lenses have no place for, and what each is.
const FOREIGN: [(&str, &str); 4] = [
    ("b2", "skew between its axes"),
    ("p3", "a third tangential coefficient"),
    ("p4", "a fourth tangential coefficient"),
    ("skew", "skew between its axes"),
];

/// The file, to speak of its places.
#[derive(Clone, Copy)]
struct Source<'a> {
    path: &'a Path,
    document: &'a Document<'a>,
}

/// The views of the cameras that are aligned and enabled, in the file's order.
///
/// # Errors
/// When the file is damaged, its chunk is placed on the globe, or a camera is of a kind that scenes do not know.
pub fn read(path: &Path) -> Result<Vec<ImportedView>, SceneError> {
    let bytes = read_bytes(path, MOST_BYTES)?;
    let text = std::str::from_utf8(&bytes).map_err(|_| damaged(path, "its text", "is not UTF-8"))?;
    let document = Document::parse(text).map_err(|error| {
        damaged(path, format!("line {}", error.pos().row), format!("is no camera file of Metashape: {error}"))
    })?;
    let source = Source { path, document: &document };
    let mut chunks = document.root_element().children().filter(|node| node.has_tag_name("chunk"));
    let Some(chunk) = chunks.next().filter(|_| document.root_element().has_tag_name("document")) else {
        return Err(damaged(path, "its root", "is no camera file of Metashape: it has no chunk"));
    };
    if let Some(second) = chunks.next() {
        let remedy = "Export the cameras of one chunk alone";
        return Err(source.refusal(
            second,
            "is a second chunk, and chunks stand in places of their own",
            remedy,
        ));
    }
    source.check_on_no_globe(chunk)?;
    source.views(chunk)
}

/// The element's child of that name.
fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn text_of<'a>(node: Node<'a, 'a>) -> &'a str {
    node.text().unwrap_or_default()
}

impl<'a> Source<'a> {
    fn place(&self, node: Node<'a, 'a>) -> String {
        let line = self.document.text_pos_at(node.range().start).row;
        format!("line {line}, {}", node.tag_name().name())
    }

    fn damaged(&self, node: Node<'a, 'a>, what: impl Into<String>) -> SceneError {
        damaged(self.path, self.place(node), what)
    }

    fn refusal(&self, node: Node<'a, 'a>, what: impl Into<String>, remedy: &str) -> SceneError {
        SceneError::new(self.path, what, remedy).at(self.place(node))
    }

    /// World coordinates of a globe are kilometres from everything, and exported meshes have others.
    fn check_on_no_globe(&self, chunk: Node<'a, 'a>) -> Result<(), SceneError> {
        let Some(reference) = child(chunk, "reference") else { return Ok(()) };
        let system = text_of(reference).trim();
        if system.is_empty() || system.starts_with("LOCAL_CS") {
            return Ok(());
        }
        Err(self.refusal(
            reference,
            "places the cameras on the globe",
            "Set the chunk's reference to local coordinates, and export both its mesh and its cameras anew",
        ))
    }

    fn views(&self, chunk: Node<'a, 'a>) -> Result<Vec<ImportedView>, SceneError> {
        let within = |folder: &str, name: &'static str| {
            let elements = child(chunk, folder).into_iter().flat_map(|node| node.descendants());
            elements.filter(move |node| node.has_tag_name(name))
        };
        let id = |node: &Node<'a, 'a>| node.attribute("id").map(|id| (id, *node));
        let sensors: BTreeMap<&str, Node<'a, 'a>> =
            within("sensors", "sensor").filter_map(|node| id(&node)).collect();
        let components: BTreeMap<&str, Node<'a, 'a>> =
            within("components", "component").filter_map(|node| id(&node)).collect();
        let mut names = Names::new();
        let mut views = Vec::new();
        for camera in within("cameras", "camera") {
            let enabled = !matches!(camera.attribute("enabled"), Some("false" | "0"));
            let aligned = child(camera, "transform").filter(|_| enabled);
            if aligned.is_none() && enabled && camera.attribute("master_id").is_some() {
                let what = "is a camera of a rig, placed by another's transform and its own sensor's";
                return Err(self.refusal(
                    camera,
                    what,
                    "Import the rig's first camera alone: disable the others",
                ));
            }
            // Without a transform it was not aligned.
            let Some(transform) = aligned else { continue };
            let sensor = camera.attribute("sensor_id").and_then(|id| sensors.get(id));
            let sensor =
                sensor.ok_or_else(|| self.damaged(camera, "refers to a sensor that is not there"))?;
            let component = camera.attribute("component_id").and_then(|id| components.get(id));
            let placed = component.and_then(|component| child(*component, "transform"));
            let to_world = match placed.or_else(|| child(chunk, "transform")) {
                Some(transform) => self.placement(transform)?,
                None => (1.0, DMat3::IDENTITY, DVec3::ZERO),
            };
            let label = camera.attribute("label").unwrap_or_default();
            let picture = PathBuf::from(label);
            let world_to_camera = self.pose(transform, to_world)?.inverse();
            let camera = self.intrinsics(*sensor)?.placed(turned_over(world_to_camera));
            views.push(ImportedView { name: names.of(&picture), camera, picture });
        }
        Ok(views)
    }

    /// `N` numbers between spaces.
    fn numbers<const N: usize>(&self, node: Node<'a, 'a>) -> Result<[f64; N], SceneError> {
        let numbers: Option<Vec<f64>> = text_of(node)
            .split_whitespace()
            .map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()))
            .collect();
        let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
        numbers.ok_or_else(|| self.damaged(node, format!("does not hold {N} finite numbers")))
    }

    /// Scale, rotation and translation; what is absent does nothing.
    fn placement(&self, transform: Node<'a, 'a>) -> Result<(f64, DMat3, DVec3), SceneError> {
        let rotation = match child(transform, "rotation") {
            Some(node) => {
                let rotation = DMat3::from_cols_array(&self.numbers(node)?).transpose();
                turns_alone(rotation).map_err(|what| self.damaged(node, what))?;
                rotation
            }
            None => DMat3::IDENTITY,
        };
        let moved = child(transform, "translation").map(|node| self.numbers::<3>(node)).transpose()?;
        let scale = match child(transform, "scale") {
            Some(node) => {
                let [scale] = self.numbers(node)?;
                let [least, most] = SCALES;
                if !(least..=most).contains(&scale) {
                    return Err(self.damaged(node, format!("is {scale}")));
                }
                scale
            }
            None => 1.0,
        };
        Ok((scale, rotation, moved.unwrap_or_default().into()))
    }

    /// From the camera, in its own axes, to the world: a scale of the chunk moves it and turns nothing.
    fn pose(
        &self,
        transform: Node<'a, 'a>,
        (scale, rotation, translation): (f64, DMat3, DVec3),
    ) -> Result<DMat4, SceneError> {
        let to_chunk = DMat4::from_cols_array(&self.numbers(transform)?).transpose();
        let turned = DMat3::from_mat4(to_chunk);
        turns_alone(turned).map_err(|what| self.damaged(transform, what))?;
        // Files round to 17 digits.
        if (to_chunk.row(3) - DVec4::W).abs().max_element() > 1e-9 {
            return Err(self.damaged(transform, "has a last row other than 0, 0, 0, 1"));
        }
        let eye = scale * (rotation * to_chunk.w_axis.truncate()) + translation;
        if !eye.is_finite() {
            return Err(self.damaged(transform, "is moved beyond all numbers"));
        }
        // Each is a rotation as nearly as a file has one, and so is a scene's camera.
        let mut pose = DMat4::from_quat(DQuat::from_mat3(&(rotation * turned)).normalize());
        pose.w_axis = eye.extend(1.0);
        Ok(pose)
    }

    /// The numbers of a sensor's calibration: the adjusted one, where there are two.
    fn intrinsics(&self, sensor: Node<'a, 'a>) -> Result<Intrinsics, SceneError> {
        let all = || sensor.children().filter(|node| node.has_tag_name("calibration"));
        let adjusted = all().find(|node| node.attribute("class") == Some("adjusted"));
        let calibration =
            adjusted.or_else(|| all().next()).ok_or_else(|| self.damaged(sensor, "has no calibration"))?;
        if let Some(old) = child(calibration, "fx") {
            let what = "is a focal length across, as files of PhotoScan before version 1.2 have it";
            return Err(self.refusal(old, what, "Open the project in a later version, and export it anew"));
        }
        let number = |name: &str| match child(calibration, name) {
            Some(node) => self.numbers(node).map(|[number]| number),
            None => Ok(0.0),
        };
        for (name, what) in FOREIGN {
            if let Some(node) = child(calibration, name).filter(|_| !matches!(number(name), Ok(0.0))) {
                let what = format!("has {what}, which no scene's lens has");
                return Err(self.refusal(
                    node,
                    what,
                    "Optimise the cameras without it, or undistort the photos",
                ));
            }
        }
        let k = [number("k1")?, number("k2")?, number("k3")?, number("k4")?];
        let p = [number("p2")?, number("p1")?];
        let kind = calibration.attribute("type").or_else(|| sensor.attribute("type")).unwrap_or("frame");
        let distortion = match kind {
            "frame" if k[3] == 0.0 => brown([k[0], k[1], k[2]], p),
            "fisheye" if p == [0.0; 2] => Some(Distortion::Fisheye { k }),
            _ => {
                let what = match kind {
                    "frame" => "has a k4, which no scene's lens has beside a frame camera's".to_owned(),
                    "fisheye" => "has p1 and p2, which no scene's fisheye has".to_owned(),
                    other => format!("is of the type {other:?}, whose distortion no scene knows"),
                };
                let remedy = "Optimise the cameras without them, or undistort the photos";
                return Err(self.refusal(calibration, what, remedy));
            }
        };
        let size = self.size(calibration, sensor)?;
        let focal = number("f")?;
        let centre = [0.5 * size[0] + number("cx")?, 0.5 * size[1] + number("cy")?];
        Intrinsics { size: size.map(side), focal: [focal + number("b1")?, focal], centre, distortion }
            .checked(self.path, &self.place(calibration))
    }

    /// Width and height: the calibration's, or the sensor's.
    fn size(&self, calibration: Node<'a, 'a>, sensor: Node<'a, 'a>) -> Result<[f64; 2], SceneError> {
        let resolution = child(calibration, "resolution").or_else(|| child(sensor, "resolution"));
        let resolution = resolution.ok_or_else(|| self.damaged(calibration, "has no resolution"))?;
        let pixels = |name: &str| resolution.attribute(name).and_then(|pixels| pixels.parse::<f64>().ok());
        match (pixels("width"), pixels("height")) {
            (Some(width), Some(height)) => Ok([width, height]),
            _ => Err(self.damaged(resolution, "has no width and height")),
        }
    }
}

//! Cameras that Metashape exports, by Agisoft's formulas.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use skinfit::scene::import::{ImportedView, metashape};
use skinfit::scene::lens::Lens;

use super::{File, near, points};

/// Metashape's numbers: f, cx, cy, k1, k2, k3, k4, p1, p2, b1.
#[derive(Clone, Copy)]
struct Agisoft {
    kind: &'static str,
    f: f64,
    c: [f64; 2],
    k: [f64; 4],
    p: [f64; 2],
    b1: f64,
}

const SIZE: [u32; 2] = [4000, 3000];
const FRAME: Agisoft = Agisoft {
    kind: "frame",
    f: 3512.25,
    c: [12.5, -20.125],
    k: [-0.08, 0.11, -0.02, 0.0],
    p: [0.0012, -0.0007],
    b1: -3.5,
};
const FISHEYE: Agisoft =
    Agisoft { kind: "fisheye", k: [-0.02, 0.004, -0.001, 0.0002], p: [0.0; 2], b1: 0.75, ..FRAME };
const PLAIN: Agisoft = Agisoft { k: [0.0; 4], p: [0.0; 2], c: [0.0; 2], b1: 0.0, ..FRAME };

impl Agisoft {
    /// Agisoft's formulas, as its manual has them in the appendix on camera models.
    fn project(&self, point: DVec3) -> [f64; 2] {
        let (mut x, mut y) = (point.x / point.z, point.y / point.z);
        if self.kind == "fisheye" {
            let r0 = (x * x + y * y).sqrt();
            let scale = if r0 == 0.0 { 1.0 } else { r0.atan() / r0 };
            (x, y) = (x * scale, y * scale);
        }
        let r = (x * x + y * y).sqrt();
        let [k1, k2, k3, k4] = self.k;
        let [p1, p2] = self.p;
        let radial = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6) + k4 * r.powi(8);
        let xd = x * radial + (p1 * (r.powi(2) + 2.0 * x * x) + 2.0 * p2 * x * y);
        let yd = y * radial + (p2 * (r.powi(2) + 2.0 * y * y) + 2.0 * p1 * x * y);
        let [w, h] = SIZE.map(f64::from);
        [w * 0.5 + self.c[0] + xd * self.f + xd * self.b1, h * 0.5 + self.c[1] + yd * self.f]
    }

    fn sensor(&self, id: usize) -> String {
        let ([k1, k2, k3, k4], [p1, p2], [cx, cy]) = (self.k, self.p, self.c);
        let mut text = String::new();
        let [width, height] = SIZE;
        write!(
            text,
            "<sensor id=\"{id}\" label=\"lens {id}\" type=\"{kind}\">\n<resolution width=\"{width}\" height=\"{height}\"/>\n\
             <property name=\"fixed\" value=\"false\"/>\n<bands><band label=\"Red\"/></bands>\n\
             <calibration type=\"{kind}\" class=\"initial\"><resolution width=\"{width}\" height=\"{height}\"/><f>1</f></calibration>\n\
             <calibration type=\"{kind}\" class=\"adjusted\"><resolution width=\"{width}\" height=\"{height}\"/>\n\
             <f>{f}</f><cx>{cx}</cx><cy>{cy}</cy><k1>{k1}</k1><k2>{k2}</k2><k3>{k3}</k3><k4>{k4}</k4>\
             <p1>{p1}</p1><p2>{p2}</p2><b1>{b1}</b1><b2>0</b2></calibration>\n</sensor>\n",
            kind = self.kind,
            f = self.f,
            b1 = self.b1,
        )
        .unwrap();
        text
    }
}

/// Where the chunk stands in the world, and each camera in the chunk.
struct Stand {
    scale: f64,
    rotation: DMat3,
    translation: DVec3,
}

fn stand() -> Stand {
    Stand {
        scale: 0.37,
        rotation: DMat3::from_quat(DQuat::from_xyzw(0.3, -0.1, 0.5, 0.8).normalize()),
        translation: DVec3::new(0.5, -1.25, 2.0),
    }
}

/// The camera's rotation and place in the chunk.
fn camera(i: usize) -> (DMat3, DVec3) {
    let turn = DQuat::from_xyzw(0.1 * i as f64, 0.4, -0.2, 0.7).normalize();
    (DMat3::from_quat(turn), DVec3::new(1.0 - i as f64, 0.3, -2.0))
}

fn rows(matrix: DMat3) -> String {
    matrix.transpose().to_cols_array().map(|x| x.to_string()).join(" ")
}

const LENSES: [Agisoft; 3] = [FRAME, FISHEYE, PLAIN];

/// A file of as many cameras as lenses, one that is not aligned, and one that is disabled.
pub(crate) fn metashape_file() -> String {
    let Stand { scale, rotation, translation } = stand();
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\">\n\
                    <chunk label=\"Chunk 1\" enabled=\"true\">\n<sensors next_id=\"3\">\n"
        .to_owned();
    LENSES.iter().enumerate().for_each(|(i, lens)| text += &lens.sensor(i));
    let moved = translation.to_array().map(|x| x.to_string()).join(" ");
    write!(
        text,
        "</sensors>\n<components next_id=\"1\" active_id=\"0\">\n<component id=\"0\" label=\"Component 1\">\n<transform>\n\
         <rotation locked=\"true\">{}</rotation>\n<translation locked=\"true\">{moved}</translation>\n\
         <scale locked=\"true\">{scale}</scale>\n</transform>\n</component>\n</components>\n\
         <cameras next_id=\"5\" next_group_id=\"1\">\n",
        rows(rotation)
    )
    .unwrap();
    for i in 0..LENSES.len() {
        let (turn, at) = camera(i);
        let row = |r: usize| format!("{} {} {} {}", turn.row(r).x, turn.row(r).y, turn.row(r).z, at[r]);
        let transform = format!("{} {} {} 0 0 0 1", row(0), row(1), row(2));
        let camera = format!(
            "<camera id=\"{i}\" sensor_id=\"{i}\" component_id=\"0\" label=\"IMG_{i}\">\n<transform>{transform}</transform>\n\
             <orientation>1</orientation>\n</camera>\n"
        );
        // The second is in a folder of cameras.
        text += &if i == 1 { format!("<group id=\"0\" label=\"left\">{camera}</group>\n") } else { camera };
    }
    text += "<camera id=\"8\" sensor_id=\"0\" label=\"IMG_8\"/>\n\
             <camera id=\"9\" sensor_id=\"0\" enabled=\"false\" label=\"IMG_9\"><transform>1</transform></camera>\n</cameras>\n\
             <reference>LOCAL_CS[\"Local Coordinates (m)\"]</reference>\n</chunk>\n</document>\n";
    text
}

fn read_metashape(text: &str) -> Result<Vec<ImportedView>, String> {
    let file = File::new("cameras.xml", text.as_bytes());
    metashape::read(&file.path).map_err(|error| error.to_string())
}

#[test]
fn metashapes_cameras_project_by_agisofts_formulas() {
    let views = read_metashape(&metashape_file()).unwrap();
    assert_eq!(views.len(), LENSES.len());
    let Stand { scale, rotation, translation } = stand();
    for (i, (view, lens)) in views.iter().zip(LENSES).enumerate() {
        assert_eq!(
            (view.name.as_str(), view.picture.as_path()),
            (&*format!("IMG_{i}"), Path::new(&format!("IMG_{i}")))
        );
        assert_eq!([view.camera.width, view.camera.height], SIZE);
        let (turn, at) = camera(i);
        for point in points() {
            let in_chunk = turn * point + at;
            let (x, y, depth) = view.camera.project(scale * (rotation * in_chunk) + translation);
            near([x, y], lens.project(point), lens.kind);
            assert!((depth - scale * point.z).abs() < 1e-12);
        }
    }
    assert_eq!(views[2].camera.lens, Lens::default());
}

#[test]
fn a_chunk_without_a_transform_is_the_world() {
    let whole = metashape_file();
    let (before, rest) = whole.split_once("<components").unwrap();
    let (_, after) = rest.split_once("</components>").unwrap();
    let views = read_metashape(&format!("{before}{after}")).unwrap();
    let (turn, at) = camera(0);
    for point in points() {
        let (x, y, _) = views[0].camera.project(turn * point + at);
        near([x, y], FRAME.project(point), "no component");
    }
    // Older files have the chunk's own.
    let old = format!("{before}<transform><scale>2</scale></transform>{after}");
    let (x, y, _) =
        read_metashape(&old).unwrap()[0].camera.project(2.0 * (turn * DVec3::new(0.1, 0.2, 1.5) + at));
    near([x, y], FRAME.project(DVec3::new(0.1, 0.2, 1.5)), "the chunk's transform");
}

#[test]
fn metashapes_files_that_are_damaged_or_unknown_are_refused() {
    let whole = metashape_file();
    for (from, to, words) in [
        ("<b2>0</b2>", "<b2>0.5</b2>", "has skew between its axes"),
        ("<k4>0</k4>", "<k4>0.1</k4>", "has a k4"),
        ("<p2>-0.0007</p2>", "<p2>x</p2>", "p2: does not hold 1 finite numbers"),
        ("<k1>-0.08</k1>", "<k1>inf</k1>", "k1: does not hold 1 finite numbers"),
        ("<f>3512.25</f>", "<f>1e999</f>", "f: does not hold 1 finite numbers"),
        ("<f>3512.25</f>", "<f>-3</f>", "has the focal lengths"),
        ("<f>3512.25</f>", "<fx>3512.25</fx>", "PhotoScan before version 1.2"),
        ("<b1>-3.5</b1>", "<b1>-3.5</b1><p3>0.1</p3>", "has a third tangential coefficient"),
        ("type=\"frame\"", "type=\"spherical\"", "is of the type \"spherical\""),
        (
            "width=\"4000\"",
            "width=\"40000\"",
            "has an image of 40000 x 3000 pixels. A view has at most 16384",
        ),
        ("width=\"4000\"", "width=\"0\"", "has an image of 0 x 3000 pixels"),
        ("width=\"4000\"", "width=\"wide\"", "has no width and height"),
        (
            "sensor_id=\"0\" component_id",
            "sensor_id=\"7\" component_id",
            "refers to a sensor that is not there",
        ),
        ("<scale locked=\"true\">0.37", "<scale locked=\"true\">0", "scale: is 0"),
        ("0 0 0 1</transform>", "0 0 1</transform>", "transform: does not hold 16 finite numbers"),
        ("0 0 0 1</transform>", "0 0 1 1</transform>", "a last row other than 0, 0, 0, 1"),
        ("LOCAL_CS", "GEOGCS", "places the cameras on the globe"),
        ("</chunk>", "</chunk><chunk/>", "is a second chunk"),
        ("<chunk ", "<lump ", "is no camera file of Metashape"),
        ("label=\"IMG_8\"", "master_id=\"0\" label=\"IMG_8\"", "is a camera of a rig"),
    ] {
        let harmed = whole.replace(from, to);
        let harmed = if from == "<chunk " { harmed.replace("</chunk>", "</lump>") } else { harmed };
        assert_ne!(harmed, whole, "{from}");
        let told = read_metashape(&harmed).unwrap_err();
        assert!(told.contains("cameras.xml: ") && told.contains(words), "{words}: {told}");
    }
    let end = whole.trim_end().len();
    for length in (0..end).step_by(5).chain([end - 1]) {
        let told = read_metashape(&whole[..length]).unwrap_err();
        assert!(told.contains("cameras.xml: "), "{told}");
    }
    // Deep and self-referring files are refused, and ask for no memory.
    let deep = "<document>".repeat(100_000);
    assert!(read_metashape(&deep).is_err());
    let bomb = "<!DOCTYPE d [<!ENTITY a \"aaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]><document>&b;</document>";
    assert!(read_metashape(bomb).is_err());
}

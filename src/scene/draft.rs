//! A first scene file for a mesh: cameras that frame it, a light, its own maps.

use std::fmt::Write as _;

use glam::DVec3;

use super::import::ImportedView;
use super::inspect::MeshContents;
use super::lens::{Distortion, Lens};
use super::numbers::short;
use super::view::Camera;

/// Vertical field of view of the cameras that are made, in degrees: a portrait lens.
const FOV: f64 = 25.0;
/// The share of an image, from its centre to its border, that the mesh reaches.
const FILLED: f64 = 0.9;
/// Where the cameras stand: name, azimuth from +Z (glTF's front) towards +X, and height above the horizon, in degrees.
const STANDS: [(&str, f64, f64); 3] =
    [("front", 0.0, 0.0), ("three_quarter", 40.0, 5.0), ("profile", 90.0, 0.0)];
/// Beyond these heights, in metres, a mesh is hardly a head or a person in metres.
const LIKELY_METRES: [f64; 2] = [0.1, 3.0];

/// What a first scene file is made of; paths are as the file is to name them.
#[derive(Clone, Debug)]
pub struct Draft<'a> {
    /// What the mesh file holds.
    pub contents: &'a MeshContents,
    /// The mesh file.
    pub mesh: String,
    /// A panorama.
    pub environment: Option<String>,
    /// The maps' keys and files.
    pub maps: Vec<(&'static str, String)>,
    /// Cameras, each with its target; without any, cameras are made that frame the mesh.
    pub views: Vec<(ImportedView, Option<String>)>,
    /// A camera whose pose is not known: a view is made that frames the mesh through it.
    pub calibrated: Option<Camera>,
    /// Pixels along a side of the images of cameras that are made.
    pub size: u32,
}

impl Draft<'_> {
    /// The scene file.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.mesh_table(&mut out);
        self.maps_table(&mut out);
        self.light_tables(&mut out);
        self.model_table(&mut out);
        if let Some(camera) = &self.calibrated {
            self.calibrated_view(&mut out, camera);
        } else if self.views.is_empty() {
            for (name, azimuth, elevation) in STANDS {
                self.framing_view(&mut out, name, azimuth, elevation);
            }
            self.file_views(&mut out);
        }
        for (view, target) in &self.views {
            imported_view(&mut out, view, target.as_deref());
        }
        let free = match &self.environment {
            Some(_) => {
                "\"base_weight\", \"rim_weight\", \"side_specular\", \"hilite\", \"reflection\", \"occlusion\""
            }
            None => "\"base_weight\", \"specular_weight\", \"roughness\"",
        };
        line(&mut out, &format!("\n[fit]\nfree = [{free}]"));
        out
    }

    fn mesh_table(&self, out: &mut String) {
        let [least, most] = self.contents.bounds.map(DVec3::from);
        let height = (most - least).y;
        line(out, &format!("[mesh]\nfile = {}", quoted(&self.mesh)));
        let [lowest, highest] = LIKELY_METRES;
        if (lowest..=highest).contains(&height) {
            line(out, "metres_per_unit = 1.0");
        } else {
            let height = short(rounded(height, height));
            line(
                out,
                &format!(
                    "metres_per_unit = 1.0            # it is {height} units high: 0.01 if these are centimetres"
                ),
            );
        }
        let used =
            self.contents.materials.iter().filter(|material| self.contents.triangles_of(&material.name) > 0);
        let others: Vec<&str> = match self.contents.largest_material() {
            Some(skin) => used.map(|other| other.name.as_str()).filter(|name| *name != skin.name).collect(),
            None => Vec::new(),
        };
        if let Some(skin) = self.contents.largest_material().filter(|_| !others.is_empty()) {
            let names: String = others.join(", ").chars().filter(|c| !c.is_control()).collect();
            line(out, &format!("skin = [{}]  # drawn by their own material: {names}", quoted(&skin.name)));
        }
        if !self.contents.lights.is_empty() {
            line(out, "lights = true                    # those of the file");
        }
    }

    /// Whether the mesh's own material gives maps that no file here is named for: those that are looked up elsewhere than
    /// by the first texture coordinates.
    fn takes_own_maps(&self) -> bool {
        let skin = self.contents.largest_material();
        self.maps.is_empty() && skin.is_some_and(|skin| skin.color.is_some() || skin.normal.is_some())
    }

    fn maps_table(&self, out: &mut String) {
        if !self.maps.is_empty() {
            line(out, "\n[maps]");
        }
        for (key, file) in &self.maps {
            line(out, &format!("{key} = {}", quoted(file)));
        }
    }

    fn light_tables(&self, out: &mut String) {
        if let Some(file) = &self.environment {
            line(out, &format!("\n[environment]\nfile = {}", quoted(file)));
        } else if self.contents.lights.is_empty() {
            line(
                out,
                "\n# Stands in for the light that your targets were taken under: a panorama ([environment] file = ...), or \
                 lamps.\n[[light]]\nname = \"key\"\ntype = \"directional\"\ndirection = [-0.5, -0.6, -0.6]\n\
                 irradiance = [3.0, 2.9, 2.7]\n\n[[light]]\nname = \"fill\"\ntype = \"directional\"\n\
                 direction = [0.7, -0.1, -0.7]\nirradiance = [0.5, 0.55, 0.6]",
            );
        }
    }

    fn model_table(&self, out: &mut String) {
        let mut effects = Vec::new();
        if self.environment.is_some() {
            effects.extend(["diffuse", "occlusion", "rim", "side_specular", "hilite", "reflection"]);
        }
        if self.environment.is_none() || !self.contents.lights.is_empty() {
            effects.extend(["lights", "shadows", "light_specular"]);
        }
        let own = self.contents.largest_material().filter(|_| self.takes_own_maps());
        let own_normals = own.is_some_and(|skin| skin.normal.is_some());
        if own_normals || self.maps.iter().any(|(key, _)| *key == "normal") {
            effects.push("normal_map");
        }
        if !self.contents.morph_targets.is_empty() {
            effects.push("morph");
        }
        if self.contents.bones > 0 {
            effects.push("skin");
        }
        let names: Vec<String> = effects.iter().map(|name| format!("\"{name}\"")).collect();
        line(out, &format!("\n[model]\neffects = [{}]", names.join(", ")));
        let own_colors = own.is_some_and(|skin| skin.color.is_some());
        if !own_colors && !self.maps.iter().any(|(key, _)| *key == "color") {
            line(
                out,
                "\n[model.params]\nbase_weight = [0.6, 0.42, 0.34]  # there is no colour map: skin all over",
            );
        }
    }

    /// Where a camera stands at this side of the mesh, as near as all of it is seen, and what it looks at; `open` are the
    /// tangents of half its fields of view, across and down.
    fn framed(&self, azimuth: f64, elevation: f64, open: [f64; 2]) -> [String; 2] {
        let [least, most] = self.contents.bounds.map(DVec3::from);
        let centre = 0.5 * (least + most);
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        let away =
            DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
        let right = DVec3::Y.cross(away).normalize();
        let up = away.cross(right);
        let [across, down] = open.map(|tangent| FILLED * tangent);
        let enough = self.contents.positions.iter().map(|&position| {
            let from = position - centre;
            from.dot(away) + (from.dot(right).abs() / across).max(from.dot(up).abs() / down)
        });
        // A mesh of one point has no size to be framed by.
        let distance = enough.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let triple = |v: DVec3| v.to_array().map(|x| short(rounded(x, distance))).join(", ");
        [triple(centre + distance * away), triple(centre)]
    }

    /// A camera that is made.
    fn framing_view(&self, out: &mut String, name: &str, azimuth: f64, elevation: f64) {
        let [eye, target] = self.framed(azimuth, elevation, [(0.5 * FOV.to_radians()).tan(); 2]);
        line(
            out,
            &format!(
                "\n[[view]]\nname = \"{name}\"\neye = [{eye}]\nlook_at = [{target}]\nfov_y_degrees = {}",
                short(FOV)
            ),
        );
        let size = self.size;
        line(out, &format!("width = {size}\nheight = {size}\n# target = \"targets/{name}.exr\""));
    }

    /// A camera of which all is known but where it stood.
    fn calibrated_view(&self, out: &mut String, camera: &Camera) {
        let down = (0.5 * camera.fov_y).tan();
        let across = down * f64::from(camera.width) / f64::from(camera.height) / camera.lens.ratio;
        let (name, azimuth, elevation) = STANDS[0];
        let [eye, target] = self.framed(azimuth, elevation, [across, down]);
        line(
            out,
            &format!(
                "\n# A calibration does not say where the camera stood: correct eye, look_at and up, or give \
                 world_to_camera in their place.\n[[view]]\nname = \"{name}\"\neye = [{eye}]\nlook_at = [{target}]"
            ),
        );
        lens_lines(out, camera);
        line(out, &format!("# target = \"targets/{name}.png\""));
    }

    /// The file's own cameras, those whose names may be views'.
    fn file_views(&self, out: &mut String) {
        let mut names: Vec<String> = STANDS.iter().map(|(name, ..)| (*name).to_owned()).collect();
        for camera in self.contents.cameras.iter().filter(|camera| camera.usable) {
            // A view cannot tell which of two it names.
            if self.contents.cameras.iter().filter(|other| other.name == camera.name).count() > 1 {
                continue;
            }
            let safe = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '_' | '-') { c } else { '_' };
            let name: String =
                format!("camera_{}", camera.name.chars().take(40).map(safe).collect::<String>());
            if names.iter().any(|other| other.eq_ignore_ascii_case(&name)) {
                continue;
            }
            let aspect = camera.aspect.unwrap_or(1.0).clamp(0.1, 10.0);
            let width = (f64::from(self.size) * aspect).round() as u32;
            line(out, &format!("\n[[view]]\nname = \"{name}\"\ncamera = {}", quoted(&camera.name)));
            line(out, &format!("width = {width}\nheight = {}\n# target = \"targets/{name}.exr\"", self.size));
            names.push(name);
        }
    }
}

/// A camera that another program placed, to the last digit.
fn imported_view(out: &mut String, view: &ImportedView, target: Option<&str>) {
    let ImportedView { name, camera, .. } = view;
    let rows = camera.world_to_camera.transpose().to_cols_array().map(short).join(", ");
    line(out, &format!("\n[[view]]\nname = \"{name}\"\nworld_to_camera = [{rows}]"));
    lens_lines(out, camera);
    match target {
        Some(target) => line(out, &format!("target = {}", quoted(target))),
        None => line(out, &format!("# target = \"targets/{name}.png\"")),
    }
}

/// What a camera is, wherever it stands.
fn lens_lines(out: &mut String, camera: &Camera) {
    let (width, height) = (camera.width, camera.height);
    line(
        out,
        &format!("fov_y_degrees = {}\nwidth = {width}\nheight = {height}", short(camera.fov_y.to_degrees())),
    );
    if camera.lens != Lens::default() {
        let focal = 0.5 * f64::from(height) / (0.5 * camera.fov_y).tan();
        let (cx, cy) =
            (0.5 * f64::from(width) + camera.lens.centre[0], 0.5 * f64::from(height) + camera.lens.centre[1]);
        let mut numbers = vec![("cx", cx), ("cy", cy), ("fx", focal * camera.lens.ratio)];
        let mut model = "";
        match camera.lens.distortion {
            None => {}
            Some(Distortion::Brown { k: [k1, k2, k3], p: [p1, p2] }) => {
                numbers.extend([("k1", k1), ("k2", k2), ("k3", k3), ("p1", p1), ("p2", p2)]);
            }
            Some(Distortion::Fisheye { k: [k1, k2, k3, k4] }) => {
                model = "model = \"fisheye\", ";
                numbers.extend([("k1", k1), ("k2", k2), ("k3", k3), ("k4", k4)]);
            }
        }
        let numbers: Vec<String> =
            numbers.into_iter().map(|(name, number)| format!("{name} = {}", short(number))).collect();
        line(out, &format!("lens = {{ {model}{} }}", numbers.join(", ")));
    }
}

fn line(out: &mut String, text: &str) {
    // A string takes whatever is written.
    let _ = writeln!(out, "{text}");
}

/// A string as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// To a ten-thousandth of `scale`: finer than a pixel of the images.
fn rounded(x: f64, scale: f64) -> f64 {
    let digits = (4.0 - scale.abs().max(f64::MIN_POSITIVE).log10().ceil()).clamp(-300.0, 300.0);
    let unit = 10.0_f64.powf(digits);
    let rounded = (x * unit).round() / unit;
    // No minus before nothing; what cannot be rounded so stays.
    if !rounded.is_finite() {
        x
    } else if rounded == 0.0 {
        0.0
    } else {
        rounded
    }
}

//! The scene file of the built-in scene: cameras, start values, what is free, and the truth.

use std::fmt::Write;

use glam::{DMat4, DVec3};

use crate::model::effects::Form;
use crate::model::params::{Param, Params};

/// Pixels along a side of each view.
const SIZE: u32 = 320;
/// Vertical field of view, degrees.
const FOV: f64 = 25.0;

/// The constants behind the targets, for every free parameter; the rest stand at their defaults.
const TRUTH: [(Param, [f64; 3]); 9] = [
    (Param::BaseWeight, [0.85; 3]),
    (Param::RimWeight, [0.90, 0.72, 0.58]),
    (Param::RimExponent, [2.7; 3]),
    (Param::SideSpecular, [0.45; 3]),
    (Param::Hilite, [0.52, 0.36, 0.24]),
    (Param::Reflection, [0.055; 3]),
    (Param::Occlusion, [0.78; 3]),
    (Param::NormalStrength, [1.35; 3]),
    (Param::SpecularLobe, [19.0; 3]),
];

/// The parameters that the scene leaves free, with their true values; one that has three different
/// values is free in each channel.
#[must_use]
pub const fn truth() -> &'static [(Param, [f64; 3])] {
    &TRUTH
}

/// Every parameter at the values that the targets are rendered with.
#[must_use]
pub fn true_params() -> Params {
    let mut params = Params::defaults(Form::Corrected);
    for (param, value) in TRUTH {
        params.set_rgb(param, value);
    }
    params
}

/// A camera: name, azimuth from +Z towards +X, height above the horizon (degrees), what it looks at
/// and how far it stands from there (metres).
struct Stand {
    name: &'static str,
    azimuth: f64,
    elevation: f64,
    towards: DVec3,
    distance: f64,
}

const STANDS: [Stand; 3] = [
    Stand {
        name: "front",
        azimuth: 4.0,
        elevation: 2.0,
        towards: DVec3::new(0.0, -0.034, 0.02),
        distance: 0.71,
    },
    Stand {
        name: "three_quarter",
        azimuth: 42.0,
        elevation: 4.0,
        towards: DVec3::new(0.0, -0.034, 0.0),
        distance: 0.71,
    },
    Stand {
        name: "profile",
        azimuth: -97.0,
        elevation: 1.0,
        towards: DVec3::new(0.0, -0.034, 0.0),
        distance: 0.71,
    },
];

impl Stand {
    fn world_to_camera(&self) -> DMat4 {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        let out =
            DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
        let right = DVec3::Y.cross(out).normalize();
        let camera = DMat4::from_cols(
            right.extend(0.0),
            out.cross(right).extend(0.0),
            out.extend(0.0),
            (self.towards + out * self.distance).extend(1.0),
        );
        camera.inverse()
    }
}

/// The text of scene.toml.
pub(super) fn text() -> String {
    let mut out = String::from(
        "# The built-in scene: written by `skinfit demo`, the same bytes every time.\n\
         # Copy this folder and change what you like.\n\n\
         # A smile with raised brows, from near the top of the nod.\n\
         [mesh]\nfile = \"head.glb\"\nmorph_weights = [0.35, 0.0, 0.15, 0.0, 0.0]\ntime = 1.25\n\n\
         [maps]\ncolor = \"color.png\"\nnormal = \"normal.png\"\nspecular = \"specular.png\"\n\
         attenuator = \"attenuator.png\"\n\n\
         [environment]\nfile = \"environment.exr\"\n\n\
         [model]\nform = \"corrected\"\neffects = [\"diffuse\", \"normal_map\", \"occlusion\", \"rim\", \
         \"side_specular\", \"hilite\", \"reflection\", \"morph\", \"skin\"]\n\n\
         # Start values: the defaults. The targets were rendered with other ones.\n[model.params]\n",
    );
    for (param, value) in TRUTH {
        let start = param.default(Form::Corrected);
        let tied = value[0] == value[1] && value[1] == value[2];
        let start = if tied { format!("{start:?}") } else { format!("[{start:?}, {start:?}, {start:?}]") };
        line(&mut out, format_args!("{} = {start}", param.name()));
    }
    for stand in &STANDS {
        let rows = stand.world_to_camera().transpose().to_cols_array();
        let rows: Vec<String> = rows.iter().map(|x| format!("{:?}", rounded(*x))).collect();
        let target = format!("targets/{}.exr", stand.name);
        line(&mut out, format_args!("\n[[view]]\nname = \"{}\"", stand.name));
        line(&mut out, format_args!("world_to_camera = [{}]", rows.join(", ")));
        line(&mut out, format_args!("fov_y_degrees = {FOV:?}\nwidth = {SIZE}\nheight = {SIZE}"));
        line(&mut out, format_args!("target = \"{target}\""));
    }
    let free: Vec<String> = TRUTH.iter().map(|(param, _)| format!("\"{}\"", param.name())).collect();
    line(&mut out, format_args!("\n[fit]\nfree = [{}]\nloss = \"relative_l2\"", free.join(", ")));
    out
}

fn line(out: &mut String, text: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{text}");
}

/// Twelve decimals: a rigid motion to within a picometre, and no "-0.0".
fn rounded(x: f64) -> f64 {
    (x * 1e12).round() / 1e12 + 0.0
}

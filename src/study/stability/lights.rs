//! Lights to look up: an ordinary one, a glaring one, darkness, and a scene's own.

use std::sync::Arc;

use crate::bake::Illumination;
use crate::bake::LobeStack;
use crate::model::cube::{Cube, texel_direction};

/// Which light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightKind {
    /// Smooth waves around 1.
    Wavy,
    /// Texels of 65504, the largest of half floats, beside texels of 0.
    Glaring,
    /// 0 everywhere.
    Dark,
    /// The cubes of the scene that is swept.
    Scene,
}

impl LightKind {
    /// Those that need no scene.
    pub const OWN: [Self; 3] = [Self::Wavy, Self::Glaring, Self::Dark];
    /// Every light.
    pub const ALL: [Self; 4] = [Self::Wavy, Self::Glaring, Self::Dark, Self::Scene];

    /// The name in files of kept cases.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wavy => "wavy",
            Self::Glaring => "glaring",
            Self::Dark => "dark",
            Self::Scene => "scene",
        }
    }
}

/// The cubes of every light.
#[derive(Debug)]
pub struct LightBox {
    own: [Arc<Illumination>; 3],
    scene: Option<Arc<Illumination>>,
}

impl LightBox {
    /// The lights, with those of a scene where one is swept.
    #[must_use]
    pub fn new(scene: Option<Arc<Illumination>>) -> Self {
        Self { own: [wavy(), glaring(), dark()].map(Arc::new), scene }
    }

    /// The cubes of a light; darkness stands in for a scene's where there is no scene.
    #[must_use]
    pub fn of(&self, kind: LightKind) -> &Arc<Illumination> {
        let [wavy, glaring, dark] = &self.own;
        match kind {
            LightKind::Wavy => wavy,
            LightKind::Glaring => glaring,
            LightKind::Dark => dark,
            LightKind::Scene => self.scene.as_ref().unwrap_or(dark),
        }
    }
}

/// Texels along a face: few, so that edges and corners are near.
const SIZE: usize = 4;

fn stack(cube: impl Fn(f64) -> Cube<f32>) -> LobeStack {
    let exponents = vec![16.0, 32.0, 64.0];
    let cubes = [0.7, 1.1, 1.3].map(cube).to_vec();
    LobeStack { exponents, cubes }
}

fn wavy() -> Illumination {
    let cube = |phase: f64| {
        Cube::from_fn(SIZE, |face, column, row| {
            let [x, y, z] = texel_direction(face, column, row, SIZE);
            let wave = |k: f64| 1.2 + (k * x + phase).sin() * (2.0 * y).cos() + 0.3 * z * k.sin();
            [1.0, 1.7, 2.3, 3.1].map(|k| wave(k).abs() as f32)
        })
    };
    Illumination {
        irradiance: Some(cube(0.3)),
        lobes: Some(stack(cube)),
        hilite: Some(cube(2.1)),
        reflected: None,
    }
}

/// Every second texel of a checkerboard shines; the lobes stay the same for every exponent, as the spline
/// between cubes that differ so much would be negative.
fn glaring() -> Illumination {
    let cube = |_: f64| {
        Cube::from_fn(SIZE, |face, column, row| {
            [if (face + column + row) % 2 == 1 { 65504.0 } else { 0.0 }; 4]
        })
    };
    Illumination {
        irradiance: Some(cube(0.0)),
        lobes: Some(stack(cube)),
        hilite: Some(cube(0.0)),
        reflected: None,
    }
}

fn dark() -> Illumination {
    let cube = |_: f64| Cube::from_fn(SIZE, |_, _, _| [0.0; 4]);
    Illumination {
        irradiance: Some(cube(0.0)),
        lobes: Some(stack(cube)),
        hilite: Some(cube(0.0)),
        reflected: None,
    }
}

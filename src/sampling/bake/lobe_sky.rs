//! The environment as rays into specular lobes look it up: blurred over the solid angle that a ray stands for.

use std::f64::consts::PI;

use glam::Vec3A;

use super::panorama::Radiance;
use crate::model::cube::{Cube, texel_solid_angle};
use crate::model::params::{Param, Params};
use crate::scene::Scene;
use crate::scene::sky_lights::sky_lights;

/// Texels along a face of the finest cube, each a third of a degree wide: a lobe of alpha 0.04 is some degrees wide.
const FINEST: usize = 256;

/// Cubes of the environment without its lights, each of half the size of the one before.
#[derive(Clone, Debug)]
pub struct LobeSky(Vec<Cube<f32>>);

impl LobeSky {
    /// That of a scene as its parameters turn it; none where there is no environment.
    #[must_use]
    pub fn of_scene(scene: &Scene) -> Option<Self> {
        Self::at(scene, &scene.params)
    }

    /// The same as other parameters turn it.
    #[must_use]
    pub fn at(scene: &Scene, params: &Params) -> Option<Self> {
        let environment = scene.environment.as_ref()?;
        // What became lights shines as such.
        let rest = (!scene.sky_lights.is_empty()).then(|| sky_lights(environment).rest);
        let environment = rest.as_ref().unwrap_or(environment);
        let turn = environment.rotation_degrees + params.scalar(Param::EnvironmentRotation);
        Some(Self::new(Radiance::turned(environment, turn).to_cube(FINEST)))
    }

    fn new(mut cube: Cube<f64>) -> Self {
        let single = |cube: &Cube<f64>| cube.map(|texel| texel.map(|x| x as f32));
        let mut levels = vec![single(&cube)];
        while cube.size() > 2 {
            cube = halved(&cube);
            levels.push(single(&cube));
        }
        Self(levels)
    }

    /// The cubes, the finest first.
    #[must_use]
    pub fn levels(&self) -> &[Cube<f32>] {
        &self.0
    }

    /// The mean radiance about the unit direction `d` over a solid angle, steradians, rgb.
    #[must_use]
    pub fn along(&self, d: Vec3A, solid_angle: f64) -> [f64; 3] {
        let last = self.0.len() - 1;
        // A texel has 4 pi / 6 n^2 of it.
        let size = (4.0 * PI / (6.0 * solid_angle)).sqrt();
        let level = (self.0[0].size() as f64 / size).log2().clamp(0.0, last as f64);
        let (low, part) = (level.floor() as usize, level.fract());
        let at = |level: usize| -> [f64; 3] {
            let [r, g, b, _]: [f32; 4] = self.0[level.min(last)].sample(d.to_array());
            [r, g, b].map(f64::from)
        };
        let (fine, coarse) = (at(low), at(low + 1));
        [0, 1, 2].map(|c| fine[c] + part * (coarse[c] - fine[c]))
    }
}

/// Means of four texels each, by their solid angles.
fn halved(cube: &Cube<f64>) -> Cube<f64> {
    let size = cube.size();
    Cube::from_fn(size / 2, |face, column, row| {
        let (mut sum, mut whole) = ([0.0; 4], 0.0);
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (x, y) = (2 * column + x, 2 * row + y);
            let weight = texel_solid_angle(x, y, size);
            let texel = cube.texel(face, x, y);
            (0..4).for_each(|c| sum[c] += weight * texel[c]);
            whole += weight;
        }
        sum.map(|sum| sum / whole)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_has_the_light_of_the_first_and_wide_rays_see_the_mean() {
        let cube = Cube::from_fn(16, |face, column, row| {
            [face as f64, column as f64, if (row, face) == (3, 2) { 40.0 } else { 0.1 }, 0.0]
        });
        let flux = |cube: &Cube<f32>| -> [f64; 3] {
            let mut sum = [0.0; 3];
            for i in 0..6 * cube.size() * cube.size() {
                let (face, place) = (i / (cube.size() * cube.size()), i % (cube.size() * cube.size()));
                let (column, row) = (place % cube.size(), place / cube.size());
                let weight = texel_solid_angle(column, row, cube.size());
                let texel = cube.texel(face, column, row);
                (0..3).for_each(|c| sum[c] += weight * f64::from(texel[c]));
            }
            sum
        };
        let sky = LobeSky::new(cube);
        let first = flux(&sky.0[0]);
        assert_eq!(sky.0.last().unwrap().size(), 2);
        for level in &sky.0 {
            for (sum, first) in flux(level).into_iter().zip(first) {
                // A texel of a level has the solid angle of its four: roundings of f32.
                assert!((sum - first).abs() < 1e-5 * first, "{}: {sum} {first}", level.size());
            }
        }
        // A ray that stands for all directions sees its face's quarter at least.
        let wide = sky.along(Vec3A::Y, 4.0 * PI);
        assert!(wide.iter().all(|x| x.is_finite()) && wide[0] > 0.5, "{wide:?}");
        // The finest level as it is.
        let fine = sky.along(Vec3A::new(1.0, 0.01, 0.01).normalize(), 1e-9);
        assert!(fine[0] < 1e-6, "{fine:?}");
    }
}

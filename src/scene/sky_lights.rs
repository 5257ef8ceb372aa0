//! The brightest spots of a panorama, taken out as directional lights (MODEL 8).
//!
//! A sun that is left in a filtered environment shines through what stands before it; taken out, it can have a shadow.
//! The brightest place is found, moved twice to the middle of the energy around it, and everything within the spot's
//! angle becomes one light; then the next. What light there is stays what it was: a light's irradiance is the sum of
//! radiance times solid angle of the texels that are black from then on.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::light::{Beam, Light, LightKind};
use super::maps::{Environment, Map, luminance};

/// This file, for caches of what is made of it.
#[doc(hidden)]
pub const SOURCE: &str = include_str!("sky_lights.rs");

/// The brightest place is looked for among means over cells of this share of a spot's angle, so that one hot texel of
/// a fine panorama does not hide a lamp.
const CELLS_IN_A_SPOT: f64 = 0.25;
/// How many times as bright as the mean of what is left a spot has to be. The brightest place of an overcast sky is no
/// light of its own: taken out it would leave a black hole in an even sky.
const BRIGHTER: f64 = 2.0;

/// An environment's lights, and what it is without them.
#[derive(Clone, Debug)]
pub struct SkyLights {
    /// `sky_1`, `sky_2` and so on, in the environment's frame: [`Light::turned`] by its rotation they stand in the world.
    /// Their irradiance has the environment's intensity in it.
    pub lights: Vec<Light>,
    /// The environment without their light, from which nothing more is to be taken.
    pub rest: Environment,
}

impl SkyLights {
    /// The lights as the environment's own turn has them.
    #[must_use]
    pub fn lights_in_world(&self, environment: &Environment) -> Vec<Light> {
        self.lights.iter().map(|light| light.turned(environment.rotation_degrees)).collect()
    }
}

/// Take the brightest spots out of an environment, as many as it says. Fewer, where the brightest one that is left is not
/// twice as bright as the mean of the rest: there is none in an even sky.
#[must_use]
pub fn sky_lights(environment: &Environment) -> SkyLights {
    let mut rest = environment.clone();
    rest.spots.count = 0;
    let mut lights = Vec::new();
    let Map { width, height, texels } = &rest.panorama;
    // Bakes refuse such an image by name.
    if texels.len() != width * height {
        return SkyLights { lights, rest };
    }
    let mut sky = Sky::new(&mut rest.panorama, environment.spots.degrees.to_radians());
    for number in 1..=environment.spots.count {
        let Some(spot) = sky.brightest() else { break };
        lights.push(Light {
            name: format!("sky_{number}"),
            kind: LightKind::Directional(Beam {
                direction: -spot.towards,
                irradiance: sky.take(&spot.texels).map(|flux| flux * environment.intensity),
                angular_diameter_degrees: spot.diameter.to_degrees(),
            }),
        });
    }
    SkyLights { lights, rest }
}

/// A panorama that spots are taken from.
struct Sky<'a> {
    map: &'a mut Map<3>,
    /// Whether a texel is a light's.
    taken: Vec<bool>,
    /// The angle around its middle within which all is a spot's, radians.
    reach: f64,
    /// Texels along a side of a cell.
    cell: usize,
    /// Mean luminance of each cell, row by row.
    cells: Vec<f64>,
}

/// A spot that may become a light.
struct Spot {
    /// The unit vector to the middle of its energy.
    towards: DVec3,
    /// Of a disc as bright everywhere whose light is spread as far, radians.
    diameter: f64,
    texels: Vec<usize>,
}

/// What is known of the texels around a place.
#[derive(Default)]
struct Around {
    texels: Vec<usize>,
    energy: f64,
    solid_angle: f64,
    moment: DVec3,
}

impl<'a> Sky<'a> {
    fn new(map: &'a mut Map<3>, reach: f64) -> Self {
        let texel = TAU / map.width.max(1) as f64;
        let cell = ((CELLS_IN_A_SPOT * reach / texel) as usize).max(1);
        let taken = vec![false; map.texels.len()];
        let mut sky = Self { map, taken, reach, cell, cells: Vec::new() };
        sky.cells = (0..sky.cell_rows()).into_par_iter().flat_map_iter(|row| sky.row_of_cells(row)).collect();
        sky
    }

    fn cell_rows(&self) -> usize {
        self.map.height.div_ceil(self.cell)
    }

    fn cell_columns(&self) -> usize {
        self.map.width.div_ceil(self.cell)
    }

    /// The angle from +Y of a row's upper edge; that of its lower edge is the next row's.
    fn edge(&self, row: usize) -> f64 {
        row as f64 / self.map.height as f64 * PI
    }

    /// Of a texel in that row.
    fn solid_angle(&self, row: usize) -> f64 {
        TAU / self.map.width as f64 * (self.edge(row).cos() - self.edge(row + 1).cos())
    }

    /// The unit vector to a texel's centre.
    fn direction(&self, texel: usize) -> DVec3 {
        let (column, row) = (texel % self.map.width, texel / self.map.width);
        let (sine, y) = ((row as f64 + 0.5) / self.map.height as f64 * PI).sin_cos();
        let (x, z) = (((column as f64 + 0.5) / self.map.width as f64 - 0.5) * TAU).sin_cos();
        DVec3::new(sine * x, y, -sine * z)
    }

    fn luminance(&self, texel: usize) -> f64 {
        f64::from(luminance(self.map.texels[texel]))
    }

    fn row_of_cells(&self, row: usize) -> Vec<f64> {
        let rows = row * self.cell..((row + 1) * self.cell).min(self.map.height);
        let mean = |column: usize| {
            let columns = column * self.cell..((column + 1) * self.cell).min(self.map.width);
            let (mut energy, mut area) = (0.0, 0.0);
            for row in rows.clone() {
                let solid_angle = self.solid_angle(row);
                for column in columns.clone() {
                    energy += solid_angle * self.luminance(row * self.map.width + column);
                    area += solid_angle;
                }
            }
            energy / area
        };
        (0..self.cell_columns()).map(mean).collect()
    }

    /// The middle of the brightest cell; of several, the first.
    fn brightest_place(&self) -> Option<DVec3> {
        let brighter =
            |best: (usize, f64), (i, &mean): (usize, &f64)| if mean > best.1 { (i, mean) } else { best };
        let (cell, _) = self.cells.iter().enumerate().fold((usize::MAX, 0.0), brighter);
        if cell == usize::MAX {
            return None;
        }
        let middle = |cell: usize, size: usize| (cell * self.cell + self.cell / 2).min(size - 1);
        let (row, column) = (cell / self.cell_columns(), cell % self.cell_columns());
        let (row, column) = (middle(row, self.map.height), middle(column, self.map.width));
        Some(self.direction(row * self.map.width + column))
    }

    /// The texels within a spot about a unit vector; not those that are a light's already.
    fn around(&self, middle: DVec3) -> Around {
        let (height, theta) = (self.map.height, middle.y.clamp(-1.0, 1.0).acos());
        let row = |angle: f64| (angle / PI * height as f64 - 0.5).clamp(0.0, (height - 1) as f64);
        let (first, last) =
            (row(theta - self.reach).floor() as usize, row(theta + self.reach).ceil() as usize);
        // The middle's own texel is always within, whatever the roundings.
        let least = self.reach.cos() - 1e-12;
        let mut found = Around::default();
        for row in first..=last {
            let solid_angle = self.solid_angle(row);
            for texel in row * self.map.width..(row + 1) * self.map.width {
                let direction = self.direction(texel);
                if self.taken[texel] || direction.dot(middle) < least {
                    continue;
                }
                let energy = solid_angle * self.luminance(texel);
                found.texels.push(texel);
                found.energy += energy;
                found.solid_angle += solid_angle;
                found.moment += energy * direction;
            }
        }
        found
    }

    /// The next light, where there is a spot that is bright enough.
    fn brightest(&self) -> Option<Spot> {
        let mut towards = self.brightest_place()?;
        for _ in 0..2 {
            towards = self.around(towards).moment.try_normalize()?;
        }
        let found = self.around(towards);
        let towards = found.moment.try_normalize()?;
        if found.energy <= BRIGHTER * self.mean_of_the_rest() * found.solid_angle {
            return None;
        }
        // An even disc of radius a has the mean square angle a^2 / 2.
        let diameter = 2.0 * (2.0 * self.spread(&found, towards)).sqrt();
        Some(Spot { towards, diameter: diameter.min(2.0 * self.reach), texels: found.texels })
    }

    /// The mean square angle of a spot's energy from its middle. A texel's light is spread over the texel.
    fn spread(&self, found: &Around, middle: DVec3) -> f64 {
        let high = PI / self.map.height as f64;
        let square = |&texel: &usize| {
            let direction = self.direction(texel);
            let wide = TAU / self.map.width as f64 * direction.x.hypot(direction.z);
            let off = direction.cross(middle).length().atan2(direction.dot(middle));
            let within = (wide * wide + high * high) / 12.0;
            self.solid_angle(texel / self.map.width) * self.luminance(texel) * (off * off + within)
        };
        found.texels.iter().map(square).sum::<f64>() / found.energy
    }

    /// Mean luminance of the texels that are no light's.
    fn mean_of_the_rest(&self) -> f64 {
        let row = |row: usize| {
            let texels =
                (row * self.map.width..(row + 1) * self.map.width).filter(|&texel| !self.taken[texel]);
            let (mut energy, mut count) = (0.0, 0.0);
            for texel in texels {
                energy += self.luminance(texel);
                count += 1.0;
            }
            let solid_angle = self.solid_angle(row);
            [solid_angle * energy, solid_angle * count]
        };
        let rows: Vec<[f64; 2]> = (0..self.map.height).into_par_iter().map(row).collect();
        let [energy, area] = rows.iter().fold([0.0; 2], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
        energy / area
    }

    /// Leave the texels black: their radiance times solid angle, summed.
    fn take(&mut self, texels: &[usize]) -> [f64; 3] {
        let mut flux = [0.0; 3];
        for &texel in texels {
            let solid_angle = self.solid_angle(texel / self.map.width);
            let radiance = std::mem::take(&mut self.map.texels[texel]);
            (0..3).for_each(|c| flux[c] += solid_angle * f64::from(radiance[c]));
            self.taken[texel] = true;
        }
        let of_row = |texel: &usize| texel / self.map.width / self.cell;
        let (first, last) = (texels.iter().map(of_row).min(), texels.iter().map(of_row).max());
        for row in first.unwrap_or(0)..=last.unwrap_or(0) {
            let columns = self.cell_columns();
            let cells = self.row_of_cells(row);
            self.cells[row * columns..(row + 1) * columns].copy_from_slice(&cells);
        }
        flux
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::Spots;

    /// Radiance times solid angle over the sphere.
    fn total(environment: &Environment) -> [f64; 3] {
        let Map { width, height, texels } = &environment.panorama;
        let mut sum = [0.0; 3];
        for (i, texel) in texels.iter().enumerate() {
            let edge = |row: usize| (row as f64 / *height as f64 * PI).cos();
            let solid_angle = TAU / *width as f64 * (edge(i / width) - edge(i / width + 1));
            (0..3).for_each(|c| sum[c] += environment.intensity * solid_angle * f64::from(texel[c]));
        }
        sum
    }

    fn environment(width: usize, count: u32, texel: impl Fn(usize, usize) -> [f32; 3]) -> Environment {
        let height = width / 2;
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Environment {
            panorama: Map { width, height, texels },
            rotation_degrees: 30.0,
            intensity: 0.5,
            spots: Spots { count, ..Spots::default() },
        }
    }

    /// Nothing may be lost, and everything is finite.
    fn taken(environment: &Environment) -> SkyLights {
        let found = sky_lights(environment);
        let mut left = total(&found.rest);
        for light in &found.lights {
            assert!(Light::new(&light.name, light.kind.clone()).is_ok(), "{light:?}");
            (0..3).for_each(|c| left[c] += light.strength()[c]);
        }
        let whole = total(environment);
        // Sums of as many as 10^5 numbers in f64, in another order.
        assert!((0..3).all(|c| (left[c] - whole[c]).abs() <= 1e-10 * whole[c]), "{left:?} {whole:?}");
        found
    }

    fn beam(light: &Light) -> &Beam {
        match &light.kind {
            LightKind::Directional(beam) => beam,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn suns_come_out_by_brightness_where_they_stand_and_as_wide_as_they_are() {
        // At +X and, across the seam of the image, at +Z.
        let suns = environment(512, 2, |x, y| match (x, y) {
            (383 | 384, 127 | 128) => [1000.0, 500.0, 0.0],
            (0 | 511, 127 | 128) => [0.0, 800.0, 0.0],
            _ => [0.02; 3],
        });
        let found = taken(&suns);
        let names: Vec<&str> = found.lights.iter().map(|light| light.name.as_str()).collect();
        assert_eq!(names, ["sky_1", "sky_2"]);
        // 0.2126 R + 0.7152 G: the sun at +X has 570 to the other's 572.
        for (light, towards) in found.lights.iter().zip([DVec3::Z, DVec3::X]) {
            // Even light around it moves the middle by as little as the disc's texels are uneven.
            assert!((light.towards(DVec3::ZERO) - towards).length() < 1e-4, "{light:?}");
        }
        // Four texels of TAU / 512: (2 TAU / 512)^2 / 6 the mean square, beside the sky around.
        let side = 2.0 * TAU / 512.0;
        let alone = 2.0 * (2.0 * side * side / 6.0).sqrt();
        let diameter = beam(&found.lights[0]).angular_diameter_degrees.to_radians();
        assert!(diameter > alone && diameter < 1.1 * alone, "{diameter} {alone}");
        assert_eq!(found.rest.spots.count, 0);
    }

    #[test]
    fn an_even_sky_has_no_lights_and_a_lone_sun_is_one_however_many_are_asked_for() {
        assert!(taken(&environment(64, 64, |_, _| [0.37, 1.0, 65504.0])).lights.is_empty());
        assert!(taken(&environment(64, 3, |_, _| [0.0; 3])).lights.is_empty());
        assert!(taken(&environment(64, 0, |x, _| [x as f32; 3])).lights.is_empty());
        let lone = environment(64, 64, |x, y| if (x, y) == (20, 0) { [65504.0; 3] } else { [0.0; 3] });
        let found = taken(&lone);
        assert_eq!(found.lights.len(), 1);
        assert!(found.rest.panorama.texels.iter().all(|texel| *texel == [0.0; 3]));
        // Texels far larger than the spot: each is one. And one alone.
        let found = taken(&environment(8, 64, |x, _| [(x * x) as f32; 3]));
        assert!((4..32).contains(&found.lights.len()), "{:?}", found.lights);
        let mut single = environment(8, 4, |_, _| [1.0; 3]);
        single.panorama = Map { width: 1, height: 1, texels: vec![[3.0; 3]] };
        assert!(taken(&single).lights.is_empty());
        single.panorama = Map { width: 2, height: 1, texels: Vec::new() };
        assert!(sky_lights(&single).lights.is_empty());
    }

    #[test]
    fn a_fine_panorama_gives_the_lights_of_a_coarse_one() {
        // A lamp of 6 x 6 degrees, and one texel that is brighter and has no light to speak of.
        let lamp = |width: usize| {
            environment(width, 1, move |x, y| {
                let degrees = |i: usize| (i as f64 + 0.5) * 360.0 / width as f64;
                let (u, v) = (degrees(x), degrees(y));
                match (200.0..206.0).contains(&u) && (60.0..66.0).contains(&v) {
                    true => [50.0; 3],
                    false if width > 512 && (x, y) == (width / 4, height_of(width)) => [500.0; 3],
                    false => [0.1; 3],
                }
            })
        };
        let [coarse, fine] = [512, 2048].map(|width| taken(&lamp(width)).lights.remove(0));
        // Whole texels of 0.7 degrees at the edges of a lamp of 6.
        assert!(coarse.towards(DVec3::ZERO).dot(fine.towards(DVec3::ZERO)) > 0.7_f64.to_radians().cos());
        let [a, b] = [coarse, fine].map(|light| light.strength()[0]);
        assert!((a / b - 1.0).abs() < 0.25, "{a} {b}");
    }

    fn height_of(width: usize) -> usize {
        width / 4 + 3
    }
}

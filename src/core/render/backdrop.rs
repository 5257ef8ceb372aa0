//! What stands behind the mesh in pictures: the environment as the camera sees it, or a colour.

use rayon::prelude::*;

use super::image::Image;
use crate::bake::panorama::Radiance;
use crate::model::effects::Effect;
use crate::model::gain::Gain;
use crate::model::params::{Param, Params};
use crate::scene::Scene;
use crate::scene::view::{Background, Camera};

/// The radiance behind each pixel of a view, row by row from the top, and what of it blooms.
#[derive(Clone, Debug, PartialEq)]
pub struct Backdrop {
    /// Linear radiance, Rec.709.
    pub rgb: Vec<[f32; 3]>,
    /// Radiance times its haze; empty where no bloom asks for it.
    pub glow: Vec<[f32; 3]>,
}

impl Backdrop {
    /// What `background` shows to `camera`, the mean of `n` x `n` directions a pixel; none for
    /// [`Background::None`], and for the environment of a scene that has none.
    ///
    /// The environment is turned by its rotation and by `environment_rotation`. A backdrop's haze is that of a
    /// mirror of dapple 1 and attenuator 1, `haze_weight` times luminance, up to 1: the paper keeps it in the
    /// frame buffer's alpha, which ends there.
    #[must_use]
    pub fn new(
        scene: &Scene,
        params: &Params,
        background: Background,
        camera: &Camera,
        n: u32,
    ) -> Option<Self> {
        let blooms = scene.effects.has(Effect::Bloom);
        let weight = params.scalar(Param::HazeWeight);
        let pixels = camera.width as usize * camera.height as usize;
        let both = |[r, g, b]: [f64; 3]| {
            let haze = (weight * (0.2126 * r + 0.7152 * g + 0.0722 * b)).clamp(0.0, 1.0);
            ([r, g, b], [r, g, b].map(|c| haze * c))
        };
        let seen: Vec<([f64; 3], [f64; 3])> = match background {
            Background::None => return None,
            Background::Color(rgb) => vec![both(rgb); pixels],
            Background::Environment => {
                let environment = scene.environment.as_ref()?;
                let turn = environment.rotation_degrees + params.scalar(Param::EnvironmentRotation);
                let radiance = Radiance::whole(environment, turn);
                let along = |x: f64, y: f64| both(radiance.along(camera.direction(x, y).to_array()));
                let width = camera.width as usize;
                let pixel = |i: usize| mean((i % width) as f64, (i / width) as f64, n, &along);
                (0..pixels).into_par_iter().map(pixel).collect()
            }
        };
        let single = |v: [f64; 3]| v.map(|x| x as f32);
        let rgb = seen.iter().map(|&(rgb, _)| single(rgb)).collect();
        let glow = if blooms { seen.iter().map(|&(_, glow)| single(glow)).collect() } else { Vec::new() };
        Some(Self { rgb, glow })
    }

    /// The layer that it is of a picture: `gain` times what of it the mesh, of that coverage, leaves to be seen.
    #[must_use]
    pub fn layer(&self, image: &Image, gain: impl Into<Gain>) -> Image {
        let gain = gain.into();
        let mut layer = Image::new(image.width, image.height);
        let pixels = self.rgb.iter().zip(&image.alpha).zip(&mut layer.rgb).zip(&mut layer.alpha);
        for (((rgb, &coverage), shown), alpha) in pixels {
            *alpha = 1.0 - coverage;
            *shown = [0, 1, 2].map(|c| (gain.channel(c) * f64::from(*alpha)) as f32 * rgb[c]);
        }
        layer
    }

    /// Put it behind `image`, whose alpha is 1 everywhere then, and add to `glow` what of it blooms.
    pub fn put_behind(&self, image: &mut Image, glow: &mut [[f32; 3]], gain: impl Into<Gain>) {
        let gain = gain.into();
        let share = |coverage: f32| gain.0.map(|gain| (gain * f64::from(1.0 - coverage)) as f32);
        let add = |to: &mut [f32; 3], what: &[f32; 3], share: [f32; 3]| {
            (0..3).for_each(|c| to[c] += share[c] * what[c]);
        };
        for ((to, what), &coverage) in glow.iter_mut().zip(&self.glow).zip(&image.alpha) {
            add(to, what, share(coverage));
        }
        for ((to, what), coverage) in image.rgb.iter_mut().zip(&self.rgb).zip(&mut image.alpha) {
            add(to, what, share(*coverage));
            *coverage = 1.0;
        }
    }
}

/// The mean of `of` at the middles of n x n parts of the pixel whose corner is (x, y).
fn mean(x: f64, y: f64, n: u32, of: &impl Fn(f64, f64) -> ([f64; 3], [f64; 3])) -> ([f64; 3], [f64; 3]) {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
    let share = 1.0 / f64::from(n * n);
    let mut sum = ([0.0; 3], [0.0; 3]);
    for part in 0..n * n {
        let (rgb, glow) = of(x + at(part % n), y + at(part / n));
        for c in 0..3 {
            sum.0[c] += share * rgb[c];
            sum.1[c] += share * glow[c];
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_behind_is_covered_by_the_mesh() {
        let mut image = Image::new(2, 1);
        image.rgb = vec![[0.25; 3], [0.5; 3]];
        image.alpha = vec![0.25, 1.0];
        let backdrop = Backdrop { rgb: vec![[4.0, 2.0, 1.0]; 2], glow: vec![[4.0, 2.0, 1.0]; 2] };
        assert_eq!(backdrop.layer(&image, 2.0).rgb, [[6.0, 3.0, 1.5], [0.0; 3]]);
        let mut glow = vec![[0.5; 3]; 2];
        backdrop.put_behind(&mut image, &mut glow, 2.0);
        assert_eq!(image.rgb, [[6.25, 3.25, 1.75], [0.5; 3]]);
        assert_eq!((image.alpha, glow), (vec![1.0; 2], vec![[6.5, 3.5, 2.0], [0.5; 3]]));
    }
}

//! Images at a reduced size, with the cameras that would have taken them.

use crate::render::image::Image;
use crate::render::shade::Shaded;
use crate::scene::lens::Lens;
use crate::scene::view::{Camera, View};

/// An image: linear radiance, premultiplied by coverage, and that coverage.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    /// What it is the sum of: of a drawn one each term's image, of a target the target.
    pub(super) layers: Vec<Vec<[f32; 3]>>,
    /// `None` where nothing says what is covered.
    pub(super) alpha: Option<Vec<f32>>,
    /// What each pixel counts; empty where all count 1.
    pub(super) mask: Vec<f32>,
    /// The share of each pixel that is not skin, whose colours say nothing; empty where all is.
    pub(super) plain: Vec<f32>,
}

impl Picture {
    pub(super) fn of(shaded: Shaded) -> Self {
        let Image { width, height, alpha, .. } = shaded.image;
        let layers = shaded.terms.into_iter().map(|(_, image)| image.rgb).collect();
        let plain = shaded.plain.map_or(Vec::new(), |plain| plain.alpha);
        Self { width, height, layers, alpha: Some(alpha), mask: Vec::new(), plain }
    }

    /// A view's target.
    pub(super) fn of_target(view: &View) -> Option<Self> {
        let target = view.target.as_ref()?;
        // An alpha that is the same everywhere shows no silhouette.
        let shows = |alpha: &&Vec<f32>| alpha.iter().any(|&a| a != alpha[0]);
        Some(Self {
            width: view.camera.width as usize,
            height: view.camera.height as usize,
            layers: vec![target.rgb.clone()],
            alpha: target.alpha.as_ref().filter(shows).cloned(),
            mask: target.mask.clone().unwrap_or_default(),
            plain: Vec::new(),
        })
    }

    /// What a pixel counts.
    pub(super) fn weight(&self, i: usize) -> f64 {
        f64::from(self.mask.get(i).copied().unwrap_or(1.0))
    }

    /// The means of squares of `side` pixels; what is left at the right and below is cut off.
    pub(super) fn reduced(&self, side: usize) -> Self {
        let (width, height) = ((self.width / side).max(1), (self.height / side).max(1));
        let mean = |x: usize, y: usize, of: &dyn Fn(usize) -> f32| {
            let rows = (0..side).flat_map(|j| (0..side).map(move |i| (x * side + i, y * side + j)));
            let inside = rows.filter(|&(x, y)| x < self.width && y < self.height);
            let (sum, count) = inside
                .fold((0.0, 0), |(sum, count), (x, y)| (sum + f64::from(of(y * self.width + x)), count + 1));
            (sum / f64::from(count.max(1))) as f32
        };
        let places = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let plane = |of: &[f32]| places().map(|(x, y)| mean(x, y, &|i| of[i])).collect::<Vec<f32>>();
        let colors = |of: &Vec<[f32; 3]>| -> Vec<[f32; 3]> {
            places().map(|(x, y)| std::array::from_fn(|c| mean(x, y, &|i| of[i][c]))).collect()
        };
        Self {
            width,
            height,
            layers: self.layers.iter().map(colors).collect(),
            alpha: self.alpha.as_ref().map(|alpha| plane(alpha)),
            mask: if self.mask.is_empty() { Vec::new() } else { plane(&self.mask) },
            plain: Vec::new(),
        }
    }
}

/// The camera whose pixels are squares of `side` of another's, without those that are cut off.
pub(super) fn reduced_camera(camera: &Camera, side: u32) -> Camera {
    if side == 1 {
        return *camera;
    }
    let size = [camera.width, camera.height];
    let [width, height] = size.map(|pixels| (pixels / side).max(1));
    let share = f64::from(side);
    let focal = 0.5 * f64::from(camera.height) / (0.5 * camera.fov_y).tan() / share;
    let centre = [(size[0], width, 0), (size[1], height, 1)].map(|(whole, reduced, axis)| {
        (0.5 * f64::from(whole) + camera.lens.centre[axis]) / share - 0.5 * f64::from(reduced)
    });
    Camera {
        world_to_camera: camera.world_to_camera,
        fov_y: 2.0 * (0.5 * f64::from(height) / focal).atan(),
        width,
        height,
        lens: Lens { centre, ..camera.lens },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::lens::Distortion;
    use glam::{DMat4, DVec3};

    #[test]
    fn a_reduced_camera_sees_the_same_at_a_share_of_the_pixels() {
        let lens = Lens {
            centre: [3.0, -2.0],
            ratio: 1.1,
            distortion: Some(Distortion::Brown { k: [-0.2, 0.05, 0.0], p: [0.001, -0.002] }),
        };
        let world_to_camera = DMat4::from_translation(DVec3::new(0.1, -0.2, -3.0));
        let camera = Camera { world_to_camera, fov_y: 0.6, width: 103, height: 70, lens };
        for side in [1, 2, 4, 5] {
            let reduced = reduced_camera(&camera, side);
            for place in [DVec3::ZERO, DVec3::new(0.4, 0.3, 0.2), DVec3::new(-0.5, 0.2, -0.3)] {
                let ((x, y, _), (u, v, _)) = (camera.project(place), reduced.project(place));
                let share = f64::from(side);
                // Of numbers up to 100.
                assert!((x - share * u).hypot(y - share * v) < 1e-11, "{side}: {x} {y} {u} {v}");
            }
        }
    }

    #[test]
    fn a_reduced_image_has_the_means_of_squares() {
        let picture = Picture {
            width: 5,
            height: 4,
            layers: vec![(0..20).map(|i| [i as f32, 1.0, 0.0]).collect()],
            alpha: Some(vec![0.5; 20]),
            mask: Vec::new(),
            plain: Vec::new(),
        };
        let half = picture.reduced(2);
        assert_eq!((half.width, half.height), (2, 2));
        // Pixels 0, 1, 5 and 6; 12, 13, 17 and 18.
        assert_eq!(half.layers[0][0], [3.0, 1.0, 0.0]);
        assert_eq!(half.layers[0][3], [15.0, 1.0, 0.0]);
        assert_eq!(half.alpha, Some(vec![0.5; 4]));
    }
}

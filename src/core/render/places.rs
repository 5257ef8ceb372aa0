//! Where the surface behind each pixel lies: how open and how edge-on it is, and how much light it looks at. All of it
//! comes from the samples and the cubes that are there; nothing is baked for it.

use rayon::prelude::*;

use crate::bake::Illumination;
use crate::model::cube::Cube;
use crate::model::effects::Effect;
use crate::model::evaluate::Setup;
use crate::model::params::{Param, Params};
use crate::model::turn::{in_environment, turn};
use crate::model::vector::{V3, dot, normalize_or, scale_add};
use crate::samples::{LANES, ViewSamples};

/// Numbers of each pixel, row by row: means over its samples, 0 where nothing is seen. Empty where no effect asks for
/// what they are made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// The open share of the hemisphere, as ambient occlusion has it.
    pub open: Vec<f32>,
    /// |N.V| of the smooth normal: 0 at the silhouette, 1 where the surface faces the eye.
    pub facing: Vec<f32>,
    /// Luminance of the diffuse light along the smooth normal.
    pub lit: Vec<f32>,
    /// Luminance of the specular light along the smooth normal's reflection.
    pub mirrored: Vec<f32>,
}

/// The places of a view of `width` x `height` pixels, the light turned and as sharp as `params` say.
#[must_use]
pub fn places(
    samples: &ViewSamples,
    setup: Setup,
    illumination: &Illumination,
    params: &Params,
    [width, height]: [usize; 2],
) -> Places {
    let lobe = illumination.lobes.as_ref().map(|stack| stack.at(params.scalar(Param::SpecularLobe)).0);
    let (needs, side) = (setup.needs(), setup.effects.has(Effect::SideSpecular));
    let lights = Lights {
        irradiance: illumination.irradiance.as_ref().filter(|_| needs.irradiance),
        specular: lobe.as_ref().filter(|_| side || needs.dapple),
        turn: turn(params).map(|x| x as f32),
    };
    let plane = |there: bool| vec![0.0; if there { width * height } else { 0 }];
    let mut places = Places {
        open: plane(samples.surface.places().occlusion.is_some()),
        facing: plane(true),
        lit: plane(lights.irradiance.is_some()),
        mirrored: plane(lights.specular.is_some()),
    };
    let groups = (0..samples.groups()).into_par_iter();
    let found: Vec<Vec<(usize, [f32; 4])>> = groups.map(|group| of_group(samples, group, &lights)).collect();
    for (at, means) in found.into_iter().flatten() {
        let planes = [&mut places.open, &mut places.facing, &mut places.lit, &mut places.mirrored];
        for (plane, mean) in planes.into_iter().zip(means) {
            if let Some(own) = plane.get_mut(at) {
                *own = mean;
            }
        }
    }
    places
}

/// The cubes that are looked at, and the cosine and sine of the environment's turn.
#[derive(Clone, Copy)]
struct Lights<'a> {
    irradiance: Option<&'a Cube<f32>>,
    specular: Option<&'a Cube<f32>>,
    turn: [f32; 2],
}

impl Lights<'_> {
    /// Luminance along a direction of the world; 0 without the cube.
    fn luminance(&self, cube: Option<&Cube<f32>>, direction: V3<f32>) -> f32 {
        let along = in_environment(self.turn, direction);
        let [r, g, b, _] = cube.map_or([0.0; 4], |cube| cube.sample(along));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }
}

/// Index and means of each pixel of a group: open, facing, lit, mirrored.
fn of_group(samples: &ViewSamples, group: usize, lights: &Lights<'_>) -> Vec<(usize, [f32; 4])> {
    let records = samples.group_start[group] as usize..samples.group_start[group + 1] as usize;
    let pixel = |lane: usize| {
        let index = samples.pixel[group * LANES + lane];
        let mut means = [0.0; 4];
        for slot in records.clone().map(|record| record * LANES + lane) {
            let share = samples.surface.weight(slot);
            if share > 0.0 {
                let found = of_sample(samples, slot, lights);
                means.iter_mut().zip(found).for_each(|(mean, found)| *mean += share * found);
            }
        }
        (index != u32::MAX).then_some((index as usize, means))
    };
    (0..LANES).filter_map(pixel).collect()
}

fn of_sample(samples: &ViewSamples, slot: usize, lights: &Lights<'_>) -> [f32; 4] {
    let fragment = samples.surface.fragment(slot);
    let (view, _) = normalize_or(fragment.view, [0.0, 0.0, -1.0]);
    let (normal, _) = normalize_or(fragment.normal, view.map(|x| -x));
    let cosine = dot(normal, view);
    let reflection = scale_add(-2.0 * cosine, normal, view);
    let lit = lights.luminance(lights.irradiance, normal);
    let mirrored = lights.luminance(lights.specular, reflection);
    [fragment.occlusion, cosine.abs(), lit, mirrored]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::LobeStack;
    use crate::model::cube::texel_direction;
    use crate::model::effects::{Effects, Form, Silhouette};
    use crate::model::fragment::Fragment;
    use crate::samples::SurfaceRecords;
    use crate::samples::surface_records::{Asked, NEUTRAL};

    /// The direction of a row of an even number of texels that lies nearest to a face's centre is off by 0.4% of its
    /// length at 16 of them, and light is at most twice it.
    const TOLERANCE: f32 = 0.02;

    /// Light of 1 more than a component of its direction.
    fn light(component: usize) -> Cube<f32> {
        Cube::from_fn(16, |face, column, row| {
            [1.0 + texel_direction(face, column, row, 16)[component] as f32; 4]
        })
    }

    /// A pixel of a quarter that looks up and lies deep, and three quarters that face the eye; the third of four in a row.
    fn samples(asked: Asked) -> ViewSamples {
        let mut surface = SurfaceRecords::new(asked, 2);
        for (record, (normal, occlusion, weight)) in
            [([0.0, 1.0, 0.0], 0.4, 0.25), ([0.0, 0.0, 2.0], 0.8, 0.75)].into_iter().enumerate()
        {
            let fragment = Fragment { base: normal, normal, view: [0.0, 0.0, -3.0], occlusion, ..NEUTRAL };
            surface.set(record * LANES, &fragment, weight);
        }
        let mut pixel = vec![u32::MAX; LANES];
        pixel[0] = 2;
        ViewSamples {
            group_start: vec![0, 2],
            pixel,
            coverage: vec![1.0; LANES],
            surface,
            ..ViewSamples::default()
        }
    }

    fn setup() -> Setup {
        let effects = Effects::of(&[Effect::Diffuse, Effect::SideSpecular, Effect::Occlusion]);
        Setup::new(Form::Corrected, Silhouette::Fragment, effects)
    }

    #[test]
    fn a_pixels_places_are_means_over_its_samples() {
        let illumination = Illumination {
            irradiance: Some(light(1)),
            lobes: Some(LobeStack { exponents: vec![32.0], cubes: vec![light(2)] }),
            hilite: None,
            reflected: None,
        };
        let samples = samples(Asked::EVERYTHING);
        let mut params = Params::defaults(Form::Corrected);
        let found = places(&samples, setup(), &illumination, &params, [4, 1]);
        // What looks up mirrors -Z, where there is no light, and what faces the eye mirrors +Z, where there is 2.
        for (plane, want) in
            [(&found.open, 0.7), (&found.facing, 0.75), (&found.lit, 1.25), (&found.mirrored, 1.5)]
        {
            assert_eq!(plane.len(), 4);
            assert!((plane[2] - want).abs() < TOLERANCE, "{plane:?} {want}");
            assert_eq!((plane[0], plane[1], plane[3]), (0.0, 0.0, 0.0));
        }
        // A quarter turn about Y moves +-Z to where the light is 1, and leaves what comes from above.
        params.set(Param::EnvironmentRotation, 90.0);
        let turned = places(&samples, setup(), &illumination, &params, [4, 1]);
        assert!((turned.mirrored[2] - 1.0).abs() < TOLERANCE, "{:?}", turned.mirrored);
        assert!((turned.lit[2] - 1.25).abs() < TOLERANCE, "{:?}", turned.lit);
    }

    #[test]
    fn what_no_effect_asks_for_is_not_known() {
        let asked = Asked { normal: true, weight: true, ..Asked::default() };
        let params = Params::defaults(Form::Corrected);
        let found = places(&samples(asked), setup(), &Illumination::default(), &params, [4, 1]);
        assert_eq!((found.open.len(), found.lit.len(), found.mirrored.len()), (0, 0, 0));
        // Lengths of f32 vectors.
        assert!((found.facing[2] - 0.75).abs() < 1e-6, "{:?}", found.facing);
    }
}

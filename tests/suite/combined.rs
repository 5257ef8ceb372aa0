//! `[diffusion] combined`: levels weighed and added up in the pixel, or in texels, of which the sum is looked up. Lookups are
//! linear, so that both show the same.

use skinfit::engine::Unknown;
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::diffusion::{Combined, DiffusionChoices, Lookup, Method, Seams, Taps, Unblurred};
use skinfit::model::effects::Effect;
use skinfit::model::params::{Column, Param};
use skinfit::prepare::Baked;
use skinfit::render::image::Image;
use skinfit::shader::atlas::{Pass, PassKind};
use skinfit::shader::{Budget, plan};

use crate::graphics::bench::{EXACT, gpu};
use crate::sky::{brighter, effect, head_with, on_cpu};
use crate::slopes;

fn param(name: &str) -> Param {
    Param::from_name(name).unwrap()
}

/// The built-in head with a lamp, in `pixels` pixels a side, its light map of 128 texels; three blurs or five.
fn head(combined: Combined, unblurred: Unblurred, five: bool, pixels: u32) -> Baked {
    let mut more = vec![Effect::NormalMap, Effect::Lights, effect("fresnel"), effect("diffusion")];
    more.extend(five.then(|| effect("diffusion_five")));
    head_with(&more).with_scene(|scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (pixels, pixels);
        scene.diffusion.light_map_size = 128;
        (scene.choices.diffusion.combined, scene.choices.diffusion.unblurred) = (combined, unblurred);
        scene.metres_per_unit = 1.0;
        for (level, weight) in [(1, 0.3), (2, 0.2), (3, 0.1), (4, 0.1), (5, 0.2)] {
            scene.params.set(param(&format!("diffusion_weight_{level}")), weight);
        }
        scene.params.set(param("colour_mix"), 0.4);
    })
}

/// Every way to have the levels, but for where they are combined.
const WAYS: [(Unblurred, bool); 4] =
    [(Unblurred::Map, false), (Unblurred::Map, true), (Unblurred::Pixel, false), (Unblurred::Pixel, true)];

/// Two images that show light are the same but for so much of the brightest.
fn assert_same([a, b]: &[Image; 2], share: f32, what: &str) {
    let light = a.rgb.iter().flatten().fold(0.0_f32, |most, &x| most.max(x));
    assert!(light > 0.1, "{what} shows {light}");
    for (a, b) in a.rgb.iter().zip(&b.rgb) {
        let same = (0..3).all(|c| (a[c] - b[c]).abs() <= share * light);
        assert!(same, "{what}: {a:?} {b:?} of {light}");
    }
}

/// Another choice, by name.
type Change = (&'static str, fn(&mut DiffusionChoices));

#[test]
fn an_image_is_the_same_wherever_levels_are_combined() {
    for (unblurred, five) in WAYS {
        let changes: [Change; 5] = [
            ("within charts", |_| ()),
            ("by one fetch", |choices| choices.lookup = Lookup::Dilated),
            ("seams joined", |choices| choices.seams = Seams::Joined),
            ("all taps", |choices| choices.taps = Taps::Full),
            ("over the surface", |choices| choices.method = Method::Surface),
        ];
        for (name, change) in changes {
            let images = [Combined::Pixel, Combined::Map].map(|combined| {
                on_cpu(
                    &head(combined, unblurred, five, 32)
                        .with_scene(|scene| change(&mut scene.choices.diffusion)),
                )
            });
            // Some roundings of the brightest pixel's sums.
            assert_same(&images, 2e-6, &format!("{unblurred:?} {five} {name}"));
        }
    }
}

#[test]
fn slopes_are_finite_differences_on_every_engine() {
    for (unblurred, five) in WAYS {
        let baked = head(Combined::Map, unblurred, five, 16);
        let target = brighter(on_cpu(&baked));
        let baked = baked.with_scene(|scene| scene.views[0].target = Some(target));
        let observed = baked.sample().unwrap().observe().unwrap();
        let columns = [
            "base_weight",
            "diffusion_weight_1",
            "diffusion_weight_3",
            "diffusion_radius_2",
            "colour_mix",
            "light.side.color",
        ];
        let unknowns: Vec<Unknown> =
            columns.into_iter().map(|name| Unknown::Param(Column::tied(param(name)))).collect();
        let what = format!("combined in the map, {unblurred:?}, five {five}");
        slopes::assert_slopes(&observed, &unknowns, &slopes::EXACT, &what);
    }
}

#[test]
fn the_renderer_draws_the_same_too() {
    let Some(gpu) = gpu() else { return };
    for (unblurred, five) in WAYS {
        for lookup in [Lookup::Chart, Lookup::Dilated] {
            let images = [Combined::Pixel, Combined::Map].map(|combined| {
                let baked = head(combined, unblurred, five, 48)
                    .with_scene(|scene| scene.choices.diffusion.lookup = lookup);
                let camera = baked.scene.views[0].camera;
                Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image
            });
            // As above; an adapter may round a lookup's shares otherwise from shader to shader.
            assert_same(&images, 1e-5, &format!("{unblurred:?} {five} {lookup:?}"));
        }
    }
}

/// A pixel looks one level up in the place of four or six, and a draw is added, which reads them: the light map is not made
/// twice.
#[test]
fn the_sum_alone_is_looked_up() {
    for five in [false, true] {
        let looked_up = |combined| {
            let baked = head(combined, Unblurred::Map, five, 16);
            let facts = baked.scene.facts(&baked.scene.params, Budget::Exact, false);
            let plan = plan(&facts).unwrap();
            let draws: Vec<&Pass> = plan.passes.iter().filter(|pass| pass.kind == PassKind::Draw).collect();
            (plan.levels.len(), draws.len(), draws.last().unwrap().plan.levels.len())
        };
        let (each, draws, _) = looked_up(Combined::Pixel);
        let (sum, more, read) = looked_up(Combined::Map);
        let levels = if five { 6 } else { 4 };
        assert_eq!((each, sum, more, read), (levels, 1, draws + 1, levels));
    }
}

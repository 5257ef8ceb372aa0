//! An atlas by texture coordinates of its own beside those of the maps. Where both are alike nothing is other than with one
//! set; where the maps are mirrored, by which no light can stand in an atlas, every engine and the renderer find maps by the
//! one and light by the other.

use glam::Vec2;
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::{Objective, Task, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::gpu::RenderOptions;
use skinfit::model::diffusion::{DiffusionChoices, Lookup, Method, Seams, Stretch};
use skinfit::model::effects::Effect;
use skinfit::model::params::Column;
use skinfit::model::texture_filter::TextureFilter;
use skinfit::prepare::{Baked, Observed};
use skinfit::render::shading::Shading;
use skinfit::scene::Scene;
use skinfit::scene::maps::{Map, Maps};

use crate::graphics::bench::{Difference, EXACT, gpu, keep, on_gpu, quantile};
use crate::lit::param;
use crate::sky::{brighter, effect, head_changed, on_cpu};
use crate::slopes::{self, Nearness};

/// A wave along each side of a map, whose ends meet: wherever it is looked up, neighbours are alike.
fn waves(number: impl Fn([f32; 2]) -> [f32; 3]) -> Map<3> {
    let wave = |i: usize| (std::f32::consts::TAU * i as f32 / 64.0).sin();
    let texels = (0..64 * 64).map(|i| number([wave(i % 64), wave(i / 64)])).collect();
    Map { width: 64, height: 64, texels }
}

/// The built-in head with a lamp in `pixels` pixels a side: blurs some texels wide, half of the colour before them.
fn head(pixels: u32, change: impl FnOnce(&mut Scene)) -> Baked {
    head_changed(&[Effect::NormalMap, Effect::Lights, effect("diffusion")], |scene| {
        scene.diffusion.light_map_size = 96;
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (pixels, pixels);
        scene.maps.color = Some(waves(|[x, y]| [0.5 + 0.3 * x, 0.5 + 0.3 * y, 0.5 + 0.2 * x * y]));
        scene.maps.normal = Some(waves(|[x, y]| [0.5 + 0.1 * y, 0.5 + 0.1 * x, 0.98]));
        for (name, value) in [
            ("diffusion_weight_1", 0.3),
            ("diffusion_weight_2", 0.2),
            ("diffusion_weight_3", 0.1),
            ("diffusion_radius_1", 3.0),
            ("diffusion_radius_2", 6.0),
            ("diffusion_radius_3", 14.0),
            ("colour_mix", 0.4),
            ("light.side.azimuth", 40.0),
        ] {
            scene.params.set(param(name), value);
        }
        change(scene);
    })
}

/// The atlas stays as it is, by a second set of texture coordinates; the first one's halves come to lie on one another.
pub(crate) fn mirrored(scene: &mut Scene) {
    let mesh = &mut scene.mesh;
    mesh.own_atlas_uvs = std::mem::take(&mut mesh.uvs);
    mesh.uvs = mesh.own_atlas_uvs.iter().map(|uv| Vec2::new((2.0 * uv.x - 1.0).abs(), uv.y)).collect();
}

fn observed(baked: Baked) -> Observed {
    let target = brighter(on_cpu(&baked));
    let baked = baked.with_scene(|scene| scene.views[0].target = Some(target));
    baked.sample().unwrap().observe().unwrap()
}

fn unknowns(names: &[&str]) -> Vec<Unknown> {
    names.iter().map(|name| Unknown::Param(Column::tied(param(name)))).collect()
}

#[test]
fn coordinates_of_the_atlas_that_are_the_maps_change_no_bit() {
    let default = DiffusionChoices::DEFAULT;
    for choices in [
        default,
        DiffusionChoices { lookup: Lookup::Dilated, stretch: Stretch::Derivative, ..default },
        DiffusionChoices { seams: Seams::Joined, ..default },
        DiffusionChoices { method: Method::Surface, ..default },
    ] {
        let [one, two] = [false, true].map(|twice| {
            head(24, |scene| {
                scene.choices.diffusion = choices;
                if twice {
                    scene.mesh.own_atlas_uvs = scene.mesh.uvs.clone();
                }
            })
        });
        let [image, again] = [&one, &two].map(on_cpu);
        assert!(image.rgb == again.rgb && image.alpha == again.alpha, "{choices:?}");
        let [one, two] = [one, two].map(|baked| baked.sample().unwrap().samples.remove(0));
        assert!(one.surface == two.surface && one.atlas == two.atlas, "{choices:?}");
    }
}

#[test]
fn a_fit_goes_the_same_way_by_two_sets_that_are_alike() {
    let fitted = |twice: bool| {
        let observed = observed(head(16, |scene| {
            if twice {
                scene.mesh.own_atlas_uvs = scene.mesh.uvs.clone();
            }
        }));
        let unknowns = unknowns(&["base_weight", "diffusion_weight_1", "diffusion_radius_2", "colour_mix"]);
        let engine = CpuEngine::new(Task { unknowns, ..observed.task() }).unwrap();
        let start = observed.start();
        let outcome = fit(&engine, &start, &FitOptions::default(), &mut |_| {}).unwrap();
        let values: Vec<f64> = outcome.unknowns.iter().map(|unknown| unknown.value).collect();
        (engine.gradient(&start), outcome.evaluations, values)
    };
    assert_eq!(fitted(false), fitted(true));
}

#[test]
fn an_atlas_that_the_maps_coordinates_cannot_be_is_told_what_to_name() {
    let folded = head(16, |scene| {
        mirrored(scene);
        scene.mesh.own_atlas_uvs.clear();
    });
    let told = folded.sample().err().unwrap().to_string();
    assert!(told.contains("mirrored or overlapping") && told.contains("`uv_set` in [diffusion]"), "{told}");
    assert!(head(16, mirrored).sample().is_ok());
}

#[test]
fn light_lies_by_the_atlas_coordinates_and_maps_by_theirs() {
    let without_maps = |change: fn(&mut Scene)| {
        on_cpu(&head(32, |scene| {
            scene.maps = Maps::default();
            change(scene);
        }))
    };
    // Without maps nothing is left of their coordinates.
    assert!(without_maps(|_| ()).rgb == without_maps(mirrored).rgb);
    let [plain, folded] = [head(32, |_| ()), head(32, mirrored)].map(|baked| on_cpu(&baked));
    let Difference { interior, .. } = Difference::new(&plain, &folded, 4);
    // Far more than rounding: waves of colours stand elsewhere.
    assert!(quantile(&interior, 0.9) > 1e-2, "{}", quantile(&interior, 0.9));
}

#[test]
fn the_renderer_shows_the_same_by_two_sets_that_are_alike() {
    let Some(gpu) = gpu() else { return };
    let one = head(48, |_| ());
    let two = head(48, |scene| scene.mesh.own_atlas_uvs = scene.mesh.uvs.clone());
    let Difference { interior, uncovered, .. } =
        Difference::new(&on_gpu(gpu, &one, EXACT), &on_gpu(gpu, &two, EXACT), 4);
    // A compiler may fuse the sums of the two shaders otherwise.
    assert!(uncovered == 0 && quantile(&interior, 0.99) < 1e-5, "{}", quantile(&interior, 0.99));
}

/// Checks of eight texels, between dark and light, of which a texel of the atlas covers more than one where it lies at twice
/// the pace.
fn checks() -> Map<3> {
    let texel = |i: usize| [if (i % 512 / 8 + i / 512 / 8).is_multiple_of(2) { 0.2 } else { 0.8 }; 3];
    Map { width: 512, height: 512, texels: (0..512 * 512).map(texel).collect() }
}

/// A scene's change, by what it shows.
type Named = (&'static str, fn(&mut Scene));

#[test]
fn the_renderer_finds_maps_and_light_as_the_processor_does() {
    let Some(gpu) = gpu() else { return };
    let changes: [Named; 3] = [
        ("by charts", |_| ()),
        ("by one fetch", |scene| {
            scene.choices.diffusion.lookup = Lookup::Dilated;
            scene.choices.diffusion.stretch = Stretch::Derivative;
        }),
        // All of the colour is in the light map: what fragments cover of maps, which the adapter takes from neighbours, does not
        // count.
        ("maps by their levels", |scene| {
            scene.quality.texture_filter = TextureFilter::Trilinear;
            scene.maps.color = Some(checks());
            scene.params.set(param("colour_mix"), 1.0);
        }),
    ];
    for (name, change) in changes {
        let baked = head(48, |scene| {
            mirrored(scene);
            change(scene);
        });
        let want = on_cpu(&baked);
        for shading in Shading::ALL {
            let got = on_gpu(gpu, &baked, RenderOptions { shading, ..EXACT });
            let Difference { interior, uncovered, .. } = Difference::new(&want, &got, 4);
            assert!(interior.len() > 500 && uncovered < 40, "{name}: {} {uncovered}", interior.len());
            let shares = [0.5, 0.9, 0.99].map(|share| quantile(&interior, share));
            println!("{name}, {}: {shares:?}, greatest {:?}", shading.name(), interior.last());
            // As where maps lie by the atlas' coordinates (`diffused`), but that they go by at twice the pace along u, and with
            // it whatever is left of differences in where they are read.
            let near = shares.iter().zip([4e-4, 2e-3, 2e-2]).all(|(found, most)| *found < most);
            let at = shading.name();
            assert!(near, "{name}, {at}: {shares:?}; {}", keep("own atlas", &want, &got));
        }
    }
}

/// As of engines elsewhere, but that levels and what is looked up of them round some tens of times more.
const NEAR: Nearness = Nearness { step: 1e-5, difference: 1e-6, loss: 1e-5, slope: [1e-3, 1e-5] };

#[test]
fn slopes_are_finite_differences_on_every_engine() {
    let observed = observed(head(16, |scene| {
        mirrored(scene);
        scene.diffusion.light_map_size = 64;
    }));
    let free = [
        "diffusion_radius_1",
        "diffusion_radius_2",
        "diffusion_radius_3",
        "diffusion_weight_1",
        "diffusion_weight_3",
        "colour_mix",
        "base_weight",
        "light.side.color",
    ];
    slopes::assert_slopes(&observed, &unknowns(&free), &NEAR, "an atlas of its own");
}

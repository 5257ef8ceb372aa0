//! Levels of the UV atlas that an adapter makes for the engine, beside the f64 model.

use std::sync::Arc;

use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::reference::{Reference, deviation};
use skinfit::engine::{Objective, Task, Unknown};
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::diffusion::{DiffusionChoices, Lookup, Seams, Stretch, Taps};
use skinfit::model::effects::Effect;
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, Observed};

use super::bench::{EXACT, gpu};
use crate::sky::{brighter, head_with, on_cpu};

fn param(name: &str) -> Param {
    Param::from_name(name).unwrap()
}

/// The built-in head with light that scatters, in so few pixels that the f64 model is quick.
fn head(choices: DiffusionChoices) -> Baked {
    skinfit::shader::term::library::register_all();
    let diffusion = Effect::from_name("diffusion").unwrap();
    let more = [Effect::NormalMap, Effect::Lights, Effect::Shadows, diffusion];
    head_with(&more).with_scene(|scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (24, 24);
        scene.choices.diffusion = choices;
        scene.diffusion.light_map_size = 128;
        scene.params.set(param("colour_mix"), 0.4);
        for (radius, length) in
            [("diffusion_radius_1", 1.5), ("diffusion_radius_2", 3.0), ("diffusion_radius_3", 7.0)]
        {
            scene.params.set(param(radius), length);
        }
    })
}

fn observed(baked: Baked) -> Observed {
    let target = brighter(on_cpu(&baked));
    let baked = baked.with_scene(|scene| scene.views[0].target = Some(target));
    baked.sample().unwrap().observe().unwrap()
}

#[test]
fn levels_and_how_they_move_are_the_f64_models_whatever_is_chosen() {
    let Some(gpu) = gpu() else { return };
    let default = DiffusionChoices::DEFAULT;
    for choices in [
        default,
        DiffusionChoices { taps: Taps::Full, lookup: Lookup::Dilated, ..default },
        DiffusionChoices { stretch: Stretch::Derivative, taps: Taps::Nine, ..default },
        // These the processor makes.
        DiffusionChoices { seams: Seams::Joined, ..default },
    ] {
        let observed = observed(head(choices));
        let names = [
            "base_weight",
            "diffusion_weight_1",
            "diffusion_radius_1",
            "diffusion_radius_2",
            "diffusion_radius_3",
            "colour_mix",
            "environment_rotation",
            "occlusion",
            "light.side.color",
        ];
        let unknowns: Vec<Unknown> = names.map(|name| Unknown::Param(Column::tied(param(name)))).to_vec();
        let task = Task { unknowns: unknowns.clone(), ..observed.task() };
        let point = observed.start();
        let model =
            Reference::new(task.setup, &task.illumination, &task.views, task.loss, &unknowns).unwrap();
        let engine = GpuEngine::new(gpu, task.clone(), &point, Memory::default()).unwrap();
        let off = deviation(&engine.normal_equations(&point), &model.normal_equations(&point), &unknowns);
        // Levels round to 1e-7 of themselves, some tens of times, and so do weights' slopes.
        assert!(off.size < 1e-4, "{choices:?}: {}: {}", off.what, off.size);
        // Weights move no level; a radius does.
        assert_eq!(engine.levels_made(), 1, "{choices:?}");
        let mut moved = point.clone();
        moved.params.set(param("base_weight"), 0.9);
        assert!(engine.loss(&moved).is_finite() && engine.levels_made() == 1);
        moved.params.set(param("diffusion_radius_3"), 5.0);
        let off = deviation(&engine.normal_equations(&moved), &model.normal_equations(&moved), &unknowns);
        // As above: what was not made again is what it was.
        assert!(off.size < 1e-4, "{choices:?}: {}: {}", off.what, off.size);
        assert_eq!(engine.levels_made(), 2);
    }
}

#[test]
fn empty_texels_that_show_another_do_so_on_an_adapter() {
    let Some(gpu) = gpu() else { return };
    let observed = observed(head(DiffusionChoices { lookup: Lookup::Dilated, ..DiffusionChoices::DEFAULT }));
    let unknowns: Vec<Unknown> =
        ["base_weight", "diffusion_radius_2"].map(|name| Unknown::Param(Column::tied(param(name)))).to_vec();
    let means = Task { unknowns: unknowns.clone(), ..observed.task() };
    let mut view = means.views[0].clone();
    let atlas = view.samples.atlas.as_deref().cloned().unwrap();
    let texels = atlas.size() * atlas.size();
    let [column, row] = atlas.texel(atlas.covered() / 3);
    let one = row * atlas.size() + column;
    view.samples.atlas = Some(Arc::new(atlas.with_shown((0..texels).map(|texel| (texel, one)))));
    let shown = Task { views: Arc::new([view]), ..means.clone() };
    let point = observed.start();
    let f64 = |task: &Task| {
        let model =
            Reference::new(task.setup, &task.illumination, &task.views, task.loss, &unknowns).unwrap();
        model.normal_equations(&point)
    };
    let engine = GpuEngine::new(gpu, shown.clone(), &point, Memory::default()).unwrap();
    let found = engine.normal_equations(&point);
    // As above; where the texels about charts are means, the light at their borders is another.
    let off = deviation(&found, &f64(&shown), &unknowns);
    assert!(off.size < 1e-4, "{}: {}", off.what, off.size);
    assert!(deviation(&found, &f64(&means), &unknowns).size > 1e-3);
}

#[test]
fn a_renderer_makes_levels_once_and_again_when_the_mesh_has_moved() {
    let Some(gpu) = gpu() else { return };
    let baked = head(DiffusionChoices::DEFAULT);
    let mut camera = baked.scene.views[0].camera;
    let options = skinfit::gpu::RenderOptions { animated: true, ..EXACT };
    let mut renderer = Renderer::new(gpu, Content::of(&baked), options).unwrap();
    let first = renderer.render(&camera, 1.0).unwrap().image;
    assert_eq!(renderer.render(&camera, 1.0).unwrap().image, first);
    camera.fov_y *= 1.1;
    renderer.render(&camera, 1.0).unwrap();
    assert_eq!(renderer.atlas_made(), 1);
    let mesh = Arc::clone(&baked.scene).mesh.clone();
    renderer.set_mesh(&mesh, None).unwrap();
    camera.fov_y /= 1.1;
    let again = renderer.render(&camera, 1.0).unwrap().image;
    assert_eq!(renderer.atlas_made(), 2);
    assert_eq!(again, first);
    // A draw of the light map and of the stretch, and two directions of each of three blurs.
    let traffic = renderer.atlas_traffic();
    assert_eq!(traffic.passes, 7);
    // Each pass reads or writes a level of each covered texel at the least, and the head covers some of the atlas' 128 x 128.
    assert!(traffic.bytes > 7 * 16 * 4000, "{traffic:?}");
}

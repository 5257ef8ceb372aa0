//! Parts that are not skin as the renderer draws them, beside the CPU's rays.

use std::f64::consts::FRAC_1_SQRT_2;

use serde_json::{Value, json};
use skinfit::gpu::painter::{Beside, GpuPainter, Painter as _};
use skinfit::gpu::{Gpu, GpuError, RenderOptions, Renderer};
use skinfit::model::gain::Gain;
use skinfit::model::params::Param;
use skinfit::model::terms::TermName;
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::antialias::Antialias;
use skinfit::render::image::Image;

use super::{SCENE, close, edited, folder};
use crate::common;
use crate::graphics::bench::{Content, EXACT, cache, gpu, on_cpu, on_gpu};
use crate::scene_folder::{SceneFolder, exr};

fn baked(folder: &SceneFolder) -> Baked {
    Baked::new(
        &folder.path("scene.toml"),
        &PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() },
    )
    .unwrap()
}

fn both(gpu: &Gpu, folder: &SceneFolder) -> [Image; 2] {
    let baked = baked(folder);
    [on_cpu(&baked, 2), on_gpu(gpu, &baked, EXACT)]
}

/// The middle of both engines' images of a scene whose eye has this material.
fn middles(gpu: &Gpu, material: &Value, scene: &str) -> [[f32; 3]; 2] {
    both(gpu, &folder(material, scene)).map(|image| image.rgb[8 * 16 + 8])
}

#[test]
fn materials_under_a_sky_of_one_and_a_lamp_are_those_of_rays() {
    let Some(gpu) = gpu() else { return };
    let lamp = "[[light]]\nname = \"plain_key\"\ntype = \"directional\"\ndirection = [0.3, -0.2, -1]\nirradiance = [3.0, 2.0, 1.0]\n";
    let lit = SCENE.replace("\"diffuse\"", "\"diffuse\", \"lights\", \"shadows\"") + lamp;
    let materials = [
        json!({"metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [0.9, 0.5, 0.2, 1]}),
        json!({"metallicFactor": 0, "roughnessFactor": 0.5, "baseColorFactor": [0, 0, 0, 1]}),
        json!({"metallicFactor": 0, "roughnessFactor": 1, "baseColorFactor": [0.8, 0.6, 0.4, 1]}),
        json!({"metallicFactor": 0.5, "roughnessFactor": 0.7, "baseColorTexture": {"index": 0}}),
    ];
    for material in materials {
        let eye = json!({"name": "Eye", "emissiveFactor": [0.25, 0, 0], "pbrMetallicRoughness": material});
        for scene in [SCENE, &lit] {
            let [rays, drawn] = middles(gpu, &eye, scene);
            // Nothing is in the way of the sky of one: what is left are Hammersley's points beside Sobol's, 32 of a lobe.
            assert!(close(drawn, rays, 4e-3), "{material}: {drawn:?} is not {rays:?}");
        }
    }
}

#[test]
fn alpha_cuts_holes_or_blends_and_every_layer_adds_up() {
    let Some(gpu) = gpu() else { return };
    let of = |mode: &str, alpha: f64| json!({"name": "Eye", "alphaMode": mode, "pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [0, 0, 0, alpha]}});
    for (mode, alpha, want) in
        [("OPAQUE", 0.2, 0.0), ("MASK", 0.6, 0.0), ("MASK", 0.4, 1.0), ("BLEND", 0.5, 0.5)]
    {
        let [rays, drawn] = middles(gpu, &of(mode, alpha), SCENE);
        // Of four samples a pixel half see the skin, exactly.
        assert!(close(drawn, [want; 3], 1e-3) && close(rays, [want; 3], 1e-3), "{mode}: {drawn:?}, {rays:?}");
    }
    // Of what the hardware keeps of a pixel, too.
    let multisampled = RenderOptions { antialias: Antialias::Msaa4, ..EXACT };
    let image = on_gpu(gpu, &baked(&folder(&of("BLEND", 0.5), SCENE)), multisampled);
    assert!(close(image.rgb[8 * 16 + 8], [0.5; 3], 2e-3), "{:?}", image.rgb[8 * 16 + 8]);
    // Layers of a picture are its whole: the skin's terms, and what is before it.
    let eye = json!({"name": "Eye", "alphaMode": "BLEND", "pbrMetallicRoughness": {
        "metallicFactor": 0, "roughnessFactor": 0.6, "baseColorFactor": [0.9, 0.4, 0.1, 0.7]}});
    let scene = SCENE.replace("\"diffuse\"", "\"diffuse\", \"hilite\", \"haze\"");
    for scene in [SCENE, &scene] {
        let baked = baked(&folder(&eye, scene));
        let camera = baked.scene.views[0].camera;
        let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
        let whole = renderer.render(&camera, 0.5).unwrap().image;
        let plain = renderer.render_plain(&camera, 0.5).unwrap().unwrap();
        let terms = TermName::of(baked.scene.effects);
        let terms: Vec<Image> =
            terms.into_iter().map(|term| renderer.render_term(term, &camera, 0.5).unwrap()).collect();
        for i in 0..256 {
            let sum: [f32; 3] =
                std::array::from_fn(|c| terms.iter().chain([&plain]).map(|layer| layer.rgb[i][c]).sum());
            // Each layer is its own shader: a few roundings of f32.
            assert!(close(sum, whole.rgb[i], 1e-5), "pixel {i}: {sum:?} is not {:?}", whole.rgb[i]);
            assert!((terms[0].alpha[i] + plain.alpha[i] - whole.alpha[i]).abs() < 1e-6, "pixel {i}");
        }
        assert!(plain.alpha[8 * 16 + 8] > 0.4 && terms[0].alpha[8 * 16 + 8] > 0.2);
    }
}

/// A sky that is red on the right and green on the left.
fn two_coloured() -> Vec<u8> {
    exr(
        8,
        4,
        &["R", "G", "B"],
        |c, i| if c == 2 { 0.0 } else { f32::from(u8::from((i % 8 < 4) == (c == 0))) },
    )
}

#[test]
fn a_turned_sky_and_what_moves_are_drawn_as_if_made_so() {
    let Some(gpu) = gpu() else { return };
    let eye = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}});
    // A lamp beside it, which is blue and does not turn with the sky.
    let lamp =
        "[[light]]\nname = \"plain_blue\"\ntype = \"point\"\nposition = [2, 0, 1]\nintensity = [0, 0, 9]\n";
    let lit = SCENE.replace("\"diffuse\"", "\"diffuse\", \"lights\", \"shadows\"") + lamp;
    let folder =
        edited(&eye, &lit, |mesh, _| mesh["nodes"][1]["rotation"] = json!([0.0, 0.382_683, 0.0, 0.923_880]));
    folder.write("env.exr", &two_coloured());
    let baked = baked(&folder);
    let refused = GpuError::check_sampled(&baked.scene).unwrap_err().to_string();
    assert_eq!(refused, "the mesh has parts that are not skin, of which adapters make no samples.");
    let camera = baked.scene.views[0].camera;
    let options = RenderOptions { animated: true, ..EXACT };
    let mut renderer = Renderer::new(gpu, Content::of(&baked), options).unwrap();
    let middle = |renderer: &mut Renderer| renderer.render(&camera, 1.0).unwrap().image.rgb[8 * 16 + 8];
    let before = middle(&mut renderer);
    let mut params = baked.scene.params.clone();
    params.set(Param::EnvironmentRotation, 180.0);
    renderer.set_params(&params).unwrap();
    let turned = middle(&mut renderer);
    // Half a turn exchanges the colours; the 32 directions are not the mirror of themselves.
    assert!((before[0] - before[1]).abs() > 0.1 && before[2] > 0.1, "{before:?}");
    assert!(close([turned[1], turned[0], turned[2]], before, 1e-2), "{before:?} {turned:?}");
    // A pose whose part lies further to the left is drawn as a scene that has it there.
    let mut moved = baked.scene.mesh.clone();
    let parts = std::sync::Arc::clone(moved.plain.as_ref().unwrap());
    for (corners, _) in moved.triangles.iter().zip(&parts.of_triangle).filter(|(_, of)| of.is_some()) {
        corners
            .iter()
            .for_each(|&i| moved.positions[i as usize].x = baked.scene.mesh.positions[i as usize].x - 0.3);
    }
    renderer.set_params(&baked.scene.params).unwrap();
    renderer.set_mesh(&moved, None).unwrap();
    let posed = renderer.render(&camera, 1.0).unwrap().image;
    let made = on_gpu(gpu, &baked.with_scene(|scene| scene.mesh = moved), EXACT);
    assert_eq!(posed.rgb, made.rgb);
}

#[test]
fn what_stands_beside_a_part_takes_of_its_sky_and_lamps_what_rays_find() {
    let Some(gpu) = gpu() else { return };
    let lamps = "[[light]]\nname = \"plain_beside\"\ntype = \"point\"\nposition = [3, 0.5, 2]\nintensity = [20, 20, 20]\n\
                 [[light]]\nname = \"plain_other\"\ntype = \"spot\"\nposition = [-2, 0, 3]\nintensity = [0, 9, 0]\n\
                 direction = [2, 0, -2.5]\ninner_degrees = 10\nouter_degrees = 30\n";
    let lit = SCENE.replace("\"diffuse\"", "\"diffuse\", \"lights\", \"shadows\"") + lamps;
    let chalk = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.6, "baseColorFactor": [0.7, 0.7, 0.7, 1]}});
    // A wall of skin beside the part, and without it.
    for (wall, turn) in [(false, 0.0_f64), (true, 0.0), (true, 180.0)] {
        let folder = edited(&chalk, &lit, |mesh, _| {
            // Turned about, its back is seen: drawn as a front, and lit as one.
            let half = 0.5 * turn.to_radians();
            mesh["nodes"][1]["rotation"] = json!([0.0, half.sin(), 0.0, half.cos()]);
            if wall {
                let wall = json!({"mesh": 0, "scale": [0.6, 0.6, 0.6], "translation": [0.75, 0, 0.9], "rotation": [0.0, -FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2]});
                mesh["nodes"].as_array_mut().unwrap().push(wall);
                mesh["scenes"][0]["nodes"] = json!([0, 1, 2]);
            }
        });
        folder.write("env.exr", &two_coloured());
        let [rays, drawn] = both(gpu, &folder);
        let mean = |image: &Image| {
            let inner = (6..10).flat_map(|y| (6..10).map(move |x| image.rgb[y * 16 + x]));
            inner.fold([0.0_f32; 3], |sum, rgb| std::array::from_fn(|c| sum[c] + rgb[c] / 16.0))
        };
        let (rays, drawn) = (mean(&rays), mean(&drawn));
        // Without a wall what is left is 32 directions of a lobe beside 32 rays of each sample, of a sky of two halves. Beside
        // it places know in three bands what samples know ray by ray: a step of a half is off by up to an eighth.
        let tolerance = if wall { 0.12 } else { 0.02 };
        // Blue is the first lamp's alone.
        for c in 0..3 {
            assert!(
                (drawn[c] - rays[c]).abs() < tolerance * rays[c] + 1e-3,
                "wall {wall}, {turn}: {drawn:?} is not {rays:?}"
            );
        }
    }
}

#[test]
fn edges_that_the_hardware_multisamples_are_as_bright_as_many_samples_have_them() {
    let Some(gpu) = gpu() else { return };
    let lamp = "[[light]]\nname = \"plain_edge\"\ntype = \"point\"\nposition = [2, 1, 3]\nintensity = [20, 20, 20]\n";
    let lit = SCENE.replace("\"diffuse\"", "\"lights\", \"shadows\"") + lamp;
    let chalk = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}});
    let baked = baked(&edited(&chalk, &lit, super::shapes::octahedron));
    let drawn = |antialias| {
        let camera = baked.scene.views[0].camera;
        let mut renderer =
            Renderer::new(gpu, Content::of(&baked), RenderOptions { antialias, ..EXACT }).unwrap();
        renderer.render_plain(&camera, 1.0).unwrap().unwrap()
    };
    let [few, many] = [Antialias::Msaa4, Antialias::Grid(8)].map(drawn);
    let brightest = many.rgb.iter().map(|rgb| rgb[0]).fold(0.0, f32::max);
    for (i, (few, many)) in few.rgb.iter().zip(&many.rgb).enumerate() {
        // A pixel's middle stands for its samples: at an edge between faces half of it is of another one.
        let off = (few[0] - many[0]).abs();
        assert!(few[0] >= 0.0 && off < 0.3 * brightest, "pixel {i}: {few:?} {many:?}");
    }
}

#[test]
fn a_picture_without_layers_has_none() {
    let Some(gpu) = gpu() else { return };
    let scene = SCENE.replace("fov_y_degrees = 30", "fov_y_degrees = 60\nbackground = \"environment\"");
    let baked = baked(&folder(&json!({"name": "Eye"}), &scene));
    let camera = baked.scene.views[0].camera;
    let mut painter = GpuPainter::new(gpu.clone(), &baked, EXACT).unwrap();
    for (layers, names) in [(false, vec![]), (true, vec!["diffuse", "plain", "background"])] {
        let beside = Beside { layers, haze: false };
        let now = painter.paint(&camera, Gain::ONE, beside).unwrap();
        let later = pollster::block_on(painter.paint_async(&camera, Gain::ONE, beside)).unwrap();
        for picture in [now, later] {
            assert_eq!(picture.layers.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), names);
        }
    }
}

#[test]
fn two_layers_that_blend_hold_back_what_both_do() {
    let Some(gpu) = gpu() else { return };
    let veil = json!({"name": "Eye", "alphaMode": "BLEND", "pbrMetallicRoughness": {
        "metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [0, 0, 0, 0.5]}});
    let folder = edited(&veil, SCENE, |mesh, _| {
        let second = json!({"mesh": 1, "scale": [0.5, 0.5, 0.5], "translation": [0, 0, 0.6]});
        mesh["nodes"].as_array_mut().unwrap().push(second);
        mesh["scenes"][0]["nodes"] = json!([0, 1, 2]);
    });
    let options = RenderOptions { antialias: Antialias::Grid(8), ..EXACT };
    let image = on_gpu(gpu, &baked(&folder), options);
    let shown: Vec<f32> =
        (6..10).flat_map(|y| (6..10).map(move |x| y * 16 + x)).map(|i| image.rgb[i][0]).collect();
    // Of 64 samples in two orders of their own a quarter passes both, with a spread of four of them (hypergeometric: 2.0).
    let mean = shown.iter().sum::<f32>() / 16.0;
    assert!((mean - 0.25).abs() < 0.03 && shown.iter().all(|x| (x - 0.25).abs() < 0.15), "{shown:?}");
}

#[test]
fn the_eyes_of_a_path_traced_head_look_as_by_rays() {
    let Some(gpu) = gpu() else { return };
    let Some(data) = common::data() else { return };
    let options = PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() };
    let baked = Baked::new(&data.join("mh_portrait/scene.toml"), &options).unwrap();
    let view = &baked.scene.views[0];
    let sampled = baked.clone().sample().unwrap();
    let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
    let drawn = renderer.render_plain(&view.camera, 1.0).unwrap().unwrap();
    let (mut misfit, mut energy, mut coverage, mut means) = (0.0_f64, 0.0_f64, [0.0_f64; 2], [0.0_f64; 2]);
    for part in &sampled.samples[0].plain {
        let at = part.pixel as usize;
        coverage[0] += f64::from(part.share);
        coverage[1] += f64::from(drawn.alpha[at]);
        for (got, want) in drawn.rgb[at].iter().zip(part.rgb) {
            misfit += f64::from(got - want).powi(2);
            energy += f64::from(want).powi(2);
            means[0] += f64::from(want);
            means[1] += f64::from(*got);
        }
    }
    // What is before the eyes in the sky is known by nine numbers a place: a sixth of the radiance, and with it all of the eye a
    // little darker. The rays' own noise is in this, too: a twelfth beside 64 samples a pixel.
    let error = (misfit / energy).sqrt();
    let mean = means[1] / means[0];
    println!("eyes: {:.1}% of their radiance, {mean} of its mean; {coverage:?} pixels", 100.0 * error);
    assert!(error < 0.22 && (mean - 1.0).abs() < 0.08, "{error} {mean}");
    // Samples lie where the rays go, but for roundings at edges: a pixel in all.
    assert!((coverage[0] - coverage[1]).abs() < 1.0, "{coverage:?}");
}

//! The sky that a point sees, and what the skin throws back, from the bakes through samples, engines and renderer.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec2, Vec3};
use skinfit::bake::rays::RayMesh;
use skinfit::bake::sky::{SKY_RATIO, SKY_TURNS, Wanted};
use skinfit::bake::{Bake, Ranges, bake, bake_pose};
use skinfit::engine::Unknown;
use skinfit::engine::gpu::DeviceSamples;
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::choices::{Bounces, Choices, SpecularVisibility, Visibility};
use skinfit::model::effects::{Effect, Effects};
use skinfit::model::fields::{Field, Fields};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, Loaded, PrepareOptions, Views};
use skinfit::render::image::Image;
use skinfit::render::shade::Shader;
use skinfit::samples::{PosedSurface, sample_views};
use skinfit::scene::maps::{Environment, Map, Spots};
use skinfit::scene::mesh::{Mesh, PosedMesh};
use skinfit::scene::view::{Background, Target, View};
use skinfit::scene::{Quality, Scene};
use skinfit::shader::term::library;

use crate::fixtures::{bare_scene, camera};
use crate::graphics::bench::{Difference, EXACT, built_in, cache, gpu, quantile};
use crate::harmonics::add_band;
use crate::scene_folder::SceneFolder;
use crate::slopes;

pub(crate) fn effect(name: &str) -> Effect {
    library::register_all();
    Effect::from_name(name).unwrap()
}

/// The inside of a sphere, open above an angle from +Y; with an angle of 0 and `outside` a convex shape.
pub(crate) fn shape(opening: f64, outside: bool) -> PosedMesh {
    let mut mesh = PosedMesh::default();
    add_band(&mut mesh, DVec3::Y, [opening, std::f64::consts::PI]);
    if outside {
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    mesh.uvs = vec![Vec2::splat(0.5); mesh.positions.len()];
    mesh
}

/// A scene of `mesh` seen from above, under a panorama of 16 x 8 texels.
pub(crate) fn scene(mesh: &PosedMesh, texel: impl Fn(usize, usize) -> [f32; 3], choices: Choices) -> Scene {
    let effects = Effects::of(&[Effect::Diffuse, effect("directional_occlusion")]);
    let PosedMesh { positions, normals, uvs, triangles, .. } = mesh.clone();
    let texels = (0..128).map(|i| texel(i % 16, i / 16)).collect();
    // From above: the camera looks down.
    let from_above = [1., 0., 0., 0., 0., 0., -1., 0., 0., 1., 0., -4., 0., 0., 0., 1.];
    let view = View {
        name: "above".to_owned(),
        camera: camera(from_above, 30.0, 24),
        target: None,
        background: Background::None,
    };
    Scene {
        mesh: Mesh { positions, normals, uvs, triangles, ..Mesh::default() },
        environment: Some(Environment {
            panorama: Map { width: 16, height: 8, texels },
            rotation_degrees: 20.0,
            intensity: 1.5,
            spots: Spots::default(),
        }),
        views: vec![view],
        choices,
        quality: Quality { samples_per_axis: 1, irradiance_size: 16, ..Quality::default() },
        ..bare_scene(effects)
    }
}

fn chosen(visibility: Visibility, bounces: Bounces) -> Choices {
    Choices { visibility, bounces, ..Choices::default() }
}

/// Light whose first two bands are nowhere near 0.
pub(crate) fn gentle(x: usize, y: usize) -> [f32; 3] {
    [1.0 + x as f32 / 16.0, 1.5 + (y % 3) as f32 / 4.0, if (4..7).contains(&x) && y < 4 { 4.0 } else { 1.0 }]
}

pub(crate) fn uneven(x: usize, y: usize) -> [f32; 3] {
    [0.2 + x as f32 / 8.0, 0.5 + (y % 3) as f32, if (4..7).contains(&x) && y < 4 { 6.0 } else { 0.1 }]
}

pub(crate) fn bakes(scene: &Scene) -> Bake {
    let pose = |weights: &[f32]| scene.mesh.pose_with_weights(weights);
    bake(scene, &pose, &Ranges::of(scene, false), None).unwrap().0
}

/// What is found of the sky at each vertex.
fn ratios(scene: &Scene, bakes: &Bake) -> Vec<[f32; 3]> {
    let posed = scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let field = Field::from_name(SKY_RATIO).unwrap();
    let fields = Fields::of([field]);
    let surface = PosedSurface::with_fields(scene, &posed, &rays, &scene.mesh.morphs, bakes.into(), fields);
    surface.unwrap().field_of_vertices(field).as_chunks().0.to_vec()
}

pub(crate) fn image(scene: &Scene, bakes: &Bake) -> Image {
    let samples = sample_views(scene, &scene.mesh.pose(), bakes.into()).unwrap();
    let shader = Shader::new(scene.setup(), &bakes.illumination, &scene.params).unwrap();
    shader.shade(&samples[0], &scene.views[0].camera, 1.0).image
}

/// The largest difference between two images' channels.
pub(crate) fn apart(a: &Image, b: &Image) -> f32 {
    assert!(a.alpha == b.alpha && a.alpha.contains(&1.0));
    let pairs = a.rgb.iter().flatten().zip(b.rgb.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn poses_share_the_panorama_that_rays_look_up() {
    let scene = scene(&shape(0.5, false), gentle, chosen(Visibility::Rays, Bounces::None));
    let light = |known| bake_pose(&scene, &scene.mesh.pose(), known, None).0.sky.unwrap().light.unwrap();
    let first = light(None);
    let second = light(Some(&first));
    assert!(Arc::ptr_eq(&first.panorama.unwrap(), &second.panorama.unwrap()));
}

#[test]
fn a_convex_shape_is_lit_as_without_occlusion() {
    let ball = shape(0.0, true);
    for visibility in Visibility::ALL {
        for bounces in Bounces::ALL {
            let scene = scene(&ball, gentle, chosen(visibility, bounces));
            let bakes = bakes(&scene);
            let found = ratios(&scene, &bakes);
            assert!(found.iter().all(|ratio| *ratio == [1.0; 3]), "{visibility:?} {bounces:?}");
            let mut open = scene.clone();
            open.effects = Effects::of(&[Effect::Diffuse]);
            let (got, want) = (image(&scene, &bakes), image(&open, &bakes));
            // Jimenez' polynomial is 1.0001 for white skin that sees all of the sky; else the products' order differs.
            let most = if bounces == Bounces::Polynomial { 1e-3 } else { 1e-6 };
            assert!(apart(&got, &want) <= most, "{visibility:?} {bounces:?}: {}", apart(&got, &want));
        }
    }
}

#[test]
fn in_even_light_the_ratio_is_the_open_share() {
    let bowl = shape(1.2, false);
    for visibility in Visibility::ALL {
        let scene = scene(&bowl, |_, _| [0.7, 2.0, 1.0], chosen(visibility, Bounces::None));
        let found = ratios(&scene, &bakes(&scene));
        let mut occluded = scene.clone();
        occluded.effects = Effects::of(&[Effect::Diffuse, Effect::Occlusion]);
        let open = bakes(&occluded).occlusion.unwrap().base;
        let errors = found.iter().zip(&open).map(|(ratio, open)| (ratio[1] - open).abs());
        if visibility == Visibility::Rays {
            let errors: Vec<f32> =
                errors.zip(&bowl.positions).filter(|(_, at)| has_area(at)).map(|(error, _)| error).collect();
            // The same 256 directions, from other heights above the facets.
            assert!(errors.iter().sum::<f32>() < 0.01 * errors.len() as f32);
            continue;
        }
        let most = errors.fold(0.0, f32::max);
        // The same numbers, rounded.
        assert!(most < 2e-6, "{visibility:?}: {most}");
    }
}

/// Whether the bowl's triangles around a vertex have an area: at the bottom they are thinner than rounding, and what lies
/// above them is nowhere.
fn has_area(position: &Vec3) -> bool {
    position.y > -0.95
}

#[test]
fn a_white_furnace_stays_at_most_as_bright_as_the_light_that_heats_it() {
    // Nearly closed: most light arrives by way of the walls.
    let furnace = shape(0.4, false);
    for visibility in Visibility::ALL {
        let mean = |bounces: Bounces| {
            let scene = scene(&furnace, |_, _| [1.0; 3], chosen(visibility, bounces));
            let found = ratios(&scene, &bakes(&scene));
            // Bands that ring, and rounding.
            assert!(found.iter().flatten().all(|x| (0.0..=1.0 + 1e-5).contains(x)), "{visibility:?}");
            found.iter().map(|ratio| f64::from(ratio[0])).sum::<f64>() / found.len() as f64
        };
        let (direct, gathered) = (mean(Bounces::None), mean(Bounces::Gathered));
        // From any place in a sphere any part of it is seen by its area: all walls are as bright.
        let closed = 1.0 - direct;
        let want = direct * (1.0 + closed + closed * closed);
        // Twelve rings of facets, and rays that meet them from behind at the rim.
        assert!((gathered / want - 1.0).abs() < 0.03, "{visibility:?}: {direct} {gathered} {want}");
    }
}

#[test]
fn neutral_values_are_todays_images() {
    let bowl = shape(1.2, false);
    let mut scene = scene(&bowl, uneven, chosen(Visibility::Scalar, Bounces::None));
    let both = Effects::of(&[Effect::Diffuse, Effect::Occlusion]);
    scene.effects = both.with(effect("directional_occlusion"));
    let mut today = scene.clone();
    today.effects = both;
    let (with, without) = (bakes(&scene), bakes(&today));
    // The scalar is the same number, rounded, and interpolated the other way round.
    assert!(apart(&image(&scene, &with), &image(&today, &without)) < 1e-5);
    // What no occlusion is taken of is open.
    scene.choices = Choices::default();
    for scene in [&mut scene, &mut today] {
        scene.params.set(Param::Occlusion, 0.0);
    }
    let with = bakes(&scene);
    assert!(apart(&image(&scene, &with), &image(&today, &without)) < 1e-6);
    // The polynomial is a rule: it follows the parameter.
    scene.choices.bounces = Bounces::Polynomial;
    assert!(apart(&image(&scene, &with), &image(&today, &without)) < 1e-3);
    scene.params.set(Param::Occlusion, 1.0);
    let polynomial = image(&scene, &with);
    scene.choices.bounces = Bounces::None;
    let none = image(&scene, &with);
    let brighter =
        polynomial.rgb.iter().flatten().zip(none.rgb.iter().flatten()).all(|(a, b)| *a >= b - 1e-6);
    assert!(brighter && apart(&polynomial, &none) > 0.01);
}

#[test]
fn without_light_nothing_arrives() {
    let bowl = shape(1.2, false);
    for visibility in Visibility::ALL {
        let scene = scene(&bowl, |_, _| [0.0, 1.0, 0.0], chosen(visibility, Bounces::Gathered));
        let bakes = bakes(&scene);
        let found = ratios(&scene, &bakes);
        assert!(
            found.iter().all(|ratio| ratio[0] == 0.0 && ratio[1] > 0.0 && ratio[2] == 0.0),
            "{visibility:?}"
        );
        assert!(image(&scene, &bakes).rgb.iter().flatten().all(|x| x.is_finite()));
    }
}

#[test]
fn more_bands_come_nearer_to_rays() {
    let bowl = shape(1.2, false);
    let of = |visibility: Visibility| -> Vec<f32> {
        let mut scene = scene(&bowl, gentle, chosen(visibility, Bounces::Gathered));
        scene.quality.sky_rays = 1024;
        let found = ratios(&scene, &bakes(&scene));
        found
            .into_iter()
            .zip(&bowl.positions)
            .filter(|(_, at)| has_area(at))
            .flat_map(|(ratio, _)| ratio)
            .collect()
    };
    let truth = of(Visibility::Rays);
    let error = |visibility: Visibility| {
        let of = of(visibility);
        let squares: f64 = of.iter().zip(&truth).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        (squares / truth.len() as f64).sqrt()
    };
    let [scalar, cone] = [Visibility::Scalar, Visibility::Cone].map(error);
    let bands = [Visibility::Sh2, Visibility::Sh4, Visibility::Sh6].map(error);
    // Found: 0.041 by the open share, 0.020 by a cone, 0.041, 0.010 and 0.006 by two, four and six bands; the light's first
    // two bands know little of its window. What is left is of the vertices' 256 rays.
    assert!(cone < 0.7 * scalar && bands[0] < 1.2 * scalar, "{scalar} {cone} {bands:?}");
    assert!(bands[1] < 0.4 * bands[0] && bands[2] < 0.8 * bands[1], "{bands:?}");
}

#[test]
fn a_turned_environment_is_found_turned_and_held_while_it_turns() {
    let bowl = shape(1.2, false);
    let still = scene(&bowl, uneven, Choices::default());
    let mut turned = still.clone();
    turned.environment.as_mut().unwrap().rotation_degrees += 40.0;
    let mut by_parameter = still.clone();
    by_parameter.params.set(Param::EnvironmentRotation, 40.0);
    let want = ratios(&turned, &bakes(&turned));
    let got = ratios(&by_parameter, &bakes(&by_parameter));
    let pairs = got.iter().flatten().zip(want.iter().flatten());
    // Coefficients turned once or twice, rounded to f32.
    pairs.for_each(|(got, want)| assert!((got - want).abs() < 1e-5, "{got} {want}"));
    // Samples hold what was found where they were made: only the cubes turn beside them.
    let (at_rest, moved) = (bakes(&still), bakes(&by_parameter));
    let shader = Shader::new(by_parameter.setup(), &at_rest.illumination, &by_parameter.params).unwrap();
    let shaded = |made: &Scene, bakes: &Bake| {
        let samples = sample_views(made, &made.mesh.pose(), bakes.into()).unwrap();
        shader.shade(&samples[0], &made.views[0].camera, 1.0).image
    };
    let (held, found) = (shaded(&still, &at_rest), shaded(&by_parameter, &moved));
    let mut open = by_parameter;
    open.effects = Effects::of(&[Effect::Diffuse]);
    let cubes = image(&open, &at_rest);
    assert!(apart(&held, &found) > 0.01);
    // What is held is the ratio of the still scene: the image over that without occlusion, a pixel.
    let mut still_open = still.clone();
    still_open.effects = open.effects;
    let (before, before_open) = (image(&still, &at_rest), image(&still_open, &at_rest));
    for i in (0..held.rgb.len()).filter(|&i| held.alpha[i] == 1.0) {
        for c in 0..3 {
            let (now, then) = (held.rgb[i][c] / cubes.rgb[i][c], before.rgb[i][c] / before_open.rgb[i][c]);
            // Quotients of numbers in f32.
            assert!((now - then).abs() < 1e-5 * then.max(1.0), "{now} {then}");
        }
    }
}

#[test]
fn a_turned_sky_moves_as_its_harmonics_do() {
    let bowl = shape(1.2, false);
    for visibility in [Visibility::Scalar, Visibility::Cone, Visibility::Sh3, Visibility::Sh6] {
        let at = |degrees: f64| {
            let mut scene = scene(&bowl, gentle, chosen(visibility, Bounces::Gathered));
            scene.fit.free = vec![Column::tied(Param::EnvironmentRotation)];
            scene.params.set(Param::EnvironmentRotation, degrees);
            scene
        };
        let found = |degrees: f64| ratios(&at(degrees), &bakes(&at(degrees)));
        let (own, h) = (at(35.0), 0.2_f64);
        let bakes = bakes(&own);
        let posed = own.mesh.pose();
        let rays = RayMesh::new(&posed.positions, &posed.triangles);
        let fields = SKY_TURNS.map(|name| Field::from_name(name).unwrap());
        assert!(fields.iter().all(|field| own.needs().fields.iter().any(|asked| asked == *field)));
        let surface =
            PosedSurface::with_fields(&own, &posed, &rays, &[], (&bakes).into(), Fields::of(fields)).unwrap();
        let [cosine, sine, curve] = fields.map(|field| surface.field_of_vertices(field));
        let (above, below) = (found(35.0 + h), found(35.0 - h));
        let (sin, cos) = 35_f64.to_radians().sin_cos();
        let mut steepest = 0.0_f64;
        for (i, (above, below)) in above.iter().flatten().zip(below.iter().flatten()).enumerate() {
            let slope = f64::from(sine[i]) * cos - f64::from(cosine[i]) * sin;
            let want = f64::from(above - below) / (2.0 * h.to_radians());
            // Ratios of about 1 in f32 over 0.007 radians, and the third derivative of up to six waves a turn.
            assert!((slope - want).abs() < 1e-3, "{visibility:?} {i}: {slope} {want}");
            // At the angle itself what is added is nothing.
            let added = f64::from(curve[i]) + f64::from(cosine[i]) * cos + f64::from(sine[i]) * sin;
            assert!(added.abs() < 1e-6, "{added}");
            steepest = steepest.max(want.abs());
        }
        assert!(steepest > 0.02, "{visibility:?}: {steepest}");
        // Further away, beside what the slope alone says.
        let (here, there, by) = (found(35.0), found(55.0), 20_f64.to_radians());
        let (turned_sin, turned_cos) = 55_f64.to_radians().sin_cos();
        let mut squares = [0.0; 2];
        for (i, (here, there)) in here.iter().flatten().zip(there.iter().flatten()).enumerate() {
            let [sine, cosine, curve] = [&sine, &cosine, &curve].map(|field| f64::from(field[i]));
            let slope = sine * cos - cosine * sin;
            let added = [curve + cosine * turned_cos + sine * turned_sin, slope * by.sin()];
            for (square, added) in squares.iter_mut().zip(added) {
                *square += (f64::from(*here) + added - f64::from(*there)).powi(2);
            }
        }
        assert!(squares[0] < 0.5 * squares[1], "{visibility:?}: {squares:?}");
    }
    // Nothing turns: nobody asks.
    let held = scene(&bowl, gentle, chosen(Visibility::Sh4, Bounces::Gathered));
    assert!(held.needs().fields.iter().all(|field| !SKY_TURNS.contains(&field.name())));
}

#[test]
fn results_are_the_same_for_any_number_of_threads() {
    let bowl = shape(1.2, false);
    for visibility in [Visibility::Cone, Visibility::Sh4, Visibility::Rays] {
        let scene = scene(&bowl, uneven, chosen(visibility, Bounces::Gathered));
        let [one, four] = [1, 4].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| ratios(&scene, &bakes(&scene)))
        });
        assert!(one == four, "{visibility:?}");
    }
}

#[test]
fn only_what_is_asked_for_is_baked() {
    let bowl = shape(1.2, false);
    let mut scene = scene(&bowl, uneven, Choices::default());
    let order = |scene: &Scene| Wanted::of(scene).map(|wanted| (wanted.order.bands(), wanted.bounces));
    for (visibility, bounces, want) in [
        (Visibility::Sh3, Bounces::Gathered, (3, true)),
        (Visibility::Sh6, Bounces::Polynomial, (6, false)),
        (Visibility::Scalar, Bounces::None, (2, false)),
        (Visibility::Cone, Bounces::Gathered, (4, true)),
        (Visibility::Rays, Bounces::None, (2, false)),
        (Visibility::Rays, Bounces::Gathered, (6, false)),
    ] {
        scene.choices = chosen(visibility, bounces);
        assert_eq!(order(&scene), Some(want));
    }
    scene.effects = Effects::SURFACE;
    assert!(Wanted::of(&scene).is_none() && bakes(&scene).sky.is_none());
    // The specular lobe's cone asks for the bent normal, and not for light.
    scene.effects = Effects::of(&[effect("fresnel")]);
    assert_eq!(Wanted::of(&scene), None);
    scene.choices.specular_visibility = SpecularVisibility::Cone;
    let wanted = Wanted::of(&scene).unwrap();
    assert!(wanted.order.bands() == 2 && !wanted.bounces && !wanted.light);
    let bakes = bakes(&scene);
    let posed = scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let field = Field::from_name("bent_normal").unwrap();
    let surface = PosedSurface::with_fields(&scene, &posed, &rays, &[], (&bakes).into(), Fields::of([field]));
    let bent = surface.unwrap().field_of_vertices(field);
    // Every place of the bowl sees its opening, which is above.
    assert!(bent.as_chunks::<3>().0.iter().all(|&v| Vec3::from(v).length() < 1.0 && v[1] > 0.0));
}

#[test]
fn a_sun_that_is_left_in_the_panorama_is_told() {
    let bowl = shape(1.2, false);
    let warned = |texel: fn(usize, usize) -> [f32; 3], visibility: Visibility| {
        let scene = scene(&bowl, texel, chosen(visibility, Bounces::None));
        let pose = |weights: &[f32]| scene.mesh.pose_with_weights(weights);
        let (_, stats) = bake(&scene, &pose, &Ranges::of(&scene, false), None).unwrap();
        stats.warnings.iter().any(|warning| warning.contains("lights = 4"))
    };
    let sun = |x: usize, y: usize| if (x, y) == (3, 2) { [900.0; 3] } else { [0.1; 3] };
    assert!(warned(sun, Visibility::Sh4) && warned(sun, Visibility::Sh2));
    assert!(!warned(sun, Visibility::Scalar) && !warned(sun, Visibility::Rays));
    assert!(!warned(|_, y| [1.0 + y as f32; 3], Visibility::Sh4));
}

/// The built-in head with a lamp beside its environment.
fn head() -> Baked {
    head_with(&[Effect::Lights, Effect::Shadows, effect("directional_occlusion")])
}

/// The built-in scene with a lamp, written once: tests read it side by side.
pub(crate) fn beside_a_lamp() -> &'static Path {
    static SCENE: OnceLock<PathBuf> = OnceLock::new();
    SCENE.get_or_init(|| {
        let built_in = built_in();
        let text = std::fs::read_to_string(&built_in).unwrap();
        let path = built_in.with_file_name("sky.toml");
        let lamp = "\n[[light]]\nname = \"side\"\ntype = \"directional\"\ndirection = [-0.8, -0.3, -0.4]\nirradiance = [2.0, 1.5, 1.0]\n";
        std::fs::write(&path, text + lamp).unwrap();
        path
    })
}

/// The same with effects beside diffuse light, occlusion and rim; the lamp's own where lights are among them.
pub(crate) fn head_with(more: &[Effect]) -> Baked {
    head_changed(more, |_| ())
}

/// The same, changed before anything is baked.
pub(crate) fn head_changed(more: &[Effect], change: impl FnOnce(&mut Scene)) -> Baked {
    let path = beside_a_lamp();
    library::register_all();
    let options = PrepareOptions { views: Views::First, cache: Some(cache()), ..PrepareOptions::default() };
    let mut loaded = Loaded::read(path, &PrepareOptions { effects: None, ..options }).unwrap();
    let plain = Effects::of(&[Effect::Diffuse, Effect::Occlusion, Effect::Rim]);
    let effects = more.iter().fold(plain, |all, &one| all.with(one));
    let lit = effects.has(Effect::Lights);
    loaded.scene.effects = if lit { effects.with(effect("light_side")) } else { effects };
    let camera = &mut loaded.scene.views[0].camera;
    (camera.width, camera.height) = (64, 64);
    loaded.scene.quality.occlusion_rays = 64;
    change(&mut loaded.scene);
    loaded.bake().unwrap()
}

/// A target that an image does not match: a little brighter, by a factor and a sum.
pub(crate) fn brighter(made: Image) -> Target {
    Target {
        rgb: made.rgb.iter().map(|rgb| rgb.map(|x| 1.2 * x + 0.01)).collect(),
        alpha: Some(made.alpha),
        haze: None,
        mask: None,
        clipped_at: None,
    }
}

pub(crate) fn on_cpu(baked: &Baked) -> Image {
    let sampled = baked.clone().sample().unwrap();
    let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params).unwrap();
    shader.shade(&sampled.samples[0], &sampled.scene.views[0].camera, 1.0).image
}

#[test]
fn the_renderer_draws_what_the_processor_does_and_adapters_make_no_such_samples() {
    let baked = head();
    let want = on_cpu(&baked);
    let Some(gpu) = gpu() else { return };
    let camera = baked.scene.views[0].camera;
    let got = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
    let Difference { interior, .. } = Difference::new(&want, &got, 4);
    // Shadows of the lamp are interpolated from vertices there, and found at each sample here.
    assert!(quantile(&interior, 0.5) < 1e-4, "{}", quantile(&interior, 0.5));
    let error = DeviceSamples::new(gpu, Content::of(&baked)).err().unwrap().to_string();
    assert!(error.contains("sky_ratio") || error.contains("light_side"), "{error}");
}

#[test]
fn a_lamps_light_is_thrown_back_in_proportion_to_its_colour() {
    let mut baked = head();
    let part = |baked: &Baked| {
        let sampled = baked.clone().sample().unwrap();
        let shader = Shader::new(sampled.setup(), &sampled.illumination, &sampled.scene.params).unwrap();
        let terms = shader.shade(&sampled.samples[0], &sampled.scene.views[0].camera, 1.0).terms;
        terms.into_iter().find(|(name, _)| name.name() == "light_side").unwrap().1
    };
    let once = part(&baked);
    let color = Param::from_name("light.side.color").unwrap();
    baked = baked.with_scene(|scene| scene.params.set(color, 2.0));
    let twice = part(&baked);
    let pairs = once.rgb.iter().flatten().zip(twice.rgb.iter().flatten());
    pairs.for_each(|(once, twice)| assert!((2.0 * once - twice).abs() <= 1e-6 * twice));
    // Without it, the side that the lamp does not see is black; with it, the skin lights itself.
    let bare = baked.with_scene(|scene| {
        scene.params.set(color, 1.0);
        scene.choices.bounces = Bounces::None;
    });
    let bare = part(&bare);
    let pairs = || once.rgb.iter().flatten().zip(bare.rgb.iter().flatten());
    assert!(pairs().all(|(with, without)| with >= without));
    assert!(pairs().any(|(with, without)| *without == 0.0 && *with > 1e-4));
}

#[test]
fn slopes_are_finite_differences_on_every_engine() {
    for bounces in [Bounces::Gathered, Bounces::Polynomial] {
        let baked = head().with_scene(|scene| {
            scene.choices.bounces = bounces;
            scene.params.set(Param::Occlusion, 0.8);
        });
        let target = brighter(on_cpu(&baked));
        let observed = baked
            .with_scene(|scene| scene.views[0].target = Some(target))
            .sample()
            .unwrap()
            .observe()
            .unwrap();
        let names = ["base_weight", "rim_weight", "rim_exponent", "occlusion", "light.side.color"];
        let column = |name: &str| Column::tied(Param::from_name(name).unwrap());
        let unknowns: Vec<Unknown> = names.map(|name| Unknown::Param(column(name))).to_vec();
        slopes::assert_slopes(&observed, &unknowns, &slopes::EXACT, bounces.name());
    }
}

#[test]
fn choices_are_read_and_refused_by_name() {
    let folder = SceneFolder::new();
    let (scene, _) =
        folder.edited("[model]\n", "[model]\nvisibility = \"sh6\"\nbounces = \"none\"\n").unwrap();
    assert_eq!((scene.choices.visibility, scene.choices.bounces), (Visibility::Sh6, Bounces::None));
    assert_eq!(folder.edited("[quality]\n", "[quality]\nsky_rays = 64\n").unwrap().0.quality.sky_rays, 64);
    for (from, to, words) in [
        ("[model]\n", "[model]\nvisibility = \"sh7\"\n", "unknown visibility `sh7`"),
        ("[model]\n", "[model]\nbounces = \"gather\"\n", "Did you mean `gathered`?"),
        ("[quality]\n", "[quality]\nsky_rays = 0\n", "sky_rays"),
    ] {
        let error = folder.edited(from, to).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("line"), "{error}");
    }
    // Lamps alone need no environment.
    let lamp = "[[light]]\nname = \"key\"\ntype = \"directional\"\ndirection = [0, 0, -1]\nirradiance = 1\n";
    let text = crate::scene_folder::SCENE
        .replace("[environment]\nfile = \"env.exr\"\n", "")
        .replace("[model]\n", "[model]\neffects = [\"lights\", \"directional_occlusion\"]\n");
    folder.write("scene.toml", (text + lamp).as_bytes());
    let (scene, _) = folder.load().unwrap();
    assert!(scene.environment.is_none() && bakes(&scene).sky.is_none());
}

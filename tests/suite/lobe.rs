//! What the specular lobe sees: light by rays against integrals, and the skin in the skin's reflection.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use skinfit::bake::panorama::Radiance;
use skinfit::bake::rays::RayMesh;
use skinfit::bake::sky::Wanted;
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::choices::{
    Bounces, Choices, SkinReflection, SpecularModel, SpecularVisibility, Visibility,
};
use skinfit::model::effects::{Effect, Effects};
use skinfit::model::fields::{Field, Fields};
use skinfit::model::params::{Column, Param};
use skinfit::render::image::Image;
use skinfit::samples::{PosedSurface, sample_hits};
use skinfit::scene::Scene;
use skinfit::scene::light::{Beam, Light, LightKind};
use skinfit_core::specular::brdf::brdf;

use crate::graphics::bench::{EXACT, gpu};
use crate::scene_folder::SceneFolder;
use crate::sky::{apart, bakes, effect, gentle, head_with, image, on_cpu, scene, shape, uneven};

/// A scene of nothing but the environment's lobe, with that roughness, under those choices.
fn lobe(scene: Scene, roughness: f64, choices: Choices) -> Scene {
    let mut scene = Scene { choices, effects: Effects::of(&[effect("fresnel")]), ..scene };
    scene.params.set(Param::from_name("roughness").unwrap(), roughness);
    scene.params.set(Param::from_name("f0").unwrap(), 0.05);
    scene.quality.lobe_rays = 1024;
    scene.quality.lobe_size = 32;
    scene
}

fn traced(model: SpecularModel) -> Choices {
    Choices { specular_model: model, specular_visibility: SpecularVisibility::Rays, ..Choices::default() }
}

/// The pixels that the mesh covers, and their values.
fn covered(image: &Image) -> impl Iterator<Item = (usize, [f32; 3])> {
    image
        .alpha
        .iter()
        .zip(&image.rgb)
        .enumerate()
        .filter(|(_, (alpha, _))| **alpha > 0.0)
        .map(|(i, (_, &rgb))| (i, rgb))
}

#[test]
fn an_even_sky_is_as_bright_by_rays_as_by_lookups() {
    let ball = shape(0.0, true);
    let even = || scene(&ball, |_, _| [0.7, 2.0, 1.0], Choices::default());
    // From end to end, whatever roughnesses are traced.
    for roughness in [0.05, 0.4, 1.0] {
        let mut rays = lobe(even(), roughness, traced(SpecularModel::Kelemen));
        rays.fit.free = vec![Column::tied(Param::from_name("roughness").unwrap())];
        let open = Choices { specular_visibility: SpecularVisibility::None, ..rays.choices };
        let looked_up = lobe(even(), roughness, open);
        let (rays, looked_up) = (image(&rays, &bakes(&rays)), image(&looked_up, &bakes(&looked_up)));
        // Weighted means of one number, through a parabola whose weights sum to 1: roundings.
        assert!(apart(&rays, &looked_up) < 1e-5, "{roughness}: {}", apart(&rays, &looked_up));
    }
}

#[test]
fn light_by_rays_is_the_integral_over_the_sky() {
    // Of a fit that moves the roughness three are traced, 0.2 and 0.7 among them; of another those that there are.
    for (m, free) in [(0.25, false), (0.2, true), (0.7, true), (0.5, true)] {
        for model in SpecularModel::ALL {
            by_rays_beside_integral(model, m, free);
        }
    }
}

fn by_rays_beside_integral(model: SpecularModel, m: f64, free: bool) {
    let ball = shape(0.0, true);
    {
        let mut scene = lobe(scene(&ball, uneven, Choices::default()), m, traced(model));
        if free {
            scene.fit.free = vec![Column::tied(Param::from_name("roughness").unwrap())];
        }
        let image = image(&scene, &bakes(&scene));
        let posed = scene.mesh.pose();
        let rays = RayMesh::new(&posed.positions, &posed.triangles);
        let camera = scene.views[0].camera;
        let hits = sample_hits(&scene, &posed, &rays, &camera);
        let radiance = Radiance::new(scene.environment.as_ref().unwrap());
        let seen: Vec<(usize, [f32; 3])> = covered(&image).collect();
        assert!(seen.len() > 100, "{}", seen.len());
        for &(pixel, rgb) in seen.iter().step_by(37) {
            // The only sample of that pixel is the hit that projects into it.
            let (x, y) = (pixel as u32 % camera.width, pixel as u32 / camera.width);
            let at = hits.iter().find_map(|hit| {
                let corners = posed.triangles[hit.triangle as usize].map(|i| i as usize);
                let weights = hit.weights();
                let p: Vec3 = (0..3).map(|i| weights[i] * posed.positions[corners[i]]).sum();
                let n: Vec3 = (0..3).map(|i| weights[i] * posed.normals[corners[i]]).sum();
                let (px, py, _) = camera.project(p.as_dvec3());
                let inside = px.floor() == f64::from(x) && py.floor() == f64::from(y);
                inside.then(|| (p.as_dvec3(), n.as_dvec3().normalize()))
            });
            let (p, n) = at.unwrap();
            let view = (p - camera.eye()).normalize();
            // Where the view grazes, the sum's cells are wider than the lobe.
            if -n.dot(view) < 0.2 {
                continue;
            }
            let want = integral(&radiance, model, m, n, view);
            // 1024 rays, each of a blurred lookup, of a sky whose texels are 22 degrees wide; and between the roughnesses
            // that are traced the parabola, which a map of unevenly bright texels leaves by up to 5 in 100.
            let most = if m == 0.5 { 0.06 } else { 0.015 };
            for c in 0..3 {
                let error = (f64::from(rgb[c]) - want[c]).abs();
                assert!(
                    error < most * want.iter().copied().fold(0.0, f64::max),
                    "{model:?} {m} {pixel}: {rgb:?} {want:?}"
                );
            }
        }
    }
}

/// BRDF times cosine times the sky, over the sphere by midpoints.
fn integral(radiance: &Radiance<'_>, model: SpecularModel, m: f64, n: DVec3, view: DVec3) -> [f64; 3] {
    let (columns, rows) = (1440, 720);
    let mut sum = [0.0; 3];
    for row in 0..rows {
        let theta = PI * (f64::from(row) + 0.5) / f64::from(rows);
        for column in 0..columns {
            let phi = std::f64::consts::TAU * (f64::from(column) + 0.5) / f64::from(columns);
            let d = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let f = brdf(model, n.into(), view.into(), d.into(), m, 0.05) * n.dot(d).max(0.0) * theta.sin();
            if f > 0.0 {
                let light = radiance.along(d.into());
                (0..3).for_each(|c| sum[c] += f * light[c]);
            }
        }
    }
    sum.map(|sum| sum * PI / f64::from(rows) * std::f64::consts::TAU / f64::from(columns))
}

/// The bowl that a camera looks into, white inside.
fn bowl(texel: impl Fn(usize, usize) -> [f32; 3], choices: Choices) -> Scene {
    let mut scene = scene(&shape(1.2, false), texel, choices);
    scene.effects = Effects::of(&[effect("fresnel"), effect("directional_occlusion"), Effect::Diffuse]);
    scene.quality.lobe_rays = 256;
    scene
}

fn layer(scene: &Scene) -> Image {
    use skinfit::render::shade::Shader;
    use skinfit::samples::sample_views;
    let bakes = bakes(scene);
    let samples = sample_views(scene, &scene.mesh.pose(), (&bakes).into()).unwrap();
    let shader = Shader::new(scene.setup(), &bakes.illumination, &scene.params).unwrap();
    let terms = shader.shade(&samples[0], &scene.views[0].camera, 1.0).terms;
    terms.into_iter().find(|(name, _)| name.name() == "fresnel").unwrap().1
}

fn by(specular_visibility: SpecularVisibility, skin_reflection: SkinReflection) -> Choices {
    Choices { specular_visibility, skin_reflection, ..Choices::default() }
}

#[test]
fn in_a_furnace_skin_that_mirrors_skin_is_between_black_and_the_sky() {
    let even = |_: usize, _: usize| [1.0 / 1.5; 3];
    let all = layer(&bowl(even, by(SpecularVisibility::None, SkinReflection::None)));
    let black = layer(&bowl(even, by(SpecularVisibility::Lobe, SkinReflection::None)));
    for visibility in [SpecularVisibility::Lobe, SpecularVisibility::Rays] {
        let skin = layer(&bowl(even, by(visibility, SkinReflection::Gathered)));
        let mut brighter = 0;
        // Around the opening the camera sees the wall from outside, where no light is known.
        let inside = |&(i, _): &(usize, [f32; 3])| {
            let [x, y] = [i % 24, i / 24].map(|at| at as f64 - 11.5);
            x.hypot(y) < 10.5
        };
        for (pixel, skin) in covered(&skin).filter(inside) {
            let (skin, all, black) = (skin[0], all.rgb[pixel][0], black.rgb[pixel][0]);
            // White walls under light of 1 are lit by at most 1; 256 directions of the open share leave 1%.
            assert!(
                skin >= black - 1e-5 && skin <= 1.01 * all,
                "{visibility:?} {pixel}: {black} {skin} {all}"
            );
            brighter += usize::from(skin > black + 0.1 * all);
        }
        assert!(brighter > 20, "{visibility:?}: {brighter}");
    }
}

#[test]
fn the_skin_that_a_point_sees_stands_in_for_rays() {
    let seen = |visibility, skin| layer(&bowl(gentle, by(visibility, skin)));
    let rays = seen(SpecularVisibility::Rays, SkinReflection::Gathered);
    let mean = |image: &Image| {
        let apart =
            covered(image).map(|(i, rgb)| (0..3).map(|c| (rgb[c] - rays.rgb[i][c]).abs()).sum::<f32>());
        let (sum, count) = apart.fold((0.0, 0.0), |(sum, count), apart| (sum + apart, count + 1.0));
        sum / count
    };
    let with = mean(&seen(SpecularVisibility::Lobe, SkinReflection::Gathered));
    let without = mean(&seen(SpecularVisibility::Lobe, SkinReflection::None));
    // Of light from the whole hemisphere for that of one lobe, and of a sky looked up as if the lobe were round.
    assert!(with < 0.5 * without, "{with} {without}");
}

#[test]
fn without_light_that_is_thrown_back_no_skin_is_seen() {
    let with = |bounces| {
        let choices = Choices { bounces, ..by(SpecularVisibility::Lobe, SkinReflection::Gathered) };
        let scene = bowl(gentle, choices);
        assert_eq!(scene.reflects_skin(), bounces == Bounces::Gathered);
        layer(&scene)
    };
    let black = layer(&bowl(gentle, by(SpecularVisibility::Lobe, SkinReflection::None)));
    for bounces in [Bounces::None, Bounces::Polynomial] {
        assert_eq!(apart(&with(bounces), &black), 0.0);
    }
    assert!(apart(&with(Bounces::Gathered), &black) > 1e-3);
}

#[test]
fn light_by_rays_asks_for_what_a_rasteriser_takes_in_its_place() {
    let scene = bowl(gentle, by(SpecularVisibility::Rays, SkinReflection::Gathered));
    let needs = scene.needs();
    assert!(needs.reflected);
    assert!(needs.fields.iter().any(|field| field.name() == "lobe_middle"));
    // Of the skin alone bands enough are baked for its light.
    let mut alone = scene.clone();
    alone.effects = Effects::of(&[effect("fresnel"), effect("directional_occlusion")]);
    alone.choices.visibility = Visibility::Sh2;
    let wanted = Wanted::of(&alone).unwrap();
    assert!(wanted.light && wanted.order.bands() == 4);
    alone.choices.skin_reflection = SkinReflection::None;
    assert_eq!(Wanted::of(&alone), None);
    let lookups = bowl(gentle, by(SpecularVisibility::Lagarde, SkinReflection::Gathered));
    assert!(lookups.needs().fields.iter().all(|field| !field.name().starts_with("lobe_")));
}

#[test]
fn the_renderer_mirrors_the_skin_as_the_processor_does() {
    let Some(gpu) = gpu() else { return };
    // Without a lamp, whose shadows are interpolated from vertices there, and found at each sample here.
    let baked = head_with(&["fresnel", "directional_occlusion"].map(effect));
    let weight = Param::from_name("specular_weight").unwrap();
    let baked = baked.with_scene(|scene| scene.params.set(weight, 10.0));
    let want = on_cpu(&baked);
    let camera = baked.scene.views[0].camera;
    let got = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
    let black = on_cpu(&baked.with_scene(|scene| scene.choices.skin_reflection = SkinReflection::None));
    let shows = |&(i, rgb): &(usize, [f32; 3])| want.alpha[i] == 1.0 && rgb[0] > black.rgb[i][0] + 1e-3;
    let skin: Vec<(usize, [f32; 3])> = covered(&want).filter(shows).collect();
    let off = |&&(i, want): &&(usize, [f32; 3])| (0..3).any(|c| (got.rgb[i][c] - want[c]).abs() > 2e-4);
    let off = skin.iter().filter(off).count();
    // A fifth of what the skin brings at the least; at edges inside the image the rasteriser sees other triangles.
    assert!(skin.len() > 50 && 20 * off < skin.len(), "{off} of {}", skin.len());
}

#[test]
fn a_lamps_light_in_a_hollow_sphere_is_that_of_an_integrating_sphere() {
    let opening = 1.2_f64;
    let mut scene = bowl(|_, _| [0.0; 3], by(SpecularVisibility::Lobe, SkinReflection::Gathered));
    let direction = DVec3::NEG_Y;
    let beam = Beam { direction, irradiance: [PI, 0.5 * PI, 0.0], angular_diameter_degrees: 0.0 };
    scene.lights = vec![Light::new("down", LightKind::Directional(beam)).unwrap()];
    scene.effects = scene.effects.with(Effect::Lights).with(Effect::Shadows);
    scene.quality.occlusion_rays = 1024;
    let bakes = bakes(&scene);
    let posed = scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let field = Field::from_name("skin_seen").unwrap();
    let surface = PosedSurface::with_fields(&scene, &posed, &rays, &[], (&bakes).into(), Fields::of([field]));
    let seen = surface.unwrap().field_of_vertices(field);
    // From any place of a sphere all places count as their area: sin^2 / 4 of it would be lit squarely, and the wall
    // is its share of the sphere. Its light is that of the lamp and of one throw; the first of two throws is in it.
    let (lit, wall) = (0.25 * opening.sin().powi(2), 0.5 * (1.0 + opening.cos()));
    let thrown = lit * (1.0 + wall);
    // A vertex' own light counts for a hundredth of a hemisphere beside.
    let want = |own: f64| (thrown + 0.01 * own) / (wall + 0.01);
    let (mut sum, mut count) = (0.0, 0.0);
    for (vertex, position) in posed.positions.iter().enumerate() {
        let height = f64::from(position.normalize().y);
        let direct = if height < -0.45 { -height } else { 0.0 };
        let want = want(direct + lit);
        let got = [0, 1, 2].map(|c| f64::from(seen[3 * vertex + c]));
        if (height + opening.cos()).abs() < 0.15 || !(-0.99..0.3).contains(&height) {
            // At the shadow's edge, at the bottom, whose triangles are thinner than rounding, and at the rim.
            continue;
        }
        assert!((got[1] - 0.5 * got[0]).abs() < 1e-5 && got[2] == 0.0, "{got:?}");
        // 1024 rays a vertex, of which a sixth meet the light; facets.
        assert!((got[0] - want).abs() < 0.1 * want, "{height}: {got:?} {want}");
        sum += got[0] / want;
        count += 1.0;
    }
    // On average facets are left.
    assert!(count > 50.0 && (sum / count - 1.0).abs() < 0.03, "{} of {count}", sum / count);
}

#[test]
fn the_choice_is_read_and_refused_by_name() {
    let folder = SceneFolder::new();
    let (scene, _) = folder
        .edited("[model]\n", "[model]\nspecular_visibility = \"rays\"\nskin_reflection = \"none\"\n")
        .unwrap();
    let Choices { specular_visibility, skin_reflection, .. } = scene.choices;
    assert_eq!((specular_visibility, skin_reflection), (SpecularVisibility::Rays, SkinReflection::None));
    let error =
        folder.edited("[model]\n", "[model]\nskin_reflection = \"gather\"\n").unwrap_err().to_string();
    assert!(error.contains("Did you mean `gathered`?") && error.contains("line"), "{error}");
}

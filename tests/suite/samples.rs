//! Surface samples against the independent renderer's per-pixel positions, normals and UVs.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{Vec2, Vec3};
use skinfit::bake::VertexOcclusion;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::samples::{LANES, SurfaceBakes, TargetRows, ViewSamples, sample_views};
use skinfit::scene::Scene;
use skinfit::scene::maps::Map;
use skinfit::scene::mesh::PosedMesh;
use skinfit::scene::view::{Background, Clip, Target};

use crate::common;
use crate::fixtures::{Planes, bare_scene, camera, head, head_views, quantile, read_exr};

fn base(view: &ViewSamples, sample: usize) -> Vec3 {
    Vec3::from(view.surface.fragment(sample).base)
}

/// What `read` gives for the first sample of each pixel that the other renderer covers fully; and
/// how many of its pixels have none.
fn compare(view: &ViewSamples, aov: &Planes, read: impl Fn(usize, usize) -> f64) -> (Vec<f64>, usize) {
    let alpha = &aov.planes["A"];
    let mut errors = Vec::new();
    for group in 0..view.groups() {
        for lane in 0..LANES {
            let pixel = view.pixel[group * LANES + lane];
            if pixel != u32::MAX && alpha[pixel as usize] >= 0.9999 {
                errors.push(read(view.group_start[group] as usize * LANES + lane, pixel as usize));
            }
        }
    }
    let full = alpha.iter().filter(|&&a| a >= 0.9999).count();
    let missing = full - errors.len();
    (errors, missing)
}

fn report(what: &str, name: &str, errors: &[f64], unit: &str) -> (f64, f64) {
    let (median, most) = (quantile(errors, 0.5), quantile(errors, 0.99));
    println!("{name}: {what} error median {median:.2e}, 99% {most:.2e} {unit} ({} pixels)", errors.len());
    crate::figures::measured(&format!("samples {what} median"), median);
    crate::figures::measured(&format!("samples {what} most"), most);
    crate::figures::measured("samples pixels", errors.len() as f64);
    (median, most)
}

#[test]
fn the_scanned_head_lies_where_the_independent_renderer_sees_it() {
    let Some(data) = common::data() else { return };
    let mesh = head(&data);
    let mut scene = bare_scene(Effects::of(&[Effect::Diffuse]));
    // The listing hands interpolated normals through as they are: any vertex attribute can ride.
    scene.form = Form::Listing;
    scene.quality.samples_per_axis = 1;
    scene.views = head_views(&data);
    let position = PosedMesh { normals: mesh.positions.clone(), ..mesh.clone() };
    let uv = PosedMesh { normals: mesh.uvs.iter().map(|uv| uv.extend(0.0)).collect(), ..mesh.clone() };
    let positions = sample_views(&scene, &position, SurfaceBakes::default()).unwrap();
    let uvs = sample_views(&scene, &uv, SurfaceBakes::default()).unwrap();
    for ((view, positions), uvs) in scene.views.iter().zip(&positions).zip(&uvs) {
        let aov = read_exr(&data.join(format!("targets/aov_{}.exr", view.name)));
        let want = aov.rgb(["P.X", "P.Y", "P.Z"]);
        let (errors, missing) = compare(positions, &aov, |sample, pixel| {
            f64::from(base(positions, sample).distance(Vec3::from(want[pixel])))
        });
        let (median, most) = report("position", &view.name, &errors, "units");
        // The renderer's own f32 rays: a thousandth of a pixel of 0.018 units (1.2 to 1.5e-5 were found); the farthest
        // 1% lie where the surface is seen at a slant, up to five times that (3.8 to 7.3e-5).
        assert!(median < 2e-5 && most < 1e-4, "{}", view.name);
        assert!(missing <= 2, "{}: {missing} pixels that should be covered", view.name);

        let (u, v) = (&aov.planes["UV.U"], &aov.planes["UV.V"]);
        let (errors, _) = compare(uvs, &aov, |sample, pixel| {
            f64::from(base(uvs, sample).truncate().distance(Vec2::new(u[pixel], v[pixel])))
        });
        let (median, most) = report("UV", &view.name, &errors, "");
        // The file's UVs are filtered over a pixel, which is about 0.002 wide: what is left of that where the surface
        // is even is a hundredth of it (2.5 to 2.9e-5 were found), and beside seams and folds a pixel's whole width.
        assert!(median < 4e-5 && most < 4e-3, "{}", view.name);
    }
}

fn normal_map(data: &std::path::Path) -> Map<3> {
    let image = image::open(data.join("head/normal.jpg")).unwrap().to_rgb32f();
    let (width, height) = (image.width() as usize, image.height() as usize);
    Map { width, height, texels: image.pixels().map(|p| p.0).collect() }
}

#[test]
fn the_scanned_heads_shading_normals_agree_with_the_independent_renderer() {
    let Some(data) = common::data() else { return };
    let mesh = head(&data);
    let mut scene = bare_scene(Effects::of(&[Effect::Diffuse, Effect::NormalMap]));
    scene.quality.samples_per_axis = 1;
    scene.views = head_views(&data);
    let (mut medians, mut tails) = (Vec::new(), Vec::new());
    for map in [Some(normal_map(&data)), None] {
        scene.maps.normal = map;
        let samples = sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap();
        let what = if scene.maps.normal.is_some() { "normal" } else { "normal without map" };
        for (view, samples) in scene.views.iter().zip(&samples) {
            let aov = read_exr(&data.join(format!("targets/aov_{}.exr", view.name)));
            let want = aov.rgb(["N.X", "N.Y", "N.Z"]);
            let (errors, _) = compare(samples, &aov, |sample, pixel| {
                let f = samples.surface.fragment(sample);
                // Without a map there is no bump, which then reads as zero.
                let n = Vec3::from(f.base) + Vec3::from(f.bump);
                f64::from(n.normalize().angle_between(Vec3::from(want[pixel]).normalize())).to_degrees()
            });
            let (median, most) = report(what, &view.name, &errors, "degrees");
            medians.push(median);
            tails.push(most);
        }
    }
    for i in 0..3 {
        // The renderer filters its normals over 1.5 pixels and stores halves: 0.45 to 0.57 degrees were found, and 4.9
        // to 7.1 where the map is steepest; with the map upside down the median is 3.0.
        assert!(medians[i] < 0.7 && tails[i] < 8.0, "{medians:?} {tails:?}");
        assert!(medians[i] < 0.6 * medians[i + 3], "without the map it should be worse: {medians:?}");
    }
}

#[test]
fn coverage_is_that_of_the_independent_renderer_but_for_its_wider_filter() {
    let Some(data) = common::data() else { return };
    let mesh = head(&data);
    let mut scene = bare_scene(Effects::of(&[Effect::Diffuse]));
    scene.quality.samples_per_axis = 4;
    scene.views = head_views(&data);
    for (view, samples) in
        scene.views.iter().zip(sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap())
    {
        let aov = read_exr(&data.join(format!("targets/aov_{}.exr", view.name)));
        let alpha = &aov.planes["A"];
        let mut ours = vec![0.0_f32; alpha.len()];
        for (&pixel, &coverage) in samples.pixel.iter().zip(&samples.coverage) {
            if pixel != u32::MAX {
                ours[pixel as usize] = coverage;
            }
        }
        let sum = |of: &[f32]| of.iter().map(|&x| f64::from(x)).sum::<f64>();
        let edges: Vec<f64> = (alpha.iter().zip(&ours))
            .filter(|(a, o)| (0.001..0.999).contains(*a) || (0.001..0.999).contains(*o))
            .map(|(a, o)| f64::from((a - o).abs()))
            .collect();
        let area = sum(&ours) / sum(alpha) - 1.0;
        let mean = edges.iter().sum::<f64>() / edges.len() as f64;
        println!(
            "{}: area {area:+.1e}, mean |difference| at {} edge pixels {mean:.3}",
            view.name,
            edges.len()
        );
        crate::figures::measured("samples area", area.abs());
        crate::figures::measured("samples edges", mean);
        // Both estimate the same area. Each of some thousand edge pixels is off by up to 1/16 of itself, at random: of
        // 60,000 pixels that is 1/16 x 1000^(1/2), 3e-5 (4e-5 was found).
        assert!(area.abs() < 8e-5, "{}: {area}", view.name);
        // A box of one pixel against a bell of 1.5 pixels, whose coverage of a straight edge differs by 0.05 on average.
        assert!(mean < 0.06, "{}: {mean}", view.name);
    }
}

/// A wavy sheet that faces +Z, with a little of everything.
pub(crate) fn sheet() -> PosedMesh {
    let mut mesh = PosedMesh::default();
    for i in 0..21_u16 {
        for j in 0..21_u16 {
            let (x, y) = (f32::from(i) / 10.0 - 1.0, f32::from(j) / 10.0 - 1.0);
            mesh.positions.push(Vec3::new(x, y, 0.2 * (3.0 * x).sin()));
            let slope = 0.6 * (3.0 * x).cos();
            mesh.normals.push(Vec3::new(-slope, 0.0, 1.0).normalize());
            mesh.tangents.push(Vec3::new(1.0, 0.0, slope).normalize().extend(1.0));
            mesh.uvs.push(Vec2::new(0.5 * x + 0.5, 0.5 - 0.5 * y));
            if i < 20 && j < 20 {
                let at = |di: u16, dj: u16| u32::from((i + di) * 21 + j + dj);
                mesh.triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
                mesh.triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
            }
        }
    }
    mesh
}

pub(crate) fn sheet_scene(effects: Effects) -> Scene {
    let mut scene = bare_scene(effects);
    let rows = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.05, 0.0, 0.0, 1.0, -4.0, 0.0, 0.0, 0.0, 1.0];
    scene.views = vec![skinfit::scene::view::View {
        name: "front".to_owned(),
        camera: camera(rows, 40.0, 50),
        target: None,
        background: Background::None,
    }];
    scene
}

/// Which numbers are there.
fn present(view: &ViewSamples) -> [bool; 10] {
    let at = view.surface.places();
    let vectors = [at.base, at.bump, at.view, at.normal, at.albedo];
    let scalars = [at.occlusion, at.silhouette, at.dapple, at.specular, at.attenuator];
    let mut present = [false; 10];
    vectors.iter().chain(&scalars).zip(&mut present).for_each(|(place, flag)| *flag = place.is_some());
    present
}

#[test]
fn groups_stand_by_their_count_of_records_and_weights_sum_to_one() {
    let mut scene = sheet_scene(Effects::SURFACE);
    scene.quality.samples_per_axis = 3;
    scene.maps.normal = Some(Map { width: 1, height: 1, texels: vec![[0.4, 0.6, 0.9]] });
    let mesh = sheet();
    let occlusion = VertexOcclusion { base: vec![0.5; mesh.positions.len()], morphs: Vec::new() };
    let view =
        sample_views(&scene, &mesh, SurfaceBakes { occlusion: Some(&occlusion), ..SurfaceBakes::default() })
            .unwrap()
            .remove(0);
    let samples = view.records() * LANES;
    assert_eq!(view.pixel.len(), view.groups() * LANES);
    assert_eq!(view.surface.slots(), samples);
    assert_eq!(present(&view), [true, true, true, false, true, true, true, true, true, true]);
    // Four vectors, five numbers, and the weight.
    assert_eq!(view.surface.rows().stride(), 4 * 3 + 5 + 1);
    let records: Vec<u32> = view.group_start.windows(2).map(|w| w[1] - w[0]).collect();
    assert!(records.windows(2).all(|w| w[0] >= w[1]) && records[0] == 9);
    let mut seen = std::collections::HashSet::new();
    for group in 0..view.groups() {
        for lane in 0..LANES {
            let slot = group * LANES + lane;
            let weights: Vec<f32> = (view.group_start[group]..view.group_start[group + 1])
                .map(|record| view.surface.weight(record as usize * LANES + lane))
                .collect();
            let sum: f32 = weights.iter().sum();
            let filled = weights.iter().filter(|&&w| w > 0.0).count();
            if view.pixel[slot] == u32::MAX {
                assert_eq!((sum, view.coverage[slot]), (0.0, 0.0));
            } else {
                assert!(seen.insert(view.pixel[slot]));
                // Nine f32 additions.
                assert!((sum - 1.0).abs() < 1e-6);
                assert_eq!(filled as f32 / 9.0, view.coverage[slot]);
            }
        }
    }
    assert!(view.surface.rows().all().iter().all(|row| row.iter().all(|x| x.is_finite())));
    assert!((0..samples).all(|i| (view.surface.fragment(i).occlusion - 0.5).abs() < 1e-6));
}

#[test]
fn numbers_that_no_effect_asks_for_are_not_kept() {
    let mesh = sheet();
    let kept = |effects: &[Effect], silhouette: Silhouette| {
        let mut scene = sheet_scene(Effects::of(effects));
        scene.silhouette = silhouette;
        present(&sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap().remove(0))
    };
    use Effect as E;
    let fragment = Silhouette::Fragment;
    //                base  bump   view  normal albedo occl.  silh.  dapple spec.  att.
    let diffuse = [true, false, true, false, true, false, false, false, false, false];
    assert_eq!(kept(&[E::Diffuse], fragment), diffuse);
    let rim = [true, false, true, false, true, false, true, false, false, false];
    assert_eq!(kept(&[E::Diffuse, E::Rim], fragment), rim);
    assert_eq!(kept(&[E::Diffuse, E::Rim], Silhouette::Bumped), diffuse);
    let key = [true, false, true, true, true, false, false, false, false, false];
    assert_eq!(kept(&[E::KeyLight], fragment), key);
    let mirror = [true, false, true, false, false, false, false, true, false, false];
    assert_eq!(kept(&[E::Reflection], fragment), mirror);
}

#[test]
fn silhouettes_per_vertex_and_per_fragment_follow_their_definitions() {
    // A single quad that turns from facing to grazing: |N.V| is far from linear across it.
    let mut mesh = sheet();
    mesh.positions = vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .into_iter()
        .map(|[x, y]| Vec3::new(x, y, 0.0))
        .collect();
    let (left, right) = (Vec3::Z, Vec3::new(1.0, 0.0, 0.05).normalize());
    mesh.normals = vec![left, right, right, left];
    mesh.triangles = vec![[0, 1, 2], [0, 2, 3]];
    mesh.tangents.truncate(4);
    mesh.uvs.truncate(4);
    let effects = Effects::of(&[Effect::Diffuse, Effect::Rim, Effect::KeyLight]);
    for silhouette in [Silhouette::Vertex, Silhouette::Fragment] {
        let mut scene = sheet_scene(effects);
        scene.silhouette = silhouette;
        let view = sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap().remove(0);
        let (mut apart, eye) = (0.0_f32, scene.views[0].camera.eye().as_vec3());
        for i in 0..view.surface.slots() {
            let f = view.surface.fragment(i);
            let (normal, v) = (Vec3::from(f.normal), Vec3::from(f.view));
            apart = apart.max((1.0 - normal.dot(v).abs() - f.silhouette).abs());
            // The point is where the view ray meets the plane z = 0.
            let point = eye - v * (eye.z / v.z);
            let n = left.lerp(right, 0.5 * (point.x + 1.0)).normalize();
            // Rounding of f32 in a handful of operations.
            assert!(n.distance(normal) < 5e-6);
        }
        match silhouette {
            Silhouette::Fragment => assert!(apart < 1e-6, "{apart}"),
            _ => assert!(apart > 0.1, "{apart}"),
        }
    }
}

#[test]
fn hard_texels_and_normals_leave_a_base_that_is_a_direction() {
    let mut scene = sheet_scene(Effects::of(&[Effect::Diffuse, Effect::NormalMap]));
    let mut mesh = sheet();
    for texel in [[0.5, 0.5, 0.5], [f32::NAN, 0.5, 1.0], [1.0, 0.5, 0.5], [0.5, 0.5, 0.0], [0.5, 0.2, 0.4]] {
        scene.maps.normal = Some(Map { width: 1, height: 1, texels: vec![texel] });
        for zero_normals in [false, true] {
            if zero_normals {
                mesh.normals.fill(Vec3::ZERO);
            } else {
                mesh = sheet();
            }
            let s = sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap().remove(0).surface;
            for i in 0..s.slots() {
                let f = s.fragment(i);
                let (base, bump) = (Vec3::from(f.base), Vec3::from(f.bump));
                assert!(base.length() > 0.0 && base.is_finite() && bump.is_finite(), "{texel:?}");
                if texel[0].is_nan() || texel == [0.5; 3] {
                    assert_eq!(bump, Vec3::ZERO);
                }
                if zero_normals {
                    assert_eq!(base, -Vec3::from(f.view));
                }
            }
        }
    }
}

#[test]
fn samples_are_the_same_for_any_number_of_threads() {
    let mut scene = sheet_scene(Effects::SURFACE);
    scene.maps.normal = Some(Map { width: 1, height: 1, texels: vec![[0.4, 0.6, 0.9]] });
    let mesh = sheet();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        format!("{:?}", pool.install(|| sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap()))
    };
    let one = run(1);
    assert!((2..=4).all(|threads| run(threads) == one));
}

#[test]
fn padding_is_below_a_hundredth_of_the_samples() {
    let Some(data) = common::data() else { return };
    let mesh = head(&data);
    let mut scene = bare_scene(Effects::SURFACE);
    scene.views = head_views(&data);
    scene.maps.normal = Some(normal_map(&data));
    let views = sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap();
    let samples: usize = views.iter().map(ViewSamples::count).sum();
    let slots: usize = views.iter().map(|v| v.surface.slots()).sum();
    // Padding is confined to the groups between two counts.
    assert!(slots < samples + samples / 100);
}

#[test]
fn a_texel_of_the_listing_that_is_no_direction_is_the_smooth_normal() {
    let mut scene = sheet_scene(Effects::of(&[Effect::Diffuse, Effect::NormalMap]));
    scene.form = Form::Listing;
    scene.quality.samples_per_axis = 1;
    let mesh = sheet();
    let mut of = |texel: [f32; 3]| {
        scene.maps.normal = Some(Map { width: 1, height: 1, texels: vec![texel] });
        sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap().remove(0)
    };
    // (0, 0, 1) is N as printed.
    let smooth = of([0.0, 0.0, 1.0]);
    let (zero, nan) = (f32::from_bits(0), f32::NAN);
    for texel in [[zero; 3], [-0.0; 3], [0.5, nan, 1.0], [f32::INFINITY, 0.5, 1.0]] {
        let view = of(texel);
        for slot in (0..view.pixel.len()).filter(|&slot| view.pixel[slot] != u32::MAX) {
            let (got, want) = (view.surface.fragment(slot), smooth.surface.fragment(slot));
            assert_eq!((got.base, got.bump), (want.base, want.bump), "{texel:?}");
        }
    }
    // With x and y alone n is along them but for a trace of N, not along the view.
    let flat = of([1.0, 0.0, 0.0]);
    for slot in (0..flat.pixel.len()).filter(|&slot| flat.pixel[slot] != u32::MAX) {
        let f = flat.surface.fragment(slot);
        assert!(Vec3::from(f.base).length() < 2e-6 && Vec3::from(f.bump).length() > 0.9, "{f:?}");
    }
}

#[test]
fn a_target_with_haze_has_a_fourth_channel_over_its_coverage() {
    let (mut scene, samples) = with_target([0.2, 0.4, 0.8], Some(0.5), None);
    scene.views[0].target.as_mut().unwrap().haze = Some(vec![0.3; 2500]);
    let target = TargetRows::new(&scene.views[0], &samples).unwrap().unwrap();
    assert_eq!(target.channels.stride(), 4);
    for i in 0..samples.pixel.len() {
        let weight = target.weight[i / LANES][i % LANES];
        let want = if weight > 0.0 { 0.6 } else { 0.0 };
        assert_eq!(target.channels.number(3, i), want);
    }
    scene.views[0].target.as_mut().unwrap().haze = Some(vec![0.3; 2499]);
    assert!(TargetRows::new(&scene.views[0], &samples).unwrap_err().to_string().contains("2499"));
}

fn with_target(rgb: [f32; 3], alpha: Option<f32>, mask: Option<f32>) -> (Scene, ViewSamples) {
    let mut scene = sheet_scene(Effects::of(&[Effect::Diffuse]));
    let view = sample_views(&scene, &sheet(), SurfaceBakes::default()).unwrap().remove(0);
    scene.views[0].target = Some(Target {
        rgb: vec![rgb; 2500],
        alpha: alpha.map(|a| vec![a; 2500]),
        haze: None,
        mask: mask.map(|m| vec![m; 2500]),
        clipped_at: Some(Clip { low: 0.0, high: 1.0 }),
    });
    (scene, view)
}

#[test]
fn targets_are_divided_by_their_alpha_and_count_by_the_smaller_coverage() {
    let (scene, samples) = with_target([0.2, 0.4, 0.8], Some(0.5), Some(0.25));
    let target = TargetRows::new(&scene.views[0], &samples).unwrap().unwrap();
    assert_eq!(target.clip, Some(Clip { low: 0.0, high: 1.0 }));
    for (i, &coverage) in samples.coverage.iter().enumerate() {
        let want = if samples.pixel[i] == u32::MAX { 0.0 } else { 0.25 * coverage.min(0.5) };
        assert_eq!(target.weight[i / LANES][i % LANES], want);
        if want > 0.0 {
            assert_eq!([0, 1, 2].map(|c| target.channels.number(c, i)), [0.4, 0.8, 1.6]);
        }
    }
    // Without alpha only full pixels count.
    let (scene, samples) = with_target([0.2; 3], None, None);
    let target = TargetRows::new(&scene.views[0], &samples).unwrap().unwrap();
    let full = samples.coverage.iter().map(|&c| if c == 1.0 { 1.0 } else { 0.0 });
    assert!(target.weight.iter().flat_map(|row| row.iter()).copied().eq(full));
    assert!(samples.coverage.iter().any(|&c| c > 0.0 && c < 1.0), "the test needs edge pixels");
}

#[test]
fn what_cannot_be_sampled_or_compared_is_said() {
    for (alpha, mask) in [(Some(0.0), None), (None, Some(0.0)), (Some(f32::NAN), None)] {
        let (scene, samples) = with_target([0.2; 3], alpha, mask);
        let error = TargetRows::new(&scene.views[0], &samples).unwrap_err().to_string();
        assert!(error.contains("front") && error.contains("mask is empty"), "{error}");
    }
    let (mut scene, samples) = with_target([0.2; 3], None, None);
    scene.views[0].target.as_mut().unwrap().rgb.pop();
    assert!(TargetRows::new(&scene.views[0], &samples).unwrap_err().to_string().contains("2499"));

    let (mut scene, mut mesh) = (sheet_scene(Effects::of(&[Effect::Diffuse])), sheet());
    let wrong = VertexOcclusion { base: vec![1.0; 3], morphs: Vec::new() };
    assert!(
        sample_views(&scene, &mesh, SurfaceBakes { occlusion: Some(&wrong), ..SurfaceBakes::default() })
            .unwrap_err()
            .to_string()
            .contains("3 vertices")
    );
    mesh.uvs.clear();
    assert!(
        sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap_err().to_string().contains("TEXCOORD_0")
    );
    scene.views[0].camera.world_to_camera = glam::DMat4::from_translation(glam::DVec3::new(0.0, 0.0, 9.0));
    let error = sample_views(&scene, &sheet(), SurfaceBakes::default()).unwrap_err().to_string();
    assert!(error.contains("front") && error.contains("no pixel shows the mesh"), "{error}");
    assert!(
        sample_views(
            &scene,
            &PosedMesh { uvs: vec![Vec2::ZERO], ..Default::default() },
            SurfaceBakes::default()
        )
        .is_err()
    );
}

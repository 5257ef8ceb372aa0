//! Scene files and what they name: what is read, and as what.

use std::path::Path;

use image::{ImageFormat, Rgb, Rgba, RgbaImage};
use serde_json::{Value, json};
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{Effect, Effects, Form, Lookups, Silhouette};
use skinfit::model::params::{Column, Param};
use skinfit::render::backdrop::Backdrop;
use skinfit::scene::maps::{Environment, Map, Spots};
use skinfit::scene::view::Background;
use skinfit::scene::{LoadOptions, Loss, Scene};

use super::common;
use super::fixtures::{bare_scene, camera};
use super::scene_folder::{SCENE, SceneFolder, base64, encode, exr, glb, png, quad, quad_parts, tampered};

#[test]
fn the_small_scene_is_read_as_it_stands() {
    let scene_folder = SceneFolder::new();
    let (scene, warnings) = scene_folder.load().unwrap();
    assert_eq!(warnings, []);
    assert_eq!((scene.form, scene.silhouette), (Form::Corrected, Silhouette::Fragment));
    assert_eq!(scene.effects, Effects::SURFACE);
    assert_eq!(scene.fit.loss, Loss::RelativeL2);
    assert_eq!(scene.fit.free.len(), 7);
    assert_eq!((scene.mesh.triangles.len(), scene.mesh.tangents.len()), (2, 4));
    // u runs along +X and green up along +Y: a right-handed frame.
    assert_eq!(scene.mesh.tangents[0].to_array(), [1.0, 0.0, 0.0, 1.0]);
    let color = scene.maps.color.unwrap().texels[0];
    // sRGB 200 and 100 of 255, by the standard's formula in double precision.
    assert!((color[0] - 0.577_580_4).abs() < 1e-6 && (color[1] - 0.127_437_68).abs() < 1e-6, "{color:?}");
    assert_eq!(scene.maps.normal.unwrap().texels[0][1], (64.0_f64 / 255.0) as f32);
    assert_eq!(scene.maps.specular.unwrap().texels[0], [0.2]);
    let target = scene.views[0].target.as_ref().unwrap();
    assert_eq!((target.rgb[3], target.clipped_at), ([0.25; 3], None));
    assert_eq!(target.alpha.as_ref().unwrap()[3], 0.25);
}

#[test]
fn keys_of_a_scene_do_what_they_say() {
    let scene_folder = SceneFolder::new();
    let edit = |from: &str, to: &str| scene_folder.edited(from, to).unwrap().0;
    let flipped = edit("[maps]", "[maps]\nnormal_y = \"down\"").maps.normal.unwrap();
    assert_eq!(flipped.texels[0][1], 1.0 - (64.0_f64 / 255.0) as f32);
    let listing = edit("[model]", "[model]\nform = \"listing\"");
    assert_eq!((listing.form, listing.silhouette), (Form::Listing, Silhouette::Vertex));
    assert_eq!(listing.params.scalar(Param::BaseWeight), 0.0);
    assert_eq!(listing.lookups, Lookups::Bumped);
    assert_eq!(edit("[model]", "[model]\nlookups = \"smooth\"").lookups, Lookups::Smooth);
    let triple = edit("[model.params]", "[model.params]\nhilite = [0.1, 0.2, 0.3]\n");
    assert_eq!(triple.params.rgb(Param::Hilite), [0.1, 0.2, 0.3]);
    assert!(triple.fit.free.contains(&Column::per_channel(Param::Hilite)[2]));
    let free = edit(
        "[fit]",
        "[fit]\nfree = [\"base_weight\", \"hilite\"]\nper_channel = [\"base_weight\"]\ngains = true\nloss = \"huber\"",
    );
    assert_eq!((free.fit.free.len(), free.fit.free_gains, free.fit.loss), (4, true, Loss::Huber));
    assert!(!free.fit.white_balance && edit("[fit]", "[fit]\nwhite_balance = true").fit.white_balance);
    assert_eq!(edit("[quality]", "[quality]\nsamples_per_axis = 3").quality.samples_per_axis, 3);
    let masked = edit("[fit]", "mask = \"mask.png\"\n[fit]");
    assert_eq!(masked.views[0].target.as_ref().unwrap().mask.as_ref().unwrap()[0], 1.0);
}

#[test]
fn the_dapple_is_the_third_row_of_its_matrix_and_turns_with_the_environment() {
    let scene_folder = SceneFolder::new();
    let dapple =
        |keys: &str| scene_folder.edited("\"env.exr\"", &format!("\"env.exr\"\n{keys}")).unwrap().0.dapple;
    assert_eq!(dapple(""), Dapple::default());
    // Axes to axes: the third row is +Y, then +X, which a quarter turn takes to -Z.
    let up = dapple("dapple = [1,0,0, 0,0,-1, 0,1,0]");
    assert_eq!(up.axis(), [0.0, 1.0, 0.0]);
    assert_eq!(dapple("dapple = [1,0,0,0, 0,0,-1,0, 0,1,0,0, 0,0,0,1]"), up);
    assert_eq!(dapple("rotation_degrees = 90\ndapple = [1,0,0, 0,0,-1, 0,1,0]").axis(), up.axis());
    let aside = "dapple = [0,0,-1, 0,1,0, 1,0,0]";
    assert_eq!(dapple(aside).axis(), [1.0, 0.0, 0.0]);
    for (keys, want) in [
        (format!("rotation_degrees = 90\n{aside}"), [0.0, 0.0, -1.0]),
        // One that is not given stands in the world; the identity that is given turns.
        ("rotation_degrees = 90".to_owned(), [0.0, 0.0, 1.0]),
        ("rotation_degrees = 180\ndapple = [1,0,0, 0,1,0, 0,0,1]".to_owned(), [0.0, 0.0, -1.0]),
    ] {
        let axis = dapple(&keys).axis();
        // A rounding of pi in f64.
        assert!(axis.iter().zip(want).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-15), "{keys}: {axis:?}");
    }
    // A file's few digits are made a unit vector.
    let rounded = dapple("dapple = [1,0,0, 0,0.8,-0.6004, 0,0.6,0.8]").axis();
    assert_eq!(rounded, [0.0, 0.6, 0.8]);
    // Samples hold a normal where the turn is fitted, and S.w where it is not.
    for (key, free, turns) in [
        (format!("\n{aside}"), "environment_rotation", true),
        (format!("\n{aside}"), "hilite", false),
        (String::new(), "environment_rotation", false),
    ] {
        let text = SCENE.replacen("\"env.exr\"", &format!("\"env.exr\"{key}"), 1);
        let text = text.replacen("[fit]", &format!("[fit]\nfree = [\"{free}\"]"), 1);
        scene_folder.write("scene.toml", text.as_bytes());
        let (scene, _) = scene_folder.load().unwrap();
        assert_eq!(scene.setup().dapple.turns(), turns, "{key} {free}");
    }
}

#[test]
fn a_specular_visibility_that_no_effect_finds_is_told() {
    let scene_folder = SceneFolder::new();
    let told = |visibility: &str, effects: &str| {
        let keys = format!("[model]\nspecular_visibility = \"{visibility}\"\neffects = [{effects}]");
        let (_, warnings) = scene_folder.edited("[model]", &keys).unwrap();
        let words = warnings.iter().map(ToString::to_string);
        words.filter(|words| words.contains("Add \"occlusion\" to the effects")).count()
    };
    let (without, with) = ("\"diffuse\", \"fresnel\"", "\"diffuse\", \"fresnel\", \"occlusion\"");
    for (visibility, of_share) in [("none", 0), ("lagarde", 1), ("cone", 1), ("lobe", 0), ("rays", 0)] {
        assert_eq!(told(visibility, without), of_share, "{visibility}");
        assert_eq!(told(visibility, with), 0, "{visibility}");
    }
}

#[test]
fn a_normal_map_that_nothing_sees_is_not_read_and_a_warning_says_so() {
    let scene_folder = SceneFolder::new();
    let smooth = "[model]\nlookups = \"smooth\"";
    let (scene, warnings) = scene_folder.edited("[model]", smooth).unwrap();
    assert!(scene.maps.normal.is_none() && scene.mesh.tangents.is_empty());
    assert!(!scene.setup().smooth_lookups(), "n is the smooth normal, and that is all");
    let said: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(said.len() == 1 && said[0].contains("`normal_map` does nothing without `key_light`"), "{said:?}");
    for keys in [
        "effects = [\"diffuse\", \"normal_map\", \"key_light\"]",
        "effects = [\"normal_map\", \"key_light\"]",
        "silhouette = \"bumped\"",
    ] {
        let (scene, warnings) = scene_folder.edited("[model]", &format!("{smooth}\n{keys}")).unwrap();
        assert!(scene.maps.normal.is_some() && warnings.is_empty(), "{keys}: {warnings:?}");
        assert!(scene.setup().smooth_lookups(), "{keys}");
    }
    let (listing, _) = scene_folder.edited("[model]", "[model]\nform = \"listing\"").unwrap();
    assert!(listing.setup().interpolated_rim && listing.setup().rim_of_corners());
    let fragment = "[model]\nform = \"listing\"\nsilhouette = \"fragment\"";
    let (listing, _) = scene_folder.edited("[model]", fragment).unwrap();
    assert!(!listing.setup().rim_of_corners());
}

#[test]
fn what_is_free_by_default_may_have_a_value_a_channel_without_a_list_of_what_is_free() {
    let scene_folder = SceneFolder::new();
    // As README.md has it.
    let fit =
        |line: &str| scene_folder.edited("[fit]", &format!("[fit]\n{line}")).map(|(scene, _)| scene.fit.free);
    let default = fit("").unwrap();
    let free = fit("per_channel = [\"hilite\"]").unwrap();
    for column in Column::per_channel(Param::Hilite) {
        assert!(free.contains(&column), "{free:?}");
    }
    assert!(!free.contains(&Column::tied(Param::Hilite)));
    assert_eq!(free.len(), default.len() + 2, "all else is as without it");
    // All that is coloured of the default, at once.
    let coloured: Vec<&str> =
        default.iter().map(|column| column.param).filter(|p| p.info().rgb).map(Param::name).collect();
    let free = fit(&format!("per_channel = {coloured:?}")).unwrap();
    assert_eq!(free.len(), default.len() + 2 * coloured.len());
    // Not free by default, and no list makes it so.
    let refused = fit("per_channel = [\"key_color\"]").unwrap_err().to_string();
    assert!(refused.contains("not free") && refused.contains("these are fitted: base_weight,"), "{refused}");
    let refused = fit("per_channel = [\"hilite\", \"hilite\"]").unwrap_err().to_string();
    assert!(refused.contains("listed twice in per_channel"), "{refused}");
}

#[test]
fn a_scene_with_a_value_a_channel_is_one_with_any_of_its_effects_left_out() {
    let scene_folder = SceneFolder::new();
    let fit = "[fit]\nper_channel = [\"base_weight\", \"rim_weight\", \"hilite\", \"reflection\", \"side_specular\"]";
    scene_folder.edited("[fit]", fit).unwrap();
    let path = scene_folder.path("scene.toml");
    for effect in Effects::SURFACE.iter() {
        let effects = Some(Effects::SURFACE.without(effect));
        let (scene, _) = Scene::load(&path, &LoadOptions { effects, ..LoadOptions::default() })
            .unwrap_or_else(|error| panic!("without {}: {error}", effect.name()));
        assert!(scene.fit.free.iter().all(|column| column.param.asked_for(scene.effects)));
    }
}

#[test]
fn only_what_the_effects_ask_for_is_read() {
    let scene_folder = SceneFolder::new();
    for name in ["color.png", "normal.png", "data.png", "target.exr"] {
        scene_folder.write(name, b"nothing that could be read");
    }
    let options = LoadOptions {
        effects: Some(Effects::of(&[Effect::Reflection])),
        targets: false,
        ..LoadOptions::default()
    };
    let (scene, _) = Scene::load(&scene_folder.path("scene.toml"), &options).unwrap();
    assert!(scene.mesh.uvs.is_empty() && scene.mesh.tangents.is_empty() && scene.views[0].target.is_none());
    std::fs::remove_file(scene_folder.path("env.exr")).unwrap();
    let key_light = Some(Effects::of(&[Effect::KeyLight]));
    let options = LoadOptions { effects: key_light, targets: false, ..LoadOptions::default() };
    scene_folder.write("color.png", &png(1, 1, [1, 2, 3]));
    assert!(Scene::load(&scene_folder.path("scene.toml"), &options).unwrap().0.environment.is_none());
}

#[test]
fn the_normal_maps_alpha_is_the_specular_map_where_the_scene_names_none() {
    let scene_folder = SceneFolder::new();
    let packed = |alpha: [u8; 2]| {
        let pixel = |x: u32, _| Rgba([128, 64, 255, alpha[x as usize % 2]]);
        scene_folder.write("normal.png", &encode(RgbaImage::from_fn(4, 4, pixel), ImageFormat::Png));
    };
    packed([51, 102]);
    let (scene, warnings) = scene_folder.edited("specular = \"data.png\"\n", "").unwrap();
    assert_eq!(scene.maps.specular.as_ref().unwrap().texels[..2], [[0.2], [0.4]]);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    let words = warning.to_string();
    assert!(
        ["normal.png", "0.200 to 0.400", "specular map"].iter().all(|word| words.contains(word)),
        "{words}"
    );
    // A map of its own counts, and without a word.
    let (scene, warnings) = scene_folder.edited("[fit]", "[fit]").unwrap();
    assert_eq!((scene.maps.specular.unwrap().texels[1], warnings.len()), ([0.2], 0));
    // Nothing looks at it.
    let no_specular = "[model]\neffects = [\"diffuse\", \"normal_map\"]";
    scene_folder.write(
        "scene.toml",
        SCENE
            .replace("specular = \"data.png\"\n", "")
            .replace("[model]\n", &format!("{no_specular}\n"))
            .as_bytes(),
    );
    let (scene, warnings) = scene_folder.load().unwrap();
    assert!(scene.maps.specular.is_none() && warnings.is_empty(), "{warnings:?}");
    // Side-specular without the bumps still reads it.
    let no_bumps = "[model]\neffects = [\"diffuse\", \"side_specular\"]";
    scene_folder.write(
        "scene.toml",
        SCENE
            .replace("specular = \"data.png\"\n", "")
            .replace("[model]\n", &format!("{no_bumps}\n"))
            .as_bytes(),
    );
    let scene = scene_folder.load().unwrap().0;
    assert!(scene.maps.specular.is_some() && scene.maps.normal.is_none() && !scene.mesh.uvs.is_empty());
    // Alpha that is only there.
    packed([255, 255]);
    let (scene, warnings) = scene_folder.edited("specular = \"data.png\"\n", "").unwrap();
    assert!(scene.maps.specular.is_none() && warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_views_haze_is_read_from_its_channel_or_from_a_grey_image() {
    let scene_folder = SceneFolder::new();
    let hazy = "[model]\neffects = [\"diffuse\", \"reflection\", \"haze\"]";
    let scene = SCENE.replace("[model]\n", &format!("{hazy}\n"));
    let named = |key: &str| scene.replace("[fit]", &format!("{key}\n[fit]"));
    let read = |text: &str| {
        scene_folder.write("scene.toml", text.as_bytes());
        let (scene, warnings) = scene_folder.load().unwrap();
        (scene.views[0].target.clone().unwrap().haze, warnings)
    };
    scene_folder.write("haze.exr", &exr(4, 4, &["R", "G", "B", "A", "haze.Y"], |c, i| (10 * c + i) as f32));
    assert_eq!(read(&named("haze = \"haze.exr\"")).0.unwrap()[3], 43.0);
    scene_folder.write("haze.exr", &exr(4, 4, &["Y"], |_, i| -(i as f32)));
    assert_eq!(read(&named("haze = \"haze.exr\"")), (Some((0..16).map(|i| -(i as f32)).collect()), vec![]));
    // Named, but nothing makes one: not read, with a word.
    let (haze, warnings) = read(&SCENE.replace("[fit]", "haze = \"no_such.exr\"\n[fit]"));
    assert!(haze.is_none() && warnings[0].to_string().contains("neither `haze` nor `bloom`"), "{warnings:?}");
    // Free, but nothing tells of it.
    let (_, warnings) = read(&scene.replace("[fit]", "[fit]\nfree = [\"haze_weight\"]"));
    assert!(warnings[0].to_string().contains("haze_weight is free, but no view"), "{warnings:?}");
}

#[test]
fn backgrounds_and_bloom_are_read_and_the_environment_only_for_pictures() {
    let scene_folder = SceneFolder::new();
    let edit = |from: &str, to: &str| scene_folder.edited(from, to).unwrap().0;
    let plain = edit("[fit]", "[fit]");
    assert_eq!((plain.views[0].background, plain.bloom.sigma), (Background::None, 0.02));
    assert_eq!(edit("[fit]", "[bloom]\nsigma = 0.1\n[fit]").bloom.sigma, 0.1);
    let atlas = edit("[fit]", "[diffusion]\nlight_map_size = 1024\n[fit]").diffusion;
    assert_eq!((plain.diffusion.light_map_size, atlas.light_map_size), (512, 1024));
    assert_eq!(
        edit("[fit]", "background = [1, 0.5, 0]\n[fit]").views[0].background,
        Background::Color([1.0, 0.5, 0.0])
    );
    let shown = edit("[fit]", "background = \"environment\"\n[fit]");
    assert_eq!(shown.views[0].background, Background::Environment);
    let load = |targets: bool, background: Option<Background>| {
        let effects = Some(Effects::of(&[Effect::KeyLight]));
        let options = LoadOptions { effects, targets, background, ..LoadOptions::default() };
        Scene::load(&scene_folder.path("scene.toml"), &options).unwrap().0
    };
    // No effect asks for it: a picture does, a fit does not.
    assert!(load(false, None).environment.is_some());
    assert!(load(true, None).environment.is_none());
    let none = load(false, Some(Background::None));
    assert!(none.environment.is_none() && none.views[0].background == Background::None);
}

#[test]
fn the_camera_sees_the_environment_turned_by_both_rotations() {
    // Bright where -Z is, the panorama's middle, and nowhere else.
    let bright = |i: usize| if (14..18).contains(&(i % 32)) { [5.0, 1.0, 0.0] } else { [0.0; 3] };
    let panorama = Map { width: 32, height: 16, texels: (0..32 * 16).map(bright).collect() };
    let mut scene = bare_scene(Effects::of(&[Effect::Bloom]));
    scene.environment =
        Some(Environment { panorama, rotation_degrees: 0.0, intensity: 2.0, spots: Spots::default() });
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let camera = camera(identity, 60.0, 8);
    let middle = |scene: &Scene, turn: f64| {
        let mut params = scene.params.clone();
        params.set(Param::EnvironmentRotation, turn);
        params.set(Param::HazeWeight, 0.125);
        let backdrop = Backdrop::new(scene, &params, Background::Environment, &camera, 2).unwrap();
        (backdrop.rgb[4 * 8 + 4], backdrop.glow[4 * 8 + 4])
    };
    let (rgb, glow) = middle(&scene, 0.0);
    assert_eq!(rgb, [10.0, 2.0, 0.0]);
    // 0.125 (0.2126 10 + 0.7152 2) = 0.44455, of which the mean over four equal samples is the same.
    assert!((glow[0] - 4.4455).abs() < 1e-5 && (glow[1] - 0.8891).abs() < 1e-5, "{glow:?}");
    assert_eq!(middle(&scene, 90.0).0, [0.0; 3]);
    scene.environment.as_mut().unwrap().rotation_degrees = -90.0;
    assert_eq!(middle(&scene, 90.0).0, [10.0, 2.0, 0.0]);
    let flat = |background| Backdrop::new(&scene, &scene.params, background, &camera, 1);
    assert_eq!(flat(Background::None), None);
    // With a weight of 1, all of what is brighter than 1 glows, and no more.
    assert_eq!(flat(Background::Color([1.0, 2.0, 3.0])).unwrap().glow, vec![[1.0, 2.0, 3.0]; 64]);
}

#[test]
fn eight_bit_targets_are_decoded_premultiplied_and_known_to_clip() {
    let scene_folder = SceneFolder::new();
    scene_folder
        .write("target.exr", &encode(RgbaImage::from_pixel(4, 4, Rgba([255, 10, 0, 51])), ImageFormat::Png));
    let (scene, _) = scene_folder.load().unwrap();
    let target = scene.views[0].target.as_ref().unwrap();
    assert_eq!((target.rgb[0][0], target.alpha.as_ref().unwrap()[0]), (0.2, 0.2));
    let clip = target.clipped_at.unwrap();
    // Half a code on the linear toe; and half a code below white, where the slope is 2.4 / 1.055.
    assert!((clip.low - 0.5 / 255.0 / 12.92).abs() < 1e-9);
    assert!((clip.high - (1.0 - 2.4 / 1.055 * 0.5 / 255.0)).abs() < 2e-5, "{}", clip.high);
}

#[test]
fn a_views_response_says_how_much_light_a_code_is() {
    let scene_folder = SceneFolder::new();
    let codes = RgbaImage::from_pixel(4, 4, Rgba([255, 51, 0, 255]));
    scene_folder.write("target.exr", &encode(codes, ImageFormat::Png));
    scene_folder.write("response.csv", b"0,0,0\n2,1,0\n4,8,2\n");
    let target = |response: &str| {
        let (scene, warnings) =
            scene_folder.edited("[fit]", &format!("response = {response}\n[fit]")).unwrap();
        assert_eq!(warnings, []);
        scene.views[0].target.clone().unwrap()
    };
    let linear = target("1");
    assert_eq!((linear.rgb[0], linear.clipped_at.unwrap().low), ([1.0, 0.2, 0.0], (0.5 / 255.0) as f32));
    assert_eq!(target("2.0").rgb[0], [1.0, (0.2_f64 * 0.2) as f32, 0.0]);
    // Green between the first two of three rows. Red ends at less light than the clip, which is the brightest channel's:
    // of a clipped red nothing is known.
    let table = target("\"response.csv\"");
    assert_eq!((table.rgb[0], table.mask.unwrap()[0]), ([4.0, 0.4, 0.0], 0.0));
    assert_eq!((linear.mask, table.clipped_at.unwrap().low), (None, 0.0));
    // A black that is not dark, in two channels more so than in the third.
    scene_folder.write("response.csv", b"1,1,0.1\n2,2,2\n");
    scene_folder.write(
        "target.exr",
        &encode(
            RgbaImage::from_fn(4, 4, |x, _| Rgba([100, 100, if x == 0 { 0 } else { 100 }, 255])),
            ImageFormat::Png,
        ),
    );
    assert_eq!(target("\"response.csv\"").mask, None);
    scene_folder.write(
        "target.exr",
        &encode(
            RgbaImage::from_fn(4, 4, |x, _| Rgba([if x == 0 { 0 } else { 100 }, 100, 100, 255])),
            ImageFormat::Png,
        ),
    );
    assert_eq!(target("\"response.csv\"").mask.unwrap()[..2], [0.0, 1.0]);
}

#[test]
fn layers_crops_and_grey_images_are_found() {
    let scene_folder = SceneFolder::new();
    scene_folder
        .write("env.exr", &exr(8, 4, &["depth.Z", "beauty.R", "beauty.G", "beauty.B"], |c, _| c as f32));
    assert_eq!(scene_folder.load().unwrap().0.environment.unwrap().panorama.texels[0], [1.0, 2.0, 3.0]);
    scene_folder.write("env.exr", &exr(8, 4, &["Y"], |_, i| i as f32));
    assert_eq!(scene_folder.load().unwrap().0.environment.unwrap().panorama.texels[9], [9.0; 3]);
    let hdr =
        image::DynamicImage::ImageRgb32F(image::ImageBuffer::from_pixel(8, 4, Rgb([65504.0, 1.0, 0.5])));
    scene_folder.write("env.exr", &encode(hdr, ImageFormat::Hdr));
    let texel = scene_folder.load().unwrap().0.environment.unwrap().panorama.texels[0];
    // RGBE keeps 8 bits of the largest channel: 1/256 of it at most.
    assert!((texel[0] - 65504.0).abs() <= 256.0, "{texel:?}");
    let deep = image::DynamicImage::ImageLuma16(image::ImageBuffer::from_pixel(4, 4, image::Luma([13107])));
    scene_folder.write("data.png", &encode(deep, ImageFormat::Png));
    assert_eq!(scene_folder.load().unwrap().0.maps.specular.unwrap().texels[0], [0.2]);
}

#[test]
fn dwab_panoramas_decode_to_what_another_program_made_of_them() {
    let Some(data) = common::data() else { return };
    let scene_folder = SceneFolder::new();
    let read = |file: &Path| {
        let (scene, warnings) = scene_folder.edited("\"env.exr\"", &format!("{file:?}")).unwrap();
        (scene.environment.unwrap().panorama, warnings)
    };
    let (fine, _) = read(&data.join("env/source_dwab/studio_blender_dwab_f32.exr"));
    let (half, _) = read(&data.join("env/studio.exr"));
    assert_eq!((fine.width, fine.height), (2 * half.width, 2 * half.height));
    for (i, want) in half.texels.iter().enumerate() {
        let (x, y) = (2 * (i % half.width), 2 * (i / half.width));
        for c in 0..3 {
            let at = |dx: usize, dy: usize| f64::from(fine.texels[(y + dy) * fine.width + x + dx][c]);
            let mean = (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4.0;
            // The copy was rounded to half floats (2^-11), and clamped at 0 after its mean.
            let bound = 5e-4 * mean.abs() + 2e-3;
            assert!((mean - f64::from(want[c])).abs() <= bound, "texel {i} channel {c}: {mean} {}", want[c]);
        }
    }
    let (sunset, warnings) = read(&data.join("env/source_dwab/sunset_pmndrs_dwab_f16.exr"));
    assert!(sunset.texels.iter().flatten().all(|&v| v >= 0.0));
    assert!(warnings.iter().any(|w| w.message.contains("negative radiance")), "{warnings:?}");
}

#[test]
fn the_real_scenes_load_without_a_warning() {
    let Some(data) = common::data() else { return };
    for name in ["lps_forest", "lps_sunrise"] {
        let start = std::time::Instant::now();
        let (scene, warnings) =
            Scene::load(&data.join(name).join("scene.toml"), &LoadOptions::default()).unwrap();
        println!("{name}: {:?}, {} vertices", start.elapsed(), scene.mesh.positions.len());
        assert_eq!(warnings, []);
        assert_eq!((scene.views.len(), scene.mesh.triangles.len(), scene.fit.free.len()), (3, 17684, 9));
        let (mut along, mut corners) = (0, 0);
        for triangle in &scene.mesh.triangles {
            let [a, b, c] = triangle.map(|v| scene.mesh.uvs[v as usize]);
            let det = (b - a).perp_dot(c - a);
            if det == 0.0 {
                continue;
            }
            let [p, q, r] = triangle.map(|v| scene.mesh.positions[v as usize]);
            let by_u = ((q - p) * (c - a).y - (r - p) * (b - a).y) / det;
            for tangent in triangle.map(|v| scene.mesh.tangents[v as usize]) {
                // v runs down the image, so an image seen unmirrored from outside has det < 0.
                assert_eq!(tangent.w, -det.signum());
                corners += 1;
                along += usize::from(tangent.truncate().dot(by_u) > 0.0);
            }
        }
        // Corners are averaged over a smooth group, so a few of them lean the other way.
        assert!(along as f64 > 0.999 * f64::from(corners), "{along} of {corners}");
    }
}

#[test]
fn strips_fans_sparse_and_quantised_accessors_and_mirrored_nodes_are_read() {
    let scene_folder = SceneFolder::new();
    let mesh = |bytes: &[u8]| {
        scene_folder.write("quad.glb", bytes);
        let (scene, warnings) = scene_folder.load().unwrap();
        assert_eq!(warnings, []);
        scene.mesh
    };
    let plain = mesh(&quad());
    let order = |json: &mut Value, mode: u32| {
        json["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        json["accessors"][5]["count"] = json!(4);
    };
    let put = |bin: &mut Vec<u8>, indices: [u16; 4]| {
        for (i, index) in indices.into_iter().enumerate() {
            bin[240 + 2 * i..242 + 2 * i].copy_from_slice(&index.to_le_bytes());
        }
    };
    let facing = |mesh: &skinfit::scene::mesh::Mesh| {
        mesh.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            (b - a).cross(c - a).z > 0.0
        })
    };
    let strip = mesh(&tampered(|json, bin| {
        order(json, 5);
        put(bin, [0, 1, 3, 2]);
    }));
    let fan = mesh(&tampered(|json, bin| {
        order(json, 6);
        put(bin, [0, 1, 2, 3]);
    }));
    for mesh in [&strip, &fan] {
        assert!(mesh.triangles.len() == 2 && facing(mesh), "{:?}", mesh.triangles);
        assert_eq!(mesh.positions, plain.positions);
    }
    let sparse = mesh(&tampered(|json, bin| {
        bin[252..254].copy_from_slice(&2_u16.to_le_bytes());
        json["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": {"bufferView": 6, "componentType": 5123},
            "values": {"bufferView": 4},
        });
    }));
    assert_eq!(sparse.positions[2].to_array(), [0.0, 0.0, 1.0]);
    assert_eq!(sparse.positions[1], plain.positions[1]);
    let quantised = mesh(&tampered(|json, bin| {
        json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        json["accessors"][2] =
            json!({"bufferView": 6, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC2"});
        json["bufferViews"][6]["byteStride"] = json!(4);
        bin[252..268].copy_from_slice(&[0, 255, 0, 0, 255, 255, 0, 0, 255, 0, 0, 0, 0, 0, 0, 0]);
    }));
    assert_eq!(quantised.uvs, plain.uvs);
    let mirrored = mesh(&tampered(|json, _| json["nodes"][0]["scale"] = json!([-1, 1, 1])));
    assert!(facing(&mirrored) && mirrored.normals == plain.normals);
    assert_eq!(mirrored.tangents[0].to_array(), [-1.0, 0.0, 0.0, -1.0]);
    // Half of the quad's v mirrored at a shared vertex: it is split, so that each side has its frame.
    let bare = mesh(&tampered(|json, _| {
        json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    }));
    assert_eq!(bare.normals, plain.normals);
    let seam = mesh(&tampered(|_, bin| bin[120..124].copy_from_slice(&2_f32.to_le_bytes())));
    println!("{:?} {:?}", seam.tangents, seam.triangles);
    assert!(seam.positions.len() == seam.tangents.len() && seam.positions.len() == seam.uvs.len());
}

#[test]
fn gltf_with_data_uris_and_files_beside_it_reads_as_the_glb_does() {
    let scene_folder = SceneFolder::new();
    let want = scene_folder.load().unwrap().0.mesh;
    let (mut json, bin) = quad_parts();
    scene_folder.write("a b.bin", &bin);
    for uri in ["a%20b.bin".to_owned(), format!("data:application/octet-stream;base64,{}", base64(&bin))] {
        json["buffers"][0]["uri"] = json!(uri);
        scene_folder.write("quad.glb", json.to_string().as_bytes());
        assert_eq!(scene_folder.load().unwrap().0.mesh, want, "{uri}");
    }
}

#[test]
fn the_atlas_is_of_the_texture_coordinates_that_the_scene_names() {
    let folder = SceneFolder::new();
    let (mut json, bin) = quad_parts();
    let first = json["accessors"].as_array().unwrap().len();
    // The quad's corners in x and y are no places in an atlas, but other numbers.
    let corners = json!({"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC2"});
    json["accessors"].as_array_mut().unwrap().push(corners);
    let attributes = &mut json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"].take();
    attributes["TEXCOORD_0"] = json!(first);
    folder.write("quad.glb", &glb(&json, &bin));
    let scene = |maps: &str, set: &str| {
        let start = SCENE.find("[maps]").unwrap();
        let end = SCENE.find("[environment]").unwrap();
        let text = format!("{}{maps}{}", &SCENE[..start], &SCENE[end..]);
        let text = text.replace("[model]\n", "[model]\neffects = [\"diffuse\", \"diffusion\"]\n");
        folder.write("scene.toml", format!("{text}[diffusion]\n{set}\n").as_bytes());
        folder.load()
    };
    let uvs = |set: &str| scene("", set).unwrap().0.mesh.uvs[1].to_array();
    assert_eq!(uvs("uv_set = 1"), [1.0, 1.0]);
    assert_eq!(uvs("uv_set = 0"), [0.0, 1.0]);
    assert_eq!(uvs(""), [0.0, 1.0]);
    // Beside maps the mesh has both sets, where they are two.
    let maps = "[maps]\ncolor = \"color.png\"\n";
    for one in ["", "uv_set = 0"] {
        assert!(scene(maps, one).unwrap().0.mesh.own_atlas_uvs.is_empty());
    }
    let mesh = scene(maps, "uv_set = 1").unwrap().0.mesh;
    assert_eq!((mesh.uvs[1].to_array(), mesh.atlas_uvs()[1].to_array()), ([0.0, 1.0], [1.0, 1.0]));
    assert_eq!(mesh.pose().atlas_uvs(), mesh.own_atlas_uvs);
    assert!(scene("", "uv_set = 16").unwrap_err().to_string().contains("uv_set"));
    // What the mesh does not have.
    for maps in ["", maps] {
        let told = scene(maps, "uv_set = 2").unwrap_err().to_string();
        let place = told.contains("quad.glb: mesh ") && told.contains(", primitive 0: ");
        let what = told.contains("has no texture coordinates 2 (TEXCOORD_2)");
        assert!(place && what && told.contains("name another set (`uv_set` in [diffusion])"), "{told}");
    }
    // Where nothing is computed in the atlas, a number that is none is refused all the same.
    let bare = |set: &str| folder.edited("[fit]", &format!("[diffusion]\nuv_set = {set}\n[fit]"));
    assert!(bare("1").unwrap().0.mesh.own_atlas_uvs.is_empty() && bare("99").is_err());
}

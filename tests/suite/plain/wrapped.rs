//! The skin's own maps beyond their borders; and what else its material says that no map holds.

use glam::Vec2;
use image::{ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};
use serde_json::{Value, json};
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::image::Image;
use skinfit::scene::animation::Animation;
use skinfit::scene::maps::Map;
use skinfit::scene::{LoadOptions, Scene};

use super::edited;
use crate::graphics::bench::{cache, on_cpu};
use crate::props::file::{File, Shape};
use crate::scene_folder::{SceneFolder, encode, exr};

/// A quad of skin, all maps of its material but the specular one, which is the scene's.
const SCENE: &str = r#"
[mesh]
file = "quad.glb"
[maps]
specular = "specular.png"
material = true
[environment]
file = "env.exr"
[model]
effects = ["diffuse", "normal_map", "side_specular"]
[[view]]
name = "front"
eye = [0, 0, 4]
look_at = [0, 0, 0]
fov_y_degrees = 30
width = 16
height = 16
"#;

/// The picture again beyond its borders, mirrored each second time, or its texels at the border (glTF 2.0, section 5.26).
const REPEAT: u32 = 10497;
const MIRROR: u32 = 33648;
const CLAMP: u32 = 33071;

/// A picture in which each texel is another, and no turn and no mirror takes it to itself.
fn texel(x: u32, y: u32) -> [u8; 3] {
    [40 + 50 * x as u8, 30 + 60 * y as u8, 250 - 20 * x as u8 - 35 * y as u8]
}

fn picture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    encode(RgbImage::from_fn(width, height, |x, y| Rgb(texel(x, y))), ImageFormat::Png)
}

/// A rectangle whose texture coordinates go from its top left corner to its bottom right one so.
fn panel([low, high]: [[f32; 2]; 2]) -> Shape {
    let place = |[u, v]: [f32; 2]| [low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1])];
    let flat = Shape::panel(1.0, 1.0);
    Shape { uvs: flat.uvs.iter().copied().map(place).collect(), ..flat }
}

/// A sampler that repeats along u and v in these ways.
fn sampler([u, v]: [u32; 2]) -> Value {
    json!({"wrapS": u, "wrapT": v})
}

/// A folder with a scene of such a file.
fn folder(file: &File, scene: &str) -> SceneFolder {
    let folder = SceneFolder::new();
    folder.write("quad.glb", &file.glb());
    folder.write("specular.png", &picture(2, 2, |x, y| [90 + 80 * x as u8 + 60 * y as u8; 3]));
    folder.write("env.exr", &exr(8, 4, &["R", "G", "B"], |_, _| 1.0));
    folder.write("scene.toml", scene.as_bytes());
    folder
}

/// The scene of a folder, with its warnings as one text.
fn loaded(folder: &SceneFolder) -> (Scene, String) {
    let (scene, warnings) = Scene::load(&folder.path("scene.toml"), &LoadOptions::default()).unwrap();
    (scene, warnings.iter().map(|warning| format!("{warning}\n")).collect())
}

/// A quad whose colours are 4 x 3 texels and whose normals are 6 x 2, each of a sampler of its own; and an animation.
fn quad(color: [u32; 2], normal: [u32; 2], uvs: [[f32; 2]; 2]) -> File {
    let mut file = File::new();
    let colors = file.texture(&picture(4, 3, texel), sampler(color));
    let bumps = picture(6, 2, |x, y| [100 + 10 * x as u8, 110 + 30 * y as u8, 240]);
    let normals = file.texture(&bumps, sampler(normal));
    let skin = file.material(json!({
        "name": "Skin", "normalTexture": {"index": normals},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": colors}},
    }));
    let node = file.put(&panel(uvs), skin, [0.0; 3]);
    let times = file.numbers(&[[0.0_f32], [1.0]]);
    let places = file.numbers(&[[0.0_f32, 0.0, 0.0], [0.0, 0.0, 0.5]]);
    file.add(
        "animations",
        json!({
            "samplers": [{"input": times, "output": places}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}],
        }),
    );
    file
}

/// The place in a picture of that many texels of one beside it.
fn wrapped(wrap: u32, i: i64, size: usize) -> usize {
    let size = size as i64;
    let place = match wrap {
        CLAMP => i.clamp(0, size - 1),
        MIRROR => (0..size).chain((0..size).rev()).nth(i.rem_euclid(2 * size) as usize).unwrap(),
        _ => i.rem_euclid(size),
    };
    place as usize
}

/// What a sampler shows at texture coordinates.
fn shown<const C: usize>(map: &Map<C>, [wrap_u, wrap_v]: [u32; 2], uv: [f64; 2]) -> [f64; C] {
    let along = |at: f64, size: usize, wrap: u32| {
        let place = at * size as f64 - 0.5;
        let low = place.floor();
        [(low as i64, 1.0 - (place - low)), (low as i64 + 1, place - low)]
            .map(|(i, weight)| (wrapped(wrap, i, size), weight))
    };
    let mut sum = [0.0; C];
    for (y, down) in along(uv[1], map.height, wrap_v) {
        for (x, across) in along(uv[0], map.width, wrap_u) {
            let texel = map.texels[y * map.width + x];
            (0..C).for_each(|c| sum[c] += down * across * f64::from(texel[c]));
        }
    }
    sum
}

/// Hold what a scene looks up, all over its quad, against what samplers show of the maps as they are in the files.
fn check<const C: usize>(got: &Map<C>, want: &Map<C>, wrap: [u32; 2], of: (&Scene, [[f32; 2]; 2])) {
    const STEPS: u32 = 48;
    let (scene, [low, high]) = of;
    // The corners of `Shape::panel`: the fourth is the top left one, the second the bottom right one.
    let (first, last) = (scene.mesh.uvs[3], scene.mesh.uvs[1]);
    for (i, j) in (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (i, j))) {
        let share = [i, j].map(|k| f64::from(k) / f64::from(STEPS));
        let between = |c: usize, a: f32, b: f32| f64::from(a) + share[c] * (f64::from(b) - f64::from(a));
        let uv = [0, 1].map(|c| between(c, low[c], high[c]));
        let placed = [0, 1].map(|c| between(c, first[c], last[c]) as f32);
        let (got, want) = (got.sample(placed[0], placed[1]), shown(want, wrap, uv));
        let off = got.iter().zip(want).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
        // Texture coordinates below 1 are rounded by 6e-8, at corners and here, in maps of at most 24 texels that change by
        // less than 1 from one to the next: 3e-6 along each axis.
        assert!(off < 1e-5, "{wrap:?} at {uv:?}: {got:?} instead of {want:?}");
    }
}

#[test]
fn the_skins_maps_go_on_beyond_their_borders_as_their_samplers_say() {
    let within = [[0.25, 0.3125], [0.75, 0.6875]];
    let (files, _) = loaded(&folder(&quad([REPEAT; 2], [REPEAT; 2], within), SCENE));
    let [color, normal] = [&files.maps.color, &files.maps.normal].map(|map| map.as_ref().unwrap());
    let specular = files.maps.specular.as_ref().unwrap();
    assert_eq!((files.maps.layout, color.width, color.height, normal.width), (None, 4, 3, 6));

    let modes = [
        [REPEAT, REPEAT],
        [MIRROR, MIRROR],
        [CLAMP, CLAMP],
        [REPEAT, MIRROR],
        [MIRROR, CLAMP],
        [CLAMP, REPEAT],
    ];
    let whole = [[0.0, 0.0], [1.0, 1.0]];
    let beyond = [[-0.75, -0.5], [1.25, 1.5]];
    let beside = [[2.25, -1.5], [2.5, -1.125]];
    for (i, of_color) in modes.into_iter().enumerate() {
        let of_normal = modes[(i + 1) % modes.len()];
        for uvs in [within, whole, beyond, beside] {
            let folder = folder(&quad(of_color, of_normal, uvs), SCENE);
            let (scene, _) = loaded(&folder);
            let maps = &scene.maps;
            check(maps.color.as_ref().unwrap(), color, of_color, (&scene, uvs));
            check(maps.normal.as_ref().unwrap(), normal, of_normal, (&scene, uvs));
            // A map that the scene names repeats, and is where it was.
            check(maps.specular.as_ref().unwrap(), specular, [REPEAT; 2], (&scene, uvs));
            // Maps stay as they are where the mesh comes to no border but those beyond which they repeat.
            assert_eq!(maps.layout.is_some(), uvs != within, "{of_color:?}, {of_normal:?}, {uvs:?}");
            let told = maps.material.clone().flatten().unwrap_or_default();
            assert_eq!(told.contains("beyond their borders"), maps.layout.is_some(), "{told}");
            // An animation reads the mesh again.
            let animation = Animation::open(&scene).unwrap().unwrap();
            assert_eq!(animation.mesh(0.5).unwrap().uvs, scene.mesh.uvs);
        }
    }
}

/// A quad that shows a picture and what lies beside it, or all of an unfolded one.
fn unfolded(png: &[u8], wrap: u32, side: f32) -> SceneFolder {
    let mut file = File::new();
    let color = file.texture(png, sampler([wrap; 2]));
    let skin = file
        .material(json!({"name": "Skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": color}}}));
    file.put(&panel([[0.0; 2], [side; 2]]), skin, [0.0; 3]);
    folder(&file, &plain_scene())
}

/// No maps, and no effects but the diffuse one.
fn plain_scene() -> String {
    SCENE
        .replace("specular = \"specular.png\"\nmaterial = true\n", "")
        .replace(", \"normal_map\", \"side_specular\"", "")
}

/// A scene whose maps are laid out.
pub(crate) fn mirrored() -> Scene {
    loaded(&unfolded(&picture(4, 4, texel), MIRROR, 2.0)).0
}

#[test]
fn a_mirrored_map_looks_as_one_that_is_unfolded() {
    let image = |folder: &SceneFolder| -> Image {
        let options = PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() };
        on_cpu(&Baked::new(&folder.path("scene.toml"), &options).unwrap(), 2)
    };
    let by_hand = picture(8, 8, |x, y| texel(x.min(7 - x), y.min(7 - y)));
    let (mirror, hand) = (unfolded(&picture(4, 4, texel), MIRROR, 2.0), unfolded(&by_hand, REPEAT, 1.0));
    let (mirror_image, hand_image) = (image(&mirror), image(&hand));
    assert_eq!(mirror_image, hand_image);
    // Not what the picture shows that repeats.
    assert_ne!(mirror_image, image(&unfolded(&picture(4, 4, texel), REPEAT, 2.0)));
    let scene = mirrored();
    assert_eq!(scene.maps.color, loaded(&hand).0.maps.color);
    assert_eq!(
        scene.mesh.uvs,
        panel([[0.0; 2], [1.0; 2]]).uvs.into_iter().map(Vec2::from).collect::<Vec<_>>()
    );
    let told = scene.maps.material.flatten().unwrap();
    assert!(told.contains("looked up at the texture coordinates times (0.5, 0.5) plus (0, 0)"), "{told}");
}

#[test]
fn texture_coordinates_of_what_is_not_skin_stay_where_they_are() {
    let folder = edited(&json!({"name": "Eye"}), super::SCENE, |mesh, _| {
        mesh["materials"][0] =
            json!({"name": "Skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
        mesh["textures"] = json!([{"source": 0, "sampler": 0}]);
        mesh["samplers"] = json!([sampler([CLAMP; 2])]);
    });
    let (scene, _) = loaded(&folder);
    let ends = |uvs: &[Vec2]| uvs.iter().fold((1.0_f32, 0.0_f32), |(l, m), uv| (l.min(uv.x), m.max(uv.x)));
    // Four texels, and one to each side.
    assert_eq!(ends(&scene.mesh.uvs[..4]), ((1.0_f64 / 6.0) as f32, (5.0_f64 / 6.0) as f32));
    assert_eq!(ends(&scene.mesh.uvs[4..]), (0.0, 1.0));
}

#[test]
fn texture_coordinates_far_beyond_a_map_are_a_warning() {
    // Too many texels; and farther than an f32 tells places of a picture apart.
    for far in [60_000.0, 1e30] {
        let (scene, told) = loaded(&unfolded(&picture(4, 4, texel), CLAMP, far));
        assert!(told.contains("comes to borders of pictures that its material mirrors or clamps"), "{told}");
        assert_eq!((scene.maps.layout, scene.maps.color.unwrap().width), (None, 4));
        assert_eq!(scene.mesh.uvs[1], Vec2::splat(far));
        // What is mirrored goes on so for ever: the picture and its mirror image repeat.
        let (scene, told) = loaded(&unfolded(&picture(4, 4, texel), MIRROR, far));
        assert!(told.is_empty(), "{told}");
        assert_eq!((scene.maps.color.unwrap().width, scene.mesh.uvs[1]), (8, Vec2::splat(0.5 * far)));
    }
}

/// A quad with colours at its vertices, if any.
fn colored(colors: Option<[[f32; 3]; 4]>) -> File {
    let mut file = File::new();
    let color = file.texture(&picture(4, 4, texel), sampler([REPEAT; 2]));
    let skin = file
        .material(json!({"name": "Skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": color}}}));
    let mut primitive = file.primitive(&Shape::panel(1.0, 1.0), skin);
    if let Some(colors) = colors {
        primitive["attributes"]["COLOR_0"] = json!(file.numbers(&colors));
    }
    let mesh = file.mesh("quad", &[primitive]);
    file.root(json!({"mesh": mesh}));
    file
}

#[test]
fn colours_of_the_skins_vertices_are_told_where_they_would_show() {
    let words = "material \"Skin\": colours of vertices (COLOR_0)";
    let (without, told) = loaded(&folder(&colored(None), &plain_scene()));
    assert!(told.is_empty(), "{told}");
    let (white, told) = loaded(&folder(&colored(Some([[1.0; 3]; 4])), &plain_scene()));
    assert!(told.is_empty(), "{told}");
    assert_eq!((&white.mesh, &white.maps.color), (&without.mesh, &without.maps.color));

    let mut corners = [[1.0; 3]; 4];
    corners[2] = [1.0, 0.5, 1.0];
    let rosy = colored(Some(corners));
    let (scene, told) = loaded(&folder(&rosy, &plain_scene()));
    assert!(told.contains(words), "{told}");
    assert_eq!((&scene.mesh, &scene.maps.color), (&without.mesh, &without.maps.color));
    // Nor does it need a picture.
    let mut bare = colored(Some(corners));
    bare.json["materials"][0] = json!({"name": "Skin"});
    let (_, told) = loaded(&folder(&bare, &plain_scene()));
    assert!(told.contains(words), "{told}");
    // Not where the colours are a map's that the scene names, or nobody's.
    let maps = |keys: &str| plain_scene().replace("[maps]\n", &format!("[maps]\n{keys}\n"));
    for keys in ["color = \"specular.png\"", "material = false"] {
        let (_, told) = loaded(&folder(&rosy, &maps(keys)));
        assert!(!told.contains("COLOR_0"), "{told}");
    }
    // Their alpha counts where the material's does.
    let clear = |mode: &str| {
        let mut file = colored(None);
        let colors = file.numbers(&[[1.0_f32, 1.0, 1.0, 0.5]; 4]);
        file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        file.json["materials"][0]["alphaMode"] = json!(mode);
        loaded(&folder(&file, &plain_scene())).1
    };
    assert!(clear("OPAQUE").is_empty() && clear("BLEND").contains(words), "{}", clear("BLEND"));
    // Nobody reads them, so that damaged ones are no error.
    corners[0] = [f32::NAN; 3];
    let (_, told) = loaded(&folder(&colored(Some(corners)), &plain_scene()));
    assert!(told.contains(words), "{told}");
}

#[test]
fn holes_of_the_skins_material_are_told() {
    // A quarter of it has an alpha of 0.2.
    let alpha = |x: u32, y: u32| if x < 2 && y < 2 { 51 } else { 255 };
    let holed = RgbaImage::from_fn(4, 4, |x, y| {
        let [r, g, b] = texel(x, y);
        Rgba([r, g, b, alpha(x, y)])
    });
    let holed = encode(holed, ImageFormat::Png);
    for (mode, cutoff, factor, share) in [
        ("OPAQUE", 0.5, 1.0, None),
        ("OPAQUE", 0.5, 0.25, None),
        ("MASK", 0.5, 1.0, Some("4 of the 16 texels of its picture")),
        ("MASK", 0.1, 1.0, None),
        ("MASK", 0.5, 0.25, Some("all of it")),
        ("BLEND", 0.5, 1.0, Some("4 of the 16 texels of its picture")),
        ("BLEND", 0.5, 0.25, Some("all of it")),
    ] {
        let mut file = File::new();
        let color = file.texture(&holed, sampler([REPEAT; 2]));
        let mut skin = json!({
            "name": "Skin", "alphaMode": mode,
            "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, factor], "baseColorTexture": {"index": color}},
        });
        if mode == "MASK" {
            skin["alphaCutoff"] = json!(cutoff);
        }
        let skin = file.material(skin);
        file.put(&Shape::panel(1.0, 1.0), skin, [0.0; 3]);
        let (_, told) = loaded(&folder(&file, &plain_scene()));
        match share {
            Some(share) => {
                let words = format!("material \"Skin\": its alpha, which leaves {share} not opaque");
                assert!(told.contains(&words), "{mode}, {cutoff}, {factor}: {told}");
                assert_eq!(told.lines().count(), 1, "{told}");
            }
            None => assert!(told.is_empty(), "{mode}, {cutoff}, {factor}: {told}"),
        }
    }
}

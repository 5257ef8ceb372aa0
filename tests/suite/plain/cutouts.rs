//! Parts with holes and parts that blend in light's way: what rays and shadow maps find of them.

use serde_json::{Value, json};
use skinfit::bake::harmonics::Order;
use skinfit::bake::interreflection::Albedo;
use skinfit::bake::occlusion::bake_occlusion;
use skinfit::bake::thickness::bake_thickness;
use skinfit::bake::transfer::bake_transfer;
use skinfit::gpu::upload::Content;
use skinfit::gpu::{RenderOptions, Renderer};
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::image::Image;
use skinfit::scene::mesh::PosedMesh;

use super::{SCENE, edited};
use crate::graphics::bench::{EXACT, cache, gpu, on_cpu, on_gpu};
use crate::scene_folder::{SceneFolder, encode};

/// Rays a vertex.
const RAYS: u32 = 256;
/// As many as tell shares apart.
const MANY: u32 = 16_384;

/// What a texel has of alpha, by its column and row.
pub(super) type Alpha = fn(u32, u32) -> u8;

/// A white picture whose alpha is that, 16 texels a side.
pub(super) fn picture(alpha: impl Fn(u32, u32) -> u8) -> Vec<u8> {
    let picture = image::RgbaImage::from_fn(16, 16, |x, y| image::Rgba([255, 255, 255, alpha(x, y)]));
    encode(picture, image::ImageFormat::Png)
}

/// Opaque on the left, clear on the right.
pub(super) fn halves(x: u32, _: u32) -> u8 {
    if x < 8 { 255 } else { 0 }
}

/// A material of that mode with the picture.
pub(super) fn card(mode: &str) -> Value {
    json!({"name": "Card", "alphaMode": mode, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
}

/// Skin, and half as far above it as it is wide a card of the same size with that material and picture, whose texels are
/// seen as squares.
fn under_a_card(
    material: &Value,
    alpha: impl Fn(u32, u32) -> u8,
    edit: impl FnOnce(&mut Value),
) -> PosedMesh {
    let folder = edited(material, SCENE, |mesh, _| {
        mesh["nodes"][1]["scale"] = json!([1, 1, 1]);
        mesh["textures"] = json!([{"source": 0, "sampler": 0}]);
        mesh["samplers"] = json!([{"magFilter": 9728}]);
        edit(mesh);
    });
    folder.write("picture.png", &picture(alpha));
    folder.load().unwrap().0.mesh.pose()
}

/// The shares of their hemispheres in which the skin's four vertices see the card.
fn hidden(mesh: &PosedMesh) -> Vec<f32> {
    hidden_from(mesh, RAYS)
}

fn hidden_from(mesh: &PosedMesh, rays: u32) -> Vec<f32> {
    let open = bake_occlusion(&|_| mesh.clone(), 0, rays).base;
    open[..4].iter().map(|open| 1.0 - open).collect()
}

/// Those under a card of that material and picture.
fn hidden_by(material: &Value, alpha: impl Fn(u32, u32) -> u8) -> Vec<f32> {
    hidden(&under_a_card(material, alpha, |_| {}))
}

/// Whether about `share` of the rays that meet the whole card are stopped, at each vertex.
fn about(share: f32, got: &[f32], whole: &[f32]) -> bool {
    got.iter().zip(whole).all(|(got, whole)| {
        // Four standard deviations of a coin that is tossed for each of many rays: a few hundredths of the whole, of which
        // the shares that are told apart here are tenths.
        let tossed = MANY as f32 * whole;
        let deviation = (tossed * share * (1.0 - share)).sqrt() / MANY as f32;
        4.0 * deviation < 0.05 * whole && (got - share * whole).abs() < 4.0 * deviation
    })
}

/// What many rays find.
fn shares(mesh: &PosedMesh) -> Vec<f32> {
    hidden_from(mesh, MANY)
}

#[test]
fn what_is_nowhere_cut_out_is_opaque_and_what_is_clear_is_not_there() {
    let of = |mode: &str, alpha: u8| under_a_card(&card(mode), |_, _| alpha, |_| {});
    let (order, white) = (Order::new(3).unwrap(), Albedo { map: None });
    let baked = |mesh: &PosedMesh| {
        let pose = |_: &[f32]| mesh.clone();
        // Rays that ask for anything, and those that ask for the first thing.
        let transfers = [None, Some(&white)].map(|albedo| bake_transfer(&pose, 0, RAYS, order, albedo));
        (hidden(mesh), transfers)
    };
    let closed = baked(&of("OPAQUE", 0));
    // About a quarter of a vertex' sky is above the card.
    assert!(closed.0.iter().all(|hidden| (0.15..0.3).contains(hidden)), "{:?}", closed.0);
    for mode in ["MASK", "BLEND"] {
        // To the bit: the same rays meet the same triangles.
        assert!(baked(&of(mode, 255)) == closed, "{mode}");
        assert_eq!(hidden(&of(mode, 0)), [0.0; 4], "{mode}");
    }
}

#[test]
fn of_a_picture_and_its_negative_each_ray_meets_one() {
    let checks = |x: u32, y: u32| if (x + y).is_multiple_of(2) { 255 } else { 0 };
    let pictures: [(&str, Alpha); 2] = [("halves", halves), ("checks", checks)];
    for mode in ["MASK", "BLEND"] {
        let card = card(mode);
        let whole = hidden_by(&card, |_, _| 255);
        for (name, alpha) in pictures {
            let (one, other) = (hidden_by(&card, alpha), hidden_by(&card, |x, y| 255 - alpha(x, y)));
            for i in 0..4 {
                // Counts of 256 rays are exact in f32.
                assert_eq!(one[i] + other[i], whole[i], "{mode}, {name}: {one:?} {other:?}");
            }
        }
        let [got, whole] =
            [checks as Alpha, |_, _| 255].map(|alpha| shares(&under_a_card(&card, alpha, |_| {})));
        assert!(about(0.5, &got, &whole), "{mode}: {got:?} of {whole:?}");
        // The card's left half hides more from the vertices below it: the first and the last of the quad.
        let left = hidden_by(&card, halves);
        assert!(left[0] > 2.0 * left[1] && left[3] > 2.0 * left[2], "{mode}: {left:?}");
    }
}

#[test]
fn a_hole_lies_where_the_picture_is_looked_up() {
    let right = hidden_by(&card("MASK"), |x, y| 255 - halves(x, y));
    let mut shifted = card("MASK");
    shifted["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"offset": [0.5, 0]}});
    assert_eq!(hidden_by(&shifted, halves), right);
    // Half the picture's width beyond its border a sampler that clamps has its last column.
    let clamped = under_a_card(&shifted, halves, |mesh| mesh["samplers"][0]["wrapS"] = json!(33071));
    assert_eq!(hidden(&clamped), [0.0; 4]);
}

#[test]
fn a_mask_cuts_at_its_cutoff_what_picture_factor_and_vertices_have_of_alpha() {
    // 128 of 255 is just above a half.
    let of = |material: &Value, edit: fn(&mut Value)| hidden(&under_a_card(material, |_, _| 128, edit));
    let whole = of(&card("OPAQUE"), |_| {});
    assert_eq!(of(&card("MASK"), |_| {}), whole);
    for (cutoff, want) in
        [(0.4, whole.clone()), (0.6, vec![0.0; 4]), (0.0, whole.clone()), (1.5, vec![0.0; 4])]
    {
        let mut card = card("MASK");
        card["alphaCutoff"] = json!(cutoff);
        assert_eq!(of(&card, |_| {}), want, "{cutoff}");
    }
    let mut thinner = card("MASK");
    thinner["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0.9]);
    assert_eq!(of(&thinner, |_| {}), [0.0; 4]);
    // The alpha of these colours is 0.
    let colored = |mesh: &mut Value| mesh["meshes"][1]["primitives"][0]["attributes"]["COLOR_0"] = json!(3);
    assert_eq!(of(&card("MASK"), colored), [0.0; 4]);
    assert_eq!(of(&card("OPAQUE"), colored), whole);
}

#[test]
fn what_blends_stops_its_share_of_rays_and_two_layers_what_both_do() {
    let whole = shares(&under_a_card(&card("OPAQUE"), |_, _| 255, |_| {}));
    for alpha in [51, 128, 204] {
        let got = shares(&under_a_card(&card("BLEND"), |_, _| alpha, |_| {}));
        assert!(about(f32::from(alpha) / 255.0, &got, &whole), "{alpha}: {got:?} of {whole:?}");
    }
    // So near above the first that rays go by both or neither; 128 of 255 twice lets a quarter through.
    let second = |mesh: &mut Value| {
        mesh["nodes"].as_array_mut().unwrap().push(json!({"mesh": 1, "translation": [0, 0, 0.501]}));
        mesh["scenes"][0]["nodes"] = json!([0, 1, 2]);
    };
    let got = shares(&under_a_card(&card("BLEND"), |_, _| 128, second));
    assert!(about(0.75, &got, &whole), "{got:?} of {whole:?}");
}

#[test]
fn skin_is_as_thick_as_if_cards_below_it_were_not_there() {
    let below = |mode: &str, alpha: u8| {
        let lower = |mesh: &mut Value| mesh["nodes"][1]["translation"] = json!([0, 0, -0.5]);
        let mesh = under_a_card(&card(mode), |_, _| alpha, lower);
        // The skin's own vertices come first.
        bake_thickness(&|_| mesh.clone(), 0).base[..4].to_vec()
    };
    // Rays inward end at opaque parts.
    let solid = below("OPAQUE", 255);
    assert!(solid.iter().all(|inverse| *inverse > 0.0), "{solid:?}");
    for mode in ["MASK", "BLEND"] {
        assert_eq!(below(mode, 255), [0.0; 4], "{mode}");
    }
}

/// A lit scene, whose card is half as wide as the skin and shades its right.
fn lit(material: &Value, alpha: impl Fn(u32, u32) -> u8, edit: impl FnOnce(&mut Value)) -> Baked {
    at(&lit_folder(material, alpha, |mesh, _| edit(mesh)), None)
}

/// The scene in a folder, at those seconds of its animation.
pub(super) fn at(folder: &SceneFolder, time: Option<f64>) -> Baked {
    let options = PrepareOptions { cache: Some(cache()), time, ..PrepareOptions::default() };
    Baked::new(&folder.path("scene.toml"), &options).unwrap()
}

/// The folder of that scene.
pub(super) fn lit_folder(
    material: &Value,
    alpha: impl Fn(u32, u32) -> u8,
    edit: impl FnOnce(&mut Value, &mut Vec<u8>),
) -> SceneFolder {
    let lamp = "[[light]]\nname = \"cut_aside\"\ntype = \"directional\"\ndirection = [1, 0, -0.7]\nirradiance = [3.0, 3.0, 3.0]\n";
    let side = |key: &str| (format!("{key} = 16"), format!("{key} = {}", 16 * FINER));
    let [(wide, wider), (high, higher)] = ["width", "height"].map(side);
    let scene = SCENE
        .replace(&wide, &wider)
        .replace(&high, &higher)
        .replace("\"diffuse\"", "\"lights\", \"shadows\"")
        .replace("[environment]\nfile = \"env.exr\"\n", lamp);
    let folder = edited(material, &scene, edit);
    folder.write("picture.png", &picture(alpha));
    folder
}

/// Pixels a side of each of the picture's 16 squares a side.
const FINER: usize = 4;

/// How bright the skin is in column 14 of rows 5 to 10 of squares, which the card's right half shades, beside column 1, its
/// mirror image, which nothing does.
pub(super) fn beside_the_open(image: &Image) -> f32 {
    let column = |at: usize| FINER * at..FINER * (at + 1);
    let row = |y: usize, at: usize| column(at).map(|x| image.rgb[image.width * y + x][0]).sum::<f32>();
    let sum = |at: usize| (5 * FINER..11 * FINER).map(|y| row(y, at)).sum::<f32>();
    sum(14) / sum(1)
}

/// By rays, of which each pixel has 64, and by the renderer's shadow maps, where there is an adapter.
pub(super) fn traced_and_drawn(baked: &Baked) -> [Option<f32>; 2] {
    let drawn = gpu().map(|gpu| beside_the_open(&on_gpu(gpu, baked, EXACT)));
    [Some(beside_the_open(&on_cpu(baked, 8))), drawn]
}

/// How far what [`traced_and_drawn`] finds may be from `want`: four standard deviations of as many coins as there are rays, and
/// as many as four fragments a pixel ask of texels, two of their own each; of whole and clear places, where all fall alike, the
/// roundings of shading.
pub(super) fn tolerances(want: f32) -> [f32; 2] {
    let pixels = (6 * FINER * FINER) as f32;
    let coins = [64.0 * pixels, 4.0 * 2.0 * pixels];
    coins.map(|coins| 4.0 * (want * (1.0 - want) / coins).sqrt() + 1e-3)
}

#[test]
fn a_lamp_shines_through_holes_by_rays_and_by_shadow_maps() {
    let cases: [(&str, Alpha, f32); 6] = [
        ("OPAQUE", halves, 0.0),
        ("MASK", halves, 1.0),
        ("MASK", |x, y| 255 - halves(x, y), 0.0),
        ("BLEND", halves, 1.0),
        ("BLEND", |_, _| 255, 0.0),
        ("BLEND", |_, _| 128, 0.5),
    ];
    for (mode, alpha, want) in cases {
        let found = traced_and_drawn(&lit(&card(mode), alpha, |_| {}));
        for ((found, tolerance), how) in found.into_iter().zip(tolerances(want)).zip(["rays", "shadow map"]) {
            let Some(found) = found else { continue };
            assert!((found - want).abs() < tolerance, "{mode}, {how}: {found} is not {want}");
        }
    }
}

#[test]
fn shadow_maps_and_rays_look_alpha_up_alike() {
    type Edit = fn(&mut Value);
    let factor: Edit = |card| card["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 0.9]);
    // The alpha of these colours is 0.
    let colored: Edit = |mesh| mesh["meshes"][1]["primitives"][0]["attributes"]["COLOR_0"] = json!(3);
    // 128 of 255, which is just above a half, is all of the picture: all of the place is shaded, or nothing.
    let cases: [(&str, Edit, Edit, f32); 5] = [
        ("as it is", |_| {}, |_| {}, 0.0),
        ("a factor", factor, |_| {}, 1.0),
        ("a cutoff", |card| card["alphaCutoff"] = json!(0.6), |_| {}, 1.0),
        ("a lower cutoff", |card| card["alphaCutoff"] = json!(0.4), |_| {}, 0.0),
        ("colours of vertices", |_| {}, colored, 1.0),
    ];
    for (name, edit_card, edit_mesh, want) in cases {
        let mut card = card("MASK");
        edit_card(&mut card);
        for found in traced_and_drawn(&lit(&card, |_, _| 128, edit_mesh)).into_iter().flatten() {
            // Roundings of shading.
            assert!((found - want).abs() < 1e-3, "{name}: {found} is not {want}");
        }
    }
    // Moved by half the picture's width; clamped at its border, its last column, which is clear.
    let mut shifted = card("MASK");
    shifted["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"offset": [0.5, 0]}});
    let clamp = |mesh: &mut Value| {
        mesh["samplers"] = json!([{"magFilter": 9728, "wrapS": 33071}]);
        mesh["textures"][0]["sampler"] = json!(0);
    };
    let [repeated, clamped] =
        [lit(&shifted, halves, |_| {}), lit(&shifted, halves, clamp)].map(|baked| traced_and_drawn(&baked));
    for (repeated, clamped) in repeated.into_iter().zip(clamped) {
        let (Some(repeated), Some(clamped)) = (repeated, clamped) else { continue };
        assert!(repeated < 1e-3 && (clamped - 1.0).abs() < 1e-3, "{repeated} {clamped}");
    }
}

#[test]
fn the_shadow_of_what_has_holes_goes_with_it() {
    let Some(gpu) = gpu() else { return };
    let baked = lit(&card("MASK"), halves, |_| {});
    let camera = baked.scene.views[0].camera;
    let options = RenderOptions { animated: true, ..EXACT };
    let mut renderer = Renderer::new(gpu, Content::of(&baked), options).unwrap();
    let image = |renderer: &mut Renderer| renderer.render(&camera, baked.gains[0]).unwrap().image.rgb;
    let before = image(&mut renderer);
    let mut moved = baked.scene.mesh.clone();
    moved.positions[4..].iter_mut().for_each(|place| place.x -= 0.3);
    renderer.set_mesh(&moved, None).unwrap();
    let after = image(&mut renderer);
    assert_ne!(after, before);
    // To the bit what a scene shows that has it there.
    let made = on_gpu(gpu, &baked.clone().with_scene(|scene| scene.mesh = moved), EXACT);
    assert_eq!(after, made.rgb);
}

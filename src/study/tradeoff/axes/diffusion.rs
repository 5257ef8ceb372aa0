//! Texture-space diffusion: each of its approximations beside the sum over the surface, all else as the scene has it.

use super::ways::{Way, Ways};
use crate::model::diffusion::{AmbientNormal, Combined, Method, Seams, Stretch, Taps, Unblurred};
use crate::scene::Scene;
use crate::scene::diffusion::Preset;

const EFFECT: &str = "diffusion";
const IDLE: &str = "the effect diffusion is off";

/// What light is measured against.
const SURFACE: Way = ("surface", |scene| scene.choices.diffusion.method = Method::Surface);

/// The scene with its levels made by blurs along the atlas' axes.
fn blurred(scene: &mut Scene) {
    scene.choices.diffusion.method = Method::Separable;
}

const fn ways(axis: &'static str, title: &'static str, method: &'static str, ways: &'static [Way]) -> Ways {
    Ways { axis, title, method, effects: &[EFFECT], idle: IDLE, ways }
}

fn tapped(scene: &mut Scene, taps: Taps) {
    blurred(scene);
    scene.choices.diffusion.taps = taps;
}

/// Places that a blur counts.
pub(super) const TAPS: Ways = ways(
    "taps",
    "Places that a blur of the light map counts",
    "Images with blurs of this number of places along each axis; levels by distance over the surface are the reference. Seconds are \
     those of baking, tracing and one pass, nothing cached.",
    &[
        ("5", |scene| tapped(scene, Taps::Five)),
        ("7", |scene| tapped(scene, Taps::Seven)),
        ("9", |scene| tapped(scene, Taps::Nine)),
        ("full", |scene| tapped(scene, Taps::Full)),
        SURFACE,
    ],
);

fn sized(scene: &mut Scene, size: u32) {
    blurred(scene);
    scene.diffusion.light_map_size = size;
}

/// Texels along a side of the light map.
pub(super) const LIGHT_MAP_SIZE: Ways = ways(
    "light_map_size",
    "Texels along a side of the light map",
    "Images with light maps of each size; levels by distance over the surface, in a map of the scene's own size, are the \
     reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    &[
        ("128", |scene| sized(scene, 128)),
        ("256", |scene| sized(scene, 256)),
        ("512", |scene| sized(scene, 512)),
        ("1024", |scene| sized(scene, 1024)),
        ("2048", |scene| sized(scene, 2048)),
        SURFACE,
    ],
);

/// What blurs find beyond a chart's border.
pub(super) const SEAMS: Ways = ways(
    "seams",
    "What blurs find beyond the border of a chart",
    "Images with blurs that end there, and that go on across it; levels by distance over the surface are the reference. Seconds \
     are those of baking, tracing and one pass, nothing cached.",
    &[
        ("cut", |scene| {
            blurred(scene);
            scene.choices.diffusion.seams = Seams::Cut;
        }),
        ("joined", |scene| {
            blurred(scene);
            scene.choices.diffusion.seams = Seams::Joined;
        }),
        SURFACE,
    ],
);

/// Along which normal ambient light arrives at the light map.
pub(super) const AMBIENT_NORMAL: Ways = ways(
    "ambient_normal",
    "The normal of the light map's ambient light",
    "Images with ambient light looked up along each normal; levels by distance over the surface, of light along the bumped one, \
     are the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    &[
        ("smooth", |scene| {
            blurred(scene);
            scene.choices.diffusion.ambient_normal = AmbientNormal::Smooth;
        }),
        ("bumped", |scene| {
            blurred(scene);
            scene.choices.diffusion.ambient_normal = AmbientNormal::Bumped;
        }),
        ("surface", |scene| {
            scene.choices.diffusion.method = Method::Surface;
            scene.choices.diffusion.ambient_normal = AmbientNormal::Bumped;
        }),
    ],
);

/// Where light is taken that no blur has moved.
pub(super) const UNBLURRED: Ways = ways(
    "unblurred",
    "Where the light is taken that no blur has moved",
    "Images with it out of the light map, and as it falls in the pixel; levels by distance over the surface, and it in the pixel, \
     are the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    &[
        ("map", |scene| {
            blurred(scene);
            scene.choices.diffusion.unblurred = Unblurred::Map;
        }),
        ("pixel", |scene| {
            blurred(scene);
            scene.choices.diffusion.unblurred = Unblurred::Pixel;
        }),
        ("surface", |scene| {
            scene.choices.diffusion.method = Method::Surface;
            scene.choices.diffusion.unblurred = Unblurred::Pixel;
        }),
    ],
);

/// Where levels are weighed and added up.
pub(super) const COMBINED: Ways = ways(
    "combined",
    "Where the levels are weighed and added up",
    "Images with each level looked up by the pixel, and with their sum alone, which differ in time; levels by distance over the \
     surface are the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    &[
        ("pixel", |scene| {
            blurred(scene);
            scene.choices.diffusion.combined = Combined::Pixel;
        }),
        ("map", |scene| {
            blurred(scene);
            scene.choices.diffusion.combined = Combined::Map;
        }),
        SURFACE,
    ],
);

/// How far texels lie apart.
pub(super) const STRETCH: Ways = ways(
    "stretch",
    "How the stretch of the atlas is found",
    "Images with the stretch from neighbour to neighbour, and by the triangle's Jacobian; levels by distance over the surface are \
     the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    &[
        ("derivative", |scene| {
            blurred(scene);
            scene.choices.diffusion.stretch = Stretch::Derivative;
        }),
        ("exact", |scene| {
            blurred(scene);
            scene.choices.diffusion.stretch = Stretch::Exact;
        }),
        SURFACE,
    ],
);

/// How many levels there are.
pub(super) const LEVELS: Ways = ways(
    "levels",
    "How many levels the light map is blurred to",
    "Images with the article's three levels, and with the human head demo's five, each with its own weights and radii; five by \
     distance over the surface are the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    &[
        ("3", |scene| {
            blurred(scene);
            Preset::Article.put(scene);
        }),
        ("5", |scene| {
            blurred(scene);
            Preset::HumanHead.put(scene);
        }),
        ("surface", |scene| {
            scene.choices.diffusion.method = Method::Surface;
            Preset::HumanHead.put(scene);
        }),
    ],
);

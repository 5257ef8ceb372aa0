//! Texture-space diffusion in the report: what it makes in texels of the UV atlas (MODEL 6), stage by stage.

use super::figures::data_uri;
use super::page::{escape, section};
use super::pictures::Picture;
use crate::render::files::Image;

/// The longest side of a stage's picture in the page; larger ones are shrunk by a whole factor.
pub const LONGEST: usize = 512;

const SEEN: &str = "What the fitted constants make in texels of the UV atlas, u to the right and v down; grey where the mesh \
    covers none. Radiance is shown as sRGB, clipped to [0, 1]; what a blur is called by is its standard deviation on the \
    skin. <code>skinfit bake</code> can write their numbers.";

/// The stages of a scene.
#[derive(Clone, Debug)]
pub struct DiffusedScene {
    /// What the scene is called among several; empty of one.
    pub name: String,
    /// In the order in which they are shown.
    pub stages: Vec<Stage>,
}

/// A stage as a picture.
#[derive(Clone, Debug)]
pub struct Stage {
    /// What its files are called, too.
    pub name: String,
    /// What is seen, and its unit; plain text.
    pub caption: String,
    /// What a screen shows, in linear light; transparent where no texel is covered.
    pub image: Image,
}

/// The page's section; nothing where no scene has diffusion.
///
/// # Errors
/// When a picture cannot be encoded.
pub(super) fn shown(scenes: &[DiffusedScene]) -> Result<String, String> {
    if scenes.is_empty() {
        return Ok(String::new());
    }
    let pictures = scenes.iter().map(of_scene).collect::<Result<String, _>>()?;
    Ok(section(
        "diffusion",
        "Light that scatters, in texels",
        &format!("<p class=\"quiet\">{SEEN}</p>\n{pictures}"),
    ))
}

fn of_scene(scene: &DiffusedScene) -> Result<String, String> {
    let heading = match scene.name.as_str() {
        "" => String::new(),
        name => format!("<h3>{}</h3>", escape(name)),
    };
    let figures = scene.stages.iter().map(figure).collect::<Result<String, _>>()?;
    Ok(format!("{heading}<div class=\"texels\">{figures}</div>\n"))
}

fn figure(stage: &Stage) -> Result<String, String> {
    let picture = Picture::of_image(&stage.image.shrunk(LONGEST));
    let (uri, width, height) = (data_uri(&picture)?, picture.width, picture.height);
    let (name, caption) = (escape(&stage.name), escape(&stage.caption));
    Ok(format!(
        "<figure><img src=\"{uri}\" width=\"{width}\" height=\"{height}\" alt=\"stage {name}\">\
         <figcaption>{caption}</figcaption></figure>"
    ))
}

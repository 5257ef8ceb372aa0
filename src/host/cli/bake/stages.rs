//! `skinfit bake --stages`: what texture-space diffusion makes in texels of the UV atlas, as pictures (MODEL 6).

use std::path::Path;

use super::super::Refusal;
use crate::engine::Unknown;
use crate::engine::cubes_at::CubesAt;
use crate::engine::levels::LevelMaker;
use crate::engine::rules::sample_facts;
use crate::model::params::Param;
use crate::output;
use crate::prepare::Baked;
use crate::progress::bar;
use crate::render::files::{ImageOptions, write_exr, write_png};
use crate::render::image::Image;
use crate::render::tonemap::ToneMap;
use crate::samples::{Atlas, PosedSurface, atlas_of};
use crate::scene::charts;
use crate::scene::mesh::Mesh;
use crate::shader::tangent::chain::Seed;
use crate::shader::term::library;
use skinfit_core::program::lower::Natives;
use skinfit_core::program::shading::Shading;

/// The light map, and the levels that are made of it.
const LIGHT_MAP: &str = "diffusion_level_0";
const LEVEL: &str = "diffusion_level_";
/// What `combined = "map"` adds up in texels, and that of the blurs alone.
const SUM: &str = "scattered_light";
const MOVED: &str = "diffusion_moved";
const STRETCH: &str = "diffusion_stretch";

/// How a picture's numbers are shown on a screen; the EXR file has them as they are.
#[derive(Clone, Copy)]
enum Shown {
    /// As light.
    Light,
    /// As shares of the largest.
    Shares,
    /// Of either sign: 0 is a middle grey.
    Signed,
}

/// The stages of a scene's diffusion, by their files' names: the charts, the stretch map, the light map, each level, and for
/// each parameter that is free in the scene's fit how light map and levels move along it.
pub(super) struct Stages {
    pictures: Vec<(String, Image, Shown)>,
    /// The chart of each vertex, counted from 1.
    charts: Vec<u32>,
}

impl Stages {
    /// Make them of the surface at rest.
    ///
    /// # Errors
    /// When the scene has no diffusion, or its mesh no atlas for it.
    pub(super) fn new(baked: &Baked, surface: &PosedSurface<'_>) -> Result<Self, Refusal> {
        let (scene, setup) = (&*baked.scene, baked.setup());
        let scatters = library::scatters(setup.effects);
        let none = || {
            Refusal::new(format!(
                "{}: --stages shows what texture-space diffusion makes, which is off. Enable the effect `diffusion`, or leave \
             --stages out.",
                scene.path.display()
            ))
        };
        let atlas = atlas_of(scene, surface)?.filter(|_| scatters).ok_or_else(none)?;
        let mut free: Vec<Param> = Vec::new();
        for unknown in baked.unknowns() {
            let Unknown::Param(column) = unknown else { continue };
            if column.param.asked_for(setup.effects) && !free.contains(&column.param) {
                free.push(column.param);
            }
        }
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let facts = sample_facts(setup, &baked.illumination, true);
        let shading = Shading::new(&facts, &seeds, |_| None, Natives::Written)?;
        let maker = LevelMaker::<f32>::new(shading.levels);
        let made =
            maker.make(&atlas, &scene.params, &CubesAt::new(&baked.illumination, &scene.params, |x| x)).all();
        let mut pictures = vec![("charts".to_owned(), picture_of_charts(&atlas), Shown::Light)];
        for (name, level) in &made {
            let Some((name, shown)) = file_of(name, &free) else { continue };
            pictures.push((name, picture(&atlas, |texel| level[texel]), shown));
        }
        let Mesh { positions, uvs, triangles, .. } = &scene.mesh;
        Ok(Self { pictures, charts: charts::charts(positions, uvs, triangles) })
    }

    /// Write each as an EXR and a PNG file into `folder`, and the vertices' charts; returns how many there are.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(super) fn write(&self, folder: &Path) -> Result<usize, Refusal> {
        let rows = self.charts.iter().enumerate().map(|(vertex, chart)| format!("{vertex},{chart}\n"));
        let text = std::iter::once("vertex,chart\n".to_owned()).chain(rows).collect::<String>();
        output::write(&folder.join("charts.csv"), text.as_bytes())?;
        let progress = bar("stages", 2 * self.pictures.len() as u64);
        for (name, image, shown) in &self.pictures {
            write_exr(&folder.join(format!("{name}.exr")), image, &ImageOptions::default())?;
            progress.inc(1);
            write_png(
                &folder.join(format!("{name}.png")),
                &on_screen(image, *shown),
                ToneMap::default(),
                0.0,
            )?;
            progress.inc(1);
        }
        progress.finish_and_clear();
        Ok(self.pictures.len())
    }
}

/// The name of a level's files, and how it is shown; `None` of what stands between levels.
fn file_of(name: &str, free: &[Param]) -> Option<(String, Shown)> {
    let of = |name: &str| match name {
        LIGHT_MAP => Some("light_map".to_owned()),
        SUM | MOVED => Some("sum".to_owned()),
        _ => {
            let k = name.strip_prefix(LEVEL)?;
            k.bytes().all(|digit| digit.is_ascii_digit()).then(|| format!("level_{k}"))
        }
    };
    if name == STRETCH {
        return Some(("stretch".to_owned(), Shown::Shares));
    }
    if let Some(file) = of(name) {
        return Some((file, Shown::Light));
    }
    // `d0_NAME` is how NAME moves along the first that is free.
    let (k, of_level) = name.strip_prefix('d')?.split_once('_')?;
    let param = free.get(k.parse::<usize>().ok()?)?;
    Some((format!("{}_by_{}", of(of_level)?, param.name()), Shown::Signed))
}

/// An image of the atlas; transparent where nothing is covered.
fn picture(atlas: &Atlas, value: impl Fn(usize) -> [f32; 3]) -> Image {
    let size = atlas.size() as usize;
    let mut image = Image::new(size, size);
    for texel in 0..atlas.covered() {
        let [column, row] = atlas.texel(texel).map(|x| x as usize);
        image.rgb[row * size + column] = value(texel);
        image.alpha[row * size + column] = 1.0;
    }
    image
}

/// Each chart in a colour of its own: hues a golden section apart, so that neighbours in number differ most.
fn picture_of_charts(atlas: &Atlas) -> Image {
    picture(atlas, |texel| {
        let hue = (f64::from(atlas.chart(texel)) * 0.618_033_988_75).fract();
        [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|third| {
            let turn = std::f64::consts::TAU * (hue + third);
            (0.45 + 0.4 * turn.cos()) as f32
        })
    })
}

fn on_screen(image: &Image, shown: Shown) -> Image {
    let largest = image.rgb.iter().flatten().fold(0.0_f32, |most, x| most.max(x.abs()));
    let scale = if largest > 0.0 { 1.0 / largest } else { 0.0 };
    let mut image = image.clone();
    for (rgb, alpha) in image.rgb.iter_mut().zip(&image.alpha) {
        match shown {
            Shown::Light => {}
            Shown::Shares => *rgb = rgb.map(|x| scale * x),
            Shown::Signed => *rgb = rgb.map(|x| alpha * (0.5 + 0.5 * scale * x)),
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_and_how_they_move_have_files_of_their_own() {
        let free = [Param::Occlusion];
        let file = |name: &str| file_of(name, &free).map(|(file, _)| file);
        assert_eq!(file("diffusion_level_0").as_deref(), Some("light_map"));
        assert_eq!(file("diffusion_level_2").as_deref(), Some("level_2"));
        assert_eq!(file("diffusion_stretch").as_deref(), Some("stretch"));
        assert_eq!(file("d0_diffusion_level_0").as_deref(), Some("light_map_by_occlusion"));
        assert_eq!(file("d0_diffusion_level_1").as_deref(), Some("level_1_by_occlusion"));
        for other in ["diffusion_level_1_along_u", "d0_diffusion_level_1_along_u", "d7_diffusion_level_1"] {
            assert_eq!(file(other), None, "{other}");
        }
    }
}

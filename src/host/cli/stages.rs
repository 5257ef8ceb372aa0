//! What texture-space diffusion makes in texels of the UV atlas, as pictures (MODEL 6): files of `skinfit bake --stages`,
//! and a section of a fit's report.

use std::path::Path;

use super::Refusal;
use crate::engine::Unknown;
use crate::engine::cubes_at::CubesAt;
use crate::engine::levels::LevelMaker;
use crate::engine::rules::sample_facts;
use crate::model::params::{Param, Params};
use crate::output;
use crate::prepare::Baked;
use crate::progress::bar;
use crate::render::files::{ImageOptions, write_exr, write_png};
use crate::render::image::Image;
use crate::render::tonemap::ToneMap;
use crate::report::diffusion::{DiffusedScene, Stage};
use crate::report::number;
use crate::samples::Atlas;
use crate::scene::charts;
use crate::scene::mesh::Mesh;
use crate::shader::tangent::chain::Seed;
use skinfit_core::program::lower::Natives;
use skinfit_core::program::shading::{Shading, ShadingError};

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
}

impl Stages {
    /// Make them in texels of `atlas` at `params`, and how they move along each of `free`.
    ///
    /// # Errors
    /// When rules that a level is made by cannot be computed on the processor.
    pub(super) fn new(
        baked: &Baked,
        atlas: &Atlas,
        params: &Params,
        free: &[Param],
    ) -> Result<Self, ShadingError> {
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let facts = sample_facts(baked.setup(), &baked.illumination, true);
        let shading = Shading::new(&facts, &seeds, |_| None, Natives::Written)?;
        let maker = LevelMaker::<f32>::new(shading.levels);
        let made = maker.make(atlas, params, &CubesAt::new(&baked.illumination, params, |x| x)).all();
        let mut pictures = vec![("charts".to_owned(), picture_of_charts(atlas), Shown::Light)];
        for (name, level) in &made {
            let Some((name, shown)) = file_of(name, free) else { continue };
            pictures.push((name, picture(atlas, |texel| level[texel]), shown));
        }
        // What blurs are scaled by comes before them.
        pictures[1..].sort_by_key(|(name, ..)| name != "stretch");
        Ok(Self { pictures })
    }

    /// Write each as an EXR and a PNG file into `folder`, and the charts of the vertices of `mesh`; returns how many there are.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub(super) fn write(&self, folder: &Path, mesh: &Mesh) -> Result<usize, Refusal> {
        let charts = charts::charts(&mesh.positions, mesh.atlas_uvs(), &mesh.triangles);
        let rows = charts.iter().enumerate().map(|(vertex, chart)| format!("{vertex},{chart}\n"));
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

    /// As the report shows them, of the scene that is called `scene`, at `params`.
    pub(super) fn shown(&self, scene: String, params: &Params) -> DiffusedScene {
        let stage = |(name, image, shown): &(String, Image, Shown)| Stage {
            name: name.clone(),
            caption: caption(name, image, params),
            image: on_screen(image, *shown),
        };
        DiffusedScene { name: scene, stages: self.pictures.iter().map(stage).collect() }
    }
}

/// The parameters that are free in a scene's fit and that its effects ask for.
pub(super) fn free_of(baked: &Baked) -> Vec<Param> {
    let mut free: Vec<Param> = Vec::new();
    for unknown in baked.unknowns() {
        let Unknown::Param(column) = unknown else { continue };
        if column.param.asked_for(baked.setup().effects) && !free.contains(&column.param) {
            free.push(column.param);
        }
    }
    free
}

/// What a stage shows, with its unit.
fn caption(name: &str, image: &Image, params: &Params) -> String {
    match name {
        "charts" => "charts: a colour for each".to_owned(),
        "stretch" => {
            let millimetres = params.scalar_named("diffusion_unit") * f64::from(largest(image));
            format!("stretch: red along u, green along v; 1 is {} mm a texel", number(millimetres, 3))
        }
        "light_map" => "light map: linear radiance, before it is blurred".to_owned(),
        "sum" => "sum of the levels by their weights: linear radiance, looked up by pixels".to_owned(),
        _ => match name.strip_prefix("level_").and_then(|k| k.parse::<usize>().ok()) {
            Some(level) => {
                // The variances of blurs of blurs add.
                let variance: f64 =
                    (1..=level).map(|k| params.scalar_named(&format!("diffusion_radius_{k}")).powi(2)).sum();
                let deviation = number(variance.sqrt(), 3);
                format!("level {level}: linear radiance, the light map blurred by {deviation} mm")
            }
            None => name.to_owned(),
        },
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

/// The greatest number of an image, whatever its sign.
fn largest(image: &Image) -> f32 {
    image.rgb.iter().flatten().fold(0.0, |most, x| most.max(x.abs()))
}

fn on_screen(image: &Image, shown: Shown) -> Image {
    let largest = largest(image);
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
    use crate::model::effects::Form;

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

    #[test]
    fn captions_tell_lengths_in_millimetres() {
        skinfit_core::shader::term::library::register_all();
        let mut params = Params::defaults(Form::Corrected);
        let radii = [("diffusion_unit", 50.0), ("diffusion_radius_1", 3.0), ("diffusion_radius_2", 4.0)];
        for (name, value) in radii {
            params.set(Param::from_name(name).unwrap(), value);
        }
        let mut image = Image::new(2, 1);
        // Of a unit of 50 mm.
        image.rgb[1] = [0.25, 0.5, 0.0];
        assert!(caption("stretch", &image, &params).ends_with("; 1 is 25.0 mm a texel"));
        assert!(caption("level_2", &image, &params).ends_with(" by 5.00 mm"));
    }
}

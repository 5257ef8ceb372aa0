//! A fitted map as files: images of where it started, where it is and what changed, and a vertex' numbers as a table.

use std::path::Path;

use crate::bake::VertexOcclusion;
use crate::cli::Refusal;
use crate::cli::bake::occlusion_csv;
use crate::maps::pictures::{change, change_to_see, largest_change, picture};
use crate::maps::problem::read;
use crate::maps::{Grid, Layer};
use crate::output;
use crate::render::files::{ImageOptions, write_exr, write_png, write_png_bytes};
use crate::render::image::Image;
use crate::report::figures::LONGEST;
use crate::report::maps::FittedMap;
use crate::report::pictures::Picture;
use crate::scene::mesh::PosedMesh;

/// A map before and after.
pub(super) struct MapPictures {
    pub(super) name: &'static str,
    pub(super) grid: Grid,
    /// The largest change of one of its numbers.
    pub(super) largest_change: f32,
    /// Where it started and where it is; nothing where there is no plane to draw it in.
    images: Option<[Image; 2]>,
    /// Each vertex' number, where it is one a vertex.
    vertices: Option<Vec<f32>>,
    /// Whether its numbers are a colour to be shown, and not a share.
    colour: bool,
}

impl MapPictures {
    pub(super) fn new(layer: &Layer, mesh: &PosedMesh) -> Result<Self, Refusal> {
        let [_, channels] = layer.start.dims();
        let (start, value) = (read(layer.start.clone())?, read(layer.value.clone())?);
        let flat = matches!(layer.grid, Grid::Vertices(_)) && !mesh.is_unwrapped();
        let images = [&start, &value].map(|numbers| picture(layer.grid, numbers, channels, mesh));
        Ok(Self {
            name: layer.name,
            grid: layer.grid,
            largest_change: largest_change(&start, &value, channels),
            images: (!flat).then_some(images),
            vertices: matches!(layer.grid, Grid::Vertices(_)).then_some(value),
            colour: channels > 1,
        })
    }

    /// The file of the fitted map's image.
    pub(super) fn fitted_file(&self) -> String {
        format!("{}_fitted.exr", self.name)
    }

    /// The file that holds all numbers of the fitted map.
    pub(super) fn exact_file(&self) -> String {
        if self.vertices.is_some() { format!("{}_fitted.csv", self.name) } else { self.fitted_file() }
    }

    /// Write `<name>_initial.png` and so on into `folder`; returns the files' names.
    pub(super) fn write(&self, folder: &Path) -> Result<Vec<String>, Refusal> {
        let mut files = Vec::new();
        if let Some(vertices) = &self.vertices {
            files.push(self.exact_file());
            let fitted = VertexOcclusion { base: vertices.clone(), morphs: Vec::new() };
            output::write(&folder.join(self.exact_file()), occlusion_csv(&fitted).as_bytes())?;
        }
        let Some([initial, fitted]) = &self.images else { return Ok(files) };
        let change = change(initial, fitted);
        let seen = change_to_see(&change, self.largest_change);
        let options = ImageOptions::default();
        for (what, exact, seen, colour) in [
            ("initial", initial, initial, self.colour),
            ("fitted", fitted, fitted, self.colour),
            ("change", &change, &seen, false),
        ] {
            let [exr, png] = ["exr", "png"].map(|ending| format!("{}_{what}.{ending}", self.name));
            write_exr(&folder.join(&exr), exact, &options)?;
            if colour {
                write_png(&folder.join(&png), seen, options.tone, 0.0)?;
            } else {
                let Picture { width, height, bytes } = of_shares(seen);
                write_png_bytes(&folder.join(&png), width, height, &bytes)?;
            }
            files.extend([exr, png]);
        }
        Ok(files)
    }

    /// For the report.
    pub(super) fn evidence(&self) -> FittedMap {
        let pictures = self.images.as_ref().map(|[initial, fitted]| {
            let small = |image: &Image| image.shrunk(LONGEST);
            let seen =
                |image| if self.colour { Picture::of_image(&small(image)) } else { of_shares(&small(image)) };
            let change = change_to_see(&change(initial, fitted), self.largest_change);
            [seen(initial), seen(fitted), of_shares(&small(&change))]
        });
        FittedMap { name: self.name.to_owned(), largest_change: self.largest_change, pictures }
    }
}

/// Numbers from 0 to 1 as they are, black to white.
fn of_shares(image: &Image) -> Picture {
    let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let bytes = image.rgb.iter().flat_map(|rgb| rgb.map(byte)).collect();
    Picture { width: image.width, height: image.height, bytes }
}

//! `skinfit bake`: the cubes that were baked, as files.

use std::borrow::Cow;
use std::path::Path;

use super::super::{Refusal, tell_warnings};
use crate::bake::Illumination;
use crate::bake::stacks::Stack;
use crate::export::cubes::{CubeFormat, LARGEST_HALF, write_cubes};
use crate::model::cube::Cube;
use crate::render::files::{ImageOptions, write_image};
use crate::render::image::Image;
use crate::scene::{Scene, short, suggestion};

/// A kind of file that cubes are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A column of the faces, as EXR and as PNG.
    Pictures,
    /// A texture that an engine takes.
    Texture(CubeFormat),
}

/// What the pictures' kind is called.
const EXR: &str = "exr";

/// The kind of that name.
pub(super) fn parse_kind(name: &str) -> Result<Kind, String> {
    let known: Vec<&str> = std::iter::once(EXR).chain(CubeFormat::ALL.map(CubeFormat::name)).collect();
    match name {
        EXR => Ok(Kind::Pictures),
        _ => CubeFormat::from_name(name)
            .map(Kind::Texture)
            .ok_or_else(|| format!("unknown kind of file. {}.", suggestion(name, &known))),
    }
}

/// Cubes of one file, by its name without an ending.
pub(super) struct Named<'a> {
    name: String,
    /// One, or those of a stack in their order.
    cubes: Vec<Cow<'a, Cube<f32>>>,
    /// What each of a stack stands at, by the name that a KTX2 file has for it.
    places: Option<(&'static str, Vec<f64>)>,
}

/// The cubes that were baked.
pub(super) fn baked<'a>(light: &'a Illumination, scene: &Scene) -> Vec<Named<'a>> {
    let mut cubes = Vec::new();
    let mut add =
        |name: &str, cube| cubes.push(Named { name: name.to_owned(), cubes: vec![cube], places: None });
    if let Some(irradiance) = &light.irradiance {
        add("irradiance", Cow::Borrowed(irradiance));
    }
    // Between a stack's cubes, what shaders look up is none of them.
    let at = |stack: Stack| stack.at(light, stack.place(&scene.params)).map(|(cube, _)| Cow::Owned(cube));
    if let Some(lobes) = &light.lobes {
        for (exponent, lobe) in lobes.exponents.iter().zip(&lobes.cubes) {
            add(&format!("lobe_{exponent}"), Cow::Borrowed(lobe));
        }
        if let Some(specular) = at(Stack::Specular).filter(|_| lobes.cubes.len() > 1) {
            add("specular", specular);
        }
    }
    if let Some(hilite) = &light.hilite {
        add("hilite", Cow::Borrowed(hilite));
    }
    if light.reflected.is_some() {
        let glossy = scene.setup().choices.glossy;
        let looked_up = [("reflected", Stack::Reflected, true), ("glossy", Stack::Glossy, glossy)];
        for (name, stack, asked_for) in looked_up {
            if let Some(cube) = at(stack).filter(|_| asked_for) {
                add(name, cube);
            }
        }
    }
    cubes.extend(stacks(light));
    cubes
}

/// Stacks of several cubes, as engines have arrays of them.
fn stacks(light: &Illumination) -> Vec<Named<'_>> {
    let lobes = light
        .lobes
        .as_ref()
        .map(|stack| ("lobe_stack", stack, ("skinfitExponents", stack.exponents.clone())));
    let reflected = light
        .reflected
        .as_ref()
        .map(|of| ("reflected_stack", &of.stack, ("skinfitRoughnesses", of.roughnesses())));
    let several = [lobes, reflected].into_iter().flatten().filter(|(_, stack, _)| stack.cubes.len() > 1);
    several
        .map(|(name, stack, places)| Named {
            name: name.to_owned(),
            cubes: stack.cubes.iter().map(Cow::Borrowed).collect(),
            places: Some(places),
        })
        .collect()
}

impl Named<'_> {
    /// Whether there is a file of it among these kinds: pictures hold one cube.
    pub(super) fn is_written(&self, kinds: &[Kind]) -> bool {
        kinds.iter().any(|kind| *kind != Kind::Pictures || self.cubes.len() == 1)
    }

    /// Write it into `folder` as each of the kinds.
    pub(super) fn write(&self, folder: &Path, kinds: &[Kind]) -> Result<(), Refusal> {
        for kind in kinds {
            match (kind, self.cubes.as_slice()) {
                (Kind::Pictures, [cube]) => write_pictures(folder, &self.name, cube)?,
                (Kind::Pictures, _) => {}
                (Kind::Texture(format), _) => self.write_texture(folder, *format)?,
            }
        }
        Ok(())
    }

    fn write_texture(&self, folder: &Path, format: CubeFormat) -> Result<(), Refusal> {
        let path = folder.join(format!("{}.{}", self.name, format.name()));
        let cubes: Vec<&Cube<f32>> = self.cubes.iter().map(AsRef::as_ref).collect();
        let words = |places: &[f64]| places.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let notes: Vec<(&str, String)> =
            self.places.iter().map(|(name, places)| (*name, words(places))).collect();
        let clamped = write_cubes(&path, format, &cubes, &notes)?;
        if clamped > 0 {
            tell_warnings(&[format!(
                "{}: {clamped} numbers are beyond what half floats hold and are written as {}. With --cubes exr \
                 they are kept.",
                path.display(),
                short(f64::from(LARGEST_HALF))
            )]);
        }
        Ok(())
    }
}

/// The faces below each other, as EXR and as PNG.
fn write_pictures(folder: &Path, name: &str, cube: &Cube<f32>) -> Result<(), Refusal> {
    let size = cube.size();
    let mut image = Image::new(size, 6 * size);
    for (at, (rgb, alpha)) in image.rgb.iter_mut().zip(&mut image.alpha).enumerate() {
        let [r, g, b, _] = cube.texel(at / (size * size), at % size, at / size % size);
        *rgb = [r, g, b];
        *alpha = 1.0;
    }
    for ending in ["exr", "png"] {
        write_image(&folder.join(format!("{name}.{ending}")), &image, &ImageOptions::default())?;
    }
    Ok(())
}

//! The scenes of a study, each on its bench, and what the study's fits leave out of them.

use std::path::{Path, PathBuf};

use super::bench::{Bench, Rates};
use super::settings::Settings;
use crate::StudyError;
use crate::prepare::{NamedScene, PrepareError, PrepareOptions, read_one_skin, view_of};
use crate::reference::Difference;
use crate::render::image::Image;
use crate::subject::{SampledScene, Subject};

/// Scenes of one skin, to be evaluated at any settings.
pub struct Benches<'a> {
    /// A bench each: one at the least.
    pub scenes: Vec<Bench<'a>>,
    /// Which of each scene's views fits leave out.
    marks: Vec<Vec<bool>>,
}

impl<'a> Benches<'a> {
    /// Load, bake and sample the scenes as they stand; several have to be one skin. What `hold_out` names is left out of
    /// fits.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn new(
        paths: &'a [PathBuf],
        params: Option<&'a Path>,
        cache: Option<&Path>,
        hold_out: &[String],
    ) -> Result<Self, StudyError> {
        let options = PrepareOptions {
            fit: true,
            params: params.map(Path::to_owned),
            cache: cache.map(Path::to_owned),
            ..PrepareOptions::default()
        };
        let scenes = read_one_skin(paths, &options, |_| {})?;
        let marks = NamedScene::marked(&scenes, hold_out).map_err(PrepareError::from)?;
        let bench = |(path, scene): (&'a PathBuf, NamedScene)| Bench::of(path, scene, params, cache);
        let mut scenes = paths.iter().zip(scenes).map(bench).collect::<Result<Vec<_>, _>>()?;
        let all: Vec<Settings> = scenes.iter().map(Bench::settings).collect();
        scenes.iter_mut().for_each(|bench| bench.all.clone_from(&all));
        if scenes.is_empty() {
            return Err(PrepareError::NoScene.into());
        }
        Ok(Self { scenes, marks })
    }

    /// The first scene.
    #[must_use]
    pub fn first(&self) -> &Bench<'a> {
        &self.scenes[0]
    }

    /// The scenes' names, where there are several.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let several = self.scenes.len() > 1;
        self.scenes.iter().filter(|_| several).map(|bench| bench.name.clone()).collect()
    }

    /// What the sweeps of each scene are made of, measured.
    ///
    /// # Errors
    /// When a stage fails.
    pub fn rates(&self) -> Result<Vec<Rates>, StudyError> {
        self.scenes.iter().map(Bench::rates).collect()
    }

    /// The scenes at their own start values, to be fitted but for what is held out.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn to_fit(&self) -> Result<Subject, StudyError> {
        let sampled = self.scenes.iter().zip(&self.marks).map(|(bench, marks)| bench.to_fit(marks));
        Subject::of(sampled.collect::<Result<Vec<SampledScene>, _>>()?, None)
    }

    /// The views that fits leave out, by their names in reports.
    #[must_use]
    pub fn held_out(&self) -> Vec<String> {
        let several = self.scenes.len() > 1;
        let of = |(bench, marks): (&Bench<'_>, &Vec<bool>)| -> Vec<String> {
            let views = bench.baked.scene.views.iter().zip(marks).filter(|(_, marked)| **marked);
            views
                .map(|(view, _)| if several { view_of(&bench.name, &view.name) } else { view.name.clone() })
                .collect()
        };
        self.scenes.iter().zip(&self.marks).flat_map(of).collect()
    }

    /// The images of each scene with `change` in the place of its own settings, at its constants.
    ///
    /// # Errors
    /// When a stage fails.
    pub fn images(&self, change: &dyn Fn(Settings) -> Settings) -> Result<Vec<Vec<Image>>, StudyError> {
        let of = |bench: &Bench<'_>| bench.evaluate(change(bench.settings()))?.images(&bench.point());
        self.scenes.iter().map(of).collect()
    }
}

/// How far the images of some scenes are from the references, over all views.
#[must_use]
pub fn difference(references: &[Vec<Image>], images: &[Vec<Image>]) -> Difference {
    let scenes = references.iter().zip(images);
    Difference::pooled(scenes.map(|(references, images)| Difference::of_all(references, images)))
}

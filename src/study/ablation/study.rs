//! What all cases share, and one case after the other evaluated with it.

use std::path::PathBuf;

use super::AblationOptions;
use super::case::Case;
use super::measure::Clocks;
use super::refit::{Starts, refit};
use super::row::{Before, Compared, Constant, HeldOutRow, Row};
use crate::StudyError;
use crate::cost::Counts;
use crate::engine::view::ObservedView;
use crate::engine::{Objective, Point, Unknown, rounding};
use crate::fit::outcome::Outcome;
use crate::model::effects::Effects;
use crate::prepare::{JointScene, Loaded, NamedScene, PrepareOptions};
use crate::reference::{ReferenceView, ViewErrors};
use crate::render::image::Image;
use crate::scene::Loss;
use crate::scene::view::View;
use crate::subject::{SampledScene, Subject};

/// A scene of which parts are left out.
pub(super) struct Place {
    pub(super) name: String,
    pub(super) path: PathBuf,
    /// Which of its views are held out.
    pub(super) marked: Vec<bool>,
    /// What it has on as a whole.
    pub(super) effects: Effects,
}

impl Place {
    /// A scene as it was read.
    pub(super) fn of(scene: &NamedScene, marked: Vec<bool>) -> Self {
        let NamedScene { name, loaded: Loaded { scene, .. } } = scene;
        Self { name: name.clone(), path: scene.path.clone(), marked, effects: scene.effects }
    }
}

/// What all cases share.
pub(super) struct Study<'a> {
    pub(super) places: Vec<Place>,
    pub(super) prepare: PrepareOptions,
    pub(super) options: &'a AblationOptions,
    pub(super) loss: Loss,
    /// What the views that are fitted are compared with.
    pub(super) references: Vec<ReferenceView>,
    /// What those that are held out are compared with.
    pub(super) held_out: Vec<ReferenceView>,
    /// The whole model's images, where they are the reference.
    pub(super) made: Option<Vec<Image>>,
    /// The whole model's constants.
    pub(super) point: &'a Point,
    /// The whole model's constants as each scene has them.
    pub(super) points: Vec<Point>,
    /// Where a fit of the scenes starts.
    pub(super) own: &'a Point,
}

/// The references of the views that are fitted of `whole`, and of those that are held out.
pub(super) fn references(whole: &Subject) -> [Vec<ReferenceView>; 2] {
    let scenes = &whole.scenes;
    let of = |part: &JointScene, views: &[View], observed: &[ObservedView]| -> Vec<ReferenceView> {
        let views = views.iter().zip(observed);
        views
            .map(|(view, observed)| {
                let mut reference = ReferenceView::new(view, observed);
                reference.name = scenes.view_name(part, &view.name);
                reference
            })
            .collect()
    };
    let fitted = |part: &JointScene| of(part, &part.baked.scene.views, scenes.views(part));
    let held = |part: &JointScene| of(part, &part.held.views, &part.held.observed);
    [scenes.parts.iter().flat_map(fitted).collect(), scenes.parts.iter().flat_map(held).collect()]
}

/// What roundings of 32-bit numbers may leave of the squares of what is held out, as [`Objective::rounding`] says of what is
/// fitted.
fn held_out_rounding(whole: &Subject, loss: Loss) -> f64 {
    whole.scenes.parts.iter().map(|part| rounding(&part.held.observed, loss, 1)).sum()
}

impl Study<'_> {
    fn errors(references: &[ReferenceView], images: &[Image], loss: Loss) -> Vec<ViewErrors> {
        references.iter().zip(images).map(|(reference, image)| reference.errors(image, loss)).collect()
    }

    /// What a subject makes of the views at `point`: those that are fitted, then those that are held out.
    pub(super) fn compare(&self, subject: &Subject, point: &Point) -> Result<[Compared; 2], StudyError> {
        let (images, held) = (subject.images(point)?, subject.held_out_images(point)?);
        let errors = Self::errors(&self.references, &images, self.loss);
        let held_errors = Self::errors(&self.held_out, &held, self.loss);
        Ok([Compared { images, errors }, Compared { images: held, errors: held_errors }])
    }

    /// The whole model, as cases are compared with it.
    pub(super) fn before(&self, whole: &Subject, [fitted, held]: &[Compared; 2]) -> [Before; 2] {
        let names = |references: &[ReferenceView]| {
            references.iter().map(|reference| reference.name.clone()).collect()
        };
        let of_fitted = whole.scenes.joint.rounding();
        [
            Before::new(names(&self.references), &fitted.errors, of_fitted),
            Before::new(names(&self.held_out), &held.errors, held_out_rounding(whole, self.loss)),
        ]
    }

    /// The scenes without what a case leaves out, fitted again where that is asked for; `None` where a scene does not let go
    /// of it, as a mesh that it poses stays posed.
    pub(super) fn evaluate(&self, case: Case) -> Result<Option<(Subject, Evaluated)>, StudyError> {
        let mut scenes = Vec::new();
        for (place, whole) in self.places.iter().zip(&self.points) {
            let effects = case.effects(place.effects);
            let prepare = PrepareOptions { effects: Some(effects), ..self.prepare.clone() };
            let mut loaded = Loaded::read(&place.path, &prepare)?;
            if loaded.scene.effects != effects {
                return Ok(None);
            }
            // What is fitted starts where the whole model ended.
            let scene = &mut loaded.scene;
            scene.params = whole.params.clone();
            case.apply(effects, &mut scene.params, &mut scene.fit.free);
            scenes.push(SampledScene::new(place.name.clone(), loaded, &place.marked)?);
        }
        let subject = Subject::of(scenes, self.made.as_deref())?;
        let from_whole = Point { gains: self.point.gains.clone(), ..subject.scenes.start.clone() };
        let (outcome, starts) = if self.options.refit {
            let mut own = self.own.clone();
            case.apply(Effects::default(), &mut own.params, &mut Vec::new());
            Some(refit(&subject, Some(&from_whole), &own)?).unzip()
        } else {
            (None, None)
        };
        let point = outcome.as_ref().map_or(from_whole, |outcome| outcome.end.clone());
        let compared = self.compare(&subject, &point)?;
        Ok(Some((subject, Evaluated { case, compared, point, outcome, starts })))
    }
}

/// A case's images and how far they are off.
pub(super) struct Evaluated {
    pub(super) case: Case,
    /// Of the views that are fitted, and of those that are held out.
    pub(super) compared: [Compared; 2],
    pub(super) point: Point,
    pub(super) outcome: Option<Outcome>,
    pub(super) starts: Option<Starts>,
}

impl Evaluated {
    /// Its row beside the whole model, whose mean PSNR over what is held out is `psnr`.
    pub(super) fn row(
        self,
        subject: &Subject,
        clocks: &Clocks,
        [before, held_before]: &[Before; 2],
        psnr: Option<f64>,
    ) -> Result<Row, StudyError> {
        let (cpu, gpu) = clocks.time(subject, &self.point)?;
        let keep = self.case.left_out.len() < 2;
        let [fitted, held] = &self.compared;
        let (loss, change, views) = fitted.beside(before, keep);
        let held_out = (!held_before.names.is_empty()).then(|| {
            let (loss, change, views) = held.beside(held_before, keep);
            let row = HeldOutRow { loss, change, psnr: None, psnr_change: None, views };
            let own = row.mean().psnr;
            // The whole model's own is none from itself.
            let psnr_change = own.zip(psnr.or(own)).map(|(own, whole)| own - whole);
            HeldOutRow { psnr: own, psnr_change, ..row }
        });
        Ok(Row {
            loss,
            change,
            views,
            held_out,
            counts: Counts::new(subject, &self.point)?,
            cpu: Some(cpu),
            gpu,
            constants: constants(subject, &self.point, self.outcome.as_ref()),
            ending: self.outcome.map(|outcome| outcome.ending),
            starts: self.starts,
            left_out: self.case,
        })
    }
}

/// What is free, its value and its error.
fn constants(subject: &Subject, point: &Point, outcome: Option<&Outcome>) -> Vec<Constant> {
    let error = |unknown: &Unknown| {
        let known = outcome?.unknowns.iter().find(|known| known.unknown == *unknown)?;
        known.std_error
    };
    let constant = |unknown: &Unknown| Constant {
        value: unknown.get(point),
        std_error: error(unknown),
        name: subject.scenes.label(&unknown.name()),
    };
    subject.scenes.joint.unknowns().iter().map(constant).collect()
}

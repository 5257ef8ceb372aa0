//! Scenes of different light, fitted as one skin.
//!
//! Each scene has an engine of its own, with its mesh, maps, light and views. What belongs to the skin is one unknown for
//! all of them; what belongs to a scene ([`Owner::Scene`](crate::model::params::Owner)) and the gains of its views are
//! unknowns of its own. Loss, gradient and normal equations are sums over all weighted samples and channels of all
//! scenes: standard errors, sandwiches and undetermined directions follow from them as of one scene.

use std::ops::Range;

use super::pulls::{Pulls, Tile};
use super::{Engine, NormalEquations, Objective, Point, Unknown};
use crate::model::params::Param;

/// What is free of the skin differs between two scenes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "scenes that are fitted as one skin have to leave the same of it free: {unknown} is free in one of the scenes 0 and \
     {scene}, counted from 0, and not in the other. Make it free in both, or in none."
)]
pub struct JointError {
    /// The scene that differs from the first.
    pub scene: usize,
    /// What is free in one of them alone.
    pub unknown: String,
}

/// What an unknown is called for people, by its [`Unknown::name`]: a gain by its view and not by the view's number, and what
/// a scene has of its own by the scene.
#[must_use]
pub fn label(
    name: &str,
    scene: impl FnOnce(usize) -> Option<String>,
    view: impl FnOnce(usize) -> Option<String>,
) -> String {
    let number = |text: &str| text.parse::<usize>().ok();
    if let Some(of_view) = name.strip_prefix("gain.") {
        let (at, channel) =
            of_view.split_once('.').map_or((of_view, ""), |(at, _)| (at, &of_view[at.len()..]));
        if let Some(view) = number(at).and_then(view) {
            return format!("gain.{view}{channel}");
        }
    }
    let own = name.split_once('/').and_then(|(at, own)| Some((scene(number(at)?)?, own)));
    own.map_or_else(|| name.to_owned(), |(scene, own)| format!("{scene}/{own}"))
}

/// The engines of several scenes as one objective.
pub struct Joint {
    scenes: Vec<Part>,
    unknowns: Vec<Unknown>,
}

/// A scene's part of it.
struct Part {
    engine: Box<dyn Engine>,
    /// Where each of its engine's unknowns stands among all.
    places: Vec<usize>,
    /// Its views among those of all scenes.
    views: Range<usize>,
    /// Its share of all residuals' weight.
    share: f64,
}

impl Joint {
    /// The scenes that these engines are over. The skin's unknowns stand as in the first scene, then each scene's own, then
    /// the gains; of a single scene the unknowns and all numbers are its engine's.
    ///
    /// # Errors
    /// When what is free of the skin differs from scene to scene.
    pub fn new(engines: Vec<Box<dyn Engine>>) -> Result<Self, JointError> {
        let several = engines.len() > 1;
        let mut views = 0;
        let mut of_scenes: Vec<Vec<Unknown>> = Vec::new();
        for (scene, engine) in engines.iter().enumerate() {
            let joint = |unknown: &Unknown| match *unknown {
                Unknown::Param(column) if several && column.param.is_of_scene() => {
                    Unknown::Own(scene, column)
                }
                Unknown::Gain(view, channels) => Unknown::Gain(views + view, channels),
                other => other,
            };
            of_scenes.push(engine.unknowns().iter().map(joint).collect());
            views += engine.views().len();
        }
        check(&of_scenes)?;
        // A view's gain, a scene's own: in the order of what is shared, then of the scenes.
        let rank = |unknown: &Unknown| match unknown {
            Unknown::Param(_) => 0,
            Unknown::Own(..) => 1,
            Unknown::Gain(..) => 2,
        };
        let mut unknowns: Vec<Unknown> = Vec::new();
        for unknown in of_scenes.iter().flatten() {
            if !unknowns.contains(unknown) {
                unknowns.push(*unknown);
            }
        }
        unknowns.sort_by_key(rank);
        let place = |unknown: &Unknown| unknowns.iter().position(|other| other == unknown);
        let mut first = 0;
        let part = |(engine, own): (Box<dyn Engine>, Vec<Unknown>)| {
            let views = first..first + engine.views().len();
            first = views.end;
            Part { places: own.iter().filter_map(place).collect(), views, share: 0.0, engine }
        };
        let scenes = engines.into_iter().zip(of_scenes).map(part).collect();
        let mut joint = Self { scenes, unknowns };
        joint.weigh();
        Ok(joint)
    }

    /// Let each pass read only every `stride`-th block of pixels of each scene.
    pub fn set_stride(&mut self, stride: usize) {
        self.scenes.iter_mut().for_each(|part| part.engine.set_stride(stride));
        self.weigh();
    }

    /// Find each scene's share of the weight.
    fn weigh(&mut self) {
        let weight: f64 = self.scenes.iter().map(|part| part.engine.weight()).sum();
        for part in &mut self.scenes {
            part.share = if weight > 0.0 { part.engine.weight() / weight } else { 0.0 };
        }
    }

    /// Where the fit of all of them starts, from where each scene's would: the skin starts as in the first one.
    #[must_use]
    pub fn start(points: &[Point]) -> Option<Point> {
        let mut start = points.first()?.clone();
        start.gains = points.iter().flat_map(|point| point.gains.iter().copied()).collect();
        if points.len() > 1 {
            for (scene, point) in points.iter().enumerate() {
                for param in Param::all().filter(|param| param.is_of_scene()) {
                    start.params.set_rgb_in(scene, param, point.params.rgb(param));
                }
            }
        }
        Some(start)
    }

    /// The engines, a scene each.
    pub fn engines(&self) -> impl ExactSizeIterator<Item = &dyn Engine> {
        self.scenes.iter().map(|part| &*part.engine)
    }

    /// Where a scene stands at a joint point.
    #[must_use]
    pub fn point_in(&self, scene: usize, point: &Point) -> Option<Point> {
        Some(self.scenes.get(scene)?.point(scene, point))
    }

    /// Each scene, with where it stands at `point`.
    fn at<'a>(&'a self, point: &'a Point) -> impl Iterator<Item = (&'a Part, Point)> {
        self.scenes.iter().enumerate().map(move |(scene, part)| (part, part.point(scene, point)))
    }
}

impl Part {
    fn point(&self, scene: usize, point: &Point) -> Point {
        let gains = point.gains.get(self.views.clone()).unwrap_or_default();
        Point { params: point.params.in_scene(scene), gains: gains.to_vec() }
    }
}

/// That all scenes leave the same of the skin free.
fn check(of_scenes: &[Vec<Unknown>]) -> Result<(), JointError> {
    let skin = |unknown: &&Unknown| matches!(unknown, Unknown::Param(_));
    let Some((first, others)) = of_scenes.split_first() else { return Ok(()) };
    for (scene, own) in (1..).zip(others) {
        let missing = first.iter().filter(skin).find(|unknown| !own.contains(unknown));
        let added = own.iter().filter(skin).find(|unknown| !first.contains(unknown));
        if let Some(unknown) = missing.or(added) {
            return Err(JointError { scene, unknown: unknown.name() });
        }
    }
    Ok(())
}

impl Objective for Joint {
    fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    fn is_quadratic(&self) -> bool {
        self.scenes.iter().all(|part| part.engine.is_quadratic())
    }

    fn rounding(&self) -> f64 {
        self.scenes.iter().map(|part| part.engine.rounding()).sum()
    }

    fn fault(&self) -> Option<String> {
        self.scenes.iter().find_map(|part| part.engine.fault())
    }

    fn pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        let mut all = Pulls::default();
        for (part, own) in self.at(point) {
            let Pulls { residuals, tiles } = part.engine.pulls(&own, widths.get(part.views.clone())?)?;
            all.residuals.extend(residuals);
            all.tiles.extend(tiles.into_iter().map(|tile| {
                let mut pull = vec![0.0; self.unknowns.len()];
                part.places.iter().zip(tile.pull).for_each(|(&place, x)| pull[place] = x);
                Tile { view: part.views.start + tile.view, pull, ..tile }
            }));
        }
        Some(all)
    }

    fn normal_equations(&self, point: &Point) -> NormalEquations {
        let k = self.unknowns.len();
        let (jtr, jtj) = (vec![0.0; k], vec![0.0; k * k]);
        let mut all = NormalEquations { loss: 0.0, residual: 0.0, weight: 0.0, count: 0, jtr, jtj };
        for (part, own) in self.at(point) {
            let of_scene = part.engine.normal_equations(&own);
            all.loss += part.share * of_scene.loss;
            all.residual += of_scene.residual;
            all.weight += of_scene.weight;
            all.count += of_scene.count;
            let n = part.places.len();
            for (i, &row) in part.places.iter().enumerate() {
                all.jtr[row] += of_scene.jtr[i];
                for (j, &column) in part.places.iter().enumerate() {
                    all.jtj[row * k + column] += of_scene.jtj[i * n + j];
                }
            }
        }
        all
    }

    fn loss(&self, point: &Point) -> f64 {
        self.at(point).map(|(part, own)| part.share * part.engine.loss(&own)).sum()
    }

    fn gradient(&self, point: &Point) -> (f64, Vec<f64>) {
        let mut all = (0.0, vec![0.0; self.unknowns.len()]);
        for (part, own) in self.at(point) {
            let (loss, gradient) = part.engine.gradient(&own);
            all.0 += part.share * loss;
            part.places.iter().zip(gradient).for_each(|(&place, g)| all.1[place] += part.share * g);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_are_called_by_their_views() {
        let called = |name: &str| {
            label(name, |scene| Some(format!("s{scene}")), |view| (view < 3).then(|| format!("a.{view}")))
        };
        let labels = ["gain.2", "gain.2.r", "gain.7.r", "1/hilite.g", "hilite.g"].map(called);
        assert_eq!(labels, ["gain.a.2", "gain.a.2.r", "gain.7.r", "s1/hilite.g", "hilite.g"]);
    }
}

//! Which view of which scene is looked at.

use super::{Orbit, Session};
use crate::host::ViewScore;
use crate::prepare::view_of;
use crate::scene::view::{Camera, View};

/// A view of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Its name: of several scenes after its scene's.
    pub name: String,
    /// The scene's number.
    pub scene: usize,
    /// Its number in the scene.
    pub view: usize,
    /// Whether there is a target to fit.
    pub target: bool,
    /// Whether a fit is to see it.
    pub fitted: bool,
}

impl Session {
    /// Every view of every scene, in their order.
    #[must_use]
    pub fn places(&self) -> Vec<Place> {
        let Some(history) = &self.values else { return Vec::new() };
        let scenes = self.scenes.iter().zip(history.now().scenes()).enumerate();
        let places = scenes.flat_map(|(scene, (opened, values))| {
            opened.views().iter().enumerate().map(move |(i, view)| Place {
                name: self.view_name(scene, &view.name),
                scene,
                view: i,
                target: view.target.is_some(),
                fitted: view.target.is_some() && !values.hold_out.contains(&view.name),
            })
        });
        places.collect()
    }

    /// Which of these is looked at.
    #[must_use]
    pub fn at(&self) -> usize {
        let before = self.scenes.iter().take(self.at.0).map(|opened| opened.views().len());
        before.sum::<usize>() + self.at.1
    }

    /// Look at another.
    pub fn look_at(&mut self, place: usize) {
        let places = self.places();
        if let Some(place) = places.get(place).or_else(|| places.last()) {
            self.at = (place.scene, place.view);
        }
    }

    /// Look at the next one, after the last at the first.
    pub fn look_at_next(&mut self) {
        self.look_at((self.at() + 1) % self.places().len().max(1));
    }

    /// Look at the last scene or view where the one looked at is gone.
    pub(super) fn stay_within(&mut self) {
        let scene = self.at.0.min(self.scenes.len().saturating_sub(1));
        let most = self.scenes.get(scene).map_or(0, |opened| opened.views().len().saturating_sub(1));
        self.at = (scene, self.at.1.min(most));
    }

    /// The view that is looked at.
    #[must_use]
    pub fn view(&self) -> Option<&View> {
        self.opened()?.views().get(self.at.1)
    }

    /// Its number in its scene.
    #[must_use]
    pub const fn view_number(&self) -> usize {
        self.at.1
    }

    /// What a scene's view is called: of several scenes after its scene.
    #[must_use]
    pub fn view_name(&self, scene: usize, view: &str) -> String {
        match self.scenes.get(scene).filter(|_| self.scenes.len() > 1) {
            Some(opened) => view_of(&opened.name, view),
            None => view.to_owned(),
        }
    }

    /// Scores in the order of the views.
    pub(super) fn in_order(&self, mut scores: Vec<ViewScore>) -> Vec<ViewScore> {
        let names: Vec<String> = (self.scenes.iter().enumerate())
            .flat_map(|(scene, opened)| {
                opened.views().iter().map(move |view| self.view_name(scene, &view.name))
            })
            .collect();
        let place = |score: &ViewScore| names.iter().position(|name| *name == score.view);
        scores.sort_by_key(|score| place(score).unwrap_or(usize::MAX));
        scores
    }

    /// The camera that images are seen from.
    #[must_use]
    pub fn camera(&self) -> Option<Camera> {
        let centre = self.opened()?.extent.0;
        Some(self.orbit.turned(&self.view()?.camera, centre))
    }

    /// Whether images are seen from the view's own camera.
    #[must_use]
    pub fn is_at_home(&self) -> bool {
        self.orbit == Orbit::default()
    }
}

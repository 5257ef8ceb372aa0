//! The values of several scenes that share one skin: what one edits in a scene holds in the others as far as it is the
//! skin's.

use std::path::Path;

use crate::engine::Point;
use crate::fit::params_file::{Origin, ParamsFile, SceneValues};
use crate::model::effects::Effects;
use crate::model::params::{Column, Param};
use crate::opened::Opened;
use crate::values::Values;

/// Each scene's values, in their order; one of them at the least.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin(Vec<Values>);

impl Skin {
    /// The scenes' own, which share one skin: they were read so.
    #[must_use]
    pub fn of<'a>(scenes: impl IntoIterator<Item = &'a Opened>) -> Self {
        Self(scenes.into_iter().map(|opened| Values::of(&opened.baked)).collect())
    }

    /// Those of a scene.
    #[must_use]
    pub fn in_scene(&self, scene: usize) -> &Values {
        &self.0[scene]
    }

    /// Those of every scene.
    #[must_use]
    pub fn scenes(&self) -> &[Values] {
        &self.0
    }

    /// Change those of a scene.
    pub fn change(&mut self, scene: usize, change: impl FnOnce(&mut Values)) {
        change(&mut self.0[scene]);
        self.0[scene].untie();
        let (before, rest) = self.0.split_at_mut(scene);
        if let Some((changed, after)) = rest.split_first_mut() {
            before.iter_mut().chain(after).for_each(|other| share(changed, other));
        }
    }

    /// Take the effects that scenes have brought along when they were read with those that were `asked` for: what was
    /// switched in the meantime is read next.
    pub fn bring_effects(&mut self, asked: &[Option<Effects>], brought: impl IntoIterator<Item = Effects>) {
        for ((values, brought), asked) in self.0.iter_mut().zip(brought).zip(asked) {
            if asked.is_none_or(|asked| asked == values.effects) {
                values.effects = brought;
            }
        }
    }

    /// Go back to the effects that the scenes were read with.
    pub fn set_effects<'a>(&mut self, scenes: impl IntoIterator<Item = &'a Opened>) {
        for (values, opened) in self.0.iter_mut().zip(scenes) {
            values.effects = opened.baked.scene.effects;
        }
    }

    /// Whether every scene was read with these effects.
    #[must_use]
    pub fn is_read<'a>(&self, scenes: impl IntoIterator<Item = &'a Opened>) -> bool {
        let read = |(values, opened): (&Values, &Opened)| values.effects == opened.baked.scene.effects;
        self.0.iter().zip(scenes).all(read)
    }

    /// Take where a fit stands in each scene.
    pub fn take<'a>(&mut self, points: &[Point], scenes: impl IntoIterator<Item = &'a Opened>) {
        for ((values, point), opened) in self.0.iter_mut().zip(points).zip(scenes) {
            values.take(point, opened.views());
        }
    }

    /// Constants and gains of each scene.
    #[must_use]
    pub fn points(&self) -> Vec<Point> {
        self.0.iter().map(Values::point).collect()
    }

    /// The same, as they are given.
    pub fn set_points(&mut self, points: &[Point]) {
        for (values, point) in self.0.iter_mut().zip(points) {
            (values.params, values.gains) = (point.params.clone(), point.gains.clone());
            values.untie();
        }
    }
}

/// These values as the text of a `params.toml`: of several scenes with what each has of its own. With `all` also what the
/// scenes themselves give elsewhere, as the directions of lights that are not free.
#[must_use]
pub fn params_text(values: &[Values], scenes: &[&Opened], from: &str, all: bool) -> Option<String> {
    let (first, several) = (values.first()?, values.len() > 1);
    let gains = |(values, opened): (&Values, &&Opened)| {
        let names = opened.views().iter().map(|view| view.name.clone());
        names.zip(values.gains.iter().copied()).collect::<Vec<_>>()
    };
    let own = |(values, opened): (&Values, &&Opened)| SceneValues {
        name: opened.name.clone(),
        effects: Some(values.effects).filter(|effects| *effects != first.effects),
        params: own_params(values, all),
        gains: gains((values, opened)),
    };
    let both = values.iter().zip(scenes);
    let file = ParamsFile {
        form: first.form,
        effects: Some(first.effects),
        loss: None,
        params: first.params.clone(),
        gains: if several { Vec::new() } else { both.clone().flat_map(gains).collect() },
        scenes: if several { both.map(own).collect() } else { Vec::new() },
    };
    let free: Vec<Param> = Param::all().filter(|param| !is_given(*param, first, all)).collect();
    Some(file.to_toml(Origin { scene: Path::new(from), outcome: None, set: &[], free: &free, numbers: &[] }))
}

/// What a scene has of its own, as far as it is nobody's to give elsewhere.
fn own_params(values: &Values, all: bool) -> Vec<(Param, [f64; 3])> {
    let own = Param::of(values.effects).filter(|param| param.is_of_scene() && !is_given(*param, values, all));
    own.map(|param| (param, values.params.rgb(param))).collect()
}

/// Whether a parameter is the scene's to give elsewhere.
fn is_given(param: Param, values: &Values, all: bool) -> bool {
    let free = values.free.iter().any(|column| column.param == param);
    param.info().held || (param.info().found && !free && !all)
}

/// Have `other` take of a scene's values what is the skin's.
fn share(changed: &Values, other: &mut Values) {
    for param in Param::all().filter(|param| !param.is_of_scene()) {
        other.params.set_rgb(param, changed.params.rgb(param));
    }
    let skins = changed.apart.iter().filter(|param| !param.is_of_scene());
    let own = other.apart.iter().filter(|param| param.is_of_scene());
    other.apart = skins.chain(own).copied().collect();
    let own: Vec<Column> = other.free.iter().filter(|column| column.param.is_of_scene()).copied().collect();
    other.free =
        changed.free.iter().filter(|column| !column.param.is_of_scene()).copied().chain(own).collect();
    let skins = changed.effects.iter().filter(|effect| !effect.is_of_scene());
    let own = other.effects.iter().filter(|effect| effect.is_of_scene());
    let effects = skins.chain(own).fold(Effects::of(&[]), Effects::with);
    if effects != other.effects {
        other.effects = effects;
        other.without_parts();
    }
}

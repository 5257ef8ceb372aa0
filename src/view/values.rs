//! What one edits: the constants, what a fit may move, which effects are on, which views it leaves out.

use crate::engine::Point;
use crate::model::bounds::Bounds;
use crate::model::effects::{Effect, Effects, Form};
use crate::model::gain::Gain;
use crate::model::params::{Channels, Column, Param, Params};
use crate::prepare::{Baked, untied};
use crate::scene::Scene;
use crate::scene::view::View;

/// Every state of these is a step of the history.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// The form that the constants are of.
    pub form: Form,
    /// The constants.
    pub params: Params,
    /// A factor on each view's image.
    pub gains: Vec<Gain>,
    /// Whether a fit moves these, but for the first.
    pub free_gains: bool,
    /// Whether it moves each of their channels.
    pub white_balance: bool,
    /// What else a fit moves.
    pub free: Vec<Column>,
    /// What these stay within, where that is less than the table's.
    pub bounds: Bounds,
    /// The parameters that the scene's file leaves free: what is free again stands where it stood.
    order: Vec<Param>,
    /// What shows a value a channel, whether or not a fit moves it.
    pub apart: Vec<Param>,
    /// Which effects are on.
    pub effects: Effects,
    /// Views by name that a fit leaves out, and scores all the same.
    pub hold_out: Vec<String>,
}

/// What a fit may do to a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// It stays.
    Fixed,
    /// It moves, in all channels together.
    Tied,
    /// Each of its channels moves.
    PerChannel,
}

impl Values {
    /// A scene's own.
    #[must_use]
    pub fn of(baked: &Baked) -> Self {
        Self::of_scene(&baked.scene, &baked.gains)
    }

    /// A scene's own, of which nothing is baked yet.
    #[must_use]
    pub fn of_scene(scene: &Scene, gains: &[Gain]) -> Self {
        Self {
            form: scene.form,
            params: scene.params.clone(),
            gains: gains.to_vec(),
            free_gains: scene.fit.free_gains,
            white_balance: scene.fit.white_balance,
            free: scene.fit.free.clone(),
            bounds: scene.fit.bounds.clone(),
            order: scene.fit.free.iter().map(|column| column.param).collect(),
            apart: Vec::new(),
            effects: scene.effects,
            hold_out: Vec::new(),
        }
    }

    /// The parameters that the enabled effects ask for, in the order of the table.
    #[must_use]
    pub fn rows(&self) -> Vec<Param> {
        Param::all().filter(|param| param.asked_for(self.effects) && !param.info().held).collect()
    }

    /// What a fit may do to a parameter.
    #[must_use]
    pub fn freedom(&self, param: Param) -> Freedom {
        match self.free.iter().find(|column| column.param == param).map(|column| column.channels) {
            None => Freedom::Fixed,
            Some(Channels::Tied) => Freedom::Tied,
            Some(Channels::One(_)) => Freedom::PerChannel,
        }
    }

    /// Say what a fit may do to a parameter. One that becomes tied takes the mean of its channels.
    pub fn set_freedom(&mut self, param: Param, freedom: Freedom) {
        self.free.retain(|column| column.param != param);
        let rank = |param: Param| self.order.iter().position(|other| *other == param).unwrap_or(usize::MAX);
        let after = |column: &Column| rank(column.param) > rank(param);
        let at = self.free.iter().position(after).unwrap_or(self.free.len());
        let columns = match freedom {
            Freedom::Fixed => Vec::new(),
            Freedom::Tied => vec![Column::tied(param)],
            Freedom::PerChannel => Column::per_channel(param).to_vec(),
        };
        self.free.splice(at..at, columns);
        if freedom == Freedom::Tied {
            self.tie(param);
        }
    }

    /// Have what is free as one move in each channel where its channels stand apart, as a fit has it.
    pub fn untie(&mut self) {
        self.free = untied(&self.free, &self.params, &[]);
    }

    fn tie(&mut self, param: Param) {
        let rgb = self.params.rgb(param);
        self.params.set(param, rgb.iter().sum::<f64>() / 3.0);
    }

    /// Whether a parameter shows a value a channel: where it has three, or is free in each.
    #[must_use]
    pub fn by_channel(&self, param: Param) -> bool {
        let rgb = self.params.rgb(param);
        self.apart.contains(&param) || self.freedom(param) == Freedom::PerChannel || rgb != [rgb[0]; 3]
    }

    /// Show a value a channel, or one for all, which is their mean. A fit moves no more and no less than before.
    pub fn set_apart(&mut self, param: Param, apart: bool) {
        self.apart.retain(|other| *other != param);
        if apart {
            self.apart.push(param);
        } else {
            self.tie(param);
        }
        if self.freedom(param) != Freedom::Fixed {
            self.set_freedom(param, if apart { Freedom::PerChannel } else { Freedom::Tied });
        }
    }

    /// The constants and the gains.
    #[must_use]
    pub fn point(&self) -> Point {
        Point { params: self.params.clone(), gains: self.gains.clone() }
    }

    /// Whether there is anything to say of gains: they are free, or one is not 1.
    #[must_use]
    pub fn has_gains(&self) -> bool {
        self.free_gains || self.white_balance || self.gains.iter().any(|&gain| gain != Gain::ONE)
    }

    /// Say whether a fit moves each channel of the gains; where it does not, each is one value, which is green's.
    pub fn set_white_balance(&mut self, free: bool) {
        self.white_balance = free;
        if !free {
            self.gains.iter_mut().for_each(|gain| *gain = gain.channel(1).into());
        }
    }

    /// What a view's gain shows: one value, or one a channel where these differ or a fit moves each.
    #[must_use]
    pub fn gain_rows(&self, view: usize) -> Vec<(Channels, f64)> {
        let Some(gain) = self.gains.get(view) else { return Vec::new() };
        match gain.scalar().filter(|_| !self.white_balance) {
            Some(factor) => vec![(Channels::Tied, factor)],
            None => [0, 1, 2].map(|c| (Channels::One(c), gain.channel(c))).to_vec(),
        }
    }

    /// Say whether a fit moves a parameter: in each channel where it shows a value for each.
    pub fn set_free(&mut self, param: Param, free: bool) {
        // Channels stay apart: free again, each moves again.
        if self.freedom(param) == Freedom::PerChannel && !self.apart.contains(&param) {
            self.apart.push(param);
        }
        let freedom = match (free, self.by_channel(param)) {
            (false, _) => Freedom::Fixed,
            (true, true) => Freedom::PerChannel,
            (true, false) => Freedom::Tied,
        };
        self.set_freedom(param, freedom);
    }

    /// Take the constants of a fit; its gains are of the views that it has seen.
    pub fn take(&mut self, point: &Point, views: &[View]) {
        self.params = point.params.clone();
        let seen = |view: &View| view.target.is_some() && !self.hold_out.contains(&view.name);
        let places: Vec<usize> = (0..views.len()).filter(|&i| seen(&views[i])).collect();
        for (place, gain) in places.into_iter().zip(&point.gains) {
            if let Some(own) = self.gains.get_mut(place) {
                *own = *gain;
            }
        }
    }

    /// Turn an effect on or off; parts that ask for it go with it, and what it is a part of comes with it.
    pub fn set_effect(&mut self, effect: Effect, on: bool) {
        self.effects = if on { self.effects.with(effect) } else { self.effects.without(effect) };
        if let Some(whole) = effect.lacks(self.effects).filter(|_| on) {
            self.effects = self.effects.with(whole);
        }
        self.without_parts();
    }

    /// Turn parts off whose whole is off, and leave nothing free that no effect asks for.
    pub fn without_parts(&mut self) {
        while let Some(part) = self.effects.iter().find(|part| part.lacks(self.effects).is_some()) {
            self.effects = self.effects.without(part);
        }
        self.free.retain(|column| column.param.asked_for(self.effects));
    }

    /// Leave a view out of fits, or take it in again.
    pub fn set_held_out(&mut self, view: &str, out: bool) {
        self.hold_out.retain(|name| name != view);
        if out {
            self.hold_out.push(view.to_owned());
        }
    }
}

/// The column of that name, as reports have it: `hilite.r`.
#[must_use]
pub fn column(name: &str) -> Option<Column> {
    let columns = |param: Param| std::iter::once(Column::tied(param)).chain(Column::per_channel(param));
    Param::all().flat_map(columns).find(|column| column.name() == name)
}

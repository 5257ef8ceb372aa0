//! Scenes that are to be fitted as one skin: what they have to share, and what the first of them says for all.

use super::error::NotOneSkin;
use super::{Loaded, PrepareError};
use crate::model::effects::Effect;
use crate::model::params::{Channels, Column, Param};
use crate::scene::{Scene, short};

/// Have `scenes` share one skin: form, silhouette, lookups, named choices, loss, the skin's effects and what is free
/// of its parameters have to be the same in all of them. Free parameters of the skin then start everywhere as in the
/// first scene; those that are held have to stand at one value. Meshes, maps, views, poses, lights and their
/// parameters are each scene's own.
///
/// # Errors
/// [`PrepareError::NotOneSkin`], with the first thing that differs.
pub fn share_skin(scenes: &mut [Loaded]) -> Result<(), PrepareError> {
    let Some((first, others)) = scenes.split_first_mut() else { return Ok(()) };
    for other in others {
        agree(&first.scene, &other.scene).map_err(
            |Difference { what, first: one, other: two, remedy }| {
                let path = |scene: &Scene| scene.path.display().to_string();
                let (scene, first) = (path(&other.scene), path(&first.scene));
                Box::new(NotOneSkin { scene, first, what, here: two, there: one, remedy })
            },
        )?;
        for param in Param::all().filter(|param| !param.is_of_scene()) {
            other.scene.params.set_rgb(param, first.scene.params.rgb(param));
        }
    }
    Ok(())
}

/// What differs between the first scene and another, and what to do about it.
struct Difference {
    what: String,
    first: String,
    other: String,
    remedy: &'static str,
}

fn agree(first: &Scene, other: &Scene) -> Result<(), Difference> {
    let same = |what: &str, one: String, two: String, remedy| match one == two {
        true => Ok(()),
        false => Err(Difference { what: what.to_owned(), first: one, other: two, remedy }),
    };
    let alike = "Give both scenes the same one";
    let of = |scene: &Scene| {
        [scene.form.name(), scene.silhouette.name(), scene.lookups.name(), scene.fit.loss.name()]
    };
    let named =
        ["form", "silhouette", "lookups", "loss"].into_iter().zip(of(first).into_iter().zip(of(other)));
    for (what, (one, two)) in named {
        same(what, one.to_owned(), two.to_owned(), alike)?;
    }
    for ((what, one), (_, two)) in first.choices.named().into_iter().zip(other.choices.named()) {
        same(what, one.to_owned(), two.to_owned(), alike)?;
    }
    same("list of the skin's effects", effects(first), effects(other), "Switch the same on in both scenes")?;
    let free = "Leave the same free in both scenes";
    same("list of what is free of the skin", list(first), list(other), free)?;
    let within = "Give them the same in both scenes";
    same("bounds of what is the skin's", bounds(first), bounds(other), within)?;
    for param in Param::of(first.effects).filter(|param| is_held(first, *param)) {
        let [one, two] = [first, other].map(|scene| scene.params.rgb(param));
        if one != two {
            let (first, other) = (value(one), value(two));
            let remedy =
                "It is held, and a skin has one value of it: give both scenes the same, or leave it free";
            return Err(Difference { what: format!("value of {}", param.name()), first, other, remedy });
        }
    }
    Ok(())
}

/// Whether a parameter of the skin is asked for and not free.
fn is_held(scene: &Scene, param: Param) -> bool {
    let free = scene.fit.free.iter().any(|column| column.param == param);
    !param.is_of_scene() && param.asked_for(scene.effects) && !free
}

fn effects(scene: &Scene) -> String {
    let own = scene.effects.iter().filter(|effect| !effect.is_of_scene());
    own.map(Effect::name).collect::<Vec<_>>().join(", ")
}

/// What is free of the skin, whatever its order.
fn list(scene: &Scene) -> String {
    let mut names: Vec<String> = Vec::new();
    for Column { param, channels } in scene.fit.free.iter().filter(|column| !column.param.is_of_scene()) {
        match channels {
            Channels::Tied => names.push(param.name().to_owned()),
            Channels::One(0) => names.push(format!("{} in each channel", param.name())),
            Channels::One(_) => {}
        }
    }
    names.sort_unstable();
    names.join(", ")
}

/// What parameters of the skin stay within.
fn bounds(scene: &Scene) -> String {
    let own = scene.fit.bounds.iter().filter(|(param, _)| !param.is_of_scene());
    let all: Vec<String> = own.map(|(param, [a, b])| format!("{} in [{a}, {b}]", param.name())).collect();
    if all.is_empty() { "the table's".to_owned() } else { all.join(", ") }
}

fn value(rgb: [f64; 3]) -> String {
    if rgb == [rgb[0]; 3] { short(rgb[0]) } else { format!("{rgb:?}") }
}

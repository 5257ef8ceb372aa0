//! Which views a fit is scored on and does not see, by the names of views and scenes.

use std::path::Path;

use super::joint_scenes::view_of;
use crate::scene::suggestion;
use crate::scene::view::View;

/// A scene's name, its file, and its views.
pub(super) type Place<'a> = (&'a str, &'a Path, &'a [View]);

/// What cannot be held out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the words say it")]
pub enum HoldOutError {
    /// Two things have that name.
    #[error(
        "{scenes}: held out {name}: a scene is called so, and a view. Name each view with its scene: SCENE/VIEW."
    )]
    Ambiguous { scenes: String, name: String },
    /// Nothing is left.
    #[error(
        "{scenes}: held out {names}: that is every view with a target, so nothing is left to fit. Leave one of them in, \
         or add a [[view]]."
    )]
    Everything { scenes: String, names: String },
    /// Nothing has that name.
    #[error("{scenes}: held out: there is {what} `{name}` with a target. {suggestion}.")]
    Unknown { scenes: String, what: &'static str, name: String, suggestion: String },
}

/// For each scene which of its views `names` hold out. A name is that of a view (in every scene that has it), that of a
/// scene (every view of it), or both: `SCENE/VIEW`.
///
/// # Errors
/// When a name is that of no view with a target, or nothing is left to fit.
pub(super) fn marked(names: &[String], scenes: &[Place<'_>]) -> Result<Vec<Vec<bool>>, HoldOutError> {
    let mut marks: Vec<Vec<bool>> = scenes.iter().map(|(_, _, views)| vec![false; views.len()]).collect();
    // Of a single scene its own name says nothing.
    let of_scene = |name: &String, scene: &str| scenes.len() > 1 && name == scene;
    for name in names {
        let mut found = false;
        let both = scenes.iter().any(|(scene, ..)| of_scene(name, scene))
            && scenes.iter().any(|(_, _, views)| views.iter().any(|view| view.name == *name));
        if both {
            return Err(HoldOutError::Ambiguous { scenes: files(scenes), name: name.clone() });
        }
        for ((scene, _, views), marks) in scenes.iter().zip(&mut marks) {
            for (view, mark) in views.iter().zip(marks).filter(|(view, _)| view.target.is_some()) {
                let whole = view_of(scene, &view.name);
                let named = *name == view.name || of_scene(name, scene) || *name == whole;
                (*mark, found) = (*mark || named, found || named);
            }
        }
        if !found {
            return Err(unknown(name, scenes));
        }
    }
    let left = |((_, _, views), marks): (&Place<'_>, &Vec<bool>)| {
        views.iter().zip(marks).any(|(view, mark)| view.target.is_some() && !mark)
    };
    if !names.is_empty() && !scenes.iter().zip(&marks).any(left) {
        return Err(HoldOutError::Everything { scenes: files(scenes), names: names.join(", ") });
    }
    Ok(marks)
}

/// There is nothing of that name.
fn unknown(name: &str, scenes: &[Place<'_>]) -> HoldOutError {
    let several = scenes.len() > 1;
    let mut known: Vec<String> = Vec::new();
    for (scene, _, views) in scenes {
        known.extend(several.then(|| (*scene).to_owned()));
        let names = views.iter().filter(|view| view.target.is_some()).map(|view| &view.name);
        known.extend(names.map(|view| if several { view_of(scene, view) } else { view.clone() }));
    }
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    let what = if several { "no scene and no view" } else { "no view" };
    let suggestion = suggestion(name, &known);
    HoldOutError::Unknown { scenes: files(scenes), what, name: name.to_owned(), suggestion }
}

/// The scenes' files, for a refusal.
fn files(scenes: &[Place<'_>]) -> String {
    scenes.iter().map(|(_, path, _)| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::view::{Background, Camera, Target};

    fn view(name: &str, with_target: bool) -> View {
        let target = Target { rgb: Vec::new(), alpha: None, haze: None, mask: None, clipped_at: None };
        let camera = Camera::pinhole(glam::DMat4::IDENTITY, 1.0, [1, 1]);
        let target = with_target.then_some(target);
        View { name: name.to_owned(), camera, target, background: Background::None }
    }

    #[test]
    fn a_name_is_that_of_a_view_of_a_scene_or_of_a_view_of_one_scene() {
        let views = [view("front", true), view("side", true), view("bare", false)];
        let scenes = ["noon", "night"].map(|name| (name, Path::new(name), &views[..]));
        let of = |names: &[&str]| {
            marked(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>(), &scenes)
                .map(|marks| marks.concat())
        };
        assert_eq!(of(&[]).unwrap(), [false; 6]);
        assert_eq!(of(&["side"]).unwrap(), [false, true, false, false, true, false]);
        assert_eq!(of(&["night/side"]).unwrap(), [false, false, false, false, true, false]);
        // A view without a target has nothing to be scored against.
        assert_eq!(of(&["night"]).unwrap(), [false, false, false, true, true, false]);
        assert_eq!(of(&["night", "noon/side"]).unwrap(), [false, true, false, true, true, false]);
        let words = |names: &[&str]| of(names).unwrap_err().to_string();
        assert!(words(&["bare"]).contains("no scene and no view `bare` with a target"));
        assert!(words(&["nigth"]).contains("Did you mean `night`?"));
        assert!(words(&["noon", "night"]).contains("nothing is left to fit"));
        let scenes = [("front", Path::new("front"), &views[..]), scenes[0]];
        let names = ["front".to_owned()];
        assert!(
            marked(&names, &scenes).unwrap_err().to_string().contains("a scene is called so, and a view")
        );
        assert_eq!(marked(&names, &scenes[..1]).unwrap().concat(), [true, false, false]);
    }
}

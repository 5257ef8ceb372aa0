//! The text of a scene file as it was fitted: comments and order stay, paths become absolute, and what
//! the command line said stands in the place of the file's own.

use std::path::{Path, PathBuf};

use toml_edit::{Array, DocumentMut, Item, Table, TableLike, TomlError, Value};

use super::fitted_cameras::set_cameras;
use crate::model::bounds::Bounds;
use crate::model::effects::Form;
use crate::model::params::{Channels, Column, Param, Params};
use crate::prepare::MovedCamera;
use crate::study::tradeoff::axis::Choose;

/// The keys of `[maps]` that name files.
const MAPS: [&str; 4] = ["color", "normal", "specular", "attenuator"];

/// What the command line changed.
#[derive(Clone, Copy, Default)]
pub(super) struct Changes<'a> {
    /// The loss, instead of the file's.
    pub(super) loss: Option<&'a str>,
    /// What is free, instead of the file's.
    pub(super) free: Option<&'a [Column]>,
    /// What it stays within, instead of the file's.
    pub(super) bounds: Option<&'a Bounds>,
    /// Whether gains are free, instead of what the file says.
    pub(super) free_gains: Option<bool>,
    /// Whether each channel of them is.
    pub(super) white_balance: Option<bool>,
    /// The start values, instead of the file's.
    pub(super) start: Option<Start<'a>>,
    /// Fitted maps, instead of the file's: key in `[maps]` and path.
    pub(super) maps: &'a [(&'static str, String)],
    /// Whether the scene's maps are looked up as the mesh's own material says: then fitted ones are, too.
    pub(super) of_material: bool,
    /// Settings, instead of the file's.
    pub(super) settings: &'a [Choose],
    /// Cameras that the fit moved, instead of the file's.
    pub(super) cameras: &'a [MovedCamera],
    /// The effects that are on, instead of the file's.
    pub(super) effects: Option<&'a [&'static str]>,
}

/// Start values that a fit used.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    pub(super) form: Form,
    pub(super) params: &'a Params,
    /// What was free: a parameter that was so in each channel is given three values.
    pub(super) free: &'a [Column],
}

/// The text of a scene file in `folder`, as it was fitted.
///
/// # Errors
/// When it is not TOML.
pub(super) fn as_fitted(text: &str, folder: &Path, changes: Changes<'_>) -> Result<String, TomlError> {
    let mut scene: DocumentMut = text.parse()?;
    place_files(&mut scene, &mut |path| folder.join(path).display().to_string());
    if !changes.maps.is_empty()
        && let Some(maps) = section(scene.as_table_mut(), "maps")
    {
        changes.maps.iter().for_each(|(key, path)| set(maps, key, path.as_str().into()));
        if changes.of_material {
            set(maps, "material", true.into());
        }
    }
    if let Some(loss) = changes.loss
        && let Some(fit) = section(scene.as_table_mut(), "fit")
    {
        set(fit, "loss", loss.into());
    }
    if let Some(free) = changes.free
        && let Some(fit) = section(scene.as_table_mut(), "fit")
    {
        set_free(fit, free);
    }
    if let Some(bounds) = changes.bounds
        && let Some(fit) = section(scene.as_table_mut(), "fit")
    {
        set_bounds(fit, bounds);
    }
    for (key, free) in [("gains", changes.free_gains), ("white_balance", changes.white_balance)] {
        if let Some(free) = free
            && let Some(fit) = section(scene.as_table_mut(), "fit")
            && (free || fit.contains_key(key))
        {
            set(fit, key, free.into());
        }
    }
    if let Some(start) = changes.start {
        let model = section(scene.as_table_mut(), "model");
        if let Some(params) = model.and_then(|model| section(model, "params")) {
            set_params(params, start);
        }
    }
    set_cameras(&mut scene, changes.cameras);
    if let Some(effects) = changes.effects
        && let Some(model) = section(scene.as_table_mut(), "model")
    {
        set(model, "effects", Value::Array(effects.iter().copied().collect::<Array>()));
    }
    for choose in changes.settings {
        let (table, key, value): (_, _, Value) = match choose {
            Choose::Quality(knob, value) => ("quality", knob.key(), i64::from(*value).into()),
            Choose::Silhouette(silhouette) => ("model", "silhouette", silhouette.name().into()),
        };
        if let Some(table) = section(scene.as_table_mut(), table) {
            set(table, key, value);
        }
    }
    Ok(scene.to_string())
}

/// The text of a scene file whose files stand elsewhere: `place` gives the new path of each.
///
/// # Errors
/// When it is not TOML.
pub(super) fn with_files(text: &str, place: &mut dyn FnMut(&str) -> String) -> Result<String, TomlError> {
    let mut scene: DocumentMut = text.parse()?;
    place_files(&mut scene, place);
    Ok(scene.to_string())
}

/// Have `place` give the path of each file that a scene names.
fn place_files(scene: &mut DocumentMut, place: &mut dyn FnMut(&str) -> String) {
    let files = [("mesh", &["file"][..]), ("environment", &["file"]), ("maps", &MAPS)];
    for (name, keys) in files {
        if let Some(table) = scene.get_mut(name).and_then(Item::as_table_like_mut) {
            place_in(table, keys, place);
        }
    }
    if let Some(own) = own_maps(scene) {
        let names: Vec<String> = own.iter().map(|(name, _)| name.to_owned()).collect();
        place_in(own, &names.iter().map(String::as_str).collect::<Vec<_>>(), place);
    }
    let model = scene.get_mut("model").and_then(Item::as_table_like_mut);
    if let Some(terms) = model.and_then(|model| model.get_mut("terms")).and_then(Item::as_array_mut) {
        for term in terms.iter_mut() {
            if let Some(path) = term.as_str() {
                *term = place(path).into();
            } else if let Some(family) = term.as_inline_table_mut() {
                place_in(family, &["file"], place);
            }
        }
    }
    let keys = ["target", "mask", "haze", "response"];
    match scene.get_mut("view") {
        Some(Item::ArrayOfTables(views)) => {
            views.iter_mut().for_each(|view| place_in(view, &keys, place));
        }
        Some(Item::Value(Value::Array(views))) => {
            let views = views.iter_mut().filter_map(Value::as_inline_table_mut);
            views.for_each(|view| place_in(view, &keys, place));
        }
        _ => {}
    }
}

/// The maps that files of rules declare.
fn own_maps(scene: &mut DocumentMut) -> Option<&mut dyn TableLike> {
    scene.get_mut("maps")?.as_table_like_mut()?.get_mut("own")?.as_table_like_mut()
}

/// The files that the text of a fitted scene names as its maps.
pub(super) fn named_maps(text: &str) -> Vec<PathBuf> {
    let scene: DocumentMut = text.parse().unwrap_or_default();
    let maps = scene.get("maps").and_then(Item::as_table_like);
    let paths = maps.into_iter().flat_map(|maps| MAPS.into_iter().filter_map(|key| maps.get(key)?.as_str()));
    paths.map(PathBuf::from).collect()
}

fn place_in(table: &mut dyn TableLike, keys: &[&str], place: &mut dyn FnMut(&str) -> String) {
    for key in keys {
        if let Some(path) = table.get(key).and_then(Item::as_str) {
            let path = place(path);
            set(table, key, path.into());
        }
    }
}

/// The table `name`, which is made if need be.
fn section<'a>(table: &'a mut dyn TableLike, name: &str) -> Option<&'a mut dyn TableLike> {
    table.entry(name).or_insert_with(|| Item::Table(Table::new())).as_table_like_mut()
}

/// Set a value; what stands around it (spaces, a comment) stays.
pub(super) fn set(table: &mut dyn TableLike, key: &str, mut value: Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
}

/// What is free, and which of it in each channel.
fn set_free(table: &mut dyn TableLike, free: &[Column]) {
    let mut names: Vec<&str> = free.iter().map(|column| column.param.name()).collect();
    names.dedup();
    let coloured = free.iter().filter(|column| column.channels == Channels::One(0));
    let coloured: Vec<&str> = coloured.map(|column| column.param.name()).collect();
    set(table, "free", Value::Array(Array::from_iter(names)));
    if !coloured.is_empty() || table.contains_key("per_channel") {
        set(table, "per_channel", Value::Array(Array::from_iter(coloured)));
    }
}

/// What parameters stay within; those that the file has already keep their place.
fn set_bounds(fit: &mut dyn TableLike, bounds: &Bounds) {
    const KEY: &str = "bounds";
    if bounds.is_empty() {
        fit.remove(KEY);
    } else if let Some(table) = section(fit, KEY) {
        let known: Vec<String> = table.iter().map(|(name, _)| name.to_owned()).collect();
        let set_now = |name: &String| bounds.iter().any(|(param, _)| param.name() == name.as_str());
        known.iter().filter(|name| !set_now(name)).for_each(|name| drop(table.remove(name)));
        for (param, interval) in bounds.iter() {
            set(table, param.name(), Value::Array(Array::from_iter(interval)));
        }
    }
}

/// Every start value that is not the form's default, or that the file names.
fn set_params(table: &mut dyn TableLike, start: Start<'_>) {
    for param in Param::all() {
        let rgb = start.params.rgb(param);
        let of = |column: &&Column| column.param == param;
        // The scene gives these elsewhere.
        let free = start.free.iter().any(|column| column.param == param);
        let given = param.info().held || (param.info().found && !free && !table.contains_key(param.name()));
        if given {
            continue;
        }
        let coloured = start.free.iter().filter(of).any(|column| column.channels != Channels::Tied);
        if coloured || rgb != [rgb[0]; 3] {
            set(table, param.name(), Value::Array(Array::from_iter(rgb)));
        } else if rgb[0] != param.default(start.form) || table.contains_key(param.name()) {
            set(table, param.name(), rgb[0].into());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Silhouette;
    use crate::study::tradeoff::axis::Knob;

    const SCENE: &str = "# kept\n[mesh]\nfile = \"a b.glb\" # here too\n[maps]\ncolor = '/c.png'\n\
        [[view]]\ntarget = \"t\\u0041.exr\"\n";

    #[test]
    fn paths_become_absolute_and_comments_stay() {
        let text = as_fitted(SCENE, Path::new("/sc\"ene"), Changes::default()).unwrap();
        assert_eq!(
            text,
            "# kept\n[mesh]\nfile = '/sc\"ene/a b.glb' # here too\n[maps]\ncolor = \"/c.png\"\n\
             [[view]]\ntarget = '/sc\"ene/tA.exr'\n"
        );
        let inline = "view = [{ target = \"a.exr\", mask = \"b.png\", haze = \"c.exr\", response = \"d.csv\" }, { response = 2.2 }] # views\n";
        let text = as_fitted(inline, Path::new("/s"), Changes::default()).unwrap();
        let wanted = "view = [{ target = \"/s/a.exr\", mask = \"/s/b.png\", haze = \"/s/c.exr\", response = \"/s/d.csv\" }, { response = 2.2 }] # views\n";
        assert_eq!(text, wanted);
    }

    #[test]
    fn settings_stand_in_the_place_of_the_files_own() {
        let settings = [Choose::Quality(Knob::LobeSize, 16), Choose::Silhouette(Silhouette::Vertex)];
        let changes = Changes { settings: &settings, ..Changes::default() };
        for quality in ["", "[quality]\nlobe_size = 99 # coarse\n", "[model]\nsilhouette = \"bumped\"\n"] {
            let text = as_fitted(&format!("{quality}{SCENE}"), Path::new("/s"), changes).unwrap();
            let table: toml::Table = text.parse().unwrap();
            assert_eq!(table["quality"]["lobe_size"].as_integer(), Some(16), "{text}");
            assert_eq!(table["model"]["silhouette"].as_str(), Some("vertex"), "{text}");
            assert_eq!(text.matches("# coarse").count(), quality.matches("# coarse").count());
        }
    }

    #[test]
    fn the_loss_is_the_one_that_was_minimised() {
        let fits = ["", "[fit] # why\n", "[fit]\nfree = [] # none\n", "[fit]\nloss = \"huber\" # ?\n"];
        for fit in fits.into_iter().chain(["fit.free = []\n"]) {
            let changes = Changes { loss: Some("l2"), ..Changes::default() };
            let text = as_fitted(&format!("{fit}{SCENE}"), Path::new("/s"), changes).unwrap();
            let table: toml::Table = text.parse().unwrap();
            assert_eq!(table["fit"]["loss"].as_str(), Some("l2"), "{text}");
            assert_eq!(table["mesh"]["file"].as_str(), Some("/s/a b.glb"));
            let comments = |text: &str| text.matches('#').count();
            assert_eq!(comments(&text), comments(fit) + comments(SCENE), "{text}");
        }
    }

    #[test]
    fn what_is_free_is_what_was() {
        let free =
            [vec![Column::tied(Param::RimExponent)], Column::per_channel(Param::Hilite).to_vec()].concat();
        for fit in ["", "[fit] # why\nfree = [\"occlusion\"] # little\nper_channel = []\n"] {
            let changes = Changes { free: Some(&free), ..Changes::default() };
            let text = as_fitted(&format!("{fit}{SCENE}"), Path::new("/s"), changes).unwrap();
            let table: toml::Table = text.parse().unwrap();
            let names = |key: &str| table["fit"][key].as_array().unwrap().clone();
            assert_eq!(names("free"), ["rim_exponent", "hilite"].map(toml::Value::from).to_vec(), "{text}");
            assert_eq!(names("per_channel"), [toml::Value::from("hilite")].to_vec(), "{text}");
            assert_eq!(text.matches("# little").count(), fit.matches("# little").count());
        }
    }

    #[test]
    fn the_start_values_are_those_that_were_used() {
        let mut params = Params::defaults(Form::Corrected);
        params.set(Param::RimExponent, 3.5);
        params.set_rgb(Param::RimWeight, [0.1, 0.2, 0.3]);
        let free = Column::per_channel(Param::Hilite);
        let start = Start { form: Form::Corrected, params: &params, free: &free };
        for model in ["", "[model]\n", "[model.params]\nocclusion = 0.3 # old\nrim_exponent = 9 # old\n"] {
            let changes = Changes { start: Some(start), ..Changes::default() };
            let text = as_fitted(&format!("{model}{SCENE}"), Path::new("/s"), changes).unwrap();
            let table: toml::Table = text.parse().unwrap();
            let found = table["model"]["params"].as_table().unwrap();
            assert_eq!(found["rim_exponent"].as_float(), Some(3.5), "{text}");
            let three = |name: &str| -> Vec<f64> {
                found[name].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect()
            };
            assert_eq!(three("rim_weight"), [0.1, 0.2, 0.3]);
            assert_eq!(three("hilite"), [0.7; 3]);
            // One that the file names is set back to the default; one that it does not stays unsaid.
            assert_eq!(found.get("occlusion").is_some(), model.contains("occlusion"));
            assert!(!found.contains_key("base_weight"));
            assert_eq!(text.matches("# old").count(), model.matches("# old").count());
        }
    }
}

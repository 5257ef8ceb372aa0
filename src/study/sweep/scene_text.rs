//! A scene file's text with some of its keys set: comments and order stay.

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

/// `text` with the key `path` (`fit.loss`, `model.params.hilite`, `view.front.width`) set to `value`.
///
/// # Errors
/// In words: the text is not TOML, or there is no such place in it.
pub fn with_key(text: &str, path: &str, value: &toml::Value) -> Result<String, String> {
    let mut scene: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.message().to_owned())?;
    let value: Value = value.to_string().parse().map_err(|_| format!("`{value}` cannot be set"))?;
    let mut parts: Vec<&str> = path.split('.').collect();
    let key = parts.pop().filter(|key| !key.is_empty()).ok_or("the key is empty")?;
    let mut table: &mut dyn TableLike = scene.as_table_mut();
    let mut parts = parts.into_iter();
    while let Some(part) = parts.next() {
        if part == "view" {
            let name = parts.next().ok_or("it names no view: write view.NAME.KEY")?;
            table = view(table, name).ok_or_else(|| format!("the scene has no view `{name}`"))?;
            continue;
        }
        let item = table.entry(part).or_insert_with(|| Item::Table(Table::new()));
        table = item.as_table_like_mut().ok_or_else(|| format!("`{part}` is no table"))?;
    }
    table.insert(key, Item::Value(value));
    Ok(scene.to_string())
}

/// The `[[view]]` of that name.
fn view<'a>(scene: &'a mut dyn TableLike, name: &str) -> Option<&'a mut dyn TableLike> {
    let named = |view: &dyn TableLike| view.get("name").and_then(Item::as_str) == Some(name);
    match scene.get_mut("view")? {
        Item::ArrayOfTables(views) => {
            views.iter_mut().find(|view| named(*view)).map(|view| view as &mut dyn TableLike)
        }
        Item::Value(Value::Array(views)) => {
            let mut tables = views.iter_mut().filter_map(Value::as_inline_table_mut);
            tables.find(|view| named(*view)).map(|view| view as &mut dyn TableLike)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "# kept\n[mesh]\nfile = \"a.glb\" # here\n[[view]]\nname = \"front\"\nwidth = 4\n";

    fn set(path: &str, value: &str) -> Result<String, String> {
        let table: toml::Table = format!("x = {value}").parse().unwrap();
        with_key(SCENE, path, &table["x"])
    }

    #[test]
    fn keys_are_set_where_they_stand_or_where_they_belong() {
        assert!(set("fit.loss", "\"l2\"").unwrap().contains("[fit]\nloss = \"l2\""));
        let text = set("model.params.hilite", "[0.1, 0.2, 0.3]").unwrap();
        let table: toml::Table = text.parse().unwrap();
        assert_eq!(table["model"]["params"]["hilite"][2].as_float(), Some(0.3));
        assert!(text.starts_with("# kept\n") && text.contains("# here"));
        assert!(set("view.front.width", "8").unwrap().contains("width = 8"));
    }

    #[test]
    fn places_that_are_not_there_are_told() {
        assert!(set("view.side.width", "8").unwrap_err().contains("no view `side`"));
        assert!(set("view.front", "8").is_err());
        assert!(set("mesh.file.x", "8").unwrap_err().contains("`file` is no table"));
        assert!(set("", "8").is_err() && set("fit.", "8").is_err());
    }
}

//! What a study's page is called.

use std::path::Path;

/// The title of a page about the scene of that name: a scene file's folder, with the file's own name unless it is
/// `scene.toml`; other names as they are.
#[must_use]
pub fn title(scene: &str) -> String {
    let path = Path::new(scene);
    if path.extension().is_none_or(|ending| ending != "toml") {
        return scene.to_owned();
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = absolute.parent().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    let stem = absolute.file_stem().map(|name| name.to_string_lossy().into_owned());
    match (folder, stem) {
        (Some(folder), Some(stem)) if stem == "scene" => folder,
        (Some(folder), Some(stem)) => format!("{folder}: {stem}"),
        _ => scene.to_owned(),
    }
}

/// The title of a page about several scenes of these names.
#[must_use]
pub fn title_of_several(scenes: &[String]) -> String {
    scenes.join(" + ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_called_by_the_scenes_folder() {
        assert_eq!(title("../data/lps_forest/scene.toml"), "lps_forest");
        assert_eq!(title("data/head/night.toml"), "head: night");
        assert_eq!(title("the built-in scene"), "the built-in scene");
        assert_eq!(title("/scene.toml"), "/scene.toml");
    }
}

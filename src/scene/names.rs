//! What a scene is called among several: by its file, or the folder that it lies in.

use std::path::Path;

/// The folder of the scenes' files in the run folder of a fit of several.
pub const RUN_SCENES: &str = "scenes";

/// The names that the scene at `path` goes by, the first one preferred: the file's own without its ending, or the folder's
/// of a `scene.toml`; with the folder's before it; and the file's own whatever it is. Made of the path alone.
#[must_use]
pub fn names_of(path: &Path) -> [String; 3] {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let words = |part: Option<&std::ffi::OsStr>| part.map(|name| name.to_string_lossy().into_owned());
    let folder = words(absolute.parent().and_then(Path::file_name)).unwrap_or_default();
    let file = words(absolute.file_stem()).unwrap_or_default();
    // In a run's folder of scenes each file is called as its scene was.
    let of_folder = file == "scene" && !folder.is_empty() && folder != RUN_SCENES;
    let short = if of_folder { folder.clone() } else { file.clone() };
    // A user's folder may be called as a run's is.
    let other = if short == "scene" && folder == RUN_SCENES { folder.clone() } else { file.clone() };
    [short, format!("{folder}.{file}"), other]
}

/// A name for each of several scenes, no two the same (case does not count); `None` where their paths do not tell them
/// apart by a file's and its folder's name.
#[must_use]
pub fn names_apart(paths: &[&Path]) -> Option<Vec<String>> {
    let all: Vec<[String; 3]> = paths.iter().map(|path| names_of(path)).collect();
    let of = |place: usize| all.iter().map(|names| names[place].clone()).collect::<Vec<_>>();
    let apart = |names: &Vec<String>| {
        let lower: Vec<String> = names.iter().map(|name| name.to_lowercase()).collect();
        (0..lower.len()).all(|i| !lower[..i].contains(&lower[i]))
    };
    [of(0), of(1)].into_iter().find(apart)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_called_by_their_files_or_folders() {
        let named = |paths: &[&str]| {
            let paths: Vec<&Path> = paths.iter().map(Path::new).collect();
            names_apart(&paths).map(|names| names.join(" "))
        };
        assert_eq!(named(&["/d/noon.toml", "/d/night.toml"]).unwrap(), "noon night");
        assert_eq!(named(&["/noon/scene.toml", "/night/scene.toml"]).unwrap(), "noon night");
        assert_eq!(named(&["/a/Day.toml", "/b/day.toml"]).unwrap(), "a.Day b.day");
        assert_eq!(named(&["/a/x/scene.toml", "/b/x/scene.toml"]), None);
        assert_eq!(names_of(Path::new("/scene.toml"))[0], "scene");
        // As a run folder keeps it.
        assert!(names_of(Path::new("/run/scenes/a.Day.toml")).contains(&"a.Day".to_owned()));
        assert_eq!(named(&["/scene/scene.toml", "/b/night.toml"]).unwrap(), "scene night");
        assert_eq!(named(&["/run/scenes/scene.toml", "/run/scenes/night.toml"]).unwrap(), "scene night");
    }
}

//! Which files are compared on what.

use std::path::Path;

use super::evaluators::On;
use crate::by_rules::Kind;
use crate::common::own_vectors_light;

/// What of a file is compared on an evaluator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Of {
    Nothing,
    Values,
    /// How values move, too.
    Slopes,
}
use Of::{Nothing as N, Slopes as S, Values as V};

/// The table's columns: the rules in f64, in f32 and in SIMD lanes; both engines and burn's tensors; the rules in compute
/// shaders, of the renderer's or of samples; and what bakes and scenes compute in f64 without rules.
const HEADER: &str = "| file | f64 | f32 | lanes | CPU | GPU | burn | shaders | bakes |";
const RULE: &str = "| --- | --- | --- | --- | --- | --- | --- | --- | --- |";

const ROWS: [(&str, [Of; 8]); 23] = [
    ("composed", [S, S, S, S, S, S, V, N]),
    ("diffusion2_atlas", [V, N, N, N, N, N, N, N]),
    ("diffusion2_mix00_taps5", [S, S, N, S, S, S, N, N]),
    ("diffusion2_mix00_tapsfull", [S, S, N, S, S, S, N, N]),
    ("diffusion2_mix05_taps5", [S, S, N, S, S, S, N, N]),
    ("diffusion2_mix05_taps7", [S, S, N, S, S, S, N, N]),
    ("diffusion2_mix05_taps9", [S, S, N, S, S, S, N, N]),
    ("diffusion2_mix05_tapsfull", [S, S, N, S, S, S, N, N]),
    ("diffusion2_mix10_taps5", [S, S, N, S, S, S, N, N]),
    ("diffusion2_mix10_tapsfull", [S, S, N, S, S, S, N, N]),
    ("diffusion2_stretch", [V, V, N, N, N, N, N, N]),
    ("diffusion2_surface", [S, S, N, N, N, N, N, N]),
    ("light", [S, S, S, S, S, S, V, S]),
    ("sh_bounce", [S, S, S, S, S, S, N, N]),
    ("sh_environment", [N, N, N, N, N, N, N, S]),
    ("sh_transfer", [S, S, S, S, S, S, N, S]),
    ("specular_choices", [S, V, V, N, N, N, V, N]),
    ("specular_environment", [N, N, N, N, N, N, N, S]),
    ("specular_lights", [S, S, S, S, S, S, V, N]),
    ("specular_lights_ggx", [S, S, S, S, S, S, V, N]),
    ("specular_split_sum", [S, V, V, V, V, V, V, S]),
    ("specular_split_sum_ggx", [S, V, V, V, V, V, V, S]),
    ("transmission", [S, S, S, S, S, S, V, N]),
];

/// The evaluators that samples of a file's cases are compared on, of those that this machine has.
pub(super) fn evaluators(file: &str) -> Vec<On> {
    let (_, of) = ROWS.iter().find(|(name, _)| *name == file).unwrap_or_else(|| panic!("no row of {file}"));
    let place = |on: &On| match on {
        On::Rules(Kind::Double) => 0,
        On::Rules(Kind::Single) => 1,
        On::Rules(Kind::InLanes(_)) => 2,
        On::Processor(_) => 3,
        On::Adapter(_) => 4,
        #[cfg(feature = "burn")]
        On::Tensors(_) => 5,
    };
    On::all().into_iter().filter(|on| of[place(on)] != Of::Nothing).collect()
}

/// The table, as the vectors' own page has it.
fn table() -> String {
    let cell = |of: &Of| match of {
        Of::Nothing => " |",
        Of::Values => " v |",
        Of::Slopes => " v, d |",
    };
    let row =
        |(name, of): &(&str, [Of; 8])| format!("| `{name}` |{}", of.iter().map(cell).collect::<String>());
    let rows = ROWS.iter().map(row);
    [HEADER.to_owned(), RULE.to_owned()].into_iter().chain(rows).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_page_of_the_vectors_says_what_they_are_compared_on_and_leaves_none_out() {
    let folder = own_vectors_light();
    let page = std::fs::read_to_string(folder.join("README.md")).unwrap();
    assert!(page.contains(&table()), "{} lacks this table:\n{}", folder.display(), table());
    let file = |path: &Path| path.file_stem().unwrap().to_string_lossy().into_owned();
    let paths = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<String> = paths
        .filter(|path| path.extension().is_some_and(|ending| ending == "json"))
        .map(|path| file(&path))
        .collect();
    // Cubes that other files look up.
    files.retain(|name| name != "cubes_ldr");
    files.sort();
    assert_eq!(files, ROWS.map(|(name, _)| name));
}

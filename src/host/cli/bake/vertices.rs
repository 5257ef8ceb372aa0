//! `skinfit bake`: what vertices have of the fields that a scene's effects ask for, as a table: vertex attributes of an engine.

use std::fmt::Write as _;

use crate::export::vertices::fields_at_vertices;
use crate::samples::PosedSurface;
use crate::scene::Scene;

/// Whether an effect asks for a field of vertices.
pub(super) fn are_asked_for(scene: &Scene) -> bool {
    scene.needs().fields.iter().any(|field| field.map().is_none())
}

/// The table: a column for each number of each field, a row a vertex; none where rays find none of the fields.
pub(super) fn table(scene: &Scene, surface: &PosedSurface<'_>) -> Option<String> {
    let columns = fields_at_vertices(scene, surface);
    if columns.is_empty() {
        return None;
    }
    let mut text = "vertex".to_owned();
    for (field, _) in &columns {
        match field.info().numbers {
            1 => _ = write!(text, ",{}", field.name()),
            numbers => (1..=numbers).for_each(|k| _ = write!(text, ",{}_{k}", field.name())),
        }
    }
    text.push('\n');
    for vertex in 0..scene.mesh.positions.len() {
        let _ = write!(text, "{vertex}");
        for (field, numbers) in &columns {
            for number in numbers.chunks(field.info().numbers).nth(vertex).unwrap_or_default() {
                let _ = write!(text, ",{number}");
            }
        }
        text.push('\n');
    }
    Some(text)
}

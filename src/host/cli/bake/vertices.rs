//! `skinfit bake`: what vertices have of the fields that a scene's effects ask for, as a table: vertex attributes of an engine.

use std::fmt::Write as _;

use super::super::Refusal;
use crate::bake::rays::RayMesh;
use crate::model::fields::Field;
use crate::prepare::Baked;
use crate::samples::PosedSurface;

/// The table: a column for each number of each field, a row a vertex; none where no effect asks for a field of vertices.
///
/// # Errors
/// When the mesh lacks what the effects ask for.
pub(super) fn table(baked: &Baked) -> Result<Option<String>, Refusal> {
    let scene = &*baked.scene;
    let fields = scene.needs().fields;
    if fields.iter().all(|field| field.map().is_some()) {
        return Ok(None);
    }
    let posed = scene.mesh.pose();
    let rays = RayMesh::new(&posed.positions, &posed.triangles);
    let surface = PosedSurface::new(scene, &posed, &rays, &scene.mesh.morphs, baked.surface_bakes())?;
    let columns: Vec<(Field, Vec<f32>)> = fields
        .iter()
        .filter(|&field| field.map().is_none() && surface.finds_at_vertices(field))
        .map(|field| (field, surface.field_of_vertices(field)))
        .collect();
    if columns.is_empty() {
        return Ok(None);
    }
    let mut text = "vertex".to_owned();
    for (field, _) in &columns {
        match field.info().numbers {
            1 => _ = write!(text, ",{}", field.name()),
            numbers => (1..=numbers).for_each(|k| _ = write!(text, ",{}_{k}", field.name())),
        }
    }
    text.push('\n');
    for vertex in 0..posed.positions.len() {
        let _ = write!(text, "{vertex}");
        for (field, numbers) in &columns {
            for number in numbers.chunks(field.info().numbers).nth(vertex).unwrap_or_default() {
                let _ = write!(text, ",{number}");
            }
        }
        text.push('\n');
    }
    Ok(Some(text))
}

//! What is baked of a scene's vertices, as streams of numbers: attributes of its mesh file.

use crate::bake::VertexOcclusion;
use crate::bake::inward::sum_of_nodes;
use crate::bake::transfer::{TransferSet, VertexTransfer};
use crate::model::fields::Field;
use crate::samples::{PosedSurface, SurfaceBakes};
use crate::scene::Scene;
use crate::scene::streams::{StreamKind, VertexStream};

/// The most numbers that an attribute of glTF has.
const WIDEST: usize = 4;

/// The streams of all that there is of `bakes`, and of the fields that rays find at vertices of `surface`.
///
/// - `OCCLUSION`: the open share of the hemisphere at rest, and what each morph target adds
/// - `TRANSFER_0` and on: transfer vectors, four numbers each; `BOUNCED_0` and on: those of light that the mesh throws back,
///   each a colour; at rest, and what each target adds
/// - `INVERSE_THICKNESS`: 1 over the thickness in units of the scene, 0 where nothing lies below; at rest, and what each
///   target adds, as inverses add up and thicknesses do not
/// - a field by its own name: as the scene poses the mesh, which no target moves
#[must_use]
pub fn vertex_streams(
    scene: &Scene,
    bakes: SurfaceBakes<'_>,
    surface: Option<&PosedSurface<'_>>,
) -> Vec<VertexStream> {
    let mut streams: Vec<VertexStream> = bakes.occlusion.map(occlusion).into_iter().collect();
    if let Some(sky) = bakes.sky {
        streams.extend(transfer(&sky.transfer));
    }
    if let Some(thickness) = bakes.thickness {
        let (numbers, morphs) = (thickness.base.clone(), thickness.morphs.clone());
        let name = "INVERSE_THICKNESS".to_owned();
        streams.push(VertexStream { name, kind: StreamKind::Scalar, numbers, morphs });
    }
    streams.extend(surface.into_iter().flat_map(|surface| fields(scene, surface)));
    streams
}

fn occlusion(of: &VertexOcclusion) -> VertexStream {
    let (numbers, morphs) = (of.base.clone(), of.morphs.clone());
    VertexStream { name: "OCCLUSION".to_owned(), kind: StreamKind::Scalar, numbers, morphs }
}

/// The fields of a scene's effects that rays, or the mesh file, have at vertices, as a rasteriser takes them: of light that is
/// gathered inside the mesh the sum over distances.
#[must_use]
pub fn fields_at_vertices(scene: &Scene, surface: &PosedSurface<'_>) -> Vec<(Field, Vec<f32>)> {
    let at_vertices = |field: &Field| field.map().is_none() && surface.finds_at_vertices(*field);
    let mut fields: Vec<Field> = Vec::new();
    for field in scene.needs().fields.iter().filter(at_vertices) {
        let taken = sum_of_nodes(field.name()).and_then(Field::from_name).unwrap_or(field);
        if !fields.contains(&taken) {
            fields.push(taken);
        }
    }
    fields.into_iter().map(|field| (field, surface.field_of_vertices(field))).collect()
}

fn fields(scene: &Scene, surface: &PosedSurface<'_>) -> Vec<VertexStream> {
    let stream = |(field, numbers): (Field, Vec<f32>)| {
        let kind = StreamKind::of(field.info().numbers)?;
        Some(VertexStream { name: field.name().to_uppercase(), kind, numbers, morphs: Vec::new() })
    };
    fields_at_vertices(scene, surface).into_iter().filter_map(stream).collect()
}

/// Transfer vectors, cut into attributes.
fn transfer(of: &VertexTransfer) -> Vec<VertexStream> {
    let functions = of.order.functions();
    let direct = |set: &TransferSet, from: usize, width: usize| -> Vec<f32> {
        set.direct.chunks_exact(functions).flat_map(|of| of[from..from + width].to_vec()).collect()
    };
    let bounced = |set: &TransferSet, from: usize, _: usize| -> Vec<f32> {
        set.bounced.chunks_exact(functions).flat_map(|of| of[from]).collect()
    };
    let mut streams = cut(of, "TRANSFER", WIDEST, &direct);
    if !of.base.bounced.is_empty() {
        streams.extend(cut(of, "BOUNCED", 1, &bounced).into_iter().map(as_colour));
    }
    streams
}

/// A stream for every `most` functions; `part` gives that part of a set's numbers.
fn cut(
    of: &VertexTransfer,
    name: &str,
    most: usize,
    part: &dyn Fn(&TransferSet, usize, usize) -> Vec<f32>,
) -> Vec<VertexStream> {
    let functions = of.order.functions();
    let stream = |(k, from): (usize, usize)| {
        let width = most.min(functions - from);
        Some(VertexStream {
            name: format!("{name}_{k}"),
            kind: StreamKind::of(width)?,
            numbers: part(&of.base, from, width),
            morphs: of.morphs.iter().map(|set| part(set, from, width)).collect(),
        })
    };
    (0..functions).step_by(most).enumerate().filter_map(stream).collect()
}

/// A function's number of each channel.
fn as_colour(stream: VertexStream) -> VertexStream {
    VertexStream { kind: StreamKind::Vec3, ..stream }
}

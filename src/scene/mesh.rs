//! The mesh as loaded, and posed: the structures between reader, vertex stage and samples.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::plain::PlainParts;
use crate::model::fields::Field;

/// A mesh in world units, node transforms applied; not yet morphed or skinned.
///
/// All vertex arrays are as long as `positions`, or empty when no enabled effect asks for them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions. Of skinned parts: in bind space, which the bones take to the world.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Unit tangents; w is the handedness: bitangent = w cross(N, T).
    pub tangents: Vec<Vec4>,
    /// glTF texture coordinates: origin at the image's top left.
    pub uvs: Vec<Vec2>,
    /// Those by which it lies in the UV atlas, where they are another set than the maps'.
    pub own_atlas_uvs: Vec<Vec2>,
    /// Vertex indices, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Morph targets.
    pub morphs: Vec<Morph>,
    /// Bone indices of each vertex, into `bones`.
    pub joints: Vec<[u16; 4]>,
    /// Bone weights of each vertex, summing to 1.
    pub weights: Vec<[f32; 4]>,
    /// Bone matrices (joint to world times inverse bind) at the scene's time.
    pub bones: Vec<Mat4>,
    /// Numbers that rules read by name, those alone that enabled effects ask for.
    pub fields: Vec<VertexField>,
    /// What of it is not skin; none where all of it is.
    pub plain: Option<Arc<PlainParts>>,
}

impl Mesh {
    /// Its vertices before they are moved.
    #[must_use]
    pub fn rest(&self) -> RestSurface {
        RestSurface { positions: self.positions.clone(), normals: self.normals.clone() }
    }

    /// The texture coordinates by which it lies in the UV atlas.
    #[must_use]
    pub fn atlas_uvs(&self) -> &[Vec2] {
        own_or(&self.own_atlas_uvs, &self.uvs)
    }
}

/// Texture coordinates of the atlas: the maps' where it has none of its own.
fn own_or<'a>(own: &'a [Vec2], of_maps: &'a [Vec2]) -> &'a [Vec2] {
    if own.is_empty() { of_maps } else { own }
}

/// One morph target: what is added at weight 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Morph {
    /// The target's name in the file, or its number.
    pub name: String,
    /// Its weight in this scene.
    pub weight: f32,
    /// Whether the mesh will go through an animation that gives it another weight than 0.
    pub animated: bool,
    /// Position deltas, one a vertex.
    pub positions: Vec<Vec3>,
    /// Normal deltas, one a vertex; empty when the file has none.
    pub normals: Vec<Vec3>,
}

/// A mesh after the vertex stage's geometry: morphed, skinned, in the world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosedMesh {
    /// World positions.
    pub positions: Vec<Vec3>,
    /// Unit world normals.
    pub normals: Vec<Vec3>,
    /// Unit world tangents, handedness in w; empty when not asked for.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates; empty when not asked for.
    pub uvs: Vec<Vec2>,
    /// Those by which it lies in the UV atlas, where they are another set than the maps'.
    pub own_atlas_uvs: Vec<Vec2>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// Numbers that rules read by name.
    pub fields: Vec<VertexField>,
    /// What of it is not skin; none where all of it is.
    pub plain: Option<Arc<PlainParts>>,
    /// Where its vertices stand at rest, for whoever draws noise by that; none where this is all that is known of it.
    pub rest: Option<Arc<RestSurface>>,
}

/// The vertices of a mesh before bones, morph targets and animation move them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestSurface {
    /// Positions.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
}

impl PosedMesh {
    /// The texture coordinates by which it lies in the UV atlas.
    #[must_use]
    pub fn atlas_uvs(&self) -> &[Vec2] {
        own_or(&self.own_atlas_uvs, &self.uvs)
    }

    /// The same without what has holes or blends, whose triangles have no area then.
    #[must_use]
    pub fn without_open(mut self) -> Self {
        if let Some(plain) = &self.plain {
            let open = (0..).zip(&mut self.triangles).filter(|(triangle, _)| plain.is_open(*triangle));
            open.for_each(|(_, corners)| *corners = [corners[0]; 3]);
        }
        self
    }

    /// Its triangles, of which those that are not skin have no area: for what the skin's own texture coordinates are of.
    #[must_use]
    pub fn skin_triangles(&self) -> Cow<'_, [[u32; 3]]> {
        let Some(plain) = &self.plain else { return Cow::Borrowed(&self.triangles) };
        let one = |(&[a, b, c], of): (&[u32; 3], &Option<u16>)| if of.is_some() { [a; 3] } else { [a, b, c] };
        Cow::Owned(self.triangles.iter().zip(&plain.of_triangle).map(one).collect())
    }
}

/// A field of every vertex, its numbers one after the other; no pose moves it.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexField {
    /// Which.
    pub field: Field,
    /// As many a vertex as the field has.
    pub numbers: Vec<f32>,
}

impl VertexField {
    /// Of no vertices yet.
    #[must_use]
    pub const fn new(field: Field) -> Self {
        Self { field, numbers: Vec::new() }
    }

    /// The field's numbers of a vertex.
    #[must_use]
    pub fn of(&self, vertex: usize) -> &[f32] {
        let count = self.field.info().numbers;
        &self.numbers[vertex * count..][..count]
    }
}

impl PosedMesh {
    /// Whether its skin's texture coordinates tell places apart: where a file has none, all of them are 0.
    #[must_use]
    pub fn is_unwrapped(&self) -> bool {
        let skin = self.skin_triangles();
        // Those that are not skin have no corners apart.
        let mut corners = skin.iter().filter(|[a, b, _]| a != b).flatten().map(|&i| self.uvs.get(i as usize));
        let first = corners.next().flatten();
        first.is_some() && corners.any(|uv| uv != first)
    }
}

/// How far texture coordinates may lie outside the atlas: a rounding of what was meant to be its border.
const BORDER: f32 = 1e-5;

/// The tile, along u and v, of the first texture coordinates that lie outside the unit square; `None` where all of a
/// mesh lie in its UV atlas.
#[must_use]
pub fn tile_outside_atlas(uvs: &[Vec2]) -> Option<[f32; 2]> {
    let inside = |x: f32| (-BORDER..=1.0 + BORDER).contains(&x);
    let outside = uvs.iter().find(|uv| !inside(uv.x) || !inside(uv.y))?;
    Some([outside.x.floor(), outside.y.floor()])
}

//! One primitive: its attributes, as long as each other, and its triangles.

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};
use gltf::json;
use json::Index;
use json::accessor::Accessor;
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;

use super::document::Document;
use super::{Ask, Tangents, TextureUv, Uvs};
use crate::error::{SceneError, Warnings, warn};
use crate::model::fields::{Field, FieldInfo};

/// Places and what morph targets add to them are no larger: times weights, and squared, an f32 still holds them.
pub(super) const LARGEST: f32 = 1e15;

/// Whether a place, or what is added to one, can be computed with.
fn is_sound(v: &Vec3) -> bool {
    // A maximum may pass over NaN.
    v.abs().max_element() <= LARGEST && v.is_finite()
}

/// A primitive in its node's space.
pub(super) struct Part {
    pub positions: Vec<Vec3>,
    pub normals: Option<Vec<Vec3>>,
    pub tangents: Option<Vec<Vec4>>,
    pub uvs: Option<Vec<Vec2>>,
    /// Of the UV atlas, where these are others.
    pub atlas_uvs: Option<Vec<Vec2>>,
    /// The numbers of each requested field.
    pub fields: Vec<Vec<f32>>,
    /// Bone indices (into the skin) and weights.
    pub influences: Option<Vec<Influence>>,
    /// Colours of its vertices, linear, with alpha; where they are requested.
    pub colors: Option<Vec<[f32; 4]>>,
    pub triangles: Vec<[u32; 3]>,
    pub targets: Vec<Target>,
}

/// Up to 4 bones of a vertex (padded with weight 0), and their weights.
pub(super) type Influence = ([u16; 4], [f32; 4]);

/// A morph target's deltas.
pub(super) struct Target {
    pub positions: Option<Vec<Vec3>>,
    pub normals: Option<Vec<Vec3>>,
}

/// How often something was mended over all primitives; each is said once, at the end.
#[derive(Default)]
pub(super) struct Mended {
    pub not_triangles: usize,
    pub renormalised: usize,
    pub folded: usize,
    pub unbound: usize,
    pub degenerate: usize,
    pub bad_normals: usize,
    pub bad_tangents: usize,
}

impl Mended {
    /// Say what was mended.
    pub(super) fn report(&self, path: &Path, warnings: &mut Warnings) {
        let mut say = |count: usize, message: &str| {
            if count > 0 {
                warn(warnings, path, format!("{count} {message}"));
            }
        };
        say(self.not_triangles, "primitives are points or lines: left out");
        say(self.renormalised, "vertices have bone weights that do not sum to 1: renormalised");
        say(self.folded, "vertices have more than 4 bones: the 4 largest weights were kept");
        say(self.unbound, "vertices of a skin have no bone weights: bound to their first bone");
        say(self.degenerate, "degenerate triangles: left out");
        say(self.bad_normals, "vertices have normals without a direction: computed from the triangles");
        say(
            self.bad_tangents,
            "vertices have tangents without a direction: computed from the texture coordinates",
        );
    }
}

impl Document {
    /// Read a primitive; none when it is of points or lines. `bones` is the number of bones of its
    /// node's skin, where there is one and it is requested.
    pub(super) fn part(
        &self,
        primitive: &Primitive,
        place: &str,
        ask: &Ask,
        bones: Option<usize>,
        mended: &mut Mended,
    ) -> Result<Option<Part>, SceneError> {
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            _ => {
                mended.not_triangles += 1;
                return Ok(None);
            }
        };
        let at = |error: SceneError| error.at(place);
        let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(positions) = attribute(Semantic::Positions) else {
            return Err(at(self.error("has no positions", "Export it anew (uncompressed)")));
        };
        let positions = self.vectors(positions)?;
        let count = positions.len();
        if let Some(i) = positions.iter().position(|p| !is_sound(p)) {
            let [x, y, z] = positions[i].to_array();
            return Err(self
                .error(
                    format!("stands at ({x}, {y}, {z})"),
                    "Repair the mesh: positions must be finite, at most 1e15 in size",
                )
                .at(format!("{place}, vertex {i}")));
        }
        let same = |length: usize, what: &str| {
            if length == count {
                return Ok(());
            }
            Err(at(self.error(format!("has {count} positions but {length} {what}"), "Export it anew")))
        };
        let normals = attribute(Semantic::Normals).map(|index| self.vectors(index)).transpose()?;
        same(normals.as_ref().map_or(count, Vec::len), "normals")?;
        let tangents = match attribute(Semantic::Tangents).filter(|_| ask.tangents == Tangents::Exact) {
            Some(index) => Some(self.floats::<4>(index)?.into_iter().map(Vec4::from).collect::<Vec<_>>()),
            None => None,
        };
        same(tangents.as_ref().map_or(count, Vec::len), "tangents")?;
        let uvs = self.uvs(primitive, place, (ask.uv, ask.uvs))?;
        let atlas_uvs = match ask.atlas_uv {
            Some(uv) => self.uvs(primitive, place, (uv, Uvs::Required))?,
            None => None,
        };
        for uvs in [&uvs, &atlas_uvs].into_iter().flatten() {
            same(uvs.len(), "texture coordinates")?;
        }
        let colors = match attribute(Semantic::Colors(0)).filter(|_| ask.colors) {
            Some(index) => Some(self.colors(index, place)?),
            None => None,
        };
        same(colors.as_ref().map_or(count, Vec::len), "colours")?;
        let fields = self.fields(primitive, place, ask, count)?;
        let influences = match bones {
            Some(bones) => self.influences(primitive, bones, count, place, mended)?,
            None => None,
        };
        let mut targets = Vec::new();
        for target in primitive.targets.iter().flatten().filter(|_| ask.morphs) {
            let read = |index: Option<Index<Accessor>>| index.map(|index| self.vectors(index)).transpose();
            let target = Target { positions: read(target.positions)?, normals: read(target.normals)? };
            for deltas in [&target.positions, &target.normals].into_iter().flatten() {
                same(deltas.len(), "morph deltas")?;
                if let Some(i) = deltas.iter().position(|d| !is_sound(d)) {
                    let place = format!("{place}, morph target {}, vertex {i}", targets.len());
                    return Err(self
                        .error("has a delta that is not finite, or beyond 1e15", "Repair the mesh")
                        .at(place));
                }
            }
            targets.push(target);
        }
        let triangles = self.triangles(primitive, mode, count, place)?;
        Ok(Some(Part {
            positions,
            normals,
            tangents,
            uvs,
            atlas_uvs,
            fields,
            influences,
            colors,
            triangles,
            targets,
        }))
    }

    fn vectors(&self, index: Index<Accessor>) -> Result<Vec<Vec3>, SceneError> {
        Ok(self.floats::<3>(index)?.into_iter().map(Vec3::from).collect())
    }

    /// A set of texture coordinates, as it is wanted.
    fn uvs(
        &self,
        primitive: &Primitive,
        place: &str,
        (uv, wanted): (TextureUv, Uvs),
    ) -> Result<Option<Vec<Vec2>>, SceneError> {
        let set = uv.set;
        let index = primitive.attributes.get(&Checked::Valid(Semantic::TexCoords(set))).copied();
        let Some(index) = index.filter(|_| wanted != Uvs::None) else {
            if wanted == Uvs::Required {
                return Err(self
                    .error(
                        format!("has no texture coordinates {set} (TEXCOORD_{set}), but maps or texels are to be looked up by them"),
                        "Unwrap the mesh, name another set (`uv_set` in [diffusion]), or take the maps, or the effects that \
                         look something up, out of the scene",
                    )
                    .at(place));
            }
            return Ok(None);
        };
        let uvs = uv.moved(self.floats::<2>(index)?.into_iter().map(Vec2::from).collect());
        match uvs.iter().position(|uv| !uv.is_finite()) {
            None => Ok(Some(uvs)),
            Some(i) => Err(self
                .error("has a texture coordinate that is not finite", "Repair the mesh")
                .at(format!("{place}, vertex {i}"))),
        }
    }

    /// Colours of vertices, of three numbers or four.
    pub(super) fn colors(&self, index: Index<Accessor>, place: &str) -> Result<Vec<[f32; 4]>, SceneError> {
        let kind = self.get(&self.root.accessors, index, "accessor")?.type_;
        let colors: Vec<[f32; 4]> = match kind {
            Checked::Valid(json::accessor::Type::Vec4) => self.floats::<4>(index)?,
            _ => self.floats::<3>(index)?.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect(),
        };
        match colors.iter().position(|color| color.iter().any(|c| !c.is_finite())) {
            None => Ok(colors),
            Some(i) => Err(self
                .error("has a colour that is not finite", "Repair the mesh")
                .at(format!("{place}, vertex {i}"))),
        }
    }

    /// The requested fields, from the attributes of their names: `_CURVATURE` of the field `curvature`. A part that
    /// lacks one has what stands in for it.
    fn fields(
        &self,
        primitive: &Primitive,
        place: &str,
        ask: &Ask,
        count: usize,
    ) -> Result<Vec<Vec<f32>>, SceneError> {
        let read = |field: Field| {
            let FieldInfo { name, numbers, neutral, .. } = *field.info();
            let semantic = Semantic::Extras(name.to_uppercase());
            let Some(&index) = primitive.attributes.get(&Checked::Valid(semantic)) else {
                return Ok(vec![neutral; numbers * count]);
            };
            let read: Vec<f32> = match numbers {
                1 => self.floats::<1>(index)?.into_flattened(),
                2 => self.floats::<2>(index)?.into_flattened(),
                _ => self.floats::<3>(index)?.into_flattened(),
            };
            let attribute = format!("_{}", name.to_uppercase());
            if read.len() != numbers * count {
                let vertices = read.len() / numbers;
                let wrong = format!("has {count} positions but {vertices} of the attribute {attribute}");
                return Err(self.error(wrong, "Export it anew").at(place));
            }
            match read.iter().position(|x| !x.is_finite()) {
                None => Ok(read),
                Some(i) => {
                    let place = format!("{place}, vertex {}", i / numbers);
                    let wrong = format!("has a number in {attribute} that is not finite");
                    Err(self.error(wrong, "Repair the mesh").at(place))
                }
            }
        };
        ask.fields.iter().map(read).collect()
    }

    /// The triangles of a list, strip or fan, indexed or not.
    fn triangles(
        &self,
        primitive: &Primitive,
        mode: Mode,
        count: usize,
        place: &str,
    ) -> Result<Vec<[u32; 3]>, SceneError> {
        let indices: Vec<u32> = match primitive.indices {
            Some(index) => self.integers::<1>(index)?.into_iter().flatten().collect(),
            // Accessors are bounded far below the range of u32.
            None => (0..count as u32).collect(),
        };
        if let Some(i) = indices.iter().position(|&index| index as usize >= count) {
            return Err(self
                .error(
                    format!("names vertex {}, but there are {count}", indices[i]),
                    "The file is damaged: export it anew",
                )
                .at(format!("{place}, index {i}")));
        }
        Ok(match mode {
            Mode::TriangleStrip => indices
                .windows(3)
                .enumerate()
                .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
                .collect(),
            Mode::TriangleFan => {
                indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], indices[0]]).collect()
            }
            _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        })
    }
}

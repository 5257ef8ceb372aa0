//! Every primitive of the scene in one mesh: placed by its node, or left to its bones.

use std::sync::Arc;

use glam::{DMat3, DMat4, DVec3, Mat4, Vec2, Vec3, Vec4};
use gltf::json;

use super::document::Document;
use super::nodes::Nodes;
use super::plain::Split;
use super::primitive::{Mended, Part, Target};
use super::{Ask, Tangents, Uvs, places};
use crate::error::{SceneError, Warnings, warn};
use crate::mesh::{Mesh, Morph, VertexField};
use crate::{normals, tangents};

/// The most vertices, triangles, and vertices times morph targets of a mesh: files can name the same
/// primitive many times.
const MOST: usize = 1 << 26;

impl Document {
    /// Whether the scene's meshes have morph targets, and whether any has a skin.
    pub(crate) fn carries(&self) -> Result<(bool, bool), SceneError> {
        let nodes = self.nodes(None)?;
        let (mut morphs, mut skins) = (false, false);
        for node in nodes.in_scene.iter().map(|&i| &self.root.nodes[i]) {
            if let Some(index) = node.mesh {
                let mesh = self.get(&self.root.meshes, index, "mesh")?;
                morphs |= mesh.primitives.iter().any(|p| p.targets.as_ref().is_some_and(|t| !t.is_empty()));
                skins |= node.skin.is_some();
            }
        }
        Ok((morphs, skins))
    }

    /// Whether a skin at rest puts its mesh elsewhere than its node does, so that leaving the skin out
    /// shows. A skin that cannot be read does not count here: nobody asked for it.
    pub(crate) fn skin_displaces(&self) -> Result<bool, SceneError> {
        let nodes = self.nodes(None)?;
        let moves = |&i: &usize| {
            let node = &self.root.nodes[i];
            let Some(skin) = node.skin.filter(|_| node.mesh.is_some()) else { return false };
            let Some(skin) = self.root.skins.get(skin.value()) else { return false };
            let bones = self.bones(skin, "", &nodes).unwrap_or_default();
            let world = nodes.world[i].as_mat4();
            // Bind matrices are inverted and stored in f32.
            bones.iter().any(|bone| !bone.abs_diff_eq(world, 1e-4 * (1.0 + largest(world))))
        };
        Ok(nodes.in_scene.iter().any(moves))
    }

    /// The scene's triangles as one mesh, with what `ask` wants of it.
    pub(crate) fn mesh(&self, ask: &Ask, warnings: &mut Warnings) -> Result<Mesh, SceneError> {
        let mut builder = Builder {
            document: self,
            ask,
            nodes: self.nodes(ask.time)?,
            mesh: Mesh { fields: ask.fields.iter().map(VertexField::new).collect(), ..Mesh::default() },
            identity: None,
            skins: vec![None; self.root.skins.len()],
            split: ask.skin.as_deref().map(Split::new),
            mended: Mended::default(),
        };
        for i in 0..builder.nodes.in_scene.len() {
            builder.node(builder.nodes.in_scene[i], warnings)?;
        }
        builder.finish(warnings)
    }
}

struct Builder<'a> {
    document: &'a Document,
    ask: &'a Ask,
    nodes: Nodes,
    mesh: Mesh,
    /// The bone that moves nothing, for vertices that stand in the world already.
    identity: Option<u16>,
    /// Where each skin's bones begin.
    skins: Vec<Option<usize>>,
    /// What is skin, where a scene says.
    split: Option<Split<'a>>,
    mended: Mended,
}

impl Builder<'_> {
    fn node(&mut self, node: usize, warnings: &mut Warnings) -> Result<(), SceneError> {
        let document = self.document;
        let (root, world) = (&document.root, self.nodes.world[node]);
        let Some(index) = root.nodes[node].mesh else { return Ok(()) };
        let mesh = document.get(&root.meshes, index, "mesh")?;
        let name = match &mesh.name {
            Some(name) => format!("mesh `{name}`"),
            None => format!("mesh {}", index.value()),
        };
        let skin = match root.nodes[node].skin.filter(|_| self.ask.bones) {
            Some(skin) => Some(self.skin(skin)?),
            None => None,
        };
        let slots = if self.ask.morphs { self.slots(node, mesh, warnings)? } else { Vec::new() };
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("{name}, primitive {i}");
            let bones = skin.map(|(_, bones)| bones);
            let plain = match &mut self.split {
                Some(split) => {
                    let mesh = document.mesh_name(index.value(), &root.nodes[node]);
                    split.of(document, &mesh, primitive, warnings)?
                }
                None => None,
            };
            // What is not skin is drawn by maps of its own, and does not lie in the atlas.
            let loose = plain.map(|plain| Ask {
                uvs: if self.ask.uvs == Uvs::None { Uvs::None } else { Uvs::Optional },
                uv: plain.uv,
                atlas_uv: None,
                colors: true,
                ..self.ask.clone()
            });
            let ask = loose.as_ref().unwrap_or(self.ask);
            if let Some(part) = document.part(primitive, &place, ask, bones, &mut self.mended)? {
                if let Some(split) = &mut self.split {
                    split.add(&part, plain);
                }
                self.append(part, &place, world, skin.map(|(first, _)| first), &slots)?;
            }
        }
        Ok(())
    }

    /// Where a skin's bones begin in the palette, and how many it has.
    fn skin(&mut self, index: json::Index<json::Skin>) -> Result<(usize, usize), SceneError> {
        let skin = self.document.get(&self.document.root.skins, index, "skin")?;
        let first = match self.skins[index.value()] {
            Some(first) => first,
            None => {
                let place = format!("skin {}", index.value());
                let bones = self.document.bones(skin, &place, &self.nodes)?;
                let first = self.mesh.bones.len();
                self.mesh.bones.extend(bones);
                self.check(self.mesh.bones.len(), usize::from(u16::MAX), "bones")?;
                self.skins[index.value()] = Some(first);
                first
            }
        };
        Ok((first, skin.joints.len()))
    }

    fn check(&self, count: usize, most: usize, what: &str) -> Result<(), SceneError> {
        if count <= most {
            return Ok(());
        }
        Err(self.document.error(format!("has more than {most} {what}"), "Simplify it"))
    }

    /// The morph slots of a node's targets; of those that share one, the first one's weight counts.
    fn slots(
        &mut self,
        node: usize,
        mesh: &json::Mesh,
        warnings: &mut Warnings,
    ) -> Result<Vec<usize>, SceneError> {
        let mut names: Vec<String> = self.mesh.morphs.iter().map(|morph| morph.name.clone()).collect();
        let slots = places::slots(mesh, &mut names);
        let animated = self.nodes.weights[node].as_ref();
        let weights = animated.or(self.document.root.nodes[node].weights.as_ref()).or(mesh.weights.as_ref());
        // Weights that the scene gives hold through the whole animation.
        let clip = match self.ask.clip && self.ask.morph_weights.is_none() {
            true => self.document.moved_targets(node)?,
            false => Vec::new(),
        };
        for (target, &slot) in slots.iter().enumerate() {
            let weight = weights.and_then(|weights| weights.get(target)).copied().unwrap_or(0.0);
            let animated = clip.get(target).copied().unwrap_or(false);
            if slot == self.mesh.morphs.len() {
                let name = names[slot].clone();
                self.mesh.morphs.push(Morph { name, weight, animated, ..Morph::default() });
            } else if self.mesh.morphs[slot].weight != weight && self.ask.morph_weights.is_none() {
                let Morph { name, weight: first, .. } = &self.mesh.morphs[slot];
                let message =
                    format!("morph target `{name}` has the weights {first} and {weight}: {first} is used");
                warn(warnings, &self.document.path, message);
            }
        }
        Ok(slots)
    }

    /// Add a primitive; `first` is where its skin's bones begin, if it has one.
    fn append(
        &mut self,
        mut part: Part,
        place: &str,
        world: DMat4,
        first: Option<usize>,
        slots: &[usize],
    ) -> Result<(), SceneError> {
        let (base, count) = (self.mesh.positions.len(), part.positions.len());
        self.check(
            (base + count).saturating_mul(self.mesh.morphs.len().max(1)),
            MOST,
            "vertices (times morphs)",
        )?;
        self.check(self.mesh.triangles.len() + part.triangles.len(), MOST, "triangles")?;
        match (part.influences.take(), first) {
            (Some(influences), Some(first)) => {
                let bone = |joint: u16| first as u16 + joint;
                self.mesh.joints.extend(influences.iter().map(|(joints, _)| joints.map(bone)));
                self.mesh.weights.extend(influences.iter().map(|(_, weights)| weights));
            }
            _ => {
                place_in_world(&mut part, world);
                if let Some(i) = part.positions.iter().position(|p| !p.is_finite()) {
                    let place = format!("{place}, vertex {i}");
                    return Err(self
                        .document
                        .error("is moved beyond all bounds", "Export it anew")
                        .at(place));
                }
                if self.ask.bones {
                    let rest = self.rest_bone();
                    self.mesh.joints.resize(base + count, [rest, 0, 0, 0]);
                    self.mesh.weights.resize(base + count, [1.0, 0.0, 0.0, 0.0]);
                }
            }
        }
        let mesh = &mut self.mesh;
        mesh.positions.append(&mut part.positions);
        let given = part.normals.is_some();
        mesh.normals.extend(part.normals.unwrap_or_else(|| vec![Vec3::ZERO; count]).into_iter().map(|n| {
            let n = n.as_dvec3().normalize_or_zero().as_vec3();
            self.mended.bad_normals += usize::from(given && n == Vec3::ZERO);
            n
        }));
        if self.ask.uvs != Uvs::None {
            mesh.uvs.extend(part.uvs.unwrap_or_else(|| vec![Vec2::ZERO; count]));
        }
        if self.ask.atlas_uv.is_some() {
            mesh.own_atlas_uvs.extend(part.atlas_uvs.unwrap_or_else(|| vec![Vec2::ZERO; count]));
        }
        for (field, numbers) in mesh.fields.iter_mut().zip(part.fields) {
            field.numbers.extend(numbers);
        }
        if self.ask.tangents == Tangents::Exact {
            let given = part.tangents.is_some();
            mesh.tangents.extend(part.tangents.unwrap_or_else(|| vec![Vec4::ZERO; count]).into_iter().map(
                |t| {
                    let direction = t.truncate().as_dvec3().normalize_or_zero().as_vec3();
                    self.mended.bad_tangents += usize::from(given && direction == Vec3::ZERO);
                    direction.extend(if t.w < 0.0 { -1.0 } else { 1.0 })
                },
            ));
        }
        for (target, &slot) in part.targets.into_iter().zip(slots) {
            mesh.morphs[slot].put(target, base);
        }
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + base as u32)));
        Ok(())
    }

    fn rest_bone(&mut self) -> u16 {
        // `finish` checks that the palette, with this bone, stays within u16.
        *self.identity.get_or_insert_with(|| {
            self.mesh.bones.push(Mat4::IDENTITY);
            (self.mesh.bones.len() - 1) as u16
        })
    }

    fn finish(mut self, warnings: &mut Warnings) -> Result<Mesh, SceneError> {
        let document = self.document;
        self.check(self.mesh.bones.len(), usize::from(u16::MAX), "bones")?;
        let count = self.mesh.positions.len();
        for morph in &mut self.mesh.morphs {
            morph.positions.resize(count, Vec3::ZERO);
            if !morph.normals.is_empty() {
                morph.normals.resize(count, Vec3::ZERO);
            }
        }
        if let Some(weights) = &self.ask.morph_weights {
            let (given, morphs) = (weights.len(), &mut self.mesh.morphs);
            if count == 0 {
                return Err(
                    document.error("has nothing in its scene: the mesh is empty", "Export the mesh with it")
                );
            }
            if given != morphs.len() {
                let names: Vec<&str> = morphs.iter().map(|morph| morph.name.as_str()).collect();
                return Err(document.error(
                    format!("has {} morph targets, but morph_weights gives {given} weights", morphs.len()),
                    &format!("Give one weight for each of: {}", names.join(", ")),
                ));
            }
            morphs.iter_mut().zip(weights).for_each(|(morph, &weight)| morph.weight = weight);
        }
        let kept = normals::drop_degenerate(&mut self.mesh);
        self.mended.degenerate = kept.iter().filter(|kept| !**kept).count();
        if self.mesh.triangles.is_empty() {
            return Err(document.error(
                "has no triangles (that have an area) in its scene: the mesh is empty",
                "Export a mesh of triangles, in the file's default scene",
            ));
        }
        if let Some(split) = self.split.take() {
            self.mesh.plain = split.finish(document, &kept)?.map(Arc::new);
        }
        normals::complete(&mut self.mesh);
        match self.ask.tangents {
            Tangents::None => {}
            Tangents::AnyFrame => tangents::any_frame(&mut self.mesh),
            Tangents::Exact => {
                tangents::complete(&mut self.mesh);
                self.check(self.mesh.positions.len(), MOST, "vertices")?;
            }
        }
        self.mended.report(&document.path, warnings);
        Ok(self.mesh)
    }
}

/// The greatest magnitude in a matrix.
fn largest(matrix: Mat4) -> f32 {
    matrix.to_cols_array().iter().fold(0.0, |most, x| most.max(x.abs()))
}

impl Morph {
    /// Write a primitive's deltas, whose vertices begin at `base`.
    fn put(&mut self, target: Target, base: usize) {
        let write = |to: &mut Vec<Vec3>, deltas: Option<Vec<Vec3>>| {
            if let Some(deltas) = deltas {
                to.resize(base, Vec3::ZERO);
                to.extend(deltas);
            }
        };
        write(&mut self.positions, target.positions);
        write(&mut self.normals, target.normals);
    }
}

/// Take a primitive to the world: normals by the inverse transpose, deltas with what they add to, and
/// triangles turned round where the transform mirrors.
fn place_in_world(part: &mut Part, world: DMat4) {
    if world == DMat4::IDENTITY {
        return;
    }
    let linear = DMat3::from_mat4(world);
    let mirrored = linear.determinant() < 0.0;
    let sign = if mirrored { -1.0 } else { 1.0 };
    let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
    // Cofactors are the determinant times the inverse transpose, and exist for flat transforms too.
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
    let point = |p: &Vec3| world.transform_point3(p.as_dvec3()).as_vec3();
    part.positions.iter_mut().for_each(|p| *p = point(p));
    let mut lengths = Vec::new();
    if let Some(normals) = &mut part.normals {
        for normal in normals {
            let n: DVec3 = cofactors * normal.as_dvec3();
            // A delta adds to a normal as long as it was in the file.
            let length = n.length();
            lengths.push(if length > 0.0 { normal.as_dvec3().length() / length } else { 0.0 });
            *normal = n.normalize_or_zero().as_vec3() * normal.length();
        }
    }
    for tangent in part.tangents.iter_mut().flatten() {
        *tangent = (linear * tangent.truncate().as_dvec3()).as_vec3().extend(tangent.w * sign as f32);
    }
    for target in &mut part.targets {
        target.positions.iter_mut().flatten().for_each(|d| *d = (linear * d.as_dvec3()).as_vec3());
        for (delta, &length) in target.normals.iter_mut().flatten().zip(&lengths) {
            *delta = (cofactors * delta.as_dvec3() * length).as_vec3();
        }
    }
    if mirrored {
        part.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

//! Bones, and how much each moves a vertex.

use glam::{DMat4, Mat4};
use gltf::json;
use json::mesh::{Primitive, Semantic};
use json::validation::Checked;

use super::document::Document;
use super::nodes::Nodes;
use super::primitive::{Influence, Mended};
use crate::error::SceneError;

/// Beyond this the sum of a vertex' weights is said to be off: above the rounding of 8-bit weights
/// that were made to sum to 255, below what a viewer would notice.
const SUM_TOLERANCE: f32 = 1e-3;

impl Document {
    /// The bones of a skin at the nodes' time: joint to world times inverse bind.
    pub(super) fn bones(
        &self,
        skin: &json::Skin,
        place: &str,
        nodes: &Nodes,
    ) -> Result<Vec<Mat4>, SceneError> {
        let inverse = match skin.inverse_bind_matrices {
            None => vec![DMat4::IDENTITY; skin.joints.len()],
            Some(index) => {
                let matrices = self.floats::<16>(index)?;
                matrices.iter().map(|m| DMat4::from_cols_array(&m.map(f64::from))).collect()
            }
        };
        if inverse.len() < skin.joints.len() {
            return Err(self
                .error(
                    format!("has {} joints but {} inverse bind matrices", skin.joints.len(), inverse.len()),
                    "Export it anew",
                )
                .at(place));
        }
        let mut bones = Vec::with_capacity(skin.joints.len());
        for (joint, inverse) in skin.joints.iter().zip(inverse) {
            self.get(&self.root.nodes, *joint, "node")?;
            let bone = (nodes.world[joint.value()] * inverse).as_mat4();
            if !bone.is_finite() {
                return Err(self.error("has a bone that is not finite", "Export it anew").at(place));
            }
            bones.push(bone);
        }
        Ok(bones)
    }

    /// Up to 4 bones of each vertex, with weights that sum to 1; none when the primitive has none.
    ///
    /// More than 4 are cut to the largest; sums that are off are renormalised; both are counted.
    pub(super) fn influences(
        &self,
        primitive: &Primitive,
        bones: usize,
        count: usize,
        place: &str,
        mended: &mut Mended,
    ) -> Result<Option<Vec<Influence>>, SceneError> {
        let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let mut sets = Vec::new();
        while let (Some(joints), Some(weights)) =
            (attribute(Semantic::Joints(sets.len() as u32)), attribute(Semantic::Weights(sets.len() as u32)))
        {
            let set = (self.integers::<4>(joints)?, self.floats::<4>(weights)?);
            if set.0.len() != count || set.1.len() != count {
                return Err(self
                    .error(
                        format!("has {count} positions but another number of bone weights"),
                        "Export it anew",
                    )
                    .at(place));
            }
            sets.push(set);
        }
        if sets.is_empty() {
            return Ok(None);
        }
        let mut influences = Vec::with_capacity(count);
        let mut all: Vec<(u32, f32)> = Vec::new();
        for i in 0..count {
            all.clear();
            all.extend(sets.iter().flat_map(|(joints, weights)| joints[i].into_iter().zip(weights[i])));
            let refuse = |what: String| {
                let error = self.error(what, "Repair the skin's weights, or export it anew");
                Err(error.at(format!("{place}, vertex {i}")))
            };
            if let Some((_, weight)) = all.iter().find(|(_, weight)| !weight.is_finite()) {
                return refuse(format!("has the bone weight {weight}"));
            }
            if let Some((bone, _)) =
                all.iter().find(|&&(bone, weight)| weight > 0.0 && bone as usize >= bones)
            {
                return refuse(format!("names bone {bone}, but the skin has {bones}"));
            }
            influences.push(strongest(&mut all, bones, mended));
        }
        Ok(Some(influences))
    }
}

/// The 4 largest weights of a vertex, summing to 1.
fn strongest(all: &mut [(u32, f32)], bones: usize, mended: &mut Mended) -> Influence {
    // Stable, so that equal weights keep the file's order.
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    mended.folded += usize::from(all.get(4).is_some_and(|&(_, weight)| weight > 0.0));
    let mut joints = [0_u16; 4];
    let mut weights = [0.0_f32; 4];
    for (i, &(bone, weight)) in all.iter().take(4).enumerate().filter(|(_, (_, weight))| *weight > 0.0) {
        // The palette has at most 2^16 bones.
        (joints[i], weights[i]) = (bone as u16, weight);
    }
    let total: f32 = all.iter().map(|&(_, weight)| weight).sum();
    let sum: f32 = weights.iter().sum();
    if sum > 0.0 {
        mended.renormalised += usize::from((total - 1.0).abs() > SUM_TOLERANCE);
        return (joints, weights.map(|weight| weight / sum));
    }
    mended.unbound += 1;
    let first = all.iter().map(|&(bone, _)| bone).find(|&bone| (bone as usize) < bones).unwrap_or(0);
    ([first as u16, 0, 0, 0], [1.0, 0.0, 0.0, 0.0])
}

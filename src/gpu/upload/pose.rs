//! Another pose of the mesh in the place of the one that is on the device: what of the uploads moves with it.

use glam::Mat4;

use super::{Bound, Uploads};
use crate::bake::PoseBake;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::model::fields::Fields;
use crate::scene::mesh::Mesh;
use crate::shader::{Attribute, Resource};
use crate::vertices;

impl Uploads {
    /// The whole mesh in a pose of those bones and weights, where what is on the device goes by more than these: shadows,
    /// what is found at vertices and what reaches parts that are not skin are of the posed surface, which the processor knows of the whole mesh.
    pub(crate) fn posed_whole(&self, bones: &[Mat4], weights: &[f32]) -> Option<Mesh> {
        let mesh = &self.content.scene.mesh;
        let finds = self.attributes.keys().any(|attribute| matches!(attribute, Attribute::Field(_)));
        if self.shadow_maps.is_none() && !finds && mesh.plain.is_none() {
            return None;
        }
        let mut mesh = Mesh { bones: self.posed(bones), ..mesh.clone() };
        mesh.morphs.iter_mut().zip(weights).for_each(|(morph, weight)| morph.weight = *weight);
        Some(mesh)
    }

    /// Put other bones in place of those that are on the device.
    pub(crate) fn set_pose(&self, gpu: &Gpu, bones: &[Mat4]) {
        if let Some(Bound::Buffer(buffer)) = self.resources.get(&Resource::Bones) {
            let rows = vertices::bones(&self.posed(bones));
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&rows));
        }
    }

    /// The mesh's bones, those that are given in the place of its own.
    fn posed(&self, bones: &[Mat4]) -> Vec<Mat4> {
        let mut posed = self.content.scene.mesh.bones.clone();
        posed.iter_mut().zip(bones).for_each(|(old, new)| *old = *new);
        posed
    }

    /// Put another pose of the mesh (the same vertices at another time) in place of the one that is on the
    /// device; and what is baked of that pose, where it has bakes of its own, in place of the scene's.
    pub(crate) fn set_mesh(
        &mut self,
        gpu: &Gpu,
        mesh: &Mesh,
        own: Option<&PoseBake>,
    ) -> Result<(), GpuError> {
        if let Some(corners) = &mut self.corners {
            corners.set_mesh(gpu, mesh);
        }
        if let Some(maps) = &mut self.shadow_maps {
            maps.set_mesh(gpu, mesh);
        }
        let occlusion = own.and_then(|own| own.occlusion.as_ref());
        let occluded = occlusion.is_some();
        let occlusion = occlusion.or(self.content.occlusion.as_deref());
        // What is found at vertices is found anew in this pose.
        let finds = self.attributes.keys().filter_map(|attribute| match attribute {
            Attribute::Field(field) => Some(*field),
            _ => None,
        });
        let fields = self.fields(gpu, mesh, own, Fields::of(finds))?;
        for (&attribute, buffer) in &self.attributes {
            let moves = matches!(
                attribute,
                Attribute::Position | Attribute::Normal | Attribute::Tangent | Attribute::Field(_)
            );
            if moves || occluded && attribute == Attribute::Occlusion {
                let bytes = vertices::attribute(attribute, mesh, occlusion, &fields);
                gpu.queue.write_buffer(buffer, 0, &bytes);
            }
        }
        for (&resource, bound) in &self.resources {
            let rows = match resource {
                Resource::Bones => vertices::bones(&mesh.bones),
                Resource::MorphDeltas => vertices::morph_deltas(mesh, &self.targets, occlusion),
                _ => continue,
            };
            if let Bound::Buffer(buffer) = bound {
                gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&rows));
            }
        }
        Ok(())
    }
}

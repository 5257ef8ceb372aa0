//! Ambient occlusion: the cosine-weighted open share of each vertex' hemisphere, by rays against
//! the mesh itself.

use super::VertexOcclusion;
use super::vertex_rays::VertexRays;
use crate::progress;
use crate::scene::mesh::PosedMesh;

/// The occlusion of each vertex at rest and what each of `morphs` targets adds, with `rays` rays a
/// vertex. `pose` gives the mesh with the targets at the listed weights.
///
/// Back faces occlude too. Vertices that coincide in every pose and share a normal get one value. The rays
/// depend on the rest position alone, so that the noise of a target's difference cancels where the
/// target changes nothing.
#[must_use]
pub fn bake_occlusion(
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    morphs: usize,
    rays: u32,
) -> VertexOcclusion {
    let vertices = VertexRays::new(pose, morphs, rays);
    let bar = progress::bar("occlusion", (vertices.len() * (1 + morphs)) as u64);
    let at_rest = vertices.at_rest(|_, _, hits: Vec<bool>| {
        bar.inc(1);
        hits
    });
    let base = vertices.spread(&at_rest.iter().map(|hits| open_share(hits)).collect::<Vec<_>>(), 1);
    let target = |target: &PosedMesh| -> Vec<f32> {
        let open = vertices.morphed(target, &at_rest, |_, _, hits: Vec<bool>| {
            bar.inc(1);
            open_share(&hits)
        });
        vertices.spread(&open, 1).iter().zip(&base).map(|(open, base)| open - base).collect()
    };
    let morphs = vertices.targets.iter().map(target).collect();
    bar.finish_and_clear();
    VertexOcclusion { base, morphs }
}

/// The share of a vertex' rays that hit nothing; a vertex without rays is taken as open.
pub(super) fn open_share(hits: &[bool]) -> f32 {
    let open = hits.iter().filter(|&&hit| !hit).count();
    if hits.is_empty() { 1.0 } else { open as f32 / hits.len() as f32 }
}

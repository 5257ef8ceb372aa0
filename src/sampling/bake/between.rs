//! What is baked of a pose, between two poses of one mesh that are baked: an animation at fewer bakes than frames.

use super::transfer::{TransferSet, VertexTransfer};
use super::{PoseBake, SkyBake, VertexOcclusion, VertexThickness};

/// Each number on the line from one to another.
fn line(a: &[f32], b: &[f32], share: f32) -> Option<Vec<f32>> {
    let between = |(a, b): (&f32, &f32)| a + share * (b - a);
    (a.len() == b.len()).then(|| a.iter().zip(b).map(between).collect())
}

/// Both or neither, each number between.
fn both<T>(a: Option<&T>, b: Option<&T>, of: impl FnOnce(&T, &T) -> Option<T>) -> Option<Option<T>> {
    match (a, b) {
        (None, None) => Some(None),
        (Some(a), Some(b)) => of(a, b).map(Some),
        _ => None,
    }
}

impl PoseBake {
    /// The bake of a pose between this one's and another's, `share` of the way there; `None` where they are not of one mesh
    /// and the same effects. What morph targets add is not of a pose, and is left out.
    #[must_use]
    pub fn between(&self, other: &Self, share: f32) -> Option<Self> {
        let occlusion = both(self.occlusion.as_ref(), other.occlusion.as_ref(), |a, b| {
            Some(VertexOcclusion { base: line(&a.base, &b.base, share)?, morphs: Vec::new() })
        })?;
        let thickness = both(self.thickness.as_ref(), other.thickness.as_ref(), |a, b| {
            Some(VertexThickness { base: line(&a.base, &b.base, share)?, morphs: Vec::new() })
        })?;
        let sky = both(self.sky.as_ref(), other.sky.as_ref(), |a, b| {
            let (from, to) = (&a.transfer, &b.transfer);
            let bounced = line(from.base.bounced.as_flattened(), to.base.bounced.as_flattened(), share)?;
            let base = TransferSet {
                direct: line(&from.base.direct, &to.base.direct, share)?,
                bounced: bounced.as_chunks().0.to_vec(),
            };
            let transfer = VertexTransfer { order: from.order, base, morphs: Vec::new() };
            (from.order == to.order).then(|| SkyBake { transfer, light: a.light.clone() })
        })?;
        Some(Self { occlusion, sky, thickness })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(base: Vec<f32>) -> PoseBake {
        let thickness = Some(VertexThickness { base: vec![2.0], morphs: Vec::new() });
        PoseBake { occlusion: Some(VertexOcclusion { base, morphs: Vec::new() }), sky: None, thickness }
    }

    #[test]
    fn a_pose_between_has_numbers_between() {
        let (a, b) = (of(vec![0.0, 1.0]), of(vec![1.0, 0.5]));
        let base = |share: f32| a.between(&b, share).unwrap().occlusion.unwrap().base;
        assert_eq!((base(0.0), base(0.25), base(1.0)), (vec![0.0, 1.0], vec![0.25, 0.875], vec![1.0, 0.5]));
        assert_eq!(a.between(&b, 0.5).unwrap().thickness.unwrap().base, vec![2.0]);
        assert!(a.between(&of(vec![1.0]), 0.5).is_none() && a.between(&PoseBake::default(), 0.5).is_none());
    }
}

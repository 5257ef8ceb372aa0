//! The node tree: who is whose parent, and where every node stands in the world.

use glam::{DMat4, DQuat, DVec3};
use gltf::json;

use super::document::Document;
use crate::error::SceneError;

/// A node's own transform, in the parts that an animation may move.
#[derive(Clone, Copy, Debug)]
pub(super) enum Local {
    Matrix(DMat4),
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
}

impl Local {
    fn of(node: &json::Node) -> Self {
        if let Some(matrix) = &node.matrix {
            return Self::Matrix(DMat4::from_cols_array(&matrix.map(f64::from)));
        }
        let vector =
            |v: Option<[f32; 3]>, default: DVec3| v.map_or(default, |v| DVec3::from(v.map(f64::from)));
        let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| unit(q.0.map(f64::from)));
        Self::Parts {
            translation: vector(node.translation, DVec3::ZERO),
            rotation,
            scale: vector(node.scale, DVec3::ONE),
        }
    }

    fn matrix(self) -> DMat4 {
        match self {
            Self::Matrix(matrix) => matrix,
            Self::Parts { translation, rotation, scale } => {
                DMat4::from_scale_rotation_translation(scale, rotation, translation)
            }
        }
    }
}

/// The unit quaternion x, y, z, w; no rotation where it has no length.
pub(super) fn unit(q: [f64; 4]) -> DQuat {
    let q = DQuat::from_array(q);
    if q.length_squared() > 1e-30 && q.is_finite() { q.normalize() } else { DQuat::IDENTITY }
}

/// The nodes of a document at a time.
pub(super) struct Nodes {
    /// World transform of every node.
    pub world: Vec<DMat4>,
    /// The nodes of the scene, parents before children, in the file's order.
    pub in_scene: Vec<usize>,
    /// Animated morph weights of each node.
    pub weights: Vec<Option<Vec<f32>>>,
}

impl Document {
    /// Place every node, by the animation at `time` seconds or as it stands.
    pub(super) fn nodes(&self, time: Option<f64>) -> Result<Nodes, SceneError> {
        let nodes = &self.root.nodes;
        let mut local: Vec<Local> = nodes.iter().map(Local::of).collect();
        let mut weights = vec![None; nodes.len()];
        if let Some(time) = time {
            self.animate(time, &mut local, &mut weights)?;
        }
        let in_tree = self.walk(&self.top(&self.parents()?))?;
        let mut world = vec![DMat4::IDENTITY; nodes.len()];
        for &(node, parent) in &in_tree {
            let above = parent.map_or(DMat4::IDENTITY, |parent: usize| world[parent]);
            world[node] = above * local[node].matrix();
            if !world[node].is_finite() {
                return Err(self
                    .error("has a transform that is not finite", "Export it anew")
                    .at(format!("node {node}")));
            }
        }
        let in_scene = self.walk(&self.scene_roots()?)?.into_iter().map(|(node, _)| node).collect();
        Ok(Nodes { world, in_scene, weights })
    }

    /// Each node's parent; a node with two is refused, so that only trees and rings are left.
    fn parents(&self) -> Result<Vec<Option<usize>>, SceneError> {
        let mut parents = vec![None; self.root.nodes.len()];
        for (i, node) in self.root.nodes.iter().enumerate() {
            for &child in node.children.iter().flatten() {
                self.get(&self.root.nodes, child, "node")?;
                if parents[child.value()].replace(i).is_some() {
                    return Err(self.not_a_tree(child.value()));
                }
            }
        }
        Ok(parents)
    }

    fn not_a_tree(&self, node: usize) -> SceneError {
        self.error("has two parents, or is its own ancestor", "The file is damaged: export it anew")
            .at(format!("node {node}"))
    }

    fn top(&self, parents: &[Option<usize>]) -> Vec<usize> {
        (0..self.root.nodes.len()).filter(|&i| parents[i].is_none()).collect()
    }

    /// The roots of the default scene, else of the first, else every node without a parent.
    fn scene_roots(&self) -> Result<Vec<usize>, SceneError> {
        let scene = match self.root.scene {
            Some(index) => Some(self.get(&self.root.scenes, index, "scene")?),
            None => self.root.scenes.first(),
        };
        let Some(scene) = scene else { return Ok(self.top(&self.parents()?)) };
        for &node in &scene.nodes {
            self.get(&self.root.nodes, node, "node")?;
        }
        Ok(scene.nodes.iter().map(json::Index::value).collect())
    }

    /// All nodes below `roots` with their parents, parents first, children in order.
    fn walk(&self, roots: &[usize]) -> Result<Vec<(usize, Option<usize>)>, SceneError> {
        let mut seen = vec![false; self.root.nodes.len()];
        let mut stack: Vec<_> = roots.iter().rev().map(|&root| (root, None)).collect();
        let mut order = Vec::new();
        while let Some((node, parent)) = stack.pop() {
            if std::mem::replace(&mut seen[node], true) {
                return Err(self.not_a_tree(node));
            }
            order.push((node, parent));
            let children = self.root.nodes[node].children.iter().flatten();
            stack.extend(children.rev().map(|child| (child.value(), Some(node))));
        }
        Ok(order)
    }
}

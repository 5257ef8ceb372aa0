//! The bones, the clip that moves them and the morph targets, and the pose at a time, as a player computes it.
//!
//! The built-in scene's joints are refined into one chain: how far up it a vertex lies follows from those joints'
//! weights and from its height. Each vertex hangs on the four bones around its place, by a cubic B-spline.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DMat4, DQuat, Mat4, Quat, Vec3};
use skinfit::scene::mesh::Mesh;

/// Bones, each the parent of the next: as many as *Dawn* had.
pub(crate) const BONES: usize = 98;
/// Morph targets, likewise.
pub(crate) const TARGETS: usize = 5;
/// The clip's length; it ends as it begins.
pub(crate) const SECONDS: f64 = 4.0;
/// Keys a second: keys' times are whole in 32 bits.
const RATE: f64 = 8.0;
/// The part of a vertex's place that the joints' weights say: the jaw goes with the skull, not with the throat beside it.
const OF_JOINTS: f32 = 0.6;
/// How far the neck bends in all, radians, and which part of the chain is neck: its middle and half of its length.
const NOD: f64 = 0.2;
const NECK: (f64, f64) = (0.4, 0.3);
/// How far a wave that runs up the chain turns each bone, radians, and its length in bones.
const RIPPLE: f64 = 0.003;
const WAVE: f64 = 28.0;
/// The most that a morph target weighs.
const MOST: f64 = 0.6;

/// How far up the bones each vertex lies, from 0 to 1, by the mesh's own joints and its height.
pub(crate) fn along(mesh: &Mesh) -> Result<Vec<f32>, String> {
    let vertices = mesh.positions.len();
    if mesh.bones.len() < 2 || mesh.joints.len() != vertices || mesh.weights.len() != vertices {
        return Err("the scene's mesh has no chain of bones: give the built-in scene".to_owned());
    }
    let last = (mesh.bones.len() - 1) as f32;
    let of_joints = |i: usize| -> f32 {
        let influences = mesh.joints[i].iter().zip(mesh.weights[i]);
        influences.map(|(&joint, weight)| weight * f32::from(joint)).sum::<f32>() / last
    };
    let heights = scaled(mesh.positions.iter().map(|position| position.y).collect())?;
    let mixed = |(i, height): (usize, f32)| OF_JOINTS * of_joints(i) + (1.0 - OF_JOINTS) * height;
    scaled(heights.into_iter().enumerate().map(mixed).collect())
}

/// Numbers brought to the range from 0 to 1.
fn scaled(mut numbers: Vec<f32>) -> Result<Vec<f32>, String> {
    let least = numbers.iter().copied().fold(f32::INFINITY, f32::min);
    let most = numbers.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    if numbers.is_empty() || most <= least {
        return Err("the scene's mesh is flat: give the built-in scene".to_owned());
    }
    numbers.iter_mut().for_each(|number| *number = (*number - least) / (most - least));
    Ok(numbers)
}

/// The four bones of a vertex and their weights, which sum to 1.
pub(crate) fn influences(along: f32) -> ([u8; 4], [f32; 4]) {
    let place = f64::from(along.clamp(0.0, 1.0)) * (BONES - 3) as f64;
    let first = (place.floor() as usize).min(BONES - 4);
    let t = place - first as f64;
    let (t2, t3, rest) = (t * t, t * t * t, 1.0 - t);
    let weights = [rest * rest * rest, 3.0 * t3 - 6.0 * t2 + 4.0, -3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0, t3];
    ([0, 1, 2, 3].map(|i| (first + i) as u8), weights.map(|weight| (weight / 6.0) as f32))
}

/// One key of the clip.
pub(crate) struct Key {
    /// Seconds.
    pub(crate) time: f32,
    /// Each bone's turn against its parent.
    pub(crate) turns: Vec<Quat>,
    /// The morph targets' weights.
    pub(crate) weights: [f32; TARGETS],
}

/// The bones and their clip.
pub(crate) struct Rig {
    /// Where each bone turns, in the mesh's rest.
    pub(crate) pivots: Vec<Vec3>,
    /// Keys in equal steps.
    pub(crate) keys: Vec<Key>,
}

impl Rig {
    /// Bones that turn about the middle of what they move.
    pub(crate) fn new(mesh: &Mesh, along: &[f32]) -> Result<Self, String> {
        let mut sums = vec![(Vec3::ZERO.as_dvec3(), 0.0_f64); BONES];
        for (position, &along) in mesh.positions.iter().zip(along) {
            let (bones, weights) = influences(along);
            for (bone, weight) in bones.into_iter().zip(weights) {
                let sum = &mut sums[usize::from(bone)];
                sum.0 += position.as_dvec3() * f64::from(weight);
                sum.1 += f64::from(weight);
            }
        }
        if let Some(bone) = sums.iter().position(|sum| sum.1 <= 0.0) {
            return Err(format!("bone {bone} moves no vertex: give the built-in scene, or more --vertices"));
        }
        let pivots = sums.into_iter().map(|(sum, weight)| (sum / weight).as_vec3()).collect();
        let count = (SECONDS * RATE) as usize;
        Ok(Self { pivots, keys: (0..=count).map(key).collect() })
    }

    /// From each bone's parent to it, at rest.
    pub(crate) fn step(&self, bone: usize) -> Vec3 {
        match bone.checked_sub(1) {
            Some(parent) => self.pivots[bone] - self.pivots[parent],
            None => self.pivots[bone],
        }
    }

    /// Pose a mesh that has these bones and morph targets: as glTF has it, by lines between weights, on the sphere
    /// between turns.
    pub(crate) fn pose(&self, time: f64, mesh: &mut Mesh) {
        let place = (time * RATE).clamp(0.0, (self.keys.len() - 1) as f64);
        let before = (place.floor() as usize).min(self.keys.len() - 2);
        let (share, [from, to]) = (place - before as f64, [&self.keys[before], &self.keys[before + 1]]);
        let mut above = DMat4::IDENTITY;
        for (i, bone) in mesh.bones.iter_mut().enumerate().take(BONES) {
            let [from, to] = [from, to].map(|key| key.turns[i].as_dquat().normalize());
            let turn = from.slerp(to, share);
            above *= DMat4::from_rotation_translation(turn, self.step(i).as_dvec3());
            *bone = (above * DMat4::from_translation(-self.pivots[i].as_dvec3())).as_mat4();
        }
        for (morph, (from, to)) in mesh.morphs.iter_mut().zip(from.weights.iter().zip(to.weights)) {
            morph.weight = (f64::from(*from) * (1.0 - share) + f64::from(to) * share) as f32;
        }
    }
}

/// How far a mesh's bones and weights are from another's: the greatest difference of their numbers.
pub(crate) fn apart(a: &Mesh, b: &Mesh) -> f32 {
    let far =
        |(a, b): (&Mat4, &Mat4)| (*a - *b).to_cols_array().into_iter().map(f32::abs).fold(0.0, f32::max);
    let bones = a.bones.iter().zip(&b.bones).map(far);
    let weights = a.morphs.iter().zip(&b.morphs).map(|(a, b)| (a.weight - b.weight).abs());
    bones.chain(weights).fold(0.0, f32::max)
}

/// The clip's key of that number: the neck nods once, a wave runs up all bones, and the morph targets come and go one
/// after the other.
fn key(number: usize) -> Key {
    let time = number as f64 / RATE;
    let phase = TAU * time / SECONDS;
    let bending: f64 = (0..BONES).map(bend).sum();
    let turn = |bone: usize| {
        let ripple = RIPPLE * (phase - TAU * bone as f64 / WAVE).sin();
        let nod = NOD * phase.sin() * bend(bone) / bending;
        (DQuat::from_rotation_x(nod) * DQuat::from_rotation_z(ripple)).as_quat()
    };
    let weight = |target: usize| {
        let behind = TAU * target as f64 / TARGETS as f64;
        (MOST * 0.5 * (1.0 - (phase - behind).cos())) as f32
    };
    Key { time: time as f32, turns: (0..BONES).map(turn).collect(), weights: std::array::from_fn(weight) }
}

/// How much of the nod is a bone's.
fn bend(bone: usize) -> f64 {
    let (middle, half) = NECK;
    let off = (bone as f64 / (BONES - 1) as f64 - middle) / half;
    if off.abs() < 1.0 { (FRAC_PI_2 * off).cos().powi(2) } else { 0.0 }
}

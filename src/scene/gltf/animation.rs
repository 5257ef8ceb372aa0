//! An animation at a time: translations, rotations, scales and morph weights of nodes.

use glam::{DQuat, DVec3, DVec4};
use gltf::json;
use json::animation::{Animation, Interpolation, Property};
use json::validation::Checked;

use super::document::Document;
use super::nodes::{Local, unit};
use super::primitive::LARGEST;
use crate::error::SceneError;

/// Where a time lies between two keys.
struct Span {
    before: usize,
    after: usize,
    /// Share of the way, in [0, 1].
    share: f64,
    /// Seconds between the two keys.
    length: f64,
}

impl Document {
    /// Move the nodes' own transforms, and set the animated morph weights. Before its first key and
    /// after its last a channel holds still.
    pub(super) fn animate(
        &self,
        time: f64,
        local: &mut [Local],
        weights: &mut [Option<Vec<f32>>],
    ) -> Result<(), SceneError> {
        let Some(animation) = self.animation() else { return Ok(()) };
        for (i, channel) in animation.channels.iter().enumerate() {
            // Extensions animate other things, which do not move the mesh.
            let Checked::Valid(property) = channel.target.path else { continue };
            let node = channel.target.node;
            self.get(&self.root.nodes, node, "node")?;
            let sampler = self.get(&animation.samplers, channel.sampler, "animation sampler")?;
            let Checked::Valid(interpolation) = sampler.interpolation else {
                return Err(self.channel_error(i, "has an unknown interpolation"));
            };
            let times = self.scalars(sampler.input)?;
            let span = span(&times, time)
                .ok_or_else(|| self.channel_error(i, "has no keys, or times that do not increase"))?;
            let track = Track { document: self, channel: i, keys: times.len(), span, interpolation };
            if property == Property::MorphTargetWeights {
                let values = self.scalars(sampler.output)?;
                weights[node.value()] = Some(track.weights(&values)?);
                continue;
            }
            let Local::Parts { translation, rotation, scale } = &mut local[node.value()] else {
                return Err(self.channel_error(i, "moves a node that has a matrix"));
            };
            match property {
                Property::Translation => *translation = track.vector(&self.floats(sampler.output)?)?,
                Property::Scale => *scale = track.vector(&self.floats(sampler.output)?)?,
                _ => *rotation = track.rotation(&self.floats(sampler.output)?)?,
            }
        }
        Ok(())
    }

    /// The names of the file's animations, in its order: `animation N` where it gives none.
    pub(crate) fn animation_names(&self) -> Vec<String> {
        let animations = self.root.animations.iter().enumerate();
        let named = animations
            .map(|(i, animation)| animation.name.clone().unwrap_or_else(|| format!("animation {i}")));
        named.collect()
    }

    /// The same document, whose nodes the animation at this place in the file moves.
    pub(crate) fn with_animation(mut self, clip: usize) -> Self {
        self.clip = clip;
        self
    }

    /// Whether the animation moves morph targets.
    pub(crate) fn moves_morphs(&self) -> bool {
        let weights = Checked::Valid(Property::MorphTargetWeights);
        let channels = self.animation().map_or(&[][..], |animation| &animation.channels);
        channels.iter().any(|channel| channel.target.path == weights)
    }

    /// The animation that moves nodes.
    fn animation(&self) -> Option<&Animation> {
        self.root.animations.get(self.clip)
    }

    /// Which of a node's morph targets the animation gives another weight than 0 at any time: a key's value, or a
    /// tangent of its spline, is not 0. Shorter than the targets where those at the end stay.
    pub(super) fn moved_targets(&self, node: usize) -> Result<Vec<bool>, SceneError> {
        let mut moved = Vec::new();
        let Some(animation) = self.animation() else { return Ok(moved) };
        for (i, channel) in animation.channels.iter().enumerate() {
            let weights = Checked::Valid(Property::MorphTargetWeights);
            if channel.target.path != weights || channel.target.node.value() != node {
                continue;
            }
            let sampler = self.get(&animation.samplers, channel.sampler, "animation sampler")?;
            let keys = self.scalars(sampler.input)?.len();
            let values = self.scalars(sampler.output)?;
            let stride =
                if sampler.interpolation == Checked::Valid(Interpolation::CubicSpline) { 3 } else { 1 };
            let targets = values.len() / (keys * stride).max(1);
            if targets == 0 {
                return Err(self.channel_error(i, "has fewer values than keys"));
            }
            moved.resize(targets.max(moved.len()), false);
            values.iter().enumerate().for_each(|(at, &value)| moved[at % targets] |= value != 0.0);
        }
        Ok(moved)
    }

    /// The first and the last key's time of the animation; `None` without one, or without keys.
    pub(crate) fn animation_seconds(&self) -> Result<Option<(f64, f64)>, SceneError> {
        self.animation().map_or(Ok(None), |animation| self.seconds_of(animation))
    }

    /// The first and the last key's time of an animation.
    pub(super) fn seconds_of(&self, animation: &Animation) -> Result<Option<(f64, f64)>, SceneError> {
        let mut ends: Option<(f64, f64)> = None;
        for sampler in &animation.samplers {
            let times = self.scalars(sampler.input)?;
            for &time in times.iter().filter(|time| time.is_finite()) {
                let time = f64::from(time);
                let (first, last) = ends.unwrap_or((time, time));
                ends = Some((first.min(time), last.max(time)));
            }
        }
        Ok(ends)
    }

    fn channel_error(&self, channel: usize, what: &str) -> SceneError {
        self.error(what, "Export the animation anew, or leave `time` out")
            .at(format!("animation {}, channel {channel}", self.clip))
    }
}

/// The keys around `time`; none when there are no keys or they are out of order.
fn span(times: &[f32], time: f64) -> Option<Span> {
    if times.is_empty() || !times.iter().all(|t| t.is_finite()) || times.windows(2).any(|w| w[0] > w[1]) {
        return None;
    }
    let after = times.partition_point(|&t| f64::from(t) <= time);
    if after == 0 || after == times.len() {
        let key = after.saturating_sub(1);
        return Some(Span { before: key, after: key, share: 0.0, length: 0.0 });
    }
    let (t0, t1) = (f64::from(times[after - 1]), f64::from(times[after]));
    Some(Span { before: after - 1, after, share: (time - t0) / (t1 - t0), length: t1 - t0 })
}

/// One channel's keys around the time.
struct Track<'a> {
    document: &'a Document,
    channel: usize,
    keys: usize,
    span: Span,
    interpolation: Interpolation,
}

impl Track<'_> {
    /// How many values a key has: one, or in-tangent, value and out-tangent.
    fn stride(&self) -> usize {
        if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 }
    }

    fn check(&self, values: usize, per_key: usize, finite: bool) -> Result<(), SceneError> {
        if values < self.keys * self.stride() * per_key {
            return Err(self.document.channel_error(self.channel, "has fewer values than keys"));
        }
        if !finite {
            return Err(self
                .document
                .channel_error(self.channel, "has values that are not finite, or beyond 1e15"));
        }
        Ok(())
    }

    /// The value of a component at the time; `get(key, part)` reads it, part 1 being the value of a
    /// cubic spline's key (0 and 2 its in- and out-tangent).
    fn blend<V>(&self, get: impl Fn(usize, usize) -> V) -> V
    where
        V: std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>,
    {
        let Span { before, after, share: t, length } = self.span;
        match self.interpolation {
            Interpolation::Step => get(before, 0),
            Interpolation::Linear => get(before, 0) * (1.0 - t) + get(after, 0) * t,
            // Hermite's basis, as in glTF 2.0, appendix C.
            Interpolation::CubicSpline => {
                let (t2, t3) = (t * t, t * t * t);
                get(before, 1) * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + get(before, 2) * (length * (t3 - 2.0 * t2 + t))
                    + get(after, 1) * (3.0 * t2 - 2.0 * t3)
                    + get(after, 0) * (length * (t3 - t2))
            }
        }
    }

    fn vector(&self, values: &[[f32; 3]]) -> Result<DVec3, SceneError> {
        self.check(values.len(), 1, values.iter().flatten().all(|v| v.abs() <= LARGEST))?;
        Ok(self.blend(|key, part| DVec3::from(values[key * self.stride() + part].map(f64::from))))
    }

    fn rotation(&self, values: &[[f32; 4]]) -> Result<DQuat, SceneError> {
        self.check(values.len(), 1, values.iter().flatten().all(|v| v.abs() <= LARGEST))?;
        if self.interpolation == Interpolation::Linear {
            let at = |key: usize| unit(values[key].map(f64::from));
            // On the sphere, the short way round.
            return Ok(at(self.span.before).slerp(at(self.span.after), self.span.share));
        }
        let blended = self.blend(|key, part| DVec4::from(values[key * self.stride() + part].map(f64::from)));
        Ok(unit(blended.to_array()))
    }

    fn weights(&self, values: &[f32]) -> Result<Vec<f32>, SceneError> {
        let targets = values.len() / (self.keys * self.stride());
        self.check(values.len(), targets.max(1), values.iter().all(|v| v.abs() <= LARGEST))?;
        let at = |target: usize| {
            self.blend(|key, part| f64::from(values[(key * self.stride() + part) * targets + target])) as f32
        };
        Ok((0..targets).map(at).collect())
    }
}

//! docs/animation.json, `transfer`: the sky that a head's vertices see, baked for each frame of its clip, or for fewer poses.
//!
//! Compared is what `directional_occlusion` makes of transfer vectors at its defaults: the light that arrives, and is thrown
//! back, as a share of what arrives where nothing is in its way, in each channel.

use serde_json::{Value, json};
use skinfit::bake::SkyBake;
use skinfit::bake::rays::RayMesh;
use skinfit::bake::sky::SKY_RATIO;
use skinfit::model::fields::{Field, Fields};
use skinfit::prepare::Loaded;
use skinfit::samples::{PosedSurface, SurfaceBakes};
use skinfit::scene::Scene;
use skinfit::scene::mesh::Morph;

use crate::clip::{Clip, FPS, RATES, head, seconds_of};
use crate::flicker::Apart;
use crate::lab::{Lab, Result};

/// What the bake is called.
const TRANSFER: &str = "transfer";

/// A row for each way to follow the clip.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let loaded = head(lab, "directional_occlusion")?;
    let scene = loaded.scene.clone();
    let clip = Clip::of(&scene)?;
    let field = scene.needs().fields.named(SKY_RATIO).ok_or("no effect asks for the sky")?;
    let rays = clip.poses.iter().map(RayMesh::of).collect();
    let seen = Seen { scene: &scene, clip: &clip, rays, field };
    let (bakes, seconds) = clip.baked(&scene, TRANSFER)?;
    let each = seen.frames(|frame| seen.by(frame, bakes[frame].sky.as_ref()))?;
    // Seconds of `count` bakes, by the frame.
    let of_poses = |count: usize| seconds * count as f64 / clip.poses.len() as f64;
    let row = |name: &str, rate: Option<usize>, seconds: f64, frames: &[Vec<f32>]| {
        let error = Apart::between(frames, &each).json();
        json!({ "name": name, "rate": rate, "seconds": seconds, "error": error })
    };
    let mut rows = vec![row("each frame", Some(FPS), of_poses(clip.poses.len()), &each)];
    for rate in RATES {
        let frames = seen.frames(|frame| seen.by(frame, clip.between(&bakes, rate, frame)?.sky.as_ref()))?;
        rows.push(row(&format!("{rate} a second"), Some(rate), of_poses(clip.baked_at(rate)), &frames));
    }
    let once = seen.frames(|frame| seen.by(frame, bakes[0].sky.as_ref()))?;
    rows.push(row("one bake", Some(0), of_poses(1), &once));
    let (frames, spent) = seen.by_targets(loaded)?;
    rows.push(row("morph targets", None, spent, &frames));
    let bands = bakes[0].sky.as_ref().map(|sky| sky.transfer.order.bands());
    Ok(json!({ "rays": scene.quality.occlusion_rays, "bands": bands, "rows": rows }))
}

/// What the skin's vertices see of the sky.
struct Seen<'a> {
    scene: &'a Scene,
    clip: &'a Clip,
    /// Of each frame.
    rays: Vec<RayMesh>,
    /// The field of it.
    field: Field,
}

impl Seen<'_> {
    fn frames(&self, of: impl Fn(usize) -> Result<Vec<f32>>) -> Result<Vec<Vec<f32>>> {
        (0..self.clip.poses.len()).map(of).collect()
    }

    /// In a frame, by what was baked for it: three numbers a vertex.
    fn by(&self, frame: usize, sky: Option<&SkyBake>) -> Result<Vec<f32>> {
        let bakes = SurfaceBakes { sky: Some(sky.ok_or("no transfer was baked")?), ..Default::default() };
        let pose = &self.clip.poses[frame];
        let weights = self.clip.weights[frame].iter();
        let morphs: Vec<Morph> = weights.map(|&weight| Morph { weight, ..Morph::default() }).collect();
        let fields = Fields::of([self.field]);
        let surface = PosedSurface::with_fields(self.scene, pose, &self.rays[frame], &morphs, bakes, fields)?;
        Ok(self.clip.of_skin(&surface.field_of_vertices(self.field), 3))
    }

    /// Each frame by what is baked once for each morph target, as `render --occlusion targets` has it, and the seconds of
    /// the bake by the frame.
    fn by_targets(&self, loaded: Loaded) -> Result<(Vec<Vec<f32>>, f64)> {
        let baked = loaded.bake()?;
        let frames = self.frames(|frame| self.by(frame, baked.sky.as_deref()))?;
        Ok((frames, seconds_of(&baked.stats, TRANSFER)? / self.clip.poses.len() as f64))
    }
}

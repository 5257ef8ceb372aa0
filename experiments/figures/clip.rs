//! A head that nods and grimaces, frame by frame of its clip, and what is baked of the frames.

use skinfit::bake::{BakeStats, PoseBake, bake_pose};
use skinfit::prepare::{ClipOcclusion, Loaded, PrepareOptions};
use skinfit::scene::Scene;
use skinfit::scene::animation::Animation;
use skinfit::scene::mesh::{Mesh, PosedMesh};

use crate::lab::{Lab, Result};

/// Frames a second.
pub(crate) const FPS: usize = 30;
/// Poses a second that are baked, frames between two on the line between them: each of them is a frame.
pub(crate) const RATES: [usize; 5] = [15, 10, 5, 2, 1];

const SCENE: &str = r#"
[mesh]
file = "MESH"
metres_per_unit = 1.0
skin = ["skin"]

[environment]
file = "LIGHT"

[model]
form = "corrected"
effects = ["diffuse", "EFFECT", "morph", "skin"]

[[view]]
name = "front"
world_to_camera = [1, 0, 0, 0, 0, 1, 0, -0.125, 0, 0, 1, -1.5, 0, 0, 0, 1]
fov_y_degrees = 11
width = 64
height = 64
"#;

/// The head in a forest, with an effect that something is baked for.
pub(crate) fn head(lab: &Lab, effect: &str) -> Result<Loaded> {
    let mesh = lab.data.join("rigged/mh_head.glb");
    if !mesh.exists() {
        return Err(format!("{} is not there: the MakeHuman head's clip", mesh.display()).into());
    }
    let path = lab.scratch.path().join("nod.toml");
    let quoted = |path: &std::path::Path| format!("{:?}", path.display().to_string());
    let text = SCENE.replace("EFFECT", effect).replace("\"MESH\"", &quoted(&mesh));
    std::fs::write(&path, text.replace("\"LIGHT\"", &quoted(&lab.data.join("env/forest.exr"))))?;
    // Without a cache, so that what is timed is baked.
    let clip = Some(ClipOcclusion::Targets);
    Ok(Loaded::read(&path, &PrepareOptions { time: Some(0.0), clip, ..PrepareOptions::default() })?)
}

/// Seconds that bakes of that name took.
///
/// # Errors
/// When there is none.
pub(crate) fn seconds_of(stats: &BakeStats, name: &str) -> Result<f64> {
    let seconds: Vec<f64> = stats.rows.iter().filter(|row| row.name == name).map(|row| row.seconds).collect();
    if seconds.is_empty() {
        Err(format!("no bake is called {name}").into())
    } else {
        Ok(seconds.iter().sum())
    }
}

/// A clip, frame by frame.
pub(crate) struct Clip {
    /// Seconds.
    pub(crate) length: f64,
    pub(crate) poses: Vec<PosedMesh>,
    /// Each frame's weights of the morph targets.
    pub(crate) weights: Vec<Vec<f32>>,
    /// The vertices of the skin's triangles.
    pub(crate) skin: Vec<usize>,
}

impl Clip {
    pub(crate) fn of(scene: &Scene) -> Result<Self> {
        let animation = Animation::open(scene)?.ok_or("the mesh has no animation")?;
        let (first, last) = animation.seconds;
        let length = last - first;
        let steps = (length * FPS as f64).round() as usize;
        if steps < 2 || (length * FPS as f64 - steps as f64).abs() > 1e-3 {
            return Err(format!("{length} s are not a whole number of frames").into());
        }
        let frame = |i: usize| animation.mesh((first + i as f64 / FPS as f64).min(last));
        let meshes = (0..=steps).map(frame).collect::<std::result::Result<Vec<_>, _>>()?;
        let poses: Vec<PosedMesh> = meshes.iter().map(Mesh::pose).collect();
        let weights = |mesh: &Mesh| mesh.morphs.iter().map(|morph| morph.weight).collect::<Vec<f32>>();
        let mut skin: Vec<usize> = (poses[0].skin_triangles().iter())
            .filter(|[a, b, _]| a != b)
            .flat_map(|triangle| triangle.map(|vertex| vertex as usize))
            .collect();
        skin.sort_unstable();
        skin.dedup();
        Ok(Self { length, weights: meshes.iter().map(weights).collect(), poses, skin })
    }

    /// Each frame's own bake, as `render --occlusion frames` makes it, and the mean seconds that what is called `name` takes
    /// of one.
    pub(crate) fn baked(&self, scene: &Scene, name: &str) -> Result<(Vec<PoseBake>, f64)> {
        let (mut bakes, mut seconds, mut light) = (Vec::new(), 0.0, None);
        for pose in &self.poses {
            let (bake, stats) = bake_pose(scene, pose, light.as_ref(), None);
            seconds += seconds_of(&stats, name)?;
            // The same for all frames.
            light = light.or_else(|| bake.sky.as_ref()?.light.clone());
            bakes.push(bake);
        }
        Ok((bakes, seconds / self.poses.len() as f64))
    }

    /// How many poses are baked at `rate` a second.
    pub(crate) fn baked_at(&self, rate: usize) -> usize {
        (self.poses.len() - 1).div_ceil(FPS / rate) + 1
    }

    /// A frame as `render --occlusion-rate` has it, of the bakes of all frames.
    pub(crate) fn between(&self, bakes: &[PoseBake], rate: usize, frame: usize) -> Result<PoseBake> {
        let step = FPS / rate;
        let from = frame / step * step;
        if from == frame {
            return Ok(bakes[frame].clone());
        }
        let to = (from + step).min(bakes.len() - 1);
        let share = (frame - from) as f32 / (to - from) as f32;
        Ok(bakes[from].between(&bakes[to], share).ok_or("two bakes are not of one mesh")?)
    }

    /// Of `all`, which has `numbers` numbers of each vertex, those of the skin's.
    pub(crate) fn of_skin(&self, all: &[f32], numbers: usize) -> Vec<f32> {
        self.skin.iter().flat_map(|&vertex| &all[numbers * vertex..numbers * (vertex + 1)]).copied().collect()
    }
}

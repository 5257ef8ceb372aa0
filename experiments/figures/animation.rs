//! docs/animation.json, and the plot beside it: occlusion of a head that nods and grimaces, baked for each frame of its clip,
//! or for fewer poses.
//!
//! Rays of a vertex are drawn by where it stands at rest, and turn with the surface. Two bakes beside the program's own
//! tell their noise from what truly changes: one with many rays, and one whose rays are drawn by where each vertex
//! stands in the frame, so that their noise is another in each. `flicker.rs` says how frames are compared.

use std::path::PathBuf;

use serde_json::{Value, json};
use skinfit::bake::occlusion::bake_occlusion;
use skinfit::bake::{PoseBake, bake_pose};
use skinfit::prepare::{ClipOcclusion, Loaded, PrepareOptions};
use skinfit::scene::Scene;
use skinfit::scene::animation::Animation;
use skinfit::scene::mesh::{Mesh, PosedMesh};

use crate::flicker::{Apart, Pieces, Way, plot};
use crate::lab::{Lab, Result};

/// Frames a second.
const FPS: usize = 30;
/// Poses a second that are baked, frames between two on the line between them: each of them is a frame.
const RATES: [usize; 5] = [15, 10, 5, 2, 1];
/// Rays a vertex of the bake that tells noise from change; a scene has 256 unless it says more.
const MANY: u32 = 4096;

/// Occlusion is asked for by what it takes light from; whatever light that is, this is the same.
const SCENE: &str = r#"
[mesh]
file = "MESH"
metres_per_unit = 1.0
skin = ["skin"]

[environment]
file = "LIGHT"

[model]
form = "corrected"
effects = ["diffuse", "occlusion", "morph", "skin"]

[[view]]
name = "front"
world_to_camera = [1, 0, 0, 0, 0, 1, 0, -0.125, 0, 0, 1, -1.5, 0, 0, 0, 1]
fov_y_degrees = 11
width = 64
height = 64
"#;

/// A row for each way to follow the clip; drawn are those that bake poses of it.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let loaded = Loaded::read(&scene_file(lab)?, &options())?;
    let mut scene = loaded.scene.clone();
    let clip = Clip::of(&scene)?;
    let rays = scene.quality.occlusion_rays;
    let (bakes, seconds) = clip.baked(&scene);
    let each = clip.open(&bakes)?;
    scene.quality.occlusion_rays = MANY;
    let (fine, fine_seconds) = clip.baked(&scene);
    let fine = clip.open(&fine)?;
    let drawn_anew = clip.drawn_anew(rays);
    // Seconds of so many bakes, by the frame.
    let of_poses = |count: usize| seconds * count as f64 / clip.poses.len() as f64;
    let way = |name: &str, rate, seconds, frames| Way { name: name.to_owned(), rate, seconds, frames };
    let mut ways = vec![way("each frame", Some(FPS), Some(of_poses(clip.poses.len())), each.clone())];
    for rate in RATES {
        let (count, frames) = clip.between(&bakes, FPS / rate)?;
        ways.push(way(&format!("{rate} a second"), Some(rate), Some(of_poses(count)), frames));
    }
    ways.push(way("many rays", Some(FPS), Some(fine_seconds), fine.clone()));
    ways.push(way("other rays", Some(FPS), None, drawn_anew));
    plot(&lab.root.join("docs/images/occlusion_flicker.svg"), &ways, FPS)?;
    ways.push(way("one bake", Some(0), Some(of_poses(1)), vec![each[0].clone(); each.len()]));
    let (frames, spent) = clip.by_targets(loaded)?;
    ways.push(way("morph targets", None, Some(spent), frames));
    let pieces = Pieces::of(&clip.poses, &clip.skin, &fine);
    let row = |way: &Way| {
        let mut row = way.row(&pieces, FPS);
        row["error"] = Apart::between(&way.frames, &each).json();
        row["true_error"] = Apart::between(&way.frames, &fine).json();
        row
    };
    Ok(json!({
        "fps": FPS, "frames": clip.poses.len(), "length": clip.length, "skin_vertices": clip.skin.len(),
        "rays": rays, "many_rays": MANY, "pieces": pieces.json(),
        "rows": ways.iter().map(row).collect::<Vec<_>>(),
    }))
}

fn options() -> PrepareOptions {
    // Without a cache, so that what is timed is baked.
    PrepareOptions { time: Some(0.0), clip: Some(ClipOcclusion::Targets), ..PrepareOptions::default() }
}

fn scene_file(lab: &Lab) -> Result<PathBuf> {
    let mesh = lab.data.join("rigged/mh_head.glb");
    if !mesh.exists() {
        return Err(format!("{} is not there: the MakeHuman head's clip", mesh.display()).into());
    }
    let path = lab.scratch.path().join("nod.toml");
    let quoted = |path: &std::path::Path| format!("{:?}", path.display().to_string());
    let text = SCENE.replace("\"MESH\"", &quoted(&mesh));
    std::fs::write(&path, text.replace("\"LIGHT\"", &quoted(&lab.data.join("env/forest.exr"))))?;
    Ok(path)
}

/// A clip, frame by frame.
struct Clip {
    /// Seconds.
    length: f64,
    poses: Vec<PosedMesh>,
    /// Each frame's weights of the morph targets.
    weights: Vec<Vec<f32>>,
    /// The vertices of the skin's triangles.
    skin: Vec<usize>,
}

impl Clip {
    fn of(scene: &Scene) -> Result<Self> {
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

    /// Each frame's own bake, as `render --occlusion frames` makes it, and the mean seconds of one.
    fn baked(&self, scene: &Scene) -> (Vec<PoseBake>, f64) {
        let (mut bakes, mut seconds) = (Vec::new(), 0.0);
        for pose in &self.poses {
            let (bake, stats) = bake_pose(scene, pose, None, None);
            seconds += stats.seconds();
            bakes.push(bake);
        }
        (bakes, seconds / self.poses.len() as f64)
    }

    /// The open shares of the skin's vertices.
    fn open(&self, bakes: &[PoseBake]) -> Result<Vec<Vec<f32>>> {
        let base = |bake: &PoseBake| Some(self.of_skin(&bake.occlusion.as_ref()?.base));
        bakes.iter().map(base).collect::<Option<Vec<_>>>().ok_or_else(|| "no occlusion was baked".into())
    }

    fn of_skin(&self, all: &[f32]) -> Vec<f32> {
        self.skin.iter().map(|&vertex| all[vertex]).collect()
    }

    /// How many poses are baked, where every `step`th frame is one, and the frames as `render --occlusion-rate` has them.
    fn between(&self, bakes: &[PoseBake], step: usize) -> Result<(usize, Vec<Vec<f32>>)> {
        let last = bakes.len() - 1;
        let frame = |i: usize| -> Option<PoseBake> {
            let (from, to) = (i / step * step, (i / step * step + step).min(last));
            match i - from {
                0 => Some(bakes[i].clone()),
                after => bakes[from].between(&bakes[to], after as f32 / (to - from) as f32),
            }
        };
        let frames: Option<Vec<PoseBake>> = (0..=last).map(frame).collect();
        Ok((last.div_ceil(step) + 1, self.open(&frames.ok_or("two bakes are not of one mesh")?)?))
    }

    /// Each frame's own bake, with rays that are drawn by where each vertex stands in it.
    fn drawn_anew(&self, rays: u32) -> Vec<Vec<f32>> {
        let open = |pose: &PosedMesh| self.of_skin(&bake_occlusion(&|_| pose.clone(), 0, rays).base);
        self.poses.iter().map(open).collect()
    }

    /// Each frame by what is baked once for each morph target, as `render --occlusion targets` has it, and the seconds of
    /// the bake by the frame.
    fn by_targets(&self, loaded: Loaded) -> Result<(Vec<Vec<f32>>, f64)> {
        let baked = loaded.bake()?;
        let occlusion = baked.occlusion.as_ref().ok_or("no occlusion was baked")?;
        let frames = self.weights.iter().map(|weights| self.of_skin(&occlusion.posed(weights))).collect();
        let rows = baked.stats.rows.iter().filter(|row| row.name == "occlusion");
        Ok((frames, rows.map(|row| row.seconds).sum::<f64>() / self.poses.len() as f64))
    }
}

//! docs/animation.json, and the plot beside it: occlusion of a head that nods and grimaces, baked for each frame of its clip,
//! or for fewer poses. `transfer.rs` has what is said of the sky that its vertices see.
//!
//! Rays of a vertex are drawn by where it stands at rest, and turn with the surface. Two bakes beside the program's own
//! tell their noise from what truly changes: one with many rays, and one whose rays are drawn by where each vertex
//! stands in the frame, so that their noise is another in each. `flicker.rs` says how frames are compared.

use serde_json::{Value, json};
use skinfit::bake::PoseBake;
use skinfit::bake::occlusion::bake_occlusion;
use skinfit::prepare::Loaded;
use skinfit::scene::mesh::PosedMesh;

use crate::clip::{Clip, FPS, RATES, head, seconds_of};
use crate::flicker::{Apart, Pieces, Way, plot};
use crate::lab::{Lab, Result};
use crate::transfer;

/// Rays a vertex of the bake that tells noise from change; a scene has 256 unless it says more.
const MANY: u32 = 4096;

/// What the bake is called.
const OCCLUSION: &str = "occlusion";

/// Occlusion, and beside it transfer.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let mut measured = occlusion(lab)?;
    measured["transfer"] = transfer::measure(lab)?;
    Ok(measured)
}

/// A row for each way to follow the clip; drawn are those that bake poses of it.
fn occlusion(lab: &Lab) -> Result<Value> {
    // Asked for by what it takes light from; whatever light that is, this is the same.
    let loaded = head(lab, "occlusion")?;
    let mut scene = loaded.scene.clone();
    let clip = Clip::of(&scene)?;
    let rays = scene.quality.occlusion_rays;
    let (bakes, seconds) = clip.baked(&scene, OCCLUSION)?;
    let each = of_each(&clip, &bakes)?;
    scene.quality.occlusion_rays = MANY;
    let (fine, fine_seconds) = clip.baked(&scene, OCCLUSION)?;
    let fine = of_each(&clip, &fine)?;
    let drawn_anew = drawn_anew(&clip, rays);
    // Seconds of `count` bakes, by the frame.
    let of_poses = |count: usize| seconds * count as f64 / clip.poses.len() as f64;
    let way = |name: &str, rate, seconds, frames| Way { name: name.to_owned(), rate, seconds, frames };
    let mut ways = vec![way("each frame", Some(FPS), Some(of_poses(clip.poses.len())), each.clone())];
    for rate in RATES {
        let frame = |i: usize| open(&clip, &clip.between(&bakes, rate, i)?);
        let frames = (0..clip.poses.len()).map(frame).collect::<Result<_>>()?;
        let seconds = of_poses(clip.baked_at(rate));
        ways.push(way(&format!("{rate} a second"), Some(rate), Some(seconds), frames));
    }
    ways.push(way("many rays", Some(FPS), Some(fine_seconds), fine.clone()));
    ways.push(way("other rays", Some(FPS), None, drawn_anew));
    plot(&lab.root.join("docs/images/occlusion_flicker.svg"), &ways, FPS)?;
    ways.push(way("one bake", Some(0), Some(of_poses(1)), vec![each[0].clone(); each.len()]));
    let (frames, spent) = by_targets(&clip, loaded)?;
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

/// The open shares of the skin's vertices.
fn open(clip: &Clip, bake: &PoseBake) -> Result<Vec<f32>> {
    Ok(clip.of_skin(&bake.occlusion.as_ref().ok_or("no occlusion was baked")?.base, 1))
}

fn of_each(clip: &Clip, bakes: &[PoseBake]) -> Result<Vec<Vec<f32>>> {
    bakes.iter().map(|bake| open(clip, bake)).collect()
}

/// Each frame's own bake, with rays that are drawn by where each vertex stands in it.
fn drawn_anew(clip: &Clip, rays: u32) -> Vec<Vec<f32>> {
    let open = |pose: &PosedMesh| clip.of_skin(&bake_occlusion(&|_| pose.clone(), 0, rays).base, 1);
    clip.poses.iter().map(open).collect()
}

/// Each frame by what is baked once for each morph target, as `render --occlusion targets` has it, and the seconds of the
/// bake by the frame.
fn by_targets(clip: &Clip, loaded: Loaded) -> Result<(Vec<Vec<f32>>, f64)> {
    let baked = loaded.bake()?;
    let occlusion = baked.occlusion.as_ref().ok_or("no occlusion was baked")?;
    let frames = clip.weights.iter().map(|weights| clip.of_skin(&occlusion.posed(weights), 1)).collect();
    Ok((frames, seconds_of(&baked.stats, OCCLUSION)? / clip.poses.len() as f64))
}

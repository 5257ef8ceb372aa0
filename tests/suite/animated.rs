//! Ambient occlusion through an animation.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use skinfit::bake::{PoseBake, bake_pose};
use skinfit::demo;
use skinfit::model::effects::{Effect, Effects};
use skinfit::prepare::{Baked, ClipOcclusion, PrepareOptions, Views};
use skinfit::scene::animation::Animation;
use tempfile::TempDir;

fn cache() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics")
}

/// The built-in scene at the beginning of its nod, its expressions left to the animation.
fn nodding(clip: Option<ClipOcclusion>) -> (Baked, TempDir) {
    let kept = demo::kept_scene(&cache(), Some(&cache())).unwrap();
    let mut text = std::fs::read_to_string(&kept).unwrap();
    for name in ["head.glb", "color.png", "normal.png", "specular.png", "attenuator.png", "environment.exr"] {
        text = text.replace(&format!("{name:?}"), &format!("{:?}", kept.with_file_name(name)));
    }
    let own = text.find("morph_weights").unwrap();
    text.insert(own, '#');
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, text).unwrap();
    let options = PrepareOptions {
        effects: Some(Effects::SURFACE.with(Effect::Morph).with(Effect::Skin)),
        views: Views::First,
        cache: Some(cache()),
        time: Some(0.0),
        clip,
        ..PrepareOptions::default()
    };
    // The animation is opened from the same file.
    (Baked::new(&scene, &options).unwrap(), folder)
}

#[test]
fn occlusion_is_baked_for_the_targets_that_a_clip_moves_and_for_no_others() {
    let has_own = |baked: &Baked| -> Vec<bool> {
        baked.occlusion.as_ref().unwrap().morphs.iter().map(|set| !set.is_empty()).collect()
    };
    // At its beginning the nod gives no target a weight; later all but the fourth.
    assert_eq!(has_own(&nodding(None).0), [false; 5]);
    let (clip, _) = nodding(Some(ClipOcclusion::Targets));
    assert_eq!(has_own(&clip), [true, true, true, false, true]);
    let (again, _) = nodding(Some(ClipOcclusion::Targets));
    assert!(again.stats.rows.iter().all(|row| row.cached), "{:?}", again.stats.rows);
    assert!(nodding(Some(ClipOcclusion::Frames)).0.occlusion.is_none());
}

#[test]
fn an_animated_morph_darkens_what_it_closes_about_as_a_bake_of_the_frame_does() {
    let (baked, _folder) = nodding(Some(ClipOcclusion::Targets));
    let occlusion = baked.occlusion.as_ref().unwrap();
    let animation = Animation::open(&baked.scene).unwrap().unwrap();
    // The frown of the nod's second key, and three expressions of its third, where neck and skull are at rest.
    for (time, turned) in [(0.5, true), (1.0, false)] {
        let mesh = animation.mesh(time).unwrap();
        let weights: Vec<f32> = mesh.morphs.iter().map(|morph| morph.weight).collect();
        let (frame, stats) = bake_pose(&baked.scene, &mesh.pose(), None, Some(&cache()));
        let frame = frame.occlusion.unwrap();
        assert_eq!(stats.rows.len(), 1);
        let (_, stats) = bake_pose(&baked.scene, &mesh.pose(), None, Some(&cache()));
        assert!(stats.rows[0].cached);
        let targets = occlusion.posed(&weights);
        let apart = |a: &[f32], b: &[f32], at: &[usize]| {
            at.iter().map(|&i| f64::from(a[i] - b[i])).sum::<f64>() / at.len() as f64
        };
        let off = |a: &[f32], b: &[f32], at: &[usize]| {
            at.iter().map(|&i| f64::from((a[i] - b[i]).abs())).sum::<f64>() / at.len() as f64
        };
        // What the frame closes by more than the noise of 256 rays (0.01) could.
        let closed: Vec<usize> =
            (0..frame.base.len()).filter(|&i| occlusion.base[i] - frame.base[i] > 0.05).collect();
        let moved: Vec<usize> =
            (0..frame.base.len()).filter(|&i| (occlusion.base[i] - targets[i]).abs() > 0.01).collect();
        let darker = apart(&occlusion.base, &targets, &closed) / apart(&occlusion.base, &frame.base, &closed);
        let (before, after) = (off(&occlusion.base, &frame.base, &moved), off(&targets, &frame.base, &moved));
        println!(
            "{time} s: {} vertices closed, of which the targets darken {darker:.2}; mean error where targets change \
             anything {after:.4}, with none baked {before:.4} ({} vertices)",
            closed.len(),
            moved.len()
        );
        assert!(moved.len() > 100, "{}", moved.len());
        if turned {
            // Bones close the throat too, which no target knows.
            assert!(after < before, "{after} {before}");
        } else {
            assert!(closed.len() > 20 && darker > 0.7, "{} {darker}", closed.len());
            assert!(after < 0.6 * before, "{after} {before}");
        }
    }
}

#[test]
fn bakes_between_two_poses_are_near_those_of_the_frames() {
    let (baked, _folder) = nodding(Some(ClipOcclusion::Frames));
    let animation = Animation::open(&baked.scene).unwrap().unwrap();
    let (first, last) = animation.seconds;
    let bake = |time: f64| {
        let mesh = animation.mesh(time).unwrap();
        bake_pose(&baked.scene, &mesh.pose(), None, Some(&cache())).0
    };
    let values = |bake: &PoseBake| bake.occlusion.as_ref().unwrap().base.clone();
    let off = |a: &[f32], b: &[f32]| {
        a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / a.len() as f64
    };
    // Of eight poses of the nod those around its middle, and the frames half way between them.
    let at = |place: f64| first + place / 8.0 * (last - first);
    let poses = [3.0, 4.0, 5.0].map(|pose| bake(at(pose)));
    let (mut between, mut held) = (0.0, 0.0);
    for ([from, to], place) in poses.array_windows().zip([3.5, 4.5]) {
        let frame = values(&bake(at(place)));
        between += off(&values(&from.between(to, 0.5).unwrap()), &frame) / 2.0;
        held += off(&values(from), &frame) / 2.0;
    }
    println!("mean error of frames between two poses {between:.4}, of the pose before {held:.4}");
    // Half of the way is left of what moves along a line; the noise of 256 rays, which are turned anew where a vertex
    // turns, is not, and neither is what the nod covers and uncovers.
    assert!(between < 0.8 * held && between < 0.01, "{between} {held}");
}

//! Which frames are rendered: one, a turn around the mesh, or an animation; and their files.

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};

use crate::scene::mesh::Mesh;
use crate::scene::view::Camera;

/// One image of a sequence.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) camera: Camera,
    /// Seconds into the animation; `None`: the scene's own pose.
    pub(super) time: Option<f64>,
    pub(super) path: PathBuf,
}

/// The single frame of `camera`.
pub(super) fn still(camera: Camera, output: &Path) -> Vec<Frame> {
    vec![Frame { camera, time: None, path: output.to_owned() }]
}

/// `count` frames of a whole turn of the camera about the vertical axis through the mesh.
pub(super) fn turntable(camera: &Camera, mesh: &Mesh, count: u32, output: &Path) -> Vec<Frame> {
    let axis = middle(mesh);
    let frame = |i: u32| {
        let turn = std::f64::consts::TAU * f64::from(i) / f64::from(count);
        let about_axis =
            DMat4::from_translation(axis) * DMat4::from_rotation_y(-turn) * DMat4::from_translation(-axis);
        let camera = Camera { world_to_camera: camera.world_to_camera * about_axis, ..*camera };
        Frame { camera, time: None, path: numbered(output, i, count) }
    };
    (0..count).map(frame).collect()
}

/// How many frames an animation has, and at which times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pace {
    /// A number of frames from its first key to its last, evenly.
    Even(u32),
    /// Frames a second; all of it once, or a number of frames, which begin again where it ends.
    Rate(f64, Option<u32>),
    /// Frames a second, and a number of rounds, of which each ends where the next begins.
    Rounds(f64, u32),
}

/// The most frames of a sequence.
pub(super) const MOST: u32 = 100_000;
/// Of a frame: a time that misses a key by less is its time. Keys are f32, whose digits end there at ten thousand frames.
pub(super) const ROUNDING: f64 = 1e-3;

impl Pace {
    /// How many frames an animation of `seconds` seconds has; `None` beyond [`MOST`].
    pub(super) fn count(self, seconds: f64) -> Option<u32> {
        let count = match self {
            Self::Even(count) | Self::Rate(_, Some(count)) => f64::from(count),
            Self::Rate(rate, None) => (seconds * rate + ROUNDING).floor() + 1.0,
            Self::Rounds(rate, rounds) => (seconds * rate * f64::from(rounds)).round().max(1.0),
        };
        (1.0..=f64::from(MOST)).contains(&count).then_some(count as u32)
    }

    /// The time of frame `i` of `count`.
    fn time(self, (first, last): (f64, f64), i: u32, count: u32) -> f64 {
        let (seconds, i) = (last - first, f64::from(i));
        match self {
            Self::Even(_) => first + i / f64::from((count - 1).max(1)) * seconds,
            Self::Rate(rate, None) => (first + i / rate).min(last),
            Self::Rate(rate, Some(_)) | Self::Rounds(rate, _) if seconds > 0.0 => {
                // Where a round has whole frames, each has the same times to the bit.
                let (frames, whole) = (seconds * rate, (seconds * rate).round());
                if whole >= 1.0 && (frames - whole).abs() < ROUNDING {
                    (first + (i % whole) / rate).min(last)
                } else {
                    first + (i / rate).rem_euclid(seconds)
                }
            }
            Self::Rate(..) | Self::Rounds(..) => first,
        }
    }
}

/// The frames of an animation between the times of its first key and its last; `None` where there are more than [`MOST`].
pub(super) fn animation(camera: &Camera, ends: (f64, f64), pace: Pace, output: &Path) -> Option<Vec<Frame>> {
    let count = pace.count(ends.1 - ends.0)?;
    let frame = |i: u32| {
        let time = Some(pace.time(ends, i, count));
        Frame { camera: *camera, time, path: numbered(output, i, count) }
    };
    Some((0..count).map(frame).collect())
}

/// The middle of the mesh's bounding box as it stands.
fn middle(mesh: &Mesh) -> DVec3 {
    let posed = mesh.pose().positions;
    let low = posed.iter().copied().reduce(glam::Vec3::min).unwrap_or_default();
    let high = posed.iter().copied().reduce(glam::Vec3::max).unwrap_or_default();
    0.5 * (low.as_dvec3() + high.as_dvec3())
}

/// `turn.png` as `turn.0007.png`.
fn numbered(output: &Path, i: u32, count: u32) -> PathBuf {
    let digits = (count.max(1) - 1).to_string().len().max(4);
    let stem = output.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = output.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
    output.with_file_name(format!("{stem}.{i:0digits$}.{ending}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn an_animation_goes_evenly_at_a_rate_or_around() {
        let camera = Camera::pinhole(DMat4::IDENTITY, 0.5, [4, 4]);
        let times = |pace: Pace| -> Vec<f64> {
            let frames = animation(&camera, (1.0, 2.0), pace, Path::new("a.png")).unwrap();
            frames.iter().filter_map(|frame| frame.time).collect()
        };
        assert_eq!(times(Pace::Even(3)), [1.0, 1.5, 2.0]);
        assert_eq!(times(Pace::Even(1)), [1.0]);
        assert_eq!(times(Pace::Rate(4.0, None)), [1.0, 1.25, 1.5, 1.75, 2.0]);
        assert_eq!(times(Pace::Rate(4.0, Some(6))), [1.0, 1.25, 1.5, 1.75, 1.0, 1.25]);
        assert_eq!(times(Pace::Rounds(2.0, 2)), [1.0, 1.5, 1.0, 1.5]);
        // Keys are f32, and 9.7 is a little more there, or a little less: the last frame is the last key all the same, and
        // a round has 291 frames whose times come again.
        let last = f64::from(9.7_f32);
        let at = |pace: Pace| animation(&camera, (0.0, last), pace, Path::new("a.png")).unwrap();
        let once = at(Pace::Rate(30.0, None));
        assert_eq!((once.len(), once[291].time), (292, Some(last)));
        let twice = at(Pace::Rounds(30.0, 2));
        assert_eq!(twice.len(), 582);
        assert!((0..291).all(|i| twice[i].time == twice[291 + i].time && twice[i].time < Some(last - 0.03)));
        // An animation of one key stands still.
        let still = animation(&camera, (1.0, 1.0), Pace::Rounds(24.0, 3), Path::new("a.png")).unwrap();
        assert_eq!(still.len(), 1);
        assert!(animation(&camera, (0.0, 1e6), Pace::Rate(24.0, None), Path::new("a.png")).is_none());
    }

    #[test]
    fn a_turn_keeps_the_distance_and_begins_where_the_camera_stands() {
        let positions = vec![Vec3::new(1.0, 0.0, 2.0), Vec3::new(3.0, 4.0, 4.0)];
        let mesh = Mesh { normals: vec![Vec3::Y; 2], positions, ..Mesh::default() };
        let world_to_camera = DMat4::from_translation(DVec3::new(-2.0, -1.0, -9.0));
        let camera = Camera::pinhole(world_to_camera, 0.5, [4, 4]);
        let frames = turntable(&camera, &mesh, 4, Path::new("a/turn.png"));
        assert_eq!(frames[0].camera, camera);
        // From +Z a quarter turn leads to +X: the axis is at (2, 3), the eye 6 away from it.
        let eye = frames[1].camera.eye();
        assert!((eye - DVec3::new(8.0, 1.0, 3.0)).length() < 1e-12, "{eye}");
        assert_eq!(frames[1].path, Path::new("a/turn.0001.png"));
    }
}

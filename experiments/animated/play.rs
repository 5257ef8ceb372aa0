//! The clip played, timed, and held against the CPU engine.

use std::collections::VecDeque;
use std::error::Error;
use std::sync::mpsc::channel;
use std::time::Instant;

use serde_json::{Value, json};
use skinfit::gpu::painter::{Beside, CpuPainter, Painter};
use skinfit::gpu::{Gpu, GpuError, Renderer};
use skinfit::model::gain::Gain;
use skinfit::prepare::Baked;
use skinfit::render::image::Image;
use skinfit::scene::animation::Animation;
use skinfit::scene::mesh::Mesh;
use skinfit::scene::view::Camera;

use crate::rig::{Rig, SECONDS, apart};

/// Frames that the adapter may have before it at most, while the next pose is computed.
pub(crate) const IN_FLIGHT: usize = 3;
/// Frames that wake the adapter up at most, and are not counted.
const AWAKE: usize = 60;

/// The mesh as it goes through the clip.
pub(crate) struct Player<'a> {
    pub(crate) rig: &'a Rig,
    pub(crate) mesh: Mesh,
    pub(crate) camera: Camera,
    pub(crate) gain: Gain,
    pub(crate) frames: usize,
}

/// A frame as the CPU engine draws it.
pub(crate) struct Reference {
    pub(crate) frame: usize,
    pub(crate) image: Image,
    /// How far the player's pose is from the one that is drawn: the greatest difference of bones and weights.
    pub(crate) pose_apart: f32,
}

/// Milliseconds of the parts of a frame, one number a frame.
#[derive(Default)]
struct Times {
    pose: Vec<f64>,
    upload: Vec<f64>,
    draw: Vec<f64>,
    whole: Vec<f64>,
}

impl Player<'_> {
    /// Seconds into the clip of a frame: the last is a frame before the clip begins again.
    pub(crate) fn time(&self, frame: usize) -> f64 {
        SECONDS * frame as f64 / self.frames as f64
    }

    /// The first frame, the middle one and the last.
    fn looked_at(&self) -> Vec<usize> {
        let mut frames = vec![0, self.frames / 2, self.frames - 1];
        frames.dedup();
        frames
    }

    /// What frames take that are waited for, and those that are not; nothing is read back.
    pub(crate) fn timed(&mut self, gpu: &Gpu, renderer: &mut Renderer) -> Result<Value, GpuError> {
        self.in_flight(gpu, renderer, self.frames.min(AWAKE))?;
        let mut waited = Times::default();
        for frame in 0..self.frames {
            let start = Instant::now();
            self.frame(renderer, frame, &mut waited)?;
            let drawing = Instant::now();
            gpu.wait()?;
            // What was submitted is drawn by now.
            if let Some(draw) = waited.draw.last_mut() {
                *draw += milliseconds(drawing);
            }
            waited.whole.push(milliseconds(start));
        }
        let (flying, seconds) = self.in_flight(gpu, renderer, self.frames)?;
        // Of passes alone, the pose standing still.
        let passes = renderer.frame_times(&self.camera, self.frames)?;
        let upload_and_draw =
            waited.upload.iter().zip(&waited.draw).map(|(upload, draw)| upload + draw).collect();
        let rate = median(&waited.whole).map(|milliseconds| 1e3 / milliseconds);
        Ok(json!({
            "pose_ms": spread(waited.pose),
            "upload_ms": spread(waited.upload),
            "draw_ms": spread(waited.draw),
            "upload_and_draw_ms": spread(upload_and_draw),
            "frame_ms": spread(waited.whole),
            "frames_per_second": rate,
            "passes_ms": spread(passes),
            "in_flight": {
                "frames": IN_FLIGHT,
                "pose_ms": spread(flying.pose),
                "upload_ms": spread(flying.upload),
                "frame_ms": spread(flying.whole),
                "frames_per_second": self.frames as f64 / seconds,
            },
        }))
    }

    /// `frames` frames, with some on their way while the next pose is computed; and the seconds that they took together.
    fn in_flight(
        &mut self,
        gpu: &Gpu,
        renderer: &mut Renderer,
        frames: usize,
    ) -> Result<(Times, f64), GpuError> {
        let (mut times, mut flying) = (Times::default(), VecDeque::new());
        let start = Instant::now();
        for frame in 0..frames {
            let begun = Instant::now();
            self.frame(renderer, frame, &mut times)?;
            let (send, told) = channel();
            gpu.queue.on_submitted_work_done(move || {
                // The receiver may have given up.
                let _ = send.send(());
            });
            flying.push_back(told);
            if flying.len() > IN_FLIGHT
                && let Some(oldest) = flying.pop_front()
            {
                gpu.until(&oldest)?;
            }
            times.whole.push(milliseconds(begun));
        }
        gpu.wait()?;
        Ok((times, start.elapsed().as_secs_f64()))
    }

    /// Pose, upload and submit a frame.
    fn frame(&mut self, renderer: &mut Renderer, frame: usize, times: &mut Times) -> Result<(), GpuError> {
        let start = Instant::now();
        self.rig.pose(self.time(frame), &mut self.mesh);
        times.pose.push(milliseconds(start));
        let start = Instant::now();
        self.show(renderer)?;
        times.upload.push(milliseconds(start));
        let start = Instant::now();
        renderer.draw_unread(&self.camera, self.gain)?;
        times.draw.push(milliseconds(start));
        Ok(())
    }

    /// Hand the pose to the renderer.
    fn show(&self, renderer: &mut Renderer) -> Result<(), GpuError> {
        let weights: Vec<f32> = self.mesh.morphs.iter().map(|morph| morph.weight).collect();
        renderer.set_pose(&self.mesh.bones, &weights)
    }

    /// The image of a frame.
    pub(crate) fn image(&mut self, renderer: &mut Renderer, frame: usize) -> Result<Image, GpuError> {
        self.rig.pose(self.time(frame), &mut self.mesh);
        self.show(renderer)?;
        Ok(renderer.render(&self.camera, self.gain)?.image)
    }

    /// The frames that are looked at, as the CPU engine draws the poses that the core reads from the mesh file.
    pub(crate) fn references(
        &mut self,
        baked: &Baked,
        animation: &Animation,
    ) -> Result<Vec<Reference>, Box<dyn Error>> {
        let mut painter = CpuPainter::new(baked)?;
        let beside = Beside { layers: false, haze: false };
        let mut references = Vec::new();
        for frame in self.looked_at() {
            let time = self.time(frame);
            let mesh = animation.mesh(time)?;
            self.rig.pose(time, &mut self.mesh);
            let pose_apart = apart(&self.mesh, &mesh);
            painter.set_mesh(&mesh, None)?;
            let image = painter.paint(&self.camera, self.gain, beside)?.image;
            references.push(Reference { frame, image, pose_apart });
        }
        Ok(references)
    }
}

/// How far an image is from the reference, relative to that one's mean radiance where it is covered.
pub(crate) struct Apart {
    /// The greatest difference of a channel, outlines and all.
    pub(crate) most: f32,
    /// The mean of the pixels' greatest differences, over all that either covers.
    pub(crate) mean: f32,
    /// What 99 of 100 pixels stay below that both cover wholly.
    pub(crate) inside: f32,
}

impl Apart {
    /// `None` where the reference shows nothing that could be compared.
    pub(crate) fn of(reference: &Image, image: &Image) -> Option<Self> {
        let (mut radiance, mut covered) = (0.0, 0_usize);
        let (mut all, mut inside) = (Vec::new(), Vec::new());
        for i in 0..reference.rgb.len().min(image.rgb.len()) {
            let (a, b) = (reference.alpha[i], image.alpha[i]);
            if a > 0.0 {
                radiance += reference.rgb[i].iter().map(|x| f64::from(x.abs())).sum::<f64>() / 3.0;
                covered += 1;
            }
            let apart = |c: usize| (reference.rgb[i][c] - image.rgb[i][c]).abs();
            // A number that is none is as far off as can be; `max` would pass it over.
            let apart = [0, 1, 2].map(apart).map(|x| if x.is_nan() { f32::INFINITY } else { x });
            let apart = apart.into_iter().fold(0.0, f32::max);
            if a > 0.0 || b > 0.0 {
                all.push(apart);
            }
            if a == 1.0 && b == 1.0 {
                inside.push(apart);
            }
        }
        let mean = (radiance / covered as f64) as f32;
        if inside.is_empty() || mean <= 0.0 || mean.is_nan() {
            return None;
        }
        inside.sort_by(f32::total_cmp);
        let at = (inside.len() * 99 / 100).min(inside.len() - 1);
        Some(Self {
            most: all.iter().copied().fold(0.0, f32::max) / mean,
            mean: all.iter().sum::<f32>() / all.len() as f32 / mean,
            inside: inside[at] / mean,
        })
    }
}

fn milliseconds(since: Instant) -> f64 {
    1e3 * since.elapsed().as_secs_f64()
}

/// The median; `None` of nothing.
fn median(times: &[f64]) -> Option<f64> {
    let mut times = times.to_vec();
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied()
}

/// The median and what 95 of 100 stay below; `null` of nothing.
fn spread(mut times: Vec<f64>) -> Value {
    times.sort_by(f64::total_cmp);
    match times.len() {
        0 => Value::Null,
        count => json!({"median": times[count / 2], "p95": times[(count * 95 / 100).min(count - 1)]}),
    }
}

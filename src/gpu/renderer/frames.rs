//! Frames: drawn, and read back, timed, or left on the adapter.

use wgpu::CommandEncoderDescriptor;

use super::{Drawer, Layer, Renderer};
use crate::GpuError;
use crate::atlas::ATLAS;
use crate::constants::Values;
use crate::model::gain::Gain;
use crate::readback::Copy;
use crate::scene::view::Camera;
use crate::stage::{Drawn, End};
use crate::timing::{PassTime, Timer};

/// What was drawn and read back.
pub(super) struct Read {
    /// The place of its targets.
    pub(super) stage: usize,
    pub(super) planes: Vec<Vec<f32>>,
    pub(super) times: Vec<PassTime>,
}

impl Renderer {
    /// GPU milliseconds of each of `frames` frames, drawn one right after another with nothing read back: an
    /// adapter that waits for the CPU between frames lowers its clock. Empty where there are no timestamps.
    /// Without the bloom. Levels of the UV atlas are made for each, as where the pose or the light moves from frame to
    /// frame.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn frame_times(&mut self, camera: &Camera, frames: usize) -> Result<Vec<f64>, GpuError> {
        self.times_of(camera, frames, |_| true)
    }

    /// As [`Self::frame_times`], of the passes over the UV atlas alone. Empty, too, of an adapter that is a program on the
    /// CPU: the host's clock tells no pass from another.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn atlas_times(&mut self, camera: &Camera, frames: usize) -> Result<Vec<f64>, GpuError> {
        if self.gpu.is_software() {
            return Ok(Vec::new());
        }
        self.times_of(camera, frames, |pass| pass == ATLAS)
    }

    fn times_of(
        &mut self,
        camera: &Camera,
        frames: usize,
        counts: fn(&str) -> bool,
    ) -> Result<Vec<f64>, GpuError> {
        let program = self.program(Layer::Whole)?;
        let stage = self.stage(camera, program)?;
        let Self { gpu, programs, plain, stages, uploads, morph_weights, .. } = self;
        let Drawer { program, plain: pipeline, .. } = &programs[program];
        let (stage, morph_weights) = (&stages[stage], morph_weights.as_slice());
        let plain = plain.as_ref().zip(pipeline.as_ref());
        let mut timers = Vec::with_capacity(frames);
        for _ in 0..frames {
            program.forget();
            for (i, &tile) in stage.targets.tiles.iter().enumerate() {
                let mut timer = Timer::new(gpu);
                let params = &uploads.content().params;
                let values = Values { params, camera, tile, morph_weights };
                program.set(gpu, &values);
                plain
                    .iter()
                    .for_each(|(plain, _)| plain.set(gpu, &values, stage.targets.key.antialias.grid()));
                let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
                uploads.draw_shadow_maps(gpu, &mut encoder, morph_weights, Some(&mut timer));
                let drawn = Drawn { program, plain };
                stage.encode_tile(gpu, &mut encoder, &drawn, tile, i == 0, Some(&mut timer));
                timer.finish(&mut encoder);
                gpu.queue.submit([encoder.finish()]);
                if gpu.is_software() {
                    // It may be timed by the host's clock.
                    timer.collect(gpu)?;
                }
                timers.push((i, timer));
            }
        }
        let mut times = Vec::with_capacity(frames);
        for (tile, mut timer) in timers {
            if !gpu.is_software() {
                timer.collect(gpu)?;
            }
            let counted = timer.times.iter().filter(|time| counts(time.pass));
            let milliseconds: f64 = counted.map(|time| time.milliseconds).sum();
            match times.last_mut() {
                Some(last) if tile > 0 => *last += milliseconds,
                _ => times.push(milliseconds),
            }
        }
        Ok(if gpu.timestamps() { times } else { Vec::new() })
    }

    /// Have the image drawn that `camera` sees, times `gain`, and leave it on the adapter: nothing is waited for nor read
    /// back, so that whoever plays an animation has the next pose ready meanwhile.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn draw_unread(&mut self, camera: &Camera, gain: impl Into<Gain>) -> Result<(), GpuError> {
        self.show_behind(camera);
        self.submit(Layer::Whole, camera, gain.into(), End::Unread, None).map(drop)
    }

    /// Draw a layer, and read it.
    pub(super) fn draw(
        &mut self,
        layer: Layer,
        camera: &Camera,
        gain: Gain,
        end: End,
    ) -> Result<Read, GpuError> {
        let mut timer = self.options.timed.then(|| Timer::new(&self.gpu));
        let (stage, copies) = self.submit(layer, camera, gain, end, timer.as_mut())?;
        let planes = copies.iter().map(|copy| copy.read(&self.gpu)).collect::<Result<Vec<_>, _>>()?;
        Ok(Read { stage, planes, times: timer.map(|timer| timer.times).unwrap_or_default() })
    }

    /// Have an image drawn: the place of the targets that it is drawn into, and copies of what it is made of. Waits
    /// only where it is timed.
    pub(super) fn submit(
        &mut self,
        layer: Layer,
        camera: &Camera,
        gain: Gain,
        end: End,
        mut timer: Option<&mut Timer>,
    ) -> Result<(usize, Vec<Copy>), GpuError> {
        let program = self.program(layer)?;
        let place = self.stage(camera, program)?;
        let Self { gpu, programs, plain, stages, uploads, morph_weights, .. } = self;
        let Drawer { program, plain: pipeline, .. } = &programs[program];
        let (stage, morph_weights) = (&stages[place], morph_weights.as_slice());
        let plain = plain.as_ref().zip(pipeline.as_ref());
        let mut copies = Vec::new();
        let tiles = &stage.targets.tiles;
        for (i, &tile) in tiles.iter().enumerate() {
            let params = &uploads.content().params;
            let values = Values { params, camera, tile, morph_weights };
            program.set(gpu, &values);
            plain.iter().for_each(|(plain, _)| plain.set(gpu, &values, stage.targets.key.antialias.grid()));
            let mut encoder =
                gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("frame") });
            uploads.draw_shadow_maps(gpu, &mut encoder, morph_weights, timer.as_deref_mut());
            let drawn = Drawn { program, plain };
            stage.encode_tile(gpu, &mut encoder, &drawn, tile, i == 0, timer.as_deref_mut());
            if i + 1 == tiles.len() {
                copies = stage.encode_end(gpu, &mut encoder, gain, end, timer.as_deref_mut());
            }
            if let Some(timer) = &mut timer {
                timer.finish(&mut encoder);
            }
            gpu.queue.submit([encoder.finish()]);
            if let Some(timer) = &mut timer {
                timer.collect(gpu)?;
            }
            gpu.check()?;
        }
        Ok((place, copies))
    }
}

//! The window without a display: drawn into a texture, and left as an image.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use eframe::egui;
use eframe::egui_wgpu::{
    RenderState, RendererOptions, ScreenDescriptor, WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew,
};
use wgpu::{
    BufferDescriptor, BufferUsages, Color, CommandEncoderDescriptor, Extent3d, LoadOp, MapMode, Operations,
    PollType, RenderPassColorAttachment, RenderPassDescriptor, StoreOp, TexelCopyBufferInfo,
    TexelCopyBufferLayout, Texture, TextureDescriptor, TextureDimension, TextureUsages,
    TextureViewDescriptor,
};

use crate::Window;
use crate::host::{Host, ViewError};
use crate::start::Start;
use crate::window::picture;

/// Flat colours are drawn as they are: dithering costs a software adapter a good part of a frame.
const OPTIONS: RendererOptions = RendererOptions {
    msaa_samples: 0,
    depth_stencil_format: None,
    dithering: false,
    predictable_texture_filtering: false,
};
/// How long a device is waited for.
const PATIENCE: Duration = Duration::from_secs(60);
/// How long a frame that waits for its answers sleeps.
const NAP: Duration = Duration::from_millis(5);

/// A window that nobody sees.
pub struct Offscreen {
    state: RenderState,
    ctx: egui::Context,
    /// The window itself.
    pub window: Window,
    size: [u32; 2],
    scale: f32,
    frame: u32,
    events: Vec<egui::Event>,
}

impl std::fmt::Debug for Offscreen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Offscreen").field("size", &self.size).finish_non_exhaustive()
    }
}

/// A device that draws windows, panes and all, without a display.
///
/// # Errors
/// When there is none.
pub fn render_state() -> Result<RenderState, ViewError> {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.instance_descriptor.backends = wgpu::Backends::PRIMARY;
    let setup = WgpuSetup::CreateNew(setup);
    let instance = pollster::block_on(setup.new_instance());
    let configuration = WgpuConfiguration { wgpu_setup: setup, ..WgpuConfiguration::default() };
    let made = RenderState::create(&configuration, &instance, None, OPTIONS);
    let state = pollster::block_on(made).map_err(|error| ViewError::NoAdapter(error.to_string()))?;
    picture::install(&state);
    Ok(state)
}

impl Offscreen {
    /// A window of `size` pixels, `scale` of them a point.
    ///
    /// # Errors
    /// When no adapter draws it.
    pub fn new(host: Arc<dyn Host>, start: Start, size: [u32; 2], scale: f32) -> Result<Self, ViewError> {
        let state = render_state()?;
        let ctx = egui::Context::default();
        let window = Window::new(host, start, &ctx);
        Ok(Self { state, ctx, window, size, scale, frame: 0, events: Vec::new() })
    }

    /// What a hand would do before the next frame.
    pub fn push(&mut self, event: egui::Event) {
        self.events.push(event);
    }

    /// A frame: polled, laid out, drawn, and waited for. The texture that it is in.
    ///
    /// # Errors
    /// When the device does not answer.
    pub fn frame(&mut self) -> Result<Texture, ViewError> {
        self.window.session.poll();
        let [width, height] = self.size;
        let points = egui::vec2(width as f32, height as f32) / self.scale;
        let mut input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points)),
            time: Some(f64::from(self.frame) / 60.0),
            focused: true,
            max_texture_side: Some(self.state.device.limits().max_texture_dimension_2d as usize),
            events: std::mem::take(&mut self.events),
            ..egui::RawInput::default()
        };
        let viewport = input.viewports.entry(egui::ViewportId::ROOT).or_default();
        viewport.native_pixels_per_point = Some(self.scale);
        self.frame += 1;
        let window = &mut self.window;
        let output = self.ctx.run_ui(input, |ui| window.show(ui));
        self.draw(output)
    }

    /// Whether the window is complete: no request is open.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.window.session.is_idle()
    }

    /// Frames until the window is complete, and some for its layout to come to rest. The last one.
    ///
    /// # Errors
    /// When the device does not answer, or the scene was refused.
    pub fn settle(&mut self) -> Result<Texture, ViewError> {
        loop {
            let texture = self.frame()?;
            if self.window.session.opened().is_none() && !self.window.session.is_opening() {
                return Err(ViewError::Scene(self.window.session.told().join("\n")));
            }
            if self.is_idle() {
                // Answers that have come since are taken in and requested anew, and bars find their sizes.
                let mut last = texture;
                for _ in 0..4 {
                    last = self.frame()?;
                }
                if self.is_idle() {
                    return Ok(last);
                }
            }
            std::thread::sleep(NAP);
        }
    }

    fn draw(&self, mut output: egui::FullOutput) -> Result<Texture, ViewError> {
        let RenderState { device, queue, target_format, renderer, .. } = &self.state;
        let mut renderer = renderer.write();
        let scale = output.pixels_per_point;
        let shapes = self.ctx.tessellate(output.shapes, scale);
        let screen = ScreenDescriptor { size_in_pixels: self.size, pixels_per_point: scale };
        for (id, deltas) in output.textures_delta.set.drain() {
            for delta in deltas {
                renderer.update_texture(device, queue, id, &delta);
            }
        }
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("window") });
        let mut commands = renderer.update_buffers(device, queue, &mut encoder, &shapes, &screen);
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("window"),
            size: Extent3d { width: self.size[0], height: self.size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: *target_format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&TextureViewDescriptor::default());
        {
            let attachment = RenderPassColorAttachment {
                view: &view,
                resolve_target: None,
                depth_slice: None,
                ops: Operations { load: LoadOp::Clear(Color::BLACK), store: StoreOp::Store },
            };
            let pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(attachment)],
                ..RenderPassDescriptor::default()
            });
            renderer.render(&mut pass.forget_lifetime(), &shapes, &screen);
        }
        commands.push(encoder.finish());
        queue.submit(commands);
        for id in output.textures_delta.free.drain() {
            renderer.free_texture(&id);
        }
        let wait = PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
        device.poll(wait).map_err(|error| ViewError::NoAdapter(error.to_string()))?;
        Ok(texture)
    }

    /// A frame's pixels: sRGB with alpha, row by row.
    ///
    /// # Errors
    /// When the device does not answer.
    pub fn pixels(&self, texture: &Texture) -> Result<Vec<u8>, ViewError> {
        let (device, queue) = (&self.state.device, &self.state.queue);
        let (width, height) = (texture.width(), texture.height());
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some("window"),
            size: u64::from(row) * u64::from(height),
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        let layout = TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            TexelCopyBufferInfo { buffer: &buffer, layout },
            texture.size(),
        );
        queue.submit([encoder.finish()]);
        let failed = |reason: String| ViewError::NoAdapter(reason);
        let (send, told) = std::sync::mpsc::channel();
        buffer.slice(..).map_async(MapMode::Read, move |done| {
            // The receiver waits below.
            let _ = send.send(done);
        });
        let wait = PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
        device.poll(wait).map_err(|error| failed(error.to_string()))?;
        let mapped = told.recv().map_err(|error| failed(error.to_string()))?;
        mapped.map_err(|error| failed(error.to_string()))?;
        let bytes = buffer.slice(..).get_mapped_range().map_err(|error| failed(error.to_string()))?;
        let rows = bytes.chunks_exact(row as usize).flat_map(|row| &row[..4 * width as usize]);
        let mut pixels: Vec<u8> = rows.copied().collect();
        if is_bgra(self.state.target_format) {
            pixels.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        Ok(pixels)
    }

    /// Wait until the window is complete, and leave it as a PNG.
    ///
    /// # Errors
    /// When the scene was refused, the device does not answer, or the file cannot be written.
    pub fn screenshot(&mut self, file: &Path) -> Result<(), ViewError> {
        let texture = self.settle()?;
        write(file, &self.pixels(&texture)?, self.size)
    }
}

const fn is_bgra(format: wgpu::TextureFormat) -> bool {
    matches!(format, wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb)
}

/// Leave pixels of four bytes as a PNG.
pub(crate) fn write(file: &Path, pixels: &[u8], [width, height]: [u32; 2]) -> Result<(), ViewError> {
    let unwritable = |reason: String| ViewError::Unwritable { path: file.display().to_string(), reason };
    let opaque: Vec<u8> = pixels.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    image::ImageEncoder::write_image(encoder, &opaque, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|error| unwritable(error.to_string()))?;
    skinfit_core::output::write(file, &bytes).map_err(|error| unwritable(error.to_string()))
}
